"""Choice of the next experiment, and plans: what some channels could show before any recording.

Public: `next_to_record` (what a diagnosis asks for), `propose` (experiments compared), `parts_any`
(a proposal that is expected to tell something), `Plan`, `plan_diagnosis` and `measurable` (before
there are data), `noise_of` (usual sensors), `foretold` (a prediction scored on a new recording).
What a person can record at all is in :mod:`pamrs.experiments`.
"""

from pamrs.diagnosis.next_experiment._asked import next_to_record
from pamrs.diagnosis.next_experiment._choice import parts_any, propose
from pamrs.diagnosis.next_experiment._differences import measurable, noise_of
from pamrs.diagnosis.next_experiment._foretold import foretold
from pamrs.diagnosis.next_experiment._plan import Plan
from pamrs.diagnosis.next_experiment._planning import plan_diagnosis

__all__ = [
    "Plan",
    "foretold",
    "measurable",
    "next_to_record",
    "noise_of",
    "parts_any",
    "plan_diagnosis",
    "propose",
]
