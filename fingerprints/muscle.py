"""Fingerprints of the effects on what a muscle pulls."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from fingerprints.sheet import (
    BAR,
    QUIET,
    WITH,
    WITHOUT,
    Array,
    Sheet,
    angle,
    clock,
    hold,
    label,
    pressure,
    through,
)
from pamrs import Simulation, rigs, simulate

__all__ = [
    "activation",
    "creep",
    "crowding",
    "damping",
    "drift",
    "give",
    "hysteresis",
    "softening",
]

NAMES = ("without", "with the effect")
REST = 0.276  # m, rest length of the muscle on the bench, which is that of the joint


def zigzag(time: Array, *levels: float, over: float) -> Array:
    """Straight lines from level to level, each in the same time [s]."""
    return through(time, *((k * over, level) for k, level in enumerate(levels)))


def bench(
    sheet: Sheet, contraction: Array, gauge: float, sample_time: float
) -> tuple[Simulation, Simulation]:
    """The muscle on the load frame at a held pressure [Pa], its contraction prescribed."""
    effect = sheet.rigs[1].effects[0]
    plain = rigs.named("bench")
    pair = (plain, plain.with_effect(effect["id"], effect["parameters"]))
    drive: dict[str, Any] = {
        "length": REST * (1.0 - contraction),
        "pressure": np.full(contraction.size, gauge),
        "sample_time": sample_time,
    }
    without, with_ = (simulate(rig, **drive) for rig in pair)
    return without, with_


def triangle(sheet: Sheet, axis: Axes) -> None:
    """Angle of the joint by the pressure of a slow triangle, without the effect and with it."""
    time = clock(80.0, 0.05)
    runs = sheet.run(supply_command=BAR * zigzag(time, 0.0, 4.5, 0.0, over=40.0), sample_time=0.05)
    sheet.both(axis, runs, angle, pressure)


def pull(run: Simulation) -> Array:
    """Pull of one muscle [N]."""
    return run["muscle_force"]


def percent(run: Simulation) -> Array:
    """Contraction [%]."""
    return 100.0 * run["contraction_ratio"]


def hysteresis(sheet: Sheet) -> None:
    """Slow triangles of the pressure with a small one inside; the muscle alone, at two pressures
    and two speeds.
    """
    axes = sheet.axes("xf", width_ratios=[1, 1])
    over = 20.0
    time = clock(8 * over, 0.05)
    runs = sheet.run(
        supply_command=BAR * zigzag(time, 0.0, 3.2, 0.8, 2.2, 1.5, 2.2, 0.8, 3.2, 0.8, over=over),
        sample_time=0.05,
    )
    sheet.both(axes["x"], runs, angle, pressure, part=slice(round(over / 0.05), None))
    label(
        axes["x"],
        "joint, slow triangles: loops, a small one inside",
        "muscle [bar]",
        "angle [deg]",
        "upper left",
    )
    for gauge, place in ((2e5, 0.035), (4e5, 0.035)):
        for period, style in ((20.0, "-"), (2.0, "--")):
            time = clock(2.0 * period, period / 1000.0)
            wave = 0.06 + 0.03 * np.sin(2.0 * np.pi * time / period)
            pair = bench(sheet, wave, gauge, period / 1000.0)
            words = "" if style == "-" else ", ten times as fast"
            for run, colour, name in zip(pair, (WITHOUT, WITH), NAMES, strict=True):
                given = f"{name}{words}" if gauge == 2e5 else None
                wide: dict[str, Any] = (
                    {} if style == "-" else {"lw": 5.0, "alpha": 0.35, "zorder": 1.5}
                )
                axes["f"].plot(
                    percent(run)[1000:], pull(run)[1000:], color=colour, label=given, **wide
                )
        axes["f"].text(
            100 * place,
            float(np.interp(place, np.sort(wave), pull(pair[0])[np.argsort(wave)])) + 60.0,
            f"{gauge / BAR:g} bar",
        )
    label(
        axes["f"],
        "one muscle on a frame: wider with pressure, not with speed",
        "contraction [%]",
        "pull [N]",
        "upper right",
    )


def creep(sheet: Sheet) -> None:
    """Steps of pressure with holds; a partial return."""
    time = clock(80.0, 0.02)
    command = BAR * hold(time, (0.0, 1.0), (5.0, 2.4), (30.0, 1.0), (55.0, 2.4), (57.0, 2.1))
    runs = sheet.run(
        supply_command=command,
        sample_time=0.02,
        initial={"supply_pressure": 1e5, "muscle_pressure": 1e5, "joint_angle": 0.45},
    )
    axes = sheet.axes("p;a;d", sharex=True, height_ratios=[0.8, 1, 1])
    sheet.both(axes["p"], runs, pressure)
    label(axes["p"], "muscle: constant in every hold", "", "muscle [bar]")
    sheet.both(axes["a"], runs, angle)
    label(axes["a"], "joint", "", "angle [deg]", "upper center")
    for begin, end, words in (
        (8.0, 30.0, "goes on upward"),
        (33.0, 55.0, "goes on downward"),
        (59.5, 80.0, "after a partial return: back up"),
    ):
        part = slice(round(begin / 0.02), round(end / 0.02))
        for run, colour in zip(runs, (WITHOUT, WITH), strict=True):
            axes["d"].plot(time[part], (angle(run) - angle(run)[part][0])[part], color=colour)
        axes["d"].text(begin + 3.0, -1.2, words, color=QUIET)
    axes["d"].set_ylim(-1.5, 2.2)
    label(axes["d"], "joint in the holds, since their beginning", y="change [deg]")


def damping(sheet: Sheet) -> None:
    """The muscle at two speeds and two pressures; the arm let go at two pressures."""
    axes = sheet.axes("fl;dh", width_ratios=[1.1, 1])
    for gauge in (1e5, 4e5):
        for period, style in ((2.0, "--"), (0.5, "-")):
            time = clock(2.0 * period, period / 1000.0)
            wave = 0.06 + 0.03 * np.sin(2.0 * np.pi * time / period)
            pair = bench(sheet, wave, gauge, period / 1000.0)
            if gauge > 2e5:
                for run, colour, name in zip(pair, (WITHOUT, WITH), NAMES, strict=True):
                    axes["f"].plot(
                        percent(run)[1000:],
                        pull(run)[1000:],
                        style,
                        color=colour,
                        label=f"{name}, {1.0 / period:g} Hz",
                    )
        extra = (pull(pair[1]) - pull(pair[0]))[1000:]
        axes["d"].plot(
            1e3 * np.gradient(REST * (1.0 - wave), time)[1000:],
            extra,
            "--" if gauge < 2e5 else "-",
            color=WITH,
            label=f"{gauge / BAR:g} bar",
        )
    label(
        axes["f"],
        "one muscle at 4 bar: the loop grows with speed",
        "contraction [%]",
        "pull [N]",
        "upper right",
    )
    axes["d"].axhline(0.0, color=QUIET, lw=0.8)
    label(
        axes["d"],
        "steeper at higher pressure, less while lengthening",
        "speed of lengthening [mm/s]",
        "with less without [N]",
        "upper left",
    )
    for letter, bar, start in (("l", 1.5, 60.0), ("h", 3.0, 70.0)):
        time = clock(4.0, 0.005)
        first = {
            "supply_pressure": bar * BAR,
            "muscle_pressure": bar * BAR,
            "joint_angle": np.radians(start),
        }
        runs = sheet.run(
            {"arm.coulomb": 0.2},
            supply_command=np.full(time.size, bar * BAR),
            sample_time=0.005,
            initial=first,
        )
        for run, colour, name in zip(runs, (WITHOUT, WITH), NAMES, strict=True):
            axes[letter].plot(time, angle(run) - angle(run)[-1], color=colour, label=name)
        label(
            axes[letter],
            f"let go at {bar:g} bar",
            y="angle, less its end [deg]",
            legend="upper right",
        )


def activation(sheet: Sheet) -> None:
    """A slow rise of the pressure from 0 bar, with the payload and without."""
    time = clock(60.0, 0.05)
    axes = sheet.axes("xd", width_ratios=[1.2, 1])
    for payload, style, words in ((9.07, "-", "payload 9 kg"), (0.0, "--", "no payload")):
        runs = sheet.run(
            {"arm.payload": payload},
            supply_command=BAR * through(time, (0.0, 0.0), (60.0, 3.2)),
            sample_time=0.05,
        )
        for run, colour, name in zip(runs, (WITHOUT, WITH), NAMES, strict=True):
            axes["x"].plot(pressure(run), angle(run), style, color=colour, label=f"{name}, {words}")
        grid = np.linspace(18.0, min(118.0, angle(runs[1]).max()), 100)
        shift = [np.interp(grid, angle(run), pressure(run)) for run in runs]
        axes["d"].plot(grid, shift[1] - shift[0], style, color=WITH, label=words)
    threshold = sheet.rigs[1].effects[0]["parameters"]["threshold"] / BAR
    axes["x"].axvspan(0.0, threshold, color="#dfe3e8", lw=0)
    label(
        axes["x"],
        "joint: no motion up to the threshold, then shifted",
        "muscle [bar]",
        "angle [deg]",
        "upper left",
    )
    axes["d"].axhline(threshold, color=QUIET, ls=":", label="threshold")
    axes["d"].set_ylim(0.0, 1.5 * threshold)
    label(
        axes["d"],
        "more pressure for the same angle: the same everywhere",
        "angle [deg]",
        "with less without [bar]",
        "lower right",
    )


def softening(sheet: Sheet) -> None:
    """Slow triangles, the first cycle kept: twice to one pressure, then twice to a higher one."""
    over = 15.0
    time = clock(8 * over, 0.05)
    levels = (0.0, 2.0, 0.0, 2.0, 0.0, 3.0, 0.0, 3.0, 0.0)
    runs = sheet.run(
        {"arm.coulomb": 0.0},
        supply_command=BAR * zigzag(time, *levels, over=over),
        sample_time=0.05,
    )
    axes = sheet.axes("px;ax", width_ratios=[1, 1.2])
    sheet.both(axes["p"], runs, pressure)
    label(axes["p"], "muscle: twice low, twice high", y="muscle [bar]")
    sheet.both(axes["a"], runs, angle)
    label(axes["a"], "joint", y="angle [deg]", legend="upper left")
    strokes = [
        slice(round(2 * k * over / 0.05) + 10, round((2 * k + 1) * over / 0.05) - 10)
        for k in range(4)
    ]
    axes["x"].plot(
        pressure(runs[0])[strokes[3]],
        angle(runs[0])[strokes[3]],
        color=WITHOUT,
        lw=5.0,
        alpha=0.4,
        label="without, every stroke",
    )
    styles = ((":", 1.8, 1.0), ("--", 1.8, 1.0), ("-", 5.0, 0.35), ("-", 1.8, 1.0))
    for k, (part, (style, width, alpha)) in enumerate(zip(strokes, styles, strict=True)):
        words = f"with, stroke {k + 1}, to {levels[2 * k + 1]:g} bar"
        axes["x"].plot(
            pressure(runs[1])[part],
            angle(runs[1])[part],
            style,
            color=WITH,
            lw=width,
            alpha=alpha,
            label=words,
        )
    label(
        axes["x"],
        "strokes upward: as modelled where it never was, stronger later",
        "muscle [bar]",
        "angle [deg]",
        "upper left",
    )


def crowding(sheet: Sheet) -> None:
    """The muscle at three pressures over its stroke; the joint under a slow triangle."""
    axes = sheet.axes("fx;dx", width_ratios=[1.15, 1])
    time = clock(20.0, 0.02)
    wave = zigzag(time, 0.0, 0.2, 0.0, over=10.0)
    for gauge, style in ((1e5, ":"), (3e5, "--"), (5e5, "-")):
        pair = bench(sheet, wave, gauge, 0.02)
        for run, colour, name in zip(pair, (WITHOUT, WITH), NAMES, strict=True):
            axes["f"].plot(
                percent(run), pull(run), style, color=colour, label=f"{name}, {gauge / BAR:g} bar"
            )
        axes["d"].plot(
            percent(pair[0]),
            pull(pair[1]) - pull(pair[0]),
            style,
            color=WITH,
            label=f"{gauge / BAR:g} bar",
        )
    label(axes["f"], "one muscle on a frame", "contraction [%]", "pull [N]", "upper right")
    label(
        axes["d"],
        "what is missing: from one contraction on, more with pressure",
        "contraction [%]",
        "with less without [N]",
        "lower left",
    )
    triangle(sheet, axes["x"])
    axes["x"].set(xlim=(2.0, 4.6), ylim=(50.0, 122.0))
    label(
        axes["x"],
        "joint: falls short the same way up and down",
        "muscle [bar]",
        "angle [deg]",
        "upper left",
    )


def give(sheet: Sheet) -> None:
    """The muscle at three pressures over its stroke, by the length that the frame has and by that
    of the muscle; the joint under a slow triangle.
    """
    axes = sheet.axes("fx;mx", width_ratios=[1.15, 1])
    time = clock(20.0, 0.02)
    wave = zigzag(time, 0.0, 0.15, over=20.0)
    for gauge, style in ((1e5, ":"), (3e5, "--"), (5e5, "-")):
        pair = bench(sheet, wave, gauge, 0.02)
        for run, colour, name in zip(pair, (WITHOUT, WITH), NAMES, strict=True):
            named = f"{name}, {gauge / BAR:g} bar"
            of_frame = 100.0 * (1.0 - run["length"] / REST)
            axes["f"].plot(of_frame, pull(run), style, color=colour, label=named)
            axes["m"].plot(percent(run), pull(run), style, color=colour, label=named)
    label(axes["f"], "by the length of muscle and tendon", "", "pull [N]", "upper right")
    label(
        axes["m"],
        "by the length of the muscle: the same curves",
        "contraction [%]",
        "pull [N]",
        "upper right",
    )
    triangle(sheet, axes["x"])
    label(
        axes["x"],
        "joint: falls short, more with more pull",
        "muscle [bar]",
        "angle [deg]",
        "upper left",
    )


def drift(sheet: Sheet) -> None:
    """The same slow triangle again and again (no Coulomb friction)."""
    over = 15.0
    time = clock(8 * over, 0.05)
    runs = sheet.run(
        {"arm.coulomb": 0.0},
        supply_command=BAR * zigzag(time, *(0.0, 2.5) * 4, 0.0, over=over),
        sample_time=0.05,
    )
    axes = sheet.axes("ax", width_ratios=[1.1, 1])
    sheet.both(axes["a"], runs, angle)
    label(axes["a"], "joint: each cycle goes further", y="angle [deg]", legend="upper left")
    cycle = round(2 * over / 0.05)
    first, last = slice(10, cycle - 10), slice(3 * cycle + 10, 4 * cycle - 10)
    axes["x"].plot(
        pressure(runs[0])[last],
        angle(runs[0])[last],
        color=WITHOUT,
        lw=4.0,
        alpha=0.5,
        label="without, every cycle",
    )
    for part, style, words in ((first, ":", "with, first cycle"), (last, "-", "with, last cycle")):
        axes["x"].plot(
            pressure(runs[1])[part], angle(runs[1])[part], style, color=WITH, label=words
        )
    label(
        axes["x"],
        "the same pressure holds another angle later",
        "muscle [bar]",
        "angle [deg]",
        "upper left",
    )
