"""Writes the model of a rig: as TOML that reads back the same to the last bit, and as the JSON that
the core takes.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

from pamrs.rig._model_error import error_lines
from pamrs.rig._ports import Ports
from pamrs.rig._reader import Content
from pamrs.rig.schema import (
    BLOCKS,
    LIMITS,
    PORTS,
    SCHEMA,
    SPRING,
    STOPS,
    Key,
    keys_of,
    kind_of,
    qualified,
    tables_of,
)

_OWN: Final = ', error = "own"'
_MOUNTING: Final = ("base_angle", "centre_angle")

# ---------------------------------------------------------------------------------- TOML


def toml_text(content: Content) -> str:
    """A rig as TOML in SI units.

    Parameters
    ----------
    content : Content
        Name, model, tolerances and standard deviations.

    Returns
    -------
    str
        A rig file; reading it gives the same numbers, names and ports.
    """
    lines = [f"schema = {_text(SCHEMA)}", f"name = {_text(content.name)}"]
    lines += [f"case = {_text(content.model['case'])}"] if content.model.get("case") else []
    for block in BLOCKS:
        for name, table in tables_of(content.model, block).items():
            lines += ["", f"[{qualified(block, name)}]", *block_lines(content, block, name, table)]
    lines += error_lines(content.model)
    lines += limit_lines(content.model)
    for effect in content.model["effects"]:
        lines += effect_lines(content, effect)
    return "\n".join(lines) + "\n"


def limit_lines(model: Mapping[str, Any]) -> list[str]:
    """``[limits]`` as lines of TOML; none where the bench's are not given."""
    limits = model.get("limits", {})
    lines = ["", "[limits]"] if limits else []
    return lines + [
        f"{key.name} = {entry_text(key, limits[key.name], 0.0)}"
        for key in LIMITS
        if key.name in limits
    ]


def effect_lines(content: Content, effect: Mapping[str, Any]) -> list[str]:
    """One table ``[[effects]]`` as lines of TOML."""
    from pamrs.effects import EFFECTS

    place = effect.get("at", "")
    lines = [
        "",
        "[[effects]]",
        f"id = {_text(effect['id'])}",
        *([f"at = {_text(place)}"] if place else []),
        *([f"form = {_text(effect['form'])}"] if "form" in effect else []),
        "[effects.parameters]",
    ]
    parameters = EFFECTS[effect["id"]].form(effect.get("form", "")).parameters
    units = {parameter.name: parameter.unit for parameter in parameters}
    full = qualified(effect["id"], place)
    spread = content.effect_std.get(full, {})
    for name, value in effect["parameters"].items():
        std = f", std = {_number(spread[name])}" if name in spread else ""
        std += _OWN if content.leaves_open(f"{full}.{name}") else ""
        lines.append(f"{name} = {{ value = {_number(value)}, unit = {_text(units[name])}{std} }}")
    return lines


def block_lines(content: Content, block: str, name: str, table: Mapping[str, Any]) -> Iterator[str]:
    """The lines of one block: its ports as the file gave them, its keys, its groups of keys."""
    label = qualified(block, name)
    given = content.model.get("ports", {}).get(label, {})
    yield from (
        f"{port.name} = {_text(given[port.name])}"
        for port in PORTS.get(block, ())
        if port.name in given
    )
    groups: dict[str, list[str]] = {}
    for key in keys_of(block, table):
        if key.name not in table:
            continue
        dotted = f"{label}.{key.name}"
        own = content.leaves_open(dotted)
        entry = entry_text(key, table[key.name], content.tolerances.get(dotted, 0.0), own=own)
        if len(key.where) == 1:
            yield f"{key.name} = {entry}"
        else:
            groups.setdefault(key.where[0], []).append(f"{key.where[1]} = {entry}")
    yield from (f"{group} = {{ {', '.join(members)} }}" for group, members in groups.items())


def entry_text(key: Key, value: Any, tol: float, *, own: bool = False) -> str:
    """The value of one key, with its unit and tolerance, or that each recording has its own."""
    if key.kind == "choice":
        return _text(value)
    if key.kind == "count":
        return str(value)
    if key.kind == "vector":
        numbers = "[" + ", ".join(_number(item) for item in value) + "]"
        if key.path:
            return numbers
    note = (
        "" if tol == 0.0 else (", unknown = true" if math.isinf(tol) else f", tol = {_number(tol)}")
    )
    note += _OWN if own else ""
    if key.kind == "vector":
        return f"{{ value = {numbers}, unit = {_text(key.unit)}{note} }}"
    if key.path and not note:
        return _number(value)
    return f"{{ value = {_number(value)}, unit = {_text(key.unit)}{note} }}"


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)


def _number(value: float) -> str:
    return repr(float(value))


# ---------------------------------------------------------------------------------- JSON


def core_json(model: Mapping[str, Any], ports: Ports) -> str:
    """A model as the core takes it: lists of named blocks, every port given in full.

    Parameters
    ----------
    model : mapping
        As :attr:`pamrs.Rig.model`.
    ports : dict
        As :func:`pamrs.rig._ports.connect` returns them.

    Returns
    -------
    str
        JSON text; SI, radians, gauge pressures. Keys that the kind of a block does not have are
        left out.
    """
    transmissions, joints = tables_of(model, "transmission"), tables_of(model, "joint")
    document = {
        "name": model["name"],
        "gas": model["gas"],
        "supplies": [
            {"name": name, **ports["supply"][name], **_gauged(table)}
            for name, table in tables_of(model, "supply").items()
        ],
        "valves": [
            {"name": name, **ports["valve"][name], **_unusual(table, flow="orifice", spool="ideal")}
            for name, table in tables_of(model, "valve").items()
        ],
        "lines": [_line(name, table, ports) for name, table in tables_of(model, "line").items()],
        "chambers": [
            {"name": name, **_unusual(table, gas="coefficients")}
            for name, table in tables_of(model, "chamber").items()
        ],
        "muscles": [
            {
                "name": name,
                **ports["muscle"][name],
                "transmission": _transmission(transmissions.get(name)),
                "muscle": table,
            }
            for name, table in tables_of(model, "muscle").items()
        ],
        "joints": [
            {
                "name": name,
                "transmission": None if kind_of("joint", table) == "free" else _transmission(table),
                "rest_angle": table["rest_angle"],
                **{key: table[key] for key in STOPS},
                **_nonzero(table, SPRING),
            }
            for name, table in joints.items()
        ],
        "arm": _arm(model, ports),
        "load": model["load"],
        "sensors": [
            {
                "name": name,
                "pressure_zero": table.get("pressure_zero", 0.0),
                "angle_zero": table.get("angle_zero", 0.0),
            }
            | {key: table[key] for key in ("length_zero",) if key in table}
            | ({"force_gain": gain} if (gain := table.get("force_gain", 1.0)) != 1.0 else {})
            for name, table in tables_of(model, "sensors").items()
        ],
        "effects": [
            {
                key: effect.get(key, "")
                for key in ("id", "at", "form")
                if key != "form" or key in effect
            }
            | {"parameters": effect["parameters"]}
            for effect in model["effects"]
        ],
    }
    bears = model.get("limits", {}).get("max_pressure")
    return json.dumps(document if bears is None else {**document, "max_pressure": bears})


def _line(name: str, table: Mapping[str, Any], ports: Ports) -> dict[str, Any]:
    usual = () if table.get("segments") else ("segments",)  # none: the core needs no word of it
    values = {k: value for k, value in _gauged(table).items() if k not in ("kind", *usual)}
    ends = ports["line"][name]
    return {"name": name, "kind": table["kind"], "from": ends["from"], "to": ends["to"], **values}


def _gauged(table: Mapping[str, Any]) -> dict[str, Any]:
    """Supply or line without a ``pressure_zero`` of zero, which is the core's default."""
    return {key: value for key, value in table.items() if key != "pressure_zero" or value != 0.0}


def _unusual(table: Mapping[str, Any], **usual: str) -> dict[str, Any]:
    """Table without the choices that are the core's defaults."""
    return {key: value for key, value in table.items() if usual.get(key) != value}


def _nonzero(table: Mapping[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    """Entries that are not zero; the core takes zero for those that it is not given."""
    return {name: table[name] for name in names if table.get(name, 0.0) != 0.0}


def _transmission(table: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Geometry by which a muscle pulls on its joint; None where it is the joint's own."""
    if table is None:
        return None
    return {key: value for key, value in table.items() if key not in (*STOPS, *SPRING)}


def _arm(model: Mapping[str, Any], ports: Ports) -> dict[str, Any] | None:
    if model["arm"] is None:
        return None
    tables = tables_of(model, "link")
    arm = model["arm"]
    return {
        **{key: value for key, value in arm.items() if key not in _MOUNTING},
        **_nonzero(arm, _MOUNTING),
        "links": [
            {"name": name, "joint": ends["joint"], **tables[name]}
            for name, ends in ports["link"].items()
        ],
    }
