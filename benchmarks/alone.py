"""Times of what has no peer: importing, a controller in the loop, a map of gains, a diagnosis.

``python -m benchmarks.alone`` prints all; names as arguments choose some. ``make bench`` runs it
too.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

import pamrs
from pamrs.control import PID, closed_loop
from pamrs.control.trajectories import step
from pamrs.control.tuning import gain_map

ROOT = Path(__file__).parents[1]
PERIOD, DURATION = 1e-3, 25.0  # s


def best_of(work: Callable[[], object], seconds: float = 1.0, most: int = 50) -> float:
    """Shortest time of one call [s], from as many calls as fit into some seconds."""
    times: list[float] = []
    stop = time.perf_counter() + seconds
    while len(times) < 1 or (time.perf_counter() < stop and len(times) < most):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


class Loop:
    """A PID controller as a user writes it in ten lines: beside ``PID``, it shows what the
    controller's own parts cost.
    """

    def __init__(self, gain: float, rate: float) -> None:
        self.gain, self.rate = gain, rate
        self.sum, self.last = 0.0, 0.0

    def __call__(self, sample: Mapping[str, float]) -> float:
        """The valve command [V] for a sample."""
        error = 0.8 - sample["joint_angle"]
        self.sum += error * 1e-3
        slope, self.last = (error - self.last) * 1e3, error
        return min(max(5.0 + self.gain * error + self.rate * self.sum + 0.2 * slope, 0.0), 10.0)


def loop() -> None:
    """25 s at 1 kHz under ``PID``: one ``closed_loop``, a loop of ten lines, and ``gain_map`` over
    40 x 40 gains.
    """
    rig = pamrs.rigs.shoulder()
    wanted = step(rig.model["joint"]["rest_angle"], 0.8, duration=DURATION)

    def show(name: str, work: Callable[[], object], seconds: float = 1.0) -> None:
        used, calls = time.process_time(), 0

        def counted() -> None:
            nonlocal calls
            calls += 1
            work()

        least = best_of(counted, seconds)
        used = (time.process_time() - used) / calls
        print(f"{name:<40} {least:>9.3g} s   {used:.3g} s of processors")

    show(
        "closed_loop 25 s, 1 kHz, PID",
        lambda: closed_loop(rig, PID(4.0, 1.0, 0.2, period=PERIOD), wanted, DURATION),
    )
    show(
        "  the same, a loop of ten lines",
        lambda: pamrs.Simulator(rig, sample_time=PERIOD).control(Loop(4.0, 1.0), DURATION),
    )
    axes = {"kp": np.linspace(0.5, 20.0, 40), "ki": np.linspace(0.0, 20.0, 40)}
    show(
        "gain_map 40 x 40, 25 s, 1 kHz, PID",
        lambda: gain_map(rig, lambda kp, ki: PID(kp, ki, 0.2, period=PERIOD), axes, wanted),
        0.0,
    )


def diagnosis() -> None:
    """A diagnosis of a shoulder, five recordings of 40 s at 200 Hz: one effect concealed, two, one
    of no catalogue; peak memory too.
    """
    code = (
        "import json, resource, sys, time, pamrs; case = pamrs.load_case(sys.argv[1]); start = "
        "time.perf_counter(); found = pamrs.diagnose(case); seconds = time.perf_counter() - start; "
        "names = [e['id'] for e in found.effects]; print(json.dumps([seconds, "
        "resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, found.verdict, names]))"
    )
    kinds = ("leak_muscle", "leak_muscle+muscle_hysteresis", "hose_torque")
    for number, kind in enumerate(kinds, 1):
        with tempfile.TemporaryDirectory() as folder:
            made = ["--out", f"{folder}/cases", "--keys-dir", f"{folder}/keys"]
            made += ["--kind", kind, "--seed", str(6 + number)]
            subprocess.run(
                [sys.executable, "-m", "trial", "make", *made],
                cwd=ROOT,
                check=True,
                capture_output=True,
            )
            run = subprocess.run(
                [sys.executable, "-c", code, f"{folder}/cases/case_001"],
                check=True,
                capture_output=True,
                text=True,
            )
        seconds, memory, verdict, names = json.loads(run.stdout)
        said = f"verdict: {verdict} {' + '.join(names)}".rstrip()
        print(f"{'diagnose ' + kind:<40} {seconds:>9.3g} s {memory:>9.4g} MiB    {said}")


def start_up() -> None:
    """Time that importing the package and then the command line takes, in a fresh interpreter."""
    code = "import time; s = time.perf_counter(); import {}; print(time.perf_counter() - s)"
    for module in ("pamrs", "pamrs.cli"):
        words = [sys.executable, "-c", code.format(module)]
        runs = [subprocess.run(words, check=True, capture_output=True, text=True) for _ in range(5)]
        print(f"{'import ' + module:<40} {min(float(run.stdout) for run in runs):>9.3g} s")


BENCHMARKS = {"import": start_up, "loop": loop, "diagnose": diagnosis}


def main() -> None:
    parser = argparse.ArgumentParser(description="Times of what has no peer.")
    parser.add_argument("names", nargs="*", choices=[*BENCHMARKS, []], help="all by default")
    for name in parser.parse_args().names or BENCHMARKS:
        BENCHMARKS[name]()


if __name__ == "__main__":
    main()
