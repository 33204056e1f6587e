"""Flows through the edges of the valve."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .plant import Parameters


def area_of(par: Parameters) -> Callable[[float], float]:
    """Effective area [m2] of an edge over the size of the opening, 0..1."""
    opening, fraction, full = par.opening, par.fraction, par.area_max

    def area(x: float) -> float:
        for i in range(1, len(opening)):
            if x <= opening[i]:
                s = (x - opening[i - 1]) / (opening[i] - opening[i - 1])
                return full * (fraction[i - 1] + s * (fraction[i] - fraction[i - 1]))
        return full * fraction[-1]

    return area


def orifice_of(par: Parameters) -> Callable[[float, float], float]:
    """Upstream pressure times the flow function of an ideal nozzle, signed; linear above a pressure
    ratio of 0.999.
    """
    g = par.kappa
    choke = (2.0 / (g + 1.0)) ** (g / (g - 1.0))
    choked: float = (2.0 / (g + 1.0)) ** (1.0 / (g - 1.0)) * math.sqrt(g / (g + 1.0))
    root, lead = 1.0 / g, g / (g - 1.0)
    end = math.sqrt(lead * (0.999 ** (2.0 / g) - 0.999 ** ((g + 1.0) / g)))
    sqrt, power = math.sqrt, math.pow

    def orifice(up: float, down: float) -> float:
        if up < down:
            return -orifice(down, up)
        r: float = down / up
        if r <= choke:
            return up * choked
        if r <= 0.999:
            q = power(r, root)
            return up * sqrt(lead * q * (q - r))
        return up * end * (1.0 - r) * 1000.0

    return orifice


def settle(flow: Callable[[float], float], free: float) -> float:
    """Flow m with ``flow(m) = m`` when `flow` falls with m and ``free = flow(0)``, by the Illinois
    rule.
    """
    if free == 0.0:
        return 0.0
    a, fa = 0.0, free
    b, fb = free, flow(free) - free
    if fb == 0.0:
        return free
    m = b
    for _ in range(60):
        m = (a * fb - b * fa) / (fb - fa)
        fm = flow(m) - m
        if abs(fm) <= 1.0e-13 * abs(free):
            break
        if (fm > 0.0) == (fb > 0.0):
            fa *= 0.5
        else:
            a, fa = b, fb
        b, fb = m, fm
    return m
