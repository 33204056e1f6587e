"""Findings of all kinds, drawn: groups of blocks that are judged by what the diagnosis judges by,
with errors, free runs and budgets that any recordings could give.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from hypothesis import strategies as st

from pamrs.diagnosis.evidence import Judged, case_ambiguity, case_probabilities, judge
from pamrs.diagnosis.explain import _assemble, _block_entries
from pamrs.diagnosis.model import _conclude
from pamrs.diagnosis.next_experiment import _asked
from pamrs.diagnosis.result import Diagnosis
from pamrs.findings import (
    BlockMismatch,
    BlockVerdict,
    BudgetTerm,
    ChannelError,
    EffectFound,
    FitErrors,
    FreeRun,
    FreeRunError,
    MismatchSize,
    MismatchStages,
    OtherLaw,
    ParameterFound,
    Unexplained,
    Where,
    WrongParameter,
    left_of,
)
from pamrs.report.sentences import law_sentence, verdict
from tests.diagnosis.asked import SETTINGS
from tests.diagnosis.evidence.test_verdicts import RIG, group

CHANNELS = {"chamber": ("muscle_pressure", "Pa", 400.0), "arm": ("joint_angle", "rad", 1e-3)}
"""Channel, unit and noise of each block."""
NAMES = {
    "chamber": ("leak_muscle", "pressure_lag", "chamber.dead_volume", "unlisted", ""),
    "arm": ("muscle_creep", "pressure_lag", "arm.payload", "unlisted", ""),
}
"""What each may lack."""


class Asked(_asked._Question):
    """What is asked of a next experiment, of which nothing is simulated."""

    def experiment(self, block: Any, open_: Any = ()) -> tuple[str, str, None]:
        return "move slowly through nested loops", "what grows with the speed is damping", None


@st.composite
def chances(draw: st.DrawFn, block: str) -> dict[str, float]:
    """Probabilities of one group of blocks: of names and sets, or of nothing that is missing."""
    names = draw(st.lists(st.sampled_from(NAMES[block]), min_size=1, max_size=3, unique=True))
    if "" in names:
        return {"": 1.0}
    listed = [name for name in names if name != "unlisted"]
    keys = [*names, "+".join(listed)] if len(listed) == 2 and draw(st.booleans()) else names
    weights = [draw(st.floats(0.05, 1.0)) ** 3 for _ in keys]
    return {key: w / sum(weights) for key, w in zip(keys, weights, strict=True)}


@st.composite
def findings(draw: st.DrawFn) -> Diagnosis:
    """A result."""
    blocks = draw(st.sampled_from([("chamber",), ("arm",), ("chamber", "arm")]))
    table, own = {}, {}
    for block in blocks:
        channel, _, noise = CHANNELS[block]
        refit = draw(st.floats(0.9, 60.0))
        before, after = refit * draw(st.floats(0.9, 5.0)), refit * draw(st.floats(0.02, 1.1))
        sizes = (before, refit, max(0.9, after))
        table[channel] = ChannelError(noise, *(noise * size for size in sizes))
        own[channel] = draw(st.sampled_from([0.0, 0.3, 0.9, 3.0, 20.0])) * noise
    groups = [group(block, draw(chances(block))) for block in blocks]
    judged = judge(groups, SETTINGS)
    missing = [_conclude._missed(j, table, own) for j in judged]
    groups = [_conclude._with_mismatch(g, m) for g, m in zip(groups, missing, strict=True)]
    judged = judge(groups, SETTINGS)
    healthy = all(j.verdict == "none" for j in judged)
    for j in judged:  # the final model of a block without a name is the refitted one
        channel = CHANNELS[j.group.blocks[0].name][0]
        last = table[channel].before if healthy else table[channel].refit
        if not j.added:
            table[channel] = replace(table[channel], after=last)
    entries = [_entry(j, table, own, noise_is_left=draw(st.booleans())) for j in judged]
    runs = []
    if draw(st.booleans()):
        errors = {}
        for channel, unit, _ in (CHANNELS[block] for block in blocks):
            error = table[channel]
            size = error.noise * draw(st.floats(1.0, 300.0))
            sizes = (2.0 * size, size, error.before, error.after, error.noise)
            errors[channel] = FreeRunError(unit, *sizes, draw(st.booleans()))
        runs = [FreeRun("log", "held_out", 10.0, errors)]
    held = draw(st.booleans())
    fit = FitErrors(table, table if held else {}, None)
    found = _finished(judged, entries, fit, runs)
    return _under_another_law(found) if draw(st.booleans()) else found


def _under_another_law(found: Diagnosis) -> Diagnosis:
    """A result under a law that the rig file does not choose."""
    channel, error = next(iter(found.proven.items()))
    unit = next(unit for name, unit, _ in CHANNELS.values() if name == channel)
    sizes = (2.0 * error.refit, error.refit, error.noise)
    law = OtherLaw("chamber.gas", "energy_balance", "coefficients", channel, unit, *sizes)
    text = f"{law_sentence(law)}. With it: {found.text}"
    return _assemble.answered(replace(found, laws=[law], text=text))


def _entry(
    judged: Judged, table: dict[str, ChannelError], own: dict[str, float], *, noise_is_left: bool
) -> BlockVerdict:
    """What is said of a group of one block."""
    name, kept = judged.group.blocks[0].name, judged.group.mismatch is not None
    channel, unit, noise = CHANNELS[name]

    def size(stage: str, more: bool) -> MismatchSize:
        error = table[channel][stage]
        return MismatchSize(error / noise, error, more and error > 1.1 * noise)

    after = kept and not (noise_is_left and judged.added)
    sizes = MismatchStages(size("before", True), size("refit", kept), size("after", after))
    return BlockVerdict(
        blocks=[name],
        verdict=judged.verdict,
        probabilities={str(h): p for h, p in judged.probabilities.items()},
        effects=list(map(str, judged.named)),
        wrong_parameters=list(judged.wrong),
        ambiguity=[h.words for h in judged.ambiguity],
        mismatch=[BlockMismatch(name, channel, unit, sizes, None, own[channel])],
        block=_block_entries._located(judged),
    )


def _finished(
    judged: list[Judged], entries: list[BlockVerdict], fit: FitErrors, runs: list[FreeRun]
) -> Diagnosis:
    """A result with what the groups of blocks come to."""
    effects = {t: j.probability(t) for j in judged for t in j.named}
    closest = {
        t: p
        for j in judged
        for h in j.probabilities
        for t in h.terms
        if t.is_effect and (p := j.probability(t)) >= SETTINGS.in_set
    }
    wrong = {name: j.probability(_asked.Term(name)) for j in judged for name in j.wrong}
    values = {"arm.payload": ("kg", 2.0), "chamber.dead_volume": ("m3", 1e-4)}
    found = Diagnosis(
        case="drawn",
        verdict="none",
        effects=[
            EffectFound(str(t), t.info.name, probability=p) for t, p in (effects or closest).items()
        ],
        ambiguity=[h.words for h in case_ambiguity(judged)],
        probabilities={str(h): p for h, p in case_probabilities(judged).items()},
        blocks=entries,
        budget=[term for entry in entries for term in _budget(entry)],
        unexplained=[u for entry in entries for u in _kept(entry, fit)],
        wrong_parameters=[
            WrongParameter(
                name,
                name.partition(".")[0],
                size,
                0.1 * size,
                1.5 * size,
                0.01 * size,
                [size, 2.0 * size],
                unit,
                5.0,
                p,
                {},
            )
            for name, p in wrong.items()
            for unit, size in [values[name]]
        ],
        free_run=runs or None,
        parameters={
            name: ParameterFound(
                size,
                1.5 * size,
                0.01 * size,
                unit,
                5.0 if name in wrong else 0.4,
                identifiable=name in wrong,
            )
            for name, (unit, size) in values.items()
        },
        fit=fit,
    )
    found = _assemble.answered(found)
    block = found.answer.block
    found = replace(found, where=Where(block, text="There." * (block is not None)))
    blocks = [b for j in judged for b in j.group.blocks]
    asked = Asked(RIG, judged, blocks, [], None)  # type: ignore[arg-type]
    proposal = _asked._without_models(asked, found)
    found = replace(found, next_experiment=proposal)
    case: Any = SimpleNamespace(rig=RIG)
    return replace(found, text=verdict(found, case, [], sought=False))


def _budget(entry: BlockVerdict) -> list[BudgetTerm]:
    """A budget of one block, in equal shares."""
    (own,) = entry.mismatch
    told = [("parameters", "")]
    told += [("effect", name) for name in entry.effects]
    told += [("wrong_parameter", name) for name in entry.wrong_parameters]
    told += [("unexplained", "")]
    share, left = 1.0 / len(told), own.fitted.after
    return [
        BudgetTerm(own.block, kind, name, "", share, [0.0, 1.0], None, left.noises, 1.0, own.unit)
        for kind, name in told
        if own.fitted.before.more_than_noise
    ]


def _kept(entry: BlockVerdict, fit: FitErrors) -> list[Unexplained]:
    """What a group of one block keeps."""
    (own,) = entry.mismatch
    stage = "refit" if entry.verdict == "unlisted" else "after"
    named = entry.effects or entry.wrong_parameters or entry.verdict == "unlisted"
    error, role = fit.channels[own.channel], "held_out" if fit.held_out else "fit"
    if not named or left_of(own, error, stage) != "more":
        return []
    size = error[stage]
    return [
        Unexplained(
            own.block, own.channel, own.unit, size / error.noise, size, entry.verdict, role=role
        )
    ]
