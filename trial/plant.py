"""The independent plant: tank, valve, muscles, joint and arm under an adaptive Dormand-Prince 5(4) pair.

The inner loop uses plain floats: one right-hand side costs a few microseconds, 40 s less than a second.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from scipy.optimize import brentq

from .effects import Effects
from .geometry import JointTables, Muscle, Tendon

State = list[float]


@dataclass(frozen=True)
class Parameters:
    """All numbers of the plant without effects; SI units, angles in rad, pressures in Pa (gauge if noted)."""

    ambient: float
    temperature: float
    gas_constant: float
    kappa: float
    supply_volume: float
    supply_pressure: float  # gauge
    area_max: float
    null_voltage: float
    half_range: float
    opening: tuple[float, ...]
    fraction: tuple[float, ...]
    dead_volume: float
    alpha_in: float
    alpha_out: float
    alpha: float
    muscle: dict[str, Any] = field(hash=False)
    count: int
    modulus_scale: float
    joint: dict[str, float] = field(hash=False)
    inertia: float
    first_moment: float
    length: float
    payload: float
    viscous: float
    coulomb: float
    coulomb_speed: float
    gravity: float
    pressure_zero: float
    angle_zero: float


class Plant:
    """Plant with a set of effects.

    The state is ``[p, p_supply, angle, rate, ...]`` in absolute Pa, rad and rad/s, followed by the gas mass
    [kg], the opening of the lagged valve, the friction states, the creep states and the lagged pressure, each
    only when its effect is there.

    Parameters
    ----------
    parameters : Parameters
        Baseline numbers.
    effects : Effects
        What the plant has besides.
    """

    def __init__(self, parameters: Parameters, effects: Effects | None = None) -> None:
        self.par = parameters
        self.effects = effects or Effects()
        self.tables = JointTables(
            Muscle(parameters.muscle),
            Tendon(parameters.joint),
            parameters.count,
            parameters.modulus_scale,
            parameters.joint["rest_angle"],
        )
        self._slots()
        self._rhs = self._build()

    def _slots(self) -> None:
        n = 4
        eff = self.effects
        self.i_mass = self.i_valve = self.i_friction = self.i_creep = self.i_sensor = -1
        if eff.heat_transfer:
            self.i_mass, n = n, n + 1
        if eff.input_path_lag:
            self.i_valve, n = n, n + 1
        if eff.muscle_hysteresis:
            self.i_friction, n = n, n + len(eff.muscle_hysteresis.friction)
        if eff.muscle_creep:
            self.i_creep, n = n, n + len(eff.muscle_creep.stiffness)
        if eff.pressure_lag:
            self.i_sensor, n = n, n + 1
        self.size = n
        scale = [1.0e5, 1.0e6, 1.0, 1.0]
        scale += [1.0e-3] * (self.i_mass >= 0)
        scale += [1.0] * (self.i_valve >= 0)
        scale += [1.0] * (len(eff.muscle_hysteresis.friction) if eff.muscle_hysteresis else 0)
        scale += [0.05] * (len(eff.muscle_creep.stiffness) if eff.muscle_creep else 0)
        scale += [1.0e5] * (self.i_sensor >= 0)
        self.scale = scale

    def initial(self, pressure: float, supply: float, angle: float, rate: float = 0.0) -> State:
        """State at absolute pressures [Pa] with every memory at rest."""
        eff, par = self.effects, self.par
        y = [pressure, supply, angle, rate]
        values = self.tables.at(angle)
        if eff.heat_transfer:
            y.append(pressure * (float(values[2]) + par.dead_volume) / (par.gas_constant * par.temperature))
        if eff.input_path_lag:
            y.append(0.0)
        if eff.muscle_hysteresis:
            y.extend([0.0] * len(eff.muscle_hysteresis.friction))
        if eff.muscle_creep:
            y.extend([float(values[3])] * len(eff.muscle_creep.stiffness))
        if eff.pressure_lag:
            y.append(pressure)
        return y

    def rest(self, supply: float) -> State:
        """Vented muscle, arm at rest on its lower stop."""
        par = self.par
        low = par.joint["min_angle"]
        weight = (par.first_moment + par.payload * par.length) * par.gravity

        def torque(angle: float) -> float:
            stop = par.joint["stop_stiffness"] * max(low - angle, 0.0)
            return float(self.tables.at(angle)[1]) - weight * math.sin(angle) + stop

        angle = float(brentq(torque, low - math.radians(4.0), low + math.radians(20.0), xtol=1e-12))
        return self.initial(par.ambient, supply, angle)

    def holding_pressure(self, angle: float) -> float:
        """Gauge pressure [Pa] that holds the arm at an angle [rad]."""
        par = self.par
        values = self.tables.at(angle)
        weight = (par.first_moment + par.payload * par.length) * par.gravity
        return float((weight * math.sin(angle) - values[1]) / values[0])

    def valve_opening(self, command: float) -> float:
        """Signed opening of the spool, -1..1, for a command [V], without its lag."""
        x = min(max((command - self.par.null_voltage) / self.par.half_range, -1.0), 1.0)
        zone = self.effects.valve_dead_zone
        return zone.opening(x) if zone is not None else x

    def _area(self) -> Callable[[float], float]:
        opening, fraction, full = self.par.opening, self.par.fraction, self.par.area_max

        def area(x: float) -> float:
            for i in range(1, len(opening)):
                if x <= opening[i]:
                    s = (x - opening[i - 1]) / (opening[i] - opening[i - 1])
                    return full * (fraction[i - 1] + s * (fraction[i] - fraction[i - 1]))
            return full * fraction[-1]

        return area

    def _build(self) -> Callable[[State, float], State]:
        par, eff, tab = self.par, self.effects, self.tables
        area = self._area()
        cells, start, step, last = tab.cells, tab.start, tab.step, len(tab.cells) - 1
        ambient, t0, gas, g = par.ambient, par.temperature, par.gas_constant, par.kappa
        rt0 = gas * t0
        choke = (2.0 / (g + 1.0)) ** (g / (g - 1.0))
        psi_choked: float = (2.0 / (g + 1.0)) ** (1.0 / (g - 1.0)) * math.sqrt(g / (g + 1.0))
        e1, e2, lead = 2.0 / g, (g + 1.0) / g, g / (g - 1.0)
        psi_end = math.sqrt(lead * (0.999**e1 - 0.999**e2))
        jet = math.sqrt(2.0 / rt0)
        dead, vt = par.dead_volume, par.supply_volume
        a_in, a_out, a_vol = par.alpha_in, par.alpha_out, par.alpha
        inertia = par.inertia + par.payload * par.length**2
        weight = (par.first_moment + par.payload * par.length) * par.gravity
        viscous, coulomb, speed = par.viscous, par.coulomb, par.coulomb_speed
        low, high = par.joint["min_angle"], par.joint["max_angle"]
        ks, ds = par.joint["stop_stiffness"], par.joint["stop_damping"]
        i_mass, i_valve, i_fric, i_creep, i_sensor = (
            self.i_mass,
            self.i_valve,
            self.i_friction,
            self.i_creep,
            self.i_sensor,
        )
        leak, heat, fric, creep = eff.leak_muscle, eff.heat_transfer, eff.muscle_hysteresis, eff.muscle_creep
        lag_valve = eff.input_path_lag.lag if eff.input_path_lag else 1.0
        lag_sensor = eff.pressure_lag.lag if eff.pressure_lag else 1.0
        tanh, sin, sqrt = math.tanh, math.sin, math.sqrt

        def orifice(up: float, down: float) -> float:
            """pu * psi, signed."""
            if up < down:
                return -orifice(down, up)
            r: float = down / up
            if r <= choke:
                return up * psi_choked
            if r <= 0.999:
                return up * sqrt(lead * (math.pow(r, e1) - math.pow(r, e2)))
            return up * psi_end * (1.0 - r) * 1000.0

        def rhs(y: State, x: float) -> State:
            p, ps, angle, rate = y[0], y[1], y[2], y[3]
            i = int((angle - start) / step)
            if i < 0:
                i = 0
            elif i > last:
                i = last
            s = angle - start - i * step
            k = cells[i]
            torque = (p - ambient) * (((k[0] * s + k[1]) * s + k[2]) * s + k[3]) + ((k[4] * s + k[5]) * s + k[6]) * s + k[7]
            volume = ((k[8] * s + k[9]) * s + k[10]) * s + k[11] + dead
            v_rate = ((3.0 * k[8] * s + 2.0 * k[9]) * s + k[10]) * rate
            d = [0.0] * len(y)
            if i_valve >= 0:
                d[i_valve] = (x - y[i_valve]) / lag_valve
                x = y[i_valve]
            temperature = t0
            if i_mass >= 0:
                temperature = p * volume / (y[i_mass] * gas)
            m_in = m_out = 0.0
            if x > 0.0:
                m_in = area(x) * jet * orifice(ps, p)
            elif x < 0.0:
                m_out = area(-x) * jet * orifice(p, ambient)
                if i_mass >= 0:
                    m_out *= sqrt(t0 / temperature)
            if leak is not None:
                m_out += leak.flow(p, ambient, temperature)
            d[1] = -rt0 / vt * m_in
            if heat is not None:
                wall = ((k[16] * s + k[17]) * s + k[18]) * s + k[19]
                h = heat.coefficient * sqrt(p * temperature / (ambient * t0))
                d[0] = (
                    g * gas * (m_in * t0 - m_out * temperature) - g * p * v_rate + (g - 1.0) * h * wall * (t0 - temperature)
                ) / volume
                d[i_mass] = m_in - m_out
            else:
                d[0] = (rt0 * (a_in * m_in - a_out * m_out) - a_vol * p * v_rate) / volume
            if fric is not None or creep is not None:
                arm = (3.0 * k[12] * s + 2.0 * k[13]) * s + k[14]
                slide = arm * rate
                force = 0.0
                if fric is not None:
                    back = slide < 0.0
                    n, beta = fric.exponent, fric.beta
                    for j, (w, dist) in enumerate(zip(fric.friction, fric.distance, strict=True), i_fric):
                        z = y[j]
                        if fric.form == "dahl_bank":
                            d[j] = slide / dist * (1.0 + z if back else 1.0 - z)
                        else:
                            sign = -1.0 if (z < 0.0) != back else 1.0
                            d[j] = slide / dist * (1.0 - abs(z) ** n * (beta * sign + 1.0 - beta))
                        force += w * z
                    force *= (p - ambient) / fric.reference_pressure if p > ambient else 0.0
                if creep is not None:
                    short = ((k[12] * s + k[13]) * s + k[14]) * s + k[15]
                    for j, (stiff, tau) in enumerate(zip(creep.stiffness, creep.time_constant, strict=True), i_creep):
                        gap = short - y[j]
                        d[j] = gap / tau
                        force += stiff * gap
                torque -= arm * force
            stop = 0.0
            if angle < low:
                stop = ks * (low - angle) - ds * rate
                if stop < 0.0:
                    stop = 0.0
            elif angle > high:
                stop = ks * (high - angle) - ds * rate
                if stop > 0.0:
                    stop = 0.0
            d[2] = rate
            d[3] = (torque - viscous * rate - coulomb * tanh(rate / speed) - weight * sin(angle) + stop) / inertia
            if i_sensor >= 0:
                d[i_sensor] = (p - y[i_sensor]) / lag_sensor
            return d

        return rhs

    def derivative(self, state: Sequence[float], opening: float) -> State:
        """Time derivative of the state at a signed valve opening (before its lag)."""
        return self._rhs(list(state), opening)

    def advance(self, y: State, opening: float, span: float, step: float, rtol: float = 1.0e-8) -> tuple[State, float]:
        """Integrate over `span` [s] at a constant opening.

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
            k6 = f([y[i] + c1 * k1[i] + c2 * k2[i] + c3 * k3[i] + c4 * k4[i] + c5 * k5[i] for i in n], opening)
            c1, c3, c4 = h * 35.0 / 384.0, h * 500.0 / 1113.0, h * 125.0 / 192.0
            c5, c6 = -h * 2187.0 / 6784.0, h * 11.0 / 84.0
            new = [y[i] + c1 * k1[i] + c3 * k3[i] + c4 * k4[i] + c5 * k5[i] + c6 * k6[i] for i in n]
            k7 = f(new, opening)
            c1, c3, c4 = h * 71.0 / 57600.0, -h * 71.0 / 16695.0, h * 71.0 / 1920.0
            c5, c6, c7 = -h * 17253.0 / 339200.0, h * 22.0 / 525.0, -h / 40.0
            worst = 0.0
            for i in n:
                err = abs(c1 * k1[i] + c3 * k3[i] + c4 * k4[i] + c5 * k5[i] + c6 * k6[i] + c7 * k7[i])
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

    def reading(self, y: State) -> tuple[float, float, float]:
        """Noise-free transducer values: muscle and supply pressure [gauge Pa], joint angle [rad]."""
        p = y[self.i_sensor] if self.i_sensor >= 0 else y[0]
        return (
            p - self.par.ambient + self.par.pressure_zero,
            y[1] - self.par.ambient,
            y[2] + self.par.angle_zero,
        )
