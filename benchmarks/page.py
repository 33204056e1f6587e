"""The page of a measurement, in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from .goals import ALLOWED, Goal, Look, Step
from .pages import written
from .race import Ratio
from .scaling import LEAST_SAMPLES, PEERS_UP_TO, Point
from .workload import BATCH


@dataclass(frozen=True)
class Results:
    """Everything that one run has measured."""

    command: str
    machine: dict[str, str]
    versions: dict[str, str]
    repeats: int
    goals: list[Goal]
    step: Step
    look: Look
    sizes: list[Point]
    threads: list[Point]
    #: What ``python -m benchmarks.alone`` has printed; empty where it was left out.
    alone: str


def page(results: Results) -> str:
    """The whole page.

    Parameters
    ----------
    results : Results
        One run.

    Returns
    -------
    str
    """
    known = {**results.machine, **results.versions}
    step, look = results.step, results.look
    return written(
        "benchmarks",
        command=results.command,
        machine=table(("", ""), known.items()),
        repeats=results.repeats,
        allowed=ALLOWED,
        goals=goal_table(results.goals),
        step=seconds(step.step),
        empty=seconds(step.empty),
        above=seconds(step.step - step.empty),
        most=seconds(step.most),
        verdict=step.verdict,
        inside=seconds(step.inside),
        table=seconds(look.table),
        solve=seconds(look.solve),
        longer=spread(look.ratio),
        apart=look.apart,
        least=LEAST_SAMPLES,
        peers_up_to=PEERS_UP_TO,
        sizes=points(results.sizes, "plants", "size"),
        batch=BATCH,
        threads=points(results.threads, "threads", "threads"),
        alone=results.alone.rstrip() or "left out",
    )


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table, all columns but the first to the right."""
    lines = [header, ["---", *["---:"] * (len(header) - 1)], *rows]
    return "\n".join("| " + " | ".join(row) + " |" for row in lines)


def seconds(value: float | None) -> str:
    """A time in the unit that suits it."""
    if value is None:
        return "-"
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if value >= size:
            return f"{value / size:.3g} {unit}"
    return f"{value / 1e-9:.3g} ns"


def spread(found: Ratio | None) -> str:
    """A ratio with its quartiles."""
    if found is None:
        return "-"
    return f"{found.middle:.3g} ({found.low:.3g} to {found.high:.3g})"


def goal_table(goals: list[Goal]) -> str:
    """The goals with a peer."""
    rows = [
        (
            f"{goal.work}, against {goal.peer}",
            seconds(goal.ours),
            seconds(goal.theirs),
            spread(goal.ratio),
            "-" if goal.apart is None else f"{goal.apart:.1e}",
            "-" if goal.least is None else f"{goal.least:g}",
            goal.verdict,
        )
        for goal in goals
    ]
    header = ("Shoulder", "pamrs", "peer", "ratio (quartiles)", "apart [deg]", "goal", "")
    return table(header, rows)


def points(found: list[Point], first: str, key: str) -> str:
    """Times of one step over a number, with all who took part."""
    names = list(dict.fromkeys(name for point in found for name in point.step))
    rows = [
        (
            f"{getattr(point, key):,}",
            f"{point.samples}",
            *(seconds(point.step.get(name)) for name in names),
            f"{1e-6 / point.step['pamrs']:.3g}",
        )
        for point in found
    ]
    return table((first, "samples", *names, "pamrs: million steps per second"), rows)
