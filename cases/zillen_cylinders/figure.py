"""Figure of the friction of cylinders: the law over pressure, one loop, one start from rest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from pamrs.errors import ParameterError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cases.zillen_cylinders.laws import CylinderFriction

__all__ = ["plot_cylinders"]

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
    levels = [level for fit in fits for level in (*fit.levels, *fit.held_out_levels)]
    first.set_ylim(0.0, 1.08 * max(level.breakaway or level.friction for level in levels))
    figure.legend(
        *first.get_legend_handles_labels(),
        fontsize=8,
        loc="outside upper center",
        ncols=6,
        frameon=False,
    )
    _loop(figure.add_subplot(spec[1, :columns]), owner, run)
    _start(figure.add_subplot(spec[1, columns:]), owner, run)
    return figure


def _loop_of(fits: Sequence[CylinderFriction], loop: str | None) -> tuple[CylinderFriction, str]:
    runs = {name: fit for fit in fits for name in fit.pairs}
    if loop is not None:
        if loop not in runs:
            raise ParameterError(f"loop = {loop!r} is no run of these cylinders: {', '.join(runs)}")
        return runs[loop], loop
    peaks = {
        level.name: level.breakaway or 0.0
        for fit in fits
        for level in (*fit.levels, *fit.held_out_levels)
    }
    best = max(peaks, key=lambda name: peaks[name])
    return runs[best], best


def _law(axes: Any, fit: CylinderFriction) -> None:
    from scipy.stats import t

    everything = [*fit.levels, *fit.held_out_levels]
    high = max(level.pressure for level in everything)
    if fit.law != "linear_speed":
        p = np.linspace(0.0, 1.06 * high, 60)
        law = fit.predict(p)
        axes.plot(p / 1e5, law, color=_BLUE, lw=1.5, label="law")
        if fit.law == "linear" and fit.nfree:
            design = np.column_stack([np.ones_like(p), p])
            spread = np.sqrt(np.einsum("ij,jk,ik->i", design, fit.covar, design) + fit.between**2)
            factor = float(t.ppf(0.84134, fit.nfree))
            axes.fill_between(
                p / 1e5,
                law - factor * spread,
                law + factor * spread,
                color=_BLUE,
                alpha=0.13,
                lw=0,
                label="68 % for a new run",
            )
    marks: dict[str, Any] = {"ls": "none", "ms": 6, "capsize": 2}
    for levels, style, label in (
        (fit.levels, {"marker": "o", "color": _BLUE}, "fitted on"),
        (
            fit.held_out_levels,
            {"marker": "o", "color": _RED, "mfc": "white", "mew": 1.6},
            "held out",
        ),
    ):
        if levels:
            x = [level.pressure / 1e5 for level in levels]
            y = [level.friction for level in levels]
            axes.errorbar(x, y, [level.stderr for level in levels], label=label, **style, **marks)
    for status, marker, label in (
        ("seen", "v", "breakaway from rest"),
        ("at least", "^", "breakaway, at least"),
    ):
        found = [
            (x.pressure / 1e5, x.breakaway)
            for x in everything
            if x.rest is not None and x.rest.status == status
        ]
        axes.plot(
            *(zip(*found, strict=True) if found else ([], [])),
            marker,
            color=_GREEN,
            ms=6,
            mfc="none",
            label=label,
        )
    axes.set_title(fit.name, fontsize=10)
    axes.set_xlabel("pressure [bar]")
    axes.set_xlim(0.0, 1.06 * high / 1e5)
    axes.grid(alpha=0.25)


def _loop(axes: Any, fit: CylinderFriction, run: str) -> None:
    pairs = fit.pairs[run]
    _, position, pressure, force = pairs.record.rows()
    net = (
        force
        - fit.area * pressure
        - (fit.params["force_zero"].value if "force_zero" in fit.params else 0.0)
    )
    axes.axvspan(
        pairs.window[0] * 1e3,
        pairs.window[1] * 1e3,
        color=_GREY,
        alpha=0.13,
        lw=0,
        label="steady window",
    )
    for way, color, label in (
        (pairs.sign, _BLUE, "against the gas"),
        (-pairs.sign, _RED, "giving way"),
    ):
        for stroke in pairs.strokes:
            if stroke.direction == way:
                rows = slice(stroke.start, stroke.stop + 1)
                axes.plot(
                    position[rows] * 1e3, net[rows], color=color, lw=0.6, alpha=0.7, label=label
                )
                label = "_"
    turns = [stroke.start for stroke in pairs.strokes[1:]]
    axes.plot(position[turns] * 1e3, net[turns], ".", color="k", ms=5, label="reversals")
    level = next(level for level in (*fit.levels, *fit.held_out_levels) if level.name == run)
    if level.rest is not None and level.breakaway is not None:
        row = level.rest.row
        axes.plot(
            position[row] * 1e3,
            net[row],
            "v",
            color=_GREEN,
            ms=9,
            mfc="none",
            mew=1.6,
            label="breakaway from rest",
        )
    axes.margins(y=0.12)
    axes.set_title(
        f"{run}: loop of {len(pairs.strokes)} strokes, {level.pressure / 1e5:.1f} bar", fontsize=10
    )
    axes.set_xlabel("position [mm]")
    axes.set_ylabel("force - A p - zero [N]")
    axes.legend(fontsize=7.5, loc="center", frameon=False)
    axes.grid(alpha=0.25)


def _start(axes: Any, fit: CylinderFriction, run: str) -> None:
    pairs = fit.pairs[run]
    time, position, pressure, force = pairs.record.rows()
    net = (
        force
        - fit.area * pressure
        - (fit.params["force_zero"].value if "force_zero" in fit.params else 0.0)
    )
    moved = np.abs(position - position[0])
    begin = float(time[int(np.argmax(moved > 1e-4))])
    rows = (time >= begin - _BEFORE_REST) & (time <= begin + _AFTER_REST)
    axes.plot(
        time[rows] - begin, net[rows], ".-", color=_BLUE, lw=0.8, ms=4, label="force - A p - zero"
    )
    label = "logger paused"
    for start, stop in pairs.record.gaps:
        if start < begin + _AFTER_REST and stop > begin - _BEFORE_REST:
            axes.axvspan(start - begin, stop - begin, color=_RED, alpha=0.12, lw=0, label=label)
            label = "_"
    level = next(level for level in (*fit.levels, *fit.held_out_levels) if level.name == run)
    if level.rest is not None and level.breakaway is not None:
        row = level.rest.row
        axes.plot(
            time[row] - begin,
            net[row],
            "v",
            color=_GREEN,
            ms=9,
            mfc="none",
            mew=1.6,
            label=f"{level.breakaway:.1f} N",
        )
    axes.margins(y=0.12)
    axes.set_xlabel("time since the motion began [s]")
    axes.set_ylabel("force - A p - zero [N]")
    axes.set_title(f"{run}: the start from rest", fontsize=10)
    other = axes.twinx()
    other.plot(time[rows] - begin, moved[rows] * 1e3, color=_GREY, lw=1.0, ls="--", label="travel")
    other.set_ylabel("travel [mm]", color=_GREY)
    lines = [*axes.get_legend_handles_labels()[0], *other.get_legend_handles_labels()[0]]
    axes.legend(
        lines, [line.get_label() for line in lines], fontsize=7.5, loc="lower right", frameon=False
    )
    axes.grid(alpha=0.25)
