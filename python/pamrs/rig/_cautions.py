"""What a rig file may say, and hardly means: valves that never act, muscles that push."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

from pamrs.rig.schema import qualified, tables_of

_PATHS = {"fill": ("fill",), "vent": ("vent",), "closed": (), "either": ("fill", "vent")}
"""Paths that are open in each position of a spool that switches."""

_STIFFEST: Final = 5e6  # modulus of the stiffest rubber that bladders are made of [Pa]


def cautions_of(model: Mapping[str, Any]) -> list[str]:
    """What of a model is possible, and most likely a mistake.

    Parameters
    ----------
    model : mapping
        As :attr:`pamrs.Rig.model`.

    Returns
    -------
    list of str
        One sentence each, with the block, the value and what follows from it.
    """
    found: list[str] = []
    for name, valve in tables_of(model, "valve").items():
        label = qualified("valve", name)
        found += _shut(label, valve)
        found += _late(label, valve)
    for name, muscle in tables_of(model, "muscle").items():
        found += _strut(qualified("muscle", name), muscle)
    return found


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
