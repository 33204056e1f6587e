"""A block that is cut out of its chain follows the simulation that its neighbours come from.

What is measured is taken from a simulation with an effect; the block in which the effect acts,
driven by it, has to show the same effect. It ties the short form of the equations, which leaves out
what a block does not depend on, to the whole plant.
"""

from __future__ import annotations

import numpy as np
import pytest

import pamrs
from pamrs.effects import EFFECTS
from pamrs.errors import PamrsError
from pamrs.simulation import core_rig

DT = 0.001
SAMPLES = 3001
# what is late is read between samples, and has tests of its own
ELSEWHERE = {"clock_skew", "sensor_lag"}
# a flow that chokes in the tube hides the pressure behind it (Tube::other_end)
UNTOLD = {("tube_flow_restriction", "arm")}


def _commands() -> np.ndarray:
    t = DT * np.arange(SAMPLES)
    return 5.0 + 1.5 * np.sin(2 * np.pi * 0.8 * t) + 1.0 * np.sign(np.sin(2 * np.pi * 0.5 * t))


def _predicted(rig: pamrs.Rig, run: pamrs.Simulation, block: str, channel: str) -> np.ndarray:
    signals = {}
    for name in ("supply_pressure", "muscle_pressure", "joint_angle"):
        value = np.ascontiguousarray(run[name])
        slope = run["joint_rate"] if name == "joint_angle" else np.gradient(value, DT)
        signals[name] = (value, np.ascontiguousarray(slope))
    commands = {"valve_command": _commands()}
    found, _ = core_rig(rig).predict(block, commands, DT, DT, [0], [], signals, SAMPLES)
    return np.asarray(found) - np.asarray(run[channel])


@pytest.mark.parametrize("effect", sorted(set(EFFECTS) - ELSEWHERE))
def test_a_cut_block_shows_the_effect_that_the_simulation_has(effect: str) -> None:
    bare = pamrs.rigs.shoulder()
    info = EFFECTS[effect]
    try:
        rig = bare.with_effect(effect, {p.name: p.starts[-1] for p in info.parameters if p.starts})
        # finely, since a step of a simulation goes over the instant at which a joint meets its stop
        run = pamrs.simulate(rig, valve_command=_commands(), sample_time=DT, step=1e-4)
    except PamrsError as error:
        pytest.skip(f"the shoulder cannot have it: {error}")
    channels = ("supply_pressure", "muscle_pressure", "joint_angle")
    for block, channel in zip(("supply", "chamber", "arm"), channels, strict=True):
        if (effect, block) in UNTOLD:
            continue
        with_it = np.abs(_predicted(rig, run, block, channel)).max()
        without = np.abs(_predicted(bare, run, block, channel)).max()
        scale = np.ptp(np.asarray(run[channel]))
        told = f"{block}: {with_it}, without the effect {without}, of {scale}"
        assert with_it < 5e-4 * scale, told
