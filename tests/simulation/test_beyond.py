"""What a run does beyond what its parts bear is said: pressures, vacuum, stops."""

from __future__ import annotations

import re

import numpy as np

import pamrs
from pamrs.rig import parse_rig

SHOULDER = pamrs.rigs.shoulder()


def happened(run: pamrs.Simulation, kind: str) -> list[tuple[str, float]]:
    return [(event.block, event.time) for event in run.events if event.kind == kind]


def test_a_pressure_above_the_limit_is_an_event() -> None:
    unlimited = SHOULDER.to_toml_text().partition("\n[limits]")[0]
    rig = parse_rig(unlimited + '\n[limits]\nmax_pressure = { value = 6, unit = "bar" }\n')
    volts = np.where(np.arange(300) < 150, 10.0, 0.0)
    run = pamrs.simulate(rig, volts, sample_time=0.01)
    pressure = run["muscle_pressure"]
    assert pressure.max() > 6.5e5
    ((block, passed),) = happened(run, "max_pressure_passed")
    ((_, kept),) = happened(run, "max_pressure_kept")
    assert block == "chamber"
    assert abs(np.interp(passed, run.time, pressure) - 6e5) < 1e4
    assert abs(np.interp(kept, run.time, pressure) - 6e5) < 1e4
    assert passed < 1.5 < kept < 3.0
    assert re.search(r"chamber: max pressure passed at 0\.\d+ s", run.summary())
    # a stand that says nothing of it has no such limit
    plain = pamrs.simulate(parse_rig(unlimited), volts, sample_time=0.01)
    assert not happened(plain, "max_pressure_passed")
    assert np.array_equal(plain["muscle_pressure"], pressure)


def test_a_sealed_muscle_that_is_shortened_by_others_has_a_vacuum() -> None:
    rig = pamrs.rigs.recruitment()
    names = list(rig.tables("valve"))
    shut = {name: np.full(400, rig.tables("valve")[name]["null_voltage"]) for name in names}
    lifted = np.full(400, 5.0)
    lifted[:200] = 9.0
    run = pamrs.simulate(rig, shut | {names[0]: lifted}, sample_time=0.01)
    idle = [block for block, _ in happened(run, "vacuum_reached")]
    lowest = {name: run[f"muscle_pressure.{name}"].min() for name in rig.tables("chamber")}
    assert sorted(idle) == sorted(f"chamber.{n}" for n, low in lowest.items() if low < -5e3)
    assert idle
    assert "vacuum reached at" in run.summary()


def test_a_stop_that_gives_way_is_told_with_how_far() -> None:
    soft = SHOULDER.to_toml_text(comments=False).replace(
        "stop_stiffness = { value = 20000.0", "stop_stiffness = { value = 200.0"
    )
    rig = parse_rig(soft)
    assert rig.tables("joint")[""]["stop_stiffness"] == 200.0
    run = pamrs.simulate(rig, np.full(200, 0.0), sample_time=0.01)
    low = np.degrees(rig.tables("joint")[""]["min_angle"] - run["joint_angle"].min())
    assert low > 1.0
    told = re.search(r"joint: up to (\S+) deg beyond its lower stop", run.summary())
    assert told is not None
    assert abs(float(told[1]) - low) < 0.01 * low
    usual = pamrs.simulate(SHOULDER, np.full(200, 5.4), sample_time=0.01)
    assert "beyond its" not in usual.summary()
