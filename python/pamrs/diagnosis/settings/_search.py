"""Settings of the search: which hypotheses are fitted."""

from __future__ import annotations

from dataclasses import dataclass

from pamrs.diagnosis.settings._setting import SettingsGroup, setting

__all__ = ["BelowNoiseSettings", "ReadingSettings", "SearchSettings", "WrongParameterSettings"]


@dataclass(frozen=True)
class ReadingSettings(SettingsGroup):
    """When another unit of a column, or another zero of a pressure, is what the model misses."""

    suspect: float = setting(
        3.0,
        unit="1",
        least=0.0,
        reason="mean square of the bin means, in variances of the noise, from which other units "
        "are tried: a wrong one leaves hundreds, and noise of the drives leaves two",
        origin="judgement",
    )
    promising: float = setting(
        0.3,
        unit="1",
        above=0.0,
        most=1.0,
        reason="share of that excess which a unit may leave after one step of the parameters to be "
        "worth a fit",
        origin="judgement",
    )
    fitted: int = setting(
        4,
        unit="1",
        least=1,
        reason="units that are fitted, the most promising first; others leave more",
        origin="judgement",
    )
    left: float = setting(
        0.05,
        unit="1",
        above=0.0,
        most=1.0,
        reason="share of the excess of the refitted baseline that a unit may leave: missing "
        "physics may stand beside it, and is then told from recordings that are read right",
        origin="judgement",
    )
    small_step: float = setting(
        0.1,
        unit="1",
        least=0.0,
        reason="logarithm of a factor up to which (bar, atmosphere, kgf/cm2) parameters inside "
        "their tolerances take up most of what it misses, so that a free factor has to tell",
        origin="atmosphere over kgf/cm2 is 1.033",
    )
    clear_stds: float = setting(
        5.0,
        unit="1",
        above=0.0,
        reason="standard errors by which such a factor has to be better than none: what it takes "
        "off the sum of squares, priors included, is the square of that",
        origin="judgement: some ten factors of a few sets of channels are tried, in noise that is "
        "not white",
    )
    gauge_error: float = setting(
        0.005,
        unit="1",
        least=0.0,
        reason="share by which a gauge's slope, or its zero in parts of the offset, may be off: a "
        "free factor need not be nearer to the one of the list",
        origin="usual class of industrial gauges: 0.5 % of the range",
    )
    stds: float = setting(
        3.0,
        unit="1",
        above=0.0,
        reason="standard deviations by which a free factor may be off",
        origin="one in 370",
    )
    closer: float = setting(
        0.25,
        unit="1",
        above=0.0,
        most=0.5,
        reason="how far, in parts of the step from the unit that was said (of its logarithm), a "
        "free factor may be at the most, what is not known of it included",
        origin="half the step would be no nearer than the unit that was said",
    )
    free_step: float = setting(
        0.005,
        unit="1",
        above=0.0,
        reason="part of an offset, and share of a factor, by which it is moved for its derivative",
        origin="judgement",
    )


@dataclass(frozen=True)
class SearchSettings(SettingsGroup):
    """Which blocks are suspect, and which hypotheses are fitted for them."""

    held_out_ratio: float = setting(
        2.0,
        unit="1",
        least=1.0,
        reason=(
            "variance over that of the noise from which held-out recordings show a mismatch that "
            "the fitted ones hardly show"
        ),
        origin="docs/decisions/0020",
    )
    fitted_hint: float = setting(
        1.15,
        unit="1",
        least=0.0,
        reason="variance over that of the noise that the fitted recordings must have for that",
        origin="docs/decisions/0020",
    )
    marginal_multiple: float = setting(
        1.35,
        unit="1",
        above=0.0,
        reason="multiple of noise's largest excess up to which a mismatch that no effect explains "
        "may be a noise level that was estimated too low",
        origin="docs/decisions/0020, then 0022",
    )
    marginal_excess: float = setting(
        0.3,
        unit="1",
        above=0.0,
        reason="excess variance over that of the noise up to which it may",
        origin="docs/decisions/0020, then 0022",
    )
    marginal_probability: float = setting(
        0.6,
        unit="1",
        least=0.0,
        most=1.0,
        reason="probability that it is",
        origin="docs/decisions/0020: odds 3 to 2",
    )
    split_from: float = setting(
        0.5,
        unit="1",
        least=0.0,
        most=1.0,
        reason="probability of unlisted above which a group of blocks is split where a name "
        "explains one of them: no name is then more probable than its absence",
        origin="docs/decisions/0004",
    )
    strong_ratio: float = setting(
        100.0,
        unit="1",
        above=1.0,
        reason="variance over that of the noise from which a mismatch is strong: linear signatures "
        "then say little of an effect's size",
        origin="ten times the noise; docs/decisions/0013",
    )
    least_gain: float = setting(
        12.0,
        unit="chi-square",
        least=0.0,
        reason="gain by the screen from which an effect is fitted",
        origin="judgement; docs/decisions/0013",
    )
    least_gain_share: float = setting(
        0.08,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of the largest gain from which an effect is fitted",
        origin="judgement; docs/decisions/0013",
    )
    most_singles: int = setting(
        5,
        unit="count",
        least=1,
        reason="single effects that are fitted",
        origin="docs/decisions/0013",
    )
    first_evaluations: int = setting(
        5,
        unit="count",
        least=2,
        reason="evaluations of such a fit",
        origin="docs/decisions/0013",
    )
    near_start: float = setting(
        0.6,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of an effect's best gain from which another of its starts is fitted",
        origin="judgement; docs/decisions/0013",
    )
    near_form: float = setting(
        0.3,
        unit="1",
        above=0.0,
        most=1.0,
        reason="share of an effect's best gain from which another form of it is fitted: signatures "
        "are linear in what a strong effect is not",
        origin="judgement",
    )
    most_forms: int = setting(
        4, unit="count", least=1, reason="forms of an effect that are fitted", origin="judgement"
    )
    near_place: float = setting(
        0.3,
        unit="1",
        above=0.0,
        most=1.0,
        reason="share of an effect's best gain from which another place of it is fitted too, where "
        "a rig has several blocks of a kind: of an effect at one of two alike blocks half shows at "
        "both",
        origin="docs/decisions/0103",
    )
    most_starts: int = setting(
        2,
        unit="count",
        least=1,
        reason="starts of an effect that are fitted",
        origin="docs/decisions/0013",
    )
    effects_with_starts: int = setting(
        3,
        unit="count",
        least=0,
        reason="effects of which more than one start is fitted",
        origin="docs/decisions/0013",
    )
    most_paired: int = setting(
        2,
        unit="count",
        least=0,
        reason="single effects that get a partner",
        origin="judgement; docs/decisions/0013",
    )
    most_partners: int = setting(
        2, unit="count", least=0, reason="partners of each", origin="judgement; docs/decisions/0013"
    )
    most_terms: int = setting(
        5, unit="count", least=2, reason="effects of a set", origin="judgement: more have no proof"
    )
    further_errors: float = setting(
        2.0,
        unit="standard errors",
        least=0.0,
        reason="improvement of held-out recordings, over their pieces, from which a further effect "
        "stays in the set",
        origin="judgement",
    )
    further_share: float = setting(
        0.2,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of what a set leaves that a further effect has to take",
        origin="judgement: what takes less is the form of the others",
    )
    partner_share: float = setting(
        0.01,
        unit="1",
        least=0.0,
        reason="least predicted gain of a partner, as a share of the mismatch",
        origin="judgement; docs/decisions/0013",
    )
    telling_left: float = setting(
        0.8,
        unit="1",
        above=0.0,
        most=1.0,
        reason="share of a mismatch that a hypothesis may leave by itself to be fitted together "
        "with the effects that leave least",
        origin="docs/decisions/0103: it takes a fifth, as a further effect has to",
    )
    transient_beside: float = setting(
        0.08,
        unit="1",
        least=0.0,
        reason=(
            "share that the best persistent effect leaves, from which transient ones are looked "
            "for beside it"
        ),
        origin="docs/decisions/0020",
    )
    much_left: float = setting(
        0.5,
        unit="1",
        least=0.0,
        reason="share of a mismatch from which an effect leaves most of it",
        origin="docs/decisions/0020",
    )
    polish_from: float = setting(
        0.03,
        unit="1",
        least=0.0,
        most=1.0,
        reason="probability from which a hypothesis is fitted to its end",
        origin="docs/decisions/0022",
    )
    most_polished: int = setting(
        4,
        unit="count",
        least=0,
        reason="hypotheses that are",
        origin="docs/decisions/0022: two to four seconds each",
    )


@dataclass(frozen=True)
class BelowNoiseSettings(SettingsGroup):
    """How effects below the noise are looked for and weighed."""

    least_gain: float = setting(
        45.0,
        unit="chi-square",
        least=0.0,
        reason="gain, autocorrelation counted, from which a signature counts in residuals that are "
        "no larger than noise; healthy gas blocks have none above 8, arms none above 19",
        origin="docs/decisions/0020, 14 and 5 healthy cases of seed 11",
    )
    stated_share: float = setting(
        0.3,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of what lies inside the stated error of the model that a signature has by "
        "chance, besides; smooth errors of 24 kinds gave most effects less in four of five draws",
        origin="docs/decisions/0111, alternatives",
    )
    rival_share: float = setting(
        0.3,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of the largest gain from which another effect is its rival",
        origin="judgement; docs/decisions/0020",
    )
    most_fitted: int = setting(
        4, unit="count", least=1, reason="rivals that are fitted", origin="judgement"
    )
    held_out_share: float = setting(
        0.05,
        unit="1",
        least=0.0,
        reason="share of the gain that held-out recordings have to show",
        origin="docs/decisions/0020",
    )
    gain_weight: float = setting(
        0.1,
        unit="1",
        least=0.0,
        reason="share of chi-square by which rivals are weighed: their equations are not the true "
        "ones, and the whole of it would always be sure",
        origin="docs/decisions/0020",
    )
    log_odds: float = setting(
        6.0,
        unit="log odds",
        reason="for an effect below the noise against unlisted where nothing speaks against it",
        origin="docs/decisions/0020",
    )
    most_probability: float = setting(
        0.93,
        unit="1",
        above=0.0,
        most=1.0,
        reason="largest probability of an effect below the noise",
        origin="docs/decisions/0020",
    )
    moved_tolerances: float = setting(
        1.75,
        unit="tolerances",
        above=0.0,
        reason="movement of a parameter from which effects that do the same are tested for whether "
        "it could go back; no parameter of 91 healthy cases moved its zero by more than 1.2",
        origin="docs/decisions/0020",
    )
    same_cosine: float = setting(
        0.8,
        unit="1",
        least=0.0,
        most=1.0,
        reason="cosine of two signatures from which an effect does the same as a parameter",
        origin="docs/decisions/0020",
    )
    relief: float = setting(
        3.0,
        unit="chi-square",
        least=0.0,
        reason="fall of the priors' sum of squares that an effect has to bring",
        origin="docs/decisions/0020",
    )
    parameters_log_odds: float = setting(
        1.5,
        unit="log odds",
        reason="of parameters that are off to all effects that do the same",
        origin="docs/decisions/0020: 4.5 to 1",
    )
    gone_back_share: float = setting(
        0.5,
        unit="1",
        least=0.0,
        reason="share of its movement to which the parameter has to go back",
        origin="docs/decisions/0020",
    )


@dataclass(frozen=True)
class WrongParameterSettings(SettingsGroup):
    """How values of the rig file that are wrong compete with effects."""

    wall_tolerances: float = setting(
        2.9,
        unit="tolerances",
        above=0.0,
        reason="movement from which a refitted parameter stands at its wall, and is a suspect",
        origin="docs/decisions/0025; the wall is at fit.most_tolerances",
    )
    file_log_odds: float = setting(
        4.6,
        unit="log odds",
        reason="against a parameter outside its tolerances where the baseline explains all",
        origin="docs/decisions/0025: one file in a hundred",
    )
    effect_log_odds: float = setting(
        6.0,
        unit="log odds",
        reason="against an effect below the noise beside it",
        origin="docs/decisions/0025",
    )
    least_predicted_gain: float = setting(
        9.2,
        unit="chi-square",
        least=0.0,
        reason="gain by the linear model from which a parameter is freed: twice file_log_odds",
        origin="docs/decisions/0025",
    )
    first_evaluations: int = setting(
        6,
        unit="count",
        least=2,
        reason="evaluations of the first fit of a freed parameter, which says whether it is worth "
        "a whole one",
        origin="judgement; docs/decisions/0025",
    )
    most_finished: int = setting(
        3,
        unit="count",
        least=1,
        reason="freed parameters, and pairs of them, that are fitted to their end",
        origin="judgement; docs/decisions/0025",
    )
    near_misfit: float = setting(
        2.0,
        unit="1",
        least=1.0,
        reason="times the sum of squares of a freed parameter that leaves noise up to which others "
        "are fitted to their end beside it",
        origin="judgement",
    )
    far_tolerances: float = setting(
        2.0,
        unit="tolerances",
        above=0.0,
        reason="movement from which a parameter beside effects is a suspect: the effects take a "
        "part of what it would have to do",
        origin="judgement",
    )
    most_beside: int = setting(
        2,
        unit="count",
        least=0,
        reason="parameters at their wall that are freed beside the effects that leave least",
        origin="judgement",
    )
    most_pairs: int = setting(
        2,
        unit="count",
        least=0,
        reason="pairs of parameters that are fitted",
        origin="docs/decisions/0025",
    )
    pair_share: float = setting(
        0.08,
        unit="1",
        least=0.0,
        reason="share of the largest predicted gain from which a pair is fitted",
        origin="docs/decisions/0025",
    )
    wrong_together: tuple[tuple[str, str], ...] = setting(
        (
            ("chamber.dead_volume", "valve.discharge_area_max"),
            ("arm.payload", "arm.first_moment"),
            ("arm.inertia", "arm.first_moment"),
            ("link.mass", "link.centre"),
            ("link.inertia", "link.mass"),
        ),
        unit="parameters",
        reason=(
            "pairs that one mistake makes wrong together: another valve and fittings, another "
            "load, another arm"
        ),
        origin="docs/decisions/0025",
    )
