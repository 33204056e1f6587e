"""Trajectories of joint angles: those of chapters 4 and 6, steps, and a user's table.

All angles are radians in and out (``numpy.deg2rad`` or :func:`pamrs.control.trajectories.degrees`
for the printed ones), rates and accelerations are the analytic derivatives of the angle. Where the
angle has a corner (a ramp that begins or ends, a triangle's tip, a step) the derivative does not
exist: **the rate there is that of what follows** (right-continuous, as a command is held), and
**the acceleration is that of the smooth pieces**, without the impulses between them. A controller
that needs the impulse does not exist; one that is fed a ramp's corner sees its rate jump.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from pamrs._arrays import Array, ArrayLike
from pamrs._checks import as_numbers, finite, matched, misshapen, positive, quantities, whole
from pamrs.control._protocol import Reference
from pamrs.control._values import times_of
from pamrs.errors import ParameterError

__all__ = [
    "JointTrajectories",
    "Trajectory",
    "check_reach",
    "cosine_cycles",
    "degrees",
    "from_samples",
    "lift_hold_return",
    "step",
]


#: No joint of a rig turns farther either way [rad].
MOST_ANGLE = 7.0


class Shape(Protocol):
    """An angle over time with two derivatives."""

    def at(self, time: float) -> tuple[float, float, float]:
        """Angle, rate, acceleration at one time."""

    def over(self, time: Array) -> tuple[Array, Array, Array]:
        """Angles, rates, accelerations at many times."""


@dataclass(frozen=True)
class Trajectory:
    """A reference over time, made by the functions of this module or from a shape of one's own.

    Calling it with a time [s] gives a :class:`pamrs.control.Reference` of floats, with an array of
    times one of arrays of that shape.

    Attributes
    ----------
    name : str
        What it is, for tables and legends.
    duration : float
        Length of the record [s]. Past it a trajectory goes on as its function says (it holds, or
        repeats).
    shape : object
        ``at(time)`` of a float and ``over(times)`` of an array, both [s]: each answers angle [rad],
        rate [rad/s] and acceleration [rad/s^2], of floats or of arrays of that shape.
    phases : mapping of str to (float, float)
        Named parts of the record: begin and end [s].
    """

    name: str
    duration: float
    shape: Shape = field(repr=False)
    phases: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __call__(self, time: float | Array) -> Reference:
        """The reference at a time or at many [s].

        Parameters
        ----------
        time : float or ndarray
            Finite [s].

        Returns
        -------
        Reference

        Raises
        ------
        ParameterError
            If a time is not finite.
        """
        if isinstance(time, np.ndarray):
            if not np.isfinite(time).all():
                raise ParameterError(
                    "time is not finite: every entry has to be a finite number of seconds"
                )
            return Reference(*self.shape.over(time))
        finite("time", time)
        return Reference(*self.shape.at(time))

    @quantities
    def sampled(self, sample_time: float, duration: float | None = None) -> tuple[Array, Reference]:
        """The times of a record and the reference at each.

        Parameters
        ----------
        sample_time : float
            Time between two samples [s], above zero.
        duration : float, optional
            How long [s]; the trajectory's own by default.

        Returns
        -------
        time : ndarray, shape (n,)
            ``k * sample_time`` from 0 to the last at or before the end [s].
        reference : Reference of ndarrays, shape (n,)

        Raises
        ------
        ParameterError
            If a time is not allowed.
        """
        sample_time = positive("sample_time", sample_time)
        length = self.duration if duration is None else positive("duration", duration, zero=True)
        time = np.asarray(
            np.arange(math.floor(length / sample_time + 1e-9) + 1) * sample_time, dtype=np.float64
        )
        return time, self(time)


@dataclass(frozen=True)
class JointTrajectories:
    """Trajectories of several joints, one for each.

    Attributes
    ----------
    of_joint : mapping of str to Trajectory
        Name of the joint -> its trajectory, base first.
    """

    of_joint: Mapping[str, Trajectory]

    @property
    def duration(self) -> float:
        """The longest of their records [s]."""
        return max(one.duration for one in self.of_joint.values())

    def __call__(self, time: float | Array) -> Reference:
        """The references at a time or at many [s].

        Parameters
        ----------
        time : float or ndarray, shape (k,)

        Returns
        -------
        Reference
            Of arrays of shape (joints,), or (joints, k).

        Raises
        ------
        ParameterError
            If a time is not finite.
        """
        each = [one(time) for one in self.of_joint.values()]
        return Reference(*(np.array(values) for values in zip(*each, strict=True)))


@dataclass(frozen=True)
class _Pieces:
    """Cubics one after the other; before the first and behind the last the angle rests."""

    starts: tuple[float, ...]
    # constant first, in the time since the piece's start; the last rests
    cubics: tuple[tuple[float, float, float, float], ...]

    def at(self, time: float) -> tuple[float, float, float]:
        k = bisect_right(self.starts, time) - 1
        if k < 0:
            return self.cubics[0][0], 0.0, 0.0
        a, b, c, d = self.cubics[k]
        s = time - self.starts[k]
        return a + s * (b + s * (c + s * d)), b + s * (2.0 * c + s * 3.0 * d), 2.0 * c + 6.0 * d * s

    def over(self, time: Array) -> tuple[Array, Array, Array]:
        starts, cubics = self._arrays
        found = np.searchsorted(starts, time, side="right") - 1
        k = np.maximum(found, 0)
        a, b, c, d = np.moveaxis(cubics[k], -1, 0)
        s = time - starts[k]
        inside = found >= 0
        angle = np.where(inside, a + s * (b + s * (c + s * d)), cubics[0, 0])
        return (
            angle,
            np.where(inside, b + s * (2.0 * c + s * 3.0 * d), 0.0),
            np.where(inside, 2.0 * c + 6.0 * d * s, 0.0),
        )

    @cached_property
    def _arrays(self) -> tuple[Array, Array]:
        return np.asarray(self.starts, dtype=np.float64), np.asarray(self.cubics, dtype=np.float64)


@dataclass(frozen=True)
class _Cycles:
    """Half cosines up and down with rests between, a number of times, then at rest below."""

    low: float
    high: float
    rise: float
    hold: float
    count: int

    def at(self, time: float) -> tuple[float, float, float]:
        one = 2.0 * (self.rise + self.hold)
        if not 0.0 <= time < self.count * one:
            return self.low, 0.0, 0.0
        s = time % one
        back = s >= self.rise + self.hold
        s -= (self.rise + self.hold) if back else 0.0
        start, swing = (
            (self.high, self.low - self.high) if back else (self.low, self.high - self.low)
        )
        if s >= self.rise:
            return start + swing, 0.0, 0.0
        w = math.pi / self.rise
        c, n = math.cos(w * s), math.sin(w * s)
        return start + 0.5 * swing * (1.0 - c), 0.5 * swing * w * n, 0.5 * swing * w * w * c

    def over(self, time: Array) -> tuple[Array, Array, Array]:
        rows = np.array([self.at(float(t)) for t in time.ravel()], dtype=np.float64).reshape(-1, 3)
        angle, rate, acceleration = (rows[:, k].reshape(time.shape) for k in range(3))
        return angle, rate, acceleration


def degrees(*values: float) -> tuple[float, ...]:
    """Angles in degrees as radians, for the printed numbers.

    Parameters
    ----------
    *values : float
        [deg]

    Returns
    -------
    tuple of float
        [rad]

    Examples
    --------
    >>> lift_hold_return(*degrees(15, 60)).duration
    25.0
    """
    return tuple(math.radians(value) for value in values)


def check_reach(
    trajectory: Trajectory | JointTrajectories,
    duration: float,
    lengths: tuple[float, float] | None = None,
) -> None:
    """Refuse a reference that nothing can follow: degrees given for radians, or an angle for a
    length, most of the time.

    Parameters
    ----------
    trajectory : Trajectory or JointTrajectories
    duration : float
        How much of it is looked at [s].
    lengths : (float, float), optional
        Shortest and longest length [m] of a mass that hangs, where that is what follows. A
        reference beyond them is allowed, and drives the mass to its stop; one that is further off
        than they are from each other is none.

    Raises
    ------
    ParameterError
        If an angle is beyond 7 rad either way, or a length outside its range by more than that
        range.
    """
    if isinstance(trajectory, JointTrajectories):
        for one in trajectory.of_joint.values():
            check_reach(one, duration)
        return
    wanted = np.asarray(trajectory(np.linspace(0.0, duration, 257)).angle, dtype=np.float64)
    if lengths is not None:
        low, high = lengths
        worst = float(wanted[np.argmax(np.maximum(low - wanted, wanted - high))])
        stroke = high - low
        if not low - stroke <= worst <= high + stroke:
            raise ParameterError(
                f"the trajectory goes to {worst:.4g} m, and the lengths that the hanging mass can "
                f"have go from load.min_length = {low:.4g} m to load.max_length = {high:.4g} m: "
                "its reference is the length of the muscle [m], no angle"
            )
        return
    largest = float(np.max(np.abs(wanted)))
    if largest > MOST_ANGLE:
        raise ParameterError(
            f"the trajectory goes to {largest:.4g} rad, and {MOST_ANGLE:g} rad either way is "
            "allowed: if these are degrees, pamrs.control.trajectories.degrees converts them"
        )


@quantities
def lift_hold_return(
    low: float,
    high: float,
    *,
    ramp: float = 5.0,
    hold: float = 5.0,
    duration: float = 25.0,
    delay: float = 0.0,
) -> Trajectory:
    """Ramp up, hold, ramp back, rest: the trajectory of 4.4 and 4.5, and one of 5.5.

    Parameters
    ----------
    low, high : float
        Angle at rest and of the hold [rad].
    ramp, hold : float
        Length of each ramp and of the hold [s]; both above zero.
    duration : float
        Length of the record [s]; what is left after the return is rest.
    delay : float
        Rest before the lift [s].

    Returns
    -------
    Trajectory
        With the phases ``lift``, ``hold``, ``return`` and, where the record is longer, ``rest``. At
        a corner the rate is that of what follows; the acceleration is zero throughout.

    Raises
    ------
    ParameterError
        If a number is not finite, or a time is outside its range.
    """
    low, high = finite("low", low), finite("high", high)
    ramp, hold = positive("ramp", ramp), positive("hold", hold)
    delay = positive("delay", delay, zero=True)
    ends = [delay, delay + ramp, delay + ramp + hold, delay + 2.0 * ramp + hold]
    length = positive("duration", duration)
    if length < ends[-1]:
        raise ParameterError(
            f"duration = {duration} s is not allowed: the return ends at {ends[-1]:g} s"
        )
    slope = (high - low) / ramp
    pieces = _Pieces(
        tuple(ends),
        (
            (low, slope, 0.0, 0.0),
            (high, 0.0, 0.0, 0.0),
            (high, -slope, 0.0, 0.0),
            (low, 0.0, 0.0, 0.0),
        ),
    )
    phases = {"lift": (ends[0], ends[1]), "hold": (ends[1], ends[2]), "return": (ends[2], ends[3])}
    if length > ends[-1]:
        phases["rest"] = (ends[3], length)
    return Trajectory("lift-hold-return", length, pieces, phases)


@quantities
def step(before: float, after: float, *, at: float = 0.0, duration: float = 5.0) -> Trajectory:
    """A step; its rate and acceleration are zero throughout, the impulse of the jump left out.

    Parameters
    ----------
    before, after : float
        Angle before and from the step on [rad].
    at : float
        Time of the step [s].
    duration : float
        Length of the record [s].

    Returns
    -------
    Trajectory

    Raises
    ------
    ParameterError
        If a number is not finite, or a time is outside its range.
    """
    before, after = finite("before", before), finite("after", after)
    at = positive("at", at, zero=True)
    length = positive("duration", duration)
    if at > length:
        raise ParameterError(f"at = {at} s is not allowed: the record ends at {length:g} s")
    rest, moved = (before, 0.0, 0.0, 0.0), (after, 0.0, 0.0, 0.0)
    # a piece of its own before the step, so that "before" is what holds until then
    pieces = _Pieces((-1.0, at), (rest, moved))
    return Trajectory("step", length, pieces, {"step": (at, length)})


@quantities
def cosine_cycles(
    low: float, high: float, *, rise: float = 6.0, hold: float = 5.0, cycles: int = 8
) -> Trajectory:
    """Half-cosine lifts and returns with holds between: the cycles of 6.4.2; at rest below before
    and behind them.

    Parameters
    ----------
    low, high : float
        [rad]; 15 and 50 or 90 deg in the dissertation.
    rise, hold : float
        Length of each half cosine and of each rest [s].
    cycles : int
        How many, at least one.

    Returns
    -------
    Trajectory
        The rate is continuous; the acceleration jumps where a rest begins or ends, and there is
        that of what follows.

    Raises
    ------
    ParameterError
        If a number is not finite or outside its range.
    """
    low, high = finite("low", low), finite("high", high)
    rise, hold = positive("rise", rise), positive("hold", hold, zero=True)
    shape = _Cycles(low, high, rise, hold, whole("cycles", cycles, 1))
    return Trajectory("cosine cycles", 2.0 * (rise + hold) * shape.count, shape)


def from_samples(
    time: ArrayLike, angle: ArrayLike, *, smoothing: float | None = 0.0, name: str = "table"
) -> Trajectory:
    """A trajectory through a table of times and angles, by a natural cubic spline; outside the
    table it rests at the ends.

    Parameters
    ----------
    time : array_like, shape (n,)
        Rising times [s], n >= 5; the trajectory's time counts from the first.
    angle : array_like, shape (n,)
        [rad]
    smoothing : float or None
        Weight [s^3] of the integral of the squared acceleration [rad^2/s^3] against the sum of
        squared deviations [rad^2] (``scipy.interpolate.make_smoothing_spline``): 0 goes through
        every point; None chooses by generalised cross-validation, for a table with noise.
    name : str
        For tables and legends.

    Returns
    -------
    Trajectory
        Rate and acceleration are those of the spline.

    Raises
    ------
    ParameterError
        If the table is too short, not finite, not rising, or the weight is negative.
    """
    t, y = times_of(time, 5), as_numbers("angle", angle)
    if t.shape != y.shape:
        raise misshapen("angle", y.shape, t.size, "that of time")
    matched(angle=y)
    weight = None if smoothing is None else positive("smoothing", smoothing, zero=True)
    from scipy.interpolate import CubicSpline, PPoly, make_smoothing_spline

    t = t - t[0]
    spline = (
        CubicSpline(t, y, bc_type="natural")
        if weight == 0.0
        else PPoly.from_spline(make_smoothing_spline(t, y, lam=weight).tck)
    )
    inside = np.flatnonzero(np.diff(spline.x) > 0.0)
    cubics = [(float(c[3]), float(c[2]), float(c[1]), float(c[0])) for c in spline.c[:, inside].T]
    end = float(spline(t[-1]))
    starts = (*(float(x) for x in spline.x[inside]), float(t[-1]))
    return Trajectory(name, float(t[-1]), _Pieces(starts, (*cubics, (end, 0.0, 0.0, 0.0))))
