"""The names of the force models and geometries, and which elastic parameters each model has."""

from __future__ import annotations

from typing import Final

__all__ = [
    "ALL_MODELS",
    "ELASTIC_PARAMETERS",
    "GEOMETRIES",
    "MAP_PARAMETERS",
    "MODELS",
    "PARAMETERS",
    "POLYNOMIAL_MODELS",
    "models_with",
    "own_geometry",
]

_POLYNOMIAL: Final = ("modulus_slope", "modulus_offset")
#: model -> the elastic parameters that it has, in the order of the physics reference.
ELASTIC_PARAMETERS: Final[dict[str, tuple[str, ...]]] = {
    "gaylord": (),
    "chou_hannaford": (),
    "mooney_rivlin": ("c10", "c01"),
    "ferraresi": _POLYNOMIAL,
    "kothera": _POLYNOMIAL,
    "robinson": _POLYNOMIAL,
    "elbow_linear": ("bladder_modulus", "extension_factors"),
}
#: What a muscle that is known by its measured forces alone has.
MAP_PARAMETERS: Final = ("map_pressure", "map_contraction", "map_force")
#: The same of every model, the map included.
PARAMETERS: Final[dict[str, tuple[str, ...]]] = {**ELASTIC_PARAMETERS, "map": MAP_PARAMETERS}
#: Names of the force models with elastic parameters, which can be fitted.
MODELS: Final = tuple(ELASTIC_PARAMETERS)
#: Names of all models.
ALL_MODELS: Final = tuple(PARAMETERS)
#: Names of the outer profiles.
GEOMETRIES: Final = ("cylinder", "elliptic", "elliptic_published")


def models_with(parameter: str) -> tuple[str, ...]:
    """The models that have a parameter."""
    return tuple(model for model, names in PARAMETERS.items() if parameter in names)


#: Models whose elasticity is a polynomial stress with moduli linear in pressure.
POLYNOMIAL_MODELS: Final = models_with("modulus_slope")


def own_geometry(model: str) -> str:
    """The geometry that a force model's source has, taken where none is given."""
    return "elliptic" if model == "robinson" else "cylinder"
