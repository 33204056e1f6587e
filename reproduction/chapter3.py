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

from pamrs.comparison import Comparison, Told, judge
from pamrs.design import lift
from pamrs.library import entry
from pamrs.library.published import compare_entry
from pamrs.rig import Joint, Muscle
from pamrs.simulation import Simulation
from pamrs.units import parse_unit, to_si
from reproduction import elbow
from reproduction.elbow import FOOT_POUND, INCH, POUND, PSI
from reproduction.score import OTHER, OWN, SAME, TRIAL, Apart, scored

__all__ = [
    "CHOSEN",
    "GROUPS",
    "SHARE",
    "TITLE",
    "chosen",
    "facts",
    "headings",
    "in_short",
    "step_by_area",
]

Array = NDArray[np.float64]

TITLE: Final = "Chapter 3: structural design of manipulators"
#: Largest relative deviation that counts as agreement: the chapter claims errors "on the order of a
#: few percent" (3.6).
SHARE: Final = 0.05
#: The experiments by the name under which figures find their group.
GROUPS: Final = {
    "torque": "torque of the elbow at 150 psi (3.2.4, Fig. 3.7)",
    "step": "pressure step with 100 lb (3.2.4, Fig. 3.8)",
    "triangle": "triangular pressure of 0.05 Hz with 135 lb (3.3.2, Figs. 3.12 and 3.13)",
    "ramp": "ramp of 4 s and hold of 6 s with 100 lb (3.4, Fig. 3.16)",
    "construction": "requirements, construction and tests (3.2 to 3.6)",
    "braid": "what a braid of 73.5 instead of 72.5 deg turns",
}
#: Braid angle that gives the published blocked force and the published largest diameter [deg].
STEEPER: Final = 73.5
#: Lines that are no part of the score. The rig as it is counts; (3.6)-(3.8) as printed, which
#: conserve no power, are another reading, and so are angles from the vertical. Of two lines that
#: ask one statement, the stricter counts.
APART: Final[tuple[Apart, ...]] = (
    ("elbow_0625in", "blocked force at 150 psi, thin wall .*", OTHER),
    ("elbow_0625in", "braid angle for .*", OWN),
    ("elbow_0625in", "specific blocked force at 150 psi", SAME),
    ("large_2in", "braid angle.*", OWN),
    ("large_2in_effective", ".*", OTHER),
    ("3.2.3.*", "(air|packed) volume inflated, .*|time to fill the inflated volume, .*", SAME),
    ("torque of the elbow.*", "first rotation with 200 ft lbf", SAME),
    ("torque of the elbow.*", "last rotation with 200 ft lbf, .*", OTHER),
    ("pressure step.*", "rotation swept, .*", OTHER),
    ("pressure step.*", "peak rate, valve area chosen for it", OTHER),
    ("ramp of 4 s.*", ".*, torque as printed .*", OTHER),
    ("ramp of 4 s.*", "torque of 100 lb at rest at 83 deg by .*", OWN),
    ("(shoulder|elbow): .*", "largest angle within 15 % of stroke", OWN),
    ("(shoulder|elbow): .*", "torque of Table 3.5 at the least angle", SAME),
    ("(shoulder|elbow): .*", "the same, .*", OTHER),
    ("(shoulder|elbow): .*", "pressure that .*|minimum pressure.*|worst J .*", OWN),
)
#: Numbers of the elbow rig that the dissertation does not give: the unit in which they are shown,
#: and why they are what they are.
CHOSEN: Final[dict[str, tuple[str, str]]] = {
    "valve.discharge_area_max": (
        "mm2",
        "the shoulder's valve; the make is published (Festo, 4.2.1), the size is not",
    ),
    "chamber.dead_volume": ("l", "the shoulder's: six muscles on one manifold and one hose"),
    "supply.volume": (
        "m3",
        (
            "so large that a stroke changes its pressure by less than 0.1 %: its pressure was set "
            "(4.2.1)"
        ),
    ),
    "muscle.wall_thickness": (
        "in",
        "1/16 in, the next stock size of latex tube; no wall is published",
    ),
    "arm.inertia": (
        "kg m2",
        (
            "7 kg (4.1) spread over the links' 33 in, of which forearm and hand are 20 in: 4.24 "
            "kg, m l^2/3"
        ),
    ),
    "arm.first_moment": (
        "kg m",
        "the same, m l/2; with all 7 kg in forearm and hand 1.78 kg m, 3 % more torque with 100 lb",
    ),
    "arm.viscous": ("N m s/rad", "the shoulder's, a tendon joint too"),
    "arm.coulomb": ("N m", "the shoulder's, a tendon joint too"),
    "joint.max_angle": (
        "deg",
        (
            "beyond the typical 100 deg of 4.2.1; of the chapter only the step with the rig's own "
            "valve swings into it"
        ),
    ),
}
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
        Whether the joint searches of 3.5 run too: about a minute, extra ``search``.
    progress : callable, optional
        Called with what is done next.

    Returns
    -------
    list of Comparison

    Raises
    ------
    MissingPackageError
        If a search library is missing; names the extra to install.
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
    rows = scored([*rows, *_optimised(search, tell)], APART)
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
    group = GROUPS["braid"]
    first = judge(
        group,
        f"statements of the elbow's muscle and of its arm that agree, of {len(counted)}",
        "3.2 to 3.6",
        math.nan,
        agree[1],
        relation="above",
        cannot_tell="counted",
        note=(
            f"{agree[0]} with the printed 72.5 deg of Table 3.2; the moduli are scaled to the same "
            f"free contraction; {len(turned)} lines turn, those below; 3.2.3 and 3.5 are as they "
            "are"
        ),
        apart=TRIAL,
    )
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
    from pamrs.library.published import headings as muscles

    return muscles()


def chosen() -> list[tuple[str, str, str]]:
    """Name, value with its unit, and reason of each number of :data:`CHOSEN`."""
    rig = elbow.arm_rig()
    return [
        (name, f"{rig.parameter(name).value / parse_unit(unit).scale:.4g} {unit}", reason)
        for name, (unit, reason) in CHOSEN.items()
    ]


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
    ours = Told(rows, GROUPS, 0).ours
    steeper = [row for row in rows if row.group == GROUPS["braid"]]
    braid, turned = steeper[0], len(steeper)
    blocked, stroke = "blocked force at 150 psi", "stroke of Table 3.5 over the range"
    printed = [ours(group, f"{fact}, {_PRINTED}", digits) for group, fact, digits in _LAWS_TOLD]
    conserving = [ours(group, fact, digits) for group, fact, digits in _LAWS_TOLD]
    return [
        "With angles read as rotations from the rest angle and joint torque as printed in "
        f"(3.6)-(3.8), 200 ft lbf last to {printed[0]} deg (published 78), the ramp has a largest "
        f"torque of {printed[1]} ft lbf (190) at {printed[2]} deg (83), and the step sweeps "
        f"{printed[3]} deg (90). With a torque that conserves power it is {conserving[0]} deg, "
        f"{conserving[1]} ft lbf at {conserving[2]} deg, and {conserving[3]} deg. With angles read "
        "from the vertical the range fits with neither.",
        "The blocked force of 820 lbf is met neither by the default model "
        f"({ours('elbow_0625in', blocked)} lbf) nor by the chapter's own (3.19) "
        f"({ours('elbow_0625in', blocked + ', thin wall (3.19)')} lbf); no modulus changes it. A "
        f"braid angle of {ours('elbow_0625in', 'braid angle for 820 lbf', 1)} deg instead of 72.5 "
        f"would give it, and {ours('elbow_0625in', 'braid angle for 1.75 in, cylinder', 1)} deg "
        "the published largest diameter.",
        f"With a braid of {STEEPER:g} deg {turned - 1} lines turn, and {braid.ours:.0f} of the "
        f"{braid.fact.rpartition(' ')[2]} statements of the muscle and its arm agree that can be "
        f"told, where {braid.note.partition('; ')[2].partition(' ')[0]} do with 72.5: force and "
        "diameter come, turns and length of a fibre (Table 3.3) go.",
        "The 2-in muscle of Table 3.2 contradicts itself: 2 in and 78 deg mean "
        f"{ours('large_2in', 'blocked force at 90 psi')} lbf at 90 psi, not 4280.",
        "The peak rate of the step is decided by a valve area that is not published, and with an "
        "area that gives it the mean rate is "
        f"{ours('step', 'mean rate over 90 deg, the same valve')} deg/s, not 60.",
        f"Table 3.5's lengths need {ours('shoulder: 6 pam_a_1in at 190 psi', stroke, 1)} and "
        f"{ours('elbow: 8 pam_b_075in at 150 psi', stroke, 1)} % of stroke where (3.26) allows 15 "
        "%.",
    ]


class _Group:
    """Collects the statements about one experiment."""

    def __init__(self, name: str) -> None:
        self.title, self.rows = GROUPS[name], list[Comparison]()

    def say(
        self, fact: str, where: str, published: float, ours: float, unit: str = "", **more: Any
    ) -> None:
        """Judge one statement, within :data:`SHARE` unless told."""
        more.setdefault("tolerance", SHARE * abs(published) if math.isfinite(published) else 0.0)
        self.rows.append(judge(self.title, fact, where, published, ours, unit, **more))


def _muscle() -> Muscle:
    muscle = elbow.arm_rig().muscle
    assert muscle is not None
    return muscle


# ------------------------------------------------------------------- 3.2.2 and 3.2.3


def _muscles() -> list[Comparison]:
    """What the library knows of the chapter's two muscles, and six of the one against two of the
    other.
    """
    from pamrs.design.elbow_muscles import compare_design
    from pamrs.library.published import compare

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
    group = _Group("torque")
    _torque_at_rest(group)
    _range_of_torque(group, *_ranges())
    _torque_overall(group)
    return group.rows


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


def _torque_at_rest(group: _Group) -> None:
    """Where the range begins: the rest angle, and the torque there."""
    rest = elbow.rest_angle()
    at_rest = float(elbow.elbow_torque(0.0)) / FOOT_POUND
    blocked = float(_muscle().force(150.0 * PSI, 0.0)) / to_si(1.0, "lbf", "force")
    steep = np.degrees(
        elbow.torque_range(
            partial(elbow.elbow_torque, law="printed", muscle=elbow.steeper_braid()), _LEAST
        )
    )
    group.say(
        "rest angle of the lower link from the vertical",
        "3.3.1 against l0, r0, lT of 3.2.4",
        10.0,
        math.degrees(rest),
        "deg",
        tolerance=1.0,
        note="'directed 10 deg forward': given in whole tens of degrees",
    )
    group.say(
        "torque where the range begins, at rest length",
        "3.2.4: above 200 ft-lb from 0 deg",
        200.0,
        at_rest,
        "ft lbf",
        relation="above",
        note=(
            f"our blocked force is {blocked:.0f} lbf, with the published 820 lbf it would be "
            f"{at_rest * 820.0 / blocked:.0f}; a braid of 73.5 deg has that force (and 200 ft lbf "
            f"from {steep[0]:.1f} to {steep[1]:.1f} deg, torque as printed)"
        ),
    )


def _range_of_torque(group: _Group, ranges: dict[str, Array], own: dict[float, Array]) -> None:
    """Rotations between which there are 200 ft lbf: as we have the torque, as printed, and read
    otherwise.
    """
    rest, end = elbow.rest_angle(), math.radians(_RANGE)
    at_end = {law: float(elbow.elbow_torque(end, law=law)) / FOOT_POUND for law in elbow.LAWS}
    low, high = (float(elbow.elbow_torque(end, law="printed", psi=psi)) for psi in (50.0, 150.0))
    upright = float(elbow.elbow_torque(end - rest, law="printed")) / FOOT_POUND
    figure = "3.2.4, Fig. 3.7"
    group.say(
        "first rotation with 200 ft lbf",
        figure,
        0.0,
        ranges["conserving"][0],
        "deg",
        tolerance=SHARE * _RANGE,
        note=(
            f"printed torque law: {ranges['printed'][0]:.1f} deg; with the muscle of (3.21) too: "
            f"{own[0.5][0]:.1f} deg"
        ),
    )
    group.say(
        _LAST,
        figure,
        _RANGE,
        ranges["conserving"][1],
        "deg",
        note=(
            f"at {_RANGE:g} deg our torque is {at_end['conserving']:.0f} ft lbf; (3.6)-(3.8) as "
            "printed are smaller by the square of the cosine of the tendon's angle, there by "
            f"{100.0 * (1.0 - at_end['printed'] / at_end['conserving']):.0f} %: next line"
        ),
    )
    group.say(
        f"{_LAST}, {_PRINTED}",
        figure,
        _RANGE,
        ranges["printed"][1],
        "deg",
        note=(
            f"{50.0 + 100.0 * (_LEAST - low) / (high - low):.0f} psi instead of 150 would give "
            f"exactly {_RANGE:g} deg"
        ),
    )
    group.say(
        f"{_LAST}, as printed, with the muscle of (3.21)",
        figure,
        _RANGE,
        own[0.5][1],
        "deg",
        note=(
            "Gaylord less Mooney-Rivlin; constants (not printed) equal, from the free contraction "
            f"to 63 %: {own[1.0][1]:.1f} deg with C01 alone, {own[0.0][1]:.1f} with C10 alone"
        ),
    )
    group.say(
        f"{_LAST}, printed torque, angle from the vertical",
        figure,
        _RANGE,
        ranges["printed"][1] + math.degrees(rest),
        "deg",
        note=(
            f"read so, the torque at {_RANGE:g} deg would be {upright:.0f} ft lbf; rotation from "
            "the rest angle is what fits"
        ),
    )


def _torque_overall(group: _Group) -> None:
    """The largest torque, and what a seventh muscle adds."""
    rotation = np.linspace(0.0, 100.0, 401)
    torque = elbow.elbow_torque(np.radians(rotation)) / FOOT_POUND
    group.say(
        "largest torque",
        "3.6: in excess of 200 ft-lb",
        200.0,
        float(torque.max()),
        "ft lbf",
        relation="above",
        note=f"at {rotation[torque.argmax()]:.0f} deg of rotation",
    )
    ends = {
        n: np.degrees(elbow.torque_range(partial(elbow.elbow_torque, count=n), _LEAST))
        for n in (6, 7, 8, 10)
    }
    group.say(
        "range gained with seven muscles over torque gained",
        "3.2.4: 'only modestly increased'",
        0.5,
        float(np.ptp(ends[7]) / np.ptp(ends[6]) - 1.0) * 6.0,
        relation="below",
        note="'modestly' read as less than half in proportion; 200 ft lbf with "
        + ", ".join(f"{n} muscles from {a:.1f} to {b:.1f} deg" for n, (a, b) in ends.items()),
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
    group, peak = _Group("step"), math.radians(200.0)
    ours, fitted = elbow.step(), elbow.step(elbow.valve_for_peak(peak))
    _rotation_of_step(group, ours, fitted)
    _rates_of_step(group, ours, fitted, peak)
    return group.rows


def _rotation_of_step(group: _Group, ours: elbow.Step, fitted: elbow.Step) -> None:
    """How far the arm turns."""
    figure = "3.2.4, Fig. 3.8"
    group.say(
        "rotation swept",
        figure,
        90.0,
        math.degrees(ours.swept),
        "deg",
        note=(
            "where the arm comes to rest; with the valve chosen below it swings to "
            f"{math.degrees(fitted.first_turn):.0f} deg first"
        ),
    )
    group.say(
        f"rotation swept, {_PRINTED}",
        figure,
        90.0,
        math.degrees(elbow.rotation_reached(100.0, 150.0, law="printed")),
        "deg",
    )


def _rates_of_step(group: _Group, ours: elbow.Step, fitted: elbow.Step, peak: float) -> None:
    """How fast it turns, with the rig's valve and with one chosen for a peak rate [rad/s]."""
    figure = "3.2.4, Fig. 3.8"
    spread = [
        1e6 * elbow.valve_for_peak(peak, law="conserving", **change)
        for change in (*_FRICTION, *_DEAD, _HEAVY)
    ]
    slow = max(
        (item for item in step_by_area() if item.mean < math.radians(57.3)),
        key=lambda item: item.area,
    )
    group.say(
        "peak rate with the rig's valve",
        figure,
        200.0,
        math.degrees(ours.peak),
        "deg/s",
        cannot_tell=(
            f"no valve area is published; the rig's, {1e6 * ours.area:.1f} mm2, is the shoulder's"
        ),
    )
    group.say(
        "peak rate, valve area chosen for it",
        figure,
        200.0,
        math.degrees(fitted.peak),
        "deg/s",
        used=True,
        note=(
            f"{1e6 * fitted.area:.2f} mm2 effective; {min(spread):.2f} to {max(spread):.2f} mm2 "
            "with no to twice the rig's friction or dead volume, or all 7 kg in the forearm"
        ),
    )
    group.say(
        "mean rate over 90 deg, the same valve",
        figure,
        60.0,
        math.degrees(fitted.mean),
        "deg/s",
        note=(
            f"ours passes 90 deg in its first swing, at {fitted.arrival:.2f} s; with "
            f"{1e6 * slow.area:.2f} mm2 (peak {math.degrees(slow.peak):.0f} deg/s) that swing "
            f"turns at {math.degrees(slow.first_turn):.0f} deg and 90 deg are reached at "
            f"{slow.arrival:.2f} s, a mean of {math.degrees(slow.mean):.0f} deg/s: the mean hangs "
            "on whether the first swing gets there"
        ),
    )
    group.say(
        "mean rate over 90 deg against the design goal",
        "Table 3.1, 3.2.4: 'meets the criterion'",
        57.3,
        math.degrees(fitted.mean),
        "deg/s",
        relation="above",
    )


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
    group = _Group("triangle")
    static, printed = (elbow.static_curve(135.0, law=law) for law in elbow.LAWS)
    _rates_of_triangle(group, static, printed)
    _loops_of_triangle(group, static)
    return group.rows


def _rates_of_triangle(
    group: _Group, static: elbow.StaticCurve, printed: elbow.StaticCurve
) -> None:
    """The rate where the arm sets off, at its largest, and at the top of the pressure."""
    from pamrs.library.evaluate import activation_pressure

    speed = 150.0 / 10.0  # psi/s
    rate = np.degrees(static.slope) * speed
    rubber = activation_pressure(_muscle()) / PSI
    joint, rest = (
        Joint.from_model(elbow.arm_rig().model["joint"]),
        float(_muscle().parameters["rest_length"]),
    )
    contraction = float(joint.shortening(elbow.rest_angle() + static.rotation[-1])) / rest
    group.say(
        "largest rate over the rate when the arm sets off",
        "3.3.2: 'increases significantly'",
        1.0,
        float(rate.max() / rate[0]),
        relation="above",
        note=(
            f"lifted slowly: {rate[0]:.1f} deg/s at {static.psi[0]:.0f} psi, {rate.max():.1f} at "
            f"{static.psi[rate.argmax()]:.0f} psi; in ours the payload keeps the arm down to "
            f"{static.psi[0]:.0f} psi, the rubber only to {rubber:.0f} psi (2.2.2: about 10)"
        ),
    )
    group.say(
        "rate at the top of the pressure over the largest",
        "3.3.2: 'decreases to zero'",
        0.0,
        float(rate[-1] / rate.max()),
        tolerance=SHARE,
        note=(
            f"{rate[-1]:.1f} deg/s (printed torque law "
            f"{math.degrees(printed.slope[-1]) * speed:.1f}): at 150 psi our muscles are shortened "
            f"by {100.0 * contraction:.0f} %, where the payload holds them, not by their largest "
            "contraction of 37 %"
        ),
    )


def _loops_of_triangle(group: _Group, static: elbow.StaticCurve) -> None:
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
    group.say(
        "rotation at the same pressure, falling less rising",
        "3.3.2: 'slightly asymmetrical'",
        0.0,
        turned,
        "deg",
        relation="above",
        note=(
            "mean from 40 to 145 psi with the hysteresis (2.36) of the 0.75-in muscle, c_F = 0.16 "
            f"- 0.145 P[MPa]: none is published for this one; without it {turned_plain:.1f} deg"
        ),
    )
    group.say(
        "torque (3.24) at the same pressure, falling less rising",
        "3.3.2, Fig. 3.13: 'hysteresis'",
        0.0,
        loop,
        "ft lbf",
        relation="above",
        note=f"as the line above; without hysteresis {loop_plain:.1f} ft lbf",
    )
    group.say(
        "torque (3.24) at 150 psi over that at 75 psi",
        "3.3.2, Fig. 3.13: 'increases with pressure'",
        1.0,
        float(upper / lower),
        relation="above",
        note=f"{lower:.0f} and {upper:.0f} ft lbf; 135 lb at 20 in are 225 at most",
    )


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
    group, figure = _Group("ramp"), "3.4, Fig. 3.16"
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
        group.say("largest torque" + words, figure, 190.0, torque, "ft lbf", note=note)
        at_rest = math.degrees(elbow.rotation_reached(100.0, 145.0, law=law))
        group.say(
            "rotation at the largest torque" + words,
            figure,
            83.0,
            rotation,
            "deg",
            note=f"at rest {at_rest:.1f} deg",
        )
    static = (
        float(elbow.payload_torque(100.0, elbow.rest_angle() + math.radians(83.0))) / FOOT_POUND
    )
    leaving = float(elbow.static_curve(100.0).psi[0])
    group.say(
        "torque of 100 lb at rest at 83 deg by (3.24)",
        "3.4 against (3.24)",
        190.0,
        static,
        "ft lbf",
        cannot_tell="the text does not say whether 190 ft-lb is (3.24) or the model's",
        note=(
            f"100 lb at 20 in are never more than 166.7; {20.0 * 190.0 / static:.1f} in would be "
            "needed: a swing, or another lever"
        ),
    )
    group.say(
        "pressure reached",
        figure,
        145.0,
        145.0,
        "psi",
        cannot_tell=(
            "a limit of the pressure regulator, which is no part of the rig; the pressure is "
            "prescribed"
        ),
    )
    group.say(
        "delay until the pressure rises, from 10 psi of deadband",
        figure,
        0.5,
        10.0 / (150.0 / 4.0),
        "s",
        cannot_tell=(
            "the dissertation against itself: 10 psi are 0.27 s of this ramp, the delay is given "
            "as 0.5 to 1 s"
        ),
        note=(
            f"in ours the payload keeps the arm on its stop until {leaving:.0f} psi, "
            f"{leaving / (150.0 / 4.0):.2f} s"
        ),
    )
    return group.rows


# ----------------------------------------------------------------- 3.2.1, 3.2.5 and 3.3


def _construction() -> list[Comparison]:
    """What is said of the arm as it was built."""
    group = _Group("construction")
    _payloads(group)
    _bending(group)
    _not_modelled(group)
    return group.rows


def _payloads(group: _Group) -> None:
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
    group.say(
        "payload of one arm of two that lift 316 lb",
        "3.2.1",
        158.0,
        limit / POUND,
        "lb",
        cannot_tell="where the weight lies on the arms is not said",
        note=(
            "ours at the tip, over 90 deg at 150 psi; 200 ft-lb of each arm bear half of 316 lb at "
            f"{lever:.1f} in, not at 20"
        ),
    )
    group.say(
        "largest payload tested",
        "3.3.2",
        380.0,
        math.nan,
        "lb",
        cannot_tell="on which joint and how far is not said",
        note=(
            f"ours lifts 380 lb at the elbow by {lifted:.1f} deg at 150 psi; at the wrist, 7 in, "
            f"it is {wrist:.0f} ft lbf at most"
        ),
    )


def _bending(group: _Group) -> None:
    """A cantilever of steel, 200 GPa, under a force at its end."""
    moment = to_si(500.0, "lbf", "force") * (33.0 * INCH) ** 3 / (3.0 * 200e9 * 0.5 * INCH)
    bar = (64.0 * moment / math.pi) ** 0.25
    group.say(
        "bending under 500 lb at the tip",
        "3.2.5: not more than 0.5 in",
        0.5,
        math.nan,
        "in",
        relation="below",
        cannot_tell="links are rigid here, and no section is published",
        note=(
            f"a steel cantilever of 33 in needs {1e8 * moment:.0f} cm4 for it, as a round bar of "
            f"{1e3 * bar:.0f} mm has"
        ),
    )


def _not_modelled(group: _Group) -> None:
    """What no simulation of ours can tell."""
    for fact, where, value, unit, reason in (
        (
            "safety factor of the joints at the largest torque",
            "3.2.5",
            1.5,
            "",
            "stresses of the structure are not modelled",
        ),
        (
            "pressure without catastrophic failure",
            "3.2.2",
            1000.0,
            "psi",
            "bursting is not modelled",
        ),
        ("cycles to full contraction without change", "3.2.2", 3000.0, "", "wear is not modelled"),
        (
            "static torque, model against measurement",
            "3.6, Fig. 3.15",
            math.nan,
            "",
            "measured torques are in the figure only",
        ),
        (
            "force, model against measurement",
            "3.4, Figs. 3.1, 3.3, 3.14",
            math.nan,
            "",
            "measured forces are in the figures only",
        ),
    ):
        group.say(fact, where, value, math.nan, unit, relation="above", cannot_tell=reason)


# ----------------------------------------------------------------------------------- 3.5


def _optimised(search: bool, tell: Progress) -> list[Comparison]:
    """The joints of Table 3.5, and with ``search`` what the searches find."""
    from reproduction.joints import CASES, facts_of_geometry, facts_of_search

    rows: list[Comparison] = []
    for case in CASES:
        tell(f"chapter 3: {case.name} of Table 3.5")
        rows += facts_of_geometry(case)
        if search:
            rows += facts_of_search(case, progress=tell)
    return rows
