"""Where an effect acts: at one side of a pair, at both, or at what the sides share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..effects import Effect

SIDES = ("flexor", "extensor")
BOTH = "both"
PLACES = (*SIDES, BOTH)
#: blocks that each side has, and what else acts at a side: in its gauge, or between its muscles and
#: the joint
_OWN = ("valve", "line", "chamber", "muscle")
_AT_A_SIDE = (
    "pressure_lag",
    "tendon_compliance",
    "moment_arm_error",
    "model_error.transmission",
    "model_error.muscle_pressure",
)


def has_place(family: str, block: str) -> bool:
    """Whether an effect of a family and block of the plant acts at a side."""
    return block in _OWN or family in _AT_A_SIDE


@dataclass(frozen=True)
class Placed:
    """An effect and where it acts: ``flexor``, ``extensor``, ``both`` (the same numbers at either,
    each with a memory of its own), or empty for what the sides share.
    """

    effect: Effect
    at: str = ""

    def __post_init__(self) -> None:
        if has_place(self.id, self.block) != (self.at in PLACES):
            raise ValueError(
                f"{self.id} at {self.at!r} is not allowed: one of {', '.join(PLACES)} where it "
                "acts at a side, else none"
            )

    @property
    def id(self) -> str:
        """Its family."""
        return self.effect.id

    @property
    def block(self) -> str:
        """Block of the plant in which it acts."""
        return self.effect.block

    @property
    def sides(self) -> tuple[str, ...]:
        """The sides at which it acts; none for what they share."""
        return SIDES if self.at == BOTH else (self.at,) if self.at else ()

    def scaled(self, factor: float) -> Placed:
        """The same there, as many times as large."""
        return Placed(self.effect.scaled(factor), self.at)

    def most(self) -> float:
        """Largest factor for :meth:`scaled` that is still physical."""
        return self.effect.most()

    def to_dict(self) -> dict[str, Any]:
        """Fields of the effect in SI units."""
        return self.effect.to_dict()
