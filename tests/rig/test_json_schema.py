"""The JSON schemas of rig.toml and case.toml: what they forbid, the readers refuse; what is in the
repository passes.
"""

from __future__ import annotations

import contextlib
import copy
import json
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pamrs import cli, rigs
from pamrs.declared import accepts
from pamrs.effects import EFFECTS
from pamrs.errors import CaseError, ParameterError, RigError
from pamrs.recordings import case_schema, load_case
from pamrs.rig import parse_rig
from pamrs.rig.json_schema import rig_schema
from pamrs.rig.schema import BLOCKS, Key, keys_of, qualified
from pamrs.simulation import core_rig
from pamrs.units import from_si, spellings

ROOT = Path(__file__).parents[2]
RIGS = jsonschema.Draft202012Validator(rig_schema())
CASES = jsonschema.Draft202012Validator(case_schema())
FOLDERS = ("python/pamrs/rigs", "cases", "tests", "trial", "demo", "reproduction")


def files(schema: str) -> list[Path]:
    """TOML files of the repository of a schema."""
    found = (file for folder in FOLDERS for file in sorted((ROOT / folder).rglob("*.toml")))
    return [file for file in found if f'schema = "{schema}"' in file.read_text(encoding="utf-8")]


def shown(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f'"{k}" = {shown(v)}' for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(shown, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    return repr(value)


def text(document: dict[str, Any]) -> str:
    return "\n".join(f'"{key}" = {shown(value)}' for key, value in document.items())


def reads(document: dict[str, Any]) -> bool:
    try:
        parse_rig(text(document))
    except RigError:
        return False
    return True


def rig_of(name: str) -> dict[str, Any]:
    return tomllib.loads((ROOT / f"python/pamrs/rigs/{name}.toml").read_text(encoding="utf-8"))


def test_the_schemas_are_schemas() -> None:
    for schema in (RIGS.schema, CASES.schema):
        jsonschema.Draft202012Validator.check_schema(schema)
    assert len(files("pamrs.rig/1")) > 30
    assert len(files("pamrs.case/1")) > 15


@pytest.mark.parametrize("file", files("pamrs.rig/1"), ids=lambda f: str(f.relative_to(ROOT)))
def test_every_rig_of_the_repository_passes(file: Path) -> None:
    RIGS.validate(tomllib.loads(file.read_text(encoding="utf-8")))


@pytest.mark.parametrize("file", files("pamrs.case/1"), ids=lambda f: str(f.relative_to(ROOT)))
def test_every_case_of_the_repository_passes(file: Path) -> None:
    CASES.validate(tomllib.loads(file.read_text(encoding="utf-8")))


def test_every_form_of_every_effect_passes_and_no_other_parameter() -> None:
    base = rig_of("shoulder")
    for info in EFFECTS.values():
        for form in info.forms:
            values = {p.name: {"value": p.default, "unit": p.unit} for p in form.parameters}
            entry = {"id": info.id, "form": form.name, "parameters": values}
            RIGS.validate(base | {"effects": [entry]})
            first = next(iter(form.parameters))
            for wrong in (
                values | {"weight": {"value": 1, "unit": "1"}},
                values | {first.name: {"value": 2 * first.upper + 1, "unit": first.unit}},
                values | {first.name: {"value": first.default, "unit": "cd"}},
                values | {first.name: first.default},
            ):
                document = base | {"effects": [entry | {"parameters": wrong}]}
                assert not RIGS.is_valid(document), (info.id, form.name, wrong)
                assert not reads(document), (info.id, form.name, wrong)


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
    """Scalars of blocks, each with a rig that can have it."""
    found = []
    for block, home in HOMES.items():
        document = rig_of(home)
        table = table_in(document, block)
        found += [(block, key) for key in BLOCKS[block] if key.name in table and not key.path]
    return [(block, key) for block, key in found if key.kind == "scalar"]


@pytest.mark.parametrize(("block", "key"), numbers(), ids=lambda v: getattr(v, "name", v))
def test_bounds_of_the_core_are_those_of_schema_and_reader_in_other_units(
    block: str, key: Key
) -> None:
    """The schema accepts a bound; beyond it both refuse, and a wrong key and a wrong unit."""
    base = rig_of(HOMES[block])

    def with_value(value: Any, name: str = key.name) -> dict[str, Any]:
        document = copy.deepcopy(base)
        table_in(document, block)[name] = value
        return document

    for unit in dict.fromkeys((key.unit, *spellings(key.unit)[-1:])):
        for bound, away in ((key.lower, -1.0), (key.upper, 1.0)):
            beyond = bound + away * max(1e-3, 1e-3 * abs(bound))
            wrong = with_value({"value": from_si(beyond, unit, key.unit), "unit": unit})
            assert not RIGS.is_valid(wrong), (unit, bound)
            assert not reads(wrong), (unit, bound)
            assert RIGS.is_valid(
                with_value({"value": from_si(bound, unit, key.unit), "unit": unit})
            )
    inside = {"value": 0.5 * (key.lower + key.upper), "unit": key.unit}
    for wrong in (
        with_value(inside | {"unit": "cd"}),
        with_value(inside | {"unit": "A"}),
        with_value(inside | {"sigma": 1}),
        with_value({"value": "1", "unit": key.unit}),
        with_value(inside["value"]),
        with_value(inside, key.name + "_of_it"),
    ):
        assert not RIGS.is_valid(wrong)
        assert not reads(wrong)


SCRAPS = st.one_of(
    st.none(), st.booleans(), st.integers(-5, 5), st.floats(allow_nan=False, allow_infinity=False),
    st.sampled_from(["bar", "tank", "orifice", "pulley", "free", "map", "regulator", "", "m"]),
    st.builds(
        lambda v, u: {"value": v, "unit": u},
        st.floats(-1e6, 1e6), st.sampled_from(["bar", "m", "1", "rad", "V", "deg", "kg", "degC"]),
    ),
)  # fmt: skip


@settings(max_examples=100, deadline=None)
@given(
    home=st.sampled_from(sorted({*HOMES.values()})),
    block=st.sampled_from([*BLOCKS, "limits", "effects"]),
    place=st.integers(0, 60),
    value=SCRAPS,
    remove=st.booleans(),
)
def test_what_the_schema_forbids_the_reader_refuses(
    home: str, block: str, place: int, value: Any, remove: bool
) -> None:
    document = rig_of(home)
    if isinstance(document.get(block), dict) and document[block]:
        table = table_in(document, block)
        keys = [key.where[0] for key in BLOCKS.get(block, ())]
        names = list(table) if remove else [*table, *keys, "nothing"]
        name = names[place % len(names)] if names else "nothing"
        if remove or value is None:
            table.pop(name, None)
        else:
            table[name] = value
    elif value is not None:
        document[block] = value
    if not RIGS.is_valid(document):
        assert not reads(document), text(document)


CASE = """schema = "pamrs.case/1"
[[recording]]
file = "a.csv"
"""
WRONG = {
    'role = "held"': "role",
    "start = true": "start",
    'delimiter = ";;"': "delimiter",
    'decimal = ""': "decimal",
    "header = 1": "header",
    "columns = 1": "columns",
    "columns = [1]": "columns",
    "thousands = { time = 1 }": "thousands",
    "pieces = []": "pieces",
    'sample_time = "1 s"': "sample_time",
    'name = ""': "name",
    "frequency = 1": "frequency",
    'split = "clock"': "split",
    'parameters = { "gas.temperature" = 300 }': "parameters",
    'parameters = { "gas.temperature" = { value = 300, unit = "K", error = "little" } }': "error",
    'parameters = { "gas.temperature" = { value = 300, units = "K" } }': "parameters",
    'channels = { muscle_pressure = { column = "p" } }': "unit",
    'channels = { muscle_pressure = { column = "p", unit = "mm" } }': "unit",
    'channels = { muscle_pressure = { column = "p", unit = "bar", gain = 2 } }': "gain",
    'channels = { pressure = { column = "p", unit = "bar" } }': "pressure",
    'channels = { muscle_pressure = { column = "p", unit = "bar" } }\nsplit = "pause"': "split",
    'channels = { length = { column = "p", unit = "m" } }\ntime = { unit = "m" }': "unit",
}  # fmt: skip


@pytest.mark.parametrize("line", WRONG)
def test_what_the_schema_of_a_case_forbids_the_reader_refuses(line: str, tmp_path: Path) -> None:
    (tmp_path / "rig.toml").write_text(
        (ROOT / "python/pamrs/rigs/sealed_chamber.toml").read_text(encoding="utf-8"),
        encoding="utf-8",
    )
    (tmp_path / "a.csv").write_text(
        "time [s],muscle_pressure [bar]\n"
        + "".join(f"{0.01 * k},{1 + 0.01 * k}\n" for k in range(200)),
        encoding="utf-8",
    )
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    CASES.validate(tomllib.loads(CASE))
    load_case(tmp_path)  # as it is, it can be read
    (tmp_path / "case.toml").write_text(CASE + line + "\n", encoding="utf-8")
    assert not CASES.is_valid(tomllib.loads(CASE + line))
    with pytest.raises((CaseError, ParameterError), match=WRONG[line]):
        load_case(tmp_path)


@pytest.mark.parametrize(
    "unit",
    ["bar", "barg", "bar(g)", "kPa gauge", "psi_g", "N/mm2", "psig.", "kg/(m s2)", "mmHg"],
)
def test_units_that_the_reader_knows_pass(unit: str) -> None:
    document = rig_of("shoulder")
    document["chamber"]["initial_pressure"] = {"value": 0, "unit": unit}
    assert reads(document), unit
    assert RIGS.is_valid(document), unit


def test_values_are_asked_as_the_schema_says() -> None:
    assert accepts({"type": "number"}, 1.0)
    assert not accepts({"type": "number"}, True)
    assert accepts({"type": "string", "minLength": 1, "maxLength": 1}, ";")
    assert not accepts({"type": "string", "maxLength": 1}, ";;")
    texts = {"type": "array", "items": {"type": "string"}, "minItems": 1}
    assert accepts(texts, ["a"])
    assert not accepts(texts, [])
    assert not accepts(texts, [1])
    assert not accepts({"type": "object", "additionalProperties": {"type": "string"}}, {"a": 1})
    assert accepts({"anyOf": [texts, {"const": 2}]}, 2)
    assert not accepts({"enum": ["a"]}, "b")
    assert accepts({}, None)


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


@pytest.mark.parametrize(
    ("what", "name"),
    [("rig", "pamrs.rig/1"), ("case", "pamrs.case/1"), ("result", "pamrs.diagnosis/2")],
)
def test_the_command_writes_each(
    what: str, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["schema", what]) == 0
    shown_first = capsys.readouterr().out
    assert json.loads(shown_first)["title"] == name
    file = tmp_path / f"{what}.schema.json"
    assert cli.main(["schema", what, "--out", str(file)]) == 0
    assert file.read_text(encoding="utf-8") == shown_first
