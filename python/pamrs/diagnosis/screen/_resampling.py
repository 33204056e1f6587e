"""How often resampled recordings would have led to the same effects: bootstrap inclusion
frequencies.

A single screen says which effect tells most, not whether another few minutes of the same recordings
would say so too. Segments of all recordings, longer than the residual remembers, are drawn anew
with replacement (H. R. Kuensch, "The jackknife and the bootstrap for general stationary
observations", Annals of Statistics 17, 1989), and forward selection by the score test is done
again: the effect that tells most, then the one that tells most beside it. Signatures and
sensitivities stay those of the whole, so a draw is cheap.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from pamrs._arrays import solve_normal
from pamrs.diagnosis.fit import FIT_BIN_TIME
from pamrs.diagnosis.screen._screening import Screen, best_size
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import Term

# resamples of the recordings that say how often an effect would be taken: within 4 %
_RESAMPLES = 200
# [s] length of the segments that are drawn: longer than the residual remembers (Kuensch (1989))
_RESAMPLE_TIME = 2.5


Array = NDArray[np.float64]


def inclusion_shares(
    screened: Screen, least: float, partner: float, settings: DiagnosisSettings
) -> dict[Term, float]:
    """Share of resamples in which forward selection takes an effect.

    Parameters
    ----------
    screened : Screen
        Signatures at the refitted baseline.
    least : float
        Gain in chi-square from which an effect is taken.
    partner : float
        Share of the resample's sum of squares from which a second one is taken beside the first.
    settings : DiagnosisSettings
        Number and length of the resampled segments, width of the bins, seed.

    Returns
    -------
    dict of Term to float
        By effect, those that were ever taken.
    """
    tangent = screened.tangent
    if not screened.signatures or tangent.rows.size == 0:
        return {}
    columns = np.column_stack(
        [tangent.rows, tangent.jacobian, *(signature for _, _, signature in screened.signatures)]
    )
    length = round(_RESAMPLE_TIME / FIT_BIN_TIME)
    count = -(-columns.shape[0] // length)
    parts = [columns[k * length : (k + 1) * length] for k in range(count)]
    products = np.array([part.T @ part for part in parts])
    rng = np.random.default_rng(settings.seed)
    taken: Counter[Term] = Counter()
    for weights in rng.multinomial(count, np.full(count, 1.0 / count), _RESAMPLES):
        taken.update(
            _selected(
                screened, np.tensordot(weights.astype(np.float64), products, 1), least, partner
            )
        )
    return {effect: number / _RESAMPLES for effect, number in taken.most_common()}


def _selected(screened: Screen, products: Array, least: float, partner: float) -> list[Term]:
    """Effects that forward selection takes, from the products of residual, sensitivities and
    signatures with each other.
    """
    tangent = screened.tangent
    first = 1 + tangent.moved.size
    base, prior, pull = list(range(1, first)), tangent.free, tangent.moved * tangent.free
    columns = list(range(first, products.shape[0]))
    chosen: list[Term] = []
    for threshold in (least, max(least, partner * float(products[0, 0]))):
        normal = products[np.ix_(base, base)] + np.diag(prior)
        normal += 1e-9 * np.diag(np.diag(normal))
        shared = products[np.ix_(base, columns)]
        solved = solve_normal(normal, shared)
        powers = products[columns, columns] - np.sum(shared * solved, axis=0)
        alongs = products[0, columns] - (products[base, 0] + pull) @ solved
        gains = [
            (best_size(float(along), float(power), start)[1], effect, column)
            for column, (effect, start, _), along, power in zip(
                columns, screened.signatures, alongs, powers, strict=True
            )
            if not effect.excluded_by(chosen)
        ]
        gain, effect, column = max(gains, default=(0.0, Term(""), 0))
        if gain <= threshold:
            break
        chosen.append(effect)
        # what was taken is as free as a parameter without a prior
        base.append(column)
        prior, pull = np.append(prior, 0.0), np.append(pull, 0.0)
    return chosen
