"""A rig as a ``control.NonlinearIOSystem``: in discrete time, one step of it being one sample of
the simulator.

The core has no state derivative to give, and a derivative would lose what happens between steps
(hard stops, remembered hysteresis, the balances of mass and energy). So the system is discrete, its
state is the simulator's, its update is restore and step, and ``control.input_output_response``
gives what :func:`pamrs.simulate` gives, to the last bit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import check_names
from pamrs.control.linear import python_control
from pamrs.effects import ports_of
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.simulation import Simulator, core_rig

if TYPE_CHECKING:
    import control  # type: ignore[import-untyped]

__all__ = ["initial_state", "iosystem"]


def iosystem(
    rig: Rig,
    *,
    sample_time: float,
    step: float | None = None,
    outputs: Sequence[str] | None = None,
    name: str | None = None,
) -> control.NonlinearIOSystem:
    """A rig as a discrete-time input-output system of python-control.

    Parameters
    ----------
    rig : Rig
        With valves or regulators; their commands are the inputs, held over a sample.
    sample_time : float
        Of the system, ``dt`` [s].
    step : float, optional
        As for :func:`pamrs.simulate`.
    outputs : sequence of str, optional
        Channels in SI units, pressures gauge; all by default.
    name : str, optional
        Of the system; the rig's by default.

    Returns
    -------
    control.NonlinearIOSystem
        Inputs and outputs have the names of the channels, of a named block ``joint_angle_elbow``,
        as python-control allows no dot. Its states are ``x[0] ...``: the physical ones first
        (absolute pressures), then memories and balances; :func:`initial_state` makes them from
        initial values by name.

    Raises
    ------
    ParameterError
        If an argument is not allowed, the rig has no command, or it has an effect on the clock
        (``clock_skew``), whose state grows.
    MissingPackageError
        If python-control is not installed.
    """
    library = python_control()
    for effect in rig.effects:
        if "clock" in ports_of(effect):
            raise ParameterError(
                f"{effect['id']} is not allowed here: it keeps the samples before, a state that "
                "grows; delay the inputs instead"
            )
    compiled = core_rig(rig)
    simulator = Simulator(rig, sample_time=sample_time, step=step)
    inputs = list(compiled.inputs)
    if not inputs:
        raise ParameterError(f"rig {rig.name!r} has no command; a valve or a regulator is needed")
    channels = list(compiled.channels if outputs is None else outputs)
    check_names("outputs", channels, compiled.channels, "channel of the rig")

    def updated(_: float, state: Array, command: Array, __: Mapping[str, Any]) -> Array:
        simulator.restore(state)
        values = np.atleast_1d(np.asarray(command, dtype=np.float64))
        if not np.isfinite(values).all():
            raise ParameterError(f"the command {values} is not finite")
        simulator._advance(1, {name: values[k : k + 1].copy() for k, name in enumerate(inputs)})
        return simulator.state

    def observed(_: float, state: Array, __: Array, ___: Mapping[str, Any]) -> Array:
        simulator.restore(state)
        sample = simulator.observe()
        return np.array([sample[channel] for channel in channels])

    return library.NonlinearIOSystem(
        updated,
        observed,
        inputs=[channel.replace(".", "_") for channel in inputs],
        outputs=[channel.replace(".", "_") for channel in channels],
        states=[f"x[{k}]" for k in range(simulator.state.size)],
        dt=sample_time,
        name=name or rig.name,
    )


def initial_state(
    rig: Rig, *, sample_time: float, initial: Mapping[str, float] | None = None
) -> Array:
    """The state of :func:`iosystem` at initial values by name.

    Parameters
    ----------
    rig : Rig
    sample_time : float
        That of the system [s].
    initial : mapping of str to float, optional
        As for :func:`pamrs.simulate`.

    Returns
    -------
    ndarray, shape (states,)

    Raises
    ------
    ParameterError
        As :func:`pamrs.simulate`.
    """
    return Simulator(rig, sample_time=sample_time, initial=initial).state
