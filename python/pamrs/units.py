"""Units: from what people write in files to SI.

A unit is written as products and quotients of known symbols, with exponents as plain digits:
``"kg m2"``, ``"N m s/rad"``, ``"m3/(s Pa)"``, ``"l/(s bar)"``. Symbols are case sensitive. The
angle and the volt count as dimensions of their own, so that a pressure given in degrees is an error
and not a number; inside a compound unit (``N m/rad``) the angle may be left out.
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
    "parse_unit",
    "same_dimension",
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
    "temperature": "K",
    "inertia": "kg m2",
    "first moment": "kg m",
    "acceleration": "m/s2",
    "conductance": "m3/(s Pa)",
}

# base dimensions: m, kg, s, K, V, rad
_Vector = tuple[int, int, int, int, int, int]
_NONE: Final[_Vector] = (0, 0, 0, 0, 0, 0)
_M: Final[_Vector] = (1, 0, 0, 0, 0, 0)
_M2: Final[_Vector] = (2, 0, 0, 0, 0, 0)
_M3: Final[_Vector] = (3, 0, 0, 0, 0, 0)
_KG: Final[_Vector] = (0, 1, 0, 0, 0, 0)
_S: Final[_Vector] = (0, 0, 1, 0, 0, 0)
_K: Final[_Vector] = (0, 0, 0, 1, 0, 0)
_V: Final[_Vector] = (0, 0, 0, 0, 1, 0)
_RAD: Final[_Vector] = (0, 0, 0, 0, 0, 1)
_N: Final[_Vector] = (1, 1, -2, 0, 0, 0)
_PA: Final[_Vector] = (-1, 1, -2, 0, 0, 0)
_J: Final[_Vector] = (2, 1, -2, 0, 0, 0)
_W: Final[_Vector] = (2, 1, -3, 0, 0, 0)
_HZ: Final[_Vector] = (0, 0, -1, 0, 0, 0)

_POUND: Final = 0.45359237
_INCH: Final = 0.0254
_G: Final = 9.80665

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
    ("ml"): (1e-6, _M3),
    ("mL"): (1e-6, _M3),
    ("cl"): (1e-5, _M3),
    ("gal"): (3.785411784e-3, _M3),
    ("kg"): (1.0, _KG),
    ("g"): (1e-3, _KG),
    ("lb"): (_POUND, _KG),
    ("oz"): (_POUND / 16, _KG),
    ("Pa"): (1.0, _PA),
    ("hPa"): (1e2, _PA),
    "kPa": (1e3, _PA),
    "MPa": (1e6, _PA),
    "bar": (1e5, _PA),
    "barg": (1e5, _PA),
    "mbar": (1e2, _PA),
    ("atm"): (101325.0, _PA),
    ("psi"): (_POUND * _G / _INCH**2, _PA),
    ("psig"): (_POUND * _G / _INCH**2, _PA),
    ("rad"): (1.0, _RAD),
    ("mrad"): (1e-3, _RAD),
    ("deg"): (math.pi / 180, _RAD),
    ("°"): (math.pi / 180, _RAD),
    "rev": (2 * math.pi, _RAD),
    "rpm": (2 * math.pi / 60, (0, 0, -1, 0, 0, 1)),
    "N": (1.0, _N),
    "kN": (1e3, _N),
    "mN": (1e-3, _N),
    "lbf": (_POUND * _G, _N),
    "kgf": (_G, _N),
    "Nm": (1.0, _J),
    ("J"): (1.0, _J),
    ("kJ"): (1e3, _J),
    ("W"): (1.0, _W),
    ("kW"): (1e3, _W),
    ("V"): (1.0, _V),
    ("mV"): (1e-3, _V),
    "K": (1.0, _K),
}

# units with an offset stand alone, never inside a product
_OFFSETS: Final[dict[str, tuple[float, float]]] = {
    "degC": (1.0, 273.15),
    "°C": (1.0, 273.15),
    "C": (1.0, 273.15),
    "degF": (5.0 / 9.0, 273.15 - 32.0 * 5.0 / 9.0),
    "°F": (5.0 / 9.0, 273.15 - 32.0 * 5.0 / 9.0),
}

_ABSOLUTE: Final = {"bara", "psia", "bar_abs", "bar(a)"}
_FACTOR = re.compile(r"(?P<symbol>[^\d\s^*·/()-]+|1|-|%)\^?(?P<power>-?\d+)?")


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
                power = int(match["power"])
        if exact is None:
            raise ParameterError(_unknown(whole, factor))
        scale *= exact[0] ** power
        dimension = [d + power * e for d, e in zip(dimension, exact[1], strict=True)]
    return scale, dimension


def _unknown(whole: str, factor: str) -> str:
    if whole in _ABSOLUTE:
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
        Scale and offset to SI, and the exponents of m, kg, s, K, V and rad.

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
    """Whether two units measure the same thing.

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
    """A number with its unit behind it, as people read it: a plain number stands alone.

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
