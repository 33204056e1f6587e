"""``pamrs replay``: recordings of a case beside the whole rig."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pamrs

DT = 0.01


@pytest.fixture
def case(tmp_path: Path) -> Path:
    """A case of a shoulder whose muscles lose air, and beside it the model with the leak."""
    rig = pamrs.rigs.shoulder()
    true = rig.with_effect("leak_muscle", {"conductance": 2e-9})
    folder = tmp_path / "case"
    folder.mkdir()
    rig.to_toml(folder / "rig.toml")
    entries = ""
    for k, (name, role) in enumerate((("waves", "fit"), ("steps", "held_out"))):
        time = np.arange(0.0, 4.0, DT)
        command = 5.0 + 0.5 * np.sin((2.0 + k) * time)
        made = pamrs.simulate(true, command, sample_time=DT)
        columns = ("supply_pressure", "muscle_pressure", "joint_angle")
        table = np.column_stack([time, command, *(made[c] for c in columns)])
        units = ("time [s]", "valve_command [V]", "supply_pressure [Pa]", "muscle_pressure [Pa]")
        header = ",".join([*units, "joint_angle [rad]"])
        np.savetxt(folder / f"{name}.csv", table, delimiter=",", header=header, comments="")
        entries += f'[[recording]]\nfile = "{name}.csv"\nrole = "{role}"\n'
    (folder / "case.toml").write_text(f'schema = "pamrs.case/1"\n{entries}')
    true.with_case("case").to_toml(tmp_path / "model.toml")
    return folder


def test_errors_of_the_nominal_rig_stand_beside_those_of_the_model(run: Any, case: Path) -> None:
    plot = case.parent / "out.png"
    code, out, _ = run("replay", case.parent / "model.toml", "--plot", plot)
    assert code == 0
    assert re.findall(r"^(\w+) \(", out, re.MULTILINE) == ["waves", "steps"]
    errors = re.findall(r"muscle_pressure: rms difference (\S+) -> (\S+) bar", out)
    assert len(errors) == 2
    for before, after in errors:
        assert float(before) > 0.01
        assert float(after) < 1e-5
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert re.search(r"joint_angle: rms difference \S+ -> \S+ deg$", out, re.MULTILINE)


def test_the_picture_has_recorded_rig_file_and_model_in_units_of_the_laboratory(
    run: Any, case: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    figure = pytest.importorskip("matplotlib.figure").Figure
    drawn = []
    save = figure.savefig
    monkeypatch.setattr(
        figure, "savefig", lambda self, *a, **k: (drawn.append(self), save(self, *a, **k))
    )
    assert run("replay", case.parent / "model.toml", "--plot", tmp_path / "a.png")[0] == 0
    panels = {axes.get_title("left"): axes for axes in drawn[0].axes}
    assert [axes.get_ylabel() for axes in panels.values()] == ["V", "bar", "deg", "N m", "N"]
    labels = [line.get_label() for line in panels["joint angle"].lines]
    assert labels == ["recorded", "rig file", "model"]
    pressures = [text.get_text() for text in panels["pressure, gauge"].get_legend().get_texts()]
    assert pressures == ["recorded", "rig file", "supply model", "muscle model"]


def test_one_recording_with_the_rig_of_the_case(run: Any, case: Path) -> None:
    code, out, _ = run("replay", case, "--recording", "steps")
    assert code == 0
    assert out.startswith("steps (held out")
    assert "waves" not in out
    assert "->" not in out

    code, _, err = run("replay", case, "--recording", "ramps")
    assert code == 2
    assert "--recording = 'ramps' is not allowed: one of 'waves', 'steps' is needed" in err


def test_a_model_away_from_its_case_says_where_that_was_looked_for(
    run: Any, case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, moved = tmp_path / "model.toml", tmp_path / "elsewhere" / "model.toml"
    moved.parent.mkdir()
    moved.write_bytes(model.read_bytes())
    code, _, err = run("replay", moved)
    assert code == 2
    assert f"case = 'case': there is no folder {moved.parent / 'case'}; give the folder" in err
    assert "CASE --rig FILE" in err
    monkeypatch.chdir(moved.parent)  # as that line says, from anywhere
    code, out, _ = run("replay", case, "--rig", "model.toml")
    assert code == 0
    assert out == run("replay", model)[1]


@pytest.mark.parametrize("name", pamrs.rigs.names())
def test_a_rig_of_the_package_is_no_case(run: Any, case: Path, tmp_path: Path, name: str) -> None:
    code, _, err = run("replay", name)
    assert code == 2
    assert f"{name} is a rig of the package, not a case; give the folder of a case" in err
    pamrs.rigs.named(name).to_toml(tmp_path / "alone.toml")
    code, _, err = run("replay", tmp_path / "alone.toml")
    assert code == 2
    assert "does not say from which case it is; give the folder of the case" in err
    pamrs.rigs.named(name).with_case(str(case)).to_toml(tmp_path / "alone.toml")
    code, out, err = run("replay", tmp_path / "alone.toml")
    assert code == 0  # one that takes other inputs says so
    assert out.count("rms difference") >= 2
    said = f"{name} cannot be run:" in err or f"{name} has none of the channels" in err
    assert ("->" in out) != said
