"""Operations and bytes of one Runge-Kutta step of the shoulder, counted from its equations.

The equations are those of ``benchmarks.peers.shoulder_scipy``, run with numbers that count what is
done to them, at the states of a real run: a choked valve costs less than one that is not. The
table is the package's own, of polynomials of degree nine (``muscle/table.rs``). What depends on
parameters alone is not counted, since it is done once.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

import pamrs

from . import peers
from .peers import shoulder_scipy
from .workload import KEPT

__all__ = ["WEIGHTS", "Work", "work_of_a_step"]

#: Floating-point operations that each counts as: additions, multiplications, divisions and square
#: roots one each; the others about as many as a library's polynomials in double precision take.
WEIGHTS = {"+": 1, "*": 1, "/": 1, "sqrt": 1, "sin": 20, "cos": 20, "tanh": 30, "pow": 50}
DEGREE, COLUMNS = 9, 5  # of the package's table
STATES = 4


@dataclass(frozen=True)
class Work:
    """Operations of one step by kind, their weighted sum, and bytes."""

    operations: dict[str, float]
    flops: float
    #: Read from the table, which stays in the nearest cache.
    table_bytes: float
    #: Commands read and rows written, of a run that keeps what the peers keep.
    stream_bytes: float


class Counted:
    """A number that tells a counter what is done to it."""

    def __init__(self, value: float, tally: Counter[str]) -> None:
        self.value, self.tally = value, tally

    def _done(self, kind: str, value: float) -> Counted:
        self.tally[kind] += 1
        return Counted(value, self.tally)

    def __add__(self, other: Any) -> Counted:
        return self._done("+", self.value + float(other))

    def __sub__(self, other: Any) -> Counted:
        return self._done("+", self.value - float(other))

    def __rsub__(self, other: Any) -> Counted:
        return self._done("+", float(other) - self.value)

    def __mul__(self, other: Any) -> Counted:
        return self._done("*", self.value * float(other))

    def __truediv__(self, other: Any) -> Counted:
        return self._done("/", self.value / float(other))

    def __rtruediv__(self, other: Any) -> Counted:
        return self._done("/", float(other) / self.value)

    def __neg__(self) -> Counted:
        return Counted(-self.value, self.tally)

    def __lt__(self, other: Any) -> bool:
        return self.value < float(other)

    def __le__(self, other: Any) -> bool:
        return self.value <= float(other)

    def __gt__(self, other: Any) -> bool:
        return self.value > float(other)

    def __float__(self) -> float:
        return self.value

    __radd__, __rmul__ = __add__, __mul__


class Functions:
    """Functions of :mod:`math` on numbers that count."""

    def __getattr__(self, name: str) -> Any:
        return lambda x, *more: x._done(name, getattr(math, name)(x.value, *more))


def look(contraction: Any) -> tuple[Any, ...]:
    """The package's table: five polynomials, even and odd powers in two chains.

    Parameters
    ----------
    contraction : Counted
        Any value inside one cell; what comes out only has to be counted.
    """
    x = (contraction - 0.0) * 1.0 - 1.0
    square = x * x
    even = odd = [Counted(1.0, x.tally)] * COLUMNS
    for _ in range((DEGREE - 1) // 2):
        odd = [value * square + 1.0 for value in odd]
        even = [value * square + 1.0 for value in even]
    gas, elastic, offset, air, swell = (a + b * x for a, b in zip(even, odd, strict=True))
    return gas + elastic * 1.0, offset * 1.0, air, swell


def work_of_a_step(rig: pamrs.Rig, samples: int = 401) -> Work:
    """Count one step of a rig, the mean over a run.

    Parameters
    ----------
    rig : pamrs.Rig
        The packaged shoulder.
    samples : int
        Length of the run.

    Returns
    -------
    Work
    """
    numbers, _, _ = peers.shoulder(rig)
    command = peers.wave(samples)
    areas, payload = peers.opening(rig, command), rig.model["arm"]["payload"]
    run = pamrs.simulate(rig, command, sample_time=peers.SAMPLE_TIME, step=1e-3)
    gauge = np.stack([run["muscle_pressure"], run["supply_pressure"]]) + numbers.ambient
    tally: Counter[str] = Counter()
    for k in range(samples):
        values = (*gauge[:, k], run["joint_angle"][k], run["joint_rate"][k])
        state = [Counted(float(v), tally) for v in values]
        shoulder_scipy.rates(state, numbers, look, float(areas[k]), payload, Functions())
    step = {kind: 4.0 * count / samples for kind, count in tally.items()}
    # stages y + h k three times; k1 + 2 k2 + 2 k3 + k4, times h/6, added to y
    step["+"] += STATES * (3 + 3 + 1)
    step["*"] += STATES * (3 + 2 + 1)
    return Work(
        operations=step,
        flops=sum(WEIGHTS[kind] * count for kind, count in step.items()),
        table_bytes=4.0 * 8.0 * (DEGREE + 1) * COLUMNS,
        stream_bytes=8.0 * (1 + len(KEPT)) / peers.STEPS,
    )
