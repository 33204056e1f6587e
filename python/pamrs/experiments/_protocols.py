"""Standard experiments that a rig can do, each as the commands that a person sends, with its
numbers in words; those of sealed chambers, and how all of them follow from recordings.

The levels follow from the rig: the lowest pressure at which its arm leaves the stop and the highest
that keeps it off the opposite stop. Of several chains (valves and their chambers, or regulators)
one is moved while the others are held, or all are moved at once, none as another one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from pamrs.channels import dotted
from pamrs.errors import DiagnosisError, ParameterError, SimulationError
from pamrs.experiments._chains import Range, chains_of, is_sealed, joined, pressure_range
from pamrs.experiments._experiment import Experiment, QuantityFormatter, in_bar
from pamrs.experiments._frame import Rates, Seen, frame_of, seen_in
from pamrs.experiments._maker import Maker, rows
from pamrs.recordings import Recording
from pamrs.rig import Rig
from pamrs.rig.schema import qualified
from pamrs.simulation import has_frame, simulate

# times the highest pressure that was recorded, to which a simulated experiment may overshoot
_ABOVE = 1.05
_LOWERED = 0.98  # times as much lower as it overshoots: what is left of that stays
_MOST_LOWERED = 4  # plans of an experiment that overshoots, each lower than the one before
_SAMPLE_TIME = 0.005  # [s] sample time of an experiment where no recording tells
_LEAST_SAMPLE_TIME = 0.002  # [s] shortest sample time
_SEALED_SAMPLE_TIME = 0.1  # [s] sample time for a chamber without a valve, which changes slowly
_RATE_WINDOW = 0.3  # [s] over which a rate is counted: noise of a length is then a tenth of a mm/s
_MOST_SAMPLE_TIME = 0.01  # [s] longest sample time where recordings tell
_LEAST_SEALED_SAMPLE_TIME = 0.05  # [s] shortest sample time of a sealed chamber
_MOST_SEALED_SAMPLE_TIME = 1.0  # [s] longest sample time of a sealed chamber
# [Pa] gauge reach of what was never recorded above: moves no muscle, far above its noise
_LEAST_HIGHEST = 2e4
# samples of a pressure that blows over, which may take 1 s to 60 s (20 ms at most)
_MOST_BLOWN_SAMPLES = 3000


def _sealed_library(rig: Rig, span: Range, sample_time: float) -> list[Experiment]:
    """Experiments of sealed chambers: all filled and left alone; of joined ones, also one alone."""
    chambers, formatter = list(rig.tables("chamber")), QuantityFormatter(rig)
    segments = any(line.get("segments") for line in rig.tables("line").values())
    outlets = any(ends["to"] == "ambient" for ends in rig.ports("line").values())
    out = []
    for row in [] if segments else rows("sealed"):  # waves would be followed for minutes
        pressure, seconds = span.at(row["at"]), row["seconds"]
        one = len(chambers) == 1
        filled, it, its = ("the chamber", "it", "its") if one else ("all chambers", "them", "their")
        what = f"open {its} outlet" if outlets else f"shut {it} off"
        text = (
            f"fill {filled} to {formatter.each([in_bar(pressure)], 'bar')}, {what} and record "
            f"{seconds:g} s from that moment"
        )
        begin = {dotted("muscle_pressure", chamber): pressure for chamber in chambers}
        out.append(_left_alone(row["name"], text, begin, seconds, sample_time))
    for chamber in chambers:
        reached = joined(rig, qualified("chamber", chamber))
        if not reached:
            continue
        begin = {dotted("muscle_pressure", other): span.low for other in chambers}
        begin[dotted("muscle_pressure", chamber)] = span.high
        try:
            seconds = _equalised(rig, begin, [chamber, *reached])
        except SimulationError:
            continue  # the model does not hold there: nothing to propose to anyone
        text = (
            f"fill {chamber} to {formatter.each([in_bar(span.high)], 'bar')} and the rest to "
            f"{formatter.each([in_bar(span.low)], 'bar')}, open what lies between and record "
            f"{seconds:.2g} s from that moment"
        )
        step = max(_LEAST_SAMPLE_TIME, seconds / _MOST_BLOWN_SAMPLES)
        out.append(_left_alone(f"blow_over.{chamber}", text, begin, seconds, step))
    return out


def _equalised(rig: Rig, begin: dict[str, float], joining: Collection[str]) -> float:
    """Time [s], 1 to 60, in which joined chambers equalise: three times that to within a hundredth
    of the first difference.
    """
    found = simulate(rig, sample_time=_SAMPLE_TIME, duration=20.0, initial=begin)
    each = np.array([found[dotted("muscle_pressure", name)] for name in joining])
    apart = each.max(axis=0) - each.min(axis=0)
    late = np.flatnonzero(apart > 0.01 * apart[0])
    return float(np.clip(3.0 * found.time[late[-1]], 1.0, 60.0))


def _left_alone(
    name: str, text: str, begin: dict[str, float], seconds: float, sample_time: float
) -> Experiment:
    """Experiment without commands that begins at some pressures."""
    excitation = {
        "kind": name,
        "levels_bar": sorted({in_bar(pressure) for pressure in begin.values()}),
        "duration_s": round(seconds, 2),
    }
    rows = round(seconds / sample_time) + 1
    return Experiment(name, text, excitation, None, rows, sample_time, begin, {}, seconds)


def library(
    rig: Rig,
    rates: Rates,
    *,
    sample_time: float | None = None,
    highest: float | Mapping[str, float] | None = None,
    seen: Seen | None = None,
    only: Collection[str] | None = None,
) -> list[Experiment]:
    """The standard experiments that a rig can do.

    Parameters
    ----------
    rig : Rig
        A rig with valves or regulators, with or without arms or a load; a load frame that sets the
        pressures itself; or chambers that nobody sends a command to.
    rates : Rates
        How fast a plain testing machine moves, for a rig with a load frame.
    sample_time : float, optional
        Time between samples [s].
    highest : float or mapping of str to float, optional
        Gauge pressure to which experiments are planned [Pa], of several chains by their names; a
        simulated one may overshoot it by a twentieth.
    seen : Seen, optional
        What recordings showed a load frame to do; what a plain machine can by default.
    only : collection of str, optional
        Names or kinds of those to make; all by default.

    Returns
    -------
    list of Experiment
        Those that the rig survives in simulation.

    Raises
    ------
    DiagnosisError
        If no experiment is made for such a rig, nothing says how high a pressure may be set, or the
        model of the rig does not hold while its pressures rise.
    ParameterError
        If ``highest`` has a name that is none of a chain.
    """
    chains = chains_of(rig)
    if not chains and (rig.tables("supply") or rig.tables("muscle") or rig.tables("valve")):
        raise DiagnosisError(
            f"rig {rig.name!r} has no valve that a person could command, and no regulator; "
            "experiments need one, or a sealed chamber"
        )
    names = [chain.name for chain in chains] or [""]
    unknown = [n for n in highest if n not in names] if isinstance(highest, Mapping) else []
    if unknown:
        raise ParameterError(
            f"highest has {unknown[0]!r}, which is not allowed: of rig {rig.name!r} one of "
            f"{', '.join(map(repr, names))}"
        )
    usual = _SAMPLE_TIME if chains else _SEALED_SAMPLE_TIME
    step = usual if sample_time is None else sample_time
    if not chains:
        span = pressure_range(rig, highest=highest)
        sealed = _sealed_library(rig, span, step)
        return [e for e in sealed if only is None or e.name in only or e.kind in only]
    frame = frame_of(rig, rates, highest, seen) if has_frame(rig) else None
    make = Maker(rig, chains, step, frame, highest)
    out = []
    for name, maker in make.makers():
        if only is not None and name not in only and name.partition(".")[0] not in only:
            continue
        try:
            found = _below(name, maker, make)
        except SimulationError:
            continue  # the model does not hold there: nothing to propose to anyone
        out += [] if found is None else [found]
    return out


def _below(name: str, maker: Callable[[], Experiment | None], make: Maker) -> Experiment | None:
    """Experiment whose pressures stay below what they may reach, in simulation: one that overshoots
    is planned lower by as much; None where there is none.
    """
    # a load frame's ranges follow from the pressures that it was made for
    tops = _tops(make.rig, None if make.frame is not None else make.highest)
    lower = {n: top / _ABOVE for n, top in tops.items()}
    for _ in range(_MOST_LOWERED):
        found = maker()
        over = 0.0 if found is None else _overshoot(found, make.rig, tops)
        if over <= 1.0 or make.frame is not None:
            return found if over <= 1.0 else None
        lower = {n: _LOWERED * top / over for n, top in lower.items()}
        try:
            maker = dict(replace(make, highest=lower).makers())[name]
        except DiagnosisError:  # so low nothing is worth moving
            return None
    return None


def experiments_of(
    rig: Rig, records: Sequence[Recording], rates: Rates, only: Collection[str] | None = None
) -> list[Experiment]:
    """The experiments of the rig (those of some kinds, if they are given), at the sample time and
    up to the pressures of what was recorded.

    Raises
    ------
    DiagnosisError
        If there are none for such a rig.
    """
    if not records:
        return library(rig, rates, only=only)
    shortest, longest = _LEAST_SAMPLE_TIME, _MOST_SAMPLE_TIME
    if is_sealed(rig):
        shortest, longest = _LEAST_SEALED_SAMPLE_TIME, _MOST_SEALED_SAMPLE_TIME
    step = min(max(min(r.sample_time for r in records), shortest), longest)
    every = tuple(dotted("muscle_pressure", name) for name in rig.tables("chamber"))
    seen = {chain.name: chain.seen for chain in chains_of(rig)} or {"": every}
    limits = {}
    for chain, names in seen.items():
        peaks = [
            float(np.nanmax(r.channels[name]))
            for r in records
            for name in names
            if name in r.channels and np.isfinite(r.channels[name]).any()
        ]
        if peaks:  # of one that nobody filled as well: it is filled no further
            limits[chain] = max(*peaks, _LEAST_HIGHEST)
    if limits:
        # what has no gauge is moved no higher than what has one
        highest = max(limits.values())
        limits = {chain: limits.get(chain, highest) for chain in seen}
    shown = seen_in(rig, records, _RATE_WINDOW) if has_frame(rig) else None
    return library(rig, rates, sample_time=step, highest=limits or None, seen=shown, only=only)


def _tops(rig: Rig, highest: float | Mapping[str, float] | None) -> dict[str, float]:
    """Gauge pressures that commands may reach in simulation [Pa], by the names of the chains."""
    names = [chain.name for chain in chains_of(rig)]
    given = highest if isinstance(highest, Mapping) else dict.fromkeys(names, highest)
    most = rig.limits.get("max_pressure", math.inf)
    tops = {n: min(most, math.inf if p is None else _ABOVE * p) for n, p in given.items()}
    return {name: top for name, top in tops.items() if math.isfinite(top)}


def _overshoot(experiment: Experiment, rig: Rig, tops: Mapping[str, float]) -> float:
    """Highest pressure of a simulated experiment, as a multiple of what it may reach, from when it
    is first below that (of what the rig file allows, always): commands overshoot where the valve is
    far open. 0 where nothing says how far it may go.
    """
    if not tops:
        return 0.0
    found = experiment.simulate(rig)
    courses = {chain.name: found[chain.pressure] for chain in chains_of(rig)}
    later = {n: courses[n][np.logical_or.accumulate(courses[n] <= top)] for n, top in tops.items()}
    highest = max(float(course.max()) for course in courses.values())
    shares = [float(later[n].max(initial=0.0)) / top for n, top in tops.items()]
    return max(highest / float(rig.limits.get("max_pressure", math.inf)), *shares)
