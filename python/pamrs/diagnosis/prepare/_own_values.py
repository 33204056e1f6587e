"""Values that each recording has of its own and that nobody knows: a discharge coefficient of each
nozzle, a leak's rate of each day, the pressure at which a tank began.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pamrs import _core
from pamrs._arrays import Array
from pamrs.diagnosis.prepare._blocks import Block, residual
from pamrs.diagnosis.prepare._signals import Prepared
from pamrs.diagnosis.prepare._tanks import begins_at, with_tanks
from pamrs.errors import SimulationError
from pamrs.recordings import OwnValue, Recording
from pamrs.report.text import format_number
from pamrs.rig import Rig, effect_parameter
from pamrs.rig.schema import qualified

# steps to find a recording's own value, each at most a factor 3: 3 orders and a few to settle
_OWN_STEPS = 12
_OWN_APART = 1.5  # ratio of such values between recordings from which it is said
_SHAKEN = 1e-3  # share by which a pressure is moved for the slope of what begins at it
_BEGINS = "initial_pressure"


def varying(rig: Rig, core: _core.Rig) -> set[str]:
    """Dotted names of parameters that may have another value in each recording; pressures at which
    a recording begins are among them.
    """
    begin = (f"{qualified(k, n)}.{_BEGINS}" for k in ("supply", "chamber") for n in rig.tables(k))
    return {*core.parameter_names, *begin}


def with_declared_values(rig: Rig, recordings: Sequence[Recording]) -> list[Recording]:
    """Recordings with the values that the rig file leaves to each of them, where they do not say
    them, all under the names that the core has.

    Parameters
    ----------
    rig : Rig
        The nominal model.
    recordings : sequence of Recording
        As they were read.
    """
    nominal = {name: _nominal(rig, name) for name in rig.own}
    nominal_values = {
        _core_name(rig, n): OwnValue(value, value, "own") for n, value in nominal.items()
    }
    return [
        replace(
            r, parameters=nominal_values | {_core_name(rig, n): v for n, v in r.parameters.items()}
        )
        if nominal_values or r.parameters
        else r
        for r in recordings
    ]


def _core_name(rig: Rig, name: str) -> str:
    """A parameter as the core has it: of an effect that is the only one of its id, without the
    block at which it acts.
    """
    parameter = effect_parameter(rig, name)
    return name if parameter is None else ".".join(parameter[:2])


def _nominal(rig: Rig, name: str) -> float:
    """Value in the rig file of one of its parameters, or of a parameter of one of its effects."""
    parameter = effect_parameter(rig, name)
    if parameter is None:
        return rig.parameter(name).value
    _, short, entry = parameter
    return float(entry["parameters"][short])


def with_own_values(
    blocks: Sequence[Block],
    rig: Rig,
    core: _core.Rig,
    prepared: Prepared,
    tanks: Sequence[str],
) -> Prepared:
    """Recording with the values of its own that fit it best, all others being nominal; around them
    they stay free, a tank's by its level.

    Steps of Gauss and Newton on the blocks that depend on them, each kept where it leaves less.

    Parameters
    ----------
    blocks : sequence of Block
        Those that can be judged.
    rig : Rig
        The nominal model.
    core : _core.Rig
        The same, compiled.
    prepared : Prepared
        The recording.
    tanks : sequence of str
        Channels of tanks without a gauge.
    """
    own_values = {n: v for n, v in prepared.recording.parameters.items() if v.error == "own"}
    tank_of = {begins_at(tank): tank for tank in tanks if begins_at(tank) in own_values}
    free = [name for name in own_values if name in core.parameter_names]
    every = [*free, *tank_of]
    if not every:
        return prepared
    dependent = [
        replace(b, floating=tuple(tank for tank in b.floating if tank not in tank_of.values()))
        for b in blocks
    ]

    def at(values: Array) -> Prepared:
        put = {
            n: replace(own_values[n], value=float(v)) for n, v in zip(every, values, strict=True)
        }
        parameters = prepared.recording.parameters | put
        with_values = replace(
            prepared, recording=replace(prepared.recording, parameters=parameters)
        )
        return with_tanks(rig, core, with_values, tanks)

    def rows_at(values: Array, names: list[str]) -> tuple[Array, Array]:
        with_values = at(values)
        fixed = {
            n: replace(v, error="same") if n in own_values else v
            for n, v in with_values.recording.parameters.items()
        }
        held = replace(with_values, recording=replace(with_values.recording, parameters=fixed))
        block_residuals = [residual(block, core, held, names) for block in dependent]
        slopes = [r.jacobian / r.noise for r in block_residuals if r.jacobian is not None]
        rows = np.concatenate([r.value / r.noise for r in block_residuals])
        return rows, np.concatenate(slopes) if slopes else np.zeros((rows.size, 0))

    def misfit(values: Array) -> tuple[float, Array, Array]:
        rows, slopes = rows_at(values, free)
        moved = []
        for k in range(len(free), values.size):
            step = _SHAKEN * max(abs(values[k]), 1e5)
            shaken = rows_at(values + step * (np.arange(values.size) == k), [])[0]
            moved.append((rows - shaken) / step)
        return float(rows @ rows), rows, np.column_stack([slopes, *moved])

    values = np.array([own_values[name].value for name in every])
    try:
        size, rows, slopes = misfit(values)
    except SimulationError:
        return prepared  # the fit says what cannot be predicted
    for _ in range(_OWN_STEPS):
        scale = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
        step = np.linalg.lstsq(slopes / scale, rows, rcond=1e-9)[0] / scale
        # what is positive stays so: by no more than to a third or to three times at once
        wanted = values + step
        wanted = np.where(values > 0.0, np.clip(wanted, values / 3.0, values * 3.0), wanted)
        try:
            now, more_rows, more_slopes = misfit(wanted)
        except SimulationError:
            break
        if not now < size:
            break
        done = size - now < 1e-3 * size
        values, size, rows, slopes = wanted, now, more_rows, more_slopes
        if done:
            break
    return at(values)


def notes_on_own_values(recordings: Sequence[Prepared]) -> list[str]:
    """Values that recordings have of their own, in words, and how far they are from each other."""
    values_of: dict[str, dict[str, float]] = {}
    notes = []
    simulated = {begins_at(tank) for p in recordings for tank in p.simulated}
    for name, recording in {p.recording.name: p.recording for p in recordings}.items():
        for parameter, value in recording.parameters.items():
            if value.error == "own":
                values_of.setdefault(parameter, {})[name] = value.value
    for parameter in [n for n in values_of if n.endswith(f".{_BEGINS}") and n not in simulated]:
        notes.append(f"{parameter}: its gauge says where each recording begins")
        del values_of[parameter]
    for parameter, values in values_of.items():
        low, high = min(values.values()), max(values.values())
        listed = ", ".join(f"{format_number(v, unicode=False)} in {n}" for n, v in values.items())
        apart = (
            f"; the largest is {high / low:.2g} times the smallest"
            if low > 0.0 and high / low > _OWN_APART
            else ""
        )
        notes.append(f"{parameter} is free in each recording: {listed} (SI){apart}")
    return notes
