"""A tube that holds gas and carries waves: laws, the reference, what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import pamrs
from pamrs.errors import PamrsError
from pamrs.rig import parse_rig
from tests.runs import Run, misses
from tests.simulation.refusals import refused

HEAD = """schema = "pamrs.rig/1"
name = "hose"
[gas]
"""


def chamber(name: str, litres: float, bar: float = 3.0) -> str:
    """An isothermal chamber."""
    return (
        f"[chamber.{name}]\n"
        f'dead_volume = {{ value = {litres}, unit = "l" }}\n'
        f'initial_pressure = {{ value = {bar}, unit = "bar" }}\n'
        'alpha_in = { value = 1, unit = "1" }\nalpha_out = { value = 1, unit = "1" }\n'
        'alpha = { value = 1, unit = "1" }\n'
    )


def hose(length: float, segments: int, ends: str = 'from = "a"\nto = "b"', more: str = "") -> str:
    """A tube of four millimetres."""
    return (
        f"[line]\n{ends}\n{more}\n"
        f'length = {{ value = {length}, unit = "m" }}\n'
        f'diameter = {{ value = 4, unit = "mm" }}\nsegments = {segments}\n'
    )


def closed(length: float, segments: int, more: str = "") -> pamrs.Rig:
    """A large volume, a tube, and next to nothing at its other end."""
    text = HEAD + chamber("a", 1e4) + chamber("b", 1e-6) + hose(length, segments, more=more)
    return parse_rig(text)


BALANCED = (
    '[chamber.b]\ndead_volume = { value = 0.2, unit = "l" }\ngas = "energy_balance"\n'
    'initial_pressure = { value = 1, unit = "bar" }\n'
)


@pytest.mark.parametrize("segments", [1, 6])
def test_what_alpha_makes_up_is_said_and_by_what(segments: int) -> None:
    """All along the tube, its inlet included: ``alpha R T`` for each kilogram in the place of ``R
    T``.
    """
    text = HEAD + FED["a valve"].replace("segments = 6", f"segments = {segments}") + BALANCED
    run = pamrs.simulate(parse_rig(text), 9.0, sample_time=0.002, duration=0.1)
    inside = [*run.under("line_mass").values(), *run.under("segment_mass").values()]
    gained = sum(float(mass[-1] - mass[0]) for mass in inside)
    assert gained > 2e-5
    assert run.balance.created == pytest.approx(0.4 * gained, rel=1e-9)
    assert run.balance.laws == ("line",)
    assert "line.alpha, the speed of sound" in str(run.balance)
    assert "energy_balance" not in str(run.balance)


def test_a_new_rig_has_an_energy_balance_in_its_chambers_and_its_own_alpha_along_the_tube() -> None:
    rig = parse_rig(pamrs.rigs.template("long_tube"))
    assert {table["gas"] for table in rig.tables("chamber").values()} == {"energy_balance"}
    assert rig.parameter("line.alpha").tol == 0.02
    isothermal = rig.with_parameters({"line.alpha": 1.0})
    run = pamrs.simulate(isothermal, sample_time=0.002, duration=0.5)
    moved = np.ptp(run["air_mass.left"])
    assert abs(run.balance.residual) < 1e-9 * moved
    assert abs(run.balance.created) < 1e-9 * moved


FED = {
    "a valve": (
        '[supply]\nkind = "constant"\ninitial_pressure = { value = 6, unit = "bar" }\n'
        '[valve]\ndischarge_area_max = { value = 2, unit = "mm2" }\n'
        'null_voltage = { value = 5, unit = "V" }\nhalf_range = { value = 5, unit = "V" }\n'
        "area_fraction = { opening = [0, 1], fraction = [0, 1] }\n"
        + hose(4.0, 6, 'to = "b"', "inlet_volume = { value = 2, unit = 'cm3' }")
    ),
    "a regulator": (
        '[supply]\nkind = "regulator"\ninitial_pressure = { value = 1, unit = "bar" }\n'
        + hose(4.0, 6, 'from = "supply"\nto = "b"')
    ),
    "a chamber": chamber("a", 0.2, 2.5) + hose(4.0, 1) + "",
}


#: Pressures between the segments and flows through them: no rest, and one against the arrow.
FLOWING = {
    "a valve": {
        "line_pressure": 2.5e5,
        **{f"segment_pressure.{k}": 2.5e5 - 2e4 * k for k in range(1, 6)},
        **{f"segment_flow.{k}": 1e-3 - 1e-4 * k for k in range(1, 7)},
    },
    "a regulator": {
        **{f"segment_pressure.{k}": 1e5 + 3e3 * k for k in range(1, 6)},
        **{f"segment_flow.{k}": -2e-4 for k in range(1, 7)},
    },
    "a chamber": {"segment_flow.1": 8e-4},
}


@pytest.mark.parametrize("fed", FED)
def test_every_channel_is_that_of_the_reference(fed: str) -> None:
    rig = parse_rig(HEAD + FED[fed] + chamber("b", 0.2, 1.0))
    wave = np.sin(0.3 * np.arange(41))
    volts, pressures = {"valve_command": 5.0 + 2.0 * wave}, {"supply_command": 1e5 + 5e4 * wave}
    driven = {"a valve": volts, "a regulator": pressures}.get(fed, {})
    run = Run(rig, 0.005, 41, FLOWING[fed], driven)
    found = misses(run.core(2e-5), run.reference(1e-11))
    assert max(found.values()) < 2e-6, found


def test_states_along_it_have_names() -> None:
    rig = closed(2.0, 3)
    names = pamrs.simulation.initial_names(rig)
    flows = [f"segment_flow.{k}" for k in (1, 2, 3)]
    along = [name for name in names if name.startswith("segment")]
    assert along == ["segment_pressure.1", "segment_pressure.2", *flows]

    def begun(rig: pamrs.Rig, initial: dict[str, float]) -> pamrs.Simulation:
        return pamrs.simulate(rig, sample_time=1e-3, duration=0.01, initial=initial)

    assert begun(rig, dict.fromkeys(flows, 1e-4))["segment_flow.2"][0] == 1e-4
    refused(
        (r"segment_pressure\.2", lambda: begun(rig, {"segment_pressure.3": 1e5})),
        (r"segment_flow\.3", lambda: begun(rig, {"segment_flow": 1e5})),
        (r"segment_flow\.1", lambda: begun(rig, {"segment_flow.1": 100.0})),
        ("no tube", lambda: begun(pamrs.rigs.named("tube"), {"segment_flow.1": 0.0})),
        by=PamrsError,
    )


TWO = HEAD + chamber("a", 1.0) + chamber("b", 1.0)
ORIFICE = (
    '[line]\nkind = "orifice"\nfrom = "a"\nto = "b"\nsegments = 4\n'
    'discharge_area = { value = 1, unit = "mm2" }\n'
)


@pytest.mark.parametrize(
    ("segments", "told"),
    [
        ("2.5", "whole number"),
        ("-1", "segments"),
        ("1000", "segments"),
        ('{ value = 4, unit = "m" }', "segments"),
        ('{ value = 4, unit = "1", tol = 1 }', r"line\.segments\.tol is not allowed"),
        ('{ value = 4, unit = "1", unknown = true }', r"line\.segments\.unknown is not allowed"),
    ],
)
def test_segments_are_a_small_whole_number_of_a_tube(segments: str, told: str) -> None:
    text = TWO + hose(2.0, 4).replace("segments = 4", f"segments = {segments}")
    refused((told, lambda: parse_rig(text)), by=PamrsError)
    refused(("segments", lambda: parse_rig(TWO + ORIFICE)), by=PamrsError)


@pytest.mark.parametrize(
    "segments", ["", "segments = 0\n", 'segments = { value = 0, unit = "1" }\n']
)
def test_alpha_is_that_of_segments(segments: str) -> None:
    """Without them it would do nothing, and a tolerance of it would be fitted in vain."""
    text = TWO + hose(2.0, 4)
    alpha = 'alpha = { value = 1.2, unit = "1", tol = 0.1 }\n'
    with_none = text.replace("segments = 4\n", segments)
    plain = parse_rig(with_none)
    assert "line.alpha" not in plain.parameters
    refused(
        (r"line\.alpha is not allowed without segments", lambda: parse_rig(with_none + alpha)),
        (r"no parameter 'line\.alpha'", lambda: plain.with_parameters({"line.alpha": 1.2})),
        by=PamrsError,
    )
    assert parse_rig(text + alpha).parameter("line.alpha").tol == 0.1


def test_alpha_comes_and_goes_with_segments() -> None:
    rig = pamrs.rigs.named("long_tube")
    none = rig.with_parameters({"line.segments": 0})
    assert "line.alpha" not in none.parameters
    assert "alpha    =" not in none.to_toml_text()
    assert parse_rig(none.to_toml_text()).model == none.model
    again = none.with_parameters({"line.alpha": 1.2, "line.segments": 8})
    assert again.parameter("line.alpha").value == 1.2
    assert again.parameter("line.alpha").tol == 0.0
    assert none.with_parameters({"line.segments": 8}).parameter("line.alpha").value == 1.4
    assert rig.with_parameters({"line.segments": 8}).parameter("line.alpha").tol == 0.02


def test_a_tube_without_segments_is_told_nothing_of_them() -> None:
    """Its description for the core, and all that is kept by it, are what they were."""
    assert "segments" not in pamrs.rigs.named("tube").to_json()
    assert '"segments": 16' in pamrs.rigs.named("long_tube").to_json()
