"""Order of convergence, stability and error of every packaged rig, and of rigs that small volumes make stiff.

``python -m benchmarks.convergence OUT`` writes ``convergence.md`` and ``convergence.png`` to a folder. Each rig is driven smoothly away
from its stops; the error of a step is the largest difference of any channel, in fractions of the channel's range, from a run at a
step 8 times shorter than the shortest shown.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.figure
import numpy as np

import pamrs
from pamrs.rig import Rig, parse_rig
from pamrs.simulation import core_rig

SAMPLE_TIME = 0.01
DURATION = 0.4
HALVINGS = 5
COMMAND = "python -m benchmarks.convergence docs"


def plain(rig: Rig) -> Rig:
    """The rig without the Coulomb friction, whose steep middle hides the order."""
    names = [name for name in rig.parameters if name.endswith(".coulomb")]
    return rig.with_parameters(dict.fromkeys(names, 0.0))


def through_tube(length: float, volume: float = 0.0) -> Rig:
    """The shoulder, its valve behind a 4 mm tube [m] with a volume at the inlet [m3]."""
    text = pamrs.rigs.shoulder().to_toml_text()
    line = (
        f'\n[line]\nlength = {{ value = {length!r}, unit = "m" }}\ndiameter = {{ value = 4.0, unit = "mm" }}\n'
        f'inlet_volume = {{ value = {volume!r}, unit = "m3" }}\n'
    )
    return parse_rig(text.replace("[chamber]", line.lstrip() + "\n[chamber]", 1))


def drive(rig: Rig) -> dict[str, Any]:
    """Smooth signals that move a rig, away from its stops."""
    rows = round(DURATION / SAMPLE_TIME) + 1
    wave = 0.3 * np.sin(np.arange(rows) * 0.1)
    signals: dict[str, Any] = {}
    valves = list(rig.tables("valve"))
    if valves:
        signals["valve_command"] = {name: 5.6 + (wave if k % 2 == 0 else -wave) for k, name in enumerate(valves)}
    for name, load in rig.tables("load").items():
        if load["kind"] == "frame":
            rest = rig.muscle_of().parameters["rest_length"]
            signals["length"] = rest * (0.95 + 0.02 * np.sin(np.arange(rows) * 0.1))
        del name
    regulators = [name for name, supply in rig.tables("supply").items() if supply["kind"] == "regulator"]
    if regulators:
        signals["supply_command"] = {name: 3e5 + 5e4 * np.sin(np.arange(rows) * 0.1) for name in regulators}
    if not signals:
        signals["duration"] = DURATION
    start = {f"muscle_pressure.{n}" if n else "muscle_pressure": 2e5 for n in rig.tables("chamber") if rig.tables("muscle")}
    for name, joint in rig.tables("joint").items():
        middle = 0.6 * joint["min_angle"] + 0.4 * joint["max_angle"]
        start[f"joint_angle.{name}" if name else "joint_angle"] = middle
    if any(load["kind"] == "mass" for load in rig.tables("load").values()):
        start["length"] = 0.92 * rig.muscle_of().parameters["rest_length"]
    signals["initial"] = start
    return signals


def run(rig: Rig, step: float) -> pamrs.Simulation:
    """A run at a step [s]."""
    return pamrs.simulate(rig, sample_time=SAMPLE_TIME, step=step, **drive(rig))


def apart(one: pamrs.Simulation, other: pamrs.Simulation) -> float:
    """Largest difference of any channel in fractions of its range."""
    worst = 0.0
    for name in other:
        span = float(np.ptp(other[name]))
        if name.partition(".")[0] in ("joint_work", "temperature") or span <= 1e-4 * max(1e-12, float(np.abs(other[name]).max())):
            continue  # work has kinks where motion turns; temperature stands still
        worst = max(worst, float(np.abs(one[name] - other[name]).max()) / span)
    return worst


def measure(rig: Rig) -> dict[str, Any]:
    """Steps, errors, order, and what a millisecond costs."""
    stable = core_rig(rig).stable_step
    longest = min(SAMPLE_TIME / 2, stable)
    parts = int(np.ceil(SAMPLE_TIME / longest - 1e-9))
    steps = [SAMPLE_TIME / (parts * 2**k) for k in range(HALVINGS)]
    fine = run(rig, steps[-1] / 8)
    errors = [apart(run(rig, step), fine) for step in steps]
    clear = [(h, e) for h, e in zip(steps, errors, strict=True) if e > 1e-11]
    order = float(np.polyfit(np.log([h for h, _ in clear]), np.log([e for _, e in clear]), 1)[0]) if len(clear) > 2 else float("nan")
    began = time.perf_counter()
    usual = run(rig, 1e-3)
    spent = time.perf_counter() - began
    return {
        "stable": stable,
        "parts": max(1, int(np.ceil(1e-3 / stable - 1e-9))),
        "steps": steps,
        "errors": errors,
        "order": order,
        "usual": apart(usual, fine),
        "cost": spent / DURATION,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path, help="folder for convergence.md and convergence.png")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    rigs = {name: plain(pamrs.rigs.named(name)) for name in pamrs.rigs.names() if name != "sealed_chamber"}
    stiff = {f"shoulder, {length:g} m of 4 mm tube": plain(through_tube(length)) for length in (0.3, 1.0, 2.0)}
    stiff |= {f"shoulder, 1 m of tube, {v:g} cm3 more": plain(through_tube(1.0, v * 1e-6)) for v in (10.0, 1.0)}
    stiff["shoulder, 0.1 m of 4 mm tube"] = plain(through_tube(0.1))
    found = {name: measure(rig) for name, rig in (rigs | stiff).items()}
    rows = [
        "# Convergence",
        "",
        f"Made by `{COMMAND}`. Fixed-step RK4; errors are the largest difference of any channel in fractions of its range over",
        f"{DURATION:g} s of smooth motion away from the stops, without Coulomb friction, against a step 8 times shorter than the",
        "shortest shown.",
        "",
        "A flow that becomes choked, or comes within a thousandth of equal pressures, passes a kink of its law: there the order falls.",
        "",
        "| rig | stable step [ms] | parts of 1 ms | order | error at 1 ms | time per simulated second [ms] |",
        "|---|--:|--:|--:|--:|--:|",
    ]
    for name, m in found.items():
        stable = "any" if not np.isfinite(m["stable"]) else f"{1e3 * m['stable']:.3g}"
        order = "exact" if np.isnan(m["order"]) else f"{m['order']:.2f}"
        rows.append(f"| {name} | {stable} | {m['parts']} | {order} | {m['usual']:.1e} | {1e3 * m['cost']:.2g} |")
    rows += ["", "![Error against step](convergence.png)", ""]
    (out / "convergence.md").write_text("\n".join(rows), encoding="utf-8")
    figure = mpl.figure.Figure(figsize=(8.0, 5.5), dpi=110, layout="constrained")
    axes = figure.subplots()
    for k, (name, m) in enumerate(found.items()):
        shown = [max(e, 1e-15) for e in m["errors"]]
        style = {"ms": 3.5, "lw": 1.0, "color": mpl.colormaps["tab20"](k % 20), "label": name}
        axes.loglog(1e3 * np.array(m["steps"]), shown, "o-" if name in rigs else "s--", **style)
    guide = np.array([0.02, 4.0])
    axes.loglog(guide, 1e-9 * guide**4, color="0.6", lw=4.0, alpha=0.5, zorder=0, label="fourth order")
    axes.set_xlabel("step [ms]")
    axes.set_ylabel("error, fraction of a channel's range")
    axes.legend(fontsize="x-small", loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(out / "convergence.png")
    print("\n".join(rows))


if __name__ == "__main__":
    main()
