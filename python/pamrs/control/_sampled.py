"""Base of all controllers here: an explicit state, a clock that is watched, checked channels.

**Time.** A controller is discrete: its filters and integrals are made for its period, and every
update counts as one period. A sample that comes between half and one and a half periods after the
last one (:attr:`SampledController.jitter`) is such an update; one that is earlier, at the same time
or before, or later, is refused: a loop that lost samples must hold the last measurement and call at
every period, or ``reset()``. So the answer depends on the samples alone, not on the scatter of a
clock.
"""

from __future__ import annotations

import math
import numbers
import operator
from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

import numpy as np

from pamrs._checks import refused
from pamrs.control._protocol import Controller, Measurement, Reference, Value
from pamrs.control._values import as_value, positive_number
from pamrs.errors import ParameterError


class Stateful:
    """Base of parts with a state that can be read, restored and forgotten.

    A subclass lists its own numbers in ``_STATE`` (name -> start value; the attribute has an
    underscore before the name) and the attributes that are stateful themselves in ``_PARTS``.
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
            If it is not one; the message says what is missing, too much or not finite. Nothing is
            changed then.
        """
        self._check_state(state)
        for name in self._STATE:
            setattr(self, f"_{name}", _copied(state[name]))
        for part in self._PARTS:
            getattr(self, part).restore(state[part])

    def _row_shape(self, name: str, start: Any) -> tuple[int, ...]:
        """Shape of a number of the state, of one plant."""
        return np.shape(start)[-1:] if isinstance(start, list) else ()

    def _leaves(self) -> dict[str, bool]:
        """Dotted attributes that hold the state, and True for each that is changed in place."""
        found = {f"_{name}": isinstance(start, list) for name, start in self._start().items()}
        for part in self._PARTS:
            one = getattr(self, part)
            # another's controller has its state and restore only
            found |= {
                f"{part}.{name}": changed
                for name, changed in (
                    one._leaves() if isinstance(one, Stateful) else {"state": False}
                ).items()
            }
        return found

    def _check_state(
        self, state: Mapping[str, Any], where: str = "state", batch: int | None = -1
    ) -> None:
        """Refuse what is no state for a batch of a size, None being one plant and -1 any."""
        expected = {*self._STATE, *self._PARTS}
        if not isinstance(state, Mapping):
            raise ParameterError(
                f"{where} is a {type(state).__name__}; a mapping of {', '.join(sorted(expected))} "
                "is needed"
            )
        missing, extra = sorted(expected - set(state)), sorted(map(str, set(state) - expected))
        if missing or extra:
            raise ParameterError(
                f"{where} is not of a {type(self).__name__}: missing {missing}, too much {extra}"
            )
        for name, start in self._start().items():
            if state[name] is None and start is None:
                continue
            try:
                array = np.asarray(state[name])
            except ValueError:  # rows of different lengths
                array = np.empty(0, dtype=np.object_)
            if array.dtype.kind not in "iuf":
                raise refused(f"{where}.{name}", state[name], "numbers are needed")
            if not np.all(np.isfinite(array)):
                raise ParameterError(f"{where}.{name} is not finite")
            shape = self._row_shape(name, start)
            rows = array.shape[: array.ndim - len(shape)]
            if array.shape[len(rows) :] != shape or (
                rows != () and (len(rows) > 1 or batch not in (-1, rows[0]))
            ):
                plants = "" if batch in (-1, None) else f" of {batch}"
                raise ParameterError(
                    f"{where}.{name} has shape {array.shape}; {shape} is needed, or that for each "
                    f"of a batch{plants}"
                )
        for part in self._PARTS:
            one = getattr(self, part)
            if isinstance(one, Stateful):
                one._check_state(state[part], f"{where}.{part}", batch)


class Fixed:
    """Read-only attribute of a controller: other attributes are computed from it once.

    Parameters
    ----------
    where : str, optional
        Attribute that holds it; by default its own name with an underscore before it.
    """

    def __init__(self, where: str | None = None) -> None:
        self._where = where

    def __set_name__(self, owner: type, name: str) -> None:
        self._name, self._get = name, operator.attrgetter(self._where or f"_{name}")

    def __get__(self, one: Any, owner: type | None = None) -> Any:
        return self if one is None else self._get(one)

    def __set__(self, one: Any, value: Any) -> None:
        raise AttributeError(
            f"{self._name} of a {type(one).__name__} cannot be set: make a new one with it"
        )


class Restorer:
    """Numbers of a part that are put back when a later part refuses the sample, so that the whole
    refuses it.

    Parameters
    ----------
    part : Stateful or Controller
        The one that answers first.
    """

    def __init__(self, part: Any) -> None:
        leaves = part._leaves() if isinstance(part, Stateful) else {"state": False}
        self._part, self._names = part, tuple(leaves)
        # one look at all of them costs less than a microsecond, which state does not
        self._get = operator.attrgetter(*self._names)
        self._in_place = tuple(k for k, changed in enumerate(leaves.values()) if changed)

    def take(self) -> Any:
        """Copy of the present numbers."""
        found: Any = self._get(self._part)
        if self._in_place:
            found = list(found)
            for k in self._in_place:
                found[k] = found[k].copy()
        return found

    def put_back(self, taken: Any) -> None:
        """Put numbers of :meth:`take` back."""
        for name, value in zip(
            self._names, taken if len(self._names) > 1 else (taken,), strict=True
        ):
            where, _, last = name.rpartition(".")
            owner = operator.attrgetter(where)(self._part) if where else self._part
            if last == "state":
                owner.restore(value)
            else:
                setattr(owner, last, value)


class SampledController(Stateful, Controller):
    """Base of the controllers.

    Parameters
    ----------
    period : float
        Time between two updates [s].
    gains : iterable of float or ndarray, optional
        Everything that may be an array, to know the size of the batch.
    parts : iterable of Controller, optional
        Controllers that this one is made of; their batch is its own.

    Attributes
    ----------
    jitter : float
        How far a sample may be off its time, in periods; see the module.
    """

    jitter: ClassVar[float] = 0.5

    def __init__(
        self, period: float, gains: Iterable[Any] = (), parts: Iterable[Controller] = ()
    ) -> None:
        self.period = positive_number("period", period)
        sizes = {value.size for value in gains if isinstance(value, np.ndarray)}
        sizes |= {
            part._gain_batch
            for part in parts
            if isinstance(part, SampledController) and part._gain_batch is not None
        }
        if len(sizes) > 1:
            raise ParameterError(
                f"gains have the lengths {sorted(sizes)}: arrays of one length, or numbers, are "
                "needed"
            )
        self._gain_batch: int | None = sizes.pop() if sizes else None
        self._early = (1.0 - self.jitter) * self.period
        self._late = (1.0 + self.jitter) * self.period
        self._last: float | None = None
        self._batch = self._gain_batch
        # what a sample says of the batch's size holds only when the sample is found good
        self._size = self._batch

    def reset(self) -> None:
        """Forget what was seen: begin at rest, at any time, for whatever batch comes next."""
        self._last = None
        self._batch = self._size = self._gain_batch
        super().reset()

    @property
    def state(self) -> dict[str, Any]:
        """The numbers that everything to come depends on (copies); give them back to
        :meth:`restore`.
        """
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
            If it is not one; the message says what is missing, too much or not finite. Nothing is
            changed then.
        """
        super().restore(state)
        self._last = None if state["time"] is None else float(state["time"])
        self._batch = self._size = None if state["batch"] is None else int(state["batch"])

    def _leaves(self) -> dict[str, bool]:
        return {"_last": False, "_batch": False, "_size": False, **super()._leaves()}

    def _check_state(
        self, state: Mapping[str, Any], where: str = "state", batch: int | None = -1
    ) -> None:
        if not isinstance(state, Mapping) or "time" not in state or "batch" not in state:
            raise ParameterError(
                f"{where} is not of a {type(self).__name__}: time and batch are needed in it"
            )
        time, own = state["time"], state["batch"]
        if time is not None and not (_is(time, numbers.Real) and math.isfinite(time)):
            raise refused(f"{where}.time", time, "a finite number or None is needed")
        if own is not None and not (_is(own, numbers.Integral) and own >= 1):
            raise refused(f"{where}.batch", own, "a whole number from 1 on or None is needed")
        if self._gain_batch is not None and own != self._gain_batch:
            raise refused(
                f"{where}.batch", own, f"the gains are those of a batch of {self._gain_batch}"
            )
        super()._check_state(
            {name: value for name, value in state.items() if name not in ("time", "batch")},
            where,
            own,
        )
        parts = [
            state[part].get("batch")
            for part in self._PARTS
            if isinstance(getattr(self, part), SampledController)
        ]
        if len(sizes := {size for size in (own, *parts) if size is not None}) > 1:
            raise ParameterError(
                f"{where} has parts for batches of {sorted(sizes)}: one size is needed"
            )

    # ------------------------------------------------------------------ for update()

    def _tick(self, time: float) -> None:
        """Take note of a sample's time; called when everything else of it was found good."""
        last = self._last
        if last is None:
            if not math.isfinite(time):
                raise self._refusal(f"time = {time} s is not allowed: finite is needed")
        elif not self._early < time - last < self._late:
            raise self._refusal(
                f"time = {time:.9g} s comes {time - last:.4g} s after the last sample: from "
                f"{self._early:.4g} to {self._late:.4g} s is allowed (period = {self.period:g} s); "
                "after lost samples hold the last measurement, or reset()"
            )
        self._last = time
        self._batch = self._size

    def _refusal(self, text: str) -> ParameterError:
        """The error of a sample, which says nothing about the batch either."""
        self._size = self._batch
        return ParameterError(text)

    def _read(self, measurement: Measurement, channel: str) -> Value:
        """A channel, checked."""
        try:
            value = measurement[channel]
        except KeyError:
            raise self._refusal(
                f"measurement has no channel {channel!r}, which {type(self).__name__} needs; it "
                f"has: {', '.join(map(str, measurement))}"
            ) from None
        if value.__class__ is float and value - value == 0.0:
            # in a batch everything is one: the answer has its length from the first sample on
            return value if self._size is None else np.full(self._size, value)
        return self._sized(channel, value)

    def _aim(self, reference: Reference) -> Reference:
        """The reference, checked."""
        try:
            angle, rate, acceleration = reference
        except (TypeError, ValueError):
            raise self._refusal(
                f"reference = {reference!r} is not allowed: a Reference of angle [rad], rate and "
                "acceleration is needed"
            ) from None
        if angle.__class__ is float and rate.__class__ is float and acceleration.__class__ is float:
            total = angle + rate + acceleration
            if total - total == 0.0:
                if reference.__class__ is Reference:
                    return reference
                return Reference(angle, rate, acceleration)
        return Reference(
            *(
                self._sized(f"reference.{name}", value)
                for name, value in zip(Reference._fields, reference, strict=True)
            )
        )

    def _sized(self, name: str, value: Any) -> Value:
        """Checked float or array of the batch's length, for a value that is no finite float yet."""
        try:
            checked = as_value(name, value)
        except ParameterError as error:
            raise self._refusal(str(error)) from None
        if isinstance(checked, np.ndarray):
            if self._size is None:
                self._size = checked.size
            elif checked.size != self._size:
                raise self._refusal(f"{name} has {checked.size} values for a batch of {self._size}")
        return checked


def _copied(value: Any) -> Any:
    return value.copy() if isinstance(value, (np.ndarray, list)) else value


def _is(value: Any, kind: type) -> bool:
    """True where a value is an instance of a kind of number, truth values left out."""
    return isinstance(value, kind) and not isinstance(value, bool)
