"""Budget of a campaign (minutes, runs and air), and the share of it that an experiment takes."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from pamrs._checks import positive, whole
from pamrs.errors import SimulationError
from pamrs.experiments import Experiment
from pamrs.rig import Rig

_LITRES: Final = 1e3  # in a cubic metre
_MINUTE: Final = 60.0  # [s]


@dataclass(frozen=True)
class Cost:
    """Time, number and air of runs.

    Attributes
    ----------
    seconds : float
        Time at the bench [s].
    runs : int
        How many.
    litres : float
        Air at ambient pressure and temperature [l], by the model.
    """

    seconds: float = 0.0
    runs: int = 0
    litres: float = 0.0

    def __add__(self, other: Cost) -> Cost:
        return Cost(
            self.seconds + other.seconds, self.runs + other.runs, self.litres + other.litres
        )


@dataclass(frozen=True)
class Budget:
    """Minutes, runs and air that a campaign may use.

    Attributes
    ----------
    minutes : float
        Time at the bench [min].
    runs : int
        How many, repeated ones included.
    air : float
        At ambient pressure and temperature [l].
    """

    minutes: float = 30.0
    runs: int = 6
    air: float = 1000.0

    def __post_init__(self) -> None:
        positive("minutes", self.minutes)
        whole("runs", self.runs)
        positive("air", self.air)

    def passed(self, cost: Cost) -> str:
        """Limits that a cost would pass, in words; empty where it passes none."""
        limits = [
            (cost.seconds / _MINUTE, self.minutes, "minutes"),
            (float(cost.runs), float(self.runs), "runs"),
            (cost.litres, self.air, "litres of air"),
        ]
        return next((f"{v:.3g} of {most:g} {what}" for v, most, what in limits if v > most), "")


def cost_of(experiment: Experiment, rig: Rig, settle: float) -> Cost:
    """Cost of an experiment by the model of its rig: its time with what comes before it, and the
    air that its commands let in.
    """
    litres = 0.0  # where it cannot be run, its air is not known; its time is
    with suppress(SimulationError):
        found = experiment.simulate(rig)
        gas = rig.tables("gas")[""]
        if "mass_supplied" in found:
            mass = float(found["mass_supplied"][-1])
            volume = mass * gas["gas_constant"] * gas["temperature"] / gas["ambient_pressure"]
            litres = _LITRES * max(volume, 0.0)
    return Cost(experiment.duration + settle, 1, litres)
