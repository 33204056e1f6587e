"""Effects on what is recorded."""

from __future__ import annotations

from typing import Final

from pamrs.effects_table.entry import EffectInfo, SameData
from pamrs.effects_table.entry import EffectParameter as Parameter

__all__ = ["SENSORS"]

SENSORS: Final[tuple[EffectInfo, ...]] = (
    EffectInfo(
        id="pressure_lag",
        name="lag of the recorded muscle pressure",
        block="sensors",
        at="chamber",
        acts_in=("chamber", "arm"),
        equation="T y' = p - y",
        fingerprint="every change of the recorded pressure comes late, also one by motion with the valve shut; the arm moves before it",
        separates="a lag on the way in does not touch pressure that motion makes; a clock's shift moves the angle too",
        parameters=(Parameter("time_constant", "s", 0.005, 0.0, 100.0, (0.003, 0.02), "of transducer, snubber and its line", 0.0),),
        reference="Doebelin, Measurement Systems, ch. 6",
        rivals=("input_path_lag", "clock_skew"),
    ),
    EffectInfo(
        id="clock_skew",
        name="recorded by another clock than the commands",
        block="sensors",
        at="",
        acts_in=("supply", "chamber", "arm"),
        equation="p recorded at t was there at t - d, the angle at t - a d, d = d0 + r t: commands act later by d on the recording",
        fingerprint="pressures, or all channels, answer late to the command, or early, by a time that grows through the recording",
        separates="a lag on the way in is the same at the start and at the end and rounds the edges; "
        "a sensor's lag moves one channel only",
        parameters=(
            Parameter("offset", "s", 0.01, -10.0, 10.0, (0.005, 0.03), "how late at the start; early if negative", 0.0),
            Parameter("rate", "1", 1e-4, -0.01, 0.01, (0.0, 3e-4), "growth per time", 0.0),
            Parameter(
                "angle_share",
                "1",
                1.0,
                0.0,
                1.0,
                (0.0, 1.0),
                "1: the angle is on the pressures' clock, 0: on the command's",
                role="choice",
            ),
        ),
        reference="Mills (1991), offset and skew of clocks",
        rivals=("input_path_lag", "pressure_lag", "tube_flow_restriction"),
        same_data=SameData(
            "input_path_lag",
            "delay",
            "offset",
            "rate",
            (("angle_share", 1.0),),
            "No excitation tells a dead time from a clock that is late by the same time: record the command as it arrives at the valve "
            "with the logger of the pressures (a dead time stays, a late clock is gone), or record for an hour and see whether the "
            "delay grows.",
        ),
    ),
)
"""In the order of the catalogue."""
