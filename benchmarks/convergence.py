"""Order of the integrator, its error at the usual step, and how far it can be driven by stiff rigs.

``python -m benchmarks.convergence OUT`` writes ``convergence.md`` and ``convergence.png`` to a
folder (``make convergence``: to docs).

The order is that of a smooth run: in motion from the start, no joint that turns back, no flow that
becomes choked, no stop. The error at the usual step is that of a working run, which fills, vents,
turns back and chokes, against a step 64 times finer. Rigs with a small volume between valve and
muscle are compared with the independent reference, which integrates them implicitly and adaptively.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import pamrs
from benchmarks.pages import written
from pamrs.rig import parse_rig
from pamrs.simulation import core_rig
from tests.runs import FRICTIONLESS, RUNS, Run, misses

USUAL = 1e-3
HALVINGS = 6
#: Steps of the table of hard runs [ms].
_MS = ("1", "0.5", "0.25")
#: Fraction of a range below which an error is that of rounding, for channels whose magnitude is at
#: most so many ranges.
ROUNDING, RANGES = 1e-12, 50.0
DEGREE = math.pi / 180.0
GROUPS = {
    "pressures": ("muscle_pressure", "supply_pressure", "line_pressure", "segment_pressure"),
    "motion": ("joint_angle", "joint_rate", "length", "length_rate"),
    "masses, works": (
        "air_mass",
        "line_mass",
        "segment_mass",
        "segment_flow",
        "mass_supplied",
        "mass_vented",
        "energy_supplied",
        "muscle_work",
        "joint_work",
    ),
}


# ------------------------------------------------------------------ runs


def bench(rows: int) -> Run:
    """The air of the bench shut in, its length by a sine."""
    length = 0.25 + 0.015 * np.sin(0.2 * np.arange(rows))
    return Run("bench", 0.005, rows, {"muscle_pressure": 2e5}, {"length": length})


def steady(
    rig: str,
    rows: int,
    initial: dict[str, float],
    changes: dict[str, float] | None = None,
    **volts: float,
) -> Run:
    """A run under constant commands; `volts` by the names of the valves, ``valve`` for one without
    a name.
    """
    names = {
        name: "valve_command" if name == "valve" else f"valve_command.{name}" for name in volts
    }
    commands = {names[name]: np.full(rows, value) for name, value in volts.items()}
    return Run(rig, RUNS[rig].sample_time, rows, initial, commands, changes or {})


MOVING = {"joint_angle": 45.0 * DEGREE, "joint_rate": 0.5}
#: The gas of a long tube in motion, without a front.
FLOWING = {
    "muscle_pressure.left": 2e5,
    "muscle_pressure.right": 1e5,
    **{f"segment_pressure.{k}": 1.5e5 + 5e4 * math.cos(math.pi * k / 16) for k in range(1, 16)},
    **{f"segment_flow.{k}": 1.2e-3 for k in range(1, 17)},
}
BENT = {"joint_angle.elbow": 40.0 * DEGREE, "joint_rate.elbow": 0.5}

SMOOTH: dict[str, Run] = {
    "shoulder": steady("shoulder", 41, {**MOVING, "muscle_pressure": 2.6e5}, valve=6.0),
    "throttled_supply": steady(
        "throttled_supply",
        41,
        {**MOVING, "muscle_pressure.muscle": 2.6e5, "muscle_pressure.feed": 12e5},
        valve=6.0,
    ),
    "elbow": steady("elbow", 41, {**MOVING, "muscle_pressure": 5.5e5}, valve=6.0),
    "antagonistic_joint": steady("antagonistic_joint", 21, BENT, flexor=8.0, extensor=3.0),
    "antagonistic_joint without friction": steady(
        "antagonistic_joint", 21, BENT, FRICTIONLESS, flexor=8.0, extensor=3.0
    ),
    "recruitment": steady(
        "recruitment",
        41,
        {
            "joint_angle.shoulder": 45.0 * DEGREE,
            "joint_rate.shoulder": 0.5,
            **{f"muscle_pressure.pair_{k}": 2.6e5 for k in (1, 2, 3)},
        },
        pair_1=5.6,
        pair_2=5.8,
        pair_3=6.0,
    ),
    "two_joint_arm": steady(
        "two_joint_arm",
        11,
        {
            **BENT,
            "joint_angle.wrist": 40.0 * DEGREE,
            "joint_rate.wrist": 0.5,
            "muscle_pressure.elbow": 3.9e5,
            "muscle_pressure.wrist": 2e5,
        },
        elbow=6.0,
        wrist=5.1,
    ),
    "hanging_mass": steady(
        "hanging_mass",
        21,
        {"length": 0.25, "length_rate": -0.02, "muscle_pressure": 2.4e5},
        valve=6.0,
    ),
    "regulated_joint": Run(
        "regulated_joint",
        0.005,
        21,
        {**MOVING, "muscle_pressure": 2e5, "supply_pressure": 3e5},
        {"supply_command": np.full(21, 6e5)},
    ),
    "bench": bench(21),
    "tube": Run("tube", 0.005, 7, {"muscle_pressure.left": 5e5, "muscle_pressure.right": 3e5}),
    "long_tube": Run("long_tube", 0.002, 16, FLOWING),
    "blow_down_tank": Run("blow_down_tank", 0.2, 31, {"muscle_pressure": 8.5e4}),
}

WORKING: dict[str, Run] = {
    **RUNS,
    "antagonistic_joint": replace(RUNS["antagonistic_joint"], changes={}),
    "antagonistic_joint without friction": RUNS["antagonistic_joint"],
    "bench": bench(101),
    "regulated_joint, outlet from 0 bar": replace(
        RUNS["regulated_joint"],
        initial={"joint_angle": 45.0 * DEGREE, "muscle_pressure": 2e5, "supply_pressure": 0.0},
        commands={
            "supply_command": 3e5 + 5e4 * np.sin(0.05 * np.arange(RUNS["regulated_joint"].rows))
        },
    ),
}


def behind(line: str) -> Run:
    """The shoulder with a line between valve and chamber, filled and vented."""
    rig = parse_rig(f"{pamrs.rigs.shoulder().to_toml_text()}\n[line]\n{line}\n")
    command = 5.0 + 1.5 * np.sin(0.1 + 0.2 * np.arange(61))
    return Run(
        rig,
        0.005,
        61,
        {"joint_angle": 40.0 * DEGREE, "muscle_pressure": 2.6e5},
        {"valve_command": command},
    )


def stiff() -> dict[str, Run]:
    """The shoulder with ever smaller volumes behind its valve: half a tube and what is given, or
    what is given before an orifice.
    """
    found = {}
    for length in (2.0, 1.0, 0.3):
        tube = (
            f'length = {{ value = {length}, unit = "m" }}\n'
            'diameter = { value = 4.0, unit = "mm" }'
        )
        for volume in (10.0, 1.0, 0.1):
            found[f"{length:g} m of tube, {volume:g} cm3"] = behind(
                f'{tube}\ninlet_volume = {{ value = {volume}, unit = "cm3" }}'
            )
    for volume in (10.0, 1.0, 0.1):
        nozzle = 'kind = "orifice"\ndischarge_area = { value = 6.0, unit = "mm2" }'
        found[f"orifice of 6 mm2, {volume:g} cm3"] = behind(
            f'{nozzle}\ninlet_volume = {{ value = {volume}, unit = "cm3" }}'
        )
    return found


def hard() -> dict[str, list[Run]]:
    """Runs on which no step is at its best: muscles that pass their rest length, and the two-joint
    arm driven hard, 2 s of sines on both valves, thirty times.
    """
    length = pamrs.rigs.hanging_mass().parameter("muscle.rest_length").value
    through = {
        "hanging_mass, longer than at rest": (1.002, 0.02, 6e4),
        "hanging_mass, lengthens through its rest length": (0.998, 0.25, 6e4),
        "hanging_mass, shortens through its rest length": (1.006, -0.2, 2e5),
    }
    found = {}
    for name, (share, rate, pressure) in through.items():
        start = {"length": share * length, "length_rate": rate, "muscle_pressure": pressure}
        found[name] = [steady("hanging_mass", 21, start, valve=5.0)]
    rng = np.random.default_rng(1)
    return found | {"two_joint_arm, driven hard": [driven(rng) for _ in range(30)]}


def driven(rng: np.random.Generator) -> Run:
    """The two-joint arm from somewhere, with a sine at either valve."""
    time_ = 0.005 * np.arange(401)
    size, often, phase = (rng.uniform(*span, 2) for span in ((0.3, 3.0), (0.3, 3.0), (0.0, 6.28)))
    commands = {
        f"valve_command.{joint}": 5.0
        + size[k] * np.sin(2.0 * math.pi * often[k] * time_ + phase[k])
        for k, joint in enumerate(("elbow", "wrist"))
    }
    initial = {
        "joint_angle.elbow": rng.uniform(20.0, 80.0) * DEGREE,
        "joint_angle.wrist": rng.uniform(20.0, 80.0) * DEGREE,
        "muscle_pressure.elbow": rng.uniform(1e5, 5e5),
        "muscle_pressure.wrist": rng.uniform(5e4, 4e5),
    }
    return Run("two_joint_arm", 0.005, 401, initial, commands)


def rows_of_hard() -> list[list[str]]:
    """Errors of the hard runs at 1, 0.5 and 0.25 ms, median and largest, and the order."""
    rows = []
    for name, runs in hard().items():
        errors = []
        for run in runs:
            fine = run.core(usual(run) / 64.0)
            steps = [usual(run) / 2**k for k in range(3)]
            errors.append([max(errors_of(run.core(step), fine).values()) for step in steps])
        order = curve_of(runs[0]).order if len(runs) == 1 else math.nan
        rows.append(
            [
                name,
                "" if math.isnan(order) else f"{order:.2f}",
                *map(number, np.median(errors, axis=0)),
                *map(number, np.max(errors, axis=0)),
            ]
        )
    return rows


# ------------------------------------------------------------------ measuring


@dataclass(frozen=True)
class Curve:
    """Steps [s] that were really taken, and the largest error of any channel in fractions of its
    range at each.
    """

    steps: list[float]
    errors: list[float]

    @property
    def order(self) -> float:
        """Slope of the error above rounding; not a number where it is rounding at every step."""
        clear = [(h, e) for h, e in zip(self.steps, self.errors, strict=True) if e > ROUNDING]
        if len(clear) < 3:
            return math.nan
        h, e = np.log(np.array(clear)).T
        return float(np.polyfit(h, e, 1)[0])


def parts(run: Run, step: float) -> int:
    """Steps that the core really takes in one sample."""
    simulator = pamrs.Simulator(run.plant, sample_time=run.sample_time, step=step)
    return int(simulator._core.substeps)


def errors_of(got: pamrs.Simulation, fine: pamrs.Simulation) -> dict[str, float]:
    """Errors of all channels that are simulated."""
    return misses(got, {name: values for name, values in fine.items() if name != "time"})


def curve_of(run: Run) -> Curve:
    """Error over halved steps, from the longest stable one."""
    longest = run.sample_time / parts(run, run.sample_time)
    steps = [longest / 2**k for k in range(HALVINGS)]
    fine = run.core(steps[-1] / 8.0)
    kept = [
        name
        for name, v in fine.items()
        if name not in ("time", "joint_work") and np.abs(v).max() < RANGES * np.ptp(v)
    ]
    every = [errors_of(run.core(step), fine) for step in steps]
    return Curve(steps, [max(errors[name] for name in kept) for errors in every])


def grouped(errors: dict[str, float]) -> list[float]:
    """The largest error of each group of channels; not a number where the rig has none of a
    group.
    """
    of = [
        [miss for name, miss in errors.items() if name.partition(".")[0] in channels]
        for channels in GROUPS.values()
    ]
    return [max(members) if members else math.nan for members in of]


def cost(run: Run) -> float:
    """Wall-clock time per simulated time at the usual step [1], the best of five."""
    core_rig(run.plant)
    spent = []
    for _ in range(5):
        began = time.perf_counter()
        run.core(usual(run))
        spent.append(time.perf_counter() - began)
    return min(spent) / run.time[-1]


def usual(run: Run) -> float:
    """The usual step [s] of a run."""
    return run.sample_time / math.ceil(run.sample_time / USUAL - 1e-9)


# ------------------------------------------------------------------ words


def cells(run: Run) -> list[str]:
    """Stable step, parts of the usual one."""
    stable = core_rig(run.plant).stable_step
    return [
        "any" if math.isinf(stable) else f"{1e3 * stable:.3g}",
        f"{parts(run, usual(run)) * usual(run) / run.sample_time:.0f}",
    ]


def number(error: float) -> str:
    """An error as it stands in the table."""
    return "" if math.isnan(error) else "0" if error == 0.0 else f"{error:.1e}"


def table(head: list[str], rows: list[list[str]]) -> list[str]:
    """A table of Markdown, its first column to the left."""
    lines = [head, ["---", *["--:"] * (len(head) - 1)], *rows]
    return [f"| {' | '.join(line)} |" for line in lines]


# ------------------------------------------------------------------ picture


def draw(smooth: dict[str, Curve], small: dict[str, Curve], path: Path) -> None:
    """Error against step, both logarithmic: the smooth runs, and the small volumes."""
    figure = Figure(figsize=(11.0, 6.4), dpi=110, layout="constrained")
    left, right = figure.subplots(1, 2)
    lines(left, smooth, guide=(1e-6, 1.0, (0.06, 20.0)))
    left.set(
        title="smooth runs of the packaged rigs",
        ylabel="error against a far finer step, fraction of a range",
        ylim=(1e-14, 1e-3),
    )
    lines(right, small, guide=(1e-5, 0.1, (0.012, 0.2)))
    right.axhspan(0.0, 1e-9, color="0.93", zorder=0, label="what the reference leaves open")
    right.set(
        title="shoulder behind a small volume",
        ylabel="error against the reference, fraction of a range",
        ylim=(1e-11, 1e-4),
    )
    for axes in (left, right):
        axes.grid(which="major", color="0.88", lw=0.6)
        axes.set_xlabel("step [ms]")
        axes.legend(fontsize="x-small", loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3)
    figure.savefig(path)


def lines(
    axes: Axes, curves: dict[str, Curve], guide: tuple[float, float, tuple[float, float]]
) -> None:
    """One line for each curve, and a slope of four through an error at a step [ms], from one step
    to another.
    """
    marks = "osD^v<>Ph*pX"
    for k, (name, curve) in enumerate(curves.items()):
        style = {
            "marker": marks[k % len(marks)],
            "ms": 4.5,
            "lw": 1.2,
            "ls": "-" if k < 10 else "--",
            "label": name,
        }
        color = mpl.colormaps["tab10"](k % 10)
        axes.loglog(
            1e3 * np.array(curve.steps), np.maximum(curve.errors, 1e-16), color=color, **style
        )
    error, step, ends = guide
    axes.loglog(
        ends,
        error * (np.array(ends) / step) ** 4,
        color="0.75",
        lw=6.0,
        zorder=0,
        label="slope of 4",
    )


# ------------------------------------------------------------------ everything


def main() -> None:
    parser = argparse.ArgumentParser(
        description=(
            "Order, error and cost of the integrator on every packaged rig and on stiff ones."
        )
    )
    parser.add_argument("out", type=Path, help="folder for convergence.md and convergence.png")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    smooth, rows = {}, []
    for name, run in sorted(WORKING.items()):
        errors = grouped(errors_of(run.core(usual(run)), run.core(usual(run) / 64.0)))
        order = ""
        if name in SMOOTH:
            smooth[name] = curve_of(SMOOTH[name])
            order = f"{smooth[name].order:.2f}"
        rows.append([name, *cells(run), order, *map(number, errors), f"{1e3 * cost(run):.2g}"])
    packaged = table(
        ["rig", "stable step [ms]", "parts of 1 ms", "order", *GROUPS, "ms per simulated s"], rows
    )
    small, rows = {}, []
    for name, run in stiff().items():
        want = run.reference(1e-10, "Radau")
        longest = run.sample_time / parts(run, usual(run))
        steps = [longest / 2**k for k in range(4)]
        errors = [misses(run.core(step), want) for step in steps]
        rows.append([name, *cells(run), *map(number, grouped(errors[0])), f"{1e3 * cost(run):.2g}"])
        small[name] = Curve(steps, [max(each.values()) for each in errors])
    volumes = table(
        [
            "between valve and chamber",
            "stable step [ms]",
            "parts of 1 ms",
            *GROUPS,
            "ms per simulated s",
        ],
        rows,
    )
    worst = table(
        ["run", "order", *(f"{kind}, {step} ms" for kind in ("median", "largest") for step in _MS)],
        rows_of_hard(),
    )
    text = written(
        "convergence",
        packaged="\n".join(packaged),
        hard="\n".join(worst),
        stiff="\n".join(volumes),
    )
    (out / "convergence.md").write_text(text, encoding="utf-8")
    draw(
        smooth,
        {name: curve for k, (name, curve) in enumerate(small.items()) if k % 3 != 1},
        out / "convergence.png",
    )
    print(text)


if __name__ == "__main__":
    main()
