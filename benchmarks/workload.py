"""The shoulder's run, by the package and by its peers, called in the same way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

import pamrs

from . import peers

Array = NDArray[np.float64]
SAMPLES = 401  # 2 s
BATCH = 512
STEP = peers.SAMPLE_TIME / peers.STEPS
#: Channels that one run keeps: the states that the peers keep.
KEPT = ("muscle_pressure", "supply_pressure", "joint_angle", "joint_rate")
#: Payloads of the batches, lightest and heaviest [kg].
PAYLOADS = (0.0, 20.0)


class Shoulder:
    """The packaged shoulder with commands of so many samples."""

    def __init__(self, samples: int = SAMPLES) -> None:
        self.rig = peers.packaged()
        self.command = peers.wave(samples)
        self.given = (*peers.shoulder(self.rig), peers.opening(self.rig, self.command))
        self.payload = float(self.rig.model["arm"]["payload"])
        self.steps = (samples - 1) * peers.STEPS

    def ours(self, step: float = STEP) -> Array:
        """Joint angle of one run in steps no longer than one [s], by the package [rad].

        It keeps the four states that the peers keep.
        """
        run = pamrs.simulate(
            self.rig,
            self.command,
            sample_time=peers.SAMPLE_TIME,
            step=step,
            record=KEPT,
        )
        return run["joint_angle"]

    def in_long_steps(self) -> Array:
        """The same in the longest steps that the rig bears within a sample."""
        return self.ours(peers.SAMPLE_TIME)

    def peer(self, module: ModuleType, **settings: float) -> Array:
        """The same by a peer."""
        rows: Array = module.single(*self.given, self.payload, **settings)[:, 2]
        return rows

    def by_scipy(self) -> Callable[[], Array] | None:
        """The same by ``solve_ivp``, where it is installed."""
        module = peers.installed("shoulder_scipy")
        return None if isinstance(module, str) else partial(self.peer, module)

    def our_batch(self, payloads: Array, threads: int | None = None) -> Array:
        """Last angles of many runs, by the package [rad]."""
        run = pamrs.simulate_batch(
            self.rig,
            self.command,
            sample_time=peers.SAMPLE_TIME,
            step=STEP,
            parameters={"arm.payload": payloads},
            reduce={"end": ("final", "joint_angle")},
            threads=threads,
        )
        failed = [why for why in run.status if why is not None]
        if failed:
            raise RuntimeError(f"{len(failed)} runs failed, the first: {failed[0]}")
        ends: Array = run.reduced["end"]
        return ends


@dataclass(frozen=True)
class Batches:
    """Ways to run the same payloads, by name; those of missing peers are left out."""

    shoulder: Shoulder
    payloads: Array

    @classmethod
    def of(cls, size: int, samples: int = SAMPLES) -> Batches:
        """So many payloads over so many samples."""
        return cls(Shoulder(samples), np.linspace(*PAYLOADS, size))

    def ours(self, threads: int | None = None) -> Callable[[], Array]:
        """By the package."""
        return partial(self.shoulder.our_batch, self.payloads, threads)

    def numba(self, threads: int = 0) -> Callable[[], Array] | None:
        """By Numba's ``prange``; 0 threads are all."""
        return self._by("shoulder_numba", "batch", threads=threads)

    def jax(self) -> Callable[[], Array] | None:
        """By JAX, on one thread."""
        return self._by("shoulder_jax", "batch")

    def diffrax(self) -> Callable[[], Array] | None:
        """By diffrax, on one thread."""
        if isinstance(peers.installed("shoulder_jax"), str):
            return None
        try:
            import diffrax  # noqa: F401
        except ImportError:
            return None
        return self._by("shoulder_jax", "batch_diffrax")

    def _by(self, name: str, function: str, **settings: int) -> Callable[[], Array] | None:
        module = peers.installed(name)
        if isinstance(module, str):
            return None
        return partial(getattr(module, function), *self.shoulder.given, self.payloads, **settings)


def apart(one: Array, other: Array) -> float:
    """Largest difference of two angles [deg]; not a number counts as infinite."""
    difference = np.abs(np.degrees(np.asarray(one) - np.asarray(other)))
    return float(difference.max()) if np.isfinite(difference).all() else float("inf")
