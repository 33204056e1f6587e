"""Modules of folders that are no packages: those of cases, those that make pages."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

CASES = Path(__file__).parents[1] / "cases"


def load_module(file: Path) -> ModuleType:
    """The module that a file is, by the names of its folder and its own."""
    name = f"{file.parent.name}_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module
