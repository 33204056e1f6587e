"""Lift, hold and return of the elbow under the controllers of chapter 4: every experiment, with
what is varied as an argument.

The controllers know the rig, its valve and the payload; the plant differs from it in muscle force,
friction and inertia as in 4.4.2, and in whatever a :class:`Variant` adds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pamrs.control import (
    PID,
    Actuation,
    AirModel,
    ArmModel,
    Feedforward,
    FullTorque,
    Fuzzy,
    Metrics,
    Parallel,
    Trajectory,
    sweep,
)
from pamrs.control.metrics import combined, evaluate
from pamrs.control.trajectories import degrees, lift_hold_return
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.rigs import named
from reproduction.elbow import HYSTERESIS, POUND, with_muscle
from reproduction.rigs import with_struts
from reproduction.two_branches import two_branches

Array = NDArray[np.float64]
#: Gains of a controller, each one number or one for each payload.
Gains = tuple[float | tuple[float, ...], ...]

#: [kg], 25, 50, 75 and 100 lb.
PAYLOADS: Final = tuple(pounds * POUND for pounds in (25.0, 50.0, 75.0, 100.0))
#: Angles of rest and hold [deg]; the figures that have them are not digitised.
LOW, HIGH = 15.0, 80.0
#: Between two commands [s].
PERIOD: Final = 0.005
#: RK4 step and time between two recorded rows [s].
_STEP, _ROW = 1e-3, 0.01
#: Largest deviation of force, friction and inertia of the plant from the model.
SPREAD: Final = 0.05
#: Seed of the plant that is a little different: force -4.2 %, friction +3.6 %, inertia +4.9 %.
_SEED: Final = 1

#: Name -> kM, then kP and kI, or g1, g2 and h, in radians and volts; kM = 0: no feedforward.
GAINS: Final[Mapping[str, tuple[float, ...]]] = {
    "PID": (0.0, 1.4, 2.5),
    "FF": (0.5, 0.0, 0.0),
    "FF+PID": (1.0, 5.0, 2.0),
    "FF+PID, kM 0.5": (0.5, 5.0, 2.0),
    "FF+PID, PID's gains": (0.5, 1.4, 2.5),
    "fuzzy": (0.0, 0.45, 0.6, 0.65),
    "FF+fuzzy": (1.0, 0.4, 0.3, 0.7),
    "FF+fuzzy, kM 0.5": (0.5, 0.4, 0.3, 0.7),
    "series, kM 0": (0.0, 0.45, 0.3, 0.7),
    "series, kM 0.25": (0.25, 0.45, 0.3, 0.7),
    "series, kM 0.5": (0.5, 0.45, 0.3, 0.7),
    "series, kM 1": (1.0, 0.45, 0.3, 0.7),
}


@dataclass(frozen=True)
class Variant:
    """A plant that is not the rig.

    Attributes
    ----------
    printed : bool
        Whether plant and controllers have the muscle of (4.4)-(4.7), else the library's smooth one.
    motion : {"commanded", "measured"}
        Of the feedforward's flow, see :class:`pamrs.control.Feedforward`.
    both_ways : bool
        Whether the feedforward takes (4.4) down too, where 4.3.2.1 has (4.7).
    hysteresis : bool
        Whether the plant's muscles have the friction (2.36), which no controller knows.
    known : mapping of str to float
        Parameters that the controller's model has too, SI: ``valve.discharge_area_max``.
    hidden : mapping of str to float
        Parameters that it has not.
    effects : mapping of str to mapping of str to float
        Effects of the catalogue that it has not.
    regulated : bool
        Whether a regulator with the lag and droop of the rig ``regulated_joint`` feeds it; the
        model has a supply that holds.
    """

    printed: bool = True
    motion: str = "commanded"
    both_ways: bool = False
    hysteresis: bool = False
    known: Mapping[str, float] = field(default_factory=dict)
    hidden: Mapping[str, float] = field(default_factory=dict)
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    regulated: bool = False


def _valve(square_millimetres: float) -> dict[str, float]:
    return {"valve.discharge_area_max": 1e-6 * square_millimetres}


def _damping(coefficient: float) -> dict[str, dict[str, float]]:
    return {"muscle_rate_damping": {"damping_constant": coefficient, "damping_pressure": 0.0}}


def _activation(pressure: float) -> dict[str, dict[str, float]]:
    return {"activation_pressure": {"threshold": pressure}}


_STRONG: Final = {**_damping(12000.0), **_activation(5e4)}
#: The plant that the chapter prints; other readings of it; one change of it at a time; and the
#: library's smooth muscle, with what would have to be added.
VARIANTS: Final[Mapping[str, Variant]] = {
    "as printed": Variant(),
    "as printed, measured motion": Variant(motion="measured"),
    "as printed, (4.4) both ways in the feedforward": Variant(both_ways=True),
    "smooth muscle, hysteresis (2.36)": Variant(printed=False, hysteresis=True),
    "smooth muscle, hysteresis (2.36), measured motion": Variant(
        printed=False, hysteresis=True, motion="measured"
    ),
    "as printed, and hysteresis (2.36)": Variant(hysteresis=True),
    "smooth muscle": Variant(printed=False),
    "smooth muscle, measured motion": Variant(printed=False, motion="measured"),
    "smooth muscle, damping 6000 N s/m": Variant(printed=False, effects=_damping(6000.0)),
    "smooth muscle, damping 12000 N s/m, activation 50 kPa": Variant(
        printed=False, effects=_STRONG
    ),
    "smooth muscle, damping 12000 N s/m, activation 50 kPa, measured motion": Variant(
        printed=False, motion="measured", effects=_STRONG
    ),
    "valve 4.2 mm2": Variant(known=_valve(4.2)),
    "valve 2.44 mm2": Variant(known=_valve(2.44)),
    "supply 1.03 MPa": Variant(known={"supply.initial_pressure": 1.03e6}),
    "supply 0.45 MPa": Variant(known={"supply.initial_pressure": 0.45e6}),
    "regulated supply, dead band 50 kPa": Variant(
        effects={"supply_regulator_deadband": {"dead_band": 5e4}}, regulated=True
    ),
    "input lag 50 ms": Variant(effects={"input_path_lag": {"time_constant": 0.05}}),
    "pressure lag 50 ms": Variant(effects={"pressure_lag": {"time_constant": 0.05}}),
    "tube 2e-9 m3/(s Pa)": Variant(effects={"tube_flow_restriction": {"conductance": 2e-9}}),
    "valve dead zone 3 %": Variant(effects={"valve_dead_zone": {"half_width": 0.03}}),
    "joint friction 15 N m": Variant(hidden={"arm.coulomb": 15.0}),
    "stiction 10 N m more": Variant(effects={"joint_coulomb_stribeck": {"stiction": 10.0}}),
    "activation pressure 50 kPa": Variant(effects=_activation(5e4)),
    "heat transfer": Variant(effects={"heat_transfer": {}}),
    "muscle damping 3000 N s/m": Variant(effects=_damping(3000.0)),
    "muscle damping 12000 N s/m": Variant(effects=_damping(12000.0)),
}


def trajectory() -> Trajectory:
    """The reference: rest, lift, hold, return and rest of 5 s each, 25 s together."""
    return lift_hold_return(*degrees(LOW, HIGH), delay=5.0)


def assumed(variant: Variant = VARIANTS["as printed"]) -> Rig:
    """The rig as the controllers know it."""
    rig = with_struts("elbow")
    if variant.printed:
        rig = with_muscle(rig, two_branches())
    return rig.with_parameters(variant.known)


def plant(
    variant: Variant = VARIANTS["as printed"],
    payload: float = PAYLOADS[1],
    seed: int | None = _SEED,
) -> Rig:
    """What is controlled.

    Parameters
    ----------
    variant : Variant
        What it has that the rig has not.
    payload : float
        [kg]
    seed : int, optional
        Of the deviations in force, friction and inertia; None for none.

    Returns
    -------
    Rig
    """
    known = assumed(variant).with_parameters({"arm.payload": payload})
    rig = perturbed(known, seed).with_parameters(variant.hidden)
    if variant.hysteresis:
        rig = with_muscle(rig, None, **HYSTERESIS)
    if variant.regulated:
        model = rig.model
        fed = {
            **named("regulated_joint").model["supply"],
            "initial_pressure": model["supply"]["initial_pressure"],
        }
        rig = Rig(rig.name, {**model, "supply": fed})
    for name, values in variant.effects.items():
        rig = rig.with_effect(name, values)
    return rig


def perturbed(rig: Rig, seed: int | None) -> Rig:
    """A plant that the controller's model is not quite: muscle force, friction and arm inertia off
    by 2.5 to 5 %, each up or down.

    The force goes with the muscle's cross-section, and its volume with it; the bladder's elastic
    force, a smaller part, keeps its modulus. The payload is known.

    Parameters
    ----------
    rig : Rig
        The controller's model.
    seed : int, optional
        Of the deviations; None for none.

    Returns
    -------
    Rig
    """
    if seed is None:
        return rig
    rng = np.random.default_rng(seed)
    factors = 1.0 + SPREAD * rng.choice([-1.0, 1.0], 3) * rng.uniform(0.5, 1.0, 3)
    force, friction, inertia = factors.tolist()
    names = {"muscle.rest_diameter": math.sqrt(force), "arm.inertia": inertia}
    names |= {"arm.viscous": friction, "arm.coulomb": friction}
    return rig.with_parameters(
        {name: factor * rig.parameter(name).value for name, factor in names.items()}
    )


@dataclass(frozen=True, eq=False)
class Lifts:
    """One controller and one plant, under every payload.

    Attributes
    ----------
    time : ndarray, shape (rows,)
        [s]
    reference : ndarray, shape (rows,)
        [rad]
    angle, rate, pressure : ndarray, shape (payloads, rows)
        [rad, rad/s, Pa]
    metrics : Metrics
        Arrays of shape (payloads,), angles in radians.
    """

    time: Array
    reference: Array
    angle: Array = field(repr=False)
    rate: Array = field(repr=False)
    pressure: Array = field(repr=False)
    metrics: Metrics = field(repr=False)

    def between(self, begin: float, end: float, values: Array | None = None) -> Array:
        """Rows of the angle [deg], or of other values as they are, from one time to another [s]."""
        rows = (self.time >= begin - 1e-9) & (self.time <= end + 1e-9)
        return np.asarray(np.degrees(self.angle[:, rows]) if values is None else values[..., rows])

    @property
    def overshoot(self) -> Array:
        """Above the angle of the hold [deg], zero for none."""
        return np.asarray(
            np.maximum(self.between(0.0, 25.0).max(axis=1) - HIGH, 0.0), dtype=np.float64
        )

    @property
    def undershoot(self) -> Array:
        """Below the angle of rest after the return [deg], zero for none."""
        return np.asarray(
            np.maximum(LOW - self.between(15.0, 25.0).min(axis=1), 0.0), dtype=np.float64
        )

    @property
    def swing(self) -> Array:
        """Peak to peak in the last 2 s of the hold [deg]."""
        return np.asarray(np.ptp(self.between(13.0, 15.0), axis=1))

    @property
    def restless(self) -> NDArray[np.bool_]:
        """Whether it does not come to rest in the hold, in a limit cycle or too slow to settle: it
        moves by more than a figure shows (2 deg), and no less than half as much as 2 s before.
        """
        before = np.ptp(self.between(11.0, 13.0), axis=1)
        return np.asarray((self.swing > 2.0) & (self.swing > 0.5 * before))

    @property
    def delay(self) -> Array:
        """From the begin of the lift until the arm has turned by 1 deg [s]."""
        since = self.between(5.0, 25.0)
        moved = np.abs(since - since[:, :1]) > 1.0
        return np.asarray(
            np.where(moved.any(axis=1), np.argmax(moved, axis=1) * _ROW, np.nan), dtype=np.float64
        )

    def error(self, phase: str, kind: str = "rms") -> Array:
        """Error of a phase ``lift``, ``hold``, ``return`` or ``rest`` [deg]."""
        return np.asarray(np.degrees(self.metrics.phases[phase][kind]), dtype=np.float64)


def lengthening(variant: Variant, base: Rig) -> FullTorque | None:
    """What the feedforward knows of a muscle that lengthens: (4.7) where it has it."""
    return FullTorque(base, lengthening=True) if variant.printed and not variant.both_ways else None


def _controller(
    gains: Sequence[tuple[float, ...]], variant: Variant, mass: Array, anti_windup: str
) -> Parallel:
    """One controller for a batch: the gains of each plant, all of the same kind of feedback, and
    the payload that it knows.
    """
    base = assumed(variant)
    arm, table = ArmModel.from_rig(base), base.model["arm"]
    arms = arm.replace(
        inertia=table["inertia"] + mass * table["length"] ** 2,
        weight=(table["first_moment"] + mass * table["length"]) * table["gravity"],
    )
    columns = [np.array(column, dtype=np.float64) for column in zip(*gains, strict=True)]
    feedforward = Feedforward(
        arms,
        AirModel(base),
        columns[0],
        period=PERIOD,
        motion=variant.motion,
        lengthening=lengthening(variant, base),
    )
    if len(columns) == 3:
        return Parallel(feedforward, PID(*columns[1:], period=PERIOD, anti_windup=anti_windup))
    return Parallel(feedforward, Fuzzy(*columns[1:], period=PERIOD))


def lifts(
    names: Sequence[str] = ("as printed",),
    gains: Mapping[str, Gains] = GAINS,
    *,
    payloads: Sequence[float] = PAYLOADS,
    anti_windup: str = "none",
    seed: int | None = _SEED,
    duration: float | None = None,
) -> dict[str, dict[str, Lifts]]:
    """Lift, hold and return of plants, under controllers, with payloads: one batch for each valve
    and kind of feedback.

    Parameters
    ----------
    names : sequence of str
        Of :data:`VARIANTS`.
    gains : mapping of str to tuple
        As :data:`GAINS`; a gain may be a tuple, one for each payload.
    payloads : sequence of float
        [kg]
    anti_windup : {"none", "clamping", "back_calculation"}
        Of the PID; the dissertation had none.
    seed : int, optional
        As for :func:`plant`.
    duration : float, optional
        [s], the whole 25 s by default.

    Returns
    -------
    dict of str to dict of str to Lifts
        By plant and controller.

    Raises
    ------
    ParameterError
        If there is no such plant, or a run fails.
    """
    for name in names:
        if name not in VARIANTS:
            raise ParameterError(f"names has {name!r}; the plants are: {', '.join(VARIANTS)}")
    groups: dict[tuple[Any, ...], list[str]] = {}
    for name in names:
        one = VARIANTS[name]
        key = (one.printed, one.motion, one.both_ways, one.regulated, *sorted(one.known.items()))
        groups.setdefault(key, []).append(name)
    found: dict[str, dict[str, Lifts]] = {name: {} for name in names}
    for members in groups.values():
        for size in (3, 4):
            kind = {name: values for name, values in gains.items() if len(values) == size}
            if kind:
                _run(found, members, kind, tuple(payloads), anti_windup, seed, duration)
    return found


def _run(
    found: dict[str, dict[str, Lifts]],
    members: Sequence[str],
    gains: Mapping[str, Gains],
    payloads: tuple[float, ...],
    anti_windup: str,
    seed: int | None,
    duration: float | None,
) -> None:
    """One batch: every plant of a model, every set of gains, every payload, in this order."""
    made = [plant(VARIANTS[name], mass, seed) for name in members for mass in payloads]
    rigs: list[Rig] = []
    for i in range(len(members)):
        rigs += made[i * len(payloads) : (i + 1) * len(payloads)] * len(gains)
    each = [
        tuple(float(value[i] if isinstance(value, tuple) else value) for value in values)
        for _ in members
        for values in gains.values()
        for i in range(len(payloads))
    ]
    mass = np.array([m for _ in members for _ in gains for m in payloads])
    path, base = trajectory(), assumed(VARIANTS[members[0]])
    run = sweep(
        rigs,
        _controller(each, VARIANTS[members[0]], mass, anti_windup),
        path,
        duration,
        sample_time=PERIOD,
        step=_STEP,
        initial=_at_rest(rigs),
        actuation=_fed(float(base.parameter("supply.initial_pressure").value))
        if VARIANTS[members[0]].regulated
        else None,
        channels=("joint_angle", "joint_rate", "muscle_pressure"),
        record_every=round(_ROW / PERIOD),
    ).run
    if run.failed.any():
        at = int(np.argmax(run.failed))
        raise ParameterError(f"a lift of {members} left the range of the model: {run.status[at]}")
    reference = np.asarray(path(run.time).angle)
    place = 0
    for name in members:
        for label in gains:
            rows = slice(place, place + len(payloads))
            place += len(payloads)
            angle, rate, pressure = (
                np.array(run[c][rows]) for c in ("joint_angle", "joint_rate", "muscle_pressure")
            )
            metrics = evaluate(run.time, reference, angle, rate=rate, parts=path.phases)
            found[name][label] = Lifts(run.time, reference, angle, rate, pressure, metrics)


def _fed(pressure: float) -> Actuation:
    """The command to the valve, the regulator set to a pressure [Pa]."""
    return lambda command: {"valve_command": command, "supply_command": pressure}


def _at_rest(rigs: Sequence[Rig]) -> dict[str, Array]:
    """Every plant at the angle of rest, with the pressure that holds it there, effects left out."""
    (low,) = degrees(LOW)
    known: dict[int, float] = {}
    for rig in rigs:
        if id(rig) not in known:
            arm = ArmModel.from_rig(rig)
            known[id(rig)] = float(arm.pressure(float(arm.weight) * float(np.sin(low)), low))
    pressure = np.array([max(known[id(rig)], 0.0) for rig in rigs])
    return {"joint_angle": np.full(len(rigs), low), "muscle_pressure": pressure}


def predicted(run: Lifts, payloads: Sequence[float] = PAYLOADS) -> Array:
    """Pressure that the printed model wants along the trajectory (4.12), shape (payloads, rows)
    [Pa]: the dotted line of Fig. 4.14.

    Parameters
    ----------
    run : Lifts
        Whose rows are taken.
    payloads : sequence of float
        [kg]

    Returns
    -------
    ndarray
    """
    variant, aim = VARIANTS["as printed"], trajectory()(run.time)
    base = assumed(variant)
    wanted = []
    for mass in payloads:
        arm = ArmModel.from_rig(base.with_parameters({"arm.payload": mass}))
        model = Feedforward(arm, AirModel(base), lengthening=lengthening(variant, base))
        wanted.append(np.asarray(model.desired_pressure(aim), dtype=np.float64))
    return np.array(wanted)


# ------------------------------------------------------------------------ gain maps


@dataclass(frozen=True, eq=False)
class Map:
    """nu, omega and J over two gains, for each payload, with the angle in radians and in degrees.

    Attributes
    ----------
    axes : mapping of str to ndarray
        Values of the two gains.
    payloads : tuple of float
        [kg]
    nu : ndarray, shape (payloads, first, second)
        [rad2 s]
    omega, j : mapping of str to ndarray, like nu
        By the unit of the angle.
    """

    axes: Mapping[str, Array]
    payloads: tuple[float, ...]
    nu: Array = field(repr=False)
    omega: Mapping[str, Array] = field(repr=False)
    j: Mapping[str, Array] = field(repr=False)

    def best(self, values: Array) -> list[tuple[float, float]]:
        """The gains with the smallest value, payload by payload."""
        first, second = self.axes.values()
        places = [np.unravel_index(int(np.nanargmin(v)), v.shape) for v in values]
        return [(float(first[i]), float(second[k])) for i, k in places]

    def smooth(self, unit: str) -> Array:
        """Mean of J at the neighbours of the optimum over J there, payload by payload: 1 is
        flat.
        """
        shares = []
        for v in self.j[unit]:
            i, k = np.unravel_index(int(np.nanargmin(v)), v.shape)
            near = v[max(i - 1, 0) : i + 2, max(k - 1, 0) : k + 2]
            shares.append((near.sum() - v[i, k]) / (near.size - 1) / v[i, k])
        return np.array(shares)


def pid_map(
    kp: Sequence[float],
    ki: Sequence[float],
    name: str = "as printed",
    payloads: Sequence[float] = PAYLOADS[:3],
) -> Map:
    """Gains kP and kI [V/rad, V/(rad s)] of the PID with kD = 0, in one batch.

    Parameters
    ----------
    kp, ki : sequence of float
        Values of each.
    name : str
        Of :data:`VARIANTS`.
    payloads : sequence of float
        [kg]

    Returns
    -------
    Map
    """
    return _map(
        {"kP": kp, "kI": ki},
        name,
        payloads,
        lambda p, i: PID(p, i, period=PERIOD, anti_windup="none"),
    )


def fuzzy_map(
    g1: Sequence[float],
    h: Sequence[float],
    name: str = "as printed",
    payloads: Sequence[float] = PAYLOADS[:3],
    *,
    g2: float = 0.6,
) -> Map:
    """Gains g1 [rad] and h [V] of the fuzzy controller with a fixed g2 [rad/s], in one batch; as
    :func:`pid_map`.
    """
    return _map({"g1": g1, "h": h}, name, payloads, lambda a, b: Fuzzy(a, g2, b, period=PERIOD))


def derivative_line(
    kd: Sequence[float], best: Sequence[tuple[float, float]], name: str = "as printed"
) -> Map:
    """The PID's gain kD [V s/rad] beside the kP and kI of each payload; as :func:`pid_map`."""
    kp, ki = (np.repeat(column, len(kd)) for column in zip(*best, strict=True))
    return _map(
        {"kD": kd, "only": [0.0]},
        name,
        PAYLOADS[: len(best)],
        lambda d, _: PID(kp, ki, d, period=PERIOD, anti_windup="none"),
    )


def rate_line(
    g2: Sequence[float], best: Sequence[tuple[float, float]], name: str = "as printed"
) -> Map:
    """The fuzzy controller's gain g2 [rad/s] beside the g1 and h of each payload; as
    :func:`pid_map`.
    """
    g1, h = (np.repeat(column, len(g2)) for column in zip(*best, strict=True))
    return _map(
        {"g2": g2, "only": [0.0]},
        name,
        PAYLOADS[: len(best)],
        lambda b, _: Fuzzy(g1, b, h, period=PERIOD),
    )


def _map(
    gains: Mapping[str, Sequence[float]], name: str, payloads: Sequence[float], make: Any
) -> Map:
    axes = {label: np.asarray(values, dtype=np.float64) for label, values in gains.items()}
    first, second = (m.ravel() for m in np.meshgrid(*axes.values(), indexing="ij"))
    shape = (len(payloads), *(values.size for values in axes.values()))
    made = [plant(VARIANTS[name], mass) for mass in payloads]
    rigs = [rig for rig in made for _ in range(first.size)]
    path = trajectory()
    done = sweep(
        rigs,
        make(np.tile(first, len(payloads)), np.tile(second, len(payloads))),
        path,
        sample_time=PERIOD,
        step=_STEP,
        initial=_at_rest(rigs),
        channels=("joint_angle", "joint_rate"),
        record_every=round(_ROW / PERIOD),
    )
    time, angle, rate = done.run.time, done.run["joint_angle"], done.run["joint_rate"]
    wanted = np.asarray(path(time).angle)
    nu = np.asarray(done.squared_error).reshape(shape)
    omega: dict[str, Array] = {}
    for unit in ("rad", "deg"):
        # a part at a time: the whole record several times over would be a gigabyte
        parts = [
            np.atleast_1d(
                evaluate(
                    time, wanted, angle[i : i + 100], rate=rate[i : i + 100], unit=unit
                ).curvature
            )
            for i in range(0, len(rigs), 100)
        ]
        omega[unit] = np.where(done.failed, np.nan, np.concatenate(parts)).reshape(shape)
    j = {unit: combined(nu, values, axis=(1, 2)) for unit, values in omega.items()}
    return Map(axes, tuple(payloads), nu, omega, j)
