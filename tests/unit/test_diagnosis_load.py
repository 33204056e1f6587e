"""A muscle that lifts a hanging mass is diagnosed as an arm is: its length is the channel, its load the block."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.blocks import available_blocks
from pamrs.diagnosis.fitting import Problem, residuals
from pamrs.diagnosis.signals import prepare
from pamrs.errors import DiagnosisError, SimulationError
from pamrs.recording import Recording
from pamrs.simulation import core_rig

RIG = pamrs.rigs.hanging_mass()
NOISE = {"valve_command": 0.0, "supply_pressure": 300.0, "muscle_pressure": 300.0, "length": 3e-5}
DT = 0.005


def recording(rig: pamrs.Rig, name: str, role: str, seed: int, seconds: float = 10.0) -> Recording:
    """Lifts and lowerings at two speeds; steps where it is held out."""
    rest = round(4.0 / DT)  # it settles before it is recorded
    time = np.arange(0.0, seconds, DT)
    wave = {
        "slow": 0.05 * np.sin(1.1 * time) + 0.03 * np.sin(4.0 * time),
        "fast": 0.05 * np.sin(2.3 * time + 0.4) + 0.04 * np.sin(5.1 * time),
        "steps": 0.06 * np.sign(np.sin(1.5 * time)),
    }[name]
    command = np.concatenate([np.full(rest, 5.0), 5.02 + wave])
    run = pamrs.simulate(rig, command, sample_time=DT, initial={"muscle_pressure": 2.5e5})
    rng = np.random.default_rng(seed)
    channels = {n: run[n][rest:] + rng.normal(0.0, s, time.size) for n, s in NOISE.items()}
    mask = {n: np.ones(time.size, dtype=bool) for n in channels}
    return Recording(name, role, time, DT, channels, mask, [], dict.fromkeys(channels, "SI"))


def case(rig: pamrs.Rig) -> pamrs.Case:
    roles = {"slow": "fit", "fast": "fit", "steps": "held_out"}
    return pamrs.Case("lift", RIG, [recording(rig, n, r, k) for k, (n, r) in enumerate(roles.items())], Path())


def test_the_load_is_a_block_and_its_sensitivities_are_those_of_differences() -> None:
    blocks = {b.name: b for b in available_blocks(RIG, tuple(NOISE))}
    assert blocks["load"].kind == "arm"
    assert "length" in blocks["chamber"].drives
    problem = Problem([blocks["load"]], [prepare(recording(RIG, "slow", "fit", 0, 6.0), RIG)], core_rig(RIG))
    names = ["load.mass", "load.viscous", "load.coulomb", "muscle.modulus_scale", "sensors.pressure_zero"]
    found = residuals(problem, RIG, names)["load", "slow"]
    assert float(np.sqrt(np.mean(found.value**2))) < 2.0 * found.noise
    prepared, known = problem.recordings[0], RIG.parameters
    given = ("load", prepared.commands, DT, DT / 2, prepared.starts(2.5, ("muscle_pressure",)))
    _, jacobian = core_rig(RIG).predict(*given, names, prepared.signals, prepared.n)
    for k, name in enumerate(names):
        step = 1e-3 * known[name].tol
        up, down = (
            core_rig(RIG.with_parameters({name: known[name].value + s * step})).predict(*given, [], prepared.signals, prepared.n)[0]
            for s in (1.0, -1.0)
        )
        slope = (up - down) / (2.0 * step)
        assert np.abs(slope - jacobian[:, k]).max() < 1e-3 * np.abs(slope).max(), name


def test_a_true_model_of_a_load_misses_nothing() -> None:
    found = pamrs.diagnose(case(RIG.with_parameters({"load.mass": 40.08, "muscle.modulus_scale": 1.04})))
    assert found.verdict in ("none", "parameters")


def test_an_effect_on_a_load_is_named() -> None:
    found = pamrs.diagnose(
        case(RIG.with_effect("muscle_hysteresis", {"friction_constant": 4.0, "friction_pressure": 4e-5, "presliding": 2e-3}))
    )
    assert found.effects[0]["id"] == "muscle_hysteresis"
    assert found.effects[0]["probability"] > 0.8
    assert found.fit["gap_closed"] > 0.8
    assert "length" in found.fit["held_out"]
    assert "length" in found.summary()


def test_a_frame_holds_the_length_and_has_no_block_of_its_own() -> None:
    assert RIG.muscle is not None
    bench = pamrs.rigs.bench(RIG.muscle)
    assert not [b for b in available_blocks(bench, ("muscle_pressure", "length")) if b.name == "load"]
    signals = {n: (np.full(64, v), np.zeros(64)) for n, v in (("muscle_pressure", 2e5), ("length", 0.25))}
    with pytest.raises((SimulationError, ValueError), match="frame"):
        core_rig(bench).predict("load", {}, DT, DT, [0], [], signals, 64)
    still = Recording("held", "fit", DT * np.arange(64), DT, {n: v for n, (v, _) in signals.items()}, {}, [], {})
    with pytest.raises(DiagnosisError, match="a frame holds the length"):
        pamrs.diagnose(pamrs.Case("held", bench, [still], Path()))
