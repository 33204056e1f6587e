"""Which effects are worth a fit, and how sure that is: scores, resamples of the recordings, one
recording left out after the other.

Public: `Score`, `Screen`, `Stand`, `screen`, `stand_of`, `by_effect`, `best_of_each_kind`,
`best_size`, `inclusion`, `left_out`.
"""

from __future__ import annotations

from pamrs.diagnosis.screen._leave_one_out import left_out
from pamrs.diagnosis.screen._resampling import inclusion
from pamrs.diagnosis.screen._screening import (
    STRONG_SIZES,
    Score,
    Screen,
    Stand,
    best_of_each_kind,
    best_size,
    by_effect,
    screen,
    stand_of,
)

__all__ = [
    "STRONG_SIZES",
    "Score",
    "Screen",
    "Stand",
    "best_of_each_kind",
    "best_size",
    "by_effect",
    "inclusion",
    "left_out",
    "screen",
    "stand_of",
]
