"""Standard experiments that a person can record on a rig, each as the commands that are sent.

Public: `library`, `experiments_of` (all that a rig can do; as high and as fast as was recorded);
`Experiment`, `protocol_of` (one of them, and its commands as a file); `Chain`, `chains_of`,
`can_shut`, `is_sealed`, `joined` (what is commanded); `Range`, `pressure_range` (how far);
`Rates`, `Seen` (how fast a load frame moves); `commands_for` (what makes pressures follow
references).
"""

from pamrs.experiments._chains import (
    Chain,
    Range,
    can_shut,
    chains_of,
    commands_for,
    is_sealed,
    joined,
    pressure_range,
)
from pamrs.experiments._experiment import Experiment, protocol_of
from pamrs.experiments._frame import Rates, Seen
from pamrs.experiments._protocols import experiments_of, library

__all__ = [
    "Chain",
    "Experiment",
    "Range",
    "Rates",
    "Seen",
    "can_shut",
    "chains_of",
    "commands_for",
    "experiments_of",
    "is_sealed",
    "joined",
    "library",
    "pressure_range",
    "protocol_of",
]
