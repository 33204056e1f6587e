"""Scripts that run in a Python process of their own."""

from __future__ import annotations

import subprocess
import sys
import textwrap


def script(code: str) -> list[str]:
    """The words that a script prints; it has to end well."""
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()
