"""Small logs as instruments and loggers export them: each is read right, or what was not understood
is told. Nothing is read wrongly in silence.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import pamrs
from pamrs.diagnosis.prepare import prepare, questions
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.errors import RecordingError
from pamrs.recordings import LogProposal, load_recordings, propose
from pamrs.recordings._clock import reading_rows
from pamrs.recordings.logs import read_log
from tests.recordings.test_dialects import DATA, DT, Array, N, date
from tests.recordings.written import SHOULDER, case_of

HEAD = "time [s],valve [V],p_muscle [bar],angle [deg]"
NAMES, UNITS = ("time", "valve", "p_muscle", "angle"), ("s", "V", "bar", "deg")
ALL = {"valve_command", "muscle_pressure", "joint_angle"}
VALUES = {
    "valve_command": DATA[:, 1],
    "muscle_pressure": 1e5 * DATA[:, 2],
    "joint_angle": np.radians(DATA[:, 3]),
}
NIGHT = datetime(2026, 4, 14, 23, 59, 58)


class Dialect(NamedTuple):
    """A log: lines, the channels that are read, what is told, ending, factor on its time."""

    lines: Iterable[str]
    told: tuple[str, ...] = ()
    read: set[str] = ALL
    ending: str = ".csv"
    slower: float = 1.0


def written(form: str, *head: str, data: Array = DATA) -> list[str]:
    """Lines of a table: `form` has i, t, u, p and a of each row."""
    rows = enumerate(data.tolist())
    return [*head, *(form.format(i=i, t=t, u=u, p=p, a=a) for i, (t, u, p, a) in rows)]


def stamped(clock: Callable[[int], str], *head: str) -> list[str]:
    rows = written("{u:g},{p:.4f},{a:.3f}")
    return [*head, *(f"{clock(i)},{row}" for i, row in enumerate(rows))]


PLAIN = "{t:.2f},{u:g},{p:.4f},{a:.3f}"
CELLS = HEAD.replace("time [s],", "")
OBJECT = '{{"t": {t:.2f}, "valve": {u:g}, "p_muscle": {p:.4f}, "angle": {a:.3f}}}'
LONG = "{t:.2f},valve,{u:g},V\n{t:.2f},p_muscle,{p:.4f},bar\n{t:.2f},angle,{a:.3f},deg"
PAIRS = ("Timestamp,2020-03-16 17:04:51", "Interval,0.02", 'Channel name,"{0}"', 'Unit,"{1}"')
NI = [
    ",".join(pair.format(*each) for each in zip(NAMES[1:], UNITS[1:], strict=True))
    for pair in PAIRS
]
COLUMNS = dict(zip(NAMES, DATA.T.tolist(), strict=True))
ROUND = HEAD.replace("[", "(").replace("]", ")")
TEK = ["Record Length,200,", "Sample Interval,2.0e-02,", "Horizontal Units,s,", *[",,"] * (N - 3)]
SWITCH = "is called like valve_command, and is 0 for {} and 1 for {}, a switch: give from = [0, 1]"
MOVED = ALL - {"valve_command"}


def switched(off: str, on: str) -> list[str]:
    words = [on if u > 5 else off for u in DATA[:, 1]]
    rows = written("{t:.2f},@,{p:.4f},{a:.3f}", HEAD.replace("valve [V]", "valve"))
    return [rows[0], *(row.replace("@", word) for row, word in zip(rows[1:], words, strict=True))]


def delta(i: int) -> str:
    return f"0 days 00:00:{DT * i:09.6f}"


DIALECTS = {
    "plain": Dialect(written(PLAIN, HEAD)),
    "LabChart": Dialect(
        written(
            PLAIN.replace(",", "\t"), "Interval=\t0.02 s",
            "ExcelDateTime=\t4.4e+004\t6/21/2020 4:23",
            "ChannelTitle=\tvalve\tp_muscle\tangle", "Range=\t10.00 V\t10.00 mV\t1.000 V",
            "UnitName=\tV\tbar\tdeg", "TopValue=\t*\t10.66\t*", "BottomValue=\t*\t-10.66\t*",
        ),
        ("the headings are line 3", "rises by 0.02 s, as a line above"), ending=".txt",
    ),
    "a clock beside each channel": Dialect(
        written("{t:g},{u:g},{t:g},{p:.4f},{t:g},{a:.3f}", *NI), ("lines above the headings: 2",)
    ),
    "names over units": Dialect(
        written("{t:+.6E},{u:+.6E},{p:+.6E},{a:+.6E}", "x-axis,valve,p_muscle,angle",
                "second,Volt,bar,deg")
    ),
    "Tektronix": Dialect(
        [f"{key},{row}" for key, row in zip(TEK, written(PLAIN), strict=True)],
        ("no headings above line 1: columns 1 to 7 have no names",), set(),
    ),
    "Rigol": Dialect(
        written(
            "{i},{u:.3e},{p:.4e},{a:.4e},,", "X,valve,p_muscle,angle,Start,Increment",
            "Sequence,V,bar,deg,-1.0e+00,2.0e-02",
        ),
        ("X counts samples, 0.02 s apart as a line above",),
    ),
    "WaveForms": Dialect(
        written(PLAIN, "#Device Name: ADX", "#Date Time: 2021-04-14 13:10", "", ROUND)
    ),
    "HOBO": Dialect(
        stamped(
            lambda i: f"{i + 1},{date('%m/%d/%y %I:%M:%S.%f %p', NIGHT)(i)}", "Plot Title: bench",
            '#,"Date Time, GMT-07:00","valve, V (LGR S/N: 1)","p_muscle, bar (LGR S/N: 1)",'
            '"angle, deg (LGR S/N: 1)"',
        )
    ),
    "an object in each line": Dialect(written(OBJECT), ("p_muscle has no unit",), ending=".jsonl"),
    "an array of objects": Dialect(["[" + ",".join(written(OBJECT)) + "]"], ending=".json"),
    "an object of arrays": Dialect(
        [json.dumps({"rate": 50, "data": COLUMNS})], ending=".json"
    ),
    "a row for each reading": Dialect(
        written(LONG, "time [s],channel,value,unit"), ("channel says of what value is in each row",)
    ),
    "InfluxDB": Dialect(
        [f"{row} {1669112211 * 10**9 + 20_000_000 * i}" for i, row in enumerate(
            written("rig,bench=1 valve={u:g}i,p_muscle={p:.4f},angle={a:.3f}"))],
        ("ns is taken by their size",), ending=".txt",
    ),
    "closed, open": Dialect(switched("CLOSED", "OPEN"), (SWITCH.format("closed", "open"),), MOVED),
    "aus, ein": Dialect(switched("aus", "ein"), (SWITCH.format("aus", "ein"),), MOVED),
    "false, true": Dialect(switched("False", "True"), (SWITCH.format("false", "true"),), MOVED),
    "a date below the headings": Dialect(
        written(PLAIN.replace(",", " "), "time[sec] valve [V] p_muscle (bar) angle [deg]",
                "08 07 19 15:05"),
        ("lines between the headings and the numbers: 1 (first: row 2)",), ending=".txt",
    ),
    "date and time apart, newest first": Dialect(
        [
            "date,time," + CELLS,
            *stamped(lambda i: date("%Y-%m-%d,%H:%M:%S.%f", NIGHT)(i))[::-1],
        ],
        ("date and time are one clock", "the newest row comes first"),
    ),
    "times of day, newest first": Dialect(
        ["clock," + CELLS, *stamped(date("%H:%M:%S.%f", NIGHT))[::-1]], ("the newest row",)
    ),
    "Spanish": Dialect(
        written(
            "{i}0,{u:g},{p:.4f},{a:.3f}",
            "Tiempo (milisegundos),Válvula (V),Presión músculo (bar),Ángulo (grados)",
        ),
        slower=0.5,
    ),
    "names and units in quotes": Dialect(
        written('"{t:.2f}","{u:g}","{p:.4f}","{a:.3f}"', '"Specimen","1"', '"Operator","-"', "",
                '"Time","valve","p_muscle","angle"', '"(s)","(V)","(bar)","(deg)"'),
        ("lines above the headings: 2",),
    ),
    "units in the cells": Dialect(
        written("{t:.2f} s,{u:g} V,{p:.4f} bar,{a:.3f}deg", ",".join(NAMES))
    ),
    "seconds under a heading of ms": Dialect(
        written(PLAIN, HEAD.replace("[s]", "(msec)")),
        ("are the units of 'time' (s, ms, us)",), slower=1e-3,
    ),
    "days of MATLAB": Dialect(
        stamped(lambda i: f"{738123.5 + DT * i / 86400:.10f}", "time," + CELLS), ("d is taken",)
    ),
    "durations of pandas": Dialect(stamped(delta, "time," + CELLS)),
    "exponents of Fortran": Dialect(
        [HEAD, *(row.replace("E", "D") for row in written("{t:.6E},{u:.6E},{p:.6E},{a:.6E}"))],
        ("exponents are written with D",),
    ),
    "two valves of a switch": Dialect(
        [row + f",{int(u > 5)},{int(u < 5)}" if i else row + ",fill_valve,exhaust_valve" for i, (
            row, u) in enumerate(zip(written("{t:.2f},{p:.4f},{a:.3f}", HEAD.replace(
                "valve [V],", "")), [0.0, *DATA[:, 1]], strict=True))],
        ("valve_command, and is 0 or 1, a switch: give from", "not used: exhaust_valve"), MOVED,
    ),
    "comments with names over units": Dialect(
        written("  {t:12.5e}  {u:12.5e}  {p:12.5e}  {a:12.5e}", "% MATLAB log",
                "% time  valve  p_muscle  angle", "% s     V  bar       deg"), ending=".txt",
    ),
    "minutes": Dialect(
        stamped(lambda i: f"{DT * i / 60:.8f}", "Elapsed time since start (min)," + CELLS)
    ),
    "counts of an encoder": Dialect(
        written(PLAIN, HEAD.replace(" [deg]", ""), data=DATA * [1, 1, 1, 70]),
        ("angle is called like joint_angle, and has no unit", "does not lie in one of rad, deg"),
        ALL - {"joint_angle"},
    ),
    "water columns without a unit": Dialect(
        written("{t:.2f}  {u:g}  {p:.3f}", "# Captured by the bench",
                "time(sec)  pc_setpoint  pressure", data=DATA * [1, 1, 17, 1]),
        ("pc_setpoint is called like valve_command, and has no unit in the log: it may be a volt",
         "its numbers are 3.4 to 33.99, which may be psi or kPa; give it"),
        set(), ".txt",
    ),
}  # fmt: skip


def asked(path: Path, rig: pamrs.Rig = SHOULDER) -> tuple[LogProposal, str]:
    """The proposal for a log, and all that is told."""
    (item,) = propose([path], rig).logs
    return item, "\n".join(
        [*item.log.remarks, *item.remarks, *questions(item, rig, DiagnosisSettings())]
    )


@pytest.mark.parametrize("name", DIALECTS)
def test_a_dialect_is_read_right_or_told(tmp_path: Path, name: str) -> None:
    dialect = DIALECTS[name]
    path = tmp_path / f"log{dialect.ending}"
    path.write_text("\n".join(dialect.lines) + "\n", encoding="utf-8")
    item, told = asked(path)
    assert all(words in told for words in dialect.told), told
    assert {match.channel for match in item.matches} == dialect.read, told
    if not dialect.read:
        with pytest.raises(RecordingError, match="no channel was recognised among "):
            propose([path], SHOULDER).case_toml(tmp_path)
        return
    (made,) = case_of(tmp_path, propose([path], SHOULDER)).recordings
    assert made.sample_time == pytest.approx(DT * dialect.slower, rel=2e-3)
    assert abs(len(made) - N) <= 1
    for channel, values in made.channels.items():
        used = made.mask[channel]
        assert used.sum() >= N - 2
        away = np.abs(values - VALUES[channel][: len(made)])[used]
        assert np.mean(away > 2e-3 * np.ptp(VALUES[channel])) <= 0.05 * (channel == "valve_command")


@pytest.mark.parametrize(
    ("head", "row"),
    [
        ("Interval;0,01 s\nn;p", "{0};{0}"),
        ("Interval;1.000,0 us\nn;p", "{0};{0},5"),
        ("n,dt,p", "{0},10,{0}.5"),
        ("n,dt,p\n0,10,0.5\n1,10,0.5\nn,dt,p", "{0},10,{0}.5"),
        ("n,of,p", "{0},dt,2"),
    ],
)
def test_what_is_no_spacing_is_not_taken_for_one(tmp_path: Path, head: str, row: str) -> None:
    rows = [row.format(i) for i in range(60)]
    (tmp_path / "log.csv").write_text("\n".join([head, *rows]), encoding="utf-8")
    log = read_log(tmp_path / "log.csv")
    np.testing.assert_array_equal(log.series["n"].values, np.arange(60))
    assert "p" in log.series


def test_runs_below_a_line_with_the_date_are_recordings(tmp_path: Path) -> None:
    run = ["time[sec] Pin[KPa] Pout[KPa]", "06 24 19 09:31:12"]
    run += [f"{0.11 + 0.037 * i:.3f} {30 - 0.01 * i:.3f} {0.1 * i:.2f}" for i in range(40)]
    (tmp_path / "runs.txt").write_text("\n".join(run * 3), encoding="utf-8")
    log = read_log(tmp_path / "runs.txt")
    assert {s.name: s.unit for s in log.series.values()} == {
        "time": "sec", "Pin": "KPa", "Pout": "KPa", "part": ""
    }  # fmt: skip
    channels = {"muscle_pressure": {"column": "Pout", "unit": "kPa"}}
    found = load_recordings(log.path, channels=channels, time="time", split={"column": "part"})
    assert [len(each) for each in found] == [40, 40, 40]


@pytest.mark.parametrize(
    ("form", "cells", "told"),
    [
        ("{:,.1f} mbar", {}, "p: commas part thousands, as in '1,000.5 mbar'"),
        ("{:.1f} mbar", {7: "OL mbar", 9: "1.2.3 mbar", 11: "-"}, "p: 2 cells are no numbers"),
    ],
)
def test_numbers_with_units_are_read_or_told(
    tmp_path: Path, form: str, cells: dict[int, str], told: str
) -> None:
    values = 970.5 + np.arange(60.0)
    rows = [f"{i};{cells.get(i, form.format(value))}" for i, value in enumerate(values)]
    (tmp_path / "log.txt").write_text("\n".join(["t [s];p [hPa abs]", *rows]), encoding="utf-8")
    log = read_log(tmp_path / "log.txt")
    values[list(cells)] = np.nan
    np.testing.assert_array_equal(log.series["p"].values, values)
    assert [remark[: len(told)] for remark in log.remarks] == [told]


@pytest.mark.parametrize("count", [1, 3])
def test_a_status_beside_values_parts_no_sensor(tmp_path: Path, count: int) -> None:
    times = [i // count for i in range(60)]  # so many rows have the same one
    times[22] = times[21]
    rows = [f"{t},{i},{'WARN' if i % 17 == 5 else 'OK'}" for i, t in enumerate(times)]
    (tmp_path / "log.csv").write_text("\n".join(["time,value [bar],status", *rows]))
    log = read_log(tmp_path / "log.csv")
    np.testing.assert_array_equal(log.series["value"].values, np.arange(60))
    assert log.series["status"].labels == ("OK", "WARN")


def test_a_long_table_may_have_one_of_its_sensors_more_often(tmp_path: Path) -> None:
    rows = [f"{i},{n},{i}" for i in range(60) for n in ("valve", "p")[: 1 + (i % 10 == 0)]]
    (tmp_path / "log.csv").write_text("\n".join(["time,channel,value", *rows]))
    assert np.isfinite(read_log(tmp_path / "log.csv").series["p"].values).sum() == 6


def test_a_pause_between_dates_lasts_as_long_as_they_say(tmp_path: Path) -> None:
    rows = [
        f"2026-04-1{4 + d},{h:02d}:{m:02d},1.{m:02d}"
        for d, h in ((0, 5), (1, 12))
        for m in range(60)
    ]
    (tmp_path / "log.csv").write_text("\n".join(["date,time,p [bar]", *rows]), encoding="utf-8")
    time = read_log(tmp_path / "log.csv").series["time"].values
    assert time[60] - time[0] == 31 * 3600.0


BROKEN = [
    ("log.jsonl", '{"t": 0}\n{"t": 1,}\n', r"log.jsonl: line 2, column \d+: "),
    ("log.json", '{"rate": 50}', "no table was found: neither a list of records nor columns"),
    *(("log.json", text, "no table was found") for text in ("[{}]", "[[]]")),
    ("log.txt", "a x=1 1669112211000\na x=1 1669112212000\nb x=2 1669112213000\n", "line 3 is of"),
    ("log.csv", "t [s],p\n0,1 bar\n1,2 bar\n2,300 mbar\n", "'2 bar' in row 3, '300 mbar' in row 4"),
    ("log.txt", "t:0 p:950 mbar\n" * 9 + "t:9 p:0.98 bar\n", "line 't:9 p:0.98 bar' has p in"),
    ("log.csv", "t [s],p [bar]\n0,950 mbar\n1,960 mbar\n", "'bar', and row 3 .*'960 mbar'"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text", "told"), BROKEN)
def test_what_is_not_understood_is_told_with_its_place(
    tmp_path: Path, name: str, text: str, told: str
) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(RecordingError, match=told):
        read_log(tmp_path / name).find("p")


@pytest.mark.parametrize(
    "content",
    [
        [{"t": 0, "rig": {"p": 1}}, {"t": 1, "rig": {"p": None}}, {"t": 2, "rig": {"p": 3.0}}],
        {"t": {"0": 0, "1": 1, "2": 2}, "rig/p": {"0": 1, "1": None, "2": 3.0}},
        {"columns": ["t", "rig/p"], "index": [0, 1, 2], "data": [[0, 1], [1, None], [2, 3.0]]},
        [["t", "rig/p"], [0, 1], [1, None], [2, 3.0]],
        {"rig": {"t": [0, 1, 2], "p": [1, None, 3.0]}},
        {"t": [0, 1, 2], "rig": {"p": [1, None, 3.0], "angle": [1], "load": []}},
    ],
)
def test_json_is_a_table_in_every_form(tmp_path: Path, content: Any) -> None:
    (tmp_path / "log.json").write_text(json.dumps(content), encoding="utf-8")
    log = read_log(tmp_path / "log.json")
    np.testing.assert_array_equal(log.series["rig/p"].values, [1.0, np.nan, 3.0])
    assert ("rig/angle (1), rig/load (0)" in "".join(log.remarks)) == ("angle" in str(content))


# ------------------------------------------------------------------------- slow sensors


def slow(stays: list[int], rest: int = 0) -> tuple[Array, Array]:
    """Readings with noise, `rest` equal ones in the middle, each so many rows; and their rows."""
    readings = np.cumsum(np.random.default_rng(4).normal(size=len(stays)))
    readings[10 : 10 + rest] = readings[10]
    return np.repeat(readings, stays), np.concatenate([[0], np.cumsum(stays)[:-1]])


@pytest.mark.parametrize(
    ("stays", "rest"), [([12] * 30, 0), ([12] * 30, 5), ([8, 12, 10, 9, 11] * 8, 0), ([3] * 40, 2)]
)
def test_readings_that_a_log_repeats_are_found(stays: list[int], rest: int) -> None:
    values, first = slow(stays, rest)
    found = reading_rows(values)
    assert found is not None
    assert found[1] == np.median(stays)
    np.testing.assert_array_equal(found[0], first)


TIME = 0.01 * np.arange(2000)
RNG = np.random.default_rng(5)
LIVE = {
    "noise of a converter at rest": np.round(RNG.normal(scale=0.4, size=2000)),
    "a slow ramp of a converter": np.floor(TIME * 7.9),
    "a triangle of a converter": np.floor(np.abs(TIME % 8.0 - 4.0) * 20.0),
    "a slow sine of a converter": np.round(40.0 * np.sin(TIME)),
    "a step and a rest": np.where(TIME < 5.0, 0.0, 1.0 - np.exp(5.0 - TIME)).round(3),
    "one value": np.ones(2000),
}


@pytest.mark.parametrize("name", LIVE)
def test_what_stays_by_itself_is_no_slow_sensor(name: str) -> None:
    assert reading_rows(LIVE[name]) is None


def repeated(folder: Path) -> tuple[LogProposal, str]:
    """A log of 100 rows a second with a gauge that is read each 12 rows."""
    pressure = 1.0 + 0.4 * np.sin(TIME) + RNG.normal(scale=0.01, size=2000)
    held = np.repeat(pressure[::12], 12)[:2000]
    rows = zip(TIME, 5.0 + np.sin(TIME), held, 40.0 + 10.0 * np.sin(TIME), strict=True)
    lines = [f"{t:.2f},{u:.4f},{p:.5f},{a:.4f}" for t, u, p, a in rows]
    (folder / "log.csv").write_text("\n".join([HEAD, *lines]), encoding="utf-8")
    return asked(folder / "log.csv")


def test_a_reading_counts_once_and_is_told(tmp_path: Path) -> None:
    item, told = repeated(tmp_path)
    assert "muscle_pressure: each reading stays for 12 rows: 8.3 Hz, each counts once" in told
    assert {each.name: round(each.rate, 2) for each in item.listed[1:]} == {
        "valve": 100.0, "p_muscle": 8.33, "angle": 100.0
    }  # fmt: skip
    (made,) = item.recordings()
    apart, values = made.logged["muscle_pressure"]
    assert (apart, len(values)) == (pytest.approx(0.12), 167)
    prepared = prepare(made, SHOULDER, DiagnosisSettings())
    noise = prepared.noise["muscle_pressure"] / np.sqrt(12.0)  # of as many independent samples
    assert 700.0 < noise < 1400.0


# ------------------------------------------------------------------------- wired wrongly

BENCH = pamrs.rigs.named("hanging_mass")
VOLTS = np.where((TIME // 1.0) % 2 == 0, 5.3, 4.7)
RUN = pamrs.simulate(BENCH, VOLTS, sample_time=0.01)


def wired(folder: Path, **changed: Array) -> str:
    """What is asked about a log of a hanging mass, some of whose columns are others."""
    columns = {name: RUN[name] for name in ("supply_pressure", "muscle_pressure", "length")}
    columns = {"valve_command": VOLTS, **columns} | changed
    head = "time [s],valve_command [V],supply_pressure [Pa],muscle_pressure [Pa],length [m]"
    noise = {"valve_command": 0.0, "length": 1e-5}
    table = [
        TIME,
        *(v + RNG.normal(scale=noise.get(n, 100.0), size=2000) for n, v in columns.items()),
    ]
    np.savetxt(folder / "log.csv", np.column_stack(table), delimiter=",", header=head, comments="")
    return asked(folder / "log.csv", BENCH)[1]


WRONG: dict[str, tuple[dict[str, Array], str]] = {
    "right": ({}, ""),
    "reversed": ({"valve_command": 10.0 - VOLTS}, "is the command's sign, unit or column right?"),
    "exchanged": (
        {"supply_pressure": RUN["muscle_pressure"], "muscle_pressure": RUN["supply_pressure"]},
        "are the two columns swapped, or one of their units wrong?",
    ),
    "contraction": ({"length": 0.276 - RUN["length"]}, "right column, no contraction, unit"),
    "counts the other way": (
        {"length": RUN["length"].min() + RUN["length"].max() - RUN["length"]},
        "does its sensor count the other way?",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_was_wired_wrongly_is_asked_on_import(tmp_path: Path, name: str) -> None:
    columns, told = WRONG[name]
    said = wired(tmp_path, **columns)
    assert told in said
    assert ("?" in said) == (name != "right")
    assert "read as psi" not in said
