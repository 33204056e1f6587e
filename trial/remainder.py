"""What of an effect is left when the parameters of the baseline are refitted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .plant import Plant
from .recording import SAMPLE_TIME, Array, Noise, Record, follow
from .rigfile import to_parameters

#: part of a tolerance for the differences, and samples per row of the fit
_STEP, _STRIDE = 0.1, 10


class Remainder:
    """Linear refit of all baseline parameters with their tolerances as priors.

    Every window of 2 s counts as one observation per channel, since the deviations in it are
    coloured.

    Parameters
    ----------
    true : dict
        The true nested model.
    tolerance : dict
        Standard deviation by dotted name.
    records : sequence of (Record, int)
        Recordings to fit and their numbers.
    noise : Noise
        Transducers.
    """

    def __init__(
        self,
        true: dict[str, Any],
        tolerance: dict[str, float],
        records: Sequence[tuple[Record, int]],
        noise: Noise,
    ) -> None:
        self.floor = noise.floor()
        names = [name for name in tolerance if name != "supply.initial_pressure"]
        base = Plant(to_parameters(true))
        start = [follow(base, r, i)[::_STRIDE] for r, i in records]
        self.columns: list[list[Array]] = []
        for name in names:
            section, key = name.split(".")
            step = _STEP * tolerance[name]
            changed = {k: dict(v) for k, v in true.items()}
            changed[section][key] += step
            # a zero of a transducer also moves the state that a window seems to start from
            shift = (
                -step if key == "pressure_zero" else 0.0,
                -step if key == "angle_zero" else 0.0,
            )
            plant = Plant(to_parameters(changed))
            self.columns.append(
                [
                    (follow(plant, r, i, shift)[::_STRIDE] - a) / _STEP
                    for (r, i), a in zip(records, start, strict=True)
                ]
            )

    def of(self, moved: Sequence[Array]) -> list[Array]:
        """What is left of (n, 3) deviations per recording, at every tenth sample."""
        thin = [m[::_STRIDE] for m in moved]
        weight = np.sqrt(_STRIDE * SAMPLE_TIME / 2.0)
        rows = np.concatenate([(weight * m / self.floor).ravel() for m in thin])
        matrix = np.column_stack(
            [
                np.concatenate([(weight * c / self.floor).ravel() for c in column])
                for column in self.columns
            ]
        )
        size = matrix.shape[1]
        z = np.linalg.lstsq(
            np.vstack([matrix, np.eye(size)]), np.concatenate([rows, np.zeros(size)]), rcond=None
        )[0]
        return [
            m - sum(float(v) * column[j] for v, column in zip(z, self.columns, strict=True))
            for j, m in enumerate(thin)
        ]
