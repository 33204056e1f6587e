"""Channels: what is measured or simulated, one row for each.

A channel of recordings is a row of `CHANNELS`: its unit, the range of the possible, the block of a
rig that it is measured at, the words by which logs call it. Readers, proposals, checks and the
diagnosis ask the table.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

__all__ = [
    "CHANNELS",
    "COMMANDED",
    "DRIVEN_COMMANDS",
    "MEASURED",
    "UNITS",
    "Channel",
    "block_of",
    "channel_of",
    "dotted",
    "laboratory_unit",
    "rate_of",
    "read_in",
    "recorded_as",
    "unit_of",
    "with_trait",
]

#: Words that say that a series was commanded, and that it was measured.
COMMANDED: Final = (
    "set soll sollwert setpoint sp ref reference des desired cmd command commanded target demand "
    "vorgabe"
)
MEASURED: Final = "act actual ist istwert meas measured mess messwert fb feedback sensor gauge"
_PRESSURE: Final = "pressure druck p press air luft presion pression"
_OUTSIDE: Final = "ambient umgebung room raum"
_TRANSDUCER: Final = 200.0  # [Pa] noise of a usual transducer of 14 bar with a 16-bit converter


@dataclass(frozen=True)
class Channel:
    """A channel of recordings.

    Attributes
    ----------
    name : str
        Where a rig has several blocks of a kind, the name of the block follows a dot:
        ``muscle_pressure.flexor``.
    unit : str
        SI unit; pressures gauge, but for the ambient one.
    lower, upper : float
        Range of the possible, SI.
    block : str
        Kind of the blocks of a rig that have it; empty for what is measured outside the rig.
    words, hints : str
        Words by which logs call it: one of `words` is enough, `hints` are shared with others.
    sensor : str
        What is measured there.
    traits : str
        Words: ``command`` (drives the rig or says where it should go, and holds from sample to
        sample), ``driven`` (a command that a rig takes from recordings), ``pressure`` (a gauge in
        the air of the rig), ``needed`` (nearly every diagnosis takes it), ``extra`` (few benches
        have it), ``clips`` (its sensor ends at a rail), ``steady`` (may stay at one value),
        ``unjudged`` (no fault of a sensor is sought), ``rests`` (stops and dry friction hold it
        still), ``moves`` (an encoder may read it), ``slow`` (need not last as long as the others),
        ``surroundings`` (conditions around the rig; a diagnosis sets the rig by it), ``named``
        (never found by a weak word or by its unit alone), ``strong`` (never found by a weak word
        alone), ``played`` (of files that are played; no log has it).
    units : tuple of str
        SI units of what it may be, where that is not `unit` alone.
    only : tuple of str, optional
        Key of the block and its value, where not every block of the kind has it.
    noise : float
        Standard deviation of a sample by a usual sensor, SI; 0 of commands, and where no cut chain
        uses the channel.
    """

    name: str
    unit: str
    lower: float = -math.inf
    upper: float = math.inf
    block: str = ""
    words: str = ""
    hints: str = ""
    sensor: str = ""
    traits: str = ""
    units: tuple[str, ...] = ()
    only: tuple[str, str] | None = None
    noise: float = 0.0

    @property
    def strong(self) -> frozenset[str]:
        """Set of the words that name the channel."""
        return frozenset(self.words.split())

    @property
    def weak(self) -> frozenset[str]:
        """Set of the words that hint at the channel."""
        return frozenset(self.hints.split())

    @property
    def possible(self) -> tuple[str, ...]:
        """SI units of what it may be."""
        return self.units or (self.unit,)

    def has(self, trait: str) -> bool:
        """True where the channel has a trait."""
        return trait in self.traits.split()


#: The channels of recordings by name.
CHANNELS: Final[dict[str, Channel]] = {
    row.name: row
    for row in (
        Channel("time", "s"),
        Channel(
            "valve_command", "V", -1000.0, 1000.0, "valve",
            "valve ventil valvula vanne servo spool uvalve", f"u ao voltage volt input {COMMANDED}",
            "voltage of the valve", "command driven needed",
        ),
        Channel(
            "supply_command", "Pa", -1.3e5, 1e8, "supply",
            "setpoint regulator regler psoll pset", f"supply {COMMANDED}",
            "set pressure of the regulator", "command driven needed",
            only=("kind", "regulator"),
        ),
        Channel("pressure_command", "Pa", -1.3e5, 1e8, traits="command played"),
        Channel(
            "supply_pressure", "Pa", -1.3e5, 1e8, "supply",
            "supply tank reservoir source versorgung psup ps psupply ptank vorrat speise kessel "
            "behälter behaelter regulator regler vordruck netzdruck zuluft upstream suministro "
            "alimentacion alimentation", _PRESSURE,
            "pressure in the tank or behind the regulator", "pressure clips strong steady",
            noise=_TRANSDUCER,
        ),
        Channel(
            "line_pressure", "Pa", -1.3e5, 1e8, "line",
            "line hose tube leitung schlauch pline", _PRESSURE,
            "pressure between valve and hose", "pressure clips strong extra", noise=_TRANSDUCER,
        ),
        Channel(
            "muscle_pressure", "Pa", -1.3e5, 1e8, "chamber",
            "muscle pam mckibben muskel musculo chamber kammer pm p1 pmuscle",
            f"{_PRESSURE} actuator bladder tank",
            "pressure in the muscle or its chamber", "pressure clips needed", noise=_TRANSDUCER,
        ),
        Channel(
            "joint_angle", "rad", -100.0, 100.0, "joint",
            "angle winkel angulo theta phi encoder enc", "joint position pos q elbow knee",
            "angle of the joint", "needed rests moves", noise=math.radians(0.03),  # a Hall sensor
        ),
        Channel(
            "length", "m", -100.0, 100.0, "load",
            "length laenge länge longitud longueur stroke displacement weg lvdt disp",
            "x position pos laser",
            "length of the muscle", "needed rests moves", noise=3e-5,  # a linear transducer
        ),
        Channel(
            "force", "N", -1e7, 1e7, "load", "force kraft fuerza loadcell", "load cell f fz",
            "pull of the muscles, by a load cell", "needed clips extra",
            noise=1.0,  # a load cell of 2 to 5 kN, 0.02 to 0.05 % of its range
        ),
        Channel(
            "joint_torque", "N m", -1e7, 1e7, "joint", "torque moment drehmoment", "m mz joint",
            "torque of the muscles at the joint, by a torque sensor", "clips extra",
        ),
        Channel(
            "temperature", "K", 50.0, 2000.0, "chamber",
            "temperature temp temperatur thermo tc tgas tair ttank tchamber",
            "gas chamber kammer tank tgas tair ttank tchamber",
            "temperature of the gas in the muscle or its chamber", "slow named extra",
            only=("gas", "energy_balance"), noise=0.1,  # a thermocouple's amplifier
        ),
        Channel(
            "air_flow", "kg/s", -100.0, 100.0, "chamber",
            "flow flowmeter durchfluss massenstrom caudal debit mdot", "mass air gas chamber",
            "flow into the muscle or its chamber, by a meter in front of it", "clips named extra",
        ),
        Channel(
            "ambient_temperature", "K", 50.0, 2000.0, "",
            f"{_OUTSIDE} umgebungstemperatur raumtemperatur tamb troom",
            "temperature temp temperatur thermo tc umgebungstemperatur raumtemperatur tamb troom",
            traits="slow named surroundings unjudged",
        ),
        Channel(
            "ambient_pressure", "Pa", 2e4, 1.2e5, "",
            f"{_OUTSIDE} atmospheric atmosphere barometric barometer baro luftdruck pamb patm",
            f"{_PRESSURE} barometer baro luftdruck pamb patm", traits="slow named surroundings",
        ),
        Channel(
            "reference", "rad", -1e9, 1e9, "",
            "reference ref desired target sollwert", "soll wanted", traits="command",
            units=("rad", "Pa"),
        ),
    )
}  # fmt: skip
#: SI unit of each channel, recorded or simulated; pressures gauge, but for the ambient one. After
#: the name of the block comes the number of a tube's segment: ``segment_flow.flexor.1``.
UNITS: Final[dict[str, str]] = {
    **{name: row.unit for name, row in CHANNELS.items()},
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


def with_trait(trait: str) -> tuple[str, ...]:
    """The channels of recordings with a trait, in the order of the table."""
    return tuple(name for name, row in CHANNELS.items() if row.has(trait))


#: Commands that a rig takes from recordings.
DRIVEN_COMMANDS: Final = with_trait("driven")


def block_of(name: str) -> str:
    """Name of the block behind the dot of a channel, a port or a kind of block; empty without."""
    return name.partition(".")[2]


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
    """Name in a recording of a simulated channel: ``force`` for ``muscle_force``, others as they
    are.
    """
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


def read_in(unit: str) -> tuple[str, float]:
    """The unit that people read a quantity in, and the factor from SI.

    Parameters
    ----------
    unit : str
        Its SI unit.

    Returns
    -------
    tuple of (str, float)
        bar, deg, mm, their rates; SI for all others.
    """
    return _LABORATORY.get(unit, (unit, 1.0))


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
    return read_in(unit_of(name))
