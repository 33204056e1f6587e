"""Probabilities of sets of effects, and of ``unlisted``, from what each leaves of the mismatch."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import chi2

from pamrs.channels import channel_of
from pamrs.diagnosis.evidence._candidates import Candidate, significant
from pamrs.diagnosis.evidence._predictive import bootstrapped
from pamrs.diagnosis.fit import Problem, form_in, same_data_in, says_same
from pamrs.diagnosis.noise import Excess
from pamrs.diagnosis.prepare import Block
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import (
    EFFECTS,
    UNLISTED,
    Hypothesis,
    SameData,
    Term,
    effect_of,
    find_parameter,
    usual_values,
)

# log odds of explained variance, as probable as unlisted: a name carries half (decision 14)
_LOG_ODDS_EXPLAINED = 0.0
# the same of what takes up much of anything, 7 % left: events, parameters (decision 14)
_LOG_ODDS_EXPLAINED_PLIABLE = 2.6
_SOFTNESS = 0.4  # [log odds] width of that transition (decision 14)
# [log odds] odds to unlisted that a set has at the least where it leaves only noise
_LOG_ODDS_NOISE_LEFT = 3.0
# share left of hardly a mismatch by what explains it: it has to take 30 % (decision 20)
_CLEAR_SHARE = 0.7
# independent looks that a block's residual counts for (decision 14: tuned on seed 501)
_LOOKS = 12.0
# looks at what is left whatever a form is granted: the smaller wins (decision 14)
_LOOKS_WITHIN = 1.0
# share of names' odds by predictive density, the rest by what is left (decision 14)
_PREDICTIVE_SHARE = 0.5
# excess over noise from which a recording tests what an effect leaves (decision 14)
_TELLING_EXCESS = 0.5
_TELLING_SHARE = 0.9  # share of the largest excess from which recordings always are
FORM_SHARE_ALIKE = 0.01  # form_share where sets of as many effects are compared (decision 20)
_NOISE_ERROR = 0.06  # standard deviation of a noise level (decision 22)
# [log odds] the most that what is left in one block, or the priors, count (decisions 22, 25)
_DECIDED = 8.0
# log odds: an effect like another, as a parameter is near zero; 7 to 1 (decision 20)
STANDING_PRICE = 2.0
_SAME_SHARE = 0.1  # part of an effect's size below which what tells it from another effect is zero
# [standard deviations] standard deviations within which a value is not told from zero
_SAME_STDS = 2.0
# [recordings] lengths of the longest recording beyond which a time constant was not seen
_UNSEEN_LENGTHS = 3.0
# [log odds] price of an effect with such a time constant, or with one that is not told from zero
_UNSEEN_PRICE = 6.5
# relative scatter of an effect's size between recordings beyond which it is not that effect
_SCATTER = 0.35
_SCATTER_WIDTH = 0.1  # further scatter that costs one unit of log odds
# factor by which a value is one standard deviation outside its usual range (decision 22)
_RANGE_FACTOR = 3.0
# [log odds] the most that a value outside its usual range costs (decision 22)
_MOST_RANGE_PRICE = 4.0
# share of the range that was visited over which a contact may act (decision 22)
_CONTACT_SHARE = 0.5
_CONTACT_WIDTH = 0.15  # share beyond that which costs a standard deviation (decision 22)


VisitedRanges = dict[str, tuple[float, float]]
"""What was visited, by kind of channel [SI]."""


@dataclass(frozen=True)
class Weighing:
    """What hypotheses are weighed by.

    Attributes
    ----------
    most : float
        Largest probability of a name.
    seconds : float
        Length of the longest recording that was fitted [s].
    settings : DiagnosisSettings
        Prices, and what is allowed to the forms of equations.
    ranges : dict, optional
        What was visited in these recordings, by kind of channel [SI].
    """

    most: float
    seconds: float
    settings: DiagnosisSettings
    ranges: VisitedRanges = field(default_factory=dict)


def visited_ranges(problem: Problem) -> VisitedRanges:
    """Range of each kind of channel that is the output of one block alone: the angle of a rig's
    only joint.
    """
    channels: dict[str, list[str]] = {}
    for block in problem.blocks:
        channels.setdefault(channel_of(block.channel), []).append(block.channel)
    found = {}
    for kind, names in channels.items():
        if len(names) == 1:
            values = [p.signals[names[0]][0] for p in problem.recordings]
            found[kind] = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
    return found


def probability_cap(fitted: Problem, mismatch: Block, left: float, *, alone: bool) -> float:
    """Largest probability that any name can get, which is less where the proof is weak.

    A slow drift of less than two percent of the pressure of a sealed chamber, with no held-out
    recording, may as well be the bench's own loss, creep of a wall or the transducer's drift.
    ``alone`` says that the chamber is sealed and nothing is held out, ``left`` what the refit
    leaves of the channel.
    """
    settings = fitted.settings
    if not alone or mismatch.channel != "muscle_pressure":
        return settings.most_probability
    typical = np.mean([np.mean(np.abs(p.signals["muscle_pressure"][0])) for p in fitted.recordings])
    drifts = left < settings.drift_share * float(typical)
    return settings.drift_probability if drifts else settings.most_probability


def share_left(candidate: Candidate, baseline: Candidate, suspects: list[Block]) -> float:
    """Share of the baseline's excess variance that a set of effects leaves in recordings that it
    was not fitted to.

    Held-out recordings that hardly show the mismatch cannot say how much of it is left: those that
    were fitted then do, and what an effect brings into the others, beyond what noise may, counts
    beside it. What happens at times of its own was found in held-out recordings as in the others:
    the larger share of the two counts.
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
    candidate: Candidate, baseline: Candidate, suspects: list[Block]
) -> list[tuple[float, float]]:
    """Excess variance that the baseline and a set leave, on fitted and on held-out recordings."""

    def over(found: dict[str, Excess]) -> float:
        return sum(max(0.0, found[b.name].ratio - 1.0) for b in suspects)

    return [
        (over(baseline.fitted), over(candidate.fitted)),
        (over(baseline.held_out), over(candidate.held_out)),
    ]


def explains(candidate: Candidate, baseline: Candidate, suspects: list[Block]) -> bool:
    """Whether only noise is left, fitted and held out, where there was clearly more."""
    quiet = not any(
        significant(e[b.name]) for b in suspects for e in (candidate.fitted, candidate.held_out)
    )
    before, after = max(_excesses(candidate, baseline, suspects))
    return quiet and after < _CLEAR_SHARE * before


def weigh(
    candidates: list[Candidate],
    suspects: list[Block],
    weighing: Weighing,
    own: Mapping[Candidate, list[Block]] | None = None,
) -> dict[Hypothesis, float]:
    """Probabilities over sets of effects and ``unlisted``.

    The mean of two kinds of evidence (docs/decisions/0014): by what each set leaves, and by how
    probable it makes the recordings, stretch by stretch of time; both pay the same prices.

    Between sets, by what they leave: the logarithm of what each leaves of the mismatch, fitted and
    held out, on a nominal number of independent looks (and one more of what is left, whatever is
    granted); what the form of an equation may leave (``form_share`` of the settings) is granted to
    all of them, so that no second effect is asked for to mend the form of the first; among sets of
    as many effects less is granted (``form_share_alike``). What is left of a mismatch near the
    noise counts by what noise could leave of it. Each parameter and each further effect has its
    price, and so have a clock that does not drift and values that an effect hardly has
    (:func:`loss_by_values`). Against ``unlisted``: the share of the mismatch that the set explains
    in recordings that it was not fitted to (a name has to carry half of it; the rest may be what no
    model has, and stands beside the name), its values (a set with an effect whose size is not told
    from none names nothing), and whether its size is the same in all recordings; improbable sets
    themselves say nothing against one that is. What a set is not trusted with falls to the part of
    it that is trusted most, as far as that leads by itself: an event that may be anything takes
    nothing from the effect beside it. What a wrong value leaves is no form's error, since the
    equation stays the same: where a value explains more than the effects of a set do, they are
    judged by what it leaves (docs/decisions/0025). The constants are those under which the stated
    probabilities came true in a trial with other seeds than the published one
    (docs/decisions/0014).

    ``own`` are the blocks in which each set is judged against ``unlisted``, where these are not
    all the suspects.
    """
    named = [c for c in candidates if c.terms and not _is_absent(c)]
    if not named:
        return {UNLISTED: 1.0}
    start = candidates[0]
    seconds, settings = weighing.seconds, weighing.settings
    odd = {c: loss_by_values(c, weighing.ranges) for c in named}
    against = {c: _loss_against_others(c, seconds, odd[c]) for c in named}

    plain = _plain_scores(named, start, suspects, against, settings)
    value = _leading_value(plain)
    trusted = {
        c: min(
            _trust(one, other, suspects if own is None else own[c], weighing, odd[c])
            for one, other in _explained_by(c, start, plain)
        )
        for c in named
    }

    def weights_of(granted: float) -> dict[Candidate, float]:
        scores = _scores(plain, value, start, suspects, granted, against, settings)
        top = max(scores.values())
        return {c: trusted[c] * math.exp(max(-60.0, s - top)) for c, s in scores.items()}

    coarse, fine = weights_of(settings.form_share), weights_of(FORM_SHARE_ALIKE)
    weights: dict[Candidate, float] = {}
    for count in {len(c.terms) for c in named}:
        alike = [c for c in named if len(c.terms) == count]
        share = sum(coarse[c] for c in alike) / sum(fine[c] for c in alike)
        weights |= {c: share * fine[c] for c in alike}
    weights = _share_between_places(weights, suspects)
    out = _share_by_trust(weights, trusted)
    lost = _lost_by_priors(plain)
    prior = {c: -(_prior_loss(c, settings) + against[c] + lost[c] + _of_events(c)) for c in named}
    predicted = _by_prediction(prior, suspects)
    if predicted is not None:
        by_prediction, share = _share_by_trust(predicted, trusted), _PREDICTIVE_SHARE
        out = {key: (1.0 - share) * p + share * by_prediction[key] for key, p in out.items()}
    _share_between_same_data(out, named, start, suspects, seconds)
    out[UNLISTED] = max(0.0, 1.0 - sum(out.values()))
    return out


def _by_prediction(
    prior: Mapping[Candidate, float], suspects: list[Block]
) -> dict[Candidate, float] | None:
    """Weights of sets by how probable each makes every stretch of the recordings; None where that
    is not known of all of them. ``prior`` is the logarithm of what each weighs before.
    """
    densities = [c.densities() for c in prior]
    if not all(b.name in d for b in suspects for d in densities):
        return None
    rows = [np.concatenate([d[b.name] for b in suspects]) for d in densities]
    if len({row.size for row in rows}) > 1:
        return None  # not the same stretches
    scores = np.array(rows)
    if scores.size == 0 or not np.isfinite(scores).all():
        return None
    shares = bootstrapped(scores, np.array(list(prior.values())))
    return dict(zip(prior, shares.tolist(), strict=True))


def _of_events(candidate: Candidate) -> float:
    """What a set loses in prediction by events: their times and sizes were fitted in the recordings
    that are predicted, a nat for each (as Akaike's criterion counts them).
    """
    events = candidate.fit.events
    return 0.0 if events is None else float(sum(len(v) for v in events.values.values()))


def _plain_scores(
    named: list[Candidate],
    start: Candidate,
    suspects: list[Block],
    against: Mapping[Candidate, float],
    settings: DiagnosisSettings,
) -> dict[Candidate, float]:
    """Logarithms of weights, the same being granted to all."""
    scores = {c: _score(c, start, suspects, FORM_SHARE_ALIKE, settings) - against[c] for c in named}
    return _with_prior_losses(scores)


def _leading_value(plain: Mapping[Candidate, float]) -> Candidate | None:
    """The most probable wrong value, or values, alone."""
    return max((c for c in plain if not c.effects), key=lambda c: plain[c], default=None)


def _led_by_value(c: Candidate, plain: Mapping[Candidate, float], value: Candidate | None) -> bool:
    """Whether a set with wrong values explains most by the value: none of its effects, alone or
    together, weighs more than the most probable value does.
    """
    if value is None or not c.wrong:
        return False
    parts = [p for p in plain if p.effects and not p.wrong and set(p.effects) <= set(c.effects)]
    return all(plain[p] <= plain[value] for p in parts)


def _explained_by(
    c: Candidate, start: Candidate, plain: Mapping[Candidate, float]
) -> list[tuple[Candidate, Candidate]]:
    """What has to carry half of a mismatch, beside what leaves that mismatch: a set beside the
    baseline; and the effects of a set beside its wrong values, as far as these were fitted alone.
    """
    found = [(c, start)]
    if c.effects and c.wrong:
        values = [p for p in plain if not p.effects and set(p.wrong) <= set(c.wrong)]
        if values:
            most = max(values, key=lambda p: (len(p.wrong), plain[p]))
            found.append((replace(c, wrong=()), most))
    return found


def _scores(
    plain: Mapping[Candidate, float],
    value: Candidate | None,
    start: Candidate,
    suspects: list[Block],
    granted: float,
    against: Mapping[Candidate, float],
    settings: DiagnosisSettings,
) -> dict[Candidate, float]:
    """Logarithms of weights where a share of the mismatch is granted to the forms of equations; of
    sets that a wrong value leads, of what the most probable value leaves.
    """

    def score(c: Candidate) -> float:
        if value is not None and _led_by_value(c, plain, value):
            return _score_with_value(c, value, start, suspects, granted, settings)
        return _score(c, start, suspects, granted, settings)

    return _with_prior_losses({c: score(c) - against[c] for c in plain})


def _share_by_trust(
    weights: Mapping[Candidate, float], trusted: Mapping[Candidate, float]
) -> dict[Hypothesis, float]:
    """Probabilities of sets: the weight of each times the trust in it. What a set is not trusted
    with goes to its best part: by the trust in that part, times its share among sets of its size.
    """
    total, out = sum(weights.values()), dict.fromkeys((c.hypothesis for c in weights), 0.0)
    by_size: dict[int, float] = {}
    for c, weight in weights.items():
        by_size[len(c.terms)] = by_size.get(len(c.terms), 0.0) + weight

    def alone(part: Candidate) -> float:
        whole = by_size[len(part.terms)]
        return trusted[part] * weights[part] / whole if whole > 0.0 else 0.0

    for c, weight in weights.items():
        share = weight / total
        out[c.hypothesis] += share * trusted[c]
        parts = [p for p in weights if p.hypothesis.set < c.hypothesis.set]
        best = max(parts, key=alone, default=None)
        if best is not None:
            out[best.hypothesis] += share * (1.0 - trusted[c]) * alone(best)
    return out


def _is_absent(candidate: Candidate) -> bool:
    """Whether the sizes of an effect of a set, taken together, are not told from none: a fit that
    goes on beside such an effect may end lower, which is not the effect's doing.

    Two sizes that do nearly the same may each be as uncertain as it is large, and their sum known
    well. The shape is taken as it was fitted: that of what is not there is anything.
    """
    found = candidate.fit
    if found.events is not None:
        return False
    names, sealed = list(found.values), found.rig.model["valve"] is None
    for effect in candidate.effects:
        form = effect.info.form(form_in(found.rig, effect))
        own = [p for p in form.parameters if f"{effect}.{p.name}" in found.values]
        sizes = [p.role_in(sealed=sealed) == "size" and p.neutral == 0.0 for p in own]
        if not any(sizes):
            continue
        at = [names.index(f"{effect}.{p.name}") for p in own]
        values = np.array([found.values[names[k]] / found.scales[names[k]] for k in at])[sizes]
        spread = found.covariance[np.ix_(at, at)]
        certain = np.any((values != 0.0) & (np.diag(spread)[sizes] == 0.0))
        distance = values @ np.linalg.pinv(spread, hermitian=True)[np.ix_(sizes, sizes)] @ values
        # of a single size: whether it is within so many standard deviations of none
        if not certain and chi2.sf(distance, sum(sizes)) >= chi2.sf(_SAME_STDS**2, 1):
            return True
    return False


def _score_with_value(
    candidate: Candidate,
    value: Candidate,
    baseline: Candidate,
    suspects: list[Block],
    share: float,
    settings: DiagnosisSettings,
) -> float:
    """The score of the most probable wrong value, and what a set with wrong values has beyond it;
    ``share`` of what that value leaves is granted to the forms of equations beside it.

    What the value leaves counts once, in its own score: beside itself it gains nothing.
    """
    alone, beside, left = (
        _score(one, other, suspects, share, settings)
        for one, other in ((value, baseline), (candidate, value), (value, value))
    )
    return alone + (beside - left)


def log_weight(
    candidate: Candidate,
    baseline: Candidate,
    suspects: list[Block],
    weighing: Weighing,
    value: Candidate | None = None,
) -> float:
    """Logarithm of what a hypothesis weighs beside others, up to a constant: by what it leaves, by
    its price and by its values.

    ``value`` is the most probable wrong value alone, where none of the effects alone weighs more.
    """
    settings = weighing.settings
    if value is not None and candidate.wrong:
        own = _score_with_value(candidate, value, baseline, suspects, FORM_SHARE_ALIKE, settings)
    else:
        own = _score(candidate, baseline, suspects, FORM_SHARE_ALIKE, settings)
    unlikely = loss_by_values(candidate, weighing.ranges)
    return own - _loss_against_others(candidate, weighing.seconds, unlikely)


def _loss_against_others(candidate: Candidate, seconds: float, unlikely: float) -> float:
    """What a set loses against others by a clock that does not drift, by times that were not seen,
    and by its values (``loss_by_values``).
    """
    standing = STANDING_PRICE * lacks_drift(candidate, seconds)
    return standing + _UNSEEN_PRICE * _has_unseen_time(candidate, seconds) + unlikely


def _share_between_places(
    weights: dict[Candidate, float], blocks: list[Block]
) -> dict[Candidate, float]:
    """Weights of sets of the same effects at other places shared out among them, by what each
    leaves inside the noise as well.

    Their equations are the same, so that no form of one is granted what it leaves; and a noise
    level that was estimated too high makes all of them equal where one predicts better.
    """
    alike: dict[tuple[tuple[str, ...], tuple[str, ...]], list[Candidate]] = {}
    for c in weights:
        if c.places > 0.0:
            alike.setdefault((tuple(sorted(e.id for e in c.effects)), c.wrong), []).append(c)
    found = dict(weights)
    for several in (cs for cs in alike.values() if len(cs) > 1):
        within = {c: _inside_noise(c, blocks) for c in several}
        least = min(within.values())
        own = {c: weights[c] * math.exp(0.25 * _LOOKS * (least - within[c])) for c in within}
        share = sum(weights[c] for c in several) / sum(own.values())
        found |= {c: share * weight for c, weight in own.items()}
    return found


def _inside_noise(candidate: Candidate, blocks: list[Block]) -> float:
    """Logarithm of what a set leaves of blocks in which that is less than the noise."""
    stages = (candidate.fitted, candidate.held_out)
    return sum(math.log(min(max(e[b.name].ratio, 1e-9), 1.0)) for e in stages for b in blocks)


def _share_between_same_data(
    out: dict[Hypothesis, float],
    named: list[Candidate],
    start: Candidate,
    suspects: list[Block],
    seconds: float,
) -> None:
    """Share probabilities out between sets that are the same data, by the odds before any data: a
    late clock and the dead time of a regulator, left out or wrong in the file.
    """
    for one in named:
        for effect in one.effects:
            same = same_data_in(one.fit.rig, effect)
            if same is None or not same_recordings(one, effect, seconds):
                continue
            shared = set(one.terms) - {effect}
            others = (c for c in named if shared <= set(c.terms) and len(c.terms) == len(one.terms))
            other = next(
                (c for c in others if all(says_same(t, same) for t in set(c.terms) - shared)), None
            )
            # what explains more than the other could is something else as well
            if other is None:
                continue
            left, beside = (share_left(c, start, suspects) for c in (one, other))
            if left > beside + FORM_SHARE_ALIKE:
                continue
            first, second, odds = one.hypothesis, other.hypothesis, math.exp(STANDING_PRICE)
            both = out.get(first, 0.0) + out.get(second, 0.0)
            out[first], out[second] = both / (1.0 + odds), both * odds / (1.0 + odds)


def same_recordings(candidate: Candidate, effect: Term, seconds: float) -> bool:
    """Whether an effect of a set leaves the very recordings that another effect of the catalogue
    would leave.
    """
    same = same_data_in(candidate.fit.rig, effect)
    if same is None:
        return False
    own: dict[str, float] = next(
        (e["parameters"] for e in candidate.fit.rig.effects if Term.of(e) == effect), {}
    )
    if not own:
        return False
    telling, spread = (
        own[same.without] * seconds,
        candidate.fit.std.get(f"{effect}.{same.without}", 0.0) * seconds,
    )
    at_rest = abs(telling) < max(_SAME_SHARE * abs(own[same.size]), _SAME_STDS * spread)
    return bool(
        own[same.size] > 0.0 and at_rest and all(own[name] == value for name, value in same.held)
    )


def _with_prior_losses(scores: dict[Candidate, float]) -> dict[Candidate, float]:
    """Scores of effects and of wrong values made comparable, by what their priors lose."""
    lost = _lost_by_priors(scores)
    return {c: score - lost[c] for c, score in scores.items()}


def _lost_by_priors(scores: Mapping[Candidate, float]) -> dict[Candidate, float]:
    """What the priors of the other parameters lose, which counts between effects and wrong values.

    A value that is wrong lets the others go back to where they were expected; sets of effects keep
    their order among each other, since what moves beside them is the form of their equations as
    well.
    """
    if not any(c.wrong for c in scores):
        return dict.fromkeys(scores, 0.0)
    effects = [c for c in scores if not c.wrong]
    shared = prior_strain(max(effects, key=lambda c: scores[c])) if effects else 0.0
    return {c: prior_strain(c) if c.wrong else shared for c in scores}


def prior_strain(candidate: Candidate) -> float:
    """Half of the sum of squares of the priors of a hypothesis, as far as it counts."""
    return min(0.5 * candidate.fit.strain, _DECIDED)


def _trust(
    candidate: Candidate,
    baseline: Candidate,
    suspects: list[Block],
    weighing: Weighing,
    unlikely: float,
) -> float:
    """Probability of a set against ``unlisted``; `unlikely` is what it loses by its values."""
    left = min(max(share_left(candidate, baseline, suspects), 1e-6), 1.0 - 1e-6)
    even = _LOG_ODDS_EXPLAINED_PLIABLE if _fits_anything(candidate) else _LOG_ODDS_EXPLAINED
    odds = (math.log((1.0 - left) / left) - even) / _SOFTNESS
    if explains(candidate, baseline, suspects):
        odds = max(odds, _LOG_ODDS_NOISE_LEFT)
    return capped_probability(odds - unlikely - penalty(candidate, weighing.seconds), weighing.most)


def _fits_anything(candidate: Candidate) -> bool:
    """Whether it takes up a good part of anything: values of the baseline, and what happens
    differently in every recording; a line or a curve over its whole length does not.
    """
    events = candidate.fit.events
    if events is None:
        return bool(candidate.wrong)
    info = events.effect.info
    return bool(candidate.wrong) or not (info.own or info.leading.same_everywhere)


def capped_probability(odds: float, most: float) -> float:
    """Probability of logarithmic odds, at most so much."""
    return most / (1.0 + math.exp(-min(60.0, max(-60.0, odds))))


def penalty(candidate: Candidate, seconds: float) -> float:
    """What a set's values take from the logarithm of its odds: a size that scatters between
    recordings, a time that was not seen.
    """
    scatter = max(0.0, candidate.scatter - _SCATTER) / _SCATTER_WIDTH
    return scatter + _UNSEEN_PRICE * _has_unseen_time(candidate, seconds)


def _has_unseen_time(candidate: Candidate, seconds: float) -> bool:
    """Whether a time constant of a set was not seen: it is much longer than the recordings, or
    not told from zero. What relaxes at once is another stiffness.
    """
    std = candidate.fit.std
    return any(
        value > _UNSEEN_LENGTHS * seconds or value < _SAME_STDS * std.get(name, 0.0)
        for name, value in _effect_values(candidate)
        if find_parameter(name).time_constant
    )


def _effect_values(candidate: Candidate) -> list[tuple[str, float]]:
    """Fitted parameters of its effects, by dotted name."""
    return list(candidate.fit.effect_values.items())


def lacks_drift(candidate: Candidate, seconds: float) -> bool:
    """Whether a clock of a set does not drift: two free clocks drift, and a constant delay is a lag
    or a dead time.
    """

    def at_rest(effect: Term, same: SameData) -> bool:
        size, telling = (
            candidate.fit.values.get(f"{effect}.{name}", 0.0) for name in (same.size, same.without)
        )
        return abs(telling) * seconds < abs(size)

    return any(at_rest(e, same) for e in candidate.effects for same in e.info.same_data)


def loss_by_values(candidate: Candidate, ranges: VisitedRanges) -> float:
    """What a set loses by values that its physics hardly has.

    A parameter with a prior loses by its distance from it, as by a Cauchy distribution: a value of
    ten deviations is rare, but it does not rule out what explains a mismatch to its noise. A
    contact is met near an end of the motion, and what acts over most of the range is none; other
    parameters lose by how many times they are outside the range of usual values, for certain.
    """
    lost = sum(_loss_by_value(candidate, name) for name in candidate.fit.effect_values)
    for effect in (e for e in candidate.fit.rig.effects if Term.of(e) in candidate.effects):
        lost += _contact_price(effect["id"], effect["parameters"], ranges)
    return lost


def _loss_by_value(candidate: Candidate, name: str) -> float:
    """What a set loses by the value of one parameter of an effect."""
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


def _contact_price(effect: str, values: Mapping[str, float], ranges: VisitedRanges) -> float:
    """What an effect loses by a contact that is met in the middle of the motion."""
    lost = 0.0
    for place in EFFECTS[effect].with_role("place"):
        low, high = ranges.get(place.channel, (0.0, 0.0))
        if high > low:
            inside = (values[place.name] - low) / (high - low)
            above = all(values[side.name] >= 0.0 for side in EFFECTS[effect].with_role("side"))
            touched = 1.0 - inside if above else inside
            beyond = max(0.0, touched - _CONTACT_SHARE) / _CONTACT_WIDTH
            lost += min(0.5 * beyond**2, _MOST_RANGE_PRICE)
    return lost


def _score(
    candidate: Candidate,
    baseline: Candidate,
    suspects: list[Block],
    share: float,
    settings: DiagnosisSettings,
) -> float:
    """Logarithm of the weight of a set of effects, up to a constant; ``share`` of the mismatch is
    granted to the forms of equations.
    """
    lost = _lost_by_left(candidate, baseline, suspects, share, settings)
    return -lost - _prior_loss(candidate, settings)


def _lost_by_left(
    candidate: Candidate,
    baseline: Candidate,
    suspects: list[Block],
    share: float,
    settings: DiagnosisSettings,
) -> float:
    """What a set loses by what it leaves, ``share`` of the mismatch being granted to forms."""
    total = 0.0
    once = candidate.fitted == candidate.held_out  # the same recordings twice
    for was, now in ((baseline.fitted, candidate.fitted), (baseline.held_out, candidate.held_out)):
        for block in suspects:
            excess, left = (max(0.0, e[block.name].ratio - 1.0) for e in (was, now))
            total += 0.25 * _LOOKS * math.log(1.0 + left + share * excess)
            # of two that leave less than forms may, the one that leaves less is the more probable
            total += 0.25 * _LOOKS_WITHIN * math.log(1.0 + left)
            # of a mismatch near the noise the noise says how much may be left, of a strong one the
            # forms
            spread = math.hypot(now[block.name].scatter, settings.form_error * excess, _NOISE_ERROR)
            total += min(0.5 * (left / spread) ** 2, _DECIDED) * (0.5 if once else 1.0)
    return total


def _prior_loss(candidate: Candidate, settings: DiagnosisSettings) -> float:
    """What a set loses before any data: its price, and that of every name beyond the first."""
    further = settings.further_price * (len(candidate.terms) - 1)
    return price(candidate, settings) + further


def possible_gain(
    candidate: Candidate, baseline: Candidate, suspects: list[Block], settings: DiagnosisSettings
) -> float:
    """By how much the logarithm of a set's weight could rise with something beside it, which left
    nothing at all.
    """
    share = settings.form_share
    least = sum(
        0.25 * _LOOKS * math.log(1.0 + share * max(0.0, was[block.name].ratio - 1.0))
        for was in (baseline.fitted, baseline.held_out)
        for block in suspects
    )
    return _lost_by_left(candidate, baseline, suspects, share, settings) - least


def price_of_term(candidate: Candidate, term: Term, settings: DiagnosisSettings) -> float:
    """What a set loses by one of its terms before any data: by the parameters of an effect, their
    values and its place, or by how far a parameter of the file is wrong.
    """
    if term.id in candidate.wrong:
        return settings.wrong_price + candidate.outside_of(term.id, settings.most_tolerances)
    own = [n for n in candidate.fit.effect_values if effect_of(n) == term]
    counted = sum(not find_parameter(n).repeats for n in own)
    rare = sum(_loss_by_value(candidate, n) for n in own)
    places = candidate.places / max(1, len(candidate.effects))
    return settings.parameter_price * counted + rare + places


def price(candidate: Candidate, settings: DiagnosisSettings) -> float:
    """What a set pays for the parameters of its effects (of events of one kind only the first
    counts), for the places where they could have been, and for a file that is wrong.
    """
    own = settings.wrong_price * len(candidate.wrong) + candidate.outside(settings.most_tolerances)
    counted = [n for n, _ in _effect_values(candidate) if not find_parameter(n).repeats]
    return own + settings.parameter_price * len(counted) + candidate.places
