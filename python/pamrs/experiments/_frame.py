"""Range of a load frame in experiments: the lengths and the rate of the muscle's end, the length
that is held, and the pressures at which the muscle then pulls.

Lengths and pressures stay within what recordings showed, or, before there are any, where the muscle
need not push; rates within what recordings showed or a plain testing machine can do, whichever is
faster.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pamrs._arrays import Array
from pamrs.channels import dotted
from pamrs.experiments._chains import Chain, Range, Spans, chains_of, top_of
from pamrs.recordings import Recording
from pamrs.rig import Rig
from pamrs.simulation import reading, simulate

# stroke, share of the length: well beyond presliding, well inside what muscles do
_LEAST_STROKE = 0.1
_WORTH_STROKE = 0.01  # least stroke worth moving, share of the length: a few times presliding
# share of the pull at its longest or fullest from which a muscle is not slack
_PULLING_SHARE = 0.05
# place between shortest and longest length held: near the long end muscles pull early
_HELD_SHARE = 0.7


class Rates(Protocol):
    """Rates of a plain testing machine.

    Attributes
    ----------
    length_rate : float
        Of the length of a muscle on a load frame [m/s].
    pressure_rate : float
        Of a pressure that a bench sets [Pa/s].
    """

    @property
    def length_rate(self) -> float: ...

    @property
    def pressure_rate(self) -> float: ...


@dataclass(frozen=True)
class Seen:
    """Range and rates of a bench that its recordings show.

    Attributes
    ----------
    lengths : Range
        Shortest and longest length [m].
    rate : float
        Fastest change of the length [m/s].
    pressure_rate : float
        Fastest change of a pressure [Pa/s].
    lowest : float
        Lowest pressure [Pa, gauge].
    """

    lengths: Range
    rate: float
    pressure_rate: float
    lowest: float


def seen_in(rig: Rig, records: Sequence[Recording], window: float) -> Seen | None:
    """Range and rates that the recordings of a rig with a frame show; None where none has a usable
    length.

    Parameters
    ----------
    rig : Rig
        The rig.
    records : sequence of Recording
        What there is.
    window : float
        Time over which a rate is counted [s]: faster changes are noise.
    """
    pressures = [dotted("muscle_pressure", name) for name in rig.tables("chamber")]
    lengths = [_usable(r, "length") for r in records]
    known = [values for values in lengths if np.isfinite(values).any()]
    if not known:
        return None
    gauges = [_usable(r, name) for r in records for name in pressures]
    low = min(float(np.nanquantile(values, 0.005)) for values in known)
    high = max(float(np.nanquantile(values, 0.995)) for values in known)
    steps = [max(1, round(window / r.sample_time)) for r in records]
    rate = max(map(_fastest, lengths, steps, [r.sample_time for r in records]))
    each = [n for n in steps for _ in pressures]
    times = [r.sample_time for r in records for _ in pressures]
    lows = [float(np.nanquantile(v, 0.005)) for v in gauges if np.isfinite(v).any()]
    return Seen(
        Range(low, high), rate, max(map(_fastest, gauges, each, times)), min(lows, default=math.inf)
    )


def _usable(record: Recording, name: str) -> Array:
    """A channel of a recording, NaN where it is masked or missing."""
    if name not in record.channels:
        return np.full(len(record), np.nan)
    return np.where(record.mask[name], record.channels[name], np.nan)


def _fastest(values: Array, step: int, sample_time: float) -> float:
    """Rate of change of a signal over so many samples that 99.5 % of its changes stay below."""
    moved = np.abs(values[step:] - values[:-step])
    if not np.isfinite(moved).any():
        return 0.0
    return float(np.nanquantile(moved, 0.995)) / (step * sample_time)


@dataclass(frozen=True)
class Frame:
    """Range of a load frame within which experiments stay.

    Attributes
    ----------
    rig : Rig
        The rig that it is a part of.
    lengths : Range
        Shortest and longest length [m].
    rate : float
        Fastest change of the length [m/s].
    held : float
        Length at which pressures are moved [m].
    pressure_rate : float
        Fastest change of a pressure that the bench sets [Pa/s].
    spans : Spans
        Pressures of the chains at the held length.
    """

    rig: Rig
    lengths: Range
    rate: float
    held: float
    pressure_rate: float
    spans: Spans

    def stroke(self, share: float) -> Range | None:
        """Lengths between which the muscles pull with all pressures at a share of their ranges;
        None where that is no stroke.
        """
        pressures = {name: span.at(share) for name, span in self.spans.alone.items()}
        chambers = {chain.chamber: pressures[chain.name] for chain in chains_of(self.rig)}
        low = _shortest(self.rig, chambers, self.lengths, _PULLING_SHARE)
        if self.lengths.high - low < _WORTH_STROKE * self.lengths.high:
            return None
        return Range(low, self.lengths.high)


def frame_of(
    rig: Rig,
    rates: Rates,
    highest: float | Mapping[str, float] | None = None,
    seen: Seen | None = None,
) -> Frame:
    """Range of the load frame of a rig for experiments.

    The longest length is the longest that was recorded, else that of the muscle at rest; the
    shortest is where the muscle hardly pulls any more at half of its highest pressure, or, with
    recordings, the shortest recorded one, at least a tenth of the length below the longest.
    Pressures begin where the muscle pulls at the length that is held, or as low as was recorded.

    Parameters
    ----------
    rig : Rig
        A rig with a frame and chains.
    rates : Rates
        Of a plain testing machine.
    highest : float or mapping of str to float, optional
        Gauge pressures that are not to be exceeded [Pa].
    seen : Seen, optional
        What recordings showed.

    Raises
    ------
    DiagnosisError
        If nothing says how high a pressure may go.
    """
    chains = chains_of(rig)
    tops = {chain.name: top_of(rig, chain, highest) for chain in chains}
    load = rig.tables("load")[""]
    rest = min(float(muscle["rest_length"]) for muscle in rig.tables("muscle").values())
    longest = min(load["max_length"], rest if seen is None else seen.lengths.high)
    whole = Range(min(load["min_length"], longest), longest)
    half = {c.chamber: 0.5 * tops[c.name] for c in chains}
    shortest = _shortest(rig, half, whole, _PULLING_SHARE)
    if seen is not None:
        least = longest - _LEAST_STROKE * rest
        shortest = max(whole.low, min(seen.lengths.low, max(shortest, least)))
    lengths = Range(shortest, longest)
    held = lengths.at(_HELD_SHARE)
    share = _lowest(rig, chains, tops, held, _PULLING_SHARE)
    alone = {}
    for chain in chains:
        top = tops[chain.name]
        low = share * top
        if seen is not None and seen.lowest < low:
            low = max(seen.lowest, 0.01 * top)
        alone[chain.name] = Range(low, top)
    return Frame(
        rig,
        lengths,
        max(rates.length_rate, 0.0 if seen is None else seen.rate),
        held,
        max(rates.pressure_rate, 0.0 if seen is None else seen.pressure_rate),
        Spans({name: span.at(0.5) for name, span in alone.items()}, alone),
    )


def _shortest(rig: Rig, pressures: Mapping[str, float], lengths: Range, pulling: float) -> float:
    """Shortest length [m] to which, from the longest on, the muscles keep a share of their pull."""
    tried = np.linspace(lengths.high, lengths.low, 41)
    least = pulling * _pull(rig, pressures, lengths.high)
    found = float(tried[0])
    for length in map(float, tried[1:]):
        if _pull(rig, pressures, length) < max(least, 0.0):
            break
        found = length
    return found


def _lowest(
    rig: Rig, chains: Iterable[Chain], tops: Mapping[str, float], length: float, pulling: float
) -> float:
    """Lowest share of the highest pressures, 0.1 to 0.5, at which the muscles pull enough."""

    def pull(share: float) -> float:
        return _pull(rig, {c.chamber: share * tops[c.name] for c in chains}, length)

    least = max(0.0, pulling * pull(1.0))
    return next((s for s in map(float, np.linspace(0.1, 0.5, 21)) if pull(s) >= least), 0.5)


def _pull(rig: Rig, pressures: Mapping[str, float], length: float) -> float:
    """Force of the muscles of a rig at rest at a length [m] and gauge pressures [Pa] by chamber
    [N].
    """
    valves = {name: table["null_voltage"] for name, table in rig.tables("valve").items()}
    run = simulate(
        rig,
        valves or None,
        sample_time=0.01,
        duration=0.0,
        length=length,
        initial={dotted("muscle_pressure", name): value for name, value in pressures.items()},
    )
    force = reading(run, "force")
    return 0.0 if force is None else float(force[0])
