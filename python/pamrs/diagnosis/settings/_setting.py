"""What a setting is: a number with unit, reason, origin and the range that is allowed."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, Self

from pamrs._checks import checked_table
from pamrs.errors import ParameterError

__all__ = ["SettingsGroup", "setting"]


def setting(
    default: Any,
    *,
    unit: str,
    reason: str,
    origin: str,
    least: float = -math.inf,
    most: float = math.inf,
    above: float = -math.inf,
) -> Any:
    """Declare one setting of a group.

    Parameters
    ----------
    default : float, int, tuple of float or tuple of pairs of str
        The value that the published trials were made with.
    unit : str
        SI unit; ``1`` for a plain number, ``count`` for a whole one.
    reason : str
        What it decides, and why it has this value.
    origin : str
        Where the value comes from: literature, a page of docs/decisions, a trial, or judgement.
    least, most : float
        Smallest and largest value that is allowed.
    above : float
        A value that it must exceed.
    """
    told = {"unit": unit, "reason": reason, "origin": origin, "least": least, "most": most}
    return dataclasses.field(default=default, metadata={**told, "above": above})


@dataclasses.dataclass(frozen=True)
class SettingsGroup:
    """Settings that belong together; checked when they are made.

    Raises
    ------
    ParameterError
        If a value has the wrong type or is outside its range; names the setting, its value and
        what is allowed.
    """

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = _checked(self, field, getattr(self, field.name))
            object.__setattr__(self, field.name, value)

    def to_dict(self) -> dict[str, Any]:
        """The values by name, as JSON has them."""
        return {f.name: _plain(getattr(self, f.name)) for f in dataclasses.fields(self)}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Settings from their values by name; what is left out keeps its default.

        Parameters
        ----------
        values : mapping of str to value
            As :meth:`to_dict` gives them.

        Raises
        ------
        ParameterError
            For a name that is not a setting, or a value that is not allowed.
        """
        known = [f.name for f in dataclasses.fields(cls)]
        given = checked_table("settings", values)
        for name in given:
            if name not in known:
                raise ParameterError(
                    f"settings: {_title(cls)} has no {name!r}; it has {', '.join(known)}"
                )
        return cls(**given)


def _title(group: type) -> str:
    return group.__name__


def _plain(value: Any) -> Any:
    return [_plain(part) for part in value] if isinstance(value, tuple) else value


def _checked(group: SettingsGroup, field: dataclasses.Field[Any], value: Any) -> Any:
    """The value as its setting has it: a whole number, a finite one, or a tuple of either."""
    name = f"{_title(type(group))}.{field.name}"
    default = field.default
    if isinstance(default, tuple):
        given = value
        value = _tuple(value)
        if not value or not all(_alike(part, default[0]) for part in value):
            raise ParameterError(
                f"{name} = {given!r} is not allowed: like {list(default)!r}, one entry at least"
            )
        return tuple(_within(name, field, part) for part in value)
    return _within(name, field, value)


def _tuple(value: Any) -> Any:
    """Lists as tuples, all the way down."""
    return tuple(_tuple(part) for part in value) if isinstance(value, (list, tuple)) else value


def _alike(value: Any, pattern: Any) -> bool:
    """Whether an entry has the form of the default's entries."""
    if isinstance(pattern, tuple):
        return (
            isinstance(value, tuple)
            and len(value) == len(pattern)
            and all(_alike(part, pattern[0]) for part in value)
        )
    return isinstance(value, str) if isinstance(pattern, str) else _number(value)


def _number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _within(name: str, field: dataclasses.Field[Any], value: Any) -> Any:
    """The value if it is of the right kind and inside its range."""
    if isinstance(value, (str, tuple)) and isinstance(field.default, tuple):
        return value
    whole = isinstance(field.default, int)
    right = _number(value) and math.isfinite(value) and (not whole or value == int(value))
    told = field.metadata
    if not right or not told["least"] <= value <= told["most"] or not value > told["above"]:
        raise ParameterError(f"{name} = {value!r} is not allowed: {_allowed(told, whole=whole)}")
    return int(value) if whole else float(value)


def _allowed(told: Mapping[str, Any], *, whole: bool) -> str:
    """What is allowed, in words."""
    limits = []
    if math.isfinite(told["above"]):
        limits.append(f"above {told['above']:g}")
    if math.isfinite(told["least"]):
        limits.append(f"at least {told['least']:g}")
    if math.isfinite(told["most"]):
        limits.append(f"at most {told['most']:g}")
    kind = "a whole number" if whole else "a finite number"
    return f"{kind} {' and '.join(limits)}".strip() + (f" [{told['unit']}]")
