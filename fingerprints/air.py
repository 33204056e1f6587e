"""Fingerprints of the effects on the way of the air."""

from __future__ import annotations

import numpy as np

from fingerprints.sheet import BAR, QUIET, WITH, WITHOUT, Array, Sheet, angle, clock, flow, hold, label, pressure, supply, through

__all__ = [
    "centre_leakage",
    "compressor",
    "dead_band",
    "dead_zone",
    "heat",
    "input_lag",
    "muscle_leak",
    "play",
    "restriction",
    "supply_leak",
]

#: A supply at 7 bar and a muscle at 3 bar: filling and venting are about as fast.
MIDDLE = {"supply_pressure": 7e5, "muscle_pressure": 3e5, "joint_angle": 1.57}


def supply_leak(sheet: Sheet) -> None:
    """Idle, one fill, idle."""
    time = clock(120.0, 0.05)
    runs = sheet.run(valve_command=hold(time, (0.0, 5.0), (60.0, 5.5), (60.8, 5.0)), sample_time=0.05)
    axes = sheet.axes("sx;px", width_ratios=[1.25, 1])
    sheet.both(axes["s"], runs, supply)
    label(axes["s"], "supply: falls with the valve shut, before and after the fill", y="supply [bar]", legend="lower left")
    sheet.both(axes["p"], runs, pressure)
    label(axes["p"], "muscle: as modelled", y="muscle [bar]", legend="upper left")
    idle = np.r_[20:1150, 1400:2390]
    absolute = (supply(runs[1]) + 1.01325)[idle]
    for run, colour, words in zip(runs, (WITHOUT, WITH), ("without", "with the effect"), strict=True):
        axes["x"].plot((supply(run) + 1.01325)[idle], -1e5 * np.gradient(supply(run), 0.05)[idle], ".", ms=3, color=colour, label=words)
    rate = np.polyfit(absolute, -1e5 * np.gradient(supply(runs[1]), 0.05)[idle], 1)
    axes["x"].plot([0.0, 15.0], [0.0, 15.0 * np.polyval(rate, absolute.mean()) / absolute.mean()], ":", color=QUIET, label="through zero")
    label(axes["x"], "idle: rate of fall, in proportion", "supply, absolute [bar]", "fall [Pa/s]", "center left")


def compressor(sheet: Sheet) -> None:
    """Fills and vents in a row, then idle."""
    time = clock(100.0, 0.05)
    command = np.where((time % 4.0 < 1.0) & (time < 64.0), 5.6, np.where((time % 4.0 > 2.0) & (time < 64.0), 3.4, 5.0))
    runs = sheet.run(valve_command=command, sample_time=0.05)
    axes = sheet.axes("s;p", height_ratios=[2, 1], sharex=True)
    sheet.both(axes["s"], runs, supply)
    values = {**{p: sheet.rigs[1].effects[0]["parameters"][p] for p in ("cut_in_pressure", "cut_out_pressure")}}
    for name, words in (("cut_out_pressure", "stops"), ("cut_in_pressure", "starts")):
        axes["s"].axhline(values[name] / BAR, color=QUIET, ls=":", lw=1.2)
        axes["s"].text(99.0, values[name] / BAR, words, ha="right", va="bottom", color=QUIET)
    label(axes["s"], "supply", "", "supply [bar]", "lower left")
    sheet.both(axes["p"], runs, pressure)
    label(axes["p"], "muscle: what uses the air up; after 64 s nothing does, and the compressor goes on to its stop", y="muscle [bar]")


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
    for run, colour, words in zip(runs, (WITHOUT, WITH), ("without", "with the effect"), strict=True):
        axes["x"].plot(time, command / BAR - supply(run), color=colour, lw=1.3, label=words)
    axes["x"].set_ylim(-0.5, 0.5)
    label(axes["x"], "error: stays where it enters the band", y="set - outlet [bar]", legend="upper right")


def _triangle(time: Array, period: float, low: float, high: float) -> Array:
    """A command that rises and falls evenly [V]."""
    phase = (time / period) % 1.0
    return low + (high - low) * (1.0 - np.abs(2.0 * phase - 1.0))


def dead_zone(sheet: Sheet) -> None:
    """Slow ramps of the command through the null, both ways."""
    time = clock(8.0, 0.005)
    runs = sheet.run(valve_command=_triangle(time + 1.0, 4.0, 4.55, 5.35), sample_time=0.005, initial=MIDDLE)
    axes = sheet.axes("ux;px", width_ratios=[1, 1.1])
    axes["u"].plot(time, runs[0]["valve_command"], color=QUIET)
    label(axes["u"], "command: ramps through the null", y="valve [V]")
    sheet.both(axes["p"], runs, pressure)
    label(axes["p"], "muscle: flat tops, each turn waits", y="muscle [bar]", legend="lower left")
    sheet.both(axes["x"], runs, flow, lambda run: run["valve_command"], part=slice(2, -2))
    half = 5.0 * sheet.rigs[1].effects[0]["parameters"]["half_width"]
    axes["x"].axvspan(5.0 - half, 5.0 + half, color="#dfe3e8", lw=0, label="dead zone")
    label(axes["x"], "flow against command: none in the dead zone", "valve [V]", "air into the muscle [g/s]", "upper left")


def play(sheet: Sheet) -> None:
    """Triangles of the command at two speeds: through the null, and on one side of it."""
    axes = sheet.axes("xy")
    ranges = (("x", 4.6, 5.4, "through the null"), ("y", 5.2, 5.6, "on one side of the null"))
    for letter, low, high, words in ranges:
        for period, style in ((2.0, "-"), (0.4, "--")):
            time = clock(3.0 * period, 0.001)
            start = {**MIDDLE, "muscle_pressure": 1e5, "joint_angle": 0.45}
            runs = sheet.run(valve_command=_triangle(time, period, low, high), sample_time=0.001, initial=start)
            part = slice(int(1.25 * period / 0.001), int(2.25 * period / 0.001))
            of = {"part": part, "ls": style}
            if period < 1.0:
                sheet.both(axes[letter], runs, flow, lambda run: run["valve_command"], label="five times as fast", **of)
            else:
                sheet.both(axes[letter], runs, flow, lambda run: run["valve_command"], **of)
        label(axes[letter], words, "valve [V]", "air into the muscle [g/s]", "upper left")


def centre_leakage(sheet: Sheet) -> None:
    """The valve at its null, from a low and from a high pressure."""
    time = clock(240.0, 0.1)
    axes = sheet.axes("px;sx", width_ratios=[1.25, 1])
    for start, style in ((1e5, "-"), (6e5, "--")):
        first = {"muscle_pressure": start, "supply_pressure": 7e5, "joint_angle": 0.45 if start < 2e5 else 2.09}
        runs = sheet.run(valve_command=np.full(time.size, 5.0), sample_time=0.1, initial=first)
        words = "from below" if style == "-" else "from above"
        for run, colour, which in zip(runs, (WITHOUT, WITH), ("without", "with"), strict=True):
            axes["p"].plot(time, pressure(run), style, color=colour, label=f"{which}, {words}")
            axes["s"].plot(time, supply(run), style, color=colour)
            axes["x"].plot(pressure(run)[5:], 1e3 * flow(run)[5:], style, color=colour)
    label(axes["p"], "muscle: to one and the same value", y="muscle [bar]", legend="center right")
    label(axes["s"], "supply: air is used up all the time", y="supply [bar]")
    axes["x"].axhline(0.0, color=QUIET, lw=0.8)
    label(axes["x"], "flow at the null: changes its sign", "muscle [bar]", "air into the muscle [mg/s]")


def input_lag(sheet: Sheet) -> None:
    """A large fill, a small fill and a vent."""
    axes = sheet.axes("up;xx", height_ratios=[1, 1.2])
    time = clock(0.5, 0.0005)
    command = hold(time, (0.0, 5.0), (0.05, 7.5), (0.15, 5.0), (0.25, 5.6), (0.35, 5.0), (0.4, 3.5))
    runs = sheet.run(valve_command=command, sample_time=0.0005, initial={**MIDDLE, "supply_pressure": 9e5})
    axes["u"].plot(time, command, color=QUIET)
    label(axes["u"], "command", y="valve [V]")
    sheet.both(axes["p"], runs, flow)
    label(axes["p"], "flow: late at every edge", y="air into the muscle [g/s]", legend="upper right")
    for at, style, words in ((0.05, "-", "large fill"), (0.25, "--", "small fill"), (0.4, ":", "vent")):
        part = slice(round((at - 0.01) / 0.0005), round((at + 0.06) / 0.0005))
        for run, colour, which in zip(runs, (WITHOUT, WITH), ("without", "with"), strict=True):
            edge = flow(run)[part]
            size = flow(run)[round((at + 0.08) / 0.0005)]
            axes["x"].plot(1e3 * (time[part] - at), edge / size, style, color=colour, label=f"{which}, {words}")
    label(axes["x"], "each edge in parts of its size: all late by the same", "time since the edge of the command [ms]", "flow [1]", "lower right")


def restriction(sheet: Sheet) -> None:
    """Fills and vents at three openings, and the flow at every opening."""
    axes = sheet.axes("px;vx", width_ratios=[1, 1.1])
    for letter, start, volts in (("p", 0.5e5, (5.8, 6.6, 10.0)), ("v", 6e5, (4.2, 3.4, 0.0))):
        for k, volt in enumerate(volts):
            time = clock(1.0, 0.005)
            first = {"muscle_pressure": start, "joint_angle": 0.32 if start < 1e5 else 2.09}
            command = hold(time, (0.0, 5.0), (0.05, volt), (0.05 + (2.0, 0.6, 0.12)[k] if letter == "p" else 9.0, 5.0))
            runs = sheet.run(valve_command=command, sample_time=0.005, initial=first)
            sheet.both(axes[letter], runs, pressure, label="_" if k else None)
            at = (0.55, 0.35, 0.11)[k]
            axes[letter].text(at, float(np.interp(at, time, pressure(runs[0]))), f" {volt:g} V", color=QUIET, ha="right", va="bottom")
        axes[letter].lines[0].set_label("without")
        axes[letter].lines[1].set_label("with the effect")
    label(axes["p"], "filling at three openings", y="muscle [bar]", legend="lower right")
    label(axes["v"], "venting at three openings", y="muscle [bar]", legend="upper right")
    volts = np.linspace(0.0, 10.0, 81)
    first = {"muscle_pressure": 4e5, "joint_angle": 2.0}
    for rig, colour, words in zip(sheet.rigs, (WITHOUT, WITH), ("without", "with the effect"), strict=True):
        import pamrs

        runs = [pamrs.simulate(rig, np.full(2, volt), sample_time=1e-4, initial=first) for volt in volts]
        axes["x"].plot(volts, [flow(run)[0] for run in runs], color=colour, label=words)
    label(axes["x"], "flow at 4 bar: short at large openings, both ways", "valve [V]", "air into the muscle [g/s]", "upper left")


def muscle_leak(sheet: Sheet) -> None:
    """Fill, shut, hold, at three levels."""
    time = clock(100.0, 0.05)
    command = hold(time, (0.0, 6.0), (0.25, 5.0), (33.0, 6.0), (33.25, 5.0), (66.0, 6.0), (66.25, 5.0))
    runs = sheet.run(valve_command=command, sample_time=0.05)
    axes = sheet.axes("px;ax", width_ratios=[1.25, 1])
    sheet.both(axes["p"], runs, pressure)
    label(axes["p"], "muscle: falls with the valve shut, without end", y="muscle [bar]", legend="upper left")
    sheet.both(axes["a"], runs, angle)
    label(axes["a"], "joint: sinks with it", y="angle [deg]")
    for first, last in ((3.0, 32.0), (36.0, 65.0), (70.0, 99.0)):
        part = slice(round(first / 0.05), round(last / 0.05))
        for run, colour in zip(runs, (WITHOUT, WITH), strict=True):
            axes["x"].plot(pressure(run)[part] + 1.01325, -1e3 * flow(run)[part], ".", ms=3, color=colour)
    last = (pressure(runs[1])[-40] + 1.01325, -1e3 * flow(runs[1])[-40])
    axes["x"].plot([0.0, last[0]], [0.0, last[1]], ":", color=QUIET, label="through zero")
    label(axes["x"], "valve shut: loss in proportion to absolute pressure", "muscle, absolute [bar]", "air lost [mg/s]", "upper left")


def heat(sheet: Sheet) -> None:
    """A fast fill and a fast vent, each with the valve shut after it; small ones and large ones."""
    time = clock(24.0)
    command = hold(time, (0.0, 5.0), (1.0, 10.0), (1.2, 5.0), (7.0, 0.0), (7.25, 5.0), (13.0, 10.0), (13.06, 5.0), (19.0, 0.0), (19.08, 5.0))
    runs = sheet.run(valve_command=command)
    axes = sheet.axes("pp;fv")
    sheet.both(axes["p"], runs, pressure)
    label(axes["p"], "muscle: large and small, fast fills and vents, the valve shut in between", y="muscle [bar]", legend="upper right")
    for letter, at, words in (("f", 1.2, "after the large fill: falls, then stays"), ("v", 7.25, "after the large vent: rises, then stays")):
        part = slice(round((at + 0.6) / 0.01), round((at + 5.0) / 0.01))
        for run, colour in zip(runs, (WITHOUT, WITH), strict=True):
            axes[letter].plot(time[part] - at, (pressure(run) - pressure(run)[part][-1])[part], color=colour)
        label(axes[letter], words, "time since the valve shut [s]", "muscle, less its end [bar]")
