"""Checks of a case before any fit: units, dead and swapped channels, impossible samples, copies,
and the blocks that the recorded channels surround.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from pamrs.channels import block_of, dotted
from pamrs.diagnosis.fit import holdable, without_passing
from pamrs.diagnosis.prepare import (
    Block,
    at_ambient,
    available_blocks,
    blocks_with_tanks,
    check_plausible,
    implausible,
    noted_units,
    prepare,
    suspected_units,
    turned_about,
    uncommanded,
    unusable,
    varying,
    with_declared_values,
    without_copies,
    without_dead_commands,
    without_impossible,
    without_poor_thermometers,
    without_rails,
)
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import EFFECTS
from pamrs.errors import DiagnosisError, RecordingError
from pamrs.findings import Faulty
from pamrs.recordings import Case, LogProposal, Recording, ambient_of
from pamrs.rig import Rig
from pamrs.rig.schema import qualified
from pamrs.simulation import core_rig

__all__ = ["Ready", "left_out", "questions", "readied"]

_LOOKED_AT = 20_000
"""Samples of a proposed recording that are looked at: all of a log would take long."""
_ASKED = 8
"""Questions about a log, at most."""


@dataclass(frozen=True)
class Ready:
    """A case that can be diagnosed.

    Attributes
    ----------
    case : Case
        With the recordings that are the rig's own, and the rig that they were made on as far as
        that is known before any fit; impossible samples are masked.
    blocks : list of Block
        Blocks of the rig that its channels surround.
    suspected, doubts : list of str
        What was left out and why; units and columns to be looked at.
    told, masked : list of str
        What is no proof or taken as known; and samples that were masked.
    faulty : list of Faulty
        Sensors and commands that are dead or at the end of their range.
    """

    case: Case
    blocks: list[Block]
    suspected: list[str]
    doubts: list[str]
    told: list[str]
    masked: list[str]
    faulty: list[Faulty]


def readied(case: Case, settings: DiagnosisSettings) -> Ready:
    """Check a case before anything is fitted.

    Parameters
    ----------
    case : Case
        The case as it was read.
    settings : DiagnosisSettings
        Numbers that say what is implausible.

    Returns
    -------
    Ready

    Raises
    ------
    DiagnosisError
        If recordings cannot be of this rig (units, swapped columns, dead sensors), or surround no
        block of it.
    """
    case = replace(case, recordings=with_declared_values(case.rig, case.recordings))
    _check_rig(case)
    doubts = [*suspected_units(case), *noted_units(case)]
    try:
        case, notes = _nominal(case, settings)
        alive, dead = without_dead_commands(case.recordings, case.rig)
        case = replace(case, recordings=alive)
        core = core_rig(case.rig)
        case, lacking_commands = left_out(case, lambda r: uncommanded(r, case.rig, core.inputs))
        case, implausible_ones = left_out(
            case, lambda r: "; ".join(implausible(r, case.rig, settings))
        )
        for recording in case.recordings:
            if why := uncommanded(recording, case.rig, core.inputs):
                raise DiagnosisError(f"recording {recording.name!r}: {why}")
        check_plausible(case.recordings, case.rig, case.name, settings)
    except DiagnosisError as error:
        raise DiagnosisError("\n".join([str(error), *doubts])) from error
    case, clipped, copies, masked = _sound(case, settings)
    case, empty = left_out(case, lambda r: unusable(r, case.rig, core, settings))
    suspected = [*lacking_commands, *implausible_ones, *empty]
    blocks = blocks_with_tanks(case.rig, case.channels)
    if not blocks:
        message = (
            f"case {case.name!r}: its channels ({', '.join(case.channels)}) do not surround any "
            f"block of the rig ({', '.join(case.rig.blocks)}); measure {_lacking(case)}"
        )
        raise DiagnosisError("\n".join([message, *suspected]))
    return Ready(case, blocks, suspected, doubts, [*copies, *notes], masked, [*dead, *clipped])


def questions(proposed: LogProposal, rig: Rig, settings: DiagnosisSettings) -> list[str]:
    """Questions about a proposed log that a diagnosis would refuse, before it becomes a case.

    Parameters
    ----------
    proposed : LogProposal
        Of one log.
    rig : Rig
        The nominal model.
    settings : DiagnosisSettings
        Limits of what a recording can be.

    Returns
    -------
    list of str
        Why :func:`readied` would refuse it; empty for a sound log, or one without a clock.
    """
    found = list[str]()
    try:
        recordings = proposed.recordings(ambient_of(rig))
    except RecordingError as error:
        return [str(error)]
    core = core_rig(rig)
    for recording in recordings:
        last = min(recording.duration, _LOOKED_AT * recording.sample_time)
        part = recording.between(stop=last)
        odd = implausible(part, rig, settings)
        blocks = [] if odd else available_blocks(rig, tuple(part.channels))
        if blocks and not unusable(part, rig, core, settings):
            odd = turned_about(blocks, [prepare(part, rig, settings)], core)
        found += odd
    return list(dict.fromkeys(found))[:_ASKED]


def left_out(case: Case, fault: Callable[[Recording], str]) -> tuple[Case, list[str]]:
    """The case without recordings that cannot be used, which would hold up the others.

    Parameters
    ----------
    case : Case
        The case.
    fault : callable
        Why a recording cannot be used, in words; empty where it can.

    Returns
    -------
    case : Case
        With all recordings where none to be fitted would be left.
    said : list of str
        A sentence for each recording that is left out.
    """
    faults = {r.name: why for r in case.recordings if (why := fault(r))}
    rest = replace(case, recordings=[r for r in case.recordings if r.name not in faults])
    if not faults or not (rest.fit if case.fit else rest.recordings):
        return case, []
    return rest, [f"recording {name!r} is left out: {why}" for name, why in faults.items()]


def _check_rig(case: Case) -> None:
    """Refuse cases of which no block of their rig can be judged."""
    rig = case.rig
    if (rig.model["load"] or {}).get("kind") == "frame" and "force" not in case.channels:
        raise DiagnosisError(
            f"load.kind = 'frame' of case {case.name!r} holds the length, so that only its force "
            f"can be judged: every recording needs the channel force; all have "
            f"{', '.join(case.channels)}"
        )

    free = varying(rig, core_rig(rig))
    for recording in case.recordings:
        fixed = [name for name in recording.parameters if name not in free]
        if fixed:
            raise DiagnosisError(
                f"parameters of recording {recording.name!r}: {', '.join(fixed)} cannot differ "
                f"between recordings of a diagnosis; what can: {', '.join(sorted(free))}"
            )


def _nominal(case: Case, settings: DiagnosisSettings) -> tuple[Case, list[str]]:
    """Case with the rig as far as it is known before any fit, and sentences on that."""
    rig, notes = at_ambient(case.rig, case.recordings, settings)
    every_note = [*notes, *_notes_on_held(rig), *_notes_on_inlets(rig, case.channels)]
    return replace(case, rig=without_passing(rig)), every_note


def _sound(
    case: Case, settings: DiagnosisSettings
) -> tuple[Case, list[Faulty], list[str], list[str]]:
    """Case with impossible samples masked; faults of sensors, copies, and other notes."""
    recordings, clipped = without_rails(case.recordings)
    recordings, masked = without_impossible(recordings, case.rig, settings)
    recordings, copies = without_copies(recordings)
    recordings, poor = without_poor_thermometers(recordings, case.rig)
    return replace(case, recordings=recordings), clipped, copies, [*masked, *poor]


def _notes_on_inlets(rig: Rig, channels: Sequence[str]) -> list[str]:
    """Tanks in front of regulators that nobody measured, in words."""
    notes = []
    for name, ports in rig.ports("supply").items():
        inlet = block_of(ports.get("inlet", ""))
        table = rig.tables("supply").get(inlet) if ports.get("inlet") else None
        gauge, first_pressure = dotted("supply_pressure", inlet), qualified("supply", inlet)
        first_pressure = f"{first_pressure}.initial_pressure"
        if table is not None and table["kind"] == "tank" and gauge not in channels:
            notes.append(
                f"{gauge} was not recorded: {qualified('supply', name)} is taken to have "
                f"{rig.units.said(first_pressure, 'Pa', table['initial_pressure'])} in front of it "
                "throughout; record it where the tank may come near to what the regulator is set to"
            )
    return notes


def _notes_on_held(rig: Rig) -> list[str]:
    """Sentences on effects that the model holds already, and on those that it cannot hold."""

    def named(entry: dict[str, Any]) -> str:
        place = f" at {entry['at']}" if "at" in entry else ""
        return f"{EFFECTS[entry['id']].name} ({entry['id']}{place})"

    held = [named(entry) for entry in rig.effects if holdable(entry)]
    passing = [named(entry) for entry in rig.effects if not holdable(entry)]
    notes = []
    if held:
        notes.append(
            f"the model holds already: {', '.join(held)}; the parameters of each were refitted "
            "with those of the rig, and it is not named again"
        )
    if passing:
        notes.append(
            f"taken out of the model before the diagnosis: {', '.join(passing)}; what happens at "
            "times of its own in each recording, or is a form without a name, is looked for anew"
        )
    return notes


def _lacking(case: Case) -> str:
    """Channels that a case's rig has and not all of its recordings, by name, each with those that
    lack it where others have it.
    """
    rig = case.rig
    names = [dotted("muscle_pressure", name) for name in rig.tables("chamber")]
    names += [dotted("supply_pressure", name) for name in rig.tables("supply")]
    names += [dotted("joint_angle", name) for name in rig.tables("joint")]
    names += ["length"] if rig.model["load"] else []
    names += ["force"] if (rig.model["load"] or {}).get("kind") == "frame" else []
    missing = []
    for name in (name for name in (*names, *core_rig(rig).inputs) if name not in case.channels):
        without = [r.name for r in case.recordings if name not in r.channels]
        some = len(without) < len(case.recordings)
        missing.append(f"{name} (not in {', '.join(without)})" if some else name)
    return ", ".join(missing)
