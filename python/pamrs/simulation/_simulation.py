"""Simulation of a rig under held commands."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from pamrs import _core
from pamrs._arrays import Array, ArrayLike, Mask
from pamrs._checks import check_kind, doubt_pascals, positive, quantities, refused
from pamrs._tables import Columns, Tabular
from pamrs._tables import over_time as columns_over_time
from pamrs._views import Panels, View, in_laboratory_units, over_time
from pamrs.channels import channel_of, dotted, laboratory_unit
from pamrs.errors import PamrsError, ParameterError, meant
from pamrs.rig import Rig, check_sample_time
from pamrs.simulation._driving import (
    Signals,
    by_signal,
    initial_values,
    prescribed,
    sensor_zero,
    signals_of,
)


class Event(NamedTuple):
    """Event between two samples.

    Attributes
    ----------
    time : float
        When [s], by a straight line through the step in which it happened.
    kind : str
        ``min_stop_reached``, ``min_stop_left``, ``max_stop_reached``, ``max_stop_left``;
        ``choked``, ``unchoked``; ``vacuum_reached`` and ``vacuum_left`` (a chamber falls 50 mbar
        below the ambient pressure, and no longer is there); ``max_pressure_passed`` and
        ``max_pressure_kept`` (it rises above ``limits.max_pressure`` of the rig file, and is below
        it again); ``command_clipped`` and ``command_in_range`` (a valve is asked for more than
        ``null_voltage`` +- ``half_range`` and stays at that end, and no longer is);
        ``muscle_pushes`` and ``push_ends`` (a muscle whose ``buckling_load`` is above zero pushes
        with a newton or more, or half of that load, and no longer does; at samples).
    block : str
        Where: ``joint.elbow``, ``load``, ``chamber``, ``valve.flexor``, ``line``, ``muscle``.
    """

    time: float
    kind: str
    block: str


@dataclass(frozen=True)
class Balance:
    """Mass, energy and work over a simulation.

    Attributes
    ----------
    supplied, vented, stored : float
        Mass out of the supplies, mass to the ambient (what regulators relieve included), gain of
        all chambers and lines by what flowed [kg].
    implied : float
        Gain by the gas law at the rest temperature, ``P V/(R T)`` [kg]. The constant coefficients
        of filling, emptying and volume change are no energy balance, so that it differs from
        ``stored`` where they are not 1; with the effect ``heat_transfer`` the two differ by the
        gas's temperature alone. A chamber with an energy balance has a temperature of its own, and
        the two are one.
    energy : float
        ``R T`` times the mass supplied, what section 6 of the dissertation calls ``E_in``:
        ``(P_initial - P_final) V`` of a tank [J].
    exergy : float
        ``R T ln(P/P_a)`` times the mass supplied at the supply's pressure ``P``: the most work that
        it could do [J].
    muscle_work : float
        Work of the muscles, ``F dd`` [J].
    joint_work : float
        Work at the joints where torque and motion go the same way, ``tau dtheta > 0`` [J].
    enthalpy, heat, gas_work : float or None
        Of the chambers with an energy balance: enthalpy that flows brought less what they took,
        heat from the walls, work of the gas ``p dV`` [J]; their internal energy ``p V/(kappa - 1)``
        grew by the first two less the third. None where no chamber has one.
    laws : tuple of str
        Blocks whose pressure follows constant coefficients that are not all 1, which make and lose
        mass: chambers without an energy balance, tubes of segments.
    """

    supplied: float
    vented: float
    stored: float
    implied: float
    energy: float
    exergy: float
    muscle_work: float
    joint_work: float
    enthalpy: float | None = None
    heat: float | None = None
    gas_work: float | None = None
    laws: tuple[str, ...] = ()

    @property
    def residual(self) -> float:
        """Mass that is unaccounted for by what flowed [kg]: rounding."""
        return self.supplied - self.vented - self.stored

    @property
    def created(self) -> float:
        """Mass that the gas coefficients make or lose [kg]: what pressure and volume say is stored,
        less what flowed in.
        """
        return self.implied - self.stored

    @property
    def efficiency(self) -> float:
        """Lifting work by energy supplied [1] (dissertation 6.4); NaN where nothing was supplied.

        An arm that swings is lifted again and again, and the spring of its muscles gives the work
        back: then it is above 1.
        """
        return self.joint_work / self.energy if self.energy > 0.0 else math.nan

    def _made_by(self) -> str:
        """Words on why mass appears or vanishes, and on the choice that would avoid it."""
        tubes = [name for name in self.laws if name.partition(".")[0] == "line"]
        reasons = []
        if len(tubes) < len(self.laws):
            reasons.append(
                "the constant gas coefficients, which are no energy balance; gas = "
                '"energy_balance" of a chamber is'
            )
        if tubes:
            alphas = ", ".join(f"{name}.alpha" for name in tubes)
            reasons.append(f"{alphas}, the speed of sound in its segments; 1 makes up none")
        return f" by {'; and by '.join(reasons)}" if reasons else ""

    def __str__(self) -> str:
        air = (
            f"air {1e3 * self.supplied:.4g} g supplied, {1e3 * self.vented:.4g} g vented, "
            f"{1e3 * self.implied:.4g} g more stored"
        )
        if abs(self.created) > 1e-3 * max(self.supplied, self.vented, 1e-12):
            air += f" ({1e3 * self.created:+.4g} g{self._made_by()})"
        share = (
            f" ({100.0 * self.muscle_work / self.exergy:.1f} % of it)" if self.exergy > 0.0 else ""
        )
        walls = ""
        if self.heat is not None and self.gas_work is not None:
            walls = f"\nheat from the walls {self.heat:.4g} J"
            walls += f", work of the gas {self.gas_work:.4g} J"
        return (
            f"{air}{walls}\nair's energy R T m {self.energy:.4g} J, exergy {self.exergy:.4g} J; "
            f"net work of the muscles {self.muscle_work:.4g} J"
            f"{share}, lifting work {self.joint_work:.4g} J"
        )


class _TimedCondition(NamedTuple):
    """Condition of a block that begins and ends at times, as the recorded channels show."""

    block: str
    kinds: tuple[str, str]
    """Of the events at which it begins and ends."""
    times: list[float]
    """At which it begins and ends, in turn [s]."""
    what: str
    more: str

    def events(self) -> list[Event]:
        """Events of its beginnings and ends."""
        return [Event(time, self.kinds[k % 2], self.block) for k, time in enumerate(self.times)]

    def words(self) -> str:
        """One line with the block, the condition, its first stretch and the count of the others."""
        end = f"to {self.times[1]:.4g} s" if len(self.times) > 1 else "to the end"
        again = _again(-(-len(self.times) // 2))
        return f"{self.block}: {self.what} from {self.times[0]:.4g} s {end}{again}; {self.more}"


def _again(count: int) -> str:
    """Words for the number of times that something happened, after the first was described."""
    return {1: "", 2: " and once more"}.get(count, f" and {count - 1} more times")


class Simulation(View, Tabular, Mapping[str, Array]):
    """Simulated channels by name, SI, gauge pressures; ``time`` [s] is a channel too.

    ``result["muscle_pressure"]`` is an array with one row per sample; ``result.time`` is
    ``result["time"]``.
    """

    def __init__(
        self, channels: Mapping[str, Array], rig: Rig, events: Sequence[tuple[float, str, str]] = ()
    ) -> None:
        self._channels = dict(channels)
        self.rig = rig
        self._happened = [Event(*event) for event in events]

    @cached_property
    def events(self) -> list[Event]:
        """Stops that were reached or left, flows that became choked or no longer are, commands
        beyond the range of their valve, muscles that push, in the order of time.
        """
        seen = [event for own in self._happenings() for event in own.events()]
        return sorted([*self._happened, *seen], key=lambda event: event.time)

    def _clipped(self) -> list[_TimedCondition]:
        """Commands beyond their valve's range, an entry for each valve, perhaps without times."""
        found = []
        for name, command in self.under("valve_command").items():
            valve = self.rig.tables("valve")[name]
            null, half = valve["null_voltage"], valve["half_range"]
            held = command[:-1] if command.size > 1 else command  # the last one is not run
            beyond = np.abs(held - null) > half * (1.0 + _BEYOND_RANGE)
            worst = float(held[np.argmax(np.abs(held - null))])
            what = f"command clipped to its range of {null - half:.4g} to {null + half:.4g} V"
            kinds, more = ("command_clipped", "command_in_range"), f"{worst:.4g} V was asked for"
            found.append(
                _TimedCondition(dotted("valve", name), kinds, self._turns(beyond), what, more)
            )
        return found

    def _happenings(self) -> list[_TimedCondition]:
        """Conditions that the recorded channels show: clipped commands, muscles that push."""
        return [condition for condition in (*self._clipped(), *self._pushed()) if condition.times]

    def _turns(self, of: Mask) -> list[float]:
        """Times from which something holds and from which it no longer does, in turn [s]."""
        return [float(time) for time in self.time[np.flatnonzero(np.diff(of, prepend=False))]]

    def _pushed(self) -> list[_TimedCondition]:
        """Muscles that push, an entry for each that can, perhaps without times."""
        found = []
        for name, muscle in self.rig.tables("muscle").items():
            load, force = muscle["buckling_load"], self.under("muscle_force").get(name)
            if load == 0.0 or force is None:
                continue
            each = force / muscle["count"]
            times = self._turns(each < -min(_TELLING_PUSH, 0.5 * load))
            what = f"pushes, each muscle with up to {-float(each.min()):.4g} N,"
            kinds, more = ("muscle_pushes", "push_ends"), f"its buckling_load is {load:.4g} N"
            found.append(_TimedCondition(dotted("muscle", name), kinds, times, what, more))
        return found

    @property
    def time(self) -> Array:
        """Time of each row [s]."""
        return self._channels["time"]

    def __getitem__(self, channel: str) -> Array:
        try:
            return self._channels[channel]
        except KeyError:
            raise KeyError(
                f"no channel {channel!r}; {meant(str(channel), self._channels)}"
            ) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._channels)

    def __len__(self) -> int:
        return len(self._channels)

    def under(self, channel: str) -> dict[str, Array]:
        """A channel of every block that has it.

        Parameters
        ----------
        channel : str
            For example ``"muscle_pressure"``.

        Returns
        -------
        dict of str to ndarray
            Name of the block ("" where it has none) -> channel.
        """
        split = {name: name.partition(".") for name in self._channels}
        return {
            block: self._channels[name]
            for name, (head, _, block) in split.items()
            if head == channel
        }

    @property
    def balance(self) -> Balance:
        """Mass, energy and work from the first to the last row.

        Raises
        ------
        ParameterError
            If a channel was not recorded.
        """
        self._check_whole("balance")
        masses = [
            dotted(channel, block)
            for channel in ("air_mass", "line_mass", "segment_mass")
            for block in self.under(channel)
        ]
        heat = [name for name in _HEAT_BALANCES if name in self._channels]
        return Balance(
            supplied=self._gain("mass_supplied"),
            vented=self._gain("mass_vented"),
            stored=sum(self._gain(mass) for mass in masses),
            implied=self._implied(),
            energy=self._gain("energy_supplied"),
            exergy=self._gain("exergy_supplied"),
            muscle_work=self._gain("muscle_work"),
            joint_work=self._gain("joint_work"),
            laws=self._laws(),
            **{name.removesuffix("_gained"): self._gain(name) for name in heat},
        )

    def _gain(self, channel: str) -> float:
        """A channel at the last row less that at the first one."""
        values = self._channels[channel]
        return float(values[-1] - values[0])

    def _implied(self) -> float:
        """Gain of mass by the gas law at the rest temperature [kg]."""
        gas = self.rig.tables("gas")[""]
        rt = gas["gas_constant"] * gas["temperature"]
        total = self._implied_in_lines(rt)
        for name, volume in self.under("air_volume").items():
            if self.rig.tables("chamber")[name]["gas"] == "energy_balance":
                total += self._gain(dotted("air_mass", name))
                continue
            zero = sensor_zero(self.rig, "chamber", "pressure_zero", name)
            gauge = self._channels[dotted("muscle_pressure", name)]
            absolute = gauge - zero + gas["ambient_pressure"]
            total += float(absolute[-1] * volume[-1] - absolute[0] * volume[0]) / rt
        return total

    def _implied_in_lines(self, rt: float) -> float:
        """Gain of mass along the lines by the gas law [kg], `rt` being ``R T``; the inlet of a line
        without segments is isothermal, so that its recorded mass is the one by its pressure.
        """
        total = 0.0
        for line, table in self.rig.tables("line").items():
            count = int(table.get("segments", 0))
            inlet, held = dotted("line_pressure", line), dotted("line_mass", line)
            if not count:
                total += self._gain(held) if held in self._channels else 0.0
                continue
            segment = math.pi / 4.0 * table["diameter"] ** 2 * table["length"] / count
            between = dotted("segment_pressure", line)
            volumes = {dotted(between, str(k)): segment for k in range(1, count)}
            if inlet in self._channels:
                volumes[inlet] = table["inlet_volume"] + 0.5 * segment
            for channel, volume in volumes.items():
                total += self._gain(channel) * volume / rt
        return total

    def _laws(self) -> tuple[str, ...]:
        """Blocks whose gas makes or loses mass: see :attr:`Balance.laws`."""
        coefficients = ("alpha_in", "alpha_out", "alpha")  # a tube without segments has none
        return tuple(
            dotted(block, name)
            for block in ("chamber", "line")
            for name, table in self.rig.tables(block).items()
            if any(table.get(key, 1.0) != 1.0 for key in coefficients)
        )

    def _check_whole(self, what: str) -> None:
        """Refuse what needs every channel where some were not recorded."""
        missing = [name for name in core_rig(self.rig).channels if name not in self._channels]
        if missing:
            raise ParameterError(
                f"{what} needs every channel, and record left out {', '.join(missing)}: "
                "simulate without record"
            )

    def summary(self) -> str:
        """Summary in a few lines: the end of every motion and pressure, what happened on the way,
        and where mass and energy went.

        Raises
        ------
        ParameterError
            If a channel was not recorded.
        """
        self._check_whole("summary()")
        said = [f"{self.rig.name}: {self.time[-1]:g} s, {self.time.size} rows"]
        for channel in ("muscle_pressure", "joint_angle", "length"):
            unit, factor = laboratory_unit(channel)
            for block, values in self.under(channel).items():
                low, high, last = (
                    factor * float(v) for v in (values.min(), values.max(), values[-1])
                )
                said.append(
                    f"{dotted(channel, block)}: from {low:.4g} to {high:.4g} {unit}, at the end "
                    f"{last:.4g} {unit}"
                )
        kinds = dict.fromkeys((event.block, event.kind) for event in self._happened)
        for block, kind in kinds:
            times = [
                event.time for event in self._happened if (event.block, event.kind) == (block, kind)
            ]
            said.append(
                f"{block}: {kind.replace('_', ' ')} at {times[0]:.4g} s{_again(len(times))}"
            )
        said += [own.words() for own in self._happenings()]
        return "\n".join([*said, *self._beyond(), *self._fallen(), str(self.balance)])

    def _beyond(self) -> list[str]:
        """Joints that were pressed far into a stop."""
        said = []
        for name, joint in self.rig.tables("joint").items():
            angle = self._channels[dotted("joint_angle", name)]
            ends = (("lower", joint["min_angle"] - angle), ("upper", angle - joint["max_angle"]))
            for end, beyond in ends:
                most = math.degrees(float(beyond.max()))
                if most > _TELLING_DEGREES:
                    said.append(
                        f"{dotted('joint', name)}: up to {most:.3g} deg beyond its {end} stop"
                    )
        return said

    def _fallen(self) -> list[str]:
        """Joints that end on their lower stop although their muscles are under pressure."""
        said = []
        for name, joint in self.rig.tables("joint").items():
            angle, torque = (
                self._channels[dotted(channel, name)] for channel in ("joint_angle", "joint_torque")
            )
            if angle[-1] <= joint["min_angle"] + 1e-3 and torque[-1] > _TELLING_TORQUE:
                said.append(
                    f"{dotted('joint', name)}: ends on its lower stop; {torque[-1]:.3g} N m of its "
                    "muscles do not lift the arm"
                )
        return said

    def _columns(self) -> Columns:
        channels = {name: values for name, values in self._channels.items() if name != "time"}
        return columns_over_time(self.time, channels, {})

    def _panels(self) -> Panels:
        channels = {name: values for name, values in self._channels.items() if name != "time"}
        return over_time({n: [("", self.time, v, {})] for n, v in channels.items()})

    def _numbers(self) -> dict[str, str]:
        numbers = {"rig": self.rig.name, "time": f"{self.time[-1]:.4g} s in {self.time.size} rows"}
        for head in ("muscle_pressure", "joint_angle", "length"):
            for block, values in self.under(head).items():
                span = in_laboratory_units(head, values.min(), values.max())
                last = in_laboratory_units(head, values[-1])
                numbers[dotted(head, block)] = f"{span}, at the end {last}"
        return numbers | {"events": str(len(self.events))}

    def __repr__(self) -> str:
        return f"Simulation({self.rig.name}: {self.time.size} rows of {', '.join(self._channels)})"


def core_rig(rig: Rig, like: _core.Rig | None = None) -> _core.Rig:
    """The compiled rig of a description, kept with it so that a second simulation costs no
    compilation.

    A rig that differs from another one by the values of its parameters only is that one with other
    values: nothing is read or wired again. Of any other, muscles that are those of ``like`` are not
    compiled again.
    """
    cached: _core.Rig | None = rig.__dict__.get("_compiled")
    if cached is None:
        try:
            cached = _revalued(rig, like)
            if cached is None:
                text = rig.to_json()
                cached = _core.Rig(text) if like is None else like.respecified(text)
        except ParameterError as error:
            known = {name: own.unit for name, own in rig.parameters.items()}
            raise ParameterError(rig.units.retold(str(error), known)) from None
        object.__setattr__(rig, "_compiled", cached)
    return cached


def _revalued(rig: Rig, like: _core.Rig | None) -> _core.Rig | None:
    """Compiled rig of this one's origin with this one's numbers; None where that is impossible."""
    origin, values = rig.__dict__.get("_origin", (None, {}))
    if origin is None:
        return None
    try:
        compiled = core_rig(origin, like)
    except PamrsError:  # what it began from is not possible, this one may be
        return None
    return compiled.revalued(values)


@quantities
def simulate(
    rig: Rig,
    valve_command: Signals | None = None,
    *,
    sample_time: float,
    step: float | None = None,
    initial: Mapping[str, float] | None = None,
    duration: float | None = None,
    supply_command: Signals | None = None,
    length: ArrayLike | None = None,
    pressure: Signals | None = None,
    supply_pressure: Signals | None = None,
    record: Sequence[str] | None = None,
) -> Simulation:
    """Simulate a rig from an initial state by fixed-step RK4.

    Parameters
    ----------
    rig : Rig
        The model.
    valve_command : array_like, shape (n,), or mapping of str to array_like, optional
        Command [V]; entry ``k`` is held over ``[k, k + 1)`` samples. Needed by a rig with a valve;
        of several valves, one for each name. A number is held throughout where another signal or
        ``duration`` says how long.
    sample_time : float
        Time between rows [s].
    step : float, optional
        RK4 step [s]; divides ``sample_time``. By default the longest that does and is at most 1 ms.
        Where the rig is stiffer (small volumes behind large openings, hard stops, a small mass),
        each step is divided until it is stable.
    initial : mapping of str to float, optional
        Initial ``muscle_pressure``, ``supply_pressure``, ``line_pressure``, ``segment_pressure``
        [Pa, gauge], ``segment_flow`` [kg/s], ``joint_angle`` [rad], ``joint_rate`` [rad/s], or with
        a linear load ``length`` [m], ``length_rate`` [m/s]; ``temperature`` of the gas of a chamber
        with an energy balance [K]; of a block with a name, ``muscle_pressure.flexor``. What is left
        out is at rest: pressures as the rig file has them, gases as warm as the room, joint at its
        rest angle, muscle at its rest length.
    duration : float, optional
        Simulated time [s], where no signal has a length.
    supply_command : array_like, shape (n,), or mapping of str to array_like, optional
        Set pressure [Pa, gauge] of a regulator, held like ``valve_command``; its initial pressure
        where it is left out.
    length : array_like, shape (n,), optional
        Length of the muscle at each row [m], straight lines between: what a load frame
        (``[load] kind = "frame"``) prescribes.
    pressure : array_like, shape (n,), or mapping of str to array_like, optional
        Gauge pressure at each row [Pa], straight lines between, of a chamber without a valve.
    supply_pressure : array_like, shape (n,), or mapping of str to array_like, optional
        The same of a supply that is only measured (``[supply] kind = "measured"``); its initial
        pressure stays where it is left out.
    record : sequence of str, optional
        Channels to keep; all by default. Of a rig that runs in lanes (see
        :func:`pamrs.simulate_batch`) states alone (pressures, angles, rates) take a quarter less
        time. ``summary()`` and ``balance`` need all.

    Returns
    -------
    Simulation
        n rows at ``k * sample_time``; the first one is the initial state.

    Raises
    ------
    ParameterError
        If an argument is not finite or outside its range; the message names it.
    RigError
        If a channel of ``record`` is unknown.
    SimulationError
        If the state leaves the range in which the model holds.

    Examples
    --------
    >>> import numpy as np, pamrs
    >>> rig = pamrs.rigs.shoulder()
    >>> result = pamrs.simulate(rig, valve_command=np.full(201, 6.0), sample_time=0.005)
    >>> bool(result["joint_angle"][-1] > result["joint_angle"][0])
    True
    """
    check_run(rig, sample_time)
    wanted = None if record is None else names_of("record", record)
    core = core_rig(rig)
    kept = 1 + len(core.inputs) + len(core.channels if wanted is None else wanted)
    asked = by_signal(valve_command, supply_command, length, pressure, supply_pressure)
    long = [name for name, signal in asked.items() if _is_long(signal)]
    rows = None if duration is None else rows_of(duration, sample_time, long)
    check_rows(kept, rows or 0)
    signals, count = signals_of(rig, asked, rows)
    if count is None:
        raise ParameterError(
            "duration is missing: a finite time >= 0 s is needed (or give valve_command)"
        )
    if count != rows:
        check_rows(kept, count)
    for name, signal in signals.items():
        if channel_of(name) in ("supply_command", "pressure", "supply_pressure"):
            doubt_pascals(name, signal, inside=2)
    start = initial_values(initial, rig)
    held = {
        name: signal
        for name, signal in signals.items()
        if channel_of(name) in ("valve_command", "supply_command")
    }
    driven = prescribed(signals, start)
    channels, events = core.simulate(
        count, driven, sample_time, chosen_step(sample_time, step), start, wanted
    )
    time = np.asarray(np.arange(count) * sample_time, dtype=np.float64)
    return Simulation({"time": time, **held, **channels}, rig, events)


def names_of(argument: str, names: Iterable[str]) -> list[str]:
    """Names as a list; an error names the argument where it is a single string."""
    if isinstance(names, str):
        raise refused(argument, names, "a sequence of names is needed")
    return [str(name) for name in names]


def check_run(rig: Rig, sample_time: float) -> None:
    """Refuse what is not a rig, and a sample time [s] that none can have, for a public function
    that takes quantities.
    """
    check_kind("rig", rig, Rig, "a Rig (pamrs.rigs.shoulder(), pamrs.load_rig(path))")
    check_sample_time(rig, sample_time, inside=3)


def check_rows(channels: int, rows: int) -> None:
    """Refuse a simulation whose channels would not fit in memory, before it starts."""
    if rows * channels > MOST_NUMBERS:
        raise ParameterError(
            f"{rows} rows of {channels} channels are not allowed: at most "
            f"{MOST_NUMBERS // channels} rows (2 GB); give a longer sample_time, or run "
            "pamrs.Simulator piece by piece"
        )


def whole_samples(name: str, value: float, sample_time: float, least: int) -> int:
    """A time [s] as a whole number of samples, ``least`` at least; an error names it."""
    count = (
        round(value / sample_time)
        if isinstance(value, (int, float, np.number)) and np.isfinite(value)
        else -1
    )
    near = abs(count * sample_time - value) <= 1e-6 * sample_time
    if not (least <= count <= MOST_NUMBERS and near):
        raise ParameterError(
            f"{name} = {value} s is not allowed: a multiple of sample_time = {sample_time} s, "
            f"{least} at least, is needed"
        )
    return count


def loop_samples(
    update: Any, sample_time: float, period: float | None, duration: float
) -> tuple[int, int]:
    """Samples of a period [s] and of a whole loop that is closed by calling ``update``."""
    if not callable(update):
        raise ParameterError(
            f"update is a {type(update).__name__}; something that can be called with a sample is "
            "needed"
        )
    every = whole_samples("period", sample_time if period is None else period, sample_time, least=1)
    return every, whole_samples("duration", duration, sample_time, least=0)


def _is_long(signal: Signals | None) -> bool:
    """True where a signal, or one of several, says how many rows there are."""
    each = signal.values() if isinstance(signal, Mapping) else [signal]
    return any(np.ndim(one) > 0 for one in each if one is not None)


def rows_of(duration: float, sample_time: float, setting: Iterable[str]) -> int:
    """Rows of a duration [s], as many as a run may keep at most; signals that set it are refused
    together with it.
    """
    for name in setting:
        raise ParameterError(
            f"duration = {duration} is not allowed together with a signal that sets it ({name})"
        )
    rows = positive("duration", duration, zero=True) / float(sample_time)
    if rows > MOST_NUMBERS:
        raise ParameterError(
            f"duration = {duration:g} s is not allowed: {rows:.3g} rows of sample_time = "
            f"{sample_time:g} s, and at most {MOST_NUMBERS} are"
        )
    return round(rows) + 1


def chosen_step(sample_time: float, step: float | None) -> float:
    """The RK4 step [s] to begin with: the one given, or the longest that divides the sample time
    and is at most 1 ms.
    """
    if step is not None and not isinstance(step, (int, float, np.number)):
        raise refused("step", step, "a time > 0 s is needed")
    return default_step(sample_time) if step is None else float(step)


def default_step(sample_time: float, longest: float = 1e-3) -> float:
    """The longest step [s] that divides a sample time [s] and is at most ``longest``."""
    return sample_time / max(1, int(np.ceil(sample_time / longest - 1e-9)))


#: Numbers that one run may keep: 2 GB.
MOST_NUMBERS = 250_000_000
#: Numbers of one simulation's state: those of some seconds of late commands are in it.
MOST_STATE = 10_000_000
_TELLING_TORQUE = 1.0  # N m
_TELLING_PUSH = 1.0  # N, of one muscle
_TELLING_DEGREES = 1.0
#: Of a valve's half range: recorded commands that scatter about its end are not beyond it.
_BEYOND_RANGE = 0.01
#: Channels of the core that are sums since the start.
_HEAT_BALANCES = ("enthalpy_gained", "heat_gained", "gas_work")
