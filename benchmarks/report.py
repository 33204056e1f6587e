"""Everything side by side in one run: writes ``docs/benchmarks.md`` and the same as JSON.

``make bench`` runs it alone on the machine. ``--quick`` takes fewer turns and smaller batches, to
see that all of it works.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

# One thread for libraries, set before they are loaded: JAX and the peaks are per core.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"

from . import machine
from .goals import goals, one_step, table_and_solve
from .page import Results, page
from .scaling import over_size, over_threads

ROOT = Path(__file__).parents[1]
SIZES = [10**k for k in range(7)]


def measure(command: str, repeats: int, sizes: list[int], alone: list[str]) -> Results:
    """Measure all of it; each part says that it begins."""

    def say(part: str) -> None:
        print(f"benchmarks: {part}", file=sys.stderr, flush=True)

    # before the peers run: the load is that of others, and of what `make bench` ran before
    known, versions = machine.describe(), machine.versions()
    say("peers")
    beside = goals(repeats)
    say("one step, table")
    step, look = one_step(repeats), table_and_solve(repeats)
    say("scaling")
    few = max(3, repeats // 3)
    by_size, by_threads = over_size(sizes, few), over_threads(few)
    say(f"without a peer: {', '.join(alone) or 'left out'}")
    return Results(
        command=command,
        machine=known,
        versions=versions,
        repeats=repeats,
        goals=beside,
        step=step,
        look=look,
        sizes=by_size,
        threads=by_threads,
        alone=printed(alone),
    )


def printed(names: list[str]) -> str:
    """Lines of ``benchmarks.alone``."""
    if not names:
        return ""
    words = [sys.executable, "-m", "benchmarks.alone", *names]
    return subprocess.run(words, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


def as_json(results: Results) -> str:
    """The same numbers for programs, with what each goal's line says in the end."""
    data: dict[str, Any] = dataclasses.asdict(results)
    for goal, entry in zip(results.goals, data["goals"], strict=True):
        entry["verdict"] = goal.verdict
    data["step"]["verdict"] = results.step.verdict
    return json.dumps(data, indent=1, allow_nan=True) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description="Times of pamrs beside its peers.")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "benchmarks.md")
    parser.add_argument("--repeats", type=int, default=15, help="turns of each work")
    parser.add_argument("--quick", action="store_true", help="three turns, small batches")
    parser.add_argument(
        "--alone",
        nargs="*",
        metavar="NAME",
        default=["import", "loop", "diagnose"],
        help="parts of benchmarks.alone that are run too; no name: none",
    )
    parser.add_argument("--command", default="python -m benchmarks.report", help="on the page")
    given = parser.parse_args()
    repeats, sizes = (3, SIZES[:3]) if given.quick else (given.repeats, SIZES)
    results = measure(given.command, repeats, sizes, given.alone)
    given.out.write_text(page(results), encoding="utf-8")
    given.out.with_suffix(".json").write_text(as_json(results), encoding="utf-8")
    print(f"{given.out} and {given.out.with_suffix('.json')}")


if __name__ == "__main__":
    main()
