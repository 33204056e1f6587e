"""Gaylord's force on a constant arm: the educated guess of chapter 5, where a network begins."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.interpolate import CubicSpline

from pamrs.control import Value
from pamrs.rig import Rig

_INCH: Final = 0.0254
#: Even places of the table over the joint's range.
_NODES: Final = 1025
#: Of the largest C1: below it a pressure says nothing about the torque.
_LEAST_SLOPE: Final = 0.01


class GaylordTorque:
    """The educated guess of (5.25): Gaylord's force on a constant arm,
    ``C1 = n (3 L^2 - B^2)/(4 pi N^2) r_eff``, ``C2 = 0``.

    The length is linear in the angle, ``L = L0 - r_eff (theta - theta_0)``. As printed, L = 5 in
    with B = 11.23 in, the force would be negative (3 L^2 < B^2): the muscle's own rest length is
    taken, and its own B and N, which for the shoulder are 11.33 in and 1.02.

    Parameters
    ----------
    rig : Rig
        With one muscle on one joint.
    effective_radius : float
        ``r_eff`` [m]; 0.7 in as printed.
    """

    def __init__(self, rig: Rig, effective_radius: float = 0.7 * _INCH) -> None:
        muscle, joint = rig.muscle, next(iter(rig.tables("joint").values()))
        assert muscle is not None
        self.low, self.high = float(joint["min_angle"]), float(joint["max_angle"])
        angle = np.linspace(self.low, self.high, _NODES)
        contraction = np.minimum(
            effective_radius
            * (angle - float(joint["rest_angle"]))
            / float(muscle.parameters["rest_length"]),
            muscle.contraction_limits[1],
        )
        area = muscle.replace(model="gaylord").gas_area(contraction)
        slope = int(muscle.parameters["count"]) * area * effective_radius
        self._step = (self.high - self.low) / (_NODES - 1)
        self._cells = np.ascontiguousarray(
            CubicSpline(
                np.arange(_NODES) * self._step, np.maximum(slope, _LEAST_SLOPE * slope.max())
            ).c.T
        )

    def at(self, angle: Value) -> tuple[Value, Value]:
        """``C1`` [N m/Pa] and ``C2`` = 0 at an angle [rad]; beyond the joint's range that of its
        end.
        """
        place = np.minimum(np.maximum(angle, self.low), self.high) - self.low
        cell = np.minimum((place / self._step).astype(np.intp), _NODES - 2)
        a, b, c, d = self._cells[cell].T
        place = place - cell * self._step
        found = ((a * place + b) * place + c) * place + d
        return float(found) if isinstance(angle, float) else np.asarray(found), 0.0
