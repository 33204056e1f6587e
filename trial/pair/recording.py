"""Run a pair through a recording."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import accumulate

import numpy as np

from ..effects import RECORDING_PERIOD
from ..recording import SAMPLE_TIME, Array, CommandPath, Noise, Record, late
from ..solver import State
from .course import PairCourse
from .places import SIDES
from .plant import PairPlant

CHANNELS = (*(f"muscle_pressure.{side}" for side in SIDES), "supply_pressure", "joint_angle.elbow")
#: number of each channel among those of a plant with one valve
KINDS = (0, 0, 1, 2)
Commands = tuple[float, float]
#: commands [V] from the number of the sample and the measured values of all channels
Steering = Callable[[int, tuple[float, ...]], Commands]


class PairPath:
    """What both commands go through on their way to the openings of the valves."""

    def __init__(self, plant: PairPlant, sample_time: float = SAMPLE_TIME) -> None:
        self.sample_time = sample_time
        self.paths = [CommandPath(p, sample_time) for p in (plant.flexor, plant.extensor)]

    def spans(self, commands: Commands, time: float) -> list[tuple[Commands, float]]:
        """(openings, duration [s]) of the next sample for commands [V] at a time [s]."""
        own = [path.spans(u, time) for path, u in zip(self.paths, commands, strict=True)]
        if len(own[0]) == len(own[1]) == 1:
            return [((own[0][0][0], own[1][0][0]), own[0][0][1])]
        ends = sorted(t for spans in own for t in _ends(spans))
        found: list[tuple[Commands, float]] = []
        begin = 0.0
        for end in ends:
            if end - begin > 1.0e-9:
                first, second = (_at(spans, 0.5 * (begin + end)) for spans in own)
                found.append(((first, second), end - begin))
                begin = end
        return found


def _ends(spans: list[tuple[float, float]]) -> list[float]:
    return list(accumulate(span for _, span in spans))


def _at(spans: list[tuple[float, float]], time: float) -> float:
    """Opening at a time of a sample."""
    for (opening, _), end in zip(spans, _ends(spans), strict=True):
        if time < end:
            return opening
    return spans[-1][0]


def run_pair(
    plant: PairPlant,
    course: PairCourse,
    steering: Steering,
    supply: float,
    noise: Noise,
    rng: np.random.Generator,
    index: int = 0,
    sample_time: float = SAMPLE_TIME,
    held: int = 1,
) -> Record:
    """One recording of a pair, from rest; arguments as those of :func:`trial.recording.run`."""
    n = len(course.reference)
    spread = np.array([(noise.pressure, noise.angle)[k == 2] for k in KINDS])
    grid = np.array([(noise.pressure_step, noise.angle_step)[k == 2] for k in KINDS])
    white = rng.standard_normal((n, len(KINDS))) * spread
    noisy, steps = white.tolist(), grid.tolist()
    sent: list[Commands] = []
    clean: list[tuple[float, ...]] = []
    states: list[State] = []
    path = PairPath(plant, sample_time)
    begin = RECORDING_PERIOD * index
    y = plant.rest(supply + plant.par.ambient, begin)
    opening, step, u = (0.0, 0.0), 1.0e-3, (0.0, 0.0)
    for i in range(n):
        y = plant.tick(y)
        states.append(y)
        reading = plant.reading(y, opening)
        clean.append(reading)
        if i % held == 0:
            measured = zip(reading, noisy[i], steps, strict=True)
            u = steering(i, tuple(round((v + e) / s) * s for v, e, s in measured))
        sent.append(u)
        for opening, span in path.spans(u, begin + i * sample_time):
            y, step = plant.advance(y, opening, span, step)
    time = sample_time * np.arange(n)
    true = late(plant.shared.effects, time, np.array(clean), KINDS)
    return Record(time, np.array(sent), np.round((true + white) / grid) * grid, true, states)


def follow_pair(
    bare: PairPlant,
    record: Record,
    index: int = 0,
    shift: tuple[float, ...] = (0.0, 0.0, 0.0),
    window: float = 2.0,
    sample_time: float = SAMPLE_TIME,
) -> Array:
    """Noise-free readings (n, 4) of a pair that gets the commands of a recording of another one;
    as :func:`trial.recording.follow`, with shifts of both pressures [Pa] and the angle [rad].
    """
    every = round(window / sample_time)
    parts = max(1, math.ceil(sample_time / 6.0e-3))
    found: list[tuple[float, ...]] = []
    path = PairPath(bare, sample_time)
    begin = RECORDING_PERIOD * index
    opening = (0.0, 0.0)
    y: State = []
    for i, (state, (first, second)) in enumerate(
        zip(record.states, record.command.tolist(), strict=True)
    ):
        clock = begin + i * sample_time
        if i % every == 0:
            supply = y[2] if y else state[2]
            pressures = (state[0] + shift[0], state[1] + shift[1])
            y = bare.initial(pressures, supply, state[3] + shift[2], state[4], clock)
        y = bare.tick(y)
        found.append(bare.reading(y, opening))
        for opening, span in path.spans((first, second), clock):
            for _ in range(parts):
                y = bare.classical(y, opening, span / parts)
    return late(bare.shared.effects, record.time, np.array(found), KINDS)
