"""The rig files that come with the package, by name; light, so that the command line can list them in its help."""

from __future__ import annotations

from importlib import resources

__all__ = ["packaged", "text_of"]

_FIRST = "shoulder"  # the one that a new rig begins with


def packaged() -> list[str]:
    """Names of the rigs in ``pamrs/rigs``, the shoulder first, the others by the alphabet."""
    files = (file.name for file in resources.files("pamrs").joinpath("rigs").iterdir())
    found = sorted(name.removesuffix(".toml") for name in files if name.endswith(".toml"))
    return sorted(found, key=lambda name: name != _FIRST)


def text_of(name: str) -> str:
    """Text of the file of one of :func:`packaged`."""
    return resources.files("pamrs").joinpath("rigs", f"{name}.toml").read_text(encoding="utf-8")
