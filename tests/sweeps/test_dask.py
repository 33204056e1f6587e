"""A cluster of dask whose worker is killed in mid-run."""

from __future__ import annotations

import os
import signal
import threading
import time
import warnings

import numpy as np
import pytest

import pamrs
from pamrs.sweeps._store import read_journal
from tests.sweeps.helpers import same, small

distributed = pytest.importorskip("distributed")

#: 96 runs of 4 s, one in each chunk.
OVER = {"arm.payload": np.linspace(2.0, 9.0, 96)}
LONG = {"valve_command": np.full(801, 6.0), "chunk": 1}


@pytest.fixture
def client():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cluster = distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50
        )
        with cluster, distributed.Client(cluster) as found:
            yield found


@pytest.mark.filterwarnings("ignore")
@pytest.mark.slow
def test_a_worker_killed_in_mid_run_loses_nothing(tmp_path, client):
    path = tmp_path / "out.zarr"
    journal, killed = path / ".pamrs" / "journal", []
    pids = set(client.run(os.getpid).values())

    def kill() -> None:
        limit = time.monotonic() + 60
        while time.monotonic() < limit and not killed:
            if journal.exists() and len(journal.read_bytes().splitlines()) >= 5:
                pid = min(pids)
                killed.append(pid)
                os.kill(pid, signal.SIGKILL)
            time.sleep(0.01)

    thread = threading.Thread(target=kill)
    thread.start()
    data = small(path, OVER, executor=client, **LONG)
    thread.join()
    assert len(killed) == 1
    assert set(client.run(os.getpid).values()) != pids
    done, size = read_journal(journal)
    assert sorted(done) == list(range(96))
    assert journal.read_bytes().count(b"\n") == 96
    assert size == journal.stat().st_size
    same(data, small(tmp_path / "here.zarr", OVER, **LONG))
    assert pamrs.sweeps.open_sweep(path).attrs["runs_done"] == 96
