"""What to record next, and what some channels could tell before anything is recorded.

Public: `next_to_record` (what a diagnosis asks for); `propose`, `Outcome`, `Hypothesis`,
`outcome_of`, `ranked`, `apart`, `information`, `entropy`, `spoken` (experiments compared); `Plan`,
`Sight`, `Addition`, `plan_diagnosis` (before there are data); `Left`, `Linear`,
`checked_channels`, `measurable`, `counted`, `difference`, `linear`, `misfit`, `problem_of`,
`taken`, `usual_noise`, `noise_of`, `weights_of` (how far two models differ). What a person can
record at all is in :mod:`pamrs.experiments`.
"""

from __future__ import annotations

from pamrs.diagnosis.next_experiment._asked import next_to_record
from pamrs.diagnosis.next_experiment._choice import (
    Hypothesis,
    Outcome,
    apart,
    entropy,
    information,
    outcome_of,
    propose,
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
from pamrs.diagnosis.next_experiment._plan import Addition, Plan, Sight
from pamrs.diagnosis.next_experiment._planning import plan_diagnosis

__all__ = [
    "Addition",
    "Hypothesis",
    "Left",
    "Linear",
    "Outcome",
    "Plan",
    "Sight",
    "apart",
    "checked_channels",
    "counted",
    "difference",
    "entropy",
    "information",
    "linear",
    "measurable",
    "misfit",
    "next_to_record",
    "noise_of",
    "outcome_of",
    "plan_diagnosis",
    "problem_of",
    "propose",
    "ranked",
    "spoken",
    "taken",
    "usual_noise",
    "weights_of",
]
