"""The independent plant: tank, valve, muscles, joint and arm under an adaptive Dormand-Prince 5(4)
pair.

The inner loop uses plain floats: one right-hand side, see :mod:`.rates`, costs a few microseconds.
Effects enter at the ports of :class:`.effects.Effect`; without any, none of them costs more than a
test.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from scipy.optimize import brentq

from .effects import Effects, Env, HeatTransfer, Start
from .flows import area_of, orifice_of, settle
from .geometry import JointTables, RigidTables
from .rates import rates_of
from .solver import Solver, State

Ports = list[Callable[..., Any]]


@dataclass(frozen=True)
class Parameters:
    """All numbers of the plant without effects; SI units, angles in rad, pressures in Pa (gauge if
    noted).

    `kind` "joint": muscles turn an arm; "mass": they lift a mass, and the place of the angle is
    taken by their shortening [m]; "rigid": there are none, only the volume. `feed` "valve": from a
    tank; "regulator": its outlet follows the command with `time_constant` [s], less by `droop`
    [Pa s/kg], and a nozzle of `area_max` leads to the muscles; "vent": the volume empties through
    that nozzle.
    """

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
    kind: str = "joint"
    feed: str = "valve"
    time_constant: float = 0.0
    droop: float = 0.0

    def pull(self, angle: float) -> float:
        """Part of the weight's torque that acts at an angle [rad]: all of it on a hanging mass."""
        return math.sin(angle) if self.kind == "joint" else 1.0

    @property
    def weight(self) -> float:
        """Largest torque of the weight [N m], or the weight of a hanging mass [N]."""
        return (self.first_moment + self.payload * self.length) * self.gravity


class Plant(Solver):
    """Plant with a set of effects.

    The state is ``[p, p_supply, angle, rate, ...]`` in absolute Pa, rad and rad/s, followed by the
    time [s] when an effect needs it and by the states of the effects.

    Parameters
    ----------
    parameters : Parameters
        Baseline numbers.
    effects : Effects
        What the plant has besides.

    Raises
    ------
    ValueError
        Two effects that cannot be in one plant.
    """

    def __init__(self, parameters: Parameters, effects: Effects | None = None) -> None:
        self.par = parameters
        # an effect of no size would still cost time, and a share of zero divide by it
        self.effects = Effects(*(e for e in effects or () if e.active()))
        self.tables: JointTables | RigidTables = (
            RigidTables(parameters.dead_volume)
            if parameters.kind == "rigid"
            else JointTables(
                parameters.muscle, parameters.joint, parameters.count, parameters.modulus_scale
            )
        )
        self.scale = [1.0e5, 1.0e6, 1.0, 1.0]
        self.i_clock = -1
        if any(e.needs_clock for e in self.effects):
            self.i_clock = 4
            self.scale.append(1.0e9)  # exact: its derivative is 1
        self.slots: list[int] = []
        for effect in self.effects:
            self.slots.append(len(self.scale))
            self.scale += effect.sizes()
        self.size = len(self.scale)
        self.env = Env(parameters, self.tables, self.i_clock)
        self.ticks = self.ports("tick")
        self._reads = self.ports("read")
        self.area = area_of(parameters)
        self._line = self.port("line", False)
        self._flows = self.valve()
        self._rhs = rates_of(self)

    def ports(self, name: str, own: bool = True) -> Ports:
        """Functions of all effects at one port."""
        found = (
            getattr(e, name)(self.env, first) if own else getattr(e, name)(self.env)
            for e, first in zip(self.effects, self.slots, strict=True)
        )
        return [f for f in found if f is not None]

    def port(self, name: str, own: bool = True) -> Any:
        """The function at a port that takes one effect; None when there is none."""
        found = self.ports(name, own)
        if len(found) > 1:
            raise ValueError(f"two effects at the port {name!r}")
        return found[0] if found else None

    @property
    def heat(self) -> tuple[HeatTransfer | None, int]:
        """The exchange of heat with the wall, if there is one, and the index of its temperature."""
        for effect, first in zip(self.effects, self.slots, strict=True):
            if isinstance(effect, HeatTransfer):
                return effect, first
        return None, -1

    def initial(
        self, pressure: float, supply: float, angle: float, rate: float = 0.0, clock: float = 0.0
    ) -> State:
        """State at absolute pressures [Pa] and a time [s] with every memory at rest."""
        par = self.par
        y = [pressure, supply, angle, rate]
        if self.i_clock >= 0:
            y.append(clock)
        if self.effects.items:
            weight = par.weight * par.pull(angle)
            at = Start(pressure, supply, angle, self.tables.contraction(angle), weight)
            for effect in self.effects:
                y.extend(effect.start(at))
        return y

    def rest(self, supply: float, clock: float = 0.0) -> State:
        """Vented muscle, arm at rest on its lower stop."""
        par = self.par
        if par.kind == "rigid":
            return self.initial(par.ambient, supply, 0.0, 0.0, clock)
        low, weight = par.joint["min_angle"], par.weight

        def torque(angle: float) -> float:
            stop = par.joint["stop_stiffness"] * max(low - angle, 0.0)
            return float(self.tables.at(angle)[1]) - weight * par.pull(angle) + stop

        below, above = (
            (math.radians(4.0), math.radians(20.0)) if par.kind == "joint" else (3.0e-3, 0.02)
        )
        angle = float(brentq(torque, low - below, low + above, xtol=1e-12))
        return self.initial(par.ambient, supply, angle, 0.0, clock)

    def holding_pressure(self, angle: float) -> float:
        """Gauge pressure [Pa] that holds the arm at an angle [rad]."""
        par = self.par
        values = self.tables.at(angle)
        return float((par.weight * par.pull(angle) - values[1]) / values[0])

    def normalised(self, command: float) -> float:
        """Command [V] as a part of half the stroke, -1..1; of a regulator, set pressure [bar] as a
        part of 10 bar.
        """
        if self.par.feed == "regulator":
            return min(max(0.1 * command, -1.0), 1.0)
        return min(max((command - self.par.null_voltage) / self.par.half_range, -1.0), 1.0)

    def valve(self) -> Callable[[float, float, float, float], tuple[float, float]]:
        """Flows into and out of the muscles [kg/s] from opening, tank and muscle pressure and gas
        temperature.
        """
        par, area, orifice = self.par, self.area, orifice_of(self.par)
        ambient, t0 = par.ambient, par.temperature
        jet = math.sqrt(2.0 / (par.gas_constant * t0))
        line, exhaust, gap = self.port("line", False), self.port("exhaust", False), self.port("gap")
        heat, _ = self.heat
        share = heat.share if heat is not None else 0.0
        sqrt, regulated = math.sqrt, par.feed == "regulator"
        last = [math.nan, 0.0]  # opening and its conductance: constant over most steps

        def flows(x: float, ps: float, p: float, temperature: float) -> tuple[float, float]:
            if x != last[0]:
                last[0], last[1] = x, jet * area(abs(x))
            c, m_in, m_out = last[1], 0.0, 0.0
            if regulated:
                net = jet * par.area_max * orifice(ps, p)
                return (net, 0.0) if net > 0.0 else (0.0, -net)
            if x > 0.0:
                m_in = c * orifice(ps, p)
                if line is not None:
                    m_in = settle(lambda m: c * orifice(ps, line(m, p)), m_in)
            elif x < 0.0:
                if share:
                    c *= 1.0 + share * (sqrt(t0 / temperature) - 1.0)
                m_out = c * orifice(p, ambient)
                if line is not None or exhaust is not None:
                    m_out = settle(
                        lambda m: (
                            c
                            * orifice(
                                p if line is None else line(-m, p),
                                ambient if exhaust is None else exhaust(m),
                            )
                        ),
                        m_out,
                    )
            if gap is not None:
                to_muscle, to_ambient = gap(x, ps, p)
                m_in += to_muscle
                m_out += to_ambient
            return m_in, m_out

        return flows

    def derivative(self, state: Sequence[float], opening: float) -> State:
        """Time derivative of the state at a signed valve opening (before its lag)."""
        return self._rhs(list(state), opening)

    def tick(self, y: State) -> State:
        """State after what effects do once per sample (relays, largest values, play)."""
        if self.ticks:
            y = list(y)
            for change in self.ticks:
                change(y)
        return y

    def reading(self, y: State, opening: float = 0.0) -> tuple[float, float, float]:
        """Noise-free transducer values: muscle and supply pressure [gauge Pa], joint angle [rad].

        `opening` is the signed opening of the valve; only a line between valve and muscle needs it.
        """
        par = self.par
        p, ps, angle = y[0] - par.ambient, y[1] - par.ambient, y[2]
        if self._line is not None:
            m_in, m_out = self._flows(opening, y[1], y[0], par.temperature)
            p = self._line(m_in - m_out, y[0]) - par.ambient
        for read in self._reads:
            p, ps, angle = read(p, ps, angle, y)
        return p + par.pressure_zero, ps, angle + par.angle_zero
