"""What a muscle fit means, in plain sentences: headline, quality, where the model does not
apply.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pamrs.errors import FitError
from pamrs.fit._cautions import FAR
from pamrs.report.text import format_number

if TYPE_CHECKING:
    from pamrs.fit._compare import ModelComparison
    from pamrs.fit._result import MuscleFit
    from pamrs.fit._validation import CrossValidation
    from pamrs.rig import Muscle

Array = NDArray[np.float64]

#: One sentence for each force model.
MODEL_WORDS = {
    "gaylord": "the gas force of an ideal braided cylinder, without wall or elasticity",
    "chou_hannaford": (
        "an ideal braided cylinder with a wall of constant thickness, without elasticity"
    ),
    "mooney_rivlin": (
        "an ideal braided cylinder with a rubber bladder of two Mooney-Rivlin constants"
    ),
    "ferraresi": "a braided cylinder with a bladder of constant thickness and a polynomial stress",
    "kothera": "a braided cylinder with a bladder that thins as it widens and a polynomial stress",
    "robinson": (
        "a braid with elliptic ends and a bladder that thins as it widens, with a polynomial stress"
    ),
    "elbow_linear": (
        "a braided cylinder with a bladder that thins as it widens and one constant modulus"
    ),
}
_MUCH = 0.3  # share of the squared residual that counts as a pattern
_WIDE_CONDITION = 100.0
_BINS = 8


def title(fit: MuscleFit) -> str:
    """Model and order."""
    return fit.model if fit.order is None else f"{fit.model} {fit.order}"


def _named(fit: MuscleFit) -> str:
    return f"{fit.model} model" + ("" if fit.order is None else f" of order {fit.order}")


def percent(share: float, digits: int = 3) -> str:
    """A fraction as a percentage."""
    return f"{format_number(100 * share, digits)} %"


def _kpa(pressure: float) -> str:
    return f"{pressure / 1e3:.5g}"


def signed(value: float) -> str:
    """A number with its sign and one decimal."""
    return f"{value:+.1f}".replace("-0.0", "0.0").replace("+0.0", "0.0").replace("-", "−")


def cross_validation(fit: MuscleFit) -> tuple[CrossValidation | None, str]:
    """Leave-one-pressure-out, or None and why there is none."""
    try:
        return fit.leave_one_pressure_out(), ""
    except FitError as error:
        return None, str(error)


def friction_words(muscle: Muscle) -> str:
    """The friction law (2.36) of a muscle with its numbers; empty without friction."""
    if not muscle.has_friction:
        return ""
    law = ("friction_coefficient", "friction_pressure_slope", "friction_floor")
    c0, c1, floor = (muscle.parameters[name] for name in law)
    return f"c_F = max(c0 + c1 P, {floor:.4g}), c0 = {c0:.4g}, c1 = {1e6 * c1:.4g} 1/MPa"


def headline(fit: MuscleFit) -> str:
    """One line that states the result."""
    held_out = fit.errors_of("held_out")
    if held_out is not None:
        seen = len(np.unique(fit.data.level[fit.fitted]))
        return (
            f"Fitted on {seen} pressures, the {_named(fit)} predicts the other "
            f"{len(fit.data.levels) - seen} within {percent(held_out[1], 2)} of the largest force, "
            f"{percent(held_out[0], 2)} rms"
        )
    reached = f"{percent(fit.max_error, 2)} of the largest force, {percent(fit.rms_error, 2)} rms"
    return f"The {_named(fit)} meets every point within {reached}"


def opening(fit: MuscleFit) -> list[str]:
    """What was fitted to what, and how good it is: the first paragraphs."""
    data = fit.data
    pressure, contraction, force, _, _ = data.used_rows()
    span = (
        f"{data.label}: {int(data.used.sum())} of {len(data)} rows are used, at {len(data.levels)} "
        f"pressures from {_kpa(pressure.min())} to {_kpa(pressure.max())} kPa, contraction "
        f"{percent(float(contraction.min()), 2)} to {percent(float(contraction.max()), 2)}, forces "
        f"up to {format_number(force.max(), 4)} N."
    )
    kind = "" if not fit.nvarys else f" {fit.nvarys} numbers were fitted to {fit.ndata} points."
    words = f"The model: {MODEL_WORDS[fit.model]}.{kind}"
    held_out = fit.errors_of("held_out")
    cross, reason = cross_validation(fit)
    expected = "that is the error to expect at a pressure that was not measured."
    if held_out is not None:
        unseen = f"{percent(held_out[0])} rms and {percent(held_out[1])} at most"
        words += f" At the pressures that it has not seen it is off by {unseen}: {expected}"
    elif cross is not None:
        words += (
            " Leaving out one pressure after the other and predicting it from the rest gives "
            f"{percent(cross.rms)} rms and {percent(cross.max)} at most: {expected}"
        )
    else:
        words += (
            f" How well it predicts pressures that it has not seen could not be tested: {reason}."
        )
    return [span, words]


@dataclass(frozen=True)
class Pattern:
    """How much of the squared residual repeats.

    Attributes
    ----------
    by_contraction, by_level : float
        Share explained by a mean for each contraction, and by a mean for each pressure level [1].
    expected_contraction, expected_level : float
        The shares that independent residuals would give by chance.
    worst : tuple of float
        Contraction [1], pressure [Pa] and residual [N] of the worst point.
    """

    by_contraction: float
    by_level: float
    expected_contraction: float
    expected_level: float
    worst: tuple[float, float, float]


def residual_pattern(fit: MuscleFit) -> Pattern:
    """Look for structure in the residuals of all used rows.

    Parameters
    ----------
    fit : MuscleFit
        Fitted muscle.

    Returns
    -------
    Pattern
    """
    pressure, contraction, _, level, _ = fit.data.used_rows()
    residual = fit.all_residuals
    places, bins = np.unique(np.round(contraction, 6), return_inverse=True)
    if len(places) > _BINS:
        edges = np.quantile(contraction, np.linspace(0, 1, _BINS + 1)[1:-1])
        bins = np.searchsorted(edges, contraction)
    at = int(np.argmax(np.abs(residual)))
    n = len(residual)
    return Pattern(
        _explained(residual, bins),
        _explained(residual, level),
        len(np.unique(bins)) / n,
        len(np.unique(level)) / n,
        (float(contraction[at]), float(pressure[at]), float(residual[at])),
    )


def _explained(residual: Array, group: NDArray[np.intp]) -> float:
    total = float(residual @ residual)
    if total == 0.0:
        return 0.0
    means = [(residual[group == g].sum() ** 2) / np.sum(group == g) for g in np.unique(group)]
    return float(np.sum(means)) / total


def limits(fit: MuscleFit) -> list[str]:
    """Where the model does not apply, as far as the numbers show it."""
    data = fit.data
    pressure, contraction, force, _, _ = data.used_rows()
    rows = fit.fitted
    low, high = float(np.min(data.contraction[rows])), float(np.max(data.contraction[rows]))
    bottom, top = float(np.min(data.pressure[rows])), float(np.max(data.pressure[rows]))
    lines = [
        f"The fit knows contractions from {percent(low, 2)} to {percent(high, 2)} and pressures "
        f"from {_kpa(bottom)} to {_kpa(top)} kPa. Beyond them the polynomial goes where it likes: "
        "the dotted parts of the lines in the figure."
    ]
    pattern = residual_pattern(fit)
    e, p, worst = pattern.worst
    lines.append(
        f"The worst point is at {percent(e, 2)} contraction and {_kpa(p)} kPa: measured "
        f"{format_number(abs(worst))} N {'above' if worst > 0 else 'below'} the model, "
        f"{percent(abs(worst) / float(force.max()), 2)} of the largest force."
    )
    if pattern.by_contraction > max(_MUCH, 2 * pattern.expected_contraction):
        lines.append(
            f"{percent(pattern.by_contraction, 2)} of the squared residual repeats at the same "
            f"contraction at every pressure (chance: {percent(pattern.expected_contraction, 2)}). "
            "That is geometry or strain law, not noise: the braid of this muscle does not follow "
            "the assumed shape there, and standard errors do not know it."
        )
    if pattern.by_level > max(_MUCH, 2 * pattern.expected_level):
        lines.append(
            f"{percent(pattern.by_level, 2)} of the squared residual is common to a whole pressure "
            f"level (chance: {percent(pattern.expected_level, 2)}): moduli linear in pressure do "
            "not follow every level, or the gauge was off there."
        )
    cross, _ = cross_validation(fit)
    inside = None if cross is None else cross.interior_rms
    if cross is not None and inside is not None and cross.end_rms > 2 * inside:
        times = format_number(cross.end_rms / inside, 2)
        lines.append(
            "Predicted from the others, the lowest and the highest pressure come out "
            f"{times} times worse ({percent(cross.end_rms)} rms) than those between others "
            f"({percent(inside)}): measure the ends of the range that matters."
        )
    errors = fit.error_by_pressure()
    bad = errors.levels[errors.rms > max(3 * float(np.median(errors.rms)), 0.05)]
    if len(bad):
        shown = ", ".join(f"{_kpa(level)}" for level in bad[:6])
        lines.append(
            f"At {shown} kPa the error is beyond 5 % of that level's own largest force: the forces "
            "are small there (a pressure near the one at which the muscle begins to pull), so a "
            "small error in newtons is a large one in percent."
        )
    return lines


def meaning(fit: MuscleFit) -> list[str]:
    """What the fitted numbers say, and what they do not."""
    lines = []
    share = _bladder_share(fit)
    if share is not None and fit.nvarys:
        gas, elastic = share
        lines.append(
            f"At the largest measured force the gas alone would pull {format_number(gas, 4)} N; "
            f"the bladder {'takes' if elastic < 0 else 'adds'} {format_number(abs(elastic), 3)} N "
            f"({percent(abs(elastic) / gas, 2)})."
        )
    if fit.order is not None and fit.moduli_kind == "linear":
        lines.append(
            "E_k = m_k P + b_k are the coefficients of the stress over strain, from the first "
            "power up. b_k is the rubber as it is without pressure; m_k is how it stiffens with "
            "pressure, in Pa per Pa."
        )
    condition = fit.condition_number
    if fit.nvarys > 1 and condition > _WIDE_CONDITION:
        lines.append(
            f"The condition number is {format_number(condition, 2)}: the columns of single moduli "
            f"look alike over the measured lengths, and about {math.log10(condition):.0f} digits "
            "of a single modulus are lost. The force, their sum, is not affected inside the "
            "measured range; do not read a single modulus as a material constant."
        )
    elif fit.nvarys > 1:
        lines.append(
            f"The condition number is {format_number(condition, 2)}: the measured lengths and "
            "pressures tell the moduli apart."
        )
    unsure = [name for name, p in fit.params.items() if p.stderr > abs(p.value)]
    if unsure:
        few = ", ".join(unsure[:8]) + (" and more" if len(unsure) > 8 else "")
        lines.append(f"Not told from zero (standard error larger than the value): {few}.")
    for free in fit.free:
        moved = free.moved(fit.params[free.name].value)
        if abs(moved) > 2:
            lines.append(
                f"{free.name} moved {signed(moved)} tolerances from what was known of it. For a "
                "muscle that is not an open braid around a bladder it stands for whatever does "
                "that part there, and is not the angle or size a ruler would find."
            )
    return lines


def _bladder_share(fit: MuscleFit) -> tuple[float, float] | None:
    """Gas force, and force of the bladder, at the fitted point of the largest force [N]; None when
    gas does not pull there.
    """
    rows = np.flatnonzero(fit.fitted)
    at = rows[int(np.argmax(fit.data.force[rows]))]
    level, length = float(fit.data.levels[fit.data.level[at]]), float(fit.data.length[at])
    pressure = level if fit.moduli_kind == "per_level" else float(fit.data.pressure[at])
    muscle = fit.muscle_at(pressure) if fit.moduli_kind == "per_level" else fit.muscle
    contraction = 1.0 - length / float(muscle.parameters["rest_length"])
    gas = pressure * float(muscle.gas_area(contraction))
    return (gas, float(fit.predict(pressure, length=length)) - gas) if gas > 0.0 else None


def ranking_words(comparison: ModelComparison) -> str:
    """What the ranking says, in two sentences."""
    best, chosen = comparison.best, comparison.recommended
    text = f"Best at pressures it has not seen: {title(best)} ({best.nvarys} unknowns)."
    if chosen is not best:
        text += (
            f" {title(chosen)} does as well within the uncertainty of that error with "
            f"{chosen.nvarys} unknowns"
        )
        moved = next(row["moved"] for row in comparison.rows if row["rank"] == 1)
        if moved > FAR:
            text += f", and not with a geometry that is {moved:.1f} tolerances off"
        text += ": take that one."
    return text
