"""How often resampled recordings lead to the same effects."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.fit import Start
from pamrs.diagnosis.screen import Screen, Tangent, inclusion_shares
from pamrs.effects import Term
from tests.diagnosis.terms import by_text

SETTINGS = DiagnosisSettings()

Array = NDArray[np.float64]
ROWS = 6000


def screened(
    rows: Array, signatures: dict[str, Array], jacobian: Array | None = None, moved: float = 0.0
) -> Screen:
    """A screen of made-up signatures, each of an effect of one positive size, beside parameters
    with priors.
    """
    slopes = np.zeros((rows.size, 0)) if jacobian is None else jacobian
    count = slopes.shape[1]
    normal = slopes.T @ slopes + np.eye(count)
    left = rows - slopes @ np.linalg.solve(normal, slopes.T @ rows + moved)
    tangent = Tangent(
        rows,
        left,
        slopes,
        np.full(count, moved),
        np.ones(count),
        slopes @ np.linalg.cholesky(np.linalg.inv(normal)),
    )
    return Screen(
        tangent,
        [
            (Term(e), Start(Term(e), {f"{e}.size": 1.0}, {}, (f"{e}.size",), False), s)
            for e, s in signatures.items()
        ],
    )


def shares(*given: Any) -> dict[str, float]:
    """How often each effect is taken."""
    return by_text(inclusion_shares(*given))


def waves(count: int) -> list[Array]:
    """Signals that have nothing in common."""
    time = np.arange(ROWS)
    return [np.sin(2e-3 * (k + 1) * time + k) for k in range(count)]


def test_an_effect_that_is_there_is_always_taken_and_one_that_is_not_hardly_ever() -> None:
    there, absent = waves(2)
    rows = np.random.default_rng(5).normal(size=ROWS) - 0.3 * there
    found = shares(screened(rows, {"there": there, "absent": absent}), 12.0, 0.01, SETTINGS)
    assert found["there"] == 1.0
    assert found.get("absent", 0.0) < 0.1


def test_a_second_effect_is_taken_beside_the_first() -> None:
    first, second = waves(2)
    rows = np.random.default_rng(6).normal(size=ROWS) - 0.5 * first - 0.3 * second
    both = shares(screened(rows, {"first": first, "second": second}), 12.0, 0.01, SETTINGS)
    assert min(both.values()) == 1.0
    assert shares(screened(rows, {"first": first, "second": second}), 12.0, 1.0, SETTINGS) == {
        "first": 1.0
    }


def test_twins_share_the_resamples() -> None:
    common, own, other = waves(3)
    rows = np.random.default_rng(7).normal(size=ROWS) - 0.5 * common
    found = shares(
        screened(rows, {"one": common + 0.02 * own, "twin": common + 0.02 * other}),
        12.0,
        1.0,
        SETTINGS,
    )
    assert 0.02 < found["one"] < 0.98
    assert abs(found["one"] + found["twin"] - 1.0) < 1e-9


def test_what_a_parameter_does_is_no_effect_unless_it_is_held() -> None:
    signal, _ = waves(2)
    noise = np.random.default_rng(8).normal(size=ROWS)
    # a parameter with little prior information has taken the signal up: the residual is noise, the
    # pull of its prior is nothing
    taken = screened(noise, {"effect": signal}, 50.0 * signal[:, None])
    assert shares(taken, 12.0, 1.0, SETTINGS).get("effect", 0.0) < 0.05
    assert shares(
        screened(noise - signal, {"effect": signal}, 1e-3 * signal[:, None]), 12.0, 1.0, SETTINGS
    ) == {"effect": 1.0}


def test_nothing_to_choose_from_is_nothing() -> None:
    assert shares(screened(np.zeros(0), {}), 12.0, 0.01, SETTINGS) == {}
    assert shares(screened(np.ones(ROWS), {}), 12.0, 0.01, SETTINGS) == {}
