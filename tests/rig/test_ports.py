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

# --------------------------------------------------------------------------------- ports

ARM = ("joint.elbow", "arm")
DEFAULTS = [
    # a valve: the supply and the chamber of its name, else the only ones; a line comes before a
    # chamber
    (
        ("supply.a", "supply.b", "valve.a", "valve.b", "chamber.a", "chamber.b"),
        "valve.b",
        {"from": "supply.b", "to": "chamber.b"},
    ),
    (("supply.x", "valve.a", "chamber.y"), "valve.a", {"from": "supply.x", "to": "chamber.y"}),
    (("supply", "valve", "line", "chamber"), "valve", {"from": "supply", "to": "line"}),
    (
        ("supply", "valve.a", "valve.b", "line.a", "chamber.a", "chamber.b"),
        "valve.a",
        {"from": "supply", "to": "line.a"},
    ),
    (
        ("supply", "valve.a", "valve.b", "line.a", "chamber.a", "chamber.b"),
        "valve.b",
        {"from": "supply", "to": "chamber.b"},
    ),
    (
        ("supply", "valve.x", "line.hose to=a", "chamber.a", "chamber.b"),
        "valve.x",
        {"from": "supply", "to": "line.hose"},
    ),
    (
        ("supply", "valve.a", "line.a from=b", "chamber.a", "chamber.b"),
        "valve.a",
        {"from": "supply", "to": "chamber.a"},
    ),
    # as given: in full, or short where that is clear
    (
        ("supply", "valve.a from=chamber.tank", "chamber.a", "chamber.tank"),
        "valve.a",
        {"from": "chamber.tank", "to": "chamber.a"},
    ),
    (
        ("supply", "valve.a from=tank", "chamber.a", "chamber.tank"),
        "valve.a",
        {"from": "chamber.tank", "to": "chamber.a"},
    ),
    (
        ("supply", "valve from=supply to=b", "chamber.a", "chamber.b"),
        "valve",
        {"from": "supply", "to": "chamber.b"},
    ),
    (
        ("supply", "valve.a", "valve.b to=a", "chamber.a"),
        "valve.b",
        {"from": "supply", "to": "chamber.a"},
    ),
    (
        ("supply", "valve to=chamber.supply", "chamber.supply"),
        "valve",
        {"from": "supply", "to": "chamber.supply"},
    ),
    # a line: fed by a valve, else by the supply of its name, else, without valves, by the only
    # supply
    (("supply", "line", "chamber"), "line", {"from": "supply", "to": "chamber"}),
    (
        ("supply.a", "supply.b", "line.a", "chamber.a", "chamber.b"),
        "line.a",
        {"from": "supply.a", "to": "chamber.a"},
    ),
    (("supply", "valve", "line", "chamber"), "line", {"from": "", "to": "chamber"}),
    (
        ("supply.a", "supply.b", "valve.b", "line.a to=b from=supply.a", "chamber.b"),
        "line.a",
        {"from": "supply.a", "to": "chamber.b"},
    ),
    (("orifice from=chamber to=ambient", "chamber"), "line", {"from": "chamber", "to": "ambient"}),
    # a muscle: the chamber and the joint of its name, else the only ones, else the load
    (
        ("chamber.a", "chamber.b", "muscle.a", "muscle.b", *ARM),
        "muscle.a",
        {"chamber": "chamber.a", "joint": "joint.elbow"},
    ),
    (
        ("chamber", "muscle.a", "muscle.b", *ARM),
        "muscle.b",
        {"chamber": "chamber", "joint": "joint.elbow"},
    ),
    (
        ("chamber.a", "chamber.b", "muscle chamber=b", "load"),
        "muscle",
        {"chamber": "chamber.b", "joint": "load"},
    ),
    (
        ("chamber", "muscle.a joint=load", "load"),
        "muscle.a",
        {"chamber": "chamber", "joint": "load"},
    ),
]


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


WRONG = [
    # what no default settles
    (
        ("supply", "valve.flexor", "chamber.a", "chamber.b"),
        ["valve.flexor.to is missing: the rig has the chambers a, b; say which"],
    ),
    (
        ("supply.a", "supply.b", "valve", "chamber"),
        ["valve.from is missing: the rig has the supplies a, b; say which"],
    ),
    (("valve", "chamber"), ["the block [valve] needs the block [supply], which is missing"]),
    (("valve.x", "chamber.x"), ["the block [valve.x] needs the block [supply], which is missing"]),
    (
        ("chamber.a", "chamber.b", "muscle", *ARM),
        ["muscle.chamber is missing: the rig has the chambers a, b; say which"],
    ),
    (
        ("chamber", "muscle.x", *PLANAR[1:], "link.a", "link.b"),
        ["muscle.x.joint is missing: the rig has the joints a, b; say which"],
    ),
    (
        ("chamber", "muscle"),
        ["the block [muscle] needs the block [joint] or [load], which is missing"],
    ),
    (
        (*PLANAR, "link.a", "link.x"),
        ["link.x.joint is missing: the rig has the joints a, b; say which"],
    ),
    (
        ("line from=a", "chamber.a", "chamber.b"),
        ["line.to is missing: the rig has the chambers a, b; say which"],
    ),
    # a line that nothing feeds
    (
        ("supply", "valve", "line.a", "line.b from=supply", "chamber"),
        ["line.a.from is missing", "say which, or lead a valve to it"],
    ),
    (
        ("orifice to=ambient", "chamber"),
        ["line.from is missing: the rig has the chambers chamber; say which"],
    ),
    (
        ("supply", "valve.a", "chamber.a", "line.b to=a", "chamber.b", "line.a"),
        [
            "line.b.from is missing: the rig has the supplies supply and the chambers a, b; say "
            "which"
        ],
    ),
    # names of nothing
    (
        ("supply.tank", "valve from=supply.tnak", "chamber"),
        ["valve.from = 'supply.tnak' names no supply", "mean 'supply.tank'?"],
    ),
    (
        ("supply", "valve.a to=flexr", "chamber.flexor"),
        ["valve.a.to = 'flexr' names no line and no chamber", "mean 'flexor'?"],
    ),
    (("supply", "valve to=zzz", "chamber"), ["valve.to = 'zzz'", "there are: chamber"]),
    (
        ("chamber", "muscle joint=load", *ARM),
        ["muscle.joint = 'load' names no joint and no load; there are: joint.elbow"],
    ),
    (("chamber", "muscle joint=", *ARM), ["muscle.joint = ''"]),
    # names of the wrong thing
    (
        ("supply", "valve from=ambient", "chamber"),
        ["valve.from = 'ambient' is not allowed: one of supply, chamber"],
    ),
    (
        ("supply", "valve to=supply", "chamber"),
        ["valve.to = 'supply' is not allowed: one of chamber"],
    ),
    (("supply", "valve to=ambient", "chamber"), ["valve.to = 'ambient' is not allowed"]),
    (
        ("supply", "valve.a to=a", "line.a", "chamber.a"),
        ["valve.a.to = 'a' is not clear: line.a or chamber.a"],
    ),
    (("orifice from=ambient", "chamber"), ["line.from = 'ambient' is not allowed: one of chamber"]),
    # both ends the same, fed from two sides
    (
        ("supply", "valve from=chamber", "chamber"),
        ["valve: from and to are both chamber; two different ends are needed"],
    ),
    (("line.a from=a", "chamber.a"), ["line.a: from and to are both chamber.a"]),
    (
        ("supply", "valve to=line", "line from=a to=b", "chamber.a", "chamber.b"),
        ["valve.to = 'line' is not allowed: line.from = 'a', so that no valve feeds it"],
    ),
    (
        ("supply", "valve", "orifice", "chamber"),
        ["line.inlet_volume = 0 m3 is not allowed", "between an orifice and the valves"],
    ),
    # muscles and transmissions
    (
        ("chamber", "muscle.a", "free.a", "arm"),
        ["muscle.a pulls on joint.a, which is free: the block [transmission.a] is missing"],
    ),
    (
        ("chamber", "muscle.flexor", "transmission.flexr", *ARM),
        ["[transmission.flexr] is named after no muscle", "mean 'flexor'?"],
    ),
    (
        ("chamber", "muscle.flexor", "transmission", *ARM),
        ["the block [transmission] is without a name, as no muscle is"],
    ),
    (
        ("chamber", "muscle", "transmission", "load"),
        ["the block [transmission] is not allowed: muscle pulls on the load, straight"],
    ),
    # arms
    ((*PLANAR[:-1], "arm"), ["arm.kind = 'one_link' is not allowed with the joints a, b"]),
    (
        (*PLANAR[:-1], "arm", "link.a", "link.b"),
        ["arm.kind = 'one_link' is not allowed with link.a, link.b: 'planar'"],
    ),
    (PLANAR, ["arm.kind = 'planar' needs a block [link] for each joint, and there is none"]),
    ((*PLANAR, "link.a"), ["joint.b moves no link: a [link] with joint = 'joint.b' is needed"]),
    (
        (*PLANAR, "link.a", "link.b joint=a"),
        ["link.b.joint = 'joint.a' is not allowed: joint.a moves link.a already"],
    ),
    (
        (*PLANAR, "link.a", "link.b on=base"),
        ["link.b.on = 'base' is not allowed: base carries link.a already"],
    ),
    (
        (*PLANAR, "link.a on=b", "link.b on=a"),
        ["link.a, link.b: each is on another of them, in a circle"],
    ),
    ((*PLANAR, "link.a", "link.b on=link.b"), ["link.b: each is on another of them, in a circle"]),
    (
        ("chamber", "link"),
        ["the block [link] needs the block [arm] with kind = 'planar', which is missing"],
    ),
    (("chamber", "muscle", "load", *ARM), ["the block [load] does not go with [joint] and [arm]"]),
    (("chamber", *ARM), ["the block [joint] needs the block [muscle], which is missing"]),
    # sensors
    (
        ("chamber.flexor", "sensors.flexr"),
        ["the block [sensors.flexr] is named after no chamber and no joint", "mean 'flexor'?"],
    ),
]


@pytest.mark.parametrize(("blocks", "wanted"), WRONG)
def test_what_cannot_be_connected_is_named(blocks: tuple[str, ...], wanted: list[str]) -> None:
    message = refused(stand(*blocks))
    for words in wanted:
        assert words in message, message


def test_one_mistake_is_one_problem() -> None:
    links, joints = (*PLANAR[:-1], "arm", "link.a", "link.b"), (*PLANAR, "link.a", "link.b joint=a")
    for blocks, _ in WRONG:
        message = refused(stand(*blocks))
        assert ("2 problems" in message) == (blocks in (links, joints)), message
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
            "joint.elbow.max_angle = 0 rad",
        )
    )


# ------------------------------------------------------------------------------ the form

FORM = [
    (
        "[chamber]\ndead_volume = { value = 1, unit = 'l' }\n[chamber.b]\n",
        ["[chamber] has dead_volume and [chamber.b]: either one [chamber]"],
    ),
    (
        "[chamber]\ndead_volum = { value = 1, unit = 'l' }\n",
        ["unknown key 'chamber.dead_volum'; did you mean 'dead_volume'?"],
    ),
    (
        "[chamber.b]\ndead_volum = { value = 1, unit = 'l' }\n",
        ["unknown key 'chamber.b.dead_volum'", "chamber.b.dead_volume is missing"],
    ),
    (
        "[chamber.'a b']\ndead_volume = { value = 1, unit = 'l' }\n",
        ["the name 'a b' is not allowed: letters, digits, _ and -"],
    ),
    ("[chamber.'']\ndead_volume = { value = 1, unit = 'l' }\n", ["the name '' is not allowed"]),
    (
        "[gas.left]\n[chamber]\ndead_volume = { value = 1, unit = 'l' }\n",
        ["[gas.left] is not allowed: a rig has one [gas], without a name"],
    ),
    ("[chamber.a]\ndead_volume = { value = 0, unit = 'l' }\n", ["chamber.a.dead_volume = 0 m3"]),
    (
        (
            "[chamber.a]\ndead_volume = { value = 1, unit = 'l' }\n"
            "initial_pressure = { value = -2, unit = 'bar' }\n"
        ),
        ["chamber.a.initial_pressure"],
    ),
    (
        "[chamber]\ndead_volume = { value = 1, unit = 'l' }\n[valve.a]\nfrom = 3\n",
        ["valve.a.from = 3 is not allowed: the name of a block"],
    ),
    (
        "[chamber]\ndead_volume = { value = 1, unit = 'l' }\n[valve.a]\nform = 'x'\n",
        ["'valve.a.form'", "did you mean 'from'?"],
    ),
    (
        (
            "[chamber]\ndead_volume = { value = 1, unit = 'l' }\n[muscle]\ncount = 2\n"
            "friktion = { floor = 0.1 }\n"
        ),
        ["unknown key 'muscle.friktion'; did you mean 'friction'?"],
    ),
]


@pytest.mark.parametrize(("text", "wanted"), FORM)
def test_the_form_of_blocks(text: str, wanted: list[str]) -> None:
    head = HEAD.replace("[gas]\n", "") if "[gas" in text else HEAD
    message = refused(head + text)
    for words in wanted:
        assert words in message, message


KEYS = [
    (
        "supply",
        'kind = "constant"\nvolume = { value = 1, unit = "l" }',
        ["supply.volume is not allowed with 'constant': only with tank"],
    ),
    (
        "supply",
        'kind = "bottle"',
        ["supply.kind = 'bottle' is not allowed: one of 'tank', 'constant', 'regulator'"],
    ),
    (
        "supply",
        'droop = { value = 1, unit = "Pa s/kg" }',
        ["supply.droop is not allowed with 'tank': only with regulator"],
    ),
    (
        "supply",
        'kind = "regulator"\ntime_constant = { value = 0, unit = "s" }',
        ["supply.time_constant = 0 s", "from 0.0001 to 100"],
    ),
    (
        "line",
        'kind = "orifice"\nlength = { value = 1, unit = "m" }',
        ["line.length is not allowed with 'orifice'", "line.discharge_area is missing"],
    ),
    ("line", "", ["line.length is missing", "line.diameter is missing"]),
    (
        "joint",
        'kind = "free"\nradius = { value = 1, unit = "m" }',
        ["joint.radius is not allowed with 'free': only with pulley"],
    ),
    (
        "transmission",
        'kind = "free"',
        ["transmission.kind = 'free' is not allowed: one of 'tendon'"],
    ),
    (
        "arm",
        'kind = "planar"\ninertia = { value = 1, unit = "kg m2" }',
        ["arm.inertia is not allowed with 'planar': only with one_link"],
    ),
    ("link", 'mass = { value = -1, unit = "kg" }', ["link.mass = -1 kg", "link.length is missing"]),
]


@pytest.mark.parametrize(("block", "content", "wanted"), KEYS)
def test_keys_of_the_kinds_of_block(block: str, content: str, wanted: list[str]) -> None:
    message = refused(f"{stand('chamber')}[{block}]\n{content}\n")
    for words in wanted:
        assert words in message, message


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
        "chamber.initial_pressure = -60000 Pa (gauge) is not allowed: more than "
        "-gas.ambient_pressure = -50000 Pa"
    ) in message


def test_only_an_inlet_that_valves_feed_has_a_volume() -> None:
    inlet = 'inlet_volume = { value = 5, unit = "cm3" }'
    fed = parse_rig(stand("supply", "valve", "orifice", "chamber", orifice=inlet))
    assert fed.ports("line")[""] == {"from": "", "to": "chamber"}
    assert fed.parameters["line.inlet_volume"].value == pytest.approx(5e-6)
    message = refused(stand("supply", "line", "chamber", line=inlet))
    assert (
        "line.inlet_volume = 5e-06 m3 is not allowed: line begins at supply, and only an inlet"
        in message
    )


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
    [
        ('inlet = "bottle"', 'inlet = "botle"', r"did you mean '(supply\.)?bottle'"),
        ('inlet = "bottle"', 'inlet = "regulator"', "it is the regulator itself"),
        ('inlet = "bottle"', 'inlet = "chamber"', "inlet = 'chamber' is not allowed"),
        ('inlet = "bottle"', "inlet = 3", "the name of a block is needed"),
        ('kind = "tank"', 'kind = "tank"\ninlet = "regulator"', "only with regulator"),
        (
            'kind = "tank"\nvolume = { value = 5, unit = "l" }',
            'kind = "regulator"',
            "it is a regulator; a tank or a constant supply is needed",
        ),
    ],
)
def test_an_inlet_that_cannot_be_is_refused(old: str, new: str, message: str) -> None:
    assert old in BOTTLED
    with pytest.raises(RigError, match=message):
        parse_rig(TOP + BOTTLED.replace(old, new))
