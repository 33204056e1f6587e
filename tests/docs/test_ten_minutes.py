"""The page "from your log to a diagnosis in ten minutes" runs as it stands."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs import cli

PAGE = Path(__file__).parents[2] / "docs" / "ten_minutes.md"
FRICTION = {"friction_constant": 9.0, "friction_pressure": 1e-5, "presliding": 1e-3}
NOISE = 1.0


def stand() -> pamrs.Rig:
    """The bench that is behind the logs: a muscle with a threshold, which pulls
    wherever the logs are, and friction of its braid."""
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


def blocks() -> list[tuple[str, str]]:
    """Language and text of every block of the page, in its order."""
    return re.findall(r"^```(\w+)\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.M | re.S)


def test_every_block_runs_in_its_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    rig, rng = stand(), np.random.default_rng(11)
    write_map(tmp_path / "map.csv", rig, rng)
    write_log(tmp_path / "bench.csv", rig, rng)
    monkeypatch.chdir(tmp_path)
    ran: list[str] = []
    for language, text in blocks():
        ran.append(language)
        if language == "toml":
            name = re.match(r"# (\S+)\n", text)
            assert name is not None
            Path(name[1]).write_text(text, encoding="utf-8")
        elif language == "sh":
            for line in text.strip().splitlines():
                words = shlex.split(line)
                assert words[0] == "pamrs"
                assert cli.main(words[1:]) == 0, capsys.readouterr().err
        else:
            assert language == "python"
            exec(compile(text, "ten_minutes.md", "exec"), {})
    assert set(ran) == {"toml", "sh", "python"}
    said = capsys.readouterr().out
    for line in re.findall(r"^    (\S.*)$", PAGE.read_text(encoding="utf-8"), re.M):
        if "[N]" not in line and "held-out" not in line:  # numbers, below
            assert re.sub(r"[\d.]+", "#", line) in re.sub(r"[\d.]+", "#", said), line
    assert "by tape measure" in Path("model.toml").read_text(encoding="utf-8")
    result = json.loads(Path("result.json").read_text(encoding="utf-8"))
    (effect,) = result["effects"]
    assert effect["id"] == "muscle_hysteresis"
    for name, true in FRICTION.items():
        entry = effect["parameters"][name]
        assert abs(entry["value"] - true) < 4.0 * entry["std"] + 0.03 * true
    error = result["fit"]["held_out"]["force"]
    assert error["before"] > 10.0 * NOISE
    assert error["after"] < 2.0 * NOISE
    assert {"report.html", "replay.png", "model.toml", "case.toml"} <= {
        path.name for path in tmp_path.iterdir()
    }
