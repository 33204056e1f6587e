"""Result of a muscle fit: predictions, errors, exports."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pamrs._arrays import Array, ArrayLike
from pamrs._checks import contraction_of, matched, one_of, quantities
from pamrs._views import Panels, View
from pamrs._writing import write_atomically
from pamrs.errors import ParameterError
from pamrs.fit._data import ForceMap
from pamrs.fit._design import friction_factor
from pamrs.fit._export import fit_report, to_dict, to_lmfit, to_rig
from pamrs.fit._statistics import FitStatistics, determination
from pamrs.fit._validation import CrossValidation, PressureErrors, leave_one_out, summary
from pamrs.rig import Rig
from pamrs.units import with_unit

Flags = NDArray[np.uint8]

#: Bits of the flags of :meth:`MuscleFit.outside`.
OUTSIDE_PRESSURE, OUTSIDE_CONTRACTION = 1, 2


@dataclass(frozen=True, eq=False, repr=False)
class MuscleFit(View, FitStatistics):
    """A fitted muscle: made by :func:`pamrs.fit.fit_muscle`.

    It has the numbers of the fit (:class:`pamrs.fit._statistics.FitStatistics`), errors by pressure
    and on pressures left out, and it predicts.
    """

    def _panels(self) -> Panels:
        return {"force": self._draw}

    def _draw(self, axes: Any) -> None:
        from pamrs.fit._figures import draw_family

        axes.figure.colorbar(draw_family(axes, self), ax=axes, label="pressure [kPa]")

    def _numbers(self) -> dict[str, str]:
        values = {
            item.name: with_unit(f"{item.value:.5g} ± {item.stderr:.2g}", item.unit)
            for item in self.params.values()
        }
        error = f"{100 * self.rms_error:.3g} % of the largest force"
        return {"model": self.model, "points": str(self.ndata), "rms error": error, **values}

    @cached_property
    def all_residuals(self) -> Array:
        """Measured minus model force [N] of all used rows of the map, fitted or not."""
        everything = np.ones_like(self._rows)
        found = self._estimate
        matrix, target = self._problem.system(found.design, found.blank, everything)
        return (target - matrix @ found.x) / self._problem.weight

    def error_by_pressure(self) -> PressureErrors:
        """The measure (2.37) of every level of the map, fitted or not: rms of
        ``(F - F_model)/F_max`` of the level.

        Levels whose own largest force is below 1 % of the map's are not in it but named: no force
        there to measure errors by.
        """
        everything = np.ones_like(self._rows)
        return PressureErrors.of(self._problem, self.all_residuals, everything, self._rows)

    def errors_of(self, rows: Literal["fitted", "held_out", "all"]) -> tuple[float, float] | None:
        """Rms and largest force error as fractions of the map's largest force.

        Parameters
        ----------
        rows : {"fitted", "held_out", "all"}
            Rows of the fit, the other used rows of the map, or both.

        Returns
        -------
        rms, max : float
            None when there is no such row.
        """
        masks = {"fitted": self._rows, "held_out": ~self._rows, "all": np.ones_like(self._rows)}
        chosen = masks[one_of("rows", rows, masks)]
        return summary(self.all_residuals[chosen], float(self._problem.force.max()))

    @property
    def rms_error(self) -> float:
        """Rms force error of all used rows, fitted or not, as a fraction of the map's largest force
        [1].
        """
        return (self.errors_of("all") or (0.0, 0.0))[0]

    @property
    def max_error(self) -> float:
        """Largest force error of all used rows, fitted or not, as a fraction of the map's largest
        force [1].
        """
        return (self.errors_of("all") or (0.0, 0.0))[1]

    def leave_one_pressure_out(self) -> CrossValidation:
        """Predict every fitted level by a fit of the other levels; geometry, where free, is fitted
        anew each time.

        Returns
        -------
        CrossValidation

        Raises
        ------
        FitError
            If the other levels do not determine the fit.
        """
        return self._cross_validation

    @cached_property
    def _cross_validation(self) -> CrossValidation:
        return leave_one_out(self._problem, self._estimate, self._rows)

    # -------------------------------------------------------------- prediction

    def _points(
        self,
        pressure: ArrayLike,
        contraction: ArrayLike | None,
        length: ArrayLike | None,
        direction: ArrayLike | None,
    ) -> tuple[Array, Array, Array]:
        """Pressure, contraction, direction in one shape; direction NaN-free, 0 where none."""
        rest = self._estimate.blank.parameters["rest_length"]
        contraction = contraction_of(contraction, length, rest)
        way = 0.0 if direction is None else direction
        p, e, d = matched(pressure=pressure, contraction=contraction, direction=way)
        return p, e, d

    def outside(
        self,
        pressure: ArrayLike,
        contraction: ArrayLike | None = None,
        *,
        length: ArrayLike | None = None,
    ) -> Flags:
        """Flags of predictions that extrapolate.

        Parameters
        ----------
        pressure, contraction, length : array_like
            As in :meth:`predict`.

        Returns
        -------
        ndarray of uint8
            0 inside the fitted range, 1 pressure outside, 2 contraction outside, 3 both, in the
            broadcast shape.
        """
        p, e, _ = self._points(pressure, contraction, length, None)
        rest = self._estimate.blank.parameters["rest_length"]
        seen_e = 1.0 - self._problem.length[self._rows] / rest
        seen_p = self._problem.knot(self._rows)
        slack_p, slack_e = 1e-9 * float(seen_p.max()), 1e-9
        beyond_p = (p < seen_p.min() - slack_p) | (p > seen_p.max() + slack_p)
        beyond_e = (e < seen_e.min() - slack_e) | (e > seen_e.max() + slack_e)
        flags = beyond_p * OUTSIDE_PRESSURE + beyond_e * OUTSIDE_CONTRACTION
        return np.asarray(flags, dtype=np.uint8)

    @quantities
    def predict(
        self,
        pressure: ArrayLike,
        contraction: ArrayLike | None = None,
        *,
        length: ArrayLike | None = None,
        direction: ArrayLike | None = None,
    ) -> Array:
        """Force of the fitted model [N]; :meth:`outside` tells where that extrapolates.

        Parameters
        ----------
        pressure : array_like
            Gauge pressure [Pa].
        contraction : array_like, optional
            Contraction ratio [1] of the *fitted* rest length; this or ``length``. All arguments
            broadcast.
        length : array_like, optional
            Length [m].
        direction : array_like, optional
            -1 while contracting, +1 while lengthening, 0 midway between the branches; None without
            friction.

        Returns
        -------
        ndarray
            In the broadcast shape.

        Raises
        ------
        ParameterError
            If a value is not finite, a pressure below vacuum, a contraction beyond the braid's
            limits, or a pressure beyond the fitted levels where moduli free at each level have no
            law.
        """
        p, e, d = self._points(pressure, contraction, length, direction)
        design, blank = self._estimate.design, self._estimate.blank
        if not design.per_level:
            muscle = design.muscle(blank, self._estimate.x)
            return muscle.force(p, e) if direction is None else muscle.force(p, e, direction=d)
        low, high = float(design.knots[0]), float(design.knots[-1])
        slack = 1e-9 * high
        if p.size and (p.min() < low - slack or p.max() > high + slack):
            raise ParameterError(
                f"pressure from {p.min() / 1e3:g} to {p.max() / 1e3:g} kPa: moduli free at each "
                f"level are known from {low / 1e3:g} to {high / 1e3:g} kPa; moduli='linear' has a "
                "law beyond"
            )
        blank.force(p, e)  # refuses what the braid cannot do
        flat_p, flat_d = p.ravel(), d.ravel()
        gas, columns = design.columns(blank, flat_p, e.ravel(), flat_d, design.weights(flat_p))
        force = gas + columns @ self._estimate.x
        return np.asarray(force * friction_factor(blank, flat_p, flat_d, force)).reshape(p.shape)

    def score(self, data: ForceMap | None = None) -> float:
        """Coefficient of determination R² of the predictions on a map.

        Parameters
        ----------
        data : ForceMap, optional
            Another map of the same muscle; by default the fitted one, all used rows.

        Returns
        -------
        float
            1 is perfect; 0 is no better than the mean.
        """
        chosen = self.data if data is None else data
        used = chosen.used
        way = chosen.direction[used] if np.any(self._problem.direction) else None
        if way is not None and self.model == "elbow_linear":
            # as in the fit: rows of unknown direction are on the contracting branch
            way = np.where(way == 0, -1, way)
        force = self.predict(chosen.pressure[used], length=chosen.length[used], direction=way)
        return determination(chosen.force[used], force)

    # ----------------------------------------------------------------- handing on

    def to_rig(self, rig: Rig | None = None) -> Rig:
        """A rig with the fitted muscle.

        Parameters
        ----------
        rig : Rig, optional
            Gets its muscle replaced, the number of muscles kept. None makes a bench: gas, muscle,
            and a dead volume of a tenth of the muscle's air; without joint and arm it cannot be
            simulated.

        Returns
        -------
        Rig
            Fitted geometry carries its standard error as tolerance; the rig's other tolerances stay
            where the number does.

        Raises
        ------
        FitError
            When the moduli are free at each level.
        """
        return to_rig(self, rig)

    def to_lmfit(self) -> Any:
        """The fitted numbers as ``lmfit.Parameters``: values, standard errors and correlations, SI
        units in ``user_data["unit"]``.

        Raises
        ------
        MissingPackageError
            If lmfit is not installed.
        """
        return to_lmfit(self.params, self.covar)

    def to_dict(self) -> dict[str, Any]:
        """The fit as plain numbers and text, ready for JSON."""
        return to_dict(self)

    def figure(self, path: str | os.PathLike[str]) -> Path:
        """Write one picture of the fit, a PNG of 1600 x 1000 pixels, and return its path."""
        from pamrs.fit._figures import summary_png

        return write_atomically(path, summary_png(self))

    def fit_report(self) -> str:
        """The fit in words and numbers, for a terminal."""
        return fit_report(self)

    def __repr__(self) -> str:
        order = "" if self.order is None else f" of order {self.order}"
        return (
            f"MuscleFit({self.model}{order}, {self.ndata} points, max error "
            f"{100 * self.max_error:.2f} % of the largest force)"
        )
