"""Sensors that cannot be believed: ends of a range, which one recording shows and which are masked
in all, and thermometers that lag behind the log.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import binary_dilation

from pamrs._arrays import Mask
from pamrs.diagnosis.prepare._signals import few_usable, thermometers_of
from pamrs.findings import Faulty
from pamrs.recordings import Recording
from pamrs.rig import Rig
from pamrs.units import parse_unit

# samples beside one at its sensor's end, masked as well: their noise is cut off on one side
_RAIL_SAMPLES = 3


def without_rails(recordings: Sequence[Recording]) -> tuple[list[Recording], list[Faulty]]:
    """Recordings without the samples that a sensor reads at the end of its range.

    A sensor ends where it ends: the end that one recording shows, by staying there for long, is
    that of all of them, and a sample there may be of anything beyond. Samples beside one are those
    of which the noise let through the lower half, and go with it.

    Parameters
    ----------
    recordings : sequence of Recording
        Those of a case.

    Returns
    -------
    recordings : list of Recording
    faults : list of Faulty
        Each channel with such an end.
    """
    ends: dict[str, set[float]] = {}
    for recording in recordings:
        for issue in recording.issues:
            if issue.rail is not None:
                ends.setdefault(issue.channel, set()).add(issue.rail)
    masked, faults = list(recordings), list[Faulty]()
    for channel, rails in ends.items():
        for rail in sorted(rails):
            counts: dict[str, int] = {}
            samples = [
                r.channels[channel][r.mask[channel]] for r in masked if channel in r.channels
            ]
            every = np.concatenate(samples)
            if every.min() < rail < every.max():
                continue  # it stayed there, and reads more elsewhere
            for k, recording in enumerate(masked):
                if channel not in recording.channels:
                    continue
                bad = _beyond(recording, channel, rail, _RAIL_SAMPLES)
                if bad.any():
                    counts[recording.name] = int(bad.sum())
                    masked[k] = _masked(recording, channel, bad)
            faults.append(Faulty(channel, "clipped", _sentence(masked, channel, rail, counts)))
    return masked, faults


def _beyond(recording: Recording, channel: str, rail: float, beside: int) -> Mask:
    """Samples of a channel at the end of its range, with their neighbours; those that are masked
    because they stay there included.
    """
    values, mask = recording.channels[channel], recording.mask[channel]
    inside = values[mask]
    if not inside.size:
        return np.zeros_like(mask)
    upper = rail >= float(np.median(inside))
    slack = 1e-9 * max(1.0, abs(rail))
    at_end = mask & (values >= rail - slack if upper else values <= rail + slack)
    for issue in recording.issues:
        if issue.channel == channel and issue.rail == rail:
            # what is reported of several stretches together lies anywhere between its ends
            between = (recording.time >= issue.start) & (recording.time <= issue.stop)
            at_end |= between & ~mask
    bad: Mask = binary_dilation(at_end, iterations=beside) if at_end.any() else at_end
    return bad


def _masked(recording: Recording, channel: str, bad: Mask) -> Recording:
    values = np.where(bad, np.nan, recording.channels[channel])
    mask = recording.mask[channel] & ~bad
    return replace(
        recording,
        channels=recording.channels | {channel: values},
        mask=recording.mask | {channel: mask},
    )


def _sentence(
    recordings: Sequence[Recording], channel: str, rail: float, counts: dict[str, int]
) -> str:
    """Sentence on the end of a sensor's range, and on samples masked for it in each recording."""
    unit = next((u for r in recordings if (u := r.said.get(channel))), "")
    if unit:
        parsed = parse_unit(unit)
        value = f"{(rail - parsed.offset) / parsed.scale:.6g} {unit}"
    else:
        value = f"{rail:.6g} {next(r.units.get(channel, 'SI') for r in recordings)}"
    counted = [f"{count} in {name}" for name, count in counts.items()]
    more = len(counted) - _MOST_COUNTED
    examples = ", ".join(counted[:_MOST_COUNTED]) + f" and more in {more} others" * (more > 0)
    return (
        f"{channel} is clipped: its sensor's range ends at {value}; samples there, and "
        f"their neighbours, were masked in all recordings ({examples})"
    )


_MOST_COUNTED = 6
"""Recordings whose samples are counted."""


# share of new samples (no repeats, no lines) from which a thermometer keeps up with the log
_LEAST_NEW_SHARE = 0.5


def without_poor_thermometers(
    recordings: Sequence[Recording], rig: Rig
) -> tuple[list[Recording], list[str]]:
    """Recordings without the temperatures of gases that cannot be judged in each of them, and
    sentences that say so.

    No block needs a thermometer: one that fails, or whose samples repeat or lie on straight lines
    between fewer ones, is left out. The noise of the latter would be taken for far less than it is.

    Parameters
    ----------
    recordings : sequence of Recording
        What there is.
    rig : Rig
        The model.
    """
    notes = []
    for name in thermometers_of(rig).values():
        faults = [
            f"in {r.name!r} {fault}"
            for r in recordings
            if name in r.channels and (fault := _fault(r, name))
        ]
        if faults:
            notes.append(f"{name} is not judged: {'; '.join(faults)}")
            recordings = [
                replace(
                    r,
                    channels={n: v for n, v in r.channels.items() if n != name},
                    mask={n: v for n, v in r.mask.items() if n != name},
                )
                for r in recordings
            ]
    return list(recordings), notes


def _fault(recording: Recording, name: str) -> str:
    """Reason why a temperature cannot be judged; empty where it can."""
    values, mask = recording.channels[name], recording.mask[name]
    if few_usable(mask):
        return f"only {int(mask.sum())} of {mask.size} samples are usable"
    bends = np.abs(np.diff(values[mask], 2))
    new = float(np.mean(bends > 1e-6 * float(np.ptp(values[mask]))))
    if 0.0 < new < _LEAST_NEW_SHARE:
        return (
            f"one sample in {1.0 / new:.1f} is new, the others repeat or lie on lines between: log "
            "it as fast as the pressures, or the pressures as slowly"
        )
    return ""
