"""What can be said of a case before the long work of its diagnosis."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from pamrs.channels import channel_of
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.prepare import (
    at_ambient,
    blocks_beside_tanks,
    check_plausible,
    noted_units,
    own_of_rig,
    suspected_units,
    without_dead_commands,
)
from pamrs.errors import DiagnosisError
from pamrs.recordings import Case

__all__ = ["Check", "checked"]


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
    settings = DiagnosisSettings()
    own = replace(case, recordings=own_of_rig(case.rig, case.recordings))
    suspected = [*suspected_units(own), *noted_units(own)]
    rig, _ = at_ambient(case.rig, own.recordings, settings)
    alive, _ = without_dead_commands(own.recordings, rig)
    try:
        check_plausible(alive, rig, case.name, settings)
    except DiagnosisError as error:
        raise DiagnosisError("\n".join([str(error), *suspected])) from error
    channels = replace(own, recordings=alive).channels
    if not blocks_beside_tanks(rig, channels):
        raise DiagnosisError(
            f"the channels that every log has ({', '.join(channels)}) do not surround any block of "
            f"the rig ({', '.join(rig.blocks)}): nothing can be judged, record more of them"
        )
    cautions = [*rig.cautions, *suspected, *_issues(case)]
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
