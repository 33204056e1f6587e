"""The command line: exit codes, one-line errors, what goes to which stream."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs import cli
from pamrs.channels import unit_of
from pamrs.report.motion import write_animation
from tests.scripts import command as run
from tests.tables import rows_of

RIG = Path(pamrs.__file__).parent / "rigs" / "shoulder.toml"


def assert_one_clean_line(err, *parts):
    """A message that a person can read: one line, no traceback, naming what is wrong."""
    assert err.count("\n") == 1
    assert err.startswith("pamrs: error: ")
    assert "Traceback" not in err
    for part in parts:
        assert part in err


def test_version(capsys):
    code, out, err = run(capsys, "--version")
    assert code == 0
    assert out.startswith("pamrs ")
    assert err == ""


def test_no_words_print_help(capsys):
    code, out, _ = run(capsys)
    assert code == 0
    for command in ("diagnose", "simulate", "rig"):
        assert command in out


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["digest"], "digest"),
        (["diagnose"], "argument"),
        (["diagnose", "absent"], "absent"),
        (["diagnose", "x", "--colour"], "--colour"),
        (["simulate", "rig.toml", "--output"], "--output"),
        (["rig"], "command"),
        *rows_of(__file__, "a_name_that_is_almost_right_is_recognised"),
    ],
)
def test_wrong_usage_is_one_line(capsys, words, part):
    code, out, err = run(capsys, *words)
    assert (code, out) == (2, "")
    assert_one_clean_line(err, part)


@pytest.mark.parametrize("like", pamrs.rigs.names())
def test_a_new_rig_file_can_be_read_as_it_stands(capsys, tmp_path, like):
    file = tmp_path / "my arm.toml"
    words = ("rig", "new", file, "--like", like, "--gas", "coefficients")
    assert run(capsys, *words)[0] == 0
    assert run(capsys, "rig", "check", file)[0] == 0
    rig, packaged = pamrs.load_rig(file), pamrs.rigs.named(like)
    assert rig.name == "my arm"
    assert (rig.parameters, rig.wiring) == (packaged.parameters, packaged.wiring)
    text = file.read_text(encoding="utf-8")
    for word in ("friction", "elbow_linear", "polynomial", "leak_muscle", "from 0 to"):
        assert word in text
    assert "is there already" in run(capsys, *words)[2]
    code, _, err = run(capsys, "rig", "new", tmp_path / "other.toml", "--like", "knee")
    assert code == 2
    assert "'knee' does not come with the package; there are: shoulder" in err


def test_rig_check_names_the_file_and_the_key(capsys, tmp_path):
    broken = tmp_path / "broken.toml"
    broken.write_text(
        RIG.read_text(encoding="utf-8").replace("dead_volume", "dead_volum"), encoding="utf-8"
    )
    code, out, err = run(capsys, "rig", "check", broken)
    assert code == 2
    assert out == ""
    assert_one_clean_line(err, "broken.toml", "dead_volum")


def test_runs_as_a_module():
    done = subprocess.run(
        [sys.executable, "-m", "pamrs", "rig", "check", "absent.toml"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2
    assert_one_clean_line(done.stderr, "absent.toml")


def test_simulate_plays_a_recording_and_writes_and_draws_what_comes(capsys, tmp_path):
    run_ = pamrs.simulate(pamrs.rigs.shoulder(), np.full(41, 6.0), sample_time=0.01)
    columns = ("time", "valve_command", "muscle_pressure", "supply_pressure", "joint_angle")
    lines = [",".join(f"{name} [{unit_of(name)}]" for name in columns)]
    lines += [",".join(f"{run_[name][row]:.9g}" for name in columns) for row in range(41)]
    table = tmp_path / "input.csv"
    table.write_text("\n".join(lines) + "\n", encoding="utf-8")
    output, plot, motion = (tmp_path / f"run.{ending}" for ending in ("csv", "png", "gif"))
    words = ("simulate", "shoulder", "--input", table, "--animation", motion)
    files = ("--output", output, "--plot", plot)
    code, out, err = run(capsys, *words, *files, "--speed", "2")
    assert code == 0, err
    assert "run.csv" in out
    assert "muscle_pressure: rms difference from the recording" in out
    head = output.read_text(encoding="utf-8").partition("\n")[0].split(",")
    table = np.loadtxt(output, delimiter=",", skiprows=1)
    written = table[:, head.index("muscle_pressure [Pa]")]
    np.testing.assert_allclose(written, run_["muscle_pressure"], rtol=1e-6)
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert motion.read_bytes().startswith(b"GIF89a")
    code, _, err = run(capsys, *words, "--speed", "0")
    assert code == 2
    assert "speed = 0.0 is not allowed" in err


def test_simulate_says_that_a_command_is_beyond_the_valve(capsys):
    code, out, _ = run(
        capsys, "simulate", "elbow", "--hold", "valve_command = 6 V, 50 V @ 1 s, 5 V @ 2 s"
    )
    assert code == 0
    assert "valve: command clipped to its range of 0 to 10 V from 1 s to 2 s; 50 V was" in out


def test_a_chamber_has_no_motion(tmp_path):
    still = pamrs.simulate(
        pamrs.rigs.sealed_chamber(), sample_time=0.1, duration=1.0, initial={"muscle_pressure": 5e5}
    )
    with pytest.raises(
        pamrs.ParameterError, match="'sealed_chamber' has no arm and no load to draw"
    ):
        write_animation(still, tmp_path / "x.gif")


def test_an_interrupt_is_said_and_has_its_own_code(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def pressed(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("pamrs.rig.load_rig", pressed)
    assert cli.main(["rig", "check", "any.toml"]) == 1
    assert "pamrs: interrupted" in capsys.readouterr().err
