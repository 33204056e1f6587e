"""What a rig's blocks are connected to: ports given and by default, and every way in which they
cannot be.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pamrs import rigs
from pamrs.errors import RigError
from pamrs.rig import Rig, parse_rig
from pamrs.rig.schema import BLOCKS
from tests.rig.cases import HEAD, LEAST, refused, same, stand
from tests.tables import rows_of

# --------------------------------------------------------------------------------- ports

ARM = ("joint.elbow", "arm")
DEFAULTS = rows_of(__file__, "defaults")


@pytest.mark.parametrize(("blocks", "which", "wanted"), DEFAULTS)
def test_where_a_port_leads(blocks: tuple[str, ...], which: str, wanted: dict[str, str]) -> None:
    rig = parse_rig(stand(*blocks))
    kind, _, name = which.partition(".")
    assert rig.ports(kind)[name] == wanted
    assert same(rig, parse_rig(rig.to_toml_text()))


PLANAR = ("chamber", "muscle.a", "muscle.b", "joint.a", "joint.b", "planar")


def test_links_stand_base_first() -> None:
    for blocks in (
        ("link.a", "link.b"),
        ("link.b on=a", "link.a on=base"),
        ("link.b on=link.a", "link.a on=base"),
    ):
        rig = parse_rig(stand(*PLANAR, *blocks))
        assert list(rig.ports("link")) == ["a", "b"]
        assert [link["joint"] for link in json.loads(rig.to_json())["arm"]["links"]] == [
            "joint.a",
            "joint.b",
        ]
        assert rig.wiring[-1] == "arm: base -> joint.a -> link.a -> joint.b -> link.b"
        assert same(rig, parse_rig(rig.to_toml_text()))
    turned = parse_rig(stand(*PLANAR, "link.lower joint=b", "link.upper joint=joint.a"))
    assert turned.ports("link") == {
        "lower": {"on": "base", "joint": "joint.b"},
        "upper": {"on": "link.lower", "joint": "joint.a"},
    }


WRONG = rows_of(__file__, "wrong")


@pytest.mark.parametrize(("blocks", "wanted"), WRONG)
def test_what_cannot_be_connected_is_named(blocks: tuple[str, ...], wanted: list[str]) -> None:
    message = refused(stand(*blocks))
    assert [words for words in wanted if words not in message] == [], message


def test_one_mistake_is_one_problem() -> None:
    links, joints = (*PLANAR[:-1], "arm", "link.a", "link.b"), (*PLANAR, "link.a", "link.b joint=a")
    for blocks, _ in WRONG:
        message = refused(stand(*blocks))
        assert ("2 problems" in message) == (tuple(blocks) in (links, joints)), message
        assert "problems" not in message or "2 problems" in message, message
    message = refused(
        stand(
            "supply",
            "valve.a to=x",
            "valve.b",
            "line.b from=y",
            "chamber.a",
            "chamber.b",
            "muscle.c",
            *ARM,
        )
    )
    assert "3 problems" in message, message
    assert all(
        words in message
        for words in ("valve.a.to = 'x'", "line.b.from = 'y'", "muscle.c.chamber is missing")
    )


def test_wrong_values_and_wrong_ports_are_found_at_once() -> None:
    text = stand(
        "supply", "valve.a", "chamber.a", "chamber.b", "muscle.x joint=elbw", *ARM
    ).replace('value = 5, unit = "l"', 'value = -5, unit = "l"')
    message = refused(
        text.replace(
            'max_angle = { value = 90, unit = "deg" }', 'max_angle = { value = 0, unit = "deg" }'
        )
    )
    assert "4 problems" in message, message
    assert all(
        w in message
        for w in (
            "supply.volume",
            "muscle.x.chamber is missing",
            "'elbw'",
            "joint.elbow.max_angle = 0 deg",
        )
    )


# ------------------------------------------------------------------------------ the form

BARE = HEAD.replace("[gas]\n", "")
FORM = [
    *(
        ((BARE if "[gas" in text else HEAD) + text, said)
        for text, said in rows_of(__file__, "form")
    ),
    *(
        (f"{stand('chamber')}[{block}]\n{content}\n", said)
        for block, content, said in rows_of(__file__, "keys")
    ),
]


@pytest.mark.parametrize(("text", "wanted"), FORM)
def test_the_form_and_the_keys_of_blocks(text: str, wanted: list[str]) -> None:
    message = refused(text)
    assert [words for words in wanted if words not in message] == [], message


def test_a_link_without_inertia_and_a_chamber_below_vacuum() -> None:
    text = stand(*PLANAR, "link.a", "link.b")
    weightless = text.replace("mass = { value = 1,", "mass = { value = 0,").replace(
        "inertia = { value = 0.01,", "inertia = { value = 0,"
    )
    message = refused(weightless)
    assert "2 problems" in message
    assert "link.b has no inertia about its joint" in message
    thin = HEAD + 'ambient_pressure = { value = 0.5, unit = "bar" }\n[chamber]\n' + LEAST["chamber"]
    message = refused(thin + '\ninitial_pressure = { value = -0.6, unit = "bar" }\n')
    assert (
        "chamber.initial_pressure = -0.6 bar (gauge) is not allowed: more than "
        "-gas.ambient_pressure = -0.5 bar"
    ) in message


def test_only_an_inlet_that_valves_feed_has_a_volume() -> None:
    inlet = 'inlet_volume = { value = 5, unit = "cm3" }'
    fed = parse_rig(stand("supply", "valve", "orifice", "chamber", orifice=inlet))
    assert fed.ports("line")[""] == {"from": "", "to": "chamber"}
    assert fed.parameters["line.inlet_volume"].value == pytest.approx(5e-6)
    message = refused(stand("supply", "line", "chamber", line=inlet))
    assert "line.inlet_volume is not allowed: line begins at supply, and only an inlet" in message


def test_blocks_that_do_not_fit_are_found_in_a_rig_made_by_hand() -> None:
    rig = rigs.named("antagonistic_joint")
    model = rig.model
    model["supply"] = None
    with pytest.raises(RigError, match=r"\[valve\.flexor\] needs the block \[supply\]"):
        Rig("half", model).to_json()
    with pytest.raises(RigError, match="2 problems"):
        Rig("half", model).ports("valve")


# --------------------------------------------------------------------------- any rig at all

NAMES = st.lists(
    st.text("abcXYZ019_-", min_size=1, max_size=6), min_size=1, max_size=4, unique=True
).filter(lambda names: not set(names) & {key.where[0] for keys in BLOCKS.values() for key in keys})


@settings(max_examples=60, deadline=None)
@given(NAMES, st.booleans(), st.randoms(use_true_random=False))
def test_groups_by_name_and_by_ports_are_the_same_rig(
    names: list[str], hoses: bool, random: Any
) -> None:
    """Any number of groups: what the names alone settle is what ports in full say, in any order of
    the blocks.
    """
    kinds = ["valve", "chamber", "muscle", *(["line"] if hoses else [])]
    plain = [f"{kind}.{name}" for kind in kinds for name in names]
    after = "line" if hoses else "chamber"
    given = {
        "valve": "from=supply to=" + after + ".{0}",
        "line": "to=chamber.{0}",
        "chamber": "",
        "muscle": "chamber=chamber.{0} joint=joint.all",
    }
    full = [
        f"{entry} {given[entry.partition('.')[0]].format(entry.partition('.')[2])}"
        for entry in plain
    ]
    first = parse_rig(stand("supply", *plain, "joint.all", "arm"))
    second = parse_rig(stand("supply", *full, "joint.all", "arm"))
    assert first.to_json() == second.to_json()
    assert same(first, parse_rig(first.to_toml_text()))
    assert same(second, parse_rig(second.to_toml_text()))
    random.shuffle(full)
    shuffled = parse_rig(stand(*full, "arm", "joint.all", "supply"))
    assert {name: ends["to"] for name, ends in shuffled.ports("valve").items()} == {
        name: f"{after}.{name}" for name in names
    }
    assert set(shuffled.parameters) == set(first.parameters)


# -------------------------------------------------------------------- inlets of regulators

BOTTLED = """
[supply.bottle]
kind = "tank"
volume = { value = 5, unit = "l" }
initial_pressure = { value = 9, unit = "bar" }
[supply.regulator]
kind = "regulator"
inlet = "bottle"
initial_pressure = { value = 4, unit = "bar" }
[line]
kind = "orifice"
discharge_area = { value = 1, unit = "mm2" }
[chamber]
dead_volume = { value = 1, unit = "l" }
alpha_in = { value = 1, unit = "1" }
alpha_out = { value = 1, unit = "1" }
alpha = { value = 1, unit = "1" }
"""
TOP = 'schema = "pamrs.rig/1"\nname = "bottled"\n[gas]\n'


def test_an_inlet_is_read_written_told_and_passed_on(tmp_path: Path) -> None:
    rig = parse_rig(TOP + BOTTLED)
    assert rig.ports("supply") == {"bottle": {}, "regulator": {"inlet": "supply.bottle"}}
    assert rig.ports("line")[""]["from"] == "supply.regulator"  # the bottle is its inlet
    assert rig.wiring == ["air: supply.bottle -> supply.regulator -> line -> chamber"]
    rig.to_toml(tmp_path / "bottled.toml")
    written = (tmp_path / "bottled.toml").read_text()
    assert same(parse_rig(written), rig)
    assert 'inlet = "bottle"' in written
    in_full = parse_rig(TOP + BOTTLED.replace('"bottle"', '"supply.bottle"'))
    assert in_full.ports("supply") == rig.ports("supply")
    supplies = {supply["name"]: supply for supply in json.loads(rig.to_json())["supplies"]}
    assert supplies["regulator"]["inlet"] == "supply.bottle"
    assert "inlet" not in supplies["bottle"]
    fed = rig.with_parameters({"supply.bottle.volume": 1e-3})
    assert fed.ports("supply") == rig.ports("supply")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    rows_of(__file__, "an_inlet_that_cannot_be_is_refused"),
)
def test_an_inlet_that_cannot_be_is_refused(old: str, new: str, message: str) -> None:
    assert old in BOTTLED
    with pytest.raises(RigError, match=message):
        parse_rig(TOP + BOTTLED.replace(old, new))
