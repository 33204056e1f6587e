"""Shares and means with their intervals, and tables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from statistics import mean


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
    half = (
        z
        / (1.0 + zz / cases)
        * math.sqrt(share * (1.0 - share) / cases + zz / (4.0 * cases * cases))
    )
    low = 0.0 if hits == 0 else max(middle - half, 0.0)
    return low, 1.0 if hits == cases else min(middle + half, 1.0)


def median_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """Interval of at least 95 % of the median by order statistics (binomial); None below six
    values.
    """
    n = len(values)
    ordered = sorted(values)
    below, k = 0.5**n, 0
    if n < 6:
        return None
    while below + math.comb(n, k + 1) / 2**n <= 0.025:
        k += 1
        below += math.comb(n, k) / 2**n
    return ordered[k], ordered[n - 1 - k]


def mean_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """Normal interval of 95 % of a mean; None below six values."""
    n = len(values)
    if n < 6:
        return None
    middle = mean(values)
    half = 1.96 * math.sqrt(sum((v - middle) ** 2 for v in values) / (n - 1) / n)
    return middle - half, middle + half


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
