"""Next experiment: each one that the rig can do, simulated with every hypothesis that is left, and
the information that it would give.

Every hypothesis answers to the same commands. Its answer becomes a recording without noise, and
every other hypothesis has to explain it through the cut chain, its own parameters and the
baseline's free to move inside what is known. What it cannot explain is a distance, and the
distances of all pairs say how much of the present uncertainty the experiment removes.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pamrs._arrays import Array
from pamrs._losses import Losses
from pamrs.channels import channel_of, unit_of
from pamrs.diagnosis.fit import Problem, acts_in, two_at_a_time
from pamrs.diagnosis.limits import counted
from pamrs.diagnosis.next_experiment._differences import (
    Errors,
    Linear,
    ResidualDifference,
    checked_channels,
    difference,
    elsewhere,
    errors_of,
    judged_alike,
    linear,
    measurable,
    noise_of,
    problem_of,
    taken,
)
from pamrs.diagnosis.noise import bins_of
from pamrs.diagnosis.prepare import Prepared, prepare
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import Term
from pamrs.errors import DiagnosisError, ParameterError, SimulationError
from pamrs.experiments import Experiment, experiments_of, protocol_of
from pamrs.findings import Curves, NextExperiment, PairExperiment, RankedExperiment
from pamrs.recordings import Recording
from pamrs.report.words import format_number, hypothesis_label, spoken_name
from pamrs.rig import Rig
from pamrs.simulation import Simulation, core_rig, reading

# hypotheses that are simulated, the most probable ones (every pair is compared), and experiments in
# the ranking
_MOST_COMPARED = 6
# [bit] information that counts: below it an experiment parts nothing, and of two that differ by
# less the cheaper one is better
_RESOLUTION = 0.05
_HOPELESS_SHARE = 0.1  # share of the uncertainty below which the text suggests another sensor
# ratio of distances to the best recording that there is, below which an experiment adds nothing: a
# pair that such a recording leaves open is not decided by another one that shows as much
_MORE = 1.5


Modelled = tuple[str, Rig, float]
"""A hypothesis with a model: its text, the rig and its probability."""


def entropy(probabilities: Sequence[float]) -> float:
    """Entropy of probabilities, which need not add to one [bit]."""
    total = sum(probabilities)
    return -sum(p / total * math.log2(p / total) for p in probabilities if p > 0.0)


def information(probabilities: Sequence[float], distance: Array) -> float:
    """Mutual information between hypothesis and outcome, from the distances of all pairs.

    Every hypothesis predicts a Gaussian outcome of the same spread; the lower bound of Kolchinsky &
    Tracey (2017) by Bhattacharyya distances, ``-sum_i p_i log2 sum_j p_j exp(-D_ij/8)``, lies
    between 0 and the entropy of the hypotheses.

    Parameters
    ----------
    probabilities : sequence of float, length h
        Of the hypotheses; need not add to one.
    distance : (h, h) array
        Squared distance, on the effective number of samples, that hypothesis j keeps from the
        outcome of hypothesis i.

    Returns
    -------
    float
        [bit]
    """
    p = np.asarray(probabilities, dtype=np.float64)
    p = p / p.sum()
    there = p > 0.0
    mixed = np.exp(-0.125 * np.clip(distance, 0.0, None)) @ p
    return min(max(0.0, -float(p[there] @ np.log2(mixed[there]))), entropy(list(p)))


@dataclass(frozen=True, eq=False)
class Outcome:
    """Outcome of an experiment, simulated with every hypothesis, and its expected information.

    Attributes
    ----------
    experiment : Experiment
        Which one.
    sensor : str
        Channel that must be measured besides those there are; empty for none.
    probabilities : sequence of float
        Of the hypotheses.
    runs : list of Simulation
        One for each hypothesis.
    left : dict of (int, int) to ResidualDifference
        What hypothesis j leaves of the outcome of hypothesis i.
    distance : (h, h) array
        Its sum of squares on the effective number of samples.
    problems : list of Problem
        Blocks, and the recording of each hypothesis.
    models : list of Linear
        Each hypothesis on its own recording.
    errors : dict
        Noise and error of the leading model, in the bins of the experiment.
    effort : float
        What it costs, a sensor included, as time [s].
    shown : (h, h) array
        Squared distance of each pair in the recording that shows most of it by now.
    """

    experiment: Experiment
    sensor: str
    probabilities: Sequence[float]
    runs: list[Simulation]
    left: dict[tuple[int, int], ResidualDifference]
    distance: Array
    problems: list[Problem]
    models: list[Linear]
    errors: Errors
    effort: float
    shown: Array

    @property
    def bits(self) -> float:
        """Expected information about the model, by pairs that it shows clearly better than the
        recordings that there are [bit].
        """
        better = self.distance >= _MORE**2 * self.shown
        return information(self.probabilities, np.where(better, self.distance, 0.0))

    @property
    def problem(self) -> Problem:
        """Blocks, and the recording of the leading hypothesis."""
        return self.problems[0]

    def exactly(self, pairs: Sequence[tuple[int, int]]) -> Outcome:
        """Outcome in which what j leaves of the outcome of i is computed anew, with the
        sensitivities that j has there, for some pairs (i, j) of hypotheses.
        """

        def there(problem: Problem, model: Linear) -> Linear:
            return linear(problem, model.rig)

        left = self.left | _left_by(pairs, self.problems, self.models, self.errors, there)
        distance = self.distance.copy()
        for pair in pairs:
            distance[pair] = left[pair].total
        return replace(self, left=left, distance=distance)


def _left_by(
    pairs: Sequence[tuple[int, int]],
    problems: Sequence[Problem],
    models: Sequence[Linear],
    errors: Errors,
    there: Callable[[Problem, Linear], Linear],
) -> dict[tuple[int, int], ResidualDifference]:
    """Rest of the recording of hypothesis i that hypothesis j leaves, for pairs (i, j); `there`
    gives a model on the recording of another one.
    """

    def missed(pair: tuple[int, int]) -> ResidualDifference:
        i, j = pair
        return difference(problems[i], models[i].found, there(problems[i], models[j]), errors)

    return dict(zip(pairs, two_at_a_time(missed, pairs), strict=True))


def _telling(problem: Problem, rigs: Sequence[Rig]) -> Problem:
    """The blocks in which hypotheses differ: those where an effect acts that not all of them have;
    all where none does.
    """
    sets = [set(map(Term.of, rig.effects)) for rig in rigs]
    shared: set[Term] = set.intersection(*sets) if len({frozenset(s) for s in sets}) > 1 else set()
    disputed = set.union(*sets) - shared
    blocks = [b for b in problem.blocks if any(acts_in(effect, b) for effect in disputed)]
    return replace(problem, blocks=blocks or problem.blocks)


def outcome_of(
    experiment: Experiment,
    hypotheses: Sequence[Modelled],
    noise: Mapping[str, float],
    channels: tuple[str, ...],
    settings: DiagnosisSettings,
    sensor: str = "",
    runs: Sequence[Simulation] | None = None,
    ranking: bool = False,
) -> Outcome:
    """Simulate an experiment with every hypothesis, and compare every pair.

    Where experiments are only ranked, each hypothesis has the sensitivities that it has on its own
    recordings, which are worked out once; :meth:`Outcome.exactly` gives what is reported.

    Parameters
    ----------
    experiment : Experiment
        Which one.
    hypotheses : sequence of (label, rig, probability)
        Rigs with their effects.
    noise : mapping of str to float
        Sample noise by channel [SI].
    channels : tuple of str
        Measured ones, besides ``sensor``.
    settings : DiagnosisSettings
        How they are compared.
    sensor : str
        One more.
    runs : sequence of Simulation, optional
        The experiment with every hypothesis, where it was simulated before.
    ranking : bool
        Whether it is only ranked among others.

    Raises
    ------
    SimulationError
        If a hypothesis leaves the range in which its model holds.
    DiagnosisError
        If the channels surround no block.
    """
    rigs = [experiment.changed(rig) for _, rig, _ in hypotheses]
    if runs is None:
        runs = two_at_a_time(experiment.simulate, [rig for _, rig, _ in hypotheses])
    # a gas may have a temperature with one hypothesis and none with another
    able = [measurable(rig) for rig in rigs]
    measured = tuple(
        c for c in (*channels, *((sensor,) if sensor else ())) if all(c in one for one in able)
    )
    heard = {c: v for c, v in noise.items() if c in measured}

    def cut(one: tuple[Rig, Simulation]) -> Problem:
        rig, run = one
        recording = taken(run, rig, experiment.name, heard, settings)
        return _telling(problem_of(rig, [recording], measured, settings), rigs)

    problems = judged_alike(two_at_a_time(cut, zip(rigs, runs, strict=True)))
    own = two_at_a_time(lambda one: linear(*one), zip(problems, rigs, strict=True))
    errors = errors_of(problems[0], own[0], [p for q in problems[1:] for p in q.recordings])

    pairs = list(itertools.permutations(range(len(rigs)), 2))
    left = _left_by(pairs, problems, own, errors, elsewhere) if ranking else {}
    distance = np.zeros((len(rigs), len(rigs)))
    for pair, found in left.items():
        distance[pair] = found.total
    outcome = Outcome(
        experiment=experiment,
        sensor=sensor,
        probabilities=[p for _, _, p in hypotheses],
        runs=list(runs),
        left=left,
        distance=distance,
        problems=problems,
        models=own,
        errors=errors,
        effort=experiment.effort + (settings.sensor_effort if sensor else 0.0),
        shown=np.zeros_like(distance),
    )
    return outcome if ranking else outcome.exactly(pairs)


def shown_by(
    recordings: Sequence[Prepared],
    hypotheses: Sequence[Modelled],
    channels: tuple[str, ...],
    settings: DiagnosisSettings,
) -> Array:
    """Squared distance (h, h) that hypothesis j keeps from the readings of hypothesis i in the
    recording that shows most of it; zero where none can be predicted by all.
    """
    rigs = [rig for _, rig, _ in hypotheses]
    shown = np.zeros((len(rigs), len(rigs)))
    for prepared in recordings:
        with contextlib.suppress(DiagnosisError, SimulationError):
            problem = _telling(problem_of(rigs[0], [prepared], channels, settings), rigs)
            models = two_at_a_time(partial(linear, problem), rigs)
            pairs = list(itertools.permutations(range(len(rigs)), 2))
            alike = [problem] * len(rigs)  # all answer to what was recorded
            errors = errors_of(problem, models[0])
            left = _left_by(pairs, alike, models, errors, lambda _, model: model)
            for pair, found in left.items():
                shown[pair] = max(shown[pair], found.total)
    return shown


def ranked(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Outcomes of the same hypotheses by their information, the largest first; of those with the
    same, the cheapest. An experiment that needs what the rig file does not list comes last.
    """
    return sorted(
        outcomes, key=lambda o: (bool(o.experiment.needs), -round(o.bits / _RESOLUTION), o.effort)
    )


def propose(
    nominal: Rig,
    hypotheses: Sequence[Modelled],
    noise: Mapping[str, float] | None = None,
    recordings: Sequence[Recording | Prepared] = (),
    *,
    channels: tuple[str, ...] | None = None,
    experiments: Sequence[Experiment] | None = None,
    settings: DiagnosisSettings | None = None,
    losses: Losses | None = None,
) -> NextExperiment:
    """Choose the experiment that tells most about which hypothesis holds.

    Parameters
    ----------
    nominal : Rig
        The nominal model; what it can do and what its file allows decide which experiments there
        are.
    hypotheses : sequence of (label, rig, probability)
        What is left: rigs as fitted, with their effects (``Rig.effect_std`` says how well their
        parameters are known, half of the value where it does not). What has no model, ``unlisted``,
        cannot be simulated and is left out by the caller.
    noise : mapping of str to float, optional
        Sample noise by channel, or by kind of channel [SI]; typical transducers where it is
        missing.
    recordings : sequence of Recording or Prepared, optional
        What there is already: its channels, its sample time and its highest pressure hold for what
        comes.
    channels : tuple of str, optional
        Channels that can be measured; those of the recordings, or all that the rig has, by default.
    experiments : sequence of Experiment, optional
        To choose from; the library's by default.
    settings : DiagnosisSettings, optional
        How experiments are compared; the published ones by default.
    losses : Losses, optional
        Notes an experiment that fails, which is then left out; raised by default.

    Returns
    -------
    NextExperiment
        ``text`` (what to do and why), ``excitation`` (kind and numbers),
        ``expected_information_bits`` (at most the entropy of the hypotheses), ``ranking`` (the best
        few: ``name``, ``text``, ``sensor``, ``bits``, ``effort_s``), ``curves`` (what
        :func:`pamrs.report.figures.separating_curves` draws; None when there is nothing to tell
        apart), ``pairs`` (what tells each two hypotheses apart) and ``protocol`` (the commands).

    Raises
    ------
    ParameterError
        If there is no hypothesis, a probability is not possible, or a channel is unknown.
    DiagnosisError
        If no experiment can be simulated with all of them.

    Examples
    --------
    >>> import pamrs
    >>> rig = pamrs.rigs.sealed_chamber()
    >>> leak = rig.with_effect("leak_muscle", {"conductance": 1e-13})
    >>> found = propose(rig, [("none", rig, 0.5), ("leak_muscle", leak, 0.5)])
    >>> 0.5 < found["expected_information_bits"] <= 1.0
    True
    """
    settings = DiagnosisSettings() if settings is None else settings
    chosen = _checked(hypotheses)
    usual = noise_of(nominal)
    sound = {**noise_of(nominal, noise), **(noise or {})}
    records = [r.recording if isinstance(r, Prepared) else r for r in recordings]
    own = _channels(nominal, records, channels)
    uncertainty = entropy([p for _, _, p in chosen])
    if len(chosen) < 2 or uncertainty < 0.5 * _RESOLUTION:
        text = "One hypothesis is left; no experiment can add to that."
        return NextExperiment(text, {}, 0.0)
    pool = experiments_of(nominal, records, settings) if experiments is None else experiments
    ready = [r if isinstance(r, Prepared) else prepare(r, nominal, settings) for r in recordings]
    shown = shown_by(ready, chosen, own, settings)
    found: list[Outcome] = []
    known: dict[Experiment, list[Simulation] | None] = {}

    def outcome(experiment: Experiment, sensor: str) -> Outcome | None:
        if experiment not in known:
            known[experiment] = None  # where it fails, it is not tried again
            known[experiment] = _simulated(experiment, chosen)
        runs = known[experiment]
        if runs is None:
            return None
        try:
            one = outcome_of(experiment, chosen, sound, own, settings, sensor, runs, ranking=True)
            return replace(one, shown=shown)
        except (SimulationError, DiagnosisError):
            return None  # it cannot be run there, or nothing is measured on both sides of a block

    for sensor in ("", *_missing(nominal, own, usual)):
        for experiment in sorted(pool, key=lambda e: e.effort):
            enough = len(found) >= _MOST_COMPARED
            if enough and max(o.bits for o in found) > uncertainty - 0.5 * _RESOLUTION:
                break  # what is left costs more and cannot tell more
            one = partial(outcome, experiment, sensor)
            name = f"experiment {experiment.name}"
            compared = one() if losses is None else losses.part(name, one)
            found += [] if compared is None else [compared]
    if not found:
        raise DiagnosisError(
            f"no experiment of rig {nominal.name!r} can be simulated with all of "
            f"{', '.join(label for label, _, _ in chosen)} and measured by "
            f"{', '.join(own) or 'no channel'}"
        )
    best_first = ranked(found)
    pairs = list(itertools.permutations(range(len(chosen)), 2))
    best = best_first[0] = best_first[0].exactly(pairs)
    added = {"sensor": best.sensor} if best.sensor else {}
    return NextExperiment(
        text=_text(best, chosen, uncertainty) + _with_more(best, best_first),
        excitation=best.experiment.excitation | added,
        expected_information_bits=round(best.bits, 3),
        ranking=[
            RankedExperiment(
                o.experiment.name, o.experiment.text, o.sensor, round(o.bits, 3), round(o.effort, 1)
            )
            for o in best_first[:_MOST_COMPARED]
        ],
        curves=_curves(best, chosen),
        pairs=_pairs(best_first, chosen),
        protocol=protocol_of(best.experiment),
        instruction=f"{_instruction(best)}.",
    )


def parts_any(proposal: NextExperiment) -> bool:
    """True where an experiment is expected to part hypotheses at all."""
    return (proposal.expected_information_bits or 0.0) >= _RESOLUTION


def _simulated(experiment: Experiment, hypotheses: Sequence[Modelled]) -> list[Simulation] | None:
    """Simulate an experiment with every hypothesis; None where one of them cannot be run there."""
    try:
        return two_at_a_time(experiment.simulate, [rig for _, rig, _ in hypotheses])
    except SimulationError:
        return None


def apart(outcome: Outcome, i: int, j: int, *, nested: bool = False) -> tuple[str, float]:
    """Channel, and distance [noise levels], by which an experiment separates two hypotheses: what
    one misses of the other's prediction after its parameters are fitted again.

    That is the smaller of both ways; where the one is a case of the other (``nested``), and can
    miss nothing, the larger.
    """
    both = (_largest(outcome, *pair) for pair in ((i, j), (j, i)))
    return (max if nested else min)(both, key=lambda found: found[1])


def _largest(outcome: Outcome, i: int, j: int) -> tuple[str, float]:
    """The channel in which hypothesis j misses most of what hypothesis i predicts, and how much
    [noise levels].
    """
    key, size = outcome.left[i, j].largest
    return next(b.channel for b in outcome.problem.blocks if b.name == key[0]), size


def _nested(one: Rig, other: Rig) -> bool:
    """True where one of two models has every effect of the other."""
    first, second = (set(map(Term.of, rig.effects)) for rig in (one, other))
    return first <= second or second <= first


def _pairs(outcomes: Sequence[Outcome], hypotheses: Sequence[Modelled]) -> list[PairExperiment]:
    """Experiment that separates each two hypotheses most, by what is there."""
    there = [o for o in outcomes if not (o.experiment.needs or o.sensor)] or list(outcomes)
    found = []
    for i, j in itertools.combinations(range(len(hypotheses)), 2):
        at = np.ix_([i, j], [i, j])
        alone = [
            replace(o, probabilities=(0.5, 0.5), distance=o.distance[at], shown=o.shown[at])
            for o in there
        ]
        chosen = ranked(alone)[0]
        outcome = there[alone.index(chosen)]
        if outcome is not outcomes[0]:
            outcome = outcome.exactly([(i, j), (j, i)])
        (one, first, _), (other, second, _) = hypotheses[i], hypotheses[j]
        _, size = apart(outcome, i, j, nested=_nested(first, second))
        text = (
            f"{_instruction(outcome)}. If it is {hypothesis_label(one)}, a model with "
            f"{hypothesis_label(other)} then misses the {_missed(outcome, i, j)}; the other way "
            f"round it misses the {_missed(outcome, j, i)}."
        )
        found.append(PairExperiment([one, other], text, outcome.experiment.name, size))
    return found


def _missed(outcome: Outcome, i: int, j: int) -> str:
    """Words on what hypothesis j misses of the prediction of hypothesis i."""
    channel, size = _largest(outcome, i, j)
    return f"{spoken_name(channel)} by {format_number(size, 2)} times the noise level"


def _instruction(outcome: Outcome) -> str:
    """Words on what to record, and with which further sensor."""
    text = outcome.experiment.text
    sensor = f", with one more channel: {spoken_name(outcome.sensor)}" if outcome.sensor else ""
    return f"{text[:1].upper()}{text[1:]}{sensor}"


def _with_more(best: Outcome, best_first: Sequence[Outcome]) -> str:
    """Words on a better experiment that takes what the rig file does not list; else empty."""
    others = [o for o in best_first if o.experiment.needs and o.bits > best.bits + _RESOLUTION]
    if best.experiment.needs or not others:
        return ""
    most = max(others, key=lambda o: o.bits)
    return f" With {most.experiment.needs}, {most.bits:.2f} bit: {most.experiment.text}."


def _checked(hypotheses: Sequence[Modelled]) -> list[Modelled]:
    """The hypotheses that count, the most probable first."""
    if not hypotheses:
        raise ParameterError(
            "hypotheses is empty; at least one (label, rig, probability) is needed"
        )
    for label, rig, probability in hypotheses:
        if not isinstance(rig, Rig):
            raise ParameterError(
                f"hypotheses: the rig of {label!r} is a {type(rig).__name__}; a Rig is needed"
            )
        if not (math.isfinite(probability) and 0.0 <= probability <= 1.0):
            raise ParameterError(
                f"hypotheses: the probability of {label!r} is {probability}, which is not allowed: "
                "from 0 to 1"
            )
    return sorted(hypotheses, key=lambda h: -h[2])[:_MOST_COMPARED]


def _channels(
    rig: Rig, records: Sequence[Recording], channels: tuple[str, ...] | None
) -> tuple[str, ...]:
    if channels is not None:
        return checked_channels(rig, channels)
    return tuple(
        name for name in measurable(rig) if all(name in record.channels for record in records)
    )


def _missing(rig: Rig, own: tuple[str, ...], sensors: Mapping[str, float]) -> list[str]:
    """Channels that the rig could have and that are not measured; a gauge between valve and line,
    for which the line has to be cut, and a thermometer, for which the chamber has to be opened, are
    offered by a plan alone.
    """
    has = core_rig(rig).channels
    return [
        name
        for name in sensors
        if name in has
        and name not in own
        and channel_of(name) not in ("line_pressure", "temperature")
    ]


def _text(best: Outcome, hypotheses: Sequence[Modelled], uncertainty: float) -> str:
    # of the leading pair: what the second one cannot explain of what the first one does
    j = min(range(1, len(hypotheses)), key=lambda k: (-round(hypotheses[k][2], 2), k))
    said = (
        f"{_instruction(best)}. If it is {hypothesis_label(hypotheses[0][0])}, a model with "
        f"{hypothesis_label(hypotheses[j][0])} then misses the {_missed(best, 0, j)}, whatever its "
        f"parameters. The expected information is {best.bits:.2f} of the {uncertainty:.2f} bit of "
        "doubt between the hypotheses that were fitted."
    )
    if best.bits < _HOPELESS_SHARE * uncertainty:
        said += (
            " No standard experiment with these channels shows it better than the recordings that "
            "there are: consider another sensor, or another payload."
        )
    return said


def _curves(best: Outcome, hypotheses: Sequence[Modelled]) -> Curves:
    """The channel that separates most: as each hypothesis predicts it, and what each leaves of the
    leading one's outcome.
    """
    others = range(1, len(hypotheses))
    key = max(best.left[0, 1].rms, key=lambda k: max(best.left[0, j].rms[k] for j in others))
    block = next(b for b in best.problem.blocks if b.name == key[0])
    channel = block.channel
    labels = [label for label, _, _ in hypotheses]
    prepared = best.problem.recordings[0]
    settings = best.problem.settings
    width = bins_of(prepared)
    return Curves(
        experiment=best.experiment.name,
        text=best.experiment.text,
        channel=channel,
        unit=unit_of(channel),
        time=best.runs[0].time,
        predicted={
            label: values
            for label, run in zip(labels, best.runs, strict=True)
            if (values := reading(run, channel)) is not None
        },
        leading=labels[0],
        bin_time=np.asarray(
            (np.arange(prepared.n // width) + 0.5) * width * prepared.dt, dtype=np.float64
        ),
        left={labels[j]: best.left[0, j].rows[key] for j in others},
        noise=prepared.noise[channel] / math.sqrt(width) * best.errors[key].weight,
        command=best.experiment.command,
        samples_counted=counted(prepared, block, settings),
    )
