"""Sparse closure at the located cut: the fitted form of what no effect explains, or of what the
equations of named effects lack.

A closure is linear in its coefficients, so that at zero (where it changes nothing) one evaluation
gives what every term of its dictionary would do to the residuals, and a few more what those with
memory would do at other memory times and angles. Terms are then chosen by orthogonal forward
selection (Chen, Billings & Luo 1989) with the freedom of the baseline taken away, and only the
chosen ones are fitted in the nonlinear model. Linearising again at that fit corrects a choice that
was made far from it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pamrs._arrays import Array, Mask
from pamrs.diagnosis.fit import (
    Fit,
    Key,
    Problem,
    fit,
    parts_of,
    residuals,
    stacked,
    start_of,
    with_priors,
)
from pamrs.diagnosis.noise import NoiseLevel, correlation_time, inflation_of
from pamrs.diagnosis.prepare import ROUNDING, Block
from pamrs.effects import (
    CLOSURE_OF,
    CLOSURE_TERMS,
    EFFECTS,
    MEMORY_OF,
    ClosureTerm,
    Term,
    effect_of,
)
from pamrs.errors import DiagnosisError, SimulationError
from pamrs.rig import Rig

# share of the misfit that it may leave: with less gain it mends the smoothing of drives
_MOST_MISFIT_SHARE = 0.75
_MOST_TERMS = 6  # terms that it may have: more is no form that a person reads
# evaluations of the fit of the chosen terms at the most; of a first fit of a set (decision 13) or
# of a freed parameter (decision 25), which says if a whole one is worth it; and of a refit of
# persistent effects with events that stay
SHORT_EVALUATIONS = 5
# share of the linear estimate from which the fit is tried where the whole of it gains nothing
_SHRUNK_SHARE = 0.4


@dataclass(frozen=True)
class _ShapedTerm:
    """One term of one closure, with the shape of its memory."""

    closure: str
    term: ClosureTerm
    shape: float | None

    @property
    def name(self) -> str:
        return f"{self.closure}.{self.term.name}"

    @property
    def memory(self) -> str:
        """Dotted name of the shape it depends on, ``""`` for a term without memory."""
        return f"{self.closure}.{MEMORY_OF[self.term.kind]}" if self.term.kind in MEMORY_OF else ""


@dataclass(frozen=True, eq=False)
class _Choice:
    """Terms chosen, with their linear estimates.

    Attributes
    ----------
    values : dict of str to float
        Dotted coefficients, SI.
    shapes : dict of str to float
        Dotted shapes of the memories that they need.
    shift : (b,) array
        What the parameters of the baseline and of its effects move with them, in their scales.
    """

    values: dict[str, float]
    shapes: dict[str, float]
    shift: Array


def find_closure(
    problem: Problem,
    nominal: Rig,
    baseline: Fit,
    inflation: dict[str, float],
    blocks: list[Block],
    say: Callable[[str], None],
    noise_level: Mapping[Key, NoiseLevel] | None = None,
) -> Fit | None:
    """Fit a sparse closure where blocks keep an excess.

    Sensitivities at zero coefficients are taken at four memory times and angles (the first
    evaluation with all terms, the others with those that remember); all chosen terms of a closure
    share one memory time and one memory angle, which the fit then refines. A term is taken while
    the logarithm of the misfit falls by more than its price, counted on independent samples of what
    is left, and while recordings left out are predicted better with it (with one recording only the
    price decides). The choice is made a second time at the fit, residuals inflated by the
    autocorrelation that they have there, and the best of the fits and the baseline is kept. This
    takes ten to fifteen evaluations of the problem.

    Parameters
    ----------
    problem : Problem
        Blocks and recordings.
    nominal : Rig
        Nominal model.
    baseline : Fit
        Its fit to the problem, with sensitivities; effects that it has are refitted with the
        closure.
    inflation : dict of str to float
        Variance of each block's binned residual relative to white sample noise, as in
        :func:`pamrs.diagnosis.fit.fit`.
    blocks : list of Block
        Blocks of the problem that keep an excess: ``supply``, ``chamber``, ``arm``.
    say : callable
        Receives progress.
    noise_level : mapping, optional
        Noise levels: residuals weigh no more than noise of the drives allows.

    Returns
    -------
    Fit or None
        Model with the closure (effects ``closure_*``, the last ones), baseline refitted with it;
        None where no term is worth its price.

    Raises
    ------
    DiagnosisError
        For a block without a closure.
    """
    closures = _closures(blocks)
    say(f"{' and '.join(b.name for b in blocks)}: looking for a form of what is missing")
    candidates, columns = _at_zero(problem, baseline, inflation, blocks, closures)
    first_choice = _select(
        _StackedFit.of(problem, baseline, baseline, inflation), candidates, columns, {}
    )
    first = (
        None
        if first_choice is None
        else _fit_terms(problem, nominal, baseline, inflation, first_choice, say)
    )
    if first is None:
        return None
    inflation_left = inflation_of(problem, first, noise_level or {})
    candidates, columns, warm = _at_first_fit(
        problem, baseline, first, inflation_left, blocks, closures
    )
    second_choice = _select(
        _StackedFit.of(problem, warm, first, inflation_left), candidates, columns, first.values
    )
    other = (
        None
        if second_choice is None
        else _fit_terms(problem, nominal, warm, inflation_left, second_choice, say)
    )
    return _best_model(
        [baseline, first, *([] if other is None else [other])],
        problem,
        inflation_left,
        len(candidates),
    )


def _closures(blocks: Sequence[Block]) -> dict[str, str]:
    """Closures by the block that each acts in."""
    closures = {b.name: b.closure for b in blocks}
    unknown = [name for name, closure in closures.items() if closure is None]
    if unknown or not blocks:
        raise DiagnosisError(
            f"blocks = {unknown} is not allowed: one or more of {', '.join(CLOSURE_OF)}"
        )
    return {name: closure for name, closure in closures.items() if closure is not None}


def _columns(
    problem: Problem,
    base: Fit,
    rig: Rig,
    names: list[str],
    inflation: dict[str, float],
    blocks: list[Block],
) -> Array:
    """Derivative of the stacked residuals of the whole problem with respect to coefficients that
    act in some of its blocks.
    """
    with_slopes = residuals(replace(problem, blocks=blocks), rig, names)
    full = {
        key: replace(r, jacobian=np.zeros((r.value.size, len(names))))
        for key, r in base.residuals.items()
    }
    _, columns = stacked(problem, full | with_slopes, inflation)
    assert columns is not None
    return columns


def _at_zero(
    problem: Problem,
    baseline: Fit,
    inflation: dict[str, float],
    blocks: list[Block],
    closures: dict[str, str],
) -> tuple[list[_ShapedTerm], Array]:
    """Every term at every shape of its memory, and what each does to the stacked residuals per unit
    of its coefficient (n, m).
    """
    shapes_tried = {
        closure: {p.name: p.starts for p in EFFECTS[closure].parameters if p.neutral is None}
        for closure in closures.values()
    }
    rounds = max(len(values) for shapes in shapes_tried.values() for values in shapes.values())
    candidates: list[_ShapedTerm] = []
    columns = []
    for k in range(rounds):
        rig = baseline.rig
        now: list[_ShapedTerm] = []
        for closure, shapes in shapes_tried.items():
            here = {name: values[min(k, len(values) - 1)] for name, values in shapes.items()}
            rig = rig.with_effect(closure, here)
            for term in CLOSURE_TERMS[closure]:
                shape = MEMORY_OF.get(term.kind)
                if shape is not None or k == 0:
                    now.append(_ShapedTerm(closure, term, here[shape] if shape else None))
        columns.append(_columns(problem, baseline, rig, [c.name for c in now], inflation, blocks))
        candidates += now
    return candidates, np.concatenate(columns, axis=1)


def _at_first_fit(
    problem: Problem,
    baseline: Fit,
    fitted: Fit,
    inflation: dict[str, float],
    blocks: list[Block],
    closures: dict[str, str],
) -> tuple[list[_ShapedTerm], Array, Fit]:
    """Terms and columns as of `_at_zero`, at a fitted closure with its memories; and the baseline
    there, with sensitivities next to the closure.
    """
    rig = fitted.rig
    for closure in closures.values():
        if Term(closure) not in fitted.effects:
            rig = rig.with_effect(closure)
    shapes = {e["id"]: e["parameters"] for e in rig.effects if e["id"] in CLOSURE_TERMS}
    candidates = [
        _ShapedTerm(
            closure, term, shapes[closure][MEMORY_OF[term.kind]] if term.kind in MEMORY_OF else None
        )
        for closure in closures.values()
        for term in CLOSURE_TERMS[closure]
    ]
    names = list(baseline.values)
    evaluated = residuals(problem, rig, [*names, *(c.name for c in candidates)])
    baseline_residuals = {
        key: replace(r, jacobian=None if r.jacobian is None else r.jacobian[:, : len(names)])
        for key, r in evaluated.items()
    }
    values = {name: fitted.values[name] for name in names}
    warm = replace(
        baseline,
        rig=fitted.rig,
        values=values,
        residuals=baseline_residuals,
        moved={name: fitted.moved[name] for name in baseline.moved},
    )
    _, every = stacked(problem, evaluated, inflation)
    assert every is not None
    return candidates, every[:, len(names) :], warm


@dataclass(frozen=True, eq=False)
class _StackedFit:
    """Stacked residuals of a fit, with what the baseline can do next to a closure.

    Attributes
    ----------
    rows : (n,) array
        Stacked residuals.
    freedom : (n, b) array
        Their derivative with respect to each parameter of the baseline in tolerances, and of its
        effects in their scales.
    prior : (b, b) array
        Derivative of the residual of each prior; zero for parameters of effects.
    moved : (b,) array
        Distance of each from nominal in tolerances, the residual of its prior.
    recording : (n,) int array
        Recording of each row.
    series : list of slice
        Rows of each block of each recording.
    """

    rows: Array
    freedom: Array
    prior: Array
    moved: Array
    recording: NDArray[np.int64]
    series: list[slice]

    @staticmethod
    def of(
        problem: Problem, baseline: Fit, fitted: Fit, inflation: dict[str, float]
    ) -> _StackedFit:
        """Residuals of a fit, sensitivities of the baseline it grew from."""
        rows, _ = stacked(problem, fitted.residuals, inflation)
        _, jacobian = stacked(problem, baseline.residuals, inflation)
        names = list(baseline.values)
        scales = np.array([baseline.scales[name] for name in names])
        freedom = np.zeros((rows.size, 0)) if jacobian is None or not names else jacobian * scales
        recording, series, start = [], [], 0
        for k, prepared in enumerate(problem.recordings):
            for block in problem.blocks:
                key = (block.name, prepared.recording.name)
                size = stacked(
                    replace(problem, blocks=[block], recordings=[prepared]),
                    {key: fitted.residuals[key]},
                    inflation,
                )[0].size
                series.append(slice(start, start + size))
                recording.append(np.full(size, k))
                start += size
        return _StackedFit(
            rows,
            freedom,
            np.diag([float(name in fitted.moved) for name in names]),
            np.array([fitted.moved.get(name, 0.0) for name in names]),
            np.concatenate(recording),
            series,
        )

    def independent(self, rows: Array) -> float:
        """Number of independent samples among residuals: rows over their correlation time."""
        return max(
            4.0,
            sum(
                float(s.stop - s.start) / correlation_time(rows[s])
                for s in self.series
                if s.stop - s.start >= 4
            ),
        )


def _price(samples: float, among: int) -> float:
    """Chi-square that a term must gain: BIC on independent samples, and risk inflation, the best of
    so many (Foster & George 1994).
    """
    return math.log(samples) + 2.0 * math.log(among)


def _best_model(
    models: list[Fit], problem: Problem, inflation: dict[str, float], among: int
) -> Fit | None:
    """Best model by misfit and price, on the independent samples of the least misfit; None for the
    first.

    Parameters
    ----------
    models : list of Fit
        The baseline first.
    problem : Problem
        Blocks and recordings.
    inflation : dict of str to float
        One weighting for all.
    among : int
        Number of terms that there were to choose from.
    """
    misfits = [with_priors(problem, model, inflation) for model in models]
    least = models[int(np.argmin(misfits))]
    frame = _StackedFit.of(problem, models[0], least, inflation)
    samples = frame.independent(frame.rows)
    worth = [
        -samples * math.log(misfit) - len(model.effect_values) * _price(samples, among)
        for misfit, model in zip(misfits, models, strict=True)
    ]
    best = int(np.argmax(worth))
    most = _MOST_MISFIT_SHARE * misfits[0]
    return models[best] if best and misfits[best] < most else None


def _select(
    frame: _StackedFit,
    candidates: list[_ShapedTerm],
    columns: Array,
    present: dict[str, float],
) -> _Choice | None:
    """Orthogonal forward selection of terms against the stacked residuals, the closure that is in
    them taken out.

    The misfit is that of rows and priors together, the baseline moving freely inside its
    tolerances: both are orthogonalised against the baseline first. A term that is not worth its
    price alone is still looked behind: the way goes on to `most_terms`, and as many of them are
    taken as pay for themselves together; then those are dropped that the others have made needless.
    A gain that the recordings left out confirm at the full price need only be worth BIC's in the
    recordings themselves.

    Parameters
    ----------
    frame : _StackedFit
        Residuals to explain and what the baseline can do.
    candidates : list of _ShapedTerm
        Terms.
    columns : (n, m) array
        What each does to the residuals per unit of its coefficient.
    present : dict of str to float
        Coefficients with which the residuals were computed; their terms are taken first.

    Returns
    -------
    _Choice or None
        None where nothing is worth its price.
    """
    rows = frame.rows - columns @ np.array([present.get(c.name, 0.0) for c in candidates])
    size = np.linalg.norm(columns, axis=0)
    usable = size > 1e-12 * max(float(size.max(initial=0.0)), 1e-300)
    unit = columns / np.where(usable, size, 1.0)
    b = frame.freedom.shape[1]
    target = np.concatenate([rows, frame.moved])
    wide = np.concatenate([unit, np.zeros((b, unit.shape[1]))])
    if b:
        q, _ = np.linalg.qr(np.concatenate([frame.freedom, frame.prior]))
        target = target - q @ (q.T @ target)
        wide = wide - q @ (q.T @ wide)
    crossed = _LeaveOneOut.of(frame, rows, unit)
    selection = _Selection(candidates, target, wide, ROUNDING)
    for k, candidate in enumerate(candidates):
        if candidate.name in present and usable[k] and selection.power(k) > ROUNDING:
            selection.take(k)
    order = selection.order
    count, misfit, proof = len(order), selection.misfit, crossed.left_out(order)
    samples = frame.independent(selection.rows_left[: rows.size])
    while len(order) < _MOST_TERMS:
        telling = selection.most_telling(usable)
        if telling is None:
            break
        selection.take(telling)
        now, proof_now = selection.misfit, crossed.left_out(order)
        here = frame.independent(selection.rows_left[: rows.size])
        gain = here * math.log(misfit / max(now, 1e-300))
        proven = here * math.log(proof / max(proof_now, 1e-300))
        new = len(order) - count
        price = new * _price(here, len(candidates))
        if proven > 0.0 and (gain > price or (proven > price and gain > new * math.log(here))):
            count, misfit, proof, samples = len(order), now, proof_now, here
    pruned = _pruned(target, wide, order[:count], misfit, samples, _price(samples, len(candidates)))
    return _solved(frame, candidates, rows, unit, size, pruned) if pruned else None


class _Selection:
    """Terms taken one after the other; what each explains is taken out of everything that is
    left.
    """

    def __init__(
        self, candidates: list[_ShapedTerm], target: Array, wide: Array, least_power: float
    ) -> None:
        self.rows_left, self._free = target.copy(), wide.copy()
        self.order: list[int] = []
        self._candidates, self._least_power = candidates, least_power
        self._shapes: dict[str, float | None] = {}

    @property
    def misfit(self) -> float:
        """Sum of squares that is left."""
        return float(self.rows_left @ self.rows_left)

    def power(self, k: int) -> float:
        """Squared length of a term's part that the terms taken before do not explain."""
        return float(self._free[:, k] @ self._free[:, k])

    def take(self, k: int) -> None:
        """Add a term."""
        self.order.append(k)
        candidate = self._candidates[k]
        if candidate.memory:
            self._shapes.setdefault(candidate.memory, candidate.shape)
        direction = self._free[:, k] / max(float(np.linalg.norm(self._free[:, k])), 1e-150)
        self.rows_left = self.rows_left - direction * float(direction @ self.rows_left)
        self._free = self._free - np.outer(direction, direction @ self._free)

    def most_telling(self, usable: Mask) -> int | None:
        """The term that explains most of what is left; memories keep the shape that the first of
        them has.
        """
        shapes = self._shapes
        power = (self._free**2).sum(axis=0)
        open_ = usable & (power > self._least_power)
        open_ &= np.array(
            [c.memory not in shapes or shapes[c.memory] == c.shape for c in self._candidates]
        )
        open_[self.order] = False
        if not open_.any():
            return None
        explained = (self._free.T @ self.rows_left) ** 2 / np.where(open_, power, 1.0)
        return int(np.argmax(np.where(open_, explained, -1.0)))


def _solved(
    frame: _StackedFit,
    candidates: list[_ShapedTerm],
    rows: Array,
    unit: Array,
    size: Array,
    taken: list[int],
) -> _Choice:
    """Coefficients of the terms that are kept, the baseline moving freely inside its tolerances."""
    b = frame.freedom.shape[1]
    baseline = np.concatenate([frame.freedom, frame.prior])
    terms = np.concatenate([unit[:, taken], np.zeros((b, len(taken)))])
    design = np.concatenate([baseline, terms], axis=1)
    solution, *_ = np.linalg.lstsq(design, -np.concatenate([rows, frame.moved]), rcond=1e-10)
    values = {
        candidates[k].name: float(v) / float(size[k])
        for k, v in zip(taken, solution[b:], strict=True)
    }
    shapes = {
        c.memory: c.shape
        for c in (candidates[k] for k in taken)
        if c.memory and c.shape is not None
    }
    return _Choice(values, shapes, solution[:b])


def _pruned(
    target: Array, wide: Array, taken: list[int], misfit: float, samples: float, price: float
) -> list[int]:
    """Terms without those that others have made needless: backward, the cheapest first, while its
    loss is less than its price.
    """

    def without(k: int) -> float:
        others = wide[:, [j for j in taken if j != k]]
        solution, *_ = np.linalg.lstsq(others, target, rcond=1e-10)
        return float(np.sum((target - others @ solution) ** 2))

    while taken:
        losses = {k: without(k) for k in taken}
        cheapest = min(taken, key=lambda k: losses[k])
        if samples * math.log(losses[cheapest] / max(misfit, 1e-300)) > price:
            break
        taken, misfit = [k for k in taken if k != cheapest], losses[cheapest]
    return taken


@dataclass(frozen=True, eq=False)
class _LeaveOneOut:
    """Normal equations of baseline and terms by recording, to leave one out at a time.

    Attributes
    ----------
    grams : (r, b + m + 1, b + m + 1) array
        Inner products of baseline columns, terms and rows in each recording.
    prior : (b, b) array
        Derivative of the residual of each parameter's prior.
    moved : (b,) array
        That residual.
    """

    grams: Array
    prior: Array
    moved: Array

    @staticmethod
    def of(frame: _StackedFit, rows: Array, unit: Array) -> _LeaveOneOut:
        everything = np.concatenate([frame.freedom, unit, rows[:, None]], axis=1)
        parts = [everything[frame.recording == k] for k in np.unique(frame.recording)]
        grams = np.array([part.T @ part for part in parts])
        return _LeaveOneOut(grams, frame.prior, frame.moved)

    def left_out(self, terms: Sequence[int]) -> float:
        """Misfit of each recording by the baseline and terms that the others ask for, summed; with
        one recording the misfit itself.
        """
        b = self.moved.size
        index = np.array([*range(b), *(b + t for t in terms)], dtype=np.int64)
        total = self.grams.sum(axis=0)
        misfit = 0.0
        for gram in self.grams:
            rest = total - gram if len(self.grams) > 1 else total
            normal = rest[np.ix_(index, index)].copy()
            right = -rest[index, -1].copy()
            normal[:b, :b] += self.prior
            right[:b] -= self.moved
            solution = np.linalg.lstsq(normal, right, rcond=1e-12)[0]
            misfit += float(
                gram[-1, -1]
                + 2.0 * solution @ gram[index, -1]
                + solution @ gram[np.ix_(index, index)] @ solution
            )
        return misfit


def _fit_terms(
    problem: Problem,
    nominal: Rig,
    warm: Fit,
    inflation: dict[str, float],
    chosen: _Choice,
    say: Callable[[str], None],
) -> Fit | None:
    """The chosen terms and the shapes of their memories in the nonlinear model; None where it
    cannot be run.
    """
    closures = tuple(dict.fromkeys(filter(None, map(effect_of, chosen.values))))
    every = {f"{e}.{p.name}": p for e in closures for p in e.info.parameters}
    named = [start_of(warm, effect) for effect in warm.effects if effect not in closures]
    free, held, forms = parts_of(named)
    fixed = {
        n: 0.0 if p.neutral == 0.0 else p.default
        for n, p in every.items()
        if n not in chosen.values and n not in chosen.shapes
    }
    say(f"trying {' + '.join(name for name in chosen.values)}")
    names = list(warm.values)
    best: Fit | None = None
    for share in (1.0, _SHRUNK_SHARE):
        starts = {name: share * value for name, value in chosen.values.items()} | chosen.shapes
        shifted = {
            n: warm.values[n] + share * float(x) * warm.scales[n]
            for n, x in zip(names, chosen.shift, strict=True)
            if n in warm.moved
        }
        try:
            fitted = fit(
                problem,
                nominal,
                (*(start.effect for start in named), *closures),
                free | starts,
                inflation,
                fixed=held | fixed,
                forms=forms,
                warm=replace(warm, values=shifted),
                evaluations=SHORT_EVALUATIONS,
            )
        except SimulationError:
            continue
        if best is None or fitted.cost < best.cost:
            best = fitted
        if 2.0 * best.cost < with_priors(problem, warm, inflation):
            break
    return best
