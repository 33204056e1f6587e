"""How the rigs are driven: courses of the reference and the controller."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .excitation import Excitation, Loop, build
from .plant import Plant
from .rig_kinds import PAIR, RigKind

Array = NDArray[np.floating]
FREE = "free_log"
#: the first plans' courses run from 15.5 to 105 deg
_FROM, _TO = math.radians(15.5), math.radians(105.0)


def free_log(duration: float, sample_time: float, rng: np.random.Generator) -> Excitation:
    """Somebody plays with the rig: moves of any speed, waits, wobbles, the valve shut at times."""
    n = round(duration / sample_time)
    time = sample_time * np.arange(n)
    place, sealed = np.zeros(n), np.zeros(n, dtype=bool)
    t, level = 0.0, 0.0
    while t < duration:
        goal = float(rng.uniform(0.05, 0.95))
        move, wait = float(rng.uniform(0.3, 4.0)), float(rng.exponential(2.0))
        part = time >= t
        s = np.clip((time[part] - t) / move, 0.0, 1.0)
        place[part] = level + (goal - level) * 0.5 * (1.0 - np.cos(np.pi * s))
        after = (time >= t + move) & (time < t + move + wait)
        if rng.random() < 0.3:
            wave = np.sin(2.0 * np.pi * float(rng.uniform(0.3, 1.5)) * (time[after] - t - move))
            place[after] += float(rng.uniform(0.03, 0.1)) * wave
        elif rng.random() < 0.4:
            sealed |= after & (time >= t + move + 0.4)
        t, level = t + move + wait, goal
    reference = _FROM + (_TO - _FROM) * np.clip(place, 0.0, 1.0)
    return Excitation(reference, sealed, np.zeros(n), np.zeros(n, dtype=bool))


def course(
    rig: RigKind, name: str, duration: float, sample_time: float, rng: np.random.Generator
) -> Excitation:
    """A course in the range of a rig: reference in rad, m of shortening, or a share of pressure."""
    shape = (
        free_log(duration, sample_time, rng)
        if name == FREE
        else build(name, duration, sample_time, rng)
    )
    low, top = range_of(rig)
    share = (shape.reference - _FROM) / (_TO - _FROM)
    return Excitation(low + (top - low) * share, shape.sealed, shape.dither, shape.vent)


def range_of(rig: RigKind) -> tuple[float, float]:
    """Range of the reference in the plant's units."""
    turns = rig.name in ("shoulder", "elbow", "regulated_joint", PAIR)
    return (math.radians(rig.low), math.radians(rig.top)) if turns else (rig.low, rig.top)


class Driver(Loop):
    """Controller that knows the nominal plant: feedforward and PID on the reference, and a loop of
    the pressure behind it; a regulator takes the pressure itself, a rigid volume has no more than
    the pressure.

    Parameters
    ----------
    nominal : Plant
        What it believes.
    rig : RigKind
        Its rig.
    period : float
        Time between two commands [s].
    rng : numpy.random.Generator
        Draws the gains within 15 %.
    """

    def __init__(
        self, nominal: Plant, rig: RigKind, period: float, rng: np.random.Generator
    ) -> None:
        self.null = nominal.par.null_voltage
        self.regulated, self.most = nominal.par.feed == "regulator", rig.most
        low, top = range_of(rig)
        self.grid = np.linspace(low, top, 61)
        rigid = nominal.par.kind == "rigid"
        hold = rig.most * self.grid if rigid else [nominal.holding_pressure(a) for a in self.grid]
        self.hold = np.clip(np.asarray(hold), 0.0, rig.most)
        slope = 0.0 if rigid else float(self.hold[-1] - self.hold[0]) / (top - low)
        pid, flows = np.array([0.3, 0.4, 0.2]) * slope, np.array([1.6e-5, 5.0e-5])
        super().__init__(period, pid, flows, 0.3 * (top - low), rng, min(1.0, 0.01 / period))

    def __call__(
        self, reference: float, angle: float, pressure: float, dither: float, sealed: bool
    ) -> float:
        """Command from the reference and the measured angle [rad] (or shortening [m], without its
        sign where the log has a length) and gauge pressure [Pa].
        """
        self.see(angle)
        if sealed and not self.regulated:
            return self.quantise(self.null)
        error = reference - angle
        self.gather(error)
        wanted = float(np.interp(reference, self.grid, self.hold)) + self.feedback(error)
        wanted = min(max(wanted, 0.0), self.most)
        if self.regulated:
            return self.quantise(wanted * 1.0e-5 + dither)
        return self.opened(wanted - pressure, self.null, dither)
