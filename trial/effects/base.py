"""What an effect is to the plant: parameters, memory and the ports at which it enters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

if TYPE_CHECKING:
    from ..geometry import JointTables, RigidTables
    from ..plant import Parameters

State = list[float]
Port = Callable[..., Any] | None
AIR_CONSTANT = 287.05
REFERENCE_DENSITY = 1.185
REFERENCE_TEMPERATURE = 293.15
#: each recording of a case starts this much later than the one before it [s], so that events can be
#: told by time
RECORDING_PERIOD = 1000.0


@dataclass(frozen=True)
class Setting:
    """What a draw may depend on.

    Number and length [s] of the recordings, median start of the tank [gauge Pa], payload [kg],
    friction [N m].
    """

    recordings: int = 5
    duration: float = 40.0
    supply_pressure: float = 13.8e5
    payload: float = 9.07
    coulomb: float = 1.5


@dataclass(frozen=True)
class Env:
    """Plant that an effect is put into; `clock` is the index of the state that holds the time."""

    par: Parameters
    tables: JointTables | RigidTables
    clock: int


@dataclass(frozen=True)
class Start:
    """Where a recording starts: absolute pressures [Pa], angle [rad], contraction [m], gravity
    torque [N m].
    """

    pressure: float
    supply: float
    angle: float
    contraction: float
    weight: float


def drawn(low: float, high: float) -> Any:
    """A field that is drawn evenly from a range."""
    return field(metadata={"drawn": (low, high)})


@dataclass(frozen=True)
class Effect:
    """Base of all effects.

    The ports return a function for the right-hand side, or None when the effect does not enter
    there; `first` is the index of the first own state. `graded` names the fields that carry the
    size: with all of them at zero the plant is as without the effect. `scales` has the typical
    size of each own state.
    """

    id: ClassVar[str] = ""
    block: ClassVar[str] = ""
    graded: ClassVar[tuple[str, ...]] = ()
    needs_clock: ClassVar[bool] = False
    scales: ClassVar[tuple[float, ...]] = ()

    def __init_subclass__(cls, **told: Any) -> None:
        """Take `id`, `block`, `graded`, `needs_clock` and `scales` where a class is declared."""
        super().__init_subclass__()
        for name, value in told.items():
            setattr(cls, name, value)

    @classmethod
    def draw(cls, rng: np.random.Generator, setting: Setting) -> Self:
        """Draw an effect of moderate size: every field within the range that it states."""
        return cls(*(uniform(rng, *f.metadata["drawn"]) for f in fields(cls)))

    def scaled(self, factor: float) -> Self:
        """Copy with every graded field multiplied by `factor`."""
        new: dict[str, Any] = {}
        for name in self.graded:
            value = getattr(self, name)
            new[name] = (
                tuple(factor * v for v in value) if isinstance(value, tuple) else factor * value
            )
        return replace(self, **new)

    def most(self) -> float:
        """Largest factor for :meth:`scaled` that is still physical."""
        return 1.0e6

    def to_dict(self) -> dict[str, Any]:
        """Fields in SI units."""
        return asdict(self)

    def active(self) -> bool:
        """Whether a graded field differs from zero."""
        values = [getattr(self, f.name) for f in fields(self) if f.name in self.graded]
        return any(any(v) if isinstance(v, tuple) else v for v in values)

    def start(self, at: Start) -> State:
        """Own states at the start of a recording."""
        return [0.0] * len(self.scales)

    def sizes(self) -> State:
        """Typical size of each own state, for the error control."""
        return list(self.scales)

    def tank(self, env: Env, first: int) -> Port:
        """``f(ps, m_in, y, d)``: added rate of the tank pressure [Pa/s]."""
        return None

    def shaper(self, env: Env) -> Port:
        """``f(x, t)``: changes the normalised command; may remember."""
        return None

    def delay(self) -> float:
        """Pure delay of the command [s]."""
        return 0.0

    def spool(self, env: Env, first: int) -> Port:
        """``f(x, y, d)``: opening of a spool with dynamics."""
        return None

    def gap(self, env: Env, first: int) -> Port:
        """``f(x, ps, p)``: leakage flows past the spool, tank to muscle and muscle to ambient
        [kg/s].
        """
        return None

    def line(self, env: Env) -> Port:
        """``f(m, p)``: pressure [Pa] at the valve port for a flow into the muscle [kg/s]."""
        return None

    def exhaust(self, env: Env) -> Port:
        """``f(m)``: pressure [Pa] behind the exhaust edge for a flow to ambient [kg/s]."""
        return None

    def leak(self, env: Env) -> Port:
        """``f(p, temperature)``: mass flow [kg/s] from the muscle to ambient."""
        return None

    def seal(self, env: Env) -> Port:
        """``f(p, angle)``: mass flow [kg/s] from the muscle to ambient that depends on the
        angle.
        """
        return None

    def swell(self, env: Env) -> Port:
        """``f(p, angle)``: factor on the rate of the muscle pressure."""
        return None

    def gear(self, env: Env) -> Port:
        """``f(angle, pg)``: angle [rad] at which the muscles are looked up, and the factor on their
        moment arm.
        """
        return None

    def lost_pressure(self, env: Env) -> Port:
        """``f(pg)``: gauge pressure [Pa] that makes no force."""
        return None

    def elastic(self, env: Env, first: int) -> Port:
        """``f(x, torque, y)``: added torque [N m] from the elastic torque at a contraction [m]."""
        return None

    def force(self, env: Env, first: int) -> Port:
        """``f(pg, x, v, y, d)``: force [N] of all muscles against contraction."""
        return None

    def torque(self, env: Env, first: int) -> Port:
        """``f(angle, rate, pg, y, d)``: added joint torque [N m]."""
        return None

    def load(self, env: Env) -> Port:
        """``f(t)``: added payload [kg]."""
        return None

    def motion(self, env: Env, first: int) -> Port:
        """``f(torque, angle, rate, inertia, weight, y, d)``: angular acceleration [rad/s2]."""
        return None

    def follow(self, env: Env, first: int) -> Port:
        """``f(p, d, y)``: derivatives of the states of a transducer."""
        return None

    def read(self, env: Env, first: int) -> Port:
        """``f(p, ps, angle, y)``: transducer values, gauge Pa and rad."""
        return None

    def warp(self) -> Port:
        """``f(t)``: by how much [s] the log of each channel (pressure, supply, angle) is late."""
        return None

    def tick(self, env: Env, first: int) -> Port:
        """``f(y)``: changes a state once per sample."""
        return None


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """One number, uniform in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """One uniform number."""
    return float(rng.uniform(low, high))


def either_sign(rng: np.random.Generator) -> float:
    """1 or -1, as likely."""
    return 1.0 if rng.random() < 0.5 else -1.0
