"""Units that physics contradicts, and those that no file says."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from pamrs.recordings import Case, suspicions

_FEW: Final = 8  # parts that are named


def noted_units(case: Case) -> list[str]:
    """Sentences on what the files of a case do not say: units that were assumed, ambient pressures
    that were subtracted, parts that no recording takes.

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
    notes = [f"{', '.join(names)}: {text}" for text, names in where.items()]
    for source in dict.fromkeys(recording.source for recording in case.recordings):
        lefts = [recording.left for recording in case.recordings if recording.source == source]
        lost = [part for part in lefts[0] if all(part in lefts_of_one for lefts_of_one in lefts)]
        some = ", ".join(lost[:_FEW]) + " and so on" * (len(lost) > _FEW)
        if lost:
            notes.append(
                f"{Path(source).name}: {len(lost)} of the parts of this log ({some}) are in no "
                "recording of the case (pieces in case.toml)"
            )
    return notes


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
        for suspicion in suspicions(channels, recording.said, recording.rig_there(case.rig)):
            where.setdefault(suspicion.channel, []).append(recording.name)
            evidence.setdefault(suspicion.channel, suspicion.text)
    return [f"{', '.join(where[channel])}: {text}" for channel, text in evidence.items()]
