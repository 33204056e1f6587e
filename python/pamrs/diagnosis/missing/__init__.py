"""The missing input: what the model of a block would need to follow the recordings, what it depends
on, in numbers and in words.

Public: `missing_input_of` (a block and its recordings), `reconstruct` with `Reconstruction` (one
recording), `worst_block` (which one misses most).
"""

from __future__ import annotations

from pamrs.diagnosis.missing._missing_input import missing_input_of, worst_block
from pamrs.diagnosis.missing._reconstruct import Reconstruction, reconstruct

__all__ = ["Reconstruction", "missing_input_of", "reconstruct", "worst_block"]
