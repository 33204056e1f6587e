"""`[model_error]`: how well a user knows the model, read, checked and written back."""

from __future__ import annotations

import math

import pytest

import pamrs
from pamrs.errors import RigError
from pamrs.rig import parse_rig
from tests.tables import rows_of

TEXT = pamrs.rigs.shoulder().to_toml_text(comments=False)


def stated(lines: str) -> pamrs.Rig:
    return parse_rig(f"{TEXT}\n[model_error]\n{lines}\n")


def test_shares_and_sizes_are_read_in_si_and_written_back() -> None:
    rig = stated('muscle = "1 %"\njoint_angle = "0.1 deg"\nmuscle_pressure = "3 kPa"')
    told = rig.model_error
    assert told["muscle"] == {"share": 0.01}
    assert told["joint_angle"]["size"] == pytest.approx(math.radians(0.1))
    assert told["muscle_pressure"]["size"] == pytest.approx(3000.0)
    assert parse_rig(rig.to_toml_text()).model_error == told
    assert rig.with_parameters({"arm.payload": 3.0}).model_error == told
    assert pamrs.rigs.shoulder().model_error == {}


def test_an_error_may_be_a_table_like_any_other_quantity() -> None:
    told = stated('joint_angle = { value = 0.1, unit = "deg" }').model_error
    assert told["joint_angle"]["size"] == pytest.approx(math.radians(0.1))


def test_of_several_chambers_each_may_have_its_own() -> None:
    text = pamrs.rigs.named("antagonistic_joint").to_toml_text(comments=False)
    rig = parse_rig(f'{text}\n[model_error.muscle_pressure]\nflexor = "2 %"\n')
    assert rig.model_error == {"muscle_pressure.flexor": {"share": 0.02}}


@pytest.mark.parametrize(
    ("line", "said"),
    rows_of(__file__, "what_cannot_be_read_is_said"),
)
def test_what_cannot_be_read_is_said(line: str, said: str) -> None:
    with pytest.raises(RigError, match="model_error") as error:
        stated(line)
    assert said in str(error.value)
