"""Probabilities of hypotheses, and of ``unlisted``, from one evidence."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from pamrs.diagnosis.evidence._candidates import FittedHypothesis, significant
from pamrs.diagnosis.fit import Fit, Problem, form_in, moved_value, same_data_in
from pamrs.diagnosis.noise import Excess
from pamrs.diagnosis.prepare import Block
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import (
    UNDECIDED,
    UNLISTED,
    Hypothesis,
    SameData,
    Term,
    effect_of,
    find_parameter,
    usual_values,
)

# tempering, the share of the logarithm of evidence that counts: at least, at most, and as a
# numerator over the variance that is left, since what no model explains depends on itself
# (decision 14)
LEAST_TEMPERING, _MOST_TEMPERING, _NOISE_TEMPERING = 0.01, 0.1, 0.3
# share of what it explains that a right name leaves, as forms of equations err (decision 14)
_FORM_ERROR = 0.1
_FORM_SPREAD = math.log(3.0)  # spread of the logarithm of that share: a factor (decision 14)
# [noise levels of bin means] error beside whatever is explained: these levels err (decision 14)
_LEAST_ERROR = 0.1
_UNLISTED_PRICE = 6.0  # [log odds] price of physics without a name (decision 14)
# odds of a name whose right fit was not found, or has no equation here, to physics without a name:
# of 31 places that no name explained, an effect of the catalogue acted in 20 (decision 14)
_MISSED_ODDS = 2.0
_STRAIN_SHARE = 0.5  # share of the priors' sum of squares that counts (decision 14)
# excess over noise from which a recording tests what an effect leaves (decision 14)
_TELLING_EXCESS = 0.5
_TELLING_SHARE = 0.9  # share of the largest excess from which recordings always are
# share left of hardly a mismatch by what explains it: it has to take 30 % (decision 20)
_EXPLAINED_SHARE = 0.7
# share of a mismatch by which forms that leave as much differ (decision 20)
FORM_SHARE_ALIKE = 0.01
# log odds: an effect like another, as a parameter is near zero; 7 to 1 (decision 20)
_STANDING_PRICE = 2.0
_SAME_SHARE = 0.1  # part of an effect's size below which what tells it from another effect is zero
# [standard deviations] standard deviations within which a value is not told from zero
_SAME_STDS = 2.0
# [recordings] lengths of the longest recording beyond which a time constant was not seen
_UNSEEN_LENGTHS = 3.0
# [log odds] price of an effect with such a time constant, or with one that is not told from zero
_UNSEEN_PRICE = 6.5
# factor by which a value is one standard deviation outside its usual range (decision 22)
_RANGE_FACTOR = 3.0
# [log odds] the most that a value outside its usual range costs (decision 22)
_MOST_RANGE_PRICE = 4.0


@dataclass(frozen=True)
class Weighing:
    """Settings and limits by which hypotheses are weighed.

    Attributes
    ----------
    most : float
        Largest probability of all names together.
    seconds : float
        Length of the longest recording that was fitted [s].
    settings : DiagnosisSettings
        Prices.
    """

    most: float
    seconds: float
    settings: DiagnosisSettings


def probability_cap(fitted: Problem, mismatch: Block, rms_left: float, *, alone: bool) -> float:
    """Largest probability that any name can get, which is less where the proof is weak.

    A slow drift of less than two percent of the pressure of a sealed chamber, with no held-out
    recording, may as well be the bench's own loss, creep of a wall or the transducer's drift.
    ``alone`` says that the chamber is sealed and nothing is held out, ``rms_left`` what the refit
    leaves of the channel.
    """
    settings = fitted.settings
    if not alone or mismatch.channel != "muscle_pressure":
        return settings.most_probability
    typical = np.mean([np.mean(np.abs(p.signals["muscle_pressure"][0])) for p in fitted.recordings])
    drifts = rms_left < settings.drift_share * float(typical)
    return settings.drift_probability if drifts else settings.most_probability


def weigh(
    candidates: list[FittedHypothesis], suspects: list[Block], weighing: Weighing
) -> dict[Hypothesis, float]:
    """Probabilities of the hypotheses and of ``unlisted`` (docs/decisions/0014).

    One evidence for all: how probable each hypothesis makes the recordings, tempered, times its
    odds before any data. Recordings that are held out were not fitted, and count as the others do.
    The baseline as it is competes (`UNDECIDED`: nothing is missing, or parameters inside their
    tolerances are off), and so does `UNLISTED`: physics without a name leaves as large a share of
    the mismatch as a right name does. The right name may have been fitted badly, or in a form that
    the catalogue lacks: then it leaves as much, and names share that chance by their weights, each
    as far as it takes the mismatch with values that its physics has. That a set was missed is less
    probable than that a single name was, by the price of its further names. A set with an effect
    whose size is not distinguished from zero names nothing.

    Parameters
    ----------
    candidates : list of FittedHypothesis
        The baseline first, then every hypothesis.
    suspects : list of Block
        Blocks by which they are compared.
    weighing : Weighing
        Prices, and the largest probability of all names together.
    """
    start = candidates[0]
    walls = weighing.settings.most_tolerances
    named = [c for c in candidates if c.terms and not is_absent(c, walls)]
    tempering = _tempering([start, *named], suspects)
    scores = {c.hypothesis: log_weight(c, start, suspects, weighing, tempering) for c in named}
    scores[UNDECIDED] = log_weight(start, start, suspects, weighing, tempering)
    scores[UNLISTED] = _log_weight_unlisted(start, suspects, tempering)
    top = max(scores.values())
    weights = {h: math.exp(max(-60.0, score - top)) for h, score in scores.items()}
    rare = {c.hypothesis: _rarity(c, weighing) for c in named}
    usual = {h: scores[h] + rare[h] for h in rare}
    best = max(usual.values(), default=0.0)
    alike = {h: math.exp(max(-60.0, score - best)) for h, score in usual.items()}
    missed = _MISSED_ODDS * weights[UNLISTED] / max(sum(alike.values()), 1.0)
    for candidate in named:
        key = candidate.hypothesis
        lost = rare[key] + weighing.settings.further_price * (len(candidate.terms) - 1)
        taken = _share_taken(candidate, start, suspects)
        weights[key] += missed * alike[key] * taken * math.exp(-lost)
    total = sum(weights.values())
    out = {h: weight / total for h, weight in weights.items()}
    for hypothesis in [h for h in out if h.terms]:
        # what no name may have falls to physics without a name
        out[UNLISTED] += (1.0 - weighing.most) * out[hypothesis]
        out[hypothesis] *= weighing.most
    return out


def _share_taken(
    candidate: FittedHypothesis, baseline: FittedHypothesis, suspects: list[Block]
) -> float:
    """Share of the power of the baseline's error that a hypothesis removes, 0 to 1."""
    before, after = (
        sum(hypothesis.likelihood()[b.name].size ** 2 for b in suspects)
        for hypothesis in (baseline, candidate)
    )
    return min(1.0, max(0.0, 1.0 - after / before)) if before > 0.0 else 0.0


def _tempering(candidates: list[FittedHypothesis], suspects: list[Block]) -> float:
    """Share of the log evidence that counts (a power posterior): larger, the nearer the best
    hypothesis is to noise. Noise is independent from bin to bin; what no hypothesis explains is
    not.
    """
    powers = [[c.likelihood()[block.name].power for block in suspects] for c in candidates]
    least_power = min(max(powers_of, default=1.0) for powers_of in powers)
    return min(_MOST_TEMPERING, max(LEAST_TEMPERING, _NOISE_TEMPERING / max(least_power, 1e-9)))


def log_weight(
    candidate: FittedHypothesis,
    baseline: FittedHypothesis,
    suspects: list[Block],
    weighing: Weighing,
    tempering: float,
) -> float:
    """Logarithm of a hypothesis's weight, up to a constant: the share `tempering` of its evidence
    in some blocks, less its price, its moved parameters and its rare values.
    """
    evidence = _evidence(candidate, baseline, suspects, tempering) - _strain(candidate)
    return evidence - prior_loss(candidate, weighing)


def prior_loss(candidate: FittedHypothesis, weighing: Weighing) -> float:
    """Loss of a hypothesis before any data: its price, and values that its physics hardly has."""
    return price(candidate, weighing.settings) + _rarity(candidate, weighing)


def _rarity(candidate: FittedHypothesis, weighing: Weighing) -> float:
    """Log odds that a hypothesis loses by values that its physics hardly has."""
    lost = loss_by_values(candidate)
    lost += _STANDING_PRICE * _lacks_drift(candidate, weighing.seconds)
    return lost + _UNSEEN_PRICE * _has_unseen_time(candidate, weighing.seconds)


def _strain(candidate: FittedHypothesis) -> float:
    """Log odds that a hypothesis loses by moved parameters and by how warm gases began."""
    return 0.5 * _STRAIN_SHARE * (candidate.fit.strain + candidate.fit.start_strain)


def _evidence(
    candidate: FittedHypothesis, baseline: FittedHypothesis, suspects: list[Block], tempering: float
) -> float:
    """Tempered log evidence of a hypothesis in some blocks, at the best size of the leftover error;
    an error above a tenth of what the hypothesis explains costs more, the larger it is.
    """
    total = 0.0
    for name in (block.name for block in suspects):
        now, before = candidate.likelihood()[name], baseline.likelihood()[name]
        taken = max(0.0, before.size**2 - now.size**2)
        expected = _LEAST_ERROR + _FORM_ERROR * math.sqrt(taken)
        beyond = np.log(np.maximum(now.sizes, expected) / expected) / _FORM_SPREAD
        # windows that are too short for a hypothesis leave it fewer bins
        tempered = tempering * before.count / max(1, now.count) * now.by_size
        total += float((tempered - 0.5 * beyond**2).max())
    return total


def _log_weight_unlisted(
    baseline: FittedHypothesis, suspects: list[Block], tempering: float
) -> float:
    """Log weight of physics without a name, as if a right name explained all."""
    total = 0.0
    for likelihood in (baseline.likelihood()[block.name] for block in suspects):
        error = _LEAST_ERROR + _FORM_ERROR * likelihood.size
        total += max(likelihood.most, likelihood.expected(error))
    return tempering * total - _UNLISTED_PRICE - _strain(baseline)


def possible_gain(candidate: FittedHypothesis, suspects: list[Block]) -> float:
    """Largest rise of a candidate's log weight in a search (of the least tempering) by an addition
    that leaves nothing but noise.
    """
    likelihoods = [candidate.likelihood()[block.name] for block in suspects]
    return LEAST_TEMPERING * sum(
        max(0.0, likelihood.expected(0.0) - likelihood.most) for likelihood in likelihoods
    )


def share_left(
    candidate: FittedHypothesis, baseline: FittedHypothesis, suspects: list[Block]
) -> float:
    """Share of the baseline's excess variance that a set of effects leaves in held-out recordings.

    Held-out recordings that hardly show the mismatch cannot say how much of it is left: the fitted
    ones then do, and what an effect adds to the held-out ones, beyond what noise may, counts as
    well. Events were found in held-out recordings as in the others: the larger share of the two
    counts.
    """
    (was, now), (before, after) = _excesses(candidate, baseline, suspects)
    if candidate.fit.events is not None and min(was, before) > _TELLING_EXCESS:
        return max(now / was, after / before)
    if before > min(_TELLING_EXCESS, _TELLING_SHARE * max(was, before)):
        return after / before
    shares = [now / was] if was > 0.0 else []
    if after > _TELLING_EXCESS:
        shares.append((after - _TELLING_EXCESS) / max(was, _TELLING_EXCESS))
    return max(shares, default=1.0)


def _excesses(
    candidate: FittedHypothesis, baseline: FittedHypothesis, suspects: list[Block]
) -> list[tuple[float, float]]:
    """Excess variance that the baseline and a set leave, on fitted and on held-out recordings."""

    def over(excess_by_block: dict[str, Excess]) -> float:
        return sum(max(0.0, excess_by_block[b.name].ratio - 1.0) for b in suspects)

    return [
        (over(baseline.fit_excess), over(candidate.fit_excess)),
        (over(baseline.held_out_excess), over(candidate.held_out_excess)),
    ]


def explains(
    candidate: FittedHypothesis, baseline: FittedHypothesis, suspects: list[Block]
) -> bool:
    """True where a candidate leaves only noise, fitted and held out, of what was clearly more."""
    quiet = not any(
        significant(e[b.name])
        for b in suspects
        for e in (candidate.fit_excess, candidate.held_out_excess)
    )
    before, after = max(_excesses(candidate, baseline, suspects))
    return quiet and after < _EXPLAINED_SHARE * before


def is_absent(candidate: FittedHypothesis, walls: float) -> bool:
    """True where a wrong value may be inside its tolerances (`walls` of them), or all sizes of an
    effect together may be zero, within two standard deviations. A fit that goes on with such an
    effect may end lower without the effect's doing.

    Two sizes that do nearly the same may each be as uncertain as it is large, and their sum known
    well. The shape is taken as it was fitted: that of what is not there is anything.
    """
    fitted = candidate.fit
    if may_be_inside(candidate, walls, _SAME_STDS):
        return True
    if fitted.events is not None:
        return False
    names = list(fitted.values)
    for effect in candidate.effects:
        names_of = [name for name in names if effect_of(name) == effect]
        sizes = np.isin(names_of, fitted_sizes(fitted, effect))
        if not sizes.any():
            continue
        at = [names.index(name) for name in names_of]
        values = np.array([fitted.values[n] / fitted.scales[n] for n in names_of])[sizes]
        spread = fitted.covariance[np.ix_(at, at)]
        certain = np.any((values != 0.0) & (np.diag(spread)[sizes] == 0.0))
        distance = values @ np.linalg.pinv(spread, hermitian=True)[np.ix_(sizes, sizes)] @ values
        if not certain and is_near_none(distance, values.size, _SAME_STDS):
            return True
    return False


def fitted_sizes(fitted: Fit, effect: Term) -> list[str]:
    """Fitted parameters of an effect that are zero where it is absent."""
    sealed = fitted.rig.model["valve"] is None
    form = effect.info.form(form_in(fitted.rig, effect))
    sizes = (p for p in form.parameters if p.role_in(sealed=sealed) == "size" and p.neutral == 0.0)
    return [name for p in sizes if (name := f"{effect}.{p.name}") in fitted.values]


def is_near_none(distance: float, count: int, stds: float) -> bool:
    """True where `count` sizes, at a squared distance from zero, are at least as likely to be zero
    as one size at `stds` standard deviations.
    """
    return bool(chi2.sf(distance, count) >= chi2.sf(stds**2, 1))


def may_be_inside(candidate: FittedHypothesis, walls: float, stds: float) -> bool:
    """True where a value called wrong is inside its tolerances or less than `stds` outside."""
    return any(value_may_be_inside(candidate.fit, name, walls, stds) for name in candidate.wrong)


def value_may_be_inside(fitted: Fit, name: str, walls: float, stds: float) -> bool:
    """True where a fitted value is inside its tolerances (`walls` of them), or less than `stds`
    standard deviations outside.
    """
    wall = moved_value(fitted.known[name], math.copysign(walls, fitted.moved[name]))
    beyond = math.copysign(1.0, fitted.moved[name]) * (fitted.values[name] - wall)
    return beyond < stds * fitted.std.get(name, 0.0)


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
    at_rest = abs(telling) < max(_SAME_SHARE * abs(parameters[same.size]), _SAME_STDS * spread)
    return bool(
        parameters[same.size] > 0.0
        and at_rest
        and all(parameters[name] == value for name, value in same.held)
    )


def _has_unseen_time(candidate: FittedHypothesis, seconds: float) -> bool:
    """True where a time constant is much longer than the recordings, or may be zero."""
    std = candidate.fit.std
    return any(
        value > _UNSEEN_LENGTHS * seconds or value < _SAME_STDS * std.get(name, 0.0)
        for name, value in candidate.fit.effect_values.items()
        if find_parameter(name).time_constant
    )


def _lacks_drift(candidate: FittedHypothesis, seconds: float) -> bool:
    """True where a clock drifts by less than its offset: that is a lag or a dead time."""

    def at_rest(effect: Term, same: SameData) -> bool:
        size, telling = (
            candidate.fit.values.get(f"{effect}.{name}", 0.0) for name in (same.size, same.without)
        )
        return abs(telling) * seconds < abs(size)

    return any(at_rest(e, same) for e in candidate.effects for same in e.info.same_data)


def loss_by_values(candidate: FittedHypothesis) -> float:
    """Log odds that a set loses by values that its physics hardly has.

    A parameter with a prior loses by its distance from it, as by a Cauchy distribution: a value of
    ten deviations is rare, but it does not rule out what explains a mismatch to its noise. Other
    parameters lose by how many times they are outside the range of usual values, for certain.
    """
    return sum(_loss_by_value(candidate, name) for name in candidate.fit.effect_values)


def _loss_by_value(candidate: FittedHypothesis, name: str) -> float:
    """Log odds that a set loses by the value of one parameter."""
    lost, value = 0.0, candidate.fit.values[name]
    effect = effect_of(name)
    usual = usual_values(name, {effect: form_in(candidate.fit.rig, effect)} if effect else None)
    if usual is not None:
        lost += math.log1p(((value - usual[0]) / usual[1]) ** 2)
    expected = find_parameter(name).expected
    if expected is not None:
        (low, high), wide = expected, 2.0 * candidate.fit.std.get(name, 0.0)
        # what is large and hardly determined may be a part of its value, not nothing
        least = value * math.exp(-wide / value) if value > 0.0 else 0.0
        times = max(low / max(value + wide, 1e-300), least / high, 1.0)
        outside = math.log(times) / math.log(_RANGE_FACTOR)
        lost += min(0.5 * outside**2, _MOST_RANGE_PRICE)
    return lost


def price(candidate: FittedHypothesis, settings: DiagnosisSettings) -> float:
    """Log odds paid for names, parameters, events, possible places, and wrong values."""
    total = sum(_own_price(candidate, term, settings) for term in candidate.terms)
    total += settings.further_price * len(candidate.terms) + candidate.places
    events = candidate.fit.events
    happened = 0 if events is None else sum(len(v) for v in events.values.values())
    return total + settings.parameter_price * happened


def _own_price(candidate: FittedHypothesis, term: Term, settings: DiagnosisSettings) -> float:
    """Log odds paid for an effect's parameters, or for how far a value of the file is wrong."""
    if term.id in candidate.wrong:
        return settings.wrong_price + candidate.beyond_walls_by(term.id, settings.most_tolerances)
    parameters = (n for n in candidate.fit.effect_values if effect_of(n) == term)
    return settings.parameter_price * sum(not find_parameter(n).repeats for n in parameters)


def price_of_term(candidate: FittedHypothesis, term: Term, settings: DiagnosisSettings) -> float:
    """Log odds that a set loses by one term before any data: price, values and place."""
    paid = _own_price(candidate, term, settings)
    if term.id in candidate.wrong:
        return paid
    rare = sum(
        _loss_by_value(candidate, n) for n in candidate.fit.effect_values if effect_of(n) == term
    )
    return paid + rare + candidate.places / max(1, len(candidate.effects))
