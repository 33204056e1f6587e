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

DT = 0.01
NOISE = {"muscle_pressure": 400.0, "length": 3e-5, "force": 1.0}
BENCH = pamrs.rigs.bench()
REST = BENCH.parameter("muscle.rest_length").value

_HEAD = """
schema = "pamrs.rig/1"
name = "{name}"
[gas]
temperature = {{ value = 20, unit = "degC", tol = 2 }}
[load]
kind = "frame"
min_length = {{ value = 220, unit = "mm" }}
max_length = {{ value = 305, unit = "mm" }}
[limits]
max_pressure = {{ value = 6, unit = "bar" }}
"""
_MUSCLE = """
[chamber{at}]
dead_volume = {{ value = 30, unit = "ml", tol = 3 }}
[muscle{at}]
model = "gaylord"
rest_length = {{ value = 300, unit = "mm" }}
rest_diameter = {{ value = 23, unit = "mm" }}
braid_angle = {{ value = 65, unit = "deg" }}
wall_thickness = {{ value = 1.5, unit = "mm" }}
modulus_scale = {{ value = 1, unit = "1", tol = 0.05 }}
"""
_VALVE = """
[supply]
kind = "tank"
volume = {{ value = 10, unit = "l", tol = 0.2 }}
initial_pressure = {{ value = 7, unit = "bar" }}
[valve]
flow                = "iso_6358"
fill_conductance    = {{ value = 1.0, unit = "l/(s bar)", tol = 0.1 }}
fill_critical_ratio = {{ value = 0.30, unit = "1", tol = 0.05 }}
vent_conductance    = {{ value = 1.0, unit = "l/(s bar)", tol = 0.1 }}
vent_critical_ratio = {{ value = 0.35, unit = "1", tol = 0.05 }}
null_voltage        = {{ value = 5.0, unit = "V" }}
half_range          = {{ value = 5.0, unit = "V" }}
area_fraction       = {{ opening = [0.0, 1.0], fraction = [0.0, 1.0] }}
"""
_REGULATOR = """
[supply]
kind = "regulator"
time_constant = {{ value = 80, unit = "ms", tol = 10 }}
droop = {{ value = 3e8, unit = "Pa s/kg", tol = 0.5e8 }}
initial_pressure = {{ value = 0, unit = "bar" }}
[line]
kind = "tube"
from = "supply"
to = "chamber"
length = {{ value = 1, unit = "m", tol = 0.02 }}
diameter = {{ value = 4, unit = "mm", tol = 0.1 }}
"""


def rig(name: str, *parts: str) -> pamrs.Rig:
    """A rig on a frame: a muscle for each part that begins with a dot, or one without a name, and
    what feeds it.
    """
    places = [part for part in parts if part.startswith(".")] or [""]
    fed = [part for part in parts if not part.startswith(".")]
    text = _HEAD.format(name=name) + "".join(_MUSCLE.format(at=at) for at in places)
    return parse_rig(text + "".join(part.format() for part in fed))


VALVED = rig("valved", _VALVE)
REGULATED = rig("regulated", _REGULATOR)
PAIR = rig("pair", ".left", ".right")
RIGS = (BENCH, VALVED, REGULATED, PAIR)


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
