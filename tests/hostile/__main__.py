"""The table of hostile inputs that were tried: ``python -m tests.hostile`` (``make hostile``).

Each is tried in a process of its own with 4 GB of memory and 60 s of time. The exit code is 1 where
one was not survived.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.hostile.corpus import entries

MOST_BYTES, MOST_SECONDS = 4 << 30, 60.0


def limited() -> None:
    """Hold a process to its memory."""
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))


def tried(words: list[str]) -> tuple[str, str]:
    """What a command came to, and what it said."""
    command = [sys.executable, "-m", "pamrs", *words]
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=MOST_SECONDS,
            preexec_fn=limited,  # noqa: PLW1509
            check=False,
        )
    except subprocess.TimeoutExpired:
        return "no end", ""
    said = (done.stderr.strip() or done.stdout.strip()).splitlines()
    if "Traceback" in done.stderr:
        return "traceback", said[-1] if said else ""
    if done.returncode not in (0, 2):
        return f"exit code {done.returncode}", said[-1] if said else ""
    return "taken" if done.returncode == 0 else "refused", said[-1] if said else ""


def main() -> int:
    """Try the corpus; the exit code."""
    worst = 0
    print(f"{'input':<36}{'came to':<14}{'s':>6}  said")
    for entry in entries():
        with tempfile.TemporaryDirectory() as home:
            words = entry.write(Path(home))
            began = time.monotonic()
            came, said = tried(words)
            seconds = time.monotonic() - began
        survived = came in ("taken", "refused") and entry.told in said + entry.told * (
            came == "taken"
        )
        worst = max(worst, int(not survived))
        mark = "" if survived else "  <- not survived"
        said = said.replace(home, "").removeprefix("pamrs: error: ")
        print(f"{entry.name:<36}{came:<14}{seconds:>6.1f}  {said[:90]}{mark}", flush=True)
    return worst


if __name__ == "__main__":
    sys.exit(main())
