"""Made-up cases of the shoulder for the tests of models that hold effects already."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import pamrs
from pamrs.recordings import Recording
from tests.diagnosis.noisy import SHOULDER as NOISE
from tests.diagnosis.noisy import driven

UNITS = dict(zip(("valve_command", *NOISE), ("V", "Pa", "Pa", "rad"), strict=True))

ROLES = (("slow", "fit"), ("fast", "fit"), ("again", "held_out"))


def recorded(rig: pamrs.Rig, name: str, role: str, seed: int, n: int = 1200) -> Recording:
    """A shoulder moved by two sines of its valve, 6 s at 200 Hz, with the noise of transducers."""
    time, speed = 0.005 * np.arange(n), 1.0 + 0.4 * seed
    wave = 0.45 * np.sin(2.0 * np.pi * 0.2 * speed * time + seed)
    wave += 0.3 * np.sin(2.0 * np.pi * 0.53 * speed * time)
    one = driven(rig, name, role, 0.005, {"valve_command": 5.0 + wave}, NOISE, [31, seed])
    one.units.update(UNITS)
    return one


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
