"""Keys of tables that people write (``case.toml``, the description of a force map): what each may
be, and what is wrong with a given table.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

__all__ = ["Rule", "holds", "is_finite", "is_name", "is_text", "problems_of", "unknown_key"]


class Rule(NamedTuple):
    """Rule for the value of a key in a table.

    Attributes
    ----------
    accepts : callable or None
        Whether a value, as TOML gives it, is allowed; None where its reader says so.
    needed : str
        The same in words, for messages: "a text".
    about : str
        What it is.
    """

    accepts: Callable[[Any], bool] | None
    needed: str
    about: str = ""


def is_finite(value: object) -> bool:
    """True for a finite number that is no flag."""
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer of hundreds of digits
        return False


def is_text(value: object) -> bool:
    """True for a text."""
    return isinstance(value, str)


def is_name(value: object) -> bool:
    """True for a text with a character at least."""
    return isinstance(value, str) and value != ""


def holds(kind: type | tuple[type, ...], accepts: Callable[[Any], bool]) -> Callable[[Any], bool]:
    """The rule of a list or table whose members, or values, are all accepted by another one."""

    def held(value: Any) -> bool:
        members = value.values() if isinstance(value, Mapping) else value
        return isinstance(value, kind) and all(map(accepts, members))

    return held


def unknown_key(prefix: str, name: str, allowed: Iterable[str]) -> str:
    """The message about a key that is not allowed, with what is near to it."""
    names = list(allowed)
    near = difflib.get_close_matches(str(name), names, n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"allowed: {', '.join(names)}"
    return f"unknown key {prefix + str(name)!r}; {hint}"


def problems_of(
    prefix: str,
    given: Mapping[str, Any],
    rules: Mapping[str, Rule],
    *,
    needed: Iterable[str] = (),
    skip: Iterable[str] = (),
) -> list[str]:
    """Problems of a table: keys that are unknown, missing, or not what their rules say.

    Parameters
    ----------
    prefix : str
        Text before a key in messages.
    given : mapping
        The table.
    rules : mapping of str to Rule
        What each key may be.
    needed, skip : iterable of str
        Keys that may not be missing, and those whose values are judged elsewhere.
    """
    found = [unknown_key(prefix, key, rules) for key in given if key not in rules]
    for key, rule in rules.items():
        asked = (key in given or key in needed) and key not in skip
        if asked and rule.accepts and not rule.accepts(given.get(key)):
            value = f"{prefix}{key} = {given.get(key)!r}"
            found.append(f"{value} is not allowed: {rule.needed} is needed")
    return found
