"""Settings of what follows a verdict: the next experiment, the plan before any data, warnings."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pamrs.diagnosis.settings._setting import SettingsGroup, setting

__all__ = ["NextExperimentSettings", "PlanSettings", "WarningSettings"]


@dataclass(frozen=True)
class NextExperimentSettings(SettingsGroup):
    """How the next experiment is chosen."""

    simulated_from: float = setting(
        0.03,
        unit="1",
        least=0.0,
        most=1.0,
        reason="probability from which a hypothesis of a diagnosis is simulated",
        origin="judgement",
    )
    least_probability: float = setting(
        0.01,
        unit="1",
        least=0.0,
        most=1.0,
        reason="probability below which a given hypothesis is not simulated",
        origin="judgement",
    )
    most_hypotheses: int = setting(
        6,
        unit="count",
        least=2,
        reason="hypotheses that are simulated, the most probable ones",
        origin="judgement: every pair is compared",
    )
    settled_entropy: float = setting(
        0.01,
        unit="bit",
        least=0.0,
        reason="uncertainty below which no experiment can add to the answer",
        origin="judgement",
    )
    effective_samples: float = setting(
        10.0,
        unit="1",
        above=0.0,
        reason="independent samples that a block's residual over one recording counts as: errors "
        "of a model are correlated, and thousands of samples do not know a thousandth of a noise",
        origin="judgement",
    )
    replicates: int = setting(
        4,
        unit="count",
        least=2,
        reason="realisations of the drives' noise that give the noise level of an experiment",
        origin="judgement: a noise level within a fifth weighs an experiment",
    )
    known_share: float = setting(
        0.5,
        unit="1",
        above=0.0,
        reason="relative standard deviation of an effect's parameter of which a model says none",
        origin="judgement",
    )
    resolution: float = setting(
        0.02,
        unit="bit",
        above=0.0,
        reason="difference of information that counts; below it the cheaper experiment is better",
        origin="judgement",
    )
    sensor_effort: float = setting(
        900.0,
        unit="s",
        least=0.0,
        reason="what one more sensor costs, as time",
        origin="judgement",
    )
    most_shown: int = setting(
        5, unit="count", least=1, reason="experiments in the ranking", origin="judgement"
    )
    hopeless_share: float = setting(
        0.1,
        unit="1",
        least=0.0,
        reason="share of the uncertainty below which the text suggests another sensor",
        origin="judgement",
    )
    pressure_noise: float = setting(
        200.0,
        unit="Pa",
        above=0.0,
        reason="sample noise of a pressure where no recording tells",
        origin="data sheet of a usual transducer of 0 to 14 bar on a 16-bit converter",
    )
    angle_noise: float = setting(
        math.radians(0.03),
        unit="rad",
        above=0.0,
        reason="the same of an angle",
        origin="data sheet of a usual Hall sensor",
    )
    length_noise: float = setting(
        3e-5,
        unit="m",
        above=0.0,
        reason="the same of a length",
        origin="data sheet of a usual linear transducer",
    )
    temperature_noise: float = setting(
        0.1,
        unit="K",
        above=0.0,
        reason="the same of the temperature of a gas",
        origin="data sheet of a usual thermocouple amplifier",
    )
    force_noise: float = setting(
        1.0,
        unit="N",
        above=0.0,
        reason="the same of a force",
        origin="data sheet of a usual load cell of 2 to 5 kN: 0.02 to 0.05 % of its range",
    )
    length_rate: float = setting(
        1.0 / 60.0,
        unit="m/s",
        above=0.0,
        reason="fastest change of the length on a load frame of which no recording shows a faster",
        origin="data sheets of electromechanical testing machines: 500 to 3000 mm/min",
    )
    pressure_rate: float = setting(
        2e5,
        unit="Pa/s",
        above=0.0,
        reason="fastest change of a pressure that a bench sets, of which no recording shows a "
        "faster",
        origin="judgement: a proportional regulator of 100 l/min fills 0.3 l by 5 bar/s",
    )
    rate_window: float = setting(
        0.3,
        unit="s",
        above=0.0,
        reason="time over which a rate of a recording is counted",
        origin="judgement: over it the noise of a length is a tenth of a mm/s",
    )
    least_stroke: float = setting(
        0.1,
        unit="1",
        above=0.0,
        most=0.5,
        reason="stroke of a load frame whose recordings hold the length, as a share of the "
        "muscle's length at rest",
        origin="judgement: well beyond the sliding before friction, well inside what muscles do",
    )
    worth_stroke: float = setting(
        0.01,
        unit="1",
        above=0.0,
        reason="least stroke of a load frame that is worth moving, as a share of the length",
        origin="judgement: a few times the sliding before friction",
    )
    pulling_share: float = setting(
        0.05,
        unit="1",
        least=0.0,
        most=0.5,
        reason="share of what a muscle pulls at its longest, or at its highest pressure, from "
        "which it is taken to pull: at less it may be slack",
        origin="judgement",
    )
    held_share: float = setting(
        0.7,
        unit="1",
        least=0.0,
        most=1.0,
        reason="where between its shortest and its longest length a load frame holds a muscle "
        "while pressures are moved",
        origin="judgement: near the longer end, where muscles pull from low pressures on",
    )
    filling_time: float = setting(
        3.0,
        unit="s",
        above=0.0,
        reason="time in which a muscle is filled and rests before a load frame moves",
        origin="judgement: 1 s to fill, the rest to settle",
    )
    sample_time: float = setting(
        0.005,
        unit="s",
        above=0.0,
        reason="sample time of an experiment where no recording tells",
        origin="judgement",
    )
    least_sample_time: float = setting(
        0.002, unit="s", above=0.0, reason="shortest sample time", origin="judgement"
    )
    most_sample_time: float = setting(
        0.01, unit="s", above=0.0, reason="longest sample time", origin="judgement"
    )
    sealed_sample_time: float = setting(
        0.1,
        unit="s",
        above=0.0,
        reason="sample time for a chamber without a valve, which changes slowly",
        origin="judgement",
    )
    least_sealed_sample_time: float = setting(
        0.05, unit="s", above=0.0, reason="shortest sample time of it", origin="judgement"
    )
    most_sealed_sample_time: float = setting(
        1.0, unit="s", above=0.0, reason="longest sample time of it", origin="judgement"
    )
    bandwidth: float = setting(
        15.0,
        unit="rad/s",
        above=0.0,
        reason="bandwidth of the pressure loop by which commands are found on the model",
        origin="judgement",
    )
    least_highest: float = setting(
        2e4,
        unit="Pa",
        above=0.0,
        reason="gauge pressure that experiments may reach of what was never recorded above it",
        origin="judgement: small beside any pressure that moves a muscle, large beside its noise",
    )
    ramp_time: float = setting(
        15.0,
        unit="s",
        above=0.0,
        reason="time in which the pressures of several chains rise, to find where joints move",
        origin="judgement: slow beside the lag of a muscle and its line",
    )
    multisine_frequencies: tuple[float, ...] = setting(
        (0.1, 0.23, 0.41, 0.73, 1.13, 1.9, 3.1),
        unit="Hz",
        above=0.0,
        reason="of a multisine, the lowest first",
        origin="judgement: from slow creep to the band of a joint of an arm",
    )
    frequency_ratio: float = setting(
        1.7,
        unit="1",
        least=1.0,
        reason="from one of these to the next, which the multisines of several chains share out",
        origin="a little less than the mean ratio of multisine_frequencies, 1.77",
    )
    most_blown_samples: int = setting(
        3000,
        unit="count",
        least=2,
        reason="samples of a pressure that blows over, which may take 1 s to 60 s",
        origin="judgement: 20 ms at most",
    )


@dataclass(frozen=True)
class PlanSettings(SettingsGroup):
    """When a plan calls an effect seen, and two effects apart."""

    seen: float = setting(
        3.0,
        unit="noise levels",
        above=0.0,
        reason="signature left, of the noise of a bin of 0.1 s, from which an effect is seen",
        origin="judgement",
    )
    suspect_from: float = setting(
        math.sqrt(0.45),
        unit="noise levels",
        above=0.0,
        reason="the same from which an arm, which scatters most, would be called suspect",
        origin="docs/decisions/0014: 1.45 times the variance of the noise",
    )
    same_cosine: float = setting(
        0.95,
        unit="1",
        least=0.0,
        most=1.0,
        reason="cosine of two signatures from which their effects are one",
        origin="judgement; isolability as in Ding (2013)",
    )
    apart: float = setting(
        1.0,
        unit="noise levels",
        least=0.0,
        reason="what must be left of an effect when another one explains all that it can",
        origin="judgement",
    )
    most_multiple: float = setting(
        1e4,
        unit="typical sizes",
        above=0.0,
        reason="largest size of an effect that is worth telling",
        origin="judgement",
    )
    most_halvings: int = setting(
        8,
        unit="count",
        least=1,
        reason="sizes that are tried, each half of the one before, until a rig can have it",
        origin="judgement: below a hundredth of its typical size an effect is another one",
    )


@dataclass(frozen=True)
class WarningSettings(SettingsGroup):
    """From where on the result carries a warning or a sentence; none of them moves a verdict."""

    far_alone: float = setting(
        5.0,
        unit="1",
        above=1.0,
        reason="how many times more than its block the whole rig misses of what is freed of a "
        "constant before that is said",
        origin="judgement",
    )
    off_noises: float = setting(
        5.0,
        unit="noise levels",
        above=0.0,
        reason="what the whole rig misses of a channel from its commands alone, beyond what is "
        "known of its values, from which nothing is settled",
        origin="judgement: several noise levels; a true model with its fitted values stays at one",
    )
    off_chance: float = setting(
        0.05,
        unit="1",
        above=0.0,
        most=1.0,
        reason="chance with which the values of the rig are farther, all together, from what is "
        "known of them than they may be to explain what the whole rig misses",
        origin="judgement",
    )
    off_late: float = setting(
        0.5,
        unit="samples",
        least=0.0,
        reason="standard deviation of when a command takes effect, within its sample",
        origin="judgement",
    )
    off_warm: float = setting(
        20.0,
        unit="K",
        above=0.0,
        reason="standard deviation of the temperature at which a gas with an energy balance begins "
        "where neither a thermometer nor a transient of its pressure tells it",
        origin="judgement: filled and vented in steps of seconds it is 4 to 28 K off the room's",
    )
    off_rows: int = setting(
        2000,
        unit="count",
        least=100,
        reason="samples of a channel by which what the whole rig misses is compared",
        origin="judgement: as many as tell a course of some seconds",
    )
    off_samples: int = setting(
        200_000,
        unit="count",
        least=1000,
        reason="samples of a log, from its beginning, by which it is asked whether what is known "
        "of the values explains what the whole rig misses: each value takes two runs",
        origin="judgement: some ten seconds; a million samples took a minute and more",
    )
    off_steps: int = setting(
        2,
        unit="1",
        least=1,
        reason="steps in which values as likely as that are looked for by which the whole rig "
        "misses less",
        origin="judgement",
    )
    missed_noises: float = setting(
        3.0,
        unit="noise levels",
        above=0.0,
        reason="error of a model with a name from which it is reported with a reservation",
        origin="judgement",
    )
    moved_tolerances: float = setting(
        2.0,
        unit="tolerances",
        above=0.0,
        reason="movement of a parameter beside an effect from which it is",
        origin="judgement",
    )
    spoiled: float = setting(
        1.2,
        unit="1",
        least=1.0,
        reason="error of a channel over that of the model before, from which it is reported",
        origin="judgement",
    )
    mended: float = setting(
        0.98,
        unit="1",
        above=0.0,
        reason="share of a channel's error from which a wrong value is not said to mend it",
        origin="judgement",
    )
    scatter: float = setting(
        0.35,
        unit="1",
        least=0.0,
        reason="relative scatter of an effect's size between recordings from which it is reported",
        origin="as evidence.scatter",
    )
    ambient_share: float = setting(
        0.01,
        unit="1",
        above=0.0,
        reason=(
            "share of the ambient pressure within which a recording that begins at it may hold "
            "absolute pressures"
        ),
        origin="judgement",
    )
    least_pressure: float = setting(
        1e4,
        unit="Pa",
        above=0.0,
        reason="gauge pressure that a channel never exceeds, below which its unit is questioned",
        origin="judgement",
    )
    no_mismatch_probability: float = setting(
        0.1,
        unit="1",
        least=0.0,
        most=1.0,
        reason="probability of no mismatch from which the text says that there may be none",
        origin="judgement",
    )
    telling_condition: float = setting(
        1.15,
        unit="1",
        least=1.0,
        reason="share of the excess over share of the time from which a condition is told",
        origin="judgement",
    )
