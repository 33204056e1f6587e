"""Chapter 3 of the 2014 dissertation, structural design of manipulators: its statements beside what
this package gives.

Nothing here is tuned to agree. Two things in the chapter can be read in two ways, and both readings
stand in the table: its angles (here rotations from the rest angle, where its equations begin; "from
the vertical" is the other) and its joint torque (power-conserving, or by (3.6)-(3.8) as printed).
What it does not give is the elbow rig's: :data:`CHOSEN` says from where.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pamrs.library import entry
from pamrs.rig import Joint, Muscle
from pamrs.simulation import Simulation
from pamrs.units import parse_unit, to_si
from reproduction import elbow
from reproduction.comparison import Comparison
from reproduction.elbow import FOOT_POUND, INCH, POUND, PSI
from reproduction.lifting import lift
from reproduction.muscles.published import compare_entry
from reproduction.statement_tables import Told
from reproduction.statements import TRIAL, Lines, Statements

#: The statements of the chapter.
say: Final = Statements("chapter3")

Array = NDArray[np.float64]

#: Braid angle that gives the published blocked force and the published largest diameter [deg].
STEEPER: Final = 73.5
#: Other choices of what is not published: friction none and twice, dead volume none and twice, all
#: 7 kg in the forearm.
_FRICTION: Final[tuple[dict[str, float], ...]] = (
    {"viscous": 0.0, "coulomb": 0.0},
    {"viscous": 6.0, "coulomb": 3.0},
)
_HEAVY: Final[dict[str, float]] = {"inertia": 0.602, "first_moment": 1.778}
_DEAD: Final[tuple[dict[str, float], ...]] = ({"dead_volume": 1e-7}, {"dead_volume": 3e-4})

_RANGE: Final = 78.0  # deg, over which the torque is above 200 ft lbf
_LEAST: Final = 200.0 * FOOT_POUND
_PRINTED: Final = "torque as printed in (3.6)-(3.8)"
_LAST: Final = "last rotation with 200 ft lbf"
#: Statements that both torque laws answer: group, statement, digits shown.
_LAWS_TOLD: Final = (
    ("torque", _LAST, 1),
    ("ramp", "largest torque", 0),
    ("ramp", "rotation at the largest torque", 0),
    ("step", "rotation swept", 0),
)

Progress = Callable[[str], None]


def facts(*, search: bool = True, progress: Progress | None = None) -> list[Comparison]:
    """Every statement of the chapter beside ours.

    Parameters
    ----------
    search : bool
        Whether the joint searches of 3.5 run too: about a minute.
    progress : callable, optional
        Called with what is done next.

    Returns
    -------
    list of Comparison
    """
    tell = progress or (lambda _: None)
    parts = {
        "muscles": _muscles,
        "torque": _torque,
        "step": _step,
        "triangular pressure": _triangle,
        "ramp and hold": _ramp,
        "construction": _construction,
    }
    rows: list[Comparison] = []
    for text, part in parts.items():
        tell(f"chapter 3: {text}")
        rows += part()
    rows = say.scored([*rows, *_optimised(search, tell)])
    tell(f"chapter 3: braid of {STEEPER:g} deg")
    return rows + _steeper(rows, [part for text, part in parts.items() if text != "muscles"])


def _steeper(
    rows: list[Comparison], parts: Sequence[Callable[[], list[Comparison]]]
) -> list[Comparison]:
    """The lines whose verdict another braid angle turns, and what it makes of the score."""
    own = entry("elbow_0625in")
    changed = dataclasses.replace(
        own,
        parameters={
            **own.parameters,
            "braid_angle": math.radians(STEEPER),
            "modulus_scale": elbow.steeper_braid(STEEPER).parameters["modulus_scale"],
        },
    )
    with elbow.braid(STEEPER):
        now = [row for part in parts for row in part()]
    before = {(row.group, row.fact): row for row in rows}
    now += [
        row
        for row in compare_entry(changed)
        if (row.group, row.fact) in before and not row.fact.startswith("braid angle")
    ]
    turned = [row for row in now if row.verdict != before[row.group, row.fact].verdict]
    counted = [
        row for row in now if row.verdict != "cannot tell" and not before[row.group, row.fact].apart
    ]
    agree = [
        sum(row.verdict == "agree" for row in found)
        for found in ([before[row.group, row.fact] for row in counted], counted)
    ]
    group = say.groups["braid"]
    first = say("statements_elbow_s", agree[1], len(counted), agree[0], len(turned))
    return [
        first,
        *(
            dataclasses.replace(
                row,
                group=group,
                fact=f"{row.fact}: {before[row.group, row.fact].verdict} at 72.5 deg",
                note=f"{before[row.group, row.fact].ours:.4g} {row.unit} at 72.5 deg".replace(
                    "  ", " "
                ),
                apart=TRIAL,
            )
            for row in turned
        ),
    ]


def headings() -> dict[str, str]:
    """What is said above each group, where that is more than its name."""
    from reproduction.muscles.published import headings as muscles

    return muscles()


def chosen() -> list[tuple[str, str, str]]:
    """Name, value with its unit, and reason of each number of the rig that is not given."""
    rig, found = elbow.arm_rig(), []
    for one in say.numbers:
        value = rig.parameter(one["name"]).value / parse_unit(one["unit"]).scale
        found.append((one["name"], f"{value:.4g} {one['unit']}", one["reason"]))
    return found


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
    ours, group = Told(rows, say.groups, 0).ours, say.groups["braid"]
    steeper = [row for row in rows if row.group == group]
    braid, turned = steeper[0], len(steeper)
    blocked, stroke = "blocked force at 150 psi", "stroke of Table 3.5 over the range"
    printed = [ours(group, f"{fact}, {_PRINTED}", digits) for group, fact, digits in _LAWS_TOLD]
    conserving = [ours(group, fact, digits) for group, fact, digits in _LAWS_TOLD]
    return say.short(
        (*printed, *conserving),
        (
            ours("elbow_0625in", blocked),
            ours("elbow_0625in", blocked + ", thin wall (3.19)"),
            ours("elbow_0625in", "braid angle for 820 lbf", 1),
            ours("elbow_0625in", "braid angle for 1.75 in, cylinder", 1),
        ),
        (
            STEEPER,
            turned - 1,
            braid.ours,
            braid.fact.rpartition(" ")[2],
            braid.note.partition("; ")[2].partition(" ")[0],
        ),
        (ours("large_2in", "blocked force at 90 psi"),),
        (ours("step", "mean rate over 90 deg, the same valve"),),
        (
            ours("shoulder: 6 pam_a_1in at 190 psi", stroke, 1),
            ours("elbow: 8 pam_b_075in at 150 psi", stroke, 1),
        ),
    )


def _muscle() -> Muscle:
    muscle = elbow.arm_rig().muscle
    assert muscle is not None
    return muscle


# ------------------------------------------------------------------- 3.2.2 and 3.2.3


def _muscles() -> list[Comparison]:
    """What the library knows of the chapter's two muscles, and six of the one against two of the
    other.
    """
    from reproduction.muscles.published import compare
    from reproduction.six_against_two import compare_design

    rows = [
        row
        for name in ("elbow_0625in", "large_2in", "large_2in_effective")
        for row in compare(name)
    ]
    return [row for row in rows if re.search(r"\b3\.2|Table 3", row.where)] + compare_design(
        "large_2in_effective"
    )


# ------------------------------------------------------------------ 3.2.4, Figure 3.7


def _chapter_torque(rotation: Any, share: float) -> Any:
    """The chapter's own model: (3.21) and (3.6)-(3.8) as printed."""
    return elbow.elbow_torque(rotation, law="printed", muscle=elbow.mooney_rivlin(share))


def _torque() -> list[Comparison]:
    """Torque at 150 psi over the rotation."""
    rows = say.lines()
    _torque_at_rest(rows)
    _range_of_torque(rows, *_ranges())
    _torque_overall(rows)
    return rows


def _ranges() -> tuple[dict[str, Array], dict[float, Array]]:
    """Rotations with 200 ft lbf [deg], shape (2,).

    By torque law, and with the muscle of (3.21) by its share of C01.
    """
    laws = {
        law: np.degrees(elbow.torque_range(partial(elbow.elbow_torque, law=law), _LEAST))
        for law in elbow.LAWS
    }
    own = {
        share: np.degrees(elbow.torque_range(partial(_chapter_torque, share=share), _LEAST))
        for share in (0.0, 0.5, 1.0)
    }
    return laws, own


def _torque_at_rest(rows: Lines) -> None:
    """Where the range begins: the rest angle, and the torque there."""
    rest = elbow.rest_angle()
    at_rest = float(elbow.elbow_torque(0.0)) / FOOT_POUND
    blocked = float(_muscle().force(150.0 * PSI, 0.0)) / to_si(1.0, "lbf", "force")
    steep = np.degrees(
        elbow.torque_range(
            partial(elbow.elbow_torque, law="printed", muscle=elbow.steeper_braid()), _LEAST
        )
    )
    rows.say("rest_angle_lower", math.degrees(rest))
    rows.say("torque_where_range", at_rest, blocked, at_rest * 820.0 / blocked, steep[0], steep[1])


def _range_of_torque(rows: Lines, ranges: dict[str, Array], own: dict[float, Array]) -> None:
    """Rotations between which there are 200 ft lbf: as we have the torque, as printed, and read
    otherwise.
    """
    rest, end = elbow.rest_angle(), math.radians(_RANGE)
    at_end = {law: float(elbow.elbow_torque(end, law=law)) / FOOT_POUND for law in elbow.LAWS}
    low, high = (float(elbow.elbow_torque(end, law="printed", psi=psi)) for psi in (50.0, 150.0))
    upright = float(elbow.elbow_torque(end - rest, law="printed")) / FOOT_POUND
    rows.say("first_rotation_200", ranges["conserving"][0], ranges["printed"][0], own[0.5][0])
    rows.say(
        "last_rotation_200",
        ranges["conserving"][1],
        at_end["conserving"],
        100.0 * (1.0 - at_end["printed"] / at_end["conserving"]),
    )
    rows.say(
        "last_rotation_200_ft", ranges["printed"][1], 50.0 + 100.0 * (_LEAST - low) / (high - low)
    )
    rows.say("last_rotation_200_ft_lbf", own[0.5][1], own[1.0][1], own[0.0][1])
    rows.say("last_rotation_200_ft_lbf_printed", ranges["printed"][1] + math.degrees(rest), upright)


def _torque_overall(rows: Lines) -> None:
    """The largest torque, and what a seventh muscle adds."""
    rotation = np.linspace(0.0, 100.0, 401)
    torque = elbow.elbow_torque(np.radians(rotation)) / FOOT_POUND
    rows.say("largest_torque", float(torque.max()), rotation[torque.argmax()])
    within, end = rotation <= _RANGE, np.radians(rotation[rotation <= _RANGE])
    printed = elbow.elbow_torque(end, law="printed") / FOOT_POUND
    rows.say(
        "torque_level",
        float(torque[within].min() / torque[within].max()),
        float(printed.min() / printed.max()),
        float(torque[within].min()),
        float(torque[within].max()),
    )
    ends = {
        n: np.degrees(elbow.torque_range(partial(elbow.elbow_torque, count=n), _LEAST))
        for n in (6, 7, 8, 10)
    }
    rows.say(
        "range_gained_seven",
        float(np.ptp(ends[7]) / np.ptp(ends[6]) - 1.0) * 6.0,
        ", ".join((f"{n} muscles from {a:.1f} to {b:.1f} deg" for n, (a, b) in ends.items())),
    )


# ------------------------------------------------------------------ 3.2.4, Figure 3.8


def step_by_area(law: str = "conserving") -> tuple[elbow.Step, ...]:
    """The step of Fig. 3.8 with valves from small to large.

    Parameters
    ----------
    law : {"conserving", "printed"}
        How the joint's torque is counted.

    Returns
    -------
    tuple of Step
    """
    return _step_by_area(law, elbow.braid_angle())


@cache
def _step_by_area(law: str, _: float | None) -> tuple[elbow.Step, ...]:
    return tuple(elbow.step(float(area), law=law) for area in np.geomspace(1e-6, 1.2e-5, 61))


def _step() -> list[Comparison]:
    """The step of Fig. 3.8."""
    rows, peak = say.lines(), math.radians(200.0)
    ours, fitted = elbow.step(), elbow.step(elbow.valve_for_peak(peak))
    _rotation_of_step(rows, ours, fitted)
    _rates_of_step(rows, ours, fitted, peak)
    return rows


def _rotation_of_step(rows: Lines, ours: elbow.Step, fitted: elbow.Step) -> None:
    """How far the arm turns."""
    rows.say("rotation_swept", math.degrees(ours.swept), math.degrees(fitted.first_turn))
    rows.say(
        "rotation_swept_torque", math.degrees(elbow.rotation_reached(100.0, 150.0, law="printed"))
    )


def _rates_of_step(rows: Lines, ours: elbow.Step, fitted: elbow.Step, peak: float) -> None:
    """How fast it turns, with the rig's valve and with one chosen for a peak rate [rad/s]."""
    spread = [
        1e6 * elbow.valve_for_peak(peak, law="conserving", **change)
        for change in (*_FRICTION, *_DEAD, _HEAVY)
    ]
    slow = max(
        (item for item in step_by_area() if item.mean < math.radians(57.3)),
        key=lambda item: item.area,
    )
    rows.say("peak_rate_rig", math.degrees(ours.peak), 1000000.0 * ours.area)
    rows.say(
        "peak_rate_valve",
        math.degrees(fitted.peak),
        1000000.0 * fitted.area,
        min(spread),
        max(spread),
    )
    rows.say(
        "mean_rate_90",
        math.degrees(fitted.mean),
        fitted.arrival,
        1000000.0 * slow.area,
        math.degrees(slow.peak),
        math.degrees(slow.first_turn),
        slow.arrival,
        math.degrees(slow.mean),
    )
    rows.say("mean_rate_90_deg", math.degrees(fitted.mean))


# ------------------------------------------------------- 3.3.2, Figures 3.12 and 3.13


def _sides(hysteresis: bool) -> tuple[float, float]:
    """Rotation [deg] and torque (3.24) [ft lbf] on the falling side less those on the rising side,
    mean from 40 to 145 psi.
    """
    result, psi = elbow.triangle(hysteresis=hysteresis), np.linspace(40.0, 145.0, 106)
    angle = np.degrees(elbow.at_same_pressure(result, result["joint_angle"], psi))
    torque = (
        np.array(
            elbow.at_same_pressure(result, elbow.payload_torque(135.0, result["joint_angle"]), psi)
        )
        / FOOT_POUND
    )
    return float((angle[1] - angle[0]).mean()), float((torque[1] - torque[0]).mean())


def _triangle() -> list[Comparison]:
    """The triangular pressure of Figs. 3.12 and 3.13."""
    rows = say.lines()
    static, printed = (elbow.static_curve(135.0, law=law) for law in elbow.LAWS)
    _rates_of_triangle(rows, static, printed)
    _loops_of_triangle(rows, static)
    return rows


def _rates_of_triangle(rows: Lines, static: elbow.StaticCurve, printed: elbow.StaticCurve) -> None:
    """The rate where the arm sets off, at its largest, and at the top of the pressure."""
    from reproduction.muscles.evaluate import activation_pressure

    speed = 150.0 / 10.0  # psi/s
    rate = np.degrees(static.slope) * speed
    rubber = activation_pressure(_muscle()) / PSI
    joint, rest = (
        Joint.from_model(elbow.arm_rig().model["joint"]),
        float(_muscle().parameters["rest_length"]),
    )
    contraction = float(joint.shortening(elbow.rest_angle() + static.rotation[-1])) / rest
    rows.say(
        "largest_rate_rate",
        float(rate.max() / rate[0]),
        rate[0],
        static.psi[0],
        rate.max(),
        static.psi[rate.argmax()],
        rubber,
    )
    rows.say(
        "rate_top_pressure",
        float(rate[-1] / rate.max()),
        rate[-1],
        math.degrees(printed.slope[-1]) * speed,
        100.0 * contraction,
    )


def _loops_of_triangle(rows: Lines, static: elbow.StaticCurve) -> None:
    """Rotation and torque on the falling side beside the rising one, and the torque over the
    pressure.
    """
    (turned, loop), (turned_plain, loop_plain) = _sides(True), _sides(False)
    lower, upper = (
        elbow.payload_torque(
            135.0, elbow.rest_angle() + np.interp([75.0, 150.0], static.psi, static.rotation)
        )
        / FOOT_POUND
    )
    rows.say("rotation_pressure_falling", turned, turned_plain)
    rows.say("torque_3_24", loop, loop_plain)
    rows.say("torque_3_24_150", float(upper / lower), lower, upper)


# -------------------------------------------------------------------- 3.4, Figure 3.16


def _peak(result: Simulation) -> tuple[float, float, float]:
    """Largest torque [ft lbf] of a simulation, its rotation [deg] and time [s]."""
    row = int(np.argmax(result["joint_torque"]))
    rotation = float(result["joint_angle"][row]) - elbow.rest_angle()
    return (
        float(result["joint_torque"][row]) / FOOT_POUND,
        math.degrees(rotation),
        float(result.time[row]),
    )


def _ramp() -> list[Comparison]:
    """Ramp and hold of Fig. 3.16."""
    rows = say.lines()
    choices: tuple[Mapping[str, float], ...] = ({}, *_FRICTION, _HEAVY)
    for law, words in (("conserving", ""), ("printed", f", {_PRINTED}")):
        torque, rotation, time = _peak(elbow.ramp_and_hold(law=law))
        others = [
            _peak(elbow.ramp_and_hold(law=law, hysteresis=h, **change))
            for h in (False, True)
            for change in choices
        ]
        torques, angles, _ = zip(*others, strict=True)
        note = (
            f"in a swing, at {time:.1f} s; {min(torques):.0f} to {max(torques):.0f} ft lbf at "
            f"{min(angles):.0f} to {max(angles):.0f} deg with no to twice the rig's friction, all "
            "7 kg in the forearm, or hysteresis (2.36)"
        )
        why = "" if words else "the joint's torque: as printed in (3.6)-(3.8) it agrees, see below"
        rows.say("largest_torque_2", torque, words, note, why)
        at_rest = math.degrees(elbow.rotation_reached(100.0, 145.0, law=law))
        rows.say("rotation_largest_torque", rotation, words, at_rest, why)
    static = (
        float(elbow.payload_torque(100.0, elbow.rest_angle() + math.radians(83.0))) / FOOT_POUND
    )
    leaving = float(elbow.static_curve(100.0).psi[0])
    rows.say("torque_100_lb", static, 20.0 * 190.0 / static)
    rows.say("pressure_reached", 145.0)
    rows.say("delay_until_pressure", 10.0 / (150.0 / 4.0), leaving, leaving / (150.0 / 4.0))
    return rows


# ----------------------------------------------------------------- 3.2.1, 3.2.5 and 3.3


def _construction() -> list[Comparison]:
    """What is said of the arm as it was built."""
    rows = say.lines()
    _multiplicity(rows)
    _payloads(rows)
    _bending(rows)
    _not_modelled(rows)
    return rows


def _payloads(rows: Lines) -> None:
    """What the arm lifts."""
    limit = (
        lift(
            elbow.arm_rig(), pressure=150.0 * PSI, to=elbow.rest_angle() + math.radians(90.0)
        ).payload_limit
        or 0.0
    )
    lever = 2.0 * _LEAST / (316.0 * POUND * 9.80665 * INCH)
    lifted = math.degrees(elbow.rotation_reached(380.0, 150.0))
    wrist = float(elbow.payload_torque(380.0, 0.5 * math.pi, 7.0 * INCH)) / FOOT_POUND
    rows.say("payload_one_arm", limit / POUND, lever)
    rows.say("largest_payload_tested", math.nan, lifted, wrist)


def _multiplicity(rows: Lines) -> None:
    """What many small muscles are for: room, and that one may fail."""
    wide = {}
    for name, length in (("elbow_0625in", 0.63), ("large_2in_effective", 0.61)):
        muscle = entry(name).muscle
        shortest = min(1.0 - length, muscle.contraction_limits[1])
        wide[name] = float(muscle.radius(shortest) / muscle.radius(0.0))
    small, large = wide.values()
    rows.say("triple", max(small, large), 1.75 / 0.625, 4.5 / 2.0, small, large)
    end = math.radians(_RANGE)
    left = [
        float(elbow.elbow_torque(end, count=n - 1) / elbow.elbow_torque(end, count=n))
        for n in (6, 2)
    ]
    rows.say("redundancy", left[0] / left[1], left[0], left[1])


def _bending(rows: Lines) -> None:
    """A cantilever of steel, 200 GPa, under a force at its end."""
    moment = to_si(500.0, "lbf", "force") * (33.0 * INCH) ** 3 / (3.0 * 200e9 * 0.5 * INCH)
    bar = (64.0 * moment / math.pi) ** 0.25
    rows.say("bending_under_500", math.nan, 100000000.0 * moment, 1000.0 * bar)


def _not_modelled(rows: Lines) -> None:
    """What no simulation of ours can tell."""
    rows.say("safety_factor")
    rows.say("failure")
    rows.say("wear")
    rows.say("measured_torque")
    rows.say("measured_force")


# ----------------------------------------------------------------------------------- 3.5


def _optimised(search: bool, tell: Progress) -> list[Comparison]:
    """The joints of Table 3.5, and with ``search`` what the searches find."""
    from reproduction.joints import CASES, facts_of_geometry, facts_of_search

    rows = say.lines()
    for case in CASES:
        tell(f"chapter 3: {case.name} of Table 3.5")
        rows += facts_of_geometry(case)
        if search:
            rows += facts_of_search(case, progress=tell)
    return rows
