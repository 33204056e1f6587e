"""Does the diagnosis name what a plant of chapter 4 has and the controllers' model has not?
Closed-loop records, put to the rig.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from pamrs.control import AirModel, ArmModel, Feedforward, Fuzzy, Parallel, closed_loop
from pamrs.control.trajectories import Trajectory, cosine_cycles, degrees
from pamrs.recordings import Case, Recording
from pamrs.rig import Rig
from reproduction.lift import (
    GAINS,
    HIGH,
    LOW,
    PAYLOADS,
    PERIOD,
    VARIANTS,
    assumed,
    plant,
    trajectory,
)
from reproduction.waves import waves

if TYPE_CHECKING:
    from pamrs.diagnosis import Diagnosis


#: Standard deviation of each sensor, SI; the command is known.
NOISE: Final = {
    "valve_command": 0.0,
    "supply_pressure": 400.0,
    "muscle_pressure": 400.0,
    "joint_angle": 3e-4,
}


def recorded(
    truth: Rig, model: Rig, path: Trajectory, role: str, seed: int, duration: float
) -> Recording:
    """A record of feedforward with fuzzy feedback (kM 0.5), sampled as the controller is.

    Parameters
    ----------
    truth, model : Rig
        The plant, and what the controller assumes.
    path : Trajectory
        What it follows.
    role : {"fit", "held_out"}
        What the record is for.
    seed : int
        Of the noise.
    duration : float
        [s]

    Returns
    -------
    Recording
    """
    km, g1, g2, h = GAINS["FF+fuzzy, kM 0.5"]
    feedforward = Feedforward(ArmModel.from_rig(model), AirModel(model), km, period=PERIOD)
    controller = Parallel(feedforward, Fuzzy(g1, g2, h, period=PERIOD))
    run = closed_loop(truth, controller, path, duration, sample_time=PERIOD, step=1e-3)
    rng, n = np.random.default_rng(seed), run.time.size
    channels = {
        name: run.channels[name] + rng.normal(0.0, 1.0, n) * level
        for name, level in NOISE.items()
        if name in run.channels
    }
    channels["valve_command"] = run.command
    mask = {name: np.ones(n, dtype=bool) for name in channels}
    name, units = f"{path.name}_{seed}", dict.fromkeys(channels, "SI")
    return Recording(name, role, run.time, PERIOD, channels, mask, [], units)


def diagnosed(name: str, *, payload: float = PAYLOADS[1], duration: float = 25.0) -> Diagnosis:
    """The diagnosis of a plant of :data:`reproduction.lift.VARIANTS` by the rig that the
    controllers know.

    The plant has what the variant adds and nothing else: its muscle force, friction and inertia are
    the rig's.

    Parameters
    ----------
    name : str
        Of the plant.
    payload : float
        [kg]
    duration : float
        Of each of three records, two to fit and one held out [s].

    Returns
    -------
    Diagnosis
    """
    from pamrs.diagnosis import diagnose

    truth = plant(VARIANTS[name], payload, seed=None)
    model = assumed(VARIANTS[name]).with_parameters({"arm.payload": payload})
    paths = (
        ("fit", trajectory()),
        ("fit", cosine_cycles(*degrees(LOW, HIGH), rise=3.0, hold=2.0)),
        ("held_out", waves()),
    )
    records = [
        recorded(truth, model, path, role, seed, duration)
        for seed, (role, path) in enumerate(paths)
    ]
    return diagnose(Case("chapter4", model, records, Path()))
