"""Hypotheses tried for a mismatch: effects alone and in pairs, wrong parameters, what is below the
noise, forms without a name.

Public: `examine` (all of it, for some blocks), `refitted`, `with_autocorrelation` (the baseline
alone), `misread`, `Reading`, `reading_errors` (other units of channels), `find_closure`,
`below_noise`, `freed`, `beside_quiet`, `suspected`.
"""

from __future__ import annotations

from pamrs.diagnosis.search._baseline import refitted, with_autocorrelation
from pamrs.diagnosis.search._below_noise import below_noise
from pamrs.diagnosis.search._closure import find_closure
from pamrs.diagnosis.search._hypotheses import examine
from pamrs.diagnosis.search._readings import Reading, misread, reading_errors
from pamrs.diagnosis.search._wrong_parameters import beside_quiet, freed, suspected

__all__ = [
    "Reading",
    "below_noise",
    "beside_quiet",
    "examine",
    "find_closure",
    "freed",
    "misread",
    "reading_errors",
    "refitted",
    "suspected",
    "with_autocorrelation",
]
