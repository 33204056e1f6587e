"""The answer of a result, decided once: verdict, what leads in each group of blocks with its
probability, what the final model still misses, and whether all that is settled.

Texts, tables, pictures and ``result.json`` take these from here, so that none says another.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from pamrs.findings._entries import (
    HEALTHY,
    BlockMismatch,
    BlockVerdict,
    ChannelError,
    FreeRun,
)
from pamrs.findings._entry import NOT_WRITTEN, Entry

SETTLED: Final = 0.75
"""Probability above which an answer is settled, if nothing else is left open."""
MOST_MISSED: Final = 5.0
"""[noise levels] Error beyond noise and the model's own above which nothing is settled."""
_OWN_ERRORS: Final = 2.0
"""[standard deviations] Error of a model that is still its own: its square is that of a few numbers
(docs/decisions/0095)."""
FORM_ERROR: Final = 0.1
"""[share] Error of a named equation over what it explains: right names in forms that the catalogue
lacks leave 0.05 to 0.15 of the amplitude, wrong ones 0.75 to 0.94 (docs/decisions/0014)."""
NOISE_LEVELS: Final = 2.0
"""[noise levels] Error of a channel that is not called noise any more."""
MENDED, REFITTED, YOURS = "mended model", "refitted model", "your model"
"""Names of the final model: with an effect, a value or a form that was found; with values inside
their tolerances; as the rig file has it."""


def beyond(size: float, noise: float, error: float) -> float:
    """Part of an error beyond noise and the error of the model.

    Parameters
    ----------
    size : float
        Root mean square error of a channel, noise included.
    noise, error : float
        Standard deviation of the noise, and of what the error stated for the model, or usual, does
        to the channel; all in one unit.

    Returns
    -------
    float
        [noise levels]; below 0 where both explain more; 0 where it is not known.
    """
    if not (math.isfinite(size) and noise > 0.0):
        return 0.0
    return (size - explained(noise, error)) / noise


def explained(noise: float, error: float) -> float:
    """Largest error of a channel that its noise and the error of its model explain, in the unit of
    both standard deviations.
    """
    return math.hypot(noise, _OWN_ERRORS * error)


def case_verdict(verdicts: Iterable[str], *, missed: bool = False) -> str:
    """The verdict of a case from those of its groups of blocks: a name of physics wherever one has
    it, then that physics without a name is missing, then values.

    Parameters
    ----------
    verdicts : iterable of str
        Of the groups.
    missed : bool
        Whether the whole rig misses more than they say: then something is missing.
    """
    every = {*verdicts, *(("unlisted",) if missed else ())}
    return next((v for v in ("effects", "unlisted", "parameters") if v in every), "none")


@dataclass(frozen=True, eq=False)
class Missed(Entry):
    """A channel that the final model still misses by more than noise and its error explain.

    Attributes
    ----------
    block : str or None
        The block that predicts it, driven by its measured neighbours; None for the whole rig from
        its commands alone.
    channel, unit : str
        The channel and its SI unit.
    size, before : float
        Root mean square error, noise included, and that of the model of the rig file.
    noises, beyond : float
        The size in noise levels, and how many of them noise and the error of the model leave over.
    """

    block: str | None
    channel: str
    unit: str
    size: float
    before: float
    noises: float
    beyond: float


@dataclass(frozen=True, eq=False)
class Part:
    """The answer about one group of blocks.

    Attributes
    ----------
    group : BlockVerdict
        The group.
    block : str or None
        Its block with the mismatch.
    left : tuple of (tuple of str, float)
        The answers that are left and their probabilities: the one that leads first.
    together : bool
        Whether the first probability is that of its names whatever else acts with them.
    sure : bool
        Whether nothing else is left and that probability is enough.
    """

    group: BlockVerdict
    block: str | None
    left: tuple[tuple[tuple[str, ...], float], ...]
    together: bool
    sure: bool

    @property
    def words(self) -> tuple[str, ...]:
        """Leading answer: names, or ``none``, ``parameters``, ``unlisted``."""
        return self.left[0][0]

    @property
    def probability(self) -> float:
        """Probability of the leading answer."""
        return self.left[0][1]

    @property
    def names(self) -> tuple[str, ...]:
        """Effects and values that are named."""
        return (*self.group.effects, *self.group.wrong_parameters)

    def with_name(self, name: str) -> float:
        """Probability of a name in this group, alone or with others."""
        own = self.group.probabilities.items()
        return min(1.0, math.fsum(p for key, p in own if name in key.split("+")))


@dataclass(frozen=True, eq=False)
class Answer(Entry):
    """Answer of a result: what leads, where, with which probability, and if that is settled.

    Attributes
    ----------
    verdict : str
        Of the case.
    settled : bool
        Whether nothing is left open.
    why : str
        Why it is not: ``missed`` (the final model still misses too much), ``sets`` (the recordings
        cannot tell several answers apart), ``probability`` (below that from which an answer is
        settled), ``name`` (what is missing has none), ``unseen`` (nothing is seen, and the
        recordings would hardly show what may act), ``units`` (channels are read wrong); empty where
        it is.
    block : str or None
        Where the mismatch of what leads is; None where nothing is missing.
    names : list of str
        What leads: names, or ``none``, ``parameters``, ``unlisted``.
    probability : float
        Of what leads, in its group of blocks; where nothing is missing, that of all groups.
    missed : list of Missed
        What the final model still misses, the largest first.
    model : str
        Name of the final model.
    parts, quiet : list of Part
        Groups of blocks in which something is or may be missing or wrong, the leading one first,
        and those in which nothing is.
    """

    verdict: str
    settled: bool
    why: str
    block: str | None
    names: list[str]
    probability: float
    missed: list[Missed]
    model: str
    parts: list[Part] = field(metadata=NOT_WRITTEN)
    quiet: list[Part] = field(metadata=NOT_WRITTEN)

    @property
    def named(self) -> list[str]:
        """All names of all groups."""
        return [name for part in self.parts for name in part.names]

    def part_of(self, block: str | None) -> Part | None:
        """Answer about the group of blocks that has this one; None without such a group."""
        every = (*self.parts, *self.quiet)
        return next((part for part in every if block in part.group.blocks), None)


def chance_of(probabilities: Mapping[str, float], names: Iterable[str]) -> float:
    """Probability of a set of names, in whatever order its key has them; NaN where it is not among
    them.
    """
    wanted = set(names)
    found = (float(p) for key, p in probabilities.items() if set(key.split("+")) == wanted)
    return next(found, math.nan)


def answer_of(
    groups: Sequence[BlockVerdict],
    errors: Mapping[str, ChannelError],
    runs: Sequence[FreeRun],
    chances: Mapping[str, float],
    places: Mapping[str, str | None],
    *,
    enough: float = SETTLED,
    form: bool = False,
    other_law: bool = False,
) -> Answer:
    """Decide the answer that findings come to.

    Parameters
    ----------
    groups : sequence of BlockVerdict
        The groups of blocks that were judged, one at least.
    errors : mapping of str to ChannelError
        By channel, on the recordings that prove the answer.
    runs : sequence of FreeRun
        Of the whole rig.
    chances : mapping of str to float
        Probabilities of the case.
    places : mapping of str to (str or None)
        Blocks of values that are wrong, by their names.
    enough : float
        Probability above which an answer is settled.
    form : bool
        Whether the final model has a form of what has no name.
    other_law : bool
        Whether it has another law than the rig file: then that file is wrong.
    """
    missed = [*_missed_by_blocks(groups, errors), *_missed_by_whole(groups, runs)]
    every = [_part(group, places, enough) for group in groups]
    quiet = [p for p in every if p.group.verdict in HEALTHY and not p.names and p.sure]
    parts = [p for p in every if p not in quiet]
    parts.sort(key=lambda p: (not (p.names and p.sure), -_refit_noises(p, errors), -p.probability))
    leading = (parts or sorted(quiet, key=lambda p: p.probability))[0]
    names, chance = leading.words, leading.probability
    if missed and not parts:
        names, chance = ("unlisted",), chance_of(chances, ["unlisted"])
    open_ = any(len(p.left) > 1 for p in parts)
    sure = all(p.sure for p in parts)
    # that something acts which has no name decides nothing about what it is
    nameless = any(p.words == ("unlisted",) for p in parts)
    nothing = not (parts or missed or other_law)
    chance = math.prod(p.probability for p in quiet) if nothing else chance
    unseen = nothing and chance <= enough
    why = "unseen" if unseen else "name" if sure else "probability"
    settled = not missed and sure and not nameless and not unseen
    verdicts = [*(p.group.verdict for p in every), *["parameters"] * other_law]
    return Answer(
        verdict=case_verdict(verdicts, missed=bool(missed)),
        settled=settled,
        why="" if settled else "missed" if missed else "sets" if open_ else why,
        block=parts[0].block if parts else None,
        names=list(names),
        probability=chance,
        missed=missed,
        model=_model(every, changed=form or other_law),
        parts=parts,
        quiet=quiet,
    )


def _part(group: BlockVerdict, places: Mapping[str, str | None], enough: float) -> Part:
    """The answer about a group; none and parameters are one."""
    chances, names = group.probabilities, [*group.effects, *group.wrong_parameters]
    leading, together = tuple(names or [group.verdict]), False
    chance = chance_of(chances, leading)
    if names and chances and not chance >= max(chances.values()):
        # named by what its sets have in common
        shared = Part(group, None, ((leading, chance),), True, False)
        chance, together = min(map(shared.with_name, names)), True
    if not names and group.verdict in HEALTHY:
        chance = math.fsum(chances.get(key, 0.0) for key in HEALTHY) if chances else math.nan
    open_answers = [(leading, chance)]
    for other in group.ambiguity if len(group.ambiguity) > 1 else []:
        same = set(other) == set(leading) or (other[0] in HEALTHY and leading[0] in HEALTHY)
        open_answers += [] if same else [(tuple(other), chance_of(chances, other))]
    # effects that recordings would hardly show are a question about all groups together
    sure = len(open_answers) == 1 and not chance <= enough * (1.0 - group.unseen)
    return Part(group, _block(group, places), tuple(open_answers), together, sure)


def _block(group: BlockVerdict, places: Mapping[str, str | None]) -> str | None:
    """The block of a group that has the mismatch."""
    worst = max(group.mismatch, key=lambda m: m.fitted.refit.noises, default=None)
    more = worst is not None and worst.fitted.refit.more_than_noise
    wrong = [places.get(name) for name in group.wrong_parameters]
    every = (group.block, worst.block if worst and more else None, *wrong, *group.blocks)
    return next(filter(None, every), None)


def _refit_noises(part: Part, errors: Mapping[str, ChannelError]) -> float:
    """Error of the refitted model in the block of a part [noise levels]."""
    mismatch = next((m for m in part.group.mismatch if m.block == part.block), None)
    if mismatch is None:
        return 0.0
    error = errors.get(mismatch.channel)
    if error is None or not error.noise > 0.0 or not math.isfinite(error.refit):
        return mismatch.fitted.refit.noises
    return error.refit / error.noise


def _missed_by_blocks(
    groups: Sequence[BlockVerdict], errors: Mapping[str, ChannelError]
) -> list[Missed]:
    """Channels that the final model misses in its blocks, on the recordings of the proof, the
    largest first.
    """
    missed = []
    for group in groups:
        for mismatch in (m for m in group.mismatch if m.channel in errors):
            error = errors[mismatch.channel]
            own = _expected_error([group], error.refit, error.after, mismatch.model_error)
            more = beyond(error.after, error.noise, own)
            if more > MOST_MISSED:
                sizes = (error.after, error.before, error.after / error.noise)
                missed.append(Missed(mismatch.block, mismatch.channel, mismatch.unit, *sizes, more))
    return sorted(missed, key=lambda mismatch: -mismatch.beyond)


def _expected_error(
    groups: Sequence[BlockVerdict], before: float, after: float, own: float
) -> float:
    """Standard deviation of a channel by the error of its model, and by that of the equations that
    groups name, which err in proportion to what they explain.
    """
    named = any(g.effects for g in groups) and not any(g.wrong_parameters for g in groups)
    explained = before**2 - after**2
    return math.hypot(own, FORM_ERROR * math.sqrt(explained)) if named and explained > 0 else own


def _missed_by_whole(groups: Sequence[BlockVerdict], runs: Sequence[FreeRun]) -> list[Missed]:
    """Channels that the whole rig misses from its commands alone, whatever its values are inside
    what is known of them, the largest first; of each the recording that tells most.
    """
    own_errors = {m.channel: m.model_error for group in groups for m in group.mismatch}
    worst: dict[str, Missed] = {}
    off_channels = [(c, e) for run in runs for c, e in run.channels.items() if e.off and e.noise]
    for channel, error in off_channels:
        own = _expected_error(groups, error.before, error.after, own_errors.get(channel, 0.0))
        more = beyond(error.after, error.noise or 0.0, own)
        if more > max(MOST_MISSED, worst[channel].beyond if channel in worst else 0.0):
            sizes = (error.after, error.before, error.noises)
            worst[channel] = Missed(None, channel, error.unit, *sizes, more)
    return sorted(worst.values(), key=lambda missed: -missed.beyond)


def _model(parts: Sequence[Part], *, changed: bool) -> str:
    """Name of the final model."""
    if changed or any(p.names for p in parts):
        return MENDED
    return YOURS if all(p.group.verdict == "none" for p in parts) else REFITTED


def left_of(
    mismatch: BlockMismatch, error: ChannelError | None, stage: str, *, healthy: bool = False
) -> str:
    """Kind of what is left of a block's channel at a stage: noise, error of the model, or more.

    Parameters
    ----------
    mismatch : BlockMismatch
        What the block misses.
    error : ChannelError or None
        The channel's entry of the table of errors that proves the answer; None where it has none.
    stage : str
        ``before``, ``refit`` or ``after``.
    healthy : bool
        Whether nothing is missing in its group: what differs from curves of the model's error, and
        is no larger, is then that error.

    Returns
    -------
    str
        ``noise``; ``error``, where it is no more than noise and the error of the model explain; or
        ``more``.
    """
    if (mismatch.held_out or mismatch.fitted)[stage].more_than_noise and not healthy:
        return "more"
    if error is None or not error.noise > 0.0 or not error[stage] > NOISE_LEVELS * error.noise:
        return "noise"
    more = beyond(error[stage], error.noise, mismatch.model_error)
    return "more" if more > 0.0 else "error"
