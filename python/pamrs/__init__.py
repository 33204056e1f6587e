"""pamrs: simulate pneumatic artificial muscles and arms, and find the physics that a simulation
leaves out.

Names are loaded when they are first used, so that importing the package costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from types import ModuleType

    from pamrs import (
        campaigns,
        channels,
        control,
        design,
        diagnosis,
        effects,
        errors,
        experiments,
        fit,
        library,
        recordings,
        report,
        rigs,
        simulation,
        sweeps,
        units,
    )
    from pamrs.campaigns import campaign
    from pamrs.design import sizing
    from pamrs.diagnosis import diagnose, missing_input
    from pamrs.diagnosis.next_experiment import Plan, plan_diagnosis
    from pamrs.diagnosis.result import Diagnosis, load_result
    from pamrs.diagnosis.settings import DiagnosisSettings
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
    from pamrs.findings import MissingInput
    from pamrs.recordings import Case, Issue, Recording, load_case, load_recording
    from pamrs.rig import Joint, Muscle, Parameter, Rig, load_rig
    from pamrs.simulation import (
        Batch,
        BatchRun,
        Simulation,
        Simulator,
        simulate,
        simulate_batch,
    )
    from pamrs.sweeps import sweep

    __version__: str

__all__ = [
    "Batch",
    "BatchRun",
    "Case",
    "CaseError",
    "Diagnosis",
    "DiagnosisError",
    "DiagnosisSettings",
    "FitError",
    "Issue",
    "Joint",
    "MissingInput",
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
    "campaign",
    "campaigns",
    "channels",
    "control",
    "design",
    "diagnose",
    "diagnosis",
    "effects",
    "errors",
    "experiments",
    "fit",
    "library",
    "load_case",
    "load_recording",
    "load_result",
    "load_rig",
    "missing_input",
    "plan_diagnosis",
    "recordings",
    "report",
    "rigs",
    "simulate",
    "simulate_batch",
    "simulation",
    "sizing",
    "sweep",
    "sweeps",
    "units",
]

_NAMES: Final = {
    "campaigns": ("campaign",),
    "design": ("sizing",),
    "diagnosis": ("diagnose", "missing_input"),
    "diagnosis.next_experiment": ("Plan", "plan_diagnosis"),
    "diagnosis.result": ("Diagnosis", "load_result"),
    "diagnosis.settings": ("DiagnosisSettings",),
    "findings": ("MissingInput",),
    "errors": tuple(name for name in __all__ if name.endswith("Error")),
    "recordings": ("Case", "Issue", "Recording", "load_case", "load_recording"),
    "rig": ("Joint", "Muscle", "Parameter", "Rig", "load_rig"),
    "simulation": ("Batch", "BatchRun", "Simulation", "Simulator", "simulate", "simulate_batch"),
    "sweeps": ("sweep",),
}
_HOMES: Final = {name: f"pamrs.{home}" for home, names in _NAMES.items() for name in names}


def _version() -> str:
    from importlib import metadata

    try:
        return metadata.version("pamrs")
    except metadata.PackageNotFoundError:
        return "0+unknown"


def _compiled() -> ModuleType:
    """The compiled core: the one for processors since 2013 where a wheel has it and this processor
    runs it.
    """
    import os
    import sys
    from importlib import util

    core = importlib.import_module("pamrs._core")
    folder, name = os.path.split(str(core.__file__))
    second = os.path.join(folder, name.replace("_core", "_core_v3", 1))
    if not (os.path.exists(second) and core.x86_64_v3()):
        return core
    spec = util.spec_from_file_location("pamrs._core", second)
    assert spec is not None
    assert spec.loader is not None
    faster = util.module_from_spec(spec)
    spec.loader.exec_module(faster)
    sys.modules["pamrs._core"] = faster
    return faster


def __getattr__(name: str) -> Any:
    if name == "__version__":
        value: Any = _version()
    elif name == "_core":
        value = _compiled()
    elif name in _HOMES:
        value = getattr(importlib.import_module(_HOMES[name]), name)
    elif name in __all__:
        value = importlib.import_module(f"pamrs.{name}")
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
