"""What 4.4 and 4.5 say of lifting, holding and returning, put to one plant; which plant, and so
which physics, is the caller's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from reproduction.comparison import Comparison
from reproduction.elbow import PSI
from reproduction.lift import Lifts
from reproduction.statements import Statements

#: The statements of the chapter.
say: Final = Statements("chapter4")

#: kM of the series of Fig. 4.14 and the names of its runs.
SERIES: Final = {
    0.0: "series, kM 0",
    0.25: "series, kM 0.25",
    0.5: "series, kM 0.5",
    1.0: "series, kM 1",
}
_KG: Final = ("11", "23", "34", "45")
_PHASES: Final = ("lift", "hold", "return")
#: Overshoot and swing that a figure of 80 deg would not show [deg].
_UNSEEN: Final = 2.0
#: The controllers of Fig. 4.15, kM = 0.5; beside the feedforward the PID has the gains that it has
#: alone, as none are printed.
_PAIRS: Final = (("PID", "FF+PID, PID's gains"), ("fuzzy", "FF+fuzzy, kM 0.5"))


def statements(group: str, runs: Mapping[str, Lifts]) -> list[Comparison]:
    """Every statement that a plant can agree with or not.

    Parameters
    ----------
    group : str
        Of the rows.
    runs : mapping of str to Lifts
        What :func:`reproduction.lift.lifts` has for the plant.

    Returns
    -------
    list of Comparison
    """
    rows = [*_simulated(runs), *_feedback(runs), *_model(runs), *_compared(runs)]
    return [_said(say(*row, group=group), runs, _behind(row)) for row in rows]


#: Of each statement the runs behind it, where its row does not name them.
_BEHIND: Final[Mapping[str, tuple[str, ...]]] = {
    "error_return_FF": ("FF+PID", "FF+fuzzy"),
    **dict.fromkeys(
        ("fuzzy_lag_mean", "fuzzy_largest_overshoot", "fuzzy_spread_lag", "fuzzy_error_end"),
        ("fuzzy",),
    ),
    **dict.fromkeys(
        ("PID_23_kg", "PID_delay", "PID_nu_34", "PID_34_kg", "PID_34_kg_error"), ("PID",)
    ),
    **dict.fromkeys(("lift_23_kg", "return_23_kg", "lift_23_kg_reversals"), ("PID", "fuzzy")),
    **dict.fromkeys(("pressure_rest_45", "FF_fuzzy_km"), ("FF+fuzzy, kM 0.5",)),
    **dict.fromkeys(
        ("km_smallest_RMS", "error_rest_km", "error_rest_km_1", "lag_km_0"),
        tuple(SERIES.values()),
    ),
    "omega_with_feedforward": ("PID", "FF+PID, PID's gains", "FF+PID, kM 0.5"),
}


def _behind(row: tuple[Any, ...]) -> tuple[str, ...]:
    """Names of the runs behind a row."""
    if row[0] == "error_with_feedforward":
        return next(pair for pair in _PAIRS if pair[0] == row[2])
    return _BEHIND[row[0]] if row[0] in _BEHIND else (str(row[2]),)


def _said(row: Comparison, runs: Mapping[str, Lifts], names: Sequence[str]) -> Comparison:
    """A statement, with what of its runs does not come to rest in the remark."""
    told = [text for text in (restless(name, runs[name]) for name in names) if text]
    if not told:
        return row
    note = f"not at rest in the hold (limit cycle, or too slow to settle): {'; '.join(told)}"
    return replace(row, note="; ".join(part for part in (row.note, note) if part))


def restless(name: str, run: Lifts) -> str:
    """Where a run does not come to rest in the hold, in words; empty where it does."""
    found = [
        f"{swing:.1f} ({kg} kg)"
        for swing, going, kg in zip(run.swing, run.restless, _KG, strict=False)
        if going
    ]
    return f"{name} {', '.join(found)}" if found else ""


#: How far the stop is below the angle of rest, less what it gives way [deg].
_STOP: Final = 5.5


def on_stop(run: Lifts) -> str:
    """Why an overshoot below rest decides nothing: the arm falls onto its stop with any payload."""
    if float(run.undershoot[:3].min()) < _STOP:
        return ""
    return (
        "the arm falls onto its stop at 5.5 deg below rest with every payload, wound up or not: "
        + _list(run.undershoot[:3])
    )


#: Id, our number, and what stands in the places.
Row = tuple[Any, ...]


def _list(values: Any, digits: int = 1) -> str:
    """Values by payload, in words."""
    return ", ".join(f"{v:.{digits}f} ({kg} kg)" for v, kg in zip(values, _KG, strict=False))


def _simulated(runs: Mapping[str, Lifts]) -> list[Row]:
    """4.4.2: feedforward with feedback, the same gains for every payload."""
    rows: list[Row] = []
    for name, figure in (("FF+fuzzy", "Fig. 4.6"), ("FF+PID", "Fig. 4.7")):
        run, where = runs[name], f"4.4.2, {figure}"
        above, swing, lift = run.overshoot, run.swing, run.error("lift")
        rows += [
            ("largest_overshoot_hold", float(above.max()), name, where, _list(above)),
            ("swing_last_2", float(swing.max()), name, where, _list(swing)),
            ("error_lift_45", float(lift[3] / lift[0]), name, where, _list(lift)),
        ]
    pid, fuzzy = runs["FF+PID"].error("return"), runs["FF+fuzzy"].error("return")
    rows.append(("error_return_FF", float(np.mean(pid) / np.mean(fuzzy)), _list(pid)))
    return rows


def _feedback(runs: Mapping[str, Lifts]) -> list[Row]:
    """4.5.1.3: PID and fuzzy control, 11, 23 and 34 kg."""
    pid, fuzzy = runs["PID"], runs["fuzzy"]
    return [*_fuzzy_alone(fuzzy), *_pid_alone(pid), *_beside(pid, fuzzy)]


def _fuzzy_alone(fuzzy: Lifts) -> list[Row]:
    """Fuzzy control: lag, overshoot and what is left at the end of the hold."""
    lag = np.asarray(fuzzy.metrics.lag)[:3]
    settled = fuzzy.error("hold", "final")[:3]
    return [
        ("fuzzy_lag_mean", float(lag.mean()), _list(lag, 2)),
        ("fuzzy_largest_overshoot", float(fuzzy.overshoot[:3].max()), _list(fuzzy.overshoot[:3])),
        ("fuzzy_spread_lag", float(np.ptp(lag))),
        ("fuzzy_error_end", float(settled.min()), _list(settled, 2), _hidden(settled.min())),
    ]


def _hidden(error: float) -> str:
    """Why an error that stays decides nothing: it is there, and too small for a figure."""
    if not 0.0 < error < _UNSEEN:
        return ""
    return f"no number is printed, and less than {_UNSEEN:g} deg is not seen in a figure of 80 deg"


def _pid_alone(pid: Lifts) -> list[Row]:
    """PID control: delay, and what grows with payload."""
    nu = np.asarray(pid.metrics.squared_error)
    return [
        ("PID_23_kg", float(pid.delay[1])),
        ("PID_nu_34", float(nu[2] / nu[0])),
        ("PID_delay", float(pid.delay[2] / pid.delay[0]), _list(pid.delay[:3], 2)),
        ("PID_34_kg", float(pid.undershoot[2]), _list(pid.undershoot), on_stop(pid)),
        ("PID_34_kg_error", float(pid.error("return")[2] / pid.error("lift")[2])),
    ]


def _beside(pid: Lifts, fuzzy: Lifts) -> list[Row]:
    """Both with 23 kg: errors in lift and return, oscillation."""
    late = np.abs(pid.error("return", "mean")[1]) / np.abs(fuzzy.error("return", "mean")[1])
    early = fuzzy.error("lift", "mean")[1] / pid.error("lift", "mean")[1]
    lifting = slice(round(5.0 / 0.01), round(10.0 / 0.01) + 1)
    reversals = [int((np.diff(np.sign(run.rate[1, lifting])) != 0).sum()) for run in (fuzzy, pid)]
    return [
        ("lift_23_kg", float(early)),
        ("return_23_kg", float(late)),
        ("lift_23_kg_reversals", float(reversals[0] - reversals[1]), reversals[0], reversals[1]),
    ]


def _model(runs: Mapping[str, Lifts]) -> list[Row]:
    """4.5.2: 45 kg, and the series of kM with 23 kg."""
    return [*_heavy(runs["FF+fuzzy, kM 0.5"]), *_series(runs)]


def _heavy(run: Lifts) -> list[Row]:
    """45 kg: the pressure at rest, and the error that stays."""
    heavy = run.error("rest", "final")
    low, high = (
        run.between(*span, run.pressure)[3].mean() / PSI for span in ((4.0, 5.0), (14.0, 15.0))
    )
    return [
        ("pressure_rest_45", float(low), high),
        ("FF_fuzzy_km", abs(float(heavy[3]))),
    ]


def _series(runs: Mapping[str, Lifts]) -> list[Row]:
    """23 kg: errors and lag over kM."""
    total = {
        km: float(np.degrees(np.asarray(runs[name].metrics.rms)[1])) for km, name in SERIES.items()
    }
    rest = {km: abs(float(runs[name].error("rest", "final")[1])) for km, name in SERIES.items()}
    lag = {km: float(np.asarray(runs[name].metrics.lag)[1]) for km, name in SERIES.items()}
    told = "; ".join(f"kM {km:g}: {value:.2f}" for km, value in total.items())
    settled = "; ".join(f"kM {km:g}: {value:.2f}" for km, value in rest.items())
    return [
        ("km_smallest_RMS", min(total, key=total.__getitem__), told),
        ("error_rest_km", rest[0.0] - min(rest[0.25], rest[0.5], rest[1.0]), settled),
        ("error_rest_km_1", rest[1.0] - rest[0.25]),
        (
            "lag_km_0",
            lag[0.0] - max(lag[0.25], lag[0.5], lag[1.0]),
            "; ".join((f"kM {km:g}: {value:.2f}" for km, value in lag.items())),
        ),
    ]


def _compared(runs: Mapping[str, Lifts]) -> list[Row]:
    """4.5.3: the four controllers with 11 kg."""
    rows: list[Row] = []
    for plain, with_model in _PAIRS:
        shares = {
            phase: float(runs[with_model].error(phase)[0] / runs[plain].error(phase)[0])
            for phase in _PHASES
        }
        rows.append(
            (
                "error_with_feedforward",
                max(shares.values()),
                plain,
                "; ".join((f"{phase} {share:.2f}" for phase, share in shares.items())),
            )
        )
    names = ("PID", "FF+PID, PID's gains", "FF+PID, kM 0.5")
    alone, beside, quoted = (float(np.asarray(runs[name].metrics.curvature)[0]) for name in names)
    rows.append(("omega_with_feedforward", beside / alone, quoted / alone))
    return rows
