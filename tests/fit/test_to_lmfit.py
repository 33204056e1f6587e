"""Fits handed on to lmfit."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.errors import MissingPackageError

lmfit = pytest.importorskip("lmfit")
MUSCLE = pamrs.rigs.shoulder().muscle


@pytest.fixture(scope="module")
def fit() -> Any:
    assert MUSCLE is not None
    contraction = np.linspace(0.0, 0.2, 15)
    pressure, shortened = (
        one.ravel() for one in np.meshgrid([2e5, 4e5, 6e5], contraction, indexing="ij")
    )
    rest = MUSCLE.parameters["rest_length"]
    noise = np.random.default_rng(3).normal(0.0, 4.0, pressure.size)
    force = MUSCLE.force(pressure, shortened) + noise
    data = pamrs.fit.ForceMap.from_arrays(
        length=(1.0 - shortened) * rest, pressure=pressure, force=force, rest_length=rest
    )
    return pamrs.fit.fit_muscle(data, MUSCLE, order=2)


def test_values_errors_and_correlations_are_those_of_the_fit(fit: Any) -> None:
    found = fit.to_lmfit()
    assert isinstance(found, lmfit.Parameters)
    assert list(found) == list(fit.params)
    spread = np.sqrt(np.diag(fit.covar))
    for name, item in fit.params.items():
        assert (found[name].value, found[name].stderr) == (item.value, item.stderr)
        assert found[name].user_data["unit"] == item.unit
    first, second, *_ = fit.params
    expected = fit.covar[0, 1] / (spread[0] * spread[1])
    assert found[first].correl[second] == pytest.approx(expected)
    assert abs(expected) < 1.0
    assert str(lmfit.fit_report(found)).count("+/-") == len(found)
    assert lmfit.Parameters().loads(found.dumps())[first].value == found[first].value


def test_a_missing_lmfit_is_named(fit: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "lmfit", None)
    with pytest.raises(MissingPackageError, match=r"pip install 'pamrs\[lmfit\]'"):
        fit.to_lmfit()
