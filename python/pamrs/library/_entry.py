"""One muscle of the library: reads its file, in which each number has a unit and an origin."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

from pamrs._checks import one_of, refused
from pamrs.errors import ParameterError
from pamrs.units import parse_unit

if TYPE_CHECKING:
    from pamrs.rig import Muscle

SCHEMA: Final = "pamrs.library/1"
RELATIONS: Final = ("equals", "above", "below")
_IDENTIFICATION: Final = ("prior", "condition", "angle")  # keys of `Entry.identification`


@dataclass(frozen=True)
class Fact:
    """One published statement about a muscle.

    Attributes
    ----------
    name, where : str
        What is stated, and where in the dissertation.
    kind : str
        Which quantity is compared (a name of ``pamrs.library.evaluate.KINDS``).
    at : dict
        Conditions in SI units (pressures are gauge).
    published, tolerance : float
        Value in SI units, and the largest absolute deviation that counts as agreement.
    unit : str
        Unit of the statement, for display.
    relation : {"equals", "above", "below"}
        How ours must stand to the published value.
    used : bool
        The fact took part in the identification, so that agreement proves nothing.
    cannot_tell : str
        Why the fact decides nothing; empty if it does.
    note : str
        A remark.
    """

    name: str
    where: str
    kind: str
    at: dict[str, float]
    published: float
    unit: str
    tolerance: float = 0.0
    relation: str = "equals"
    used: bool = False
    cannot_tell: str = ""
    note: str = ""


@dataclass(frozen=True)
class Entry:
    """What the library knows about one muscle.

    Attributes
    ----------
    name, title : str
        Name in the library, and one line of description.
    parameters : dict
        Arguments of :class:`pamrs.Muscle` in SI units.
    origins : dict
        Where each number comes from, in words: ``published: ...``, ``deduced: ...``,
        ``identified from ...``, ``assumed: ...``.
    mass : float or None
        Mass of one muscle [kg]; None where none is published.
    max_pressure : float
        Highest gauge pressure of its tests [Pa].
    facts : tuple of Fact
        What is published about it.
    identification : dict
        Prior and conditions from which `reproduction.identify.derive` derives the
        identified numbers.
    """

    name: str
    title: str
    parameters: dict[str, Any]
    origins: dict[str, str]
    mass: float | None
    max_pressure: float
    facts: tuple[Fact, ...]
    identification: dict[str, Any] = field(repr=False)

    @cached_property
    def muscle(self) -> Muscle:
        """The muscle with the ``robinson`` model on elliptic ends."""
        from pamrs.rig import Muscle

        return Muscle(**self.parameters)


def quantity(item: Mapping[str, Any]) -> Any:
    """Value of ``{value, unit}`` in SI units, a number or a list of numbers."""
    scale = parse_unit(item["unit"]).scale
    value = item["value"]
    return [scale * float(v) for v in value] if isinstance(value, list) else scale * float(value)


def read_entry(text: str, source: str) -> Entry:
    """Read the file of one muscle.

    Parameters
    ----------
    text : str
        TOML, as the files beside this module.
    source : str
        What to call it in messages.

    Returns
    -------
    Entry

    Raises
    ------
    ParameterError
        If the text is no TOML, a key is missing, a number has no origin, or a unit is unknown; the
        message names the file.
    """
    try:
        document = tomllib.loads(text)
        if document.get("schema") != SCHEMA:
            raise refused("schema", document.get("schema"), f"it must be {SCHEMA!r}")
        numbers = {**document["muscle"], **document["properties"]}
        without = [key for key, item in numbers.items() if not item.get("origin")]
        if without:
            raise ParameterError(f"no origin is given for {', '.join(without)}")
        mass = document["properties"].get("mass")
        return Entry(
            name=document["name"],
            title=document["title"],
            parameters={key: quantity(item) for key, item in document["muscle"].items()},
            origins={key: item["origin"] for key, item in numbers.items()},
            mass=None if mass is None else quantity(mass),
            max_pressure=quantity(document["properties"]["max_pressure"]),
            facts=tuple(_fact(item) for item in document.get("fact", [])),
            identification={key: document[key] for key in _IDENTIFICATION if key in document},
        )
    except tomllib.TOMLDecodeError as error:
        raise ParameterError(f"{source}: not valid TOML: {error}") from error
    except KeyError as error:
        raise ParameterError(f"{source}: the key {error} is missing") from error
    except ParameterError as error:
        raise ParameterError(f"{source}: {error}") from error


def _fact(item: Mapping[str, Any]) -> Fact:
    published = quantity(item["published"])
    relation = item.get("relation", "equals")
    one_of(f"fact {item['name']!r}: relation", relation, RELATIONS)
    tolerance = 0.0
    if "tolerance" in item:
        relative = item["tolerance"]["unit"] == "%"
        tolerance = quantity(item["tolerance"]) * (abs(published) if relative else 1.0)
    return Fact(
        name=item["name"],
        where=item["where"],
        kind=item["kind"],
        at={key: quantity(value) for key, value in item.get("at", {}).items()},
        published=published,
        unit=item["published"]["unit"],
        tolerance=tolerance,
        relation=relation,
        used=item.get("used", False),
        cannot_tell=item.get("cannot_tell", ""),
        note=item.get("note", ""),
    )
