"""Commands of a rig, each with its safe value and its limits, and those that bring the rig to
the state that experiments begin in.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from pamrs._checks import checked_number, positive, rising
from pamrs.channels import channel_of, unit_of
from pamrs.errors import ParameterError
from pamrs.experiments import Experiment, chains_of
from pamrs.rig import Rig
from pamrs.simulation import has_frame

_VENTING: Final = 0.25  # opening by which a valve vents before a run: seconds, and no arm drops
_MORE: Final = 1.2  # times the highest pressure of a rig that a gauge may show
_TURNED: Final = 0.5  # [rad] by which an angle may leave the range of its joint
_BELOW: Final = -3e4  # [Pa] lowest gauge pressure that a gauge may show
_SAME: Final = 1e-9  # share of a limit that rounding may pass


@dataclass(frozen=True)
class Bench:
    """Limits of a device, where they are not those of the rig file.

    Attributes
    ----------
    limits : mapping of str to (float, float)
        Lowest and highest value of a command by its channel [SI]; the range of every valve, and of
        a regulator 0 to ``limits.max_pressure`` of the rig file, by default. No experiment beyond
        them is proposed.
    safe : mapping of str to float
        What is written first and last [SI]: by default valves closed, regulators at 0 Pa.
    rest : mapping of str to float
        What brings the rig to where experiments begin [SI]: by default valves, open by a quarter at
        most, vent their chambers, or bring them to ``initial_pressure`` of the rig file, and
        regulators are set to what they begin with.
    settle : float
        How long that is written before each run [s].
    highest : float, optional
        Gauge pressure up to which experiments go [Pa]; what was recorded, and without recordings
        ``limits.max_pressure`` of the rig file, by default.
    period : float, optional
        Time between two commands [s]; that of the experiment by default.
    plausible : mapping of str to (float, float)
        Lowest and highest value of a channel that can be [SI]; a device that shows another one for
        a tenth of a second is stopped. By default from the rig file.
    unattended : bool
        Whether nobody is there who hangs another payload on, as always with a device.
    """

    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    safe: Mapping[str, float] = field(default_factory=dict)
    rest: Mapping[str, float] = field(default_factory=dict)
    settle: float = 5.0
    highest: float | None = None
    period: float | None = None
    plausible: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    unattended: bool = False


class Commands:
    """The commands of a rig on a bench.

    Parameters
    ----------
    rig : Rig
        The nominal model.
    bench : Bench
        What the user says.

    Attributes
    ----------
    ranges : dict of str to (float, float, float)
        Of every command what is safe, its lowest and its highest value [SI].
    rest : dict of str to float
        What is written before a run [SI].
    begins : dict of str to (dict of str to float, float)
        Of every pressure that valves move their commands, each with the one that closes its valve
        [V], and the pressure that a run begins at [Pa].

    Raises
    ------
    ParameterError
        If a name is no command of the rig, or a value is not allowed.
    """

    def __init__(self, rig: Rig, bench: Bench) -> None:
        self.rig, self.bench = rig, bench
        positive("settle", bench.settle, zero=True)
        names = [name for chain in chains_of(rig) for name in chain.commands]
        names += ["length"] if has_frame(rig) else []
        for what in ("limits", "safe", "rest"):
            for name in getattr(bench, what):
                if name not in names:
                    raise ParameterError(
                        f"{what} has {name!r}, which is not allowed: the commands of rig "
                        f"{rig.name!r} are {', '.join(names) or 'none'}"
                    )
        self.ranges: dict[str, tuple[float, float, float]] = {}
        self.rest: dict[str, float] = {}
        for name in names:
            safe, low, high, rest = _usual(rig, name)
            low, high = rising(f"limits[{name!r}]", bench.limits.get(name, (low, high)))
            unit = unit_of(name)
            rest = min(max(rest, low), high)
            safe = checked_number(f"safe[{name!r}]", bench.safe.get(name, safe), low, high, unit)
            self.ranges[name] = safe, low, high
            self.rest[name] = checked_number(
                f"rest[{name!r}]", bench.rest.get(name, rest), low, high, unit
            )

        self.begins = {
            chain.pressure: ({n: _usual(rig, n)[0] for n in chain.commands}, chain.before(rig))
            for chain in chains_of(rig)
            if chain.valves and not set(chain.commands) & set(bench.rest)
        }

    @property
    def safe(self) -> dict[str, float]:
        """Commands that are written first and last [SI]."""
        return {name: safe for name, (safe, _, _) in self.ranges.items()}

    @property
    def plausible(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest value of a channel that can be [SI]."""
        tables = self.rig.tables
        tanks = [float(own["initial_pressure"]) for own in tables("supply").values()]
        most = max([self.rig.limits.get("max_pressure") or 0.0, *tanks])
        found = {}
        for name, chain in ((chain.pressure, chain) for chain in chains_of(self.rig)):
            if most > 0.0:
                found[name] = (_BELOW, _MORE * most)
            for channel in chain.moves:
                joint = tables("joint").get(channel.partition(".")[2])
                if joint is not None:
                    low, high = joint["min_angle"] - _TURNED, joint["max_angle"] + _TURNED
                    found[channel] = (low, high)
        return found | {
            name: rising(f"plausible[{name!r}]", span)
            for name, span in self.bench.plausible.items()
        }

    def beyond(self, experiment: Experiment) -> str:
        """Which command of an experiment is not allowed, in words; empty where all are."""
        for name, values in experiment.commands.items():
            if name not in self.ranges:
                return (
                    f"it commands {name}, and the rig takes {', '.join(self.ranges) or 'nothing'}"
                )
            _, low, high = self.ranges[name]
            least, most = float(np.min(values)), float(np.max(values))
            slack = _SAME * max(abs(low), abs(high))
            if least < low - slack or most > high + slack:
                unit = unit_of(name)
                return (
                    f"its {name} goes from {least:.4g} to {most:.4g} {unit}, and limits allow "
                    f"{low:.4g} to {high:.4g} {unit}"
                )
        return ""


def _usual(rig: Rig, name: str) -> tuple[float, float, float, float]:
    """Safe value of a command, its lowest and highest one, and that at rest [SI]."""
    kind, block = channel_of(name), name.partition(".")[2]
    if kind == "valve_command":
        table = rig.tables("valve")[block]
        null, half = float(table["null_voltage"]), float(table["half_range"])
        return null, null - half, null + half, null - _VENTING * half
    if kind == "length":  # of a load frame, which leaves the muscle long
        table = rig.tables("load")[""]
        low, high = float(table["min_length"]), float(table["max_length"])
        return high, low, high, high
    begins = 0.0
    if kind == "supply_command":
        begins = float(rig.tables("supply")[block]["initial_pressure"])
    most = rig.limits.get("max_pressure")
    if most is None:
        raise ParameterError(
            f"limits.max_pressure of rig {rig.name!r} is missing: it says how far {name} may go"
        )
    return 0.0, 0.0, float(most), begins
