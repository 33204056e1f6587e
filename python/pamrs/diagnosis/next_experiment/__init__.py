"""Choice of the next experiment, and plans: what some channels could show before any recording.

Public: `next_to_record` (what a diagnosis asks for), `propose` (experiments compared; below
`LEAST_BITS` they part nothing), `Plan`, `plan_diagnosis` and `measurable` (before there are data),
`foretold` (a prediction scored on a new recording). What a person can record at all is in
:mod:`pamrs.experiments`.
"""

from pamrs.diagnosis.next_experiment._asked import next_to_record
from pamrs.diagnosis.next_experiment._choice import LEAST_BITS, propose
from pamrs.diagnosis.next_experiment._differences import measurable
from pamrs.diagnosis.next_experiment._foretold import foretold
from pamrs.diagnosis.next_experiment._plan import Plan
from pamrs.diagnosis.next_experiment._planning import plan_diagnosis

__all__ = [
    "LEAST_BITS",
    "Plan",
    "foretold",
    "measurable",
    "next_to_record",
    "plan_diagnosis",
    "propose",
]
