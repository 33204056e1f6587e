"""The goals, each measured beside its peer."""

from __future__ import annotations

import timeit
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

import pamrs

from . import peers
from .race import Ratio, Times, race, ratio
from .workload import BATCH, SAMPLES, Batches, Shoulder, apart

#: How far a peer's last angle may be from ours [deg]: farther, and its time says nothing.
ALLOWED = 1e-3
RUN = f"{(SAMPLES - 1) * peers.SAMPLE_TIME:g} s"
WHOLE = f"{BATCH} payloads, {RUN}"


@dataclass(frozen=True)
class Goal:
    """One line: times of one call [s], their ratio, and how far the last angles are apart."""

    work: str
    peer: str
    ours: float | None
    theirs: float | None
    ratio: Ratio | None
    #: Largest difference of the last angles [deg].
    apart: float | None
    #: Least ratio; none where the line is not a goal by itself.
    least: float | None
    note: str = ""

    @property
    def verdict(self) -> str:
        """Whether it is reached."""
        if self.ratio is None or self.apart is None:
            return self.note
        if self.apart > ALLOWED:
            return "not the same result"
        if self.least is None:
            return ""
        return "met" if self.ratio.middle >= self.least else "not met"


@dataclass(frozen=True)
class Step:
    """Time of ``Simulator.step``, of an empty call, and of the same step inside a run [s]."""

    step: float
    empty: float
    inside: float
    most: float = 1e-6

    @property
    def verdict(self) -> str:
        """Whether it is reached."""
        return "met" if self.step - self.empty < self.most else "not met"


def line(
    work: str, peer: str, times: Times, names: tuple[str, str], off: float, least: float | None
) -> Goal:
    """A line from what was measured."""
    ours, theirs = names
    own, other = float(np.median(times[ours])), float(np.median(times[theirs]))
    return Goal(work, peer, own, other, ratio(times, theirs, ours), off, least)


def missing(work: str, peer: str, module: str, least: float | None) -> Goal:
    """A line of a peer that is not there."""
    why = peers.installed(module)
    return Goal(
        work, peer, None, None, None, None, least, why if isinstance(why, str) else "not installed"
    )


def single(repeats: int) -> list[Goal]:
    """One run beside Numba's, and beside SciPy's, which chooses its own steps: with the steps of
    the other peers, and with the longest that give the same angle.
    """
    shoulder = Shoulder()
    own = {"ours": shoulder.ours, "long": shoulder.in_long_steps}
    works: dict[str, Callable[[], object]] = {**own}
    runs = {"ours": f"one run, {RUN}", "long": f"one run, {RUN}, in the longest stable steps"}
    scipy = "SciPy solve_ivp, RK45, rtol 1e-6"
    shown: list[tuple[str, str, str, dict[str, float], float | None]] = [
        ("ours", "shoulder_numba", "Numba scalar, fastmath", {}, 1.0),
        ("ours", "shoulder_scipy", scipy, {"rtol": 1e-6}, None),
        ("long", "shoulder_scipy", scipy, {"rtol": 1e-6}, 300.0),
        ("ours", "shoulder_scipy", "SciPy solve_ivp, RK45, rtol 1e-8", {"rtol": 1e-8}, None),
    ]
    ends = {}
    for _, name, title, settings, _ in shown:
        module = peers.installed(name)
        if not isinstance(module, str):
            ends[title] = shoulder.peer(module, **settings)[-1:]
            works[title] = partial(shoulder.peer, module, **settings)
    angles = {key: run()[-1:] for key, run in own.items()}
    times = race(works, repeats)
    return [
        line(runs[key], title, times, (key, title), apart(ends[title], angles[key]), least)
        if title in times
        else missing(runs[key], title, name, least)
        for key, name, title, _, least in shown
    ]


def batch(repeats: int) -> list[Goal]:
    """Many payloads: on all processors beside ``prange``, on one beside JAX and diffrax; one plant
    of them beside ``solve_ivp``, which has no batches.
    """
    all_of, alone = Batches.of(BATCH), Shoulder()
    own = {"all": all_of.ours(), "one": all_of.ours(1)}
    shown = [
        ("all", "Numba prange, fastmath, all cores", all_of.numba(), "shoulder_numba", 4.0),
        ("one", "Numba prange, fastmath, one core", all_of.numba(1), "shoulder_numba", None),
        ("one", "JAX vmap and scan, one core", all_of.jax(), "shoulder_jax", 10.0),
        ("one", "diffrax vmap, one core", all_of.diffrax(), "shoulder_jax", 10.0),
        ("plant", "SciPy solve_ivp, RK45, rtol 1e-6", alone.by_scipy(), "shoulder_scipy", None),
    ]
    nominal = np.array([alone.payload])
    ends = {"all": own["all"](), "one": own["one"](), "plant": alone.our_batch(nominal)}
    works = {title: (ours, work) for ours, title, work, _, _ in shown if work}
    off = {
        title: apart(work()[-ends[ours].size :], ends[ours])
        for title, (ours, work) in works.items()
    }
    times = race({**own, **{title: work for title, (_, work) in works.items()}}, repeats)
    times["plant"] = times["one"] / BATCH
    names = {
        "all": f"{WHOLE}, all cores",
        "one": f"{WHOLE}, one core",
        "plant": f"one plant of {WHOLE}, one core",
    }
    return [
        line(names[ours], title, times, (ours, title), off[title], least)
        if title in times
        else missing(names[ours], title, module, least)
        for ours, title, _, module, least in shown
    ]


def goals(repeats: int) -> list[Goal]:
    """Every goal that has a peer.

    Parameters
    ----------
    repeats : int
        Repetitions of each.

    Returns
    -------
    list of Goal
    """
    return [*single(repeats), *batch(repeats)]


def one_step(repeats: int) -> Step:
    """``Simulator.step`` of one RK4 step beside the emptiest call into the core: a number that is
    read from the same object. Shortest of some repetitions.
    """
    simulator = pamrs.Simulator(pamrs.rigs.shoulder(), sample_time=1e-3, step=1e-3)
    core = simulator._core
    shoulder, calls = Shoulder(), 20_000
    found = {
        "step": timeit.repeat(lambda: simulator.step(5.5), number=calls, repeat=repeats),
        "bare": timeit.repeat(lambda: None, number=calls, repeat=repeats),
        "empty": timeit.repeat(lambda: core.samples, number=calls, repeat=repeats),
    }
    least = {name: min(times) / calls for name, times in found.items()}
    inside = float(race({"run": shoulder.ours}, repeats)["run"].min()) / shoulder.steps
    return Step(
        step=least["step"] - least["bare"], empty=least["empty"] - least["bare"], inside=inside
    )


@dataclass(frozen=True)
class Look:
    """Time of one point by table and by the direct solve [s], and their relative difference."""

    table: float
    solve: float
    ratio: Ratio
    apart: float


def table_and_solve(repeats: int, points: int = 2000) -> Look:
    """The force of the shoulder's muscle from the compiled table and from the braid's equations."""
    muscle = pamrs.rigs.shoulder().muscle
    if muscle is None:
        raise ValueError("the rig has no muscle")
    generator = np.random.default_rng(1)
    contraction = generator.uniform(0.005, 0.9 * muscle.contraction_limits[1], points)
    pressure = generator.uniform(1e5, 6e5, points)
    times = race(
        {
            "table": lambda: muscle.force_table(pressure, contraction),
            "solve": lambda: muscle.force(pressure, contraction),
        },
        repeats,
    )
    exact = muscle.force(pressure, contraction)
    off = np.abs(muscle.force_table(pressure, contraction) - exact).max() / np.abs(exact).max()
    table, solve = (float(np.median(times[name])) / points for name in ("table", "solve"))
    return Look(table, solve, ratio(times, "solve", "table"), float(off))
