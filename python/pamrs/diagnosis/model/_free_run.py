"""Simulation of the whole rig from its commands alone, and its error by channel."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2

from pamrs._arrays import Array
from pamrs.channels import channel_of, dotted, recorded_as, unit_of
from pamrs.diagnosis.fit import Events, Key, Problem, Stages, known_parameters, with_known
from pamrs.diagnosis.noise import NoiseLevel
from pamrs.diagnosis.prepare import Block, Prepared, Residual
from pamrs.effects import EFFECTS, find_parameter, ports_of
from pamrs.errors import PamrsError, RecordingError
from pamrs.findings import MOST_MISSED, FreeRun, FreeRunError, Trace
from pamrs.recordings import Recording
from pamrs.rig import Rig
from pamrs.simulation import Simulation, core_rig, differences, replay

# times more than its block that the whole rig misses of a freed constant before that is said
_FAR_ALONE = 5.0
# chance of values so far from what is known as explain what the whole rig misses
_OFF_CHANCE = 0.05
# [K] deviation of a gas's start that nothing tells: filled and vented it is 4 to 28 K off
_OFF_WARM = 20.0
# samples of a channel that compare what the whole rig misses: a course of some seconds
_OFF_ROWS = 2000
# samples of a log by which missed values are asked: each costs a run of all of them
_OFF_SAMPLES = 200_000
# steps in which values as likely as that are looked for by which the whole rig misses less
_OFF_STEPS = 2


@dataclass(frozen=True, eq=False)
class KnownValues:
    """Values of a rig, with a root of their covariance.

    Attributes
    ----------
    names : tuple of str
        Dotted names, k of them.
    values : (k,) array
        SI.
    root : (k, k) array
        A square root of their covariance: values plus `root` times normal numbers are as likely.
    """

    names: tuple[str, ...]
    values: Array
    root: Array


_FREED = ("muscle_force", "joint_torque", "temperature")
"""Channels whose constant is fitted to each recording."""

_RUN_COMMANDS = ("valve_command", "supply_command", "pressure_command")
"""Channels that drive a free run."""


def free_run(
    problem: Problem,
    by_stage: Stages,
    nominal: Rig,
    final: Rig,
    events: Events | None,
    known: KnownValues | None = None,
    noise_level: Mapping[Key, NoiseLevel] | None = None,
) -> tuple[list[FreeRun] | None, str, list[Trace]]:
    """Errors of free-running simulations of every recording.

    A simulation begins at the recording's first usable values, its gases as warm as the room or as
    their thermometers or pressures say, and then knows its commands only. It
    costs a few hundredths of a second for each recording and model, and raises nothing: a model
    that leaves its range has no number and a note that says so.

    Parameters
    ----------
    problem : Problem
        Held-out recordings (those that were fitted, where there are no others).
    by_stage : dict of str to dict
        Residuals of the cut chain by stage (``before``, ``after``), block and recording.
    nominal, final : Rig
        The model of the rig file, and the one with what was found.
    events : Events or None
        What happened in single recordings, instead of what `final` says.
    known : KnownValues, optional
        What is known of the values of `final`; without it no channel is said to be off.
    noise_level : dict of NoiseLevel, optional
        By block and recording; that of the sensors alone where there is none.

    Returns
    -------
    tuple of (list of FreeRun or None, str, list of Trace)
        One entry for each recording that could be simulated, and a note on them; None and the
        reason where no recording has the commands that the rig needs. The curves of the recording
        that the nominal model misses most, in noise levels, channel by channel.
    """
    runs, missing, curves, most = [], [], list[Trace](), -1.0
    for prepared in (_with_starts(p, problem, by_stage["after"]) for p in problem.recordings):
        recording = prepared.recording
        try:
            model = final if events is None else events.put_into(final, recording.name)
            run, drawn = _run_of_recording(
                prepared, problem, by_stage, nominal, model, noise_level or {}
            )
            runs.append(_with_off_channels(run, prepared, problem.blocks, model, known))
            missed = max((e.times_before for e in run.channels.values()), default=0.0)
            if missed > most:
                most, curves = missed, drawn
        except RecordingError as error:  # it lacks a command
            missing.append(str(error))
    if not runs:
        return None, "no free run: " + "; ".join(missing), []
    return runs, "without a free run: " + "; ".join(missing) if missing else "", curves


def _with_starts(
    prepared: Prepared, problem: Problem, block_residuals: dict[Key, Residual]
) -> Prepared:
    """A recording with the temperatures at which its gases began, as their blocks have them."""
    starts = {
        b.channel: block_residuals[b.name, prepared.recording.name].temperature
        for b in problem.blocks
    }
    return replace(prepared, temperatures={n: kelvin for n, kelvin in starts.items() if kelvin})


def _run_of_recording(
    prepared: Prepared,
    problem: Problem,
    by_stage: Stages,
    nominal: Rig,
    final: Rig,
    noise_level: Mapping[Key, NoiseLevel],
) -> tuple[FreeRun, list[Trace]]:
    """The free run of one recording, and its curves."""
    recording = prepared.recording
    logged = _as_logged(recording)
    first = _errors(nominal, prepared, logged)
    last = first if final is nominal else _errors(final, prepared, logged)
    (before, why, one), (after, why_after, other) = first, last
    notes = [f"nominal model: {why}"] if why else []
    notes += [f"with what was found: {why_after}"] if why_after and final is not nominal else []
    covering = {b.channel: b.name for b in problem.blocks}
    known = {c: noise_level.get((block, recording.name)) for c, block in covering.items()}
    noise = prepared.noise | {c: level.sample for c, level in known.items() if level}

    def cut(stage: str, channel: str) -> float | None:
        block = covering.get(recorded_as(channel))
        if block is None:
            return None
        residual = by_stage[stage][block, recording.name]
        values = residual.value[residual.rows]
        return math.sqrt(float(np.mean(values**2))) if values.size else None

    channels = list(before | after)
    curves = [_curves(logged, channel, one, other) for channel in channels]
    entry = FreeRun(
        recording=recording.name,
        role=recording.role,
        seconds=float(recording.time[-1] - recording.time[0]),
        channels={
            channel: FreeRunError(
                unit=unit_of(channel),
                before=before.get(channel, math.nan),
                after=after.get(channel, math.nan),
                cut_before=cut("before", channel),
                cut_after=cut("after", channel),
                noise=noise.get(recorded_as(channel)),
            )
            for channel in channels
        },
        note="; ".join(notes),
    )
    return entry, curves


def _with_off_channels(
    run: FreeRun,
    prepared: Prepared,
    blocks: Sequence[Block],
    final: Rig,
    known: KnownValues | None,
) -> FreeRun:
    """Free run with its channels marked that noise and uncertain values do not explain.

    A motion that its block follows from the measured pressures has its miss from the pressures of
    the run: it is off where one of them is.
    """
    doubtful = [
        name
        for name, e in run.channels.items()
        if e.noises > MOST_MISSED and channel_of(name) not in _FREED
    ]
    if known is None or not doubtful:
        return run
    clocks = [effect["parameters"] for effect in final.effects if "clock" in ports_of(effect)]
    if any(min(p["offset"], p["offset"] + p["rate"] * run.seconds) < 0.0 for p in clocks):
        note = "a clock ahead of its commands cannot be simulated: what is missed says nothing"
        return replace(run, note=f"{run.note}; {note}" if run.note else note)
    logged, note = _as_logged(prepared.recording), run.note
    if len(logged) > _OFF_SAMPLES:
        logged = logged.between(stop=float(logged.time[_OFF_SAMPLES]))
        part = f"whether it is off was asked of its first {logged.duration:.4g} s"
        note = f"{note}; {part}" if note else part
    # drives bring noise into a block, and so into what its channel's error is compared with
    levels = {recorded_as(n): level for n in doubtful if (level := run.channels[n].noise)}
    least = _least_misses(prepared, logged, final, known, prepared.noise | levels)
    off = {n for n in doubtful if least.get(n, math.inf) > MOST_MISSED}
    far = {recorded_as(name) for name in off}
    drives = {b.channel: far.intersection(b.drives) for b in blocks if b.mechanical}
    for name in list(off):
        cut, noise = run.channels[name].cut_after, run.channels[name].noise or 0.0
        follows = cut is not None and cut <= MOST_MISSED * noise
        if follows and not drives.get(recorded_as(name), far):
            off.discard(name)
    channels = {n: replace(e, off=n in off) for n, e in run.channels.items()}
    return replace(run, channels=channels, note=note)


def _least_misses(
    prepared: Prepared,
    logged: Recording,
    final: Rig,
    known: KnownValues,
    noise: Mapping[str, float],
) -> dict[str, float]:
    """Least error of a free run by channel [noise levels], over likely values of the rig, commands
    up to a sample earlier or later, and gases that begin warmer or colder.

    Steps of Gauss and Newton inside that distance, each tried by a simulation.
    """
    starts, count = _gas_starts(final, prepared), len(known.names)
    of_file = known_parameters(final)
    bounds = [of_file.get(name) or find_parameter(name) for name in known.names]
    low, high = (np.array([getattr(p, end) for p in bounds]) for end in ("lower", "upper"))
    compared = _compared(prepared, logged)

    def run(moved: Array) -> dict[str, Array]:
        allowed = np.clip(known.values + known.root @ moved[:count], low, high)
        values = dict(zip(known.names, allowed.tolist(), strict=True))
        # within its sample, one standard deviation being half of it
        late = _with_late_commands(logged, 0.5 * float(moved[count]))
        warm = zip(starts.items(), moved[count + 1 :].tolist(), strict=True)
        begins = {name: start.kelvin + start.unsure * away for (name, start), away in warm}
        start = with_known(final, values)
        return _misses(start, late, begins, compared, noise, _OFF_ROWS)

    at, least = np.zeros(count + 1 + len(starts)), dict[str, float]()
    with contextlib.suppress(PamrsError, ArithmeticError):  # a model that leaves its range
        for _ in range(_OFF_STEPS + 1):
            now = run(at)
            sizes = {name: float(np.sqrt(np.mean(v**2))) for name, v in now.items()}
            least = {name: min(size, least.get(name, size)) for name, size in sizes.items()}
            if max(least.values()) <= MOST_MISSED:
                break
            at = _least_missing_step(run, at, now)
    return least


def _least_missing_step(
    run: Callable[[Array], dict[str, Array]],
    at: Array,
    now: dict[str, Array],
) -> Array:
    """Values within their likely distance at which a linearised free run misses least."""
    here = np.concatenate(list(now.values()))
    slopes = np.zeros((here.size, at.size))
    for k in range(at.size):
        step = np.zeros(at.size)
        step[k] = -0.5 if at[k] > 0.0 else 0.5
        with contextlib.suppress(PamrsError, ArithmeticError):  # it has no slope there
            stepped = run(at + step)
            slopes[:, k] = (np.concatenate([stepped[n] for n in now]) - here) / step[k]
    axes, size, directions = np.linalg.svd(slopes, full_matrices=False)
    wanted = axes.T @ (slopes @ at - here)  # along each axis, as an offset from what is known
    # as far as a draw is in as many directions as are seen
    shown = int(np.sum(size > MOST_MISSED * math.sqrt(here.size / len(now))))
    most = float(chi2.isf(_OFF_CHANCE, max(1, shown)))

    def far(ridge: float) -> Array:
        return np.asarray(size * wanted / (size**2 + ridge))

    tiny = float(size[0] ** 2) * 1e-12 + 1e-300
    low, high = math.log(tiny), math.log(tiny * 1e24)
    if float(np.sum(far(tiny) ** 2)) > most:
        low = brentq(lambda r: float(np.sum(far(math.exp(r)) ** 2)) - most, low, high)
    return np.asarray(directions.T @ far(math.exp(low)))


class _StartTemperature(NamedTuple):
    """Temperature at which a gas begins, and its standard deviation [K]."""

    kelvin: float
    unsure: float


def _gas_starts(rig: Rig, prepared: Prepared) -> dict[str, _StartTemperature]:
    """Temperature at which each gas with a balance of energy begins, by chamber: that of the room,
    but where its thermometer or its pressure clearly says otherwise.
    """
    settings = prepared.settings
    room, starts = float(rig.tables("gas")[""]["temperature"]), {}
    for name, table in rig.tables("chamber").items():
        if table["gas"] != "energy_balance":
            continue
        read = prepared.signals.get(dotted("temperature", name))
        fitted = prepared.temperatures.get(dotted("muscle_pressure", name), room)
        begins = fitted if read is None else float(read[0][0])
        away = abs(begins - room) > settings.begun_temperature_error
        # a pressure that stands still does not tell
        unsure = settings.begun_temperature_error if away or read is not None else _OFF_WARM
        starts[name] = _StartTemperature(begins if away else room, unsure)
    return starts


def _measured(rig: Rig, recording: Recording) -> list[str]:
    """Channels of a run that a recording has as well."""
    return [name for name in core_rig(rig).channels if recorded_as(name) in recording.channels]


def _misses(
    rig: Rig,
    driving: Recording,
    begins: Mapping[str, float],
    logged: Recording,
    noise: Mapping[str, float],
    most: int,
) -> dict[str, Array]:
    """Errors of a free run by measured channel, in units of its noise, at some `most` samples."""
    result = replay(rig, driving, temperatures=begins, record=_measured(rig, logged))
    out = {}
    for name in differences(result, logged):
        channel = recorded_as(name)
        rows = np.flatnonzero(logged.mask[channel])
        rows = rows[:: max(1, rows.size // most)]
        level = noise.get(channel, 0.0)
        if level > 0.0:
            out[name] = (result[name][rows] - logged.channels[channel][rows]) / level
    return out


def _with_late_commands(recording: Recording, samples: float) -> Recording:
    """A recording whose commands come some samples later (or earlier)."""
    if samples == 0.0:
        return recording
    at = np.arange(len(recording), dtype=np.float64)
    moved = {
        name: np.interp(at - samples, at, values)
        for name, values in recording.channels.items()
        if channel_of(name) in _RUN_COMMANDS
    }
    return replace(recording, channels=recording.channels | moved)


def notes_on_constants(runs: Sequence[FreeRun], effects: Sequence[str]) -> list[str]:
    """Channels that the whole rig misses by far more than their blocks do, in words: what is
    constant in a recording is fitted to each, and no block is judged by it.

    Parameters
    ----------
    runs : sequence of FreeRun
        Of the recordings that were held out, or of all.
    effects : sequence of str
        What was found: the free run takes readings as they are, so that those of a sensor explain
        a difference of their own.
    """
    if any(EFFECTS[effect].block == "sensors" for effect in effects):
        return []
    worst: dict[str, tuple[float, FreeRunError, str]] = {}
    for run in runs:
        for channel, error in run.channels.items():
            if channel_of(channel) not in _FREED or not error.cut_after:
                continue
            times = error.after / error.cut_after
            if times > max(_FAR_ALONE, worst.get(channel, (0.0, error, ""))[0]):
                worst[channel] = (times, error, run.recording)
    return [
        f"{channel} of the whole rig is {error.after:.3g} {error.unit} off in {name!r} (root mean "
        f"square), that of its block {error.cut_after:.2g} {error.unit}: what is constant in a "
        "recording (a zero of the sensor, a dead weight, an effect that does the same all the "
        "time) is fitted to each recording and is not judged"
        for channel, (_, error, name) in worst.items()
    ]


def _compared(prepared: Prepared, logged: Recording) -> Recording:
    """A recording at the rate of its log without the beginnings that no block is judged by."""
    masks, time = dict(logged.mask), logged.time - logged.time[0]
    for channel, count in prepared.unsettled.items():
        masks[channel] = masks[channel] & (time >= count * prepared.dt)
    return replace(logged, mask=masks)


def _as_logged(recording: Recording) -> Recording:
    """A recording of means at the rate of its log: commands as they were, measurements at the
    instants that the means belong to.
    """
    if not recording.commands:
        return recording
    count = max(v.size for v in recording.commands.values()) // len(recording)
    size = len(recording) * count
    at = np.arange(size) % count == 0
    step = recording.sample_time / count
    channels = {name: np.repeat(v, count) for name, v in recording.channels.items()}
    masks = {name: np.repeat(v, count) & at for name, v in recording.mask.items()}
    return replace(
        recording,
        time=np.arange(size, dtype=np.float64) * step,
        sample_time=step,
        channels=channels | recording.commands,
        mask=masks | {name: np.ones(size, dtype=bool) for name in recording.commands},
        commands={},
    )


def _curves(
    logged: Recording, channel: str, before: Simulation | None, after: Simulation | None
) -> Trace:
    """A channel as it was measured and as both models give it."""
    recorded, nothing = recorded_as(channel), np.full(len(logged), np.nan)
    return Trace(
        logged.name,
        logged.role,
        channel,
        unit_of(channel),
        logged.time,
        np.where(logged.mask[recorded], logged.channels[recorded], np.nan),
        nothing if before is None else before[channel],
        after=None if after is None else after[channel],
    )


def _errors(
    rig: Rig, prepared: Prepared, logged: Recording
) -> tuple[dict[str, float], str, Simulation | None]:
    """Root mean square error of each measured channel, and why there is none; the simulation."""
    try:
        begins = {name: begin.kelvin for name, begin in _gas_starts(rig, prepared).items()}
        run = replay(rig, logged, temperatures=begins, record=_measured(rig, logged))
        return differences(run, _compared(prepared, logged)), "", run
    except RecordingError:
        raise
    except (PamrsError, ArithmeticError) as error:
        return {}, str(error), None
