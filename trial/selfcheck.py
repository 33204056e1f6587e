"""Checks of the plant against an integrator of another kind and against the golden vectors."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from .effects import TYPES, Effects, draw
from .excitation import DAC_STEP
from .pair.places import BOTH, Placed, has_place
from .pair.plant import PairPlant
from .plant import Plant
from .rig_kinds import nominal_pair
from .rigfile import default_rig, read_rig, to_parameters
from .solver import TOLERANCE


def against_golden(plant: Plant, path: Path) -> dict[str, float]:
    """Largest error of each channel over its range for a golden file."""
    with path.open(newline="", encoding="utf-8") as stream:
        rows = [[float(v) for v in r] for r in list(csv.reader(stream))[1:]]
    data = np.array(rows)
    y = plant.initial(data[0, 2], data[0, 3], data[0, 4], data[0, 5])
    step = 1.0e-3
    found = [y[:4]]
    for i in range(len(data) - 1):
        y, step = plant.advance(
            y, plant.normalised(float(data[i, 1])), float(data[i + 1, 0] - data[i, 0]), step
        )
        found.append(y[:4])
    error = np.abs(np.array(found) - data[:, 2:6]).max(axis=0) / np.ptp(data[:, 2:6], axis=0)
    names = ("muscle_pressure", "supply_pressure", "joint_angle", "joint_rate")
    return dict(zip(names, (float(e) for e in error), strict=True))


def _opening(plant: Plant | PairPlant, index: int, step: float = 0.0) -> Any:
    """Opening of the valve, or of both of a pair, in one of the tenths of a second of a check; the
    command comes in steps [V] where one is given.
    """
    move = 0.5 * math.sin(0.9 * index) + 0.25 * (index < 15)
    move = round(move / step) * step if step else move
    if isinstance(plant, PairPlant):
        return plant.normalised((5.0 + move, 5.0 - 0.8 * move + 0.1))
    return plant.normalised(5.0 + move)


def _recorded(plant: Plant | PairPlant) -> int:
    """How many states a recording shows: pressures and the angle, which come first."""
    return 4 if isinstance(plant, PairPlant) else 3


def against_fine(plant: Plant | PairPlant, seconds: float = 10.0) -> float:
    """Largest difference of pressures and angle over their range from a run with a tolerance of
    1e-12.
    """
    found, shown = [], _recorded(plant)
    for rtol in (TOLERANCE, 1.0e-12):
        y, step, rows = plant.rest(13.8e5 + plant.par.ambient), 1.0e-3, []
        for i in range(round(seconds / 0.1)):
            y, step = plant.advance(y, _opening(plant, i), 0.1, step, rtol)
            rows.append(y[:shown])
        found.append(np.array(rows))
    return float((np.abs(found[0] - found[1]).max(axis=0) / np.ptp(found[1], axis=0)).max())


def against_lsoda(plant: Plant | PairPlant, seconds: float = 3.0) -> float:
    """Largest difference from scipy's LSODA (rtol 1e-10), relative to the size of each state.

    States that a recording shows are compared as cases are written. All others too are compared at
    a tolerance of 1e-12: what no recording shows may gather more error in a case (2e-4 of 1 rad/s
    in the rate of a load that swings).
    """
    other, shown = plant.rest(13.8e5 + plant.par.ambient), _recorded(plant)
    runs = [(list(other), 1.0e-3)] * 2
    worst = 0.0
    for i in range(round(seconds / 0.1)):
        opening = _opening(plant, i, DAC_STEP)
        runs = [
            plant.advance(y, opening, 0.1, step, rtol)
            for (y, step), rtol in zip(runs, (TOLERANCE, 1.0e-12), strict=True)
        ]

        def slope(_: float, state: Any, x: Any = opening) -> list[float]:
            return plant.derivative(state.tolist(), x)

        kwargs: dict[str, Any] = {
            "method": "LSODA",
            "rtol": 1e-10,
            "atol": 1e-12 * np.array(plant.scale),
            "max_step": 2e-3,
        }
        other = solve_ivp(slope, (0.0, 0.1), other, **kwargs).y[:, -1].tolist()
        off = [
            [abs(a - b) / (abs(b) + s) for a, b, s in zip(y, other, plant.scale, strict=True)]
            for y, _ in runs
        ]
        worst = max(worst, *off[0][:shown], *off[1])
    return worst


def selfcheck(golden: Path | None = None) -> str:
    """Run every check and describe the outcome.

    Parameters
    ----------
    golden : Path, optional
        Folder with golden vectors of the plant without effects (CSV: time, command, absolute
        pressures, angle, rate).

    Raises
    ------
    ValueError
        A check failed.
    """
    parameters = to_parameters(read_rig(default_rig())[0])
    plant, pair = Plant(parameters), nominal_pair().par
    lines: list[str] = []
    bad: list[str] = []

    def check(text: str, error: float, most: float) -> None:
        lines.append(text)
        if not error < most:
            bad.append(text)

    for path in sorted(golden.glob("shoulder_*.csv")) if golden else ():
        errors = against_golden(plant, path)
        told = ", ".join(f"{k} {v:.1e}" for k, v in errors.items())
        # a strike on the stiff stop amplifies every rounding
        most = 1.0e-5 if "choked" in path.stem else 1.0e-7
        check(f"golden {path.stem}: {told} of range", max(errors.values()), most)
    error = against_fine(plant)
    check(f"steps a tenth as long: {error:.1e} of range", error, 1.0e-7)
    rng = np.random.default_rng(1)
    for name in TYPES:
        error = against_lsoda(Plant(parameters, Effects(draw(name, 1.0, rng))))
        check(f"LSODA with {name}: {error:.1e}", error, 1.0e-5)
    error = against_fine(PairPlant(pair))
    check(f"pair, steps a tenth as long: {error:.1e} of range", error, 1.0e-7)
    for name, kind in TYPES.items():
        at = BOTH if has_place(name, kind.block) else ""
        error = against_lsoda(PairPlant(pair, (Placed(draw(name, 1.0, rng), at),)))
        check(f"pair, LSODA with {name}: {error:.1e}", error, 1.0e-5)
    if bad:
        raise ValueError("self-check failed:\n" + "\n".join(bad))
    return "\n".join(lines)
