"""Effects that have no place in a rig, numbers that are none, and the place of what is replaced."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import pamrs
from pamrs import _core
from pamrs._checks import checked_number
from pamrs.effects import EFFECTS
from pamrs.errors import ParameterError, RigError
from pamrs.rig import parse_rig
from pamrs.simulation import core_rig
from tests.effects.test_effects import regulated, rig_for

SWING = '\n[[effects]]\nid = "payload_swing"\nat = "{}"\n'


def pair() -> pamrs.Rig:
    """A joint with a flexor and an extensor."""
    return pamrs.rigs.named("antagonistic_joint")


def several_joints() -> pamrs.Rig:
    """A planar arm."""
    found = (pamrs.rigs.named(name) for name in pamrs.rigs.names())
    return next(rig for rig in found if len(rig.tables("joint")) > 1)


def without_blocks(rig: pamrs.Rig, *blocks: str) -> pamrs.Rig:
    return pamrs.Rig(rig.name, {**rig.model, **dict.fromkeys(blocks)})


def test_a_supply_of_another_kind_is_refused_with_what_there_is() -> None:
    words = r"acts on a supply of the kind regulator, and supply is a tank"
    with pytest.raises(ParameterError, match=words):
        pamrs.rigs.shoulder().with_effect("supply_regulator_deadband")
    with pytest.raises(ParameterError, match="of the kind tank, and supply is a regulator"):
        regulated().with_effect("compressor_cut_in")
    assert regulated().with_effect("supply_regulator_deadband").effects
    text = pamrs.rigs.shoulder().to_toml_text(comments=False)
    with pytest.raises(RigError, match=words):
        parse_rig(text + '\n[[effects]]\nid = "supply_regulator_deadband"\n')


@pytest.mark.parametrize(
    ("effect", "words"),
    [
        ("valve_dead_zone", "acts on a valve, and the rig has none"),
        ("muscle_creep", "acts on a muscle, and the rig has none"),
        ("joint_end_stop", "acts on a joint, and the rig has none"),
        ("base_flexibility", "acts on a joint, and the rig has none"),
        ("payload_change", "acts on a load of the kind mass or a joint, and the rig has none"),
    ],
)
def test_a_block_that_is_not_there_is_named(effect: str, words: str) -> None:
    plain = pamrs.rigs.shoulder()
    bare = without_blocks(plain, "valve", "line", "muscle", "joint", "arm", "load")
    with pytest.raises(ParameterError, match=words):
        bare.with_effect(effect)


@pytest.mark.parametrize("effect", sorted(EFFECTS))
def test_package_and_core_refuse_the_same(effect: str) -> None:
    entry = rig_for(effect).with_effect(effect).effects
    for name in pamrs.rigs.names():
        rig = pamrs.rigs.named(name)
        refused = refusal(core_json(rig, entry))
        if refused and "s would be needed" not in refused:
            assert effect in refused
            with pytest.raises(ParameterError, match=effect):
                rig.with_effect(effect)
        else:
            rig.with_effect(effect)


def refusal(told: str) -> str:
    """Why the core does not take a rig, empty where it does."""
    try:
        _core.Rig(told)
    except RigError as error:
        return str(error)
    return ""


def core_json(rig: pamrs.Rig, effects: list[dict[str, object]]) -> str:
    """A rig with effects as the core takes it, whatever the package says of them."""
    told = json.loads(rig.to_json())
    return json.dumps({**told, "effects": [{"at": "", **effect} for effect in effects]})


def test_one_mass_alone_can_hang() -> None:
    rig = several_joints()
    names = list(rig.tables("joint"))[:2]
    words = rf"only one mass.*payload_swing at joint\.{names[0]} and payload_swing at joint\."
    one = rig.with_effect("payload_swing", at=names[0])
    with pytest.raises(ParameterError, match=words):
        one.with_effect("payload_swing", at=names[1])
    assert one.with_effect("payload_swing", {"length": 0.4}, at=names[0]).effects
    assert len(one.with_effect("payload_swing").effects) == 1
    with pytest.raises(RigError, match="only one mass of an arm can hang"):
        parse_rig(rig.to_toml_text() + "".join(map(SWING.format, names)))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"std": {"conductance": math.nan}}, "std of conductance = nan"),
        ({"std": {"conductance": -1e-12}}, "std of conductance = -1e-12 .* 0 .* or more"),
        ({"std": {"conductance": math.inf}}, "std of conductance = inf"),
        ({"std": {"conductance": "x"}}, "std of conductance = 'x' is not allowed: a number"),
        ({"std": {"width": 1.0}}, "unknown parameter 'width'"),
        ({"std": [1.0]}, "std = .* a mapping"),
        ({"parameters": {"conductance": "x"}}, "conductance = 'x' .*: a number .* from 0 to 1e-07"),
        ({"parameters": {"conductance": None}}, "conductance = None"),
        ({"parameters": {"conductance": math.nan}}, "conductance = nan"),
        ({"parameters": {"conductance": -1.0}}, "conductance = -1"),
        ({"parameters": {"conductance": 10**400}}, "conductance = 1000"),
        ({"parameters": {3: 1.0}}, "parameters has the key 3"),
        ({"parameters": 5}, "parameters = 5"),
        ({"at": 3}, "at = 3 is not allowed: the name of a block"),
        ({"form": 3}, "form = 3 is not allowed: .* for leak_muscle"),
        ({"form": None}, "form = None is not allowed"),
    ],
)
def test_what_is_no_number_or_name_is_refused(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        pair().with_effect("leak_muscle", **arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize("effect", [["a"], None, 3, "leak_muscel"])
def test_what_is_no_effect_is_refused(effect: object) -> None:
    with pytest.raises(ParameterError, match="is not in the catalogue"):
        pair().with_effect(effect)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"arm.payload": None}, "arm.payload = None is not allowed: a number .* kg"),
        ({"arm.payload": "3 kg"}, "arm.payload = '3 kg' is not allowed"),
        ({"arm.payload": math.nan}, "arm.payload = nan kg"),
        ({"arm.payload": -1.0}, "arm.payload = -1 kg"),
        ({"chamber.dead_volume": 0.0}, "chamber.dead_volume = 0 m3"),
        ({"muscle.count": 2.5}, "muscle.count = 2.5 is not allowed: a whole number"),
        ({"muscle.count": math.inf}, "muscle.count = inf"),
        ({3: 1.0}, "values has the key 3"),
        ([1.0], "values = "),
    ],
)
def test_parameters_that_are_no_numbers_are_refused(values: object, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        pamrs.rigs.shoulder().with_parameters(values)  # type: ignore[arg-type]


def test_numbers_of_numpy_are_numbers() -> None:
    assert checked_number("x", np.float32(0.5), 0.0, 1.0) == 0.5
    assert checked_number("x", np.array(3), 0.0, math.inf, whole=True) == 3.0
    with pytest.raises(ParameterError, match="x = -1 m is not allowed: from 0 to 2 m"):
        checked_number("x", -1, 0.0, 2.0, "m")


def test_what_replaces_another_stands_in_its_place() -> None:
    rig = pair().with_effect("leak_muscle", {"conductance": 1e-10}, at="flexor")
    rig = rig.with_effect("leak_muscle", {"conductance": 3e-11}, at="extensor")
    rig = rig.with_effect("muscle_creep")
    states = core_rig(rig).states
    again = rig.with_effect(
        "leak_muscle", {"conductance": 5e-11}, std={"conductance": 1e-12}, at="flexor"
    )
    order = [(entry["id"], entry.get("at", "")) for entry in rig.effects]
    assert [(entry["id"], entry.get("at", "")) for entry in again.effects] == order
    assert again.effects[0]["parameters"]["conductance"] == 5e-11
    assert again.effect_std == {"leak_muscle.flexor": {"conductance": 1e-12}}
    assert core_rig(again).states == states
    assert again.with_effect("leak_muscle", at="flexor").effect_std == {}
    everywhere = again.with_effect("leak_muscle")
    assert [entry["id"] for entry in everywhere.effects] == ["leak_muscle", "muscle_creep"]
    back = everywhere.with_effect("leak_muscle", at="extensor")
    assert [entry.get("at") for entry in back.effects] == ["extensor", None]


def test_taking_away_what_is_not_there_names_where_it_is() -> None:
    rig = pair().with_effect("leak_muscle", at="flexor")
    for place in ("nix", "extensor", ""):
        with pytest.raises(ParameterError, match=f"at = {place!r} .* acts at 'flexor'"):
            rig.without_effect("leak_muscle", at=place)
    with pytest.raises(ParameterError, match="acts everywhere"):
        pair().with_effect("leak_muscle").without_effect("leak_muscle", at="flexor")
    with pytest.raises(ParameterError, match="nowhere"):
        rig.without_effect("muscle_creep", at="flexor")
    with pytest.raises(ParameterError, match="without the id"):
        rig.without_effect(at="flexor")
    assert rig.without_effect("leak_muscle", at="chamber.flexor").effects == []
    assert rig.without_effect("muscle_creep") is rig
