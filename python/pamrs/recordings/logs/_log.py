"""What every reader makes of a file: named series of numbers, each perhaps with a clock."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamrs.errors import RecordingError

__all__ = ["Log", "Series", "TextFormat", "collected", "numbers_of"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Series:
    """One channel of a log as the log has it: not scaled, not judged.

    Attributes
    ----------
    name : str
        Path in the log, parts joined by ``/``.
    values : (n,) array
        Numbers in the log's own unit, NaN where there is none; for texts the index into `labels`.
    unit : str
        As the log writes it; empty where it does not say.
    time : (n,) array, optional
        Its own times [s], on the clock of the log. None where the log has no clock for it.
    labels : tuple of str
        The different texts of a column of texts; empty for numbers.
    """

    name: str
    values: Array
    unit: str = ""
    time: Array | None = None
    labels: tuple[str, ...] = ()


@dataclass(frozen=True)
class TextFormat:
    """How a text file is written, where it is not to be found out.

    Attributes
    ----------
    delimiter, decimal, thousands : str, optional
        What separates cells (``" "``: any run of blanks), marks decimals, groups digits.
    header : bool, optional
        Whether a row of headings stands above the numbers.
    columns : tuple of str, optional
        A name for each column, in order, instead of the file's own.
    """

    delimiter: str | None = None
    decimal: str | None = None
    thousands: str | None = None
    header: bool | None = None
    columns: tuple[str, ...] | None = None


@dataclass(frozen=True, eq=False)
class Log:
    """A file as series.

    Attributes
    ----------
    path : Path
        The file, or the folder of a bag.
    series : dict of str to Series
        By name, in the order of the file.
    unread : dict of str to str
        What of the file is no series, and why.
    """

    path: Path
    series: dict[str, Series]
    unread: dict[str, str] = field(default_factory=dict)

    def find(self, name: str) -> Series:
        """The series of that name, or the only one whose last parts are that name.

        Parameters
        ----------
        name : str
            The whole path, or its end: ``p1`` for ``rig/p1``.

        Returns
        -------
        Series

        Raises
        ------
        RecordingError
            If there is none, or more than one.
        """
        if name in self.series:
            return self.series[name]
        ends = [known for known in self.series if known.endswith("/" + name)]
        if len(ends) == 1:
            return self.series[ends[0]]
        if ends:
            raise RecordingError(
                f"{self.path}: {name!r} may be any of {_few(ends)}; write the whole path"
            )
        if name in self.unread:
            raise RecordingError(f"{self.path}: {name!r} cannot be used: {self.unread[name]}")
        near = difflib.get_close_matches(name, self.series, n=1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise RecordingError(
            f"{self.path}: there is no channel {name!r}; {hint}the log has: {_few(self.series)}"
        )


def _few(names: Any, most: int = 12) -> str:
    known = [repr(name) for name in names]
    more = f" and {len(known) - most} more" if len(known) > most else ""
    return ", ".join(known[:most]) + more


def collected(path: Path, found: Sequence[Series], unread: Mapping[str, str] | None = None) -> Log:
    """A log of these series; names that are there twice get a number.

    Parameters
    ----------
    path : Path
        The file.
    found : sequence of Series
        In the order of the file.
    unread : mapping of str to str, optional
        What is no series, and why.

    Returns
    -------
    Log

    Raises
    ------
    RecordingError
        If there is no series with a number in it.
    """
    series: dict[str, Series] = {}
    for item in found:
        name, again = item.name, 2
        while name in series:
            name, again = f"{item.name} ({again})", again + 1
        same = item if name == item.name else replace(item, name=name)
        series[name] = same
    if not series:
        why = "; ".join(f"{name}: {text}" for name, text in list((unread or {}).items())[:3])
        raise RecordingError(
            f"{path}: no channel with numbers was found" + (f" ({why})" if why else "")
        )
    return Log(path, series, dict(unread or {}))


def numbers_of(values: Any) -> Array | None:
    """Numbers as a vector of float64, infinities as NaN; None if they are no numbers.

    Parameters
    ----------
    values : array-like
        Numbers, flags, durations or date-times (seconds since the earliest one) of any shape.

    Returns
    -------
    (n,) array or None
    """
    array = np.asarray(values)
    if array.dtype.kind == "M":
        stamps = array.astype("datetime64[ns]").ravel()
        there = ~np.isnat(stamps)
        laid = np.full(stamps.shape, np.nan)
        if there.any():
            laid[there] = (stamps[there] - stamps[there].min()).astype(np.int64) * 1e-9
        return laid
    if array.dtype.kind == "m":
        return np.asarray(array / np.timedelta64(1, "ns") * 1e-9, dtype=np.float64).ravel()
    if array.dtype.kind not in "biuf":
        return None
    result = array.astype(np.float64).ravel()
    result[~np.isfinite(result)] = np.nan
    return result
