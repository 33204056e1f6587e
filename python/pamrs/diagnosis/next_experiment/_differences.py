"""Differences between models in the cut chain, after all free parameters are fitted again.

Residuals are counted in bins of 0.1 s in units of the noise level that the noise of the sensors
(output and drives) leaves there, and a recording as a modest number of independent ones: errors of
a model are autocorrelated, and a recording of 6000 samples does not know a difference of a
thousandth of its noise. Baseline parameters move inside their tolerances, an effect's own
parameters inside what is known of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pamrs._arrays import Array, solve_normal
from pamrs.channels import CHANNELS, DRIVEN_COMMANDS, channel_of
from pamrs.diagnosis.fit import Key, Problem, free_baseline, residuals
from pamrs.diagnosis.limits import counted
from pamrs.diagnosis.noise import (
    bins_of,
    curve_errors_of,
    noise_levels,
    whitening,
)
from pamrs.diagnosis.prepare import (
    Prepared,
    Residual,
    available_blocks,
    binned,
    prepare,
    thermometers_of,
    with_unjudged_starts,
)
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.errors import DiagnosisError, ParameterError, SimulationError
from pamrs.recordings import Recording
from pamrs.rig import Rig, named_entries
from pamrs.simulation import Simulation, core_rig, has_frame, reading

# realisations of the drives' noise for an experiment's noise level: a fifth is enough
REPLICATES = 4
# relative standard deviation of an effect's parameter of which a model says none
_UNSTATED_STD_SHARE = 0.5


def usual_noise() -> dict[str, float]:
    """Sample noise of usual transducers by channel [SI]."""
    return {name: row.noise for name, row in CHANNELS.items() if row.noise}


def noise_of(rig: Rig, given: Mapping[str, float] | None = None) -> dict[str, float]:
    """Sample noise of every channel of a rig that the cut chain uses [SI]: that of usual
    transducers, where none is given for the channel, or for all of its kind.
    """
    usual = usual_noise() | dict(given or {})
    names = [name for kind in usual_noise() for name in measurable(rig, kind)]
    return {name: usual.get(name, usual[channel_of(name)]) for name in names}


def measurable(rig: Rig, kind: str = "") -> tuple[str, ...]:
    """Channels of a rig that the cut chain uses, of one kind or of all: ``valve_command.flexor``,
    ``muscle_pressure.flexor``, ``joint_angle.elbow``; the temperature of a gas that has one of its
    own; a load frame has a cell for the force.
    """
    core, warm = core_rig(rig), thermometers_of(rig).values()
    cell = ("force",) if has_frame(rig) else ()
    every = dict.fromkeys((*core.inputs, *core.channels, *cell))
    has = [name for name in every if channel_of(name) != "temperature" or name in warm]
    kinds = (kind,) if kind else (*DRIVEN_COMMANDS, *usual_noise())
    return tuple(name for one in kinds for name in has if channel_of(name) == one)


def checked_channels(rig: Rig, channels: tuple[str, ...]) -> tuple[str, ...]:
    """The channels that are given, or an error that names one that is unknown or not of this rig; a
    name without that of a block stands for all of its kind.

    Raises
    ------
    ParameterError
        For a channel that the cut chain does not use, or that this rig does not have.
    """
    own = measurable(rig)
    kinds = {channel_of(name) for name in own}
    for name in channels:
        if name not in own and name not in kinds:
            raise ParameterError(
                f"channels has {name!r}, which is not allowed: of rig {rig.name!r} one of "
                f"{', '.join(own)}"
            )
    return tuple(name for name in own if name in channels or channel_of(name) in channels)


def taken(
    run: Simulation,
    rig: Rig,
    name: str,
    noise: Mapping[str, float],
    settings: DiagnosisSettings,
    *,
    rng: np.random.Generator | None = None,
) -> Prepared:
    """A simulation as a recording that is ready for the cut chain.

    Parameters
    ----------
    run : Simulation
        What happened.
    rig : Rig
        The rig whose blocks are to be cut.
    name : str
        What to call it.
    noise : mapping of str to float
        Sample noise by channel [SI]; channels without one are left out.
    settings : DiagnosisSettings
        How it is made ready.
    rng : numpy.random.Generator, optional
        Adds that noise; none by default.
    """
    names = [c for c in measurable(rig) if channel_of(c) in DRIVEN_COMMANDS or c in noise]
    channels = {c: v for c in names if (v := reading(run, c)) is not None}
    if rng is not None:
        channels = {
            c: v + rng.normal(0.0, noise[c], v.size) if c in noise else v
            for c, v in channels.items()
        }
    mask = {c: np.ones(v.size, dtype=bool) for c, v in channels.items()}
    time = np.asarray(run.time, dtype=np.float64)
    recording = Recording(name, "fit", time, float(time[1] - time[0]), channels, mask, [], {})
    prepared = prepare(recording, rig, settings)
    return replace(prepared, noise={c: float(noise[c]) for c in prepared.noise})


def problem_of(
    rig: Rig, recordings: list[Prepared], channels: tuple[str, ...], settings: DiagnosisSettings
) -> Problem:
    """Blocks that channels can tell apart, with recordings.

    Parameters
    ----------
    rig : Rig
        Nominal model.
    recordings : list of Prepared
        Ready for the cut chain.
    channels : tuple of str
        Measured ones.
    settings : DiagnosisSettings
        Windows and steps of the blocks, and what the problem is solved by.

    Raises
    ------
    DiagnosisError
        If they surround no block.
    """
    blocks = available_blocks(rig, channels)
    if not blocks:
        raise DiagnosisError(
            f"channels = {', '.join(channels) or 'none'} do not surround any block of rig "
            f"{rig.name!r} ({', '.join(rig.blocks)}); measure muscle_pressure, and supply_pressure "
            "and joint_angle where the rig has them"
        )
    core = core_rig(rig)
    return Problem(
        blocks, [with_unjudged_starts(blocks, core, p) for p in recordings], core, settings
    )


def judged_alike(problems: Sequence[Problem]) -> list[Problem]:
    """Problems whose recordings of one experiment are judged from the same sample on: the last one
    at which any of them still depends on a beginning that nobody measured.
    """
    latest: dict[str, int] = {}
    for prepared in (p for problem in problems for p in problem.recordings):
        for channel, count in prepared.unsettled.items():
            latest[channel] = max(count, latest.get(channel, 0))
    if not latest:
        return list(problems)
    return [
        replace(problem, recordings=[replace(p, unsettled=latest) for p in problem.recordings])
        for problem in problems
    ]


@dataclass(frozen=True, eq=False)
class ResidualDifference:
    """Difference between a model and recordings after its free parameters are fitted out.

    Attributes
    ----------
    rms : dict
        By block and recording: root mean square of bin means [noise levels].
    rows : dict
        By block and recording: the difference in each bin [channel's unit].
    total : float
        Sum of squares on the effective number of samples, the priors' share included.
    """

    rms: dict[Key, float]
    rows: dict[Key, Array]
    total: float

    @property
    def largest(self) -> tuple[Key, float]:
        """Block and recording with the largest difference, and that difference [noise levels]."""
        key = max(self.rms, key=lambda k: self.rms[k])
        return key, self.rms[key]


def _free(problem: Problem, rig: Rig) -> dict[str, float]:
    """Parameters that may move, with the standard deviation of what is known [SI]."""
    out = {name: rig.parameter(name).tol for name in free_baseline(problem, rig.without_effect())}
    known = set(core_rig(rig).parameter_names)
    for label, effect in named_entries(rig):
        spread = rig.effect_std.get(label, {})
        for parameter, given in effect["parameters"].items():
            name, value = f"{label}.{parameter}", abs(given)
            std = spread.get(parameter, _UNSTATED_STD_SHARE * value)
            if name in known and math.isfinite(std) and std > 0.0:
                out[name] = min(std, 2.0 * value) if value > 0.0 else std
    return out


@dataclass(frozen=True, eq=False)
class Linear:
    """Model linearised about some recordings.

    Attributes
    ----------
    rig : Rig
        The model.
    free : dict of str to float
        Parameters that may move, with the standard deviation of what is known [SI].
    found : dict
        Residuals by block and recording, with sensitivities to them.
    """

    rig: Rig
    free: dict[str, float]
    found: dict[Key, Residual]


def linear(problem: Problem, rig: Rig) -> Linear:
    """Residuals of a model and their sensitivities to all that is free."""
    free = _free(problem, rig)
    return Linear(rig, free, residuals(problem, rig, list(free)))


@dataclass(frozen=True, eq=False)
class BinErrors:
    """Noise, and error of the model, in the bins of a block over a recording.

    Attributes
    ----------
    weight : float
        Noise level of the bin means as a multiple of its white part: what drives' noise adds
        (>= 1).
    scale : float
        Factor that makes noise levels of the channel's unit, for as many independent bins as the
        recording counts for.
    whiten : callable
        Takes rows in these units (m,) or (m, k), and takes off what the error of the model may
        be: :func:`pamrs.diagnosis.noise.whitening`.
    """

    weight: float
    scale: float
    whiten: Callable[[Array], Array]


Errors = Mapping[Key, BinErrors]
"""By block and recording."""


def errors_of(problem: Problem, model: Linear, visited: Sequence[Prepared] = ()) -> Errors:
    """Noise and usual error of a model over the recordings of a problem.

    Parameters
    ----------
    problem : Problem
        Blocks and recordings.
    model : Linear
        A model close to them.
    visited : sequence of Prepared, optional
        Further recordings whose ranges the curves of that error run over.
    """
    fewer = replace(problem, settings=replace(problem.settings, noise_replicates=REPLICATES))
    curve_errors = curve_errors_of(model.rig, problem.settings.usual_error)
    visited = [*problem.recordings, *visited]
    levels = noise_levels(fewer, core_rig(model.rig), curve_errors, visited)
    out = {}
    for prepared in problem.recordings:
        for block in problem.blocks:
            key = block.name, prepared.recording.name
            level, base = levels[key], model.found[key]
            white = prepared.noise[block.channel] / math.sqrt(bins_of(prepared))
            weight = max(1.0, level.binned_noise / white)
            _, counts = binned(base.value, base.rows, bins_of(prepared))
            # what differs is smooth over a bin: its mean square in all of them is that of a few
            size = counted(prepared, block, problem.settings) / max(1, int((counts > 0).sum()))
            scale = math.sqrt(size) / (weight * white)
            error = np.zeros((counts.size, 0)) if level.curves is None else level.curves * scale
            out[key] = BinErrors(weight, scale, whitening(error))
    return out


def misfit(problem: Problem, model: Linear, errors: Errors) -> ResidualDifference:
    """Difference of a model from recordings after its free parameters moved as far as they may."""
    return _left(problem, {key: r.value for key, r in model.found.items()}, model, errors)


def elsewhere(problem: Problem, model: Linear) -> Linear:
    """Model on other recordings of the experiment, with the sensitivities of its own: where these
    would differ much, the two are separated anyway.
    """
    found = {
        key: replace(r, jacobian=model.found[key].jacobian)
        for key, r in residuals(problem, model.rig).items()
    }
    return replace(model, found=found)


def difference(
    problem: Problem, truth: Mapping[Key, Residual], other: Linear, errors: Errors
) -> ResidualDifference:
    """Difference of a model from the recordings that another one makes, free parameters fitted out.

    Parameters
    ----------
    problem : Problem
        Blocks, and recordings without noise.
    truth : mapping
        Residuals of the model that makes them; what it leaves itself (smoothing and the longer step
        of the cut chain) is taken off.
    other : Linear
        The model that is to explain them, on these recordings.
    errors : mapping
        As :func:`errors_of`.
    """
    values = {key: r.value - truth[key].value for key, r in other.found.items()}
    return _left(problem, values, other, errors)


def _left(
    problem: Problem, values: Mapping[Key, Array], model: Linear, errors: Errors
) -> ResidualDifference:
    spread = np.array(list(model.free.values()))
    rows, slopes = [], []
    keys: list[Key] = []
    sizes: dict[Key, float] = {}
    for prepared in problem.recordings:
        width = bins_of(prepared)
        for block in problem.blocks:
            key = (block.name, prepared.recording.name)
            r = model.found[key]
            mean, _ = binned(np.where(r.rows, values[key], 0.0), r.rows, width)
            slope = np.zeros((mean.size, spread.size))
            if r.jacobian is not None:
                slope, _ = binned(r.jacobian, r.rows, width)
            own = errors[key]
            sizes[key] = counted(prepared, block, problem.settings)
            rows.append(own.whiten(mean * own.scale))
            slopes.append(own.whiten(-slope * spread * own.scale))
            keys.append(key)
    stacked, jacobian = np.concatenate(rows), np.concatenate(slopes)
    with np.errstate(over="ignore", invalid="ignore"):
        moved = solve_normal(jacobian.T @ jacobian + np.eye(spread.size), jacobian.T @ stacked)
        left = stacked - jacobian @ moved
    if not np.isfinite(left).all():
        raise SimulationError("a model of the recordings leaves the range of its numbers")
    rms, kept = {}, {}
    start = 0
    for key, part in zip(keys, rows, strict=True):
        beyond, scale = left[start : start + part.size], errors[key].scale
        start += part.size
        # nothing is left of a recording that ends before its beginning is forgotten
        rms[key] = math.sqrt(float(beyond @ beyond) / sizes[key]) if sizes[key] > 0.0 else 0.0
        kept[key] = beyond / scale if scale > 0.0 else beyond
    return ResidualDifference(rms, kept, float(left @ left + moved @ moved))
