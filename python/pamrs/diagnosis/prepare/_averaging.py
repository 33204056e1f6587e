"""Fast recordings averaged to the rate that the fastest block of a rig needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pamrs._arrays import Array, Mask
from pamrs.channels import channel_of
from pamrs.diagnosis.prepare._blocks import Block
from pamrs.diagnosis.prepare._signals import DRIVEN_COMMANDS, held
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.errors import DiagnosisError
from pamrs.recordings import Recording

# [s] sample time that is needed where every block is a sealed chamber, which hardly moves
_NEEDED_SEALED_SAMPLE_TIME = 0.1


_HELD = (*DRIVEN_COMMANDS, "reference")
"""Entry ``k`` holds from sample ``k`` to the next, where a measured one is of its instant."""


def averaged_to_need(
    recordings: Sequence[Recording], blocks: Sequence[Block], case: str, settings: DiagnosisSettings
) -> tuple[list[Recording], list[int]]:
    """Recordings of a case at the rate that its blocks need.

    Means over so many samples that the fastest block still has the sample time that it needs, and
    that `ample_samples` are left; a short or slow recording stays as it is.

    Parameters
    ----------
    recordings : sequence of Recording
        Those of a case.
    blocks : sequence of Block
        The blocks that are judged.
    case : str
        Its name, for the message.
    settings : DiagnosisSettings
        What is needed, and how much is too much.

    Returns
    -------
    recordings : list of Recording
    counts : list of int
        Recorded samples in each sample, 1 where nothing was averaged.

    Raises
    ------
    DiagnosisError
        If there are more than `most_samples` even so.
    """
    sealed = bool(blocks) and all(block.window is None for block in blocks)
    needed = _NEEDED_SEALED_SAMPLE_TIME if sealed else settings.needed_sample_time
    counts = [
        _odd(min(needed / r.sample_time, len(r) / settings.ample_samples)) for r in recordings
    ]
    shortened = [averaged(r, count) for r, count in zip(recordings, counts, strict=True)]
    total = sum(len(r) for r in shortened)
    if total > settings.most_samples:
        longest = max(shortened, key=len)
        raise DiagnosisError(
            f"case {case!r}: its recordings have {total} samples at the rate that its blocks need; "
            f"at most {settings.most_samples} are diagnosed at a time: choose parts by start and "
            f"stop in case.toml (the longest is {longest.name!r}, {longest.duration:.4g} s)"
        )
    return shortened, counts


def _odd(ratio: float) -> int:
    """The largest odd number up to a ratio: the mean of an odd number of samples is at one."""
    whole = int(ratio * (1.0 + 1e-9))
    return max(1, whole - 1 + whole % 2)


def averaged(recording: Recording, count: int) -> Recording:
    """Means over so many samples each, an odd number; at the middle one's time.

    Parameters
    ----------
    recording : Recording
        What is averaged; at least half of the samples of a mean must be usable.
    count : int
        An odd number; 1 leaves the recording as it is.

    Returns
    -------
    Recording
        With the commands of the log beside their means: a valve lets through what its openings do
        one after the other, not what their mean does.
    """
    if count == 1:
        return recording
    half = count // 2
    size = (len(recording) - half) // count
    if size < 2:
        return recording
    channels: dict[str, Array] = {}
    masks: dict[str, Mask] = {}
    commands: dict[str, Array] = {}
    for name, values in recording.channels.items():
        first = half if channel_of(name) in _HELD else 0
        rows = slice(first, first + size * count)
        good = recording.mask[name][rows].reshape(size, count)
        if channel_of(name) in DRIVEN_COMMANDS and good.any():
            commands[name] = held(values, recording.mask[name])[rows]
        parts = np.where(good, values[rows].reshape(size, count), 0.0)
        usable = 2 * good.sum(axis=1) > count
        means = parts.sum(axis=1) / np.maximum(good.sum(axis=1), 1)
        channels[name], masks[name] = np.where(usable, means, np.nan), usable
    step = count * recording.sample_time
    return replace(
        recording,
        time=np.arange(size, dtype=np.float64) * step,
        sample_time=step,
        channels=channels,
        mask=masks,
        commands=commands,
    )
