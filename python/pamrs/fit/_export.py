"""A muscle fit handed on: as text, as plain numbers, as a rig."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from pamrs._arrays import Array
from pamrs.errors import missing_package
from pamrs.rigs import bench
from pamrs.units import with_unit

if TYPE_CHECKING:
    from pamrs.fit._result import MuscleFit
    from pamrs.rig import Rig

_NUMBERS: Final = (
    *("errors", "ndata", "nvarys", "chisqr", "redchi", "aic", "aicc", "bic", "rsquared"),
    *("condition_number", "rms_error", "max_error"),
)
"""Attributes of a fit that :func:`to_dict` takes as they are."""


def fit_report(fit: MuscleFit) -> str:
    """Text of :meth:`MuscleFit.fit_report`."""
    order = "" if fit.order is None else f", order {fit.order}"
    law = "linear in pressure" if fit.moduli_kind == "linear" else "free at each level"
    moduli = f", moduli {law}" if fit.nvarys else ""
    rms, worst = fit.errors_of("fitted") or (0.0, 0.0)
    top = "of the map's largest force"
    lines = [
        f"{fit.data.label}: {fit.model}{order}{moduli}",
        f"  points fitted {fit.ndata} of {len(fit.data.used)} rows, {fit.nvarys} unknowns, "
        f"condition number {fit.condition_number:.3g}",
        f"  force error, {top}: rms {100 * rms:.2f} %, max {100 * worst:.2f} %; R2 "
        f"{fit.rsquared:.5f}",
    ]
    held_out = fit.errors_of("held_out")
    if held_out is not None:
        lines.append(
            f"  levels not fitted, of the same:          rms {100 * held_out[0]:.2f} %, max "
            f"{100 * held_out[1]:.2f} %"
        )
    aicc = "none" if fit.aicc is None else f"{fit.aicc:.1f}"
    lines += [
        f"  {_scatter(fit)}",
        f"  with all {fit.ndata} points as independent: AIC {fit.aic:.1f}, AICc {aicc}, BIC "
        f"{fit.bic:.1f}",
    ]
    if fit.params:
        kind = "by level" if fit.errors == "level" else "plain"
        lines += ["", f"  {'':18} {'value':>12} {'std error':>11}  unit   (standard errors {kind})"]
    for item in fit.params.values():
        nominal = "" if item.init_value is None else f"   nominal {item.init_value:.5g}"
        known = "" if item.tolerance is None else f" +- {item.tolerance:.2g}"
        number = f"  {item.name:18} {item.value:12.5g} {item.stderr:11.2g} "
        lines.append(with_unit(number, item.unit) + nominal + known)
    errors = fit.error_by_pressure()
    lines += [
        "",
        "  force error of each level, of the largest force of that level:",
        "  level [kPa]  points       rms [%]       max [%]",
    ]
    columns = (errors.levels, errors.points, errors.rms, errors.max, errors.fitted)
    for level, points, mean, largest, fitted in zip(*columns, strict=True):
        mark = "" if fitted else "  not fitted"
        lines.append(
            f"  {level / 1e3:11.5g} {points:7d} {100 * mean:13.2f} {100 * largest:13.2f}{mark}"
        )
    lines += [f"  {errors.note}"] if errors.note else []
    lines += [f"  note: {note}" for note in (*fit.data.issues, *fit.warnings)]
    return "\n".join(lines) + "\n"


def _scatter(fit: MuscleFit) -> str:
    """The sum of squares, measured by the stated noise where there is one, else as newtons."""
    rms = float(np.sqrt(np.mean((fit.all_residuals[fit.fitted[fit.data.used]]) ** 2)))
    unit = " N2" if fit.weights == "force" else " (residuals over the largest force of their level)"
    text = f"chi2 {fit.chisqr:.4g}{unit}, residual rms {rms:.4g} N"
    if fit.stated_noise is None:
        return text
    shown = f"{fit.stated_noise:.4g} N"
    if fit.weights != "force":
        shown = f"{100 * fit.stated_noise:.3g} % of the level's largest force"
    reduced = f"reduced chi2 {fit.redchi / fit.stated_noise**2:.4g}"
    return f"{text}, {reduced} with the stated noise of {shown}"


def to_rig(fit: MuscleFit, rig: Rig | None) -> Rig:
    """Rig of :meth:`MuscleFit.to_rig`: the given one, or a bench, with the fitted muscle."""
    muscle = fit.muscle
    parameters = dict(muscle.parameters)
    if rig is None:
        rig = bench(muscle)
    base = rig.model
    if base["muscle"] is not None:
        parameters["count"] = base["muscle"]["count"]
    known = {
        name: given.tol
        for name, given in rig.parameters.items()
        if given.tol > 0.0
        and not (
            name.startswith("muscle.")
            and parameters.get(name.removeprefix("muscle.")) != given.value
        )
    }
    fitted = {f"muscle.{free.name}": fit.params[free.name].stderr for free in fit.free}
    return replace(rig, _model={**base, "muscle": parameters}, _tolerances={**known, **fitted})


def to_lmfit(params: Mapping[str, Any], covar: Array) -> Any:
    """Parameters of :meth:`MuscleFit.to_lmfit` and :meth:`FrictionFit.to_lmfit`.

    Parameters
    ----------
    params : mapping of str to FitParameter or LawParameter
        The numbers of a fit.
    covar : (p, p) array
        Their covariance.
    """
    try:
        from lmfit import Parameters
    except ImportError as error:
        raise missing_package(error, "lmfit") from error
    found, names = Parameters(), [re.sub(r"\W", "_", name) for name in params]
    spread = np.sqrt(np.diag(covar))
    with np.errstate(invalid="ignore", divide="ignore"):
        together = covar / np.outer(spread, spread)
    for k, (name, item) in enumerate(zip(names, params.values(), strict=True)):
        found.add(name, value=item.value, user_data={"unit": item.unit})
        one = found[name]
        one.stderr = item.stderr if np.isfinite(item.stderr) else None
        one.init_value = getattr(item, "init_value", None)
        one.correl = {o: float(together[k, i]) for i, o in enumerate(names) if i != k}
    return found


def to_dict(fit: MuscleFit) -> dict[str, Any]:
    """Plain data of :meth:`MuscleFit.to_dict`."""
    by_pressure = fit.error_by_pressure()
    held_out = fit.errors_of("held_out")
    return {
        "model": fit.model,
        "geometry": fit.geometry,
        "order": fit.order,
        "moduli": fit.moduli_kind,
        "parameters": [item.__dict__.copy() for item in fit.params.values()],
        "covar": fit.covar.tolist(),
        **{name: getattr(fit, name) for name in _NUMBERS},
        "held_out_rms_error": held_out and held_out[0],
        "held_out_max_error": held_out and held_out[1],
        "levels": by_pressure.levels.tolist(),
        "level_rms": by_pressure.rms.tolist(),
        "level_max": by_pressure.max.tolist(),
        "level_fitted": by_pressure.fitted.tolist(),
        "weak_levels": by_pressure.weak.tolist(),
        "success": fit.success,
        "message": fit.message,
        "warnings": list(fit.warnings),
    }
