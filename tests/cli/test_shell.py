"""What holds for every command: silence, JSON on standard output, plain terminals, completion."""

import json
import os
import re
import subprocess
import sys
import threading

import pytest
import typer

from pamrs import cli, library, rigs
from pamrs._progress import Line
from pamrs.cli import _shared
from pamrs.effects import CATALOGUE
from tests.cli.test_terminal import Terminal
from tests.scripts import command

SIZE = ["size", "--point", "30 mm:7 kN"]


def leaves(command, name="pamrs"):
    """Every command, by what is typed."""
    below = getattr(command, "commands", None)
    if below is None:
        yield name, command
        return
    for word, one in below.items():
        yield from leaves(one, f"{name} {word}")


COMMANDS = dict(leaves(typer.main.get_command(cli.app)))


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_can_be_quiet_and_says_what_its_options_are(name):
    command = COMMANDS[name]
    options = {option for param in command.params for option in param.opts}
    assert {"--quiet", "-q"} <= options
    assert command.help
    assert not [param.name for param in command.params if not param.help and param.name != "help"]


def test_json_goes_to_standard_output_alone(capsys, tmp_path):
    file = tmp_path / "a.json"
    _, text, err = command(capsys, *SIZE, "--json", file)
    assert f"written: {file}" in err
    code, out, err = command(capsys, *SIZE, "--json", "-")
    assert json.loads(out) == json.loads(file.read_text(encoding="utf-8"))
    assert (code, err) == (0, text)
    assert command(capsys, *SIZE, "--json", "-", "--quiet") == (0, out, "")


def test_quiet_leaves_out_notes_and_keeps_errors(capsys, tmp_path):
    file = tmp_path / "size.json"
    code, out, err = command(capsys, *SIZE, "--json", file, "-q")
    assert (code, err) == (0, "")
    assert "elbow" in out
    assert file.exists()
    code, _, err = command(capsys, *SIZE, "no_such_muscle", "-q")
    assert code == 2
    assert "no_such_muscle" in err


@pytest.mark.parametrize(
    ("name", "value", "plain"), [("NO_COLOR", "1", True), ("TERM", "dumb", True), ("X", "1", False)]
)
def test_a_plain_terminal_gets_plain_lines(monkeypatch, name, value, plain):
    terminal = Terminal()
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "stderr", terminal)
    with _shared.progress("working"):
        pass
    assert ("\x1b" not in terminal.getvalue()) == plain
    assert "working: done" in terminal.getvalue()


def test_where_nobody_is_looking_lines_come_at_even_times(monkeypatch):
    """With share and time left, also while the work itself says nothing."""
    said, known = list[str](), threading.Event()

    def note(text: str) -> None:
        said.append(text)
        if len(said) > 4:
            known.set()

    assert _shared._EVERY == 10.0
    monkeypatch.setattr(_shared, "_EVERY", 1e-3)
    monkeypatch.setattr(_shared, "note", note)
    with _shared.progress("diagnosing run") as say:
        say(Line("run: refit", 0.25))
        assert known.wait(60.0)
    first, *between, last = said
    assert (first, last[:20]) == ("diagnosing run ...", "diagnosing run: done")
    told = [line for line in between if "refit" in line]
    assert all(re.fullmatch(r"25 %, about \d+ s left: run: refit", line) for line in told)
    assert len(told) > 1
    assert all(line.startswith("diagnosing run: 0 s so far") for line in between[: -len(told)])


def test_a_quiet_command_says_nothing_between(monkeypatch):
    said = list[str]()
    monkeypatch.setattr(_shared, "_EVERY", 1e-3)
    monkeypatch.setattr(_shared.typer, "echo", lambda text, err: said.append(text))
    quiet = _shared.QUIET.set(True)
    before = threading.active_count()
    with _shared.progress("diagnosing run"):
        assert threading.active_count() == before
    _shared.QUIET.reset(quiet)
    assert not said


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_gets_its_script(shell):
    asked = {"_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    done = subprocess.run(
        [sys.executable, "-c", "import sys; from pamrs.cli import main; sys.exit(main())"]
        + ["--show-completion", shell],
        env={**os.environ, **asked}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert "_PAMRS_COMPLETE" in done.stdout
    assert f"complete_{shell}" in done.stdout


def completions(*words):
    """What bash offers for the last word."""
    asked = {"COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1)}
    done = subprocess.run(
        [sys.executable, "-c", "import sys; from pamrs.cli import main; sys.exit(main())"],
        env={**os.environ, **asked, "_PAMRS_COMPLETE": "complete_bash"},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return done.stdout.split()


def test_commands_options_and_names_are_completed():
    assert completions("pamrs", "dia") == ["diagnose"]
    assert completions("pamrs", "diagnose", "--pressure") == ["--pressure-noise"]
    assert completions("pamrs", "effects", "leak_") == [i for i in CATALOGUE if i[:5] == "leak_"]
    assert completions("pamrs", "size", "pam_") == [n for n in library.names() if "pam_" in n]
    offered = completions("pamrs", "rig", "new", "a.toml", "--like", "t")
    assert offered == [name for name in rigs.names() if name.startswith("t")]
