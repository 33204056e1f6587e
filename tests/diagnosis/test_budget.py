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


def shares(
    before: Excess, stages: list[_Stage], refitted: Excess | None = None
) -> tuple[list[float], float]:
    """Shares of the terms, and of what is unexplained."""
    found = _Shares(before, stages, refitted, SETTINGS)
    return [found.of(k)[0] for k in range(len(stages))], found.unexplained()[0]


RATIO = st.floats(1.0, 1e4)


@given(
    before=st.floats(2.0, 1e5),
    kept=st.tuples(RATIO, RATIO, RATIO),
    others=st.tuples(RATIO, RATIO),
    after=RATIO,
    acts=st.tuples(st.booleans(), st.booleans()),
    holds=st.tuples(st.booleans(), st.booleans()),
)
def test_shares_of_a_block_add_up_to_one(
    before: float,
    kept: tuple[float, float, float],
    others: tuple[float, float],
    after: float,
    acts: tuple[bool, bool],
    holds: tuple[bool, bool],
) -> None:
    # with models that do not hold, names that do not act here, and some that predict worse
    alone, without = (
        excess(r, 2.0 * r) if there else None for r, there in zip(others, holds, strict=True)
    )
    terms, rest = shares(
        excess(before, 2.0 * before),
        [
            _Stage("parameters", "", excess(kept[0], kept[0])),
            _Stage("effect", "a", excess(kept[2], kept[2]), acts[0], alone, without),
            _Stage("effect", "b", excess(after, after), acts[1], without, alone),
        ],
        excess(kept[1], kept[1]),
    )
    assert sum(terms) + rest == pytest.approx(1.0, abs=1e-9)
    if any(acts):
        assert terms[1] * terms[2] >= 0.0, "names divide what they take together"
        assert all(share == 0.0 for share, own in zip(terms[1:], acts, strict=True) if not own)


def kept(left: float) -> Excess:
    """What a block keeps beyond the noise, the same in two pieces."""
    return excess(1.0 + left, 1.0 + left)


def test_names_divide_what_they_take_together_by_what_each_does() -> None:
    # of 100 that parameters leave, one name takes 64 and the other 36, in either order
    first = _Stage("parameters", "", kept(100.0))
    one = _Stage("effect", "a", kept(36.0), True, kept(36.0), kept(64.0))
    other = _Stage("effect", "b", kept(0.0), True, kept(64.0), kept(36.0))
    terms, rest = shares(kept(200.0), [first, one, other], kept(100.0))
    assert terms == pytest.approx([0.5, 0.32, 0.18])
    assert rest == pytest.approx(0.0)


@pytest.mark.parametrize("foreign", [0, 1])
def test_a_name_of_another_block_takes_nothing(foreign: int) -> None:
    # the other parameters bend towards what is missing, whichever name stands first
    here = _Stage("effect", "a", kept(0.0), True, kept(0.0), kept(100.0))
    away = _Stage("wrong_parameter", "b", kept(0.0 if foreign else 60.0), False, kept(60.0), None)
    names = [here, away] if foreign else [away, here]
    terms, _ = shares(kept(200.0), [_Stage("parameters", "", kept(100.0)), *names], kept(100.0))
    assert terms[0] == pytest.approx(0.5)
    assert terms[1 + names.index(here)] == pytest.approx(0.5)
    assert terms[1 + names.index(away)] == 0.0


def test_a_model_that_does_not_hold_is_left_out() -> None:
    # alone the first name leaves the range of the model, beside the other one it takes nothing
    first = _Stage("parameters", "", kept(100.0))
    one = _Stage("effect", "a", kept(100.0), True, None, kept(1.0))
    other = _Stage("effect", "b", kept(0.0), True, kept(1.0), None)
    terms, _ = shares(kept(200.0), [first, one, other], kept(100.0))
    assert terms == pytest.approx([0.5, 0.005, 0.495])


def test_a_share_has_an_interval_over_the_pieces() -> None:
    stages = [_Stage("parameters", "", excess(1.0, 91.0, 2.0))]
    found = _Shares(excess(11.0, 101.0, 12.0), stages, None, SETTINGS)
    share, (low, high) = found.of(0)
    assert low < share < high
    assert low > 0.1
    assert high < 1.0
