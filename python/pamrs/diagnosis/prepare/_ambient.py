"""The temperature that air, walls and supply have, as it was measured beside a rig."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pamrs.channels import channel_of
from pamrs.errors import DiagnosisError, ParameterError
from pamrs.recordings import Recording
from pamrs.rig import Rig

__all__ = ["AMBIENT", "at_ambient"]

AMBIENT = "ambient_temperature"
_NAME = "gas.temperature"
_SPREAD = 3.0
"""Kelvin between the recordings from which one temperature for all is said to be none: one percent
of the flow through a valve at the most."""


def at_ambient(rig: Rig, recordings: Sequence[Recording]) -> tuple[Rig, list[str]]:
    """A rig at the ambient temperature of its recordings.

    Supplies, walls and the air around are at ``gas.temperature``. It has one value in a case: the
    median of the recordings' medians. Where nobody measured it the rig stays as it is.

    Parameters
    ----------
    rig : Rig
        The nominal model.
    recordings : sequence of Recording
        Those of a case; any of them may have the channel ``ambient_temperature``.

    Returns
    -------
    rig : Rig
    said : list of str
        What was set, in words.

    Raises
    ------
    DiagnosisError
        If the temperature is outside of what a rig can have.
    """
    found = {
        r.name: float(np.median(values[np.isfinite(values)]))
        for r in recordings
        for name, values in r.channels.items()
        if channel_of(name) == AMBIENT and np.isfinite(values).any()
    }
    if not found:
        return rig, []
    value = float(np.median(list(found.values())))
    before = rig.parameter(_NAME).value
    try:
        moved = rig.with_parameters({_NAME: value})
    except ParameterError as error:
        raise DiagnosisError(f"{AMBIENT} of {', '.join(found)}: {error}") from error
    said = [f"{_NAME} is {value:.1f} K, as {AMBIENT} was measured ({before:.1f} K in the rig file)"]
    low, high = min(found.values()), max(found.values())
    if high - low > _SPREAD:
        said.append(
            f"{AMBIENT} differs between the recordings, from {low:.1f} to {high:.1f} K; all of "
            f"them are judged at {value:.1f} K"
        )
    return moved, said
