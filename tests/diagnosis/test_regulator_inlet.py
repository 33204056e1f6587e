"""A regulator behind a bottle: what it gives, what is drawn, and a leak of the bottle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.control.linear import linearise
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.prepare import available_blocks
from pamrs.errors import DiagnosisError, ParameterError
from pamrs.experiments import library
from pamrs.recordings import Recording
from pamrs.rig import Rig, parse_rig
from tests.diagnosis.noisy import noisy
from tests.tables import text_of

SETTINGS = DiagnosisSettings()
BOTTLE, OUTLET = "supply_pressure.bottle", "supply_pressure.regulator"
NOISE = {BOTTLE: 400.0, OUTLET: 400.0, "muscle_pressure": 400.0}
TEXT = text_of(__file__, "bottled")

LINED = (
    TEXT.partition("[valve]")[0]
    + """
[line]
kind     = "tube"
length   = { value = 2.0, unit = "m", tol = 0.02 }
diameter = { value = 4.0, unit = "mm", tol = 0.05 }
[chamber]"""
    + TEXT.split("[chamber]")[1]
)


def recorded(rig: Rig, role: str, seed: int, left_out: tuple[str, ...] = ()) -> Recording:
    """Sixteen seconds at 200 Hz of steps of the set pressure and of the valve."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 16.0, 0.005)
    set_to = np.concatenate([[4e5], rng.uniform(3e5, 6e5, 7)])[(time / 2.0).astype(int)]
    volts = 5.0 + rng.uniform(-4.0, 4.0, 40)[(time / 0.4).astype(int)]
    run = pamrs.simulate(
        rig, valve_command=volts, supply_command={"regulator": set_to}, sample_time=0.005
    )
    channels = {"valve_command": volts, "supply_command.regulator": set_to}
    channels |= {name: run[name] for name in NOISE if name not in left_out}
    noise = {name: level for name, level in NOISE.items() if name in channels}
    return noisy(f"r{seed}", role, 0.005, channels, noise, [2, seed])


def diagnosed(rig: Rig, *left_out: str) -> pamrs.Diagnosis:
    roles = ("fit", "fit", "held_out")
    recordings = [recorded(rig, role, seed, left_out) for seed, role in enumerate(roles)]
    return pamrs.diagnose(pamrs.Case("case", parse_rig(TEXT), recordings, Path()))


def leaking(conductance: float) -> Rig:
    """The bottle with a leak."""
    entry = f"""
[[effects]]
id = "supply_leak"
at = "bottle"
parameters = {{ conductance = {{ value = {conductance!r}, unit = "m3/(s Pa)" }} }}
"""
    return parse_rig(TEXT + entry)


def test_a_small_bottle_empties_and_the_outlet_falls_with_it() -> None:
    rig = parse_rig(TEXT).with_parameters({"supply.bottle.volume": 5e-4})
    run = pamrs.simulate(
        rig,
        valve_command=np.tile(np.repeat([9.0, 1.0], 100), 10),
        supply_command={"regulator": np.full(2000, 6e5)},
        sample_time=0.01,
    )
    bottle, outlet = run[BOTTLE], run[OUTLET]
    assert bottle[-1] < 2e5
    assert outlet[-1] == pytest.approx(bottle[-1], abs=2e3)
    assert outlet[90] == pytest.approx(6e5, rel=1e-3)  # as long as the bottle has more
    lost = (bottle[0] - bottle) * 5e-4 / (287.05 * 293.15)
    np.testing.assert_allclose(run["mass_supplied"], lost, rtol=1e-6, atol=1e-12)
    assert abs(run.balance.residual) < 1e-12


def test_each_block_is_driven_by_what_stands_next_to_it() -> None:
    rig = parse_rig(TEXT)
    commands = ("valve_command", "supply_command.regulator")

    def drives(*gauges: str) -> dict[str, set[str]]:
        have = (*commands, "muscle_pressure", *gauges)
        return {block.name: set(block.drives) for block in available_blocks(rig, have)}

    every = drives(BOTTLE, OUTLET)
    assert every == {
        "supply.bottle": {OUTLET, "muscle_pressure", "valve_command"},
        "supply.regulator": {BOTTLE, "muscle_pressure", *commands},
        "chamber": {OUTLET, "valve_command"},
    }
    assert drives(BOTTLE) == {
        "supply.bottle": {"muscle_pressure", *commands},
        "chamber": {BOTTLE, *commands},
    }
    assert drives(OUTLET)["supply.regulator"] == {"muscle_pressure", *commands}
    assert drives() == {"chamber": set(commands)}


@pytest.mark.parametrize("left_out", [(), (OUTLET,)], ids=["three_gauges", "no_outlet"])
def test_a_healthy_bottle_and_regulator_miss_nothing(left_out: tuple[str, ...]) -> None:
    found = diagnosed(parse_rig(TEXT), *left_out)
    assert found.verdict == "none"
    assert not any("in front of it" in text for text in found.warnings)


def test_a_bottle_without_a_gauge_is_said_to_stay_as_it_was() -> None:
    found = diagnosed(parse_rig(TEXT), BOTTLE)
    (said,) = [text for text in found.warnings if "in front of it" in text]
    assert said.startswith(f"{BOTTLE} was not recorded: supply.regulator is taken to have")


def test_a_line_at_the_regulator_does_not_tell_what_is_drawn() -> None:
    """The noise of two gauges goes both ways through it: a healthy rig would seem to leak."""
    rig, recordings = parse_rig(LINED), []
    for seed, role in enumerate(("fit", "fit", "held_out")):
        rng, at = np.random.default_rng(seed), np.arange(3200) // 100
        set_to = np.concatenate([[4e5], rng.uniform(1e5, 6e5, 31)])[at]
        run = pamrs.simulate(
            rig,
            supply_command={"regulator": set_to},
            sample_time=0.005,
            initial={"muscle_pressure": 4e5},
        )
        channels = {"supply_command.regulator": set_to, **{name: run[name] for name in NOISE}}
        recordings.append(noisy(f"r{seed}", role, 0.005, channels, NOISE, [2, seed]))
    blocks = available_blocks(rig, tuple(channels))
    assert [block.name for block in blocks] == ["supply.regulator", "chamber"]
    assert pamrs.diagnose(pamrs.Case("case", rig, recordings, Path())).verdict == "none"


@pytest.mark.slow
def test_a_leak_of_the_bottle_is_named() -> None:
    found = diagnosed(leaking(3e-11))
    assert found.verdict == "effects"
    (effect,) = found.effects
    assert (effect["id"], effect["at"]) == ("supply_leak", "bottle")
    assert effect["parameters"]["conductance"]["value"] == pytest.approx(3e-11, rel=0.15)


def test_a_command_above_the_bottle_is_no_error_of_units() -> None:
    """Set to 60 bar it is wide open; an outlet above its bottle is two columns swapped."""
    rig = parse_rig(TEXT)
    recording = recorded(rig, "fit", 0)
    open_wide = np.full_like(recording.channels["valve_command"], 60e5)
    run = pamrs.simulate(
        rig,
        valve_command=recording.channels["valve_command"],
        supply_command={"regulator": open_wide},
        sample_time=0.005,
    )
    channels = {"valve_command": recording.channels["valve_command"]}
    channels |= {"supply_command.regulator": open_wide, **{name: run[name] for name in NOISE}}
    wide = noisy("wide", "fit", 0.005, channels, NOISE, [3, 0])
    case = pamrs.Case("case", rig, [wide], Path())
    assert pamrs.diagnose(case).verdict == "none"
    recording.channels[BOTTLE], recording.channels[OUTLET] = (
        recording.channels[OUTLET],
        recording.channels[BOTTLE],
    )
    with pytest.raises(DiagnosisError, match=r"supply_pressure\.regulator is above .*\.bottle"):
        pamrs.diagnose(pamrs.Case("case", rig, [recording], Path()))


def test_experiments_keep_below_the_bottle() -> None:
    rig = parse_rig(LINED + '[limits]\nmax_pressure = { value = 12, unit = "bar" }\n')
    proposed = library(rig, SETTINGS)
    assert proposed
    highest = max(float(np.max(one.command)) for one in proposed if one.command is not None)
    assert highest <= 0.8 * 9e5 + 1.0


def test_a_linear_model_has_the_bottle_as_a_state() -> None:
    rig = parse_rig(
        TEXT.replace("[0.0, 0.05, 1.0]", "[0.0, 0.5, 1.0]").replace("0.0, 0.0", "0, 0.5")
    )
    at = {"muscle_pressure": 2e5, OUTLET: 4e5}
    model = linearise(rig, initial=at, held=(), side="fill")
    bottle, outlet = model.states.index(BOTTLE), model.states.index(OUTLET)
    chamber = model.states.index("muscle_pressure")
    assert model.a[outlet].tolist() == pytest.approx([0.0, -1.0 / 0.08, 0.0])
    volt, command = (model.inputs.index(n) for n in ("valve_command", "supply_command.regulator"))
    assert model.b[outlet][command] == pytest.approx(1.0 / 0.08)
    # a volt of the valve takes from the bottle what it brings the chamber
    brought = model.b[chamber][volt] * 2e-4 / 1.3
    assert brought > 0.0
    assert model.b[bottle][volt] * 5e-3 == pytest.approx(-brought)
    # below the outlet the bottle is what it follows, and no command
    with pytest.raises(ParameterError, match=r"supply_command\.regulator moves nothing"):
        linearise(rig, initial={**at, BOTTLE: 3e5}, held=(), side="fill")
