"""Units: from what people write in files to SI.

A unit is written as products and quotients of known symbols, with exponents as plain digits:
``"kg m2"``, ``"N m s/rad"``, ``"m3/(s Pa)"``, ``"l/(s bar)"``. Symbols are case sensitive. The
angle, the volt and the ampere count as dimensions of their own, so that a pressure given in degrees
is an error and not a number; inside a compound unit (``N m/rad``) the angle may be left out.

Pressures are gauge pressures, and a unit may say so: ``"bar(g)"``, ``"barg"``, ``"psi gauge"``. An
absolute one (``"bar(a)"``, ``"psia"``, ``"kPa abs"``) is recognised by :func:`measured_from`, and
read only where there is an ambient pressure to subtract.
"""

from __future__ import annotations

import difflib
import math
import re
from functools import lru_cache
from typing import Final, NamedTuple

from pamrs.errors import ParameterError

__all__ = [
    "DIMENSIONS",
    "Unit",
    "bar_and_psi",
    "from_si",
    "in_words",
    "measured_from",
    "parse_unit",
    "same_dimension",
    "spellings",
    "to_si",
    "with_unit",
]

#: Names of dimensions accepted by :func:`to_si`, with the SI unit of each.
DIMENSIONS: Final[dict[str, str]] = {
    "dimensionless": "1",
    "time": "s",
    "length": "m",
    "area": "m2",
    "volume": "m3",
    "mass": "kg",
    "pressure": "Pa",
    "angle": "rad",
    "angular speed": "rad/s",
    "force": "N",
    "torque": "N m",
    "voltage": "V",
    "current": "A",
    "temperature": "K",
    "inertia": "kg m2",
    "first moment": "kg m",
    "acceleration": "m/s2",
    "conductance": "m3/(s Pa)",
}

# base dimensions: m, kg, s, K, V, A, rad
_Vector = tuple[int, int, int, int, int, int, int]
_NONE: Final[_Vector] = (0, 0, 0, 0, 0, 0, 0)
_M: Final[_Vector] = (1, 0, 0, 0, 0, 0, 0)
_M3: Final[_Vector] = (3, 0, 0, 0, 0, 0, 0)
_KG: Final[_Vector] = (0, 1, 0, 0, 0, 0, 0)
_S: Final[_Vector] = (0, 0, 1, 0, 0, 0, 0)
_K: Final[_Vector] = (0, 0, 0, 1, 0, 0, 0)
_V: Final[_Vector] = (0, 0, 0, 0, 1, 0, 0)
_A: Final[_Vector] = (0, 0, 0, 0, 0, 1, 0)
_RAD: Final[_Vector] = (0, 0, 0, 0, 0, 0, 1)
_N: Final[_Vector] = (1, 1, -2, 0, 0, 0, 0)
_PA: Final[_Vector] = (-1, 1, -2, 0, 0, 0, 0)
_J: Final[_Vector] = (2, 1, -2, 0, 0, 0, 0)
_W: Final[_Vector] = (2, 1, -3, 0, 0, 0, 0)
_HZ: Final[_Vector] = (0, 0, -1, 0, 0, 0, 0)

_POUND: Final = 0.45359237
_INCH: Final = 0.0254
_G: Final = 9.80665
_LONGEST: Final = 64  # letters of a unit
_MOST_POWER: Final = 9  # of a symbol; no unit has more, and more overflows
_MERCURY: Final = 133322.387415  # pressure of a metre of mercury; water has 1000 kg/m3 [Pa]

_SYMBOLS: Final[dict[str, tuple[float, _Vector]]] = {
    "1": (1.0, _NONE),
    "-": (1.0, _NONE),
    "%": (0.01, _NONE),
    "s": (1.0, _S),
    "ms": (1e-3, _S),
    "us": (1e-6, _S),
    "µs": (1e-6, _S),
    "ns": (1e-9, _S),
    "min": (60.0, _S),
    "h": (3600.0, _S),
    "d": (86400.0, _S),
    "Hz": (1.0, _HZ),
    "kHz": (1e3, _HZ),
    "m": (1.0, _M),
    "cm": (1e-2, _M),
    "mm": (1e-3, _M),
    "um": (1e-6, _M),
    "in": (_INCH, _M),
    "ft": (12 * _INCH, _M),
    "l": (1e-3, _M3),
    "L": (1e-3, _M3),
    "ml": (1e-6, _M3),
    "mL": (1e-6, _M3),
    "cl": (1e-5, _M3),
    "gal": (3.785411784e-3, _M3),
    "kg": (1.0, _KG),
    "g": (1e-3, _KG),
    "lb": (_POUND, _KG),
    "oz": (_POUND / 16, _KG),
    "Pa": (1.0, _PA),
    "hPa": (1e2, _PA),
    "kPa": (1e3, _PA),
    "MPa": (1e6, _PA),
    "bar": (1e5, _PA),
    "mbar": (1e2, _PA),
    "atm": (101325.0, _PA),
    "at": (_G * 1e4, _PA),
    "psi": (_POUND * _G / _INCH**2, _PA),
    "Torr": (101325.0 / 760, _PA),
    "mmHg": (_MERCURY * 1e-3, _PA),
    "inHg": (_MERCURY * _INCH, _PA),
    "mmH2O": (_G, _PA),
    "cmH2O": (_G * 10, _PA),
    "mH2O": (_G * 1e3, _PA),
    "inH2O": (_G * 1e3 * _INCH, _PA),
    "mmWC": (_G, _PA),
    "mWC": (_G * 1e3, _PA),
    "inWC": (_G * 1e3 * _INCH, _PA),
    "rad": (1.0, _RAD),
    "mrad": (1e-3, _RAD),
    "deg": (math.pi / 180, _RAD),
    "°": (math.pi / 180, _RAD),
    "rev": (2 * math.pi, _RAD),
    "rpm": (2 * math.pi / 60, (0, 0, -1, 0, 0, 0, 1)),
    "N": (1.0, _N),
    "kN": (1e3, _N),
    "mN": (1e-3, _N),
    "lbf": (_POUND * _G, _N),
    "kgf": (_G, _N),
    "Nm": (1.0, _J),
    "Nmm": (1e-3, _J),
    "Ncm": (1e-2, _J),
    "J": (1.0, _J),
    "kJ": (1e3, _J),
    "W": (1.0, _W),
    "kW": (1e3, _W),
    "V": (1.0, _V),
    "mV": (1e-3, _V),
    "A": (1.0, _A),
    "mA": (1e-3, _A),
    "K": (1.0, _K),
}

# units with an offset are alone, never inside a product
_OFFSETS: Final[dict[str, tuple[float, float]]] = {
    "degC": (1.0, 273.15),
    "°C": (1.0, 273.15),
    "C": (1.0, 273.15),
    "degF": (5.0 / 9.0, 273.15 - 32.0 * 5.0 / 9.0),
    "°F": (5.0 / 9.0, 273.15 - 32.0 * 5.0 / 9.0),
}

#: What comes after a unit of pressure: measured from the ambient pressure, or from nothing.
_FROM_AMBIENT: Final = frozenset(("g", "gauge", "ü", "rel", "relative"))
_FROM_NOTHING: Final = frozenset(("a", "abs", "absolute", "absolut"))
_BEHIND: Final = "|".join(sorted(_FROM_AMBIENT | _FROM_NOTHING, key=len, reverse=True))
_MEASURED_FROM = re.compile(
    rf"(?P<unit>.+?)(?:[\s_-]*\(\s*(?P<inside>{_BEHIND})\.?\s*\)|[\s_,-]*(?P<behind>{_BEHIND})\.?)",
    re.IGNORECASE,
)
_FACTOR = re.compile(r"(?P<symbol>[^\d\s^*·/()-]+)\^?(?P<power>-?\d+)?")


class Unit(NamedTuple):
    """A parsed unit: ``SI value = scale * value + offset``."""

    scale: float
    offset: float
    dimension: tuple[int, ...]


def _known_names() -> list[str]:
    return [*_SYMBOLS, *_OFFSETS]


def _product(text: str, whole: str) -> tuple[float, list[int]]:
    scale, dimension = 1.0, [0] * len(_NONE)
    for factor in re.split(r"[\s*·]+", text.strip()):
        exact = _SYMBOLS.get(factor)
        power = 1
        if exact is None:
            match = _FACTOR.fullmatch(factor)
            symbol = match["symbol"] if match else factor
            exact = _SYMBOLS.get(symbol)
            if match and match["power"]:
                power = int(match["power"][:4])
        if exact is None or abs(power) > _MOST_POWER:
            raise ParameterError(_unknown(whole, factor))
        scale *= exact[0] ** power
        dimension = [d + power * e for d, e in zip(dimension, exact[1], strict=True)]
    return scale, dimension


def _unknown(whole: str, factor: str) -> str:
    if measured_from(whole)[1] == "absolute":
        return (
            f"unit {whole!r}: pressures are gauge pressures here (subtract the ambient pressure "
            "first)"
        )
    near = difflib.get_close_matches(factor, _known_names(), n=1, cutoff=0.5)
    if not near:
        near = [name for name in _known_names() if name.lower() == factor.lower()][:1]
    hint = f"; did you mean {near[0]!r}?" if near else ""
    where = "" if factor == whole else f" in {whole!r}"
    return f"unknown unit {factor!r}{where}{hint}"


def measured_from(unit: str) -> tuple[str, str]:
    """A unit of pressure without the words behind it that say what it is measured from.

    Parameters
    ----------
    unit : str
        Any text.

    Returns
    -------
    unit : str
        The unit alone; where no such words follow a unit of pressure, what was given.
    kind : str
        ``"gauge"``, ``"absolute"``, or empty where it does not say.

    Examples
    --------
    >>> measured_from("bar(a)"), measured_from("kPa gauge"), measured_from("psi")
    (('bar', 'absolute'), ('kPa', 'gauge'), ('psi', ''))
    """
    text = unit.strip()
    match = _MEASURED_FROM.fullmatch(text)
    if match is None or text in _SYMBOLS:
        return unit, ""
    try:
        alone = _compound(match["unit"])
    except ParameterError:
        return unit, ""
    if alone.dimension != _PA:
        return unit, ""
    word = (match["inside"] or match["behind"]).lower()
    return match["unit"], "gauge" if word in _FROM_AMBIENT else "absolute"


@lru_cache(maxsize=512)
def parse_unit(unit: str) -> Unit:
    """Read a unit.

    Parameters
    ----------
    unit : str
        For example ``"bar"``, ``"N m s/rad"`` or ``"m3/(s Pa)"``.

    Returns
    -------
    Unit
        Scale and offset to SI, and the exponents of m, kg, s, K, V, A and rad.

    Raises
    ------
    ParameterError
        If a symbol is unknown or the expression is malformed.
    """
    text = unit.strip()
    if not text:
        raise ParameterError("the unit is empty; a number without a dimension has the unit '1'")
    if text in _OFFSETS:
        scale, offset = _OFFSETS[text]
        return Unit(scale, offset, _K)
    pressure, kind = measured_from(text)
    if kind == "absolute":
        raise ParameterError(_unknown(text, text))
    return _compound(pressure)


def _compound(text: str) -> Unit:
    """Products and quotients of symbols."""
    if len(text) > _LONGEST:
        raise ParameterError(f"unknown unit {text[:_LONGEST]!r}...: it is too long for one")
    top, *below = re.sub(
        r"/\s*\(([^()/]*)\)\s*$", lambda m: "/" + "/".join(m[1].split()), text
    ).split("/")
    if any(mark in part for part in (top, *below) for mark in "()") or not all(
        map(str.strip, (top, *below))
    ):
        raise ParameterError(_unknown(text, text))
    scale, dimension = _product(top, text)
    for part in below:
        factor, minus = _product(part, text)
        scale /= factor
        dimension = [d - e for d, e in zip(dimension, minus, strict=True)]
    return Unit(scale, 0.0, tuple(dimension))


def same_dimension(first: str, second: str) -> bool:
    """True where two units measure the same thing.

    Parameters
    ----------
    first, second : str
        Units.

    Returns
    -------
    bool
        True if one converts into the other. The angle counts only where nothing else is left; and
        turns in a second, Hz, are no angular speed, rad/s: they differ by 2 pi.
    """
    one, two = parse_unit(first).dimension, parse_unit(second).dimension
    if one[:-1] != two[:-1]:
        return False
    compound, same_angle = any(one[:-1]), one[-1] == two[-1]
    turns = one[:-1] == _HZ[:-1] and any(unit.endswith("Hz") for unit in (first, second))
    return same_angle or (compound and not turns)


@lru_cache(maxsize=256)
def spellings(unit: str) -> tuple[str, ...]:
    """Known single words for units of the same dimension as a unit: ``"bar"``, ``"kPa"``, ...
    of ``"Pa"``.

    Parameters
    ----------
    unit : str
        A unit.
    """
    return tuple(word for word in _known_names() if same_dimension(word, unit))


def _checked(unit: str, dimension: str) -> Unit:
    si_unit = DIMENSIONS.get(dimension, dimension)
    parsed = parse_unit(unit)
    if not same_dimension(unit, si_unit):
        raise ParameterError(
            f"unit {unit!r} has the wrong dimension; a unit like {si_unit!r} is needed"
        )
    return parsed


def to_si(value: float, unit: str, dimension: str, *, difference: bool = False) -> float:
    """Convert a value to SI.

    Parameters
    ----------
    value : float
        The number as written.
    unit : str
        Its unit.
    dimension : str
        What it must be: a name of :data:`DIMENSIONS` (``"pressure"``) or an SI unit (``"Pa"``).
    difference : bool
        The value is a difference or a standard deviation, so that offsets (degC) do not apply.

    Returns
    -------
    float
        The value in SI units.

    Raises
    ------
    ParameterError
        If the unit is unknown or of another dimension.
    """
    parsed = _checked(unit, dimension)
    return value * parsed.scale + (0.0 if difference else parsed.offset)


def from_si(value: float, unit: str, dimension: str, *, difference: bool = False) -> float:
    """Convert an SI value into ``unit``; the inverse of :func:`to_si`, with the same parameters."""
    parsed = _checked(unit, dimension)
    return (value - (0.0 if difference else parsed.offset)) / parsed.scale


def with_unit(number: str, unit: str) -> str:
    """A number with its unit behind it, as people read it: a plain number has none.

    Parameters
    ----------
    number : str
        The number as it is printed.
    unit : str
        Its unit; "1", "-" and "" are none.

    Returns
    -------
    str

    Examples
    --------
    >>> with_unit("1.5", "bar"), with_unit("0.005", "1")
    ('1.5 bar', '0.005')
    """
    return number if unit in ("", "1", "-") else f"{number} {unit}"


def in_words(unit: str, dimension: str, *values: float, digits: str = ".4g") -> str:
    """SI values in the unit that a log or a file has.

    Parameters
    ----------
    unit : str
        The unit as it is written there; what it says that a pressure is measured from is left out.
        Empty for that of SI.
    dimension : str
        As for :func:`to_si`.
    *values : float
        In SI; gauge pressures.
    digits : str, optional
        How numbers are formatted.

    Returns
    -------
    str
        The number with its unit, of two the range.

    Examples
    --------
    >>> in_words("bar(a)", "pressure", 2e5), in_words("", "Pa", 0.0, 2e5)
    ('2 bar', '0 to 2e+05 Pa')
    """
    alone = measured_from(unit)[0] or DIMENSIONS.get(dimension, dimension)
    numbers = [f"{from_si(value, alone, dimension):{digits}}" for value in values]
    return with_unit(" to ".join(numbers), alone)


def bar_and_psi(pressure: float) -> str:
    """A pressure in words, in bar and in psi.

    Parameters
    ----------
    pressure : float
        [Pa].

    Returns
    -------
    str

    Examples
    --------
    >>> bar_and_psi(1e5)
    '1 bar (14.5 psi)'
    """
    return f"{pressure / 1e5:.4g} bar ({from_si(pressure, 'psi', 'pressure'):.4g} psi)"
