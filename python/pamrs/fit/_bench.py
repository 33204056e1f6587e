"""Force maps from a bench's recording: slow length cycles at held pressures, or slow pressure
cycles at held lengths.
"""

from __future__ import annotations

from pamrs.errors import RecordingError
from pamrs.fit._data import ForceMap
from pamrs.fit._ways import series_ways
from pamrs.recordings import Recording


def from_recording(
    recording: Recording,
    *,
    rest_length: float,
    clipped: float | None = None,
    level_tolerance: float | None = None,
) -> ForceMap:
    """A force map from a bench's recording: slow length cycles at held pressures, or slow pressure
    cycles at held lengths (where rising pressure counts as contracting).

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
        length=recording.channels["length"],
        pressure=recording.channels[pressure],
        force=recording.channels["force"],
        rest_length=rest_length,
        direction=series_ways(
            recording.channels["length"], recording.channels[pressure], rest_length
        ),
        clipped=clipped,
        level_tolerance=level_tolerance,
        faulty=~recording.valid(*needed),
        check_duplicates=False,
        name=recording.name,
        notes=[f"{issue.channel} at {issue.start:g} s: {issue.text}" for issue in recording.issues],
    )
