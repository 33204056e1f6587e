"""Evidence against recordings before any fit: units, swapped columns and dead sensors.

A mismatch that a wrong heading makes is not physics. What is looked at needs no fit: sizes against
the rig file, the order of pressures, the range of joints, the sense in which a pressure follows its
valve and an angle its pressures. Each finding says what was found and what is allowed; nothing is
repaired.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pamrs import _core
from pamrs._arrays import Array, Mask, stretches
from pamrs.channels import block_of, channel_of, dotted, unit_of, with_trait
from pamrs.diagnosis.prepare._blocks import Block
from pamrs.diagnosis.prepare._residual import predicted
from pamrs.diagnosis.prepare._signals import NOISE_STDS, Prepared, moves_by_gauges
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.errors import SimulationError
from pamrs.findings import Faulty
from pamrs.recordings import Recording
from pamrs.rig import Rig
from pamrs.units import in_words

# [Pa] gauge pressure that a channel exceeds somewhere: bar under a heading in Pa does not
_LEAST_PEAK_PRESSURE = 100.0
# [Pa] no pressure is lower: a vacuum is at -101 kPa, and a transducer errs
_LEAST_GAUGE_PRESSURE = -1.1e5
# multiple of a pressure of the rig file, the largest or a supply's, that is allowed
_MOST_RATED_MULTIPLE = 5.0
# highest measured supply pressure over that of the rig file, at the least
_SUPPLY_LEAST_SHARE = 0.05
# share of the supply's pressure by which a muscle's may exceed it (errors of two transducers)
_ORDER_MARGIN = 0.05
_ORDER_OFFSET = 1e4  # [Pa] pressure by which it may exceed it besides (zeros of two transducers)
# share of the time for which it may exceed it by more, or a command its span
_MOST_TIME_SHARE = 0.5
_LEAST_ANGLE_MARGIN = 0.1  # [rad] by which a joint may leave its range at the least
_LEAST_LENGTH_MARGIN = 0.01  # [m] by which a load may leave its range at the least
_RANGE_TIME_SHARE = 0.2  # share of the time for which it may leave its range by more
_FASTEST_LOAD = 20.0  # [m/s] speed of a load that one sample in a hundred may exceed
# [Pa] change of a muscle's pressure that moves its tank's, and from which its sense is tested
_LEAST_CHANGE = 2e4
# relative change of pressures during which what they move cannot read one and the same value
_FROZEN_MOTION_SHARE = 0.1
# share of a pressure's change against its command; motion and leaks do some of it as well
_OPPOSED_SHARE = 0.6
_OPPOSED_CORRELATION = -0.2  # correlation of command and change below which that counts
# [rad] change of an angle up to which the muscles' volume hardly moves their pressure
_STILL_ANGLE = 0.02
_STILL_LENGTH = 1e-3  # [m] change of a load's length up to which volume hardly moves pressure
# [half ranges] distance of a command from its null beyond which it is another column or unit
_COMMAND_SPAN = 2.0
# [s] rest and change that one value of a valve's command cannot have made: leaks are slower
_DEAD_COMMAND_TIME = 0.5
# share of an absolute pressure that it changes at rest: beyond the noise of a gauge
_DEAD_COMMAND_STILL = 0.02
# ratio of absolute pressures then: moving a shut muscle changes its volume by less
_DEAD_COMMAND_RATIO = 1.5
# quantile of a regulator's command that is its largest; above are a logger's spikes
_COMMAND_QUANTILE = 0.995
_SENSE_TIME = 0.1  # [s] time over which a change of pressure is compared with the command
# [standard deviations] misfit of an angle as recorded from which its unit or sign may be wrong
_SENSE_WRONG = 1.0
# [standard deviations] misfit in another unit or sign below which that is the right one
_SENSE_RIGHT = 0.4


_PRESSURE_CHANNELS = with_trait("pressure")
MOST_LISTED = 12
"""Findings, or stretches of a recording, that a message lists."""


def without_impossible(
    recordings: Sequence[Recording], rig: Rig, settings: DiagnosisSettings
) -> tuple[list[Recording], list[str]]:
    """Recordings whose samples beyond what the rig allows are masked, so that nothing starts there.

    A recording that is beyond it for long is left out before.

    Returns
    -------
    recordings : list of Recording
    notes : list of str
        A line for each channel of each recording with such samples: how many, and when.
    """
    limits = {m.channel: (m.low - m.margin, m.high + m.margin) for m in _moving(rig, settings)}
    masked, notes = [], []
    for recording in recordings:
        mask = dict(recording.mask)
        channels = dict(recording.channels)
        for name in recording.channels:
            low, high = limits.get(name, (-math.inf, math.inf))
            if channel_of(name) in (*_PRESSURE_CHANNELS, "supply_command"):
                low, high = _LEAST_GAUGE_PRESSURE, settings.most_pressure
            bad = mask[name] & ((channels[name] < low) | (channels[name] > high))
            table = rig.tables("valve").get(block_of(name))
            if channel_of(name) == "valve_command" and table is not None:
                bad, low, high = _lost_commands(channels[name], mask[name], table, settings)
            if bad.any():
                mask[name] = mask[name] & ~bad
                channels[name] = np.where(bad, np.nan, channels[name])
                where = recording.source or recording.name
                notes.append(
                    f"{recording.name}: {int(bad.sum())} samples of {name} in {where} are beyond "
                    f"the possible ({_text(recording, name, low, high)}) and were masked: "
                    f"{_when(bad, recording)}"
                )
        masked.append(replace(recording, mask=mask, channels=channels))
    return masked, notes


def _lost_commands(
    values: Array, mask: Mask, table: Mapping[str, Any], settings: DiagnosisSettings
) -> tuple[Mask, float, float]:
    """Samples that a logger lost of a valve's command, and the range [V] beyond which they are.

    A controller may ask for more than its valve can do, and comes there from the end of the range
    or stays there by many values. What was lost is one value, entered from inside the range and
    left to inside it.
    """
    span = _COMMAND_SPAN * table["half_range"]
    low, high = table["null_voltage"] - span, table["null_voltage"] + span
    off = np.where(mask, values, table["null_voltage"]) - table["null_voltage"]
    beyond, inside = np.abs(off) > span, np.abs(off) <= table["half_range"]
    runs = stretches(beyond)
    one = {float(values[a]) for a, _ in runs}
    # a controller at its ends asks for as much on both sides
    ends = len(one) == 2 and len({abs(value - table["null_voltage"]) for value in one}) == 1
    lost = (
        len(one) <= 2
        and not ends
        and all(
            np.ptp(values[a:b]) == 0.0
            and (a == 0 or inside[a - 1])
            and (b == values.size or inside[b])
            for a, b in runs
        )
    )
    rare = float(np.mean(beyond)) <= settings.lost_command_share
    return (beyond if lost and rare else np.zeros_like(beyond)), low, high


def _when(bad: Mask, recording: Recording) -> str:
    """The first stretches in which something is, in seconds."""
    pairs = stretches(bad)
    spans = [
        f"{recording.time[a]:.4g} to {recording.time[b - 1]:.4g} s" for a, b in pairs[:MOST_LISTED]
    ]
    more = f" and {len(pairs) - MOST_LISTED} more stretches" * (len(pairs) > MOST_LISTED)
    return ", ".join(spans) + more


def _text(recording: Recording, name: str, *values: float, digits: str = ".3g") -> str:
    """Values of a channel in the unit that its log has."""
    return in_words(recording.said.get(name, ""), unit_of(name), *values, digits=digits)


def _values(recording: Recording, name: str) -> Array:
    """Usable samples of a channel; none where it was not measured."""
    if name not in recording.channels:
        return np.zeros(0)
    return np.asarray(recording.channels[name][recording.mask[name]], dtype=np.float64)


def slow_clock(recording: Recording, rig: Rig, settings: DiagnosisSettings) -> Iterator[str]:
    """Finding on a sample time that is too long for motion to be followed."""
    longest = settings.longest_sample_time
    if _moving(rig, settings) and recording.sample_time > longest:
        what = "a joint" if rig.tables("joint") else "a load"
        yield (
            f"a sample every {recording.sample_time:g} s is too slow for {what}: at most "
            f"{longest:g} s; is the unit of 'time' (ms, us) the one its values are in?"
        )


def impossible_pressures(
    recording: Recording, rig: Rig, settings: DiagnosisSettings
) -> Iterator[str]:
    """Findings on sizes of pressures, alone and against the rig file or a regulator's command."""
    rated = {
        dotted("supply_pressure", supply): set_to
        for supply in rig.tables("supply")
        if (set_to := _set_pressure(recording, rig, supply)) is not None
    }
    largest = max(
        [
            *(size for size, _ in rated.values()),
            *(float(t["initial_pressure"]) for t in rig.tables("chamber").values()),
        ],
        default=0.0,
    )
    top = max(settings.most_pressure, _MOST_RATED_MULTIPLE * largest)
    for name in recording.channels:
        values = _values(recording, name)
        if (
            channel_of(name) not in ("supply_pressure", "line_pressure", "muscle_pressure")
            or values.size < 3
        ):
            continue
        high = float(np.quantile(np.abs(values), 0.995))
        if 0.0 < high < _LEAST_PEAK_PRESSURE and np.ptp(values) > 0.0:
            yield (
                f"{name} never exceeds {_text(recording, name, high)} gauge; a pressure of air "
                f"exceeds {_text(recording, name, _LEAST_PEAK_PRESSURE)} somewhere: are its values "
                "in bar (or is it another column, an angle or a voltage) under a heading in Pa?"
            )
        elif high > top:
            yield (
                f"{name} reaches {_text(recording, name, high)} gauge; at most "
                f"{_text(recording, name, top)} is allowed: are its values in Pa, kPa or psi under "
                "a heading in bar?"
            )
        elif name in rated:
            size, command = rated[name]
            source = f"the largest {command} is" if command else "the rig file has"
            low_end = _SUPPLY_LEAST_SHARE * min(size, _in_front(recording, rig, block_of(name)))
            if size > 0.0 and not low_end <= high <= _MOST_RATED_MULTIPLE * size:
                yield (
                    f"{name} is at most {_text(recording, name, high)} and {source} "
                    f"{_text(recording, name, size)}; "
                    f"{_text(recording, name, low_end, _MOST_RATED_MULTIPLE * size)} is allowed: "
                    "right column and unit?"
                )


def _inlet_of(rig: Rig, supply: str) -> str:
    """Name of the supply in front of a regulator, empty where there is none."""
    return block_of(rig.ports("supply")[supply].get("inlet", ""))


def _in_front(recording: Recording, rig: Rig, supply: str) -> float:
    """Lowest known pressure in front of a regulator [Pa gauge]: it may be set to more, and gives no
    more; infinite where there is no inlet.
    """
    inlet = _inlet_of(rig, supply)
    if not inlet:
        return math.inf
    known = _values(recording, dotted("supply_pressure", inlet))
    stated = float(rig.tables("supply")[inlet]["initial_pressure"])
    return max(0.0, float(known.min())) if known.size else stated


def _set_pressure(recording: Recording, rig: Rig, supply: str) -> tuple[float, str] | None:
    """Highest pressure [Pa gauge] that a supply should have, and the command that says so; no
    command where the rig file does.

    A regulator may be set to anything: its largest command tells, but for spikes; None where it was
    not recorded, and of a supply that is only measured.
    """
    table = rig.tables("supply")[supply]
    if table["kind"] == "measured":
        return None
    if table["kind"] != "regulator":
        return float(table["initial_pressure"]), ""
    command = dotted("supply_command", supply)
    known = _values(recording, command)
    return (float(np.quantile(known, _COMMAND_QUANTILE)), command) if known.size else None


def frozen_tanks(recording: Recording, rig: Rig, _: DiagnosisSettings) -> Iterator[str]:
    """Findings on tanks that read one value although they are drawn from."""
    valves = rig.ports("valve")
    for supply, table in rig.tables("supply").items():
        name = dotted("supply_pressure", supply)
        values, drawn = (
            _values(recording, name),
            any(ends["from"] == dotted("supply", supply) for ends in valves.values())
            or any(_inlet_of(rig, other) == supply for other in rig.tables("supply") if supply),
        )
        if table["kind"] != "tank" or not drawn or values.size < 16 or np.ptp(values) > 0.0:
            continue
        moved = [
            v
            for c in rig.tables("chamber")
            if (v := _values(recording, dotted("muscle_pressure", c))).size
        ]
        if any(float(np.ptp(v)) > _LEAST_CHANGE for v in moved):
            yield (
                f"{name} has the one value {_text(recording, name, values[0], digits='.6g')} "
                "throughout although its tank is drawn from: a frozen transducer; leave "
                'the column out, or say [supply] kind = "constant" if it is one'
            )


def fed_by(rig: Rig) -> dict[str, list[str]]:
    """Names of the supplies that feed each chamber through valves or lines."""
    ports = {block: rig.ports(block) for block in ("valve", "line")}
    into = [(e["from"], e["to"]) for block in ports.values() for e in block.values() if e["from"]]
    inlets = {dotted("line", name): e["to"] for name, e in ports["line"].items()}
    suppliers: dict[str, list[str]] = {name: [] for name in rig.tables("chamber")}
    for start, end in into:
        kind, _, supply = start.partition(".")
        other, _, chamber = inlets.get(end, end).partition(".")
        if kind == "supply" and other == "chamber":
            suppliers[chamber].append(supply)
    return suppliers


def swapped_pressures(recording: Recording, rig: Rig, _: DiagnosisSettings) -> Iterator[str]:
    """Findings on muscles above their supply's pressure, and regulators above their inlet's."""
    fed = {
        dotted("muscle_pressure", chamber): suppliers for chamber, suppliers in fed_by(rig).items()
    }
    for regulator in rig.tables("supply"):
        inlet = _inlet_of(rig, regulator)
        if inlet and dotted("supply_pressure", inlet) in recording.channels:
            fed[dotted("supply_pressure", regulator)] = [inlet]
    for name, supplies in fed.items():
        for supply in supplies:
            if name not in recording.channels:
                continue
            highest = _highest(recording, rig, supply)
            if highest is None:
                continue
            source, rows, limit = highest
            rows = rows & recording.mask[name]
            limit = limit[rows]
            if rows.sum() < 16:
                continue
            allowed = limit + _ORDER_MARGIN * np.abs(limit) + _ORDER_OFFSET
            above = recording.channels[name][rows] > allowed
            share = float(np.mean(above))
            if share > _MOST_TIME_SHARE:
                median, other = (
                    _text(recording, name, float(np.median(median)))
                    for median in (recording.channels[name][rows], limit)
                )
                yield (
                    f"{name} is above {source} for {100 * share:.0f} % of the time (medians "
                    f"{median} and {other}); at most {100 * _MOST_TIME_SHARE:.0f} % is allowed: "
                    "are the two columns swapped, or one of their units wrong?"
                )


def _highest(recording: Recording, rig: Rig, supply: str) -> tuple[str, Mask, Array] | None:
    """Source of a supply's pressure, rows in which it is known, and the highest that it can be.

    That is its gauge; of a regulator without one the largest set pressure, since what it feeds
    follows a falling one late; else the pressure of the rig file. None where nothing tells it.
    """
    full = dotted("supply_pressure", supply)
    if full in recording.channels:
        return full, recording.mask[full], recording.channels[full]
    set_to = _set_pressure(recording, rig, supply)
    if set_to is None:
        return None
    size, command = set_to
    source = f"the largest {command}" if command else f"{full} of the rig file"
    return source, np.ones(len(recording), dtype=np.bool_), np.full(len(recording), size)


@dataclass(frozen=True)
class _Moving:
    """Joint or load that muscles move: channel, unit, range, margin, speed, and chambers."""

    channel: str
    unit: str
    low: float
    high: float
    margin: float
    fastest: float
    pulled: tuple[str, ...]


def _moving(rig: Rig, settings: DiagnosisSettings) -> list[_Moving]:
    """The joints of a rig, or its hanging load."""
    ends = rig.ports("muscle").values()
    moving = []
    for joint, table in rig.tables("joint").items():
        low, high = float(table["min_angle"]), float(table["max_angle"])
        pulled = tuple(block_of(e["chamber"]) for e in ends if e["joint"] == dotted("joint", joint))
        margin = max(_LEAST_ANGLE_MARGIN, settings.range_margin * (high - low))
        moving.append(
            _Moving(
                dotted("joint_angle", joint),
                "rad",
                low,
                high,
                margin,
                settings.fastest_joint,
                pulled,
            )
        )
    load = rig.model["load"]
    if load and load["kind"] == "mass":
        low, high = float(load["min_length"]), float(load["max_length"])
        pulled = tuple(block_of(e["chamber"]) for e in ends)
        margin = max(_LEAST_LENGTH_MARGIN, settings.range_margin * (high - low))
        moving.append(_Moving("length", "m", low, high, margin, _FASTEST_LOAD, pulled))
    return moving


def impossible_motion(recording: Recording, rig: Rig, settings: DiagnosisSettings) -> Iterator[str]:
    """Findings on range, rate and life of joint angles and of a load's length."""
    for moving in _moving(rig, settings):
        name, unit = moving.channel, moving.unit
        values = _values(recording, name)
        if values.size < 3:
            continue
        share = float(
            np.mean((values < moving.low - moving.margin) | (values > moving.high + moving.margin))
        )
        if share > _RANGE_TIME_SHARE:
            whose, units = (
                ("its joint's range", "deg or rad")
                if unit == "rad"
                else ("its load's range", "mm or m")
            )
            yield (
                f"{name} is outside {whose} for {100 * share:.0f} % of the time: from "
                f"{_text(recording, name, values.min(), values.max())}, where "
                f"{_text(recording, name, moving.low, moving.high)} are possible: right column"
                f"{', no contraction' * (unit == 'm')}, unit ({units}) and sign?"
            )
        rows = recording.mask[name]
        steps = (
            np.abs(np.diff(recording.channels[name]))[rows[1:] & rows[:-1]] / recording.sample_time
        )
        fast = float(np.quantile(steps, 0.99)) if steps.size >= 16 else 0.0
        if fast > moving.fastest:
            yield (
                f"{name} {'turns' if unit == 'rad' else 'moves'} with "
                f"{_text(recording, name, fast)}/s, one sample in a hundred faster; at most "
                f"{_text(recording, name, moving.fastest)}/s is allowed: are the units of 'time' "
                f"(s, ms, us) and of the {'angle' if unit == 'rad' else 'length'} those that their "
                "values are in?"
            )
        pressures = [
            v for c in moving.pulled if (v := _values(recording, dotted("muscle_pressure", c))).size
        ]
        if (
            values.size >= 16
            and np.ptp(values) == 0.0
            and any(
                float(np.ptp(v)) > _FROZEN_MOTION_SHARE * float(np.abs(v).max()) > 1e3
                for v in pressures
            )
        ):
            what = (
                "a frozen encoder and a joint that is held"
                if unit == "rad"
                else "a frozen transducer and a load that is held"
            )
            yield (
                f"{name} has the one value {_text(recording, name, values[0], digits='.4g')} "
                f"throughout while its muscles' pressures change: {what} cannot be told apart, "
                "and neither is in the model; leave the recording out"
            )


def reversed_valves(recording: Recording, rig: Rig, _: DiagnosisSettings) -> Iterator[str]:
    """Findings on commands outside the valve's range, and on pressures that go against them."""
    still_by = {"joint_angle": _STILL_ANGLE, "length": _STILL_LENGTH}
    inlets = {dotted("line", name): e["to"] for name, e in rig.ports("line").items()}
    for valve, ends in rig.ports("valve").items():
        name, table = dotted("valve_command", valve), rig.tables("valve")[valve]
        chamber = block_of(inlets.get(ends["to"], ends["to"]))
        pressure = dotted("muscle_pressure", chamber)
        if name not in recording.channels or pressure not in recording.channels:
            continue
        both = recording.valid(name, pressure)
        if both.sum() < 32:
            continue
        if np.ptp(recording.channels[name][both]) == 0.0:
            continue
        opening = (recording.channels[name] - table["null_voltage"]) / table["half_range"]
        beyond = float(np.mean(np.abs(opening[both]) > _COMMAND_SPAN))
        if beyond > _MOST_TIME_SHARE:
            middle = float(np.median(recording.channels[name][both]))
            yield (
                f"{name} is beyond twice its valve's range for {100 * beyond:.0f} % of the time "
                f"(median {_text(recording, name, middle)}); "
                f"{_text(recording, name, table['null_voltage'])} +- "
                f"{_text(recording, name, table['half_range'])} is the range: right column and "
                "unit?"
            )
            continue
        if sum(e["to"] == ends["to"] for e in rig.ports("valve").values()) > 1:
            continue  # another valve may fill while this one vents
        width = max(2, round(_SENSE_TIME / recording.sample_time))
        rows = np.flatnonzero(both[:-width] & both[width // 2 : -width + width // 2] & both[width:])
        # what swings moves the pressure by its volume, whatever the valve does
        for place, still in (
            (v, still_by[channel_of(c)])
            for c, v in recording.channels.items()
            if channel_of(c) in still_by
        ):
            rows = rows[~(np.abs(place[rows + width] - place[rows]) > still)]
        change = recording.channels[pressure][rows + width] - recording.channels[pressure][rows]
        towards, moved = (
            opening[rows + width // 2],
            float(np.ptp(recording.channels[pressure][both])),
        )
        if (
            rows.size < 32
            or moved < _LEAST_CHANGE
            or not np.ptp(towards) > 0.0
            or not np.ptp(change) > 0.0
        ):
            continue
        against = float(np.abs(change)[towards * change < 0.0].sum() / np.abs(change).sum())
        correlation = float(np.corrcoef(towards, change)[0, 1])
        if against > _OPPOSED_SHARE and correlation < _OPPOSED_CORRELATION:
            yield (
                f"{100 * against:.0f} % of the change of {pressure} goes against {name} (rises "
                "while it says vent, falls while it says fill); at most "
                f"{100 * _OPPOSED_SHARE:.0f} % is allowed: is the command's sign, unit or "
                "column right?"
            )


def _commanded(rig: Rig) -> Iterator[tuple[str, str]]:
    """Commands of valves and regulators, each with a pressure that it sets."""
    lines = rig.ports("line")
    inlets = {dotted("line", name): ends["to"] for name, ends in lines.items()}

    def filled(end: str) -> str:
        return dotted("muscle_pressure", block_of(inlets.get(end, end)))

    for valve, ends in rig.ports("valve").items():
        yield dotted("valve_command", valve), filled(ends["to"])
    for supply, table in rig.tables("supply").items():
        if table["kind"] == "regulator":
            command = dotted("supply_command", supply)
            yield command, dotted("supply_pressure", supply)
            direct = [e["to"] for e in lines.values() if e["from"] == dotted("supply", supply)]
            yield from ((command, filled(end)) for end in direct)


def _dead_commands(recording: Recording, rig: Rig) -> dict[str, str]:
    """Commands of one value while their pressure rests and then is filled or vented, with the
    evidence: at one opening, or one set pressure, it comes to rest once, and motion changes it by
    less.
    """
    ambient = float(rig.model["gas"]["ambient_pressure"])
    evidence: dict[str, str] = {}
    for command, pressure in _commanded(rig):
        if command not in recording.channels or pressure not in recording.channels:
            continue
        both = recording.valid(command, pressure)
        values = recording.channels[command][both]
        width = max(2, round(_DEAD_COMMAND_TIME / recording.sample_time))
        if values.size < 32 or np.ptp(values) > 0.0 or len(recording) <= 3 * width:
            continue
        mask = recording.mask[pressure]
        absolute = np.where(mask, recording.channels[pressure] + ambient, np.nan)
        before, now, later = absolute[: -2 * width], absolute[width:-width], absolute[2 * width :]
        with np.errstate(invalid="ignore", divide="ignore"):
            still = np.abs(now / before - 1.0) < _DEAD_COMMAND_STILL
            change = np.exp(np.abs(np.log(later / now)))
        largest = float(np.nanmax(np.where(still, change, np.nan), initial=1.0))
        if largest > _DEAD_COMMAND_RATIO:
            evidence[command] = (
                f"{command} has one value throughout "
                f"({_text(recording, command, values[0], digits='g')}) while {pressure} stands "
                f"still and then changes {largest:.3g}-fold (absolute) within "
                f"{_DEAD_COMMAND_TIME:g} s; at most {_DEAD_COMMAND_RATIO:g}-fold can be of one "
                "command"
            )
    return evidence


def unlogged_commands(recording: Recording, rig: Rig, _: DiagnosisSettings) -> Iterator[str]:
    """Findings on commands of one value that were not logged."""
    for finding in _dead_commands(recording, rig).values():
        yield (
            f"{finding}: a command that was not logged; map the right column, or leave this one out"
        )


def without_dead_commands(
    recordings: Sequence[Recording], rig: Rig
) -> tuple[list[Recording], list[Faulty]]:
    """Recordings without commands of one value that the pressures behind them contradict.

    The channel is left out, where what moves can be judged by its gauges alone; a recording with
    such a command among others without one is left out instead, so that these keep their valve.

    Returns
    -------
    recordings : list of Recording
        As they were where nothing could be judged otherwise.
    faults : list of Faulty
        Each command that was not logged.
    """
    if not all(moves_by_gauges(recording, rig) for recording in recordings):
        return list(recordings), []
    recordings_left, faults = list(recordings), list[Faulty]()
    for command in dict.fromkeys(command for command, _ in _commanded(rig)):
        evidence = {r.name: _dead_commands(r, rig).get(command) for r in recordings_left}
        dead = {name: text for name, text in evidence.items() if text}
        # what has that one value elsewhere was not logged there either
        live = [r for r in recordings_left if r.name not in dead and _moves(r, command)]
        if not dead:
            continue
        if any(r.role == "fit" for r in live):
            gone = [r.name for r in recordings_left if all(r is not one for one in live)]
            recordings_left, done = (
                live,
                f"{', '.join(gone)} cannot be judged with the others without it",
            )
        else:
            recordings_left = [without_channel(r, command) for r in recordings_left]
            done = "what it drives is not judged"
        text = f"{next(iter(dead.values()))}: it was not logged; {done}"
        faults.append(Faulty(command, "not_logged", text))
    return recordings_left, faults


def _moves(recording: Recording, channel: str) -> bool:
    """True where a channel has more than one value."""
    values = _values(recording, channel)
    return bool(values.size) and float(np.ptp(values)) > 0.0


def without_channel(recording: Recording, channel: str) -> Recording:
    """A recording without a channel."""
    channels, mask = dict(recording.channels), dict(recording.mask)
    del channels[channel], mask[channel]
    return replace(recording, channels=channels, mask=mask)


def turned_about(
    blocks: Sequence[Block], recordings: Sequence[Prepared], core: _core.Rig
) -> list[str]:
    """Findings on angles that are the model's own in another unit, and on angles and lengths that
    go the opposite way throughout: one for each recording, where most of them have one.
    """
    findings = []
    for block in (b for b in blocks if channel_of(b.channel) in ("joint_angle", "length")):
        for prepared in recordings:
            try:
                text = _sense(block, core, prepared)
            except SimulationError:
                continue
            if text:
                findings.append(f"recording {prepared.recording.name!r}: {text}")
    # one recording may be odd; a heading is wrong in all of them
    return findings if len(findings) * 2 > len(recordings) else []


def _sense(block: Block, core: _core.Rig, prepared: Prepared) -> str | None:
    """Finding on an angle or a length that the model would have in another unit, with the other
    sign, or with two pressures swapped; None where there is none.
    """
    starts = prepared.starts(block.window, block.drives)
    rows = prepared.usable(block.channel, block.drives, starts)
    if rows.sum() < 64:
        return None
    measured, model = (
        prepared.recording.channels[block.channel][rows],
        predicted(block, core, prepared)[rows],
    )
    still = float(np.std(measured)) < NOISE_STDS * prepared.noise[block.channel]
    if still or _misfit(measured, model) < _SENSE_WRONG:
        return None
    signals, name = prepared.signals, block.channel
    value, slope = signals[name]
    span = _text(prepared.recording, name, measured.min(), measured.max())
    shown = f"{name} goes from {span}, not as the model says"
    turned = float(np.median(measured + model))
    degrees = math.degrees(1.0)
    factors = [
        (
            degrees,
            0.0,
            f"{degrees:.3g} times that would: are its values in rad under a heading in deg?",
        ),
        (
            1.0 / degrees,
            0.0,
            f"{1.0 / degrees:.3g} times that would: are its values in deg under a heading in rad?",
        ),
        (
            -1.0,
            turned,
            "it moves opposite to the model throughout: is its sign that of the rig, or are two "
            "muscles swapped?",
        ),
    ]
    if channel_of(name) == "length":
        factors = [
            (-1.0, turned, "it grows where the model's falls: does its sensor count the other way?")
        ]
    others: list[tuple[float, float, dict[str, tuple[Array, Array]], str]] = [
        (factor, offset, {}, text) for factor, offset, text in factors
    ]
    for one, two in itertools.combinations([d for d in block.drives if d in signals], 2):
        text = f"with {one} and {two} in each other's place it would: are these columns swapped?"
        others.append((1.0, 0.0, {one: signals[two], two: signals[one]}, text))
    misfits = []
    for factor, offset, swapped, text in others:
        raw = prepared.raw | {name: offset + factor * prepared.raw[name]}
        noise = prepared.noise | {name: abs(factor) * prepared.noise[name]}
        shown_as = {**signals, **swapped, name: (offset + factor * value, factor * slope)}
        other = replace(prepared.with_signals(shown_as), raw=raw, noise=noise, _start_states={})
        try:
            model = predicted(block, core, other)[rows]
        except SimulationError:
            continue
        expected = offset + factor * measured
        if factor < 0.0:  # where it turns about is not known
            expected, model = expected - expected.mean(), model - model.mean()
        misfits.append((_misfit(expected, model), text))
    best, text = min(misfits, default=(math.inf, ""))
    return f"{shown}; {text}" if best < _SENSE_RIGHT else None


def _misfit(measured: Array, model: Array) -> float:
    """Root mean square of measured minus model in standard deviations of the measured."""
    return float(np.sqrt(np.mean((measured - model) ** 2))) / max(float(np.std(measured)), 1e-300)
