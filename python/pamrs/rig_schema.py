"""Every key of a rig file in one table: unit, bounds and default of each.

The bounds are those of the possible, not of the likely: outside them a value is a mistake in the file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, Literal, NamedTuple

from pamrs.muscle_models import GEOMETRIES, MODELS, models_with

__all__ = ["BLOCKS", "REQUIRED_BLOCKS", "SCHEMA", "Key", "find_key", "keys_of", "kind_of"]

SCHEMA: Final = "pamrs.rig/1"
REQUIRED_BLOCKS: Final = ("gas", "chamber")

Kind = Literal["scalar", "count", "vector", "choice"]


class Key(NamedTuple):
    """One entry of a block.

    Attributes
    ----------
    name : str
        Name in the model, and in the file unless ``path`` says otherwise.
    unit : str
        SI unit ("1" for a pure number).
    lower, upper : float
        Bounds in SI units, both allowed.
    default : float, str, tuple of float or None
        Value when the file leaves it out; None makes the key required.
    kind : str
        ``scalar``, ``count`` (whole number), ``vector`` or ``choice`` (text).
    choices : tuple of str
        What a ``choice`` may be.
    path : tuple of str
        Where the file has it inside the block: ``("end_ratio", "k0")``.
    only : tuple of str
        The kinds of the block (force model of a muscle, kind of a joint) that have this key; empty for all.
    """

    name: str
    unit: str = "1"
    lower: float = -math.inf
    upper: float = math.inf
    default: float | str | tuple[float, ...] | None = None
    kind: Kind = "scalar"
    choices: tuple[str, ...] = ()
    path: tuple[str, ...] = ()
    only: tuple[str, ...] = ()

    @property
    def where(self) -> tuple[str, ...]:
        """Path in the file, inside the block."""
        return self.path or (self.name,)


_POLYTROPIC_LOW, _POLYTROPIC_HIGH = 0.3, 3.0
_RIGHT_ANGLE = math.pi / 2
_TURN = 2 * math.pi
_TENDON = ("tendon", "published")

#: The key of a block that says of which kind it is, and the kind where it is left out.
_KINDS: Final = {"muscle": ("model", "robinson"), "joint": ("kind", "tendon"), "load": ("kind", "mass")}

#: block -> its keys, in the order in which they are written.
BLOCKS: Final[dict[str, tuple[Key, ...]]] = {
    "gas": (
        Key("ambient_pressure", "Pa", 1e3, 2e5, 101325.0),
        Key("temperature", "K", 150.0, 500.0, 293.15),
        Key("gas_constant", "J/(kg K)", 20.0, 5000.0, 287.05),
        Key("heat_capacity_ratio", "1", 1.01, 1.7, 1.4),
    ),
    "supply": (
        Key("volume", "m3", 1e-7, 1e3),
        Key("initial_pressure", "Pa", 0.0, 1e8),
    ),
    "valve": (
        Key("discharge_area_max", "m2", 1e-11, 1e-2),
        Key("null_voltage", "V", -50.0, 50.0),
        Key("half_range", "V", 1e-3, 100.0),
        Key("opening", "1", 0.0, 1.0, kind="vector", path=("area_fraction", "opening")),
        Key("fraction", "1", 0.0, 1.0, kind="vector", path=("area_fraction", "fraction")),
    ),
    "chamber": (
        Key("dead_volume", "m3", 1e-10, 1e2),
        Key("alpha_in", "1", _POLYTROPIC_LOW, _POLYTROPIC_HIGH, 1.4),
        Key("alpha_out", "1", _POLYTROPIC_LOW, _POLYTROPIC_HIGH, 1.0),
        Key("alpha", "1", _POLYTROPIC_LOW, _POLYTROPIC_HIGH, 1.2),
    ),
    "muscle": (
        Key("model", default="robinson", kind="choice", choices=MODELS),
        Key("geometry", default="", kind="choice", choices=GEOMETRIES),  # the model's own
        Key("count", "1", 1, 1000, 1, kind="count"),
        Key("rest_length", "m", 1e-3, 10.0),
        Key("rest_diameter", "m", 1e-4, 1.0),
        Key("braid_angle", "rad", 1e-2, _RIGHT_ANGLE - 1e-3),
        Key("wall_thickness", "m", 1e-6, 0.1),
        Key("modulus_slope", "1", -1e6, 1e6, kind="vector", only=models_with("modulus_slope")),
        Key("modulus_offset", "Pa", -1e11, 1e11, kind="vector", only=models_with("modulus_offset")),
        Key("c10", "Pa", -1e11, 1e11, only=models_with("c10")),
        Key("c01", "Pa", -1e11, 1e11, 0.0, only=models_with("c01")),
        Key("bladder_modulus", "Pa", -1e11, 1e11, only=models_with("bladder_modulus")),
        Key("extension_factors", "1", -10.0, 10.0, (0.3, 0.8, 0.8), kind="vector", only=models_with("extension_factors")),
        Key("modulus_scale", "1", 0.0, 100.0, 1.0),
        Key("k0", "1", 0.0, 100.0, 1.64, path=("end_ratio", "k0")),
        Key("contraction_slope", "1", -1e3, 1e3, 2.405, path=("end_ratio", "contraction_slope")),
        Key("extension_slope", "1", -1e3, 1e3, 6.105, path=("end_ratio", "extension_slope")),
        Key("neck_floor", "1", 0.0, 1.0, 0.80, path=("end_ratio", "neck_floor")),
        Key("friction_coefficient", "1", -1.0, 1.0, 0.0, path=("friction", "coefficient")),
        Key("friction_pressure_slope", "1/Pa", -1e-4, 1e-4, 0.0, path=("friction", "pressure_slope")),
        Key("friction_floor", "1", 0.0, 1.0, 0.0, path=("friction", "floor")),
        Key("friction_presliding", "m", 1e-7, 1.0, 1e-3, path=("friction", "presliding")),
    ),
    "joint": (
        Key("kind", default="tendon", kind="choice", choices=("tendon", "published", "pulley", "polynomial")),
        Key("upper_axial", "m", 1e-6, 10.0, only=_TENDON),
        Key("upper_offset", "m", -10.0, 10.0, only=_TENDON),
        Key("lower_axial", "m", 1e-6, 10.0, only=_TENDON),
        Key("lower_offset", "m", -10.0, 10.0, only=_TENDON),
        Key("radius", "m", -10.0, 10.0, only=("pulley",)),
        Key("coefficients", "m", -100.0, 100.0, kind="vector", only=("polynomial",)),
        Key("rest_angle", "rad", -_TURN, _TURN),
        Key("min_angle", "rad", -_TURN, _TURN),
        Key("max_angle", "rad", -_TURN, _TURN),
        Key("stop_stiffness", "N m/rad", 0.0, 1e9, 2e4),
        Key("stop_damping", "N m s/rad", 0.0, 1e7, 60.0),
    ),
    "arm": (
        Key("inertia", "kg m2", 1e-9, 1e6),
        Key("first_moment", "kg m", -1e5, 1e5, 0.0),
        Key("length", "m", 1e-4, 100.0),
        Key("payload", "kg", 0.0, 1e5, 0.0),
        Key("viscous", "N m s/rad", 0.0, 1e6, 0.0),
        Key("coulomb", "N m", 0.0, 1e6, 0.0),
        Key("coulomb_speed", "rad/s", 1e-9, 100.0, 0.02),
        Key("gravity", "m/s2", -50.0, 50.0, 9.80665),
    ),
    "load": (
        Key("kind", default="mass", kind="choice", choices=("mass", "frame")),
        Key("min_length", "m", 1e-3, 10.0),
        Key("max_length", "m", 1e-3, 10.0),
        Key("mass", "kg", 1e-6, 1e5, only=("mass",)),
        Key("viscous", "N s/m", 0.0, 1e7, 0.0, only=("mass",)),
        Key("coulomb", "N", 0.0, 1e7, 0.0, only=("mass",)),
        Key("coulomb_speed", "m/s", 1e-9, 100.0, 0.01, only=("mass",)),
        Key("gravity", "m/s2", -50.0, 50.0, 9.80665, only=("mass",)),
        Key("stop_stiffness", "N/m", 0.0, 1e11, 1e6, only=("mass",)),
        Key("stop_damping", "N s/m", 0.0, 1e9, 1e3, only=("mass",)),
    ),
    "sensors": (
        Key("pressure_zero", "Pa", -1e6, 1e6, 0.0),
        Key("angle_zero", "rad", -_TURN, _TURN, 0.0),
    ),
}


def keys_of(block: str, content: Mapping[str, Any]) -> tuple[Key, ...]:
    """The keys that a block of its kind has: force model of a muscle, kind of a joint."""
    kind = kind_of(block, content)
    return tuple(key for key in BLOCKS[block] if not key.only or kind in key.only)


def kind_of(block: str, content: Mapping[str, Any]) -> Any:
    """Force model of a muscle, kind of a joint, None for the other blocks."""
    name, default = _KINDS.get(block, ("", None))
    return content.get(name, default)


def find_key(dotted: str) -> Key | None:
    """The table's entry for ``"block.name"``, or None."""
    block, _, name = dotted.partition(".")
    return next((key for key in BLOCKS.get(block, ()) if key.name == name), None)
