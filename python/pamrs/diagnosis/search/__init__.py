"""Hypotheses tried for a mismatch: effects alone and in pairs, wrong parameters, what is below the noise, forms without a name.

Public: `examine` (all of it, for some blocks), `refitted`, `coloured` (the baseline alone), `find_closure`, `faint`, `freed`,
`beside_quiet`, `suspected`.
"""

from __future__ import annotations

from pamrs.diagnosis.search._baseline import coloured, refitted
from pamrs.diagnosis.search._closure import find_closure
from pamrs.diagnosis.search._faint import faint
from pamrs.diagnosis.search._hypotheses import examine
from pamrs.diagnosis.search._wrong_parameters import beside_quiet, freed, suspected

__all__ = [
    "beside_quiet",
    "coloured",
    "examine",
    "faint",
    "find_closure",
    "freed",
    "refitted",
    "suspected",
]
