"""A centre of mass off its line, an angle that is recorded late and moduli that drift are found."""

from __future__ import annotations

import numpy as np
import pytest

import pamrs
from tests.diagnosis.test_encoder_and_area import RIG, case

TIME = np.arange(0.0, 6.0, 0.005)
COMMAND = 5.0 + 0.5 * np.sin(2 * np.pi * 0.5 * TIME)


def run(rig: pamrs.Rig) -> pamrs.Simulation:
    return pamrs.simulate(rig, valve_command=COMMAND, sample_time=0.005)


@pytest.mark.parametrize(
    ("effect", "form", "make"),
    [
        ("com_offset", "", {"angle": 0.06}),
        ("sensor_lag", "", {"delay": 0.03}),
        ("parameter_drift", "exponential", {"change": -0.25, "time_constant": 8.0}),
    ],
)
@pytest.mark.slow
def test_it_is_named_with_its_size(effect: str, form: str, make: dict[str, float]) -> None:
    found = pamrs.diagnose(case(RIG.with_effect(effect, make, form=form), duration=30.0))
    first = found.effects[0]
    assert (found.verdict, first["id"]) == ("effects", effect)
    assert first["probability"] > 0.5
    for name, value in make.items():
        told = first["parameters"][name]
        assert abs(told["value"] - value) < 4.0 * told["std"]


def test_an_offset_is_what_a_turned_centre_of_mass_weighs() -> None:
    """To first order `centre_angle` where the link has no payload, at any base angle."""
    turned, bare = 1e-4, RIG.with_parameters({"arm.payload": 0.0})
    for base in (0.0, 0.5):
        rig = bare.with_parameters({"arm.base_angle": base})
        plain, centre, offset = (
            run(other)["joint_angle"]
            for other in (
                rig,
                rig.with_parameters({"arm.centre_angle": turned}),
                rig.with_effect("com_offset", {"angle": turned}),
            )
        )
        moved = np.abs(centre - plain).max()
        assert moved > 1e-6
        assert np.abs(offset - centre).max() < 0.01 * moved


def test_a_late_angle_is_the_angle_of_before() -> None:
    plain, late = run(RIG), run(RIG.with_effect("sensor_lag", {"delay": 0.02}))
    assert np.allclose(late["joint_angle"][4:], plain["joint_angle"][:-4], rtol=1e-12)
    assert np.allclose(late["muscle_pressure"], plain["muscle_pressure"], rtol=1e-9)


def test_drift_ends_at_the_moduli_that_it_names() -> None:
    """Long after a short time constant the rig is one with another `modulus_scale`."""
    scale = RIG.parameters["muscle.modulus_scale"].value
    drifted = run(RIG.with_effect("parameter_drift", {"change": -0.2, "time_constant": 0.1}))
    softer = run(RIG.with_parameters({"muscle.modulus_scale": 0.8 * scale}))
    gap = np.abs(drifted["joint_angle"] - softer["joint_angle"])
    moved = np.abs(run(RIG)["joint_angle"] - softer["joint_angle"]).max()
    assert gap[-400:].max() < 0.02 * moved


def test_an_offset_weighs_a_payload_as_it_is_at_the_time() -> None:
    """Four kilograms that were hung on before the start, and four that the file has."""
    rig = pamrs.rigs.shoulder().with_effect("com_offset", {"angle": 0.2})
    more = rig.with_parameters({"arm.payload": rig.parameters["arm.payload"].value + 4.0})
    hung = rig.with_effect("payload_change", {"mass_change": 4.0, "time": -1.0})
    command = 5.0 + 0.5 * np.sin(np.arange(0.0, 4.0, 0.005))
    known, changed = (
        pamrs.simulate(r, valve_command=command, sample_time=0.005) for r in (more, hung)
    )
    np.testing.assert_allclose(changed["joint_angle"], known["joint_angle"], atol=1e-6)
