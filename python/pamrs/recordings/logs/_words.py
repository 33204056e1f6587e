"""Units as logs write them: in headings, in words, in capitals."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from pamrs.errors import ParameterError
from pamrs.units import parse_unit

__all__ = ["Written", "split_heading", "understood_unit"]

_BRACKETS = re.compile(
    r"^\s*(?P<name>.*?)\s*(?:\[(?P<a>[^\[\]]*)\]|\((?P<b>[^()]*(?:\(a\))?)\))\s*$"
)
_SLASH = re.compile(r"^\s*(?P<name>.+?)\s+(?:/|in)\s*(?P<unit>[^\s/]+)\s*$")
_TAIL = re.compile(r"^\s*(?P<name>.+)[_.](?P<unit>[A-Za-z°]+)\s*$")
_AMBIENT: Final = 101325.0
#: Endings of names, ``p_bar``, that are taken for units; single letters are not.
_TAILS: Final = frozenset(
    ("bar", "mbar", "kPa", "MPa", "hPa", "Pa", "psi", "psig", "degC", "deg", "rad", "mm", "ms")
    + ("us", "mV", "Nm", "kN", "sec")
)
_WORDS: Final[dict[str, str]] = {
    "sec": "s", "secs": "s", "second": "s", "seconds": "s",
    "msec": "ms", "millisecond": "ms", "milliseconds": "ms", "usec": "us", "µs": "us",
    "volt": "V", "volts": "V", "pascal": "Pa", "pascals": "Pa", "bars": "bar",
    "bar(g)": "bar", "bar g": "bar", "psi(g)": "psi", "bar_g": "bar",
    "degree": "deg", "degrees": "deg", "grad": "deg", "radian": "rad", "radians": "rad",
    "newton": "N", "newtons": "N", "newton-meters": "N m", "n*m": "N m", "n.m": "N m",
    "n-m": "N m", "meter": "m", "meters": "m", "metre": "m", "metres": "m",
    "millimeter": "mm", "millimeters": "mm", "millimetres": "mm", "kelvin": "K",
    "celsius": "degC", "deg c": "degC", "degrees celsius": "degC", "deg_c": "degC",
    "°c": "degC", "°f": "degF", "fahrenheit": "degF", "grad c": "degC",
}  # fmt: skip
_ABSOLUTE: Final[dict[str, str]] = {
    "bara": "bar", "bar(a)": "bar", "bar_abs": "bar", "bar abs": "bar", "bar a": "bar",
    "psia": "psi", "psi(a)": "psi", "kpaa": "kPa", "kpa(a)": "kPa", "mbara": "mbar",
}  # fmt: skip


class Written(NamedTuple):
    """A unit of the package, and what is added to values in it (absolute pressures)."""

    unit: str
    offset: float = 0.0


def understood_unit(text: str) -> Written | None:
    """What a log's unit means.

    Parameters
    ----------
    text : str
        ``"bar"``, ``"PSI"``, ``"seconds"``, ``"bara"``.

    Returns
    -------
    Written or None
        None where it is no unit that is known.
    """
    plain = text.strip().strip("[]()").strip()
    if not plain or plain in ("1", "-", "%"):
        return None
    absolute = _ABSOLUTE.get(plain.lower())
    if absolute:
        return Written(absolute, -_AMBIENT / parse_unit(absolute).scale)
    for unit in (plain, _WORDS.get(plain.lower(), ""), plain.lower(), plain.capitalize()):
        if unit in ("", "g", "l"):
            continue
        try:
            parse_unit(unit)
        except ParameterError:
            continue
        return Written(unit)
    return {"kpa": Written("kPa"), "mpa": Written("MPa"), "nm": Written("Nm")}.get(plain.lower())


def split_heading(heading: str) -> tuple[str, str]:
    """Name and unit of a heading: ``p1 [bar]``, ``p1 (bar)``, ``p1 / bar``, ``p1 in bar``,
    ``p1_bar``.

    Parameters
    ----------
    heading : str
        As it stands in the file.

    Returns
    -------
    name, unit : str
        The unit as written, empty where none that is known is there.
    """
    match = _BRACKETS.match(heading)
    if match:
        unit = match["a"] if match["a"] is not None else match["b"]
        if match["name"] and (match["a"] is not None or understood_unit(unit)):
            return match["name"], unit.strip()
    match = _SLASH.match(heading)
    if match and understood_unit(match["unit"]):
        return match["name"], match["unit"]
    match = _TAIL.match(heading)
    if match and match["unit"] in _TAILS:
        return heading.strip(), match["unit"]
    return heading.strip(), ""
