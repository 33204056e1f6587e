"""Hypotheses tried for a mismatch: effects alone and in sets, wrong values, forms without a name.

Public: `examine` (all of it, for some blocks), `Mismatch`, `Attempts` (fits),
`refitted`, `with_inflation` (the baseline alone), `find_misread`, `Reading`,
`reading_errors` (other units of channels), `find_closure`, `free_suspects`, `suspected_values`.
"""

from pamrs.diagnosis.search._attempts import Attempts
from pamrs.diagnosis.search._baseline import refitted, with_inflation
from pamrs.diagnosis.search._closure import find_closure
from pamrs.diagnosis.search._examine import Mismatch, examine
from pamrs.diagnosis.search._readings import Reading, find_misread, reading_errors
from pamrs.diagnosis.search._wrong_parameters import FAR_TOLERANCES, free_suspects, suspected_values

__all__ = [
    "FAR_TOLERANCES",
    "Attempts",
    "Mismatch",
    "Reading",
    "examine",
    "find_closure",
    "free_suspects",
    "find_misread",
    "reading_errors",
    "refitted",
    "suspected_values",
    "with_inflation",
]
