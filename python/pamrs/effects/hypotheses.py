"""Terms, each something that may be missing or wrong, and hypotheses, which are sets of them.

A term is an effect, at one block or at every one of its kind, or a value of the rig file. Results
hold both as text: an effect at one block has the block's name behind an ``@``, the terms of a
hypothesis are joined by ``+`` (``leak_muscle@flexor+chamber.dead_volume``). A dotted name of an
effect's parameter begins with the effect: ``leak_muscle@flexor.conductance``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, Final, TypeVar

from pamrs.effects._catalogue import EFFECTS
from pamrs.effects._info import EffectInfo, EffectParameter
from pamrs.findings import HEALTHY

__all__ = [
    "NONE",
    "PARAMETERS",
    "UNDECIDED",
    "UNLISTED",
    "WITHOUT_NAME",
    "Hypothesis",
    "Term",
    "effect_of",
    "find_parameter",
    "usual_values",
]

_Value = TypeVar("_Value")


@dataclass(frozen=True, order=True)
class Term:
    """An effect, or a value of the rig file.

    The form in which an effect was fitted does not belong to it: of two forms of an effect a
    hypothesis keeps the one that predicts better.

    Attributes
    ----------
    id : str
        Id of the effect, or dotted name of the parameter of the rig file.
    at : str
        Name of the block at which the effect acts; empty where it acts at every one of its kind.

    Examples
    --------
    >>> Term.parse("leak_muscle@flexor")
    Term(id='leak_muscle', at='flexor')
    >>> str(Term("leak_muscle", "flexor")), Term.parse("chamber.dead_volume").is_effect
    ('leak_muscle@flexor', False)
    """

    id: str
    at: str = ""

    @classmethod
    def parse(cls, text: str) -> Term:
        """The term of a text such as ``leak_muscle@flexor`` or ``chamber.dead_volume``."""
        if "." in text:
            return cls(text)
        effect, _, at = text.partition("@")
        return cls(effect, at)

    @classmethod
    def of(cls, entry: Mapping[str, Any]) -> Term:
        """The term of an effect of a rig, as :attr:`pamrs.Rig.effects` lists it."""
        return cls(entry["id"], entry.get("at", ""))

    def __str__(self) -> str:
        return f"{self.id}@{self.at}" if self.at else self.id

    @property
    def is_effect(self) -> bool:
        """True for an effect of the catalogue, or a closure."""
        return self.id in EFFECTS

    @property
    def is_value(self) -> bool:
        """True for a value of the rig file."""
        return "." in self.id

    @property
    def info(self) -> EffectInfo:
        """Entry of the effect in the catalogue; KeyError for a value."""
        return EFFECTS[self.id]

    def own(self, values: Mapping[str, _Value]) -> dict[str, _Value]:
        """Values of the effect's parameters by short name, out of a table by dotted names."""
        begin = f"{self}."
        return {n.removeprefix(begin): v for n, v in values.items() if n.startswith(begin)}

    def excluded_by(self, others: Iterable[Term]) -> bool:
        """True where the term cannot act together with others: it is one of them, or both are of
        one effect and one acts everywhere.
        """
        return any(
            self.id == other.id and (self == other or not self.at or not other.at)
            for other in others
        )


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A set of terms, and what is said with them or in their absence.

    Two hypotheses are equal if they have the same terms, in whatever order, and the same `rest`.

    Attributes
    ----------
    terms : tuple of Term
        In the order in which they are shown.
    rest : str
        ``none`` (nothing is missing), ``parameters`` (values moved inside their tolerances),
        ``unlisted`` (something without a name is missing; it may come with terms), or empty.

    Examples
    --------
    >>> found = Hypothesis.parse("payload_swing+leak_muscle@flexor")
    >>> found == Hypothesis.parse("leak_muscle@flexor+payload_swing"), str(found)
    (True, 'payload_swing+leak_muscle@flexor')
    """

    terms: tuple[Term, ...] = ()
    rest: str = ""

    @classmethod
    def of(cls, words: Iterable[str]) -> Hypothesis:
        """The hypothesis of texts of terms, and of ``none``, ``parameters`` or ``unlisted``."""
        every = [word.strip() for word in words]
        terms = tuple(Term.parse(word) for word in every if word not in _RESTS)
        return cls(terms, next((word for word in every if word in _RESTS), ""))

    @classmethod
    def parse(cls, text: str) -> Hypothesis:
        """The hypothesis of a text of words that are joined by ``+``."""
        return cls.of(text.split("+") if text else ())

    @property
    def words(self) -> list[str]:
        """Texts of its terms, and its rest."""
        return [*map(str, self.terms), *([self.rest] if self.rest else [])]

    @cached_property
    def set(self) -> frozenset[Term]:
        """Terms as a set."""
        return frozenset(self.terms)

    def __str__(self) -> str:
        return "+".join(self.words)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Hypothesis):
            return NotImplemented
        return self.rest == other.rest and self.set == other.set

    def __hash__(self) -> int:
        return hash((self.set, self.rest))


_RESTS: Final = (*HEALTHY, "unlisted")

#: Nothing is missing, or parameters moved: which of the two is not yet decided.
UNDECIDED: Final = Hypothesis()
NONE: Final = Hypothesis(rest="none")
PARAMETERS: Final = Hypothesis(rest="parameters")
UNLISTED: Final = Hypothesis(rest="unlisted")
#: Hypotheses without a term that the verdict of a case can be.
WITHOUT_NAME: Final = (NONE, PARAMETERS, UNLISTED)


@cache
def effect_of(name: str) -> Term | None:
    """The effect to which a dotted parameter such as ``leak_muscle@flexor.conductance`` belongs;
    None for a parameter of the rig's own blocks.
    """
    term = Term.parse(name.partition(".")[0])
    return term if term.is_effect else None


def find_parameter(name: str) -> EffectParameter:
    """The parameter of a dotted name such as ``leak_muscle.conductance``, or of the same effect at
    one place, ``leak_muscle@flexor.conductance``; KeyError if there is none.
    """
    term, _, short = name.partition(".")
    forms = reversed(Term.parse(term).info.forms)
    return {p.name: p for form in forms for p in form.parameters}[short]


def usual_values(name: str, forms: Mapping[Term, str] | None = None) -> tuple[float, float] | None:
    """Mean and standard deviation of the usual values of a dotted effect parameter, by the form
    that its effect has (``forms``, the first where none is given); None where any value is usual.
    """
    begin, _, short = name.partition(".")
    term = Term.parse(begin)
    form = term.info.form((forms or {}).get(term, ""))
    return next((p.prior for p in form.parameters if p.name == short), None)
