"""Chambers with an energy balance: mass and energy are kept, and the limits are the known ones."""

from __future__ import annotations

import math

import numpy as np
import pytest

import pamrs
from pamrs.rig import parse_rig
from tests.runs import RUNS
from tests.simulation.refusals import refused

AMBIENT, TEMPERATURE, GAS_CONSTANT, KAPPA = 101325.0, 293.15, 287.05, 1.4

_GAS = """
[gas]
ambient_pressure = { value = 101325.0, unit = "Pa" }
temperature = { value = 293.15, unit = "K" }
"""


def _chamber(name: str, volume: float, pressure: float, wall: float) -> str:
    return f"""
[chamber.{name}]
gas = "energy_balance"
dead_volume = {{ value = {volume!r}, unit = "m3" }}
initial_pressure = {{ value = {pressure!r}, unit = "Pa" }}
heat_transfer_coefficient = {{ value = {wall!r}, unit = "W/(m2 K)" }}
"""


def _rig(*tables: str) -> pamrs.Rig:
    return parse_rig('schema = "pamrs.rig/1"\nname = "laws"\n' + _GAS + "".join(tables))


def _nozzle(source: str, target: str) -> str:
    return f"""
[line.nozzle]
kind = "orifice"
from = "{source}"
to = "{target}"
discharge_area = {{ value = 1.0, unit = "mm2" }}
"""


def _inner(run: pamrs.Simulation, name: str) -> np.ndarray:
    """Internal energy of a chamber, J."""
    absolute = run.under("muscle_pressure")[name] + AMBIENT
    return absolute * run.under("air_volume")[name] / (KAPPA - 1.0)


def test_filling_without_a_wall_is_adiabatic() -> None:
    """All enthalpy that comes in stays: `p2 = p1 + kappa R T0 m/V`, and an empty chamber would come
    to `kappa T0`.
    """
    supply = '[supply]\nkind = "constant"\ninitial_pressure = { value = 7.0, unit = "bar" }\n'
    rig = _rig(supply, _nozzle("supply", "chamber.a"), _chamber("a", 1e-3, -0.99e5, 0.0))
    run = pamrs.simulate(rig, sample_time=0.01, duration=4.0)
    more = run["air_mass.a"] - run["air_mass.a"][0]
    np.testing.assert_allclose(run["mass_supplied"], more, rtol=1e-12, atol=1e-15)
    wanted = run["muscle_pressure.a"][0] + KAPPA * GAS_CONSTANT * TEMPERATURE * more / 1e-3
    np.testing.assert_allclose(run["muscle_pressure.a"], wanted, rtol=1e-12)
    assert run["temperature.a"][-1] == pytest.approx(KAPPA * TEMPERATURE, rel=0.02)
    assert run.balance.heat == 0.0


def test_emptying_without_a_wall_is_isentropic() -> None:
    """`p/m^kappa` stays in what is left, and the flow falls as the gas cools."""
    rig = _rig(_nozzle("chamber.a", "ambient"), _chamber("a", 1e-4, 9e5, 0.0))
    run = pamrs.simulate(rig, sample_time=0.01, step=1e-4, duration=1.0)
    absolute, mass = run["muscle_pressure.a"] + AMBIENT, run["air_mass.a"]
    np.testing.assert_allclose(absolute / absolute[0], (mass / mass[0]) ** KAPPA, rtol=1e-9)
    # choked: dm/dt = -c m^((kappa+1)/2), the blow-down of textbooks
    psi = (2.0 / (KAPPA + 1.0)) ** (1.0 / (KAPPA - 1.0)) * math.sqrt(KAPPA / (KAPPA + 1.0))
    first = 1e-6 * absolute[0] * psi * math.sqrt(2.0 / (GAS_CONSTANT * TEMPERATURE))
    share = (KAPPA - 1.0) / 2.0
    wanted = mass[0] * (1.0 + share * first / mass[0] * run.time) ** (-1.0 / share)
    choked = AMBIENT / absolute < 0.5
    assert choked.sum() > 50
    np.testing.assert_allclose(mass[choked], wanted[choked], rtol=1e-9)
    assert run["temperature.a"].min() < 200.0


def test_two_chambers_keep_their_energy_and_mass() -> None:
    rig = _rig(
        _nozzle("chamber.a", "chamber.b"),
        _chamber("a", 1e-3, 6e5, 0.0),
        _chamber("b", 3e-3, 0.0, 0.0),
    )
    run = pamrs.simulate(rig, sample_time=0.01, duration=8.0)
    for whole in (_inner(run, "a") + _inner(run, "b"), run["air_mass.a"] + run["air_mass.b"]):
        np.testing.assert_allclose(whole, whole[0], rtol=1e-12)
    even = (6e5 * 1e-3) / 4e-3
    assert run["muscle_pressure.a"][-1] == pytest.approx(even, abs=20.0)
    # what came from the other one is not mixed back: the giver is cold, the taker hot
    assert run["temperature.a"][-1] < TEMPERATURE < run["temperature.b"][-1]


def test_a_strong_wall_makes_it_isothermal() -> None:
    still = _rig(_nozzle("chamber.a", "ambient"), _chamber("a", 1e-3, 9e5, 4e4))
    run = pamrs.simulate(still, sample_time=0.01, duration=1.0)
    assert np.abs(run["temperature.a"] - TEMPERATURE).max() < 1.0
    absolute = run["muscle_pressure.a"] + AMBIENT
    isothermal = run["air_mass.a"] * GAS_CONSTANT * TEMPERATURE / 1e-3
    np.testing.assert_allclose(absolute, isothermal, rtol=3e-3)


def _anew(name: str) -> pamrs.Rig:
    return parse_rig(pamrs.rigs.template(name))


@pytest.mark.parametrize(
    "name", ["shoulder", "antagonistic_joint", "two_joint_arm", "hanging_mass"]
)
def test_mass_and_energy_close_while_an_arm_moves(name: str) -> None:
    """A rig written anew: what it stores is what came in, to 1e-9 of what moved."""
    usual = RUNS[name]
    drive = {"sample_time": usual.sample_time, "initial": dict(usual.initial), **usual.keywords}
    run = pamrs.simulate(_anew(name), step=1e-4, **drive)
    balance = run.balance
    moved = balance.supplied + balance.vented + abs(balance.stored)
    assert abs(balance.residual) < 1e-9 * moved
    assert abs(balance.created) < 1e-9 * moved
    inner = sum(_inner(run, block) for block in run.under("air_volume"))
    gained = run["enthalpy_gained"] + run["heat_gained"] - run["gas_work"]
    gained = gained - gained[0]
    scale = float(np.abs(run["enthalpy_gained"]).max() + np.abs(run["gas_work"]).max())
    assert scale > 1.0
    np.testing.assert_allclose(inner - inner[0], gained, rtol=0.0, atol=1e-9 * scale)
    assert "heat from the walls" in str(balance)


def test_published_coefficients_make_air() -> None:
    """The same cycle with the coefficients of (3.17), which are the published option."""
    created = {}
    time = np.arange(0.0, 4.0, 0.005)
    command = np.where(time < 2.0, 5.5, 4.5)
    start = {"muscle_pressure": 1e5, "supply_pressure": 8e5}
    for gas in ("energy_balance", "coefficients"):
        rig = parse_rig(pamrs.rigs.template("shoulder", gas=gas))
        balance = pamrs.simulate(rig, command, sample_time=0.005, initial=start).balance
        created[gas] = balance.created / balance.supplied
    assert abs(created["energy_balance"]) < 1e-9
    assert created["coefficients"] > 0.2


def test_the_effect_is_not_needed_where_the_chamber_has_it() -> None:
    rig = _anew("shoulder")
    text = pamrs.rigs.template("shoulder").replace("dead_volume", "alpha = 1.2\ndead_volume", 1)
    refused(
        ("chamber of the kind coefficients", lambda: rig.with_effect("heat_transfer")),
        ("alpha is not allowed with 'energy_balance'", lambda: parse_rig(text)),
        ("gas = 'ideal'", lambda: pamrs.rigs.template(gas="ideal")),
        by=pamrs.PamrsError,
    )
