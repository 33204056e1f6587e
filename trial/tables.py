"""Scores by stratum, beside their targets, as Markdown and as JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from .families import OTHER
from .marks import BLOCKS, BlockMark, Mark
from .summary import mean_interval, median_interval, percent, table, wilson

SCHEMA = "pamrs.trial-scores/2"
BINS = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
#: shares of a stratum, by name: what it counts in a case (several entries of some)
Counts = Callable[[Mark], Sequence[bool]]


def _one(name: str) -> Counts:
    def count(m: Mark) -> Sequence[bool]:
        value = getattr(m, name)
        return () if value is None else (bool(value),)

    return count


SHARES: dict[str, Counts] = {
    "leading name right": _one("leading"),
    "set holds the truth": _one("holds"),
    "block located": _one("located"),
    "wrong parameter named": _one("wrong"),
    "false name": _one("false_name"),
    "unlisted right": _one("unlisted"),
    "none or parameters, error stated": _one("calm"),
    "interval holds": lambda m: m.inside,
    "share within 15 points": lambda m: m.shares,
}
#: what the second design asks of them, and whether that is the least
WANTED: dict[str, tuple[float, bool]] = {
    "leading name right": (0.90, True),
    "set holds the truth": (0.98, True),
    "block located": (0.97, True),
    "wrong parameter named": (0.95, True),
    "false name": (0.01, False),
    "unlisted right": (0.85, True),
    "none or parameters, error stated": (0.99, True),
    "interval holds": (0.90, True),
    "share within 15 points": (1.0, True),
}
STRATA = (
    "truth",
    "strength",
    "own channel",
    "distance",
    "effects",
    "placing",
    "model error",
    "form",
    "first catalogue",
    "block",
    "rig",
    "rate",
    "bits",
    "log",
)
#: strata and counts of plans with a pair: other plans do without them
PLACED = "place"


def share_of(marks: Iterable[Mark], counts: Counts) -> tuple[int, int]:
    """Hits and cases."""
    told = [ok for m in marks for ok in counts(m)]
    return sum(told), len(told)


def gap_closed(marks: Iterable[Mark]) -> list[float]:
    """Gaps closed of those cases that have one."""
    return [m.gap for m in marks if m.gap is not None]


def reliability(marks: Iterable[Mark]) -> tuple[list[dict[str, float]], float | None]:
    """Bins of the stated probability of the leading hypothesis of every group of blocks, and the
    mean distance of stated and true.
    """
    claims = [c for m in marks for c in m.claims]
    bins: list[dict[str, float]] = []
    for low, high in zip(BINS, BINS[1:], strict=False):
        inside = [(p, ok) for p, ok in claims if low <= p < high or p == high == BINS[-1]]
        if inside:
            stated = sum(p for p, _ in inside) / len(inside)
            hits = sum(ok for _, ok in inside)
            bins.append(
                {"low": low, "high": high, "stated": stated, "hits": hits, "n": len(inside)}
            )
    off = sum(abs(b["stated"] * b["n"] - b["hits"]) for b in bins)
    return bins, off / len(claims) if claims else None


def percentile(values: Sequence[float], part: float) -> float | None:
    """The smallest value that this part of them does not exceed."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(part * len(ordered)))] if ordered else None


def measures(marks: Sequence[Mark]) -> dict[str, Any]:
    """Everything that is measured of some cases."""
    found: dict[str, Any] = {
        "cases": len(marks),
        "missing": sum(m.verdict == "missing" for m in marks),
    }
    for name, counts in SHARES.items():
        k, n = share_of(marks, counts)
        found[name] = {"hits": k, "n": n, **(_interval(k, n) if n else {})}
    gaps, seconds = gap_closed(marks), [m.seconds for m in marks if m.seconds is not None]
    found["gap closed"] = {"n": len(gaps), "median": median(gaps) if gaps else None}
    bins, off = reliability(marks)
    found["reliability"] = {"bins": bins, "distance": off, "n": sum(int(b["n"]) for b in bins)}
    found["seconds"] = {
        "n": len(seconds),
        "median": median(seconds) if seconds else None,
        "95 %": percentile(seconds, 0.95),
    }
    found["by block"] = {
        block: _by_block(block, [b for m in marks for b in m.blocks if block in b.block.split("+")])
        for block in BLOCKS
    }
    return found


def _interval(k: int, n: int) -> dict[str, float]:
    low, high = wilson(k, n)
    return {"share": k / n, "low": low, "high": high}


def _by_block(block: str, blocks: list[BlockMark]) -> dict[str, Any]:
    """Marks of the groups that a block belongs to; names only where an effect acts in the block."""
    told = [b.leading for b in blocks if b.leading is not None and block in b.acts]
    false = [b.false_name for b in blocks]
    return {
        "leading name right": {"hits": sum(told), "n": len(told)},
        "false name": {"hits": sum(false), "n": len(false)},
    }


@dataclass(frozen=True)
class Target:
    """A target of the second design, and what was measured."""

    name: str
    over: str
    wanted: float
    least: bool
    measured: float | None
    interval: tuple[float, float] | None
    n: int
    unit: str = "%"

    @property
    def met(self) -> bool | None:
        """Whether it is met; None where nothing was measured."""
        if self.measured is None:
            return None
        return self.measured >= self.wanted if self.least else self.measured <= self.wanted

    def to_dict(self) -> dict[str, Any]:
        """For the JSON of a score."""
        return {**self.__dict__, "met": self.met}


def targets(marks: Sequence[Mark]) -> list[Target]:
    """Targets of the second design: over what leaves 3 noises, apart for little and much model
    error, and beside model error that is smaller than the effect.
    """
    found: list[Target] = []
    little = [m for m in marks if "3 %" not in m.tags["model error"]]
    much = [m for m in marks if "3 %" in m.tags["model error"]]
    for over, group, name, false in (
        ("model error of 0 and 1 %", little, 0.90, 0.01),
        ("the same, not below the model error", [m for m in little if m.above], 0.90, 0.01),
        ("model error of 3 %", much, 0.80, 0.03),
    ):
        seen = [m for m in group if m.seen]
        words = f"3 noises and more, {over}"
        other = [m for m in seen if m.tags["form"] == (OTHER,)]

        def share(
            title: str, wanted: float, chosen: list[Mark], counts: Counts, least: bool, where: str
        ) -> None:
            k, n = share_of(chosen, counts)
            measured, interval = (k / n, wilson(k, n)) if n else (None, None)
            found.append(Target(title, where, wanted, least, measured, interval, n))

        share("leading name right", name, seen, SHARES["leading name right"], True, words)
        share(
            "leading name right, forms left out", min(name, 0.85), other,
            SHARES["leading name right"], True, words,
        )  # fmt: skip
        if group is much:
            share("false name", false, much, SHARES["false name"], False, over)
            continue
        for title, wanted in (
            (t, WANTED[t][0])
            for t in (
                "set holds the truth",
                "block located",
                "wrong parameter named",
                "interval holds",
                "share within 15 points",
                "unlisted right",
            )
        ):
            share(title, wanted, seen, SHARES[title], True, words)
        if group is little:
            share("false name", false, little, SHARES["false name"], False, over)
            share(
                "none or parameters, error stated", 0.99, list(marks),
                SHARES["none or parameters, error stated"], True, "healthy",
            )  # fmt: skip
        gaps = gap_closed(m for m in seen if m.leading is not None)
        found.append(
            Target(
                "median gap closed",
                words,
                0.9,
                True,
                median(gaps) if gaps else None,
                median_interval(gaps),
                len(gaps),
                "",
            )  # fmt: skip
        )
    return [*found, *_overall(marks)]


def _overall(marks: Sequence[Mark]) -> list[Target]:
    """Reliability and time."""
    bins, off = reliability(marks)
    apart = [abs(p - ok) for m in marks for p, ok in m.claims]
    seconds = [m.seconds for m in marks if m.seconds is not None]
    middle = median(seconds) if seconds else None
    late = percentile(seconds, 0.95)
    n = len(seconds)
    return [
        Target("stated less true, mean", "all groups of blocks", 0.05, False, off,
               None if off is None else _about(off, mean_interval(apart)),
               sum(int(b["n"]) for b in bins)),
        Target("seconds, median", "all", 10.0, False, middle, median_interval(seconds), n, "s"),
        Target("seconds, 95 %", "all", 30.0, False, late, None, n, "s"),
    ]  # fmt: skip


def _about(off: float, spread: tuple[float, float] | None) -> tuple[float, float] | None:
    """A rough interval of the distance, as wide as that of the mean claim."""
    if spread is None:
        return None
    half = 0.5 * (spread[1] - spread[0])
    return max(off - half, 0.0), min(off + half, 1.0)


def scores(marks: Sequence[Mark]) -> dict[str, Any]:
    """All scores as plain data: the whole, every stratum, targets and cases."""
    strata: dict[str, Any] = {}
    for name in (*STRATA, *([PLACED] if any(PLACED in m.tags for m in marks) else [])):
        values = sorted({v for m in marks for v in m.tags.get(name, ())}, key=_order)
        strata[name] = {
            v: measures([m for m in marks if v in m.tags.get(name, ())]) for v in values
        }
    return {
        "schema": SCHEMA,
        "all": measures(marks),
        "strata": strata,
        "leave_form_out": measures([m for m in marks if m.tags["form"] == (OTHER,)]),
        **({"places": places} if (places := _places(marks)) else {}),
        "targets": [t.to_dict() for t in targets(marks)],
        "cases": [m.to_dict() for m in marks],
    }


def _places(marks: Sequence[Mark]) -> dict[str, Any]:
    """Of right names of effects that act at a side: how many have their place right, by place."""
    asked = [m for m in marks if m.placed is not None]
    found = {}
    for value in sorted({v for m in asked for v in m.tags.get(PLACED, ())}):
        k, n = share_of((m for m in asked if value in m.tags[PLACED]), _one("placed"))
        found[value] = {"hits": k, "n": n, **_interval(k, n)}
    return found


def _order(value: str) -> tuple[float, str]:
    """Numbers by size, words by name."""
    head = value.split(" ")[0]
    try:
        return float(head), value
    except ValueError:
        return 1.0e9, value


def _cell(told: dict[str, Any], name: str) -> str:
    """Hits, cases and share with its interval; in bold where the target is missed."""
    if not told["n"]:
        return "-"
    wanted, least = WANTED[name]
    share = told["hits"] / told["n"]
    text = f"{told['hits']} of {told['n']}; {percent(told['hits'], told['n'])}"
    return text if (share >= wanted if least else share <= wanted) else f"**{text}**"


def _asked() -> tuple[str, ...]:
    """The line of the targets."""
    words = (f"{'at least' if b else 'at most'} {100.0 * w:g} %" for w, b in WANTED.values())
    return ("target", "", *words, "0.9", "0.05", "10, 30")


def _line(name: str, told: dict[str, Any]) -> tuple[str, ...]:
    gap, seconds, off = told["gap closed"], told["seconds"], told["reliability"]["distance"]
    return (
        name,
        str(told["cases"]),
        *(_cell(told[n], n) for n in SHARES),
        "-" if gap["median"] is None else f"{gap['median']:.2f}",
        "-" if off is None else f"{off:.2f}",
        "-" if seconds["median"] is None else f"{seconds['median']:.0f}, {seconds['95 %']:.0f}",
    )


def _target_rows(told: Sequence[dict[str, Any]]) -> str:
    body = []
    for t in told:
        unit, factor = t["unit"], 100.0 if t["unit"] == "%" else 1.0

        def show(value: float, unit: str = unit, factor: float = factor) -> str:
            return f"{factor * value:.3g} {unit}".strip()

        bound = f"{'at least' if t['least'] else 'at most'} {show(t['wanted'])}"
        if t["measured"] is None:
            body.append((t["name"], t["over"], bound, "-", "-", "0", "no case"))
            continue
        span = "-" if t["interval"] is None else " to ".join(show(v) for v in t["interval"])
        word = "met" if t["met"] else "**missed**"
        body.append((t["name"], t["over"], bound, show(t["measured"]), span, str(t["n"]), word))
    head = ("measure", "over", "target", "measured", "95 % interval", "n", "")
    return table(head, body)


def markdown(told: dict[str, Any]) -> str:
    """All tables of :func:`scores`, and every case."""
    listing = [
        (c["case"], ", ".join(c["tags"]["rig"]), c["truth"], c["said"], _outcome(c))
        for c in told["cases"]
    ]
    cases = table(("case", "rig", "truth", "said", ""), listing)
    return f"{tables(told)}\n## Every case\n\n{cases}\n"


def tables(told: dict[str, Any]) -> str:
    """All tables of :func:`scores`."""
    head = ("stratum", "cases", *SHARES, "gap closed", "stated less true", "seconds, 95 %")
    parts = [
        "## Targets\n",
        _target_rows(told["targets"]),
        "\nMet or missed by the measured value; with few cases the interval says little.\n",
        "## Strata\n",
        "Of so many; Wilson intervals of 95 %. A case may stand in several lines. Gap closed: "
        "median. Stated less true: mean distance of the leading probability of each group of "
        "blocks. Bold: this line misses the target, which is asked of 3 noises and more beside at "
        "most 1 % of model error.\n",
        table(
            head,
            [_asked(), _line("all", told["all"]), _line("leave form out", told["leave_form_out"])],
        ),
    ]
    for name, values in told["strata"].items():
        if values:
            rows = [_line(v, m) for v, m in values.items()]
            parts += [f"\n### By {name}\n", table((name, *head[1:]), rows)]
    if told.get("places"):
        head_ = ("an effect acts at", "right names", "place right (95 % interval)")
        rows = [(v, str(m["n"]), percent(m["hits"], m["n"])) for v, m in told["places"].items()]
        parts += ["\n## Places of right names\n", table(head_, rows)]
    parts += ["\n## By block of the rig\n", _block_rows(told["all"]["by block"])]
    parts += ["\n## Stated probabilities\n", _bins(told["all"]["reliability"]["bins"])]
    return "\n".join(parts) + "\n"


def _block_rows(told: dict[str, Any]) -> str:
    rows = [
        (block, *(_cell(entry[n], n) for n in ("leading name right", "false name")))
        for block, entry in told.items()
    ]
    return table(("block", "leading name of the block right", "name where nothing acts"), rows)


def _bins(bins: Sequence[dict[str, float]]) -> str:
    rows = [
        (
            f"{b['low']:.2f} to {b['high']:.2f}",
            f"{b['stated']:.3f}",
            percent(int(b["hits"]), int(b["n"])),
            str(int(b["n"])),
        )
        for b in bins
    ]
    return table(("stated", "mean stated", "true", "groups"), rows) if rows else "None stated."


def _outcome(case: dict[str, Any]) -> str:
    """What was right and what not, in words."""
    words = {
        "leading": ("name right", "name wrong"),
        "wrong": ("parameter named", "parameter not named"),
        "unlisted": ("unlisted right", "not called unlisted"),
        "false_name": ("false name", "no false name"),
        "placed": ("place right", "place wrong"),
    }
    told = [words[n][0 if case[n] else 1] for n in words if case.get(n) is not None]
    return ", ".join(told)


def to_json(told: dict[str, Any]) -> str:
    """Scores as JSON, so that two tools can be laid side by side."""
    return json.dumps(told) + "\n"
