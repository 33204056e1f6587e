"""Where the numbers of a simulator's state are that a linear model is made of: the named states, and those of effects.

The order is that of the core (``crates/pam-core/src/rig/layout.rs``, ``simulate.rs``): pressures of supplies and gases (absolute),
masses, coordinates, rates, what effects need (in the order in which they were added), books, memories of the muscles, flags, samples.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from pamrs.channels import channel_of, dotted
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.simulation import core_rig

__all__ = ["COMMAND", "Place", "RigState", "check_smooth", "resting", "without_dry_friction"]

#: Half width of the differences [SI of the channel]; the rate's is small beside any speed at which Coulomb friction turns round.
_WIDTHS: Final[dict[str, float]] = {
    "supply_pressure": 100.0,
    "line_pressure": 10.0,
    "muscle_pressure": 10.0,
    "joint_angle": 1e-5,
    "joint_rate": 1e-5,
    "length": 1e-6,
    "length_rate": 1e-6,
}
#: Half width of the differences in a command [V].
COMMAND: Final = 1e-3
_MASS: Final = 3e-5  # of the gas's
_SHORTEST: Final = 2e-5  # s; the core takes a lag of the input path below it as none
_BOOKS: Final = 6
_MEMORY: Final = 9  # numbers of each muscle's memory
_SPOOL: Final = 6  # begun, four along the path, the spool behind its play
#: Effects without a derivative: the parameters that switch them off at zero, and why.
_KINKS: Final[dict[str, tuple[tuple[str, ...], str]]] = {
    "valve_dead_zone": (("half_width",), "at its centre no small command reaches the flow"),
    "valve_hysteresis": (("half_width",), "inside its play no small command moves the spool"),
    "mullins_softening": (("softening",), "its memory moves with contraction only"),
    "clock_skew": (("offset", "rate"), "its delay is no state of the rig; take it out, and give it as the delay of the loop"),
}
#: The same of what only moves a supply.
_SUPPLY_KINKS: Final[dict[str, tuple[tuple[str, ...], str]]] = {
    "compressor_cut_in": (("free_air_delivery",), "it is a relay; hold supply_pressure"),
    "supply_regulator_deadband": (("dead_band",), "inside its band it does not answer; hold supply_pressure"),
}


@dataclass(frozen=True)
class Place:
    """One number of the state.

    Attributes
    ----------
    name : str
        A channel of the rig, or the effect that it belongs to (``input_path_lag.lag``), with the block behind a dot where it has one.
    index : int
        Where it is.
    width : float
        Half width of differences [SI].
    spool : bool
        Whether it is behind the command and before the opening, so that the side on which a valve opens matters.
    relative : bool
        Whether the width is in parts of the value.
    """

    name: str
    index: int
    width: float
    spool: bool = False
    relative: bool = False


class RigState:
    """The places of a rig's state.

    Parameters
    ----------
    rig : Rig
        The model.
    size : int
        Length of a fresh state of its simulator.

    Attributes
    ----------
    named : list of Place
        What an initial value can be given for.
    extra : list of Place
        What effects move.
    slaved : list of int
        Memories that follow the motion as long as it is small: presliding of muscles, slip of closures.
    angles, rates : list of int
        Joints, in their order.
    begun : list of int
        Flags that say that a valve's path holds its command.

    Raises
    ------
    ParameterError
        If the rig has an effect whose states are not known here.
    """

    def __init__(self, rig: Rig, size: int) -> None:
        states = list(core_rig(rig).states)
        kinds = [channel_of(name) for name in states]
        supplies, gases = kinds.count("supply_pressure"), kinds.count("muscle_pressure") + kinds.count("line_pressure")
        moved = [k for k, kind in enumerate(kinds) if kind in ("joint_angle", "length")]
        still = [k for k, kind in enumerate(kinds) if kind in ("joint_rate", "length_rate")]
        angle = supplies + 2 * gases
        self.angles = [angle + k for k in range(len(moved))]
        self.rates = [angle + len(moved) + k for k in range(len(moved))]
        index = list(range(len(states)))  # pressures come first here and there
        for k, place in zip([*moved, *still], [*self.angles, *self.rates], strict=True):
            index[k] = place
        self.named = [Place(name, index[k], _WIDTHS[kinds[k]]) for k, name in enumerate(states)]
        self._first_mass, self._next = supplies + gases, angle + 2 * len(moved)
        self._joints = [states[k].partition(".")[2] for k in moved]
        self._chambers = [name.partition(".")[2] for name in states if channel_of(name) == "muscle_pressure"]
        self._spools: dict[str, int] = {}
        self.begun: list[int] = []
        self.slaved: list[int] = []
        self.extra = [place for effect in rig.effects for place in self._of(rig, effect)]
        muscles = len(rig.tables("muscle"))
        rest = 2 * len(moved) + len(rig.tables("valve")) + len(rig.tables("line")) + 1
        if self._next + _BOOKS + _MEMORY * muscles + rest != size:
            named = ", ".join(effect["id"] for effect in rig.effects)
            raise ParameterError(f"rig {rig.name!r} has states of its effects ({named}) for which there is no linear model")
        first = self._next + _BOOKS
        self.slaved += range(first, first + _MEMORY * muscles)

    def _of(self, rig: Rig, effect: dict[str, Any]) -> Iterator[Place]:
        """Places of an effect; advances to the next one's."""
        name = effect["id"]
        here = effect.get("at", "")

        def blocks(names: list[str]) -> list[str]:
            return [block for block in names if here in ("", block)]

        def placed(count: int, part: str, block: str, width: float) -> Place:
            return Place(dotted(dotted(name, part), block), self._next + count, width)

        if name in ("valve_hysteresis", "input_path_lag"):
            for block in blocks(list(rig.tables("valve"))):
                if block not in self._spools:  # the spool's play and its path share theirs
                    self._spools[block] = self._next
                    self.begun.append(self._next)
                    self._next += _SPOOL
                if name == "input_path_lag":
                    width = COMMAND / float(rig.tables("valve")[block]["half_range"])
                    for k, part in enumerate(("lag", "delay_1", "delay_2", "delay_3"), 1):
                        yield Place(dotted(f"{name}.{part}", block), self._spools[block] + k, width, spool=True)
        elif name == "heat_transfer":
            for block in blocks(self._chambers):  # with a balance of energy, a gas's mass is a state of its own
                yield Place(dotted(f"{name}.air_mass", block), self._first_mass + self._chambers.index(block), _MASS, relative=True)
        elif name in ("pressure_lag", "muscle_creep"):
            lag = name == "pressure_lag"
            for block in blocks(self._chambers if lag else list(rig.tables("muscle"))):
                yield placed(0, "", block, _WIDTHS["muscle_pressure"] if lag else _WIDTHS["length"])
                self._next += 1
        elif name == "tube_flow_restriction":  # a reading for each gas behind its valves, which moves nothing
            ports = rig.ports("valve")
            self._next += len({ports[block]["to"] for block in blocks(list(ports))})
        elif name in ("payload_swing", "base_flexibility"):
            yield placed(0, "angle", "", 1e-5)
            yield placed(1, "rate", "", 1e-5)
            self._next += 2
        elif name == "closure_torque":
            for block in blocks(self._joints):
                yield placed(0, "angle", block, 1e-5)
                yield placed(1, "pressure", block, 1e-4)
                self.slaved.append(self._next + 2)
                self._next += 3
        elif name == "closure_flow":
            for block in blocks(self._chambers):
                yield placed(0, "pressure", block, 1e-4)
                yield placed(1, "opening", block, 1e-4)
                self._next += 2
        elif name in ("closure_supply", "compressor_cut_in"):
            for block, table in rig.tables("supply").items():
                if block not in blocks([block]) or (name == "compressor_cut_in" and table["kind"] != "tank"):
                    continue
                if name == "closure_supply":
                    yield placed(0, "pressure", block, 1e-4)
                self._next += 1


def check_smooth(rig: Rig, *, supplies: bool) -> None:
    """Refuse a rig with an effect that has no derivative where a valve is closed and a joint rests.

    Parameters
    ----------
    rig : Rig
        The model.
    supplies : bool
        Whether pressures of supplies move.

    Raises
    ------
    ParameterError
        With the effect's name.
    """
    kinks = {**_KINKS, **(_SUPPLY_KINKS if supplies else {})}
    for effect in rig.effects:
        keys, why = kinks.get(effect["id"], ((), ""))
        values = {key: effect["parameters"][key] for key in keys}
        if any(values.values()):
            said = ", ".join(f"{effect['id']}.{key} = {value:g}" for key, value in values.items())
            raise ParameterError(f"{said} is not allowed: the effect has no linear model, {why}")


def resting(rig: Rig) -> Rig:
    """The rig with its air as warm as the wall, without a sensor's lag that is shorter than any sample, and with the transducers of
    its tubes at the muscles: at either end they read the same while a valve is shut.

    Parameters
    ----------
    rig : Rig
        The model.

    Returns
    -------
    Rig
    """
    for effect in rig.effects:
        if effect["id"] == "heat_transfer":
            values = {**effect["parameters"], "initial_temperature_rise": 0.0}
            rig = rig.with_effect("heat_transfer", values, at=effect.get("at", ""))
        elif effect["id"] == "pressure_lag" and effect["parameters"]["time_constant"] < _SHORTEST:
            rig = rig.without_effect("pressure_lag")
        elif effect["id"] == "tube_flow_restriction":
            rig = rig.with_effect("tube_flow_restriction", {**effect["parameters"], "tap": 0.0}, at=effect.get("at", ""))
    return rig


def without_dry_friction(rig: Rig) -> Rig:
    """The rig as a motion feels it that does not turn round: its Coulomb friction is a constant then, and damps nothing.

    Parameters
    ----------
    rig : Rig
        The model.

    Returns
    -------
    Rig
        Without Coulomb friction, ``joint_coulomb_stribeck`` and ``muscle_hysteresis``.
    """
    for effect in ("joint_coulomb_stribeck", "muscle_hysteresis"):
        rig = rig.without_effect(effect)
    return rig.with_parameters({name: 0.0 for name in rig.parameters if name.rpartition(".")[2] == "coulomb"})
