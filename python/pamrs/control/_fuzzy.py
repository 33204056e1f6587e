"""Fuzzy control of the joint angle (dissertation 4.3.1.2, (4.10); Passino & Yurkovich, Fuzzy
Control, 1998).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Final

import numpy as np

from pamrs._arrays import Array, ArrayLike
from pamrs.control._parts import LowPass
from pamrs.control._pid import OutputFeedback
from pamrs.control._protocol import Measurement, Reference, Value
from pamrs.control._sampled import Fixed
from pamrs.control._values import as_value, clip, positive_gain
from pamrs.errors import ParameterError

_HALF: Final = 3  # sets on each side of zero, NB, NM, NS, ZE, PS, PM, PB


def fuzzy_rules(table: ArrayLike | None = None) -> Array:
    """Centre of the output set for each pair of sets.

    Table 4.1 is printed as a picture; the standard table is used, output index
    ``clip(i + j, -3, 3)``: error NS and rate PS give ZE. The text quotes "positive small" for that
    pair.

    Parameters
    ----------
    table : array_like, shape (7, 7), optional
        Output indices from -3 to 3, rows by error from NB to PB, columns by rate; the standard
        table by default.

    Returns
    -------
    ndarray, shape (7, 7)
        Centres, -1 to 1.

    Raises
    ------
    ParameterError
        If the table is none.
    """
    if table is None:
        i, j = np.indices((7, 7)) - _HALF
        return np.clip((i + j).astype(np.float64), -_HALF, _HALF) / _HALF
    given = np.asarray(table, dtype=np.float64)
    if given.shape != (7, 7) or not np.all(np.isfinite(given)) or np.any(np.abs(given) > _HALF):
        raise ParameterError(
            f"table of shape {given.shape} is not allowed: 7 x 7 output indices from -3 to 3 are "
            "needed"
        )
    return given / _HALF


def fuzzy_surface(
    error: Value, rate: Value, rules: Sequence[Sequence[float]], rules_array: Array
) -> Value:
    """Output of the rules for scaled inputs, before h.

    Triangular sets that overlap by half, so that two of each input are active and their memberships
    sum to one; premise by the minimum (4.10); centre of gravity of the output sets, each a triangle
    cut off at its premise ``m`` with the area ``w (m - m^2/2)``. With the minimum as premise the
    surface is not quite monotone: it falls by at most 0.007 of its range where it should
    rise (standard table).

    Parameters
    ----------
    error, rate : float or ndarray, shape (n,)
        Scaled by g1 and g2; beyond -1 to 1 the shoulders saturate.
    rules : sequence of sequence of float
        Centres as lists, for floats.
    rules_array : ndarray, shape (7, 7)
        The same, for arrays.

    Returns
    -------
    float or ndarray
        From -1 to 1.
    """
    if error.__class__ is float and rate.__class__ is float:
        x: float = (0.0 if error < 0.0 else 6.0) if not -1.0 < error < 1.0 else (error + 1.0) * 3.0
        y: float = (0.0 if rate < 0.0 else 6.0) if not -1.0 < rate < 1.0 else (rate + 1.0) * 3.0
        i, j = int(x), int(y)
        if i > 5:
            i = 5
        if j > 5:
            j = 5
        a, b = x - i, y - j
        na, nb = 1.0 - a, 1.0 - b
        m = na if na < nb else nb
        w00 = m * (2.0 - m)
        m = na if na < b else b
        w01 = m * (2.0 - m)
        m = a if a < nb else nb
        w10 = m * (2.0 - m)
        m = a if a < b else b
        w11 = m * (2.0 - m)
        low, high = rules[i], rules[i + 1]
        return (w00 * low[j] + w01 * low[j + 1] + w10 * high[j] + w11 * high[j + 1]) / (
            w00 + w01 + w10 + w11
        )
    places = np.broadcast_arrays(
        (np.clip(error, -1.0, 1.0) + 1.0) * 3.0, (np.clip(rate, -1.0, 1.0) + 1.0) * 3.0
    )
    k, n = (np.minimum(place.astype(np.intp), 5) for place in places)
    p, q = places[0] - k, places[1] - n
    premises = np.minimum(1.0 - p, 1.0 - q), np.minimum(1.0 - p, q), np.minimum(p, 1.0 - q)
    weights = [premise * (2.0 - premise) for premise in (*premises, np.minimum(p, q))]
    corners = ((k, n), (k, n + 1), (k + 1, n), (k + 1, n + 1))
    total = sum(w * rules_array[at] for w, at in zip(weights, corners, strict=True))
    return np.asarray(total / sum(weights))


class Fuzzy(OutputFeedback):
    """Fuzzy control of the joint angle by the valve, volts around the closed valve.

    ``u = null + h f(e/g1, e'/g2)``, low-passed, with ``f`` the surface of :func:`fuzzy_surface`;
    ``e = theta_d - theta``.

    The printed gains are in **radians** and volts: the experiments lag by some 0.75 s on a ramp of
    about 15 deg/s, an error of 0.2 rad, which g1 = 0.45 rad scales into the middle of the sets and
    0.45 deg would saturate throughout; so scaled, the slope at the origin h/g1 = 1.44 V/rad is that
    of the PID tuned on the same rig (kP = 1.4).

    Parameters
    ----------
    g1 : float or ndarray, shape (n,)
        Error at which the sets end [unit].
    g2 : float or ndarray, shape (n,)
        Rate of the error at which the sets end [unit/s].
    h : float or ndarray, shape (n,)
        Largest output [V].
    period : float
        Time between two updates [s].
    unit : {"rad", "deg"}
        Unit of the angle in the gains.
    table : array_like, shape (7, 7), optional
        As for :func:`fuzzy_rules`.
    limits : tuple of (float, float)
        Smallest and largest output [V].
    null : float
        Output for no error [V].
    output_filter : float or ndarray, shape (n,)
        Time constant of the low-pass on the output [s].
    rate_filter, angle_filter, measured_rate
        As for :class:`pamrs.control.PID`.

    Raises
    ------
    ParameterError
        If a number is not finite or not allowed; the message names it.

    Examples
    --------
    >>> from pamrs.control import Fuzzy, Reference
    >>> controller = Fuzzy(0.45, 0.6, 0.65, output_filter=0.0)
    >>> round(controller.update(0.0, {"joint_angle": 0.3}, Reference(0.9)), 3)
    5.65
    """

    _PARTS: ClassVar[tuple[str, ...]] = ("sensor", "low_pass")

    g1, g2, h, output_filter = Fixed(), Fixed(), Fixed(), Fixed("low_pass.time_constant")

    def __init__(
        self,
        g1: Value,
        g2: Value,
        h: Value,
        *,
        period: float = 1e-3,
        unit: str = "rad",
        table: ArrayLike | None = None,
        limits: tuple[float, float] = (0.0, 10.0),
        null: float = 5.0,
        output_filter: Value = 0.05,
        rate_filter: Value = 0.02,
        angle_filter: Value = 0.0,
        measured_rate: bool = False,
    ) -> None:
        self._g1, self._g2 = positive_gain("g1", g1), positive_gain("g2", g2)
        self._h = as_value("h", h, lower=0.0)
        self.rules = fuzzy_rules(table)
        self._rows: list[list[float]] = self.rules.tolist()
        self.low_pass = LowPass(output_filter, period, initial=0.0)
        super().__init__(
            period,
            (self._g1, self._g2, self._h, self.low_pass.time_constant),
            unit=unit,
            limits=limits,
            null=null,
            rate_filter=rate_filter,
            angle_filter=angle_filter,
            measured_rate=measured_rate,
        )
        self._error_scale, self._rate_scale = self._scale / self._g1, self._scale / self._g2
        self.reset()

    def answer(
        self, time: float, measurement: Measurement, reference: Reference, bias: Value
    ) -> Value:
        """Command of :meth:`update`, with ``bias`` [V] added before the limits."""
        aim = self._aim(reference)
        if bias.__class__ is not float:
            bias = self._sized("bias", bias)
        angle, rate = self.sensor.read(self, measurement)
        self._tick(time)
        angle, rate = self.sensor.update(angle, rate)
        error = (aim.angle - angle) * self._error_scale
        error_rate = (aim.rate - rate) * self._rate_scale
        output = self.low_pass.update(
            self._h * fuzzy_surface(error, error_rate, self._rows, self.rules)
        )
        return clip(self._null + output + bias, self._limits[0], self._limits[1])
