"""Spools of valves and a regulator's dead band, diagnosed: what of them is wrong is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.fit import fits
from pamrs.recordings import Recording
from pamrs.rig import Rig, parse_rig
from tests.diagnosis import test_regulator
from tests.diagnosis.noisy import noisy
from tests.simulation.test_spools import PAIR, SPRUNG

ROLES = ("fit", "fit", "held_out")


def recorded(rig: Rig, role: str, seed: int) -> Recording:
    """Eight seconds at 200 Hz of commands that are held for some samples."""
    rng = np.random.default_rng([7, seed])
    names = list(rig.tables("valve"))
    table = rig.tables("valve")[names[0]]
    low = -1.0 if table["spool"] == "second_order" else 0.0
    volts = {}
    for name in names:
        share = np.repeat(rng.uniform(low, 1.0, 80), 20)
        volts[name] = table["null_voltage"] + table["half_range"] * share
    run = pamrs.simulate(rig, volts, sample_time=0.005)
    channels = {f"valve_command.{n}" if n else "valve_command": v for n, v in volts.items()}
    noise = {"muscle_pressure": 300.0}
    channels["muscle_pressure"] = run["muscle_pressure"]
    return noisy(f"r{seed}", role, 0.005, channels, noise, [2, seed])


def diagnosed(text: str, **true: float) -> pamrs.Diagnosis:
    nominal = parse_rig(text)
    rig = nominal.with_parameters({k.replace("__", "."): v for k, v in true.items()})
    recordings = [recorded(rig, role, seed) for seed, role in enumerate(ROLES)]
    return pamrs.diagnose(pamrs.Case("case", nominal, recordings, Path()))


def test_a_healthy_spool_misses_nothing() -> None:
    assert diagnosed(SPRUNG).verdict == "none"


@pytest.mark.slow
def test_a_slower_spool_is_named() -> None:
    found = diagnosed(SPRUNG, valve__natural_frequency=15.0)
    assert found.verdict == "parameters"
    (wrong,) = found.wrong_parameters
    assert wrong["name"] == "valve.natural_frequency"
    assert wrong["value"] == pytest.approx(15.0, rel=0.05)


def test_healthy_pulsed_valves_miss_nothing() -> None:
    assert diagnosed(PAIR).verdict == "none"


@pytest.mark.slow
def test_a_valve_that_closes_late_is_named() -> None:
    found = diagnosed(PAIR, valve__fill__closing_delay=4e-3)
    assert found.verdict == "parameters"
    (wrong,) = found.wrong_parameters
    assert wrong["name"] == "valve.fill.closing_delay"
    assert wrong["value"] == pytest.approx(4e-3, rel=0.1)


def banded(tol: float) -> Rig:
    """The regulator with a dead band that is known so well."""
    line = f'dead_band = {{ value = 10, unit = "kPa", tol = {tol} }}\n[line]'
    return parse_rig(test_regulator.TEXT.replace("[line]", line))


def test_a_dead_band_is_fitted_where_it_has_a_tolerance() -> None:
    nominal = banded(2.0)
    rig = nominal.with_parameters({"supply.dead_band": 3e4})
    recordings = [test_regulator.recorded(rig, role, seed) for seed, role in enumerate(ROLES)]
    found = pamrs.diagnose(pamrs.Case("case", nominal, recordings, Path()))
    assert found.verdict == "parameters"
    (wrong,) = found.wrong_parameters
    assert wrong["name"] == "supply.dead_band"
    assert wrong["value"] == pytest.approx(3e4, rel=0.05)
    assert "supply_regulator_deadband" not in found.probabilities


def test_where_it_has_a_tolerance_the_effect_is_not_looked_for() -> None:
    assert not fits(banded(2.0), "supply_regulator_deadband")
    assert fits(banded(0.0), "supply_regulator_deadband")
    named = pamrs.rigs.named("regulated_joint").to_toml_text(comments=False)
    named = named.replace("[supply]", "[supply.main]").replace(
        "dead_band = { value = 0.0", "dead_band = { value = 5e3"
    )
    loose = named.replace('5e3, unit = "Pa" }', '5e3, unit = "Pa", tol = 1e3 }')
    assert named != loose
    assert fits(parse_rig(named), "supply_regulator_deadband")
    assert not fits(parse_rig(loose), "supply_regulator_deadband")
