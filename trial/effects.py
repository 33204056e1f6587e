"""The effects that a case can conceal, with forms that differ from the usual catalogue entries."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

LISTED = ("leak_muscle", "heat_transfer", "muscle_hysteresis")
UNLISTED = ("muscle_creep", "valve_dead_zone", "input_path_lag", "pressure_lag")
KINDS = ("none", "parameters", *LISTED, *UNLISTED)
AIR_CONSTANT = 287.05
REFERENCE_DENSITY = 1.185
REFERENCE_TEMPERATURE = 293.15


@dataclass(frozen=True)
class Leak:
    """Leak of the muscles to ambient.

    `form` is "orifice" (ISO 6358 with `ratio` b: ``C rho0 p sqrt(T0/T) psi``) or "laminar"
    (``k (p^2 - pa^2)``); `coefficient` is C [m3/(s Pa)] or k [kg/(s Pa2)].
    """

    form: str
    coefficient: float
    ratio: float = 0.3

    def flow(self, pressure: float, ambient: float, temperature: float) -> float:
        """Mass flow [kg/s] out of the muscle at an absolute pressure [Pa]; negative when the muscle sucks."""
        if self.form == "laminar":
            return self.coefficient * (pressure * pressure - ambient * ambient)
        up, down, sign = (pressure, ambient, 1.0) if pressure >= ambient else (ambient, pressure, -1.0)
        r = down / up
        if r <= self.ratio:
            psi = 1.0
        elif r > 0.999:
            knee = (0.999 - self.ratio) / (1.0 - self.ratio)
            psi = math.sqrt(1.0 - knee * knee) * (1.0 - r) / 0.001
        else:
            knee = (r - self.ratio) / (1.0 - self.ratio)
            psi = math.sqrt(1.0 - knee * knee)
        return sign * self.coefficient * REFERENCE_DENSITY * up * math.sqrt(REFERENCE_TEMPERATURE / temperature) * psi


@dataclass(frozen=True)
class HeatTransfer:
    """Energy balance of the gas, wall exchange ``h = h0 sqrt(p T / (pa T0))`` [W/(m2 K)] in the muscles."""

    coefficient: float


@dataclass(frozen=True)
class Hysteresis:
    """Friction of the braid, scaled by ``gauge pressure / reference_pressure``.

    `form` "bouc_wen": one state ``z' = x'/d (1 - |z|^n (beta sgn(x' z) + 1 - beta))``; "dahl_bank": many
    states ``z_i' = x'/d_i (1 - sgn(x') z_i)``, a smooth Maxwell-slip bank. `friction` [N] and `distance` [m]
    have one entry per state; x is the contraction.
    """

    form: str
    friction: tuple[float, ...]
    distance: tuple[float, ...]
    reference_pressure: float
    exponent: float = 1.0
    beta: float = 0.6


@dataclass(frozen=True)
class Creep:
    """Standard linear solid with several branches: stiffness [N/m] of all muscles, time constants [s]."""

    stiffness: tuple[float, ...]
    time_constant: tuple[float, ...]


@dataclass(frozen=True)
class DeadZone:
    """Overlap of the spool: normalised widths of both edges, and the clearance that rounds the corner."""

    supply: float
    exhaust: float
    clearance: float

    def opening(self, x: float) -> float:
        """Effective opening, -1..1, of a normalised spool command."""
        width = self.supply if x > 0.0 else self.exhaust
        s = abs(x) - width
        soft = 0.5 * (s + math.sqrt(s * s + self.clearance**2))
        shut = 0.5 * (-width + math.sqrt(width * width + self.clearance**2))
        full = 0.5 * (1.0 - width + math.sqrt((1.0 - width) ** 2 + self.clearance**2))
        return math.copysign((soft - shut) / (full - shut), x)


@dataclass(frozen=True)
class InputLag:
    """Pure delay [s] and first-order lag [s] between the command and the valve opening."""

    delay: float
    lag: float


@dataclass(frozen=True)
class PressureLag:
    """First-order lag [s] of the muscle pressure signal."""

    lag: float


@dataclass(frozen=True)
class Effects:
    """All effects of one plant; None means absent."""

    leak_muscle: Leak | None = None
    heat_transfer: HeatTransfer | None = None
    muscle_hysteresis: Hysteresis | None = None
    muscle_creep: Creep | None = None
    valve_dead_zone: DeadZone | None = None
    input_path_lag: InputLag | None = None
    pressure_lag: PressureLag | None = None

    def to_dict(self) -> dict[str, Any]:
        """Parameters of the effects that are present, by effect id."""
        return {k: v for k, v in asdict(self).items() if v is not None}


def draw(kind: str, strength: float, rng: np.random.Generator) -> Any:
    """Draw one effect of typical size.

    Parameters
    ----------
    kind : str
        One of the effect ids.
    strength : float
        1 is typical; the main coefficient is multiplied by it.
    rng : numpy.random.Generator
        Source of the numbers.

    Raises
    ------
    ValueError
        Unknown kind, or a strength that is not positive.
    """
    if not strength > 0.0:
        raise ValueError(f"strength must be positive, got {strength!r}")
    spread = float(rng.uniform(0.75, 1.3))
    size = strength * spread
    if kind == "leak_muscle":
        # sealed time constant of about 150 s: V / (tau * rho0 R T0) with V about 1.5e-3 m3
        conductance = 1.5e-3 / (150.0 * REFERENCE_DENSITY * AIR_CONSTANT * REFERENCE_TEMPERATURE) * size
        if rng.random() < 0.5:
            return Leak("orifice", conductance)
        typical = 3.2e5
        return Leak("laminar", conductance * REFERENCE_DENSITY * typical / (typical**2 - 101325.0**2))
    if kind == "heat_transfer":
        return HeatTransfer(float(rng.uniform(25.0, 60.0)) * strength)
    if kind == "muscle_hysteresis":
        reference = 4.0e5
        total = 0.02 * 6.0 * 5.0e3 * size  # 1.5 to 2.6 % of the blocked force at the reference pressure
        if rng.random() < 0.5:
            d = float(rng.uniform(0.8e-3, 2.0e-3))
            return Hysteresis(
                "bouc_wen",
                (total,),
                (d,),
                reference,
                float(rng.uniform(1.0, 1.6)),
                float(rng.uniform(0.5, 0.7)),
            )
        distances = np.geomspace(0.15e-3, 6.0e-3, 8)
        weights = rng.uniform(0.6, 1.4, 8)
        weights *= total / weights.sum()
        return Hysteresis("dahl_bank", tuple(weights.tolist()), tuple(distances.tolist()), reference)
    if kind == "muscle_creep":
        slow, quick = float(rng.uniform(20.0, 60.0)), float(rng.uniform(2.0, 5.0))
        return Creep((1.6e3 * size, 1.2e3 * size), (quick, slow))
    if kind == "valve_dead_zone":
        one, two = (float(v) for v in rng.uniform(0.02, 0.04, 2))
        return DeadZone(min(one * strength, 0.3), min(two * strength, 0.3), 0.003)
    if kind == "input_path_lag":
        return InputLag(float(rng.uniform(8.0e-3, 14.0e-3)) * strength, float(rng.uniform(6.0e-3, 10.0e-3)) * strength)
    if kind == "pressure_lag":
        return PressureLag(float(rng.uniform(20.0e-3, 35.0e-3)) * strength)
    raise ValueError(f"unknown effect {kind!r}; known: {', '.join((*LISTED, *UNLISTED))}")
