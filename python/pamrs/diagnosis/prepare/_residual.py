"""Residual of each block with exact sensitivities, and values that no recording says: pressures of
tanks without a gauge, values of each recording, a push of slack muscles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

import numpy as np

from pamrs import _core
from pamrs._arrays import Array, Mask
from pamrs._views import in_laboratory_units
from pamrs.channels import block_of, channel_of, dotted, with_trait
from pamrs.diagnosis.prepare._blocks import Block, Input, available_blocks
from pamrs.diagnosis.prepare._signals import DRIVES, NOISE_STDS, Prepared
from pamrs.errors import SimulationError
from pamrs.recordings import OwnValue, Recording
from pamrs.report.words import format_number, plain
from pamrs.rig import Rig, effect_parameter
from pamrs.rig.schema import qualified
from pamrs.simulation import core_rig, default_step

# [Pa] how far a pressure is followed back to before a recording: a rate at its edge is uncertain
_MOST_MOVED = 2e4


_PRESSURE_CHANNELS: Final = with_trait("pressure")


class TimeBefore(NamedTuple):
    """Assumed time before a recording: commands and pressures stay at their first values, and
    lately the pressures moved at their first rate.

    Attributes
    ----------
    samples, moving : int
        How many there were, and how many of them the pressures moved.
    """

    samples: int
    moving: int

    def commands(self, commands: dict[str, Array], n: int) -> dict[str, Array]:
        """Commands of a recording of `n` samples with those before it."""
        return {
            name: np.concatenate([np.full(self.samples * (values.size // n), values[0]), values])
            for name, values in commands.items()
        }

    def signals(
        self, signals: dict[str, tuple[Array, Array]], prepared: Prepared
    ) -> dict[str, tuple[Array, Array]]:
        """Channels and their time derivatives with those before them."""
        back = prepared.dt * np.minimum(np.arange(self.samples, 0, -1), self.moving)
        extended = {}
        for name, (value, slope) in signals.items():
            first, rate = (float(array[0]) for array in prepared.with_starts(name, [0]))
            was = np.full(self.samples, first)
            if channel_of(name) in _PRESSURE_CHANNELS:
                was -= np.clip(rate * back, -_MOST_MOVED, _MOST_MOVED)
                was = np.maximum(was, min(first, -_MOST_MOVED))
            extended[name] = (
                np.concatenate([was, value]),
                np.concatenate([np.gradient(was, prepared.dt), slope]),
            )
        return extended


# usable samples of a window for each state whose start is projected out, or it is not used
WINDOW_SAMPLES_PER_STATE = 4


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
        wide = (bounds[1] - bounds[0]) / 4.0  # standard deviations
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


def _without_starts(columns: list[Array], starts: list[tuple[int, int, Array]]) -> Array:
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
    for _ in range(5):  # until it stands still
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
        An input of the block in addition to what its model makes; the residual then has a
        `response`.
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
    of_recording = _without_starts([np.where(rows, v, 0.0) for v in every], freed.starts)
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


def _begins_at(gauge: str) -> str:
    """Dotted name of the pressure at which the supply of a gauge begins."""
    return f"{qualified('supply', gauge.partition('.')[2])}.initial_pressure"


def tanks_without_gauge(rig: Rig, channels: Sequence[str]) -> list[str]:
    """Channels of tanks that nobody measured and whose pressure can be simulated, since what they
    feed and what is commanded there is recorded.
    """
    tanks = [name for name, table in rig.tables("supply").items() if table["kind"] == "tank"]
    gauges = [dotted("supply_pressure", name) for name in tanks]
    missing = [gauge for gauge in gauges if gauge not in channels]
    with_gauges = {b.channel for b in available_blocks(rig, (*channels, *missing))}
    return [gauge for gauge in missing if gauge in with_gauges]


def blocks_with_tanks(rig: Rig, channels: tuple[str, ...]) -> list[Block]:
    """The blocks that these channels can tell apart (:func:`available_blocks`), those driven by the
    simulated pressure of a tank included, the tank itself not.
    """
    tanks = tanks_without_gauge(rig, channels)
    no_gauge = {f"{qualified('supply', t.partition('.')[2])}.pressure_zero" for t in tanks}
    return [
        replace(
            block,
            floating=tuple(name for name in block.drives if name in tanks),
            parameters=block.parameters - no_gauge,
        )
        for block in available_blocks(rig, (*channels, *tanks))
        if block.channel not in tanks
    ]


def with_tanks(rig: Rig, core: _core.Rig, prepared: Prepared, tanks: Sequence[str]) -> Prepared:
    """A recording with the simulated pressures of its tanks without a gauge: from the pressure of
    the rig file, or of the recording where it has one of its own, under what it draws from them.

    Parameters
    ----------
    rig : Rig
        The nominal model.
    core : _core.Rig
        The same, compiled.
    prepared : Prepared
        The recording.
    tanks : sequence of str
        From :func:`tanks_without_gauge`.
    """
    names = tuple(prepared.recording.channels)
    for tank in tanks:
        name = block_of(tank)
        full = qualified("supply", name)
        own_pressure = prepared.recording.parameters.get(_begins_at(tank))
        first = (
            rig.parameter(_begins_at(tank)).value if own_pressure is None else own_pressure.value
        )
        level = np.full(prepared.n, first)
        flat = replace(
            prepared.with_signals({tank: (level, np.zeros(prepared.n))}),
            raw=prepared.raw | {tank: level},
            noise=prepared.noise | {tank: 0.0},
            lengths=prepared.lengths | {tank: np.zeros(prepared.n, dtype=np.intp)},
            simulated=tuple(dict.fromkeys((*prepared.simulated, tank))),
        )
        available = available_blocks(rig, (*names, *flat.simulated))
        (tank_block,) = [replace(b, window=None) for b in available if b.name == full]
        try:
            value = predicted(tank_block, core, flat.bridged())
        except SimulationError:  # it then stands still
            value = level
        slope = np.gradient(value, prepared.dt)
        prepared = flat.with_signals({tank: (value, slope)})
    return prepared


def notes_on_tanks(rig: Rig, blocks: Sequence[Block], recordings: Sequence[Prepared]) -> list[str]:
    """Sentences on tanks without a gauge: the blocks that their simulated pressure drives."""
    notes = []
    for tank in dict.fromkeys(name for block in blocks for name in block.floating):
        name = _begins_at(tank)
        own_pressures = [
            p.recording.parameters[name] for p in recordings if name in p.recording.parameters
        ]
        first = rig.units.said(name, "Pa", rig.parameter(name).value)
        if own_pressures:
            first = "the pressure that each recording has of its own"
        driven = " and ".join(block.name for block in blocks if tank in block.floating)
        notes.append(
            f"{tank} was not recorded: {driven} is driven by its simulated course from "
            f"{first}; its level and how far it falls are free in each recording"
        )
    return notes


_OWN_APART = 1.5  # ratio of such values between recordings from which it is said
_BEGINS = "initial_pressure"


def varying(rig: Rig, core: _core.Rig) -> set[str]:
    """Dotted names of parameters that may have another value in each recording; pressures at which
    a recording begins are among them.
    """
    begin = (f"{qualified(k, n)}.{_BEGINS}" for k in ("supply", "chamber") for n in rig.tables(k))
    return {*core.parameter_names, *begin}


def with_declared_values(rig: Rig, recordings: Sequence[Recording]) -> list[Recording]:
    """Recordings with the values that the rig file leaves to each of them, where they do not say
    them, all under the names that the core has.
    """
    nominal = {name: _nominal(rig, name) for name in rig.own}
    nominal_values = {
        _core_name(rig, n): OwnValue(value, value, "own") for n, value in nominal.items()
    }
    return [
        replace(
            r, parameters=nominal_values | {_core_name(rig, n): v for n, v in r.parameters.items()}
        )
        if nominal_values or r.parameters
        else r
        for r in recordings
    ]


def _core_name(rig: Rig, name: str) -> str:
    """A parameter as the core has it: of an effect that is the only one of its id, without the
    block at which it acts.
    """
    parameter = effect_parameter(rig, name)
    return name if parameter is None else ".".join(parameter[:2])


def _nominal(rig: Rig, name: str) -> float:
    """Value in the rig file of one of its parameters, or of a parameter of one of its effects."""
    parameter = effect_parameter(rig, name)
    if parameter is None:
        return rig.parameter(name).value
    _, short, entry = parameter
    return float(entry["parameters"][short])


def with_own_values(
    blocks: Sequence[Block],
    rig: Rig,
    core: _core.Rig,
    prepared: Prepared,
    tanks: Sequence[str],
) -> Prepared:
    """Recording with the values of its own that fit it best, all others being nominal; around them
    they stay free, a tank's by its level.

    Steps of Gauss and Newton on the blocks that depend on them, each kept where it leaves less.

    Parameters
    ----------
    blocks : sequence of Block
        Those that can be judged.
    rig : Rig
        The nominal model.
    core : _core.Rig
        The same, compiled.
    prepared : Prepared
        The recording.
    tanks : sequence of str
        Channels of tanks without a gauge.
    """
    own_values = {n: v for n, v in prepared.recording.parameters.items() if v.error == "own"}
    tank_of = {_begins_at(tank): tank for tank in tanks if _begins_at(tank) in own_values}
    free = [name for name in own_values if name in core.parameter_names]
    every = [*free, *tank_of]
    if not every:
        return prepared
    dependent = [
        replace(b, floating=tuple(tank for tank in b.floating if tank not in tank_of.values()))
        for b in blocks
    ]

    def at(values: Array) -> Prepared:
        put = {
            n: replace(own_values[n], value=float(v)) for n, v in zip(every, values, strict=True)
        }
        parameters = prepared.recording.parameters | put
        with_values = replace(
            prepared, recording=replace(prepared.recording, parameters=parameters)
        )
        return with_tanks(rig, core, with_values, tanks)

    def rows_at(values: Array, names: list[str]) -> tuple[Array, Array]:
        with_values = at(values)
        fixed = {
            n: replace(v, error="same") if n in own_values else v
            for n, v in with_values.recording.parameters.items()
        }
        held = replace(with_values, recording=replace(with_values.recording, parameters=fixed))
        block_residuals = [residual(block, core, held, names) for block in dependent]
        slopes = [r.jacobian / r.noise for r in block_residuals if r.jacobian is not None]
        rows = np.concatenate([r.value / r.noise for r in block_residuals])
        return rows, np.concatenate(slopes) if slopes else np.zeros((rows.size, 0))

    def misfit(values: Array) -> tuple[float, Array, Array]:
        rows, slopes = rows_at(values, free)
        moved = []
        for k in range(len(free), values.size):
            step = 1e-3 * max(abs(values[k]), 1e5)  # of a pressure, for the slope
            shaken = rows_at(values + step * (np.arange(values.size) == k), [])[0]
            moved.append((rows - shaken) / step)
        return float(rows @ rows), rows, np.column_stack([slopes, *moved])

    values = np.array([own_values[name].value for name in every])
    try:
        size, rows, slopes = misfit(values)
    except SimulationError:
        return prepared  # the fit says what cannot be predicted
    for _ in range(12):  # each at most a factor 3: three orders and a few to settle
        scale = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
        step = np.linalg.lstsq(slopes / scale, rows, rcond=1e-9)[0] / scale
        # what is positive stays so: by no more than to a third or to three times at once
        wanted = values + step
        wanted = np.where(values > 0.0, np.clip(wanted, values / 3.0, values * 3.0), wanted)
        try:
            now, more_rows, more_slopes = misfit(wanted)
        except SimulationError:
            break
        if not now < size:
            break
        done = size - now < 1e-3 * size
        values, size, rows, slopes = wanted, now, more_rows, more_slopes
        if done:
            break
    return at(values)


def notes_on_own_values(recordings: Sequence[Prepared]) -> list[str]:
    """Values that recordings have of their own, in words, and how far they are from each other."""
    values_of: dict[str, dict[str, float]] = {}
    notes = []
    simulated = {_begins_at(tank) for p in recordings for tank in p.simulated}
    for name, recording in {p.recording.name: p.recording for p in recordings}.items():
        for parameter, value in recording.parameters.items():
            if value.error == "own":
                values_of.setdefault(parameter, {})[name] = value.value
    for parameter in [n for n in values_of if n.endswith(f".{_BEGINS}") and n not in simulated]:
        notes.append(f"{parameter}: its gauge says where each recording begins")
        del values_of[parameter]
    for parameter, values in values_of.items():
        low, high = min(values.values()), max(values.values())
        listed = ", ".join(f"{plain(format_number(v))} in {n}" for n, v in values.items())
        apart = (
            f"; the largest is {high / low:.2g} times the smallest"
            if low > 0.0 and high / low > _OWN_APART
            else ""
        )
        notes.append(f"{parameter} is free in each recording: {listed} (SI){apart}")
    return notes


_LEAST_SLACK_SHARE = 0.01  # of the samples of a recording in which it has to
CLEARLY_LESS = 0.5  # share of an error below which what another model leaves is clearly less


def notes_on_slack(rig: Rig, blocks: Sequence[Block], recordings: Sequence[Prepared]) -> list[str]:
    """Sentences on models that lag where muscles are slack, and would follow if these pushed.

    Returns
    -------
    list of str
        A sentence for each block, of the recording in which it lags most.
    """
    tables = rig.tables("muscle").items()
    slack = [qualified("muscle", name) for name, table in tables if table["buckling_load"] == 0.0]
    moving = [block for block in blocks if block.kind == "arm"]
    if not slack or not moving:
        return []
    # [N] what no muscle reaches: it pushes back as its force model says
    loads = {f"{name}.buckling_load": 1e9 for name in slack}
    cores = core_rig(rig), core_rig(rig.with_parameters(loads))
    notes = []
    for block in moving:
        lags = {p.recording.name: _lag(block, cores, p) for p in recordings}
        name, most = max(lags.items(), key=lambda lag: lag[1][0])
        if not most[0]:
            continue
        off, rest = (in_laboratory_units(block.channel, value) for value in most)
        notes.append(
            f"the model lags where a muscle is slack: {block.channel} of {name} is up to {off} "
            f"off there, and {rest} if {' and '.join(slack)} pushed back as the force model alone "
            "says; a muscle without air pushes nothing but what its buckling_load (now 0 N) says "
            "that it bears"
        )
    return notes


def _lag(
    block: Block, cores: tuple[_core.Rig, _core.Rig], prepared: Prepared
) -> tuple[float, float]:
    """The most by which a slack model misses what moved, and what a push leaves of that; nothing
    where a push does not explain most of it.
    """
    try:
        slack, pushing = (predicted(block, core, prepared) for core in cores)
    except SimulationError:
        return 0.0, 0.0
    starts = prepared.starts(block.window, block.drives)
    rows = prepared.usable(block.channel, block.drives, starts)
    rows &= np.abs(pushing - slack) > NOISE_STDS * prepared.noise[block.channel]
    measured = prepared.recording.channels[block.channel][rows]
    lag, rest = measured - slack[rows], measured - pushing[rows]
    rare = rows.sum() < _LEAST_SLACK_SHARE * prepared.n
    if rare or np.linalg.norm(rest) > CLEARLY_LESS * np.linalg.norm(lag):
        return 0.0, 0.0
    return float(np.abs(lag).max()), float(np.abs(rest).max())
