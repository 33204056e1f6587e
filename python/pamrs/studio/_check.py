"""What can be said of a case before the long work of its diagnosis."""

from __future__ import annotations

from dataclasses import dataclass, field

from pamrs.channels import channel_of
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.ready import readied
from pamrs.recordings import Case


@dataclass(frozen=True)
class Check:
    """What a check of the case found.

    Attributes
    ----------
    error : str
        Why the case cannot be diagnosed; empty where it can.
    cautions : list of str
        What was found and masked, or is to be looked at.
    inputs : dict of str to str
        SHA-256 of each file that was read.
    """

    error: str
    cautions: list[str] = field(default_factory=list)
    inputs: dict[str, str] = field(default_factory=dict)


def checked(case: Case) -> Check:
    """Look at a case as a diagnosis does before it fits anything.

    Parameters
    ----------
    case : Case
        The case.

    Returns
    -------
    Check

    Raises
    ------
    DiagnosisError
        If units or columns cannot be right, or no block of the rig can be judged.
    """
    ready = readied(case, DiagnosisSettings())
    cautions = [*case.rig.cautions, *ready.suspected, *_issues(case)]
    return Check("", list(dict.fromkeys(cautions)), dict(case.inputs))


def _issues(case: Case) -> list[str]:
    """What was found in the recordings, each kind of it once."""
    found: dict[str, int] = {}
    for recording in case.recordings:
        for issue in recording.issues:
            where = "" if issue.kind == "log" else f"{channel_of(issue.channel)}: "
            text = f"{recording.name}: {where}{issue.text}"
            found[text] = found.get(text, 0) + 1
    return [f"{text} ({count} times)" if count > 1 else text for text, count in found.items()]
