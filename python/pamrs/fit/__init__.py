"""Fit quasi-static muscle models to measured forces, and predict untested pressures (dissertation 2.2.6 and 2.3).

Names are loaded when they are first used, so that importing the package costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

from pamrs.errors import FitError

if TYPE_CHECKING:
    from pamrs.fit._bench import from_recording
    from pamrs.fit._compare import ModelComparison, compare_models
    from pamrs.fit._data import ForceMap
    from pamrs.fit._description import MeasuredMuscle, load_measured_muscle
    from pamrs.fit._engine import COEFFICIENTS, fit_muscle
    from pamrs.fit._export import friction_words
    from pamrs.fit._files import load_force_map
    from pamrs.fit._friction import FrictionFit, fit_friction
    from pamrs.fit._result import FitParameter, MuscleFit
    from pamrs.fit._validation import CrossValidation, PressureErrors
    from pamrs.fit.cylinder.friction import CylinderFriction, fit_cylinder_friction

__all__ = [
    "COEFFICIENTS",
    "CrossValidation",
    "CylinderFriction",
    "FitError",
    "FitParameter",
    "ForceMap",
    "FrictionFit",
    "MeasuredMuscle",
    "ModelComparison",
    "MuscleFit",
    "PressureErrors",
    "compare_models",
    "fit_cylinder_friction",
    "fit_friction",
    "fit_muscle",
    "friction_words",
    "from_recording",
    "load_force_map",
    "load_measured_muscle",
]

_HOMES: Final[dict[str, str]] = {
    "COEFFICIENTS": "_engine",
    "CrossValidation": "_validation",
    "CylinderFriction": "cylinder.friction",
    "FitParameter": "_result",
    "ForceMap": "_data",
    "FrictionFit": "_friction",
    "MeasuredMuscle": "_description",
    "ModelComparison": "_compare",
    "MuscleFit": "_result",
    "PressureErrors": "_validation",
    "compare_models": "_compare",
    "fit_cylinder_friction": "cylinder.friction",
    "fit_friction": "_friction",
    "fit_muscle": "_engine",
    "friction_words": "_export",
    "from_recording": "_bench",
    "load_force_map": "_files",
    "load_measured_muscle": "_description",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"pamrs.fit.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
