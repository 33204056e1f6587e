"""A regulator behind a bottle: what it gives, what is drawn, and a leak of the bottle."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import pamrs
from pamrs.control.linear import linearise
from pamrs.errors import DiagnosisError, ParameterError
from pamrs.experiments import library
from pamrs.recordings import Recording
from pamrs.rig import Rig, parse_rig
from tests.diagnosis.asked import SETTINGS, blocks_of, diagnosed
from tests.diagnosis.noisy import driven
from tests.tables import text_of

BOTTLE, OUTLET = "supply_pressure.bottle", "supply_pressure.regulator"
NOISE = {BOTTLE: 400.0, OUTLET: 400.0, "muscle_pressure": 400.0}
TEXT = text_of(__file__, "bottled")
RIG = parse_rig(TEXT)

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
    commands = {"valve_command": volts, "supply_command.regulator": set_to}
    noise = {name: level for name, level in NOISE.items() if name not in left_out}
    return driven(rig, f"r{seed}", role, 0.005, commands, noise, [2, seed])


def found_in(rig: Rig, *left_out: str) -> pamrs.Diagnosis:
    """What is missing in the file of the bottle's rig."""
    return diagnosed(RIG, partial(recorded, rig, left_out=left_out))


def test_a_small_bottle_empties_and_the_outlet_falls_with_it() -> None:
    rig = RIG.with_parameters({"supply.bottle.volume": 5e-4})
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
    commands = ("valve_command", "supply_command.regulator")

    def drives(*gauges: str) -> dict[str, set[str]]:
        blocks = blocks_of(RIG, (*commands, "muscle_pressure", *gauges))
        return {name: set(block.drives) for name, block in blocks.items()}

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
    found = found_in(RIG, *left_out)
    assert found.verdict == "none"
    assert not any("in front of it" in text for text in found.warnings)


def test_a_bottle_without_a_gauge_is_said_to_stay_as_it_was() -> None:
    found = found_in(RIG, BOTTLE)
    (said,) = [text for text in found.warnings if "in front of it" in text]
    assert said.startswith(f"{BOTTLE} was not recorded: supply.regulator is taken to have")


def test_a_line_at_the_regulator_does_not_tell_what_is_drawn() -> None:
    """The noise of two gauges goes both ways through it: a healthy rig would seem to leak."""
    rig, start = parse_rig(LINED), {"muscle_pressure": 4e5}

    def lined(role: str, seed: int) -> Recording:
        levels = np.random.default_rng(seed).uniform(1e5, 6e5, 31)
        set_to = {"supply_command.regulator": np.concatenate([[4e5], levels]).repeat(100)}
        return driven(rig, f"r{seed}", role, 0.005, set_to, NOISE, [2, seed], initial=start)

    blocks = blocks_of(rig, ("supply_command.regulator", *NOISE))
    assert list(blocks) == ["supply.regulator", "chamber"]
    assert diagnosed(rig, lined).verdict == "none"


@pytest.mark.slow
def test_a_leak_of_the_bottle_is_named() -> None:
    found = found_in(RIG.with_effect("supply_leak", {"conductance": 3e-11}, at="bottle"))
    assert found.verdict == "effects"
    (effect,) = found.effects
    assert (effect["id"], effect["at"]) == ("supply_leak", "bottle")
    assert effect["parameters"]["conductance"]["value"] == pytest.approx(3e-11, rel=0.15)


def test_a_command_above_the_bottle_is_no_error_of_units() -> None:
    """Set to 60 bar it is wide open; an outlet above its bottle is two columns swapped."""
    right = recorded(RIG, "fit", 0)
    volts = right.channels["valve_command"]
    commands = {"valve_command": volts, "supply_command.regulator": np.full_like(volts, 60e5)}
    wide = driven(RIG, "wide", "fit", 0.005, commands, NOISE, [3, 0])
    assert diagnosed(RIG, lambda *_: wide, ("fit",)).verdict == "none"
    swapped = {BOTTLE: right.channels[OUTLET], OUTLET: right.channels[BOTTLE]}
    wrong = replace(right, channels=right.channels | swapped)
    with pytest.raises(DiagnosisError, match=r"supply_pressure\.regulator is above .*\.bottle"):
        diagnosed(RIG, lambda *_: wrong, ("fit",))


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
