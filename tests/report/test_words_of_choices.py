"""Values that are choices, in words."""

from __future__ import annotations

import pytest

from pamrs.findings import EffectFound, EffectParameterFound
from pamrs.report.sentences import value_words


@pytest.mark.parametrize(
    ("value", "said"), [(1.0, "the gauge is at the valve"), (0.0, "the gauge is behind the hose")]
)
def test_the_place_of_a_gauge_is_said(value: float, said: str) -> None:
    own = {
        "tap": EffectParameterFound(value, None, "1"),
        "conductance": EffectParameterFound(1e-8, 1e-9, "m3/(s Pa)"),
    }
    effect = EffectFound("tube_flow_restriction", probability=0.9, name="hose", parameters=own)
    assert value_words(effect, "tap") == said
    assert value_words(effect, "conductance") == ""
