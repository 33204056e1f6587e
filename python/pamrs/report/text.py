"""Words and numbers of a diagnosis: labels, number formats, the headline. Standard library only."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, TypeGuard

if TYPE_CHECKING:
    from pamrs.diagnosis.result import Diagnosis

__all__ = [
    "display_unit",
    "format_number",
    "format_probability",
    "format_uncertain",
    "headline",
    "is_named",
    "is_number",
    "label",
    "moved_parameters",
    "ranked_probabilities",
    "set_label",
    "span95",
]

_LABELS = {
    "none": "nothing missing",
    "parameters": "parameters only",
    "unlisted": "unlisted effect",
    "leak_muscle": "muscle leak",
    "pam_crowding_contact": "fibre crowding contact",
    "joint_coulomb_stribeck": "joint friction (Coulomb, Stribeck)",
    "compressor_cut_in": "compressor cut-in",
    "valve_centre_leakage": "valve centre leakage",
    "input_path_lag": "input path lag",
}

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_DISPLAY = {
    "Pa": (("kPa", 1e-3, 1e3), ("Pa", 1.0, 0.0)),
    "rad": (("°", 180.0 / math.pi, 0.0),),
    "m": (("m", 1.0, 1.0), ("mm", 1e3, 0.0)),
    "s": (("s", 1.0, 0.1), ("ms", 1e3, 0.0)),
}


def label(identifier: str) -> str:
    """Readable name of a hypothesis, effect, block or channel id; pairs are joined by ``+``."""
    parts = [part.strip() for part in identifier.split("+")]
    return " + ".join(_LABELS.get(part, part.replace("_", " ")) for part in parts)


def set_label(identifiers: list[str]) -> str:
    """Readable name of a set of effects that act together."""
    return " + ".join(label(i) for i in identifiers) if identifiers else label("none")


def is_number(value: Any) -> TypeGuard[float]:
    """Whether `value` is a finite real number (NaN, infinities, None and text are not)."""
    try:
        return value is not None and math.isfinite(float(value))
    except (TypeError, ValueError):
        return False


def display_unit(unit: str, magnitude: float) -> tuple[str, float]:
    """Unit to show a quantity in, and the factor from SI.

    Parameters
    ----------
    unit : str
        SI unit.
    magnitude : float
        Typical absolute value in SI.

    Returns
    -------
    tuple of (str, float)
        Shown unit and multiplier; SI itself when there is no handier unit.
    """
    for name, factor, least in _DISPLAY.get(unit, ()):
        if not math.isfinite(magnitude) or abs(magnitude) >= least:
            return name, factor
    return unit, 1.0


def _power(exponent: int, unicode: bool) -> str:
    return f" × 10{str(exponent).translate(_SUPERSCRIPT)}" if unicode else f"e{exponent}"


def _minus(text: str, unicode: bool) -> str:
    return text.replace("-", "−") if unicode else text


def format_number(value: Any, digits: int = 3, *, unicode: bool = True) -> str:
    """Write a number with `digits` significant figures; an en dash when it is not finite."""
    if not is_number(value):
        return "–" if unicode else "-"
    x = float(value)
    if x == 0.0:
        return "0"
    exponent = int(f"{x:.{digits - 1}e}".partition("e")[2])
    if -4 < exponent < 6:
        rounded = round(x, digits - 1 - exponent)
        return _minus(f"{rounded:.{max(0, digits - 1 - exponent)}f}", unicode)
    return _minus(f"{x / 10.0**exponent:.{digits - 1}f}", unicode) + _power(exponent, unicode)


def format_uncertain(value: Any, std: Any, *, unicode: bool = True) -> str:
    """Write ``value ± std``, rounded to two figures of the standard deviation."""
    if not is_number(value) or not is_number(std) or float(std) <= 0.0:
        return format_number(value, 4, unicode=unicode)
    x, s = float(value), float(std)
    pm = " ± " if unicode else " +- "
    exponent = math.floor(math.log10(max(abs(x), s)))
    scale = 0 if -4 < exponent < 6 else exponent
    x, s = x / 10.0**scale, s / 10.0**scale
    decimals = min(12, max(0, 1 - math.floor(math.log10(s))))
    body = _minus(f"{x:.{decimals}f}", unicode) + pm + f"{s:.{decimals}f}"
    return body if scale == 0 else f"({body}){_power(scale, unicode)}"


def format_probability(p: Any) -> str:
    """Write a probability with two decimals, never rounding to certainty."""
    if not is_number(p):
        return "–"
    if float(p) > 0.995:
        return "> 0.99"
    return "< 0.01" if float(p) < 0.005 else f"{float(p):.2f}"


def span95(entry: dict[str, Any]) -> tuple[float, float] | None:
    """95 % interval of a parameter entry: its ``interval`` if given, else value ± 1.96 std."""
    interval = entry.get("interval")
    if interval is not None and len(interval) == 2 and all(is_number(v) for v in interval):
        return float(interval[0]), float(interval[1])
    value, std = entry.get("value"), entry.get("std")
    if is_number(value) and is_number(std):
        return float(value) - 1.96 * float(std), float(value) + 1.96 * float(std)
    return None


def ranked_probabilities(diagnosis: Diagnosis, count: int = 8) -> list[tuple[str, float]]:
    """Most probable hypotheses first, at most `count`; the rest is pooled under ``all others``."""
    known = [(k, float(v)) for k, v in diagnosis.probabilities.items() if is_number(v)]
    known.sort(key=lambda item: (-item[1], item[0]))
    if len(known) <= count:
        return known
    rest = known[count - 1 :]
    return [*known[: count - 1], (f"all others ({len(rest)})", sum(p for _, p in rest))]


def is_named(diagnosis: Diagnosis, hypothesis: str) -> bool:
    """Whether `hypothesis` (an id, or ids joined by ``+``) is the one that the verdict names."""
    named = {str(e["id"]) for e in diagnosis.effects} if diagnosis.verdict == "effects" else {diagnosis.verdict}
    return set(hypothesis.replace(" ", "").split("+")) == named


def moved_parameters(diagnosis: Diagnosis, least: float = 1.0) -> list[str]:
    """Names of identifiable parameters that moved by at least `least` tolerances, farthest first."""
    moved = [
        (abs(float(p["moved_sigmas"])), name)
        for name, p in diagnosis.parameters.items()
        if is_number(p.get("moved_sigmas")) and p.get("identifiable", True)
    ]
    return [name for size, name in sorted(moved, reverse=True) if size >= least]


def headline(diagnosis: Diagnosis) -> str:
    """One sentence that states the verdict."""
    block = diagnosis.where.get("block")
    place = f" in the {label(str(block))}" if block else ""
    doubtful = [s for s in diagnosis.ambiguity if s not in (["none"], ["parameters"])]
    rivals = " or ".join(set_label(s) for s in doubtful)
    if diagnosis.verdict == "none" and doubtful:
        return f"The model explains these recordings down to their noise, but they cannot rule out {rivals}{place}"
    if diagnosis.verdict == "none":
        return "Nothing is missing: the model explains these recordings down to their noise"
    if diagnosis.verdict == "parameters" and doubtful:
        return f"Parameter values may explain the difference; these recordings cannot rule out {rivals}{place}"
    if diagnosis.verdict == "parameters":
        moved = [label(n.replace(".", " ")) for n in moved_parameters(diagnosis)[:3]]
        which = f": {', '.join(moved)}" if moved else ""
        return f"No physics is missing; parameter values explain the difference{which}"
    if diagnosis.verdict == "unlisted":
        return f"Physics outside the catalogue acts{place or ' on this rig'}"
    if len(doubtful) < len(diagnosis.ambiguity):
        return f"Physics may be missing{place}: these recordings cannot tell {rivals} from parameter values that are off"
    if len(doubtful) > 1:
        return f"Physics is missing{place}; these recordings cannot tell whether it is {rivals}"
    names = " and ".join(str(e.get("name") or label(str(e["id"]))) for e in diagnosis.effects)
    return f"The model leaves out: {names or 'an effect'}{place}"
