"""Controllers of the joint angle, sampled, for one arm or a batch of them; trajectories, metrics,
tuning and stability.
"""

from pamrs.control import (
    iosystem,
    linear,
    live,
    metrics,
    simulated_device,
    stability,
    trajectories,
    tuning,
)
from pamrs.control._adaptive import AdaptiveSliding
from pamrs.control._air import AirModel, ConductanceInverse, FlowInverse, OrificeInverse, SetPoint
from pamrs.control._cascade import Cascade, PressureLoop, cascaded_pid
from pamrs.control._feedforward import Feedforward, FeedforwardPressure, Parallel
from pamrs.control._fuzzy import Fuzzy, fuzzy_rules, fuzzy_surface
from pamrs.control._hysteresis import (
    HysteresisCompensation,
    HystereticTorque,
    SlipMemory,
)
from pamrs.control._load import ByLength, LoadModel
from pamrs.control._loop import Actuation, ClosedLoop, closed_loop
from pamrs.control._model import ArmModel, JointModel
from pamrs.control._neural import NETWORKS, Neural
from pamrs.control._parts import ANTI_WINDUP, FilteredDerivative, Integrator, JointSensor, LowPass
from pamrs.control._pid import PID, PIDLaw
from pamrs.control._planar import JointTorques, PlanarArmModel
from pamrs.control._protocol import Controller, Measurement, Reference, Value
from pamrs.control._recruiting import Recruitment
from pamrs.control._rig_controller import RigController
from pamrs.control._rig_model import RigModel
from pamrs.control._sampled import SampledController
from pamrs.control._sensors import Sensors
from pamrs.control._sharing import CoContraction, Demand, Share, Together
from pamrs.control._sliding import Sliding, SlidingController
from pamrs.control._sweeping import Sweep, sweep
from pamrs.control._torque import (
    BundleTorque,
    FullTorque,
    GroupTorque,
    OpposedTorque,
    SimplifiedTorque,
    TorqueModel,
    torque_line,
)
from pamrs.control.live import Device, LiveError, LiveRun, SystemClock, run_live
from pamrs.control.metrics import Metrics
from pamrs.control.trajectories import Trajectory
from pamrs.control.tuning import GainMap

__all__ = [
    "ANTI_WINDUP",
    "Actuation",
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
    "Device",
    "Feedforward",
    "FilteredDerivative",
    "FullTorque",
    "Fuzzy",
    "GainMap",
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
