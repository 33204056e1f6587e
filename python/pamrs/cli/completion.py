"""Names that a shell completes; commands and options are completed by typer."""

from __future__ import annotations

from collections.abc import Callable, Iterable


def beginning(names: Callable[[], Iterable[str]]) -> Callable[[str], list[str]]:
    """Completion by those of some names that begin with a text."""
    return lambda incomplete: [name for name in names() if name.startswith(incomplete)]


def effect_ids() -> Iterable[str]:
    """Ids of all effects."""
    from pamrs.effects import CATALOGUE

    return CATALOGUE
