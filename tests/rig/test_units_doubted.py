"""What is most likely meant in another unit, or from another line, is told to whoever gave it."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import pamrs
from pamrs.design.sizing import free_contraction
from pamrs.errors import PamrsError, ParameterError, UnitWarning
from pamrs.rig import parse_rig

TOLD = r"never exceeds 2 Pa \(gauge\): pascals are wanted, 1 bar is 1e5"


SHOULDER = pamrs.rigs.shoulder()
START = {"muscle_pressure": 2.0}


@pytest.mark.parametrize(
    ("call", "what"),
    [
        (lambda: SHOULDER.muscle.force([0.0, 2.0], 0.05), "pressure"),
        (
            lambda: pamrs.simulate(
                pamrs.rigs.regulated_joint(), supply_command=np.full(20, 2.0), sample_time=0.01
            ),
            "supply_command",
        ),
        (
            lambda: pamrs.simulate(SHOULDER, 5.0, sample_time=0.01, duration=0.1, initial=START),
            "initial muscle_pressure",
        ),
        (
            lambda: pamrs.Simulator(SHOULDER, sample_time=0.01, initial=START),
            "initial muscle_pressure",
        ),
        (
            lambda: pamrs.Joint(kind="pulley", radius=0.03).torque(SHOULDER.muscle, 2.0, 0.5),
            "pressure",
        ),
    ],
)
def test_two_pascals_are_doubted(call, what: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.warns(UnitWarning, match=rf"^{what} {TOLD}") as caught:
        call()
    assert caught[0].filename == __file__


RESTING = {"valve_command": np.full(9, 5.0), "muscle_pressure": np.zeros(9)}


@pytest.mark.parametrize(
    "call",
    [
        lambda: pamrs.simulate(SHOULDER, RESTING["valve_command"], sample_time=5),
        lambda: pamrs.simulate_batch(SHOULDER, RESTING["valve_command"], sample_time=5, n=2),
        lambda: pamrs.Simulator(SHOULDER, sample_time=5),
        lambda: pamrs.Batch(SHOULDER, n=2, sample_time=5),
        lambda: pamrs.Case.from_arrays(SHOULDER, {"run": RESTING}, sample_time=5),
    ],
)
def test_five_seconds_ask_for_milliseconds(call) -> None:  # type: ignore[no-untyped-def]
    with pytest.warns(
        UnitWarning, match=r"^sample_time = 5 s: are milli.* 5 ms is 0\.005"
    ) as caught:
        call()
    assert caught[0].filename == __file__


@pytest.mark.parametrize(
    ("call", "shown"),
    [
        (lambda angle: SHOULDER.muscle.replace(braid_angle=np.radians(angle)), "0.287979 rad"),
        (lambda angle: SHOULDER.muscle.replace(braid_angle=angle), "16.5 rad"),
        (
            lambda angle: SHOULDER.with_parameters({"muscle.braid_angle": np.radians(angle)}),
            "0.287979 rad",
        ),
        (
            lambda angle: parse_rig(
                pamrs.rigs.template().replace("value = 73.5, ", f"value = {angle}, ")
            ),
            "16.5 deg",
        ),
    ],
)
def test_a_braid_angle_from_the_axis_is_asked_from_the_circumference(call, shown) -> None:  # type: ignore[no-untyped-def]
    asked = rf"braid_angle = {shown} .*, measured from the circumference; 73\.5 deg\?$"
    with pytest.raises(PamrsError, match=asked):
        call(16.5)
    call(73.5 if "deg" in shown or shown.startswith("0") else np.radians(73.5))


def test_degrees_where_radians_are_wanted_are_asked_for() -> None:
    for name, degrees in (("muscle.braid_angle", 73.5), ("joint.rest_angle", 15.0)):
        with pytest.raises(ParameterError, match=rf"{degrees:g} rad is not .*; {degrees:g} deg\?$"):
            SHOULDER.with_parameters({name: degrees})


def test_a_length_where_a_contraction_is_wanted_is_doubted() -> None:
    muscle = pamrs.rigs.shoulder().muscle  # of 276 mm
    with pytest.warns(UnitWarning, match=r"^contraction = 0\.27 .* or length=") as caught:
        muscle.force(4e5, 0.27)
    assert caught[0].filename == __file__
    with pytest.raises(ParameterError, match="contraction_ratio = 270"):
        muscle.force(4e5, 270)  # millimetres
    long = muscle.replace(rest_length=0.5)
    with pytest.raises(ParameterError, match=r"contraction_ratio = 0\.45"):
        long.force(4e5, 0.45)


def test_a_length_is_taken_where_it_is_called_so() -> None:
    muscle = pamrs.rigs.shoulder().muscle
    rest = muscle.parameters["rest_length"]
    length = np.array([rest, 0.9 * rest])
    for force in (muscle.force, muscle.force_table):
        assert np.array_equal(force(4e5, length=length), force(4e5, 1.0 - length / rest))
        for given in ({}, {"contraction": 0.1, "length": length}):
            with pytest.raises(ParameterError, match="contraction or length, one of the two"):
                force(4e5, **given)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: pamrs.Joint(kind="pulley", radius=30), "joint.radius = 30"),
        (
            lambda: pamrs.rigs.shoulder().with_parameters({"muscle.rest_length": 276}),
            "muscle.rest_length = 276 m",
        ),
        (
            lambda: pamrs.simulate(
                pamrs.rigs.bench(), sample_time=0.01, length=[270] * 9, pressure=[2e5] * 9
            ),
            r"length\[0\] = 270",
        ),
        (
            lambda: pamrs.simulate(
                pamrs.rigs.shoulder(),
                5.0,
                sample_time=0.01,
                duration=0.1,
                initial={"joint_angle": 45},
            ),
            "initial.joint_angle = 45",
        ),
    ],
)
def test_millimetres_and_degrees_are_refused(call, said: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ParameterError, match=said):
        call()


def test_what_a_sensor_reads_and_what_the_package_asks_is_not_doubted() -> None:
    rig = pamrs.rigs.shoulder()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        start = {"muscle_pressure": 12.3456}
        pamrs.simulate(rig, 5.0, sample_time=0.01, duration=0.1, initial=start)
        free_contraction(rig.muscle, 4e5)
        rig.muscle.force(0.0, 0.05)
        rig.muscle.force([1.0, 2e5], 0.05)
        pamrs.Joint(kind="pulley", radius=0.03).torque(rig.muscle, [0.0, 2e5], 0.5)
        pamrs.simulate(pamrs.rigs.sealed_chamber(), sample_time=60.0, duration=600.0)  # a leak
