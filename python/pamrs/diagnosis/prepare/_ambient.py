"""Temperature of air, walls and supply, as it was measured next to a rig."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pamrs.channels import channel_of
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.errors import DiagnosisError, ParameterError
from pamrs.recordings import Recording
from pamrs.rig import Parameter, Rig

# [tolerances] of a room from that of the rig file, from which it may be another one
_ROOM_TOLERANCES = 3.0
# [K] between recordings' rooms, taken for one: it moves a valve's flow by one percent
_MOST_ROOM_SPREAD = 3.0


AMBIENT = "ambient_temperature"
AMBIENT_PRESSURE = "ambient_pressure"
"""Used where a recording is read: it makes absolute pressures gauge pressures."""
_NAME = "gas.temperature"
_SAME = 0.1
"""Temperatures that differ by less are told as the same [K]."""


def at_ambient(
    rig: Rig, recordings: Sequence[Recording], settings: DiagnosisSettings
) -> tuple[Rig, list[str]]:
    """A rig at the ambient temperature of its recordings.

    Supplies, walls and the air around are at ``gas.temperature``. It has one value in a case: the
    median of the recordings' medians. Where nobody measured it the rig stays as it is.

    Parameters
    ----------
    rig : Rig
        The nominal model.
    recordings : sequence of Recording
        Those of a case; any of them may have the channel ``ambient_temperature``, of which masked
        samples do not count.
    settings : DiagnosisSettings
        Which temperatures rooms have, and how far from that of the rig file they may be.

    Returns
    -------
    rig : Rig
    notes : list of str
        What was set, in words, and what makes one doubt it.

    Raises
    ------
    DiagnosisError
        If no room, or no rig, can have a temperature.
    """
    medians = [
        (r.name, float(np.median(values[good])))
        for r in recordings
        for name, values in r.channels.items()
        if channel_of(name) == AMBIENT and (good := r.mask[name] & np.isfinite(values)).any()
    ]
    if not medians:
        return rig, []
    low, high = settings.least_room, settings.most_room
    wrong = [f"{name} ({value:.1f} K)" for name, value in medians if not low <= value <= high]
    if wrong:
        raise DiagnosisError(
            f"{AMBIENT} of {', '.join(wrong)}: no room has it, {low:g} to {high:g} K are allowed; "
            "correct its unit or calibration, or leave the channel out"
        )
    value = float(np.median([one for _, one in medians]))
    before = rig.parameter(_NAME)
    try:
        moved = rig.with_parameters({_NAME: value})
    except ParameterError as error:
        names = ", ".join(name for name, _ in medians)
        raise DiagnosisError(f"{AMBIENT} of {names}: {error}") from error
    same = abs(value - before.value) < _SAME
    stated = f"to {_SAME:g} K the rig file's" if same else f"{before.value:.5g} K in the rig file"
    notes = [
        f"{_NAME} is {value:.5g} K, as {AMBIENT} was measured ({stated})",
        *_doubted(value, before, settings),
    ]
    low, high = min(one for _, one in medians), max(one for _, one in medians)
    if high - low > _MOST_ROOM_SPREAD:
        notes.append(
            f"{AMBIENT} differs between the recordings, from {low:.1f} to {high:.1f} K; all of "
            f"them are judged at {value:.5g} K"
        )
    return moved, notes


def _doubted(value: float, stated: Parameter, settings: DiagnosisSettings) -> list[str]:
    """A sentence where a measured temperature is far from what the rig file states of it."""
    if not stated.known:
        return []
    limits = [settings.most_room_change]
    if stated.tol > 0.0:
        limits.append(_ROOM_TOLERANCES * stated.tol)
    away = abs(value - stated.value)
    if away <= min(limits):
        return []
    known = f" (known to {stated.tol:.2g} K)" if 0.0 < stated.tol < np.inf else ""
    return [
        f"{AMBIENT} is {away:.1f} K away from {_NAME} of the rig file{known}: a sensor that is not "
        "connected, or lies elsewhere, reads so, and all that flows is judged by it; leave the "
        "channel out where it is none of the room"
    ]
