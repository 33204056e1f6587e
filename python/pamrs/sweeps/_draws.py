"""Samples of parameters within what is known of them, by the sequences of ``scipy.stats.qmc``."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from pamrs._checks import one_of, refused, rising, whole
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.sweeps._axes import Axes, Quantity, chosen, quantity
from pamrs.units import with_unit

Array = NDArray[np.float64]
Sequences = Literal["sobol", "halton"]
#: A normal distribution ends here, in standard deviations.
_TAIL: Final = 3.0
_MOST_DRAWN: Final = 2**20
#: Of a Sobol sequence, which has two to this many points.
_BITS: Final = 32


@dataclass(frozen=True)
class Range:
    """How one parameter is distributed.

    Attributes
    ----------
    name : str
    unit : str
        SI.
    lower, upper : float
        Where the distribution ends.
    mean, std : float or None
        Of the normal distribution that is cut there; None for a uniform one.
    """

    name: str
    unit: str
    lower: float
    upper: float
    mean: float | None = None
    std: float | None = None

    def values(self, cube: Array) -> Array:
        """Numbers of [0, 1) as values of the parameter, in the same order of size."""
        if self.mean is None or self.std is None:
            return np.asarray(self.lower + cube * (self.upper - self.lower))
        from scipy.special import ndtr, ndtri

        low, high = ((end - self.mean) / self.std for end in (self.lower, self.upper))
        share = ndtr(low) + cube * (ndtr(high) - ndtr(low))
        return np.asarray(np.clip(self.mean + self.std * ndtri(share), self.lower, self.upper))

    def words(self) -> str:
        """The distribution in words, every digit of it."""
        if self.mean is None:
            return with_unit(f"uniform from {self.lower!r} to {self.upper!r}", self.unit)
        return (
            with_unit(f"normal about {self.mean!r} with {self.std!r}", self.unit)
            + f", from {self.lower!r} to {self.upper!r}"
        )


def ranges(
    rig: Rig,
    parameters: Sequence[str] | None,
    within: Literal["tolerance"] | Mapping[str, tuple[float, float]],
) -> tuple[Range, ...]:
    """The distribution of each parameter; arguments and errors as of :func:`samples`."""
    bounds = within if isinstance(within, Mapping) else {}
    if not isinstance(within, Mapping) and within != "tolerance":
        raise refused(
            "within", within, "'tolerance', or a mapping such as {'arm.payload': (5.0, 9.0)}"
        )
    if parameters is None and not bounds:
        known = [name for name, p in rig.parameters.items() if 0.0 < p.tol < np.inf]
    else:
        known = list(bounds)
    names = chosen(parameters, known)
    if not names:
        raise ParameterError(
            f"parameters is empty: no parameter of the rig {rig.name!r} has a tolerance; give "
            "within = {'arm.payload': (5.0, 9.0)}"
        )
    strange = [name for name in bounds if name not in names]
    if strange:
        raise ParameterError(
            f"within has {strange[0]!r}, which is not one of parameters: {', '.join(names)}"
        )
    return tuple(
        _between(quantity(rig, name), bounds[name])
        if name in bounds
        else _tolerated(quantity(rig, name))
        for name in names
    )


def _between(known: Quantity, bounds: Any) -> Range:
    ends = rising(f"within[{known.name!r}]", bounds, known.lower, known.upper, known.unit)
    return Range(known.name, known.unit, *ends)


def _tolerated(known: Quantity) -> Range:
    if not known.tol > 0.0:
        raise ParameterError(
            f"{known.name} has no tolerance in the rig; give its ends: "
            f"within = {{{known.name!r}: (lowest, highest)}}"
        )
    low = max(known.lower, known.value - _TAIL * known.tol)
    high = min(known.upper, known.value + _TAIL * known.tol)
    return Range(known.name, known.unit, low, high, known.value, known.tol)


@dataclass(frozen=True, eq=False)
class DrawnSamples(Axes):
    """Samples that are drawn chunk by chunk, so that any number of them takes no memory; made by
    :func:`samples`.

    Attributes
    ----------
    parameters : tuple of Range
        How each is distributed.
    n : int
        Number of runs.
    seed : int
    sequence : {"sobol", "halton"}
    """

    parameters: tuple[Range, ...]
    n: int
    seed: int
    sequence: Sequences = "sobol"
    _kept: list[Any] = field(default_factory=list, init=False, repr=False)
    _lock: Any = field(default_factory=threading.Lock, init=False, repr=False)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.parameters, self.n, self.seed, self.sequence)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(known.name for known in self.parameters)

    @property
    def shape(self) -> tuple[int, ...]:
        return (self.n,)

    @property
    def dims(self) -> tuple[str, ...]:
        return ("run",)

    def rows(self, start: int, stop: int) -> dict[str, Array]:
        """Values of the runs from ``start`` to before ``stop``; cheap where they follow those of
        the last call, else the sequence is passed over up to there.
        """
        with self._lock:
            at, engine = self._kept or (0, self._engine())
            if at > start:
                at, engine = 0, self._engine()
            while at < start:  # by pieces, so that Ctrl-C ends it
                piece = min(start - at, _MOST_DRAWN)
                engine.fast_forward(piece)
                at += piece
            # One first: of a number that is no power of two the engine would warn.
            parts = [1, stop - start - 1] if start == 0 else [stop - start]
            cube = np.concatenate([engine.random(part) for part in parts if part])
            self._kept[:] = stop, engine
        return {known.name: known.values(cube[:, k]) for k, known in enumerate(self.parameters)}

    def _engine(self) -> Any:
        from scipy.stats import qmc

        if self.sequence == "halton":
            return qmc.Halton(len(self.parameters), scramble=True, rng=self.seed)
        return qmc.Sobol(len(self.parameters), scramble=True, bits=_BITS, rng=self.seed)

    def describe(self) -> dict[str, str]:
        drawn = {"samples": f"{self.n} of the sequence {self.sequence}, seed {self.seed}"}
        order = {"order of the parameters": ", ".join(self.names)}
        return drawn | order | {f"samples of {p.name}": p.words() for p in self.parameters}

    def check(self, known: Callable[[str], Quantity]) -> None:
        for drawn in self.parameters:
            found = known(drawn.name)
            if not found.lower <= drawn.lower <= drawn.upper <= found.upper:
                raise ParameterError(
                    f"samples of {drawn.name} from {drawn.lower:g} to {drawn.upper:g} are not "
                    "allowed: " + with_unit(f"from {found.lower:g} to {found.upper:g}", found.unit)
                )


def samples(
    rig: Rig,
    parameters: Sequence[str] | None = None,
    n: int = 1024,
    seed: int = 0,
    *,
    within: Literal["tolerance"] | Mapping[str, tuple[float, float]] = "tolerance",
    sequence: Sequences = "sobol",
) -> DrawnSamples:
    """Samples of parameters within what is known of them, by a low-discrepancy sequence.

    Parameters
    ----------
    rig : Rig
        The model, with its tolerances.
    parameters : sequence of str, optional
        Which ones: ``arm.payload``, ``leak_muscle.conductance``, ``initial.joint_angle``. By
        default all that have a tolerance, or those of ``within``.
    n : int
        Number of runs; of a Sobol sequence best a power of two.
    seed : int
        Of the scrambling; the same seed gives the same samples.
    within : "tolerance" or mapping of str to (float, float)
        Normal with the rig's tolerance as standard deviation, cut at three of them and at the
        bounds of the possible; or uniform between two values [SI] for the parameters named, by
        tolerance for the others.
    sequence : {"sobol", "halton"}
        Of ``scipy.stats.qmc``, scrambled.

    Returns
    -------
    DrawnSamples
        For :func:`sweep`.

    Raises
    ------
    ParameterError
        If a parameter is unknown or has no tolerance, or an argument is outside its range.

    Examples
    --------
    >>> import pamrs
    >>> drawn = pamrs.sweeps.samples(pamrs.rigs.shoulder(), ["arm.payload", "arm.viscous"], 64)
    >>> len(drawn), drawn.names
    (64, ('arm.payload', 'arm.viscous'))
    """
    whole("n", n, 1, 2**_BITS)
    whole("seed", seed)
    one_of("sequence", sequence, ("sobol", "halton"))
    return DrawnSamples(ranges(rig, parameters, within), int(n), int(seed), sequence)
