"""The design problem of dissertation 3.5: which four lengths let a bundle turn a tendon joint with
a wanted torque.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from pamrs._arrays import Array, ArrayLike, Mask
from pamrs._checks import check_names, one_of, positive, refused, whole
from pamrs.errors import ParameterError
from pamrs.rig import Joint, Muscle

#: The four lengths, in the order of a design's columns.
LENGTHS: Final = ("upper_axial", "upper_offset", "lower_axial", "lower_offset")

#: Their names in Table 3.5.
SYMBOLS: Final = ("lu", "ru", "ll", "rl")

#: Where the lengths are looked for unless given [m]; the dissertation prints no bounds.
DEFAULT_BOUNDS: Final[dict[str, tuple[float, float]]] = {
    "upper_axial": (0.0127, 0.0635),
    "upper_offset": (0.0127, 0.0635),
    "lower_axial": (0.0127, 0.0635),
    "lower_offset": (-0.0127, 0.0254),
}

# [Pa], stands for "no pressure is enough"; larger the less of the range is reached
_HOPELESS: Final = 1e10


@dataclass(frozen=True)
class Scores:
    """Objective of some designs and its parts; every array has one row for each design.

    Attributes
    ----------
    fitness : (n,) array
        ``J`` of (3.25) [J]; smaller is better.
    area_below, area_above : (n,) array
        Areas between the torque and the threshold over the angle, below and above the threshold
        [J].
    max_angle : (n,) array
        Largest angle, not above the required one, up to which the muscles can turn the joint [rad].
    available : (n,) bool array
        Whether that is the required angle, so that there is no penalty (3.26).
    torque : (n, points) array
        Torque of the bundle [N m]; 0 where the joint has no such angle or the muscle cannot pull.
    contraction : (n, points) array
        Contraction ratio [1]; NaN where the joint has no such angle.
    """

    fitness: Array
    area_below: Array
    area_above: Array
    max_angle: Array
    available: Mask
    torque: Array
    contraction: Array


@dataclass(frozen=True)
class JointProblem:
    """One joint to be designed: muscles, wanted torque and range, and where its lengths may lie.

    The objective is (3.25), (3.26): ``J = A_b + weight_above A_t + PF`` with the areas in N m rad =
    J, the work that is missing or left over; ``PF`` is ``penalty`` where the muscles cannot turn
    the joint up to ``max_angle``. They can as far as the tendon reaches, the moment arm is
    positive, and the contraction is at most ``max_contraction`` and within the braid's limits. The
    muscles are at rest length at ``min_angle``. A muscle pulls or is slack, so a negative force
    counts as none.

    Parameters
    ----------
    muscle : Muscle
        One of them. Its force is that of contraction without friction.
    count : int
        Muscles in parallel.
    torque : float
        Wanted over the whole range [N m].
    min_angle, max_angle : float
        The range [rad].
    pressure : float
        Gauge pressure [Pa].
    bounds : mapping of str to (float, float)
        Lowest and highest value of each of :data:`LENGTHS` [m]; equal ones fix a length. Those left
        out keep :data:`DEFAULT_BOUNDS`.
    max_contraction : float
        Largest stroke over the rest length [1]; 15 % in the text.
    penalty : float
        ``PF`` [J].
    weight_above : float
        Weight of the area above the threshold [1].
    kind : {"tendon", "published"}
        Torque of the joint: power-conserving, or as printed in (3.6)-(3.8).
    points : int
        Angles at which the torque is evaluated.

    Raises
    ------
    ParameterError
        If a value is not possible; the message names it.
    """

    muscle: Muscle
    count: int
    torque: float
    min_angle: float
    max_angle: float
    pressure: float
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    max_contraction: float = 0.15
    penalty: float = 1e4
    weight_above: float = 0.01
    kind: str = "tendon"
    points: int = 106

    def __post_init__(self) -> None:
        whole("count", self.count, 1)
        whole("points", self.points, 3)
        for name in ("torque", "pressure", "max_contraction"):
            positive(name, getattr(self, name))
        for name in ("penalty", "weight_above"):
            positive(name, getattr(self, name), zero=True)
        if not (-math.pi <= self.min_angle < self.max_angle <= math.pi):
            raise ParameterError(
                f"min_angle = {self.min_angle}, max_angle = {self.max_angle} are not allowed: "
                "angles from -pi to pi rad, the first below the second, are needed"
            )
        one_of("kind", self.kind, ("tendon", "published"))
        object.__setattr__(self, "bounds", _checked_bounds(self.bounds))

    # ---------------------------------------------------------------- what follows

    @property
    def angles(self) -> Array:
        """Angles at which the torque is evaluated [rad], (points,)."""
        return np.linspace(self.min_angle, self.max_angle, self.points)

    @property
    def lower(self) -> Array:
        """Lowest value of each length [m], (4,)."""
        return np.array([self.bounds[name][0] for name in LENGTHS])

    @property
    def upper(self) -> Array:
        """Highest value of each length [m], (4,)."""
        return np.array([self.bounds[name][1] for name in LENGTHS])

    @property
    def required_area(self) -> float:
        """Area under the threshold, the work wanted [J]."""
        return self.torque * (self.max_angle - self.min_angle)

    @property
    def max_stroke(self) -> float:
        """Largest stroke allowed [m]."""
        return self.max_contraction * float(self.muscle.parameters["rest_length"])

    def replace(self, **changes: Any) -> JointProblem:
        """Copy of the problem with other parameters."""
        return replace(self, **changes)

    def joint(self, design: ArrayLike) -> Joint:
        """The joint with these four lengths.

        Parameters
        ----------
        design : array_like, shape (4,)
            In the order of :data:`LENGTHS` [m].

        Returns
        -------
        Joint
        """
        row = self._rows(design)[0]
        return Joint(
            kind=self.kind,
            rest_angle=self.min_angle,
            **dict(zip(LENGTHS, row.tolist(), strict=True)),
        )

    # ------------------------------------------------------------------ evaluation

    def evaluate(self, designs: ArrayLike) -> Scores:
        """The objective of some designs, its parts, and the torque.

        Parameters
        ----------
        designs : array_like, shape (n, 4) or (4,)
            Lengths in the order of :data:`LENGTHS` [m], inside the bounds or not.

        Returns
        -------
        Scores
            All finite but ``contraction``.

        Raises
        ------
        ParameterError
            If the shape is another, a length is not finite, or an axial length is not above zero.
        """
        contraction, arm, torque_arm, held = self._motion(designs)
        torque = np.zeros(contraction.shape)
        pulled = np.maximum(self.muscle.force(self.pressure, contraction[held]), 0.0)
        torque[held] = self.count * pulled * torque_arm[held]
        below, above = _areas(self.angles, torque - self.torque)
        reached = self._turned(contraction, arm, held)
        steps = np.cumprod(reached, axis=1).sum(axis=1)
        available = steps == self.points
        largest = self.angles[np.maximum(steps, 1) - 1]
        fitness = below + self.weight_above * above + np.where(available, 0.0, self.penalty)
        return Scores(fitness, below, above, largest, available, torque, contraction)

    def needed_pressure(self, designs: ArrayLike) -> Array:
        """Smallest pressure at which a design gives the wanted torque at every angle [Pa].

        Every force model is a straight line in pressure, so this needs no search.

        Parameters
        ----------
        designs : array_like, shape (n, 4) or (4,)
            Lengths in the order of :data:`LENGTHS` [m].

        Returns
        -------
        ndarray, shape (n,)
            1e10 Pa and more for a design that no pressure makes good; the more the less of its
            range it can be turned over.
        """
        contraction, arm, torque_arm, held = self._motion(designs)
        turned = self._turned(contraction, arm, held) & (torque_arm > 0.0)
        usable = np.where(turned, contraction, 0.0)
        passive = self.muscle.force(0.0, usable)
        slope = (self.muscle.force(self.pressure, usable) - passive) / self.pressure
        turned &= slope > 0.0
        pull = self.torque / (self.count * np.where(turned, torque_arm, 1.0))
        each = np.where(turned, (pull - passive) / np.where(turned, slope, 1.0), 0.0)
        missing = 1.0 - turned.mean(axis=1)
        return np.asarray(
            np.where(missing > 0.0, _HOPELESS * (1.0 + missing), np.maximum(each.max(axis=1), 0.0))
        )

    def size(self, designs: ArrayLike) -> Array:
        """Radius about the joint's axis that holds both ends of the tendon at every angle [m].

        ``max(hypot(lu + d_max, ru), hypot(ll, rl))``: the muscle's end moves away from the axis by
        its stroke ``d``.

        Parameters
        ----------
        designs : array_like, shape (n, 4) or (4,)
            Lengths in the order of :data:`LENGTHS` [m].

        Returns
        -------
        ndarray, shape (n,)
        """
        rows = self._rows(designs)
        contraction = self._motion(rows)[0]
        stroke = np.where(np.isnan(contraction), 0.0, contraction).max(axis=1) * float(
            self.muscle.parameters["rest_length"]
        )
        return np.asarray(
            np.maximum(np.hypot(rows[:, 0] + stroke, rows[:, 1]), np.hypot(rows[:, 2], rows[:, 3]))
        )

    def least_possible_pressure(self, area_tolerance: float = 0.0) -> float:
        """Pressure below which no joint of any shape can meet the requirement [Pa].

        The work wanted must come out of the muscles' stroke:
        ``torque * range <= count * integral F dd``. A joint whose moment arm fits the muscle at
        every angle would need just this pressure.

        Parameters
        ----------
        area_tolerance : float
            Share of the work wanted that may be missing [1].
        """
        from scipy.integrate import cumulative_trapezoid

        highest = min(self.max_contraction, self.muscle.contraction_limits[1])
        contraction = np.linspace(0.0, highest, 2001)
        length = float(self.muscle.parameters["rest_length"])
        passive = self.muscle.force(0.0, contraction)
        slope = (self.muscle.force(self.pressure, contraction) - passive) / self.pressure
        work, work_slope = (
            cumulative_trapezoid(values, contraction * length, initial=0)
            for values in (passive, slope)
        )
        possible = work_slope > 0.0
        needed = (
            (1.0 - area_tolerance) * self.required_area / self.count - work[possible]
        ) / work_slope[possible]
        return float(needed.min())

    def _rows(self, designs: ArrayLike) -> Array:
        rows = np.atleast_2d(np.asarray(designs, dtype=np.float64))
        if rows.ndim != 2 or rows.shape[1] != len(LENGTHS):
            raise ParameterError(
                f"designs has shape {rows.shape}: rows of {', '.join(LENGTHS)} are needed"
            )
        if not np.all(np.isfinite(rows)):
            raise ParameterError("designs must hold finite lengths")
        if np.any(rows[:, [0, 2]] <= 0.0):
            raise ParameterError("designs must hold axial lengths above 0 m")
        return rows

    def _motion(self, designs: ArrayLike) -> tuple[Array, Array, Array, Mask]:
        """Contraction, moment arm and torque arm at every angle (n, points), NaN out of reach, and
        where the muscle's model holds.
        """
        rows = self._rows(designs)
        length = float(self.muscle.parameters["rest_length"])
        contraction, arm, torque_arm = (np.full((len(rows), self.points), np.nan) for _ in range(3))
        angles = self.angles
        for index, row in enumerate(rows):
            try:
                joint = self.joint(row)
            except ParameterError:
                continue  # the tendon would be folded over at the least angle: out of reach
            reached = joint.reaches(angles)
            contraction[index, reached] = joint.shortening(angles[reached]) / length
            arm[index, reached] = joint.moment_arm(angles[reached])
            torque_arm[index, reached] = joint.torque_arm(angles[reached])
        lowest, highest = self.muscle.contraction_limits
        with np.errstate(invalid="ignore"):
            held = (contraction >= lowest) & (contraction <= highest)
        return contraction, arm, torque_arm, held

    def _turned(self, contraction: Array, arm: Array, held: Mask) -> Mask:
        """True where the muscles can turn the joint: reached, with an arm above zero, not
        contracted too far.
        """
        with np.errstate(invalid="ignore"):
            return np.asarray(
                held & (arm > 0.0) & (contraction <= self.max_contraction * (1.0 + 1e-12))
            )


def _checked_bounds(given: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """Check the bounds of every length."""
    check_names("bounds", given, LENGTHS, "length of the joint")
    bounds = {}
    for name in LENGTHS:
        pair = given.get(name, DEFAULT_BOUNDS[name])
        if len(pair) != 2 or not all(math.isfinite(value) for value in pair) or pair[0] > pair[1]:
            raise refused(
                f"bounds[{name!r}]", pair, "two finite lengths, the lower one first, are needed"
            )
        if name.endswith("axial") and pair[0] <= 0.0:
            raise refused(f"bounds[{name!r}]", pair, "this length must be above 0 m")
        bounds[name] = (float(pair[0]), float(pair[1]))
    return bounds


def _areas(angles: Array, excess: Array) -> tuple[Array, Array]:
    """Areas below and above zero of the straight lines between points, (n, points) -> (n,),
    (n,).
    """
    step = np.diff(angles)
    plus, minus = np.maximum(excess, 0.0), np.maximum(-excess, 0.0)
    # of a line from p above zero to q below it, the share p/(p + q) is above
    first, second = excess[:, :-1], excess[:, 1:]
    span = np.abs(first) + np.abs(second)
    crossing = (first * second < 0.0) & (span > 0.0)
    share = np.where(crossing, span, 1.0)
    parts = []
    for side in (minus, plus):
        whole = 0.5 * (side[:, :-1] + side[:, 1:])
        parts.append(np.where(crossing, whole * (side[:, :-1] + side[:, 1:]) / share, whole) @ step)
    return parts[0], parts[1]
