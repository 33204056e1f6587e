"""The blocks of a rig between measured channels, and the residual of each with exact sensitivities."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pamrs import _core
from pamrs.diagnosis.signals import Prepared
from pamrs.rig import Rig
from pamrs.simulation import default_step

__all__ = ["Block", "Residual", "available_blocks", "change", "residual"]

Array = NDArray[np.float64]

STEP = 2.5e-3
"""Longest RK4 step of the cut chain [s]."""
CHAMBER_STEP = 5e-3
"""Same for the gas blocks, between measured angles and pressures; the core divides it until it is stable."""


@dataclass(frozen=True)
class Block:
    """A stretch of the chain with a measured output.

    Attributes
    ----------
    name, channel : str
        Name of the block and of the channel that it predicts.
    drives : tuple of str
        Measured channels that drive it.
    window : float or None
        Length of its windows [s]; None: the whole recording at once.
    parameters : frozenset of str
        Dotted names of baseline parameters that its output depends on.
    step : float
        Longest integration step [s].
    covers : str
        Blocks of the rig that it stands for, in words.
    """

    name: str
    channel: str
    drives: tuple[str, ...]
    window: float | None
    parameters: frozenset[str]
    step: float
    covers: str


_SENSORS = frozenset({"sensors.pressure_zero", "sensors.angle_zero"})
_CHAMBER = frozenset({"chamber.dead_volume", "chamber.alpha_in", "chamber.alpha_out", "chamber.alpha"})
_VALVE = frozenset({"valve.discharge_area_max", "valve.null_voltage"})
_ARM = frozenset({"arm.inertia", "arm.first_moment", "arm.payload", "arm.viscous", "arm.coulomb", "muscle.modulus_scale"})


def available_blocks(rig: Rig, channels: tuple[str, ...]) -> list[Block]:
    """The blocks that these channels can tell apart, in the order of the chain."""
    model = rig.model
    blocks = []
    motion = ("joint_angle",) if model["arm"] is not None else ()
    has = set(channels)
    fed = model["valve"] is not None
    if fed and {"supply_pressure", "muscle_pressure", "valve_command", *motion} <= has:
        blocks.append(
            Block(
                "supply",
                "supply_pressure",
                ("muscle_pressure", "valve_command"),
                4.0,
                _VALVE | {"supply.volume", "sensors.pressure_zero"},
                CHAMBER_STEP,
                "supply and valve",
            )
        )
    drives = (("supply_pressure", "valve_command") if fed else ()) + motion
    if "muscle_pressure" in has and set(drives) <= has:
        names = _CHAMBER | _SENSORS | (_VALVE if fed else frozenset())
        blocks.append(
            Block(
                "chamber", "muscle_pressure", drives, 2.0 if fed else None, names, CHAMBER_STEP if fed else 0.025,
                "valve, line and chamber" if fed else "chamber",
            )
        )  # fmt: skip
    if motion and {"muscle_pressure", "joint_angle"} <= has:
        blocks.append(
            Block(
                "arm", "joint_angle", ("muscle_pressure",), 2.5, _ARM | _SENSORS, STEP, "muscle, joint and arm",
            )
        )  # fmt: skip
    return blocks


@dataclass(frozen=True, eq=False)
class Residual:
    """Measured minus predicted output of one block over one recording, with the window's start projected out.

    Attributes
    ----------
    value : (n,) array
        Residual in the channel's unit; 0 in unusable rows.
    jacobian : (n, k) array or None
        Derivative of the *prediction* with respect to each parameter, start projected out as well.
    prediction : (n,) array
        Predicted channel, for looking at.
    rows : (n,) bool array
        Usable rows.
    noise : float
        Noise of the channel.
    starts : list of (a, b, q)
        Windows with an orthonormal basis of what their start can do; what a residual without a jacobian is freed of.
    """

    value: Array
    jacobian: Array | None
    prediction: Array
    rows: NDArray[np.bool_]
    noise: float
    starts: list[tuple[int, int, Array]] = field(default_factory=list)


def change(block: Block, core: _core.Rig, prepared: Prepared, base: Residual) -> Array:
    """Residual under another model, freed of the same starts as one that was computed with its sensitivities.

    Parameters
    ----------
    block : Block
        Which block.
    core : _core.Rig
        The other model, compiled.
    prepared : Prepared
        The recording.
    base : Residual
        The residual of a model near to it.

    Returns
    -------
    (n,) array
        In the channel's unit; 0 in unusable rows.
    """
    prediction, _ = core.predict(
        block.name,
        _commands(core, prepared),
        prepared.dt,
        default_step(prepared.dt, longest=block.step),
        prepared.starts(block.window, block.drives),
        [],
        prepared.signals,
        prepared.n,
    )
    measured = np.where(prepared.recording.mask[block.channel], prepared.recording.channels[block.channel], 0.0)
    value = np.where(base.rows, measured - prediction, 0.0)
    for a, b, q in base.starts:
        value[a:b] -= q @ (q.T @ value[a:b])
    return np.where(base.rows, value, 0.0)


def _commands(core: _core.Rig, prepared: Prepared) -> dict[str, Array]:
    """The commands that a model takes."""
    return {"valve_command": prepared.command} if core.inputs else {}


def residual(block: Block, core: _core.Rig, prepared: Prepared, parameters: list[str]) -> Residual:
    """Predict a block's output over a recording and compare.

    Parameters
    ----------
    block : Block
        Which block.
    core : _core.Rig
        The compiled model.
    prepared : Prepared
        The recording.
    parameters : list of str
        Dotted names for the jacobian, may be empty.
    """
    starts = prepared.starts(block.window, block.drives)
    # without parameters a free null direction is still wanted for the window's start: ask for one parameter
    names = parameters or ["sensors.pressure_zero"]
    prediction, jacobian = core.predict(
        block.name,
        _commands(core, prepared),
        prepared.dt,
        default_step(prepared.dt, longest=block.step),
        starts,
        names,
        prepared.signals,
        prepared.n,
    )
    if jacobian is None:
        raise AssertionError("the core returns a jacobian when parameters are named")
    measured = np.where(prepared.recording.mask[block.channel], prepared.recording.channels[block.channel], 0.0)
    rows = prepared.usable(block.channel, block.drives, starts)
    value = np.where(rows, measured - prediction, 0.0)
    shifted = prediction.copy()
    k = len(names)
    bases: list[tuple[int, int, Array]] = []
    for a, b in zip(starts, [*starts[1:], prepared.n], strict=True):
        used = rows[a:b]
        start = jacobian[a:b, k:]
        if used.sum() < 4 * start.shape[1]:
            rows[a:b] = False
            value[a:b] = 0.0
            continue
        q, _ = np.linalg.qr(np.where(used[:, None], start, 0.0))
        bases.append((a, b, q))
        correction = q @ (q.T @ value[a:b])
        value[a:b] -= correction
        shifted[a:b] += correction
        jacobian[a:b, :k] -= q @ (q.T @ np.where(used[:, None], jacobian[a:b, :k], 0.0))
    jac = np.where(rows[:, None], jacobian[:, :k], 0.0) if parameters else None
    # a whole recording is shown from its measured start; a window from the start that suits it best
    shown = prediction if block.window is None else shifted
    return Residual(value, jac, shown, rows, prepared.noise[block.channel], bases)
