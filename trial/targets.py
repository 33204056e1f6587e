"""The targets of the proof, and what a trial measured against each."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from statistics import mean, median

from .effects import LISTED
from .score import Row, Scores

#: multiple of the noise that must remain of an effect after a refit for the targets to ask for it
SEEN = 3.0


@dataclass(frozen=True)
class Target:
    """One target and its measurement.

    `measured` is None where no case of that class exists; `interval` is that of 95 %, `share` the
    hits and cases of a share. `least` tells whether the target is a lower bound.
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


class _Sheet:
    """Targets with what the rows of a trial measured."""

    def __init__(self) -> None:
        self.found: list[Target] = []

    def share(
        self,
        name: str,
        over: str,
        wanted: float,
        group: Iterable[Row],
        hit: Callable[[Row], bool],
        least: bool = True,
    ) -> None:
        """The share of a group that is hit."""
        told = [hit(r) for r in group]
        k, n = sum(told), len(told)
        measured, interval = (k / n, wilson(k, n)) if n else (None, None)
        self.found.append(Target(name, over, wanted, least, measured, interval, n, (k, n)))

    def middle(self, name: str, over: str, wanted: float, values: list[float]) -> None:
        """The median of values."""
        measured = median(values) if values else None
        interval, n = median_interval(values), len(values)
        self.found.append(Target(name, over, wanted, True, measured, interval, n))

    def average(self, name: str, over: str, wanted: float, values: list[float]) -> None:
        """The mean of values."""
        measured = mean(values) if values else None
        interval, n = mean_interval(values), len(values)
        self.found.append(Target(name, over, wanted, True, measured, interval, n))


_LEFT = f"{SEEN:g} x noise left after a refit"
_EVERY = "catalogue effects, every strength"


def _visible(rows: Iterable[Row]) -> list[Row]:
    """Those of which enough remains after a refit for the targets to ask for them."""
    return [r for r in rows if r.visible >= SEEN]


def _right(row: Row) -> bool:
    return row.outcome == "right"


def targets(scores: Scores, catalogue: Sequence[str] = LISTED) -> list[Target]:
    """Every target of the proof against the rows of a trial.

    What can be meant two ways is given both ways: over all cases, weak ones that nobody can find
    included, and over those of which a refit of the parameters leaves 3 times the noise. A missing
    result is a miss, and a case whose gap was not closed because nothing was named counts with a
    gap closed of 0.
    """
    rows, sheet = scores.rows, _Sheet()
    listed = [r for r in rows if r.ids and all(i in catalogue for i in r.ids)]
    unlisted = [r for r in rows if r.ids and not any(i in catalogue for i in r.ids)]
    _of_detection(sheet, rows)
    _of_names(sheet, listed)
    _of_chances(sheet, rows)
    _of_unlisted(sheet, unlisted)
    _of_gaps(sheet, listed)
    sheet.average("ambiguity-group utility", "all cases", 0.95, [r.utility or 0.0 for r in rows])
    sheet.found.append(_seconds(rows))
    return sheet.found


def _of_detection(sheet: _Sheet, rows: list[Row]) -> None:
    healthy, sick = [r for r in rows if r.healthy], [r for r in rows if r.ids]

    def detected(row: Row) -> bool:
        return row.detected

    moved = [r for r in sick if r.reach >= SEEN]
    channel = f"moves a channel by {SEEN:g} x noise"
    sheet.share("false alarms", "nulls and parameters only", 0.01, healthy, detected, least=False)
    sheet.share("detected", _LEFT, 0.99, _visible(sick), detected)
    sheet.share("detected", channel, 0.99, moved, detected)


def _of_names(sheet: _Sheet, listed: list[Row]) -> None:
    def contains(row: Row) -> bool:
        return row.contains

    seen, title = _visible(listed), "name or ambiguity set holds the truth"
    sheet.share("right name first", f"catalogue effects, {_LEFT}", 0.90, seen, _right)
    sheet.share("right name first", _EVERY, 0.90, listed, _right)
    sheet.share(title, f"catalogue effects, {_LEFT}", 0.98, seen, contains)
    sheet.share(title, _EVERY, 0.98, listed, contains)


def _of_chances(sheet: _Sheet, rows: list[Row]) -> None:
    healthy, sick = [r for r in rows if r.healthy], [r for r in rows if r.ids]
    visible = [r.probability or 0.0 for r in (*healthy, *_visible(sick))]
    title = "mean probability on the truth"
    sheet.average(title, f"healthy cases, and effects with {_LEFT}", 0.85, visible)
    sheet.average(title, "all cases", 0.85, [r.probability or 0.0 for r in rows])


def _of_unlisted(sheet: _Sheet, unlisted: list[Row]) -> None:
    plain = _visible(unlisted)
    sheet.share("unlisted recognised", f"effects of no catalogue, {_LEFT}", 0.85, plain, _right)
    sheet.share("unlisted recognised", "effects of no catalogue, all", 0.85, unlisted, _right)


def _of_gaps(sheet: _Sheet, listed: list[Row]) -> None:
    seen = [r.gap for r in _visible(listed) if r.gap is not None]
    every = [r.gap for r in listed if r.gap is not None]
    sheet.middle("median held-out gap closed", f"catalogue effects, {_LEFT}", 0.90, seen)
    sheet.middle("median held-out gap closed", _EVERY, 0.90, every)


def _seconds(rows: list[Row]) -> Target:
    seconds = [r.seconds for r in rows if r.seconds is not None]
    within = [s <= 60.0 for s in seconds]
    longest = max(seconds, default=0.0)
    return Target(
        "seconds of a diagnosis",
        f"median; {sum(within)} of {len(within)} within 60 s, longest {longest:.0f} s",
        60.0,
        False,
        median(seconds) if seconds else None,
        median_interval(seconds),
        len(seconds),
        unit="s",
    )
