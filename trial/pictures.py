"""Pictures of a scored trial (they need matplotlib)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from .score import HEALTHY, Row, Scores
from .sidebyside import CLASSES, METHODS, Compared, medians
from .strength import STRENGTHS
from .summary import confusion, gaps, reliability
from .targets import SEEN, wilson

DPI = 110
_EDGES = (0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 30.0, math.inf)
_BLUE, _ORANGE, _GREEN, _GREY = "#0072b2", "#d55e00", "#009e73", "0.6"


def _page(width: float, height: float) -> Any:
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def _plain(axes: Any) -> None:
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.grid(axis="y", color="0.9", linewidth=0.7)
    axes.set_axisbelow(True)


def draw_strength(axes: Any, rows: Sequence[Row]) -> None:
    """Share detected and share named over what the effect leaves after a refit."""
    effects = [r for r in rows if r.ids]
    for word, colour, marker in (("detected", _BLUE, "o"), ("right name first", _ORANGE, "s")):
        at, share, below, above = [], [], [], []
        for low, high in zip(_EDGES, _EDGES[1:], strict=False):
            inside = [r for r in effects if low <= r.visible < high]
            if inside:
                hits = sum(
                    r.detected if word == "detected" else r.outcome == "right" for r in inside
                )
                bottom, top = wilson(hits, len(inside))
                at.append(sum(r.visible for r in inside) / len(inside))
                share.append(hits / len(inside))
                below.append(max(share[-1] - bottom, 0.0))
                above.append(max(top - share[-1], 0.0))
        nudge = 0.985 if word == "detected" else 1.015
        axes.errorbar(
            [a * nudge for a in at],
            share,
            yerr=(below, above),
            marker=marker,
            color=colour,
            capsize=3,
            label=word,
            linewidth=1.4,
        )
    false = [r.detected for r in rows if r.healthy]
    if false:
        word = f"false alarms ({sum(false)} of {len(false)})"
        axes.axhline(sum(false) / len(false), color=_GREY, linestyle=":", linewidth=1.2, label=word)
    axes.set_xscale("log")
    ticks = [
        t
        for t in (0.5, 1, 1.5, 2, 3, 5, 10, 20, 50)
        if not effects or t <= 1.3 * max(r.visible for r in effects)
    ]
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.minorticks_off()
    axes.axvline(SEEN, color=_GREY, linewidth=0.8)
    axes.set(
        xlabel="effect left after a refit / noise of the channel",
        ylabel="share of cases",
        ylim=(-0.03, 1.03),
    )
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False, fontsize=9)
    _plain(axes)


def draw_calibration(axes: Any, rows: Sequence[Row]) -> None:
    """How often the leading hypothesis was the truth, over its stated probability."""
    bins, brier = reliability(rows)
    axes.plot((0, 1), (0, 1), color=_GREY, linewidth=0.8)
    for _, _, stated, hits, cases in bins:
        bottom, top = wilson(hits, cases)
        true = hits / cases
        axes.errorbar(
            [stated],
            [true],
            yerr=([max(true - bottom, 0.0)], [max(top - true, 0.0)]),
            marker="o",
            color=_BLUE,
            capsize=3,
        )
        axes.annotate(
            str(cases),
            (stated, bottom),
            textcoords="offset points",
            xytext=(0, -12),
            fontsize=8,
            ha="center",
            color="0.3",
        )
    least = min((b[2] for b in bins), default=0.5)
    axes.set(
        xlabel="stated probability of the leading hypothesis",
        ylabel="share true",
        xlim=(least - 0.05, 1.01),
        ylim=(-0.08, 1.05),
    )
    if brier is not None:
        axes.set_title(f"numbers: cases; Brier score {brier:.3f}", fontsize=10)
    _plain(axes)


def draw_confusion(axes: Any, rows: Sequence[Row]) -> None:
    """What was named first (columns) for what (rows), counted; pairs are left out."""
    matrix = confusion(rows)
    last = ("unlisted", *HEALTHY, "no result")

    def order(name: str) -> tuple[bool, str]:
        return (name in last, f"{last.index(name)}" if name in last else name)

    unlisted = {
        r.ids[0]
        for r in rows
        if len(r.ids) == 1 and r.ids[0] in matrix and not any(c[r.ids[0]] for c in matrix.values())
    }
    truths = sorted(matrix, key=lambda t: (t in last, t in unlisted, order(t)))
    names = sorted(
        {n for c in matrix.values() for n in c} | {t for t in truths if t not in unlisted},
        key=order,
    )
    cells = [[matrix[t][n] / matrix[t].total() for n in names] for t in truths]
    if cells:
        axes.imshow(cells, cmap="Blues", vmin=0.0, vmax=1.2, aspect="auto")
    for i, truth in enumerate(truths):
        for j, name in enumerate(names):
            if matrix[truth][name]:
                dark = cells[i][j] > 0.6
                axes.text(
                    j,
                    i,
                    str(matrix[truth][name]),
                    ha="center",
                    va="center",
                    fontsize=8,
                    color="white" if dark else "black",
                )
    axes.set_xticks(
        range(len(names)), names, rotation=60, ha="right", rotation_mode="anchor", fontsize=8.5
    )
    axes.set_yticks(range(len(truths)), truths, fontsize=8.5)
    axes.set_xticks([x - 0.5 for x in range(1, len(names))], minor=True)
    axes.set_yticks([y - 0.5 for y in range(1, len(truths))], minor=True)
    axes.grid(which="minor", color="0.92", linewidth=0.6)
    axes.tick_params(which="both", length=0)
    axes.set(xlabel="named first", ylabel="truth")


def draw_gaps(axes: Any, rows: Sequence[Row]) -> None:
    """Median gap closed on held-out recordings, by effect and strength."""
    found = gaps(rows)
    names = sorted(found, key=lambda n: (n == "pair", n), reverse=True)
    styles = dict(
        zip(
            (*STRENGTHS, "pair"),
            ((_GREY, "v"), (_ORANGE, "s"), (_BLUE, "o"), (_GREEN, "D")),
            strict=True,
        )
    )
    for label, (colour, marker) in styles.items():
        places = [(i, found[n][label]) for i, n in enumerate(names) if label in found[n]]
        for i, values in places:
            axes.scatter(values, [i] * len(values), s=14, color=colour, alpha=0.45, linewidths=0)
        if places:
            at = [median(values) for _, values in places]
            axes.scatter(
                at,
                [i for i, _ in places],
                s=42,
                color=colour,
                marker=marker,
                label=f"{label} (median)",
                zorder=3,
            )
    axes.axvline(0.9, color=_GREY, linewidth=0.8)
    axes.set_yticks(range(len(names)), names, fontsize=8.5)
    axes.set(
        xlabel="share of the gap to the noise closed on held-out recordings", xlim=(-0.03, 1.03)
    )
    if names:
        axes.legend(
            loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, frameon=False, fontsize=9
        )
    _plain(axes)
    axes.grid(axis="x", color="0.9", linewidth=0.7)


def draw_baselines(axes: Any, rows: Sequence[Compared]) -> None:
    """Median gap closed by every method, by class of case."""
    present = {c.kind for c in rows if c.row.ids}
    told = [(k, *medians(c for c in rows if c.kind == k)) for k in CLASSES if k in present]
    told = [t for t in told if t[2]]
    shades = ("0.75", _GREEN, _ORANGE, _BLUE)
    for m, (method, word) in enumerate(METHODS.items()):
        at = [i + 0.2 * (m - 1.5) for i in range(len(told))]
        values = [middle[method] for _, middle, _ in told]
        axes.bar(at, values, width=0.18, color=shades[m], label=word)
        for x, value in zip(at, values, strict=True):
            axes.annotate(
                f"{value:.2f}",
                (x, value),
                textcoords="offset points",
                xytext=(0, 2),
                ha="center",
                fontsize=7.5,
            )
    axes.set_xticks(range(len(told)), [f"{k}\n{n} cases" for k, _, n in told], fontsize=9)
    axes.set(ylabel="median share of the gap closed", ylim=(0.0, 1.08))
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, frameon=False, fontsize=9)
    _plain(axes)


def pictures(scores: Scores, compared: Sequence[Compared], folder: Path) -> list[Path]:
    """Write strength, calibration, confusion, gap and, where there are baselines, baselines as PNG;
    returns the files.
    """
    rows = scores.rows
    effects = max(8, len(confusion(rows)))
    plan: list[tuple[str, float, float, Any, Any]] = [
        ("strength", 7.5, 4.6, draw_strength, rows),
        ("calibration", 5.6, 5.0, draw_calibration, rows),
        ("confusion", 10.5, 2.8 + 0.24 * effects, draw_confusion, rows),
        ("gap", 8.0, 1.6 + 0.24 * max(8, len(gaps(rows))), draw_gaps, rows),
    ]
    if any(c.row.ids for c in compared):
        plan.append(("baselines", 9.5, 4.4, draw_baselines, compared))
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, width, height, draw, told in plan:
        page = _page(width, height)
        draw(page.add_subplot(), told)
        written.append(folder / f"{name}.png")
        page.savefig(written[-1], dpi=DPI)
    return written


def figure(scores: Scores, path: Path) -> None:
    """Draw detection over strength, the calibration and what was named for what on one page.

    The file type follows the suffix.
    """
    page = _page(11.0, 6.0 + 0.22 * max(8, len(confusion(scores.rows))))
    grid = page.add_gridspec(
        2, 2, height_ratios=(1.0, 0.4 + 0.06 * max(8, len(confusion(scores.rows))))
    )
    draw_strength(page.add_subplot(grid[0, 0]), scores.rows)
    draw_calibration(page.add_subplot(grid[0, 1]), scores.rows)
    draw_confusion(page.add_subplot(grid[1, :]), scores.rows)
    path.parent.mkdir(parents=True, exist_ok=True)
    page.savefig(path, dpi=130)
