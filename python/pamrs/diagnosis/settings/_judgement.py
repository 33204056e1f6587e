"""Settings of the judgement: how hypotheses are weighed, and what becomes a verdict."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pamrs.diagnosis.settings._setting import SettingsGroup, setting
from pamrs.errors import ParameterError

__all__ = ["EvidenceSettings", "VerdictSettings"]


@dataclass(frozen=True)
class EvidenceSettings(SettingsGroup):
    """How hypotheses are weighed against each other and against unlisted."""

    log_odds_explained: float = setting(
        0.0,
        unit="log odds",
        reason="odds of explained to unexplained variance at which a set of effects is as probable "
        "as unlisted: even where half is left, since a name has to carry half",
        origin="the definition of the verdict; docs/decisions/0014",
    )
    log_odds_explained_pliable: float = setting(
        2.6,
        unit="log odds",
        reason="the same of what takes up a good part of anything: transient effects that are "
        "another in every recording, and parameters of the baseline (7 % left)",
        origin="docs/decisions/0014 and 0025",
    )
    softness: float = setting(
        0.4,
        unit="log odds",
        above=0.0,
        reason="width of that transition",
        origin="docs/decisions/0014",
    )
    log_odds_noise_left: float = setting(
        3.0,
        unit="log odds",
        reason="odds to unlisted that a set has at the least where it leaves only noise",
        origin="judgement",
    )
    clear_share: float = setting(
        0.7,
        unit="1",
        above=0.0,
        most=1.0,
        reason="share that may be left of a mismatch that hardly is one, for a set to explain it",
        origin="docs/decisions/0020: what explains it has to take 30 % of it",
    )
    emptier_share: float = setting(
        0.05,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of the samples of a recording in which the pressure behind a late gauge may "
        "be impossible: edges are smoothed, and their slopes too large",
        origin="judgement",
    )
    emptier_part: float = setting(
        0.02,
        unit="of the highest pressure",
        least=0.0,
        reason="how far below the ambient that pressure has to be: more than noise of the slope",
        origin="a tank that empties through a capillary, whose gauge seemed to lag by 0.38 s: 13 "
        "to 16 % below",
    )
    looks: float = setting(
        12.0,
        unit="1",
        above=0.0,
        reason="independent looks that a block's residual counts for",
        origin="docs/decisions/0014: tuned on seed 501",
    )
    looks_within: float = setting(
        1.0,
        unit="1",
        least=0.0,
        reason="further looks, of what is left whatever a form is granted: of two equations that "
        "leave less than forms do, the one that leaves less is the more probable",
        origin="docs/decisions/0014: seeds 11301 and 11501",
    )
    predictive_share: float = setting(
        0.5,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of the probability of names that goes by the density of recordings under "
        "each hypothesis, stretch by stretch; the rest goes by how much each leaves",
        origin="docs/decisions/0014: the mean of the two is better than either",
    )
    predictive_order: int = setting(
        4,
        unit="1",
        least=1,
        reason="order of the autoregression of what a hypothesis leaves",
        origin="docs/decisions/0014: 1, 2, 4 and 8 do alike",
    )
    predictive_stretch: float = setting(
        3.0,
        unit="s",
        above=0.0,
        reason="length of the stretches that are drawn: longer than what a start of a joint does",
        origin="docs/decisions/0014: 3 and 6 s do alike",
    )
    predictive_draws: int = setting(
        1000,
        unit="1",
        least=1,
        reason="draws of the bootstrap",
        origin="judgement: a share is then known to 2 %",
    )
    predictive_seed: int = setting(
        0,
        unit="1",
        least=0,
        reason="seed of the bootstrap",
        origin="any",
    )
    parameter_price: float = setting(
        0.5,
        unit="log odds",
        least=0.0,
        reason="price of a parameter of an effect",
        origin="docs/decisions/0014: tuned on seed 501",
    )
    further_price: float = setting(
        3.0,
        unit="log odds",
        least=0.0,
        reason="price of a further effect or wrong parameter",
        origin="docs/decisions/0014: tuned on seed 501",
    )
    wrong_price: float = setting(
        1.5,
        unit="log odds",
        least=0.0,
        reason="price of a rig file that is wrong about a parameter, beside the logarithm of how "
        "many times it is outside its tolerances",
        origin="docs/decisions/0025",
    )
    telling_excess: float = setting(
        0.5,
        unit="1",
        least=0.0,
        reason=(
            "excess variance over that of the noise from which recordings are tested for how much "
            "an effect leaves"
        ),
        origin="docs/decisions/0014",
    )
    telling_share: float = setting(
        0.9,
        unit="1",
        above=0.0,
        most=1.0,
        reason="share of the largest excess from which recordings always are",
        origin="judgement",
    )
    form_share: float = setting(
        0.04,
        unit="1",
        least=0.0,
        reason="share of a mismatch that the difference between an equation of the catalogue and "
        "the truth may leave",
        origin="docs/decisions/0014",
    )
    form_share_alike: float = setting(
        0.01,
        unit="1",
        least=0.0,
        reason="the same where sets of as many effects are compared",
        origin="docs/decisions/0020",
    )
    form_error: float = setting(
        0.15,
        unit="1",
        least=0.0,
        reason="standard deviation of what a right effect of another form leaves of a mismatch's "
        "variance",
        origin="docs/decisions/0022",
    )
    noise_error: float = setting(
        0.06,
        unit="1",
        least=0.0,
        reason="standard deviation of a noise level",
        origin="docs/decisions/0022",
    )
    decided: float = setting(
        8.0,
        unit="log odds",
        above=0.0,
        reason="the most that what is left in one block, or the priors, count",
        origin="docs/decisions/0022 and 0025",
    )
    most_probability: float = setting(
        0.985,
        unit="1",
        above=0.0,
        most=1.0,
        reason="largest probability of a name",
        origin="docs/decisions/0014",
    )
    drift_share: float = setting(
        0.02,
        unit="1",
        least=0.0,
        reason="share of the pressure below which a drift that no other recording confirms may be "
        "the bench's own",
        origin="docs/decisions/0014: the aluminium control of the chambers has one",
    )
    drift_probability: float = setting(
        0.45,
        unit="1",
        above=0.0,
        most=1.0,
        reason="largest probability of a name for such a drift",
        origin="docs/decisions/0014",
    )
    standing_price: float = setting(
        2.0,
        unit="log odds",
        least=0.0,
        reason="price of an effect that leaves the same recordings as another one because a "
        "parameter of it is next to zero: a clock that is late but does not drift",
        origin="docs/decisions/0020: odds of 7 to 1",
    )
    same_share: float = setting(
        0.1,
        unit="1",
        least=0.0,
        reason="part of an effect's size over a recording below which what would tell it from "
        "another effect is zero",
        origin="judgement",
    )
    same_stds: float = setting(
        2.0,
        unit="standard deviations",
        least=0.0,
        reason="standard deviations within which a value is not told from zero",
        origin="judgement",
    )
    determined_stds: float = setting(
        1.0,
        unit="standard deviations",
        least=0.0,
        reason="stated standard deviations within which the sizes of a name are not told from "
        "none: a stated one is twice what the pieces of the recordings tell",
        origin="judgement: the same from which a value is said not to be determined",
    )
    unseen_lengths: float = setting(
        3.0,
        unit="recordings",
        above=0.0,
        reason="lengths of the longest recording beyond which a time constant was not seen",
        origin="judgement",
    )
    unseen_price: float = setting(
        6.5,
        unit="log odds",
        least=0.0,
        reason="price of an effect with such a time constant, or with one that is "
        "not told from zero",
        origin="judgement",
    )
    scatter: float = setting(
        0.35,
        unit="1",
        least=0.0,
        reason="relative scatter of an effect's size between recordings beyond which it is not "
        "that effect",
        origin="judgement",
    )
    scatter_width: float = setting(
        0.1,
        unit="1",
        above=0.0,
        reason="further scatter that costs one unit of log odds",
        origin="judgement",
    )
    range_factor: float = setting(
        3.0,
        unit="1",
        above=1.0,
        reason="factor by which a value is one standard deviation outside its usual range",
        origin="docs/decisions/0022",
    )
    most_range_price: float = setting(
        4.0,
        unit="log odds",
        least=0.0,
        reason="the most that a value outside its usual range costs",
        origin="docs/decisions/0022",
    )
    contact_share: float = setting(
        0.5,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of the range that was visited over which a contact may act",
        origin="docs/decisions/0022",
    )
    contact_width: float = setting(
        0.15,
        unit="1",
        above=0.0,
        reason="share beyond that which costs a standard deviation",
        origin="docs/decisions/0022",
    )


@dataclass(frozen=True)
class VerdictSettings(SettingsGroup):
    """How probabilities become a verdict."""

    certainty: float = setting(
        0.5,
        unit="1",
        above=0.0,
        most=1.0,
        reason="share of the logarithm of the odds between two hypotheses of a mismatch that "
        "counts: with all of it names stated at 0.98 were right in 77 % of groups of blocks",
        origin="docs/decisions/0014: calibrated on seeds 9201 and 9401 of the second plan",
    )
    shared_odds: float = setting(
        6.0,
        unit="1",
        above=0.0,
        reason="odds of one effect that acts in two groups of blocks to two effects",
        origin="docs/decisions/0004",
    )
    alike_stds: float = setting(
        3.0,
        unit="standard deviations",
        above=0.0,
        reason="by which the values of one name in two groups may differ",
        origin="judgement",
    )
    alike_share: float = setting(
        0.5,
        unit="1",
        least=0.0,
        reason="share of the larger value by which they may differ however well each is known: "
        "each stands for what is not modelled in its own blocks as well",
        origin="judgement: a factor of two",
    )
    settled: float = setting(
        0.75,
        unit="1",
        above=0.0,
        most=1.0,
        reason="probability from which an answer is settled",
        origin="docs/decisions/0014: odds of nine to one before they are calibrated",
    )
    in_set: float = setting(
        0.05,
        unit="1",
        least=0.0,
        most=1.0,
        reason="probability from which a hypothesis belongs to the set that is left",
        origin="judgement",
    )
    named: float = setting(
        0.5,
        unit="1",
        least=0.0,
        most=1.0,
        reason="probability above which a name is given even where unlisted is more probable than "
        "each set of names that has it",
        origin="docs/decisions/0004",
    )
    listed: float = setting(
        1e-4,
        unit="1",
        least=0.0,
        reason="probability from which a case lists a set of names: most products of what several "
        "blocks leave open are next to nothing",
        origin="judgement",
    )
    counted: float = setting(
        1e-6,
        unit="1",
        least=0.0,
        reason="probability from which a hypothesis of one group is put beside those of others",
        origin="judgement",
    )
    most_sets: int = setting(
        8, unit="count", least=1, reason="sets that a case lists", origin="judgement"
    )
    quiet_likely: float = setting(
        0.83,
        unit="1",
        least=0.0,
        most=1.0,
        reason="probability of parameters in a group that keeps only noise after its parameters "
        "moved, of none where they did not have to",
        origin="the rest; docs/decisions/0004",
    )
    quiet_other: float = setting(
        0.03,
        unit="1",
        least=0.0,
        most=1.0,
        reason="probability of the other one of the two",
        origin="judgement; docs/decisions/0004",
    )
    quiet_unlisted: float = setting(
        0.14,
        unit="1",
        least=0.0,
        most=1.0,
        reason="probability of unlisted in such a group: of what is there and too small to be seen",
        origin="docs/decisions/0004: 24 of 171 such groups of six seeds that were read",
    )
    strained_parameters: float = setting(
        0.75,
        unit="1",
        least=0.0,
        most=1.0,
        reason="probability of parameters where one stands at its wall: all is explained, at a "
        "price that the rig's owner would not have expected",
        origin="judgement; docs/decisions/0004",
    )
    strained_unlisted: float = setting(
        0.25,
        unit="1",
        least=0.0,
        most=1.0,
        reason="probability of unlisted there",
        origin="judgement; docs/decisions/0004",
    )
    unknown_geometry_probability: float = setting(
        0.4,
        unit="1",
        least=0.0,
        most=1.0,
        reason="factor of the probability of effects on a joint beside geometry that the rig file "
        "marks unknown",
        origin="docs/decisions/0012",
    )
    spread_factor: float = setting(
        2.0,
        unit="1",
        least=1.0,
        reason="factor of the standard deviations of what no prior holds, beyond what pieces of "
        "the recordings tell: for equations that are not quite the rig's",
        origin="docs/decisions/0041: 78 intervals of 95 % of six read seeds of the second plan "
        "held in 78 %, twice as wide in 95 %",
    )
    budget_draws: int = setting(
        400,
        unit="count",
        least=20,
        reason="weightings of the pieces of the recordings from which a share's interval comes",
        origin="judgement: the ends of an interval of 95 % rest on ten of them",
    )
    least_gap: float = setting(
        0.05,
        unit="noise levels",
        least=0.0,
        reason="gap between refit and noise, over all channels, below which nothing is said of "
        "how much of it closes",
        origin="judgement",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for names in (
            ("quiet_likely", "quiet_other", "quiet_unlisted"),
            ("strained_parameters", "strained_unlisted"),
        ):
            total = sum(getattr(self, name) for name in names)
            if not math.isclose(total, 1.0, abs_tol=1e-9):
                raise ParameterError(
                    f"VerdictSettings.{' + '.join(names)} = {total:g} is not allowed: they are "
                    "probabilities of all that can be, and add up to 1"
                )
