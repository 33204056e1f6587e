"""Small logs in the dialects, clocks and cells of laboratories: each is read right, and what was
done to it is told.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from pamrs.errors import RecordingError
from pamrs.recordings import Recording, load_recording, load_recordings, propose
from pamrs.recordings._clock import ticks
from tests.recordings.written import SHOULDER, case_of, write_json_messages

Array = NDArray[np.float64]
N, DT = 200, 0.02
HEAD = ["valve [V]", "p_muscle [bar]", "angle [deg]"]
EPOCH = 1_669_066_123
NOON = datetime(2022, 11, 22, 10, 16, 51, 120_000)


def signals() -> Array:
    """Seconds, volts, bar and degrees, the same in every log."""
    time = np.arange(N) * DT
    lift = np.sin(np.pi * time / 1.9) ** 2
    volts = np.where((time // 0.5) % 2 == 0, 7.0, 3.0)
    return np.column_stack(
        [time, volts, np.round(0.2 + 1.8 * lift, 4), np.round(20 + 30 * lift, 3)]
    )


DATA = signals()


def rows(clock: Callable[[int], str], sep: str = ",", data: Array = DATA) -> list[str]:
    """A line for each sample, its time written by a function of its number."""
    return [
        sep.join([clock(i), f"{u:g}", f"{p:.4f}", f"{a:.3f}"])
        for i, (_, u, p, a) in enumerate(data.tolist())
    ]


def table(name: str, clock: Callable[[int], str], sep: str = ",") -> str:
    return "\n".join([sep.join([name, *HEAD]), *rows(clock, sep)]) + "\n"


def plain(i: int) -> str:
    return f"{DT * i:.2f}"


def date(form: str, start: datetime = NOON, digits: int = 3) -> Callable[[int], str]:
    """Times by ``strftime``, ``%f`` to some digits."""

    def written(i: int) -> str:
        now = start + timedelta(seconds=DT * i)
        return now.strftime(form.replace("%f", f"{now.microsecond:06d}"[:digits]))

    return written


def changed(*edits: Callable[[list[str]], Any]) -> str:
    """A plain log with some lines edited in place; line 0 has the headings."""
    lines = table("time [s]", plain).splitlines()
    for edit in edits:
        edit(lines)
    return "\n".join(lines) + "\n"


def each_row(edit: Callable[[int, list[str]], Any]) -> Callable[[list[str]], None]:
    """An edit of the cells of every row, by its number."""

    def edited(lines: list[str]) -> None:
        for row in range(1, len(lines)):
            parts = lines[row].split(",")
            edit(row - 1, parts)
            lines[row] = ",".join(parts)

    return edited


def cells(row: int, place: int, word: str) -> Callable[[list[str]], None]:
    def edit(at: int, parts: list[str]) -> None:
        parts[place] = word if at == row - 1 else parts[place]

    return each_row(edit)


def swap(lines: list[str]) -> None:
    for a, b in ((50, 51), (120, 122)):
        lines[a], lines[b] = lines[b], lines[a]


def newest_first(lines: list[str]) -> None:
    lines[1:] = lines[:0:-1]


def thin(places: dict[int, int]) -> str:
    """A log in which the cell at a place is filled in every so many rows only."""

    def edit(row: int, parts: list[str]) -> None:
        for place, every in places.items():
            parts[place] = "" if row % every else parts[place]

    return changed(each_row(edit))


def on_change() -> str:
    def edit(row: int, parts: list[str]) -> None:
        parts[1] = "" if row and DATA[row, 1] == DATA[row - 1, 1] else parts[1]

    return changed(each_row(edit))


def interleaved() -> str:
    """A row for each message: of the pressure, of the angle, of the command, at one time."""
    lines = [",".join(["time [s]", *HEAD])]
    for i, (_, u, p, a) in enumerate(DATA.tolist()):
        lines += [f"{plain(i)},{u:g},,", f"{plain(i)},,{p:.4f},", f"{plain(i)},,,{a:.3f}"]
    return "\n".join(lines)


def restarted(first: int, clock: Callable[[int], str] = plain, head: bool = False) -> str:
    """The first samples, then all of them from the beginning."""
    top = ",".join(["time [s]", *HEAD])
    begun = rows(clock)[:first]
    return "\n".join([top, *begun, *([top] if head else []), *rows(clock)]) + "\n"


def turned(low: float) -> str:
    """An encoder that starts again after a full turn, on an axis that is off by 330 or 150."""
    off = -30.0 if low == 0.0 else 150.0

    def edit(row: int, parts: list[str]) -> None:
        parts[3] = f"{(DATA[row, 3] + off - low) % 360.0 + low:.3f}"

    return changed(each_row(edit))


def packets() -> str:
    """Five to eight rows at a time, stamped when they came."""
    lines, at = [",".join(["time [s]", *HEAD])], 0
    body = rows(plain)
    for size in [5, 8, 6, 7, 5, 8, 8, 5, 6, 7] * 4:
        for line in body[at : at + size]:
            lines.append(f"{DT * (min(at + size, N) - 1):.2f},{line.split(',', 1)[1]}")
        at += size
    return "\n".join(lines)


def labelled(form: str) -> str:
    return "\n".join(
        form.format(t=t, u=u, p=p, a=a, clock=date("%H:%M:%S.%f")(i))
        for i, (t, u, p, a) in enumerate(DATA.tolist())
    )


class Case(NamedTuple):
    text: str
    told: tuple[str, ...] = ()
    offset: float = 0.0  # of the angle [deg]
    parts: int = 1
    rate: float = 1.0  # samples of the grid for each one of the log
    lost: int = 0  # samples of the log that are missing or masked in some channel
    near: float = 1e-3  # error over the range of the channel, of times that were guessed


def stamped(scale: int) -> Callable[[int], str]:
    return lambda i: str(EPOCH * scale + i * scale // 50)


CLOCKS = {
    "seconds": Case(table("time [s]", plain)),
    "milliseconds": Case(table("time (ms)", lambda i: f"{20 * i}")),
    "no unit": Case(table("time", plain), ("s is taken by their size",)),
    "millis": Case(table("millis", lambda i: f"{51000 + 20 * i}"), ("ms by name",)),
    "micros": Case(table("micros()", lambda i: f"{7_000_000 + 20_000 * i}"), ("us by name",)),
    "nanos": Case(table("t_ns", lambda i: f"{20_000_000 * i}")),
    "epoch s": Case(table("epoch", lambda i: f"{EPOCH + DT * i:.2f}"), ("s is taken",)),
    "epoch ms": Case(table("timestamp", stamped(1000)), ("ms is taken by their size",)),
    "epoch us": Case(table("ts", stamped(10**6)), ("us is taken by their size",)),
    "epoch ns": Case(table("timestamp", stamped(10**9)), ("ns is taken by their size",)),
    "wrong unit": Case(table("time [us]", stamped(10**9)), ("cannot be us: ns is taken",)),
    "uptime": Case(table("uptime_ms", lambda i: f"{5 * 10**8 + 20 * i}")),
    "elapsed": Case(table("Elapsed", plain), ("s is taken",)),
    "index": Case(table("Laufzeit [min]", lambda i: f"{DT * i / 60:.9f}")),
    "days": Case(table("Datum", lambda i: f"{44887 + DT * i / 86400:.10f}"), ("d is taken",)),
    "sec and nanosec": Case(
        table("stamp.sec,stamp.nanosec", lambda i: f"{EPOCH + i // 50},{20_000_000 * (i % 50)}"),
        ("stamp.sec and stamp.nanosec are one clock",),
    ),
    "tv_sec and tv_usec": Case(
        table("tv_sec,tv_usec", lambda i: f"{EPOCH + i // 50},{20_000 * (i % 50)}"),
        ("tv_sec and tv_usec are one clock",),
    ),
    "seconds and millis": Case(
        table("seconds,millis", lambda i: f"{7 + i // 50},{20 * (i % 50)}"),
        ("seconds and millis are one clock",),
    ),
    "dates and milliseconds": Case(
        table("Zeitstempel,ms", date("%d.%m.%Y %H:%M:%S,%f")),
        ("Zeitstempel and ms are one clock, here Zeitstempel",),
    ),
    "dates beside a finer clock": Case(
        table("Timestamp,Elapsed ms", lambda i: f"{date('%m/%d/%Y %I:%M:%S %p')(i)},{20 * i}")
    ),
    "German dates": Case(table("Zeitstempel", date("%d.%m.%Y %H:%M:%S,%f"), ";")),
    "ISO": Case(table("when", date("%Y-%m-%dT%H:%M:%S.%fZ"))),
    "ISO with a zone": Case(table("datetime", date("%Y-%m-%d %H:%M:%S.%f+01:00", digits=6))),
    "American dates": Case(table("Moment", date("%m/%d/%Y %I:%M:%S.%f %p"))),
    "British dates": Case(table("Date", date("%d/%m/%Y %H:%M:%S.%f"))),
    "two digits of the year": Case(table("Wann", date("%d.%m.%y %H:%M:%S.%f"))),
    "dates in two ways": Case(
        table("when", date("%m/%d/%Y %H:%M:%S.%f", datetime(2022, 11, 9, 23, 59, 58))),
        ("read with the month first",),
    ),
    "noon": Case(
        table("when", date("%m/%d/%Y %I:%M:%S.%f %p", datetime(2022, 11, 22, 11, 59, 58)))
    ),
    "midnight": Case(table("Uhrzeit", date("%H:%M:%S.%f", datetime(2022, 11, 9, 23, 59, 58)))),
    "colons": Case(table("clock", date("%H:%M:%S:%f"))),
    "names of months": Case(table("when", date("%d-%b-%Y %H:%M:%S.%f"))),
    "names of months first": Case(
        table("when", lambda i: '"' + date("%b %d, %Y %I:%M:%S.%f %p")(i) + '"')
    ),
    "minutes, as Excel saves them": Case(
        table("when", date("%M:%S.%f", datetime(2022, 11, 9, 23, 59, 58), digits=2))
    ),
    "date beside time": Case(table("Date,Time", date("%d.%m.%Y,%H:%M:%S.%f"))),
    "16 bits": Case(
        table("millis", lambda i: f"{(64_536 + 20 * i) % 65_536}"), ("a clock of 16 bits: 1",)
    ),
    "16 bits, often": Case(
        table("t [us]", lambda i: f"{(20_000 * i) % 65_536}"), ("a clock of 16 bits: 60",)
    ),
    "32 bits": Case(
        table("micros", lambda i: f"{(2**32 - 10**6 + 20_000 * i) % 2**32}"),
        ("a clock of 32 bits: 1",),
    ),
    "32 bits with a sign": Case(
        table("micros", lambda i: f"{(2**31 - 10**6 + 20_000 * i + 2**31) % 2**32 - 2**31}"),
        ("a clock of 32 bits: 1",),
    ),
    "32 bits in seconds": Case(
        table("time [s]", lambda i: f"{((2**32 - 10**6 + 20_000 * i) % 2**32) * 1e-6:.6f}"),
        ("a clock of 32 bits: 1",),
    ),
    "whole seconds": Case(
        table("when", date("%d.%m.%Y %H:%M:%S")),
        ("200 rows have 5 different times (up to 50 rows of one)",),
    ),
    "whole milliseconds of 200 in a packet": Case(
        table("time [ms]", lambda i: f"{20 * (i // 4 * 4)}"), ("up to 4 rows of one",)
    ),
    "packets": Case(packets(), ("spread evenly over the time before it",), near=0.02),
}
CELLS = {
    "bad cells": Case(
        changed(cells(41, 2, "OL"), cells(43, 3, "#N/A"), cells(60, 2, "1.#INF")),
        ("2 cells are no numbers ('OL', '1.#INF')", "1 cell is no number ('#N/A')"),
        lost=3,
    ),
    "NaN": Case(changed(cells(41, 2, "NaN"), cells(43, 3, "--"), cells(45, 3, "")), lost=3),
    "a bad time": Case(changed(cells(41, 0, "0.7.8")), ("rows without a time: 1",), lost=1),
    "a line cut short": Case(
        changed(lambda lines: lines.__setitem__(-1, lines[-1][:7])),
        ("rows with fewer than 4 cells: 1",),
        lost=1,
    ),
    "a line too long": Case(
        changed(lambda lines: lines.__setitem__(70, lines[70] + "," + lines[71])),
        ("rows with more than 4 cells: 1",),
        lost=1,
    ),
    "swapped rows": Case(changed(swap), ("rows that come after later ones",)),
    "newest first": Case(changed(newest_first), ("the newest row comes first",)),
    "newest first, swapped rows": Case(
        changed(newest_first, swap),
        ("the newest row comes first", "rows that come after later ones"),
    ),
    "newest first, whole seconds of a date": Case(
        "\n".join(
            (lines := table("when", date("%d.%m.%Y %H:%M:%S")).splitlines())[:1] + lines[:0:-1]
        ),
        ("the newest row comes first", "200 rows have 5 different times"),
    ),
    "rows twice": Case(
        changed(lambda lines: lines.__setitem__(slice(30, 35), [*lines[30:35], *lines[34:35]])),
        ("rows that are there twice: 1",),
    ),
    "slow pressure": Case(thin({2: 5}), ("40 of 200 rows have a value of it",), near=0.2),
    "slow command": Case(thin({1: 5}), ("held until the next one",)),
    "on change": Case(on_change(), ("8 of 200 rows have a value of it: held",)),
    "a row for each message": Case(interleaved(), ("200 of 600 rows have a value of it",)),
    "the headings again": Case(restarted(N, head=True), ("a recording starts again: 1",), parts=2),
    "the headings again, the clock goes on": Case(
        changed(lambda lines: lines.insert(101, lines[0])), ("starts again: 1",), parts=-2
    ),
    "a clock that starts again": Case(restarted(N), parts=2),
    "a start that was given up": Case(restarted(5), ("1 of 2 parts have fewer than 32 samples",)),
    "a turn from 0": Case(turned(0.0), ("leaps by a full turn: ",), offset=-30.0),
    "a turn from -180": Case(turned(-180.0), ("leaps by a full turn: ",), offset=150.0),
    "lines above": Case(
        "Stand 3\nOperator;A. B.\n\n" + table("time [s]", plain), ("lines above the headings: 2",)
    ),
    "labels": Case(labelled("t:{t:.2f},valve:{u:g},p_muscle:{p:.4f},angle:{a:.3f}")),
    "labels with units": Case(
        labelled("t = {t:.2f} s; valve = {u:g} V; p_muscle = {p:.4f} bar; angle = {a:.3f} deg")
    ),
    "labels in lines of their own": Case(
        labelled("t: {t:.2f}\nvalve: {u:g}\np_muscle: {p:.4f}\nangle: {a:.3f}")
    ),
    "points that part thousands": Case(
        "\n".join(
            ["time [ms];valve [V];p_muscle [Pa];angle [deg]"]
            + [
                f"{f'{20 * i:,}'.replace(',', '.')};{u:g};"
                f"{f'{1e5 * p:,.0f}'.replace(',', '.')};{f'{a:.3f}'.replace('.', ',')}"
                for i, (_, u, p, a) in enumerate(DATA.tolist())
            ]
        ),
        ("time: points part thousands", "p_muscle: points part thousands"),
    ),
    "decimal commas in quotes": Case(
        "\n".join(
            [
                '"' + line.replace(".", ",").replace(";", '","') + '"'
                for line in table("time [s]", plain, ";").splitlines()
            ]
        )
    ),
    "the rest of an earlier run above the headings": Case(
        "3,0.5211,31.22\n4.98,3,0.5211,31.22\n" + table("time [s]", plain),
        ("lines above the headings: 2",),
    ),
    "objects": Case(
        labelled('{{"t": {t:.2f}, "valve": {u:g}, "p_muscle": {p:.4f}, "angle": {a:.3f}}}')
    ),
    "an arrow and labels": Case(
        labelled("{clock} -> valve:{u:g}\tp_muscle:{p:.4f}\tangle:{a:.3f}")
    ),
    "an arrow and headings": Case(
        "10:16:51.000 -> valve [V],p_muscle [bar],angle [deg]\n"
        + labelled("{clock} -> {u:g},{p:.4f},{a:.3f}")
    ),
}
TABLE = {
    f"{kind}: {name}": case
    for kind, cases in (("clock", CLOCKS), ("cells", CELLS))
    for name, case in cases.items()
}


def imported(folder: Path, log: bytes) -> tuple[list[Recording], str]:
    """The recordings of a log by the case that is proposed for it, and what is told."""
    (folder / "log.csv").write_bytes(log)
    proposal = propose([folder / "log.csv"], SHOULDER)
    (item,) = proposal.logs
    told = "\n".join([*item.log.remarks, *item.remarks])
    return case_of(folder, proposal).recordings, told


@pytest.mark.parametrize("name", TABLE)
def test_a_log_is_read_right_and_what_was_done_is_told(tmp_path: Path, name: str) -> None:
    case = TABLE[name]
    recordings, told = imported(tmp_path, case.text.encode())
    assert all(words in told for words in case.told), told
    issues = "\n".join(issue.text for issue in recordings[0].issues)
    by_import = ("taken", "by name", "parts have")  # which case.toml says from then on
    done = [words for words in case.told if not any(word in words for word in by_import)]
    assert all(words in issues for words in done), issues
    if not case.told:
        assert not [line for line in told.splitlines() if "left out" in line or "sorted" in line]
    assert len(recordings) == abs(case.parts)
    for place, recording in enumerate(recordings):
        check(recording, case, place * 100 if case.parts < 0 else 0)


def check(recording: Recording, case: Case, first: int) -> None:
    """That a recording has the signals from a sample on."""
    expected = 100 if case.parts < 0 else N
    assert recording.sample_time == pytest.approx(DT, rel=2e-3)
    assert abs(len(recording) - expected) <= max(case.lost, 1) + 6 * (case.near > 0.01)
    at = first * DT + recording.time
    wanted = {
        "valve_command": DATA[:, 1],
        "muscle_pressure": 1e5 * DATA[:, 2],
        "joint_angle": np.radians(DATA[:, 3] + case.offset),
    }
    assert set(recording.channels) == set(wanted)
    for channel, values in recording.channels.items():
        used = recording.mask[channel]
        assert used.sum() >= 0.9 * expected - case.lost
        if channel == "valve_command":  # it holds
            clean = wanted[channel][np.minimum(np.floor(at / DT + 0.5).astype(int), N - 1)]
            assert np.mean(np.abs(values - clean)[used] > 1e-6) < 0.05
        else:
            error = np.abs(values - np.interp(at, DATA[:, 0], wanted[channel]))[used]
            assert error.max() <= case.near * np.ptp(wanted[channel])


KNOWN = "time [s],valve_command [V],muscle_pressure [bar],joint_angle [deg]"


@pytest.mark.parametrize(
    "name",
    ["bad cells", "NaN", "a bad time", "a line cut short", "a line too long", "swapped rows"]
    + ["rows twice", "slow pressure", "slow command", "on change", "a row for each message"]
    + ["a turn from 0", "a turn from -180"],
)
def test_headings_that_say_it_all_are_read_in_the_same_way(tmp_path: Path, name: str) -> None:
    case = CELLS[name]
    first, _, rest = case.text.partition("\n")
    assert first == ",".join(["time [s]", *HEAD])
    (tmp_path / "log.csv").write_text(f"{KNOWN}\n{rest}", encoding="utf-8")
    recording = load_recording(tmp_path / "log.csv")
    told = "\n".join(issue.text for issue in recording.issues)
    for words in case.told:
        assert words.replace("with fewer than", "").replace("with more than", "")[-10:] in told
    check(recording, case, 0)


def test_counters_overflow_in_a_table_that_says_it_all(tmp_path: Path) -> None:
    text = table("time [ms]", lambda i: f"{(64_536 + 20 * i) % 65_536}")
    known = KNOWN.replace("time [s]", "time [ms]")
    (tmp_path / "log.csv").write_text(known + text[text.index("\n") :], encoding="utf-8")
    recording = load_recording(tmp_path / "log.csv")
    assert "a clock of 16 bits: 1" in recording.issues[0].text
    check(recording, CLOCKS["16 bits"], 0)


@pytest.mark.parametrize("bits", [2.0**32 / 1e3, 2.0**32 / 1e6, 2.0**16 / 1e3, 2.0**16 / 1e6])
@pytest.mark.parametrize("rows", [1, 10, 19, 60])
def test_counters_overflow_near_the_end_of_a_log(bits: float, rows: int) -> None:
    """What comes after it is not late: a log ends with it."""
    time = 0.005 * np.arange(400.0)
    found = ticks(np.mod(time - time[-rows], bits))
    np.testing.assert_allclose(found.time - found.time[0], time, atol=1e-5)
    assert (found.rows == np.arange(400)).all()


EVEN, GROWING = np.arange(40.0), np.cumsum(0.01 * 1.2 ** np.arange(19))
RESTARTED = {
    "ten rows at 1 s, then 240 at 0.5 s": [EVEN[:10], 0.5 * np.arange(240)],
    "the same from another second": [EVEN[:10] + 3.0, 0.3 + 0.5 * np.arange(240)],
    "five pairs of them": [EVEN[:10], 0.5 * np.arange(240)] * 5,
    "42 parts whose steps grow": [GROWING] * 42,
    "42 parts, each faster than the last": [GROWING * 0.97**k for k in range(42)],
    "a start that was given up": [EVEN[:2], EVEN],
    "two rows before each part": [35.0 * EVEN[:2], EVEN[:18]] * 3,
    "one row near the end": [0.005 * np.arange(400.0), 0.3021 * np.ones(1)],
    "rows of another moment near the end": [0.005 * np.arange(400.0), 0.3021 + 0.005 * EVEN[:19]],
    "the first rows again at the end": [0.005 * np.arange(400.0), 0.005 * EVEN[:10]],
    "a clock that was set back": [10.0 * EVEN[:3], 15.0 + 10.0 * EVEN],
}


@pytest.mark.parametrize("name", RESTARTED)
def test_a_clock_that_starts_again_is_a_restart(name: str) -> None:
    """Ten rows of a leak-down at 1 s, and the log again at 0.5 s, interleaved: one recording of a
    wrong clock.
    """
    parts = RESTARTED[name]
    found = ticks(np.concatenate(parts))
    np.testing.assert_array_equal(found.time, np.concatenate(parts))
    assert found.remarks == ()


@pytest.mark.parametrize("parts", [1, 2, 42])
def test_parts_of_a_log_stay_as_they_were_written(tmp_path: Path, parts: int) -> None:
    head = ",".join(["time [s]", *HEAD])
    text = "\n".join([head, *["0,5,1,20", "0.7,5,1,20", *rows(plain)[:18]] * parts])
    found = loaded(tmp_path, text, split="clock")
    assert [len(each) for each in found] == [2, 18] * parts
    (whole,) = loaded(tmp_path, text)
    assert any("split = 'clock' in case.toml" in issue.text for issue in whole.issues)


LATE = {
    "one": [0, 1, 2, 4, 3, 5, 6],
    "the first": [1, 0, 2, 3, 4],
    "each second": [1, 0, 3, 2, 5, 4, 7, 6],
    "a packet": [0, 1, 2, 6, 7, 3, 4, 5, 8, 9],
    "a packet, the last first": [0, 1, 2, 6, 5, 4, 3, 7, 8],
    "two writers": [0, 2, 4, 6, 8, 1, 3, 5, 7, 9, 10, 11, 12],
    "at the end": [*range(200), *range(202, 400), 200, 201],
    "the last but one": [0, 1, 2, 4, 3],
}


@pytest.mark.parametrize("name", LATE)
@pytest.mark.parametrize("jitter", [0.0, 0.1])
def test_rows_that_came_late_are_sorted(name: str, jitter: float) -> None:
    order = np.array(LATE[name])
    time = np.sort(order + np.random.default_rng(3).uniform(-jitter, jitter, len(order)))
    found = ticks(time[order])
    np.testing.assert_array_equal(found.time, time)
    assert "rows that come after later ones" in found.remarks[0]


CHANNELS = {
    "valve_command": {"column": "valve", "unit": "V"},
    "muscle_pressure": {"column": "p_muscle", "unit": "bar"},
    "joint_angle": {"column": "angle", "unit": "deg"},
}


def loaded(folder: Path, text: str, **options: Any) -> list[Recording]:
    (folder / "log.csv").write_text(text, encoding="utf-8")
    options = {"channels": CHANNELS, "time": "time", **options}
    return load_recordings(folder / "log.csv", **options)


def test_parts_keep_their_numbers_where_a_shorter_one_is_left_out(tmp_path: Path) -> None:
    text = changed(lambda lines: lines.insert(1, "5.00,5,0.2,20"))
    (both,) = loaded(tmp_path, text, split="clock")
    assert both.name == "log_2"
    assert any("1 of 2 parts (1) are left out" in issue.text for issue in both.issues)
    for piece in (2, "2"):
        (second,) = loaded(tmp_path, text, split="clock", pieces=[piece])
        check(second, Case(text), 0)
    with pytest.raises(RecordingError, match="in part 1 a channel has fewer than 2 samples"):
        loaded(tmp_path, text, split="clock", pieces=[1])
    with pytest.raises(RecordingError, match="there is no part 3"):
        loaded(tmp_path, text, split="clock", pieces=[3])


def test_a_slower_channel_is_cut_with_the_rows_of_its_log(tmp_path: Path) -> None:
    head, *lines = thin({2: 5, 1: 5}).splitlines()
    late = [f"{float(time) + 60:.2f},{rest}" for time, rest in (x.split(",", 1) for x in lines)]
    for split, second in (
        ("clock", lines),
        ({"gap": 1.0}, late),
        ({"column": "part"}, [head, *lines]),
    ):
        parts = loaded(tmp_path, "\n".join([head, *lines, *second]), split=split)
        assert len(parts) == 2
        for each in parts:
            check(each, Case("", near=0.2), 0)


def test_a_unit_that_the_size_of_the_stamps_contradicts_is_refused(tmp_path: Path) -> None:
    text = table("time", stamped(10**9))
    with pytest.raises(RecordingError, match=r"which cannot be us: ns is taken.* unit = 'ns'"):
        loaded(tmp_path, text, time={"column": "time", "unit": "us"})
    (read,) = loaded(tmp_path, text, time={"column": "time", "unit": "ns"})
    check(read, CLOCKS["epoch ns"], 0)


def test_a_clock_that_was_set_back_is_not_sorted_and_no_overflow(tmp_path: Path) -> None:
    """Rows 100 on are 50 ms early: they would fall between those before."""
    text = table("time [s]", lambda i: f"{DT * i - 0.05 * (i >= 100):.2f}")
    (read,) = loaded(tmp_path, text)
    assert [issue.kind for issue in read.issues] == ["clock_jump"]
    assert "steps back by 0.03 s" in read.issues[0].text
    assert read.valid().sum() == N


def test_recordings_of_one_encoder_lie_on_one_turn(tmp_path: Path) -> None:
    """An encoder of several turns that was switched on a turn later: the joint of the rig goes from
    15 to 120 deg.
    """
    toml = 'schema = "pamrs.case/1"\n'
    for name, angle in (("a", DATA[:, 3]), ("b", np.full(N, 382.0) + 0.01 * (np.arange(N) % 3))):
        lines = rows(plain, data=np.column_stack([DATA[:, :3], angle]))
        (tmp_path / f"{name}.csv").write_text("\n".join([KNOWN, *lines]), encoding="utf-8")
        toml += f'[[recording]]\nfile = "{name}.csv"\n'
    first, second = case_of(tmp_path, toml).recordings
    assert [issue.kind for issue in first.issues] == []
    assert second.issues[0].text == "-1 turns, which puts it between the ends in the rig file"
    np.testing.assert_allclose(np.degrees(second.channels["joint_angle"]), 22.0, atol=0.03)


def test_a_clock_that_is_coarser_than_the_samples_gives_their_rate(tmp_path: Path) -> None:
    """1500 Hz by a clock in milliseconds, with a pause: one and two rows of each stamp."""
    time = np.arange(3000) / 1500.0 + 0.5 * (np.arange(3000) >= 2000)
    wanted = 1.0 + np.sin(9.0 * time)
    lines = [f"{int(1e3 * t)},5,{p:.5f},20" for t, p in zip(time, wanted, strict=True)]
    text = "\n".join([",".join(["time [ms]", *HEAD]), *lines])
    (read,) = loaded(tmp_path, text)
    assert read.sample_time == pytest.approx(1.0 / 1500.0, rel=1e-3)
    assert [issue.kind for issue in read.issues if issue.channel == "time"] == ["log", "gap"]
    used = read.mask["muscle_pressure"]
    assert used.sum() >= 2990
    clean = 1e5 * (1.0 + np.sin(9.0 * read.time))
    assert np.max(np.abs(read.channels["muscle_pressure"] - clean)[used]) < 9e5 * 1e-3


def test_a_dropout_of_an_encoder_is_no_turn(tmp_path: Path) -> None:
    def edit(row: int, parts: list[str]) -> None:
        parts[3] = "0.000" if row == 89 else f"{DATA[row, 3] + 280:.3f}"

    (read,) = loaded(tmp_path, changed(each_row(edit)))
    assert [issue.kind for issue in read.issues] == ["outlier"]
    assert np.nanmin(read.channels["joint_angle"]) > np.radians(299.0)


def test_arrival_is_a_clock_to_choose(tmp_path: Path) -> None:
    """Messages that arrived 2 to 14 ms late: by their stamps 200 Hz, by arrival in pairs."""
    log = tmp_path / "run.mcap"
    late = np.where(np.arange(N) % 2, 0.002, 0.0065)
    write_stamped(log, DT * np.arange(N), late)
    channels = {"muscle_pressure": {"column": "/rig/p1", "unit": "bar"}}
    (stamps,) = load_recordings(log, channels=channels)
    assert stamps.sample_time == pytest.approx(DT)
    assert "which arrived 4.25 ms later in the middle (2 to 6.5 ms)" in stamps.issues[0].text
    np.testing.assert_allclose(stamps.channels["muscle_pressure"], 1e5 * np.arange(N))
    (arrived,) = load_recordings(log, channels=channels, time="/rig/arrival")
    error = np.abs(arrived.channels["muscle_pressure"] - 1e5 * np.arange(len(arrived)))
    assert 0.05e5 < np.nanmax(error) < 0.5e5
    other = tmp_path / "boot.mcap"
    write_stamped(other, DT * np.arange(N), late, epoch=5)
    (boot,) = load_recordings(other, channels=channels)
    assert "the stamps are of another clock" in boot.issues[0].text
    np.testing.assert_allclose(boot.channels["muscle_pressure"], 1e5 * np.arange(N))


def write_stamped(path: Path, sent: Array, late: Array, epoch: int = EPOCH) -> None:
    """Messages in JSON with a header, as bridges of ROS write them."""
    sends = []
    for row, (at, delay) in enumerate(zip(sent, late, strict=True)):
        nanos = round(at * 1e9)
        stamp = {"sec": epoch + nanos // 10**9, "nanosec": nanos % 10**9}
        arrived = EPOCH * 10**9 + nanos + round(delay * 1e9)
        sends.append((arrived, arrived, {"header": {"stamp": stamp}, "p1": float(row)}))
    write_json_messages(path, "/rig", sends)
