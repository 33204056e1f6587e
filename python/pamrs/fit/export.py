"""A muscle fit handed on: as text, as plain numbers, as a rig."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pamrs.muscle_models import ELASTIC_PARAMETERS

if TYPE_CHECKING:
    from pamrs.fit.result import MuscleFit
    from pamrs.rig import Rig

__all__ = ["fit_report", "to_dict", "to_rig"]


def fit_report(fit: MuscleFit) -> str:
    """What :meth:`MuscleFit.fit_report` returns."""
    order = "" if fit.order is None else f", order {fit.order}"
    moduli = "" if not fit.nvarys else f", moduli {'linear in pressure' if fit.moduli_kind == 'linear' else 'free at each level'}"
    rms, worst = fit.errors_of("fitted") or (0.0, 0.0)
    lines = [
        f"{fit.data.label}: {fit.model}{order}{moduli}",
        f"  points fitted {fit.ndata} of {len(fit.data.used)} rows, {fit.nvarys} unknowns, condition number {fit.condition_number:.3g}",
        f"  force error, of the largest force: rms {100 * rms:.2f} %, max {100 * worst:.2f} %; R2 {fit.rsquared:.5f}",
    ]
    held_out = fit.errors_of("held_out")
    if held_out is not None:
        lines.append(f"  levels not fitted:                 rms {100 * held_out[0]:.2f} %, max {100 * held_out[1]:.2f} %")
    aicc = "none" if fit.aicc is None else f"{fit.aicc:.1f}"
    lines.append(f"  chi2 {fit.chisqr:.4g}, reduced {fit.redchi:.4g}, AIC {fit.aic:.1f}, AICc {aicc}, BIC {fit.bic:.1f}")
    if fit.params:
        kind = "by level" if fit.errors == "level" else "plain"
        lines += ["", f"  {'':18} {'value':>12} {'std error':>11}  unit   (standard errors {kind})"]
    for item in fit.params.values():
        nominal = "" if item.init_value is None else f"   nominal {item.init_value:.5g}"
        known = "" if item.tolerance is None else f" +- {item.tolerance:.2g}"
        lines.append(f"  {item.name:18} {item.value:12.5g} {item.stderr:11.2g}  {item.unit}{nominal}{known}")
    lines += ["", "  level [kPa]  points  rms/Fmax [%]  max/Fmax [%]"]
    errors = fit.error_by_pressure()
    for level, points, mean, largest, fitted in zip(errors.levels, errors.points, errors.rms, errors.max, errors.fitted, strict=True):
        mark = "" if fitted else "  not fitted"
        lines.append(f"  {level / 1e3:11.5g} {points:7d} {100 * mean:13.2f} {100 * largest:13.2f}{mark}")
    lines += [f"  note: {note}" for note in (*fit.data.issues, *fit.warnings)]
    return "\n".join(lines) + "\n"


def to_rig(fit: MuscleFit, rig: Rig | None) -> Rig:
    """What :meth:`MuscleFit.to_rig` returns."""
    from pamrs.rig import Rig
    from pamrs.rigs import bench

    muscle = fit.muscle
    parameters = dict(muscle.parameters)
    if rig is None:
        rig = bench(muscle)
    base = rig.model
    if base["muscle"] is not None:
        parameters["count"] = base["muscle"]["count"]
    elastic = {f"muscle.{name}" for names in ELASTIC_PARAMETERS.values() for name in names}
    known = {name: given.tol for name, given in rig.parameters.items() if given.tol > 0.0 and name not in elastic}
    fitted = {f"muscle.{free.name}": fit.params[free.name].stderr for free in fit.free}
    return Rig(rig.name, {**base, "muscle": parameters}, {**known, **fitted}, rig.effect_std, rig.source)


def to_dict(fit: MuscleFit) -> dict[str, Any]:
    """What :meth:`MuscleFit.to_dict` returns."""
    by_pressure = fit.error_by_pressure()
    held_out = fit.errors_of("held_out")
    return {
        "model": fit.model,
        "geometry": fit.geometry,
        "order": fit.order,
        "moduli": fit.moduli_kind,
        "parameters": [item.__dict__.copy() for item in fit.params.values()],
        "covar": fit.covar.tolist(),
        "errors": fit.errors,
        "ndata": fit.ndata,
        "nvarys": fit.nvarys,
        "chisqr": fit.chisqr,
        "redchi": fit.redchi,
        "aic": fit.aic,
        "aicc": fit.aicc,
        "bic": fit.bic,
        "rsquared": fit.rsquared,
        "condition_number": fit.condition_number,
        "rms_error": fit.rms_error,
        "max_error": fit.max_error,
        "held_out_rms_error": held_out and held_out[0],
        "held_out_max_error": held_out and held_out[1],
        "levels": by_pressure.levels.tolist(),
        "level_rms": by_pressure.rms.tolist(),
        "level_max": by_pressure.max.tolist(),
        "level_fitted": by_pressure.fitted.tolist(),
        "success": fit.success,
        "message": fit.message,
        "warnings": list(fit.warnings),
    }
