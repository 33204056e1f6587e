"""Other methods on cases of a trial: how much of the error each closes, and what a user
can read from them.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from .marks import CHANNEL, Mark, marks
from .summary import percent, table

SCHEMA = "pamrs.baselines/1"
METHODS = {
    "refit": "refit inside tolerances",
    "free": "refit, free",
    "sindy": "SINDy",
    "gp": "Gaussian process",
    "pamrs": "pamrs",
}
LEARNING = ("sindy", "gp")
WORSE = 1.05
"""Held-out error over that of the refit from which a correction has made it worse."""
NOTHING = "no correction"
ALONE = "one free log"
ALIKE = 0.05
"""Difference of two shares of a gap from which one is larger."""


@dataclass(frozen=True)
class Beside:
    """One case by every method.

    Attributes
    ----------
    mark : Mark
        What the diagnosis said of it.
    gaps : dict of str to float or None
        Share of the gap from the refit to the noise that each closes; None: there is none.
    worse : dict of str to bool
        Whether some channel's held-out error is more than 5 % above that of the refit.
    block : dict of str to str
        Block whose error a method takes most off, in noises; empty where it takes nothing off.
    acts : tuple of str
        Blocks in which an effect acts or a parameter is wrong.
    silent : dict of str to bool
        Whether a learning method corrects nothing.
    alarm : bool
        Whether the refit's chi-square raises an alarm.
    seconds : float
        Of the clock, all methods but the diagnosis.
    """

    mark: Mark
    gaps: dict[str, float | None]
    worse: dict[str, bool]
    block: dict[str, str]
    acts: tuple[str, ...]
    silent: dict[str, bool]
    alarm: bool
    seconds: float

    @property
    def healthy(self) -> bool:
        """Whether neither an effect acts nor a parameter is far off."""
        return not self.acts

    @property
    def alone(self) -> bool:
        """Whether there is one recording, so that a method is judged on what it learned from."""
        return ALONE in self.mark.tags["log"]


def _noises(held_out: dict[str, dict[str, float]], method: str) -> dict[str, float]:
    """What a method takes off each block's held-out error, in noises; of the arm that of its angle
    or its length.
    """
    places = {channel: block for block, channel in CHANNEL.items()}
    found: dict[str, float] = {}
    for channel, e in held_out.items():
        block = places.get(channel, "arm")
        found[block] = found.get(block, 0.0) + (e["refit"] - e[method]) / e["noise"]
    return found


def _one(mark: Mark, key: dict[str, Any], told: dict[str, Any]) -> Beside:
    held = told["held_out"]
    others = [m for m in METHODS if m != "pamrs"]
    gaps = {m: told["gap_closed"].get(m) for m in others}
    gaps["pamrs"] = None if gaps["refit"] is None else mark.gap
    block = {}
    for m in others[1:]:
        off = _noises(held, m)
        best = max(off, key=lambda name, off=off: off[name])  # type: ignore[misc]
        block[m] = best if off[best] > 0.0 else ""
    kinds = ("effect", "parameter")
    return Beside(
        mark,
        gaps,
        {m: any(e[m] > WORSE * e["refit"] for e in held.values()) for m in others[1:]},
        block,
        tuple(sorted({str(t["block"]) for t in key["terms"] if t["kind"] in kinds})),
        {m: set(told["models"][m].values()) == {NOTHING} for m in LEARNING},
        bool(told["detected"]["refit"]),
        sum(told["seconds"].values()),
    )


def told_by_others(file: Path) -> dict[str, Any]:
    """What the other methods made of a case.

    Raises
    ------
    ValueError
        A result of another schema.
    """
    told: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    if told.get("schema") != SCHEMA:
        raise ValueError(f"{file}: schema must be {SCHEMA!r}")
    return told


def beside(keys: Path, results: Path) -> list[Beside]:
    """Every case of a trial that the other methods were run on.

    Parameters
    ----------
    keys : Path
        Folder with the keys.
    results : Path
        Results of the diagnosis, with ``baselines/NAME.json``.

    Raises
    ------
    ValueError
        A result of another schema.
    """
    found = []
    for mark in marks(keys, results):
        file = Path(results) / "baselines" / f"{mark.case}.json"
        if not file.is_file():
            continue
        told = told_by_others(file)
        key = json.loads((Path(keys) / f"{mark.case}.json").read_text(encoding="utf-8"))
        found.append(_one(mark, key, told))
    return found


def _gap_line(name: str, cases: Sequence[Beside]) -> tuple[str, ...] | None:
    """Median gap closed by every method, over the cases in which each has one."""
    whole = [c.gaps for c in cases if all(c.gaps[m] is not None for m in METHODS)]
    if not whole:
        return None
    middle = [median(g[m] or 0.0 for g in whole) for m in METHODS]
    return (name, str(len(whole)), *(f"{v:.2f}" for v in middle))


def _gaps(cases: Sequence[Beside]) -> str:
    every = [c for c in cases if not c.healthy]
    lines = [
        _gap_line("with recordings held out", [c for c in every if not c.alone]),
        _gap_line("one recording, judged on what was fitted", [c for c in every if c.alone]),
    ]
    head = ("all that lack something", "cases", *METHODS.values())
    return table(head, [line for line in lines if line is not None])


def _pairs(cases: Sequence[Beside]) -> str:
    """In how many cases the diagnosis closes more than each of the others, as much, and less."""
    ill = (c for c in cases if not c.healthy and not c.alone)
    whole = [c.gaps for c in ill if None not in c.gaps.values()]
    rows = []
    for m in list(METHODS)[:-1]:
        ahead = [(g["pamrs"] or 0.0) - (g[m] or 0.0) for g in whole]
        more, less = sum(d > ALIKE for d in ahead), sum(d < -ALIKE for d in ahead)
        rows.append((METHODS[m], str(more), str(len(ahead) - more - less), str(less)))
    return table(("pamrs against", "closes more", "alike, within 0.05", "closes less"), rows)


def _count(cases: Sequence[Beside], hit: Callable[[Beside], bool]) -> str:
    hits = sum(hit(c) for c in cases)
    return f"{hits} of {len(cases)}; {percent(hits, len(cases))}" if cases else "-"


def _read(cases: Sequence[Beside]) -> str:
    """What a user can read from each method."""
    ill = [c for c in cases if not c.healthy and not c.alone]
    well = [c for c in cases if c.healthy]
    clean = [c for c in well if "0 %" in c.mark.tags["model error"]]
    named = [c for c in ill if c.mark.leading is not None]
    none = ("0 by construction",) * 4
    columns = [m for m in METHODS if m not in ("refit", "pamrs")]

    def line(
        word: str, group: Sequence[Beside], hit: Callable[[Beside, str], bool], last: str
    ) -> tuple[str, ...]:
        told = [_count(group, lambda c, m=m: hit(c, m)) for m in columns]  # type: ignore[misc]
        return (word, "-", *told, last)

    def alarms(where: str, group: Sequence[Beside]) -> tuple[str, ...]:
        return (
            f"says that something is missing where {where}",
            _count(group, lambda c: c.alarm),
            "-",
            *(_count(group, lambda c, m=m: not c.silent[m]) for m in LEARNING),  # type: ignore[misc]
            _count(group, lambda c: c.mark.verdict in ("effects", "unlisted")),
        )

    rows = [
        ("right effect named first", *none, _count(named, lambda c: bool(c.mark.leading))),
        line("block that it corrects most is at fault", ill, lambda c, m: c.block[m] in c.acts,
             "-"),
        line("corrects nothing though something is missing", ill,
             lambda c, m: not c.block[m] or c.silent.get(m, False), "-"),
        line("a channel is worse than after the refit", ill, lambda c, m: c.worse[m], "-"),
        alarms("nothing is", clean),
        alarms("there is model error alone", [c for c in well if c not in clean]),
    ]  # fmt: skip
    return table(("", *METHODS.values()), rows)


def peers_page(cases: Sequence[Beside], head: str = "") -> str:
    """Markdown: gaps closed, case by case, what can be read; `head` closes the first paragraph."""
    spent = [c.seconds for c in cases]
    parts = [
        "# Other methods on cases of a trial\n",
        f"{len(cases)} cases, the recordings that the diagnosis had. A refit of the parameters "
        "inside their tolerances (3 of them at most) is where all begin. `refit, free` goes on "
        "without tolerances, to 10 times the value or 30 tolerances. SINDy and a Gaussian process "
        "learn what that refit leaves, from measured signals, and correct it only where this helps "
        "on recordings left out one at a time (with one recording to fit SINDy corrects nothing, "
        "and the Gaussian process always)." + head + "\n",
        "## Gap closed, median\n",
        "Share of the way from the error after a refit inside the tolerances to the noise, on "
        "held-out recordings, all channels in noises together; 0 where a method makes it worse. "
        "Cases without an effect and without a wrong value are left out, and those whose refit "
        "leaves no gap. With one recording nothing is held out: those cases stand in no other "
        "table but that of alarms.\n",
        _gaps(cases),
        "\n## Case by case\n",
        _pairs(cases),
        "\n## What a user can read from them\n",
        _read(cases),
        "\nThe refits give parameters, and say nothing when those are absurd. SINDy gives an "
        "equation of the residual in measured signals such as `dp` or `|q|`; one effect appears "
        "under several of them. The Gaussian process gives lengths of a kernel. An alarm of SINDy "
        "or the Gaussian process is that it corrects anything; they have no test.\n",
        f"Median {median(spent):.0f} s for all other methods on a case, longest {max(spent):.0f} "
        f"s, {sum(spent) / 60.0:.0f} min together.",
    ]
    return "\n".join(parts) + "\n"
