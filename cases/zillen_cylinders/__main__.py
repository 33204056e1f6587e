"""Friction of four real cylinders: fitted on three pressures, predicted at the others; see the
README beside.

    python -m cases.zillen_cylinders out/zillen_cylinders

prints the tables and writes ``report.txt`` and ``friction.png`` into the folder.
"""

import sys
from pathlib import Path

import numpy as np

from cases.zillen_cylinders.compare import COMPARED, compare_friction_laws
from cases.zillen_cylinders.figure import plot_cylinders
from cases.zillen_cylinders.laws import CylinderFriction, HeldOut, fit_cylinder_friction
from cases.zillen_cylinders.record import FrictionRecord, load_friction_folder
from cases.zillen_cylinders.report import held_out_lines
from pamrs.errors import RecordingError

DATA = (
    Path(__file__).parents[2]
    / "../shared/recordings/pneumatic_cylinders_zillen/results_pneumatic-actuator/data/friction"
)
FIT_ON = {7: (1e5, 4e5, 7e5), 4: (1e5, 3e5, 7e5), 3: (1e5, 3e5)}  # [Pa], by the number of runs
LAWS = ("linear", "constant", "proportional", "quadratic")
SLOW_LOGGER = 0.013  # s: the even pressures of Circle were logged at 60 Hz, in another session


def rms(found: list[HeldOut]) -> float:
    """Root mean square of the relative errors, in percent."""
    return 100.0 * float(np.sqrt(np.mean([item.relative_error**2 for item in found])))


def cell(fit: CylinderFriction, name: str, factor: float = 1.0) -> str:
    """A coefficient with its standard error."""
    if name not in fit.params:
        return "not sampled"
    value, stderr = fit.params[name].value * factor, fit.params[name].stderr * factor
    return f"{value:.2f}" + ("" if np.isnan(stderr) else f" +- {stderr:.2f}")


def coefficients(fit: CylinderFriction) -> list[str]:
    """Those of the linear law."""
    return [cell(fit, "f0"), cell(fit, "f1", 1e5), cell(fit, "breakaway_ratio")]


def groups(cylinders: dict[str, list[FrictionRecord]]) -> dict[str, list[FrictionRecord]]:
    """The cylinders; on their own the runs of Circle from one session, and those of X-ring257 below
    its jump.
    """
    fast = [run for run in cylinders["Circle"] if np.median(np.diff(run.time)) < SLOW_LOGGER]
    return {
        **cylinders,
        "Circle, 100 Hz runs": fast,
        "X-ring257 to 5 bar": cylinders["X-ring257"][:3],
    }


def left_out(records: list[FrictionRecord], law: str) -> list[HeldOut]:
    """Each pressure from all the others; empty if these are too few for the law."""
    try:
        return fit_cylinder_friction(records, law=law).leave_one_pressure_out()
    except RecordingError:
        return []


def row(*cells: str) -> str:
    """A row of a table in Markdown."""
    return f"| {' | '.join(cells)} |"


def heading(*cells: str) -> list[str]:
    """The first rows of one."""
    return [row(*cells), "|" + "---|" * len(cells)]


def main(folder: Path) -> None:
    """Fit, predict, print and draw."""
    if not DATA.is_dir():
        where = DATA.resolve()
        print(f"the recordings are not there: {where}; the README says where they come from")
        return
    found = load_friction_folder(DATA)
    report = [f"{gone} equals {kept} byte for byte: left out" for gone, kept in found.duplicates]
    some = heading(
        *("cylinder", "fitted on [bar]", "f0 [N]", "f1 [N/bar]", "breakaway ratio"),
        "held out: error [N] (%)",
    )
    every = heading(
        *("cylinder, all runs", "f0 [N]", "f1 [N/bar]", "breakaway ratio", "area [mm2]"),
        *("force zero [N]", *LAWS),
    )
    laws = heading("cylinder", "depends on pressure (range)", *COMPARED)
    fits, compared = [], []
    for name, records in groups(found.cylinders).items():
        fit = fit_cylinder_friction(records, fit_on=FIT_ON[len(records)])
        on = ", ".join(f"{p / 1e5:.0f}" for p in fit.pressures)
        errors = "; ".join(
            f"{x.level.pressure / 1e5:.0f} bar: {x.error:+.2f} ({100 * x.relative_error:+.0f} %)"
            for x in fit.held_out()
        )
        some.append(row(name, on, *coefficients(fit), errors))
        left = {law: left_out(records, law) for law in LAWS}
        whole = fit_cylinder_friction(records)
        numbers = [f"{rms(left[law]):.0f}" if left[law] else "too few" for law in LAWS]
        area = cell(whole, "area", 1e6), cell(whole, "force_zero")
        every.append(row(name, *coefficients(whole), *area, *numbers))
        crossed = held_out_lines(left["linear"])
        report += ["", fit.fit_report(), "  each pressure from all the others:", *crossed]
        if name in found.cylinders:
            fits.append(fit)
        told = compare_friction_laws(records, name=name)
        shares = [f"{told.probabilities[law]:.3f} ({told.held_out[law]:+.1f})" for law in COMPARED]
        low, high = told.range
        named = ", named" if told.settled else ""
        laws.append(row(name, f"{told.pressure:.3f} ({low:.2f} to {high:.2f}){named}", *shares))
        compared += ["", told.statement()]
    print("\n".join([*some, "", *every, "", *laws]))
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "report.txt").write_text("\n".join([*report, *compared]) + "\n", encoding="utf-8")
    plot_cylinders(fits).savefig(folder / "friction.png", dpi=130)
    print(f"\nwritten: {folder / 'report.txt'} and {folder / 'friction.png'}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/zillen_cylinders"))
