"""The pictures of chapter 2: shape and forces of the captions' muscle and of a stand-in beside the
fits (the source's figures are not digitised).
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pamrs.fit import MuscleFit
from pamrs.library import ch2_075in
from pamrs.report.figures import COLOURS
from reproduction import drawing
from reproduction.chapter2 import ends, sample, say
from reproduction.page import Picture
from reproduction.stand_in import EXTENSION, LEVELS, ORDERS, PSI, THREE, Fits, stand_in

Array = NDArray[np.float64]

_MM: Final = 1e3
_SHOWN: Final = 0  # the stand-in of the pictures
_ORDER_COLOUR: Final = ("#9ca3af", "#56b4e9", "#0072b2", "#1f1f1f")
_DOTS: Final[dict[str, Any]] = {"ls": "", "marker": ".", "ms": 2.5, "color": "#9ca3af"}


def pictures() -> list[Picture]:
    """Every picture of the chapter, in the order of its figures."""
    drawn = {
        "ch2_shape": _shape,
        "ch2_ends": _ends,
        "ch2_blocked": _blocked,
        "ch2_free": _free,
        "ch2_moduli": _moduli,
        "ch2_orders": _orders,
        "ch2_errors": _errors,
        "ch2_stress": _stress,
        "ch2_three": _three,
        "ch2_three_errors": _three_errors,
        "ch2_loops": _loops,
    }
    return drawing.pictures(say, drawn)


def _shape() -> Figure:
    figure, (left, right) = drawing.axes(1, 2, 3.3)
    muscle = ch2_075in()
    e = np.linspace(EXTENSION, 0.25, 400)
    for name, label, colour, style in (
        ("cylinder", "cylinder", COLOURS["before"], "-"),
        ("elliptic", "elliptic ends", COLOURS["after"], "-"),
        ("elliptic_published", "elliptic ends as printed", "#9ca3af", "--"),
    ):
        one = muscle.replace(geometry=name)
        left.plot(100.0 * e, _MM * one.radius(e), style, color=colour, label=label)
        right.plot(100.0 * e, _MM * one.thickness(e), style, color=colour)
    left.axhline(7.62, color="#1f1f1f", lw=0.8, ls=":", label="0.3 in")
    left.set_ylabel("radius [mm]")
    right.set_ylabel("wall [mm]")
    for cell in (left, right):
        cell.set_xlabel("contraction [%]")
    left.legend(fontsize=7.5, frameon=False)
    return figure


def _ends() -> Figure:
    figure, (left, right) = drawing.axes(1, 2, 3.0)
    muscle = ch2_075in()
    e = np.linspace(-0.0065, 0.38, 600)
    k, _, braid = ends(muscle, e)
    left.plot(100.0 * e, k, color=COLOURS["after"])
    left.axhline(1.0, color="#9ca3af", lw=0.8, ls=":")
    left.set(xlabel="contraction [%]", ylabel="axis ratio k [1]")
    rest = 0.5 * float(muscle.parameters["rest_diameter"])
    near = e < 0.2
    right.plot(_MM * muscle.radius(e[near]), _MM * braid[near], color=COLOURS["after"])
    right.axvline(_MM * rest, color="#9ca3af", lw=0.8, ls=":")
    right.set(xlabel="radius [mm]", ylabel="braid on one end [mm]")
    return figure


def _blocked() -> Figure:
    figure, cells = drawing.axes(1, 2, 3.0, sharey=True)
    pressure = np.linspace(0.0, 120.0, 25) * PSI
    own = ch2_075in().replace(friction_coefficient=0.0, friction_pressure_slope=0.0)
    measured = own.replace(model="kothera").force(pressure, 0.0)
    for cell, degrees in zip(cells, (76.5, 74.0), strict=True):
        for model, label, colour in (
            ("ferraresi", "constant thickness (2.8)", COLOURS["before"]),
            ("kothera", "non-constant thickness (2.16)", COLOURS["after"]),
        ):
            muscle = own.replace(model=model, braid_angle=np.radians(degrees))
            cell.plot(pressure / 1e6, muscle.force(pressure, 0.0) / 1e3, color=colour, label=label)
        words = "(2.16) at 76.5 deg"
        cell.plot(pressure / 1e6, measured / 1e3, color="#1f1f1f", ls=":", label=words)
        cell.set(title=f"braid of {degrees:g} deg", xlabel="pressure [MPa]")
    cells[0].set_ylabel("blocked force [kN]")
    cells[0].legend(fontsize=7.5, frameon=False)
    return figure


def _levels(cell: Axes, fit: MuscleFit, colours: dict[float, str] | str) -> None:
    """Forces of the shown stand-in, and a fit's, at all pressures."""
    own = stand_in(_SHOWN)
    for psi in LEVELS:
        pressure = psi * PSI
        e = own.contractions(pressure)
        cell.plot(100.0 * e, own.force(pressure, e) / 1e3, **_DOTS)
        fitted = fit.muscle_at(pressure)
        near = np.linspace(max(e[0], fitted.contraction_limits[0]), e[-1], 200)
        colour = colours if isinstance(colours, str) else colours[psi]
        cell.plot(100.0 * near, fitted.force(pressure, near) / 1e3, color=colour, lw=1.0)
    cell.set_xlabel("contraction [%]")


def _free() -> Figure:
    figure, cells = drawing.axes(1, 2, 3.8, sharey=True)
    found = sample()[_SHOWN]
    shown = (
        ("constant", "constant thickness, cylinder", COLOURS["before"]),
        ("elliptic", "non-constant thickness, elliptic ends", COLOURS["after"]),
    )
    for cell, (name, title, colour) in zip(cells, shown, strict=True):
        _levels(cell, found.free[name], colour)
        cell.set_title(title)
    cells[0].set_ylabel("force [kN]")
    cells[0].set_ylim(-0.6, 9.5)
    return figure


def _moduli() -> Figure:
    figure, cells = drawing.axes(1, 4, 2.8)
    found = sample()[_SHOWN]
    pressure = np.asarray(found.table.levels)
    free = np.array(
        [found.free["elliptic"].muscle_at(float(p)).parameters["modulus_offset"] for p in pressure]
    )
    for k, cell in enumerate(cells):
        reach = [free[2:, k] / 1e6]  # at the lowest pressures a short stroke tells little
        cell.plot(pressure / 1e6, free[:, k] / 1e6, "o", ms=3.5, color=COLOURS["before"])
        for order, colour in zip(ORDERS, _ORDER_COLOUR, strict=True):
            if order <= k:
                continue
            x = found.linear[order].x
            line = x[k] * pressure + x[order + k]
            reach.append(line[2:] / 1e6)
            cell.plot(pressure / 1e6, line / 1e6, color=colour, lw=1.2, label=f"order {order}")
        cell.set(title=f"E{k + 1}", xlabel="pressure [MPa]")
        values = np.concatenate(reach)
        room = 0.25 * float(np.ptp(values))
        cell.set_ylim(float(values.min()) - room, float(values.max()) + room)
    cells[0].set_ylabel("modulus [MPa]")
    cells[0].legend(fontsize=7.0, frameon=False)
    return figure


def _orders() -> Figure:
    figure, cells = drawing.axes(2, 2, 5.6, sharex=True, sharey=True)
    found = sample()[_SHOWN]
    for order, cell in zip(ORDERS, cells, strict=True):
        _levels(cell, found.linear[order], COLOURS["after"])
        cell.set_title(f"order {order}")
    for cell in (cells[0], cells[2]):
        cell.set_ylabel("force [kN]")
    for cell in cells[:2]:
        cell.set_xlabel("")
    return figure


def _bands(cell: Axes, sets: list[tuple[str, str, Array]]) -> None:
    """Median and range over the stand-ins: label, colour, errors (stand-ins, levels)."""
    places = np.arange(len(LEVELS), dtype=np.float64)
    for k, (label, colour, values) in enumerate(sets):
        at = places + 0.16 * (k - 0.5 * (len(sets) - 1))
        middle = np.median(values, axis=0)
        reach = np.abs(np.array([values.min(axis=0), values.max(axis=0)]) - middle)
        dots: dict[str, Any] = {"fmt": "o", "ms": 4, "lw": 1.0, "color": colour}
        cell.errorbar(at, 100.0 * middle, yerr=100.0 * reach, label=label, **dots)
    cell.set_xticks(places, [f"{psi:g}" for psi in LEVELS])
    cell.set(xlabel="pressure [psi]", ylabel="error (2.37) [%]")
    cell.set_ylim(bottom=0.0)
    cell.legend(fontsize=7.5, frameon=False)


def _errors() -> Figure:
    figure, (cell,) = drawing.axes(1, 1, 3.2)
    every = sample()
    sets = [
        (f"order {m}", colour, np.array([f.error(f.linear[m]) for f in every]))
        for m, colour in zip(ORDERS, _ORDER_COLOUR, strict=True)
    ]
    _bands(cell, sets)
    return figure


def _stress() -> Figure:
    figure, (left, right) = drawing.axes(1, 2, 3.0)
    own, found = stand_in(_SHOWN), sample()[_SHOWN]
    colours = _shades()
    for psi in LEVELS:
        pressure = psi * PSI
        e = own.contractions(pressure)
        hoop = own.muscle.circumferential_strain(e)
        moduli = np.array(found.linear[4].muscle_at(pressure).parameters["modulus_offset"])
        for cell, strain in ((left, -e), (right, hoop)):
            x = np.linspace(float(strain.min()), float(strain.max()), 200)
            cell.plot(x, own.stress(x, pressure) / 1e6, color="#c4c8ce", lw=2.4, zorder=0)
            powers = x[:, None] ** np.arange(1, moduli.size + 1)
            cell.plot(x, powers @ moduli / 1e6, color=colours[psi], lw=1.0)
    left.set_xlabel("axial strain [1]")
    right.set_xlabel("hoop strain [1]")
    left.set_ylabel("stress [MPa]")
    return figure


def _shades() -> dict[float, str]:
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    table = colormaps["viridis"]
    return {psi: to_hex(table(0.95 * k / (len(LEVELS) - 1))) for k, psi in enumerate(LEVELS)}


def _three() -> Figure:
    figure, (cell,) = drawing.axes(1, 1, 3.8)
    colours = {psi: "#1f1f1f" if psi in THREE else COLOURS["before"] for psi in LEVELS}
    _levels(cell, sample()[_SHOWN].three, colours)
    cell.set_ylabel("force [kN]")
    return figure


def _three_errors() -> Figure:
    figure, (cell,) = drawing.axes(1, 1, 3.0)
    every: list[Fits] = sample()
    eight = np.array([f.error(f.linear[4]) for f in every])
    three = np.array([f.error(f.three) for f in every])
    after, before = COLOURS["after"], COLOURS["before"]
    _bands(cell, [("all eight", after, eight), ("20, 60, 120 psi", before, three)])
    return figure


def _loops() -> Figure:
    figure, (cell,) = drawing.axes(1, 1, 3.8)
    own, fit = stand_in(_SHOWN), sample()[_SHOWN].linear[4]
    loops = own.loops()
    for psi in LEVELS:
        pressure = psi * PSI
        rows = np.isclose(loops.pressure, pressure)
        e = 1.0 - loops.length[rows] / loops.rest_length
        cell.plot(100.0 * e, loops.force[rows] / 1e3, color="#9ca3af", lw=2.0)
        mean = fit.muscle_at(pressure).force(pressure, e)
        share = max(0.16 - 0.145 * pressure / 1e6, 0.01)
        force = (mean + loops.direction[rows] * share * np.abs(mean)) / 1e3
        cell.plot(100.0 * e, force, color=COLOURS["after"], lw=0.9)
    cell.set(xlabel="contraction [%]", ylabel="force [kN]")
    return figure
