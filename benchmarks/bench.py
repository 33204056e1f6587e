"""Side-by-side times: the package and the plain SciPy reference do the same work, one after the
other.

The reference is written for clarity, point by point in Python; it is a yardstick, not a rival.
Ratios carry from machine to machine, seconds do not. Every line also says how far the two results
are apart, since a fast wrong answer is worth nothing. Rivals are in ``benchmarks.peers``; ``make
bench`` runs both. Names as arguments choose some of the lines.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

import pamrs
from pamrs.control import PID, ClosedLoop, Value
from pamrs.control import closed_loop as run_closed_loop
from pamrs.control.trajectories import step
from pamrs.control.tuning import gain_map
from pamrs.rig.muscle_models import GEOMETRIES, MODELS
from tests.reference import GeometryReference, MuscleReference
from tests.reference import plant as reference

ROOT = Path(__file__).parents[1]
AMBIENT = 101325.0
#: Elastic parameters of the models that have others than the shoulder's moduli [Pa].
ELASTIC: dict[str, dict[str, float]] = {
    "mooney_rivlin": {"c10": 2e5, "c01": 5e4},
    "elbow_linear": {"bladder_modulus": 1e6},
}


def best_of(work: Callable[[], object], seconds: float = 1.0, most: int = 50) -> float:
    """Shortest time of one call [s], from as many calls as fit into some seconds."""
    times: list[float] = []
    stop = time.perf_counter() + seconds
    while len(times) < 1 or (time.perf_counter() < stop and len(times) < most):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def show(name: str, ours: float, theirs: float, apart: str) -> None:
    """One line of the table."""
    print(
        f"{name:<34} {ours * 1e3:>11.4g} ms {theirs * 1e3:>11.4g} ms {theirs / ours:>9.3g} x   "
        f"{apart}"
    )


def simulation() -> None:
    """Two seconds of the shoulder: fixed-step core against adaptive eighth-order SciPy."""
    rig, peer = pamrs.rigs.shoulder(), reference.shoulder()
    command = 5.0 + 1.5 * np.sin(2.0 * np.pi * 0.8 * 0.005 * np.arange(401))
    supply = rig.model["supply"]["initial_pressure"] + AMBIENT
    angle = rig.model["joint"]["rest_angle"]
    start = {
        "muscle_pressure": AMBIENT,
        "supply_pressure": supply,
        "joint_angle": angle,
        "joint_rate": 0.0,
    }

    ours = pamrs.simulate(rig, command, sample_time=0.005)
    for rtol in (1e-6, 1e-10):
        peer.simulate(
            command[:2], 0.005, start, rtol=rtol
        )  # builds the reference's table outside the clock
        theirs = peer.simulate(command, 0.005, start, rtol=rtol)
        pressure = np.abs(ours["muscle_pressure"] + AMBIENT - theirs.muscle_pressure).max()
        turned = np.degrees(np.abs(ours["joint_angle"] - theirs.joint_angle).max())
        show(
            f"simulate 2 s, solve_ivp rtol {rtol:g}",
            best_of(lambda: pamrs.simulate(rig, command, sample_time=0.005)),
            best_of(lambda rtol=rtol: peer.simulate(command, 0.005, start, rtol=rtol), 0.0),
            f"max {pressure:.2g} Pa, {turned:.2g} deg apart",
        )


class Loop:
    """A PID controller as a user writes it in ten lines: beside ``PID``, it shows what the
    controller's own parts cost.
    """

    def __init__(self, gain: float, rate: float) -> None:
        self.gain, self.rate = gain, rate
        self.sum, self.last = 0.0, 0.0

    def __call__(self, sample: Mapping[str, float]) -> float:
        """The valve command [V] for a sample."""
        error = 0.8 - sample["joint_angle"]
        self.sum += error * 1e-3
        slope, self.last = (error - self.last) * 1e3, error
        return min(max(5.0 + self.gain * error + self.rate * self.sum + 0.2 * slope, 0.0), 10.0)


def closed_loop() -> None:
    """25 s at 1 kHz under ``PID``: one ``closed_loop``, and ``gain_map`` over 40 x 40 gains; a loop
    of ten lines beside the first.
    """
    rig, duration, period = pamrs.rigs.shoulder(), 25.0, 1e-3
    angle = rig.model["joint"]["rest_angle"]
    wanted = step(angle, 0.8, duration=duration)

    def made(kp: Value, ki: Value) -> PID:
        return PID(kp, ki, 0.2, period=period)

    def one(kp: float, ki: float, seconds: float = duration) -> ClosedLoop:
        return run_closed_loop(rig, made(kp, ki), wanted, seconds)

    peer, few = reference.shoulder(), 200  # samples that the reference is given the time for
    supply = rig.model["supply"]["initial_pressure"] + AMBIENT
    start = {
        "muscle_pressure": AMBIENT,
        "supply_pressure": supply,
        "joint_angle": angle,
        "joint_rate": 0.0,
    }
    peer.simulate(np.full(2, 5.0), period, start)  # builds the reference's table outside the clock

    def by_reference() -> float:
        state, controller = dict(start), made(4.0, 1.0)
        for k in range(few):
            now = k * period
            run = peer.simulate(
                np.full(2, controller.update(now, state, wanted(now))), period, state
            )
            state = {name: float(getattr(run, name)[-1]) for name in start}
        return state["joint_angle"]

    apart = np.degrees(abs(one(4.0, 1.0, few * period).angle[-1] - by_reference()))
    theirs = best_of(by_reference, 0.0) * round(duration / period) / few
    used, calls = time.process_time(), 3
    for _ in range(calls):
        one(4.0, 1.0)
    used = (time.process_time() - used) / calls
    show(
        "closed_loop 25 s, 1 kHz, PID",
        best_of(lambda: one(4.0, 1.0)),
        theirs,
        (
            f"{apart:.2g} deg apart; {used:.3g} s of processor; reference from {few} of "
            f"{round(duration / period)}"
        ),
    )
    lean = best_of(
        lambda: pamrs.Simulator(rig, sample_time=period).control(Loop(4.0, 1.0), duration)
    )
    print(f"{'  beside it a loop of ten lines':<34} {lean * 1e3:>11.4g} ms")

    axes = {"kp": np.linspace(0.5, 20.0, 40), "ki": np.linspace(0.0, 20.0, 40)}
    used, began = time.process_time(), time.perf_counter()
    found = gain_map(rig, made, axes, wanted)
    wall, used = time.perf_counter() - began, time.process_time() - used
    chosen = ((0, 0), (20, 17), (39, 39))
    gains = [(float(axes["kp"][i]), float(axes["ki"][j])) for i, j in chosen]
    off = max(
        abs(found.squared_error[(0, *index)] / one(*pair).metrics().squared_error - 1.0)
        for index, pair in zip(chosen, gains, strict=True)
    )
    each = min(best_of(lambda pair=pair: one(*pair), 0.0) for pair in gains)
    said = (
        f"nu {off:.2g} apart; {used:.3g} s of processors; peer: closed_loop, {len(chosen)} of "
        f"{found.squared_error.size}"
    )
    show("gain_map 40 x 40, 25 s, 1 kHz, PID", wall, each * found.squared_error.size, said)


def per_point(name: str, ours: float, theirs: float, points: int, apart: float) -> None:
    """One line of the table of throughput: times of one point, and how far the results are
    apart.
    """
    print(
        f"{name:<34} {ours / points * 1e9:>11.4g} ns {theirs / points * 1e9:>11.4g} ns "
        f"{theirs / ours:>9.3g} x   max {apart:.2g} of full scale apart"
    )


def force() -> None:
    """Braid solve and force of one muscle at many lengths and pressures, every model, beside the
    reference.
    """
    base = pamrs.rigs.shoulder().muscle
    if base is None:
        raise SystemExit("the shoulder has no muscle")
    generator = np.random.default_rng(1)
    points = 2000
    few = slice(0, 100)  # as many as the reference can do in the time
    high = 0.9 * base.contraction_limits[1]
    contraction = generator.uniform(0.02 * high, high, points)
    pressure = generator.uniform(1e5, 6e5, points)

    def line(
        name: str, ours: Callable[[], np.ndarray], theirs: Callable[[], np.ndarray], of: slice = few
    ) -> None:
        found, expected = ours()[of], theirs()
        apart = float(np.abs(found - expected).max() / np.abs(expected).max())
        per_point(
            name, best_of(ours, most=2000), best_of(theirs) * points / len(expected), points, apart
        )

    for geometry in GEOMETRIES:
        muscle = base.replace(geometry=geometry)
        peer = reference_muscle(muscle)
        line(
            f"braid solve, {geometry}",
            lambda m=muscle: m.radius(contraction),
            lambda r=peer: np.array(
                [r.geometry.solve_radius(float(e))[0] for e in contraction[few]]
            ),
        )
    for model in MODELS:
        muscle = base.replace(model=model, **ELASTIC.get(model, {}))
        peer = reference_muscle(muscle)
        line(
            f"force exact, {model}",
            lambda m=muscle: m.force(pressure, contraction),
            lambda r=peer: np.array(
                [
                    float(r.force(p, float(e)))
                    for p, e in zip(pressure[few], contraction[few], strict=True)
                ]
            ),
        )
    peer = reference_muscle(base)
    line(
        "force table, robinson",
        lambda: base.force_table(pressure, contraction),
        lambda: np.array(
            [
                float(peer.force(p, float(e)))
                for p, e in zip(pressure[few], contraction[few], strict=True)
            ]
        ),
    )
    bare = base.replace(model="kothera")
    line(
        "force exact, kothera, vector NumPy",
        lambda: bare.force(pressure, contraction),
        lambda: cylinder_force(bare, pressure, contraction),
        slice(None),
    )


def reference_muscle(muscle: pamrs.Muscle) -> MuscleReference:
    """The same muscle in the reference."""
    p = muscle.parameters
    shape = GeometryReference(
        p["rest_length"], p["rest_diameter"], p["braid_angle"], p["wall_thickness"], muscle.geometry
    )
    elastic = {name: p[name] for name in ("c10", "c01", "bladder_modulus")}
    return MuscleReference(
        shape,
        p["modulus_slope"],
        p["modulus_offset"],
        p["modulus_scale"],
        model=muscle.model,
        **elastic,
    )


def cylinder_force(
    muscle: pamrs.Muscle, pressure: np.ndarray, contraction: np.ndarray
) -> np.ndarray:
    """Force (2.16) of a cylinder as a NumPy user would write it: whole arrays, no loop."""
    p = muscle.parameters
    fibre, turns, rubber = muscle.fibre_length, muscle.turns, muscle.bladder_volume
    length = p["rest_length"] * (1.0 - contraction)
    radius = np.sqrt(fibre**2 - length**2) / (2.0 * np.pi * turns)
    wall = radius - np.sqrt(radius**2 - rubber / (np.pi * length))
    axial, hoop = rubber / length, wall * length**2 / (2.0 * np.pi * radius * turns**2)
    middle = 0.5 * (p["rest_diameter"] - p["wall_thickness"])
    strains = length / p["rest_length"] - 1.0, (radius - 0.5 * wall) / middle - 1.0
    force = pressure * ((3.0 * length**2 - fibre**2) / (4.0 * np.pi * turns**2) + axial - hoop)
    for k, (slope, offset) in enumerate(
        zip(p["modulus_slope"], p["modulus_offset"], strict=True), start=1
    ):
        force += (slope * pressure + offset) * (strains[0] ** k * axial - strains[1] ** k * hoop)
    return force


def diagnosis() -> None:
    """A diagnosis of a shoulder, five recordings of 40 s at 200 Hz: one effect concealed, two, one
    of no catalogue; peak memory too.
    """
    code = (
        "import json, resource, sys, time, pamrs; case = pamrs.load_case(sys.argv[1]); start = "
        "time.perf_counter(); found = pamrs.diagnose(case); seconds = time.perf_counter() - start; "
        "names = [e['id'] for e in found.effects]; print(json.dumps([seconds, "
        "resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, found.verdict, names]))"
    )
    for number, kind in enumerate(
        ("leak_muscle", "leak_muscle+muscle_hysteresis", "hose_torque"), 1
    ):
        with tempfile.TemporaryDirectory() as folder:
            made = [
                "--out",
                f"{folder}/cases",
                "--keys-dir",
                f"{folder}/keys",
                "--kind",
                kind,
                "--seed",
                str(6 + number),
            ]
            subprocess.run(
                [sys.executable, "-m", "trial", "make", *made],
                cwd=ROOT,
                check=True,
                capture_output=True,
            )
            run = subprocess.run(
                [sys.executable, "-c", code, f"{folder}/cases/case_001"],
                check=True,
                capture_output=True,
                text=True,
            )
        seconds, memory, verdict, names = json.loads(run.stdout)
        said = f"verdict: {verdict} {' + '.join(names)}".rstrip()
        print(f"{'diagnose ' + kind:<40} {seconds:>9.3g} s {memory:>9.4g} MiB    {said}")


def start_up() -> None:
    """Time that importing the package and then the command line takes, in a fresh interpreter."""
    code = "import time; s = time.perf_counter(); import {}; print(time.perf_counter() - s)"
    for module in ("pamrs", "pamrs.cli"):
        words = [sys.executable, "-c", code.format(module)]
        runs = [subprocess.run(words, check=True, capture_output=True, text=True) for _ in range(5)]
        print(f"{'import ' + module:<34} {min(float(run.stdout) for run in runs) * 1e3:>11.3g} ms")


BENCHMARKS = {
    "import": start_up,
    "force": force,
    "simulate": simulation,
    "loop": closed_loop,
    "diagnose": diagnosis,
}


def main() -> None:
    parser = argparse.ArgumentParser(description="Times of pamrs beside its SciPy reference.")
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"all, or some of {list(BENCHMARKS)}"
    )
    names = parser.parse_args().names or list(BENCHMARKS)
    unknown = [name for name in names if name not in BENCHMARKS]
    if unknown:
        parser.error(f"unknown benchmark {unknown[0]!r}; there are {', '.join(BENCHMARKS)}")
    print(f"{'':<34} {'pamrs':>14} {'reference':>14} {'ratio':>11}")
    for name in names:
        BENCHMARKS[name]()


if __name__ == "__main__":
    main()
