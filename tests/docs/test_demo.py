"""What ``make demo`` says of its case."""

from __future__ import annotations

from typing import Any

import pytest

from demo.run import judgement
from tests.tables import rows_of

KEY = {"verdict": "effects", "effects": ["leak_muscle"]}


def found(*names: str, chance: float = 0.9, sets: tuple[list[str], ...] = ()) -> dict[str, Any]:
    effects = [{"id": name, "probability": chance} for name in names]
    verdict = "effects" if names else "unlisted"
    return {"verdict": verdict, "effects": effects, "ambiguity": list(sets)}


@pytest.mark.parametrize(
    ("result", "said"),
    rows_of(__file__, "an_answer_that_is_not_settled_is_not_called_simply_right"),
)
def test_an_answer_that_is_not_settled_is_not_called_simply_right(
    result: dict[str, Any], said: str
) -> None:
    assert judgement(KEY, result) == said
