"""The friction of a cylinder in words and a table."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from pamrs.fit.levels import LawParameter
from pamrs.units import with_unit

if TYPE_CHECKING:
    from cases.zillen_cylinders.laws import CylinderFriction, HeldOut, LevelFriction

__all__ = ["held_out_lines", "report_text"]

# how a coefficient is printed: factor from SI and the unit that goes with it
_PRINTED: Final = {"N/Pa": (1e5, "N/bar"), "N/Pa2": (1e10, "N/bar2"), "m2": (1e6, "mm2")}
_REST: Final = {
    "seen": "",
    "at least": " at least (logger paused)",
    "missed": "not sampled (logger paused)",
    "in motion": "does not begin at rest",
}


def report_text(fit: CylinderFriction) -> str:
    """The whole report.

    Parameters
    ----------
    fit : CylinderFriction
        What to report.

    Returns
    -------
    str
        Lines of plain text.
    """
    counts = f"{fit.ndata} pressures, {fit.nvarys} coefficients, {fit.nfree} to spare"
    lines = [f"{fit.name}: friction law {fit.law!r}, {counts}"]
    lines += [f"  {_coefficient(parameter)}" for parameter in fit.params.values()]
    if fit.nfree:
        lines.append(
            "  scatter of the pressures about the law beyond that of their strokes "
            f"{fit.between:.2f} N (reduced chi-square {fit.redchi:.1f} with the strokes' scatter "
            "alone)"
        )
    else:
        lines.append(
            "  as many coefficients as pressures: the law cannot be tested, the errors are those "
            "of the strokes alone"
        )
    lines.append(
        "  pressure   friction +- s.e. [N]   law [N]  pairs  drift   speeds [mm/s]  after reversal "
        "(ripple)  from rest"
    )
    held_out = fit.held_out()
    rows = list(zip(fit.levels, fit.best_fit.tolist(), strict=True))
    rows += [(item.level, item.predicted) for item in held_out]
    for level, law in rows:
        before, after = _level(level)
        lines.append(f"  {before}{law:9.2f}{after}{'' if level in fit.levels else '  (held out)'}")
    lines += held_out_lines(held_out)
    lines += [f"  {sentence}" for sentence in _limits(fit)]
    lines += [f"  note: {issue}" for issue in fit.issues]
    return "\n".join(lines)


def held_out_lines(found: list[HeldOut]) -> list[str]:
    """One line for each predicted pressure.

    Parameters
    ----------
    found : list of HeldOut
        From :meth:`CylinderFriction.held_out` or :meth:`CylinderFriction.leave_one_pressure_out`.

    Returns
    -------
    list of str
    """
    lines = []
    for item in found:
        level = item.level
        text = (
            f"  predicted {level.pressure / 1e5:.2f} bar: {item.predicted:.2f} +- "
            f"{item.stderr:.2f} N, measured {level.friction:.2f} N, error {item.error:+.2f} N "
            f"({100.0 * item.relative_error:+.1f} %)"
        )
        if item.extrapolated:
            text += ", extrapolated"
        if item.breakaway is not None and level.breakaway is not None:
            measured = f"{_bound(level)}{level.breakaway:.1f} N"
            text += f"; breakaway {item.breakaway:.1f} N, measured {measured}"
        lines.append(text)
    return lines


def _bound(level: LevelFriction) -> str:
    return ">= " if level.rest is not None and level.rest.status == "at least" else ""


def _coefficient(parameter: LawParameter) -> str:
    factor, unit = _PRINTED.get(parameter.unit, (1.0, parameter.unit))
    error = "" if math.isnan(parameter.stderr) else f" +- {parameter.stderr * factor:.2g}"
    return with_unit(f"{parameter.name} = {parameter.value * factor:.4g}{error}", unit)


def _level(level: LevelFriction) -> tuple[str, str]:
    """The cells before and after the column of the law."""
    if level.rest is None:
        rest = "first stroke not usable"
    else:
        peak = f"{level.breakaway:.1f} N" if level.breakaway is not None else ""
        rest = peak + _REST[level.rest.status]
    before = f"{level.pressure / 1e5:5.2f} bar{level.friction:12.2f} +- {level.stderr:.2f}    "
    after = (
        f"{level.pairs:6d}{100.0 * level.drift:+7.0f} %{level.speed_against * 1e3:8.1f} "
        f"{level.speed_giving * 1e3:5.1f}{level.reversal_ratio:11.2f} +- "
        f"{level.reversal_stderr:.2f} ({level.reversal_ripple:.2f})    {rest}"
    )
    return before, after


def _limits(fit: CylinderFriction) -> list[str]:
    """What the runs do not tell."""
    said = [
        "a difference between the frictions of the two directions is not separable from the area "
        "and the force zero"
    ]
    r = fit.speed_correlation
    if abs(r) > 0.8:
        said.append(
            f"speed follows pressure (correlation {r:.2f}): a speed dependence is not separable "
            "from the pressure's"
        )
    drifting = [level for level in fit.levels if abs(level.drift) > 0.05]
    if drifting:
        most = max(drifting, key=lambda level: abs(level.drift))
        said.append(
            f"friction drifts within {len(drifting)} of {fit.ndata} runs, most by "
            f"{100.0 * most.drift:+.0f} % in {most.name}: the strokes are no independent repeats, "
            "and count as fewer"
        )
    rests = [level.rest for level in fit.levels if level.rest is not None]
    unsure = [rest for rest in rests if rest.status == "at least"]
    if unsure and "breakaway_ratio" in fit.params:
        said.append(
            f"breakaway_ratio is a lower bound: the logger paused at the start of {len(unsure)} of "
            "the runs it comes from"
        )
    return said
