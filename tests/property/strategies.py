"""Hypothesis strategies: valid muscles, perturbed shoulder rigs and command sequences."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from hypothesis import strategies as st

import pamrs
from tests.reference import GeometryReference, MuscleReference


@st.composite
def muscle_arguments(draw: st.DrawFn, geometry: str | None = None) -> dict[str, Any]:
    """Keyword arguments of a buildable `pamrs.Muscle`."""
    length = draw(st.floats(0.1, 0.6))
    diameter = length * draw(st.floats(0.04, 0.1))
    order = draw(st.integers(1, 4))
    scales = (1.0, 0.3, 0.05, 0.01)
    return {
        "rest_length": length,
        "rest_diameter": diameter,
        "braid_angle": math.radians(draw(st.floats(66.0, 79.0))),
        "wall_thickness": 0.5 * diameter * draw(st.floats(0.03, 0.3)),
        "modulus_slope": [s * draw(st.floats(-3.0, 3.0)) for s in scales[:order]],
        "modulus_offset": [1e6 * s * draw(st.floats(-1.0, 2.0)) for s in scales[:order]],
        "modulus_scale": draw(st.floats(0.7, 1.4)),
        "geometry": geometry or draw(st.sampled_from(["elliptic", "cylinder"])),
        "count": draw(st.integers(1, 8)),
    }


def both(arguments: dict[str, Any]) -> tuple[pamrs.Muscle, MuscleReference]:
    """Build the same muscle in pamrs and in the reference."""
    shape = GeometryReference(
        arguments["rest_length"],
        arguments["rest_diameter"],
        arguments["braid_angle"],
        arguments["wall_thickness"],
        arguments["geometry"],
    )
    model = MuscleReference(
        shape,
        arguments["modulus_slope"],
        arguments["modulus_offset"],
        arguments["modulus_scale"],
        arguments["count"],
    )
    return pamrs.Muscle(**arguments), model


def contractions(model: MuscleReference, n: int = 5) -> np.ndarray:
    """A few contraction ratios over the stroke that every valid muscle has, mostly in contraction."""
    low = 0.4 * model.geometry.min_contraction if model.geometry.kind == "elliptic" else 0.0
    high = min(0.3, 0.95 * model.geometry.max_contraction)
    return np.concatenate([[low, 0.0], np.linspace(0.02, high, n - 2)])


#: Spread of the rig parameters: name -> (lower, upper) factor on the nominal value.
FACTORS = {
    "supply.volume": (0.7, 1.4),
    "valve.discharge_area_max": (0.6, 1.5),
    "chamber.dead_volume": (0.6, 2.0),
    "chamber.alpha_in": (0.8, 1.0),
    "chamber.alpha_out": (1.0, 1.3),
    "chamber.alpha": (0.85, 1.15),
    "muscle.modulus_scale": (0.8, 1.2),
    "muscle.wall_thickness": (0.8, 1.1),
    "muscle.rest_length": (0.97, 1.05),
    "joint.upper_offset": (0.95, 1.05),
    "joint.lower_axial": (0.95, 1.05),
    "arm.inertia": (0.7, 1.5),
    "arm.first_moment": (0.7, 1.3),
    "arm.payload": (0.6, 1.8),
    "arm.viscous": (0.5, 2.0),
    "arm.coulomb": (0.0, 1.5),
}


@st.composite
def rig_overrides(draw: st.DrawFn) -> dict[str, float]:
    """Perturbed scalars of the shoulder rig, by dotted name."""
    nominal = pamrs.rigs.shoulder().parameters
    names = draw(st.lists(st.sampled_from(sorted(FACTORS)), min_size=1, max_size=6, unique=True))
    return {name: nominal[name].value * draw(st.floats(*FACTORS[name])) for name in names}


@st.composite
def commands(draw: st.DrawFn, rows: int) -> list[float]:
    """Piecewise constant command about the valve null, one value per row."""
    levels = draw(st.lists(st.floats(3.6, 6.6), min_size=2, max_size=4))
    return [levels[k * len(levels) // rows] for k in range(rows)]
