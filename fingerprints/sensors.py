"""Fingerprints of the effects on what is recorded."""

from __future__ import annotations

import numpy as np

from fingerprints.sheet import WITH, WITHOUT, Sheet, angle, clock, hold, label, pressure

__all__ = ["late_clock", "late_pressure"]

NAMES = ("without", "with the effect")


def late_pressure(sheet: Sheet) -> None:
    """A fill, then the arm swings on the shut-in air."""
    time = clock(4.0, 0.002)
    runs = sheet.run(
        valve_command=hold(time, (0.0, 5.0), (0.2, 8.0), (0.3, 5.0)), sample_time=0.002
    )
    axes = sheet.axes("fx;sx", width_ratios=[1.1, 1])
    sheet.both(axes["f"], runs, pressure, part=slice(75, 225))
    axes["f"].axvspan(0.2, 0.3, color="#dfe3e8", lw=0, zorder=0, label="valve open")
    label(axes["f"], "fill: the record comes late", y="muscle [bar]", legend="upper left")
    sheet.both(axes["s"], runs, pressure, part=slice(500, None))
    label(
        axes["s"],
        "valve shut: late as well where motion makes the pressure",
        y="muscle [bar]",
        legend="upper right",
    )
    sheet.both(axes["x"], runs, pressure, angle, part=slice(500, None))
    label(
        axes["x"],
        "valve shut: pressure against angle, a loop",
        "angle [deg]",
        "muscle [bar]",
        "upper right",
    )


def late_clock(sheet: Sheet) -> None:
    """The same pulse of the command at the start and at the end."""
    last = 60.0
    time = clock(last + 8.0, 0.002)
    pulses = [
        pair
        for k in range(9)
        for pair in (
            (8.0 * k + 1.0, 5.6),
            (8.0 * k + 1.2, 5.0),
            (8.0 * k + 3.0, 4.2),
            (8.0 * k + 4.0, 5.0),
        )
    ]
    runs = sheet.run(valve_command=hold(time, (0.0, 5.0), *pulses), sample_time=0.002)
    axes = sheet.axes("pq;ab")
    for (top, low), begin, words in (
        (("p", "a"), 1.0, "at the start"),
        (("q", "b"), 57.0, "near the end"),
    ):
        part = slice(round((begin - 0.04) / 0.002), round((begin + 0.2) / 0.002))
        for run, colour, name in zip(runs, (WITHOUT, WITH), NAMES, strict=True):
            axes[top].plot(
                1e3 * (time[part] - begin), pressure(run)[part], color=colour, label=name
            )
            axes[low].plot(1e3 * (time[part] - begin), angle(run)[part], color=colour, label=name)
        for letter, channel, unit in (
            (top, "pressure", "muscle [bar]"),
            (low, "angle", "angle [deg]"),
        ):
            axes[letter].axvline(0.0, color="#6b7280", ls=":", lw=1.0, label="command")
            label(
                axes[letter],
                f"{channel}, {words}",
                "time since the command [ms]",
                unit,
                "lower right" if letter == "p" else "",
            )
    for letters in ("pq", "ab"):
        sizes = [np.ptp(axes[letter].get_ylim()) for letter in letters]
        for letter in letters:
            low_end, high_end = axes[letter].get_ylim()
            middle = 0.5 * (low_end + high_end)
            axes[letter].set_ylim(middle - 0.5 * max(sizes), middle + 0.5 * max(sizes))
