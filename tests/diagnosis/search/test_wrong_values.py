"""Stands of every kind: a right file misses nothing, and of a wrong one the value is named."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import pytest

import pamrs
from pamrs.diagnosis.fit import fits
from pamrs.recordings import Recording
from pamrs.rig import Rig, parse_rig
from tests.diagnosis.asked import diagnosed, names_value
from tests.diagnosis.stands import (
    ISO,
    LIMITED,
    MOUNTED,
    WALL,
    WARM,
    lifted,
    set_in_steps,
    set_in_waves,
    switched,
    vented,
)
from tests.simulation.test_spools import PAIR, SPRUNG


def banded(tol: float) -> Rig:
    """The regulator with a dead band that is known so well."""
    line = f'dead_band = {{ value = 10, unit = "kPa", tol = {tol} }}\n[line]'
    return parse_rig(LIMITED.replace("[line]", line))


STANDS: dict[str, tuple[Rig, Callable[[Rig, str, int], Recording]]] = {
    "conductances": (parse_rig(ISO), vented),
    "energy balance": (parse_rig(WARM), vented),
    "spring and tilted base": (MOUNTED, lifted),
    "spool": (parse_rig(SPRUNG), switched),
    "pulsed valves": (parse_rig(PAIR), switched),
    "regulator": (parse_rig(LIMITED), set_in_steps),
    "dead band": (banded(2.0), set_in_steps),
    "one gauge": (pamrs.rigs.regulated_joint(), set_in_waves),
}


@pytest.mark.parametrize("stand", STANDS)
def test_a_right_file_misses_nothing(stand: str) -> None:
    rig, make = STANDS[stand]
    assert diagnosed(rig, partial(make, rig)).verdict == "none"


def slow(*case: object) -> object:
    return pytest.param(*case, marks=pytest.mark.slow)


@pytest.mark.parametrize(
    ("stand", "name", "true", "rel"),
    [
        slow("conductances", "valve.vent_conductance", 3.9e-9, 0.03),
        slow("energy balance", WALL, 60.0, 0.05),
        slow("spring and tilted base", "joint.stiffness", 35.0, 0.1),
        slow("spring and tilted base", "arm.base_angle", math.radians(-20.0), 0.1),
        slow("spool", "valve.natural_frequency", 15.0, 0.05),
        slow("pulsed valves", "valve.fill.closing_delay", 4e-3, 0.1),
        ("regulator", "supply.rise_limit", 1.2e6, 0.02),
        ("dead band", "supply.dead_band", 3e4, 0.05),
        slow("one gauge", "supply.time_constant", 0.25, 0.03),
    ],
)
def test_a_wrong_value_is_named(stand: str, name: str, true: float, rel: float) -> None:
    rig, make = STANDS[stand]
    found = diagnosed(rig, partial(make, rig.with_parameters({name: true})))
    names_value(found, name, true, rel)
    assert "supply_regulator_deadband" not in found.probabilities or stand != "dead band"


def test_where_a_dead_band_has_a_tolerance_the_effect_is_not_looked_for() -> None:
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


def test_keys_of_two_laws_of_flow_are_not_mixed() -> None:
    with pytest.raises(pamrs.RigError, match=r"valve\.fill_conductance is not allowed with 'orif"):
        parse_rig(ISO.replace('flow                = "iso_6358"', ""))
    with pytest.raises(pamrs.RigError, match=r"valve\.fill_critical_ratio = 0\.95"):
        parse_rig(ISO.replace("value = 0.30", "value = 0.95"))
