"""Rigs that come with the package."""

from __future__ import annotations

from importlib import resources

from pamrs.rig import Rig, parse_rig

__all__ = ["sealed_chamber", "shoulder"]


def _packaged(name: str) -> Rig:
    file = resources.files(__name__).joinpath(f"{name}.toml")
    return parse_rig(file.read_text(encoding="utf-8"), source=f"{name}.toml")


def shoulder() -> Rig:
    """The shoulder joint of the 2014 dissertation: six muscles, spool valve, tank, arm with a payload."""
    return _packaged("shoulder")


def sealed_chamber() -> Rig:
    """A rigid chamber of one decilitre behind a shut valve, with a pressure transducer."""
    return _packaged("sealed_chamber")
