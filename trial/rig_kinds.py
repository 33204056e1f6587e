"""The rigs of the second plan and of those after it, as the trial's plants hold them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from .pair.places import SIDES
from .pair.plant import PairPlant, pair_parameters
from .plant import Parameters, Plant
from .rigfile import HOME, read_rig, to_parameters

PAIR = "antagonistic_pair"
ARM = ("arm.inertia", "arm.first_moment", "arm.payload", "arm.viscous")
GAS = ("supply.volume", "valve.discharge_area_max", "chamber.dead_volume")


@dataclass(frozen=True)
class RigKind:
    """One rig: what can act in it (blocks of :class:`trial.effects.Effect`), which parameters can
    be far off, the range of the reference (deg, m of shortening, or a share of the largest
    pressure), the largest gauge pressure of the controller [Pa] and of the transducers [Pa], and
    the effects that it has no place for.
    """

    name: str
    blocks: tuple[str, ...]
    parameters: tuple[str, ...]
    low: float
    top: float
    most: float
    scale: float
    without: tuple[str, ...] = ()

    @property
    def path(self) -> Path:
        """Its nominal rig file."""
        return HOME / f"{self.name}.toml"


_AIR = ("supply", "valve", "line", "chamber")
_MOTION = ("muscle", "joint", "arm", "sensors")
#: effects that a hanging mass has no place for: they turn about a joint
_TURNING = (
    "joint_end_stop",
    "payload_swing",
    "base_flexibility",
    "hose_torque",
    "tendon_compliance",
    "moment_arm_error",
    "com_offset",
)
_MUSCLE = "muscle.modulus_scale"
#: what each side of a pair has, and their tank
_TWICE = (
    "supply.volume",
    *(
        f"{block}.{side}.{key}"
        for block, key in (n.split(".") for n in (*GAS[1:], _MUSCLE))
        for side in SIDES
    ),
)
RIGS: dict[str, RigKind] = {
    r.name: r
    for r in (
        RigKind("shoulder", (*_AIR, *_MOTION), (*GAS, _MUSCLE, *ARM), 15.5, 100.0, 7e5, 16e5),
        RigKind("elbow", (*_AIR, *_MOTION), (*GAS, _MUSCLE, *ARM), 12.5, 90.0, 6e5, 10e5),
        RigKind(
            "hanging_mass",
            (*_AIR, *_MOTION),
            (*GAS, _MUSCLE, "load.mass", "load.viscous"),
            0.0,
            0.05,
            5.5e5,
            10e5,
            _TURNING,
        ),
        RigKind(
            "regulated_joint",
            ("chamber", *_MOTION),
            ("line.discharge_area", "chamber.dead_volume", _MUSCLE, *ARM),
            12.5,
            90.0,
            6e5,
            10e5,
        ),
        RigKind(PAIR, (*_AIR, *_MOTION), (*_TWICE, *ARM), 10.0, 82.0, 5.5e5, 10e5),
        RigKind("chamber", _AIR, GAS, 0.0, 1.0, 5e5, 10e5),
        RigKind(
            "blow_down",
            ("chamber",),
            ("chamber.dead_volume", "line.discharge_area"),
            0.0,
            1.0,
            6e5,
            10e5,
        ),
    )
}


def parameters_of(model: dict[str, Any], rig: RigKind) -> Parameters:
    """Plant parameters of a nested SI model as :func:`trial.rigfile.read_rig` gives it."""
    if rig.name in ("shoulder", "elbow"):
        return to_parameters(model)
    full: dict[str, Any] = {k: dict(v) for k, v in model.items()}
    start = model["chamber"].get("initial_pressure", 0.0)
    full.setdefault("supply", {"volume": 1.0, "initial_pressure": start})
    full["supply"].setdefault("volume", 1.0)
    line = model.get("line", {}).get("discharge_area", 1.0)
    shape = {"opening": [0.0, 1.0], "fraction": [0.0, 1.0]}
    full.setdefault(
        "valve",
        {
            "discharge_area_max": line,
            "null_voltage": 0.0,
            "half_range": 1.0,
            "area_fraction": shape,
        },
    )
    full.setdefault("muscle", {"count": 0, "modulus_scale": 1.0, "end_ratio": {}})
    full.setdefault("joint", {})
    full.setdefault("arm", _arm(model))
    full["sensors"].setdefault("angle_zero", -full["sensors"].get("length_zero", 0.0))
    if rig.name == "hanging_mass":
        full["joint"] = _lift(model)
    kinds = {"hanging_mass": ("mass", "valve"), "regulated_joint": ("joint", "regulator")}
    kind, feed = kinds.get(rig.name, ("rigid", "vent" if rig.name == "blow_down" else "valve"))
    return to_parameters(
        full,
        kind=kind,
        feed=feed,
        time_constant=full["supply"].get("time_constant", 0.0),
        droop=full["supply"].get("droop", 0.0),
    )


def _arm(model: dict[str, Any]) -> dict[str, float]:
    """A hanging mass in the words of an arm; a load of nothing where there is none."""
    load = model.get("load", {})
    mass = load.get("mass", 1.0)
    return {
        "inertia": mass,
        "first_moment": mass,
        "length": 1.0,
        "payload": 0.0,
        "viscous": load.get("viscous", 0.0),
        "coulomb": load.get("coulomb", 0.0),
        "coulomb_speed": load.get("coulomb_speed", 1.0),
        "gravity": load.get("gravity", 9.80665),
    }


def _lift(model: dict[str, Any]) -> dict[str, Any]:
    """Range and stops of the shortening [m] of a muscle that lifts a mass."""
    load, rest = model["load"], model["muscle"]["rest_length"]
    return {
        "kind": "mass",
        "rest_angle": 0.0,
        "min_angle": rest - load["max_length"],
        "max_angle": rest - load["min_length"],
        "stop_stiffness": load["stop_stiffness"],
        "stop_damping": load["stop_damping"],
    }


@lru_cache(maxsize=8)
def stated(name: str) -> tuple[dict[str, Any], dict[str, float]]:
    """Nominal model of a rig, and its tolerances."""
    return read_rig(RIGS[name].path)


@lru_cache(maxsize=8)
def nominal(name: str) -> tuple[dict[str, Any], dict[str, float], Plant]:
    """Nominal model, tolerances and plant of a rig with one valve or none."""
    model, tolerance = stated(name)
    return model, tolerance, Plant(parameters_of(model, RIGS[name]))


@lru_cache(maxsize=1)
def nominal_pair() -> PairPlant:
    """Nominal plant of the pair."""
    return PairPlant(pair_parameters(stated(PAIR)[0]))
