"""Linear models about an operating point: of a rig, and of any sampled controller, by differences of what they do."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from pamrs.channels import channel_of, dotted
from pamrs.control.protocol import Controller, Reference
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.simulation import core_rig
from pamrs.simulator import Simulator

if TYPE_CHECKING:
    import control  # type: ignore[import-untyped]

__all__ = ["LinearController", "LinearModel", "equilibrium", "linear_controller", "linearise"]

Array = NDArray[np.float64]

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
_COMMAND: Final = 1e-3  # V
_SAMPLE: Final = 2.5e-4  # s
SIDES: Final = ("mean", "fill", "vent")


@dataclass(frozen=True)
class LinearModel:
    """``x' = A x + B u, y = C x`` about an operating point; every number is a deviation from :attr:`point`, SI.

    Attributes
    ----------
    a, b, c : ndarray, shapes (n, n), (n, m), (p, n)
    states, inputs, outputs : tuple of str
        Channels of the rig.
    point : mapping of str to float
        Values of all channels and inputs at the operating point.
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
        names = {kind: [channel.replace(".", "_") for channel in channels] for kind, channels in labels.items()}  # it allows no dot
        return library.ss(self.a, self.b, self.c, d, **names)

    def driven_by(self, state: str) -> LinearModel:
        """The model with a state as its only input, for example the pressure of a chamber that a fast inner loop holds.

        Parameters
        ----------
        state : str
            One of :attr:`states`; it is no output any more.

        Returns
        -------
        LinearModel

        Raises
        ------
        ParameterError
            If there is no such state.
        """
        if state not in self.states:
            raise ParameterError(f"state = {state!r} is not allowed: one of {', '.join(self.states)}")
        k = self.states.index(state)
        rest = [i for i in range(len(self.states)) if i != k]
        rows = [i for i, name in enumerate(self.outputs) if name != state]
        a, b, c = self.a[np.ix_(rest, rest)], self.a[np.ix_(rest, [k])], self.c[np.ix_(rows, rest)]
        names = tuple(self.states[i] for i in rest), (state,), tuple(self.outputs[i] for i in rows)
        return LinearModel(a, b, c, *names, self.point, self.side)

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
        if not (math.isfinite(period) and period > 0.0):
            raise ParameterError(f"period = {period} s is not allowed: a finite time above zero is needed")
        from scipy.linalg import expm

        n, m = self.b.shape
        whole = np.zeros((n + m, n + m))
        whole[:n, :n], whole[:n, n:] = self.a, self.b
        moved = np.asarray(expm(whole * period), dtype=np.float64)
        return moved[:n, :n], moved[:n, n:]


@dataclass(frozen=True)
class LinearController:
    """``x+ = A x + B y, u = C x + D y`` from one sample to the next, about an operating point; y are :attr:`inputs`.

    Attributes
    ----------
    a, b, c, d : ndarray
        Shapes (n, n), (n, p), (1, n), (1, p).
    inputs : tuple of str
        Channels that the controller reads.
    period : float
        [s]
    command : float
        What it answers at the operating point.
    """

    a: Array = field(repr=False)
    b: Array = field(repr=False)
    c: Array = field(repr=False)
    d: Array = field(repr=False)
    inputs: tuple[str, ...]
    period: float
    command: float = 0.0


def equilibrium(
    rig: Rig, angle: float, *, joint: str = "", chamber: str = "", initial: Mapping[str, float] | None = None
) -> dict[str, float]:
    """The state that holds a joint at an angle with every valve closed, as initial values of a simulation.

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
        If the rig has no such blocks, the angle is not between the stops, or no pressure up to that of the supply holds it.
    """
    from scipy.optimize import brentq

    joints = rig.tables("joint")
    if joint not in joints or chamber not in rig.tables("chamber") or not rig.tables("valve"):
        raise ParameterError(f"rig {rig.name!r} needs a valve, the joint {joint!r} and the chamber {chamber!r}; name those it has")
    low, high = (joints[joint][key] for key in ("min_angle", "max_angle"))
    if not low < angle < high:
        raise ParameterError(f"angle = {angle} rad is not allowed: between the stops at {low:g} and {high:g} rad is needed")
    rate = dotted("joint_rate", joint)
    start = {**(initial or {}), dotted("joint_angle", joint): float(angle), rate: 0.0}

    def drifting(pressure: float) -> float:
        return _after(rig, _filled(rig, start, chamber, pressure), _closed(rig))[rate]

    most = max(float(table.get("initial_pressure", 0.0)) for table in rig.tables("supply").values())
    if not drifting(0.0) < 0.0 < drifting(most):
        raise ParameterError(f"no pressure from 0 to {most:g} Pa holds {dotted('joint_angle', joint)} = {angle:g} rad at rest")
    return _filled(rig, start, chamber, float(brentq(drifting, 0.0, most, xtol=1e-6, rtol=1e-14)))


def linearise(
    rig: Rig,
    angle: float,
    *,
    side: str = "mean",
    held: tuple[str, ...] = ("supply_pressure",),
    joint: str = "",
    chamber: str = "",
    initial: Mapping[str, float] | None = None,
) -> LinearModel:
    """A rig about an angle that it holds with its valves closed.

    The core simulates a quarter of a millisecond from states and commands on both sides of the point; the central differences are
    the sampled matrices, whose logarithm is A and B. That is exact for a linear plant up to the integrator's error, and takes whatever
    effects are in the rig.

    Two things have no derivative or a local one. **A valve** lets air in on one side of its null and out on the other, with different
    slopes: ``side`` chooses. **Coulomb friction** ``f tanh(rate/w)`` counts at rest with its slope ``f/w``, as a strong viscous damping
    that a moving arm does not have: linearise a rig with ``arm.coulomb = 0`` to see that one.

    Parameters
    ----------
    rig : Rig
        As for :func:`equilibrium`. States that only some effects have (memory of muscles and valves) stay at their rest values.
    angle : float
        [rad]
    side : {"mean", "fill", "vent"}
        Slope by the command above, below, or on both sides of the valve's null.
    held : tuple of str
        Kinds of states that are regarded as constant; the tank's pressure by default, a slow one with an eigenvalue of zero.
    joint, chamber, initial
        As for :func:`equilibrium`.

    Returns
    -------
    LinearModel
        All states that are not held are outputs too.

    Raises
    ------
    ParameterError
        As :func:`equilibrium`, or if the side is unknown.
    """
    from scipy.linalg import logm

    if side not in SIDES:
        raise ParameterError(f"side = {side!r} is not allowed: one of {', '.join(SIDES)}")
    start = equilibrium(rig, angle, joint=joint, chamber=chamber, initial=initial)
    compiled, commands = core_rig(rig), _closed(rig)
    first = Simulator(rig, sample_time=_SAMPLE, initial=start).observe()
    point = {name: first[name] for name in compiled.states}
    moving = [name for name in compiled.states if channel_of(name) not in held]
    n, m = len(moving), len(commands)
    sampled = np.eye(n + m)

    def reached(states: Mapping[str, float], inputs: Mapping[str, float]) -> Array:
        after = _after(rig, states, inputs)
        return np.array([after[name] for name in moving])

    for k, name in enumerate(moving):
        width = _WIDTHS[channel_of(name)]
        up, down = (reached({**point, name: point[name] + s * width}, commands) for s in (1.0, -1.0))
        sampled[:n, k] = (up - down) / (2.0 * width)
    up_to, down_to = {"mean": (1.0, -1.0), "fill": (1.0, 0.0), "vent": (0.0, -1.0)}[side]
    for k, name in enumerate(commands):
        up, down = (reached(point, {**commands, name: commands[name] + s * _COMMAND}) for s in (up_to, down_to))
        sampled[:n, n + k] = (up - down) / ((up_to - down_to) * _COMMAND)
    continuous = np.real(np.asarray(logm(sampled))) / _SAMPLE
    names = tuple(moving), tuple(commands), tuple(moving)
    return LinearModel(continuous[:n, :n], continuous[:n, n:], np.eye(n), *names, {**first, **commands}, side)


def linear_controller(
    controller: Controller, point: Mapping[str, float], angle: float | None = None, *, state: Mapping[str, Any] | None = None
) -> LinearController:
    """Any controller with a state of floats about an operating point, by central differences of one update.

    Exact for a controller that is linear inside its limits (PID, cascade). What does not reach the command (a clock), or is never
    moved by a measurement (an integral without a gain), is left out.

    Parameters
    ----------
    controller : Controller
        For one plant; it is reset before and after.
    point : mapping of str to float
        Channels at the operating point; the reference rests at its ``joint_angle``.
    angle : float, optional
        Another reference [rad].
    state : mapping, optional
        The controller's state at the operating point, for one whose integrals have to hold the arm up (a cascade, whose outer integral
        is the pressure): ``controller.state`` after a closed loop that has come to rest there. By default that of a controller which
        has seen the point three times.

    Returns
    -------
    LinearController
        From ``joint_angle``, ``joint_rate`` and ``muscle_pressure``, those of them that are in ``point``.

    Raises
    ------
    ParameterError
        If the controller answers what is not a finite number, or no measurement reaches its command: it is at a limit.
    """
    inputs = tuple(name for name in ("joint_angle", "joint_rate", "muscle_pressure") if name in point)
    reference = Reference(point["joint_angle"] if angle is None else angle)
    controller.reset()
    if state is None:
        for k in range(3):  # filters and differences have seen something
            controller.update(k * controller.period, point, reference)
    else:
        controller.restore(state)
    start = controller.state
    clocks = [value for path, value in _floats(start) if path[-1] == "time"]  # of the parts too
    now = max(clocks, default=2.0 * controller.period) + controller.period
    paths = [path for path, value in _floats(start) if path[-1] != "time"]

    def answered(state: Mapping[str, Any], sample: Mapping[str, float]) -> Array:
        controller.restore(state)
        command = float(controller.update(now, sample, reference))
        after = controller.state
        return np.array([*(_at(after, path) for path in paths), command])

    columns = []
    for path in paths:
        width = 1e-4 * max(1.0, abs(_at(start, path)))
        up, down = (answered(_changed(start, path, s * width), point) for s in (1.0, -1.0))
        columns.append((up - down) / (2.0 * width))
    for name in inputs:
        width = _WIDTHS[name]
        up, down = (answered(start, {**point, name: point[name] + s * width}) for s in (1.0, -1.0))
        columns.append((up - down) / (2.0 * width))
    command = float(answered(start, point)[-1])
    controller.reset()
    n = len(paths)
    whole = np.array(columns).T
    if not (np.isfinite(whole).all() and math.isfinite(command)):
        raise ParameterError("the controller's command is not finite at the operating point: no linear model is there")
    if not whole[n].any() or not whole[:, n:].any():
        raise ParameterError(
            f"the controller answers {command:g} whatever it measures: it is at a limit; give the state in which it holds the arm here"
        )
    # an integral with a gain of zero is heard, but nothing moves it; it would count as a motion that never dies out
    heard, moved = _heard(whole[:n, :n], whole[n, :n]), _heard(whole[:n, :n].T, np.abs(whole[:n, n:]).sum(axis=1))
    kept = sorted(set(heard) & set(moved))
    a, b = whole[np.ix_(kept, kept)], whole[np.ix_(kept, range(n, n + len(inputs)))]
    return LinearController(a, b, whole[[n]][:, kept], whole[[n]][:, n:], inputs, controller.period, command)


def python_control() -> Any:
    """python-control, or the error that says how to install it."""
    try:
        import control as library
    except ImportError as error:
        from pamrs.design.search import missing

        raise missing(error, "control") from None
    return library


def _after(rig: Rig, states: Mapping[str, float], inputs: Mapping[str, float]) -> dict[str, float]:
    """Channels one short sample later."""
    simulator = Simulator(rig, sample_time=_SAMPLE, initial=states)
    block = simulator._advance(1, {name: np.array([value]) for name, value in inputs.items()})
    return {name: float(values[0]) for name, values in block.items()}


def _closed(rig: Rig) -> dict[str, float]:
    """Every valve at its null."""
    return {dotted("valve_command", name): float(table["null_voltage"]) for name, table in rig.tables("valve").items()}


def _filled(rig: Rig, start: Mapping[str, float], chamber: str, pressure: float) -> dict[str, float]:
    """A state with a pressure in a chamber, and in the lines that rest with it."""
    filled = {**start, dotted("muscle_pressure", chamber): pressure}
    if len(rig.tables("chamber")) == 1:
        filled.update({dotted("line_pressure", name): pressure for name in rig.tables("line")})
    return filled


def _heard(a: Array, c: Array) -> list[int]:
    """Indices of the states that reach the output, at once or by way of another."""
    heard = set(np.flatnonzero(c).tolist())
    while True:
        more = {int(j) for i in heard for j in np.flatnonzero(a[i])} - heard
        if not more:
            return sorted(heard)
        heard |= more


Path = tuple[Any, ...]


def _floats(state: Any, path: Path = ()) -> Iterator[tuple[Path, float]]:
    """Every float in nested mappings and arrays, with the way to it."""
    if isinstance(state, Mapping):
        for key, value in state.items():
            yield from _floats(value, (*path, key))
    elif isinstance(state, np.ndarray):
        for index in np.ndindex(state.shape):
            yield (*path, index), float(state[index])
    elif isinstance(state, float):
        yield path, float(state)


def _at(state: Any, path: Path) -> float:
    for key in path:
        state = state[key]
    return float(state)


def _changed(state: Any, path: Path, change: float) -> Any:
    """A copy with one float changed."""
    if not path:
        return state + change
    if isinstance(state, np.ndarray):
        copied = state.copy()
        copied[path[0]] += change
        return copied
    return {key: _changed(value, path[1:], change) if key == path[0] else value for key, value in state.items()}
