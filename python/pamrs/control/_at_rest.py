"""Rigs for linear models: effects without a derivative are refused, the others are held at rest.

The catalogue (:class:`pamrs.effects.EffectInfo`) has what each effect asks for.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from pamrs._checks import refused
from pamrs.channels import dotted
from pamrs.control._groups import lengths_of
from pamrs.effects import EFFECTS
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.rig.schema import qualified
from pamrs.simulation import Simulator

#: How long it is looked at [s].
SAMPLE: Final = 2.5e-4
#: Rate after that time, of the range between the stops [1/s], below which something rests: in a
#: tenth of a second, the time of a loop, it moves a ten-thousandth of its range by such an
#: acceleration. Of a joint of 115 deg 1e-5 rad/s, of a stroke of 0.1 m 5e-7 m/s.
_REST: Final = 5e-6
#: Keys of a regulator that has no linear model, and why.
_DEAD: Final = {
    "dead_time": "it is no state of a linear model; set it to 0, and give it as the delay of the "
    "loop",
    "dead_band": "inside its band it does not answer; hold supply_pressure",
}


def check_smooth(rig: Rig, *, supplies: bool) -> None:
    """Refuse a rig with a dead time, or with an effect that has no derivative where a valve is
    closed and a joint rests.

    Parameters
    ----------
    rig : Rig
        The model.
    supplies : bool
        Whether pressures of supplies move.

    Raises
    ------
    ParameterError
        With the name of the effect, of the dead time or dead band, or of a valve that switches.
    """
    for name, table in rig.tables("supply").items():
        for key, why in _DEAD.items():
            if supplies and (value := table.get(key, 0.0)) > 0.0:
                raise refused(f"{qualified('supply', name)}.{key}", value, why)
    for name, table in rig.tables("valve").items():
        if table["spool"] == "switching":
            raise ParameterError(
                f"{qualified('valve', name)}.spool = 'switching' is not allowed: what switches has "
                "no linear model"
            )
    for effect in rig.effects:
        info = EFFECTS[effect["id"]]
        kink = info.kink
        if "late" in info.form(effect.get("form", "")).ports:
            kink = (
                ("delay",),
                "since its delay is no state of it; take it out, and give it as the delay of the "
                "loop",
                False,
            )
        if kink is None:
            continue
        names, why, of_supplies = kink
        own = effect["parameters"]
        values = {name: own[name] for name in names if name in own}
        if any(values.values()) and (supplies or not of_supplies):
            said = ", ".join(f"{effect['id']}.{name} = {value:g}" for name, value in values.items())
            raise ParameterError(f"{said} is not allowed: the effect has no linear model, {why}")


def resting(rig: Rig) -> Rig:
    """The rig as its effects are at rest: air as warm as the wall, sensors without a lag that no
    sample shows and without what only flowing air shows them.

    Parameters
    ----------
    rig : Rig
        The model.

    Returns
    -------
    Rig
    """
    kept = []
    for effect in rig.effects:
        values, changes = effect["parameters"], EFFECTS[effect["id"]].at_rest
        if any(
            act == "out_below" and values.get(key, bound) < bound for act, key, bound in changes
        ):
            continue
        held = {key: value for act, key, value in changes if act == "set" and key in values}
        kept.append({**effect, "parameters": {**values, **held}})
    if kept == rig.effects:
        return rig
    rig = rig.without_effect()
    for effect in kept:  # in their order, which is that of the states
        place = {key: effect[key] for key in ("at", "form") if key in effect}
        rig = rig.with_effect(effect["id"], effect["parameters"], **place)
    return rig


def without_dry_friction(rig: Rig) -> Rig:
    """The rig as a motion feels it that does not turn round: its dry friction is a constant then,
    and damps nothing.

    Parameters
    ----------
    rig : Rig
        The model.

    Returns
    -------
    Rig
        Without Coulomb friction and without the effects that are dry friction.
    """
    for name in {effect["id"] for effect in rig.effects}:
        if EFFECTS[name].dry_friction:
            rig = rig.without_effect(name)
    return rig.with_parameters(
        {name: 0.0 for name in rig.parameters if name.rpartition(".")[2] == "coulomb"}
    )


def after(simulator: Simulator, inputs: Mapping[str, float]) -> dict[str, float]:
    """Channels one sample after the present state; the simulator is left as it was.

    Parameters
    ----------
    simulator : Simulator
        With the sample time :data:`SAMPLE`.
    inputs : mapping of str to float
        Commands by name.

    Returns
    -------
    dict of str to float
    """
    state = simulator.state
    block = simulator._advance(1, {name: np.array([value]) for name, value in inputs.items()})
    simulator.restore(state)
    return {name: float(values[0]) for name, values in block.items()}


def closed(rig: Rig) -> dict[str, float]:
    """Commands that close every valve: its null [V] by the channel."""
    return {
        dotted("valve_command", name): float(table["null_voltage"])
        for name, table in rig.tables("valve").items()
    }


def kept(rig: Rig, sample: Mapping[str, float]) -> dict[str, float]:
    """Commands that set every regulator to the pressure that it has."""
    return {
        dotted("supply_command", name): sample[dotted("supply_pressure", name)]
        for name, table in rig.tables("supply").items()
        if table.get("kind") == "regulator"
    }


def slowest(rig: Rig) -> dict[str, float]:
    """Rates of joints [rad/s] and loads [m/s], by channel, up to which a body counts as at rest."""
    ends = {
        dotted("joint_rate", name): (table["min_angle"], table["max_angle"])
        for name, table in rig.tables("joint").items()
    }
    if (lengths := lengths_of(rig)) is not None:
        ends["length_rate"] = lengths
    return {name: _REST * float(high - low) for name, (low, high) in ends.items()}
