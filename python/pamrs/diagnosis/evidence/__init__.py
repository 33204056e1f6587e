"""Hypotheses, what speaks for each, and the verdict of each group of blocks.

Public: `Candidate`, `Group`, `Attempts`, `significant`, `colour_of`, `without_colour`, `parts_of`, `start_of` (hypotheses and their
fits); `weigh`, `explains`, `share_left`, `same_recordings`, `most_believed`, `believed`, `doubt`, `price`, `stands`, `unlikely`,
`visited`, `Ranges` (their weights); `Judged`, `judge`, `case_verdict`, `case_probabilities`, `case_ambiguity`, `is_parameter`,
`symptoms_of` (verdicts).
"""

from __future__ import annotations

from pamrs.diagnosis.evidence._candidates import Attempts, Candidate, Group, colour_of, parts_of, significant, start_of, without_colour
from pamrs.diagnosis.evidence._verdicts import (
    Judged,
    case_ambiguity,
    case_probabilities,
    case_verdict,
    is_parameter,
    judge,
    symptoms_of,
)
from pamrs.diagnosis.evidence._weighing import (
    Ranges,
    believed,
    doubt,
    explains,
    most_believed,
    price,
    same_recordings,
    share_left,
    stands,
    unlikely,
    visited,
    weigh,
)

__all__ = [
    "Attempts",
    "Candidate",
    "Group",
    "Judged",
    "Ranges",
    "believed",
    "case_ambiguity",
    "case_probabilities",
    "case_verdict",
    "colour_of",
    "doubt",
    "explains",
    "is_parameter",
    "judge",
    "most_believed",
    "parts_of",
    "price",
    "same_recordings",
    "share_left",
    "significant",
    "stands",
    "start_of",
    "symptoms_of",
    "unlikely",
    "visited",
    "weigh",
    "without_colour",
]
