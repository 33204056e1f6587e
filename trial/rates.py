"""The right-hand side of the plant: where the joint is, the gas, the muscles' torque and the
motion.

Each is a function made once for a plant, with everything bound that does not change: one right-hand
side costs a few microseconds. Effects enter at the ports of :class:`.effects.Effect`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from .effects import HeatTransfer

if TYPE_CHECKING:
    from .plant import Plant
    from .solver import State

#: coefficients of one cell of the joint's tables: gas torque, elastic torque, volume, contraction,
#: wall area
Cubic = tuple[float, ...]
Cell = tuple[Cubic, Cubic, Cubic, Cubic, Cubic]
Place = tuple[Cell, float, float]


def rates_of(plant: Plant) -> Callable[[State, float], State]:
    """Time derivative of the state at a signed opening of the valve."""
    half, motion = half_of(plant), motion_of(plant)
    ambient, clock, width = plant.par.ambient, plant.i_clock, plant.size

    def rates(y: State, x: float) -> State:
        d = [0.0] * width
        if clock >= 0:
            d[clock] = 1.0
        motion(y, y[0] - ambient, half(y, x, d), d)
        return d

    return rates


def half_of(plant: Plant) -> Callable[[State, float, State], float]:
    """The part of a plant from its tank to its muscles: their torque [N m] at a signed opening of
    the valve; it sets the rates of the pressures and of what it has itself.
    """
    place, gas, muscles = place_of(plant), gas_of(plant), muscles_of(plant)
    spool, follows = plant.port("spool"), plant.ports("follow")
    ambient = plant.par.ambient

    def half(y: State, x: float, d: State) -> float:
        pg = y[0] - ambient
        at = place(y[2], pg)
        if spool is not None:
            x = spool(x, y, d)
        gas(y, x, at, d)
        torque = muscles(y, pg, at, d)
        for follow in follows:
            follow(y[0], y, d)
        return torque

    return half


def place_of(plant: Plant) -> Callable[[float, float], Place]:
    """Cell of an angle [rad] at a gauge pressure [Pa], distance from its knot [rad], factor on the
    moment arm.
    """
    tables, gear = plant.tables, plant.port("gear", False)
    cells: list[Cell] = [(c[0:4], c[4:8], c[8:12], c[12:16], c[16:20]) for c in tables.cells]
    start, step, last = tables.start, tables.step, len(cells) - 1

    def place(angle: float, pg: float) -> Place:
        seen, ratio = angle, 1.0
        if gear is not None:
            seen, ratio = gear(angle, pg)
        i = int((seen - start) / step)
        if i < 0:
            i = 0
        elif i > last:
            i = last
        return cells[i], seen - start - i * step, ratio

    return place


def gas_of(plant: Plant) -> Callable[[State, float, Place, State], None]:
    """Rates of the pressures of muscles and tank [Pa/s], and of the temperature where heat
    flows.
    """
    par = plant.par
    t0, rt0 = par.temperature, par.gas_constant * par.temperature
    dead, vt = par.dead_volume, par.supply_volume
    a_in, a_out, a_vol = par.alpha_in, par.alpha_out, par.alpha
    tanks, leaks, flows = plant.ports("tank"), plant.ports("leak", False), plant.valve()
    heat, i_heat = plant.heat
    warm = None if heat is None else warming_of(plant, heat)
    share = 0.0 if heat is None else heat.share
    seals, swells = plant.ports("seal", False), plant.ports("swell", False)
    regulated, lag, droop, ambient = (
        par.feed == "regulator",
        par.time_constant,
        par.droop,
        par.ambient,
    )

    def gas(y: State, x: float, at: Place, d: State) -> None:
        p, ps = y[0], y[1]
        cell, s, ratio = at
        k8, k9, k10, k11 = cell[2]
        volume = ((k8 * s + k9) * s + k10) * s + k11 + dead
        v_rate = ((3.0 * k8 * s + 2.0 * k9) * s + k10) * ratio * y[3]
        temperature = t0 if warm is None else y[i_heat]
        m_in, m_out = flows(x, ps, p, temperature)
        for leak in leaks:
            m_out += leak(p, temperature)
        for seal in seals:
            m_out += seal(p, y[2])
        if regulated:
            d[1] = (ambient + 1.0e6 * x - droop * (m_in - m_out) - ps) / lag
        else:
            d[1] = -rt0 / vt * m_in
        for tank in tanks:
            d[1] += tank(ps, m_in, y, d)
        change = (rt0 * (a_in * m_in - a_out * m_out) - a_vol * p * v_rate) / volume
        if warm is not None:
            k16, k17, k18, k19 = cell[4]
            wall = ((k16 * s + k17) * s + k18) * s + k19
            d[i_heat], balance = warm(p, temperature, (m_in, m_out), volume, v_rate, wall)
            change += share * (balance - change)
        for swell in swells:
            change *= swell(p, y[2])
        d[0] = change

    return gas


def warming_of(
    plant: Plant, heat: HeatTransfer
) -> Callable[[float, float, tuple[float, float], float, float, float], tuple[float, float]]:
    """Rates of temperature [K/s] and pressure [Pa/s] by the energy balance of the gas.

    From its pressure, temperature, flows into and out of it, volume with its rate, and the area of
    the wall.
    """
    par = plant.par
    ambient, t0, gas, g = par.ambient, par.temperature, par.gas_constant, par.kappa
    sqrt = math.sqrt

    def warm(
        p: float,
        temperature: float,
        flows: tuple[float, float],
        volume: float,
        v_rate: float,
        wall: float,
    ) -> tuple[float, float]:
        m_in, m_out = flows
        h = (
            heat.coefficient
            * sqrt(p * temperature / (ambient * t0))
            * (1.0 + heat.jet * m_in / 1.0e-3)
        )
        mass = p * volume / (gas * temperature)
        warm = ((g * t0 - temperature) * m_in - (g - 1.0) * temperature * m_out) / mass
        warm += (g - 1.0) * (
            h * wall * (t0 - temperature) / (mass * gas) - temperature * v_rate / volume
        )
        balance = gas * ((m_in - m_out) * temperature + mass * warm) / volume - p * v_rate / volume
        return warm, balance

    return warm


def muscles_of(plant: Plant) -> Callable[[State, float, Place, State], float]:
    """Torque of the muscles [N m] at a gauge pressure [Pa]."""
    lost = plant.port("lost_pressure", False)
    elastics, forces = plant.ports("elastic"), plant.ports("force")
    muscular = bool(elastics or forces)

    def muscles(y: State, pg: float, at: Place, d: State) -> float:
        cell, s, ratio = at
        k0, k1, k2, k3 = cell[0]
        k4, k5, k6, k7 = cell[1]
        push = pg if lost is None else pg - lost(pg)
        springy = ((k4 * s + k5) * s + k6) * s + k7
        torque: float = push * (((k0 * s + k1) * s + k2) * s + k3) + springy
        if muscular:
            k12, k13, k14, k15 = cell[3]
            arm = (3.0 * k12 * s + 2.0 * k13) * s + k14
            short = ((k12 * s + k13) * s + k14) * s + k15
            for elastic in elastics:
                torque += elastic(short, springy, y)
            for force in forces:
                torque -= arm * force(pg, short, arm * ratio * y[3], y, d)
        return torque * ratio

    return muscles


def motion_of(plant: Plant) -> Callable[[State, float, float, State], None]:
    """Rates of the angle [rad/s] and of its rate [rad/s2] under a torque of the muscles [N m]."""
    par, clock = plant.par, plant.i_clock
    if par.kind == "rigid":
        return lambda y, pg, torque, d: None
    rest_inertia = par.inertia + par.payload * par.length**2
    rest_weight = (par.first_moment + par.payload * par.length) * par.gravity
    reach, pull = par.length**2, par.length * par.gravity
    viscous, coulomb, speed = par.viscous, par.coulomb, par.coulomb_speed
    low, high = par.joint["min_angle"], par.joint["max_angle"]
    ks, ds = par.joint["stop_stiffness"], par.joint["stop_damping"]
    torques, load, moving = plant.ports("torque"), plant.port("load", False), plant.port("motion")
    tanh, sin = math.tanh, math.sin if par.kind == "joint" else par.pull

    def motion(y: State, pg: float, torque: float, d: State) -> None:
        angle, rate = y[2], y[3]
        stop = 0.0
        if angle < low:
            stop = ks * (low - angle) - ds * rate
            if stop < 0.0:
                stop = 0.0
        elif angle > high:
            stop = ks * (high - angle) - ds * rate
            if stop > 0.0:
                stop = 0.0
        torque += stop - viscous * rate - coulomb * tanh(rate / speed)
        for more in torques:
            torque += more(angle, rate, pg, y, d)
        inertia, weight = rest_inertia, rest_weight
        if load is not None:
            mass = load(y[clock])
            inertia += mass * reach
            weight += mass * pull
        d[2] = rate
        if moving is None:
            d[3] = (torque - weight * sin(angle)) / inertia
        else:
            d[3] = moving(torque, angle, rate, inertia, weight, y, d)

    return motion
