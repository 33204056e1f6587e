"""One run on a device: the recording as it comes, the safe command first and last, and what is
said of devices that fail.
"""

import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.campaigns import Bench
from pamrs.campaigns._bench import Commands
from pamrs.campaigns._play import play
from pamrs.campaigns.simulated import SimulatedBench
from pamrs.control.live import LiveError
from pamrs.diagnosis import DiagnosisSettings
from pamrs.experiments import chains_of, library, protocol_of
from pamrs.findings import Protocol
from tests.simulation.refusals import refused

PERIOD = 0.02


@pytest.fixture(scope="module")
def rig():
    return pamrs.rigs.shoulder()


def protocol(seconds=2.0, value=5.4):
    time = np.arange(round(seconds / PERIOD) + 1) * PERIOD
    return Protocol(
        "fill", time, {"valve_command": np.full(time.size, value)}, {"valve_command": "V"}
    )


def written(bench):
    return [command for _, command in bench.plant.written]


def test_what_is_recorded_is_what_happened(rig, tmp_path):
    bench = SimulatedBench(
        rig, noise={"joint_angle": 0.0, "supply_pressure": 0.0, "muscle_pressure": 0.0}
    )
    path, sent = tmp_path / "run.csv", protocol()
    done = play(bench, Commands(rig, Bench(settle=1.0)), sent, path)
    assert (done.reason, done.rows) == ("finished", sent.time.size)
    assert done.seconds == pytest.approx(3.02)
    recording = pamrs.load_recording(path)
    assert recording.time == pytest.approx(sent.time, abs=1e-6)
    assert recording.channels["valve_command"] == pytest.approx(sent.commands["valve_command"])
    alone = pamrs.simulate(rig, sent.commands["valve_command"], sample_time=PERIOD)
    for name in ("muscle_pressure", "joint_angle", "supply_pressure"):
        span = 0.005 * np.abs(alone[name]).max()  # the arm sank a little before it began
        assert recording.channels[name] == pytest.approx(alone[name], abs=span)
    # first and last the valve is closed; between them it vents, and then plays
    assert written(bench)[0] == written(bench)[-1] == 5.0
    assert written(bench)[1:51] == [3.75] * 50


@pytest.mark.parametrize(
    ("name", "commands"),
    [
        ("antagonistic_joint", ["valve_command.flexor", "valve_command.extensor"]),
        ("regulated_joint", ["supply_command"]),
    ],
)
def test_every_command_of_a_rig_is_played_and_recorded(name, commands, tmp_path):
    rig, path = pamrs.rigs.named(name), tmp_path / "run.csv"
    (one,) = library(rig, DiagnosisSettings(), sample_time=PERIOD, only=["fast_triangle"])
    bench = SimulatedBench(rig)
    play(bench, Commands(rig, Bench(settle=1.0)), protocol_of(one), path)
    recording = pamrs.load_recording(path)
    assert list(one.commands) == commands
    for channel in commands:
        assert recording.channels[channel] == pytest.approx(one.commands[channel], rel=1e-6)
    alone = one.simulate(rig)
    for chain in chains_of(rig):
        apart = recording.channels[chain.pressure] - alone[chain.pressure]
        assert np.sqrt(np.mean(apart**2)) < 0.02 * np.ptp(alone[chain.pressure])


class Broken(SimulatedBench):
    """A bench that is broken from a time on, 1.5 s into its run."""

    def __init__(self, rig, how):
        super().__init__(rig)
        self.how = how

    @property
    def late(self):
        return self.clock.now() > 1.5

    def read(self):
        found = super().read()
        return self.how(self, dict(found)) if self.late else found


def raises(bench, found):
    raise TimeoutError("no answer within 0.05 s")


def late(bench, found):
    bench.clock.sleep(0.03)
    return found


@pytest.mark.parametrize(
    ("how", "told"),
    [
        (raises, "TimeoutError no answer within 0.05 s; an answer is needed every 0.02 s"),
        (lambda bench, found: None, "it gave no reading"),
        (late, "it took 0.03 s to answer"),
        (
            lambda bench, found: found | {"muscle_pressure": 2e6},
            r"muscle_pressure = 2e\+06 is not allowed: -30000 to 1.8e\+06",
        ),
        (
            lambda bench, found: found | {"joint_angle": math.nan},
            "joint_angle = nan is not allowed",
        ),
        (lambda bench, found: found | {"time": 1.0}, "its readings stand still"),
        (
            lambda bench, found: found | {"muscle_pressure.left": 1e5},
            "its channel muscle_pressure.left is not allowed: one of time, .*muscle_pressure,",
        ),
    ],
)
def test_a_device_that_does_not_answer_as_it_should_is_stopped_and_named(rig, tmp_path, how, told):
    bench, path = Broken(rig, how), tmp_path / "run.csv"
    with pytest.raises(LiveError, match=told) as error:
        play(bench, Commands(rig, Bench(settle=1.0)), protocol(), path)
    assert "device = simulated: stopped after 1." in str(error.value)
    assert "the safe command (valve_command = 5 V) was written" in str(error.value)
    assert written(bench)[-1] == 5.0
    assert str(path) in str(error.value)
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    assert 0.4 < rows[-1, 0] < 0.6


def test_a_device_that_is_unplugged_keeps_what_was_recorded(rig, tmp_path):
    class Unplugged(SimulatedBench):
        name = "/dev/ttyACM0"

        def write(self, command):
            if self.clock.now() > 1.5:
                raise OSError(5, "Input/output error", self.name)
            super().write(command)

    path = tmp_path / "run.csv"
    with pytest.raises(LiveError, match=r"device = /dev/ttyACM0: .*Input/output error") as error:
        play(Unplugged(rig), Commands(rig, Bench(settle=1.0)), protocol(), path)
    assert "the safe command 5" in str(error.value)
    assert "could not be written" in str(error.value)
    assert len(path.read_text().splitlines()) > 20


def test_a_command_of_the_wrong_sign_is_seen_before_anything_is_recorded(rig, tmp_path):
    class Swapped(SimulatedBench):
        def write(self, command):
            super().write(
                10.0 - command["valve_command"] if isinstance(command, dict) else 10.0 - command
            )

    bench, path = Swapped(rig), tmp_path / "run.csv"
    with pytest.raises(
        LiveError, match="valve_command = 3.75 V, below null_voltage = 5 V, vents by"
    ) as error:
        play(bench, Commands(rig, Bench()), protocol(), path)
    assert "the sign of the command is wrong" in str(error.value)
    assert written(bench)[-1] == 5.0
    assert path.read_text() == ""


@pytest.mark.parametrize("begins", [0.5e5, 2e5, 3e5])
def test_chambers_come_to_where_a_run_begins_whatever_the_safe_commands_are(begins, tmp_path):
    rig, path = pamrs.rigs.antagonistic_joint(), tmp_path / "run.csv"
    (one,) = library(rig, DiagnosisSettings(), sample_time=PERIOD, only=["fast_triangle"])
    names = [f"chamber.{side}.initial_pressure" for side in ("flexor", "extensor")]
    bench = SimulatedBench(rig.with_parameters(dict.fromkeys(names, begins)))
    safe = {"valve_command.flexor": 0.0, "valve_command.extensor": 0.0}
    play(bench, Commands(rig, Bench(safe=safe, settle=8.0)), protocol_of(one), path)
    recording = pamrs.load_recording(path)
    for side in ("flexor", "extensor"):
        assert recording.channels[f"muscle_pressure.{side}"][0] == pytest.approx(2e5, rel=0.1)
    assert written(bench)[0] == written(bench)[-1]


def test_before_a_run_a_valve_stays_within_its_limits(tmp_path):
    rig = pamrs.rigs.antagonistic_joint()
    names = ("valve_command.flexor", "valve_command.extensor")
    limits = dict.fromkeys(names, (4.0, 5.25))
    empty = dict.fromkeys(
        ("chamber.flexor.initial_pressure", "chamber.extensor.initial_pressure"), 0.0
    )
    bench, still = SimulatedBench(rig.with_parameters(empty)), np.arange(3) * PERIOD
    sent = Protocol("x", still, dict.fromkeys(names, np.full(3, 5.0)), dict.fromkeys(names, "V"))
    play(bench, Commands(rig, Bench(limits=limits, settle=1.0)), sent, tmp_path / "run.csv")
    assert max(max(command.values()) for command in written(bench)) == 5.25


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_full_disk_stops_the_run_and_is_named(rig, tmp_path, monkeypatch):
    full = tmp_path / "full.csv"
    original = Path.open
    monkeypatch.setattr(
        Path,
        "open",
        lambda path, *a, **k: (
            original(Path("/dev/full"), "w") if path == full else original(path, *a, **k)
        ),
    )
    bench = SimulatedBench(rig)
    with pytest.raises(LiveError, match=r"No space left on device: '.*full.csv'"):
        play(bench, Commands(rig, Bench(settle=1.0)), protocol(), full)
    assert written(bench)[-1] == 5.0


def test_what_the_rig_lacks_or_its_limits_forbid_is_refused(rig):
    refused(
        (
            "limits has 'valve_command.left', .*: the commands of rig 'shoulder' are valve_command",
            lambda: Commands(rig, Bench(limits={"valve_command.left": (3.0, 7.0)})),
        ),
        (
            r"safe\['valve_command'\] = 8 V is not allowed: from 3 to 7 V",
            lambda: Commands(
                rig, Bench(limits={"valve_command": (3.0, 7.0)}, safe={"valve_command": 8.0})
            ),
        ),
        (r"rest has 'supply_command'", lambda: Commands(rig, Bench(rest={"supply_command": 0.0}))),
        (
            r"limits\['valve_command'\] = \(7, 3\)",
            lambda: Commands(rig, Bench(limits={"valve_command": (7, 3)})),
        ),
        ("settle = -1", lambda: Commands(rig, Bench(settle=-1))),
    )


SLOW = """
import signal, sys, pamrs, numpy as np
from pathlib import Path
from pamrs.campaigns import Bench
from pamrs.campaigns._bench import Commands
from pamrs.campaigns._play import play
from pamrs.diagnosis import DiagnosisSettings
from pamrs.experiments import chains_of, library, protocol_of
from pamrs.findings import Protocol
# whoever runs the tests in the background has it ignored
signal.signal(signal.SIGINT, signal.default_int_handler)
class Still:
    clock = None
    def read(self): return {"muscle_pressure": 1e5, "joint_angle": 0.5, "supply_pressure": 1e6}
    def write(self, command): print(command, flush=True)
time = np.arange(3000) * 0.01
sent = Protocol("x", time, {"valve_command": np.full(3000, 5.2)}, {"valve_command": "V"})
play(Still(), Commands(pamrs.rigs.shoulder(), Bench(settle=0.1)), sent, Path(sys.argv[1]))
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_a_signal_loses_no_row(tmp_path, number):
    path = tmp_path / "run.csv"
    run = subprocess.Popen(
        [sys.executable, "-c", SLOW, str(path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    for _ in range(600):
        if path.exists() and len(path.read_text().splitlines()) > 30:
            break
        time.sleep(0.05)
    os.kill(run.pid, number)
    told, _ = run.communicate(timeout=20)
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    sent = [line for line in told.splitlines() if line == "5.2"]
    assert len(rows) > 25
    assert abs(len(rows) - len(sent)) <= 1  # a row is there as soon as its command is
    assert (rows[:, 1] == 5.2).all()
    if number != signal.SIGKILL:
        assert told.splitlines()[-1] == "5.0"
        assert run.returncode != 0
