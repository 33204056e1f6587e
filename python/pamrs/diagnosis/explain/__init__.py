"""From judged hypotheses to an answer: where and when, in words, the model, its traces.

Public: `assemble`, `describe_closure`.
"""

from __future__ import annotations

from pamrs.diagnosis.explain._assemble import assemble
from pamrs.diagnosis.explain._closure_words import describe_closure

__all__ = [
    "assemble",
    "describe_closure",
]
