"""Picture of fitted friction: the measured loops, and the coefficient over pressure."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamrs.fit._figures import pressure_colours, thinned
from pamrs.report.figures import COLOURS, STYLE

if TYPE_CHECKING:
    from pamrs.fit._data import ForceMap
    from pamrs.fit._friction import FrictionFit

__all__ = ["friction_png"]

_INK: Final = "#374151"
_MARKS: Final = ((-1, "v", "contracting"), (1, "^", "lengthening"))


def friction_png(fit: FrictionFit, data: ForceMap) -> bytes:
    """What :func:`pamrs.fit.report.render_friction_png` returns."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10.0, 5.0), dpi=160, layout="constrained")
        c0, c1 = (
            fit.params["friction_coefficient"].value,
            fit.params["friction_pressure_slope"].value * 1e6,
        )
        law = f"$c_F$ = max({c0:.3g} {'−' if c1 < 0 else '+'} {abs(c1):.3g} P/MPa, {fit.floor:g})"
        figure.suptitle(
            f"{data.label}: {law}",
            x=0.012,
            ha="left",
            fontsize=13,
            fontweight="bold",
            color="#111827",
        )
        loops, line = figure.subplots(1, 2, width_ratios=[1.35, 1.0])
        _draw_loops(loops, fit, data)
        _draw_law(line, fit)
        stream = io.BytesIO()
        figure.savefig(stream, format="png", dpi=160)
        return stream.getvalue()


def _draw_loops(axes: Axes, fit: FrictionFit, data: ForceMap) -> None:
    """Measured branches by pressure, and the mean curve of each loop."""
    cmap, norm = pressure_colours(data.levels)
    across = data.pressure / 1e3 if fit.isometric else 100.0 * data.contraction
    for index, pressure in enumerate(data.levels.tolist()):
        colour = cmap(norm(pressure / 1e3))
        for way, mark, _ in _MARKS:
            rows = thinned(np.flatnonzero((data.level == index) & (data.direction == way)))
            axes.scatter(
                across[rows],
                data.force[rows],
                s=7.0,
                marker=mark,
                color=colour,
                alpha=0.45,
                lw=0,
            )
    for level in fit.levels:
        axes.plot(
            level.pressures / 1e3 if fit.isometric else 100.0 * level.contraction,
            level.force,
            color=cmap(norm(level.pressure / 1e3)),
            **({"ls": "", "marker": "_", "ms": 5.0} if fit.isometric else {"lw": 1.3}),
        )
    for _, mark, word in _MARKS:
        axes.scatter([], [], s=16.0, marker=mark, color=_INK, lw=0, label=word)
    axes.plot([], [], color=_INK, lw=1.3, label="mean of both")
    axes.figure.colorbar(
        mpl.cm.ScalarMappable(norm, cmap),
        ax=axes,
        label="pressure [kPa]",
        location="bottom",
        pad=0.02,
        aspect=40,
    )
    axes.set_xlabel("pressure [kPa]" if fit.isometric else "contraction [%]")
    axes.set_ylabel("pulling force [N]")
    axes.set_title("Loops: measured, and their mean")
    axes.legend(loc="upper right")


def _draw_law(axes: Axes, fit: FrictionFit) -> None:
    """Coefficient of each level with two standard errors, and the law."""
    pressure, value, error = (
        np.array([getattr(x, key) for x in fit.levels])
        for key in ("pressure", "coefficient", "stderr")
    )
    grid = np.linspace(0.0, 1.08 * float(pressure.max()), 200)
    axes.plot(grid / 1e3, fit.predict(grid), color=COLOURS["after"], lw=1.6, label="law")
    axes.errorbar(
        pressure / 1e3,
        value,
        2.0 * error,
        fmt="o",
        ms=5,
        color=COLOURS["before"],
        lw=0.9,
        label="each level, ± 2 s.e.",
    )
    axes.axhline(fit.floor, color=_INK, lw=0.8, ls=(0, (1, 2)), label="floor")
    axes.set_xlim(0.0, grid[-1] / 1e3)
    axes.set_ylim(bottom=min(0.0, 1.1 * float(np.min(value - 2.0 * error))))
    axes.set_xlabel("pressure [kPa]")
    axes.set_ylabel("friction coefficient $c_F$ [1]")
    axes.set_title("Friction over pressure")
    axes.legend(loc="best")
