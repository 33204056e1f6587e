"""The missing input of a block along all of its recordings."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

import numpy as np

from pamrs import _core
from pamrs.channels import block_of, channel_of, dotted, rate_of, unit_of, with_trait
from pamrs.diagnosis.fit import Key, Problem
from pamrs.diagnosis.missing._dependence import with_words
from pamrs.diagnosis.missing._reconstruct import (
    INPUT_UNITS,
    Array,
    Reconstruction,
    has_port,
    reconstruct,
)
from pamrs.diagnosis.noise import NoiseLevel, means_in_noises
from pamrs.diagnosis.prepare import Block, Prepared, residual
from pamrs.errors import SimulationError
from pamrs.findings import MissingInput, MissingRecording

_MOTION = with_trait("moves")


def worst_block(problem: Problem, noise_level: Mapping[Key, NoiseLevel]) -> Block:
    """The block that misses its recordings most, in noise levels."""

    def missed(block: Block) -> float:
        means = [
            means_in_noises(p, block_residual, noise_level[block.name, p.recording.name])[1]
            for p in problem.recordings
            for block_residual in [residual(block, problem.core, p, [])]
        ]
        every = np.concatenate(means)
        return float(np.mean(every**2)) if every.size else 0.0

    return max(problem.blocks, key=missed)


def missing_input_of(
    block: Block,
    core: _core.Rig,
    recordings: Mapping[str, list[Prepared]],
    noise_level: Mapping[Key, NoiseLevel],
    *,
    named: _core.Rig | None = None,
    margin: float = 1.1,
) -> MissingInput | None:
    """Reconstruct the missing input of a block along all recordings, and what it depends on.

    Parameters
    ----------
    block : Block
        The block.
    core : _core.Rig
        The model, compiled.
    recordings : dict of str to list of Prepared
        By role.
    noise_level : dict
        By block and recording.
    named : _core.Rig, optional
        The model with what a diagnosis named: the input that it makes, which is what the model
        without it misses more, is the law.
    margin : float
        Factor by which the residual's variance must exceed that of the noise.

    Returns
    -------
    MissingInput or None
        None where no recording was followed.
    """
    recorded, parts = [], []
    for role, each in recordings.items():
        for prepared in each:
            name = prepared.recording.name
            noise = noise_level[block.name, name].binned_noise
            followed = _reconstructed(block, core, prepared, noise)
            if followed is None:
                continue
            # a force shortens the muscle, and its length is what is measured
            sign = -1.0 if channel_of(block.name) == "load" else 1.0
            law = None
            rest = None if named is None else _reconstructed(block, named, prepared, noise)
            if rest is not None and rest.time.size:
                law = sign * (followed.value - np.interp(followed.time, rest.time, rest.value))
            parts.append(followed)
            recorded.append(
                MissingRecording(
                    name,
                    role,
                    followed.time,
                    sign * followed.value,
                    followed.std,
                    _arguments(block, prepared, followed.time),
                    math.sqrt(followed.before),
                    math.sqrt(followed.after),
                    law,
                )
            )
    if not recorded:
        return None
    return _with_dependence(block, recorded, parts, margin)


def _reconstructed(
    block: Block, core: _core.Rig, prepared: Prepared, noise: float
) -> Reconstruction | None:
    """The input in one recording; None where the model cannot follow it."""
    try:
        return reconstruct(block, core, prepared, noise) if noise > 0.0 else None
    except SimulationError:
        return None


def _with_dependence(
    block: Block, recorded: list[MissingRecording], parts: list[Reconstruction], margin: float
) -> MissingInput:
    """Missing input along all recordings, with words on what it depends on."""
    bins = [part.bins for part in parts]
    before, after = (
        float(np.average([getattr(part, n) for part in parts], weights=bins))
        for n in ("before", "after")
    )
    units = {name: _unit(name) for name in ("time", *recorded[0].arguments)}
    unit = INPUT_UNITS.get(channel_of(block.name)) or unit_of(block.channel)
    above = before > margin
    share = 1.0 - max(0.0, after - 1.0) / (before - 1.0) if above else 0.0
    position = block.channel if has_port(block) or not _moving(recorded) else _moving(recorded)[0]
    missing = MissingInput(
        block.name,
        unit,
        "nothing above the noise",
        "",
        0.0,
        max(0.0, share),
        math.sqrt(before),
        math.sqrt(after),
        position,
        _rate(position),
        units,
        recorded,
    )
    return with_words(missing) if above else missing


def _moving(recorded: Collection[MissingRecording]) -> list[str]:
    """Angles and lengths among the arguments."""
    return [n for recording in recorded for n in recording.arguments if channel_of(n) in _MOTION]


def _rate(channel: str) -> str:
    """Name of a channel's rate."""
    if channel_of(channel) in _MOTION:
        return rate_of(channel)
    return dotted(f"{channel_of(channel)}_rate", block_of(channel))


def _unit(name: str) -> str:
    """SI unit of an argument."""
    of = channel_of(name)
    if of == "time":
        return "s"
    whole = f"{unit_of(of.removesuffix('_rate'))}/s" if of.endswith("_rate") else unit_of(of)
    return unit_of(of) if unit_of(of) != "1" else whole


def _arguments(block: Block, prepared: Prepared, time: Array) -> dict[str, Array]:
    """Measurements along an input: what the block predicts, what drives it, the rates of both
    where they move, and the commands.
    """
    clock = np.arange(prepared.n) * prepared.dt
    arguments = {}
    for name in dict.fromkeys((block.channel, *block.drives)):
        if name in prepared.signals:
            value, slope = prepared.signals[name]
            arguments[name] = np.interp(time, clock, value)
            if name == block.channel or channel_of(name) in _MOTION:
                arguments[_rate(name)] = np.interp(time, clock, slope)
        elif name in prepared.commands:
            arguments[name] = np.interp(time, clock, prepared.commands[name])
    return arguments
