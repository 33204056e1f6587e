"""Thermometers that tell a diagnosis too little: they are left alone, with a word why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pamrs.diagnosis.prepare._signals import few_usable, thermometers_of
from pamrs.recordings import Recording
from pamrs.rig import Rig

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
    said = []
    for name in thermometers_of(rig).values():
        faults = [
            f"in {r.name!r} {fault}"
            for r in recordings
            if name in r.channels and (fault := _fault(r, name))
        ]
        if faults:
            said.append(f"{name} is not judged: {'; '.join(faults)}")
            recordings = [_without(r, name) for r in recordings]
    return list(recordings), said


def _fault(recording: Recording, name: str) -> str:
    """Why a temperature cannot be judged; empty where it can."""
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


def _without(recording: Recording, name: str) -> Recording:
    """A recording without a channel."""
    return replace(
        recording,
        channels={n: v for n, v in recording.channels.items() if n != name},
        mask={n: v for n, v in recording.mask.items() if n != name},
    )
