"""Commands of a live loop: a number for a plant with one command, else a mapping by name; the safe
value and the limits of each.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Mapping
from typing import Any, Final, TypeAlias

from pamrs._checks import refused, rising
from pamrs.channels import channel_of
from pamrs.control._protocol import Controller, check_drives_valve, commands_of
from pamrs.errors import ParameterError

#: A number, or a number for each of several commands: ``valve_command.flexor`` -> V.
Command: TypeAlias = "float | Mapping[str, float]"
#: Of a valve that a controller drives by itself: closed, and the whole range [V].
_VALVE: Final = (5.0, 0.0, 10.0)


class LiveCommands:
    """The commands of a controller, by name.

    Parameters
    ----------
    controller : Controller
        One that answers a valve command has a single one without a name; one that answers every
        input says which they are (``command_ranges``), or ``safe`` does.
    safe : float or mapping of str to float, optional
        As for :func:`pamrs.control.run_live`.
    limits : (float, float) or mapping of str to that, optional
        As there.

    Attributes
    ----------
    names : tuple of str
    safe : dict of str to float
        Safe value of each.

    Raises
    ------
    ParameterError
        If the controller answers a pressure, a name is unknown, there is no safe value, or one is
        outside its limits.
    """

    def __init__(self, controller: Controller, safe: Any, limits: Any) -> None:
        ranges: Mapping[str, tuple[float, float, float]] = {"": _VALVE}
        if controller.answers == "inputs":
            ranges = getattr(controller, "command_ranges", {})
            if not ranges:
                ranges = _ranges_of_safe(controller, safe)
        else:
            check_drives_valve(controller)
        self.names = tuple(ranges)
        self.safe = {name: value for name, (value, _, _) in ranges.items()}
        self._limits = {name: (low, high) for name, (_, low, high) in ranges.items()}
        for name, value in self._given("limits", limits).items():
            self._limits[name] = rising(self._label("limits", name), value)
        for name, value in self._given("safe", safe).items():
            self.safe[name] = self._number(self._label("safe", name), value)
        for name, value in self.safe.items():
            low, high = self._limits[name]
            if not low <= value <= high:
                raise ParameterError(
                    f"{self._label('safe', name)} = {value:g} is not allowed: from {low:g} to "
                    f"{high:g} is needed"
                )

    @property
    def single(self) -> bool:
        """True where there is one command, which is written as a number."""
        return len(self.names) == 1

    def written(self, values: Mapping[str, Any]) -> Any:
        """Values in the form that a device takes: a number, or a mapping of names to numbers."""
        return values[self.names[0]] if self.single else dict(values)

    def kept(self, answer: Any) -> dict[str, float]:
        """Commands of a controller's answer by name, clipped to the limits.

        Raises
        ------
        ParameterError
            If a command is missing, too much, or not a finite number.
        """
        if self.names != ("",) and not isinstance(answer, Mapping):
            raise ParameterError(
                f"the controller answered {answer!r}: a mapping of {', '.join(self.names)} is "
                "needed"
            )
        given = {"": answer} if self.names == ("",) else dict(commands_of(answer))
        if set(given) != set(self.names):
            raise ParameterError(
                f"the controller answered {', '.join(map(repr, given)) or 'nothing'}: "
                f"{', '.join(self.names)} are needed"
            )
        found = {}
        for name in self.names:
            value, (low, high) = float(given[name]), self._limits[name]
            if not math.isfinite(value):
                of = f" {name}" if name else ""
                raise ParameterError(
                    f"the controller's command{of} is {value}: a finite number is needed"
                )
            found[name] = min(max(value, low), high)
        return found

    def _given(self, what: str, given: Any) -> dict[str, Any]:
        """An argument by the names of commands; one value for all of them."""
        if given is None:
            return {}
        if isinstance(given, Mapping):
            for name in given:
                if name not in self.names or not name:
                    raise ParameterError(
                        f"{what} has {name!r}; the commands are "
                        f"{', '.join(filter(None, self.names)) or 'one without a name: a number'}"
                    )
            return dict(given)
        kinds = {channel_of(name) for name in self.names}
        if len(kinds) > 1:
            raise ParameterError(
                f"{what} = {given!r} is not allowed for {', '.join(self.names)}, which have "
                "several units: a mapping of names is needed"
            )
        return dict.fromkeys(self.names, given)

    def _label(self, what: str, name: str) -> str:
        return what if self.single else f"{what}[{name!r}]"

    @staticmethod
    def _number(label: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, numbers.Real):
            raise refused(label, value, "a number is needed")
        return float(value)


def _ranges_of_safe(controller: Controller, safe: Any) -> dict[str, tuple[float, float, float]]:
    """Unbounded ranges for commands that the controller does not name: those with a safe value."""
    if not isinstance(safe, Mapping) or not safe:
        raise refused(
            "safe",
            safe,
            f"a {type(controller).__name__} answers every input of a rig and does not say which "
            "(command_ranges); a mapping of every command to its safe value is needed",
        )
    return {str(name): (0.0, -math.inf, math.inf) for name in safe}
