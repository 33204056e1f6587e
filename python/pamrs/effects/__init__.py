"""The catalogue of omitted physics: id, block, equation, parameters, fingerprint and rivals of each
effect.

Equations, parameters, bounds and sources stand in the core, one file for each effect
(``crates/pam-core/src/effects``), and its words here in ``words/ID.toml``. Public are
:data:`EFFECTS`, :data:`CATALOGUE`, the types of their entries, what an effect at one of several
blocks is called (``term_of`` and its likes), and :mod:`pamrs.effects.text`.
"""

from __future__ import annotations

from pamrs.effects._catalogue import (
    CATALOGUE,
    CLOSURE_OF,
    EFFECTS,
    MEMORY_OF,
    TERMS,
    WORDS,
    ports_of,
)
from pamrs.effects._info import EffectInfo, EffectParameter, Form, SameData, Term, Words
from pamrs.effects._terms import (
    exclude,
    find_parameter,
    id_of,
    info_of,
    is_effect,
    place_of,
    term_in,
    term_of,
    usual_values,
)

__all__ = [
    "CATALOGUE",
    "CLOSURE_OF",
    "EFFECTS",
    "MEMORY_OF",
    "TERMS",
    "WORDS",
    "EffectInfo",
    "EffectParameter",
    "Form",
    "SameData",
    "Term",
    "Words",
    "exclude",
    "find_parameter",
    "id_of",
    "info_of",
    "is_effect",
    "place_of",
    "ports_of",
    "term_in",
    "term_of",
    "usual_values",
]
