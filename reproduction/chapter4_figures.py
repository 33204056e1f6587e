"""The pictures of chapter 4: our curves beside its reference, and its optima as marks (its figures
are not digitised).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from pamrs.report.figures import COLOURS
from reproduction import drawing, lift
from reproduction.chapter4 import PRINTED, RUBBING, SMOOTH, agreed, latest
from reproduction.chapter4_statements import SERIES, say, statements
from reproduction.lift import Lifts
from reproduction.page import Picture

_PAYLOAD: Final = ("#56b4e9", "#0072b2", "#d55e00", "#1f1f1f")
_NAMES: Final = ("11 kg", "23 kg", "34 kg", "45 kg")
_REFERENCE: Final[dict[str, Any]] = {"color": "#9ca3af", "lw": 2.4, "zorder": 0}
_ABOVE: Final[dict[str, Any]] = {
    "loc": "outside upper center", "fontsize": 7.5, "frameon": False,
}  # fmt: skip
_SHORT: Final = {
    PRINTED: "as printed, (4.4)-(4.7)",
    RUBBING: "hysteresis (2.36)",
    SMOOTH: "smooth muscle",
}


_MODEL: Final = ("FF+fuzzy", "FF+PID")
_FEEDBACK: Final = ("PID", "fuzzy")


def pictures() -> list[Picture]:
    """Every picture of the chapter, in the order of its figures, from the experiments that were run
    last.
    """
    drawn: dict[str, Callable[[], Figure]] = {
        "printed_model": partial(_lifts, PRINTED, _MODEL),
        "printed_feedback": partial(_lifts, PRINTED, _FEEDBACK),
        "series": _series,
        "rubbing_model": partial(_lifts, RUBBING, _MODEL),
        "rubbing_feedback": partial(_lifts, RUBBING, _FEEDBACK),
        "printed_maps": partial(_maps, PRINTED),
        "optima": _optima,
        "rubbing_maps": partial(_maps, RUBBING),
        "effects": _effects,
    }
    return drawing.pictures(say, drawn)


def _reference(axes: Axes, run: Lifts) -> None:
    axes.plot(run.time, np.degrees(run.reference), **_REFERENCE, label="reference")


def _lifts(plant: str, controllers: tuple[str, str]) -> Figure:
    """Angle and pressure of two controllers, every payload."""
    figure, axes = drawing.figure(2, 2, 5.2, sharex=True, sharey="row", squeeze=False)
    runs = latest().tuned[plant]
    for column, name in enumerate(controllers):
        upper, lower = axes[0][column], axes[1][column]
        _reference(upper, runs[name])
        payloads = _PAYLOAD if lift.GAINS[name][0] else _PAYLOAD[:3]
        for k, colour in enumerate(payloads):
            run, thin = runs[name], {"color": colour, "lw": 1.0}
            upper.plot(run.time, np.degrees(run.angle[k]), label=_NAMES[k], **thin)
            lower.plot(run.time, run.pressure[k] / 1e3, **thin)
        gains = lift.GAINS[name]
        letters = ("kM", "kP", "kI") if len(gains) == 3 else ("kM", "g1", "g2", "h")
        told = ", ".join(f"{a} {b:g}" for a, b in zip(letters, gains, strict=True))
        upper.set_title(f"{name}: {told if gains[0] else 'gains of the smallest J by payload'}")
        lower.set_xlabel("time [s]")
    axes[0][0].set_ylabel("angle [deg]")
    axes[1][0].set_ylabel("pressure [kPa]")
    figure.legend(*axes[0][1].get_legend_handles_labels(), ncols=5, **_ABOVE)
    axes[0][0].set_ylim(0.0, 135.0)
    return figure


def _series() -> Figure:
    """The series of kM, three plants."""
    figure, axes = drawing.figure(1, 3, 3.4, sharey=True, squeeze=False)
    for cell, plant in zip(axes[0], (PRINTED, RUBBING, SMOOTH), strict=True):
        runs = latest().lifts[plant]
        _reference(cell, runs["series, kM 0"])
        for (km, name), colour in zip(SERIES.items(), _PAYLOAD, strict=True):
            run = runs[name]
            rms = float(np.degrees(np.asarray(run.metrics.rms)[1]))
            words = f"kM {km:g}: {rms:.1f} deg RMS"
            cell.plot(run.time, np.degrees(run.angle[1]), color=colour, lw=1.0, label=words)
        cell.set(title=_SHORT[plant], xlabel="time [s]")
        cell.set_ylim(0.0, 185.0)
        cell.set_yticks(range(0, 121, 20))
        cell.legend(fontsize=7.0, frameon=False, loc="upper right")
    axes[0][0].set_ylabel("angle [deg]")
    return figure


def _maps(plant: str) -> Figure:
    """nu, omega and J over their least with 23 kg, of fuzzy and PID; J in degrees too."""
    figure, axes = drawing.figure(2, 4, 5.0, squeeze=False)
    done = latest()
    for line, (kind, published) in enumerate((("fuzzy", (0.45, 0.65)), ("pid", (1.4, 2.5)))):
        gains = done.maps[plant, kind]
        (first, x), (second, y) = gains.axes.items()
        shown = (
            ("nu", gains.nu),
            ("omega, rad", gains.omega["rad"]),
            ("J, rad", gains.j["rad"]),
            ("J, deg", gains.j["deg"]),
        )
        for cell, (name, values) in zip(axes[line], shown, strict=True):
            share = np.minimum(values[1] / np.nanmin(values[1]), 10.0)
            levels, norm = np.geomspace(1.0, 10.0, 13), LogNorm(1.0, 10.0)
            field = cell.contourf(x, y, share.T, levels=levels, cmap="viridis_r", norm=norm)
            best = gains.best(values)[1]
            cell.plot(*best, "o", color="white", mec="#1f1f1f", ms=6, clip_on=False)
            cell.plot(*published, "x", color="#d55e00", ms=7, mew=2)
            cell.set(title=name, xlabel=first)
        axes[line][0].set_ylabel(second)
        bar = figure.colorbar(field, ax=list(axes[line]), ticks=[1, 2, 5, 10], shrink=0.9)
        bar.ax.set_yticklabels(["1", "2", "5", "10 or more"])
        bar.ax.minorticks_off()
    return figure


def _optima() -> Figure:
    """Gains of the smallest J over the payload, two plants, both units."""
    figure, axes = drawing.figure(1, 4, 2.8, squeeze=False)
    done, kilograms = latest(), (11, 23, 34)
    printed = {
        "kP": ((11, 1.0), (23, 1.4)),
        "kI": ((11, 4.0), (23, 2.5)),
        "g1": ((23, 0.45),),
        "h": ((23, 0.65),),
    }
    gains = (("pid", 0, "kP"), ("pid", 1, "kI"), ("fuzzy", 0, "g1"), ("fuzzy", 1, "h"))
    for cell, (kind, which, label) in zip(axes[0], gains, strict=True):
        for plant, colour in ((PRINTED, COLOURS["after"]), (RUBBING, COLOURS["before"])):
            for unit, style in (("rad", "-o"), ("deg", ":s")):
                own = done.maps[plant, kind]
                best = [pair[which] for pair in own.best(own.j[unit])]
                words = f"{_SHORT[plant]}, {unit}"
                cell.plot(kilograms, best, style, color=colour, ms=4, label=words)
        marks = zip(*printed[label], strict=True)
        cell.plot(*marks, "D", color="#9ca3af", ms=7, zorder=0, label="printed")
        cell.set(title=label, xlabel="payload [kg]")
        cell.margins(y=0.15)
        cell.set_ylim(bottom=0.0)
    figure.legend(*axes[0][0].get_legend_handles_labels(), ncols=3, **_ABOVE)
    return figure


def _effects() -> Figure:
    """Statements that agree, by plant."""
    counts = {name: len(agreed(runs)) for name, runs in latest().lifts.items()}
    names = list(counts)[::-1]
    figure, axes = drawing.figure(1, 1, 0.26 * len(names) + 0.8, squeeze=False)
    cell = axes[0][0]
    colours = [COLOURS["after"] if name == PRINTED else COLOURS["quiet"] for name in names]
    cell.barh(names, [counts[name] for name in names], color=colours)
    cell.axvline(counts[PRINTED], color=COLOURS["before"], lw=1.2, zorder=0.5)
    for row, name in enumerate(names):
        cell.text(counts[name] + 0.2, row, str(counts[name]), va="center", fontsize=8, zorder=4)
    cell.set_xlim(0, len(statements("", latest().lifts[PRINTED])))
    cell.set_xlabel("statements that agree")
    cell.margins(y=0.01)
    return figure
