"""Curve error of a model, stated in its rig file or usual: smooth curves over what is measured, and
the change of a block's output by each.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from pamrs import _core
from pamrs.channels import DRIVEN_COMMANDS, block_of, channel_of, with_trait
from pamrs.diagnosis.prepare import Block, Prepared, Residual, binned, change
from pamrs.errors import SimulationError
from pamrs.rig import Rig

# waves of a curve: a shift, one to fifteen half periods over the range of a signal (decision 95)
_CURVE_WAVES = 16


Array = NDArray[np.float64]
CurveErrors = Mapping[str, Mapping[str, float]]
"""Sizes of curve errors by block or channel, as :attr:`pamrs.Rig.model_error`."""
OperatingRanges = Mapping[str, tuple[float, float]]
"""Least value and width of each signal over some recordings, by channel [SI]."""

_FLOWS = {"supply": ("supply", "line"), "chamber": ("line", "chamber"), "flow": ("line",)}
"""Blocks of a rig file whose share of error is one of the flow into a block, in addition to the
valve's.
"""
_FACTORS = ("muscle", "transmission", "joint")
"""Blocks whose share of error multiplies the muscles' pull."""
_SUMMANDS = ("arm", "link", "load")
"""Blocks whose share of error is added to that of the muscles' pull."""
_IMPERFECT = ("supply", "valve", "chamber", "muscle", "transmission")
"""Blocks that have a usual error: what makes flows, and what makes forces."""
_GAUGES = ("muscle_pressure", "joint_angle")
"""Channels whose gauges have one."""
_GAUGE_SHARE = 0.1
"""That of a gauge's range over that of a block: gauges are linear to a tenth of a percent."""
_MOTION = with_trait("moves")


def curve_errors_of(rig: Rig, usual: float) -> CurveErrors:
    """Curve errors of a model: as the rig file states them, and usual ones of what that leaves out.

    Parameters
    ----------
    rig : Rig
        The model, with what its file states in ``[model_error]``.
    usual : float
        Share of what a block does to its output that is off where nothing is stated for it.

    Returns
    -------
    dict
        As :attr:`pamrs.Rig.model_error`.
    """
    stated = rig.model_error
    if not usual:
        return stated
    stated_blocks = {channel_of(name) for name in stated}
    shares = dict.fromkeys(_IMPERFECT, usual) | dict.fromkeys(_GAUGES, _GAUGE_SHARE * usual)
    return {n: {"share": s} for n, s in shares.items() if n not in stated_blocks} | stated


def operating_ranges(block: Block, recordings: list[Prepared]) -> OperatingRanges:
    """Least value and width of each signal at a block, over all recordings [SI]."""
    ranges = {}
    for name in (block.channel, *block.drives):
        signals = [v for p in recordings if (v := _signal(p, name)) is not None]
        if signals:
            low = min(float(v.min()) for v in signals)
            ranges[name] = low, max(max(float(v.max()) for v in signals) - low, 1e-12)
    return ranges


def curves(
    block: Block,
    core: _core.Rig,
    base: Residual,
    prepared: Prepared,
    ranges: OperatingRanges,
    curve_errors: CurveErrors,
    width: int,
) -> Array | None:
    """The curve error of a model as a Gaussian process (Kennedy & O'Hagan 2001) of a few curves,
    carried through the model.

    Its size is the standard deviation of a smooth curve: over a reading that of its
    gauge, over the motion that of a force, over the command that of a valve, over the pressure that
    of a flow. It is a sum of waves, each of them a column.

    Parameters
    ----------
    block : Block
        Which block.
    core : _core.Rig
        A model close to the data.
    base : Residual
        Its residual over the recording.
    prepared : Prepared
        The recording.
    ranges : dict
        As of `operating_ranges`: over these a curve runs, so that column k is one and the same
        curve in every recording.
    curve_errors : dict
        From :func:`curve_errors_of`.
    width : int
        Samples in a bin.

    Returns
    -------
    (m, k) array or None
        What each wave, one standard deviation high, does to the bin means, in the channel's unit;
        None where no error acts here.
    """
    # wave number [rad per range] and standard deviation of each wave of a curve of the size 1; the
    # mean square of a wave is half of its height's, that of a shift is all of it
    waves = [
        (math.pi * k, math.sqrt((2.0 if k else 1.0) / _CURVE_WAVES)) for k in range(_CURVE_WAVES)
    ]

    def over(name: str) -> list[Array]:
        low, wide = ranges[name]
        place = _signal(prepared, name)
        assert place is not None
        at = np.clip((place - low) / wide, 0.0, 1.0)
        return [size * np.cos(number * at) for number, size in waves]

    def means(values: Array) -> Array:
        return binned(values, base.rows, width)[0]

    columns: list[Array] = []
    reading_error = _size(curve_errors, block.channel, ranges)
    if reading_error > 0.0:
        columns += [means(base.freed(reading_error * curve)) for curve in over(block.channel)]
    for place, share in _flow_errors(block, ranges, curve_errors):
        shares = share * np.column_stack(over(place))
        # a flow is no state: what it is off by now is gone with the next sample
        measured = block.kind == "flow"
        moved = shares * base.prediction[:, None] if measured else _flowing(shares, base)
        columns += [means(base.freed(column)) for column in moved.T]
    for name, place, much in _drive_errors(block, prepared, ranges, curve_errors):
        columns += [
            means(_carried(name, much * curve, block, core, prepared, base))
            for curve in over(place)
        ]
    return np.column_stack(columns) if columns else None


def _signal(prepared: Prepared, name: str) -> Array | None:
    """A smoothed channel or a command; None where it is neither."""
    if name in prepared.signals:
        return prepared.signals[name][0]
    return prepared.commands.get(name)


def _size(curve_errors: CurveErrors, name: str, ranges: OperatingRanges) -> float:
    """Curve error of a reading [SI]; a share is one of the width of its range."""
    if name not in ranges:
        return 0.0
    error = curve_errors.get(name, curve_errors.get(channel_of(name), {}))
    return math.hypot(error.get("size", 0.0), error.get("share", 0.0) * ranges[name][1])


def _shares(curve_errors: CurveErrors, kinds: tuple[str, ...], name: str | None = None) -> float:
    """The shares of some kinds of block together; of named ones those called `name` alone."""
    named = [n for n in curve_errors if channel_of(n) in kinds]
    if name is not None:
        named = [n for n in named if block_of(n) in ("", name)]
    return math.hypot(*(curve_errors[n].get("share", 0.0) for n in named))


def _flow_errors(
    block: Block, ranges: OperatingRanges, curve_errors: CurveErrors
) -> list[tuple[str, float]]:
    """Signals over which errors of the flow into a block are curves, each with its share."""
    if block.kind not in _FLOWS or block.channel not in ranges:
        return []
    name = block_of(block.channel)
    command = next(
        (n for n in block.drives if channel_of(n) in DRIVEN_COMMANDS and n in ranges), None
    )
    errors = [
        (block.channel, _shares(curve_errors, _FLOWS[block.kind], name)),
        (command or block.channel, _shares(curve_errors, ("valve",), name)),
    ]
    return [(place, share) for place, share in errors if share > 0.0]


def _drive_errors(
    block: Block, prepared: Prepared, ranges: OperatingRanges, curve_errors: CurveErrors
) -> list[tuple[str, str, Array]]:
    """Errors of drives: the drive, the signal over which its error is a curve, and its size [SI];
    of the reading itself, and of the force that a pressure makes.
    """
    around = (block.channel, *block.drives)
    motion = next((n for n in around if channel_of(n) in _MOTION and n in ranges), None)
    drive_errors = []
    for name in block.drives:
        if name not in prepared.signals:
            continue
        value, (low, wide) = prepared.signals[name][0], ranges[name]
        errors = [(name, _size(curve_errors, name, ranges), np.ones_like(value))]
        if block.mechanical and channel_of(name) == "muscle_pressure":
            most = np.full_like(value, max(abs(low), abs(low + wide)))
            errors.append((motion or name, _shares(curve_errors, _FACTORS), value))
            errors.append((motion or name, _shares(curve_errors, _SUMMANDS), most))
        drive_errors += [(name, place, size * much) for place, size, much in errors if size > 0.0]
    return drive_errors


def _flowing(shares: Array, base: Residual) -> Array:
    """Change of an output by shares of all that changes it (a column each), which fades as the
    effect of a window's start does.
    """
    steps = np.append(np.diff(base.prediction), 0.0)[:, None] * shares
    moved = np.zeros_like(shares)
    for a, b, q in base.starts:
        used = np.flatnonzero(q[:, 0])
        if used.size == 0:
            continue
        # over rows that are not used it fades as next to them
        level = np.interp(np.arange(b - a), used, np.log(np.abs(q[used, 0])))
        remembered = np.minimum(np.exp(np.diff(level)), 1.0)
        for i in range(a, b - 1):
            moved[i + 1] = remembered[i - a] * moved[i] + steps[i]
    return moved


def _carried(
    name: str, more: Array, block: Block, core: _core.Rig, prepared: Prepared, base: Residual
) -> Array:
    """Change of a block's output by an error of a drive; zero where the model cannot follow."""
    value, slope = prepared.signals[name]
    shaken = prepared.with_signals({name: (value + more, slope + np.gradient(more, prepared.dt))})
    with contextlib.suppress(SimulationError):
        return change(block, core, shaken, base) - base.value
    return np.zeros_like(value)


def whitening(curves: Array) -> Callable[[Array], Array]:
    """Function that gives unit covariance to rows of unit noise and an error that consists of
    curves: it multiplies them by ``(1 + curves curves^T)^(-1/2)`` (Woodbury).

    Parameters
    ----------
    curves : (n, m) array
        One standard deviation of each curve, in units of the rows' noise.

    Returns
    -------
    callable
        Takes residuals (n,) or sensitivities (n, k).
    """
    power, turn = np.linalg.eigh(curves.T @ curves)
    telling = power > max(float(power.max(initial=0.0)), 1.0) * power.size * np.finfo(float).eps
    power, turn = power[telling], turn[:, telling]
    axes = curves @ (turn / np.sqrt(power))
    damped = axes * (1.0 - 1.0 / np.sqrt(1.0 + power))
    return lambda rows: np.asarray(rows - damped @ (axes.T @ rows), dtype=np.float64)
