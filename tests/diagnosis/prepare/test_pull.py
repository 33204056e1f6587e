"""What muscles pull is a block of its own where it is measured: a force on a load frame, a torque
at a joint.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.prepare import available_blocks
from pamrs.errors import DiagnosisError
from pamrs.recordings import Recording
from pamrs.rig import parse_rig
from pamrs.simulation import core_rig
from tests.diagnosis.asked import ROLES, diagnosed, names_value
from tests.diagnosis.noisy import SHOULDER, driven, noisy, without

DT = 0.005
MUSCLE = pamrs.rigs.shoulder().muscle
assert MUSCLE is not None
BENCH = pamrs.rigs.bench(MUSCLE)
REST = BENCH.parameter("muscle.rest_length").value


def pulled(true: pamrs.Rig, tare: float = 0.0) -> pamrs.Case:
    """A muscle whose length a frame moves while its pressure goes up and down; the load cell reads
    ``tare`` [N] at rest.
    """
    found = []
    noise = {"muscle_pressure": 300.0, "length": 2e-5, "force": 1.0}
    for k, role in enumerate(ROLES):
        time = np.arange(0.0, 10.0, DT)
        length = REST * (
            0.88
            + 0.06 * np.sin(2 * np.pi * (0.11 + 0.05 * k) * time)
            + 0.02 * np.sin(2 * np.pi * 0.37 * time + k)
        )
        pressure = 2.2e5 + 1.3e5 * np.sin(2 * np.pi * (0.07 + 0.03 * k) * time + 0.5 * k)
        run = pamrs.simulate(true, length=length, pressure=pressure, sample_time=DT)
        channels = {
            "muscle_pressure": run["muscle_pressure"],
            "length": length,
            "force": run["muscle_force"] + tare * (1 + k),
        }
        found.append(noisy(f"r{k}", role, DT, channels, noise, [17, k]))
    return pamrs.Case("bench", BENCH, found, Path())


def test_the_force_is_that_of_a_simulation() -> None:
    (block,) = available_blocks(BENCH, pulled(BENCH).channels)
    assert (block.name, block.kind, block.channel) == ("force", "pull", "force")
    time = np.arange(0.0, 4.0, DT)
    length, slope = 0.25 + 0.01 * np.sin(time), 0.01 * np.cos(time)
    pressure, rise = 2e5 + 5e4 * np.sin(2 * time), 1e5 * np.cos(2 * time)
    signals = {"muscle_pressure": (pressure, rise), "length": (length, slope)}
    rig = BENCH.with_effect("muscle_hysteresis", {"friction_constant": 5.0, "presliding": 1e-3})
    found, slopes = core_rig(rig).predict(
        "force", {}, DT, DT, [0], ["muscle.modulus_scale"], signals, time.size
    )
    run = pamrs.simulate(rig, length=length, pressure=pressure, sample_time=DT)
    np.testing.assert_allclose(found, run["muscle_force"], rtol=1e-3, atol=0.02)
    assert slopes is not None
    assert np.all(slopes[:, -1] == 1.0)  # what the load cell reads at rest


def test_a_load_cell_that_is_not_zeroed_is_no_missing_physics() -> None:
    found = pamrs.diagnose(pulled(BENCH, tare=12.0))
    assert found.verdict in ("none", "parameters")
    assert found.fit["held_out"]["force"].after < 1.3


def with_gain(value: str, rig: pamrs.Rig = BENCH) -> str:
    """The file of a rig with the gain of a load cell."""
    lines = [line for line in rig.to_toml_text().splitlines() if "force_gain" not in line]
    return "\n".join(lines).replace("[sensors]", f"[sensors]\nforce_gain = {value}", 1)


def test_a_gain_of_the_load_cell_that_is_off_is_a_wrong_value_by_name() -> None:
    known = parse_rig(with_gain("{ value = 1, unit = '1', tol = 0.003 }"))
    case = replace(pulled(known.with_parameters({"sensors.force_gain": 1.06}), tare=5.0), rig=known)
    found = pamrs.diagnose(case)
    names_value(found, "sensors.force_gain", 1.06, 0.01)
    assert parse_rig(known.to_toml_text()).parameter("sensors.force_gain").tol == 0.003


def test_a_gain_that_cannot_be_is_refused() -> None:
    with pytest.raises(pamrs.RigError, match=r"sensors\.force_gain = 0 is not allowed.*0\.01"):
        parse_rig(with_gain("{ value = 0, unit = '1' }"))
    text = with_gain("{ value = 1, unit = '1' }", pamrs.rigs.sealed_chamber())
    words = r'force_gain is not allowed: a \[load\] with kind = "mass" or "frame" is needed'
    with pytest.raises(pamrs.RigError, match=words):
        parse_rig(text)


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        pytest.param(
            "muscle_hysteresis",
            {"friction_constant": 6.0, "friction_pressure": 6e-5},
            marks=pytest.mark.slow,
        ),
        ("activation_pressure", {"threshold": 2e4}),
    ],
)
def test_what_a_force_lacks_is_named(effect: str, values: dict[str, float]) -> None:
    found = pamrs.diagnose(pulled(BENCH.with_effect(effect, values)))
    assert found.verdict == "effects"
    assert [e.id for e in found.effects] == [effect]
    assert found.effects[0].probability > 0.8  # in whatever set
    assert found.where["block"] == "force"
    for name, value in values.items():
        told = found.effects[0]["parameters"][name]
        assert abs(told["value"] - value) < 4.0 * told["std"] + 0.02 * value
    assert found.fit["gap_closed"] > 0.9


def test_a_frame_without_its_force_is_refused() -> None:
    case = pulled(BENCH)
    bare = [without(r, "force") for r in case.recordings]
    with pytest.raises(DiagnosisError, match="every recording needs the channel force"):
        pamrs.diagnose(replace(case, recordings=bare))


def turned(true: pamrs.Rig, role: str, k: int) -> Recording:
    """A shoulder that its valve moves, with a torque sensor between the muscles and the joint."""
    turn = 2 * np.pi * np.arange(0.0, 12.0, DT)
    wave = (0.35 + 0.1 * k) * np.sin(0.15 * turn) + 0.25 * np.sin(0.4 * turn + k)
    noise = {"valve_command": 0.0, **SHOULDER, "joint_torque": 0.3}
    return driven(true, f"r{k}", role, DT, {"valve_command": 5.0 + wave}, noise, [17, k])


@pytest.mark.slow
def test_a_torque_tells_friction_of_the_joint_from_that_of_the_muscle() -> None:
    rig = pamrs.rigs.shoulder()
    true = rig.with_effect("joint_coulomb_stribeck", {"stiction": 3.0, "stribeck_speed": 0.08})
    found = diagnosed(rig, partial(turned, true))
    assert found.probabilities["joint_coulomb_stribeck"] > 0.8
    assert found.where["block"] == "arm"
    torque = next(m for b in found.blocks for m in b.mismatch if m.block == "torque")
    assert not torque.fitted.refit.more_than_noise


@pytest.mark.slow
def test_a_muscle_that_is_a_table_is_diagnosed_as_others_are() -> None:
    """No force model: its measured map, with a kink in pressure that no other model has."""
    sizes = ("rest_length", "rest_diameter", "braid_angle", "wall_thickness", "geometry")
    muscle = pamrs.Muscle.from_law(
        lambda p, e: 1.5e-3 * 3e4 * np.logaddexp(0.0, (p - 1e5) / 3e4) * (1 - 2.5 * e) - 300 * e,
        max_pressure=4e5,
        contraction=(-0.01, 0.3),
        **{name: MUSCLE.parameters[name] for name in sizes},
    )
    bench = pamrs.rigs.bench(muscle)
    for concealed in ({}, {"friction_constant": 12.0, "presliding": 1e-3}):
        true = bench.with_effect("muscle_hysteresis", concealed) if concealed else bench
        found = pamrs.diagnose(pulled(true).with_rig(bench))
        assert found.verdict == ("effects" if concealed else "none")
        if concealed:
            assert found.effects[0].id == "muscle_hysteresis"
            assert found.effects[0].probability > 0.8
