"""Files that are read: regular ones, with limits."""

from __future__ import annotations

import gzip
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs import _files
from pamrs._files import read_file
from pamrs.errors import CaseError, RecordingError, RigError
from pamrs.recordings import _gate, load_case, load_recording
from pamrs.recordings.logs import read_log
from tests.recordings.written import SHOULDER, N, mapping, written

HEADER = "time [s],force [N]\n"
SEALED = pamrs.rigs.sealed_chamber()


@pytest.fixture
def stand(tmp_path: Path) -> Path:
    """An empty folder of a case."""
    (tmp_path / "stand").mkdir()
    return tmp_path / "stand"


def special(folder: Path, ending: str) -> tuple[Path, Path]:
    """A device and a pipe that have the names of recordings."""
    device, pipe = folder / f"zero{ending}", folder / f"pipe{ending}"
    device.symlink_to("/dev/zero")
    os.mkfifo(pipe)
    return device, pipe


@pytest.mark.parametrize("ending", [".csv", ".csv.gz", ".parquet", ".npz", ".mat", ".mf4"])
@pytest.mark.parametrize("load", [load_recording, read_log])
def test_devices_and_pipes_are_refused_at_once(
    tmp_path: Path, load: Callable[[Path], object], ending: str
) -> None:
    for path in special(tmp_path, ending):
        with pytest.raises(RecordingError, match=rf"{path.name}: .* (regular file|pyarrow)"):
            load(path)


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
    monkeypatch.setattr(_gate, "MOST_ROWS", 50)
    with pytest.raises(RecordingError, match=r"long.csv: about 102 rows; at most 50 are read"):
        load_recording(file)
    monkeypatch.setattr(_gate, "MOST_ROWS", 500)
    monkeypatch.setattr(_gate, "MOST_CELLS", 150)
    with pytest.raises(RecordingError, match=r"about 203 cells; at most 150"):
        load_recording(file)


def test_what_lies_outside_is_not_opened(stand: Path) -> None:
    SEALED.to_toml(stand.parent / "rig.toml")
    (stand / "link.csv").symlink_to("/dev/zero")
    (stand / "case.toml").write_text(
        'schema = "pamrs.case/1"\nrig = "../rig.toml"\n[[recording]]\nfile = "link.csv"\n'
    )
    with pytest.raises(CaseError) as caught:
        load_case(stand)
    for named in ("rig = '../rig.toml'", "recording[0].file = 'link.csv'"):
        assert f"{named}: lies outside the case folder" in str(caught.value)
    with pytest.raises(CaseError, match="it is a device"):
        load_case(stand, allow_outside=True)


RECORDING = '[[recording]]\nfile = "run.csv"\n'


@pytest.mark.parametrize("named", ["", 'rig = "rig.toml"\n', 'rig = "."\n', 'rig = "bench"\n'])
def test_a_rig_file_that_is_a_link_out_of_the_folder_is_not_opened(stand: Path, named: str) -> None:
    """Also where it is not named, and in a folder that is."""
    (stand / "bench").mkdir()
    (stand / "case.toml").write_text(f'schema = "pamrs.case/1"\n{named}{RECORDING}')
    rows = "".join(f"{k},{1e5 + k}\n" for k in range(40))
    (stand / "run.csv").write_text(f"time [s],muscle_pressure [Pa]\n{rows}")
    there = stand / ("bench/rig.toml" if "bench" in named else "rig.toml")
    there.symlink_to(SEALED.to_toml(stand.parent / "secret.toml"))
    with pytest.raises(CaseError, match=r"rig = .*: .*lies outside the case folder"):
        load_case(stand)
    assert load_case(stand, allow_outside=True).rig.name == "sealed_chamber"
    there.unlink()
    SEALED.to_toml(there)
    assert load_case(stand).rig.name == "sealed_chamber"


def test_a_description_that_is_a_link_out_of_its_folder_is_not_opened(stand: Path) -> None:
    (stand / "case.toml").symlink_to(SEALED.to_toml(stand.parent / "secret.toml"))
    with pytest.raises(CaseError, match=r"case.toml: lies outside the case folder"):
        load_case(stand)
    with pytest.raises(CaseError, match=r"'pamrs.rig/1' is not allowed"):  # opened on request
        load_case(stand, allow_outside=True)


def test_a_link_in_the_folder_of_a_bag_is_not_opened(stand: Path) -> None:
    (stand / "bag").mkdir()
    (stand / "bag" / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    (stand / "bag" / "bag_0.db3").symlink_to(stand.parent / "other.db3")
    case_of_a_bag(stand, "bag")
    with pytest.raises(CaseError, match=r"file = 'bag': .*bag_0.db3 lies outside the case folder"):
        load_case(stand)


MAPPED = "".join(
    f'{name} = {{ column = "{item["column"]}", unit = "{item["unit"]}" }}\n'
    for name, item in mapping("/rig/position[{}]").items()
)


def case_of_a_bag(home: Path, bag: str) -> None:
    """A case of one bag, which was written with :func:`written`."""
    SHOULDER.to_toml(home / "rig.toml")
    (home / "case.toml").write_text(
        f'schema = "pamrs.case/1"\n[[recording]]\nfile = "{bag}"\n[recording.channels]\n{MAPPED}'
    )


@pytest.mark.parametrize("whole", [True, False])
def test_a_bag_whose_names_sqlite_decodes_is_not_opened(
    tmp_path: Path, stand: Path, whole: bool
) -> None:
    """A file of that very name lies in the case folder, empty: what is read is another one."""
    pytest.importorskip("rosbags")
    bag, _, _ = written(tmp_path, "bag")
    (stored,) = bag.glob("*.db3")
    secret = stored.rename(tmp_path / "secret.db3")
    (stand / "bag").mkdir()
    name = "bag/..%2f..%2fsecret.db3" if whole else "..%2fsecret.db3"
    told = (bag / "metadata.yaml").read_text()
    assert stored.name in told
    if whole:
        other = told.replace(stored.name, Path(name).name)
        (stand / "bag" / "metadata.yaml").write_text(other)
    (stand / name).touch()
    case_of_a_bag(stand, "bag" if whole else name)
    with pytest.raises(CaseError, match=r"names with %, \? or # are not read from bags"):
        load_case(stand)
    (stand / name).unlink()
    shutil.copy(secret, stand / "bag" / stored.name)
    (stand / "bag" / "metadata.yaml").write_text(told)
    case_of_a_bag(stand, "bag")
    assert len(load_case(stand).recordings[0]) == N


@pytest.mark.parametrize("mark", ["%", "?", "#"])
def test_a_folder_above_a_bag_leads_nowhere_else(tmp_path: Path, mark: str) -> None:
    pytest.importorskip("rosbags")
    home = tmp_path / f"stand{mark}2"
    home.mkdir()
    bag, _, _ = written(tmp_path, "bag")
    bag.rename(home / "bag")
    with pytest.raises(RecordingError, match=r"are not read from bags .*; rename it"):
        read_log(home / "bag")


SECRET = np.arange(40.0)


def leading(group: Any, home: Path) -> Any:
    """Ways by which an HDF5 file leads to any other: raw storage, virtual data sets, links."""
    h5py = pytest.importorskip("h5py")
    SECRET.tofile(home / "secret.bin")
    with h5py.File(home / "secret.h5", "w") as file:
        file["p"] = SECRET
    stored = [(str(home / "secret.bin"), 0, SECRET.nbytes)]
    layout = h5py.VirtualLayout(SECRET.shape, "f8")
    layout[:] = h5py.VirtualSource(str(home / "secret.h5"), "p", SECRET.shape)
    link = h5py.ExternalLink(str(home / "secret.h5"), "p")
    return {
        "raw": lambda: group.create_dataset("raw", SECRET.shape, "f8", external=stored),
        "virtual": lambda: group.create_virtual_dataset("virtual", layout),
        "link": lambda: group.__setitem__("link", link),
    }


def test_numbers_that_lie_in_another_file_are_not_read(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["own"] = SECRET + 1.0
        for lead in leading(file, tmp_path).values():
            lead()
        leading(file.create_group("daq"), tmp_path)["link"]()
        assert file["raw"][3] == file["virtual"][3] == file["link"][3] == 3.0  # they do lead there
    log = read_log(tmp_path / "run.h5")
    assert list(log.series) == ["own"]
    assert log.unread["raw"] == log.unread["virtual"]
    assert "its numbers lie in another file; copy them into this one" in log.unread["raw"]
    assert list(log.unread) == ["daq/link", "link", "raw", "virtual"]
    for name in ("link", "daq/link"):
        assert re.search(r"it is a link to '.*secret.h5'; copy what", log.unread[name])
        with pytest.raises(RecordingError, match=f"'{name}' cannot be used: it is a link to"):
            log.find(name)


def test_a_view_of_the_own_file_is_called_so(tmp_path: Path) -> None:
    """What it shows may lie in another file all the same, so it is not read."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["own"] = np.arange(40.0)
        layout = h5py.VirtualLayout((40,), "f8")
        layout[:] = h5py.VirtualSource(file["own"])
        file.create_virtual_dataset("view", layout)
    log = read_log(tmp_path / "run.h5")
    assert list(log.series) == ["own"]
    assert log.unread["view"].startswith("it is virtual, a view of other data sets")


@pytest.mark.parametrize("how", ["raw", "virtual", "link"])
def test_a_matlab_file_that_leads_to_another_is_refused(tmp_path: Path, how: str) -> None:
    h5py = pytest.importorskip("h5py")
    pytest.importorskip("matio")
    with h5py.File(tmp_path / "run.mat", "w", userblock_size=512) as file:
        group = file.create_group("daq")
        leading(group, tmp_path)[how]()
        if how == "raw":
            group["raw"].attrs["MATLAB_class"] = np.bytes_("double")
    with pytest.raises(RecordingError, match=rf"run.mat: .*{how}: .* into this (file|one)"):
        read_log(tmp_path / "run.mat")
