"""Figures of a fitted muscle, as SVG text to put into a page, or PNG bytes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pamrs.report.figures import COLOURS, STYLE, summary_figure, svg_text

if TYPE_CHECKING:
    from pamrs.fit._data import ForceMap
    from pamrs.fit._result import MuscleFit
    from pamrs.fit._statistics import FitStatistics

Array = NDArray[np.float64]

#: Colours and marks of compared models (after Okabe and Ito).
_SERIES: Final = (
    ("#0072b2", "o"),
    ("#d55e00", "s"),
    ("#009e73", "^"),
    ("#cc79a7", "D"),
    ("#c79a00", "v"),
    ("#56b4e9", "P"),
    ("#1f1f1f", "X"),
)
_QUIET, _INK = "#9aa3af", "#374151"
_MOST_POINTS = 3000
_FINE = 120  # points of a model line


@dataclass(frozen=True)
class ErrorCurve:
    """Error (2.37) of one model over pressure.

    Attributes
    ----------
    name : str
        The model.
    levels, rms : (m,) array
        Pressure [Pa] and error [1] of each level, all points fitted.
    fitted : (m,) bool array
        Whether the level was fitted.
    left_levels, left_rms : (k,) array
        The same where every fitted level in turn is predicted from the others; empty when that was
        not done.
    """

    name: str
    levels: Array
    rms: Array
    fitted: NDArray[np.bool_]
    left_levels: Array
    left_rms: Array


_LEAST_ERROR = 1e-7  # drawn for an exact fit: the axis is logarithmic


def pressure_colours(levels: Array) -> tuple[Any, Normalize]:
    """A map from pressure [kPa] to colours dark enough for lines on white, and its range."""
    steps = mpl.colormaps["viridis"](np.linspace(0.0, 0.88, 64))
    low, high = float(levels.min()) / 1e3, float(levels.max()) / 1e3
    return LinearSegmentedColormap.from_list("pressure", steps.tolist()), Normalize(
        low, high if high > low else low + 1.0
    )


def thinned(rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """At most ``_MOST_POINTS`` of some rows, evenly."""
    if len(rows) <= _MOST_POINTS:
        return rows
    return rows[np.linspace(0, len(rows) - 1, _MOST_POINTS).astype(np.intp)]


def _fitted_levels(fit: MuscleFit) -> set[int]:
    """Indices of the fitted levels in the map of the fit."""
    return set(fit.data.level[fit.fitted].tolist())


# ------------------------------------------------------------------------- family


def draw_family(axes: Axes, fit: MuscleFit, *, size: float = 26.0) -> Any:
    """Measured points and model lines over contraction, coloured by pressure; returns what a colour
    bar needs.
    """
    data = fit.data
    cmap, norm = pressure_colours(data.levels)
    contraction, shown = 100.0 * data.contraction, _fitted_levels(fit)
    _draw_unused(axes, data, contraction, size)
    force = data.force[data.used]
    largest = float(force.max())
    floor = min(float(force.min()), -0.04 * largest)
    for index, level in enumerate(data.levels.tolist()):
        rows = np.flatnonzero(data.level == index)
        colour = cmap(norm(level / 1e3))
        _draw_model(axes, fit, level, contraction[rows], floor, colour)
        rows = thinned(rows)
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
    off = thinned(np.flatnonzero((data.level < 0) & finite))
    used = contraction[data.used]
    low, high = float(used.min()), float(used.max())
    inside = off[(contraction[off] >= low - 20) & (contraction[off] <= high + 20)]
    if len(inside):
        style: dict[str, Any] = {"marker": "x", "s": 0.55 * size, "color": _QUIET, "lw": 0.8}
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


def family_svg(fit: MuscleFit, prefix: str = "family") -> str:
    """Force over contraction at every pressure, measured against model.

    Parameters
    ----------
    fit : MuscleFit
        Fitted muscle.
    prefix : str
        Prefix of the element ids.

    Returns
    -------
    str
        SVG element. Levels of the fit are filled, others open.
    """
    return _with_bar(partial(draw_family, fit=fit), 5.4, prefix, label="pressure [kPa]")


def _with_bar(draw: Callable[[Axes], Any], height: float, prefix: str, **bar: Any) -> str:
    """A panel with a colour bar beside it, as an SVG element."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10.0, height), layout="constrained")
        axes = figure.subplots()
        figure.colorbar(draw(axes), ax=axes, pad=0.015, **bar)
        return svg_text(figure, prefix)


# ------------------------------------------------------------------------- moduli


_Curve = tuple[Array, Array, Array]  # pressure, value and standard error, each (m,) [Pa]


def _coefficients(fit: FitStatistics | None) -> dict[str, _Curve]:
    """The moduli of a fit at its levels, by name."""
    if fit is None:
        return {}
    levels, values, stderr = fit.moduli()
    return {name: (levels, values[:, k], stderr[:, k]) for k, name in enumerate(fit.moduli_names)}


def _span(line: _Curve | None, points: _Curve | None) -> tuple[float, float]:
    """Limits [MPa] that show the line with its band and the points that are known well, whatever
    the wild ones do.
    """
    values = [] if line is None else [line[1] - 2 * line[2], line[1] + 2 * line[2]]
    if points is not None:
        known = points[2] <= 2 * float(np.median(points[2]))
        if line is not None:
            off = np.abs(points[1] - np.interp(points[0], line[0], line[1]))
            known = off <= 2 * float(np.ptp(np.concatenate(values)))
        values.append(points[1][known])
    everything = np.concatenate(values) / 1e6
    low, high = float(everything.min()), float(everything.max())
    room = 0.12 * (high - low) or 0.1 * max(abs(high), 1e-3)
    return low - room, high + room


def moduli_svg(
    fit: MuscleFit, per_level: FitStatistics | None = None, prefix: str = "moduli"
) -> str | None:
    """Moduli over pressure, with bands of two standard errors.

    Parameters
    ----------
    fit : MuscleFit
        Fitted muscle.
    per_level : FitStatistics, optional
        A fit with moduli free at each level, drawn as points with bars of two standard errors.
    prefix : str
        Prefix of the element ids.

    Returns
    -------
    str or None
        SVG element; None for a model without coefficients.
    """
    lines, points = _coefficients(fit), _coefficients(per_level)
    names = list(dict.fromkeys([*lines, *points]))
    if not names:
        return None
    columns = min(len(names), 4)
    rows = math.ceil(len(names) / columns)
    with mpl.rc_context(STYLE):
        size = (10.0 if columns > 1 else 5.6, 2.9 * rows + 0.3)
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(rows, columns, squeeze=False, sharex=True).ravel()
        for panel, name in zip(panels, names, strict=False):
            _draw_modulus(panel, lines.get(name), points.get(name))
            panel.set_title(name)
        for panel in panels[len(names) :]:
            panel.set_visible(False)
        for panel in panels[max(0, len(names) - columns) : len(names)]:
            panel.set_xlabel("pressure [kPa]")
        for start in range(0, len(panels), columns):
            panels[start].set_ylabel("modulus [MPa]")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=3)
        return svg_text(figure, prefix)


def _draw_modulus(axes: Axes, line: _Curve | None, points: _Curve | None) -> None:
    if line is not None:
        kpa, mpa, band = line[0] / 1e3, line[1] / 1e6, 2 * line[2] / 1e6
        shade: dict[str, Any] = {"color": COLOURS["after"], "alpha": 0.16, "lw": 0}
        axes.fill_between(kpa, mpa - band, mpa + band, label="± 2 standard errors", **shade)
        axes.plot(kpa, mpa, color=COLOURS["after"], lw=1.6, label="one fit of all levels")
    low, high = _span(line, points)
    if points is not None:
        kpa, mpa, bar = points[0] / 1e3, points[1] / 1e6, 2 * points[2] / 1e6
        colour = COLOURS["before"]
        _, _, bars = axes.errorbar(
            kpa, mpa, bar, fmt="o", ms=4, color=colour, elinewidth=0.9, label="each level alone"
        )
        for lines in bars:
            lines.set_alpha(0.35)
        outside = int(np.sum((mpa < low) | (mpa > high)))
        if outside:
            text = f"{outside} level{'s' if outside > 1 else ''} off the scale"
            place: dict[str, Any] = {"transform": axes.transAxes, "ha": "right"}
            axes.text(0.98, 0.03, text, fontsize="small", color=_INK, **place)
    axes.axhline(0.0, color="#6b7280", lw=0.7)
    axes.set_ylim(low, high)


# ------------------------------------------------------------------------- errors


def _draw_errors(axes: Axes, curves: Sequence[ErrorCurve], *, left: bool) -> None:
    """Error (2.37) of each model over pressure; ``left`` draws the predicted levels instead of the
    fitted ones.
    """
    shares = [curve.left_rms if left else curve.rms for curve in curves]
    drawn = [100 * np.maximum(share, _LEAST_ERROR) for share in shares]
    values = np.concatenate([np.ones(0), *drawn])
    if values.size:
        axes.set_ylim(values.min() / 1.6, values.max() * 1.6)
    axes.set_yscale("log")
    for curve, (colour, mark) in zip(curves, _SERIES * 3, strict=False):
        levels, rms = (curve.left_levels, curve.left_rms) if left else (curve.levels, curve.rms)
        rms = np.maximum(rms, _LEAST_ERROR)
        if not len(levels):
            continue
        fitted = np.zeros(len(levels), dtype=bool) if left else curve.fitted
        axes.plot(levels / 1e3, 100 * rms, color=colour, lw=1.1, zorder=2)
        for rows, face in ((fitted, colour), (~fitted, "white")):
            _dots(axes, levels[rows] / 1e3, 100 * rms[rows], colour, face, marker=mark, s=24)
        key: dict[str, Any] = {"marker": mark, "ms": 5, "mfc": "white" if left else colour}
        axes.plot([], [], color=colour, lw=1.1, label=curve.name, **key)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.yaxis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:e}"[0] in "25" else "")
    axes.tick_params(axis="y", which="minor", labelsize="small")
    axes.set_xlabel("pressure [kPa]")


def errors_svg(curves: Sequence[ErrorCurve], prefix: str = "errors") -> str:
    """Error (2.37) of each pressure level, fitted on the left, predicted from the other levels on
    the right.

    Parameters
    ----------
    curves : sequence of ErrorCurve
        One for each model.
    prefix : str
        Prefix of the element ids.

    Returns
    -------
    str
        SVG element.
    """
    both = any(len(curve.left_levels) for curve in curves)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10.0, 4.3 if len(curves) > 1 else 3.8), layout="constrained")
        panels = figure.subplots(1, 1 + int(both), sharey=True, squeeze=False)[0]
        _draw_errors(panels[0], curves, left=False)
        everything = all(curve.fitted.all() for curve in curves)
        some = "Fitted levels (filled) and others (open)"
        panels[0].set_title("Levels as fitted" if everything else some)
        panels[0].set_ylabel("rms error / largest force of the level [%]")
        if both:
            _draw_errors(panels[1], curves, left=True)
            panels[1].set_title("Each level predicted from the others")
        if len(curves) > 1:
            handles, labels = panels[0].get_legend_handles_labels()
            places: dict[str, Any] = {"loc": "outside lower center", "columnspacing": 1.4}
            figure.legend(handles, labels, ncols=min(len(curves), 7), **places)
        return svg_text(figure, prefix)


# ---------------------------------------------------------------------- residuals


def _draw_residuals(axes: Axes, fit: MuscleFit, *, size: float = 34.0) -> Any:
    """Residual over contraction and pressure; returns what a colour bar needs."""
    data = fit.data
    pressure, contraction, force, level, _ = data.used_rows()
    share = 100 * fit.all_residuals / float(force.max())
    limit = max(float(np.percentile(np.abs(share), 98)), 1e-6)
    keep = thinned(np.arange(len(share)))
    fitted = np.isin(level, list(_fitted_levels(fit)))
    colours = None
    style: dict[str, Any] = {"cmap": "RdBu_r", "vmin": -limit, "vmax": limit, "s": size}
    for rows, mark in ((keep[fitted[keep]], "o"), (keep[~fitted[keep]], "s")):
        if len(rows):
            x, y = 100 * contraction[rows], pressure[rows] / 1e3
            style |= {"marker": mark, "edgecolor": "#4b5563", "lw": 0.6}
            colours = axes.scatter(x, y, c=share[rows], **style)
    axes.set_xlabel("contraction [%]")
    axes.set_ylabel("pressure [kPa]")
    axes.margins(0.05)
    return colours


def residuals_svg(fit: MuscleFit, prefix: str = "residuals") -> str:
    """Measured minus model over contraction and pressure.

    Parameters
    ----------
    fit : MuscleFit
        Fitted muscle.
    prefix : str
        Prefix of the element ids.

    Returns
    -------
    str
        SVG element. Points of levels that the fit left out are squares.
    """
    label = "measured − model [% of the largest force]"
    return _with_bar(partial(_draw_residuals, fit=fit), 4.2, prefix, label=label, extend="both")


# ------------------------------------------------------------------------ summary


def summary_png(fit: MuscleFit, curves: Sequence[ErrorCurve], title: str) -> bytes:
    """One picture: family of curves, error by pressure, residuals.

    Parameters
    ----------
    fit : MuscleFit
        Fitted muscle.
    curves : sequence of ErrorCurve
        Errors of the models to show.
    title : str
        Headline.

    Returns
    -------
    bytes
        PNG of 1600 x 1000 pixels.
    """
    with summary_figure(title, 84) as (figure, finished):
        left, right = figure.subfigures(1, 2, width_ratios=[1.35, 1.0], squeeze=False)[0]
        axes = left.subplots()
        bar: dict[str, Any] = {"location": "bottom", "pad": 0.02, "aspect": 40}
        left.colorbar(draw_family(axes, fit, size=20.0), ax=axes, label="pressure [kPa]", **bar)
        axes.set_title("Force: measured against model")
        upper, lower = right.subplots(2, 1, gridspec_kw={"height_ratios": [1.25, 1.0]})
        _draw_errors(upper, curves, left=False)
        dashed: dict[str, Any] = {"lw": 0.9, "ls": (0, (4, 2))}
        for curve, (colour, _) in zip(curves, _SERIES * 3, strict=False):
            if len(curve.left_levels):
                rms = 100 * curve.left_rms
                upper.plot(curve.left_levels / 1e3, rms, color=colour, **dashed)
        upper.set_title("Error by pressure (dashed: left out)")
        upper.set_ylabel("rms / largest force [%]")
        if len(curves) > 1:
            place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.45, -0.22)}
            upper.legend(ncols=3, fontsize=7.0, columnspacing=1.0, **place)
        colours = _draw_residuals(lower, fit, size=26.0)
        squares = " (squares: left out)" if np.any(~fit.fitted & fit.data.used) else ""
        lower.set_title(f"Residual{squares}")
        right.colorbar(colours, ax=lower, label="measured − model [%]", extend="both", pad=0.02)
        return finished()
