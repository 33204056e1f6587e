"""A small PID for the tests of everything around controllers, whose gains may be arrays, one for
each plant of a batch; rigs with another valve or supply, or without friction.
"""

import numpy as np

import pamrs
from pamrs.control import Controller
from tests.reference.planar import Link, PlanarArm

#: The shoulder's area as a conductance [m3/(s Pa)]: 1 mm2 is 0.199 l/(s bar).
CONDUCTANCE = 8.4 * 0.1987e-8


def with_iso_valve(rig, fill, vent):
    """A rig of one valve, which has C [m3/(s Pa)] and b where it fills and where it vents."""
    model = rig.model
    table = model["valve"]
    del table["discharge_area_max"]
    table["flow"] = "iso_6358"
    for way, (conductance, ratio) in (("fill", fill), ("vent", vent)):
        table[f"{way}_conductance"], table[f"{way}_critical_ratio"] = conductance, ratio
    return pamrs.Rig(rig.name, model)


def with_regulator(rig, **changes):
    """A rig whose only supply is a regulator that begins at what the supply held."""
    model = rig.model
    model["supply"].pop("volume", None)
    model["supply"] |= {"kind": "regulator", "time_constant": 0.05, **changes}
    return pamrs.Rig(rig.name, model)


def without_friction(name, **changes):
    """A packaged rig without Coulomb friction and hysteresis, which no controller here models."""
    rig = pamrs.rigs.named(name)
    model = rig.with_parameters(changes).model
    muscle = model["muscle"]
    for table in [muscle] if "rest_length" in muscle else muscle.values():
        table |= dict.fromkeys(
            ("friction_coefficient", "friction_pressure_slope", "friction_floor"), 0.0
        )
    for table in [model["arm"]] if model["link"] is None else model["link"].values():
        table["coulomb"] = 0.0
    return pamrs.Rig(rig.name, model)


def reference_arm(rig, tilt=0.0):
    """The arm of several links of a rig as the reference has it."""
    links = [
        Link(t["length"], t["mass"], t["centre"], t["inertia"], t["payload"])
        for t in rig.tables("link").values()
    ]
    return PlanarArm(links, rig.model["arm"]["gravity"], tilt)


class SmallPid(Controller):
    """``null + kp e + ki int e - kd rate``, limited to 0..10 V, integration stopped while
    limited.
    """

    def __init__(self, kp=2.0, ki=1.0, kd=0.5, period=0.005, null=5.0):
        self.kp, self.ki, self.kd, self.period, self.null = kp, ki, kd, period, null
        self.reset()

    def reset(self):
        self.integral = 0.0

    def update(self, time, measurement, reference):
        error = reference.angle - measurement["joint_angle"]
        wanted = (
            self.null
            + self.kp * error
            + self.integral
            + self.kd * (reference.rate - measurement["joint_rate"])
        )
        if isinstance(wanted, np.ndarray):
            command = np.clip(wanted, 0.0, 10.0)
            self.integral = self.integral + np.where(
                command == wanted, self.ki * self.period * error, 0.0
            )
            return command
        command = min(max(wanted, 0.0), 10.0)
        if command == wanted:
            self.integral += self.ki * self.period * error
        return command

    @property
    def state(self):
        return {"integral": self.integral + 0.0}

    def restore(self, state):
        self.integral = state["integral"] + 0.0
