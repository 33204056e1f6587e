"""The description of a rig: blocks with parameters, the file that holds it, muscle and joint.

:class:`Rig` is what everything else works with; :func:`load_rig` reads one from a TOML file.
:class:`Muscle` and :class:`Joint` can also be used alone. :mod:`pamrs.rig.schema` lists the blocks
and keys that a rig file may have, :mod:`pamrs.rig.muscle_models` lists the force models.
:class:`Reader` and :func:`muscle_problems` read and check the blocks of other files as those of a
rig.
"""

from pamrs.rig._checks import muscle_problems
from pamrs.rig._choices import OtherChoice, other_choices
from pamrs.rig._joint import Joint
from pamrs.rig._muscle import Muscle, force_table
from pamrs.rig._reader import Reader
from pamrs.rig._rig import (
    Parameter,
    Rig,
    check_sample_time,
    load_rig,
    parse_rig,
    payload_of,
)
from pamrs.rig._switching import effect_parameter, full_name, named_entries
from pamrs.rig._units import Units

__all__ = [
    "Joint",
    "Muscle",
    "OtherChoice",
    "Parameter",
    "Reader",
    "Rig",
    "Units",
    "check_sample_time",
    "effect_parameter",
    "force_table",
    "full_name",
    "load_rig",
    "muscle_problems",
    "named_entries",
    "other_choices",
    "parse_rig",
    "payload_of",
]
