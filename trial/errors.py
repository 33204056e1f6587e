"""Model error that one lives with: smooth random curves in every block, of no family of effects.

Of 1 percent: a percent of the force, of the moment arm, of the valve's area, of the temperature in
chamber and tank; 0.1 deg (0.1 mm) of the encoder, 0.3 kPa of the pressure transducer, half a
percent of the weight's torque as cogging. Each has a length scale of its own.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import numpy as np

from .effects.base import Effect, Env, Port, State
from .pair.places import SIDES, Placed, has_place
from .rig_kinds import PAIR, RigKind


@dataclass(frozen=True)
class Curve:
    """Sum of cosines of a quantity: amplitudes, wave numbers [1/unit], phases [rad]."""

    size: tuple[float, ...]
    wave: tuple[float, ...]
    phase: tuple[float, ...]

    @classmethod
    def draw(cls, rng: np.random.Generator, rms: float, scale: float, count: int = 6) -> Curve:
        """A curve of a root mean square `rms` whose bumps are some `scale` long."""
        wave = rng.uniform(0.3, 1.7, count) * math.pi / scale
        size = rng.uniform(0.5, 1.5, count)
        size *= rms * math.sqrt(2.0 / float((size**2).sum()))
        phase = rng.uniform(0.0, 2.0 * math.pi, count)
        return cls(tuple(size.tolist()), tuple(wave.tolist()), tuple(phase.tolist()))

    def at(self, x: float) -> float:
        """Value at a place."""
        cos = math.cos
        return sum(
            a * cos(k * x + f) for a, k, f in zip(self.size, self.wave, self.phase, strict=True)
        )

    def scaled(self, factor: float) -> Curve:
        """The same curve, as many times as high."""
        return Curve(tuple(factor * a for a in self.size), self.wave, self.phase)


@dataclass(frozen=True)
class ModelError(Effect):
    """Base: one curve, its root mean square `rms` and the unit of that."""

    graded: ClassVar[tuple[str, ...]] = ("rms",)
    unit: ClassVar[str] = "1"
    curve: Curve
    rms: float

    def to_dict(self) -> dict[str, Any]:
        return {"rms": self.rms, "unit": self.unit, "curve": asdict(self.curve)}


@dataclass(frozen=True)
class ForceError(ModelError):
    """Share of the muscles' force, over their contraction [m]."""

    id: ClassVar[str] = "model_error.muscle"
    block: ClassVar[str] = "muscle"

    def force(self, env: Env, first: int) -> Port:
        pull, at = env.tables.pull, self.curve.at

        def resist(pg: float, x: float, v: float, y: State, d: State) -> float:
            return -pull(y[2], pg)[0] * at(x) if pg > 0.0 else 0.0

        return resist


@dataclass(frozen=True)
class ArmError(ModelError):
    """Share of the moment arm, over the angle [rad]: the muscles see another angle."""

    id: ClassVar[str] = "model_error.transmission"
    block: ClassVar[str] = "joint"

    def gear(self, env: Env) -> Port:
        rows = list(zip(self.curve.size, self.curve.wave, self.curve.phase, strict=True))

        def seen(angle: float, pg: float) -> tuple[float, float]:
            shift = sum(a / k * math.sin(k * angle + f) for a, k, f in rows)
            return angle + shift, 1.0 + self.curve.at(angle)

        return seen


@dataclass(frozen=True)
class ValveError(ModelError):
    """Share of the valve's area, over the opening."""

    id: ClassVar[str] = "model_error.valve"
    block: ClassVar[str] = "valve"

    def shaper(self, env: Env) -> Port:
        return lambda x, t: x * (1.0 + self.curve.at(x))


@dataclass(frozen=True)
class NozzleError(ModelError):
    """Share of what a nozzle and the volume behind it do to the pressure, over it [bar]."""

    id: ClassVar[str] = "model_error.chamber"
    block: ClassVar[str] = "chamber"

    def swell(self, env: Env) -> Port:
        return lambda p, angle: 1.0 + self.curve.at(p * 1.0e-5)


@dataclass(frozen=True)
class TankError(ModelError):
    """Share of the tank's temperature, over its pressure [bar]."""

    id: ClassVar[str] = "model_error.supply"
    block: ClassVar[str] = "supply"

    def tank(self, env: Env, first: int) -> Port:
        gain = env.par.gas_constant * env.par.temperature / env.par.supply_volume
        return lambda ps, m_in, y, d: -gain * m_in * self.curve.at(ps * 1.0e-5)


@dataclass(frozen=True)
class GaugeError(ModelError):
    """Linearity of the pressure transducer [Pa], over the pressure [bar]."""

    id: ClassVar[str] = "model_error.muscle_pressure"
    block: ClassVar[str] = "sensors"
    unit: ClassVar[str] = "Pa"

    def read(self, env: Env, first: int) -> Port:
        return lambda p, ps, angle, y: (p + self.curve.at(p * 1.0e-5), ps, angle)


@dataclass(frozen=True)
class EncoderError(ModelError):
    """Error of the angle [rad] or shortening [m], periodic in it."""

    id: ClassVar[str] = "model_error.joint_angle"
    block: ClassVar[str] = "joint"
    unit: ClassVar[str] = "rad or m"

    def read(self, env: Env, first: int) -> Port:
        return lambda p, ps, angle, y: (p, ps, angle + self.curve.at(angle))


@dataclass(frozen=True)
class Cogging(ModelError):
    """Torque [N m] or force [N] that comes and goes with the angle [rad] or shortening [m]."""

    id: ClassVar[str] = "model_error.arm"
    block: ClassVar[str] = "arm"
    unit: ClassVar[str] = "N m or N"

    def torque(self, env: Env, first: int) -> Port:
        return lambda angle, rate, pg, y, d: self.curve.at(angle)


KINDS: tuple[type[ModelError], ...] = (
    ForceError,
    ArmError,
    ValveError,
    NozzleError,
    TankError,
    GaugeError,
    EncoderError,
    Cogging,
)


def model_errors(
    rig: RigKind, percent: float, weight: float, rng: np.random.Generator, gear: bool = True
) -> list[ModelError]:
    """The model error of a rig of so many percent; the weight's torque [N m] or the weight [N].

    Everything is drawn whatever is taken, so that a rig or an effect changes no other curve.
    Without `gear` the moment arm is left as it is: an effect changes it already.
    """
    lifts, air = rig.name == "hanging_mass", rig.name in ("chamber", "blow_down")
    share = 0.01 * percent
    span = 0.05 if lifts else 1.4
    table: tuple[tuple[type[ModelError], float, float], ...] = (
        (ForceError, share, 0.012),
        (ArmError, share, 0.35 * span),
        (ValveError, share, 0.15),
        (NozzleError, share, 1.0),
        (TankError, share, 0.7),
        (GaugeError, 300.0 * percent, 1.0),
        (EncoderError, percent * (1.0e-4 if lifts else math.radians(0.1)), 0.2 * span),
        (Cogging, 0.5 * share * weight, 0.08 * span),
    )
    missing: set[type[ModelError]] = {ArmError} if lifts or not gear else set()
    if air:
        missing |= {ForceError, ArmError, EncoderError, Cogging}
    if rig.name in ("blow_down", "regulated_joint"):
        missing |= {ValveError, TankError}
    made = [kind(Curve.draw(rng, rms, scale), rms) for kind, rms, scale in table]
    return [e for e in made if type(e) not in missing and e.rms > 0.0]


def pair_errors(
    rig: RigKind, percent: float, weight: float, rng: np.random.Generator, gear: bool = True
) -> list[Placed]:
    """The model error of a pair: curves of its own at either side, and those of what they share."""
    found = [
        Placed(error, side)
        for side in SIDES
        for error in model_errors(rig, percent, weight, rng, gear)
        if has_place(error.id, error.block)
    ]
    shared = model_errors(rig, percent, weight, rng, gear)
    return [*found, *(Placed(error) for error in shared if not has_place(error.id, error.block))]


def stated_lines(rig: RigKind, errors: list[Any], percent: float) -> str:
    """The model error as a rig file states it; empty where there is none. Of a pair one line says
    it of both sides.
    """
    lifts = rig.name == "hanging_mass"
    gear = "transmission" if rig.name == PAIR else "joint"
    lines: dict[str, None] = {}
    for placed in errors:
        error: Any = placed.effect if isinstance(placed, Placed) else placed
        name = error.id.split(".")[1]
        if isinstance(error, Cogging):
            lines[f'{"load" if lifts else "arm"} = "{0.5 * percent:g} %"'] = None
        elif isinstance(error, EncoderError):
            size = f"{1e3 * error.rms:g} mm" if lifts else f"{math.degrees(error.rms):g} deg"
            lines[f'{"length" if lifts else "joint_angle"} = "{size}"'] = None
        elif error.unit == "1":
            block = gear if isinstance(error, ArmError) else name
            lines[f'{block} = "{100.0 * error.rms:g} %"'] = None
        else:
            lines[f'{name} = "{error.rms:g} {error.unit}"'] = None
    return "\n\n[model_error]\n" + "\n".join(lines) + "\n" if lines else ""
