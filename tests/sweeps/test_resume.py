"""Killed at any instant, a sweep loses nothing that is done and does nothing twice."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest

import pamrs
from pamrs.sweeps._running import Progress
from pamrs.sweeps._store import StoredChunk, read_journal
from tests.sweeps.helpers import same, small

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="processes as on POSIX")

#: Forks a sweep that kills itself at an instant, then one that goes on; each notes the chunks that
#: it works out. Instants: a chunk, and what is about to happen to it.
SCRIPT = """
import json, os, signal, sys
from pathlib import Path
import xarray, zarr  # once, for all that are forked
from pamrs.sweeps import _running, _store
from tests.sweeps.helpers import METRICS, small

folder, instants = Path(sys.argv[1]), json.loads(sys.argv[2])

def die():
    os.kill(os.getpid(), signal.SIGKILL)

def noting(notes, fatal):
    work, seen = _running.run_chunk, [0]
    def run_chunk(task):
        with notes.open("a") as stream:
            first = (values[0] for values in task.values.values())
            stream.write(" ".join(map(str, first)) + "\\n")
        done = work(task)
        seen[0] += 1
        if fatal == [seen[0], "before it is written"]:
            die()
        return done
    _running.run_chunk = run_chunk

def dying_in_write(fatal):
    to_disk, line, write, seen = _store._to_disk, _store.StoredChunk.line, _store.Store.write, [0]
    def written(self, chunk, values, done):
        seen[0] += 1
        entry = write(self, chunk, values, done)
        if fatal == [seen[0], "after its line"]:
            die()
        return entry
    def flushed(path):
        if fatal == [seen[0], "between two arrays"] and "/least/" in str(path):
            die()
        to_disk(path)
    def half(self):
        if fatal == [seen[0], "in half of an array"]:
            for name in METRICS:
                files = [f for f in (folder / "out.zarr" / name / "c").rglob("*") if f.is_file()]
                last = max(files, key=lambda file: file.stat().st_mtime_ns)
                last.write_bytes(last.read_bytes()[:7])
            die()
        if fatal == [seen[0], "before its line"]:
            die()
        if fatal == [seen[0], "in half of its line"]:
            journal = os.open(folder / "out.zarr/.pamrs/journal", os.O_WRONLY | os.O_APPEND)
            os.write(journal, line(self)[:9])
            die()
        return line(self)
    _store.Store.write, _store._to_disk, _store.StoredChunk.line = written, flushed, half

def dying_in_making(fatal):
    if fatal == [0, "while the store is made"]:
        _store.write_atomically = lambda *_: die()

for fatal in [*instants, None]:
    if (child := os.fork()) == 0:
        noting(folder / f"notes {instants.index(fatal) if fatal else 'last'}", fatal)
        dying_in_write(fatal)
        dying_in_making(fatal)
        small(folder / "out.zarr")
        os._exit(0)
    code = os.waitpid(child, 0)[1]
    assert code == (signal.SIGKILL if fatal else 0), (fatal, code)
"""


def started(script: str, *words: object, errors: int) -> subprocess.Popen[str]:
    """A script in a process of its own that finds this package and its tests."""
    root = str(Path(__file__).parents[2])
    path = os.pathsep.join([root, *filter(None, sys.path)])
    command = [sys.executable, "-c", script, *map(str, words)]
    env = {**os.environ, "PYTHONPATH": path}
    return subprocess.Popen(command, cwd=root, env=env, stderr=errors, text=True)


def run(folder: Path, instants: list[tuple[int, str]]) -> list[list[str]]:
    """The chunks that each process has worked out."""
    process = started(SCRIPT, folder, json.dumps(instants), errors=subprocess.PIPE)
    _, told = process.communicate(timeout=120)
    assert process.returncode == 0, told
    notes = [folder / f"notes {k}" for k in (*range(len(instants)), "last")]
    return [note.read_text().splitlines() if note.exists() else [] for note in notes]


def test_a_sweep_killed_at_any_instant_goes_on_where_it_was(tmp_path):
    instants = [
        (0, "while the store is made"),
        (1, "before it is written"),
        (1, "between two arrays"),
        (1, "in half of an array"),
        (1, "before its line"),
        (1, "in half of its line"),
        (2, "in half of its line"),
        (1, "after its line"),
        (2, "before it is written"),
    ]
    notes = run(tmp_path, instants)
    # How many chunks each process began, and how many lines it left.
    assert [len(chunks) for chunks in notes] == [0, 1, 1, 1, 1, 1, 2, 1, 2, 3]
    kept = [0, 0, 0, 0, 0, 0, 1, 1, 1, 3]
    begun = Counter(chunk for chunks in notes for chunk in chunks)
    assert len(begun) == sum(kept) == 6
    # One chunk at most is in flight in a process: each one killed has cost at most that.
    assert sum(begun.values()) - 6 == 7
    same(pamrs.sweeps.open_sweep(tmp_path / "out.zarr"), small(tmp_path / "straight.zarr"))
    assert not list(tmp_path.glob(".*"))


def test_a_sweep_killed_from_outside_with_an_executor(tmp_path):
    script = """
import sys, time
from concurrent.futures import ThreadPoolExecutor
from pamrs.sweeps import _running
from tests.sweeps.helpers import small
work = _running.run_chunk
def run_chunk(task):
    time.sleep(0.1)
    return work(task)
_running.run_chunk = run_chunk
small(sys.argv[1], executor=ThreadPoolExecutor(2), chunk=1)
"""
    path = tmp_path / "out.zarr"
    process = started(script, path, errors=subprocess.DEVNULL)
    journal, limit = path / ".pamrs" / "journal", time.monotonic() + 60
    while not (journal.exists() and len(journal.read_bytes().splitlines()) >= 5):
        assert time.monotonic() < limit
        assert process.poll() is None
        time.sleep(0.01)
    process.kill()
    assert process.wait() == -signal.SIGKILL
    done, _ = read_journal(journal)
    assert 5 <= len(done) < 24
    part = pamrs.sweeps.open_sweep(path)
    assert part.attrs["runs_done"] == len(done)
    assert int(part["end"].notnull().sum()) >= len(done)
    same(small(path, chunk=1), small(tmp_path / "straight.zarr", chunk=1))
    after, _ = read_journal(journal)
    assert list(after)[: len(done)] == list(done)
    assert sorted(after) == list(range(24))


def test_a_done_sweep_does_nothing_again(tmp_path):
    path = tmp_path / "out.zarr"
    first = small(path).load()
    content = {file: file.stat().st_mtime_ns for file in path.rglob("*") if file.is_file()}
    same(small(path), first)
    changed = {file.name for file, at in content.items() if file.stat().st_mtime_ns != at}
    assert not changed - {"lock"}


def test_two_processes_do_not_share_a_store(tmp_path):
    fcntl = pytest.importorskip("fcntl")
    path = tmp_path / "out.zarr"
    small(path)
    with (path / ".pamrs" / "lock").open("w") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(pamrs.ParameterError, match="in use: another process"):
            small(path)
    small(path)


def test_a_journal_cut_anywhere_has_the_lines_before(tmp_path):
    entries = [StoredChunk(k, 4, k % 2, (7, "über 3°") if k % 2 else None) for k in range(5)]
    whole = b"".join(entry.line() for entry in entries)
    file = tmp_path / "journal"
    for size in range(len(whole) + 1):
        file.write_bytes(whole[:size])
        found, good = read_journal(file)
        assert list(found.values()) == entries[: whole[:size].count(b"\n")]
        assert good == whole[:size].rfind(b"\n") + 1
    file.write_bytes(whole.replace(b"[1, 4", b"[1, 5"))
    assert len(read_journal(file)[0]) == 1


def test_a_copy_of_a_store_is_one(tmp_path):
    first = small(tmp_path / "out.zarr").load()
    shutil.move(tmp_path / "out.zarr", tmp_path / "moved.zarr")
    same(pamrs.sweeps.open_sweep(tmp_path / "moved.zarr"), first)


class Clock:
    """A time that is set."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_whoever_asks_gets_lines_with_share_and_time_left(capsys):
    clock, heard = Clock(), []
    progress = Progress("out.zarr", runs=100, chunks=4, shown=heard.append, clock=clock)
    clock.now = 20.0
    progress.add(25, 0)
    clock.now = 80.0
    progress.add(75, 0)
    assert capsys.readouterr().err == ""
    assert [(line.share, line.left) for line in heard] == [(0.25, 60.0), (1.0, 0.0)]
    assert heard[0].startswith("sweep out.zarr: 1 of 4 chunks")


def test_progress_says_how_long_it_will_take(capsys):
    clock = Clock()
    progress = Progress("out.zarr", runs=1000, chunks=10, done=200, chunks_done=2, clock=clock)
    clock.now = 20.0
    progress.add(100, 3)
    clock.now = 25.0
    progress.add(100, 0)  # too soon for another line
    clock.now = 120.0
    for _ in range(6):
        progress.add(100, 0)
    assert capsys.readouterr().err.splitlines() == [
        "sweep out.zarr: 2 of 10 chunks, 200 of 1000 runs, going on",
        "sweep out.zarr: 3 of 10 chunks, 300 of 1000 runs (3 ended before their end), 5 runs/s, "
        "2 min 20 s left",
        "sweep out.zarr: 5 of 10 chunks, 500 of 1000 runs (3 ended before their end), 2.5 runs/s, "
        "3 min 20 s left",
        "sweep out.zarr: 10 of 10 chunks, 1000 of 1000 runs (3 ended before their end), "
        "6.667 runs/s, took 2 min 0 s",
    ]
