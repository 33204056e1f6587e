"""Batches, gain maps and vector environments with two builds, taken in turns.

``python -m benchmarks.batches BEFORE AFTER`` takes two folders that hold the package ``pamrs`` with
its core, as ``python`` in a checkout, and prints what each costs (least of all rounds) and the
ratio of the two (median over the rounds, with the least and the largest).
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

ARMS = 1024
GAINS = 24
SECONDS = 4.0


def step_of_a_batch() -> Callable[[], None]:
    """Ten samples of 5 ms of 1024 shoulders, other commands for each."""
    import pamrs

    batch = pamrs.Batch(pamrs.rigs.shoulder(), n=ARMS, sample_time=0.005, threads=1)
    commands = 5.0 + 0.5 * np.sin(np.arange(ARMS))

    def run() -> None:
        for _ in range(10):
            batch.step(commands)

    return run


def map_of_gains() -> Callable[[], None]:
    """24 x 24 gains of a PID at 1 kHz over 4 s of a lift of the shoulder."""
    import pamrs
    from pamrs.control import PID
    from pamrs.control.trajectories import degrees, lift_hold_return
    from pamrs.control.tuning import gain_map

    rig, lift = pamrs.rigs.shoulder(), lift_hold_return(*degrees(15, 50))
    axes = {"kp": np.linspace(0.5, 3.0, GAINS), "ki": np.linspace(0.0, 2.0, GAINS)}

    def made(kp: float, ki: float) -> PID:
        return PID(kp, ki, 0.0, period=1e-3)

    def run() -> None:
        gain_map(rig, made, axes, lift, duration=SECONDS, threads=1)

    return run


def step_of_environments() -> Callable[[], None]:
    """Fifty steps of 256 arms."""
    from pamrs.control.gym import ShoulderVectorEnv

    env = ShoulderVectorEnv(256)
    env.reset(seed=1)
    actions = np.linspace(-0.2, 0.4, 256)[:, None].astype(np.float32)

    def run() -> None:
        for _ in range(50):
            env.step(actions)

    return run


WORK = {
    "Batch.step, 1024 shoulders, 10 samples of 5 ms": (step_of_a_batch, 20),
    "gain_map, 24 x 24 gains, 4 s at 1 kHz": (map_of_gains, 1),
    "ShoulderVectorEnv.step, 256 arms, 50 steps of 20 ms": (step_of_environments, 4),
}


def once() -> dict[str, float]:
    """Least time [s] of each piece of work with the package that is on the path."""
    found = {}
    for name, (prepare, repeats) in WORK.items():
        run = prepare()
        taken = []
        for _ in range(repeats):
            began = time.perf_counter()
            run()
            taken.append(time.perf_counter() - began)
        found[name] = min(taken)
    return found


def with_build(folder: Path) -> dict[str, float]:
    """The same in a process of its own with one build."""
    done = subprocess.run(
        [sys.executable, __file__, "--once"],
        env={**os.environ, "PYTHONPATH": str(folder)},
        check=True,
        capture_output=True,
        text=True,
    )
    times: dict[str, float] = json.loads(done.stdout)
    return times


def main() -> None:
    """Compare two builds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("builds", nargs="*", type=Path)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--once", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.once:
        print(json.dumps(once()))
        return
    if len(given.builds) != 2:
        parser.error("two folders are needed")
    rounds = [[with_build(build) for build in given.builds] for _ in range(given.rounds)]
    for name in WORK:
        before, after = ([pair[k][name] for pair in rounds] for k in (0, 1))
        ratios = [b / a for b, a in zip(before, after, strict=True)]
        print(
            f"{name}: {1e3 * min(before):.3g} ms, {1e3 * min(after):.3g} ms, "
            f"{statistics.median(ratios):.2f} times ({min(ratios):.2f} to {max(ratios):.2f})"
        )


if __name__ == "__main__":
    main()
