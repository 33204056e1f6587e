"""Entries of a result by group of blocks: verdict, names, mismatch before and after."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from pamrs.channels import unit_of
from pamrs.diagnosis.evidence import Judged, parameters_at_wall, significant
from pamrs.diagnosis.explain._conditions import describe
from pamrs.diagnosis.explain._words import TELLING_CONDITION
from pamrs.diagnosis.fit import Key, Problem, Stages, concerns, depends
from pamrs.diagnosis.noise import NoiseLevel, excess
from pamrs.diagnosis.prepare import Block, Residual, Unjudged
from pamrs.findings import (
    NOT_JUDGED,
    BlockMismatch,
    BlockVerdict,
    BudgetTerm,
    ChannelError,
    Condition,
    MismatchSize,
    MismatchStages,
    Unexplained,
    left_of,
)
from pamrs.rig import Rig


def block_entries(
    judged: list[Judged],
    fit_problem: Problem,
    fit_residuals: Stages,
    held_out_problem: Problem,
    held_out_residuals: Stages,
    noise_level: dict[Key, NoiseLevel],
    own_errors: Mapping[str, float],
) -> list[BlockVerdict]:
    """One entry for each group of blocks.

    Parameters
    ----------
    judged : list of Judged
        The groups with their verdicts.
    fit_problem, held_out_problem : Problem
        Recordings that were fitted and held out (the same object when there are no others).
    fit_residuals, held_out_residuals : dict of str to dict
        Their residuals by stage (``before``, ``refit``, ``after``), block and recording.
    noise_level : dict
        Noise by block and recording.
    own_errors : mapping of str to float
        What the error of the model does to each channel.
    """

    def mismatch(block: Block) -> BlockMismatch:
        held_out = (
            None
            if held_out_problem is fit_problem
            else _sizes(block, held_out_problem, held_out_residuals, noise_level)
        )
        fitted = _sizes(block, fit_problem, fit_residuals, noise_level)
        unit, error = unit_of(block.channel), own_errors[block.channel]
        return BlockMismatch(block.name, block.channel, unit, fitted, held_out, error)

    return [
        BlockVerdict(
            blocks=[b.name for b in j.group.blocks],
            verdict=j.verdict,
            probabilities={str(h): p for h, p in j.probabilities.items()},
            effects=list(map(str, j.named)),
            wrong_parameters=list(j.wrong),
            ambiguity=[hypothesis.words for hypothesis in j.ambiguity],
            mismatch=[mismatch(b) for b in j.group.blocks],
            block=_located(j),
            unseen=j.unseen,
        )
        for j in judged
    ]


def _located(judged: Judged) -> str | None:
    """Block with the mismatch of a group; else the last that a wrong or named term acts in."""
    group = judged.group
    if group.mismatch is not None:
        return group.mismatch.name
    moved = parameters_at_wall(group.candidates[0].fit)
    worst = judged.wrong or tuple(sorted(moved, key=lambda name: -abs(moved[name])))
    moved_in = [b.name for b in group.blocks if worst and depends(b, worst[0])]
    named = [b.name for b in group.blocks if any(concerns(term, b) for term in judged.named)]
    return next(iter([*reversed(moved_in), *reversed(named)]), None)


def not_judged(block: Unjudged) -> BlockVerdict:
    """Entry of a block that these recordings cannot judge."""
    return BlockVerdict(
        blocks=[block.name],
        verdict=NOT_JUDGED,
        probabilities={},
        effects=[],
        wrong_parameters=[],
        ambiguity=[],
        covers=block.covers,
        reason=block.why,
    )


def _sizes(
    block: Block, problem: Problem, found: Stages, noise_level: dict[Key, NoiseLevel]
) -> MismatchStages:
    """Excess of a block at every stage [noise levels, channel's unit], and if it is significant."""
    sizes = {}
    for stage, residuals in found.items():
        size = excess(block, problem.recordings, residuals, noise_level, problem.settings)
        sizes[stage] = MismatchSize(
            size.systematic, size.systematic * size.noise, significant(size)
        )
    return MismatchStages(**sizes)


def unexplained(
    judged: list[Judged],
    entries: list[BlockVerdict],
    stages: list[tuple[Problem, Stages]],
    noise_level: dict[Key, NoiseLevel],
    terms: list[BudgetTerm],
    forms: Mapping[str, str],
    nominal: Rig,
    errors: Mapping[str, Mapping[str, ChannelError]],
) -> list[Unexplained]:
    """Blocks with a mismatch that no name explains, the largest first.

    Parameters
    ----------
    judged : list of Judged
        The groups with their verdicts; blocks that were no suspects keep nothing.
    entries : list of BlockVerdict
        From :func:`block_entries`. The size is that of the held-out recordings, where they show it,
        else of the fitted ones.
    stages : list of (Problem, dict of str to dict)
        Held-out recordings, if any, then fitted ones, with their residuals by stage, block and
        recording.
    noise_level : dict
        Noise by block and recording.
    terms : list of BudgetTerm
        The budget of every block.
    forms : mapping of str to str
        Words of the form of what is missing, by block.
    nominal : Rig
        The model of the rig file.
    errors : mapping
        Error of each channel, by the role of the recordings: the size is that of this table.

    Returns
    -------
    list of Unexplained
        What names leave, its share, and the verdict of the group.
    """
    entries_found = []
    for j, entry in zip(judged, entries, strict=True):
        if entry.verdict == "none" or (
            entry.verdict == "parameters" and not entry.wrong_parameters
        ):
            continue
        suspects = {b.name: b for b in j.group.suspects}
        for mismatch in (m for m in entry.mismatch if m.block in suspects):
            shown = _stage_with_excess(mismatch, entry.verdict, stages, errors)
            if shown is None:
                continue
            stage, problem, residual, role = shown
            error = errors[role][mismatch.channel]
            size = error[stage]
            share, interval = _share_unexplained(mismatch.block, terms, entry.verdict)
            entries_found.append(
                Unexplained(
                    mismatch.block,
                    mismatch.channel,
                    mismatch.unit,
                    size / error.noise,
                    size,
                    entry.verdict,
                    share,
                    interval,
                    _conditions(suspects[mismatch.block], problem, residual, noise_level, nominal),
                    forms.get(mismatch.block, "") if entry.verdict == "unlisted" else "",
                    role,
                )
            )
    return sorted(entries_found, key=lambda u: -(u.noises or 0.0))


def _stage_with_excess(
    mismatch: BlockMismatch,
    verdict: str,
    stages: list[tuple[Problem, Stages]],
    errors: Mapping[str, Mapping[str, ChannelError]],
) -> tuple[str, Problem, dict[Key, Residual], str] | None:
    """Stage, recordings, residuals and role that show what a block keeps; None if only noise."""
    # a form without a name absorbs what no name explains, and is no explanation
    stage = "refit" if verdict == "unlisted" else "after"
    parts = {"held_out": mismatch, "fit": replace(mismatch, held_out=None)}
    if mismatch.held_out is None:
        del parts["held_out"]
    for (role, part), (problem, residuals) in zip(parts.items(), stages, strict=True):
        if left_of(part, errors[role][mismatch.channel], stage) == "more":
            return stage, problem, residuals[stage], role
    return None


def _share_unexplained(
    block: str, terms: list[BudgetTerm], verdict: str
) -> tuple[float | None, list[float] | None]:
    """Share of a block's excess that no name takes, nor the correction of one, and its interval;
    None without a budget.
    """
    of_block = [t for t in terms if t.block == block]
    kinds = ("form", "unexplained") if verdict == "unlisted" else ("unexplained",)
    rest = [t for t in of_block if t.kind in kinds]
    if not rest:
        return None, None
    share = sum(t.share for t in rest)
    if len(rest) == 1:
        return share, rest[0].interval
    # only parameters come before a form without a name, and the shares of every draw add up to 1
    low, high = of_block[0].interval
    return share, [1.0 - high, 1.0 - low]


def _conditions(
    block: Block,
    problem: Problem,
    residual: dict[Key, Residual],
    noise_level: dict[Key, NoiseLevel],
    nominal: Rig,
) -> list[Condition]:
    """Conditions, at most six, under which the rest is larger than their time would explain."""
    picture = describe(block, problem.recordings, nominal, residual, noise_level)
    return [c for c in picture.conditions if c.share > TELLING_CONDITION * c.time][:6]
