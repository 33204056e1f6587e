"""What all controllers here have in common: an explicit state, a clock that is watched, and channels that are checked.

**Time.** A controller is discrete: its filters and integrals are made for its period, and every update counts as one period. A sample
that comes between half and one and a half periods after the last one (:attr:`SampledController.jitter`) is such an update; one that is
earlier, at the same time or before, or later, is refused: a loop that lost samples must hold the last measurement and call at every
period, or ``reset()``. So the answer depends on the samples alone, not on the scatter of a clock.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

import numpy as np

from pamrs.control.protocol import Controller, Measurement, Reference, Value
from pamrs.control.values import as_value
from pamrs.errors import ParameterError

__all__ = ["SampledController", "Stateful"]


class Stateful:
    """Something with a state that can be read, given back and forgotten.

    A subclass lists its own numbers in ``_STATE`` (name -> start value; the attribute has an underscore before the name) and the
    attributes that are stateful themselves in ``_PARTS``.
    """

    _STATE: ClassVar[Mapping[str, Any]] = {}
    _PARTS: ClassVar[tuple[str, ...]] = ()

    def _start(self) -> dict[str, Any]:
        """The state at the start; overridden where it depends on the arguments."""
        return dict(self._STATE)

    def reset(self) -> None:
        """Forget what was seen: begin at rest, for whatever batch comes next."""
        for name, value in self._start().items():
            setattr(self, f"_{name}", value)
        for part in self._PARTS:
            getattr(self, part).reset()

    @property
    def state(self) -> dict[str, Any]:
        """The numbers that everything to come depends on (copies)."""
        own = {name: _copied(getattr(self, f"_{name}")) for name in self._STATE}
        return {**own, **{part: getattr(self, part).state for part in self._PARTS}}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a state, bit for bit.

        Parameters
        ----------
        state : mapping
            :attr:`state` of one of the same kind.

        Raises
        ------
        ParameterError
            If it is not one; the message says what is missing, too much or not finite. Nothing is changed then.
        """
        self._check_state(state)
        for name in self._STATE:
            setattr(self, f"_{name}", _copied(state[name]))
        for part in self._PARTS:
            getattr(self, part).restore(state[part])

    def _check_state(self, state: Mapping[str, Any], where: str = "state") -> None:
        expected = {*self._STATE, *self._PARTS}
        if not isinstance(state, Mapping):
            raise ParameterError(f"{where} is a {type(state).__name__}; a mapping of {', '.join(sorted(expected))} is needed")
        missing, extra = sorted(expected - set(state)), sorted(map(str, set(state) - expected))
        if missing or extra:
            raise ParameterError(f"{where} is not of a {type(self).__name__}: missing {missing}, too much {extra}")
        for name, start in self._start().items():
            value = state[name]
            if value is None or isinstance(value, (bool, str)):
                continue
            try:
                array = np.asarray(value, dtype=np.float64)
            except (TypeError, ValueError):
                raise ParameterError(f"{where}.{name} = {value!r} is not allowed: numbers are needed") from None
            if not np.all(np.isfinite(array)):
                raise ParameterError(f"{where}.{name} is not finite")
            if isinstance(start, (list, np.ndarray)) and array.shape[-1:] != np.shape(start)[-1:]:
                raise ParameterError(
                    f"{where}.{name} has shape {array.shape}; {np.shape(start)} is needed, or that for each of a batch"
                )
        for part in self._PARTS:
            getattr(self, part)._check_state(state[part], f"{where}.{part}")


class SampledController(Stateful, Controller):
    """Base of the controllers.

    Parameters
    ----------
    period : float
        Time between two updates [s].
    gains : iterable of float or ndarray, optional
        Everything that may be an array, to know the size of the batch.

    Attributes
    ----------
    jitter : float
        How far a sample may be off its time, in periods; see the module.
    """

    jitter: ClassVar[float] = 0.5

    def __init__(self, period: float, gains: Iterable[Any] = ()) -> None:
        self.period = _period(period)
        sizes = {value.size for value in gains if isinstance(value, np.ndarray)}
        if len(sizes) > 1:
            raise ParameterError(f"gains have the lengths {sorted(sizes)}: arrays of one length, or numbers, are needed")
        self._gain_batch: int | None = sizes.pop() if sizes else None
        self._early = (1.0 - self.jitter) * self.period
        self._late = (1.0 + self.jitter) * self.period
        self._last: float | None = None
        self._batch = self._gain_batch

    def reset(self) -> None:
        """Forget what was seen: begin at rest, at any time, for whatever batch comes next."""
        self._last = None
        self._batch = self._gain_batch
        super().reset()

    @property
    def state(self) -> dict[str, Any]:
        """The numbers that everything to come depends on (copies); give them back to :meth:`restore`."""
        return {"time": self._last, "batch": self._batch, **Stateful.state.__get__(self)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a state, bit for bit.

        Parameters
        ----------
        state : mapping
            :attr:`state` of a controller of the same kind.

        Raises
        ------
        ParameterError
            If it is not one; the message says what is missing, too much or not finite. Nothing is changed then.
        """
        super().restore(state)
        self._last = None if state["time"] is None else float(state["time"])
        self._batch = None if state["batch"] is None else int(state["batch"])

    def _check_state(self, state: Mapping[str, Any], where: str = "state") -> None:
        if not isinstance(state, Mapping) or "time" not in state or "batch" not in state:
            raise ParameterError(f"{where} is not of a {type(self).__name__}: time and batch are needed in it")
        for name in ("time", "batch"):
            value = state[name]
            if value is not None and not (isinstance(value, (int, float)) and math.isfinite(value)):
                raise ParameterError(f"{where}.{name} = {value!r} is not allowed: a finite number or None is needed")
        super()._check_state({name: value for name, value in state.items() if name not in ("time", "batch")}, where)

    # ------------------------------------------------------------------ for update()

    def _tick(self, time: float) -> None:
        """Take note of a sample's time; called when everything else of it was found good."""
        last = self._last
        if last is None:
            if not math.isfinite(time):
                raise ParameterError(f"time = {time} s is not allowed: finite is needed")
        elif not self._early < time - last < self._late:
            raise ParameterError(
                f"time = {time:.9g} s comes {time - last:.4g} s after the last sample: from {self._early:.4g} to {self._late:.4g} s is "
                f"allowed (period = {self.period:g} s); after lost samples hold the last measurement, or reset()"
            )
        self._last = time

    def _read(self, measurement: Measurement, channel: str) -> Value:
        """A channel, checked."""
        try:
            value = measurement[channel]
        except KeyError:
            raise ParameterError(
                f"measurement has no channel {channel!r}, which {type(self).__name__} needs; it has: {', '.join(map(str, measurement))}"
            ) from None
        if value.__class__ is float and value - value == 0.0:
            # in a batch everything is one: the answer has its length from the first sample on
            return value if self._batch is None else np.full(self._batch, value)
        return self._sized(channel, value)

    def _aim(self, reference: Reference) -> Reference:
        """The reference, checked."""
        angle, rate, acceleration = reference
        if angle.__class__ is float and rate.__class__ is float and acceleration.__class__ is float:
            total = angle + rate + acceleration
            if total - total == 0.0:
                return reference if reference.__class__ is Reference else Reference(angle, rate, acceleration)
        return Reference(*(self._sized(f"reference.{name}", value) for name, value in zip(Reference._fields, reference, strict=True)))

    def _sized(self, name: str, value: Any) -> Value:
        """What is not a finite float already: an array of the batch's length, or something to refuse."""
        checked = as_value(name, value)
        if isinstance(checked, np.ndarray):
            if self._batch is None:
                self._batch = checked.size
            elif checked.size != self._batch:
                raise ParameterError(f"{name} has {checked.size} values for a batch of {self._batch}")
        return checked


def _copied(value: Any) -> Any:
    return value.copy() if isinstance(value, (np.ndarray, list)) else value


def _period(value: Any) -> float:
    checked = as_value("period", value, lower=0.0, above=True)
    if isinstance(checked, np.ndarray):
        raise ParameterError("period is an array: one number for the whole batch is needed")
    return checked
