"""The pictures of chapter 6: our curves beside the ranges that it prints (its figures are not
digitised).
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamrs.design.sizing import free_contraction
from pamrs.library import entry
from pamrs.report.figures import COLOURS
from reproduction import drawing
from reproduction import recruiting as rec
from reproduction.chapter6 import BAR, latest, say
from reproduction.page import Picture
from reproduction.recruiting import EXTENDED, MATRIX, MUSCLES, PAYLOADS, Cycles

_COLOUR: Final = dict(zip(MUSCLES, ("#d55e00", "#0072b2", "#1f1f1f"), strict=True))
_BAND: Final[dict[str, Any]] = {"color": "#c4c8ce", "alpha": 0.5, "zorder": 0, "lw": 0.0}


def pictures() -> list[Picture]:
    """Every picture of the chapter, in the order of its figures, from the experiments that were run
    last.
    """
    drawn = {
        "ch6_pair": _pair,
        "ch6_efficiency": _efficiency,
        "ch6_best": _best,
        "ch6_rubber": _rubber,
        "ch6_readings": _readings,
        "ch6_time": _time,
        "ch6_loops": _loops,
        "ch6_energy": _energy,
        "ch6_suspects": _suspects,
    }
    return drawing.pictures(say, drawn)


def _pair() -> Figure:
    figure, cells = drawing.axes(1, 2, 3.2)
    shown = (("pam_a_1in", "A, latex"), ("pam_b_075in", "B, silicone"))
    for cell, (name, title) in zip(cells, shown, strict=True):
        muscle = entry(name).muscle
        for pressure, colour in ((2.0, COLOURS["before"]), (4.0, COLOURS["after"])):
            for count, style in ((1, "-"), (2, "--")):
                own = 2.0 * pressure / count * BAR
                e = np.linspace(0.0, free_contraction(muscle, own), 200)
                force, label = count * muscle.force(own, e) / 1e3, f"{count} at {own / BAR:g} bar"
                cell.plot(100.0 * e, force, style, color=colour, label=label)
        cell.set(title=title, xlabel="contraction [%]")
        cell.set_ylim(bottom=0.0)
    cells[0].set_ylabel("force [kN]")
    cells[0].legend(fontsize=7.5, frameon=False)
    return figure


def _lines(cell: Axes, found: Cycles, values: Any, style: str = "-", label: str = "") -> None:
    """Values (n,) over payload, a line for each number of muscles; open where not tested."""
    allowed = MATRIX[found.high]
    for n in MUSCLES:
        rows = [found.row(p, n) for p in PAYLOADS]
        words = f"{n} muscles{label}"
        cell.plot(PAYLOADS, values[rows], style, color=_COLOUR[n], lw=1.2, label=words)
        for p, row in zip(PAYLOADS, rows, strict=True):
            face = _COLOUR[n] if (p, n) in allowed else "white"
            cell.plot(p, values[row], "o", ms=4.5, mec=_COLOUR[n], mfc=face)
    cell.set_xlabel("payload [kg]")
    cell.set_xticks(PAYLOADS)


def _efficiency() -> Figure:
    figure, cells = drawing.axes(1, 2, 3.2, sharey=True)
    done = latest()
    for cell, found in zip(cells, (done.flat, done.steep), strict=True):
        _lines(cell, found, 100.0 * found.efficiency)
        cell.set_title(f"up to {found.high:.0f} deg")
    cells[0].set_ylabel("efficiency [%]")
    cells[0].set_ylim(bottom=0.0)
    cells[0].legend(fontsize=7.5, frameon=False)
    return figure


def _best() -> Figure:
    figure, (cell,) = drawing.axes(1, 1, 3.2)
    found = latest().steep
    loads = np.array([*PAYLOADS, *EXTENDED])
    whole = found.followed() == found.count
    for n in MUSCLES:
        rows = np.array([found.row(float(p), n) for p in loads])
        ran = whole[rows]
        values = 100.0 * found.efficiency[rows]
        cell.plot(loads[ran], values[ran], "-o", ms=4.5, color=_COLOUR[n], label=f"{n} muscles")
        some = ~ran & (found.followed()[rows] > 0)
        cell.plot(loads[some], values[some], "x", ms=6, color=_COLOUR[n])
    cell.set(xlabel="payload [kg]", ylabel="efficiency [%]")
    cell.set_ylim(0.0, 66.0)
    cell.set_xticks(loads)
    cell.legend(fontsize=7.5, frameon=False)
    return figure


def _rubber() -> Figure:
    figure, (cell,) = drawing.axes(1, 1, 3.6)
    done = latest()
    for low, high in ((10.0, 30.0), (52.0, 66.0)):
        cell.axhspan(low, high, **_BAND)
    _lines(cell, done.steep, 100.0 * done.steep.efficiency)
    _lines(cell, done.bare, 100.0 * done.bare.efficiency, "--", ", no rubber")
    cell.set_ylabel("efficiency [%]")
    cell.set_ylim(0.0, 72.0)
    cell.legend(fontsize=7.0, frameon=False, ncols=2, loc="lower right")
    return figure


def _readings() -> Figure:
    done = latest().readings
    names = list(done)[::-1]
    figure, (cell,) = drawing.axes(1, 1, 0.3 * len(names) + 1.0)
    for low, high in ((10.0, 30.0), (52.0, 66.0)):
        cell.axvspan(low, high, **_BAND)
    for place, name in enumerate(names):
        for found, colour, shift in zip(
            done[name], (COLOURS["before"], COLOURS["after"]), (0.13, -0.13), strict=True
        ):
            values = 100.0 * np.array([found.of(*case) for case in MATRIX[90.0]])
            ends = [values.min(), values.max()]
            cell.plot(ends, [place + shift] * 2, color=colour, lw=3.0, solid_capstyle="butt")
            cell.plot(values, [place + shift] * values.size, "|", ms=7, color="#1f1f1f", mew=0.8)
    cell.set_yticks(range(len(names)), names)
    cell.set_xlabel("efficiency [%]")
    cell.set_xlim(0.0, 80.0)
    return figure


def _time() -> Figure:
    figure, cells = drawing.axes(3, 1, 4.6, sharex=True)
    found = latest().steep
    row = found.row(18.0, 2)
    angle, torque = np.degrees(found.angle[row]), found.torque[row]
    rising = np.concatenate([[False], np.diff(found.angle[row]) > 5e-5])
    shown = ((cells[0], angle, "angle [deg]"), (cells[1], torque, "torque [N m]"))
    for cell, values, label in shown:
        cell.plot(found.time, values, color="#1f1f1f", lw=1.0)
        cell.plot(found.time, np.where(rising, values, np.nan), color="#d62728", lw=1.8)
        cell.set_ylabel(label)
    cells[2].plot(found.time, found.source[row] / BAR, color=COLOURS["after"], label="tank")
    cells[2].plot(found.time, found.pressure[row] / BAR, color="#1f1f1f", lw=1.0, label="muscles")
    cells[2].set_ylabel("pressure [bar]")
    cells[2].set_ylim(0.0, 20.0)
    cells[2].legend(fontsize=7.5, frameon=False, ncols=2, loc="upper right")
    cells[2].set_xlabel("time [s]")
    return figure


def _loops() -> Figure:
    figure, cells = drawing.axes(1, 2, 3.2, sharey=True)
    base = latest().readings["as it is"][0]
    changed = rec.SUSPECTS["hysteresis of the muscles (2.36)"]
    rubbing = rec.lifting([(18.0, 2)], 90.0, 2, changed=changed)
    titles = ("the rig as it is", "with hysteresis (2.36)")
    for cell, found, title in zip(cells, (base, rubbing), titles, strict=True):
        row = found.row(18.0, 2)
        now = found.time - rec.CYCLE
        for begin, colour, label in ((0.0, "#d62728", "up"), (11.0, COLOURS["after"], "down")):
            part = (now >= begin) & (now <= begin + 11.0)
            pressure, torque = found.pressure[row][part] / BAR, found.torque[row][part]
            cell.plot(pressure, torque, color=colour, lw=1.2, label=label)
        cell.set(title=title, xlabel="pressure [bar]")
    cells[0].set_ylabel("torque [N m]")
    cells[0].legend(fontsize=7.5, frameon=False)
    return figure


def _energy() -> Figure:
    figure, cells = drawing.axes(1, 2, 3.2)
    found = latest().steep
    labels = ("work [kJ]", "input energy [kJ]")
    for cell, values, label in zip(cells, (found.work, found.energy), labels, strict=True):
        _lines(cell, found, values / 1e3)
        cell.set_ylabel(label)
        cell.set_ylim(bottom=0.0)
    cells[1].legend(fontsize=7.5, frameon=False)
    return figure


def _suspects() -> Figure:
    done = latest()
    base = done.readings["as it is"][0]
    energy = base.energy[[base.row(*case) for case in MATRIX[90.0]]]
    sets = {name: found.energy / energy for name, found in done.suspects.items()}
    gauge = done.readings["gauge pressures in (6.4)"][0]
    sets["(6.4) in gauge pressures in the simulation"] = (
        energy / gauge.energy[[gauge.row(*case) for case in MATRIX[90.0]]]
    )
    names = list(sets)[::-1]
    figure, (cell,) = drawing.axes(1, 1, 0.28 * len(names) + 1.2)
    for place, name in enumerate(names):
        for (_, n), value in zip(MATRIX[90.0], sets[name], strict=True):
            at = place + 0.18 * (n - 4) / 2
            cell.plot(100.0 * (value - 1.0), at, "o", ms=4, color=_COLOUR[n])
    for n in MUSCLES:
        cell.plot([], [], "o", ms=4, color=_COLOUR[n], label=f"{n} muscles")
    cell.axvline(0.0, color="#9ca3af", lw=1.0)
    cell.set_yticks(range(len(names)), names)
    cell.set_xlabel("input energy, change [%]")
    cell.legend(fontsize=7.5, frameon=False, loc="upper right")
    return figure
