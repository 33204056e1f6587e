"""What the statements of chapter 5 have in common: the names of their groups, and how one is
written down.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pamrs.comparison import Comparison, judge

__all__ = ["GROUPS", "Group", "listed"]

#: The experiments by the name under which figures find their group.
GROUPS: Final = {
    "rig": "rig, trajectory and gains (5.2, 5.4)",
    "sliding": "sliding with right and wrong estimates (5.4.1, Fig. 5.8)",
    "adaptive": "adaptive sliding (5.4.2, Table 5.2, Figs. 5.9 and 5.10)",
    "neural": "neural networks (5.4.3, 5.5, Figs. 5.11 to 5.17, 5.21)",
    "compound": "comparison on the compound trajectory after training (5.5, Fig. 5.19)",
    "lift": "comparison on lift, hold and return after training (5.5, Fig. 5.20)",
    "effects": "what the model leaves out and the orders of 5.5",
    "hysteresis": "hysteresis, diagnosed and compensated (5.5, future work)",
}


class Group:
    """Collects the statements about one experiment."""

    def __init__(self, name: str) -> None:
        self.title, self.rows = GROUPS[name], list[Comparison]()

    def say(
        self, fact: str, where: str, published: float, ours: float, unit: str = "", **more: Any
    ) -> None:
        """Judge one statement."""
        self.rows.append(judge(self.title, fact, where, published, float(ours), unit, **more))

    def smaller(self, fact: str, where: str, ours: float, note: str = "", **more: Any) -> None:
        """A ratio that the chapter has below one."""
        self.say(fact, where, 1.0, ours, relation="below", note=note, **more)


def listed(values: Sequence[float] | NDArray[np.float64], digits: int = 2) -> str:
    """Numbers in words."""
    return ", ".join(f"{value:.{digits}f}" for value in values)
