"""Results of sweeps: the numbers of single runs, labelled; what ended; what is refused."""

from __future__ import annotations

import re
import sys
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pamrs
from pamrs.sweeps._axes import Blocks
from tests.sweeps.helpers import COMMAND, DT, GRID, METRICS, same, small

LEAKING = pamrs.rigs.shoulder().with_effect("leak_muscle", {"conductance": 5e-11})


def one_run(payload: float, angle: float, volume: float) -> pamrs.Simulation:
    rig = pamrs.rigs.shoulder().with_parameters(
        {"arm.payload": payload, "chamber.dead_volume": volume}
    )
    return pamrs.simulate(rig, COMMAND, sample_time=DT, initial={"joint_angle": angle})


def test_each_cell_of_a_grid_is_a_run(tmp_path):
    data = small(tmp_path / "out.zarr")
    assert data["end"].dims == tuple(GRID)
    assert data["end"].shape == (3, 4, 2)
    for name, values in GRID.items():
        assert data[name].values.tolist() == values
    for values in ((2.0, 0.4, 1e-4), (9.0, 0.8, 1.5e-4), (5.0, 0.6, 1e-4)):
        run = one_run(*values)
        cell = data.sel(dict(zip(GRID, values, strict=True)))
        expected = {
            "end": run["joint_angle"][-1],
            "least": run["joint_rate"].min(),
            "most": run["muscle_pressure"].max(),
            "swing": np.abs(run["joint_rate"]).max(),
            "level": run["muscle_pressure"].mean(),
            "ise": np.trapezoid((run["joint_angle"] - 0.8) ** 2, dx=DT),
        }
        for name, value in expected.items():
            assert float(cell[name]) == pytest.approx(value, rel=1e-7), name
    assert np.isnan(data["ended_at"].values).all()
    assert data.attrs["runs"] == data.attrs["runs_done"] == 24
    assert data.attrs["runs_ended"] == 0


def test_everything_has_its_unit(tmp_path):
    data = small(
        tmp_path / "out.zarr", metrics={**METRICS, "ise_p": ("squared_error", "muscle_pressure")}
    )
    units = {name: data[name].attrs["units"] for name in data.variables}
    assert units == {
        "arm.payload": "kg",
        "initial.joint_angle": "rad",
        "chamber.dead_volume": "m3",
        "end": "rad",
        "least": "rad/s",
        "most": "Pa",
        "swing": "rad/s",
        "level": "Pa",
        "ise": "rad2 s",
        "ise_p": "Pa2 s",
        "ended_at": "s",
    }


def test_samples_are_rows_with_their_parameters(tmp_path):
    """Cut into chunks and gone on with as a grid is."""
    names, rows = ["arm.payload", "initial.joint_angle"], np.array([[2, 0.4], [5, 0.6], [9, 0.8]])
    data = small(tmp_path / "out.zarr", names, samples=rows, chunk=2)
    assert data["end"].dims == ("run",)
    assert data["arm.payload"].values.tolist() == [2.0, 5.0, 9.0]
    assert data["arm.payload"].attrs["units"] == "kg"
    assert "arm.payload" in data.coords
    run = one_run(5.0, 0.6, 1.5e-4)
    assert float(data["end"][1]) == pytest.approx(run["joint_angle"][-1], rel=1e-7)
    same(data, small(tmp_path / "whole.zarr", names, samples=rows, chunk=3))
    with pytest.raises(pamrs.ParameterError, match="samples of arm.payload: other numbers"):
        small(tmp_path / "out.zarr", names, samples=rows + [1.0, 0.0], chunk=2)


def test_geometry_makes_other_rigs_and_an_impossible_one_has_ended(tmp_path):
    rig = pamrs.rigs.shoulder()
    over = {"joint.upper_offset": [0.02, 0.027432, 9.0], "arm.payload": [5.0, 9.0]}
    data = small(tmp_path / "out.zarr", over)
    other = rig.with_parameters({"joint.upper_offset": 0.02, "arm.payload": 9.0})
    alone = pamrs.simulate(other, COMMAND, sample_time=DT)
    assert float(data["end"][0, 1]) == pytest.approx(alone["joint_angle"][-1], rel=1e-7)
    assert data["ended_at"].values[2].tolist() == [0.0, 0.0]
    assert np.isnan(data["end"].values[2]).all()
    assert np.isfinite(data["end"].values[:2]).all()
    assert data.attrs["runs_ended"] == 2
    assert data.attrs["first_ended"].startswith("run 4: ")


def test_a_run_that_ends_is_counted_and_the_others_go_on(tmp_path, capsys):
    over = {"initial.joint_rate": [0.0, -500.0, 1.0]}
    data = small(tmp_path / "out.zarr", over, progress=True)
    assert np.isnan(data["ended_at"].values).tolist() == [True, False, True]
    assert np.isnan(data["end"].values).tolist() == [False, True, False]
    assert data.attrs["runs_ended"] == 1
    assert data.attrs["first_ended"].startswith("run 1: ")
    assert "3 of 3 runs (1 ended before their end)" in capsys.readouterr().err


def test_effects_and_pressures_of_tanks_vary_without_other_rigs(tmp_path):
    rig = pamrs.rigs.shoulder().with_effect("leak_muscle", {"conductance": 1e-11})
    over = {"leak_muscle.conductance": [1e-11, 1e-9], "supply.initial_pressure": [5e5, 9e5]}
    data = small(tmp_path / "out.zarr", over, rig=rig)
    other = pamrs.rigs.shoulder().with_effect("leak_muscle", {"conductance": 1e-9})
    other = other.with_parameters({"supply.initial_pressure": 5e5})
    alone = pamrs.simulate(other, COMMAND, sample_time=DT)
    assert float(data["most"][1, 0]) == pytest.approx(alone["muscle_pressure"].max(), rel=1e-7)
    assert data["leak_muscle.conductance"].attrs["units"] == "m3/(s Pa)"


def test_a_rig_without_inputs_takes_a_duration(tmp_path):
    data = pamrs.sweep(
        pamrs.rigs.named("sealed_chamber"),
        {"initial.muscle_pressure": [1e5, 2e5]},
        {"end": ("final", "muscle_pressure")},
        sample_time=0.01,
        duration=0.1,
        store=tmp_path / "out.zarr",
        progress=False,
    )
    assert data["end"].values == pytest.approx([1e5, 2e5])


def test_chunks_and_executors_change_no_number(tmp_path, store):
    here = pamrs.sweeps.open_sweep(store)
    for chunk in (3, 1000):
        same(small(tmp_path / f"{chunk}.zarr", chunk=chunk), here)
    with ThreadPoolExecutor(3) as pool:
        same(small(tmp_path / "threads.zarr", executor=pool), here)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        same(small(tmp_path / "processes.zarr", executor=pool), here)


class Lazy(Executor):
    """Does what waits when so much waits that no more is given."""

    def __init__(self) -> None:
        self.waiting: list[tuple[Future[Any], Any]] = []
        self.given: list[int] = []

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.waiting.append((future, lambda: fn(*args, **kwargs)))
        self.given.append(len(self.waiting))
        if len(self.waiting) == 3:
            for waiting, work in self.waiting:
                waiting.set_result(work())
            self.waiting.clear()
        return future


def test_few_chunks_are_in_flight(tmp_path):
    pool = Lazy()
    data = small(tmp_path / "out.zarr", executor=pool, in_flight=3)
    assert max(pool.given) == 3
    assert np.isfinite(data["end"].values).all()


def test_an_executor_that_lost_its_workers_says_so_and_what_is_done_is_kept(tmp_path):
    with ThreadPoolExecutor(1) as good, ProcessPoolExecutor(1) as broken:
        with pytest.raises(pamrs.SimulationError, match="lost its workers"):
            small(tmp_path / "out.zarr", executor=_Breaking(broken, good))
        data = small(tmp_path / "out.zarr", executor=good)
    assert np.isfinite(data["end"].values).all()


class _Breaking(Executor):
    """Two chunks are done; then the pool is broken."""

    def __init__(self, broken: Executor, good: Executor) -> None:
        self.broken, self.good, self.count = broken, good, 0

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        from concurrent.futures.process import BrokenProcessPool

        self.count += 1
        if self.count < 3:
            return self.good.submit(fn, *args, **kwargs)
        future: Future[Any] = Future()
        future.set_exception(BrokenProcessPool("a child process terminated abruptly"))
        return future


@settings(max_examples=60, deadline=None)
@given(
    shape=st.lists(st.integers(1, 12), min_size=1, max_size=4).map(tuple),
    chunk=st.integers(1, 200),
)
def test_chunks_part_the_runs(shape, chunk):
    blocks = Blocks.cut(shape, chunk)
    found = np.zeros(shape, dtype=int)
    numbers = np.arange(found.size).reshape(shape)
    for k in range(len(blocks)):
        region, (start, stop) = blocks.region(k), blocks.runs(k)
        found[region] += 1
        assert numbers[region].ravel().tolist() == list(range(start, stop))
        assert stop - start <= chunk
    assert (found == 1).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"over": {}}, "the grid is empty"),
        ({"over": [1.0]}, "the grid is a list"),
        ({"over": {"arm.mass": [1.0]}}, "'arm.mass' is no parameter of the rig 'shoulder'"),
        (
            {"over": {"arm.payload": [1.0, -2.0]}},
            r"arm.payload\[1\] = -2 kg is not allowed: from 0",
        ),
        ({"over": {"arm.payload": [np.nan]}}, r"arm.payload\[0\] = nan"),
        ({"over": {"arm.payload": [1.0, 1.0]}}, "one is given twice"),
        ({"over": {"arm.payload": [[1.0]]}}, r"arm.payload has the shape \(1, 1\)"),
        ({"over": {"arm.payload": ["heavy"]}}, "arm.payload = .* is not allowed: numbers"),
        ({"over": {"initial.angle": [0.5]}}, "unknown entry 'angle'"),
        ({"samples": [[1.0]]}, "over = .* with samples= it lists the names"),
        ({"over": ["arm.payload"], "samples": [5.0, 9.0]}, r"shape \(2,\); \(runs, 1\) is"),
        ({"over": ["arm.payload"] * 2, "samples": [[5.0, 9.0]]}, "over = .* each name once"),
        ({"over": ["arm.payload"], "samples": [[-1.0]]}, r"arm.payload\[0\] = -1 kg"),
        ({"metrics": {}}, "metrics is empty"),
        ({"metrics": {"end": "joint_angle"}}, r"metrics\['end'\] = 'joint_angle' is not allowed"),
        (
            {"metrics": {"end": ("last", "joint_angle")}},
            "'last' is not allowed: one of 'final', 'min'",
        ),
        ({"metrics": {"end": ("final", "angle")}}, "angle"),
        ({"metrics": {"end": ("final", "joint_angle", 1.0)}}, r"metrics\['end'\] = \('final'"),
        (
            {"metrics": {"e": ("squared_error", "joint_angle", np.nan)}},
            r"metrics\['e'\] has a refer",
        ),
        ({"metrics": {"run/1": ("final", "joint_angle")}}, "'run/1', which is not allowed"),
        ({"metrics": {"ended_at": ("final", "joint_angle")}}, "'ended_at', which is not allowed"),
        ({"metrics": {"arm.payload": ("final", "joint_angle")}}, "'arm.payload', which is not"),
        ({"initial": {"joint_angle": 0.5}}, "initial has 'joint_angle', which varies"),
        ({"initial": {"joint_rate": "fast"}}, "initial joint_rate = 'fast'"),
        ({"chunk": 0}, "chunk = 0 is not allowed: a whole number from 1"),
        ({"chunk": 2.5}, "chunk = 2.5"),
        ({"threads": 0}, "threads = 0"),
        ({"in_flight": 0}, "in_flight = 0"),
        ({"executor": 4}, "executor is a int"),
        ({"sample_time": 0.0}, "sample_time = 0"),
        ({"sample_time": "short"}, "sample_time = 'short'"),
        ({"valve_command": [[1.0, 2.0]]}, r"valve_command has the shape \(1, 2\)"),
        ({"valve_command": None}, "valve_command is missing"),
        ({"rig": "shoulder"}, "rig is a str"),
    ],
)
def test_bad_input_is_named_and_leaves_no_store(tmp_path, changes, message):
    with pytest.raises(pamrs.PamrsError, match=message):
        small(tmp_path / "out.zarr", **changes)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"over": {**GRID, "arm.payload": [2.0, 5.0, 9.5]}}, "over['arm.payload']: other numbers"),
        ({"over": dict(reversed(GRID.items()))}, "over (order of the axes): "),
        ({"rig": pamrs.rigs.shoulder().with_parameters({"arm.length": 0.8})}, "0.8 m now"),
        ({"rig": LEAKING}, "rig: other effects"),
        (
            {"metrics": {**METRICS, "new": ("final", "joint_rate")}},
            "metrics['new'] is not in the store",
        ),
        ({"metrics": {"end": METRICS["end"]}}, "metrics['ise'] is in the store only"),
        ({"metrics": {**METRICS, "ise": ("squared_error", "joint_angle", 0.9)}}, "0.9] now"),
        ({"valve_command": COMMAND + 1e-9}, "valve_command: other numbers"),
        ({"step": 1e-3}, "step: None in the store, 0.001 now"),
        ({"initial": {"joint_rate": 0.1}}, "initial['joint_rate'] is not in the store"),
        ({"chunk": 2}, r"chunk: (1, 2, 2) in the store"),
    ],
)
def test_the_store_of_another_sweep_is_refused(tmp_path, changes, message, store):
    with pytest.raises(pamrs.ParameterError, match=re.escape(message)) as told:
        small(store, **changes)
    assert not re.search(r"\b[0-9a-f]{8,}\b", str(told.value))  # words, no digests


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    path = tmp_path_factory.mktemp("done") / "out.zarr"
    small(path)
    return path


def test_what_is_no_store_is_refused_and_left_alone(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    for path in (tmp_path, tmp_path / "notes.txt"):
        with pytest.raises(pamrs.ParameterError, match="is not a sweep"):
            small(path)
    with pytest.raises(pamrs.ParameterError, match="is not a sweep"):
        pamrs.sweeps.open_sweep(tmp_path / "nothing.zarr")
    with pytest.raises(pamrs.ParameterError, match="cannot be written"):
        small(tmp_path / "notes.txt" / "out.zarr")
    assert [file.name for file in tmp_path.iterdir()] == ["notes.txt"]


def test_a_damaged_store_says_so(tmp_path):
    path = tmp_path / "out.zarr"
    small(path)
    (path / "zarr.json").write_text("{}")
    with pytest.raises(pamrs.ParameterError, match="is damaged"):
        small(path)
    (path / ".pamrs" / "plan.json").write_text("[1]")
    with pytest.raises(pamrs.ParameterError, match="is not a sweep"):
        small(path)


@pytest.mark.parametrize("name", ["zarr", "xarray"])
def test_a_missing_package_is_named_with_its_extra(tmp_path, store, monkeypatch, name):
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ImportError, match=rf"needs {name}, .* pip install 'pamrs\[sweep\]'"):
        pamrs.sweeps.open_sweep(store)
