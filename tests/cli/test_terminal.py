"""What files say is printed as text: no name moves a cursor, forges a line or is markup."""

import contextlib
import os
import subprocess
import sys
from io import StringIO
from pathlib import Path

import pytest

import pamrs
from pamrs._files import shown
from pamrs.cli import _shared
from tests.scripts import command

FAULTS = Path(__file__).parents[1] / "faults"


class Terminal(StringIO):
    """Standard error where a person is looking."""

    def isatty(self):
        return True


@pytest.mark.parametrize("name", ["[/foo]", "[bold]x", "[link=file:///]", "a\x1b]0;pwn\x07"])
def test_a_name_is_no_markup(monkeypatch, name):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with _shared.progress(f"diagnosing {name}"):
        pass
    assert shown(name) in terminal.getvalue()
    assert "\x07" not in terminal.getvalue()


@pytest.mark.parametrize("fault", ["19_name_markup", "20_terminal_escape"])
def test_a_diagnosis_on_a_terminal_prints_names_as_text(fault, tmp_path):
    """Progress and result, as a person sees them."""
    pty = pytest.importorskip("pty")
    ours, theirs = pty.openpty()
    words = [sys.executable, "-m", "pamrs", "diagnose", str(FAULTS / fault), "--json", "a.json"]
    paths = str(Path(pamrs.__file__).parents[1])
    with subprocess.Popen(
        words, cwd=tmp_path, stdin=theirs, stdout=theirs, stderr=theirs,
        env={**os.environ, "PYTHONPATH": paths, "TERM": "xterm"},
    ) as running:  # fmt: skip
        os.close(theirs)
        seen = b""
        with contextlib.suppress(OSError):  # the other end is closed
            while part := os.read(ours, 65536):
                seen += part
    os.close(ours)
    assert running.returncode == 0
    assert (tmp_path / "a.json").stat().st_size > 1000
    name = pamrs.load_case(FAULTS / fault).name
    assert name.encode() in seen
    assert b"Traceback" not in seen
    assert not any(mark in seen for mark in (b"\x1b]0;", b"\x1b[2J", b"\x07"))
    assert not any(line.startswith(b"fake:") for line in seen.split(b"\n"))


def test_a_command_sends_no_control_characters(capsys, tmp_path):
    rig = tmp_path / "a\x07\x9b2J.toml"
    rig.write_text('name = "x"\n', encoding="utf-8")
    code, _, err = command(capsys, "rig", "check", rig)
    assert (code, err.count("\n")) == (2, 1)
    assert r"a\x07\x9b2J.toml" in err


def test_a_name_that_is_no_text_is_printed(capsys, tmp_path):
    name = os.fsdecode(os.fsencode(str(tmp_path)) + b"/\xff.toml")
    code, _, err = command(capsys, "rig", "check", name)
    assert code == 2
    assert r"\udcff.toml" in err


def test_an_error_is_no_longer_than_a_screen(capsys, tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text("".join(f"key_{k} = 1\n" for k in range(5000)), encoding="utf-8")
    for name in (rig, "x" * 100_000):
        code, _, err = command(capsys, "rig", "check", name)
        assert code == 2
        assert len(err) < 2000


def test_an_interrupt_while_the_commands_are_imported_is_no_traceback(tmp_path):
    (tmp_path / "typer.py").write_text("raise KeyboardInterrupt\n", encoding="utf-8")
    paths = os.pathsep.join([str(tmp_path), str(Path(pamrs.__file__).parents[1])])
    done = subprocess.run(
        [sys.executable, "-m", "pamrs", "--help"],
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "pamrs: interrupted\n")


def test_links_in_a_circle_are_an_error_in_words(capsys, tmp_path):
    (tmp_path / "case.toml").symlink_to("case.toml")
    (tmp_path / "rig.toml").symlink_to("other.toml")
    (tmp_path / "other.toml").symlink_to("rig.toml")
    for words in (
        ["diagnose", tmp_path],
        ["diagnose", tmp_path, "--allow-outside"],
        ["rig", "check", tmp_path / "rig.toml"],
        ["import", tmp_path / "rig.toml"],
    ):
        code, _, err = command(capsys, *words)
        assert (code, err.count("\n")) == (2, 1)
        assert err.startswith("pamrs: error: ")
