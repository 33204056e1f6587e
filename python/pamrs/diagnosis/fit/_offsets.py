"""Offsets of commands: parts of a sample by which they acted earlier or later than logged.

A log that runs by itself next to the loop sees a command at its next sample, and a loop may send it
after the sensors were read. What that does to a pressure is neither a lag nor a value of the rig;
it is a nuisance of the recording, as the start of a window is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pamrs._arrays import Array, Index
from pamrs.channels import channel_of
from pamrs.diagnosis.fit._fitting import Problem, fit, free_baseline, residuals
from pamrs.diagnosis.fit._known_parameters import known_parameters
from pamrs.diagnosis.prepare import AS_LARGE, Block, Prepared, change
from pamrs.errors import SimulationError
from pamrs.rig import Rig
from pamrs.simulation import core_rig

# deviations from none of a command's offset that is applied: each of a few recordings is asked
_OFFSET_STDS = 4.0
# parts of a sample by which rare commands move: a step at 100 Hz is off by 0.08 ms at most
_OFFSET_PARTS = 64
# the same of commands that change more often: each part is a step of the integration
_OFFSET_FEW_PARTS = 8
# [s] least time of such a part: no pressure tells finer ones (offset_parts at 100 Hz)
_LEAST_OFFSET_PART = 1.6e-4
# [samples] offset left to effects, and its prior deviation: a log sees a command a sample late
_MOST_OFFSET = 1.0
# changes of commands with an offset each, which takes two predictions: steps, no controller
_MOST_OFFSETS = 40


Rows = Index


class _Change(NamedTuple):
    """Changes of the commands of a recording, by their numbers, that are moved alike."""

    recording: int
    which: Rows


def with_offsets(problems: Sequence[Problem], nominal: Rig) -> tuple[list[Problem], list[str]]:
    """Move the commands of recordings to the time at which they began to act, as far as that is
    less than a sample.

    How much later they act is fitted for each recording together with the parameters inside their
    tolerances, by the blocks that a command drives. Only an offset that is told from none counts,
    and one of a sample or more is left to the effects. Where there is one and commands seldom
    change, each change has its own: two clocks are not in step.

    Parameters
    ----------
    problems : sequence of Problem
        Recordings to fit and held-out ones, or one of both.
    nominal : Rig
        The model.

    Returns
    -------
    problems : list of Problem
        The same, with the commands of some recordings moved.
    notes : list of str
        Which, in words.
    """
    first = problems[0]
    recordings = list({p.recording.name: p for q in problems for p in q.recordings}.values())
    blocks = [
        b
        for b in first.blocks
        if not b.mechanical and any(channel_of(name).endswith("_command") for name in b.drives)
    ]
    if not blocks:
        return list(problems), []
    whole = replace(first, blocks=blocks, recordings=recordings)
    try:
        # offsets are small and linear, parameters inside wide tolerances are not
        near = _fitted_model(first, blocks, nominal)
        moved, offsets = _moved_alike(whole, near)
        if moved:
            moved |= _moved_each(whole, near, list(moved))
            moved = _worth_moving(first, whole, near, moved)
    except SimulationError:
        return list(problems), []  # the fit says what cannot be predicted
    notes = [
        f"recording {recordings[k].recording.name}: its commands act {abs(offset):.2f} of a sample "
        f"of the log {'later' if offset > 0 else 'earlier'} than it has them, as if two clocks "
        "wrote it; they were moved so far"
        for k, offset in offsets.items()
        if k in moved
    ]
    by_name = {recordings[k].recording.name: p for k, p in moved.items()}
    return [
        replace(q, recordings=[by_name.get(p.recording.name, p) for p in q.recordings])
        for q in problems
    ], notes


def _fitted_model(problem: Problem, blocks: Sequence[Block], nominal: Rig) -> Rig:
    """The model with its parameters fitted to some blocks."""
    part = replace(problem, blocks=list(blocks))
    return fit(part, nominal, (), {}, {b.name: 1.0 for b in blocks}).rig


def _worth_moving(
    first: Problem, whole: Problem, near: Rig, moved: dict[int, Prepared]
) -> dict[int, Prepared]:
    """Moved recordings of which a fit leaves less than unmoved, and little but noise: where
    something else is missing, an offset takes a part of that.
    """
    by_name = {whole.recordings[k].recording.name: p for k, p in moved.items()}
    fitted = [by_name.get(p.recording.name, p) for p in first.recordings]
    after = _fitted_model(replace(first, recordings=fitted), whole.blocks, near)
    recordings = [moved.get(k, p) for k, p in enumerate(whole.recordings)]
    with_moved = replace(whole, recordings=recordings)
    missed, rest = _misfits(whole, near), _misfits(with_moved, after)
    return {
        k: p
        for k, p in moved.items()
        if rest[k][0] < missed[k][0] - _OFFSET_STDS**2 and rest[k][0] < AS_LARGE * rest[k][1]
    }


def _misfits(problem: Problem, rig: Rig) -> list[tuple[float, int]]:
    """Sum of squares of each recording's residuals in noise levels, and their number."""
    block_residuals, sums = residuals(problem, rig, []), []
    for prepared in problem.recordings:
        of_recording = [
            block_residuals[block.name, prepared.recording.name] for block in problem.blocks
        ]
        missed = [r.value[r.rows] / r.noise for r in of_recording]
        sums.append((sum(float(v @ v) for v in missed), sum(v.size for v in missed)))
    return sums


def _changes(prepared: Prepared) -> Rows:
    """Samples of the log at which commands change."""
    each = np.stack(list(prepared.held.values()))
    return np.flatnonzero(np.any(np.diff(each) != 0.0, axis=0)) + 1


def _with_later_commands(prepared: Prepared, shares: Array) -> Prepared:
    """Recording whose changes of a command act given shares of a sample of the log later."""
    at = _changes(prepared)
    size = next(iter(prepared.held.values())).size
    seldom = at.size * _OFFSET_FEW_PARTS < size
    most = _OFFSET_PARTS if seldom else _OFFSET_FEW_PARTS
    each = prepared.dt * prepared.n / size
    parts = min(most, 2 * math.ceil(0.5 * each / _LEAST_OFFSET_PART))  # half of them is whole
    moved = np.maximum.accumulate(np.maximum(1, parts * at + np.rint(parts * shares).astype(int)))
    counts = np.diff(np.minimum(moved, size * parts), prepend=0, append=size * parts)
    rows = np.concatenate([[0], at])
    held = {name: np.repeat(values[rows], counts) for name, values in prepared.held.items()}
    return replace(prepared, held=held)


def _moved_alike(problem: Problem, nominal: Rig) -> tuple[dict[int, Prepared], dict[int, float]]:
    """Recordings, by number, with all commands moved alike, and that share of a sample; only those
    in which it is distinguished from zero.
    """
    all_of = [
        _Change(k, np.arange(at.size))
        for k, p in enumerate(problem.recordings)
        if (at := _changes(p)).size
    ]
    best, spread = _fit_offsets(problem, nominal, all_of)
    offsets = {
        change.recording: float(offset)
        for change, offset, std in zip(all_of, best, spread, strict=True)
        if _OFFSET_STDS * std < abs(offset) < _MOST_OFFSET
    }
    recordings = problem.recordings
    return {
        k: _with_later_commands(recordings[k], np.full(_changes(recordings[k]).size, offset))
        for k, offset in offsets.items()
    }, offsets


def _moved_each(problem: Problem, nominal: Rig, those: list[int]) -> dict[int, Prepared]:
    """Recordings, by their numbers, in which each change of a command has an offset of its own."""
    counts = {k: _changes(problem.recordings[k]).size for k in those}
    few = {k: n for k, n in counts.items() if n <= _MOST_OFFSETS}
    each = [_Change(k, np.array([i])) for k, n in few.items() for i in range(n)]
    if not each:
        return {}
    best, _ = _fit_offsets(problem, nominal, each)
    shares = {k: np.zeros(n) for k, n in few.items()}
    for one, offset in zip(each, best, strict=True):
        shares[one.recording][one.which] = np.clip(offset, -_MOST_OFFSET, _MOST_OFFSET)
    return {
        k: _with_later_commands(problem.recordings[k], shares_of) for k, shares_of in shares.items()
    }


def _fit_offsets(problem: Problem, nominal: Rig, moving: Sequence[_Change]) -> tuple[Array, Array]:
    """Offsets in samples of the log, and their standard deviations, by a linear fit together with
    the parameters inside their tolerances.
    """
    names = free_baseline(problem, nominal)
    known = known_parameters(nominal)
    block_residuals, core = residuals(problem, nominal, names), core_rig(nominal, problem.core)
    scales = np.array([known[name].tol for name in names])
    size = len(names) + len(moving)
    normal, right, total, count = np.eye(size), np.zeros(size), 0.0, 0  # tolerances are priors
    normal[len(names) :, len(names) :] /= _MOST_OFFSET**2
    for k, prepared in enumerate(problem.recordings):
        columns = [
            (len(names) + j, one.which) for j, one in enumerate(moving) if one.recording == k
        ]
        for block in problem.blocks:
            base = block_residuals[block.name, prepared.recording.name]
            slopes = np.zeros((prepared.n, size))
            if base.jacobian is not None and names:
                slopes[:, : len(names)] = base.jacobian * scales
            for column, which in columns:
                shares = np.zeros(_changes(prepared).size)
                shares[which] = 0.5
                later, sooner = (
                    change(block, core, _with_later_commands(prepared, sign * shares), base)
                    for sign in (1.0, -1.0)
                )
                slopes[:, column] = sooner - later  # residuals go the other way
            slopes, value = slopes[base.rows] / base.noise, base.value[base.rows] / base.noise
            normal += slopes.T @ slopes
            right += slopes.T @ value
            total, count = total + float(value @ value), count + value.size
    inverse = np.linalg.inv(normal)
    best = inverse @ right
    # what is left beyond noise makes them less certain
    rough = max(1.0, (total - float(best @ right)) / max(1, count))
    first = len(names)
    return best[first:], rough * np.sqrt(np.diag(inverse))[first:]
