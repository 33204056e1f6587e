"""Results as tables of pandas and xarray, with units."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.errors import MissingPackageError
from tests.core.test_views import made

pytest.importorskip("pandas")
pytest.importorskip("xarray")


@pytest.mark.parametrize("name", ["simulation", "recording", "loop"])
def test_channels_over_time_with_their_units(name: str) -> None:
    thing = made(name)
    frame, data = thing.to_pandas(), thing.to_xarray()
    values = thing if name == "simulation" else thing.channels
    assert list(data) == list(frame.columns)
    for column, unit in {"muscle_pressure": "Pa", "joint_angle": "rad"}.items():
        assert np.array_equal(frame[column], values[column])
        assert np.array_equal(data[column], values[column])
        assert frame.attrs["units"][column] == data[column].attrs["units"] == unit
    assert frame.index.name == "time"
    assert np.array_equal(frame.index, thing.time)
    assert np.array_equal(data["time"], thing.time)
    assert frame.attrs["units"]["time"] == data["time"].attrs["units"] == "s"


def test_plants_of_a_batch_are_a_dimension_of_their_own() -> None:
    batch = made("batch")
    data, frame = batch.to_xarray(), batch.to_pandas()
    assert dict(data.sizes) == {"plant": 2, "time": batch.time.size}
    assert np.array_equal(data["joint_angle"], batch["joint_angle"])
    assert np.array_equal(frame["joint_angle"].unstack("time"), batch["joint_angle"])
    assert data["joint_angle"].attrs["units"] == frame.attrs["units"]["joint_angle"] == "rad"
    reduced = made("reduced")
    assert np.array_equal(reduced.to_xarray()["highest"], reduced.reduced["highest"])
    assert reduced.to_pandas().index.names == ["plant"]


def test_gains_of_a_map_are_dimensions() -> None:
    gains = made("gain map")
    data, frame = gains.to_xarray(), gains.to_pandas()
    assert data["j"].dims == ("payload", "kp")
    assert np.array_equal(data["j"], gains.j)
    best = gains.best()[0]
    assert float(data["j"].sel(payload=0.5, kp=best["kp"])) == best["j"]
    assert frame.loc[(0.5, best["kp"]), "rms"] == best["rms"]
    assert (data["payload"].attrs["units"], frame.attrs["units"]["rms"]) == ("kg", "rad")


@pytest.mark.parametrize("to", ["to_pandas", "to_xarray"])
def test_a_recording_goes_out_and_comes_back(to: str) -> None:
    own = made("recording")
    table = getattr(own, to)()
    (back,) = pamrs.Case.from_arrays(pamrs.rigs.shoulder(), {"first": table}).recordings
    for name, values in own.channels.items():
        assert np.allclose(back.channels[name], values, rtol=1e-12)


@pytest.mark.parametrize(("to", "package"), [("to_pandas", "pandas"), ("to_xarray", "xarray")])
def test_what_is_not_installed_is_named(to: str, package: str, monkeypatch: Any) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingPackageError, match=r"pip install 'pamrs\[io\]'"):
        getattr(made("simulation"), to)()
