"""A board at a serial port, behind a pseudo-terminal; what is said of boards that fail."""

import os
import re
import shutil
import subprocess
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import pamrs
from pamrs.campaigns import Bench
from pamrs.campaigns._bench import Commands
from pamrs.campaigns._play import play
from pamrs.campaigns.serial import SerialDevice, checked, signed
from pamrs.control.live import LiveError
from pamrs.errors import ParameterError
from pamrs.findings import Protocol
from tests.simulation.refusals import refused

pty = pytest.importorskip("pty")
SKETCH = Path(__file__).parents[2] / "examples" / "pamrs_board.ino"
HELLO = "pamrs valve_command > time muscle_pressure supply_pressure joint_angle"


class Board:
    """The board of ``examples/pamrs_board.ino`` at the other end of a pseudo-terminal; `bend`
    changes its answers, None is none.
    """

    def __init__(self, bend=lambda board, number, answer: answer):
        self.bend, self.held, self.asked, self.told = bend, [], 0, 0.0
        self.master, slave = pty.openpty()
        self.port = os.ttyname(slave)
        self.slave, self.began, self.gone = slave, time.monotonic(), False
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        rest = b""
        while True:
            rest += os.read(self.master, 1000)
            if self.gone:
                os.close(self.master)
                os.close(self.slave)
                return
            while b"\n" in rest:
                line, _, rest = rest.partition(b"\n")
                words = checked(line.decode().strip())
                if words:
                    answer = self.bend(self, words[0], f"{words[0]} {self.answer(words[1:])}")
                    if answer is not None:
                        os.write(self.master, (signed(answer) + "\n").encode())

    def answer(self, words):
        self.asked += 1
        if words[0] == "?":
            return HELLO
        if words[0] == "R":
            return f"{time.monotonic() - self.began:.6f} 1e5 1e6 0.5"
        value = float(words[1])
        if not 0.0 <= value <= 10.0:
            return "E beyond the limits of the board"
        self.held.append(value)
        return "OK"

    def unplug(self):
        self.gone = True


def sent(value=5.25, seconds=1.0):
    times = np.arange(round(seconds / 0.02) + 1) * 0.02
    return Protocol(
        "x", times, {"valve_command": np.full(times.size, value)}, {"valve_command": "V"}
    )


def test_lines_are_signed_and_wrong_ones_are_dropped():
    assert checked(signed("1 R")) == ["1", "R"]
    assert signed("1 ?") in Path(pamrs.campaigns.__path__[0], "serial.py").read_text()
    assert checked(signed("1 5.25").replace("5.25", "5.35")) == []
    assert checked("nonsense") == []


def test_commands_and_readings_pass_and_a_run_is_recorded(tmp_path):
    board = Board()
    device = SerialDevice(board.port)
    assert device.commands == ("valve_command",)
    assert device.channels == ("time", "muscle_pressure", "supply_pressure", "joint_angle")
    rig, path = pamrs.rigs.shoulder(), tmp_path / "run.csv"
    done = play(device, Commands(rig, Bench(settle=0.2)), sent(), path)
    recording = pamrs.load_recording(path)
    assert done.reason == "finished"
    assert set(recording.channels) == {"valve_command", *device.channels[1:]}
    assert board.held[0] == board.held[-1] == 5.0
    assert set(board.held) == {5.0, 3.75, 5.25}
    device.close()


def garbled(board, number, answer):
    """Every third line has a wrong digit, its checksum that of the right one."""
    if board.asked % 3 or "pamrs" in answer:
        return answer
    os.write(
        board.master, (signed(answer).replace("1e5", "9e5").replace("OK", "OO") + "\n").encode()
    )
    return None


def delayed(board, number, answer):
    """Every fourth answer comes when the next one is due."""
    if board.asked % 4 == 0 and "pamrs" not in answer:
        time.sleep(0.03)
    return answer


def test_a_late_answer_is_not_taken_for_the_next_one():
    board = Board(delayed)
    device = SerialDevice(board.port, timeout=0.02)
    times = []
    for _ in range(20):
        try:
            times.append(device.read()["time"])
        except TimeoutError:
            continue
    assert len(times) > 8
    assert (np.diff(times) > 0).all()
    device.close()


def test_a_garbled_line_is_no_reading():
    board = Board(garbled)
    device = SerialDevice(board.port, timeout=0.02)
    found = []
    for _ in range(12):
        try:
            found.append(device.read()["muscle_pressure"])
        except TimeoutError:
            found.append(None)
    assert set(found) == {1e5, None}
    device.close()


def test_what_the_board_refuses_is_said():
    board = Board()
    device = SerialDevice(board.port)
    with pytest.raises(
        OSError, match=r"the board refused .*12.0.*: beyond the limits of the board"
    ):
        device.write({"valve_command": 12.0})
    refused(
        ("command = {'left': 5.0} is not allowed", lambda: device.write({"left": 5.0})),
        ("command = nan is not allowed", lambda: device.write(float("nan"))),
    )
    device.close()


def test_a_port_that_is_none_or_at_another_rate_is_named(tmp_path):
    with pytest.raises(OSError, match="No such file or directory: '/dev/ttyNONE'"):
        SerialDevice("/dev/ttyNONE")
    silent = Board(lambda board, number, answer: None)
    with pytest.raises(TimeoutError, match=f"{silent.port}: nothing answered for 0.4 s"):
        SerialDevice(silent.port, patience=0.4)
    with pytest.raises(ParameterError, match="baud = 12345 is not allowed: one of .*9600"):
        SerialDevice(silent.port, baud=12345)
    other = Board(lambda board, number, answer: f"{number} hello")
    with pytest.raises(OSError, match="answered 'hello': no board of this protocol"):
        SerialDevice(other.port)


def test_a_cable_that_is_pulled_ends_the_run_and_keeps_it(tmp_path):
    board, path = Board(), tmp_path / "run.csv"
    device = SerialDevice(board.port)
    threading.Timer(0.9, board.unplug).start()
    rig = pamrs.rigs.shoulder()
    with pytest.raises(LiveError, match=f"device = {board.port}: .*could not be written"):
        play(device, Commands(rig, Bench(settle=0.2)), sent(seconds=5.0), path)
    assert len(path.read_text().splitlines()) > 10
    device.close()


def test_the_example_board_speaks_the_same():
    """The sketch has the greeting, the answers and the watchdog that the protocol asks for."""
    text = SKETCH.read_text()
    assert f'HELLO = "{HELLO}"' in text
    assert re.search(r"millis\(\) - heard > WATCHDOG\) \{ drive\(SAFE\)", text)
    for answer in ('"OK"', '"E "', "'?'", "'R'", "'W'"):
        assert answer in text


@pytest.mark.skipif(shutil.which("c++") is None, reason="no compiler")
def test_the_time_of_the_example_board_goes_on_where_its_counter_begins_again(tmp_path):
    text = SKETCH.read_text()
    own = re.search(r"^String now\(\) \{.*?^\}", text, re.MULTILINE | re.DOTALL).group()
    assert "loop() {\n  now();" in text
    source, program = tmp_path / "now.cpp", tmp_path / "now"
    source.write_text(
        "#include <cstdint>\n#include <cstdio>\n#include <iostream>\n#include <string>\n"
        "using String = std::string;\nuint32_t counted;\nuint32_t micros() { return counted; }\n"
        f"{own}\nint main() {{ for (uint64_t us = 0; us < 15000000000; us += 1000000001)\n"
        '{ counted = (uint32_t)us; std::cout << now() << "\\n"; } }\n'
    )
    subprocess.run(["c++", "-o", str(program), str(source)], check=True)
    told = subprocess.run([str(program)], capture_output=True, text=True, check=True).stdout
    assert told.split() == [f"{k * 1000}.{k:06d}" for k in range(15)]
