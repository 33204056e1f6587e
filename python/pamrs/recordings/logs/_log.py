"""Log as every reader returns it: named series of numbers, each perhaps with a clock; units as logs
write them, in headings, in words, in capitals.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from pamrs._arrays import Array
from pamrs._files import MOST_SIZE
from pamrs.errors import ParameterError, RecordingError
from pamrs.recordings._clock import TIME_UNITS
from pamrs.recordings._gate import check_size
from pamrs.recordings.table import NO_VALUE, Table, first_few
from pamrs.units import measured_from, parse_unit

_PAIRS: Final = {"[": "]", "(": ")", "{": "}", "<": ">"}
_BRACKETS = re.compile(
    r"^\s*(?P<name>.*?)[\s_]*(?:\[(?P<square>[^\[\]]*)\]"
    r"|(?P<other>\((?:[^()]|\([^()]*\))*\)|\{[^{}]*\}|<[^<>]*>))\s*$"
)
_INSIDE = re.compile(
    r"^\s*[^\[\](){}<>]+?[\s_]*(?P<unit>\[[^\[\]]+\]|\([^()]+\)|\{[^{}]+\}|<[^<>]+>)"
    r"[\s_-]*(?P<rest>\(?[^\[\](){}<>]+\)?)\s*$"
)
_COMMA = re.compile(
    r"^\s*(?P<name>[^,]+),\s*(?P<unit>[^,()]+?)\s*(?:\([^()]*\))?\s*$"
)  # as HOBO has it
_SLASH = re.compile(r"^\s*(?P<name>.+?)\s+(?:/|in)\s*(?P<unit>[^\s/]+)\s*$")
_DIVIDED = re.compile(r"^\s*(?P<name>[^/]+)/(?P<unit>[^/\s]+)\s*$")  # as DIN has it, U/V
_TAIL = re.compile(
    r"^\s*.+?[_.\s-](?P<unit>(?P<alone>[A-Za-z°]+(?:[2-3]?[A-Za-z]*)?)"
    r"(?:[_\s-]*\(?(?:a|g|abs|gauge)\)?)?)\s*$"
)
_INCHES: Final = re.compile(
    r"(?P<name>.*(?:length|laenge|länge|stroke|disp\w*|position|pos|travel|lvdt|height|distance))"
    r"[_.\s-]in",
    re.IGNORECASE,
)
_NUMBER: Final = r"\s*(?P<{}>[-+]?\d+(?:[.,]\d+)?)\s*"
_RANGE: Final = _NUMBER + r"(?:\.{{2,3}}|…|-|–|to|bis|~)" + _NUMBER
_CALIBRATION = re.compile(
    _RANGE.format("a", "b")
    + r"(?P<of>[^\d\s=:>-][^=:>]*?)?\s*(?:=+>?|->|→|:)"
    + _RANGE.format("c", "d")
    + r"(?P<unit>\S.*?)\s*"
)
_LONGEST: Final = 80  # letters of a unit with its calibration
#: Endings of names, ``p_bar``, that are taken for units; of single letters only these.
_TAILS: Final = frozenset(
    ("bar", "mbar", "kPa", "MPa", "hPa", "Pa", "psi", "psig", "psia", "bara", "barg", "Torr")
    + ("mmHg", "inHg", "inH2O", "mmH2O", "cmH2O", "mH2O", "atm", "degC", "degF", "deg", "rad")
    + ("mm", "cm", "ms", "us", "ns", "sec", "mV", "mA", "Nm", "kN", "V", "N", "s")
    + ("lbf", "lb", "lbs", "kgf", "kg", "inch")
)
#: Of them, those of three letters or more are taken in capitals, too; ATM is the air outdoors.
_CAPITALS: Final = frozenset(unit.upper() for unit in _TAILS if len(unit) > 2) - {"ATM"}
_WORDS: Final[dict[str, str]] = {
    "segundos": "s", "secondes": "s", "milisegundos": "ms", "millisecondes": "ms",
    "millisekunden": "ms", "microsegundos": "us", "grados": "deg", "degrés": "deg",
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "sekunden": "s",
    "msec": "ms", "millisecond": "ms", "milliseconds": "ms", "usec": "us", "µs": "us",
    "microsecond": "us", "microseconds": "us", "nanosecond": "ns", "nanoseconds": "ns",
    "volt": "V", "volts": "V", "millivolt": "mV", "millivolts": "mV",
    "amp": "A", "amps": "A", "ampere": "A", "amperes": "A", "milliamp": "mA", "milliamps": "mA",
    "milliampere": "mA", "pascal": "Pa", "pascals": "Pa", "kilopascal": "kPa", "bars": "bar",
    "millibar": "mbar", "atmospheres": "atm",
    "kg/cm^2": "kgf/cm2", "kgcm2": "kgf/cm2", "lb/in2": "psi", "lbf/in2": "psi", "pounds": "lb",
    "mmws": "mmWC", "mws": "mWC", "mmaq": "mmWC", "iwc": "inWC", "inaq": "inWC",
    "degree": "deg", "degrees": "deg", "grad": "deg", "radian": "rad", "radians": "rad",
    "newton": "N", "newtons": "N", "newton-meters": "N m", "n*m": "N m", "n.m": "N m",
    "n-m": "N m", "meter": "m", "meters": "m", "metre": "m", "metres": "m", "lbs": "lb",
    "inch": "in", "inches": "in",
    "millimeter": "mm", "millimeters": "mm", "millimetres": "mm", "kelvin": "K",
    "celsius": "degC", "deg c": "degC", "degrees celsius": "degC", "deg_c": "degC",
    "°c": "degC", "°f": "degF", "fahrenheit": "degF", "grad c": "degC", "deg f": "degF",
}  # fmt: skip
#: Written where a unit would be, and no unit of anything: what a converter gives, or shares.
_COUNTS: Final = frozenset(
    ("count", "counts", "raw", "adc", "dac", "lsb", "digit", "digits", "tick", "ticks", "step")
    + ("steps", "inc", "bit", "bits", "a.u.", "a. u.", "arb", "arb. units", "%", "percent")
)
#: In any capitals a pressure is one: PSIA, KPa, MMHG.
_PRESSURES: Final = (
    *("kgf/cm2", "mmH2O", "cmH2O", "inH2O", "mH2O", "mmHg", "inHg", "mmWC", "inWC", "Torr"),
    *("mbar", "mWC", "kPa", "MPa", "hPa", "bar", "psi", "atm", "Pa", "at"),
)


class Written(NamedTuple):
    """Unit of a log in the terms of the package, with a calibration where the text gives one.

    Attributes
    ----------
    unit : str
        A unit of the package.
    absolute : bool, optional
        Whether it is one of absolute pressure; None where it does not say.
    calibration : tuple of tuple of float, optional
        Two numbers of the log, and the values in `unit` that they stand for.
    """

    unit: str
    absolute: bool | None = None
    calibration: tuple[tuple[float, float], tuple[float, float]] | None = None


def understood_unit(text: str) -> Written | None:
    """Translate a log's unit into one of the package.

    Parameters
    ----------
    text : str
        ``"bar"``, ``"PSI"``, ``"seconds"``, ``"bara"``, ``"4..20 mA = 0..6 bar"``.

    Returns
    -------
    Written or None
        None where it is no unit that is known.
    """
    if len(text) > _LONGEST:
        return None
    plain = unwrapped(text.translate(_PLAIN))
    if not plain or plain == "1" or plain.lower() in _COUNTS or plain in ("a", "g", "l", "-"):
        return None
    calibration = _CALIBRATION.fullmatch(plain)
    if calibration:
        return _calibrated(calibration)
    lower, close = plain.lower(), plain.replace(" ", "")
    usual = (_WORDS.get(lower, ""), *_pressure(plain), *_pressure(close))
    for unit in (*usual, plain, lower, plain.capitalize()):
        alone, kind = measured_from(unit)
        try:
            parse_unit(alone)
        except ParameterError:
            continue
        return Written(alone, {"absolute": True, "gauge": False}.get(kind))
    return Written("Nm") if lower == "nm" else None


def same_unit(first: str, second: str) -> bool:
    """True where two texts are the same unit in a log's words, or both are none that is known.

    Parameters
    ----------
    first, second : str
        ``"sec"`` and ``"s"``, or ``"bar abs"`` and ``"bar"``: what a pressure is measured from may
        be said by one of them alone.
    """
    known = [understood_unit(text) for text in (first, second)]
    one, other = (parse_unit(each.unit) if each else None for each in known)
    return one == other


_PLAIN: Final = str.maketrans({"²": "2", "³": "3", "₂": "2", "\N{MICRO SIGN}": "u", "μ": "u"})


def unwrapped(text: str) -> str:
    """A text without brackets around all of it."""
    plain = text.strip()
    while len(plain) > 1 and _PAIRS.get(plain[0]) == plain[-1] and _closed(plain[1:-1]):
        plain = plain[1:-1].strip()
    return plain


def _closed(text: str) -> bool:
    """True where every round bracket that is closed was opened before."""
    ends = range(1, len(text) + 1)
    return all(text.count("(", 0, end) >= text.count(")", 0, end) for end in ends)


def _pressure(text: str) -> list[str]:
    """A text that begins with a unit of pressure, with that written as usual."""
    lower = text.lower()
    if lower.startswith(("kg/cm2", "kp/cm2")):
        return ["kgf" + text[2:]]
    begun = next((unit for unit in _PRESSURES if lower.startswith(unit.lower())), None)
    return [] if begun is None else [begun + text[len(begun) :]]


def _calibrated(match: re.Match[str]) -> Written | None:
    """``4..20 mA = 0..6 bar``, or the other way round: what is electric is the log's."""
    numbers = [float(match[name].replace(",", ".")) for name in ("a", "b", "c", "d")]
    read, stands_for = (numbers[0], numbers[1]), (numbers[2], numbers[3])
    of, known = understood_unit(match["of"] or ""), understood_unit(match["unit"])
    if known is not None and of is not None and parse_unit(known.unit).dimension in _ELECTRIC:
        read, stands_for, known = stands_for, read, of
    if known is None or known.calibration or read[0] == read[1] or stands_for[0] == stands_for[1]:
        return None
    return known._replace(calibration=(read, stands_for))


_ELECTRIC: Final = tuple(parse_unit(unit).dimension for unit in ("A", "V"))


def split_heading(heading: str) -> tuple[str, str]:
    """Name and unit of a heading: ``p1 [bar]``, ``p1 (bar)``, ``p1_{bar}``, ``p1/bar``, ``p1 in
    bar``, ``p1_bar``, ``p1 bar``, ``p1 [bar] abs``, ``p1_bar_filt``.

    Returns
    -------
    name, unit : str
        The unit as written, empty where none is there. Any text in square brackets is one; in
        others what is known, and what is like one.
    """
    if len(heading) > 10 * _LONGEST:
        return heading.strip(), ""
    match = _BRACKETS.match(heading)
    if match and match["name"]:
        unit = match["square"] if match["square"] is not None else match["other"][1:-1]
        if match["square"] is not None or understood_unit(unit) or _like_a_unit(unit):
            return match["name"], unit.strip()
    for form in (_COMMA, _SLASH):
        match = form.match(heading)
        if match and understood_unit(match["unit"]):
            return match["name"], match["unit"]
    match = _DIVIDED.match(heading)
    if match and measured_from(match["unit"])[0] in _TAILS | {"m", "A", "°"}:
        return match["name"], match["unit"]
    match = _INSIDE.match(heading)
    if match and understood_unit(match["unit"]):
        unit, rest = unwrapped(match["unit"]), unwrapped(match["rest"])
        from_what = measured_from(f"{unit} {rest}")[1]
        return heading.strip(), f"{unit} {rest}" if from_what else unit
    match = _TAIL.match(heading)
    known = match and (match["alone"] in _TAILS or match["alone"].upper() in _CAPITALS)
    if match and known and understood_unit(match["unit"]):
        return heading.strip(), match["unit"].replace("_", " ")
    if _INCHES.fullmatch(heading.strip()):
        return heading.strip(), "in"
    return heading.strip(), _unit_among(heading)


def _unit_among(heading: str) -> str:
    """Only unit among other words, ``p1_psi_filt``, not the first word, no single letter."""
    for text in (heading.strip(), re.sub(r"(?<=[a-zäöü0-9])(?=[A-Z])", "_", heading.strip())):
        words = re.split(r"[_.\s-]+", text)[1:]
        units = {word for word in words if _like_a_tail(word) and word != "atm"}
        if units:
            return units.pop() if len(units) == 1 else ""
    return ""


def _like_a_unit(text: str) -> bool:
    """True where a text in round brackets has the form of a unit, known or not."""
    plain = text.strip().lower()
    return (
        plain in _COUNTS
        or ("/" in plain and ":" not in plain)
        or any(plain.startswith(unit.lower()) for unit in _PRESSURES if len(unit) > 2)
        or any(map(_like_a_tail, re.split(r"[^A-Za-z]+", text)))
    )


def _like_a_tail(word: str) -> bool:
    """True where a word of more than one letter is a unit that names end with."""
    return len(word) > 1 and (word in _TAILS or word.upper() in _CAPITALS)


#: What a heading has behind its name: a unit in brackets (a number there tells two columns of one
#: name from each other), and what parts it from the name.
_UNIT: Final = re.compile(r"[\s_]*([\[({<](?!\d+[\])}>])[^\[\](){}<>]*[\])}>])?[\s_]*$")


@dataclass(frozen=True, eq=False)
class Series:
    """One channel of a log as the log has it: not scaled, not judged.

    Attributes
    ----------
    name : str
        Path in the log, parts joined by ``/``.
    values : (n,) array
        Numbers in the log's own unit, NaN where there is none; for texts the index into `labels`.
    unit : str
        As the log writes it; empty where it does not say.
    time : (n,) array, optional
        Its own times [s], on the clock of the log. None where the log has no clock for it.
    labels : tuple of str
        The different texts of a column of texts; empty for numbers.
    stamps : bool
        Whether they are dates or times of day, so that nothing but a clock is in it.
    """

    name: str
    values: Array
    unit: str = ""
    time: Array | None = None
    labels: tuple[str, ...] = ()
    stamps: bool = False


@dataclass(frozen=True)
class TextFormat:
    """Format of a text file as far as the user states it; the rest is found out.

    Attributes
    ----------
    delimiter, decimal, thousands : str, optional
        What separates cells (``" "``: any run of blanks), marks decimals, groups digits.
    header : bool, optional
        Whether a row of headings is above the numbers.
    columns : tuple of str, optional
        A name for each column, in order, instead of the file's own.
    """

    delimiter: str | None = None
    decimal: str | None = None
    thousands: str | None = None
    header: bool | None = None
    columns: tuple[str, ...] | None = None


@dataclass(frozen=True, eq=False)
class Log:
    """A file as series.

    Attributes
    ----------
    path : Path
        The file, or the folder of a bag.
    series : dict of str to Series
        By name, in the order of the file.
    unread : dict of str to str
        What of the file is no series, and why.
    remarks : list of str
        What was left out, joined or taken for missing as it was read.
    tables : tuple of str
        Beginnings of the names of each table, where there are several, as sheets of a workbook.
    """

    path: Path
    series: dict[str, Series]
    unread: dict[str, str] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    tables: tuple[str, ...] = ()

    def only(self, table: str) -> Log:
        """Copy of the log with one of its tables alone."""
        some = {name: each for name, each in self.series.items() if name.startswith(table)}
        said = [text for text in self.remarks if text.startswith(table)]
        lost = {name: why for name, why in self.unread.items() if name.startswith(table)}
        return replace(self, series=some, unread=lost, remarks=said, tables=())

    def find(self, name: str) -> Series:
        """The series of that name, or the only one whose last parts are that name.

        Parameters
        ----------
        name : str
            The whole path, or its end: ``p1`` for ``rig/p1``; or as the heading is in the file,
            with its unit or what an earlier version left of that: ``p1_(bar)``, ``p1_``.

        Raises
        ------
        RecordingError
            If there is none, or more than one.
        """
        if name in self.series:
            return self.series[name]
        ends = [known for known in self.series if known.endswith("/" + name)]
        if len(ends) == 1:
            return self.series[ends[0]]
        if ends:
            raise RecordingError(
                f"{self.path}: {name!r} may be any of {_few(ends)}; write the whole path"
            )
        if name in self.unread:
            raise RecordingError(f"{self.path}: {name!r} cannot be used: {self.unread[name]}")
        alone = _UNIT.sub("", name)
        if alone != name and any(f"/{known}".endswith(f"/{alone}") for known in self.series):
            return self.find(alone)
        near = difflib.get_close_matches(name, self.series, n=1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise RecordingError(
            f"{self.path}: there is no channel {name!r}; {hint}the log has: {_few(self.series)}"
        )


def series_of_texts(name: str, texts: Sequence[str], unit: str = "") -> Series:
    """A column of texts: which of the different ones each is."""
    labels = tuple(dict.fromkeys(texts))
    place = {label: float(index) for index, label in enumerate(labels)}
    return Series(name, np.array([place[text] for text in texts]), unit, None, labels)


#: Pairs of words that a switch or a valve has, the first of them at rest.
_SWITCHES: Final = (
    *(("off", "on"), ("false", "true"), ("closed", "open"), ("low", "high"), ("no", "yes")),
    *(("aus", "ein"), ("aus", "an"), ("zu", "auf"), ("nein", "ja"), ("geschlossen", "offen")),
)


def switched(series: Series) -> Series:
    """A series of the two words of a switch as 0 and 1, with ``off/on`` for its unit; others as
    they are.
    """
    words = [label.lower() for label in series.labels]
    for pair in _SWITCHES:
        if words and set(words) - NO_VALUE <= set(pair):
            levels = np.array([pair.index(w) if w in pair else np.nan for w in words])
            values = levels[series.values.astype(np.intp)]
            return replace(series, values=values, unit="/".join(pair), labels=())
    return series


def table_of(log: Log) -> Table:
    """The series of a log that are as long as most, with their units in the headings."""
    counts = [len(series.values) for series in log.series.values()]
    usual = max(set(counts), key=counts.count)
    header: list[str] = []
    cells: list[Sequence[str] | Array] = []
    for series in log.series.values():
        if len(series.values) == usual:
            header.append(f"{series.name} [{series.unit}]" if series.unit else series.name)
            texts = [series.labels[int(at)] for at in series.values] if series.labels else None
            cells.append(series.values if texts is None else texts)
    other = [name for name, s in log.series.items() if len(s.values) != usual]
    left = [f"{_few(other)}: not {usual} values as the others have, left out"] if other else []
    return Table(header, cells, [*log.remarks, *left])


def _few(names: Iterable[str]) -> str:
    return first_few(map(repr, names), most=12)


def collected(
    path: Path,
    found: Sequence[Series],
    unread: Mapping[str, str] | None = None,
    remarks: Sequence[str] = (),
) -> Log:
    """A log of these series; names that are there twice get a number, and two series that are one
    clock, of seconds and of what is beyond them, become one.

    Parameters
    ----------
    path : Path
        The file.
    found : sequence of Series
        In the order of the file.
    unread : mapping of str to str, optional
        What is no series, and why.
    remarks : sequence of str
        What was done as it was read.

    Raises
    ------
    RecordingError
        If there is no series with a number in it.
    """
    check_size(0, 0, str(path), len(found))
    series: dict[str, Series] = {}
    twice: list[str] = []
    for item in found:
        name, again = item.name, 2
        while name in series:
            name, again = f"{item.name} ({again})", again + 1
        same = item if name == item.name else replace(item, name=name)
        if same is not item:
            twice.append(f"the name {item.name!r} is there again: this one is {name!r} here")
        series[name] = same
    if not series:
        why = "; ".join(f"{name}: {text}" for name, text in list((unread or {}).items())[:3])
        raise RecordingError(
            f"{path}: no channel with numbers was found" + (f" ({why})" if why else "")
        )
    log = Log(path, series, dict(unread or {}), [*remarks, *twice[:_MOST_SAID]])
    for name in list(series):
        _join(log, name)
    return log


_MOST_SAID: Final = 8  # names that are there again, and are said
_SECONDS: Final = frozenset(word for word, unit in TIME_UNITS.items() if unit == "s")
_BEYOND: Final = {word: parse_unit(unit).scale for word, unit in TIME_UNITS.items() if unit != "s"}


def _parted(name: str) -> tuple[str, str]:
    """Part of a name before its last word, and that word in small letters."""
    match = re.fullmatch(r"(.*?)([A-Za-z]+)", name)
    return (match[1], match[2].lower()) if match else (name, "")


def _join(log: Log, name: str) -> None:
    """Join whole seconds and the series of what is beyond them, if there is one, to one clock."""
    before, word = _parted(name)
    whole = log.series.get(name)
    for other, rest in list(log.series.items()):
        beyond = _BEYOND.get(_parted(other)[1])
        if whole is None or beyond is None or len(whole.values) != len(rest.values):
            continue
        alike = _parted(other)[0] in (before, before.replace("tv_", "")) and word in _SECONDS
        if not (alike or whole.stamps) or not _parts_of_a_second(whole.values, rest.values, beyond):
            continue
        stem = name if whole.stamps else before.strip(" ._-/") or "stamp"
        joined = f"{stem} stamp" if stem in log.series and stem != name else stem
        values = whole.values + beyond * rest.values
        made = Series(joined, values, "s", whole.time, stamps=True)
        why = f"it is part of the clock {joined}"
        series = {joined if key == name else key: each for key, each in log.series.items()}
        series[joined] = made
        del series[other]
        log.series.clear()
        log.series.update(series)
        log.unread.update({key: why for key in (name, other) if key != joined})
        log.remarks.append(f"{name} and {other} are one clock, here {joined}")
        return


def _parts_of_a_second(whole: Array, beyond: Array, scale: float) -> bool:
    """True where `beyond` holds the fractions of a clock whose whole seconds are `whole`."""
    good = np.isfinite(whole) & np.isfinite(beyond)
    rest = beyond[good] * scale
    if not good.any() or np.any(np.diff(whole[good]) < 0.0) or np.ptp(rest) == 0.0:
        return False
    parts = bool(np.all(whole[good] % 1.0 == 0.0) and rest.min() >= 0.0 and rest.max() < 1.0)
    return parts and bool(np.mean(np.diff(whole[good] + rest) >= 0.0) > 0.9)


def numbers_of(values: Any) -> Array | None:
    """Numbers as a vector of float64, infinities as NaN; None if they are no numbers.

    Parameters
    ----------
    values : array-like
        Numbers, flags, durations or date-times (seconds since the earliest one) of any shape.

    Returns
    -------
    (n,) array or None
    """
    array = np.asarray(values)
    if array.dtype.kind == "M":
        stamps = array.astype("datetime64[ns]").ravel()
        there = ~np.isnat(stamps)
        laid = np.full(stamps.shape, np.nan)
        if there.any():
            laid[there] = (stamps[there] - stamps[there].min()).astype(np.int64) * 1e-9
        return laid
    if array.dtype.kind == "m":
        return np.asarray(array / np.timedelta64(1, "ns") * 1e-9, dtype=np.float64).ravel()
    if array.dtype.kind not in "biuf":
        return None
    result = array.astype(np.float64).ravel()
    result[~(np.abs(result) < MOST_SIZE)] = np.nan
    return result
