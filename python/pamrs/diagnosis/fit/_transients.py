"""Effects that happen at times of their own in every recording: pushes from outside, a payload that
changes; those that repeat, with a phase of their own: a vibration; and those with a size of their
own: a zero that drifts.

No parameter that all recordings share can describe them. In each recording a pulse or a step of a
typical size is moved through time; where its signature takes most of the residual a fit begins. On
a held-out recording the times are looked for again, since nothing can predict them; what the event
is (a mass, a frequency) is not. Pushes have no property that carries over, so they are accepted
only if little is left.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from threading import Event

import numpy as np

from pamrs._arrays import Array
from pamrs.diagnosis.fit._fitting import (
    Events,
    Fit,
    Key,
    Problem,
    Scaling,
    changes,
    residuals,
    stacked,
)
from pamrs.diagnosis.fit._leastsquares import levenberg_marquardt
from pamrs.diagnosis.fit._spread import pieces_of, pieces_spread
from pamrs.diagnosis.fit._vibration import VibrationResponse
from pamrs.diagnosis.prepare import Prepared, Residual
from pamrs.effects import EffectParameter, Term, find_parameter
from pamrs.errors import SimulationError
from pamrs.rig import Rig

_SPACING = 0.5  # [s] distance of the times that are tried, of two events twice that
# [s] before an event from which its signature counts: the smoothing of drives reaches back
_EARLY = 0.1
_LEAST_EVENT_GAIN = 25.0  # [chi-square] gain from which an event counts (decision 20)
# share of what the recording's residual is from which an event counts (decision 20)
_EVENT_SHARE = 0.03
_TIME_SCALE = 0.2  # [s] scale of an event's time, and of its edges' time, in a fit
_FREQUENCY_SCALE = 0.01  # [Hz] scale of a frequency in a fit
_LEAST_DURATION = 0.02  # [s] shortest duration of an event, and of its edges (a blow)
_MOST_DURATION = 5.0  # [s] longest duration of an event, and of its edges (a hand)
_MOST_EVENT_SIZE = 1e3  # [SI] largest size of an event that a fit may reach


def events_of(effect: Term, form: str = "") -> list[list[EffectParameter]]:
    """Parameters (size, time, duration) of each event that one recording can have, the first
    event's first.

    Parameters
    ----------
    effect : Term
        A transient effect.
    form : str
        Its form; the usual one where it is empty.
    """
    shape, leading = effect.info.form(form), effect.info.leading.name
    parameters = shape.parameters
    if shape.own:
        return [list(parameters)]
    first = [
        p
        for p in parameters
        if not p.repeats and (shape.periodic or p.name == leading or p.role in ("time", "duration"))
    ]
    every = [[p, *(q for q in parameters if q.repeats == p.name)] for p in first]
    return [list(one) for one in zip(*every, strict=True)]


def _first_value(parameter: EffectParameter) -> float:
    """The value that a search over times gives a parameter."""
    return parameter.default if parameter.tried is None else parameter.tried


def _first_of(effect: Term, parameter: str) -> EffectParameter:
    """The parameter of the first event that one of a later event repeats."""
    info = find_parameter(f"{effect}.{parameter}")
    return find_parameter(f"{effect}.{info.repeats}") if info.repeats else info


def _scale(effect: Term, parameter: str) -> float:
    """Scale of an event's parameter in a fit [SI]."""
    scales = {
        "time": _TIME_SCALE,
        "duration": 2.0 * _TIME_SCALE,
        "rise": _TIME_SCALE,
    }
    first = _first_of(effect, parameter)
    usual = _FREQUENCY_SCALE if first.unit == "Hz" else _first_value(effect.info.leading)
    if effect.info.own:
        return _first_value(first)
    return scales.get(first.role, usual)


def fit_events(
    effect: Term, problem: Problem, nominal: Rig, baseline: Fit, inflation: dict[str, float]
) -> Fit | None:
    """Find the events of an effect in every recording and refit the baseline with them.

    Returns
    -------
    Fit or None
        With ``events``; its ``values`` hold the parameters of the recording that tells most of its
        event, which comes first.
        None where nothing was found.
    """
    rig, base = baseline.rig, baseline.residuals
    forms = [form for form in effect.info.forms if form.transient]
    timed = not effect.info.own
    usual_events = look_for_events(effect, problem, rig, base, inflation) if timed else None
    shaken = None
    last = None
    # what repeats begins at frequencies; other events begin where those of the usual form are
    for form in sorted(forms, key=lambda form: form.periodic):
        if form.periodic:
            shaken = shaken or VibrationResponse.of(effect, problem, rig, base, inflation)
            events = shaken.best(form.name)
        elif form.own:
            events = _sizes_by_recording(effect, form.name, problem, rig, base, inflation)
        else:
            usual = usual_events if last is None else last.events
            events = usual if usual is None or form is forms[0] else _in_form(usual, form.name)
        joint = (
            None if events is None else _fit_jointly(events, problem, nominal, baseline, inflation)
        )
        if joint is not None and (
            last is None or 2.0 * (last.cost - joint.cost) > _LEAST_EVENT_GAIN
        ):
            last = joint
    return None if last is None else _complete(last)


def refit_events(
    fitted: Fit, problem: Problem, nominal: Rig, baseline: Fit, inflation: dict[str, float]
) -> Fit:
    """Fit baseline and events on from where they are under another inflation; the same fit where
    the model leaves its range.

    Parameters
    ----------
    fitted : Fit
        With events.
    problem, nominal, baseline
        Blocks and recordings, the nominal model, and its fit without events.
    inflation : dict of str to float
        As in :func:`pamrs.diagnosis.fit.fit`.
    """
    assert fitted.events is not None
    values = baseline.values | {name: fitted.values[name] for name in baseline.moved}
    begun = replace(baseline, values=values)
    last = _fit_jointly(fitted.events, problem, nominal, begun, inflation)
    return fitted if last is None else _complete(last)


def _complete(fitted: Fit) -> Fit:
    """A fit with events whose rig and values have those of the first recording."""
    assert fitted.events is not None
    effect, (name, first) = fitted.events.effect, next(iter(fitted.events.values.items()))
    own = {f"{effect}.{parameter}": value for parameter, value in first.items()}
    rig = fitted.events.put_into(fitted.rig, name)
    return replace(fitted, effects=(effect,), rig=rig, values=fitted.values | own)


def _in_form(events: Events, form: str) -> Events:
    """Events in another form: shared parameters stay, and an event that takes a time of its own
    begins half of it earlier.
    """
    effect = events.effect
    values = {}
    for name, event_values in events.values.items():
        parameters = {
            p.name: event_values.get(p.name, _first_value(p))
            for p in effect.info.form(form).parameters
        }
        added = [
            p for event in events_of(effect, form) for p in event if p.name not in event_values
        ]
        early = sum(0.5 * parameters[p.name] for p in added if p.role == "duration")
        later = [p.name for event in events_of(effect, form) for p in event if p.role == "time"]
        values[name] = parameters | {n: max(0.0, parameters[n] - early) for n in later}
    return Events(effect, values, form)


def look_for_events(
    effect: Term,
    problem: Problem,
    rig: Rig,
    base: dict[Key, Residual],
    inflation: dict[str, float],
    known: Mapping[str, float] | None = None,
    form: str = "",
) -> Events | None:
    """Find the events of an effect in each recording, with the rest of the model held.

    Parameters
    ----------
    effect : Term
        A transient one.
    problem : Problem
        Blocks and recordings.
    rig : Rig
        The model.
    base : dict
        Its residuals.
    inflation : dict of str to float
        As in :func:`pamrs.diagnosis.fit.fit`.
    known : mapping of str to float, optional
        Parameters that are known, since all recordings share them: a mass, a frequency [SI].
    form : str, optional
        Form in which they are fitted; those that do not repeat are looked for in the usual one.

    Returns
    -------
    Events or None
        None where no recording has one.
    """
    known = dict(known or {})
    size = known.get(effect.info.leading.name)
    periodic = effect.info.form(form).periodic
    shaken = (
        VibrationResponse.of(effect, problem, rig, base, inflation, known).best(form)
        if periodic
        else None
    )

    def start_in(alone: Problem, prepared: Prepared) -> Events | None:
        """Start of the events of one recording, in the form that is asked for."""
        name = prepared.recording.name
        if periodic:
            return None if shaken is None else replace(shaken, values={name: shaken.values[name]})
        if effect.info.own:
            return _sizes_by_recording(effect, form, alone, rig, base, inflation, known)
        of_recording = {key: r for key, r in base.items() if key[1] == name}
        first_values = _scan(effect, alone, prepared, rig, of_recording, inflation, size, stopped)
        events = Events(effect, {name: first_values}) if first_values else None
        return _in_form(events, form) if events and form else events

    def events_in(prepared: Prepared) -> dict[str, float] | None:
        alone = replace(problem, recordings=[prepared])
        events = start_in(alone, prepared)
        if events is None:
            return None
        return _fit_alone(events, alone, prepared, rig, inflation, known, stopped)

    stopped = Event()
    with ThreadPoolExecutor(max_workers=2) as pool:
        try:
            values_found = list(pool.map(events_in, problem.recordings))
        except BaseException:  # an interrupt is not to wait for two whole searches
            stopped.set()
            raise
    values = {
        p.recording.name: event
        for p, event in zip(problem.recordings, values_found, strict=True)
        if event is not None
    }
    return Events(effect, values, form) if values else None


def _sizes_by_recording(
    effect: Term,
    form: str,
    problem: Problem,
    rig: Rig,
    base: dict[Key, Residual],
    inflation: dict[str, float],
    known: Mapping[str, float] | None = None,
) -> Events | None:
    """Sizes of an effect whose size differs between recordings, by its signature in each; without
    recordings in which it is not worth it, None where it is in none.
    """
    info, values = effect.info, {}
    leading = info.leading
    shapes = [
        [(p.name, x) for x in ([known[p.name]] if known and p.name in known else p.starts)]
        for p in info.form(form).parameters
        if p is not leading and p.name != leading.name
    ]
    for prepared in problem.recordings:
        alone, name = replace(problem, recordings=[prepared]), prepared.recording.name
        of_recording = {key: r for key, r in base.items() if key[1] == name}
        rows, _ = stacked(alone, of_recording, inflation)
        least = max(_LEAST_EVENT_GAIN, _EVENT_SHARE * float(rows @ rows))
        for shape in itertools.product(*shapes):
            event = {leading.name: _first_value(leading), **dict(shape)}
            with_event = Events(effect, {name: event}, form).put_into(rig, name)
            moved, _ = stacked(alone, changes(alone, with_event, of_recording, effect), inflation)
            gain = _gain(rows, moved - rows, scaled=True)
            if gain >= least:
                least = gain
                size = -float(rows @ (moved - rows)) / float(np.sum((moved - rows) ** 2))
                values[name] = event | {leading.name: size * event[leading.name]}
    return Events(effect, values, form) if values else None


def _scan(
    effect: Term,
    problem: Problem,
    prepared: Prepared,
    rig: Rig,
    base: dict[Key, Residual],
    inflation: dict[str, float],
    size: float | None,
    stopped: Event,
) -> dict[str, float]:
    """Find where the events of one recording begin, the most telling first; empty without any."""
    slots = len(events_of(effect))
    typical = _first_value(effect.info.leading)
    length = prepared.n * prepared.dt
    times = np.arange(0.5 * _SPACING, length - _SPACING, _SPACING)
    rows, _ = stacked(problem, base, inflation)
    signatures: dict[float, Array] = {}
    for group in _spaced_groups(times, slots):
        if stopped.is_set():
            return {}
        values = _event_parameters(
            [(typical if size is None else size, float(t)) for t in group], effect
        )
        try:
            moved, _ = stacked(
                problem,
                changes(problem, rig.with_effect(effect.id, values), base, effect),
                inflation,
            )
        except SimulationError:
            continue
        change = moved - rows
        share = (
            np.arange(rows.size)
            % max(1, rows.size // len(problem.blocks))
            / max(1, rows.size // len(problem.blocks))
            * length
        )
        for place, t in enumerate(group):
            end = group[place + 1] if place + 1 < len(group) else np.inf
            begins, ends = share >= t - _EARLY, share < end - _EARLY
            signatures[float(t)] = np.where(begins & ends, change, 0.0)
    chosen: list[float] = []
    span, sizes = np.zeros((rows.size, 0)), np.zeros(0)
    rest = rows
    while len(chosen) < slots:
        gains = {
            t: _gain(rest, signature - span @ (span.T @ signature), scaled=size is None)
            for t, signature in signatures.items()
            if all(abs(t - s) >= 2.0 * _SPACING for s in chosen)
        }
        best = max(gains, key=lambda t: gains[t], default=0.0)
        if gains.get(best, 0.0) < max(_LEAST_EVENT_GAIN, _EVENT_SHARE * float(rows @ rows)):
            break
        chosen.append(best)
        columns = np.stack([signatures[t] for t in chosen], axis=1)
        if size is None:
            # what the events that were found can still do is no gain of another one
            span, sizes = (
                np.linalg.qr(columns)[0],
                np.asarray(np.linalg.lstsq(columns, -rows, rcond=None)[0]),
            )
        else:
            sizes = np.ones(len(chosen))
        rest = rows + columns @ sizes
    events = [
        (float(factor) * (typical if size is None else size), t)
        for factor, t in zip(sizes, chosen, strict=True)
    ]
    return _event_parameters(sorted(events, key=lambda c: c[1]), effect) if events else {}


def _gain(rest: Array, signature: Array, *, scaled: bool) -> float:
    """Gain in the sum of squares by a signature, of the best size or of its own."""
    power = float(signature @ signature)
    if power < 1e-9:
        return 0.0
    along = float(rest @ signature)
    return along**2 / power if scaled else -2.0 * along - power


def _spaced_groups(times: Array, slots: int) -> list[list[float]]:
    """Times in groups that can be tried in one simulation, far from each other."""
    if slots == 1:
        return [[float(t)] for t in times]
    stride = -(-times.size // slots)
    return [[float(t) for t in times[k::stride]] for k in range(stride)]


def _event_parameters(events: list[tuple[float, float]], effect: Term) -> dict[str, float]:
    """Parameters of a few events of one recording, by their sizes and times."""
    values: dict[str, float] = {}
    for (size, time), parameters in zip(events, events_of(effect), strict=False):
        for parameter in parameters:
            first = _first_of(effect, parameter.name)
            by_role = {"time": time, "duration": _first_value(first)}
            values[parameter.name] = by_role.get(first.role, size)
    return values | {p.name: _first_value(p) for p in effect.info.with_role("rise") if values}


def _fit_alone(
    events_start: Events,
    alone: Problem,
    prepared: Prepared,
    rig: Rig,
    inflation: dict[str, float],
    known: Mapping[str, float],
    stopped: Event,
) -> dict[str, float] | None:
    """Events of one recording fitted alone, at a model that stays; None where the model leaves its
    range.
    """
    effect, start = events_start.effect, events_start.values[prepared.recording.name]
    free = [p for p in start if p not in known and _first_of(effect, p).name not in known]
    scale = np.array([_scale(effect, p) for p in free])
    limits = [_limits(effect, p, prepared) for p in free]
    low, high = (np.array([limit[k] for limit in limits]) / scale for k in (0, 1))

    def values_at(x: Array) -> dict[str, float]:
        return start | {p: float(v) for p, v in zip(free, x * scale, strict=True)}

    def evaluate(x: Array) -> tuple[Array, Array, None]:
        if stopped.is_set():
            raise SimulationError("the search for events was stopped")
        events = replace(events_start, values={prepared.recording.name: values_at(x)})
        by_block = residuals(alone, rig, [f"{effect}.{p}" for p in free], events)
        rows, slope = stacked(alone, by_block, inflation)
        assert slope is not None
        return rows, slope * scale, None

    try:
        first = np.array([start[p] for p in free]) / scale
        x, _, _ = levenberg_marquardt(
            evaluate, first, (low, high), alone.settings.effect_evaluations
        )
    except SimulationError:
        return None
    return values_at(x)


def _limits(effect: Term, parameter: str, prepared: Prepared) -> tuple[float, float]:
    """Smallest and largest value of an event's parameter [SI]."""
    info = find_parameter(f"{effect}.{parameter}")
    limits = {
        "time": (0.0, prepared.n * prepared.dt),
        "duration": (_LEAST_DURATION, _MOST_DURATION),
        "rise": (_LEAST_DURATION, _MOST_DURATION),
    }
    size = max(info.lower, -_MOST_EVENT_SIZE), min(info.upper, _MOST_EVENT_SIZE)
    if effect.info.own:
        size = info.lower, info.upper
    return limits.get(_first_of(effect, parameter).role, size)


def _fit_jointly(
    events: Events, problem: Problem, nominal: Rig, baseline: Fit, inflation: dict[str, float]
) -> Fit | None:
    """Fit baseline and events of every recording together, a changed mass being the same in all;
    None where the model leaves its range.

    One after the other would creep: a baseline that was fitted without the events holds half of
    what a mass does.
    """
    vector = _EventVector.of(events, problem, nominal, baseline, inflation)
    count = len(vector.names)
    try:
        x, (values, jacobian, by_block), spent = levenberg_marquardt(
            vector.evaluate,
            vector.begin(baseline),
            vector.bounds(),
            problem.settings.fit_evaluations,
        )
    except SimulationError:
        return None
    covariance = np.asarray(np.linalg.pinv(jacobian.T @ jacobian, hermitian=True))
    measured = values.size - count  # priors come after
    wide = pieces_spread(
        values[:measured], jacobian[:measured], covariance, pieces_of(problem, by_block)
    )
    white = np.sqrt(np.clip(np.diag(covariance), 1e-300, None))
    # what no residual depends on is not known, although the inverse calls it zero
    white[~np.any(jacobian[:measured], axis=0)] = np.inf
    wide = np.maximum(wide, white)
    # one piece or two tell of an event of one recording: their disagreement is no measure of it,
    # that of what all recordings share is
    every = np.array([True] * count + [not name for name, _ in vector.places])
    known = every & np.isfinite(white)
    coloured = float(np.median(wide[known] / white[known])) if known.any() else 1.0
    spread = np.where(every, wide, coloured * white)[count:]
    std_of = dict(zip(vector.places, (spread * vector.scale).tolist(), strict=True))
    found = vector.events_at(x)

    def vagueness(name: str) -> float:
        own = [s for (place, _), s in zip(vector.places, spread, strict=True) if place == name]
        return float(max(own, default=0.0))

    # the recording that tells most of its event stands for all
    in_order = sorted(found.values, key=vagueness)
    found = replace(found, values={name: found.values[name] for name in in_order})
    event_std = {
        p: std_of.get((in_order[0], p), std_of.get(("", p), math.nan))
        for p in found.values[in_order[0]]
    }
    names, scaling = vector.names, vector.scaling
    return replace(
        baseline,
        effects=(events.effect,),
        rig=scaling.rig(x[:count], {}),
        values={n: scaling.value(n, float(v)) for n, v in zip(names, x[:count], strict=True)},
        std={n: baseline.std[n] for n in names}
        | {f"{events.effect}.{p}": s for p, s in event_std.items()},
        cost=0.5 * float(values @ values),
        residuals=by_block,
        inflation=inflation,
        moved={n: float(v) for n, v in zip(names, x[:count], strict=True)},
        evaluations=spent,
        events=found,
    )


@dataclass(frozen=True, eq=False)
class _EventVector:
    """Baseline and events of every recording as one vector.

    Attributes
    ----------
    events : Events
        Where they begin.
    problem : Problem
        Blocks and recordings.
    inflation : dict of str to float
        As in :func:`pamrs.diagnosis.fit.fit`.
    names : list of str
        Baseline parameters, the first elements of the vector.
    scaling : Scaling
        Of them.
    places : list of (recording, parameter)
        The other elements; one that all recordings share has no recording.
    scale : (k,) array
        Scale of each of these [SI].
    slopes : list of array
        Sensitivities to the baseline parameters in each recording, which stay as they were without
        the events.
    """

    events: Events
    problem: Problem
    inflation: dict[str, float]
    names: list[str]
    scaling: Scaling
    places: list[tuple[str, str]]
    scale: Array
    slopes: list[Array]

    @staticmethod
    def of(
        events: Events, problem: Problem, nominal: Rig, baseline: Fit, inflation: dict[str, float]
    ) -> _EventVector:
        """The vector of a problem."""
        effect, settings = events.effect, problem.settings
        shared = effect.info.form(events.form).shared
        names = list(baseline.moved)
        places = [("", p) for p in shared] + [
            (name, p) for name, event in events.values.items() for p in event if p not in shared
        ]
        scale = np.array([_scale(effect, p) for _, p in places])
        slopes = []
        for prepared in problem.recordings:
            rows, slope = stacked(
                replace(problem, recordings=[prepared]), baseline.residuals, inflation
            )
            slopes.append(np.zeros((rows.size, 0)) if slope is None else slope[:, : len(names)])
        scaling = Scaling(nominal, names, {}, settings)
        return _EventVector(events, problem, inflation, names, scaling, places, scale, slopes)

    def events_at(self, x: Array) -> Events:
        """Events that the elements of a vector stand for."""
        values = {name: dict(event) for name, event in self.events.values.items()}
        for (name, p), value in zip(self.places, x[len(self.names) :] * self.scale, strict=True):
            for event in values.values() if name == "" else [values[name]]:
                event[p] = float(value)
        return replace(self.events, values=values)

    def evaluate(self, x: Array) -> tuple[Array, Array, dict[Key, Residual]]:
        """Stacked residuals and priors, their sensitivities, and the residuals by block and
        recording.
        """
        effect, count = self.events.effect, len(self.names)
        wanted = sorted({p for event in self.events.values.values() for p in event})
        names = [f"{effect}.{p}" for p in wanted]
        by_block = residuals(
            self.problem, self.scaling.rig(x[:count], {}), names, self.events_at(x)
        )
        slopes = np.array(
            [self.scaling.slope(n, float(v)) for n, v in zip(self.names, x[:count], strict=True)]
        )
        parts, columns = [], []
        for prepared, fixed in zip(self.problem.recordings, self.slopes, strict=True):
            rows, slope = stacked(
                replace(self.problem, recordings=[prepared]), by_block, self.inflation
            )
            assert slope is not None
            event = self.events.values.get(prepared.recording.name, {})
            block = np.zeros((rows.size, len(self.places)))
            for k, (name, p) in enumerate(self.places):
                if p in event and name in ("", prepared.recording.name):
                    block[:, k] = slope[:, wanted.index(p)] * self.scale[k]
            parts.append(rows)
            columns.append(np.concatenate([fixed * slopes, block], axis=1))
        prior = np.eye(count, count + len(self.places))
        return np.concatenate([*parts, x[:count]]), np.concatenate([*columns, prior]), by_block

    def begin(self, baseline: Fit) -> Array:
        """Vector where the fit begins: the baseline as it was, each event where it was found."""
        start = [
            (baseline.values[n] - self.scaling.centre[n]) / self.scaling.scale[n]
            for n in self.names
        ]
        every = self.events.values
        event_start = [
            float(np.median([event[p] for event in every.values()]))
            if name == ""
            else every[name][p]
            for name, p in self.places
        ]
        return np.concatenate([start, np.array(event_start) / self.scale])

    def bounds(self) -> tuple[Array, Array]:
        """Smallest and largest value of each element."""
        by_name = {p.recording.name: p for p in self.problem.recordings}
        recordings = [
            by_name[name] if name else self.problem.recordings[0] for name, _ in self.places
        ]
        effect = self.events.effect
        limits = [_limits(effect, p, r) for (_, p), r in zip(self.places, recordings, strict=True)]
        low = np.concatenate(
            [self.scaling.bounds[0], np.array([limit[0] for limit in limits]) / self.scale]
        )
        high = np.concatenate(
            [self.scaling.bounds[1], np.array([limit[1] for limit in limits]) / self.scale]
        )
        return low, high
