"""Other choices of the laws of a rig: its gas, the flow of its valves, the force of its muscles."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import tomlkit

from pamrs.errors import ParameterError, RigError
from pamrs.rig.schema import BLOCKS, of_kind, qualified

if TYPE_CHECKING:
    from pamrs.rig._rig import Rig

_LAWS: Final = {"chamber": "gas", "valve": "flow", "muscle": "model"}
"""Key of each kind of block that chooses its law."""
_ORIFICE_RATIO: Final = 0.528
"""Critical pressure ratio of an orifice."""
_SONIC_CONDUCTANCE: Final = 1.992e-3
"""Sonic conductance of a discharge area [m3/(s Pa) for each m2], of air at 20 degC (ISO 6358)."""
_USUAL_TOLERANCE: Final = 0.1
"""Tolerance of a usual value that nobody stated, as a share of it."""


@dataclass(frozen=True)
class OtherChoice:
    """A rig with another law of some of its blocks.

    Attributes
    ----------
    name : str
        Dotted name of the key, ``chamber.gas``; of several blocks that all of them have.
    stated, other : str
        What the rig file chooses, and the other choice.
    rig : Rig
        The rig with it; what else it needs is at its usual value.
    """

    name: str
    stated: str
    other: str
    rig: Rig


def other_choices(rig: Rig, kinds: tuple[str, ...] = tuple(_LAWS)) -> Iterator[OtherChoice]:
    """Every rig that differs from one in the law of all its chambers, valves or muscles, where the
    file has what the other law needs.

    Parameters
    ----------
    rig : Rig
        The rig.
    kinds : tuple of str, optional
        ``chamber`` (its gas), ``valve`` (its flow), ``muscle`` (its force); all by default.
    """
    for kind in kinds:
        key = next(key for key in BLOCKS[kind] if key.name == _LAWS[kind])
        there = {str(table[key.name]) for table in rig.tables(kind).values()}
        for other in key.choices if len(there) == 1 else ():
            (stated,) = there
            if other not in ("map", stated) and stated != "map":
                try:
                    changed = _with_law(rig, kind, key.name, other)
                except (RigError, ParameterError):
                    continue  # the file lacks what it needs
                yield OtherChoice(f"{kind}.{key.name}", stated, other, changed)


def _with_law(rig: Rig, kind: str, key: str, other: str) -> Rig:
    """A rig whose blocks of a kind have another law."""
    from pamrs.rig._rig import parse_rig

    document: Any = tomlkit.parse(rig.to_toml_text())
    for name in rig.tables(kind):
        table = document[kind][name] if name else document[kind]
        table[key] = other
        for own in BLOCKS[kind]:
            if own.name in table and not of_kind(kind, table, own):
                table.update(_in_other_form(rig, qualified(kind, name), own.name))
                del table[own.name]
        for own in BLOCKS[kind]:
            usual = own.default if own.only and own.kind == "scalar" and not own.path else None
            if own.name not in table and isinstance(usual, float) and of_kind(kind, table, own):
                tol = _USUAL_TOLERANCE * abs(usual)
                table[own.name] = {"value": usual, "unit": own.unit, "tol": tol}
    changed = parse_rig(tomlkit.dumps(document))
    names = {qualified(kind, name) for name in rig.tables(kind)}
    if not names <= {qualified(kind, name) for name in changed.tables(kind)}:
        raise RigError(f"rig {rig.name!r} loses blocks with another {key}")
    return changed


def _in_other_form(rig: Rig, block: str, name: str) -> dict[str, Any]:
    """Keys of a valve's other law of flow that replace a key of its own, with converted values."""
    if name == "discharge_area_max":
        area = rig.parameters[f"{block}.{name}"]
        sonic = {"value": area.value * _SONIC_CONDUCTANCE, "unit": "m3/(s Pa)"}
        sonic["tol"] = area.tol * _SONIC_CONDUCTANCE
        ratio = {"value": _ORIFICE_RATIO, "unit": "1"}
        both = {f"{way}_conductance": sonic for way in ("fill", "vent")}
        return both | {f"{way}_critical_ratio": ratio for way in ("fill", "vent")}
    if name == "fill_conductance":
        fill, vent = (rig.parameters[f"{block}.{way}_conductance"] for way in ("fill", "vent"))
        if fill.value * vent.value == 0.0:
            raise RigError(f"rig {rig.name!r}: {block} lets air through one way, an orifice both")
        size = math.sqrt(fill.value * vent.value) / _SONIC_CONDUCTANCE
        known = {"value": size, "unit": "m2", "tol": fill.tol / fill.value * size}
        return {"discharge_area_max": known}
    return {}
