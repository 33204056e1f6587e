"""5.5 of the dissertation: the four controllers beside each other, what the model leaves out, and
hysteresis.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pamrs.comparison import Comparison, judge
from reproduction import tracking_runs
from reproduction.chapter5_statements import Group
from reproduction.tracking import KINDS, SETTLED, Track
from reproduction.tracking_runs import MIDDLE, Plan

__all__ = ["compound", "effects", "hysteresis", "lift", "orders"]

Array = NDArray[np.float64]

_CURVE: Final = "5.5, Fig. 5.19"
_LIFT: Final = "5.5, Fig. 5.20"


def orders(plan: Plan, row: int = 0) -> dict[str, float]:
    """The orders of 5.5 on one plant of the comparison, as ratios that the chapter has below one.

    Parameters
    ----------
    plan : Plan
    row : int
        Of its cases.

    Returns
    -------
    dict of str to float
    """
    wave = {kind: float(plan.compared(kind, "compound").rms()[row]) for kind in KINDS}
    run = {kind: plan.compared(kind, "lift") for kind in KINDS}
    whole = {kind: float(run[kind].rms(0.0)[row]) for kind in KINDS}
    bent = {kind: float(run[kind].omega()[row]) for kind in KINDS}
    steady = {kind: float(abs(run[kind].mean(8.0, 10.0)[row])) for kind in KINDS}
    pid, sliding, adaptive, neural = KINDS
    return {
        "compound: adaptive sliding over sliding": wave[adaptive] / wave[sliding],
        "compound: neural over sliding": wave[neural] / wave[sliding],
        "compound: sliding over cascaded PID": wave[sliding] / wave[pid],
        "lift: adaptive sliding over the best of the others": whole[adaptive]
        / min(whole[k] for k in (pid, sliding, neural)),
        "lift: sliding over neural": whole[sliding] / whole[neural],
        "lift: curvature of neural over the smaller of the sliding ones": bent[neural]
        / min(bent[sliding], bent[adaptive]),
        "lift: steady error of neural over the smaller of the sliding ones": steady[neural]
        / min(steady[sliding], steady[adaptive]),
    }


def _numbers(
    values: Callable[[Track], Array], runs: dict[str, Track], row: int, digits: int = 2
) -> str:
    return ", ".join(f"{kind} {float(values(run)[row]):.{digits}f}" for kind, run in runs.items())


def _middle(plan: Plan) -> int:
    return plan.cases.index((MIDDLE, ""))


def compound(plan: Plan) -> list[Comparison]:
    """The controllers on the compound trajectory."""
    group, k = Group("compound"), _middle(plan)
    runs = {kind: plan.compared(kind, "compound") for kind in KINDS}
    for fact, ratio in orders(plan, k).items():
        if not fact.startswith("compound"):
            continue
        others = {
            case[0]: orders(plan, row)[fact]
            for row, case in enumerate(plan.cases)
            if case[1] == "" and row != k
        }
        note = "; ".join(f"{payload:g} lb {value:.2f}" for payload, value in others.items())
        group.smaller(fact.removeprefix("compound: ") + f", {MIDDLE:g} lb", _CURVE, ratio, note)
    end = float(runs["neural"].time[-1])
    group.smaller(
        f"neural over sliding in the last half of the record, {MIDDLE:g} lb",
        _CURVE,
        float((runs["neural"].rms(0.5 * end) / runs["sliding"].rms(0.5 * end))[k]),
        (
            "the record begins with a move from rest at 15 deg to 95 deg, in which the networks "
            "unlearn what they knew of high angles"
        ),
    )
    training = plan.trained("neural")
    if training is not None:
        last = training.rms(0.9 * float(training.time[-1]))[k]
        group.smaller(
            f"neural at the end of its training over sliding, {MIDDLE:g} lb",
            _CURVE,
            float(last / runs["sliding"].rms()[k]),
            (
                f"last tenth of {plan.training:g} s, {last:.2f} deg: the order of the chapter, but "
                "for that move"
            ),
        )
    mean = {kind: float(runs[kind].rms()[k]) for kind in ("neural", "adaptive sliding")}
    group.say(
        f"neural over adaptive sliding, {MIDDLE:g} lb",
        "5.5: 'nearly as accurate as the adaptive sliding mode controller'",
        1.0,
        mean["neural"] / mean["adaptive sliding"],
        tolerance=0.25,
        note=(
            f"rms {mean['neural']:.2f} and {mean['adaptive sliding']:.2f} deg; 'nearly' read as a "
            "quarter"
        ),
    )
    ripple = {kind: float(run.ripple()[k]) for kind, run in runs.items()}
    for kind in ("sliding", "adaptive sliding"):
        group.say(
            (f"error above 1.5 Hz, {kind} over neural"),
            ("5.5: 'low-amplitude, high-frequency content'"),
            1.0,
            ripple[kind] / ripple["neural"],
            relation="above",
            note=(
                f"{ripple[kind]:.3f} and {ripple['neural']:.3f} deg; the three have one KD here, "
                "and the networks relearn high angles"
            ),
        )
    return group.rows + _table_of(group.title, runs, plan, SETTLED)


def _table_of(title: str, runs: dict[str, Track], plan: Plan, begin: float) -> list[Comparison]:
    """Every number of a comparison, one statement for each controller and payload."""
    rows = []
    for kind, run in runs.items():
        for k, (payload, effect) in enumerate(plan.cases):
            if effect:
                continue
            more = (
                ""
                if begin
                else (
                    f", mean of 8 to 10 s {run.mean(8.0, 10.0)[k]:+.3f} deg, of 20 to 25 s "
                    f"{run.mean(20.0, 25.0)[k]:+.3f} deg"
                )
            )
            rows.append(
                judge(
                    title,
                    (f"{kind}, {payload:g} lb: rms"),
                    ("figure only"),
                    math.nan,
                    float(run.rms(begin)[k]),
                    ("deg"),
                    cannot_tell="curves without numbers",
                    note=(
                        f"nu {run.nu(begin)[k]:.1f} deg2 s, omega {run.omega(begin)[k]:.1f} (rad), "
                        f"largest {run.largest(begin)[k]:.2f} deg"
                    )
                    + more
                    + ((f", with the approach {run.rms(0.0)[k]:.2f} deg rms") if begin else ("")),
                )
            )
    return rows


def lift(plan: Plan) -> list[Comparison]:
    """The controllers on lift, hold and return."""
    group, k = Group("lift"), _middle(plan)
    runs = {kind: plan.compared(kind, "lift") for kind in KINDS}
    numbers: dict[str, Callable[[Track], Array]] = {
        "curvature": lambda run: run.omega(),
        "steady": lambda run: np.abs(run.mean(8.0, 10.0)),
        "": lambda run: run.rms(0.0),
    }
    for fact, ratio in orders(plan, k).items():
        if not fact.startswith("lift"):
            continue
        which = next(name for name in numbers if name in fact)
        others = {
            case[0]: orders(plan, row)[fact]
            for row, case in enumerate(plan.cases)
            if case[1] == "" and row != k
        }
        note = _numbers(numbers[which], runs, k, 3) + "".join(
            f"; {payload:g} lb {value:.2f}" for payload, value in others.items()
        )
        if fact.startswith("lift: sliding"):
            later = {kind: run.rms(2.0)[k] for kind, run in runs.items()}
            note += (
                "; the networks lose most at the begin, in the chapter too: from 2 s on "
                f"{later['sliding'] / later['neural']:.2f}"
            )
        group.smaller(fact.removeprefix("lift: ") + f", {MIDDLE:g} lb", _LIFT, ratio, note)
    return group.rows + _table_of(group.title, runs, plan, 0.0)


def effects(plan: Plan) -> list[Comparison]:
    """The orders with one effect more in the plant, of which the controllers know nothing."""
    group, rows = Group("effects"), []
    base = orders(plan, _middle(plan))
    for k, (payload, effect) in enumerate(plan.cases):
        if payload != MIDDLE:
            continue
        now = orders(plan, k)
        right = [fact for fact, ratio in now.items() if ratio < 1.0]
        restored = [
            f"{fact} {base[fact]:.2f} to {now[fact]:.2f}"
            for fact in now
            if now[fact] < 1.0 <= base[fact]
        ]
        lost = [
            f"{fact} {base[fact]:.2f} to {now[fact]:.2f}"
            for fact in now
            if base[fact] < 1.0 <= now[fact]
        ]
        parameters = ", ".join(
            f"{name} {value:g}" for name, value in tracking_runs.EFFECTS.get(effect, ())
        )
        rms = {kind: plan.compared(kind, "compound") for kind in KINDS}
        note = (
            (f"{parameters}; " if parameters else "")
            + "rms on the compound trajectory "
            + _numbers(lambda r: r.rms(), rms, k)
        )
        note += (
            " deg"
            + (f"; restored: {'; '.join(restored)}" if restored else "")
            + (f"; lost: {'; '.join(lost)}" if lost else "")
        )
        rows.append(
            judge(
                group.title,
                (f"orders of 5.5 that hold, {effect or 'nothing left out'}"),
                ("5.5"),
                len(base),
                len(right),
                note=note,
            )
        )
    return rows


def hysteresis(plan: Plan, search: bool) -> list[Comparison]:
    """The diagnosis of a plant with hysteresis, where asked for, and what its compensation
    brings.
    """
    group = Group("hysteresis")
    if search:
        found = plan.diagnosis()
        named = next(
            (effect for effect in found.effects if effect["id"] == "muscle_hysteresis"), None
        )
        parameters = {} if named is None else named["parameters"]
        text = ", ".join(
            f"{name} {value['value']:.3g} ({_true(name):.3g})" for name, value in parameters.items()
        )
        group.say(
            "probability that the diagnosis gives to muscle_hysteresis",
            "5.5: 'A key example of one such nonlinearity'",
            0.9,
            math.nan if named is None else named["probability"],
            relation="above",
            note=(
                "the plant with it recorded under the PID, the rig without it diagnosed: "
                f"{found.verdict}; found (put in): {text}"
            ),
        )
    before, after = plan.compensated(False), plan.compensated(True)
    group.smaller(
        "sliding error with compensation over without, plant with hysteresis",
        "5.5: 'are expected if hysteresis can be properly compensated'",
        float(after.rms()[0] / before.rms()[0]),
        (
            f"{before.rms()[0]:.2f} to {after.rms()[0]:.2f} deg rms, largest "
            f"{before.largest()[0]:.2f} to {after.largest()[0]:.2f}; "
        )
        + ("the diagnosed parameters" if search else "the true parameters")
        + f"; without hysteresis {plan.compared('sliding', 'compound').rms()[_middle(plan)]:.2f}",
    )
    return group.rows


def _true(name: str) -> float:
    return dict(tracking_runs.HYSTERESIS)[name]
