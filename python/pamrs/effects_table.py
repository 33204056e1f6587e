"""The catalogue of omitted physics: id, block, equation, parameters, fingerprint and rivals of each effect.

The equations run in the core (``crates/pam-core/src/effects``); a test holds both lists together.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["EFFECTS", "EffectInfo", "EffectParameter", "find_parameter"]


@dataclass(frozen=True, slots=True)
class EffectParameter:
    """One parameter of an effect, in SI units.

    Attributes
    ----------
    name, unit : str
        Name and SI unit.
    default : float
        A typical value.
    lower, upper : float
        Bounds of the possible.
    starts : tuple of float
        Values from which a fit starts, small to large.
    meaning : str
        What it is.
    role : str
        What it is to a fit: ``size`` (scales the effect), ``shape`` (tried from each of its starts, then fitted), ``choice`` (its
        lower or its upper bound), ``start`` (a size that only a sealed hold can tell) or ``held`` (left at its default).
    """

    name: str
    unit: str
    default: float
    lower: float
    upper: float
    starts: tuple[float, ...]
    meaning: str
    role: str = "size"


@dataclass(frozen=True, slots=True)
class EffectInfo:
    """One effect of the catalogue.

    Attributes
    ----------
    id, name, block : str
        Public identifier, words, and the block in which it acts.
    equation, fingerprint, separates : str
        Governing equation; what it looks like in recordings; what it is confused with and what separates them.
    parameters : tuple of EffectParameter
        Its parameters.
    reference : str
        Where it comes from.
    """

    id: str
    name: str
    block: str
    equation: str
    fingerprint: str
    separates: str
    parameters: tuple[EffectParameter, ...]
    reference: str

    def dotted(self) -> tuple[str, ...]:
        """Dotted names of the parameters, ``leak_muscle.conductance``."""
        return tuple(f"{self.id}.{parameter.name}" for parameter in self.parameters)


def find_parameter(name: str) -> EffectParameter:
    """The parameter of a dotted name such as ``leak_muscle.conductance``; KeyError if there is none."""
    effect, _, short = name.partition(".")
    return {parameter.name: parameter for parameter in EFFECTS[effect].parameters}[short]


def _table(*effects: EffectInfo) -> dict[str, EffectInfo]:
    return {effect.id: effect for effect in effects}


EFFECTS: Final[dict[str, EffectInfo]] = _table(
    EffectInfo(
        id="leak_muscle",
        name="leak of the muscle, a fitting or a hose",
        block="chamber",
        equation="m_leak = C rho0 [(1-s) p psi(pa/p)/psi(0) + s (p^2 - pa^2)/p_ref], lost at all times",
        fingerprint="pressure falls with the valve shut, in proportion to the absolute pressure, without end",
        separates="heat_transfer saturates within seconds after a fill; a valve null offset changes sign with the spool",
        parameters=(
            EffectParameter("conductance", "m3/(s Pa)", 5e-12, 0.0, 1e-7, (1e-11,), "sonic conductance of the leak (ISO 6358)"),
            EffectParameter(
                "laminar_share",
                "1",
                0.0,
                0.0,
                1.0,
                (0.3,),
                "0 for a hole (orifice), 1 for a porous wall or thin crack (laminar, referred to 500 kPa absolute)",
                "choice",
            ),
        ),
        reference="Beater, Pneumatic Drives (2007); ISO 6358",
    ),
    EffectInfo(
        id="heat_transfer",
        name="gas temperature with heat exchange at the wall",
        block="chamber",
        equation="p' = (k R/V)(m_in Ts - m_out T) - k p V'/V + ((k-1)/V) h A (Tw - T), h = h0 sqrt(p T/(p0 T0))",
        fingerprint="after a fast fill and a shut valve the pressure falls for 0.1 to 2 s, then stays; after venting it rises",
        separates="leak_muscle never saturates; wrong polytropic coefficients show no relaxation with the valve shut",
        parameters=(
            EffectParameter(
                "heat_transfer_coefficient",
                "W/(m2 K)",
                50.0,
                1.0,
                1e4,
                (20.0, 120.0),
                "coefficient at 1 bar and rest temperature",
                "shape",
            ),
            EffectParameter(
                "initial_temperature_rise",
                "K",
                0.0,
                0.0,
                200.0,
                (5.0,),
                "gas above wall temperature where a recording begins (just after a fill)",
                "start",
            ),
        ),
        reference="Carneiro & de Almeida (2006); Al-Ibrahim & Otis (1992)",
    ),
    EffectInfo(
        id="muscle_hysteresis",
        name="rate-independent friction of the braid (pressure-scaled Maxwell-slip)",
        block="muscle",
        equation="F_h = (W0 + c pg) mean(clip(z_i)), z_i' = L'/d_i until |z_i| = 1; four elements, d/8 to d",
        fingerprint="less pull while contracting, more while extending; the loop does not depend on speed; after a "
        "reversal the force changes over a finite distance",
        separates="joint Coulomb friction has neither presliding nor growth with pressure; creep depends on time",
        parameters=(
            EffectParameter("friction_constant", "N", 5.0, 0.0, 1e4, (2.0,), "half width of one muscle's loop at zero pressure"),
            EffectParameter("friction_pressure", "m2", 5e-5, 0.0, 1.0, (2e-5,), "growth of the half width with gauge pressure"),
            EffectParameter(
                "presliding", "m", 1e-3, 1e-6, 0.1, (5e-4, 3e-3), "distance over which the loop closes after a reversal", "shape"
            ),
        ),
        reference="Vo-Minh et al. (2011); Al-Bender, Lampaert & Swevers (2005); Robinson (2014) (2.36) as a special case",
    ),
)
