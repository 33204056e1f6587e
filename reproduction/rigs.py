"""The packaged rigs as the dissertation has them: its force models push like struts."""

from __future__ import annotations

from typing import Final

from pamrs.rig import Rig
from pamrs.rigs import named

STRUT: Final = 1e9  # buckling load of a muscle that never buckles [N]


def with_struts(name: str) -> Rig:
    """A rig of the package whose muscles push as their force model says, whatever pushes them.

    Parameters
    ----------
    name : str
        One of :func:`pamrs.rigs.names`.

    Returns
    -------
    Rig
    """
    rig = named(name)
    model = rig.model
    tables = rig.tables("muscle")
    held = {own: {**table, "buckling_load": STRUT} for own, table in tables.items()}
    model["muscle"] = held[""] if list(held) == [""] else held
    return Rig(rig.name, model)
