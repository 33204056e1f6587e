"""The input that a block's model would need to follow a recording, by Gauss-Newton."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pamrs import _core
from pamrs.channels import channel_of
from pamrs.diagnosis.noise import bins_of
from pamrs.diagnosis.prepare import NOISE_STDS, Block, Input, Prepared, Residual, binned, residual
from pamrs.errors import SimulationError

_HAT = 0.04  # [s] from knot to knot: twice as fast as the bins of the residual
_MOST_KNOTS = 200  # of a window: a sealed chamber is one window, and its input is slow
_CORRELATION = 6.0  # [knots] over which the input stays what it was
_INPUT_SIZES = 10.0 ** np.arange(-2.0, 5.1, 0.25)  # of the input, in the noise levels that it moves
_HORIZONS = ((0.2, 5), (0.5, 4), (1.0, 8))  # shares of a window, and steps: short is linear
_FIRST_STEPS = 4  # from nothing with whole windows, before short ones are tried
_ENOUGH = 1.5  # [noise levels squared] left in a window from which on no step is needed
_ALWAYS = 2  # steps that are made in any case: a small input leaves little
_HALVINGS = 3  # of an input that takes a model out of its range, before it is left out
_SHORTER, _LEAST_NEWTON_STEP = 0.35, 0.02  # of a step that left more, and the shortest

INPUT_UNITS = {"arm": "N m", "load": "N", "chamber": "kg/s", "supply": "kg/s"}
"""Unit of the input of each kind of block that one enters."""

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """The missing input of a block in one recording.

    Attributes
    ----------
    time, value, std : (n,) array
        Of each knot whose window was followed [s], [SI].
    before, after : float
        Mean square of the residual without it and with it [noise levels squared].
    bins : int
        Bins of the residual.
    """

    time: Array
    value: Array
    std: Array
    before: float
    after: float
    bins: int


def has_port(block: Block) -> bool:
    """True where an input enters a block; of another one its reading is what may be wrong."""
    return channel_of(block.name) in INPUT_UNITS


class _Windows:
    """The windows of a recording, of some length, with the heights of an input at their knots.

    Parameters
    ----------
    block, core, prepared, noise
        As of :func:`reconstruct`.
    at : callable
        The input that they begin with, as a function of time [s].

    Attributes
    ----------
    starts, ends : list of int
        Samples at which windows begin and end.
    spacing : int
        Samples from knot to knot.
    knots : list of slice
        Of each window among all heights.
    bins : list of (k,) array
        Usable bins of each window.
    time, heights : (m,) array
        Of every knot [s], [SI].
    means, response : (b,) and (b, k) array
        Residual of each bin and what each knot of its window does to it [noise levels].
    """

    def __init__(
        self,
        block: Block,
        core: _core.Rig,
        prepared: Prepared,
        noise: float,
        at: Callable[[Array], Array],
    ) -> None:
        self.block, self.core, self.prepared, self.noise = block, core, prepared, noise
        self.starts = prepared.starts(block.window, block.drives)
        self.ends = [*self.starts[1:], prepared.n]
        lengths = [b - a for a, b in zip(self.starts, self.ends, strict=True)]
        longest = max(lengths)
        self.spacing = max(1, round(_HAT / prepared.dt), -(-longest // _MOST_KNOTS))
        counts = [Input(self.spacing, np.empty(0)).knots(length) for length in lengths]
        self.knots = [slice(a, b) for a, b in pairwise(np.cumsum([0, *counts]).tolist())]
        places = [a + self.spacing * np.arange(k) for a, k in zip(self.starts, counts, strict=True)]
        self.time: Array = prepared.dt * np.concatenate(places).astype(np.float64)
        self.heights = at(self.time)
        self.means, counted, self.response = self._first_run()
        first = bins_of(prepared) * np.arange(self.means.size)
        window = np.searchsorted(self.starts, first, side="right") - 1
        within = [window == k for k in range(len(lengths))]
        self.bins = [np.flatnonzero(inside & (counted > 0)) for inside in within]

    def _first_run(self) -> tuple[Array, Array, Array]:
        """The first run, with less of the input where the model leaves its range with all of it."""
        for _ in range(_HALVINGS):
            try:
                return self.run(self.heights)
            except SimulationError:
                self.heights = 0.5 * self.heights
        self.heights = np.zeros_like(self.heights)
        return self.run(self.heights)

    def run(self, heights: Array) -> tuple[Array, Array, Array]:
        """Residual by bin [noise levels], usable samples and response, of some heights."""
        block, prepared = self.block, self.prepared
        if has_port(block):
            block_residual = residual(block, self.core, prepared, [], Input(self.spacing, heights))
            value, response = block_residual.value, block_residual.response
            assert response is not None  # an input was given
        else:
            block_residual, hats, which, response = self._reading
            value = block_residual.value - block_residual.freed(
                np.sum(hats * heights[which], axis=1)
            )
        width = bins_of(prepared)
        means, counts = binned(value, block_residual.rows, width)
        return (
            means / self.noise,
            counts,
            binned(response, block_residual.rows, width)[0] / self.noise,
        )

    @cached_property
    def _reading(self) -> tuple[Residual, Array, NDArray[np.intp], Array]:
        """The residual of a block whose reading errs, whatever the heights; hats of the knots of
        each sample's window (n, k), which knots these are, and what they do to the residual (n, k).
        """
        block_residual = residual(self.block, self.core, self.prepared, [])
        hats, which = self._hats(block_residual)
        return block_residual, hats, which, np.apply_along_axis(block_residual.freed, 0, hats)

    def _hats(self, block_residual: Residual) -> tuple[Array, NDArray[np.intp]]:
        """Error of a reading at each sample for each knot of its window (n, k), and which knots
        these are.
        """
        most = max(knots.stop - knots.start for knots in self.knots)
        hats, which = (
            np.zeros((block_residual.value.size, most)),
            np.zeros((block_residual.value.size, most), np.intp),
        )
        for a, b, knots in zip(self.starts, self.ends, self.knots, strict=True):
            count = knots.stop - knots.start
            place = np.arange(b - a)[:, None] / self.spacing
            hats[a:b, :count] = np.maximum(0.0, 1.0 - np.abs(place - np.arange(count)))
            which[a:b, :count] = knots.start + np.arange(count)
        return hats, which

    def mean_squares(self, means: Array) -> Array:
        """Mean square of the residual in each window."""
        return np.array([float(np.mean(means[i] ** 2)) if i.size else 0.0 for i in self.bins])

    def most_probable(self) -> tuple[Array, Array]:
        """Heights (m,) of the linear model about the present ones, and their standard deviations:
        an Ornstein-Uhlenbeck process of one size in the recording, which is the likeliest.
        """
        # an input that reaches nothing has any size
        scale = math.sqrt(float(np.sum(self.response**2, axis=1).max(initial=0.0))) or 1.0
        sizes, parts, evidence = _INPUT_SIZES / scale, [], np.zeros(_INPUT_SIZES.size)
        for rows, knots in zip(self.bins, self.knots, strict=True):
            response = self.response[rows][:, : knots.stop - knots.start]
            apart = np.arange(knots.stop - knots.start)
            covariance = response @ np.exp(-np.abs(apart[:, None] - apart) / _CORRELATION)
            values, axes = np.linalg.eigh(covariance @ response.T)
            projected = axes.T @ (self.means[rows] + response @ self.heights[knots])
            values = np.maximum(values, 0.0)
            variance = 1.0 + np.outer(sizes**2, values)
            evidence -= 0.5 * np.sum(projected**2 / variance + np.log(variance), axis=1)
            parts.append((values, projected, axes.T @ covariance))
        size = float(sizes[np.argmax(evidence)])
        heights, std = np.zeros_like(self.heights), np.zeros_like(self.heights)
        for (values, projected, covariance), knots in zip(parts, self.knots, strict=True):
            weight = size**2 / (1.0 + size**2 * values)
            heights[knots] = covariance.T @ (weight * projected)
            variance = size**2 * (1.0 - covariance.T**2 @ weight)
            std[knots] = np.sqrt(np.maximum(variance, 0.0))
        return heights, std

    def improve(self, steps: int) -> None:
        """Make Gauss-Newton steps in each window as long as they pay."""
        length = np.ones(len(self.starts))
        for step in range(steps):
            before = self.mean_squares(self.means)
            todo = ((before > _ENOUGH) | (step < _ALWAYS)) & (length > _LEAST_NEWTON_STEP)
            if not todo.any():
                return
            wanted, _ = self.most_probable()
            heights = self.heights.copy()
            for k in np.flatnonzero(todo).tolist():
                knots = self.knots[k]
                heights[knots] += length[k] * (wanted[knots] - heights[knots])
            try:
                means, _, response = self.run(heights)
            except SimulationError:
                length *= _SHORTER
                continue
            better = todo & (self.mean_squares(means) < before)
            length = np.where(todo & ~better, _SHORTER * length, np.minimum(1.0, 2.0 * length))
            for k in np.flatnonzero(better).tolist():
                self.take(k, heights, means, response)

    def take(self, k: int, heights: Array, means: Array, response: Array) -> None:
        """Copy heights, residual and response of one window from another run."""
        knots, rows = self.knots[k], self.bins[k]
        self.heights[knots] = heights[knots]
        self.means[rows], self.response[rows] = means[rows], response[rows]


def _nothing(time: Array) -> Array:
    """Input that is zero at all times."""
    return np.zeros_like(time)


def _interpolated(time: Array, heights: Array) -> Callable[[Array], Array]:
    """An input as a function of time, of its heights at knots."""
    order = np.argsort(time, kind="stable")
    return lambda at: np.interp(at, time[order], heights[order])


def reconstruct(
    block: Block, core: _core.Rig, prepared: Prepared, noise: float
) -> Reconstruction | None:
    """Find the missing input of a block along a recording.

    Windows whose input is too large for one linear step begin with short windows, which are nearly
    linear, and grow.

    Parameters
    ----------
    block : Block
        The block: torque at a joint [N m], force at a load [N], mass flow into a chamber or tank
        [kg/s]; of another one the error of its reading.
    core : _core.Rig
        The model, compiled.
    prepared : Prepared
        The recording.
    noise : float
        Standard deviation of the residual's bin means by noise alone, in the channel's unit.

    Returns
    -------
    Reconstruction or None
        None where no window was followed.

    Raises
    ------
    SimulationError
        If the model without an input leaves the range in which it holds.

    Notes
    -----
    Each height has the prior of an Ornstein-Uhlenbeck process whose one size is found by maximum
    likelihood (Rasmussen & Williams, Gaussian Processes for Machine Learning, 2006, sections 2.2
    and 5.4).
    """
    windows = _Windows(block, core, prepared, noise, _nothing)
    first = [windows.means[i] for i in windows.bins]
    windows.improve(_FIRST_STEPS)
    if (windows.mean_squares(windows.means) > NOISE_STDS**2).any() and has_port(block):
        _from_short(windows)
    followed = windows.mean_squares(windows.means) <= NOISE_STDS**2
    _, std = windows.most_probable()
    inside = [
        np.arange(knots.start, knots.stop)[windows.time[knots] < prepared.dt * end]
        for knots, end, good, rows in zip(
            windows.knots, windows.ends, followed, windows.bins, strict=True
        )
        if good and rows.size
    ]
    if not inside:
        return None
    known = np.concatenate(inside)
    without, rest = np.concatenate(first), np.concatenate([windows.means[i] for i in windows.bins])
    return Reconstruction(
        windows.time[known],
        windows.heights[known],
        std[known],
        float(np.mean(without**2)),
        float(np.mean(rest**2)),
        rest.size,
    )


def _from_short(windows: _Windows) -> None:
    """Find the input of short windows first, and of each whole window keep the better one."""
    block, prepared = windows.block, windows.prepared
    whole = block.window or prepared.n * prepared.dt
    at: Callable[[Array], Array] = _nothing
    grown = windows
    for share, steps in _HORIZONS:
        shorter = replace(block, window=block.window if share == 1.0 else share * whole)
        grown = _Windows(shorter, windows.core, prepared, windows.noise, at)
        grown.improve(steps)
        at = _interpolated(grown.time, grown.heights)
    better = grown.mean_squares(grown.means) < windows.mean_squares(windows.means)
    for k in np.flatnonzero(better).tolist():
        windows.take(k, grown.heights, grown.means, grown.response)
