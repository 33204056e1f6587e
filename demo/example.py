"""Write the files that ``pamrs example`` copies: ``python -m demo.example FOLDER``.

``shoulder`` is a case with a leak concealed by the plant of ``make demo``, its key beside it;
``bench`` is what docs/tutorials/log_to_diagnosis.md begins with, a force map and a log with
friction of the braid.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

import pamrs

ROOT = Path(__file__).parents[1]
FRICTION = {"friction_constant": 9.0, "friction_pressure": 1e-5, "presliding": 1e-3}
NOISE = 1.0  # of the load cell, N


def write_shoulder(folder: Path) -> None:
    """A case of three short recordings, and what was concealed in them."""
    made = folder / "made"
    case = ["--kind", "leak_muscle", "--seed", "7", "--recordings", "3", "--duration", "15"]
    where = ["--out", str(made), "--keys-dir", str(made / "keys")]
    command = [sys.executable, "-m", "trial", "make", *case, *where]
    subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL, check=True)
    (made / "case_001").rename(folder / "shoulder")
    (made / "keys" / "case_001.json").rename(folder / "shoulder_key.json")
    shutil.rmtree(made)


def stand() -> pamrs.Rig:
    """The bench that is behind the logs: a muscle with a threshold, which pulls
    wherever the logs are, and friction of its braid.
    """
    muscle = pamrs.Muscle.from_law(
        lambda p, e: 14.0 * np.logaddexp(0.0, (p - 5e4) / 2e4) * (1 - 2.6 * e) ** 2 - 100 * e,
        max_pressure=7e5,
        contraction=(-0.02, 0.27),
        rest_length=0.3,
        rest_diameter=0.023,
        braid_angle=np.radians(65.0),
        wall_thickness=0.0015,
    )
    return pamrs.rigs.bench(muscle).with_effect("muscle_hysteresis", FRICTION)


def write_map(path: Path, rig: pamrs.Rig, rng: np.random.Generator) -> None:
    """Slow cycles of the length at held pressures, twenty samples of which the last is read."""
    e = np.concatenate([np.linspace(0, 0.24, 25), np.linspace(0.24, 0, 25)[1:]])
    lines = ["length [mm],pressure [bar],force [N]"]
    for bar in range(7):
        run = pamrs.simulate(
            rig,
            length=0.3 * (1.0 - np.repeat(e, 20)),
            pressure=np.full(20 * len(e), bar * 1e5),
            sample_time=0.05,
        )
        force = run["muscle_force"][19::20] + NOISE * rng.normal(size=len(e))
        lines += [f"{300 * (1 - x):.3f},{bar},{f:.3f}" for x, f in zip(e, force, strict=True)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_log(path: Path, rig: pamrs.Rig, rng: np.random.Generator) -> None:
    """Three trials in one file, as a German program writes it."""
    lines = ["time [s];trial;p_muscle [bar];load_cell [N];position [mm]"]
    t = np.arange(0.0, 20.0, 0.01)
    for k in range(3):
        slow, quick = 2 * np.pi * (0.11 + 0.05 * k) * t, 2 * np.pi * 0.37 * t + k
        length = 0.3 * (0.9 - 0.06 * np.sin(slow) - 0.02 * np.sin(quick))
        pressure = 3e5 + 1.6e5 * np.sin(2 * np.pi * (0.07 + 0.03 * k) * t + 0.5 * k)
        run = pamrs.simulate(rig, length=length, pressure=pressure, sample_time=0.01)
        gas = run["muscle_pressure"] + 300.0 * rng.normal(size=len(t))
        force = run["muscle_force"] + NOISE * rng.normal(size=len(t))
        length = length + 2e-5 * rng.normal(size=len(t))
        for row in zip(25.0 * k + t, gas / 1e5, force, 1e3 * length, strict=True):
            text = f"{row[0]:.2f};{k + 1};{row[1]:.4f};{row[2]:.2f};{row[3]:.3f}"
            lines.append(text.replace(".", ","))
    path.write_text("\n".join(lines) + "\n", encoding="latin-1")


def write_bench(folder: Path) -> None:
    """The rig file of the page, a force map and a log."""
    folder.mkdir()
    page = (ROOT / "docs/tutorials/log_to_diagnosis.md").read_text(encoding="utf-8")
    rig_file = re.search(r"^%%writefile rig\.toml\n(# rig\.toml\n.*?)^```$", page, re.M | re.S)
    assert rig_file is not None
    (folder / "rig.toml").write_text(rig_file[1], encoding="utf-8")
    rig, rng = stand(), np.random.default_rng(11)
    write_map(folder / "map.csv", rig, rng)
    write_log(folder / "bench.csv", rig, rng)


def write(folder: Path) -> None:
    """Both parts, in the place of those that are there."""
    for old in ("shoulder", "bench"):
        shutil.rmtree(folder / old, ignore_errors=True)
    folder.mkdir(parents=True, exist_ok=True)
    write_shoulder(folder)
    write_bench(folder / "bench")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
