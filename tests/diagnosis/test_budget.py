"""Laws of the shares of a budget."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.explain._budget import _Shares, _Stage
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
    before=st.floats(2.0, 1e5), kept=st.tuples(RATIO, RATIO, RATIO), others=st.tuples(RATIO, RATIO)
)
def test_shares_of_a_block_add_up_to_one(
    before: float, kept: tuple[float, float, float], others: tuple[float, float]
) -> None:
    after = min(*kept, *others)  # what all terms leave is the least
    alone, without = (excess(r, 2.0 * r) for r in others)
    terms, rest = shares(
        excess(before, 2.0 * before),
        [
            _Stage("parameters", "", excess(kept[0], kept[0]), excess(kept[1], kept[1]), None),
            _Stage("effect", "leak_muscle", excess(kept[2], kept[2]), alone, without),
            _Stage("effect", "heat_transfer", excess(after, after), without, alone),
        ],
    )
    assert sum(terms) + rest == pytest.approx(1.0, abs=1e-9)
    if kept[0] >= after:
        assert min(terms[1:]) >= 0.0, "a name takes what the model with it takes"


def test_names_divide_what_they_take_together_by_what_each_does() -> None:
    # of 100 that parameters leave, one name takes 64 and the other 36, in either order
    one, other, none, all_of_them = (excess(1.0 + r, 1.0 + r) for r in (36.0, 64.0, 100.0, 0.0))
    terms, rest = shares(
        excess(201.0, 201.0),
        [
            _Stage("parameters", "", none, none, None),
            _Stage("effect", "leak_muscle", one, one, other),
            _Stage("effect", "heat_transfer", all_of_them, other, one),
        ],
    )
    assert terms == pytest.approx([0.5, 0.32, 0.18])
    assert rest == pytest.approx(0.0)
    # a name of another block takes nothing here
    terms, _ = shares(
        excess(201.0, 201.0),
        [
            _Stage("parameters", "", none, none, None),
            _Stage("effect", "leak_muscle", all_of_them, all_of_them, none),
            _Stage("effect", "muscle_creep", all_of_them, None, None),
        ],
    )
    assert terms == pytest.approx([0.5, 0.5, 0.0])


def test_a_share_has_an_interval_over_the_pieces() -> None:
    stages = [_Stage("parameters", "", excess(1.0, 91.0, 2.0), None, None)]
    found = _Shares(excess(11.0, 101.0, 12.0), stages, SETTINGS)
    share, (low, high) = found.of(0)
    assert low < share < high
    assert low > 0.1
    assert high < 1.0
