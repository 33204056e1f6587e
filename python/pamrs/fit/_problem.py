"""The least-squares step that every fit uses: scaled columns, SVD, collinear columns named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pamrs._arrays import Array
from pamrs.errors import FitError

#: Ratio of the smallest to the largest singular value below which columns count as collinear.
RANK_TOLERANCE = 1e-10


@dataclass(frozen=True)
class Solution:
    """A linear least-squares solution.

    Attributes
    ----------
    x : (k,) array
        Coefficients.
    residual : (n,) array
        ``y - A x``.
    span : (n, k) array
        Orthonormal basis of the columns of ``A``.
    condition_number : float
        Of ``A`` with every column scaled to length 1; 1 when there is no column.
    """

    x: Array
    residual: Array
    span: Array
    condition_number: float


def decompose(
    matrix: Array, names: Sequence[str], hint: str = ""
) -> tuple[Array, Array, Array, Array]:
    """Scale the columns to length 1 and take the SVD.

    Parameters
    ----------
    matrix : (n, k) array
        Design matrix, ``k >= 1``.
    names : sequence of str
        Names of the columns, for messages.
    hint : str
        What would help, added to the message.

    Returns
    -------
    scale, U, s, Vt : arrays
        ``matrix = U diag(s) Vt diag(scale)``.

    Raises
    ------
    FitError
        If a column is zero or columns are collinear (smallest singular value below 1e-10 of the
        largest).
    """
    scale = np.linalg.norm(matrix, axis=0)
    empty = [name for name, size in zip(names, scale.tolist(), strict=True) if size == 0.0]
    if empty:
        raise FitError(
            f"{', '.join(empty)} {'has' if len(empty) == 1 else 'have'} no effect on any fitted "
            f"point{hint}"
        )
    if not np.isfinite(matrix).all():
        raise FitError("the model gives no finite force at some of the fitted points")
    u, s, vt = np.linalg.svd(matrix / scale, full_matrices=False)
    if s[-1] <= RANK_TOLERANCE * s[0]:
        share = np.abs(vt[-1])
        mixed = [
            name
            for name, part in zip(names, share.tolist(), strict=True)
            if part > 0.1 * share.max()
        ]
        raise FitError(
            f"the fitted points cannot tell apart {', '.join(mixed)}: their columns are "
            f"collinear{hint}"
        )
    return scale, u, s, vt


def solve(matrix: Array, target: Array, names: Sequence[str], hint: str = "") -> Solution:
    """Least squares by SVD with scaled columns; nothing is regularised.

    Parameters
    ----------
    matrix : (n, k) array
        Design matrix; ``k`` may be 0.
    target : (n,) array
        Right-hand side.
    names : sequence of str
        Names of the columns.
    hint : str
        What would help if the columns are collinear.

    Returns
    -------
    Solution

    Raises
    ------
    FitError
        If columns are zero or collinear.
    """
    if matrix.shape[1] == 0:
        return Solution(np.empty(0), target.copy(), np.empty((len(target), 0)), 1.0)
    scale, u, s, vt = decompose(matrix, names, hint)
    x = (vt.T @ ((u.T @ target) / s)) / scale
    return Solution(x, target - matrix @ x, u, float(s[0] / s[-1]))


def project_out(matrix: Array, target: Array) -> Array:
    """The part of ``target`` that no combination of the columns reaches (the inner step of variable
    projection).
    """
    if matrix.shape[1] == 0:
        return target
    q, _ = np.linalg.qr(matrix / np.maximum(np.linalg.norm(matrix, axis=0), np.finfo(float).tiny))
    return np.asarray(target - q @ (q.T @ target))
