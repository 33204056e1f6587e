"""Every key of a rig file in one table: unit, bounds and default of each; and the ports by which
blocks name each other.

The bounds are those of the possible, not of the likely: outside them a value is a mistake in the
file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, Literal, NamedTuple

from pamrs.rig.muscle_models import ALL_MODELS, GEOMETRIES, models_with

__all__ = [
    "BLOCKS",
    "PORTS",
    "REQUIRED_BLOCKS",
    "SCHEMA",
    "SINGLE_BLOCKS",
    "SPRING",
    "STOPS",
    "Key",
    "Port",
    "keys_of",
    "kind_for",
    "kind_of",
    "of_kind",
    "qualified",
    "split_name",
    "tables_of",
]

SCHEMA: Final = "pamrs.rig/1"
REQUIRED_BLOCKS: Final = ("gas", "chamber")
#: Blocks that stand once and have no name; every other one may stand several times, then each with
#: a name.
SINGLE_BLOCKS: Final = ("gas", "arm", "load")

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
        The kinds of the block (force model of a muscle, kind of a joint) that have this key; empty
        for all.
    needs : str
        A count of the block without which (0) it does not have this key; empty for none.
    note : str
        What it is, where the name does not say it.
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
    needs: str = ""
    note: str = ""

    @property
    def where(self) -> tuple[str, ...]:
        """Path in the file, inside the block."""
        return self.path or (self.name,)


class Port(NamedTuple):
    """A key of a block that names another block.

    Attributes
    ----------
    name : str
        Name in the file.
    kinds : tuple of str
        Kinds of block that it may name.
    words : tuple of str
        What else it may be: ``ambient``, ``load``, ``base``.
    default : str
        In words, what it is where the file leaves it out.
    """

    name: str
    kinds: tuple[str, ...]
    words: tuple[str, ...] = ()
    default: str = ""


_POLYTROPIC_LOW, _POLYTROPIC_HIGH = 0.3, 3.0
_RIGHT_ANGLE = math.pi / 2
_TURN = 2 * math.pi
_TENDON = ("tendon", "published")
_TRANSMISSIONS = (*_TENDON, "pulley", "polynomial")
_ONE_LINK = ("one_link",)
_ISO = ("iso_6358",)
_SPRUNG = ("second_order",)
_SWITCHING = ("switching",)
_MAP = ("map",)
_ELASTIC = tuple(model for model in ALL_MODELS if model != "map")
_COEFFICIENTS = ("coefficients",)

#: Keys of [joint] that are no part of its transmission.
STOPS: Final = ("min_angle", "max_angle", "stop_stiffness", "stop_damping")
SPRING: Final = ("stiffness", "spring_angle")

#: A further key that says what keys a block has, and what it is where it is left out.
_FURTHER_KINDS: Final = {"valve": ("spool", "ideal")}

#: The key of a block that says of which kind it is, and the kind where it is left out.
_KINDS: Final = {
    "supply": ("kind", "tank"),
    "valve": ("flow", "orifice"),
    "line": ("kind", "tube"),
    "chamber": ("gas", "coefficients"),
    "muscle": ("model", "robinson"),
    "transmission": ("kind", "tendon"),
    "joint": ("kind", "tendon"),
    "arm": ("kind", "one_link"),
    "load": ("kind", "mass"),
}

#: How far a muscle shortens at an angle: of a joint, or of a muscle's own transmission in the
#: joint's place.
_GEOMETRY: Final = (
    Key("upper_axial", "m", 1e-6, 10.0, only=_TENDON),
    Key("upper_offset", "m", -10.0, 10.0, only=_TENDON),
    Key("lower_axial", "m", 1e-6, 10.0, only=_TENDON),
    Key("lower_offset", "m", -10.0, 10.0, only=_TENDON),
    Key("radius", "m", -10.0, 10.0, only=("pulley",)),
    Key("coefficients", "m", -100.0, 100.0, kind="vector", only=("polynomial",)),
    Key("rest_angle", "rad", -_TURN, _TURN, note="where the muscle is at rest length"),
)

#: Of the gauge at a supply or at the inlet of a line: those of chambers stand in [sensors].
_GAUGE_ZERO: Final = Key(
    "pressure_zero",
    "Pa",
    -1e6,
    1e6,
    0.0,
    note="what its gauge reads too much; known as well as those of the chambers where left out",
)

#: What the bench allows, for experiments that are proposed: the core knows nothing of it.
LIMITS: Final = (
    Key("max_pressure", "Pa", 0.0, 1e8, note="gauge, of muscle and chamber"),
    Key("payloads", "kg", 0.0, 1e5, kind="vector", note="masses that can be hung"),
)

#: block -> its keys, in the order in which they are written.
BLOCKS: Final[dict[str, tuple[Key, ...]]] = {
    "gas": (
        Key("ambient_pressure", "Pa", 1e3, 2e5, 101325.0),
        Key("temperature", "K", 150.0, 500.0, 293.15),
        Key("gas_constant", "J/(kg K)", 20.0, 5000.0, 287.05),
        Key("heat_capacity_ratio", "1", 1.01, 1.7, 1.4),
    ),
    "supply": (
        Key("kind", default="tank", kind="choice", choices=("tank", "constant", "regulator")),
        Key("volume", "m3", 1e-7, 1e3, only=("tank",)),
        Key(
            "initial_pressure",
            "Pa",
            0.0,
            1e8,
            note="of a regulator what it is set to until it gets a command",
        ),
        Key("time_constant", "s", 1e-4, 100.0, 0.05, only=("regulator",)),
        Key(
            "droop",
            "Pa s/kg",
            0.0,
            1e12,
            0.0,
            only=("regulator",),
            note="fall of the outlet pressure per mass flow",
        ),
        Key("dead_time", "s", 0.0, 10.0, 0.0, only=("regulator",), note="how late a command acts"),
        Key(
            "rise_limit",
            "Pa/s",
            1.0,
            1e12,
            1e12,
            only=("regulator",),
            note="fastest rise of the outlet pressure; 1e12 Pa/s: none",
        ),
        Key(
            "fall_limit",
            "Pa/s",
            1.0,
            1e12,
            1e12,
            only=("regulator",),
            note="fastest fall of the outlet pressure; 1e12 Pa/s: none",
        ),
        Key(
            "dead_band",
            "Pa",
            0.0,
            1e7,
            0.0,
            only=("regulator",),
            note="error of the outlet pressure that it does nothing about",
        ),
        _GAUGE_ZERO,
    ),
    "valve": (
        Key(
            "flow",
            default="orifice",
            kind="choice",
            choices=("orifice", "iso_6358"),
            note="one area, or conductance and critical ratio of either path",
        ),
        Key("discharge_area_max", "m2", 1e-11, 1e-2, only=("orifice",)),
        Key("fill_conductance", "m3/(s Pa)", 0.0, 1e-4, only=_ISO, note="sonic, C"),
        Key("fill_critical_ratio", "1", 0.0, 0.9, only=_ISO, note="b"),
        Key("vent_conductance", "m3/(s Pa)", 0.0, 1e-4, only=_ISO, note="0 where it has no vent"),
        Key("vent_critical_ratio", "1", 0.0, 0.9, only=_ISO),
        Key("null_voltage", "V", -50.0, 50.0),
        Key("half_range", "V", 1e-3, 100.0),
        Key(
            "spool",
            default="ideal",
            kind="choice",
            choices=("ideal", "second_order", "switching"),
            note="where the command says, a mass on a spring, or on and off by a coil",
        ),
        Key("natural_frequency", "Hz", 0.1, 1e5, only=_SPRUNG),
        Key("damping_ratio", "1", 0.01, 100.0, 0.7, only=_SPRUNG),
        Key(
            "with_current",
            default="fill",
            kind="choice",
            choices=("fill", "vent", "closed", "either"),
            only=_SWITCHING,
            note="what is open; either: two coils, one above null_voltage and one below",
        ),
        Key(
            "without_current",
            default="closed",
            kind="choice",
            choices=("closed", "vent", "fill"),
            only=_SWITCHING,
            note="what is open",
        ),
        Key(
            "opening_delay",
            "s",
            0.0,
            10.0,
            0.0,
            only=_SWITCHING,
            note="from the current to the spool's move; shorter pulses move nothing",
        ),
        Key(
            "closing_delay",
            "s",
            0.0,
            10.0,
            0.0,
            only=_SWITCHING,
            note="from the end of the current to the spool's return; shorter gaps move nothing",
        ),
        Key(
            "carrier_frequency",
            "Hz",
            0.0,
            1e5,
            0.0,
            only=_SWITCHING,
            note="the command is a duty, latched once a period; 0: no pulses, on above one half",
        ),
        Key(
            "carrier_phase",
            "1",
            0.0,
            1.0,
            0.0,
            only=_SWITCHING,
            note="share of a period after which the first one begins",
        ),
        Key("opening", "1", 0.0, 1.0, kind="vector", path=("area_fraction", "opening")),
        Key("fraction", "1", 0.0, 1.0, kind="vector", path=("area_fraction", "fraction")),
    ),
    "line": (
        Key("kind", default="tube", kind="choice", choices=("tube", "orifice")),
        Key("length", "m", 1e-3, 1e3, only=("tube",)),
        Key("diameter", "m", 1e-4, 0.2, only=("tube",)),
        Key("discharge_area", "m2", 1e-12, 1e-1, only=("orifice",)),
        Key(
            "inlet_volume",
            "m3",
            0.0,
            1.0,
            0.0,
            note="at its inlet where valves feed it, besides half of the tube's own",
        ),
        _GAUGE_ZERO,
        Key(
            "segments",
            "1",
            0,
            256,
            0,
            kind="count",
            only=("tube",),
            note="in which it holds gas and carries waves; 0: it passes its flow at once",
        ),
        Key(
            "alpha",
            "1",
            0.5,
            2.0,
            1.4,
            only=("tube",),
            needs="segments",
            note="of the gas in its segments, 1.4 as in sound, 1 where the wall keeps it cold",
        ),
    ),
    "chamber": (
        Key("dead_volume", "m3", 1e-10, 1e2),
        Key("initial_pressure", "Pa", -1e5, 1e8, 0.0),
        Key(
            "gas",
            default="coefficients",
            kind="choice",
            choices=("coefficients", "energy_balance"),
            note="published coefficients, or an energy balance that keeps mass",
        ),
        Key("alpha_in", "1", _POLYTROPIC_LOW, _POLYTROPIC_HIGH, 1.4, only=_COEFFICIENTS),
        Key("alpha_out", "1", _POLYTROPIC_LOW, _POLYTROPIC_HIGH, 1.0, only=_COEFFICIENTS),
        Key("alpha", "1", _POLYTROPIC_LOW, _POLYTROPIC_HIGH, 1.2, only=_COEFFICIENTS),
        Key(
            "heat_transfer_coefficient",
            "W/(m2 K)",
            0.0,
            1e5,
            50.0,
            only=("energy_balance",),
            note="of the wall, at 1 bar and gas.temperature",
        ),
    ),
    "muscle": (
        Key("model", default="robinson", kind="choice", choices=ALL_MODELS),
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
        Key(
            "extension_factors",
            "1",
            -10.0,
            10.0,
            (0.3, 0.8, 0.8),
            kind="vector",
            only=models_with("extension_factors"),
        ),
        Key(
            "map_pressure",
            "Pa",
            -1e5,
            1e8,
            kind="vector",
            path=("map", "pressure"),
            only=_MAP,
            note="gauge, rising",
        ),
        Key(
            "map_contraction",
            "1",
            -1.0,
            1.0,
            kind="vector",
            path=("map", "contraction"),
            only=_MAP,
            note="rising",
        ),
        Key(
            "map_force",
            "N",
            -1e7,
            1e7,
            kind="vector",
            path=("map", "force"),
            only=_MAP,
            note="a row over the contractions for each pressure, one after the other",
        ),
        Key("modulus_scale", "1", 0.0, 100.0, 1.0),
        Key(
            "softening",
            "1/K",
            -0.1,
            0.1,
            0.0,
            only=_ELASTIC,
            note="relative loss of every modulus per kelvin above reference_temperature",
        ),
        Key("temperature", "K", 150.0, 500.0, 293.15, only=_ELASTIC, note="of the muscle"),
        Key(
            "reference_temperature",
            "K",
            150.0,
            500.0,
            293.15,
            only=_ELASTIC,
            note="at which the moduli hold",
        ),
        Key("k0", "1", 0.0, 100.0, 1.64, path=("end_ratio", "k0")),
        Key("contraction_slope", "1", -1e3, 1e3, 2.405, path=("end_ratio", "contraction_slope")),
        Key("extension_slope", "1", -1e3, 1e3, 6.105, path=("end_ratio", "extension_slope")),
        Key("neck_floor", "1", 0.0, 1.0, 0.80, path=("end_ratio", "neck_floor")),
        Key("friction_coefficient", "1", -1.0, 1.0, 0.0, path=("friction", "coefficient")),
        Key(
            "friction_pressure_slope", "1/Pa", -1e-4, 1e-4, 0.0, path=("friction", "pressure_slope")
        ),
        Key("friction_floor", "1", 0.0, 1.0, 0.0, path=("friction", "floor")),
        Key("friction_presliding", "m", 1e-7, 1.0, 1e-3, path=("friction", "presliding")),
        Key(
            "buckling_load",
            "N",
            0.0,
            1e9,
            0.0,
            note="the most that one muscle pushes; 0: it goes slack, 1e9 N: it pushes without end",
        ),
    ),
    "transmission": (
        Key("kind", default="tendon", kind="choice", choices=_TRANSMISSIONS),
        *_GEOMETRY,
    ),
    "joint": (
        Key("kind", default="tendon", kind="choice", choices=(*_TRANSMISSIONS, "free")),
        *_GEOMETRY,
        Key("min_angle", "rad", -_TURN, _TURN),
        Key("max_angle", "rad", -_TURN, _TURN),
        Key("stop_stiffness", "N m/rad", 0.0, 1e9, 2e4),
        Key("stop_damping", "N m s/rad", 0.0, 1e7, 60.0),
        Key(
            "stiffness",
            "N m/rad",
            0.0,
            1e9,
            0.0,
            note="of a spring across the joint, in addition to the muscles; 0: none",
        ),
        Key("spring_angle", "rad", -_TURN, _TURN, 0.0, note="where that spring is at rest"),
    ),
    "arm": (
        Key("kind", default="one_link", kind="choice", choices=("one_link", "planar")),
        Key("inertia", "kg m2", 1e-9, 1e6, only=_ONE_LINK),
        Key("first_moment", "kg m", -1e5, 1e5, 0.0, only=_ONE_LINK),
        Key("length", "m", 1e-4, 100.0, only=_ONE_LINK),
        Key("payload", "kg", 0.0, 1e5, 0.0, only=_ONE_LINK),
        Key("viscous", "N m s/rad", 0.0, 1e6, 0.0, only=_ONE_LINK),
        Key("coulomb", "N m", 0.0, 1e6, 0.0, only=_ONE_LINK),
        Key("coulomb_speed", "rad/s", 1e-9, 100.0, 0.02, only=_ONE_LINK),
        Key("gravity", "m/s2", -50.0, 50.0, 9.80665),
        Key(
            "base_angle",
            "rad",
            -_TURN,
            _TURN,
            0.0,
            note="of the (first) link from the direction of gravity at its joint's zero",
        ),
        Key(
            "centre_angle",
            "rad",
            -_TURN,
            _TURN,
            0.0,
            only=_ONE_LINK,
            note="of the centre of mass off the line of the link, positive as the joint's angle",
        ),
    ),
    "link": (
        Key("length", "m", 0.0, 100.0),
        Key("mass", "kg", 0.0, 1e5),
        Key("centre", "m", -100.0, 100.0, note="of mass, from its joint"),
        Key("inertia", "kg m2", 0.0, 1e6, note="about its centre of mass"),
        Key("payload", "kg", 0.0, 1e5, 0.0, note="at its end"),
        Key("viscous", "N m s/rad", 0.0, 1e6, 0.0),
        Key("coulomb", "N m", 0.0, 1e6, 0.0),
        Key("coulomb_speed", "rad/s", 1e-9, 100.0, 0.02),
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
        Key("length_zero", "m", -10.0, 10.0, 0.0),
    ),
}

#: block -> its ports. What they default to stands here in words; :mod:`pamrs.rig._ports` does it.
PORTS: Final[dict[str, tuple[Port, ...]]] = {
    "supply": (
        Port(
            "inlet",
            ("supply",),
            default="none: a regulator then gives what it is set to",
        ),
    ),
    "valve": (
        Port(
            "from",
            ("supply", "chamber"),
            default=(
                "the supply of the same name, else the only one that is no inlet of a regulator"
            ),
        ),
        Port(
            "to",
            ("line", "chamber"),
            default=(
                "the line without from or the chamber of the same name, else the only line without "
                "from, else the only chamber"
            ),
        ),
    ),
    "line": (
        Port(
            "from",
            ("supply", "chamber"),
            default=(
                "the valves that lead to it, else the supply of the same name, else, without "
                "valves, the only supply that is no inlet of a regulator"
            ),
        ),
        Port(
            "to",
            ("chamber",),
            ("ambient",),
            default="the chamber of the same name, else the only chamber",
        ),
    ),
    "muscle": (
        Port(
            "chamber", ("chamber",), default="the chamber of the same name, else the only chamber"
        ),
        Port(
            "joint",
            ("joint",),
            ("load",),
            default="the joint of the same name, else the only joint, else the load",
        ),
    ),
    "link": (
        Port(
            "on",
            ("link",),
            ("base",),
            default="the link before it in the file, for the first the base",
        ),
        Port("joint", ("joint",), default="the joint of the same name"),
    ),
}


def keys_of(block: str, content: Mapping[str, Any]) -> tuple[Key, ...]:
    """The keys that a block of its kind has: force model of a muscle, kind of a joint; those that
    need a count where it is not 0.
    """
    return tuple(
        key
        for key in BLOCKS[block]
        if of_kind(block, content, key) and not (key.needs and _none(content.get(key.needs)))
    )


def of_kind(block: str, content: Mapping[str, Any], key: Key) -> bool:
    """Whether blocks of the kind of this one can have a key."""
    kinds = [kind_of(block, content), _further(block, content)]
    return not key.only or any(kind in key.only for kind in kinds)


def _none(count: Any) -> bool:
    """Whether a count is 0 or left out, in a file or in a model."""
    number = count.get("value") if isinstance(count, Mapping) else count
    return number is None or (isinstance(number, (int, float)) and number == 0)


def kind_for(block: str, content: Mapping[str, Any], key: Key) -> Any:
    """The kind of a block on which it depends whether it has a key."""
    name = _FURTHER_KINDS.get(block, ("", None))[0]
    further = next((other.choices for other in BLOCKS[block] if other.name == name), ())
    own = any(kind in further for kind in key.only)
    return _further(block, content) if own else kind_of(block, content)


def _further(block: str, content: Mapping[str, Any]) -> Any:
    """Spool of a valve, None for the other blocks."""
    name, default = _FURTHER_KINDS.get(block, ("", None))
    return content.get(name, default)


def kind_of(block: str, content: Mapping[str, Any]) -> Any:
    """Force model of a muscle, flow of a valve, gas of a chamber, kind of a supply, line, joint,
    transmission, arm or load, None for the other blocks.
    """
    name, default = _KINDS.get(block, ("", None))
    return content.get(name, default)


def qualified(block: str, name: str) -> str:
    """What a block is called in full: ``"valve"`` without a name, else ``"valve.flexor"``."""
    return f"{block}.{name}" if name else block


def split_name(dotted: str) -> tuple[str, str, str]:
    """Block, name of the block (``""`` without one) and key of a dotted name such as
    ``"valve.flexor.half_range"``.
    """
    block, _, rest = dotted.partition(".")
    name, _, key = rest.rpartition(".")
    return block, name, key


def tables_of(model: Mapping[str, Any], block: str) -> dict[str, dict[str, Any]]:
    """Tables of a model by the name of the block, ``""`` for one without a name; empty where there
    is none.

    No value of a block is a table, so that the content itself shows whether its entries are values
    or named blocks.
    """
    content = model.get(block)
    if content is None:
        return {}
    named = all(isinstance(inner, dict) for inner in content.values())
    return dict(content) if named else {"": content}
