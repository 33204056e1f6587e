"""Names that a shell completes; commands and options are completed by typer."""

from __future__ import annotations

from collections.abc import Iterable


def _beginning(names: Iterable[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]


def effect_ids(incomplete: str) -> list[str]:
    """Ids of effects that begin with a text."""
    from pamrs.effects import CATALOGUE

    return _beginning(CATALOGUE, incomplete)


def muscle_names(incomplete: str) -> list[str]:
    """Names of muscles of the library that begin with a text."""
    from pamrs import library

    return _beginning(library.names(), incomplete)


def rig_names(incomplete: str) -> list[str]:
    """Names of rigs of the package that begin with a text."""
    from pamrs import rigs

    return _beginning(rigs.names(), incomplete)
