"""One picture: what it is drawn of, and how curves with and without an effect are drawn."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

import pamrs
from pamrs.report.figures import COLOURS, STYLE

__all__ = [
    "BAR",
    "QUIET",
    "WITH",
    "WITHOUT",
    "Array",
    "Experiment",
    "Sheet",
    "angle",
    "clock",
    "flow",
    "hold",
    "label",
    "picture",
    "pressure",
    "supply",
    "temperature",
    "through",
]

Array: TypeAlias = NDArray[np.float64]
#: What is drawn of a simulation.
Of: TypeAlias = Callable[[pamrs.Simulation], Array]

WITHOUT, WITH, QUIET = COLOURS["before"], COLOURS["after"], "#6b7280"
BAR = 1e5
SIZE, DPI = (11.0, 6.2), 100  # 1100 x 620 pixels
#: Entries of the palette of a picture: enough for lines in four colours and their rims.
PALETTE = 48


# ------------------------------------------------------------------ signals


def clock(duration: float, sample_time: float = 0.01) -> Array:
    """Times of the rows, shape (n,) [s]."""
    return np.asarray(np.arange(round(duration / sample_time)) * sample_time, dtype=np.float64)


def hold(time: Array, *steps: tuple[float, float]) -> Array:
    """A signal of steps (from when [s], value), shape of `time`."""
    starts, values = np.array(steps).T
    return np.asarray(values[np.searchsorted(starts, time + 1e-9, side="right") - 1])


def through(time: Array, *points: tuple[float, float]) -> Array:
    """A signal of straight lines through points (when [s], value), shape of `time`."""
    return np.asarray(np.interp(time, *np.array(points).T), dtype=np.float64)


# ------------------------------------------------------------------ channels


def time_of(run: pamrs.Simulation) -> Array:
    """Time [s]."""
    return run.time


def pressure(run: pamrs.Simulation) -> Array:
    """Recorded pressure of the muscle [bar, gauge]."""
    return run["muscle_pressure"] / BAR


def supply(run: pamrs.Simulation) -> Array:
    """Pressure of the supply [bar, gauge]."""
    return run["supply_pressure"] / BAR


def angle(run: pamrs.Simulation) -> Array:
    """Angle of the joint [deg]."""
    return np.degrees(run["joint_angle"])


def temperature(run: pamrs.Simulation) -> Array:
    """What the thermometer in the gas reads [degC]."""
    return run["temperature"] - 273.15


def flow(run: pamrs.Simulation) -> Array:
    """Air that flows into the muscle [g/s]."""
    return np.asarray(np.gradient(1e3 * run["air_mass"], run.time), dtype=np.float64)


# ------------------------------------------------------------------ pictures


@dataclass(frozen=True)
class Experiment:
    """What shows the fingerprint of an effect.

    Attributes
    ----------
    effect : str
        Its id.
    rig : str
        Packaged rig.
    words : str
        The experiment, in words.
    look : str
        What to look at: the title.
    draw : callable
        Simulates and draws onto a sheet.
    values : mapping of str to float
        SI values of parameters that are not the catalogue's usual ones.
    """

    effect: str
    rig: str
    words: str
    look: str
    draw: Callable[[Sheet], None]
    values: Mapping[str, float] = field(default_factory=dict)


class Sheet:
    """A figure, and the rig of an experiment without and with the effect.

    Attributes
    ----------
    rigs : tuple of Rig
        Without and with the effect.
    """

    def __init__(self, experiment: Experiment) -> None:
        plain = pamrs.rigs.named(experiment.rig)
        self.experiment = experiment
        self.rigs = (plain, plain.with_effect(experiment.effect, experiment.values))
        self.figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
        self.figure.suptitle(
            f"{experiment.effect}: {experiment.look}",
            x=0.012,
            ha="left",
            fontsize=11.5,
            fontweight="bold",
        )

    def axes(self, mosaic: str, **options: Any) -> dict[str, Axes]:
        """Axes by the letters of a mosaic, ``"px;ax"``."""
        found: dict[str, Axes] = self.figure.subplot_mosaic(mosaic, **options)
        return found

    def run(
        self, changes: Mapping[str, float] | None = None, **drive: Any
    ) -> tuple[pamrs.Simulation, pamrs.Simulation]:
        """Simulations without and with the effect, of a rig with some parameters changed."""
        without, with_ = (
            pamrs.simulate(rig.with_parameters(changes or {}), **{"sample_time": 0.01, **drive})
            for rig in self.rigs
        )
        return without, with_

    @staticmethod
    def both(
        axes: Axes,
        runs: tuple[pamrs.Simulation, pamrs.Simulation],
        y: Of,
        x: Of = time_of,
        **style: Any,
    ) -> None:
        """The curve without the effect and the one with it on top."""
        part = style.pop("part", slice(None))
        for run, colour, words, width in zip(
            runs, (WITHOUT, WITH), ("without", "with the effect"), (2.2, 1.3), strict=True
        ):
            kept = {"label": words, "lw": width, **style}
            axes.plot(x(run)[part], y(run)[part], color=colour, **kept)


def label(axes: Axes, title: str, x: str = "time [s]", y: str = "", legend: str = "") -> None:
    """Title and labels; a legend where a place is given."""
    axes.set(title=title, xlabel=x, ylabel=y)
    if legend:
        axes.legend(
            loc=legend,
            frameon=True,
            framealpha=0.85,
            edgecolor="none",
            fontsize=8.5,
            handlelength=1.6,
        )


def picture(experiment: Experiment) -> bytes:
    """The picture of an experiment, a PNG with a palette."""
    with mpl.rc_context(STYLE):
        sheet = Sheet(experiment)
        experiment.draw(sheet)
        stream = io.BytesIO()
        sheet.figure.savefig(stream, format="png", metadata={"Software": None})
    small = io.BytesIO()
    with Image.open(stream) as image:
        flat = image.convert("RGB").quantize(
            PALETTE, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
        )
        flat.save(small, format="png", optimize=True)
    return small.getvalue()
