"""Diagnosis: locate a mismatch between model and recordings, name the omitted physics or say that it is not listed.

The chain of a rig is cut at every measured channel, so that each block has a residual of its own. The baseline is refitted
inside its tolerances first; what then exceeds the noise floor is located by block and condition, and the effects of the
catalogue compete with each other and with "unlisted" on held-out recordings.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable

from pamrs.case import Case, load_case
from pamrs.diagnosis import assemble
from pamrs.diagnosis.blocks import available_blocks
from pamrs.diagnosis.fitting import Problem
from pamrs.diagnosis.hypotheses import examine
from pamrs.diagnosis.result import Diagnosis
from pamrs.diagnosis.signals import prepare
from pamrs.errors import DiagnosisError
from pamrs.simulation import core_rig

__all__ = ["Diagnosis", "diagnose"]


def _quiet(message: str) -> None:
    """Default receiver of progress."""


def diagnose(case: Case | str | os.PathLike[str], *, progress: Callable[[str], None] | None = None) -> Diagnosis:
    """Find the physics that a rig's model leaves out.

    Parameters
    ----------
    case : Case or path-like
        A case, or its folder.
    progress : callable, optional
        Called with a line of text now and then.

    Returns
    -------
    Diagnosis
        Verdict, location, named effects with probabilities, fit before and after, model with the effect.

    Raises
    ------
    DiagnosisError
        If the recordings are too short or lack the channels that any block needs.
    CaseError
        If the folder is not a case.

    Examples
    --------
    >>> import pamrs
    >>> pamrs.diagnose("cases/zillen_chambers/Ultimaker_020").verdict  # doctest: +SKIP
    'effects'
    """
    began = time.perf_counter()
    say = progress or _quiet
    if not isinstance(case, Case):
        case = load_case(case)
    rig = case.rig
    if rig.effects:
        raise DiagnosisError(
            f"the nominal rig of case {case.name!r} already has the effect {rig.effects[0]['id']!r}; diagnose a rig without effects"
        )
    say(f"{case.name}: preparing {len(case.recordings)} recordings")
    fitted = [prepare(r, rig) for r in case.fit or case.recordings]
    held = [prepare(r, rig) for r in case.held_out if case.fit]
    channels = case.channels
    blocks = available_blocks(rig, channels)
    if not blocks:
        raise DiagnosisError(
            f"case {case.name!r}: its channels ({', '.join(channels)}) do not surround any block of the rig "
            f"({', '.join(rig.blocks)}); measure muscle_pressure, and supply_pressure and joint_angle where the rig has them"
        )
    nominal_core = core_rig(rig)
    inner = Problem(blocks, fitted, nominal_core)
    outer = Problem(blocks, held, nominal_core) if held else inner
    gas = [b for b in blocks if b.name != "arm"]
    motion = [b for b in blocks if b.name == "arm"]
    groups = [examine(inner, outer, rig, members, say) for members in (gas, motion) if members]
    say("putting the answer together")
    diagnosis = assemble.assemble(case, inner, outer, groups)
    diagnosis.seconds = round(time.perf_counter() - began, 3)
    if not math.isfinite(sum(diagnosis.probabilities.values())):
        raise DiagnosisError("the probabilities are not finite: please report this case")
    return diagnosis
