"""A regulator whose outlet has no gauge: its command says what it does, and the muscle's gauge
judges regulator, line and chamber together.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.fit import acts_in
from pamrs.diagnosis.prepare import available_blocks
from pamrs.effects import Term
from pamrs.simulation import core_rig
from tests.diagnosis.noisy import noisy

SETTINGS = DiagnosisSettings()
RIG = pamrs.rigs.named("regulated_joint")
DT = 0.005
NOISE = {"muscle_pressure": 400.0, "joint_angle": 3e-4}
CHANNELS = ("supply_command", *NOISE)


def case(true: pamrs.Rig) -> pamrs.Case:
    """Waves and steps of the set pressure, without the supply's gauge."""
    found = []
    for k, (name, role) in enumerate((("a", "fit"), ("b", "fit"), ("c", "held_out"))):
        time = np.arange(0.0, 14.0, DT)
        command = (
            1.9e5
            + 0.7e5 * np.sin(2 * np.pi * (0.15 + 0.05 * k) * time)
            + 0.4e5 * np.sign(np.sin(2 * np.pi * 0.23 * time + k))
        )
        run = pamrs.simulate(true, supply_command=command, sample_time=DT)
        channels = {"supply_command": command} | {n: run[n] for n in NOISE}
        found.append(noisy(name, role, DT, channels, NOISE, [41, k]))
    return pamrs.Case("one gauge", RIG, found, Path())


def test_the_chamber_simulates_a_regulator_that_has_no_gauge() -> None:
    blocks = {b.name: b for b in available_blocks(RIG, CHANNELS)}
    assert set(blocks) == {"chamber", "arm"}
    assert blocks["chamber"].beside == ("supply",)
    assert blocks["chamber"].covers == "regulator, line and chamber"
    assert "supply.time_constant" in blocks["chamber"].parameters
    assert acts_in(Term("supply_regulator_deadband"), blocks["chamber"])
    assert not acts_in(Term("supply_regulator_deadband"), blocks["arm"])
    both = available_blocks(RIG, (*CHANNELS, "supply_pressure"))
    assert {b.name: b.beside for b in both} == {"supply": (), "chamber": (), "arm": ()}


def test_its_prediction_is_that_of_a_simulation() -> None:
    time = np.arange(0.0, 4.0, DT)
    command = 2e5 + 6e4 * np.sign(np.sin(3.0 * time))
    run = pamrs.simulate(
        RIG,
        supply_command=command,
        sample_time=DT,
        initial={"muscle_pressure": 1.5e5, "supply_pressure": 1.5e5},
    )
    signals = {
        name: (run[name], np.gradient(run[name], DT)) for name in ("muscle_pressure", "joint_angle")
    }
    found, slopes = core_rig(RIG).predict(
        "chamber",
        {"supply_command": command},
        DT,
        1e-3,
        [0],
        ["supply.time_constant"],
        signals,
        time.size,
    )
    np.testing.assert_allclose(found, run["muscle_pressure"], atol=150.0)
    assert slopes is not None
    assert np.abs(slopes[:, 0]).max() > 1e4  # the regulator's lag shows in the muscle


def test_a_true_model_misses_nothing() -> None:
    found = pamrs.diagnose(case(RIG))
    assert found.verdict in ("none", "parameters")
    assert not found.wrong_parameters


@pytest.mark.slow
def test_a_slow_regulator_is_a_wrong_value() -> None:
    found = pamrs.diagnose(case(RIG.with_parameters({"supply.time_constant": 0.25})))
    assert found.verdict == "parameters"
    (wrong,) = found.wrong_parameters
    assert wrong["name"] == "supply.time_constant"
    assert wrong["value"] == pytest.approx(0.25, rel=0.03)
