"""What is said of each group of blocks: verdict, names, and how large its mismatch is before and
after.
"""

from __future__ import annotations

from pamrs.channels import unit_of
from pamrs.diagnosis.evidence import Judged, significant
from pamrs.diagnosis.fit import Key, Problem
from pamrs.diagnosis.noise import NoiseLevel, excess
from pamrs.diagnosis.prepare import Block, Residual
from pamrs.findings import BlockMismatch, BlockVerdict, MismatchSize, MismatchStages, Unexplained

__all__ = ["block_entries", "unexplained"]

Stages = dict[str, dict[Key, Residual]]


def block_entries(
    judged: list[Judged],
    fitted: Problem,
    fit_found: Stages,
    held: Problem,
    out_found: Stages,
    noise_level: dict[Key, NoiseLevel],
) -> list[BlockVerdict]:
    """One entry for each group of blocks.

    Parameters
    ----------
    judged : list of Judged
        The groups with their verdicts.
    fitted, held : Problem
        Recordings that were fitted and held out (the same object when there are no others).
    fit_found, out_found : dict of str to dict
        Their residuals by stage (``before``, ``refit``, ``after``), block and recording.
    noise_level : dict
        Noise by block and recording.
    """

    def mismatch(block: Block) -> BlockMismatch:
        outside = None if held is fitted else _sizes(block, held, out_found, noise_level)
        inside = _sizes(block, fitted, fit_found, noise_level)
        return BlockMismatch(block.name, block.channel, unit_of(block.channel), inside, outside)

    return [
        BlockVerdict(
            blocks=[b.name for b in j.group.blocks],
            verdict=j.verdict,
            probabilities=j.probabilities,
            effects=list(j.named),
            wrong_parameters=list(j.wrong),
            ambiguity=j.ambiguity,
            mismatch=[mismatch(b) for b in j.group.blocks],
        )
        for j in judged
    ]


def _sizes(
    block: Block, problem: Problem, found: Stages, noise_level: dict[Key, NoiseLevel]
) -> MismatchStages:
    """What is more than noise at every stage: in noise levels, in the channel's unit, and whether
    noise could be so large.
    """
    sizes = {}
    for stage, residuals in found.items():
        told = excess(block, problem.recordings, residuals, noise_level, problem.settings.noise)
        sizes[stage] = MismatchSize(
            told.systematic, told.systematic * told.noise, significant(told)
        )
    return MismatchStages(**sizes)


def unexplained(judged: list[Judged], entries: list[BlockVerdict]) -> list[Unexplained]:
    """Blocks with a mismatch beside what is named, or without a name, the largest first.

    Parameters
    ----------
    judged : list of Judged
        The groups with their verdicts; blocks that were no suspects keep nothing.
    entries : list of BlockVerdict
        From :func:`block_entries`. The size is that of the held-out recordings, where they show it,
        else of the fitted ones.

    Returns
    -------
    list of Unexplained
        What names leave, and the verdict of the group.
    """
    found = []
    for j, entry in zip(judged, entries, strict=True):
        if entry.verdict == "none" or (
            entry.verdict == "parameters" and not entry.wrong_parameters
        ):
            continue
        suspects = {b.name for b in j.group.suspects}
        for block in (m for m in entry.mismatch if m.block in suspects):
            # a form without a name takes up what no name explains, and is no explanation
            stage = "refit" if entry.verdict == "unlisted" else "after"
            sizes: list[MismatchSize] = [
                part[stage] for part in (block.held_out, block.fitted) if part is not None
            ]
            left = next((size for size in sizes if size.more_than_noise), None)
            if left is not None:
                found.append(
                    Unexplained(
                        block.block,
                        block.channel,
                        block.unit,
                        left.noises,
                        left.size,
                        entry.verdict,
                    )
                )
    return sorted(found, key=lambda u: -(u.noises or 0.0))
