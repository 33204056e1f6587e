"""The plan of a sweep: everything that its numbers depend on, with a digest of it."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

from pamrs import __version__
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.sweeps._axes import Axes, Blocks
from pamrs.sweeps._drives import Drive, Task

__all__ = ["SCHEMA", "Plan", "differences"]

SCHEMA: Final = "pamrs.sweep/1"
_FEWEST, _MOST, _PARTS = 1024, 65_536, 64


@dataclass(frozen=True, eq=False)
class Plan:
    """What is run, and how it is cut.

    Attributes
    ----------
    rig : str
        TOML text.
    rig_name : str
    axes : Axes
        What varies.
    drive : Drive
        What drives it, and the metrics.
    chunk : int
        Runs of a chunk at most.
    """

    rig: str
    rig_name: str
    axes: Axes
    drive: Drive
    chunk: int

    @classmethod
    def of(cls, rig: Rig, axes: Axes, drive: Drive, chunk: int | None) -> Plan:
        """A plan; by default some 64 chunks, of 1024 to 65 536 runs."""
        size = min(max(len(axes) // _PARTS, _FEWEST), _MOST) if chunk is None else chunk
        return cls(rig.to_toml_text(comments=False), rig.name, axes, drive, size)

    @cached_property
    def blocks(self) -> Blocks:
        """The chunks."""
        return Blocks.cut(self.axes.shape, self.chunk)

    def task(self, chunk: int, threads: int | None) -> Task:
        """One chunk for a worker."""
        return Task(self.rig, self.drive, self.axes.rows(*self.blocks.runs(chunk)), threads)

    @cached_property
    def content(self) -> dict[str, Any]:
        """The plan as JSON: entries of which each has its own digest or words."""
        described = {
            "schema": SCHEMA,
            "version of pamrs": __version__,
            "rig": hashlib.sha256(self.rig.encode()).hexdigest(),
            **self.axes.describe(),
            **self.drive.describe(),
            "runs of a chunk": str(self.blocks.block),
        }
        text = json.dumps(described, sort_keys=True)
        return {"digest": hashlib.sha256(text.encode()).hexdigest(), "entries": described}


def differences(stored: dict[str, Any], wanted: dict[str, Any]) -> list[str]:
    """What two plans do not have in common, in words.

    Parameters
    ----------
    stored, wanted : dict
        :attr:`Plan.content`.

    Returns
    -------
    list of str
        Empty where they are the same.
    """
    try:
        old, new = dict(stored["entries"]), dict(wanted["entries"])
    except (KeyError, TypeError, ValueError):
        raise ParameterError("plan.json is not one of a sweep") from None
    said = []
    for name in dict.fromkeys([*old, *new]):
        if old.get(name) == new.get(name):
            continue
        if name not in new:
            said.append(f"{name} is in the store only")
        elif name not in old:
            said.append(f"{name} is not in the store")
        else:
            said.append(f"{name}: {_short(old[name])} in the store, {_short(new[name])} now")
    return said


def _short(text: Any) -> str:
    """Without most of the digits of a digest."""
    words = [w[:8] if len(w) == 64 and w.isalnum() else w for w in str(text).split(" ")]
    return " ".join(words)
