"""How many more recordings a question needs: the proposed experiment against one drawn at random.

Each line is a question that one recording leaves open: two or three effects are fitted to it, all
fit. The truth is a plant with one of them and with baseline parameters drawn inside their
tolerances. Experiments are then made one after the other, chosen either by the expected information
(as :func:`pamrs.diagnosis.next_experiment.propose` does) or at random from the same library, and
the hypotheses are weighed by the same likelihood each time, until one is above 0.95. Everything is
simulated by the core.

Run it with ``python -m benchmarks.next_experiment``; numbers of lines as arguments choose some.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.fit import Fit, Problem, bin_width, fit, free_baseline, starts_of
from pamrs.diagnosis.next_experiment import (
    Experiment,
    Hypothesis,
    Outcome,
    library,
    linear,
    measurable,
    misfit,
    outcome_of,
    problem_of,
    ranked,
    taken,
    usual_noise,
    weights_of,
)
from pamrs.errors import SimulationError
from pamrs.rig import Rig

Array = NDArray[np.float64]
SETTINGS = DiagnosisSettings()
NOISE = usual_noise(SETTINGS.next_experiment)
DECIDED = 0.95
OPEN = 0.9
ORDERS = 20
SEED = 20260101


@dataclass(frozen=True)
class Question:
    """The recording that leaves it open, the truth with its parameters, the rivals."""

    first: str
    truth: str
    parameters: dict[str, float]
    rivals: tuple[str, ...]


QUESTIONS = (
    Question(
        "slow_triangle",
        "valve_centre_leakage",
        {"conductance": 4e-12},
        ("leak_muscle", "valve_dead_zone"),
    ),
    Question(
        "slow_triangle",
        "muscle_creep",
        {"stiffness": 60.0, "time_constant": 2.0},
        ("muscle_hysteresis", "muscle_rate_damping"),
    ),
    Question(
        "staircase",
        "muscle_hysteresis",
        {"friction_constant": 0.1, "friction_pressure": 1e-6},
        ("joint_coulomb_stribeck", "muscle_creep"),
    ),
    Question(
        "slow_triangle", "pressure_lag", {"time_constant": 0.004}, ("input_path_lag", "clock_skew")
    ),
    Question(
        "slow_triangle",
        "mullins_softening",
        {"softening": 0.01},
        ("muscle_creep", "muscle_hysteresis"),
    ),
    Question(
        "slow_triangle",
        "pam_crowding_contact",
        {"contact_area": 5e-5, "onset_contraction": 0.1},
        ("joint_end_stop", "activation_pressure"),
    ),
    Question(
        "staircase",
        "valve_hysteresis",
        {"half_width": 0.0002},
        ("valve_dead_zone", "input_path_lag"),
    ),
    Question(
        "slow_triangle",
        "leak_muscle",
        {"conductance": 1e-11},
        ("valve_centre_leakage", "supply_leak"),
    ),
)
"""Sizes are halved until one recording does leave the question open."""


def drawn(rig: Rig, rng: np.random.Generator) -> Rig:
    """The rig with its baseline parameters somewhere inside their tolerances."""
    known = rig.parameters
    names = free_baseline(problem_of(rig, [], measurable(rig), SETTINGS), rig)
    return rig.with_parameters(
        {n: known[n].value + 0.5 * known[n].tol * float(rng.standard_normal()) for n in names}
    )


def fitted(
    problem: Problem, nominal: Rig, effect: str, weights: dict[tuple[str, str], float]
) -> Fit | None:
    """One effect fitted from its starts, on the effective number of samples."""
    (prepared,) = problem.recordings
    bins = prepared.n // bin_width(prepared, SETTINGS.noise.fit_bin_time)
    counted = 5.0 * SETTINGS.next_experiment.effective_samples
    inflation = {
        b.name: weights[b.name, prepared.recording.name] ** 2 * bins / counted
        for b in problem.blocks
    }
    found = []
    for start in starts_of(effect, sealed=False):
        try:
            found.append(
                fit(
                    problem,
                    nominal,
                    (effect,),
                    start.scaled(0.2).free,
                    inflation,
                    fixed=start.held,
                    evaluations=8,
                )
            )
        except SimulationError:
            continue
    return min(found, key=lambda f: f.cost) if found else None


def normalised(logs: Array) -> Array:
    """Probabilities from logarithms of likelihoods."""
    weights = np.exp(logs - logs.max())
    return np.asarray(weights / weights.sum(), dtype=np.float64)


def likelihoods(
    experiment: Experiment, truth: Rig, hypotheses: list[Hypothesis], rng: np.random.Generator
) -> Array:
    """Logarithm of the likelihood of each hypothesis for the experiment on the truth, with
    noise.
    """
    real = taken(experiment.simulate(truth), truth, experiment.name, NOISE, SETTINGS, rng=rng)
    out = []
    for _, rig, _ in hypotheses:
        changed = experiment.changed(rig)
        problem = problem_of(changed, [real], measurable(changed), SETTINGS)
        out.append(
            -0.5 * misfit(problem, linear(problem, changed), weights_of(problem, changed)).total
        )
    return np.array(out)


@dataclass(frozen=True)
class Case:
    """A question with the size at which it is open, its true plant, and the hypotheses after one
    recording.
    """

    question: Question
    size: float
    truth: Rig
    hypotheses: list[Hypothesis]
    prior: Array


def opened(
    question: Question, nominal: Rig, experiments: list[Experiment], rng: np.random.Generator
) -> Case:
    """The question with its sizes halved until one recording leaves it open."""
    plant = drawn(nominal, rng)
    first = next(e for e in experiments if e.name == question.first)
    size = 2.0
    while True:
        size *= 0.5
        scaled = {
            n.partition(".")[2] for s in starts_of(question.truth, sealed=False) for n in s.sizes
        }
        parameters = {n: v * size if n in scaled else v for n, v in question.parameters.items()}
        truth = plant.with_effect(question.truth, parameters)
        seen = taken(first.simulate(truth), truth, first.name, NOISE, SETTINGS, rng=rng)
        problem = problem_of(nominal, [seen], measurable(nominal), SETTINGS)
        hypotheses, prior = explained(question, nominal, problem)
        if prior.max() <= OPEN or size < 0.1:
            return Case(question, size, truth, hypotheses, prior)


def explained(question: Question, nominal: Rig, problem: Problem) -> tuple[list[Hypothesis], Array]:
    """The truth and its rivals fitted to a recording, with their probabilities after it."""
    weights = weights_of(problem, nominal)
    fits: list[tuple[str, Rig]] = []
    logs = []
    for effect in (question.truth, *question.rivals):
        found = fitted(problem, nominal, effect, weights)
        if found is None:
            continue
        entry = next(e for e in found.rig.effects if e["id"] == effect)
        std = {
            n.partition(".")[2]: s
            for n, s in found.std.items()
            if n.partition(".")[0] == effect and np.isfinite(s)
        }
        fits.append((effect, found.rig.with_effect(effect, entry["parameters"], std=std)))
        logs.append(-found.cost)
    prior = normalised(np.array(logs))
    return [(label, rig, float(p)) for (label, rig), p in zip(fits, prior, strict=True)], prior


def first_of(outcomes: list[Outcome], probabilities: Array) -> Outcome:
    """The most telling experiment."""
    return ranked(outcomes, list(probabilities), SETTINGS.next_experiment.resolution)[0]


@dataclass(frozen=True)
class Count:
    """How many recordings decided, how long they take [min], and whether for the truth."""

    recordings: int
    minutes: float
    right: bool


@dataclass(frozen=True)
class Answers:
    """What every experiment would tell: its expected outcome, and the likelihoods on the truth by
    its name.
    """

    prior: Array
    outcomes: list[Outcome]
    gains: dict[str, Array]

    def count(self, order: list[Outcome] | None) -> Count:
        """Experiments until it is decided, in an order; ``None`` chooses by information each
        time.
        """
        p, left, used, spent = np.log(np.maximum(self.prior, 1e-300)), list(self.outcomes), 0, 0.0
        while normalised(p).max() <= DECIDED and left:
            chosen = first_of(left, normalised(p)) if order is None else order[used]
            left.remove(chosen)
            p = p + self.gains[chosen.experiment.name]
            used, spent = used + 1, spent + chosen.experiment.effort / 60.0
        return Count(used, spent, int(np.argmax(p)) == 0)


def answered(case: Case, experiments: list[Experiment], rng: np.random.Generator) -> Answers:
    """Every experiment that can be simulated, made on the truth."""
    outcomes: list[Outcome] = []
    gains: dict[str, Array] = {}
    for experiment in experiments:
        try:
            outcomes.append(
                outcome_of(experiment, case.hypotheses, NOISE, measurable(case.truth), SETTINGS)
            )
            gains[experiment.name] = likelihoods(experiment, case.truth, case.hypotheses, rng)
        except SimulationError:
            outcomes = [o for o in outcomes if o.experiment is not experiment]
    return Answers(case.prior, outcomes, gains)


def line(case: Case, best: str, ours: Count, random: list[Count], seconds: float) -> str:
    """What is printed of a question."""
    worst = max(r.recordings for r in random)
    return (
        f"{case.question.truth:<21} x {case.size:<5g} {case.question.first:<14} "
        f"{' '.join(f'{p:.2f}' for p in case.prior):<15} {best:<17} "
        f"{ours.recordings:>2} {'right' if ours.right else 'wrong'} {ours.minutes:>5.1f} min   "
        f"{np.mean([r.recordings for r in random]):>5.2f} (at most {worst}) "
        f"{100 * np.mean([r.right for r in random]):>4.0f} % right "
        f"{np.mean([r.minutes for r in random]):>5.1f} min   [{seconds:.0f} s]"
    )


def run(question: Question, nominal: Rig, experiments: list[Experiment], seed: int) -> None:
    """One line."""
    began = time.perf_counter()
    rng = np.random.default_rng(seed)
    case = opened(question, nominal, experiments, rng)
    answers = answered(case, experiments, rng)
    outcomes = answers.outcomes
    ours = answers.count(None)
    orders = [[outcomes[i] for i in rng.permutation(len(outcomes))] for _ in range(ORDERS)]
    random = [answers.count(order) for order in orders]
    best = first_of(outcomes, case.prior).experiment.name if outcomes else "-"
    print(line(case, best, ours, random, time.perf_counter() - began), flush=True)


def main() -> None:
    nominal = pamrs.rigs.shoulder()
    experiments = library(nominal, SETTINGS.next_experiment)
    print(f"library: {', '.join(e.name for e in experiments)}")
    print(
        "truth and its size            first          after it        proposed first    recordings "
        "to p > 0.95: proposed, random"
    )
    chosen = [int(a) for a in sys.argv[1:]] or range(len(QUESTIONS))
    for index in chosen:
        run(QUESTIONS[index], nominal, experiments, SEED + index)


if __name__ == "__main__":
    main()
