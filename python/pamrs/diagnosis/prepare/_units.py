"""Units that physics contradicts, and those that no file says."""

from __future__ import annotations

import numpy as np

from pamrs.recordings import Case, suspicions

__all__ = ["noted_units", "suspected_units"]


def noted_units(case: Case) -> list[str]:
    """How the numbers of a case's files became values where the files alone do not say: units that
    were assumed, ambient pressures that were subtracted.

    Parameters
    ----------
    case : Case
        Its recordings.

    Returns
    -------
    list of str
        Sentences, with the recordings that they are about.
    """
    where: dict[str, list[str]] = {}
    for recording in case.recordings:
        for channel, note in recording.notes.items():
            where.setdefault(f"{channel} {note}", []).append(recording.name)
    return [f"{', '.join(names)}: {text}" for text, names in where.items()]


def suspected_units(case: Case) -> list[str]:
    """Units in which a case's files say that they are and that physics contradicts, with the
    evidence; each channel once.

    Parameters
    ----------
    case : Case
        Recordings and rig; of recordings that were read from no file nothing is suspected.

    Returns
    -------
    list of str
        Sentences, with the recordings that they are about.
    """
    where: dict[str, list[str]] = {}
    evidence: dict[str, str] = {}
    for recording in case.recordings:
        channels = {
            name: np.where(recording.mask[name], values, np.nan)
            for name, values in recording.channels.items()
        }
        for found in suspicions(channels, recording.said, recording.rig_there(case.rig)):
            where.setdefault(found.channel, []).append(recording.name)
            evidence.setdefault(found.channel, found.text)
    return [f"{', '.join(where[channel])}: {text}" for channel, text in evidence.items()]
