"""The scorer of the trial on results made by hand."""

import json

import pytest

from trial.__main__ import main
from trial.effects import LISTED
from trial.pictures import figure
from trial.score import score, utility
from trial.summary import by_strength, confusion, markdown, reliability
from trial.targets import wilson


def key(case, ids=(), kind=None, wanted=(), reach=4.0, left=4.0):
    return {
        "case": case,
        "kind": kind or "+".join(ids),
        "effects": list(ids),
        "wanted": dict(zip(ids, wanted, strict=False)),
        "reach": reach if ids else 0.0,
        "reach_left": left if ids else 0.0,
    }


def result(verdict, probabilities, effects=(), ambiguity=(), gap=None, seconds=10.0):
    return {
        "schema": "pamrs.diagnosis/1",
        "verdict": verdict,
        "effects": [
            {"id": e, "probability": probabilities.get(e, 0.5), "parameters": {}} for e in effects
        ],
        "ambiguity": [list(a) for a in ambiguity],
        "probabilities": probabilities,
        "fit": {"gap_closed": gap},
        "seconds": seconds,
    }


CASES = [
    (
        key("c01", kind="none"),
        result("none", {"none": 0.6, "parameters": 0.38, "leak_muscle": 0.02}),
    ),
    (key("c02", kind="parameters"), result("parameters", {"none": 0.1, "parameters": 0.85})),
    # a false alarm
    (
        key("c03", kind="none"),
        result("effects", {"none": 0.3, "leak_muscle": 0.7}, ["leak_muscle"]),
    ),
    (
        key("c04", ["leak_muscle"], wanted=["weak"], reach=1.5, left=0.4),
        result("none", {"none": 0.9, "leak_muscle": 0.1}, gap=0.0),
    ),
    (
        key("c05", ["leak_muscle"], wanted=["strong"], reach=10.0),
        result("effects", {"leak_muscle": 0.95}, ["leak_muscle"], gap=0.96),
    ),
    # the wrong name first, the truth in an ambiguity set
    (
        key("c06", ["muscle_creep"], wanted=["medium"], reach=3.3, left=1.0),
        result(
            "effects",
            {"muscle_hysteresis": 0.55, "muscle_creep": 0.45},
            ["muscle_hysteresis"],
            [["muscle_hysteresis"], ["muscle_creep"]],
            gap=0.9,
        ),
    ),
    (
        key("c07", ["leak_muscle", "muscle_creep"], wanted=["strong", "medium"]),
        result(
            "effects",
            {"leak_muscle": 0.9, "muscle_creep": 0.8},
            ["muscle_creep", "leak_muscle"],
            gap=0.92,
        ),
    ),
    (
        key("c08", ["hose_torque"], wanted=["strong"]),
        result("unlisted", {"unlisted": 0.8, "payload_swing": 0.2}, gap=0.5),
    ),
    (
        key("c09", ["hose_torque"], wanted=["medium"]),
        result("effects", {"payload_swing": 0.8}, ["payload_swing"], gap=0.4),
    ),
    (key("c10", ["leak_muscle"], wanted=["strong"]), None),
]


@pytest.fixture
def scored(tmp_path):
    for name in ("keys", "results"):
        (tmp_path / name).mkdir()
    for told, answer in CASES:
        (tmp_path / "keys" / f"{told['case']}.json").write_text(json.dumps(told))
        if answer is not None:
            (tmp_path / "results" / f"{told['case']}.json").write_text(json.dumps(answer))
    return score(tmp_path / "keys", tmp_path / "results")


def test_shares(scored):
    assert scored.shares == {
        "false alarms (null and parameter cases)": (1, 3),
        "detected (moves a channel by 3x noise)": (5, 6),
        "detected (3x noise left after a refit)": (4, 5),
        "right name first (catalogue effects)": (2, 5),
        "right name first (3x noise left)": (2, 3),
        "name or ambiguity set holds the truth": (3, 5),
        "name or set holds the truth (3x noise left)": (2, 3),
        "unlisted recognised": (1, 2),
    }


def test_totals(scored):
    totals = scored.totals
    assert totals["cases"] == 10
    assert totals["without a result"] == 1
    # none and parameters count as one; a pair by its less probable half
    truth = [0.98, 0.95, 0.3, 0.1, 0.95, 0.45, 0.8, 0.8, 0.0, 0.0]
    assert totals["mean probability on the truth (all cases)"] == pytest.approx(sum(truth) / 10)
    # the gaps of cases with an effect: 0, 0.96, 0.9, 0.92, 0.5, 0.4, and 0 without a result
    assert totals["median gap closed (cases with an effect)"] == pytest.approx(0.5)
    assert (totals["right"], totals["wrong"]) == (5, 4)
    assert "c06" in scored.text()


def test_utility_is_that_of_the_diagnosis_competition():
    truth = {"leak_muscle"}
    assert utility(truth, [truth], 20) == 1.0
    # one fault missed: n = 1, N = 20; one named wrongly: n' = 1, N' = 1
    assert utility(truth, [set()], 20) == pytest.approx(1.0 - 21.0 / (20.0 * 2.0))
    assert utility(set(), [truth], 20) == pytest.approx(1.0 - 2.0 / (20.0 * 2.0))
    # an ambiguity set of two counts half
    assert utility(truth, [truth, {"muscle_creep"}], 20) == pytest.approx(
        (1.0 + utility(truth, [{"muscle_creep"}], 20)) / 2.0
    )


def test_confusion(scored):
    found = confusion(scored.rows)
    assert found["leak_muscle"] == {"none": 1, "leak_muscle": 1, "no result": 1}
    assert found["muscle_creep"] == {"muscle_hysteresis": 1}
    assert found["hose_torque"] == {"unlisted": 1, "payload_swing": 1}
    assert found["none"] == {"none": 1, "leak_muscle": 1}
    assert not any("+" in name for name in found)


def test_by_strength(scored):
    found = by_strength(scored.rows)
    assert found["leak_muscle"] == {"weak": (0, 0, 1), "strong": (1, 1, 2)}
    assert found["muscle_creep"] == {"medium": (1, 0, 1)}
    assert found["pair"] == {"pair": (1, 1, 1)}
    assert "none" not in found


def test_reliability(scored):
    bins, brier = reliability(scored.rows)
    claims = [
        (0.98, 1),
        (0.95, 1),
        (0.7, 0),
        (0.9, 0),
        (0.95, 1),
        (0.55, 0),
        (0.9, 1),
        (0.8, 1),
        (0.8, 0),
    ]
    assert brier == pytest.approx(sum((p - ok) ** 2 for p, ok in claims) / 9)
    assert sum(n for *_, n in bins) == 9
    by_edge = {(lo, hi): (hits, n) for lo, hi, _, hits, n in bins}
    assert by_edge[0.95, 0.99] == (3, 3)
    assert by_edge[0.8, 0.9] == (1, 2)
    assert by_edge[0.5, 0.7] == (0, 1)


@pytest.mark.parametrize(
    ("hits", "cases", "low", "high"),
    [(5, 10, 0.2366, 0.7634), (0, 10, 0.0, 0.2775), (10, 10, 0.7225, 1.0), (1, 60, 0.0029, 0.0886)],
)
def test_wilson(hits, cases, low, high):
    assert wilson(hits, cases) == pytest.approx((low, high), abs=1e-4)


def test_wilson_wants_a_share():
    with pytest.raises(ValueError, match="is no share"):
        wilson(2, 1)


def test_report(scored, tmp_path):
    pytest.importorskip("matplotlib")
    text = markdown(scored)
    assert "| leak_muscle | 0, 0 of 1; 0.00 | - | 1, 1 of 2; 0.48 | - |" in text
    assert "33.3 % (6.1 to 79.2)" in text
    assert "Brier score" in text
    figure(scored, tmp_path / "trial.png")
    assert (tmp_path / "trial.png").read_bytes().startswith(b"\x89PNG")


def test_command_line(scored, tmp_path, capsys):
    told = [
        "score",
        "--keys",
        str(tmp_path / "keys"),
        "--results",
        str(tmp_path / "results"),
        "--markdown",
        str(tmp_path / "t.md"),
    ]
    assert main(told) == 0
    assert "false alarms" in capsys.readouterr().out
    assert (tmp_path / "t.md").read_text().startswith("## Targets")
    assert main(["score", "--keys", str(tmp_path / "none"), "--results", str(tmp_path)]) == 2


def test_names_of_the_catalogue_may_be_set(scored, tmp_path):
    # with the leak taken out of the catalogue, "unlisted" would be right, unless the result gives
    # it a probability
    again = score(
        tmp_path / "keys", tmp_path / "results", tuple(i for i in LISTED if i != "muscle_creep")
    )
    assert again.shares["unlisted recognised"][1] > scored.shares["unlisted recognised"][1]
