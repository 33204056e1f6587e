"""Controllers of the joint angle, sampled, for one arm or a batch of them; trajectories, metrics, tuning and stability."""

from pamrs.control.fuzzy import FUZZY_SETS, Fuzzy, fuzzy_rules, fuzzy_surface
from pamrs.control.joint_sensor import JointSensor
from pamrs.control.parts import ANTI_WINDUP, FilteredDerivative, Integrator, LowPass
from pamrs.control.pid import PID, PIDLaw
from pamrs.control.protocol import Controller, Measurement, Reference, Value
from pamrs.control.sampled import SampledController

__all__ = [
    "ANTI_WINDUP",
    "FUZZY_SETS",
    "PID",
    "Controller",
    "FilteredDerivative",
    "Fuzzy",
    "Integrator",
    "JointSensor",
    "LowPass",
    "Measurement",
    "PIDLaw",
    "Reference",
    "SampledController",
    "Value",
    "fuzzy_rules",
    "fuzzy_surface",
]
