"""The missing input of a block: known torques, flows and readings are found in numbers and words,
and of a healthy arm nothing is.
"""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import pamrs
from pamrs.errors import CaseError, DiagnosisError, ParameterError
from pamrs.findings import MissingInput
from tests.diagnosis import frames
from tests.diagnosis.test_arm_and_sensors import RIG, case
from tests.diagnosis.test_load import RIG as LIFT
from tests.diagnosis.test_load import case as lifted

FRICTION = {"coulomb": 1.0, "stiction": 0.0, "stribeck_speed": 0.05}
RUBBING = RIG.with_effect("joint_coulomb_stribeck", FRICTION, form="with_coulomb")


def told(found: MissingInput, *names: str) -> list[np.ndarray]:
    """Value, standard deviation and some arguments, all recordings in a row."""
    columns = [[own.value, own.std, *(own.along(n) for n in names)] for own in found.recordings]
    return [np.concatenate(own) for own in zip(*columns, strict=True)]


@pytest.fixture(scope="module")
def rubbing() -> MissingInput:
    """That of an arm with a friction of 1 N m that its model does not have."""
    return pamrs.missing_input(case(RUBBING))


def test_a_friction_is_found_with_its_sign_and_size(rubbing: MissingInput) -> None:
    assert (rubbing.block, rubbing.unit, rubbing.argument) == ("arm", "N m", "joint_rate")
    assert rubbing.sentence.endswith("N m against the motion")
    assert rubbing.share > 0.99
    assert rubbing.noises_before > 10.0 > 1.5 > rubbing.noises_after
    value, std, rate = told(rubbing, "joint_rate")
    moving = np.abs(rate) > 0.1
    friction = -value[moving] * np.sign(rate[moving])
    assert float(np.median(friction)) == pytest.approx(1.0, abs=0.1)
    assert np.mean(np.abs(friction - 1.0) < 2.0 * std[moving]) > 0.9


def test_a_leak_is_found_with_its_law() -> None:
    """A laminar leak grows with the square of the absolute pressure: the flow is that of the model
    which has it.
    """
    leak = {"conductance": 3e-10, "laminar_share": 0.5}
    leaking = case(RIG.with_effect("leak_muscle", leak))
    found = pamrs.missing_input(leaking)
    assert (found.block, found.unit, found.argument) == ("chamber", "kg/s", "muscle_pressure")
    assert "g/s out of the chamber, growing with the muscle pressure" in found.sentence
    value, std, pressure = told(found, "muscle_pressure")
    low, high = (float(np.mean(value[rows])) for rows in (pressure < 1e5, pressure > 2.2e5))
    assert high < 2.0 * low < 0.0
    left = pamrs.missing_input(leaking, rig=RIG.with_effect("leak_muscle", leak), block="chamber")
    assert left.sentence == "nothing above the noise"
    assert left.argument == ""
    assert np.sqrt(np.mean(told(left)[0] ** 2)) < 0.05 * np.sqrt(np.mean(value**2))
    assert (std > 0.0).all()


def test_what_lasts_for_a_while_is_found_at_its_time() -> None:
    """Gas leaves a shut chamber between 14 and 20 s of one recording."""
    time, rng = np.arange(0.0, 40.0, 0.02), np.random.default_rng(3)
    lost = np.clip(time - 14.0, 0.0, 6.0)
    runs = {
        name: {"time": time, "muscle_pressure": 3e5 * fall + rng.normal(0.0, 200.0, time.size)}
        for name, fall in (("kept", np.ones(time.size)), ("opened", np.exp(-lost / 30.0)))
    }
    found = pamrs.missing_input(pamrs.rigs.sealed_chamber(), runs)
    (own,) = found.times
    assert own.recording == "opened"
    assert (own.start, own.stop) == pytest.approx((14.0, 20.0), abs=1.0)
    assert own.ratio > 3.0
    assert found.argument == "time"
    assert " out of the chamber, " in found.sentence
    assert f"s of opened: {own.ratio:.2g} times as much as at other times" in found.sentence


def test_a_mass_hangs_in_the_input_of_its_load() -> None:
    """One kilogram more pulls a hanging load down by its weight, all the time."""
    heavier = LIFT.parameter("load.mass").value + 1.0
    found = pamrs.missing_input(lifted(LIFT.with_parameters({"load.mass": heavier})), block="load")
    value, _, _ = told(found, "length")
    assert found.unit == "N"
    assert float(np.median(value)) == pytest.approx(9.81, rel=0.1)


def test_what_a_load_cell_reads_too_much_is_found() -> None:
    """A frame measures the force itself: what is missing is what it reads beside the model, but for
    what the cell reads at rest, which nobody knows.
    """
    stiffer = frames.BENCH.parameter("muscle.modulus_scale").value * 1.1
    truth = frames.BENCH.with_parameters({"muscle.modulus_scale": stiffer})
    found = pamrs.missing_input(frames.case(truth), block="force")
    assert found.unit == "N"
    plain, other = (frames.case(rig).recordings for rig in (frames.BENCH, truth))
    for own, one, two in zip(found.recordings, plain, other, strict=True):
        # the noise of both is the same
        more = np.interp(own.time, one.time, two.channels["force"] - one.channels["force"])
        apart = (own.value - own.value.mean()) - (more - more.mean())
        assert np.sqrt(np.mean(apart**2)) < 0.2 * np.std(more)


def test_a_healthy_arm_lacks_nothing() -> None:
    found = pamrs.missing_input(case(RIG), block="arm")
    assert found.sentence == "nothing above the noise"
    assert (found.argument, found.share) == ("", 0.0)
    value, std = told(found)
    assert np.mean(np.abs(value) < 3.0 * std) > 0.95


def test_it_is_kept_as_arrays_with_units(rubbing: MissingInput) -> None:
    few = rubbing.thinned(50)
    for one, other in zip(few.recordings, rubbing.recordings, strict=True):
        assert one.value.size <= 50 < other.value.size
        assert set(one.arguments) == set(rubbing.units) - {"time"}
    kept = json.loads(json.dumps(few.to_dict(), allow_nan=False))
    assert kept["units"]["joint_rate"] == "rad/s"
    assert kept["recordings"][0]["value"] == few.recordings[0].value.tolist()


def test_it_draws_both_strokes_over_what_it_depends_on(rubbing: MissingInput) -> None:
    pytest.importorskip("matplotlib")
    law = [replace(own, law=own.value) for own in rubbing.recordings]
    axes = replace(rubbing, recordings=law).plot()
    assert axes.get_xlabel() == "joint rate [deg/s]"
    assert axes.get_ylabel() == "missing, arm [N m]"
    _, names = axes.get_legend_handles_labels()
    assert names == ["up stroke", "down stroke", "what is named"]
    over_time = replace(rubbing, argument="").plot()
    assert over_time.get_xlabel() == "time [s]"


def test_bad_input_is_named() -> None:
    rubbing = case(RUBBING)
    with pytest.raises(ParameterError, match=r"block = 'arms' is not allowed.*arm"):
        pamrs.missing_input(rubbing, block="arms")
    with pytest.raises(DiagnosisError, match="data is missing"):
        pamrs.missing_input(RIG)
    with pytest.raises(CaseError, match="no channel"):
        pamrs.missing_input(RIG, {})


def test_a_diagnosis_has_it_with_the_law_of_what_it_names() -> None:
    found = pamrs.diagnose(case(RIG.with_effect("muscle_hysteresis")))
    missing = found.missing_input
    assert missing is not None
    assert missing.block == found.answer.block == "arm"
    assert {own.role for own in missing.recordings} == {"fit", "held_out"}
    share = re.search(r", of which (\d+) % is what is named$", missing.sentence)
    assert share is not None
    assert float(share[1]) > 95.0
    for own in missing.recordings:
        assert own.value.size <= 400
        assert own.law is not None
        left = np.sqrt(np.mean((own.value - own.law) ** 2))
        assert left < 0.2 * np.sqrt(np.mean(own.value**2))
    assert pamrs.diagnose(case(RIG)).missing_input is None
