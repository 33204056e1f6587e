"""What the loops of chapter 6's cycles can bear, and a quasi-static balance beside them.

The balance is that of ``tests/reference/recruitment.py``, which shares no code with the package.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Final

import numpy as np

from reproduction import recruiting as rec
from reproduction.margins import inner_margin
from reproduction.recruiting import MUSCLES, Case, Cycles

if TYPE_CHECKING:
    from reproduction.chapter6 import Experiments


#: The run whose whole loop has no margin without dry friction.
SLOW: Final = "PI without the rate, a quarter as fast"


@dataclass(frozen=True)
class LoopMargin:
    """The least margins of the cases of one run.

    Attributes
    ----------
    name : str
        Of the run.
    cases : int
        How many it has.
    inner, whole : float
        Factors by which the gains of the pressure loop, and the gain of the whole loop, may grow.
    turning : float
        Largest share of the samples of lifts and upper holds at which the pressure turns round [1].
    """

    name: str
    cases: int
    inner: float
    whole: float
    turning: float


@dataclass(frozen=True)
class _Run:
    """One run behind the tables: its cycles, how the rig is changed and whether the loops are set
    for that, whether it has rubber, and gains of its own.
    """

    name: str
    found: Cycles
    changed: rec.Changed | None = None
    known: bool = False
    rubber: bool = True
    gains: Mapping[str, float] | None = None


def _runs(done: Experiments) -> Iterator[_Run]:
    """Every run behind the tables."""
    yield _Run("up to 90 deg", done.steep)
    yield _Run("up to 50 deg", done.flat)
    yield _Run("without elasticity", done.bare, rubber=False)
    if done.plain is not None:
        yield _Run(SLOW, done.plain, gains=rec.SLOW)
    for name, (with_, without) in done.readings.items():
        changed = rec.READINGS[name]
        yield _Run(name, with_, changed, known=True)
        yield _Run(f"{name}, without elasticity", without, changed, known=True, rubber=False)
    for name, found in done.suspects.items():
        yield _Run(name, found, rec.SUSPECTS[name])
    for name, found in done.idle.items():
        yield _Run(f"one of three pairs, others {name}", found)


def margins(done: Experiments) -> list[LoopMargin]:
    """The margins of every run of the chapter; about a minute, then kept.

    Parameters
    ----------
    done : Experiments

    Returns
    -------
    list of LoopMargin
    """
    if id(done) not in _KEPT:
        _KEPT.clear()
        _KEPT[id(done)] = [_of(run) for run in _runs(done)]
    return _KEPT[id(done)]


_KEPT: dict[int, list[LoopMargin]] = {}


def _of(run: _Run) -> LoopMargin:
    """The least margins of a run's cases."""
    inner, whole = [], []
    high = run.found.high
    read_as = run.changed if run.known else None
    for case in run.found.cases:
        rig = rec.rig_of(*case, elastic=run.rubber, changed=run.changed)
        read = rec.rig_of(*case, elastic=run.rubber, changed=read_as)
        inner.append(inner_margin(rig, rec.inner_loop(read), rec.PERIOD))
        gains, margin = rec.case_gains(case, high, run.rubber, read_as)
        if run.gains or run.changed is not read_as:
            margin = rec.whole_margin(rig, read, case[1], high, run.gains or gains)
        whole.append(margin)
    return LoopMargin(run.name, len(run.found.cases), min(inner), min(whole), turning(run.found))


def turning(found: Cycles) -> float:
    """Largest share of the samples of a case's lifts and upper holds at which its pressure turns
    round [1].
    """
    way = np.sign(np.diff(found.pressure, axis=1))
    up = np.mod(found.time[1:-1], rec.CYCLE) < 11.0
    return float((way[:, 1:] * way[:, :-1] < 0.0)[:, up].mean(axis=1).max())


def table(done: Experiments) -> list[str]:
    """The margins as lines of Markdown."""
    return [
        "| runs | cases | pressure loop: gains may grow by | whole loop: gain may grow by "
        "| pressure turns round |",
        "|---|--:|--:|--:|--:|",
        *(
            f"| {one.name} | {one.cases} | {one.inner:.2f} | {_factor(one.whole)} | "
            f"{100.0 * one.turning:.1f} % |"
            for one in margins(done)
        ),
        "",
        "*Least of the cases of each run, at the fastest point: the tank full, the muscles at rest "
        "length, the valve where it is steepest. Below one small motions without dry friction "
        "grow: only the PI without the rate is so, and dry friction keeps it from a limit cycle. "
        "Last: largest share of the samples of lifts and upper holds at which the pressure turns "
        "round; with one gain for all numbers of muscles it was 42 % with two.*",
    ]


def _factor(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else "no linear model"


# ------------------------------------------------------------------ a balance beside


def lasting(found: Cycles) -> list[Case]:
    """Cases that reach the largest angle in every cycle."""
    reached = found.followed() == found.count
    return [case for case, all_ in zip(found.cases, reached, strict=True) if all_]


@cache
def balance(
    payload: float,
    muscles: int,
    high: float,
    count: int,
    rubber: bool = True,
    gauge: bool = False,
) -> float:
    """Efficiency (6.9) of cycles by the quasi-static balance [1].

    Parameters
    ----------
    payload : float
        [kg]
    muscles : int
    high : float
        [deg]
    count : int
        Of cycles.
    rubber : bool
        Else the braid's force alone.
    gauge : bool
        Whether the gas laws take gauge pressures.

    Returns
    -------
    float
    """
    from tests.reference.recruitment import cycles, lifting_plant

    plant = lifting_plant(
        payload,
        muscles,
        model="robinson" if rubber else "gaylord",
        ambient=rec.NONE if gauge else 101325.0,
    )
    return cycles(plant, math.radians(high), count, points=200).efficiency


def by_number(payload: float, *, rubber: bool, gauge: bool) -> str:
    """Efficiency [%] of two cycles up to 90 deg by the balance with 2, 4 and 6 muscles."""
    return ", ".join(f"{100.0 * balance(payload, n, 90.0, 2, rubber, gauge):.1f}" for n in MUSCLES)
