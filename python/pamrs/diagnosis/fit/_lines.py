"""Frequencies at which residuals repeat: where a search for a vibration begins."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from pamrs._arrays import Array
from pamrs.diagnosis.prepare import Residual


def lines_of(
    found: Iterable[tuple[Residual, float]], low: float, high: float, most: int
) -> list[float]:
    """Frequencies at which the spectrum of residuals stands out most from its surroundings.

    Parameters
    ----------
    found : iterable of (Residual, float)
        Residuals, each with its sampling interval [s].
    low, high : float
        Least and greatest frequency [Hz].
    most : int
        Number of frequencies at the most.

    Returns
    -------
    list of float
        The clearest first [Hz]; two are at least as far apart as the longest residual can tell.
    """
    series = [(np.where(r.rows, r.value, 0.0) / r.noise, dt) for r, dt in found]
    if not series:
        return []
    longest = max(values.size * dt for values, dt in series)
    fastest = min(0.4 / dt for _, dt in series)
    step = 0.25 / longest
    grid = np.arange(max(low, 2.0 / longest), min(high, fastest), step)
    if grid.size == 0:
        return []
    power = sum((_power(values, dt, grid) for values, dt in series), np.zeros(grid.size))
    clear = power / np.maximum(_around(power), 1e-300)
    found_at: list[int] = []
    for k in np.argsort(-clear, kind="stable"):
        top = power[max(0, k - 1) : k + 2].max() == power[k]
        if top and all(abs(int(k) - other) * step > 1.5 / longest for other in found_at):
            found_at.append(int(k))
        if len(found_at) == most:
            break
    return [float(grid[k]) for k in found_at]


def _power(values: Array, dt: float, grid: Array) -> Array:
    """Power of a series, its ends faded out, at some frequencies [Hz]."""
    faded = (values - values.mean()) * np.hanning(values.size)
    size = 1 << math.ceil(math.log2(8 * values.size))
    spectrum = np.abs(np.fft.rfft(faded, size)) ** 2 / values.size
    return np.asarray(np.interp(grid, np.fft.rfftfreq(size, dt), spectrum), dtype=np.float64)


def _around(power: Array) -> Array:
    """Median of a spectrum over the surroundings of each frequency."""
    half = max(8, power.size // 20)
    padded = np.pad(power, half, mode="reflect" if power.size > half else "edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1)
    return np.asarray(np.median(windows, axis=1), dtype=np.float64)
