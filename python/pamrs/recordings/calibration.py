"""Calibrations from the numbers of a log to values: scale and offset, two readings, or a table."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from pamrs._arrays import Array
from pamrs.declared import is_finite

__all__ = ["KEYS", "Calibration", "read_calibration"]


#: Keys of an entry that say a calibration.
KEYS: Final = ("scale", "offset", "from", "to")


class Calibration(NamedTuple):
    """Line or table from the numbers of a log to values.

    Attributes
    ----------
    scale, offset : float
        A value is ``scale * raw + offset``.
    table : tuple of tuple of float, optional
        Instead of them: three or more numbers of the log, rising, and the values that they stand
        for. Straight between neighbours, and beyond the ends as in the last interval.
    """

    scale: float = 1.0
    offset: float = 0.0
    table: tuple[tuple[float, ...], tuple[float, ...]] | None = None

    def of(self, raw: Array | float) -> Array:
        """Convert numbers of the log to values."""
        numbers = np.asarray(raw, dtype=np.float64)
        if self.table is None:
            return np.asarray(self.scale * numbers + self.offset)
        given, stand_for = map(np.asarray, self.table)
        place = np.clip(np.searchsorted(given, numbers) - 1, 0, len(given) - 2)
        slope = np.diff(stand_for) / np.diff(given)
        return np.asarray(stand_for[place] + slope[place] * (numbers - given[place]))


def read_calibration(problems: list[str], label: str, entry: Mapping[str, Any]) -> Calibration:
    """Read the keys ``scale`` and ``offset``, or ``from`` and ``to``, of an entry.

    Parameters
    ----------
    problems : list of str
        Gets what is wrong.
    label : str
        What the entry is called, for messages.
    entry : mapping
        The entry, with other keys or not.

    Returns
    -------
    Calibration
        That which changes nothing where the entry says none, or where it is wrong.
    """
    if ("from" in entry) != ("to" in entry) or (
        "from" in entry and {"scale", "offset"} & set(entry)
    ):
        problems.append(
            f"{label}: from and to belong together, like from = [0, 4095], to = [0, 10], and "
            "replace scale and offset"
        )
        return Calibration()
    if "from" in entry:
        return _readings(problems, label, entry["from"], entry["to"])
    for key in ("scale", "offset"):
        value = entry.get(key, 1.0)
        if not is_finite(value) or (key == "scale" and value == 0):
            needed = "a number other than zero" if key == "scale" else "a number"
            problems.append(f"{label}.{key} = {value!r} is not allowed: {needed} is needed")
            return Calibration()
    return Calibration(float(entry.get("scale", 1.0)), float(entry.get("offset", 0.0)))


def _readings(problems: list[str], label: str, given: Any, stand_for: Any) -> Calibration:
    lists = [given, stand_for]
    if not all(
        isinstance(each, (list, tuple)) and len(each) > 1 and all(map(is_finite, each))
        for each in lists
    ) or len(given) != len(stand_for):
        problems.append(
            f"{label}: from = {given!r}, to = {stand_for!r} is not allowed: as many numbers in "
            "both, two at least"
        )
        return Calibration()
    rises = [b > a for a, b in itertools.pairwise(given)]
    falls = [b < a for a, b in itertools.pairwise(given)]
    if not (all(rises) or all(falls)) or min(stand_for) == max(stand_for):
        problems.append(
            f"{label}: from = {given!r}, to = {stand_for!r}: two equal numbers, or from neither "
            "rises nor falls all the way"
        )
        return Calibration()
    if len(given) == 2:
        scale = (stand_for[1] - stand_for[0]) / (given[1] - given[0])
        return Calibration(scale, stand_for[0] - scale * given[0])
    way = 1 if rises[0] else -1
    return Calibration(table=(tuple(map(float, given[::way])), tuple(map(float, stand_for[::way]))))
