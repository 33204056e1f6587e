"""Sweeps: many runs of a rig with other parameters, kept in a store that survives ``kill -9``.

:func:`sweep` runs a grid or samples and gives a labelled result that need not fit in memory;
:func:`gain_map` closes a controller around every run. :func:`open_sweep` reads a result again.
"""

from pamrs.sweeps._loops import gain_map
from pamrs.sweeps._store import open_sweep
from pamrs.sweeps._sweep import sweep

__all__ = [
    "gain_map",
    "open_sweep",
    "sweep",
]
