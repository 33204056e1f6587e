"""The page of a measurement, in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from .counting import WEIGHTS
from .goals import ALLOWED, Goal, Look, Step
from .limit import Limit
from .race import Ratio
from .scaling import LEAST_SAMPLES, PEERS_UP_TO, Point
from .workload import BATCH

__all__ = ["Results", "page"]


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
    limit: Limit
    #: What ``python -m benchmarks.bench`` has printed; empty where it was left out.
    reference: str


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
    parts = [
        head(results),
        goal_part(results.goals, results.repeats),
        step_part(results.step),
        look_part(results.look),
        scaling_part(results.sizes, results.threads),
        limit_part(results.limit),
        reference_part(results.reference),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


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


def head(results: Results) -> str:
    """Machine, versions and command."""
    known = {**results.machine, **results.versions}
    return "\n\n".join(
        [
            "# Benchmarks",
            f"Made by `{results.command}`. All numbers of this page come from one run on one "
            "machine. Ratios carry from machine to machine, seconds do not. The peers are in "
            "`benchmarks/peers`; they get the numbers of the same packaged rig.",
            table(("", ""), known.items()),
        ]
    )


def goal_part(goals: list[Goal], repeats: int) -> str:
    """The goals with a peer."""
    rows = [
        (
            f"{goal.work}, beside {goal.peer}",
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
    return "\n\n".join(
        [
            "## Beside peers",
            "The shoulder with its nominal parameters, RK4 at 1 ms, valve commands "
            "`5 + 1.5 sin(2 pi 0.8 t)` V held over 5 ms; batches vary the payload from 0 to 20 kg. "
            f"Works take turns, {repeats} times; times are medians, and the ratio (peer over "
            "pamrs) is the median of the ratios of all turns. `apart` is the largest difference "
            f"of the last joint angles; more than {ALLOWED:g} deg would not be the same result. "
            "SciPy chooses its own steps. One run keeps the four states that the peers keep, a "
            "batch its last angles. Lines without a goal are for comparison.",
            table(header, rows),
        ]
    )


def step_part(step: Step) -> str:
    """Time of one step from Python."""
    return (
        "## One step from Python\n\n"
        f"`Simulator.step` of one RK4 step takes {seconds(step.step)}, an empty call into the core "
        f"(a number read from the same object) {seconds(step.empty)}: "
        f"{seconds(step.step - step.empty)} above it. Goal: under {seconds(step.most)}; "
        f"{step.verdict}. Inside a run the same step takes {seconds(step.inside)}."
    )


def look_part(look: Look) -> str:
    """The table of the muscle against its equations."""
    return (
        "## The muscle's table against the direct solve\n\n"
        f"One force by the compiled table takes {seconds(look.table)}, by the braid's equations "
        f"{seconds(look.solve)}: {spread(look.ratio)} times as long. They differ by "
        f"{look.apart:.1e} of the largest force at most."
    )


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


def scaling_part(sizes: list[Point], threads: list[Point]) -> str:
    """Throughput over batch size and threads."""
    return "\n\n".join(
        [
            "## Scaling",
            "Time of one RK4 step of one plant. Large batches run for a shorter time, "
            f"{LEAST_SAMPLES} samples at least, so that starting up counts for more in them; peers "
            f"are left out above {PEERS_UP_TO:,} plants. All cores, but JAX on one.",
            points(sizes, "plants", "size"),
            f"{BATCH} plants over threads:",
            points(threads, "threads", "threads"),
        ]
    )


def limit_part(limit: Limit) -> str:
    """Distance to the limit."""
    work = limit.work
    counts = [
        (kind, f"{count:.4g}", str(WEIGHTS[kind]))
        for kind, count in sorted(work.operations.items(), key=lambda item: -item[1])
    ]
    shares = [
        (
            share.work,
            seconds(share.step),
            f"{share.flops / 1e9:.3g}",
            f"{100.0 * share.of_arithmetic:.3g} %",
            f"{100.0 * share.of_memory:.2g} %",
        )
        for share in limit.shares
    ]
    header = ("one core", "RK4 step", "Gflop/s", "of the arithmetic", "of the memory")
    return "\n\n".join(
        [
            "## Distance to the limit",
            "Operations of one RK4 step, counted by running the equations with numbers that count "
            "(`benchmarks/counting.py`), the mean over the run above. Sine, hyperbolic tangent "
            "and power are weighted with about the length of their polynomials.",
            table(("operation", "in one step", "counted as"), counts),
            f"That is {work.flops:.0f} flop, and {work.table_bytes:.0f} B of the muscle's table "
            "out of the nearest cache, by the plain equations: lanes have curves of the angle in "
            "the place of tendon and table, and do fewer; a run that keeps four states streams "
            f"{work.stream_bytes:.3g} B a step, one that is reduced none. A core does "
            f"{limit.peak_flops / 1e9:.3g} Gflop/s in a matrix product and moves "
            f"{limit.peak_bytes / 1e9:.3g} GB/s in a triad, both measured in this run. So "
            "arithmetic is the limit, not memory: its chain of dependent operations in one run, "
            "its throughput in a batch.",
            table(header, shares),
        ]
    )


def reference_part(text: str) -> str:
    """What is measured beside the plain reference of the tests."""
    if not text:
        return ""
    return (
        "## Beside the plain reference\n\n"
        "`python -m benchmarks.bench`: the package beside the SciPy reference of the tests, which "
        "is written for clarity.\n\n"
        f"```text\n{text.rstrip()}\n```"
    )
