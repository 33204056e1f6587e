"""The report of a muscle fit: one offline HTML page, one PNG."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from pamrs._writing import write_atomically
from pamrs.errors import FitError, ParameterError
from pamrs.fit import remarks
from pamrs.report.text import format_number, format_uncertain

if TYPE_CHECKING:
    from pamrs.fit._compare import ModelComparison
    from pamrs.fit._data import ForceMap
    from pamrs.fit._figures import ErrorCurve
    from pamrs.fit._friction import FrictionFit
    from pamrs.fit._result import MuscleFit

__all__ = [
    "error_curves",
    "render_friction_png",
    "render_html",
    "render_png",
    "write_figure",
    "write_report",
]

_SHOWN_UNITS = {
    "Pa": ("MPa", 1e-6),
    "m": ("mm", 1e3),
    "rad": ("°", 57.29577951308232),
    "1": ("", 1.0),
}


#: Levels up to which the moduli of each are shown beside the straight lines.
_MOST_LEVELS: Final = 40


# ------------------------------------------------------------------------- curves


def _curve(name: str, fit: MuscleFit) -> ErrorCurve:
    import numpy as np

    from pamrs.fit._figures import ErrorCurve

    errors = fit.error_by_pressure()
    cross, _ = remarks.cross_validation(fit)
    none = np.empty(0)
    left = (none, none) if cross is None else (cross.by_pressure.levels, cross.by_pressure.rms)
    return ErrorCurve(name, errors.levels, errors.rms, errors.fitted, *left)


def error_curves(fit: MuscleFit, comparison: ModelComparison | None = None) -> list[ErrorCurve]:
    """Errors over pressure to draw: of the fit alone, or of the best order of every compared model.

    Parameters
    ----------
    fit : MuscleFit
        Fitted muscle.
    comparison : ModelComparison, optional
        Models beside it.

    Returns
    -------
    list of ErrorCurve
    """
    if comparison is None:
        return [_curve(remarks.title(fit), fit)]
    best: dict[str, MuscleFit] = {}
    for row in comparison.rows:
        if row["rank"] is not None:
            best.setdefault(row["model"], comparison.fits[row["model"], row["order"]])
    return [_curve(remarks.title(other), other) for other in best.values()]


def _level_by_level(fit: MuscleFit) -> MuscleFit | None:
    """The same fit with moduli free at each level that has points enough; None where that says
    nothing.
    """
    import numpy as np

    if fit.moduli_kind == "per_level" or not fit.params:
        return None
    counts = np.bincount(fit.data.level[fit.fitted], minlength=len(fit.data.levels))
    terms = fit.order or sum(p.unit == "Pa" for p in fit.params.values())
    enough = np.flatnonzero(counts > terms)
    if not 2 <= len(enough) <= _MOST_LEVELS:
        return None
    fixed = {free.name: fit.params[free.name].value for free in fit.free}
    if "rest_length" in fixed:
        return None
    try:
        return fit.refitted(
            fit.muscle.replace(**fixed),
            model=fit.model,
            geometry=fit.muscle.geometry,
            order=fit.order,
            moduli="per_level",
            levels=enough.tolist(),
            errors="plain",
            **fit.settings,
        )
    except (FitError, ParameterError):
        return None


# ------------------------------------------------------------------------- tables


def _parameters(fit: MuscleFit) -> list[dict[str, Any]]:
    rows = []
    for p in fit.params.values():
        unit, factor = _SHOWN_UNITS.get(p.unit, (p.unit, 1.0))
        nominal, moved = "", 0.0
        if p.init_value is not None:
            known = p.tolerance or 0.0
            nominal = format_uncertain(p.init_value * factor, known * factor)
            moved = (p.value - p.init_value) / known if known else 0.0
        rows.append(
            {
                "name": p.name,
                "value": format_uncertain(p.value * factor, p.stderr * factor),
                "unit": unit,
                "nominal": nominal,
                "moved": remarks.signed(moved) if nominal and p.tolerance else "",
                "alarm": abs(moved) > 3,
                "weak": p.stderr > abs(p.value),
            }
        )
    return rows


def _share(value: float | None) -> str:
    return "–" if value is None else format_number(100 * value, 3)


def _levels(fit: MuscleFit) -> list[dict[str, Any]]:
    import numpy as np

    errors = fit.error_by_pressure()
    cross, _ = remarks.cross_validation(fit)
    predicted: dict[float, float] = {}
    if cross is not None:
        left = cross.by_pressure
        predicted = dict(zip(left.levels.tolist(), left.rms.tolist(), strict=True))
    columns = (errors.levels, errors.points, errors.rms, errors.max, errors.fitted)
    return [
        {
            "level": f"{level / 1e3:.5g}",
            "points": points,
            "rms": _share(rms),
            "max": _share(worst),
            "left": _share(predicted.get(level)),
            "fitted": fitted,
        }
        for level, points, rms, worst, fitted in zip(*map(np.ndarray.tolist, columns), strict=True)
    ]


def _ranking(comparison: ModelComparison) -> list[dict[str, Any]]:
    kept = ("model", "geometry", "nvarys", "rank", "reason", "recommended")
    shown = ("rms", "max", "lopo_rms", "lopo_max", "lopo_end_rms", "subset_rms", "subset_max")
    rows = []
    for row in comparison.rows:
        cells = {name: _share(row[name]) for name in shown}
        for name in ("aicc", "bic"):
            cells[name] = "–" if row[name] is None else format_number(row[name], 4)
        start = {name: row[name] for name in kept}
        rows.append({**start, **cells, "order": row["order"] or ""})
    return rows


def _facts(fit: MuscleFit) -> list[tuple[str, str]]:
    facts = [
        (remarks.percent(fit.rms_error), "rms error, of the largest force"),
        (remarks.percent(fit.max_error), "largest error"),
    ]
    held_out = fit.errors_of("held_out")
    if held_out is not None:
        worst = remarks.percent(held_out[1])
        facts.append((worst, "largest error at pressures that were not fitted"))
    cross, _ = remarks.cross_validation(fit)
    if cross is not None:
        rms = remarks.percent(cross.rms)
        facts.append((rms, "rms, each fitted pressure predicted from the others"))
    facts.append((format_number(fit.condition_number, 2), "condition number"))
    return facts


def _muscle(fit: MuscleFit) -> list[tuple[str, str]]:
    muscle = fit.muscle_at(float(fit.data.levels[-1]))
    parameters, friction = muscle.parameters, remarks.friction_words(muscle)
    return [
        ("model", remarks.title(fit)),
        ("geometry", str(parameters["geometry"])),
        ("rest length", f"{format_number(1e3 * parameters['rest_length'], 4)} mm"),
        ("rest diameter", f"{format_number(1e3 * parameters['rest_diameter'], 4)} mm"),
        ("braid angle", f"{format_number(57.29577951308232 * parameters['braid_angle'], 4)}°"),
        ("wall thickness", f"{format_number(1e3 * parameters['wall_thickness'], 3)} mm"),
        *([("friction", friction)] if friction else []),
    ]


def _block(fit: MuscleFit) -> str:
    """The ``[muscle]`` block of a rig file; empty when the moduli are free at each level."""
    if fit.moduli_kind == "per_level" and fit.nvarys:
        return ""
    text = fit.to_rig().to_toml_text()
    start = text.index("[muscle]")
    end = text.find("\n[", start + 1)
    return text[start : None if end < 0 else end + 1].strip()


# -------------------------------------------------------------------------- pages


def render_html(
    fit: MuscleFit, comparison: ModelComparison | None = None, *, command: str = ""
) -> str:
    """The report as one HTML page that loads nothing.

    Parameters
    ----------
    fit : MuscleFit
        Fitted muscle.
    comparison : ModelComparison, optional
        Models side by side.
    command : str
        The command line that makes the page again.

    Returns
    -------
    str
        HTML text.
    """
    from markupsafe import Markup

    from pamrs.fit import _figures as figures
    from pamrs.report.page import render_page

    def markup(svg: str | None) -> Markup | None:
        return None if svg is None else Markup(svg)  # noqa: S704

    per_level = fit if fit.moduli_kind == "per_level" else _level_by_level(fit)
    cross, reason = remarks.cross_validation(fit)
    return render_page(
        Path(__file__).with_name("template.html.j2"),
        name=fit.data.label,
        source=fit.data.source,
        headline=remarks.headline(fit),
        paragraphs=remarks.opening(fit),
        facts=_facts(fit),
        warnings=list(fit.warnings),
        issues=fit.data.issues,
        muscle=_muscle(fit),
        family=markup(figures.family_svg(fit)),
        moduli=markup(figures.moduli_svg(fit, per_level)),
        errors=markup(figures.errors_svg(error_curves(fit, comparison))),
        residuals=markup(figures.residuals_svg(fit)),
        levels=_levels(fit),
        cross_reason=reason if cross is None else "",
        weak=fit.error_by_pressure().note,
        all_fitted=fit.errors_of("held_out") is None,
        parameters=_parameters(fit),
        robust=fit.errors == "level",
        ranking=[] if comparison is None else _ranking(comparison),
        ranking_words="" if comparison is None else remarks.ranking_words(comparison),
        subset=[] if comparison is None else [f"{p / 1e3:.5g}" for p in comparison.subset],
        effective=None if comparison is None else format_number(comparison.effective_size, 2),
        meaning=remarks.meaning(fit),
        limits=remarks.limits(fit),
        block=_block(fit),
        command=command,
        message=fit.message,
    )


def write_report(
    fit: MuscleFit,
    path: str | os.PathLike[str],
    comparison: ModelComparison | None = None,
    *,
    command: str = "",
) -> Path:
    """Write :func:`render_html` to `path` and return the path; the file appears whole or not at
    all.
    """
    return write_atomically(path, render_html(fit, comparison, command=command))


def render_png(fit: MuscleFit, comparison: ModelComparison | None = None) -> bytes:
    """The one-picture summary, a PNG of 1600 x 1000 pixels."""
    from pamrs.fit._figures import summary_png

    return summary_png(fit, error_curves(fit, comparison), remarks.headline(fit))


def render_friction_png(fit: FrictionFit, data: ForceMap) -> bytes:
    """Measured loops with their mean curves, and the friction coefficient over pressure: a PNG of
    1600 x 800 pixels.

    Parameters
    ----------
    fit : FrictionFit
        Fitted friction.
    data : ForceMap
        The loops that it was fitted to.

    Returns
    -------
    bytes
    """
    from pamrs.fit._friction_figure import friction_png

    return friction_png(fit, data)


def write_figure(
    fit: MuscleFit, path: str | os.PathLike[str], comparison: ModelComparison | None = None
) -> Path:
    """Write :func:`render_png` to `path` and return the path; the file appears whole or not at
    all.
    """
    return write_atomically(path, render_png(fit, comparison))
