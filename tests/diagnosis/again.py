"""Made-up cases of the shoulder for the tests of models that hold effects already."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import pamrs
from pamrs.recordings import Recording

NOISE = {"supply_pressure": 400.0, "muscle_pressure": 400.0, "joint_angle": 3e-4}
ROLES = (("slow", "fit"), ("fast", "fit"), ("again", "held_out"))


def recorded(rig: pamrs.Rig, name: str, role: str, seed: int, n: int = 1200) -> Recording:
    """A shoulder moved by two sines of its valve, 6 s at 200 Hz, with the noise of transducers."""
    rng = np.random.default_rng([31, seed])
    time, speed = 0.005 * np.arange(n), 1.0 + 0.4 * seed
    command = (
        5.0
        + 0.45 * np.sin(2.0 * np.pi * 0.2 * speed * time + seed)
        + 0.3 * np.sin(2.0 * np.pi * 0.53 * speed * time)
    )
    run = pamrs.simulate(rig, valve_command=command, sample_time=0.005)
    channels = {key: run[key] + rng.normal(0.0, level, n) for key, level in NOISE.items()}
    channels["valve_command"] = command
    mask = {key: np.ones(n, dtype=bool) for key in channels}
    units = {"supply_pressure": "Pa", "muscle_pressure": "Pa", "joint_angle": "rad"}
    units["valve_command"] = "V"
    return Recording(name, role, run.time, 0.005, channels, mask, [], units)


def case(truth: pamrs.Rig, nominal: pamrs.Rig, n: int = 1200) -> pamrs.Case:
    """Two recordings of a plant to fit and one held out, with a nominal model."""
    found = [recorded(truth, name, role, seed, n) for seed, (name, role) in enumerate(ROLES)]
    return pamrs.Case("shoulder", nominal, found, Path())


def written(given: pamrs.Case, home: Path) -> Path:
    """A case as a folder."""
    home.mkdir(parents=True)
    given.rig.to_toml(home / "rig.toml")
    lines = ['schema = "pamrs.case/1"', f'name = "{given.name}"']
    for recording in given.recordings:
        names = list(recording.channels)
        header = ["time [s]", *(f"{name} [{recording.units[name]}]" for name in names)]
        columns = np.column_stack([recording.time, *(recording.channels[n] for n in names)])
        file = home / f"{recording.name}.csv"
        np.savetxt(file, columns, "%.9g", ",", header=",".join(header), comments="")
        lines += ["", "[[recording]]", f'file = "{file.name}"', f'role = "{recording.role}"']
    (home / "case.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return home
