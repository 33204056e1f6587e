"""How a pair is driven: courses of the angle and of the co-contraction, and the controller."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..drive import course, range_of
from ..excitation import Excitation, Loop
from ..rig_kinds import RigKind
from .places import SIDES
from .plant import PairPlant

Array = NDArray[np.floating]
CO, STEPS = "co_contraction", "antagonistic_steps"
FIT = ("multisine", "sealed_holds", CO)
HELD = (STEPS, "slow_triangle")
#: lowest and highest mean of both pressures [Pa]
LOW, HIGH = 0.8e5, 3.2e5
#: lowest pressure that the controller asks for [Pa]: no tendon goes slack
LEAST = 0.2e5


@dataclass(frozen=True)
class PairCourse:
    """Reference of the angle [rad] and of the mean pressure [Pa], (n,); which valve is to be shut
    and what is added to its command [V], (n, 2).
    """

    reference: Array
    level: Array
    sealed: NDArray[np.bool_]
    dither: Array


def pair_course(
    rig: RigKind, name: str, duration: float, sample_time: float, rng: np.random.Generator
) -> PairCourse:
    """A course of a pair: one of :data:`FIT`, :data:`HELD` or the free log."""
    n = round(duration / sample_time)
    time = sample_time * np.arange(n)
    if name == CO:
        low, top = range_of(rig)
        points = _points(rng, duration, (5.0, 9.0), (0.2, 0.8))
        angle = low + (top - low) * _eased(time, points)
        shut = np.zeros(n, dtype=bool)
        base = Excitation(angle, shut, np.zeros(n), shut)
        level = _co_contraction(time, rng)
    else:
        base = course(rig, "angle_steps" if name == STEPS else name, duration, sample_time, rng)
        still = name in (STEPS, "slow_triangle")
        holds = (8.0, 14.0) if still else (2.5, 6.0)
        level = _eased(time, _points(rng, duration, holds, (0.0, 1.0)), 0.4 if still else 1.2)
        if name == "multisine":
            wave = np.sin(2.0 * np.pi * float(rng.uniform(0.15, 0.4)) * time)
            level = 0.7 * level + 0.15 * (1.0 + wave)
    sealed, dither = np.column_stack([base.sealed] * 2), np.column_stack([base.dither] * 2)
    _one_side(sealed, rng)
    every = max(1, round(0.07 / sample_time))
    # the signs of both dithers go their own ways
    sign = np.repeat(rng.choice([-1.0, 1.0], n // every + 1), every)[:n]
    dither[:, 1] *= sign
    return PairCourse(base.reference, LOW + (HIGH - LOW) * level, sealed, dither)


def _points(
    rng: np.random.Generator, duration: float, hold: tuple[float, float], span: tuple[float, float]
) -> list[tuple[float, float]]:
    """Times at which a level begins to change, and the levels."""
    found = [(0.0, float(rng.uniform(*span)))]
    while found[-1][0] < duration:
        found.append((found[-1][0] + float(rng.uniform(*hold)), float(rng.uniform(*span))))
    return found


def _eased(time: Array, points: list[tuple[float, float]], move: float = 1.5) -> Array:
    """Levels that change over a time `move` [s], by half cosines."""
    found = np.full(len(time), points[0][1])
    for (_, old), (begin, new) in zip(points, points[1:], strict=False):
        s = np.clip((time - begin) / move, 0.0, 1.0)
        found = np.where(time < begin, found, old + (new - old) * 0.5 * (1.0 - np.cos(np.pi * s)))
    return found


def _co_contraction(time: Array, rng: np.random.Generator) -> Array:
    """Both pressures rise and fall together: steps, slow ramps and waves, in turn."""
    found = np.zeros(len(time))
    t, level, turn = 0.0, 0.5, int(rng.integers(3))
    while t < time[-1]:
        goal, span = float(rng.uniform(0.0, 1.0)), float(rng.uniform(3.0, 6.0))
        part = (time >= t) & (time < t + span)
        since = time[part] - t
        move = (0.15, span, 0.5)[turn % 3]
        found[part] = level + (goal - level) * np.clip(since / move, 0.0, 1.0)
        if turn % 3 == 2:
            wave = np.sin(2.0 * np.pi * float(rng.uniform(0.3, 1.2)) * since)
            found[part] += 0.15 * wave * np.clip(since / 0.5, 0.0, 1.0)
        t, level, turn = t + span, goal, turn + 1
    return np.clip(found, 0.0, 1.0)


def _one_side(sealed: NDArray[np.bool_], rng: np.random.Generator) -> None:
    """Of holds with both valves shut some leave one of them at work."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], sealed[:, 0], [False]]).astype(int)))
    for first, stop in edges.reshape(-1, 2).tolist():
        if rng.random() < 0.4:
            sealed[first:stop, int(rng.integers(len(SIDES)))] = False


class PairDriver(Loop):
    """Controller that knows the nominal pair: pressures that hold the reference at a mean pressure,
    a PID on the angle that shifts their difference, and a loop of each pressure behind it.

    Parameters
    ----------
    nominal : PairPlant
        What it believes.
    rig : RigKind
        Its rig.
    period : float
        Time between two commands [s].
    rng : numpy.random.Generator
        Draws the gains within 15 %.
    """

    def __init__(
        self, nominal: PairPlant, rig: RigKind, period: float, rng: np.random.Generator
    ) -> None:
        self.most = rig.most
        self.null = (nominal.par.flexor.null_voltage, nominal.par.extensor.null_voltage)
        low, top = range_of(rig)
        self.grid = np.linspace(low, top, 61)
        # the half difference is straight over the mean
        ends = [
            np.array([nominal.holding(float(a), level)[0] - level for a in self.grid])
            for level in (0.0, 1.0e5)
        ]
        self.base, self.slope = ends[0], (ends[1] - ends[0]) / 1.0e5
        middle = self.base + self.slope * 0.5 * (LOW + HIGH)
        stiff = max(float(middle[-1] - middle[0]) / (top - low), 2.0e4)
        pid, flows = np.array([0.3, 0.4, 0.1]) * stiff, np.array([3.0e-5, 6.0e-5])
        super().__init__(period, pid, flows, 0.3 * (top - low), rng, min(1.0, 0.01 / period))

    def on(
        self, course: PairCourse, index: int, measured: tuple[float, ...]
    ) -> tuple[float, float]:
        """Commands [V] on a 12-bit output at a sample of a course, from what is measured."""
        reference, level = float(course.reference[index]), float(course.level[index])
        self.see(measured[3])
        error = reference - measured[3]
        if not course.sealed[index].any():
            self.gather(error)
        half = float(np.interp(reference, self.grid, self.base + self.slope * level))
        half += self.feedback(error)
        sent = []
        for j, wanted in enumerate((level + half, level - half)):
            if course.sealed[index, j]:
                sent.append(self.quantise(self.null[j]))
                continue
            gap = min(max(wanted, LEAST), self.most) - measured[j]
            sent.append(self.opened(gap, self.null[j], float(course.dither[index, j])))
        return sent[0], sent[1]
