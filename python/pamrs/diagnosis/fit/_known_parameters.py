"""Effects that the nominal model already holds: part of the baseline, each parameter inside what is
known of it; and distances of a parameter from its nominal value, in tolerances.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pamrs.diagnosis.fit._starts import CHOSEN
from pamrs.effects import EFFECTS, Form, effect_of, find_parameter
from pamrs.rig import Parameter, Rig, named_entries

# least tolerance of a held effect: its deviation came of a lacking model (decision 34)
_HELD_SHARE = 0.3
_MOST_DRIFT = 0.1  # of what a gauge or a load cell reads: it is broken when it drifts by more
_USUAL_PRESSURE = 1e6  # [Pa] that a rig has of which nothing tells how high it goes


_FIXED = (*CHOSEN, "threshold")
"""Roles of parameters that stay as the model has them: no fit has a slope in them."""


def _form(entry: Mapping[str, Any]) -> Form:
    return EFFECTS[entry["id"]].form(entry.get("form", ""))


def known_parameters(rig: Rig) -> dict[str, Parameter]:
    """Parameters of a rig and of the effects that it holds, by dotted name, SI.

    What is known of an effect's parameter is the standard deviation of the file, but not less than
    a share of the value: that deviation came from a model in which what is looked for now was still
    missing, and maybe from the same recordings.
    """
    parameters = dict(rig.parameters)
    spread = rig.effect_std
    for full, entry in named_entries(rig):
        known = spread.get(full, {})
        for info in _form(entry).parameters:
            value = entry["parameters"][info.name]
            least = _HELD_SHARE * abs(value)
            tol = 0.0 if info.role in _FIXED else max(known.get(info.name, 0.0), least)
            name = f"{full}.{info.name}"
            parameters[name] = Parameter(name, value, info.unit, tol, info.lower, info.upper)
    return parameters


def with_known(
    rig: Rig, values: Mapping[str, float], std: Mapping[str, float] | None = None
) -> Rig:
    """A rig with other values of its own parameters and of those of the effects that it holds.

    Parameters
    ----------
    rig : Rig
        The rig.
    values : mapping of str to float
        Dotted name -> SI value.
    std : mapping of str to float, optional
        Standard deviations of effects' parameters, SI, by dotted name; others stay as they are.
    """
    given = std or {}
    spread, of_effects = rig.effect_std, set()
    for full, entry in named_entries(rig):
        names = {f"{full}.{short}": short for short in entry["parameters"]}
        mine = {short: values[name] for name, short in names.items() if name in values}
        known = {short: given[name] for name, short in names.items() if name in given}
        of_effects |= set(names)
        if mine or known:
            rig = rig.with_effect(
                entry["id"],
                entry["parameters"] | mine,
                std=spread.get(full, {}) | known,
                at=entry.get("at", ""),
                form=entry.get("form", ""),
            )
    rest = {name: value for name, value in values.items() if name not in of_effects}
    return rig.with_parameters(rest) if rest else rig


# multiple of its nominal value, or of other walls, for a freed parameter (decision 25)
_FREED_MULTIPLE = 10.0
# share of its nominal value that a positive parameter has at the least, and of a typical size from
# which one goes on that a fit left at zero
LEAST_RATIO = 1e-3


def _is_positive(known: Parameter) -> bool:
    """True where a parameter is a positive quantity: below its value its tolerance is a factor."""
    return known.lower >= 0.0 < known.value


def largest_value(rig: Rig, name: str) -> float:
    """Largest value of an effect's parameter that a rig can have [SI]: no friction is larger than
    the pull of the muscle, no reading drifts by more than a tenth of the pressure that there can be
    or of the force that it makes.
    """
    effect, info = effect_of(name), find_parameter(name)
    most = EFFECTS[effect.id].most.get(info.name) if effect else None
    if most is None:
        return info.upper
    pressures = [t["initial_pressure"] for t in rig.tables("supply").values()]
    pressure = max([rig.limits.get("max_pressure", 0.0), *pressures]) or _USUAL_PRESSURE
    muscles = rig.tables("muscle")
    pull = max((float(rig.muscle_of(m).force(pressure, 0.0)) for m in muscles), default=math.inf)
    count = max((float(t["count"]) for t in muscles.values()), default=1.0)
    sizes = {
        "pull": pull,
        "pull per pressure": pull / pressure,
        "drift": _MOST_DRIFT * (pull * count if info.unit == "N" else pressure),
    }
    return min(info.upper, sizes[most])


def moved_value(known: Parameter, tolerances: float) -> float:
    """A parameter [SI] so many tolerances from its nominal value.

    Upwards a tolerance is added; downwards a positive quantity is multiplied by
    ``exp(-tol / value)`` for each, so that nearly nothing is as far away as it is unlikely.
    """
    moved = known.value + tolerances * known.tol
    if tolerances < 0.0 and _is_positive(known):
        moved = known.value * math.exp(tolerances * known.tol / known.value)
    return min(max(moved, known.lower), known.upper)


def moved_slope(known: Parameter, tolerances: float) -> float:
    """Change of a parameter [SI] with one more tolerance."""
    if tolerances < 0.0 and _is_positive(known):
        return known.tol * math.exp(tolerances * known.tol / known.value)
    return known.tol


def in_tolerances(known: Parameter, value: float) -> float:
    """Distance of a value [SI] from the nominal one, in tolerances."""
    if value < known.value and _is_positive(known):
        ratio = max(value / known.value, LEAST_RATIO)
        return math.log(ratio) * known.value / known.tol
    return (value - known.value) / known.tol


def ends_in_tolerances(
    known: Parameter, most: float, *, freed: bool = False
) -> tuple[float, float]:
    """The least and the largest distance that a fit allows a parameter, in tolerances: so many on
    both sides, of one that is freed what its bounds and a multiple of its value allow.
    """
    if freed:
        most = _FREED_MULTIPLE * max(most, abs(known.value) / known.tol)
    low, high = (in_tolerances(known, end) for end in (known.lower, known.upper))
    return max(low, -most), min(high, most)
