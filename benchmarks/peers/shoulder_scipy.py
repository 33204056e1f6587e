"""The shoulder in plain Python with SciPy's ``solve_ivp``, restarted where the command jumps.

``rates`` takes the mathematical functions as an argument, so that the operations in it can be
counted (``benchmarks.counting``).
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from . import LAMINAR, SAMPLE_TIME, Array, Shoulder

#: What one cell of the table says: slope and offset of the force, volume, its slope.
Look = tuple[Any, Any, Any, Any]


def cubic(p: Shoulder, table: list[list[list[float]]], contraction: float) -> Look:
    """The splines at a contraction ratio."""
    place = (contraction - p.table_start) * p.table_per_unit
    cell = min(max(int(place), 0), len(table) - 1)
    x, (c0, c1, c2, c3) = place - cell, table[cell]
    slope, still, air = (c0[i] + x * (c1[i] + x * (c2[i] + x * c3[i])) for i in range(3))
    return slope, still, air, (c1[2] + x * (2.0 * c2[2] + x * 3.0 * c3[2])) * p.table_per_unit


def flow(p: Shoulder, area: float, upstream: Any, downstream: Any, fn: Any = math) -> Any:
    """Mass flow through an orifice [kg/s]; negative against higher pressure."""
    if upstream < downstream:
        return -flow(p, area, downstream, upstream, fn)
    ratio = downstream / upstream
    if ratio <= p.critical:
        psi = p.psi_choked
    elif ratio <= LAMINAR:
        root = fn.pow(ratio, 1.0 / p.gamma)
        psi = fn.sqrt(root * (root - ratio) * (p.gamma / (p.gamma - 1.0)))
    else:
        psi = (1.0 - ratio) * (p.psi_laminar / (1.0 - LAMINAR))
    return area * p.flow_factor * upstream * psi


def rates(
    state: Any, p: Shoulder, look: Any, area: float, payload: float, fn: Any = math
) -> list[Any]:
    """Time derivatives of pressure, tank, angle and rate."""
    pressure, tank, angle, rate = state
    phi = math.pi - p.lower_angle - angle
    bx, by = p.lower_radius * fn.cos(phi), p.lower_radius * fn.sin(phi)
    gap = p.upper_offset - by
    s = fn.sqrt(p.tendon_squared - gap * gap)
    arm = by - gap * bx / s
    slope, still, air, swell = look((bx + s - p.upper_axial) / p.rest_length)
    force = p.muscles * ((pressure - p.ambient) * slope + still)
    volume = p.dead_volume + p.muscles * air
    volume_rate = p.muscles / p.rest_length * swell * arm * rate

    drawn: Any = 0.0
    filling: Any = 0.0
    if area > 0.0:
        drawn = flow(p, area, tank, pressure, fn)
        filling = p.rt * (p.alpha_in if drawn > 0.0 else p.alpha_out) * drawn
    elif area < 0.0:
        vented = flow(p, -area, pressure, p.ambient, fn)
        filling = -p.rt * (p.alpha_out if vented > 0.0 else p.alpha_in) * vented
    pressure_rate = (filling - p.alpha * pressure * volume_rate) / volume

    torque = force * arm - p.viscous * rate - p.coulomb * fn.tanh(rate / p.coulomb_speed)
    if angle < p.min_angle:
        torque += max(p.stop_stiffness * (p.min_angle - angle) - p.stop_damping * rate, 0.0)
    elif angle > p.max_angle:
        torque -= max(p.stop_stiffness * (angle - p.max_angle) + p.stop_damping * rate, 0.0)
    weight = (p.first_moment + payload * p.length) * p.gravity
    inertia = p.inertia + payload * p.length**2
    acceleration = (torque - weight * fn.sin(angle)) / inertia
    return [pressure_rate, -p.rt / p.supply_volume * drawn, rate, acceleration]


def derivative(_: float, state: Array, **settings: Any) -> list[Any]:
    """The same for an array: plain numbers are quicker, one by one."""
    return rates(state.tolist(), **settings)


def single(
    p: Shoulder, table: Array, start: Array, areas: Array, payload: float, rtol: float = 1e-6
) -> Array:
    """States at every sample, shape (samples, 4)."""
    look = partial(cubic, p, table.tolist())
    atol = rtol * np.array([1e5, 1e6, 1.0, 1.0])
    rows = np.empty((areas.size, 4))
    rows[0] = start
    for k in range(areas.size - 1):
        held: Any = partial(derivative, p=p, look=look, area=float(areas[k]), payload=payload)
        found = solve_ivp(held, (0.0, SAMPLE_TIME), rows[k], method="RK45", rtol=rtol, atol=atol)
        if not found.success:
            raise RuntimeError(f"sample {k}: {found.message}")
        rows[k + 1] = found.y[:, -1]
    return rows
