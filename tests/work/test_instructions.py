"""Instructions of the core's hot paths, counted by valgrind: unlike times they repeat.

Counted is a run of Python with so many calls more, less the same without them, so that starting up
does not count; threads of NumPy that wait would. Valgrind knows no registers of 512 bits: lanes are
four wide here.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.work.snapshot import compare

#: calls that are counted: enough that what starting up differs by does not tell
CALLS = 8
#: compilers of other versions arrange the same work a little differently
TOLERANCE = 0.05
WORKS = {
    "one run of 2000 steps": "pamrs.simulate(rig, command, **given)",
    "64 runs of 2000 steps in lanes": "pamrs.simulate_batch(rig, command, parameters=payloads, "
    "every=400, threads=1, **given)",
    "one run of 2000 steps with an effect": "pamrs.simulate(leaky, command, **given)",
}
CODE = f"""
import sys
import numpy as np
import pamrs

rig = pamrs.rigs.shoulder()
leaky = rig.with_effect("leak_muscle")
command = 5.0 + 1.5 * np.sin(2.0 * np.pi * 0.8 * 0.005 * np.arange(401))
given = {{"sample_time": 0.005, "step": 1e-3, "record": ["joint_angle"]}}
payloads = {{"arm.payload": np.linspace(0.0, 20.0, 64)}}
for name, work in {WORKS}.items():
    for _ in range(1 + (int(sys.argv[2]) if name == sys.argv[1] else 0)):
        eval(work)
"""


def _has_four_lanes() -> bool:
    told = Path("/proc/cpuinfo")
    return told.is_file() and " avx2 " in told.read_text(encoding="utf-8")


def _instructions(work: str, calls: int) -> int:
    """Of a process that makes so many calls more."""
    tool = ["valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null"]
    done = subprocess.run(
        [*tool, sys.executable, "-c", CODE, work, str(calls)],
        capture_output=True,
        text=True,
        timeout=300,
        env=os.environ | {"PYTHONHASHSEED": "0", "OPENBLAS_NUM_THREADS": "1"},
        check=True,
    )
    found = re.search(r"I\s+refs:\s+([\d,]+)", done.stderr)
    assert found, done.stderr
    return int(found[1].replace(",", ""))


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
@pytest.mark.skipif(not _has_four_lanes(), reason="lanes are narrower on this processor")
@pytest.mark.slow
def test_instructions_of_hot_paths(
    record_property: Callable[[str, object], None],
) -> None:
    bare = _instructions("", 0)
    counts = {work: (_instructions(work, CALLS) - bare) // CALLS for work in WORKS}
    record_property("instructions", "; ".join(f"{work} {n:,}" for work, n in counts.items()))
    compare("instructions", counts, tolerance=TOLERANCE)
