"""The picture of what an arm lifts: torques over the angle, and the payload that each angle would
take.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamrs.design.figures import fill_lack, headed, png
from pamrs.report.figures import COLOURS, STYLE

if TYPE_CHECKING:
    from pamrs.design._lifting import Lift

_INK: Final = "#374151"


def lift_png(result: Lift) -> bytes:
    """Torques and capacity over the angle.

    Parameters
    ----------
    result : Lift
        What :func:`pamrs.lift` returns.

    Returns
    -------
    bytes
        PNG, 1500 pixels wide.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10.0, 4.0), dpi=150, layout="constrained")
        figure.get_layout_engine().set(w_pad=0.1, h_pad=0.08)  # type: ignore[union-attr, call-arg]
        headed(figure, f"{result.rig} {result.text}", 118, 9.5)
        left, right = figure.subplots(1, 2)
        draw_torques(left, result)
        draw_capacity(right, result)
        return png(figure)


def _finish(axes: Axes, result: Lift) -> None:
    """The axis of angles, and how far the arm comes."""
    if result.reached < result.angle[-1]:
        axes.axvline(math.degrees(result.reached), color=_INK, lw=0.9, ls=(0, (2, 2)))
    axes.set_xlim(math.degrees(result.angle[0]), math.degrees(result.angle[-1]))
    axes.set_xlabel("joint angle [deg]")
    axes.legend(loc="upper right")


def draw_torques(axes: Axes, result: Lift) -> None:
    """Muscles against gravity; what is missing is filled."""
    angle, lifting = np.degrees(result.angle), result.torque - result.coulomb
    holding = result.torque_holding + result.coulomb
    fill_lack(axes, angle, lifting, result.gravity, alpha=0.22)
    if float(np.abs(holding - lifting).max()) > 0.01 * float(np.abs(lifting).max()):
        axes.plot(
            angle,
            holding,
            color=COLOURS["after"],
            lw=1.0,
            ls=(0, (5, 2)),
            label="muscles and friction, holding",
        )
    axes.plot(
        angle,
        lifting,
        color=COLOURS["after"],
        lw=1.8,
        label=f"muscles less friction, lifting, {result.pressure / 1e5:.3g} bar",
    )
    axes.plot(
        angle,
        result.gravity,
        color=COLOURS["before"],
        lw=1.8,
        label=f"gravity with {result.payload:.4g} kg",
    )
    axes.set_ylim(
        min(0.0, 1.1 * float(lifting.min())),
        1.3 * max(float(holding.max()), float(result.gravity.max())),
    )
    axes.set_ylabel("torque [N m]")
    _finish(axes, result)


def draw_capacity(axes: Axes, result: Lift) -> None:
    """Payload that is just lifted past each angle, against the one that there is."""
    capacity = np.where(np.isfinite(result.capacity), np.maximum(result.capacity, 0.0), math.nan)
    axes.plot(
        np.degrees(result.angle),
        capacity,
        color=COLOURS["after"],
        lw=1.8,
        label="payload that is just lifted past the angle",
    )
    axes.axhline(
        result.payload, color=COLOURS["before"], lw=1.4, label=f"payload, {result.payload:.4g} kg"
    )
    there = capacity[np.isfinite(capacity)]
    middle = float(np.median(there)) if there.size else 0.0
    axes.set_ylim(0.0, 1.3 * max(2.2 * middle, 1.2 * result.payload, 1e-9))
    axes.set_ylabel("payload [kg]")
    _finish(axes, result)
