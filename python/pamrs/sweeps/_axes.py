"""Axes of a sweep: a grid over values, or a table of samples; and the chunks into which its runs
are cut.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from pamrs._arrays import Array, ArrayLike
from pamrs._checks import as_column, as_numbers, check_column, refused
from pamrs.channels import unit_of
from pamrs.effects import EFFECTS
from pamrs.errors import ParameterError, meant
from pamrs.rig import Rig

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
    """

    name: str
    unit: str
    lower: float
    upper: float


def quantity(rig: Rig, name: str) -> Quantity:
    """Unit and bounds of a number of a rig that is varied.

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
        return Quantity(name, unit_of(name.removeprefix(INITIAL)), -np.inf, np.inf)
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
    return Quantity(name, found.unit, found.lower, found.upper)


def _effect_quantities(rig: Rig) -> dict[str, Quantity]:
    found = {}
    for entry in rig.effects:
        full = ".".join(filter(None, (entry["id"], entry.get("at", ""))))
        for known in EFFECTS[entry["id"]].form(entry.get("form", "")).parameters:
            name = f"{full}.{known.name}"
            found[name] = Quantity(name, known.unit, known.lower, known.upper)
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
        """Cut runs into chunks: whole trailing dimensions, and an even part of the one before."""
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
        """Slices of the arrays that hold the runs of a chunk."""
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


@dataclass(frozen=True, eq=False)
class Axes:
    """Values of the numbers that vary from run to run: every combination of a grid, the last axis
    going fastest, or a table of samples, run k in row k.

    Attributes
    ----------
    values : dict of str to ndarray, shape (k,)
        Name -> values in SI units; of one length in a table.
    grid : bool
        Whether it is a grid.
    """

    values: dict[str, Array]
    grid: bool

    @classmethod
    def of(cls, over: Any, samples: ArrayLike | None = None) -> Axes:
        """Axes from a user's grid or samples; arguments and errors as of :func:`pamrs.sweep`."""
        if samples is not None:
            return cls(_table(over, samples), grid=False)
        if not isinstance(over, Mapping) or not over:
            found = "is empty" if isinstance(over, Mapping) else f"is a {type(over).__name__}"
            raise ParameterError(
                f"the grid {found}; a mapping of names to values is needed, "
                "{'arm.payload': [5.0, 9.0]}, or names with samples="
            )
        values = {str(name): as_column(str(name), column) for name, column in over.items()}
        for name, column in values.items():
            if np.unique(column).size != column.size:
                raise ParameterError(f"the values of {name} are not allowed: one is given twice")
        return cls(values, grid=True)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers that vary."""
        return tuple(self.values)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the result."""
        sizes = tuple(column.size for column in self.values.values())
        return sizes if self.grid else sizes[:1]

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the dimensions of the result."""
        return self.names if self.grid else ("run",)

    def __len__(self) -> int:
        return math.prod(self.shape)

    def rows(self, start: int, stop: int) -> dict[str, Array]:
        """Values of the runs from ``start`` to before ``stop``, each of shape (stop - start,)."""
        if not self.grid:
            return {name: column[start:stop] for name, column in self.values.items()}
        places = np.unravel_index(np.arange(start, stop), self.shape)
        return {
            name: column[at] for (name, column), at in zip(self.values.items(), places, strict=True)
        }

    def describe(self) -> dict[str, str]:
        """Entries of the plan that identify the axes: name -> digest or words."""
        kind = "values" if self.grid else "samples"
        order = {"order of the axes": ", ".join(self.names)} if self.grid else {}
        return order | {f"{kind} of {k}": f"{v.size}, {digest(v)}" for k, v in self.values.items()}

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
        for name, column in self.values.items():
            own = known(name)
            check_column(name, column, own.lower, own.upper, own.unit)


def _table(names: Any, samples: ArrayLike) -> dict[str, Array]:
    """Columns of samples by their names."""
    if isinstance(names, (str, Mapping)) or not isinstance(names, Sequence):
        raise refused("over", names, "with samples= it lists the names of their columns")
    numbers = as_numbers("samples", samples)
    if numbers.ndim != 2 or numbers.shape[1] != len(names) or not numbers.size:
        raise ParameterError(
            f"samples has the shape {numbers.shape}; (runs, {len(names)}) is needed, a column for "
            f"each of {', '.join(map(str, names))}"
        )
    if len(set(names)) < len(names):
        raise refused("over", names, "each name once")
    return {str(name): numbers[:, k].copy() for k, name in enumerate(names)}


def digest(values: Array) -> str:
    """SHA-256 of numbers, by which a plan compares them."""
    return hashlib.sha256(np.ascontiguousarray(values).data).hexdigest()
