"""The catalogue of omitted physics: id, block, equation, parameters, fingerprint and rivals of each effect.

The equations run in the core (``crates/pam-core/src/effects``); a test holds both lists together.
"""

from __future__ import annotations

from typing import Final

from pamrs.effects_table.air import AIR
from pamrs.effects_table.entry import EffectInfo, EffectParameter
from pamrs.effects_table.motion import MOTION
from pamrs.effects_table.muscle import MUSCLE
from pamrs.effects_table.sensors import SENSORS

__all__ = ["EFFECTS", "EffectInfo", "EffectParameter", "find_parameter"]

EFFECTS: Final[dict[str, EffectInfo]] = {effect.id: effect for effect in (*AIR, *MUSCLE, *MOTION, *SENSORS)}
"""Every effect by its id, in the order of the chain."""


def find_parameter(name: str) -> EffectParameter:
    """The parameter of a dotted name such as ``leak_muscle.conductance``; KeyError if there is none."""
    effect, _, short = name.partition(".")
    return {parameter.name: parameter for parameter in EFFECTS[effect].parameters}[short]
