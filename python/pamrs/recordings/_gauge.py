"""Absolute pressures of a log become gauge pressures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from pamrs.channels import channel_of
from pamrs.recordings._recording import Recording
from pamrs.recordings._suspicion import AMBIENT
from pamrs.units import bar_and_psi

__all__ = ["made_gauge"]

_AMBIENT_OFF: Final = 0.02  # of the stated ambient pressure; a gauge and weather do less


def made_gauge(
    recording: Recording, absolute: Sequence[str], stated: float | None = None
) -> Recording:
    """A recording whose absolute pressures became gauge pressures.

    Parameters
    ----------
    recording : Recording
        As it was read.
    absolute : sequence of str
        Channels that were recorded as absolute pressures; the ambient pressure stays one.
    stated : float, optional
        Ambient pressure where none was recorded [Pa]; by default that of the standard atmosphere.

    Returns
    -------
    Recording
        With the median of the recorded ambient pressure, or else the stated one, subtracted, and
        a note for each channel that says so.
    """
    names = [name for name in absolute if channel_of(name) != "ambient_pressure"]
    if not names:
        return recording
    ambient, whose = AMBIENT, "the standard atmosphere, since nothing says another,"
    if stated is not None:
        ambient, whose = stated, "the ambient pressure that the rig file says,"
    recorded = recording.channels.get("ambient_pressure")
    if recorded is not None and np.isfinite(recorded).any():
        ambient, whose = float(np.nanmedian(recorded)), "the recorded ambient pressure,"
        if stated is not None and abs(ambient - stated) > _AMBIENT_OFF * stated:
            whose += f" where the rig file says {bar_and_psi(stated)},"
    note = f"was recorded as an absolute pressure: {whose} {bar_and_psi(ambient)}, is subtracted"
    channels = {
        name: values - ambient if name in names else values
        for name, values in recording.channels.items()
    }
    notes = recording.notes | {
        name: "; ".join([*filter(None, [recording.notes.get(name)]), note]) for name in names
    }
    return replace(recording, channels=channels, notes=notes)
