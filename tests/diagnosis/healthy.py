"""Cases of packaged rigs in which nothing is missing: values inside one tolerance, white noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import pamrs
from pamrs.channels import channel_of
from pamrs.recordings import Recording
from pamrs.simulation import core_rig
from tests.diagnosis.noisy import SHOULDER, noisy

RIGS = ("shoulder", "elbow", "hanging_mass", "regulated_joint", "antagonistic_joint")
RATES = (50, 100, 200, 500)
NOISE = {
    "supply_pressure": 600.0,
    "muscle_pressure": 600.0,
    "joint_angle": 6e-4,
    "length": 3e-5,
}
_SECONDS = 10.0
_AROUND = {"valve_command": (5.0, 1.2), "supply_command": (2.2e5, 2.0e5)}
"""Null and amplitude of commands."""

Array = NDArray[np.float64]


def healthy_case(name: str, seed: int, rate: int, *, sharp: bool) -> pamrs.Case:
    """Three recordings of a rig whose values lie inside one tolerance of the file's.

    Sharp commands are steps between fill, hold and vent, down to the stops; gentle ones are sums of
    slow waves. The last recording is held out.
    """
    nominal: pamrs.Rig = getattr(pamrs.rigs, name)()
    rng = np.random.default_rng([seed, len(name), rate, sharp])
    values = {
        key: float(np.clip(p.value + rng.uniform(-1.0, 1.0) * p.tol, p.lower, p.upper))
        for key, p in nominal.parameters.items()
        if 0.0 < p.tol < np.inf
    }
    true = nominal.with_parameters(values)
    roles = ("fit", "fit", "held_out")
    made = [_recorded(true, k, role, rate, rng, sharp=sharp) for k, role in enumerate(roles)]
    return pamrs.Case(f"{name}_{seed}", nominal, made, Path())


def _recorded(
    true: pamrs.Rig, k: int, role: str, rate: int, rng: np.random.Generator, *, sharp: bool
) -> Recording:
    time = np.arange(round(_SECONDS * rate) + 1) / rate
    commands: dict[str, Array] = {}
    driven: dict[str, dict[str, Array]] = {}
    for name in core_rig(true).inputs:
        channel, _, block = name.partition(".")
        null, amplitude = _AROUND[channel]
        shape = _steps(time, rng) if sharp else _waves(time, rng)
        commands[name] = driven.setdefault(channel, {})[block] = null + amplitude * shape
    run = pamrs.simulate(true, sample_time=1.0 / rate, **driven)
    read = {name: run[name] for name in run if channel_of(name) in NOISE}
    noise = {name: NOISE[channel_of(name)] for name in read}
    seeds = [int(rng.integers(2**31)), k]
    return noisy("abc"[k], role, 1.0 / rate, commands | read, noise, seeds)


def _steps(time: Array, rng: np.random.Generator) -> Array:
    """Fill, hold, vent, hold, and so on, each for 0.6 to 1.6 s: a joint is thrown on its stops."""
    ends = np.cumsum(rng.uniform(0.6, 1.6, 24))
    sizes = rng.uniform(0.7, 1.5, 25) * np.resize([1.0, 0.0, -1.0, 0.0], 25)
    return sizes[np.searchsorted(ends, time, side="right")]


def _waves(time: Array, rng: np.random.Generator) -> Array:
    """A sum of waves of 0.1 to 1 Hz, 1 at the most."""
    rates, phases = np.array([0.1, 0.23, 0.41, 0.97]), rng.uniform(0.0, 2.0 * np.pi, 4)
    return 0.25 * np.sin(2.0 * np.pi * np.outer(time, rates) + phases).sum(axis=1)


def written_by_two_clocks(rate: int, loop: int, *, late: float) -> pamrs.Case:
    """The nominal shoulder by a loop that sends steps at its own times, and a log beside it whose
    first sample is so much of one of its samples late.
    """
    rig, fine = pamrs.rigs.shoulder(), 1e-3
    rng = np.random.default_rng(3)
    first, every = round(late / rate / fine), round(1.0 / rate / fine)
    made = []
    for k, role in enumerate(("fit", "fit", "held_out")):
        time = fine * np.arange(round(_SECONDS / fine) + 1)
        command = 5.0 + _steps(np.floor(time * loop + 1e-9) / loop, rng)
        run = pamrs.simulate(rig, command, sample_time=fine)
        channels = {"valve_command": command} | {name: run[name] for name in SHOULDER}
        seen = {name: values[first::every] for name, values in channels.items()}
        made.append(noisy("abc"[k], role, 1.0 / rate, seen, SHOULDER, [3, k]))
    return pamrs.Case("two_clocks", rig, made, Path())
