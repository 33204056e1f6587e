"""Force models chosen in a rig file, and what a muscle says about itself."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.rig import parse_rig
from pamrs.rig.muscle_models import ELASTIC_PARAMETERS, GEOMETRIES, MODELS
from tests.tables import rows_of

SHOULDER = pamrs.rigs.shoulder().to_toml_text(comments=False)
ELASTIC: dict[str, dict[str, Any]] = {
    "mooney_rivlin": {"c10": 2e5, "c01": 5e4},
    "elbow_linear": {"bladder_modulus": 1e6},
}


def shoulder_muscle() -> pamrs.Muscle:
    muscle = pamrs.rigs.shoulder().muscle
    assert muscle is not None
    return muscle


def rig_text(model: str, *, geometry: str | None = None, extra: str = "") -> str:
    """The shoulder with another force model in its [muscle] block."""
    lines = []
    for line in SHOULDER.splitlines():
        name = line.partition(" = ")[0]
        if name == "model":
            lines.append(f'model = "{model}"')
            for key, value in ELASTIC.get(model, {}).items():
                lines.append(f'{key} = {{ value = {value}, unit = "Pa" }}')
            lines += extra.splitlines()
        elif name == "geometry":
            lines += [f'geometry = "{geometry}"'] if geometry else []
        elif not (
            name in ("modulus_slope", "modulus_offset") and name not in ELASTIC_PARAMETERS[model]
        ):
            lines.append(line)
    return "\n".join(lines)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("geometry", [None, *GEOMETRIES])
def test_every_model_can_be_chosen_in_a_rig_file(model: str, geometry: str | None) -> None:
    rig = parse_rig(rig_text(model, geometry=geometry))
    again = parse_rig(rig.to_toml_text())
    assert again.model == rig.model
    muscle = rig.muscle
    assert muscle is not None
    assert muscle.model == model
    assert muscle.geometry == (geometry or ("elliptic" if model == "robinson" else "cylinder"))
    want = shoulder_muscle().replace(model=model, geometry=geometry, **ELASTIC.get(model, {}))
    assert muscle.parameters == {**want.parameters, "count": 6}
    np.testing.assert_array_equal(
        muscle.force(3e5, [0.0, 0.1, 0.2]), want.force(3e5, [0.0, 0.1, 0.2])
    )
    assert ("muscle.c10" in rig.parameters) == (model == "mooney_rivlin")


def test_friction_is_read_with_its_units() -> None:
    friction = (
        'friction = { coefficient = 0.16, pressure_slope = { value = -0.145, unit = "1/MPa" }, '
        "floor = 0.01 }"
    )
    text = (
        rig_text("robinson")
        .replace("friction =", "#", 1)
        .replace('model = "robinson"', f'model = "robinson"\n{friction}')
    )
    muscle = parse_rig(text).muscle
    assert muscle is not None
    up, plain, down = (muscle.force(4e5, 0.1, direction=d) for d in (-1.0, None, 1.0))
    assert (up, down) == pytest.approx((plain * (1 - 0.102), plain * (1 + 0.102)), rel=1e-12)


@pytest.mark.parametrize(
    ("model", "extra", "words"),
    rows_of(__file__, "what_a_model_does_not_have_is_refused"),
)
def test_what_a_model_does_not_have_is_refused(model: str, extra: str, words: list[str]) -> None:
    with pytest.raises(pamrs.RigError) as caught:
        parse_rig(rig_text(model, extra=extra))
    for word in words:
        assert word in str(caught.value)


def test_replacing_the_model_keeps_what_both_have() -> None:
    muscle = shoulder_muscle()
    other = muscle.replace(model="kothera")
    assert other.parameters["modulus_offset"] == muscle.parameters["modulus_offset"]
    assert other.geometry == "cylinder"
    bare = muscle.replace(model="gaylord")
    assert bare.elastic_basis([0.0, 0.1]).shape == (2, 0)
    assert bare.replace(model="robinson").parameters["modulus_slope"] == [0.0]
    with pytest.raises(pamrs.ParameterError, match=r"muscle\.colour.*rest_length"):
        muscle.replace(colour=1)
    with pytest.raises(pamrs.ParameterError, match=r'muscle\.model = "spring"'):
        muscle.replace(model="spring")


def test_braid_constants_are_the_published_ones() -> None:
    inch = 0.0254
    muscle = shoulder_muscle().replace(
        rest_length=7.785 * inch,
        rest_diameter=0.625 * inch,
        braid_angle=math.radians(72.5),
        wall_thickness=inch / 16,
    )
    assert muscle.turns == pytest.approx(1.25, abs=0.005)
    assert muscle.fibre_length / inch == pytest.approx(8.16, abs=0.005)
    assert muscle.bladder_volume == pytest.approx(
        math.pi * (0.625 - 1 / 16) / 16 * 7.785 * inch**3, rel=1e-12
    )
    low, high = muscle.contraction_limits
    assert (1 - low) * 7.785 == pytest.approx(8.163, abs=1e-3)
    assert (1 - high) == pytest.approx(0.58 * (1 - low))


def test_braid_taut_only_in_extension() -> None:
    muscle = shoulder_muscle()
    assert muscle.braid_taut([-0.03, -0.02, -0.005, 0.0, 0.2]).tolist() == [
        True,
        True,
        False,
        False,
        False,
    ]
    assert muscle.radius(-0.03) == pytest.approx(0.8 * 0.0127)


def test_muscles_and_joints_can_be_pickled() -> None:
    muscle = shoulder_muscle().replace(friction_coefficient=0.1)
    again = pickle.loads(pickle.dumps(muscle))
    assert again.parameters == muscle.parameters
    np.testing.assert_array_equal(
        again.force(3e5, [0.1], direction=1.0), muscle.force(3e5, [0.1], direction=1.0)
    )
    joint = pamrs.Joint(kind="pulley", radius=0.03, rest_angle=0.2)
    assert pickle.loads(pickle.dumps(joint)).parameters == joint.parameters
    rig = pamrs.rigs.shoulder()
    pamrs.simulate(rig, [5.0, 5.0], sample_time=0.005)
    assert pickle.loads(pickle.dumps(rig)).model == rig.model
