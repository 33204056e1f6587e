"""Tables of a scored trial."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from statistics import median

from .effects import LISTED
from .score import Row, Scores
from .strength import STRENGTHS
from .targets import Target, targets, wilson

BINS = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)


def percent(hits: int, cases: int) -> str:
    """A share in percent with its Wilson interval of 95 %."""
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
            truth = row.ids[0] if row.ids else "+".join(name for name, _ in row.wrong) or row.truth
            found.setdefault(truth, Counter())[
                "no result" if row.verdict == "missing" else row.first
            ] += 1
    return found


def reliability(
    rows: Sequence[Row],
) -> tuple[list[tuple[float, float, float, int, int]], float | None]:
    """How often the leading hypothesis was the truth, by its stated probability, and the Brier
    score.

    Returns
    -------
    bins : list of tuple
        Lower and upper edge, mean stated probability, number right, number of cases; empty bins are
        left out.
    brier : float or None
        Mean square of probability less outcome; None without a stated probability.
    """
    claims = [r.claim for r in rows if r.claim is not None]
    bins = []
    for low, high in zip(BINS, BINS[1:], strict=False):
        inside = [
            (p, ok) for p, ok in claims if low <= p < high or (high == BINS[-1] and p == high)
        ]
        if inside:
            bins.append(
                (
                    low,
                    high,
                    sum(p for p, _ in inside) / len(inside),
                    sum(ok for _, ok in inside),
                    len(inside),
                )
            )
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


def gaps(rows: Sequence[Row]) -> dict[str, dict[str, list[float]]]:
    """Gaps closed by effect and strength, as in :func:`by_strength`; cases without a gap are left
    out.
    """
    found: dict[str, dict[str, list[float]]] = {}
    for row in rows:
        if row.ids and row.wanted and row.gap is not None:
            name = "pair" if len(row.ids) > 1 else row.ids[0]
            found.setdefault(name, {}).setdefault(row.wanted, []).append(row.gap)
    return found


def _number(target: Target, value: float) -> str:
    if target.share is not None:
        return f"{100.0 * value:.1f} %"
    return f"{value:.0f} s" if target.unit == "s" else f"{value:.3f}"


def target_table(found: Sequence[Target]) -> str:
    """Markdown: every target beside what was measured, with intervals of 95 %."""
    body = []
    for t in found:
        bound = f"{100 * t.wanted:g} %" if t.share is not None else f"{t.wanted:g} {t.unit}".strip()
        bound = f"{'at least' if t.least else 'at most'} {bound}"
        if t.measured is None:
            body.append((t.name, t.over, bound, "-", "-", "0", "no case"))
            continue
        interval = (
            "-"
            if t.interval is None
            else f"{_number(t, t.interval[0])} to {_number(t, t.interval[1])}"
        )
        count = str(t.cases) if t.share is None else f"{t.share[0]} of {t.share[1]}"
        verdict = ("met" if t.met else "**missed**") + ("" if t.settled else ", not settled")
        body.append((t.name, t.over, bound, _number(t, t.measured), interval, count, verdict))
    text = table(("measure", "over", "target", "measured", "95 % interval", "cases", ""), body)
    return (
        f"{text}\n\nNot settled: the interval reaches over the target, and another trial of this "
        "size might come out on its other side."
    )


def _by_effect(rows: list[Row]) -> str:
    """Detected, rightly named and gap closed: a row for each effect, a column for each strength."""
    labels = (*STRENGTHS, "pair")
    closed = gaps(rows)
    split = by_strength(rows)
    lines = []
    for name in sorted(split):
        cells = [split[name].get(label) for label in labels]
        texts = ["-" if c is None else f"{c[0]}, {c[1]} of {c[2]}" for c in cells]
        middles = [closed.get(name, {}).get(label) for label in labels]
        lines.append(
            (
                name,
                *(f"{t}; {median(m):.2f}" if m else t for t, m in zip(texts, middles, strict=True)),
            )
        )
    every = []
    for label in labels:
        hit = [c[label] for c in split.values() if label in c]
        a, b, n = (sum(c[i] for c in hit) for i in range(3))
        every.append(f"{percent(a, n)}, {percent(b, n)}" if n else "-")
    return table(("effect", *labels), [*lines, ("all", *every)])


def markdown(scores: Scores, catalogue: Sequence[str] = LISTED) -> str:
    """All tables of a trial."""
    rows = scores.rows
    parts = ["## Targets\n", target_table(targets(scores, catalogue)), "\n## Measures\n"]
    body = [
        (name, percent(*share), f"{share[0]} of {share[1]}")
        for name, share in scores.shares.items()
    ]
    for name, value in scores.totals.items():
        if name not in scores.shares:
            body.append(
                (
                    name,
                    "-"
                    if value is None
                    else f"{value}"
                    if isinstance(value, int)
                    else f"{value:.3f}",
                    "",
                )
            )
    parts.append(table(("measure", "value (95 % interval)", "count"), body))
    parts.append("\n## Detected, rightly named and gap closed, by effect and strength\n")
    parts.append(
        "Detected, right name first, of so many; median share of the gap to the noise closed on "
        "held-out recordings.\n"
    )
    parts.append(_by_effect(rows))
    parts.append("\n## What was named first\n")
    matrix = confusion(rows)
    parts.append(
        table(
            ("truth", "cases", "named first"),
            [
                (t, str(c.total()), ", ".join(f"{n} {k}" for k, n in c.most_common()))
                for t, c in sorted(matrix.items())
            ],
        )
    )
    parts.append("\n## Calibration of the leading hypothesis\n")
    bins, brier = reliability(rows)
    parts.append(
        table(
            ("stated", "mean stated", "true (95 % interval)", "cases"),
            [
                (f"{lo:.2f} to {hi:.2f}", f"{p:.3f}", percent(k, n), str(n))
                for lo, hi, p, k, n in bins
            ],
        )
    )
    parts.append(f"\nBrier score: {'-' if brier is None else f'{brier:.4f}'}")
    return "\n".join(parts) + "\n"
