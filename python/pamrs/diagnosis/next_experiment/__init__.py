"""What to record next, and what some channels could tell before anything is recorded.

Public: `propose`, `Outcome`, `Hypothesis`, `outcome_of`, `ranked`, `apart`, `information`,
`entropy`, `experiments_of`, `protocol_of`, `spoken` (experiments compared); `Experiment`, `Range`,
`library`, `Chain`, `chains_of`, `can_shut`, `pressure_range`, `trial_of`, `is_sealed`, `joined`
(what a person can record); `Plan`, `Sight`, `Addition`, `plan_diagnosis` (before there are data);
`Left`, `Linear`, `checked_channels`, `measurable`, `counted`, `difference`, `linear`, `misfit`,
`problem_of`, `taken`, `usual_noise`, `noise_of`, `weights_of` (how far two models differ).
"""

from __future__ import annotations

from pamrs.diagnosis.next_experiment._chains import (
    Chain,
    Range,
    can_shut,
    chains_of,
    is_sealed,
    joined,
    pressure_range,
    trial_of,
)
from pamrs.diagnosis.next_experiment._choice import (
    Hypothesis,
    Outcome,
    apart,
    entropy,
    experiments_of,
    information,
    outcome_of,
    propose,
    protocol_of,
    ranked,
    spoken,
)
from pamrs.diagnosis.next_experiment._differences import (
    Left,
    Linear,
    checked_channels,
    counted,
    difference,
    linear,
    measurable,
    misfit,
    noise_of,
    problem_of,
    taken,
    usual_noise,
    weights_of,
)
from pamrs.diagnosis.next_experiment._experiment import Experiment
from pamrs.diagnosis.next_experiment._plan import Addition, Plan, Sight
from pamrs.diagnosis.next_experiment._planning import plan_diagnosis
from pamrs.diagnosis.next_experiment._protocols import library

__all__ = [
    "Addition",
    "Chain",
    "Experiment",
    "Hypothesis",
    "Left",
    "Linear",
    "Outcome",
    "Plan",
    "Range",
    "Sight",
    "apart",
    "can_shut",
    "chains_of",
    "checked_channels",
    "counted",
    "difference",
    "entropy",
    "experiments_of",
    "information",
    "is_sealed",
    "joined",
    "library",
    "linear",
    "measurable",
    "misfit",
    "noise_of",
    "outcome_of",
    "plan_diagnosis",
    "pressure_range",
    "problem_of",
    "propose",
    "protocol_of",
    "ranked",
    "spoken",
    "taken",
    "trial_of",
    "usual_noise",
    "weights_of",
]
