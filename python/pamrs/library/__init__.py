"""The muscles of the 2014 dissertation: geometry, moduli, and where each number comes from.

``pamrs.library.elbow_0625in()`` is a :class:`pamrs.Muscle`; ``pamrs.library.entry("elbow_0625in")``
also has the origin of each number, the mass and the highest pressure. The reproduction of the
dissertation compares what is published about the muscles with what they give.
"""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Final

from pamrs.errors import ParameterError, meant
from pamrs.library._entry import Entry, quantity, read_entry

if TYPE_CHECKING:
    from pamrs.rig import Muscle

__all__ = [
    "Entry",
    "ch2_075in",
    "elbow_0625in",
    "entry",
    "large_2in",
    "large_2in_effective",
    "names",
    "pam_a_1in",
    "pam_b_075in",
    "quantity",
]

_NAMES: Final = (
    "elbow_0625in",
    "large_2in",
    "large_2in_effective",
    "ch2_075in",
    "pam_a_1in",
    "pam_b_075in",
)


def names() -> list[str]:
    """Names of the muscles, in the order of the dissertation's sections 3.2, 2 and 6.2."""
    return list(_NAMES)


@cache
def entry(name: str) -> Entry:
    """A muscle and what is known of it.

    Parameters
    ----------
    name : str
        One of :func:`names`.

    Returns
    -------
    Entry

    Raises
    ------
    ParameterError
        If there is no such muscle.
    """
    if name not in _NAMES:
        raise ParameterError(f"name = {name!r} is not in the library; {meant(str(name), _NAMES)}")
    file = resources.files(__name__).joinpath(f"{name}.toml")
    return read_entry(file.read_text(encoding="utf-8"))


def elbow_0625in() -> Muscle:
    """The elbow's 0.625-in latex muscle (Table 3.3)."""
    return entry("elbow_0625in").muscle


def large_2in() -> Muscle:
    """The 2-in silicone muscle of 3.2.2 with the published braid angle, which gives 2.5 times its
    published force.
    """
    return entry("large_2in").muscle


def large_2in_effective() -> Muscle:
    """The 2-in silicone muscle of 3.2.2 with the braid angle that gives its published force."""
    return entry("large_2in_effective").muscle


def ch2_075in() -> Muscle:
    """The 0.75-in latex muscle of chapter 2, with friction."""
    return entry("ch2_075in").muscle


def pam_a_1in() -> Muscle:
    """The 1-in latex muscle A of Table 6.1, which is the shoulder's."""
    return entry("pam_a_1in").muscle


def pam_b_075in() -> Muscle:
    """The 0.75-in silicone muscle B of Table 6.1."""
    return entry("pam_b_075in").muscle
