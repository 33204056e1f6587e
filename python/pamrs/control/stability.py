"""Stability of a sampled loop about an operating point: the loop as a system of python-control, and
its margins.

Everything here is the discrete loop itself, with the exact hold and the delay in it, not a
continuous approximation. It speaks of small motions about one point: see
:func:`pamrs.control.linear.linearise` for what that leaves out, dry friction above all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import one_of, positive
from pamrs.control._protocol import Controller
from pamrs.control.linear import LinearController, LinearModel, linear_controller, python_control
from pamrs.errors import ParameterError

if TYPE_CHECKING:
    import control  # type: ignore[import-untyped]

__all__ = ["Margins", "margins", "open_loop"]

#: Frequencies of a response, from a millionth of the Nyquist frequency to itself.
_POINTS: Final = 4000


@dataclass(frozen=True)
class Margins:
    """Margins of a loop that is opened at a command; printed, a sentence with units.

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
        """True where every eigenvalue of the closed loop is inside the unit circle."""
        return self.radius < 1.0

    def __str__(self) -> str:
        """Sentence with stability, margins and nearest boundary, with units."""
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


def open_loop(
    model: LinearModel,
    controller: Controller | LinearController,
    *,
    command: str | None = None,
    delay: float = 0.0,
) -> control.StateSpace:
    """A sampled loop that is opened at one command, the others staying closed, for python-control.

    ``control.feedback(loop)`` is the closed loop from one sample to the next. Take margins of its
    frequency response (:func:`margins`): transfer functions of such loops lose their digits.

    Parameters
    ----------
    model : LinearModel
    controller : Controller or LinearController
        A controller is made linear about the model's point. It reads channels that are outputs of
        the model; others stay as they are. It has a command for every input of the model.
    command : str, optional
        Where the loop is opened; needed of several commands.
    delay : float
        Between sampling and the command's effect [s]: computation, transport; any number from 0 on.

    Returns
    -------
    control.StateSpace
        Of the plant's states, the commands on their way and the controller's states; its sign is
        that of a loop with negative feedback.

    Raises
    ------
    ParameterError
        If an input of the model has no command or a command no input, the delay is negative, or
        there are several commands and none, or an unknown one, is named.
    MissingPackageError
        If python-control is not installed.
    """
    library = python_control()
    law = controller
    if not isinstance(law, LinearController):
        law = linear_controller(law, model.point)
    names = law.outputs
    at = names.index(one_of("command", names[0] if len(names) == 1 else command, names))
    phi, gamma, c = _delayed(model, law.period, delay)
    gamma = gamma @ _by_inputs(model, law)
    read = np.array([[float(name == out) for out in model.outputs] for name in law.inputs]) @ c
    n, k = len(phi), len(law.a)
    a = np.block([[phi, np.zeros((n, k))], [law.b @ read, law.a]])
    into = np.vstack([gamma, np.zeros((k, len(names)))])
    answer = np.hstack([law.d @ read, law.c])
    others = np.arange(len(names)) != at
    a += into[:, others] @ answer[others]
    return library.ss(a, into[:, [at]], -answer[[at]], 0.0, law.period)


def margins(
    model: LinearModel,
    controller: Controller | LinearController,
    *,
    command: str | None = None,
    delay: float = 0.0,
) -> Margins:
    """Gain and phase margin of a sampled loop, opened at a command, by python-control.

    What one command bears says nothing of changes in several at once; whether the whole is stable,
    and how fast it settles, is :attr:`Margins.radius`, the same for all.

    Parameters
    ----------
    model, controller, command, delay
        As for :func:`open_loop`.

    Returns
    -------
    Margins

    Raises
    ------
    ParameterError, MissingPackageError
        As :func:`open_loop`.
    """
    loop = open_loop(model, controller, command=command, delay=delay)
    library = python_control()
    radius = float(np.abs(library.feedback(loop).poles()).max())
    highest = math.pi / loop.dt
    response = library.frequency_response(loop, np.geomspace(1e-6, 1.0, _POINTS) * highest)
    gain, phase, _, at_gain, at_phase, _ = library.stability_margins(response)
    # the curve ends on the real axis, which no crossing shows
    last = float(response.complex[-1].real)
    if last < 0.0 and abs(math.log(-last)) < abs(math.log(gain)):
        gain, at_gain = -1.0 / last, highest
    if radius >= 1.0:
        return Margins(float(gain), None, float(at_gain), float(at_phase), None, radius)
    spare = math.radians(phase)
    later = spare / float(at_phase) if math.isfinite(spare) else math.inf
    return Margins(float(gain), spare, float(at_gain), float(at_phase), later, radius)


def _delayed(model: LinearModel, period: float, delay: float) -> tuple[Array, Array, Array]:
    """State, input and output matrix of the sampled plant, with commands under way as states."""
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
    """Matrix with a 1 where a command of the controller (column) is an input of the model (row)."""
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
