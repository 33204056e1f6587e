"""The library as text: the list of its muscles, and one muscle with the origin of each number."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from pamrs.comparison import verdicts
from pamrs.library import entry, names
from pamrs.library.published import compare, table
from pamrs.units import parse_unit, with_unit

_UNITS: Final = {
    "rest_length": "mm",
    "rest_diameter": "mm",
    "braid_angle": "deg",
    "wall_thickness": "mm",
    "modulus_offset": "MPa",
    "friction_pressure_slope": "1/MPa",
    "friction_presliding": "mm",
    "mass": "kg",
    "max_pressure": "bar",
}


def overview() -> str:
    """One line per muscle: name, highest pressure of its tests, mass, title."""
    lines = [f"{'name':<21}{'max pressure':>13}{'mass':>13}  title"]
    for name in names():
        item = entry(name)
        mass = "unknown" if item.mass is None else _shown("mass", item.mass)
        lines.append(
            f"{name:<21}{_shown('max_pressure', item.max_pressure):>13}{mass:>13}  {item.title}"
        )
    return "\n".join(lines)


def description(name: str) -> str:
    """The parameters of one muscle with the origin of each, and its published facts beside ours.

    Parameters
    ----------
    name : str
        A name of the library.

    Returns
    -------
    str

    Raises
    ------
    ParameterError
        If there is no such muscle.
    """
    item = entry(name)
    values = {**item.parameters, "mass": item.mass, "max_pressure": item.max_pressure}
    known = {key: _shown(key, value) for key, value in values.items() if value is not None}
    shown = dict.fromkeys(values, "unknown") | known
    width, room = max(map(len, shown)), max(map(len, shown.values()))
    lines = [f"{name}: {item.title}", ""]
    lines += [
        f"  {key:<{width}}  {text:<{room}}  {item.origins.get(key, 'not published')}"
        for key, text in shown.items()
    ]
    rows = compare(name)
    return "\n".join([*lines, "", table(rows, titles=False), "", verdicts(rows)])


def _shown(name: str, value: Any) -> str:
    """A number, or several, in the unit that people use for it."""
    unit = _UNITS.get(name, "1")
    numbers = np.atleast_1d(np.asarray(value, dtype=np.float64)) / parse_unit(unit).scale
    numbers[np.abs(numbers) < 1e-12 * np.abs(numbers).max()] = 0.0
    text = ", ".join(f"{number:.5g}" for number in numbers)
    return with_unit(text, unit)
