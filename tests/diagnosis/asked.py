"""What is asked of recordings: problems of some blocks, whole diagnoses, and what these name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.fit import Problem
from pamrs.diagnosis.prepare import Block, available_blocks, prepare
from pamrs.recordings import Recording
from pamrs.simulation import core_rig

SETTINGS = DiagnosisSettings()
EXACT = DiagnosisSettings(usual_error=0.0)
"""Settings for a model without an error of its own."""
ROLES = ("fit", "fit", "held_out")


def blocks_of(rig: pamrs.Rig, channels: Sequence[str]) -> dict[str, Block]:
    """The blocks that some channels tell apart, by name."""
    return {block.name: block for block in available_blocks(rig, tuple(channels))}


def problem_of(rig: pamrs.Rig, recordings: Sequence[Recording], *names: str) -> Problem:
    """Some blocks of a rig, or all that every recording tells apart, over recordings."""
    common = [n for n in recordings[0].channels if all(n in r.channels for r in recordings)]
    blocks = blocks_of(rig, common)
    chosen = [blocks[name] for name in names or blocks]
    return Problem(chosen, [prepare(r, rig, SETTINGS) for r in recordings], core_rig(rig), SETTINGS)


def diagnosed(
    nominal: pamrs.Rig,
    make: Callable[[str, int], Recording],
    roles: Sequence[str] = ROLES,
    settings: DiagnosisSettings = SETTINGS,
) -> pamrs.Diagnosis:
    """The diagnosis of a recording for each role, made of the role and its place."""
    recordings = [make(role, k) for k, role in enumerate(roles)]
    case = pamrs.Case("case", nominal, recordings, Path())
    return pamrs.diagnose(case, settings=settings)


def names_value(found: pamrs.Diagnosis, name: str, value: float, rel: float) -> None:
    """That one value of the rig file is wrong, what it is, and that nothing else is."""
    assert found.verdict == "parameters", found.summary()
    (wrong,) = found.wrong_parameters
    assert wrong.name == name
    assert wrong.value == pytest.approx(value, rel=rel)


def leading(found: pamrs.Diagnosis) -> str:
    """The most probable hypothesis of a case."""
    return max(found.probabilities, key=found.probabilities.__getitem__)
