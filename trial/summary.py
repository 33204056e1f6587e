"""Tables and one figure of a scored trial."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from .score import HEALTHY, Row, Scores
from .strength import STRENGTHS

BINS = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)


def wilson(hits: int, cases: int, z: float = 1.959964) -> tuple[float, float]:
    """Wilson interval of a share; 95 % by default.

    Raises
    ------
    ValueError
        More hits than cases, or no case.
    """
    if not 0 <= hits <= cases or cases == 0:
        raise ValueError(f"{hits} of {cases} is no share")
    share, zz = hits / cases, z * z
    middle = (share + zz / (2.0 * cases)) / (1.0 + zz / cases)
    half = z / (1.0 + zz / cases) * math.sqrt(share * (1.0 - share) / cases + zz / (4.0 * cases * cases))
    low = 0.0 if hits == 0 else max(middle - half, 0.0)
    return low, 1.0 if hits == cases else min(middle + half, 1.0)


def _percent(hits: int, cases: int) -> str:
    if cases == 0:
        return "-"
    low, high = wilson(hits, cases)
    return f"{100.0 * hits / cases:.1f} % ({100.0 * low:.1f} to {100.0 * high:.1f})"


def table(head: Sequence[str], body: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(row) + " |" for row in body]
    return "\n".join(lines)


def confusion(rows: Sequence[Row]) -> dict[str, Counter[str]]:
    """What was named first, counted by the truth; pairs are left out."""
    found: dict[str, Counter[str]] = {}
    for row in rows:
        if len(row.ids) < 2:
            truth = row.ids[0] if row.ids else row.truth
            found.setdefault(truth, Counter())["no result" if row.verdict == "missing" else row.first] += 1
    return found


def reliability(rows: Sequence[Row]) -> tuple[list[tuple[float, float, float, int, int]], float | None]:
    """How often the leading hypothesis was the truth, by its stated probability, and the Brier score.

    Returns
    -------
    bins : list of tuple
        Lower and upper edge, mean stated probability, number right, number of cases; empty bins are left out.
    brier : float or None
        Mean square of probability less outcome; None without a stated probability.
    """
    claims = [r.claim for r in rows if r.claim is not None]
    bins = []
    for low, high in zip(BINS, BINS[1:], strict=False):
        inside = [(p, ok) for p, ok in claims if low <= p < high or (high == BINS[-1] and p == high)]
        if inside:
            bins.append((low, high, sum(p for p, _ in inside) / len(inside), sum(ok for _, ok in inside), len(inside)))
    brier = sum((p - ok) ** 2 for p, ok in claims) / len(claims) if claims else None
    return bins, brier


def by_strength(rows: Sequence[Row]) -> dict[str, dict[str, tuple[int, int, int]]]:
    """Detected, rightly named first, and cases, by effect and strength; pairs under "pair"."""
    found: dict[str, dict[str, tuple[int, int, int]]] = {}
    for row in rows:
        if not row.ids or not row.wanted:
            continue
        name = "pair" if len(row.ids) > 1 else row.ids[0]
        cell = found.setdefault(name, {})
        a, b, n = cell.get(row.wanted, (0, 0, 0))
        cell[row.wanted] = (a + row.detected, b + (row.outcome == "right"), n + 1)
    return found


def markdown(scores: Scores) -> str:
    """All tables of a trial."""
    rows = scores.rows
    parts = ["## Measures\n"]
    body = [(name, _percent(*share), f"{share[0]} of {share[1]}") for name, share in scores.shares.items()]
    for name, value in scores.totals.items():
        if name not in scores.shares:
            body.append((name, "-" if value is None else f"{value}" if isinstance(value, int) else f"{value:.3f}", ""))
    parts.append(table(("measure", "value (95 % interval)", "count"), body))
    labels = (*STRENGTHS, "pair")
    parts.append("\n## Detected and rightly named, by effect and strength\n")
    split = by_strength(rows)
    lines = []
    for name in sorted(split):
        cells = [split[name].get(label) for label in labels]
        lines.append((name, *("-" if c is None else f"{c[0]}, {c[1]} of {c[2]}" for c in cells)))
    every = []
    for label in labels:
        hit = [c[label] for c in split.values() if label in c]
        a, b, n = (sum(c[i] for c in hit) for i in range(3))
        every.append(f"{_percent(a, n)}, {_percent(b, n)}" if n else "-")
    parts.append(table(("effect", *labels), [*lines, ("all", *every)]))
    parts.append("\n## What was named first\n")
    matrix = confusion(rows)
    parts.append(
        table(
            ("truth", "cases", "named first"),
            [(t, str(c.total()), ", ".join(f"{n} {k}" for k, n in c.most_common())) for t, c in sorted(matrix.items())],
        )
    )
    parts.append("\n## Calibration of the leading hypothesis\n")
    bins, brier = reliability(rows)
    parts.append(
        table(
            ("stated", "mean stated", "true (95 % interval)", "cases"),
            [(f"{lo:.2f} to {hi:.2f}", f"{p:.3f}", _percent(k, n), str(n)) for lo, hi, p, k, n in bins],
        )
    )
    parts.append(f"\nBrier score: {'-' if brier is None else f'{brier:.4f}'}")
    return "\n".join(parts) + "\n"


def figure(scores: Scores, path: Path) -> None:
    """Draw detection over strength, the calibration and what was named for what.

    Needs matplotlib; the file type follows the suffix.
    """
    from matplotlib.figure import Figure

    rows = scores.rows
    page = Figure(figsize=(11.0, 9.5), layout="constrained")
    grid = page.add_gridspec(2, 2, height_ratios=(1.0, 2.2))
    curve, trust, picture = page.add_subplot(grid[0, 0]), page.add_subplot(grid[0, 1]), page.add_subplot(grid[1, :])
    effects = [r for r in rows if r.ids]
    edges = (0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 30.0, math.inf)
    for key, word in (("detected", "detected"), ("right", "right name first")):
        at, share, below, above = [], [], [], []
        for low, high in zip(edges, edges[1:], strict=False):
            inside = [r for r in effects if low <= r.visible < high]
            if inside:
                hits = sum(r.detected if key == "detected" else r.outcome == "right" for r in inside)
                bottom, top = wilson(hits, len(inside))
                at.append(sum(r.visible for r in inside) / len(inside))
                share.append(hits / len(inside))
                below.append(max(share[-1] - bottom, 0.0))
                above.append(max(top - share[-1], 0.0))
        curve.errorbar(at, share, yerr=(below, above), marker="o", capsize=3, label=word)
    curve.set_xscale("symlog", linthresh=0.5)
    curve.set(xlabel="effect in a channel / its noise", ylabel="share of cases", ylim=(-0.03, 1.03))
    curve.axvline(3.0, color="0.7", linewidth=0.8)
    if effects:
        curve.legend(loc="lower right")
    bins, brier = reliability(rows)
    trust.plot((0, 1), (0, 1), color="0.7", linewidth=0.8)
    for _, _, stated, hits, cases in bins:
        bottom, top = wilson(hits, cases)
        share_true = hits / cases
        error = ([max(share_true - bottom, 0.0)], [max(top - share_true, 0.0)])
        trust.errorbar([stated], [share_true], yerr=error, marker="o", color="C0", capsize=3)
    trust.set(xlabel="stated probability", ylabel="share true", xlim=(0, 1.02), ylim=(-0.03, 1.03))
    if brier is not None:
        trust.set_title(f"Brier score {brier:.3f}", fontsize=10)
    matrix = confusion(rows)
    truths = sorted(matrix, key=lambda t: (t in HEALTHY, t))
    names = sorted({n for c in matrix.values() for n in c}, key=lambda n: (n in (*HEALTHY, "unlisted", "no result"), n))
    cells = [[matrix[t][n] / matrix[t].total() for n in names] for t in truths]
    if cells:
        picture.imshow(cells, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    picture.set_xticks(range(len(names)), names, rotation=70, ha="right", fontsize=7)
    picture.set_yticks(range(len(truths)), truths, fontsize=7)
    picture.set(xlabel="named first", ylabel="truth")
    path.parent.mkdir(parents=True, exist_ok=True)
    page.savefig(path, dpi=130)
