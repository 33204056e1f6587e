"""The missing input of a block along all of its recordings."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

import numpy as np

from pamrs import _core
from pamrs.channels import block_of, channel_of, dotted, rate_of, unit_of
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

_MOTION = ("joint_angle", "length")


def worst_block(problem: Problem, noise_level: Mapping[Key, NoiseLevel]) -> Block:
    """The block that misses its recordings most, in noise levels.

    Parameters
    ----------
    problem : Problem
        Blocks and recordings.
    noise_level : dict
        By block and recording.
    """

    def missed(block: Block) -> float:
        means = [
            means_in_noises(p, found, noise_level[block.name, p.recording.name])[1]
            for p in problem.recordings
            for found in [residual(block, problem.core, p, [])]
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
    told, parts = [], []
    for role, each in recordings.items():
        for prepared in each:
            name = prepared.recording.name
            noise = noise_level[block.name, name].noise
            found = _followed(block, core, prepared, noise)
            if found is None:
                continue
            # a force shortens the muscle, and its length is what is measured
            sign = -1.0 if channel_of(block.name) == "load" else 1.0
            law = None
            rest = None if named is None else _followed(block, named, prepared, noise)
            if rest is not None and rest.time.size:
                law = sign * (found.value - np.interp(found.time, rest.time, rest.value))
            parts.append(found)
            told.append(
                MissingRecording(
                    name,
                    role,
                    found.time,
                    sign * found.value,
                    found.std,
                    _arguments(block, prepared, found.time),
                    math.sqrt(found.before),
                    math.sqrt(found.after),
                    law,
                )
            )
    if not told:
        return None
    return _told(block, told, parts, margin)


def _followed(
    block: Block, core: _core.Rig, prepared: Prepared, noise: float
) -> Reconstruction | None:
    """The input in one recording; None where the model cannot follow it."""
    try:
        return reconstruct(block, core, prepared, noise) if noise > 0.0 else None
    except SimulationError:
        return None


def _told(
    block: Block, told: list[MissingRecording], parts: list[Reconstruction], margin: float
) -> MissingInput:
    """Missing input along all recordings, with words on what it depends on."""
    bins = [own.bins for own in parts]
    before, after = (
        float(np.average([getattr(own, n) for own in parts], weights=bins))
        for n in ("before", "after")
    )
    units = {name: _unit(name) for name in ("time", *told[0].arguments)}
    unit = INPUT_UNITS.get(channel_of(block.name)) or unit_of(block.channel)
    above = before > margin
    share = 1.0 - max(0.0, after - 1.0) / (before - 1.0) if above else 0.0
    position = block.channel if has_port(block) or not _moving(told) else _moving(told)[0]
    found = MissingInput(
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
        told,
    )
    return with_words(found) if above else found


def _moving(told: Collection[MissingRecording]) -> list[str]:
    """Angles and lengths among the arguments."""
    return [n for own in told for n in own.arguments if channel_of(n) in _MOTION]


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
    own = np.arange(prepared.n) * prepared.dt
    found = {}
    for name in dict.fromkeys((block.channel, *block.drives)):
        if name in prepared.signals:
            value, slope = prepared.signals[name]
            found[name] = np.interp(time, own, value)
            if name == block.channel or channel_of(name) in _MOTION:
                found[_rate(name)] = np.interp(time, own, slope)
        elif name in prepared.commands:
            found[name] = np.interp(time, own, prepared.commands[name])
    return found
