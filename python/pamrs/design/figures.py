"""The picture of a joint design: search history, torque, the joint at its limits, methods, and
pressure against size.
"""

from __future__ import annotations

import io
import math
import textwrap
from collections.abc import Callable
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from pamrs.design._joint_design import JointDesign, MethodComparison
from pamrs.design._pressure import ParetoFront
from pamrs.design._problem import SYMBOLS
from pamrs.report.figures import COLOURS, STYLE

_SERIES: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
_QUIET, _INK, _PLATE, _MUSCLE = "#9aa3af", "#374151", "#e5e7eb", "#c79a00"
_NAMES: Final = {
    "ga": "genetic\n(3.5)",
    "de": "differential\nevolution",
    "cma": "CMA-ES",
    "random": "random\npoints",
}


def summary_png(
    design: JointDesign,
    title: str,
    *,
    comparison: MethodComparison | None = None,
    front: ParetoFront | None = None,
) -> bytes:
    """One picture of a design.

    Parameters
    ----------
    design : JointDesign
        Result of a search, or a given design (then without its history).
    title : str
        Headline.
    comparison : MethodComparison, optional
        Adds a panel: best objective of every run by method.
    front : ParetoFront, optional
        Adds a panel: pressure against size.

    Returns
    -------
    bytes
        PNG, 1600 pixels wide.
    """
    panels: list[tuple[str, Callable[[Axes], None]]] = []
    if design.search is not None:
        panels += [
            ("Fitness by generation", lambda axes: _fitness(axes, design)),
            ("Lengths by generation", lambda axes: _lengths(axes, design)),
        ]
    panels += [
        ("Torque over the range", lambda axes: _torque(axes, design)),
        (f"The joint at its limits: {_sizes(design)} mm", lambda axes: _joint(axes, design)),
    ]
    if comparison is not None:
        name = "Best objective of each run, equal evaluations"
        panels.append((name, lambda axes: _methods(axes, comparison)))
    if front is not None:
        panels.append(("Pressure needed against size", lambda axes: _front(axes, front, design)))
    rows = -(-len(panels) // 2)
    with mpl.rc_context({**STYLE, "font.size": 8.5, "legend.fontsize": 8.0}):
        figure = Figure(figsize=(10.0, 0.5 + 3.3 * rows), dpi=160, layout="constrained")
        figure.get_layout_engine().set(w_pad=0.1, h_pad=0.1, wspace=0.04, hspace=0.04)  # type: ignore[union-attr, call-arg]
        headed(figure, title, 92, 13)
        grid = figure.subplots(rows, 2, squeeze=False).ravel()
        for axes, (name, draw) in zip(grid, panels, strict=False):
            axes.set_title(name)
            draw(axes)
        for axes in grid[len(panels) :]:
            axes.set_visible(False)
        return png(figure)


def headed(figure: Figure, title: str, width: int, size: float) -> None:
    """Put a title over a picture, in lines of so many characters."""
    text = "\n".join(textwrap.wrap(title, width))
    style = {"fontsize": size, "fontweight": "bold", "color": "#111827"}
    figure.suptitle(text, x=0.012, ha="left", **style)


def png(figure: Figure) -> bytes:
    """A picture as PNG."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    return stream.getvalue()


def fill_lack(axes: Axes, angle: Any, given: Any, wanted: Any, *, alpha: float) -> None:
    """Fill what is missing of a torque between it and the one that is wanted."""
    style: dict[str, Any] = {"color": COLOURS["before"], "alpha": alpha, "lw": 0}
    axes.fill_between(angle, given, wanted, where=given < wanted, interpolate=True, **style)


def _note(axes: Axes, text: str, at: Any, offset: tuple[float, float], **style: Any) -> None:
    """Write a few words beside a place, so many points off."""
    axes.annotate(text, at, offset, textcoords="offset points", **style)


def _sizes(design: JointDesign) -> str:
    return ", ".join(
        f"{symbol} {1e3 * value:.1f}"
        for symbol, value in zip(SYMBOLS, design.lengths.tolist(), strict=True)
    )


def _history(design: JointDesign) -> Any:
    assert design.search is not None
    return design.search.history


def _fitness(axes: Axes, design: JointDesign) -> None:
    """Figure 3.20: best of all so far, and the middle of each generation."""
    history = _history(design)
    generation = np.arange(len(history.best))
    top = 3.0 * float(history.best[0])  # what is above, mostly by the penalty, lies on the edge
    axes.plot(
        generation,
        np.minimum(history.middle, top),
        ".",
        ms=3.5,
        color=_QUIET,
        label="median of the generation",
        clip_on=False,
    )
    axes.step(generation, history.best, where="post", color=_SERIES[0], lw=1.6, label="best so far")
    _log_scale(axes)
    axes.set_ylim(0.7 * float(history.best[-1]), top)
    at = (generation[-1], history.best[-1])
    _note(axes, f"{history.best[-1]:.4g} J", at, (0, 12), ha="right", color=_SERIES[0])
    method = _NAMES[design.search.method].replace("\n", " ")  # type: ignore[union-attr]
    axes.set(xlabel=f"generation ({method})", ylabel="J [J]")
    axes.legend(loc="upper right")


def _log_scale(axes: Axes) -> None:
    """A logarithmic axis with plain numbers."""
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=12))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def _lengths(axes: Axes, design: JointDesign) -> None:
    """Figure 3.21: the best design's lengths."""
    history = _history(design)
    generation = np.arange(len(history.best))
    values = 1e3 * history.points
    span = max(float(np.ptp(values)), 1.0)
    ends = _spread(values[-1], 0.075 * span)
    for column, (symbol, colour) in enumerate(zip(SYMBOLS, _SERIES, strict=True)):
        axes.step(generation, values[:, column], where="post", color=colour, lw=1.5)
        text, edge = f"{symbol} {values[-1, column]:.1f}", ("axes fraction", "data")
        at = (1.0, ends[column])
        _note(axes, text, at, (4, 0), xycoords=edge, va="center", color=colour)
    axes.set(xlabel="generation", ylabel="length [mm]")
    axes.set_ylim(values.min() - 0.08 * span, values.max() + 0.08 * span)


def _spread(values: Any, gap: float) -> Any:
    """Positions of labels, in the order of the values and at least a gap apart."""
    order = np.argsort(values)
    placed = np.array(values, dtype=np.float64)
    for below, above in zip(order[:-1], order[1:], strict=True):
        placed[above] = max(placed[above], placed[below] + gap)
    return placed


def _torque(axes: Axes, design: JointDesign) -> None:
    """Figures 3.22 to 3.24: threshold, first generation, result; what is missing is filled."""
    problem, scores = design.problem, design.scores
    angle, torque = np.degrees(problem.angles), scores.torque[0]
    fill_lack(axes, angle, torque, problem.torque, alpha=0.25)
    axes.axhline(
        problem.torque,
        color=_INK,
        lw=1.1,
        ls=(0, (5, 2)),
        label=f"wanted, {problem.torque:.4g} N m",
    )
    if design.search is not None:
        first = problem.evaluate(_history(design).points[0])
        axes.plot(
            angle, first.torque[0], color=_QUIET, lw=1.3, label="best of the first generation"
        )
    axes.plot(
        angle, torque, color=_SERIES[0], lw=1.8, label=f"result at {problem.pressure / 1e5:.4g} bar"
    )
    if not scores.available[0]:
        limit, colour = math.degrees(scores.max_angle[0]), COLOURS["before"]
        axes.axvline(limit, color=colour, lw=1.0)
        text, foot = "limit of the stroke or the tendon", ("data", "axes fraction")
        _note(axes, text, (limit, 0.03), (-4, 0), xycoords=foot, ha="right", color=colour)
    axes.set(xlabel="joint angle [deg]", ylabel="torque [N m]")
    axes.set_ylim(0.0, 1.3 * max(problem.torque, float(torque.max())))
    axes.legend(loc="upper right", ncols=2)


def _joint(axes: Axes, design: JointDesign) -> None:
    """Links, plate, tendon and the muscles' end at both ends of the range, to scale."""
    problem = design.problem
    upper_axial, upper_offset, lower_axial, lower_offset = (1e3 * design.lengths).tolist()
    reach = 1.25e3 * design.size
    lean = math.atan2(lower_offset, lower_axial)
    last = float(design.scores.max_angle[0])
    axes.plot([0.0, reach], [0.0, 0.0], color=_INK, lw=5, solid_capstyle="round", zorder=1)
    for index, angle in enumerate((problem.min_angle, last)):
        colour = (_QUIET, _SERIES[0])[index]
        stroke = 1e3 * float(design.joint.shortening(angle))
        along = math.pi - angle
        direction = np.array([math.cos(along), math.sin(along)])
        foot = lower_axial * direction
        end = math.hypot(lower_axial, lower_offset) * np.array(
            [math.cos(along - lean), math.sin(along - lean)]
        )
        pin = np.array([upper_axial + stroke, upper_offset])
        axes.plot(
            *np.stack([np.zeros(2), reach * direction]).T,
            color=colour,
            lw=5,
            solid_capstyle="round",
            zorder=1,
            alpha=0.75,
        )
        axes.add_patch(
            Polygon(
                [(0.0, 0.0), tuple(foot), tuple(end)],
                facecolor=_PLATE,
                edgecolor=colour,
                lw=1.2,
                zorder=2,
            )
        )
        axes.plot(
            *np.stack([pin, end]).T, color=colour, lw=1.8, marker="o", ms=5, mfc="white", zorder=4
        )
        axes.plot(
            [pin[0], reach],
            [pin[1], pin[1]],
            color=_MUSCLE,
            lw=(4.5, 9.0)[index],
            alpha=(0.9, 0.45)[index],
            zorder=3 - index,
        )
        place = 1.13 * reach * direction
        axes.plot(*(1.1 * place), alpha=0.0)  # room for the angle
        axes.annotate(
            f"{math.degrees(angle):.4g} deg", tuple(place), ha="center", va="center", color=_INK
        )
    axes.plot(0.0, 0.0, "o", ms=8, color=_INK, zorder=5)
    _note(axes, "muscles", (reach, upper_offset), (0, 9), ha="right", color=_INK)
    _note(axes, "upper link", (reach, 0.0), (0, -13), ha="right", color=_INK)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    axes.grid(visible=False)
    axes.set(xlabel="along the upper link [mm]", ylabel="[mm]")


def _methods(axes: Axes, comparison: MethodComparison) -> None:
    """Every run as a point, medians as bars."""
    worst = 1.0
    for index, values in enumerate(comparison.fitness):
        spread = index + np.linspace(-0.18, 0.18, len(values)) if len(values) > 1 else [index]
        axes.plot(spread, values, "o", ms=4, color=_SERIES[index % 4], alpha=0.75, mew=0)
        axes.plot([index - 0.3, index + 0.3], [np.median(values)] * 2, color=_INK, lw=1.6)
        worst = max(worst, float(values.max() / comparison.fitness.min()))
    if worst > 3.0:
        _log_scale(axes)
    axes.set_xticks(range(len(comparison.methods)), [_NAMES[name] for name in comparison.methods])
    axes.grid(visible=False, axis="x")
    axes.set(ylabel=f"J after {int(comparison.evaluations.max())} evaluations [J]")


def _front(axes: Axes, front: ParetoFront, design: JointDesign) -> None:
    """The front, the smallest pressure any joint needs, and the design."""
    if len(front.size):
        axes.plot(
            1e3 * front.size,
            front.pressure / 1e5,
            "o-",
            ms=3,
            lw=0.9,
            color=_SERIES[0],
            label="none is better in both",
        )
    least = design.problem.least_possible_pressure() / 1e5
    axes.axhline(
        least, color=_INK, lw=1.0, ls=(0, (5, 2)), label="work of the stroke: no joint needs less"
    )
    needed = design.needed_pressure
    if needed is not None:
        axes.plot(
            1e3 * design.size, needed / 1e5, "*", ms=12, color=_SERIES[1], label="this design"
        )
    values = [least, *(front.pressure / 1e5), *([] if needed is None else [needed / 1e5])]
    axes.set_ylim(0.0, min(1.1 * max(values), 5.0 * least))
    axes.set(
        xlabel="radius about the axis that holds the tendon's ends [mm]", ylabel="pressure [bar]"
    )
    axes.legend(loc="upper right")
