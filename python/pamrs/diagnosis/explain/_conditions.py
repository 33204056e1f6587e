"""Conditions under which a residual is large: their shares, and intervals in time."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pamrs._arrays import Array, Mask, stretches
from pamrs.channels import block_of, channel_of, dotted
from pamrs.diagnosis.fit import Key
from pamrs.diagnosis.noise import NoiseLevel, bins_of
from pamrs.diagnosis.prepare import Block, Prepared, binned
from pamrs.findings import Condition
from pamrs.rig import Rig
from pamrs.units import with_unit


@dataclass
class Picture:
    """Conditions and times at which a block has its excess.

    Attributes
    ----------
    conditions : list of Condition
        The most telling first.
    intervals : list of [t0, t1]
        In the recording with the largest excess [s].
    recording : str
        That recording.
    """

    conditions: list[Condition] = field(default_factory=list)
    intervals: list[list[float]] = field(default_factory=list)
    recording: str = ""


def _binned(values: Array, rows: Mask, width: int) -> Array:
    return binned(values, rows, width)[0]


def _named(quantity: str, channel: str, unit: str) -> str:
    """A condition's label: ``muscle pressure of flexor [bar]``."""
    name = block_of(channel)
    return with_unit(f"{quantity} of {name}" if name else quantity, f"[{unit}]" if unit else "")


def _conditions(block: Block, prepared: Prepared, rig: Rig, width: int) -> dict[str, Array]:
    """Continuous conditions of each bin, by name."""
    all_rows = np.ones(prepared.n, dtype=bool)
    out = {}
    involved = (block.channel, *block.drives)
    pressures = [
        name
        for name in prepared.signals
        if channel_of(name) == "muscle_pressure" and name in involved
    ]
    for name in pressures or [
        name for name in prepared.signals if channel_of(name) == "muscle_pressure"
    ]:
        out[_named("muscle pressure", name, "bar")] = (
            _binned(prepared.signals[name][0], all_rows, width) / 1e5
        )
    for valve, table in rig.tables("valve").items():
        name = dotted("valve_command", valve)
        if name in prepared.recording.channels and (name in involved or block.mechanical):
            opening = np.clip(
                (prepared.commands[name] - table["null_voltage"]) / table["half_range"], -1, 1
            )
            out[_named("valve opening", name, "")] = _binned(opening, all_rows, width)
    for name, (angle, rate) in prepared.signals.items():
        if channel_of(name) == "joint_angle":
            out[_named("joint angle", name, "deg")] = np.degrees(_binned(angle, all_rows, width))
            out[_named("joint rate", name, "deg/s")] = np.degrees(_binned(rate, all_rows, width))
        elif name == "length":
            out["length of the muscle [mm]"] = 1e3 * _binned(angle, all_rows, width)
            out["muscle rate [mm/s]"] = 1e3 * _binned(rate, all_rows, width)
    out["time [s]"] = _binned(prepared.recording.time, all_rows, width)
    return out


def _regimes(c: dict[str, Array]) -> dict[str, Mask]:
    """Named yes/no conditions of each bin."""
    out: dict[str, Mask] = {}
    for name, values in c.items():
        quantity, _, _ = name.partition(" [")
        of = " of" + quantity.partition(" of")[2] if " of " in quantity else ""
        if quantity.startswith("valve opening"):
            shut = np.abs(values) < 0.01
            out |= {
                f"valve{of} closed": shut,
                f"valve{of} filling": values >= 0.01,
                f"valve{of} venting": values <= -0.01,
            }
        elif quantity.startswith("joint rate"):
            still = np.abs(values) < 0.5
            words = (
                ("muscle contracting", "muscle extending")
                if not of
                else (f"joint{of} rising", f"joint{of} falling")
            )
            out |= {
                f"joint{of} at rest": still,
                words[0]: ~still & (values > 0),
                words[1]: ~still & (values < 0),
            }
        elif quantity == "muscle rate":
            out |= {
                "load at rest": np.abs(values) < 1.0,
                "muscle contracting": values <= -1.0,
                "muscle extending": values >= 1.0,
            }
        elif quantity.startswith("muscle pressure"):
            low, high = np.quantile(values, [1 / 3, 2 / 3])
            if high - low > 0.05:
                out |= {
                    f"pressure{of} below {low:.2g} bar": values < low,
                    f"pressure{of} above {high:.2g} bar": values > high,
                }
    return out


def describe(
    block: Block,
    recordings: list[Prepared],
    rig: Rig,
    residuals: dict[Key, Any],
    noise_level: dict[Key, NoiseLevel],
) -> Picture:
    """Shares of the excess by condition, and intervals in the worst recording."""
    columns: dict[str, list[Array]] = {}
    scaled, worst, picture = [], -1.0, Picture()
    for prepared in recordings:
        key = (block.name, prepared.recording.name)
        width = bins_of(prepared)
        means, counts = binned(residuals[key].value, residuals[key].rows, width)
        ok = counts > 0
        # inside a window the residual is an integral: its change says where the cause acts
        score = means / noise_level[key].binned
        cause = (
            score
            if block.window is None
            else _change(residuals[key].value, residuals[key].rows, width) / noise_level[key].binned
        )
        conditions = _conditions(block, prepared, rig, width)
        for name, values in conditions.items():
            columns.setdefault(name, []).append(values[ok])
        scaled.append(cause[ok])
        power = float(np.mean(score[ok] ** 2)) if ok.any() else 0.0
        if power > worst:
            worst = power
            picture.recording = prepared.recording.name
            picture.intervals = _intervals(np.abs(score) > 3.0, width * prepared.dt)
    # a channel that one of the recordings lacks is no condition of them all
    joined = {
        name: np.concatenate(parts)
        for name, parts in columns.items()
        if len(parts) == len(recordings)
    }
    z = np.concatenate(scaled)
    picture.conditions = _shares(_regimes(joined), z, rising=block.window is not None)
    return picture


def _shares(regimes: dict[str, Mask], z: Array, *, rising: bool) -> list[Condition]:
    """Share of the excess that each condition carries and none before it has, the most telling
    first: no bin is counted twice, so that shares add up to at most all of it.
    """
    excess = np.maximum(z**2 - 1.0, 0.0)
    total, conditions = float(np.sum(excess)), list[Condition]()
    rest, waiting = np.ones(z.size, dtype=bool), dict(regimes)
    while total > 0.0:
        waiting = {
            name: remaining
            for name, mask in waiting.items()
            if (remaining := mask & rest).sum() >= 10
        }
        if not waiting:
            break

        def telling(mask: Mask) -> float:
            return float(np.sum(excess[mask])) ** 2 / max(0.02, float(mask.mean()))

        name = max(waiting, key=lambda name: telling(waiting[name]))
        mask = waiting.pop(name)
        rest &= ~mask
        share, time = float(np.sum(excess[mask])) / total, float(mask.mean())
        text = (
            f"{'otherwise ' if conditions else ''}{name}: {100 * share:.0f} % of the excess over "
            f"the noise, in {100 * time:.0f} % of the time{_sign(z[mask], rising=rising)}"
        )
        conditions.append(Condition(name, share, time, float(z[mask].mean()), text))
    return conditions


_ONE_SIDED = 0.5
"""Mean over root mean square from which a residual is said to lie on one side."""


def _sign(z: Array, *, rising: bool) -> str:
    """Words for the side of the model on which the measurement lies, or if it rises or falls."""
    mean, size = float(z.mean()), float(np.sqrt(np.mean(z**2)))
    if abs(mean) > max(_ONE_SIDED * size, 2.0 / math.sqrt(z.size)):
        words = ("falls against", "rises against") if rising else ("lies below", "lies above")
        return f", where the measurement {words[mean > 0.0]} the model"
    if size < 1.0:
        return ""
    both = "rises and falls against" if rising else "lies above and below"
    return f", where the measurement {both} the model"


def _change(values: Array, rows: Mask, width: int) -> Array:
    means, counts = binned(values, rows, width)
    change = np.zeros_like(means)
    change[1:] = np.where((counts[1:] > 0) & (counts[:-1] > 0), means[1:] - means[:-1], 0.0)
    limit = 20.0 * float(np.median(np.abs(change)) + 1e-300)
    return np.where(np.abs(change) > limit, 0.0, change)


def _intervals(flags: Mask, bin_time: float, most: int = 12) -> list[list[float]]:
    # bridge single bins, keep the longest stretches
    bridged = flags.copy()
    bridged[1:-1] |= flags[:-2] & flags[2:]
    spans = sorted(stretches(bridged), key=lambda s: s[0] - s[1])[:most]
    return [
        [round(float(a * bin_time), 3), round(float(b * bin_time), 3)] for a, b in sorted(spans)
    ]
