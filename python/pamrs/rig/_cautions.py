"""Cautions about a rig file that is allowed and likely mistaken: valves that never act, chambers
that no air reaches, friction of exactly zero, values without a tolerance.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from pamrs._arrays import Array
from pamrs.rig._joint import Joint
from pamrs.rig._muscle import Muscle
from pamrs.rig._ports import Ports
from pamrs.rig._units import Units
from pamrs.rig.schema import qualified, split_name, tables_of
from pamrs.units import from_si

if TYPE_CHECKING:
    from pamrs.rig._muscle import Muscle
    from pamrs.rig._rig import Parameter


_PATHS = {"fill": ("fill",), "vent": ("vent",), "closed": (), "either": ("fill", "vent")}
"""Paths that are open in each position of a spool that switches."""

_GRAVITY: Final = 9.80665  # [m/s2]

_MEASURED: Final = {
    ("valve", "discharge_area_max"): 0.05,
    ("line", "discharge_area"): 0.05,
    ("chamber", "dead_volume"): 0.1,
    ("muscle", "modulus_scale"): 0.03,
    ("arm", "inertia"): 0.05,
    ("arm", "first_moment"): 0.04,
    ("arm", "payload"): 0.02,
    ("load", "mass"): 0.01,
    ("link", "inertia"): 0.05,
    ("link", "mass"): 0.02,
}
"""Values that a laboratory measures, by block and key, with a usual tolerance as a share."""

_ANGLES: Final = 200  # angles at which a joint is looked at
_LEAST_STROKE: Final = 0.02  # of the rest length, below which a muscle has little to do
_STIFFEST: Final = 5e6  # modulus of the stiffest rubber that bladders are made of [Pa]


def cautions_of(
    model: Mapping[str, Any],
    ports: Ports,
    parameters: Mapping[str, Parameter],
    units: Units,
    text: str = "",
) -> list[str]:
    """Cautions about parts of a model that are possible and most likely mistakes.

    Parameters
    ----------
    model : mapping
        As :attr:`pamrs.Rig.model`.
    ports : mapping
        What its blocks are connected to.
    parameters : mapping of str to Parameter
        Its parameters by dotted name.
    units : Units
        Those of its file.
    text : str
        The file, as its author wrote it; empty where there is none.

    Returns
    -------
    list of str
        One sentence each, with the block, the value and what follows from it.
    """
    found = _unfed(model, ports)
    for name, valve in tables_of(model, "valve").items():
        label = qualified("valve", name)
        found += _shut(label, valve, units)
        found += _late(label, valve, units)
    for name, muscle in tables_of(model, "muscle").items():
        found += _strut(qualified("muscle", name), muscle, units)
    found += [
        *_limitless(model, units),
        *_strokes(model, ports, units),
        *_slack(model, ports, text, units),
    ]
    return [*found, *_frictionless(parameters, units), *_exact(parameters, units)]


def _highest(model: Mapping[str, Any]) -> float | None:
    """The highest pressure that the muscles get [Pa, gauge], where the file says one."""
    limit = model.get("limits", {}).get("max_pressure")
    tables = tables_of(model, "supply").values()
    full = [table["initial_pressure"] for table in tables if table["kind"] != "regulator"]
    return limit or max(full, default=0.0) or None


def _limitless(model: Mapping[str, Any], units: Units) -> list[str]:
    """Caution where ``limits.max_pressure``, the pressure that the muscles bear, is missing."""
    if not tables_of(model, "muscle") or "max_pressure" in model.get("limits", {}):
        return []
    highest, unit = _highest(model), units.usual("Pa")
    most = "" if highest is None else f"the {units.said('', 'Pa', highest)} of "
    return [
        "limits.max_pressure is missing: nothing says which pressure the muscles bear, and "
        f"simulations go up to {most}the supply without a word; [limits] with max_pressure = "
        f'{{ value = ..., unit = "{unit}" }} says it'
    ]


def _strokes(model: Mapping[str, Any], ports: Ports, units: Units) -> list[str]:
    """Muscles that are too long or too short for what their joint asks of them."""
    found = []
    joints, own_ways = tables_of(model, "joint"), tables_of(model, "transmission")
    for name, ends in ports["muscle"].items():
        kind, _, joint = ends["joint"].partition(".")
        if kind != "joint":
            continue
        table = joints[joint]
        way = Joint.from_model(own_ways.get(name, table))
        angles = np.linspace(table["min_angle"], table["max_angle"], _ANGLES)
        if not way.reaches(angles).all():
            continue  # an error, when the rig is used
        muscle = Muscle.from_model(tables_of(model, "muscle")[name])
        own = qualified("muscle", name), ends["joint"], muscle, way.shortening(angles)
        found += _stroke(*own, _highest(model), units)
    return found


def _stroke(
    label: str, joint: str, muscle: Muscle, shortening: Array, highest: float | None, units: Units
) -> list[str]:
    """Cautions about the shortening [m] of a muscle between the stops of its joint, at the highest
    pressure [Pa]: too little, too far stretched, or beyond its range.
    """
    rest, own = float(muscle.parameters["rest_length"]), f"{label}.rest_length"
    low, high = float(shortening.min()), float(shortening.max())
    if high - low < _LEAST_STROKE * rest:
        share = 100 * (high - low) / rest
        return [
            f"{label} is long for its joint: between its stops {joint} shortens it by "
            f"{units.said(own, 'm', high - low, digits='.3g')}, {share:.2g} % of {own} = "
            f"{units.said(own, 'm', rest)}; are all lengths in the unit that they say?"
        ]
    first, last = muscle.contraction_range
    found = []
    if first <= low / rest < 0.0 and bool(muscle.braid_taut(low / rest)):
        found.append(
            f"{label} is stretched by {units.said(own, 'm', -low, digits='.3g')} at a stop of "
            f"{joint}, where its braid is "
            "taut: the joint's rest_angle is the angle at which muscles have their rest length"
        )
    if highest is not None and high / rest <= last:
        grid = np.linspace(0.0, last, _ANGLES)
        free = float(grid[muscle.force_table(highest, grid) >= 0.0].max(initial=0.0))
        if free < high / rest:
            found.append(
                f"{label} is short for its joint: at a stop of {joint} it is shortened by "
                f"{100 * high / rest:.3g} %, and at {units.said('', 'Pa', highest)} it pulls up "
                "to "
                f"{100 * free:.3g} % only"
            )
    return found


def _unfed(model: Mapping[str, Any], ports: Ports) -> list[str]:
    """Caution where no line or valve feeds a chamber while a supply feeds nothing."""
    lines, valves = ports["line"].values(), ports["valve"].values()
    fed = {ends["to"] for ends in (*lines, *valves)}
    used = {ends["from"] for ends in (*lines, *valves)}
    used |= {ends["inlet"] for ends in ports["supply"].values() if ends}
    idle = [
        n for name in tables_of(model, "supply") if (n := qualified("supply", name)) not in used
    ]
    shut = [
        n for name in tables_of(model, "chamber") if (n := qualified("chamber", name)) not in fed
    ]
    if not idle or not shut:
        return []
    return [
        f"no air goes from {' or '.join(idle)} to {' or '.join(shut)}: what is between them is "
        'missing, a [valve], or a [line] of kind = "tube" or "orifice" behind a regulator'
    ]


def _frictionless(parameters: Mapping[str, Parameter], units: Units) -> list[str]:
    """Cautions about friction of exactly zero, which a diagnosis would replace by effects."""
    found = []
    for name, usual in _usual_friction(parameters).items():
        known = parameters[name]
        if known.value == known.tol == 0.0:
            unit = units.of(name, known.unit)
            size = f"{from_si(usual, unit, known.unit):.2g}" if usual else "..."
            found.append(
                f"{name} = 0 {unit}, exactly: no laboratory knows that, and a diagnosis "
                "would call it missing physics; write what is known of it, such as "
                f'{{ value = {size}, unit = "{unit}", tol = {size} }}'
            )
    return found


def _usual_friction(parameters: Mapping[str, Parameter]) -> dict[str, float]:
    """Friction of a good bearing by the name of its parameter: a hundredth of the weight, and as
    much more at 1 rad/s or 0.1 m/s; zero where no weight is known.
    """

    def value(name: str) -> float:
        known = parameters.get(name)
        return known.value if known is not None and known.known else 0.0

    found = {}
    for name in parameters:
        block, own_name, word = split_name(name)
        table = qualified(block, own_name)
        if block not in ("arm", "link", "load") or word not in ("viscous", "coulomb"):
            continue
        mass = value(f"{table}.mass")
        own = {"arm": value("arm.first_moment"), "load": mass}
        moment = own.get(block, mass * value(f"{table}.centre"))
        moment += value(f"{table}.payload") * value(f"{table}.length")
        per_speed = 10.0 if block == "load" and word == "viscous" else 1.0
        found[name] = 0.01 * per_speed * _GRAVITY * abs(moment)
    return found


def _exact(parameters: Mapping[str, Parameter], units: Units) -> list[str]:
    """Caution about measured values without a tolerance, which a diagnosis takes as exact."""
    if not any(known.tol for known in parameters.values()):
        return ["no value has a tolerance (tol): a diagnosis would take all of them as exact"]
    inexact = []
    for name, known in parameters.items():
        block, _, key = split_name(name)
        share = _MEASURED.get((block, key))
        if share and known.value and not known.tol:
            tol = units.said(name, known.unit, share * abs(known.value), digits=".2g")
            inexact.append(f"{name} (tol = {tol})")
    if not inexact:
        return []
    return [
        f"known exactly, as no laboratory knows it: {', '.join(inexact)} would be usual; what a "
        "diagnosis may not move it explains with effects"
    ]


def _shut(label: str, valve: Mapping[str, Any], units: Units) -> list[str]:
    """Caution about a valve that no command opens."""
    if valve["fraction"][-1] == 0.0:
        return [
            f"{label} never passes air: {label}.area_fraction.fraction = {valve['fraction']} "
            "opens nowhere"
        ]
    positions = {key: valve[key] for key in ("with_current", "without_current") if key in valve}
    ways = [way for position in positions.values() for way in _PATHS[position]]
    ways = list(dict.fromkeys(ways)) if positions else ["fill", "vent"]
    if any(valve.get(f"{way}_conductance", 1.0) > 0.0 for way in ways):
        return []
    said = [f"{label}.{key} = {position!r}" for key, position in positions.items()]
    closed = [f"{label}.{way}_conductance" for way in ways]
    said += [f"{name} = {units.said(name, 'm3/(s Pa)', 0.0)}" for name in closed]
    return [f"{label} never passes air: {', '.join(said)}"]


def _strut(label: str, muscle: Mapping[str, Any], units: Units) -> list[str]:
    """Caution about a muscle that pushes more than a solid rubber rod of its size could."""
    load, most = muscle["buckling_load"], _borne(muscle)
    if load <= most:
        return []
    name = f"{label}.buckling_load"
    return [
        f"{label} pushes without air, by up to {name} = {units.said(name, 'N', load)}: a solid rod "
        f"of rubber as thick and long bows out at {units.said(name, 'N', most, digits='.2g')}, a "
        "muscle before; 0 for one that goes slack"
    ]


def _borne(muscle: Mapping[str, Any]) -> float:
    """The push at which a rod of rubber as thick and long bows out, held at both ends [N]."""
    bent = math.pi / 64.0 * muscle["rest_diameter"] ** 4
    return float(4.0 * math.pi**2 * _STIFFEST * bent / muscle["rest_length"] ** 2)


def _slack(model: Mapping[str, Any], ports: Ports, text: str, units: Units) -> list[str]:
    """Cautions about muscles without ``buckling_load`` whose force model alone would push: they are
    slack without air, which older files do not expect.
    """
    given = tomllib.loads(text).get("muscle", {})
    found: list[str] = []
    if (model["load"] or {}).get("kind") == "frame":
        return found  # what is held lags nowhere
    for name, table in tables_of(model, "muscle").items():
        said = given.get(name, {}) if name else given
        if not said or "buckling_load" in said or table["buckling_load"] > 0.0:
            continue
        muscle, label = Muscle.from_model(table), qualified("muscle", name)
        last = min(_most_contracted(model, ports, name), muscle.contraction_range[1])
        push = -float(muscle.force_table(0.0, np.linspace(0.0, max(last, 0.0), _ANGLES)).min())
        if push > _borne(table):
            name = f"{label}.buckling_load"
            found.append(
                f"{label} is slack without air, since {name} is not given, and its force model "
                f"alone would push back by up to {units.said(name, 'N', push)}: a model that "
                "relies on that lags where the muscle is slack; buckling_load says what it bears "
                "without air (0 N: nothing)"
            )
    return found


def _most_contracted(model: Mapping[str, Any], ports: Ports, name: str) -> float:
    """The largest contraction ratio that a joint or load leaves a muscle; 0 where nothing moves."""
    rest = float(tables_of(model, "muscle")[name]["rest_length"])
    if model["load"]:
        return 1.0 - float(model["load"]["min_length"]) / rest
    kind, _, joint = ports["muscle"][name]["joint"].partition(".")
    if kind != "joint":
        return 0.0
    table = tables_of(model, "joint")[joint]
    way = Joint.from_model(tables_of(model, "transmission").get(name, table))
    angles = np.linspace(table["min_angle"], table["max_angle"], _ANGLES)
    there = angles[way.reaches(angles)]
    return float(way.shortening(there).max(initial=0.0)) / rest


def _late(label: str, valve: Mapping[str, Any], units: Units) -> list[str]:
    """Cautions about a pulsed valve whose delays are as long as a period of its carrier."""
    if not valve.get("carrier_frequency"):
        return []
    period = 1.0 / valve["carrier_frequency"]
    delays = {key: valve[key] for key in ("opening_delay", "closing_delay")}

    def said(seconds: float, key: str) -> str:
        return units.said(f"{label}.{key}", "s", seconds)

    late = f"the period of {label}.carrier_frequency ({said(period, 'opening_delay')}) or longer"
    follows = {
        "opening_delay": "no pulse moves it, only a duty of 1 does",
        "closing_delay": "no gap lets it return, only a duty of 0 does",
    }
    found = [
        f"{label}.{key} = {said(delay, key)} is {late}: {follows[key]}"
        for key, delay in delays.items()
        if delay >= period
    ]
    if found or sum(delays.values()) < period:
        return found
    return [
        f"{label}.opening_delay + {label}.closing_delay = "
        f"{said(sum(delays.values()), 'opening_delay')} is {late}: no duty makes it open and close "
        "in a period"
    ]
