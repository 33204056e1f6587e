"""Finds the direction of a muscle's motion where no column gives it: from the order of the rows,
from its length at held pressures, from its pressure at held lengths.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from pamrs._arrays import Array, Index

_HELD: Final = 0.005  # of the rest length: within it a length is held, a frame that yields included
_CYCLED: Final = 0.1  # of the largest pressure: what the pressure does while a length is held
_MOST: Final = 0.8  # of the rows are at held lengths where the map is isometric
_STROKE: Final = 4  # rows of a stroke at least, on average
_FEWEST: Final = 8  # rows at one held length: two branches of four


def held_lengths(contraction: Array, pressure: Array) -> list[Index]:
    """The rows of each stretch at one length in which the pressure goes over a range.

    Parameters
    ----------
    contraction, pressure : (n,) array
        Contraction [1] and gauge pressure [Pa] of rows in the order measured, finite.

    Returns
    -------
    list of array
        Indices of the rows of each; empty where the map is not isometric, since most rows are at
        other lengths or at held pressures.
    """
    starts = [0]
    for row, value in enumerate(contraction.tolist()):
        if abs(value - contraction[starts[-1]]) > _HELD:
            starts.append(row)
    stops = [*starts[1:], len(contraction)]
    reach = _CYCLED * float(np.max(np.abs(pressure), initial=0.0))
    found = [
        np.arange(start, stop)
        for start, stop in zip(starts, stops, strict=True)
        if stop - start >= _FEWEST and float(np.ptp(pressure[start:stop])) > reach
    ]
    rows = sum(len(part) for part in found)
    return found if rows >= _MOST * len(contraction) and rows else []


def series_ways(length: Array, pressure: Array, rest_length: float) -> Array:
    """Direction of each sample of a bench's recording.

    Parameters
    ----------
    length, pressure : (n,) array
        Length [m] and gauge pressure [Pa]; NaN where there is none.
    rest_length : float
        Length at zero contraction [m].

    Returns
    -------
    (n,) array
        -1 while contracting, 1 while lengthening, 0 where it is not known. At held lengths rising
        pressure is contracting.
    """
    known = np.flatnonzero(np.isfinite(length) & np.isfinite(pressure))
    way = np.zeros(len(length))
    held = held_lengths(1.0 - length[known] / rest_length, pressure[known]) if len(known) else []
    if not held:
        return strokes(length)
    for part in held:
        way[known[part]] = -strokes(pressure[known[part]])
    return way


def table_ways(contraction: Array, pressure: Array, level: Index) -> Array:
    """Direction of each row of a table, in the order measured.

    Parameters
    ----------
    contraction, pressure : (n,) array
        Contraction [1] and gauge pressure [Pa], finite.
    level : (n,) int array
        Pressure level of each row.

    Returns
    -------
    (n,) array
        As :func:`series_ways`.
    """
    way = np.zeros(len(contraction))
    held = held_lengths(contraction, pressure)
    for part in held:
        way[part] = -strokes(pressure[part], whole=True)
    if not held:
        for index in np.unique(level):
            rows = np.flatnonzero(level == index)
            way[rows] = -strokes(contraction[rows], whole=True)
    return way


def strokes(values: Array, *, whole: bool = False) -> Array:
    """Direction of each sample: the sign of the stroke it belongs to, 0 near the turns and where
    there is no value.

    Parameters
    ----------
    values : (n,) array
        A length, or what moves in its place.
    whole : bool
        Strokes reach from turn to turn, as in tables, whose rows are few.

    Returns
    -------
    (n,) array
    """
    rows = np.flatnonzero(np.isfinite(values))
    way = np.zeros(len(values))
    if len(rows) < 3:
        return way
    known = values[rows]
    turns = _turning_points(known, 0.1 * float(np.ptp(known)))
    if whole:
        if len(rows) < _STROKE * (len(turns) - 1):  # rows in no order turn at every other one
            return way
        for start, stop in zip(turns[:-1], turns[1:], strict=True):
            first = start + 1 if start else 0
            way[rows[first : stop + 1]] = np.sign(known[stop] - known[start])
        return way
    shortest = int(np.min(np.diff(turns))) if len(turns) > 1 else len(rows)
    window = max(1, shortest // 20)
    padded = np.pad(known, window, mode="edge")
    smooth = np.convolve(padded, np.ones(2 * window + 1) / (2 * window + 1), mode="valid")
    speed = np.gradient(smooth)
    usual = float(np.median(np.abs(speed)[np.abs(speed) > 0.0])) if np.any(speed) else 0.0
    moving = np.abs(speed) > 0.1 * usual
    for start, stop in zip(turns[:-1], turns[1:], strict=True):
        stroke = np.sign(known[stop] - known[start])
        way[rows[start : stop + 1]] = np.where(
            moving[start : stop + 1] & (np.sign(speed[start : stop + 1]) == stroke), stroke, 0.0
        )
    return way


def _turning_points(values: Array, threshold: float) -> list[int]:
    """First sample, the extremes between strokes longer than ``threshold``, last sample."""
    turns, extreme, rising = [0], 0, 0
    for i, value in enumerate(values.tolist()):
        step = value - float(values[extreme])
        if rising == 0:
            if abs(step) > threshold:
                rising, extreme = (1 if step > 0 else -1), i
        elif step * rising > 0:
            extreme = i
        elif -step * rising > threshold:
            turns.append(extreme)
            rising, extreme = -rising, i
    return [*turns, len(values) - 1]
