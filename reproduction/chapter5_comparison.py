"""5.5 of the dissertation: the four controllers beside each other, what the model leaves out, and
hysteresis.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from reproduction import tracking_runs
from reproduction.chapter5_statements import say
from reproduction.comparison import Comparison
from reproduction.tracking import KINDS, SETTLED, Track
from reproduction.tracking_runs import MIDDLE, Plan

Array = NDArray[np.float64]


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


def _bare(plan: Plan) -> dict[float, int]:
    """Rows of the plants with nothing left out, by payload [lb]."""
    return {case[0]: row for row, case in enumerate(plan.cases) if case[1] == ""}


def _by_payload(plan: Plan) -> dict[str, dict[float, float]]:
    """The orders of 5.5, each by payload [lb]."""
    found = {payload: orders(plan, row) for payload, row in _bare(plan).items()}
    first = next(iter(found.values()))
    return {fact: {payload: one[fact] for payload, one in found.items()} for fact in first}


def _judged(ratios: dict[float, float], *, above: bool = False) -> str:
    """Ratios by payload with the verdict of each."""
    return ", ".join(
        f"{payload:g} lb {ratio:.2f} ({'holds' if (ratio > 1.0) == above else 'does not'})"
        for payload, ratio in ratios.items()
    )


def _restless(runs: dict[str, Track], plan: Plan) -> str:
    """What the loops without a payload do above 1.5 Hz, in words: they alone have no margin; empty
    where none has no payload.
    """
    if 0.0 not in _bare(plan):
        return ""
    found = _numbers(lambda run: run.ripple(0.0), runs, _bare(plan)[0.0])
    return (
        "; with 0 lb the whole loops have no margin but for dry friction (table of the rig): above "
        f"1.5 Hz {found} deg"
    )


def _why(name: str) -> str:
    """Why an order does not hold, where that is known."""
    drifts = "without a payload the estimates drift away in the training, see its figure"
    return drifts if name.startswith("adaptive sliding") else ""


def compound(plan: Plan) -> list[Comparison]:
    """The controllers on the compound trajectory."""
    rows, k = say.lines(), _middle(plan)
    runs = {kind: plan.compared(kind, "compound") for kind in KINDS}
    for fact, ratios in _by_payload(plan).items():
        if fact.startswith("compound"):
            name = fact.removeprefix("compound: ")
            note = _judged(ratios) + _restless(runs, plan)
            rows.say("compound_order", max(ratios.values()), name, note, _why(name))
    end = float(runs["neural"].time[-1])
    rows.say(
        "neural_sliding_last",
        float((runs["neural"].rms(0.5 * end) / runs["sliding"].rms(0.5 * end))[k]),
    )
    training = plan.trained("neural")
    if training is not None:
        last = training.rms(0.9 * float(training.time[-1]))[k]
        rows.say("neural_end_training", float(last / runs["sliding"].rms()[k]), plan.training, last)
    mean = runs["neural"].rms() / runs["adaptive sliding"].rms()
    ratios = {payload: float(mean[row]) for payload, row in _bare(plan).items()}
    rows.say(
        "neural_adaptive_sliding",
        max(ratios.values(), key=lambda ratio: abs(ratio - 1.0)),
        ", ".join(f"{payload:g} lb {ratio:.2f}" for payload, ratio in ratios.items()),
    )
    for kind in ("sliding", "adaptive sliding"):
        own, other = runs[kind].ripple(), runs["neural"].ripple()
        share = {payload: float(own[row] / other[row]) for payload, row in _bare(plan).items()}
        rows.say("error_above_1_5", min(share.values()), kind, _judged(share, above=True))
    return rows + _table_of("compound", runs, plan, SETTLED)


def _table_of(group: str, runs: dict[str, Track], plan: Plan, begin: float) -> list[Comparison]:
    """Every number of a comparison, one statement for each controller and payload."""
    rows = say.lines(group)
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
            rows.say(
                "rms_by_payload",
                float(run.rms(begin)[k]),
                kind,
                payload,
                run.nu(begin)[k],
                run.omega(begin)[k],
                run.largest(begin)[k],
                more,
                f", with the approach {run.rms(0.0)[k]:.2f} deg rms" if begin else "",
            )
    return rows


def lift(plan: Plan) -> list[Comparison]:
    """The controllers on lift, hold and return."""
    rows, k = say.lines(), _middle(plan)
    runs = {kind: plan.compared(kind, "lift") for kind in KINDS}
    numbers: dict[str, Callable[[Track], Array]] = {
        "curvature": lambda run: run.omega(),
        "steady": lambda run: np.abs(run.mean(8.0, 10.0)),
        "": lambda run: run.rms(0.0),
    }
    for fact, ratios in _by_payload(plan).items():
        if not fact.startswith("lift"):
            continue
        which = next(name for name in numbers if name in fact)
        note = f"{_judged(ratios)}; {MIDDLE:g} lb: {_numbers(numbers[which], runs, k, 3)}"
        note += _restless(runs, plan)
        if fact.startswith("lift: sliding"):
            later = {kind: run.rms(2.0)[k] for kind, run in runs.items()}
            note += (
                "; the networks lose most at the begin, in the chapter too: from 2 s on "
                f"{later['sliding'] / later['neural']:.2f}"
            )
        name = fact.removeprefix("lift: ")
        rows.say("lift_order", max(ratios.values()), name, note, _why(name))
    return rows + _table_of("lift", runs, plan, 0.0)


def effects(plan: Plan) -> list[Comparison]:
    """The orders with one effect more in the plant, of which the controllers know nothing."""
    rows = say.lines("effects")
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
        rows.say(
            "orders_that_hold",
            len(right),
            effect or "nothing left out",
            note,
            published=len(base),
        )
    return rows


def hysteresis(plan: Plan, search: bool) -> list[Comparison]:
    """The diagnosis of a plant with hysteresis, where asked for, and what its compensation
    brings.
    """
    rows = say.lines()
    if search:
        found = plan.diagnosis()
        named = next(
            (effect for effect in found.effects if effect["id"] == "muscle_hysteresis"), None
        )
        parameters = {} if named is None else named["parameters"]
        text = ", ".join(
            f"{name} {value['value']:.3g} ({_true(name):.3g})" for name, value in parameters.items()
        )
        rows.say(
            "probability_diagnosis_gives",
            math.nan if named is None else named["probability"],
            found.verdict,
            text,
        )
    before, after = plan.compensated(False), plan.compensated(True)
    rows.say(
        "sliding_error_compensation",
        float(after.rms()[0] / before.rms()[0]),
        before.rms()[0],
        after.rms()[0],
        before.largest()[0],
        after.largest()[0],
        "the diagnosed parameters" if search else "the true parameters",
        plan.compared("sliding", "compound").rms()[_middle(plan)],
    )
    return rows


def _true(name: str) -> float:
    return dict(tracking_runs.HYSTERESIS)[name]
