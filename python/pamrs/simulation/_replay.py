"""A rig driven by what a recording says went in: the simulation next to the measurement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pamrs._arrays import Array
from pamrs.channels import channel_of, dotted, recorded_as
from pamrs.errors import RecordingError
from pamrs.rig.schema import qualified
from pamrs.simulation._driving import has_frame, sensor_zero, supplies_of
from pamrs.simulation._simulation import Simulation, simulate

if TYPE_CHECKING:
    from pamrs.recordings import Recording
    from pamrs.rig import Rig


#: State of a recording's first row that a simulation begins with, the block that has it and the
#: zero of its sensor.
_STATES = {
    "muscle_pressure": ("chamber", "pressure_zero"),
    "supply_pressure": ("supply", "pressure_zero"),
    "line_pressure": ("line", "pressure_zero"),
    "joint_angle": ("joint", "angle_zero"),
    "length": ("load", "length_zero"),
}
#: Pressures that a run is given, and the channels of a recording that they come from.
_PRESCRIBED = {"pressure": "muscle_pressure", "supply_pressure": "supply_pressure"}


def replay(
    rig: Rig,
    recording: Recording,
    *,
    temperatures: Mapping[str, float] | None = None,
    record: Sequence[str] | None = None,
) -> Simulation:
    """Simulate a rig from a recording's first values under its inputs.

    Commands of valves and regulators come from the recording, the length of a load frame, the
    pressures of supplies of kind ``measured`` and those of chambers that nothing feeds as well
    (``muscle_pressure``, or where that was not measured ``pressure_command``); what a recording
    leaves unusable holds its last usable value. A chamber without ``muscle_pressure`` that lines
    alone join to a gauge begins at its pressure.
    Parameters that had another value in the recording have it.

    Parameters
    ----------
    rig : Rig
        The model.
    recording : Recording
        As :func:`pamrs.load_recording` gives it; channels of a block with a name carry it
        (``valve_command.flexor``).
    temperatures : mapping of str to float, optional
        Temperature at which the gas of a chamber with an energy balance begins [K], by the name of
        the chamber; that of the room by default.
    record : sequence of str, optional
        Channels to keep; all by default.

    Returns
    -------
    Simulation
        One row for each of the recording's.

    Raises
    ------
    RecordingError
        If an input that the rig needs is not in the recording.
    ParameterError
        As :func:`pamrs.simulate`.
    """
    rig = recording.rig_there(rig)
    drive = _drive(rig, recording)
    prescribed: dict[str, Any] = {"length": drive.get("length")} | {
        channel: drive.get(signal, {}) for signal, channel in _PRESCRIBED.items()
    }
    initial = {}
    for channel, (block, _) in _STATES.items():
        own = prescribed.get(channel)
        for name in rig.tables(block):
            if _usable(recording, channel, name) and (
                own is None or (isinstance(own, dict) and name not in own)
            ):
                full = dotted(channel, name)
                first = float(recording.channels[full][recording.mask[full]][0])
                initial[full] = first - sensor_zero(rig, *_STATES[channel], name)
    _begin_behind_gauges(rig, initial)
    initial |= {dotted("temperature", n): kelvin for n, kelvin in (temperatures or {}).items()}
    if not drive:
        drive["duration"] = float(recording.time[-1])
    drive |= {"initial": initial, "record": record}
    return simulate(rig, sample_time=recording.sample_time, **drive)


def _begin_behind_gauges(rig: Rig, initial: dict[str, float]) -> None:
    """Let chambers without a pressure that lines alone feed begin at that of a gauge, at rest."""
    gauges = {
        qualified(block, name): dotted(channel, name)
        for channel, (block, _) in _STATES.items()
        for name in rig.tables(block)
    }
    valved = {end for ends in rig.ports("valve").values() for end in ends.values()}
    lines = [(e["from"] or qualified("line", n), e["to"]) for n, e in rig.ports("line").items()]
    for own, other in (*lines, *((end, beginning) for beginning, end in lines)):
        if channel_of(own) == "chamber" and own not in valved and gauges.get(other) in initial:
            initial.setdefault(gauges[own], initial[gauges[other]])


def _drive(rig: Rig, recording: Recording) -> dict[str, Any]:
    """The keywords of :func:`pamrs.simulate` that a recording gives."""
    valves = {name: _held(recording, dotted("valve_command", name)) for name in rig.tables("valve")}
    drive: dict[str, Any] = {"valve_command": valves} if valves else {}
    commands = {
        name: _held(recording, dotted("supply_command", name))
        for name in supplies_of(rig, "regulator")
        if _usable(recording, "supply_command", name)
    }
    if commands:
        drive["supply_command"] = commands
    sources = supplies_of(rig, "measured")
    if sources:
        drive["supply_pressure"] = {
            name: _held(recording, dotted("supply_pressure", name))
            - sensor_zero(rig, *_STATES["supply_pressure"], name)
            for name in sources
        }
    if has_frame(rig):
        drive["length"] = _held(recording, "length")
    # Where muscles pull and nothing feeds them, their measured pressure is what moves them.
    if rig.tables("muscle") and not (valves or rig.tables("supply")):
        given = {}
        for name in rig.tables("chamber"):
            if _usable(recording, "muscle_pressure", name):
                measured = _held(recording, dotted("muscle_pressure", name))
                given[name] = measured - sensor_zero(rig, *_STATES["muscle_pressure"], name)
            elif _usable(recording, "pressure_command", name):
                given[name] = _held(recording, dotted("pressure_command", name))
        if given:
            drive["pressure"] = given
    return drive


def reading(result: Simulation, channel: str) -> Array | None:
    """Values that a sensor of a bench would read in a run.

    Parameters
    ----------
    result : Simulation
        The run.
    channel : str
        Channel of a recording; ``force`` is the pull of all muscles.

    Returns
    -------
    (n,) array or None
        In SI; None where the run has no such channel.
    """
    if channel == "force":
        forces = [result[name] for name in result if channel_of(name) == "muscle_force"]
        return np.asarray(np.sum(forces, axis=0), dtype=np.float64) if forces else None
    return np.asarray(result[channel], dtype=np.float64) if channel in result else None


def differences(result: Simulation, recording: Recording) -> dict[str, float]:
    """Root mean square of simulated less recorded, for each channel that both have and that was not
    prescribed.

    Parameters
    ----------
    result : Simulation
        What :func:`replay` returns.
    recording : Recording
        The recording that it was driven by.

    Returns
    -------
    dict of str to float
        Channel -> difference in its SI unit.
    """
    drive = _drive(result.rig, recording)
    skipped = {"time", "valve_command", "supply_command", *drive} - {*_PRESCRIBED}
    skipped |= {
        dotted(channel, name)
        for signal, channel in _PRESCRIBED.items()
        for name in drive.get(signal, ())
    }
    found = {}
    for name in result:
        other = recorded_as(name)
        rows = recording.mask.get(other)
        if {channel_of(name), name} & skipped or rows is None or not rows.any():
            continue
        apart = result[name][rows] - recording.channels[other][rows]
        found[name] = float(np.sqrt(np.mean(apart**2)))
    return found


def _usable(recording: Recording, channel: str, name: str = "") -> bool:
    """True where a recording has a usable sample of a block's channel."""
    full = dotted(channel, name)
    return full in recording.channels and bool(recording.mask[full].any())


def _held(recording: Recording, name: str) -> Array:
    """Channel whose unusable samples repeat the last usable one, as a valve holds its command."""
    if not _usable(recording, name):
        raise RecordingError(f"{recording.name}: no usable {name}, which the rig needs")
    rows = recording.mask[name]
    last = np.maximum.accumulate(np.where(rows, np.arange(rows.size), int(np.argmax(rows))))
    return np.asarray(recording.channels[name][last])
