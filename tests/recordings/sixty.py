"""Sixty small logs: every dialect with every clock, units and names of channels in turn. Each is
read right, or what is left to the user is told.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.recordings.test_dialects import DATA, DT, EPOCH, N, date, imported

PSI, AT, MERCURY, STANDARD = 6894.757293, 98066.5, 133.322387415, 101325.0


class Clock(NamedTuple):
    """How a log writes its times.

    Attributes
    ----------
    name, unit : str
        What it is; the unit in the heading, empty for none.
    write : callable
        The time of a row.
    told : str
        What is said of it; empty where nothing is to be said.
    newest_first : bool
        Whether the last row stands first.
    """

    name: str
    unit: str
    write: Callable[[int], str]
    told: str = ""
    newest_first: bool = False


CLOCKS = (
    Clock("seconds", "s", lambda i: f"{DT * i:.2f}"),
    Clock("milliseconds", "ms", lambda i: f"{20 * i}"),
    Clock("epoch in ns", "", lambda i: str(EPOCH * 10**9 + 20_000_000 * i), "ns is taken"),
    Clock(
        "16 bits of ms", "ms", lambda i: f"{(64_536 + 20 * i) % 65_536}", "a clock of 16 bits: 1"
    ),
    Clock("dates", "", date("%Y-%m-%d %H:%M:%S.%f")),
    Clock("newest first", "s", lambda i: f"{DT * i:.2f}", "newest row comes first", True),
)


class Unit(NamedTuple):
    """In what a log has its pressure.

    Attributes
    ----------
    written : str
        In the heading.
    scale, offset : float
        Pa of one unit; Pa at zero gauge pressure.
    told : str
        What is said of it; empty where nothing is to be said.
    read : bool
        Whether the numbers can be used.
    """

    written: str
    scale: float
    offset: float = 0.0
    told: str = ""
    read: bool = True


UNITS = (
    Unit("bar", 1e5),
    Unit("kPa", 1e3),
    Unit("psi", PSI),
    Unit("bar(a)", 1e5, STANDARD, "is subtracted"),
    Unit("kgf/cm2", AT),
    Unit("", 1e5, told="has no unit in the log: bar is assumed"),
    Unit("mmHg", MERCURY),
    Unit("psia", PSI, STANDARD, "is subtracted"),
    Unit("counts", 25.0, told="the unit 'counts' is not known", read=False),
    Unit("hPa", 1e2),
    Unit("mA", 2e4, told="is in mA: give from and to", read=False),
)

NAMES = (
    ("time", "valve", "p_muscle", "angle"),
    ("Zeit", "Ventilspannung", "Muskeldruck", "Winkel"),
    ("t", "u_cmd", "p_act", "angle_meas"),
    ("Timestamp", "ValveCommand", "MusclePressure", "JointAngle"),
    ("t", "u", "p1", "phi"),
    ("clock", "rig/valve", "rig/pressure", "rig/joint_angle"),
    ("stamp", "u_des", "p_ist", "Winkel Ist"),
)
"""Of the time, the command, the pressure and the angle."""


def _square(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _round(name: str, unit: str) -> str:
    return f"{name} ({unit})" if unit else name


class Dialect(NamedTuple):
    """How a program writes a table.

    Attributes
    ----------
    name, mark, decimal, encoding : str
        What separates cells, marks decimals, and how letters become bytes.
    heading : callable
        A heading out of a name and a unit.
    units_below : bool
        Whether the units stand in a row of their own.
    above : str
        Lines above the headings.
    quoted : bool
        Whether cells stand in quotes.
    """

    name: str
    mark: str = ","
    decimal: str = "."
    encoding: str = "utf-8"
    heading: Callable[[str, str], str] = _square
    units_below: bool = False
    above: str = ""
    quoted: bool = False


DIALECTS = (
    Dialect("commas"),
    Dialect("German Excel", ";", ",", "utf-8-sig"),
    Dialect("tabs", "\t", heading=_round),
    Dialect("UTF-16", "\t", ",", "utf-16"),
    Dialect("quotes", quoted=True, heading=_round),
    Dialect("units below", ";", units_below=True),
    Dialect("a preamble", above="Stand 3\nOperator;A. B.\n\n"),
    Dialect("comments", ";", ".", "cp1252", above="# stand 3\n# 12 May\n"),
    Dialect("bars", "|"),
    Dialect("German, quoted", ";", ",", "cp1252", heading=_round, quoted=True),
)


class Row(NamedTuple):
    """One log of the table."""

    dialect: Dialect
    clock: Clock
    unit: Unit
    names: tuple[str, ...]

    @property
    def name(self) -> str:
        """What it is, in a line."""
        unit = self.unit.written or "no unit"
        return f"{self.dialect.name}, {self.clock.name}, {unit}, {self.names[2]}"


def rows() -> Iterator[Row]:
    """The table."""
    for place, dialect in enumerate(DIALECTS):
        for turn, clock in enumerate(CLOCKS):
            count = len(CLOCKS) * place + turn
            yield Row(dialect, clock, UNITS[count % len(UNITS)], NAMES[count % len(NAMES)])


def written(row: Row) -> bytes:
    """A log."""
    form = row.dialect
    units = (row.clock.unit, "V", row.unit.written, "deg")
    headings = [
        name if form.units_below else form.heading(name, unit)
        for name, unit in zip(row.names, units, strict=True)
    ]
    lines = [headings, list(units)] if form.units_below else [headings]
    body = []
    for i, (_, volts, bar, angle) in enumerate(DATA.tolist()):
        pressure = (1e5 * bar + row.unit.offset) / row.unit.scale
        numbers = [f"{volts:.2f}", f"{pressure:.6f}", f"{angle:.3f}"]
        cells = [row.clock.write(i), *numbers]
        body.append([cell if "-" in cell else cell.replace(".", form.decimal) for cell in cells])
    lines += body[::-1] if row.clock.newest_first else body
    quote = '"' if form.quoted else ""
    text = "".join(form.mark.join(f"{quote}{c}{quote}" for c in line) + "\r\n" for line in lines)
    return (form.above + text).encode(form.encoding)


def tried(row: Row, home: Path) -> tuple[str, str]:
    """What becomes of a log: ``right`` (every channel), ``told`` (the pressure is left to the user,
    who is told why) or ``wrong``; and what is said.
    """
    recordings, said = imported(home, written(row))
    wanted = {
        "valve_command": DATA[:, 1],
        "joint_angle": np.radians(DATA[:, 3]),
        "muscle_pressure": 1e5 * DATA[:, 2],
    }
    if not row.unit.read:
        del wanted["muscle_pressure"]
    right = len(recordings) == 1 and set(recordings[0].channels) == set(wanted)
    right = right and len(recordings[0]) == N
    right = right and row.unit.told in said and row.clock.told in said
    right = right and all(
        np.nanmax(np.abs(recordings[0].channels[name] - values)) <= 1e-4 * np.ptp(values)
        and recordings[0].mask[name].all()
        for name, values in wanted.items()
    )
    if not right:
        return "wrong", said
    return "right" if row.unit.read else "told", said


def main() -> int:
    """Print the table; the number of logs that came out wrong."""
    counts: dict[str, int] = {}
    print(f"{'dialect':<16}{'clock':<15}{'unit':<9}{'pressure':<15}{'came out':<10}said")
    for row in rows():
        with tempfile.TemporaryDirectory() as home:
            came, said = tried(row, Path(home))
        counts[came] = counts.get(came, 0) + 1
        lines = said.replace(home, "").splitlines()
        mine = [line for line in lines if row.unit.told and row.unit.told in line]
        told = (mine or [line for line in lines if "not found" not in line] or [""])[0]
        print(
            f"{row.dialect.name:<16}{row.clock.name:<15}{row.unit.written or '-':<9}"
            f"{row.names[2]:<15}{came:<10}{told[:100]}"
        )
    print(", ".join(f"{count} {came}" for came, count in sorted(counts.items())))
    return counts.get("wrong", 0)
