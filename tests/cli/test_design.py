"""The command line of joint design."""

import json
import math
import re
import sys
from functools import partial

import numpy as np
import pytest

from pamrs import Joint, library, rigs
from pamrs.cli import design as cli_design
from pamrs.cli._shared import counted
from pamrs.rig import parse_rig
from tests.scripts import command
from tests.tables import rows_of

ARGUMENTS = {
    "--muscle": "pam_a_1in",
    "--count": "6",
    "--torque": "500 ft lbf",
    "--min-angle": "15 deg",
    "--max-angle": "120 deg",
    "--pressure": "190 psi",
    "--evaluations": "200",
}


def words(*more, **changes):
    given = ARGUMENTS | {f"--{name.replace('_', '-')}": value for name, value in changes.items()}
    return ["design", "joint", *(word for pair in given.items() for word in pair), *map(str, more)]


def run(capsys, arguments):
    return command(capsys, *arguments)


def test_a_design_is_printed_and_repeats_by_its_seed(capsys):
    low = run(capsys, words("--method", "de", pressure="183 psi"))[1]
    least = r"least torque [\d.]+ % below the wanted one at [\d.]+ deg"
    assert re.search(rf"met within 0\.1 % of the work wanted; {least}", low)
    assert "the requirement is met" not in low
    code, out, err = run(capsys, words("--method", "de"))
    assert (code, err) == (0, "")
    assert "the requirement is met" in out
    for name in ("upper_axial", "upper_offset", "lower_axial", "lower_offset"):
        assert name in out
    assert run(capsys, words("--method", "de"))[1] == out
    assert run(capsys, words("--method", "de", "--seed", "1"))[1] != out


@pytest.mark.parametrize("method", ["ga", "de", "cma"])
def test_files_hold_the_design(capsys, tmp_path, method):
    data, picture, block = (tmp_path / name for name in ("a.json", "a.png", "a.toml"))
    outputs = ["--json", data, "--png", picture, "--rig-joint", block]
    bounds = ("--bounds", "lu=10:60 mm", "--bounds", "rl=0 in:0.5 in")
    code, out, err = run(capsys, words("--method", method, *bounds, *outputs))
    assert code == 0
    assert sorted(err.splitlines()) == sorted(f"written: {path}" for path in (data, picture, block))
    document = json.loads(data.read_text())
    assert document["schema"] == "pamrs.joint_design/1"
    assert document["problem"]["bounds"]["upper_axial"] == pytest.approx([0.01, 0.06])
    assert document["problem"]["bounds"]["lower_offset"] == pytest.approx([0.0, 0.0127])
    assert document["problem"]["torque"] == pytest.approx(677.91, abs=0.01)
    design = document["design"]
    assert (design["method"], design["evaluations"]) == (method, 200)
    joint = Joint(rest_angle=math.radians(15), **design["lengths"])
    torque = joint.torque(library.pam_a_1in(), design["pressure"], design["angle"], count=6)
    assert design["torque"] == pytest.approx(torque.tolist())
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    text = rigs.shoulder().to_toml_text()
    rig = parse_rig(
        re.sub(r"\[joint\].*?(?=\n\[)", lambda _: block.read_text(), text, count=1, flags=re.DOTALL)
    )
    assert rig.model["joint"]["upper_axial"] == pytest.approx(design["lengths"]["upper_axial"])
    assert rig.model["joint"]["max_angle"] == pytest.approx(math.radians(120))


def test_minimum_pressure_comparison_and_front(capsys, tmp_path, monkeypatch):
    from pamrs import design

    front = design.pareto_front
    monkeypatch.setattr(design, "pareto_front", partial(front, population=20, generations=10))
    data, picture = tmp_path / "a.json", tmp_path / "a.png"
    outputs = ["--json", data, "--png", picture]
    wanted = ("--method", "de", "--minimise-pressure", "--compare", "--pareto")
    code, out, _ = run(capsys, words(*wanted, *outputs, evaluations="100"))
    assert code == 0
    document = json.loads(data.read_text())
    lowest = document["minimum_pressure"]
    assert lowest["met"]
    assert lowest["pressure"] == document["design"]["pressure"] < 1.31e6
    assert f"pressure {lowest['pressure'] / 1e5:.4g} bar" in out
    assert "the smallest at which this search succeeded" in out
    strict = document["least_pressure"]
    assert f"strict, direct search: {strict['pressure'] / 1e5:.4g} bar" in out
    assert min(strict["torque"]) >= (1.0 - 1e-9) * document["problem"]["torque"]
    assert (strict["shortfall"], document["design"]["area_tolerance"]) == (0.0, 1e-3)
    assert document["design"]["shortfall"] >= 0.0
    assert [row["method"] for row in document["comparison"]] == ["ga", "de", "cma", "random"]
    assert {row["evaluations"] for row in document["comparison"]} == {100}
    assert np.all(np.diff(document["front"]["size"]) > 0.0)
    assert picture.stat().st_size > 50_000


def test_a_requirement_that_cannot_be_met_is_a_result(capsys):
    code, out, _ = run(
        capsys, words("--minimise-pressure", "--method", "de", torque="500 kN m", evaluations="60")
    )
    assert code == 0
    assert "THE REQUIREMENT IS NOT MET" in out
    assert "NO PRESSURE UP TO" in out
    assert "strict, direct search: " in out


def test_no_design_of_the_direct_search_is_said():
    assert "no design was found" in cli_design._strict_line(None)


@pytest.mark.parametrize(
    ("changes", "more", "part"),
    rows_of(__file__, "wrong_input_is_named"),
)
def test_wrong_input_is_named(capsys, changes, more, part):
    code, out, err = run(capsys, words(*more, **changes))
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert err.startswith("pamrs: error: ")
    assert part in err


@pytest.mark.parametrize(
    ("package", "more"),
    [("deap", []), ("cma", ["--method", "cma"]), ("deap", ["--method", "de", "--pareto"])],
)
def test_a_missing_package_is_named(capsys, tmp_path, monkeypatch, package, more):
    monkeypatch.chdir(tmp_path)
    for name in list(sys.modules):
        if name.startswith((package, "pamrs.design._genetic")):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    code, out, err = run(capsys, words(*more, evaluations="20"))
    assert (code, out) == (2, "")
    assert package in err
    assert "pip install 'pamrs[search]'" in err


def test_a_package_that_is_broken_is_named(capsys, tmp_path, monkeypatch):
    (tmp_path / "cma.py").write_text("from math import no_such_name\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "cma", raising=False)
    code, out, err = run(capsys, words("--method", "cma", evaluations="20"))
    assert (code, out) == (2, "")
    assert "which cannot be loaded (cannot import name 'no_such_name'" in err


def test_a_short_count_is_shown_to_a_person_only(capsys, monkeypatch):
    for person in (False, True):
        monkeypatch.setattr("sys.stderr.isatty", lambda person=person: person)
        with counted("runs") as done:
            done(1, 2)
        captured = capsys.readouterr()
        assert captured.out == ""
        assert ("runs" in captured.err) == person
