"""Fit quasi-static muscle models to measured forces, and predict untested pressures (dissertation 2.2.6 and 2.3).

Names are loaded when they are first used, so that importing the package costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

from pamrs.errors import FitError

if TYPE_CHECKING:
    from pamrs.fit.bench import from_recording
    from pamrs.fit.compare import ModelComparison, compare_models
    from pamrs.fit.cylinder.friction import CylinderFriction, fit_cylinder_friction
    from pamrs.fit.data import ForceMap
    from pamrs.fit.description import MeasuredMuscle, load_measured_muscle
    from pamrs.fit.engine import fit_muscle
    from pamrs.fit.files import load_force_map
    from pamrs.fit.friction import FrictionFit, fit_friction
    from pamrs.fit.result import FitParameter, MuscleFit
    from pamrs.fit.validation import CrossValidation, PressureErrors

__all__ = [
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
    "from_recording",
    "load_force_map",
    "load_measured_muscle",
]

_HOMES: Final[dict[str, str]] = {
    "CrossValidation": "validation",
    "CylinderFriction": "cylinder.friction",
    "FitParameter": "result",
    "ForceMap": "data",
    "FrictionFit": "friction",
    "MeasuredMuscle": "description",
    "ModelComparison": "compare",
    "MuscleFit": "result",
    "PressureErrors": "validation",
    "compare_models": "compare",
    "fit_cylinder_friction": "cylinder.friction",
    "fit_friction": "friction",
    "fit_muscle": "engine",
    "from_recording": "bench",
    "load_force_map": "files",
    "load_measured_muscle": "description",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"pamrs.fit.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
