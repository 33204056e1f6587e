"""Pictures of a rig: its blocks as they are joined, and the force of its muscles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from pamrs._views import COLOURS, legend
from pamrs.rig._muscle import Muscle
from pamrs.rig.schema import qualified

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from pamrs.rig._rig import Rig

_LEVELS: Final = 4  # pressures of the lines


def draw_blocks(axes: Axes, rig: Rig) -> None:
    """The ways of the air and of the force, a row each, as :attr:`pamrs.Rig.wiring` has them."""
    ways = [line.partition(": ")[::2] for line in rig.wiring]
    for row, (kind, way) in enumerate(ways):
        colour = COLOURS[0] if kind == "air" else COLOURS[1]
        for column, block in enumerate(way.split(" -> ")):
            box = {"boxstyle": "round", "fc": "white", "ec": colour}
            text = block.replace(".", "\n")
            axes.annotate(text, (column, -row), ha="center", va="center", fontsize=8, bbox=box)
            if column:
                ends = {"arrowstyle": "->", "color": colour, "shrinkA": 22, "shrinkB": 22}
                axes.annotate("", (column, -row), (column - 1, -row), arrowprops=ends)
    axes.set_xlim(-0.6, max((way.count(" -> ") for _, way in ways), default=0) + 0.6)
    axes.set_ylim(0.6 - max(len(ways), 1), 0.6)
    axes.set_title(rig.name, fontsize="medium")
    axes.set_axis_off()


def draw_forces(axes: Axes, rig: Rig) -> None:
    """Force of one muscle of each kind over its contraction, at four pressures."""
    tops = [supply["initial_pressure"] for supply in rig.tables("supply").values()]
    limit = rig.limits.get("max_pressure")
    top = limit or max(tops, default=0.0) or 4e5
    levels = [top * number / _LEVELS for number in range(1, _LEVELS + 1)]
    seen = list[Muscle]()
    for name, table in rig.tables("muscle").items():
        muscle = rig.muscle_of(name)
        if any(muscle.parameters == other.parameters for other in seen):
            continue
        style: dict[str, Any] = {"color": COLOURS[len(seen) % len(COLOURS)], "lw": 1.2}
        seen.append(muscle)
        label = f"{qualified('muscle', name)} ({table['model']})"
        contraction = np.linspace(0.0, muscle.contraction_range[1], 200)
        for pressure in levels:
            force = muscle.force_table(pressure, contraction)
            pulls = force >= 0.0
            axes.plot(100.0 * contraction[pulls], force[pulls], label=label, **style)
            label = "_"
    bars = ", ".join(f"{pressure / 1e5:.3g}" for pressure in levels)
    axes.set_title(f"one muscle at {bars} bar", fontsize="medium")
    axes.set_xlabel("contraction [%]")
    axes.set_ylabel("pulling force [N]")
    legend(axes)
