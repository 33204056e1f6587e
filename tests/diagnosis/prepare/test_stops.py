"""A joint that is thrown on its stop, or lifted off it: what the cut chain makes of it, and its
sensitivities.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import pamrs
from pamrs.simulation import core_rig

Array = NDArray[np.float64]

DT = 0.01
START = {"muscle_pressure": 5e5, "joint_angle": np.deg2rad(113.0), "joint_rate": 2.0}


class Run:
    """Half a second of a shoulder, every 10 ms, with the pressure and its slope as they are; by
    default it comes to its upper stop and bounces.
    """

    def __init__(self, start: dict[str, float] = START, volts: float = 5.2) -> None:
        self.rig, fine = pamrs.rigs.shoulder(), 1e-4
        every, self.volts = round(DT / fine), volts
        command = np.full(60 * every, volts)
        run = pamrs.simulate(self.rig, command, sample_time=fine, initial=start)
        self.angle, self.rate = run["joint_angle"][::every], run["joint_rate"][::every]
        self.signals = {
            name: (run[name][::every], np.gradient(run[name], fine)[::every])
            for name in ("muscle_pressure", "supply_pressure")
        }
        self.start = float(self.angle[0]), float(self.rate[0])

    def predicted(
        self, rig: pamrs.Rig, start: tuple[float, float], names: list[str]
    ) -> tuple[Array, Array | None]:
        """Angle by the cut chain in steps of 5 ms, from a start that is given."""
        angle, rate = self.angle.copy(), self.rate.copy()
        angle[0], rate[0] = start
        signals = self.signals | {"joint_angle": (angle, rate)}
        commands = {"valve_command": np.full(angle.size, self.volts)}
        core = core_rig(rig)
        return core.predict("arm", commands, DT, 5e-3, [0], names, signals, angle.size)


def test_steps_of_five_milliseconds_tell_a_joint_on_its_stop() -> None:
    """Within an encoder's noise through three bounces; whole steps over the stop miss by twice
    that.
    """
    run = Run()
    stop = np.deg2rad(120.0)
    assert np.count_nonzero(np.diff(run.angle > stop)) >= 4  # it bounces
    value, _ = run.predicted(run.rig, run.start, [])
    assert np.abs(value - run.angle).max() < 6e-4


def missed(run: Run, by: float = 1e-4) -> dict[str, float]:
    """How far sensitivities are from differences of runs that are a little different, or begin so
    much [rad, rad/s] beside, over these.
    """
    names = {"arm.payload": 3e-3, "muscle.modulus_scale": 3e-4, "sensors.pressure_zero": 20.0}
    _, slopes = run.predicted(run.rig, run.start, list(names))
    assert slopes is not None

    def one(values: dict[str, float], angle: float = 0.0, rate: float = 0.0) -> Array:
        start = run.start[0] + angle, run.start[1] + rate
        return run.predicted(run.rig.with_parameters(values), start, [])[0]

    differences = {}
    for name, change in names.items():
        value = run.rig.parameters[name].value
        differences[name] = one({name: value + change}) - one({name: value - change})
        differences[name] /= 2.0 * change
    differences["angle"] = (one({}, angle=by) - one({}, angle=-by)) / (2.0 * by)
    differences["rate"] = (one({}, rate=by) - one({}, rate=-by)) / (2.0 * by)
    columns = zip(differences.items(), slopes.T, strict=True)
    return {n: float(np.linalg.norm(own - d) / np.linalg.norm(d)) for (n, d), own in columns}


def test_sensitivities_hold_beyond_a_stop() -> None:
    found = missed(Run())
    assert max(found.values()) < 0.01, found


def test_sensitivities_hold_where_a_joint_leaves_its_stop() -> None:
    """A stop never pulls: its push is nothing at the instant at which it ends, so that nothing of
    the sensitivities jumps there whatever that instant depends on.
    """
    low = np.deg2rad(15.0)
    lifted = Run({"muscle_pressure": 0.0, "joint_angle": low - 5e-4}, volts=5.6)
    (leaves,) = np.flatnonzero(np.diff(lifted.angle > low))
    assert leaves > 2  # it lies on it first, and is well above in the end
    assert lifted.angle[-1] > low + 0.3
    found = missed(lifted, by=1e-5)
    assert max(found.values()) < 1e-3, found
