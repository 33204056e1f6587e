"""A leak that empties a chamber: its linear size falls short many times, in every form."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import pamrs
from tests.diagnosis.noisy import whole


def emptied(exponent: float) -> pamrs.Case:
    """A chamber at 6.3 bar that loses all of it through a crack in 138 s, at 10 Hz."""
    rig = pamrs.rigs.sealed_chamber()
    volume = rig.parameter("chamber.dead_volume").value
    values = {"conductance": 1.1e-6 * volume, "exponent": exponent}
    truth = rig.with_effect("leak_muscle", values, form="power")
    run = pamrs.simulate(
        truth, duration=138.0, sample_time=0.1, step=0.01, initial={"muscle_pressure": 6.3e5}
    )
    noise = np.random.default_rng(3).normal(0.0, 100.0, run.time.size)
    channels = {"muscle_pressure": run["muscle_pressure"] + noise}
    one = whole("hold", "fit", 0.1, channels)
    return pamrs.Case("emptied", rig, [one], Path())


def test_the_form_of_a_leak_that_empties_the_chamber_is_found() -> None:
    found = pamrs.diagnose(emptied(1.1))
    assert [(e.id, e.form) for e in found.effects] == [("leak_muscle", "power")]
    low, high = found.effects[0].parameters["exponent"].interval
    assert low <= 1.1 <= high
