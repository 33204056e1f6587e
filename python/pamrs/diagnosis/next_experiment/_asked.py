"""Next experiment of a diagnosis, by simulation where hypotheses have models, else by block."""

from __future__ import annotations

import contextlib
import itertools
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pamrs.channels import block_of
from pamrs.diagnosis.evidence import Judged
from pamrs.diagnosis.fit import Problem, concerns, without_term
from pamrs.diagnosis.next_experiment._choice import (
    Modelled,
    apart,
    outcome_of,
    parts_any,
    propose,
)
from pamrs.diagnosis.next_experiment._differences import noise_of
from pamrs.diagnosis.next_experiment._words import words
from pamrs.diagnosis.prepare import Block, Prepared
from pamrs.effects import NONE, PARAMETERS, UNLISTED, Hypothesis, Term
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
from pamrs.findings import Findings, Limit, NextExperiment, PairExperiment, Part
from pamrs.report.sentences import left_in
from pamrs.report.words import capital, hypothesis_label, spoken_name
from pamrs.rig import Rig
from pamrs.rig.schema import qualified
from pamrs.simulation import has_frame, supplies_of


@dataclass(frozen=True)
class _Telling:
    """Experiment that shows most about a block, whatever is missing there.

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


def _telling(block: Block, rig: Rig, terms: Iterable[Term] = ()) -> _Telling:
    """Experiment that shows most about a block of a rig: of the terms that are open there, as far
    as the catalogue names one for them, else of whatever is missing.
    """
    if block.mechanical:
        return _TELLINGS["strokes" if has_frame(rig) else "loops"]
    if is_sealed(rig):
        if _joining(block, rig):
            return _TELLINGS["over"]
        lines = rig.tables("line") or rig.tables("muscle")
        return _TELLINGS["blown" if lines else "once_more"]
    if supplies_of(rig, "regulator") and not rig.tables("valve"):
        return _TELLINGS["set"]
    if not all(can_shut(rig, chain) for chain in _driving(block, rig)):
        return _TELLINGS["kept"]
    asked = {dict(term.info.excitation).get("kind") for term in terms if term.is_effect}
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
    own = block_of(block.channel)
    if own in rig.tables("chamber"):
        reached = joined(rig, qualified("chamber", own))
        return [own, *reached] if reached else []
    return [n for n in rig.tables("chamber") if joined(rig, qualified("chamber", n))]


@dataclass(frozen=True, eq=False)
class _Question:
    """Models, blocks and recordings from which a next experiment is chosen.

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
        """Sample noise of the channels that all recordings measure [SI]; simulated have none."""
        common = set.intersection(*({*p.noise} - {*p.simulated} for p in self.recordings))
        return {
            channel: float(np.median([p.noise[channel] for p in self.recordings]))
            for channel in sorted(common)
        }

    def place(self, terms: Iterable[Term]) -> Block:
        """The block that a question about some terms is about: where the group that has one of them
        keeps its mismatch, or else the group that is most likely to lack what has no name.
        """
        own = set(terms)

        def merit(judged: Judged) -> tuple[bool, bool, float]:
            there = {*judged.added, *(term for h in judged.ambiguity for term in h.terms)}
            kept = judged.group.mismatch is not None
            return bool(own & there), kept, judged.probabilities.get(UNLISTED, 0.0)

        group = max(self.judged, key=merit).group
        acting = [b for b in group.blocks if any(concerns(term, b) for term in own)]
        found = group.mismatch
        if found is not None and (found in acting or not acting):
            return found
        return acting[0] if acting else group.blocks[-1]

    def experiment(
        self, block: Block, open_: Iterable[Term] = ()
    ) -> tuple[str, str, Experiment | None]:
        """Words on what to do about a block with some open terms, words on what that shows, and the
        experiment where the library makes it for this rig.
        """
        telling, rig = _telling(block, self.nominal, open_), self.nominal
        names = [telling.kind]
        if telling is _TELLINGS["over"]:
            names = [f"{telling.kind}.{name}" for name in _joining(block, rig)]
        elif telling.alone and len(chains_of(rig)) > 1:  # no chain but those that drive the block
            names = [f"{telling.kind}.{chain.name}" for chain in _driving(block, rig)]
        made = self._made(tuple(names))
        return telling.text if made is None else made.text, telling.shows, made

    def answer(self, begin: str, block: Block, terms: Iterable[Term] = ()) -> NextExperiment:
        """Next experiment about a block, after words that say why."""
        what, shows, experiment = self.experiment(block, terms)
        kind = {"kind": _telling(block, self.nominal, terms).kind, "block": block.name}
        text, instruction = f"{begin}: {what}; {shows}.", f"{capital(what)}."
        if experiment is None:
            return NextExperiment(text, kind, instruction=instruction)
        excitation, played = kind | experiment.excitation, protocol_of(experiment)
        return NextExperiment(text, excitation, protocol=played, instruction=instruction)

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
    diagnosis: Findings,
    ambiguity: list[Hypothesis],
    hypotheses: Sequence[Modelled],
    nominal: Rig,
    judged: list[Judged],
    fit_problem: Problem,
    held_out_problem: Problem,
) -> NextExperiment:
    """Choose what to record next.

    Parameters
    ----------
    diagnosis : Findings
        What was found: its answer is asked about.
    ambiguity : list of Hypothesis
        Those that are left open.
    hypotheses : sequence of (label, rig, probability)
        Those that have a model, as fitted.
    nominal : Rig
        The nominal model.
    judged : list of Judged
        The groups with their verdicts.
    fit_problem, held_out_problem : Problem
        Recordings to fit and held-out ones (the same object when there are no others).

    Returns
    -------
    NextExperiment
        With what tells each open pair apart, and commands that the rig can play.
    """
    recordings = [
        *fit_problem.recordings,
        *(held_out_problem.recordings if held_out_problem is not fit_problem else []),
    ]
    asked = _Question(nominal, judged, fit_problem.blocks, recordings, fit_problem)
    same = same_data(ambiguity)
    simulated: NextExperiment | None = None
    first = _first_asked(diagnosis)
    if first is not None and len(first.left) > 1 and len(hypotheses) > 1 and not same:
        with contextlib.suppress(
            DiagnosisError, ParameterError, SimulationError
        ):  # a rig that no experiment of the library suits
            simulated = propose(
                nominal,
                hypotheses,
                asked.noise,
                recordings,
                settings=fit_problem.settings,
                losses=fit_problem.losses,
            )
    pairs = _pairs(asked, ambiguity, hypotheses, simulated.pairs if simulated is not None else [])
    if simulated is not None and not (
        simulated.excitation and (parts_any(simulated) or UNLISTED not in ambiguity)
    ):
        simulated = None  # of what is open one has a model, or what has none is the question
    if simulated is None:
        simulated = NextExperiment(same) if same else _without_models(asked, diagnosis)
    return replace(simulated, pairs=pairs, hypotheses=list(hypotheses), noise=asked.noise)


def _first_asked(diagnosis: Findings) -> Part | None:
    """The group of blocks that is asked about first: one that still misses much, one with several
    answers left, one without a name; else one that keeps more than noise, one that is not sure, or
    the one that leads, if anything does.
    """
    answer = diagnosis.answer
    missed = (answer.part_of(own.block) for own in answer.missed if own.block)
    # several answers first, then none that has a name
    open_ = sorted(
        (p for p in answer.parts if len(p.left) > 1 or p.group.verdict == "unlisted"),
        key=lambda part: len(part.left) == 1,
    )
    rest = sorted(
        () if answer.missed else answer.parts,
        key=lambda part: (left_in(diagnosis, part.block or "") != "more", part.sure),
    )
    return next(filter(None, itertools.chain(missed, open_, rest)), None)


def _without_models(asked: _Question, diagnosis: Findings) -> NextExperiment:
    """Next experiment where no two hypotheses could be simulated."""
    answer = diagnosis.answer
    part = _first_asked(diagnosis)
    if answer.settled:
        what = "answer" if not answer.named else "names" if len(answer.named) > 1 else "name"
        settled = "are settled" if what == "names" else "is settled"
        text = f"The {what} {settled} by these recordings; no further one is needed."
        return NextExperiment(text, {}, 0.0)
    if answer.why == "unseen":
        return _of_unseen(asked, diagnosis.limits)
    if part is None:
        return _of_whole(asked, diagnosis)
    left = [Hypothesis.of(own) for own, _ in part.left]
    terms = [term for hypothesis in left for term in hypothesis.terms]
    values = all(term.is_value for term in terms) and all(h.terms and not h.rest for h in left)
    if len(left) > 1 and values:
        return NextExperiment(_measured(list(dict.fromkeys(terms)), asked.nominal) + ".")
    missed = [own.block for own in answer.missed if own.block in part.group.blocks]
    name = next(iter([*missed, part.block]))
    block = next((b for b in asked.blocks if b.name == name), asked.blocks[-1])
    sure = not answer.missed and all(own.sure for own in answer.parts)
    begin = "The name is settled. " if answer.named and sure else ""
    return asked.answer(f"{begin}For the {spoken_name(block.name)}", block, terms)


def _of_unseen(asked: _Question, limits: Iterable[Limit]) -> NextExperiment:
    """Next experiment where nothing is seen to be missing: about the block in which most effects of
    usual size would hardly be seen.
    """
    hidden = Counter(limit.block for limit in limits if limit.verdict == "not seen")
    block = max(asked.blocks, key=lambda b: hidden[b.name])
    return asked.answer(
        f"Most of what these recordings would hardly show acts in the {spoken_name(block.name)}. "
        "There",
        block,
    )


def _of_whole(asked: _Question, diagnosis: Findings) -> NextExperiment:
    """Next experiment where the blocks fit one by one and the whole rig misses channels: about the
    block that keeps more than noise, if within the error of its model, or else the first along the
    chain, where the error begins.
    """
    off = [own.channel for own in diagnosis.answer.missed]
    there = [b for b in asked.blocks if b.channel in off]
    kept = [
        b for kind in ("more", "error") for b in asked.blocks if left_in(diagnosis, b.name) == kind
    ]
    block = next(iter([*kept, *there]), None)
    channel = block.channel if block and block.channel in off else off[0]
    begin = f"The whole rig misses the {spoken_name(channel)}, and no judged block shows why"
    if block is None:
        what = "record the channels between it and the commands as well"
        text = f"{begin}: {what}, so that the blocks that were not judged can be."
        return NextExperiment(text, instruction=f"{capital(what)}.")
    return asked.answer(f"{begin}. For the {spoken_name(block.name)}", block)


def _pairs(
    asked: _Question,
    ambiguity: list[Hypothesis],
    hypotheses: Sequence[Modelled],
    known: Sequence[PairExperiment],
) -> list[PairExperiment]:
    """Experiments that separate each two of the open sets; that something without a name is missing
    as well is a question of its own.
    """
    alone = [Hypothesis(h.terms) if h.terms else h for h in ambiguity]
    alone += [UNLISTED for h in ambiguity if h.rest == UNLISTED.rest]
    unique = dict.fromkeys(alone)
    found = []
    for one, other in itertools.combinations(unique, 2):
        simulated = next((p for p in known if _same(p.between, (one, other))), None)
        found.append(
            replace(simulated, between=[str(one), str(other)])
            if simulated is not None
            else _pair(asked, one, other, hypotheses)
        )
    return found


def _same(labels: Sequence[str], pair: Sequence[Hypothesis]) -> bool:
    """True where two labels are those of a pair of hypotheses, `PARAMETERS` counted as `NONE`."""
    # whether parameters moved inside their tolerances is no other answer
    one, other = (
        {NONE if hypothesis == PARAMETERS else hypothesis for hypothesis in several}
        for several in (map(Hypothesis.parse, labels), pair)
    )
    return one == other


def _pair(
    asked: _Question, one: Hypothesis, other: Hypothesis, hypotheses: Sequence[Modelled]
) -> PairExperiment:
    """Experiment that separates two hypotheses of which not both were simulated."""
    labels = [str(one), str(other)]
    same = same_data([one, other])
    if same:
        return PairExperiment(labels, same)
    both = [*one.terms, *other.terms]
    block = asked.place(both)
    what, shows, experiment = asked.experiment(block, both)
    kind = "" if experiment is None else experiment.name
    if UNLISTED not in (one, other):
        differing = sorted(one.set ^ other.set)
        values = [term for term in differing if term.is_value]
        if values:
            return PairExperiment(
                labels,
                f"{_measured(values, asked.nominal)}; or, for the {spoken_name(block.name)}: "
                f"{what}; {shows}.",
                kind,
            )
        effect = next((term for term in differing if term.is_effect), None)
        why = f" {hypothesis_label(str(effect))}: {effect.info.separates}." if effect else ""
        return PairExperiment(
            labels, f"For the {spoken_name(block.name)}: {what}; {shows}.{why}", kind
        )
    listed = other if one == UNLISTED else one
    name = hypothesis_label(str(listed))
    text = (
        f"For the {spoken_name(block.name)}: {what}. A model with {name} has to "
        "predict that to the noise without another fit; what it misses is not listed"
    )
    values = [term for term in listed.terms if term.is_value]
    missed = _missed_without(asked, listed.set, hypotheses, experiment)
    if missed is not None:
        channel, size = missed
        text += (
            f" (without {name} the model would miss the {spoken_name(channel)} by "
            f"{size:.2g} times the noise level)"
        )
    text += f". {_measured(values, asked.nominal)}." if values else "."
    return PairExperiment(labels, text, kind, None if missed is None else missed[1])


def _missed_without(
    asked: _Question,
    terms: frozenset[Term],
    hypotheses: Sequence[Modelled],
    experiment: Experiment | None,
) -> tuple[str, float] | None:
    """Channel and noise levels by which a model without some terms misses an experiment; None where
    it cannot be simulated.
    """
    models = ((Hypothesis.parse(label), rig) for label, rig, _ in hypotheses)
    own = next((rig for known, rig in models if terms and terms <= known.set), None)
    effects = [term for term in terms if term.is_effect]
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


def _measured(values: Sequence[Term], rig: Rig) -> str:
    """Sentence that asks to measure values of the rig file by themselves."""
    ways, names = words("measured"), list[str]()
    for term in values:
        known = rig.parameters.get(term.id)
        way = ways.get(term.id.rpartition(".")[2], ways.get(known.unit) if known else None)
        names.append(spoken_name(term.id) + (f" ({way})" if way else ""))
    return (
        f"Measure the {' or the '.join(names)} by itself: these recordings cannot tell which is "
        "wrong"
    )


def same_data(ambiguity: list[Hypothesis]) -> str:
    """Words on what separates the two likeliest hypotheses if they are the same data, or empty."""
    for one, other in itertools.permutations(ambiguity[:2], 2):
        for term in one.terms if one.rest == other.rest else ():
            for same in term.info.same_data if term.is_effect else ():
                if other.set == one.set - {term} | {Term(same.effect)}:
                    return same.told_by
    return ""
