"""Fingerprints of the effects on what is recorded."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from fingerprints.air import LOCKED
from fingerprints.sheet import (
    BAR,
    WITH,
    WITHOUT,
    Sheet,
    angle,
    clock,
    hold,
    label,
    pressure,
    temperature,
    through,
)
from pamrs import Simulation

__all__ = [
    "drifting_cell",
    "drifting_gauge",
    "erring_encoder",
    "late_angle",
    "late_clock",
    "late_pressure",
    "slow_thermometer",
]

NAMES = ("without", "with the effect")


def _swinging(sheet: Sheet) -> tuple[Simulation, Simulation]:
    """A fill, then the arm swings on the shut-in air."""
    time = clock(4.0, 0.002)
    return sheet.run(
        valve_command=hold(time, (0.0, 5.0), (0.2, 8.0), (0.3, 5.0)), sample_time=0.002
    )


def _loop(sheet: Sheet, axes: Axes, runs: tuple[Simulation, Simulation]) -> None:
    """Pressure against angle while the valve is shut."""
    sheet.both(axes, runs, pressure, angle, part=slice(500, None))
    label(
        axes,
        "valve shut: pressure against angle, a loop",
        "angle [deg]",
        "muscle [bar]",
        "upper right",
    )


def late_pressure(sheet: Sheet) -> None:
    """A fill, then the arm swings on the shut-in air."""
    runs = _swinging(sheet)
    axes = sheet.axes("fx;sx", width_ratios=[1.1, 1])
    sheet.both(axes["f"], runs, pressure, part=slice(75, 225))
    axes["f"].axvspan(0.2, 0.3, color="#dfe3e8", lw=0, zorder=0, label="valve open")
    label(axes["f"], "fill: the record comes late", y="muscle [bar]", legend="upper left")
    sheet.both(axes["s"], runs, pressure, part=slice(500, None))
    label(
        axes["s"],
        "valve shut: late as well where motion makes the pressure",
        y="muscle [bar]",
        legend="upper right",
    )
    _loop(sheet, axes["x"], runs)


def drifting_gauge(sheet: Sheet) -> None:
    """The same slow triangle of the pressure again and again, and vented between."""
    time = clock(80.0, 0.02)
    level = through(
        time, *((20.0 * k + t, p) for k in range(4) for t, p in ((0, 0), (8, 4), (16, 0), (19, 0)))
    )
    runs = sheet.run(supply_command=BAR * level, sample_time=0.02)
    axes = sheet.axes("px;zx", width_ratios=[1.2, 1])
    sheet.both(axes["p"], runs, pressure)
    label(axes["p"], "recorded pressure", y="muscle [bar]", legend="upper right")
    sheet.both(axes["z"], runs, pressure)
    axes["z"].set_ylim(-0.1, 0.4)
    label(axes["z"], "vented: it creeps off its zero", y="muscle [bar]")
    sheet.both(axes["x"], runs, angle, pressure)
    label(axes["x"], "angle against recorded pressure", "muscle [bar]", "angle [deg]")


def drifting_cell(sheet: Sheet) -> None:
    """Slow strokes of a load frame at three held pressures."""
    time = clock(60.0, 0.05)
    length = 0.25 + 0.02 * (2 / np.pi) * np.arcsin(np.sin(2 * np.pi * time / 10.0))
    gauge = BAR * hold(time, (0.0, 1.0), (20.0, 2.0), (40.0, 0.0))
    runs = sheet.run(length=length, pressure=gauge, sample_time=0.05)
    axes = sheet.axes("ff;dx", width_ratios=[1.2, 1])
    sheet.both(axes["f"], runs, _force)
    label(axes["f"], "recorded force: 1 bar, 2 bar, vented", y="force [N]", legend="upper right")
    axes["d"].plot(time, _force(runs[1]) - _force(runs[0]), color=WITH, lw=1.6)
    label(axes["d"], "the difference: the same at any length and pressure", y="force [N]")
    sheet.both(axes["x"], runs, _force, _length, part=slice(0, 400))
    label(axes["x"], "at 1 bar: force against length", "length [mm]", "force [N]")


def _force(run: Simulation) -> np.ndarray:
    return np.asarray(run["muscle_force"])


def _length(run: Simulation) -> np.ndarray:
    return 1e3 * np.asarray(run["length"])


def slow_thermometer(sheet: Sheet) -> None:
    """Fast fills and vents of a muscle that is held, whose gas has a temperature of its own."""
    sheet.rigs = tuple(rig.with_effect("heat_transfer") for rig in sheet.rigs)
    time = clock(12.0)
    command = hold(
        time, (0.0, 5.0), (1.0, 10.0), (1.15, 5.0), (5.0, 0.0), (5.25, 5.0), (9.0, 8.0), (9.6, 5.0)
    )
    runs = sheet.run(LOCKED, valve_command=command)
    axes = sheet.axes("tt;px", width_ratios=[1.2, 1])
    sheet.both(axes["t"], runs, temperature)
    label(
        axes["t"],
        "what the thermometer reads: late, and less deep where the gas is quick",
        y="gas [degC]",
        legend="lower right",
    )
    sheet.both(axes["p"], runs, pressure)
    label(axes["p"], "the pressure is the same", y="muscle [bar]")
    sheet.both(axes["x"], runs, temperature, pressure, part=slice(100, 520))
    label(axes["x"], "temperature against pressure", "muscle [bar]", "gas [degC]")


def erring_encoder(sheet: Sheet) -> None:
    """Slow triangles of the pressure, with the payload and with half of it."""
    time = clock(60.0, 0.02)
    axes = sheet.axes("xe", width_ratios=[1.2, 1])
    for payload, style, words in ((9.07, "-", "payload 9 kg"), (4.5, "--", "payload 4.5 kg")):
        runs = sheet.run(
            {"arm.payload": payload},
            supply_command=BAR * through(time, (0.0, 0.5), (30.0, 3.2), (60.0, 0.5)),
            sample_time=0.02,
        )
        for run, colour, name in zip(runs, (WITHOUT, WITH), NAMES, strict=True):
            axes["x"].plot(pressure(run), angle(run), style, color=colour, label=f"{name}, {words}")
        axes["e"].plot(angle(runs[0]), angle(runs[1]) - angle(runs[0]), style, color=WITH)
        axes["e"].plot([], [], style, color=WITH, label=words)
    label(
        axes["x"],
        "what is read, against the pressure",
        "muscle [bar]",
        "angle [deg]",
        "upper left",
    )
    label(
        axes["e"],
        "error of the reading: one curve over the angle",
        "angle [deg]",
        "reading less angle [deg]",
        "lower left",
    )


def late_clock(sheet: Sheet) -> None:
    """The same pulse of the command at the start and at the end."""
    last = 60.0
    time = clock(last + 8.0, 0.002)
    pulses = [
        pair
        for k in range(9)
        for pair in (
            (8.0 * k + 1.0, 5.6),
            (8.0 * k + 1.2, 5.0),
            (8.0 * k + 3.0, 4.2),
            (8.0 * k + 4.0, 5.0),
        )
    ]
    runs = sheet.run(valve_command=hold(time, (0.0, 5.0), *pulses), sample_time=0.002)
    axes = sheet.axes("pq;ab")
    for (top, low), begin, words in (
        (("p", "a"), 1.0, "at the start"),
        (("q", "b"), 57.0, "near the end"),
    ):
        part = slice(round((begin - 0.04) / 0.002), round((begin + 0.2) / 0.002))
        for run, colour, name in zip(runs, (WITHOUT, WITH), NAMES, strict=True):
            axes[top].plot(
                1e3 * (time[part] - begin), pressure(run)[part], color=colour, label=name
            )
            axes[low].plot(1e3 * (time[part] - begin), angle(run)[part], color=colour, label=name)
        for letter, channel, unit in (
            (top, "pressure", "muscle [bar]"),
            (low, "angle", "angle [deg]"),
        ):
            axes[letter].axvline(0.0, color="#6b7280", ls=":", lw=1.0, label="command")
            label(
                axes[letter],
                f"{channel}, {words}",
                "time since the command [ms]",
                unit,
                "lower right" if letter == "p" else "",
            )
    for letters in ("pq", "ab"):
        sizes = [np.ptp(axes[letter].get_ylim()) for letter in letters]
        for letter in letters:
            low_end, high_end = axes[letter].get_ylim()
            middle = 0.5 * (low_end + high_end)
            axes[letter].set_ylim(middle - 0.5 * max(sizes), middle + 0.5 * max(sizes))


def late_angle(sheet: Sheet) -> None:
    """A fill, then the arm swings on the shut-in air."""
    runs = _swinging(sheet)
    axes = sheet.axes("px;ax", width_ratios=[1.1, 1])
    sheet.both(axes["p"], runs, pressure, part=slice(500, None))
    label(axes["p"], "valve shut: the same pressure", y="muscle [bar]", legend="upper right")
    sheet.both(axes["a"], runs, angle, part=slice(500, None))
    label(axes["a"], "the angle is recorded later", y="angle [deg]")
    _loop(sheet, axes["x"], runs)
