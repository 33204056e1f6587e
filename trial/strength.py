"""Find the size of an effect that moves its most affected channel by a wanted multiple of the
noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")
#: multiples of the noise; medium lies a little above 3, so that every medium case counts as
#: detectable
STRENGTHS = {"weak": 1.5, "medium": 3.3, "strong": 10.0}
#: every label that can be wanted; "heavy" is what stands beside an effect in plan `blocks`
LABELS = {**STRENGTHS, "heavy": 20.0}
#: factor on the drawn size with which the search for medium starts; it only saves time
FIRST = {
    "supply_leak": 0.5,
    "compressor_cut_in": 0.2,
    "valve_dead_zone": 0.01,
    "valve_hysteresis": 0.15,
    "valve_centre_leakage": 0.45,
    "valve_area": 0.1,
    "input_path_lag": 0.17,
    "tube_flow_restriction": 0.5,
    "leak_muscle": 0.2,
    "heat_transfer": 0.03,
    "muscle_hysteresis": 0.055,
    "muscle_creep": 0.28,
    "muscle_rate_damping": 0.21,
    "activation_pressure": 0.033,
    "mullins_softening": 0.08,
    "pam_crowding_contact": 4.0,
    "joint_coulomb_stribeck": 0.26,
    "joint_end_stop": 0.07,
    "payload_swing": 0.75,
    "payload_change": 1.8,
    "base_flexibility": 0.45,
    "pressure_lag": 0.7,
    "encoder_error": 1.0,
    "tendon_compliance": 0.012,
    "valve_null_drift": 0.24,
    "muscle_buckling": 0.53,
    "encoder_gear_lash": 0.83,
    "hose_torque": 0.46,
    "supply_gas_cooling": 4.6,
    "exhaust_back_pressure": 0.05,
    "moment_arm_error": 1.3,
    "pressure_zero_drift": 1.5,
}
MEASURES = ("reach", "left")


def aim(
    simulate: Callable[[float], tuple[float, T]],
    target: float,
    most: float,
    start: float = 1.0,
    tolerance: float = 0.08,
    tries: int = 9,
) -> tuple[float, float, T]:
    """Scale an effect until it reaches a target.

    Parameters
    ----------
    simulate : callable
        Gives the reach of a scale factor, and whatever else is wanted of the last call.
    target : float
        Wanted reach.
    most : float
        Largest factor allowed.
    start : float
        First factor.
    tolerance : float
        Relative distance from the target that is good enough.
    tries : int
        Largest number of simulations.

    Returns
    -------
    factor, reach : float
        The best found.
    result
        What `simulate` gave with it.
    """
    low: tuple[float, float] | None = None
    high: tuple[float, float] | None = None
    best: tuple[float, float, T] | None = None
    factor = min(start, most)
    for attempt in range(tries):
        found, result = simulate(factor)
        if best is None or abs(math.log(max(found, 1e-9) / target)) < abs(
            math.log(max(best[1], 1e-9) / target)
        ):
            best = (factor, found, result)
        if abs(found / target - 1.0) <= tolerance or (found < target and factor >= most):
            break
        x, y = math.log(factor), math.log(max(found, 1e-9) / target)
        if y < 0.0:
            low = (x, y)
        else:
            high = (x, y)
        if low is not None and high is not None:
            # straight line in logarithms, kept off the ends, and the middle every third time
            share = -low[1] / (high[1] - low[1])
            share = 0.5 if attempt % 3 == 2 else min(max(share, 0.1), 0.9)
            x = low[0] + share * (high[0] - low[0])
        else:
            x -= min(max(y, -2.5), 2.5)
        factor = min(math.exp(x), most)
    assert best is not None
    return best
