"""Keys of a rig file and their bounds: one table, asked by the reader in every unit, and by the
core.
"""

from __future__ import annotations

import contextlib
import copy
import json
import tomllib
from pathlib import Path
from typing import Any

import pytest

from pamrs import rigs
from pamrs.effects import EFFECTS
from pamrs.errors import ParameterError, RigError
from pamrs.rig import parse_rig
from pamrs.rig.schema import BLOCKS, Key, keys_of, qualified
from pamrs.simulation import core_rig
from pamrs.units import from_si, spellings

PACKAGED = Path(__file__).parents[2] / "python/pamrs/rigs"


def shown(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f'"{k}" = {shown(v)}' for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(shown, value)) + "]"
    return json.dumps(value)


def problems(document: dict[str, Any]) -> str:
    """What the reader says of a rig; nothing where it is right."""
    try:
        parse_rig("\n".join(f'"{key}" = {shown(value)}' for key, value in document.items()))
    except RigError as error:
        return str(error)
    return ""


def rig_of(name: str) -> dict[str, Any]:
    return tomllib.loads((PACKAGED / f"{name}.toml").read_text(encoding="utf-8"))


def test_an_effect_takes_the_parameters_of_its_form_and_no_other() -> None:
    base = rig_of("shoulder")
    for info in EFFECTS.values():
        for form in info.forms:
            first = next(iter(form.parameters))
            for wrong in (
                {"weight": {"value": 1, "unit": "1"}},
                {first.name: {"value": 2 * first.upper + 1, "unit": first.unit}},
                {first.name: {"value": first.default, "unit": "cd"}},
                {first.name: first.default},
            ):
                entry = {"id": info.id, "form": form.name, "parameters": wrong}
                said = problems(base | {"effects": [entry]})
                assert f"{info.id}.{next(iter(wrong))}" in said, (entry, said)


HOMES = {
    "supply": "shoulder", "valve": "shoulder", "chamber": "shoulder", "muscle": "shoulder",
    "joint": "shoulder", "arm": "shoulder", "gas": "shoulder", "line": "tube",
    "load": "hanging_mass", "link": "two_joint_arm", "transmission": "antagonistic_joint",
}  # fmt: skip


def table_in(document: dict[str, Any], block: str) -> dict[str, Any]:
    """The first block of a kind, with a name or without."""
    content = document[block]
    named = all(isinstance(v, dict) and not {"value", "unit"} & {*v} for v in content.values())
    return next(iter(content.values())) if named else content


def numbers() -> list[tuple[str, Key]]:
    """Scalars of blocks, each with a rig that has it."""
    tables = {block: table_in(rig_of(home), block) for block, home in HOMES.items()}
    keys = [(b, key) for b, table in tables.items() for key in BLOCKS[b] if key.name in table]
    return [(block, key) for block, key in keys if key.kind == "scalar" and not key.path]


@pytest.mark.parametrize(("block", "key"), numbers(), ids=lambda v: getattr(v, "name", v))
def test_bounds_are_those_of_the_table_in_any_unit(block: str, key: Key) -> None:
    base = rig_of(HOMES[block])

    def with_value(value: Any, name: str = key.name) -> dict[str, Any]:
        document = copy.deepcopy(base)
        table_in(document, block)[name] = value
        return document

    for unit in dict.fromkeys((key.unit, *spellings(key.unit)[-1:])):
        for bound, away in ((key.lower, -1.0), (key.upper, 1.0)):
            beyond = bound + away * max(1e-3, 1e-3 * abs(bound))
            wrong = with_value({"value": from_si(beyond, unit, key.unit), "unit": unit})
            assert f".{key.name} = " in problems(wrong), (unit, bound)
    assert not problems(base)
    inside = {"value": 0.5 * (key.lower + key.upper), "unit": key.unit}
    for wrong in (
        with_value(inside | {"unit": "cd"}),
        with_value(inside | {"sigma": 1}),
        with_value({"value": "1", "unit": key.unit}),
        with_value(inside["value"]),
        with_value(inside, key.name + "_of_it"),
    ):
        assert f".{key.name}" in problems(wrong)


@pytest.mark.parametrize("name", rigs.names())
def test_the_core_can_move_what_it_says_a_fit_may_move(name: str) -> None:
    """Its table of parameters holds them, and no other value of a block."""
    rig = rigs.named(name)
    core = set(core_rig(rig).parameter_names)
    told = {
        f"{qualified(block, own)}.{key.name}"
        for block in BLOCKS
        for own, table in rig.tables(block).items()
        for key in keys_of(block, table)
        if key.moves and key.name in table
    }
    there = {name for name in core if name.partition(".")[0] in BLOCKS}
    # a line that begins at a block has no inlet, and not every rig a sensor of each kind
    without = {"inlet_volume", "pressure_zero", "angle_zero", "length_zero"}
    assert {name for name in told ^ there if name.rpartition(".")[2] not in without} == set()


def test_bounds_of_the_core_are_asked_where_only_it_is_asked() -> None:
    rig = rigs.named("shoulder")
    core = core_rig(rig)
    names = core.parameter_names
    for dotted in (name for name in names if name.partition(".")[0] in BLOCKS):
        known = rig.parameter(dotted)
        for value, away in ((known.lower, -1.0), (known.upper, 1.0)):
            moved = core.values
            moved[names.index(dotted)] = value
            with contextlib.suppress(RigError):  # numbers of one block that do not go together
                core.with_values(moved)
            moved[names.index(dotted)] = value + away * max(1e-9, 1e-3 * abs(value))
            with pytest.raises(ParameterError, match=dotted):
                core.with_values(moved)
