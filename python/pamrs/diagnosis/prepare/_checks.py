"""Checks of a case before any fit, as one table: units, dead and swapped channels, impossible
samples, copies, and the blocks that the recorded channels surround.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import groupby
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation

from pamrs import _core
from pamrs._arrays import Mask
from pamrs.channels import block_of, channel_of, dotted
from pamrs.diagnosis.prepare._blocks import Block, available_blocks
from pamrs.diagnosis.prepare._copies import without_copies
from pamrs.diagnosis.prepare._plausibility import (
    MOST_LISTED,
    frozen_tanks,
    impossible_motion,
    impossible_pressures,
    reversed_valves,
    slow_clock,
    swapped_pressures,
    turned_about,
    unlogged_commands,
    without_channel,
    without_dead_commands,
    without_impossible,
)
from pamrs.diagnosis.prepare._residual import blocks_with_tanks, varying, with_declared_values
from pamrs.diagnosis.prepare._signals import (
    Prepared,
    few_usable,
    prepare,
    thermometers_of,
    uncommanded,
    unusable,
)
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import CATALOGUE, EFFECTS
from pamrs.errors import DiagnosisError, ParameterError, RecordingError, joined
from pamrs.findings import Faulty
from pamrs.recordings import Case, LogProposal, Recording, ambient_of, suspicions
from pamrs.rig import Parameter, Rig
from pamrs.rig.schema import qualified
from pamrs.simulation import core_rig
from pamrs.units import parse_unit


class Action(Enum):
    """Consequence of a check for a case, in words."""

    REFUSE = "the case is refused"
    LEAVE_OUT = "the recording is left out, if others can be fitted"
    LEAVE_OUT_OR_REFUSE = (
        "the recording is left out; if no other can be fitted, the case is refused"
    )
    TAKE_OUT = "the channel is left out"
    MASK = "the samples are masked"
    NO_PROOF = "what is a copy is left out"
    DOUBT = "one of the first warnings says so"
    NOTE = "a warning says what is assumed"


class Found(NamedTuple):
    """Evidence that a check found.

    Attributes
    ----------
    texts : sequence of str
        Sentences; none where all is well.
    case : Case, optional
        The case without what cannot be used; None where it stays as it is.
    faulty : sequence of Faulty
        Channels that the answer begins with.
    """

    texts: Sequence[str] = ()
    case: Case | None = None
    faulty: Sequence[Faulty] = ()


Evidence = Callable[[Case, DiagnosisSettings], Found]


@dataclass(frozen=True)
class Check:
    """One question about a case before any fit.

    Attributes
    ----------
    name, channels, question : str
        In plain words: name, what of a case is looked at, and what is well where it is answered
        with yes.
    action : Action
        What is done where it is not.
    evidence : callable
        Evidence that a case gives. A check that leaves recordings out is asked of each by itself.
    of_rig : bool
        True where a recording with such evidence cannot be of the rig: asked on import, too, and
        all evidence of that kind is listed when a case is refused.
    prepared : bool
        True where recordings that are ready to be fitted are needed.
    repeats : Action
        Sentences of checks with this action are printed below a refusal: they may explain it.
    """

    name: str
    channels: str
    question: str
    action: Action
    evidence: Evidence
    of_rig: bool = False
    prepared: bool = False
    repeats: Action = Action.DOUBT


def _each(evidence: Callable[[Recording, Rig, DiagnosisSettings], Iterable[str]]) -> Evidence:
    """Evidence of all recordings of a case from that of one; empty texts are none."""
    return lambda case, settings: Found(
        [text for r in case.recordings for text in evidence(r, case.rig, settings) if text]
    )


def _mended(
    mend: Callable[[Case, DiagnosisSettings], tuple[list[Recording], Sequence[str | Faulty]]],
) -> Evidence:
    """Evidence, and the case with the recordings that are left, from what gives both."""

    def evidence_of(case: Case, settings: DiagnosisSettings) -> Found:
        recordings, evidence = mend(case, settings)
        faulty = [one for one in evidence if isinstance(one, Faulty)]
        texts = [one for one in evidence if isinstance(one, str)]
        return Found(texts, replace(case, recordings=recordings), faulty)

    return evidence_of


def _unforced(case: Case, _: DiagnosisSettings) -> Found:
    """Evidence of a load frame without its force."""
    frame = (case.rig.model["load"] or {}).get("kind") == "frame"
    text = (
        f"load.kind = 'frame' of case {case.name!r} holds the length, so that only its force "
        f"can be judged: every recording needs the channel force; all have "
        f"{', '.join(case.channels)}"
    )
    return Found([text] if frame and "force" not in case.channels else [])


def _fixed(recording: Recording, rig: Rig, _: DiagnosisSettings) -> list[str]:
    """Evidence of values of a recording that no recording has of its own."""
    free = varying(rig, core_rig(rig))
    fixed = [name for name in recording.parameters if name not in free]
    text = (
        f"parameters of recording {recording.name!r}: {', '.join(fixed)} cannot differ "
        f"between recordings of a diagnosis; what can: {', '.join(sorted(free))}"
    )
    return [text] if fixed else []


def _room(case: Case, settings: DiagnosisSettings) -> Found:
    """Case with its rig at the room's temperature."""
    rig, notes = at_ambient(case.rig, case.recordings, settings)
    return Found(notes, replace(case, rig=rig))


def _held(case: Case, _: DiagnosisSettings) -> Found:
    """Case with its rig without effects that no baseline can hold."""
    return Found(_notes_on_held(case.rig), replace(case, rig=without_passing(case.rig)))


def _closed(recording: Recording, rig: Rig) -> str:
    """Reason why no block can be cut out of a recording by itself; empty where one may be."""
    wanted = [dotted("muscle_pressure", name) for name in rig.tables("chamber")]
    return (
        ""
        if {*wanted} & {*recording.channels} or available_blocks(rig, tuple(recording.channels))
        else f"it has no channel {' or '.join(wanted)}, without which no block can be cut out; it "
        f"has: {', '.join(recording.channels)}"
    )


def _open(case: Case, _: DiagnosisSettings) -> Found:
    """Evidence of channels that surround no block."""
    text = (
        f"case {case.name!r}: its channels ({', '.join(case.channels)}) do not surround any "
        f"block of the rig ({', '.join(case.rig.blocks)}); measure {_lacking(case)}"
    )
    return Found([] if blocks_with_tanks(case.rig, case.channels) else [text])


def _turned(case: Case, settings: DiagnosisSettings) -> Found:
    """Evidence of angles and lengths that go another way than the model's."""
    rig, core = case.rig, core_rig(case.rig)
    blocks = available_blocks(rig, case.channels)
    if not blocks or any(unusable(r, rig, core, settings) for r in case.recordings):
        return Found()
    return Found(turned_about(blocks, [prepare(r, rig, settings) for r in case.recordings], core))


CHECKS: Final = (
    Check(
        "load frame",
        "`force`",
        "Does each recording have the force, where a frame holds the length?",
        Action.REFUSE,
        _unforced,
    ),
    Check(
        "values of a recording",
        "`parameters` of `case.toml`",
        "Can each of them differ between recordings?",
        Action.REFUSE,
        _each(_fixed),
    ),
    Check(
        "units",
        "channels whose log says a unit",
        "Do physics and the rig file agree with the unit?",
        Action.DOUBT,
        lambda case, settings: Found(suspected_units(case)),
    ),
    Check(
        "units and parts without a word",
        "channels whose log says no unit; parts of a log",
        "Does the log say the unit, and is each part of it in a recording?",
        Action.DOUBT,
        lambda case, settings: Found(noted_units(case)),
    ),
    Check(
        "room",
        "`ambient_temperature`",
        "Can a room have it?",
        Action.REFUSE,
        lambda case, settings: Found(impossible_rooms(case.recordings, settings)),
    ),
    Check(
        "temperature",
        "`ambient_temperature`",
        "Is it that of the rig file, and the same in all recordings?",
        Action.NOTE,
        _room,
    ),
    Check(
        "effects of the model",
        "`[[effects]]` of the rig file",
        "Is the model without effects so far?",
        Action.NOTE,
        _held,
    ),
    Check(
        "inlets",
        "`supply_pressure` of a tank in front of a regulator",
        "Was it recorded?",
        Action.NOTE,
        lambda case, settings: Found(_notes_on_inlets(case.rig, case.channels)),
    ),
    Check(
        "commands with gauges",
        "`valve_command`, `supply_command`, where gauges or a load cell say what moves",
        "Where it has one value throughout, can the pressure behind it be of that?",
        Action.TAKE_OUT,
        _mended(lambda case, _: without_dead_commands(case.recordings, case.rig)),
    ),
    Check(
        "missing commands",
        "`valve_command`, `supply_command`",
        "Is each command of the rig there, or all that it does measured?",
        Action.LEAVE_OUT_OR_REFUSE,
        _each(lambda r, rig, _: [uncommanded(r, rig, core_rig(rig).inputs)]),
    ),
    Check(
        "sample time",
        "time",
        "Is it short enough for the motion of a joint or a load?",
        Action.LEAVE_OUT_OR_REFUSE,
        _each(slow_clock),
        of_rig=True,
    ),
    Check(
        "sizes of pressures",
        "`muscle_pressure`, `line_pressure`, `supply_pressure`",
        "Has each the size of a pressure, and a supply's that of the rig file or of its command?",
        Action.LEAVE_OUT_OR_REFUSE,
        _each(impossible_pressures),
        of_rig=True,
    ),
    Check(
        "frozen gauges",
        "`supply_pressure` of tanks",
        "Does it change where air is drawn from the tank?",
        Action.LEAVE_OUT_OR_REFUSE,
        _each(frozen_tanks),
        of_rig=True,
    ),
    Check(
        "order of pressures",
        "`muscle_pressure`, `supply_pressure`",
        "Is each below that of what feeds it?",
        Action.LEAVE_OUT_OR_REFUSE,
        _each(swapped_pressures),
        of_rig=True,
    ),
    Check(
        "range and speed",
        "`joint_angle`, `length`",
        "Is it inside its range, no faster than it can be, and moving with its pressures?",
        Action.LEAVE_OUT_OR_REFUSE,
        _each(impossible_motion),
        of_rig=True,
    ),
    Check(
        "sense of valves",
        "`valve_command`, `muscle_pressure`",
        "Is the command in its range, and does the pressure follow it?",
        Action.LEAVE_OUT_OR_REFUSE,
        _each(reversed_valves),
        of_rig=True,
    ),
    Check(
        "commands",
        "`valve_command`, `supply_command`",
        "Where it has one value throughout, can the pressure behind it be of that?",
        Action.LEAVE_OUT_OR_REFUSE,
        _each(unlogged_commands),
        of_rig=True,
    ),
    Check(
        "end of a range",
        "all channels",
        "Is each inside its sensor's range, which one recording shows for all?",
        Action.MASK,
        _mended(lambda case, _: without_rails(case.recordings)),
    ),
    Check(
        "lost samples",
        "pressures, `valve_command`, `supply_command`, `joint_angle`, `length`",
        "Can each sample be of the rig?",
        Action.MASK,
        _mended(lambda case, limits: without_impossible(case.recordings, case.rig, limits)),
    ),
    Check(
        "copies",
        "channels that are measured",
        "Has each recording noise of its own?",
        Action.NO_PROOF,
        _mended(lambda case, _: without_copies(case.recordings)),
    ),
    Check(
        "slow thermometers",
        "`temperature`",
        "Is it usable, and each sample new?",
        Action.TAKE_OUT,
        _mended(lambda case, _: _without_poor_thermometers(case.recordings, case.rig)),
    ),
    Check(
        "usable samples",
        "channels that the blocks need",
        "Is the recording long enough, and is enough of each channel usable?",
        Action.LEAVE_OUT,
        _each(lambda r, rig, limits: [_closed(r, rig) or unusable(r, rig, core_rig(rig), limits)]),
    ),
    Check(
        "blocks",
        "all channels",
        "Do they surround a block of the rig?",
        Action.REFUSE,
        _open,
        repeats=Action.LEAVE_OUT,
    ),
    Check(
        "sense of motion",
        "`joint_angle`, `length`",
        "Does it go the way of the model, in its unit and with the pressures in their places?",
        Action.REFUSE,
        _turned,
        of_rig=True,
        prepared=True,
    ),
)
"""Every check, in the order in which it is asked."""

_BEFORE: Final = [check for check in CHECKS if not check.prepared]
_LOOKED_AT: Final = 20_000
"""Samples of a proposed recording that are looked at: all of a log would take long."""


@dataclass(frozen=True)
class DiagnosableCase:
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
    notes, masked : list of str
        What is no proof or taken as known; and samples that were masked.
    faulty : list of Faulty
        Sensors and commands that are dead or at the end of their range.
    """

    case: Case
    blocks: list[Block]
    suspected: list[str]
    doubts: list[str]
    notes: list[str]
    masked: list[str]
    faulty: list[Faulty]


def check_case(case: Case, settings: DiagnosisSettings) -> DiagnosableCase:
    """Ask all of :data:`CHECKS` of a case that need no prepared recordings.

    Raises
    ------
    DiagnosisError
        If recordings cannot be of this rig (units, swapped columns, dead sensors), or surround no
        block of it.
    """
    case = replace(case, recordings=with_declared_values(case.rig, case.recordings))
    said: dict[Action, list[str]] = {action: [] for action in Action}
    left = said[Action.LEAVE_OUT] = said[Action.LEAVE_OUT_OR_REFUSE]
    faulty = list[Faulty]()
    try:
        for _, alike in groupby(_BEFORE, key=lambda one: (one.action, one.of_rig)):
            checks = list(alike)
            action = checks[0].action
            if action in (Action.LEAVE_OUT, Action.LEAVE_OUT_OR_REFUSE):
                case, texts = _without_faulty(case, checks, settings)
                said[action] += texts
                continue
            for check in checks:
                found = check.evidence(case, settings)
                if action is Action.REFUSE and found.texts:
                    raise DiagnosisError(found.texts[0])
                case = case if found.case is None else found.case
                said[action] += found.texts
                faulty += found.faulty
    except DiagnosisError as error:
        raise DiagnosisError("\n".join([str(error), *said[checks[0].repeats]])) from error
    blocks = blocks_with_tanks(case.rig, case.channels)
    return DiagnosableCase(
        case,
        blocks,
        left,
        said[Action.DOUBT],
        [*said[Action.NO_PROOF], *said[Action.NOTE]],
        [*said[Action.MASK], *said[Action.TAKE_OUT]],
        faulty,
    )


def _without_faulty(
    case: Case, checks: Sequence[Check], settings: DiagnosisSettings
) -> tuple[Case, list[str]]:
    """Case without recordings of which checks have evidence, and a sentence for each."""
    faults: dict[str, list[str]] = {}
    for recording in case.recordings:
        one = replace(case, recordings=[recording])
        if texts := [text for check in checks for text in check.evidence(one, settings).texts]:
            faults[recording.name] = texts
    rest, said = left_out(case, {name: "; ".join(texts) for name, texts in faults.items()})
    if faults and not said and checks[0].action is Action.LEAVE_OUT_OR_REFUSE:
        lines = [f"recording {name!r}: {text}" for name, texts in faults.items() for text in texts]
        raise DiagnosisError(_not_of_rig(case.name, lines) if checks[0].of_rig else lines[0])
    return rest, said


def _not_of_rig(case: str, findings: Sequence[str]) -> str:
    """Message on evidence that recordings are not of the rig of their case."""
    more = len(findings) - MOST_LISTED
    lines = [*findings[:MOST_LISTED], *[f"and {more} more of this kind"] * (more > 0)]
    return joined(
        f"case {case!r}: these recordings cannot be of this rig; nothing was fitted", lines
    )


def implausible(recording: Recording, rig: Rig, settings: DiagnosisSettings) -> list[str]:
    """Everything about a recording that cannot be of a rig, in words, before it is prepared.

    Returns
    -------
    list of str
        One line for each finding; empty for a sound recording.
    """
    case = Case(recording.name, rig, [recording], Path())
    sources = [check.evidence for check in _BEFORE if check.of_rig]
    return [text for evidence in sources for text in evidence(case, settings).texts]


def check_sense(
    blocks: Sequence[Block], recordings: Sequence[Prepared], core: _core.Rig, case: str
) -> None:
    """Refuse joint angles that are the model's own in another unit, and angles and lengths that go
    the opposite way throughout.

    Parameters
    ----------
    blocks : sequence of Block
        Those whose output is an angle or a length are looked at.
    recordings : sequence of Prepared
        Recordings with drives.
    core : _core.Rig
        The nominal rig, compiled.
    case : str
        Name of the case, for the message.

    Raises
    ------
    DiagnosisError
        With every finding.
    """
    if findings := turned_about(blocks, recordings, core):
        raise DiagnosisError(_not_of_rig(case, findings))


def questions(proposed: LogProposal, rig: Rig, settings: DiagnosisSettings) -> list[str]:
    """Questions about a proposed log that a diagnosis would refuse, before it becomes a case.

    Returns
    -------
    list of str
        Why :func:`check_case` would refuse it; empty for a sound log, or one without a clock.
    """
    found = list[str]()
    try:
        recordings = proposed.recordings(ambient_of(rig))
    except RecordingError as error:
        return [str(error)]
    for recording in recordings:
        part = recording.between(stop=min(recording.duration, _LOOKED_AT * recording.sample_time))
        one = Case(part.name, rig, [part], Path())
        found += implausible(part, rig, settings) or _turned(one, settings).texts
    return list(dict.fromkeys(found))[:MOST_LISTED]


def left_out(case: Case, faults: Mapping[str, str]) -> tuple[Case, list[str]]:
    """The case without recordings that cannot be used, which would hold up the others.

    Parameters
    ----------
    case : Case
        The case.
    faults : mapping of str to str
        Why recordings cannot be used, in words, by name.

    Returns
    -------
    case : Case
        With all recordings where none to be fitted would be left.
    said : list of str
        A sentence for each recording that is left out.
    """
    rest = replace(case, recordings=[r for r in case.recordings if r.name not in faults])
    if not faults or not (rest.fit if case.fit else rest.recordings):
        return case, []
    return rest, [f"recording {name!r} is left out: {why}" for name, why in faults.items()]


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


def _holdable(entry: Mapping[str, Any]) -> bool:
    """True where an effect of a model can be part of a baseline that all recordings share."""
    if entry["id"] not in CATALOGUE:
        return False
    return not EFFECTS[entry["id"]].form(entry.get("form", "")).transient


def without_passing(rig: Rig) -> Rig:
    """Rig without effects that no baseline can hold: events, and forms without a name."""
    for entry in rig.effects:
        if not _holdable(entry):
            rig = rig.without_effect(entry["id"], at=entry.get("at", ""))
    return rig


def _notes_on_held(rig: Rig) -> list[str]:
    """Sentences on effects that the model holds already, and on those that it cannot hold."""

    def named(entry: dict[str, Any]) -> str:
        place = f" at {entry['at']}" if "at" in entry else ""
        return f"{EFFECTS[entry['id']].name} ({entry['id']}{place})"

    held = [named(entry) for entry in rig.effects if _holdable(entry)]
    passing = [named(entry) for entry in rig.effects if not _holdable(entry)]
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


def noted_units(case: Case) -> list[str]:
    """Sentences on what the files of a case do not say: units that were assumed, ambient pressures
    that were subtracted, parts that no recording takes.

    Returns
    -------
    list of str
        Sentences, with the recordings that they are about.
    """
    where: dict[str, list[str]] = {}
    for recording in case.recordings:
        for channel, note in recording.notes.items():
            where.setdefault(f"{channel} {note}", []).append(recording.name)
    notes = [f"{', '.join(names)}: {text}" for text, names in where.items()]
    for source in dict.fromkeys(recording.source for recording in case.recordings):
        lefts = [recording.left for recording in case.recordings if recording.source == source]
        lost = [part for part in lefts[0] if all(part in lefts_of_one for lefts_of_one in lefts)]
        some = ", ".join(lost[:MOST_LISTED]) + " and so on" * (len(lost) > MOST_LISTED)
        if lost:
            notes.append(
                f"{Path(source).name}: {len(lost)} of the parts of this log ({some}) are in no "
                "recording of the case (pieces in case.toml)"
            )
    return notes


def suspected_units(case: Case) -> list[str]:
    """Units in which a case's files say that they are and that physics contradicts, with the
    evidence; each channel once.

    Parameters
    ----------
    case : Case
        Recordings and rig; of recordings that were read from no file nothing is suspected.

    Returns
    -------
    list of str
        Sentences, with the recordings that they are about.
    """
    where: dict[str, list[str]] = {}
    evidence: dict[str, str] = {}
    for recording in case.recordings:
        channels = {
            name: np.where(recording.mask[name], values, np.nan)
            for name, values in recording.channels.items()
        }
        for suspicion in suspicions(channels, recording.said, recording.rig_there(case.rig)):
            where.setdefault(suspicion.channel, []).append(recording.name)
            evidence.setdefault(suspicion.channel, suspicion.text)
    return [f"{', '.join(where[channel])}: {text}" for channel, text in evidence.items()]


# [K] between recordings' rooms, taken for one: it moves a valve's flow by one percent
_MOST_ROOM_SPREAD = 3.0


AMBIENT = "ambient_temperature"
AMBIENT_PRESSURE = "ambient_pressure"
"""Used where a recording is read: it makes absolute pressures gauge pressures."""
_NAME = "gas.temperature"
_SAME = 0.1
"""Temperatures that differ by less are reported as the same [K]."""


def _rooms(recordings: Sequence[Recording]) -> list[tuple[str, float]]:
    """Medians of what recordings have of the ambient temperature [K], with their names."""
    return [
        (r.name, float(np.median(values[good])))
        for r in recordings
        for name, values in r.channels.items()
        if channel_of(name) == AMBIENT and (good := r.mask[name] & np.isfinite(values)).any()
    ]


def impossible_rooms(recordings: Sequence[Recording], settings: DiagnosisSettings) -> list[str]:
    """A sentence on ambient temperatures that no room has; none where there are none."""
    low, high = settings.least_room, settings.most_room
    rooms = _rooms(recordings)
    wrong = [f"{name} ({value:.1f} K)" for name, value in rooms if not low <= value <= high]
    text = (
        f"{AMBIENT} of {', '.join(wrong)}: no room has it, {low:g} to {high:g} K are allowed; "
        "correct its unit or calibration, or leave the channel out"
    )
    return [text] if wrong else []


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
        How far from that of the rig file they may be.

    Returns
    -------
    rig : Rig
    notes : list of str
        What was set, in words, and what makes one doubt it.

    Raises
    ------
    DiagnosisError
        If no rig can have a temperature.
    """
    medians = _rooms(recordings)
    if not medians:
        return rig, []
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
        limits.append(settings.most_tolerances * stated.tol)
    away = abs(value - stated.value)
    if away <= min(limits):
        return []
    known = f" (known to {stated.tol:.2g} K)" if 0.0 < stated.tol < np.inf else ""
    return [
        f"{AMBIENT} is {away:.1f} K away from {_NAME} of the rig file{known}: a sensor that is not "
        "connected, or lies elsewhere, reads so, and all that flows is judged by it; leave the "
        "channel out where it is none of the room"
    ]


# samples next to one at its sensor's end, masked as well: their noise is cut off on one side
_RAIL_SAMPLES = 3


def without_rails(recordings: Sequence[Recording]) -> tuple[list[Recording], list[Faulty]]:
    """Recordings without the samples that a sensor reads at the end of its range.

    A sensor ends where it ends: the end that one recording shows, by staying there for long, is
    that of all of them, and a sample there may be of anything beyond. Samples next to such a one
    are those of which the noise let through the lower half, and go with it.

    Returns
    -------
    recordings : list of Recording
    faults : list of Faulty
        Each channel with such an end.
    """
    ends: dict[str, set[float]] = {}
    for recording in recordings:
        for issue in recording.issues:
            if issue.rail is not None:
                ends.setdefault(issue.channel, set()).add(issue.rail)
    masked, faults = list(recordings), list[Faulty]()
    for channel, rails in ends.items():
        for rail in sorted(rails):
            counts: dict[str, int] = {}
            samples = [
                r.channels[channel][r.mask[channel]] for r in masked if channel in r.channels
            ]
            every = np.concatenate(samples)
            if every.min() < rail < every.max():
                continue  # it stayed there, and reads more elsewhere
            for k, recording in enumerate(masked):
                if channel not in recording.channels:
                    continue
                bad = _beyond(recording, channel, rail, _RAIL_SAMPLES)
                if bad.any():
                    counts[recording.name] = int(bad.sum())
                    masked[k] = _masked(recording, channel, bad)
            faults.append(Faulty(channel, "clipped", _sentence(masked, channel, rail, counts)))
    return masked, faults


def _beyond(recording: Recording, channel: str, rail: float, neighbours: int) -> Mask:
    """Samples of a channel at the end of its range, with their neighbours; those that are masked
    because they stay there included.
    """
    values, mask = recording.channels[channel], recording.mask[channel]
    inside = values[mask]
    if not inside.size:
        return np.zeros_like(mask)
    upper = rail >= float(np.median(inside))
    slack = 1e-9 * max(1.0, abs(rail))
    at_end = mask & (values >= rail - slack if upper else values <= rail + slack)
    for issue in recording.issues:
        if issue.channel == channel and issue.rail == rail:
            # what is reported of several stretches together lies anywhere between its ends
            between = (recording.time >= issue.start) & (recording.time <= issue.stop)
            at_end |= between & ~mask
    bad: Mask = binary_dilation(at_end, iterations=neighbours) if at_end.any() else at_end
    return bad


def _masked(recording: Recording, channel: str, bad: Mask) -> Recording:
    values = np.where(bad, np.nan, recording.channels[channel])
    mask = recording.mask[channel] & ~bad
    return replace(
        recording,
        channels=recording.channels | {channel: values},
        mask=recording.mask | {channel: mask},
    )


def _sentence(
    recordings: Sequence[Recording], channel: str, rail: float, counts: dict[str, int]
) -> str:
    """Sentence on the end of a sensor's range, and on samples masked for it in each recording."""
    unit = next((u for r in recordings if (u := r.said.get(channel))), "")
    if unit:
        parsed = parse_unit(unit)
        value = f"{(rail - parsed.offset) / parsed.scale:.6g} {unit}"
    else:
        value = f"{rail:.6g} {next(r.units.get(channel, 'SI') for r in recordings)}"
    counted = [f"{count} in {name}" for name, count in counts.items()]
    more = len(counted) - MOST_LISTED
    examples = ", ".join(counted[:MOST_LISTED]) + f" and more in {more} others" * (more > 0)
    return (
        f"{channel} is clipped: its sensor's range ends at {value}; samples there, and "
        f"their neighbours, were masked in all recordings ({examples})"
    )


# share of new samples (no repeats, no lines) from which a thermometer keeps up with the log
_LEAST_NEW_SHARE = 0.5


def _without_poor_thermometers(
    recordings: Sequence[Recording], rig: Rig
) -> tuple[list[Recording], list[str]]:
    """Recordings without the temperatures of gases that cannot be judged in each of them, and
    sentences that say so.

    No block needs a thermometer: one that fails, or whose samples repeat or lie on straight lines
    between fewer ones, is left out. The noise of the latter would be taken for far less than it is.
    """
    notes = []
    for name in thermometers_of(rig).values():
        faults = [
            f"in {r.name!r} {fault}"
            for r in recordings
            if name in r.channels and (fault := _fault(r, name))
        ]
        if faults:
            notes.append(f"{name} is not judged: {'; '.join(faults)}")
            recordings = [without_channel(r, name) if name in r.channels else r for r in recordings]
    return list(recordings), notes


def _fault(recording: Recording, name: str) -> str:
    """Reason why a temperature cannot be judged; empty where it can."""
    values, mask = recording.channels[name], recording.mask[name]
    if few_usable(mask):
        return f"only {int(mask.sum())} of {mask.size} samples are usable"
    bends = np.abs(np.diff(values[mask], 2))
    new = float(np.mean(bends > 1e-6 * float(np.ptp(values[mask]))))
    if 0.0 < new < _LEAST_NEW_SHARE:
        return (
            f"one sample in {1.0 / new:.1f} is new, the others repeat or lie on lines between: log "
            "it as fast as the pressures, or the pressures as slowly"
        )
    return ""
