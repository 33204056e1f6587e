"""A muscle that softens as it warms: a scale on its elastic terms alone."""

from __future__ import annotations

import numpy as np
import pytest

import pamrs
from pamrs.rig import parse_rig
from tests.simulation.refusals import refused

SOFT, WARM = 4e-3, 313.15
CONTRACTIONS = np.array([-0.02, 0.0, 0.1, 0.2])


@pytest.mark.parametrize("model", ["robinson", "gaylord"])
def test_it_is_a_scale_on_the_elastic_terms(model: str) -> None:
    cold = pamrs.rigs.shoulder().muscle.replace(model=model)
    warm = cold.replace(softening=SOFT, temperature=WARM)
    share = 1.0 - SOFT * 20.0
    scaled = cold.replace(modulus_scale=share)
    assert warm.elastic_scale == pytest.approx(share)
    for direction in (None, -1.0, 1.0):
        found = warm.force(4e5, CONTRACTIONS, direction)
        np.testing.assert_allclose(found, scaled.force(4e5, CONTRACTIONS, direction), rtol=1e-14)
    gas = cold.replace(modulus_scale=0.0).force(4e5, CONTRACTIONS)
    elastic = cold.force(4e5, CONTRACTIONS) - gas
    np.testing.assert_allclose(
        warm.force(4e5, CONTRACTIONS), gas + share * elastic, rtol=0.0, atol=1e-9 * abs(gas).max()
    )
    same = cold.replace(softening=SOFT)  # at the reference temperature
    np.testing.assert_array_equal(same.force(4e5, CONTRACTIONS), cold.force(4e5, CONTRACTIONS))


def test_a_run_is_that_of_softer_moduli() -> None:
    plain = pamrs.rigs.shoulder()
    volts = 5.0 + 0.8 * np.sin(4.0 * 0.005 * np.arange(101))
    warm = plain.with_parameters({"muscle.softening": SOFT, "muscle.temperature": WARM})
    scale = plain.parameter("muscle.modulus_scale").value * (1.0 - SOFT * (WARM - 293.15))
    softer = plain.with_parameters({"muscle.modulus_scale": scale})
    one, other, cold = (
        pamrs.simulate(rig, volts, sample_time=0.005) for rig in (warm, softer, plain)
    )
    for name in ("joint_angle", "muscle_pressure", "joint_torque"):
        size = float(np.abs(other[name]).max())
        np.testing.assert_allclose(one[name], other[name], rtol=0.0, atol=1e-11 * size)
    assert one["joint_angle"].max() > cold["joint_angle"].max()


def test_what_cannot_be_is_refused_by_name() -> None:
    rig = pamrs.rigs.shoulder()
    told = r"muscle.softening = 0.05 .*a size of at most 0.025 1/K.* 40 K above muscle.reference"
    soft = rig.with_parameters({"muscle.softening": 0.05, "muscle.temperature": 333.15})
    lines = (
        'softening = { value = 0.05, unit = "1/K" }\ntemperature = { value = 60, unit = "degC" }\n'
    )
    text = rig.to_toml_text().replace("[muscle]\n", "[muscle]\n" + lines)
    law = {"max_pressure": 6e5, "contraction": (0.0, 0.25), "rest_length": 0.2}
    braid = {"rest_diameter": 0.02, "braid_angle": 1.25, "wall_thickness": 1e-3}
    table = pamrs.Muscle.from_law(lambda p, e: 1e-3 * p * (1.0 - 3.0 * e), **law, **braid)
    none = r"muscle.softening.*\"map\" has no such parameter"
    refused(
        ("softening = 0.2 .*-0.1 to 0.1", lambda: rig.with_parameters({"muscle.softening": 0.2})),
        (told, lambda: pamrs.simulate(soft, [5.0, 5.0], sample_time=0.01)),
        (told, lambda: rig.muscle.replace(softening=0.05, temperature=333.15)),
        (told, lambda: parse_rig(text)),
        (none, lambda: table.replace(softening=1e-3)),
        by=pamrs.PamrsError,
    )
