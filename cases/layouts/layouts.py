"""``python cases/layouts/layouts.py OUT [NAME ...]``: five rigs as laboratories have them, logged.

For each layout a folder with ``rig.toml``, logs with noise and ``case.toml``: what a laboratory
would hand in; and ``README.md``, which a laboratory would not have: what comes out. One effect or
one wrong value is in the plant that made the logs and not in the rig file. ``pamrs diagnose
OUT/NAME`` is to find it. The logs are made from a seed; nothing of them is committed.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pamrs
from pamrs.rig import Rig, load_rig

Array = NDArray[np.float64]
HERE = Path(__file__).parent
UNITS = {
    "supply_command": ("bar", 1e5, 0.0),
    "valve_command": ("V", 1.0, 0.0),
    "supply_pressure": ("bar", 1e5, 0.004),
    "line_pressure": ("bar", 1e5, 0.004),
    "muscle_pressure": ("bar", 1e5, 0.004),
    "temperature": ("K", 1.0, 0.2),
    "length": ("mm", 1e-3, 0.03),
    "force": ("N", 1.0, 1.0),
}
"""Unit of each column, in SI, and its noise in that unit."""


ROLES = ("fit", "fit", "held_out")


@dataclass
class Run:
    """One log: its channels in SI, and what is its own."""

    channels: dict[str, Array]
    sample_time: float
    role: str
    own: str = ""
    holes: list[tuple[str, int, int]] = field(default_factory=list)


@dataclass(frozen=True)
class Layout:
    """A rig, the plant behind its logs, and the answer."""

    name: str
    conceals: str
    plant: Callable[[Rig], Rig]
    runs: Callable[[Rig], list[Run]]


def _of(run: pamrs.Simulation, *names: str) -> dict[str, Array]:
    return {name: run[name] for name in names}


def _steps(low: float, high: float, count: int, each: int, seed: int) -> Array:
    levels = np.random.default_rng(seed).uniform(low, high, count)
    levels[0] = low
    return np.repeat(levels, each)


def _regulator(rig: Rig) -> list[Run]:
    """Steps of the set pressure; one gauge, at the chamber."""
    found = []
    for seed, role in enumerate(ROLES):
        command = _steps(0.5e5, 6e5, 24, 100, seed)
        run = pamrs.simulate(rig, supply_command=command, sample_time=0.005)
        found.append(Run({"supply_command": command, **_of(run, "muscle_pressure")}, 0.005, role))
    return found


def _nozzles(rig: Rig) -> list[Run]:
    """The tank blown down through three nozzles, with its pressure and a thermometer in the gas."""
    found = []
    truth = rig.parameter("line.discharge_area").value / 1.0e-6
    for area, role in zip((1.0e-6, 0.6e-6, 1.8e-6), ROLES, strict=True):
        own = rig.with_parameters({"line.discharge_area": truth * area})
        run = pamrs.simulate(own, duration=30.0, sample_time=0.02)
        channels = _of(run, "muscle_pressure", "temperature")
        value = f'{{ value = {area * 1e6:g}, unit = "mm2", error = "proportional" }}'
        told = f'"line.discharge_area" = {value}'
        found.append(Run(channels, 0.02, role, own="" if area == 1.0e-6 else told))
    return found


def _tube(rig: Rig) -> list[Run]:
    """Eight metres of tube with a gauge at either end."""
    found = []
    for seed, role in enumerate(ROLES):
        command = 5.0 + _steps(-4.0, 4.0, 20, 150, 10 + seed)
        run = pamrs.simulate(rig, valve_command=command, sample_time=0.004)
        pressures = _of(run, "supply_pressure", "line_pressure", "muscle_pressure")
        found.append(Run({"valve_command": command, **pressures}, 0.004, role))
    return found


def _isometric(rig: Rig) -> list[Run]:
    """The length held at three places, the pressure up and down at three speeds."""
    found = []
    rest = rig.parameter("muscle.rest_length").value
    for k, role in enumerate(ROLES):
        time = np.arange(0.0, 30.0, 0.01)
        pressure = 2.2e5 - 2.15e5 * np.cos(2 * np.pi * (0.1 + 0.07 * k) * time)
        length = np.full(time.size, rest * (0.95 - 0.05 * k))
        run = pamrs.simulate(rig, length=length, pressure=pressure, sample_time=0.01)
        channels = {"length": length, "force": run["muscle_force"]}
        found.append(Run(_of(run, "muscle_pressure") | channels, 0.01, role))
    return found


def _hanging(rig: Rig) -> list[Run]:
    """A mass on a regulator; the length falls out now and then, to the end of its scale."""
    found = []
    for seed, role in enumerate(ROLES):
        time = np.arange(0.0, 30.0, 0.01)
        slow = np.sin(2 * np.pi * (0.1 + 0.04 * seed) * time)
        command = 3.6e5 + 0.8e5 * slow + 0.4e5 * np.sin(2 * np.pi * 0.43 * time)
        run = pamrs.simulate(rig, supply_command=command, sample_time=0.01)
        channels = {"supply_command": command, **_of(run, "muscle_pressure", "length")}
        starts = np.random.default_rng(20 + seed).integers(200, 2900, 6)
        holes = [("length", int(start), int(start) + 8) for start in starts]
        found.append(Run(channels, 0.01, role, holes=holes))
    return found


LAYOUTS = {
    layout.name: layout
    for layout in (
        Layout(
            "regulator_one_gauge",
            "supply.dead_time",
            lambda rig: rig.with_parameters({"supply.dead_time": 0.03}),
            _regulator,
        ),
        Layout(
            "tank_three_nozzles",
            "chamber.heat_transfer_coefficient",
            lambda rig: (
                rig.without_effect("thermometer_lag")
                .with_effect("thermometer_lag", {"time_constant": 0.4})
                .with_parameters({"chamber.heat_transfer_coefficient": 50.0})
            ),
            _nozzles,
        ),
        Layout(
            "eight_metres",
            "valve.vent_conductance",
            lambda rig: rig.with_parameters({"valve.vent_conductance": 3.9e-9}),
            _tube,
        ),
        Layout(
            "isometric_bench",
            "activation_pressure",
            lambda rig: rig.with_effect("activation_pressure", {"threshold": 2e4}),
            _isometric,
        ),
        Layout(
            "hanging_mass",
            "muscle_hysteresis",
            lambda rig: rig.with_effect(
                "muscle_hysteresis", {"friction_constant": 15.0, "friction_pressure": 6e-5}
            ),
            _hanging,
        ),
    )
}


def write(layout: Layout, folder: Path) -> Path:
    """Write rig, logs and case of a layout, and the page that says what it conceals.

    Parameters
    ----------
    layout : Layout
        The layout.
    folder : Path
        Gets a folder of its name.

    Returns
    -------
    Path
        The case.
    """
    home = folder / layout.name
    home.mkdir(parents=True, exist_ok=True)
    source = HERE / f"{layout.name}.toml"
    (home / "rig.toml").write_text(source.read_text(encoding="utf-8"), encoding="utf-8")
    page = source.with_suffix(".md").read_text(encoding="utf-8")
    (home / "README.md").write_text(page, encoding="utf-8")
    entries = ['schema = "pamrs.case/1"\nrig = "rig.toml"\n']
    for number, run in enumerate(layout.runs(layout.plant(load_rig(source))), 1):
        file = f"run_{number}.csv"
        (home / file).write_text(_csv(run, number), encoding="utf-8")
        own = f"parameters = {{ {run.own} }}\n" if run.own else ""
        entries.append(f'[[recording]]\nfile = "{file}"\nrole = "{run.role}"\n{own}')
    (home / "case.toml").write_text("\n".join(entries), encoding="utf-8")
    return home


def _csv(run: Run, seed: int) -> str:
    rng = np.random.default_rng([7, seed])
    size = next(iter(run.channels.values())).size
    columns: dict[str, Any] = {"time [s]": run.sample_time * np.arange(size)}
    for name, values in run.channels.items():
        unit, scale, noise = UNITS[name]
        shown = values / scale + noise * rng.normal(size=size)
        for channel, start, stop in run.holes:
            if channel == name:
                shown[start:stop] = 500.0  # the end of the sensor's scale
        columns[f"{name} [{unit}]"] = shown
    rows = np.column_stack(list(columns.values()))
    lines = [",".join(columns)] + [",".join(f"{value:.6g}" for value in row) for row in rows]
    return "\n".join(lines) + "\n"


def main(words: list[str]) -> int:
    """Write the layouts; 2 when a name is none."""
    names = words[1:] or list(LAYOUTS)
    strange = [name for name in names if name not in LAYOUTS]
    if not words or strange:
        print(f"usage: layouts.py OUT [{' | '.join(LAYOUTS)}]", file=sys.stderr)
        return 2
    for name in names:
        print(write(LAYOUTS[name], Path(words[0])))
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
