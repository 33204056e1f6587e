"""The effects that a case can conceal, with forms that differ from the usual catalogue entries.

One module per block; :mod:`.base` tells how an effect enters the plant. `supply_regulator_deadband`
is left out: the rig is fed from a tank without a regulator.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from .arm import BaseFlexibility, ExternalTorque, PayloadChange, PayloadSwing
from .base import RECORDING_PERIOD, Effect, Env, Setting, Start
from .chamber import HeatTransfer, Leak
from .joint import EndStop, HoseTorque, MomentArm, Stribeck, TendonCompliance
from .muscle import ActivationPressure, Buckling, Creep, Crowding, Hysteresis, Mullins, RateDamping
from .sensors import ClockSkew, EncoderError, GearLash, PressureDrift, PressureLag
from .supply import Compressor, SupplyCooling, SupplyLeak
from .valve import (
    CentreLeakage,
    DeadZone,
    ExhaustBackPressure,
    InputLag,
    NullDrift,
    TubeRestriction,
    ValveArea,
    ValveHysteresis,
)

_LISTED: tuple[type[Effect], ...] = (
    SupplyLeak, Compressor, DeadZone, ValveHysteresis, CentreLeakage, ValveArea, InputLag,
    TubeRestriction, Leak, HeatTransfer,
    Hysteresis, Creep, RateDamping, ActivationPressure, Mullins, Crowding, Stribeck, EndStop,
    PayloadSwing,
    PayloadChange, ExternalTorque, BaseFlexibility, PressureLag, EncoderError, ClockSkew,
)  # fmt: skip
_UNLISTED: tuple[type[Effect], ...] = (
    TendonCompliance, NullDrift, Buckling, GearLash, HoseTorque, SupplyCooling, ExhaustBackPressure,
    MomentArm,
    PressureDrift,
)  # fmt: skip
TYPES: dict[str, type[Effect]] = {t.id: t for t in (*_LISTED, *_UNLISTED)}
LISTED = tuple(t.id for t in _LISTED)
UNLISTED = tuple(t.id for t in _UNLISTED)
KINDS = ("none", "parameters", *LISTED, *UNLISTED)
#: order in which the command passes through the effects of the valve
_SHAPERS = ("valve_null_drift", "valve_hysteresis", "valve_dead_zone", "valve_area")


class Effects:
    """All effects of one plant.

    Parameters
    ----------
    *effects : Effect
        At most one of each id.

    Raises
    ------
    ValueError
        The same id twice.
    """

    def __init__(self, *effects: Effect) -> None:
        order = {
            name: i for i, name in enumerate((*_SHAPERS, *(i for i in TYPES if i not in _SHAPERS)))
        }
        self.items = tuple(sorted(effects, key=lambda e: order.get(e.id, len(order))))
        if len({e.id for e in effects}) != len(effects):
            raise ValueError("an effect is given twice")

    def __iter__(self) -> Iterator[Effect]:
        return iter(self.items)

    def to_dict(self) -> dict[str, Any]:
        """Parameters of the effects that are present, by effect id."""
        return {e.id: e.to_dict() for e in self.items}


def draw(
    kind: str, strength: float, rng: np.random.Generator, setting: Setting | None = None
) -> Effect:
    """Draw one effect.

    Parameters
    ----------
    kind : str
        One of the effect ids.
    strength : float
        1 is moderate; the graded fields are multiplied by it.
    rng : numpy.random.Generator
        Source of the numbers.
    setting : Setting, optional
        The case: number and length of its recordings, tank pressure, payload.

    Raises
    ------
    ValueError
        Unknown kind, or a strength that is not positive.
    """
    if not strength > 0.0:
        raise ValueError(f"strength must be positive, got {strength!r}")
    if kind not in TYPES:
        raise ValueError(f"unknown effect {kind!r}; known: {', '.join(TYPES)}")
    effect = TYPES[kind].draw(rng, setting or Setting())
    return effect.scaled(min(strength, effect.most()))


__all__ = [
    "KINDS",
    "LISTED",
    "RECORDING_PERIOD",
    "TYPES",
    "UNLISTED",
    "Effect",
    "Effects",
    "Env",
    "HeatTransfer",
    "Setting",
    "Start",
    "draw",
]
