"""A hose that carries waves between two gauges: its length is told from what arrives late."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.prepare import available_blocks, prepare, residual
from pamrs.recordings import Recording
from pamrs.rig import Rig, parse_rig
from pamrs.simulation import core_rig
from tests.diagnosis.noisy import noisy

SETTINGS = DiagnosisSettings()
TEXT = pamrs.rigs.template("long_tube", "hose", "coefficients")
CHANNELS = ("muscle_pressure.left", "muscle_pressure.right")
NOISE = dict.fromkeys(CHANNELS, 300.0)


def stated(**tolerances: float) -> Rig:
    """The packaged rig with other tolerances of its line."""
    text = TEXT
    for key, was, unit in (("length", "0.02", '"m",  '), ("alpha", "0.02", '"1", ')):
        old = f"unit = {unit}tol = {was} }}"
        assert text.count(old) == 1, (key, old)
        text = text.replace(old, f"unit = {unit}tol = {tolerances.get(key, float(was))} }}")
    return parse_rig(text)


RIG = stated(length=0.2, alpha=0.0)


def opened(true: Rig, role: str, seed: int, pressure: float) -> Recording:
    """The outlet thrown open, 0.8 s at 500 Hz."""
    start = {"muscle_pressure.left": pressure}
    run = pamrs.simulate(true, sample_time=0.002, duration=0.8, initial=start)
    channels = {name: run[name] for name in CHANNELS}
    return noisy(f"r{seed}", role, 0.002, channels, NOISE, [7, seed])


def test_both_gauges_are_boundaries_and_the_hose_lies_in_each_block() -> None:
    blocks = {b.name: b for b in available_blocks(RIG, CHANNELS, SETTINGS.prepare)}
    assert list(blocks) == ["chamber.left", "chamber.right"]
    for block in blocks.values():
        assert {"line.length", "line.diameter", "line.alpha"} <= block.parameters
    usual = RIG.with_parameters({"line.segments": 0})
    for block in available_blocks(usual, CHANNELS, SETTINGS.prepare):
        assert "line.length" in block.parameters
        assert "line.alpha" not in block.parameters


@pytest.mark.parametrize(
    ("wrong", "seen"),
    [({}, False), ({"line.length": 8.6}, True), ({"line.alpha": 1.2}, True)],
)
def test_what_is_wrong_along_the_hose_shows(wrong: dict[str, float], seen: bool) -> None:
    prepared = prepare(opened(RIG.with_parameters(wrong), "fit", 0, 3e5), RIG, SETTINGS)
    right = available_blocks(RIG, CHANNELS, SETTINGS.prepare)[1]
    left = residual(right, core_rig(RIG), prepared, [])
    ratio = float(np.std(left.value[left.rows])) / left.noise
    assert (ratio > 2.0) == seen, ratio


def test_sensitivities_are_those_of_differences() -> None:
    prepared = prepare(opened(RIG, "fit", 0, 3e5), RIG, SETTINGS)
    block = available_blocks(RIG, CHANNELS, SETTINGS.prepare)[1]
    for name in ("line.length", "line.diameter", "line.alpha", "chamber.right.alpha_in"):
        value = RIG.parameter(name).value
        slope = residual(block, core_rig(RIG), prepared, [name]).jacobian
        assert slope is not None
        low, high = (
            residual(
                block, core_rig(RIG.with_parameters({name: value * f})), prepared, [name]
            ).value
            for f in (1.0 - 1e-4, 1.0 + 1e-4)
        )
        wanted = -(high - low) / (2e-4 * value)
        size = float(np.abs(wanted).max())
        np.testing.assert_allclose(slope[:, 0], wanted, atol=2e-2 * size)


@pytest.mark.slow
def test_another_length_is_a_parameter_and_no_missing_physics() -> None:
    true = RIG.with_parameters({"line.length": 8.3})
    recordings = [
        opened(true, role, seed, pressure)
        for seed, (role, pressure) in enumerate((("fit", 2e5), ("fit", 4e5), ("held_out", 3e5)))
    ]
    found = pamrs.diagnose(pamrs.Case("hose", RIG, recordings, Path()))
    assert found.verdict == "parameters"
    assert not found.effects
    length = found.parameters["line.length"]
    assert abs(length.value - 8.3) < 3.0 * length.std
    assert 8.15 < length.value < 8.45
