"""SINDy on the residual: a sparse equation of motion for it in measured signals, with its own
memory.

Brunton, Proctor & Kutz (2016), with pysindy's sequentially thresholded least squares. For a
residual r in units of its noise and measured signals u, the candidates of r itself (order 0), of
dr/dt (1) or of the rate of dr/dt (2) are 1, u, |u|, sign u, u|u|, all products of two signals, and
r (and dr/dt) times 1 and u. Size of the library, order and threshold are chosen by leaving out one
recording to fit at a time; "no correction" takes part in that choice. Rates and candidates are
averaged over 0.2 s before they are compared (the weak form with a box as test function, after
Schaeffer & McCalla 2017), or noise would drown the rates. The equation is integrated over the
diagnosis' windows, from the smoothed residual at the start of each; where its memory would grow by
itself, it is held at neither growing nor decaying.
"""

from __future__ import annotations

import itertools
import warnings
from dataclasses import dataclass

import numpy as np
import pysindy
from scipy.signal import savgol_filter

from benchmarks.baselines.sheet import Array, Column, Stretch

ORDERS = (0, 1, 2)
LIBRARIES = ("linear", "even and odd", "full")
"""1 and u; with |u|, sign u and u|u|; with all products."""
THRESHOLDS = (0.05, 0.2)
"""Least share of the rate's scatter that a term must bring."""
RIDGE = 1e-3
SMOOTHING = 11
"""Length of the local parabola for rates, in means of 0.02 s."""
BOX, THIN = 10, 5
"""Means of 0.02 s that are averaged for the regression, and every how many are kept."""
BEYOND = 3.0
"""Multiple of the largest residual learnt from at which an equation is stopped."""


def library(u: Array, names: tuple[str, ...], size: str) -> tuple[Array, list[str]]:
    """Candidate terms of the measured signals, (m, n), and what they are called; `size` is one of
    :data:`LIBRARIES`.
    """
    terms = [np.ones(len(u))]
    called = ["1"]
    for i, name in enumerate(names):
        column = u[:, i]
        terms.append(column)
        called.append(name)
        if size != "linear":
            terms += [np.abs(column), np.sign(column), column * np.abs(column)]
            called += [f"|{name}|", f"sign({name})", f"{name}|{name}|"]
    if size != "full":
        return np.column_stack(terms), called
    for i, j in itertools.combinations_with_replacement(range(len(names)), 2):
        terms.append(u[:, i] * u[:, j])
        called.append(f"{names[i]} {names[j]}")
    return np.column_stack(terms), called


def _states(y: Array, dt: float, order: int) -> tuple[Array, Array]:
    """State (m, order) and rate (m,) of its last, by local parabolas."""
    length = min(SMOOTHING, (len(y) - 1) // 2 * 2 + 1)
    smooth = [savgol_filter(y, length, 3, deriv=d, delta=dt) for d in range(order + 1)]
    return np.column_stack(smooth[:-1]) if order else np.zeros((len(y), 0)), smooth[-1]


@dataclass(frozen=True, eq=False)
class Equation:
    """A sparse equation: rate = terms @ a + state @ memory(u).

    Attributes
    ----------
    order : int
        0: for the residual itself; 1: of motion of the residual; 2: of its rate.
    a : (n,) array
        Coefficients of the measured terms.
    memory : (order, 1) or (order, 1 + k) array
        Those of each state times 1 and, full library, the signals.
    limit : float
        Size at which it is stopped.
    """

    order: int
    a: Array
    memory: Array
    limit: float

    def text(self, called: list[str], names: tuple[str, ...]) -> str:
        """The terms that are left, as one line; signals in units of their scatter, the residual in
        units of its noise.
        """
        parts = [f"{c:+.3g} {t}" for c, t in zip(self.a, called, strict=True) if c]
        for state, row in zip(("r", "dr"), self.memory, strict=False):
            parts += [f"{c:+.3g} {state} {t}" for c, t in zip(row, ("", *names), strict=False) if c]
        return ("r = ", "dr/dt = ", "d2r/dt2 = ")[self.order] + (
            " ".join(p.strip() for p in parts) or "0"
        )

    def run(self, stretch: Stretch, terms: Array) -> Array:
        """Integrate over the windows of a stretch by the trapezoidal rule; (m,) in units of the
        noise.
        """
        out = np.zeros(len(stretch.y))
        drive = terms @ self.a
        if self.order == 0:
            return np.clip(drive, -self.limit, self.limit)
        width = self.memory.shape[1] - 1
        feedback = np.minimum(
            np.column_stack([np.ones(len(stretch.u)), stretch.u[:, :width]]) @ self.memory.T, 0.0
        )
        h = 0.5 * stretch.dt
        for a, b in stretch.pieces:
            x = _states(stretch.y[a:b], stretch.dt, self.order)[0][0]
            if self.order == 1:
                out[a:b] = _first(float(x[0]), drive[a:b], feedback[a:b, 0], h)
            else:
                out[a:b] = _second((float(x[0]), float(x[1])), drive[a:b], feedback[a:b], h)
        return np.clip(
            np.nan_to_num(out, nan=self.limit, posinf=self.limit, neginf=-self.limit),
            -self.limit,
            self.limit,
        )


def _first(x: float, drive: Array, rate: Array, h: float) -> list[float]:
    out = [x]
    forth = ((1.0 + h * rate[:-1]) / np.maximum(1.0 - h * rate[1:], 1e-2)).tolist()
    push = (h * (drive[:-1] + drive[1:]) / np.maximum(1.0 - h * rate[1:], 1e-2)).tolist()
    for f, p in zip(forth, push, strict=True):
        x = min(max(f * x + p, -1e9), 1e9)
        out.append(x)
    return out


def _second(x: tuple[float, float], drive: Array, feedback: Array, h: float) -> list[float]:
    r, v = x
    out = [r]
    d, k, c = drive.tolist(), feedback[:, 0].tolist(), feedback[:, 1].tolist()
    for i in range(len(d) - 1):
        # (I - h M) x' = (I + h M) x + h (b + b'), M = [[0, 1], [k, c]]
        right_r = r + h * v
        right_v = v + h * (k[i] * r + c[i] * v + d[i] + d[i + 1])
        below = 1.0 - h * c[i + 1] - h * h * k[i + 1]
        below = below if abs(below) > 1e-2 else 1e-2
        v = min(max((right_v + h * k[i + 1] * right_r) / below, -1e9), 1e9)
        r = min(max(right_r + h * v, -1e9), 1e9)
        out.append(r)
    return out


def _boxed(values: Array) -> Array:
    """Running means over :data:`BOX` rows, every :data:`THIN`-th kept."""
    total = np.cumsum(np.concatenate([np.zeros((1, values.shape[1])), values]), axis=0)
    return np.asarray((total[BOX:] - total[:-BOX])[::THIN] / BOX)


def _full(terms: Array, u: Array) -> bool:
    return bool(terms.shape[1] > 1 + 4 * u.shape[1])


def _rows(stretches: list[Stretch], terms: list[Array], order: int) -> tuple[Array, Array]:
    """Candidates (rows, n) and rates (rows,), window by window."""
    candidates, rates = [], []
    for stretch, table in zip(stretches, terms, strict=True):
        # products of memory and signals belong to the full library
        ones = (
            np.column_stack([np.ones(len(stretch.u)), stretch.u])
            if _full(table, stretch.u)
            else np.ones((len(stretch.u), 1))
        )
        for a, b in stretch.pieces:
            state, rate = _states(stretch.y[a:b], stretch.dt, order)
            memory = [ones[a:b] * state[:, [s]] for s in range(order)]
            candidates.append(_boxed(np.column_stack([table[a:b], *memory])))
            rates.append(_boxed(rate[:, None])[:, 0])
    return np.concatenate(candidates), np.concatenate(rates)


def learnt(
    stretches: list[Stretch], terms: list[Array], order: int, threshold: float
) -> Equation | None:
    """Fit an equation; None where nothing can be learnt."""
    if not any(s.pieces for s in stretches):
        return None
    candidates, rates = _rows(stretches, terms, order)
    width = np.sqrt((candidates**2).mean(axis=0))
    kept = width > 1e-9
    size = float(np.sqrt((rates**2).mean()))
    if size <= 0.0:
        return None
    scaled = candidates[:, kept] / width[kept]
    model = pysindy.SINDy(
        optimizer=pysindy.STLSQ(threshold=threshold, alpha=RIDGE * len(scaled), max_iter=20),
        feature_library=pysindy.IdentityLibrary(),
    )
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore"
        )  # "sparsity parameter is too big": nothing is left, which is an answer
        model.fit(
            scaled,
            t=stretches[0].dt,
            x_dot=np.repeat(rates[:, None] / size, scaled.shape[1], axis=1)[:, :1],
        )
    found = np.zeros(width.size)
    found[kept] = np.asarray(model.coefficients())[0] * size / width[kept]
    n = terms[0].shape[1]
    limit = BEYOND * max(float(np.abs(s.y).max()) for s in stretches)
    return Equation(
        order, found[:n], found[n:].reshape(order, -1) if order else np.zeros((0, 1)), limit
    )


def correct(column: Column) -> tuple[list[Array], str]:
    """Corrections for the held-out stretches of a block, and the equation that gave them."""
    tables = {
        size: [library(s.u, column.names, size)[0] for s in column.inner] for size in LIBRARIES
    }
    before = [s.error() for s in column.inner]
    best: tuple[str, int, float] | None = None
    least = 1.0
    if len(column.inner) > 1:
        for size, order, threshold in itertools.product(LIBRARIES, ORDERS, THRESHOLDS):
            terms, total = tables[size], 0.0
            for left, stretch in enumerate(column.inner):
                rest = [i for i in range(len(terms)) if i != left]
                equation = learnt(
                    [column.inner[i] for i in rest], [terms[i] for i in rest], order, threshold
                )
                change = (
                    np.zeros(len(stretch.y))
                    if equation is None
                    else equation.run(stretch, terms[left])
                )
                total += stretch.error(change) / max(before[left], 1e-9) / len(terms)
            if total < least:
                best, least = (size, order, threshold), total
    equation = None if best is None else learnt(column.inner, tables[best[0]], *best[1:])
    if best is None or equation is None or not (equation.a.any() or equation.memory.any()):
        return [np.zeros(len(s.y)) for s in column.outer], "no correction"
    called = library(column.outer[0].u, column.names, best[0])[1]
    return [
        equation.run(s, library(s.u, column.names, best[0])[0]) for s in column.outer
    ], equation.text(called, column.names)
