"""Pictures of a simulation: its channels over time, and the arm or the mass as it moves."""

from __future__ import annotations

import math
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamrs._arrays import Array
from pamrs._checks import refused
from pamrs._views import decimate
from pamrs._writing import write_atomically
from pamrs.channels import channel_of, dotted, laboratory_unit, recorded_as
from pamrs.errors import ParameterError
from pamrs.report.figures import COLOURS, STYLE, png_bytes

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pamrs.simulation import Simulation


#: Panels from top to bottom: title and channels, which have one unit; those of which nothing was
#: simulated are left out.
_PANELS: Final = (
    ("valve command", ("valve_command",)),
    (
        "pressure, gauge",
        ("supply_command", "supply_pressure", "line_pressure", "muscle_pressure"),
    ),
    ("joint angle", ("joint_angle",)),
    ("joint torque of the muscles", ("joint_torque",)),
    ("length of the muscle", ("length",)),
    ("muscle force", ("muscle_force",)),
    ("gas temperature", ("temperature",)),
)
_NAMES: Final = {
    "supply_command": "set",
    "supply_pressure": "supply",
    "line_pressure": "line",
    "muscle_pressure": "muscle",
}
_FRAMES: Final = 150
_SLOWEST: Final = 1e-3
_FAINT: Final = "#9ca3af"
#: Colours of the blocks of one channel; the first is the one of a rig without names.
_OWN: Final = (COLOURS["after"], "#0f766e", "#b45309", "#7c3aed", "#be123c", "#4d7c0f")


def write_channels(
    result: Simulation,
    path: str | os.PathLike[str],
    *,
    recorded: Mapping[str, tuple[Array, Array]] | None = None,
    nominal: Simulation | None = None,
) -> Path:
    """Write a picture of the channels of a simulation over time, a PNG.

    Parameters
    ----------
    result : Simulation
        What :func:`pamrs.simulate` returns.
    path : path-like
        The file.
    recorded : mapping of str to (time, value), optional
        Recorded channels to draw with them [s, SI].
    nominal : Simulation, optional
        The same run of the rig file, where ``result`` is that of a model that was made of it.

    Returns
    -------
    Path
        The file written.
    """
    given = recorded or {}
    there = [(title, _of(result, heads)) for title, heads in _PANELS]
    there = [panel for panel in there if panel[1]]
    moving = [
        panel
        for panel in there
        if any(
            float(np.ptp(result[name])) > 1e-9 * max(float(np.abs(result[name]).max()), 1e-12)
            or _recorded(name, given)
            for name in panel[1]
        )
    ] or there
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10.0, 1.0 + 1.75 * len(moving)), dpi=110, layout="constrained")
        rows = figure.subplots(len(moving), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (title, names) in zip(rows, moving, strict=True):
            for name in names:
                _draw_channel(axes, name, names, result, given, nominal)
            axes.set_title(title)
            axes.set_ylabel(laboratory_unit(names[0])[0])
            if len(axes.lines) > 1:
                place: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0)}
                axes.legend(
                    ncols=6, borderaxespad=0.1, handlelength=1.8, columnspacing=1.3, **place
                )
        rows[-1].set_xlabel("time [s]")
        return write_atomically(path, png_bytes(figure))


def _draw_channel(
    axes: Axes,
    name: str,
    names: list[str],
    result: Simulation,
    given: Mapping[str, tuple[Array, Array]],
    nominal: Simulation | None,
) -> None:
    """One channel of a panel: recorded, of the rig file, simulated. A colour is a block; how a line
    is drawn says what it is, and the legend says so once.
    """
    head, heads = channel_of(name), {channel_of(other) for other in names}
    label = _label(name, len(heads) > 1)
    nth = [n for n in names if channel_of(n) == head].index(name)
    factor = laboratory_unit(name)[1]
    faint = head == "supply_pressure" and nth == 0 and len(heads) > 1
    colour = _FAINT if faint else _OWN[nth % len(_OWN)]
    drawn = {line.get_label() for line in axes.lines}
    other = _recorded(name, given)
    if other:
        time, value = given[other]
        axes.plot(
            time,
            factor * value,
            color=COLOURS["measured"],
            lw=2.6,  # seen with a thin line that follows it
            alpha=0.6,
            label="_" if "recorded" in drawn else "recorded",
        )
    model = (
        nominal
        if nominal is not None
        and name in nominal
        and head not in ("valve_command", "supply_command")
        else None
    )
    if model is not None:
        time, value = decimate(model.time, factor * model[name])
        axes.plot(
            time,
            value,
            "--",
            color=colour if len(names) > 1 else COLOURS["before"],
            lw=1.1,
            label="_" if "rig file" in drawn else "rig file",
        )
    time, value = decimate(result.time, factor * result[name])
    axes.plot(
        time,
        value,
        {"supply_command": "--", "line_pressure": ":"}.get(head, "-"),
        color=colour,
        lw=1.3,
        label=f"{label} {'simulated' if model is None else 'model'}".strip(),
    )


def _of(result: Simulation, heads: tuple[str, ...]) -> list[str]:
    """The simulated channels of a panel."""
    return [name for head in heads for name in result if channel_of(name) == head]


def _recorded(name: str, given: Mapping[str, Any]) -> str:
    """Name of the recorded channel that belongs to a simulated one; empty where there is none."""
    other = recorded_as(name)
    return other if other in given else ""


def _label(name: str, several: bool) -> str:
    head, _, block = name.partition(".")
    return " ".join(part for part in (_NAMES.get(head, "") if several else "", block) if part)


def write_animation(
    result: Simulation, path: str | os.PathLike[str], *, speed: float = 1.0
) -> Path:
    """Write the arm as it moves, an animated GIF of 150 pictures at most.

    Parameters
    ----------
    result : Simulation
        Of a rig with an arm or a linear load.
    path : path-like
        The file.
    speed : float
        Times faster than it happens.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    ParameterError
        If the rig has nothing that moves, there are fewer than two samples, or the speed is not a
        finite number above zero.
    """
    if not result.under("joint_angle") and "length" not in result:
        raise ParameterError(f"the rig {result.rig.name!r} has no arm and no load to draw")
    if result.time.size < 2:
        raise ParameterError(
            f"{result.time.size} sample is not enough to draw a motion: two at least"
        )
    if not (math.isfinite(speed) and speed > 0.0):
        raise refused("speed", speed, "a finite number above zero")
    if not _SLOWEST <= speed <= 1.0 / _SLOWEST:
        raise ParameterError(
            f"speed = {speed:g} is not allowed: from {_SLOWEST:g} to {1.0 / _SLOWEST:g}"
        )
    duration = float(result.time[-1] - result.time[0]) / speed
    # hundredths of a second: what a GIF knows, and players keep
    delay = max(2, math.ceil(100.0 * duration / _FRAMES))
    shown = np.arange(0.0, 100.0 * duration + 1e-9, delay) * 0.01 * speed + result.time[0]
    frames = np.clip(np.searchsorted(result.time, shown - 1e-9), 0, result.time.size - 1)
    with mpl.rc_context(STYLE), tempfile.TemporaryDirectory() as folder:
        figure = Figure(figsize=(5.2, 5.2), dpi=80)
        axes = figure.subplots()
        scene = _Scene(axes, result, float(figure.get_size_inches()[0]))
        motion = FuncAnimation(figure, scene.draw, frames=frames.tolist(), blit=False)
        picture = Path(folder) / "motion.gif"
        # a hair slow: the writer cuts the delay to whole milliseconds
        rate: Any = 100.0 / delay * (1.0 - 1e-9)
        motion.save(picture, writer=PillowWriter(fps=rate))
        return write_atomically(path, picture.read_bytes())


class _Muscles:
    """The muscles of one group: a line as wide as they are, coloured by pressure."""

    def __init__(
        self, axes: Axes, result: Simulation, name: str, scale: float, span: tuple[float, float]
    ) -> None:
        muscle = result.rig.muscle_of(name)
        self.result, self.name, self.scale, self.span = result, name, scale, span
        self.rest = float(muscle.parameters["rest_length"])
        self.contraction = result[dotted("contraction_ratio", name)]
        self.widths = 2.0 * muscle.radius(np.clip(self.contraction, *muscle.contraction_limits))
        chamber = result.rig.ports("muscle")[name]["chamber"].partition(".")[2]
        self.pressure = result[dotted("muscle_pressure", chamber)]
        self.line: Any = axes.plot([], [], solid_capstyle="round", alpha=0.85)[0]

    def draw(self, row: int, base: Array, along: Array, side: float) -> Array:
        """Draw the muscles from beyond a joint to it, on one side of the link; return their end."""
        offset = side * 1.2 * float(self.widths.max()) * np.array([along[1], -along[0]])
        far = base + 1.1 * self.rest * along + offset
        near = far - self.rest * (1.0 - float(self.contraction[row])) * along
        self.line.set_data([far[0], near[0]], [far[1], near[1]])
        self.line.set_linewidth(self.scale * float(self.widths[row]))
        low, high = self.span
        self.line.set_color(
            mpl.colormaps["viridis"](0.15 + 0.75 * (float(self.pressure[row]) - low) / (high - low))
        )
        return near


class _Scene:
    """The fixed link, the links that hang from it (angles from straight down, then from link to
    link) and the muscles along the link before each joint; or the mass that hangs from a muscle.
    """

    def __init__(self, axes: Axes, result: Simulation, width: float) -> None:
        self.result = result
        rig = result.rig
        self.angles = list(result.under("joint_angle").values())
        own = rig.tables("link")
        links = {name: own[name] for name in rig.ports("link")} or {
            name: table for name, table in rig.tables("arm").items() if self.angles
        }
        self.lengths = [float(link["length"]) for link in links.values()]
        groups = list(rig.tables("muscle"))
        rests = [float(rig.muscle_of(name).parameters["rest_length"]) for name in groups]
        top = 1.15 * max(rests)
        reach = 1.1 * (max(sum(self.lengths), top) if self.angles else top)
        axes.set_xlim(-reach, reach)
        axes.set_ylim(-reach, reach)
        axes.set_aspect("equal")
        axes.grid(visible=False)
        axes.set_xlabel("m")
        axes.set_ylabel("m")
        scale = 72.0 * width * axes.get_position().width / (2.0 * reach)  # points a metre
        pressures = np.concatenate(list(result.under("muscle_pressure").values()))
        low = min(float(pressures.min()), 0.0)
        span = low, max(float(pressures.max()), low + 1.0)
        joints = list(result.under("joint_angle"))
        self.groups = [_Muscles(axes, result, name, scale, span) for name in groups]
        moved = (result.rig.ports("muscle")[name]["joint"] for name in groups)
        self.at = [0 if one == "load" else joints.index(one.partition(".")[2]) for one in moved]
        fixed = (
            ([0.0, 0.0], [0.0, top])
            if self.angles
            else ([-0.4 * reach, 0.4 * reach], [1.1 * max(rests)] * 2)
        )
        axes.plot(*fixed, color=COLOURS["measured"], lw=5.0, solid_capstyle="round")
        self.arm: Any = axes.plot(
            [], [], "-o", color=COLOURS["after"], lw=4.0, ms=4.0, solid_capstyle="round"
        )[0]
        payload = sum(float(table.get("payload", 0.0)) for table in links.values())
        payload += sum(float(load.get("mass", 0.0)) for load in rig.tables("load").values())
        self.payload: Any = axes.plot(
            [], [], "o", color=COLOURS["before"], ms=7.0 + min(payload, 60.0) / 6.0
        )[0]
        self.text: Any = axes.set_title("")
        self.base = np.array([0.0, 0.0])
        self.tilt = sum(float(arm.get("base_angle", 0.0)) for arm in rig.tables("arm").values())
        self.top = top

    def draw(self, row: int) -> tuple[Any, ...]:
        """Put one sample into the picture."""
        points, along = [self.base], [np.array([0.0, 1.0])]
        direction = self.tilt
        for angle, length in zip(self.angles, self.lengths, strict=True):
            direction += float(angle[row])
            down = np.array([math.sin(direction), -math.cos(direction)])
            points.append(points[-1] + length * down)
            along.append(-down)
        count = [0] * max(len(points), 1)
        near = self.base
        for group, joint in zip(self.groups, self.at, strict=True):
            side = -1.0 - count[joint] // 2 if count[joint] % 2 == 0 else 1.0 + count[joint] // 2
            side = side if self.angles else float(count[joint])
            count[joint] += 1
            near = group.draw(row, points[joint], along[joint], side)
        if self.angles:
            self.arm.set_data([p[0] for p in points], [p[1] for p in points])
            tip = points[-1]
            said = (
                " / ".join(f"{math.degrees(float(angle[row])):.0f}" for angle in self.angles)
                + " deg"
            )
        else:
            tip = near - np.array([0.0, 0.05 * self.top])
            said = f"{1e3 * float(self.result['length'][row]):.0f} mm"
        self.payload.set_data([tip[0]], [tip[1]])
        bars = " / ".join(
            f"{float(p[row]) / 1e5:.1f}" for p in self.result.under("muscle_pressure").values()
        )
        self.text.set_text(f"{self.result.time[row]:.2f} s    {said}    {bars} bar")
        return self.arm, self.payload, self.text, *(group.line for group in self.groups)
