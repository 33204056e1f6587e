"""The catalogue of omitted physics: id, block, equation, parameters, fingerprint and rivals of each effect.

The equations run in the core (``crates/pam-core/src/effects``); a test holds both lists together.
"""

from __future__ import annotations

from typing import Final

from pamrs.effects_table.air import AIR
from pamrs.effects_table.closure import CLOSURES
from pamrs.effects_table.entry import EffectInfo, EffectParameter
from pamrs.effects_table.motion import MOTION
from pamrs.effects_table.muscle import MUSCLE
from pamrs.effects_table.sensors import SENSORS

__all__ = ["CATALOGUE", "EFFECTS", "EffectInfo", "EffectParameter", "find_parameter"]

EFFECTS: Final[dict[str, EffectInfo]] = {effect.id: effect for effect in (*AIR, *MUSCLE, *MOTION, *SENSORS, *CLOSURES)}
"""Every effect by its id, in the order of the chain; closures last."""
CATALOGUE: Final[dict[str, EffectInfo]] = {name: effect for name, effect in EFFECTS.items() if effect.catalogue}
"""Those that a diagnosis may name."""


def find_parameter(name: str) -> EffectParameter:
    """The parameter of a dotted name such as ``leak_muscle.conductance``; KeyError if there is none."""
    effect, _, short = name.partition(".")
    return {parameter.name: parameter for parameter in EFFECTS[effect].parameters}[short]
