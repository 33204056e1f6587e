"""The names of the force models and geometries, and which elastic parameters each model has."""

from __future__ import annotations

from typing import Final

from pamrs.rig.schema import BLOCKS

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

_KEYS: Final = {key.name: key for key in BLOCKS["muscle"]}
#: Names of all models, in the order of the physics reference.
ALL_MODELS: Final = _KEYS["model"].choices
#: Names of the force models with elastic parameters, which can be fitted.
MODELS: Final = tuple(model for model in ALL_MODELS if model != "map")
#: model -> the parameters that it has and others with elastic parameters have not.
PARAMETERS: Final[dict[str, tuple[str, ...]]] = {
    model: tuple(
        name for name, key in _KEYS.items() if model in key.only and not {*MODELS} <= {*key.only}
    )
    for model in ALL_MODELS
}
#: The same of the models with elastic parameters.
ELASTIC_PARAMETERS: Final = {model: PARAMETERS[model] for model in MODELS}
#: What a muscle that is known by its measured forces alone has.
MAP_PARAMETERS: Final = PARAMETERS["map"]
#: Names of the outer profiles.
GEOMETRIES: Final = _KEYS["geometry"].choices


def models_with(parameter: str) -> tuple[str, ...]:
    """The models that have a parameter."""
    return tuple(model for model, names in PARAMETERS.items() if parameter in names)


#: Models whose elasticity is a polynomial stress with moduli linear in pressure.
POLYNOMIAL_MODELS: Final = models_with("modulus_slope")


def own_geometry(model: str) -> str:
    """The geometry that a force model's source has, taken where none is given."""
    return "elliptic" if model == "robinson" else "cylinder"
