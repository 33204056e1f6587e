"""Integrators of a plant: an adaptive Dormand-Prince 5(4) pair, and a quick Runge-Kutta step."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

State = list[float]
#: relative error of a step with which cases are written
TOLERANCE = 1.0e-8


class Solver:
    """What integrates a right-hand side; a plant sets what is used here.

    Attributes
    ----------
    scale : list of float
        Typical size of each state, for the error control.
    size : int
        Number of states.
    """

    scale: list[float]
    size: int
    _rhs: Callable[[State, Any], State]

    def advance(
        self, y: State, opening: Any, span: float, step: float, rtol: float = TOLERANCE
    ) -> tuple[State, float]:
        """Integrate over `span` [s] at a constant opening of the valve (of each of several).

        Returns
        -------
        state : list of float
            State at the end.
        step : float
            Step [s] to start the next span with.

        Raises
        ------
        ArithmeticError
            When the step falls below a nanosecond.
        """
        f, scale, n = self._rhs, self.scale, range(self.size)
        t = 0.0
        h = min(step, span)
        k1 = f(y, opening)
        while True:
            end = t + h >= span * (1.0 - 1e-12)
            if end:
                h = span - t
            h1, h2, h3 = h * 0.2, h * 0.075, h * 0.225
            k2 = f([a + h1 * b for a, b in zip(y, k1, strict=False)], opening)
            k3 = f([a + h2 * b + h3 * c for a, b, c in zip(y, k1, k2, strict=False)], opening)
            c1, c2, c3 = h * 44.0 / 45.0, -h * 56.0 / 15.0, h * 32.0 / 9.0
            k4 = f([y[i] + c1 * k1[i] + c2 * k2[i] + c3 * k3[i] for i in n], opening)
            c1, c2, c3, c4 = (
                h * 19372.0 / 6561.0,
                -h * 25360.0 / 2187.0,
                h * 64448.0 / 6561.0,
                -h * 212.0 / 729.0,
            )
            k5 = f([y[i] + c1 * k1[i] + c2 * k2[i] + c3 * k3[i] + c4 * k4[i] for i in n], opening)
            c1, c2, c3 = h * 9017.0 / 3168.0, -h * 355.0 / 33.0, h * 46732.0 / 5247.0
            c4, c5 = h * 49.0 / 176.0, -h * 5103.0 / 18656.0
            k6 = f(
                [y[i] + c1 * k1[i] + c2 * k2[i] + c3 * k3[i] + c4 * k4[i] + c5 * k5[i] for i in n],
                opening,
            )
            c1, c3, c4 = h * 35.0 / 384.0, h * 500.0 / 1113.0, h * 125.0 / 192.0
            c5, c6 = -h * 2187.0 / 6784.0, h * 11.0 / 84.0
            new = [y[i] + c1 * k1[i] + c3 * k3[i] + c4 * k4[i] + c5 * k5[i] + c6 * k6[i] for i in n]
            k7 = f(new, opening)
            c1, c3, c4 = h * 71.0 / 57600.0, -h * 71.0 / 16695.0, h * 71.0 / 1920.0
            c5, c6, c7 = -h * 17253.0 / 339200.0, h * 22.0 / 525.0, -h / 40.0
            worst = 0.0
            for i in n:
                err = abs(
                    c1 * k1[i] + c3 * k3[i] + c4 * k4[i] + c5 * k5[i] + c6 * k6[i] + c7 * k7[i]
                )
                err /= rtol * (scale[i] + abs(new[i]))
                if not err <= worst:
                    worst = err
            if worst != worst:
                worst = math.inf
            factor = min(max(0.9 * worst**-0.2, 0.2), 5.0) if worst > 1e-6 else 5.0
            if worst <= 1.0:
                y, k1 = new, k7
                t += h
                if end:
                    return y, max(h * factor, min(step, 2.0 * span))
                h *= factor
            else:
                h *= factor
                if h < 1.0e-9:
                    raise ArithmeticError(f"step below 1 ns at state {y!r}")

    def classical(self, y: State, opening: Any, span: float) -> State:
        """One classical Runge-Kutta step over `span` [s]: quicker than :meth:`advance`, without
        error control.
        """
        f, half = self._rhs, 0.5 * span
        k1 = f(y, opening)
        k2 = f([a + half * b for a, b in zip(y, k1, strict=False)], opening)
        k3 = f([a + half * b for a, b in zip(y, k2, strict=False)], opening)
        k4 = f([a + span * b for a, b in zip(y, k3, strict=False)], opening)
        sixth = span / 6.0
        return [
            a + sixth * (b + 2.0 * (c + d) + e)
            for a, b, c, d, e in zip(y, k1, k2, k3, k4, strict=False)
        ]
