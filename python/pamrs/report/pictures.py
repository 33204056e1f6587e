"""The first screen of a report as one picture: PNG, or one page of A4."""

from __future__ import annotations

import io
import textwrap
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from pamrs.findings import Findings
from pamrs.report import sentences
from pamrs.report.chain import draw_chain
from pamrs.report.figures import COLOURS, STYLE, draw_panels, free_head, free_panels, summary_figure
from pamrs.rig import Rig


def summary_png(diagnosis: Findings) -> bytes:
    """One picture: the chain, the free run of the worst recording, and the probabilities.

    Parameters
    ----------
    diagnosis : Findings
        Result to draw; parts that it lacks are left out.

    Returns
    -------
    bytes
        PNG of 1600 x 1000 pixels.
    """
    with summary_figure(sentences.title(diagnosis), 78) as (figure, finished):
        heights = [1.5, 4.2] if isinstance(diagnosis.rig, Rig) else [0.01, 4.2]
        upper, lower = figure.subfigures(2, 1, height_ratios=heights, squeeze=False)[:, 0]
        draw_chain(upper.add_axes((0.02, 0.0, 0.96, 1.0), frameon=False), diagnosis)
        left, right = lower.subfigures(1, 2, width_ratios=[1.6, 1.0])
        _draw_first(left, diagnosis, 2)
        _draw_rivals(right, diagnosis)
        return finished()


def one_page_pdf(diagnosis: Findings) -> bytes:
    """The first screen of the report on one page of A4.

    Parameters
    ----------
    diagnosis : Findings
        Result to draw; parts that it lacks are left out.

    Returns
    -------
    bytes
        PDF.
    """
    with mpl.rc_context(STYLE | {"pdf.fonttype": 42}):
        figure = Figure(figsize=(8.27, 11.69))
        figure.set_layout_engine("constrained", w_pad=0.35, h_pad=0.12)
        heights = [3.0, 1.4, 4.6, 2.3]
        parts = figure.subfigures(4, 1, height_ratios=heights, squeeze=False)[:, 0]
        top, chain, curves, bars = parts
        texts = [f"{value} – {what}" for value, what in sentences.facts(diagnosis)]
        texts += [*sentences.to_do(diagnosis), sentences.next_to_do(diagnosis)]
        lines = [textwrap.fill(text, 100) for text in filter(None, texts)]
        title = textwrap.fill(sentences.title(diagnosis), 60)
        style: dict[str, Any] = {"ha": "left", "va": "top"}
        top.text(0.05, 0.93, title, size=15, fontweight="bold", **style)
        top.text(0.05, 0.64, "\n".join(lines), size=9, linespacing=1.5, **style)
        draw_chain(chain.add_axes((0.05, 0.0, 0.9, 1.0), frameon=False), diagnosis)
        _draw_first(curves, diagnosis, 3)
        _draw_rivals(bars, diagnosis)
        stream = io.BytesIO()
        figure.savefig(stream, format="pdf", metadata={"Title": f"Diagnosis of {diagnosis.case}"})
        return stream.getvalue()


def _draw_first(part: Any, diagnosis: Findings, most: int) -> None:
    """Draw the free run, with one legend for all of its panels, and the missing input, where there
    is one, instead of the last of them.
    """
    missing = diagnosis.missing_input
    if missing is not None:
        part, below = part.subfigures(2, 1, height_ratios=[max(1, most - 1), 1.3])
        missing.plot(below.subplots())
        most = max(1, most - 1)
    panels = free_panels(diagnosis)[:most]
    if not panels:
        return
    draw_panels(part, panels, 0.9)
    part.suptitle(free_head(diagnosis), x=0.03, ha="left", fontsize=9.5, fontweight="bold")


def _draw_rivals(part: Any, diagnosis: Findings) -> None:
    """The ranked bar of the explanations."""
    rows = sentences.rivals(diagnosis)
    if not rows:
        return
    axes = part.subplots()
    places = list(range(len(rows)))
    colours = [COLOURS["after" if row.named else "quiet"] for row in rows]
    axes.barh(places, [row.probability for row in rows], color=colours, height=0.62)
    for place, row in zip(places, rows, strict=True):
        axes.text(row.probability + 0.015, place, row.chance, va="center", fontsize="small")
    axes.set_yticks(places, [textwrap.shorten(row.name, 34, placeholder=" …") for row in rows])
    axes.set_xlim(0.0, 1.16)
    axes.set_xticks([0.0, 0.5, 1.0])
    axes.set_ylim(max(len(rows), 5) - 0.4, -0.6)
    axes.grid(axis="y", visible=False)
    part.suptitle("What else it could be", x=0.03, ha="left", fontsize=9.5, fontweight="bold")
