"""The command line: exit codes, one-line errors, what goes to which stream."""

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import pamrs
from pamrs import cli
from pamrs.findings import Protocol
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
        (["diagnose", "x", "--colour"], "--colour"),
        (["simulate", "rig.toml", "--output"], "--output"),
        (["rig"], "command"),
    ],
)
def test_wrong_usage_is_one_line(capsys, words, part):
    code, out, err = run(capsys, *words)
    assert code == 2
    assert out == ""
    assert_one_clean_line(err, part)


def test_rig_check_lists_parameters(capsys):
    code, out, err = run(capsys, "rig", "check", RIG)
    assert code == 0
    assert err == ""
    assert "valve.discharge_area_max" in out
    alpha = next(line for line in out.splitlines() if line.startswith("chamber.alpha_in "))
    assert "1" not in alpha.split()[-1:]  # a plain number has no unit behind it
    assert "is valid" in out.splitlines()[-1]


def test_rig_check_names_the_file_and_the_key(capsys, tmp_path):
    broken = tmp_path / "broken.toml"
    broken.write_text(
        RIG.read_text(encoding="utf-8").replace("dead_volume", "dead_volum"), encoding="utf-8"
    )
    code, out, err = run(capsys, "rig", "check", broken)
    assert code == 2
    assert out == ""
    assert_one_clean_line(err, "broken.toml", "dead_volum")


def test_rig_file_that_is_no_toml(capsys, tmp_path):
    broken = tmp_path / "broken.toml"
    broken.write_text("[supply\nvolume = 1", encoding="utf-8")
    code, _, err = run(capsys, "rig", "check", broken)
    assert code == 2
    assert_one_clean_line(err)


@pytest.mark.parametrize("command", [["rig", "check"], ["diagnose"]])
def test_missing_file(capsys, tmp_path, command):
    code, out, err = run(capsys, *command, tmp_path / "absent")
    assert code == 2
    assert out == ""
    assert_one_clean_line(err, "absent")


def test_output_folder_is_checked_before_the_work(capsys, tmp_path):
    code, _, err = run(
        capsys, "diagnose", tmp_path, "--report", tmp_path / "absent" / "report.html"
    )
    assert code == 2
    assert_one_clean_line(err, "absent", "does not exist")


def test_simulate_writes_units_and_values(capsys, tmp_path):
    time = np.arange(0.0, 0.5, 0.005)
    volts = 5.0 + 2.0 * (time > 0.1)
    rows = "\n".join(f"{t:.3f},{v:.1f},13.8,1.0,20.0" for t, v in zip(time, volts, strict=True))
    header = (
        "time [s],valve_command [V],supply_pressure [bar],muscle_pressure [bar],joint_angle [deg]"
    )
    source, target = tmp_path / "in.csv", tmp_path / "out.csv"
    source.write_text(f"{header}\n{rows}\n", encoding="utf-8")
    code, out, err = run(capsys, "simulate", RIG, "--input", source, "--output", target)
    assert code == 0, err
    assert "out.csv" in out
    lines = target.read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("time [s],")
    assert "muscle_pressure [Pa]" in lines[0]
    assert len(lines) == len(time) + 1
    pressure = [
        float(line.split(",")[lines[0].split(",").index("muscle_pressure [Pa]")])
        for line in lines[1:]
    ]
    assert np.all(np.isfinite(pressure))
    assert pressure[-1] > pressure[0]


class FakeDiagnosis:
    """Stands in for a diagnosis, which takes many seconds; the real one has its own tests."""

    model = 'name = "x"\n'
    rig = None

    class next_experiment:
        excitation: dict = {}
        protocol = Protocol(
            "staircase",
            np.arange(3) * 0.1,
            {"valve_command": np.full(3, 5.0)},
            {"valve_command": "V"},
        )

    def summary(self):
        return "verdict: none"

    def to_json(self, path=None):
        text = json.dumps({"verdict": "none"})
        if path is not None:
            Path(path).write_text(text, encoding="utf-8")
        return text

    def report(self, path):
        Path(path).write_text("<html>", encoding="utf-8")

    def pdf(self, path):
        Path(path).write_bytes(b"pdf")

    def figure(self, path):
        Path(path).write_bytes(b"png")


def test_diagnose_writes_what_it_is_asked_for(capsys, tmp_path, monkeypatch):
    import pamrs.diagnosis
    import pamrs.recordings

    class Loaded:
        name = "a case"
        path = tmp_path
        recordings = (SimpleNamespace(channels={"valve_command": np.array([4.0, np.nan, 4.9])}),)

    monkeypatch.setattr(pamrs.recordings, "load_case", lambda folder, **options: Loaded())
    monkeypatch.setattr(pamrs.diagnosis, "diagnose", lambda case, **options: FakeDiagnosis())
    options = ("report", "json", "pdf", "png", "model", "experiment")
    paths = {word: tmp_path / f"out.{word}" for word in options}
    options = [part for word, path in paths.items() for part in (f"--{word}", path)]
    code, out, err = run(capsys, "diagnose", tmp_path, *options)
    assert code == 0, err
    assert out == "verdict: none\n"
    assert "diagnosing a case" in err
    for path in paths.values():
        assert path.stat().st_size > 0
        assert str(path) in err
    commands = paths["experiment"].read_text(encoding="utf-8").splitlines()
    assert commands == ["time [s],valve_command [V]", "0,5", "0.1,5", "0.2,5"]
    assert "goes from" not in err  # within 5 % of what was recorded
    Loaded.recordings = (SimpleNamespace(channels={"valve_command": np.full(3, 4.0)}),)
    _, _, err = run(capsys, "diagnose", tmp_path, "--experiment", tmp_path / "far.csv")
    assert "valve_command goes from 5.0 V to 5.0 V, and was recorded from 4.0 V to 4.0 V" in err
    code, out, err = run(capsys, "diagnose", tmp_path, "--json", "-", "--quiet")
    assert (code, json.loads(out), err) == (0, {"verdict": "none"}, "")
    # where there is nothing to play, that is said in the place of a file
    monkeypatch.setattr(FakeDiagnosis.next_experiment, "protocol", None)
    absent = tmp_path / "absent.csv"
    code, _, err = run(capsys, "diagnose", tmp_path, "--experiment", absent)
    assert code == 0
    assert not absent.exists()
    assert f"not written: {absent}: no experiment is proposed" in err


def test_runs_as_a_module():
    done = subprocess.run(
        [sys.executable, "-m", "pamrs", "rig", "check", "absent.toml"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2
    assert_one_clean_line(done.stderr, "absent.toml")


def test_help_loads_nothing_heavy():
    code = (
        "import sys; from pamrs.cli import main; main(['--help']);"
        "sys.exit(','.join(m for m in ('scipy', 'pandas', 'matplotlib', 'jinja2') if m in "
        "sys.modules) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("like", pamrs.rigs.names())
def test_a_new_rig_file_can_be_read_as_it_stands(capsys, tmp_path, like):
    file = tmp_path / "my arm.toml"
    assert cli.main(["rig", "new", str(file), "--like", like, "--gas", "coefficients"]) == 0
    rig = pamrs.load_rig(file)
    assert rig.name == "my arm"
    assert rig.parameters == pamrs.rigs.named(like).parameters
    text = file.read_text(encoding="utf-8")
    for word in ("friction", "elbow_linear", "polynomial", "leak_muscle", "from 0 to"):
        assert word in text
    assert cli.main(["rig", "check", str(file)]) == 0
    capsys.readouterr()
    assert cli.main(["rig", "new", str(file)]) == 2
    assert "is there already" in capsys.readouterr().err
    assert cli.main(["rig", "new", str(tmp_path / "other.toml"), "--like", "knee"]) == 2
    assert "'knee' does not come with the package; there are: shoulder" in capsys.readouterr().err


def test_rig_check_takes_the_name_of_a_packaged_rig(capsys):
    assert cli.main(["rig", "check", "sealed_chamber"]) == 0
    assert "'sealed_chamber' is valid" in capsys.readouterr().out


def test_simulate_draws_channels_and_motion(capsys, tmp_path):
    run_ = pamrs.simulate(pamrs.rigs.shoulder(), np.full(41, 6.0), sample_time=0.01)
    lines = [
        "time [s],valve_command [V],muscle_pressure [Pa],supply_pressure [Pa],joint_angle [rad]"
    ]
    columns = ("time", "valve_command", "muscle_pressure", "supply_pressure", "joint_angle")
    lines += [",".join(f"{run_[name][row]:.9g}" for name in columns) for row in range(41)]
    table = tmp_path / "input.csv"
    table.write_text("\n".join(lines) + "\n", encoding="utf-8")
    plot, motion = tmp_path / "run.png", tmp_path / "run.gif"
    code, _, err = run(
        capsys,
        "simulate",
        "shoulder",
        "--input",
        table,
        "--plot",
        plot,
        "--animation",
        motion,
        "--speed",
        "2",
    )
    assert code == 0, err
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert motion.read_bytes().startswith(b"GIF89a")
    code, out, err = run(capsys, "simulate", "shoulder", "--input", table)
    assert code == 0, err
    assert "muscle_pressure: rms difference from the recording" in out
    code, _, err = run(
        capsys, "simulate", "shoulder", "--input", table, "--animation", motion, "--speed", "0"
    )
    assert code == 2
    assert "speed = 0.0 is not allowed" in err


@pytest.mark.parametrize(
    ("words", "part"),
    rows_of(__file__, "a_name_that_is_almost_right_is_recognised"),
)
def test_a_name_that_is_almost_right_is_recognised(capsys, words, part):
    code, out, err = run(capsys, *words)
    assert code == 2
    assert out == ""
    assert_one_clean_line(err, part)


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
        still.animate(tmp_path / "x.gif")


def test_an_interrupt_is_said_and_has_its_own_code(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def pressed(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("pamrs.rig.load_rig", pressed)
    assert cli.main(["rig", "check", "any.toml"]) == 1
    assert "pamrs: interrupted" in capsys.readouterr().err
