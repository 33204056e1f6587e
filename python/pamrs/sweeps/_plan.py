"""The plan of a sweep: everything that its numbers depend on, with a digest of it."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

from pamrs import __version__
from pamrs.errors import ParameterError, RigError
from pamrs.rig import Rig, parse_rig
from pamrs.sweeps._axes import Axes, Blocks
from pamrs.sweeps._drives import Drive, Task
from pamrs.units import with_unit

SCHEMA: Final = "pamrs.sweep/1"
_DIGEST: Final = re.compile(r"\b[0-9a-f]{64}\b")
_FEWEST, _MOST, _PARTS = 1024, 65_536, 64


@dataclass(frozen=True, eq=False)
class SweepPlan:
    """Runs of a sweep, and how they are cut into chunks.

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
    def of(cls, rig: Rig, axes: Axes, drive: Drive, chunk: int | None) -> SweepPlan:
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
        digest = hashlib.sha256(text.encode()).hexdigest()
        # the rig itself is there so that people are shown how another one differs
        return {"digest": digest, "entries": described, "rig": self.rig}


#: Entries of a plan that are one argument of :func:`pamrs.sweep`, by how they begin.
_ARGUMENTS: Final = {
    "values of ": "over[{!r}]",
    "samples of ": "samples of {}",
    "metric ": "metrics[{!r}]",
    "initial ": "initial[{!r}]",
    "loop ": "{}",
}
_CALLED: Final = {
    "order of the axes": "over (order of the axes)",
    "runs of a chunk": "chunk",
}
_MOST_LISTED: Final = 4


def differences(stored: dict[str, Any], wanted: dict[str, Any]) -> list[str]:
    """Differences between two plans, in words that name the argument.

    Parameters
    ----------
    stored, wanted : dict
        :attr:`SweepPlan.content`.

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
        argument = _argument(name)
        if name not in new:
            said.append(f"{argument} is in the store only")
        elif name not in old:
            said.append(f"{argument} is not in the store")
        elif name == "rig":
            said.append(f"rig: {_rigs(stored.get('rig'), wanted.get('rig'))}")
        else:
            said.append(f"{argument}: {_change(str(old[name]), str(new[name]))}")
    return said


def _argument(entry: str) -> str:
    """Argument of a sweep to which an entry of its plan belongs."""
    for begin, called in _ARGUMENTS.items():
        if entry.startswith(begin):
            return called.format(entry.removeprefix(begin))
    return _CALLED.get(entry, entry)


def _change(old: str, new: str) -> str:
    """Change of an entry in words; digests count as other numbers."""
    if _DIGEST.search(old) or _DIGEST.search(new):
        was, now = (re.sub(r"[ ,]*$", "", _DIGEST.sub("", text)) for text in (old, new))
        if was == now:
            return "other numbers"
        return f"{was or 'other'} numbers in the store, {now or 'other'} now"
    return f"{old} in the store, {new} now"


def _rigs(old: object, new: object) -> str:
    """Differences between two rigs given as TOML, in words."""
    if not (isinstance(old, str) and isinstance(new, str)):
        return "another rig than that of the store"
    try:
        was, now = parse_rig(old), parse_rig(new)
    except RigError:
        return "another rig than that of the store"
    differences = []
    for name in dict.fromkeys([*was.parameters, *now.parameters]):
        one, other = was.parameters.get(name), now.parameters.get(name)
        if one is None or other is None:
            differences.append(
                f"{name} is {'not in the store' if one is None else 'in the store only'}"
            )
        elif one.value != other.value:
            values = (with_unit(f"{p.value:.6g}", p.unit) for p in (one, other))
            differences.append(f"{name} = {' in the store, '.join(values)} now")
        elif one.tol != other.tol:
            differences.append(f"another tolerance of {name}")
    if was.effects != now.effects:
        differences.append("other effects")
    if was.name != now.name:
        differences.append(f"{was.name!r} in the store, {now.name!r} now")
    rest = len(differences) - _MOST_LISTED
    more = [f"{rest} more"] if rest > 0 else []
    return (
        "; ".join([*differences[:_MOST_LISTED], *more])
        or "other blocks, or what is connected to what"
    )
