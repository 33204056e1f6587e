"""pamrs: simulate pneumatic artificial muscles and arms, and find the physics that a simulation leaves out.

Names are loaded when they are first used, so that importing the package costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from pamrs import fit, library, rigs, sizing
    from pamrs.batch import Batch, BatchRun
    from pamrs.case import Case, load_case
    from pamrs.diagnosis import diagnose
    from pamrs.diagnosis.plan import Plan, plan_diagnosis
    from pamrs.diagnosis.result import Diagnosis
    from pamrs.errors import (
        CaseError,
        DiagnosisError,
        FitError,
        PamrsError,
        ParameterError,
        RecordingError,
        RigError,
        SimulationError,
    )
    from pamrs.joint import Joint
    from pamrs.lifting import Lift, lift
    from pamrs.muscle import Muscle
    from pamrs.recording import Issue, Recording, load_recording
    from pamrs.rig import Parameter, Rig, load_rig
    from pamrs.simulation import Simulation, simulate
    from pamrs.simulator import Simulator

    __version__: str

__all__ = [
    "Batch",
    "BatchRun",
    "Case",
    "CaseError",
    "Diagnosis",
    "DiagnosisError",
    "FitError",
    "Issue",
    "Joint",
    "Lift",
    "Muscle",
    "PamrsError",
    "Parameter",
    "ParameterError",
    "Plan",
    "Recording",
    "RecordingError",
    "Rig",
    "RigError",
    "Simulation",
    "SimulationError",
    "Simulator",
    "__version__",
    "diagnose",
    "fit",
    "library",
    "lift",
    "load_case",
    "load_recording",
    "load_rig",
    "plan_diagnosis",
    "rigs",
    "simulate",
    "sizing",
]

_MODULES: Final = ("fit", "library", "rigs", "sizing")
_HOMES: Final[dict[str, str]] = {
    "Batch": "pamrs.batch",
    "BatchRun": "pamrs.batch",
    "Case": "pamrs.case",
    "CaseError": "pamrs.errors",
    "Diagnosis": "pamrs.diagnosis.result",
    "DiagnosisError": "pamrs.errors",
    "FitError": "pamrs.errors",
    "Issue": "pamrs.recording",
    "Joint": "pamrs.joint",
    "Lift": "pamrs.lifting",
    "Muscle": "pamrs.muscle",
    "PamrsError": "pamrs.errors",
    "Parameter": "pamrs.rig",
    "ParameterError": "pamrs.errors",
    "Plan": "pamrs.diagnosis.plan",
    "Recording": "pamrs.recording",
    "RecordingError": "pamrs.errors",
    "Rig": "pamrs.rig",
    "RigError": "pamrs.errors",
    "Simulation": "pamrs.simulation",
    "SimulationError": "pamrs.errors",
    "Simulator": "pamrs.simulator",
    "diagnose": "pamrs.diagnosis",
    "lift": "pamrs.lifting",
    "load_case": "pamrs.case",
    "load_recording": "pamrs.recording",
    "load_rig": "pamrs.rig",
    "plan_diagnosis": "pamrs.diagnosis.plan",
    "simulate": "pamrs.simulation",
}


def _version() -> str:
    from importlib import metadata

    try:
        return metadata.version("pamrs")
    except metadata.PackageNotFoundError:
        return "0+unknown"


def __getattr__(name: str) -> Any:
    if name == "__version__":
        value: Any = _version()
    elif name in _MODULES:
        value = importlib.import_module(f"pamrs.{name}")
    elif name in _HOMES:
        value = getattr(importlib.import_module(_HOMES[name]), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
