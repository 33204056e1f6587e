"""How many more recordings a question needs: the proposed experiment against one drawn at random.

Each line is a question that one recording leaves open: two or three effects are fitted to it, all fit. The truth is a plant with one
of them and with baseline parameters drawn inside their tolerances. Experiments are then made one after the other, chosen either by
the expected information (as :func:`pamrs.diagnosis.next_experiment.propose` does) or at random from the same library, and the
hypotheses are weighed by the same likelihood each time, until one is above 0.95. Everything is simulated by the core.

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
    MEASURABLE,
    Experiment,
    Hypothesis,
    Outcome,
    library,
    linear,
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
    Question("slow_triangle", "valve_centre_leakage", {"conductance": 4e-12}, ("leak_muscle", "valve_dead_zone")),
    Question("slow_triangle", "muscle_creep", {"stiffness": 60.0, "time_constant": 2.0}, ("muscle_hysteresis", "muscle_rate_damping")),
    Question(
        "staircase",
        "muscle_hysteresis",
        {"friction_constant": 0.1, "friction_pressure": 1e-6},
        ("joint_coulomb_stribeck", "muscle_creep"),
    ),
    Question("slow_triangle", "pressure_lag", {"time_constant": 0.004}, ("input_path_lag", "clock_skew")),
    Question("slow_triangle", "mullins_softening", {"softening": 0.01}, ("muscle_creep", "muscle_hysteresis")),
    Question(
        "slow_triangle",
        "pam_crowding_contact",
        {"contact_area": 5e-5, "onset_contraction": 0.1},
        ("joint_end_stop", "activation_pressure"),
    ),
    Question("staircase", "valve_hysteresis", {"half_width": 0.0002}, ("valve_dead_zone", "input_path_lag")),
    Question("slow_triangle", "leak_muscle", {"conductance": 1e-11}, ("valve_centre_leakage", "supply_leak")),
)
"""Sizes are halved until one recording does leave the question open."""


def drawn(rig: Rig, rng: np.random.Generator) -> Rig:
    """The rig with its baseline parameters somewhere inside their tolerances."""
    known = rig.parameters
    names = free_baseline(problem_of(rig, [], MEASURABLE, SETTINGS), rig)
    return rig.with_parameters({n: known[n].value + 0.5 * known[n].tol * float(rng.standard_normal()) for n in names})


def fitted(problem: Problem, nominal: Rig, effect: str, weights: dict[tuple[str, str], float]) -> Fit | None:
    """One effect fitted from its starts, on the effective number of samples."""
    (prepared,) = problem.recordings
    bins = prepared.n // bin_width(prepared, SETTINGS.noise.fit_bin_time)
    counted = 5.0 * SETTINGS.next_experiment.effective_samples
    inflation = {b.name: weights[b.name, prepared.recording.name] ** 2 * bins / counted for b in problem.blocks}
    found = []
    for start in starts_of(effect, sealed=False):
        try:
            found.append(fit(problem, nominal, (effect,), start.scaled(0.2).free, inflation, fixed=start.held, evaluations=8))
        except SimulationError:
            continue
    return min(found, key=lambda f: f.cost) if found else None


def normalised(logs: Array) -> Array:
    """Probabilities from logarithms of likelihoods."""
    weights = np.exp(logs - logs.max())
    return np.asarray(weights / weights.sum(), dtype=np.float64)


def likelihoods(experiment: Experiment, truth: Rig, hypotheses: list[Hypothesis], rng: np.random.Generator) -> Array:
    """Logarithm of the likelihood of each hypothesis for the experiment on the truth, with noise."""
    real = taken(experiment.simulate(truth), truth, experiment.name, NOISE, SETTINGS, rng=rng)
    out = []
    for _, rig, _ in hypotheses:
        changed = experiment.changed(rig)
        problem = problem_of(changed, [real], MEASURABLE, SETTINGS)
        out.append(-0.5 * misfit(problem, linear(problem, changed), weights_of(problem, changed)).total)
    return np.array(out)


def run(question: Question, nominal: Rig, experiments: list[Experiment], seed: int) -> None:
    """One line."""
    began = time.perf_counter()
    rng = np.random.default_rng(seed)
    plant = drawn(nominal, rng)
    first = next(e for e in experiments if e.name == question.first)
    size = 2.0
    while True:
        size *= 0.5
        scaled = {n.partition(".")[2] for s in starts_of(question.truth, sealed=False) for n in s.sizes}
        parameters = {n: v * size if n in scaled else v for n, v in question.parameters.items()}
        truth = plant.with_effect(question.truth, parameters)
        seen = taken(first.simulate(truth), truth, first.name, NOISE, SETTINGS, rng=rng)
        problem = problem_of(nominal, [seen], MEASURABLE, SETTINGS)
        weights = weights_of(problem, nominal)
        hypotheses: list[Hypothesis] = []
        logs = []
        for effect in (question.truth, *question.rivals):
            found = fitted(problem, nominal, effect, weights)
            if found is None:
                continue
            entry = next(e for e in found.rig.effects if e["id"] == effect)
            std = {n.partition(".")[2]: s for n, s in found.std.items() if n.partition(".")[0] == effect}
            hypotheses.append((effect, found.rig.with_effect(effect, entry["parameters"], std=std), 0.5))
            logs.append(-found.cost)
        prior = normalised(np.array(logs))
        if prior.max() <= OPEN or size < 0.1:
            break
    hypotheses = [(label, rig, float(p)) for (label, rig, _), p in zip(hypotheses, prior, strict=True)]
    outcomes: list[Outcome] = []
    resolution = SETTINGS.next_experiment.resolution
    gains: dict[str, Array] = {}
    for experiment in experiments:
        try:
            outcomes.append(outcome_of(experiment, hypotheses, NOISE, MEASURABLE, SETTINGS))
            gains[experiment.name] = likelihoods(experiment, truth, hypotheses, rng)
        except SimulationError:
            outcomes = [o for o in outcomes if o.experiment is not experiment]

    def count(order: list[Outcome] | None) -> tuple[int, float, bool]:
        """Recordings, minutes, and whether the truth won; ``None`` chooses by information each time."""
        p, left, used, spent = np.log(np.maximum(prior, 1e-300)), list(outcomes), 0, 0.0
        while normalised(p).max() <= DECIDED and left:
            chosen = ranked(left, list(normalised(p)), resolution)[0] if order is None else order[used]
            left.remove(chosen)
            p = p + gains[chosen.experiment.name]
            used, spent = used + 1, spent + chosen.experiment.effort / 60.0
        return used, spent, int(np.argmax(p)) == 0

    ours = count(None)
    orders = [[outcomes[i] for i in rng.permutation(len(outcomes))] for _ in range(ORDERS)]
    random = [count(order) for order in orders]
    best = ranked(outcomes, list(prior), resolution)[0].experiment.name if outcomes else "-"
    worst = max(r[0] for r in random)
    print(
        f"{question.truth:<21} x {size:<5g} {question.first:<14} {' '.join(f'{p:.2f}' for p in prior):<15} {best:<17} "
        f"{ours[0]:>2} {'right' if ours[2] else 'wrong'} {ours[1]:>5.1f} min   "
        f"{np.mean([r[0] for r in random]):>5.2f} (at most {worst}) {100 * np.mean([r[2] for r in random]):>4.0f} % right "
        f"{np.mean([r[1] for r in random]):>5.1f} min   [{time.perf_counter() - began:.0f} s]",
        flush=True,
    )


def main() -> None:
    nominal = pamrs.rigs.shoulder()
    experiments = library(nominal, SETTINGS.next_experiment)
    print(f"library: {', '.join(e.name for e in experiments)}")
    print("truth and its size            first          after it        proposed first    recordings to p > 0.95: proposed, random")
    chosen = [int(a) for a in sys.argv[1:]] or range(len(QUESTIONS))
    for index in chosen:
        run(QUESTIONS[index], nominal, experiments, SEED + index)


if __name__ == "__main__":
    main()
