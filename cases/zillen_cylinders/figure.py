"""Figure of the friction of cylinders: the law over pressure, one loop, one start from rest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from cases.zillen_cylinders.laws import CylinderFriction, columns
from pamrs.errors import ParameterError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot_cylinders"]

Array = NDArray[np.float64]

_BLUE, _RED, _GREY, _GREEN = "#1f5a96", "#c8442c", "#8a8a8a", "#2d7d46"
_BEFORE_REST: Final = 0.15  # s
_AFTER_REST: Final = 1.2  # s


def plot_cylinders(fits: Sequence[CylinderFriction], *, loop: str | None = None) -> Figure:
    """Draw the laws of some cylinders, and one run's loop and start.

    Parameters
    ----------
    fits : sequence of CylinderFriction
        One panel each.
    loop : str, optional
        Run whose loop and start are drawn; by default the one with the highest breakaway.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ParameterError
        If there is no fit, or ``loop`` is no run of theirs.
    """
    if not fits:
        raise ParameterError("fits is empty: one at least is needed")
    from matplotlib.figure import Figure

    owner, run = _loop_of(fits, loop)
    columns = max(len(fits), 2)
    figure = Figure(figsize=(3.3 * columns, 7.4), layout="constrained")
    spec = figure.add_gridspec(2, 2 * columns, height_ratios=(1.0, 1.15))
    first: Any = None
    for index, fit in enumerate(fits):
        axes = figure.add_subplot(spec[0, 2 * index : 2 * index + 2], sharey=first)
        first = first or axes
        _law(axes, fit)
        if index == 0:
            axes.set_ylabel("friction [N]")
    levels = [level for fit in fits for level in fit.every_level]
    first.set_ylim(0.0, 1.08 * max(level.breakaway or level.friction for level in levels))
    place: dict[str, Any] = {"loc": "outside upper center", "ncols": 6, "frameon": False}
    figure.legend(*first.get_legend_handles_labels(), fontsize=8, **place)
    _loop(figure.add_subplot(spec[1, :columns]), owner, run)
    _start(figure.add_subplot(spec[1, columns:]), owner, run)
    return figure


def _loop_of(fits: Sequence[CylinderFriction], loop: str | None) -> tuple[CylinderFriction, str]:
    runs = {name: fit for fit in fits for name in fit.pairs}
    if loop is not None:
        if loop not in runs:
            raise ParameterError(f"loop = {loop!r} is no run of these cylinders: {', '.join(runs)}")
        return runs[loop], loop
    peaks = {level.name: level.breakaway or 0.0 for fit in fits for level in fit.every_level}
    best = max(peaks, key=lambda name: peaks[name])
    return runs[best], best


def _law(axes: Any, fit: CylinderFriction) -> None:
    from scipy.stats import t

    high = max(level.pressure for level in fit.every_level)
    if fit.law != "linear_speed":
        p = np.linspace(0.0, 1.06 * high, 60)
        law = fit.predict(p)
        axes.plot(p / 1e5, law, color=_BLUE, lw=1.5, label="law")
        if fit.law == "linear" and fit.nfree:
            design = np.column_stack([np.ones_like(p), p])
            spread = np.sqrt(np.einsum("ij,jk,ik->i", design, fit.covar, design) + fit.between**2)
            half = float(t.ppf(0.84134, fit.nfree)) * spread
            shade: dict[str, Any] = {"color": _BLUE, "alpha": 0.13, "lw": 0}
            shade["label"] = "68 % for a new run"
            axes.fill_between(p / 1e5, law - half, law + half, **shade)
    marks: dict[str, Any] = {"marker": "o", "ls": "none", "ms": 6, "capsize": 2}
    for levels, style, label in (
        (fit.levels, {"color": _BLUE}, "fitted on"),
        (fit.held_out_levels, {"color": _RED, "mfc": "white", "mew": 1.6}, "held out"),
    ):
        if levels:
            pressure, friction, stderr, _ = columns(levels)
            axes.errorbar(pressure / 1e5, friction, stderr, label=label, **style, **marks)
    for status, marker, label in (
        ("seen", "v", "breakaway from rest"),
        ("at least", "^", "breakaway, at least"),
    ):
        found = [x for x in fit.every_level if x.rest is not None and x.rest.status == status]
        x, y = [level.pressure / 1e5 for level in found], [level.breakaway for level in found]
        axes.plot(x, y, marker, color=_GREEN, ms=6, mfc="none", label=label)
    axes.set_title(fit.name, fontsize=10)
    axes.set_xlabel("pressure [bar]")
    axes.set_xlim(0.0, 1.06 * high / 1e5)
    axes.grid(alpha=0.25)


def _net(fit: CylinderFriction, run: str) -> Array:
    """Force of a run without what the gas pulls and the force zero [N]."""
    _, _, pressure, force = fit.pairs[run].record.rows()
    zero = fit.params["force_zero"].value if "force_zero" in fit.params else 0.0
    return force - fit.area * pressure - zero


def _mark_breakaway(axes: Any, fit: CylinderFriction, run: str, x: Array, label: str) -> float:
    """Mark the breakaway from rest, if it was sampled; the pressure of the run [Pa]."""
    level = next(level for level in fit.every_level if level.name == run)
    if level.rest is not None and level.breakaway is not None:
        row = level.rest.row
        style: dict[str, Any] = {"color": _GREEN, "ms": 9, "mfc": "none", "mew": 1.6}
        told = label.format(level.breakaway)
        axes.plot(x[row], _net(fit, run)[row], "v", label=told, **style)
    return level.pressure


def _loop(axes: Any, fit: CylinderFriction, run: str) -> None:
    pairs = fit.pairs[run]
    position, net = 1e3 * pairs.record.rows()[1], _net(fit, run)
    low, high = (1e3 * edge for edge in pairs.window)
    axes.axvspan(low, high, color=_GREY, alpha=0.13, lw=0, label="steady window")
    for way, color, label in (
        (pairs.sign, _BLUE, "against the gas"),
        (-pairs.sign, _RED, "giving way"),
    ):
        for stroke in pairs.strokes:
            if stroke.direction == way:
                rows = slice(stroke.start, stroke.stop + 1)
                axes.plot(position[rows], net[rows], color=color, lw=0.6, alpha=0.7, label=label)
                label = "_"
    turns = [stroke.start for stroke in pairs.strokes[1:]]
    axes.plot(position[turns], net[turns], ".", color="k", ms=5, label="reversals")
    pressure = _mark_breakaway(axes, fit, run, position, "breakaway from rest")
    axes.margins(y=0.12)
    title = f"{run}: loop of {len(pairs.strokes)} strokes, {pressure / 1e5:.1f} bar"
    axes.set_title(title, fontsize=10)
    axes.set_xlabel("position [mm]")
    axes.set_ylabel("force - A p - zero [N]")
    axes.legend(fontsize=7.5, loc="center", frameon=False)
    axes.grid(alpha=0.25)


def _start(axes: Any, fit: CylinderFriction, run: str) -> None:
    pairs, net = fit.pairs[run], _net(fit, run)
    time, position, _, _ = pairs.record.rows()
    moved = np.abs(position - position[0])
    begin = float(time[int(np.argmax(moved > 1e-4))])
    rows = (time >= begin - _BEFORE_REST) & (time <= begin + _AFTER_REST)
    since = time - begin
    style: dict[str, Any] = {"color": _BLUE, "lw": 0.8, "ms": 4}
    axes.plot(since[rows], net[rows], ".-", label="force - A p - zero", **style)
    label = "logger paused"
    for start, stop in pairs.record.gaps:
        if start < begin + _AFTER_REST and stop > begin - _BEFORE_REST:
            axes.axvspan(start - begin, stop - begin, color=_RED, alpha=0.12, lw=0, label=label)
            label = "_"
    _mark_breakaway(axes, fit, run, since, "{:.1f} N")
    axes.margins(y=0.12)
    axes.set_xlabel("time since the motion began [s]")
    axes.set_ylabel("force - A p - zero [N]")
    axes.set_title(f"{run}: the start from rest", fontsize=10)
    other = axes.twinx()
    other.plot(since[rows], moved[rows] * 1e3, color=_GREY, lw=1.0, ls="--", label="travel")
    other.set_ylabel("travel [mm]", color=_GREY)
    lines = [line for each in (axes, other) for line in each.get_legend_handles_labels()[0]]
    labels = [line.get_label() for line in lines]
    axes.legend(lines, labels, fontsize=7.5, loc="lower right", frameon=False)
    axes.grid(alpha=0.25)
