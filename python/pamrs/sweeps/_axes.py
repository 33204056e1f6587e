"""What varies from run to run: a grid over values, or a table of samples; and how its runs are cut
into chunks.
"""

from __future__ import annotations

import hashlib
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamrs._checks import as_column, check_column
from pamrs.channels import unit_of
from pamrs.effects import EFFECTS
from pamrs.errors import ParameterError, meant
from pamrs.rig import Rig

Array = NDArray[np.float64]
#: How the name of an initial value begins: ``initial.joint_angle``.
INITIAL: Final = "initial."


class Quantity(NamedTuple):
    """A number that a sweep can vary.

    Attributes
    ----------
    name : str
        Of a parameter of the rig or of one of its effects, or an initial value.
    unit : str
        SI.
    lower, upper : float
        Bounds of the possible.
    value : float
        In the rig; NaN for an initial value.
    tol : float
        One standard deviation of what is known of it; 0 where the rig says nothing.
    """

    name: str
    unit: str
    lower: float
    upper: float
    value: float
    tol: float


def quantity(rig: Rig, name: str) -> Quantity:
    """What a rig says of a number that is varied.

    Parameters
    ----------
    rig : Rig
        The model.
    name : str
        ``arm.payload``, ``leak_muscle.conductance``, ``initial.joint_angle``.

    Returns
    -------
    Quantity

    Raises
    ------
    ParameterError
        If the rig has no such number; the message lists those that it has.
    """
    if name.startswith(INITIAL):
        return Quantity(name, unit_of(name.removeprefix(INITIAL)), -np.inf, np.inf, np.nan, 0.0)
    of_effects = _effect_quantities(rig)
    if name in of_effects:
        return of_effects[name]
    known = rig.parameters
    if name not in known:
        raise ParameterError(
            f"{name!r} is no parameter of the rig {rig.name!r}, and no initial value such as "
            f"'initial.joint_angle'; {meant(name, [*known, *of_effects])}"
        )
    found = known[name]
    tol = found.tol if math.isfinite(found.tol) else 0.0
    return Quantity(name, found.unit, found.lower, found.upper, found.value, tol)


def _effect_quantities(rig: Rig) -> dict[str, Quantity]:
    found = {}
    for entry in rig.effects:
        full = ".".join(filter(None, (entry["id"], entry.get("at", ""))))
        for known in EFFECTS[entry["id"]].form(entry.get("form", "")).parameters:
            name = f"{full}.{known.name}"
            value = float(entry["parameters"][known.name])
            found[name] = Quantity(name, known.unit, known.lower, known.upper, value, 0.0)
    return found


class Blocks(NamedTuple):
    """Runs cut into chunks; each is one block of every stored array, and its runs are consecutive.

    Attributes
    ----------
    shape : tuple of int
        Of all runs.
    block : tuple of int
        Of one chunk; the last along a dimension may be shorter.
    """

    shape: tuple[int, ...]
    block: tuple[int, ...]

    @classmethod
    def cut(cls, shape: tuple[int, ...], chunk: int) -> Blocks:
        """Chunks of at most ``chunk`` runs: whole trailing dimensions, and an even part of the one
        before.
        """
        block, inner = [1] * len(shape), 1
        for axis in range(len(shape) - 1, -1, -1):
            parts = math.ceil(shape[axis] / max(1, chunk // inner))
            block[axis] = math.ceil(shape[axis] / parts)
            inner *= block[axis]
            if parts > 1:
                break
        return cls(shape, tuple(block))

    @property
    def counts(self) -> tuple[int, ...]:
        """Chunks along each dimension."""
        return tuple(math.ceil(n / b) for n, b in zip(self.shape, self.block, strict=True))

    def __len__(self) -> int:
        return math.prod(self.counts)

    def region(self, chunk: int) -> tuple[slice, ...]:
        """Where the runs of a chunk stand in the arrays."""
        places = np.unravel_index(chunk, self.counts)
        return tuple(
            slice(int(k) * b, min((int(k) + 1) * b, n))
            for k, b, n in zip(places, self.block, self.shape, strict=True)
        )

    def runs(self, chunk: int) -> tuple[int, int]:
        """The first run of a chunk, and the one after its last; runs are counted in C order."""
        region = self.region(chunk)
        start = int(np.ravel_multi_index([part.start for part in region], self.shape))
        return start, start + math.prod(part.stop - part.start for part in region)


class Axes(ABC):
    """What varies from run to run: made by :class:`Grid` or :class:`Samples`."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """What varies."""

    @property
    @abstractmethod
    def shape(self) -> tuple[int, ...]:
        """Of the result."""

    @property
    @abstractmethod
    def dims(self) -> tuple[str, ...]:
        """Names of the dimensions of the result."""

    @abstractmethod
    def rows(self, start: int, stop: int) -> dict[str, Array]:
        """Values of the runs from ``start`` to before ``stop``, each of shape (stop - start,)."""

    @abstractmethod
    def describe(self) -> dict[str, str]:
        """What makes these runs these: name -> digest or words."""

    @abstractmethod
    def check(self, known: Callable[[str], Quantity]) -> None:
        """Refuse names that nobody knows, and values outside their bounds.

        Parameters
        ----------
        known : callable
            What is known of a name, or a ParameterError.

        Raises
        ------
        ParameterError
            Naming parameter, value and what is allowed.
        """

    def __len__(self) -> int:
        return math.prod(self.shape)


def _columns(given: Any, what: str) -> dict[str, Array]:
    if not isinstance(given, Mapping) or not given:
        found = "is empty" if isinstance(given, Mapping) else f"is a {type(given).__name__}"
        raise ParameterError(
            f"{what} {found}; a mapping of names to values is needed, "
            "{'arm.payload': [5.0, 9.0]}, or pamrs.sweeps.Samples"
        )
    return {str(name): as_column(str(name), values) for name, values in given.items()}


class _Listed(Axes):
    """Axes whose values are all given."""

    _values: dict[str, Array]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._values)

    def check(self, known: Callable[[str], Quantity]) -> None:
        for name, column in self._values.items():
            own = known(name)
            check_column(name, column, own.lower, own.upper, own.unit)


def digest(values: Array) -> str:
    """What tells numbers from others, for a plan."""
    return hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()


@dataclass(frozen=True, eq=False)
class Grid(_Listed):
    """Every combination of the values of each axis; the last one goes fastest.

    Parameters
    ----------
    axes : mapping of str to array_like, shape (k,)
        Name -> values in SI units.

    Raises
    ------
    ParameterError
        If it is empty, or values are not a row of numbers.
    """

    axes: Mapping[str, ArrayLike]
    _values: dict[str, Array] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        values = _columns(self.axes, "the grid")
        for name, column in values.items():
            if np.unique(column).size != column.size:
                raise ParameterError(f"the values of {name} are not allowed: one is given twice")
        object.__setattr__(self, "_values", values)

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(column.size for column in self._values.values())

    @property
    def dims(self) -> tuple[str, ...]:
        return self.names

    def column(self, name: str) -> Array:
        """The values of one axis, shape (k,)."""
        return self._values[name].copy()

    def rows(self, start: int, stop: int) -> dict[str, Array]:
        places = np.unravel_index(np.arange(start, stop), self.shape)
        return {
            name: column[at]
            for (name, column), at in zip(self._values.items(), places, strict=True)
        }

    def describe(self) -> dict[str, str]:
        order = {"order of the axes": ", ".join(self.names)}
        return order | {f"values of {k}": f"{v.size}, {digest(v)}" for k, v in self._values.items()}


@dataclass(frozen=True, eq=False)
class Samples(_Listed):
    """A table of runs: run k has entry k of every column.

    Parameters
    ----------
    columns : mapping of str to array_like, shape (n,)
        Name -> values in SI units, of one length.

    Raises
    ------
    ParameterError
        If it is empty, values are not a row of numbers, or the lengths differ.

    Examples
    --------
    >>> import pamrs
    >>> len(pamrs.sweeps.Samples({"arm.payload": [5.0, 9.0], "arm.viscous": [3.0, 2.0]}))
    2
    """

    columns: Mapping[str, ArrayLike]
    _values: dict[str, Array] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        values = _columns(self.columns, "the table of samples")
        sizes = {name: column.size for name, column in values.items()}
        if len(set(sizes.values())) > 1:
            raise ParameterError(
                "the columns of samples have different lengths: "
                + ", ".join(f"{name} has {size}" for name, size in sizes.items())
            )
        object.__setattr__(self, "_values", values)

    @property
    def shape(self) -> tuple[int, ...]:
        return (next(iter(self._values.values())).size,)

    @property
    def dims(self) -> tuple[str, ...]:
        return ("run",)

    def rows(self, start: int, stop: int) -> dict[str, Array]:
        return {name: column[start:stop] for name, column in self._values.items()}

    def describe(self) -> dict[str, str]:
        return {f"samples of {k}": f"{v.size}, {digest(v)}" for k, v in self._values.items()}


def chosen(names: Sequence[str] | str | None, default: Sequence[str]) -> list[str]:
    """Names as a list without repetitions; those of ``default`` where none are given."""
    given = default if names is None else [names] if isinstance(names, str) else names
    return list(dict.fromkeys(given))
