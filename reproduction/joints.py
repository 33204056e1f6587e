"""The two joints of dissertation 3.5 (Tables 3.4 and 3.5): what is printed beside what the package
gives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import radians
from typing import Final

import numpy as np

from pamrs.design import LENGTHS, JointDesign, JointProblem, least_pressure
from pamrs.library import entry
from pamrs.units import to_si
from reproduction.comparison import Comparison
from reproduction.joint_search import designed, minimum_pressure, objectives
from reproduction.statements import Lines, Statements

_FOOT_POUND: Final = to_si(1.0, "ft lbf", "torque")
_PSI: Final = to_si(1.0, "psi", "pressure")
_INCH: Final = 0.0254

say: Final = Statements("chapter3")

_BRAID: Final = "braid's force alone"
_MODULI = {
    ("shoulder"): (
        "the muscle's moduli are not published; the library's are chosen by 6.3 (850 N m at 13 "
        "bar, 90 deg)"
    ),
    "elbow": "the muscle's moduli are not published; the library's are a prior for its rubber",
}


@dataclass(frozen=True)
class PublishedCase:
    """One joint of Tables 3.4 and 3.5.

    Attributes
    ----------
    name : str
        Joint.
    muscle : str
        Muscle of the library with the printed diameter and length.
    count : int
        Muscles.
    torque : float
        Wanted [ft lbf].
    angles : (float, float)
        Range [deg].
    pressure : float
        Found [psi].
    muscle_length : float
        [in].
    lengths : (float, float, float, float)
        ``lu, ru, ll, rl`` [in].
    """

    name: str
    muscle: str
    count: int
    torque: float
    angles: tuple[float, float]
    pressure: float
    muscle_length: float
    lengths: tuple[float, float, float, float]

    @property
    def title(self) -> str:
        """The group of its statements."""
        return f"{self.name}: {self.count} {self.muscle} at {self.pressure:g} psi"

    def problem(self) -> JointProblem:
        """The design problem in SI units, in the package's bounds (none are printed)."""
        first, last = (radians(value) for value in self.angles)
        return JointProblem(
            entry(self.muscle).muscle,
            self.count,
            self.torque * _FOOT_POUND,
            first,
            last,
            self.pressure * _PSI,
            points=_points(self),
        )

    def design(self, problem: JointProblem | None = None) -> JointDesign:
        """The printed geometry, in this joint's own problem unless told."""
        return JointDesign.of(problem or self.problem(), np.array(self.lengths) * _INCH)


def _points(case: PublishedCase) -> int:
    """One for each degree."""
    return 1 + round(case.angles[1] - case.angles[0])


#: The joints; the elbow's muscle is the 0.75-in one of Table 6.1, whose length (12.5 cm) is that of
#: Table 3.5.
CASES: Final = (
    PublishedCase(
        "shoulder", "pam_a_1in", 6, 788.0, (15.0, 120.0), 190.0, 10.88, (1.00, 1.08, 1.08, 0.19)
    ),
    PublishedCase(
        "elbow", "pam_b_075in", 8, 362.0, (10.0, 80.0), 150.0, 4.94, (0.70, 0.70, 1.15, -0.20)
    ),
)


def facts_of_geometry(case: PublishedCase) -> list[Comparison]:
    """What the printed geometry does with the library's muscle, without any search.

    Parameters
    ----------
    case : PublishedCase
        One of :data:`CASES`.

    Returns
    -------
    list of Comparison
    """
    problem, printed, rows = case.problem(), case.design(), say.lines(case.title)
    _lengths(rows, case, problem, printed)
    _torques(rows, case, problem, printed)
    _pressures(rows, case, problem)
    if case.name == "shoulder":
        # 6.3 states the torque at 13 bar up to 90 deg, of the same joint
        at = float(printed.joint.torque(problem.muscle, 13e5, radians(90.0), count=case.count))
        rows.say("joint_torque_13_bar", at, published=case.torque * _FOOT_POUND)
    return rows


def _lengths(rows: Lines, case: PublishedCase, problem: JointProblem, printed: JointDesign) -> None:
    """The muscle's length, its stroke, and the angle within the largest stroke: geometry alone."""
    length = problem.muscle.parameters["rest_length"] / _INCH
    published = case.muscle_length
    rows.say("joint_length", length, published=published, tolerance=0.01 * abs(published))
    rows.say("joint_stroke", 100.0 * float(printed.scores.contraction[0].max()))
    reached, last = float(np.degrees(printed.scores.max_angle[0])), case.angles[1]
    rows.say("joint_angle", reached, published=last, tolerance=0.02 * abs(last))


def _torques(rows: Lines, case: PublishedCase, problem: JointProblem, printed: JointDesign) -> None:
    """The torque of the printed lengths, with the library's muscle and with others."""
    torque, wanted = printed.scores.torque[0] / _FOOT_POUND, case.torque
    needed = _angle_needed(case, problem, torque[0])
    rows.say("joint_torque_at_rest", torque[0], needed, published=wanted)
    others = {
        title: float(case.design(other).scores.torque[0].min() / _FOOT_POUND)
        for title, other in _others(case, problem)
    }
    bound = others[_BRAID] < wanted
    rows.say(
        "joint_least_torque",
        torque.min(),
        "" if bound else _MODULI[case.name],
        f"no moduli give it: without any rubber it is {others[_BRAID]:.0f} ft lbf" if bound else "",
        published=wanted,
    )
    for title, least in others.items():
        note = "no rubber at all: with this braid angle no moduli give it"
        rows.say(
            "joint_torque_otherwise",
            least,
            title,
            note if title == _BRAID and bound else "",
            published=wanted,
        )


def _pressures(rows: Lines, case: PublishedCase, problem: JointProblem) -> None:
    """The pressure that the printed lengths need, and the least that any joint needs."""
    unknown, printed = _MODULI[case.name], case.pressure
    free = case.design(problem.replace(max_contraction=0.3))
    needed = (free.needed_pressure or np.nan) / _PSI
    rows.say("joint_pressure_needed", needed, unknown, published=printed)
    least = problem.least_possible_pressure() / _PSI
    rows.say("joint_pressure_by_work", least, unknown, published=printed)


def facts_of_search(
    case: PublishedCase, *, seeds: int = 10, progress: Callable[[str], None] | None = None
) -> list[Comparison]:
    """What the searches find; takes about half a minute.

    Parameters
    ----------
    case : PublishedCase
        One of :data:`CASES`.
    seeds : int
        Runs behind the spread of the genetic algorithm.
    progress : callable, optional
        Called with what is done next.

    Returns
    -------
    list of Comparison
    """
    tell = progress or (lambda _: None)
    problem = case.problem()
    unknown = _MODULI[case.name]
    tell(f"{case.name}: minimum pressure")
    outer = minimum_pressure(problem)
    direct = least_pressure(problem)
    tell(f"{case.name}: with Table 3.5's lengths as least ones")
    least = {
        name: (value * _INCH, problem.bounds[name][1])
        for name, value in zip(LENGTHS[:3], case.lengths[:3], strict=True)
    }
    second = least_pressure(problem.replace(bounds=least))
    tell(f"{case.name}: spread of the genetic algorithm")
    reachable = problem.replace(pressure=1.1 * (outer.pressure or problem.pressure))
    values = objectives(reachable, "ga", range(seeds))
    best = designed(reachable, "cma").scores.fitness[0]
    rows = say.lines(case.title)
    for title, found in (
        ("GA and bisection", outer.design if outer.met else None),
        ("direct search", direct),
    ):
        value = np.nan if found is None else found.problem.pressure / _PSI
        rows.say("joint_minimum_pressure", value, title, unknown, published=case.pressure)
    if direct is not None and second is not None:
        first, later = direct.problem.pressure / _PSI, second.problem.pressure / _PSI
        rows.say("joint_larger_parts", later, published=first)
    rows.say("joint_worst_J", values.max() / best, seeds)
    return rows


def _angle_needed(case: PublishedCase, problem: JointProblem, torque: float) -> str:
    """The braid angle with which the rest torque is the wanted one, in words; empty where it is
    there already.
    """
    from reproduction.muscles.evaluate import root_between

    if torque >= case.torque:
        return ""
    force = float(problem.muscle.force(problem.pressure, 0.0)) * case.torque / torque
    found = root_between(
        lambda angle: (
            float(problem.muscle.replace(braid_angle=angle).force(problem.pressure, 0.0)) - force
        ),
        radians(60.0),
        radians(85.0),
    )
    given = np.degrees(problem.muscle.parameters["braid_angle"])
    return (
        ""
        if found is None
        else f"; a braid angle of {np.degrees(found):.1f} deg instead of {given:.4g} would give it"
    )


def _others(case: PublishedCase, problem: JointProblem) -> list[tuple[str, JointProblem]]:
    """The problem with other readings of its muscle."""
    muscle = problem.muscle
    if case.name == "shoulder":
        braid = muscle.replace(model="gaylord", braid_angle=radians(75.4))
        return [
            (_BRAID, problem.replace(muscle=muscle.replace(model="gaylord"))),
            ("braid's force alone, 75.4 deg (ch. 5: N 0.9)", problem.replace(muscle=braid)),
        ]
    other = entry("ch2_075in").muscle.replace(rest_length=case.muscle_length * _INCH)
    return [
        (_BRAID, problem.replace(muscle=muscle.replace(model="gaylord"))),
        ("muscle ch2_075in, 4.94 in long", problem.replace(muscle=other)),
    ]
