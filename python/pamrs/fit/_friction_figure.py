"""Picture of fitted friction: the measured loops, and the coefficient over pressure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes

from pamrs.fit._figures import pressure_colours, thinned
from pamrs.report.figures import COLOURS, summary_figure

if TYPE_CHECKING:
    from pamrs.fit._data import ForceMap
    from pamrs.fit._friction import FrictionFit

_INK: Final = "#374151"
_MARKS: Final = ((-1, "v", "contracting"), (1, "^", "lengthening"))


def friction_png(fit: FrictionFit, data: ForceMap) -> bytes:
    """What :func:`pamrs.fit.report.render_friction_png` returns."""
    c0, c1 = (item.value for item in fit.params.values())
    sign = "−" if c1 < 0 else "+"
    law = f"$c_F$ = max({c0:.3g} {sign} {abs(1e6 * c1):.3g} P/MPa, {fit.floor:g})"
    with summary_figure(f"{data.label}: {law}", 200, 13.0, 5.0) as (figure, finished):
        loops, line = figure.subplots(1, 2, width_ratios=[1.35, 1.0])
        _draw_loops(loops, fit, data)
        draw_law(line, fit)
        return finished()


def _draw_loops(axes: Axes, fit: FrictionFit, data: ForceMap) -> None:
    """Measured branches by pressure, and the mean curve of each loop."""
    cmap, norm = pressure_colours(data.levels)
    across = data.pressure / 1e3 if fit.isometric else 100.0 * data.contraction
    for index, pressure in enumerate(data.levels.tolist()):
        colour = cmap(norm(pressure / 1e3))
        for way, mark, _ in _MARKS:
            rows = thinned(np.flatnonzero((data.level == index) & (data.direction == way)))
            style: dict[str, Any] = {"s": 7.0, "marker": mark, "color": colour, "alpha": 0.45}
            axes.scatter(across[rows], data.force[rows], lw=0, **style)
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
    bar: dict[str, Any] = {"location": "bottom", "pad": 0.02, "aspect": 40}
    scale = mpl.cm.ScalarMappable(norm, cmap)
    axes.figure.colorbar(scale, ax=axes, label="pressure [kPa]", **bar)
    axes.set_xlabel("pressure [kPa]" if fit.isometric else "contraction [%]")
    axes.set_ylabel("pulling force [N]")
    axes.set_title("Loops: measured, and their mean")
    axes.legend(loc="upper right")


def draw_law(axes: Axes, fit: FrictionFit) -> None:
    """Coefficient of each level with two standard errors, and the law."""
    pressure, value, error = (
        np.array([getattr(x, key) for x in fit.levels])
        for key in ("pressure", "coefficient", "stderr")
    )
    grid = np.linspace(0.0, 1.08 * float(pressure.max()), 200)
    axes.plot(grid / 1e3, fit.predict(grid), color=COLOURS["after"], lw=1.6, label="law")
    style: dict[str, Any] = {"fmt": "o", "ms": 5, "color": COLOURS["before"], "lw": 0.9}
    axes.errorbar(pressure / 1e3, value, 2.0 * error, label="each level, ± 2 s.e.", **style)
    axes.axhline(fit.floor, color=_INK, lw=0.8, ls=(0, (1, 2)), label="floor")
    axes.set_xlim(0.0, grid[-1] / 1e3)
    axes.set_ylim(bottom=min(0.0, 1.1 * float(np.min(value - 2.0 * error))))
    axes.set_xlabel("pressure [kPa]")
    axes.set_ylabel("friction coefficient $c_F$ [1]")
    axes.set_title("Friction over pressure")
    axes.legend(loc="best")
