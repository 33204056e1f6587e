"""The compiled core: muscles, rigs, simulation and cut-chain prediction."""

from typing import final

import numpy as np
from numpy.typing import NDArray

__all__ = ["Muscle", "Rig", "__version__", "effects", "parameter_names"]

__version__: str

_Array = NDArray[np.float64]
_Signal = tuple[_Array, _Array]

@final
class Muscle:
    def __new__(cls, json: str) -> Muscle: ...
    def radius(self, contraction: _Array) -> _Array: ...
    def thickness(self, contraction: _Array) -> _Array: ...
    def air_volume(self, contraction: _Array) -> _Array: ...
    def force(self, pressure: _Array, contraction: _Array) -> _Array: ...
    def force_table(self, pressure: _Array, contraction: _Array) -> _Array: ...
    @property
    def contraction_range(self) -> tuple[float, float]: ...
    @property
    def table_error(self) -> float: ...

@final
class Rig:
    def __new__(cls, json: str) -> Rig: ...
    def respecified(self, json: str) -> Rig: ...
    def simulate(
        self,
        valve_command: _Array,
        sample_time: float,
        step: float,
        *,
        muscle_pressure: float | None = None,
        supply_pressure: float | None = None,
        joint_angle: float | None = None,
        joint_rate: float | None = None,
    ) -> dict[str, _Array]: ...
    def predict(
        self,
        block: str,
        valve_command: _Array,
        sample_time: float,
        step: float,
        starts: list[int],
        parameters: list[str],
        *,
        supply_pressure: _Signal | None = None,
        muscle_pressure: _Signal | None = None,
        joint_angle: _Signal | None = None,
    ) -> tuple[_Array, _Array | None]: ...

def effects() -> list[tuple[str, str, list[tuple[str, str]]]]: ...
def parameter_names() -> list[str]: ...
