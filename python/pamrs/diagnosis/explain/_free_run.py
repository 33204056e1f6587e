"""The whole rig simulated from its commands alone, beside the chain that is cut at what was
measured: what each block's error comes to when nothing measured corrects it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pamrs.channels import channel_of, recorded_as, unit_of
from pamrs.diagnosis.fit import Events, Key, Problem
from pamrs.diagnosis.prepare import Residual
from pamrs.diagnosis.settings import WarningSettings
from pamrs.effects import info_of
from pamrs.errors import PamrsError, RecordingError
from pamrs.findings import FreeRun, FreeRunError
from pamrs.recordings import Recording
from pamrs.rig import Rig
from pamrs.simulation import differences, replay

__all__ = ["free_run", "said_of_constants"]

_FREED = ("muscle_force", "joint_torque", "temperature")
"""Channels whose constant is fitted to each recording."""

Stages = dict[str, dict[Key, Residual]]


def free_run(
    problem: Problem, found: Stages, nominal: Rig, final: Rig, events: Events | None
) -> tuple[list[FreeRun] | None, str]:
    """Errors of free-running simulations of every recording.

    A simulation begins at the recording's first usable values and then knows its commands only. It
    costs a few hundredths of a second for each recording and model, and raises nothing: a model
    that leaves its range has no number and a note that says so.

    Parameters
    ----------
    problem : Problem
        Held-out recordings (those that were fitted, where there are no others).
    found : dict of str to dict
        Residuals of the cut chain by stage (``before``, ``after``), block and recording.
    nominal, final : Rig
        The model of the rig file, and the one with what was found.
    events : Events or None
        What happened in single recordings, in the place of what `final` says.

    Returns
    -------
    tuple of (list of FreeRun or None, str)
        One entry for each recording that could be simulated, and what is to be said beside them;
        None and the reason where no recording has the commands that the rig needs.
    """
    runs, missing = [], []
    for prepared in problem.recordings:
        recording = prepared.recording
        try:
            runs.append(_of(recording, problem, found, nominal, _with(final, events, recording)))
        except RecordingError as error:  # it lacks a command
            missing.append(str(error))
    if not runs:
        return None, "no free run: " + "; ".join(missing)
    return runs, "without a free run: " + "; ".join(missing) if missing else ""


def _with(rig: Rig, events: Events | None, recording: Recording) -> Rig:
    """A model with what happened in one recording."""
    return rig if events is None else events.put_into(rig, recording.name)


def _of(recording: Recording, problem: Problem, found: Stages, nominal: Rig, final: Rig) -> FreeRun:
    """The free run of one recording."""
    before, why = _errors(nominal, recording)
    after, why_after = (before, why) if final is nominal else _errors(final, recording)
    notes = [f"nominal model: {why}"] if why else []
    notes += [f"with what was found: {why_after}"] if why_after and final is not nominal else []
    covering = {b.channel: b.name for b in problem.blocks}

    def cut(stage: str, channel: str) -> float | None:
        block = covering.get(recorded_as(channel))
        if block is None:
            return None
        residual = found[stage][block, recording.name]
        values = residual.value[residual.rows]
        return math.sqrt(float(np.mean(values**2))) if values.size else None

    return FreeRun(
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
            )
            for channel in before | after
        },
        note="; ".join(notes),
    )


def said_of_constants(
    runs: Sequence[FreeRun], effects: Sequence[str], settings: WarningSettings
) -> list[str]:
    """Channels that the whole rig misses by far more than their blocks do, in words: what is
    constant in a recording is fitted to each, and no block is judged by it.

    Parameters
    ----------
    runs : sequence of FreeRun
        Of the recordings that were held out, or of all.
    effects : sequence of str
        What was found: the free run takes readings as they are, so that those of a sensor explain
        a difference of their own.
    settings : WarningSettings
        How far off is worth a sentence.
    """
    if any(info_of(effect).block == "sensors" for effect in effects):
        return []
    worst: dict[str, tuple[float, FreeRunError, str]] = {}
    for run in runs:
        for channel, error in run.channels.items():
            if channel_of(channel) not in _FREED or not error.cut_after:
                continue
            times = error.after / error.cut_after
            if times > max(settings.far_alone, worst.get(channel, (0.0, error, ""))[0]):
                worst[channel] = (times, error, run.recording)
    return [
        f"{channel} of the whole rig is {error.after:.3g} {error.unit} off in {name!r} (root mean "
        f"square), that of its block {error.cut_after:.2g} {error.unit}: what is constant in a "
        "recording (a zero of the sensor, a dead weight, an effect that does the same all the "
        "time) is fitted to each recording and is not judged"
        for channel, (_, error, name) in worst.items()
    ]


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


def _errors(rig: Rig, recording: Recording) -> tuple[dict[str, float], str]:
    """Root mean square error of each measured channel, and why there is none."""
    logged = _as_logged(recording)
    try:
        return differences(replay(rig, logged), logged), ""
    except RecordingError:
        raise
    except (PamrsError, ArithmeticError) as error:
        return {}, str(error)
