"""Symbols and abbreviations of the pages, once for all chapters."""

from __future__ import annotations

from typing import Final, NamedTuple

from pamrs.errors import ParameterError

__all__ = ["SYMBOLS", "Symbol", "symbols"]


class Symbol(NamedTuple):
    """A symbol or an abbreviation of some chapters."""

    name: str
    """As it is written on the pages."""
    meaning: str
    """With its equation or section in the source, where it has one."""
    unit: str
    """Unit; of a unit what it is in SI; empty where there is none."""
    chapters: tuple[str, ...]
    """As in :func:`reproduction.names`."""


_ALL: Final = ("ch2", "ch3", "ch4", "ch5", "ch6")
_CONTROL: Final = ("ch4", "ch5")

SYMBOLS: Final = (
    Symbol("rms", "root of the mean square of an error", "of the error", ("ch5",)),
    Symbol("RMS", "root of the mean square of an error", "of the error", ("ch4",)),
    Symbol("nu", "integral of the squared error over time (4.15)", "rad2 s or deg2 s", _CONTROL),
    Symbol(
        "omega",
        "integral of the absolute curvature of the angle over time (4.16), (4.17): how restless "
        "the motion is; its value depends on the unit of the angle, which is radians unless "
        "degrees are named",
        "1",
        _CONTROL,
    ),
    Symbol(
        "J",
        "0.25 nu + 0.75 omega, each over its least of the runs compared (4.18); 1 at best",
        "1",
        _CONTROL,
    ),
    Symbol(
        "J",
        (
            "what the genetic algorithm minimises (3.25): missing work, a share of the work to "
            "spare, a penalty (3.26)"
        ),
        "joule",
        ("ch3",),
    ),
    Symbol("GA", "the genetic algorithm of 3.5", "", ("ch3",)),
    Symbol(
        "l0, r0, lT",
        "ends of a tendon along and across its link, and its length (3.2.4)",
        "in",
        ("ch3",),
    ),
    Symbol("C10, C01", "constants of the Mooney-Rivlin bladder (3.21)", "Pa", ("ch3",)),
    Symbol(
        "c_F",
        (
            "friction: share by which a muscle's force is lower while it shortens, higher while it "
            "lengthens (2.36)"
        ),
        "1",
        ("ch2", "ch3"),
    ),
    Symbol(
        "rotation",
        "angle of the elbow from where the empty muscles hold it, the rest angle",
        "deg",
        ("ch3",),
    ),
    Symbol("PID", "proportional, integral and derivative control", "", _CONTROL),
    Symbol(
        "FF+PID, FF+fuzzy",
        "feedforward of the arm's model with PID or fuzzy control beside it (4.3.2)",
        "",
        ("ch4",),
    ),
    Symbol(
        "kP, kI, kD",
        "proportional, integral and derivative gain of the PID",
        "V/rad, V/(rad s), V s/rad",
        ("ch4",),
    ),
    Symbol(
        "kM",
        "gain of the feedforward, from pressure error to wanted rate of pressure; 0: none",
        "1/s",
        ("ch4",),
    ),
    Symbol(
        "g1, g2, h",
        "error and its rate at which a fuzzy input is full, and voltage of a full output",
        "rad, rad/s, V",
        ("ch4",),
    ),
    Symbol("lag", "by how much the angle is late, by least squares", "s", ("ch4",)),
    Symbol(
        "activation", "pressure up to which a muscle does not pull: it wakes there", "kPa", ("ch4",)
    ),
    Symbol(
        "damping", "force against the rate at which one muscle's length changes", "N s/m", ("ch4",)
    ),
    Symbol(
        "I, b, m g r",
        "inertia, viscous friction and weight times lever of the arm with its payload",
        "kg m2, N m s/rad, N m",
        ("ch5",),
    ),
    Symbol(
        "C1, C2",
        "torque of the muscles at an angle: C1 times pressure, and C2 (5.1)",
        "N m/Pa, N m",
        ("ch5",),
    ),
    Symbol("lambda", "slope of the sliding surface: rate error over angle error", "1/s", ("ch5",)),
    Symbol(
        "KD", "switching gain: pressure that is asked for beyond the boundary layer", "Pa", ("ch5",)
    ),
    Symbol(
        "boundary layer",
        "distance from the sliding surface within which the switching is proportional",
        "rad/s",
        ("ch5",),
    ),
    Symbol(
        "Gamma",
        "gains of the adaptation of I, b and m g r (Table 5.2)",
        "SI with radians",
        ("ch5",),
    ),
    Symbol(
        "H, C, G",
        "what the three networks learn over the angle, from acceleration, rate and 1 to pressure "
        "(5.17)-(5.19); gamma_H, gamma_C and gamma_G are their gains",
        "Pa s2/rad, Pa s/rad, Pa",
        ("ch5",),
    ),
    Symbol(
        "L, B, r_eff",
        "length of a muscle, of a fibre of its braid, and lever of a constant arm (5.25)",
        "in",
        ("ch5",),
    ),
    Symbol(
        "effects such as `muscle_creep`",
        "physics that a plant has and a model has not; `pamrs effects` explains each",
        "",
        ("ch5",),
    ),
    Symbol(
        "effects such as `muscle_creep`",
        "physics that the diagnosis names; `pamrs effects` explains each",
        "",
        ("ch4",),
    ),
    Symbol("k", "axis ratio of the ellipse of a muscle's end (2.35)", "1", ("ch2",)),
    Symbol(
        "E1",
        "first modulus of the stress polynomial (2.9); linear in pressure: E = m P + b",
        "Pa",
        ("ch2",),
    ),
    Symbol("order", "M, that of the stress polynomial", "", ("ch2",)),
    Symbol(
        "error",
        "of a pressure: rms force error over that pressure's largest measured force (2.37)",
        "1 or %",
        ("ch2",),
    ),
    Symbol(
        "stand-in",
        "a simulated muscle in place of the measured one; what is known of it stands below",
        "",
        ("ch2",),
    ),
    Symbol("E_in", "(6.8): fall of the tank's pressure times its volume", "J", ("ch6",)),
    Symbol("W_out", "(6.7): torque times rise of the angle, while it rises", "J", ("ch6",)),
    Symbol("efficiency", "(6.9): W_out over E_in", "%", ("ch6",)),
    Symbol(
        "first moment",
        "mass of the arm times the distance of its centre from the joint; weight torque over g",
        "kg m",
        ("ch6",),
    ),
    Symbol("PAM", "pneumatic artificial muscle", "", ("ch6",)),
    Symbol(
        "effects such as `leak_muscle`",
        "physics that a plant has and a model has not; `pamrs effects` explains each",
        "",
        ("ch6",),
    ),
    Symbol("lb", "pound: of mass", "0.4536 kg", ("ch3", "ch5")),
    Symbol("lbf, ft lbf", "pound of force, and foot times it", "4.448 N, 1.356 N m", ("ch3",)),
    Symbol(
        "psi",
        "pound of force on a square inch; every pressure is above the ambient one",
        "6.895 kPa",
        ("ch2", "ch3", "ch4", "ch5"),
    ),
)


def symbols(chapter: str) -> list[tuple[str, str, str]]:
    """Name, meaning and unit of what a chapter's page uses.

    Parameters
    ----------
    chapter : str
        One of :func:`reproduction.names`.

    Returns
    -------
    list of (str, str, str)

    Raises
    ------
    ParameterError
        If there is no such chapter.
    """
    if chapter not in _ALL:
        raise ParameterError(f"chapter = {chapter!r} is not allowed: one of {', '.join(_ALL)}")
    return [(one.name, one.meaning, one.unit) for one in SYMBOLS if chapter in one.chapters]
