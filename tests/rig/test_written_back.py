"""A rig that was read is written with the comments, the order and the units of its author."""

from __future__ import annotations

import difflib
import random
from dataclasses import replace
from importlib import resources
from pathlib import Path

import pytest

import pamrs
from pamrs import library
from pamrs.rig import load_rig, parse_rig
from pamrs.rig.schema import keys_of
from tests.rig.cases import same


def packaged(name: str) -> str:
    """The text of a rig of the package."""
    return resources.files("pamrs.rigs").joinpath(f"{name}.toml").read_text(encoding="utf-8")


SHOULDER = packaged("shoulder")


def differing(before: str, after: str) -> list[str]:
    """Lines of the second text that the first one does not have in their place."""
    lines = difflib.ndiff(before.splitlines(), after.splitlines())
    return [line[2:] for line in lines if line.startswith("+ ")]


@pytest.mark.parametrize("name", pamrs.rigs.names())
def test_an_unchanged_rig_is_its_file(name: str) -> None:
    text = packaged(name)
    assert parse_rig(text).to_toml_text() == text


def test_one_number_is_written_in_its_unit_beside_its_comment() -> None:
    text = SHOULDER.replace(
        'payload        = { value = 9.07,  unit = "kg",    tol = 0.18 }',
        'payload = { tol = 400, unit = "g", value = 9070 }  # weighed on 3 May',
    )
    rig = parse_rig(text).with_parameters({"arm.payload": 8.5})
    assert differing(text, rig.to_toml_text()) == [
        'payload = { tol = 400, unit = "g", value = 8500.0 }  # weighed on 3 May'
    ]
    assert same(rig, parse_rig(rig.to_toml_text()))


def test_a_unit_that_cannot_hold_the_number_becomes_the_one_that_can() -> None:
    """2e9 degC + 273.15 K is no number of doubles in degC: 293.15 + 3e-14 K."""
    text = SHOULDER.replace('temperature = { value = 293.15, unit = "K" }', "temperature = "
                            '{ value = 20, unit = "degC" }')  # fmt: skip
    value = 2.0e-20 + 1e-3
    rig = parse_rig(text.replace('unit = "V",  tol = 0.005', 'unit = "mV", tol = 5'))
    rig = rig.with_parameters({"gas.temperature": 250.0 + value, "valve.null_voltage": 1 / 3})
    assert same(rig, parse_rig(rig.to_toml_text()))


def test_effects_come_go_and_change_beside_the_comments() -> None:
    rig = parse_rig(SHOULDER).with_effect("leak_muscle", {"conductance": 1e-10})
    text = rig.to_toml_text()
    assert text.startswith(SHOULDER.rstrip("\n"))
    noted = text.replace("[[effects]]", "# found on Tuesday\n[[effects]]").replace(
        'conductance = { value = 1e-10, unit = "m3/(s Pa)" }',
        'conductance = { value = 1e-2, unit = "ml/(s bar)" }  # of the new bladder',
    )
    read = parse_rig(noted)
    twice = read.with_effect("muscle_hysteresis")
    assert same(twice, parse_rig(twice.to_toml_text()))
    assert twice.to_toml_text().startswith(noted)
    one = twice.without_effect("leak_muscle")
    assert same(one, parse_rig(one.to_toml_text()))
    assert "leak_muscle" not in one.to_toml_text()
    assert one.to_toml_text().startswith(SHOULDER[:200])
    other = read.with_effect("leak_muscle", {"conductance": 3e-10})
    assert "found on Tuesday" in other.to_toml_text()
    assert same(other, parse_rig(other.to_toml_text()))


def test_a_note_of_the_case_and_texts_that_no_key_has() -> None:
    text = SHOULDER.replace('name = "shoulder"', 'name = "shoulder"\ndescription = "second floor"')
    rig = parse_rig(text).with_case("../case")
    assert differing(text, rig.to_toml_text()) == ['case = "../case"']
    assert parse_rig(rig.to_toml_text()).case == "../case"
    assert parse_rig(rig.to_toml_text()).with_case("").to_toml_text() == text


def test_unknown_becomes_known_and_back() -> None:
    text = SHOULDER.replace("tol = 0.18 }", "unknown = true }  # scale broken")
    rig = parse_rig(text)
    told = replace(rig, _tolerances={**rig._tolerances, "arm.payload": 0.25})
    assert 'unit = "kg", tol = 0.25' in told.to_toml_text()
    assert "# scale broken" in told.to_toml_text()
    assert same(told, parse_rig(told.to_toml_text()))


@pytest.mark.parametrize("name", pamrs.rigs.names())
def test_any_numbers_come_back_to_the_last_bit(name: str) -> None:
    """With random values of every parameter, in files whose pressures, lengths and angles have
    units of their own.
    """
    chance = random.Random(name)
    rig = pamrs.rigs.named(name)
    text = rig.to_toml_text(comments=False)
    for si, unit, factor in (("Pa", "psi", 6894.757293168), ("m", "in", 0.0254)):
        lines = [
            line.replace(f'unit = "{si}"', f'unit = "{unit}"').replace("value = ", "value = 0.5*")
            if f'unit = "{si}"' in line and "tol" not in line and "[" not in line
            else line
            for line in text.splitlines()
        ]
        for index, line in enumerate(lines):
            before, found, rest = line.partition("0.5*")
            if found:
                number, _, end = rest.partition(",")
                lines[index] = f"{before}{float(number) / factor!r},{end}  # a note"
        text = "\n".join(lines) + "\n"
    rig = parse_rig(text)
    values = {
        p.name: min(max(p.value * chance.uniform(0.9, 1.1), p.lower), p.upper)
        for p in rig.parameters.values()
        if "count" not in p.name and chance.random() < 0.5
    }
    try:
        other = rig.with_parameters(values)
        again = parse_rig(other.to_toml_text())
    except pamrs.PamrsError:  # a rig that cannot be, such as a stop below another
        return
    assert same(other, again)
    assert other.to_toml_text().count("# a note") == text.count("# a note")
    assert other.to_toml_text(comments=False) == again.to_toml_text(comments=False)


def test_another_muscle_leaves_the_rest_of_the_file(tmp_path: Path) -> None:
    """As ``pamrs fit muscle --out-rig`` writes it: keys of another model go and come."""
    rig = parse_rig(SHOULDER)
    given = library.ch2_075in().parameters
    own = {key.name: given[key.name] for key in keys_of("muscle", given)}
    model = {**rig.model, "muscle": own}
    other = replace(rig, _model=model, _tolerances={})
    path = other.to_toml(tmp_path / "rig.toml")
    assert same(other, load_rig(path))
    assert "rest_length    = { value = 0.18542," in path.read_text(encoding="utf-8")
    assert "# Cd * A_max" in path.read_text(encoding="utf-8")


def test_a_text_that_says_something_else_is_not_followed() -> None:
    rig = replace(parse_rig(SHOULDER), _text="schema = 3\n")
    assert rig.to_toml_text() == rig.to_toml_text(comments=False)
    assert same(rig, parse_rig(rig.to_toml_text()))


def test_blocks_with_names_come_and_go() -> None:
    rig = parse_rig(packaged("antagonistic_joint"))
    model = rig.model
    model["sensors"]["flexor"] = {"pressure_zero": 120.0}
    other = replace(rig, _model=model)
    assert same(other, parse_rig(other.to_toml_text()))
    back = replace(parse_rig(other.to_toml_text()), _model=rig.model)
    assert same(back, parse_rig(back.to_toml_text()))
