"""What a rig file may say, and hardly means: valves that never act, chambers that no air reaches,
friction of nothing, values that are known exactly.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from pamrs.rig._ports import Ports
from pamrs.rig.schema import qualified, split_name, tables_of
from pamrs.units import with_unit

if TYPE_CHECKING:
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

_STIFFEST: Final = 5e6  # modulus of the stiffest rubber that bladders are made of [Pa]


def cautions_of(
    model: Mapping[str, Any], ports: Ports, parameters: Mapping[str, Parameter]
) -> list[str]:
    """What of a model is possible, and most likely a mistake.

    Parameters
    ----------
    model : mapping
        As :attr:`pamrs.Rig.model`.
    ports : mapping
        What its blocks are connected to.
    parameters : mapping of str to Parameter
        Its parameters by dotted name.

    Returns
    -------
    list of str
        One sentence each, with the block, the value and what follows from it.
    """
    found = _unfed(model, ports)
    for name, valve in tables_of(model, "valve").items():
        label = qualified("valve", name)
        found += _shut(label, valve)
        found += _late(label, valve)
    for name, muscle in tables_of(model, "muscle").items():
        found += _strut(qualified("muscle", name), muscle)
    return [*found, *_frictionless(parameters), *_exact(parameters)]


def _unfed(model: Mapping[str, Any], ports: Ports) -> list[str]:
    """Chambers that no air reaches, beside a tank or regulator that feeds nothing."""
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


def _frictionless(parameters: Mapping[str, Parameter]) -> list[str]:
    """Friction and damping that are nothing, exactly: effects with the same law would be named in
    their place.
    """
    found = []
    for name, usual in _usual_friction(parameters).items():
        known = parameters[name]
        if known.value == known.tol == 0.0:
            size = f"{usual:.2g}" if usual else "..."
            found.append(
                f"{name} = 0 {known.unit}, exactly: no laboratory knows that, and a diagnosis "
                "would call it missing physics; write what is known of it, such as "
                f'{{ value = {size}, unit = "{known.unit}", tol = {size} }}'
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


def _exact(parameters: Mapping[str, Parameter]) -> list[str]:
    """Measured values without a tolerance, where others have one."""
    if not any(known.tol for known in parameters.values()):
        return ["no value has a tolerance (tol): a diagnosis would take all of them as exact"]
    found = {}
    for name, known in parameters.items():
        block, _, key = split_name(name)
        share = _MEASURED.get((block, key))
        if share and known.value and not known.tol:
            found[name] = share * abs(known.value), known.unit
    if not found:
        return []
    told = [
        f"{name} (tol = {with_unit(f'{tol:.2g}', unit)})" for name, (tol, unit) in found.items()
    ]
    return [
        f"known exactly, as no laboratory knows it: {', '.join(told)} would be usual; what a "
        "diagnosis may not move it explains with effects"
    ]


def _shut(label: str, valve: Mapping[str, Any]) -> list[str]:
    """A valve that no command opens."""
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
    said += [f"{label}.{way}_conductance = 0 m3/(s Pa)" for way in ways]
    return [f"{label} never passes air: {', '.join(said)}"]


def _strut(label: str, muscle: Mapping[str, Any]) -> list[str]:
    """A muscle that pushes more than a rod of rubber as thick as it can bear, held at both ends."""
    load, length = muscle["buckling_load"], muscle["rest_length"]
    bent = math.pi / 64.0 * muscle["rest_diameter"] ** 4
    most = 4.0 * math.pi**2 * _STIFFEST * bent / length**2
    if load <= most:
        return []
    return [
        f"{label} pushes without air, by up to {label}.buckling_load = {load:.4g} N: a solid rod "
        f"of rubber as thick and long bows out at {most:.2g} N, a muscle before; 0 N for one that "
        "goes slack"
    ]


def _late(label: str, valve: Mapping[str, Any]) -> list[str]:
    """A pulsed valve whose delays are as long as a period of its carrier."""
    if not valve.get("carrier_frequency"):
        return []
    period = 1.0 / valve["carrier_frequency"]
    delays = {key: valve[key] for key in ("opening_delay", "closing_delay")}
    told = f"the period of {label}.carrier_frequency ({1e3 * period:.4g} ms) or longer"
    follows = {
        "opening_delay": "no pulse moves it, only a duty of 1 does",
        "closing_delay": "no gap lets it return, only a duty of 0 does",
    }
    found = [
        f"{label}.{key} = {1e3 * delay:.4g} ms is {told}: {follows[key]}"
        for key, delay in delays.items()
        if delay >= period
    ]
    if found or sum(delays.values()) < period:
        return found
    return [
        f"{label}.opening_delay + {label}.closing_delay = {1e3 * sum(delays.values()):.4g} ms is "
        f"{told}: no duty makes it open and close in a period"
    ]
