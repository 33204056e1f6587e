"""Answer of a diagnosis from its judged hypotheses: location, times, words, model, traces.

Public: `assemble`, `data_used`, `forms_of` (what has no name), `misread_diagnosis` (units first).
"""

from pamrs.diagnosis.explain._assemble import assemble
from pamrs.diagnosis.explain._data_used import data_used
from pamrs.diagnosis.explain._forms import forms_of
from pamrs.diagnosis.explain._misread import misread_diagnosis

__all__ = [
    "assemble",
    "data_used",
    "forms_of",
    "misread_diagnosis",
]
