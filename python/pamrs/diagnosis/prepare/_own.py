"""Values that each recording has of its own and that nobody knows: a discharge coefficient of each
nozzle, a leak's rate of each day.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pamrs import _core
from pamrs.diagnosis.prepare._blocks import Block, residual
from pamrs.diagnosis.prepare._signals import Prepared
from pamrs.errors import SimulationError
from pamrs.report.text import format_number

__all__ = ["said_of_own", "with_own_values"]

# steps to find a recording's own value, each at most a factor 3: 3 orders and a few to settle
_OWN_STEPS = 12
_OWN_APART = 1.5  # ratio of such values between recordings from which it is said


Array = NDArray[np.float64]


def with_own_values(blocks: Sequence[Block], core: _core.Rig, prepared: Prepared) -> Prepared:
    """A recording with the values of its own that fit it best, beside the nominal ones of all
    others; around them they stay free.

    Steps of Gauss and Newton on the blocks that depend on them, each kept where it leaves less.

    Parameters
    ----------
    blocks : sequence of Block
        Those that can be judged.
    core : _core.Rig
        The nominal model, compiled.
    prepared : Prepared
        The recording.
    """
    own = {n: v for n, v in prepared.recording.parameters.items() if v.error == "own"}
    names = [name for name in own if name in core.parameter_names]
    if not names:
        return prepared

    def at(values: Array) -> Prepared:
        put = {n: replace(own[n], value=float(v)) for n, v in zip(names, values, strict=True)}
        parameters = prepared.recording.parameters | put
        return replace(prepared, recording=replace(prepared.recording, parameters=parameters))

    def left(there: Prepared) -> tuple[float, Array, Array]:
        fixed = {
            n: replace(v, error="same") if n in own else v
            for n, v in there.recording.parameters.items()
        }
        told = replace(there, recording=replace(there.recording, parameters=fixed))
        found = [residual(block, core, told, names) for block in blocks]
        rows = np.concatenate([r.value / r.noise for r in found])
        slopes = np.concatenate([r.jacobian / r.noise for r in found if r.jacobian is not None])
        return float(rows @ rows), rows, slopes

    values = np.array([own[name].value for name in names])
    best, (size, rows, slopes) = at(values), left(at(values))
    for _ in range(_OWN_STEPS):
        scale = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
        step = np.linalg.lstsq(slopes / scale, rows, rcond=1e-9)[0] / scale
        # what is positive stays so: by no more than to a third or to three times at once
        wanted = values + step
        wanted = np.where(values > 0.0, np.clip(wanted, values / 3.0, values * 3.0), wanted)
        try:
            now, more_rows, more_slopes = left(at(wanted))
        except SimulationError:
            break
        if not now < size:
            break
        done = size - now < 1e-3 * size
        values, best, size, rows, slopes = wanted, at(wanted), now, more_rows, more_slopes
        if done:
            break
    return best


def said_of_own(recordings: Sequence[Prepared]) -> list[str]:
    """Values that recordings have of their own, in words, and how far they are from each other."""
    found: dict[str, dict[str, float]] = {}
    for name, recording in {p.recording.name: p.recording for p in recordings}.items():
        for parameter, own in recording.parameters.items():
            if own.error == "own":
                found.setdefault(parameter, {})[name] = own.value
    said = []
    for parameter, values in found.items():
        low, high = min(values.values()), max(values.values())
        told = ", ".join(f"{format_number(v, unicode=False)} in {n}" for n, v in values.items())
        apart = (
            f"; the largest is {high / low:.2g} times the smallest"
            if low > 0.0 and high / low > _OWN_APART
            else ""
        )
        said.append(f"{parameter} is free in each recording: {told} (SI){apart}")
    return said
