"""Force maps: forces measured over length and pressure, every row checked before a fit uses it.

A row that a fit must not use is flagged with its reason and counted, never dropped.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pamrs._arrays import Array, ArrayLike, Index, Mask
from pamrs._checks import positive, quantities, refused
from pamrs.errors import ParameterError, RecordingError
from pamrs.fit._checks import (
    FORCE_HIGH,
    PRESSURE_HIGH,
    absolute_pressures,
    check_forces,
    check_rest_length,
    check_units,
    reachable,
)
from pamrs.fit._ways import table_ways
from pamrs.rig import Muscle

#: Reason of the rows that :meth:`ForceMap.select` leaves out.
LEFT_OUT: Final = "left out"

# reason -> the words after "1 row" and after "12 rows"
_WORDS: Final = {
    "not a number": ("has", "have", "no number for length, pressure or force"),
    "clipped": ("is", "are", "clipped: the true force lies beyond the end of the scale"),
    "negative pressure": ("has", "have", "a negative gauge pressure (vacuum)"),
    "pressure out of range": ("has", "have", "a pressure beyond 5 MPa"),
    "length out of range": ("has", "have", "a length that no muscle of this rest length reaches"),
    "duplicate": ("repeats", "repeat", "an earlier row exactly"),
    "sensor fault": ("is", "are", "masked by the check of the recording"),
    "beyond the braid": ("has", "have", "a length outside the braid's limits"),
    "no solution": ("has", "have", "a length at which this geometry has no solution"),
    "force out of range": ("has", "have", "a force beyond three times what the gas could do"),
    LEFT_OUT: ("is", "are", "at pressures that this fit leaves out"),
}
_SHOWN: Final = 5  # rows that an issue names
_MOST: Final = 0.9  # of the rows are what a map is judged by: a stray row is flagged alone

_REST_LOW, _REST_HIGH = 1e-3, 10.0  # [m], as in a rig file
_LEVEL_RELATIVE, _LEVEL_ABSOLUTE = 0.02, 3e3


@dataclass(frozen=True, eq=False)
class ForceMap:
    """Forces of one muscle over length and gauge pressure; make it with :meth:`from_arrays` or
    :func:`pamrs.fit.load_force_map`.

    Attributes
    ----------
    length, pressure, force : (n,) array
        Length between the fittings [m], gauge pressure [Pa], pulling force [N] of every row, also
        of those not used.
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
        Pressure levels [Pa], ascending: the median of their rows. Every level has at least one used
        row.
    name, source : str
        What to call the map, and where it came from.
    notes : tuple of str
        Findings that concern no single row.
    row_numbers : (n,) int array or None
        Row of the file that each row comes from, the header being row 1; None for arrays.
    units : mapping of str to str
        Unit that the file gives length, pressure and force in; empty for arrays.
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
    row_numbers: Index | None = None
    units: Mapping[str, str] = field(default_factory=dict)

    # ------------------------------------------------------------------ making

    @classmethod
    @quantities
    def from_arrays(
        cls,
        *,
        pressure: ArrayLike,
        length: ArrayLike,
        force: ArrayLike,
        rest_length: float,
        direction: ArrayLike | None = None,
        clipped: float | None = None,
        level_tolerance: float | None = None,
        faulty: ArrayLike | None = None,
        check_duplicates: bool = True,
        name: str = "",
        source: str = "",
        notes: Sequence[str] = (),
        row_numbers: Sequence[int] | None = None,
        units: Mapping[str, str] | None = None,
    ) -> ForceMap:
        """A map from arrays in SI units.

        Parameters
        ----------
        pressure, length, force : (n,) array_like
            Gauge pressure [Pa], length [m], force [N]; NaN where there is no value.
        rest_length : float
            Length at zero contraction [m].
        direction : (n,) array_like, optional
            Negative while contracting, positive while lengthening, 0 or NaN where unknown.
        clipped : float, optional
            A force that means "off the scale" [N], 0.0 for readings that stop at zero; rows with
            exactly it are flagged.
        level_tolerance : float, optional
            Pressures within it are one level [Pa]; by default 2 % of the pressure, at least 3 kPa.
        faulty : (n,) array_like of bool, optional
            Rows that an earlier check of the recording has masked.
        check_duplicates : bool
            Flag rows that repeat an earlier one exactly; off for time series, where a resting bench
            repeats itself.
        name, source : str
            What to call the map, and where it came from.
        notes : sequence of str
            Findings to carry along.
        row_numbers : (n,) sequence of int, optional
            Row of the file that each row comes from; without it, issues give the index, from 0.
        units : mapping of str to str, optional
            Unit that the file gives length, pressure and force in, for messages about a wrong one.

        Returns
        -------
        ForceMap

        Raises
        ------
        RecordingError
            If the columns differ in length, a column looks like the wrong unit, or fewer than two
            rows are usable.
        ParameterError
            If ``rest_length`` or ``level_tolerance`` is not possible.
        """
        label = name or source or "force map"
        long, gas, pull = columns = [_column(values) for values in (length, pressure, force)]
        sizes = [len(values) for values in columns]
        if len(set(sizes)) != 1:
            raise RecordingError(
                f"{label}: length, pressure and force have {sizes} rows; the same number is needed"
            )
        rest = _rest_length(rest_length)
        if level_tolerance is not None:
            positive("level_tolerance", level_tolerance)
        given = dict(units or {})
        finite = np.isfinite(long) & np.isfinite(gas) & np.isfinite(pull)
        check_units(label, long[finite], gas[finite], rest, given)
        way = _directions(direction, len(long), label)
        reason = _reasons(long, gas, pull, rest, faulty=faulty, clipped=clipped)
        if check_duplicates:
            again = finite & _duplicates(long, gas, pull, way.astype(np.float64))
            reason[again & (reason == "")] = "duplicate"
        found = list(notes)
        zeros = int(np.sum((reason == "") & (pull == 0.0) & (gas > 0.0)))
        if clipped is None and zeros >= 3:
            hint = "if the reading stops at zero, say so: clipped = 0 (--clipped '0 N')"
            found.insert(
                0, f"{zeros} rows have a force of exactly 0 N under pressure and are used; {hint}"
            )
        map_ = cls(
            length=long,
            pressure=gas,
            force=pull,
            rest_length=rest,
            direction=way,
            used=reason == "",
            reason=tuple(reason),
            level=np.full(len(long), -1),
            levels=np.empty(0),
            name=name,
            source=source,
            notes=tuple(found),
            row_numbers=None if row_numbers is None else np.asarray(row_numbers, dtype=np.intp),
            units=given,
        )
        map_._check_count()
        map_ = map_._with_levels(level_tolerance)
        pressure, contraction, force, level, _ = map_.used_rows()
        unit = map_.units.get("pressure", "")
        remarks = absolute_pressures(pressure, contraction, force, level, unit)
        return replace(map_, notes=(*map_.notes, *remarks))

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
        pairs = zip(drop.tolist(), self.reason, strict=True)
        reason = tuple(why if gone else old for gone, old in pairs)
        kept = np.unique(self.level[used])
        level = np.where(used, np.searchsorted(kept, self.level), -1)
        map_ = replace(self, used=used, reason=reason, level=level, levels=self.levels[kept])
        map_._check_count()
        return map_

    def _check_count(self) -> None:
        count = int(self.used.sum())
        if count < 2:
            why = "; ".join(self._counts()) or f"{len(self.length)} rows in all"
            raise RecordingError(
                f"{self.label}: {count} usable {'row' if count == 1 else 'rows'}, two at least are "
                f"needed ({why})"
            )

    # ----------------------------------------------------------------- reading

    def __len__(self) -> int:
        return len(self.length)

    def __repr__(self) -> str:
        return (
            f"ForceMap({self.label!r}, {int(self.used.sum())} of {len(self)} rows used, "
            f"{len(self.levels)} pressure levels)"
        )

    @property
    def label(self) -> str:
        """The name, or what stands for it."""
        return self.name or self.source or "force map"

    @property
    def contraction(self) -> Array:
        """Contraction ratio ``1 - length/rest_length`` of every row [1]; NaN where the length
        is.
        """
        return np.asarray(1.0 - self.length / self.rest_length)

    @property
    def issues(self) -> list[str]:
        """Issues of the map in words: number of unused rows, why they are unused, and the first of
        them, then remarks on the map as a whole.
        """
        return [*self._counts(), *self.notes]

    def _counts(self) -> list[str]:
        rows: dict[str, list[int]] = {}
        for index, why in enumerate(self.reason):
            if why:
                rows.setdefault(why, []).append(index)
        return [
            f"{self._found(why, found)}: not used ({self._places(found)})"
            for why, found in rows.items()
        ]

    def _found(self, why: str, rows: Sequence[int]) -> str:
        one, several, rest = _WORDS.get(why, ("is", "are", why))
        if len(rows) == 1:
            return f"1 row of {len(self)} {one} {rest}"
        return f"{len(rows)} rows of {len(self)} {several} {rest}"

    def _places(self, rows: Sequence[int]) -> str:
        """The first of some rows, by their number in the file or else by their index."""
        one, several, numbers = "index", "indices", np.asarray(rows)
        if self.row_numbers is not None:
            one, several, numbers = "row", "rows", self.row_numbers[rows]
        shown = ", ".join(str(number) for number in numbers[:_SHOWN])
        more = f" and {len(rows) - _SHOWN} more" if len(rows) > _SHOWN else ""
        return f"{one if len(rows) == 1 else several} {shown}{more}"

    def labels(self) -> list[str]:
        """Label of each used row: its row in the file, or else its index."""
        used = np.flatnonzero(self.used)
        if self.row_numbers is None:
            return [f"index {index}" for index in used]
        return [f"row {self.row_numbers[index]}" for index in used]

    @property
    def has_loops(self) -> bool:
        """True where there are used rows of both directions."""
        way = self.direction[self.used]
        return bool(np.any(way < 0) and np.any(way > 0))

    def used_rows(self) -> tuple[Array, Array, Array, Index, NDArray[np.int8]]:
        """Pressure [Pa], contraction [1], force [N], level and direction of the used rows, (k,)
        arrays.
        """
        rows = self.used
        columns = self.pressure[rows], self.contraction[rows], self.force[rows]
        return *columns, self.level[rows], self.direction[rows]

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
            With the same rows; those of other levels get the reason ``"left out"``. Its ``levels``
            are the chosen ones.

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
            raise refused("levels", list(levels), f"indices from 0 to {count - 1}, one at least")
        chosen = np.unique(np.asarray(levels, dtype=np.intp) % count)
        return self._without(~np.isin(self.level, chosen), LEFT_OUT)

    def with_directions(self) -> ForceMap:
        """The map with the directions of motion that the order of its rows tells, where it has
        none.

        Returns
        -------
        ForceMap
            Itself where a row has a direction, or where the order tells one only. Else with those
            of the strokes between turning points: of the length at each pressure; at held lengths
            of the pressure, whose rising counts as contracting.
        """
        if np.any(self.direction):
            return self
        pressure, contraction, _, level, _ = self.used_rows()
        way = np.zeros(len(self), dtype=np.int8)
        way[self.used] = table_ways(contraction, pressure, level)
        note = "directions of motion are those of the rows' order: no column gives them"
        directed = replace(self, direction=way, notes=(*self.notes, note))
        return directed if directed.has_loops else self

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
                raise ParameterError(
                    f"levels: no measurement at {pressure / 1e3:g} kPa; there are levels at {have} "
                    "kPa"
                )
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
            Rows outside the braid's limits are flagged ``"beyond the braid"``, those at lengths for
            which the geometry has no solution ``"no solution"``, and single ones beyond three times
            what the gas could do ``"force out of range"``.

        Raises
        ------
        ParameterError
            If the muscle's rest length differs from the map's.
        RecordingError
            If the forces are beyond three times or below a hundredth of what the gas could do (a
            wrong unit), or fewer than two rows are left.
        """
        check_rest_length(muscle, self.rest_length)
        low, high = muscle.contraction_limits
        e = self.contraction
        map_ = self._without(self.used & ~((e >= low) & (e <= high)), "beyond the braid")
        map_ = map_._without(map_.used & ~_solved(muscle, e, map_.used), "no solution")
        pressure, contraction, force, _, _ = map_.used_rows()
        body = muscle.replace(model="gaylord") if muscle.model == "map" else muscle
        able = float(np.max(pressure)) * float(np.max(np.abs(body.gas_area(contraction))))
        pull = np.abs(force)
        check_forces(self.label, float(np.quantile(pull, _MOST)), able, self.units)
        if able <= 0.0:  # no pressure, or no pull of the gas: nothing to judge by
            return map_
        beyond = map_.used & (np.abs(self.force) > FORCE_HIGH * able)
        return map_._without(beyond, "force out of range")


# ------------------------------------------------------------------------- checks


def _column(values: ArrayLike) -> Array:
    column = np.array(values, dtype=np.float64).ravel()
    column.setflags(write=False)
    return column


def _solved(muscle: Muscle, contraction: Array, rows: Mask) -> Mask:
    """True where the geometry has a solution at a contraction, and for rows outside of ``rows``."""
    solved = np.ones(len(contraction), dtype=bool)
    try:
        muscle.radius(contraction[rows])
    except ParameterError:
        for value in np.unique(contraction[rows]):
            try:
                muscle.radius(value)
            except ParameterError:
                solved[rows & (contraction == value)] = False
    return solved


def _rest_length(value: float) -> float:
    rest = float(value)
    if not (math.isfinite(rest) and _REST_LOW <= rest <= _REST_HIGH):
        hint = "; in mm, probably" if 10.0 < rest < 1e4 else ""
        raise ParameterError(
            f"rest_length = {rest:g} m is not allowed: from {_REST_LOW:g} to {_REST_HIGH:g} m{hint}"
        )
    return rest


def _reasons(
    length: Array,
    pressure: Array,
    force: Array,
    rest: float,
    *,
    faulty: ArrayLike | None,
    clipped: float | None,
) -> NDArray[np.object_]:
    """Reason for which each row is not used, the first that applies; ``""`` where it is used."""
    reason = np.full(len(length), "", dtype=object)

    def flag(rows: Mask, why: str) -> None:
        reason[rows & (reason == "")] = why

    if faulty is not None:
        flag(np.asarray(faulty, dtype=bool), "sensor fault")
    finite = np.isfinite(length) & np.isfinite(pressure) & np.isfinite(force)
    flag(~finite, "not a number")
    if clipped is not None:
        flag(finite & np.isclose(force, clipped, rtol=1e-9, atol=1e-12), "clipped")
    flag(finite & (pressure < 0.0), "negative pressure")
    flag(finite & (pressure > PRESSURE_HIGH), "pressure out of range")
    flag(finite & ~reachable(length, rest), "length out of range")
    return reason


def _directions(direction: ArrayLike | None, n: int, label: str) -> NDArray[np.int8]:
    if direction is None:
        return np.zeros(n, dtype=np.int8)
    given = np.asarray(direction, dtype=np.float64).ravel()
    if len(given) != n:
        raise RecordingError(
            f"{label}: direction has {len(given)} rows, length has {n}; the same is needed"
        )
    return np.asarray(np.sign(np.nan_to_num(given, nan=0.0)), dtype=np.int8)


def _duplicates(*columns: Array) -> Mask:
    """Rows that repeat an earlier row in every column."""
    rows = np.column_stack(columns)
    _, first = np.unique(rows, axis=0, return_index=True)
    return ~np.isin(np.arange(len(rows)), first)


def _cluster(pressure: Array, tolerance: float | None) -> tuple[Index, Array, list[str]]:
    """Level of each row, the levels' medians, and a note if pressures without gaps had to be cut.

    A gap wider than the tolerance parts two levels. A level wider than three tolerances, as from a
    pressure that ramps, is cut into bands one tolerance wide.
    """

    def width(at: float) -> float:
        return tolerance or max(_LEVEL_ABSOLUTE, _LEVEL_RELATIVE * abs(at))

    order = np.argsort(pressure, kind="stable")
    ranked = pressure[order].tolist()
    gaps = (i for i in range(1, len(ranked)) if ranked[i] - ranked[i - 1] > width(ranked[i - 1]))
    starts = [0, *gaps]
    edges: list[int] = []
    note: list[str] = []
    for start, stop in zip(starts, [*starts[1:], len(ranked)], strict=True):
        edges.append(start)
        if ranked[stop - 1] - ranked[start] > 3.0 * width(ranked[start]):
            for i in range(start, stop):
                if ranked[i] - ranked[edges[-1]] > width(ranked[edges[-1]]):
                    edges.append(i)
            note.append(
                f"pressures from {ranked[start] / 1e3:.4g} to {ranked[stop - 1] / 1e3:.4g} kPa "
                f"have no gaps: cut into {len([e for e in edges if e >= start])} levels"
            )
    rank = np.zeros(len(ranked), dtype=np.intp)
    rank[edges[1:]] = 1
    level = np.empty(len(ranked), dtype=np.intp)
    level[order] = np.cumsum(rank)
    levels = np.array([np.median(pressure[level == k]) for k in range(len(edges))])
    return level, levels, note
