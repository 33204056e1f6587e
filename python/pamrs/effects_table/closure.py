"""Closures: what a located mismatch is a function of, where no entry of the catalogue explains it.

A closure is a sum of coefficients times terms of a fixed dictionary (``crates/pam-core/src/effects/closure_*.rs``). It enters rig
files, simulation and fits like an effect, and is never a name for the physics: ``catalogue`` is false, and the diagnosis gives it
no probability.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from pamrs.effects_table.entry import EffectInfo
from pamrs.effects_table.entry import EffectParameter as Parameter

__all__ = ["CLOSURES", "CLOSURE_OF", "MEMORY_OF", "TERMS", "WORDS", "Term", "Words"]


@dataclass(frozen=True, slots=True)
class Term:
    """One term of a closure's dictionary.

    Attributes
    ----------
    name : str
        Name of its coefficient.
    formula : str
        What the coefficient multiplies, in the symbols of the closure's equation.
    variables : tuple of str
        What it is a function of, in words.
    kind : str
        ``static`` (of where things are), ``odd`` or ``even`` (in the rate of the joint or in the opening of the valve, without memory),
        ``time`` (with a memory that fades in time) or ``distance`` (with one that fades over a way).
    """

    name: str
    formula: str
    variables: tuple[str, ...]
    kind: str


_A, _S, _W = "angle", "pressure", "rate"
_TORQUE = (
    Term("constant", "1", (), "static"),
    Term("angle", "a", (_A,), "static"),
    Term("angle_squared", "a^2", (_A,), "static"),
    Term("sine_4", "sin(4 a)", (_A,), "static"),
    Term("cosine_4", "cos(4 a)", (_A,), "static"),
    Term("sine_8", "sin(8 a)", (_A,), "static"),
    Term("cosine_8", "cos(8 a)", (_A,), "static"),
    Term("pressure", "s", (_S,), "static"),
    Term("pressure_squared", "s^2", (_S,), "static"),
    Term("pressure_angle", "s a", (_S, _A), "static"),
    Term("pressure_angle_squared", "s a^2", (_S, _A), "static"),
    Term("rate", "w", (_W,), "odd"),
    Term("angle_rate", "a w", (_A, _W), "odd"),
    Term("rate_quadratic", "w |w|", (_W,), "odd"),
    Term("pressure_rate", "s w", (_S, _W), "odd"),
    Term("sign", "sgn(w)", ("direction of motion",), "odd"),
    Term("pressure_sign", "s sgn(w)", (_S, "direction of motion"), "odd"),
    Term("creep", "(a - a_T)", ("past angle",), "time"),
    Term("pressure_creep", "s (a - a_T)", (_S, "past angle"), "time"),
    Term("pressure_memory", "(s - s_T)", ("past pressure",), "time"),
    Term("slip", "q", ("past motion",), "distance"),
    Term("pressure_slip", "s q", (_S, "past motion"), "distance"),
)
_P, _X, _PS = "pressure", "valve opening", "supply pressure"
_FLOW = (
    Term("constant", "1", (), "static"),
    Term("pressure", "p", (_P,), "static"),
    Term("pressure_squared", "p^2", (_P,), "static"),
    Term("opening", "x", (_X,), "odd"),
    Term("abs_opening", "|x|", (_X,), "even"),
    Term("opening_pressure", "x p", (_X, _P), "odd"),
    Term("abs_opening_pressure", "|x| p", (_X, _P), "even"),
    Term("filling", "x+ (ps - p)", (_X, _PS, _P), "odd"),
    Term("sign_filling", "sgn(x+) ps", ("side to which the valve is open", _PS), "odd"),
    Term("sign_venting", "sgn(x-) p", ("side to which the valve is open", _P), "odd"),
    Term("at_null", "n", ("valve opening around its null",), "even"),
    Term("supply_difference", "(ps - p)", (_PS, _P), "static"),
    Term("volume_rate", "p V'", (_P, "rate of the volume"), "odd"),
    Term("pressure_memory", "(p - p_T)", ("past pressure",), "time"),
    Term("opening_memory", "(x - x_T)", ("past valve opening",), "time"),
    Term("opening_memory_pressure", "(x - x_T) p", ("past valve opening", _P), "time"),
)
_SUPPLY = (
    Term("constant", "1", (), "static"),
    Term("pressure", "p", (_PS,), "static"),
    Term("opening", "x+", (_X,), "even"),
    Term("filling", "x+ p", (_X, _PS), "even"),
    Term("pressure_memory", "(p - p_T)", ("past supply pressure",), "time"),
)
TERMS: Final[dict[str, tuple[Term, ...]]] = {"closure_torque": _TORQUE, "closure_flow": _FLOW, "closure_supply": _SUPPLY}
"""Terms of each closure, in the order of its parameters; behind them stand the shapes of its memories."""
CLOSURE_OF: Final[dict[str, str]] = {"supply": "closure_supply", "chamber": "closure_flow", "arm": "closure_torque"}
"""Closure of each block of the cut chain."""
@dataclass(frozen=True, slots=True)
class Words:
    """How a closure is put into words.

    Attributes
    ----------
    what, letter : str
        What it is the sum of, and the letter for it.
    symbols : str
        What the symbols of its terms stand for.
    odd_in : str
        What its odd terms turn their sign with.
    """

    what: str
    letter: str
    symbols: str
    odd_in: str


WORDS: Final[dict[str, Words]] = {
    "closure_torque": Words(
        "torque", "tau", "s: gauge pressure in bar, a: angle in rad, w: rate in rad/s", "the direction of motion"
    ),
    "closure_flow": Words(
        "flow into the chamber",
        "m",
        "p, ps: absolute pressures of chamber and supply in bar, x: valve opening, -1 to 1, V': rate of the volume in l/s",
        "the way in which the valve opens",
    ),
    "closure_supply": Words(
        "flow into the supply", "m", "p: absolute supply pressure in bar, x+: opening of the filling valve", "the valve"
    ),
}
"""Words of each closure."""
MEMORY_OF: Final[dict[str, str]] = {"time": "memory_time", "distance": "memory_angle"}
"""Shape that a term of a kind with memory depends on."""


def _coefficients(closure: str, unit: str, bound: float, start: float) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(term.name, unit, 0.0, -bound, bound, (-start, start), f"coefficient of {term.formula}", 0.0)
        for term in TERMS[closure]
    )


_TIME = Parameter("memory_time", "s", 1.0, 0.01, 1e6, (0.1, 0.5, 2.0, 8.0), "over which the terms with memory forget (T)")
_PLACEHOLDER = "the terms that a diagnosis finds, and their sizes, say what it looks like"
_SPARSE = "Brunton, Proctor & Kutz (2016), sparse dictionaries"
CLOSURES: Final[tuple[EffectInfo, ...]] = (
    EffectInfo(
        id="closure_supply",
        name="missing flow into the supply, as a sum of terms",
        block="supply",
        at="supply",
        equation="m = sum c_k t_k(p [bar abs], x+, memory); p_T' = (p - p_T)/T",
        fingerprint=_PLACEHOLDER,
        separates="an effect of the catalogue needs fewer numbers for the same mismatch",
        parameters=(*_coefficients("closure_supply", "kg/s", 1e6, 1e-4), _TIME),
        reference=_SPARSE,
        catalogue=False,
    ),
    EffectInfo(
        id="closure_flow",
        name="missing flow into the chamber, as a sum of terms",
        block="chamber",
        at="chamber",
        equation=(
            "m = sum c_k t_k(p, ps [bar abs], x, V' [l/s], memory); x+ = max(x, 0), x- = max(-x, 0), "
            "n = exp(-(x/0.05)^2/2), sgn(x) = tanh(x/0.01); "
            "p_T' = (p - p_T)/T, x_T' = (x - x_T)/T"
        ),
        fingerprint=_PLACEHOLDER,
        separates="an effect of the catalogue needs fewer numbers for the same mismatch",
        parameters=(*_coefficients("closure_flow", "kg/s", 1e6, 1e-5), _TIME),
        reference=_SPARSE,
        catalogue=False,
    ),
    EffectInfo(
        id="closure_torque",
        name="missing torque, as a sum of terms",
        block="joint",
        at="joint",
        equation=(
            "tau = sum c_k t_k(s [bar gauge, mean of the joint's muscles], a [rad], w [rad/s], memory); sgn(w) = tanh(w/0.02); "
            "a_T' = (a - a_T)/T, s_T' = (s - s_T)/T, q' = w/d (1 - q sgn w)"
        ),
        fingerprint=_PLACEHOLDER,
        separates="an effect of the catalogue needs fewer numbers for the same mismatch",
        parameters=(
            *_coefficients("closure_torque", "N m", 1e9, 1.0),
            _TIME,
            Parameter("memory_angle", "rad", 0.1, 0.01, 10.0, (0.02, 0.05, 0.15, 0.4), "over which the slip forgets (d)"),
        ),
        reference=f"{_SPARSE}; Dahl (1968), solid friction",
        catalogue=False,
    ),
)
"""In the order of the chain."""
