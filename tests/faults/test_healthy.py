"""Logs of rigs in which nothing is missing."""

from __future__ import annotations

from pathlib import Path

import pytest

import pamrs

HERE = Path(__file__).parent


@pytest.mark.parametrize("name", ["09_healthy_at_100_hz_a", "10_healthy_at_100_hz_b"])
def test_a_joint_thrown_on_its_stop_is_no_friction_and_no_push(name: str) -> None:
    """Stribeck friction (0.93) and a torque from outside (0.80) where steps led over the stop."""
    found = pamrs.diagnose(HERE / name)
    assert found.verdict in ("none", "parameters")
    assert not found.effects


def test_a_log_may_begin_in_a_transient() -> None:
    """A tank that was let out before: its gas is 20 K colder than the room."""
    found = pamrs.diagnose(HERE / "08_cut_mid_transient")
    assert found.verdict == "none"
    assert not found.effects
    assert any("begin in a transient" in warning for warning in found.warnings)
