"""Plan `blocks`: its cases, the keys of wrong parameters, the scorer beside effects of no
catalogue, and its page.
"""

import hashlib
import json
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from trial import concealed
from trial.__main__ import main
from trial.blocks import size_of
from trial.concealed import RECORDINGS, WRONG, Spec, generate
from trial.effects import LISTED, TYPES, UNLISTED, Effects, draw
from trial.plan import ARM, GAS, PARAMETERS, _complete, blocks, kinds, specs, write_plan
from trial.plant import Plant
from trial.rigfile import default_rig, read_rig, to_parameters
from trial.score import score, score_case
from trial.strength import LABELS, STRENGTHS
from trial.summary import confusion
from trial.targets import targets

MODEL, TOLERANCE = read_rig(default_rig())
DEAD = "chamber.dead_volume"


def test_counts_of_the_plan():
    found = blocks(np.random.default_rng(3))
    assert len(found) == len(specs("blocks", 4)) == 120
    assert set(GAS) <= set(LISTED)
    assert set(ARM) <= set(UNLISTED)
    of = Counter(p.kind for p in found)
    assert (of["none"], of["parameters"], of[WRONG]) == (6, 6, 48)
    for name in GAS:
        alone = [p.labels for p in found if p.kind == name]
        pairs = [p for p in found if p.kind.startswith(f"{name}+")]
        assert sorted(alone) == [("medium",), ("strong",)]
        assert sorted(p.labels for p in pairs) == [
            (a, b) for a in ("medium", "strong") for b in ("heavy", "strong")
        ]
    # every effect of the arm takes its turn
    turns = Counter(p.kind.split("+")[1] for p in found if "+" in p.kind)
    assert set(turns) == set(ARM)
    assert sum(turns.values()) == 4 * len(GAS)
    assert max(turns.values()) - min(turns.values()) <= 2


def test_other_plans_know_nothing_of_heavy():
    assert tuple(STRENGTHS) == ("weak", "medium", "strong")
    assert LABELS["heavy"] == 20.0
    assert not any("heavy" in labels for _, labels in kinds("full", np.random.default_rng(1)))
    with pytest.raises(ValueError, match="known: full, small, blocks"):
        specs("huge", 1)


def test_a_group_shares_its_seed():
    made = specs("blocks", 5, measure="left")
    groups = {}
    for spec in made:
        groups.setdefault(spec.seed, []).append(spec)
    threes = [g for g in groups.values() if len(g) > 1]
    assert len(threes) == 20
    assert len(groups) == 20 + 60
    for group in threes:
        assert (
            len({(s.kind.split("+")[0], s.wanted[0], s.recordings, s.duration) for s in group}) == 1
        )
        assert sorted(s.wanted[1:] for s in group) == [(), ("heavy",), ("strong",)]
    # shuffled, and another seed gives another order
    assert [s.kind for s in made] != [p.kind for p in blocks(np.random.default_rng([5, 0, 4711]))]
    assert [s.kind for s in made] != [s.kind for s in specs("blocks", 6)]
    assert specs("blocks", 5, 20, measure="left") == made[:20]


def test_wrong_parameters_of_the_plan():
    found = [p.wrong[0] for p in blocks(np.random.default_rng(8)) if p.kind == WRONG]
    assert Counter(name for name, _ in found) == dict.fromkeys(PARAMETERS, 6)
    for name, z in found:
        section, key = name.split(".")
        assert 4.0 <= abs(z) <= 15.0
        assert MODEL[section][key] + z * TOLERANCE[name] >= 0.299 * MODEL[section][key]
    for name in PARAMETERS:
        down = sum(z < 0.0 for n, z in found if n == name)
        assert down == (0 if name == "arm.viscous" else 3)
    sizes = Counter(size_of(z) for n, z in found if n == "arm.payload")
    assert sizes == {"4 to 6 tolerances": 2, "7 to 10 tolerances": 2, "11 to 15 tolerances": 2}


def test_every_pair_fits_one_plant():
    rng = np.random.default_rng(1)
    for gas in GAS:
        for arm in ARM:
            Plant(to_parameters(MODEL), Effects(draw(gas, 1.0, rng), draw(arm, 1.0, rng)))


def test_key_of_a_wrong_parameter():
    spec = Spec("c", WRONG, 8, RECORDINGS[:2], 3.0, wrong=((DEAD, 8.0),))
    case = generate(spec, default_rig())
    key = json.loads(case.key)
    nominal = MODEL["chamber"]["dead_volume"]
    told = key["wrong_parameters"][DEAD]
    assert told == {
        "nominal": nominal,
        "value": pytest.approx(nominal + 8.0 * TOLERANCE[DEAD]),
        "tolerances": 8.0,
    }
    assert (key["kind"], key["verdict"], key["effects"]) == (WRONG, "parameters", [])
    assert key["parameters"][DEAD] == told["value"]
    assert all(abs(z) <= 1.0 for name, z in key["moved_tolerances"].items() if name != DEAD)
    assert key["reach"] > key["reach_left"] > 0.0
    # the rig file of the case holds the nominal value, and nothing else tells
    assert case.files["rig.toml"] == default_rig().read_text(encoding="utf-8")
    assert not any("dead_volume" in text for name, text in case.files.items() if name != "rig.toml")
    plain = json.loads(generate(replace(spec, kind="none", wrong=()), default_rig()).key)
    assert "wrong_parameters" not in plain
    others = [n for n in plain["parameters"] if n != DEAD]
    assert [plain["parameters"][n] for n in others] == [key["parameters"][n] for n in others]


def test_a_gas_effect_is_the_same_alone_and_beside_another(monkeypatch):
    one = Spec("a", "leak_muscle", 21, RECORDINGS[:2], 3.0, ("medium",), measure="left")
    # how large does not matter here
    monkeypatch.setattr(
        concealed, "aim", lambda simulate, target, most, start: (start, target, simulate(start)[1])
    )
    alone = json.loads(generate(one, default_rig()).key)
    keys = []
    for label in ("strong", "heavy"):
        two = replace(one, kind="leak_muscle+hose_torque", wanted=("medium", label))
        keys.append(json.loads(generate(two, default_rig()).key))
    for key in keys:
        assert key["verdict"] == "effects"
        assert key["effect_parameters"]["leak_muscle"] == alone["effect_parameters"]["leak_muscle"]
        assert (key["noise"], key["parameters"]) == (alone["noise"], alone["parameters"])
        start = {n: e["initial_supply_pressure"] for n, e in key["recordings"].items()}
        assert start == {n: e["initial_supply_pressure"] for n, e in alone["recordings"].items()}
    assert (
        keys[0]["effect_parameters"]["hose_torque"] != keys[1]["effect_parameters"]["hose_torque"]
    )


def test_another_spec_is_made_again(tmp_path):
    first = Spec("case_0001", WRONG, 8, RECORDINGS[:1], 2.0, wrong=((DEAD, 8.0),))
    manifest = write_plan(tmp_path, [first])
    digests = json.loads(manifest.read_text())["keys"]
    assert _complete(tmp_path, first, digests)
    assert not _complete(tmp_path, replace(first, wrong=((DEAD, 8.5),)), digests)
    assert not _complete(tmp_path, replace(first, wrong=(("arm.payload", 8.0),)), digests)
    assert not _complete(
        tmp_path, replace(first, recordings=((RECORDINGS[0][0], "held_out"),)), digests
    )
    made = []
    write_plan(tmp_path, [first], progress=lambda *a: made.append(a))
    assert not made
    write_plan(
        tmp_path, [replace(first, wrong=((DEAD, -4.5),))], progress=lambda *a: made.append(a)
    )
    assert made == [("case_0001", 1, 1)]


def test_another_strength_is_made_again(tmp_path):
    # the cases of a group differ in nothing else
    spec = Spec(
        "case_0001", "leak_muscle+hose_torque", 8, RECORDINGS[:1], 2.0, ("medium", "strong")
    )
    key = {
        "kind": spec.kind,
        "seed": 8,
        "duration": 2.0,
        "measure": "reach",
        "strength": 1.0,
        "wanted": {"leak_muscle": "medium", "hose_torque": "strong"},
        "recordings": {RECORDINGS[0][0]: {"role": RECORDINGS[0][1]}},
    }
    (tmp_path / "keys").mkdir()
    (tmp_path / "keys" / "case_0001.json").write_text(json.dumps(key))
    folder = tmp_path / "cases" / "case_0001"
    folder.mkdir(parents=True)
    for name in ("case.toml", "rig.toml", f"{RECORDINGS[0][0]}.csv"):
        (folder / name).write_text("")
    digests = {"case_0001": hashlib.sha256(json.dumps(key).encode()).hexdigest()}
    assert _complete(tmp_path, spec, digests)
    assert not _complete(tmp_path, replace(spec, wanted=("medium", "heavy")), digests)


def test_make_a_wrong_parameter(tmp_path, capsys):
    told = [
        "make",
        "--out",
        str(tmp_path / "cases"),
        "--seed",
        "3",
        "--kind",
        WRONG,
        "--recordings",
        "1",
        "--duration",
        "2",
    ]
    assert main([*told, "--parameter", DEAD, "--tolerances", "6"]) == 0
    key = json.loads((tmp_path / "cases_keys" / "case_001.json").read_text())
    assert key["wrong_parameters"][DEAD]["tolerances"] == 6.0
    for more, words in (
        ([], "go together"),
        (["--parameter", DEAD], "once for every"),
        (["--parameter", "arm.length", "--tolerances", "6"], "unknown parameter"),
        (["--parameter", DEAD, "--tolerances", "-7"], "-7 tolerances off is not allowed"),
    ):
        assert main([*told, *more]) == 2
        assert words in capsys.readouterr().err
    assert (
        main(
            [
                "make",
                "--out",
                str(tmp_path / "c"),
                "--seed",
                "3",
                "--kind",
                "none",
                "--parameter",
                DEAD,
                "--tolerances",
                "6",
            ]
        )
        == 2
    )


def key(case="c", ids=(), kind=None, wanted=(), wrong=None, seed=1):
    told = {
        "case": case,
        "kind": kind or ("+").join(ids),
        "effects": list(ids),
        "wanted": dict(zip(ids, wanted, strict=False)),
        "reach": 5.0,
        "reach_left": 5.0,
        "seed": seed,
    }
    if wrong:
        told["wrong_parameters"] = {
            n: {"nominal": 1.0, "value": 1.0 + 0.1 * z, "tolerances": z} for n, z in wrong.items()
        }
    return told


def result(verdict, probabilities, effects=(), *, wrong=None, unexplained=(), ambiguity=(), **more):
    return {
        "schema": ("pamrs.diagnosis/1"),
        "verdict": verdict,
        "effects": [{"id": e} for e in effects],
        "probabilities": probabilities,
        "ambiguity": [list(a) for a in ambiguity],
        "seconds": 10.0,
        "fit": {
            "gap_closed": None,
            "held_out": {"joint_angle": {"noise": 1.0, "refit": 9.0, "after": 1.5}},
        },
        "wrong_parameters": [{"name": n, "interval": list(i)} for n, i in (wrong or {}).items()],
        "unexplained": [
            {"block": b, "channel": "joint_angle", "noises": 15.0} for b in unexplained
        ],
        **more,
    }


def scored(told, answer):
    return score_case(told, answer, LISTED)


BESIDE = key(ids=["leak_muscle", "hose_torque"], wanted=["medium", "heavy"])


def test_listed_beside_unlisted():
    row = scored(
        BESIDE,
        result("effects", {"leak_muscle": 0.9, "none": 0.1}, ["leak_muscle"], unexplained=["arm"]),
    )
    assert (row.outcome, row.mixed, row.rest_said, row.labels, row.contains) == (
        "right",
        True,
        True,
        ("medium", "heavy"),
        True,
    )
    assert (row.probability, row.name_probability) == (0.9, 0.9)
    assert row.claim == (0.9, True)
    assert row.utility == 1.0
    silent = scored(BESIDE, result("effects", {"leak_muscle": 0.9}, ["leak_muscle"]))
    assert (silent.outcome, silent.rest_said) == ("right", False)
    assert silent.utility < 1.0
    # in another block
    assert (
        scored(BESIDE, result("effects", {}, ["leak_muscle"], unexplained=["supply"])).rest_said
        is False
    )
    # first comes something else, the truth is in a set or not
    wrong = result(
        "effects", {"payload_swing": 0.8}, ["payload_swing", "leak_muscle"], unexplained=["arm"]
    )
    assert scored(BESIDE, wrong).outcome == "wrong"
    assert (
        scored(BESIDE, {**wrong, "ambiguity": [["payload_swing"], ["leak_muscle"]]}).outcome
        == "ambiguous"
    )
    # a name in the arm after the right one does not matter to the name
    more = scored(BESIDE, result("effects", {}, ["leak_muscle", "payload_swing"]))
    assert (more.outcome, more.rest_said) == ("right", False)
    assert (
        scored(BESIDE, result("unlisted", {"unlisted": 0.9}, unexplained=["arm"])).outcome
        == "wrong"
    )
    missing = scored(BESIDE, None)
    assert (missing.outcome, missing.rest_said, missing.mixed) == ("wrong", False, True)


def test_probability_of_a_name_is_that_of_its_block():
    gas = {
        "blocks": ["supply", "chamber"],
        "probabilities": {"leak_muscle": 0.7, "leak_muscle+heat_transfer": 0.2, "none": 0.1},
    }
    arm = {"blocks": ["arm"], "probabilities": {"unlisted": 1.0}}
    answer = result("effects", {"leak_muscle+unlisted": 0.4}, ["leak_muscle"], blocks=[gas, arm])
    assert scored(BESIDE, answer).probability == pytest.approx(0.9)
    del answer["blocks"]
    assert scored(BESIDE, answer).probability == pytest.approx(0.4)


def test_listed_alone_is_scored_as_before():
    told = key(ids=["leak_muscle"], wanted=["medium"])
    row = scored(
        told, result("effects", {"leak_muscle": 0.9}, ["leak_muscle"], unexplained=["arm"])
    )
    assert (row.outcome, row.mixed, row.rest_said, row.unexplained, row.utility) == (
        "right",
        False,
        None,
        ("arm",),
        1.0,
    )
    # a parameter of another block beside the effect is no other claim
    both = {"leak_muscle": 0.5, "arm.payload+leak_muscle": 0.4, "arm.payload": 0.1}
    row = scored(told, result("effects", both, ["leak_muscle"], wrong={"arm.payload": (1.0, 2.0)}))
    assert (row.outcome, row.claim, row.probability) == (
        "right",
        (pytest.approx(0.9), True),
        pytest.approx(0.9),
    )
    assert row.utility == 1.0


FAR = key(kind=WRONG, wrong={DEAD: 8.0})


def test_wrong_parameter():
    row = scored(
        FAR, result("parameters", {DEAD: 0.95, "leak_muscle": 0.05}, wrong={DEAD: (1.7, 1.9)})
    )
    assert (row.outcome, row.contains, row.interval_holds, row.false_name) == (
        "right",
        True,
        True,
        False,
    )
    assert (row.claim, row.probability, row.utility, row.gap) == ((0.95, True), 0.95, 1.0, None)
    assert (row.wrong, row.wrong_named, row.first, row.held_out) == (
        ((DEAD, 8.0),),
        (DEAD,),
        DEAD,
        1.5,
    )
    assert not row.healthy
    assert (
        scored(FAR, result("parameters", {DEAD: 0.95}, wrong={DEAD: (1.2, 1.4)})).interval_holds
        is False
    )
    other = scored(
        FAR,
        result("parameters", {"arm.payload": 0.9, DEAD: 0.1}, wrong={"arm.payload": (1.0, 2.0)}),
    )
    assert (other.outcome, other.contains, other.interval_holds, other.claim[1]) == (
        "ambiguous",
        False,
        None,
        False,
    )
    both = scored(
        FAR, result("parameters", {}, wrong={"arm.payload": (1.0, 2.0), DEAD: (1.7, 1.9)})
    )
    assert (both.outcome, both.interval_holds) == ("ambiguous", True)
    quiet = scored(FAR, result("none", {"none": 0.9, DEAD: 0.1}))
    assert (quiet.outcome, quiet.contains, quiet.false_name, quiet.claim) == (
        "ambiguous",
        False,
        False,
        (0.9, False),
    )
    assert quiet.utility < 1.0
    effect = result("effects", {"leak_muscle": 0.6, DEAD: 0.4}, ["leak_muscle"])
    assert (scored(FAR, effect).outcome, scored(FAR, effect).false_name) == ("wrong", True)
    in_set = scored(FAR, {**effect, "ambiguity": [["leak_muscle"], [DEAD]]})
    assert (in_set.outcome, in_set.contains, in_set.false_name) == ("ambiguous", True, True)
    assert scored(
        FAR, result("parameters", {DEAD: 0.9}, wrong={DEAD: (1.7, 1.9)}, unexplained=["arm"])
    ).false_name
    assert scored(FAR, None).outcome == "wrong"


def test_two_wrong_parameters():
    told = key(kind=WRONG, wrong={"arm.payload": 8.0, "arm.first_moment": -5.0})
    names = {"arm.first_moment": (0.4, 0.6), "arm.payload": (1.7, 1.9)}
    row = scored(
        told,
        result(
            "parameters", {"arm.first_moment+arm.payload": 0.8, "arm.payload": 0.2}, wrong=names
        ),
    )
    assert (row.outcome, row.claim, row.probability, row.interval_holds) == (
        "right",
        (0.8, True),
        0.8,
        True,
    )
    row = scored(
        told, result("none", {"none": 1.0}, ambiguity=[["arm.first_moment+arm.payload"], ["none"]])
    )
    assert (row.outcome, row.contains) == ("ambiguous", True)


def test_nulls_with_a_wrong_parameter():
    row = scored(
        key(kind="none"),
        result("parameters", {"arm.payload": 0.6, "none": 0.4}, wrong={"arm.payload": (1.0, 2.0)}),
    )
    assert (row.outcome, row.false_name, row.detected, row.healthy) == (
        "ambiguous",
        True,
        False,
        True,
    )
    # the scorer takes it for healthy otherwise
    assert (row.claim, row.utility) == ((1.0, True), 1.0)
    assert not scored(key(kind="parameters"), result("parameters", {"parameters": 1.0})).false_name
    assert scored(key(kind="none"), result("unlisted", {"unlisted": 1.0})).false_name


@pytest.fixture
def trial(tmp_path):
    """A folder with keys, manifest and results of every sort."""
    cases = [
        (
            key("c1", ["leak_muscle"], wanted=["medium"]),
            result("effects", {"leak_muscle": 0.9}, ["leak_muscle"], unexplained=["arm"]),
        ),
        (
            key("c2", ["leak_muscle", "hose_torque"], wanted=["medium", "strong"]),
            result("effects", {"leak_muscle": 0.8}, ["leak_muscle"], unexplained=["arm"]),
        ),
        (
            key("c3", ["leak_muscle", "hose_torque"], wanted=["medium", "heavy"]),
            result("unlisted", {"unlisted": 0.8}),
        ),
        (
            key("c4", kind=WRONG, wrong={DEAD: 8.0}),
            result("parameters", {DEAD: 0.9}, wrong={DEAD: (1.7, 1.9)}),
        ),
        (
            key("c5", kind=WRONG, wrong={"arm.payload": -5.0}),
            result("effects", {"payload_swing": 0.9}, ["payload_swing"]),
        ),
        (key("c6", kind="none"), result("none", {"none": 0.9})),
        (key("c7", kind="parameters"), result("parameters", {DEAD: 0.9}, wrong={DEAD: (1.7, 1.9)})),
        (key("c8", ["hose_torque"], wanted=["strong"]), None),
    ]
    digests = {}
    for name in ("keys", "results", "cases"):
        (tmp_path / name).mkdir()
    for told, answer in cases:
        text = json.dumps(told)
        (tmp_path / "keys" / f"{told['case']}.json").write_text(text)
        digests[told["case"]] = hashlib.sha256(text.encode()).hexdigest()
        if answer is not None:
            (tmp_path / "results" / f"{told['case']}.json").write_text(json.dumps(answer))
    (tmp_path / "manifest.json").write_text(
        json.dumps({"schema": "pamrs.trial-manifest/1", "keys": digests})
    )
    return tmp_path


def test_shares(trial):
    found = score(trial / "keys", trial / "results")
    assert found.shares["false alarms (null and parameter cases)"] == (0, 2)
    assert found.shares["right name first (catalogue effects)"] == (1, 1)
    assert found.shares["right name first (beside an effect of no catalogue)"] == (1, 2)
    assert found.shares["unexplained rest is said"] == (1, 2)
    assert found.shares["unlisted recognised"] == (0, 1)
    assert found.shares["wrong parameter named"] == (1, 2)
    assert found.shares["stated interval holds the wrong parameter"] == (1, 1)
    assert found.shares["false names (no effect concealed)"] == (2, 4)
    assert confusion(found.rows)["arm.payload"] == {"payload_swing": 1}
    shares = {(t.name, t.over): t.share for t in targets(found)}
    assert shares["false alarms", "nulls and parameters only"] == (0, 2)
    assert shares["unlisted recognised", "effects of no catalogue, all"] == (0, 1)


def test_the_page(trial, capsys):
    out = trial / "proof"
    assert (
        main(
            [
                "blocks",
                str(trial),
                "--out",
                str(out),
                "--command",
                "python -m trial write trial_out --plan blocks",
            ]
        )
        == 0
    )
    text = (out / "blocks.md").read_text()
    assert hashlib.sha256((trial / "manifest.json").read_bytes()).hexdigest() in text
    assert "python -m trial write trial_out --plan blocks" in text
    assert (
        "| medium, 3.3 noises | beside 10 noises | 1 of 1; 100.0 % (20.7 to 100.0) | +0.0 | 0, "
        "0 | 1 of 1 | 0.800 |"
    ) in text
    assert (
        "| medium, 3.3 noises | beside 20 noises | 0 of 1; 0.0 % (0.0 to 79.3) | -100.0 | 1, 0 "
        "| 0 of 1 | 0.000 |"
    ) in text
    assert "| leak_muscle | 1 of 1; 0.900 | 1 of 1; 0.800 | 0 of 1; 0.000 |" in text
    assert "| alone | - | 1 of 1; 100.0 %" in text
    assert "| upwards, 7 to 10 tolerances | 1 of 1;" in text
    assert "| all | 4 | 1 of 4 | 0 of 4 | 1 of 2 | 2 of 4; 50.0 % (15.0 to 85.0) |" in text
    assert (
        "| c5 | arm.payload -5.0 tolerances | effects payload_swing | wrong, false name |" in text
    )
    assert "| c7 | parameters | parameters; wrong chamber.dead_volume | right, false name |" in text
    assert "| c8 | hose_torque (strong) | no result | wrong |" in text
    (trial / "keys" / "c1.json").write_text("{}")
    assert main(["blocks", str(trial), "--out", str(out)]) == 2
    assert "not the key that was published" in capsys.readouterr().err


def test_blocks_of_the_effects_are_known():
    acts = {
        name: scored(
            key(ids=["leak_muscle", name]),
            result("effects", {}, ["leak_muscle"], unexplained=["arm"]),
        ).rest_said
        for name in ARM
    }
    assert acts == dict.fromkeys(ARM, True)
    assert {TYPES[name].block for name in GAS} == {"supply", "valve", "line", "chamber"}
