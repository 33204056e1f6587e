"""The shoulder in Numba: scalar code with ``fastmath``, batches by ``prange``."""

from __future__ import annotations

import math

import numba
import numpy as np
from numba import njit, prange

from . import LAMINAR, SAMPLE_TIME, STEPS, Array, Shoulder


@njit(fastmath=True, inline="always")
def flow(p, area, upstream, downstream):
    """Mass flow through an orifice [kg/s]; negative against higher pressure."""
    high, low = max(upstream, downstream), min(upstream, downstream)
    ratio = low / high
    if ratio <= p.critical:
        psi = p.psi_choked
    elif ratio <= LAMINAR:
        root = ratio ** (1.0 / p.gamma)
        psi = math.sqrt(root * (root - ratio) * (p.gamma / (p.gamma - 1.0)))
    else:
        psi = (1.0 - ratio) * (p.psi_laminar / (1.0 - LAMINAR))
    mass = area * high * psi * p.flow_factor
    return mass if upstream >= downstream else -mass


@njit(fastmath=True, inline="always")
def rates(p, table, area, weight, inertia, pressure, tank, angle, rate):
    """Time derivatives of the four states."""
    phi = math.pi - p.lower_angle - angle
    bx, by = p.lower_radius * math.cos(phi), p.lower_radius * math.sin(phi)
    gap = p.upper_offset - by
    s = math.sqrt(p.tendon_squared - gap * gap)
    arm = by - gap * bx / s
    contraction = (bx + s - p.upper_axial) / p.rest_length

    place = (contraction - p.table_start) * p.table_per_unit
    cell = min(max(int(place), 0), table.shape[0] - 1)
    x, c = place - cell, table[cell]
    slope = c[0, 0] + x * (c[1, 0] + x * (c[2, 0] + x * c[3, 0]))
    still = c[0, 1] + x * (c[1, 1] + x * (c[2, 1] + x * c[3, 1]))
    air = c[0, 2] + x * (c[1, 2] + x * (c[2, 2] + x * c[3, 2]))
    swell = (c[1, 2] + x * (2.0 * c[2, 2] + x * 3.0 * c[3, 2])) * p.table_per_unit
    force = p.muscles * ((pressure - p.ambient) * slope + still)
    volume = p.dead_volume + p.muscles * air
    volume_rate = p.muscles * swell * arm * rate / p.rest_length

    drawn, inflow, outflow = 0.0, 0.0, 0.0
    if area > 0.0:
        drawn = flow(p, area, tank, pressure)
        inflow, outflow = max(drawn, 0.0), max(-drawn, 0.0)
    elif area < 0.0:
        vented = flow(p, -area, pressure, p.ambient)
        inflow, outflow = max(-vented, 0.0), max(vented, 0.0)
    filling = p.rt * (p.alpha_in * inflow - p.alpha_out * outflow)
    pressure_rate = (filling - p.alpha * pressure * volume_rate) / volume

    torque = force * arm - p.viscous * rate - p.coulomb * math.tanh(rate / p.coulomb_speed)
    if angle < p.min_angle:
        torque += max(p.stop_stiffness * (p.min_angle - angle) - p.stop_damping * rate, 0.0)
    elif angle > p.max_angle:
        torque -= max(p.stop_stiffness * (angle - p.max_angle) + p.stop_damping * rate, 0.0)
    return (
        pressure_rate,
        -p.rt * drawn / p.supply_volume,
        rate,
        (torque - weight * math.sin(angle)) / inertia,
    )


@njit(fastmath=True)
def run(p, table, start, areas, payload, rows):
    """States at every sample, the last one where there is one row only."""
    h = SAMPLE_TIME / STEPS
    weight = (p.first_moment + payload * p.length) * p.gravity
    inertia = p.inertia + payload * p.length * p.length
    a, b, c, d = start[0], start[1], start[2], start[3]
    rows[0, 0], rows[0, 1], rows[0, 2], rows[0, 3] = a, b, c, d
    for k in range(areas.size - 1):
        u = areas[k]
        for _ in range(STEPS):
            a1, b1, c1, d1 = rates(p, table, u, weight, inertia, a, b, c, d)
            g = 0.5 * h
            a2, b2, c2, d2 = rates(
                p, table, u, weight, inertia, a + g * a1, b + g * b1, c + g * c1, d + g * d1
            )
            a3, b3, c3, d3 = rates(
                p, table, u, weight, inertia, a + g * a2, b + g * b2, c + g * c2, d + g * d2
            )
            a4, b4, c4, d4 = rates(
                p, table, u, weight, inertia, a + h * a3, b + h * b3, c + h * c3, d + h * d3
            )
            a += h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
            b += h / 6.0 * (b1 + 2.0 * (b2 + b3) + b4)
            c += h / 6.0 * (c1 + 2.0 * (c2 + c3) + c4)
            d += h / 6.0 * (d1 + 2.0 * (d2 + d3) + d4)
        row = min(k + 1, rows.shape[0] - 1)
        rows[row, 0], rows[row, 1], rows[row, 2], rows[row, 3] = a, b, c, d


@njit(parallel=True, fastmath=True)
def run_all(p, table, start, areas, payloads, ends):
    """The last angle of every payload."""
    for i in prange(payloads.size):
        row = np.empty((1, 4))
        run(p, table, start, areas, payloads[i], row)
        ends[i] = row[0, 2]


def single(p: Shoulder, table: Array, start: Array, areas: Array, payload: float) -> Array:
    """States at every sample, shape (samples, 4)."""
    rows = np.empty((areas.size, 4))
    run(p, table, start, areas, payload, rows)
    return rows


def batch(
    p: Shoulder, table: Array, start: Array, areas: Array, payloads: Array, threads: int = 0
) -> Array:
    """Last angle [rad] of every payload, on some threads or on all."""
    numba.set_num_threads(threads or numba.config.NUMBA_NUM_THREADS)
    ends = np.empty(payloads.size)
    run_all(p, table, start, areas, payloads, ends)
    return ends
