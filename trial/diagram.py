"""How often answers are right that were stated with some probability, as a picture."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from .concealed import write
from .marks import Mark
from .summary import wilson
from .tables import reliability

_INK, _LINE, _FAINT = "#1f1f1f", "#0072b2", "#9ca3af"


def reliability_diagram(marks: Sequence[Mark], file: Path) -> None:
    """Write the reliability diagram of some cases as SVG: of the leading answers of groups of
    blocks, by stated probability, the share that is right with its 95 % interval.

    Parameters
    ----------
    marks : sequence of Mark
        Scored cases.
    file : path
        Where to; the same bytes for the same cases.

    Raises
    ------
    ValueError
        If no case states a probability.
    """
    bins, off = reliability(marks)
    if off is None:
        raise ValueError("no case states a probability: there is nothing to draw")
    figure = Figure(figsize=(5.6, 4.6), layout="constrained")
    axes = figure.subplots()
    axes.plot([0.0, 1.0], [0.0, 1.0], color=_FAINT, lw=1.0, label="as stated")
    ends = [wilson(int(b["hits"]), int(b["n"])) for b in bins]
    stated, right = [b["stated"] for b in bins], [b["hits"] / b["n"] for b in bins]
    axes.vlines(stated, *zip(*ends, strict=True), color=_LINE, lw=1.2, label="95 % interval")
    axes.plot(stated, right, "o-", color=_LINE, lw=1.5, ms=5, label="right")
    for b, x, y in zip(bins, stated, right, strict=True):
        axes.annotate(f"{b['n']:.0f}", (x, y), (6, -11), textcoords="offset points", color=_INK)
    axes.set(xlabel="stated probability of the leading answer", ylabel="share that is right")
    axes.set(xlim=(min(0.3, min(stated) - 0.03), 1.03), ylim=(0.0, 1.03))
    axes.set_title(f"{100.0 * off:.1f} points off in the mean", fontsize=10)
    axes.legend(loc="lower right", frameon=False)
    axes.grid(alpha=0.3)
    text = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": "reliability", "svg.fonttype": "none"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    lines = (line.rstrip() for line in text.getvalue().splitlines())
    write(file, "\n".join(lines) + "\n")
