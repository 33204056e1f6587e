"""Force maps from a bench's recording: slow length cycles at held pressures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pamrs.errors import RecordingError
from pamrs.fit._data import ForceMap
from pamrs.recordings import Recording

__all__ = ["from_recording"]

Array = NDArray[np.float64]


def from_recording(
    recording: Recording,
    *,
    rest_length: float,
    clipped: float | None = None,
    level_tolerance: float | None = None,
) -> ForceMap:
    """A force map from a bench's recording: slow length cycles at held pressures.

    Parameters
    ----------
    recording : Recording
        With the channels length, force and muscle_pressure (or reference, a pressure that is set).
    rest_length : float
        Length at zero contraction [m].
    clipped, level_tolerance : float, optional
        As in :meth:`ForceMap.from_arrays`.

    Returns
    -------
    ForceMap
        One row for each sample. The direction is that of the stroke between two turning points;
        near the turns, where the smoothed length moves at less than a tenth of its usual speed, it
        is 0. Masked samples are flagged.

    Raises
    ------
    RecordingError
        If a channel is missing or fewer than two samples are usable.
    """
    pressure = "muscle_pressure" if "muscle_pressure" in recording.channels else "reference"
    needed = ("length", pressure, "force")
    lacking = [channel for channel in needed if channel not in recording.channels]
    if lacking:
        raise RecordingError(
            f"recording {recording.name!r} has no channel {lacking[0]!r}; it has: "
            f"{', '.join(recording.channels)}"
        )
    return ForceMap.from_arrays(
        *(recording.channels[channel] for channel in needed),
        rest_length=rest_length,
        direction=_strokes(recording.channels["length"]),
        clipped=clipped,
        level_tolerance=level_tolerance,
        faulty=~recording.valid(*needed),
        check_duplicates=False,
        name=recording.name,
        notes=[f"{issue.channel} at {issue.start:g} s: {issue.text}" for issue in recording.issues],
    )


def _strokes(length: Array) -> Array:
    """Direction of each sample: the sign of the stroke it belongs to, 0 near the turns and where
    there is no length.
    """
    rows = np.flatnonzero(np.isfinite(length))
    way = np.zeros(len(length))
    if len(rows) < 3:
        return way
    values = length[rows]
    turns = _turning_points(values, 0.1 * float(np.ptp(values)))
    shortest = int(np.min(np.diff(turns))) if len(turns) > 1 else len(rows)
    window = max(1, shortest // 20)
    padded = np.pad(values, window, mode="edge")
    smooth = np.convolve(padded, np.ones(2 * window + 1) / (2 * window + 1), mode="valid")
    speed = np.gradient(smooth)
    usual = float(np.median(np.abs(speed)[np.abs(speed) > 0.0])) if np.any(speed) else 0.0
    moving = np.abs(speed) > 0.1 * usual
    for start, stop in zip(turns[:-1], turns[1:], strict=True):
        stroke = np.sign(values[stop] - values[start])
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
