"""One controller with a gain for each of many plants, closed around all of them at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pamrs._arrays import Array, ArrayLike, Mask
from pamrs.control._groups import lengths_of
from pamrs.control._loop import Actuation, actuation_of, measured_by, tracked_of
from pamrs.control._protocol import Controller, check_controller
from pamrs.control._sensors import Reader, Sensors, reader_of
from pamrs.control._values import angle_factor
from pamrs.control.metrics import slope_sine
from pamrs.control.trajectories import Trajectory, check_reach
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.simulation import Batch, BatchRun, default_step, whole_samples


@dataclass(frozen=True)
class Sweep:
    """Result of n closed loops; NaN where a plant ended before its time.

    Attributes
    ----------
    squared_error, curvature : ndarray, shape (n,)
        nu (4.15) and omega (4.17), summed at the controller's samples while the loops ran.
    rms, largest, final : ndarray, shape (n,)
        Errors [rad].
    failed : ndarray of bool, shape (n,)
        Which plants left the range of the model, or were given an impossible command.
    run : BatchRun
        What was recorded.
    trajectory : Trajectory
    unit : str
        Of the angle in nu and omega.
    """

    squared_error: Array
    curvature: Array
    rms: Array
    largest: Array
    final: Array
    failed: Mask
    run: BatchRun = field(repr=False)
    trajectory: Trajectory
    unit: str


class _Sums:
    """Running nu, omega and largest error of every plant, so that no samples are kept."""

    def __init__(self, n: int, factor: float) -> None:
        self._factor = factor
        self.squares, self.variation, self.largest = np.zeros(n), np.zeros(n), np.zeros(n)
        self._last: tuple[float, Array, Array] | None = None
        self.error = np.zeros(n)

    def add(self, time: float, wanted: float, angle: Array, rate: Array) -> None:
        """Add a sample: trapezoids of the squared error, total variation of the slope's sine."""
        self.error = wanted - angle
        square, slope = self.error * self.error, slope_sine(self._factor * rate)
        if self._last is not None:
            before, last_square, last_slope = self._last
            self.squares += 0.5 * (time - before) * (square + last_square)
            self.variation += np.abs(slope - last_slope)
        np.maximum(self.largest, np.abs(self.error), out=self.largest)
        self._last = time, square, slope


def _widest(rigs: Sequence[Rig]) -> tuple[float, float] | None:
    """Shortest and longest length that the mass of any of some rigs can have [m]; None where none
    hangs.
    """
    found = [lengths for lengths in map(lengths_of, rigs) if lengths is not None]
    return (min(low for low, _ in found), max(high for _, high in found)) if found else None


def sweep(
    plants: Rig | Sequence[Rig],
    controller: Controller,
    trajectory: Trajectory,
    duration: float | None = None,
    *,
    n: int | None = None,
    sample_time: float | None = None,
    step: float | None = None,
    initial: Mapping[str, ArrayLike] | None = None,
    sensors: Sensors | Reader | None = None,
    actuation: Actuation | None = None,
    measured: Mapping[str, str] | None = None,
    channels: Sequence[str] = (),
    record_every: int = 1,
    unit: str = "rad",
    threads: int | None = None,
) -> Sweep:
    """Close one controller around many plants at once, each with a gain of its own or with another
    payload.

    Parameters
    ----------
    plants : Rig or sequence of Rig
        One for all, or one for each: the same blocks, other parameters.
    controller : Controller
        Its gains are numbers or arrays of shape (n,); it sees arrays and answers one.
    trajectory, duration, sample_time, step, sensors, actuation, measured
        As for :func:`pamrs.control.closed_loop`.
    n : int, optional
        Number of plants where one rig is given for all.
    initial : mapping of str to float or array_like, shape (n,), optional
        As for :class:`pamrs.Batch`.
    channels : sequence of str
        What to record of every plant; nothing by default, as a gain map needs nothing.
    record_every : int
        Samples between two recorded rows.
    unit : {"rad", "deg"}
        Of the angle in nu and omega.
    threads : int, optional
        As for :class:`pamrs.Batch`; the result does not depend on it.

    Returns
    -------
    Sweep

    Raises
    ------
    ParameterError
        If times, lengths or names do not fit together.
    """
    factor = angle_factor(unit)
    check_controller(controller)
    period = controller.period
    dt = default_step(period) if sample_time is None else sample_time
    batch = Batch(plants, n=n, sample_time=dt, step=step, initial=initial, threads=threads)
    every = whole_samples("controller.period", period, dt, least=1)
    total = whole_samples(
        "duration", trajectory.duration if duration is None else duration, dt, least=1
    )
    act = actuation_of(batch.rigs[0], controller) if actuation is None else actuation
    read = reader_of(sensors, period)
    controller.reset()
    joints = getattr(controller, "joints", ("",))
    if len(joints) > 1:
        raise ParameterError(
            f"controller turns the joints {', '.join(joints)}: a sweep follows one joint"
        )
    alias = measured_by(controller, measured)
    angle, rate = tracked_of(batch.rigs[0], alias)
    by_length = angle == "length"
    if by_length and unit != "rad":
        raise ParameterError(
            f"unit = {unit!r} is not allowed where a length is followed: nu and omega are those of "
            "metres, and unit is left out"
        )
    check_reach(trajectory, total * dt, _widest(batch.rigs) if by_length else None)
    sums = _Sums(len(batch), factor)
    k = 0

    def answer(sample: dict[str, Any]) -> Any:
        nonlocal k
        now = k * dt
        wanted = trajectory(now)
        sums.add(now, float(wanted.angle), sample[angle], sample[rate])
        sample |= {called: sample[name] for called, name in alias.items()}
        k += every
        return act(controller.update(now, sample if read is None else read(sample), wanted))

    # a channel is always recorded: with none asked for, the first and the last row of the angle
    names, stride = (tuple(channels), record_every) if channels else ((angle,), total)
    run = batch.control(answer, total * dt, period=every * dt, channels=names, record_every=stride)
    last = batch.observe()
    sums.add(total * dt, float(trajectory(total * dt).angle), last[angle], last[rate])
    failed = run.failed
    found = [
        np.where(failed, np.nan, values)
        for values in (
            factor**2 * sums.squares,
            sums.variation,
            np.sqrt(sums.squares / (total * dt)),
            sums.largest,
            sums.error,
        )
    ]
    return Sweep(found[0], found[1], found[2], found[3], found[4], failed, run, trajectory, unit)
