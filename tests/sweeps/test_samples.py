"""Samples by low-discrepancy sequences, and the sensitivities that stand on them."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from unittest.mock import Mock

import numpy as np
import pytest

import pamrs
from pamrs import sweeps
from tests.simulation.refusals import refused
from tests.sweeps.helpers import same, small
from tests.tables import rows_of

RIG = pamrs.rigs.shoulder()
PLANT = ["arm.payload", "chamber.dead_volume"]


@pytest.mark.parametrize("sequence", ["sobol", "halton"])
def test_any_piece_of_the_samples_is_that_of_the_whole(sequence):
    names = ["arm.payload", "arm.viscous", "initial.joint_angle"]
    within = {"initial.joint_angle": (0.3, 0.9)}

    def drawn(seed):
        return sweeps.samples(RIG, names, 100, seed, within=within, sequence=sequence)

    whole, parts = drawn(3).rows(0, 100), drawn(3)
    for start, stop in ((40, 60), (0, 7), (7, 8), (99, 100), (0, 100)):
        for source in (parts, pickle.loads(pickle.dumps(parts))):
            piece = source.rows(start, stop)
            assert all((piece[name] == whole[name][start:stop]).all() for name in names)
    assert (drawn(4).rows(0, 9)["arm.payload"] != whole["arm.payload"][:9]).any()


def test_samples_have_the_distribution_that_is_asked_for():
    drawn = sweeps.samples(RIG, n=4096, within={"arm.length": (0.5, 0.9)}, parameters=None)
    assert drawn.names == ("arm.length",)
    values = drawn.rows(0, 4096)["arm.length"]
    assert values.min() >= 0.5
    assert values.max() <= 0.9
    assert values.mean() == pytest.approx(0.7, abs=1e-3)
    assert values.std() == pytest.approx(0.4 / np.sqrt(12), rel=1e-2)
    drawn = sweeps.samples(RIG, n=4096)
    assert set(drawn.names) == {n for n, p in RIG.parameters.items() if p.tol > 0.0}
    for name, values in drawn.rows(0, 4096).items():
        known = RIG.parameters[name]
        # The normal distribution cut at three standard deviations has 0.9866 of them left.
        assert values.mean() == pytest.approx(known.value, abs=0.01 * known.tol), name
        assert values.std() == pytest.approx(0.9866 * known.tol, rel=1e-2), name
        assert np.abs(values - known.value).max() <= 3.0 * known.tol * (1 + 1e-9), name


def test_a_sweep_draws_every_sample_once(tmp_path, monkeypatch):
    """However many chunks are in flight: going back would pass over all samples before."""
    engine = Mock(wraps=sweeps.DrawnSamples._engine)
    monkeypatch.setattr(sweeps.DrawnSamples, "_engine", lambda self: engine(self))
    drawn = sweeps.samples(RIG, PLANT, 24, 1)
    with ThreadPoolExecutor(2) as pool:
        small(tmp_path / "out.zarr", drawn, chunk=2, executor=pool)
    assert engine.call_count == 2  # for the run that tries the arguments, and for all chunks


def test_a_sweep_over_samples_is_cut_and_resumed_like_any(tmp_path):
    drawn = sweeps.samples(RIG, PLANT, 23, 1)
    data = small(tmp_path / "a.zarr", drawn, chunk=5)
    rows = drawn.rows(0, 23)
    assert data["arm.payload"].values.tolist() == rows["arm.payload"].tolist()
    assert data["arm.payload"].attrs["units"] == "kg"
    # The same runs as a table are another plan with the same numbers.
    table = small(tmp_path / "b.zarr", sweeps.Samples(rows), chunk=23)
    same(data, table)
    again = sweeps.samples(RIG, PLANT, 23, 2)
    with pytest.raises(pamrs.ParameterError, match="seed 1 in the store, .*seed 2 now"):
        small(tmp_path / "a.zarr", again, chunk=5)


def test_samples_that_cannot_be_say_why():
    for arguments, message in rows_of(__file__, "samples_that_cannot_be_say_why"):
        refused((message, lambda arguments=arguments: sweeps.samples(RIG, **arguments)))
    uneven = {"arm.payload": [1.0, 2.0], "arm.viscous": [1.0]}
    refused(("arm.payload has 2, arm.viscous has 1", lambda: sweeps.Samples(uneven)))


SEALED = pamrs.rigs.named("sealed_chamber")
SUM = {"initial.muscle_pressure": (1e5, 1.3e5), "sensors.pressure_zero": (-1e4, 1e4)}


def shares(tmp_path, method, n, **changes):
    """A sealed chamber reads its first pressure and its sensor's zero: a sum of two numbers."""
    pytest.importorskip("SALib")
    arguments = {
        "metrics": {"p": ("final", "muscle_pressure"), "joint": ("final", "air_volume")},
        "within": SUM,
        "sample_time": 0.01,
        "duration": 0.02,
        "progress": False,
        **changes,
    }
    return sweeps.sensitivity(SEALED, method=method, n=n, store=tmp_path / "out.zarr", **arguments)


def test_the_indices_of_a_sum_are_the_shares_of_its_variance(tmp_path):
    found = shares(tmp_path, "sobol", 512)
    assert found["parameter"].values.tolist() == list(SUM)
    widths = {name: high - low for name, (low, high) in SUM.items()}
    total = sum(width**2 for width in widths.values())
    expected = [width**2 / total for width in widths.values()]
    assert found["p.S1"].values == pytest.approx(expected, abs=0.03)
    assert found["p.ST"].values == pytest.approx(expected, abs=0.03)
    assert np.isnan(found["joint.ST"].values).all()  # the volume of a chamber stays
    assert found.attrs["runs"] == 512 * 4
    assert found.attrs["groups_used"] == 512
    assert found["p.ST"].attrs["units"] == "1"
    again = shares(tmp_path, "sobol", 512)
    assert again["p.ST_conf"].values.tolist() == found["p.ST_conf"].values.tolist()


def test_elementary_effects_of_a_sum_are_its_ranges(tmp_path):
    found = shares(tmp_path, "morris", 6)
    widths = [high - low for low, high in SUM.values()]
    assert found["p.mu"].values == pytest.approx(widths, rel=1e-6)
    assert found["p.mu_star"].values == pytest.approx(widths, rel=1e-6)
    assert found["p.sigma"].values == pytest.approx([0.0, 0.0], abs=1e-3)
    assert found["p.mu"].attrs["units"] == "Pa"


def test_groups_with_a_run_that_ended_are_left_out(tmp_path):
    pytest.importorskip("SALib")
    rig = pamrs.rigs.shoulder()
    arguments = {
        "metrics": {"end": ("final", "joint_angle")},
        "method": "sobol",
        "sample_time": 0.005,
        "valve_command": np.full(11, 5.5),
        "progress": False,
    }
    within = {"initial.joint_rate": (-50.0, 0.0), "arm.payload": (5.0, 9.0)}
    found = sweeps.sensitivity(rig, within=within, n=16, store=tmp_path / "some.zarr", **arguments)
    assert found.attrs["runs_ended"] > 0
    assert 8 < found.attrs["groups_used"] < 16
    assert np.isfinite(found["end.ST"].values).all()
    within["initial.joint_rate"] = (-90.0, -60.0)
    with pytest.raises(pamrs.ParameterError, match="of 4 groups have a run that ended"):
        sweeps.sensitivity(rig, within=within, n=4, store=tmp_path / "all.zarr", **arguments)


def test_a_sensitivity_that_cannot_be_says_why(tmp_path):
    def asked(**changes):
        metrics, kept = {"p": ("final", "muscle_pressure")}, {"store": tmp_path / "out.zarr"}
        return lambda: sweeps.sensitivity(SEALED, metrics, within=SUM, **kept, **changes)

    refused(
        ("method = 'fast' is not allowed", asked(method="fast")),
        ("n = 1 is not allowed", asked(n=1)),
        ("n = 100 is not allowed: a power of two", asked(n=100)),
        ("seed = 0.5", asked(seed=0.5)),
    )
