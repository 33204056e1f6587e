"""Runs the recordings of a case with any effects, and measures what a refit leaves of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .design import Spec
from .drive import Driver, course
from .effects import Effect, Effects
from .excitation import Excitation
from .families import most
from .pair.places import Placed
from .plant import Parameters, Plant
from .recording import CHANNELS, Array, Noise, Record, follow, run
from .rig_kinds import RIGS, nominal, parameters_of
from .rigfile import split
from .strength import FIRST, MEDIUM

#: part of a tolerance for the differences of the refit, and time between two of its rows [s]
_STEP, _EVERY = 0.1, 0.05
#: how near to its wanted size an effect must come, in how many runs
NEAR, TRIES = 0.15, 7
Measured = dict[int, tuple[Record, Array]]


def put(model: dict[str, Any], values: dict[str, float]) -> dict[str, Any]:
    """Copy of a nested model with other values, by dotted name."""
    changed = {k: dict(v) if isinstance(v, dict) else v for k, v in model.items()}
    for name, value in values.items():
        section, key = split(name)
        changed[section][key] = value
    return changed


class Bench:
    """The recordings of one case on a rig with one valve or none.

    Parameters
    ----------
    spec : Spec
        The case.
    true : dict
        The true nested model.
    tolerance : dict
        Standard deviations by dotted name.
    noise : Noise
        Transducers.
    """

    channels: tuple[str, ...] = CHANNELS

    def __init__(
        self, spec: Spec, true: dict[str, Any], tolerance: dict[str, float], noise: Noise
    ) -> None:
        self.spec, self.true, self.tolerance, self.noise = spec, true, tolerance, noise
        self.rig, self.step = RIGS[spec.rig], spec.lab.sample_time
        self.par: Any = self.numbers(true)
        roles = [role for _, role in spec.recordings]
        self.fit = [i for i, role in enumerate(roles) if role == "fit"]
        self.held = [i for i, role in enumerate(roles) if role != "fit"] or self.fit
        self.floor = self.floors()
        self.drives: list[tuple[Any, Any, Array | None]] = []
        self.supply: list[float] = []
        sigma = tolerance.get("supply.initial_pressure", 0.0)
        for i, (name, _) in enumerate(spec.recordings):
            own = np.random.default_rng([spec.seed, i, 77])
            off = float(own.uniform(-1.0, 1.0)) * sigma
            self.supply.append(self.begins(i) + off)
            self.drives.append(self.drive(name, own))
        self._columns: dict[str, dict[int, Array]] = {}

    def begins(self, index: int) -> float:
        """Pressure of the tank, or of a volume that empties, with which a recording begins [gauge
        Pa].
        """
        start = float(self.par.supply_pressure)
        return start * (1.0 - 0.12 * index) if self.spec.rig == "blow_down" else start

    def numbers(self, model: dict[str, Any]) -> Any:
        """Numbers of the plant of a model."""
        return parameters_of(model, self.rig)

    def numbers_at(self, effect: Effect | Placed) -> tuple[Parameters, ...]:
        """Numbers of each part of the plant in which an effect acts."""
        return (self.par,)

    def floors(self) -> Array:
        """Noise of every channel."""
        return self.noise.floor()

    def drive(
        self, name: str, rng: np.random.Generator, seconds: float | None = None
    ) -> tuple[Any, Any, Array | None]:
        """Course, controller and, of an open loop, the commands of a recording, as long as those of
        the case or of `seconds`.
        """
        duration = self.spec.duration if seconds is None else seconds
        if self.spec.rig == "blow_down":
            return still(np.full(round(duration / self.step), -1.0))
        period = self.step * self.spec.lab.held
        return *self.steered(name, duration, period, rng), None

    def steered(
        self, name: str, duration: float, period: float, rng: np.random.Generator
    ) -> tuple[Any, Any]:
        """Course of a recording and its controller, which acts every `period` [s]."""
        shape = course(self.rig, name, duration, self.step, rng)
        return shape, Driver(nominal(self.spec.rig)[2], self.rig, period, rng)

    def run(self, effects: Sequence[Any], model: dict[str, Any] | None = None) -> dict[int, Record]:
        """Every recording of the plant with effects; of another model than the true one."""
        plant = self.plant(self.par if model is None else self.numbers(model), effects)
        found: dict[int, Record] = {}
        for i in range(len(self.drives)):
            found[i] = self.recorded(plant, i)
            if not np.isfinite(found[i].clean).all():
                raise ArithmeticError("the run left the numbers")
        return found

    def plant(self, numbers: Any, effects: Sequence[Any] = ()) -> Any:
        """The plant of some numbers with effects."""
        return Plant(numbers, Effects(*effects))

    def recorded(self, plant: Any, index: int) -> Record:
        """One recording of a plant."""
        rng = np.random.default_rng([self.spec.seed, index, 78])
        return self.record(plant, self.drives[index], self.supply[index], index, rng)

    def record(
        self,
        plant: Any,
        drive: tuple[Any, Any, Array | None],
        supply: float,
        index: int,
        rng: np.random.Generator,
    ) -> Record:
        """A recording of a plant that is driven as :meth:`drive` gives, with a pressure of the tank
        at its beginning [gauge Pa] and a number among the recordings of the case.
        """
        start = None
        if self.spec.rig == "blow_down":
            start = plant.initial(supply + plant.par.ambient, 2.0e5, 0.0, 0.0, 1000.0 * index)
        return run(
            plant, *drive, supply, self.noise, rng, index, self.step, self.spec.lab.held, start
        )

    def against(self, records: dict[int, Record], model: dict[str, Any]) -> Measured:
        """How far records lie from the plant of a model without effects, in every channel."""
        bare = self.plant(self.numbers(model))
        return {i: (r, r.clean - self.followed(bare, r, i)) for i, r in records.items()}

    def followed(
        self, plant: Any, record: Record, index: int, name: str = "", step: float = 0.0
    ) -> Array:
        """Readings of a plant without effects that follows a record; `name` is a parameter of it
        that is off by a step.
        """
        # a zero of a transducer also moves the state that a window seems to start from
        key = split(name)[1]
        sign = {"pressure_zero": (-step, 0.0), "angle_zero": (0.0, -step)}
        shift = sign.get(key, (0.0, step if key == "length_zero" else 0.0))
        return follow(plant, record, index, shift, sample_time=self.step)

    def prepare(self) -> None:
        """Sensitivities to every parameter, on the recordings of the plant without effects."""
        plain = self.run(())
        every, base = self.every, self.plant(self.par)
        start = {i: self.followed(base, r, i)[::every] for i, r in plain.items()}
        for name, sigma in self.tolerance.items():
            section, key = split(name)
            if key == "initial_pressure":
                continue
            step = _STEP * sigma
            moved = put(self.true, {name: self.true[section][key] + step})
            plant = self.plant(self.numbers(moved))
            self._columns[name] = {
                i: (self.followed(plant, r, i, name, step)[::every] - start[i]) / _STEP
                for i, r in plain.items()
            }

    @property
    def every(self) -> int:
        """Samples between two rows of the refit."""
        return max(1, round(_EVERY / self.step))

    def left(self, measured: Measured, without: Sequence[str] = ()) -> dict[str, float]:
        """What of deviations is left, by channel, in units of the noise, on the recordings that are
        held out, when the recordings to fit are refitted with the tolerances as priors.

        Of one recording alone, on itself. Parameters in `without` stay. Every window of 2 s counts
        as one observation per channel, since the deviations in it are coloured.
        """
        if not self._columns:
            self.prepare()
        names = [n for n in self._columns if n not in without]
        every = self.every
        weight = math.sqrt(every * self.step / 2.0) / self.floor
        shown = self.shown
        thin = {i: moved[::every] for i, (_, moved) in measured.items()}
        rows = np.concatenate([(weight * thin[i])[:, shown].ravel() for i in self.fit])
        matrix = np.column_stack(
            [
                np.concatenate([(weight * self._columns[n][i])[:, shown].ravel() for i in self.fit])
                for n in names
            ]
        )
        size = len(names)
        z = np.linalg.lstsq(
            np.vstack([matrix, np.eye(size)]), np.concatenate([rows, np.zeros(size)]), rcond=None
        )[0]
        worst = np.zeros(len(self.channels))
        for i in self.held:
            rest = thin[i] - sum(v * self._columns[n][i] for v, n in zip(z, names, strict=True))
            worst = np.maximum(worst, np.sqrt((rest**2).mean(axis=0)) / self.floor)
        return {self.channels[i]: float(worst[i]) for i in shown}

    @property
    def shown(self) -> list[int]:
        """Numbers of the channels that the log has."""
        found = [0]
        if self.rig.name != "blow_down" and self.spec.lab.missing != "supply_pressure":
            found.append(1)
        return [*found, 2] if "muscle" in self.rig.blocks else found

    def scale(self, effect: Effect | Placed, target: float) -> tuple[float, float]:
        """Factor on an effect, and what a refit then leaves of it alone [noises].

        The size nearest to the target of those that the plant survives, within what is physical.
        """
        bound = most(effect)

        def reached(factor: float) -> float:
            try:
                records = self.run([effect.scaled(factor)])
                return max(self.left(self.against(records, self.true)).values())
            except (ArithmeticError, ValueError, OverflowError):
                return math.inf

        start = 2.0 * FIRST.get(effect.id, 1.0) * target / MEDIUM
        return search(reached, target, bound, start)


def search(
    reached: Callable[[float], float], target: float, bound: float, start: float
) -> tuple[float, float]:
    """Factor whose reach is nearest to a target in ratio, and that reach; infinite ones are passed.

    Raises
    ------
    ArithmeticError
        No factor has a finite reach.
    """
    low: tuple[float, float] | None = None
    high: tuple[float, float] | None = None
    best: tuple[float, float] | None = None
    factor = min(start, bound)
    for _ in range(TRIES):
        found = max(reached(factor), 1.0e-9)
        x, y = math.log(factor), min(math.log(found / target), 3.0)
        if math.isfinite(found):
            if best is None or abs(y) < abs(math.log(best[1] / target)):
                best = (factor, found)
            if abs(found / target - 1.0) <= NEAR or (found < target and factor >= bound):
                break
        if y < 0.0:
            low = (x, y)
        else:
            high = (x, y)
        if low and high:
            share = -low[1] / (high[1] - low[1])
            x = low[0] + min(max(share, 0.15), 0.85) * (high[0] - low[0])
        else:
            x -= min(max(y, -3.0), 3.0)
        factor = min(math.exp(x), bound)
    if best is None:
        raise ArithmeticError("no size of the effect can be run")
    return best


class _Nobody:
    """Where nothing is controlled."""

    null = 0.0

    def reset(self) -> None:
        """Nothing to forget."""

    def __call__(self, *_: Any) -> float:
        return 0.0


def still(commands: Array) -> tuple[Any, Any, Array]:
    """Course, controller and commands where these are played, and nothing is controlled."""
    zero = np.zeros(len(commands))
    none = zero.astype(bool)
    return Excitation(zero, none, zero, none), _Nobody(), commands
