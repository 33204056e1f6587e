"""How far the sampled loops of chapters 4 to 6 are from a limit cycle.

A proportional valve makes the pressure of a chamber an integral of its command. Where the tank is
full, the muscles short of air and the valve well open, a volt moves it fastest::

    b = alpha_in R T / V  (C A)_max a' / half_range  p_tank sqrt(2 / (R T)) psi        [Pa/(s V)]

with the smallest volume V, the steepest slope a' of the area table and choked flow. A PI loop of
the pressure with a low-pass, sampled with a period T, is stable while ``T b kp`` is below
``2 (1 + a)/(1 - a)``, ``a = exp(-T/tau)`` (Jury, without the integral). So the gain has to go with
the volume, and with it with the number of muscles.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from pamrs.control import Cascade, Controller, Reference
from pamrs.control.linear import LinearController, LinearModel, linear_controller, linearise
from pamrs.rig import Joint, Rig

#: Factor that a pressure loop of :func:`inner_gains` leaves at its fastest point.
MARGIN: Final = 2.0
#: Largest factor that is looked for; a loop that bears more counts as bearing this.
_MOST: Final = 16.0


def fastest(rig: Rig, slope: str = "steepest") -> float:
    """Largest rate of the muscles' pressure for a volt at the valve [Pa/(s V)].

    Parameters
    ----------
    rig : Rig
        With one chamber behind one valve; the joint's least angle is where its volume is least.
    slope : {"steepest", "null"}
        Of the valve's area table: where it is largest, or next to the null.

    Returns
    -------
    float
    """
    model = rig.model
    gas, chamber, valve, supply = (model[name] for name in ("gas", "chamber", "valve", "supply"))
    warmth = gas["gas_constant"] * gas["temperature"]
    full = supply["initial_pressure"] + gas["ambient_pressure"]
    kappa = gas["heat_capacity_ratio"]
    choked = (2.0 / (kappa + 1.0)) ** (1.0 / (kappa - 1.0)) * math.sqrt(kappa / (kappa + 1.0))
    slopes = np.diff(valve["fraction"]) / np.diff(valve["opening"])
    opening = float(slopes.max() if slope == "steepest" else slopes[0])
    area = valve["discharge_area_max"] * opening / valve["half_range"]
    flow = area * full * math.sqrt(2.0 / warmth) * choked
    return float(chamber["alpha_in"] * warmth * flow / _least_volume(rig))


def _least_volume(rig: Rig) -> float:
    """Volume of muscles and fittings at the joint's least angle [m3]."""
    assert rig.muscle is not None
    model = rig.model
    joint = Joint.from_model(model["joint"])
    low = float(joint.shortening(model["joint"]["min_angle"]))
    one = float(rig.muscle.air_volume(low / rig.muscle.parameters["rest_length"]))
    return float(model["muscle"]["count"] * one + model["chamber"]["dead_volume"])


def bearable(period: float, pressure_filter: float) -> float:
    """Largest ``T b kp`` of a stable loop without an integral [1].

    Parameters
    ----------
    period, pressure_filter : float
        [s]

    Returns
    -------
    float
        2 without a filter.
    """
    pole = math.exp(-period / pressure_filter) if pressure_filter > 0.0 else 0.0
    return 2.0 * (1.0 + pole) / (1.0 - pole)


def inner_gains(
    rig: Rig, period: float, pressure_filter: float, *, integral: float = 0.5
) -> dict[str, float]:
    """Gains of a pressure loop that bears twice of them at its fastest point.

    Parameters
    ----------
    rig : Rig
        As for :func:`fastest`.
    period, pressure_filter : float
        [s]
    integral : float
        Of ki over kp [1/s].

    Returns
    -------
    dict of str to float
        ``kp`` [V/Pa] and ``ki`` [V/(Pa s)].
    """
    kp = bearable(period, pressure_filter) / (MARGIN * period * fastest(rig))
    return {"kp": kp, "ki": integral * kp}


def inner_margin(
    rig: Rig, loop: Mapping[str, float], period: float, slope: str = "steepest"
) -> float:
    """Factor by which the gains of a pressure loop may grow at its fastest point; below one small
    motions grow there.

    Parameters
    ----------
    rig : Rig
        As for :func:`fastest`.
    loop : mapping of str to float
        ``kp``, ``ki`` and ``pressure_filter``.
    period : float
        [s]
    slope : {"steepest", "null"}
        As for :func:`fastest`.

    Returns
    -------
    float
    """
    rate, filtered = fastest(rig, slope), loop["pressure_filter"]
    pole = math.exp(-period / filtered) if filtered > 0.0 else 0.0
    kp, ki = loop["kp"], loop["ki"]

    def radius(factor: float) -> float:
        moved = period * rate * factor
        seen = np.array([1.0 - pole, pole, 0.0])  # the filtered pressure by pressure, itself, sum
        volts = -kp * seen + np.array([0.0, 0.0, 1.0])
        step = np.array(
            [
                np.array([1.0, 0.0, 0.0]) + moved * volts,
                seen,
                np.array([0.0, 0.0, 1.0]) - period * ki * seen,
            ]
        )
        moving = step if ki else step[:2, :2]  # a sum that nothing moves is no motion
        return float(np.abs(np.linalg.eigvals(moving)).max())

    return _boundary(radius)


def _boundary(radius: Callable[[float], float]) -> float:
    """How far above one a factor may go before a spectral radius passes one; of a loop that is
    unstable by itself the largest factor below one with which it is stable, 0 without any.
    """
    stable = radius(1.0) < 1.0
    factors = np.geomspace(1.0, _MOST if stable else 1e-2, 25)
    last = 1.0
    for factor in factors[1:]:
        if (radius(float(factor)) < 1.0) != stable:
            break
        last = float(factor)
    else:
        return _MOST if stable else 0.0
    low, high = sorted((last, float(factor)))
    while high > 1.001 * low:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if radius(middle) < 1.0 else (low, middle)
    return math.sqrt(low * high)


def holding(cascade: Cascade, point: Mapping[str, float]) -> dict[str, Any] | None:
    """State of a cascaded PID that holds an arm at a point, its integral being the pressure; None
    for a law that knows the pressure by itself.
    """
    if "law" not in cascade.state["outer"]:
        return None
    cascade.reset()
    read = {name: point[name] for name in ("joint_angle", "joint_rate", "muscle_pressure")}
    for sample in range(3):  # the filters see the point
        cascade.update(sample * cascade.period, read, Reference(point["joint_angle"]))
    state: dict[str, Any] = dict(cascade.state)
    cascade.reset()
    pressure = point["muscle_pressure"]
    state["outer"]["law"] = {
        "integrator": {"integral": pressure},
        "low_pass": {"output": pressure},
    }
    inner = state["inner"]
    inner["law"] = {"integrator": {"integral": 0.0}, "low_pass": {"output": 5.0}}
    inner["desired_filter"] = inner["pressure_filter"] = {"output": pressure}
    return state


def loop_margin(
    rig: Rig, make: Callable[[], Controller], angle: float, *, steepest: float = 1.5
) -> float:
    """Factor by which a whole loop's gain may grow at an angle, filling and venting, with dry
    friction at rest and in motion.

    Parameters
    ----------
    rig : Rig
        With one joint, one chamber and one valve.
    make : callable
        Makes the controller.
    angle : float
        At which the arm is held [rad].
    steepest : float
        Slope of the valve where it is steepest over that at its null, where it fills; where it
        vents, slowly, it is at its null.

    Returns
    -------
    float
        Below one some small motion grows.

    Raises
    ------
    ParameterError
        If nothing holds the arm there, or rig or controller have no linear model.
    """
    least = _MOST
    for side, slope in (("fill", steepest), ("vent", 1.0)):
        for friction in ("rest", "moving"):
            model = linearise(rig, angle, side=side, friction=friction)
            controller = make()
            state = holding(controller, model.point) if isinstance(controller, Cascade) else None
            linear = linear_controller(controller, model.point, state=state)
            least = min(least, _factor(model, linear, slope))
    return least


def _factor(model: LinearModel, linear: LinearController, slope: float) -> float:
    """The factor of the loop's gain at which it is at its boundary."""

    def radius(factor: float) -> float:
        return _radius(replace(model, b=slope * factor * model.b), linear)

    return _boundary(radius)


def _radius(model: LinearModel, linear: LinearController) -> float:
    """Largest absolute eigenvalue of a loop of one command from one sample to the next."""
    phi, gamma = model.sampled(linear.period)
    pick = np.array([[float(name == out) for out in model.outputs] for name in linear.inputs])
    n, k = len(phi), len(linear.a)
    step = np.zeros((n + k, n + k))
    step[:n, :n] = phi + gamma @ (linear.d @ pick) @ model.c
    step[:n, n:] = gamma @ linear.c
    step[n:, :n] = (linear.b @ pick) @ model.c
    step[n:, n:] = linear.a
    return float(np.abs(np.linalg.eigvals(step)).max())
