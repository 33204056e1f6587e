"""How probable made-up hypotheses make a recording, by the variance that they leave."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

import pamrs
from pamrs.diagnosis.evidence import BlockLikelihood, FittedHypothesis
from pamrs.diagnosis.evidence._likelihood import _Covariance
from pamrs.diagnosis.fit import Fit
from pamrs.diagnosis.noise import Excess
from pamrs.effects import Hypothesis
from pamrs.rig import Parameter

BINS = 600
TIMES = 0.1 * np.arange(BINS)


@cache
def _covariance() -> _Covariance:
    return _Covariance([TIMES], [np.empty((BINS, 0))])


@cache
def _parts() -> tuple[np.ndarray, np.ndarray]:
    """White noise and an error that is correlated over a second, each of variance one."""
    rng = np.random.default_rng(5)
    white, smooth = rng.normal(size=(2, BINS))
    kept = np.exp(-0.1)
    for k in range(1, BINS):
        smooth[k] = kept * smooth[k - 1] + np.sqrt(1.0 - kept**2) * smooth[k]
    smooth -= white * (white @ smooth) / (white @ white)
    return white / np.sqrt(np.mean(white**2)), smooth / np.sqrt(np.mean(smooth**2))


def rows_of(ratio: float) -> np.ndarray:
    """A minute of bin means (n,) with so many times the variance of their noise."""
    white, smooth = _parts()
    return np.sqrt(min(ratio, 1.0)) * white + np.sqrt(max(ratio - 1.0, 0.0)) * smooth


@cache
def of_ratio(ratio: float) -> BlockLikelihood:
    """How probable such a minute is."""
    return _covariance().likelihood([rows_of(ratio)])


def leaving(kept: Mapping[str, Excess]) -> Callable[[], Mapping[str, BlockLikelihood]]:
    """That of what is left of each block."""
    return lambda: {block: of_ratio(found.ratio) for block, found in kept.items()}


def stated(
    values: Mapping[str, float], moved: Mapping[str, float], scales: Mapping[str, float]
) -> dict[str, Parameter]:
    """Parameters as a rig file states them, of values that moved by so many tolerances."""
    return {
        name: Parameter(
            name, values[name] - far * scales[name], "1", scales[name], -math.inf, math.inf
        )
        for name, far in moved.items()
        if name in values
    }


def made_up(
    rig: pamrs.Rig,
    key: str,
    left: dict[str, Excess],
    values: Mapping[str, float] | None = None,
    **fitted: Any,
) -> FittedHypothesis:
    """A hypothesis by its text that leaves so much of each block, fitted and held out; values of
    its fit may be given.
    """
    own = Hypothesis.parse(key).terms
    effects = tuple(term for term in own if term.is_effect)
    wrong = tuple(term.id for term in own if term.is_value)
    known = dict(values or {})
    usual = {
        "std": {},
        "covariance": np.zeros((len(known), len(known))),
        "scales": dict.fromkeys(known, 1.0),
        "freed": wrong,
    }
    given = usual | fitted
    before = stated(known, given.get("moved", {}), given["scales"])
    fit = Fit(effects, rig, known, cost=0.0, residuals={}, known=before, **given)
    return FittedHypothesis(effects, fit, left, left, 0.0, wrong=wrong, likelihood=leaving(left))
