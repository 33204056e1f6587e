"""One smooth run of each packaged rig: what drives it, from where, and how core and reference carry
it out.

The joints stay off their stops.  Commands are held over each sample; both sides restart there.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

import pamrs
from tests.reference import network

Array = NDArray[np.float64]

#: Buckling load of a muscle that never buckles, N.
STRUT = 1e9

#: Channels of the reference that are called otherwise in the core.
CALLED = {"line_air_mass": "line_mass"}


@dataclass(frozen=True)
class Run:
    """A run of a rig.

    Attributes
    ----------
    rig : str or Rig
        Name of a packaged rig, or the rig.
    sample_time : float
        Seconds between rows.
    rows : int
        Number of rows.
    initial : dict of str to float
        Gauge pressures (Pa), angles (rad), rates (rad/s), lengths (m).
    commands : dict of str to ndarray, shape (rows,)
        By channel: ``valve_command.flexor`` (V), ``supply_command`` (Pa, gauge), ``length`` (m) of
        a load frame, which the reference does not have.
    changes : dict of str to float
        Parameters of the rig that are others than in the package, by dotted name, SI.
    """

    rig: str | pamrs.Rig
    sample_time: float
    rows: int
    initial: Mapping[str, float] = field(default_factory=dict)
    commands: Mapping[str, Array] = field(default_factory=dict)
    changes: Mapping[str, float] = field(default_factory=dict)

    @property
    def with_struts(self) -> Run:
        """The same with muscles that push as their force model says, as the golden vectors have."""
        held = {
            f"{'.'.join(filter(None, ('muscle', name)))}.buckling_load": STRUT
            for name in self.plant.tables("muscle")
        }
        return replace(self, changes={**self.changes, **held})

    @cached_property
    def plant(self) -> pamrs.Rig:
        """The rig, changes made."""
        rig = pamrs.rigs.named(self.rig) if isinstance(self.rig, str) else self.rig
        return rig.with_parameters(self.changes)

    @cached_property
    def model(self) -> dict[str, Any]:
        """The description that core and reference take."""
        model: dict[str, Any] = json.loads(self.plant.to_json())
        return model

    @property
    def time(self) -> Array:
        """Time of each row, s."""
        return self.sample_time * np.arange(self.rows)

    @property
    def keywords(self) -> dict[str, Any]:
        """What drives it, as keywords of `pamrs.simulate` (and without ``duration`` those of
        `Simulator.run`).
        """
        signals: dict[str, Any] = {}
        for name, values in self.commands.items():
            channel, _, block = name.partition(".")
            if channel == "length":
                signals[channel] = values
            else:
                signals.setdefault(channel, {})[block] = values
        return signals or {"duration": (self.rows - 1) * self.sample_time}

    def core(self, step: float | None = None) -> pamrs.Simulation:
        """Simulate with pamrs at a step (s)."""
        own = {"sample_time": self.sample_time, "initial": self.initial}
        return pamrs.simulate(self.plant, step=step, **own, **self.keywords)

    def reference(
        self, rtol: float = 1e-12, method: Literal["DOP853", "Radau"] = "DOP853"
    ) -> dict[str, Array]:
        """Integrate with the reference; channels by the core's names, supplies' masses left out."""
        rows = None if self.commands else self.rows
        given = (self.model, self.commands, self.sample_time, self.initial, rtol)
        found = network.simulate(*given, rows=rows, method=method)
        named = {}
        for name, values in found.items():
            channel, dot, block = name.partition(".")
            if channel not in ("supply_air_mass", "time"):
                named[CALLED.get(channel, channel) + dot + block] = values
        return named

    def lasting(self, rows: int) -> Run:
        """The same with fewer rows."""
        commands = {name: values[:rows] for name, values in self.commands.items()}
        return replace(self, rows=rows, commands=commands)


def misses(got: Mapping[str, Array], want: Mapping[str, Array]) -> dict[str, float]:
    """Largest error of every channel of `want` as a fraction of its range; where it stays, of its
    magnitude (1 at least).

    The positive work at the joints is held to the range of the muscles' whole work where that is
    larger: of a load that sinks, the positive part is nothing but the moment before it turns.
    """
    found = {}
    for name, values in want.items():
        most = float(np.abs(values).max())
        # a range far below the magnitude is rounding's
        scale = max(float(np.ptp(values)), 1e-5 * most) if np.ptp(values) else max(1.0, most)
        if name == "joint_work" and "muscle_work" in want:
            scale = max(float(np.ptp(want["muscle_work"])), scale)
        found[name] = float(np.abs(got[name] - values).max()) / scale
    return found


def _about(
    mean: float, swing: float, frequency: float, phase: float, sample_time: float, rows: int
) -> Array:
    """A sine about a mean, one value per row."""
    return mean + swing * np.sin(2.0 * np.pi * frequency * sample_time * np.arange(rows) + phase)


def _valves(
    names: tuple[str, ...], swing: float, frequency: float, phases: tuple[float, ...], rows: int
) -> dict[str, Array]:
    """A sine about 5 V for every valve, at rows of 5 ms."""
    words = [f"valve_command.{name}" if name else "valve_command" for name in names]
    return {
        word: _about(5.0, swing, frequency, phase, 0.005, rows)
        for word, phase in zip(words, phases, strict=True)
    }


#: The reference has no force that depends on the direction of motion.
FRICTIONLESS = {
    f"muscle.{side}.friction_{key}": 0.0
    for side in ("flexor", "extensor")
    for key in ("coefficient", "pressure_slope", "floor")
}

_DEGREE = math.pi / 180.0

RUNS: dict[str, Run] = {
    "shoulder": Run(
        "shoulder",
        0.005,
        121,
        {"joint_angle": 40.0 * _DEGREE, "muscle_pressure": 2.6e5},
        _valves(("",), 0.8, 2.5, (0.0,), 121),
    ),
    "throttled_supply": Run(
        "throttled_supply",
        0.005,
        121,
        {
            "joint_angle": 40.0 * _DEGREE,
            "muscle_pressure.muscle": 2.6e5,
            "muscle_pressure.feed": 12e5,
        },
        _valves(("",), 0.8, 2.5, (0.0,), 121),
    ),
    "elbow": Run(
        "elbow",
        0.005,
        121,
        {"joint_angle": 45.0 * _DEGREE, "muscle_pressure": 5.5e5},
        _valves(("",), 0.8, 2.5, (0.0,), 121),
    ),
    "antagonistic_joint": Run(
        "antagonistic_joint",
        0.005,
        161,
        {"joint_angle.elbow": 40.0 * _DEGREE},
        _valves(("flexor", "extensor"), 3.0, 1.2, (0.3, 3.6), 161),
        FRICTIONLESS,
    ),
    "recruitment": Run(
        "recruitment",
        0.005,
        121,
        {
            "joint_angle.shoulder": 40.0 * _DEGREE,
            "muscle_pressure.pair_1": 3e5,
            "muscle_pressure.pair_2": 2e5,
            "muscle_pressure.pair_3": 2.5e5,
        },
        _valves(("pair_1", "pair_2", "pair_3"), 0.5, 2.5, (1.1, 2.2, 3.3), 121),
    ),
    "sealed_chamber": Run("sealed_chamber", 0.1, 11, {"muscle_pressure": 4e5}),
    "blow_down_tank": Run("blow_down_tank", 0.1, 401),
    "tube": Run("tube", 0.005, 101),
    "long_tube": Run("long_tube", 0.002, 61),
    "regulated_joint": Run(
        "regulated_joint",
        0.005,
        161,
        {"joint_angle": 45.0 * _DEGREE, "muscle_pressure": 2e5, "supply_pressure": 2.2e5},
        {"supply_command": _about(2e5, 1.2e5, 1.5, 0.2, 0.005, 161)},
    ),
    "hanging_mass": Run(
        "hanging_mass",
        0.005,
        161,
        {"length": 0.25, "muscle_pressure": 2.4e5},
        _valves(("",), 0.6, 2.0, (0.0,), 161),
    ),
    "two_joint_arm": Run(
        "two_joint_arm",
        0.005,
        101,
        {
            "joint_angle.elbow": 40.0 * _DEGREE,
            "joint_angle.wrist": 40.0 * _DEGREE,
            "muscle_pressure.elbow": 3e5,
            "muscle_pressure.wrist": 2e5,
        },
        _valves(("elbow", "wrist"), 0.4, 3.0, (0.0, 2.0), 101),
    ),
}
