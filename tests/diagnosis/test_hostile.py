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
from pamrs.control import trajectories
from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.prepare import implausible, suspected_units
from reproduction import lift
from reproduction.lift_diagnosis import recorded

SETTINGS = DiagnosisSettings()

Array = NDArray[np.float64]
Table = dict[str, Array]
HEADINGS = {
    "time": "s",
    "valve_command": "V",
    "supply_pressure": "Pa",
    "muscle_pressure": "Pa",
    "joint_angle": "rad",
}


def sound(n: int = 1600, *, seed: int = 5) -> Table:
    """A run of the nominal shoulder with noise, 8 s at 200 Hz."""
    rig = pamrs.rigs.shoulder()
    time = 0.005 * np.arange(n)
    command = 5.0 + 0.45 * np.sin(1.6 * time) + 0.25 * np.sin(4.1 * time)
    run = pamrs.simulate(
        rig, command, sample_time=0.005, initial={"muscle_pressure": 2e5, "joint_angle": 0.9}
    )
    rng = np.random.default_rng(seed)
    noise = {"supply_pressure": 400.0, "muscle_pressure": 400.0, "joint_angle": 3e-4}
    return {"time": time, "valve_command": command} | {
        c: run[c] + rng.normal(0.0, s, n) for c, s in noise.items()
    }


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


@pytest.fixture(scope="module")
def plain() -> Table:
    return sound()


@pytest.mark.parametrize("damage", [holes, rows_gone, steps, saturated, frozen_while])
def test_what_is_judged_gets_no_confident_name(
    damage: Callable[[Table], Table], plain: Table, tmp_path: Path
) -> None:
    found = pamrs.diagnose(loaded(tmp_path, damage(plain)))
    named = [
        e["id"] for e in found.effects if found.verdict == "effects" and e["probability"] >= 0.5
    ]
    assert not named, found.text
    assert found.warnings


def swap(a: str, b: str) -> Callable[[Table], Table]:
    """Two columns in each other's place."""
    return lambda t: t | {a: t[b], b: t[a]}


def put(channel: str, change: Callable[[Array], Array]) -> Callable[[Table], Table]:
    """One column changed."""
    return lambda t: t | {channel: change(t[channel])}


REFUSED = {
    "bar under Pa": (
        put("muscle_pressure", lambda p: p / 1e5),
        {},
        "muscle_pressure never exceeds .* bar",
    ),
    "Pa under bar": (
        lambda t: t,
        {"muscle_pressure": "bar"},
        "muscle_pressure.*not possible.*unit",
    ),
    "kPa under bar": (
        put("muscle_pressure", lambda p: p / 1e3),
        {"muscle_pressure": "bar"},
        "muscle_pressure reaches .* kPa",
    ),
    "psi under bar": (
        put("supply_pressure", lambda p: p / 6894.76),
        {"supply_pressure": "bar"},
        "supply_pressure reaches .* psi",
    ),
    "rad under deg": (
        lambda t: t,
        {"joint_angle": "deg"},
        "joint_angle .*(deg or rad|rad under a heading in deg)",
    ),
    "deg under rad": (
        put("joint_angle", np.degrees),
        {},
        "joint_angle.*(deg or rad|right column and unit)",
    ),
    "angle the other way": (
        put("joint_angle", lambda q: 2.7 - q),
        {},
        "joint_angle .* opposite to the model",
    ),
    "angle the other way, pressure lost at first": (
        lambda t: (
            t
            | {
                "joint_angle": 2.7 - t["joint_angle"],
                "muscle_pressure": np.where(t["time"] < 0.1, np.nan, t["muscle_pressure"]),
            }
        ),
        {},
        "joint_angle .* opposite to the model",
    ),
    "supply and muscle": (
        swap("supply_pressure", "muscle_pressure"),
        {},
        "muscle_pressure is above supply_pressure for .* swapped",
    ),
    "pressure and angle": (swap("muscle_pressure", "joint_angle"), {}, "joint_angle.*not possible"),
    "supply and angle": (swap("supply_pressure", "joint_angle"), {}, "joint_angle.*not possible"),
    "valve the other way": (
        put("valve_command", lambda u: 10.0 - u),
        {},
        "change of muscle_pressure goes against valve_command",
    ),
    "command in mV under V": (
        put("valve_command", lambda u: 100.0 * u),
        {},
        "valve_command is beyond twice its valve's range",
    ),
    "frozen supply": (
        put("supply_pressure", lambda p: np.full_like(p, p[0])),
        {},
        "supply_pressure has the one value .* frozen",
    ),
    "frozen muscle": (
        put("muscle_pressure", lambda p: np.full_like(p, p[0])),
        {},
        "only 0 of .* samples of muscle_pressure",
    ),
    "frozen angle": (
        put("joint_angle", lambda q: np.full_like(q, q[0])),
        {},
        "joint_angle has the one value .* encoder",
    ),
    "pressure all NaN": (
        put("muscle_pressure", lambda p: np.full_like(p, np.nan)),
        {},
        "only 0 of .* samples of muscle_pressure",
    ),
    "command all NaN": (
        put("valve_command", lambda u: np.full_like(u, np.nan)),
        {},
        "no usable sample of valve_command",
    ),
    "everything NaN": (
        lambda t: {c: v if c == "time" else np.full_like(v, np.nan) for c, v in t.items()},
        {},
        "only 0 of",
    ),
    "no time": (put("time", lambda t: np.full_like(t, np.nan)), {}, "'time' has no value at all"),
    "time backwards": (
        put("time", lambda t: t[::-1].copy()),
        {},
        "goes against valve_command",
    ),
    "time back and forth": (
        put("time", lambda t: t[::-1] + 0.2 * (np.arange(t.size) % 5 == 0)),
        {},
        "'time' runs backwards",
    ),
    "time standing still": (put("time", np.zeros_like), {}, "at different times"),
    "ms under s": (put("time", lambda t: 1e3 * t), {}, "a sample every 5 s is too slow"),
    "s under ms": (lambda t: t, {"time": "ms"}, "joint_angle turns with .* units of 'time'"),
    "two samples": (lambda t: {c: v[:2] for c, v in t.items()}, {}, "has 2 samples"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_is_refused_in_words(name: str, plain: Table, tmp_path: Path) -> None:
    damage, units, words = REFUSED[name]
    with pytest.raises(pamrs.PamrsError, match=rf"(?s){words}"):
        pamrs.diagnose(loaded(tmp_path, damage(plain), units))


def test_sound_recordings_are_plausible(plain: Table, tmp_path: Path) -> None:
    case = loaded(tmp_path, plain)
    assert implausible(case.recordings[0], case.rig, SETTINGS) == []
    resting = {c: v[:400] for c, v in plain.items()} | {
        "muscle_pressure": np.zeros(400),
        "joint_angle": np.full(400, 0.2618),
    }
    assert implausible(loaded(tmp_path, resting).recordings[0], case.rig, SETTINGS) == []


def test_every_finding_is_told_at_once(plain: Table, tmp_path: Path) -> None:
    table = put("joint_angle", lambda q: 20 * q)(swap("supply_pressure", "muscle_pressure")(plain))
    with pytest.raises(pamrs.DiagnosisError) as told:
        pamrs.diagnose(loaded(tmp_path, table))
    assert all(
        word in str(told.value) for word in ("'run'", "joint_angle", "muscle_pressure", "allowed")
    )


def test_an_arm_whose_swing_moves_the_pressure_is_not_refused() -> None:
    # a limit cycle: most of the pressure's change is the volume's, against the valve
    name, payload = "smooth muscle", lift.PAYLOADS[1]
    truth = lift.plant(lift.VARIANTS[name], payload, seed=None)
    model = lift.assumed(lift.VARIANTS[name]).with_parameters({"arm.payload": payload})
    record = recorded(truth, model, trajectories.compound(), "fit", 0, 25.0)
    assert np.ptp(record.channels["joint_angle"]) > 1.0
    assert implausible(record, model, SETTINGS) == []
    turned = replace(
        record,
        channels=record.channels | {"valve_command": 10.0 - record.channels["valve_command"]},
    )
    assert any(
        "goes against valve_command" in text for text in implausible(turned, model, SETTINGS)
    )


def test_a_unit_that_physics_contradicts_is_named_where_a_case_is_refused(
    plain: Table, tmp_path: Path
) -> None:
    psi = plain | {c: plain[c] / 6894.757 for c in ("supply_pressure", "muscle_pressure")}
    units = {"supply_pressure": "bar", "muscle_pressure": "bar"}
    with pytest.raises(pamrs.DiagnosisError, match="read as psi it reaches"):
        pamrs.diagnose(loaded(tmp_path, psi, units))


def test_nothing_is_suspected_of_units_that_are_right(plain: Table, tmp_path: Path) -> None:
    case = loaded(tmp_path, plain)
    (recording,) = case.recordings
    assert recording.said == {c: HEADINGS[c] for c in recording.channels}
    assert suspected_units(case) == []
