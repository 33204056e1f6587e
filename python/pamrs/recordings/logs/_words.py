"""Units as logs write them: in headings, in words, in capitals."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from pamrs.errors import ParameterError
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
#: Written where a unit stands, and no unit of anything: what a converter gives, or shares.
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

    Returns
    -------
    bool
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

    Parameters
    ----------
    heading : str
        As it stands in the file.

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
