"""Hypothesis strategies: valid muscles, perturbed shoulder rigs and command sequences."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

import numpy as np
from hypothesis import strategies as st

import pamrs
from tests.reference import GeometryReference, MuscleReference
from tests.tables import rows_of

MODELS = (
    *("gaylord", "chou_hannaford", "mooney_rivlin", "ferraresi", "kothera", "robinson"),
    "elbow_linear",
)
#: Models with a stress polynomial.
POLYNOMIAL = ("ferraresi", "kothera", "robinson")
GEOMETRIES = ("cylinder", "elliptic", "elliptic_published")


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


@st.composite
def model_arguments(draw: st.DrawFn, model: str, geometry: str | None = None) -> dict[str, Any]:
    """Keyword arguments of a muscle of one force model: its own constants, friction, no parameter
    of another model.
    """
    arguments = draw(muscle_arguments(geometry or draw(st.sampled_from(GEOMETRIES))))
    if model not in POLYNOMIAL:
        del arguments["modulus_slope"], arguments["modulus_offset"]
    if model == "mooney_rivlin":
        arguments |= {"c10": draw(st.floats(-1e5, 4e5)), "c01": draw(st.floats(-1e5, 4e5))}
    if model == "elbow_linear":
        factors = [draw(st.floats(0.0, 1.5)) for _ in range(3)]
        arguments |= {"bladder_modulus": draw(st.floats(0.0, 5e6)), "extension_factors": factors}
    friction = {
        "friction_coefficient": draw(st.floats(0.0, 0.3)),
        "friction_pressure_slope": draw(st.floats(-0.3e-6, 0.1e-6)),
        "friction_floor": draw(st.floats(0.0, 0.05)),
    }
    return {**arguments, **friction, "model": model}


def reference_of(arguments: dict[str, Any]) -> MuscleReference:
    """Build a muscle of the reference from the arguments of a muscle of pamrs; the geometry must be
    among them.
    """
    shape = {f.name: arguments[f.name] for f in fields(GeometryReference) if f.name in arguments}
    own = {
        f.name: arguments[f.name]
        for f in fields(MuscleReference)
        if f.name in arguments and f.name != "geometry"
    }
    return MuscleReference(GeometryReference(**shape, kind=arguments["geometry"]), **own)


def both(arguments: dict[str, Any]) -> tuple[pamrs.Muscle, MuscleReference]:
    """Build the same muscle in pamrs and in the reference."""
    return pamrs.Muscle(**arguments), reference_of(arguments)


def stroke(model: MuscleReference) -> np.ndarray:
    """Contraction ratios from far extension (where the braid is taut) almost to the shortest
    muscle.
    """
    low, high = model.geometry.min_contraction, model.geometry.max_contraction
    return np.array([0.9 * low, 0.35 * low, 0.04 * low, 0.0, 0.003, 0.07, 0.2, 0.95 * high])


def contractions(model: MuscleReference, n: int = 5) -> np.ndarray:
    """A few contraction ratios over the stroke that every valid muscle has, mostly in
    contraction.
    """
    low = 0.4 * model.geometry.min_contraction if model.geometry.kind == "elliptic" else 0.0
    high = min(0.3, 0.95 * model.geometry.max_contraction)
    return np.concatenate([[low, 0.0], np.linspace(0.02, high, n - 2)])


#: Spread of the rig parameters: name -> (lower, upper) factor on the nominal value.
FACTORS = rows_of(__file__, "factors")


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
