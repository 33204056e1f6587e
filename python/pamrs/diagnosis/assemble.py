"""From fitted hypotheses to a verdict: probabilities, model, traces, words."""

from __future__ import annotations

import contextlib
import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np

from pamrs.case import Case
from pamrs.channels import unit_of
from pamrs.diagnosis import words
from pamrs.diagnosis.blocks import Residual
from pamrs.diagnosis.candidates import EXACT, Candidate, Group, colour_of, parts_of, significant, start_of
from pamrs.diagnosis.conditions import Picture, describe
from pamrs.diagnosis.evidence import Floor
from pamrs.diagnosis.experiment import propose
from pamrs.diagnosis.fitting import Events, Key, Problem, fit, residuals
from pamrs.diagnosis.result import Diagnosis, Trace
from pamrs.diagnosis.starts import CHOICES
from pamrs.diagnosis.weighing import share_left
from pamrs.effects_table import CATALOGUE, EFFECTS
from pamrs.errors import DiagnosisError, ParameterError, SimulationError
from pamrs.rig import Rig

__all__ = ["assemble"]

SYMPTOM = 2.9
"""Tolerances beyond which a refitted parameter is a symptom of missing physics, not a result."""
SHARED = 6.0
"""Odds of one effect that acts in two blocks to two effects."""
SIMULATED = 0.03
"""Probability from which a hypothesis is simulated in the search for the next experiment."""
APART = 0.1
"""Tolerances by which two groups differ about a sensor's zero, from which the earlier one is fitted again."""
SETTLED = 0.9
"""Probability from which an answer counts as settled."""


def assemble(case: Case, fitted: Problem, held: Problem, groups: list[Group]) -> Diagnosis:
    """Build the diagnosis from the groups of blocks.

    Parameters
    ----------
    case : Case
        The case.
    fitted, held : Problem
        Recordings to fit and held-out ones (the same object when there are no others).
    groups : list of Group
        Gas blocks and arm, examined.
    """
    nominal = case.rig
    starts = _settled(nominal, fitted, groups, [g.candidates[0] for g in groups])
    baseline = _merged(nominal, starts)
    probabilities, symptoms = _probabilities(groups)
    top = max(probabilities, key=lambda k: probabilities[k])
    verdict = top if top in ("none", "parameters", "unlisted") else "effects"
    chosen = starts
    if verdict == "effects":
        picked = _chosen(groups, frozenset(top.split("+")))
        chosen = _settled(nominal, fitted, groups, picked)
        groups = [
            replace(g, candidates=[new if c is old else c for c in g.candidates])
            for g, old, new in zip(groups, picked, chosen, strict=True)
        ]
    model = _merged(nominal, chosen)
    named = list(dict.fromkeys(e for c in chosen for e in c.effects))
    if verdict in ("none", "parameters"):
        model = nominal if verdict == "none" else baseline
        named = []
    elif verdict == "unlisted":
        # the most probable catalogue effects stay in the list with their (small) probability; the model gets the form that was found
        chosen = [g.closure or (g.best if _named(g) else start) for g, start in zip(groups, starts, strict=True)]
        model = _merged(nominal, chosen)
    floor = {k: v for g in groups for k, v in g.floor.items()}
    stages = {"before": nominal, "refit": baseline, "after": model}
    events = next((c.fit.events for c in chosen if c.fit.events is not None), None) if model.effects else None
    fit_found = {s: _run(fitted, rig, events if s == "after" else None) for s, rig in stages.items()}
    out_found = fit_found if held is fitted else {s: _run(held, rig, events if s == "after" else None) for s, rig in stages.items()}
    located = _located(groups, symptoms)
    picture = Picture()
    if located is not None:
        block = next(b for b in fitted.blocks if b.name == located)
        picture = describe(block, fitted.recordings, nominal, fit_found["refit"], fit_found["after"], floor)
    fit_table = _table(fitted, fit_found, floor)
    held_table = _table(held, out_found, floor) if held is not fitted else {}
    gap = _gap(held_table or fit_table)
    effects = _effects(groups, probabilities, model if verdict == "effects" else None)
    ambiguity = _ambiguity(probabilities)
    parameters = _parameters(nominal, chosen if verdict == "effects" else starts)
    where = words.where(located, fitted, groups, picture)
    diagnosis = Diagnosis(
        case=case.name,
        verdict=verdict,
        where=where,
        effects=effects,
        ambiguity=ambiguity,
        probabilities=probabilities,
        parameters=parameters,
        fit={"channels": fit_table, "held_out": held_table, "gap_closed": gap if model.effects else None},
        next_experiment=_next(verdict, probabilities, ambiguity, nominal, groups, fitted, held),
        warnings=[
            *words.absolute(case),
            *(words.reservations(chosen, held_table or fit_table, doubtful=bool(ambiguity)) if verdict == "effects" else []),
            *(words.worse(held_table or fit_table) if model.effects else []),
            *words.warnings(case, groups, symptoms, held is fitted),
        ],
        rig=_with_std(model, chosen) if model.effects else model,
        traces=_traces(fitted, held, fit_found, out_found),
        blocks=_block_table(groups),
        condition_map=picture.map,
        tried=_tried(groups),
        asked=_asked(groups),
    )
    forms = [g.form for g in groups if g.closure is not None] if verdict == "unlisted" else []
    diagnosis.text = words.verdict(diagnosis, named, case, gap, forms, sought=any(g.sought for g in groups))
    return diagnosis


def _run(problem: Problem, rig: Rig, events: Events | None) -> dict[Key, Residual]:
    """Residuals of a model; what happened in single recordings in the place of what its file says."""
    return residuals(problem, rig if events is None else rig.without_effect(events.effect), (), events)


def _tried(groups: list[Group]) -> list[dict[str, Any]]:
    """Every set of effects that was fitted, with what it leaves of each block's excess."""
    return [
        {
            "blocks": [b.name for b in group.blocks],
            "effects": list(candidate.effects),
            "fitted": {b: e.ratio for b, e in candidate.fitted.items()},
            "held_out": {b: e.ratio for b, e in candidate.held_out.items()},
            "gap_closed": candidate.gap_closed,
            "scatter": candidate.scatter,
            "values": {n: v for n, v in candidate.fit.values.items() if n.partition(".")[0] in EFFECTS},
            "std": {n: v for n, v in candidate.fit.std.items() if n.partition(".")[0] in EFFECTS},
            "prior": sum(v * v for v in candidate.fit.moved.values()),
            "suspects": [b.name for b in group.suspects],
            "gain": candidate.gain,
        }
        for group in groups
        for candidate in group.candidates
    ]


def _asked(groups: list[Group]) -> list[dict[str, Any]]:
    """Every lasting effect that acts where a mismatch is, what it promised and what it leaves alone, the best first."""
    found = []
    for group in groups:
        for effect, promised in group.promised.items():
            alone = [share_left(c, group.candidates[0], group.suspects) for c in group.candidates if c.effects == (effect,)]
            blocks = [b.name for b in group.suspects]
            found.append({"id": effect, "blocks": blocks, "promised": min(1.0, max(0.0, promised)), "left": min(alone, default=None)})
    return sorted(found, key=lambda a: (a["left"] is None, a["left"] if a["left"] is not None else -a["promised"]))


def _next(
    verdict: str,
    probabilities: dict[str, float],
    ambiguity: list[list[str]],
    nominal: Rig,
    groups: list[Group],
    fitted: Problem,
    held: Problem,
) -> dict[str, Any]:
    """What to record next: simulated with every hypothesis that has a model, where two or more are left; else in words."""
    left = _hypotheses(groups, probabilities, nominal)
    recordings = [*fitted.recordings, *(held.recordings if held is not fitted else [])]
    if ambiguity and len(left) > 1:
        common = set.intersection(*(set(p.noise) for p in recordings))
        noise = {channel: float(np.median([p.noise[channel] for p in recordings])) for channel in sorted(common)}
        with contextlib.suppress(DiagnosisError, ParameterError, SimulationError):  # a rig that no experiment of the library suits
            return propose(nominal, left, noise, recordings)
    return words.next_experiment(verdict, probabilities, ambiguity, nominal)


def _chosen(groups: list[Group], wanted: frozenset[str]) -> list[Candidate]:
    """The candidate of each group that belongs to a set of effects: of those inside it, the most probable of the group.

    A group that keeps nothing has the baseline alone.
    """
    found = []
    for group in groups:
        own = [c for c in group.candidates if set(c.effects) <= wanted]
        named = [c for c in own if c.effects] if group.mismatch is not None else []
        weights = [group.probabilities.get("+".join(c.effects), 0.0) for c in named]
        found.append(named[weights.index(max(weights))] if named else group.candidates[0])
    return found


def _hypotheses(groups: list[Group], probabilities: dict[str, float], nominal: Rig) -> list[tuple[str, Rig, float]]:
    """The likely hypotheses that have a model, as fitted; those of an effect with times of its own can predict no other recording."""
    found = []
    for key, p in probabilities.items():
        wanted = frozenset(key.split("+"))
        if p < SIMULATED or not wanted <= set(CATALOGUE):
            continue
        chosen = _chosen(groups, wanted)
        if any(c.fit.events is not None for c in chosen):
            continue
        if {e for c in chosen for e in c.effects} == wanted:
            found.append((key, _with_std(_merged(nominal, chosen), chosen), p))
    return found


def _named(group: Group) -> bool:
    """Whether an effect is the most probable answer of a group."""
    odds = group.probabilities
    named = max((p for k, p in odds.items() if k not in ("", "unlisted")), default=0.0)
    return group.mismatch is not None and named > max(odds.get("", 0.0), odds.get("unlisted", 0.0))


def _settled(nominal: Rig, problem: Problem, groups: list[Group], chosen: list[Candidate]) -> list[Candidate]:
    """The fits of earlier groups again, with what the last one settles (the sensors' zeros) held, where theirs are others.

    A rig has one zero of a sensor; the other values of a fit are right beside its own only.
    """
    *earlier, last = chosen
    found = []
    for group, candidate in zip(groups, earlier, strict=False):
        common = {n: last.fit.values[n] for n in candidate.fit.moved if n in last.fit.moved}
        apart = any(abs(candidate.fit.moved[n] - last.fit.moved[n]) > APART for n in common)
        if apart and candidate.fit.events is None:
            own = replace(problem, blocks=group.blocks)
            free, fixed = parts_of(start_of(candidate.fit, effect) for effect in candidate.effects)
            colour = colour_of(own, candidate.fit)
            with contextlib.suppress(SimulationError):  # it then stays as it was fitted
                again = fit(own, nominal, candidate.effects, free, colour, fixed=fixed, warm=candidate.fit, share=EXACT, settled=common)
                candidate = replace(candidate, fit=again)
        found.append(candidate)
    return [*found, last]


def _merged(nominal: Rig, candidates: list[Candidate]) -> Rig:
    """One rig from the groups' fits: the arm, judged last, settles the sensors' zeros."""
    values: dict[str, float] = {}
    rig = nominal
    for candidate in candidates:
        values |= {n: v for n, v in candidate.fit.values.items() if n in nominal.parameters}
        for effect in candidate.fit.rig.effects:
            rig = rig.with_effect(effect["id"], effect["parameters"])
    return rig.with_parameters(values)


def _with_std(rig: Rig, candidates: list[Candidate]) -> Rig:
    for candidate in candidates:
        for effect in candidate.fit.rig.effects:
            own = effect["id"] + "."
            std = {n.removeprefix(own): s for n, s in candidate.fit.std.items() if n.startswith(own)}
            rig = rig.with_effect(effect["id"], effect["parameters"], std=std)
    return rig


def _probabilities(groups: list[Group]) -> tuple[dict[str, float], dict[str, float]]:
    """Joint probabilities over all hypotheses, and parameters that left their plausible range."""
    shifted = any(g.instead or any(significant(e) for e in g.nominal.values()) for g in groups)
    quiet = all(g.mismatch is None for g in groups)
    moved = {n: v for g in groups for n, v in g.candidates[0].fit.moved.items()}
    symptoms = {n: v for n, v in moved.items() if abs(v) >= SYMPTOM}
    out: dict[str, float] = {"none": 0.0, "parameters": 0.0, "unlisted": 0.0}
    if quiet:
        if symptoms:
            # everything is explained to its noise, at the price of a parameter that its owner would not have believed
            out["unlisted"] = 0.25
            out["parameters"] = 0.75
        else:
            out["parameters" if shifted else "none"] = 0.96
            out["none" if shifted else "parameters"] = 0.03
            out["unlisted"] = 0.01
        return out, symptoms
    for choice in itertools.product(*(g.probabilities.items() for g in groups)):
        weight = math.prod(p for _, p in choice)
        names = [n for n, _ in choice if n]
        apart = [n for k in names for n in k.split("+")]
        weight *= SHARED ** (len(apart) - len(set(apart)))  # one effect seen in two places, not two
        key = "unlisted" if "unlisted" in names else "+".join(sorted(set(apart))) or ("parameters" if shifted else "none")
        out[key] = out.get(key, 0.0) + weight
    total = sum(out.values())
    out = {k: p / total for k, p in out.items()}
    # a mismatch this significant leaves next to nothing for wrong parameters
    rest = 0.005
    out = {k: p * (1.0 - rest) for k, p in out.items()}
    out["parameters"] += rest
    return out, symptoms


def _located(groups: list[Group], symptoms: dict[str, float]) -> str | None:
    found = [(g.candidates[0].held_out[g.mismatch.name].ratio, g.mismatch.name) for g in groups if g.mismatch]
    if found:
        return max(found)[1]
    if symptoms:
        worst = max(symptoms, key=lambda n: abs(symptoms[n]))
        for group in groups:
            for block in reversed(group.blocks):
                if worst in block.parameters:
                    return block.name
    return None


def _table(problem: Problem, found: dict[str, dict[Key, Any]], floor: dict[Key, Floor]) -> dict[str, dict[str, float]]:
    out = {}
    for block in problem.blocks:
        entry = {}
        noise, weights = [], []
        for prepared in problem.recordings:
            noise.append(floor[block.name, prepared.recording.name].sample ** 2)
            weights.append(max(1, int(found["refit"][block.name, prepared.recording.name].rows.sum())))
        entry["noise"] = math.sqrt(float(np.average(noise, weights=weights)))
        for stage in ("before", "refit", "after"):
            squares = []
            for prepared in problem.recordings:
                r = found[stage][block.name, prepared.recording.name]
                squares.append(float(np.mean(r.value[r.rows] ** 2)) if r.rows.any() else 0.0)
            entry[stage] = math.sqrt(float(np.average(squares, weights=weights)))
        out[block.channel] = entry
    return out


def _gap(table: dict[str, dict[str, float]]) -> float | None:
    """(refit - after)/(refit - noise), pooled over channels in units of their noise."""
    refit = sum(e["refit"] / e["noise"] for e in table.values())
    after = sum(e["after"] / e["noise"] for e in table.values())
    room = refit - len(table)
    return None if room < 0.05 else max(0.0, min(1.0, (refit - after) / room))


def _effects(groups: list[Group], probabilities: dict[str, float], model: Rig | None) -> list[dict[str, Any]]:
    """Effects by their marginal probability, with parameters of the best set that has them."""
    marginal: dict[str, float] = {}
    for key, p in probabilities.items():
        for effect in key.split("+"):
            if effect in CATALOGUE:
                marginal[effect] = marginal.get(effect, 0.0) + p
    chosen = {e["id"] for e in model.effects} if model is not None else set()
    out = []
    for effect, p in sorted(marginal.items(), key=lambda kv: -kv[1]):
        if effect not in chosen and p < 0.05:
            continue
        candidates = [c for g in groups for c in g.candidates if effect in c.effects]
        best = max(candidates, key=lambda c: (effect in chosen and c is _best_of(groups, c), c.gap_closed))
        out.append(
            {
                "id": effect,
                "name": EFFECTS[effect].name,
                "probability": min(1.0, p),
                "inclusion": max((g.inclusion[effect] for g in groups if effect in g.inclusion), default=None),
                "parameters": _effect_parameters(effect, best),
                "events": _events(effect, best),
            }
        )
    return out


def _events(effect: str, candidate: Candidate) -> list[dict[str, Any]]:
    """What happened in each recording, one entry for each event."""
    events = candidate.fit.events
    if events is None or events.effect != effect:
        return []
    found = []
    for recording, values in events.values.items():
        for suffix in ("", "_2", "_3"):
            if "time" + suffix in values:
                own = {name: values[name + suffix] for name in ("torque", "mass_change", "time", "duration") if name + suffix in values}
                found.append({"recording": recording, **own, **({"rise": values["rise"]} if "rise" in values else {})})
    return found


def _best_of(groups: list[Group], candidate: Candidate) -> Candidate | None:
    return next((g.best for g in groups if candidate in g.candidates), None)


_CHOSEN = CHOICES | {"cut_in_pressure", "cut_out_pressure"}
"""Parameters that are tried and chosen, not fitted."""


def _effect_parameters(effect: str, candidate: Candidate) -> dict[str, Any]:
    rig = candidate.fit.rig
    unknown_volume = bool(words.unknown_volumes(rig))
    out: dict[str, Any] = {}
    for parameter in EFFECTS[effect].parameters:
        name = f"{effect}.{parameter.name}"
        if parameter.name in _CHOSEN:
            chosen = next(e["parameters"] for e in rig.effects if e["id"] == effect)[parameter.name]
            out[parameter.name] = {"value": chosen, "std": None, "unit": parameter.unit}
            continue
        if name not in candidate.fit.values:
            continue
        value, std = candidate.fit.values[name], candidate.fit.std[name]
        out[parameter.name] = _entry(value, std, parameter.unit, not unknown_volume and std < max(abs(value), 1e-300), parameter.lower)
    if effect == "leak_muscle" and rig.model["valve"] is None and "" in rig.tables("chamber"):
        gas, chamber = rig.model["gas"], rig.model["chamber"]
        value, std = candidate.fit.values["leak_muscle.conductance"], candidate.fit.std["leak_muscle.conductance"]
        volume = chamber["dead_volume"]
        rt = gas["gas_constant"] * gas["temperature"]
        if value > 0:
            tau = volume / (value * 1.185 * rt * chamber["alpha_out"])
            out["time_constant"] = _entry(tau, tau * std / value, "s", std < value)
            out["conductance_per_volume"] = _entry(value / volume, std / volume, "1/(s Pa)", std < value)
    return out


def _entry(value: float, std: float, unit: str, identifiable: bool, lower: float = 0.0) -> dict[str, Any]:
    return {
        "value": value,
        "std": std,
        "unit": unit,
        "interval": [max(lower, value - 1.96 * std), value + 1.96 * std],
        "identifiable": identifiable,
    }


def _ambiguity(probabilities: dict[str, float]) -> list[list[str]]:
    top = max(probabilities.values())
    if top >= SETTLED:
        return []
    found = [sorted(k.split("+")) for k, p in sorted(probabilities.items(), key=lambda kv: -kv[1]) if p >= 0.05]
    return found if len(found) > 1 else []


def _parameters(nominal: Rig, candidates: list[Candidate]) -> dict[str, dict[str, Any]]:
    out: dict[str, dict[str, Any]] = {}
    for candidate in candidates:
        for name, moved in candidate.fit.moved.items():
            p = nominal.parameter(name)
            std = candidate.fit.std[name]
            out[name] = {
                "nominal": p.value,
                "value": candidate.fit.values[name],
                "std": std,
                "unit": p.unit,
                "moved_sigmas": moved,
                "identifiable": std < 0.7 * p.tol,
            }
    return out


def _block_table(groups: list[Group]) -> dict[str, dict[str, Any]]:
    out: dict[str, dict[str, Any]] = {}
    for group in groups:
        for block in group.blocks:
            found = group.baseline[block.name]
            out[block.name] = {
                "rms": found.rms,
                "noise": found.noise,
                "excess": found.systematic,
                "p_value": found.p_value,
                "channel": block.channel,
            }
    return out


def _traces(fitted: Problem, held: Problem, inner: dict[str, Any], outer: dict[str, Any]) -> list[Trace]:
    traces = []
    stock = [(fitted, inner)] if held is fitted else [(fitted, inner), (held, outer)]
    for problem, found in stock:
        for prepared in problem.recordings:
            for block in problem.blocks:
                stages = {s: found[s][block.name, prepared.recording.name] for s in ("before", "refit", "after")}
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
