"""Logs of rigs in which nothing is missing."""

from __future__ import annotations

from pathlib import Path

import pamrs

HERE = Path(__file__).parent


def test_a_log_may_begin_in_a_transient() -> None:
    """A tank that was let out before: its gas is 20 K colder than the room."""
    found = pamrs.diagnose(HERE / "08_cut_mid_transient")
    assert found.verdict == "none"
    assert not found.effects
    assert any("begin in a transient" in warning for warning in found.warnings)
