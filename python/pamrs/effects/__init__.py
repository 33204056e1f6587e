"""The catalogue of omitted physics: id, block, equation, parameters, fingerprint and rivals of each
effect.

Equations, parameters, bounds and sources stand in the core, one file for each effect
(``crates/pam-core/src/effects``), and its words here in ``words/ID.toml``. Public are
:data:`EFFECTS`, :data:`CATALOGUE`, the types of their entries, and :mod:`pamrs.effects.text`.
"""

from __future__ import annotations

from pamrs.effects._catalogue import (
    CATALOGUE,
    CLOSURE_OF,
    EFFECTS,
    MEMORY_OF,
    TERMS,
    WORDS,
    find_parameter,
    ports_of,
)
from pamrs.effects._info import EffectInfo, EffectParameter, Form, SameData, Term, Words

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
    "find_parameter",
    "ports_of",
]
