"""The model with what was found: the fits of all groups of blocks in one rig, what it leaves of the
recordings at every stage, the budget of each block, and the whole rig from its commands alone.

Public: `conclude`, `Conclusion`, `Models`, `with_std`, `spoiled_channels`, `owners_of_effects`,
`owners_of_parameters` (whose value the model has), `refitted_rig` (values of the refits),
`DETERMINED_SHARE` (from when recordings tell one), `notes_on_constants` (free runs).
"""

from pamrs.diagnosis.model._budget import DETERMINED_SHARE, owners_of_effects, owners_of_parameters
from pamrs.diagnosis.model._conclude import (
    Conclusion,
    Models,
    conclude,
    refitted_rig,
    spoiled_channels,
    with_std,
)
from pamrs.diagnosis.model._free_run import notes_on_constants

__all__ = [
    "DETERMINED_SHARE",
    "Conclusion",
    "Models",
    "conclude",
    "owners_of_effects",
    "owners_of_parameters",
    "notes_on_constants",
    "refitted_rig",
    "spoiled_channels",
    "with_std",
]
