"""A rig driven by a recording, by steps on the command line, and by a sampled controller."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pamrs
from pamrs.channels import unit_of
from pamrs.recordings import Recording
from pamrs.rig import parse_rig
from pamrs.simulation import differences, replay
from tests.scripts import command
from tests.simulation.refusals import refused
from tests.tables import rows_of, text_of


def write(path: Path, run: pamrs.Simulation, *names: str) -> Path:
    rows = ["time [s]," + ",".join(f"{name} [{unit_of(name)}]" for name in names)]
    rows += [
        ",".join(f"{v:.12g}" for v in row)
        for row in zip(run.time, *(run[name] for name in names), strict=True)
    ]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def wave(rows: int, phase: float = 0.0) -> np.ndarray:
    return 5.0 + 0.5 * np.sin(0.05 * np.arange(rows) + phase)


def test_a_recording_of_named_blocks_is_replayed(tmp_path: Path) -> None:
    rig = pamrs.rigs.named("two_joint_arm")
    volts, start = (
        {"elbow": wave(300) + 0.4, "wrist": wave(300, 1.0)},
        {"muscle_pressure.elbow": 2e5},
    )
    run = pamrs.simulate(rig, volts, sample_time=0.01, initial=start)
    kept = ("valve_command", "supply_pressure", "muscle_pressure", "joint_angle")
    names = [n for n in run if n.partition(".")[0] in kept]
    recording = pamrs.load_recording(write(tmp_path / "run.csv", run, *names))
    again = replay(rig, recording)
    # slack at the start: when it becomes taut lies between samples of the pressure
    np.testing.assert_allclose(again["joint_angle.wrist"], run["joint_angle.wrist"], atol=2e-3)
    found = differences(again, recording)
    assert set(found) == {n for n in names if not n.startswith("valve_command")}
    assert found["joint_angle.elbow"] < 1e-4
    other = replay(rig.with_parameters({"link.hand.payload": 20.0}), recording)
    assert differences(other, recording)["joint_angle.elbow"] > 0.01
    some = write(tmp_path / "some.csv", run, "valve_command.elbow", "joint_angle.elbow")
    with pytest.raises(pamrs.RecordingError, match=r"no usable valve_command\.wrist"):
        replay(rig, pamrs.load_recording(some))


@pytest.mark.parametrize("alike", [True, False])
def test_a_gas_may_begin_warm_or_cold(alike: bool) -> None:
    """The second half of a run of two gases, from their pressures and temperatures alone."""
    chamber = """
[chamber.{name}]
gas = "energy_balance"
dead_volume = {{ value = {volume}, unit = "l" }}
initial_pressure = {{ value = 5, unit = "bar" }}
heat_transfer_coefficient = {{ value = 20, unit = "W/(m2 K)" }}
[line.{name}]
kind = "orifice"
from = "chamber.{name}"
to = "ambient"
discharge_area = {{ value = 0.5, unit = "mm2" }}
"""
    tables = [chamber.format(name=n, volume=v) for n, v in (("a", 0.5), ("b", 0.5 if alike else 2))]
    rig = parse_rig("".join(['schema = "pamrs.rig/1"\nname = "two"\n[gas]', *tables]))
    run = pamrs.simulate(rig, sample_time=0.01, duration=2.0)
    channels = {name: run[name][100:] for name in ("muscle_pressure.a", "muscle_pressure.b")}
    mask = {name: np.ones(101, dtype=bool) for name in channels}
    cut = Recording("cut", "fit", run.time[:101], 0.01, channels, mask)
    begin = {name: float(run[f"temperature.{name}"][100]) for name in ("b", "a")}
    assert max(begin.values()) < 290.0
    again = replay(rig, cut, temperatures=begin)
    assert set(again) == set(replay(rig, cut))
    for name in (*channels, "temperature.a", "temperature.b"):
        np.testing.assert_allclose(again[name], run[name][100:], rtol=1e-9)
    assert differences(replay(rig, cut), cut)["muscle_pressure.b"] > 100.0

    def begun(**temperatures: float) -> pamrs.Simulation:
        return replay(rig, cut, temperatures=temperatures)

    room, told = begun(a=293.15, b=293.15), replay(rig, cut)
    np.testing.assert_array_equal(room["muscle_pressure.a"], told["muscle_pressure.a"])
    refused(
        ("gas = 'energy_balance' is needed", lambda: begun(c=300.0)),
        ("initial.temperature.a = 0 is not allowed: .* K", lambda: begun(a=0.0)),
        ("initial.temperature.a = NaN is not allowed", lambda: begun(a=float("nan"))),
    )
    warm = pamrs.simulate(rig, sample_time=0.01, duration=0.1, initial={"temperature.b": 350.0})
    assert warm["temperature.b"][0] == pytest.approx(350.0)
    assert warm["temperature.a"][0] == pytest.approx(293.15)


def test_pressures_move_a_joint_that_nothing_feeds(tmp_path: Path) -> None:
    text = pamrs.rigs.shoulder().to_toml_text()
    loose = re.sub(r"\[(supply|valve)\]\n(?:[^\[\n].*\n|\n)*", "", text)
    rig = pamrs.rig.parse_rig(loose)
    pressure = 2e5 + 1e5 * np.sin(0.02 * np.arange(200))
    run = pamrs.simulate(rig, sample_time=0.01, pressure=pressure)
    np.testing.assert_allclose(run["muscle_pressure"], pressure, atol=1e-6)
    file = write(tmp_path / "run.csv", run, "muscle_pressure", "joint_angle")
    recording = pamrs.load_recording(file)
    again = replay(rig, recording)
    np.testing.assert_allclose(again["joint_angle"], run["joint_angle"], atol=1e-7)
    assert set(differences(again, recording)) == {"joint_angle"}


def test_steps_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run.csv"
    holds = ("valve_command.elbow = 6 V, 5 V @ 0.5 s", "valve_command.wrist = 5000 mV")
    words = [word for hold in holds for word in ("--hold", hold)]
    words += ["--initial", "muscle_pressure.wrist = 1 bar", "--duration", "1 s"]
    code, said, _ = command(capsys, "simulate", "two_joint_arm", *words, "--output", out)
    assert code == 0
    assert "muscle_pressure.wrist: from" in said
    assert "g supplied" in said
    head, *rows = out.read_text(encoding="utf-8").splitlines()
    assert "energy_supplied [J]" in head.split(",")
    assert len(rows) == 201
    table = np.array([[float(v) for v in row.split(",")] for row in rows])
    volts = table[:, head.split(",").index("valve_command.elbow [V]")]
    assert volts.tolist() == [6.0] * 100 + [5.0] * 101


@pytest.mark.parametrize(
    ("words", "message"),
    rows_of(__file__, "wrong_steps_are_named"),
)
def test_wrong_steps_are_named(
    words: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "x.csv"
    code, _, err = command(capsys, "simulate", "two_joint_arm", *words, "--output", out)
    assert code == 2
    assert message in err.splitlines()[-1]


PAIR = ("valve_command.flexor", "muscle_pressure.flexor", "joint_angle.elbow")


@pytest.mark.parametrize(
    ("rig", "drive", "names", "told"),
    [
        (
            pamrs.rigs.named("antagonistic_joint"),
            {"valve_command": {"flexor": wave(300), "extensor": 10.0 - wave(300)}},
            PAIR,
            r"no channel valve_command\.extensor",
        ),
        (
            parse_rig(text_of(__file__, "hanging")),
            {"duration": 2.0, "initial": {"muscle_pressure": 4e5, "length": 0.25}},
            ("muscle_pressure",),
            r"measure length$",
        ),
    ],
    ids=["pair", "mass"],
)
def test_a_case_that_lacks_a_channel_is_refused_with_what_to_measure(
    tmp_path: Path, rig: pamrs.Rig, drive: dict[str, Any], names: tuple[str, ...], told: str
) -> None:
    rig.to_toml(tmp_path / "rig.toml")
    write(tmp_path / "run.csv", pamrs.simulate(rig, sample_time=0.01, **drive), *names)
    case = 'schema = "pamrs.case/1"\nrig = "rig.toml"\n'
    recording = '[[recording]]\nfile = "run.csv"\nrole = "fit"\n'
    (tmp_path / "case.toml").write_text(case + recording, encoding="utf-8")
    with pytest.raises(pamrs.DiagnosisError, match=told):
        pamrs.diagnose(tmp_path)
