"""Muscle sizing as in dissertation 3.2.3: candidates compared for one force/stroke requirement.

Each candidate is counted until the bundle meets the requirement, and compared by mass, packed
volume, air, filling time, specific force, and the force that is left when one muscle fails.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from pamrs import _core
from pamrs._arrays import Array
from pamrs._checks import one_of, positive, whole
from pamrs.errors import ParameterError
from pamrs.library import Entry, entry
from pamrs.rig import Muscle
from pamrs.units import from_si

_HEAT_CAPACITY_RATIO: Final = 1.4
_CHOKED: Final = (2.0 / (_HEAT_CAPACITY_RATIO + 1.0)) ** (
    _HEAT_CAPACITY_RATIO / (_HEAT_CAPACITY_RATIO - 1.0)
)
_LAMINAR: Final = 0.999  # the orifice law changes its form at these two ratios


@dataclass(frozen=True)
class Filling:
    """Supply of the air: a constant pressure behind one valve, isothermal.

    Parameters
    ----------
    area : float
        Effective orifice area ``Cd A`` [m2]; the default is the shoulder's valve.
    supply_pressure : float
        Gauge pressure of the supply [Pa].
    dead_volume : float
        Volume of the tubing, filled with every stroke [m3].
    ambient_pressure, temperature, gas_constant : float
        Ambient pressure [Pa, absolute], temperature [K], gas constant [J/(kg K)].

    Raises
    ------
    ParameterError
        If a number is not finite and above zero (the dead volume may be zero).
    """

    area: float = 8.4e-6
    supply_pressure: float = 13.8e5
    dead_volume: float = 0.0
    ambient_pressure: float = 101325.0
    temperature: float = 293.15
    gas_constant: float = 287.05

    def __post_init__(self) -> None:
        for name in ("area", "supply_pressure", "ambient_pressure", "temperature", "gas_constant"):
            positive(name, getattr(self, name))
        positive("dead_volume", self.dead_volume, zero=True)

    @classmethod
    def from_sonic_conductance(cls, conductance: float, **others: float) -> Filling:
        """Make a supply from the sonic conductance of ISO 6358 [m3/(s Pa)], reference air of 1.185
        kg/m3 (1 bar, 20 degC, 65 %).

        Parameters
        ----------
        conductance : float
            ``C``, such that the choked mass flow is ``C rho_0 p``.
        **others : float
            The other parameters.
        """
        positive("conductance", conductance)
        return cls(area=cls(**others)._gas.area_of_conductance(conductance), **others)

    @property
    def _gas(self) -> _core.Gas:
        return _core.Gas(
            self.ambient_pressure, self.temperature, self.gas_constant, _HEAT_CAPACITY_RATIO
        )

    def time(self, volume: float, pressure: float) -> float:
        """Time to fill a constant volume from ambient to a gauge pressure [s].

        Parameters
        ----------
        volume : float
            Air volume [m3], without the dead volume.
        pressure : float
            Gauge pressure [Pa], below the supply's.

        Returns
        -------
        float
            ``(V / (R T)) integral dp / mdot(p)``, the orifice law of the rigs with a constant
            supply.

        Raises
        ------
        ParameterError
            If the pressure is not below the supply's, or a number is not allowed.
        """
        positive("volume", volume)
        positive("pressure", pressure)
        if pressure >= self.supply_pressure:
            raise ParameterError(
                f"pressure = {pressure:g} Pa is not below the supply's {self.supply_pressure:g} Pa"
            )
        supply = self.supply_pressure + self.ambient_pressure
        start, end = self.ambient_pressure / supply, (self.ambient_pressure + pressure) / supply
        # 1/mdot has an integrable infinity near r = 1, so even steps in log(1 - r)
        edges = np.unique(np.clip([start, _CHOKED, _LAMINAR, end], start, end))
        total = 0.0
        nodes, weights = np.polynomial.legendre.leggauss(32)
        for low, high in zip(edges[:-1], edges[1:], strict=True):
            near, far = math.log1p(-low), math.log1p(-high)
            gap = np.exp(0.5 * (near + far) + 0.5 * (far - near) * nodes)
            flow = self._gas.mass_flow(self.area, supply, supply * (1.0 - gap))
            total += 0.5 * (near - far) * float(weights @ (supply * gap / flow))
        return (volume + self.dead_volume) * total / (self.gas_constant * self.temperature)

    def energy(self, rest_volume: float, end_volume: float, pressure: float) -> float:
        """Energy taken from the tank for one stroke [J]: ``mass R T``, as the tank's
        ``(P_initial - P_final) V`` (ch. 6).

        Parameters
        ----------
        rest_volume, end_volume : float
            Air volume before and after [m3], without the dead volume.
        pressure : float
            Gauge pressure after [Pa].
        """
        end = (pressure + self.ambient_pressure) * (end_volume + self.dead_volume)
        return end - self.ambient_pressure * (rest_volume + self.dead_volume)


__all__ = [
    "Candidate",
    "Filling",
    "Requirement",
    "SizingResult",
    "free_contraction",
    "packed_diameter",
    "size",
]


_LEAST_WORKING_PRESSURE: Final = 2e3  # [Pa], below which a working pressure is a mistake of unit
_RULES: Final[dict[str, tuple[str, bool]]] = {  # criterion: (key, larger is better)
    "count": ("count", False),
    "mass": ("mass", False),
    "packed volume at rest": ("packed_volume_rest", False),
    "packed volume inflated": ("packed_volume_full", False),
    "air volume at rest": ("air_volume_rest", False),
    "air volume inflated": ("air_volume_full", False),
    "energy per stroke": ("energy_per_stroke", False),
    "response": ("fill_time_full", False),
    "specific force": ("specific_force", True),
    "redundancy": ("share_left", True),
}


@dataclass(frozen=True)
class Candidate:
    """One muscle to be considered.

    Parameters
    ----------
    name : str
        What to call it.
    muscle : Muscle
        Geometry and force of one muscle.
    pressure : float
        Working gauge pressure [Pa].
    mass : float, optional
        Mass of one muscle [kg]; None where it is not known.
    count : int, optional
        Muscles in the bundle; None finds the smallest number that is enough.

    Raises
    ------
    ParameterError
        If the pressure or mass is not a finite number above zero, or the count not a whole number
        from 1 on.
    """

    name: str
    muscle: Muscle
    pressure: float
    mass: float | None = None
    count: int | None = None

    def __post_init__(self) -> None:
        positive("pressure", self.pressure)
        if self.mass is not None:
            positive("mass", self.mass)
        if self.count is not None:
            whole("count", self.count, 1)

    @classmethod
    def from_library(
        cls, item: str | Entry, *, pressure: float | None = None, count: int | None = None
    ) -> Candidate:
        """A muscle of :mod:`pamrs.library`; by default at the highest pressure of its tests.

        Parameters
        ----------
        item : str or Entry
            Muscle.
        pressure : float, optional
            Working gauge pressure [Pa].
        count : int, optional
            Muscles in the bundle.
        """
        known = entry(item) if isinstance(item, str) else item
        return cls(
            known.name,
            known.muscle,
            known.max_pressure if pressure is None else pressure,
            known.mass,
            count,
        )


@dataclass(frozen=True)
class Requirement:
    """Force that the bundle must pull, over the stroke.

    Parameters
    ----------
    points : sequence of (position, force)
        Positions from zero on, in increasing order, and the total force wanted there [N], not below
        zero. A blocked force alone is ``[(0.0, force)]``.
    position : {"stroke", "contraction"}
        Whether positions are strokes [m], the same for every candidate, or contractions of each
        candidate's own length [1].

    Raises
    ------
    ParameterError
        If there is no point, a number is not finite or negative, positions do not increase, or no
        force is wanted at all.
    """

    points: Sequence[tuple[float, float]]
    position: str = "stroke"

    def __post_init__(self) -> None:
        one_of("position", self.position, ("stroke", "contraction"))
        values = np.asarray(self.points, dtype=np.float64)
        if values.ndim != 2 or values.shape[1:] != (2,) or values.shape[0] == 0:
            raise ParameterError(
                f"points has shape {values.shape}: pairs of (position, force) are needed"
            )
        if not np.all(np.isfinite(values)) or np.any(values < 0.0):
            raise ParameterError("points must hold finite positions and forces, none below zero")
        if np.any(np.diff(values[:, 0]) <= 0.0):
            raise ParameterError("points: positions must increase")
        if not np.any(values[:, 1] > 0.0):
            raise ParameterError("points: no force is wanted anywhere")

    @property
    def array(self) -> Array:
        """Positions and forces, (n, 2)."""
        return np.asarray(self.points, dtype=np.float64)

    def contraction(self, rest_length: float) -> Array:
        """Contractions of a muscle of this rest length at the points [1], (n,)."""
        return self.array[:, 0] / (rest_length if self.position == "stroke" else 1.0)


def packed_diameter(count: int, diameter: float, core: float = 0.0) -> float:
    """Diameter of the circle around ``count`` equal circles on one ring around the arm's centre
    [m].

    Parameters
    ----------
    count : int
        Circles, from 1 on; a single one sits in the middle unless there is a core.
    diameter : float
        Of one circle [m].
    core : float
        Diameter kept free in the middle, for the arm's structure [m].

    Returns
    -------
    float

    Raises
    ------
    ParameterError
        If the count is no whole number from 1 on or a length is not allowed.
    """
    whole("count", count, 1)
    positive("diameter", diameter)
    positive("core", core, zero=True)
    touching = diameter / math.sin(math.pi / count) if count > 1 else 0.0
    around = core + diameter if core > 0.0 else 0.0
    return max(touching, around) + diameter


def free_contraction(muscle: Muscle, pressure: float) -> float:
    """Contraction at which the unloaded muscle comes to rest [1].

    Parameters
    ----------
    muscle : Muscle
        The muscle.
    pressure : float
        Gauge pressure [Pa], above zero.

    Returns
    -------
    float
        The smallest contraction at which the force is zero, or the braid's limit where the force
        still pulls there.

    Raises
    ------
    ParameterError
        If the pressure is not finite and positive.
    """
    from scipy.optimize import brentq

    positive("pressure", pressure)
    limit = muscle.contraction_limits[1]
    grid = np.linspace(0.0, limit, 401)
    pushing = np.flatnonzero(muscle.force(pressure, grid) <= 0.0)
    if pushing.size == 0:
        return float(limit)
    first = int(pushing[0])
    if first == 0:
        return 0.0
    low, high = float(grid[first - 1]), float(grid[first])
    found = brentq(lambda e: float(muscle.force(pressure, e)), low, high, xtol=1e-16, rtol=1e-14)
    return float(found)


@dataclass(frozen=True)
class SizingResult:
    """Candidates compared.

    Attributes
    ----------
    rows : list of dict
        One per feasible candidate, in the order given; SI units. Keys: name, count, pressure, mass,
        force_margin, packed_diameter_rest, packed_diameter_full, packed_volume_rest,
        packed_volume_full, air_volume_rest, air_volume_end, air_volume_full, air_mass_per_stroke,
        energy_per_stroke, fill_time_rest, fill_time_full, blocked_force, specific_force,
        share_left, margin_left. None where a mass is not known. ``full`` is the free contraction at
        the working pressure, ``end`` the last point of the requirement; ``share_left`` is the part
        of the force that is left when one muscle fails, ``margin_left`` that force over the
        required one (1 or more still meets it).
    infeasible : dict
        Name to reason, for every other candidate.
    best : dict
        Criterion to the name of the best feasible candidate; None where there is none.
    """

    rows: list[dict[str, Any]]
    infeasible: dict[str, str]
    best: dict[str, str | None] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "best", {rule: self._best(*how) for rule, how in _RULES.items()})

    def _best(self, key: str, larger: bool) -> str | None:
        known = [row for row in self.rows if row[key] is not None]
        if not known:
            return None
        return str((max if larger else min)(known, key=lambda row: row[key])["name"])

    def row(self, name: str) -> dict[str, Any]:
        """The row of one feasible candidate.

        Raises
        ------
        ParameterError
            If there is none of that name.
        """
        for row in self.rows:
            if row["name"] == name:
                return row
        reason = self.infeasible.get(name, "it is no candidate")
        raise ParameterError(f"name = {name!r} has no row: {reason}")

    def to_dict(self) -> dict[str, Any]:
        """Rows, reasons and bests as plain data."""
        return {"rows": self.rows, "infeasible": self.infeasible, "best": self.best}

    def table(self) -> str:
        """The comparison as text: one column per candidate, the best of each line marked with a
        star.
        """
        width = max([14, *(len(row["name"]) + 2 for row in self.rows)])
        lines = (
            ["".ljust(30) + "".join(str(row["name"]).rjust(width) for row in self.rows)]
            if self.rows
            else []
        )
        winners = {key: self.best[rule] for rule, (key, _) in _RULES.items()}
        for label, key, unit in _LINES if self.rows else ():
            line = label.ljust(30)
            for row in self.rows:
                value = row[key]
                shown = from_si(value, *unit) if unit and value is not None else value
                text = "-" if shown is None else f"{shown:.4g}"
                line += (text + (" *" if winners.get(key) == row["name"] else "  ")).rjust(width)
            lines.append(line.rstrip())
        lines += [f"{name}: not feasible: {reason}" for name, reason in self.infeasible.items()]
        return "\n".join(lines)


_LINES: Final[tuple[tuple[str, str, tuple[str, str] | None], ...]] = (
    ("count", "count", None),
    ("pressure [bar]", "pressure", ("bar", "pressure")),
    ("mass [kg]", "mass", None),
    ("force / required", "force_margin", None),
    ("packed diameter, rest [mm]", "packed_diameter_rest", ("mm", "length")),
    ("packed diameter, inflated [mm]", "packed_diameter_full", ("mm", "length")),
    ("packed volume, rest [l]", "packed_volume_rest", ("l", "volume")),
    ("packed volume, inflated [l]", "packed_volume_full", ("l", "volume")),
    ("air volume, rest [l]", "air_volume_rest", ("l", "volume")),
    ("air volume, inflated [l]", "air_volume_full", ("l", "volume")),
    ("air per stroke [g]", "air_mass_per_stroke", ("g", "mass")),
    ("energy per stroke [J]", "energy_per_stroke", None),
    ("fill time, rest volume [s]", "fill_time_rest", None),
    ("fill time, inflated [s]", "fill_time_full", None),
    ("blocked force [N]", "blocked_force", None),
    ("specific force [N/kg]", "specific_force", None),
    ("force left, one failed", "share_left", None),
    ("that / required", "margin_left", None),
)


def size(
    candidates: Iterable[Candidate | Entry | str],
    requirement: Requirement,
    *,
    filling: Filling | None = None,
    core: float = 0.0,
    max_count: int = 100,
) -> SizingResult:
    """Compare candidate muscles for one requirement (dissertation 3.2.3).

    Parameters
    ----------
    candidates : iterable of Candidate, Entry or str
        Entries and names of :mod:`pamrs.library` work at the highest pressure of their tests.
    requirement : Requirement
        Force wanted over the stroke.
    filling : Filling, optional
        Supply and valve; the shoulder's by default.
    core : float
        Diameter kept free in the middle of the bundle [m].
    max_count : int
        Largest bundle considered.

    Returns
    -------
    SizingResult
        A candidate that cannot meet the requirement is listed with the reason.

    Raises
    ------
    ParameterError
        If there is no candidate, two have the same name, or an argument is not allowed.

    Examples
    --------
    >>> from pamrs.design.sizing import Requirement, size
    >>> result = size(["elbow_0625in", "large_2in_effective"],
    ...     Requirement([(0.0, 18e3), (0.03, 7e3)]))
    >>> [(row["name"], row["count"]) for row in result.rows]
    [('elbow_0625in', 6), ('large_2in_effective', 1)]
    """
    whole("max_count", max_count, 1)
    positive("core", core, zero=True)
    chosen = [
        item if isinstance(item, Candidate) else Candidate.from_library(item) for item in candidates
    ]
    if not chosen:
        raise ParameterError("candidates is empty: at least one is needed")
    seen = [candidate.name for candidate in chosen]
    twice = sorted({name for name in seen if seen.count(name) > 1})
    if twice:
        raise ParameterError(f"candidates: the name {twice[0]!r} is used twice")
    supply = filling or Filling()
    rows: list[dict[str, Any]] = []
    infeasible: dict[str, str] = {}
    for candidate in chosen:
        try:
            count, reason = _count(candidate, requirement, supply, max_count)
            if not reason:
                rows.append(_row(candidate, count, requirement, supply, core))
        except ParameterError as error:
            # its geometry has no solution at a length that is asked for
            reason = str(error)
        if reason:
            hint = ""
            if candidate.pressure < _LEAST_WORKING_PRESSURE:
                hint = f" (its pressure is {candidate.pressure:g} Pa: were bar meant?)"
            infeasible[candidate.name] = reason + hint
    return SizingResult(rows, infeasible)


def _count(
    candidate: Candidate, requirement: Requirement, filling: Filling, max_count: int
) -> tuple[int, str]:
    """Smallest count that is enough, or the reason why none is."""
    muscle = candidate.muscle
    if candidate.pressure >= filling.supply_pressure:
        supply = f"the supply's {filling.supply_pressure:g} Pa"
        return 0, f"its pressure of {candidate.pressure:g} Pa is not below {supply}"
    contraction = requirement.contraction(muscle.parameters["rest_length"])
    limit = muscle.contraction_limits[1]
    if contraction[-1] > limit:
        beyond = f"beyond the braid's limit {limit:.3f}"
        return 0, f"it would contract by {contraction[-1]:.3f}, {beyond}"
    wanted = requirement.array[:, 1]
    one = muscle.force(candidate.pressure, contraction)
    weak = np.flatnonzero((one <= 0.0) & (wanted > 0.0))
    if weak.size:
        at = int(weak[0])
        weakest = f"at a contraction of {contraction[at]:.3f} one muscle gives {one[at]:.1f} N"
        return 0, f"{weakest}: no number is enough"
    asked = wanted > 0.0
    needed = max(1, math.ceil(float(np.max(wanted[asked] / one[asked])) * (1.0 - 1e-12)))
    if candidate.count is not None and needed > candidate.count:
        return 0, f"{needed} are needed, {candidate.count} are given"
    if needed > max_count:
        return 0, f"{needed} are needed, at most {max_count} are considered"
    return candidate.count or needed, ""


def _row(
    candidate: Candidate, count: int, requirement: Requirement, filling: Filling, core: float
) -> dict[str, Any]:
    """Every figure of one feasible candidate, SI units."""
    muscle, pressure = candidate.muscle, candidate.pressure
    rest_length = float(muscle.parameters["rest_length"])
    contraction, wanted = requirement.contraction(rest_length), requirement.array[:, 1]
    asked = wanted > 0.0
    margin = count * float(np.min(muscle.force(pressure, contraction[asked]) / wanted[asked]))
    full = max(free_contraction(muscle, pressure), float(contraction[-1]))
    rest, end, inflated = (
        count * float(v) for v in muscle.air_volume([0.0, float(contraction[-1]), full])
    )
    bounds = [packed_diameter(count, 2.0 * float(muscle.radius(e)), core) for e in (0.0, full)]
    lengths = (rest_length, rest_length * (1.0 - full))
    energy = filling.energy(rest, end, pressure)
    mass = None if candidate.mass is None else count * candidate.mass
    blocked = count * float(muscle.force(pressure, 0.0))
    return {
        "name": candidate.name,
        "count": count,
        "pressure": pressure,
        "mass": mass,
        "force_margin": margin,
        "packed_diameter_rest": bounds[0],
        "packed_diameter_full": bounds[1],
        "packed_volume_rest": 0.25 * math.pi * bounds[0] ** 2 * lengths[0],
        "packed_volume_full": 0.25 * math.pi * bounds[1] ** 2 * lengths[1],
        "air_volume_rest": rest,
        "air_volume_end": end,
        "air_volume_full": inflated,
        "air_mass_per_stroke": energy / (filling.gas_constant * filling.temperature),
        "energy_per_stroke": energy,
        "fill_time_rest": filling.time(rest, pressure),
        "fill_time_full": filling.time(inflated, pressure),
        "blocked_force": blocked,
        "specific_force": None if mass is None else blocked / mass,
        "share_left": (count - 1) / count,
        "margin_left": margin * (count - 1) / count,
    }
