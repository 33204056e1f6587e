"""Laws of a rig file as hypotheses: gas, valve flow and muscle force."""

from __future__ import annotations

import pytest

import pamrs
from pamrs.diagnosis.laws import _is_an_effect
from pamrs.rig import other_choices
from tests.diagnosis.healthy import RIGS, healthy_case

SHOULDER = pamrs.rigs.shoulder()


@pytest.mark.parametrize("name", RIGS)
def test_every_packaged_rig_has_other_laws(name: str) -> None:
    rig: pamrs.Rig = getattr(pamrs.rigs, name)()
    choices = list(other_choices(rig))
    assert {choice.name for choice in choices} >= {"chamber.gas", "muscle.model"}
    for choice in choices:
        kind, key = choice.name.split(".")
        tables = choice.rig.tables(kind)
        assert {table[key] for table in tables.values()} == {choice.other}
        assert {table[key] for table in rig.tables(kind).values()} == {choice.stated}
        assert tables.keys() == rig.tables(kind).keys()


def test_conductance_of_the_other_flow_law_is_that_of_the_area() -> None:
    """An orifice and its sonic conductance let the same air through, there and back."""
    (sonic,) = other_choices(SHOULDER, ("valve",))
    (back,) = other_choices(sonic.rig, ("valve",))
    name = "valve.discharge_area_max"
    assert back.other == sonic.stated == "orifice"
    stated, found = SHOULDER.parameters[name], back.rig.parameters[name]
    assert (found.value, found.tol) == pytest.approx((stated.value, stated.tol))


def test_a_valve_that_lets_air_through_one_way_has_no_area_for_both() -> None:
    (sonic,) = other_choices(SHOULDER, ("valve",))
    one_way = sonic.rig.with_parameters({"valve.fill_conductance": 0.0})
    assert list(other_choices(one_way, ("valve",))) == []


def test_an_energy_balance_is_an_effect_and_no_other_law_is() -> None:
    rigs: list[pamrs.Rig] = [getattr(pamrs.rigs, name)() for name in RIGS]
    every = {(c.name, c.other): _is_an_effect(c) for rig in rigs for c in other_choices(rig)}
    assert len(every) > 5
    assert {law for law, own in every.items() if own} == {("chamber.gas", "energy_balance")}


@pytest.mark.parametrize(
    ("name", "other"), [("chamber.gas", "energy_balance"), ("muscle.model", "ferraresi")]
)
def test_the_law_that_the_recordings_follow_is_named(name: str, other: str) -> None:
    """Nothing is missing but that the rig file has another law."""
    choices = other_choices(SHOULDER, (name.split(".")[0],))
    choice = next(c for c in choices if c.other == other)
    case = healthy_case("shoulder", 1, 100, sharp=True).with_rig(choice.rig)
    found = pamrs.diagnose(case)
    assert [(law.name, law.stated, law.other) for law in found.laws] == [
        (name, other, choice.stated)
    ]
    assert (found.verdict, found.answer.named) == ("parameters", []), found.summary()
    for said in (found.headline, found.text):
        assert said.startswith(f"With {name} = {choice.stated}, not {other}")
    assert found.rig is not None
    kind, key = name.split(".")
    assert {table[key] for table in found.rig.tables(kind).values()} == {choice.stated}
    before = found.fit.held_out[found.laws[0].channel].before
    assert before > 5.0 * found.laws[0].after  # that of the user's own model
