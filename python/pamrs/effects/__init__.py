"""The catalogue of omitted physics: id, block, equation, parameters, fingerprint and rivals of each
effect.

Equations, parameters, bounds and sources are in the core, one file for each effect
(``crates/pam-core/src/effects``), and its words here in ``words/ID.toml``. Public are
:data:`EFFECTS`, :data:`CATALOGUE`, the types of their entries, what is said to be missing
(:class:`Term`, :class:`Hypothesis`), and :mod:`pamrs.effects.text`.
"""

from pamrs.effects._catalogue import (
    CATALOGUE,
    CLOSURE_OF,
    CLOSURE_TERMS,
    EFFECTS,
    MEMORY_OF,
    WORDS,
    ports_of,
)
from pamrs.effects._info import ClosureTerm, EffectInfo, EffectParameter, Form, SameData, Words
from pamrs.effects.hypotheses import (
    NONE,
    PARAMETERS,
    UNDECIDED,
    UNLISTED,
    WITHOUT_NAME,
    Hypothesis,
    Term,
    effect_of,
    find_parameter,
    usual_values,
)

__all__ = [
    "CATALOGUE",
    "CLOSURE_OF",
    "CLOSURE_TERMS",
    "EFFECTS",
    "MEMORY_OF",
    "NONE",
    "PARAMETERS",
    "UNDECIDED",
    "UNLISTED",
    "WITHOUT_NAME",
    "WORDS",
    "ClosureTerm",
    "EffectInfo",
    "EffectParameter",
    "Form",
    "Hypothesis",
    "SameData",
    "Term",
    "Words",
    "effect_of",
    "find_parameter",
    "ports_of",
    "usual_values",
]
