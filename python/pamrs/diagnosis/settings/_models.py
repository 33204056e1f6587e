"""Settings of what is fitted: parameters, transient effects, the screen, forms without a name."""

from __future__ import annotations

from dataclasses import dataclass

from pamrs.diagnosis.settings._setting import SettingsGroup, setting

__all__ = ["ClosureSettings", "FitSettings", "ScreenSettings", "TransientSettings"]


@dataclass(frozen=True)
class FitSettings(SettingsGroup):
    """How models are fitted."""

    most_tolerances: float = setting(
        3.0,
        unit="tolerances",
        above=0.0,
        reason=(
            "how far a baseline parameter may move: farther out it would stand for missing "
            "physics, or for a wrong rig file"
        ),
        origin="docs/decisions/0014: with six, an inertia far out hid a mounting that gives way",
    )
    freed_multiple: float = setting(
        10.0,
        unit="1",
        above=0.0,
        reason="multiple of its nominal value, or of the walls of the others, by which a parameter "
        "that is freed from its prior may move",
        origin="docs/decisions/0025",
    )
    held_share: float = setting(
        0.3,
        unit="1",
        least=0.0,
        reason=(
            "tolerance of a parameter of an effect that the nominal model holds, as a share of its "
            "value, at the least: its standard deviation came of a model that lacked something"
        ),
        origin="docs/decisions/0034",
    )
    offset_stds: float = setting(
        4.0,
        unit="standard deviations",
        above=0.0,
        reason="how far from none an offset of the commands of a recording, below a sample, has to "
        "be before they are moved by it",
        origin="judgement: each of a few recordings is asked",
    )
    offset_left: float = setting(
        1.1,
        unit="variances of the noise",
        above=0.0,
        reason="mean square that a recording may miss with its commands moved: where more is "
        "missing, an offset takes a part of that, and names are worse for it",
        origin="healthy rigs leave 0.95 to 1.02; a wall of three times the heat is lost at 1.45",
    )
    offset_parts: int = setting(
        64,
        unit="count",
        least=1,
        reason="parts of a sample of the log by which commands are moved that seldom change",
        origin="judgement: a step at 100 Hz is off by 0.08 ms at the most",
    )
    offset_few_parts: int = setting(
        8,
        unit="count",
        least=1,
        reason="the same of commands that change at more than one sample in so many: each part is "
        "a step of the integration",
        origin="judgement",
    )
    least_offset_part: float = setting(
        1.6e-4,
        unit="s",
        above=0.0,
        reason="time that such a part lasts at the least: finer ones are parts of what no pressure "
        "tells, and a million samples have as many numbers in each",
        origin="offset_parts at 100 Hz",
    )
    most_offset: float = setting(
        1.0,
        unit="samples",
        above=0.0,
        reason="offset of commands from which it is left to the effects, and standard deviation of "
        "what is known of it before",
        origin="a log sees a command at its next sample",
    )
    most_offsets: int = setting(
        40,
        unit="count",
        least=0,
        reason="changes of the commands of a recording up to which each has an offset of its own "
        "where there is one: each takes two predictions",
        origin="judgement: steps, and no controller",
    )
    least_scale: float = setting(
        0.01,
        unit="1",
        above=0.0,
        reason=(
            "share of an effect parameter's usual start that its scale in a fit has at the least"
        ),
        origin="judgement",
    )
    least_start: float = setting(
        1e-3,
        unit="1",
        above=0.0,
        reason="share of a typical size from which a parameter goes on that a fit left at zero",
        origin="judgement",
    )
    least_step: float = setting(
        4e-4,
        unit="s",
        above=0.0,
        reason="stable integration step below which a model is not tried: it would take too long",
        origin="judgement",
    )
    least_step_share: float = setting(
        0.2,
        unit="1",
        above=0.0,
        reason="the same of a stiff rig, as a share of the step of its nominal model",
        origin="judgement",
    )
    step_gain: float = setting(
        0.2,
        unit="chi-square",
        least=0.0,
        reason="least predicted gain of a step, or the fit ends: noise makes as much",
        origin="judgement, docs/decisions/0014",
    )
    step_share: float = setting(
        2e-3,
        unit="1",
        least=0.0,
        reason="least predicted gain of a step in a first fit, as a share of the sum of squares",
        origin="docs/decisions/0014",
    )
    final_step_share: float = setting(
        1e-5,
        unit="1",
        least=0.0,
        reason="the same in a fit that goes to its end",
        origin="docs/decisions/0022: a fit that stopped early looked like missing physics",
    )
    stall_evaluations: int = setting(
        5,
        unit="count",
        least=1,
        reason="evaluations that together gain less than one step must, and the fit ends: as many "
        "as it takes from the first damping to steps of a tenth",
        origin="docs/decisions/0057",
    )
    evaluations: int = setting(
        12, unit="count", least=1, reason="evaluations of a fit at the most", origin="judgement"
    )
    baseline_evaluations: int = setting(
        30,
        unit="count",
        least=1,
        reason=(
            "the same of a fit of baseline parameters alone: what it leaves undone looks like "
            "missing physics"
        ),
        origin="docs/decisions/0022",
    )
    effect_evaluations: int = setting(
        8, unit="count", least=1, reason="the same of a first fit of effects", origin="judgement"
    )
    sealed_evaluations: int = setting(
        30,
        unit="count",
        least=1,
        reason="the same for a rig without a valve, whose evaluations are cheap",
        origin="judgement",
    )
    polish_evaluations: int = setting(
        10,
        unit="count",
        least=1,
        reason="the same for the last stretch of a fit",
        origin="docs/decisions/0022",
    )
    most_weightings: int = setting(
        4,
        unit="count",
        least=1,
        reason="how often a set is fitted on, weighted by what it leaves, as long as that falls by "
        "noise.correlated_variance",
        origin="docs/decisions/0103",
    )
    predicted_gain_evaluations: int = setting(
        50,
        unit="count",
        least=1,
        reason="the same of the linear model that predicts the gain of freeing a parameter",
        origin="judgement: to its end",
    )
    first_damping: float = setting(
        1e-4,
        unit="1",
        above=0.0,
        reason="damping with which Levenberg and Marquardt begin",
        origin="Marquardt (1963)",
    )
    most_damping: float = setting(
        1e8,
        unit="1",
        above=0.0,
        reason="damping at which they give up",
        origin="judgement",
    )
    zero_difference: float = setting(
        0.1,
        unit="tolerances",
        least=0.0,
        reason=(
            "difference of two groups about one sensor's zero from which the group that knows it "
            "less well is fitted again"
        ),
        origin="docs/decisions/0022",
    )
    known_share: float = setting(
        0.7,
        unit="tolerances",
        above=0.0,
        reason="standard deviation below which a parameter counts as determined by the recordings",
        origin="judgement",
    )
    scatter_stds: float = setting(
        2.0,
        unit="standard deviations",
        least=0.0,
        reason="what the size of an effect may differ between recordings by its own uncertainty",
        origin="judgement",
    )
    sole_source: float = setting(
        0.9,
        unit="1",
        above=0.0,
        most=1.0,
        reason="share of what all recordings tell of a direction from which one of them is its "
        "only source, so that the others cannot predict it",
        origin="judgement; leverage as in Cook & Weisberg (1982)",
    )
    pieces_left_out: int = setting(
        5,
        unit="count",
        least=2,
        reason="pieces of a single recording, each predicted by the others",
        origin="docs/decisions/0111",
    )


@dataclass(frozen=True)
class TransientSettings(SettingsGroup):
    """How effects with times of their own are looked for in each recording."""

    spacing: float = setting(
        0.5, unit="s", above=0.0, reason="distance of the times that are tried", origin="judgement"
    )
    first_time: float = setting(
        0.25, unit="s", least=0.0, reason="first time that is tried", origin="judgement"
    )
    last_time: float = setting(
        0.5,
        unit="s",
        least=0.0,
        reason="time before the end of the recording from which none is tried",
        origin="judgement",
    )
    least_step_share: float = setting(
        0.2,
        unit="1",
        least=0.0,
        most=1.0,
        reason="longest stable step of a model with persistent effects, as a share of the nominal "
        "one's, from which events are looked for beside these: the many runs that it takes would "
        "each be five times as long",
        origin="judgement; docs/decisions/0103",
    )
    early: float = setting(
        0.1,
        unit="s",
        least=0.0,
        reason="time before an event from which its signature counts",
        origin="judgement: the smoothing of the drives reaches back",
    )
    least_distance: float = setting(
        1.0, unit="s", above=0.0, reason="least time between two events", origin="judgement"
    )
    least_gain: float = setting(
        25.0,
        unit="chi-square",
        least=0.0,
        reason="gain from which an event counts",
        origin="judgement; docs/decisions/0020",
    )
    least_share: float = setting(
        0.03,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of what the recording's residual is from which an event counts",
        origin="judgement; docs/decisions/0020",
    )
    time_scale: float = setting(
        0.2, unit="s", above=0.0, reason="scale of an event's time in a fit", origin="judgement"
    )
    duration_scale: float = setting(
        0.4, unit="s", above=0.0, reason="scale of its duration", origin="judgement"
    )
    rise_scale: float = setting(
        0.2, unit="s", above=0.0, reason="scale of the time of its edges", origin="judgement"
    )
    most_lines: int = setting(
        5,
        unit="count",
        least=1,
        reason="lines of the residual's spectrum at which a vibration is looked for",
        origin="judgement: two that shake, and what the drive itself leaves",
    )
    frequency_scale: float = setting(
        0.01, unit="Hz", above=0.0, reason="scale of a frequency in a fit", origin="judgement"
    )
    least_duration: float = setting(
        0.05, unit="s", above=0.0, reason="shortest duration of an event", origin="judgement"
    )
    most_duration: float = setting(
        5.0, unit="s", above=0.0, reason="longest duration of an event", origin="judgement"
    )
    least_rise: float = setting(
        0.02, unit="s", above=0.0, reason="shortest edge of an event", origin="judgement: a blow"
    )
    most_rise: float = setting(
        2.0, unit="s", above=0.0, reason="longest edge of an event", origin="judgement: a hand"
    )
    most_size: float = setting(
        1e3,
        unit="SI",
        above=0.0,
        reason="largest size of an event that a fit may reach",
        origin="judgement",
    )
    evaluations_alone: int = setting(
        8,
        unit="count",
        least=1,
        reason="evaluations of the fit of one recording's events at the most",
        origin="judgement",
    )
    evaluations_together: int = setting(
        12,
        unit="count",
        least=1,
        reason="the same of baseline and events of all recordings",
        origin="judgement",
    )
    evaluations_beside: int = setting(
        6,
        unit="count",
        least=1,
        reason="the same of persistent effects beside events that are held",
        origin="judgement",
    )


@dataclass(frozen=True)
class ScreenSettings(SettingsGroup):
    """How effects are scored before any is fitted."""

    most_size: float = setting(
        8.0,
        unit="typical sizes",
        above=0.0,
        reason="largest size at which a linear gain is relied on",
        origin="judgement; docs/decisions/0013",
    )
    least_size: float = setting(
        0.002,
        unit="typical sizes",
        above=0.0,
        reason=(
            "smallest size from which a fit starts: a compressor's delivery may be 500 times "
            "smaller than typical"
        ),
        origin="docs/decisions/0020",
    )
    repeat_below: float = setting(
        0.3,
        unit="sizes tried",
        least=0.0,
        reason="size below which (and from most_size) the signature is taken again there",
        origin="judgement",
    )
    most_signatures: int = setting(
        3,
        unit="count",
        least=1,
        reason="signatures of one start at the most, each at the size that the last one suggested",
        origin="judgement",
    )
    strong_sizes: tuple[float, ...] = setting(
        (0.05, 0.3, 4.0, 20.0),
        unit="typical sizes",
        above=0.0,
        reason="sizes at which each start is looked at beside a strong mismatch",
        origin="docs/decisions/0013",
    )
    invisible: float = setting(
        1e-6,
        unit="noise levels^2",
        least=0.0,
        reason="squared length below which a signature is none",
        origin="judgement: rounding",
    )
    threshold_levels: int = setting(
        6,
        unit="count",
        least=2,
        reason="levels of a channel that are tried for the thresholds of a switch",
        origin="judgement",
    )
    threshold_precision: float = setting(
        5e-3,
        unit="1",
        above=0.0,
        most=1.0,
        reason="share of the channel's range to which they are narrowed down",
        origin="judgement",
    )
    place_shares: tuple[float, ...] = setting(
        (0.5, 0.75, 0.93),
        unit="1",
        least=0.0,
        most=1.0,
        reason=(
            "quantiles of a channel at which a place of contact is tried; one that is met from "
            "above at the others"
        ),
        origin="judgement",
    )
    opening_shares: tuple[float, ...] = setting(
        (0.6, 3.0),
        unit="1",
        above=0.0,
        reason="parts of a valve's largest opening at which a restriction beside it is tried",
        origin="judgement",
    )
    resamples: int = setting(
        200,
        unit="count",
        least=1,
        reason="resamples of the recordings that say how often the screen would take an effect",
        origin="judgement: a share within 4 %",
    )
    resample_time: float = setting(
        2.5,
        unit="s",
        above=0.0,
        reason="length of the segments that are drawn: longer than the residual remembers",
        origin="Kuensch (1989)",
    )


@dataclass(frozen=True)
class ClosureSettings(SettingsGroup):
    """How a form of what has no name is looked for."""

    from_probability: float = setting(
        0.3,
        unit="1",
        least=0.0,
        most=1.0,
        reason="probability of unlisted from which a form is looked for",
        origin="judgement; docs/decisions/0004",
    )
    most_share_left: float = setting(
        0.8,
        unit="1",
        least=0.0,
        reason=(
            "share of the mismatch that it may leave, held-out recordings included: what does not "
            "carry over is no form of anything"
        ),
        origin="judgement",
    )
    most_misfit_share: float = setting(
        0.75,
        unit="1",
        above=0.0,
        reason=(
            "share of the misfit that it may leave: with less gain it mends what the smoothing of "
            "the drives does"
        ),
        origin="judgement",
    )
    most_terms: int = setting(
        6,
        unit="count",
        least=1,
        reason="terms that it may have: more is no form that a person reads",
        origin="judgement",
    )
    least_power: float = setting(
        1e-6,
        unit="1",
        above=0.0,
        reason=(
            "share of a term's effect on the residuals that must be left beside the baseline and "
            "the terms before it"
        ),
        origin="judgement: rounding",
    )
    evaluations: int = setting(
        5,
        unit="count",
        least=1,
        reason="evaluations of the fit of the chosen terms at the most",
        origin="judgement",
    )
    shrunk_share: float = setting(
        0.4,
        unit="1",
        above=0.0,
        most=1.0,
        reason=(
            "share of the linear estimate from which the fit is tried where the whole of it gains "
            "nothing"
        ),
        origin="judgement",
    )
    shrunk_evaluations: int = setting(
        3, unit="count", least=1, reason="evaluations of that fit at the most", origin="judgement"
    )
    spoken_share: float = setting(
        0.05,
        unit="1",
        least=0.0,
        reason="share of the form from which a kind of dependence is put into words",
        origin="judgement",
    )
