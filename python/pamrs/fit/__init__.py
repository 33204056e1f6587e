"""Fit quasi-static muscle models to measured forces, and predict untested pressures (dissertation
2.2.6 and 2.3).

Names are loaded when they are first used, so that importing the package costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

from pamrs.errors import FitError

if TYPE_CHECKING:
    from pamrs.fit._compare import ModelComparison, compare_models
    from pamrs.fit._data import ForceMap
    from pamrs.fit._files import from_recording
    from pamrs.fit._friction import FrictionFit, fit_friction
    from pamrs.fit._load import MeasuredMuscle, load_force_map, load_measured_muscle
    from pamrs.fit._map import MapFit, fit_map
    from pamrs.fit._result import MuscleFit
    from pamrs.fit._solution import COEFFICIENTS, GEOMETRY, fit_muscle
    from pamrs.fit._statistics import FitParameter
    from pamrs.fit._validation import CrossValidation, PressureErrors

__all__ = [
    "COEFFICIENTS",
    "GEOMETRY",
    "CrossValidation",
    "FitError",
    "FitParameter",
    "ForceMap",
    "FrictionFit",
    "MapFit",
    "MeasuredMuscle",
    "ModelComparison",
    "MuscleFit",
    "PressureErrors",
    "compare_models",
    "fit_friction",
    "fit_map",
    "fit_muscle",
    "from_recording",
    "load_force_map",
    "load_measured_muscle",
]

_NAMES: Final = {
    "_compare": ("ModelComparison", "compare_models"),
    "_data": ("ForceMap",),
    "_files": ("from_recording",),
    "_friction": ("FrictionFit", "fit_friction"),
    "_load": ("MeasuredMuscle", "load_force_map", "load_measured_muscle"),
    "_map": ("MapFit", "fit_map"),
    "_result": ("MuscleFit",),
    "_solution": ("COEFFICIENTS", "GEOMETRY", "fit_muscle"),
    "_statistics": ("FitParameter",),
    "_validation": ("CrossValidation", "PressureErrors"),
}
_HOMES: Final = {name: home for home, names in _NAMES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"pamrs.fit.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
