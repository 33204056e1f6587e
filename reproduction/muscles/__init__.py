"""Published facts about the muscles of the library, and those from which their moduli come.

A file ``NAME.toml`` has a ``[[fact]]`` for each statement, and prior and conditions of the
identification.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pamrs.library import quantity

__all__ = ["Fact", "facts", "identification"]


@dataclass(frozen=True)
class Fact:
    """One published statement about a muscle.

    Attributes
    ----------
    name, where : str
        What is stated, and where in the dissertation.
    kind : str
        Which quantity is compared (a name of ``reproduction.muscles.evaluate.KINDS``).
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


@cache
def _document(name: str) -> dict[str, Any]:
    """The file of a muscle."""
    return tomllib.loads(Path(__file__).with_name(f"{name}.toml").read_text(encoding="utf-8"))


def facts(name: str) -> list[Fact]:
    """Published statements about a muscle of the library."""
    return [_fact(item) for item in _document(name)["fact"]]


def identification(name: str) -> dict[str, Any]:
    """Prior, conditions and angle from which the moduli of a muscle were identified."""
    return {key: item for key, item in _document(name).items() if key != "fact"}


def _fact(item: Mapping[str, Any]) -> Fact:
    published = quantity(item["published"])
    given = {key: item[key] for key in ("relation", "used", "cannot_tell", "note") if key in item}
    if "tolerance" in item:
        relative = item["tolerance"]["unit"] == "%"
        given["tolerance"] = quantity(item["tolerance"]) * (abs(published) if relative else 1.0)
    return Fact(
        name=item["name"],
        where=item["where"],
        kind=item["kind"],
        at={key: quantity(value) for key, value in item.get("at", {}).items()},
        published=published,
        unit=item["published"]["unit"],
        **given,
    )
