"""Prior: odds of hypotheses before any data, by their names, sizes and values."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm

from pamrs.diagnosis.evidence._candidates import FittedHypothesis
from pamrs.diagnosis.evidence._determined import SAME_STDS
from pamrs.diagnosis.fit import Fit, Problem, form_in
from pamrs.diagnosis.noise import SIZE_SPREAD
from pamrs.diagnosis.prepare import Block
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import (
    NONE,
    PARAMETERS,
    UNLISTED,
    Hypothesis,
    SameData,
    Term,
    effect_of,
    find_parameter,
    usual_values,
)
from pamrs.findings import DETECTED, Limit

# [log odds] price of physics without a name (decision 14), and of an effect with a time constant
# that recordings do not show
UNLISTED_PRICE = 6.0
# odds of a name whose right fit was not found, or has no equation here, to physics without a name:
# of 31 places that no name explained, an effect of the catalogue acted in 20 (decision 14)
MISSED_ODDS = 2.0
# log odds: an effect like another, as a parameter is near zero; 7 to 1 (decision 20)
_STANDING_PRICE = 2.0
# [recordings] lengths of the longest recording beyond which a time constant was not seen
_UNSEEN_LENGTHS = 3.0
# [log odds] the most that a value outside its usual range costs (decision 22)
_MOST_RANGE_PRICE = 4.0
# odds of one effect that acts in two groups of blocks to two effects (decision 4)
SHARED_ODDS = 6.0
# share of parameters where their values are unlikely, of unlisted what remains: they explain all,
# at a price the owner would mind, and settle nothing
_UNLIKELY_PARAMETERS = 0.7
# [tolerances] moved to its wall (the setting most_tolerances), which is suspect (decision 25)
WALL_TOLERANCES = 2.9
# [noise levels] left in a group below which nothing has no name: both such groups of 40 read cases
# lacked nothing (decision 4)
LEAST_UNLISTED = 0.5
_UNLIKELY = 0.01  # chance of a baseline below which its values count against it


@dataclass(frozen=True)
class Prior:
    """Odds of hypotheses before any data: prices of names, of their sizes and of rare values.

    Attributes
    ----------
    cap : float
        Largest probability of all names together.
    seconds : float
        Length of the longest recording that was fitted [s].
    settings : DiagnosisSettings
        Prices.
    """

    cap: float
    seconds: float
    settings: DiagnosisSettings

    def loss(self, candidate: FittedHypothesis, samples: float = math.inf) -> float:
        """Log odds that a hypothesis loses before any data: its price by so many independent
        samples, and rare values.
        """
        return self.price(candidate, samples) + self.rarity(candidate)

    def price(self, candidate: FittedHypothesis, samples: float = math.inf) -> float:
        """Log odds paid for names, parameters, events, possible places, and wrong values; of the
        parameters of events for no more than there are independent samples for them to follow.
        """
        total = sum(self._own_price(candidate, term) for term in candidate.terms)
        total += self.settings.name_price * len(candidate.terms) + candidate.log_places
        events = candidate.fit.events
        happened = 0 if events is None else sum(len(v) for v in events.values.values())
        return total + self.settings.parameter_price * min(happened, samples)

    def _own_price(self, candidate: FittedHypothesis, term: Term) -> float:
        """Log odds paid for an effect's parameters, or for how far a value of the file is wrong."""
        if term.id in candidate.wrong:
            beyond = candidate.beyond_walls_by(term.id, self.settings.most_tolerances)
            return self.settings.wrong_price + beyond
        parameters = (n for n in candidate.fit.effect_values if effect_of(n) == term)
        repeated = (find_parameter(name).repeats for name in parameters)
        return self.settings.parameter_price * sum(not again for again in repeated)

    def rarity(self, candidate: FittedHypothesis) -> float:
        """Log odds that a hypothesis loses by values that its physics hardly has."""
        lost = sum(loss_by_value(candidate, name) for name in candidate.fit.effect_values)
        lost += _STANDING_PRICE * _lacks_drift(candidate, self.seconds)
        return lost + UNLISTED_PRICE * _has_unseen_time(candidate, self.seconds)

    def loss_by_term(self, candidate: FittedHypothesis, term: Term) -> float:
        """Log odds that a set loses by one term: price, values and place."""
        paid = self._own_price(candidate, term)
        if term.id in candidate.wrong:
            return paid
        own = [name for name in candidate.fit.effect_values if effect_of(name) == term]
        rare = sum(loss_by_value(candidate, name) for name in own)
        return paid + rare + candidate.log_places / max(1, len(candidate.effects))


def loss_of_file(candidate: FittedHypothesis, settings: DiagnosisSettings) -> float:
    """Log odds that wrong values lose where the baseline explains all: a file that is further
    outside its tolerances is rarer, but less and less so.
    """
    odds, walls = settings.file_log_odds, settings.most_tolerances
    return sum(odds + candidate.beyond_walls_by(name, walls) for name in candidate.wrong)


def odds_of_unseen(limits: Iterable[Limit], settings: DiagnosisSettings) -> dict[str, float]:
    """Odds, against none, that an effect acts which recordings would hardly show, by the block that
    shows it best: of each effect at the price of a name with one size, shared by its places, the
    share of its usual sizes (log-normal) that stays below what is detected.
    """
    every = list(limits)
    odds = dict.fromkeys((limit.block for limit in every), 0.0)
    places = Counter(Term.parse(limit.effect).id for limit in every)
    for limit in every:
        below = math.log(DETECTED / max(limit.seen, 1e-300)) / SIZE_SPREAD
        share = float(norm.cdf(below)) / places[Term.parse(limit.effect).id]
        odds[limit.block] += share * math.exp(-settings.name_price - settings.parameter_price)
    return odds


def shares_of_undecided(
    unseen: float, *, unlikely: bool, nominal_misses: bool
) -> Mapping[Hypothesis, float]:
    """Answers among which the probability of `UNDECIDED` is divided, each with its share: by the
    odds of effects that are not seen, whether the values of the baseline are unlikely, and whether
    the nominal model misses.
    """
    rest = 1.0 / (1.0 + unseen)
    if unlikely:
        known = _UNLIKELY_PARAMETERS * rest
        return {PARAMETERS: known, UNLISTED: 1.0 - known}
    return {PARAMETERS if nominal_misses else NONE: rest, UNLISTED: 1.0 - rest}


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


def loss_by_value(candidate: FittedHypothesis, name: str) -> float:
    """Log odds that a set loses by a value that its physics hardly has.

    A parameter with a prior loses by its distance from it, as by a Cauchy distribution: a value of
    ten deviations is rare, but it does not rule out what explains a mismatch to its noise. Others
    lose by how many times they are outside the range of usual values, for certain.
    """
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
        outside = math.log(times) / SIZE_SPREAD
        lost += min(0.5 * outside**2, _MOST_RANGE_PRICE)
    return lost


def _has_unseen_time(candidate: FittedHypothesis, seconds: float) -> bool:
    """True where a time constant is much longer than the recordings, or may be zero."""
    std = candidate.fit.std
    return any(
        value > _UNSEEN_LENGTHS * seconds or value < SAME_STDS * std.get(name, 0.0)
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


def is_unlikely(fit: Fit) -> bool:
    """True where a value is at its wall, or values inside their tolerances and starts of gases lie
    further from what is known of them, together, than one in a hundred draws of them.
    """
    if parameters_at_wall(fit):
        return True
    moved = sum(abs(far) > 0.0 for far in fit.held_by_prior.values())
    starts = sum(residual.strain > 0.0 for residual in fit.residuals.values())
    return bool(chi2.sf(fit.strain + fit.start_strain, max(1, moved + starts)) < _UNLIKELY)


def parameters_at_wall(fit: Fit) -> dict[str, float]:
    """Parameters that a fit moved to their wall, and how far [tolerances]."""
    return {name: far for name, far in fit.moved.items() if abs(far) >= WALL_TOLERANCES}
