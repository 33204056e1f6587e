"""Starts of another fit from effects as they were fitted."""

from __future__ import annotations

from collections.abc import Iterable

from pamrs.diagnosis.fit._fitting import Fit
from pamrs.diagnosis.fit._known_parameters import LEAST_RATIO
from pamrs.diagnosis.fit._starts import Start, entry_of, form_in
from pamrs.effects import Term, effect_of, find_parameter


def parts_of(
    starts: Iterable[Start],
) -> tuple[dict[str, float], dict[str, float], dict[Term, str]]:
    """Free parameters, fixed parameters and forms of several starts."""
    free: dict[str, float] = {}
    fixed: dict[str, float] = {}
    forms: dict[Term, str] = {}
    for start in starts:
        free |= start.free
        fixed |= start.fixed
        forms[start.effect] = start.form
    return free, fixed, forms


def start_of(fitted: Fit, effect: Term) -> Start:
    """Start of another fit from an effect as it was fitted, fixed parameters included."""
    free = {
        name: _off_zero(name, value)
        for name, value in fitted.values.items()
        if effect_of(name) == effect
    }
    entry = entry_of(fitted.rig, effect)
    fixed = {
        f"{effect}.{n}": v
        for n, v in entry["parameters"].items()
        if f"{effect}.{n}" not in fitted.values
    }
    return Start(effect, free, fixed, (), False, form_in(fitted.rig, effect))


def _off_zero(name: str, value: float) -> float:
    """Value to start a parameter from, at least a share of its typical size: zero has no scale."""
    parameter = find_parameter(name)
    typical = parameter.default or parameter.starts[-1]
    least = LEAST_RATIO * max(typical, parameter.lower, 1e-3 * parameter.starts[0])
    return value if abs(value) > least else least
