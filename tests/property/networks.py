"""Hypothesis strategies: small rigs of several blocks as tables in SI units, and runs that drive
them.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from hypothesis import strategies as st

import pamrs
from pamrs.rig import parse_rig
from pamrs.rig.schema import BLOCKS
from tests.runs import Run

#: Tables by the full name of their block: keys, SI values, ports.
Blocks = dict[str, dict[str, Any]]

SAMPLE_TIME = 0.005


def rig_of(blocks: Mapping[str, Mapping[str, Any]]) -> pamrs.Rig:
    """The rig of some tables, read from TOML in which they stand in their order."""
    lines = ['schema = "pamrs.rig/1"', 'name = "network"']
    for label, table in blocks.items():
        keys = {key.name: key for key in BLOCKS[label.partition(".")[0]]}
        lines.append(f"[{label}]")
        for word, value in table.items():
            key = keys.get(word)  # None for a port
            if key is None or key.kind in ("choice", "count") or key.path:
                lines.append(f"{'.'.join(key.where) if key else word} = {json.dumps(value)}")
            else:
                lines.append(
                    f"{word} = {{ value = {json.dumps(value)}, unit = {json.dumps(key.unit)} }}"
                )
    return parse_rig("\n".join(lines) + "\n")


GAS = {"ambient_pressure": 101325.0, "temperature": 293.15}

#: A cylinder of (2.16), whose table is made at once.
MUSCLE = {
    "model": "kothera",
    "rest_length": 0.2,
    "rest_diameter": 0.02,
    "braid_angle": 1.25,
    "wall_thickness": 1.5e-3,
    "modulus_slope": [2.0, -0.3],
    "modulus_offset": [8e5, -1e5],
}

TENDON = {
    "kind": "tendon",
    "upper_axial": 0.04,
    "upper_offset": 0.011,
    "lower_axial": 0.04,
    "lower_offset": 0.011,
}

#: Stops of a joint (rad): between them a muscle shortens by 2 to 4 cm.
LOW, HIGH = 0.2, 1.7


def valve(area: float, **ports: str) -> dict[str, Any]:
    """A valve with a dead band of nothing and a bent area table."""
    shape = {"opening": [0.0, 0.25, 0.5, 0.75, 1.0], "fraction": [0.0, 0.2, 0.5, 0.8, 1.0]}
    return {**ports, "discharge_area_max": area, "null_voltage": 5.0, "half_range": 5.0, **shape}


@st.composite
def transmissions(draw: st.DrawFn, side: float = 1.0) -> dict[str, Any]:
    """How a muscle pulls on a joint between LOW and HIGH; the other side only by pulley or
    polynomial.
    """
    kind = draw(st.sampled_from(["pulley", "polynomial", *(["tendon"] if side > 0.0 else [])]))
    rest = LOW if side > 0.0 else HIGH
    if kind == "tendon":
        return {**TENDON, "rest_angle": rest}
    radius = side * draw(st.floats(0.014, 0.019))
    if kind == "pulley":
        return {"kind": "pulley", "radius": radius, "rest_angle": rest}
    bends = [draw(st.floats(-1.0, 1.0)) * size for size in (1.5e-3, 3e-4)]
    return {"kind": "polynomial", "coefficients": [radius, *bends], "rest_angle": rest}


@st.composite
def gas_laws(draw: st.DrawFn) -> dict[str, Any]:
    """Coefficients of a chamber, or an energy balance with some wall."""
    if draw(st.booleans()):
        wall = draw(st.sampled_from([0.0, 30.0, 400.0]))
        return {"gas": "energy_balance", "heat_transfer_coefficient": wall}
    return {key: draw(st.floats(1.0, 1.4)) for key in ("alpha_in", "alpha_out", "alpha")}


@st.composite
def sources(draw: st.DrawFn) -> tuple[Blocks, str]:
    """A supply of any kind, with or without a manifold behind it; the port that valves are to be
    fed from.
    """
    kind = draw(st.sampled_from(["tank", "constant", "regulator"]))
    own = {
        "tank": {"volume": draw(st.floats(2e-3, 1e-2))},
        "constant": {},
        "regulator": {
            "time_constant": draw(st.floats(0.03, 0.2)),
            "droop": draw(st.floats(0.0, 4e6)),
            "dead_time": draw(st.sampled_from([0.0, 0.013])),
            "rise_limit": draw(st.sampled_from([2e6, 1e12])),
            "fall_limit": draw(st.sampled_from([3e6, 1e12])),
        },
    }[kind]
    pressure = draw(st.floats(6e5, 8e5))
    blocks: Blocks = {"supply": {"kind": kind, "initial_pressure": pressure, **own}}
    if not draw(st.booleans()):
        return blocks, "supply"
    way = draw(st.sampled_from(["tube", "orifice"]))
    shape = {
        "tube": {"length": draw(st.floats(0.5, 2.0)), "diameter": 6e-3},
        "orifice": {"discharge_area": 4e-6},
    }[way]
    blocks["line.main"] = {"kind": way, "from": "supply", "to": "chamber.manifold", **shape}
    blocks["chamber.manifold"] = {
        "dead_volume": draw(st.floats(2e-4, 5e-4)),
        "initial_pressure": pressure - 5e4,
        **draw(gas_laws()),
    }
    return blocks, "chamber.manifold"


@st.composite
def pulls(draw: st.DrawFn, name: str, joint: str, feed: str, friction: bool) -> Blocks:
    """A muscle with its chamber and valve, and a tube between the two or not."""
    law = draw(gas_laws())
    blocks: Blocks = {
        f"valve.{name}": valve(draw(st.floats(0.5e-6, 3e-6)), **{"from": feed}),
        f"chamber.{name}": {
            "dead_volume": draw(st.floats(2e-5, 1e-4)),
            "initial_pressure": draw(st.floats(1.5e5, 3e5)),
            **law,
        },
        f"muscle.{name}": {"joint": joint, **MUSCLE, "count": draw(st.integers(1, 2))},
    }
    if draw(st.booleans()):
        blocks[f"muscle.{name}"] |= {
            "softening": draw(st.floats(-5e-3, 5e-3)),
            "temperature": draw(st.floats(270.0, 330.0)),
        }
    if friction:
        blocks[f"muscle.{name}"] |= {"friction_coefficient": 0.1, "friction_presliding": 5e-4}
    if draw(st.booleans()):
        tube = {
            "length": draw(st.floats(0.3, 1.5)),
            "diameter": 4e-3,
            "inlet_volume": draw(st.floats(0.0, 5e-6)),
        }
        blocks[f"line.{name}"] = {"kind": "tube", "to": f"chamber.{name}", **tube}
    return blocks


def joint(**changes: Any) -> dict[str, Any]:
    """A joint whose muscles have transmissions of their own."""
    stops = {"min_angle": LOW, "max_angle": HIGH, "stop_stiffness": 5e3, "stop_damping": 20.0}
    return {"kind": "free", "rest_angle": 0.8, **stops, **changes}


@st.composite
def springs(draw: st.DrawFn) -> dict[str, Any]:
    """A spring across a joint, or none."""
    if draw(st.booleans()):
        return {}
    return {"stiffness": draw(st.floats(0.5, 20.0)), "spring_angle": draw(st.floats(-0.5, 2.5))}


@st.composite
def mountings(draw: st.DrawFn, *names: str) -> dict[str, Any]:
    """Angles at which an arm is mounted, or straight down."""
    tilted = draw(st.booleans())
    return {name: draw(st.floats(-3.0, 3.0)) for name in names} if tilted else {}


@st.composite
def links(draw: st.DrawFn, on: str, rubbing: float) -> dict[str, Any]:
    """A link of a planar arm; `rubbing` multiplies its friction."""
    length = draw(st.floats(0.15, 0.35))
    return {
        "on": on,
        "length": length,
        "mass": draw(st.floats(0.5, 1.5)),
        "centre": length * draw(st.floats(0.3, 0.7)),
        "inertia": draw(st.floats(5e-3, 2e-2)),
        "payload": draw(st.floats(0.5, 2.0)),
        "viscous": rubbing * draw(st.floats(0.1, 0.5)),
        "coulomb": rubbing * draw(st.floats(0.0, 0.1)),
        "coulomb_speed": 0.1,
    }


@st.composite
def bodies(
    draw: st.DrawFn, feed: str, kinds: tuple[str, ...], rubbing: float, friction: bool
) -> Blocks:
    """What muscles move, and the muscles."""
    kind = draw(st.sampled_from(kinds))
    blocks: Blocks = {}
    if kind == "hanging":
        blocks |= draw(pulls("lift", "load", feed, friction))
        mass = {
            "mass": draw(st.floats(30.0, 60.0)),
            "viscous": rubbing * draw(st.floats(50.0, 300.0)),
        }
        blocks["load"] = {"kind": "mass", **mass, "min_length": 0.15, "max_length": 0.203}
    elif kind == "antagonists":
        for name, side in (("flexor", 1.0), ("extensor", -1.0)):
            blocks |= draw(pulls(name, "joint.elbow", feed, friction))
            blocks[f"transmission.{name}"] = draw(transmissions(side))
        blocks["joint.elbow"] = joint(**draw(springs()))
        arm = {
            "inertia": draw(st.floats(0.02, 0.08)),
            "first_moment": draw(st.floats(0.0, 0.2)),
            "length": 0.3,
        }
        arm |= {
            "payload": draw(st.floats(0.0, 1.0)),
            "viscous": rubbing * draw(st.floats(0.1, 0.5)),
        }
        blocks["arm"] = {
            **arm,
            **draw(mountings("base_angle", "centre_angle")),
            "coulomb": rubbing * draw(st.floats(0.0, 0.1)),
            "coulomb_speed": 0.1,
        }
    else:
        for name, on in (("elbow", "base"), ("wrist", "link.elbow")):
            blocks |= draw(pulls(name, f"joint.{name}", feed, friction))
            blocks[f"transmission.{name}"] = draw(transmissions())
            hinge = joint(**draw(springs()))
            blocks |= {f"joint.{name}": hinge, f"link.{name}": draw(links(on, rubbing))}
        blocks["arm"] = {"kind": "planar", **draw(mountings("base_angle"))}
    return blocks


@st.composite
def commands(draw: st.DrawFn, blocks: Blocks, rows: int) -> dict[str, np.ndarray]:
    """A sine about the null for every valve; the set pressure of a regulator rises."""
    time = SAMPLE_TIME * np.arange(rows)
    found = {}
    for label in blocks:
        kind, _, name = label.partition(".")
        if kind == "valve":
            swing, frequency, phase = (
                draw(st.floats(0.3, 2.0)),
                draw(st.floats(1.0, 4.0)),
                draw(st.floats(0.0, math.tau)),
            )
            found[f"valve_command.{name}"] = 5.0 + swing * np.sin(
                math.tau * frequency * time + phase
            )
    if blocks["supply"]["kind"] == "regulator":
        found["supply_command"] = (
            blocks["supply"]["initial_pressure"] + draw(st.floats(0.0, 5e5)) * time
        )
    return found


@st.composite
def starts(draw: st.DrawFn, blocks: Blocks) -> dict[str, float]:
    """Where the joints or the load begin, between the stops."""
    found = {}
    for label in blocks:
        kind, _, name = label.partition(".")
        if kind == "joint":
            found |= {
                f"joint_angle.{name}": draw(st.floats(0.6, 1.1)),
                f"joint_rate.{name}": draw(st.floats(-0.5, 0.5)),
            }
        elif kind == "load":
            found |= {
                "length": draw(st.floats(0.175, 0.19)),
                "length_rate": draw(st.floats(-0.05, 0.05)),
            }
    return found


@st.composite
def networks(
    draw: st.DrawFn,
    kinds: tuple[str, ...] = ("antagonists", "two_joints", "hanging"),
    rows: int = 21,
    rubbing: float = 1.0,
    friction: bool = False,
) -> tuple[Blocks, Run]:
    """A small rig as tables, and a run of it that fills, vents and moves.

    `rubbing` multiplies the friction of what is moved; `friction` gives the muscles one that
    depends on their direction.
    """
    blocks, feed = draw(sources())
    blocks = {"gas": dict(GAS), **blocks, **draw(bodies(feed, kinds, rubbing, friction))}
    if draw(st.booleans()):
        chamber = next(
            label
            for label in blocks
            if label.startswith("chamber.") and label != "chamber.manifold"
        )
        blocks["line.leak"] = {
            "kind": "orifice",
            "from": chamber,
            "to": "ambient",
            "discharge_area": draw(st.floats(1e-9, 2e-8)),
        }
    run = Run(rig_of(blocks), SAMPLE_TIME, rows, draw(starts(blocks)), draw(commands(blocks, rows)))
    return blocks, run
