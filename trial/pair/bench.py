"""Runs the recordings of a case of a pair."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..bench import Bench
from ..effects import Effect
from ..plant import Parameters
from ..recording import Array, Record, follow
from ..rig_kinds import nominal_pair
from ..rigfile import split
from .course import PairDriver, pair_course
from .places import SIDES, Placed
from .plant import PairParameters, PairPlant, pair_parameters
from .recording import CHANNELS, KINDS, PairPath, run_pair


class PairBench(Bench):
    """The recordings of one case of a pair; its effects are :class:`.places.Placed`."""

    channels = CHANNELS

    def numbers(self, model: dict[str, Any]) -> PairParameters:
        return pair_parameters(model)

    def numbers_at(self, effect: Effect | Placed) -> tuple[Parameters, ...]:
        assert isinstance(effect, Placed)
        own: PairParameters = self.par
        return tuple(own.of(side) for side in effect.sides or ("",))

    def floors(self) -> Array:
        return self.noise.floor()[list(KINDS)]

    def steered(
        self, name: str, duration: float, period: float, rng: np.random.Generator
    ) -> tuple[Any, Any]:
        shape = pair_course(self.rig, name, duration, self.step, rng)
        return shape, PairDriver(nominal_pair(), self.rig, period, rng)

    def plant(self, numbers: Any, effects: Sequence[Any] = ()) -> PairPlant:
        return PairPlant(numbers, effects)

    def record(
        self,
        plant: Any,
        drive: tuple[Any, Any, Array | None],
        supply: float,
        index: int,
        rng: np.random.Generator,
    ) -> Record:
        shape, driver, command = drive
        driver.reset()
        held = self.spec.lab.held if command is None else 1

        def steering(i: int, measured: tuple[float, ...]) -> tuple[float, float]:
            return driver.on(shape, i, measured) if command is None else tuple(command[i].tolist())

        return run_pair(plant, shape, steering, supply, self.noise, rng, index, self.step, held)

    def followed(
        self, plant: Any, record: Record, index: int, name: str = "", step: float = 0.0
    ) -> Array:
        section, key = split(name)
        zero = {"pressure_zero": section.removeprefix("sensors."), "angle_zero": "angle"}.get(key)
        shift = tuple(-step if zero == own else 0.0 for own in (*SIDES, "angle"))
        return follow(plant, record, index, shift, sample_time=self.step, way=PairPath)

    @property
    def shown(self) -> list[int]:
        return [i for i, name in enumerate(self.channels) if name != self.spec.lab.missing]
