"""Rigs: reading, refusing, changing and writing."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pamrs
from pamrs.errors import ParameterError, RigError
from pamrs.rig import load_rig, parse_rig
from pamrs.rig.schema import BLOCKS
from tests.rig.cases import refused, same
from tests.tables import rows_of

SHOULDER = (Path(pamrs.__file__).parent / "rigs" / "shoulder.toml").read_text(encoding="utf-8")


def changed(old: str, new: str) -> str:
    assert SHOULDER.count(old) == 1, old
    return SHOULDER.replace(old, new)


# ------------------------------------------------------------------------ reading


def test_shoulder_in_si() -> None:
    rig = pamrs.rigs.shoulder()
    assert rig.name == "shoulder"
    assert rig.blocks == tuple(
        block for block in BLOCKS if block not in ("line", "transmission", "link", "load")
    )
    braid = rig.parameter("muscle.braid_angle")
    assert braid.value == pytest.approx(math.radians(73.5))
    assert (braid.unit, braid.tol, braid.known) == ("rad", 0.0, True)
    volume = rig.parameters["chamber.dead_volume"]
    assert (volume.value, volume.unit, volume.tol) == (1.5e-4, "m3", 2.25e-5)
    assert rig.parameters["sensors.angle_zero"].tol == pytest.approx(math.radians(0.1))
    assert rig.parameters["muscle.count"].value == 6.0
    assert rig.parameters["muscle.k0"].value == 1.64
    assert rig.model["valve"]["fraction"] == [0.0, 0.2, 0.5, 0.8, 1.0]
    assert rig.model["muscle"]["geometry"] == "elliptic"
    assert rig.effects == []


def test_gas_and_chamber_are_enough() -> None:
    text = (
        'schema="pamrs.rig/1"\n[gas]\n[chamber]\ndead_volume={value=100,unit="cm3",unknown=true}\n'
    )
    rig = parse_rig(text)
    volume = rig.parameters["chamber.dead_volume"]
    assert volume.value == pytest.approx(1e-4)
    assert not volume.known
    assert rig.muscle is None
    assert math.isinf(volume.tol)
    assert rig.model["sensors"] == {"pressure_zero": 0.0, "angle_zero": 0.0}
    assert same(rig, parse_rig(rig.to_toml_text()))


def test_units_of_any_kind_give_the_same_rig() -> None:
    text = changed(
        'value = 0.015,  unit = "m3",  tol = 3.0e-4', 'value = 15, unit = "l", tol = 0.3'
    )
    text = text.replace(
        'value = 73.5,     unit = "deg"', f'value = {math.radians(73.5)!r}, unit = "rad"'
    )
    rig = parse_rig(text)
    assert rig.parameters["supply.volume"].value == pytest.approx(0.015, rel=1e-15)
    assert rig.parameters["supply.volume"].tol == pytest.approx(3e-4)
    assert rig.model["muscle"] == pamrs.rigs.shoulder().model["muscle"]


def test_a_tolerance_of_a_temperature_has_no_offset() -> None:
    text = changed('value = 293.15, unit = "K"', 'value = 20.0, unit = "degC", tol = 2.0')
    temperature = parse_rig(text).parameters["gas.temperature"]
    assert temperature.value == pytest.approx(293.15)
    assert temperature.tol == 2.0


# ----------------------------------------------------------------------- refusing

BAD = rows_of(__file__, "bad")


@pytest.mark.parametrize(("old", "new", "wanted"), BAD)
def test_mistakes_are_named(old: str, new: str, wanted: list[str]) -> None:
    message = refused(SHOULDER.replace(old, new, 1))
    assert [words for words in wanted if words not in message] == [], message


@pytest.mark.parametrize(("block", "wanted"), [("gas", "[gas]"), ("chamber", "[chamber]")])
def test_required_blocks(block: str, wanted: str) -> None:
    text = {"gas": '[chamber]\ndead_volume={value=1,unit="l"}', "chamber": "[gas]"}[block]
    message = refused('schema="pamrs.rig/1"\n' + text)
    assert wanted in message
    assert "missing" in message


def test_blocks_that_need_each_other() -> None:
    start, _, rest = SHOULDER.partition("[arm]")
    message = refused(start + "[sensors]" + rest.partition("[sensors]")[2])
    assert "[joint] needs the block [arm]" in message


def test_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(RigError, match=r"absent\.toml"):
        load_rig(tmp_path / "absent.toml")
    with pytest.raises(RigError, match=r"rig\.toml: cannot be read"):
        load_rig(tmp_path)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(RigError, match="UTF-8"):
        load_rig(binary)
    empty = tmp_path / "empty.toml"
    empty.write_text("")
    with pytest.raises(RigError, match=r"\[gas\] is missing"):
        load_rig(empty)
    with pytest.raises(RigError, match="cannot be written"):
        pamrs.rigs.shoulder().to_toml(tmp_path / "no" / "such" / "folder.toml")


JSON_LIKE = st.recursive(
    st.one_of(st.booleans(), st.integers(-9, 9), st.floats(), st.text(max_size=5)),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(st.sampled_from(["value", "unit", "x"]), inner)
    ),
    max_leaves=5,
)


@settings(max_examples=150)
@given(
    st.sampled_from(list(BLOCKS)),
    st.text("abcdef_", min_size=1, max_size=9),
    JSON_LIKE,
    st.booleans(),
)
def test_nothing_but_a_rig_error(block: str, key: str, value: Any, known: bool) -> None:
    from pamrs.rig import Reader

    name = BLOCKS[block][0].where[0] if known else key
    reader = Reader()
    reader.document({"schema": "pamrs.rig/1", block: {name: value}, "effects": value})
    assert reader.problems


# ------------------------------------------------------------- changing and writing


def test_with_parameters_leaves_the_old_rig_alone() -> None:
    rig = pamrs.rigs.shoulder()
    other = rig.with_parameters({"arm.payload": 5.0, "muscle.count": 4})
    assert other.parameters["arm.payload"].value == 5.0
    assert other.parameters["arm.payload"].tol == 0.18
    assert other.model["muscle"]["count"] == 4
    assert isinstance(other.model["muscle"]["count"], int)
    assert rig.parameters["arm.payload"].value == 9.07
    rig.model["arm"]["payload"] = 0.0
    rig.parameters.clear()
    assert rig.parameters["arm.payload"].value == 9.07


@pytest.mark.parametrize(
    "name", ["arm.mass", "payload", "valve.opening", "muscle.model", "", "wings.span"]
)
def test_unknown_names_are_refused(name: str) -> None:
    with pytest.raises(ParameterError, match="has no parameter"):
        pamrs.rigs.shoulder().with_parameters({name: 1.0})
    with pytest.raises(ParameterError, match=r"there are: gas|did you mean '\w+\.\w+'\?"):
        pamrs.rigs.shoulder().parameter(name)


def test_effects_of_a_file_are_checked() -> None:
    entry = '\n[[effects]]\nid = "leak_muscle"\nparameters = { conductance = %s }\n'
    assert "leak_muscle.conductance" in refused(SHOULDER + entry % '{ value = 1.0, unit = "bar" }')
    assert "no unit" in refused(SHOULDER + entry % "1e-9")
    assert "its standard deviation, std" in refused(
        SHOULDER + entry % '{ value = 1e-9, unit = "m3/(s Pa)", tol = 1e-10 }'
    )
    rig = parse_rig(SHOULDER + entry % '{ value = 0.1, unit = "l/(s bar)", std = 0.01 }')
    assert rig.effects[0]["parameters"]["conductance"] == pytest.approx(1e-9)
    assert rig.effect_std["leak_muscle"]["conductance"] == pytest.approx(1e-10)


def test_names_with_quotes_survive() -> None:
    text = changed('name = "shoulder"', "name = '''a \"b\" \\ ü'''")
    assert parse_rig(parse_rig(text).to_toml_text()).name == 'a "b" \\ ü'


def test_equal_rigs_compare_equal_and_others_do_not() -> None:
    rig = pamrs.rigs.shoulder()
    assert rig == pamrs.rigs.shoulder()
    assert hash(rig) == hash(pamrs.rigs.shoulder())
    assert rig == parse_rig(SHOULDER)
    heavier = rig.with_parameters({"arm.payload": 10.0})
    assert heavier != rig
    assert heavier.with_parameters({"arm.payload": rig.parameters["arm.payload"].value}) == rig
    assert rig.with_effect("leak_muscle", {"conductance": 1e-10}) != rig
    assert rig != "shoulder"
    assert len({rig, pamrs.rigs.shoulder(), heavier}) == 2
