"""Hypotheses, what speaks for each, and the verdict of each group of blocks.

A probability is made in two files: `_prior` (odds before any data) and `_posterior` (likelihood
times prior, for hypotheses of one group of blocks and of all groups, in the order that it states).
It changes once more where `model` takes an answer out that its errors contradict (`put_aside`), and
where the geometry of a joint is marked unknown (`diagnosis/__init__`). Public: `FittedHypothesis`,
`BlockGroup` (hypotheses); `BlockLikelihood`, `Likelihood` (how probable recordings are); `Prior`,
`probability_cap`, `loss_of_file`, `odds_of_unseen`, `is_unlikely`, `parameters_at_wall` (odds);
`posterior`, `posterior_where_noise`, `log_weight`, `possible_gain`, `drop_undetermined`,
`put_aside`, `are_alike` (probabilities); `explains`, `share_left`, `significant`,
`misses_only_held_out` (what hypotheses leave); `is_absent`, `same_recordings`,
`value_may_be_right`, `with_stated_std` (sizes that are determined); `Judged`, `judge`,
`case_probabilities`, `case_ambiguity` (verdicts).
"""

from __future__ import annotations

from pamrs.diagnosis.evidence._candidates import (
    FORM_SHARE_ALIKE,
    BlockGroup,
    FittedHypothesis,
    explains,
    misses_only_held_out,
    share_left,
    significant,
)
from pamrs.diagnosis.evidence._determined import (
    SAME_STDS,
    is_absent,
    same_recordings,
    value_may_be_right,
    with_stated_std,
)
from pamrs.diagnosis.evidence._likelihood import BlockLikelihood, Likelihood
from pamrs.diagnosis.evidence._posterior import (
    LEAST_TEMPERING,
    are_alike,
    drop_undetermined,
    log_weight,
    possible_gain,
    posterior,
    posterior_where_noise,
    put_aside,
)
from pamrs.diagnosis.evidence._prior import (
    SHARED_ODDS,
    WALL_TOLERANCES,
    Prior,
    is_unlikely,
    loss_of_file,
    odds_of_unseen,
    parameters_at_wall,
    probability_cap,
)
from pamrs.diagnosis.evidence._verdicts import (
    Judged,
    case_ambiguity,
    case_probabilities,
    judge,
)

__all__ = [
    "SAME_STDS",
    "SHARED_ODDS",
    "WALL_TOLERANCES",
    "FORM_SHARE_ALIKE",
    "LEAST_TEMPERING",
    "BlockLikelihood",
    "FittedHypothesis",
    "BlockGroup",
    "Judged",
    "Likelihood",
    "Prior",
    "are_alike",
    "case_ambiguity",
    "case_probabilities",
    "drop_undetermined",
    "misses_only_held_out",
    "explains",
    "is_absent",
    "is_unlikely",
    "judge",
    "loss_of_file",
    "odds_of_unseen",
    "log_weight",
    "put_aside",
    "probability_cap",
    "possible_gain",
    "same_recordings",
    "share_left",
    "significant",
    "with_stated_std",
    "parameters_at_wall",
    "value_may_be_right",
    "posterior",
    "posterior_where_noise",
]
