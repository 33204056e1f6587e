"""Fingerprints of the effects on the way of the air."""

from __future__ import annotations

import numpy as np

from fingerprints.sheet import (
    BAR,
    QUIET,
    WITH,
    WITHOUT,
    Array,
    Sheet,
    angle,
    clock,
    flow,
    hold,
    label,
    pressure,
    supply,
)
from pamrs import simulate

__all__ = [
    "back_pressure",
    "centre_leakage",
    "compressor",
    "dead_band",
    "dead_zone",
    "flow_law",
    "heat",
    "input_lag",
    "muscle_leak",
    "play",
    "regulator_delay",
    "regulator_slew",
    "restriction",
    "supply_leak",
    "two_areas",
]

#: The arm between two stops, so that the muscle's volume does not change.
LOCKED = {
    "joint.max_angle": np.radians(15.05),
    "joint.stop_stiffness": 1e6,
    "joint.stop_damping": 3e3,
}
NAMES = ("without", "with the effect")


def supply_leak(sheet: Sheet) -> None:
    """Idle, one fill, idle, from a full and from a half empty tank."""
    time = clock(120.0, 0.05)
    axes = sheet.axes("sx;px", width_ratios=[1.25, 1])
    idle = slice(400, -10)
    for start, style in ((13.8e5, "-"), (5e5, "--")):
        command = hold(time, (0.0, 5.0), (10.0, 5.5), (10.5, 5.0))
        runs = sheet.run(
            LOCKED, valve_command=command, sample_time=0.05, initial={"supply_pressure": start}
        )
        for run, colour, words in zip(runs, (WITHOUT, WITH), NAMES, strict=True):
            width, given = (2.2 if colour == WITHOUT else 1.3), words if style == "-" else None
            axes["s"].plot(time, supply(run), style, lw=width, color=colour, label=given)
            axes["p"].plot(time, pressure(run), style, lw=width, color=colour, label=given)
            rate = -BAR * np.gradient(supply(run), 0.05)
            axes["x"].plot(
                (supply(run) + 1.01325)[idle], rate[idle], "o", ms=4, color=colour, label=given
            )
    axes["x"].plot(
        [0.0, 15.0],
        [0.0, 15.0 * rate[idle][0] / (supply(runs[1]) + 1.01325)[idle][0]],
        ":",
        color=QUIET,
        label="through zero",
    )
    label(
        axes["s"],
        "supply: falls, valve shut or not; a full tank, and a half empty one (dashed)",
        y="supply [bar]",
        legend="center left",
    )
    label(axes["p"], "muscle: as modelled", y="muscle [bar]", legend="upper left")
    label(
        axes["x"],
        "valve shut: in proportion to absolute pressure",
        "supply, absolute [bar]",
        "rate of fall [Pa/s]",
        "upper left",
    )


def compressor(sheet: Sheet) -> None:
    """Fills and vents in a row, then idle."""
    time, busy = clock(110.0, 0.05), 76.0
    command = np.where(
        time > busy, 5.0, np.where(time % 2.0 < 0.5, 5.8, np.where(time % 2.0 > 1.0, 3.0, 5.0))
    )
    runs = sheet.run(
        LOCKED, valve_command=command, sample_time=0.05, initial={"supply_pressure": 13e5}
    )
    axes = sheet.axes("s;p", height_ratios=[2, 1], sharex=True)
    sheet.both(axes["s"], runs, supply)
    values = sheet.rigs[1].effects[0]["parameters"]
    for name, words in (("cut_out_pressure", "stops"), ("cut_in_pressure", "starts")):
        axes["s"].axhline(values[name] / BAR, color=QUIET, ls=":", lw=1.2)
        axes["s"].text(0.0, values[name] / BAR, words, ha="left", va="bottom", color=QUIET)
    label(
        axes["s"],
        "supply: rises evenly from one pressure to the other, again and again",
        "",
        "supply [bar]",
        "lower left",
    )
    sheet.both(axes["p"], runs, pressure)
    label(
        axes["p"],
        f"muscle: uses the air up to {busy:g} s; the compressor goes on to its stop without",
        y="muscle [bar]",
    )


def dead_band(sheet: Sheet) -> None:
    """A staircase of the set pressure with steps of growing size, up and down."""
    time = clock(40.0)
    sizes = [0.1, 0.1, 0.1, 0.4, 0.8, 0.1, -0.1, -0.1, -0.4, -0.8]
    levels = 2.0 + np.cumsum([0.0, *sizes])
    command = BAR * hold(time, *((3.6 * k, level) for k, level in enumerate(levels)))
    start = {"supply_pressure": 2e5, "muscle_pressure": 2e5, "joint_angle": 0.91}
    runs = sheet.run(supply_command=command, initial=start)
    axes = sheet.axes("px;ax", width_ratios=[1.5, 1])
    axes["p"].step(time, command / BAR, color=QUIET, ls=":", lw=1.3, label="set")
    sheet.both(axes["p"], runs, supply)
    label(axes["p"], "outlet of the regulator", y="pressure [bar]", legend="lower center")
    sheet.both(axes["a"], runs, angle)
    label(axes["a"], "joint: stands with it", y="angle [deg]")
    band = sheet.rigs[1].effects[0]["parameters"]["dead_band"] / BAR
    axes["x"].axhspan(-band, band, color="#dfe3e8", lw=0, label="dead band")
    for run, colour, words in zip(runs, (WITHOUT, WITH), NAMES, strict=True):
        axes["x"].plot(time, command / BAR - supply(run), color=colour, lw=1.3, label=words)
    axes["x"].set_ylim(-0.5, 0.5)
    label(
        axes["x"],
        "error: stays where it enters the band",
        y="set - outlet [bar]",
        legend="upper right",
    )


def _set_steps(sheet: Sheet) -> None:
    """Steps of the set pressure, small and large, up and down: the outlet, and each enlarged."""
    time = clock(8.0, 0.005)
    steps = ((0.0, 2.0), (1.0, 2.3), (3.0, 5.0), (5.0, 2.3), (7.0, 2.0))
    command = BAR * hold(time, *steps)
    start = {"supply_pressure": 2e5, "muscle_pressure": 2e5, "joint_angle": 0.91}
    runs = sheet.run(supply_command=command, sample_time=0.005, initial=start)
    axes = sheet.axes("pp;sl")
    for letter, part, title in (
        ("p", slice(None), "outlet of the regulator"),
        ("s", slice(190, 340), "a small step"),
        ("l", slice(590, 780), "a large one"),
    ):
        axes[letter].step(
            time[part], command[part] / BAR, color=QUIET, ls=":", lw=1.3, label="set", where="post"
        )
        sheet.both(axes[letter], runs, supply, part=part)
        label(axes[letter], title, y="pressure [bar]", legend="upper right" * (letter == "p"))


def regulator_delay(sheet: Sheet) -> None:
    """Steps of the set pressure, small and large, up and down."""
    _set_steps(sheet)


def regulator_slew(sheet: Sheet) -> None:
    """Steps of the set pressure, small and large, up and down."""
    _set_steps(sheet)


def flow_law(sheet: Sheet) -> None:
    """A tank that empties to the ambient."""
    runs = sheet.run(duration=40.0, sample_time=0.05)
    axes = sheet.axes("px;lx", width_ratios=[1.3, 1])
    sheet.both(axes["p"], runs, pressure)
    label(axes["p"], "an outlet is opened", y="chamber [bar]", legend="upper right")
    sheet.both(axes["l"], runs, pressure)
    axes["l"].set_yscale("log")
    axes["l"].set_ylim(1e-3, 10.0)
    label(axes["l"], "its end: an exponential", y="chamber [bar]")
    for run, colour in zip(runs, (WITHOUT, WITH), strict=True):
        lost = -np.gradient(1e3 * run["air_mass"], run.time)
        axes["x"].plot(pressure(run)[1:-1], lost[1:-1], color=colour, lw=1.8)
    axes["x"].set(xscale="log", yscale="log", xlim=(1e-2, 6.0), ylim=(1e-2, 10.0))
    label(axes["x"], "flow against pressure", "chamber [bar]", "flow [g/s]")


def _triangle(time: Array, period: float, low: float, high: float) -> Array:
    """A command that rises and falls evenly [V]."""
    phase = (time / period) % 1.0
    return low + (high - low) * (1.0 - np.abs(2.0 * phase - 1.0))


def dead_zone(sheet: Sheet) -> None:
    """Slow ramps of the command through the null, both ways."""
    time = clock(4.0, 0.005)
    runs = sheet.run(
        LOCKED,
        valve_command=_triangle(time + 0.5, 2.0, 4.4, 5.3),
        sample_time=0.005,
        initial={"muscle_pressure": 3e5},
    )
    axes = sheet.axes("ux;px", width_ratios=[1, 1.1])
    axes["u"].plot(time, runs[0]["valve_command"], color=QUIET)
    label(axes["u"], "command: ramps through the null", y="valve [V]")
    sheet.both(axes["p"], runs, pressure)
    label(
        axes["p"],
        "muscle: stands at each change of direction",
        y="muscle [bar]",
        legend="lower left",
    )
    sheet.both(axes["x"], runs, flow, lambda run: run["valve_command"], part=slice(2, -2))
    half = 5.0 * sheet.rigs[1].effects[0]["parameters"]["half_width"]
    axes["x"].axvspan(5.0 - half, 5.0 + half, color="#dfe3e8", lw=0, label="dead zone")
    label(
        axes["x"],
        "flow against command: none in the dead zone",
        "valve [V]",
        "air into the muscle [g/s]",
        "upper left",
    )


def play(sheet: Sheet) -> None:
    """Triangles of the command at two speeds: through the null, and on one side of it."""
    axes = sheet.axes("xy")
    ranges = (("x", 4.6, 5.4, "through the null"), ("y", 5.2, 5.6, "on one side of the null"))
    for letter, low, high, words in ranges:
        for period, style in ((0.6, "-"), (0.12, "--")):
            row = period / 600.0
            time = clock(3.0 * period, row)
            command = _triangle(time, period, low, high)
            runs = sheet.run(
                LOCKED, valve_command=command, sample_time=row, initial={"muscle_pressure": 3e5}
            )
            part = slice(750, 1350)
            of = {"part": part, "ls": style}
            sheet.both(axes[letter], runs, flow, lambda run: run["valve_command"], **of)
            if style == "--":
                for line, name in zip(axes[letter].lines[-2:], NAMES, strict=True):
                    line.set_label(f"{name}, five times as fast")
        label(axes[letter], words, "valve [V]", "air into the muscle [g/s]", "upper left")


def centre_leakage(sheet: Sheet) -> None:
    """The valve at its null, from a low and from a high pressure."""
    time = clock(200.0, 0.1)
    axes = sheet.axes("px;sx", width_ratios=[1.25, 1])
    for start, style in ((1e5, "-"), (5.8e5, "--")):
        first = {"muscle_pressure": start, "supply_pressure": 6e5}
        runs = sheet.run(
            LOCKED, valve_command=np.full(time.size, 5.0), sample_time=0.1, initial=first
        )
        words = "from below" if style == "-" else "from above"
        for run, colour, which in zip(runs, (WITHOUT, WITH), ("without", "with"), strict=True):
            axes["p"].plot(time, pressure(run), style, color=colour, label=f"{which}, {words}")
            axes["s"].plot(time, supply(run), style, color=colour)
            axes["x"].plot(
                pressure(run)[5:], 100.0 * np.gradient(pressure(run), 0.1)[5:], style, color=colour
            )
    label(axes["p"], "muscle: to one and the same value", y="muscle [bar]", legend="center right")
    label(axes["s"], "supply: air is used up all the time", y="supply [bar]")
    axes["x"].axhline(0.0, color=QUIET, lw=0.8)
    label(
        axes["x"],
        "at the null: up from below, down from above",
        "muscle [bar]",
        "rate of the muscle's pressure [kPa/s]",
    )


def input_lag(sheet: Sheet) -> None:
    """A large fill, a small fill and a vent."""
    axes = sheet.axes("up;xx", height_ratios=[1, 1.2])
    time = clock(0.5, 0.0005)
    command = hold(time, (0.0, 5.0), (0.05, 6.2), (0.15, 5.0), (0.25, 5.3), (0.35, 5.0), (0.4, 3.8))
    runs = sheet.run(
        LOCKED, valve_command=command, sample_time=0.0005, initial={"muscle_pressure": 3e5}
    )
    axes["u"].plot(time, command, color=QUIET)
    label(axes["u"], "command", y="valve [V]")
    sheet.both(axes["p"], runs, flow)
    label(
        axes["p"], "flow: late at every edge", y="air into the muscle [g/s]", legend="upper right"
    )
    for at, style, words in (
        (0.05, "-", "large fill"),
        (0.25, "--", "small fill"),
        (0.4, ":", "vent"),
    ):
        part = slice(round((at - 0.01) / 0.0005), round((at + 0.06) / 0.0005))
        for run, colour, which in zip(runs, (WITHOUT, WITH), ("without", "with"), strict=True):
            edge = flow(run)[part]
            size = flow(run)[round((at + 0.08) / 0.0005)]
            axes["x"].plot(
                1e3 * (time[part] - at), edge / size, style, color=colour, label=f"{which}, {words}"
            )
    label(
        axes["x"],
        "each edge in parts of its size: all late by the same",
        "time since the edge of the command [ms]",
        "flow [1]",
        "lower right",
    )


def restriction(sheet: Sheet) -> None:
    """Fills and vents at three openings, and the flow at every opening."""
    _openings(sheet, "flow at 4 bar: short at large openings, both ways")


def back_pressure(sheet: Sheet) -> None:
    """The same, with a silencer behind the exhaust."""
    _openings(sheet, "flow at 4 bar: short where it vents wide open")


def two_areas(sheet: Sheet) -> None:
    """The same, of a valve that fills faster than it vents."""
    _openings(sheet, "flow at 4 bar: more where it fills, less where it vents")


def _openings(sheet: Sheet, title: str) -> None:
    axes = sheet.axes("px;vx", width_ratios=[1, 1.1])
    time = clock(0.6, 0.002)
    for letter, start, volts in (("p", 0.5e5, (10.0, 7.0, 6.0)), ("v", 6e5, (0.0, 3.0, 4.0))):
        for volt in volts:
            runs = sheet.run(
                LOCKED,
                valve_command=np.full(time.size, volt),
                sample_time=0.002,
                initial={"muscle_pressure": start},
            )
            sheet.both(axes[letter], runs, pressure)
            axes[letter].text(0.61, pressure(runs[0])[-1], f"{volt:g} V", color=QUIET, va="center")
        axes[letter].set_xlim(-0.02, 0.68)
        for line in axes[letter].lines[2:]:
            line.set_label(None)
    label(axes["p"], "filling at three openings", y="muscle [bar]", legend="lower right")
    label(axes["v"], "venting at three openings", y="muscle [bar]", legend="lower left")
    every = np.linspace(0.0, 10.0, 81)
    for rig, colour, words in zip(sheet.rigs, (WITHOUT, WITH), NAMES, strict=True):
        maps = [
            simulate(rig, np.full(2, volt), sample_time=1e-4, initial={"muscle_pressure": 4e5})
            for volt in every
        ]
        axes["x"].plot(every, [flow(run)[0] for run in maps], color=colour, label=words)
    label(
        axes["x"],
        title,
        "valve [V]",
        "air into the muscle [g/s]",
        "upper left",
    )


def muscle_leak(sheet: Sheet) -> None:
    """Fill, shut, hold, at three levels."""
    time = clock(100.0, 0.05)
    command = hold(
        time, (0.0, 5.07), (4.0, 5.0), (33.0, 5.05), (37.0, 5.0), (66.0, 5.05), (70.0, 5.0)
    )
    runs = sheet.run(valve_command=command, sample_time=0.05)
    axes = sheet.axes("px;ax", width_ratios=[1.25, 1])
    sheet.both(axes["p"], runs, pressure)
    label(
        axes["p"],
        "muscle: falls with the valve shut, without end",
        y="muscle [bar]",
        legend="upper left",
    )
    sheet.both(axes["a"], runs, angle)
    label(axes["a"], "joint: sinks with it", y="angle [deg]")
    for first, last in ((6.0, 32.0), (39.0, 65.0), (72.0, 99.0)):
        part = slice(round(first / 0.05), round(last / 0.05))
        for run, colour in zip(runs, (WITHOUT, WITH), strict=True):
            axes["x"].plot(
                pressure(run)[part] + 1.01325, -1e3 * flow(run)[part], ".", ms=3, color=colour
            )
    end = (pressure(runs[1])[-40] + 1.01325, -1e3 * flow(runs[1])[-40])
    axes["x"].plot([0.0, end[0]], [0.0, end[1]], ":", color=QUIET, label="through zero")
    label(
        axes["x"],
        "valve shut: loss in proportion to absolute pressure",
        "muscle, absolute [bar]",
        "air lost [mg/s]",
        "upper left",
    )


def heat(sheet: Sheet) -> None:
    """A fast fill and a fast vent, each with the valve shut after it; small ones and large ones."""
    time = clock(24.0)
    command = hold(
        time,
        (0.0, 5.0),
        (1.0, 10.0),
        (1.15, 5.0),
        (7.0, 0.0),
        (7.25, 5.0),
        (13.0, 10.0),
        (13.05, 5.0),
        (19.0, 0.0),
        (19.08, 5.0),
    )
    runs = sheet.run(LOCKED, valve_command=command)
    axes = sheet.axes("pp;fv")
    sheet.both(axes["p"], runs, pressure)
    label(
        axes["p"],
        "muscle: large and small, fast fills and vents, the valve shut in between",
        y="muscle [bar]",
        legend="upper right",
    )
    for letter, at, words in (
        ("f", 1.15, "after the large fill: falls, then stays"),
        ("v", 7.25, "after the large vent: rises, then stays"),
    ):
        part = slice(round((at + 0.02) / 0.01), round((at + 5.0) / 0.01))
        for run, colour in zip(runs, (WITHOUT, WITH), strict=True):
            axes[letter].plot(
                time[part] - at, (pressure(run) - pressure(run)[part][-1])[part], color=colour
            )
        label(axes[letter], words, "time since the valve shut [s]", "muscle, less its end [bar]")
