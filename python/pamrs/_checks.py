"""Checks of arguments that several packages share."""

from __future__ import annotations

import functools
import inspect
import math
import numbers
import re
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final, ParamSpec, TypeVar

from pamrs.channels import UNITS, channel_of
from pamrs.errors import ParameterError, UnitWarning
from pamrs.units import with_unit

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

Given = ParamSpec("Given")
Result = TypeVar("Result")
_UNNOTICED_PRESSURE = 50.0  # [Pa] below which no muscle notices a pressure


def as_said(value: object) -> str:
    """Value as a message prints it, on one line of limited length; never raises."""
    try:
        plain_scalar = type(value).__module__ == "numpy" and getattr(value, "shape", None) == ()
        text = repr(value.item() if plain_scalar else value)  # type: ignore[attr-defined]
    except ValueError:  # a whole number of more digits than Python prints
        text = f"a {type(value).__name__} that is too long to print"
    return text if len(text) <= _MOST_SAID else f"{text[: _MOST_SAID - 3]}..."


def refused(name: str, value: object, needed: str) -> ParameterError:
    """Error for an argument: its name, the value given, and what is allowed."""
    return ParameterError(f"{name} = {as_said(value)} is not allowed: {needed}")


def check_kind(name: str, value: object, kind: type | tuple[type, ...], needed: str) -> None:
    """Refuse what is of another type; the error says which it is, and what is needed."""
    if not isinstance(value, kind):
        raise ParameterError(f"{name} is a {type(value).__name__}; {needed} is needed")


def check_names(what: str, names: Iterable[str], known: Iterable[str], kind: str) -> None:
    """Refuse unknown names; the error says what kind is needed and lists the known ones."""
    there = list(known)
    for name in names:
        if name not in there:
            listed = ", ".join(map(repr, there)) or "none"
            raise ParameterError(f"{what} has {name!r}, which is no {kind}; there are: {listed}")


def as_column(name: str, values: Any) -> NDArray[np.float64]:
    """Check an array of one dimension with at least one number."""
    column = as_numbers(name, values).copy()
    if column.ndim != 1 or column.size == 0:
        raise misshapen(name, column.shape)
    return column


def misshapen(
    name: str, shape: tuple[int, ...], rows: int | None = None, each: str = ""
) -> ParameterError:
    """Error for an array whose shape is not one row of ``each``, perhaps of a given length."""
    count = max(shape, default=0) if rows is None else rows
    needed = f"({count},)" if count else "(n,) with n >= 1"
    return ParameterError(f"{name} has the shape {shape}; {needed} is needed{each and ', '}{each}")


def matched(**given: Any) -> tuple[NDArray[np.float64], ...]:
    """Check finite numbers by the names of their arguments, and broadcast them to one shape."""
    import numpy as np

    arrays = {name: as_numbers(name, values) for name, values in given.items()}
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            value = array[~np.isfinite(array)][0]
            raise refused(name, value, "finite numbers are needed")
    try:
        return tuple(np.broadcast_arrays(*arrays.values()))
    except ValueError:
        shapes = {name: array.shape for name, array in arrays.items() if array.ndim}
        raise ParameterError(
            f"{' and '.join(shapes)} have the shapes {' and '.join(map(str, shapes.values()))}; "
            "one shape for all is needed"
        ) from None


def contraction_of(contraction: Any, length: Any, rest_length: float) -> Any:
    """Contraction [1], given as such or computed from a length [m]; exactly one is needed."""
    import numpy as np

    if (contraction is None) == (length is None):
        raise ParameterError("give contraction or length, one of the two")
    if contraction is not None:
        return plain("contraction", contraction, "1")
    return 1.0 - np.asarray(plain("length", length, "m"), dtype=np.float64) / rest_length


def as_numbers(name: str, values: Any, most: int | None = None) -> NDArray[np.float64]:
    """An array of numbers that is not larger than it may be.

    Parameters
    ----------
    name : str
        What it is, for the message.
    values : array_like
        What was given.
    most : int, optional
        Numbers that it may have.

    Returns
    -------
    ndarray

    Raises
    ------
    ParameterError
        If it is no numbers, or too many.
    """
    import numpy as np

    without_units(name, values)
    size = getattr(values, "size", 0)  # an array that repeats one number is larger than it seems
    if most is not None and isinstance(size, int) and size > most:
        raise ParameterError(f"{name} has {size} numbers, which is not allowed: at most {most} are")
    try:
        return np.asarray(values, dtype=np.float64, order="C")
    except _NO_NUMBER:
        raise refused(name, values, "numbers are needed") from None


def without_units(name: str, values: Any) -> None:
    """Refuse quantities of pint where units are not converted: arrays would lose theirs."""
    if _with_units(values):
        raise refused(name, values, "plain numbers are needed here, in SI units")


def is_quantity(value: Any) -> bool:
    """True for a number or an array with a unit of its own, as pint has them."""
    return hasattr(value, "magnitude") and hasattr(value, "to")


def plain(name: str, value: Any, unit: str) -> Any:
    """A quantity as a plain number or array in an SI unit; anything else as it is.

    Parameters
    ----------
    name : str
        What it is, for the message.
    value : object
        A pint quantity, or anything else. Pressures are taken as gauge pressures.
    unit : str
        The SI unit as pamrs writes it, "1" for plain numbers.

    Raises
    ------
    ParameterError
        If the quantity is of another dimension.
    """
    if isinstance(value, (list, tuple)):
        return [plain(name, one, unit) for one in value] if _with_units(value) else value
    if not is_quantity(value):
        return value
    try:
        return value.to(_POWER.sub("**", "dimensionless" if unit == "1" else unit)).magnitude
    except Exception as error:  # of its own library, which is not imported here
        needed = f"a quantity in {unit} or a unit of the same dimension is needed ({error})"
        raise refused(name, value, needed) from None


#: SI units of the arguments of public functions, which mean the same wherever they are taken; of a
#: mapping without one here, keys are names of arguments or channels.
ARGUMENTS: Final = {
    **dict.fromkeys(("pressure", "supply_command", "pressure_limit", "max_pressure"), "Pa"),
    **dict.fromkeys(("modulus_offset", "ambient_pressure", "min_pressure"), "Pa"),
    **dict.fromkeys(("c10", "c01", "bladder_modulus", "map_pressure", "level_tolerance"), "Pa"),
    **dict.fromkeys(("length", "rest_length", "rest_diameter", "wall_thickness"), "m"),
    **dict.fromkeys(("friction_presliding", "upper_axial", "upper_offset", "radius"), "m"),
    **dict.fromkeys(("lower_axial", "lower_offset"), "m"),
    **dict.fromkeys(("sample_time", "step", "duration", "period", "start", "stop", "at"), "s"),
    **dict.fromkeys(("rise", "hold", "ramp", "delay"), "s"),
    **dict.fromkeys(("angle", "rest_angle", "braid_angle", "low", "high", "to"), "rad"),
    **dict.fromkeys(("before", "after", "bias", "triangle", "triangle_bias"), "rad"),
    **dict.fromkeys(("contraction", "map_contraction", "modulus_slope"), "1"),
    **dict.fromkeys(("force", "map_force", "buckling_load", "clipped"), "N"),
    **dict.fromkeys(("temperature", "reference_temperature"), "K"),
    "valve_command": "V",
    "softening": "1/K",
    "triangle_frequency": "1/s",
}


def quantities(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """A function that also takes pint quantities where `ARGUMENTS` has a unit."""
    known: list[inspect.Signature] = []

    @functools.wraps(function)
    def inner(*args: Given.args, **kwargs: Given.kwargs) -> Result:
        if not any(map(_with_units, args)) and not any(map(_with_units, kwargs.values())):
            return function(*args, **kwargs)
        if not known:
            known.append(inspect.signature(function))
        bound = known[0].bind_partial(*args, **kwargs)
        for name, value in bound.arguments.items():
            if name in ARGUMENTS or isinstance(value, Mapping):
                bound.arguments[name] = _all_plain(name, value, ARGUMENTS.get(name))
        return function(*bound.args, **bound.kwargs)

    inner.quantities = True  # type: ignore[attr-defined]
    return inner


def _with_units(value: Any) -> bool:
    """True where a value is a quantity of pint, or contains one."""
    if isinstance(value, (float, int, str)) or value is None:
        return False
    if type(value) is dict:
        return any(map(_with_units, value.values()))
    if isinstance(value, (list, tuple)):
        return bool(value) and is_quantity(value[0])
    return hasattr(value, "magnitude")


def _all_plain(name: str, value: Any, unit: str | None) -> Any:
    """A value, or each of a mapping, without units."""
    if not isinstance(value, dict):
        return value if unit is None else plain(name, value, unit)
    units = {key: unit or ARGUMENTS.get(key, UNITS.get(channel_of(key))) for key in value}
    return {key: _all_plain(f"{name} {key}", one, units[key]) for key, one in value.items()}


_POWER = re.compile(r"(?<=[a-z])(?=\d)")
_MOST_SAID = 60
_NO_NUMBER = (TypeError, ValueError, OverflowError)


def positive(name: str, value: float, *, zero: bool = False) -> float:
    """The value, if it is finite and above zero (or zero, where that is allowed).

    Parameters
    ----------
    name : str
        What the message calls it.
    value : float
        The number.
    zero : bool
        Whether zero is allowed.

    Returns
    -------
    float

    Raises
    ------
    ParameterError
        Naming the argument, its value and what is allowed.
    """
    number = _number(value)
    if not (math.isfinite(number) and (number > 0.0 or (zero and number == 0.0))):
        least = "from" if zero else "above"
        raise refused(name, value, f"a finite number {least} zero is needed")
    return number


def finite(name: str, value: Any) -> float:
    """The value, if it is a finite number; an error names it otherwise."""
    if not math.isfinite(number := _number(value)):
        raise refused(name, value, "a finite number is needed")
    return number


def _parsed(value: Any) -> float:
    """Number of a value; raises one of `_NO_NUMBER` where it is none, as for every text."""
    if isinstance(value, (str, bytes, bytearray)):
        raise TypeError
    return float(value)


def _number(value: Any) -> float:
    """A value as a number, NaN where it is none."""
    try:
        return _parsed(value)
    except _NO_NUMBER:
        return math.nan


def whole(name: str, value: Any, least: int = 0, most: int | None = None) -> int:
    """A whole number within bounds.

    Parameters
    ----------
    name : str
        What it is, for the message.
    value : object
        What was given.
    least, most : int
        Bounds; without ``most`` it has no upper one.

    Returns
    -------
    int

    Raises
    ------
    ParameterError
        With name, value and what is allowed.
    """
    is_whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    if not (is_whole and least <= value and (most is None or value <= most)):
        upper = " on" if most is None else f" to {most}"
        raise refused(name, value, f"a whole number from {least}{upper} is needed")
    return int(value)


def rising(
    name: str, given: Any, lower: float = -math.inf, upper: float = math.inf, unit: str = ""
) -> tuple[float, float]:
    """Two rising finite numbers, within bounds in a unit.

    Raises
    ------
    ParameterError
        If they are not.
    """
    try:
        low, high = map(_number, given)
    except (TypeError, ValueError):
        low = high = math.nan
    if not (math.isfinite(low) and math.isfinite(high) and lower <= low < high <= upper):
        ends = with_unit(f" from {lower:g} to {upper:g}", unit) if upper < math.inf else ""
        raise refused(name, given, f"two rising finite numbers{ends} are needed")
    return low, high


def one_of(name: str, value: Any, allowed: Iterable[Any], *, also: str = "") -> Any:
    """Return a value that is among the allowed ones; the error lists them, followed by ``also``."""
    known = list(allowed)
    if value not in known:
        each = f"{'one of ' * (len(known) > 1)}{', '.join(map(repr, known))}"
        raise refused(name, value, f"{each} is needed{also}")
    return value


def checked_number(
    name: str, value: Any, lower: float, upper: float, unit: str = "", *, whole: bool = False
) -> float:
    """A finite number between two bounds.

    Parameters
    ----------
    name : str
        What it is, for the message.
    value : object
        What was given.
    lower, upper : float
        Bounds; ``upper`` may be infinite.
    unit : str, optional
        Its unit.
    whole : bool, optional
        Only a whole number is allowed.

    Returns
    -------
    float

    Raises
    ------
    ParameterError
        With name, value and what is allowed.
    """
    last = with_unit("", unit)
    kind = "whole" if whole else "finite"
    allowed = f"{'a whole number ' * whole}from {lower:g} to {upper:g}{last}"
    if math.isinf(upper):
        allowed = f"a {kind} number of {lower:g}{last} or more"
    value = plain(name, value, unit or "1")
    try:
        number = _parsed(value)
    except _NO_NUMBER:
        kind = "" if whole else "a number is needed, "
        raise refused(name, value, f"{kind}{allowed}") from None
    if not (math.isfinite(number) and lower <= number <= upper) or (
        whole and not number.is_integer()
    ):
        meant = angle_meant(name, number, lower, upper) if unit == "rad" else ""
        raise ParameterError(f"{name} = {number:g}{last} is not allowed: {allowed}{meant}")
    return number


#: What an angle is measured from, where others measure from the line at right angles to it.
_ZEROS: Final = {"braid_angle": "the circumference"}


def angle_meant(name: str, angle: float, lower: float, upper: float) -> str:
    """Likely meaning of a refused angle [rad], in words behind the refusal: degrees, or the angle
    from the other line; empty where neither is allowed.
    """
    zero, degrees = _ZEROS.get(name.rpartition(".")[2], ""), math.radians(angle)
    others = (0.5 * math.pi - angle, 0.5 * math.pi - degrees) if zero else ()
    likely = [f"{math.degrees(x):.4g} deg?" for x in (degrees, *others) if lower <= x <= upper]
    return "".join([f", measured from {zero}" * bool(zero), *(f"; {one}" for one in likely[:1])])


def check_column(
    name: str, values: NDArray[np.float64], lower: float, upper: float, unit: str
) -> None:
    """Refuse a column of which a number is not finite or outside its bounds.

    Parameters
    ----------
    name : str
        What it is, for the message.
    values : ndarray
        The column.
    lower, upper : float
        Bounds.
    unit : str
        Their unit.

    Raises
    ------
    ParameterError
        With name, row, value and what is allowed.
    """
    import numpy as np

    bad = np.flatnonzero(~(np.isfinite(values) & (values >= lower) & (values <= upper)))
    if bad.size:
        wrong = with_unit(f"{name}[{bad[0]}] = {values[bad[0]]:g}", unit)
        allowed = with_unit(f"from {lower:g} to {upper:g}", unit)
        raise ParameterError(f"{wrong} is not allowed: {allowed}")


def checked_table(name: str, values: Any) -> dict[str, Any]:
    """A copy of a mapping whose keys are names.

    Parameters
    ----------
    name : str
        What it is, for the message.
    values : object
        What was given.

    Returns
    -------
    dict

    Raises
    ------
    ParameterError
        If it is no mapping, or a key is no text.
    """
    if not isinstance(values, Mapping):
        raise refused(name, values, "a mapping of names is needed")
    for key in values:
        if not isinstance(key, str):
            raise ParameterError(f"{name} has the key {key!r}, which is not allowed: a name is one")
    return dict(values)


def doubt_pascals(name: str, pressure: ArrayLike, *, inside: int = 1) -> None:
    """Warn of gauge pressures [Pa] that are all so small that bar or MPa are meant.

    Parameters
    ----------
    name : str
        What the caller calls them.
    pressure : array_like
        Gauge pressures [Pa].
    inside : int, optional
        How many functions inside the one that a user calls asks.

    Warns
    -----
    UnitWarning
        If the largest is more than nothing and less than a muscle notices.
    """
    import numpy as np

    largest = float(np.max(np.abs(pressure), initial=0.0))
    if 0.0 < largest < _UNNOTICED_PRESSURE:
        said = f"{name} never exceeds {largest:.4g} Pa (gauge): pascals are wanted, 1 bar is 1e5"
        doubt(said, inside=inside + 1)


def doubt(said: str, *, inside: int = 1) -> None:
    """Warn of a value that is possible and most likely meant in another unit, unless the package
    itself gave it.

    Parameters
    ----------
    said : str
        What it is, and what is wanted.
    inside : int, optional
        How many functions inside the one that a user calls asks.

    Warns
    -----
    UnitWarning
    """
    import sys
    import warnings

    if sys._getframe(1 + inside).f_globals.get("__name__", "").partition(".")[0] == "pamrs":
        return
    warnings.warn(said, UnitWarning, stacklevel=2 + inside)


def by_hand(value: float) -> bool:
    """True where a number has at most two digits, as a person writes it and no sensor does."""
    return float(f"{value:.2g}") == value
