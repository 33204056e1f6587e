"""Force maps: forces measured over length and pressure, every row checked before a fit uses it.

A row that a fit must not use is flagged with its reason and counted, never dropped; a column that looks
like the wrong unit is an error that names the likely one.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamrs.errors import ParameterError, RecordingError

if TYPE_CHECKING:
    from pamrs.muscle import Muscle

__all__ = ["LEFT_OUT", "ForceMap"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Index = NDArray[np.intp]

#: Reason of the rows that :meth:`ForceMap.select` leaves out.
LEFT_OUT: Final = "left out"

# reason -> the words after "12 rows"
_WORDS: Final = {
    "not a number": "have no number for length, pressure or force",
    "clipped": "are clipped: the true force lies beyond the end of the scale",
    "negative pressure": "have a negative gauge pressure (vacuum)",
    "pressure out of range": "have a pressure beyond 5 MPa",
    "length out of range": "have a length that no muscle of this rest length reaches",
    "duplicate": "repeat an earlier row exactly",
    "sensor fault": "are masked by the check of the recording",
    "beyond the braid": "have a length outside the braid's limits",
    LEFT_OUT: "are at pressures that this fit leaves out",
}

_PRESSURE_LOW, _PRESSURE_HIGH = 2e3, 5e6  # a map whose largest pressure is outside is in another unit
_LENGTH_LOW, _LENGTH_HIGH = 0.3, 3.0  # of the rest length
_REST_LOW, _REST_HIGH = 1e-3, 10.0  # [m], as in a rig file
_FORCE_FACTOR = 3.0  # over what the gas alone could do
_LEVEL_RELATIVE, _LEVEL_ABSOLUTE = 0.02, 3e3
_PRESSURE_UNITS: Final = {"kPa": 1e3, "bar": 1e5, "psi": 6894.757, "MPa": 1e6, "mbar": 1e2}
_LENGTH_UNITS: Final = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "m, read as mm": 1e3, "m, read as cm": 1e2}
_FORCE_UNITS: Final = {"mN (or in N, read as kN)": 1e-3, "N, read as kgf or lbf": 0.15}


@dataclass(frozen=True, eq=False)
class ForceMap:
    """Forces of one muscle over length and gauge pressure; make it with :meth:`from_arrays` or
    :func:`pamrs.fit.load_force_map`.

    Attributes
    ----------
    length, pressure, force : (n,) array
        Length between the fittings [m], gauge pressure [Pa], pulling force [N] of every row, also of those not used.
    rest_length : float
        Length at zero contraction [m].
    direction : (n,) int8 array
        -1 while contracting, +1 while lengthening, 0 unknown.
    used : (n,) bool array
        Rows for a fit; their values are finite.
    reason : (n,) tuple of str
        Why a row is not used, ``""`` where it is.
    level : (n,) int array
        Index into ``levels``, -1 where the row is not used.
    levels : (m,) array
        Pressure levels [Pa], ascending: the median of their rows. Every level has at least one used row.
    name, source : str
        What to call the map, and where it came from.
    notes : tuple of str
        Findings that concern no single row.
    """

    length: Array
    pressure: Array
    force: Array
    rest_length: float
    direction: NDArray[np.int8]
    used: Mask
    reason: tuple[str, ...]
    level: Index
    levels: Array
    name: str = ""
    source: str = ""
    notes: tuple[str, ...] = ()

    # ------------------------------------------------------------------ making

    @classmethod
    def from_arrays(
        cls,
        length: ArrayLike,
        pressure: ArrayLike,
        force: ArrayLike,
        *,
        rest_length: float,
        direction: ArrayLike | None = None,
        clipped: float | None = None,
        level_tolerance: float | None = None,
        faulty: ArrayLike | None = None,
        check_duplicates: bool = True,
        name: str = "",
        source: str = "",
        notes: Sequence[str] = (),
    ) -> ForceMap:
        """A map from arrays in SI units.

        Parameters
        ----------
        length, pressure, force : (n,) array_like
            Length [m], gauge pressure [Pa], force [N]; NaN where there is no value.
        rest_length : float
            Length at zero contraction [m].
        direction : (n,) array_like, optional
            Negative while contracting, positive while lengthening, 0 or NaN where unknown.
        clipped : float, optional
            A force that means "off the scale" [N], 0.0 for readings that stop at zero; rows with exactly it are flagged.
        level_tolerance : float, optional
            Pressures within it are one level [Pa]; by default 2 % of the pressure, at least 3 kPa.
        faulty : (n,) array_like of bool, optional
            Rows that an earlier check of the recording has masked.
        check_duplicates : bool
            Flag rows that repeat an earlier one exactly; off for time series, where a resting bench repeats itself.
        name, source : str
            What to call the map, and where it came from.
        notes : sequence of str
            Findings to carry along.

        Returns
        -------
        ForceMap

        Raises
        ------
        RecordingError
            If the columns differ in length, a column looks like the wrong unit, or fewer than two rows are usable.
        ParameterError
            If ``rest_length`` or ``level_tolerance`` is not possible.
        """
        label = name or source or "force map"
        columns = {"length": _column(length), "pressure": _column(pressure), "force": _column(force)}
        sizes = [len(values) for values in columns.values()]
        if len(set(sizes)) != 1:
            raise RecordingError(f"{label}: length, pressure and force have {sizes} rows; the same number is needed")
        long, gas, pull = columns.values()
        rest = _rest_length(rest_length)
        if level_tolerance is not None and not (math.isfinite(level_tolerance) and level_tolerance > 0.0):
            raise ParameterError(f"level_tolerance = {level_tolerance!r} Pa is not allowed: a positive number is needed")
        n = len(long)
        reason = np.full(n, "", dtype=object)

        def flag(rows: Mask, why: str) -> None:
            reason[rows & (reason == "")] = why

        if faulty is not None:
            flag(np.asarray(faulty, dtype=bool), "sensor fault")
        finite = np.isfinite(long) & np.isfinite(gas) & np.isfinite(pull)
        flag(~finite, "not a number")
        _check_units(label, long[finite], gas[finite], rest)
        if clipped is not None:
            flag(finite & np.isclose(pull, clipped, rtol=1e-9, atol=1e-12), "clipped")
        flag(finite & (gas < 0.0), "negative pressure")
        flag(finite & (gas > _PRESSURE_HIGH), "pressure out of range")
        ratio = long / rest
        flag(finite & ((ratio < _LENGTH_LOW) | (ratio > _LENGTH_HIGH)), "length out of range")
        way = _directions(direction, n, label)
        if check_duplicates:
            flag(finite & _duplicates(long, gas, pull, way.astype(np.float64)), "duplicate")
        found = list(notes)
        zeros = int(np.sum((reason == "") & (pull == 0.0) & (gas > 0.0)))
        if clipped is None and zeros >= 3:
            hint = "if the reading stops at zero, say so: clipped = 0 (--clipped '0 N')"
            found.insert(0, f"{zeros} rows have a force of exactly 0 N under pressure and are used; {hint}")
        map_ = cls(long, gas, pull, rest, way, reason == "", tuple(reason), np.full(n, -1), np.empty(0), name, source, tuple(found))
        map_._check_count()
        return map_._with_levels(level_tolerance)

    def _with_levels(self, tolerance: float | None) -> ForceMap:
        """The map with its pressure levels found from the used rows."""
        level, levels, note = _cluster(self.pressure[self.used], tolerance)
        index = np.full(len(self.length), -1)
        index[self.used] = level
        return replace(self, level=index, levels=levels, notes=(*self.notes, *note))

    def _without(self, rows: Mask, why: str) -> ForceMap:
        """The map with some used rows flagged; levels without a row left vanish."""
        drop = rows & self.used
        if not drop.any():
            return self
        used = self.used & ~drop
        reason = tuple(why if gone else old for gone, old in zip(drop.tolist(), self.reason, strict=True))
        kept = np.unique(self.level[used])
        level = np.where(used, np.searchsorted(kept, self.level), -1)
        map_ = replace(self, used=used, reason=reason, level=level, levels=self.levels[kept])
        map_._check_count()
        return map_

    def _check_count(self) -> None:
        count = int(self.used.sum())
        if count < 2:
            why = "; ".join(self._counts()) or f"{len(self.length)} rows in all"
            raise RecordingError(f"{self.label}: {count} usable rows, two at least are needed ({why})")

    # ----------------------------------------------------------------- reading

    def __len__(self) -> int:
        return len(self.length)

    def __repr__(self) -> str:
        return f"ForceMap({self.label!r}, {int(self.used.sum())} of {len(self)} rows used, {len(self.levels)} pressure levels)"

    @property
    def label(self) -> str:
        """The name, or what stands for it."""
        return self.name or self.source or "force map"

    @property
    def contraction(self) -> Array:
        """Contraction ratio ``1 - length/rest_length`` of every row [1]; NaN where the length is."""
        return np.asarray(1.0 - self.length / self.rest_length)

    @property
    def issues(self) -> list[str]:
        """What was found, in words: how many rows are not used and why, then what concerns no single row."""
        return [*self._counts(), *self.notes]

    def _counts(self) -> list[str]:
        counts = Counter(why for why in self.reason if why)
        return [f"{n} {'rows' if n > 1 else 'row'} of {len(self)} {_WORDS.get(why, why)}: not used" for why, n in counts.items()]

    def used_rows(self) -> tuple[Array, Array, Array, Index, NDArray[np.int8]]:
        """Pressure [Pa], contraction [1], force [N], level and direction of the used rows, (k,) arrays."""
        rows = self.used
        return self.pressure[rows], self.contraction[rows], self.force[rows], self.level[rows], self.direction[rows]

    # --------------------------------------------------------------- narrowing

    def select(self, *, levels: Sequence[int]) -> ForceMap:
        """The map with only some pressure levels used.

        Parameters
        ----------
        levels : sequence of int
            Indices into :attr:`levels`; negative ones count from the end.

        Returns
        -------
        ForceMap
            With the same rows; those of other levels get the reason ``"left out"``. Its ``levels`` are the chosen ones.

        Raises
        ------
        ParameterError
            If an index is not there, or none is given.
        RecordingError
            If fewer than two rows are left.
        """
        count = len(self.levels)
        strange = [index for index in levels if not -count <= index < count]
        if strange or not len(levels):
            raise ParameterError(f"levels = {list(levels)} is not allowed: indices from 0 to {count - 1}, one at least")
        chosen = np.unique(np.asarray(levels, dtype=np.intp) % count)
        return self._without(~np.isin(self.level, chosen), LEFT_OUT)

    def level_indices(self, pressures: Sequence[float]) -> list[int]:
        """Indices of the levels nearest to some pressures.

        Parameters
        ----------
        pressures : sequence of float
            Gauge pressures [Pa].

        Returns
        -------
        list of int
            In ascending order, each once.

        Raises
        ------
        ParameterError
            If no level lies within 5 % (at least 5 kPa) of one of them.
        """
        found: set[int] = set()
        for pressure in pressures:
            nearest = int(np.argmin(np.abs(self.levels - pressure)))
            if not abs(self.levels[nearest] - pressure) <= max(0.05 * abs(pressure), 5e3):
                have = ", ".join(f"{level / 1e3:g}" for level in self.levels)
                raise ParameterError(f"levels: no measurement at {pressure / 1e3:g} kPa; there are levels at {have} kPa")
            found.add(nearest)
        return sorted(found)

    def checked_against(self, muscle: Muscle) -> ForceMap:
        """The map checked with a muscle's geometry.

        Parameters
        ----------
        muscle : Muscle
            Its braid limits the lengths, and its gas area tells which forces are believable.

        Returns
        -------
        ForceMap
            Rows outside the braid's limits are flagged ``"beyond the braid"``.

        Raises
        ------
        ParameterError
            If the muscle's rest length differs from the map's.
        RecordingError
            If the forces are beyond three times or below a hundredth of what the gas could do (a wrong unit), or fewer
            than two rows are left.
        """
        rest = float(muscle.parameters["rest_length"])
        if not math.isclose(rest, self.rest_length, rel_tol=1e-6):
            raise ParameterError(f"rest_length: the muscle has {rest:g} m, the force map {self.rest_length:g} m; the same is needed")
        low, high = muscle.contraction_limits
        e = self.contraction
        map_ = self._without(self.used & ~((e >= low) & (e <= high)), "beyond the braid")
        pressure, contraction, force, _, _ = map_.used_rows()
        able = float(np.max(pressure)) * float(np.max(np.abs(muscle.gas_area(contraction))))
        largest = float(np.max(np.abs(force)))
        if able > 0.0 and largest > _FORCE_FACTOR * able:
            likely = _likely(largest, able, _FORCE_UNITS)
            raise RecordingError(
                f"{self.label}: force up to {largest:.4g} N, but the gas could pull {able:.4g} N at most: wrong unit or wrong "
                f"muscle? The column is probably in {likely}"
            )
        if largest < 0.01 * able:
            raise RecordingError(
                f"{self.label}: force up to {largest:.4g} N only, where the gas could pull {able:.4g} N: wrong unit or wrong "
                "muscle? The column is probably in kN"
            )
        return map_


# ------------------------------------------------------------------------- checks


def _column(values: ArrayLike) -> Array:
    column = np.array(values, dtype=np.float64).ravel()
    column.setflags(write=False)
    return column


def _rest_length(value: float) -> float:
    rest = float(value)
    if not (math.isfinite(rest) and _REST_LOW <= rest <= _REST_HIGH):
        hint = "; in mm, probably" if 10.0 < rest < 1e4 else ""
        raise ParameterError(f"rest_length = {rest:g} m is not allowed: from {_REST_LOW:g} to {_REST_HIGH:g} m{hint}")
    return rest


def _likely(value: float, usual: float, units: Mapping[str, float]) -> str:
    """The unit whose factor brings ``value`` nearest to ``usual``."""

    def off(unit: str) -> float:
        return abs(math.log(value * units[unit] / usual))

    return min(units, key=off)


def _check_units(label: str, length: Array, pressure: Array, rest: float) -> None:
    """Refuse columns that as a whole are in another unit; single stray rows are flagged elsewhere."""
    if not len(pressure):
        return
    top, usual = float(np.max(pressure)), float(np.median(np.abs(pressure)))
    if 0.0 < top < _PRESSURE_LOW:
        likely = _likely(top, 5e5, _PRESSURE_UNITS)
        raise RecordingError(
            f"{label}: pressure up to {top:.4g} Pa only, at which no muscle pulls: wrong unit? The column is probably in {likely}"
        )
    if usual > _PRESSURE_HIGH:
        read_as = _likely(5e5, usual, _PRESSURE_UNITS)
        raise RecordingError(
            f"{label}: pressures around {usual:.4g} Pa, beyond 5 MPa: wrong unit? The column is probably in Pa, read as {read_as}"
        )
    ratio = float(np.median(np.abs(length))) / rest
    if not _LENGTH_LOW <= ratio <= _LENGTH_HIGH:
        likely = _likely(max(ratio, 1e-12), 1.0, _LENGTH_UNITS)
        raise RecordingError(
            f"{label}: lengths around {ratio * rest:.4g} m do not go with rest_length = {rest:g} m: wrong unit? "
            f"The column is probably in {likely}"
        )


def _directions(direction: ArrayLike | None, n: int, label: str) -> NDArray[np.int8]:
    if direction is None:
        return np.zeros(n, dtype=np.int8)
    given = np.asarray(direction, dtype=np.float64).ravel()
    if len(given) != n:
        raise RecordingError(f"{label}: direction has {len(given)} rows, length has {n}; the same is needed")
    return np.asarray(np.sign(np.nan_to_num(given, nan=0.0)), dtype=np.int8)


def _duplicates(*columns: Array) -> Mask:
    """Rows that repeat an earlier row in every column."""
    rows = np.column_stack(columns)
    _, first = np.unique(rows, axis=0, return_index=True)
    repeated = np.ones(len(rows), dtype=bool)
    repeated[first] = False
    return repeated


def _cluster(pressure: Array, tolerance: float | None) -> tuple[Index, Array, list[str]]:
    """Level of each row, the levels' medians, and a note if pressures without gaps had to be cut.

    A gap wider than the tolerance parts two levels. A level wider than three tolerances, as from a
    pressure that ramps, is cut into bands one tolerance wide.
    """

    def width(at: float) -> float:
        return tolerance if tolerance is not None else max(_LEVEL_ABSOLUTE, _LEVEL_RELATIVE * abs(at))

    order = np.argsort(pressure, kind="stable")
    ranked = pressure[order].tolist()
    starts = [0, *(i for i in range(1, len(ranked)) if ranked[i] - ranked[i - 1] > width(ranked[i - 1]))]
    edges: list[int] = []
    note: list[str] = []
    for start, stop in zip(starts, [*starts[1:], len(ranked)], strict=True):
        edges.append(start)
        if ranked[stop - 1] - ranked[start] > 3.0 * width(ranked[start]):
            for i in range(start, stop):
                if ranked[i] - ranked[edges[-1]] > width(ranked[edges[-1]]):
                    edges.append(i)
            note.append(
                f"pressures from {ranked[start] / 1e3:.4g} to {ranked[stop - 1] / 1e3:.4g} kPa have no gaps: "
                f"cut into {len([e for e in edges if e >= start])} levels"
            )
    rank = np.zeros(len(ranked), dtype=np.intp)
    rank[edges[1:]] = 1
    level = np.empty(len(ranked), dtype=np.intp)
    level[order] = np.cumsum(rank)
    levels = np.array([np.median(pressure[level == k]) for k in range(len(edges))])
    return level, levels, note
