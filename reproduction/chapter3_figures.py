"""The pictures of chapter 3: our curves, and the published numbers as marks (its figures are not
digitised).
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamrs._views import decimate
from pamrs.report.figures import COLOURS
from reproduction import drawing, elbow
from reproduction.chapter3 import say, step_by_area
from reproduction.elbow import FOOT_POUND, PSI
from reproduction.lifting import lift
from reproduction.page import Picture

_COLOUR: Final = {"conserving": COLOURS["after"], "printed": COLOURS["before"]}
_NAMES: Final = {
    "conserving": "torque that conserves power",
    "printed": "torque as printed (3.6)-(3.8)",
}
_GREEN, _PURPLE, _INK, _FAINT = "#009e73", "#cc79a7", "#1f1f1f", "#9ca3af"
_ROTATION: Final = "rotation from the rest angle [deg]"
#: a published number, and one that was published for a range
_DASHED: Final[dict[str, Any]] = {"color": _INK, "lw": 0.9, "ls": (0, (5, 2))}
_BAR: Final[dict[str, Any]] = {"color": _INK, "solid_capstyle": "butt"}
#: words on the left of a place
_NOTE: Final[dict[str, Any]] = {"textcoords": "offset points", "ha": "right", "fontsize": 8}
_HYSTERESIS: Final = (
    (False, COLOURS["after"], "without hysteresis"),
    (True, _PURPLE, "with hysteresis (2.36)"),
)


def pictures() -> list[Picture]:
    """Every picture of the chapter, in the order of its figures."""
    drawn = {
        "fig3_07_torque": _torque,
        "muscles": _muscles,
        "fig3_08_step": _step,
        "fig3_08_valve": _valve,
        "fig3_12_triangle": _triangle,
        "fig3_13_loop": _loop,
        "fig3_16_ramp": _ramp,
        "eq3_24_payload": _payload,
        "lift": _lift,
    }
    return drawing.pictures(say, drawn)


def _feet(axes: Axes) -> None:
    """A second scale in ft lbf beside one in N m."""
    _second_scale(axes, FOOT_POUND, "[ft lbf]")


def _second_scale(axes: Axes, unit: float, label: str) -> None:
    """A scale on the right of what the left one shows, in another unit."""

    def there(x: Any) -> Any:
        return x / unit

    def back(x: Any) -> Any:
        return x * unit

    axes.secondary_yaxis("right", functions=(there, back)).set_ylabel(label)
    axes.spines["right"].set_visible(True)


def _degrees(result: Any) -> Any:
    return np.degrees(result["joint_angle"] - elbow.rest_angle())


# ------------------------------------------------------------------------- statics


def _torque() -> Figure:
    figure, axes = drawing.figure(height=3.9)
    rotation = np.linspace(0.0, 110.0, 331)
    for law in elbow.LAWS:
        torque = elbow.elbow_torque(np.radians(rotation), law=law)
        axes.plot(rotation, torque, color=_COLOUR[law], lw=1.8, label=_NAMES[law])
    edges = [
        elbow.elbow_torque(np.radians(rotation), law="printed", muscle=elbow.mooney_rivlin(share))
        for share in (0.0, 1.0)
    ]
    words = "as printed, muscle of (3.21): C10 alone to C01 alone"
    axes.fill_between(rotation, *edges, color=_GREEN, alpha=0.3, lw=0, label=words)
    level = 200.0 * FOOT_POUND
    axes.axhline(level, **_DASHED)
    words = "published: above 200 ft lbf from 0 to 78 deg"
    axes.plot([0.0, 78.0], [level, level], lw=3.5, label=words, **_BAR)
    axes.set(xlabel=_ROTATION, ylabel="torque [N m]", xlim=(0.0, 110.0), ylim=(0.0, 660.0))
    axes.legend(loc="upper right")
    _feet(axes)
    return figure


def _muscles() -> Figure:
    figure, axes = drawing.figure(height=3.2)
    counts = range(4, 13)
    for law, shift in (("conserving", -0.14), ("printed", 0.14)):
        for count in counts:
            torque = partial(elbow.elbow_torque, law=law, count=count)
            ends = np.degrees(elbow.torque_range(torque, 200.0 * FOOT_POUND))
            axes.plot([count + shift] * 2, ends, lw=7, **_BAR | {"color": _COLOUR[law]})
        axes.plot([], [], color=_COLOUR[law], lw=7, label=_NAMES[law])
    axes.plot([6.0, 6.0], [0.0, 78.0], lw=2.5, label="published", **_BAR)
    axes.set_xticks(list(counts))
    axes.grid(visible=False, axis="x")
    axes.set(xlabel="muscles", ylabel=_ROTATION.replace(" from", "\nfrom"), ylim=(0.0, 150.0))
    axes.annotate("none", (4.14, 2.0), ha="center", color=_COLOUR["printed"], fontsize=8)
    axes.legend(loc="upper left", ncols=3)
    return figure


def _payload() -> Figure:
    figure, axes = drawing.figure(height=3.9)
    angle = np.radians(np.linspace(0.0, 120.0, 361))
    rest = elbow.rest_angle()
    above = angle[angle >= rest]
    for law in elbow.LAWS:
        label = f"muscles at 150 psi, {_NAMES[law]}"
        torque = elbow.elbow_torque(above - rest, law=law)
        axes.plot(np.degrees(above), torque, color=_COLOUR[law], lw=1.8, label=label)
    own = elbow.arm_rig().model["arm"]
    for pounds, low in ((50.0, 66), (100.0, 66), (135.0, 66), (200.0, 44), (380.0, 32)):
        load = elbow.payload_torque(pounds, angle)
        weight = own["first_moment"] * own["gravity"] * np.sin(angle)
        axes.plot(np.degrees(angle), load, color=_FAINT, lw=1.3)
        place = (low, float(np.interp(math.radians(low), angle, load)))
        axes.annotate(f"{pounds:.0f} lb", place, (0, 3), color="#4b5563", **_NOTE)
        for law in elbow.LAWS:
            reached = elbow.rotation_reached(pounds, 150.0, law=law) + rest
            held = float(np.interp(reached, angle, load + weight))
            axes.plot(math.degrees(reached), held, "o", ms=5, color=_COLOUR[law], mec="white")
    axes.plot([], [], color=_FAINT, lw=1.3, label="payload at 20 in (3.24)")
    axes.plot([], [], "o", ms=5, color=_INK, label="rest, the arm's own weight counted")
    axes.set(xlabel="angle from the vertical [deg]", ylabel="torque [N m]")
    axes.set(xlim=(0.0, 120.0), ylim=(0.0, 640.0))
    axes.legend(loc="upper right", fontsize=8)
    _feet(axes)
    return figure


def _lift() -> Figure:
    figure, axes = drawing.figure(height=3.6)
    rest = elbow.rest_angle()
    shades = {60.0: "#9ecae1", 90.0: "#6baed6", 120.0: "#3182bd", 150.0: "#08519c"}
    for psi, colour in shades.items():
        result = lift(elbow.arm_rig(coulomb=0.0), pressure=psi * PSI)
        usable = (result.capacity > 0.0) & (result.capacity < 400.0)
        pounds = result.capacity[usable] / elbow.POUND
        lifted = np.degrees(result.angle[usable] - rest)
        axes.plot(pounds, lifted, color=colour, lw=1.8, label=f"{psi:.0f} psi")
    axes.plot([100.0, 100.0], [83.0, 90.0], "o", ms=5, color=_INK, label="published")
    axes.plot([380.0, 380.0], [0.0, 75.0], **_DASHED)
    words, plain = "largest payload tested, 380 lb", _NOTE | {"fontsize": None}
    axes.annotate(words, (380.0, 60.0), (-4, 0), color=_INK, **plain)
    axes.set(xlabel="payload at the tip [lb]", ylabel="lifted up to [deg of rotation]")
    axes.set(xlim=(0.0, 420.0), ylim=(0.0, 112.0))
    axes.legend(loc="upper right", ncols=5)
    return figure


# ------------------------------------------------------------------------ dynamics


def _mark(axes: Axes, level: float, text: str, *, at: float = 1.0) -> None:
    """A published number as a dashed line."""
    axes.axhline(level, **_DASHED)
    place = ("axes fraction", "data")
    axes.annotate(text, (at, level), (-3, 3), xycoords=place, color=_INK, **_NOTE)


def _step() -> Figure:
    figure, (angle, rate, pressure) = drawing.figure(3, 1, 6.0, sharex=True)
    area = elbow.valve_for_peak(math.radians(200.0))
    slow = max(
        (item for item in step_by_area() if item.mean < math.radians(57.3)),
        key=lambda item: item.area,
    )
    for item, colour, words in (
        (elbow.step(), _FAINT, "the rig's"),
        (elbow.step(area), COLOURS["after"], "peak rate as published"),
        (slow, _GREEN, "first swing just short of 90 deg"),
    ):
        result = item.simulation
        show = result.time <= 4.0
        label = f"{1e6 * item.area:.2f} mm2, {words}"
        for axes, values in (
            (angle, _degrees(result)),
            (rate, np.degrees(result["joint_rate"])),
            (pressure, result["muscle_pressure"] / 1e5),
        ):
            shown = decimate(result.time[show], values[show])
            axes.plot(*shown, color=colour, lw=1.5, label=label)
    _mark(angle, 90.0, "90 deg", at=0.08)
    angle.plot([0.0, 1.5], [0.0, 90.0], color=_INK, lw=0.9, ls=(0, (1, 1.5)))
    angle.annotate("mean 60 deg/s", (1.17, 56.0), color=_INK, fontsize=8)
    _mark(rate, 200.0, "200 deg/s")
    _mark(pressure, 150.0 * PSI / 1e5, "150 psi", at=0.12)
    angle.set(ylabel="rotation [deg]", ylim=(0.0, 150.0))
    rate.set(ylabel="rate [deg/s]")
    pressure.set(ylabel="pressure [bar]", xlabel="time [s]", xlim=(0.0, 4.0), ylim=(0.0, 13.0))
    angle.legend(loc="upper right", ncols=3, fontsize=7.5)
    return figure


def _valve() -> Figure:
    figure, axes = drawing.figure(height=3.3)
    for law, style in (("conserving", "-"), ("printed", (0, (4, 2)))):
        steps = step_by_area(law)
        area = np.array([1e6 * item.area for item in steps])
        short = {"conserving": "conserving", "printed": "as printed"}[law]
        for name, colour in (("peak", COLOURS["after"]), ("mean", _GREEN)):
            values = np.degrees([getattr(item, name) for item in steps])
            if name == "mean":  # a jump is no line
                values[1:][np.abs(np.diff(values)) > 25.0] = math.nan
            axes.plot(area, values, color=colour, lw=1.6, ls=style, label=f"{name}, torque {short}")
    _mark(axes, 200.0, "published peak, 200 deg/s")
    _mark(axes, 60.0, "published mean, 60 deg/s")
    axes.axvline(8.4, color=_FAINT, lw=1.0)
    axes.annotate("valve of the rig", (8.4, 8.0), (-4, 0), color="#4b5563", **_NOTE)
    axes.set(xlabel="effective area of the open valve [mm2]", ylabel="rate [deg/s]")
    axes.set(xlim=(1.0, 12.0), ylim=(0.0, 400.0))
    axes.legend(loc="upper left", ncols=2)
    return figure


def _triangle() -> Figure:
    figure, (pressure, angle) = drawing.figure(2, 1, 4.4, sharex=True)
    for hysteresis, colour, words in _HYSTERESIS:
        result = elbow.triangle(hysteresis=hysteresis)
        angle.plot(*decimate(result.time, _degrees(result)), color=colour, lw=1.5, label=words)
        if not hysteresis:
            pressure.plot(result.time, result["muscle_pressure"] / 1e5, color=_INK, lw=1.5)
    mirrored = elbow.triangle(hysteresis=True)
    style = {"color": _PURPLE, "lw": 0.8, "ls": (0, (2, 2)), "label": "the same, mirrored"}
    angle.plot(mirrored.time, _degrees(mirrored)[::-1], **style)
    pressure.set(ylabel="pressure [bar]", ylim=(0.0, 11.5))
    _second_scale(pressure, PSI / 1e5, "[psi]")
    angle.set(ylabel="rotation [deg]", xlabel="time [s]", xlim=(0.0, 20.0), ylim=(0.0, 95.0))
    angle.legend(loc="upper left")
    return figure


def _loop() -> Figure:
    figure, axes = drawing.figure(height=3.6)
    for hysteresis, colour, words in _HYSTERESIS:
        result = elbow.triangle(hysteresis=hysteresis)
        psi = result["muscle_pressure"] / PSI
        torque = elbow.payload_torque(135.0, result["joint_angle"])
        axes.plot(psi, torque, color=colour, lw=1.5, label=words)
        if hysteresis:
            for row in (600, 1400):
                start, end = ((psi[k], torque[k]) for k in (row, row + 40))
                arrow = {"arrowstyle": "-|>", "color": colour, "lw": 1.5, "mutation_scale": 14}
                axes.annotate("", end, start, arrowprops=arrow)
    static = elbow.static_curve(135.0)
    load = elbow.payload_torque(135.0, elbow.rest_angle() + static.rotation)
    axes.plot(static.psi, load, label="at rest", **_DASHED | {"lw": 1.0})
    axes.set(xlabel="pressure [psi]", ylabel="torque of the payload (3.24) [N m]")
    axes.set(xlim=(0.0, 152.0), ylim=(0.0, 340.0))
    axes.legend(loc="upper left")
    _feet(axes)
    return figure


def _ramp() -> Figure:
    figure, (pressure, torque, angle) = drawing.figure(3, 1, 6.0, sharex=True)
    for law in elbow.LAWS:
        result = elbow.ramp_and_hold(law=law)
        for axes, values in ((torque, result["joint_torque"]), (angle, _degrees(result))):
            axes.plot(*decimate(result.time, values), color=_COLOUR[law], lw=1.5, label=_NAMES[law])
    pressure.plot(result.time, result["muscle_pressure"] / 1e5, color=_INK, lw=1.5)
    rough = elbow.ramp_and_hold(law="printed", hysteresis=True)
    words = "as printed, with hysteresis (2.36)"
    for axes, values in ((torque, rough["joint_torque"]), (angle, _degrees(rough))):
        axes.plot(*decimate(rough.time, values), color=_PURPLE, lw=1.0, label=words)
    _mark(torque, 190.0 * FOOT_POUND, "190 ft lbf", at=0.12)
    _mark(angle, 83.0, "83 deg", at=0.08)
    _mark(pressure, 145.0 * PSI / 1e5, "145 psi", at=0.12)
    pressure.set(ylabel="pressure [bar]", ylim=(0.0, 12.0))
    torque.set(ylabel="torque [N m]", ylim=(0.0, 390.0))
    angle.set(ylabel="rotation [deg]", xlabel="time [s]", xlim=(0.0, 10.0), ylim=(0.0, 105.0))
    torque.legend(loc="upper left", ncols=3, fontsize=7.5)
    _feet(torque)
    return figure
