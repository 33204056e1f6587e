"""Laws of the shares of a budget."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.model._budget import _Shares, _Stage
from pamrs.diagnosis.noise import Excess

SETTINGS = DiagnosisSettings()


def excess(*ratios: float) -> Excess:
    """What a block keeps in as many pieces of 20 bins each."""
    return Excess(
        float(np.mean(ratios)), 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, tuple((r, 20) for r in ratios)
    )


def shares(before: Excess, stages: list[_Stage]) -> tuple[list[float], float]:
    """Shares of the terms, and of what is unexplained."""
    found = _Shares(before, stages, SETTINGS)
    return [found.of(k)[0] for k in range(len(stages))], found.unexplained()[0]


RATIO = st.floats(1.0, 1e4)


@given(
    before=st.floats(2.0, 1e5),
    kept=st.tuples(RATIO, RATIO, RATIO),
    changes=st.tuples(RATIO, RATIO),
    holds=st.tuples(st.booleans(), st.booleans()),
)
def test_shares_of_a_block_add_up_to_one(
    before: float,
    kept: tuple[float, float, float],
    changes: tuple[float, float],
    holds: tuple[bool, bool],
) -> None:
    # with names that cannot be taken away, and models that predict worse
    one, other = (
        excess(r, 2.0 * r) if there else None for r, there in zip(changes, holds, strict=True)
    )
    terms, rest = shares(
        excess(before, 2.0 * before),
        [
            _Stage("parameters", "", excess(kept[0], kept[0])),
            _Stage("effect", "a", excess(kept[1], kept[1]), True, one),
            _Stage("effect", "b", excess(kept[2], kept[2]), True, other),
        ],
    )
    assert sum(terms) + rest == pytest.approx(1.0, abs=1e-9)
    assert terms[1] * terms[2] >= 0.0, "names divide what they take together"


def left(beyond: float) -> Excess:
    """What a block keeps beyond the noise, the same in two pieces."""
    return excess(1.0 + beyond, 1.0 + beyond)


def test_names_divide_what_they_take_together_by_what_each_changes() -> None:
    # of 100 that parameters leave, the names take all, though one hides much of the other
    first = _Stage("parameters", "", left(100.0))
    one = _Stage("effect", "a", left(900.0), True, excess(600.0, 600.0))
    other = _Stage("effect", "b", left(0.0), True, excess(400.0, 400.0))
    terms, rest = shares(left(200.0), [first, one, other])
    assert terms == pytest.approx([0.5, 0.3, 0.2])
    assert rest == pytest.approx(0.0)


@pytest.mark.parametrize("foreign", [0, 1])
def test_a_name_of_another_block_takes_nothing(foreign: int) -> None:
    here = _Stage("effect", "a", left(0.0), True, excess(100.0, 100.0))
    away = _Stage("wrong_parameter", "b", left(0.0 if foreign else 100.0), False)
    names = [here, away] if foreign else [away, here]
    terms, _ = shares(left(200.0), [_Stage("parameters", "", left(100.0)), *names])
    assert terms[0] == pytest.approx(0.5)
    assert terms[1 + names.index(here)] == pytest.approx(0.5)
    assert terms[1 + names.index(away)] == 0.0


def test_a_share_has_an_interval_over_the_pieces() -> None:
    stages = [_Stage("parameters", "", excess(1.0, 91.0, 2.0))]
    found = _Shares(excess(11.0, 101.0, 12.0), stages, SETTINGS)
    share, (low, high) = found.of(0)
    assert low < share < high
    assert low > 0.1
    assert high < 1.0
