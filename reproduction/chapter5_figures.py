"""The pictures of chapter 5: our curves in the form of its figures (which are not digitised)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamrs._views import decimate
from reproduction import drawing, tracking
from reproduction.chapter5_comparison import orders
from reproduction.chapter5_statements import say
from reproduction.page import Picture
from reproduction.tracking import KINDS, PAYLOADS, Track
from reproduction.tracking_runs import FULL, LATER, MIDDLE, STARTS, TRIALS, WRONG, Plan

_INK: Final = "#1f1f1f"
_COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8c6d1f")
_BY_KIND: Final = dict(zip(KINDS, ("#8c6d1f", "#0072b2", "#009e73", "#d55e00"), strict=True))
#: A row of a track, its words and colour.
Curve = tuple[Track, int, str, str]


def pictures(plan: Plan = FULL) -> list[Picture]:
    """Every picture of the chapter, in the order of its figures, from the experiments of a plan."""
    drawn = {
        "fig5_08_sliding": partial(_sliding, plan),
        "fig5_10_estimates": partial(_estimates, plan),
        "fig5_11_start": partial(_start, plan),
        "fig5_12_networks": partial(_networks, plan),
        "fig5_14_payloads": partial(_payloads, plan),
        "training": partial(_training, plan),
        "fig5_19_compound": partial(_compared, plan, "compound"),
        "fig5_20_lift": partial(_compared, plan, "lift"),
        "orders": partial(_orders, plan),
        "hysteresis": partial(_hysteresis, plan),
    }
    return drawing.pictures(say, drawn, 160)


def _angles(axes: Axes, curves: Sequence[Curve]) -> None:
    run = curves[0][0]
    for track, row, _, colour in curves:
        axes.plot(*decimate(track.time, np.degrees(track.angle[row])), color=colour, lw=1.2)
    wanted = decimate(run.time, np.degrees(run.wanted))
    axes.plot(*wanted, color=_INK, lw=0.9, ls=(0, (4, 2)), label="desired")
    axes.set(ylabel="angle [deg]", ylim=(0.0, 140.0))
    axes.legend(loc="upper right", fontsize=8)


def _errors(axes: Axes, curves: Sequence[Curve], limit: float) -> None:
    for track, row, words, colour in curves:
        axes.plot(*decimate(track.time, track.error[row]), color=colour, lw=1.0, label=words)
    axes.set(ylabel="error [deg]", ylim=(-limit, limit))
    axes.legend(loc="upper right", ncols=min(4, len(curves)), fontsize=8)


def _squares(axes: Axes, curves: Sequence[Curve]) -> None:
    for track, row, words, colour in curves:
        axes.plot(*decimate(track.time, track.cumulative()[row]), color=colour, lw=1.3, label=words)
    axes.set(ylabel="mean squared error\nso far [deg²]", xlabel="time [s]", yscale="log")


def _three(curves: Sequence[Curve], limit: float) -> Figure:
    """Angle, error and mean squared error so far, as the chapter draws every experiment."""
    figure, (angle, error, square) = drawing.figure(3, 1, 6.0, sharex=True)
    _angles(angle, curves)
    _errors(error, curves, limit)
    _squares(square, curves)
    square.set_xlim(0.0, float(curves[0][0].time[-1]))
    return figure


def _sliding(plan: Plan) -> Figure:
    run, words = plan.estimates(), ("exact", "times 0.1", "times 10")
    free = [(run, k, words[k], _COLOURS[k]) for k in range(len(WRONG))]
    figure, (angle, error, square) = drawing.figure(3, 1, 6.4, sharex=True)
    _angles(angle, free)
    _errors(error, free, 40.0)
    styles = ("-", (0, (4, 2)), (0, (1, 1.5)))
    for p, (payload, style) in enumerate(zip(PAYLOADS, styles, strict=True)):
        for k in range(len(WRONG)):
            shown = decimate(run.time, run.cumulative()[p * len(WRONG) + k])
            square.plot(*shown, color=_COLOURS[k], lw=1.3, ls=style)
        square.plot([], [], color=_INK, ls=style, label=f"{payload:g} lb")
    square.axhline(400.0, color=_INK, lw=0.7)
    top, place = "top of the axis of Fig. 5.8(c)", ("axes fraction", "data")
    points: dict[str, Any] = {"xycoords": place, "textcoords": "offset points", "fontsize": 8}
    square.annotate(top, (0.01, 400.0), (0, 3), **points)
    _squares(square, ())
    square.set(xlim=(0.0, float(run.time[-1])), ylim=(5.0, 4e4))
    square.legend(loc="upper right", ncols=3, fontsize=8)
    return figure


def _estimates(plan: Plan) -> Figure:
    run = plan.adaptation()
    figure, rows = drawing.figure(3, 1, 6.0, sharex=True)
    arm = tracking.arm_model([MIDDLE])
    labels = {"inertia": "I [kg m²]", "viscous": "b [N m s/rad]", "weight": "m g r [N m]"}
    for axes, (name, label) in zip(rows, labels.items(), strict=True):
        values = np.array(run.noted[name])
        for k, words in enumerate(TRIALS):
            axes.plot(run.noted_at, values[:, k], color=_COLOURS[k], lw=1.3, label=words)
        axes.axhline(float(np.asarray(getattr(arm, name))[0]), color=_INK, lw=0.9, ls=(0, (5, 2)))
        axes.set(ylabel=label)
    for axes in rows[:2]:
        axes.set_yscale("symlog", linthresh=10.0)
    rows[1].legend(loc="lower right", ncols=3, fontsize=8)
    rows[2].set(xlabel="time [s]", xlim=(0.0, float(run.noted_at[-1])))
    return figure


def _row(payload: float) -> int:
    return next(k for k, start in enumerate(STARTS) if start[1] == payload)


def _start(plan: Plan) -> Figure:
    zero, later = plan.learning(), plan.prepared()
    curves = [
        (zero, _row(50.0), "from zero", _COLOURS[0]),
        (later, 0, "from the model", _COLOURS[1]),
        (later, 1, "after 15 lb", _COLOURS[2]),
    ]
    return _three(curves, 45.0)


def _payloads(plan: Plan) -> Figure:
    zero, later = plan.learning(), plan.prepared()
    curves = [
        (zero, _row(payload), f"{payload:g} lb", _COLOURS[k]) for k, payload in enumerate(PAYLOADS)
    ]
    return _three([*curves, (later, 2, "0 lb, Gaylord", _COLOURS[3])], 45.0)


def _networks(plan: Plan) -> Figure:
    zero, later = plan.learning(), plan.prepared()
    figure, grid = drawing.figure(3, 3, 6.0, sharex=True, sharey="row")
    low, high = np.degrees(tracking.arm_model([0.0]).angle_range)
    labels = {"H": "H [kPa s²/rad]", "C": "C [kPa s/rad]", "G": "G [kPa]"}
    shown = (
        (zero, _row(50.0), "from zero"),
        (later, 0, "from the model"),
        (later, 1, f"after {LATER[1][0]}"),
    )
    for column, (track, row, words) in enumerate(shown):
        for axes, (name, label) in zip(grid[:, column], labels.items(), strict=True):
            notes = track.noted[name]
            for k, weights in enumerate(notes):
                values = 1e-3 * np.asarray(weights)[row]
                shade = mpl.colormaps["Blues"](0.25 + 0.75 * k / max(1, len(notes) - 1))
                at, when = np.linspace(low, high, values.size), f"{track.noted_at[k]:g} s"
                axes.plot(at, values, color=shade, lw=1.3, label=when)
            if column == 0:
                axes.set(ylabel=label)
        grid[0, column].set_title(words, fontsize=9)
        grid[2, column].set(xlabel="angle [deg]")
    grid[0, 0].legend(loc="upper left", fontsize=7, ncols=2)
    return figure


def _training(plan: Plan) -> Figure:
    figure, axes = drawing.figure(1, 2, 3.2, sharey=True)
    for one, kind in zip(axes, ("adaptive sliding", "neural"), strict=True):
        run = plan.trained(kind)
        assert run is not None
        edges = np.arange(0.0, float(run.time[-1]) + 1e-9, 20.0 if run.time[-1] > 100.0 else 5.0)
        values = np.array([run.rms(a, b) for a, b in zip(edges, edges[1:], strict=False)])
        for k, (payload, effect) in enumerate(plan.cases):
            if effect in ("", "muscle_hysteresis"):
                words = f"{payload:g} lb" + (", hysteresis" if effect else "")
                middle, colour = 0.5 * (edges[1:] + edges[:-1]), _COLOURS[min(k, 3)]
                one.plot(middle, values[:, k], color=colour, lw=1.2, label=words)
        one.set(title=kind, xlabel="time [s]", yscale="log")
    axes[0].set(ylabel="rms error [deg]")
    axes[1].legend(loc="upper right", fontsize=8)
    return figure


def _compared(plan: Plan, trajectory: str) -> Figure:
    row = plan.cases.index((MIDDLE, ""))
    curves = [(plan.compared(kind, trajectory), row, kind, _BY_KIND[kind]) for kind in KINDS]
    return _three(curves, 6.0 if trajectory == "compound" else 3.0)


def _orders(plan: Plan) -> Figure:
    shown = [(k, effect) for k, (payload, effect) in enumerate(plan.cases) if payload == MIDDLE]
    ratios = {effect or "nothing left out": orders(plan, k) for k, effect in shown}
    facts = list(next(iter(ratios.values())))
    figure, axes = drawing.figure(height=0.55 * len(facts) + 1.4)
    palette = mpl.colormaps["tab10"]
    for k, (words, found) in enumerate(ratios.items()):
        places = np.arange(len(facts)) + 0.09 * (k - 0.5 * (len(ratios) - 1))
        axes.plot([found[fact] for fact in facts], places, "o", ms=5, color=palette(k), label=words)
    axes.axvline(1.0, color=_INK, lw=0.9)
    axes.set_yticks(range(len(facts)), [fact.replace(": ", ":\n", 1) for fact in facts], fontsize=8)
    axes.invert_yaxis()
    axes.set(xscale="log", xlabel="ratio; the chapter has every one left of 1")
    ticks = (0.3, 0.5, 1.0, 2.0, 5.0)
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_xticks([], minor=True)
    figure.legend(loc="outside lower center", ncols=4, fontsize=8)
    return figure


def _hysteresis(plan: Plan) -> Figure:
    figure, (over_time, over_angle) = drawing.figure(1, 2, 3.2, sharey=True)
    for known, colour, words in (
        (False, _COLOURS[1], "without"),
        (True, _COLOURS[2], "with compensation"),
    ):
        run = plan.compensated(known)
        part = run.time >= tracking.SETTLED
        error = run.error[0][part]
        over_time.plot(*decimate(run.time[part], error), color=colour, lw=1.0, label=words)
        over_angle.plot(np.degrees(run.angle[0][part]), error, color=colour, lw=0.6)
    over_time.set(xlabel="time [s]", ylabel="error [deg]")
    over_angle.set(xlabel="angle [deg]")
    over_time.legend(loc="lower right", fontsize=8)
    return figure
