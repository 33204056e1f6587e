"""Figures of a diagnosis, as SVG text to put into a page, or PNG bytes."""

from __future__ import annotations

import io
import math
import re
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from pamrs.findings import BudgetTerm, ConditionMap, Curves, Findings, Trace
from pamrs.report.text import (
    blocks_label,
    budgets,
    display_unit,
    format_number,
    format_probability,
    format_share,
    headline,
    hypothesis_label,
    is_named,
    is_number,
    label,
    noise_alone,
    ranked_probabilities,
    spoken_name,
    told_probabilities,
    told_terms,
)

__all__ = [
    "COLOURS",
    "STYLE",
    "blocks_svg",
    "budget_svg",
    "decimate",
    "legend_above",
    "map_svg",
    "png_bytes",
    "separating_curves",
    "summary_figure",
    "summary_png",
    "svg_text",
    "telling_trace",
    "traces_svg",
]

COLOURS = {
    "measured": "#1f1f1f",
    "before": "#d55e00",
    "refit": "#c79a00",
    "after": "#0072b2",
    "quiet": "#b9bec6",
}
"""Colours of the curves (after Okabe and Ito: told apart by colour-blind readers and in grey
print)."""

CHAIN = ("supply", "valve", "line", "chamber", "muscle", "joint", "arm", "sensors")
MAX_POINTS = 1500

FloatArray = npt.NDArray[np.float64]

STYLE: Any = {
    "svg.fonttype": "none",
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#6b7280",
    "axes.labelcolor": "#374151",
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e7e9ed",
    "grid.linewidth": 0.7,
    "xtick.color": "#6b7280",
    "ytick.color": "#6b7280",
    "xtick.labelcolor": "#374151",
    "ytick.labelcolor": "#374151",
    "legend.frameon": False,
    "legend.fontsize": 9.0,
    "path.simplify_threshold": 0.3,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
}
"""Matplotlib settings of every figure."""
_SMALL: Any = {"font.size": 8.5, "legend.fontsize": 8.0, "axes.labelsize": 8.5}
"""Those of a summary that are others."""


def decimate(
    time: FloatArray, values: FloatArray, points: int = MAX_POINTS
) -> tuple[FloatArray, FloatArray]:
    """Thin a curve for drawing, keeping the extremes of every stretch.

    Parameters
    ----------
    time, values : ndarray, shape (n,)
        Curve; NaN in `values` are gaps.
    points : int
        Largest number of points returned.

    Returns
    -------
    tuple of ndarray
        Times and values of at most `points` samples, in order; a stretch that is all NaN stays a
        gap.
    """
    n = len(time)
    if n <= points:
        return time, values
    edges = np.linspace(0, n, points // 2 + 1).astype(np.int64)
    chosen: list[int] = []
    for start, stop in zip(edges[:-1], edges[1:], strict=True):
        part = values[start:stop]
        if np.all(np.isnan(part)):
            chosen.append(int(start))
        else:
            chosen.extend(
                sorted({int(start + np.nanargmin(part)), int(start + np.nanargmax(part))})
            )
    index = np.asarray(chosen, dtype=np.int64)
    return time[index], values[index]


def _rms(values: FloatArray | None) -> float:
    if values is None or not np.any(np.isfinite(values)):
        return math.nan
    return float(np.sqrt(np.nanmean(np.square(values))))


def _largest(*curves: FloatArray | None) -> float:
    sizes = [
        float(np.nanmax(np.abs(c))) for c in curves if c is not None and np.any(np.isfinite(c))
    ]
    return max(sizes, default=math.nan)


def _has(values: FloatArray | None, besides: FloatArray | None = None) -> bool:
    """Whether a curve has data and differs from another one."""
    if values is None or not np.any(np.isfinite(values)):
        return False
    return besides is None or not np.allclose(values, besides, equal_nan=True)


def telling_trace(diagnosis: Findings) -> Trace | None:
    """Trace that shows the most: the telling channel, held out if possible, with the largest
    improvement.
    """
    if not diagnosis.traces:
        return None
    channel = diagnosis.where.channel

    def merit(trace: Trace) -> tuple[bool, bool, float]:
        gain = _rms(trace.residual_before) / max(_rms(trace.residual_after), 1e-300)
        return (
            trace.channel == channel,
            trace.role == "held_out",
            gain if math.isfinite(gain) else 0.0,
        )

    return max(diagnosis.traces, key=merit)


def _noise(diagnosis: Findings, trace: Trace) -> float | None:
    parts = [diagnosis.fit.channels, diagnosis.fit.held_out]
    for part in reversed(parts) if trace.role == "held_out" else parts:
        noise = part[trace.channel].noise if trace.channel in part else None
        if is_number(noise) and noise > 0:
            return noise
    return None


def _draw_curves(axes: Axes, trace: Trace, *, width: float = 1.2) -> None:
    """Measured and simulated signals."""
    unit, factor = display_unit(trace.unit, _largest(trace.measured))

    def plot(values: FloatArray, name: str, text: str, **kw: Any) -> None:
        x, y = decimate(trace.time, values)
        axes.plot(x, y * factor, color=COLOURS[name], label=text, **kw)

    plot(trace.measured, "measured", "measured", lw=2.1 * width, alpha=0.9)
    plot(trace.before, "before", "before", lw=width)
    if trace.refit is not None and _has(trace.refit, trace.before):
        plot(trace.refit, "refit", "parameters refitted", lw=width, ls=(0, (5, 2)))
    if trace.after is not None and _has(trace.after, trace.refit):
        plot(trace.after, "after", "after: with what was found", lw=width)
    axes.set_ylabel(
        f"{spoken_name(trace.channel)} [{unit}]" if unit else spoken_name(trace.channel)
    )


def _draw_residuals(axes: Axes, trace: Trace, noise: float | None, *, width: float = 1.0) -> None:
    """Residuals of the refitted baseline and with the effect, over a band of two noise
    deviations.
    """
    before, after = trace.residual_before, trace.residual_after
    unit, factor = display_unit(trace.unit, _largest(before, after))
    if noise is not None:
        axes.axhspan(
            -2 * noise * factor, 2 * noise * factor, color="#dfe3e8", lw=0, label="noise (± 2 std)"
        )
    axes.axhline(0.0, color="#6b7280", lw=0.7)
    # in the colours of the curves above: what is left before the effect is what the refit leaves,
    # where there was one
    refitted = trace.refit is not None and _has(trace.refit, trace.before)
    first = ("refit", "parameters refitted") if refitted else ("before", "before")
    for values, name, text in ((before, *first), (after, "after", "with what was found")):
        if values is not None and _has(values, before if name == "after" else None):
            x, y = decimate(trace.time, values)
            axes.plot(x, y * factor, color=COLOURS[name], lw=width, label=text)
    axes.set_ylabel(f"residual [{unit}]" if unit else "residual")


def legend_above(axes: Axes, *, columns: int = 4) -> None:
    """Legend in one line above the axes, flush right."""
    place: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0)}
    axes.legend(ncols=columns, borderaxespad=0.1, handlelength=1.8, columnspacing=1.3, **place)


def _shade(axes: Axes, diagnosis: Findings, trace: Trace) -> None:
    """Mark the intervals that carry the excess, where they are known to belong to this
    recording.
    """
    if diagnosis.where.recording == trace.recording:
        for start, stop in diagnosis.where.intervals:
            axes.axvspan(start, stop, color="#f5e6b8", alpha=0.5, lw=0, zorder=0)


def png_bytes(figure: Figure) -> bytes:
    """A figure as PNG, with the dots per inch that it was made with."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=figure.dpi)
    return stream.getvalue()


@contextmanager
def summary_figure(
    title: str, letters: int, size: float = 15.0, height: float = 6.25
) -> Iterator[tuple[Figure, Callable[[], bytes]]]:
    """A picture of 1600 pixels with a headline, and what gives it as PNG.

    Parameters
    ----------
    title : str
        The headline.
    letters : int
        In a line of it.
    size, height : float
        Of its letters [points] and of the picture [inch].
    """
    with mpl.rc_context(STYLE | _SMALL):
        figure = Figure(figsize=(10.0, height), dpi=160, layout="constrained")
        room = {"w_pad": 0.12, "h_pad": 0.06, "wspace": 0.03, "hspace": 0.03}
        figure.get_layout_engine().set(**room)  # type: ignore[union-attr]
        style: dict[str, Any] = {"fontsize": size, "fontweight": "bold", "color": "#111827"}
        figure.suptitle("\n".join(textwrap.wrap(title, letters)), x=0.012, ha="left", **style)
        yield figure, lambda: png_bytes(figure)


def svg_text(figure: Figure, prefix: str) -> str:
    """SVG element without prolog; ids carry `prefix` so that several can share a page."""
    stream = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": prefix}):
        none: dict[str, Any] = {"Date": None, "Creator": None, "Format": None, "Type": None}
        figure.savefig(stream, format="svg", metadata=none)
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r'\bid="', f'id="{prefix}-', text)
    text = text.replace("url(#", f"url(#{prefix}-").replace('href="#', f'href="#{prefix}-')
    text = re.sub(
        r' width="[\d.]+pt"', "", re.sub(r' height="[\d.]+pt"', "", text, count=1), count=1
    )
    return text.strip()


def traces_svg(diagnosis: Findings, traces: Sequence[Trace], prefix: str) -> str:
    """Measured and simulated channels of one recording, each with its residual below.

    Parameters
    ----------
    diagnosis : Findings
        For noise levels and marked intervals.
    traces : sequence of Trace
        Channels of one recording, at least one.
    prefix : str
        Prefix of the element ids.

    Returns
    -------
    str
        SVG element.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10.0, 3.7 * len(traces) + 0.3), layout="constrained")
        axes = figure.subplots(
            2 * len(traces),
            1,
            sharex=True,
            squeeze=False,
            gridspec_kw={"height_ratios": [2.0, 1.1] * len(traces)},
        )[:, 0]
        for i, trace in enumerate(traces):
            upper, lower = axes[2 * i], axes[2 * i + 1]
            _draw_curves(upper, trace)
            _draw_residuals(lower, trace, _noise(diagnosis, trace))
            for panel in (upper, lower):
                _shade(panel, diagnosis, trace)
                legend_above(panel)
                panel.margins(x=0.005)
            figure.align_ylabels([upper, lower])
        axes[-1].set_xlabel("time [s]")
        figure.align_ylabels(list(axes))
        return svg_text(figure, prefix)


HYPOTHESES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#c79a00", "#56b4e9")
"""Colours of hypotheses, the leading one first (Okabe and Ito)."""


def separating_curves(curves: Curves, prefix: str = "next") -> str:
    """The next experiment as every hypothesis predicts it, and what each cannot explain of the
    leading one's outcome.

    Parameters
    ----------
    curves : Curves
        Those of the next experiment.
    prefix : str
        Prefix of the element ids.

    Returns
    -------
    str
        SVG element.
    """
    with mpl.rc_context(STYLE):
        return svg_text(_separating(curves), prefix)


def _separating(curves: Curves) -> Figure:
    """Two panels over time: the channel, and what is left of it."""
    time, values, left = np.asarray(curves.time), curves.predicted, curves.left
    colours = dict(zip(values, HYPOTHESES, strict=False))
    figure = Figure(figsize=(10.0, 5.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [1.5, 1.2]})
    unit, factor = display_unit(curves.unit, _largest(*values.values()))
    for place, (name, curve) in enumerate(values.items()):
        x, y = decimate(time, np.asarray(curve, dtype=np.float64))
        # the leading one is broad, the others are dashed over it: they often lie on it
        style: dict[str, Any] = (
            {"lw": 2.6, "alpha": 0.75} if place == 0 else {"lw": 1.2, "ls": (0, (4 + place, 2))}
        )
        upper.plot(x, factor * y, color=colours[name], label=hypothesis_label(name), **style)
    upper.set_ylabel(
        f"{spoken_name(curves.channel)} [{unit}]" if unit else spoken_name(curves.channel)
    )
    upper.set_title("predicted from the same commands")
    legend_above(upper)
    unit, factor = display_unit(curves.unit, _largest(*left.values()))
    noise = curves.noise * factor
    lower.axhspan(-2.0 * noise, 2.0 * noise, color="#dfe3e8", lw=0, label="noise (± 2 std)")
    lower.axhline(0.0, color="#6b7280", lw=0.7)
    for name, curve in left.items():
        x, y = decimate(np.asarray(curves.bin_time), np.asarray(curve, dtype=np.float64))
        lower.plot(x, factor * y, color=colours[name], lw=1.1, label=hypothesis_label(name))
    lower.set_ylabel(f"cannot explain [{unit}]" if unit else "cannot explain")
    lower.set_title(f"what is left if it is {hypothesis_label(curves.leading)}")
    lower.set_xlabel("time [s]")
    legend_above(lower)
    for panel in (upper, lower):
        panel.margins(x=0.005)
    figure.align_ylabels([upper, lower])
    return figure


def _block_rows(diagnosis: Findings) -> list[tuple[str, float, bool]]:
    """Name, residual in units of the noise level, whether located; in the order of the chain."""
    rows = []
    for name, entry in diagnosis.residuals.items():
        if is_number(entry.rms) and is_number(entry.noise) and entry.noise > 0:
            rows.append((name, entry.rms / entry.noise, name == diagnosis.where.block))
    return sorted(rows, key=lambda r: CHAIN.index(r[0]) if r[0] in CHAIN else len(CHAIN))


def _beside(axes: Axes, x: float, y: float, text: str, **style: Any) -> None:
    """A text beside the end of a bar (SVG drops spaces that stand before a text)."""
    style = {"va": "center", "fontsize": "small"} | style
    axes.annotate(text, (x, y), xytext=(4.0, 0.0), textcoords="offset points", **style)


def _draw_blocks(axes: Axes, rows: Sequence[tuple[str, float, bool]], least_rows: int = 1) -> None:
    position = np.arange(len(rows))
    size = np.asarray([r[1] for r in rows])
    left = min(0.5, 0.8 * float(size.min()))
    colours = [COLOURS["before"] if r[2] else COLOURS["quiet"] for r in rows]
    axes.barh(position, size - left, left=left, color=colours, height=0.62)
    axes.axvline(1.0, color="#1f1f1f", lw=1.1, ls=(0, (3, 2)))
    _beside(axes, 1.0, -0.62, "noise level", color="#374151", va="baseline")
    axes.set_xscale("log")
    axes.set_xlim(left, max(3.0, float(size.max()) * 1.9))
    for y, value in zip(position.tolist(), size.tolist(), strict=True):
        _beside(axes, value, y, f"{format_number(value, 2)}×")
    axes.set_yticks(position, [label(r[0]) for r in rows])
    axes.set_ylim(max(len(rows), least_rows) - 0.45, -1.0)
    axes.xaxis.set_major_formatter(lambda v, _: format_number(v, 1))
    axes.xaxis.set_minor_formatter("")
    axes.grid(axis="y", visible=False)
    axes.set_xlabel("residual of the refitted baseline / noise level")


def blocks_svg(diagnosis: Findings, prefix: str = "blocks") -> str | None:
    """Bar chart of each block's residual against its noise level; None when there are no blocks."""
    rows = _block_rows(diagnosis)
    if not rows:
        return None
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.6, 1.1 + 0.36 * (len(rows) + 1)), layout="constrained")
        _draw_blocks(figure.subplots(), rows)
        return svg_text(figure, prefix)


def budget_svg(diagnosis: Findings, prefix: str = "budget") -> str | None:
    """Waterfall of each block's budget: from the nominal model's excess down to what stays
    unexplained; None where no block exceeds the noise.
    """
    blocks = budgets(diagnosis)
    if not blocks:
        return None
    heights = [len(told_terms(own)) + 1 for own in blocks.values()]
    rows = sum(heights)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 0.5 + 0.3 * rows + 0.45 * len(blocks)), layout="constrained")
        panels = figure.subplots(len(blocks), 1, squeeze=False, height_ratios=heights)[:, 0]
        for axes, (block, own) in zip(panels, blocks.items(), strict=True):
            _draw_budget(axes, block, own, noise_only=noise_alone(diagnosis, block))
        panels[-1].set_xlabel("share of the nominal model's excess over the noise [%]")
        return svg_text(figure, prefix)


def _draw_budget(axes: Axes, block: str, terms: Sequence[BudgetTerm], *, noise_only: bool) -> None:
    colours = {
        "held": COLOURS["refit"],
        "parameters": COLOURS["quiet"],
        "unexplained": COLOURS["before"],
    }
    held = any(term.kind == "held" for term in terms)
    reached = [0.0, 1.0]
    names = ["model without what it holds" if held else "nominal model"]
    axes.barh(0, 100.0, color="#d1d5db", height=0.62)
    left = 1.0
    for row, (name, told) in enumerate(told_terms(terms), 1):
        term = replace(told, share=min(2.5, told.share))
        rest = term.kind == "unexplained"
        begin = 0.0 if rest else left - term.share
        colour = colours.get(term.kind, COLOURS["after"])
        axes.barh(row, 100.0 * term.share, left=100.0 * begin, color=colour, height=0.62)
        if not rest:
            ends = [min(250.0, max(-50.0, 100.0 * (left - share))) for share in term.interval]
            axes.plot(ends, [row, row], color="#1f1f1f", lw=0.9)
            left -= term.share
            reached += [left, *(end / 100.0 for end in ends)]
        side = 100.0 * max(begin, begin + term.share)
        if not rest:
            side = max(side, *ends)
        _beside(axes, side, row, format_share(told.share))
        names.append("left, no more than noise" if rest and noise_only else name)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    low, high = min(reached), max(reached)
    axes.set_xlim(100.0 * low - 3.0, 100.0 * (high + 0.16 * (high - low)))
    axes.grid(axis="y", visible=False)
    axes.set_title(spoken_name(block), loc="left", fontsize="medium")


def _grids(
    condition_map: ConditionMap,
) -> tuple[FloatArray, FloatArray, list[tuple[str, Any]], float] | None:
    """Edges, titled grids and colour limit of a conditions map."""
    x = np.asarray(condition_map.x_edges, dtype=np.float64)
    y = np.asarray(condition_map.y_edges, dtype=np.float64)
    grids = []
    for key, title in (("z", "before"), ("z_after", "after")):
        if condition_map[key] is not None:
            z = np.asarray(condition_map[key], dtype=np.float64)
            if z.shape != (len(y) - 1, len(x) - 1) and z.T.shape == (len(y) - 1, len(x) - 1):
                z = z.T
            if z.shape != (len(y) - 1, len(x) - 1):
                raise ValueError(
                    f"condition_map {key} has shape {z.shape}; the edges ask for "
                    f"{(len(y) - 1, len(x) - 1)}"
                )
            grids.append((title, np.ma.masked_invalid(z)))
    sizes = [np.abs(z.compressed()) for _, z in grids]
    everything = np.concatenate(sizes) if sizes else np.empty(0)
    if everything.size == 0:
        return None
    return x, y, grids, max(2.0, float(np.percentile(everything, 99)))


def _draw_map(axes: Axes, x: FloatArray, y: FloatArray, z: Any, limit: float) -> QuadMesh:
    axes.set_facecolor("#eef0f3")
    axes.grid(visible=False)
    mesh = axes.pcolormesh(x, y, z, cmap="RdBu_r", vmin=-limit, vmax=limit, rasterized=z.size > 600)
    return mesh


def map_svg(diagnosis: Findings, prefix: str = "map") -> str | None:
    """Heat maps of the mean residual over the two telling conditions, before and after; None
    without data.
    """
    content = diagnosis.condition_map and _grids(diagnosis.condition_map)
    if not content or diagnosis.condition_map is None:
        return None
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.0 * len(content[2]) + 0.6, 3.9), layout="constrained")
        _draw_maps(figure, diagnosis.condition_map, content, {}, {"pad": 0.015})
        return svg_text(figure, prefix)


def _draw_maps(
    part: Any,
    condition_map: ConditionMap,
    content: Any,
    title_style: dict[str, Any],
    bar_style: dict[str, Any],
) -> None:
    """Heat maps side by side in a figure or a part of one, with one label for both and one colour
    bar.
    """
    x, y, grids, limit = content
    axes = part.subplots(1, len(grids), sharey=True, squeeze=False)[0]
    for panel, (title, z) in zip(axes, grids, strict=True):
        mesh = _draw_map(panel, x, y, z, limit)
        panel.set_title(title, **title_style)
    axes[0].set_ylabel(condition_map.y_label)
    part.supxlabel(condition_map.x_label, fontsize=mpl.rcParams["axes.labelsize"])
    part.colorbar(mesh, ax=list(axes), label="mean residual / noise", extend="both", **bar_style)


def _draw_probabilities(axes: Axes, diagnosis: Findings) -> None:
    block = told_probabilities(diagnosis)[0]
    rows = ranked_probabilities(block.probabilities, 6)
    position = np.arange(len(rows))
    colours = [COLOURS["after" if is_named(block, name) else "quiet"] for name, _ in rows]
    axes.barh(position, [p for _, p in rows], color=colours, height=0.62)
    for y, (_, p) in zip(position.tolist(), rows, strict=True):
        axes.text(p + 0.015, y, format_probability(p), va="center", fontsize="small")
    axes.set_yticks(
        position,
        [textwrap.shorten(hypothesis_label(name), 34, placeholder=" …") for name, _ in rows],
    )
    axes.set_xlim(0.0, 1.16)
    axes.set_xticks([0.0, 0.5, 1.0])
    axes.set_ylim(max(len(rows), 5) - 0.4, -0.6)
    axes.grid(axis="y", visible=False)


def summary_png(diagnosis: Findings) -> bytes:
    """One picture: the telling channel and its residual, probabilities, conditions map, verdict.

    Parameters
    ----------
    diagnosis : Findings
        Result to draw; parts that it lacks are left out.

    Returns
    -------
    bytes
        PNG of 1600 x 1000 pixels.
    """
    with summary_figure(headline(diagnosis), 78) as (figure, finished):
        left, right = figure.subfigures(1, 2, width_ratios=[1.45, 1.0], squeeze=False)[0]
        trace = telling_trace(diagnosis)
        if trace is not None:
            upper, lower = left.subplots(
                2, 1, sharex=True, gridspec_kw={"height_ratios": [1.7, 1.0]}
            )
            _draw_curves(upper, trace, width=1.1)
            _draw_residuals(lower, trace, _noise(diagnosis, trace), width=0.8)
            role = "held-out recording" if trace.role == "held_out" else "fitted recording"
            upper.set_title(
                f"{spoken_name(trace.channel).capitalize()}, {role} {trace.recording}", pad=20
            )
            lower.set_title("What the model does not explain", pad=20)
            place: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (-0.01, 0.995)}
            for panel in (upper, lower):
                panel.legend(
                    ncols=4, borderaxespad=0.1, handlelength=1.6, columnspacing=1.2, **place
                )
                panel.margins(x=0.005)
            lower.set_xlabel("time [s]")
            left.align_ylabels([upper, lower])
        _draw_right(right, diagnosis)
        return finished()


def _head(part: Any, text: str) -> None:
    """Title of a part of the summary, flush left."""
    part.suptitle(text, x=0.03, ha="left", fontsize=9.5, fontweight="bold")


def _draw_right(right: Any, diagnosis: Findings) -> None:
    """Right column of the summary: probabilities above, conditions map or blocks below."""
    content = diagnosis.condition_map and _grids(diagnosis.condition_map)
    rows = _block_rows(diagnosis)
    below = bool(content) or bool(rows)
    told = told_probabilities(diagnosis)[0]
    above = bool(told.probabilities)
    parts = right.subfigures(int(above) + int(below) or 1, 1, squeeze=False)[:, 0]
    if above:
        _draw_probabilities(parts[0].subplots(), diagnosis)
        of = f", {blocks_label(told)}" if len(diagnosis.judged) > 1 and told.blocks else ""
        _head(parts[0], textwrap.shorten(f"Probability of each hypothesis{of}", 60))
    if content and diagnosis.condition_map is not None:
        _head(parts[-1], "When: residual over two conditions")
        _draw_maps(
            parts[-1],
            diagnosis.condition_map,
            content,
            {"fontweight": "normal", "pad": 4},
            {"pad": 0.02, "aspect": 28},
        )
    elif rows:
        _draw_blocks(parts[-1].subplots(), rows, least_rows=4)
        _head(parts[-1], "Where the residual is")
