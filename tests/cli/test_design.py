"""The command line of joint design."""

import json
import math
import re

import pytest

from pamrs import Joint, library, rigs
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
    low = run(capsys, words(pressure="183 psi"))[1]
    least = r"least torque [\d.]+ % below the wanted one at [\d.]+ deg"
    assert re.search(rf"met within 0\.1 % of the work wanted; {least}", low)
    assert "the requirement is met" not in low
    code, out, err = run(capsys, words())
    assert (code, err) == (0, "")
    assert "the requirement is met" in out
    for name in ("upper_axial", "upper_offset", "lower_axial", "lower_offset"):
        assert name in out
    assert run(capsys, words())[1] == out
    assert run(capsys, words("--seed", "1"))[1] != out


def test_files_hold_the_design(capsys, tmp_path):
    data, block = tmp_path / "a.json", tmp_path / "a.toml"
    outputs = ["--json", data, "--rig-joint", block]
    bounds = ("--bounds", "lu=10:60 mm", "--bounds", "rl=0 in:0.5 in")
    code, out, err = run(capsys, words(*bounds, *outputs))
    assert code == 0
    assert sorted(err.splitlines()) == sorted(f"written: {path}" for path in (data, block))
    document = json.loads(data.read_text())
    assert document["schema"] == "pamrs.joint_design/1"
    assert document["problem"]["bounds"]["upper_axial"] == pytest.approx([0.01, 0.06])
    assert document["problem"]["bounds"]["lower_offset"] == pytest.approx([0.0, 0.0127])
    assert document["problem"]["torque"] == pytest.approx(677.91, abs=0.01)
    design = document["design"]
    assert (design["evaluations"], document["seed"]) == (200, 0)
    joint = Joint(rest_angle=math.radians(15), **design["lengths"])
    torque = joint.torque(library.pam_a_1in(), design["pressure"], design["angle"], count=6)
    assert design["torque"] == pytest.approx(torque.tolist())
    text = rigs.shoulder().to_toml_text()
    rig = parse_rig(
        re.sub(r"\[joint\].*?(?=\n\[)", lambda _: block.read_text(), text, count=1, flags=re.DOTALL)
    )
    assert rig.model["joint"]["upper_axial"] == pytest.approx(design["lengths"]["upper_axial"])
    assert rig.model["joint"]["max_angle"] == pytest.approx(math.radians(120))


def test_the_least_pressure_gives_the_torque_at_every_angle(capsys, tmp_path):
    data = tmp_path / "a.json"
    code, out, _ = run(capsys, words("--minimise-pressure", "--json", data, evaluations="1000"))
    assert code == 0
    document = json.loads(data.read_text())
    design = document["design"]
    assert design["pressure"] < 1.31e6
    assert f"the least pressure found is {design['pressure'] / 1e5:.4g} bar" in out
    assert "no joint of any shape could do with less than" in out
    assert min(design["torque"]) >= (1.0 - 1e-9) * document["problem"]["torque"]
    assert (design["shortfall"], design["area_tolerance"]) == (0.0, 1e-3)


def test_a_requirement_that_cannot_be_met_is_a_result(capsys):
    tight = ("--minimise-pressure", "--bounds", "lu=0.2:0.21 m", "--bounds", "ll=0.2:0.21 m")
    code, out, _ = run(capsys, words(*tight, torque="500 kN m", evaluations="60"))
    assert code == 0
    assert "THE REQUIREMENT IS NOT MET" in out
    assert "no design was found that any pressure makes good enough" in out


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


def test_a_short_count_is_shown_to_a_person_only(capsys, monkeypatch):
    for person in (False, True):
        monkeypatch.setattr("sys.stderr.isatty", lambda person=person: person)
        with counted("designs") as done:
            done(1, 2)
        captured = capsys.readouterr()
        assert captured.out == ""
        assert ("designs" in captured.err) == person
