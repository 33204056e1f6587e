"""The figure of a fitted muscle: family of curves, error by pressure, residuals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, Normalize

from pamrs._arrays import Array, Index
from pamrs.errors import FitError
from pamrs.report.figures import COLOURS, summary_figure
from pamrs.report.words import format_number

if TYPE_CHECKING:
    from pamrs.fit._data import ForceMap
    from pamrs.fit._result import MuscleFit


_GREY, _INK = "#9aa3af", "#374151"
_MOST_POINTS = 3000
_FINE = 120  # points of a model line
_LEAST_ERROR: Final = 1e-7  # drawn for an exact fit: the axis is logarithmic


def summary_png(fit: MuscleFit) -> bytes:
    """One picture of 1600 x 1000 pixels, PNG: family of curves, error by pressure, residuals."""
    with summary_figure(headline(fit), 84) as (figure, finished):
        left, right = figure.subfigures(1, 2, width_ratios=[1.35, 1.0], squeeze=False)[0]
        axes = left.subplots()
        bar: dict[str, Any] = {"location": "bottom", "pad": 0.02, "aspect": 40}
        left.colorbar(draw_family(axes, fit, size=20.0), ax=axes, label="pressure [kPa]", **bar)
        axes.set_title("Force: measured against model")
        upper, lower = right.subplots(2, 1, gridspec_kw={"height_ratios": [1.25, 1.0]})
        _draw_errors(upper, fit)
        colours = _draw_residuals(lower, fit)
        squares = " (squares: left out)" if np.any(~fit.fitted & fit.data.used) else ""
        lower.set_title(f"Residual{squares}")
        right.colorbar(colours, ax=lower, label="measured − model [%]", extend="both", pad=0.02)
        return finished()


def headline(fit: MuscleFit) -> str:
    """The result in one line."""
    named = f"{fit.model} model" + ("" if fit.order is None else f" of order {fit.order}")
    held_out = fit.errors_of("held_out")
    rms, worst = held_out or (fit.rms_error, fit.max_error)
    errors = f"{_percent(worst)} of the largest force, {_percent(rms)} rms"
    if held_out is None:
        return f"The {named} meets every point within {errors}"
    seen = len(_fitted_levels(fit))
    others = len(fit.data.levels) - seen
    return f"Fitted on {seen} pressures, the {named} predicts the other {others} within {errors}"


def _percent(share: float) -> str:
    return f"{format_number(100 * share, 2)} %"


def _pressure_colours(levels: Array) -> tuple[Any, Normalize]:
    """A map from pressure [kPa] to colours dark enough for lines on white, and its range."""
    steps = mpl.colormaps["viridis"](np.linspace(0.0, 0.88, 64))
    low, high = float(levels.min()) / 1e3, float(levels.max()) / 1e3
    return LinearSegmentedColormap.from_list("pressure", steps.tolist()), Normalize(
        low, high if high > low else low + 1.0
    )


def _thinned(rows: Index) -> Index:
    """At most ``_MOST_POINTS`` of some rows, evenly."""
    if len(rows) <= _MOST_POINTS:
        return rows
    return rows[np.linspace(0, len(rows) - 1, _MOST_POINTS).astype(np.intp)]


def _fitted_levels(fit: MuscleFit) -> set[int]:
    """Indices of the fitted levels in the map of the fit."""
    return set(fit.data.level[fit.fitted].tolist())


def draw_family(axes: Axes, fit: MuscleFit, *, size: float = 26.0) -> Any:
    """Measured points and model lines over contraction, coloured by pressure; returns what a colour
    bar needs.
    """
    data = fit.data
    cmap, norm = _pressure_colours(data.levels)
    contraction, shown = 100.0 * data.contraction, _fitted_levels(fit)
    _draw_unused(axes, data, contraction, size)
    force = data.force[data.used]
    largest = float(force.max())
    floor = min(float(force.min()), -0.04 * largest)
    for index, level in enumerate(data.levels.tolist()):
        rows = np.flatnonzero(data.level == index)
        colour = cmap(norm(level / 1e3))
        _draw_model(axes, fit, level, contraction[rows], floor, colour)
        rows = _thinned(rows)
        face = colour if index in shown else "white"
        _dots(axes, contraction[rows], data.force[rows], colour, face, s=size)
    _family_legend(axes, fit, size)
    axes.set_ylim(floor - 0.02 * largest, 1.06 * largest)
    axes.set_xlabel("contraction [%]")
    axes.set_ylabel("pulling force [N]")
    axes.legend(loc="upper right")
    return mpl.cm.ScalarMappable(norm, cmap)


def _dots(axes: Axes, x: Any, y: Any, edge: Any, face: Any, **style: Any) -> None:
    """Marks of one colour, open ones with a white face."""
    axes.scatter(x, y, facecolor=face, edgecolor=edge, lw=1.1, zorder=3, **style)


def _draw_unused(axes: Axes, data: ForceMap, contraction: Array, size: float) -> None:
    """Crosses at the rows that are not used, as far as they are near the others."""
    finite = np.isfinite(contraction) & np.isfinite(data.force)
    off = _thinned(np.flatnonzero((data.level < 0) & finite))
    used = contraction[data.used]
    low, high = float(used.min()), float(used.max())
    inside = off[(contraction[off] >= low - 20) & (contraction[off] <= high + 20)]
    if len(inside):
        style: dict[str, Any] = {"marker": "x", "s": 0.55 * size, "color": _GREY, "lw": 0.8}
        axes.scatter(contraction[inside], data.force[inside], label="not used", **style)


def _draw_model(
    axes: Axes, fit: MuscleFit, level: float, contraction: Array, floor: float, colour: Any
) -> None:
    """The model at one pressure: a line where it was measured, dotted beyond, dashed while
    lengthening.
    """
    data, shown = fit.data, sorted(_fitted_levels(fit))
    fitted = data.levels[shown]
    if fit.moduli_kind != "linear" and not fitted.min() <= level <= fitted.max():
        return  # free moduli have no law beyond
    used = 100.0 * data.contraction[data.used]
    grid = np.linspace(float(used.min()), float(used.max()), _FINE)
    lengths = (1.0 - grid / 100.0) * data.rest_length
    own = (grid >= contraction.min() - 1e-9) & (grid <= contraction.max() + 1e-9)
    ways: list[tuple[float | None, Any]] = [(-1.0, "-"), (1.0, (0, (5, 2)))]
    for way, dash in ways if np.any(data.direction[data.used]) else [(None, "-")]:
        force = fit.predict(level, length=lengths, direction=way)
        beyond = np.where(force > floor, force, np.nan)
        axes.plot(grid, beyond, color=colour, lw=0.8, ls=(0, (1, 2)))
        axes.plot(grid[own], force[own], color=colour, lw=1.3, ls=dash)


def _family_legend(axes: Axes, fit: MuscleFit, size: float) -> None:
    """One entry for each kind of point and line."""
    data, both = fit.data, bool(np.any(fit.data.direction[fit.data.used]))
    part = _fitted_levels(fit) != set(range(len(data.levels)))
    kinds = {"measured, fitted": _INK, "measured, left out of the fit": "white"}
    for label, face in kinds.items() if part else [("measured", _INK)]:
        _dots(axes, [], [], _INK, face, s=size, label=label)
    axes.plot([], [], color=_INK, lw=1.3, label="model, contracting" if both else "model")
    if both:
        axes.plot([], [], color=_INK, lw=1.3, ls=(0, (5, 2)), label="model, lengthening")
    axes.plot([], [], color=_INK, lw=0.8, ls=(0, (1, 2)), label="model beyond the level's data")


def _draw_errors(axes: Axes, fit: MuscleFit) -> None:
    """Error (2.37) of each level; dashed where it is predicted from the other levels."""
    errors = fit.error_by_pressure()
    kpa, share = errors.levels / 1e3, 100 * np.maximum(errors.rms, _LEAST_ERROR)
    axes.set_ylim(share.min() / 1.6, share.max() * 1.6)
    axes.set_yscale("log")
    colour = COLOURS["after"]
    axes.plot(kpa, share, color=colour, lw=1.1, zorder=2)
    for rows, face in ((errors.fitted, colour), (~errors.fitted, "white")):
        _dots(axes, kpa[rows], share[rows], colour, face, marker="o", s=24)
    try:
        left_out = fit.leave_one_pressure_out().by_pressure
        dashed: dict[str, Any] = {"lw": 0.9, "ls": (0, (4, 2)), "color": colour}
        axes.plot(left_out.levels / 1e3, 100 * left_out.rms, **dashed)
    except FitError:
        pass  # the text says why the levels cannot be predicted from each other
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.yaxis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:e}"[0] in "25" else "")
    axes.tick_params(axis="y", which="minor", labelsize="small")
    axes.set_xlabel("pressure [kPa]")
    axes.set_ylabel("rms / largest force [%]")
    axes.set_title("Error by pressure (dashed: left out)")


def _draw_residuals(axes: Axes, fit: MuscleFit) -> Any:
    """Residual over contraction and pressure; returns what a colour bar needs."""
    data = fit.data
    pressure, contraction, force, level, _ = data.used_rows()
    share = 100 * fit.all_residuals / float(force.max())
    limit = max(float(np.percentile(np.abs(share), 98)), 1e-6)
    keep = _thinned(np.arange(len(share)))
    fitted = np.isin(level, list(_fitted_levels(fit)))
    colours = None
    style: dict[str, Any] = {"cmap": "RdBu_r", "vmin": -limit, "vmax": limit, "s": 26.0}
    for rows, mark in ((keep[fitted[keep]], "o"), (keep[~fitted[keep]], "s")):
        if len(rows):
            x, y = 100 * contraction[rows], pressure[rows] / 1e3
            style |= {"marker": mark, "edgecolor": "#4b5563", "lw": 0.6}
            colours = axes.scatter(x, y, c=share[rows], **style)
    axes.set_xlabel("contraction [%]")
    axes.set_ylabel("pressure [kPa]")
    axes.margins(0.05)
    return colours
