"""Scripts in a Python process of their own, and commands in this one."""

from __future__ import annotations

import subprocess
import sys
import textwrap

import pytest

from pamrs import cli


def script(code: str) -> list[str]:
    """The words that a script prints; it has to end well."""
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def command(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of a command of pamrs."""
    code = cli.main([str(word) for word in words])
    captured = capsys.readouterr()
    return code, captured.out, captured.err
