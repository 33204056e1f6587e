"""The quantities that published facts are about, computed from a muscle."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from pamrs.design.sizing import free_contraction
from pamrs.errors import ParameterError

if TYPE_CHECKING:
    from pamrs.library import Entry
    from pamrs.rig import Muscle

__all__ = ["KINDS", "activation_pressure", "polynomial", "root_between"]

At = dict[str, float]

#: Free contraction that counts as "contraction begins" [1].
BEGINS: Final = 0.01


def root_between(function: Callable[[float], float], low: float, high: float) -> float | None:
    """Where ``function`` changes sign between ``low`` and ``high``, to round-off; None where the
    ends have the same sign.
    """
    from scipy.optimize import brentq

    if function(low) * function(high) > 0.0:
        return None
    return float(brentq(function, low, high, xtol=1e-16, rtol=1e-14))


def activation_pressure(muscle: Muscle, contraction: float = BEGINS) -> float:
    """Pressure at which the free muscle has contracted by ``contraction`` [Pa]: zero of a force
    linear in pressure.
    """
    at_zero, at_bar = (float(muscle.force(pressure, contraction)) for pressure in (0.0, 1e5))
    return -at_zero * 1e5 / (at_bar - at_zero)


def polynomial(muscle: Muscle, pressure: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Moduli ``E_k = m_k P + b_k`` of orders 1, 2, ... at a gauge pressure [Pa]."""
    parameters = muscle.parameters
    slope, offset = (
        np.asarray(parameters[f"modulus_{key}"], dtype=np.float64) for key in ("slope", "offset")
    )
    return slope * pressure + offset


def _free_hoop_strain(muscle: Muscle, pressure: float) -> float:
    return float(muscle.circumferential_strain(free_contraction(muscle, pressure)))


def _angle_for_force(muscle: Muscle, pressure: float, force: float) -> float:
    """Braid angle [rad] at which the muscle has a given blocked force."""

    def excess(angle: float) -> float:
        return float(muscle.replace(braid_angle=angle).force(pressure, 0.0)) - force

    found = root_between(excess, math.radians(45.0), math.radians(85.0))
    if found is None:
        raise ParameterError(
            f"no braid angle between 45 and 85 deg gives a blocked force of {force:g} N at "
            f"{pressure:g} Pa"
        )
    return found


def _angle_for_diameter(muscle: Muscle, contraction: float, diameter: float) -> float:
    """Braid angle [rad] at which a cylinder has a given diameter: D/D0 = tan(alpha)
    sqrt(1/sin(alpha)^2 - (1 - e)^2).
    """
    ratio = diameter / float(muscle.parameters["rest_diameter"])
    return math.asin(math.sqrt((ratio**2 - 1.0) / (ratio**2 - (1.0 - contraction) ** 2)))


def _wall_for_force(muscle: Muscle, pressure: float, force: float) -> float:

    def excess(wall: float) -> float:
        return float(muscle.replace(wall_thickness=wall).force(pressure, 0.0)) - force

    found = root_between(excess, 1e-7, 0.45 * float(muscle.parameters["rest_diameter"]))
    if found is None:
        raise ParameterError(f"no wall gives a blocked force of {force:g} N")
    return found


def _closing_extension(muscle: Muscle, wall: float | None = None) -> float:
    """Extension [m] at which a cylinder of the braid is as thin as the solid bladder."""
    rest, fibre, turns = float(muscle.parameters["rest_length"]), muscle.fibre_length, muscle.turns
    radius = 0.5 * float(muscle.parameters["rest_diameter"])
    thickness = muscle.parameters["wall_thickness"] if wall is None else wall
    rubber = (radius**2 - (radius - thickness) ** 2) * rest

    def room(length: float) -> float:
        return (fibre**2 - length**2) / (2.0 * math.pi * turns) ** 2 - rubber / length

    found = root_between(room, rest, fibre)
    return math.inf if found is None else found - rest


def _wall_from_closing(muscle: Muscle, extension: float) -> float:
    top = 0.99 * 0.5 * muscle.parameters["rest_diameter"]
    found = root_between(lambda wall: _closing_extension(muscle, wall) - extension, 1e-6, top)
    if found is None:
        raise ParameterError(f"no wall closes the cylinder at an extension of {extension:g} m")
    return found


def _smallest_radius(muscle: Muscle) -> float:
    return float(np.min(muscle.radius(np.linspace(muscle.contraction_limits[0], 0.0, 201))))


def _rubber_nonlinearity(muscle: Muscle, strain: float) -> float:
    moduli = polynomial(muscle, 0.0)
    stress = sum(value * strain ** (k + 1) for k, value in enumerate(moduli))
    return float(abs(stress / (moduli[0] * strain) - 1.0))


def _softening_strain(muscle: Muscle, pressure: float) -> float:
    """Smallest strain at which the tangent modulus vanishes; infinite where it never does."""
    tangent = [(k + 1) * value for k, value in enumerate(polynomial(muscle, pressure))]
    roots = np.roots(tangent[::-1])
    real = roots[(abs(roots.imag) < 1e-12) & (roots.real > 0.0)].real
    return float(real.min()) if real.size else math.inf


def _friction(muscle: Muscle, pressure: float) -> float:
    back, forth = (float(muscle.force(pressure, 0.0, direction=way)) for way in (1.0, -1.0))
    return (back - forth) / (back + forth)


def _dual_loss(muscle: Muscle, pressure: float, contraction: float) -> float:
    """(One muscle at 2P less two at P) over the one's blocked force [1]; same air for both
    (6.2).
    """
    single = float(muscle.force(2.0 * pressure, contraction))
    pair = 2.0 * float(muscle.force(pressure, contraction))
    return (single - pair) / float(muscle.force(2.0 * pressure, 0.0))


def _dual_free_gain(muscle: Muscle, pressure: float) -> float:
    return free_contraction(muscle, 2.0 * pressure) - free_contraction(muscle, pressure)


def _muscle_a() -> Muscle:
    from pamrs.library import pam_a_1in

    return pam_a_1in()


def _loss_ratio_rubber(muscle: Muscle, at: At) -> float:
    other = _muscle_a()
    rubber = {key: muscle.parameters[key] for key in ("modulus_slope", "modulus_offset")}
    return _dual_loss(other.replace(**rubber), **at) / _dual_loss(other, **at)


#: What each kind of fact compares: entry and conditions (SI) to a value in SI units.
KINDS: Final[dict[str, Callable[[Entry, At], float]]] = {
    "turns": lambda entry, at: entry.muscle.turns,
    "fibre_length": lambda entry, at: entry.muscle.fibre_length,
    "braid_angle": lambda entry, at: float(entry.parameters["braid_angle"]),
    "blocked_force": lambda entry, at: float(entry.muscle.force(at["pressure"], 0.0)),
    "gaylord_force": lambda entry, at: float(
        entry.muscle.replace(model="gaylord").force(at["pressure"], 0.0)
    ),
    "angle_for_force": lambda entry, at: _angle_for_force(entry.muscle, **at),
    "angle_for_diameter": lambda entry, at: _angle_for_diameter(entry.muscle, **at),
    "wall_for_force": lambda entry, at: _wall_for_force(entry.muscle, **at),
    "free_length": lambda entry, at: 1.0 - free_contraction(entry.muscle, at["pressure"]),
    "diameter": lambda entry, at: 2.0 * float(entry.muscle.radius(at["contraction"])),
    "published_ratio": lambda entry, at: at["force"] / at["mass"],
    "specific_force": lambda entry, at: (
        float(entry.muscle.force(at["pressure"], 0.0)) / (entry.mass or math.nan)
    ),
    "activation": lambda entry, at: activation_pressure(entry.muscle),
    "blocked_deadband": lambda entry, at: activation_pressure(entry.muscle, 0.0),
    "rubber_nonlinearity": lambda entry, at: _rubber_nonlinearity(entry.muscle, at["strain"]),
    "softening_strain": lambda entry, at: _softening_strain(entry.muscle, at["pressure"]),
    "hoop_strain_free": lambda entry, at: _free_hoop_strain(entry.muscle, **at),
    "smallest_radius": lambda entry, at: _smallest_radius(entry.muscle),
    "closing_extension": lambda entry, at: _closing_extension(entry.muscle),
    "wall_from_closing": lambda entry, at: _wall_from_closing(entry.muscle, **at),
    "friction": lambda entry, at: _friction(entry.muscle, at["pressure"]),
    "dual_loss": lambda entry, at: _dual_loss(entry.muscle, **at),
    "dual_free_gain": lambda entry, at: _dual_free_gain(entry.muscle, **at),
    "offset_share_hiding_loss": lambda entry, at: (
        at["visible"] / _dual_loss(entry.muscle, at["pressure"], at["contraction"])
    ),
    "loss_ratio_to_a": lambda entry, at: (
        _dual_loss(entry.muscle, **at) / _dual_loss(_muscle_a(), **at)
    ),
    "loss_ratio_rubber": lambda entry, at: _loss_ratio_rubber(entry.muscle, at),
}
