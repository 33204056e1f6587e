"""Muscles that stand in for the one of chapter 2, whose measured forces are in figures only.

The force of a muscle with stress ``s(eps, P)`` is gas and wall (2.16) on the elliptic shape, as the
core has it; what a stand-in adds is its rubber, put together from what the chapter says in words:
linear by itself (2.3), bonded to the braid by pressure, so that it is stiffer at small strains, and
softening where the hoop strain is about 2. This is no polynomial in the strain and not linear in
the pressure, so that the fits of 2.2 and 2.3 have something to leave over. Shape, braid angle and
wall are off from the nominal ones by what a person measures, and forces have noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pamrs.fit import ForceMap, MuscleFit, fit_friction, fit_muscle
from pamrs.library import ch2_075in
from pamrs.rig import Muscle

Array = NDArray[np.float64]

PSI: Final = 6894.757293
#: The eight pressures of 2.3 [psi], and the three of Fig. 2.16.
LEVELS: Final = (10.0, 20.0, 30.0, 40.0, 60.0, 80.0, 100.0, 120.0)
THREE: Final = (20.0, 60.0, 120.0)
#: Orders of the stress polynomial (2.9).
ORDERS: Final = (1, 2, 3, 4)
#: The longest state that was measured, as a contraction (2.3), and points of a level.
EXTENSION: Final = -0.0275
POINTS: Final = 100
#: How many stand-ins there are.
COUNT: Final = 16
#: Order of the polynomial that carries a stand-in's stress exactly enough: the rest is below 0.1 %.
_ORDER: Final = 10


@dataclass(frozen=True, eq=False)
class StandIn:
    """One muscle and its measured forces.

    Attributes
    ----------
    muscle : Muscle
        Its shape, with the noise of a person's measurements in it; moduli of order 10, all zero.
    rubber : float
        Modulus of the bladder by itself [Pa].
    bond : float
        Rise of the modulus at small strains with pressure, where that is high [1].
    contact : float
        Pressure at which half of that rise is there [Pa].
    width : float
        Strain over which the bond gives way [1].
    noise : float
        Standard deviation of a force over the level's largest [1].
    seed : int
        Of the noise.
    """

    muscle: Muscle
    rubber: float
    bond: float
    contact: float
    width: float
    noise: float
    seed: int

    def stress(self, strain: Array, pressure: float) -> Array:
        """Stress at strains (n,) [1] and a gauge pressure [Pa]: (n,) [Pa]."""
        held = self.bond * pressure**2 / (pressure + self.contact)
        return np.asarray(strain * (self.rubber + held * np.exp(-((strain / self.width) ** 2))))

    def moduli(self, pressure: float) -> Array:
        """The polynomial that this stress is, (order,) [Pa]."""
        strain = np.linspace(-0.45, 3.2, 400)
        powers = strain[:, None] ** np.arange(1, _ORDER + 1)
        scale = np.abs(powers).max(axis=0)
        found, *_ = np.linalg.lstsq(powers / scale, self.stress(strain, pressure), rcond=None)
        return np.asarray(found / scale)

    def force(self, pressure: float, contraction: Array) -> Array:
        """Mean of the two branches [N] at a gauge pressure [Pa] and contractions (n,)."""
        gas = self.muscle.gas_area(contraction)
        basis = self.muscle.elastic_basis(contraction)
        return np.asarray(pressure * gas + basis @ self.moduli(pressure))

    def contractions(self, pressure: float) -> Array:
        """From the longest state to where the force is gone, (100,)."""
        grid = np.linspace(0.0, 0.395, 400)
        gone = np.flatnonzero(self.force(pressure, grid) <= 0.0)
        last = grid[gone[0]] if gone.size else grid[-1]
        return np.linspace(EXTENSION, float(last), POINTS)

    def table(self) -> ForceMap:
        """The measured forces of all levels, friction averaged out."""
        rng = np.random.default_rng(self.seed)
        length, pressure, force = [], [], []
        for psi in LEVELS:
            e = self.contractions(psi * PSI)
            clean = self.force(psi * PSI, e)
            length.append(_nominal().parameters["rest_length"] * (1.0 - e))
            pressure.append(np.full(e.shape, psi * PSI))
            force.append(clean + rng.normal(0.0, self.noise * clean.max(), e.size))
        return _map(np.concatenate(length), np.concatenate(pressure), np.concatenate(force))

    def loops(self, presliding: float = 0.004) -> ForceMap:
        """Slow loops with friction: ``c_F`` of the text, reached ``presliding`` [1] of contraction
        after each reversal, as by elements that slip one after the other ([118] of the source).
        """
        rng = np.random.default_rng(self.seed + 1)
        columns: list[list[Array]] = [[], [], [], []]
        for psi in LEVELS:
            pressure = psi * PSI
            e = self.contractions(pressure)
            way = np.concatenate([np.full(e.size, -1.0), np.full(e.size, 1.0)])
            path = np.concatenate([e, e[::-1]])
            since = np.abs(path - np.where(way < 0.0, e[0], e[-1]))
            part = way * (1.0 - 2.0 * np.exp(-since / (presliding / 3.0)))
            share = max(0.16 - 0.145 * pressure / 1e6, 0.01)
            mean = self.force(pressure, path)
            force = mean + part * share * np.abs(mean)
            noise = rng.normal(0.0, self.noise * mean.max(), force.size)
            for column, values in zip(
                columns,
                (
                    _nominal().parameters["rest_length"] * (1.0 - path),
                    np.full(path.shape, pressure),
                    force + noise,
                    way,
                ),
                strict=True,
            ):
                column.append(values)
        length, pressures, force, way = (np.concatenate(column) for column in columns)
        return _map(length, pressures, force, way)


def _map(length: Array, pressure: Array, force: Array, direction: Array | None = None) -> ForceMap:
    return ForceMap.from_arrays(
        length=length,
        pressure=pressure,
        force=force,
        rest_length=float(_nominal().parameters["rest_length"]),
        direction=direction,
        check_duplicates=False,
    )


@cache
def _nominal() -> Muscle:
    """The muscle that the fits believe in: the captions' numbers, no friction."""
    return ch2_075in().replace(friction_coefficient=0.0, friction_pressure_slope=0.0)


@cache
def stand_in(number: int) -> StandIn:
    """One of the stand-ins.

    Parameters
    ----------
    number : int
        From 0 on; its numbers are drawn with it as the seed.

    Returns
    -------
    StandIn
    """
    rng = np.random.default_rng(2014 + number)
    own = _nominal()
    given = own.parameters
    shape = {
        "braid_angle": given["braid_angle"] + math.radians(rng.uniform(-0.2, 0.2)),
        "wall_thickness": given["wall_thickness"] * rng.uniform(0.97, 1.03),
        "k0": given["k0"] * rng.uniform(0.97, 1.03),
        "neck_floor": given["neck_floor"] + rng.uniform(-0.01, 0.01),
    }
    muscle = own.replace(**shape, modulus_slope=[0.0] * _ORDER, modulus_offset=[0.0] * _ORDER)
    return StandIn(
        muscle,
        rubber=1e6 * rng.uniform(0.9, 1.15),
        bond=rng.uniform(2.2, 3.0),
        contact=1e6 * rng.uniform(0.03, 0.12),
        width=rng.uniform(1.45, 1.75),
        noise=2e-3,
        seed=number,
    )


@dataclass(frozen=True, eq=False)
class Fits:
    """The fits of one stand-in.

    Attributes
    ----------
    table : ForceMap
        What was fitted.
    free : dict of str to MuscleFit
        Moduli of order 4 free at each level, by shape and wall: ``"constant"`` (2.8),
        ``"cylinder"`` (2.16) and ``"elliptic"``.
    linear : dict of int to MuscleFit
        Moduli linear in pressure over all levels, by order.
    three : MuscleFit
        Order 4 from the levels of :data:`THREE`.
    """

    table: ForceMap
    free: dict[str, MuscleFit]
    linear: dict[int, MuscleFit]
    three: MuscleFit

    def error(self, fit: MuscleFit) -> Array:
        """(2.37) of every level, by rising pressure [1]."""
        return np.asarray(fit.error_by_pressure().rms)

    def part(self, fit: MuscleFit, *, extended: bool) -> float:
        """Rms error over the map's largest force where the muscle is longer than at rest, or
        shorter [1].
        """
        rest = self.table.rest_length
        longer = self.table.length > rest
        rows = longer if extended else ~longer
        top = float(self.table.force.max())
        return float(np.sqrt(np.mean((fit.all_residuals[rows] / top) ** 2)))

    def blocked(self, fit: MuscleFit) -> Array:
        """Blocked force of the model over the measured one, by level [1]."""
        found = []
        for level, pressure in enumerate(self.table.levels):
            rows = self.table.level == level
            e = 1.0 - self.table.length[rows] / self.table.rest_length
            measured = float(np.interp(0.0, e, self.table.force[rows]))
            found.append(float(fit.muscle_at(float(pressure)).force(pressure, 0.0)) / measured)
        return np.array(found)


@cache
def fits(number: int) -> Fits:
    """The fits of one stand-in, or those that there are.

    Parameters
    ----------
    number : int
        As for :func:`stand_in`.

    Returns
    -------
    Fits
    """
    table, own = stand_in(number).table(), _nominal()

    def fit(**more: Any) -> MuscleFit:
        return fit_muscle(table, own, errors="plain", **more)

    free = {"order": 4, "moduli": "per_level"}
    return Fits(
        table,
        {
            "constant": fit(model="ferraresi", geometry="cylinder", **free),
            "cylinder": fit(model="kothera", geometry="cylinder", **free),
            "elliptic": fit(**free),
        },
        {order: fit(order=order) for order in ORDERS},
        fit(order=4, levels=[psi * PSI for psi in THREE]),
    )


@cache
def hysteresis(number: int) -> tuple[float, float, float]:
    """The friction (2.36) of a stand-in's loops.

    Parameters
    ----------
    number : int
        As for :func:`stand_in`.

    Returns
    -------
    coefficient, slope : float
        Of ``c_F`` [1] and [1/MPa].
    gain : float
        Rms error of the mean curve alone over that with the friction, the mean being known [1].
    """
    own = stand_in(number)
    loops = own.loops()
    found = fit_friction(loops)
    c0, c1 = (
        found.params[name].value for name in ("friction_coefficient", "friction_pressure_slope")
    )
    e = 1.0 - loops.length / loops.rest_length
    mean = np.zeros(e.shape)
    for psi in LEVELS:
        rows = np.isclose(loops.pressure, psi * PSI)
        mean[rows] = own.force(psi * PSI, e[rows])
    share = np.maximum(c0 + c1 * loops.pressure, 0.01)
    without = loops.force - mean
    left = without - loops.direction * share * np.abs(mean)
    return c0, c1 * 1e6, float(np.sqrt(np.mean(without**2) / np.mean(left**2)))
