"""Settings of the first steps: recordings made ready, what they cannot be, noise levels."""

from __future__ import annotations

from dataclasses import dataclass

from pamrs.diagnosis.settings._setting import SettingsGroup, setting

__all__ = ["NoiseSettings", "OverlapSettings", "PlausibilitySettings", "PrepareSettings"]


@dataclass(frozen=True)
class PrepareSettings(SettingsGroup):
    """How recordings are made ready for the cut chain."""

    own_steps: int = setting(
        12,
        unit="1",
        least=1,
        reason="steps in which a value is found that a recording has of its own; each moves it to "
        "three times at the most",
        origin="judgement: three orders of magnitude and a few steps to settle",
    )
    own_apart: float = setting(
        1.5,
        unit="1",
        least=1.0,
        reason="ratio of such values between recordings from which it is said",
        origin="judgement",
    )
    smoothing_time: float = setting(
        0.06,
        unit="s",
        above=0.0,
        reason="length of the filter (local cubics) for measured signals that drive a block, at "
        "least seven samples: longer smears steps, shorter leaves noise in the slopes",
        origin="docs/decisions/0022; judgement for recordings of 200 Hz",
    )
    smoothing_odds: float = setting(
        1e-3,
        unit="1",
        above=0.0,
        most=0.5,
        reason="chance by which noise alone makes that filter shorter at a sample: a cubic has to "
        "miss more than that to be a corner",
        origin="docs/decisions/0022",
    )
    spectrum_samples: int = setting(
        64,
        unit="count",
        least=32,
        reason="samples of each spectrum in which a band that is quieter than the noise is looked "
        "for",
        origin="docs/decisions/0022",
    )
    least_new_share: float = setting(
        0.5,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of a thermometer's samples that neither repeat nor lie on a line between "
        "others, from which it is as fast as the log",
        origin="judgement; docs/decisions/0003",
    )
    least_spectra: int = setting(
        16,
        unit="count",
        least=1,
        reason="spectra without a sample that was left out, from which bands are compared",
        origin="docs/decisions/0022",
    )
    quiet_share: float = setting(
        0.25,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of the variance of third differences below which the quietest band is the "
        "noise",
        origin="half the level; the quietest of seven bands of 600 samples of white noise had 0.38 "
        "of its variance or more in a thousand draws (docs/decisions/0022)",
    )
    start_reaches: tuple[float, ...] = setting(
        (0.04, 0.08, 0.16),
        unit="s",
        above=0.0,
        reason="stretches on either side of a window's start from which its value and slope are "
        "estimated; the longest is taken that a cubic still fits",
        origin="docs/decisions/0022",
    )
    start_misfit: float = setting(
        1.1,
        unit="1",
        above=0.0,
        reason="variance over that of the noise up to which a cubic fits such a stretch",
        origin="docs/decisions/0022",
    )
    start_first_stds: float = setting(
        2.0,
        unit="1",
        least=0.0,
        reason=(
            "standard deviations of that variance that are allowed beside it for the shortest "
            "stretch"
        ),
        origin="docs/decisions/0022",
    )
    start_longer_stds: float = setting(
        1.5,
        unit="1",
        least=0.0,
        reason="the same for longer stretches",
        origin="docs/decisions/0022",
    )
    start_slope_stds: float = setting(
        2.0,
        unit="1",
        least=0.0,
        reason=(
            "standard deviations by which the slopes of a shorter and a longer stretch may differ"
        ),
        origin="Lepski (1991), docs/decisions/0022",
    )
    start_least_samples: int = setting(
        8,
        unit="count",
        least=5,
        reason="fewest samples of a stretch: a cubic takes four",
        origin="judgement",
    )
    begun_temperature_error: float = setting(
        5.0,
        unit="K",
        above=0.0,
        reason="error of the temperature at which a thermometer says that a gas begins: windows of "
        "the pressure in which so much would be seen are freed of it; and how far from that of the "
        "room one without a thermometer has to begin before it is taken not to have been at rest",
        origin="judgement: a thermocouple is off by two kelvins, and late (docs/decisions/0003)",
    )
    begun_steps: int = setting(
        6,
        unit="count",
        least=1,
        reason="steps by which the temperature is found at which a gas begins that is not at rest",
        origin="judgement: Newton's, of one number",
    )
    bridged_samples: int = setting(
        3,
        unit="count",
        least=0,
        reason="longest hole in a driving signal that is bridged by a line",
        origin="judgement",
    )
    rounded_still: float = setting(
        0.03,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of samples equal to the one before them from which on the distance of a "
        "channel's numbers is a converter's step",
        origin="triangles of a load frame at 20 Hz, 0.4 mm from sample to sample: 1 % are equal, "
        "at the corners, and 0.12 mm of noise was read off them",
    )
    rounded_share: float = setting(
        0.5,
        unit="1",
        least=0.0,
        reason="noise of a channel, in steps of its converter, below which its rounding is not "
        "white: it stays the same for as long as the channel stays on a step",
        origin="a dither of half a step makes rounding white to a few per cent",
    )
    least_samples: int = setting(
        12,
        unit="count",
        least=8,
        reason="fewest samples of a recording that can be diagnosed: noise takes eleven of them",
        origin="judgement: a leak is seen in sixteen samples of a shut chamber",
    )
    ample_samples: int = setting(
        1000,
        unit="count",
        least=32,
        reason="samples that a recording keeps at least where it is averaged to the sample time "
        "that the fastest block needs: a short one is used as it is",
        origin="judgement: ten seconds of what is needed",
    )
    most_samples: int = setting(
        500_000,
        unit="count",
        least=32,
        reason="samples of a case, averaged where they can be, that are diagnosed at all",
        origin="docs/decisions/0057: some five minutes",
    )
    needed_sample_time: float = setting(
        0.01,
        unit="s",
        above=0.0,
        reason="sample time that tanks, fed chambers, joints and loads need",
        origin="docs/decisions/0057: the same verdicts as with every sample of 500 and 1000 Hz",
    )
    needed_sealed_sample_time: float = setting(
        0.1,
        unit="s",
        above=0.0,
        reason="the same where every block is a sealed chamber, whose pressure hardly moves",
        origin="judgement: the recordings of printed chambers",
    )
    least_channel_samples: int = setting(
        11,
        unit="count",
        least=8,
        reason="fewest usable samples of a channel",
        origin="judgement",
    )
    least_channel_share: float = setting(
        0.2,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of a channel's samples that must be usable",
        origin="judgement",
    )
    least_block_share: float = setting(
        0.2,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of usable samples below which a block is left out of the diagnosis",
        origin="judgement",
    )
    regulator_droop_shift: float = setting(
        3.0,
        unit="standard deviations",
        above=0.0,
        reason=(
            "how far the noise of two measured pressures may move a regulator's droop before its "
            "block is left out"
        ),
        origin="judgement",
    )
    outlet_noises: float = setting(
        0.3,
        unit="noise levels",
        above=0.0,
        reason="how far the beginning of a regulator without a gauge, at the pressure of what it "
        "feeds or at what it is set to, may move a sample that is judged; less than the noise, "
        "since all samples of a beginning move the same way; the same of a tube of segments, "
        "at rest or with a flow before",
        origin="docs/decisions/0092",
    )
    flow_delays: float = setting(
        20.0,
        unit="delays of the tube",
        above=0.0,
        reason="how long air flows through a tube of segments before a recording where it is taken "
        "not to have been at rest: until the flow is steady",
        origin="judgement",
    )
    moving_delays: float = setting(
        0.5,
        unit="delays of the tube",
        least=0.0,
        reason="how long of these the pressures at its ends have moved as they begin to move in "
        "the recording: a flow swings on while they are equal",
        origin="docs/decisions/0109: 2.8 noises were left without",
    )
    most_moved: float = setting(
        2e4,
        unit="Pa",
        least=0.0,
        reason="how far a pressure is followed back to before a recording: a rate at its edge is "
        "uncertain",
        origin="judgement",
    )
    silent_delays: float = setting(
        0.6,
        unit="delays of the tube",
        above=0.0,
        reason="how long its ends hear nothing of each other: a front is smeared over segments",
        origin="docs/decisions/0109",
    )
    still_delays: float = setting(
        4.0,
        unit="delays of the tube",
        above=0.0,
        reason="how long its ends are looked at for whether they stand still",
        origin="judgement",
    )
    still_noises: float = setting(
        10.0,
        unit="noise levels",
        above=0.0,
        reason="how far a flow before a recording may move a sample where the ends of a tube of "
        "segments are not seen to move: next to equal pressures little friction holds it, and the "
        "noise of the gauges alone makes so much of it",
        origin="docs/decisions/0109: 3 to 6 at rest, 65 and more in a flow",
    )
    still_deviations: float = setting(
        3.0,
        unit="standard deviations",
        above=0.0,
        reason="trend of a pressure that is seen as its recording begins",
        origin="judgement",
    )
    rest_likelihood: float = setting(
        1000.0,
        unit="1",
        above=1.0,
        reason="how much more likely a tube at rest makes the first samples at each of its ends "
        "than a flow, where it is opened as the recording begins",
        origin="docs/decisions/0109: e^75 and more there, up to e^5 where a swing turns",
    )
    arm_window: float = setting(
        2.5,
        unit="s",
        above=0.0,
        reason="length of a joint's windows: what its start does has faded within one, and a "
        "break-away that is predicted wrongly spoils no more; windows of 5 s left 84 times the "
        "noise level in slow motion with stiction",
        origin="docs/decisions/0014",
    )
    supply_window: float = setting(
        4.0, unit="s", above=0.0, reason="the same for a tank or a regulator", origin="judgement"
    )
    chamber_window: float = setting(
        2.0,
        unit="s",
        above=0.0,
        reason="the same for a chamber that is fed; a sealed one is one window",
        origin="judgement",
    )
    window_samples_per_state: int = setting(
        4,
        unit="count",
        least=1,
        reason=(
            "usable samples of a window for each state whose start is projected out; a window with "
            "fewer is not used"
        ),
        origin="judgement",
    )
    arm_step: float = setting(
        5e-3,
        unit="s",
        above=0.0,
        reason="longest integration step of joints and loads between measured pressures",
        origin="docs/decisions/0057: the error is 0.03 noises, 0.17 at the strongest friction",
    )
    gas_step: float = setting(
        1e-2,
        unit="s",
        above=0.0,
        reason="the same for tanks and chambers; the core divides it until it is stable",
        origin="docs/decisions/0057: the error is 0.003 noises",
    )
    sealed_step: float = setting(
        0.025,
        unit="s",
        above=0.0,
        reason="the same for a sealed chamber, whose pressure hardly moves",
        origin="judgement: the error is below the noise level (docs/convergence.md)",
    )


@dataclass(frozen=True)
class OverlapSettings(SettingsGroup):
    """When two recordings hold the same samples, so that one proves nothing of the other."""

    least_peak: float = setting(
        6.5,
        unit="1",
        above=0.0,
        reason="correlation of two recordings' noise at one lag, in standard deviations of chance, "
        "from which it is the same: repetitions reach 5.3 over all lags, a copy under five times "
        "its noise 9.2",
        origin="docs/decisions/0111",
    )
    least_correlation: float = setting(
        0.2,
        unit="1",
        least=0.0,
        most=1.0,
        reason="that correlation itself where windows are not told apart: corners of a command a "
        "quarter of a second apart leave 0.15 in signals of a noise of 20 Pa, a copy under three "
        "times its noise 0.3",
        origin="docs/decisions/0111",
    )
    peak_ratio: float = setting(
        1.5,
        unit="1",
        least=1.0,
        reason="that correlation over the largest at other lags: what repeats with a command has "
        "its like a period away, noise has none",
        origin="docs/decisions/0111",
    )
    follow_share: float = setting(
        0.5,
        unit="1",
        above=0.0,
        most=1.0,
        reason="correlation of a window's noise with what the other recording tells of it from "
        "which the window is shared: 1 for a copy, 0.1 by chance",
        origin="judgement",
    )
    clear_share: float = setting(
        0.75,
        unit="1",
        above=0.0,
        most=1.0,
        reason="the same of most windows that are shared, below which noise of its own covers the "
        "copy and windows are not told apart: it is shared wherever the two meet",
        origin="judgement",
    )
    chance_share: float = setting(
        4.5,
        unit="1",
        above=0.0,
        reason="the same in standard deviations of chance, of windows with few samples",
        origin="judgement: some 1e-5 for a window",
    )
    coarse_step: float = setting(
        2.2,
        unit="1",
        above=0.0,
        reason="step of a converter over the noise, rounding included, from which its steps lie in "
        "the same samples of a repetition: two and a half times the noise before it",
        origin="docs/decisions/0111",
    )
    step_noises: float = setting(
        3.5,
        unit="1",
        above=1.0,
        reason="noise levels beyond which a sample is a step of the signal, which repeats",
        origin="judgement: one sample in two thousand by chance",
    )
    least_flips: float = setting(
        12.0,
        unit="count",
        above=0.0,
        reason="flips of a converter, each between two others that go back within four samples, "
        "from which two recordings are compared by them",
        origin="judgement: none of twelve in other samples has a chance of 1e-5",
    )
    flip_share: float = setting(
        0.35,
        unit="1",
        above=0.0,
        reason="samples in which two recordings are on different steps, over their flips, below "
        "which they are the same: 0 for a copy, 1 or more for a repetition",
        origin="docs/decisions/0111",
    )
    clock: float = setting(
        0.05,
        unit="1",
        above=0.0,
        most=0.4,
        reason="share by which the clock of a copy may go faster or slower",
        origin="judgement",
    )
    rate_blocks: int = setting(
        3, unit="count", least=2, reason="blocks that say how it goes", origin="judgement"
    )
    most_searched: int = setting(
        16384,
        unit="count",
        least=1024,
        reason="samples of a recording in which those blocks lie, from its beginning",
        origin="judgement: seconds for a recording of a million samples",
    )
    phases: int = setting(
        12,
        unit="count",
        least=1,
        reason="offsets between the samples of two rates that are tried",
        origin="judgement",
    )
    between_error: float = setting(
        0.02,
        unit="1",
        above=0.0,
        reason="how well the time between the samples of two recordings is known, in sample "
        "times, for odd and even samples of one to be told",
        origin="judgement",
    )
    between_left: float = setting(
        1.6,
        unit="1",
        above=0.0,
        reason="what is left between two such recordings in a window, over what their noise leaves",
        origin="judgement: chance of some 1e-3 with ten windows",
    )
    least_alive: float = setting(
        0.2,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of a window's samples that have to say something: at rest on one step of a "
        "converter two recordings are equal by chance",
        origin="judgement",
    )
    window_samples: int = setting(
        64,
        unit="count",
        least=16,
        reason="samples of a window in which noise is compared",
        origin="judgement: the mean of so many differs by a tenth by chance",
    )
    least_samples: int = setting(
        192,
        unit="count",
        least=16,
        reason="samples that are shared at the least: three windows",
        origin="judgement",
    )
    copy_share: float = setting(
        0.5,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of a recording that is in another one of its role before it is left out",
        origin="judgement",
    )
    gap: float = setting(
        2.5,
        unit="s",
        least=0.0,
        reason="time between what is shared and what is kept of a held-out recording: within a "
        "joint's window what was there before has faded, noise and mismatch are no longer alike",
        origin="docs/decisions/0111",
    )
    least_left: float = setting(
        8.0,
        unit="s",
        above=0.0,
        reason="the least of a held-out recording that is kept as a proof where the rest is a "
        "copy: two of the longest windows; least_samples at the least",
        origin="docs/decisions/0111",
    )
    lags: int = setting(
        8, unit="count", least=1, reason="shifts in time that are looked at", origin="judgement"
    )
    most_rate_ratio: float = setting(
        50.0,
        unit="1",
        least=1.0,
        reason="ratio of sample times up to which recordings are compared",
        origin="judgement",
    )
    beside_samples: int = setting(
        4,
        unit="count",
        least=1,
        reason="neighbours on either side by which a sample is told without the other recording",
        origin="judgement",
    )
    block_samples: int = setting(
        256,
        unit="count",
        least=64,
        reason="samples of a block that is looked for in a recording whose clock goes otherwise",
        origin="judgement",
    )


@dataclass(frozen=True)
class PlausibilitySettings(SettingsGroup):
    """What recordings cannot be: wrong units, swapped columns, dead sensors."""

    least_pressure: float = setting(
        100.0,
        unit="Pa",
        above=0.0,
        reason="gauge pressure that a pressure channel exceeds somewhere, or it is in another unit",
        origin="judgement: bar under a heading in Pa stays below it",
    )
    least_gauge_pressure: float = setting(
        -1.1e5,
        unit="Pa",
        most=0.0,
        reason="gauge pressure below which a sample is no pressure: a vacuum is at -101 kPa",
        origin="judgement: with the error of a transducer",
    )
    most_pressure: float = setting(
        1e7,
        unit="Pa",
        above=0.0,
        reason="gauge pressure of air that no muscle sees",
        origin="judgement: Pa under a heading in bar is far above it",
    )
    most_rated_multiple: float = setting(
        5.0,
        unit="1",
        above=0.0,
        reason="multiple of the largest pressure of the rig file that is allowed above that",
        origin="judgement",
    )
    supply_least_share: float = setting(
        0.05,
        unit="1",
        least=0.0,
        reason="highest measured supply pressure over that of the rig file, at the least",
        origin="judgement",
    )
    supply_most_share: float = setting(
        5.0, unit="1", above=0.0, reason="the same at the most", origin="judgement"
    )
    order_margin: float = setting(
        0.05,
        unit="1",
        least=0.0,
        reason="share of the supply's pressure by which a muscle's may exceed it",
        origin="judgement: errors of two transducers",
    )
    order_offset: float = setting(
        1e4,
        unit="Pa",
        least=0.0,
        reason="pressure by which it may exceed it besides",
        origin="judgement: zeros of two transducers",
    )
    order_time_share: float = setting(
        0.5,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of the time for which it may exceed it by more",
        origin="judgement",
    )
    range_margin: float = setting(
        0.05,
        unit="1",
        least=0.0,
        reason="share of its range by which a joint or a load may leave it",
        origin="judgement",
    )
    least_angle_margin: float = setting(
        0.1, unit="rad", least=0.0, reason="the same of a joint, at the least", origin="judgement"
    )
    least_length_margin: float = setting(
        0.01, unit="m", least=0.0, reason="the same of a load, at the least", origin="judgement"
    )
    range_time_share: float = setting(
        0.2,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of the time for which it may leave its range by more",
        origin="judgement",
    )
    fastest_joint: float = setting(
        200.0,
        unit="rad/s",
        above=0.0,
        reason="rate of a joint that one sample in a hundred may exceed",
        origin="judgement: degrees under a heading in rad exceed it",
    )
    fastest_load: float = setting(
        20.0,
        unit="m/s",
        above=0.0,
        reason="speed of a load that one sample in a hundred may exceed",
        origin="judgement",
    )
    longest_sample_time: float = setting(
        0.25,
        unit="s",
        above=0.0,
        reason="sample time at which the motion of a joint or load can still be followed",
        origin="judgement",
    )
    least_room: float = setting(
        250.0,
        unit="K",
        above=0.0,
        reason="ambient temperature below which a recording is none of a room",
        origin="judgement: a cold store; degC with an offset of a sensor are below it",
    )
    most_room: float = setting(
        330.0,
        unit="K",
        above=0.0,
        reason="ambient temperature above which a recording is none of a room",
        origin="judgement: beside an oven; degF under a heading in K are above it",
    )
    room_tolerances: float = setting(
        3.0,
        unit="tolerances",
        above=0.0,
        reason="distance of a measured ambient temperature from that of the rig file, where that "
        "states one, from which it may be another one",
        origin="judgement",
    )
    most_room_change: float = setting(
        15.0,
        unit="K",
        above=0.0,
        reason="the same at the most: an input that nothing is connected to reads 0 degC, 20 K "
        "below a usual room",
        origin="judgement",
    )
    most_room_spread: float = setting(
        3.0,
        unit="K",
        least=0.0,
        reason="difference between the ambient temperatures of recordings from which it is said "
        "that one is taken for all: one percent of the flow through a valve at the most",
        origin="judgement",
    )
    frozen_tank_change: float = setting(
        2e4,
        unit="Pa",
        above=0.0,
        reason=(
            "change of a muscle's pressure during which the tank that feeds it cannot read one and "
            "the same value"
        ),
        origin="judgement",
    )
    frozen_motion_share: float = setting(
        0.1,
        unit="1",
        above=0.0,
        reason=(
            "relative change of the muscles' pressure during which what they move cannot read one "
            "and the same value"
        ),
        origin="judgement",
    )
    opposed_share: float = setting(
        0.6,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of a chamber's change of pressure that may go against its valve's command",
        origin="judgement: motion and leaks move it against the command as well",
    )
    opposed_correlation: float = setting(
        -0.2,
        unit="1",
        least=-1.0,
        most=1.0,
        reason="correlation of command and change below which that counts",
        origin="judgement",
    )
    still_angle: float = setting(
        0.02,
        unit="rad",
        above=0.0,
        reason=(
            "change of a joint's angle up to which the muscles' volume hardly moves their pressure"
        ),
        origin="judgement",
    )
    still_length: float = setting(
        1e-3, unit="m", above=0.0, reason="the same of a load's length", origin="judgement"
    )
    command_span: float = setting(
        2.0,
        unit="half ranges",
        above=0.0,
        reason="distance of a command from its null beyond which it is another column or unit",
        origin="judgement",
    )
    lost_command_share: float = setting(
        0.1,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of the time that a logger may lose a valve's command for; more is how the "
        "controller is",
        origin="judgement",
    )
    dead_command_time: float = setting(
        0.5,
        unit="s",
        above=0.0,
        reason="how long a pressure stands still, and then takes for a change that a valve's "
        "command of one value cannot have made",
        origin="judgement: leaks are slower",
    )
    dead_command_still: float = setting(
        0.02,
        unit="1",
        above=0.0,
        reason="share of an absolute pressure by which it changes at most in that time to stand "
        "still",
        origin="judgement: beyond the noise of a gauge",
    )
    dead_command_ratio: float = setting(
        1.5,
        unit="1",
        least=1.0,
        reason="how far, as a ratio of absolute pressures, it may change then: what moves changes "
        "the volume of a muscle that is shut by less in that time",
        origin="judgement",
    )
    rail_samples: int = setting(
        3,
        unit="1",
        least=0,
        most=1000,
        reason="samples to both sides of one at the end of its sensor's range that are masked as "
        "well: near the end its noise is cut off on one side, which a model would follow",
        origin="judgement",
    )
    command_quantile: float = setting(
        0.995,
        unit="1",
        least=0.5,
        most=1.0,
        reason="quantile of a regulator's command that counts as its largest value; what is above "
        "are a logger's spikes",
        origin="judgement",
    )
    command_time_share: float = setting(
        0.5,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of the time for which a command may be beyond that",
        origin="judgement",
    )
    sense_time: float = setting(
        0.1,
        unit="s",
        above=0.0,
        reason="time over which a change of pressure is compared with the command",
        origin="judgement",
    )
    sense_least_change: float = setting(
        2e4,
        unit="Pa",
        above=0.0,
        reason="range of a muscle's pressure below which its sense is not tested",
        origin="judgement",
    )
    sense_least_noises: float = setting(
        3.0,
        unit="noise levels",
        above=0.0,
        reason="standard deviation of an angle below which its unit and sign are not tested",
        origin="judgement",
    )
    sense_wrong: float = setting(
        1.0,
        unit="standard deviations",
        above=0.0,
        reason="misfit of an angle as recorded from which its unit or sign may be wrong",
        origin="judgement",
    )
    sense_right: float = setting(
        0.4,
        unit="standard deviations",
        above=0.0,
        reason="misfit in another unit or sign below which that is the right one",
        origin="judgement",
    )


@dataclass(frozen=True)
class NoiseSettings(SettingsGroup):
    """When a residual is more than noise."""

    bin_time: float = setting(
        0.1,
        unit="s",
        above=0.0,
        reason="width of the bins over which residuals are averaged before they are compared with "
        "the noise level: what is missing is slower than that",
        origin="judgement, docs/decisions/0014",
    )
    least_bin_samples: int = setting(
        5, unit="count", least=1, reason="fewest samples of such a bin", origin="judgement"
    )
    piece_time: float = setting(
        5.0,
        unit="s",
        above=0.0,
        reason="length of the pieces of a recording that count as looks of their own: longer than "
        "residuals of a wrong model stay alike",
        origin="judgement: windows of the arm last 2.5 s, of gases longer",
    )
    fit_bin_time: float = setting(
        0.02,
        unit="s",
        above=0.0,
        reason="width of the bins over which residuals are averaged for fits",
        origin="judgement: faster than any effect of the catalogue shows",
    )
    replicates: int = setting(
        10,
        unit="count",
        least=2,
        reason="realisations of the sensors' noise that give a noise level and its scatter",
        origin="docs/decisions/0022",
    )
    margin: float = setting(
        1.1,
        unit="1",
        least=1.0,
        reason=(
            "factor by which the variance must exceed its noise level before it counts: noise "
            "levels are estimates"
        ),
        origin="docs/decisions/0022, 55 healthy cases",
    )
    chance: float = setting(
        0.005,
        unit="1",
        above=0.0,
        most=0.5,
        reason="chance of noise exceeding the limit of a block that is accepted: one in 200",
        origin="docs/decisions/0022",
    )
    most_limit: float = setting(
        2.5,
        unit="1",
        least=1.0,
        reason=(
            "variance over that of the noise which is a mismatch however much the noise level "
            "scatters"
        ),
        origin="docs/decisions/0022",
    )
    stated_freedom: float = setting(
        4.0,
        unit="1",
        above=0.0,
        reason="independent numbers that a stated error of the model consists of: its square "
        "scatters as that of as many",
        origin="judgement: bumps of a force curve or of an encoder over a stroke",
    )
    curve_waves: int = setting(
        16,
        unit="count",
        least=1,
        reason="waves of the same variance of which the error that a rig file states consists: a "
        "shift, and one to fifteen half periods over what was visited",
        origin="docs/decisions/0095",
    )
    curve_rest: float = setting(
        0.02,
        unit="1",
        least=0.0,
        most=1.0,
        reason="share of the variance of that error which no such curve tells: a real error is "
        "not exactly a curve over one measured value",
        origin="docs/decisions/0095",
    )
    most_log_limit: float = setting(
        1.0,
        unit="1",
        least=0.0,
        reason="largest logarithm of what the scatter adds to the margin",
        origin="judgement",
    )
    correlated_variance: float = setting(
        2.0,
        unit="1",
        least=1.0,
        reason="variance times autocorrelation time of a fit's residuals, relative to white noise, "
        "from which the fit is repeated with these as weights",
        origin="docs/decisions/0020",
    )
