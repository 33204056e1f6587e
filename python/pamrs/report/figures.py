"""Figures of a diagnosis, as SVG text to put into a page, or PNG bytes."""

from __future__ import annotations

import io
import json
import math
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamrs._arrays import Array
from pamrs._views import decimate
from pamrs.findings import YOURS, Curves, Findings, MissingInput, Trace
from pamrs.report.sentences import free_run_words
from pamrs.report.words import (
    display_unit,
    hypothesis_label,
    is_number,
    spoken_name,
)

__all__ = [
    "COLOURS",
    "STYLE",
    "PlotLine",
    "Panel",
    "curves",
    "draw_panel",
    "draw_panels",
    "free_head",
    "free_panels",
    "legend_below",
    "missing_svg",
    "png_bytes",
    "separating_panels",
    "summary_figure",
    "svg_text",
    "telling_trace",
    "trace_panels",
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

MOST_FREE = 3
"""Channels of the whole rig that are drawn at most."""


STYLE: Any = {
    "text.parse_math": False,  # names of recordings are no formulas
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
"""Settings of the summary that differ from them."""


def _rms(values: Array | None) -> float:
    if values is None or not np.any(np.isfinite(values)):
        return math.nan
    return float(np.sqrt(np.nanmean(np.square(values))))


def _largest(*curves: Array | None) -> float:
    sizes = [
        float(np.nanmax(np.abs(c))) for c in curves if c is not None and np.any(np.isfinite(c))
    ]
    return max(sizes, default=math.nan)


def _has(values: Array | None, besides: Array | None = None) -> bool:
    """True where a curve has data and differs from another one."""
    if values is None or not np.any(np.isfinite(values)):
        return False
    return besides is None or not np.allclose(values, besides, equal_nan=True)


@dataclass(frozen=True, eq=False)
class PlotLine:
    """A curve of a panel: its name, colour, points in the unit of the panel, width and dashes."""

    name: str
    colour: str
    x: Array
    y: Array
    width: float = 1.3
    dashed: bool = False


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves over time on one pair of axes.

    Attributes
    ----------
    title : str
        The quantity with its unit.
    lines : list of PlotLine
        The curves, the first one below.
    noise : float
        Half the height of the band of noise; 0 for none.
    spans : list of (start, stop)
        Times that are marked [s].
    """

    title: str
    lines: list[PlotLine]
    noise: float = 0.0
    spans: Sequence[Sequence[float]] = ()


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


def _noise(diagnosis: Findings, trace: Trace) -> float:
    parts = [diagnosis.fit.channels, diagnosis.fit.held_out]
    for part in reversed(parts) if trace.role == "held_out" else parts:
        noise = part[trace.channel].noise if trace.channel in part else None
        if is_number(noise) and noise > 0:
            return noise
    return 0.0


def _quantity(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _line(name: str, stage: str, time: Array, values: Array, **how: Any) -> PlotLine:
    return PlotLine(name, COLOURS[stage], *decimate(time, values), **how)


def _compared(
    trace: Trace, final: str, before: Array | None, *, refitted: bool = False
) -> tuple[str, float, list[PlotLine]]:
    """Curves of the measurement and of the models, that of the final one where it differs from one
    before, with the unit that they are shown in and the factor from SI.
    """
    unit, factor = display_unit(trace.unit, _largest(trace.measured))
    shown: list[tuple[str, str, Any, dict[str, Any]]] = [
        ("measured", "measured", trace.measured, {"width": 2.6}),
        ("your model", "before", trace.before, {}),
        *([("refitted", "refit", trace.refit, {"dashed": True})] if refitted else []),
    ]
    if final != YOURS and _has(trace.after, before):
        shown.append((final, "after", trace.after, {}))
    lines = [_line(name, stage, trace.time, own * factor, **how) for name, stage, own, how in shown]
    return unit, factor, lines


def free_panels(diagnosis: Findings) -> list[Panel]:
    """The worst recording from its commands alone: measured, your model and the final one, the
    channels first that your model misses most; the telling trace where there is no free run.
    """
    final = diagnosis.answer.model
    errors = {
        (run.recording, channel): error
        for run in diagnosis.free_run or []
        for channel, error in run.channels.items()
    }
    pairs = [(t, errors.get((t.recording, t.channel))) for t in diagnosis.free_traces]
    pairs.sort(key=lambda pair: pair[1].times_before if pair[1] else 0.0, reverse=True)
    panels = []
    for trace, error in pairs[:MOST_FREE]:
        unit, factor, lines = _compared(trace, final, trace.before)
        missed = free_run_words(error, factor, final) if error else ""
        panels.append(Panel(_quantity(spoken_name(trace.channel), unit) + missed, lines))
    first = telling_trace(diagnosis)
    return panels or (trace_panels(diagnosis, [first]) if first else [])


def trace_panels(diagnosis: Findings, traces: Sequence[Trace]) -> list[Panel]:
    """Measured and simulated channels of one recording, each with its residual below.

    Parameters
    ----------
    diagnosis : Findings
        For noise levels and marked intervals.
    traces : sequence of Trace
        Channels of one recording, at least one.
    """
    panels, final = [], diagnosis.answer.model
    for trace in traces:
        # the intervals are those of one recording
        marked = diagnosis.where.recording == trace.recording
        spans = diagnosis.where.intervals if marked else []
        refitted = _has(trace.refit, trace.before)
        unit, _, lines = _compared(trace, final, trace.refit, refitted=refitted)
        panels.append(Panel(_quantity(spoken_name(trace.channel), unit), lines, 0.0, spans))
        before, after = trace.residual_before, trace.residual_after
        unit, factor = display_unit(trace.unit, _largest(before, after))
        # in the colours of the curves above: what is left before is what the refit leaves
        first = ("refitted", "refit") if refitted else ("your model", "before")
        lines = [
            _line(*style, trace.time, values * factor, width=1.0)
            for values, style in ((before, first), (after, (final, "after")))
            if values is not None and _has(values, before if style[1] == "after" else None)
        ]
        name = f"not explained of {spoken_name(trace.channel)}"
        panels.append(Panel(_quantity(name, unit), lines, _noise(diagnosis, trace) * factor, spans))
    return panels


def draw_panel(axes: Axes, panel: Panel, scale: float = 1.0) -> None:
    """A panel on matplotlib's axes."""
    for start, stop in panel.spans:
        axes.axvspan(start, stop, color="#f5e6b8", alpha=0.5, lw=0, zorder=0)
    if panel.noise:
        band: dict[str, Any] = {"color": "#dfe3e8", "lw": 0, "label": "noise (± 2 std)"}
        axes.axhspan(-2 * panel.noise, 2 * panel.noise, **band)
        axes.axhline(0.0, color="#6b7280", lw=0.7)
    for line in panel.lines:
        style: dict[str, Any] = {"ls": (0, (5, 2))} if line.dashed else {}
        width = scale * line.width
        axes.plot(line.x, line.y, color=line.colour, lw=width, label=line.name, **style)
    axes.set_title(panel.title, fontweight="normal")
    axes.margins(x=0.005)


def draw_panels(part: Any, panels: Sequence[Panel], scale: float = 1.0) -> None:
    """Panels below each other in a figure or a part of one, with one legend."""
    every = part.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, panel in zip(every, panels, strict=True):
        draw_panel(axes, panel, scale)
    legend_below(part, every)
    every[-1].set_xlabel("time [s]")


def curves(panels: Sequence[Panel], prefix: str) -> str:
    """Panels as a drawing, and as data from which a script draws them again.

    Parameters
    ----------
    panels : sequence of Panel
        At least one; all over the same time.
    prefix : str
        Prefix of the element ids.

    Returns
    -------
    str
        An SVG element and a script element with JSON.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.6, 1.85 * len(panels) + 0.35), layout="constrained")
        draw_panels(figure, panels)
        drawn = svg_text(figure, prefix)
    content = [
        {
            "title": panel.title,
            "noise": panel.noise,
            "spans": [list(span) for span in panel.spans],
            "lines": [
                {"name": own.name, "colour": own.colour, "width": own.width, "dashed": own.dashed}
                | {"x": _short(own.x), "y": _short(own.y)}
                for own in panel.lines
            ],
        }
        for panel in panels
    ]
    # no name in it can end the element
    text = json.dumps(content, separators=(",", ":")).replace("<", "\\u003c")
    return f'{drawn}<script type="application/json">{text}</script>'


def missing_svg(missing: MissingInput) -> str:
    """The missing input of a block over what it depends on, as SVG text."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.6, 2.9), dpi=150, layout="constrained")
        missing.plot(figure.subplots()).set_title("")  # the page says it above
        return svg_text(figure, "missing")


def _short(values: Array) -> list[float | None]:
    """Numbers with five digits of their range, null for gaps."""
    known = values[np.isfinite(values)]
    size = float(np.max(np.abs(known))) if known.size else 0.0
    digits = 5 - math.floor(math.log10(size)) if size > 0.0 else 0
    rounded = np.round(values, digits).tolist()
    return [v if math.isfinite(v) else None for v in rounded]


def legend_below(part: Any, every: Iterable[Axes]) -> None:
    """One legend for all axes of a figure or a part of one, below them."""
    shown: dict[str, Any] = {}
    for axes in every:
        for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
            shown.setdefault(name, handle)
    part.legend(shown.values(), shown.keys(), loc="outside lower right", ncols=4, fontsize="small")


def png_bytes(figure: Figure) -> bytes:
    """A figure as PNG, with the dots per inch that it was made with."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=figure.dpi)
    return stream.getvalue()


@contextmanager
def summary_figure(title: str, letters: int) -> Iterator[tuple[Figure, Callable[[], bytes]]]:
    """A picture of 1600 pixels with a headline, and what gives it as PNG.

    Parameters
    ----------
    title : str
        The headline.
    letters : int
        In a line of it.
    """
    with mpl.rc_context(STYLE | _SMALL):
        figure = Figure(figsize=(10.0, 6.25), dpi=160, layout="constrained")
        room = {"w_pad": 0.12, "h_pad": 0.06, "wspace": 0.03, "hspace": 0.03}
        figure.get_layout_engine().set(**room)  # type: ignore[union-attr]
        style: dict[str, Any] = {"fontsize": 15.0, "fontweight": "bold", "color": "#111827"}
        figure.suptitle("\n".join(textwrap.wrap(title, letters)), x=0.012, ha="left", **style)
        yield figure, lambda: png_bytes(figure)


def svg_text(figure: Figure, prefix: str) -> str:
    """SVG element without prolog; ids carry `prefix` so that several can share a page."""
    stream = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": prefix}):
        none: dict[str, Any] = {"Date": None, "Creator": None, "Format": None, "Type": None}
        figure.savefig(stream, format="svg", metadata=none, dpi=figure.dpi)
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r'\bid="', f'id="{prefix}-', text)
    text = text.replace("url(#", f"url(#{prefix}-").replace('href="#', f'href="#{prefix}-')
    text = re.sub(
        r' width="[\d.]+pt"', "", re.sub(r' height="[\d.]+pt"', "", text, count=1), count=1
    )
    return text.strip()


HYPOTHESES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#c79a00", "#56b4e9")
"""Colours of hypotheses, the leading one first (Okabe and Ito)."""


def separating_panels(own: Curves | None) -> list[Panel]:
    """The next experiment as every hypothesis predicts it, and what each cannot explain of the
    leading one's outcome.

    Parameters
    ----------
    own : Curves or None
        Those of the next experiment; None where it was not simulated.
    """
    if own is None:
        return []
    colours = dict(zip(own.predicted, HYPOTHESES, strict=False))
    found = []
    for time, values, what, noise in (
        (own.time, own.predicted, spoken_name(own.channel), 0.0),
        (
            own.bin_time,
            own.left,
            f"cannot explain if it is {hypothesis_label(own.leading)}",
            own.noise,
        ),
    ):
        unit, factor = display_unit(own.unit, _largest(*values.values()))
        # the leading one is broad, the others are dashed over it: they often lie on it
        lines = [
            PlotLine(
                hypothesis_label(name),
                colours[name],
                *decimate(np.asarray(time), factor * np.asarray(curve, dtype=np.float64)),
                width=2.6 if name == own.leading else 1.2,
                dashed=name != own.leading,
            )
            for name, curve in values.items()
        ]
        found.append(Panel(_quantity(what, unit), lines, noise * factor))
    return found


def free_head(diagnosis: Findings) -> str:
    """Heading of the first curves, in a few words."""
    if diagnosis.free_traces:
        first = diagnosis.free_traces[0]
        return f"Recording {first.recording}, the whole rig from its commands alone"
    trace = telling_trace(diagnosis)
    return f"Recording {trace.recording}, the block driven by its neighbours" if trace else ""
