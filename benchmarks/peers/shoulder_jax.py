"""The shoulder in JAX, double precision: ``jit`` of ``vmap`` over payloads of a ``lax.scan`` of RK4
steps; the same by diffrax, sample by sample, with the same Runge-Kutta method.
"""

from __future__ import annotations

from functools import lru_cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from . import LAMINAR, SAMPLE_TIME, STEPS, Array, Shoulder

jax.config.update("jax_enable_x64", True)
H = SAMPLE_TIME / STEPS


def flow(p: Shoulder, area: Any, upstream: Any, downstream: Any) -> Any:
    """Mass flow through an orifice [kg/s]; negative against higher pressure."""
    high, low = jnp.maximum(upstream, downstream), jnp.minimum(upstream, downstream)
    ratio = low / high
    root = ratio ** (1.0 / p.gamma)
    under = jnp.maximum(root * (root - ratio) * (p.gamma / (p.gamma - 1.0)), 0.0)
    straight = (1.0 - ratio) * (p.psi_laminar / (1.0 - LAMINAR))
    psi = jnp.where(ratio <= LAMINAR, jnp.sqrt(under), straight)
    psi = jnp.where(ratio <= p.critical, p.psi_choked, psi)
    return area * high * psi * p.flow_factor * jnp.where(upstream >= downstream, 1.0, -1.0)


def rates(p: Shoulder, table: Any, area: Any, payload: Any, state: Any) -> Any:
    """Time derivatives of pressure, tank, angle and rate."""
    pressure, tank, angle, rate = state
    phi = jnp.pi - p.lower_angle - angle
    bx, by = p.lower_radius * jnp.cos(phi), p.lower_radius * jnp.sin(phi)
    gap = p.upper_offset - by
    s = jnp.sqrt(p.tendon_squared - gap * gap)
    arm = by - gap * bx / s
    place = ((bx + s - p.upper_axial) / p.rest_length - p.table_start) * p.table_per_unit
    cell = jnp.clip(place.astype(jnp.int32), 0, table.shape[0] - 1)
    x, (c0, c1, c2, c3) = place - cell, table[cell]
    slope, still, air = c0 + x * (c1 + x * (c2 + x * c3))
    swell = (c1[2] + x * (2.0 * c2[2] + x * 3.0 * c3[2])) * p.table_per_unit
    force = p.muscles * ((pressure - p.ambient) * slope + still)
    volume = p.dead_volume + p.muscles * air
    volume_rate = p.muscles * swell * arm * rate / p.rest_length

    # one orifice: the valve joins the chamber to the tank or to the ambient
    fills = area > 0.0
    upstream, downstream = jnp.where(fills, tank, pressure), jnp.where(fills, pressure, p.ambient)
    through = flow(p, jnp.abs(area), upstream, downstream)
    into = jnp.where(fills, through, -through)
    filling = p.rt * into * jnp.where(into > 0.0, p.alpha_in, p.alpha_out)
    pressure_rate = (filling - p.alpha * pressure * volume_rate) / volume
    tank_rate = -p.rt / p.supply_volume * jnp.where(fills, through, 0.0)

    torque = force * arm - p.viscous * rate - p.coulomb * jnp.tanh(rate / p.coulomb_speed)
    low = p.stop_stiffness * (p.min_angle - angle) - p.stop_damping * rate
    high = p.stop_stiffness * (angle - p.max_angle) + p.stop_damping * rate
    torque += jnp.where(angle < p.min_angle, jnp.maximum(low, 0.0), 0.0)
    torque -= jnp.where(angle > p.max_angle, jnp.maximum(high, 0.0), 0.0)
    weight = (p.first_moment + payload * p.length) * p.gravity
    inertia = p.inertia + payload * p.length**2
    return pressure_rate, tank_rate, rate, (torque - weight * jnp.sin(angle)) / inertia


def rk4(f: Any, state: Any) -> Any:
    """One step."""

    def moved(by: float, slope: Any) -> Any:
        return tuple(y + by * k for y, k in zip(state, slope, strict=True))

    k1 = f(state)
    k2 = f(moved(0.5 * H, k1))
    k3 = f(moved(0.5 * H, k2))
    k4 = f(moved(H, k3))
    total = [a + 2.0 * (b + c) + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
    return moved(H / 6.0, total)


def by_scan(p: Shoulder, table: Any, start: Any, areas: Any, payload: Any) -> Any:
    """The last angle of one payload."""

    def sample(state: Any, area: Any) -> tuple[Any, None]:
        f = partial(rates, p, table, area, payload)
        return jax.lax.fori_loop(0, STEPS, lambda _, y: rk4(f, y), state), None

    return jax.lax.scan(sample, tuple(start), areas[:-1])[0][2]


def by_diffrax(p: Shoulder, table: Any, start: Any, areas: Any, payload: Any) -> Any:
    """The same with diffrax, restarted where the command jumps."""
    import diffrax

    class Rk4(diffrax.AbstractERK):
        tableau = diffrax.ButcherTableau(
            a_lower=(np.array([0.5]), np.array([0.0, 0.5]), np.array([0.0, 0.0, 1.0])),
            b_sol=np.array([1 / 6, 1 / 3, 1 / 3, 1 / 6]),
            b_error=np.zeros(4),
            c=np.array([0.5, 0.5, 1.0]),
        )
        interpolation_cls = diffrax.ThirdOrderHermitePolynomialInterpolation.from_k

        def order(self, terms: Any) -> int:
            return 4

    term = diffrax.ODETerm(lambda t, y, area: rates(p, table, area, payload, y))

    def sample(state: Any, area: Any) -> tuple[Any, None]:
        found = diffrax.diffeqsolve(
            term, Rk4(), 0.0, SAMPLE_TIME, H, state, area,
            saveat=diffrax.SaveAt(t1=True), max_steps=STEPS + 1, throw=False,
            adjoint=diffrax.ForwardMode(),
        )  # fmt: skip
        return tuple(y[-1] for y in found.ys), None

    return jax.lax.scan(sample, tuple(start), areas[:-1])[0][2]


@lru_cache
def compiled(p: Shoulder, one: Any) -> Any:
    """A batch of one of the functions above, the rig's numbers constants in it."""
    return jax.jit(jax.vmap(partial(one, p), in_axes=(None, None, None, 0)))


def batch(p: Shoulder, table: Array, start: Array, areas: Array, payloads: Array) -> Array:
    """Last angle [rad] of every payload."""
    return np.asarray(compiled(p, by_scan)(table, start, areas, payloads))


def batch_diffrax(p: Shoulder, table: Array, start: Array, areas: Array, payloads: Array) -> Array:
    """The same by diffrax."""
    return np.asarray(compiled(p, by_diffrax)(table, start, areas, payloads))
