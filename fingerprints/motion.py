"""Fingerprints of the effects on joint and arm."""

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
    hold,
    label,
    pressure,
    through,
)
from pamrs import Simulation

__all__ = ["change", "end_stop", "mounting", "offset", "push", "stiction", "swing"]

NAMES = ("without", "with the effect")


def begin(bar: float, degrees: float) -> dict[str, float]:
    """A state at rest at a pressure."""
    return {
        "supply_pressure": bar * BAR,
        "muscle_pressure": bar * BAR,
        "joint_angle": np.radians(degrees),
    }


def missing_torque(sheet: Sheet, run: Simulation) -> Array:
    """Torque of the muscles less weight, inertia and viscous friction of the model without the
    effect [N m].
    """
    arm = sheet.rigs[0].tables("arm")[""]
    inertia = arm["inertia"] + arm["payload"] * arm["length"] ** 2
    moment = arm["first_moment"] + arm["payload"] * arm["length"]
    rate = run["joint_rate"]
    weight = arm["gravity"] * moment * np.sin(run["joint_angle"])
    return np.asarray(
        inertia * np.gradient(rate, run.time) + arm["viscous"] * rate + weight - run["joint_torque"]
    )


def stiction(sheet: Sheet) -> None:
    """A very slow triangle of the pressure."""
    time = clock(90.0, 0.02)
    command = BAR * through(
        time, (0.0, 1.1), (20.0, 1.7), (40.0, 1.3), (60.0, 1.7), (80.0, 1.3), (90.0, 1.5)
    )
    runs = sheet.run(supply_command=command, sample_time=0.02, initial=begin(1.1, 27.5))
    part = slice(round(10.0 / 0.02), None)
    axes = sheet.axes("px;ax", width_ratios=[1.1, 1])
    sheet.both(axes["p"], runs, pressure, part=part)
    label(axes["p"], "muscle: moves on", y="muscle [bar]")
    sheet.both(axes["a"], runs, angle, part=part)
    label(
        axes["a"],
        "joint: stands after each return, then breaks away",
        y="angle [deg]",
        legend="upper right",
    )
    sheet.both(axes["x"], runs, angle, pressure, part=part)
    label(
        axes["x"],
        "joint against pressure: flat, then a jump",
        "muscle [bar]",
        "angle [deg]",
        "upper left",
    )


def end_stop(sheet: Sheet) -> None:
    """A slow triangle, and steps to three pressures."""
    axes = sheet.axes("xs;xd")
    time = clock(60.0, 0.02)
    runs = sheet.run(
        supply_command=BAR * through(time, (0.0, 0.5), (30.0, 4.0), (60.0, 0.5)), sample_time=0.02
    )
    sheet.both(axes["x"], runs, angle, pressure)
    stop = np.degrees(sheet.rigs[1].effects[0]["parameters"]["angle"])
    axes["x"].axhline(stop, color=QUIET, ls=":")
    label(
        axes["x"],
        "slow triangle: motion ends at one angle",
        "muscle [bar]",
        "angle [deg]",
        "upper left",
    )
    time = clock(4.0, 0.005)
    for bar, style in ((2.6, "-"), (3.4, "--")):
        runs = sheet.run(
            supply_command=BAR * hold(time, (0.0, 1.0), (0.2, bar)),
            sample_time=0.005,
            initial=begin(1.0, 25.5),
        )
        for run, colour, name in zip(runs, (WITHOUT, WITH), NAMES, strict=True):
            axes["s"].plot(time, angle(run), style, color=colour, label=f"{name}, to {bar:g} bar")
            axes["d"].plot(time, run["joint_rate"], style, color=colour)
    axes["s"].axhline(stop, color=QUIET, ls=":")
    label(
        axes["s"], "steps: the same angle at both pressures", y="angle [deg]", legend="lower right"
    )
    label(axes["d"], "rate: rebounds", y="rate [rad/s]")


def swing(sheet: Sheet) -> None:
    """Steps to two pressures, then hold."""
    axes = sheet.axes("pp;lh")
    time = clock(24.0, 0.01)
    command = BAR * hold(time, (0.0, 1.2), (1.0, 1.6), (12.0, 2.6))
    runs = sheet.run(supply_command=command, initial=begin(1.2, 30.0))
    sheet.both(axes["p"], runs, angle)
    label(
        axes["p"],
        "joint: after each manoeuvre an oscillation that lasts, at constant pressure",
        y="angle [deg]",
        legend="lower right",
    )
    values = sheet.rigs[1].effects[0]["parameters"]
    cord = np.sqrt(9.80665 / values["length"]) / (2.0 * np.pi)
    for letter, first, words in (("l", 3.5, "1.6 bar"), ("h", 14.5, "2.6 bar")):
        part = slice(round(first / 0.01), round((first + 7.0) / 0.01))
        for run, colour, name in zip(runs, (WITHOUT, WITH), NAMES, strict=True):
            axes[letter].plot(
                time[part], (angle(run) - angle(run)[part].mean())[part], color=colour, label=name
            )
        for k in range(8):
            if first + k / cord < first + 7.0:
                axes[letter].axvline(
                    first + k / cord,
                    color=QUIET,
                    lw=1.1,
                    ls=":",
                    label="period of the cord" if k == 0 else None,
                )
        label(axes[letter], f"at {words}, about its mean", y="angle [deg]", legend="upper right")


def change(sheet: Sheet) -> None:
    """Slow triangles of the pressure; the payload changes after the second."""
    time = clock(80.0, 0.02)
    command = BAR * through(time, *((k * 10.0, 1.0 if k % 2 == 0 else 2.4) for k in range(9)))
    runs = sheet.run(supply_command=command, sample_time=0.02, initial=begin(1.0, 25.5))
    when = sheet.rigs[1].effects[0]["parameters"]["time"]
    axes = sheet.axes("px;ax", width_ratios=[1.1, 1])
    sheet.both(axes["p"], runs, pressure)
    label(axes["p"], "muscle: the same before and after", y="muscle [bar]")
    sheet.both(axes["a"], runs, angle)
    axes["a"].axvline(when, color=QUIET, ls=":")
    label(
        axes["a"], "joint: from one moment on another angle", y="angle [deg]", legend="upper left"
    )
    mass = sheet.rigs[1].effects[0]["parameters"]["mass_change"]
    torque = -missing_torque(sheet, runs[1])
    for part, colour, words in (
        (time < when, WITHOUT, "before"),
        (time > when + 0.5, WITH, "after"),
    ):
        axes["x"].plot(angle(runs[1])[part], torque[part], color=colour, lw=1.1, label=words)
    grid = np.linspace(25.0, 85.0, 50)
    lever = sheet.rigs[0].tables("arm")[""]["length"]
    axes["x"].plot(
        grid,
        mass * 9.80665 * lever * np.sin(np.radians(grid)),
        ":",
        color=QUIET,
        label="weight times lever",
    )
    label(
        axes["x"],
        "torque that the model lacks: follows the weight's lever",
        "angle [deg]",
        "more torque of the muscles [N m]",
        "center right",
    )


def push(sheet: Sheet) -> None:
    """The same command twice, one push."""
    time = clock(32.0, 0.01)
    command = BAR * hold(time, (0.0, 1.2), (1.0, 2.0), (10.0, 1.2), (17.0, 2.0), (26.0, 1.2))
    runs = sheet.run({"arm.coulomb": 0.0}, supply_command=command, initial=begin(1.2, 30.0))
    values = sheet.rigs[1].effects[0]["parameters"]
    axes = sheet.axes("p;a;t", sharex=True, height_ratios=[0.7, 1, 1])
    sheet.both(axes["p"], runs, pressure)
    label(axes["p"], "muscle: the same command twice", "", "muscle [bar]")
    sheet.both(axes["a"], runs, angle)
    label(axes["a"], "joint: pushed once", "", "angle [deg]", "upper right")
    for run, colour, name in zip(runs, (WITHOUT, WITH), NAMES, strict=True):
        axes["t"].plot(time, missing_torque(sheet, run), color=colour, label=name)
    axes["t"].axvspan(
        values["time"],
        values["time"] + values["duration"],
        color="#dfe3e8",
        lw=0,
        zorder=0,
        label="push",
    )
    label(
        axes["t"],
        "torque that the model lacks: begins and ends by itself",
        y="torque [N m]",
        legend="lower left",
    )


def mounting(sheet: Sheet) -> None:
    """Fast random steps of the set pressure about a pose."""
    step = 0.002
    time = clock(40.0, step)
    level = np.random.default_rng(7).choice([-1.0, 1.0], size=round(40.0 / 0.04))
    command = BAR * (2.0 + np.repeat(level, round(0.04 / step))[: time.size])
    axes = sheet.axes("ax;bx", width_ratios=[1.1, 1])
    runs = sheet.run(
        {"arm.coulomb": 0.0}, supply_command=command, sample_time=step, initial=begin(2.0, 52.0)
    )
    for run, colour, name in zip(runs, (WITHOUT, WITH), NAMES, strict=True):
        axes["a"].plot(time[:1500], np.degrees(run["joint_rate"])[:1500], color=colour, label=name)
        axes["b"].plot(time[:1500], missing_torque(sheet, run)[:1500], color=colour, lw=1.0)
        frequency, gain = _gain(run, step)
        axes["x"].plot(frequency, gain, color=colour, label=name)
    axes["x"].axvline(
        sheet.rigs[1].effects[0]["parameters"]["natural_frequency"],
        color=QUIET,
        ls=":",
        label="base without the arm",
    )
    label(axes["a"], "joint under fast moves", y="rate [deg/s]", legend="upper right")
    label(axes["b"], "torque that the model lacks: rings", y="torque [N m]")
    label(
        axes["x"],
        "inertia by frequency: too large, a peak, too small",
        "frequency [Hz]",
        "torque by acceleration [kg m2]",
        "upper right",
    )


def _gain(run: Simulation, step: float) -> tuple[Array, Array]:
    """Torque on the link by its acceleration over frequency [kg m2], averaged over windows."""
    arm = run.rig.tables("arm")[""]
    moment = arm["first_moment"] + arm["payload"] * arm["length"]
    torque = (
        run["joint_torque"]
        - arm["viscous"] * run["joint_rate"]
        - arm["gravity"] * moment * np.sin(run["joint_angle"])
    )
    size = 2000
    window = np.hanning(size)
    top, bottom = np.zeros(size // 2 + 1, dtype=complex), np.zeros(size // 2 + 1)
    for first in range(0, len(torque) - size, size // 2):
        part = slice(first, first + size)
        moved = np.fft.rfft(window * np.gradient(run["joint_rate"], step)[part])
        top += np.fft.rfft(window * (torque[part] - torque[part].mean())) * np.conj(moved)
        bottom += np.abs(moved) ** 2
    frequency = np.fft.rfftfreq(size, step)
    keep = (frequency > 0.9) & (frequency < 15.0)
    return np.asarray(frequency[keep], dtype=np.float64), np.abs(top[keep] / bottom[keep])


def offset(sheet: Sheet) -> None:
    """A slow triangle of the pressure (no Coulomb friction)."""
    time = clock(60.0, 0.05)
    runs = sheet.run(
        {"arm.coulomb": 0.0},
        supply_command=BAR * through(time, (0.0, 0.0), (30.0, 3.2), (60.0, 0.0)),
        sample_time=0.05,
    )
    axes = sheet.axes("at", width_ratios=[1, 1])
    sheet.both(axes["a"], runs, angle)
    label(axes["a"], "joint: off where it hangs", y="angle [deg]", legend="upper right")
    for run, colour, name in zip(runs, (WITHOUT, WITH), NAMES, strict=True):
        off_stop = angle(run) > angle(run).min() + 1.0
        axes["t"].plot(
            angle(run)[off_stop], missing_torque(sheet, run)[off_stop], color=colour, label=name
        )
    label(
        axes["t"],
        "torque that the model lacks: a cosine of the angle",
        "angle [deg]",
        "[N m]",
        "lower right",
    )
