"""What the modules of chapter 5 have in common: its statements, and numbers in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from reproduction.statements import Statements

say: Final = Statements("chapter5")


def listed(values: Sequence[float] | NDArray[np.float64], digits: int = 2) -> str:
    """Numbers in words."""
    return ", ".join(f"{value:.{digits}f}" for value in values)
