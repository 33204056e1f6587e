"""Sizes and wrong values that recordings determine, and those that they do not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from pamrs.diagnosis.evidence._candidates import BlockGroup, FittedHypothesis
from pamrs.diagnosis.fit import Fit, Problem, form_in, moved_value, same_data_in, spread_over_pieces
from pamrs.effects import Term, effect_of

_SAME_SHARE = 0.1  # part of an effect's size below which what tells it from another effect is zero
# standard deviations within which a value, or a difference, is not told from zero
SAME_STDS = 2.0


def is_absent(candidate: FittedHypothesis, walls: float) -> bool:
    """True where a wrong value may be right (`walls` of its tolerances), or all sizes of an
    effect together may be zero, within two standard deviations. A fit that goes on with such an
    effect may end lower without the effect's doing.
    """
    fitted = candidate.fit
    if may_be_right(candidate, walls, SAME_STDS):
        return True
    if fitted.events is not None:
        return False
    return any(_may_be_none(fitted, effect) for effect in candidate.effects)


def has_undetermined_effect(candidate: FittedHypothesis) -> bool:
    """True where zero is in the stated interval of all fitted sizes of an effect together. Whatever
    happened at times of its own in single recordings is determined by when it happened.
    """
    fitted = candidate.fit
    happened = None if fitted.events is None else fitted.events.effect
    return any(_may_be_none(fitted, effect) for effect in candidate.effects if effect != happened)


def _may_be_none(fitted: Fit, effect: Term) -> bool:
    """True where all sizes of an effect together may be zero, by the covariance of its fit, as wide
    as its standard deviations are now.

    Two sizes that do nearly the same may each be as uncertain as it is large, and their sum known
    well. The shape is taken as it was fitted: that of what is not there is anything, and the size
    of a stop that is there is as uncertain as its exponent.
    """
    names, sizes = list(fitted.values), fitted_sizes(fitted, effect)
    unknown = {name for name, std in fitted.std.items() if not math.isfinite(std)}
    if not unknown.isdisjoint(sizes):
        return unknown.issuperset(sizes)
    own = [name for name in names if effect_of(name) == effect and name not in unknown]
    at, is_size = [names.index(name) for name in own], np.isin(own, sizes)
    spread = fitted.covariance[np.ix_(at, at)]
    narrow = np.sqrt(np.diag(spread))
    if not (narrow[is_size] > 0.0).any():
        return False  # nothing to be zero, or certain
    values, std = ([of[n] / fitted.scales[n] for n in own] for of in (fitted.values, fitted.std))
    wider = np.divide(std, narrow, out=np.ones_like(narrow), where=narrow > 0.0)
    known = np.linalg.pinv(spread * np.outer(wider, wider), hermitian=True)
    size = np.array(values)[is_size]
    distance = size @ known[np.ix_(is_size, is_size)] @ size
    # as likely to be zero as one size at so many standard deviations
    return bool(chi2.sf(distance, len(sizes)) >= chi2.sf(SAME_STDS**2, 1))


def fitted_sizes(fitted: Fit, effect: Term) -> list[str]:
    """Fitted parameters of an effect that are zero where it is absent."""
    sealed = fitted.rig.model["valve"] is None
    form = effect.info.form(form_in(fitted.rig, effect))
    sizes = (p for p in form.parameters if p.role_in(sealed=sealed) == "size" and p.neutral == 0.0)
    return [name for p in sizes if (name := f"{effect}.{p.name}") in fitted.values]


def may_be_right(candidate: FittedHypothesis, walls: float, stds: float = 1.0) -> bool:
    """True where a value called wrong may be right, as :func:`value_may_be_right` has it."""
    return any(value_may_be_right(candidate.fit, name, walls, stds) for name in candidate.wrong)


def value_may_be_right(fitted: Fit, name: str, walls: float, stds: float = 1.0) -> bool:
    """True where a fitted value is inside its tolerances (`walls` of them) or less than `stds`
    standard deviations outside, or where its interval of 95 % holds the value of the file.
    """
    std = fitted.std.get(name, 0.0)
    if abs(fitted.values[name] - fitted.known[name].value) < SAME_STDS * std:
        return True
    wall = moved_value(fitted.known[name], math.copysign(walls, fitted.moved[name]))
    beyond = math.copysign(1.0, fitted.moved[name]) * (fitted.values[name] - wall)
    return beyond < stds * std


def with_stated_std(
    problem: Problem, group: BlockGroup, candidate: FittedHypothesis
) -> FittedHypothesis:
    """Candidate with the standard deviations that are reported: by how much pieces of the
    recordings disagree, times ``spread_factor`` for parameters that no prior holds.
    """
    part, factor = replace(problem, blocks=group.blocks), problem.settings.spread_factor
    known = candidate.fit.held_by_prior
    std = {
        name: spread * (1.0 if name in known else factor)
        for name, spread in spread_over_pieces(part, candidate.fit).items()
    }
    return replace(candidate, fit=replace(candidate.fit, std=std))


def same_recordings(candidate: FittedHypothesis, effect: Term, seconds: float) -> bool:
    """True where an effect as fitted leaves the recordings that another effect would leave."""
    same = same_data_in(candidate.fit.rig, effect)
    if same is None:
        return False
    parameters: dict[str, float] = next(
        (e["parameters"] for e in candidate.fit.rig.effects if Term.of(e) == effect), {}
    )
    if not parameters:
        return False
    telling, spread = (
        parameters[same.without] * seconds,
        candidate.fit.std.get(f"{effect}.{same.without}", 0.0) * seconds,
    )
    at_rest = abs(telling) < max(_SAME_SHARE * abs(parameters[same.size]), SAME_STDS * spread)
    return bool(
        parameters[same.size] > 0.0
        and at_rest
        and all(parameters[name] == value for name, value in same.held)
    )
