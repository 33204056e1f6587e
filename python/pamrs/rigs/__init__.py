"""Rigs that come with the package."""

from __future__ import annotations

from importlib import resources
from typing import TYPE_CHECKING, Final

from pamrs.rig import Rig, parse_rig

if TYPE_CHECKING:
    from pamrs.muscle import Muscle

__all__ = ["bench", "sealed_chamber", "shoulder"]

_BENCH: Final = """schema = "pamrs.rig/1"
name = "bench"
gas = {{ ambient_pressure = {{ value = 101325.0, unit = "Pa" }}, temperature = {{ value = 293.15, unit = "K" }} }}
[chamber]
dead_volume = {{ value = {volume!r}, unit = "m3" }}
"""


def _packaged(name: str) -> Rig:
    file = resources.files(__name__).joinpath(f"{name}.toml")
    return parse_rig(file.read_text(encoding="utf-8"), source=f"{name}.toml")


def shoulder() -> Rig:
    """The shoulder joint of the 2014 dissertation: six muscles, spool valve, tank, arm with a payload."""
    return _packaged("shoulder")


def bench(muscle: Muscle, name: str = "bench") -> Rig:
    """A bench with one muscle and a dead volume of a tenth of the muscle's own, without valve, supply and arm.

    Parameters
    ----------
    muscle : Muscle
        The muscle.
    name : str
        What to call the rig.

    Returns
    -------
    Rig
    """
    rig = parse_rig(_BENCH.format(volume=0.1 * float(muscle.air_volume(0.0))), source="bench")
    return Rig(name, {**rig.model, "muscle": dict(muscle.parameters)})


def sealed_chamber() -> Rig:
    """A rigid chamber of one decilitre behind a shut valve, with a pressure transducer."""
    return _packaged("sealed_chamber")
