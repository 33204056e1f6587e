"""The tracking experiments of chapter 5 on the shoulder rig: what is varied (controller, payload,
estimates, effects) is an argument.

All loops of one controller run in one batch. The rig's source is constant here
(:data:`SOURCE_VOLUME`): the dissertation names a "high pressure air source" (4.2.1) and no volume,
and the library's tank of 15 l runs empty after some 220 s of the compound trajectory.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from pamrs.control import (
    AdaptiveSliding,
    ArmModel,
    Cascade,
    Controller,
    Measurement,
    Neural,
    PressureLoop,
    Reference,
    Sliding,
    Value,
    cascaded_pid,
    sweep,
)
from pamrs.control.metrics import combined, total_curvature
from pamrs.control.trajectories import Trajectory, lift_hold_return
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from reproduction.gaylord import GaylordTorque
from reproduction.rigs import with_struts
from reproduction.waves import waves

Array = NDArray[np.float64]

POUND: Final = 0.45359237
#: Payloads of 5.4.3 [lb].
PAYLOADS: Final = (0.0, 25.0, 50.0)
#: The four controllers of 5.5, as they are called here.
KINDS: Final = ("cascaded PID", "sliding", "adaptive sliding", "neural")
#: Time between two samples of controllers and plants [s].
PERIOD: Final = 0.005
#: The trajectory begins at 95 deg, the arm at rest at 15: what is before counts as the approach
#: [s].
SETTLED: Final = 10.0
SOURCE_VOLUME: Final = 1000.0

#: Of the pressure loop that all four share [V/Pa, V/(Pa s), s], and of the rate's filter [s]: twice
#: as fast as the package's default, since with that the arm without a payload (0.634 kg m2)
#: oscillates under the switching gain that 50 lb need.
LOOP: Final[Mapping[str, Any]] = {"kp": 4e-4, "ki": 2e-4, "pressure_filter": 0.0025}
RATE_FILTER: Final = 0.0025

_SURFACE: Final = {"slope": 6.0, "switching": 2e5, "boundary_layer": 2.0}
#: One set of gains for every table and picture, :func:`tuned` shows how they were found. The
#: sliding family shares its surface.
GAINS: Final[Mapping[str, Mapping[str, Any]]] = {
    "cascaded PID": {"kp": 6e5, "ki": 2.4e6, "kd": 1e5},
    "sliding": _SURFACE,
    "adaptive sliding": {**_SURFACE, "gains": (0.3, 1.0, 300.0)},
    "neural": {**_SURFACE, "gains": (300.0, 2e4, 1e5)},
}
#: Largest J of usable gains at any payload.
MOST_J: Final = 5.0
#: What is tried of the gains that two of them have of their own.
GRIDS: Final[Mapping[str, Mapping[str, tuple[float, ...]]]] = {
    "cascaded PID": {"kp": (3e5, 6e5, 1.2e6), "ki": (1.2e6, 2.4e6, 4.8e6), "kd": (3e4, 6e4, 1e5)},
    "sliding": {"slope": (3.0, 4.5, 6.0), "switching": (1e5, 2e5, 4e5)},
}


def lift() -> Trajectory:
    """Lift, hold and return between 15 and 60 deg, 5 s each, 25 s in all (4.4.1, 5.5)."""
    return lift_hold_return(math.radians(15.0), math.radians(60.0))


@cache
def plant(payload: float, effect: str = "", parameters: tuple[tuple[str, float], ...] = ()) -> Rig:
    """The shoulder with a payload [lb], a source that stays as it is, and perhaps an effect of the
    catalogue.
    """
    rig = with_struts("shoulder").with_parameters(
        {"arm.payload": payload * POUND, "supply.volume": SOURCE_VOLUME}
    )
    return rig.with_effect(effect, dict(parameters)) if effect else rig


@cache
def _simplified() -> ArmModel:
    return ArmModel.from_rig(with_struts("shoulder"), torque="simplified")


def arm_model(payloads: Sequence[float], factor: Value = 1.0, *, guessed: bool = False) -> ArmModel:
    """What the controllers know, (5.1)-(5.4): the right I, b and m g r for the payload [lb] of each
    plant, times a factor; ``guessed``: with the torque of (5.25).
    """
    base, rig = _simplified(), with_struts("shoulder")
    if guessed:
        base = ArmModel.from_rig(rig, torque=GaylordTorque(rig))
    exact = [ArmModel.from_rig(plant(payload), torque=base.torque) for payload in payloads]
    known = base.replace(
        inertia=np.array([arm.inertia for arm in exact]),
        viscous=np.array([arm.viscous for arm in exact]),
        weight=np.array([arm.weight for arm in exact]),
    )
    return known.scaled(factor)


def controller(kind: str, arm: ArmModel, **changes: Any) -> Cascade:
    """A controller of :data:`KINDS` with the gains of :data:`GAINS`, and the pressure loop that all
    of them have.
    """
    if kind not in GAINS:
        raise ParameterError(
            f"kind = {kind!r} is not a controller of the chapter: {', '.join(KINDS)}"
        )
    own: dict[str, Any] = {**GAINS[kind], "period": PERIOD, "rate_filter": RATE_FILTER, **changes}
    inner = PressureLoop(period=PERIOD, **LOOP)
    if kind == "cascaded PID":
        return cascaded_pid(arm.pressure_limit, inner=inner, **own)
    if kind == "neural":
        # the networks start from one arm: only a start from the model needs its numbers, one set
        # for all
        return Cascade(Neural(_one(arm), **own), inner)
    return Cascade(
        {"sliding": Sliding, "adaptive sliding": AdaptiveSliding}[kind](arm, **own), inner
    )


def _one(arm: ArmModel) -> ArmModel:
    return arm.replace(
        **{name: float(np.max(getattr(arm, name))) for name in ("inertia", "viscous", "weight")}
    )


class _Watched(Controller):
    """A cascade that starts from what it has learnt (one row for each plant; empty: nothing), and
    notes its estimates now and then.
    """

    def __init__(self, cascade: Any, learnt: Mapping[str, Array], every: int) -> None:
        self.cascade, self.learnt, self.every, self.period = cascade, learnt, every, cascade.period
        self.outer: Any = getattr(cascade, "controller", cascade).outer
        self.times: list[float] = []
        self.notes: dict[str, list[Any]] = {}
        self.reset()

    def reset(self) -> None:
        """Begin, with what was learnt before."""
        self.cascade.reset()
        if self.learnt:
            fresh, plants = self.cascade.state, len(next(iter(self.learnt.values())))
            self.cascade.restore(
                {**fresh, "outer": {**fresh["outer"], "batch": plants, **self.learnt}}
            )
        self.times, self.notes, self._samples = [], {name: [] for name in self.names}, 0

    @property
    def state(self) -> dict[str, Any]:
        """The cascade's; the notes are no part of it."""
        return dict(self.cascade.state)

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from the cascade's state."""
        self.cascade.restore(state)

    @property
    def names(self) -> tuple[str, ...]:
        """What is learnt."""
        return tuple(self.outer._STATE) if isinstance(self.outer, (AdaptiveSliding, Neural)) else ()

    @property
    def known(self) -> dict[str, Array]:
        """What is known now; after a first sample with one row for each plant."""
        return {
            name: np.array(getattr(self.outer, f"_{name}"), dtype=np.float64) for name in self.names
        }

    def note(self, time: float) -> None:
        """Take note of what is known now."""
        self.times.append(time)
        for name, values in self.known.items():
            self.notes[name].append(values)

    def update(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """The cascade's answer."""
        if self.every and self._samples % self.every == 0:
            self.note(time)
        self._samples += 1
        answer: Value = self.cascade.update(time, measurement, reference)
        return answer


@dataclass(frozen=True)
class Track:
    """Loops of one controller, one row for each plant.

    Attributes
    ----------
    time : ndarray, shape (samples,)
        [s]
    wanted : ndarray, shape (samples,)
        Angle of the trajectory [rad].
    angle, rate : ndarray, shape (n, samples)
        Of the joint [rad, rad/s].
    failed : ndarray of bool, shape (n,)
        Which plants left the range of the model.
    learnt : mapping of str to ndarray, shape (n,) or (n, nodes)
        Estimates or weights at the end; empty of a controller that learns nothing.
    noted_at : ndarray, shape (notes,)
        When estimates were noted [s].
    noted : mapping of str to list of ndarray
        What they were.
    pressure : ndarray, shape (n, samples)
        In the muscles [Pa, gauge].
    """

    time: Array
    wanted: Array
    angle: Array
    rate: Array
    failed: NDArray[np.bool_]
    learnt: Mapping[str, Any] = field(repr=False)
    noted_at: Array = field(repr=False)
    noted: Mapping[str, list[Any]] = field(repr=False)
    pressure: Array = field(repr=False)

    SHAPE: ClassVar[str] = "(n, samples)"

    @property
    def error(self) -> Array:
        """Reference less angle [deg], shape (n, samples)."""
        return np.asarray(np.degrees(self.wanted - self.angle))

    def _part(self, begin: float, end: float) -> NDArray[np.bool_]:
        return (self.time >= begin - 1e-9) & (self.time <= end + 1e-9)

    def rms(self, begin: float = SETTLED, end: float = math.inf) -> Array:
        """Root mean square error [deg] between two times [s], shape (n,)."""
        return np.asarray(np.sqrt(np.mean(self.error[:, self._part(begin, end)] ** 2, axis=1)))

    def largest(self, begin: float = SETTLED, end: float = math.inf) -> Array:
        """Largest absolute error [deg], shape (n,)."""
        return np.asarray(np.abs(self.error[:, self._part(begin, end)]).max(axis=1))

    def mean(self, begin: float, end: float) -> Array:
        """Mean error [deg], shape (n,)."""
        part = self._part(begin, end)
        time, error = self.time[part], self.wanted[part] - self.angle[:, part]
        late = time >= time[-1] - (end - begin) * (1.0 + 1e-12)
        return np.asarray(np.degrees(error[:, late].mean(axis=-1)))

    def nu(self, begin: float = 0.0, end: float = math.inf) -> Array:
        """Integral of the squared error (4.15) [deg^2 s], shape (n,)."""
        part = self._part(begin, end)
        return np.asarray(np.trapezoid(self.error[:, part] ** 2, self.time[part], axis=1))

    def omega(self, begin: float = 0.0, end: float = math.inf) -> Array:
        """Absolute curvature (4.17) of the angle in radians over seconds, shape (n,)."""
        part = self._part(begin, end)
        return np.asarray(
            total_curvature(self.time[part], self.angle[:, part], rate=self.rate[:, part])
        )

    def ripple(self, begin: float = SETTLED, end: float = math.inf) -> Array:
        """Root mean square of the error above 1.5 Hz [deg]: the trajectory has nothing there but
        the corners of its triangle.
        """
        from scipy.signal import butter, sosfiltfilt

        sos = butter(4, 1.5, "highpass", fs=1.0 / (self.time[1] - self.time[0]), output="sos")
        return np.asarray(
            np.sqrt(
                np.mean(
                    sosfiltfilt(sos, self.error, axis=1)[:, self._part(begin, end)] ** 2, axis=1
                )
            )
        )

    def cumulative(self) -> Array:
        """Mean squared error up to each time [deg^2], as the chapter's figures have it, shape (n,
        samples).
        """
        step = self.time[1] - self.time[0]
        squares = self.error**2
        total = np.cumsum(0.5 * (squares[:, 1:] + squares[:, :-1]), axis=1) * step
        return np.asarray(np.concatenate([squares[:, :1], total / self.time[1:]], axis=1))


@dataclass(frozen=True)
class Tuning:
    """A grid of gains.

    Attributes
    ----------
    gains : list of dict of str to float
        What was tried.
    j, rms : ndarray, shape (payloads, gains)
        J (4.18), each payload a set of its own [1], and the error [deg].
    chosen : int
        The gains with the smallest J at the middle payload, of those with a J of at most
        :data:`MOST_J` at every payload.
    """

    gains: list[dict[str, float]]
    j: Array
    rms: Array
    chosen: int


def tuned(kind: str, payloads: Sequence[float] = PAYLOADS, duration: float = 30.0) -> Tuning:
    """The grid of :data:`GRIDS` on the compound trajectory, all payloads in one batch; the
    controllers know the payload.

    The best of all at 25 lb oscillate without a payload, and are left out by their J there.
    """
    grid = GRIDS[kind]
    tried = [dict(zip(grid, values, strict=True)) for values in itertools.product(*grid.values())]
    every = [payload for payload in payloads for _ in tried]
    columns: dict[str, Any] = {
        name: np.array([gains[name] for _ in payloads for gains in tried]) for name in grid
    }
    done = follow(
        kind, [plant(payload) for payload in every], arm_model(every), waves(duration), **columns
    )
    shape = (len(payloads), len(tried))
    j = combined(done.nu(SETTLED).reshape(shape), done.omega(SETTLED).reshape(shape), axis=1)
    usable = np.where(j.max(axis=0) <= MOST_J, j[len(payloads) // 2], np.inf)
    return Tuning(tried, j, done.rms().reshape(shape), int(np.argmin(usable)))


def follow(
    kind: str,
    plants: Sequence[Rig],
    arm: ArmModel,
    trajectory: Trajectory,
    *,
    learnt: Mapping[str, Any] | None = None,
    note_every: float = 0.0,
    wrap: Any = None,
    **changes: Any,
) -> Track:
    """Let a controller follow a trajectory with plants that begin at rest.

    Parameters
    ----------
    kind : str
        Of :data:`KINDS`.
    plants : sequence of Rig
    arm : ArmModel
        What the controller knows of each.
    trajectory : Trajectory
    learnt : mapping of str to ndarray, shape (n,) or (n, nodes), optional
        :attr:`Track.learnt` of a training with as many plants; empty: nothing.
    note_every : float
        Time between two notes of the estimates [s]; 0: none.
    wrap : callable, optional
        Makes another cascade of the controller, for example with a compensation.
    **changes
        Other gains than those of :data:`GAINS`.

    Returns
    -------
    Track

    Raises
    ------
    ParameterError
        If there is no such controller, or numbers do not fit together: what was learnt needs one
        row for each plant.
    """
    taught = {name: np.asarray(values, dtype=np.float64) for name, values in (learnt or {}).items()}
    for name, values in taught.items():
        if values.shape[:1] != (len(plants),):
            raise ParameterError(
                f"learnt[{name!r}] has the shape {values.shape}; one row for each of {len(plants)} "
                "plants is needed"
            )
    made = controller(kind, arm, **changes)
    watched = _Watched(made if wrap is None else wrap(made), taught, round(note_every / PERIOD))
    done = sweep(
        plants,
        watched,
        trajectory,
        sample_time=PERIOD,
        channels=("joint_angle", "joint_rate", "muscle_pressure"),
    )
    if note_every:
        watched.note(trajectory.duration)
    run = done.run
    wanted = np.asarray(trajectory(run.time).angle)
    return Track(
        run.time,
        wanted,
        run["joint_angle"],
        run["joint_rate"],
        done.failed,
        watched.known,
        np.array(watched.times),
        watched.notes,
        run["muscle_pressure"],
    )
