"""How often resampled recordings lead to the same effects."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pamrs.diagnosis.fit import Start
from pamrs.diagnosis.screen import Screen, Tangent, inclusion_shares
from pamrs.effects import Term
from tests.diagnosis.asked import SETTINGS
from tests.diagnosis.terms import by_text

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
    basis = slopes @ np.linalg.cholesky(np.linalg.inv(normal))
    tangent = Tangent(rows, left, slopes, np.full(count, moved), np.ones(count), basis)
    found = []
    for effect, signature in signatures.items():
        size = f"{effect}.size"
        start = Start(Term(effect), {size: 1.0}, {}, (size,), False)
        found.append((Term(effect), start, signature))
    return Screen(tangent, found)


def shares(screened: Screen, price: float = 1.0) -> dict[str, float]:
    """How often each effect is taken."""
    return by_text(inclusion_shares(screened, 12.0, price, SETTINGS))


def waves(count: int) -> list[Array]:
    """Signals that have nothing in common."""
    time = np.arange(ROWS)
    return [np.sin(2e-3 * (k + 1) * time + k) for k in range(count)]


def test_an_effect_that_is_there_is_always_taken_and_one_that_is_not_hardly_ever() -> None:
    there, absent = waves(2)
    rows = np.random.default_rng(5).normal(size=ROWS) - 0.3 * there
    found = shares(screened(rows, {"there": there, "absent": absent}), 0.01)
    assert found["there"] == 1.0
    assert found.get("absent", 0.0) < 0.1


def test_a_second_effect_is_taken_beside_the_first() -> None:
    first, second = waves(2)
    rows = np.random.default_rng(6).normal(size=ROWS) - 0.5 * first - 0.3 * second
    made = screened(rows, {"first": first, "second": second})
    assert min(shares(made, 0.01).values()) == 1.0
    assert shares(made) == {"first": 1.0}


def test_twins_share_the_resamples() -> None:
    common, own, other = waves(3)
    rows = np.random.default_rng(7).normal(size=ROWS) - 0.5 * common
    twins = {"one": common + 0.02 * own, "twin": common + 0.02 * other}
    found = shares(screened(rows, twins))
    assert 0.02 < found["one"] < 0.98
    assert abs(found["one"] + found["twin"] - 1.0) < 1e-9


def test_what_a_parameter_does_is_no_effect_unless_it_is_held() -> None:
    signal, _ = waves(2)
    noise = np.random.default_rng(8).normal(size=ROWS)
    # a parameter with little prior information has taken the signal up: the residual is noise, the
    # pull of its prior is nothing
    taken = screened(noise, {"effect": signal}, 50.0 * signal[:, None])
    assert shares(taken).get("effect", 0.0) < 0.05
    held = screened(noise - signal, {"effect": signal}, 1e-3 * signal[:, None])
    assert shares(held) == {"effect": 1.0}


def test_nothing_to_choose_from_is_nothing() -> None:
    for rows in (np.zeros(0), np.ones(ROWS)):
        assert shares(screened(rows, {}), 0.01) == {}
