"""Rigs of several supplies, valves, lines, chambers, muscles and joints, from the description that
the core takes.

A rig is a graph: gas nodes (supplies, chambers, inlets of lines, ambient) joined by flows, and
coordinates (joint angles, or the shortening on a linear load) on which muscles pull. Pressures
inside are absolute, channels are gauge. Every book (masses, energies, works) is a further state of
the integrator, not a sum over samples; the positive work at the joints, with a kink at every
reversal, is read off the signed work of each.

Flows run down the pressure in either direction, through a valve too; in a tube of segments each has
its own inertia and is a state. What the reference has no
equation for (effects, sensor errors, hysteresis, load frames) is refused.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache, partial
from itertools import pairwise
from typing import Any, Literal, Protocol

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp

from .gas import LAMINAR_RATIO, Valve, iso_flow, orifice_flow
from .geometry import GeometryReference
from .muscle import MuscleReference, MuscleTable
from .planar import Link, PlanarArm
from .plant import Arm, Gas, Joint
from .spool import Piece, pieces_of

Array = NDArray[np.float64]

#: Density (kg/m^3) and temperature (K) of the reference air of ISO 6358.
STANDARD_DENSITY, STANDARD_TEMPERATURE = 1.185, 293.15

#: What the muscle tables reach beyond the stops: angle (rad), or shortening on a load (of the rest
#: length).
STOP_DEPTH, LOAD_DEPTH = 0.05, 0.03

BOOKS = (
    "mass_supplied",
    "mass_vented",
    "energy_supplied",
    "exergy_supplied",
    "muscle_work",
    "joint_work",
)
#: Sums of the chambers with an energy balance: enthalpy by flows, heat from walls, work of the gas.
HEAT_BOOKS = ("enthalpy_gained", "heat_gained", "gas_work")
SUPPLIES = ("tank", "constant", "regulator")


def suffix(channel: str, name: str) -> str:
    """Channel of one block: the bare word for the unnamed one."""
    return f"{channel}.{name}" if name else channel


def _port(block: str, name: str) -> str:
    return f"{block}.{name}" if name else block


# ------------------------------------------------------------------ flows


#: Anything that lets air through: mass flow (kg/s) from its first absolute pressure to its second.
Flow = Callable[[float, float], float]


@dataclass(frozen=True)
class Orifice:
    """Isentropic orifice of a discharge area (m^2), in both directions."""

    area: float
    gas: Gas

    def __call__(self, first: float, second: float) -> float:
        """Mass flow from the first to the second, kg/s."""
        gas = self.gas
        flow = orifice_flow(
            self.area,
            max(first, second),
            min(first, second),
            gas.temperature,
            gas.gas_constant,
            gas.heat_capacity_ratio,
        )
        return flow if first > second else -flow


@dataclass(frozen=True)
class Conductance:
    """Restriction of a sonic conductance (m^3/(s Pa)) and a critical ratio, in both directions."""

    conductance: float
    critical: float
    gas: Gas

    def __call__(self, first: float, second: float) -> float:
        """Mass flow from the first to the second, kg/s."""
        high, low = max(first, second), min(first, second)
        flow = iso_flow(self.conductance, self.critical, high, low, self.gas.temperature)
        return flow if first > second else -flow


@dataclass(frozen=True)
class Tube:
    """Tube after ISO 6358, in both directions; its volume belongs to its ends."""

    length: float
    diameter: float
    gas: Gas

    @property
    def conductance(self) -> float:
        """Sonic conductance C, m^3/(s Pa)."""
        return 0.029 * self.diameter**2 / math.sqrt(self.length / self.diameter**1.25 + 510.0)

    @property
    def critical_ratio(self) -> float:
        """Critical pressure ratio b."""
        return 474.0 * self.conductance / self.diameter**2

    @property
    def half_volume(self) -> float:
        """Half of the volume inside, m^3."""
        return math.pi / 8.0 * self.diameter**2 * self.length

    def flow_function(self, ratio: float) -> float:
        """Flow at a pressure ratio as a fraction of the choked flow."""
        if ratio > LAMINAR_RATIO:
            return self.flow_function(LAMINAR_RATIO) * (1.0 - ratio) / (1.0 - LAMINAR_RATIO)
        b = self.critical_ratio
        return 1.0 if ratio <= b else math.sqrt(1.0 - ((ratio - b) / (1.0 - b)) ** 2)

    def __call__(self, first: float, second: float) -> float:
        """Mass flow from the first to the second, kg/s."""
        high, low = max(first, second), min(first, second)
        choked = (
            self.conductance
            * STANDARD_DENSITY
            * high
            * math.sqrt(STANDARD_TEMPERATURE / self.gas.temperature)
        )
        return math.copysign(choked * self.flow_function(low / high), first - second)


@dataclass(frozen=True)
class Segment:
    """One of equal segments of a tube with waves: inertia between two nodes of gas.

    In the steady state ``f(y) = y^2 + 2 (h - b^2) ln y + h b^2/y^2`` falls by ``k`` from end to end
    of the whole tube, ``y`` being the pressure over that which would drive the flow into a vacuum;
    ``f'(b) = 0`` is where it chokes. A flow that is not steady is driven by what is left.
    """

    tube: Tube
    count: int

    @property
    def bend(self) -> float:
        """``h``: with it the choked flow and the slope next to equal pressures are the tube's."""
        b = self.tube.critical_ratio
        fall = math.log(1.0 / b)
        told = (2.0 * b * b * fall - b * (1.0 - b)) / (2.0 * fall - (1.0 - b * b))
        return max(told, -b * b)

    def beside(self, y: float) -> float:
        """``f - y^2``: what the flow takes along."""
        b, h = self.tube.critical_ratio, self.bend
        return 2.0 * (h - b * b) * math.log(y) + h * b * b / (y * y)

    def acceleration(self, first: float, second: float, flow: float) -> float:
        """Rate of the mass flow from the first to the second, kg/s^2."""
        tube, b = self.tube, self.tube.critical_ratio
        per_length = math.pi / 4.0 * tube.diameter**2 * self.count / tube.length
        if abs(flow) < 1e-30:
            return per_length * (first - second)
        if flow < 0.0:
            first, second = second, first
        drive = abs(flow) / tube(1.0, 0.0)  # choked, per pressure
        high, low = max(first, b * drive), max(second, b * drive)
        loss = (1.0 - b * b + self.beside(1.0) - self.beside(b)) / self.count
        edge = tube.flow_function(LAMINAR_RATIO) * 0.5 * (high + low)
        taken = self.beside(high / drive) - self.beside(low / drive)
        left = high - low + drive * (drive * taken - loss * max(drive, edge)) / (high + low)
        return math.copysign(1.0, flow) * per_length * left


# ------------------------------------------------------------------ transmissions


class Transmission(Protocol):
    """Shortening (m) of a muscle and its slope (m/rad) at a joint angle."""

    def contraction(self, angle: float) -> float: ...

    def moment_arm(self, angle: float) -> float: ...


@dataclass(frozen=True)
class Polynomial:
    """Shortening as a power series of the angle from rest, without a constant term.

    A pulley is its first order; on a linear load the coordinate is the shortening itself, a pulley
    of radius one.
    """

    coefficients: Sequence[float]
    rest_angle: float

    def contraction(self, angle: float) -> float:
        """Shortening, m."""
        return sum(c * (angle - self.rest_angle) ** k for k, c in enumerate(self.coefficients, 1))

    def moment_arm(self, angle: float) -> float:
        """Slope of the shortening, m/rad."""
        return sum(
            k * c * (angle - self.rest_angle) ** (k - 1) for k, c in enumerate(self.coefficients, 1)
        )


def transmission(model: Mapping[str, Any]) -> Transmission:
    """Transmission of a rig description."""
    kind = model["kind"]
    if kind == "tendon":
        keys = ("upper_axial", "upper_offset", "lower_axial", "lower_offset", "rest_angle")
        return Joint(**{key: model[key] for key in keys})
    if kind == "pulley":
        return Polynomial((model["radius"],), model["rest_angle"])
    if kind == "polynomial":
        return Polynomial(tuple(model["coefficients"]), model["rest_angle"])
    raise ValueError(f"the reference has no transmission {kind!r}")


# ------------------------------------------------------------------ muscles


@lru_cache(maxsize=64)
def tabulate(muscle: MuscleReference, low: float, high: float, degree: int = 20) -> MuscleTable:
    """Chebyshev table on [low, high] whose pieces are halved until their series have died away.

    The kinks (rest, and where the braid goes taut) are seams.
    """
    geometry = muscle.geometry
    seams = [0.0]
    if low < 0.0:
        seams.insert(0, geometry.taut_contraction())
    edges = [low, *(seam for seam in seams if low < seam < high), high]
    todo = list(zip(edges[:-1], edges[1:], strict=True))[::-1]
    nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    pieces = []
    while todo:
        a, b = todo.pop()
        points = 0.5 * (a + b) + 0.5 * (b - a) * nodes
        rows = np.array(
            [(*muscle.coefficients(float(x)), geometry.solve(float(x)).air_volume) for x in points]
        )
        fits = [Chebyshev.fit(points, rows[:, j], degree, domain=[a, b]) for j in range(4)]
        tails = [np.abs(fit.coef[-2:]).max() / max(np.abs(fit.coef).max(), 1e-300) for fit in fits]
        if max(tails) > 1e-11 and b - a > 1e-3:
            todo += [(0.5 * (a + b), b), (a, 0.5 * (a + b))]
        else:
            pieces.append((a, b, fits, fits[3].deriv()))
    return MuscleTable(muscle.modulus_scale, pieces)


def muscle_of(model: Mapping[str, Any]) -> MuscleReference:
    """Muscle of a rig description; one whose force depends on its direction is refused."""
    shape = {key.name: model[key.name] for key in fields(GeometryReference) if key.name in model}
    own = {
        key.name: model[key.name]
        for key in fields(MuscleReference)
        if key.name in model and key.name != "geometry"
    }
    warmer = model.get("temperature", 0.0) - model.get("reference_temperature", 0.0)
    own["modulus_scale"] *= 1.0 - model.get("softening", 0.0) * warmer
    own = {key: tuple(value) if isinstance(value, list) else value for key, value in own.items()}
    muscle = MuscleReference(GeometryReference(**shape, kind=model["geometry"]), **own)
    friction = (muscle.friction_coefficient, muscle.friction_pressure_slope, muscle.friction_floor)
    two_branches = muscle.model == "elbow_linear" and any(
        factor != 1.0 for factor in muscle.extension_factors
    )
    if any(friction) or two_branches:
        raise ValueError("the reference has no muscle whose force depends on its direction")
    return muscle


@dataclass(frozen=True)
class Pull:
    """A bundle of muscles between a chamber (node index) and a coordinate (index)."""

    muscle: MuscleReference
    table: MuscleTable
    chamber: int
    coordinate: int
    transmission: Transmission
    buckling_load: float

    def held(self, force: float) -> float:
        """Force of one muscle that bows out where it is pushed: a push grows with a slope that
        falls from 1 at none to 0 at twice the load. Without a load it is slack.
        """
        load = self.buckling_load
        if force >= 0.0 or load >= 1e9:
            return force
        if load == 0.0:
            return 0.0
        push = min(-force, 2.0 * load)
        return -(push - push**2 / (4.0 * load))


# ------------------------------------------------------------------ gas nodes and coordinates


@dataclass(frozen=True)
class Node:
    """Gas of one pressure; `volume` is what does not belong to muscles, `start` its initial
    absolute pressure.
    """

    kind: str
    name: str
    volume: float = 0.0
    start: float = math.nan
    alpha_in: float = 1.0
    alpha_out: float = 1.0
    alpha: float = 1.0
    time_constant: float = math.nan
    droop: float = 0.0
    #: Of a regulator: how late a command acts (s), fastest rise and fall of its outlet (Pa/s).
    dead_time: float = 0.0
    rise_limit: float = math.inf
    fall_limit: float = math.inf
    #: Error of its outlet that a regulator does not answer (Pa).
    dead_band: float = 0.0
    #: Port of the supply in front of a regulator, empty where nothing limits it.
    inlet: str = ""
    #: Heat transfer coefficient (W/(m^2 K)) of a chamber with an energy balance.
    heat_transfer: float | None = None


@dataclass(frozen=True)
class Coordinate:
    """A joint angle, or the shortening on a linear load, with its stops."""

    name: str
    rest: float
    low: float
    high: float
    stiffness: float
    damping: float
    #: Of a spring across a joint: stiffness (N m/rad), angle at which it is at rest (rad).
    spring: tuple[float, float] = (0.0, 0.0)

    def passive(self, position: float, rate: float) -> float:
        """Force of stops and spring."""
        stiffness, rest = self.spring
        return self.stop(position, rate) - stiffness * (position - rest)

    def stop(self, position: float, rate: float) -> float:
        """Force of the stops; a stop pushes, it never pulls."""
        if position < self.low:
            return max(self.stiffness * (self.low - position) - self.damping * rate, 0.0)
        if position > self.high:
            return -max(self.stiffness * (position - self.high) + self.damping * rate, 0.0)
        return 0.0


#: Accelerations of all coordinates at positions, rates, and forces on them (muscles, stops,
#: springs).
Body = Callable[[Sequence[float], Sequence[float], Sequence[float]], list[float]]


def _one_link(model: Mapping[str, Any]) -> Body:
    arm = Arm(**{key.name: model[key.name] for key in fields(Arm) if key.name in model})
    return lambda q, v, f: [arm.acceleration(q[0], v[0], f[0])]


def _planar(model: Mapping[str, Any], joints: Sequence[Coordinate]) -> Body:
    names = [_port("joint", joint.name) for joint in joints]
    order = [names.index(link["joint"]) for link in model["links"]]
    links = [Link.from_model(link) for link in model["links"]]
    arm = PlanarArm(links, model["gravity"], model.get("base_angle", 0.0))

    def accelerate(q: Sequence[float], v: Sequence[float], f: Sequence[float]) -> list[float]:
        found = arm.acceleration(*([values[i] for i in order] for values in (q, v, f)))
        return [found[order.index(i)] for i in range(len(order))]

    return accelerate


def _mass(load: Mapping[str, Any]) -> Body:
    def accelerate(_: Sequence[float], v: Sequence[float], f: Sequence[float]) -> list[float]:
        friction = load["viscous"] * v[0] + load["coulomb"] * math.tanh(
            v[0] / load["coulomb_speed"]
        )
        return [(f[0] - friction) / load["mass"] - load["gravity"]]

    return accelerate


def _held(q: Sequence[float], v: Sequence[float], f: Sequence[float]) -> list[float]:
    """Nothing to move: the joints stay where they start."""
    return [0.0] * len(q)


# ------------------------------------------------------------------ the rig


def _alike(alpha: float) -> dict[str, float]:
    """One coefficient for all that happens to a gas."""
    return dict.fromkeys(("alpha_in", "alpha_out", "alpha"), alpha)


def _numbered(name: str, k: int) -> str:
    """A part of a line."""
    return f"{name}.{k}" if name else str(k)


class Network:
    """A rig made ready to integrate.

    Parameters
    ----------
    model : mapping
        The description that the core takes (SI, radians, gauge pressures).
    """

    def __init__(self, model: Mapping[str, Any]) -> None:
        zeros = [s["pressure_zero"] or s["angle_zero"] for s in model["sensors"]]
        zeros += [b.get("pressure_zero") for kind in ("supplies", "lines") for b in model[kind]]
        if model["effects"] or any(zeros):
            raise ValueError("the reference has no effects and no sensor errors")
        self.gas = Gas(**model["gas"])
        self.rt = self.gas.gas_constant * self.gas.temperature
        self.nodes: list[Node] = []
        self.index: dict[str, int] = {}
        self.pipes: list[tuple[Flow, int, int]] = []
        self.valves: list[tuple[Valve, str, int, int]] = []
        self.segments: list[tuple[Segment, str, int, int]] = []
        self.parts = {suffix("valve_command", part["name"]): part for part in model["valves"]}
        self._build_gas(model)
        self.rest_length = math.nan
        self.coordinates, self.body = self._build_body(model)
        self.pulls = [self._build_pull(part, model) for part in model["muscles"]]

    def _add(self, port: str, node: Node) -> None:
        self.index[port] = len(self.nodes)
        self.nodes.append(node)

    def _build_gas(self, model: Mapping[str, Any]) -> None:
        gas, ambient = self.gas, self.gas.ambient_pressure
        tubes: dict[str, Tube] = {}
        halves: dict[str, float] = {}
        for line in model["lines"]:
            own = _port("line", line["name"])
            if line["from"] and line.get("inlet_volume", 0.0):
                raise ValueError(
                    f"{own}: the reference has an inlet volume only where valves feed the line"
                )
            if line["kind"] == "tube":
                tubes[own] = Tube(line["length"], line["diameter"], gas)
                share = tubes[own].half_volume / max(line.get("segments", 0), 1)
                for end in (line["from"] or own, line["to"]):
                    halves[end] = halves.get(end, 0.0) + share
        for supply in model["supplies"]:
            numbers = {
                key: supply[key]
                for key in (
                    "volume",
                    "time_constant",
                    "droop",
                    "dead_time",
                    "rise_limit",
                    "fall_limit",
                    "dead_band",
                    "inlet",
                )
                if supply.get(key) is not None
            }
            start = ambient + supply["initial_pressure"]
            self._add(
                _port("supply", supply["name"]),
                Node(supply["kind"], supply["name"], start=start, **numbers),
            )
        for chamber in model["chambers"]:
            own = _port("chamber", chamber["name"])
            if chamber.get("gas") == "energy_balance":
                law = {"heat_transfer": chamber["heat_transfer_coefficient"]}
            else:
                law = {key: chamber[key] for key in ("alpha_in", "alpha_out", "alpha")}
            volume = chamber["dead_volume"] + halves.get(own, 0.0)
            self._add(
                own,
                Node(
                    "chamber",
                    chamber["name"],
                    volume,
                    ambient + chamber["initial_pressure"],
                    **law,
                ),
            )
        for line in model["lines"]:
            if not line["from"]:
                own = _port("line", line["name"])
                law = _alike(line["alpha"]) if line.get("segments") else {}
                volume = line["inlet_volume"] + halves.get(own, 0.0)
                self._add(own, Node("inlet", line["name"], volume, **law))
        self.inlet_ends = {
            _port("line", line["name"]): line["to"] for line in model["lines"] if not line["from"]
        }
        for line in model["lines"]:
            own = _port("line", line["name"])
            for k in range(1, line.get("segments", 0)):
                name, volume = _numbered(line["name"], k), 2.0 * tubes[own].half_volume
                node = Node("segment", name, volume / line["segments"], **_alike(line["alpha"]))
                self._add(_numbered(own, k), node)
                self.inlet_ends[_numbered(own, k)] = line["to"]
        self._add("ambient", Node("ambient", "", start=ambient))
        for line in model["lines"]:
            own = _port("line", line["name"])
            if count := line.get("segments", 0):
                ports = [line["from"] or own, *(_numbered(own, k) for k in range(1, count))]
                nodes = [self.index[port] for port in (*ports, line["to"])]
                for k, ends in enumerate(pairwise(nodes)):
                    part = Segment(tubes[own], count)
                    self.segments.append((part, _numbered(line["name"], k + 1), *ends))
                continue
            flow: Flow = tubes[own] if own in tubes else Orifice(line["discharge_area"], gas)
            self.pipes.append((flow, self.index[line["from"] or own], self.index[line["to"]]))
        for part in model["valves"]:
            valve = Valve(**{key.name: part[key.name] for key in fields(Valve) if key.name in part})
            if part.get("flow") == "iso_6358":
                paths = [
                    (part[f"{way}_conductance"], part[f"{way}_critical_ratio"])
                    for way in ("fill", "vent")
                ]
                valve = replace(valve, iso=(paths[0], paths[1]))
            self.valves.append(
                (valve, part["name"], self.index[part["from"]], self.index[part["to"]])
            )

    def _build_body(self, model: Mapping[str, Any]) -> tuple[list[Coordinate], Body]:
        arm, load = model["arm"], model["load"]
        if load is not None:
            if load["kind"] != "mass":
                raise ValueError(f"the reference has no load {load['kind']!r}")
            self.rest_length = next(
                part["muscle"]["rest_length"]
                for part in model["muscles"]
                if part["joint"] == "load"
            )
            low, high = self.rest_length - load["max_length"], self.rest_length - load["min_length"]
            return [
                Coordinate("", 0.0, low, high, load["stop_stiffness"], load["stop_damping"])
            ], _mass(load)
        keys = ("name", "rest_angle", "min_angle", "max_angle", "stop_stiffness", "stop_damping")
        joints = [
            Coordinate(
                *(joint[key] for key in keys),
                spring=(joint.get("stiffness", 0.0), joint.get("spring_angle", 0.0)),
            )
            for joint in model["joints"]
        ]
        if arm is None:
            return joints, _held
        return joints, _one_link(arm) if arm["kind"] == "one_link" else _planar(arm, joints)

    def _build_pull(self, part: Mapping[str, Any], model: Mapping[str, Any]) -> Pull:
        muscle = muscle_of(part["muscle"])
        rest = muscle.geometry.rest_length
        means: Transmission = Polynomial((1.0,), 0.0)
        if part["joint"] == "load":
            number, depth = 0, LOAD_DEPTH * rest
        else:
            number = [_port("joint", joint["name"]) for joint in model["joints"]].index(
                part["joint"]
            )
            means, depth = (
                transmission(part["transmission"] or model["joints"][number]["transmission"]),
                STOP_DEPTH,
            )
        at = self.coordinates[number]
        shortening = list(_possible(means, np.linspace(at.low - depth, at.high + depth, 201)))
        low = max(min(shortening) / rest - 1e-3, (1.0 - 1e-4) * muscle.geometry.min_contraction)
        high = min(max(shortening) / rest + 1e-3, muscle.geometry.max_contraction)
        load = part["muscle"].get("buckling_load", 0.0)
        table = tabulate(muscle, low, high)
        return Pull(muscle, table, self.index[part["chamber"]], number, means, load)

    # ---------------------------------------------------------------- states

    def start(self, initial: Mapping[str, float]) -> Array:
        """State at the first sample, from gauge pressures; what `initial` leaves out is as
        described, at rest.
        """
        left = dict(initial)
        ambient = self.gas.ambient_pressure
        words = {
            "chamber": "muscle_pressure",
            "inlet": "line_pressure",
            "segment": "segment_pressure",
            **dict.fromkeys(SUPPLIES, "supply_pressure"),
        }
        pressure = [node.start for node in self.nodes]
        for i, node in enumerate(self.nodes):
            channel = suffix(words.get(node.kind, ""), node.name)
            if channel in left:
                pressure[i] = left.pop(channel) + ambient
        for port in self.inlet_ends:
            end = port
            while math.isnan(pressure[self.index[end]]):
                end = self.inlet_ends[end]
            pressure[self.index[port]] = pressure[self.index[end]]
        position, rate = [], []
        for coordinate in self.coordinates:
            if math.isnan(self.rest_length):
                position.append(left.pop(suffix("joint_angle", coordinate.name), coordinate.rest))
                rate.append(left.pop(suffix("joint_rate", coordinate.name), 0.0))
            else:
                position.append(self.rest_length - left.pop("length", self.rest_length))
                rate.append(-left.pop("length_rate", 0.0))
        through = [left.pop(f"segment_flow.{name}", 0.0) for _, name, _, _ in self.segments]
        if left:
            raise ValueError(f"initial values of nothing in this rig: {', '.join(left)}")
        volume = self.volumes(position)
        mass = [p * v / self.rt for p, v in zip(pressure, volume, strict=True)]
        return np.array(
            [
                *pressure[:-1],
                *position,
                *rate,
                *mass[:-1],
                *(0.0 for _ in BOOKS[:-1]),
                *(0.0 for _ in position),
                *(0.0 for _ in HEAT_BOOKS),
                *through,
            ]
        )

    def volumes(self, position: Sequence[float]) -> list[float]:
        """Volume of every node with the muscles that belong to it, m^3 (zero where it does not
        matter).
        """
        volume = [node.volume for node in self.nodes]
        for pull in self.pulls:
            e = (
                pull.transmission.contraction(position[pull.coordinate])
                / pull.muscle.geometry.rest_length
            )
            volume[pull.chamber] += pull.muscle.count * pull.table(e, 0.0)[1]
        return volume

    def split(self, state: Array) -> tuple[Array, ...]:
        """Pressures (absolute), positions, rates, masses, books, heat books and flows of segments
        of states (..., m), the last of the books the work at each joint.
        """
        n, c = len(self.nodes) - 1, len(self.coordinates)
        sizes = [n, c, c, n, len(BOOKS) - 1 + c, len(HEAT_BOOKS)]
        parts = np.split(state, np.cumsum(sizes), axis=-1)
        return tuple(parts)

    def tolerances(self, state: Array, rtol: float) -> Array:
        """Absolute tolerances of a state."""
        pressure, position, rate, mass, books, heat, through = self.split(state)
        air = max(
            self.gas.ambient_pressure * sum(self.volumes(position.tolist())[:-1]) / self.rt, 1e-9
        )
        works = [air, air, *(air * self.rt,) * (books.size - 2 + heat.size)]
        return rtol * np.array(
            [
                *(1e5,) * pressure.size,
                *(1.0,) * (position.size + rate.size),
                *(air,) * mass.size,
                *works,
                *(1e-3,) * through.size,
            ]
        )

    # ---------------------------------------------------------------- equations

    def flows(self, position: Mapping[str, float]) -> list[tuple[Flow, int, int]]:
        """Every open way at positions of the valves, with its two ends."""
        ways = list(self.pipes)
        for valve, name, source, target in self.valves:
            x = position[suffix("valve_command", name)]
            share = valve.share_at(x)
            if share == 0.0 or x == 0.0:
                continue
            ends = (source, target) if share > 0.0 else (target, self.index["ambient"])
            if valve.iso is None:
                flow: Flow = Orifice(valve.discharge_area_max * abs(share), self.gas)
            else:
                conductance, critical = valve.iso[share < 0.0]
                flow = Conductance(conductance * abs(share), critical, self.gas)
            ways.append((flow, *ends))
        return ways

    def derivative(
        self, state: Array, ways: Iterable[tuple[Flow, int, int]], set_pressure: Sequence[float]
    ) -> list[float]:
        """Time derivative of a state, with the open ways and the absolute set pressure of every
        node (regulators').
        """
        gas, count, size = self.gas, len(self.nodes), len(self.coordinates)
        values = state.tolist()
        pressure = [*values[: count - 1], gas.ambient_pressure]
        position = values[count - 1 : count - 1 + size]
        rate = values[count - 1 + size : count - 1 + 2 * size]
        if min(pressure) <= 0.0:
            raise ValueError("absolute pressure not above zero")
        volume = [node.volume for node in self.nodes]
        volume_rate, wall = [0.0] * count, [0.0] * count
        force = [0.0] * size
        work = 0.0
        for pull in self.pulls:
            k, rest, n = pull.coordinate, pull.muscle.geometry.rest_length, pull.muscle.count
            moment_arm = pull.transmission.moment_arm(position[k])
            e = pull.transmission.contraction(position[k]) / rest
            one, air, slope = pull.table(e, pressure[pull.chamber] - gas.ambient_pressure)
            one = pull.held(one)
            volume[pull.chamber] += n * air
            volume_rate[pull.chamber] += n * slope * moment_arm * rate[k] / rest
            wall[pull.chamber] += n * 2.0 * math.sqrt(math.pi * air * rest * (1.0 - e))
            force[k] += n * one * moment_arm
            work += n * one * moment_arm * rate[k]
        mass = values[count - 1 + 2 * size : 2 * (count - 1 + size)]
        warmth = [gas.temperature] * count
        for i, node in enumerate(self.nodes[:-1]):
            if node.heat_transfer is not None:
                warmth[i] = pressure[i] * volume[i] / (mass[i] * gas.gas_constant)
        inflow, outflow, carried = [0.0] * count, [0.0] * count, [0.0] * count
        for flow, i, j in ways:
            mass_flow = flow(pressure[i], pressure[j])
            source, target = (i, j) if mass_flow > 0.0 else (j, i)
            # the density of what comes falls with its temperature, the speed of sound rises
            moved = abs(mass_flow) * math.sqrt(gas.temperature / warmth[source])
            outflow[source] += moved
            inflow[target] += moved
            carried[target] += moved * warmth[source]
        faster = []
        through = values[len(values) - len(self.segments) :]
        for (part, _, i, j), mass_flow in zip(self.segments, through, strict=True):
            source, target = (i, j) if mass_flow > 0.0 else (j, i)
            outflow[source] += abs(mass_flow)
            inflow[target] += abs(mass_flow)
            carried[target] += abs(mass_flow) * warmth[source]
            faster.append(part.acceleration(pressure[i], pressure[j], mass_flow))
        supplied = exergy = relieved = 0.0
        heats = [0.0, 0.0, 0.0]
        pressure_rate = []
        for i, node in enumerate(self.nodes[:-1]):
            if node.inlet:  # a reducing valve holds no air: what goes out comes from its inlet
                outflow[self.index[node.inlet]] += max(outflow[i] - inflow[i], 0.0)
        for i, node in enumerate(self.nodes[:-1]):
            net_out = outflow[i] - inflow[i]
            if node.kind == "regulator" and net_out < 0.0:
                relieved -= net_out  # to the ambient
            elif node.kind in SUPPLIES and not node.inlet:
                supplied += net_out
                exergy += self.rt * math.log(pressure[i] / gas.ambient_pressure) * net_out
            if node.kind == "constant":
                pressure_rate.append(0.0)
            elif node.kind == "regulator":
                error = set_pressure[i] - pressure[i]
                answer = math.copysign(max(abs(error) - node.dead_band, 0.0), error)
                if node.inlet:  # wide open it passes on what its inlet has
                    answer = min(answer, pressure[self.index[node.inlet]] - pressure[i])
                wanted = (answer - node.droop * net_out) / node.time_constant
                pressure_rate.append(min(max(wanted, -node.fall_limit), node.rise_limit))
            elif node.heat_transfer is not None:
                area = wall[i] or 6.0 * volume[i] ** (2.0 / 3.0)
                level = math.sqrt(pressure[i] * warmth[i] / (1e5 * gas.temperature))
                heat = node.heat_transfer * level * area * (gas.temperature - warmth[i])
                kappa = gas.heat_capacity_ratio
                capacity = kappa * gas.gas_constant / (kappa - 1.0)
                enthalpy = capacity * (carried[i] - outflow[i] * warmth[i])
                power = pressure[i] * volume_rate[i]
                heats = [s + x for s, x in zip(heats, (enthalpy, heat, power), strict=True)]
                # d(p V)/(kappa - 1) is what comes in less the work
                inner = (kappa - 1.0) * (enthalpy + heat - power)
                pressure_rate.append((inner - power) / volume[i])
            else:  # a tank is isothermal: its coefficients are one
                moved = self.rt * (node.alpha_in * inflow[i] - node.alpha_out * outflow[i])
                pressure_rate.append(
                    (moved - node.alpha * pressure[i] * volume_rate[i]) / volume[i]
                )
        stopped = [
            f + c.passive(q, v)
            for f, c, q, v in zip(force, self.coordinates, position, rate, strict=True)
        ]
        return [
            *pressure_rate,
            *rate,
            *self.body(position, rate, stopped),
            *(inflow[i] - outflow[i] for i in range(count - 1)),
            supplied, inflow[-1] - outflow[-1] + relieved, self.rt * supplied, exergy, work,
            *(f * v for f, v in zip(force, rate, strict=True)),
            *heats, *faster,
        ]  # fmt: skip

    def channels(self, states: Array) -> dict[str, Array]:
        """Channels of states (n, m): gauge pressures, positions, rates and books but the positive
        work at the joints.
        """
        pressure, position, rate, mass, books, heat, through = self.split(states)
        ambient = self.gas.ambient_pressure
        words = {
            "chamber": ("muscle_pressure", "air_mass"),
            "inlet": ("line_pressure", "line_air_mass"),
            "segment": ("segment_pressure", "segment_mass"),
        }
        out: dict[str, Array] = {}
        for i, node in enumerate(self.nodes[:-1]):
            of_pressure, of_mass = words.get(node.kind, ("supply_pressure", "supply_air_mass"))
            out[suffix(of_pressure, node.name)] = pressure[:, i] - ambient
            if node.kind in ("tank", "chamber", "inlet", "segment"):
                out[suffix(of_mass, node.name)] = mass[:, i]
        for k, (_, name, _, _) in enumerate(self.segments):
            out[f"segment_flow.{name}"] = through[:, k]
        for k, coordinate in enumerate(self.coordinates):
            if math.isnan(self.rest_length):
                out[suffix("joint_angle", coordinate.name)] = position[:, k]
                out[suffix("joint_rate", coordinate.name)] = rate[:, k]
            else:
                out["length"], out["length_rate"] = self.rest_length - position[:, k], -rate[:, k]
        if any(node.heat_transfer is not None for node in self.nodes):
            out |= {name: heat[:, k] for k, name in enumerate(HEAT_BOOKS)}
        return out | {name: books[:, k] for k, name in enumerate(BOOKS[:-1])}


def _possible(means: Transmission, positions: Iterable[float]) -> Iterable[float]:
    """Shortenings at the positions that the transmission can reach."""
    for position in positions:
        try:
            yield means.contraction(float(position))
        except ValueError:  # a tendon joint turned further than it goes
            continue


def _rhs(
    time: float, state: Array, rate: Callable[[float, Array], list[float]], left: list[str]
) -> list[float]:
    """Derivative; not a number where a trial step has left the model, so that the integrator
    shortens it.
    """
    try:
        return rate(time, state)
    except ValueError as error:
        left[:] = [str(error)]
        return [math.nan] * state.size


def _edges(
    dead_times: Iterable[float], spools: Iterable[Sequence[Piece]], k: int, sample_time: float
) -> list[float]:
    """Instants of sample k (s after it) between which late commands are constant and spools move
    smoothly, the sample's ends included.
    """
    late = {dead_time % sample_time for dead_time in dead_times}
    late |= {begin - k * sample_time for pieces in spools for begin, _, _ in pieces}
    inside = {time for time in late if 1e-9 < time / sample_time < 1.0 - 1e-9}
    return [0.0, *sorted(inside), sample_time]


def _position(pieces: Sequence[Piece], middle: float) -> float | Callable[[float], float]:
    """Position of a spool in the piece that has an instant (s)."""
    return next((at for begin, end, at in pieces if begin <= middle <= end), pieces[-1][2])


def _rate(
    rig: Network,
    at: Mapping[str, float | Callable[[float], float]],
    start: float,
    set_pressure: Sequence[float],
) -> Callable[[float, Array], list[float]]:
    """Derivative at a time after a sample began, with the spools where they are then."""
    still = {name: place for name, place in at.items() if not callable(place)}
    if len(still) == len(at):
        ways = rig.flows(still)
        return lambda _, state: rig.derivative(state, ways, set_pressure)

    def rate(time: float, state: Array) -> list[float]:
        moving = {name: place(start + time) for name, place in at.items() if callable(place)}
        return rig.derivative(state, rig.flows(still | moving), set_pressure)

    return rate


def simulate(
    model: Mapping[str, Any],
    commands: Mapping[str, ArrayLike],
    sample_time: float,
    initial: Mapping[str, float] | None = None,
    rtol: float = 1e-10,
    *,
    rows: int | None = None,
    method: Literal["DOP853", "Radau"] = "DOP853",
) -> dict[str, Array]:
    """Integrate a rig adaptively, restarting at every sample, where the commands may jump.

    Parameters
    ----------
    model : mapping
        The description that the core takes.
    commands : mapping of str to array_like (n,)
        ``valve_command[.name]`` (V) of every valve, ``supply_command[.name]`` (Pa, gauge) of any
        regulator; entry k is held from sample k to sample k + 1.
    sample_time : float
        Seconds between samples.
    initial : mapping, optional
        ``muscle_pressure``, ``supply_pressure``, ``line_pressure``, ``segment_pressure`` (Pa,
        gauge), ``segment_flow`` (kg/s), ``joint_angle``,
        ``joint_rate`` (rad, rad/s), ``length``, ``length_rate`` (m, m/s), each with ``.name`` for a
        named block.
    rtol : float
        Relative tolerance of the integrator.
    rows : int, optional
        Number of samples of a rig that takes no command.
    method : str
        ``DOP853``, or ``Radau`` for a stiff rig (small volumes behind wide lines).

    Returns
    -------
    dict of str to ndarray (n,)
        ``time``, the state channels (gauge pressures) and the books.
    """
    rig = Network(model)
    held = {name: np.asarray(values, dtype=float) for name, values in commands.items()}
    takes = {suffix("valve_command", name) for _, name, _, _ in rig.valves}
    regulators = {
        i: suffix("supply_command", node.name)
        for i, node in enumerate(rig.nodes)
        if node.kind == "regulator"
    }
    if not takes <= set(held) <= takes | set(regulators.values()):
        raise ValueError(
            f"commands are {sorted(held)}; the rig takes {sorted(takes)} and may take "
            f"{sorted(regulators.values())}"
        )
    sizes = {values.size for values in held.values()} | ({rows} if rows is not None else set())
    if len(sizes) != 1:
        raise ValueError(f"numbers of samples: {sorted(sizes)}; one is needed")
    n = sizes.pop()
    states = np.empty((n, rig.start(initial or {}).size))
    states[0] = rig.start(initial or {})
    positive = np.zeros(n)
    atol = rig.tolerances(states[0], rtol)
    first = min(1e-3, sample_time)
    spools = {
        name: pieces_of(part, held[name].tolist(), sample_time) for name, part in rig.parts.items()
    }
    for k in range(n - 1):
        state, positive[k + 1] = states[k], positive[k]
        edges = _edges(
            [rig.nodes[i].dead_time for i in regulators], spools.values(), k, sample_time
        )
        for begin, end in pairwise(edges):
            set_pressure = [node.start for node in rig.nodes]
            for i, name in regulators.items():
                late = (
                    k * sample_time + 0.5 * (begin + end) - rig.nodes[i].dead_time
                ) / sample_time
                if name in held and late >= 0.0:
                    set_pressure[i] = rig.gas.ambient_pressure + float(held[name][int(late)])
            middle = k * sample_time + 0.5 * (begin + end)
            at = {name: _position(pieces, middle) for name, pieces in spools.items()}
            rate = _rate(rig, at, k * sample_time, set_pressure)
            left: list[str] = []
            slope = partial(_rhs, rate=rate, left=left)
            settings = {
                "rtol": rtol,
                "atol": atol,
                "first_step": min(first, end - begin),
                # a valve that opens for a moment is not stepped over
                "max_step": 0.05 * sample_time if spools else np.inf,
                "dense_output": True,
            }
            solution = solve_ivp(slope, (begin, end), state, method=method, **settings)
            if not solution.success:
                raise RuntimeError(
                    f"integration failed in sample {k}: {'; '.join([solution.message, *left])}"
                )
            state = solution.y[:, -1]
            work = rig.split(solution.sol(np.linspace(begin, end, 1001)).T)[4][:, len(BOOKS) - 1 :]
            positive[k + 1] += np.maximum(np.diff(work, axis=0), 0.0).sum()
            first = min(float(np.diff(solution.t).max()), sample_time)
        states[k + 1] = state
    return {
        "time": sample_time * np.arange(n, dtype=np.float64),
        **rig.channels(states),
        BOOKS[-1]: positive,
    }
