"""Blocks of a rig between measured channels, and recordings at the rate that they need."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pamrs._arrays import Array, Mask
from pamrs.channels import DRIVEN_COMMANDS, block_of, channel_of, dotted
from pamrs.diagnosis.prepare._signals import (
    flows_of,
    held,
    pulls_of,
    thermometers_of,
)
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import CLOSURE_OF
from pamrs.errors import DiagnosisError
from pamrs.recordings import Recording
from pamrs.rig import Rig
from pamrs.rig.schema import keys_of, qualified

# [s] a joint's windows: its start has faded, a wrong break-away spoils no more (decision 14)
ARM_WINDOW = 2.5
# [s] the same where nothing is named on these: less than the period of an arm (decision 14)
OFTEN_WINDOW = 0.3
SUPPLY_WINDOW = 4.0  # [s] windows of a tank or a regulator
_CHAMBER_WINDOW = 2.0  # [s] windows of a chamber that is fed; a sealed one is one window
_LEAST_PRESSURE_SHARE = 0.01  # share of the ambient pressure that a noisy gauge shows at the least
# [s] longest step of joints and loads: an error of 0.03 noises, 0.17 at most (decision 57)
_ARM_STEP = 5e-3
# [s] the same of tanks and chambers, divided until stable: 0.003 noises (decision 57)
_GAS_STEP = 1e-2
# [s] the same of a sealed chamber: an error below the noise (docs/convergence.md)
_SEALED_STEP = 0.025


class Tube(NamedTuple):
    """A tube of segments, whose states nobody measures.

    Attributes
    ----------
    name : str
        Dotted name of the line.
    beginning, end : str
        Channels of the pressures at its ends ``from`` and ``to``, of which its gas begins at the
        latter; empty where a valve feeds it or it leads to the ambient.
    delay : float
        Time that sound takes along it [s].
    """

    name: str
    beginning: str
    end: str
    delay: float


class Input(NamedTuple):
    """An input of a block that nobody measured, piecewise linear in time.

    Attributes
    ----------
    spacing : int
        Samples from one knot to the next, from the beginning of each window.
    heights : (k,) array
        Its value at the knots of all windows, one after the other [N m, N or kg/s]; empty for zero.
    """

    spacing: int
    heights: Array

    def knots(self, samples: int) -> int:
        """Knots of a window of so many samples."""
        return -(-samples // self.spacing) + 1


class WarmGas(NamedTuple):
    """A gas with a temperature that nobody measured.

    Attributes
    ----------
    channel : str
        Of that temperature.
    room, ambient : float
        Temperature [K] and pressure [Pa] of the room.
    exponent : float
        ``1 - 1/kappa``: an adiabatic change of pressure by a factor r changes the temperature by
        ``r**exponent``.
    highest : float
        Pressure that the chamber bears [Pa, gauge]; 0 where the rig file does not say.
    """

    channel: str
    room: float
    ambient: float
    exponent: float
    highest: float

    def range_at(self, pressure: float, seen: float) -> tuple[float, float]:
        """The coldest and warmest temperature that the gas can have [K]: expanded from the highest
        pressure at once, or compressed from the ambient one.

        ``pressure`` is where it is and ``seen`` the highest of the recording [Pa, gauge]; of a
        chamber whose limit is not stated, twice that one counts.
        """
        now = max(self.ambient + pressure, _LEAST_PRESSURE_SHARE * self.ambient)
        bears = max(self.highest, seen) if self.highest else 2.0 * seen + self.ambient
        ratios = (now / (self.ambient + max(bears, pressure)), now / self.ambient, 1.0)
        return self.room * min(ratios) ** self.exponent, self.room * max(ratios) ** self.exponent


@dataclass(frozen=True)
class Block:
    """A stretch of the chain with a measured output.

    Attributes
    ----------
    name, channel : str
        Name of the block as the core has it (``chamber``, ``chamber.flexor``, ``arm.elbow``) and of
        the channel that it predicts.
    drives : tuple of str
        Measured channels that drive it.
    window : float or None
        Length of its windows [s]; None: the whole recording at once.
    parameters : frozenset of str
        Dotted names of baseline parameters that its output depends on.
    step : float
        Longest integration step [s].
    covers : str
        Blocks of the rig that it stands for, in words.
    simulated : tuple of str
        Kinds of block that it simulates as well, since nobody measured them: a regulator whose
        outlet has no gauge.
    tubes : tuple of Tube
        Tubes of segments that begin or end at it.
    thermometer : str
        Channel of the temperature at which its gas begins, where that is measured.
    warm : WarmGas or None
        The gas that it predicts, where that has a temperature and no thermometer.
    floating : tuple of str
        Drives that were simulated, since nobody measured them (a tank's pressure); their level and
        how far they fall are free in each recording.
    anchor : float or None
        Time after which the pressures that drive it are taken anew inside a window [s]; None:
        never.
    """

    name: str
    channel: str
    drives: tuple[str, ...]
    window: float | None
    parameters: frozenset[str]
    step: float
    covers: str
    simulated: tuple[str, ...] = ()
    tubes: tuple[Tube, ...] = ()
    thermometer: str = ""
    anchor: float | None = None
    warm: WarmGas | None = None
    floating: tuple[str, ...] = ()

    @property
    def kind(self) -> str:
        """``supply``, ``chamber`` (the inlet of a line too), ``flow`` (into a chamber),
        ``temperature`` (of a chamber's gas), ``arm`` (of a hanging load too) or ``pull`` (what the
        muscles put on a joint or a load): its name without that of the tank, chamber or joint.
        """
        kind = channel_of(self.name)
        alike = {"line": "chamber", "load": "arm", "force": "pull", "torque": "pull"}
        return alike.get(kind, kind)

    @property
    def closure(self) -> str | None:
        """Id of the closure, a sum of terms that can stand for what is missing in it; None where
        the simulator has none: at a load, a force, a flow, a temperature and in front of a line.
        """
        named = channel_of(self.name)
        return None if named in ("load", "line") else CLOSURE_OF.get(self.kind)

    @property
    def mechanical(self) -> bool:
        """True where muscles and what they move make its output, and not air alone."""
        return self.kind in ("arm", "pull")


@dataclass(frozen=True)
class Unjudged:
    """Block of a rig that the channels do not distinguish from the others.

    Attributes
    ----------
    name, covers : str
        As of a :class:`Block`.
    why : str
        Why it is not judged, in words.
    """

    name: str
    covers: str
    why: str


def _not_recorded(names: Iterable[str]) -> str:
    """Reason why a block is not judged: it needs channels that not every recording has."""
    named = list(dict.fromkeys(names))
    few = len(named) == 1
    return f"{', '.join(named)} {'is' if few else 'are'} not in every recording"


_GAUGE_OF = {
    "supply": "supply_pressure",
    "line": "line_pressure",
    "chamber": "muscle_pressure",
}
"""Channel of what a gauge at a block reads."""


@dataclass(frozen=True)
class _FlowPath:
    """A valve or a line: its own full name, what it leads from and to (chambers, supplies and
    inlets of lines with a gauge, in full), the command that opens it, the line behind it.
    """

    name: str
    ends: tuple[str, str]
    command: tuple[str, ...]
    between: tuple[str, ...]


def _flow_paths(rig: Rig, has: frozenset[str]) -> list[_FlowPath]:
    """All flow paths of the air; a valve and the line behind it are one, unless a gauge is between
    them.
    """
    valves, lines = rig.ports("valve"), rig.ports("line")
    cut = {n: not e["from"] and dotted("line_pressure", n) in has for n, e in lines.items()}
    behind = {qualified("line", n): ends["to"] for n, ends in lines.items() if not cut[n]}
    paths = []
    for name, ends in valves.items():
        line = (ends["to"],) if ends["to"] in behind else ()
        end = behind.get(ends["to"], ends["to"])
        paths.append(
            _FlowPath(
                qualified("valve", name),
                (ends["from"], end),
                (dotted("valve_command", name),),
                line,
            )
        )
    paths += [
        _FlowPath(
            qualified("line", name), (ends["from"] or qualified("line", name), ends["to"]), (), ()
        )
        for name, ends in lines.items()
        if ends["from"] or cut[name]
    ]
    return paths


class _BlockMap:
    """Channels and parameters that belong to each block of a rig."""

    def __init__(self, rig: Rig, channels: tuple[str, ...]) -> None:
        self.rig, self.has = rig, frozenset(channels)
        self.thermometers = {n: c for n, c in thermometers_of(rig).items() if c in self.has}
        self.paths = _flow_paths(rig, self.has)
        self.angles = (
            ("length",)
            if rig.model["load"]
            else tuple(dotted("joint_angle", name) for name in rig.tables("joint"))
        )
        self.pulling = {
            name: block_of(ends["chamber"]) for name, ends in rig.ports("muscle").items()
        }
        self.joint_of = {
            name: block_of(ends["joint"]) for name, ends in rig.ports("muscle").items()
        }
        self.behind_gauges = [
            full
            for full in (qualified("chamber", name) for name in rig.tables("chamber"))
            if self.pressure(full) not in self.has and self._only_lines_to_gauges(full)
        ]

    def _only_lines_to_gauges(self, chamber: str) -> bool:
        """True of a chamber that lines without segments alone join to measured pressures."""
        ends = self.ends(chamber)
        return (
            bool(ends)
            and not self.commands(chamber)
            and not self.tubes_at(chamber)
            and all(self.pressure(end) in self.has for end in ends)
        )

    def judged(self, block: Block, *nodes: str) -> Block | Unjudged:
        """A block with what drives some nodes of its air and what they depend on, and with the
        regulators and chambers without a gauge next to them, which it simulates too; not judged
        where a channel is missing. Of the chambers of muscles only those without a gauge count.
        """
        nodes = tuple(n for n in nodes if not block.mechanical or n in self.behind_gauges)
        ends = [end for node in nodes for end in (node, *self.ends(node))]
        hidden = [chamber for chamber in self.behind_gauges if chamber in ends]
        air = dict.fromkeys((*nodes, *hidden))
        regulators = dict.fromkeys(one for node in air for one in self.without_gauge(node))
        joints = [
            self.joint_of[muscle]
            for muscle, name in self.pulling.items()
            if block.kind != "arm" and qualified("chamber", name) in (block.name, *hidden)
        ]
        needed = (
            *block.drives,
            *(channel for node in air for channel in self.neighbours(node)),
            *(command for node in air for command in self.commands(node)),
            *(dotted("supply_command", one) for one in regulators),
            *(channel for one in regulators for channel in self.in_front(one)),
            *(angle for angle in self.angles if block_of(angle) in joints),
        )
        simulated = (block.channel, *(self.pressure(chamber) for chamber in hidden))
        drives = tuple(name for name in dict.fromkeys(needed) if name not in simulated)
        missing = [n for n in (block.channel, *drives, *self.angles) if n not in self.has]
        if missing:
            return Unjudged(block.name, block.covers, _not_recorded(missing))
        names = (
            block.parameters
            | self.moved("supply", *regulators)
            | self.moved("chamber", *map(block_of, hidden))
        )
        for node in air:
            paths = [name for path in self.around(node) for name in (path.name, *path.between)]
            of_paths = {n for name in paths for n in self.moved(channel_of(name), block_of(name))}
            names |= of_paths | self.zeros(self.nodes_at(node), joints)
        return replace(
            block,
            drives=drives,
            parameters=frozenset(names),
            covers=block.covers + (", with line and chamber" if hidden else ""),
            simulated=(*(["chamber"] if hidden else []), *(["supply"] if regulators else [])),
        )

    def pressure(self, block: str) -> str:
        """Channel of the pressure of a supply, a chamber or a line's inlet by its full name."""
        kind, _, name = block.partition(".")
        return dotted(_GAUGE_OF[kind], name)

    def around(self, block: str) -> list[_FlowPath]:
        """The flow paths that begin or end at a supply, a chamber or a line's inlet."""
        return [path for path in self.paths if block in path.ends]

    def ends(self, block: str) -> list[str]:
        """Full names of what the flow paths at a block lead to, but for the ambient."""
        ends = dict.fromkeys(end for path in self.around(block) for end in path.ends)
        return [end for end in ends if end not in (block, "ambient")]

    def neighbours(self, block: str) -> tuple[str, ...]:
        """Channels of the pressures next to a block; that of a constant supply is known without
        measuring it, those of regulators and chambers without a gauge are simulated.
        """
        return tuple(
            self.pressure(end)
            for end in self.ends(block)
            if end not in self.behind_gauges and not self._lacks_gauge(end, "constant", "regulator")
        )

    def _lacks_gauge(self, block: str, *kinds: str) -> bool:
        """True where a block is a supply of one of these kinds whose pressure nobody measured."""
        block_kind, _, name = block.partition(".")
        return (
            block_kind == "supply"
            and self.rig.tables("supply")[name]["kind"] in kinds
            and self.pressure(block) not in self.has
        )

    def without_gauge(self, block: str) -> list[str]:
        """Names of the regulators at a block whose outlet nobody measured, itself or next to it:
        their command says what it is.
        """
        return [
            block_of(end)
            for end in (block, *self.ends(block))
            if self._lacks_gauge(end, "regulator")
        ]

    def behind(self, supply: str) -> list[str]:
        """Names of the regulators whose inlet a supply is: what they let through is drawn from
        it.
        """
        ends = self.rig.ports("supply").items()
        return [name for name, ports in ends if ports.get("inlet") == supply]

    def in_front(self, regulator: str) -> tuple[str, ...]:
        """Channel of the pressure in front of a regulator, where it was measured."""
        inlet = self.rig.ports("supply")[regulator].get("inlet", "")
        channel = self.pressure(inlet) if inlet else ""
        return (channel,) if channel in self.has else ()

    def commands(self, block: str) -> tuple[str, ...]:
        """Commands of the valves at a block."""
        return tuple(
            dict.fromkeys(command for path in self.around(block) for command in path.command)
        )

    def moved(self, block: str, *names: str) -> set[str]:
        """Parameters of some blocks that can have a derivative, but for zeros of gauges."""
        tables = self.rig.tables(block)
        return {
            f"{qualified(block, name)}.{key.name}"
            for name in names
            for key in keys_of(block, tables[name])
            if key.moves and not key.name.endswith("_zero")
        }

    def zero(self, key: str, name: str) -> str:
        """Dotted name of the zero of a block's sensor, its own or the common one."""
        sensors = self.rig.tables("sensors")
        return f"sensors.{name}.{key}" if name and name in sensors else f"sensors.{key}"

    def zeros(self, nodes: Iterable[str], joints: Iterable[str]) -> set[str]:
        """Zeros of the gauges at chambers, supplies and inlets of lines, given by their full names,
        and of the sensors of some joints.
        """
        moving = (
            {"sensors.length_zero"}
            if self.rig.model["load"]
            else {self.zero("angle_zero", j) for j in joints}
        )
        read = [node.partition(".") for node in nodes if self.pressure(node) in self.has]
        return moving | {
            self.zero("pressure_zero", name)
            if kind == "chamber"
            else f"{qualified(kind, name)}.pressure_zero"
            for kind, _, name in read
        }

    def of(self, kind: str, *names: str) -> set[str]:
        """All parameters of some blocks of a kind."""
        prefixes = tuple(f"{qualified(kind, name)}." for name in names)
        return {name for name in self.rig.parameters if name.startswith(prefixes)}

    def of_motion(self, joints: Iterable[str]) -> set[str]:
        """Parameters of what turns the lengths of muscles into the angles of some joints."""
        named = set(joints)
        pulling = [m for m, joint in self.joint_of.items() if joint in named]
        return self.of("joint", *named) | self.of("transmission", *pulling)

    def tubes_at(self, block: str) -> tuple[Tube, ...]:
        """The tubes of segments among the flow paths at a block."""
        gas = self.rig.tables("gas")[""]
        ends, tubes = self.rig.ports("line"), []
        full = (name for path in self.around(block) for name in (path.name, *path.between))
        for name in dict.fromkeys(full):
            kind, _, place = name.partition(".")
            table = self.rig.tables(kind)[place]
            if kind != "line" or not table.get("segments"):
                continue
            sound = math.sqrt(table["alpha"] * gas["gas_constant"] * gas["temperature"])
            beginning, end = (
                self.pressure(node) if node not in ("", "ambient") else ""
                for node in (ends[place]["from"], ends[place]["to"])
            )
            tubes.append(Tube(name, beginning, end, table["length"] / sound))
        return tuple(tubes)

    def nodes_at(self, block: str) -> set[str]:
        """Chambers, supplies and inlets of lines at which a block is cut, by their full names:
        itself, where its flow paths lead, and what feeds a regulator that it simulates.
        """
        ends = {block, *self.ends(block)}
        simulated = [e for e in ends if e == block or self._lacks_gauge(e, "regulator")]
        supplies = self.rig.ports("supply")
        inlets = [
            supplies.get(block_of(e), {}).get("inlet", "")
            for e in simulated
            if channel_of(e) == "supply"
        ]
        return ends | {inlet for inlet in inlets if inlet}

    def supply(self, name: str) -> Block | Unjudged | None:
        """The block of one supply; none where its pressure is what the rig file says, what was
        recorded whatever gives it, or simulated with what it feeds.
        """
        full, table = qualified("supply", name), self.rig.tables("supply")[name]
        behind = self.behind(full)
        itself = [name] if table["kind"] == "regulator" else []
        nodes = (full, *(qualified("supply", one) for one in behind))
        drives = (
            *(self.pressure(node) for node in nodes[1:] if self.pressure(node) in self.has),
            *(channel for one in itself for channel in self.in_front(one)),
            *(dotted("supply_command", one) for one in itself),
        )
        covers = "regulator" if table["kind"] == "regulator" else "supply"
        covers += (
            " and regulator"
            if behind
            else " and valve"
            if self.commands(full)
            else (" and line" if table["kind"] != "regulator" else "")
        )
        covers += _called(name)
        known = table["kind"] == "measured" or self._lacks_gauge(full, "constant", "regulator")
        if known or not any(self.around(node) for node in nodes):
            return None
        if any(not path.command for node in nodes[1:] for path in self.around(node)):
            # noise of two gauges at a line goes both ways, and is drawn one way
            why = "a regulator that it feeds has a line behind it, and no valve"
            return Unjudged(full, covers, why)
        block = Block(
            full,
            self.pressure(full),
            drives,
            SUPPLY_WINDOW,
            frozenset(self.moved("supply", name)),
            _GAS_STEP,
            covers,
            tubes=self.tubes_at(full),
        )
        return self.judged(block, *nodes)

    def chamber(self, name: str) -> Block | Unjudged | None:
        """The block of one chamber; none where it is simulated from a gauge on, not judged where
        nothing feeds it although it moves a joint: its pressure is then what is given.
        """
        full = qualified("chamber", name)
        if full in self.behind_gauges:
            return None
        without_gauge = self.without_gauge(full)
        fed = bool(self.neighbours(full) or self.commands(full) or without_gauge)
        covers = (
            ("valve, line and chamber" if self.commands(full) else "line and chamber")
            if fed
            else "chamber"
        )
        covers = (f"regulator, {covers}" if without_gauge else covers) + _called(name)
        if self.angles and not self.rig.tables("valve") and not self.rig.tables("supply"):
            return Unjudged(
                full, covers, "nothing feeds it: its pressure is what drives the muscle"
            )
        block = Block(
            full,
            self.pressure(full),
            (),
            _CHAMBER_WINDOW if fed else None,
            frozenset(self.moved("chamber", name)),
            _GAS_STEP if fed else _SEALED_STEP,
            covers,
            tubes=self.tubes_at(full),
            thermometer=self.thermometers.get(name, ""),
            warm=self.warm(name),
        )
        return self.judged(block, full)

    def warm(self, name: str) -> WarmGas | None:
        """A chamber's gas where it has a balance of energy and no thermometer."""
        if name in self.thermometers or self.rig.tables("chamber")[name]["gas"] != "energy_balance":
            return None
        gas = self.rig.tables("gas")[""]
        return WarmGas(
            dotted("temperature", name),
            float(gas["temperature"]),
            float(gas["ambient_pressure"]),
            1.0 - 1.0 / float(gas["heat_capacity_ratio"]),
            float(self.rig.limits.get("max_pressure", 0.0)),
        )

    def temperature(self, chamber: Block | Unjudged | None) -> Block | None:
        """The block of a gas whose temperature is measured: that of its pressure, read off by the
        thermometer. The pressure is taken anew as often as its own windows begin, so that it does
        not drift; the temperature goes on.
        """
        if not isinstance(chamber, Block) or not chamber.thermometer:
            return None
        name = block_of(chamber.name)
        return replace(
            chamber,
            name=dotted("temperature", name),
            channel=chamber.thermometer,
            drives=(*chamber.drives, chamber.channel),
            window=None,
            covers="gas" + _called(name),
            simulated=("chamber", *chamber.simulated),
            anchor=chamber.window,
        )

    def flow(self, name: str) -> Block | Unjudged | None:
        """The block of what flows into a chamber, where that is measured: the pressures around it
        and the commands to a flow.
        """
        full = qualified("chamber", name)
        if self.pressure(full) not in self.has or self.tubes_at(full):
            return None
        block = Block(
            dotted("flow", name),
            flows_of(self.rig)[name],
            (self.pressure(full),),
            None,  # nothing is integrated that could drift
            frozenset(),
            _GAS_STEP,
            ("valve" if self.commands(full) else "line") + _called(name),
        )
        return self.judged(block, full)

    def inlet(self, name: str) -> Block | Unjudged | None:
        """The block of a valve alone: what it feeds into a line at whose inlet there is a gauge."""
        full = qualified("line", name)
        if self.pressure(full) not in self.has or not self.commands(full):
            return None
        feeding = "regulator and valve" if self.without_gauge(full) else "valve and line inlet"
        block = Block(
            full,
            self.pressure(full),
            (),
            _CHAMBER_WINDOW,
            frozenset(),
            _GAS_STEP,
            feeding + _called(name),
            tubes=self.tubes_at(full),
        )
        return self.judged(block, full)

    def arm(self, joint: str) -> Block | Unjudged:
        """The block of one joint: muscles' pressures to its angle."""
        joints, links = self.rig.tables("joint"), self.rig.tables("link")
        names = self.of("arm", "") | self.of("link", *links) | self.of("muscle", *self.pulling)
        chambers = self.chambers_of(self.pulling)
        block = Block(
            qualified("arm", joint),
            dotted("joint_angle", joint),
            tuple(map(self.pressure, chambers)),
            ARM_WINDOW,
            frozenset(names | self.of_motion(joints) | self.zeros(chambers, joints)),
            _ARM_STEP,
            "muscle, joint and arm" + _called(joint),
        )
        return self.judged(block, *chambers)

    def load(self) -> Block | Unjudged:
        """The block of a hanging load: muscles' pressures to their length."""
        chambers = self.chambers_of(self.pulling)
        block = Block(
            "load",
            "length",
            tuple(map(self.pressure, chambers)),
            ARM_WINDOW,
            frozenset(
                self.of("load", "") | self.of("muscle", *self.pulling) | self.zeros(chambers, ())
            ),
            _ARM_STEP,
            "muscle and load",
        )
        return self.judged(block, *chambers)

    def pull(self, joint: str) -> Block | Unjudged | None:
        """The block of what the muscles put on a joint or a load, where that is measured: their
        pressures and the motion to a torque or a force.
        """
        loaded = bool(self.rig.model["load"])
        pulling = [m for m in self.pulling if loaded or self.joint_of[m] == joint]
        if not pulling:
            return None
        names = {"sensors.force_gain"} if loaded else self.of_motion([joint])
        chambers = self.chambers_of(pulling)
        block = Block(
            "force" if loaded else qualified("torque", joint),
            pulls_of(self.rig)[joint],
            (*map(self.pressure, chambers), "length" if loaded else dotted("joint_angle", joint)),
            None,  # nothing is integrated that could drift
            frozenset(names | self.of("muscle", *pulling) | self.zeros(chambers, [joint])),
            _ARM_STEP,
            "muscle" + _called(joint),
        )
        return self.judged(block, *chambers)

    def chambers_of(self, muscles: Iterable[str]) -> list[str]:
        """Full names of the chambers of some muscles."""
        return [qualified("chamber", self.pulling[muscle]) for muscle in muscles]


def _called(name: str) -> str:
    return f" of {name}" if name else ""


def available_blocks(rig: Rig, channels: tuple[str, ...]) -> list[Block]:
    """The blocks that these channels can tell apart: supplies, inlets of lines, chambers, gases
    with a thermometer, then joints or the load, each in the order of the rig file.

    Every tank (or regulator), chamber, joint and hanging load is a block of its own, driven by the
    measured channels next to it, with the baseline parameters of what it stands for; so is a valve
    where a gauge is between it and the line behind it, in addition to the chamber, which is driven
    from the valve on where that can be; so are muscles whose force (or torque at a joint) is
    measured, and a gas that has a temperature of its own and a thermometer. A rig with joints or a
    load and without valves and supplies is driven by the pressures of its muscles: these are given,
    and only what they move is judged.

    Parameters
    ----------
    rig : Rig
        The nominal model.
    channels : tuple of str
        What every recording has, by the names of the core.
    """
    return [block for block in _all_blocks(rig, channels) if isinstance(block, Block)]


def unjudged_blocks(rig: Rig, channels: tuple[str, ...]) -> list[Unjudged]:
    """The blocks of a rig that these channels cannot tell apart, each with the reason; arguments as
    of :func:`available_blocks`.

    What nobody has to measure (the inlet of a line, a force, the temperature of a gas) and what the
    rig file settles (a constant supply) is none of them.
    """
    return [block for block in _all_blocks(rig, channels) if isinstance(block, Unjudged)]


def _all_blocks(rig: Rig, channels: tuple[str, ...]) -> list[Block | Unjudged]:
    """Every block of a rig, judged or not."""
    have = _BlockMap(rig, channels)
    # what a small flow adds up to is seen from the valve on: two gauges at a tube hardly tell it
    closed = tuple(name for name in channels if channel_of(name) != "line_pressure")
    whole = _BlockMap(rig, closed)
    chambers = [
        block if isinstance(block := whole.chamber(name), Block) else have.chamber(name)
        for name in rig.tables("chamber")
    ]
    blocks = [
        *(have.supply(name) for name in rig.tables("supply")),
        *(have.inlet(name) for name in rig.tables("line")),
        *chambers,
        *(have.temperature(block) for block in chambers),
        *(b for b in map(have.flow, flows_of(rig)) if isinstance(b, Block)),
        *((have.arm(name) for name in rig.tables("joint")) if rig.tables("arm") else ()),
        *([have.load()] if (rig.model["load"] or {}).get("kind") == "mass" else ()),
        *(b for b in map(have.pull, pulls_of(rig)) if isinstance(b, Block)),
    ]
    return [block for block in blocks if block is not None]


# [s] sample time that is needed where every block is a sealed chamber, which hardly moves
_NEEDED_SEALED_SAMPLE_TIME = 0.1


_HELD = (*DRIVEN_COMMANDS, "reference")
"""Entry ``k`` holds from sample ``k`` to the next, where a measured one is of its instant."""


def averaged_to_need(
    recordings: Sequence[Recording], blocks: Sequence[Block], case: str, settings: DiagnosisSettings
) -> tuple[list[Recording], list[int]]:
    """Recordings of a case at the rate that its blocks need.

    Means over so many samples that the fastest block still has the sample time that it needs, and
    that `ample_samples` are left; a short or slow recording stays as it is.

    Parameters
    ----------
    recordings : sequence of Recording
        Those of a case.
    blocks : sequence of Block
        The blocks that are judged.
    case : str
        Its name, for the message.
    settings : DiagnosisSettings
        What is needed, and how much is too much.

    Returns
    -------
    recordings : list of Recording
    counts : list of int
        Recorded samples in each sample, 1 where nothing was averaged.

    Raises
    ------
    DiagnosisError
        If there are more than `most_samples` even so.
    """
    sealed = bool(blocks) and all(block.window is None for block in blocks)
    needed = _NEEDED_SEALED_SAMPLE_TIME if sealed else settings.needed_sample_time
    counts = [
        _odd(min(needed / r.sample_time, len(r) / settings.ample_samples)) for r in recordings
    ]
    shortened = [averaged(r, count) for r, count in zip(recordings, counts, strict=True)]
    total = sum(len(r) for r in shortened)
    if total > settings.most_samples:
        longest = max(shortened, key=len)
        raise DiagnosisError(
            f"case {case!r}: its recordings have {total} samples at the rate that its blocks need; "
            f"at most {settings.most_samples} are diagnosed at a time: choose parts by start and "
            f"stop in case.toml (the longest is {longest.name!r}, {longest.duration:.4g} s)"
        )
    return shortened, counts


def _odd(ratio: float) -> int:
    """The largest odd number up to a ratio: the mean of an odd number of samples is at one."""
    whole = int(ratio * (1.0 + 1e-9))
    return max(1, whole - 1 + whole % 2)


def averaged(recording: Recording, count: int) -> Recording:
    """Means over so many samples each, an odd number; at the middle one's time.

    Parameters
    ----------
    recording : Recording
        What is averaged; at least half of the samples of a mean must be usable.
    count : int
        An odd number; 1 leaves the recording as it is.

    Returns
    -------
    Recording
        With the commands of the log in addition to their means: a valve lets through what its
        openings do one after the other, not what their mean does.
    """
    if count == 1:
        return recording
    half = count // 2
    size = (len(recording) - half) // count
    if size < 2:
        return recording
    channels: dict[str, Array] = {}
    masks: dict[str, Mask] = {}
    commands: dict[str, Array] = {}
    for name, values in recording.channels.items():
        first = half if channel_of(name) in _HELD else 0
        rows = slice(first, first + size * count)
        good = recording.mask[name][rows].reshape(size, count)
        if channel_of(name) in DRIVEN_COMMANDS and good.any():
            commands[name] = held(values, recording.mask[name])[rows]
        parts = np.where(good, values[rows].reshape(size, count), 0.0)
        usable = 2 * good.sum(axis=1) > count
        means = parts.sum(axis=1) / np.maximum(good.sum(axis=1), 1)
        channels[name], masks[name] = np.where(usable, means, np.nan), usable
    step = count * recording.sample_time
    return replace(
        recording,
        time=np.arange(size, dtype=np.float64) * step,
        sample_time=step,
        channels=channels,
        mask=masks,
        commands=commands,
    )
