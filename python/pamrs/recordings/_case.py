"""Cases, folders with a rig and the recordings made on it; tables in memory; files whose headings
say it all, ``muscle_pressure [bar]``.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pamrs._arrays import Array
from pamrs._checks import as_said, is_quantity, misshapen, one_of, plain, refused
from pamrs._files import MOST_NAME, found_outside, resolved, shown, toml_document
from pamrs._views import COLOURS, Curve, Panels, View, over_time
from pamrs.channels import CHANNELS, channel_of, unit_of
from pamrs.declared import problems_of
from pamrs.effects import find_parameter
from pamrs.errors import CaseError, ParameterError, RecordingError, RigError, joined, meant
from pamrs.recordings._doubts import ambient_of, limits_of, unit_trouble
from pamrs.recordings._from_log import check_asked, completed, load_recordings, recordings_of
from pamrs.recordings._recording import Issue, OwnValue, Recording
from pamrs.recordings.logs import Log, Series, TextFormat, check_readable, read_log, table_of
from pamrs.recordings.mapping import (
    DIALECT,
    ENTRY,
    ERRORS,
    FORMAT,
    LOG,
    OF_A_LOG,
    TOP,
    Clock,
    Source,
)
from pamrs.recordings.table import (
    Table,
    check_marks,
    is_text,
    read_table,
    renamed,
    stem_of,
    thousands_of,
)
from pamrs.rig import Parameter, Rig, check_sample_time, effect_parameter, load_rig
from pamrs.units import measured_from, to_si

HEADING: Final = re.compile(r"^\s*(?P<name>[^\[\]]*?)\s*(?:\[(?P<unit>[^\[\]]*)\])?\s*$")


def load_recording(
    path: str | os.PathLike[str],
    *,
    columns: Sequence[str] | Mapping[str, str] | None = None,
    delimiter: str = ",",
    header: bool = True,
    thousands: str | Mapping[str, str] | None = None,
    sample_time: float | None = None,
    decimal: str = ".",
    name: str | None = None,
    role: str = "fit",
    ambient_pressure: float | None = None,
) -> Recording:
    """Read a recording, check it and lay it on a uniform grid.

    Parameters
    ----------
    path : path-like
        ``.csv``, ``.tsv``, ``.txt``, ``.dat`` (each also ``.gz``), or any other log that
        :func:`pamrs.recordings.logs.read_log` reads, such as ``.parquet``.
    columns : sequence or mapping of str, optional
        Headings ``"name [unit]"`` to use instead of the file's: one for each column in order, or a
        mapping from the file's headings. An empty heading leaves the column out.
    delimiter : str
        What separates cells; ``" "`` means any run of blanks.
    header : bool
        Whether the first row holds headings.
    thousands : str or mapping, optional
        Mark between groups of digits, of all columns or by channel: ``{"time": "."}``.
    sample_time : float, optional
        Grid spacing [s]; without a time column, the spacing of the rows. Else the usual interval.
    decimal : str
        Decimal mark.
    name, role : str
        Name (default: the file's stem) and role, ``fit`` or ``held_out``.
    ambient_pressure : float, optional
        What is subtracted from absolute pressures (``bar(a)``) where the file has no channel
        ``ambient_pressure`` [Pa]; by default that of the standard atmosphere.

    Returns
    -------
    Recording
        SI values with masks and issues.

    Raises
    ------
    RecordingError
        If the file cannot be read or a column cannot be understood; the message names file and
        column.
    """
    file = Path(path)
    source = str(file)
    check_asked(source, role, sample_time)
    check_marks(delimiter, decimal, source)
    marks = {thousands} if isinstance(thousands, str) else set((thousands or {}).values())
    if decimal == "," and decimal in marks:  # a column whose points part thousands has no fractions
        raise RecordingError(
            f"{source}: thousands = {decimal!r} is not allowed: it is the decimal mark"
        )
    if file.is_dir():
        raise RecordingError(f"{source}: cannot be read (a folder, not a file)")
    if not header and not isinstance(columns, Sequence):
        raise RecordingError(
            f"{source}: without a header, columns must list what each column is: 'name [unit]'"
        )
    if is_text(file):
        table = read_table(file, delimiter=delimiter, header=header)
    else:
        table = table_of(read_log(file))
    wanted = _understood(renamed(table, columns, source), source)
    if "time" not in wanted and sample_time is None:
        raise RecordingError(
            f"{source}: column 'time' is missing (give sample_time if the rows are evenly spaced)"
        )
    log, missing = _log(file, table, wanted, thousands, decimal)
    clock = Clock("time", wanted["time"][1]) if "time" in wanted else Clock()
    sources = [
        Source(channel, channel, unit, absolute)
        for channel, (_, unit, absolute) in wanted.items()
        if channel != "time"
    ]
    (made,) = recordings_of(log, sources, clock, name or stem_of(file), role, sample_time)
    issues = [Issue("log", channel, 0.0, made.duration, text) for channel, text in missing]
    made = replace(made, issues=[*issues, *made.issues])
    return completed(made, sources, source, ambient_pressure)


# ------------------------------------------------------------------------- columns


def _understood(headings: list[str], source: str) -> dict[str, tuple[int, str, bool]]:
    """Canonical name -> (column, unit, whether absolute) of every heading that is to be used."""
    problems: list[str] = []
    wanted: dict[str, tuple[int, str, bool]] = {}
    for index, heading in enumerate(headings):
        if not heading.strip():
            continue
        match = HEADING.match(heading)
        name = match["name"] if match else heading
        channel = channel_of(name)
        known = channel in CHANNELS and (channel != "time" or name == channel)
        if match is None or not known or name.endswith("."):
            hint = meant(channel.lower(), CHANNELS)
            problems.append(
                f"unknown column {heading!r}; {hint} (columns = {{{heading!r} = ''}} leaves it out)"
            )
            continue
        unit = match["unit"]
        if unit is None or not unit.strip():
            problems.append(
                f"column {heading!r} has no unit: write '{name} [{CHANNELS[channel].unit}]', with "
                "the unit its values are in"
            )
        elif name in wanted:
            problems.append(f"column {heading!r}: the channel {name!r} is there twice")
        else:
            alone, kind = measured_from(unit.strip())
            if trouble := unit_trouble(channel, alone):
                problems.append(f"column {heading!r}: {trouble}")
            wanted[name] = (index, alone, kind == "absolute")
    if not problems and not set(wanted) - {"time"}:
        problems.append("there is no channel to use")
    if problems:
        raise RecordingError(joined(source, problems))
    return wanted


def _log(
    file: Path,
    table: Table,
    wanted: Mapping[str, tuple[int, str, bool]],
    thousands: str | Mapping[str, str] | None,
    decimal: str,
) -> tuple[Log, list[tuple[str, str]]]:
    """The channels of a table as series; what is no number counts as missing, and is said."""
    if isinstance(thousands, Mapping):
        strange = [key for key in thousands if key not in wanted]
        if strange:
            raise RecordingError(
                f"{file}: thousands names {strange[0]!r}, but the channels are: {', '.join(wanted)}"
            )
    series: dict[str, Series] = {}
    remarks: list[tuple[str, str]] = []
    for name, (index, unit, _) in wanted.items():
        mark = thousands_of(thousands, name)
        values, missing = table.samples(index, f"{name} [{unit}]", str(file), mark, decimal)
        remarks += [(name, missing)] if missing else []
        series[name] = Series(name, values, unit)
    return Log(file, series, remarks=table.remarks), remarks


_NUMBERS = "biuf"  # kinds of arrays that are numbers
_DATES = "mM"  # kinds that are times
_MIXED = "OU"  # kinds that may be numbers among other things


class Arrays(NamedTuple):
    """A recording's channels.

    Attributes
    ----------
    values : dict of str to (n,) array
        By name.
    units : dict of str to str
        Of those whose table says it: in the heading (``muscle_pressure [bar]``), or in ``attrs`` of
        a column or a frame.
    """

    values: dict[str, Array]
    units: dict[str, str]


def is_table(thing: Any) -> bool:
    """True where something has channels by name: a dict, DataFrame or Dataset."""
    return isinstance(thing, Mapping) or hasattr(thing, "columns")


def _arrays_of(
    recordings: Mapping[str, Any],
    held_out: Sequence[str],
    units: Mapping[str, str],
    sample_time: float | None,
) -> dict[str, Arrays]:
    """Arrays by recording and channel, ``time`` among them where a table has one, as a channel, an
    index or a coordinate.
    """
    if not isinstance(recordings, Mapping) or not recordings:
        raise CaseError(
            f"recordings = {as_said(recordings)} is not allowed: a mapping from names to tables, "
            "one at least, is needed"
        )
    problems = list[str]()
    tables = {name: _table(problems, name, table, units) for name, table in recordings.items()}
    problems += [
        f"recording {name!r} has no times: give it a channel time [s], or sample_time"
        for name, table in tables.items()
        if table.values and "time" not in table.values and sample_time is None
    ]
    problems += _names(tables, held_out, units)
    if problems:
        raise CaseError(joined("case", problems))
    return tables


def _table(problems: list[str], name: Any, table: Any, given: Mapping[str, str]) -> Arrays:
    """Read the channels of one recording, with units given apart; adds to `problems`."""
    if not isinstance(name, str):
        problems.append(f"recording {name!r}: a name is needed that is a text")
    found = Arrays({}, {})
    if not is_table(table):
        needed = "a dict of arrays, DataFrame or Dataset is needed"
        problems.append(f"recording {name!r} = {as_said(table)}: {needed}")
        return found
    pairs = [(*_heading(key), values) for key, values in table.items()]
    if "time" not in [key for key, _, _ in pairs]:
        pairs += _times(table)
    keys = [key for key, _, _ in pairs]
    twice = [key for key in dict.fromkeys(keys) if keys.count(key) > 1]
    problems += [f"recording {name!r} has {key!r} twice" for key in twice]
    for key, unit, values in pairs:
        label = f"recording {name!r}, {key!r}"
        own = unit_of(key)
        if is_quantity(values):
            try:
                values = plain(label, values, own)
            except ParameterError as error:
                problems.append(str(error))
                continue
            unit = own
            if key in given:
                problems.append(f"{label} has a unit of its own: units[{key!r}] is not allowed")
        dated = key == "time" and np.asarray(values).dtype.kind in _DATES
        array = _array(problems, label, values, dates=dated)
        if array is not None:
            found.values[key] = array
            if said := "s" if dated else unit or _noted(key, values, table):
                found.units[key] = said
    if len(found.values) == len(pairs) and len({a.size for a in found.values.values()}) > 1:
        lengths = ", ".join(f"{key} {values.size}" for key, values in found.values.items())
        problems.append(f"recording {name!r}: arrays of one length are needed, not {lengths}")
    if not set(found.values) - {"time"}:
        problems.append(f"recording {name!r} has no channel but time")
    return found


def _heading(key: Any) -> tuple[Any, str]:
    """Name and unit of ``muscle_pressure [bar]``; the unit is empty where it has none."""
    match = HEADING.match(key) if isinstance(key, str) else None
    return (match["name"], match["unit"] or "") if match and match["unit"] else (key, "")


def _noted(key: str, values: Any, table: Any) -> str:
    """The unit of a channel in ``attrs`` of itself, or of its table by name; empty without."""
    for one in (values, table):
        units = (getattr(one, "attrs", None) or {}).get("units")
        if isinstance(units, Mapping):
            units = units.get(key)
        if isinstance(units, str):
            return units
    return ""


def _times(table: Any) -> list[tuple[str, str, Any]]:
    """Times of a table that are an index or a coordinate called ``time``."""
    if "time" in getattr(table, "coords", ()):
        return [("time", "", table.coords["time"])]
    index = getattr(table, "index", None)
    name, unit = _heading(getattr(index, "name", None))
    return [("time", unit, index)] if name == "time" else []


def _array(problems: list[str], label: str, values: Any, *, dates: bool) -> Array | None:
    """One channel; times since the first where they are dates."""
    masked = np.ma.getmaskarray(values) if isinstance(values, np.ma.MaskedArray) else None
    array = np.asarray(values)
    if dates and array.size:
        since = array - np.fmin.reduce(array) if array.dtype.kind == "M" else array
        array = since / np.timedelta64(1, "s")
    mixed = array.flat if array.dtype.kind in _MIXED else ()
    if wrong := [value for value in mixed if not _is_number(value)]:
        problems.append(f"{label} has values that are no numbers, such as {as_said(wrong[0])}")
        return None
    array = array.astype(np.float64) if array.dtype.kind == "O" else array
    if array.dtype.kind not in _NUMBERS:
        problems.append(f"{label} has the type {array.dtype}: numbers are needed")
        return None
    if array.ndim != 1 or array.size == 0:
        problems.append(str(misshapen(label, array.shape)))
        return None
    found = array.astype(np.float64)
    if masked is not None:
        found[masked] = np.nan
    return found


def _is_number(value: Any) -> bool:
    """True where a value converts to a float, or is None because it was not measured."""
    try:
        return value is None or float(value) is not None
    except (TypeError, ValueError):
        return False


def _names(
    tables: Mapping[str, Arrays], held_out: Sequence[str], units: Mapping[str, str]
) -> list[str]:
    """Problems of `held_out` and `units`: recordings or channels in them that do not exist."""
    known = ", ".join(map(repr, tables))
    channels = {key for table in tables.values() for key in table.values}
    problems = [f"units[{k!r}]: no recording has that channel" for k in units if k not in channels]
    if isinstance(held_out, str):
        return [*problems, f"held_out = {held_out!r}: a list of names is needed"]
    wrong = [name for name in held_out if name not in tables]
    if wrong:
        problems.append(f"held_out = {wrong}: recordings are {known}")
    elif set(held_out) == set(tables):
        problems.append(f"held_out = {list(held_out)}: one recording is needed that is fitted")
    return problems


_OPTIONS: Final = ("name", "sample_time", "start", "stop", *LOG)
_RIG: Final = "rig.toml"
_TURN: Final = 2.0 * np.pi
_GIVE_BOTH: Final = (
    "give the folder of the case, and this file as its rig (CASE --rig FILE; in Python: "
    "load_case(CASE).with_rig(load_rig(FILE)))"
)
_LIES_OUTSIDE: Final = (
    "lies outside the case folder; copy it there, or allow it with "
    "--allow-outside (in Python: load_case(..., allow_outside=True))"
)


@dataclass(frozen=True, eq=False)
class Case(View):
    """A rig and its recordings.

    Attributes
    ----------
    name : str
        The folder's name, or what ``case.toml`` says.
    rig : Rig
        The nominal model.
    recordings : list of Recording
        In the order of ``case.toml``.
    path : Path
        The folder.
    description : str
        What ``case.toml`` says about it.
    inputs : dict of str to str
        SHA-256 of each file that it was read from; empty for a case of arrays.
    """

    name: str
    rig: Rig
    recordings: list[Recording]
    path: Path
    description: str = ""
    inputs: Mapping[str, str] = field(default_factory=dict)
    _rig_file: str = field(default="", repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", shown(self.name)[:MOST_NAME])
        object.__setattr__(self, "description", shown(self.description, lines=True))

    def _panels(self) -> Panels:
        series: dict[str, list[Curve]] = {}
        for number, recording in enumerate(self.recordings):
            colour = COLOURS[number % len(COLOURS)]
            style = {"color": colour, "ls": "-" if recording.role == "fit" else "--"}
            for name, values in recording.channels.items():
                line = (f"{recording.name} ({recording.role})", recording.time, values, style)
                series.setdefault(name, []).append(line)
        return over_time(series)

    def _numbers(self) -> dict[str, str]:
        numbers = {
            f"recording {one.name}": f"{one.role}, {one.duration:.4g} s, {len(one)} samples, "
            f"{len(one.issues)} issues"
            for one in self.recordings
        }
        return {"case": self.name, "rig": self.rig.name, **numbers}

    @property
    def fit(self) -> list[Recording]:
        """The recordings to fit."""
        return [recording for recording in self.recordings if recording.role == "fit"]

    @property
    def held_out(self) -> list[Recording]:
        """The recordings kept for the proof."""
        return [recording for recording in self.recordings if recording.role == "held_out"]

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels that every recording has."""
        first = self.recordings[0].channels
        return tuple(name for name in first if all(name in r.channels for r in self.recordings))

    @classmethod
    def from_arrays(
        cls,
        rig: Rig,
        recordings: Mapping[str, Mapping[str, ArrayLike]],
        *,
        sample_time: float | None = None,
        units: Mapping[str, str] | None = None,
        held_out: Sequence[str] = (),
        name: str = "case",
    ) -> Case:
        """A case out of arrays, DataFrames or other tables that are in memory.

        Recordings are checked and laid on a uniform grid as those of a case folder are.

        Parameters
        ----------
        rig : Rig
            The nominal model.
        recordings : mapping of str to mapping of str to array_like, shape (n,)
            By name of the recording its channels by theirs (``muscle_pressure.flexor``), as a dict
            of arrays, a DataFrame or a Dataset; NaN where nothing was measured. A channel, index or
            coordinate ``time`` has the times of all others, in seconds or as dates. A heading
            ``muscle_pressure [bar]`` says the unit, and so do ``attrs["units"]`` of a column (or of
            a frame, by column) and a pint quantity; without, SI is meant.
        sample_time : float, optional
            Spacing of samples [s]: of the recordings without ``time``, and of the grid of all.
        units : mapping of str to str, optional
            Units of channels that are not in SI units and do not say so: ``{"muscle_pressure":
            "bar"}``.
        held_out : sequence of str, optional
            Names of the recordings that are kept for the proof.
        name : str, optional
            Of the case.

        Raises
        ------
        CaseError
            If there is no recording or none to fit, a name in `held_out` or `units` is that of
            none, a recording has no times, or arrays are no numbers or differ in length.
        RecordingError
            If a channel is unknown, its unit is wrong, or times cannot be understood.

        Examples
        --------
        >>> import numpy as np
        >>> import pamrs
        >>> command = 5.0 + np.sin(np.arange(400) * 0.05)
        >>> run = pamrs.simulate(pamrs.rigs.shoulder(), command, sample_time=0.005)
        >>> arrays = {"valve_command": command, "muscle_pressure": run["muscle_pressure"]}
        >>> rig = pamrs.rigs.shoulder()
        >>> pamrs.Case.from_arrays(rig, {"run": arrays}, sample_time=0.005).channels
        ('valve_command', 'muscle_pressure')
        """
        if not isinstance(rig, Rig):
            raise CaseError(
                f"rig = {as_said(rig)} is not allowed: a Rig is needed, as of pamrs.load_rig"
            )
        written = dict(units or {})
        tables = _arrays_of(recordings, held_out, written, sample_time)
        spacing = None if sample_time is None else check_sample_time(rig, sample_time)
        made = list[Recording]()
        for called, (table, own_units) in tables.items():
            said = own_units | written
            channels = {key: said.get(key, unit_of(key)) for key in table if key != "time"}
            clock = {"column": "time", "unit": said.get("time", "s")}
            found = load_recordings(
                called,
                channels={key: {"column": key, "unit": unit} for key, unit in channels.items()},
                time=clock if "time" in table else None,
                sample_time=spacing,
                name=called,
                role="held_out" if called in held_out else "fit",
                log=Log(Path(called), {key: Series(key, own) for key, own in table.items()}),
                ambient_pressure=ambient_of(rig),
            )
            made += [_on_its_turn(each, rig) for each in found]
        return cls(name, rig, made, Path())

    def with_rig(self, rig: Rig, file: str | os.PathLike[str] | None = None) -> Case:
        """Copy of the case whose recordings are modelled by another rig.

        Parameters
        ----------
        rig : Rig
            The model to put in place.
        file : path-like, optional
            The file that it was read from, for `inputs`.
        """
        inputs = {name: digest for name, digest in self.inputs.items() if name != self._rig_file}
        if file is not None:
            inputs[str(file)] = _digest(Path(file))
        return replace(self, rig=rig, inputs=inputs, _rig_file="")


def load_case(folder: str | os.PathLike[str], *, allow_outside: bool = False) -> Case:
    """Read a case.

    Parameters
    ----------
    folder : path-like
        A folder with a ``case.toml`` of the schema ``pamrs.case/1``, or that file itself; or a rig
        file that a diagnosis wrote and that says from which case, which then is that case with this
        rig. File names in it are relative to the folder.
    allow_outside : bool
        Whether ``case.toml``, the rig file and recordings may lie outside the folder
        (``../run.csv``, or links, those in the folder of a bag too).

    Returns
    -------
    Case
        Rig and recordings.

    Raises
    ------
    CaseError
        If a file is missing or ``case.toml``, the rig or a recording is wrong; all problems are
        listed.
    """
    given = Path(folder)
    if given.is_file() and given.name != "case.toml":
        model, case = model_and_case(given)
        return load_case(case, allow_outside=allow_outside).with_rig(model, given)
    file = given if given.name == "case.toml" else given / "case.toml"
    home = file.parent
    if file != given and not allow_outside and found_outside(home, file) is not None:
        raise CaseError(f"{file}: {_LIES_OUTSIDE}")
    document = _document(file, given)
    problems = problems_of("", document, TOP, needed=("schema",), skip=("recording",))
    texts = {"name": resolved(home).name, "description": "", "source": "", "rig": _RIG}
    texts |= {key: value for key in texts if isinstance(value := document.get(key), str)}
    outside = [] if allow_outside else _outside(home, document)
    if outside:  # nothing there is opened
        raise CaseError(joined(str(file), [*problems, *outside]))
    rig = _rig(problems, home, texts["rig"])
    recordings = _recordings(problems, home, document.get("recording"), texts["source"], rig)
    if problems or rig is None:
        raise CaseError(joined(str(file), problems))
    inputs, about = _digests(home, document), texts["description"]
    return Case(texts["name"], rig, recordings, home, about, inputs, texts["rig"])


def _digests(home: Path, document: Mapping[str, Any]) -> dict[str, str]:
    """SHA-256 of each file of a case, by its name in ``case.toml``; without folders."""
    logs = [own.get("file") for own in document.get("recording", [])]
    names = ["case.toml", document.get("rig", _RIG), document.get("source"), *logs]
    wanted = dict.fromkeys(name for name in names if isinstance(name, str) and name)
    return {name: _digest(home / name) for name in wanted if (home / name).is_file()}


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def model_and_case(file: Path) -> tuple[Rig, Path]:
    """A rig file that a diagnosis wrote, and the folder of the case from which it did.

    Raises
    ------
    CaseError
        If it is no rig file, or does not say from which case it is.
    """
    try:
        rig = load_rig(file)
    except RigError as error:
        raise CaseError(str(error)) from error
    if not rig.case:
        raise CaseError(f"{file}: a rig file that does not say from which case it is; {_GIVE_BOTH}")
    home = file.parent / rig.case
    if not home.is_dir():
        raise CaseError(
            f"{file}: case = {rig.case!r}: there is no folder {os.path.normpath(home)}; "
            f"{_GIVE_BOTH}"
        )
    return rig, home


def _document(file: Path, given: Path) -> dict[str, Any]:
    if not given.exists():
        raise CaseError(f"{given}: no such case folder")
    if not file.exists():
        below = next(iter(sorted([*given.glob("*/case.toml"), *given.glob("*/*/case.toml")])), None)
        hint = "" if below is None else f"; did you mean {str(below.parent)!r}?"
        raise CaseError(f"{given}: not a case folder, it has no case.toml{hint}")
    return toml_document(file, CaseError)


def _outside(home: Path, document: Mapping[str, Any]) -> list[str]:
    """Problems of rig and recording files that lie outside the case folder."""
    entries = document.get("recording")
    named = [("rig", document.get("rig", _RIG))] + [
        (f"recording[{index}].file", entry.get("file"))
        for index, entry in enumerate(entries if isinstance(entries, list) else [])
        if isinstance(entry, Mapping)
    ]
    return [
        f"{key} = {name!r}: {'' if there == home / name else f'{there} '}{_LIES_OUTSIDE}"
        for key, name in named
        if isinstance(name, str)
        and "\0" not in name
        and (there := found_outside(home, home / name)) is not None
    ]


def _rig(problems: list[str], home: Path, name: str) -> Rig | None:
    try:
        return load_rig(home / name)
    except RigError as error:
        problems.append(f"rig = {name!r}: {error}")
        return None


def _recordings(
    problems: list[str], home: Path, entries: Any, source: str, rig: Rig | None
) -> list[Recording]:
    tables = isinstance(entries, list) and all(isinstance(entry, Mapping) for entry in entries)
    if not (tables and entries):
        problems.append(
            "recording is missing: one table [[recording]] with file and role for each is needed"
        )
        return []
    _check_logs(home, entries)
    recordings: list[Recording] = []
    logs: dict[Any, Log] = {}
    remarked: set[tuple[str, str, str]] = set()
    for index, entry in enumerate(entries):
        label = f"recording[{index}]."
        before = len(problems)
        rules = ENTRY | OF_A_LOG if "channels" in entry else ENTRY
        problems += problems_of(label, entry, rules, needed=("file",), skip=("parameters",))
        if "channels" not in entry:
            problems += [
                f"{label}{key} goes with channels, which is missing" for key in LOG if key in entry
            ]
        name, role = entry.get("file"), entry.get("role", "fit")
        own = _own_values(problems, label, entry.get("parameters", {}), rig)
        if len(problems) > before:
            continue
        file = home / str(name)
        if not file.exists():
            advice = f"; {source}" if source else "; copy it there, or correct file in case.toml"
            problems.append(
                f"{label}file = {name!r}: there is no file {os.path.normpath(file)}{advice}"
            )
            continue
        options = {key: entry[key] for key in FORMAT if key in entry}
        ambient = None if rig is None else ambient_of(rig)
        try:
            if "channels" in entry:
                parts = _from_log(file, role, entry, logs, ambient)
            else:
                options |= {"role": role, "name": entry.get("name"), "ambient_pressure": ambient}
                whole = load_recording(file, **options)
                parts = [whole.between(entry.get("start"), entry.get("stop"))]
            said = (replace(_once(part, remarked), parameters=own) for part in parts)
            recordings += [_on_its_turn(part, rig) for part in said]
        except RecordingError as error:
            problems.append(str(error))
    names = [recording.name for recording in recordings]
    problems += [
        f'two recordings are called {name!r}: give one another name (name = "..." in its '
        "[[recording]])"
        for name in dict.fromkeys(names)
        if names.count(name) > 1
    ]
    if recordings and not problems and all(each.role == "held_out" for each in recordings):
        problems.append("no recording has the role 'fit': nothing is left to fit")
    return recordings


def _once(recording: Recording, remarked: set[tuple[str, str, str]]) -> Recording:
    """Copy of a recording without remarks on its log that an earlier recording of that file has."""
    issues = []
    for issue in recording.issues:
        said = (recording.source, issue.channel, issue.text)
        if issue.kind != "log" or said not in remarked:
            issues.append(issue)
        if issue.kind == "log":
            remarked.add(said)
    return replace(recording, issues=issues)


def _on_its_turn(recording: Recording, rig: Rig | None) -> Recording:
    """Move joint angles outside the rig's limits back by whole turns (2 pi) where that fits."""
    for name, values in recording.channels.items():
        limits, used = limits_of(rig, name), recording.mask[name]
        if limits is None or channel_of(name) != "joint_angle" or not used.any():
            continue
        low, high = np.quantile(values[used], (0.01, 0.99))
        slack = 0.1 * (limits[1] - limits[0])
        turns = round((0.5 * (limits[0] + limits[1]) - 0.5 * (low + high)) / _TURN)
        away = turns * _TURN
        apart = high < limits[0] or low > limits[1]
        if turns and apart and limits[0] - slack <= low + away and high + away <= limits[1] + slack:
            text = f"{turns:+d} turns, which puts it between the ends in the rig file"
            issue = Issue("log", name, 0.0, recording.duration, text)
            channels = recording.channels | {name: values + away}
            recording = replace(recording, channels=channels, issues=[issue, *recording.issues])
    return recording


def _own_values(
    problems: list[str], label: str, given: Any, rig: Rig | None
) -> dict[str, OwnValue]:
    """Parameter values that hold in one recording alone, by name, from its table ``parameters``."""
    if not isinstance(given, Mapping):
        problems.append(
            f"{label}parameters = {given!r} is not allowed: a table of parameters of the rig, such "
            'as { "arm.payload" = { value = 12, unit = "kg" } }, is needed'
        )
        return {}
    found: dict[str, OwnValue] = {}
    for name, entry in given.items():
        try:
            found[name] = _own_value(name, entry, rig)
        except ParameterError as error:
            problems.append(f"{label}parameters.{name}: {error}")
    return found


def _own_value(name: str, entry: Any, rig: Rig | None) -> OwnValue:
    """Parameter value of one recording, from its entry in ``case.toml``, converted to SI."""
    table = dict(entry) if isinstance(entry, Mapping) else {"value": entry}
    value, unit, error = (table.pop(key, None) for key in ("value", "unit", "error"))
    if error == "own" and value is None and unit is None and rig is not None and not table:
        known = _known(rig, name)
        return OwnValue(known.value, known.value, error)
    if table or isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ParameterError(
            f"{entry!r} is not allowed: a table with value, unit and maybe error is needed"
        )
    if error is not None:
        one_of("error", error, ERRORS)
    if rig is None:  # said already
        return OwnValue(float(value), float(value))
    known = _known(rig, name)
    if not isinstance(unit, str):
        raise refused("unit", unit, f"a unit like {known.unit!r} is needed")
    found = OwnValue(to_si(float(value), unit, known.unit), known.value, error or "same")
    if error == "proportional" and known.value == 0.0:
        raise ParameterError("error = 'proportional' needs a value in the rig file that is not 0")
    if name in rig.parameters:
        rig.with_parameters({name: found.value})  # says what is possible
    return found


def _known(rig: Rig, name: str) -> Parameter:
    """A parameter of a rig, or of an effect that it holds."""
    found = effect_parameter(rig, name)
    if found is None:
        return rig.parameter(name)
    _, short, entry = found
    info = find_parameter(f"{entry['id']}.{short}")
    value = float(entry["parameters"][short])
    return Parameter(name, value, info.unit, 0.0, info.lower, info.upper)


def _check_logs(home: Path, entries: list[Mapping[str, Any]]) -> None:
    """Refuse a case whose logs need a package that is not there, before anything is read."""
    for entry in entries:
        file = home / str(entry.get("file"))
        if "channels" in entry and file.exists():
            with suppress(RecordingError):  # said with the other problems of its entry
                check_readable(file)


def _from_log(
    file: Path,
    role: str,
    entry: Mapping[str, Any],
    logs: dict[Any, Log],
    ambient: float | None,
) -> list[Recording]:
    """The recordings of an entry that says where its channels are; a file is read once."""
    dialect = {key: entry[key] for key in DIALECT if key in entry}
    if "columns" in entry:
        dialect["columns"] = tuple(entry["columns"])
    form = TextFormat(**dialect)
    key = (os.path.realpath(file), form)
    if key not in logs:
        logs[key] = read_log(file, form)
    options = {name: entry[name] for name in _OPTIONS if name in entry}
    return load_recordings(file, role=role, log=logs[key], ambient_pressure=ambient, **options)
