"""Hypotheses, what speaks for each, and the verdict of each group of blocks.

Public: `Candidate`, `Group`, `Attempts`, `significant`, `doubted`, `autocorrelation_of`,
`without_autocorrelation`, `parts_of`, `start_of` (hypotheses and their fits); `weigh`, `explains`,
`log_weight`, `share_left`, `same_recordings`, `probability_cap`, `capped`, `penalty`, `price`,
`room_beside`, `stands`, `unlikely`, `visited`, `Ranges` (their weights); `determined`,
`undetermined`, `stated`, `put_aside` (names that do not hold); `Judged`, `judge`, `case_verdict`,
`calibrated`, `case_probabilities`, `case_ambiguity`, `is_parameter`, `symptoms_of` (verdicts).
"""

from __future__ import annotations

from pamrs.diagnosis.evidence._candidates import (
    Attempts,
    Candidate,
    Group,
    autocorrelation_of,
    doubted,
    parts_of,
    significant,
    start_of,
    without_autocorrelation,
)
from pamrs.diagnosis.evidence._determined import determined, put_aside, stated, undetermined
from pamrs.diagnosis.evidence._verdicts import (
    Judged,
    calibrated,
    case_ambiguity,
    case_probabilities,
    case_verdict,
    is_parameter,
    judge,
    symptoms_of,
)
from pamrs.diagnosis.evidence._weighing import (
    Ranges,
    capped,
    explains,
    log_weight,
    penalty,
    price,
    probability_cap,
    room_beside,
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
    "autocorrelation_of",
    "capped",
    "calibrated",
    "case_ambiguity",
    "case_probabilities",
    "case_verdict",
    "determined",
    "doubted",
    "explains",
    "is_parameter",
    "judge",
    "log_weight",
    "parts_of",
    "penalty",
    "price",
    "put_aside",
    "probability_cap",
    "room_beside",
    "same_recordings",
    "share_left",
    "significant",
    "stated",
    "stands",
    "start_of",
    "symptoms_of",
    "undetermined",
    "unlikely",
    "visited",
    "weigh",
    "without_autocorrelation",
]
