"""The targets of the proof, and what a trial measured against each."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from statistics import mean, median

from .effects import LISTED
from .score import Row, Scores

#: multiple of the noise that an effect must leave after a refit to be asked for
SEEN = 3.0


@dataclass(frozen=True)
class Target:
    """One target and its measurement.

    `measured` is None where no case of that class exists; `interval` is that of 95 %, `share` the hits and cases of a share.
    `least` tells whether the target is a lower bound.
    """

    name: str
    over: str
    wanted: float
    least: bool
    measured: float | None
    interval: tuple[float, float] | None
    cases: int
    share: tuple[int, int] | None = None
    unit: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the measured value is on the right side; None where nothing was measured."""
        if self.measured is None:
            return None
        return self.measured >= self.wanted if self.least else self.measured <= self.wanted

    @property
    def settled(self) -> bool:
        """Whether the whole interval is on the same side of the target as the value."""
        if self.interval is None or self.met is None:
            return False
        low, high = self.interval
        if self.least:
            return low >= self.wanted if self.met else high < self.wanted
        return high <= self.wanted if self.met else low > self.wanted


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


def median_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """Interval of at least 95 % of the median by order statistics (binomial); None below six values."""
    n = len(values)
    ordered = sorted(values)
    below, k = 0.5**n, 0
    if n < 6:
        return None
    while below + math.comb(n, k + 1) * 0.5**n <= 0.025:
        k += 1
        below += math.comb(n, k) * 0.5**n
    return ordered[k], ordered[n - 1 - k]


def mean_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """Normal interval of 95 % of a mean; None below six values."""
    n = len(values)
    if n < 6:
        return None
    middle = mean(values)
    half = 1.96 * math.sqrt(sum((v - middle) ** 2 for v in values) / (n - 1) / n)
    return middle - half, middle + half


def targets(scores: Scores, catalogue: Sequence[str] = LISTED) -> list[Target]:
    """Every target of the proof against the rows of a trial.

    What can be meant two ways is given both ways: over all cases, weak ones that nobody can find included, and over those
    of which a refit of the parameters leaves 3 times the noise. A missing result is a miss, and a case whose gap was not closed
    because nothing was named counts with a gap closed of 0.
    """
    rows = scores.rows
    healthy = [r for r in rows if r.healthy]
    listed = [r for r in rows if r.ids and all(i in catalogue for i in r.ids)]
    unlisted = [r for r in rows if r.ids and not any(i in catalogue for i in r.ids)]
    sick = [r for r in rows if r.ids]
    seen, lost = [r for r in listed if r.visible >= SEEN], f"{SEEN:g} x noise left after a refit"
    found: list[Target] = []

    def share(name: str, over: str, wanted: float, group: Iterable[Row], hit: Callable[[Row], bool], least: bool = True) -> None:
        told = [hit(r) for r in group]
        k, n = sum(told), len(told)
        found.append(Target(name, over, wanted, least, k / n if n else None, wilson(k, n) if n else None, n, (k, n)))

    def middle(name: str, over: str, wanted: float, values: list[float]) -> None:
        found.append(Target(name, over, wanted, True, median(values) if values else None, median_interval(values), len(values)))

    def average(name: str, over: str, wanted: float, values: list[float]) -> None:
        found.append(Target(name, over, wanted, True, mean(values) if values else None, mean_interval(values), len(values)))

    share("false alarms", "nulls and parameters only", 0.01, healthy, lambda r: r.detected, least=False)
    share("detected", lost, 0.99, (r for r in sick if r.visible >= SEEN), lambda r: r.detected)
    share("detected", f"moves a channel by {SEEN:g} x noise", 0.99, (r for r in sick if r.reach >= SEEN), lambda r: r.detected)
    share("right name first", f"catalogue effects, {lost}", 0.90, seen, lambda r: r.outcome == "right")
    share("right name first", "catalogue effects, every strength", 0.90, listed, lambda r: r.outcome == "right")
    share("name or ambiguity set holds the truth", f"catalogue effects, {lost}", 0.98, seen, lambda r: r.contains)
    share("name or ambiguity set holds the truth", "catalogue effects, every strength", 0.98, listed, lambda r: r.contains)
    visible = [*healthy, *(r for r in sick if r.visible >= SEEN)]
    average("mean probability on the truth", f"healthy cases, and effects with {lost}", 0.85, [r.probability or 0.0 for r in visible])
    average("mean probability on the truth", "all cases", 0.85, [r.probability or 0.0 for r in rows])
    plain = [r for r in unlisted if r.visible >= SEEN]
    share("unlisted recognised", f"effects of no catalogue, {lost}", 0.85, plain, lambda r: r.outcome == "right")
    share("unlisted recognised", "effects of no catalogue, all", 0.85, unlisted, lambda r: r.outcome == "right")
    middle("median held-out gap closed", f"catalogue effects, {lost}", 0.90, [r.gap for r in seen if r.gap is not None])
    middle("median held-out gap closed", "catalogue effects, every strength", 0.90, [r.gap for r in listed if r.gap is not None])
    average("ambiguity-group utility", "all cases", 0.95, [r.utility or 0.0 for r in rows])
    seconds = [r.seconds for r in rows if r.seconds is not None]
    within = [s <= 60.0 for s in seconds]
    found.append(
        Target(
            "seconds of a diagnosis", f"median; {sum(within)} of {len(within)} within 60 s, longest {max(seconds, default=0.0):.0f} s",
            60.0, False, median(seconds) if seconds else None, median_interval(seconds), len(seconds), unit="s",
        )
    )  # fmt: skip
    return found
