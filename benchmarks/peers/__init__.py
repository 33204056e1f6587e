"""The shoulder as a competent user would write it with other tools, and what all of them are given.

Each module beside this one has the same equations: tank, servo-valve, muscles, tendon joint and
one-link arm with stops. The numbers come from the packaged rig. The braid is solved beforehand: the
force of a muscle is ``P A(e) + B(e)``, and ``A``, ``B`` and the air volume are cubic splines of the
contraction ratio ``e``, which is what anybody would do who has to be fast.
"""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

import pamrs

__all__ = ["PEERS", "Shoulder", "installed", "opening", "shoulder", "wave"]

Array = NDArray[np.float64]

#: Modules of this package, in the order of the page.
PEERS = ("shoulder_numba", "shoulder_jax", "shoulder_scipy")
SAMPLE_TIME = 0.005  # s
STEPS = 5  # RK4 steps in a sample
CELLS = 256  # of the table in contraction
BELOW = 16  # and in extension, where the lower stop gives way
LAMINAR = 0.999  # ratio of pressures above which the flow is linear


class Shoulder(NamedTuple):
    """Numbers of the shoulder, SI units; a tuple of floats, which compilers take well."""

    ambient: float
    rt: float
    gamma: float
    flow_factor: float
    critical: float
    psi_choked: float
    psi_laminar: float
    supply_volume: float
    dead_volume: float
    alpha_in: float
    alpha_out: float
    alpha: float
    muscles: float
    rest_length: float
    upper_axial: float
    upper_offset: float
    lower_angle: float
    lower_radius: float
    tendon_squared: float
    min_angle: float
    max_angle: float
    stop_stiffness: float
    stop_damping: float
    inertia: float
    first_moment: float
    length: float
    viscous: float
    coulomb: float
    coulomb_speed: float
    gravity: float
    table_start: float
    table_per_unit: float


def packaged() -> pamrs.Rig:
    """The packaged shoulder with muscles that push: the peers have no slack ones."""
    return pamrs.rigs.shoulder().with_parameters({"muscle.buckling_load": 1e9})


def shoulder(rig: pamrs.Rig) -> tuple[Shoulder, Array, Array]:
    """Everything that a peer needs.

    Parameters
    ----------
    rig : pamrs.Rig
        The packaged shoulder.

    Returns
    -------
    numbers : Shoulder
    table : ndarray, shape (cells, 4, 3)
        Powers 0 to 3 of the distance from a cell's start, in cells, of ``A``, ``B`` and volume.
    start : ndarray, shape (4,)
        Pressure of the muscles and of the tank [Pa, absolute], angle [rad] and rate [rad/s].
    """
    m = rig.model
    air, joint, arm, chamber = m["gas"], m["joint"], m["arm"], m["chamber"]
    rt = air["gas_constant"] * air["temperature"]
    gamma, ambient = air["heat_capacity_ratio"], air["ambient_pressure"]
    root = LAMINAR ** (1.0 / gamma)
    lower_angle = np.arctan2(joint["lower_offset"], joint["lower_axial"])
    lower_radius = np.hypot(joint["lower_offset"], joint["lower_axial"])
    phi = np.pi - joint["rest_angle"] - lower_angle
    gaps = (
        joint["upper_axial"] - lower_radius * np.cos(phi),
        joint["upper_offset"] - lower_radius * np.sin(phi),
    )
    first, per_unit, table = muscle_table(rig)
    numbers = Shoulder(
        ambient=ambient,
        rt=rt,
        gamma=gamma,
        flow_factor=(2.0 / rt) ** 0.5,
        critical=(2.0 / (gamma + 1.0)) ** (gamma / (gamma - 1.0)),
        psi_choked=(2.0 / (gamma + 1.0)) ** (1.0 / (gamma - 1.0)) * (gamma / (gamma + 1.0)) ** 0.5,
        psi_laminar=(root * (root - LAMINAR) * gamma / (gamma - 1.0)) ** 0.5,
        supply_volume=m["supply"]["volume"],
        **{name: chamber[name] for name in ("dead_volume", "alpha_in", "alpha_out", "alpha")},
        muscles=float(m["muscle"]["count"]),
        rest_length=m["muscle"]["rest_length"],
        upper_axial=joint["upper_axial"],
        upper_offset=joint["upper_offset"],
        lower_angle=float(lower_angle),
        lower_radius=float(lower_radius),
        tendon_squared=float(gaps[0] ** 2 + gaps[1] ** 2),
        **{n: joint[n] for n in ("min_angle", "max_angle", "stop_stiffness", "stop_damping")},
        **{n: arm[n] for n in ("inertia", "first_moment", "length", "viscous", "coulomb")},
        **{n: arm[n] for n in ("coulomb_speed", "gravity")},
        table_start=first,
        table_per_unit=per_unit,
    )
    tank = m["supply"]["initial_pressure"] + ambient
    return numbers, table, np.array([ambient, tank, joint["rest_angle"], 0.0])


def muscle_table(rig: pamrs.Rig) -> tuple[float, float, Array]:
    """Start [1], cells per unit of contraction, and the splines; a knot lies on the kink at 0."""
    muscle, joint = rig.muscle, pamrs.Joint.from_model(rig.model["joint"])
    if muscle is None:
        raise ValueError("the rig has no muscle")
    stroke = joint.shortening(rig.model["joint"]["max_angle"]) / rig.model["muscle"]["rest_length"]
    width = 1.03 * float(stroke) / CELLS
    pieces = []
    for knots in (width * np.arange(-BELOW, 1), width * np.arange(CELLS + 1)):
        still = muscle.force(0.0, knots)
        slope = (muscle.force(1e5, knots) - still) / 1e5
        columns = np.stack([slope, still, muscle.air_volume(knots)])
        powers = CubicSpline(knots, columns, axis=1).c[::-1]  # power, cell, column
        pieces.append(powers.transpose(1, 0, 2) * width ** np.arange(4.0)[None, :, None])
    return -BELOW * width, 1.0 / width, np.ascontiguousarray(np.concatenate(pieces))


def opening(rig: pamrs.Rig, command: Array) -> Array:
    """Discharge area of the valve for each command [m2]: positive fills, negative vents."""
    valve = rig.model["valve"]
    spool = np.clip((command - valve["null_voltage"]) / valve["half_range"], -1.0, 1.0)
    area = np.interp(np.abs(spool), valve["opening"], valve["fraction"])
    return np.asarray(np.sign(spool) * area * valve["discharge_area_max"])


def wave(samples: int) -> Array:
    """The commands of every benchmark [V]: a sine about the middle of the valve."""
    return np.asarray(5.0 + 1.5 * np.sin(2.0 * np.pi * 0.8 * SAMPLE_TIME * np.arange(samples)))


def installed(name: str) -> ModuleType | str:
    """A peer's module, or why it cannot be had."""
    try:
        return importlib.import_module(f"{__name__}.{name}")
    except ImportError as error:
        return f"not installed: {error.name or error}"
