"""The store of a sweep: a Zarr group, and next to its arrays the plan and the journal of the chunks
that are done.

A chunk is written whole to every array, then a line of the journal says so. A process that is
killed at any instant leaves at most a chunk without its line, which is worked out again.
"""

from __future__ import annotations

import json
import os
import shutil
import warnings
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from pamrs._arrays import Array
from pamrs._writing import write_atomically
from pamrs.errors import ParameterError, joined, missing_package
from pamrs.sweeps._plan import SweepPlan, differences

if TYPE_CHECKING:
    import xarray as xr

    from pamrs.rig import Rig
    from pamrs.sweeps._drives import Done

#: The array that says when a run ended [s]; NaN where it reached the end.
ENDED_AT: Final = "ended_at"
_FOLDER, _PLAN, _JOURNAL, _LOCK = ".pamrs", "plan.json", "journal", "lock"


class StoredChunk(NamedTuple):
    """A chunk that is done.

    Attributes
    ----------
    chunk : int
    runs : int
    ended : int
        How many of its runs ended before the end.
    first : (int, str) or None
        The first of them, counted in C order over the sweep, and its message.
    """

    chunk: int
    runs: int
    ended: int
    first: tuple[int, str] | None

    def line(self) -> bytes:
        """Line of the journal, with a checksum before it."""
        text = json.dumps([self.chunk, self.runs, self.ended, self.first]).encode()
        return b"%08x %s\n" % (zlib.crc32(text), text)

    @classmethod
    def read(cls, line: bytes) -> StoredChunk | None:
        """Read a line of the journal; None where it was not written to its end."""
        sum_, _, text = line.rstrip(b"\n").partition(b" ")
        if not line.endswith(b"\n") or sum_ != b"%08x" % zlib.crc32(text):
            return None
        chunk, runs, ended, first = json.loads(text)
        return cls(chunk, runs, ended, tuple(first) if first else None)


def read_journal(path: Path) -> tuple[dict[int, StoredChunk], int]:
    """The chunks that are done, and how many bytes of the journal say so.

    Parameters
    ----------
    path : Path
        The journal.

    Returns
    -------
    entries : dict of int to StoredChunk
    size : int
        What follows it was being written when a process was killed.
    """
    entries: dict[int, StoredChunk] = {}
    size = 0
    with path.open("rb") as stream:
        for line in stream:
            entry = StoredChunk.read(line)
            if entry is None:
                break
            entries[entry.chunk] = entry
            size += len(line)
    return entries, size


class Store:
    """The store of one sweep, held by one process at a time; use it in a ``with`` statement.

    Parameters
    ----------
    path : path-like
        Folder of the Zarr group; made where there is none.
    plan : SweepPlan
        What is run.
    rig : Rig
        Its rig, for units.

    Raises
    ------
    ParameterError
        If there is something else at this path, the store is that of another plan (the message says
        what differs), or another process writes to it.
    MissingPackageError
        If zarr is not installed.
    """

    def __init__(self, path: str | os.PathLike[str], plan: SweepPlan, rig: Rig) -> None:
        self.path, self.plan = Path(path), plan
        _zarr()
        if not os.path.lexists(self.path):
            self._make(rig)
        self._check()
        with _opening(self.path):
            group = _zarr().open_group(str(self.path), mode="r+")
            self._arrays: dict[str, Any] = {
                name: group[name].with_config({"write_empty_chunks": True})
                for name in self._names()
            }
        self.entries: dict[int, StoredChunk] = {}
        self._journal: Any = None

    def __enter__(self) -> Store:
        self._lock = _locked(self.path / _FOLDER / _LOCK)
        file = self.path / _FOLDER / _JOURNAL
        self.entries, size = read_journal(file)
        self._journal = file.open("r+b", buffering=0)
        if self._journal.seek(0, os.SEEK_END) != size:
            self._journal.truncate(size)
            self._journal.seek(size)
        return self

    def __exit__(self, *_: object) -> None:
        self._journal.close()
        os.close(self._lock)

    def missing(self) -> Iterator[int]:
        """Chunks that are not done, in order."""
        return (chunk for chunk in range(len(self.plan.blocks)) if chunk not in self.entries)

    def write(self, chunk: int, values: Mapping[str, Array], done: Done) -> StoredChunk:
        """Keep a chunk: its arrays go to the disk first, then its line to the journal."""
        blocks, axes = self.plan.blocks, self.plan.axes
        region, (start, stop) = blocks.region(chunk), blocks.runs(chunk)
        shape = tuple(part.stop - part.start for part in region)
        columns = {**done.metrics, ENDED_AT: done.ended_at}
        if not axes.grid:
            columns = {**values, **columns}
        places = tuple(part.start // size for part, size in zip(region, blocks.block, strict=True))
        for name, column in columns.items():
            array = self._arrays[name]
            file = self.path / name / array.metadata.encode_chunk_key(places)
            file.unlink(missing_ok=True)  # it may be half of one: then nobody reads it
            array[region] = np.asarray(column, dtype=np.float64).reshape(shape)
            _to_disk(file)
        first = None if done.first is None else (start + done.first[0], done.first[1])
        ended = int(np.isfinite(done.ended_at).sum())
        entry = StoredChunk(chunk, stop - start, ended, first)
        self._journal.write(entry.line())
        os.fsync(self._journal.fileno())
        self.entries[chunk] = entry
        return entry

    def _names(self) -> list[str]:
        coordinates = [] if self.plan.axes.grid else list(self.plan.axes.names)
        return [*coordinates, *self.plan.drive.metric_units(), ENDED_AT]

    def _make(self, rig: Rig) -> None:
        """A store without a chunk, written under another name and renamed."""
        new = self.path.with_name(f".{self.path.name}.new")
        shutil.rmtree(new, ignore_errors=True)
        try:
            self._fill(new, rig)
            folder = new / _FOLDER
            folder.mkdir()
            (folder / _JOURNAL).touch()
            write_atomically(folder / _PLAN, json.dumps(self.plan.content, indent=1))
            os.replace(new, self.path)
        except OSError as error:
            raise ParameterError(
                f"store = {str(self.path)!r} cannot be written: {error.strerror or error}"
            ) from error
        finally:
            shutil.rmtree(new, ignore_errors=True)

    def _fill(self, new: Path, rig: Rig) -> None:
        zarr = _zarr()
        axes, blocks = self.plan.axes, self.plan.blocks
        new.parent.mkdir(parents=True, exist_ok=True)
        group = zarr.create_group(str(new), attributes={"rig": self.plan.rig_name})
        if axes.grid:
            for name, values in axes.values.items():
                array = group.create_array(
                    name, data=values, dimension_names=[name], chunks=(2**16,)
                )
                array.attrs["units"] = self.plan.drive.quantity(rig, name).unit
            units = {}
        else:
            units = {name: self.plan.drive.quantity(rig, name).unit for name in axes.names}
        coordinates = {"coordinates": " ".join(units)} if units else {}
        units |= self.plan.drive.metric_units() | {ENDED_AT: "s"}
        for name, unit in units.items():
            group.create_array(
                name,
                shape=blocks.shape,
                chunks=blocks.block,
                dtype="float64",
                fill_value=np.nan,
                dimension_names=axes.dims,
                attributes={"units": unit} | ({} if name in axes.names else coordinates),
            )
        with warnings.catch_warnings():  # it is in the format's own file since version 3
            warnings.simplefilter("ignore")
            zarr.consolidate_metadata(str(new))

    def _check(self) -> None:
        """Refuse the store of another plan."""
        stored = _stored(self.path)
        if stored.get("digest") == self.plan.content["digest"]:
            return
        raise ParameterError(
            joined(
                f"store = {str(self.path)!r} is that of another sweep; take another store, or "
                "delete this one",
                differences(stored, self.plan.content) or ["its plan.json was changed"],
            )
        )


def open_sweep(store: str | os.PathLike[str]) -> xr.Dataset:
    """The result of a sweep, also of one that is still running.

    Parameters
    ----------
    store : path-like
        Its store.

    Returns
    -------
    xarray.Dataset
        Metrics over one dimension for each axis of a grid, or over ``run`` with the samples as
        coordinates; ``ended_at`` [s] says when a run ended, NaN where it reached its end. Values
        are read from the store when they are needed; with dask they are dask arrays. NaN where a
        chunk is not done or a run ended. The attributes ``runs``, ``runs_done``, ``runs_ended`` and
        ``first_ended`` count them.

    Raises
    ------
    ParameterError
        If there is no sweep at this path.
    MissingPackageError
        If xarray or zarr is not installed.
    """
    _zarr()
    try:
        import xarray as xr
    except ImportError as error:
        raise missing_package(error, "sweep") from error
    path = Path(store)
    _stored(path)
    entries, _ = read_journal(path / _FOLDER / _JOURNAL)
    with _opening(path):
        data: xr.Dataset = xr.open_zarr(str(path), consolidated=True)
    first = min((entry.first for entry in entries.values() if entry.first), default=None)
    return data.assign_attrs(
        runs=int(data[ENDED_AT].size),
        runs_done=sum(entry.runs for entry in entries.values()),
        runs_ended=sum(entry.ended for entry in entries.values()),
        first_ended="" if first is None else f"run {first[0]}: {first[1]}",
    )


def _stored(path: Path) -> dict[str, Any]:
    """The plan of a store."""
    try:
        found = json.loads((path / _FOLDER / _PLAN).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ParameterError(
            f"store = {str(path)!r} is not a sweep: {_FOLDER}/{_PLAN} cannot be read "
            f"({getattr(error, 'strerror', None) or error})"
        ) from None
    if not isinstance(found, dict):
        raise ParameterError(f"store = {str(path)!r} is not a sweep: {_PLAN} is not a plan")
    return found


def _zarr() -> Any:
    try:
        import zarr
    except ImportError as error:
        raise missing_package(error, "sweep") from error
    return zarr


@contextmanager
def _opening(path: Path) -> Iterator[None]:
    """Turn the errors of a group that cannot be read into one of the store."""
    try:
        yield
    except (OSError, KeyError, ValueError) as error:
        raise ParameterError(
            f"store = {str(path)!r} is damaged, take another one: {error}"
        ) from error


def _locked(path: Path) -> int:
    """Lock a file for this process; the lock ends with the process, even when it is killed."""
    handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        import fcntl
    except ImportError:  # not POSIX: two processes with one store are not noticed there
        return handle
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        raise ParameterError(
            f"store = {str(path.parents[1])!r} is in use: another process writes to it"
        ) from None
    return handle


def _to_disk(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
