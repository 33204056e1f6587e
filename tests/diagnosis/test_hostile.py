"""Hostile recordings of a plant in which nothing is missing: refused in words, or judged without a
confident name.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import pamrs
from pamrs.diagnosis.prepare import implausible, suspected_units
from reproduction import lift
from reproduction.lift_diagnosis import recorded
from reproduction.waves import waves
from tests.diagnosis.asked import SETTINGS
from tests.diagnosis.noisy import SHOULDER, driven

Array = NDArray[np.float64]
Table = dict[str, Array]
HEADINGS = {
    "time": "s",
    "valve_command": "V",
    "supply_pressure": "Pa",
    "muscle_pressure": "Pa",
    "joint_angle": "rad",
}


@pytest.fixture(scope="module")
def plain() -> Table:
    """A run of the nominal shoulder with noise, 8 s at 200 Hz."""
    time = 0.005 * np.arange(1600)
    command = {"valve_command": 5.0 + 0.45 * np.sin(1.6 * time) + 0.25 * np.sin(4.1 * time)}
    start = {"muscle_pressure": 2e5, "joint_angle": 0.9}
    run = driven(pamrs.rigs.shoulder(), "run", "fit", 0.005, command, SHOULDER, [5], initial=start)
    return {"time": time} | run.channels


def loaded(
    folder: Path, table: Table, units: dict[str, str] | None = None, name: str = "run"
) -> pamrs.Case:
    """The table as a case, by way of a file."""
    headings = HEADINGS | (units or {})
    rows = zip(*(table[c].tolist() for c in table), strict=True)
    text = ",".join(f"{c} [{headings[c]}]" for c in table) + "\n"
    text += "\n".join(",".join("" if np.isnan(v) else f"{v:.9g}" for v in row) for row in rows)
    (folder / f"{name}.csv").write_text(text + "\n", encoding="utf-8")
    recording = pamrs.load_recording(folder / f"{name}.csv")
    return pamrs.Case("hostile", pamrs.rigs.shoulder(), [recording], folder)


def holes(t: Table) -> Table:
    """Nearly a third of the samples of every channel missing, each on its own."""
    rng = np.random.default_rng(1)
    return {
        c: v if c == "time" else np.where(rng.random(v.size) < 0.3, np.nan, v) for c, v in t.items()
    }


def rows_gone(t: Table) -> Table:
    """30 % of the rows missing."""
    keep = np.random.default_rng(2).random(t["time"].size) > 0.3
    return {c: v[keep] for c, v in t.items()}


def steps(t: Table) -> Table:
    """A clock that steps back by 1 s and forward by 5 s."""
    time = t["time"].copy()
    time[500:] -= 1.0
    time[1100:] += 5.0
    return t | {"time": time}


def saturated(t: Table) -> Table:
    """A transducer that ends where the upper fifth of its readings begins."""
    p = t["muscle_pressure"]
    return t | {"muscle_pressure": np.minimum(p, np.quantile(p, 0.8))}


def frozen_while(t: Table) -> Table:
    """A pressure that freezes for 1.5 s."""
    p = t["muscle_pressure"].copy()
    p[700:1000] = p[700]
    return t | {"muscle_pressure": p}


@pytest.mark.parametrize("damage", [holes, rows_gone, steps, saturated, frozen_while])
def test_what_is_judged_gets_no_confident_name(
    damage: Callable[[Table], Table], plain: Table, tmp_path: Path
) -> None:
    found = pamrs.diagnose(loaded(tmp_path, damage(plain)))
    confident = [e.id for e in found.effects if e.probability >= 0.5]
    assert found.verdict != "effects" or not confident, found.text
    assert found.warnings


def swap(a: str, b: str) -> Callable[[Table], Table]:
    """Two columns in each other's place."""
    return lambda t: t | {a: t[b], b: t[a]}


def put(channel: str, change: Callable[[Array], Array]) -> Callable[[Table], Table]:
    """One column changed."""
    return lambda t: t | {channel: change(t[channel])}


def same(t: Table) -> Table:
    """Only the heading is another."""
    return t


def still(value: Array) -> Array:
    """As a sensor that freezes."""
    return np.full_like(value, value[0])


def lost(value: Array) -> Array:
    """As a sensor that is not there."""
    return np.full_like(value, np.nan)


def lost_at_first(t: Table) -> Table:
    """An angle the other way, in a log that begins without its pressure."""
    pressure = np.where(t["time"] < 0.1, np.nan, t["muscle_pressure"])
    return t | {"joint_angle": 2.7 - t["joint_angle"], "muscle_pressure": pressure}


def nothing(t: Table) -> Table:
    """No value but the times."""
    return {c: v if c == "time" else lost(v) for c, v in t.items()}


def in_psi(t: Table) -> Table:
    """Both pressures."""
    return t | {c: t[c] / 6894.757 for c in ("supply_pressure", "muscle_pressure")}


def back_and_forth(time: Array) -> Array:
    """Times of which every fifth is late, backwards."""
    return time[::-1] + 0.2 * (np.arange(time.size) % 5 == 0)


MUSCLE, SUPPLY, ANGLE, VALVE = "muscle_pressure", "supply_pressure", "joint_angle", "valve_command"
REFUSED = {
    "bar under Pa": (put(MUSCLE, lambda p: p / 1e5), "muscle_pressure never exceeds .* bar"),
    "Pa under bar": (same, "muscle_pressure.*not possible.*unit"),
    "kPa under bar": (
        put(MUSCLE, lambda p: p / 1e3),
        r"muscle_pressure reaches \S+ bar gauge; at most \S+ bar is .* kPa",
    ),
    "psi under bar": (put(SUPPLY, lambda p: p / 6894.76), r"supply_pressure reaches \S+ bar gauge"),
    "both in psi under bar": (in_psi, "read as psi it reaches"),
    "rad under deg": (same, "joint_angle .*(deg or rad|rad under a heading in deg)"),
    "deg under rad": (put(ANGLE, np.degrees), "joint_angle.*(deg or rad|right column and unit)"),
    "angle the other way": (put(ANGLE, lambda q: 2.7 - q), "joint_angle .* opposite to the model"),
    "angle the other way, pressure lost at first": (
        lost_at_first,
        "joint_angle .* opposite to the model",
    ),
    "supply and muscle": (
        swap(SUPPLY, MUSCLE),
        "muscle_pressure is above supply_pressure for .* swapped",
    ),
    "pressure and angle": (swap(MUSCLE, ANGLE), "joint_angle.*not possible"),
    "supply and angle": (swap(SUPPLY, ANGLE), "joint_angle.*not possible"),
    "valve the other way": (
        put(VALVE, lambda u: 10.0 - u),
        "change of muscle_pressure goes against valve_command",
    ),
    "command in mV under V": (
        put(VALVE, lambda u: 100.0 * u),
        "valve_command is beyond twice its valve's range",
    ),
    "frozen supply": (put(SUPPLY, still), "supply_pressure has the one value .* frozen"),
    "frozen muscle": (put(MUSCLE, still), "only 0 of .* samples of muscle_pressure"),
    "frozen angle": (put(ANGLE, still), "joint_angle has the one value .* encoder"),
    "pressure all NaN": (put(MUSCLE, lost), "only 0 of .* samples of muscle_pressure"),
    "command all NaN": (put(VALVE, lost), "no usable sample of valve_command"),
    "everything NaN": (nothing, "only 0 of"),
    "no time": (put("time", lost), "'time' has no value at all"),
    "time backwards": (put("time", lambda t: t[::-1].copy()), "goes against valve_command"),
    "time back and forth": (put("time", back_and_forth), "'time' runs backwards"),
    "time standing still": (put("time", np.zeros_like), "at different times"),
    "ms under s": (put("time", lambda t: 1e3 * t), "a sample every 5 s is too slow"),
    "s under ms": (same, "joint_angle turns with .* units of 'time'"),
    "two samples": (lambda t: {c: v[:2] for c, v in t.items()}, "has 2 samples"),
}
UNITS = {
    "Pa under bar": {MUSCLE: "bar"},
    "kPa under bar": {MUSCLE: "bar"},
    "psi under bar": {SUPPLY: "bar"},
    "both in psi under bar": {MUSCLE: "bar", SUPPLY: "bar"},
    "rad under deg": {ANGLE: "deg"},
    "s under ms": {"time": "ms"},
}
"""Headings that are others than those of a sound log."""


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_is_refused_in_words(name: str, plain: Table, tmp_path: Path) -> None:
    damage, words = REFUSED[name]
    with pytest.raises(pamrs.PamrsError, match=rf"(?s){words}"):
        pamrs.diagnose(loaded(tmp_path, damage(plain), UNITS.get(name)))


def test_nothing_is_suspected_of_sound_recordings(plain: Table, tmp_path: Path) -> None:
    case = loaded(tmp_path, plain)
    (recording,) = case.recordings
    assert recording.said == {c: HEADINGS[c] for c in recording.channels}
    assert suspected_units(case) == []
    assert implausible(recording, case.rig, SETTINGS) == []
    resting = {c: v[:400] for c, v in plain.items()}
    resting |= {MUSCLE: np.zeros(400), ANGLE: np.full(400, 0.2618)}
    assert implausible(loaded(tmp_path, resting).recordings[0], case.rig, SETTINGS) == []


def test_every_finding_is_told_at_once(plain: Table, tmp_path: Path) -> None:
    table = put("joint_angle", lambda q: 20 * q)(swap("supply_pressure", "muscle_pressure")(plain))
    with pytest.raises(pamrs.DiagnosisError) as told:
        pamrs.diagnose(loaded(tmp_path, table))
    words = ("'run'", "joint_angle", "muscle_pressure", "allowed")
    assert all(word in str(told.value) for word in words)


def test_an_arm_whose_swing_moves_the_pressure_is_not_refused() -> None:
    # a limit cycle: most of the pressure's change is the volume's, against the valve
    name, payload = "smooth muscle", lift.PAYLOADS[1]
    truth = lift.plant(lift.VARIANTS[name], payload, seed=None)
    model = lift.assumed(lift.VARIANTS[name]).with_parameters({"arm.payload": payload})
    record = recorded(truth, model, waves(), "fit", 0, 25.0)
    assert np.ptp(record.channels["joint_angle"]) > 1.0
    assert implausible(record, model, SETTINGS) == []
    turned = record.channels | {VALVE: 10.0 - record.channels[VALVE]}
    told = implausible(replace(record, channels=turned), model, SETTINGS)
    assert any("goes against valve_command" in text for text in told)
