"""Campaigns on the independent plant: which cases, what it plays, what is right, wrong or open."""

import json
import math

import numpy as np
import pytest

from trial import campaign
from trial.campaign import (
    ARMS,
    RUNS,
    _Case,
    highest,
    is_right,
    page,
    scored,
    specs_of_campaigns,
    state_of,
)
from trial.rig_kinds import PAIR


def test_a_case_of_a_seed_is_the_same_however_many_are_made():
    few, many = specs_of_campaigns(7, 2), specs_of_campaigns(7, 5)
    assert many[:2] == few
    assert len({spec.name for spec in many}) == 5
    for spec in many:
        assert spec.recordings == (("free_log", "fit"),)
        assert (spec.duration, spec.lab.rate, spec.lab.missing) == (30.0, 100, "")


def key(effects=(), wrong=(), verdict="effects", mark="known"):
    told = [
        {"id": name, "mark": mark, "block": "chamber", "form": "a", "first_catalogue": True}
        | {"reached": 10.0, "catalogue_parameters": {}, "wanted": 10.0, "parameters": {}}
        for name in effects
    ]
    lab = {"rate": 100, "bits": 12, "dropouts": False, "missing": "", "one": True}
    return {
        "case": "a",
        "verdict": verdict,
        "effects": told,
        "wrong_parameters": dict.fromkeys(wrong, {"nominal": 1.0, "value": 2.0}),
        "terms": [],
        "model_error": {"percent": 0, "sizes": {}},
        "spec": {"percent": 0, "stated": False, "rig": "shoulder", "lab": lab},
    }


def result(*effects, verdict="effects", wrong=(), settled=True):
    return {
        "verdict": verdict,
        "effects": [{"id": name} for name in effects],
        "wrong_parameters": [{"name": name} for name in wrong],
        "answer": {"settled": settled},
        "limits": [{"effect": name, "distance": 6.0, "left": 10.0} for name in effects],
    }


@pytest.mark.parametrize(
    ("truth", "said", "state"),
    [
        (key(["leak_muscle"]), result("leak_muscle"), "right"),
        (key(["leak_muscle"]), result("leak_muscle", settled=False), "open"),
        (key(["leak_muscle"]), result("supply_leak"), "wrong"),
        (key(["leak_muscle", "payload_swing"]), result("leak_muscle"), "right"),
        (key(["leak_muscle"]), result("leak_muscle", wrong=["arm.payload"]), "wrong"),
        (key(["leak_muscle"]), result("leak_muscle", verdict="unlisted"), "wrong"),
        (key(["leak_muscle"]), None, "wrong"),
        # the catalogue has had a name for it since the plans
        (key(["tendon_compliance"], mark="unlisted"), result("tendon_give"), "right"),
        (key(wrong=["arm.payload"]), result(verdict="parameters", wrong=["arm.payload"]), "right"),
        (key(verdict="none"), result(verdict="none"), "right"),
        (key(verdict="none"), result("leak_muscle"), "wrong"),
        (key(verdict="unlisted"), result(verdict="unlisted"), "right"),
        (key(verdict="unlisted"), result(verdict="parameters"), "wrong"),
    ],
)
def test_a_result_is_right_wrong_or_open(truth, said, state):
    assert state_of(truth, said) == state
    assert said is None or state == "open" or is_right(truth, said) == (state == "right")


def test_the_plant_plays_commands_as_they_are_written(tmp_path):
    spec = next(spec for spec in specs_of_campaigns(7, 24, ["shoulder"]) if not spec.forms)
    case = _Case(tmp_path, spec)
    times = np.arange(401) * 0.005
    sent = 5.0 + 0.4 * (times > 0.5) - 0.8 * (times > 1.2)
    rows = "\n".join(f"{t:.9g},{u:.9g}" for t, u in zip(times, sent, strict=True))
    (tmp_path / "commands.csv").write_text(f"time [s],valve_command [V]\n{rows}\n")
    log = case.played(1, tmp_path / "commands.csv").splitlines()
    assert log[0].startswith("time [s],valve_command [V],supply_pressure [bar],muscle_pressure")
    table = np.array([[float(cell) for cell in line.split(",")] for line in log[1:]])
    assert table[:, 0] == pytest.approx(times[::2])  # at the rate of the log
    assert table[:, 1] == pytest.approx(sent[::2], abs=0.0025)  # of a converter of 12 bits
    pressure = table[:, 3]
    assert pressure[table[:, 0] < 0.5] == pytest.approx(0.0, abs=0.05)
    assert pressure[(table[:, 0] > 1.0) & (table[:, 0] < 1.2)].min() > 0.05


@pytest.mark.parametrize(
    ("rig", "unit", "bars"),
    [("regulated_joint", "Pa", 1e5), ("regulated_joint", "bar", 1.0), (PAIR, "V", 1.0)],
)
def test_regulators_and_pairs_play_their_commands(tmp_path, rig, unit, bars):
    spec = next(spec for spec in specs_of_campaigns(7, 24, [rig]) if not spec.forms)
    case = _Case(tmp_path, spec)
    names = (
        ["valve_command.extensor", "valve_command.flexor"] if rig == PAIR else ["supply_command"]
    )
    times = np.arange(201) * 0.01
    levels = {"valve_command.flexor": 5.5, "valve_command.extensor": 4.0, "supply_command": 2.0}
    rows = [",".join(f"{v:.9g}" for v in (t, *(levels[n] * bars for n in names))) for t in times]
    head = ",".join(["time [s]", *(f"{name} [{unit}]" for name in names)])
    (tmp_path / "commands.csv").write_text("\n".join([head, *rows]) + "\n")
    head, *log = case.played(1, tmp_path / "commands.csv").splitlines()
    table = np.array([[float(cell) for cell in line.split(",")] for line in log])
    columns = {cell.split(" [")[0]: table[:, k] for k, cell in enumerate(head.split(","))}
    for name in names:
        assert columns[name] == pytest.approx(levels[name], abs=0.0025)
    if rig == PAIR:
        for side, way in (("flexor", 1.0), ("extensor", -1.0)):  # filled, and vented
            pressure = columns[f"muscle_pressure.{side}"]
            assert way * (pressure[-1] - pressure[0]) > 0.4
    else:
        assert columns["muscle_pressure"][-1] == pytest.approx(2.0, abs=0.2)
    driven = case.driven(11, "multisine", 3.0).splitlines()
    assert len(driven) == 301


def test_what_is_there_is_scored_and_the_page_has_every_arm(tmp_path):
    for name, states in (("a", "right"), ("b", "open")):
        (tmp_path / "keys").mkdir(exist_ok=True)
        (tmp_path / "keys" / f"{name}.json").write_text(json.dumps(key(["leak_muscle"])))
        (tmp_path / "results" / name).mkdir(parents=True)
        for arm in ARMS[:2]:
            for count in range(RUNS + 1):
                said = result("leak_muscle", settled=states == "right")
                told = json.dumps({"seconds": 30.0 * count, "result": said})
                (tmp_path / "results" / name / f"{arm}_{count}.json").write_text(told)
    found = scored(tmp_path, ["a", "b"])
    last = found["campaign"][-1]
    assert (last["right"], last["open"], last["seconds"]) == (1, 1, 90.0)
    assert (last["first names"], last["wrong values"]) == ((2, 2), (0, 0))
    # the limits say by how much the nearest rival is off, in proportion to what the effect leaves
    assert (last["decidable"], last["decidable wrong"]) == ((1, 2), (0, 2))
    assert math.isnan(found["standard"][0]["seconds"])
    told = page(found, 2, [1.04, 1.2])
    assert "| campaign | 3 | 1 | 0 | 1 | 0.09 to 0.91 | 1/2 | 0/2 | 90 |" in told
    assert "recorded before: 1.20; above 1.1 in 1 of 2 cases" in told
    campaign.draw(found, tmp_path / "curve.svg")
    assert "campaign, right" in (tmp_path / "curve.svg").read_text()


def test_the_highest_pressure_of_a_run_is_a_share_of_that_before(tmp_path):
    step = tmp_path / "work" / "a" / "campaign" / "step_01"
    for folder, bar in ((tmp_path / "cases" / "a", (1.0, 4.0)), (step, (2.0, 5.0))):
        folder.mkdir(parents=True)
        rows = "".join(f"{k},{value}\n" for k, value in enumerate(bar))
        name = "free_log.csv" if folder is not step else "recording_1.csv"
        (folder / name).write_text("time [s],muscle_pressure [bar]\n" + rows)
    assert highest(tmp_path, ["a"]) == [1.25]
