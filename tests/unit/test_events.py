"""Pushes and payload changes at times of their own are found where they were put."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.recording import Recording

TIMES = {"lift": 4.3, "lower": 7.1, "again": 5.6}
ROLES = {"lift": "fit", "lower": "fit", "again": "held_out"}


def recordings(effect: str, make: dict[str, float], duration: float = 12.0) -> list[Recording]:
    """Recordings of a nominal shoulder with an event each, with the noise of transducers."""
    found = []
    for number, (name, when) in enumerate(TIMES.items()):
        rng = np.random.default_rng([2014, number])
        time = np.arange(0.0, duration, 0.005)
        command = 5.0 + (0.35 + 0.1 * number) * np.sin(2 * np.pi * 0.15 * time) + 0.25 * np.sin(2 * np.pi * 0.4 * time + number)
        rig = pamrs.rigs.shoulder().with_effect(effect, make | {"time": when})
        run = pamrs.simulate(rig, valve_command=command, sample_time=0.005)
        channels = {
            "valve_command": command,
            "supply_pressure": run["supply_pressure"] + rng.normal(0.0, 400.0, time.size),
            "muscle_pressure": run["muscle_pressure"] + rng.normal(0.0, 400.0, time.size),
            "joint_angle": run["joint_angle"] + rng.normal(0.0, 3e-4, time.size),
        }
        mask = {channel: np.ones(time.size, dtype=bool) for channel in channels}
        found.append(Recording(name, ROLES[name], time, 0.005, channels, mask, [], dict.fromkeys(channels, "")))
    return found


@pytest.mark.parametrize(
    ("effect", "make"),
    [("external_torque", {"torque": 3.0, "duration": 0.8}), ("payload_change", {"mass_change": 0.4})],
)
def test_an_event_is_named_with_its_times(effect: str, make: dict[str, float]) -> None:
    found = pamrs.diagnose(pamrs.Case("events", pamrs.rigs.shoulder(), recordings(effect, make), Path()))
    assert found.verdict == "effects"
    assert found.effects[0]["id"] == effect
    assert found.probabilities[effect] > 0.8
    size = next(iter(make))
    events = sorted(found.effects[0]["events"], key=lambda entry: abs(entry[size]))
    times = {entry["recording"]: entry["time"] for entry in events}  # the largest of each recording
    assert times.keys() == TIMES.keys()
    for name, when in TIMES.items():
        assert abs(times[name] - when) < 0.25, name
    assert found.fit["gap_closed"] > 0.8
