"""Linear loads: a muscle on a load frame, and one that carries a mass."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.report.motion import write_channels
from pamrs.rig import parse_rig
from tests.simulation.refusals import refused
from tests.tables import rows_of, text_of

MASS = text_of(__file__, "hanging")


def muscle() -> pamrs.Muscle:
    found = pamrs.rigs.shoulder().muscle
    assert found is not None
    return found.replace(count=1, friction_coefficient=0.1, friction_presliding=5e-4)


def test_a_bench_measures_the_force_of_its_muscle_in_both_directions() -> None:
    rig = pamrs.rigs.bench(muscle())
    there = np.linspace(0.276, 0.22, 201)
    length = np.concatenate([there, there[::-1][1:]])
    run = pamrs.simulate(rig, sample_time=0.01, length=length, pressure=np.full(length.size, 4e5))
    np.testing.assert_allclose(run["length"], length, rtol=1e-12)
    np.testing.assert_allclose(run["muscle_pressure"], 4e5, rtol=1e-12)
    e = 1.0 - length / 0.276
    for rows, way in ((slice(20, 201), -1.0), (slice(221, 401), 1.0)):
        pull = muscle().force(4e5, e[rows], direction=way)
        np.testing.assert_allclose(run["muscle_force"][rows], pull, rtol=1e-8)


def test_a_shut_chamber_on_the_frame_follows_its_volume() -> None:
    rig = pamrs.rigs.bench(muscle())
    length = np.linspace(0.27, 0.24, 101)
    run = pamrs.simulate(rig, sample_time=0.01, length=length, initial={"muscle_pressure": 3e5})
    absolute = run["muscle_pressure"] + 101325.0
    constant = absolute * run["air_volume"] ** rig.model["chamber"]["alpha"]
    np.testing.assert_allclose(constant, constant[0], rtol=1e-7)


def test_a_mass_can_be_raised_by_a_pressure_that_is_given() -> None:
    rig = parse_rig(MASS)
    pressure = np.linspace(2e5, 6e5, 1001)
    run = pamrs.simulate(rig, sample_time=0.01, pressure=pressure, initial={"length": 0.262})
    np.testing.assert_allclose(run["muscle_pressure"], pressure, rtol=1e-12)
    assert run["length"][-1] < run["length"][200] - 0.01


@pytest.mark.parametrize(
    ("arguments", "message"),
    rows_of(__file__, "what_a_frame_cannot_do_is_named"),
)
def test_what_a_frame_cannot_do_is_named(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(pamrs.PamrsError, match=message):
        pamrs.simulate(pamrs.rigs.bench(muscle()), sample_time=0.01, **arguments)  # type: ignore[arg-type]


def test_only_a_frame_takes_a_length_and_no_valve_a_pressure() -> None:
    arm, sealed = pamrs.rigs.shoulder(), pamrs.rigs.sealed_chamber()
    short = {"length": [0.27, 0.26], "sample_time": 0.01}
    pushed = {"pressure": [0.0, 1e5], "sample_time": 0.01}
    bench, other = pamrs.rigs.bench(muscle()), {"initial": {"length": [0.27, 0.25]}}
    # the row whose initial length is not that of the frame
    told = r"= 0\.25 does .* length\[0\] = 0\.27 of row 1"
    refused(
        ("only a rig with a load frame", lambda: pamrs.simulate(sealed, **short)),
        (r"without \[valve\]", lambda: pamrs.simulate(arm, [5.0, 5.0], **pushed)),
        (told, lambda: pamrs.simulate_batch(bench, **short, **other)),
        by=pamrs.PamrsError,
    )


@pytest.mark.parametrize(
    ("old", "new", "message"),
    rows_of(__file__, "loads_that_cannot_be_are_named"),
)
def test_loads_that_cannot_be_are_named(old: str, new: str, message: str) -> None:
    with pytest.raises(pamrs.RigError, match=message):
        parse_rig(MASS.replace(old, new))


def test_a_load_and_a_joint_exclude_each_other() -> None:
    bench, arm = (rig.to_toml_text() for rig in (pamrs.rigs.bench(muscle()), pamrs.rigs.shoulder()))
    load = bench[bench.index("\n[load]") :].split("\n\n")[0]
    with pytest.raises(pamrs.RigError, match=r"\[load\] does not go with \[joint\] and \[arm\]"):
        parse_rig(arm + load)


def test_air_of_a_regulator_that_is_then_shut_is_at_room_temperature() -> None:
    rig = pamrs.rigs.bench(muscle()).with_effect("heat_transfer")
    one = pamrs.Simulator(rig, sample_time=0.01, initial={"length": 0.26})
    for k in range(100):
        sample = one.step(length=0.26, pressure=6e3 * (k + 1))
    assert sample["temperature"] == pytest.approx(293.15)
    shut = one.step(length=0.26)
    assert shut["muscle_pressure"] == pytest.approx(6e5, rel=1e-6)


def test_a_bench_round_trips() -> None:
    rig = pamrs.rigs.bench(muscle().replace(count=6))
    assert parse_rig(rig.to_toml_text()).model == rig.model
    assert rig.model["muscle"]["count"] == 1


def test_pictures_of_a_bench_and_of_nothing_that_moves(tmp_path: Path) -> None:
    rig = pamrs.rigs.bench(muscle())
    for run in (
        pamrs.simulate(rig, sample_time=0.01, length=[0.27, 0.26, 0.25], pressure=[1e5] * 3),
        pamrs.simulate(rig, sample_time=0.01, length=[0.27, 0.27], pressure=[1e5] * 2),
        pamrs.simulate(pamrs.rigs.sealed_chamber(), sample_time=0.1, duration=0.0),
    ):
        assert write_channels(run, tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")
