"""The command that looks at logs and proposes a case."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.recordings import load_case
from pamrs.recordings import logs as logs_package
from tests.recordings.written import written
from tests.scripts import command


@pytest.fixture
def run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., tuple[int, str, str]]:
    """The command, in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    return partial(command, capsys, "import")


def test_a_log_becomes_a_case(tmp_path: Path, run: Any) -> None:
    file, _, _ = written(tmp_path, "mf4")
    before = file.read_bytes()
    code, out, err = run(file, "--rig", "shoulder", "--out", tmp_path / "case")
    assert code == 0
    assert "400      100 Hz  bar" in out
    assert "not found in this log: supply_pressure" in out
    assert "case.toml" in err
    assert f"pamrs diagnose {tmp_path / 'case'} --allow-outside" in out + err
    found = load_case(tmp_path / "case", allow_outside=True)
    assert found.channels == ("valve_command", "muscle_pressure", "joint_angle")
    assert (found.rig.name, file.read_bytes()) == ("shoulder", before)
    code, _, err = run(file, "--out", tmp_path / "case")
    assert (code, "not overwritten" in err) == (2, True)


def test_a_rig_file_is_pointed_at(tmp_path: Path, run: Any) -> None:
    file, _, _ = written(tmp_path, "bag")
    pamrs.rigs.shoulder().to_toml(tmp_path / "mine.toml")
    code, _, _ = run(file, "--rig", tmp_path / "mine.toml", "--out", tmp_path / "a" / "b")
    assert code == 0
    text = (tmp_path / "a" / "b" / "case.toml").read_text(encoding="utf-8")
    assert 'rig = "../../mine.toml"' in text
    found = load_case(tmp_path / "a" / "b", allow_outside=True)
    assert found.recordings[0].name == "run_bag"


@pytest.mark.parametrize("kind", ["mf4", "bag"])
def test_copies_make_the_case_complete(kind: str, tmp_path: Path, run: Any) -> None:
    file, _, _ = written(tmp_path, kind)
    pamrs.rigs.shoulder().to_toml(tmp_path / "mine.toml")
    words = [file, "--rig", tmp_path / "mine.toml", "--out", tmp_path / "case", "--copy"]
    code, out, err = run(*words)
    assert code == 0, err
    assert "--allow-outside" not in out + err
    assert file.exists()
    moved = tmp_path / "elsewhere"
    (tmp_path / "case").rename(moved)
    names = {path.name for path in moved.iterdir()}
    assert names == {"case.toml", "rig.toml", file.name}
    found = load_case(moved)
    assert found.rig.name == "shoulder"
    assert "muscle_pressure" in found.channels


def test_a_case_that_is_printed_minds_no_rig_file_here(tmp_path: Path, run: Any) -> None:
    file, _, _ = written(tmp_path, "mf4")
    (tmp_path / "rig.toml").write_text("mine")
    code, out, err = run(file, "--rig", "shoulder")
    assert code == 0, err
    assert 'rig = "rig.toml"' in out


def test_a_copy_overwrites_nothing(tmp_path: Path, run: Any) -> None:
    file, _, _ = written(tmp_path, "mf4")
    (tmp_path / "case").mkdir()
    (tmp_path / "case" / file.name).write_text("mine")
    code, _, err = run(file, "--rig", "shoulder", "--out", tmp_path / "case", "--copy")
    assert (code, "not overwritten" in err) == (2, True)
    assert (tmp_path / "case" / file.name).read_text() == "mine"
    assert not (tmp_path / "case" / "case.toml").exists()
    code, _, err = run(file, "--rig", "shoulder", "--copy")
    assert (code, "--out" in err) == (2, True)


def test_a_copy_follows_no_link_and_leaves_nothing_half_done(tmp_path: Path, run: Any) -> None:
    file, _, _ = written(tmp_path, "mf4")
    case, precious = tmp_path / "case", tmp_path / "precious"
    case.mkdir()
    precious.write_text("mine")
    (case / f"{file.name}.part").symlink_to(precious)
    (tmp_path / "b").mkdir()
    other = tmp_path / "b" / file.name.upper()
    other.write_bytes(file.read_bytes())
    words = ["--rig", "shoulder", "--out", case, "--copy"]
    code, _, err = run(file, other, *words)
    assert (code, "rename one" in err) == (2, True)
    code, _, err = run(file, tmp_path / "b" / ".." / file.name, *words)
    assert (code, "the same log twice" in err) == (2, True)
    assert {path.name for path in case.iterdir()} == {f"{file.name}.part"}
    assert run(file, *words)[0] == 0
    assert precious.read_text() == "mine"
    assert not (case / file.name).is_symlink()
    bag, _, _ = written(tmp_path, "bag")
    code, _, err = run(bag, "--rig", "shoulder", "--out", bag / "case", "--copy")
    assert (code, "which is to be copied there" in err) == (2, True)
    assert not (bag / "case").exists()


LAYOUTS = [
    ("my logs/run 1.csv", "my rig.toml", "new case"),
    ("my logs/run 1.csv", "shoulder", "."),
    ("my logs/run 1.csv", "my rig.toml", "./my logs/../c1/"),
    ("my logs/../my logs/run 1.csv", "./my rig.toml", "my logs"),
    ("link.csv", "my rig.toml", "c2"),
    ("my logs/run 1.csv", "shoulder", "alias/deep"),
]


@pytest.mark.parametrize(("log", "rig", "out"), LAYOUTS)
def test_what_it_tells_to_run_next_takes_the_case(run: Any, log: str, rig: str, out: str) -> None:
    Path("my logs").mkdir()
    rows = "".join(f"{0.01 * i:.2f};{i % 9 / 8:.3f};{20 + i}\n" for i in range(60))
    Path("my logs/run 1.csv").write_text(f"t [s];p_muscle [bar];angle [deg]\n{rows}")
    Path("link.csv").symlink_to("my logs/run 1.csv")
    Path("alias").symlink_to("my logs")
    pamrs.rigs.shoulder().to_toml("my rig.toml")
    code, said, _ = run(log, "--rig", rig, "--out", out)
    assert code == 0
    command = said.rpartition("then: ")[2].strip()
    _, _, folder, *options = shlex.split(command)
    found = load_case(folder, allow_outside="--allow-outside" in options)
    assert len(found.recordings[0]) == 60


def test_no_rig_and_another_rig_are_told(tmp_path: Path, run: Any) -> None:
    np.savez("run.npz", **{"p1 [bar]": np.linspace(0.0, 4.0, 100), "t [s]": np.arange(100) * 0.01})
    code, out, _ = run("run.npz", "--out", "case")
    assert (code, "put the rig file there as case/rig.toml, then: pamrs" in out) == (0, True)
    pamrs.rigs.bench().to_toml("rig.toml")
    before = Path("rig.toml").read_bytes()
    code, _, err = run("run.npz", "--rig", "shoulder", "--out", ".")
    assert (code, "is there already, and is not shoulder" in err) == (2, True)
    assert (Path("rig.toml").read_bytes(), Path("case.toml").exists()) == (before, False)


def test_without_a_folder_it_is_printed(tmp_path: Path, run: Any) -> None:
    np.savez("run.npz", p1_bar=np.linspace(0.0, 4.0, 100))
    code, out, _ = run("run.npz", "--sample-time", "5 ms")
    assert code == 0
    assert 'schema = "pamrs.case/1"' in out
    assert "sample_time = 0.005" in out
    assert list(tmp_path.iterdir()) == [tmp_path / "run.npz"]


def test_columns_without_headings(tmp_path: Path, run: Any) -> None:
    rows = "".join(f"{10 * i};{i % 9 / 8:.3f};{i}\n" for i in range(60))
    (tmp_path / "run.csv").write_text(rows, encoding="utf-8")
    names = "time [ms], muscle_pressure [bar], n"
    words = ["--columns", names, "--rig", "sealed_chamber", "--out", tmp_path]
    code, out, _ = run(tmp_path / "run.csv", *words)
    assert (code, "100 Hz" in out) == (0, True)
    (only,) = load_case(tmp_path).recordings
    assert (len(only), only.sample_time) == (60, 0.01)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["absent.csv"], "no such file"),
        (["run.npz", "--sample-time", "0 s"], "--sample-time = '0 s' is not allowed"),
        (["run.npz", "--sample-time", "5 bar"], "--sample-time = '5 bar'"),
        (["run.npz", "--rig", "absent.toml"], "absent.toml"),
        (["nothing.npz"], "no channel was recognised"),
    ],
)
def test_wrong_input(run: Any, arguments: list[str], words: str) -> None:
    np.savez("run.npz", p1=np.linspace(0.0, 4.0, 100))
    np.savez("nothing.npz", zzz=np.linspace(0.0, 4.0, 100))
    code, _, err = run(*arguments)
    assert code == 2
    assert words in err


def test_the_extra_is_named_before_anything_is_read(
    tmp_path: Path, run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, _, _ = written(tmp_path, "hdf5")
    monkeypatch.setattr(logs_package, "find_spec", lambda name: None)
    code, out, err = run(file)
    assert (code, out) == (2, "")
    assert "pip install 'pamrs[logs]'" in err
