"""Checks of a force map as a whole: columns in another unit, pressures that are absolute.

Units are named only where the factor between two of them explains what was found; where several
columns can be to blame, all are named.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from pamrs._arrays import Array, Index, Mask
from pamrs.errors import ParameterError, RecordingError
from pamrs.rig import Muscle
from pamrs.units import in_words, parse_unit

PRESSURE_HIGH: Final = 5e6  # [Pa]; a map whose pressures lie beyond is in another unit
_PRESSURE_LOW: Final = 2e3
_STRAY: Final = 0.1  # of the rows may be beyond, and are flagged one by one
_PRESSURE_USUAL: Final = (8e4, 1.2e6)  # largest pressure of a map
_LENGTH_LOW, _LENGTH_HIGH = 0.3, 3.0  # of the rest length
_LONGEST: Final = (0.92, 1.06)  # the long end of a map, of the rest length
FORCE_HIGH, _FORCE_LOW = 3.0, 0.01  # of what the gas alone could do
_FORCE_USUAL: Final = (0.5, 1.15)

# quantity -> units that are taken for one another, the SI unit first
_UNITS: Final = {
    "length": ("m", "cm", "mm", "in"),
    "pressure": ("Pa", "kPa", "MPa", "bar", "mbar", "psi"),
    "force": ("N", "kN", "mN", "kgf", "lbf"),
}

_AMBIENT: Final = (90e3, 112e3)
_NEAR_REST, _BAND = 0.01, 0.003  # contraction of the longest lengths, and how far it may spread
_LEVELS: Final = 4
_SURE: Final = 5e3  # standard error of the pressure at which forces vanish [Pa]


def check_rest_length(muscle: Muscle, rest_length: float) -> None:
    """Refuse a muscle of another rest length [m] than its measurements."""
    rest = float(muscle.parameters["rest_length"])
    if not math.isclose(rest, rest_length, rel_tol=1e-6):
        raise ParameterError(
            f"rest_length: the muscle has {rest:g} m, the force map {rest_length:g} m; the same "
            "is needed"
        )


def reachable(length: Array, rest: float) -> Mask:
    """True where a muscle of this rest length could have a length, and for NaN."""
    ratio = length / rest
    return ~((ratio < _LENGTH_LOW) | (ratio > _LENGTH_HIGH))


def _slips(
    quantity: str, low: float, high: float, units: Mapping[str, str]
) -> list[tuple[str, str, float]]:
    """(unit, read as, factor) of the mistakes that make values too large by a factor from ``low``
    to ``high``.

    ``units`` says what the columns were read as. Where it does not, only mistakes with the SI unit
    count.
    """
    known = _UNITS[quantity]
    found = []
    for read_as in [units[quantity]] if quantity in units else known:
        for unit in known:
            factor = parse_unit(read_as).scale / parse_unit(unit).scale
            possible = quantity in units or known[0] in (unit, read_as)
            if possible and low <= factor <= high and not np.isclose(factor, 1.0):
                found.append((unit, read_as, factor))
    return found


def _words(slips: list[tuple[str, str, float]]) -> str:
    return " or ".join(f"in {unit}, read as {read_as}" for unit, read_as, _ in slips)


def check_units(
    label: str, length: Array, pressure: Array, rest: float, units: Mapping[str, str]
) -> None:
    """Refuse lengths and pressures that as a whole are in another unit; single stray rows are
    flagged elsewhere.

    Parameters
    ----------
    label : str
        The map, for the message.
    length, pressure : (n,) array
        Finite values [m], [Pa].
    rest : float
        Rest length [m].
    units : mapping of str to str
        Quantity -> unit that the column was read in; nothing for arrays.

    Raises
    ------
    RecordingError
        Naming the likely unit where a factor between units fits.
    """
    if not len(pressure):
        return
    gas, metre = units.get("pressure", ""), units.get("length", "")
    top = float(np.max(pressure))
    low, high = _PRESSURE_USUAL
    if 0.0 < top < _PRESSURE_LOW:
        raise RecordingError(
            f"{label}: pressure up to {in_words(gas, 'Pa', top)} only, at which no muscle pulls: "
            "wrong unit? "
            + _column_words("pressure", _slips("pressure", top / high, top / low, units))
        )
    if np.mean(pressure > PRESSURE_HIGH) > _STRAY:
        usual = float(np.quantile(pressure, 0.9))
        raise RecordingError(
            f"{label}: pressures around {in_words(gas, 'Pa', usual)}, beyond "
            f"{in_words(gas, 'Pa', PRESSURE_HIGH, digits='g')}: wrong unit? "
            + _column_words("pressure", _slips("pressure", usual / high, usual / low, units))
        )
    middle = float(np.median(np.abs(length))) / rest
    if _LENGTH_LOW <= middle <= _LENGTH_HIGH:
        return
    longest = float(np.quantile(np.abs(length), 0.9))  # a stray row does not count
    factor = longest / rest
    slips = _slips("length", factor / _LONGEST[1], factor / _LONGEST[0], units)
    if slips:
        times = slips[0][2]
        wrong = f"{times:.4g} times too small"
        if times <= 1.0:
            wrong = f"{1.0 / times:.4g} times too large"
        advice = f"Either rest_length is {wrong}, or the length column is {_words(slips)}"
    else:
        advice = (
            f"They differ by a factor of {max(factor, 1.0 / max(factor, 1e-12)):.3g}: check "
            "rest_length and the length column"
        )
    raise RecordingError(
        f"{label}: lengths up to {in_words(metre, 'm', longest)} do not go with rest_length = "
        f"{in_words(metre, 'm', rest)}: wrong unit? {advice}"
    )


def _column_words(name: str, slips: list[tuple[str, str, float]]) -> str:
    return f"The column could be {_words(slips)}" if slips else f"Check the {name} column"


def check_forces(label: str, largest: float, able: float, units: Mapping[str, str]) -> None:
    """Refuse forces that do not go with what the gas could do.

    Parameters
    ----------
    label : str
        The map, for the message.
    largest : float
        Largest force of the map [N].
    able : float
        Largest pressure times largest gas area [N].
    units : mapping of str to str
        As in :func:`check_units`.

    Raises
    ------
    RecordingError
        If the forces are beyond three times or below a hundredth of it. The forces, the pressures
        or the muscle's sizes may be to blame: all are named.
    """
    if able <= 0.0 or _FORCE_LOW * able <= largest <= FORCE_HIGH * able:
        return
    ratio = largest / able
    high = ratio > 1.0
    factors = max(ratio, 1e-12) / _FORCE_USUAL[1], max(ratio, 1e-12) / _FORCE_USUAL[0]

    def blame(quantity: str, what: str, low: float, high: float) -> str:
        slips = _slips(quantity, low, high, units)
        return f"the {quantity}s are too {what}" + (f" ({_words(slips)}?)" if slips else "")

    forces = blame("force", "large" if high else "small", *factors)
    pressures = blame("pressure", "small" if high else "large", 1.0 / factors[1], 1.0 / factors[0])
    top, most = (in_words(units.get("force", ""), "N", force) for force in (largest, able))
    found = f"force up to {top} only, where the gas could pull {most}"
    if high:
        found = f"force up to {top}, but the gas could pull {most} at most"
    raise RecordingError(
        f"{label}: {found}: wrong unit or wrong muscle? Either {forces}, or {pressures}, "
        f"or the muscle's sizes are too {'small' if high else 'large'}"
    )


def absolute_pressures(
    pressure: Array, contraction: Array, force: Array, level: Index, unit: str
) -> list[str]:
    """A note if the forces vanish near ambient pressure, as they do when the pressures are
    absolute.

    At the longest lengths, where the rubber is hardly stretched, a line through force over pressure
    is zero near zero gauge pressure, or at what it takes to lift the bladder against the braid.

    Parameters
    ----------
    pressure, contraction, force : (n,) array
        Used rows [Pa], [1], [N].
    level : (n,) int array
        Pressure level of each.
    unit : str
        That of the pressures in their file.

    Returns
    -------
    list of str
        Empty where nothing is to say, or the rows cannot tell: no length near the rest length,
        fewer than four levels there, a pressure well below ambient, or a standard error beyond 5
        kPa.
    """
    near = contraction >= -_NEAR_REST
    if float(np.min(pressure)) < _AMBIENT[0] or not near.any():
        return []
    longest = float(np.min(contraction[near]))
    rows = near & (contraction <= longest + _BAND)
    if longest > _NEAR_REST or len(np.unique(level[rows])) < _LEVELS:
        return []
    gas, pull = pressure[rows], force[rows]
    centre, spread = float(np.mean(gas)), float(np.sum((gas - np.mean(gas)) ** 2))
    slope = float(np.sum((gas - centre) * pull)) / spread
    if slope <= 0.0:
        return []
    vanish = centre - float(np.mean(pull)) / slope
    variance = float(np.sum((pull - slope * (gas - vanish)) ** 2)) / (len(gas) - 2)
    error = float(np.sqrt(variance * (1.0 / len(gas) + (vanish - centre) ** 2 / spread))) / slope
    if not (_AMBIENT[0] <= vanish <= _AMBIENT[1] and error <= _SURE):
        return []
    return [
        f"forces vanish near {in_words(unit, 'Pa', vanish)} at the longest lengths: are the "
        "pressures absolute? gauge pressures are needed (subtract the ambient pressure)"
    ]
