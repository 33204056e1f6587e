"""A fitted closure in words: where, of which variables, even or odd, with which memory, how large,
and its form with numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pamrs.diagnosis.fit import Fit, Problem
from pamrs.diagnosis.prepare import Block, begun
from pamrs.effects import CLOSURE_OF, EFFECTS, MEMORY_OF, TERMS, WORDS, Term
from pamrs.errors import DiagnosisError
from pamrs.rig import Rig
from pamrs.simulation import core_rig, default_step

__all__ = ["describe_closure"]

_SPOKEN_SHARE = 0.05  # share of the form from which a kind of dependence is put into words


Array = NDArray[np.float64]

_UNITS = {  # factors and units in which sizes are told
    "N m": ((1.0, "N m"),),
    "kg/s": ((1.0, "kg/s"), (1e-3, "g/s"), (1e-6, "mg/s"), (1e-9, "ug/s")),
}


def describe_closure(found: Fit, problem: Problem, baseline: Fit) -> str:
    """Say in words what a fitted closure is a function of.

    A sentence or two for each block: how large the missing quantity is over the recordings
    (effective value and the 99th percentile of its size), how much of the block's mismatch it
    takes, of which variables, which shares are even and odd, instantaneous or with memory, and the
    form with its numbers and standard deviations. The share of a kind is its inner product with the
    whole over that of the whole with itself, so that shares sum to one even where terms cancel.

    Parameters
    ----------
    found : Fit
        What :func:`pamrs.diagnosis.search.find_closure` returned.
    problem : Problem
        The same problem.
    baseline : Fit
        The fit without the closure.

    Returns
    -------
    str
        Plain text, one paragraph for each block.

    Raises
    ------
    DiagnosisError
        If the fit has no closure.
    """
    if not set(found.effects) & set(TERMS):
        raise DiagnosisError(
            f"found.effects = {found.effects} is not allowed: one of {', '.join(TERMS)} is needed"
        )
    blocks = [b for b in problem.blocks if b.closure in found.effects]
    return "\n".join(_sentence(found, problem, baseline, block) for block in blocks)


def _sentence(found: Fit, problem: Problem, baseline: Fit, block: Block) -> str:
    closure = CLOSURE_OF[block.kind]
    told = WORDS[closure]
    parts = _parts(found, problem, block, closure)
    used = {term.name: term for term in TERMS[closure] if f"{closure}.{term.name}" in found.values}
    whole = np.sum([parts[name] for name in used], axis=0)
    power = float(whole @ whole)
    effective = math.sqrt(power / max(1, whole.size))
    size, unit = _readable(effective, EFFECTS[closure].parameters[0].unit)
    largest = float(np.quantile(np.abs(whole), 0.99)) / size if whole.size else 0.0
    shares = {
        k: sum(float(parts[n] @ whole) for n, t in used.items() if t.kind == k) / power
        if power
        else 0.0
        for k in _KINDS
    }
    variables = list(dict.fromkeys(v for term in used.values() for v in term.variables)) or [
        "nothing: it is constant"
    ]
    shape = {
        kind: found.rig.effects[_index(found.rig, closure)]["parameters"].get(name)
        for kind, name in MEMORY_OF.items()
    }
    words = [
        _kind_in_words(kind, closure, share, shape)
        for kind, share in shares.items()
        if _present(kind, used) and abs(share) > _SPOKEN_SHARE
    ]
    taken = _percent(_taken(found, baseline, problem, block))
    return (
        f"In the block {block.name} ({block.covers}) a {told.what} is missing, "
        f"{effective / size:.3g} {unit} effective (99 % below {largest:.3g} {unit}); it takes "
        f"{taken} of the mismatch there. It is a function of {_listed(variables)}: "
        f"{_listed(words)}. {told.letter} = {_formula(found, closure, used, size)} {unit} "
        f"({told.symbols}{_legend(used, shape)})."
    )


_KINDS = ("static", "even", "odd", "time", "distance")


def _parts(found: Fit, problem: Problem, block: Block, closure: str) -> dict[str, Array]:
    """Each term times its coefficient over all usable rows, along the measured signals."""
    core = core_rig(found.rig, problem.core)
    rows = []
    for prepared in problem.recordings:
        starts = prepared.starts(block.window, block.drives)
        terms = core.closure_terms(
            block.name,
            prepared.driving(mechanical=block.mechanical),
            prepared.dt,
            default_step(prepared.dt, longest=block.step),
            starts,
            begun(block, prepared, starts),
            prepared.n,
        )
        rows.append(terms[found.residuals[block.name, prepared.recording.name].rows])
    every = np.concatenate(rows)
    return {
        t.name: every[:, k] * found.values.get(f"{closure}.{t.name}", 0.0)
        for k, t in enumerate(TERMS[closure])
    }


def _taken(found: Fit, baseline: Fit, problem: Problem, block: Block) -> float:
    """Share of a block's squared residual beyond its sample noise that the closure removes."""
    left = []
    for model in (baseline, found):
        pairs = [model.residuals[block.name, p.recording.name] for p in problem.recordings]
        left.append(
            sum(
                float(((r.value[r.rows] / r.noise) ** 2).sum()) - float(r.rows.sum()) for r in pairs
            )
        )
    return 1.0 - max(0.0, left[1]) / left[0] if left[0] > 0.0 else 0.0


def _index(rig: Rig, closure: str) -> int:
    return next(k for k, effect in enumerate(rig.effects) if effect["id"] == closure)


def _present(kind: str, used: dict[str, Term]) -> bool:
    return any(term.kind == kind for term in used.values())


def _kind_in_words(kind: str, closure: str, share: float, shape: dict[str, float | None]) -> str:
    if kind == "static":
        return (
            f"{_percent(share)} of it depends on where things are, not on how they move (even, "
            "without memory)"
        )
    if kind == "even":
        return (
            f"{_percent(share)} is the same for either sign of the opening (even, without memory)"
        )
    if kind == "odd":
        return (
            f"{_percent(share)} turns its sign with {WORDS[closure].odd_in} (odd, without memory)"
        )
    if kind == "time":
        return f"{_percent(share)} remembers and forgets in {shape['time']:.3g} s (rate dependent)"
    way = f"{shape['distance']:.3g} rad"
    return (
        f"{_percent(share)} remembers the way and forgets over {way} of it at any speed (rate "
        "independent, hysteresis)"
    )


def _readable(size: float, unit: str) -> tuple[float, str]:
    """Scale and unit in which a size in SI is a handy number."""
    for scale, name in _UNITS[unit]:
        if size >= scale:
            return scale, name
    return _UNITS[unit][-1] if len(_UNITS[unit]) > 1 else _UNITS[unit][0]


def _formula(found: Fit, closure: str, used: dict[str, Term], size: float) -> str:
    text = ""
    for name, term in used.items():
        value, std = found.values[f"{closure}.{name}"] / size, found.std[f"{closure}.{name}"] / size
        number = f"{_number(abs(value))}(+-{_number(std)})" + (
            "" if term.formula == "1" else f" {term.formula}"
        )
        sign = "-" if value < 0.0 else "+"
        text += f" {sign} {number}" if text else (f"-{number}" if value < 0.0 else number)
    return text


def _number(value: float) -> str:
    """Three digits, and no power of ten where a person can do without."""
    return f"{value:.0f}" if 999.5 <= value < 1e6 else f"{value:.3g}"


def _legend(used: dict[str, Term], shape: dict[str, float | None]) -> str:
    formulas = " ".join(term.formula for term in used.values())
    notes = ""
    if "_T" in formulas:
        notes += f"; index T: what it was over the past T = {shape['time']:.3g} s"
    if _present("distance", used):
        notes += f"; q' = w/d (1 - q sgn w), d = {shape['distance']:.3g} rad"
    if "at_null" in used:
        notes += "; n = exp(-(x/0.05)^2/2)"
    if "sgn(" in formulas:
        notes += (
            "; sgn: tanh(w/0.02)"
            if "sgn(w)" in formulas
            else "; sgn: tanh(x/0.01), of fills x+ and vents x- each"
        )
    return notes


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def _listed(words: Sequence[str]) -> str:
    """Words with commas, the last with ``and``."""
    return (
        words[0]
        if len(words) == 1
        else f"{', '.join(words[:-1])} and {words[-1]}"
        if words
        else "nothing"
    )
