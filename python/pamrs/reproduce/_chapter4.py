"""Chapter 4 of the 2014 dissertation, control of manipulators: its statements beside what this
package gives.

Every statement is put to the elbow rig as it is, tuned to nothing, and to :data:`RESTORED`, the
plant of those tried that agrees with most of them; the group ``effects`` has all that were tried.
Gains are in radians and volts (:class:`pamrs.control.PID` says why).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from pamrs.comparison import Comparison, Told, judge
from pamrs.control import metrics
from pamrs.reproduce import _lift as lift
from pamrs.reproduce._chapter4_statements import statements
from pamrs.reproduce._lift import Lifts, Map

__all__ = [
    "CHOSEN",
    "DAMPED",
    "GROUPS",
    "RESTORED",
    "RIG",
    "TITLE",
    "chosen",
    "experiments",
    "facts",
    "headings",
    "in_short",
    "latest",
]

TITLE: Final = "Chapter 4: control of manipulators"
#: Names of the plants, see :data:`pamrs.reproduce._lift.VARIANTS`: the rig, with damping alone, and
#: the one that agrees most.
RIG: Final = "the rig"
DAMPED: Final = "muscle damping 6000 N s/m"
RESTORED: Final = "damping 12000 N s/m, activation 50 kPa"
#: The experiments by the name under which figures find their group.
GROUPS: Final = {
    "rig": "lift, hold, return on the rig as it is (4.4.2, 4.5)",
    "restored": "the same statements on a rig with damped muscles that wake at 50 kPa",
    "windup": "integrator wind-up with 34 kg (4.5.1.3)",
    "rig maps": "gain maps on the rig (4.4.1.2, 4.5.1.2)",
    "restored maps": "gain maps with damped muscles that wake at 50 kPa",
    "unit": "the unit of the curvature (4.16)",
    ("effects"): (
        "which unmodelled physics makes the published behaviour come out: statements that agree"
    ),
    "diagnosis": "the diagnosis of closed-loop records, with the rig as the model",
}
#: Numbers that the dissertation does not give.
CHOSEN: Final = (
    (
        "lift-hold-return",
        "15, 80, 15 deg",
        (
            "angles are in figures only; 5 s at rest before and after make three 5 s segments a 25 "
            "s record"
        ),
    ),
    ("begin", "at rest at 15 deg", "with the pressure that holds the arm there"),
    ("controller period", "5 ms", "none is published"),
    ("output low-pass", "50 ms", "one is mentioned (4.3.1.1, 4.3.1.2), without a number"),
    (
        "rate filter",
        "20 ms",
        "of the fuzzy controller's and the feedforward's rate; none is published",
    ),
    ("fuzzy rules", "standard table", "Table 4.1 is an image; output set i + j"),
    (
        "plant against model",
        "force -4.2 %, friction +3.6 %, inertia +4.9 %",
        "'slightly different' (4.4.2), without numbers",
    ),
    (
        "valve.discharge_area_max",
        "8.4 mm2",
        "the shoulder's; 4.2.2 has a lookup table and no number; the controllers know it",
    ),
)

#: Values of the maps: kP, kI, g1, h and how many of each with and without the long search.
_AXES: Final = {"kP": (0.2, 3.8), "kI": (0.0, 6.0), "g1": (0.15, 1.05), "h": (0.2, 2.0)}
_POINTS: Final = {True: 13, False: 7}
_KG: Final = ("11 kg", "23 kg", "34 kg")

_DISTANCE: Final = "logarithmic distance from the published optima, degrees less radians"

Progress = Callable[[str], None]


@dataclass(eq=False)
class Experiments:
    """What was run.

    Attributes
    ----------
    lifts : dict of str to dict of str to Lifts
        By plant and controller.
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
    clamped = lift.lifts([RIG, RESTORED, _WEAK], gains, anti_windup="clamping")
    n = _POINTS[search]
    axes = {name: np.linspace(low, high, n) for name, (low, high) in _AXES.items()}
    maps: dict[tuple[str, str], Map] = {}
    for name in (RIG, RESTORED):
        tell(f"chapter 4: gain maps of {name}, {n} x {n}")
        maps[name, "pid"] = lift.pid_map(axes["kP"].tolist(), axes["kI"].tolist(), name)
        maps[name, "fuzzy"] = lift.fuzzy_map(axes["g1"].tolist(), axes["h"].tolist(), name)
    diagnoses = {}
    if search:
        from pamrs.reproduce._lift_diagnosis import diagnosed

        for name in (DAMPED, RESTORED):
            tell(f"chapter 4: diagnosis of {name}")
            diagnoses[name] = diagnosed(name)
    return Experiments(found, clamped, maps, diagnoses)


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
    rows = statements(GROUPS["rig"], done.lifts[RIG]) + statements(
        GROUPS["restored"], done.lifts[RESTORED]
    )
    rows += _windup(done)
    rows += _maps(GROUPS["rig maps"], done, RIG) + _maps(GROUPS["restored maps"], done, RESTORED)
    return rows + _unit(done) + _effects(done.lifts) + _diagnoses(done)


def headings() -> dict[str, str]:
    """What is said above each group, where that is more than its name."""
    return {}


def chosen() -> list[tuple[str, str, str]]:
    """Name, value and reason of each number that the chapter does not give."""
    return list(CHOSEN)


# ------------------------------------------------------------------------- wind-up


def _windup(done: Experiments) -> list[Comparison]:
    """34 kg under the PID, without and with anti-windup."""
    group, rows = GROUPS["windup"], []
    for name in (RIG, RESTORED, _WEAK):
        plain, clamped = done.lifts[name]["PID"], done.clamped[name]["PID"]
        ours = float(clamped.undershoot[2])
        change = float(np.degrees(np.abs(plain.angle[2] - clamped.angle[2]).max()))
        rows.append(
            judge(
                group,
                f"{name}: overshoot below rest that clamping leaves",
                "4.5.1.3: 'will not remove this' completely",
                0.0,
                ours,
                "deg",
                relation="above",
                note=(
                    f"without anti-windup {plain.undershoot[2]:.2f} deg, the stop being at 5.5; "
                    f"the angles differ by {change:.2f} deg at most: kP 1.4 and kI 2.5 seldom ask "
                    "for more than the valve's 5 V, so that a clamp at its limits has nothing to do"
                ),
            )
        )
    top = float(done.lifts[RIG]["PID"].between(5.0, 15.0).max(axis=1)[2])
    weak = float(done.lifts[_WEAK]["PID"].between(5.0, 15.0).max(axis=1)[2])
    rows.append(
        judge(
            group,
            "largest angle with 34 kg",
            "4.5.1.3: 'the arm cannot produce required torque'",
            lift.HIGH,
            top,
            "deg",
            relation="below",
            note=f"ours can at 0.83 MPa; with a supply of 0.45 MPa the arm stops at {weak:.1f} deg",
        )
    )
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
    return rows.found


class _OfMaps:
    """Statements about maps, and what counts as the same gain in them."""

    def __init__(self, group: str, axes: Mapping[str, Any]) -> None:
        self.group = group
        self.found: list[Comparison] = []
        self.step: dict[str, float] = {
            key: (_AXES[key][1] - _AXES[key][0]) / (axis.size - 1) for key, axis in axes.items()
        }

    def say(
        self, fact: str, where: str, published: float, ours: float, unit: str, **more: Any
    ) -> None:
        """One statement more."""
        self.found.append(judge(self.group, fact, where, published, ours, unit, **more))

    def near(self, least: float, key: str) -> float:
        """What counts as the same gain: no less than a step of the map, on which rounding must not
        decide.
        """
        return max(least, self.step[key] + 1e-9)


def _pid_map(rows: _OfMaps, pid: Map) -> None:
    """4.5.1.2: the gains of PID control, and the cost of the least error."""
    best = {unit: pid.best(j) for unit, j in pid.j.items()}
    other = "in degrees " + _told(best["deg"], ("kP", "kI"))
    told = _told(best["rad"], ("kP", "kI"))
    rows.say(
        ("PID: kP of the smallest J, 11 kg"),
        ("4.5.1.2, Fig. 4.9: just above 1"),
        1.1,
        best["rad"][0][0],
        ("V/rad"),
        tolerance=rows.near(0.3, "kP"),
        note=f"{told}; {other}",
    )
    rows.say(
        ("PID: kI of the smallest J, 11 kg"),
        ("4.5.1.2, Fig. 4.9: near 4"),
        4.0,
        best["rad"][0][1],
        ("V/(rad s)"),
        tolerance=rows.near(0.8, "kI"),
    )
    rows.say(
        "PID: kP, 34 kg less 11 kg",
        "4.5.1.2: decreases",
        0.0,
        best["rad"][2][0] - best["rad"][0][0],
        "V/rad",
        relation="below",
    )
    rows.say(
        ("PID: kP of the smallest J, 23 kg"),
        ("4.5.1.2, experiment"),
        1.4,
        best["rad"][1][0],
        ("V/rad"),
        tolerance=rows.near(0.3, ("kP")),
    )
    rows.say(
        ("PID: kI of the smallest J, 23 kg"),
        ("4.5.1.2, experiment"),
        2.5,
        best["rad"][1][1],
        ("V/(rad s)"),
        tolerance=rows.near(0.6, "kI"),
        note="3.0 was nearly as good there",
    )
    least, smooth = pid.best(pid.nu)[1], pid.best(pid.omega["rad"])[1]
    at = {
        label: _at(pid, pid.omega["rad"], 1, gains)
        for label, gains in (("nu", least), ("j", best["rad"][1]))
    }
    rows.say(
        ("PID, 23 kg: omega at the least nu over that at the least J"),
        ("4.5.1.2: 'best error' has the largest oscillations"),
        1.0,
        at["nu"] / at["j"],
        "",
        relation="above",
        note=(
            f"least nu at kP {least[0]:.2f}, kI {least[1]:.2f}, least omega at kP {smooth[0]:.2f}, "
            f"kI {smooth[1]:.2f}"
        ),
    )


def _fuzzy_map(rows: _OfMaps, fuzzy: Map) -> None:
    """4.4.1.2: the gains of fuzzy control, and the shape of J about them."""
    best = {unit: fuzzy.best(j) for unit, j in fuzzy.j.items()}
    told, other = _told(best["rad"], ("g1", "h")), "in degrees " + _told(best["deg"], ("g1", "h"))
    where = "4.4.1.2, Fig. 4.5 (c)"
    rows.say(
        ("fuzzy: g1 of the smallest J, 23 kg"),
        where,
        0.45,
        best["rad"][1][0],
        ("rad"),
        tolerance=rows.near(0.1, ("g1")),
        note=f"{told}; {other}",
    )
    rows.say(
        "fuzzy: h of the smallest J, 23 kg",
        where,
        0.65,
        best["rad"][1][1],
        "V",
        tolerance=rows.near(0.13, "h"),
    )
    rows.say(
        "fuzzy: h, 34 kg less 11 kg",
        "4.5.1.2: increases with payload",
        0.0,
        best["rad"][2][1] - best["rad"][0][1],
        "V",
        relation="above",
    )
    one, two = fuzzy.best(fuzzy.nu)[1], fuzzy.best(fuzzy.omega["rad"])[1]
    apart = max(abs(one[0] - two[0]) / rows.step["g1"], abs(one[1] - two[1]) / rows.step["h"])
    rows.say(
        ("fuzzy, 23 kg: optima of nu and omega apart, steps of the map"),
        (f"{where}: 'different'"),
        1.0,
        apart,
        (""),
        relation=("above"),
        note=(f"nu at g1 {one[0]:.2f}, h {one[1]:.2f}; omega at g1 {two[0]:.2f}, h {two[1]:.2f}"),
    )
    rows.say(
        ("fuzzy, 23 kg: J beside its optimum over J there"),
        (f"{where}: 'smooth'"),
        1.25,
        float(fuzzy.smooth("rad")[1]),
        (""),
        relation="below",
        note="smooth read as within a quarter at the neighbours in the map",
    )
    quoted = _at(fuzzy, fuzzy.j["rad"], 1, (0.45, 0.65)) / float(np.nanmin(fuzzy.j["rad"][1]))
    rows.say(
        ("fuzzy, 23 kg: J at the published gains over the smallest"),
        where,
        1.0,
        quoted,
        (""),
        tolerance=0.25,
        note="at the nearest gains of the map",
    )


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
    group, rows = GROUPS["unit"], []
    run = done.lifts[RESTORED]["PID"]
    slope = {
        unit: metrics.total_curvature(run.time, run.angle, rate=run.rate, unit=unit)
        for unit in ("rad", "deg")
    }
    rate = math.radians((lift.HIGH - lift.LOW) / 5.0)
    share = {"rad": (1.0 + rate**2) ** -1.5, "deg": (1.0 + math.degrees(rate) ** 2) ** -1.5}
    signed = np.diff(metrics.slope_sine(run.rate), axis=-1).sum(axis=-1)
    why = (
        "no magnitude of nu or omega is printed, only the figures' axes, which are not in the text"
    )
    rows.append(
        judge(
            group,
            "omega of the PID with 23 kg, angle in radians",
            "4.4.1.1 (4.16), (4.17)",
            math.nan,
            float(np.asarray(slope["rad"])[1]),
            cannot_tell=why,
            note=(
                f"in degrees {float(np.asarray(slope['deg'])[1]):.2f}; a wiggle on the 13 deg/s "
                f"ramp counts {100 * share['rad']:.0f} % of one at rest in radians and "
                f"{100 * share['deg']:.2g} % in degrees"
            ),
        )
    )
    for name in (RIG, RESTORED):
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
        rows.append(
            judge(
                group,
                f"{name}: {_DISTANCE}",
                "4.4.1.2, 4.5.1.2, 23 kg",
                math.nan,
                distance["deg"] - distance["rad"],
                cannot_tell="it depends on the plant which unit has its optimum nearer",
                note=(
                    f"of g1, h, kP, kI together: radians {distance['rad']:.2f}, degrees "
                    f"{distance['deg']:.2f}"
                ),
            )
        )
    rows.append(
        judge(
            group,
            "omega as printed, with the sign of y''",
            "4.4.1.1 (4.16)",
            0.0,
            float(np.abs(signed[1])),
            tolerance=0.05,
            note=(
                "it telescopes to the slope at the end less that at the begin, whatever lies "
                "between: |y''| must be meant"
            ),
        )
    )
    return rows


# --------------------------------------------------------------------------- effects


def agreeing(runs: Mapping[str, Lifts]) -> tuple[int, int]:
    """How many of the statements a plant agrees with, and how many there are."""
    rows = statements("", runs)
    return sum(row.verdict == "agree" for row in rows), len(rows)


def _effects(found: Mapping[str, Mapping[str, Lifts]]) -> list[Comparison]:
    """One line for each plant that was tried."""
    group, rows = GROUPS["effects"], []
    before = {row.fact for row in statements("", found[RIG]) if row.verdict == "agree"}
    for name, runs in found.items():
        agree, count = agreeing(runs)
        now = {row.fact for row in statements("", runs) if row.verdict == "agree"}
        restored = sorted(now - before)
        lag = float(np.asarray(runs["fuzzy"].metrics.lag)[:3].mean())
        told = (
            f"fuzzy lags {lag:.2f} s, overshoots {runs['fuzzy'].overshoot[:3].max():.1f} deg; "
            f"FF+fuzzy {runs['FF+fuzzy'].overshoot.max():.1f}, FF+PID "
            f"{runs['FF+PID'].overshoot.max():.1f} deg"
        )
        gained = f"; gained: {'; '.join(restored)}" if restored else ""
        lost = sorted(before - now)
        rows.append(
            judge(
                group,
                name,
                "4.4.2, 4.5",
                count,
                agree,
                "",
                used=name == RESTORED,
                cannot_tell="" if name in (RIG, RESTORED) else "a trial",
                note=told + gained + (f"; lost: {'; '.join(lost)}" if lost else ""),
            )
        )
    return rows


def _diagnoses(done: Experiments) -> list[Comparison]:
    """What the diagnosis says of each recorded plant."""
    rows = []
    for name, found in done.diagnoses.items():
        hidden = tuple(lift.VARIANTS[name].effects)
        probability = {effect["id"]: float(effect["probability"]) for effect in found.effects}
        named = "; ".join(
            f"{effect['id']} {effect['probability']:.3f}: "
            + ", ".join(
                f"{key} {value['value']:.4g} {value['unit']}"
                for key, value in effect["parameters"].items()
            )
            for effect in found.effects
        )
        if not hidden:
            rows.append(
                judge(
                    GROUPS["diagnosis"],
                    f"{name}: effects named",
                    "none is there",
                    0.0,
                    len(probability),
                    note=f"verdict {found.verdict}",
                )
            )
        rows += [
            judge(
                GROUPS["diagnosis"],
                f"{name}: probability of {effect}",
                "what the plant has",
                0.5,
                probability.get(effect, 0.0),
                relation="above",
                note=f"verdict {found.verdict}; {named or 'nothing named'}; it has "
                + ", ".join(
                    f"{key} {value:g}" for key, value in lift.VARIANTS[name].effects[effect].items()
                ),
            )
            for effect in hidden
        ]
    return rows


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
    told = Told(rows, GROUPS, 1)
    ours = told.ours
    count = int(told.row("effects", RIG).published)
    tried = {name: int(told.row("effects", name).ours) for name in lift.VARIANTS}
    damping, valve = "muscle damping 3000 N s/m", "valve 2.44 mm2"
    nearer = [
        told.row("unit", f"{name}: {_DISTANCE}").note.partition("together: ")[2]
        for name in (RIG, RESTORED)
    ]
    return [
        f"On the rig as it is {tried[RIG]} of {count} statements about lift, hold and return "
        "agree: with the printed gains fuzzy control overshoots by "
        f"{ours('rig', 'fuzzy: largest overshoot')} deg and feedforward with PID swings by "
        f"{ours('rig', 'FF+PID: swing in the last 2 s of the hold', 0)} deg, where the "
        "dissertation has no overshoot.",
        "What restores most is damping, which 4.6 names ('the large passive damping component "
        f"inherent to pneumatic muscles'): with 3000 N s/m in each muscle {tried[damping]} agree, "
        f"fuzzy control lags by {_lag(told, damping)} s (published 0.75), does not overshoot. The "
        f"valve of 2.44 mm2 that chapter 3's step asks for has {tried[valve]}, but a lag of "
        f"{_lag(told, valve)} s. Dry friction does some of it; dead zone, lags, regulator, "
        "stiction and heat transfer next to nothing. It is 15 times the usual 200 N s/m, 5 to 32 N "
        "m s/rad at this joint.",
        "kM = 0.5 as the best, and a steady error at rest that grows with kM, come out when the "
        "muscles also pull less at low pressure than the controllers' model (an activation "
        "pressure of 50 kPa), which is the reason that 4.5.2.1 gives: with 12000 N s/m "
        f"{tried[RESTORED]} of {count} agree.",
        "The quoted kP = 5, kI = 2 beside the feedforward overshoot "
        f"{ours('restored', 'FF+PID: largest overshoot of the hold')} deg even then. Clamping at "
        "the valve's limits does not change the PID's wind-up, as it does not reach them.",
        "No value of nu or omega is printed, so the unit of the curvature cannot be read off. By "
        f"the place of the optima (distance from the published ones) it is {nearer[0]} on the rig "
        f"and {nearer[1]} on the damped plant, where the PID's optimum in degrees has no integral "
        "gain. The least omega is where the arm hardly moves: J and its optimum depend on the "
        "borders of the map too, which are not printed.",
        *_diagnosed(rows),
    ]


def _lag(told: Told, name: str) -> str:
    """The fuzzy lag in the remark of a trial."""
    return told.row("effects", name).note.partition("lags ")[2].partition(" s")[0]


def _diagnosed(rows: list[Comparison]) -> list[str]:
    """What the diagnoses come to, where they ran."""
    words = []
    for row in rows:
        if row.group != GROUPS["diagnosis"] or not row.fact.endswith("muscle_rate_damping"):
            continue
        verdict = row.note.partition(";")[0].removeprefix("verdict ")
        words.append(
            f"{verdict!r} for {row.fact.partition(':')[0]}, with a probability of {row.ours:.2f} "
            "for the damping"
        )
    return (
        [f"The diagnosis of closed-loop records has the verdict {', and '.join(words)}."]
        if words
        else []
    )
