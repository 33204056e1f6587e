"""Steps and right-hand sides of the packaged rigs' runs."""

from __future__ import annotations

import pamrs
from pamrs import _core
from pamrs.effects import EFFECTS
from pamrs.simulation import core_rig
from tests.runs import RUNS
from tests.work.snapshot import compare

STAGES = 4
"""Right-hand sides of a Runge-Kutta step, which is 1 ms at the most."""


def test_steps_of_the_packaged_rigs() -> None:
    counts = {}
    for name, run in RUNS.items():
        parts = round(run.sample_time / 1e-3)
        substeps = _core.Simulator(
            core_rig(run.plant), run.sample_time, run.sample_time / parts, {}
        ).substeps
        counts[f"{name}: steps of a sample of {1e3 * run.sample_time:g} ms"] = substeps
        counts[f"{name}: right-hand sides of the run"] = STAGES * substeps * (run.rows - 1)
    compare("steps", counts)


def test_longest_stable_steps_of_the_effects() -> None:
    counts = {}
    for effect in EFFECTS:
        regulated = effect.startswith("supply_regulator")
        rig = "regulated_joint" if regulated else "shoulder"
        rig = "blow_down_tank" if effect == "line_flow_law" else rig
        core = core_rig(pamrs.rigs.named(rig).with_effect(effect))
        counts[f"{effect}: longest stable step [us]"] = round(1e6 * core.stable_step)
    compare("stable_steps", counts)
