"""Run a rig: once, sample by sample, many at once, or driven by a recording.

:func:`simulate` returns a :class:`Simulation`; :class:`Simulator` goes from sample to sample,
:class:`Batch` does so with many rigs on all processors, :func:`simulate_batch` runs many plants of
one rig side by side, :func:`replay` gives a rig the inputs of a
recording.
"""

from pamrs.simulation._batch import Batch, BatchRun, Failure
from pamrs.simulation._driving import (
    has_frame,
    initial_names,
    inputs_of,
    supplies_of,
)
from pamrs.simulation._replay import differences, reading, replay
from pamrs.simulation._side_by_side import REDUCTIONS, simulate_batch
from pamrs.simulation._simulation import (
    Balance,
    Event,
    Simulation,
    core_rig,
    default_step,
    simulate,
    whole_samples,
)
from pamrs.simulation._simulator import Simulator

__all__ = [
    "REDUCTIONS",
    "Balance",
    "Batch",
    "BatchRun",
    "Event",
    "Failure",
    "Simulation",
    "Simulator",
    "core_rig",
    "default_step",
    "differences",
    "has_frame",
    "initial_names",
    "inputs_of",
    "reading",
    "replay",
    "simulate",
    "simulate_batch",
    "supplies_of",
    "whole_samples",
]
