"""The chains of a rig that a person commands, the pressures between which each is worth moving, and
commands that make pressures follow references.

A chain is a chamber with the valves that fill and vent it, or a regulator with what it fills, or
on a load frame without either a chamber whose pressure the bench sets. Commands are found on the
model by a loop over the pressures that inverts the valves, and then sent as they are, so that every
hypothesis answers to the same ones.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pamrs import _core
from pamrs._arrays import Array, Mask, stretches
from pamrs.channels import dotted
from pamrs.errors import DiagnosisError, SimulationError
from pamrs.rig import Rig
from pamrs.rig.schema import BLOCKS, qualified
from pamrs.simulation import Simulation, Simulator, has_frame, simulate, supplies_of

BANDWIDTH = 15.0  # [rad/s] bandwidth of the pressure loop by which commands are found on the model
# [s] rise of several chains' pressures to find where joints move: slow next to lags
_RAMP_TIME = 15.0


_LEAST_SHARE = 0.14
"""Least flow that a command is found for, as a share of the choked one: near equal pressures the
valve would open without bound."""


@dataclass(frozen=True)
class Range:
    """Pressures, gauge [Pa], or lengths [m] between which an experiment moves.

    Attributes
    ----------
    low, high : float
        Pressures at which the arm just moves, and at which it nears its upper stop; the shortest
        and the longest length.
    """

    low: float
    high: float

    def at(self, share: float) -> float:
        """The pressure [Pa] or length [m] at a share of the range."""
        return self.low + share * (self.high - self.low)


@dataclass(frozen=True)
class Chain:
    """Air that one or several commands move together: of one chamber, or behind one regulator, or
    at a pressure that a bench sets.

    Attributes
    ----------
    name : str
        Of its chamber or regulator; empty where the rig has one chain.
    valves : tuple of str
        Names of the valves at the chamber; none for a regulator, or a pressure that is set.
    regulator : str or None
        Name of the regulator; None for valves, or a pressure that is set.
    chamber : str
        Name of the chamber whose pressure is moved.
    moves : tuple of str
        Channels of what its muscles move: ``joint_angle.elbow``, ``length``; nothing where a frame
        moves their length.
    """

    name: str
    valves: tuple[str, ...]
    regulator: str | None
    chamber: str
    moves: tuple[str, ...]

    @property
    def commands(self) -> tuple[str, ...]:
        """Channels of the chain's commands."""
        if self.regulator is not None:
            return (dotted("supply_command", self.regulator),)
        if not self.valves:
            return (dotted("pressure_command", self.chamber),)
        return tuple(dotted("valve_command", name) for name in self.valves)

    @property
    def pressure(self) -> str:
        """Channel of the chain's pressure."""
        return dotted("muscle_pressure", self.chamber)

    @property
    def seen(self) -> tuple[str, ...]:
        """Channels that show the highest pressure reached: a chamber may not reach what its
        regulator is set to.
        """
        return (self.pressure, *(self.commands if self.regulator is not None else ()))

    def before(self, rig: Rig) -> float:
        """Pressure of the chain before the first command [Pa]."""
        if self.regulator is not None:
            return float(rig.tables("supply")[self.regulator]["initial_pressure"])
        return float(rig.tables("chamber")[self.chamber]["initial_pressure"])


def chains_of(rig: Rig) -> list[Chain]:
    """The chains that a person commands, in the order of the rig file; regulators only where there
    are no valves (in front of valves they hold what they are set to), and on a frame without either
    the chambers of its muscles, whose pressures the bench sets.
    """
    if rig.tables("valve"):
        lines = {qualified("line", n): ends["to"] for n, ends in rig.ports("line").items()}
        fed: dict[str, list[str]] = {}
        for name, ends in rig.ports("valve").items():
            end = lines.get(ends["to"], ends["to"])
            if end.partition(".")[0] == "chamber":
                fed.setdefault(end.partition(".")[2], []).append(name)
        found = [
            Chain(chamber, tuple(fed[chamber]), None, chamber, _moved(rig, {chamber}))
            for chamber in rig.tables("chamber")
            if chamber in fed
        ]
    elif has_frame(rig) and not rig.tables("supply"):
        own = [ends["chamber"].partition(".")[2] for ends in rig.ports("muscle").values()]
        found = [Chain(chamber, (), None, chamber, ()) for chamber in dict.fromkeys(own)]
    else:
        found = []
        for name in supplies_of(rig, "regulator"):
            behind = joined(rig, qualified("supply", name))
            if behind:
                found.append(Chain(name, (), name, behind[0], _moved(rig, set(behind))))
    if len(found) == 1:
        (only,) = found
        return [Chain("", only.valves, only.regulator, only.chamber, only.moves)]
    return found


def joined(rig: Rig, node: str) -> list[str]:
    """Names of the chambers that lines join to a block (``chamber.left``), the nearest first."""
    ends = [(line["from"], line["to"]) for line in rig.ports("line").values()]
    found, reached = [node], []
    for at in found:
        for a, b in ends:
            other = b if a == at else a if b == at else ""
            if other.partition(".")[0] == "chamber" and other not in found:
                found.append(other)
                reached.append(other.partition(".")[2])
    return reached


def _moved(rig: Rig, chambers: set[str]) -> tuple[str, ...]:
    """Channels that the muscles of some chambers move; none on a frame, which prescribes the
    length.
    """
    if has_frame(rig):
        return ()
    ends = [e for e in rig.ports("muscle").values() if e["chamber"].partition(".")[2] in chambers]
    if rig.tables("load"):
        return ("length",) if ends else ()
    if not rig.tables("arm"):
        return ()
    joints = dict.fromkeys(e["joint"].partition(".")[2] for e in ends)
    return tuple(dotted("joint_angle", name) for name in joints)


def is_sealed(rig: Rig) -> bool:
    """True where nobody sends a command to a rig: it has no valve, no supply and no frame."""
    return not (rig.tables("valve") or rig.tables("supply") or has_frame(rig))


def can_shut(rig: Rig, chain: Chain) -> bool:
    """True where a chain's valves can hold its air; a 3/2 valve that switches fills or vents."""
    tables = rig.tables("valve")
    closing = ("closed", "either")
    return bool(chain.valves) and all(
        tables[name]["spool"] != "switching"
        or tables[name]["with_current"] in closing
        or tables[name]["without_current"] in closing
        for name in chain.valves
    )


def driving(commands: Mapping[str, Array]) -> dict[str, Any]:
    """Commands by channel as keywords of :func:`pamrs.simulate`."""
    out: dict[str, Any] = {}
    for channel, values in commands.items():
        keyword, _, block = channel.partition(".")
        if keyword == "length":
            out[keyword] = values
        else:
            keyword = "pressure" if keyword == "pressure_command" else keyword
            out.setdefault(keyword, {})[block] = values
    return out


class _Valve:
    """Inverse of a valve: from the mass flow that is wanted in its chamber to its command."""

    def __init__(self, rig: Rig, name: str) -> None:
        gas, table = rig.tables("gas")[""], rig.tables("valve")[name]
        fed = rig.ports("valve")[name]["from"]
        kind, _, place = fed.partition(".")
        self.channel = dotted("valve_command", name)
        self.fed = dotted("supply_pressure" if kind == "supply" else "muscle_pressure", place)
        self.gas = _core.Gas(*(gas[key.name] for key in BLOCKS["gas"]))
        self.ambient = gas["ambient_pressure"]
        self.null, self.half = table["null_voltage"], table["half_range"]
        self.table = table
        if table["flow"] == "orifice":
            self.fills = self.vents = self.widest = table["discharge_area_max"]
        else:  # the loop makes good what the widest misses of the larger path
            unit = self.gas.area_of_conductance(1.0)
            self.fills = unit * table["fill_conductance"]
            self.vents = unit * table["vent_conductance"]
            self.widest = unit * max(table["fill_conductance"], table["vent_conductance"])
        self.fractions = np.asarray(table["fraction"])
        self.openings = np.asarray(table["opening"])
        self.owed = 0.0

    def _flow(self, up: float, down: float) -> float:
        """Flow per area that a command is found for [kg/(s m2)]."""
        flow, choked = self.gas.mass_flow(1.0, up, np.array([down, 0.0]))
        return float(max(flow, _LEAST_SHARE * choked))

    def answer(self, mass: float, inside: float, supply: float, dither: float) -> float:
        """The command for a mass flow [kg/s] into a chamber, between absolute pressures."""
        if self.table["spool"] == "switching":
            return self._duty(mass, inside, supply)
        if not (self.fills if mass > 0.0 else self.vents):
            return float(self.null)
        up, down = (supply, inside) if mass > 0.0 else (inside, self.ambient)
        flow = self._flow(up, down)
        opening = float(np.interp(abs(mass) / (self.widest * flow), self.fractions, self.openings))
        return float(
            np.clip(
                self.null + math.copysign(self.half * opening, mass) + dither,
                self.null - self.half,
                self.null + self.half,
            )
        )

    def _duty(self, mass: float, inside: float, supply: float) -> float:
        """Command for a duty of a switching valve, its delays made up for; without a carrier fully
        on or off, so that the mean is the duty.
        """
        of = {
            "fill": self.fills * self._flow(supply, inside),
            "vent": -self.vents * self._flow(inside, self.ambient),
            "closed": 0.0,
        }
        on, off = self.table["with_current"], of[self.table["without_current"]]
        side = 1.0
        if on == "either":
            side = math.copysign(1.0, mass)
            on = "fill" if mass > 0.0 else "vent"
        span = of[on] - off
        duty = float(np.clip((mass - off) / span, 0.0, 1.0)) if span else 0.0
        carrier = self.table["carrier_frequency"]
        if carrier > 0.0:
            late = self.table["opening_delay"] - self.table["closing_delay"]
            if 0.0 < duty < 1.0:
                duty = float(np.clip(duty + late * carrier, 0.0, 1.0))
        else:
            self.owed += duty
            duty = 1.0 if self.owed >= 0.5 else 0.0
            self.owed -= duty
        return float(self.null + side * self.half * duty)


def _valve_commands(
    rig: Rig,
    references: Mapping[str, Array],
    *,
    sample_time: float,
    bandwidth: float = BANDWIDTH,
    shut: Mapping[str, Mask] | None = None,
    dither: Array | None = None,
    initial: Mapping[str, float] | None = None,
    length: Array | None = None,
) -> dict[str, Array]:
    """Valve commands [V] by channel that make pressures follow references, as of
    :func:`commands_for`.
    """
    chains = [chain for chain in chains_of(rig) if chain.name in references]
    n = next(iter(references.values())).size
    gas = rig.tables("gas")[""]
    ambient, warm = gas["ambient_pressure"], gas["gas_constant"] * gas["temperature"]
    valves = {c.name: [_Valve(rig, name) for name in c.valves] for c in chains}
    slopes = {name: np.gradient(values, sample_time) for name, values in references.items()}
    every = max(1, round(0.01 / sample_time))

    def update(sample: Mapping[str, float]) -> dict[str, Any]:
        k = min(n - 1, round(sample["time"] / sample_time))
        volts: dict[str, float] = {}
        for chain in chains:
            own = valves[chain.name]
            closed = shut is not None and bool(shut[chain.name][k])
            pressure, wanted = sample[chain.pressure], references[chain.name][k]
            rate = bandwidth * (wanted - pressure) + slopes[chain.name][k]
            mass = rate * sample[dotted("air_volume", chain.chamber)] / warm
            for name, valve in zip(chain.valves, own, strict=True):
                if closed and valve.table["spool"] != "switching":
                    volts[name] = float(valve.null)
                    continue
                flow = 0.0 if closed else mass
                supply = sample[valve.fed] + ambient
                shaken = 0.0 if dither is None else float(dither[k])
                volts[name] = valve.answer(flow, pressure + ambient, supply, shaken)
        if length is None:
            return {"valve_command": volts}
        return {"valve_command": volts, "length": float(length[min(n - 1, k + every)])}

    start = dict(initial or {}) if length is None else {**(initial or {}), "length": length[0]}
    simulator = Simulator(rig, sample_time=sample_time, initial=start or None)
    total = (n - 1 + every - 1) // every * every
    found = simulator.control(update, total * sample_time, period=every * sample_time)
    channels = [channel for chain in chains for channel in chain.commands]
    return {channel: np.ascontiguousarray(found[channel][:n]) for channel in channels}


def commands_for(
    rig: Rig, references: Mapping[str, Array], *, length: Array | None = None, **options: Any
) -> dict[str, Array]:
    """Commands with which the pressures of a rig's chains follow references.

    Parameters
    ----------
    rig : Rig
        A rig with chains.
    references : mapping of str to (n,) array
        Gauge pressure [Pa] by the name of each chain.
    length : (n,) array, optional
        What its load frame prescribes [m]; needed where there is one.
    **options
        ``sample_time`` [s]; of valves ``bandwidth`` of the loops by which their commands are found
        [rad/s], ``shut`` (by chain (n,) bool: samples at which its valves are shut: the null
        voltage, or no flow of a valve that switches), ``dither`` ((n,) array added to every command
        [V]) and ``initial`` (as for :func:`pamrs.simulate`).

    Returns
    -------
    dict of str to (n,) array
        By channel: commands of valves [V], pressures that are set [Pa, gauge], the length [m].
    """
    chains = [chain for chain in chains_of(rig) if chain.name in references]
    if chains[0].valves:
        sent = _valve_commands(rig, references, length=length, **options)
    else:
        sent = {chain.commands[0]: references[chain.name] for chain in chains}
    return sent if length is None else {**sent, "length": length}


def _source(rig: Rig, chain: Chain) -> float:
    """Highest pressure that the supply of a chain can give [Pa, gauge]: its initial one, at most
    that of its inlet; the chamber's own where it has no supply.
    """
    ways = [*rig.ports("valve").values(), *rig.ports("line").values()]
    found = [qualified("chamber", chain.chamber)]
    for at in found:
        for way in ways:
            if way["to"] == at and way["from"] and way["from"] not in found:
                found.append(way["from"])
        inlets = [qualified("line", n) for n, e in rig.ports("line").items() if e["to"] == at]
        found += [inlet for inlet in inlets if inlet not in found]
    tables = rig.tables("supply")
    names = [node.partition(".")[2] for node in found if node.partition(".")[0] == "supply"]
    fronts = _inlets(rig)
    pressures = [
        min(float(tables[name]["initial_pressure"]), fronts.get(name, math.inf)) for name in names
    ]
    return max(pressures, default=chain.before(rig))


def _inlets(rig: Rig) -> dict[str, float]:
    """Initial pressure of the supply before each regulator that has one [Pa, gauge]."""
    tables = rig.tables("supply")
    return {
        name: float(tables[ports["inlet"].partition(".")[2]]["initial_pressure"])
        for name, ports in rig.ports("supply").items()
        if "inlet" in ports
    }


def _most(
    rig: Rig, chain: Chain | None, highest: float | Mapping[str, float] | None
) -> list[float]:
    """Upper bounds of a chain's pressure [Pa, gauge]: the given one, that of ``[limits]``."""
    if isinstance(highest, Mapping):
        highest = highest.get("" if chain is None else chain.name)
    said = [p for p in (highest, rig.limits.get("max_pressure")) if p is not None]
    return [float(p) for p in said]


def top_of(rig: Rig, chain: Chain, highest: float | Mapping[str, float] | None) -> float:
    """Highest pressure that a chain is moved to [Pa, gauge].

    Parameters
    ----------
    rig : Rig
        The rig.
    chain : Chain
        One of its chains.
    highest : float or mapping of str to float or None
        Gauge pressure that is not to be exceeded [Pa], of several chains by their names.

    Raises
    ------
    DiagnosisError
        If nothing says how high a pressure that is set may go.
    """
    said = _most(rig, chain, highest)
    if not said and not chain.valves:
        muscles, own = rig.ports("muscle"), qualified("chamber", chain.chamber)
        said = [  # the highest pressures of force maps
            float(table["map_pressure"][-1])
            for name, table in rig.tables("muscle").items()
            if table["model"] == "map" and muscles[name]["chamber"] == own
        ]
    if chain.valves:
        return min(0.8 * _source(rig, chain), *said, math.inf)
    if not said:
        fed = "fed by a regulator" if chain.regulator is not None else "set to its pressure"
        raise DiagnosisError(
            f"rig {rig.name!r} is {fed}, and nothing says how high its pressure may "
            "go: [limits] max_pressure of the rig file, or a recording of the pressure, is needed"
        )
    if chain.regulator is None:
        return min(said)
    inlet = _inlets(rig).get(chain.regulator, math.inf)
    return min(*said, 0.8 * inlet)  # a tank falls while it is drawn from


def pressure_range(rig: Rig, *, highest: float | Mapping[str, float] | None = None) -> Range:
    """Pressures between which a rig of one chain is worth exciting.

    Parameters
    ----------
    rig : Rig
        A rig of one chain, or a sealed chamber.
    highest : float or mapping, optional
        Gauge pressure that is not to be exceeded [Pa], for example the highest that was recorded.

    Returns
    -------
    Range
        With an arm or a load, from where it has moved by a twentieth of its range to nine tenths of
        it; without one, from a tenth to six tenths of the supply's pressure. Never above what the
        rig file says that the bench allows.

    Raises
    ------
    DiagnosisError
        If nothing says how high the set pressure of a regulator may go, the rig has several chains,
        or its model does not hold while its pressure rises.
    """
    if is_sealed(rig):
        said = _most(rig, None, highest)
        top = min(said, default=7.0e5)
        if highest is None:
            top = min(7.0e5, top)
        return Range(0.35 * top, top)
    chains = chains_of(rig)
    if len(chains) != 1:
        there = f"the chains {', '.join(c.name for c in chains)}" if chains else "no chain"
        raise DiagnosisError(
            f"rig {rig.name!r} has {there}; the pressures of a rig of one chain were asked for"
        )
    (chain,) = chains
    top = top_of(rig, chain, highest)
    if not chain.moves:
        return Range(0.1 * top, min(0.75 * top, 7.0e5))
    ramp = np.linspace(0.0, top, 1501)
    found = _played(rig, {"": ramp})
    share = _share(rig, chain.moves[0], found)
    pressure = np.maximum.accumulate(found[chain.pressure])
    low = float(pressure[np.argmax(share > 0.05)]) if (share > 0.05).any() else 0.2 * top
    high = float(pressure[np.argmax(share > 0.85)]) if (share > 0.85).any() else top
    high = min(max(high, 1.2 * low), top)
    return Range(low, high) if high > low else Range(0.3 * top, top)


def _played(rig: Rig, references: Mapping[str, Array]) -> Simulation:
    """Simulation of a rig at 100 Hz whose chains follow pressures."""
    try:
        commands = commands_for(rig, references, sample_time=0.01)
        return simulate(rig, sample_time=0.01, **driving(commands))
    except SimulationError as error:
        raise DiagnosisError(
            f"rig {rig.name!r}: its model does not hold while its pressures rise, by which those "
            f"of experiments are found: {error}"
        ) from error


def _share(rig: Rig, channel: str, found: Simulation) -> Array:
    """Position of a joint, rest (0) to upper stop (1), or of a load, longest to shortest."""
    if channel == "length":
        return np.asarray(
            (found["length"][0] - found["length"])
            / (found["length"][0] - rig.tables("load")[""]["min_length"])
        )
    joint = rig.tables("joint")[channel.partition(".")[2]]
    return np.asarray(
        (found[channel] - joint["rest_angle"]) / (joint["max_angle"] - joint["rest_angle"])
    )


@dataclass(frozen=True)
class Spans:
    """Pressures between which the chains of a rig are worth moving, by their names.

    Attributes
    ----------
    held : dict of str to float
        At which a chain is held while others move [Pa, gauge].
    alone : dict of str to Range
        Of a chain while all others are held.
    """

    held: dict[str, float]
    alone: dict[str, Range]


def spans_of(rig: Rig, *, highest: float | Mapping[str, float] | None = None) -> Spans:
    """Pressures of a rig of several chains: all rise together, which says at which each is held;
    then each rises alone.

    Parameters
    ----------
    rig : Rig
        A rig of several chains.
    highest : float or mapping of str to float, optional
        Gauge pressures, by chain or of all, that are not to be exceeded [Pa].

    Raises
    ------
    DiagnosisError
        If nothing says how high the set pressure of a regulator may go, or the model does not hold
        while the pressures rise.
    """
    chains = chains_of(rig)
    tops = {chain.name: top_of(rig, chain, highest) for chain in chains}
    time = np.asarray(np.arange(round(_RAMP_TIME / 0.01) + 1) * 0.01, dtype=np.float64)
    # vented muscles may push like struts: nobody goes below a tenth
    rising: dict[str, Array] = {
        name: top * (0.1 + 0.9 * time / _RAMP_TIME) for name, top in tops.items()
    }
    found = _played(rig, rising)
    held = {c.name: _free(rig, c, chains, found, tops[c.name]).at(0.5) for c in chains}
    alone = {}
    for chain in chains:
        still: dict[str, Array] = {
            c.name: np.interp(time, [0.0, 2.0], [c.before(rig), held[c.name]]) for c in chains
        }
        moving = np.interp(
            time,
            [0.0, 2.0, _RAMP_TIME],
            [chain.before(rig), 0.1 * tops[chain.name], tops[chain.name]],
        )
        found = _played(rig, {**still, chain.name: moving})
        alone[chain.name] = _free(rig, chain, [chain], found, tops[chain.name], first=200)
    return Spans(held, alone)


def _free(
    rig: Rig, chain: Chain, chains: Sequence[Chain], found: Simulation, top: float, first: int = 0
) -> Range:
    """Pressures of a rising chain at which no joint or load that it moves is at a stop; a usual
    range where there are none.
    """
    moved = dict.fromkeys(m for c in chains for m in c.moves if set(c.moves) & set(chain.moves))
    free = np.ones(found.time.size, dtype=bool)
    for channel in moved:
        low, high = _stops(rig, channel)
        share = (found[channel] - low) / (high - low)
        free &= (share > 0.05) & (share < 0.88)
    free[:first] = False
    pressure = found[chain.pressure]
    if not chain.moves or not free.any():
        return Range(0.1 * top, min(0.75 * top, 7.0e5) if not chain.moves else top)
    # the longest stretch: on its way up a joint may pass a place twice
    a, b = max(stretches(free), key=lambda ab: ab[1] - ab[0])
    low, high = float(pressure[a]), min(float(pressure[b - 1]), top)
    return Range(low, high) if high > 1.2 * low else Range(0.3 * top, top)


def _stops(rig: Rig, channel: str) -> tuple[float, float]:
    """Ends of what a joint or a load can do, the one at rest first."""
    if channel == "length":
        load = rig.tables("load")[""]
        return load["max_length"], load["min_length"]
    joint = rig.tables("joint")[channel.partition(".")[2]]
    return joint["min_angle"], joint["max_angle"]
