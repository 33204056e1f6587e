"""Joint fit of all blocks to all recordings: parameters inside their tolerances, effects from
several starts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from threading import Event
from typing import TypeVar

import numpy as np

from pamrs import _core
from pamrs._arrays import Array
from pamrs._losses import Losses
from pamrs.diagnosis.fit._effect_places import acts_in, core_names, depends
from pamrs.diagnosis.fit._known_parameters import (
    ends_in_tolerances,
    in_tolerances,
    known_parameters,
    largest_value,
    moved_slope,
    moved_value,
    with_known,
)
from pamrs.diagnosis.fit._leastsquares import levenberg_marquardt
from pamrs.diagnosis.fit._starts import without_term
from pamrs.diagnosis.prepare import Block, Prepared, Residual, binned, change, residual
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import EFFECTS, Hypothesis, Term, effect_of, find_parameter, usual_values
from pamrs.errors import ParameterError, RigError, SimulationError
from pamrs.rig import Parameter, Rig
from pamrs.simulation import core_rig, default_step

# share of an effect parameter's usual start that its scale in a fit has at the least
_LEAST_SCALE = 0.01
# [s] stable integration step below which a model is not tried: it would take too long
_LEAST_STEP = 4e-4
LEAST_STEP_SHARE = 0.2  # the same of a stiff rig, as a share of the step of its nominal model
# share of the sum of squares that a step of a fit to its end gains: one that stopped early looked
# like physics (decision 22)
FINAL_STEP_SHARE = 1e-5
_LAST_STEPS = 2  # of which one left the range, where a fit was stopped there: it creeps on
FIT_BIN_TIME = 0.02  # [s] bins of residuals for fits: faster than any effect of the catalogue shows


Item = TypeVar("Item")
Found = TypeVar("Found")
Key = tuple[str, str]
"""Block and recording."""
Residuals = dict[Key, Residual]
Stages = dict[str, Residuals]
"""Residuals by stage: ``before``, ``refit``, ``after``."""

LOGARITHMIC = frozenset(
    f"{effect.id}.{parameter.name}"
    for effect in EFFECTS.values()
    for form in effect.forms
    for parameter in form.parameters
    if parameter.neutral != 0.0 and parameter.lower > 0.0
)
"""Shapes that are positive: fitted by their logarithm."""


def _logarithmic(name: str) -> bool:
    """True where a parameter is fitted by its logarithm, wherever its effect acts."""
    effect = effect_of(name)
    return effect is not None and effect.id + name.removeprefix(str(effect)) in LOGARITHMIC


class Inflation(dict[str, float]):
    """Variance of each block's binned residual relative to white sample noise, by which it counts
    less.

    Parameters
    ----------
    usual : mapping of str to float
        By block.
    apart : mapping of (str, str) to float
        By block and recording, of recordings that count by their own.
    """

    def __init__(self, usual: Mapping[str, float], apart: Mapping[Key, float]) -> None:
        super().__init__(usual)
        self.apart = dict(apart)

    @property
    def largest(self) -> float:
        """Largest variance of a block or single recording, which counts least."""
        return max([*self.values(), *self.apart.values()])


class Unfollowed(SimulationError):
    """Error of a model that leaves the range in which it holds where one recording drives it.

    Parameters
    ----------
    block, recording : str
        What it was to predict, and of which recording.
    why : str
        What happened.
    """

    def __init__(self, block: str, recording: str, why: str) -> None:
        super().__init__(f"block {block} of {recording}: {why}")
        self.recording = recording


class Stopped(BaseException):
    """Signal that ends a fit whose result nobody waits for any more."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Blocks and recordings to be explained together.

    Attributes
    ----------
    blocks : list of Block
        Blocks that the channels can tell apart.
    recordings : list of Prepared
        Recordings.
    core : _core.Rig
        The nominal rig, compiled; others are made from it.
    settings : DiagnosisSettings
        What it is solved by.
    stopped : Event, optional
        Set by whoever wants no more of it: the next evaluation raises `Stopped`.
    considered : tuple of Hypothesis, optional
        What the caller asks for.
    losses : Losses, optional
        What failed and was left out.
    """

    blocks: list[Block]
    recordings: list[Prepared]
    core: _core.Rig
    settings: DiagnosisSettings
    stopped: Event = field(default_factory=Event)
    considered: tuple[Hypothesis, ...] = ()
    losses: Losses = field(default_factory=Losses)


@dataclass(frozen=True)
class Events:
    """An effect that happens at times of its own in each recording.

    Attributes
    ----------
    effect : Term
        Its id, with a place where it acts at one block of several.
    values : dict of str to dict
        Its parameters (SI) by recording; a recording without an entry has none.
    form : str
        Its form; empty for the usual one.
    """

    effect: Term
    values: dict[str, dict[str, float]]
    form: str = ""

    def put_into(self, rig: Rig, recording: str) -> Rig:
        """Rig with the events of one recording, and without the effect where nothing happened."""
        values = self.values.get(recording)
        rig = without_term(rig, self.effect)
        at = self.effect.at
        return rig.with_effect(self.effect.id, values, at=at, form=self.form) if values else rig


@dataclass(frozen=True, eq=False)
class Fit:
    """A model fitted to a problem.

    Attributes
    ----------
    effects : tuple of Term
        Effects in the model.
    rig : Rig
        The model.
    values, std : dict of str to float
        Free parameters and their standard deviations, SI; effects' parameters included.
    covariance : (k, k) array
        Of the scaled free parameters.
    cost : float
        Half the weighted sum of squares, priors included.
    residuals : dict
        Residual by block and recording.
    moved : dict of str to float
        Distance of each baseline parameter from nominal in tolerances.
    evaluations : int
        Number of evaluations.
    scales : dict of str to float
        Change of each free parameter per unit of its scaled one, SI.
    events : Events or None
        What happens in single recordings.
    freed : tuple of str
        Baseline parameters that no prior holds.
    inflation : dict of str to float
        Variance of each block's binned residual relative to white noise, by which it was weighted.
    refused : SimulationError or None
        Why it could go no further, where one of the last steps left the range of the model.
    known : mapping of str to Parameter
        What was known of the baseline parameters before, by their names.
    """

    effects: tuple[Term, ...]
    rig: Rig
    values: dict[str, float]
    std: dict[str, float]
    covariance: Array
    cost: float
    residuals: Residuals
    moved: dict[str, float] = field(default_factory=dict)
    evaluations: int = 0
    scales: dict[str, float] = field(default_factory=dict)
    events: Events | None = None
    freed: tuple[str, ...] = ()
    inflation: dict[str, float] = field(default_factory=dict)
    refused: SimulationError | None = None
    known: Mapping[str, Parameter] = field(default_factory=dict)

    @property
    def held_by_prior(self) -> dict[str, float]:
        """Baseline parameters that a prior holds, and the distance that each moved [tolerances]."""
        return {name: moved for name, moved in self.moved.items() if name not in self.freed}

    @property
    def effect_values(self) -> dict[str, float]:
        """Parameters of the effects that were fitted, SI; not those of effects that the nominal
        model holds.
        """
        return {
            name: value
            for name, value in self.values.items()
            if name not in self.moved and effect_of(name) is not None
        }

    @property
    def strain(self) -> float:
        """Sum of squares of the priors: distance from the nominal values."""
        return sum(moved * moved for moved in self.held_by_prior.values())

    @property
    def start_strain(self) -> float:
        """Sum of squares of the priors on how warm gases begin."""
        return sum(r.strain for r in self.residuals.values())


def residuals(
    problem: Problem, rig: Rig, names: Sequence[str] = (), events: Events | None = None
) -> Residuals:
    """Residuals of a model for every block and recording; jacobians for the names that a block
    depends on. What the core has no sensitivities to, the shape of a muscle or of its tendon, is
    shifted by a share of its tolerance.

    Parameters
    ----------
    problem : Problem
        Blocks and recordings.
    rig : Rig
        The model.
    names : sequence of str, optional
        Dotted parameters to differentiate with respect to.
    events : Events, optional
        What happens in single recordings, in addition to the model.
    """
    recordings = [prepared.recording.name for prepared in problem.recordings]
    happened = [n for n in recordings if events is not None and events.values.get(n)]

    def models(rig: Rig) -> dict[str, _core.Rig]:
        """The compiled rig in each recording, with what happens there."""
        core = _compiled(problem, rig)
        with_events = {n: _compiled(problem, events.put_into(rig, n)) for n in happened if events}
        return dict.fromkeys(recordings, core) | with_events

    cores = models(rig)
    steps = _steps(rig, cores, names)
    shifted = {
        name: models(rig.with_parameters({name: rig.parameters[name].value + step}))
        for name, step in steps.items()
    }

    def residual_of(block: Block, prepared: Prepared) -> Residual:
        relevant = [name for name in names if depends(block, name)]
        at = prepared.recording.name
        if events is not None and at not in happened:  # nothing here could be differentiated
            relevant = [name for name in relevant if effect_of(name) != events.effect]
        in_core = [name for name in relevant if name not in steps]
        block_residual = residual(block, cores[at], prepared, core_names(rig, in_core))
        if in_core == list(names):
            return block_residual
        full = np.zeros((block_residual.value.size, len(names)))
        if in_core:
            full[:, [list(names).index(name) for name in in_core]] = block_residual.jacobian
        for name in set(relevant) - set(in_core):
            shifted_value = change(block, shifted[name][at], prepared, block_residual)
            full[:, list(names).index(name)] = (block_residual.value - shifted_value) / steps[name]
        return replace(block_residual, jacobian=full)

    return _for_every_block(problem, residual_of)


def _steps(rig: Rig, cores: Mapping[str, _core.Rig], names: Sequence[str]) -> dict[str, float]:
    """Finite-difference step of each parameter to which the core has no sensitivities [SI]."""
    in_core, known = {n for core in cores.values() for n in core.parameter_names}, rig.parameters
    return {
        name: shift if known[name].value + shift <= known[name].upper else -shift
        for name in names
        if name in known and name not in in_core
        for shift in [_shift(known[name])]
    }


def _shift(known: Parameter) -> float:
    """Finite-difference step of a parameter to whose value the core has no sensitivities."""
    if math.isfinite(known.tol):
        return 0.01 * known.tol
    return 1e-5 * (abs(known.value) or 1.0)


def two_at_a_time(function: Callable[[Item], Found], items: Iterable[Item]) -> list[Found]:
    """Apply a function to each item, two at a time; results in the order of the items.

    For whole fits and simulations: steps of one that cannot be shared overlap with the other's.
    """
    with ThreadPoolExecutor(max_workers=2) as pool:
        return list(pool.map(function, items))


def _for_every_block(problem: Problem, one: Callable[[Block, Prepared], Residual]) -> Residuals:
    """Apply a function to every block and recording, two at a time.

    The longest come first, so that no processor is left alone with one of them at the end.
    """
    tasks = {(b.name, p.recording.name): (b, p) for p in problem.recordings for b in problem.blocks}

    def steps(key: Key) -> float:
        block, prepared = tasks[key]
        return prepared.n * prepared.dt / default_step(prepared.dt, longest=block.step)

    def run(key: Key) -> Residual:
        if problem.stopped.is_set():
            raise Stopped
        try:
            return one(*tasks[key])
        except SimulationError as error:
            raise Unfollowed(*key, str(error)) from error

    longest_first = sorted(tasks, key=steps, reverse=True)
    with _inside_range():
        results = dict(zip(longest_first, two_at_a_time(run, longest_first), strict=True))
    return {key: results[key] for key in tasks}


@contextmanager
def _inside_range() -> Iterator[None]:
    """Raise SimulationError for a trial model that cannot be, such as one with no inertia."""
    try:
        yield
    except (ParameterError, RigError) as error:
        raise SimulationError(str(error)) from error


def _compiled(problem: Problem, rig: Rig) -> _core.Rig:
    """Compile another model; SimulationError where it is too stiff for any fit to afford."""
    with _inside_range():
        core = core_rig(rig, problem.core)
    least = min(_LEAST_STEP, LEAST_STEP_SHARE * problem.core.stable_step)
    if core.stable_step < least:
        raise SimulationError(
            f"the model needs steps of {core.stable_step:.1e} s; to be fitted it may need "
            f"{least:.1e} s at the least"
        )
    return core


def free_baseline(problem: Problem, nominal: Rig) -> list[str]:
    """Baseline parameters with a finite tolerance that some block depends on, those of effects that
    the model holds included.
    """
    return [
        name
        for name, parameter in known_parameters(nominal).items()
        if 0.0 < parameter.tol < math.inf and any(depends(block, name) for block in problem.blocks)
    ]


class Scaling:
    """Free parameters as numbers of order one: tolerances for the baseline, starts or logarithms
    for effects.
    """

    def __init__(
        self,
        nominal: Rig,
        baseline: Sequence[str],
        starts: dict[str, float],
        settings: DiagnosisSettings,
        freed: Collection[str] = (),
        forms: Mapping[Term, str] | None = None,
    ) -> None:
        self.names = [*baseline, *starts]
        self.forms = dict(forms or {})
        self.nominal, self.baseline, self.starts = nominal, list(baseline), dict(starts)
        self.known = known = known_parameters(nominal)
        self.scale = {n: known[n].tol for n in baseline}
        self.centre = {n: known[n].value for n in baseline}
        walls = settings.most_tolerances
        ends = [ends_in_tolerances(known[n], walls, freed=n in freed) for n in baseline]
        self.most = {name: largest_value(nominal, name) for name in starts}
        lower, upper = [low for low, _ in ends], [high for _, high in ends]
        for name, start in starts.items():
            info, most = find_parameter(name), self.most[name]
            if _logarithmic(name):
                lower.append(math.log(max(info.lower, start * 1e-3) / start))
                upper.append(math.log(min(most, start * 1e3) / start))
            else:
                # a parameter that starts from next to nothing has the scale of what it may become
                least = _LEAST_SCALE * max(abs(s) for s in info.starts)
                self.scale[name] = max(abs(start), least) or 10.0
                lower.append(max(info.lower, -most) / self.scale[name])
                upper.append(most / self.scale[name])
        self.bounds = (np.array(lower), np.array(upper))
        effect_starts = [0.0 if _logarithmic(n) else s / self.scale[n] for n, s in starts.items()]
        self.start = np.clip(np.array([0.0] * len(self.baseline) + effect_starts), *self.bounds)

    def value(self, name: str, x: float) -> float:
        """A parameter [SI] from its scaled number."""
        if name in self.centre:
            return moved_value(self.known[name], x)
        info, most = find_parameter(name), self.most[name]
        value = self.starts[name] * math.exp(x) if _logarithmic(name) else x * self.scale[name]
        return min(max(value, info.lower, -most), most)

    def slope(self, name: str, x: float) -> float:
        """Change of a parameter [SI] with its scaled number."""
        if name in self.centre:
            return moved_slope(self.known[name], x)
        return self.value(name, x) if _logarithmic(name) else self.scale[name]

    def rig(self, x: Array, fixed: dict[str, float]) -> Rig:
        """The model of scaled numbers, with effect parameters that are held."""
        values = {n: self.value(n, float(v)) for n, v in zip(self.names, x, strict=True)}
        rig = with_known(self.nominal, {n: values[n] for n in self.baseline})
        chosen = {**fixed, **{n: v for n, v in values.items() if n not in self.centre}}
        for effect in filter(None, dict.fromkeys(map(effect_of, chosen))):
            form = self.forms.get(effect, "")
            rig = rig.with_effect(effect.id, effect.own(chosen), at=effect.at, form=form)
        return rig


def bin_width(prepared: Prepared, seconds: float) -> int:
    """Number of samples in a bin."""
    return max(1, round(seconds / prepared.dt))


def stacked(
    problem: Problem, block_residuals: Residuals, inflation: dict[str, float]
) -> tuple[Array, Array | None]:
    """Residuals of all blocks and recordings as one vector of bin means in units of their standard
    deviation.

    Returns
    -------
    rows : (n,) array
    jacobian : (n, k) array or None
        Derivative of the rows with respect to each parameter, SI; None without parameters.
    """
    rows, slopes = [], []
    apart = inflation.apart if isinstance(inflation, Inflation) else {}
    for prepared in problem.recordings:
        for block in problem.blocks:
            key = block.name, prepared.recording.name
            r = block_residuals[key]
            mean, counts = binned(r.value, r.rows, bin_width(prepared, FIT_BIN_TIME))
            variance = apart.get(key, inflation[block.name])
            weight = np.sqrt(counts) / (r.noise * math.sqrt(variance))
            rows.append(mean * weight)
            if r.jacobian is not None:
                slope, _ = binned(r.jacobian, r.rows, bin_width(prepared, FIT_BIN_TIME))
                slopes.append(-slope * weight[:, None])
    return np.concatenate(rows), np.concatenate(slopes) if slopes else None


def predicted_with_doubt(problem: Problem, fitted: Fit) -> Residuals:
    """Residuals of recordings that were not fitted, without what the uncertainty of the fit's
    parameters may explain of them.

    The prediction of a fit is as uncertain as its parameters are. They take the most probable
    values under both, by the fit's covariance and the sensitivities here, and what that movement
    costs counts as residual.

    Parameters
    ----------
    problem : Problem
        Recordings that were not fitted.
    fitted : Fit
        A fit that leaves noise in those that were: its covariance then means what it says.

    Returns
    -------
    dict of (block, recording) to Residual
        Without sensitivities.
    """
    names = list(fitted.values)
    with_slopes = residuals(problem, fitted.rig, names, fitted.events)
    rows, slope = stacked(problem, with_slopes, fitted.inflation)
    if slope is None:
        return with_slopes
    scales = np.array([fitted.scales[name] for name in names])
    scaled = slope * scales
    doubt = fitted.covariance
    moved = -np.linalg.solve(
        np.eye(len(names)) + doubt @ (scaled.T @ scaled), doubt @ (scaled.T @ rows)
    )
    rest = rows + scaled @ moved
    power = float(rest @ rest)
    # at the best values the sum of both is what the movement takes off
    both = float(rows @ rows + rows @ (scaled @ moved))
    size = math.sqrt(max(both, power) / power) if power > 0.0 else 1.0
    return {
        key: replace(r, value=size * (r.value - r.jacobian @ (scales * moved)), jacobian=None)
        for key, r in with_slopes.items()
        if r.jacobian is not None
    }


def with_priors(problem: Problem, fitted: Fit, inflation: dict[str, float]) -> float:
    """Sum of squares of a fit's stacked residuals and priors under a weighting of its own."""
    rows, _ = stacked(problem, fitted.residuals, inflation)
    return float(rows @ rows) + fitted.strain


def changes(
    problem: Problem,
    rig: Rig,
    base: Residuals,
    effect: Term,
    known: Mapping[Key, Residual] | None = None,
) -> Residuals:
    """Residuals, values alone, of a model close to one whose residuals (with the starts of their
    windows) are known.

    Only blocks in which the effect that makes the difference acts are predicted again, but for
    those that are ``known``.

    Raises
    ------
    SimulationError
        If the model leaves the range in which it holds.
    """
    core = _compiled(problem, rig)

    def changed(block: Block, prepared: Prepared) -> Residual:
        before = base[block.name, prepared.recording.name]
        if not acts_in(effect, block):
            return replace(before, jacobian=None)
        if known and (block.name, prepared.recording.name) in known:
            return known[block.name, prepared.recording.name]
        return replace(before, value=change(block, core, prepared, before), jacobian=None)

    return _for_every_block(problem, changed)


def _away_from_usual(
    scaling: Scaling, usual: Mapping[str, tuple[float, float]], x: Array, slopes: Array
) -> tuple[Array, Array]:
    """Rows of the effect parameters that have a usual size, and their sensitivities.

    A size far from the usual one is rare and not ruled out, as by a Cauchy distribution: the row is
    `sqrt(2 log(1 + z^2))` at `z` deviations. It decides between values that leave the same.
    """
    rows, sensitivities = np.zeros(len(usual)), np.zeros((len(usual), len(scaling.names)))
    for row, (name, (mean, deviation)) in enumerate(usual.items()):
        k = scaling.names.index(name)
        z = (scaling.value(name, float(x[k])) - mean) / deviation
        rows[row] = math.copysign(math.sqrt(2.0 * math.log1p(z * z)), z)
        # of small z the limit, which is that of the straight row sqrt(2) z
        slope = 2.0 * z / ((1.0 + z * z) * rows[row]) if abs(z) > 1e-8 else math.sqrt(2.0)
        sensitivities[row, k] = slope * slopes[k] / deviation
    return rows, sensitivities


def fit(
    problem: Problem,
    nominal: Rig,
    effects: tuple[Term, ...],
    starts: dict[str, float],
    inflation: dict[str, float],
    *,
    fixed: dict[str, float] | None = None,
    warm: Fit | None = None,
    events: Events | None = None,
    evaluations: int | None = None,
    share: float | None = None,
    settled: Mapping[str, float] | None = None,
    freed: Collection[str] = (),
    forms: Mapping[Term, str] | None = None,
) -> Fit:
    """Fit baseline parameters (with their tolerances as priors) and effects to the recordings.

    Parameters
    ----------
    problem : Problem
        Blocks and recordings.
    nominal : Rig
        Nominal model.
    effects : tuple of Term
        Effects to include.
    starts : dict of str to float
        Dotted effect parameters that are free, with their starts.
    inflation : dict of str to float
        Variance of each block's binned residual relative to white sample noise (autocorrelated
        residuals count less); of single recordings where it is :class:`Inflation`.
    fixed : dict of str to float, optional
        Effect parameters that stay fixed.
    warm : Fit, optional
        A fit of the same problem from whose baseline values to start.
    events : Events, optional
        What happens in single recordings, held.
    evaluations : int, optional
        Limit on evaluations; that of the settings by default.
    share : float, optional
        As in :func:`pamrs.diagnosis.fit.levenberg_marquardt`.
    settled : mapping of str to float, optional
        Baseline parameters that are held at other values than the nominal ones.
    freed : collection of str, optional
        Baseline parameters that no prior holds, and that may leave their tolerance.
    forms : mapping of Term to str, optional
        Form of each effect that is not in its first.

    Raises
    ------
    SimulationError
        If the model leaves the range in which it holds where the fit starts.
    """
    nominal = with_known(nominal, settled or {})
    baseline = [name for name in free_baseline(problem, nominal) if name not in (settled or {})]
    settings = problem.settings
    scaling = Scaling(nominal, baseline, starts, settings, freed, forms)
    count = len(baseline)
    bound = np.array([0.0 if name in freed else 1.0 for name in baseline])
    prior = np.zeros((count, len(scaling.names)))
    prior[:, :count] = np.diag(bound)
    usual = {name: known for name in starts if (known := usual_values(name, forms)) is not None}

    refused: list[SimulationError | None] = []

    def evaluate(x: Array) -> tuple[Array, Array, Residuals]:
        try:
            block_residuals = residuals(problem, scaling.rig(x, fixed or {}), scaling.names, events)
        except SimulationError as error:
            refused.append(error)
            raise
        refused.append(None)
        rows, slope = stacked(problem, block_residuals, inflation)
        slopes = np.array(
            [scaling.slope(n, float(v)) for n, v in zip(scaling.names, x, strict=True)]
        )
        jacobian = np.zeros((rows.size, 0)) if slope is None else slope * slopes
        usual_rows, usual_slopes = _away_from_usual(scaling, usual, x, slopes)
        return (
            np.concatenate([rows, bound * x[:count], usual_rows]),
            np.concatenate([jacobian, prior, usual_slopes]),
            block_residuals,
        )

    start = scaling.start.copy()
    for index, name in enumerate(baseline):
        if warm is not None and name in warm.values:
            start[index] = in_tolerances(scaling.known[name], warm.values[name])
    limit = settings.fit_evaluations if evaluations is None else evaluations
    x, (values, jacobian, block_residuals), spent = levenberg_marquardt(
        evaluate, start, scaling.bounds, limit, share
    )
    covariance: Array = np.zeros((0, 0))
    if x.size:
        covariance = np.asarray(
            np.linalg.pinv(jacobian.T @ jacobian, hermitian=True), dtype=np.float64
        )
    spread = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    named = {n: scaling.value(n, float(v)) for n, v in zip(scaling.names, x, strict=True)}
    scales = {n: scaling.slope(n, float(v)) for n, v in zip(scaling.names, x, strict=True)}
    std = {n: float(s) * scales[n] for n, s in zip(scaling.names, spread, strict=True)}
    # what no residual depends on is not known, although the inverse calls it zero
    dependence = zip(scaling.names, np.any(jacobian, axis=0).tolist(), strict=True)
    std |= {n: math.inf for n, depends in dependence if not depends}
    moved = {n: float(v) for n, v in zip(baseline, x[:count], strict=True)}
    rig = scaling.rig(x, fixed or {})
    loose = tuple(name for name in baseline if name in freed)
    return Fit(
        effects,
        rig,
        named,
        std,
        covariance,
        0.5 * float(values @ values),
        block_residuals,
        moved,
        spent,
        scales,
        events,
        loose,
        inflation,
        next(filter(None, refused[-_LAST_STEPS:]), None),
        scaling.known,
    )
