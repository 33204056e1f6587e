"""From fitted hypotheses to a verdict: probabilities, model, traces, words."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from pamrs.channels import unit_of
from pamrs.diagnosis.evidence import (
    Candidate,
    Group,
    Judged,
    autocorrelation_of,
    case_ambiguity,
    case_probabilities,
    case_verdict,
    determined,
    is_parameter,
    judge,
    parts_of,
    put_aside,
    share_left,
    start_of,
    stated,
    symptoms_of,
)
from pamrs.diagnosis.explain import _words as words
from pamrs.diagnosis.explain._block_entries import block_entries, not_judged, unexplained
from pamrs.diagnosis.explain._budget import budget
from pamrs.diagnosis.explain._closure_words import describe_closure
from pamrs.diagnosis.explain._conditions import Picture, describe
from pamrs.diagnosis.explain._free_run import Known, free_run, said_of_constants
from pamrs.diagnosis.explain._next import next_experiment
from pamrs.diagnosis.explain._owners import owners_of_effects, owners_of_parameters
from pamrs.diagnosis.explain._words import spoiled
from pamrs.diagnosis.fit import (
    CHOSEN,
    FINAL_STEP_SHARE,
    LEAST_START,
    Events,
    Key,
    Problem,
    depends,
    entry_of,
    events_of,
    fit,
    form_in,
    known_parameters,
    residuals,
    with_entry,
    with_known,
    without_term,
)
from pamrs.diagnosis.noise import NoiseLevel
from pamrs.diagnosis.prepare import Residual, Unjudged
from pamrs.diagnosis.result import Diagnosis
from pamrs.effects import CATALOGUE, id_of, info_of, is_effect, place_of, term_in
from pamrs.errors import SimulationError
from pamrs.findings import (
    HEALTHY,
    BlockResidual,
    ChannelError,
    Considered,
    EffectFound,
    EffectParameterFound,
    FitErrors,
    FreeRun,
    NextExperiment,
    ParameterFound,
    StageError,
    Tested,
    Trace,
    Tried,
    WrongParameter,
    channels_off,
)
from pamrs.recordings import Case
from pamrs.rig import Rig

__all__ = ["assemble"]

# [noise levels] gap of refit to noise below which nothing is said of how much closes
_LEAST_GAP = 0.05
# [tolerances] of two groups about one sensor's zero that refits the vaguer (decision 22)
_ZERO_DIFFERENCE = 0.1
# [tolerances] standard deviation below which a parameter counts as determined by the recordings
_KNOWN_SHARE = 0.7


Array = NDArray[np.float64]


def assemble(
    case: Case,
    fitted: Problem,
    held: Problem,
    groups: list[Group],
    unjudged: Sequence[Unjudged] = (),
) -> Diagnosis:
    """Build the diagnosis from the groups of blocks.

    Parameters
    ----------
    case : Case
        The case.
    fitted, held : Problem
        Recordings to fit and held-out ones (the same object when there are no others).
    groups : list of Group
        Gas blocks and arm, examined.
    unjudged : sequence of Unjudged
        Blocks of the rig that are not judged.
    """
    nominal, settings = case.rig, fitted.settings
    noise_level = {k: v for g in groups for k, v in g.noise_level.items()}
    models, fit_found, out_found = _sound_models(nominal, fitted, held, groups, noise_level)
    judged, verdict = models.judged, models.verdict
    probabilities = case_probabilities(judged)
    ambiguity = case_ambiguity(judged)
    located, part = _located(judged), fitted.losses.part
    picture = _picture(located, nominal, fitted, fit_found, noise_level)
    fit_table = _table(fitted, fit_found, noise_level)
    held_table = _table(held, out_found, noise_level) if held is not fitted else {}
    table = held_table or fit_table
    errors = {"fit": fit_table, "held_out": held_table}
    named = any(j.named or j.wrong for j in judged)
    known = models.chosen if named else models.starts
    owners = models.owners if named else owners_of_parameters(known)
    changed = models.added or any(j.wrong for j in judged)
    gap = _gap(table, _LEAST_GAP) if changed else None
    blocks = block_entries(judged, fitted, fit_found, held, out_found, noise_level)
    budgeted = partial(budget, judged, held, out_found, noise_level, nominal)
    terms = part("the budget", lambda: budgeted(models.final, models.events), [])
    forms = _forms(judged, fitted)
    stages = [(fitted, fit_found)] if held is fitted else [(held, out_found), (fitted, fit_found)]
    uncertain = _known(models)
    running = partial(free_run, held, out_found, nominal, models.final, models.events, uncertain)
    nothing: tuple[list[FreeRun] | None, str] = (None, "the free run failed")
    runs, runs_note = part("the free run", running, nothing)
    off = channels_off(runs or [])
    effects = _effects(judged, verdict, fitted)
    likely = partial(_hypotheses, judged, probabilities, nominal, fitted)
    constants = said_of_constants(runs or [], [effect.id for effect in effects])
    diagnosis = Diagnosis(
        case=case.name,
        verdict=verdict,
        where=words.where(located, fitted, judged, picture),
        effects=effects,
        ambiguity=ambiguity,
        probabilities=probabilities,
        parameters=_parameters(nominal, known, owners),
        fit=FitErrors(fit_table, held_table, gap),
        next_experiment=part(
            "the next experiment",
            lambda: next_experiment(
                verdict, ambiguity, likely(), nominal, judged, fitted, held, list(off)
            ),
            NextExperiment(""),
        ),
        warnings=constants + _warnings(case, models, table, same=held is fitted),
        rig=models.final
        if verdict == "none"
        else _with_std(models.final, nominal, models.chosen, models.owners),
        traces=_traces(fitted, held, fit_found, out_found),
        blocks=[*blocks, *map(not_judged, unjudged)],
        budget=terms,
        unexplained=unexplained(judged, blocks, stages, noise_level, terms, forms, nominal, errors),
        wrong_parameters=_wrong(models, fitted, table),
        measured=list(case.channels),
        residuals=_block_table(groups),
        condition_map=picture.map,
        tried=_tried(groups),
        considered=part("what was asked for", lambda: _considered(judged, fitted), []),
        tested=part("the list of what was tested", lambda: _tested(groups), []),
        free_run=runs,
        free_run_note=runs_note,
        settings=settings,
    )
    return _worded(diagnosis, case, judged, forms)


def _picture(
    located: str | None,
    nominal: Rig,
    fitted: Problem,
    found: dict[str, dict[Key, Residual]],
    noise_level: dict[Key, NoiseLevel],
) -> Picture:
    """Where and when the block that the answer is about is off."""
    if located is None:
        return Picture()
    block = next(b for b in fitted.blocks if b.name == located)
    stages = found["refit"], found["after"]
    return fitted.losses.part(
        "the conditions of the mismatch",
        lambda: describe(block, fitted.recordings, nominal, *stages, noise_level),
        Picture(),
    )


def _sound_models(
    nominal: Rig,
    fitted: Problem,
    held: Problem,
    groups: list[Group],
    noise_level: dict[Key, NoiseLevel],
) -> tuple[_Models, dict[str, dict[Key, Residual]], dict[str, dict[Key, Residual]]]:
    """The rig at every stage with names that spoil no channel, and the residuals of the recordings
    to fit and of the held-out ones.

    What leads a group and predicts a channel worse than the model without it does is put aside, and
    the group is judged again without it.
    """
    settings = fitted.settings
    groups = [determined(group, fitted) for group in groups]
    while True:
        judged = judge(groups, settings)
        models = _models(nominal, fitted, judged, case_verdict(judged))
        inside = models.residuals(fitted)
        outside = inside if held is fitted else models.residuals(held)
        problem, found = (fitted, inside) if held is fitted else (held, outside)
        spoilt = spoiled(_table(problem, found, noise_level))
        blamed = _blamed(models.judged, spoilt)
        if not blamed:
            return models, inside, outside
        groups = [
            _without_name(group, models.judged[k]) if k in blamed else group
            for k, group in enumerate(groups)
        ]


def _without_name(group: Group, judged: Judged) -> Group:
    """A group without what it adds to the model: its name, or the form of what has none."""
    if judged.named:
        return put_aside(group, judged.chosen.key)
    return replace(group, closure=None)


def _blamed(judged: list[Judged], spoilt: Collection[str]) -> set[int]:
    """Groups that add to the model what spoils a channel: those that have the channel, else those
    whose additions act in its block.
    """
    added = {k: _additions(j) for k, j in enumerate(judged) if _additions(j)}
    blamed: set[int] = set()
    for channel in spoilt:
        own = {k for k in added if channel in {b.channel for b in judged[k].group.blocks}}
        blocks = [b for j in judged for b in j.group.blocks if b.channel == channel]
        acting = {k for k in added if any(depends(b, n) for b in blocks for n in added[k])}
        blamed |= own or acting
    return blamed


def _additions(judged: Judged) -> tuple[str, ...]:
    """Effects that a group adds to the model."""
    closure = judged.group.closure if judged.verdict == "unlisted" else None
    return judged.named or (closure.effects if closure is not None else ())


def _worded(
    diagnosis: Diagnosis,
    case: Case,
    judged: list[Judged],
    forms: dict[str, str],
) -> Diagnosis:
    """A diagnosis with its verdict in words."""
    sought = any(j.group.sought for j in judged if j.verdict == "unlisted")
    told = list(dict.fromkeys(forms.values()))
    return replace(diagnosis, text=words.verdict(diagnosis, case, told, sought=sought))


def _forms(judged: list[Judged], fitted: Problem) -> dict[str, str]:
    """What a mismatch without a name is a function of, in words, by block."""
    found: dict[str, str] = {}
    for group in (j.group for j in judged if j.verdict == "unlisted"):
        if group.closure is not None:
            own = replace(fitted, blocks=group.blocks)
            text = describe_closure(group.closure.fit, own, group.candidates[0].fit)
            found |= dict.fromkeys((b.name for b in group.blocks), text)
    return found


@dataclass(frozen=True, eq=False)
class _Models:
    """The rig at every stage.

    Attributes
    ----------
    judged : list of Judged
        The groups, what they name fitted beside what other groups know better.
    starts, chosen : list of Candidate
        The baseline of each group, and what goes into the final model, with standard deviations
        that hold for equations that are not quite the rig's.
    owners : dict of str to int
        Of each parameter the group whose value the final model has.
    nominal, baseline, final : Rig
        As the rig file has it, refitted inside its tolerances, and with what was found.
    verdict : str
        Of the case.
    """

    judged: list[Judged]
    starts: list[Candidate]
    chosen: list[Candidate]
    owners: dict[str, int]
    nominal: Rig
    baseline: Rig
    final: Rig
    verdict: str

    @property
    def added(self) -> bool:
        """Whether the model has effects that the nominal one does not hold."""
        return len(self.final.effects) > len(self.nominal.effects)

    @property
    def events(self) -> Events | None:
        """What happened in single recordings."""
        happened = (c.fit.events for c in self.chosen if c.fit.events is not None)
        return next(happened, None) if self.added else None

    def residuals(self, problem: Problem) -> dict[str, dict[Key, Residual]]:
        """Residuals of some recordings at every stage."""
        return {
            "before": _run(problem, self.nominal, None),
            "refit": _run(problem, self.baseline, None),
            "after": _run(problem, self.final, self.events),
        }


def _models(nominal: Rig, fitted: Problem, judged: list[Judged], verdict: str) -> _Models:
    """The rig at every stage, from the verdicts of the groups."""
    begun = _settled(nominal, fitted, judged, [j.group.candidates[0] for j in judged])
    baseline = _merged(nominal, begun)
    starts = _widened(fitted, judged, begun)
    if verdict not in ("effects", "unlisted") and not any(j.wrong for j in judged):
        final = nominal if verdict == "none" else baseline
        return _Models(
            judged, starts, starts, owners_of_parameters(begun), nominal, baseline, final, verdict
        )
    wanted = [_model_of(j, start) for j, start in zip(judged, begun, strict=True)]
    ended = _settled(nominal, fitted, judged, wanted)
    chosen = _widened(fitted, judged, ended)
    judged = [
        replace(j, chosen=c) if j.named or j.wrong else j
        for j, c in zip(judged, chosen, strict=True)
    ]
    final = _merged(nominal, ended)
    owners = owners_of_parameters(ended)
    return _Models(judged, starts, chosen, owners, nominal, baseline, final, verdict)


def _known(models: _Models) -> Known:
    """What is known of the values of the final model: as they were fitted, with what goes together,
    and of others what the rig file says.
    """
    of_file = {n: p for n, p in known_parameters(models.nominal).items() if p.tol > 0}
    names, values, parts = list[str](), list[float](), list[Array]()
    for k, candidate in enumerate(models.chosen):
        found = candidate.fit
        every = list(found.scales)
        own = [n for n in every if models.owners.get(n, k) == k and math.isfinite(found.std[n])]
        at = [every.index(n) for n in own]
        fitted = np.sqrt(np.maximum(np.diag(found.covariance)[at], 1e-300))
        wide = np.array([found.std[n] for n in own]) / fitted
        size, axes = np.linalg.eigh(found.covariance[np.ix_(at, at)] * np.outer(wide, wide))
        parts.append(axes * np.sqrt(np.maximum(size, 0.0)))
        names += own
        values += [found.values[n] for n in own]
    rest = [n for n in of_file if n not in names and math.isfinite(of_file[n].tol)]
    parts.append(np.diag([of_file[n].tol for n in rest]))
    values += [of_file[n].value for n in rest]
    return Known((*names, *rest), np.array(values), block_diag(*parts))


def _warnings(
    case: Case,
    models: _Models,
    table: dict[str, ChannelError],
    *,
    same: bool,
) -> list[str]:
    """What a reader should know before trusting the rest."""
    named = any(j.named or j.wrong for j in models.judged)
    return [
        *words.absolute(case),
        *(words.reservations(models.judged, models.chosen, table) if named else []),
        *(words.worse(table) if models.added else []),
        *words.warnings(case, models.judged, same),
    ]


def _model_of(judged: Judged, start: Candidate) -> Candidate:
    """What of a group goes into the model: what is named, or a form of what has no name, or
    parameters alone.
    """
    if judged.named or judged.wrong:
        return judged.chosen
    return (judged.group.closure if judged.verdict == "unlisted" else None) or start


def _run(problem: Problem, rig: Rig, events: Events | None) -> dict[Key, Residual]:
    """Residuals of a model; what happened in single recordings in the place of what its file
    says.
    """
    return residuals(
        problem, rig if events is None else without_term(rig, events.effect), (), events
    )


def _tried(groups: list[Group]) -> list[Tried]:
    """Every set of effects that was fitted, with what it leaves of each block's excess."""
    return [
        Tried(
            blocks=[b.name for b in group.blocks],
            effects=list(candidate.effects),
            wrong_parameters=list(candidate.wrong),
            fitted={b: e.ratio for b, e in candidate.fitted.items()},
            held_out={b: e.ratio for b, e in candidate.held_out.items()},
            gap_closed=candidate.gap_closed,
            scatter=candidate.scatter,
            fitted_values=candidate.fit.effect_values,
            std={
                n: s
                for n, s in candidate.fit.std.items()
                if n not in candidate.fit.moved
                and is_effect(n.partition(".")[0])
                and math.isfinite(s)
            },
            prior=sum(v * v for v in candidate.fit.moved.values()),
            suspects=[b.name for b in group.suspects],
            gain=candidate.gain,
        )
        for group in groups
        for candidate in group.candidates
    ]


def _considered(judged: list[Judged], fitted: Problem) -> list[Considered]:
    """What of each set that the caller asked for acts where a mismatch is, by group of blocks, and
    what it leaves; without blocks where nothing is missing in any.
    """
    found: list[Considered] = []
    for asked in fitted.considered:
        before = len(found)
        for own in judged:
            group, blocks = own.group, own.group.suspects
            acting = [n for n in asked if any(depends(b, n) for b in blocks)]
            if group.mismatch is None or group.below_noise or not acting:
                continue
            there = next((c for c in group.candidates if set(c.names) == set(acting)), None)
            left = None
            if there is not None:
                left = share_left(there, group.candidates[0], blocks)
            probability = _chance(own, acting)
            found.append(Considered(acting, [b.name for b in blocks], probability, left))
        if len(found) == before:
            chance = max(_chance(own, asked) for own in judged)
            found.append(Considered(list(asked), [], chance, None))
    return found


def _chance(judged: Judged, names: Sequence[str]) -> float:
    """Probability that a group has these names and no others."""
    return sum(p for key, p in judged.probabilities.items() if set(key.split("+")) == set(names))


def _tested(groups: list[Group]) -> list[Tested]:
    """Every persistent effect that acts where a mismatch is, its predicted gain and what it leaves
    alone, the best first.
    """
    found = []
    for group in groups:
        for effect, predicted_gain in group.predicted_gain.items():
            singles = [c for c in group.candidates if c.effects == (effect,)]
            alone = [share_left(c, group.candidates[0], group.suspects) for c in singles]
            blocks = [b.name for b in group.suspects]
            found.append(
                Tested(effect, blocks, min(1.0, max(0.0, predicted_gain)), min(alone, default=None))
            )
    return sorted(
        found, key=lambda a: (a.left is None, a.left if a.left is not None else -a.predicted_gain)
    )


def _hypotheses(
    judged: list[Judged], probabilities: dict[str, float], nominal: Rig, problem: Problem
) -> list[tuple[str, Rig, float]]:
    """The likely hypotheses that have a model, as fitted, the refitted baseline where nothing has a
    name; those of an effect with times of its own can predict no other recording.
    """
    found, least = [], problem.settings.simulated_from
    healthy = {key: p for key, p in probabilities.items() if key in HEALTHY}

    def model(chosen: list[Candidate]) -> Rig:
        stated = _widened(problem, judged, chosen)
        return _with_std(_merged(nominal, chosen), nominal, stated, owners_of_parameters(chosen))

    likeliest = max(healthy, key=lambda key: healthy[key], default="")
    if sum(healthy.values()) >= least:
        chosen = [j.group.candidates[0] for j in judged]
        found.append((likeliest, model(chosen), sum(healthy.values())))
    for key, p in probabilities.items():
        wanted = frozenset(key.split("+"))
        if p < least or not all(id_of(name) in CATALOGUE or is_parameter(name) for name in wanted):
            continue
        chosen = [_inside(j.group, wanted) for j in judged]
        if any(c.fit.events is not None for c in chosen):
            continue
        if {name for c in chosen for name in c.names} == wanted:
            found.append((key, model(chosen), p))
    return found


def _inside(group: Group, wanted: frozenset[str]) -> Candidate:
    """The most probable hypothesis of a group that names nothing else than what is wanted; the
    baseline where there is none.
    """
    named = [c for c in group.candidates if c.names and set(c.names) <= wanted]
    return max(
        named, key=lambda c: group.probabilities.get(c.key, 0.0), default=group.candidates[0]
    )


def _settled(
    nominal: Rig, problem: Problem, judged: list[Judged], chosen: list[Candidate]
) -> list[Candidate]:
    """The fits of the groups again, with what another group knows better (the sensors' zeros) held,
    where theirs are others.

    A rig has one zero of a sensor; the other values of a fit are right beside its own only.
    """
    owners = owners_of_parameters(chosen)
    found = list(chosen)
    for k, candidate in enumerate(chosen):
        own = replace(problem, blocks=judged[k].group.blocks)
        # those that were held before too: a fit that frees one again is right beside its own only
        common = {
            n: chosen[owner].fit
            for n, owner in owners.items()
            if owner != k and n.startswith("sensors.") and any(depends(b, n) for b in own.blocks)
        }
        own_values = candidate.fit.rig.parameters
        apart = any(
            abs(own_values[n].value - other.values[n])
            > _ZERO_DIFFERENCE * nominal.parameters[n].tol
            for n, other in common.items()
        )
        if apart and candidate.fit.events is None:
            effects = candidate.fit.effects
            free, fixed, forms = parts_of(
                start_of(candidate.fit, effect, LEAST_START) for effect in effects
            )
            settled = {n: other.values[n] for n, other in common.items()}
            autocorrelation = autocorrelation_of(own, candidate.fit, judged[k].group.noise_level)
            with contextlib.suppress(SimulationError):  # it then stays as it was fitted
                again = fit(
                    own,
                    nominal,
                    effects,
                    free,
                    autocorrelation,
                    fixed=fixed,
                    warm=candidate.fit,
                    share=FINAL_STEP_SHARE,
                    settled=settled,
                    freed=candidate.fit.freed,
                    forms=forms,
                )
                found[k] = replace(candidate, fit=again)
    return found


def _widened(problem: Problem, judged: list[Judged], chosen: list[Candidate]) -> list[Candidate]:
    """The fits of the groups with the standard deviations that are stated."""
    return [stated(problem, j.group, c) for j, c in zip(judged, chosen, strict=True)]


def _merged(nominal: Rig, candidates: list[Candidate]) -> Rig:
    """One rig from the groups' fits; where two have a value of their own, that of the group that
    knows it best.
    """
    rig = nominal
    for _, entry in _added(nominal, candidates):
        rig = with_entry(rig, entry)
    owners = owners_of_parameters(candidates).items()
    return with_known(rig, {name: candidates[k].fit.values[name] for name, k in owners})


def _added(nominal: Rig, candidates: list[Candidate]) -> Iterator[tuple[Candidate, dict[str, Any]]]:
    """Effects that the fits have and the nominal model has not, each from the fit that knows it
    best.
    """
    owners = owners_of_effects(candidates)
    for k, candidate in enumerate(candidates):
        for entry in candidate.fit.rig.effects:
            if entry["id"] not in _ids(nominal) and owners.get(term_in(entry), k) == k:
                yield candidate, entry


def _ids(rig: Rig) -> set[str]:
    """Ids of the effects that a rig holds."""
    return {entry["id"] for entry in rig.effects}


def _with_std(rig: Rig, nominal: Rig, candidates: list[Candidate], owners: dict[str, int]) -> Rig:
    """A model with the standard deviations of its effects; of one that the nominal model held, as
    the group has it that knows it best.
    """
    spread = {name: candidates[k].fit.std[name] for name, k in owners.items()}
    rig = with_known(rig, {}, {name: s for name, s in spread.items() if math.isfinite(s)})
    for candidate, effect in _added(nominal, candidates):
        own = term_in(effect) + "."
        std = {
            n.removeprefix(own): s
            for n, s in candidate.fit.std.items()
            if n.startswith(own) and math.isfinite(s)
        }
        rig = with_entry(rig, effect, std)
    return rig


def _located(judged: list[Judged]) -> str | None:
    """The block that the answer is about: that with the largest mismatch, of groups with a name or
    without one; else one with a signature below the noise, else one at a wall.
    """
    told = [j for j in judged if j.named or j.wrong or j.verdict == "unlisted"]
    above = [j.group for j in told if not j.group.below_noise]
    for groups in (above, [j.group for j in told], [j.group for j in judged]):
        found = [
            (g.candidates[0].held_out[g.mismatch.name].ratio, g.mismatch.name)
            for g in groups
            if g.mismatch
        ]
        if found:
            return max(found)[1]
    for j in sorted(judged, key=lambda j: not j.wrong):
        moved = symptoms_of(j.group)
        worst = j.wrong or tuple(sorted(moved, key=lambda n: -abs(moved[n])))
        for block in reversed(j.group.blocks):
            if worst and depends(block, worst[0]):
                return block.name
    return None


def _table(
    problem: Problem, found: dict[str, dict[Key, Residual]], noise_level: dict[Key, NoiseLevel]
) -> dict[str, ChannelError]:
    """Error of every channel at every stage."""
    out = {}
    for block in problem.blocks:
        errors = {}
        noise, weights = [], []
        for prepared in problem.recordings:
            noise.append(noise_level[block.name, prepared.recording.name].sample ** 2)
            weights.append(
                max(1, int(found["refit"][block.name, prepared.recording.name].rows.sum()))
            )
        level = math.sqrt(float(np.average(noise, weights=weights)))
        for stage in ("before", "refit", "after"):
            squares = []
            for prepared in problem.recordings:
                r = found[stage][block.name, prepared.recording.name]
                squares.append(float(np.mean(r.value[r.rows] ** 2)) if r.rows.any() else 0.0)
            errors[stage] = math.sqrt(float(np.average(squares, weights=weights)))
        out[block.channel] = ChannelError(level, errors["before"], errors["refit"], errors["after"])
    return out


def _gap(table: dict[str, ChannelError], least: float) -> float | None:
    """(refit - after)/(refit - noise), pooled over channels in units of their noise."""
    refit = sum(e.refit / e.noise for e in table.values())
    after = sum(e.after / e.noise for e in table.values())
    room = refit - len(table)
    return None if room < least else max(0.0, min(1.0, (refit - after) / room))


def _effects(judged: list[Judged], verdict: str, problem: Problem) -> list[EffectFound]:
    """The effects that are named, the most probable first; without a name those that come
    closest.
    """
    found: dict[str, tuple[float, Candidate]] = {}
    chosen = [j.chosen for j in judged]
    owners = owners_of_effects(chosen)
    in_set = problem.settings.in_set
    for j in judged:
        names = {effect for c in j.group.candidates for effect in c.effects}
        listed = {effect for effect in names if id_of(effect) in CATALOGUE}
        for effect in j.named if verdict == "effects" else listed:
            p = j.probability(effect)
            if verdict == "effects":
                first = max(p, found[effect][0] if effect in found else 0.0)
                found[effect] = first, chosen[owners[effect]]
            elif p >= in_set:
                own = [c for c in j.group.candidates if effect in c.effects]
                best = max(own, key=lambda c: (j.group.probabilities.get(c.key, 0.0), c.gap_closed))
                found[effect] = p, stated(problem, j.group, best)
    return [
        EffectFound(
            id=id_of(effect),
            name=info_of(effect).name,
            at=place_of(effect),
            form=form_in(candidate.fit.rig, effect),
            probability=p,
            inclusion=max(
                (j.group.inclusion[effect] for j in judged if effect in j.group.inclusion),
                default=None,
            ),
            parameters=_effect_parameters(effect, candidate),
            events=_events(effect, candidate),
        )
        for effect, (p, candidate) in sorted(found.items(), key=lambda kv: -kv[1][0])
    ]


def _wrong(
    models: _Models, problem: Problem, table: dict[str, ChannelError]
) -> list[WrongParameter]:
    """Parameters that the rig file is wrong about: its value, the one that the recordings ask for,
    and what the error becomes.
    """
    found, judged = [], models.judged
    for name in dict.fromkeys(name for j in judged for name in j.wrong):
        naming = [j for j in judged if name in j.wrong]
        # of a zero that two groups have, the value is that of the group that knows it best
        own = models.chosen[models.owners[name]].fit
        known = known_parameters(models.nominal)[name]
        value, std = own.values[name], own.std[name]
        told = [
            b
            for b in problem.blocks
            if depends(b, name) and any(b in j.group.blocks for j in naming)
        ]
        errors = {b.channel: table[b.channel] for b in told}
        found.append(
            WrongParameter(
                name=name,
                block=told[-1].name if told else None,
                nominal=known.value,
                tolerance=known.tol,
                value=value,
                std=std,
                interval=_interval(value, std, known.lower),
                unit=known.unit,
                moved_sigmas=own.moved[name],
                probability=max(j.probability(name) for j in naming),
                held_out={
                    channel: StageError(e.before, e.refit, e.after) for channel, e in errors.items()
                },
            )
        )
    return found


def _events(effect: str, candidate: Candidate) -> list[dict[str, Any]]:
    """What happened in each recording, one entry for each event."""
    events = candidate.fit.events
    if events is None or events.effect != effect:
        return []
    found = []
    rises = [p.name for p in info_of(effect).with_role("rise")]
    for recording, values in events.values.items():
        for parameters in events_of(effect, events.form):
            own = {p.repeats or p.name: values[p.name] for p in parameters if p.name in values}
            if own:
                found.append(
                    {"recording": recording, **own, **{n: values[n] for n in rises if n in values}}
                )
    return found


def _effect_parameters(effect: str, candidate: Candidate) -> dict[str, EffectParameterFound]:
    """Parameters of an effect, fitted or chosen."""
    rig = candidate.fit.rig
    unknown_volume = bool(words.unknown_volumes(rig))
    out: dict[str, EffectParameterFound] = {}
    for parameter in info_of(effect).form(form_in(rig, effect)).parameters:
        name = f"{effect}.{parameter.name}"
        if parameter.role in (*CHOSEN, "threshold"):
            chosen = entry_of(rig, effect)["parameters"][parameter.name]
            out[parameter.name] = EffectParameterFound(chosen, None, parameter.unit)
            continue
        if name not in candidate.fit.values:
            continue
        value, std = candidate.fit.values[name], candidate.fit.std[name]
        out[parameter.name] = _entry(
            value,
            std,
            parameter.unit,
            # a pure number does not change with a volume that nobody knows
            (parameter.unit == "1" or not unknown_volume) and std < max(abs(value), 1e-300),
            parameter.lower,
        )
    if (
        info_of(effect).block == "chamber"
        and rig.model["valve"] is None
        and "" in rig.tables("chamber")
    ):
        out |= _emptying(effect, candidate)
    return out


_REFERENCE_DENSITY = 1.185
"""Density of air in the reference state of ISO 6358 [kg/m3], to which conductances refer."""


def _emptying(effect: str, candidate: Candidate) -> dict[str, EffectParameterFound]:
    """How fast a conductance empties a sealed chamber, and what of it does not depend on the
    chamber's volume.
    """
    gas, chamber = candidate.fit.rig.model["gas"], candidate.fit.rig.model["chamber"]
    out: dict[str, EffectParameterFound] = {}
    for parameter in info_of(effect).form(form_in(candidate.fit.rig, effect)).parameters:
        name = f"{effect}.{parameter.name}"
        if parameter.unit != "m3/(s Pa)" or candidate.fit.values.get(name, 0.0) <= 0:
            continue
        value, std = candidate.fit.values[name], candidate.fit.std[name]
        volume = chamber["dead_volume"]
        rt = gas["gas_constant"] * gas["temperature"]
        tau = volume / (value * _REFERENCE_DENSITY * rt * chamber.get("alpha_out", 1.0))
        out["time_constant"] = _entry(tau, tau * std / value, "s", std < value)
        out["conductance_per_volume"] = _entry(
            value / volume, std / volume, "1/(s Pa)", std < value
        )
    return out


def _entry(
    value: float, std: float, unit: str, identifiable: bool, lower: float = 0.0
) -> EffectParameterFound:
    """A fitted parameter with its interval of 95 %; without one, where the recordings do not depend
    on it.
    """
    if not math.isfinite(std):
        return EffectParameterFound(value, None, unit, identifiable=False)
    return EffectParameterFound(value, std, unit, _interval(value, std, lower), identifiable)


def _interval(value: float, std: float, lower: float) -> list[float]:
    """Interval of 95 %, inside the lower bound."""
    return [max(lower, value - 1.96 * std), value + 1.96 * std]


def _parameters(
    nominal: Rig, candidates: list[Candidate], owners: dict[str, int]
) -> dict[str, ParameterFound]:
    """Parameters of the baseline, each as the group has it that knows it best."""
    out: dict[str, ParameterFound] = {}
    known = known_parameters(nominal)
    for name, k in owners.items():
        p, own = known[name], candidates[k].fit
        out[name] = ParameterFound(
            nominal=p.value,
            value=own.values[name],
            std=own.std[name],
            unit=p.unit,
            moved_sigmas=own.moved[name],
            identifiable=own.std[name] < _KNOWN_SHARE * p.tol,
        )
    return out


def _block_table(groups: list[Group]) -> dict[str, BlockResidual]:
    """Residual of each block's refitted baseline."""
    out: dict[str, BlockResidual] = {}
    for group in groups:
        for block in group.blocks:
            found = group.baseline[block.name]
            out[block.name] = BlockResidual(
                found.rms, found.noise, found.systematic, found.p_value, block.channel
            )
    return out


def _traces(
    fitted: Problem, held: Problem, inner: dict[str, Any], outer: dict[str, Any]
) -> list[Trace]:
    traces = []
    stock = [(fitted, inner)] if held is fitted else [(fitted, inner), (held, outer)]
    for problem, found in stock:
        for prepared in problem.recordings:
            for block in problem.blocks:
                stages = {
                    s: found[s][block.name, prepared.recording.name]
                    for s in ("before", "refit", "after")
                }
                shown = {s: np.where(r.rows, r.prediction, np.nan) for s, r in stages.items()}
                recording = prepared.recording
                traces.append(
                    Trace(
                        recording.name,
                        recording.role,
                        block.channel,
                        unit_of(block.channel),
                        recording.time,
                        recording.channels[block.channel],
                        **shown,
                    )
                )
    return traces
