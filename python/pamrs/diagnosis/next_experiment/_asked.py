"""What to record next: simulated with every hypothesis that has a model, where two or more are
left; else by the block in which the mismatch is, as commands that the rig can play.
"""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pamrs.diagnosis.evidence import Judged, is_parameter
from pamrs.diagnosis.fit import Problem, depends, without_term
from pamrs.diagnosis.next_experiment._choice import Hypothesis, apart, outcome_of, propose, spoken
from pamrs.diagnosis.next_experiment._differences import noise_of
from pamrs.diagnosis.next_experiment._words import words
from pamrs.diagnosis.prepare import Block, Prepared
from pamrs.effects import info_of, is_effect
from pamrs.errors import DiagnosisError, ParameterError, SimulationError
from pamrs.experiments import (
    Chain,
    Experiment,
    can_shut,
    chains_of,
    experiments_of,
    is_sealed,
    joined,
    protocol_of,
)
from pamrs.findings import HEALTHY, NextExperiment, PairExperiment
from pamrs.report.text import spoken_name
from pamrs.rig import Rig
from pamrs.rig.schema import qualified
from pamrs.simulation import has_frame, regulators_of

__all__ = ["next_to_record"]


@dataclass(frozen=True)
class _Telling:
    """What tells most about a block whatever is missing there.

    Attributes
    ----------
    kind : str
        Kind of an experiment of the library.
    text : str
        The same in words, for a rig of which the library makes none.
    shows : str
        What it shows.
    alone : bool
        Whether it moves one chain of several while the others are held.
    """

    kind: str
    text: str
    shows: str
    alone: bool = True


_TELLINGS = {name: _Telling(**own) for name, own in words("telling").items()}


def _telling(block: Block, rig: Rig, names: Iterable[str] = ()) -> _Telling:
    """What tells most about a block of a rig: about some names that are open there, as far as the
    catalogue says what tells them, else whatever is missing.
    """
    if block.mechanical:
        return _TELLINGS["strokes" if has_frame(rig) else "loops"]
    if is_sealed(rig):
        if _joining(block, rig):
            return _TELLINGS["over"]
        lines = rig.tables("line") or rig.tables("muscle")
        return _TELLINGS["blown" if lines else "once_more"]
    if regulators_of(rig) and not rig.tables("valve"):
        return _TELLINGS["set"]
    if not all(can_shut(rig, chain) for chain in _driving(block, rig)):
        return _TELLINGS["kept"]
    asked = {dict(info_of(n).excitation).get("kind") for n in names if is_effect(n)}
    if block.kind != "supply" and _TELLINGS["leaks"].kind in asked:
        return _TELLINGS["leaks"]
    return _TELLINGS["holds" if block.kind == "supply" else "shut"]


def _driving(block: Block, rig: Rig) -> list[Chain]:
    """The chains that drive a block: those whose pressure or joint it is, or else those of whose
    commands it is predicted, or else all.
    """
    chains = chains_of(rig)
    own = [c for c in chains if block.channel in (c.pressure, *c.moves)]
    return own or [c for c in chains if set(c.commands) & set(block.drives)] or chains


def _joining(block: Block, rig: Rig) -> list[str]:
    """Names of the chambers between which air blows over where nobody sends a command, that of the
    block first; none where no line joins its chamber to another one.
    """
    own = block.channel.partition(".")[2]
    if own in rig.tables("chamber"):
        reached = joined(rig, qualified("chamber", own))
        return [own, *reached] if reached else []
    return [n for n in rig.tables("chamber") if joined(rig, qualified("chamber", n))]


@dataclass(frozen=True, eq=False)
class _Question:
    """What is asked of a next experiment.

    Attributes
    ----------
    nominal : Rig
        The nominal model.
    judged : list of Judged
        The groups of blocks with their verdicts.
    blocks : list of Block
        All blocks.
    recordings : list of Prepared
        What there is already.
    problem : Problem
        Any of them, for its settings.
    made : dict
        What the library made for this rig so far, by the names that it was asked for.
    """

    nominal: Rig
    judged: list[Judged]
    blocks: list[Block]
    recordings: list[Prepared]
    problem: Problem
    made: dict[tuple[str, ...], Experiment | None] = field(default_factory=dict)

    @property
    def noise(self) -> dict[str, float]:
        """Sample noise of the channels that all recordings have [SI]."""
        common = set.intersection(*(set(p.noise) for p in self.recordings))
        return {
            channel: float(np.median([p.noise[channel] for p in self.recordings]))
            for channel in sorted(common)
        }

    def place(self, names: Iterable[str]) -> Block:
        """The block that a question about some names is about: where the group that has one of them
        keeps its mismatch, or else the group that is most likely to lack what has no name.
        """
        own = {n for n in names if is_effect(n) or is_parameter(n)}

        def merit(judged: Judged) -> tuple[bool, bool, float]:
            there = {n for s in judged.ambiguity for n in s} | {*judged.named, *judged.wrong}
            kept = judged.group.mismatch is not None
            return bool(own & there), kept, judged.probabilities.get("unlisted", 0.0)

        group = max(self.judged, key=merit).group
        acting = [b for b in group.blocks if any(depends(b, n) for n in own)]
        found = group.mismatch
        if found is not None and (found in acting or not acting):
            return found
        return acting[0] if acting else group.blocks[-1]

    def experiment(
        self, block: Block, open_: Iterable[str] = ()
    ) -> tuple[str, str, Experiment | None]:
        """What to do about a block, of which some names are open, what it shows, and the experiment
        where the library makes it for this rig.
        """
        telling, rig = _telling(block, self.nominal, open_), self.nominal
        names = [telling.kind]
        if telling is _TELLINGS["over"]:
            names = [f"{telling.kind}.{name}" for name in _joining(block, rig)]
        elif telling.alone and len(chains_of(rig)) > 1:  # no chain but those that drive the block
            names = [f"{telling.kind}.{chain.name}" for chain in _driving(block, rig)]
        made = self._made(tuple(names))
        return telling.text if made is None else made.text, telling.shows, made

    def answer(self, begin: str, block: Block, names: Iterable[str] = ()) -> NextExperiment:
        """What to record about a block, behind the words that say why."""
        what, shows, experiment = self.experiment(block, names)
        kind = {"kind": _telling(block, self.nominal, names).kind, "block": block.name}
        text = f"{begin}: {what}; {shows}."
        if experiment is None:
            return NextExperiment(text, kind)
        excitation = kind | experiment.excitation
        return NextExperiment(text, excitation, protocol=protocol_of(experiment))

    def _made(self, names: tuple[str, ...]) -> Experiment | None:
        """The first experiment of some names that the library makes for this rig; None where it
        makes none of them.
        """
        if names not in self.made:
            found: list[Experiment] = []
            records = [p.recording for p in self.recordings]
            settings = self.problem.settings
            with contextlib.suppress(DiagnosisError, ParameterError, SimulationError):
                found = experiments_of(self.nominal, records, settings, names)
            by_name = {experiment.name: experiment for experiment in found}
            self.made[names] = next((by_name[n] for n in names if n in by_name), None)
        return self.made[names]


def next_to_record(
    verdict: str,
    ambiguity: list[list[str]],
    hypotheses: Sequence[Hypothesis],
    nominal: Rig,
    judged: list[Judged],
    fitted: Problem,
    held: Problem,
    off: Sequence[str] = (),
) -> NextExperiment:
    """What to record next.

    Parameters
    ----------
    verdict : str
        Of the case.
    ambiguity : list of list of str
        Sets of names that are left open.
    hypotheses : sequence of (label, rig, probability)
        Those that have a model, as fitted.
    nominal : Rig
        The nominal model.
    judged : list of Judged
        The groups with their verdicts.
    fitted, held : Problem
        Recordings to fit and held-out ones (the same object when there are no others).
    off : sequence of str
        Channels that the whole rig misses from its commands alone, the worst first.

    Returns
    -------
    NextExperiment
        With what tells each open pair apart, and commands that the rig can play.
    """
    recordings = [*fitted.recordings, *(held.recordings if held is not fitted else [])]
    asked = _Question(nominal, judged, fitted.blocks, recordings, fitted)
    same = same_data(ambiguity)
    simulated: NextExperiment | None = None
    if ambiguity and len(hypotheses) > 1 and not same:
        with contextlib.suppress(
            DiagnosisError, ParameterError, SimulationError
        ):  # a rig that no experiment of the library suits
            simulated = propose(
                nominal,
                hypotheses,
                asked.noise,
                recordings,
                settings=fitted.settings,
                losses=fitted.losses,
            )
    if simulated is not None and not simulated.excitation:
        simulated = None  # of what is open one has a model
    known = simulated.pairs if simulated is not None else []
    pairs = _pairs(asked, ambiguity, hypotheses, known)
    if simulated is not None:
        return replace(simulated, pairs=pairs)
    if same:
        return NextExperiment(same, pairs=pairs)
    return replace(_told(asked, verdict, ambiguity, off), pairs=pairs)


def _told(
    asked: _Question, verdict: str, ambiguity: list[list[str]], off: Sequence[str]
) -> NextExperiment:
    """What to record where no two hypotheses could be simulated."""
    missing = [
        j.group.mismatch
        for j in asked.judged
        if j.verdict == "unlisted" and j.group.mismatch is not None
    ]
    if not ambiguity and verdict != "unlisted" and not missing and off:
        return _of_whole(asked, off[0])
    if not ambiguity and verdict != "unlisted" and not missing:
        several = sum(len(j.named) + len(j.wrong) for j in asked.judged) > 1
        text = (
            "The names are settled by these recordings; no further one is needed for them."
            if several and verdict not in HEALTHY
            else f"The {'answer' if verdict in HEALTHY else 'name'} is settled by these "
            "recordings; no further one is needed for it."
        )
        return NextExperiment(text, {}, 0.0)
    names = [name for names in ambiguity for name in names]
    measurable = [n for n in names if is_parameter(n)]
    if measurable and all(is_parameter(n) for n in names):
        return NextExperiment(_measured(measurable) + ".")
    settled = not ambiguity and verdict != "unlisted"
    block = missing[0] if missing and not ambiguity else asked.place(names or [verdict])
    if not settled:
        return asked.answer(f"For the {spoken_name(block.name)}", block, names)
    rest = " and ".join(dict.fromkeys(spoken_name(b.name) for b in missing))
    begin = f"The name is settled. For the rest of the residual in the {rest}"
    return asked.answer(begin, block, names)


def _of_whole(asked: _Question, channel: str) -> NextExperiment:
    """What to record where the blocks fit one by one and the whole rig misses a channel."""
    begin = f"The whole rig misses the {spoken_name(channel)}, and no judged block shows why"
    block = next((b for b in asked.blocks if b.channel == channel), None)
    if block is None:
        return NextExperiment(
            f"{begin}: record the channels between it and the commands as well, so that "
            "the blocks that were not judged can be."
        )
    return asked.answer(f"{begin}. For the {spoken_name(block.name)}", block)


def _pairs(
    asked: _Question,
    ambiguity: list[list[str]],
    hypotheses: Sequence[Hypothesis],
    known: Sequence[PairExperiment],
) -> list[PairExperiment]:
    """What tells each two of the sets that are left open from each other; that something else is
    missing beside a name is a question by itself.
    """
    sets = [[n for n in names if n != "unlisted" or len(names) == 1] for names in ambiguity]
    if any("unlisted" in names for names in ambiguity):
        sets.append(["unlisted"])
    unique = list({frozenset(names): names for names in sets}.values())
    found = []
    for one, other in itertools.combinations(unique, 2):
        labels = ["+".join(one), "+".join(other)]
        simulated = next((p for p in known if _same(p.between, labels)), None)
        found.append(
            replace(simulated, between=labels)
            if simulated is not None
            else _pair(asked, one, other, hypotheses)
        )
    return found


def _same(one: Sequence[str], other: Sequence[str]) -> bool:
    """Whether two pairs of labels are of the same names."""

    def names(labels: Sequence[str]) -> set[frozenset[str]]:
        # whether parameters moved inside their tolerances is no other answer
        plain = ("none" if label in HEALTHY else label for label in labels)
        return {frozenset(label.split("+")) for label in plain}

    return names(one) == names(other)


def _pair(
    asked: _Question, one: list[str], other: list[str], hypotheses: Sequence[Hypothesis]
) -> PairExperiment:
    """What tells two sets apart that were not both simulated."""
    labels = ["+".join(one), "+".join(other)]
    same = same_data([one, other])
    if same:
        return PairExperiment(labels, same)
    differing = sorted(set(one) ^ set(other))
    block = asked.place([*one, *other])
    what, shows, experiment = asked.experiment(block, [*one, *other])
    kind = "" if experiment is None else experiment.name
    if "unlisted" not in differing:
        values = [n for n in differing if is_parameter(n)]
        if values:
            return PairExperiment(
                labels,
                f"{_measured(values)}; or, for the {spoken_name(block.name)}: {what}; {shows}.",
                kind,
            )
        effects = [n for n in differing if is_effect(n)]
        why = f" {spoken(effects[0])}: {info_of(effects[0]).separates}." if effects else ""
        return PairExperiment(
            labels, f"For the {spoken_name(block.name)}: {what}; {shows}.{why}", kind
        )
    names = next(names for names in (one, other) if "unlisted" not in names)
    listed = "+".join(names)
    text = (
        f"For the {spoken_name(block.name)}: {what}. A model with {spoken(listed)} has to predict "
        "that to the noise without another fit; what it misses is not listed"
    )
    values = [n for n in names if is_parameter(n)]
    told = _weight(asked, set(names), hypotheses, experiment)
    if told is not None:
        channel, size = told
        text += (
            f" (without {spoken(listed)} the model would miss the {spoken_name(channel)} by "
            f"{size:.2g} times the noise level)"
        )
    text += f". {_measured(values)}." if values else "."
    return PairExperiment(labels, text, kind, None if told is None else told[1])


def _weight(
    asked: _Question,
    names: set[str],
    hypotheses: Sequence[Hypothesis],
    experiment: Experiment | None,
) -> tuple[str, float] | None:
    """What a model without some names misses of what they do in an experiment: channel and noise
    levels; None where it cannot be simulated.
    """
    of = {frozenset(label.split("+")): rig for label, rig, _ in hypotheses}
    own = next((rig for label, rig in of.items() if names and names <= label), None)
    effects = [n for n in names if is_effect(n)]
    if own is None or experiment is None or not effects:
        return None
    bare = own
    for effect in effects:
        bare = without_term(bare, effect)
    settings = asked.problem.settings
    channels = tuple(asked.recordings[0].recording.channels)
    noise = {**noise_of(asked.nominal), **asked.noise}
    pair = [("with", own, 0.5), ("without", bare, 0.5)]
    with contextlib.suppress(DiagnosisError, ParameterError, SimulationError):
        return apart(outcome_of(experiment, pair, noise, channels, settings), 0, 1, nested=True)
    return None


def _measured(names: Sequence[str]) -> str:
    """How values of the rig file are told from what looks like them."""
    return (
        f"Measure the {' or the '.join(map(spoken_name, names))} by itself (scale, ruler, known "
        "volume): these recordings cannot tell which is wrong"
    )


def same_data(ambiguity: list[list[str]]) -> str:
    """What tells the two most probable sets apart where they are the same data; empty where they
    are not.
    """
    for one, other in itertools.permutations([set(s) for s in ambiguity[:2]], 2):
        for effect in one:
            for same in info_of(effect).same_data if is_effect(effect) else ():
                if other == one - {effect} | {same.effect}:
                    return same.told_by
    return ""
