"""Modules that stood directly in ``pamrs`` and are parts of its packages now.

The old paths go on working for a while: ``from pamrs.recording import Recording`` gives the class
of ``pamrs.recordings`` and a :class:`DeprecationWarning` that names the new path.
"""

from __future__ import annotations

import importlib
import sys
import warnings
from types import ModuleType
from typing import Any, Final

__all__ = ["PACKAGES", "module", "register"]

#: Old module of ``pamrs`` -> where its names are.
PACKAGES: Final[dict[str, str]] = {
    "batch": "pamrs.simulation",
    "case": "pamrs.recordings",
    "effects_table": "pamrs.effects",
    "joint": "pamrs.rig",
    "lifting": "pamrs.design",
    "muscle": "pamrs.rig",
    "muscle_models": "pamrs.rig.muscle_models",
    "prove": "pamrs.diagnosis.prove",
    "recording": "pamrs.recordings",
    "replay": "pamrs.simulation",
    "simulator": "pamrs.simulation",
    "sizing": "pamrs.design.sizing",
}


class _Moved(ModuleType):
    """A module that looks its names up in another one, and says where that is."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        home = PACKAGES[self.__name__.rpartition(".")[2]]
        value = getattr(importlib.import_module(home), name)
        warnings.warn(
            f"{self.__name__}.{name} is {home}.{name} now; the old path will go",
            DeprecationWarning,
            stacklevel=2,
        )
        return value


def module(name: str) -> ModuleType:
    """The module that stands for one of :data:`PACKAGES`."""
    return sys.modules[f"pamrs.{name}"]


def register() -> None:
    """Make the old paths importable."""
    for name, home in PACKAGES.items():
        text = f"The names of :mod:`{home}`, by their old path."
        sys.modules.setdefault(f"pamrs.{name}", _Moved(f"pamrs.{name}", text))
