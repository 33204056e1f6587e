"""Run a pair through a recording."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import accumulate

import numpy as np

from ..effects import RECORDING_PERIOD
from ..recording import SAMPLE_TIME, CommandPath, Noise, Record, recorded
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
    """What both commands go through on their way to the openings of the valves; as
    :class:`trial.recording.CommandPath`.
    """

    kinds = KINDS
    shut = (0.0, 0.0)

    def __init__(self, plant: PairPlant, sample_time: float = SAMPLE_TIME) -> None:
        self.plant, self.sample_time, self.clocks = plant, sample_time, plant.shared.effects
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

    def begun(self, state: State, shift: tuple[float, ...], tank: State, clock: float) -> State:
        """State of the pair at a time [s] as that of another one, but for its tank, with shifts of
        both pressures [Pa] and the angle [rad].
        """
        pressures = (state[0] + shift[0], state[1] + shift[1])
        return self.plant.initial(pressures, tank[2], state[3] + shift[2], state[4], clock)


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
    y = plant.rest(supply + plant.par.ambient, RECORDING_PERIOD * index)

    def steer(i: int, measured: Iterator[float]) -> Commands:
        return steering(i, tuple(measured))

    path = PairPath(plant, sample_time)
    return recorded(path, steer, len(course.reference), y, noise, rng, index, held)
