"""A regulator whose outlet has no gauge: its command says what it does, and the muscle's gauge
judges regulator, line and chamber together.
"""

from __future__ import annotations

import numpy as np

import pamrs
from pamrs.diagnosis.fit import acts_in
from pamrs.effects import Term
from pamrs.simulation import core_rig
from tests.diagnosis.asked import blocks_of
from tests.diagnosis.stands import ONE_GAUGE

RIG = pamrs.rigs.named("regulated_joint")
DT = 0.005
CHANNELS = ("supply_command", *ONE_GAUGE)


def test_the_chamber_simulates_a_regulator_that_has_no_gauge() -> None:
    blocks = blocks_of(RIG, CHANNELS)
    assert set(blocks) == {"chamber", "arm"}
    assert blocks["chamber"].beside == ("supply",)
    assert blocks["chamber"].covers == "regulator, line and chamber"
    assert "supply.time_constant" in blocks["chamber"].parameters
    assert acts_in(Term("supply_regulator_deadband"), blocks["chamber"])
    assert not acts_in(Term("supply_regulator_deadband"), blocks["arm"])
    both = blocks_of(RIG, (*CHANNELS, "supply_pressure"))
    assert {name: b.beside for name, b in both.items()} == {"supply": (), "chamber": (), "arm": ()}


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
