"""What is not physics does not look like it: where windows start from, what noise leaves, how far
it scatters.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t

import pamrs
from pamrs.diagnosis.evidence import FittedHypothesis, Prior, posterior, significant
from pamrs.diagnosis.fit import Problem, residuals
from pamrs.diagnosis.noise import Excess, excess, noise_levels
from pamrs.diagnosis.prepare import (
    Prepared,
    _signals,
    available_blocks,
    noise_level,
    prepare,
    signals_at_starts,
)
from pamrs.simulation import core_rig
from tests.diagnosis.asked import SETTINGS, blocks_of
from tests.diagnosis.likelihoods import made_up
from tests.diagnosis.noisy import noisy
from tests.diagnosis.terms import by_text

DT, ROWS = 0.005, 1600
NOISE = {
    "valve_command": 0.0,
    "supply_pressure": 300.0,
    "muscle_pressure": 300.0,
    "joint_angle": 4e-4,
}
RIG = pamrs.rigs.shoulder()


def recorded(seed: int, angle: np.ndarray | None = None) -> Prepared:
    """The nominal arm driven slowly from where it stands, with noise; or with another angle in its
    place.
    """
    time = DT * np.arange(ROWS)
    run = pamrs.simulate(RIG, 5.0 + 0.1 * np.sin(0.5 * time) ** 2, sample_time=DT)
    channels = {n: run[n] for n in NOISE}
    if angle is not None:
        channels["joint_angle"] = angle
    return prepare(noisy(f"slow{seed}", "fit", DT, channels, NOISE, [seed]), RIG, SETTINGS)


def slopes_at_first(path: np.ndarray) -> tuple[float, float]:
    """Root mean square, over twelve seeds, of the speed at the first sample [rad/s]: that of the
    filter, and that of a window that starts there.
    """
    errors = []
    for seed in range(12):
        prepared = recorded(seed, path)
        errors.append(
            (prepared.signals["joint_angle"][1][0], prepared.with_starts("joint_angle", [0])[1][0])
        )
    filtered, begun = np.sqrt(np.mean(np.square(errors), axis=0))
    return float(filtered), float(begun)


def test_a_joint_at_rest_is_not_thrown_off() -> None:
    later = np.clip(DT * np.arange(ROWS) - 0.5 * DT * ROWS, 0.0, None)
    filtered, begun = slopes_at_first(0.7 + 0.2 * np.sin(2.0 * later))
    assert begun < 0.3 * filtered
    assert begun < 0.02  # rad/s, which friction stops at once


def test_a_joint_that_never_moves_begins_with_the_cubic_through_all_of_it() -> None:
    filtered, begun = slopes_at_first(np.full(ROWS, 0.7))
    assert begun == filtered < 1e-3


@pytest.mark.parametrize("at", [0, 400, ROWS - 1])
def test_a_start_in_smooth_motion_is_that_of_the_motion(at: int) -> None:
    time = DT * np.arange(ROWS)
    prepared = recorded(3, 0.8 + 0.4 * np.sin(2.0 * time))
    value, slope = (array[at] for array in prepared.with_starts("joint_angle", [at]))
    assert value == pytest.approx(0.8 + 0.4 * np.sin(2.0 * time[at]), abs=5e-4)
    assert slope == pytest.approx(0.8 * np.cos(2.0 * time[at]), abs=0.03)
    others = np.arange(ROWS) != at
    np.testing.assert_array_equal(
        prepared.with_starts("joint_angle", [at])[0][others],
        prepared.signals["joint_angle"][0][others],
    )


def test_a_start_that_no_cubic_fits_is_the_filters() -> None:
    time = DT * np.arange(ROWS)
    prepared = recorded(4, 0.8 + 0.2 * np.sign(np.sin(60.0 * time)))
    assert (
        prepared.with_starts("joint_angle", [500])[1][500]
        == prepared.signals["joint_angle"][1][500]
    )


def test_what_lies_beyond_a_hole_is_not_asked() -> None:
    time = DT * np.arange(ROWS)
    angle = np.where(time < 3.2, 0.5, 0.9 + 0.2 * (time - 3.2))
    prepared = recorded(5, angle)
    prepared.recording.mask["joint_angle"][625:640] = False
    value, slope = (array[640] for array in prepared.with_starts("joint_angle", [640]))
    assert value == pytest.approx(angle[640], abs=5e-4)
    assert slope == pytest.approx(0.2, abs=0.02)


def test_noise_stays_inside_its_limit_and_the_scatter_is_that_of_the_noise() -> None:
    core = core_rig(RIG)
    blocks = available_blocks(RIG, tuple(NOISE))
    problem = Problem(blocks, [recorded(seed) for seed in range(12)], core, SETTINGS)
    noise_level, found = noise_levels(problem, core), residuals(problem, RIG)
    for block in blocks:
        each = [excess(block, [p], found, noise_level, SETTINGS) for p in problem.recordings]
        together = excess(block, problem.recordings, found, noise_level, SETTINGS)
        assert not significant(together)
        assert 0.8 < together.ratio < 1.2
        assert sum(significant(e) for e in each) <= 1
        scatter = float(np.std([e.ratio for e in each]))
        assert 0.4 * scatter < float(np.mean([e.scatter for e in each])) < 2.5 * scatter
        assert together.limit < min(e.limit for e in each)


@pytest.mark.parametrize("scatter", [0.05, 0.4, 1.5])
def test_noise_exceeds_its_limit_as_seldom_however_it_scatters(scatter: float) -> None:
    core, one = core_rig(RIG), recorded(1)
    problem = Problem(available_blocks(RIG, tuple(NOISE)), [one], core, SETTINGS)
    found, levels = residuals(problem, RIG), noise_levels(problem, core)
    levels = {key: replace(level, scatter=scatter) for key, level in levels.items()}
    for block in problem.blocks:
        told = excess(block, [one], found, levels, SETTINGS)
        seldom = t(SETTINGS.noise_replicates - 1).sf(
            np.log(told.limit / SETTINGS.noise_margin) / told.scatter
        )
        assert seldom == pytest.approx(SETTINGS.noise_chance)


def named(effect: str, ratio: float, scatter: float = 0.05, **values: float) -> FittedHypothesis:
    """An effect, or none, that leaves so many times the noise level."""
    left = {"arm": Excess(ratio, 0.0, 0.5, 1.0, 1.0, 1.1 * np.exp(2.6 * scatter), scatter)}
    named = {f"{effect}.{name}": value for name, value in values.items()}
    return made_up(RIG, effect, left, named)


def weighed(*given: FittedHypothesis) -> dict[str, float]:
    """Probabilities by the text of each hypothesis of the arm."""
    arm = [blocks_of(RIG, NOISE)["arm"]]
    return by_text(posterior(given, arm, Prior(0.985, 30.0, SETTINGS)))


def test_of_a_mismatch_near_the_noise_the_noise_says_how_much_may_be_left() -> None:
    odds = weighed(named("", 1.4), named("leak_muscle", 1.0), named("supply_leak", 1.25))
    assert odds["leak_muscle"] > 20.0 * odds["supply_leak"]


def test_what_is_still_more_than_noise_is_not_explained() -> None:
    def chances(before: float, left: float) -> dict[str, float]:
        return weighed(named("", before), named("leak_muscle", left))

    assert chances(1.4, 1.27)["leak_muscle"] < 0.5
    assert chances(1.4, 1.1)["leak_muscle"] > 0.7
    assert chances(2.0, 1.7)["unlisted"] > 0.5
    assert 0.4 < chances(2.0, 1.5)["leak_muscle"] < 0.6
    # a noise level that was taken too low is the more probable cause of hardly anything
    assert chances(1.1, 1.05)[""] > 0.7


def test_every_joint_of_an_arm_starts_where_it_was() -> None:
    rig = pamrs.rigs.two_joint_arm()
    channels = {
        n: np.zeros(ROWS)
        for n in core_rig(rig).channels
        if n.startswith(("joint_angle", "muscle_pressure", "supply_pressure"))
    }
    channels |= {n: np.full(ROWS, 5.0) for n in core_rig(rig).inputs}
    noise = {n: 4e-4 if n.startswith("joint") else 100.0 for n in channels}
    prepared = prepare(noisy("rest", "fit", DT, channels, noise, [0]), rig, SETTINGS)
    arms = [b for b in available_blocks(rig, tuple(channels)) if b.kind == "arm"]
    assert len(arms) == 2
    for block in arms:
        given = signals_at_starts(block, prepared, [0])
        for joint in (b.channel for b in arms):
            assert abs(given[joint][1][0]) <= abs(prepared.signals[joint][1][0]) < 0.012


@pytest.mark.parametrize("steps", [0.3, 0.45, 0.7, 1.05, 2.1, 5.0])
def test_the_noise_of_a_quantised_channel_is_that_of_noise_and_lattice(steps: float) -> None:
    for seed in range(4):
        rng = np.random.default_rng(seed)
        values = np.round(rng.normal(0.0, steps, 20000) + 30.0 * np.sin(np.arange(20000) / 900.0))
        found = noise_level(values, np.ones(20000, dtype=bool), seed=SETTINGS.seed)
        assert found == pytest.approx(np.hypot(steps, 12.0**-0.5), rel=0.1)


def test_a_sound_gauge_has_the_noise_of_its_third_differences(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The quietest band of few samples is quieter than the others, and far from telling."""

    def level(share: float) -> float:
        monkeypatch.setattr(_signals, "_BAND_SHARE", share)
        return noise_level(values, usable, seed=SETTINGS.seed)

    usual = _signals._BAND_SHARE
    for seed in range(40):
        values = np.random.default_rng(seed).normal(0.0, 1.0, 600)
        usable = np.ones(600, dtype=bool)
        found, high, low = level(usual), level(0.0), level(1.0)
        assert found == high
        assert low < high


@pytest.mark.parametrize("samples", [12, 40, 63, 64])
def test_few_samples_have_a_noise_too(samples: int) -> None:
    values = np.random.default_rng(1).normal(0.0, 1.0, samples)
    found = noise_level(values, np.ones(samples, dtype=bool), seed=SETTINGS.seed)
    assert 0.3 < found < 3.0


def test_a_value_that_nobody_has_published_costs_odds() -> None:
    start, rival = named("", 3.0), named("base_flexibility", 1.0, natural_frequency=7.0)
    for length, least, most in ((0.3, 0.5, 2.0), (0.005, 10.0, 60.0)):
        odds = weighed(start, rival, named("payload_swing", 1.0, length=length))
        assert least < odds["base_flexibility"] / odds["payload_swing"] < most


def test_what_relaxes_at_once_is_another_stiffness() -> None:
    """A time constant below its own standard deviation was not seen: the wrong value wins."""
    name, start = "muscle.modulus_scale", named("", 400.0)
    known = {"moved": {name: -10.0}, "scales": {name: 0.03}}
    value = made_up(RIG, name, named("", 1.02).fit_excess, {name: 0.7}, **known)
    creep = named("muscle_creep", 1.0, time_constant=2.0)

    def odds(std: float) -> dict[str, float]:
        told = replace(creep, fit=replace(creep.fit, std={"muscle_creep.time_constant": std}))
        return weighed(start, told, value)

    seen, unseen = odds(0.2), odds(3.0)
    assert seen["muscle_creep"] > 0.8
    assert unseen[name] > 0.8
