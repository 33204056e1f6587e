"""Controllers of the joint angle, sampled, for one arm or a batch of them; trajectories, metrics,
tuning and stability.

Names are loaded when they are first used; what needs an extra says so then.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

from pamrs.control._adaptive import AdaptiveSliding
from pamrs.control._air import AirModel, ConductanceInverse, OrificeInverse
from pamrs.control._cascade import Cascade, PressureLoop, cascaded_pid
from pamrs.control._feedforward import Feedforward, FeedforwardPressure, Parallel
from pamrs.control._fuzzy import FUZZY_SETS, Fuzzy, fuzzy_rules, fuzzy_surface
from pamrs.control._hysteresis import (
    DeadZoneCompensation,
    HysteresisCompensation,
    HystereticTorque,
    SlipMemory,
)
from pamrs.control._joint_sensor import JointSensor
from pamrs.control._load import ByLength, LoadModel
from pamrs.control._model import ArmModel, JointModel
from pamrs.control._neural import NETWORKS, Neural
from pamrs.control._parts import ANTI_WINDUP, FilteredDerivative, Integrator, LowPass
from pamrs.control._pid import PID, PIDLaw
from pamrs.control._planar import JointTorques, PlanarArmModel
from pamrs.control._protocol import Controller, Measurement, Reference, Value
from pamrs.control._recruiting import Recruitment
from pamrs.control._rig_controller import RigController
from pamrs.control._rig_model import RigModel
from pamrs.control._sampled import SampledController
from pamrs.control._sharing import CoContraction, Demand, Share, Together
from pamrs.control._sliding import Sliding, SlidingController
from pamrs.control._torque import (
    BundleTorque,
    FullTorque,
    GaylordTorque,
    GroupTorque,
    OpposedTorque,
    SimplifiedTorque,
    TorqueModel,
    torque_line,
)
from pamrs.control._ways import FlowInverse, SetPoint

if TYPE_CHECKING:
    from pamrs.control import (
        gym,
        iosystem,
        linear,
        live,
        metrics,
        simulated_device,
        stability,
        trajectories,
        tuning,
    )
    from pamrs.control._loop import Actuation, ClosedLoop, closed_loop
    from pamrs.control._sensors import Sensors
    from pamrs.control._sweeping import Sweep, sweep
    from pamrs.control.live import Device, LiveError, LiveRun, SystemClock, run_live
    from pamrs.control.metrics import Metrics
    from pamrs.control.trajectories import Trajectory
    from pamrs.control.tuning import GainMap

__all__ = [
    "ANTI_WINDUP",
    "Actuation",
    "FUZZY_SETS",
    "NETWORKS",
    "PID",
    "AdaptiveSliding",
    "AirModel",
    "ArmModel",
    "Together",
    "Share",
    "SetPoint",
    "RigModel",
    "Recruitment",
    "RigController",
    "PlanarArmModel",
    "OpposedTorque",
    "JointTorques",
    "JointModel",
    "GroupTorque",
    "FlowInverse",
    "FeedforwardPressure",
    "Demand",
    "CoContraction",
    "BundleTorque",
    "ByLength",
    "Cascade",
    "ClosedLoop",
    "ConductanceInverse",
    "Controller",
    "DeadZoneCompensation",
    "Device",
    "Feedforward",
    "FilteredDerivative",
    "FullTorque",
    "Fuzzy",
    "GainMap",
    "GaylordTorque",
    "HysteresisCompensation",
    "HystereticTorque",
    "Integrator",
    "JointSensor",
    "LiveError",
    "LiveRun",
    "LoadModel",
    "LowPass",
    "Measurement",
    "Metrics",
    "Neural",
    "OrificeInverse",
    "PIDLaw",
    "Parallel",
    "PressureLoop",
    "Reference",
    "SampledController",
    "Sensors",
    "SimplifiedTorque",
    "Sliding",
    "SlidingController",
    "SlipMemory",
    "Sweep",
    "SystemClock",
    "TorqueModel",
    "Trajectory",
    "Value",
    "cascaded_pid",
    "closed_loop",
    "fuzzy_rules",
    "fuzzy_surface",
    "gym",
    "iosystem",
    "linear",
    "live",
    "metrics",
    "run_live",
    "simulated_device",
    "stability",
    "sweep",
    "torque_line",
    "trajectories",
    "tuning",
]

_MODULES: Final = (
    "gym",
    "iosystem",
    "linear",
    "live",
    "metrics",
    "simulated_device",
    "stability",
    "trajectories",
    "tuning",
)
_HOMES: Final[dict[str, str]] = {
    "Actuation": "pamrs.control._loop",
    "ClosedLoop": "pamrs.control._loop",
    "Device": "pamrs.control.live",
    "GainMap": "pamrs.control.tuning",
    "LiveError": "pamrs.control.live",
    "LiveRun": "pamrs.control.live",
    "Metrics": "pamrs.control.metrics",
    "Sensors": "pamrs.control._sensors",
    "Sweep": "pamrs.control._sweeping",
    "SystemClock": "pamrs.control.live",
    "Trajectory": "pamrs.control.trajectories",
    "closed_loop": "pamrs.control._loop",
    "run_live": "pamrs.control.live",
    "sweep": "pamrs.control._sweeping",
}


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        value: Any = importlib.import_module(f"pamrs.control.{name}")
    elif name in _HOMES:
        value = getattr(importlib.import_module(_HOMES[name]), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
