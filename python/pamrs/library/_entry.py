"""One muscle of the library: its file, in which each number has a unit and an origin."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pamrs.units import parse_unit

if TYPE_CHECKING:
    from pamrs.rig import Muscle


@dataclass(frozen=True)
class Entry:
    """A muscle of the library, and what is known of it.

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
    """

    name: str
    title: str
    parameters: dict[str, Any]
    origins: dict[str, str]
    mass: float | None
    max_pressure: float

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


def read_entry(text: str) -> Entry:
    """A muscle from the text of its file, one of those in the folder of this module."""
    document = tomllib.loads(text)
    numbers = {**document["muscle"], **document["properties"]}
    mass = document["properties"].get("mass")
    return Entry(
        name=document["name"],
        title=document["title"],
        parameters={key: quantity(item) for key, item in document["muscle"].items()},
        origins={key: item["origin"] for key, item in numbers.items()},
        mass=None if mass is None else quantity(mass),
        max_pressure=quantity(document["properties"]["max_pressure"]),
    )
