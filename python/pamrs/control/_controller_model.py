"""Linear models of sampled controllers about an operating point, by differences of one update over
its state and its measurements.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import one_of
from pamrs.channels import channel_of
from pamrs.control._protocol import Controller, Reference, commands_of
from pamrs.errors import ParameterError

#: Half width of the differences in what is measured [SI].
_WIDTHS: Final[dict[str, float]] = {
    "joint_angle": 1e-5,
    "joint_rate": 1e-5,
    "muscle_pressure": 10.0,
    "supply_pressure": 10.0,
    "length": 1e-6,
    "length_rate": 1e-6,
}
#: What controllers of one valve get.
_OF_ONE: Final = ("joint_angle", "joint_rate", "muscle_pressure")
#: By how much of the slope the slopes of both sides may differ.
_KINK: Final = 0.01
SIDES: Final = ("", "up", "down", "mean")


@dataclass(frozen=True)
class LinearController:
    """``x+ = A x + B y, u = C x + D y`` from one sample to the next, about an operating point; y
    are :attr:`inputs`.

    Attributes
    ----------
    a, b, c, d : ndarray
        Shapes (n, n), (n, p), (m, n), (m, p).
    inputs : tuple of str
        Channels that the controller reads.
    period : float
        [s]
    command : float or dict of str to float
        What it answers at the operating point; of a controller of every input each by its name.
    outputs : tuple of str
        Names of its m commands; one without a name is that of the only input of a plant.
    """

    a: Array = field(repr=False)
    b: Array = field(repr=False)
    c: Array = field(repr=False)
    d: Array = field(repr=False)
    inputs: tuple[str, ...]
    period: float
    command: Any = 0.0
    outputs: tuple[str, ...] = ("",)


def linear_controller(
    controller: Controller,
    point: Mapping[str, float],
    angle: Any = None,
    *,
    state: Mapping[str, Any] | None = None,
    side: str = "",
) -> LinearController:
    """Any controller with a state of floats about an operating point, by differences of one update.

    Exact for a controller that is linear inside its limits (PID, cascade). What does not reach the
    command (a clock), or is never moved by a measurement (an integral without a gain), is left out.
    A law with a corner at the point (a dead band's edge, a limit, a switching line) has two slopes
    there and no linear model: it is refused unless a side is chosen.

    Parameters
    ----------
    controller : Controller
        For one plant; it is reset before and after.
    point : mapping of str to float
        Channels at the operating point; the reference rests at its ``joint_angle``, of a
        :class:`pamrs.control.RigController` at those of its joints.
    angle : float or array_like, shape (joints,), optional
        Another reference [rad].
    state : mapping, optional
        The controller's state at the operating point, for one whose integrals have to hold the arm
        up (a cascade, whose outer integral is the pressure): ``controller.state`` after a closed
        loop that has come to rest there. By default that of a controller which has seen the point
        three times.
    side : {"", "up", "down", "mean"}
        Of what is measured or remembered, where the slopes towards larger and smaller values differ
        by more than one percent: which of them, or the mean of both. By default such a controller
        is refused.

    Returns
    -------
    LinearController
        From ``joint_angle``, ``joint_rate`` and ``muscle_pressure``, those of them that are in
        ``point``; of a controller of every input from every channel that moves a command.

    Raises
    ------
    ParameterError
        If the side is unknown, the controller answers what is not a finite number, or other
        commands than at the point, has a corner there, or no measurement reaches its command: it
        is at a limit.
    """
    one_of("side", side, SIDES)
    whole_rig = controller.answers == "inputs"
    inputs = tuple(
        name
        for name in (point if whole_rig else _OF_ONE)
        if name in point and channel_of(name) in _WIDTHS
    )
    reference = _resting(controller, point, angle)
    update = _Update(
        controller, dict(point), reference, _settled(controller, point, reference, state)
    )
    slopes, middle = _slopes(update, inputs, side)
    controller.reset()
    n = len(update.paths)
    commands = middle[n:]
    whole = np.array([slope for slope, _ in slopes]).T
    _refuse_deaf(update, whole, commands)
    # states that reach a command and are moved by a measurement: an integral with a gain of zero is
    # heard, but nothing moves it; it would count as a motion that never dies out
    moved = heard(whole[:n, :n].T, np.abs(whole[:n, n:]).sum(axis=1))
    reach = np.abs(whole[n:, :n]).sum(axis=0)
    kept = sorted(set(heard(whole[:n, :n], reach)) & set(moved))
    if side == "":
        _refuse_corners(update, inputs, [step for _, step in slopes], kept)
    read = _read(whole, n, kept) if whole_rig else list(range(len(inputs)))
    columns = [n + k for k in read]
    a, b = whole[np.ix_(kept, kept)], whole[np.ix_(kept, columns)]
    c, d = whole[n:][:, kept], whole[n:][:, columns]
    answer: Any = float(commands[0])
    if whole_rig:
        answer = dict(zip(update.names, commands.tolist(), strict=True))
    named = tuple(inputs[k] for k in read)
    return LinearController(a, b, c, d, named, controller.period, answer, update.names)


def _refuse_deaf(update: _Update, whole: Array, commands: Array) -> None:
    """Refuse slopes or commands that are not finite, and commands that no measurement moves."""
    n = len(update.paths)
    if not (np.isfinite(whole).all() and np.isfinite(commands).all()):
        raise ParameterError(
            "the controller's command is not finite at the operating point: no linear model is "
            "there"
        )
    if not whole[n:].any() or not whole[:, n:].any():
        answered = ", ".join(
            f"{name} = {value:g}" if name else f"{value:g}"
            for name, value in zip(update.names, commands, strict=True)
        )
        raise ParameterError(
            f"the controller answers {answered} whatever it measures: it is at a limit; give the "
            "state in which it holds the arm here"
        )


def _read(whole: Array, n: int, kept: list[int]) -> list[int]:
    """Inputs that move a command, or one of the states that are kept."""
    rows = [*kept, *range(n, whole.shape[0])]
    return [k for k in range(whole.shape[1] - n) if whole[rows, n + k].any()]


def _resting(controller: Controller, point: Mapping[str, float], angle: Any) -> Reference:
    """Reference at rest, at the joint angles of an operating point or at given ones."""
    tracked: tuple[str, ...] = getattr(controller, "tracked", ("joint_angle",))
    if angle is None:
        missing = [name for name in tracked if name not in point]
        if missing:
            raise ParameterError(
                f"point has no {', '.join(missing)}: the reference cannot rest there; give angle"
            )
        angle = [point[name] for name in tracked]
    values = np.atleast_1d(np.asarray(angle, dtype=np.float64))
    return Reference(float(values[0])) if values.size == 1 else Reference(values)


def _settled(
    controller: Controller,
    point: Mapping[str, float],
    reference: Reference,
    state: Mapping[str, Any] | None,
) -> Mapping[str, Any]:
    """State of the controller at the operating point: given, or that after three updates."""
    controller.reset()
    if state is None:
        for k in range(3):  # filters and differences have seen something
            controller.update(k * controller.period, point, reference)
    else:
        controller.restore(state)
    return controller.state


class _Update:
    """One update of a controller as a function of its state and of what is measured.

    Parameters
    ----------
    controller : Controller
    point : dict of str to float
        Channels at the operating point.
    reference : Reference
    start : mapping
        The controller's state there.
    """

    def __init__(
        self,
        controller: Controller,
        point: dict[str, float],
        reference: Reference,
        start: Mapping[str, Any],
    ) -> None:
        self.controller, self.point, self.reference = controller, point, reference
        self.start = start
        floats = list(_floats(start))
        self.paths = [path for path, _ in floats if path[-1] != "time"]
        clocks = [value for path, value in floats if path[-1] == "time"]  # of the parts too
        self.now = max(clocks, default=2.0 * controller.period) + controller.period
        self.names: tuple[str, ...] = ("",)
        if controller.answers == "inputs":
            controller.restore(start)
            answer: Any = controller.update(self.now, self.point, reference)
            self.names = tuple(name for name, _ in commands_of(answer))

    def __call__(self, state: Mapping[str, Any], sample: Mapping[str, float]) -> Array:
        """Every float of the state after the update, and behind them the commands."""
        self.controller.restore(state)
        answer: Any = self.controller.update(self.now, sample, self.reference)
        after = self.controller.state
        return np.array(
            [*(_at(after, path) for path in self.paths), *map(float, self._commands(answer))]
        )

    def _commands(self, answer: Any) -> list[Any]:
        """Commands of an answer in the order of the names, whatever its own is."""
        if self.names == ("",):
            return [answer]
        given = dict(commands_of(answer))
        if set(given) != set(self.names):
            raise ParameterError(
                f"the controller answered {', '.join(given) or 'nothing'}: "
                f"{', '.join(self.names)} are needed, as at the operating point"
            )
        return [given[name] for name in self.names]


def _slopes(
    update: _Update, inputs: tuple[str, ...], side: str
) -> tuple[list[tuple[Array, Array]], Array]:
    """Slopes of states and commands over every state and input, and their values at the point."""
    start, point = update.start, update.point
    middle = update(start, point)
    slopes = []
    for path in update.paths:
        width = 1e-4 * max(1.0, abs(_at(start, path)))
        up, down = (update(_changed(start, path, s * width), point) for s in (1.0, -1.0))
        slopes.append(_slope(up, middle, down, width, side))
    for name in inputs:
        width = _WIDTHS[channel_of(name)]
        up, down = (update(start, {**point, name: point[name] + s * width}) for s in (1.0, -1.0))
        slopes.append(_slope(up, middle, down, width, side))
    return slopes, middle


def _refuse_corners(
    update: _Update, inputs: tuple[str, ...], steps: list[Array], kept: list[int]
) -> None:
    """Refuse a slope that differs between its sides, of the kept states or the commands."""
    n = len(update.paths)
    names = [".".join(map(str, path)) for path in update.paths]
    places = [*kept, *range(n, n + len(update.names))]
    for name, step in zip([*names, *inputs], steps, strict=True):
        if step[places].any():
            k = places[int(np.argmax(step[places]))]
            what = f"its command {update.names[k - n]}".rstrip() if k >= n else names[k]
            raise ParameterError(
                f"the controller has a corner at the operating point: the slopes of {what} over "
                f"{name} differ by {step[k]:.3g} between its sides; choose a side (up, down, "
                "mean), or another point"
            )


def _slope(up: Array, middle: Array, down: Array, width: float, side: str) -> tuple[Array, Array]:
    """Central slope, and the difference of the slopes on both sides; zero where negligible."""
    above, below = (up - middle) / width, (middle - down) / width
    # the last digits of what is differenced are no corner
    slack = (
        _KINK * np.maximum(np.abs(above), np.abs(below))
        + 1e-11 * np.maximum(1.0, np.abs(middle)) / width
    )
    apart = np.abs(above - below)
    return {"up": above, "down": below}.get(side, 0.5 * (above + below)), np.where(
        apart > slack, apart, 0.0
    )


def heard(a: Array, c: Array) -> list[int]:
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
    return {
        key: _changed(value, path[1:], change) if key == path[0] else value
        for key, value in state.items()
    }
