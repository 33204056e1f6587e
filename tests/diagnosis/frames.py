"""Made-up rigs on a load frame: a pressure that the bench sets, a valve, a regulator, two muscles;
and cases of the first one.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import pamrs
from pamrs.recordings import Recording
from pamrs.rig import parse_rig
from tests.diagnosis.noisy import noisy
from tests.tables import text_of

DT = 0.01
NOISE = {"muscle_pressure": 400.0, "length": 3e-5, "force": 1.0}
BENCH = pamrs.rigs.bench()
REST = BENCH.parameter("muscle.rest_length").value

VALVED, REGULATED, PAIR = (
    parse_rig(text_of(__file__, f"frame_{name}")) for name in ("valve", "regulator", "pair")
)


def played(
    truth: pamrs.Rig,
    name: str,
    role: str,
    length: np.ndarray,
    pressure: np.ndarray,
    seed: int,
) -> Recording:
    """A recording of a bench that plays a length [m] and a pressure [Pa, gauge], at 100 Hz."""
    run = pamrs.simulate(truth, length=length, pressure=pressure, sample_time=DT)
    channels = {
        "muscle_pressure": run["muscle_pressure"],
        "length": length,
        "force": run["muscle_force"],
    }
    return noisy(name, role, DT, channels, NOISE, [3, seed])


def strokes(k: int, rows: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    """Length and pressure of the k-th recording: small strokes at one speed, the pressure nearly
    held.
    """
    time = DT * np.arange(rows)
    length = REST * ((0.95, 0.93, 0.94)[k] + 0.015 * np.cos(2 * np.pi * 0.1 * time))
    return length, (2.6e5, 3.2e5, 2.9e5)[k] + 0.3e5 * np.sin(2 * np.pi * 0.05 * time)


def case(truth: pamrs.Rig) -> pamrs.Case:
    """Small strokes of the bench, two recordings to fit and one held out."""
    roles = enumerate(("fit", "fit", "held_out"))
    found = [played(truth, f"run_{k + 1}", role, *strokes(k), k) for k, role in roles]
    return pamrs.Case("bench", BENCH, found, Path())


def with_one_more(
    given: pamrs.Case, truth: pamrs.Rig, length: np.ndarray, pressure: np.ndarray
) -> pamrs.Case:
    """The same case with one more recording to fit."""
    one = played(truth, "next", "fit", length, pressure, 50)
    return pamrs.Case(given.name, given.rig, [*given.recordings, one], given.path)
