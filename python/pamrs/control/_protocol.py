"""Protocol of controllers: sampled, with a state of their own, for one plant or a batch of them.

A controller is made once, with its gains and its period, and is then called at each of its
samples::

    controller.reset()
    command = controller.update(time, measurement, reference)

``measurement`` maps channels to values in SI units (``joint_angle`` [rad], ``muscle_pressure`` [Pa,
gauge], ...), as :meth:`pamrs.Simulator.observe` and a live device give them. Every value, gain and
reference is a float, or an array of shape ``(n,)`` for a batch of n plants at once: the same code
does both, and the answer has the shape of what went in.
"""

from __future__ import annotations

import abc
import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pamrs._checks import check_kind, refused
from pamrs.channels import dotted
from pamrs.errors import ParameterError

#: A float, or one number for each plant of a batch.
Value: TypeAlias = "float | NDArray[np.float64]"
#: Channel -> value.
Measurement: TypeAlias = "Mapping[str, Value]"


class Reference(NamedTuple):
    """Desired motion of a joint at one time or at many."""

    angle: Value
    """[rad]"""
    rate: Value = 0.0
    """[rad/s]"""
    acceleration: Value = 0.0
    """[rad/s^2]"""


class Controller(abc.ABC):
    """A sampled controller.

    Attributes
    ----------
    period : float
        Time between two updates [s].
    answers : {"valve", "pressure", "inputs"}
        What :meth:`update` gives: a valve command [V]; a desired gauge pressure [Pa] that a
        :class:`pamrs.control.Cascade` or a :class:`pamrs.control.RigController` makes; or every
        input of a rig, as keywords of :meth:`pamrs.Simulator.step`.
    """

    period: float
    answers: str = "valve"

    @abc.abstractmethod
    def reset(self) -> None:
        """Forget what was seen: begin at rest, at time zero, for whatever batch comes next."""

    @abc.abstractmethod
    def update(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """Answer a sample.

        Parameters
        ----------
        time : float
            Time of the sample [s].
        measurement : mapping of str to float or ndarray, shape (n,)
            Channels in SI units.
        reference : Reference
            Where the joint should be now.

        Returns
        -------
        float or ndarray, shape (n,)
            What is held until the next sample: a valve command [V], or a desired gauge pressure
            [Pa] where a pressure loop follows.

        Raises
        ------
        ParameterError
            If a channel that the controller needs is missing or not finite; the message names it.
        """

    @property
    @abc.abstractmethod
    def state(self) -> dict[str, Any]:
        """The numbers that everything to come depends on (copies); give them back to
        :meth:`restore`.
        """

    @abc.abstractmethod
    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a state, bit for bit.

        Parameters
        ----------
        state : mapping
            :attr:`state` of a controller of the same kind.

        Raises
        ------
        ParameterError
            If it is not one; the message says what is missing or too much.
        """


def check_controller(controller: Any) -> None:
    """Refuse what no loop can call.

    Parameters
    ----------
    controller : Controller
        What was given.

    Raises
    ------
    ParameterError
        If it is no controller, or its period is not above zero.
    """
    check_kind("controller", controller, Controller, "a pamrs.control.Controller")
    period = getattr(controller, "period", math.nan)
    if not (isinstance(period, (int, float, np.number)) and math.isfinite(period) and period > 0.0):
        raise refused("controller.period", period, "a number of seconds above zero is needed")


def check_drives_valve(controller: Controller) -> None:
    """Refuse a controller whose pascals would be taken for volts.

    Parameters
    ----------
    controller : Controller
        What drives a valve.

    Raises
    ------
    ParameterError
        If it answers a pressure.
    """
    if controller.answers == "inputs":
        raise ParameterError(
            f"controller is a {type(controller).__name__}, which answers every input of a rig: one "
            "that answers a valve command [V] is needed here"
        )
    if controller.answers != "valve":
        raise ParameterError(
            f"controller is a {type(controller).__name__}, which answers a {controller.answers} "
            "[Pa], no valve command: put it in a pamrs.control.Cascade"
        )


def check_answers_pressure(outer: Controller) -> None:
    """Refuse an outer controller whose volts would be taken for pascals.

    Parameters
    ----------
    outer : Controller
        What a pressure loop follows.

    Raises
    ------
    ParameterError
        If it answers a valve command.
    """
    if outer.answers != "pressure":
        raise ParameterError(
            f"outer is a {type(outer).__name__} with answers = {outer.answers!r}, which is not "
            "allowed: 'pressure' is needed, a desired gauge pressure [Pa] (an angle PID is in "
            "cascaded_pid; a controller of your own says answers = 'pressure')"
        )


def commands_of(answer: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Commands by name, ``valve_command.flexor``, of an answer that has every input of a rig.

    Parameters
    ----------
    answer : mapping
        Keywords of :meth:`pamrs.Simulator.step`, or names already.

    Yields
    ------
    tuple of (str, value)
    """
    for word, value in answer.items():
        if isinstance(value, Mapping):
            for name, one in value.items():
                yield dotted(word, name), one
        else:
            yield word, value


def keywords_of(commands: Mapping[str, Any]) -> dict[str, Any]:
    """Keywords of :meth:`pamrs.Simulator.step` of commands by name: :func:`commands_of` backwards.

    Parameters
    ----------
    commands : mapping
        ``valve_command.flexor`` -> value.

    Returns
    -------
    dict
    """
    found: dict[str, Any] = {}
    for name, value in commands.items():
        word, _, block = name.partition(".")
        if block:
            found.setdefault(word, {})[block] = value
        else:
            found[word] = value
    return found
