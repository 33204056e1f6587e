"""Nominal rig file and the true baseline drawn around it."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .plant import Parameters

HOME = Path(__file__).resolve().parent / "rigs"
_UNIT = {"bar": 1.0e5, "deg": math.pi / 180.0}


def default_rig() -> Path:
    """The nominal rig file: the package's shoulder, with muscles that push, as the plant's do."""
    return HOME / "shoulder.toml"


def _si(entry: Any) -> Any:
    """Value in SI of a TOML parameter table (or of a bare number)."""
    if not isinstance(entry, dict):
        return entry
    factor = _UNIT.get(entry.get("unit", ""), 1.0)
    value = entry["value"]
    return [factor * v for v in value] if isinstance(value, list) else factor * value


def _sections(raw: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Tables of a rig file; those of a block with a name, as ``[valve.flexor]``, by both."""
    found: dict[str, dict[str, Any]] = {}
    for section, table in raw.items():
        if not isinstance(table, dict):
            continue
        if table and all(isinstance(e, dict) and "value" not in e for e in table.values()):
            found.update({f"{section}.{name}": entry for name, entry in table.items()})
        else:
            found[section] = table
    return found


def split(name: str) -> tuple[str, str]:
    """Section and key of a dotted name; the section of a block with a name has a dot itself."""
    section, _, key = name.rpartition(".")
    return section, key


def value_of(model: dict[str, Any], name: str) -> Any:
    """A value of a nested model by its dotted name."""
    section, key = split(name)
    return model[section][key]


def read_rig(path: Path) -> tuple[dict[str, Any], dict[str, float]]:
    """Nominal model and tolerances of a rig file.

    Returns
    -------
    model : dict
        Nested sections with SI values, of blocks with a name by their dotted name.
    tolerance : dict
        Standard deviation in SI by dotted name, for parameters that have one.
    """
    with path.open("rb") as stream:
        raw = tomllib.load(stream)
    model: dict[str, Any] = {}
    tolerance: dict[str, float] = {}
    for section, table in _sections(raw).items():
        model[section] = {}
        for key, entry in table.items():
            if isinstance(entry, dict) and "value" not in entry:
                model[section][key] = entry
                continue
            model[section][key] = _si(entry)
            if isinstance(entry, dict) and "tol" in entry:
                tolerance[f"{section}.{key}"] = _UNIT.get(entry.get("unit", ""), 1.0) * float(
                    entry["tol"]
                )
    return model, tolerance


def to_parameters(model: dict[str, Any], **kind: Any) -> Parameters:
    """Plant parameters of a nested SI model as returned by :func:`read_rig`; `kind` gives those
    fields that say what rig it is.
    """
    gas, valve, arm, chamber = model["gas"], model["valve"], model["arm"], model["chamber"]
    muscle = {
        k: v
        for k, v in model["muscle"].items()
        if k not in ("model", "count", "modulus_scale", "buckling_load", "end_ratio")
    }
    muscle.update(model["muscle"]["end_ratio"])
    return Parameters(
        ambient=gas["ambient_pressure"],
        temperature=gas["temperature"],
        gas_constant=gas["gas_constant"],
        kappa=gas["heat_capacity_ratio"],
        supply_volume=model["supply"]["volume"],
        supply_pressure=model["supply"]["initial_pressure"],
        area_max=valve["discharge_area_max"],
        null_voltage=valve["null_voltage"],
        half_range=valve["half_range"],
        opening=tuple(valve["area_fraction"]["opening"]),
        fraction=tuple(valve["area_fraction"]["fraction"]),
        dead_volume=chamber["dead_volume"],
        alpha_in=chamber["alpha_in"],
        alpha_out=chamber["alpha_out"],
        alpha=chamber["alpha"],
        muscle=muscle,
        count=int(model["muscle"]["count"]),
        modulus_scale=model["muscle"]["modulus_scale"],
        joint={k: v for k, v in model["joint"].items() if k != "kind" or v in ("mass", "pulley")},
        inertia=arm["inertia"],
        first_moment=arm["first_moment"],
        length=arm["length"],
        payload=arm["payload"],
        viscous=arm["viscous"],
        coulomb=arm["coulomb"],
        coulomb_speed=arm["coulomb_speed"],
        gravity=arm["gravity"],
        pressure_zero=model["sensors"]["pressure_zero"],
        angle_zero=model["sensors"]["angle_zero"],
        **kind,
    )


def draw_parameters(
    kind: str,
    model: dict[str, Any],
    tolerance: dict[str, float],
    rng: np.random.Generator,
    wrong: Mapping[str, float] | None = None,
) -> tuple[dict[str, Any], dict[str, float]]:
    """Draw the true baseline.

    Every parameter lies within one tolerance (normal, truncated); `parameters` moves one or two of
    them by 1.5 to 2.5 tolerances instead. Those in `wrong` lie as many tolerances off as it says.

    Returns
    -------
    model : dict
        The true nested model.
    moved : dict
        Deviation in tolerances, by dotted name.
    """
    true = {k: dict(v) for k, v in model.items()}
    names = [k for k in tolerance if k != "supply.initial_pressure"]
    moved: dict[str, float] = {}
    for name in names:
        z = 2.0
        while abs(z) > 1.0:
            z = float(rng.standard_normal())
        moved[name] = z
    if kind == "parameters":
        loud = [
            k
            for k in names
            if not k.startswith("sensors.") and k not in ("supply.volume", "arm.coulomb")
        ]
        for name in rng.choice(loud, int(rng.integers(1, 3)), replace=False):
            moved[str(name)] = float(rng.choice([-1.0, 1.0]) * rng.uniform(1.5, 2.5))
    moved.update(wrong or {})
    for name, z in moved.items():
        section, key = split(name)
        true[section][key] = model[section][key] + z * tolerance[name]
    return true, moved
