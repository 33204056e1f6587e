"""A joint that is thrown on its stop: what the cut chain makes of it, and its sensitivities."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import pamrs
from pamrs.simulation import core_rig

Array = NDArray[np.float64]

DT = 0.01
START = {"muscle_pressure": 5e5, "joint_angle": np.deg2rad(113.0), "joint_rate": 2.0}


class Thrown:
    """Half a second of a shoulder that comes to its upper stop and bounces, every 10 ms, with the
    pressure and its slope as they are.
    """

    def __init__(self) -> None:
        self.rig, fine = pamrs.rigs.shoulder(), 1e-4
        every = round(DT / fine)
        command = np.full(60 * every, 5.2)
        run = pamrs.simulate(self.rig, command, sample_time=fine, initial=START)
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
        commands = {"valve_command": np.full(angle.size, 5.2)}
        core = core_rig(rig)
        return core.predict("arm", commands, DT, 5e-3, [0], names, signals, angle.size)


def test_steps_of_five_milliseconds_tell_a_joint_on_its_stop() -> None:
    """Within an encoder's noise through three bounces; whole steps over the stop miss by twice
    that.
    """
    run = Thrown()
    stop = np.deg2rad(120.0)
    assert np.count_nonzero(np.diff(run.angle > stop)) >= 4  # it bounces
    value, _ = run.predicted(run.rig, run.start, [])
    assert np.abs(value - run.angle).max() < 6e-4


def test_sensitivities_hold_beyond_a_stop() -> None:
    """Against differences of runs that begin or are a little different."""
    run = Thrown()
    names = {"arm.payload": 3e-3, "muscle.modulus_scale": 3e-4}
    _, slopes = run.predicted(run.rig, run.start, list(names))
    assert slopes is not None

    def one(values: dict[str, float], angle: float = 0.0, rate: float = 0.0) -> Array:
        start = run.start[0] + angle, run.start[1] + rate
        return run.predicted(run.rig.with_parameters(values), start, [])[0]

    found = []
    for name, by in names.items():
        value = run.rig.parameters[name].value
        found.append((one({name: value + by}) - one({name: value - by})) / (2.0 * by))
    by = 1e-4
    found.append((one({}, angle=by) - one({}, angle=-by)) / (2.0 * by))
    found.append((one({}, rate=by) - one({}, rate=-by)) / (2.0 * by))
    for k, differences in enumerate(found):
        missed = np.linalg.norm(slopes[:, k] - differences) / np.linalg.norm(differences)
        assert missed < 0.01, (k, missed)
