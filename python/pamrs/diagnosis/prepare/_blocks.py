"""The blocks of a rig between measured channels, and the residual of each with exact
sensitivities.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from pamrs import _core
from pamrs._arrays import Array, Mask
from pamrs.channels import block_of, channel_of, dotted
from pamrs.diagnosis.prepare._signals import (
    DRIVES,
    Prepared,
    flows_of,
    pulls_of,
    thermometers_of,
)
from pamrs.diagnosis.prepare._time_before import TimeBefore
from pamrs.effects import CLOSURE_OF
from pamrs.rig import Rig
from pamrs.rig.schema import keys_of, qualified
from pamrs.simulation import default_step

# [s] a joint's windows: its start has faded, a wrong break-away spoils no more (decision 14)
_ARM_WINDOW = 2.5
_SUPPLY_WINDOW = 4.0  # [s] windows of a tank or a regulator
_CHAMBER_WINDOW = 2.0  # [s] windows of a chamber that is fed; a sealed one is one window
# standard deviations of an unmeasured start of a gas between what it can be at the most
_START_DEVIATIONS = 4.0
# repetitions of a prediction until the temperature at which its gas begins stands still
_START_STEPS = 5
_LEAST_PRESSURE_SHARE = 0.01  # share of the ambient pressure that a noisy gauge shows at the least
# usable samples of a window for each state whose start is projected out, or it is not used
WINDOW_SAMPLES_PER_STATE = 4
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
    beside : tuple of str
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
    beside: tuple[str, ...] = ()
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
    """All flow paths of the air; a valve and the line behind it are one, unless a gauge stands
    between them.
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

    def pressure(self, block: str) -> str:
        """Channel of the pressure of a supply, a chamber or a line's inlet by its full name."""
        kind, _, name = block.partition(".")
        return dotted(_GAUGE_OF[kind], name)

    def around(self, block: str) -> list[_FlowPath]:
        """The flow paths that begin or end at a supply, a chamber or a line's inlet."""
        return [path for path in self.paths if block in path.ends]

    def neighbours(self, block: str) -> tuple[str, ...]:
        """Channels of the pressures next to a block; that of a constant supply is known without
        measuring it.
        """
        others = [
            end for path in self.around(block) for end in path.ends if end not in (block, "ambient")
        ]
        known = [end for end in others if self._lacks_gauge(end, "constant", "regulator")]
        return tuple(dict.fromkeys(self.pressure(end) for end in others if end not in known))

    def _lacks_gauge(self, block: str, *kinds: str) -> bool:
        """True where a block is a supply of one of these kinds whose pressure nobody measured."""
        block_kind, _, name = block.partition(".")
        return (
            block_kind == "supply"
            and self.rig.tables("supply")[name]["kind"] in kinds
            and self.pressure(block) not in self.has
        )

    def without_gauge(self, block: str) -> list[str]:
        """Names of the regulators next to a chamber whose outlet nobody measured: their command
        says what it is.
        """
        ends = dict.fromkeys(end for path in self.around(block) for end in path.ends)
        return [block_of(end) for end in ends if self._lacks_gauge(end, "regulator")]

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

    def of_paths(self, block: str) -> set[str]:
        """Parameters of the valves and lines at a block."""
        names: set[str] = set()
        for path in self.around(block):
            for full in (path.name, *path.between):
                kind, _, name = full.partition(".")
                names |= self.moved(kind, name)
        return names

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
        ends = {block, *(end for path in self.around(block) for end in path.ends)} - {"ambient"}
        simulated = [e for e in ends if e == block or self._lacks_gauge(e, "regulator")]
        supplies = self.rig.ports("supply")
        inlets = [
            supplies.get(block_of(e), {}).get("inlet", "")
            for e in simulated
            if channel_of(e) == "supply"
        ]
        return ends | {inlet for inlet in inlets if inlet}

    def lacking(self, name: str, covers: str, needed: Iterable[str]) -> Unjudged | None:
        """Entry of a block that is not judged for want of channels; None where all are there."""
        missing = [channel for channel in needed if channel not in self.has]
        return Unjudged(name, covers, _not_recorded(missing)) if missing else None

    def supply(self, name: str) -> Block | Unjudged | None:
        """The block of one supply; none where its pressure is what the rig file says, what was
        recorded whatever gives it, or simulated with what it feeds.
        """
        full, table = qualified("supply", name), self.rig.tables("supply")[name]
        behind = self.behind(full)
        without_gauge = [
            one for one in behind if self._lacks_gauge(qualified("supply", one), "regulator")
        ]
        itself = [name] if table["kind"] == "regulator" else []
        nodes = (full, *(qualified("supply", one) for one in behind))
        read = [self.pressure(node) for node in nodes[1:]]
        drives = (
            *(channel for node in nodes for channel in self.neighbours(node)),
            *(channel for channel in read if channel in self.has),
            *(channel for one in itself for channel in self.in_front(one)),
            *(command for node in nodes for command in self.commands(node)),
            *(dotted("supply_command", one) for one in (*itself, *without_gauge)),
        )
        drives = tuple(dict.fromkeys(drives))
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
        if lacking := self.lacking(full, covers, (self.pressure(full), *drives, *self.angles)):
            return lacking
        names = self.moved("supply", name, *(behind if without_gauge else ()))
        for node in nodes:
            names |= self.of_paths(node) | self.zeros(self.nodes_at(node), ())
        return Block(
            full,
            self.pressure(full),
            drives,
            _SUPPLY_WINDOW,
            frozenset(names),
            _GAS_STEP,
            covers,
            ("supply",) if without_gauge else (),
            tubes=self.tubes_at(full),
        )

    def chamber(self, name: str) -> Block | Unjudged:
        """The block of one chamber; not judged where nothing feeds it although it moves a joint:
        its pressure is then what is given.
        """
        full = qualified("chamber", name)
        without_gauge = self.without_gauge(full)
        fed = bool(self.neighbours(full) or self.commands(full) or without_gauge)
        joints = tuple(
            dict.fromkeys(
                self.joint_of[m] for m, chamber in self.pulling.items() if chamber == name
            )
        )
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
        drives = (
            *self.neighbours(full),
            *self.commands(full),
            *(dotted("supply_command", supply) for supply in without_gauge),
            *(channel for supply in without_gauge for channel in self.in_front(supply)),
            *(a for a in self.angles if block_of(a) in joints),
        )
        if lacking := self.lacking(full, covers, (self.pressure(full), *drives, *self.angles)):
            return lacking
        names = (
            self.of_paths(full)
            | self.moved("chamber", name)
            | self.moved("supply", *without_gauge)
            | self.zeros(self.nodes_at(full), joints or [""])
        )
        step = _GAS_STEP if fed else _SEALED_STEP
        window = _CHAMBER_WINDOW if fed else None
        return Block(
            full,
            self.pressure(full),
            drives,
            window,
            frozenset(names),
            step,
            covers,
            ("supply",) if without_gauge else (),
            self.tubes_at(full),
            self.thermometers.get(name, ""),
            warm=self.warm(name),
        )

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

    def temperature(self, chamber: Block | Unjudged) -> Block | None:
        """The block of a gas whose temperature is measured: that of its pressure, read off by the
        thermometer. The pressure is taken anew as often as its own windows begin, so that it does
        not drift; the temperature goes on.
        """
        if isinstance(chamber, Unjudged) or not chamber.thermometer:
            return None
        name = block_of(chamber.name)
        return replace(
            chamber,
            name=dotted("temperature", name),
            channel=chamber.thermometer,
            drives=(*chamber.drives, chamber.channel),
            window=None,
            covers="gas" + _called(name),
            beside=("chamber", *chamber.beside),
            anchor=chamber.window,
        )

    def flow(self, name: str) -> Block | None:
        """The block of what flows into a chamber, where that is measured: the pressures around it
        and the commands to a flow.
        """
        full, channel = qualified("chamber", name), flows_of(self.rig)[name]
        without_gauge = self.without_gauge(full)
        drives = (
            self.pressure(full),
            *self.neighbours(full),
            *self.commands(full),
            *(dotted("supply_command", supply) for supply in without_gauge),
            *(gauge for supply in without_gauge for gauge in self.in_front(supply)),
        )
        if not {channel, *drives, *self.angles} <= self.has or self.tubes_at(full):
            return None
        names = self.of_paths(full) | self.moved("supply", *without_gauge)
        return Block(
            dotted("flow", name),
            channel,
            drives,
            None,  # nothing is integrated that could drift
            frozenset(names | self.zeros(self.nodes_at(full), ())),
            _GAS_STEP,
            ("valve" if self.commands(full) else "line") + _called(name),
            ("supply",) if without_gauge else (),
        )

    def inlet(self, name: str) -> Block | Unjudged | None:
        """The block of a valve alone: what it feeds into a line at whose inlet a gauge stands."""
        full = qualified("line", name)
        if self.pressure(full) not in self.has or not self.commands(full):
            return None
        without_gauge = self.without_gauge(full)
        drives = (
            *self.neighbours(full),
            *self.commands(full),
            *(dotted("supply_command", supply) for supply in without_gauge),
            *(channel for supply in without_gauge for channel in self.in_front(supply)),
        )
        covers = ("regulator and valve" if without_gauge else "valve and line inlet") + _called(
            name
        )
        if lacking := self.lacking(full, covers, (*drives, *self.angles)):
            return lacking
        names = (
            self.of_paths(full)
            | self.moved("supply", *without_gauge)
            | self.zeros(self.nodes_at(full), ())
        )
        return Block(
            full,
            self.pressure(full),
            drives,
            _CHAMBER_WINDOW,
            frozenset(names),
            _GAS_STEP,
            covers,
            ("supply",) if without_gauge else (),
            self.tubes_at(full),
        )

    def arm(self, joint: str) -> Block | Unjudged:
        """The block of one joint: muscles' pressures to its angle."""
        drives = tuple(
            dict.fromkeys(dotted("muscle_pressure", chamber) for chamber in self.pulling.values())
        )
        name, covers = qualified("arm", joint), "muscle, joint and arm" + _called(joint)
        if lacking := self.lacking(name, covers, (*drives, *self.angles)):
            return lacking
        joints, links = self.rig.tables("joint"), self.rig.tables("link")
        names = self.of("arm", "") | self.of("link", *links) | self.of("muscle", *self.pulling)
        names |= self.of_motion(joints)
        names |= self.zeros((qualified("chamber", c) for c in self.pulling.values()), joints)
        return Block(
            name,
            dotted("joint_angle", joint),
            drives,
            _ARM_WINDOW,
            frozenset(names),
            _ARM_STEP,
            covers,
        )

    def load(self) -> Block | Unjudged:
        """The block of a hanging load: muscles' pressures to their length."""
        drives = tuple(
            dict.fromkeys(dotted("muscle_pressure", chamber) for chamber in self.pulling.values())
        )
        covers = "muscle and load"
        if lacking := self.lacking("load", covers, (*drives, *self.angles)):
            return lacking
        names = self.of("load", "") | self.of("muscle", *self.pulling)
        names |= self.zeros((qualified("chamber", c) for c in self.pulling.values()), ())
        return Block("load", "length", drives, _ARM_WINDOW, frozenset(names), _ARM_STEP, covers)

    def pull(self, joint: str) -> Block | None:
        """The block of what the muscles put on a joint or a load, where that is measured: their
        pressures and the motion to a torque or a force.
        """
        loaded, channel = bool(self.rig.model["load"]), pulls_of(self.rig)[joint]
        pulling = [m for m in self.pulling if loaded or self.joint_of[m] == joint]
        drives = tuple(dict.fromkeys(dotted("muscle_pressure", self.pulling[m]) for m in pulling))
        moving = ("length",) if loaded else (dotted("joint_angle", joint),)
        if not pulling or not {channel, *drives, *self.angles} <= self.has:
            return None
        names = self.of("muscle", *pulling) | (set() if loaded else self.of_motion([joint]))
        names |= self.zeros([qualified("chamber", self.pulling[m]) for m in pulling], [joint])
        names |= {"sensors.force_gain"} if loaded else set()
        return Block(
            "force" if loaded else qualified("torque", joint),
            channel,
            (*drives, *moving),
            None,  # nothing is integrated that could drift
            frozenset(names),
            _ARM_STEP,
            "muscle" + _called(joint),
        )


def _called(name: str) -> str:
    return f" of {name}" if name else ""


def available_blocks(rig: Rig, channels: tuple[str, ...]) -> list[Block]:
    """The blocks that these channels can tell apart: supplies, inlets of lines, chambers, gases
    with a thermometer, then joints or the load, each in the order of the rig file.

    Every tank (or regulator), chamber, joint and hanging load is a block of its own, driven by the
    measured channels next to it, with the baseline parameters of what it stands for; so is a valve
    where a gauge stands between it and the line behind it, beside the chamber, which is driven from
    the valve on where that can be; so are muscles whose force (or torque at a joint) is measured,
    and a gas that has a temperature of its own and a thermometer. A rig with joints or a load and
    without valves and supplies is driven by the pressures of its muscles: these are given, and only
    what they move is judged.

    Parameters
    ----------
    rig : Rig
        The nominal model.
    channels : tuple of str
        What every recording has, by the names of the core.

    Returns
    -------
    list of Block
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

    def chamber(name: str) -> Block | Unjudged:
        block = whole.chamber(name)
        return block if isinstance(block, Block) else have.chamber(name)

    chambers = [chamber(name) for name in rig.tables("chamber")]
    blocks = [
        *(have.supply(name) for name in rig.tables("supply")),
        *(have.inlet(name) for name in rig.tables("line")),
        *chambers,
        *(have.temperature(block) for block in chambers),
        *(have.flow(name) for name in flows_of(rig)),
        *((have.arm(name) for name in rig.tables("joint")) if rig.tables("arm") else ()),
        *([have.load()] if (rig.model["load"] or {}).get("kind") == "mass" else ()),
        *(have.pull(name) for name in pulls_of(rig)),
    ]
    return [block for block in blocks if block is not None]


@dataclass(frozen=True, eq=False)
class Residual:
    """Measured minus predicted output of one block over one recording, with the window's start
    projected out.

    Attributes
    ----------
    value : (n,) array
        Residual in the channel's unit; 0 in unusable rows.
    jacobian : (n, k) array or None
        Derivative of the *prediction* with respect to each parameter, start projected out as well.
    prediction : (n,) array
        Predicted channel, for looking at.
    rows : (n,) bool array
        Usable rows.
    noise : float
        Noise of the channel.
    starts : list of (a, b, q)
        Windows with an orthogonal basis of what their start can do; what a residual without a
        jacobian is freed of. A direction of length one is free, a shorter one held by a prior.
    temperature : float or None
        Temperature at which a gas without a thermometer begins [K].
    strain : float
        Squares of how far that is from the room's, in standard deviations of what it may be.
    response : (n, k) array or None
        Derivative of the prediction with respect to the height of an input at each knot of the
        window that a row belongs to, start projected out.
    """

    value: Array
    jacobian: Array | None
    prediction: Array
    rows: Mask
    noise: float
    starts: list[tuple[int, int, Array]] = field(default_factory=list)
    temperature: float | None = None
    strain: float = 0.0
    response: Array | None = None

    def freed(self, values: Array) -> Array:
        """Values (n,) without what the starts of windows can do, 0 in unusable rows."""
        out = np.where(self.rows, values, 0.0)
        for a, b, q in self.starts:
            out[a:b] -= q @ (q.T @ out[a:b])
        return np.where(self.rows, out, 0.0)


def change(block: Block, core: _core.Rig, prepared: Prepared, base: Residual) -> Array:
    """Residual under another model, freed of the same starts as one that was computed with its
    sensitivities.

    Parameters
    ----------
    block : Block
        Which block.
    core : _core.Rig
        The other model, compiled.
    prepared : Prepared
        The recording.
    base : Residual
        The residual of a model near to it.

    Returns
    -------
    (n,) array
        In the channel's unit; 0 in unusable rows.
    """
    if base.temperature is not None:
        prepared = replace(prepared, temperatures={block.channel: base.temperature})
    prediction = predicted(block, core, prepared)
    measured = np.where(
        prepared.recording.mask[block.channel], prepared.recording.channels[block.channel], 0.0
    )
    return base.freed(measured - prediction)


def signals_at_starts(
    block: Block, prepared: Prepared, starts: list[int]
) -> dict[str, tuple[Array, Array]]:
    """Smoothed channels, with the best estimates, where windows start, of what a block integrates
    (an arm: all joints); inlets of lines only where the block is cut there.
    """
    state = [
        n
        for n in prepared.signals
        if n in (block.channel, block.thermometer)
        or (block.kind == "arm" and channel_of(n) == "joint_angle")
    ]
    around = {block.channel, *block.drives}
    drives = {
        n: s
        for n, s in prepared.signals.items()
        if n == block.thermometer
        or (channel_of(n) in DRIVES and (channel_of(n) != "line_pressure" or n in around))
    }
    at_starts = {name: prepared.with_starts(name, starts) for name in state if name in drives}
    return drives | at_starts | _warm(block, prepared)


def _warm(block: Block, prepared: Prepared) -> dict[str, tuple[Array, Array]]:
    """The temperature at which a gas without a thermometer begins, as one would read it there."""
    if block.warm is None:
        return {}
    begins = prepared.temperatures.get(block.channel, block.warm.room)
    return {block.warm.channel: (np.full(prepared.n, begins), np.zeros(prepared.n))}


def _core_of_recording(core: _core.Rig, prepared: Prepared) -> _core.Rig:
    """A compiled rig with the values that it had in a recording."""
    values = prepared.recording.parameters
    if not values:
        return core
    known = dict(zip(core.parameter_names, core.values.tolist(), strict=True))
    revalued = core.revalued({n: value.at(known[n]) for n, value in values.items() if n in known})
    if revalued is None:
        raise AssertionError("values of a recording are those of parameters that can vary")
    return revalued


def predicted(
    block: Block,
    core: _core.Rig,
    prepared: Prepared,
    outlets: dict[str, float] | None = None,
    before: TimeBefore | None = None,
) -> Array:
    """A block's output over a recording, every window from its measured start.

    Parameters
    ----------
    block : Block
        Which block.
    core : _core.Rig
        The compiled model.
    prepared : Prepared
        The recording.
    outlets : dict of str to float, optional
        Where regulators without a gauge begin [Pa, gauge], by their full names; by default where
        the recording says, else at the pressure of what they feed.
    before : TimeBefore, optional
        What nobody measured begins as this leaves it, and not at rest.

    Returns
    -------
    (n,) array
        In the channel's unit.
    """
    core = _core_of_recording(core, prepared)
    starts = prepared.starts(block.window, block.drives)
    commands = prepared.driving(mechanical=block.mechanical)
    signals, lead = signals_at_starts(block, prepared, starts), 0
    if before is not None:
        lead = before.samples
        commands = before.commands(commands, prepared.n)
        measured = {name: signal for name, signal in signals.items() if name in prepared.signals}
        signals = before.signals(measured, prepared)
        # what is measured starts anew at every sample of it
        starts = [*range(lead), *(lead + start for start in starts)]
    prediction, _ = core.predict(
        block.name,
        commands,
        prepared.dt,
        default_step(prepared.dt, longest=block.step),
        starts,
        [],
        signals,
        lead + prepared.n,
        _outlets(prepared) | (outlets or {}),
        _anchors(block, prepared, starts, lead),
    )
    return prediction[lead:]


def _outlets(prepared: Prepared) -> dict[str, float]:
    """Pressures at which a recording says that regulators begin [Pa, gauge]."""
    return {name: pressure for name, (pressure, _) in prepared.outlets.items()}


def _anchors(block: Block, prepared: Prepared, starts: list[int], lead: int = 0) -> list[int]:
    """Samples at which the pressures of a block are taken anew inside its windows."""
    if block.anchor is None:
        return []
    each = (lead + start for start in prepared.starts(block.anchor, block.drives))
    return sorted(set(each) - set(starts))


def _start_columns(block: Block, start: Array, at: int, prepared: Prepared) -> Array:
    """Columns of what the start of a window can do, (n, k): of a pressure without the temperature
    at which its gas began once that is forgotten; of a temperature without where a thermometer
    stood that is not late.
    """
    # what drove a gas in a hole of the recording before is not known
    hole = block.warm is not None and at > 0 and not prepared.clear(block.drives)[at - 1]
    if hole or block.kind == "temperature":
        return start[:, start.any(axis=0)]
    if block.warm is None and not block.thermometer:
        return start
    noise, settings = prepared.noise[block.channel], prepared.settings
    with np.errstate(over="ignore"):  # of a model that ran away, which no fit keeps
        remembered = float(np.linalg.norm(start[:, -1])) * settings.begun_temperature_error > noise
    return start if remembered else start[:, :-1]


@dataclass(frozen=True)
class _GasStart:
    """The temperature at which a gas without a thermometer begins, as physics bounds it [K].

    Attributes
    ----------
    room, coldest, warmest : float
        At rest, and what it can be.
    std : float
        Standard deviation before any data.
    """

    room: float
    coldest: float
    warmest: float
    std: float

    @classmethod
    def of(cls, block: Block, prepared: Prepared) -> _GasStart | None:
        """Start of a block's gas in a recording; None where it is measured, or there is no gas."""
        if block.warm is None:
            return None
        pressures = [
            block.channel,
            *(n for n in block.drives if channel_of(n) == "supply_pressure"),
        ]
        gauges = [prepared.signals[n][0] for n in pressures if n in prepared.signals]
        first = float(gauges[0][0])
        bounds = block.warm.range_at(first, max(float(v.max()) for v in gauges))
        wide = (bounds[1] - bounds[0]) / _START_DEVIATIONS
        least = prepared.settings.begun_temperature_error
        return cls(block.warm.room, *bounds, max(wide, least))


class _FreedWindow(NamedTuple):
    """A window freed of its start: directions that are taken out, what they take of the residual,
    the temperature at which its gas begins [K], and how unlikely that is [standard deviations
    squared].
    """

    basis: Array
    taken: Array
    begins: float | None = None
    strain: float = 0.0


def _freed_window(
    columns: Array, value: Array, noise: float, gas: _GasStart | None, begins: float
) -> _FreedWindow:
    """A window's residual (n,) freed of what its start can do (n, k).

    With a gas the last column is that of its temperature [1/K], of which the window begins at a
    value: noise and a normal prior about the room's are whitened together, so that of an unlikely
    start something stays in the residual; beyond what the temperature can be all of it stays.
    """
    free = columns if gas is None else columns[:, :-1]
    q = np.linalg.qr(free)[0]
    taken = q @ (q.T @ value)
    if gas is None:
        return _FreedWindow(q, taken)
    column = columns[:, -1] - q @ (q.T @ columns[:, -1])
    length = float(np.linalg.norm(column))
    if not (0.0 < length < math.inf and math.isfinite(float(value @ value))):
        return _FreedWindow(q, taken, begins)  # of a model that ran away
    way, held = column / length, (noise / gas.std) ** 2
    along = float(way @ (value - taken))
    from_room = along + length * (begins - gas.room)  # in the residual, from the room's temperature
    wanted = gas.room + length * from_room / (length**2 + held)
    temperature = min(max(wanted, gas.coldest), gas.warmest)
    past = from_room - length * (temperature - gas.room)
    kept_in_residual = math.copysign(
        math.hypot(past, (temperature - gas.room) * noise / gas.std), from_room
    )
    # how fast what is left grows with the residual
    grows = (
        past / kept_in_residual
        if kept_in_residual and temperature != wanted
        else held / (length**2 + held)
    )
    grows = grows if temperature != wanted else math.sqrt(held / (length**2 + held))
    basis = np.column_stack([q, math.sqrt(max(0.0, 1.0 - grows)) * way])
    strain = ((temperature - gas.room) / gas.std) ** 2
    return _FreedWindow(basis, taken + (along - kept_in_residual) * way, temperature, strain)


def _levels(block: Block, core: _core.Rig, prepared: Prepared, prediction: Array) -> list[Array]:
    """Change of a prediction by the level of each simulated drive and by how far it falls, and of a
    temperature by a share of the wall's in what the thermometer reads; `core` is the rig as it was
    in the recording.
    """
    # a wall is as warm as the room: a share of it makes what the gas does smaller by that share
    columns = [prediction - float(np.mean(prediction))] if block.kind == "temperature" else []
    for name in block.floating:
        value, slope = prepared.signals[name]
        # how far it falls goes with the valve's area over the tank's volume, which nobody knows
        for off, steeper in ((np.ones_like(value), 0.0), (value - value[0], 1.0)):
            step = 1e-3 * max(1.0, float(np.abs(value).max())) / max(1.0, float(np.abs(off).max()))
            moved = prepared.with_signals(
                {name: (value + step * off, slope * (1.0 + step * steeper))}
            )
            bare = replace(moved, recording=replace(moved.recording, parameters={}))
            columns.append((predicted(block, core, bare) - prediction) / step)
    return columns


def _beside_starts(columns: list[Array], starts: list[tuple[int, int, Array]]) -> Array:
    """Orthonormal columns (n, k) that are free in a whole recording, without what the starts of its
    windows can do.
    """
    free, rounding = [], float(np.finfo(np.float64).eps) ** 0.5
    for column in columns:
        whole = float(np.linalg.norm(column))
        for a, b, q in starts:
            column[a:b] -= q @ (q.T @ column[a:b])
        length = float(np.linalg.norm(column))
        if length > rounding * whole:
            free.append(column / length)
    if not free:
        return np.zeros((0, 0))
    basis, triangle = np.linalg.qr(np.array(free).T)
    return np.asarray(basis[:, np.abs(np.diag(triangle)) > rounding])


def _with_slopes(
    block: Block,
    core: _core.Rig,
    prepared: Prepared,
    starts: list[int],
    names: list[str],
    given: Input | None,
) -> tuple[Array, Array, Array]:
    """A block's output over a recording (n,), its derivatives with respect to parameters and to the
    states in which its windows start (n, k), and to the knots of an input (n, m).
    """
    prediction, jacobian = core.predict(
        block.name,
        prepared.driving(mechanical=block.mechanical),
        prepared.dt,
        default_step(prepared.dt, longest=block.step),
        starts,
        names,
        signals_at_starts(block, prepared, starts),
        prepared.n,
        _outlets(prepared),
        anchors=_anchors(block, prepared, starts),
        **({} if given is None else given._asdict()),
    )
    if jacobian is None:
        raise AssertionError("the core returns a jacobian when parameters are named")
    ends = zip(starts, [*starts[1:], prepared.n], strict=True)
    knots = 0 if given is None else max(given.knots(b - a) for a, b in ends)
    split = jacobian.shape[1] - knots
    return prediction, jacobian[:, :split], jacobian[:, split:]


def _from_its_start(
    block: Block,
    core: _core.Rig,
    prepared: Prepared,
    starts: list[int],
    names: list[str],
    given: Input | None,
) -> tuple[Prepared, Array, Array, Array]:
    """Output and derivatives as of `_with_slopes`, of a gas that begins as warm as its pressure and
    a prior say (Gauss-Newton), and the recording with that temperature.
    """
    gas = _GasStart.of(block, prepared)
    with_slopes = _with_slopes(block, core, prepared, starts, names, given)
    if gas is None:
        return prepared, *with_slopes
    first = slice(starts[0], [*starts[1:], prepared.n][0])
    rows = prepared.usable(block.channel, block.drives, starts)[first]
    measured = np.where(rows, prepared.recording.channels[block.channel][first], 0.0)
    begins = gas.room
    for _ in range(_START_STEPS):
        prediction, jacobian, _ = with_slopes
        start = np.where(rows[:, None], jacobian[first, len(names) :], 0.0)
        columns = _start_columns(block, start, starts[0], prepared)
        value = np.where(rows, measured - prediction[first], 0.0)
        if columns.shape[1] < 2 or not np.isfinite(value).all():
            break  # nothing of it is seen
        wanted = _freed_window(columns, value, prepared.noise[block.channel], gas, begins).begins
        if wanted is None or abs(wanted - begins) <= prepared.settings.begun_temperature_error:
            break  # so far it is linear
        begins = wanted
        prepared = replace(prepared, temperatures={block.channel: begins})
        with_slopes = _with_slopes(block, core, prepared, starts, names, given)
    return prepared, *with_slopes


def residual(
    block: Block,
    core: _core.Rig,
    prepared: Prepared,
    parameters: list[str],
    given: Input | None = None,
) -> Residual:
    """Predict a block's output over a recording and compare.

    Parameters
    ----------
    block : Block
        Which block.
    core : _core.Rig
        The compiled model.
    prepared : Prepared
        The recording.
    parameters : list of str
        Dotted names for the jacobian, may be empty.
    given : Input, optional
        An input of the block beside what its model makes; the residual then has a `response`.
    """
    core = _core_of_recording(core, prepared)
    starts = prepared.starts(block.window, block.drives)
    # without parameters a free null direction is still wanted for the window's start: ask for one
    # parameter
    given_own = [n for n, v in prepared.recording.parameters.items() if v.error == "own"]
    own_free = [n for n in given_own if n in core.parameter_names]
    names = list(dict.fromkeys([*parameters, *own_free])) or [
        next(
            (n for n in core.parameter_names if n.endswith("pressure_zero")),
            core.parameter_names[0],
        )
    ]
    prepared, prediction, jacobian, response = _from_its_start(
        block, core, prepared, starts, names, given
    )
    free = jacobian[:, [names.index(n) for n in own_free]].T.copy()
    for name, value_of in prepared.recording.parameters.items():
        if name in parameters:
            jacobian[:, names.index(name)] *= value_of.slope
    rows = prepared.usable(block.channel, block.drives, starts)
    measured = prepared.recording.channels[block.channel]
    value = np.where(rows, measured - prediction, 0.0)
    slopes = np.where(rows[:, None], np.hstack([jacobian[:, : len(names)], response]), 0.0)
    columns = np.where(rows[:, None], jacobian[:, len(names) :], 0.0)
    not_freed = Residual(value, None, prediction, rows, prepared.noise[block.channel])
    freed = _freed_of_starts(block, prepared, not_freed, starts, columns, slopes)
    every = [*_levels(block, core, prepared, prediction), *free]
    of_recording = _beside_starts([np.where(rows, v, 0.0) for v in every], freed.starts)
    if of_recording.size:
        taken = of_recording @ (of_recording.T @ freed.value)
        slopes -= of_recording @ (of_recording.T @ slopes)
        freed = replace(
            freed,
            value=freed.value - taken,
            prediction=freed.prediction + taken,
            starts=[*freed.starts, (0, prepared.n, of_recording)],
        )
    return replace(
        freed,
        jacobian=slopes[:, : len(parameters)] if parameters else None,
        # a whole recording is shown from its measured start, a window from the one that suits best
        prediction=prediction if block.window is None else freed.prediction,
        response=None if given is None else slopes[:, len(names) :],
    )


def _freed_of_starts(
    block: Block,
    prepared: Prepared,
    not_freed: Residual,
    starts: list[int],
    columns: Array,
    slopes: Array,
) -> Residual:
    """A residual freed of where its windows start, and so are `slopes` (n, k), in place; windows
    with too few rows are left out. ``columns`` are what the start of each window does.
    """
    value, rows, shifted = not_freed.value, not_freed.rows, not_freed.prediction.copy()
    gas = _GasStart.of(block, prepared)
    begins = prepared.temperatures.get(block.channel, gas.room) if gas else 0.0
    temperature, strain = (begins if gas else None), 0.0
    bases: list[tuple[int, int, Array]] = []
    for a, b in zip(starts, [*starts[1:], prepared.n], strict=True):
        start = _start_columns(block, columns[a:b], a, prepared)
        if np.count_nonzero(rows[a:b]) < WINDOW_SAMPLES_PER_STATE * start.shape[1]:
            rows[a:b], value[a:b], slopes[a:b] = False, 0.0, 0.0
            continue
        first_gas = gas if a == starts[0] and start.shape[1] > 1 else None
        freed = _freed_window(start, value[a:b], not_freed.noise, first_gas, begins)
        bases.append((a, b, freed.basis))
        value[a:b] -= freed.taken
        shifted[a:b] += freed.taken
        slopes[a:b] -= freed.basis @ (freed.basis.T @ slopes[a:b])
        strain += freed.strain
        temperature = freed.begins or temperature
    return replace(
        not_freed, prediction=shifted, starts=bases, temperature=temperature, strain=strain
    )
