"""Terms and hypotheses of tests, from and to text."""

from __future__ import annotations

from collections.abc import Mapping

from pamrs.effects import Hypothesis, Term


def terms(*texts: str) -> tuple[Term, ...]:
    """Terms of their texts."""
    return tuple(map(Term.parse, texts))


def by_text(found: Mapping[Hypothesis, float] | Mapping[Term, float]) -> dict[str, float]:
    """A table of hypotheses, or of terms, by their texts."""
    return {str(key): value for key, value in found.items()}


def of_texts(found: Mapping[str, float]) -> dict[Hypothesis, float]:
    """A table by the texts of hypotheses as one of hypotheses."""
    return {Hypothesis.parse(text): value for text, value in found.items()}
