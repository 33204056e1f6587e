"""What ``make demo`` says of its case."""

from __future__ import annotations

from typing import Any

import pytest

from demo.run import judgement

KEY = {"verdict": "effects", "effects": ["leak_muscle"]}


def found(*names: str, chance: float = 0.9, sets: tuple[list[str], ...] = ()) -> dict[str, Any]:
    effects = [{"id": name, "probability": chance} for name in names]
    verdict = "effects" if names else "unlisted"
    return {"verdict": verdict, "effects": effects, "ambiguity": list(sets)}


@pytest.mark.parametrize(
    ("result", "said"),
    [
        (found("leak_muscle"), "The verdict is right."),
        (
            found("leak_muscle", chance=0.4, sets=(["leak_muscle"], ["unlisted"], ["valve_area"])),
            "The verdict is right, but not settled: an effect outside the catalogue and valve_area "
            "also stand.",
        ),
        (
            found("leak_muscle", chance=0.41),
            "The verdict is right, but not settled: its probability is 0.41.",
        ),
        (found("heat_transfer"), "The first answer is NOT the truth this time."),
        (
            found(sets=(["unlisted"], ["leak_muscle"])),
            "The first answer is NOT the truth this time, but the diagnosis leaves it open, and "
            "the truth is among what stands.",
        ),
    ],
)
def test_an_answer_that_is_not_settled_is_not_called_simply_right(
    result: dict[str, Any], said: str
) -> None:
    assert judgement(KEY, result) == said
