"""The experiments of dissertation chapter 3 on the elbow rig: torque at a pressure, step,
triangular pressure, ramp and hold.

Every number that the chapter does not give is the rig's (``pamrs/rigs/elbow.toml``, which says
where it is from); what is varied here to find the reason of a difference is an argument. Rotations
are counted from the rest angle, at which the muscles are at rest length: the joint cannot be below
it, and the chapter's equations (3.1)-(3.8) begin there, at no contraction.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from pamrs.errors import ParameterError
from pamrs.rig import Joint, Rig
from pamrs.rigs import named
from pamrs.simulation import Simulation, simulate
from pamrs.units import to_si
from reproduction.lifting import lift
from reproduction.rigs import with_struts

if TYPE_CHECKING:
    from pamrs.rig import Muscle


Array = NDArray[np.float64]

FOOT_POUND: Final = to_si(1.0, "ft lbf", "torque")
PSI: Final = to_si(1.0, "psi", "pressure")
POUND: Final = to_si(1.0, "lb", "mass")
INCH: Final = to_si(1.0, "in", "length")

#: Kind of the joint by how its torque is counted: power-conserving, or by (3.6)-(3.8) as printed.
LAWS: Final = {"conserving": "tendon", "printed": "published"}
#: (2.36): hysteresis of the 0.75-in latex muscle of chapter 2, the only number published for a
#: latex muscle.
HYSTERESIS: Final = {
    "friction_coefficient": 0.16,
    "friction_pressure_slope": -0.145e-6,
    "friction_floor": 0.01,
}

_SAMPLE: Final = 0.01  # s; the step of the integration is a tenth of it at most
_STEP_SAMPLE: Final = 0.002
_FREE: Final = 0.37  # contraction of the unloaded muscle at 150 psi, 3.2.2


def arm_rig(
    *,
    law: str = "conserving",
    pounds: float | None = None,
    psi: float | None = None,
    area: float | None = None,
    **arm: float,
) -> Rig:
    """The elbow rig with another torque law, payload, supply or valve.

    Parameters
    ----------
    law : {"conserving", "printed"}
        How the joint's torque is counted.
    pounds : float, optional
        Payload [lb]; the rig's by default.
    psi : float, optional
        Pressure of the supply [psi, gauge]; the rig's by default.
    area : float, optional
        Effective area of the open valve [m2]; the rig's by default.
    **arm : float
        Other entries of ``[arm]``, SI; and ``dead_volume`` [m3].

    Returns
    -------
    Rig

    Raises
    ------
    ParameterError
        If the law is unknown, or a value is outside the bounds of the possible.
    """
    if law not in LAWS:
        raise ParameterError(f"law = {law!r} is not allowed: one of {', '.join(LAWS)}")
    values: dict[str, float] = {
        f"arm.{name}": value for name, value in arm.items() if name != "dead_volume"
    }
    if "dead_volume" in arm:
        values["chamber.dead_volume"] = arm["dead_volume"]
    if pounds is not None:
        values["arm.payload"] = pounds * POUND
    if psi is not None:
        values["supply.initial_pressure"] = psi * PSI
    if area is not None:
        values["valve.discharge_area_max"] = area
    degrees = _BRAID.get()
    rig = with_struts("elbow")
    if degrees is not None:
        rig = with_muscle(rig, steeper_braid(degrees))
    return _with(rig.with_parameters(values), joint={"kind": LAWS[law]})


@contextmanager
def braid(degrees: float) -> Iterator[None]:
    """Every experiment inside has the elbow's muscle with another braid angle,
    :func:`steeper_braid`.

    Parameters
    ----------
    degrees : float
        Braid angle [deg].
    """
    before = _BRAID.set(degrees)
    try:
        yield
    finally:
        _BRAID.reset(before)


def braid_angle() -> float | None:
    """The braid angle that :func:`braid` has set [deg]; None for the rig's own."""
    return _BRAID.get()


_BRAID: ContextVar[float | None] = ContextVar("braid", default=None)


def _with(rig: Rig, **blocks: dict[str, Any] | None) -> Rig:
    """A rig with other entries of its blocks; None leaves a block out."""
    model = rig.model
    for block, entries in blocks.items():
        model[block] = None if entries is None else {**model[block], **entries}
    return Rig(rig.name, model)


def with_muscle(rig: Rig, muscle: Muscle | None = None, **changes: Any) -> Rig:
    """A rig with another muscle, or with other entries of its own.

    Parameters
    ----------
    rig : Rig
        With one muscle.
    muscle : Muscle, optional
        As many of it, which buckle as the rig's own; these by default.
    **changes
        Entries of ``[muscle]``, SI.

    Returns
    -------
    Rig
    """
    model = rig.model
    own = (
        model["muscle"]
        if muscle is None
        else muscle.parameters | {key: model["muscle"][key] for key in ("count", "buckling_load")}
    )
    model["muscle"] = {**own, **changes}
    return Rig(rig.name, model)


def without_supply(rig: Rig, *, hysteresis: bool = False) -> Rig:
    """The same rig without supply and valve, so that its pressure can be prescribed.

    Parameters
    ----------
    rig : Rig
        A one-link rig.
    hysteresis : bool
        Whether its muscles get the friction of :data:`HYSTERESIS`.

    Returns
    -------
    Rig
    """
    return _with(rig, supply=None, valve=None, muscle=dict(HYSTERESIS) if hysteresis else {})


def rest_angle() -> float:
    """Angle of the forearm from the vertical at which the muscles are at rest length [rad]."""
    return float(named("elbow").parameter("joint.rest_angle").value)


def _own_muscle() -> Muscle:
    muscle = named("elbow").muscle
    assert muscle is not None
    return muscle


def _muscle() -> Muscle:
    degrees = _BRAID.get()
    return _own_muscle() if degrees is None else steeper_braid(degrees)


# -------------------------------------------------------------------------- statics


def mooney_rivlin(share: float = 0.5) -> Muscle:
    """The muscle of (3.21), Gaylord's force less a Mooney-Rivlin bladder, its constants from the
    free contraction of 3.2.2.

    Parameters
    ----------
    share : float
        ``c01/(c10 + c01)``, from 0 to 1: one published fact fixes one of the two constants, and
        none is printed.

    Returns
    -------
    Muscle

    Raises
    ------
    ParameterError
        If the share is outside 0 to 1.
    """
    if not 0.0 <= share <= 1.0:
        raise ParameterError(f"share = {share} is not allowed: from 0 to 1")
    return _mooney_rivlin(share, _BRAID.get())


@cache
def _mooney_rivlin(share: float, degrees: float | None) -> Muscle:
    unit = 1e6
    braided = _own_muscle() if degrees is None else steeper_braid(degrees)
    soft = braided.replace(model="mooney_rivlin", c10=(1.0 - share) * unit, c01=share * unit)
    pressure = 150.0 * PSI
    # the force is linear in the constants
    gas = float(soft.replace(modulus_scale=0.0).force(pressure, _FREE))
    scale = gas / (gas - float(soft.force(pressure, _FREE)))
    return soft.replace(c10=scale * (1.0 - share) * unit, c01=scale * share * unit)


@cache
def steeper_braid(degrees: float = 73.5) -> Muscle:
    """The elbow's muscle with another braid angle, its moduli scaled to the same free contraction.

    Parameters
    ----------
    degrees : float
        Braid angle [deg]; 73.5 gives both the published blocked force and the published largest
        diameter.

    Returns
    -------
    Muscle
    """
    soft, pressure = _own_muscle().replace(braid_angle=math.radians(degrees)), 150.0 * PSI
    gas = float(soft.replace(modulus_scale=0.0).force(pressure, _FREE))
    return soft.replace(modulus_scale=gas / (gas - float(soft.force(pressure, _FREE))))


def elbow_torque(
    rotation: Any,
    *,
    law: str = "conserving",
    psi: float = 150.0,
    count: int = 6,
    muscle: Muscle | None = None,
) -> Array:
    """Torque of the elbow's muscles at rest [N m].

    Parameters
    ----------
    rotation : array_like
        From the rest angle [rad].
    law : {"conserving", "printed"}
        How the torque is counted.
    psi : float
        Gauge pressure [psi].
    count : int
        Muscles.
    muscle : Muscle, optional
        The rig's by default.

    Returns
    -------
    ndarray
        In the shape of ``rotation``.
    """
    joint = Joint.from_model(arm_rig(law=law).model["joint"])
    angle = rest_angle() + np.asarray(rotation, dtype=np.float64)
    return joint.torque(muscle or _muscle(), psi * PSI, angle, count=count)


def torque_range(
    torque: Callable[[Array], Array], least: float, *, last: float = math.radians(110.0)
) -> tuple[float, float]:
    """The first and the last rotation at which a torque is at least ``least``.

    Parameters
    ----------
    torque : callable
        Rotation [rad] to torque [N m], over arrays.
    least : float
        [N m].
    last : float
        Where the search ends [rad].

    Returns
    -------
    (float, float)
        [rad]; not a number where the torque never reaches it.
    """
    from scipy.optimize import brentq

    grid = np.linspace(0.0, last, 441)
    enough = torque(grid) >= least
    if not enough.any():
        return math.nan, math.nan
    low, high = int(np.argmax(enough)), int(enough.size - 1 - np.argmax(enough[::-1]))

    def excess(x: float) -> float:
        return float(torque(np.array([x]))[0]) - least

    first = 0.0 if low == 0 else float(brentq(excess, grid[low - 1], grid[low]))
    end = (
        float(grid[-1])
        if high == grid.size - 1
        else float(brentq(excess, grid[high], grid[high + 1]))
    )
    return first, end


def payload_torque(pounds: float, angle: Any, lever: float | None = None) -> Array:
    """``F_payload r_payload sin(phi)`` (3.24), the torque of the payload alone [N m].

    Parameters
    ----------
    pounds : float
        Payload [lb].
    angle : array_like
        Of the arm from the vertical [rad].
    lever : float, optional
        From the joint to the payload [m]; the rig's 20 in by default.

    Returns
    -------
    ndarray
    """
    arm = named("elbow").model["arm"]
    return np.asarray(
        pounds
        * POUND
        * arm["gravity"]
        * (arm["length"] if lever is None else lever)
        * np.sin(angle)
    )


def rotation_reached(pounds: float, psi: float, *, law: str = "conserving") -> float:
    """Rotation up to which a payload is lifted slowly at a pressure, without friction [rad].

    Parameters
    ----------
    pounds, psi : float
        Payload [lb] and gauge pressure [psi].
    law : {"conserving", "printed"}
        How the joint's torque is counted.

    Returns
    -------
    float
    """
    return (
        lift(arm_rig(law=law, pounds=pounds, coulomb=0.0), pressure=psi * PSI).reached
        - rest_angle()
    )


@dataclass(frozen=True, eq=False)
class StaticCurve:
    """Rotation over pressure of a payload that is lifted slowly, without friction.

    Attributes
    ----------
    psi : ndarray (n,)
        Gauge pressure [psi], from the one that takes the arm off its stop to the last.
    rotation : ndarray (n,)
        [rad].
    slope : ndarray (n,)
        Rotation per pressure [rad/psi].
    """

    psi: Array
    rotation: Array
    slope: Array


def static_curve(
    pounds: float, top: float = 150.0, *, law: str = "conserving", points: int = 400
) -> StaticCurve:
    """The rest position of a payload over pressure.

    Parameters
    ----------
    pounds : float
        Payload [lb].
    top : float
        Highest gauge pressure [psi].
    law : {"conserving", "printed"}
        How the joint's torque is counted.
    points : int
        Points of the curve.

    Returns
    -------
    StaticCurve
    """
    rig = arm_rig(law=law, pounds=pounds)
    muscle, joint, arm = _muscle(), Joint.from_model(rig.model["joint"]), rig.model["arm"]
    rotation = np.linspace(0.0, rotation_reached(pounds, top, law=law), points)
    angle = rest_angle() + rotation
    contraction = joint.shortening(angle) / float(muscle.parameters["rest_length"])
    weight = (arm["first_moment"] + arm["payload"] * arm["length"]) * arm["gravity"] * np.sin(angle)
    pull = weight / (rig.model["muscle"]["count"] * joint.torque_arm(angle))
    # the force is linear in pressure
    at_zero, at_bar = muscle.force(0.0, contraction), muscle.force(1e5, contraction)
    pressure = (pull - at_zero) * 1e5 / (at_bar - at_zero) / PSI
    return StaticCurve(pressure, rotation, 1.0 / np.gradient(pressure, rotation, edge_order=2))


# ------------------------------------------------------------------------- dynamics


@dataclass(frozen=True, eq=False)
class Step:
    """A pressure step through the valve.

    Attributes
    ----------
    simulation : Simulation
        Everything over time.
    area : float
        Effective area of the valve [m2].
    peak : float
        Largest rate [rad/s].
    swept : float
        Rotation at rest [rad].
    arrival : float
        When 90 deg of rotation are first reached [s]; not a number if they are not.
    first_turn : float
        Rotation at which the first swing turns back [rad].
    """

    simulation: Simulation
    area: float
    peak: float
    swept: float
    arrival: float
    first_turn: float

    @property
    def mean(self) -> float:
        """Mean rate over the 90 deg [rad/s]."""
        return math.radians(90.0) / self.arrival


def step(
    area: float | None = None,
    *,
    law: str = "conserving",
    pounds: float = 100.0,
    seconds: float = 6.0,
    **arm: float,
) -> Step:
    """The step of Fig. 3.8: a supply at 150 psi, the valve opened at once, a tip payload.

    Parameters
    ----------
    area : float, optional
        Effective area of the valve [m2]; the rig's by default.
    law : {"conserving", "printed"}
        How the joint's torque is counted.
    pounds : float
        Payload [lb].
    seconds : float
        Simulated time.
    **arm : float
        Other entries, as for :func:`arm_rig`.

    Returns
    -------
    Step
    """
    rig = arm_rig(law=law, pounds=pounds, psi=150.0, area=area, **arm)
    valve = rig.model["valve"]
    command = np.full(
        round(seconds / _STEP_SAMPLE) + 1, valve["null_voltage"] + valve["half_range"]
    )
    result = simulate(rig, command, sample_time=_STEP_SAMPLE)
    rotation, rate = result["joint_angle"] - rest_angle(), result["joint_rate"]
    moving = int(np.argmax(rotation > math.radians(1.0)))
    back = rate[moving:] <= 0.0
    turn = moving + int(np.argmax(back)) if back.any() else rotation.size - 1
    return Step(
        simulation=result,
        area=float(valve["discharge_area_max"]),
        peak=float(rate.max()),
        swept=rotation_reached(pounds, 150.0, law=law),
        arrival=_first_time(result.time, rotation, math.radians(90.0)),
        first_turn=float(rotation[turn]),
    )


def _first_time(time: Array, values: Array, level: float) -> float:
    """When values first rise through a level, between the samples; not a number if they do not."""
    above = values >= level
    if not above.any() or above[0]:
        return math.nan
    index = int(np.argmax(above))
    share = (level - values[index - 1]) / (values[index] - values[index - 1])
    return float(time[index - 1] + share * (time[index] - time[index - 1]))


def valve_for_peak(rate: float, *, law: str = "conserving", **arm: float) -> float:
    """Effective valve area with which the step has a given peak rate [m2].

    Parameters
    ----------
    rate : float
        [rad/s].
    law : {"conserving", "printed"}
        How the joint's torque is counted.
    **arm : float
        Other entries, as for :func:`arm_rig`.

    Returns
    -------
    float

    Raises
    ------
    ParameterError
        If no area from 0.1 to 100 mm2 has it.
    """
    from scipy.optimize import brentq

    def excess(logarithm: float) -> float:
        return step(math.exp(logarithm), law=law, seconds=2.5, **arm).peak - rate

    low, high = math.log(1e-7), math.log(1e-4)
    if excess(low) > 0.0 or excess(high) < 0.0:
        raise ParameterError(
            f"rate = {rate:g} rad/s is not allowed: no valve from 0.1 to 100 mm2 has this peak"
        )
    return math.exp(float(brentq(excess, low, high, xtol=1e-4)))


def triangle(
    *,
    pounds: float = 135.0,
    top: float = 150.0,
    frequency: float = 0.05,
    law: str = "conserving",
    hysteresis: bool = False,
) -> Simulation:
    """One period of the triangular pressure of Fig. 3.12, prescribed.

    Parameters
    ----------
    pounds, top : float
        Payload [lb], highest gauge pressure [psi].
    frequency : float
        [Hz].
    law : {"conserving", "printed"}
        How the joint's torque is counted.
    hysteresis : bool
        Whether the muscles have the friction of :data:`HYSTERESIS`.

    Returns
    -------
    Simulation
    """
    time = np.arange(0.0, 1.0 / frequency + 0.5 * _SAMPLE, _SAMPLE)
    pressure = top * PSI * np.maximum(1.0 - np.abs(2.0 * frequency * time - 1.0), 0.0)
    rig = without_supply(arm_rig(law=law, pounds=pounds), hysteresis=hysteresis)
    return simulate(rig, pressure=pressure, sample_time=_SAMPLE)


def ramp_and_hold(
    *,
    pounds: float = 100.0,
    top: float = 145.0,
    law: str = "conserving",
    hysteresis: bool = False,
    **arm: float,
) -> Simulation:
    """The test of Fig. 3.16: 4 s of ramp to a pressure and 6 s of hold, prescribed.

    Parameters
    ----------
    pounds, top : float
        Payload [lb], gauge pressure that is held [psi]: 145 of the 150 wanted were reached.
    law : {"conserving", "printed"}
        How the joint's torque is counted.
    hysteresis : bool
        Whether the muscles have the friction of :data:`HYSTERESIS`.
    **arm : float
        Other entries of ``[arm]``, SI.

    Returns
    -------
    Simulation
    """
    time = np.arange(0.0, 10.0 + 0.5 * _SAMPLE, _SAMPLE)
    rig = without_supply(arm_rig(law=law, pounds=pounds, **arm), hysteresis=hysteresis)
    # the ramp aims at 150 psi in 4 s and is cut off at what was reached
    return simulate(rig, pressure=np.minimum(150.0 * time / 4.0, top) * PSI, sample_time=_SAMPLE)


def at_same_pressure(
    result: Simulation, values: Array, psi: Sequence[float] | Array
) -> tuple[Array, Array]:
    """Values at given pressures on the rising and on the falling side of one triangular period.

    Parameters
    ----------
    result : Simulation
        What :func:`triangle` returns.
    values : ndarray (n,)
        One of its channels, or made of them.
    psi : array_like
        Gauge pressures [psi].

    Returns
    -------
    (ndarray, ndarray)
        Rising, falling.
    """
    pressure = result["muscle_pressure"] / PSI
    top = int(np.argmax(pressure))
    wanted = np.asarray(psi, dtype=np.float64)
    rising = np.interp(wanted, pressure[: top + 1], values[: top + 1])
    falling = np.interp(wanted, pressure[top:][::-1], values[top:][::-1])
    return rising, falling
