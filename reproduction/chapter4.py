"""Chapter 4 of the 2014 dissertation, control of manipulators: its statements beside what this
package gives.

The score is that of the plant that the chapter prints: the muscle of (4.4)-(4.7), and a feedforward
whose flow is counted on the commanded trajectory, both tuned to nothing. Where the text has optimal
gains by payload, they are those of our own gain maps. Every other plant stands apart. Gains are in
radians and volts (:class:`pamrs.control.PID` says why).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pamrs.control import PID, fuzzy_rules, metrics
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from reproduction import lift
from reproduction.chapter4_statements import SERIES, on_stop, restless, say, statements
from reproduction.comparison import Comparison
from reproduction.elbow import HYSTERESIS
from reproduction.lift import Lifts, Map
from reproduction.lifting import lift as hold
from reproduction.margins import loop_margin
from reproduction.statement_tables import Told
from reproduction.statements import OTHER, OWN, TRIAL, Lines

#: Names of the plants, see :data:`reproduction.lift.VARIANTS`: the one of the score, the
#: library's muscle with hysteresis and without, and that with damping.
PRINTED: Final = "as printed"
RUBBING: Final = "smooth muscle, hysteresis (2.36)"
SMOOTH: Final = "smooth muscle"
DAMPED: Final = "smooth muscle, damping 6000 N s/m"

#: Values of the maps: kP, kI, g1, h and how many of each with and without the long search.
_AXES: Final = {"kP": (0.2, 3.8), "kI": (0.0, 6.0), "g1": (0.15, 1.05), "h": (0.2, 2.0)}
#: Values of kD [V s/rad] and g2 [rad/s] beside the best of those.
_DERIVATIVE: Final = (0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 0.8)
_RATE: Final = (0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.2, 1.6, 3.2, 6.4)
_POINTS: Final = {True: 13, False: 7}
_KG: Final = ("11 kg", "23 kg", "34 kg")

_DISTANCE: Final = "logarithmic distance from the published optima, degrees less radians"

Progress = Callable[[str], None]
Array = NDArray[np.float64]


@dataclass(eq=False)
class Experiments:
    """What was run.

    Attributes
    ----------
    lifts : dict of str to dict of str to Lifts
        By plant and controller, with the printed gains.
    tuned : dict of str to dict of str to Lifts
        The same with the gains of the smallest J by payload where the text has them so, for the
        plants with maps.
    lines : dict of str to Map
        The printed plant over ``"kD"`` and ``"g2"``.
    clamped : dict of str to dict of str to Lifts
        The PID with clamping, by plant.
    maps : dict of (str, str) to Map
        By plant and ``"pid"`` or ``"fuzzy"``.
    diagnoses : dict of str to Any
        By plant; empty without the long search.
    """

    lifts: dict[str, dict[str, Lifts]]
    clamped: dict[str, dict[str, Lifts]]
    maps: dict[tuple[str, str], Map]
    tuned: dict[str, dict[str, Lifts]]
    lines: dict[str, Map]
    diagnoses: dict[str, Any] = field(default_factory=dict)


def experiments(*, search: bool = True, progress: Progress | None = None) -> Experiments:
    """Run everything, or give what was run before.

    Parameters
    ----------
    search : bool
        Maps of 13 x 13 gains and the diagnoses; else maps of 7 x 7 and none.
    progress : callable, optional
        Called with what is done next.

    Returns
    -------
    Experiments
    """
    if search not in _KEPT:
        _KEPT.clear()  # the pictures are of what was run last
        _KEPT[search] = _experiments(search, progress or (lambda _: None))
    return _KEPT[search]


def latest() -> Experiments:
    """What was run last; without anything, the short experiments."""
    return next(iter(_KEPT.values())) if _KEPT else experiments(search=False)


_KEPT: dict[bool, Experiments] = {}


def _experiments(search: bool, tell: Progress) -> Experiments:
    tell(
        f"chapter 4: {len(lift.VARIANTS)} plants under {len(lift.GAINS)} controllers with "
        f"{len(lift.PAYLOADS)} payloads"
    )
    found = lift.lifts(list(lift.VARIANTS))
    gains = {"PID": lift.GAINS["PID"]}
    clamped = lift.lifts([PRINTED, RUBBING, _WEAK], gains, anti_windup="clamping")
    n = _POINTS[search]
    axes = {name: np.linspace(low, high, n) for name, (low, high) in _AXES.items()}
    maps: dict[tuple[str, str], Map] = {}
    tuned: dict[str, dict[str, Lifts]] = {}
    for name in (PRINTED, RUBBING):
        tell(f"chapter 4: gain maps of {name}, {n} x {n}")
        maps[name, "pid"] = lift.pid_map(axes["kP"].tolist(), axes["kI"].tolist(), name)
        maps[name, "fuzzy"] = lift.fuzzy_map(axes["g1"].tolist(), axes["h"].tolist(), name)
        best = {kind: maps[name, kind].best(maps[name, kind].j["rad"]) for kind in _KINDS}
        tuned[name] = {**found[name], **lift.lifts([name], _tuned_gains(best))[name]}
    best = {kind: maps[PRINTED, kind].best(maps[PRINTED, kind].j["rad"]) for kind in _KINDS}
    lines = {
        "kD": lift.derivative_line(_DERIVATIVE, best["pid"]),
        "g2": lift.rate_line(_RATE, best["fuzzy"]),
    }
    diagnoses = {}
    if search:
        from reproduction.lift_diagnosis import diagnosed

        for name in (RUBBING, DAMPED):
            tell(f"chapter 4: diagnosis of {name}")
            diagnoses[name] = diagnosed(name)
    return Experiments(found, clamped, maps, tuned, lines, diagnoses)


_KINDS: Final = ("pid", "fuzzy")


def _tuned_gains(best: Mapping[str, list[tuple[float, float]]]) -> dict[str, lift.Gains]:
    """Gains by payload for the controllers that the text has with optimal ones; 45 kg, which no
    statement about them has, gets those of 34 kg.
    """
    (kp, ki), (g1, h) = (
        tuple((*column, column[-1]) for column in zip(*best[kind], strict=True)) for kind in _KINDS
    )
    return {
        "PID": (0.0, kp, ki),
        "FF+PID, PID's gains": (0.5, kp, ki),
        "fuzzy": (0.0, g1, 0.6, h),
    }


#: The plant whose supply cannot lift 34 kg to the hold.
_WEAK: Final = "supply 0.45 MPa"


def facts(*, search: bool = True, progress: Progress | None = None) -> list[Comparison]:
    """Every statement of the chapter beside ours.

    Parameters
    ----------
    search : bool
        As for :func:`experiments`.
    progress : callable, optional
        Called with what is done next.

    Returns
    -------
    list of Comparison
    """
    done = experiments(search=search, progress=progress)
    rows = statements(say.groups["printed"], done.tuned[PRINTED]) + _pressures(done.lifts)
    rows += _rig_alone()
    rows += apart(statements(say.groups["rubbing"], done.tuned[RUBBING]), OTHER)
    rows += _windup(done)
    rows += _maps(say.groups["printed maps"], done, PRINTED) + _lines(done)
    rows += apart(_maps(say.groups["rubbing maps"], done, RUBBING), OTHER)
    return rows + _unit(done) + _effects(done) + apart(_diagnoses(done), OWN)


# ---------------------------------------------------------- pressures and lines of gains


def _pressures(found: Mapping[str, Mapping[str, Lifts]]) -> list[Comparison]:
    """4.4.2 and 4.5.2.2: what a higher source pressure does, and how the pressure follows the
    predicted one.
    """
    runs = found[PRINTED]
    error = [found[name]["FF+fuzzy"].error("lift")[3] for name in ("supply 1.03 MPa", PRINTED)]
    wanted = lift.predicted(runs["series, kM 0"])[1]
    off = {
        km: float(np.sqrt(np.mean((runs[name].pressure[1] - wanted) ** 2))) / 1e3
        for km, name in SERIES.items()
    }
    values = list(off.values())
    return [
        say("FF_fuzzy_45", error[0] / error[1], error[0], error[1]),
        say(
            "pressure_off_predicted",
            max((high / low for low, high in pairwise(values))),
            "; ".join((f"kM {km:g}: {value:.0f}" for km, value in off.items())),
        ),
    ]


def quoted_rules() -> Array:
    """The standard table with the smallest change that gives the rule that the text quotes: where
    error and rate cancel, the output leans to the rate by one set.
    """
    rate = np.arange(-3, 4)
    return np.asarray(fuzzy_rules(3.0 * fuzzy_rules() + np.diag(np.sign(rate))[::-1]))


def _rig_alone() -> list[Comparison]:
    """4.2.1 and 4.3.1.2: what the arm holds, and the rule that the text quotes."""
    rig = lift.assumed()
    pressure = rig.parameter("supply.initial_pressure").value
    most = hold(rig, pressure=pressure, to=math.radians(lift.HIGH)).payload_limit or 0.0
    small = 2, 4  # of NB, NM, NS, ZE, PS, PM, PB: error NS, rate PS
    standard, quoted = (float(3.0 * rules[small]) for rules in (fuzzy_rules(), quoted_rules()))
    return [
        say("holds_50", most, lift.HIGH, 1e-6 * pressure),
        say("quoted_rule", standard, quoted),
    ]


def _lines(done: Experiments) -> list[Comparison]:
    """4.5.1.2: kD and g2, each varied last."""

    def best(own: Map) -> list[float]:
        return [pair[0] for pair in own.best(own.j["rad"])]

    def by_payload(gains: list[float]) -> str:
        return ", ".join(f"{gain:g} ({kg})" for gain, kg in zip(gains, _KG, strict=True))

    pid = done.maps[PRINTED, "pid"]
    kd, g2, kp = (best(own) for own in (done.lines["kD"], done.lines["g2"], pid))
    low, high, border, near = min(kp), max(kp), _border(pid, 0, 1, 2), _DERIVATIVE[1]
    return [
        say("PID_largest_kd", max(kd), by_payload(kd), low, high, border, tolerance=near),
        say("fuzzy_largest_g2", max(g2) / min(g2), by_payload(g2), _at_an_end(g2)),
    ]


def _at_an_end(g2: list[float]) -> str:
    """Why a ratio of the best g2 decides nothing: an end of the line is no optimum."""
    if not {_RATE[0], _RATE[-1]} & set(g2):
        return ""
    return "J is smallest at an end of the line, which is ours: there is no optimum to compare"


# ------------------------------------------------------------------------- wind-up


def _windup(done: Experiments) -> list[Comparison]:
    """34 kg under the PID, without and with anti-windup."""
    rows = say.lines()
    for name in (PRINTED, RUBBING, _WEAK):
        plain, clamped = done.lifts[name]["PID"], done.clamped[name]["PID"]
        ours = float(clamped.undershoot[2])
        change = float(np.degrees(np.abs(plain.angle[2] - clamped.angle[2]).max()))
        rows.say(
            "overshoot_below_rest",
            ours,
            name,
            plain.undershoot[2],
            change,
            on_stop(clamped),
            apart="" if name == PRINTED else OTHER,
        )
    top = float(done.lifts[PRINTED]["PID"].between(5.0, 15.0).max(axis=1)[2])
    weak = float(done.lifts[_WEAK]["PID"].between(5.0, 15.0).max(axis=1)[2])
    rows.say("largest_angle_34", top, weak, published=lift.HIGH)
    return rows


# ------------------------------------------------------------------------ gain maps


def _told(best: list[tuple[float, float]], names: tuple[str, str]) -> str:
    pairs = zip(best, _KG, strict=True)
    return "; ".join(f"{kg}: {names[0]} {a:.2f}, {names[1]} {b:.2f}" for (a, b), kg in pairs)


def _maps(group: str, done: Experiments, name: str) -> list[Comparison]:
    """Optima of the maps by J, with the angle in radians; in degrees in the remark."""
    pid, fuzzy = done.maps[name, "pid"], done.maps[name, "fuzzy"]
    rows = _OfMaps(group, {**pid.axes, **fuzzy.axes})
    _pid_map(rows, pid)
    _fuzzy_map(rows, fuzzy)
    return rows


class _OfMaps(Lines):
    """Statements about maps, and what counts as the same gain in them."""

    def __init__(self, group: str, axes: Mapping[str, Any]) -> None:
        super().__init__(say, group)
        self.step: dict[str, float] = {
            key: (_AXES[key][1] - _AXES[key][0]) / (axis.size - 1) for key, axis in axes.items()
        }

    def near(self, least: float, key: str) -> float:
        """What counts as the same gain: no less than a step of the map, on which rounding must not
        decide.
        """
        return max(least, self.step[key] + 1e-9)


def _border(gains: Map, *payloads: int) -> str:
    """Why an optimum decides nothing: it lies on the border of the map; empty where it does not."""
    best = gains.best(gains.j["rad"])
    on = [
        f"{name} {best[k][axis]:g} with {_KG[k]}"
        for axis, (name, values) in enumerate(gains.axes.items())
        for k in payloads
        if best[k][axis] in (float(values[0]), float(values[-1]))
    ]
    return f"the optimum is on the border of the map, which is ours: {', '.join(on)}" if on else ""


def _pid_map(rows: _OfMaps, pid: Map) -> None:
    """4.5.1.2: the gains of PID control, and the cost of the least error."""
    best = {unit: pid.best(j) for unit, j in pid.j.items()}
    other = "in degrees " + _told(best["deg"], ("kP", "kI"))
    told = _told(best["rad"], ("kP", "kI"))
    light, middle = _border(pid, 0), _border(pid, 1)
    kp, ki = zip(*best["rad"], strict=True)
    rows.say("PID_kp_smallest", kp[0], told, other, light, tolerance=rows.near(0.3, "kP"))
    rows.say("PID_ki_smallest", ki[0], light, tolerance=rows.near(0.8, "kI"))
    rows.say("PID_kp_34", kp[2] - kp[0])
    rows.say("PID_ki_34", ki[2] - ki[1], _border(pid, 0, 1, 2), ki[1] - ki[0])
    rows.say("PID_kp_smallest_J", kp[1], middle, tolerance=rows.near(0.3, "kP"))
    rows.say("PID_ki_smallest_J", ki[1], middle, tolerance=rows.near(0.6, "kI"))
    least, smooth = pid.best(pid.nu)[1], pid.best(pid.omega["rad"])[1]
    at = {
        label: _at(pid, pid.omega["rad"], 1, gains)
        for label, gains in (("nu", least), ("j", best["rad"][1]))
    }
    rows.say("PID_23_kg_omega", at["nu"] / at["j"], least[0], least[1], smooth[0], smooth[1])


def _fuzzy_map(rows: _OfMaps, fuzzy: Map) -> None:
    """4.4.1.2: the gains of fuzzy control, and the shape of J about them."""
    best = {unit: fuzzy.best(j) for unit, j in fuzzy.j.items()}
    told, other = _told(best["rad"], ("g1", "h")), "in degrees " + _told(best["deg"], ("g1", "h"))
    middle = _border(fuzzy, 1)
    g1, h = zip(*best["rad"], strict=True)
    rows.say("fuzzy_g1_smallest", g1[1], told, other, middle, tolerance=rows.near(0.1, "g1"))
    rows.say("fuzzy_h_smallest", h[1], middle, tolerance=rows.near(0.13, "h"))
    rows.say("fuzzy_h_34", h[2] - h[0], _border(fuzzy, 0, 2))
    rows.say("fuzzy_h_near", h[2] / h[1], _border(fuzzy, 1, 2), h[1], h[2], rows.step["h"])
    one, two = fuzzy.best(fuzzy.nu)[1], fuzzy.best(fuzzy.omega["rad"])[1]
    apart = max(abs(one[0] - two[0]) / rows.step["g1"], abs(one[1] - two[1]) / rows.step["h"])
    rows.say("fuzzy_23_kg", apart, one[0], one[1], two[0], two[1])
    rows.say("fuzzy_23_kg_J", float(fuzzy.smooth("rad")[1]), middle)
    quoted = _at(fuzzy, fuzzy.j["rad"], 1, (0.45, 0.65)) / float(np.nanmin(fuzzy.j["rad"][1]))
    rows.say("fuzzy_23_kg_J_published", quoted, middle)


def _at(gains: Map, values: Any, payload: int, place: tuple[float, float]) -> float:
    """A map's value at the nearest gains."""
    first, second = gains.axes.values()
    return float(
        values[
            payload, int(np.abs(first - place[0]).argmin()), int(np.abs(second - place[1]).argmin())
        ]
    )


# ------------------------------------------------------------------------------ unit


def _unit(done: Experiments) -> list[Comparison]:
    """What hangs on the unit of the angle in the curvature."""
    rows = say.lines()
    run = done.lifts[PRINTED]["PID"]
    slope = {
        unit: metrics.total_curvature(run.time, run.angle, rate=run.rate, unit=unit)
        for unit in ("rad", "deg")
    }
    rate = math.radians((lift.HIGH - lift.LOW) / 5.0)
    share = {"rad": (1.0 + rate**2) ** -1.5, "deg": (1.0 + math.degrees(rate) ** 2) ** -1.5}
    signed = np.diff(metrics.slope_sine(run.rate), axis=-1).sum(axis=-1)
    rows.say(
        "omega_PID_23",
        float(np.asarray(slope["rad"])[1]),
        float(np.asarray(slope["deg"])[1]),
        100 * share["rad"],
        100 * share["deg"],
    )
    for name in (PRINTED, RUBBING):
        distance = {}
        for unit in ("rad", "deg"):
            best = done.maps[name, "fuzzy"].best(done.maps[name, "fuzzy"].j[unit])[1]
            gains = done.maps[name, "pid"].best(done.maps[name, "pid"].j[unit])[1]
            distance[unit] = math.hypot(
                *(
                    math.log(max(a, 0.05) / b)
                    for a, b in zip((*best, *gains), (0.45, 0.65, 1.4, 2.5), strict=True)
                )
            )
        rows.say(
            "logarithmic_distance_published",
            distance["deg"] - distance["rad"],
            name,
            distance["rad"],
            distance["deg"],
        )
    rows.say("omega_printed_sign", float(np.abs(signed[1])))
    return rows


# --------------------------------------------------------------------------- effects


def agreeing(runs: Mapping[str, Lifts]) -> tuple[int, int]:
    """How many of the statements a plant agrees with, and how many there are."""
    rows = statements("", runs)
    return sum(row.verdict == "agree" for row in rows), len(rows)


def apart(rows: list[Comparison], why: str) -> list[Comparison]:
    """The same lines as no part of the score."""
    return [replace(row, apart=why) for row in rows]


def _effects(done: Experiments) -> list[Comparison]:
    """One line for each plant that was tried with the printed gains, and one for each with its
    own.
    """
    before = agreed(done.lifts[PRINTED])
    tried = {name: (runs, TRIAL) for name, runs in done.lifts.items()}
    tried |= {
        f"{name}, gains of its own maps": (runs, "the score" if name == PRINTED else OTHER)
        for name, runs in done.tuned.items()
    }
    rows = say.lines()
    for name, (runs, why) in tried.items():
        now = agreed(runs)
        gained, lost = sorted(now - before), sorted(before - now)
        lag = float(np.asarray(runs["fuzzy"].metrics.lag)[:3].mean())
        told = (
            f"fuzzy lags {lag:.2f} s, overshoots {runs['fuzzy'].overshoot[:3].max():.1f} deg; "
            f"FF+fuzzy {runs['FF+fuzzy'].overshoot.max():.1f}, FF+PID "
            f"{runs['FF+PID'].overshoot.max():.1f} deg"
        )
        told += f"; gained: {'; '.join(gained)}" if gained else ""
        told += f"; lost: {'; '.join(lost)}" if lost else ""
        rows.say("plant_tried", len(now), name, told, apart=why)
    return rows


def agreed(runs: Mapping[str, Lifts]) -> set[str]:
    """The statements that a plant agrees with."""
    return {row.fact for row in statements("", runs) if row.verdict == "agree"}


def _diagnoses(done: Experiments) -> list[Comparison]:
    """What the diagnosis says of each recorded plant."""
    rows = say.lines()
    for name, found in done.diagnoses.items():
        variant = lift.VARIANTS[name]
        hidden: dict[str, Mapping[str, float]] = dict(variant.effects)
        if variant.hysteresis:
            hidden["muscle_hysteresis"] = HYSTERESIS
        probability = {effect["id"]: float(effect["probability"]) for effect in found.effects}
        named = "; ".join(
            f"{effect['id']} {effect['probability']:.3f}: "
            + ", ".join(
                f"{key} {value['value']:.4g} {value['unit']}"
                for key, value in effect["parameters"].items()
            )
            for effect in found.effects
        )
        for effect, values in hidden.items():
            sizes = ", ".join(f"{key} {value:g}" for key, value in values.items())
            chance, verdict = probability.get(effect, 0.0), found.verdict
            said = named or "nothing named"
            rows.append(say("probability", chance, name, effect, verdict, said, sizes))
    return rows


def tables() -> dict[str, str]:
    """Which loops of which plants do not come to rest in the hold, as Markdown, by group."""
    done = latest()
    runs = dict(done.lifts)
    runs |= {f"{name}, gains of its own maps": found for name, found in done.tuned.items()}
    lines = [
        "| plant | not at rest in the hold: peak to peak in its last 2 s [deg] |",
        "|---|---|",
        *(
            f"| {name} | {'; '.join(told for told in map(restless, found, found.values()) if told)}"
            " |"
            for name, found in runs.items()
        ),
        "",
        "*What moves by more than 2 deg and does not become less is in a limit cycle, as FF+PID "
        "with its 20 deg and more, or settles too slowly, as FF, which has no feedback, and the "
        "PID. All others come to rest, or move by less than a figure shows.*",
        "",
        "| payload | kP of the PID may grow by, printed gains | gains of its own map |",
        "|--:|--:|--:|",
        *(f"| {row} |" for row in _margins(done)),
        "",
        "*Of small motions about the hold, filling and venting, dry friction at rest and in "
        f"motion, the plant {SMOOTH!r}: the printed muscle has a kink at rest. Below one they "
        "grow.*",
    ]
    return {say.groups["effects"]: "\n".join(lines)}


def _margins(done: Experiments) -> list[str]:
    """Margins of the PID's loop, payload by payload."""
    best = done.maps[PRINTED, "pid"].best(done.maps[PRINTED, "pid"].j["rad"])
    found = []
    for k, (gains, name) in enumerate(zip(best, _KG, strict=True)):
        rig = lift.plant(lift.VARIANTS[SMOOTH], lift.PAYLOADS[k])
        tried = (lift.GAINS["PID"][1:], gains)
        at = [_pid_margin(rig, kp, ki) for kp, ki in tried]
        found.append(f"{name} | {at[0]} | {at[1]}")
    return found


def _pid_margin(rig: Rig, kp: float, ki: float) -> str:
    """A margin in words."""
    try:
        value = loop_margin(
            rig, lambda: PID(kp, ki, period=lift.PERIOD), math.radians(lift.HIGH), steepest=1.5
        )
    except ParameterError:
        return "no linear model"
    return f"{value:.2f}"


def in_short(rows: list[Comparison]) -> list[str]:
    """What the table comes to, in a few sentences with its numbers.

    Parameters
    ----------
    rows : list of Comparison
        What :func:`facts` returns.

    Returns
    -------
    list of str
    """
    told = Told(rows, say.groups, 1)
    ours = told.ours
    count = sum(row.group == say.groups["rubbing"] for row in rows)
    tried = {row.fact: f"{row.ours:.0f}" for row in rows if row.group == say.groups["effects"]}
    own = ", gains of its own maps"
    nearer = [
        told.row("unit", f"{name}: {_DISTANCE}").note.partition("together: ")[2]
        for name in (PRINTED, RUBBING)
    ]
    strong = "smooth muscle, damping 12000 N s/m, activation 50 kPa"
    best = told.row("printed maps", "PID: kP of the smallest J, 11 kg").note
    fuzzy = told.row("printed maps", "fuzzy: g1 of the smallest J, 23 kg").note
    border = f"kP {_AXES['kP'][0]:.2f}"
    return [
        *say.short(
            (count, tried[PRINTED + own], tried[PRINTED]),
            (
                tried[RUBBING],
                tried[RUBBING + own],
                tried[SMOOTH],
                tried[PRINTED + _MEASURED],
                tried[RUBBING + _MEASURED],
                tried[SMOOTH + _MEASURED],
            ),
            (
                tried[strong],
                tried[strong + _MEASURED],
                tried["muscle damping 3000 N s/m"],
                tried[_VALVE],
                tried["valve 2.44 mm2"],
            ),
            (
                ours("printed", "FF+PID: largest overshoot of the hold"),
                ours("printed", "FF+PID: swing in the last 2 s of the hold"),
                ours("printed", "kM with the smallest RMS error, 23 kg"),
                ours("printed", "error at rest, kM 1 less kM 0.25"),
            ),
            (best.partition("; in")[0], _BORDER if border in best else ""),
            (fuzzy.split("; ")[1].removeprefix("23 kg: "),),
            (),
            (nearer[0], nearer[1]),
        ),
        *_diagnosed(rows),
    ]


_BORDER: Final = (
    "; the least kP of the map is 0.2, and an optimum there hangs on the map's border, which is "
    "not printed"
)
_MEASURED: Final = ", measured motion"
_VALVE: Final = "valve 4.2 mm2"


def _diagnosed(rows: list[Comparison]) -> list[str]:
    """What the diagnoses come to, where they ran."""
    words = []
    for row in rows:
        if row.group != say.groups["diagnosis"]:
            continue
        verdict = row.note.partition(";")[0].removeprefix("verdict ")
        plant, _, effect = row.fact.partition(": probability of ")
        words.append(f"{verdict!r} for {plant}, with a probability of {row.ours:.2f} for {effect}")
    return (
        [f"The diagnosis of closed-loop records has the verdict {', and '.join(words)}."]
        if words
        else []
    )
