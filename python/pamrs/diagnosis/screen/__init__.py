"""Screen for effects that are worth a fit: scores of their starts.

Public: `Score`, `Screen`, `Tangent`, `screen`, `tangent_of`, `by_effect`, `best_of_each_kind`.
"""

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
    "screen",
    "tangent_of",
]
