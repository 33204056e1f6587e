"""Screen for effects that are worth a fit: scores, and one recording left out after the other.

Public: `Score`, `Screen`, `Tangent`, `screen`, `tangent_of`, `by_effect`, `best_of_each_kind`,
`predicted_by_others`.
"""

from pamrs.diagnosis.screen._leave_one_out import predicted_by_others
from pamrs.diagnosis.screen._screening import (
    STRONG_SIZES,
    Score,
    Screen,
    Tangent,
    best_of_each_kind,
    by_effect,
    screen,
    tangent_of,
)

__all__ = [
    "STRONG_SIZES",
    "Score",
    "Screen",
    "Tangent",
    "best_of_each_kind",
    "by_effect",
    "predicted_by_others",
    "screen",
    "tangent_of",
]
