"""Rigs of several groups and joints: blocks with names, the rigs of the package, and what the core
gets of them.
"""

from __future__ import annotations

import json
import math
import pickle
import re
from pathlib import Path
from typing import Any

import pytest

import pamrs
from pamrs import rigs
from pamrs.effects import EFFECTS
from pamrs.errors import ParameterError
from pamrs.rig import Rig, load_rig, parse_rig
from pamrs.rig.schema import BLOCKS, PORTS
from pamrs.rigs._keys import every_key
from pamrs.simulation import core_rig
from tests.rig.cases import refused, same, stand
from tests.scripts import command
from tests.tables import rows_of

CORE = Path(__file__).parent / "core"
"""Descriptions of packaged rigs for the core, as they were once written by hand."""


def core(rig: Rig) -> dict[str, Any]:
    model: dict[str, Any] = json.loads(rig.to_json())
    return model


# --------------------------------------------------------------------- rigs of the package


def test_the_package_names_its_files_shoulder_first() -> None:
    folder = Path(rigs.__file__).parent
    assert rigs.names()[0] == "shoulder"
    assert set(rigs.names()) == {file.stem for file in folder.glob("*.toml")}
    assert len(rigs.names()) >= 12
    with pytest.raises(AttributeError, match="knee"):
        rigs.knee()


@pytest.mark.parametrize("name", rigs.names())
def test_packaged_rigs_read_back_to_the_last_bit(name: str, tmp_path: Path) -> None:
    rig = rigs.named(name)
    assert rig.name == name
    assert rigs.template(name).startswith("#")  # says what it is
    assert same(rig, load_rig(rig.to_toml(tmp_path / "again.toml")))
    assert same(rig, parse_rig(parse_rig(rig.to_toml_text()).to_toml_text()))
    assert same(rig, pickle.loads(pickle.dumps(rig)))
    assert same(
        rig, rig.with_parameters({name: given.value for name, given in rig.parameters.items()})
    )
    renamed = parse_rig(rigs.template(name, "mine", "coefficients"))
    assert renamed.name == "mine"
    assert renamed.parameters == rig.parameters
    anew = parse_rig(rigs.template(name))
    assert all(chamber["gas"] == "energy_balance" for chamber in anew.tables("chamber").values())
    kept = {key: given for key, given in rig.parameters.items() if ".alpha" not in key}
    assert {key: anew.parameters[key] for key in kept} == kept
    assert any(0.0 < given.tol < math.inf for given in rig.parameters.values())


def test_the_file_allows_as_stiff_a_spring_as_the_core() -> None:
    (key,) = (key for key in BLOCKS["joint"] if key.name == "stiffness")
    for name in ("shoulder", "two_joint_arm"):
        rig = rigs.named(name)
        joint = next(iter(rig.tables("joint")))
        parameter = "joint.stiffness" if not joint else f"joint.{joint}.stiffness"
        core_rig(rig.with_parameters({parameter: key.upper}))
        model = rig.model
        table = model["joint"] if not joint else model["joint"][joint]
        table["stiffness"] = 1.01 * key.upper
        with pytest.raises(pamrs.errors.PamrsError, match=r"stiffness.*1e9|stiffness.*1000000000"):
            core_rig(pamrs.Rig(name, model))


def test_muscles_of_the_packaged_rigs_are_those_of_the_library() -> None:
    from pamrs import library

    for rig, name, muscle in (
        ("two_joint_arm", "wrist", library.elbow_0625in()),
        ("antagonistic_joint", "extensor", library.ch2_075in()),
        ("hanging_mass", "", library.pam_a_1in()),
        ("bench", "", library.pam_a_1in()),
    ):
        found, wanted = rigs.named(rig).muscle_of(name).parameters, muscle.parameters
        for key, value in wanted.items():
            if key != "count":
                assert found[key] == (
                    pytest.approx(value) if not isinstance(value, str) else value
                ), (rig, key)


def test_packaged_joints_stay_within_what_their_muscles_can_do() -> None:
    for name in rigs.names():
        rig = rigs.named(name)
        transmissions = rig.tables("transmission")
        for muscle, ends in rig.ports("muscle").items():
            if ends["joint"] == "load":
                continue
            joint = rig.tables("joint")[ends["joint"].partition(".")[2]]
            low, high = joint["min_angle"], joint["max_angle"]
            geometry = pamrs.Joint.from_model(transmissions.get(muscle, joint))
            model = rig.muscle_of(muscle)
            least, most = model.contraction_range
            contraction = (
                geometry.shortening([low, 0.5 * (low + high), high])
                / model.parameters["rest_length"]
            )
            assert least <= contraction.min() <= contraction.max() <= most, (name, muscle)


# ------------------------------------------------------------------------ shape of a model


def test_tables_of_blocks_with_and_without_names() -> None:
    rig = rigs.named("antagonistic_joint")
    assert list(rig.tables("valve")) == ["flexor", "extensor"]
    assert rig.model["valve"] == rig.tables("valve")
    assert list(rig.tables("supply")) == [""]
    assert rig.model["supply"] == rig.tables("supply")[""]
    assert rig.tables("line") == {}
    assert rig.model["line"] is None
    assert rig.tables("transmission")["extensor"]["radius"] == -0.02
    rig.tables("valve")["flexor"]["half_range"] = 0.0
    assert rig.tables("valve")["flexor"]["half_range"] == 5.0
    with pytest.raises(
        ParameterError, match="block = 'valves' is not allowed: one of 'gas', 'supply', 'valve'"
    ):
        rig.tables("valves")
    with pytest.raises(ParameterError, match="block = 'tank'"):
        rig.ports("tank")
    assert rig.ports("chamber") == {"flexor": {}, "extensor": {}}


def test_a_single_block_may_have_a_name() -> None:
    rig = parse_rig(stand("supply.tank", "valve.main", "chamber.main"))
    assert rig.ports("valve") == {"main": {"from": "supply.tank", "to": "chamber.main"}}
    assert rig.model["chamber"]["main"]["dead_volume"] == pytest.approx(1e-5)
    assert same(rig, parse_rig(rig.to_toml_text()))


def test_the_order_of_the_file_is_kept() -> None:
    rig = parse_rig(stand("supply", "valve.b", "valve.a", "chamber.b", "chamber.a"))
    assert list(rig.tables("valve")) == ["b", "a"]
    assert [entry["name"] for entry in core(rig)["chambers"]] == ["b", "a"]
    assert same(rig, parse_rig(rig.to_toml_text()))


def test_parameters_of_named_blocks() -> None:
    rig = rigs.named("two_joint_arm")
    area = rig.parameter("valve.elbow.discharge_area_max")
    assert (area.name, area.unit) == ("valve.elbow.discharge_area_max", "m2")
    assert [area.value, area.tol] == pytest.approx([8.4e-6, 1e-6])
    assert rig.parameter("link.hand.payload").value == pytest.approx(11.34, abs=0.01)
    assert "supply.initial_pressure" in rig.parameters
    assert "supply.volume" not in rig.parameters
    assert "arm.inertia" not in rig.parameters
    other = rig.with_parameters(
        {"muscle.wrist.count": 4, "arm.gravity": 1.6, "link.hand.payload": 0.0}
    )
    assert other.tables("muscle")["wrist"]["count"] == 4
    assert other.tables("muscle")["elbow"]["count"] == 6
    assert other.parameters["link.hand.payload"].tol == rig.parameters["link.hand.payload"].tol
    assert other.ports("link") == rig.ports("link")
    for name in (
        "valve.discharge_area_max",
        "valve.hand.half_range",
        "valve.elbow.from",
        "valve.elbow",
        "supply.volume",
        "ports.x",
    ):
        with pytest.raises(ParameterError, match="has no parameter"):
            rig.with_parameters({name: 1.0})
    with pytest.raises(ParameterError, match=r"link\.hand\.payload = -1 kg"):
        rig.with_parameters({"link.hand.payload": -1.0})


def test_unknown_and_tolerance_of_named_blocks_survive() -> None:
    text = stand("chamber.a", "chamber.b").replace(
        'unit = "cm3" }', 'unit = "cm3", unknown = true }', 1
    )
    rig = parse_rig(text.replace('unit = "cm3" }', 'unit = "cm3", tol = 0.5 }', 1))
    assert not rig.parameters["chamber.a.dead_volume"].known
    assert rig.parameters["chamber.b.dead_volume"].tol == pytest.approx(5e-7)
    assert same(rig, parse_rig(rig.to_toml_text()))


def test_the_muscle_of_a_rig_with_one_and_with_several() -> None:
    one = parse_rig(stand("chamber", "muscle.left", "load"))
    assert one.muscle is not None
    assert one.muscle.parameters == one.muscle_of("left").parameters
    pair = rigs.named("antagonistic_joint")
    with pytest.raises(
        ParameterError,
        match=r"has the muscles flexor, extensor: take one by Rig\.muscle_of\(name\)",
    ):
        _ = pair.muscle
    with pytest.raises(
        ParameterError, match=r"name = '' .*|has no such muscle; it has: 'flexor', 'extensor'"
    ):
        pair.muscle_of()
    assert pair.muscle_of("flexor").parameters["friction_coefficient"] == 0.16
    with pytest.raises(ParameterError, match="it has: none"):
        rigs.named("tube").muscle_of("left")


# ------------------------------------------------------------------------------- the core


@pytest.mark.parametrize("name", sorted(file.stem for file in CORE.glob("*.json")))
def test_the_core_gets_what_stands_beside(name: str) -> None:
    assert core(rigs.named(name)) == json.loads((CORE / f"{name}.json").read_text(encoding="utf-8"))


def test_json_of_a_line_that_valves_feed() -> None:
    rig = parse_rig(
        stand("supply", "valve.a", "valve.b", "line.a", "line.b", "chamber.a", "chamber.b")
    )
    found = core(rig)
    assert [(valve["from"], valve["to"]) for valve in found["valves"]] == [
        ("supply", "line.a"),
        ("supply", "line.b"),
    ]
    assert [(line["from"], line["to"]) for line in found["lines"]] == [
        ("", "chamber.a"),
        ("", "chamber.b"),
    ]
    assert rig.wiring[0] == "air: supply -> valve.a -> line.a -> chamber.a -> ambient"


# ------------------------------------------------------------------------------- sensors


def test_sensors_belong_to_the_chamber_and_the_joint_of_their_name() -> None:
    rig = rigs.named("two_joint_arm")
    assert rig.tables("sensors")["wrist"] == {"pressure_zero": 0.0, "angle_zero": 0.0}
    pair = rigs.named("antagonistic_joint")
    assert pair.tables("sensors") == {
        "flexor": {"pressure_zero": 0.0},
        "extensor": {"pressure_zero": 0.0},
        "elbow": {"angle_zero": 0.0},
    }
    assert "sensors.flexor.angle_zero" not in pair.parameters
    moved = pair.with_parameters(
        {"sensors.elbow.angle_zero": 0.01, "sensors.flexor.pressure_zero": 500.0}
    )
    assert core(moved)["sensors"] == [
        {"name": "flexor", "pressure_zero": 500.0, "angle_zero": 0.0},
        {"name": "extensor", "pressure_zero": 0.0, "angle_zero": 0.0},
        {"name": "elbow", "pressure_zero": 0.0, "angle_zero": 0.01},
    ]
    text = stand(
        "chamber.flexor",
        "sensors.flexor",
        sensors_flexor='angle_zero = { value = 1, unit = "deg" }',
    )
    assert "sensors.flexor.angle_zero is not allowed: the rig has no joint.flexor" in refused(text)
    common = parse_rig(
        stand(
            "chamber.a",
            "chamber.b",
            "sensors",
            sensors='pressure_zero = { value = 1, unit = "kPa" }',
        )
    )
    assert core(common)["sensors"] == [{"name": "", "pressure_zero": 1000.0, "angle_zero": 0.0}]
    assert parse_rig(stand("chamber.a", "chamber.b")).model["sensors"] == {
        "pressure_zero": 0.0,
        "angle_zero": 0.0,
    }


# ------------------------------------------------------------------------------- effects


def test_an_effect_on_one_block() -> None:
    pair = rigs.named("antagonistic_joint")
    rig = pair.with_effect(
        "leak_muscle", {"conductance": 1e-11}, std={"conductance": 1e-12}, at="chamber.extensor"
    )
    rig = rig.with_effect("muscle_hysteresis")
    assert [(entry["id"], entry.get("at")) for entry in rig.effects] == [
        ("leak_muscle", "extensor"),
        ("muscle_hysteresis", None),
    ]
    assert [entry["at"] for entry in core(rig)["effects"]] == ["extensor", ""]
    assert same(rig, parse_rig(rig.to_toml_text()))
    assert same(rig, pickle.loads(pickle.dumps(rig)))
    other = rig.with_effect("leak_muscle", at="flexor")
    assert [entry.get("at") for entry in other.effects] == ["extensor", None, "flexor"]
    assert other.effect_std == {"leak_muscle.extensor": {"conductance": 1e-12}}
    assert same(other, parse_rig(other.to_toml_text()))
    assert other.without_effect("leak_muscle", at="flexor").effects == rig.effects
    assert [entry.get("at") for entry in other.with_effect("leak_muscle").effects] == [None, None]
    assert (
        rig.without_effect("leak_muscle").effects == pair.with_effect("muscle_hysteresis").effects
    )
    with pytest.raises(
        ParameterError, match="leak_muscle: at = 'flexr' names no chamber; did you mean 'flexor'"
    ):
        pair.with_effect("leak_muscle", at="flexr")
    with pytest.raises(ParameterError, match="there are: flexor, extensor"):
        pair.with_effect("muscle_hysteresis", at="elbow")
    assert rigs.shoulder().with_effect("leak_muscle", at="chamber").effects[0].get("at") is None


def test_effects_in_a_file_name_their_block() -> None:
    text = stand("chamber.a", "chamber.b")
    leak = '[[effects]]\nid = "leak_muscle"\n'
    assert parse_rig(text + leak + 'at = "a"\n').effects[0]["at"] == "a"
    assert parse_rig(text + leak + 'at = "chamber.b"\n').effects[0]["at"] == "b"
    assert "leak_muscle: at = 'c' names no chamber; there are: a, b" in refused(
        text + leak + 'at = "c"\n'
    )
    assert "effects[0].at = 3 is not allowed: the name of a chamber" in refused(
        text + leak + "at = 3\n"
    )
    both = parse_rig(text + leak + 'at = "a"\n' + leak + 'at = "b"\n')
    assert [entry["at"] for entry in both.effects] == ["a", "b"]
    for other in ('at = "a"\n', ""):
        assert "effects[1].id = 'leak_muscle' is there twice" in refused(
            text + leak + 'at = "a"\n' + leak + other
        )
    assert "effects[0].form = 'wide' is not allowed" in refused(text + leak + 'form = "wide"\n')
    assert "there is none with a name" in refused(stand("chamber") + leak + 'at = "a"\n')


# ------------------------------------------------------------------------------- the words


def test_the_wiring_in_words() -> None:
    assert rigs.shoulder().wiring == [
        "air: supply -> valve -> chamber -> ambient",
        "pull: chamber -> muscle -> joint -> arm",
    ]
    assert rigs.named("antagonistic_joint").wiring == [
        "air: supply -> valve.flexor -> chamber.flexor -> ambient",
        "air: supply -> valve.extensor -> chamber.extensor -> ambient",
        "pull: chamber.flexor -> muscle.flexor -> transmission.flexor -> joint.elbow -> arm",
        "pull: chamber.extensor -> muscle.extensor -> transmission.extensor -> joint.elbow -> arm",
    ]
    assert rigs.named("two_joint_arm").wiring[2:] == [
        "pull: chamber.elbow -> muscle.elbow -> joint.elbow -> link.forearm",
        "pull: chamber.wrist -> muscle.wrist -> joint.wrist -> link.hand",
        "arm: base -> joint.elbow -> link.forearm -> joint.wrist -> link.hand",
    ]
    assert rigs.named("tube").wiring == ["air: chamber.left -> line -> chamber.right"]
    assert rigs.named("blow_down_tank").wiring == ["air: chamber -> line -> ambient"]
    assert rigs.named("bench").wiring == [
        "air: chamber, shut off",
        "pull: chamber -> muscle -> load",
    ]


def test_rig_check_says_what_is_connected_and_what_everything_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = rigs.antagonistic_joint()
    rig = rig.with_effect(
        "leak_muscle", {"conductance": 5e-11}, std={"conductance": 1e-12}, at="flexor"
    )
    file = rig.to_toml(tmp_path / "rig.toml")
    code, out, err = command(capsys, "rig", "check", file)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[: len(rig.wiring)] == rig.wiring
    shown = dict(line.split(maxsplit=1) for line in lines[len(rig.wiring) : -1])
    assert shown["valve.flexor.discharge_area_max"] == "1.2 ± 0.1 mm2"
    assert shown["chamber.flexor.alpha_in"] == "1.4"  # a plain number has no unit
    bounds = next(p for p in EFFECTS["leak_muscle"].parameters if p.name == "conductance")
    assert shown["leak_muscle.flexor.conductance"] == (
        f"5e-11 ± 1e-12 m3/(s Pa); allowed from {bounds.lower:g} to {bounds.upper:g} m3/(s Pa)"
    )
    assert lines[-1].endswith("is valid, 83 parameters, 1 effect")


def test_help_and_template_know_every_rig_and_key(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    shown = command(capsys, "rig", "new", "--help")[1]
    assert ",".join(rigs.names()) in "".join(shown.split())
    text = every_key()
    for block, keys in BLOCKS.items():
        assert f"# [{block}]" in text
        assert all(key.where[-1] in text for key in keys)
        assert all(f"#   {port.name} " in text for port in PORTS.get(block, ()))
    for words in (
        *("[valve.NAME]", "valve.flexor.half_range", "[transmission.flexor]", '"ambient"'),
        "that it acts on; default every",
    ):
        assert words in text
    assert all(line.startswith("#") for line in text.splitlines())


NO_LIMIT = "limits.max_pressure is missing"


@pytest.mark.parametrize("name", rigs.names())
def test_every_packaged_rig_is_a_function_without_arguments(name: str) -> None:
    assert same(getattr(rigs, name)(), rigs.named(name))
    rig = getattr(rigs, name)()
    assert [told for told in rig.cautions if not told.startswith(NO_LIMIT)] == []
    limited = "max_pressure" in rig.limits or not rig.tables("muscle")
    assert any(told.startswith(NO_LIMIT) for told in rig.cautions) != limited


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("tube", "a fast change (1.4)"),
        ("long_tube", "a fast change (1.4)"),
        ("sealed_chamber", "the gas at their temperature"),
        ("blow_down_tank", "the gas at its temperature"),
    ],
)
def test_comments_on_coefficients_go_with_them(name: str, said: str) -> None:
    with_them = rigs.template(name, gas="coefficients").partition("# Every key")[0]
    without = rigs.template(name).partition("# Every key")[0]
    assert with_them.count(said) > without.count(said) == 0


def told_of(name: str, old: str, new: str) -> list[str]:
    """Cautions about a packaged rig in whose file something is replaced."""
    text, count = re.subn(
        old,
        new,
        (Path(rigs.__file__).parent / f"{name}.toml").read_text(encoding="utf-8"),
        flags=re.M | re.S,
    )
    assert count
    return [told for told in parse_rig(text).cautions if not told.startswith(NO_LIMIT)]


def test_muscles_of_which_nobody_says_what_they_bear_are_told() -> None:
    said = {"shoulder": "the 13.8 bar of the supply", "regulated_joint": "up to the supply"}
    for name, bar in said.items():
        text = (Path(rigs.__file__).parent / f"{name}.toml").read_text(encoding="utf-8")
        bare = re.sub(r"^\[limits\].*?(?=^\[|\Z)", "", text, flags=re.M | re.S)
        (told,) = parse_rig(bare).cautions
        assert told.startswith(NO_LIMIT)
        assert bar in told
        limit = '[limits]\nmax_pressure = { value = 7, unit = "bar" }\n'
        assert parse_rig(bare + limit).cautions == []


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            r"^rest_length *=.*?$",
            'rest_length = { value = 2.76, unit = "m", tol = 0.01 }',
            ["muscle is long for its joint", "0.0452 m, 1.6 %", "= 2.76 m"],
        ),
        (
            r"^rest_length *=.*?$",
            'rest_length = { value = 130, unit = "mm", tol = 1 }',
            ["muscle is short for its joint", "at 15 bar it pulls up to"],
        ),
        (
            r"^rest_angle *=.*?$",
            'rest_angle = { value = 35, unit = "deg" }',
            ["muscle is stretched by", "where its braid is taut"],
        ),
    ],
)
def test_muscles_that_do_not_fit_their_joint_are_told(old: str, new: str, said: list[str]) -> None:
    (told,) = told_of("shoulder", old, new)
    assert all(part in told for part in said), told


def test_a_regulator_without_a_line_feeds_nothing() -> None:
    (told,) = told_of("regulated_joint", r"^\[line\].*?(?=^\[)", "")
    assert told.startswith("no air goes from supply to chamber")
    assert "[line]" in told


def test_friction_of_exactly_nothing_is_told_with_a_usual_size() -> None:
    (told,) = told_of("hanging_mass", r"^viscous *=.*?$", "")
    assert told.startswith("load.viscous = 0 N s/m, exactly")
    mass = rigs.hanging_mass().parameters["load.mass"].value
    assert f"value = {0.1 * mass * 9.80665:.2g}, " in told
    (zero,) = told_of("hanging_mass", r"^viscous *=.*?$", 'viscous = { value = 0, unit = "N s/m" }')
    assert zero == told
    known = 'viscous = { value = 0, unit = "N s/m", tol = 5 }'
    assert told_of("hanging_mass", r"^viscous *=.*?$", known) == []
    links = told_of("two_joint_arm", r"^(?:viscous|coulomb) *=[^\n]*\n", "")
    words = [f"link.{name}.{key}" for name in ("forearm", "hand") for key in ("viscous", "coulomb")]
    assert [caution.split(" = ")[0] for caution in links] == words


def test_measured_values_without_a_tolerance_are_told_together() -> None:
    (told,) = told_of("shoulder", r"^((?:inertia|dead_volume) *=.*?), *tol *= *[-0-9.e]+", r"\1")
    assert told.startswith("known exactly, as no laboratory knows it: ")
    assert "arm.inertia (tol = 0.032 kg m2)" in told
    assert "chamber.dead_volume (tol = 1.5e-05 m3)" in told
    (none,) = told_of("shoulder", r", *tol *= *[-0-9.e]+", "")
    assert none.startswith("no value has a tolerance")


def pulsed(valve: str) -> Rig:
    """A chamber behind one valve that switches, with some keys of the valve in other words."""
    keys = {
        "flow": '"iso_6358"',
        "fill_conductance": '{ value = 0.2, unit = "l/(s bar)" }',
        "fill_critical_ratio": '{ value = 0.3, unit = "1" }',
        "vent_conductance": '{ value = 0, unit = "l/(s bar)" }',
        "vent_critical_ratio": '{ value = 0.3, unit = "1" }',
        "null_voltage": '{ value = 0, unit = "V" }',
        "half_range": '{ value = 24, unit = "V" }',
        "area_fraction": "{ opening = [0, 1], fraction = [0, 1] }",
        "spool": '"switching"',
        "opening_delay": '{ value = 2.5, unit = "ms" }',
        "closing_delay": '{ value = 1.5, unit = "ms" }',
        "carrier_frequency": '{ value = 80, unit = "Hz" }',
    }
    keys |= dict(line.split(" = ", 1) for line in valve.splitlines() if line)
    table = "\n".join(f"{key} = {value}" for key, value in keys.items() if value != "-")
    return parse_rig(f"{stand('supply', 'chamber')}\n[valve]\n{table}\n")


@pytest.mark.parametrize(
    ("valve", "said"),
    rows_of(__file__, "valves_that_never_act_are_told"),
)
def test_valves_that_never_act_are_told(
    valve: str, said: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = pulsed(valve)
    of_valve = [caution for caution in rig.cautions if "tolerance" not in caution]
    assert len(of_valve) == bool(said)
    assert all(part in of_valve[0] for part in said)
    file = rig.to_toml(tmp_path / "rig.toml")
    code, out, _ = command(capsys, "rig", "check", file)
    assert code == 0  # possible, and told
    assert [line for line in out.splitlines() if line.startswith("warning: ")] == [
        f"warning: {text}" for text in rig.cautions
    ]


@pytest.mark.parametrize(("value", "shown"), [("257", "257"), ("-1", "-1"), ("2.5", "2.5")])
def test_a_count_asks_for_a_whole_number(value: str, shown: str) -> None:
    words = f"line.segments = {shown} is not allowed: a whole number from 0 to 256"
    text = stand("supply", "chamber", "line from=supply to=chamber")
    assert words in refused(text.replace("[line]", f"[line]\nsegments = {value}"))
    with pytest.raises(ParameterError, match=words):
        rigs.named("long_tube").with_parameters({"line.segments": float(value)})
