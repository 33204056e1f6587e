"""Every key of a rig file in one table, and the ports by which blocks name each other.

The core has unit, bounds, usual value and kind of each key, and whether it can carry a derivative
(``crates/pam-core/src/keys.rs``); the words are in ``words.toml``.
"""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Mapping
from importlib import resources
from typing import Any, Final, Literal, NamedTuple

from pamrs import _core

__all__ = [
    "ACTS",
    "BLOCKS",
    "LIMITS",
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
#: Blocks that come once and have no name; every other one may come several times, then each with
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
    moves : bool
        Whether it can carry a derivative of what is measured; others a fit moves by differences.
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
    moves: bool = False

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
        In words, what it is where the file leaves it out; :mod:`pamrs.rig._ports` does it.
    """

    name: str
    kinds: tuple[str, ...]
    words: tuple[str, ...] = ()
    default: str = ""


#: Keys of [joint] that are no part of its transmission.
STOPS: Final = ("min_angle", "max_angle", "stop_stiffness", "stop_damping")
SPRING: Final = ("stiffness", "spring_angle")

#: Tables inside a block: name -> the keys that are in it, there without the name of the table.
_INNER: Final[dict[str, dict[str, tuple[str, ...]]]] = {
    "valve": {"area_fraction": ("opening", "fraction")},
    "muscle": {
        "map": ("map_pressure", "map_contraction", "map_force"),
        "end_ratio": ("k0", "contraction_slope", "extension_slope", "neck_floor"),
        "friction": (
            "friction_coefficient",
            "friction_pressure_slope",
            "friction_floor",
            "friction_presliding",
        ),
    },
}

#: What the bench allows, for experiments that are proposed: the core knows nothing of it.
LIMITS: Final = (
    Key("max_pressure", "Pa", 0.0, 1e8, note="gauge, of muscle and chamber"),
    Key("payloads", "kg", 0.0, 1e5, kind="vector", note="masses that can be hung"),
)


def _key(block: str, stated: dict[str, Any], note: str) -> Key:
    """A key as the core tells it, with its place in the file and its words."""
    name, kind, usual = stated["name"], stated["kind"], stated["usual"]
    bounds = {} if kind == "choice" else {end: stated[end] for end in ("lower", "upper")}
    inner = _INNER.get(block, {}).items()
    return Key(
        name,
        stated["unit"],
        **bounds,
        default=tuple(usual)
        if isinstance(usual, list)
        else int(usual)
        if kind == "count" and usual is not None
        else usual,
        kind=kind,
        choices=tuple(stated["choices"]),
        path=next(((t, name.removeprefix(f"{t}_")) for t, names in inner if name in names), ()),
        only=tuple(stated["only"]),
        needs=stated["needs"],
        note=note,
        moves=stated["moves"],
    )


_CORE_BLOCKS: Final[list[dict[str, Any]]] = json.loads(_core.blocks())
_WORDS: Final[dict[str, dict[str, Any]]] = tomllib.loads(
    resources.files("pamrs.rig").joinpath("words.toml").read_text(encoding="utf-8")
)

BLOCKS: Final[dict[str, tuple[Key, ...]]] = {
    block["name"]: tuple(
        _key(block["name"], key, _WORDS.get(block["name"], {}).get(key["name"], ""))
        for key in block["keys"]
    )
    for block in _CORE_BLOCKS
}
"""Block -> its keys, in the order in which they are written."""
ACTS: Final[dict[str, tuple[str, ...]]] = {
    block["name"]: tuple(block["acts_in"]) for block in _CORE_BLOCKS
}
"""Kinds of block of the cut rig in which a block of the rig acts."""
PORTS: Final[dict[str, tuple[Port, ...]]] = {
    block: tuple(
        Port(name, tuple(port["kinds"]), tuple(port.get("words", ())), port["default"])
        for name, port in words["ports"].items()
    )
    for block, words in _WORDS.items()
    if "ports" in words
}
"""Block -> its ports."""


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
    """True where blocks of the kind of this one can have a key."""
    return not key.only or kind_for(block, content, key) in key.only


def _none(count: Any) -> bool:
    """True where a count is 0 or left out, in a file or in a model."""
    number = count.get("value") if isinstance(count, Mapping) else count
    return number is None or (isinstance(number, (int, float)) and number == 0)


def kind_for(block: str, content: Mapping[str, Any], key: Key) -> Any:
    """The kind of a block on which it depends whether it has a key."""
    choice = next(k for k in BLOCKS[block] if k.kind == "choice" and {*key.only} <= {*k.choices})
    return content.get(choice.name, choice.default)


def kind_of(block: str, content: Mapping[str, Any]) -> Any:
    """Force model of a muscle, flow of a valve, gas of a chamber, kind of a supply, line, joint,
    transmission, arm or load, None for the other blocks.
    """
    choice = next((key for key in BLOCKS[block] if key.kind == "choice"), None)
    return None if choice is None else content.get(choice.name, choice.default)


def qualified(block: str, name: str) -> str:
    """Full name of a block: ``"valve"`` without a name, else ``"valve.flexor"``."""
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
