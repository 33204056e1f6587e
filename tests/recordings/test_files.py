"""Files that are read: regular ones, with limits."""

from __future__ import annotations

import gzip
import os
import tomllib
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs import _files
from pamrs._files import parse_toml, read_file
from pamrs.errors import CaseError, RecordingError, RigError
from pamrs.recordings import load_case, load_recording, table
from pamrs.recordings.logs import read_log

HEADER = "time [s],force [N]\n"


def special(folder: Path, ending: str) -> tuple[Path, Path]:
    """A device and a pipe that have the names of recordings."""
    device, pipe = folder / f"zero{ending}", folder / f"pipe{ending}"
    device.symlink_to("/dev/zero")
    os.mkfifo(pipe)
    return device, pipe


@pytest.mark.parametrize("ending", [".csv", ".csv.gz", ".parquet"])
def test_devices_and_pipes_are_refused_at_once(tmp_path: Path, ending: str) -> None:
    for path in special(tmp_path, ending):
        with pytest.raises(RecordingError, match=rf"{path.name}: .* (regular file|pyarrow)"):
            load_recording(path)


@pytest.mark.parametrize("ending", [".csv", ".txt.gz", ".npz", ".mat", ".mf4"])
def test_logs_are_regular_files_too(tmp_path: Path, ending: str) -> None:
    for path in special(tmp_path, ending):
        with pytest.raises(RecordingError, match=rf"{path.name}: .* regular file"):
            read_log(path)


def test_logs_have_the_limits_of_tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "long.npz"
    np.savez(file, time=np.arange(300.0), force=np.zeros(300))
    assert len(read_log(file).series) == 2
    monkeypatch.setattr(table, "MOST_CELLS", 500)
    with pytest.raises(RecordingError, match=r"long.npz: about 600 cells; at most 500 are read"):
        read_log(file)


def test_rigs_and_cases_are_regular_files_too(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "case.toml")
    with pytest.raises(CaseError, match="it is a pipe; a regular file is needed"):
        load_case(tmp_path)
    with pytest.raises(RigError, match="it is a device"):
        pamrs.load_rig("/dev/zero")
    with pytest.raises(RecordingError, match="it is a device"):
        pamrs.fit.load_measured_muscle("/dev/zero")


def test_bytes_are_limited_packed_and_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bomb = tmp_path / "bomb.csv.gz"
    bomb.write_bytes(gzip.compress(bytes(100_000)))
    assert bomb.stat().st_size < 1000
    with pytest.raises(OSError, match="unpacks to more than 1000 bytes"):
        read_file(bomb, most=1000, packed=True)
    with pytest.raises(OSError, match="has more than 10 bytes"):
        read_file(bomb, most=10)
    assert len(read_file(bomb, most=100_000, packed=True)) == 100_000
    monkeypatch.setattr(_files, "MOST_TOML_BYTES", 10)
    (tmp_path / "rig.toml").write_text("# much too long a remark")
    with pytest.raises(RigError, match="more than 10 bytes, and at most that is read"):
        pamrs.load_rig(tmp_path / "rig.toml")


def test_rows_and_cells_are_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "long.csv"
    file.write_text(HEADER + "".join(f"{0.1 * k:.1f},{k % 7}\n" for k in range(100)))
    assert len(load_recording(file)) == 100
    monkeypatch.setattr(table, "MOST_ROWS", 50)
    with pytest.raises(RecordingError, match=r"long.csv: about 102 rows; at most 50 are read"):
        load_recording(file)
    monkeypatch.setattr(table, "MOST_ROWS", 500)
    monkeypatch.setattr(table, "MOST_CELLS", 150)
    with pytest.raises(RecordingError, match=r"about 203 cells; at most 150"):
        load_recording(file)


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * 5000 + "]" * 5000,
        ".".join("a" * 40) + " = 1",
        "a = " + "{a=" * 40 + "1" + "}" * 40,
    ],
)
def test_depth_is_limited(tmp_path: Path, text: str) -> None:
    with pytest.raises(tomllib.TOMLDecodeError, match="nested more than 32 deep"):
        parse_toml(text)
    (tmp_path / "rig.toml").write_text(text)
    with pytest.raises(RigError, match="nested more than 32 deep"):
        pamrs.load_rig(tmp_path)


def test_what_lies_outside_is_not_opened(tmp_path: Path) -> None:
    home = tmp_path / "stand"
    home.mkdir()
    pamrs.rigs.sealed_chamber().to_toml(tmp_path / "rig.toml")
    (home / "link.csv").symlink_to("/dev/zero")
    (home / "case.toml").write_text(
        'schema = "pamrs.case/1"\nrig = "../rig.toml"\n[[recording]]\nfile = "link.csv"\n'
    )
    with pytest.raises(CaseError) as caught:
        load_case(home)
    message = str(caught.value)
    assert "rig = '../rig.toml': lies outside the case folder" in message
    assert "recording[0].file = 'link.csv': lies outside the case folder" in message
    with pytest.raises(CaseError, match="it is a device"):
        load_case(home, allow_outside=True)
