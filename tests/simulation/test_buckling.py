"""Muscles without pressure bow out: they push no more than their buckling load."""

from __future__ import annotations

import numpy as np
import pytest

import pamrs

PAIRS = ("pair_1", "pair_2", "pair_3")
STRUT = 1e9


def lifted(load: float, seconds: float = 20.0) -> pamrs.Simulation:
    """The first pair of the recruitment rig at 6 bar, the others vented."""
    values = {f"muscle.{pair}.buckling_load": load for pair in PAIRS}
    large = {"supply.initial_pressure": 6e5, "supply.volume": 5.0}
    rig = pamrs.rigs.recruitment().with_parameters(values | large)
    count = round(seconds / 0.01)
    command = dict(zip(PAIRS, (9.0, 1.0, 1.0), strict=True))
    return pamrs.simulate(
        rig,
        sample_time=0.01,
        valve_command={pair: np.full(count, volts) for pair, volts in command.items()},
    )


def test_muscles_without_air_do_not_hold_the_arm_down() -> None:
    slack, strut = lifted(3.5), lifted(STRUT)
    angle = {
        name: float(np.degrees(run["joint_angle.shoulder"][-1]))
        for name, run in (("slack", slack), ("strut", strut))
    }
    assert angle["slack"] > 95.0
    assert angle["strut"] < 60.0
    # no pair of two pushes more than twice the load; the pair with air pulls as it did
    for pair in PAIRS:
        assert float(np.min(slack[f"muscle_force.{pair}"])) >= -7.0 - 1e-9
    assert float(np.min(strut["muscle_force.pair_2"])) < -1000.0
    assert slack["muscle_force.pair_1"][0] == pytest.approx(
        strut["muscle_force.pair_1"][0], abs=1e-9
    )


def test_the_packaged_rig_has_muscles_that_bow_out() -> None:
    tables = pamrs.rigs.recruitment().tables("muscle")
    assert [tables[pair]["buckling_load"] for pair in PAIRS] == [3.5] * 3
    # where a file says nothing a muscle is a strut, as in the dissertation's force models
    assert pamrs.rigs.shoulder().tables("muscle")[""]["buckling_load"] == STRUT


@pytest.mark.parametrize("load", [0.0, -3.5, 2e9, float("nan")])
def test_a_load_that_cannot_be_is_named(load: float) -> None:
    with pytest.raises(pamrs.PamrsError, match="buckling_load"):
        pamrs.rigs.recruitment().with_parameters({"muscle.pair_1.buckling_load": load})


def test_a_batch_of_such_rigs_is_the_same_runs() -> None:
    rig = pamrs.rigs.recruitment()
    count = 200
    commands = {pair: np.full(count, volts) for pair, volts in zip(PAIRS, (6, 4, 4), strict=True)}
    payloads = np.array([0.0, 10.0])
    batch = pamrs.simulate_batch(
        rig,
        sample_time=0.01,
        valve_command=commands,
        parameters={"arm.payload": payloads},
        record=["joint_angle.shoulder"],
    )
    for row, payload in enumerate(payloads):
        alone = pamrs.simulate(
            rig.with_parameters({"arm.payload": float(payload)}),
            sample_time=0.01,
            valve_command=commands,
        )
        assert np.array_equal(batch["joint_angle.shoulder"][row], alone["joint_angle.shoulder"])
