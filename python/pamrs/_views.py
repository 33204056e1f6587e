"""Base of results that draw themselves: `plot(ax)`, and in a notebook a picture with the main
numbers.

Each class says which panels it has and which numbers; everything else is here. matplotlib is
imported when something is drawn.
"""

from __future__ import annotations

import base64
import html
import io
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, Final, TypeAlias

from pamrs._checks import refused
from pamrs.channels import channel_of, laboratory_unit
from pamrs.errors import ParameterError, meant

#: What draws each panel, by its name, the most telling one first.
Panels: TypeAlias = "dict[str, Callable[[Any], object]]"
#: Label, times [s], values [SI], and how the line is drawn.
Curve: TypeAlias = tuple[str, Any, Any, dict[str, Any]]

#: Told apart by colour-blind readers and in grey print (after Okabe and Ito).
COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#c79a00", "#56b4e9")
_MOST_SHOWN: Final = 3  # panels in a notebook
MAX_POINTS: Final = 900  # of a curve on a page, where nobody asks for more
_MOST_POINTS: Final = 4000
#: Names of recordings are no formulas.
_NAMES: Final = {"text.parse_math": False}
#: Channels that show how a rig runs, the most telling one first; others only where these are not.
_TELLING: Final[tuple[str, ...]] = (
    *("joint_angle", "length", "muscle_pressure", "force", "valve_command", "supply_command"),
    *("supply_pressure", "line_pressure", "joint_torque", "muscle_force"),
)


class View:
    """Base of results that can be drawn: panels, and numbers with units."""

    def _panels(self) -> Panels:
        """Functions that draw the panels, by their names."""
        raise NotImplementedError

    def _numbers(self) -> dict[str, str]:
        """The main numbers with their units, by what they are."""
        raise NotImplementedError

    def plot(self, ax: Any = None, *, what: str | Sequence[str] | None = None) -> Any:
        """Draw it with matplotlib.

        Parameters
        ----------
        ax : Axes or sequence of Axes, optional
            Where: one gets the first panel, several get one each; by default a new figure has all.
        what : str or sequence of str, optional
            Names of the panels; by default all, the most telling one first.

        Returns
        -------
        Axes or ndarray of Axes
            What was drawn on.

        Raises
        ------
        ParameterError
            If there is no such panel or none at all, `ax` is a file, or there are more Axes than
            panels.
        """
        panels = self._panels()
        names = list(panels) if what is None else [what] if isinstance(what, str) else list(what)
        for name in names:
            if name not in panels:
                raise ParameterError(f"what = {name!r} is not allowed; {meant(name, panels)}")
        if isinstance(ax, (str, os.PathLike)):
            raise refused(
                "ax",
                os.fspath(ax),
                "Axes of matplotlib are needed, whose figure writes a file (savefig)",
            )
        if not names:
            raise ParameterError(f"there is nothing to draw in {self!r}")
        if ax is None:
            from matplotlib import pyplot

            size = (7.0, 0.6 + 2.2 * len(names))
            _, ax = pyplot.subplots(len(names), figsize=size, layout="constrained")
        several = ax.ravel() if hasattr(ax, "ravel") else ax if isinstance(ax, Sequence) else [ax]
        if len(several) > len(names):
            raise ParameterError(
                f"ax has {len(several)} Axes, which is not allowed: at most one for each of "
                f"{', '.join(names)}"
            )
        from matplotlib import rc_context

        with rc_context(_NAMES):
            for axes, name in zip(several, names, strict=False):
                panels[name](axes)
        return ax

    def _repr_html_(self) -> str:
        """Picture and main numbers for notebooks."""
        return f"<div>{self._picture()}{table(self._numbers())}</div>"

    def _picture(self) -> str:
        """The first panels as an image."""
        from matplotlib import rc_context
        from matplotlib.figure import Figure

        panels = list(self._panels().values())[:_MOST_SHOWN]
        if not panels:
            return ""
        size = (7.0, 0.4 + 1.9 * len(panels))
        file = io.BytesIO()
        with rc_context(_NAMES):
            figure = Figure(figsize=size, dpi=150, layout="constrained")
            every = figure.subplots(len(panels), squeeze=False)[:, 0]
            for draw, axes in zip(panels, every, strict=True):
                draw(axes)
            figure.savefig(file, format="png")
        data = base64.b64encode(file.getvalue()).decode()
        return f'<img style="width:44em;max-width:100%" src="data:image/png;base64,{data}">'


def table(numbers: Mapping[str, str]) -> str:
    """Numbers by what they are, as HTML."""
    rows = (
        f"<tr><th style='text-align:left'>{html.escape(name)}</th>"
        f"<td style='text-align:left'>{html.escape(value)}</td></tr>"
        for name, value in numbers.items()
    )
    return f"<table>{''.join(rows)}</table>"


def in_laboratory_units(channel: str, *values: float) -> str:
    """Values of a channel in the unit that people read it in: ``"15 to 42 deg"``."""
    unit, factor = laboratory_unit(channel)
    return f"{' to '.join(f'{factor * float(v):.4g}' for v in values)} {unit}".removesuffix(" 1")


def over_time(channels: Mapping[str, Iterable[Curve]]) -> Panels:
    """Panels of channels over time, those of several blocks in one.

    Parameters
    ----------
    channels : mapping of str to iterable of Curve
        By name what is drawn of each.
    """
    heads: dict[str, list[tuple[str, list[Curve]]]] = {}
    for name, series in channels.items():
        heads.setdefault(channel_of(name), []).append((name, list(series)))
    chosen: list[str] = [head for head in _TELLING if head in heads] or list(heads)
    return {head: partial(_draw_channel, head=head, of=heads[head]) for head in chosen}


def _draw_channel(axes: Any, head: str, of: list[tuple[str, list[Curve]]]) -> None:
    """A channel of every block that has it."""
    unit, factor = laboratory_unit(head)
    for name, series in of:
        for label, time, values, style in series:
            text = " ".join(part for part in (name.partition(".")[2], label) if part)
            own = {"color": COLOURS[len(axes.lines) % len(COLOURS)], "lw": 1.2} | style
            times, drawn = decimate(time, factor * values, _MOST_POINTS)
            # a legend leaves out what begins with an underscore
            said = f" {text}" if text.startswith("_") else text or "_"
            axes.plot(times, drawn, label=said, **own)
    axes.set_ylabel(f"{head.replace('_', ' ')} [{unit}]")
    axes.set_xlabel("time [s]")
    legend(axes)


def decimate(time: Any, values: Any, points: int = MAX_POINTS) -> tuple[Any, Any]:
    """Thin a curve for drawing, keeping the extremes of every stretch.

    Parameters
    ----------
    time, values : ndarray, shape (n,)
        Curve; NaN in `values` are gaps.
    points : int
        Largest number of points returned.

    Returns
    -------
    tuple of ndarray
        Times and values of at most `points` samples, in order; a stretch that is all NaN stays a
        gap.
    """
    import numpy as np

    n = len(time)
    if n <= points:
        return time, values
    edges = np.linspace(0, n, points // 2 + 1).astype(np.int64)
    chosen: list[int] = []
    for start, stop in zip(edges[:-1], edges[1:], strict=True):
        part = values[start:stop]
        if np.all(np.isnan(part)):
            chosen.append(int(start))
        else:
            chosen.extend(
                sorted({int(start + np.nanargmin(part)), int(start + np.nanargmax(part))})
            )
    index = np.asarray(chosen, dtype=np.int64)
    return time[index], values[index]


def legend(axes: Any) -> None:
    """A legend where there is something to tell apart."""
    if axes.get_legend_handles_labels()[1]:
        axes.legend(fontsize="small", frameon=False)
