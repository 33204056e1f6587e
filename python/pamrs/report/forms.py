"""The form of a mismatch without a name, in words: where, how large, of which variables, even or
odd, with which memory, and the form with its numbers.
"""

from __future__ import annotations

from collections.abc import Mapping

from pamrs.effects import CLOSURE_TERMS, EFFECTS, WORDS, ClosureTerm
from pamrs.findings import Form
from pamrs.report.text import listed

_SPOKEN_SHARE = 0.05  # share of the form from which a kind of dependence is put into words
_UNITS = {  # factors and units in which sizes are told
    "N m": ((1.0, "N m"),),
    "kg/s": ((1.0, "kg/s"), (1e-3, "g/s"), (1e-6, "mg/s"), (1e-9, "ug/s")),
}
_KINDS = ("static", "even", "odd", "time", "distance")


def form_sentence(form: Form) -> str:
    """A form in a few sentences.

    Parameters
    ----------
    form : Form
        Of one block.

    Returns
    -------
    str
        How large the missing quantity is over the recordings (effective value and the 99th
        percentile of its size), how much of the block's mismatch it takes, of which variables,
        which shares are even and odd, instantaneous or with memory, and the form with its numbers
        and standard deviations.
    """
    closure, told, shape = form.closure, WORDS[form.closure], form.memory
    used = {term.name: term for term in CLOSURE_TERMS[closure] if term.name in form.terms}
    size, unit = _readable(form.effective, EFFECTS[closure].parameters[0].unit)
    variables = list(dict.fromkeys(v for term in used.values() for v in term.variables))
    words = [
        _kind_in_words(kind, closure, form.shares[kind], shape)
        for kind in _KINDS
        if abs(form.shares.get(kind, 0.0)) > _SPOKEN_SHARE
    ]
    return (
        f"In the block {form.block} ({form.covers}) a {told.what} is missing, "
        f"{form.effective / size:.3g} {unit} effective (99 % below {form.largest / size:.3g} "
        f"{unit}); it takes {_percent(form.taken)} of the mismatch there. It is a function of "
        f"{listed(variables or ['nothing: it is constant'])}: {listed(words) or 'nothing'}. "
        f"{told.letter} = {_formula(form, used, size)} {unit} "
        f"({told.symbols}{_legend(used, shape)})."
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
    """Three digits, and no power of ten where a person can do without."""
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
