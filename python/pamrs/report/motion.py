"""A simulation to look at: its channels over time, and the arm as it moves."""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING, Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pamrs.errors import ParameterError
from pamrs.report.figures import COLOURS, STYLE, decimate

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from pamrs.simulation import Simulation

__all__ = ["channels_png", "write_animation"]

Array = NDArray[np.float64]

#: Panels from top to bottom: (title, unit, factor from SI, channels); those of which nothing was simulated are left out.
_PANELS: Final = (
    ("valve command", "V", 1.0, ("valve_command",)),
    ("pressure, gauge", "bar", 1e-5, ("supply_pressure", "muscle_pressure")),
    ("joint angle", "deg", 180.0 / math.pi, ("joint_angle",)),
    ("joint torque of the muscles", "N m", 1.0, ("joint_torque",)),
    ("length of the muscle", "mm", 1e3, ("length",)),
    ("pull of the muscles", "N", 1.0, ("muscle_force",)),
    ("gas temperature", "K", 1.0, ("temperature",)),
)
#: A recorded channel that is drawn beside a simulated one of another name.
_RECORDED_AS: Final = {"muscle_force": "force"}
_NAMES: Final = {"supply_pressure": "supply", "muscle_pressure": "muscle"}
_FRAMES: Final = 150
_FAINT: Final = "#9ca3af"


def channels_png(result: Simulation, measured: Mapping[str, tuple[Array, Array]] | None = None) -> bytes:
    """Channels of a simulation over time, a PNG.

    Parameters
    ----------
    result : Simulation
        What :func:`pamrs.simulate` returns.
    measured : mapping of str to (time, value), optional
        Recorded channels to draw beside them [s, SI].

    Returns
    -------
    bytes
    """
    given = measured or {}
    recorded = {name: given[other] for panel in _PANELS for name in panel[3] if (other := _RECORDED_AS.get(name, name)) in given}
    there = [panel for panel in _PANELS if any(name in result for name in panel[3])]
    moving = [panel for panel in there if any(_tells(result, name) or name in recorded for name in panel[3])] or there
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10.0, 1.0 + 1.75 * len(moving)), dpi=110, layout="constrained")
        rows = figure.subplots(len(moving), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (title, unit, factor, names) in zip(rows, moving, strict=True):
            for name, colour in zip(names, (_FAINT, COLOURS["after"]) if len(names) > 1 else (COLOURS["after"],), strict=True):
                if name in recorded:
                    time, value = recorded[name]
                    axes.plot(time, factor * value, color=COLOURS["measured"], lw=0.9, label=f"{_NAMES.get(name, '')} recorded".strip())
                if name in result:
                    time, value = decimate(result.time, factor * result[name])
                    axes.plot(time, value, color=colour, lw=1.3, label=f"{_NAMES.get(name, '')} simulated".strip())
            axes.set_title(title)
            axes.set_ylabel(unit)
            if len(axes.lines) > 1:
                axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, fontsize="small", borderaxespad=0.1)
        rows[-1].set_xlabel("time [s]")
        stream = io.BytesIO()
        figure.savefig(stream, format="png")
    return stream.getvalue()


def _tells(result: Simulation, name: str) -> bool:
    """Whether a simulated channel moves at all."""
    return name in result and float(np.ptp(result[name])) > 1e-9 * max(float(np.abs(result[name]).max()), 1e-12)


def write_animation(result: Simulation, path: Path, *, speed: float = 1.0) -> Path:
    """The arm as it moves, an animated GIF of 150 pictures at most.

    Parameters
    ----------
    result : Simulation
        Of a rig with a one-link arm.
    path : Path
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
        If the rig has no arm, there are fewer than two samples, or the speed is not a finite number above zero.
    """
    import tempfile
    from pathlib import Path as File

    from pamrs.writing import write_atomically

    if "joint_angle" not in result:
        raise ParameterError(f"the rig {result.rig.name!r} has no arm to draw")
    if result.time.size < 2:
        raise ParameterError(f"{result.time.size} sample is not enough to draw a motion: two at least")
    if not (math.isfinite(speed) and speed > 0.0):
        raise ParameterError(f"speed = {speed} is not allowed: a finite number above zero")
    duration = float(result.time[-1] - result.time[0]) / speed
    delay = max(2, math.ceil(100.0 * duration / _FRAMES))  # hundredths of a second: what a GIF knows, and players keep
    shown = np.arange(0.0, 100.0 * duration + 1e-9, delay) * 0.01 * speed + result.time[0]
    frames = np.clip(np.searchsorted(result.time, shown - 1e-9), 0, result.time.size - 1)
    with mpl.rc_context(STYLE), tempfile.TemporaryDirectory() as folder:
        figure = Figure(figsize=(5.2, 5.2), dpi=80)
        axes = figure.subplots()
        scene = _Scene(axes, result, float(figure.get_size_inches()[0]))
        motion = FuncAnimation(figure, scene.draw, frames=frames.tolist(), blit=False)
        picture = File(folder) / "motion.gif"
        rate: Any = 100.0 / delay * (1.0 - 1e-9)  # a hair slow: the writer cuts the delay to whole milliseconds
        motion.save(picture, writer=PillowWriter(fps=rate))
        return write_atomically(path, picture.read_bytes())


class _Scene:
    """Upper link, muscles along it, and the link that they turn; the angle is from straight down."""

    def __init__(self, axes: Axes, result: Simulation, width: float) -> None:
        self.result = result
        model = result.rig.model
        self.length = float(model["arm"]["length"])
        muscle = result.rig.muscle
        assert muscle is not None
        self.rest = float(muscle.parameters["rest_length"])
        e = np.clip(result["contraction_ratio"], *muscle.contraction_limits)
        self.widths = 2.0 * muscle.radius(e)
        top = 1.15 * self.rest
        reach = 1.1 * max(self.length, top)
        axes.set_xlim(-reach, reach)
        axes.set_ylim(-reach, reach)
        axes.set_aspect("equal")
        axes.grid(visible=False)
        axes.set_xlabel("m")
        axes.set_ylabel("m")
        axes.plot([0.0, 0.0], [0.0, top], color=COLOURS["measured"], lw=5.0, solid_capstyle="round")
        self.scale = 72.0 * width * axes.get_position().width / (2.0 * reach)  # points a metre
        low = min(float(result["muscle_pressure"].min()), 0.0)
        self.colours = mpl.colormaps["viridis"]
        self.span = low, max(float(result["muscle_pressure"].max()), low + 1.0)
        self.muscle: Any = axes.plot([], [], solid_capstyle="round", alpha=0.85)[0]
        self.arm: Any = axes.plot([], [], color=COLOURS["after"], lw=4.0, solid_capstyle="round")[0]
        self.payload: Any = axes.plot([], [], "o", color=COLOURS["before"], ms=7.0 + min(float(model["arm"]["payload"]), 60.0) / 6.0)[0]
        self.text: Any = axes.set_title("")

    def draw(self, row: int) -> tuple[Any, ...]:
        """Put one sample into the picture."""
        angle = float(self.result["joint_angle"][row])
        pressure = float(self.result["muscle_pressure"][row])
        tip = self.length * math.sin(angle), -self.length * math.cos(angle)
        self.arm.set_data([0.0, tip[0]], [0.0, tip[1]])
        self.payload.set_data([tip[0]], [tip[1]])
        shortened = self.rest * (1.0 - float(self.result["contraction_ratio"][row]))
        beside = -1.2 * float(self.widths.max())
        self.muscle.set_data([beside, beside], [1.1 * self.rest - shortened, 1.1 * self.rest])
        self.muscle.set_linewidth(self.scale * float(self.widths[row]))
        low, high = self.span
        self.muscle.set_color(self.colours(0.15 + 0.75 * (pressure - low) / (high - low)))
        self.text.set_text(f"{self.result.time[row]:.2f} s    {math.degrees(angle):.0f} deg    {pressure / 1e5:.1f} bar")
        return self.arm, self.payload, self.muscle, self.text
