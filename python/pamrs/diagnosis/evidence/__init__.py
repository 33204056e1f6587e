"""Hypotheses, what speaks for each, and the verdict of each group of blocks.

Public: `FittedHypothesis`, `BlockGroup`, `significant`, `misses_only_held_out` (hypotheses and what
they leave); `BlockLikelihood`, `Likelihood` (how probable recordings are);
`weigh`, `explains`, `is_absent`, `log_weight`, `LEAST_TEMPERING`, `share_left`, `same_recordings`,
`probability_cap`, `possible_gain`, `prior_loss`, `Weighing` (their weights); `price_of_wrong`,
`weigh_only_noise` (those where the baseline leaves only noise); `drop_undetermined`,
`with_stated_std`, `is_outside`, `put_aside` (names that do not hold); `Judged`, `judge`,
`case_probabilities`, `case_ambiguity`, `is_unlikely`, `parameters_at_wall` (verdicts).
"""

from __future__ import annotations

from pamrs.diagnosis.evidence._candidates import (
    BlockGroup,
    FittedHypothesis,
    misses_only_held_out,
    significant,
)
from pamrs.diagnosis.evidence._likelihood import BlockLikelihood, Likelihood
from pamrs.diagnosis.evidence._only_noise import price_of_wrong, weigh_only_noise
from pamrs.diagnosis.evidence._undetermined import (
    drop_undetermined,
    is_outside,
    put_aside,
    with_stated_std,
)
from pamrs.diagnosis.evidence._verdicts import (
    SHARED_ODDS,
    WALL_TOLERANCES,
    Judged,
    are_alike,
    case_ambiguity,
    case_probabilities,
    is_unlikely,
    judge,
    parameters_at_wall,
)
from pamrs.diagnosis.evidence._weighing import (
    FORM_SHARE_ALIKE,
    LEAST_TEMPERING,
    Weighing,
    explains,
    is_absent,
    log_weight,
    possible_gain,
    prior_loss,
    probability_cap,
    same_recordings,
    share_left,
    weigh,
)

__all__ = [
    "SHARED_ODDS",
    "WALL_TOLERANCES",
    "FORM_SHARE_ALIKE",
    "LEAST_TEMPERING",
    "BlockLikelihood",
    "FittedHypothesis",
    "BlockGroup",
    "Judged",
    "Likelihood",
    "Weighing",
    "are_alike",
    "case_ambiguity",
    "case_probabilities",
    "drop_undetermined",
    "misses_only_held_out",
    "explains",
    "is_outside",
    "is_absent",
    "is_unlikely",
    "judge",
    "log_weight",
    "put_aside",
    "probability_cap",
    "possible_gain",
    "price_of_wrong",
    "prior_loss",
    "same_recordings",
    "share_left",
    "significant",
    "with_stated_std",
    "parameters_at_wall",
    "weigh",
    "weigh_only_noise",
]
