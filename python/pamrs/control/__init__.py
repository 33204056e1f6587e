"""Controllers of the joint angle, sampled, for one arm or a batch of them; trajectories, metrics, tuning and stability."""

from pamrs.control.adaptive import AdaptiveSliding
from pamrs.control.air import AirModel, OrificeInverse
from pamrs.control.cascade import Cascade, PressureLoop, cascaded_pid
from pamrs.control.feedforward import Feedforward, Parallel
from pamrs.control.fuzzy import FUZZY_SETS, Fuzzy, fuzzy_rules, fuzzy_surface
from pamrs.control.hysteresis import DeadZoneCompensation, HysteresisCompensation, HystereticTorque, SlipMemory
from pamrs.control.joint_sensor import JointSensor
from pamrs.control.model import ArmModel, FullTorque, GaylordTorque, SimplifiedTorque, TorqueModel, torque_line
from pamrs.control.neural import NETWORKS, Neural
from pamrs.control.parts import ANTI_WINDUP, FilteredDerivative, Integrator, LowPass
from pamrs.control.pid import PID, PIDLaw
from pamrs.control.protocol import Controller, Measurement, Reference, Value
from pamrs.control.sampled import SampledController
from pamrs.control.sliding import Sliding, SlidingController

__all__ = [
    "ANTI_WINDUP",
    "FUZZY_SETS",
    "NETWORKS",
    "PID",
    "AdaptiveSliding",
    "AirModel",
    "ArmModel",
    "Cascade",
    "Controller",
    "DeadZoneCompensation",
    "Feedforward",
    "FilteredDerivative",
    "FullTorque",
    "Fuzzy",
    "GaylordTorque",
    "HysteresisCompensation",
    "HystereticTorque",
    "Integrator",
    "JointSensor",
    "LowPass",
    "Measurement",
    "Neural",
    "OrificeInverse",
    "PIDLaw",
    "Parallel",
    "PressureLoop",
    "Reference",
    "SampledController",
    "SimplifiedTorque",
    "Sliding",
    "SlidingController",
    "SlipMemory",
    "TorqueModel",
    "Value",
    "cascaded_pid",
    "fuzzy_rules",
    "fuzzy_surface",
    "torque_line",
]
