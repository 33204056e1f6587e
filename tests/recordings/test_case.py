"""Cases: folders with a rig and recordings."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.errors import CaseError
from pamrs.recordings import load_case
from tests.tables import rows_of

ROOT = Path(__file__).parents[2]
SHARED = ROOT / ".." / "shared"
CONCEALED = SHARED / "concealed"
CHAMBERS = ROOT / "cases" / "zillen_chambers"
ULTIMAKERS = [f"Ultimaker_{number}" for number in ("006", "010", "015", "020")]
TOML = (
    'schema = "pamrs.case/1"\nrig = "rig.toml"\n\n[[recording]]\nfile = "run.csv"\nrole = "fit"\n'
)


def folder(path: Path, toml: str = TOML) -> Path:
    home = path / "stand"
    home.mkdir(exist_ok=True)
    pamrs.rigs.sealed_chamber().to_toml(home / "rig.toml")
    rows = "".join(f"{0.1 * i:.1f},{7 + 0.01 * ((i * 5) % 7):.2f}\n" for i in range(60))
    for name in ("run.csv", "proof.csv"):
        (home / name).write_text("time [s],muscle_pressure [bar]\n" + rows)
    (home / "case.toml").write_text(toml)
    return home


def test_every_file_of_a_case_has_its_digest(tmp_path: Path) -> None:
    case = load_case(folder(tmp_path))
    assert case.inputs == {
        name: hashlib.sha256((case.path / name).read_bytes()).hexdigest()
        for name in ("case.toml", "rig.toml", "run.csv")
    }
    other = tmp_path / "other.toml"
    pamrs.rigs.sealed_chamber().to_toml(other)
    changed = case.with_rig(pamrs.load_rig(other), other).inputs
    assert list(changed) == ["case.toml", "run.csv", str(other)]
    assert list(case.with_rig(case.rig).inputs) == ["case.toml", "run.csv"]


def refused(home: Path) -> str:
    with pytest.raises(CaseError) as caught:
        load_case(home)
    return str(caught.value)


def test_case_with_defaults(tmp_path: Path) -> None:
    case = load_case(folder(tmp_path))
    assert (case.name, case.path, case.rig.name) == ("stand", tmp_path / "stand", "sealed_chamber")
    assert [recording.name for recording in case.fit] == ["run"]
    assert case.held_out == []
    assert case.channels == ("muscle_pressure",)
    assert load_case(case.path / "case.toml").name == "stand"
    other = case.with_rig(case.rig.with_parameters({"chamber.dead_volume": 2e-4}))
    assert other.recordings is case.recordings
    assert case.rig.parameters["chamber.dead_volume"].value == 1e-4


def test_roles_names_and_files_outside(tmp_path: Path) -> None:
    extra = (
        '[[recording]]\nfile = "../elsewhere.csv"\nname = "proof"\nrole = "held_out"\n'
        "sample_time = 0.2\n"
    )
    home = folder(tmp_path, TOML + extra)
    (tmp_path / "elsewhere.csv").write_bytes((home / "run.csv").read_bytes())
    message = refused(home)
    assert "'../elsewhere.csv': lies outside the case folder" in message
    assert "--allow-outside" in message
    case = load_case(home, allow_outside=True)
    assert [recording.name for recording in case.held_out] == ["proof"]
    assert case.held_out[0].sample_time == 0.2


@pytest.mark.parametrize(("old", "new", "wanted"), rows_of(__file__, "bad"))
def test_mistakes_are_named(tmp_path: Path, old: str, new: str, wanted: list[str]) -> None:
    assert old in TOML
    message = refused(folder(tmp_path, TOML.replace(old, new)))
    assert all(words in message for words in ("case.toml", *wanted)), message


def test_all_problems_at_once(tmp_path: Path) -> None:
    extra = '[[recording]]\nfile = "absent.csv"\n'
    home = folder(tmp_path, TOML + extra)
    (home / "rig.toml").write_text('schema = "pamrs.rig/1"\n')
    (home / "run.csv").write_text("time [s],pressure [bar]\n0,1\n1,2\n")
    message, wanted = refused(home), ("absent.csv", "[chamber] is missing", "'pressure [bar]'")
    assert all(words in message for words in wanted)


def test_missing_file_tells_where_to_get_it(tmp_path: Path) -> None:
    toml = 'source = "ask the archive of the test stand"\n' + TOML.replace("run.csv", "gone.csv")
    message = refused(folder(tmp_path, toml))
    assert "gone.csv" in message
    assert "ask the archive" in message


def test_the_same_name_twice(tmp_path: Path) -> None:
    assert "'run'" in refused(folder(tmp_path, TOML + TOML[TOML.index("[[") :]))


def test_no_case_at_all(tmp_path: Path) -> None:
    assert "no such" in refused(tmp_path / "nowhere")
    assert "no case.toml" in refused(tmp_path)
    (tmp_path / "case.toml").write_bytes(b"\xff\xfe")
    assert "UTF-8" in refused(tmp_path)
    (tmp_path / "case.toml").write_text("")
    assert "[[recording]]" in refused(tmp_path)


@pytest.mark.parametrize("path", sorted(CONCEALED.glob("case_*")), ids=lambda path: path.name)
def test_sealed_cases_load(path: Path) -> None:
    case = load_case(path)
    assert (len(case.fit), len(case.held_out)) == (3, 2)
    assert case.channels == ("valve_command", "supply_pressure", "muscle_pressure", "joint_angle")
    for recording in case.recordings:
        assert recording.issues == []
        assert (len(recording), recording.sample_time) == (8000, 0.005)
        assert recording.valid().all()


@pytest.mark.skipif(not SHARED.is_dir(), reason="the recordings are not beside the project")
@pytest.mark.parametrize("name", ["Aluminium", "Formlabs", "Prusa", *ULTIMAKERS])
def test_chambers_load(name: str) -> None:
    case = load_case(CHAMBERS / name, allow_outside=True)
    (recording,) = case.recordings
    assert not case.rig.parameters["chamber.dead_volume"].known
    assert {issue.kind for issue in recording.issues} <= {"gap"}
    assert recording.sample_time == pytest.approx(0.1, rel=5e-3)
    assert 130.0 < recording.duration < 152.0
    pressure = recording.channels["muscle_pressure"]
    assert 5.0e5 < pressure[0] < 7.9e5
    assert recording.valid().mean() > 0.98
    leaks = name in ("Ultimaker_015", "Ultimaker_020")
    assert (np.nanmin(pressure) < 1e4) == leaks


def test_the_folder_above_a_case_says_where_the_case_is(tmp_path):
    (tmp_path / "cases" / "one").mkdir(parents=True)
    (tmp_path / "cases" / "one" / "case.toml").write_text("", encoding="utf-8")
    with pytest.raises(pamrs.CaseError, match=r"no case.toml; did you mean '.*one'\?"):
        pamrs.load_case(tmp_path)
