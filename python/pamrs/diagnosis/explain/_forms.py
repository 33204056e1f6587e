"""A fitted closure as numbers: where it acts, how large it is, what it depends on, with which
memory; and that in a sentence.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pamrs._arrays import Array
from pamrs.diagnosis.fit import Fit, Problem
from pamrs.diagnosis.prepare import Block, signals_at_starts
from pamrs.effects import CLOSURE_OF, CLOSURE_TERMS, EFFECTS, MEMORY_OF, WORDS, ClosureTerm
from pamrs.errors import DiagnosisError
from pamrs.findings import Form
from pamrs.report.words import listed
from pamrs.simulation import core_rig, default_step


def forms_of(found: Fit, problem: Problem, baseline: Fit) -> list[Form]:
    """Dependence of a fitted closure on its variables, by block.

    The share of a kind of dependence is its inner product with the whole over that of the whole
    with itself, so that shares sum to one even where terms cancel.

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
    list of Form
        One for each block; :func:`pamrs.diagnosis.explain._forms.form_sentence` says it.

    Raises
    ------
    DiagnosisError
        If the fit has no closure.
    """
    ids = [effect.id for effect in found.effects]
    if not set(ids) & set(CLOSURE_TERMS):
        raise DiagnosisError(
            f"found.effects = {ids} is not allowed: one of {', '.join(CLOSURE_TERMS)} is needed"
        )
    blocks = [b for b in problem.blocks if b.closure in ids]
    return [_form(found, problem, baseline, block) for block in blocks]


def _form(fitted: Fit, problem: Problem, baseline: Fit, block: Block) -> Form:
    closure = CLOSURE_OF[block.kind]
    parts = _parts(fitted, problem, block, closure)
    used = [term for term in CLOSURE_TERMS[closure] if f"{closure}.{term.name}" in fitted.values]
    whole = np.sum([parts[term.name] for term in used], axis=0)
    power = float(whole @ whole)
    effect = next(entry for entry in fitted.rig.effects if entry["id"] == closure)
    return Form(
        block=block.name,
        covers=block.covers,
        closure=closure,
        effective=math.sqrt(power / max(1, whole.size)),
        largest=float(np.quantile(np.abs(whole), 0.99)) if whole.size else 0.0,
        taken=_taken(fitted, baseline, problem, block),
        shares={
            kind: sum(float(parts[t.name] @ whole) for t in used if t.kind == kind) / power
            if power
            else 0.0
            for kind in dict.fromkeys(t.kind for t in used)
        },
        memory={kind: effect["parameters"].get(name) for kind, name in MEMORY_OF.items()},
        terms={
            t.name: (fitted.values[f"{closure}.{t.name}"], fitted.std[f"{closure}.{t.name}"])
            for t in used
        },
    )


def _parts(fitted: Fit, problem: Problem, block: Block, closure: str) -> dict[str, Array]:
    """Each term times its coefficient over all usable rows, along the measured signals."""
    core = core_rig(fitted.rig, problem.core)
    rows = []
    for prepared in problem.recordings:
        starts = prepared.starts(block.window, block.drives)
        terms = core.closure_terms(
            block.name,
            prepared.driving(mechanical=block.mechanical),
            prepared.dt,
            default_step(prepared.dt, longest=block.step),
            starts,
            signals_at_starts(block, prepared, starts),
            prepared.n,
        )
        rows.append(terms[fitted.residuals[block.name, prepared.recording.name].rows])
    every = np.concatenate(rows)
    return {
        t.name: every[:, k] * fitted.values.get(f"{closure}.{t.name}", 0.0)
        for k, t in enumerate(CLOSURE_TERMS[closure])
    }


def _taken(fitted: Fit, baseline: Fit, problem: Problem, block: Block) -> float:
    """Share of a block's squared residual beyond its sample noise that the closure removes."""
    excesses = []
    for model in (baseline, fitted):
        pairs = [model.residuals[block.name, p.recording.name] for p in problem.recordings]
        excesses.append(
            sum(
                float(((r.value[r.rows] / r.noise) ** 2).sum()) - float(r.rows.sum()) for r in pairs
            )
        )
    return 1.0 - max(0.0, excesses[1]) / excesses[0] if excesses[0] > 0.0 else 0.0


_SPOKEN_SHARE = 0.05  # share of the form from which a kind of dependence is put into words
_UNITS = {  # factors and units in which sizes are given
    "N m": ((1.0, "N m"),),
    "kg/s": ((1.0, "kg/s"), (1e-3, "g/s"), (1e-6, "mg/s"), (1e-9, "ug/s")),
}
_KINDS = ("static", "even", "odd", "time", "distance")


def form_sentence(form: Form) -> str:
    """A form in a few sentences.

    Returns
    -------
    str
        How large the missing quantity is over the recordings (effective value and the 99th
        percentile of its size), how much of the block's mismatch it takes, of which variables,
        which shares are even and odd, instantaneous or with memory, and the form with its numbers
        and standard deviations.
    """
    closure, wording, shape = form.closure, WORDS[form.closure], form.memory
    used = {term.name: term for term in CLOSURE_TERMS[closure] if term.name in form.terms}
    size, unit = _readable(form.effective, EFFECTS[closure].parameters[0].unit)
    variables = list(dict.fromkeys(v for term in used.values() for v in term.variables))
    words = [
        _kind_in_words(kind, closure, form.shares[kind], shape)
        for kind in _KINDS
        if abs(form.shares.get(kind, 0.0)) > _SPOKEN_SHARE
    ]
    return (
        f"In the block {form.block} ({form.covers}) a {wording.what} is missing, "
        f"{form.effective / size:.3g} {unit} effective (99 % below {form.largest / size:.3g} "
        f"{unit}); it takes {_percent(form.taken)} of the mismatch there. It is a function of "
        f"{listed(variables or ['nothing: it is constant'])}: {listed(words) or 'nothing'}. "
        f"{wording.letter} = {_formula(form, used, size)} {unit} "
        f"({wording.symbols}{_legend(used, shape)})."
    )


def _kind_in_words(kind: str, closure: str, share: float, shape: Mapping[str, float | None]) -> str:
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


def _formula(form: Form, used: dict[str, ClosureTerm], size: float) -> str:
    text = ""
    for name, term in used.items():
        value, std = (number / size for number in form.terms[name])
        number = f"{_number(abs(value))}(+-{_number(std)})" + (
            "" if term.formula == "1" else f" {term.formula}"
        )
        sign = "-" if value < 0.0 else "+"
        text += f" {sign} {number}" if text else (f"-{number}" if value < 0.0 else number)
    return text


def _number(value: float) -> str:
    """Text of a number with three digits, without a power of ten below a million."""
    return f"{value:.0f}" if 999.5 <= value < 1e6 else f"{value:.3g}"


def _legend(used: dict[str, ClosureTerm], shape: Mapping[str, float | None]) -> str:
    formulas = " ".join(term.formula for term in used.values())
    notes = ""
    if "_T" in formulas:
        notes += f"; index T: what it was over the past T = {shape['time']:.3g} s"
    if any(term.kind == "distance" for term in used.values()):
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
