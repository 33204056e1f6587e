"""Channels by name: what is measured or simulated, and its SI unit."""

from __future__ import annotations

import math
from typing import Final

__all__ = ["UNITS", "channel_of", "dotted", "laboratory_unit", "rate_of", "recorded_as", "unit_of"]

#: SI unit of each channel, recorded or simulated; pressures gauge, but for the ambient one. Where a
#: rig has several blocks of a kind, the name of the block stands behind a dot:
#: ``muscle_pressure.flexor``; behind that the number of a tube's segment:
#: ``segment_flow.flexor.1``.
UNITS: Final[dict[str, str]] = {
    "time": "s",
    "valve_command": "V",
    "supply_command": "Pa",
    "pressure_command": "Pa",
    "supply_pressure": "Pa",
    "line_pressure": "Pa",
    "muscle_pressure": "Pa",
    "joint_angle": "rad",
    "length": "m",
    "force": "N",
    "joint_torque": "N m",
    "temperature": "K",
    "ambient_temperature": "K",
    "ambient_pressure": "Pa",
    "reference": "rad",
    "joint_rate": "rad/s",
    "length_rate": "m/s",
    "contraction_ratio": "1",
    "muscle_force": "N",
    "air_volume": "m3",
    "air_mass": "kg",
    "line_mass": "kg",
    "segment_pressure": "Pa",
    "segment_flow": "kg/s",
    "segment_mass": "kg",
    "mass_supplied": "kg",
    "mass_vented": "kg",
    "energy_supplied": "J",
    "exergy_supplied": "J",
    "enthalpy_gained": "J",
    "heat_gained": "J",
    "gas_work": "J",
    "muscle_work": "J",
    "joint_work": "J",
}


def channel_of(name: str) -> str:
    """The channel of a name: ``muscle_pressure`` of ``muscle_pressure.flexor``."""
    return name.partition(".")[0]


def dotted(channel: str, name: str) -> str:
    """``muscle_pressure.flexor``, or ``muscle_pressure`` for a block without a name."""
    return f"{channel}.{name}" if name else channel


def rate_of(name: str) -> str:
    """The channel of the rate of an angle or a length: ``joint_rate.elbow`` of
    ``joint_angle.elbow``.
    """
    kind, dot, block = name.partition(".")
    return f"{'length_rate' if kind == 'length' else 'joint_rate'}{dot}{block}"


def recorded_as(name: str) -> str:
    """What a recording calls a simulated channel: ``force`` is what it has of ``muscle_force``."""
    kind, dot, block = name.partition(".")
    return f"{'force' if kind == 'muscle_force' else kind}{dot}{block}"


def unit_of(name: str) -> str:
    """SI unit of a channel, "1" for one that is not known."""
    return UNITS.get(channel_of(name), "1")


#: What a laboratory reads its instruments in, for SI units: unit, and factor from SI.
_LABORATORY: Final = {
    "Pa": ("bar", 1e-5),
    "rad": ("deg", 180.0 / math.pi),
    "rad/s": ("deg/s", 180.0 / math.pi),
    "m": ("mm", 1e3),
    "m/s": ("mm/s", 1e3),
}


def laboratory_unit(name: str) -> tuple[str, float]:
    """The unit that people read a channel in, and the factor from SI.

    Parameters
    ----------
    name : str
        The channel.

    Returns
    -------
    tuple of (str, float)
        bar, deg, mm, their rates; SI for all others.
    """
    unit = unit_of(name)
    return _LABORATORY.get(unit, (unit, 1.0))
