"""Stability of a sampled loop about an operating point: margins, closed-loop spectrum, and the
gains that are stable over payload.

Everything here is the discrete loop itself, with the exact hold and the delay in it, not a
continuous approximation. It speaks of small motions about one point: see
:func:`pamrs.control.linear.linearise` for what that leaves out, dry friction above all.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pamrs._checks import as_column, one_of, positive, refused
from pamrs.control._protocol import Controller
from pamrs.control.linear import (
    SIDES,
    LinearController,
    LinearModel,
    linear_controller,
    linearise,
    python_control,
)
from pamrs.errors import ParameterError
from pamrs.rig import Rig

__all__ = [
    "Margins",
    "StableRegion",
    "loop_matrix",
    "margins",
    "margins_of_each",
    "spectral_radius",
    "stable_region",
]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Margins:
    """Margins of a loop that is opened at the command; printed, a sentence with units.

    Attributes
    ----------
    gain : float
        The factor nearest to one by which all gains may change until the loop is at its boundary:
        above one how far they may grow, below one how far an unstable loop has to be taken back;
        infinite if there is none.
    phase : float or None
        [rad]; infinite without a crossing of gain one. None if the closed loop is unstable:
        whatever its curve crosses, it has no phase to lose.
    gain_frequency, phase_frequency : float
        Where they are found [rad/s]: phase -180 deg, and gain one.
    delay : float or None
        How much more delay the loop bears [s]; None if it is unstable without any.
    radius : float
        Largest absolute eigenvalue of the closed loop from sample to sample; stable below one.
    """

    gain: float
    phase: float | None
    gain_frequency: float
    phase_frequency: float
    delay: float | None
    radius: float

    @property
    def stable(self) -> bool:
        """Whether the closed loop is."""
        return self.radius < 1.0

    def __str__(self) -> str:
        """What the margins say, with units."""
        factor = "no gain"
        if math.isfinite(self.gain):
            factor = f"all gains times {self.gain:.3g} (at {self.gain_frequency:.3g} rad/s)"
        eigenvalue = f"largest eigenvalue {self.radius:.6g} per sample"
        if self.phase is None or self.delay is None:
            return (
                f"unstable ({eigenvalue}): no margin of phase or delay; nearest boundary: {factor}"
            )
        phase = "any"
        if math.isfinite(self.phase):
            phase = f"{math.degrees(self.phase):.3g} deg (at {self.phase_frequency:.3g} rad/s)"
        delay = f"{self.delay:.3g} s" if math.isfinite(self.delay) else "any"
        return (
            f"stable ({eigenvalue}): phase to spare {phase}, delay to spare {delay}; nearest "
            f"boundary: {factor}"
        )


@dataclass(frozen=True)
class StableRegion:
    """Closed-loop spectral radius over payload and gains.

    Attributes
    ----------
    payloads : ndarray, shape (p,)
        [kg]
    axes : mapping of str to ndarray
        Gains, in the order of the other dimensions.
    radius : ndarray, shape (p, ...)
        Per sample; the larger one of filling and venting, so that stable means stable with both.
    period : float
        [s]
    friction : str
        As dry friction was taken: at "rest", or "moving".
    """

    payloads: Array
    axes: Mapping[str, Array]
    radius: Array = field(repr=False)
    period: float = 0.0
    friction: str = "rest"

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Where every small motion dies out."""
        return np.asarray(self.radius < 1.0)

    @property
    def growth(self) -> Array:
        """Rate at which the slowest small motion grows [1/s]; negative where it dies out."""
        return np.asarray(np.log(np.maximum(self.radius, 1e-300)) / self.period, dtype=np.float64)


def loop_matrix(model: LinearModel, controller: LinearController, *, delay: float = 0.0) -> Array:
    """The closed loop from one sample of the controller to the next.

    Parameters
    ----------
    model : LinearModel
    controller : LinearController
        Reads channels that are outputs of the model; others stay as they are. It has a command for
        every input of the model.
    delay : float
        Between sampling and the command's effect [s]: computation, transport; any number from 0 on.

    Returns
    -------
    ndarray, shape (n, n)
        Of the plant's states, the commands on their way, and the controller's states.

    Raises
    ------
    ParameterError
        If an input of the model has no command or a command no input, or the delay is negative.
    """
    phi, gamma, c = _delayed(model, controller.period, delay)
    gamma = gamma @ _by_inputs(model, controller)
    b_c, d_c = _by_outputs(model, controller)
    n, k = phi.shape[0], controller.a.shape[0]
    out = np.zeros((n + k, n + k))
    out[:n, :n] = phi + gamma @ d_c @ c
    out[:n, n:] = gamma @ controller.c
    out[n:, :n] = b_c @ c
    out[n:, n:] = controller.a
    return out


def spectral_radius(
    model: LinearModel, controller: LinearController, *, delay: float = 0.0
) -> float:
    """Largest absolute eigenvalue of :func:`loop_matrix`.

    Parameters
    ----------
    model, controller, delay
        As there.

    Returns
    -------
    float

    Raises
    ------
    ParameterError
        As :func:`loop_matrix`.
    """
    return float(np.abs(np.linalg.eigvals(loop_matrix(model, controller, delay=delay))).max())


def margins(
    model: LinearModel,
    controller: Controller | LinearController,
    *,
    command: str | None = None,
    delay: float = 0.0,
    points: int = 4000,
) -> Margins:
    """Gain and phase margin of a sampled loop, opened at a command, by python-control.

    Parameters
    ----------
    model : LinearModel
    controller : Controller or LinearController
        A controller is made linear about the model's point.
    command : str, optional
        Of several commands that at which the loop is opened, the others staying closed: its margins
        are those of one valve, all others doing what they do. See :func:`margins_of_each`.
    delay : float
        As for :func:`loop_matrix` [s].
    points : int
        Frequencies between a millionth of the Nyquist frequency and itself, evenly on a logarithmic
        axis.

    Returns
    -------
    Margins

    Raises
    ------
    ParameterError
        As :func:`loop_matrix`; if there are several commands and none, or an unknown one, is named.
    MissingPackageError
        If python-control is not installed.
    """
    library = python_control()
    linear = _linear(model, controller)
    radius = spectral_radius(model, linear, delay=delay)
    opened_at = _command(linear, command)
    period = linear.period
    frequencies = np.geomspace(1e-6, 1.0, points) * math.pi / period
    response = _response(model, linear, opened_at, delay, frequencies)
    opened = library.frd(response, frequencies, smooth=True)
    gain, phase, _, at_gain, at_phase, _ = library.stability_margins(opened)
    last = float(response[-1].real)
    # the curve ends there on the real axis, which no crossing shows
    nyquist = 1.0 / abs(last) if last < 0.0 else math.inf
    if abs(math.log(nyquist)) < (
        math.inf if gain is None or math.isinf(gain) else abs(math.log(gain))
    ):
        gain, at_gain = nyquist, math.pi / period
    gain, phase = (float(value) if value is not None else math.inf for value in (gain, phase))
    spare = math.radians(phase) / float(at_phase) if math.isfinite(phase) and at_phase else math.inf
    left = (math.radians(phase), spare) if radius < 1.0 else (None, None)
    return Margins(gain, left[0], _number(at_gain), _number(at_phase), left[1], radius)


def margins_of_each(
    model: LinearModel,
    controller: Controller | LinearController,
    *,
    delay: float = 0.0,
    points: int = 4000,
) -> dict[str, Margins]:
    """Margins loop by loop: opened at one command after the other, all others staying closed.

    What every loop bears by itself says nothing of changes in several at once; whether the whole is
    stable, and how fast it settles, is :attr:`Margins.radius`, the same for all.

    Parameters
    ----------
    model, controller, delay, points
        As for :func:`margins`.

    Returns
    -------
    dict of str to Margins
        By the name of the command.

    Raises
    ------
    ParameterError, MissingPackageError
        As :func:`margins`.
    """
    linear = _linear(model, controller)
    return {
        name or model.inputs[0]: margins(model, linear, command=name, delay=delay, points=points)
        for name in linear.outputs
    }


def _linear(model: LinearModel, controller: Controller | LinearController) -> LinearController:
    if isinstance(controller, LinearController):
        return controller
    return linear_controller(controller, model.point)


def _command(controller: LinearController, command: str | None) -> int:
    """Number of the command at which a loop is opened."""
    if command is None and len(controller.outputs) == 1:
        return 0
    chosen: str = one_of("command", command, controller.outputs, also=" (or margins_of_each)")
    return controller.outputs.index(chosen)


def _response(
    model: LinearModel, controller: LinearController, at: int, delay: float, frequencies: Array
) -> NDArray[np.complex128]:
    """Frequency response of a loop that is opened at a command, the others staying closed:
    ``-(T_kk + T_ko (1 - T_oo)^-1 T_ok)`` of ``T = K P``.
    """
    phi, gamma, c = _delayed(model, controller.period, delay)
    gamma = gamma @ _by_inputs(model, controller)
    b_c, d_c = _by_outputs(model, controller)
    z = np.exp(1j * frequencies * controller.period)[:, None, None]
    plant = c @ np.linalg.solve(z * np.eye(phi.shape[0]) - phi, gamma.astype(np.complex128)[None])
    feedback = np.broadcast_to(d_c.astype(np.complex128), (z.shape[0], *d_c.shape))
    if controller.a.size:
        state = z * np.eye(controller.a.shape[0]) - controller.a
        feedback = feedback + controller.c @ np.linalg.solve(state, b_c.astype(np.complex128)[None])
    turned = feedback @ plant
    others = [k for k in range(gamma.shape[1]) if k != at]
    found = turned[:, at, at]
    if others:
        rest = np.eye(len(others)) - turned[:, others][:, :, others]
        into = turned[:, others, at][:, :, None]
        found = found + (turned[:, at, others][:, None] @ np.linalg.solve(rest, into))[:, 0, 0]
    return np.asarray(-found, dtype=np.complex128)


def stable_region(
    rig: Rig,
    controller: Callable[..., Controller],
    axes: Mapping[str, Sequence[float]],
    *,
    payloads: Sequence[float],
    angle: float | None = None,
    delay: float = 0.0,
    sides: Sequence[str] = ("fill", "vent"),
    friction: str = "rest",
    payload: str = "arm.payload",
    hold: Callable[[Rig], Mapping[str, float]] | None = None,
) -> StableRegion:
    """Which gains are stable for small motions, payload by payload.

    A valve has another slope when it fills than when it vents: gains count as stable if they are
    with both.

    Coulomb friction is strong damping for a motion slower than its transition speed, and none for a
    faster one: the shoulder at 45 deg under ``PID(kp, period=0.005)`` is stable up to kp = 8.0
    V/rad with its 1.5 N m counted as at rest, and up to 0.47 V/rad as in motion. With gains that
    are stable by the first only, small motions die out and large ones need not: at kp = 7 the arm
    comes to rest after a push of 0.1 rad, and after one of 0.3 rad swings over 1.8 rad for good.

    Parameters
    ----------
    rig : Rig
        With a payload.
    controller : callable
        Makes a controller from one gain each by name: ``lambda kp, ki: PID(kp, ki)``.
    axes : mapping of str to sequence of float
        Values of each gain.
    payloads : sequence of float
        [kg]
    angle : float, optional
        At which the arm is held [rad]; not where ``hold`` says how.
    delay : float
        As for :func:`loop_matrix` [s].
    sides : sequence of str
        As for :func:`pamrs.control.linear.linearise`.
    friction : {"rest", "moving"}
        As there: the region for motions below, or beyond, the speed at which Coulomb friction has
        turned round.
    payload : str
        Parameter of the rig that is the payload: ``link.hand.payload``, ``load.mass``.
    hold : callable, optional
        From the rig with a payload to initial values at which it rests, for rigs with several
        joints or chambers: :meth:`pamrs.control.RigController.holding` of a model of it.

    Returns
    -------
    StableRegion

    Raises
    ------
    ParameterError
        As :func:`pamrs.control.linear.linearise`, or if an axis is empty.
    """
    grid = {name: as_column(name, values) for name, values in axes.items()}
    masses = as_column("payloads", payloads)
    if not sides or any(side not in SIDES for side in sides):
        raise refused("sides", tuple(sides), f"some of {', '.join(SIDES)}")
    radius = np.zeros((masses.size, *(values.size for values in grid.values())))
    period = 0.0
    for p, mass in enumerate(masses):
        loaded = rig.with_parameters({payload: float(mass)})
        start = None if hold is None else hold(loaded)
        models = [
            linearise(loaded, angle, side=side, friction=friction, initial=start) for side in sides
        ]
        for index in itertools.product(*(range(values.size) for values in grid.values())):
            made = controller(
                **{
                    name: float(values[i])
                    for (name, values), i in zip(grid.items(), index, strict=True)
                }
            )
            linear = linear_controller(made, models[0].point)
            radius[(p, *index)] = max(
                spectral_radius(model, linear, delay=delay) for model in models
            )
            period = linear.period
    return StableRegion(masses, grid, radius, period, friction)


def _delayed(model: LinearModel, period: float, delay: float) -> tuple[Array, Array, Array]:
    """The sampled plant with the commands on their way as states: state, input and output
    matrix.
    """
    positive("delay", delay, zero=True)
    phi, gamma = model.sampled(period)
    count = math.ceil(delay / period - 1e-9)
    if count == 0:
        return phi, gamma, model.c
    # over one period the command before last acts first, the last one from then on
    late = delay - (count - 1) * period
    last = (
        model.sampled(period - late)[1] if period - late > 1e-12 * period else np.zeros_like(gamma)
    )
    before = gamma - last
    n, m = gamma.shape
    out, into = np.zeros((n + count * m, n + count * m)), np.zeros((n + count * m, m))
    out[:n, :n] = phi
    out[:n, n + (count - 1) * m :] = before  # the oldest on its way
    if count == 1:
        into[:n] = last
    else:
        out[:n, n + (count - 2) * m : n + (count - 1) * m] = last
    out[n + m :, n : n + (count - 1) * m] = np.eye((count - 1) * m)
    into[n : n + m] = np.eye(m)
    return out, into, np.hstack([model.c, np.zeros((model.c.shape[0], count * m))])


def _by_inputs(model: LinearModel, controller: LinearController) -> Array:
    """Which command of a controller is which input of a model."""
    if controller.outputs == ("",) and len(model.inputs) == 1:
        return np.eye(1)
    if set(controller.outputs) != set(model.inputs):
        commands = ", ".join(name or "one without a name" for name in controller.outputs)
        raise ParameterError(
            f"the model has the inputs {', '.join(model.inputs)}, the controller the commands "
            f"{commands}: one of each is needed"
        )
    return np.array(
        [[float(name == command) for command in controller.outputs] for name in model.inputs]
    )


def _by_outputs(model: LinearModel, controller: LinearController) -> tuple[Array, Array]:
    """The controller's input matrices by the outputs of the model."""
    pick = np.zeros((len(controller.inputs), len(model.outputs)))
    for row, name in enumerate(controller.inputs):
        if name in model.outputs:
            pick[row, model.outputs.index(name)] = 1.0
    return controller.b @ pick, controller.d @ pick


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
