"""A case folder as the page shows and changes it: its rig, logs, case.toml, checks and results."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import tomlkit

from pamrs import rigs
from pamrs._checks import refused
from pamrs._files import MOST_NAME, found_outside, is_inside, parse_toml, read_toml, resolved, shown
from pamrs._writing import write_atomically
from pamrs.channels import channel_of
from pamrs.diagnosis import Diagnosis, DiagnosisSettings
from pamrs.diagnosis.prepare import check_case
from pamrs.diagnosis.result import load_result
from pamrs.errors import CaseError, PamrsError, ParameterError
from pamrs.recordings import Case, LogProposal, Proposal, channels_of, load_case, propose
from pamrs.recordings.logs import check_readable
from pamrs.rig import Rig, load_rig
from pamrs.simulation import core_rig
from pamrs.studio._run import RESULT, Run
from pamrs.units import to_si

ROLES: Final = {
    "fit": "fitted",
    "held_out": "held out, for the proof",
    "parts": "fitted, its last part held out",
    "": "left out",
}
_FEWEST_PARTS: Final = 3  # of a log of which one is held out
_HEAD: Final = "# Confirmed in pamrs studio.\n"
_MOST_LOGS: Final = 100


@dataclass(frozen=True)
class LogTable:
    """A log on the page: what is proposed for it, and the entries of case.toml that say so.

    Attributes
    ----------
    item : LogProposal
        The proposal.
    entries : list of dict
        Its entries; one without channels where none was recognised.
    """

    item: LogProposal
    entries: list[dict[str, Any]]

    @property
    def key(self) -> tuple[str, str]:
        """File of the log and, where the file has several tables, the name of this one."""
        return self.entries[0]["file"], self.entries[0].get("name", "")

    @property
    def roles(self) -> dict[str, str]:
        """Roles that the log can have, with their words."""
        several = len(self.item.pieces) >= _FEWEST_PARTS
        return {key: words for key, words in ROLES.items() if several or key != "parts"}

    @property
    def role(self) -> str:
        """Role that the log has."""
        return "parts" if len(self.entries) > 1 else str(self.entries[0].get("role", "fit"))

    def channel(self, column: str) -> tuple[str, dict[str, Any]]:
        """The channel that is proposed for a column, and what is said of it."""
        for name, entry in self.entries[0]["channels"].items():
            if entry["column"] == column:
                return name, entry
        return "", {}


class Studio:
    """One case folder; nothing outside of it is read or written.

    Parameters
    ----------
    folder : path-like
        A case folder, or one that is made.

    Attributes
    ----------
    folder : Path
        The folder, links followed.
    checked : CheckedCase or None
        The last check, if nothing was changed on the page since.
    run : Run or None
        The last diagnosis of this page.

    Raises
    ------
    OSError
        If the folder cannot be made, or is none.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        Path(folder).mkdir(parents=True, exist_ok=True)
        self.folder = resolved(folder)
        self.checked: CheckedCase | None = None
        self.run: Run | None = None
        self.lock = threading.RLock()
        self._tables: list[LogTable] | None = None
        self._unread = ""
        self._read: dict[Path, tuple[object, list[LogProposal]]] = {}
        self._left_out: set[tuple[str, str]] = set()

    # Files -------------------------------------------------------------------------------------

    def path(self, name: str) -> Path:
        """A file of the folder, or a folder in it.

        Raises
        ------
        CaseError
            If it is a link that leads out, or one in it is.
        """
        path = self.folder / name
        if found_outside(self.folder, path) is not None:
            raise CaseError(f"{name}: lies outside the case folder; copy it there")
        return path

    def text(self, name: str) -> str:
        """The text of ``rig.toml`` or ``case.toml``; empty where it is not there or no text."""
        try:
            return read_toml(self.path(name))
        except (CaseError, OSError, UnicodeDecodeError):
            return ""

    def empty(self) -> bool:
        """True where nothing is in the folder."""
        return not any(self.folder.iterdir())

    def files(self) -> Iterator[Path]:
        """Files of the folder for download: regular ones that are not hidden."""
        for home, folders, names in os.walk(self.folder):
            folders[:] = sorted(one for one in folders if not one.startswith("."))
            for name in sorted(names):
                file = Path(home, name)
                if not name.startswith(".") and file.is_file() and not file.is_symlink():
                    yield file

    def new_log(self, name: str) -> Path:
        """Path for a new log of that name.

        Raises
        ------
        ParameterError
            If that is no name for a log, or there is one already.
        """
        own = shown(Path(name.replace("\\", "/")).name).lstrip(".")[-MOST_NAME:]
        if not own or own.endswith((".toml", ".part")):
            raise refused("file", name, "the name of a log is needed")
        target = self.folder / own
        if os.path.lexists(target):
            raise ParameterError(f"{own}: is there already; give the new log another name")
        if len(self.logs()) >= _MOST_LOGS:
            raise ParameterError(f"{own}: there are {_MOST_LOGS} logs, and no more are allowed")
        return target

    def logs(self) -> list[Path]:
        """The logs of the folder: files of a kind that is read, and bags."""
        found = []
        for path in sorted(self.folder.iterdir()):
            if path.name.startswith(".") or found_outside(self.folder, path) is not None:
                continue
            try:
                check_readable(path)
            except PamrsError:
                continue
            found.append(path)
        return found

    # Rig ---------------------------------------------------------------------------------------

    def put_rig(self, text: str) -> None:
        """Write ``rig.toml``, right or wrong: what is wrong is reported, and can be mended."""
        write_atomically(self.path("rig.toml"), text)
        self.changed()

    def put_packaged(self, name: str) -> None:
        """Begin with a rig of the package."""
        self.put_rig(rigs.template(name, name, "coefficients"))

    def rig(self) -> tuple[Rig | None, str]:
        """The rig, or why there is none."""
        try:
            file = self.path("rig.toml")
            if not file.exists():
                return None, ""
            rig = load_rig(file)
            core_rig(rig)
        except PamrsError as error:
            return None, self.said(error)
        return rig, ""

    def said(self, error: BaseException | str) -> str:
        """The message of an error; files are named from the folder."""
        return str(error).replace(f"{self.folder}{os.sep}", "")

    # Data --------------------------------------------------------------------------------------

    def changed(self) -> None:
        """Forget the check and the proposals after a change."""
        self.checked = self._tables = None

    def tables(self) -> tuple[list[LogTable], str]:
        """Entries proposed or confirmed for each log, and the errors of unreadable logs."""
        if self._tables is None:
            items, failed = list[LogProposal](), list[str]()
            for path in self.logs():
                try:
                    items += self._proposed(path)
                except (PamrsError, OSError) as error:
                    failed.append(self.said(error))
                except Exception as error:  # one log must not take the page away
                    failed.append(f"{path.name}: cannot be read ({error}); please report it")
            self._tables, self._unread = self._tables_of(items), "\n".join(failed)
        return self._tables, self._unread

    def _proposed(self, log: Path) -> list[LogProposal]:
        """Proposals for a log; it is read again where it or the rig has changed."""
        now = log.stat()
        key = (now.st_mtime_ns, now.st_size, self.text("rig.toml"))
        if log not in self._read or self._read[log][0] != key:
            self._read[log] = (key, propose([log], self.rig()[0]).logs)
        return self._read[log][1]

    def _tables_of(self, items: list[LogProposal]) -> list[LogTable]:
        said = Proposal(items).case_toml(self.folder) if any(i.matches for i in items) else ""
        confirmed = self.text("case.toml")
        known = _by_log(confirmed) if confirmed.startswith(_HEAD) else {}
        known = _by_log(said) | known
        made = []
        for item in items:
            key = (item.log.path.relative_to(self.folder).as_posix(), item.name)
            bare = {"file": key[0], "role": "", "channels": {}}
            bare |= {"name": item.name} if item.name else {}
            entries = known.get(key) or [bare | ({"time": item.time} if item.time else {})]
            if key in self._left_out:
                entries = [entry | {"role": ""} for entry in entries]
            made.append(LogTable(item, entries))
        return made

    def take(self, log: Path) -> None:
        """Take a log that was put into the folder, or remove it again where it cannot be read.

        Raises
        ------
        RecordingError, MissingPackageError
            If it cannot be read.
        """
        with self.lock:
            try:
                self._proposed(log)
            except BaseException:
                log.unlink()
                raise
            self.changed()

    @property
    def foreign(self) -> bool:
        """True where there is a ``case.toml`` that was not made here."""
        text = self.text("case.toml")
        return bool(text) and not text.startswith(_HEAD)

    def channels(self) -> list[str]:
        """The channels that the rig can have."""
        return channels_of(self.rig()[0])

    def confirm(self, given: Sequence[Mapping[str, Any]]) -> None:
        """Write ``case.toml`` with what the user says of each log.

        Parameters
        ----------
        given : sequence of mapping
            For each of :meth:`tables`, in order: ``role`` (of its roles), ``sample_time`` ("1 ms",
            or empty), and ``columns``: from the name of a series to its channel and unit.

        Raises
        ------
        ParameterError
            If a channel is given twice or without a unit, or nothing is left.
        """
        tables, _ = self.tables()
        if len(given) != len(tables):
            raise ParameterError("the logs have changed: load the page anew")
        entries = tomlkit.aot()
        left = set[tuple[str, str]]()
        for table, own in zip(tables, given, strict=True):
            chosen = list(_entries(table, own))
            for entry in chosen:
                entries.append(_written(entry))
            if not chosen:
                left.add(table.key)
        if not entries:
            raise ParameterError("no log is left: give at least one a role and its channels")
        document = tomlkit.document()
        document.update({"schema": "pamrs.case/1", "rig": "rig.toml", "recording": entries})
        self._left_out = left
        self.put_case(_HEAD + tomlkit.dumps(document))

    def put_case(self, text: str) -> None:
        """Write ``case.toml``; one that was not made here is kept as ``case_before.toml``."""
        file, before = self.path("case.toml"), self.folder / "case_before.toml"
        if self.foreign and not os.path.lexists(before):
            write_atomically(before, self.text("case.toml"))
        write_atomically(file, text)
        self.changed()

    # Check, run, result ------------------------------------------------------------------------

    def check(self) -> CheckedCase:
        """Read the whole case as a diagnosis does."""
        try:
            rig, error = self.rig()
            if rig is None:
                raise CaseError(error or "there is no rig yet")
            if not self.path("case.toml").exists():
                raise CaseError("channels and units are not confirmed yet")
            found = checked(load_case(self.folder))
        except (PamrsError, OSError) as error:
            found = CheckedCase(self.said(error))
        self.checked = found
        return found

    @property
    def green(self) -> bool:
        """True where the case was checked, can be diagnosed, and has not changed since."""
        return self.checked is not None and not self.checked.error

    def start(self) -> None:
        """Begin a diagnosis.

        Raises
        ------
        ParameterError
            If one goes on, or the check is not green.
        CaseError
            If the results would be written elsewhere, through a link.
        """
        self.path(RESULT)
        if self.run is not None and self.run.running:
            raise ParameterError("a diagnosis goes on already")
        if not self.green:
            raise ParameterError("run is locked: check the case first, it must be green")
        self.run = Run(self.folder)

    def close(self) -> None:
        """End the diagnosis that goes on."""
        if self.run is not None:
            self.run.cancel()

    def said_of_run(self) -> str:
        """Reason for which the last diagnosis of this page has no result; empty where it has, or
        goes on.
        """
        return "" if self.run is None else self.said(self.run.error)

    def result_file(self, name: str) -> Path | None:
        """A file of the last result; None where it is not there, or elsewhere through a link."""
        file = self.folder / RESULT / name
        return file if is_inside(self.folder, file) and file.is_file() else None

    def result(self) -> tuple[Diagnosis | None, str]:
        """The last result, or why it cannot be shown."""
        file = self.result_file("result.json")
        if file is None:
            return None, ""
        try:
            return load_result(file), ""
        except PamrsError as error:
            return None, self.said(error)

    def stale(self, found: Diagnosis) -> bool:
        """True where a result was made from other files than those that were checked."""
        return self.checked is not None and self.green and found.inputs != self.checked.inputs


def _by_log(text: str) -> dict[tuple[str, str], list[dict[str, Any]]]:
    """The entries of a case.toml that name columns, by file and name; none where it is broken."""
    try:
        found = parse_toml(text).get("recording", [])
        made: dict[tuple[str, str], list[dict[str, Any]]] = {}
        for entry in found:
            if all("column" in one for one in entry["channels"].values()):
                made.setdefault((entry["file"], entry.get("name", "")), []).append(entry)
    except (ValueError, LookupError, TypeError, AttributeError):
        return {}
    return made


def _written(entry: Mapping[str, Any]) -> Any:
    """An entry as case.toml has it: a line for each channel."""
    made = tomlkit.table()
    for key, value in entry.items():
        if key != "channels":
            made.add(key, _inline(value))
    channels = tomlkit.table()
    for name, one in entry["channels"].items():
        channels.add(name, _inline(one))
    made.add("channels", channels)
    return made


def _inline(value: Any) -> Any:
    """A value, tables on one line."""
    if not isinstance(value, dict):
        return value
    made = tomlkit.inline_table()
    for key, inside in value.items():
        made.add(key, _inline(inside))
    return made


def _entries(table: LogTable, given: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """The entries of case.toml for a log, as the user wants them."""
    role, file = given.get("role"), table.key[0]
    if role not in table.roles:
        raise refused(f"{file}: role", role, ", ".join(table.roles))
    if role == "":
        return
    channels = _chosen(table, given.get("columns", {}))
    if not channels:
        raise ParameterError(f"{file}: no column has a channel; choose some, or leave the log out")
    made = {key: value for key, value in table.entries[0].items() if key != "channels"}
    spacing = str(given.get("sample_time", "")).strip()
    if spacing:
        number, _, unit = spacing.partition(" ")
        try:
            made["sample_time"] = to_si(float(number), unit.strip(), "time")
        except ValueError as error:
            raise refused(f"{file}: spacing", spacing, 'write it like "1 ms"') from error
    pieces = table.item.pieces
    if role == "parts":
        for own, some in (("fit", pieces[:-1]), ("held_out", pieces[-1:])):
            yield made | {"role": own, "pieces": some, "channels": channels}
        return
    if table.role == "parts":  # no longer
        del made["pieces"]
        made |= {"pieces": pieces} if table.item.short else {}
    yield made | {"role": role, "channels": channels}


def _chosen(table: LogTable, columns: Mapping[str, Any]) -> dict[str, Any]:
    """The channels of a log; what was proposed with a column and left alone stays whole."""
    made: dict[str, Any] = {}
    clocks = [entry["time"] for entry in table.entries[0]["channels"].values() if "time" in entry]
    for column, (channel, unit) in columns.items():
        if not channel:
            continue
        if column not in table.item.log.series:
            raise ParameterError(f"column = {column!r} is not in this log: load the page anew")
        if channel in made:
            other = made[channel]["column"]
            raise ParameterError(f"{channel}: {other!r} and {column!r} cannot both be it")
        if not unit:
            raise ParameterError(f"{column}: a unit is needed for {channel} (1: a plain number)")
        proposed, entry = table.channel(column)
        if (proposed, entry.get("unit")) == (channel, unit):
            # the user has said now that it is so
            made[channel] = {key: value for key, value in entry.items() if key != "assumed"}
        else:
            clock = {"time": entry.get("time", clocks[0])} if clocks else {}
            made[channel] = {"column": column, "unit": unit} | clock
    return made


@dataclass(frozen=True)
class CheckedCase:
    """Result of a check of the case.

    Attributes
    ----------
    error : str
        Why the case cannot be diagnosed; empty where it can.
    cautions : list of str
        What was found and masked, or is to be looked at.
    inputs : dict of str to str
        SHA-256 of each file that was read.
    """

    error: str
    cautions: list[str] = field(default_factory=list)
    inputs: dict[str, str] = field(default_factory=dict)


def checked(case: Case) -> CheckedCase:
    """Look at a case as a diagnosis does before it fits anything.

    Parameters
    ----------
    case : Case
        The case.

    Returns
    -------
    CheckedCase

    Raises
    ------
    DiagnosisError
        If units or columns cannot be right, or no block of the rig can be judged.
    """
    sound = check_case(case, DiagnosisSettings())
    cautions = [*case.rig.cautions, *sound.suspected, *sound.doubts, *_issues(case)]
    return CheckedCase("", list(dict.fromkeys(cautions)), dict(case.inputs))


def _issues(case: Case) -> list[str]:
    """Issues of the recordings, each text once with its count."""
    found: dict[str, int] = {}
    for recording in case.recordings:
        for issue in recording.issues:
            where = "" if issue.kind == "log" else f"{channel_of(issue.channel)}: "
            text = f"{recording.name}: {where}{issue.text}"
            found[text] = found.get(text, 0) + 1
    return [f"{text} ({count} times)" if count > 1 else text for text, count in found.items()]
