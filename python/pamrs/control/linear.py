"""Linear models of rigs about an operating point; those of controllers are in
``_controller_model``.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import one_of, positive
from pamrs.channels import channel_of, dotted, unit_of
from pamrs.control._at_rest import (
    SAMPLE,
    after,
    check_smooth,
    closed,
    kept,
    resting,
    slowest,
    without_dry_friction,
)
from pamrs.control._controller_model import LinearController, heard, linear_controller
from pamrs.control._groups import direct_regulators
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.simulation import Simulator, core_rig, initial_names

if TYPE_CHECKING:
    import control  # type: ignore[import-untyped]

__all__ = ["LinearController", "LinearModel", "equilibrium", "linear_controller", "linearise"]


SIDES: Final = ("mean", "fill", "vent")
FRICTIONS: Final = ("rest", "moving")


@dataclass(frozen=True)
class LinearModel:
    """``x' = A x + B u, y = C x`` about an operating point; every number is a deviation from
    :attr:`point`, SI.

    Attributes
    ----------
    a, b, c : ndarray, shapes (n, n), (n, m), (p, n)
    states, inputs, outputs : tuple of str
        Channels of the rig; among the states also what effects move, by the effect's name
        (``input_path_lag.lag``, with the block behind another dot where it has a name). A state is
        the true value, an output what the sensor reads.
    point : mapping of str to float
        Values of all channels, as the sensors read them (zeros included), and of the inputs at the
        operating point.
    side : str
        Which way the valve opens, see :func:`linearise`.
    """

    a: Array = field(repr=False)
    b: Array = field(repr=False)
    c: Array = field(repr=False)
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    point: Mapping[str, float] = field(repr=False, default_factory=dict)
    side: str = "mean"

    def system(self) -> control.StateSpace:
        """The model for python-control, with named states, inputs and outputs.

        Returns
        -------
        control.StateSpace

        Raises
        ------
        MissingPackageError
            If python-control is not installed.
        """
        library = python_control()
        d = np.zeros((len(self.outputs), len(self.inputs)))
        labels = {"states": self.states, "inputs": self.inputs, "outputs": self.outputs}
        names = {
            kind: [channel.replace(".", "_") for channel in channels]
            for kind, channels in labels.items()
        }  # it allows no dot
        return library.ss(self.a, self.b, self.c, d, **names)

    def sampled(self, period: float) -> tuple[Array, Array]:
        """State and input matrix from one sample to the next, the input held between (exact).

        Parameters
        ----------
        period : float
            [s], above zero.

        Returns
        -------
        phi, gamma : ndarray, shapes (n, n), (n, m)

        Raises
        ------
        ParameterError
            If the period is not above zero.
        """
        positive("period", period)
        from scipy.linalg import expm

        n, m = self.b.shape
        whole = np.zeros((n + m, n + m))
        whole[:n, :n], whole[:n, n:] = self.a, self.b
        moved = np.asarray(expm(whole * period), dtype=np.float64)
        return moved[:n, :n], moved[:n, n:]


def equilibrium(
    rig: Rig,
    angle: float,
    *,
    joint: str = "",
    chamber: str = "",
    initial: Mapping[str, float] | None = None,
) -> dict[str, float]:
    """The state that holds a joint at an angle with every valve closed, as initial values of a
    simulation.

    Parameters
    ----------
    rig : Rig
        With a joint and a chamber behind a valve.
    angle : float
        Within the joint's stops [rad].
    joint, chamber : str
        Their names, where they have one: which joint is held, and whose pressure holds it.
    initial : mapping of str to float, optional
        Everything else, for example the pressure of an antagonist.

    Returns
    -------
    dict of str to float
        Initial values for :func:`pamrs.simulate`.

    Raises
    ------
    ParameterError
        If the rig has no such blocks, the angle is not between the stops, or no pressure up to that
        of the supply holds it.
    """
    from scipy.optimize import brentq

    joints = rig.tables("joint")
    if joint not in joints or chamber not in rig.tables("chamber") or not rig.tables("valve"):
        raise ParameterError(
            f"rig {rig.name!r}: an angle alone says where one joint rests on one chamber behind a "
            f"valve; it has {_said('joint', joints)}, {_said('chamber', rig.tables('chamber'))} "
            f"and {_said('valve', rig.tables('valve'))}. Name one of each, or give initial=, such "
            "as RigController.holding(...)"
        )
    low, high = (joints[joint][key] for key in ("min_angle", "max_angle"))
    if not low < angle < high:
        raise ParameterError(
            f"angle = {angle} rad is not allowed: between the stops at {low:g} and {high:g} rad is "
            "needed"
        )
    rate = dotted("joint_rate", joint)
    start = {**(initial or {}), dotted("joint_angle", joint): float(angle), rate: 0.0}

    def drifting(pressure: float) -> float:
        begin = _filled(rig, start, chamber, pressure)
        return after(Simulator(rig, sample_time=SAMPLE, initial=begin), closed(rig))[rate]

    most = max(float(table.get("initial_pressure", 0.0)) for table in rig.tables("supply").values())
    if not drifting(0.0) < 0.0 < drifting(most):
        raise ParameterError(
            f"no pressure from 0 to {most:g} Pa holds {dotted('joint_angle', joint)} = {angle:g} "
            "rad at rest"
        )
    return _filled(rig, start, chamber, float(brentq(drifting, 0.0, most, xtol=1e-6, rtol=1e-14)))


def linearise(
    rig: Rig,
    angle: float | None = None,
    *,
    side: str = "mean",
    friction: str = "rest",
    held: tuple[str, ...] | None = None,
    joint: str = "",
    chamber: str = "",
    initial: Mapping[str, float] | None = None,
) -> LinearModel:
    """A rig about an angle that it holds with its valves closed, its regulators set to what they
    have.

    A and B are the exact derivatives of the core's state equation, by dual numbers, with whatever
    effects are in the rig: what they move (a lag, a delay, a creeping strain, a mounting that gives
    way, the air's mass where its temperature counts) are states like the others. Memories of
    direction (``muscle_hysteresis``) are as they are in presliding, springs about the point. What
    begins later (``payload_change``, ``external_torque``) has not begun.

    Two things have no derivative or a local one. **A valve** lets air in on one side of its null
    and out on the other, with different slopes: ``side`` chooses. **Coulomb friction**
    ``f tanh(rate/w)`` is at rest a viscous damping with the slope ``f/w``, which no motion beyond
    ``w`` has: ``friction`` chooses.

    Parameters
    ----------
    rig : Rig
        As for :func:`equilibrium`; any with valves or regulators where no angle is given.
    angle : float, optional
        The true one [rad], whatever the zero of its sensor. Without, ``initial`` holds the rig:
        that of :meth:`pamrs.control.RigController.holding`, for example.
    side : {"mean", "fill", "vent"}
        Slope by the opening above, below, or on both sides of the valve's null.
    friction : {"rest", "moving"}
        Dry friction as it is at rest, or as in a motion that does not turn round: without Coulomb
        friction, ``joint_coulomb_stribeck`` and ``muscle_hysteresis``.
    held : tuple of str, optional
        States, kinds of states or effects that are regarded as constant. By default the pressures
        of supplies, slow ones with an eigenvalue of zero, but not that of a regulator that feeds a
        chamber by itself: it is how the rig is driven.
    joint, chamber, initial
        As for :func:`equilibrium`; of several joints each has to rest, so that ``initial`` must
        hold the others.

    Returns
    -------
    LinearModel
        All named states that are not held are outputs too.

    Raises
    ------
    ParameterError
        As :func:`equilibrium`, or if the side or the friction is unknown, the rig has an effect
        without a linear model (play, dead zone, relay: the message names it), another joint does
        not rest, or a command moves nothing; if there is neither an angle nor ``initial``.
    """
    one_of("side", side, SIDES)
    one_of("friction", friction, FRICTIONS)
    constant = held
    if constant is None:  # what changes slowly, or not by a command
        slow = rig.tables("supply").keys() - direct_regulators(rig)
        constant = tuple(dotted("supply_pressure", name) for name in slow)

    def is_held(name: str) -> bool:
        return name in constant or channel_of(name) in constant

    moving = [name for name in rig.tables("supply") if not is_held(dotted("supply_pressure", name))]
    check_smooth(rig, supplies=bool(moving))
    rig = resting(without_dry_friction(rig) if friction == "moving" else rig)
    if angle is None and not initial:
        raise ParameterError(
            "angle is missing: give the angle that the rig holds, or initial values that hold it "
            "(RigController.holding)"
        )
    start = dict(initial or {})
    if angle is not None:
        start = equilibrium(rig, angle, joint=joint, chamber=chamber, initial=initial)
    simulator = Simulator(rig, sample_time=SAMPLE, initial=start)
    first = simulator.observe()
    commands = {**closed(rig), **kept(rig, first)}
    _check_rest(rig, simulator, commands)
    (states, inputs, outputs), (a, b, c) = core_rig(rig).linearise(start, side)
    free = [k for k, name in enumerate(states) if not is_held(name)]
    read = [k for k, name in enumerate(outputs) if not is_held(name)]
    driving = [  # all inputs but regulators whose pressure is held
        k
        for k, name in enumerate(inputs)
        if channel_of(name) != "supply_command" or name.partition(".")[2] in moving
    ]
    inputs = [inputs[k] for k in driving]
    a, b, c = a[np.ix_(free, free)], b[np.ix_(free, driving)], c[np.ix_(read, free)]
    named = [row for row, k in enumerate(free) if states[k] in outputs]
    _check_driven(a, b, named, {name: commands[name] for name in inputs}, side)
    # what an effect moves and nothing feels (a lag of no time, a share of nothing) is no state
    felt = np.abs(c).sum(axis=0)
    felt[named] += 1.0
    used = heard(a, felt)
    names = tuple(states[free[k]] for k in used), tuple(inputs), tuple(outputs[k] for k in read)
    return LinearModel(
        a[np.ix_(used, used)], b[used], c[:, used], *names, {**first, **commands}, side
    )


def _check_driven(
    a: Array, b: Array, named: Sequence[int], commands: Mapping[str, float], side: str
) -> None:
    """Refuse a command that reaches none of the named states."""
    for column, (name, value) in zip(b.T, commands.items(), strict=True):
        if not set(heard(a.T, column)) & set(named):
            raise ParameterError(
                f"{name} moves nothing about {value:g} {unit_of(name)} (side = {side!r}): no "
                "linear model is there"
            )


def _said(kind: str, names: Collection[str]) -> str:
    """The blocks of a kind that a rig has, in words."""
    known = [name for name in names if name]
    if known:
        return f"{kind} {', '.join(known)}"
    return f"one {kind}" if names else f"no {kind}"


def _check_rest(rig: Rig, simulator: Simulator, commands: Mapping[str, float]) -> None:
    """Refuse a state in which a joint or a load does not rest."""
    rates = after(simulator, commands)
    for name, limit in slowest(rig).items():
        if not abs(rates[name]) < limit:
            raise ParameterError(
                f"{name} is {rates[name]:.3g} {unit_of(name)} a quarter of a millisecond after the "
                f"start, which is not below {limit:.2g}: it does not rest; give initial values "
                "that hold it: those of RigController.holding, or of equilibrium for each joint in "
                "turn, until none moves"
            )


def python_control() -> Any:
    """python-control, or the error that says how to install it."""
    try:
        import control as library
    except ImportError as error:
        from pamrs.errors import missing_package

        raise missing_package(error, "control") from error
    return library


def _filled(
    rig: Rig, start: Mapping[str, float], chamber: str, pressure: float
) -> dict[str, float]:
    """A state with a pressure in a chamber, and in the lines that rest with it."""
    filled = {**start, dotted("muscle_pressure", chamber): pressure}
    if len(rig.tables("chamber")) == 1:
        filled.update({dotted("line_pressure", name): pressure for name in rig.tables("line")})
        between = (name for name in initial_names(rig) if channel_of(name) == "segment_pressure")
        filled.update(dict.fromkeys(between, pressure))
    return filled
