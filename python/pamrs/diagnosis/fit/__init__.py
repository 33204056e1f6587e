"""Models fitted to all blocks and recordings together: parameters inside their tolerances, effects
from several starts.

Public: `Problem`, `Fit`, `Scaling`, `Inflation`,
`Unfollowed`, `fit`, `residuals`, `changes`, `stacked`,
`with_priors`, `predicted_with_doubt`, `predicted_by_others` (one recording left out after the
other), `free_baseline`, `bin_width`, `Key`, `Residuals`, `Stages`;
`levenberg_marquardt`; `Start`, `starts_of`, `start_of`, `parts_of`, `CHOSEN` (where the fit of an
effect begins);
`form_in`, `entry_of`, `with_effects_of`, `with_entry`, `without_term` (effects of a rig
and their forms);
`Events`, `events_of`, `fit_events`, `look_for_events`, `refit_events` (transient effects);
`acts_in`, `concerns`, `depends`, `fits`, `places_of`, `same_data_in` (where effects act);
`known_parameters`, `with_known` (effects that the nominal model holds, and what
is known of all parameters); `ends_in_tolerances`, `in_tolerances`,
`moved_value` (how far they may move); `spread_over_pieces`
(standard deviations of coloured residuals).
"""

from pamrs.diagnosis.fit._continuation import parts_of, start_of
from pamrs.diagnosis.fit._effect_places import (
    acts_in,
    concerns,
    depends,
    fits,
    places_of,
    same_data_in,
)
from pamrs.diagnosis.fit._fitting import (
    FINAL_STEP_SHARE,
    FIT_BIN_TIME,
    LEAST_STEP_SHARE,
    Events,
    Fit,
    Inflation,
    Key,
    Problem,
    Residuals,
    Scaling,
    Stages,
    Unfollowed,
    bin_width,
    changes,
    fit,
    free_baseline,
    predicted_with_doubt,
    residuals,
    stacked,
    two_at_a_time,
    with_priors,
)
from pamrs.diagnosis.fit._known_parameters import (
    ends_in_tolerances,
    in_tolerances,
    known_parameters,
    moved_value,
    with_known,
)
from pamrs.diagnosis.fit._leastsquares import levenberg_marquardt
from pamrs.diagnosis.fit._leave_one_out import predicted_by_others
from pamrs.diagnosis.fit._offsets import with_offsets
from pamrs.diagnosis.fit._spread import PIECE_TIME, spread_over_pieces
from pamrs.diagnosis.fit._starts import (
    CHOSEN,
    Start,
    entry_of,
    form_in,
    starts_of,
    with_effects_of,
    with_entry,
    without_term,
)
from pamrs.diagnosis.fit._transients import (
    events_of,
    fit_events,
    look_for_events,
    refit_events,
)

__all__ = [
    "FINAL_STEP_SHARE",
    "LEAST_STEP_SHARE",
    "FIT_BIN_TIME",
    "PIECE_TIME",
    "CHOSEN",
    "Events",
    "Fit",
    "Key",
    "Residuals",
    "Stages",
    "Problem",
    "Scaling",
    "Start",
    "Unfollowed",
    "Inflation",
    "acts_in",
    "bin_width",
    "changes",
    "concerns",
    "depends",
    "ends_in_tolerances",
    "in_tolerances",
    "entry_of",
    "events_of",
    "fit",
    "fit_events",
    "fits",
    "form_in",
    "free_baseline",
    "known_parameters",
    "levenberg_marquardt",
    "look_for_events",
    "refit_events",
    "moved_value",
    "parts_of",
    "places_of",
    "predicted_by_others",
    "predicted_with_doubt",
    "residuals",
    "same_data_in",
    "spread_over_pieces",
    "stacked",
    "start_of",
    "starts_of",
    "two_at_a_time",
    "with_effects_of",
    "with_entry",
    "with_known",
    "with_offsets",
    "with_priors",
    "without_term",
]
