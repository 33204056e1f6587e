"""What the page shows."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Final

import numpy as np

from pamrs import rigs
from pamrs._files import MOST_BYTES
from pamrs.channels import laboratory_unit
from pamrs.report.page import render_page
from pamrs.studio._curves import sparkline
from pamrs.studio._folder import Studio, Table

_TEMPLATE: Final = Path(__file__).with_name("page.html.j2")
_UNITS: Final = "bar bar(a) mbar kPa kPa(a) MPa Pa psi deg rad mm m V mV mA N kN kg K degC 1 %"


def page(studio: Studio, token: str) -> str:
    """The page as HTML.

    Parameters
    ----------
    studio : Studio
        The case folder.
    token : str
        What its script sends back with each press of a button.

    Returns
    -------
    str
    """
    rig, rig_error = studio.rig()
    tables, data_error = studio.tables()
    found, result_error = studio.result()
    return render_page(
        _TEMPLATE,
        token=token,
        folder=str(studio.folder),
        rig=rig,
        rig_error=rig_error,
        rig_text=studio.text("rig.toml"),
        most_bytes=MOST_BYTES,
        case_text=studio.text("case.toml"),
        foreign=studio.foreign,
        packaged=rigs.names(),
        logs=[_log(table) for table in tables],
        data_error=data_error,
        channels={name: laboratory_unit(name)[0] or "1" for name in studio.channels()},
        units=_UNITS.split(),
        check=studio.checked,
        green=studio.green,
        running=studio.run is not None and studio.run.running,
        run_error=studio.said_of_run(),
        found=found,
        result_error=result_error,
        stale=found is not None and studio.stale(found),
        has_experiment=studio.result_file("experiment.csv") is not None,
    )


def _log(table: Table) -> dict[str, Any]:
    """A log: its columns with curves, what is proposed, what to look at."""
    item, first = table.item, table.entries[0]
    rows = []
    for each in item.listed:
        channel, entry = table.channel(each.name)
        series = item.log.series[each.name]
        clock = series.stamps or each.name == item.time.get("column")
        rows.append(
            {
                "name": each.name,
                "curve": sparkline(np.asarray(series.values, dtype=float)),
                "low": f"{each.low:.5g}" if math.isfinite(each.low) else "–",
                "high": f"{each.high:.5g}" if math.isfinite(each.high) else "–",
                "rate": f"{each.rate:.4g} Hz" if math.isfinite(each.rate) else "–",
                "clock": clock,
                "channel": channel,
                "unit": entry.get("unit", each.unit),
                "calibrated": "from" in entry,
                "assumed": entry.get("assumed", ""),
            }
        )
    return {
        "file": first["file"],
        "name": first.get("name", ""),
        "role": table.role,
        "roles": table.roles,
        "clockless": "sample_time" in first
        or any(row["channel"] and row["rate"] == "–" for row in rows),
        "spacing": f"{first['sample_time']:g} s" if "sample_time" in first else "",
        "rows": rows,
        "remarks": [*item.log.remarks, *item.remarks],
        "unread": item.log.unread,
    }
