"""Outputs: what could not be written is refused before the work; what is done is not lost."""

import errno
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import pamrs
import pamrs.diagnosis
import pamrs.recordings
from pamrs import _writing, cli
from pamrs._writing import check_writable, write_atomically
from pamrs.errors import ParameterError
from pamrs.findings import Protocol
from tests.scripts import command as run


class Done:
    """Stands in for a finished diagnosis, which takes many seconds."""

    model = 'name = "x"\n'
    rig = None

    class next_experiment:
        excitation: dict = {}
        protocol = None

    def summary(self):
        return "verdict: none"

    def to_json(self, path=None):
        return "{}\n" if path is None else write_atomically(path, "{}\n")

    def report(self, path):
        return write_atomically(path, "<html>")

    def pdf(self, path):
        return write_atomically(path, b"%PDF")

    def figure(self, path):
        return write_atomically(path, b"png")


@pytest.fixture
def loaded(tmp_path):
    """Stands in for a case."""
    return SimpleNamespace(name="a case", path=tmp_path, recordings=())


@pytest.fixture
def diagnosed(monkeypatch, loaded):
    """A diagnosis that is done at once; how often it was asked for."""
    asked = []
    monkeypatch.setattr(pamrs.recordings, "load_case", lambda *given, **options: loaded)
    monkeypatch.setattr(
        pamrs.diagnosis, "diagnose", lambda case, **options: asked.append(case) or Done()
    )
    return asked


@pytest.mark.usefixtures("diagnosed")
def test_diagnose_writes_what_it_is_asked_for(capsys, tmp_path, loaded):
    options = ("report", "json", "pdf", "png", "model")
    paths = {word: tmp_path / f"out.{word}" for word in options}
    words = [part for word, path in paths.items() for part in (f"--{word}", path)]
    code, out, err = run(capsys, "diagnose", tmp_path, *words)
    assert (code, out) == (0, "verdict: none\n")
    assert "diagnosing a case" in err
    for path in paths.values():
        assert path.stat().st_size > 0
        assert str(path) in err
    told = run(capsys, "diagnose", tmp_path, "--json", "-", "--quiet")
    assert told == (0, "{}\n", "")


@pytest.mark.usefixtures("diagnosed")
def test_the_next_experiment_is_written_and_held_against_what_was_recorded(
    capsys, tmp_path, loaded, monkeypatch
):
    volts = {"valve_command": np.full(3, 5.0)}
    protocol = Protocol("staircase", np.arange(3) * 0.1, volts, {"valve_command": "V"})
    monkeypatch.setattr(Done.next_experiment, "protocol", protocol)
    file = tmp_path / "next.csv"

    def said(*recorded):
        loaded.recordings = [SimpleNamespace(channels={"valve_command": np.array(recorded)})]
        code, _, err = run(capsys, "diagnose", tmp_path, "--experiment", file)
        assert code == 0
        return err

    assert "goes from" not in said(4.0, np.nan, 4.9)  # within 5 % of what was recorded
    commands = file.read_text(encoding="utf-8").splitlines()
    assert commands == ["time [s],valve_command [V]", "0,5", "0.1,5", "0.2,5"]
    told = "valve_command goes from 5.0 V to 5.0 V, and was recorded from 4.0 V to 4.0 V"
    assert told in said(4.0, 4.0)
    # where there is nothing to play, that is said in the place of a file
    monkeypatch.setattr(Done.next_experiment, "protocol", None)
    file = tmp_path / "absent.csv"
    assert f"not written: {file}: no experiment is proposed" in said(4.0)
    assert not file.exists()


@pytest.mark.parametrize(
    "option", ["--report", "--json", "--pdf", "--png", "--model", "--experiment"]
)
def test_what_cannot_be_written_is_refused_before_the_work(capsys, tmp_path, diagnosed, option):
    for path, part in (
        (tmp_path / "absent" / "a", "does not exist"),
        (tmp_path, "is a folder"),
        ("/proc/a", "takes no file"),
    ):
        code, out, err = run(capsys, "diagnose", tmp_path, option, path)
        assert (code, out, diagnosed) == (2, "", [])
        assert str(path) in err
        assert part in err


def test_two_results_in_one_file_are_refused(capsys, tmp_path, diagnosed):
    same = tmp_path / "a.json"
    code, _, err = run(capsys, "diagnose", tmp_path, "--json", same, "--model", same)
    assert (code, diagnosed) == (2, [])
    assert "are the same file" in err


def test_a_full_disk_is_seen_before_the_work(tmp_path, monkeypatch):
    class Full:
        def __enter__(self):
            return self

        def __exit__(self, *_):
            return None

        def write(self, data):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(_writing.tempfile, "TemporaryFile", lambda **_: Full())
    with pytest.raises(OSError, match=r"a\.json: cannot be written.* \(No space left on device\)"):
        check_writable(tmp_path / "a.json")


def test_a_check_leaves_nothing_behind(tmp_path):
    (tmp_path / "there").write_text("kept", encoding="utf-8")
    check_writable(tmp_path / "a", None, tmp_path / "there", "/dev/null", "/dev/null")
    assert [p.name for p in tmp_path.iterdir()] == ["there"]
    assert (tmp_path / "there").read_text(encoding="utf-8") == "kept"
    with pytest.raises(ParameterError, match="are the same file"):
        check_writable(tmp_path / "a", f"{tmp_path}/./a")


def test_what_is_done_is_told_although_a_file_cannot_be_written(
    capsys, tmp_path, monkeypatch, diagnosed
):
    def full(self, path):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Done, "to_json", full)
    json, report = tmp_path / "a.json", tmp_path / "a.html"
    code, out, err = run(capsys, "diagnose", tmp_path, "--json", json, "--report", report)
    assert code == cli.NOT_WRITTEN == 4
    assert out == "verdict: none\n"
    assert f"not written: {json} (No space left on device)" in err
    assert f"written: {report}" in err
    assert report.read_text(encoding="utf-8") == "<html>"
    assert not json.exists()


#: A diagnosis that is done at once, run as the command is.
DONE = """
import sys
from pathlib import Path
import pamrs.diagnosis, pamrs.recordings
from pamrs import cli
from tests.cli.test_outputs import Done
class Loaded:
    name, path = "a case", Path(".")
pamrs.recordings.load_case = lambda *given, **options: Loaded()
pamrs.diagnosis.diagnose = lambda case, **options: Done()
sys.exit(cli.main(["diagnose", ".", "--json", "a.json"]))
"""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="/dev/full is needed")
@pytest.mark.parametrize(
    ("streams", "told"),
    [
        (">&-", "verdict: none"),
        ("2>/dev/full", ""),
        (">/dev/full 2>&-", ""),
    ],
)
def test_a_stream_that_takes_nothing_costs_no_result(tmp_path, streams, told):
    """What is done is written first, then told wherever it can be, and the exit code says that some
    of it could not.
    """
    root = Path(__file__).parents[2]
    paths = os.pathsep.join([str(Path(pamrs.__file__).parents[1]), str(root)])
    done = subprocess.run(
        ["sh", "-c", f'exec "$0" -c "$1" {streams}', sys.executable, DONE],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == cli.NOT_WRITTEN == 4
    assert (tmp_path / "a.json").read_text(encoding="utf-8") == "{}\n"
    assert told in done.stderr
    assert "Traceback" not in done.stderr + done.stdout
    if streams.startswith("2"):
        assert done.stdout == "verdict: none\n"


def test_a_new_file_has_the_mode_that_the_user_wants(tmp_path):
    before = os.umask(0o027)
    try:
        write_atomically(tmp_path / "a", "new")
    finally:
        os.umask(before)
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o640


def test_a_file_that_was_there_keeps_its_mode(tmp_path):
    file = tmp_path / "a"
    file.write_text("before", encoding="utf-8")
    file.chmod(0o600)
    write_atomically(file, "after")
    assert file.read_text(encoding="utf-8") == "after"
    assert file.stat().st_mode & 0o777 == 0o600


def test_a_file_is_whole_or_as_before(tmp_path, monkeypatch):
    file = tmp_path / "a"
    file.write_text("before", encoding="utf-8")

    def broken(*_):
        raise OSError(errno.ENOSPC, "full")

    monkeypatch.setattr(_writing.os, "replace", broken)
    with pytest.raises(OSError, match="full"):
        write_atomically(file, "after")
    assert [(p.name, p.read_text(encoding="utf-8")) for p in tmp_path.iterdir()] == [
        ("a", "before")
    ]
