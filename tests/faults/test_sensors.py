"""What a sensor or the unit of its column does to a log, and what is to be said of it."""

from __future__ import annotations

import html
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.fit import Problem, fit
from pamrs.diagnosis.noise import excess, noise_levels
from pamrs.diagnosis.prepare import available_blocks, prepare, without_rails
from pamrs.diagnosis.search import find_misread
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.errors import DiagnosisError
from pamrs.recordings import Case, Recording
from pamrs.report import render_html
from pamrs.simulation import core_rig
from tests.diagnosis.kept import kept

HERE = Path(__file__).parent
ROOT = Path(pamrs.__file__).parent / "rigs"


def test_a_clipped_gauge_is_masked_in_all_recordings_and_said_first() -> None:
    """Each recording reaches 6 bar, where the gauge ends; in one of them it only touches that."""
    case = pamrs.load_case(HERE / "13_gauge_clipped")
    assert not any(recording.logged for recording in case.recordings)  # on their own grid
    short = case.recordings[0]
    assert short.channels["muscle_pressure"][short.mask["muscle_pressure"]].max() == 6e5

    found = pamrs.diagnose(case)
    assert found.verdict in ("none", "parameters")
    assert not found.effects
    (clipped,) = found.faulty
    assert (clipped.channel, clipped.kind) == ("muscle_pressure", "clipped")
    claim = "muscle_pressure is clipped: its sensor's range ends at 6 bar"
    assert clipped.text.startswith(claim)
    assert all(f" in {name}" in clipped.text for name in "abc")
    _says_first(found, claim)
    assert all(u.masked["muscle_pressure"] > 0.03 for u in found.data)


def test_what_a_recording_exceeds_is_no_end_of_its_sensor() -> None:
    case = pamrs.load_case(HERE / "13_gauge_clipped")
    one = case.recordings[0]
    higher = one.channels["muscle_pressure"] + 5e3
    one.channels["muscle_pressure"][:] = higher
    kept, said = without_rails(case.recordings)
    assert not said
    assert all(
        np.array_equal(k.channels["joint_angle"], r.channels["joint_angle"], equal_nan=True)
        for k, r in zip(kept, case.recordings, strict=True)
    )
    assert kept[0].mask["muscle_pressure"].all()


def test_bar_labelled_psi_is_said_first_and_nothing_is_named() -> None:
    found = pamrs.diagnose(HERE / "11_bar_labelled_psi")
    assert found.verdict == "units"
    (read,) = found.misread
    assert (read.said, read.likely) == ("psi", "bar")
    assert set(read.channels) == {"supply_pressure", "muscle_pressure"}
    assert read.factors == pytest.approx([14.5038, 14.5038], rel=1e-4)
    assert read.after < 3.0 < 1e5 < read.before
    _says_nothing_else(found, "supply_pressure and muscle_pressure are likely in bar, not in psi")


def test_an_absolute_pressure_as_gauge_is_said_first_and_nothing_is_named() -> None:
    """The muscle alone would be 'a pressure that is needed before it pulls', 0.89."""
    found = pamrs.diagnose(HERE / "12_absolute_as_gauge")
    assert found.verdict == "units"
    (read,) = found.misread
    assert (read.channels, read.said, read.likely) == (["muscle_pressure"], "gauge", "absolute")
    assert read.offset == -101325.0
    assert read.factors == [1.0]
    _says_nothing_else(found, "muscle_pressure is likely absolute and not gauge")


def _says_first(found: pamrs.Diagnosis, claim: str) -> None:
    """The text, the page and JSON begin with what is wrong with a channel."""
    assert claim in found.headline[: len(claim) + 60]
    assert found.summary().splitlines()[1].startswith(found.headline[:60])
    page = html.unescape(render_html(found))
    heading = page[page.index("<h1>") : page.index('<ul class="facts">')]
    assert claim.replace("_", " ") in heading.replace("_", " ").replace("²", "2")
    written = kept(found)
    first = [*written["faulty"], *written["misread"]][0]
    assert claim in first["text"]
    assert list(written).index("faulty") < list(written).index("where")


def _says_nothing_else(found: pamrs.Diagnosis, claim: str) -> None:
    """The unit stands first, and nothing is named beside it."""
    _says_first(found, claim)
    assert not found.effects
    assert not found.wrong_parameters
    assert {block.verdict for block in found.blocks} == {"not_judged"}


def _as(case: Case, channels: dict[str, float]) -> Case:
    """A case whose values of some channels are in another unit than its log says."""
    turned = [
        replace(r, channels={n: v * channels.get(n, 1.0) for n, v in r.channels.items()})
        for r in case.recordings
    ]
    return replace(case, recordings=turned)


def test_volts_labelled_millivolts_are_told() -> None:
    case = _as(pamrs.load_case(HERE / "13_gauge_clipped"), {"valve_command": 1e-3})
    said = [replace(r, said=r.said | {"valve_command": "mV"}) for r in case.recordings]
    found = pamrs.diagnose(replace(case, recordings=said))
    assert found.verdict == "units"
    assert found.misread[0].channels == ["valve_command"]
    assert found.misread[0].likely == "V"
    assert found.misread[0].factors == pytest.approx([1e3])


KGF = 0.980665
"""bar in a kgf/cm2."""


def _in_bar(gains: dict[str, float]) -> Case:
    """A sound rig whose log says bar, and whose gauges read by these factors more."""
    case = _as(_healthy(lambda _: None), gains)
    said = dict.fromkeys(("supply_pressure", "muscle_pressure"), "bar")
    return replace(case, recordings=[replace(r, said=r.said | said) for r in case.recordings])


def test_kgf_labelled_bar_is_told_beside_a_gain() -> None:
    """Parameters inside their tolerances take up most of 2 %: a free factor tells."""
    found = pamrs.diagnose(_in_bar({"supply_pressure": 1.0 / KGF}))
    assert found.verdict == "units"
    (read,) = found.misread
    assert (read.channels, read.said, read.likely) == (["supply_pressure"], "bar", "kgf/cm2")
    assert read.factors == pytest.approx([KGF])
    _says_nothing_else(found, "likely in kgf/cm2, not in bar")
    assert "another gain: " in read.text
    assert "kgf/cm2 over bar is 0.9807" in read.text


@pytest.mark.parametrize(
    ("gains", "told"),
    [
        pytest.param({}, False, marks=pytest.mark.slow),
        ({"supply_pressure": 1.03}, False),
        pytest.param({"supply_pressure": 0.99}, False, marks=pytest.mark.slow),
        pytest.param({"muscle_pressure": 1.01}, False, marks=pytest.mark.slow),
        pytest.param({"supply_pressure": 1.0 / KGF}, True, marks=pytest.mark.slow),  # as above
        ({"muscle_pressure": 1.0 / KGF}, True),
    ],
)
def test_a_gain_is_a_unit_only_where_the_list_has_it(gains: dict[str, float], told: bool) -> None:
    problem, rig = _problem(_in_bar(gains))
    assert (find_misread(problem, rig) is not None) is told


def _problem(case: Case) -> tuple[Problem, pamrs.Rig]:
    """The recordings as they are judged, and the rig."""
    settings = DiagnosisSettings()
    prepared = [prepare(r, case.rig, settings) for r in case.recordings]
    blocks = available_blocks(case.rig, case.channels)
    return Problem(blocks, prepared, core_rig(case.rig), settings), case.rig


@pytest.mark.parametrize("grid", [0.002, 0.005])
def test_noise_does_not_follow_interpolation(tmp_path: Path, grid: float) -> None:
    """Events 35 ms apart, of a converter with steps of 1.2 kPa, on a grid that is finer."""
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 20.0, 0.035)
    pressure = 2e5 + 1e5 * np.sin(0.7 * time) + rng.normal(0.0, 300.0, time.size)
    rows = "\n".join(
        f"{t:.6f},{round(p / 1200.0) * 1200.0}" for t, p in zip(time, pressure, strict=True)
    )
    file = tmp_path / "log.csv"
    file.write_text(f"time [s],muscle_pressure [Pa]\n{rows}\n")
    recording = pamrs.load_recording(file, sample_time=grid)
    rig = pamrs.load_rig(ROOT / "sealed_chamber.toml")
    noise = prepare(recording, rig, DiagnosisSettings()).noise["muscle_pressure"]
    # each event counts once: white noise of the grid that is as large in the mean of many
    single = noise * math.sqrt(grid / 0.035)
    assert 346.0 <= single < 1200.0
    assert recording.logged["muscle_pressure"][0] == pytest.approx(0.035, rel=1e-3)


def _healthy(change: Callable[[dict[str, np.ndarray]], object], names: str = "abc") -> Case:
    """A sound rig at 100 Hz, of which a sensor or logger spoils something in some recordings."""
    case = pamrs.load_case(HERE / "12_absolute_as_gauge")
    spoilt = []
    for recording in case.recordings:
        channels = {name: values.copy() for name, values in recording.channels.items()}
        channels["muscle_pressure"] -= 101325.0
        if recording.name in names:
            change(channels)
        mask = {name: np.isfinite(values) for name, values in channels.items()}
        spoilt.append(replace(recording, channels=channels, mask=mask))
    return replace(case, recordings=spoilt)


def _rounded(case: Case, place: float) -> Case:
    """Eight bits of 16 bar and of 180 deg, whose steps lie at a place."""
    steps = {"supply_pressure": 6250.0, "muscle_pressure": 6250.0, "joint_angle": np.pi / 256}
    made = []
    for recording in case.recordings:
        channels = dict(recording.channels)
        for name, step in steps.items():
            channels[name] = (np.round(channels[name] / step + place) - place) * step
        made.append(replace(recording, channels=channels))
    return replace(case, recordings=made)


@pytest.mark.slow
def test_rounding_to_eight_bits_is_no_physics() -> None:
    """Of a coarse converter the rounding is not white: it stays for as long as a step lasts."""
    case = _rounded(_healthy(lambda _: None), 0.0)
    made = prepare(case.recordings[0], case.rig, DiagnosisSettings())
    assert made.steps["muscle_pressure"] == pytest.approx(6250.0)
    found = pamrs.diagnose(case)
    assert found.verdict in ("none", "parameters")


def test_a_repetition_at_eight_bits_is_no_physics() -> None:
    """An external torque was named, 0.61: two recordings, one of them held out."""
    found = pamrs.diagnose(HERE / "16_repeat_8_bit")
    assert found.verdict in ("none", "parameters")
    assert not found.effects


@pytest.mark.parametrize("place", [0.0, 0.3])
@pytest.mark.parametrize("pair", ["ab", "bc", "ac"])
def test_two_recordings_of_eight_bits_leave_no_more_than_noise(pair: str, place: float) -> None:
    case = _rounded(_healthy(lambda _: None), place)
    case = replace(case, recordings=[r for r in case.recordings if r.name in pair])
    problem, rig = _problem(case)
    fitted = fit(problem, rig, (), {}, {block.name: 1.0 for block in problem.blocks})
    levels = noise_levels(problem, core_rig(fitted.rig))
    for block in problem.blocks:
        assert problem.recordings[0].steps[block.channel] > 0.0
        own = excess(block, problem.recordings, fitted.residuals, levels, problem.settings)
        assert own.ratio <= own.limit, block.name


@pytest.mark.slow
def test_blocks_without_a_value_are_no_physics() -> None:
    def holes(channels: dict[str, np.ndarray]) -> None:
        channels["muscle_pressure"][300:380] = np.nan
        channels["joint_angle"][600:650] = np.nan

    assert pamrs.diagnose(_healthy(holes)).verdict in ("none", "parameters")


@pytest.mark.parametrize("which", ["abc", pytest.param("c", marks=pytest.mark.slow)])
def test_a_command_that_was_not_logged_is_said_and_the_rest_is_judged(which: str) -> None:
    """In all recordings the valve and what it fills are not judged; one beside others goes."""
    found = pamrs.diagnose(_healthy(lambda channels: channels["valve_command"].fill(5.0), which))
    (dead,) = found.faulty
    assert (dead.channel, dead.kind) == ("valve_command", "not_logged")
    claim = "valve_command has one value throughout (5 V) while muscle_pressure stands still"
    assert claim in dead.text
    _says_first(found, claim)
    assert found.verdict in ("none", "parameters")
    left = {name for block in found.not_judged for name in block.blocks}
    assert left == ({"supply", "chamber"} if which == "abc" else set())
    assert len(found.data) == (3 if which == "abc" else 2)


def test_a_command_that_was_not_logged_is_refused_where_nothing_else_can_be_judged() -> None:
    def without_angle(channels: dict[str, np.ndarray]) -> None:
        channels["valve_command"][:] = 5.0
        del channels["joint_angle"]

    with pytest.raises(DiagnosisError, match="valve_command has one value throughout"):
        pamrs.diagnose(_healthy(without_angle))


@pytest.mark.parametrize(("count", "apart"), [(16, 2.0), (37, 1.0)])
@pytest.mark.parametrize("leak", [0.0, 0.01])
def test_few_samples_tell_a_leak(count: int, apart: float, leak: float) -> None:
    rng = np.random.default_rng(count)
    time = np.arange(count) * apart
    recordings = []
    for name in ("one", "two"):
        pressure = 4e5 * np.exp(-leak * time) + rng.normal(0.0, 300.0, count)
        channels, used = {"muscle_pressure": pressure}, {"muscle_pressure": np.full(count, True)}
        units = {"muscle_pressure": "Pa"}
        recordings.append(Recording(name, "fit", time, apart, channels, used, units=units))
    rig = pamrs.load_rig(ROOT / "sealed_chamber.toml")
    found = pamrs.diagnose(Case("short", rig, recordings, HERE))
    assert [effect.id for effect in found.effects][:1] == (["leak_muscle"] if leak else [])
