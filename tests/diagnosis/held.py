"""A chamber that was filled, shut and held, with all that an attempt at an explanation needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pamrs
from pamrs.diagnosis.noise import noise_levels
from pamrs.diagnosis.search import Attempts
from pamrs.recordings import Recording
from pamrs.simulation import core_rig
from tests.diagnosis.asked import problem_of
from tests.diagnosis.noisy import driven

RIG = pamrs.rigs.sealed_chamber()


def hold(
    conductance: float,
    seconds: float,
    *,
    name: str = "hold",
    seed: int = 1,
    step: float | None = 0.01,
    start: float = 7e5,
    **leak: float,
) -> Recording:
    """The chamber from 7 bar, or another pressure [Pa], at 10 Hz with 150 Pa of noise, with a leak
    (0 for none).
    """
    known = {"conductance": conductance, **leak}
    truth = RIG.with_effect("leak_muscle", known) if conductance else RIG
    begin = {"muscle_pressure": start}
    given = {"duration": seconds, "step": step, "initial": begin}
    return driven(truth, name, "fit", 0.1, {}, {"muscle_pressure": 150.0}, [seed], **given)


def held(conductance: float, seconds: float, **options: Any) -> pamrs.Case:
    """A case of one such hold."""
    return pamrs.Case("hold", RIG, [hold(conductance, seconds, **options)], Path())


def attempts_at(plant: pamrs.Rig, pressures: Sequence[float], noise: float) -> Attempts:
    """A minute from each gauge pressure [Pa] at 10 Hz with so much noise [Pa], the last hold held
    out.
    """
    kept = []
    for seed, pressure in enumerate(pressures):
        given = {"duration": 60.0, "initial": {"muscle_pressure": pressure}}
        sizes = {"muscle_pressure": noise}
        kept.append(driven(plant, f"hold{seed}", "fit", 0.1, {}, sizes, [7, seed], **given))
    every = problem_of(RIG, kept)
    blocks, core, found = every.blocks, every.core, every.recordings
    fit_problem, held_out_problem = (
        replace(every, recordings=some) for some in (found[:-1], found[-1:])
    )
    levels = noise_levels(fit_problem, core_rig(plant, core)) | noise_levels(
        held_out_problem, core_rig(plant, core)
    )
    # what the baseline leaves: it only scales the gap that is closed
    out = {block.name: SimpleNamespace(ratio=9.0) for block in blocks}
    return Attempts(fit_problem, held_out_problem, RIG, levels, cast("Any", out), blocks)
