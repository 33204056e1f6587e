"""Sensors between plant and controller, seeded: noise, resolution and delay."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pamrs._checks import check_kind, check_names, checked_table, positive, whole
from pamrs.control._protocol import Measurement, Value
from pamrs.errors import ParameterError


@dataclass(frozen=True)
class Sensors:
    """Imperfect sensors between a plant and its controller.

    A channel is first delayed, then gets noise, then is rounded. In a batch every plant gets the
    same noise (common random numbers), so that gains are compared on the same day; one run with a
    seed is the same run alone or in a batch.

    Parameters
    ----------
    noise : mapping of str to float
        Channel -> standard deviation of independent normal noise at each of the controller's
        samples [SI unit of the channel].
    resolution : mapping of str to float
        Channel -> step of the quantiser [SI unit]; the value is the nearest multiple.
    delay : float
        How old every channel is [s], a multiple of the controller's period; before anything is old
        enough the first sample is held.
    seed : int
        Of the noise.

    Raises
    ------
    ParameterError
        If a number is negative or not finite, or a resolution is zero.

    Examples
    --------
    >>> Sensors(noise={"joint_angle": 1e-3}, resolution={"muscle_pressure": 1e3}, delay=0.004).delay
    0.004
    """

    noise: Mapping[str, float] = field(default_factory=dict)
    resolution: Mapping[str, float] = field(default_factory=dict)
    delay: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for label, zero in (("noise", True), ("resolution", False)):
            table = checked_table(label, getattr(self, label))
            for channel, value in table.items():
                positive(f"{label} of {channel}", value, zero=zero)
        positive("delay", self.delay, zero=True)
        whole("seed", self.seed)

    def started(self, period: float) -> Reader:
        """Sensors at the beginning of a run.

        Parameters
        ----------
        period : float
            Time between two samples of the controller [s].

        Returns
        -------
        Reader

        Raises
        ------
        ParameterError
            If the delay is not a multiple of the period.
        """
        count = round(self.delay / period)
        if abs(count * period - self.delay) > 1e-6 * period:
            raise ParameterError(
                f"delay = {self.delay} s is not allowed: a multiple of the controller's period = "
                f"{period} s is needed"
            )
        return Reader(self, count, float(period))


class Reader:
    """Sensors in use: called with each sample of the plant, it says what is read.

    Made by :meth:`Sensors.started`. Given to a loop instead of sensors it goes on from loop to
    loop, and its :attr:`state` can be kept, so that a loop with noise or a delay can be cut
    anywhere.

    Attributes
    ----------
    period : float
        Time between two samples [s].
    """

    def __init__(self, sensors: Sensors, samples: int, period: float) -> None:
        self._sensors, self.period = sensors, period
        self._late: deque[Measurement] = deque(maxlen=samples + 1)
        self._random = np.random.default_rng(sensors.seed)

    @property
    def state(self) -> dict[str, Any]:
        """State of the readings to come (copies): ``late``, the delayed samples, and ``random``,
        the generator.
        """
        return {
            "late": [dict(sample) for sample in self._late],
            "random": self._random.bit_generator.state,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a state, bit for bit.

        Parameters
        ----------
        state : mapping
            :attr:`state` of a reader of sensors with the same delay.

        Raises
        ------
        ParameterError
            If it is not one. Nothing is changed then.
        """
        random = np.random.default_rng()
        try:
            late = [dict(sample) for sample in state["late"]]
            random.bit_generator.state = state["random"]
        except (KeyError, TypeError, ValueError) as error:
            raise ParameterError(
                f"state is not one of a reader ({error}): late and random are needed"
            ) from None
        if len(late) > (self._late.maxlen or 0):
            raise ParameterError(
                f"state.late has {len(late)} samples; at most {self._late.maxlen} are needed for "
                "this delay"
            )
        self._random, self._late = random, deque(late, maxlen=self._late.maxlen)

    def __call__(self, sample: Measurement) -> dict[str, Value]:
        """Read a sample.

        Parameters
        ----------
        sample : mapping of str to float or ndarray, shape (n,)
            True channels.

        Returns
        -------
        dict of str to float or ndarray, shape (n,)

        Raises
        ------
        ParameterError
            If a channel with noise or a resolution is not there.
        """
        self._late.append(sample)
        read: dict[str, Value] = dict(self._late[0])
        for channel, size in self._sensors.noise.items():
            read[channel] = _there(read, channel) + size * float(self._random.standard_normal())
        for channel, size in self._sensors.resolution.items():
            value = _there(read, channel)
            read[channel] = size * (
                np.round(value / size) if isinstance(value, np.ndarray) else round(value / size)
            )
        return read


def _there(sample: Measurement, channel: str) -> Value:
    if channel not in sample:
        check_names("sensors", [channel], sample, "channel of the plant")
    return sample[channel]


def reader_of(sensors: Sensors | Reader | None, period: float) -> Reader | None:
    """Reader of a loop: newly started from sensors, or one that goes on.

    Parameters
    ----------
    sensors : Sensors or Reader, optional
        What was given.
    period : float
        Of the controller [s].

    Returns
    -------
    Reader or None

    Raises
    ------
    ParameterError
        If a delay is not a multiple of the period, a reader is for another period, or it is
        neither.
    """
    if sensors is None or isinstance(sensors, Sensors):
        return None if sensors is None else sensors.started(period)
    check_kind("sensors", sensors, Reader, "Sensors, or a Reader that goes on,")
    if sensors.period != period:
        raise ParameterError(
            f"sensors are read every {sensors.period:g} s, the controller's period is {period:g} "
            "s: the same is needed"
        )
    return sensors
