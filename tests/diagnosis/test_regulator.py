"""A regulator with a dead time and limits: as its reference, and diagnosed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.control.linear import linearise
from pamrs.errors import DiagnosisError, ParameterError
from pamrs.recordings import Recording
from pamrs.rig import Rig, parse_rig
from tests.diagnosis.noisy import noisy
from tests.tables import text_of

NOISE = {"supply_pressure": 400.0, "muscle_pressure": 400.0}
TEXT = text_of(__file__, "regulated_limits")


def recorded(rig: Rig, role: str, seed: int) -> Recording:
    """Eight seconds at 200 Hz of steps of the set pressure."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 8.0, 0.005)
    levels = np.concatenate([[0.5e5], rng.uniform(0.5e5, 6e5, 15)])  # at rest before the log
    command = levels[(time / 0.5).astype(int)]
    run = pamrs.simulate(rig, supply_command=command, sample_time=0.005)
    channels = {"supply_command": command}
    channels |= {name: run[name] for name in NOISE}
    return noisy(f"r{seed}", role, 0.005, channels, NOISE, [1, seed])


def diagnosed(**true: float) -> pamrs.Diagnosis:
    nominal = parse_rig(TEXT)
    rig = nominal.with_parameters({f"supply.{name}": value for name, value in true.items()})
    roles = ("fit", "fit", "held_out")
    recordings = [recorded(rig, role, seed) for seed, role in enumerate(roles)]
    return pamrs.diagnose(pamrs.Case("case", nominal, recordings, Path()))


def test_the_outlet_waits_and_then_rises_and_falls_within_its_limits() -> None:
    rig = parse_rig(TEXT).with_parameters({"supply.dead_time": 0.033})
    command = np.repeat([0.5e5, 6e5, 1e5], 100)
    outlet = pamrs.simulate(rig, supply_command=command, sample_time=0.01)["supply_pressure"]
    assert np.ptp(outlet[:104]) < 1.0
    rise = np.diff(outlet) / 0.01
    assert rise.max() == pytest.approx(2e6, rel=1e-9)
    assert rise.min() == pytest.approx(-3e6, rel=1e-9)
    assert outlet[104] - outlet[103] == pytest.approx(2e6 * 0.007, rel=1e-6)  # from 33 ms on
    assert outlet[199] == pytest.approx(6e5, rel=1e-3)


def test_until_the_first_command_arrives_it_holds_what_it_was_set_to() -> None:
    rig = parse_rig(TEXT).with_parameters({"supply.dead_time": 0.1})
    outlet = pamrs.simulate(rig, supply_command=np.full(40, 4e5), sample_time=0.01)
    assert np.ptp(outlet["supply_pressure"][:11]) < 1e-6
    assert outlet["supply_pressure"][20] > 1.5e5


def test_many_runs_give_what_single_ones_do() -> None:
    nominal = parse_rig(TEXT)
    late = np.array([0.0, 0.012, 0.04])
    command = np.repeat([0.5e5, 6e5], 20)
    values = {"supply.dead_time": late, "supply.rise_limit": np.array([1e12, 1e12, 1e6])}
    many = pamrs.simulate_batch(
        nominal,
        supply_command=np.tile(command, (3, 1)),
        parameters=values,
        sample_time=0.01,
        record=("muscle_pressure",),
    )
    for k in range(3):
        rig = nominal.with_parameters({name: float(v[k]) for name, v in values.items()})
        one = pamrs.simulate(rig, supply_command=command, sample_time=0.01)
        np.testing.assert_allclose(
            many["muscle_pressure"][k], one["muscle_pressure"], rtol=1e-9, atol=1e-3
        )


def test_a_healthy_regulator_misses_nothing() -> None:
    assert diagnosed().verdict == "none"


def test_a_longer_dead_time_is_told_but_not_from_another_clock() -> None:
    """Pressures that come later than commands come later by either: the data are the same."""
    found = diagnosed(dead_time=0.03)
    first, second, *_ = found.ambiguity
    assert {*first, *second} == {"supply.dead_time", "clock_skew"}
    odds = found.probabilities
    assert odds["supply.dead_time"] + odds["clock_skew"] > 0.85
    assert min(odds["supply.dead_time"], odds["clock_skew"]) > 0.2
    # 25 ms more than the file says, by each of the two that is listed
    late = [w["value"] - 0.005 for w in found.wrong_parameters]
    late += [e["parameters"]["offset"]["value"] for e in found.effects]
    assert late
    assert late == pytest.approx([0.025] * len(late), abs=5e-4)


def test_a_slower_rise_is_named() -> None:
    found = diagnosed(rise_limit=1.2e6)
    assert found.verdict == "parameters"
    (wrong,) = found.wrong_parameters
    assert wrong["name"] == "supply.rise_limit"
    assert wrong["value"] == pytest.approx(1.2e6, rel=0.02)


def test_the_gauge_is_compared_with_the_command() -> None:
    rig = parse_rig(TEXT)
    wrong = recorded(rig, "fit", 0)
    wrong.channels["supply_pressure"] *= 10.0
    with pytest.raises(DiagnosisError, match=r"the largest supply_command is 5\.\d+e\+05 Pa"):
        pamrs.diagnose(pamrs.Case("case", rig, [wrong], Path()))


def test_a_linear_model_refuses_a_dead_time() -> None:
    rig = pamrs.rigs.named("regulated_joint").with_parameters({"supply.dead_time": 0.03})
    with pytest.raises(ParameterError, match=r"supply\.dead_time = 0\.03 is not allowed"):
        linearise(rig, 0.7, held=())
