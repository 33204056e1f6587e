"""What a cylinder's friction depends on: laws of pressure and of speed side by side, with
probabilities.

Every law is ``F = f0 + f1 p + fv v + fs exp(-v / vs)`` with some of its terms, each of them
friction, so that none is negative. The observations are the pressures (levels), each a mean over
its pairs of strokes; they scatter about the law by that mean's error and by what differs from run
to run. Coefficients, speed scale and scatter are integrated over wide priors of the size of the
friction itself (Kass & Raftery 1995), and each level is predicted from the others, which asks for
no such prior's height.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp
from scipy.stats import norm, qmc

from cases.zillen_cylinders.laws import LevelFriction, columns, fit_cylinder_friction
from cases.zillen_cylinders.record import FrictionRecord
from pamrs.errors import RecordingError

__all__ = ["COMPARED", "LawComparison", "compare_friction_laws"]

Array = NDArray[np.float64]

#: Terms of each law: Coulomb ``c``, pressure ``p``, viscous ``v``, Stribeck ``s``.
COMPARED: Final[dict[str, str]] = {
    "coulomb": "c",
    "coulomb_viscous": "cv",
    "stribeck": "cs",
    "proportional": "p",
    "coulomb_pressure": "cp",
    "pressure_speed": "cpv",
}
_DRAWS: Final = 2**15
_FEWEST: Final = 3
_SCATTER: Final = (0.01, 0.5)  # of the mean friction: how far runs may lie off any law
_SPEEDS: Final = (0.2, 5.0)  # of the mean speed: scale of the Stribeck term
_TOLD: Final = 0.9
_COLLINEAR: Final = 0.95


@dataclass(frozen=True)
class LawComparison:
    """Laws compared on one cylinder.

    Attributes
    ----------
    name : str
        The cylinder.
    probabilities : dict of str to float
        Of each law, all being equally likely beforehand; they add up to 1.
    held_out : dict of str to float
        Sum over the levels of the logarithm of the density that the law fitted to the others gives
        them; larger is better.
    range : (float, float)
        Lowest and highest probability that friction depends on pressure, with priors a third and
        three times as wide, and without each of the levels in turn.
    speed_correlation : float
        Of speed and pressure over the levels.
    levels : list of LevelFriction
        What was compared.
    """

    name: str
    probabilities: dict[str, float]
    held_out: dict[str, float]
    range: tuple[float, float]
    speed_correlation: float
    levels: list[LevelFriction]

    @property
    def pressure(self) -> float:
        """Probability that friction depends on pressure."""
        return _of_pressure(self.probabilities)

    @property
    def settled(self) -> bool:
        """Whether pressure is named: by the probability under every prior and subset, and by the
        levels predicted from the others.
        """
        best = max(self.held_out, key=lambda law: self.held_out[law])
        return self.range[0] >= _TOLD and "p" in COMPARED[best]

    def statement(self) -> str:
        """The result in words, and what cannot be told apart."""
        low, high = self.range
        best = max(self.probabilities, key=lambda law: self.probabilities[law])
        said = (
            "depends on pressure"
            if self.settled
            else "is not settled: it may depend on pressure or on speed alone"
        )
        text = (
            f"{self.name}: friction {said} (probability {self.pressure:.3f}, {low:.2f} to "
            f"{high:.2f} over priors and subsets); most probable {best} "
            f"({self.probabilities[best]:.2f})"
        )
        near = [law for law, p in self.probabilities.items() if law != best and p > 0.05]
        if near:
            text += f", not separable from {' and '.join(near)}"
        if abs(self.speed_correlation) > _COLLINEAR:
            text += (
                f"; speed goes with pressure (correlation {self.speed_correlation:.2f}), so that a "
                "share of it may be the speed's"
            )
        return text


def compare_friction_laws(records: Sequence[FrictionRecord], *, name: str = "") -> LawComparison:
    """Compare laws of pressure and speed on the runs of one cylinder.

    Parameters
    ----------
    records : sequence of FrictionRecord
        One run for each pressure.
    name : str, optional
        What to call the cylinder; by default as the fit does.

    Returns
    -------
    LawComparison

    Raises
    ------
    RecordingError
        If there are fewer than three usable pressures.
    """
    fitted = fit_cylinder_friction(records, law="linear")
    levels = fitted.levels
    if len(levels) < _FEWEST:
        raise RecordingError(
            f"{fitted.name}: {len(levels)} pressures; at least {_FEWEST} are needed to compare laws"
        )
    every = np.arange(len(levels))
    likelihoods = _likelihoods(levels)
    total = _evidences(likelihoods, every)
    without = [_evidences(likelihoods, every != k) for k in every]
    held = {law: sum(total[law] - part[law] for part in without) for law in COMPARED}
    tried = [total, *(without if len(levels) > _FEWEST else [])]
    tried += [_evidences(_likelihoods(levels, width), every) for width in (1 / 3, 3.0)]
    shares = [_of_pressure(_shares(found)) for found in tried]
    return LawComparison(
        name or fitted.name,
        _shares(total),
        held,
        (min(shares), max(shares)),
        fitted.speed_correlation,
        levels,
    )


def _of_pressure(probabilities: dict[str, float]) -> float:
    """Probability of the laws with a term of pressure."""
    return sum(p for law, p in probabilities.items() if "p" in COMPARED[law])


def _likelihoods(levels: Sequence[LevelFriction], width: float = 1.0) -> dict[str, Array]:
    """For each law the logarithm of each level's density (columns) under draws from the law's
    prior (rows).
    """
    pressure, friction, error, speed = columns(levels)
    size = float(np.mean(np.abs(friction)))
    draws = qmc.Sobol(6, scramble=True, seed=1).random(_DRAWS)
    # no friction is negative
    weight = width * size * norm.ppf(0.5 + 0.5 * np.clip(draws[:, :4], 1e-9, 1.0 - 1e-9))
    scatter = size * _SCATTER[0] * (_SCATTER[1] / _SCATTER[0]) ** draws[:, 4]
    scale = speed.mean() * _SPEEDS[0] * (_SPEEDS[1] / _SPEEDS[0]) ** draws[:, 5]
    falling = np.exp(-speed / scale[:, None])
    terms = {
        "c": weight[:, :1] * np.ones_like(pressure),
        "p": weight[:, 1:2] * pressure / pressure.mean(),
        "v": weight[:, 2:3] * speed / speed.mean(),
        "s": weight[:, 3:4] * falling / np.exp(-speed.mean() / scale)[:, None],
    }
    spread = np.hypot(scatter[:, None], error)
    return {
        law: np.asarray(norm.logpdf(friction, np.sum([terms[term] for term in of], axis=0), spread))
        for law, of in COMPARED.items()
    }


def _evidences(likelihoods: dict[str, Array], used: NDArray[np.generic]) -> dict[str, float]:
    """Logarithm of the likelihood of some levels under each law, averaged over its prior."""
    return {
        law: float(logsumexp(rows[:, used].sum(axis=1)) - np.log(len(rows)))
        for law, rows in likelihoods.items()
    }


def _shares(evidence: dict[str, float]) -> dict[str, float]:
    """Evidences as probabilities."""
    total = logsumexp(list(evidence.values()))
    return {law: float(np.exp(value - total)) for law, value in evidence.items()}
