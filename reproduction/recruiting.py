"""The lifting cycles of chapter 6 on the shoulder rig: payload, number of muscles, angle, and what
is read otherwise, are arguments.

The muscles that are not recruited are taken off (the text changes its tubing between tests);
:func:`beside_idle` keeps them. All cycles of one angle run in one batch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pamrs.control import Cascade, PressureLoop, cascaded_pid, sweep
from pamrs.control.trajectories import Trajectory, cosine_cycles
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.rigs import named
from reproduction.elbow import HYSTERESIS, with_muscle
from reproduction.margins import inner_gains, loop_margin
from reproduction.rigs import with_struts

Array = NDArray[np.float64]
#: Payload [kg] and number of muscles.
Case = tuple[float, int]

#: Payloads of Tables 6.2 and 6.3 [kg], and numbers of muscles.
PAYLOADS: Final = (0.0, 9.0, 18.0, 27.0)
MUSCLES: Final = (2, 4, 6)
#: What is tested up to which angle [deg]: Tables 6.2 and 6.3.
MATRIX: Final[Mapping[float, tuple[Case, ...]]] = {
    50.0: tuple((payload, n) for payload in PAYLOADS for n in MUSCLES),
    90.0: tuple((p, n) for p in PAYLOADS for n in MUSCLES if not (p > 9.0 and n == 2)),
}
#: The payloads of Fig. 6.9 that Table 6.3 has not [kg].
EXTENDED: Final = (36.0, 45.0, 54.0, 63.0)
#: Least angle [deg] and length of a cycle [s]: 6 s up, 5 s, 6 s down, 5 s.
LOW: Final = 15.0
CYCLE: Final = 22.0
#: Time between two samples [s].
PERIOD: Final = 0.005
#: Of the angle, for six muscles [Pa/rad, Pa/(rad s), Pa s/rad]; fewer ask for more pressure in
#: proportion.
GAINS: Final[Mapping[str, float]] = {"kp": 4e5, "ki": 6e5, "kd": 5e4}
#: The same and slower ones, for arms that have neither payload nor rubber; of each rig the first
#: with which its whole loop bears :data:`WHOLE` times its gain.
SLOWER: Final[tuple[Mapping[str, float], ...]] = (
    GAINS,
    {"kp": 2e5, "ki": 3e5, "kd": 2.5e4},
    {"kp": 1e5, "ki": 1e5, "kd": 2.5e4},
    {"kp": 5e4, "ki": 2.5e4, "kd": 2.5e4},
)
WHOLE: Final = 1.5
#: Angles about which whole loops are made linear, and how far below the largest one [deg].
_ABOUT: Final = (16.0, 50.0)
_CLOSE: Final = 2.0
#: The same without the rate, as slow as the arm with 27 kg needs to rise smoothly.
SLOW: Final[Mapping[str, float]] = {"kp": 1e5, "ki": 1e5, "kd": 0.0}
#: Of the filters of the pressure and of the rate [s].
FILTER: Final = 0.0025
_CHANNELS: Final = ("joint_angle", "joint_torque", "muscle_pressure", "supply_pressure")
_EVERY: Final = 1  # a loop that is unstable changes its sign from sample to sample

Changed = Callable[[Rig], Rig]


@cache
def plant(payload: float, muscles: int) -> Rig:
    """The shoulder with a payload [kg] and as many muscles, each with its share of the dead volume.

    Parameters
    ----------
    payload : float
    muscles : int

    Returns
    -------
    Rig
    """
    rig = with_struts("shoulder")
    share = rig.parameter("chamber.dead_volume").value / rig.parameter("muscle.count").value
    return rig.with_parameters(
        {
            "arm.payload": payload,
            "muscle.count": muscles,
            "chamber.dead_volume": share * muscles,
        }
    )


def _gas(rig: Rig, pressure: float) -> Rig:
    model = rig.model
    model["gas"] = {**model["gas"], "ambient_pressure": pressure}
    return Rig(rig.name, model)


def _isothermal(rig: Rig) -> Rig:
    return rig.with_parameters({"chamber.alpha_in": 1.0, "chamber.alpha": 1.0})


def _scaled(rig: Rig, name: str, factor: float) -> Rig:
    return rig.with_parameters({name: factor * rig.parameter(name).value})


def _heavier(rig: Rig, moment: float) -> Rig:
    return rig.with_parameters({"arm.first_moment": moment})


#: Ambient pressure [Pa] of gas laws that take gauge pressures for absolute ones: as good as none.
NONE: Final = 1e3
#: Other readings of what the text leaves open, each a change of the rig.
READINGS: Final[Mapping[str, Changed]] = {
    "as it is": lambda rig: rig,
    "gauge pressures in (6.4)": lambda rig: _gas(rig, NONE),
    "arm of 5 kg m": lambda rig: _heavier(rig, 5.0),
    "arm of 11 kg m": lambda rig: _heavier(rig, 11.0),
    "isothermal gas": _isothermal,
    "no dead volume": lambda rig: _scaled(rig, "chamber.dead_volume", 1e-3),
    "braid of 75.4 deg": lambda rig: with_muscle(rig, braid_angle=math.radians(75.4)),
    "gauge pressures, twice the dead volume": lambda rig: _gas(
        _scaled(rig, "chamber.dead_volume", 2.0), NONE
    ),
}
#: What the text suspects behind the experiments' larger input (6.5.2), and what it does not name,
#: each on the rig as it is; sizes are the catalogue's typical ones unless the name says otherwise.
SUSPECTS: Final[Mapping[str, Changed]] = {
    "leakage of the muscles": lambda rig: rig.with_effect("leak_muscle", {"conductance": 5e-12}),
    "leakage of the valve": lambda rig: rig.with_effect(
        "valve_centre_leakage", {"conductance": 3e-11, "opening": 0.02}
    ),
    "leakage of the tank": lambda rig: rig.with_effect("supply_leak", {"conductance": 1e-11}),
    "friction of the tubing": lambda rig: rig.with_effect(
        "tube_flow_restriction", {"conductance": 1.2e-8, "tap": 0.0}
    ),
    "volume of the tubing, 0.1 l": lambda rig: rig.with_parameters(
        {"chamber.dead_volume": rig.parameter("chamber.dead_volume").value + 1e-4}
    ),
    "temperature of the muscles' air": lambda rig: rig.with_effect(
        "heat_transfer",
        {"heat_transfer_coefficient": 50.0, "initial_temperature_rise": 0.0, "share": 1.0},
    ),
    "hysteresis of the muscles (2.36)": lambda rig: with_muscle(rig, None, **HYSTERESIS),
}


@dataclass(frozen=True, eq=False)
class Cycles:
    """Lifting cycles, one row for each case.

    Attributes
    ----------
    cases : tuple of (float, int)
        Payload [kg] and number of muscles.
    high : float
        Largest angle wanted [deg].
    volume : float
        Of the tank [m3].
    time : ndarray, shape (samples,)
        [s]
    angle, torque, pressure, source : ndarray, shape (n, samples)
        Of the joint [rad, N m], in the muscles and in the tank [Pa, gauge].
    failed : ndarray of bool, shape (n,)
        Which left the range of the model.
    """

    cases: tuple[Case, ...]
    high: float
    volume: float
    time: Array = field(repr=False)
    angle: Array = field(repr=False)
    torque: Array = field(repr=False)
    pressure: Array = field(repr=False)
    source: Array = field(repr=False)
    failed: NDArray[np.bool_] = field(repr=False)

    @property
    def count(self) -> int:
        """Number of cycles."""
        return round(float(self.time[-1]) / CYCLE)

    def row(self, payload: float, muscles: int) -> int:
        """Index of a case; ValueError if it is not there."""
        return self.cases.index((payload, muscles))

    @property
    def work(self) -> Array:
        """W_out (6.7) [J], shape (n,)."""
        rise = np.maximum(np.diff(self.angle, axis=1), 0.0)
        between = 0.5 * (self.torque[:, 1:] + self.torque[:, :-1])
        return np.asarray(np.sum(rise * between, axis=1))

    @property
    def energy(self) -> Array:
        """E_in (6.8) [J], shape (n,)."""
        return np.asarray((self.source[:, 0] - self.source[:, -1]) * self.volume)

    @property
    def efficiency(self) -> Array:
        """(6.9) [1], shape (n,)."""
        return self.work / self.energy

    def of(self, payload: float, muscles: int) -> float:
        """Efficiency of one case [1]."""
        return float(self.efficiency[self.row(payload, muscles)])

    def tops(self) -> Array:
        """Mean angle in the last half second of each upper hold [deg], shape (n, cycles)."""
        found = []
        for cycle in range(self.count):
            now = self.time - cycle * CYCLE
            part = (now >= 10.5) & (now <= 11.0)
            found.append(np.degrees(self.angle[:, part].mean(axis=1)))
        return np.array(found).T

    def followed(self, within: float = 1.0) -> NDArray[np.intp]:
        """Cycles that reached the largest angle, before the first that did not, shape (n,)."""
        reached = self.tops() > self.high - within
        return np.asarray(np.cumprod(reached, axis=1).sum(axis=1), dtype=np.intp)

    def gradient(self) -> Array:
        """Least of tank less muscles in each lift and upper hold [Pa], shape (n, cycles)."""
        found = []
        for cycle in range(self.count):
            now = self.time - cycle * CYCLE
            part = (now >= 0.5) & (now <= 11.0)
            found.append((self.source - self.pressure)[:, part].min(axis=1))
        return np.array(found).T


def trajectory(high: float, cycles: int) -> Trajectory:
    """The cycles of 6.4.2 up to an angle [deg]."""
    return cosine_cycles(math.radians(LOW), math.radians(high), cycles=cycles)


def rig_of(
    payload: float, muscles: int, *, elastic: bool = True, changed: Changed | None = None
) -> Rig:
    """The rig of a case, see :func:`lifting`."""
    rig = plant(payload, muscles)
    if not elastic:
        assert rig.muscle is not None
        rig = with_muscle(rig, rig.muscle.replace(model="gaylord", geometry="elliptic"))
    return rig if changed is None else changed(rig)


def inner_loop(rig: Rig) -> dict[str, float]:
    """Gains and filter of the pressure loop that a rig's chamber and valve allow."""
    return {**inner_gains(rig, PERIOD, FILTER), "pressure_filter": FILTER}


@cache
def case_gains(
    case: Case, high: float, elastic: bool = True, changed: Changed | None = None
) -> tuple[Mapping[str, float], float]:
    """Gains of the angle, for six muscles, with which the whole loop of a case has room, and its
    margin: the first of :data:`SLOWER`, the last where none has.

    Parameters
    ----------
    case : (float, int)
        Payload [kg] and number of muscles.
    high : float
        Largest angle [deg].
    elastic : bool
    changed : callable, optional
        As for :func:`lifting`, where the controller knows it.

    Returns
    -------
    (mapping of str to float, float)
    """
    rig = rig_of(*case, elastic=elastic, changed=changed)
    for gains in SLOWER:
        margin = whole_margin(rig, rig, case[1], high, gains)
        if margin >= WHOLE:
            break
    return gains, margin


def whole_margin(
    rig: Rig, known: Rig, muscles: int, high: float, gains: Mapping[str, float]
) -> float:
    """Least margin of a whole loop at the angles at which its muscles hold the arm.

    Parameters
    ----------
    rig, known : Rig
        What is controlled, and what the pressure loop's gains are for.
    muscles : int
    high : float
        Largest angle [deg].
    gains : mapping of str to float
        Of the angle, for six muscles.

    Returns
    -------
    float
        Infinite where no angle is held, or nothing has a linear model.
    """
    least = math.inf
    for angle in (*_ABOUT, high - _CLOSE):
        try:
            found = loop_margin(
                rig, lambda: controller([known], float(muscles), gains), math.radians(angle)
            )
        except ParameterError:
            continue
        least = min(least, found)
    return least


def controller(rigs: Sequence[Rig], muscles: Any, gains: Mapping[str, Any] = GAINS) -> Cascade:
    """The cascade of one batch: angle gains by the number of muscles, and a pressure loop with the
    gains that each rig's chamber and valve allow (:mod:`reproduction.margins`).

    Parameters
    ----------
    rigs : sequence of Rig
        One for each row, with one chamber and one valve, as the controller knows them.
    muscles : float or ndarray, shape (n,)
        How many each has.
    gains : mapping of str to float or ndarray, shape (n,)
        Of the angle, for six muscles, as :data:`GAINS`.

    Returns
    -------
    Cascade
    """
    inner = [inner_loop(rig) for rig in rigs]
    loop = {name: _column([one[name] for one in inner], muscles) for name in inner[0]}
    return cascaded_pid(
        rigs[0].parameter("supply.initial_pressure").value,
        period=PERIOD,
        rate_filter=FILTER,
        inner=PressureLoop(period=PERIOD, **loop),
        **{name: value * 6.0 / muscles for name, value in gains.items()},
    )


def _column(values: list[float], muscles: Any) -> Any:
    """A gain of each row, one number where there is one rig that is no batch."""
    return np.array(values) if np.ndim(muscles) else values[0]


def lifting(
    cases: Sequence[Case],
    high: float,
    cycles: int = 8,
    *,
    elastic: bool = True,
    changed: Changed | None = None,
    known: bool = False,
    gains: Mapping[str, float] | None = None,
) -> Cycles:
    """Lift and lower payloads by a cascaded controller.

    Parameters
    ----------
    cases : sequence of (float, int)
        Payload [kg] and number of muscles.
    high : float
        Largest angle [deg].
    cycles : int
        How many.
    elastic : bool
        Else the force is Gaylord's alone (6.4.3), the shape as it is.
    changed : callable, optional
        What is read otherwise: a rig for a rig.
    known : bool
        Whether the loops are set for the changed rig: it is another reading, not what no controller
        knows.
    gains : mapping of str to float, optional
        Of the angle, for six muscles; by default :func:`case_gains` of each case.

    Returns
    -------
    Cycles

    Raises
    ------
    ParameterError
        If there is no case.
    """
    if not cases:
        raise ParameterError("cases is empty: at least one payload and number of muscles is needed")
    rigs = [rig_of(*case, elastic=elastic, changed=changed) for case in cases]
    read = [rig_of(*case, elastic=elastic, changed=changed if known else None) for case in cases]
    own = [
        gains or case_gains(case, high, elastic, changed if known else None)[0] for case in cases
    ]
    columns = {name: np.array([one[name] for one in own]) for name in GAINS}
    done = sweep(
        rigs,
        controller(read, np.array([float(n) for _, n in cases]), columns),
        trajectory(high, cycles),
        sample_time=PERIOD,
        channels=_CHANNELS,
        record_every=_EVERY,
    )
    run = done.run
    angle, torque, pressure, source = (np.asarray(run[name]) for name in _CHANNELS)
    volume = rigs[0].parameter("supply.volume").value
    return Cycles(
        tuple(cases), high, volume, run.time, angle, torque, pressure, source, done.failed
    )


def beside_idle(payload: float, high: float, cycles: int, *, struts: bool = False) -> Cycles:
    """The rig ``recruitment`` with one of its three pairs in use, the others vented.

    Parameters
    ----------
    payload : float
        [kg]
    high : float
        Largest angle [deg].
    cycles : int
    struts : bool
        Whether the vented muscles push like struts instead of bowing out (6.6).

    Returns
    -------
    Cycles
        With one row, the case of two muscles.
    """
    rig = with_struts("recruitment") if struts else named("recruitment")
    rig = rig.with_parameters({"arm.payload": payload})
    vented = np.zeros(1)
    done = sweep(
        [rig],
        controller([plant(payload, 2)], np.array([2.0])),
        trajectory(high, cycles),
        sample_time=PERIOD,
        channels=("joint_angle.shoulder", "joint_torque.shoulder", "muscle_pressure.pair_1")
        + _CHANNELS[3:],
        record_every=_EVERY,
        actuation=lambda volts: {
            "valve_command": {"pair_1": volts, "pair_2": vented, "pair_3": vented}
        },
        measured={
            "joint_angle": "joint_angle.shoulder",
            "joint_rate": "joint_rate.shoulder",
            "muscle_pressure": "muscle_pressure.pair_1",
        },
    )
    run = done.run
    return Cycles(
        ((payload, 2),),
        high,
        rig.parameter("supply.volume").value,
        run.time,
        np.asarray(run["joint_angle.shoulder"]),
        np.asarray(run["joint_torque.shoulder"]),
        np.asarray(run["muscle_pressure.pair_1"]),
        np.asarray(run["supply_pressure"]),
        done.failed,
    )
