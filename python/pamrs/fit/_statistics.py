"""The numbers of a muscle fit: parameters, covariance, information criteria."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from pamrs._arrays import Array, Mask
from pamrs.fit._data import ForceMap
from pamrs.fit._estimate import Estimate, Free, MapProblem
from pamrs.rig import Muscle


@dataclass(frozen=True)
class FitParameter:
    """One fitted number.

    Attributes
    ----------
    name, unit : str
        Its name and SI unit.
    value, stderr : float
        Estimate and its standard error; ``stderr`` follows the fit's ``errors``.
    stderr_plain : float
        Standard error if every residual were independent.
    init_value : float or None
        Nominal value of a geometry parameter; of a modulus, where its prior is.
    tolerance : float or None
        Standard deviation of its prior; None without one.
    vary : bool
        Always True: only fitted numbers are listed.
    """

    name: str
    value: float
    stderr: float
    unit: str
    stderr_plain: float
    init_value: float | None = None
    tolerance: float | None = None
    vary: bool = True


@dataclass(frozen=True, eq=False, repr=False)
class FitStatistics:
    """The numbers of a fit, under the names that lmfit gives them where it has one.

    Residuals are measured minus model; with
    ``weights="level"`` they are divided by the largest force of their level.

    Attributes
    ----------
    data : ForceMap
        The measurements.
    params : dict of str to FitParameter
        Every fitted number, coefficients first, then geometry.
    covar : (p, p) array
        Covariance in the order of ``params``, see :func:`pamrs.fit.fit_muscle` on ``errors``.
    covar_plain : (p, p) array
        The covariance that takes every residual as independent.
    errors : str
        Which covariance ``covar`` is: ``"level"`` or ``"plain"``.
    success : bool
    message : str
        How the fit ended.
    warnings : tuple of str
        What to know before using the numbers.
    """

    data: ForceMap
    params: dict[str, FitParameter]
    covar: Array
    covar_plain: Array
    errors: str
    success: bool
    message: str
    warnings: tuple[str, ...]
    _problem: MapProblem = field(repr=False)
    _estimate: Estimate = field(repr=False)
    _rows: Mask = field(repr=False)

    @property
    def model(self) -> str:
        """Name of the force model."""
        return self._problem.blank.model

    @property
    def geometry(self) -> str:
        """Name of the geometry."""
        return self._problem.blank.geometry

    @property
    def order(self) -> int | None:
        """Order M of the stress polynomial; None for a model without one."""
        return len(self._estimate.design.base) if self._estimate.design.polynomial else None

    @property
    def free(self) -> tuple[Free, ...]:
        """The geometry that was fitted: name, nominal value, tolerance."""
        return self._problem.free

    @property
    def moduli_kind(self) -> str:
        """``"linear"`` (in pressure) or ``"per_level"``."""
        return self._problem.moduli

    @property
    def muscle(self) -> Muscle:
        """The fitted muscle; FitError when the moduli are free at each level (see
        :meth:`muscle_at`).
        """
        return self._estimate.design.muscle(self._estimate.blank, self._estimate.x)

    def muscle_at(self, pressure: float) -> Muscle:
        """The fitted muscle with the moduli of one gauge pressure [Pa], right at that pressure
        only.
        """
        return self._estimate.design.muscle_at(
            self._estimate.blank, self._estimate.x, float(pressure)
        )

    @property
    def x(self) -> Array:
        """Values of ``params`` as an array, as in SciPy."""
        return np.array([item.value for item in self.params.values()])

    @property
    def best_fit(self) -> Array:
        """Model force of the fitted rows [N]."""
        return np.asarray(
            self._problem.force[self._rows] - self.residual / self._problem.weight[self._rows]
        )

    @property
    def residual(self) -> Array:
        """Weighted measured minus model force of the fitted rows, in the order of the map."""
        return self._estimate.residual

    @property
    def ndata(self) -> int:
        """Number of fitted rows."""
        return int(self._rows.sum())

    @property
    def nvarys(self) -> int:
        """Number of fitted numbers, geometry included."""
        return len(self.params)

    @property
    def nfree(self) -> int:
        """``ndata - nvarys``; priors do not count as data."""
        return self.ndata - self.nvarys

    @property
    def chisqr(self) -> float:
        """Sum of squared weighted residuals, without priors."""
        return float(self.residual @ self.residual)

    @property
    def redchi(self) -> float:
        """``chisqr / nfree``."""
        return self.chisqr / max(self.nfree, 1)

    @property
    def noise(self) -> float:
        """Standard deviation of the weighted residuals that priors and standard errors use."""
        return self._estimate.sigma

    @property
    def stated_noise(self) -> float | None:
        """``noise`` as given to the fit; None where it was estimated."""
        return self._problem.noise

    @property
    def weights(self) -> str:
        """``"force"`` or ``"level"``."""
        return "force" if np.all(self._problem.weight == 1.0) else "level"

    def criteria(self, effective_size: float | None = None) -> tuple[float, float | None, float]:
        """AIC, AICc and BIC of a Gaussian fit of unknown noise, ``n log(chisqr/ndata) + penalty``.

        Parameters
        ----------
        effective_size : float, optional
            Number of independent points ``n``; ``ndata`` by default. Residuals of a quasi-static
            map are model error and hang together, so ``ndata`` overstates the evidence.

        Returns
        -------
        aic, aicc, bic : float
            ``aicc`` is None when ``n <= nvarys + 1``: the correction has no value there.
        """
        n = float(self.ndata if effective_size is None else effective_size)
        k = self.nvarys
        least = (1e-15 * float(np.abs(self._problem.force * self._problem.weight).max())) ** 2
        deviance = n * math.log(max(self.chisqr / self.ndata, least))
        aic = deviance + 2.0 * k
        aicc = aic + 2.0 * k * (k + 1.0) / (n - k - 1.0) if n > k + 1.0 else None
        return aic, aicc, deviance + k * math.log(n)

    @property
    def aic(self) -> float:
        """Akaike's criterion with ``n = ndata``."""
        return self.criteria()[0]

    @property
    def aicc(self) -> float | None:
        """Akaike's criterion corrected for few points, ``n = ndata``; None when there are too
        few.
        """
        return self.criteria()[1]

    @property
    def bic(self) -> float:
        """Schwarz's criterion with ``n = ndata``."""
        return self.criteria()[2]

    @property
    def rsquared(self) -> float:
        """Share of the fitted forces' variance about their mean that the model explains [1]."""
        return determination(self._problem.force[self._rows], self.best_fit)

    @property
    def condition_number(self) -> float:
        """Condition number of the design matrix of the coefficients, columns scaled to length 1."""
        return self._estimate.condition_number

    @property
    def fitted(self) -> Mask:
        """Rows of the whole map (n,) that were fitted."""
        mask = np.zeros(len(self.data.used), dtype=bool)
        mask[np.flatnonzero(self.data.used)[self._rows]] = True
        return mask

    def moduli(self) -> tuple[Array, Array, Array]:
        """Moduli at the fitted levels.

        Returns
        -------
        levels : (m,) array
            Pressures [Pa].
        values, stderr : (m, K) array
            ``E_k`` (or c10 and c01, or bladder_modulus) [Pa] and its standard error.
        """
        design = self._estimate.design
        levels = self._problem.levels[np.unique(self._problem.level[self._rows])]
        count, terms = len(self._estimate.x), len(design.base)
        # E_k at a level is a weighted sum of the coefficients of basis function k.
        maps = np.einsum("lj,kq->lkjq", design.weights(levels), np.eye(terms)).reshape(
            len(levels), terms, count
        )
        spread = np.einsum("lki,ij,lkj->lk", maps, self.covar[:count, :count], maps)
        return levels, design.moduli(self._estimate.x, levels), np.sqrt(np.maximum(spread, 0.0))


def determination(measured: Array, model: Array) -> float:
    """1 - residual sum of squares over that about the mean; 0 or 1 when all measurements are
    equal.
    """
    total = float(np.sum((measured - measured.mean()) ** 2))
    rest = float(np.sum((measured - model) ** 2))
    if total == 0.0:
        return 1.0 if rest == 0.0 else 0.0
    return 1.0 - rest / total
