"""Chapter 2 of the 2014 dissertation, the quasi-static muscle: its statements beside what this
package gives.

The measured forces are in figures only. What needs none of them (shape, blocked force, braid angle)
is computed from the captions' muscle; what the text says about fits to the measurements is asked of
:data:`reproduction.stand_in.COUNT` muscles that stand in for it. Such a line agrees or differs
where nine of ten stand-ins do so, otherwise it cannot tell.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pamrs.design.sizing import free_contraction
from pamrs.library import entry
from pamrs.rig import Muscle
from pamrs.units import parse_unit
from reproduction.comparison import Comparison, judge, verdicts
from reproduction.muscles.published import compare_entry
from reproduction.stand_in import (
    COUNT,
    EXTENSION,
    LEVELS,
    ORDERS,
    PSI,
    THREE,
    Fits,
    fits,
    hysteresis,
)
from reproduction.statement_tables import Told
from reproduction.statements import Statements

#: The statements of the chapter.
say: Final = Statements("chapter2")

Array = NDArray[np.float64]

NAME: Final = "ch2_075in"
_UNSURE: Final = 10  # one of so many stand-ins may be of another mind
_LOW, _HIGH = (0, 1, 2), (5, 6, 7)  # levels of 10 to 30 and of 80 to 120 psi

Progress = Callable[[str], None]


def facts(*, search: bool = True, progress: Progress | None = None) -> list[Comparison]:
    """Every statement of the chapter beside ours.

    Parameters
    ----------
    search : bool
        Without effect: nothing of this chapter takes minutes.
    progress : callable, optional
        Called with what is done next.

    Returns
    -------
    list of Comparison
    """
    tell = progress or (lambda _: None)
    tell("chapter 2: muscle, shape, blocked force")
    rows = compare_entry(entry(NAME)) + _shape() + _blocked()
    tell(f"chapter 2: fits of {COUNT} stand-ins")
    rows += _free() + _linear() + _three() + _loops()
    return say.scored(rows)


def headings() -> dict[str, str]:
    """What is said above each group, where that is more than its name."""
    return {NAME: f"the muscle of the captions: {entry(NAME).title}"}


def chosen() -> list[tuple[str, str, str]]:
    """Name, value and reason of each number that the chapter does not give."""
    own = entry(NAME)
    numbers = []
    for name in ("wall_thickness", "modulus_slope", "modulus_offset"):
        value, scale = own.parameters[name], parse_unit("in").scale
        shown = (
            f"{float(value) / scale:.3f} in"
            if name == "wall_thickness"
            else ", ".join(f"{x:.4g}" for x in value) + (" Pa" if name.endswith("set") else "")
        )
        numbers.append((f"muscle.{name}", shown, str(own.origins[name])))
    return numbers + say.chosen(COUNT)


# --------------------------------------------------------------------------- the shape


@cache
def _muscle() -> Muscle:
    return entry(NAME).muscle


def ends(muscle: Muscle, contraction: Array) -> tuple[Array, Array, Array]:
    """Axis ratio, axial length of one end and braid on it.

    The braid on an end is what (2.29) leaves of the fibre when the middle is taken away, the shape
    being the one that solves it; it has no meaning where the braid is taut.

    Parameters
    ----------
    muscle : Muscle
        Of the elliptic shape.
    contraction : ndarray, shape (n,)
        Contraction ratio [1].

    Returns
    -------
    ratio, length, braid : ndarray, shape (n,)
        k (2.35) [1], b' (2.21) [m] and s (2.28) [m].
    """
    own = muscle.parameters
    e = np.asarray(contraction, dtype=np.float64)
    k = own["k0"] - np.where(e >= 0.0, own["contraction_slope"], own["extension_slope"]) * e
    rest, radius = 0.5 * own["rest_diameter"], muscle.radius(e)
    q = k / np.sqrt(k**2 + 3.0)
    axial = math.sqrt(3.0) * q * np.abs((radius - rest) / (1.0 - q))
    length = own["rest_length"] * (1.0 - e)
    middle = (
        (length - 2.0 * axial) / length * np.hypot(length, 2.0 * math.pi * radius * muscle.turns)
    )
    return k, axial, 0.5 * (muscle.fibre_length - middle)


def _shape() -> list[Comparison]:
    muscle = _muscle()
    rest = 0.5 * float(muscle.parameters["rest_diameter"])
    inch = parse_unit("in").scale
    low = muscle.replace(neck_floor=0.3)
    least = float(low.radius(np.linspace(EXTENSION, 0.0, 400)).min())
    at = np.array([EXTENSION])
    thick = float(muscle.thickness(at)[0] / muscle.parameters["wall_thickness"])
    cylinder = muscle.replace(geometry="cylinder")
    step = np.array([-0.005, 0.1, 0.25])
    apart = (cylinder.radius(step) - muscle.radius(step)) / rest
    printed = float(muscle.replace(geometry="elliptic_published").radius(at)[0])
    return [
        say("least_radius_extension", least / inch),
        say("radius_as_printed", printed / inch),
        say("bladder_2_75", thick),
        *_on_ends(),
        say("radius_cylinder_elliptic", float(np.abs(apart).max()), apart[0], apart[1], apart[2]),
    ]


def _on_ends() -> list[Comparison]:
    muscle = _muscle()
    last = free_contraction(muscle, 120.0 * PSI)
    k = ends(muscle, np.array([0.0, last]))[0]
    wider, narrower = _braids()
    return [
        say(
            "axis_ratio_ends", abs(float(k[1]) - 1.0), k[1], last, published=abs(float(k[0]) - 1.0)
        ),
        say("braid_end_radius", float(ends(muscle, np.array([0.0]))[2][0]) / muscle.fibre_length),
        say("braid_end_radius_10", wider / narrower),
    ]


def _braids() -> tuple[float, float]:
    """Braid on an end where the radius is 10 % wider and 10 % narrower than at rest [m]."""
    from reproduction.muscles.evaluate import root_between

    muscle = _muscle()
    rest = 0.5 * float(muscle.parameters["rest_diameter"])
    found = []
    for share, low, high in ((1.1, 0.0, 0.2), (0.9, -0.0099, 0.0)):

        def gap(e: float, share: float = share) -> float:
            return float(muscle.radius(e)) - share * rest

        at = root_between(gap, low, high)
        assert at is not None
        found.append(float(ends(muscle, np.array([at]))[2][0]))
    return found[0], found[1]


# ------------------------------------------------------------------- the blocked force


def _blocked() -> list[Comparison]:
    pressure = 60.0 * PSI
    own = _muscle().replace(model="kothera", friction_coefficient=0.0, friction_pressure_slope=0.0)

    def of(model: str, degrees: float) -> float:
        muscle = own.replace(model=model, braid_angle=math.radians(degrees))
        return float(muscle.force(pressure, 0.0))

    measured = of("kothera", 76.5)
    constant, other = (abs(of(model, 74.0) / measured - 1.0) for model in ("ferraresi", "kothera"))
    degree = of("kothera", 75.5) / measured - 1.0
    return [
        say("blocked_force_constant", of("ferraresi", 76.5) / measured),
        say("off_74_deg", constant / other, 100 * constant, 100 * other),
        say("blocked_force_75", degree),
    ]


# -------------------------------------------------------------------- the stand-ins


def over(key: str, values: Sequence[float], *said: Any) -> Comparison:
    """A statement put to every stand-in: the median, and a verdict where nine of ten have it.

    Parameters
    ----------
    key : str
        Its id.
    values : sequence of float
        Ours, one for each stand-in.
    *said
        What stands in the places of its texts.

    Returns
    -------
    Comparison
    """
    entry = say.entry(key, *said)
    note = entry.pop("note", "")
    rows = [judge(ours=value, **entry) for value in values]
    having = sum(row.verdict == "agree" for row in rows)
    share = having / len(rows)
    mixed = _UNSURE * min(having, len(rows) - having) > len(rows)
    words = f"{min(values):.3g} to {max(values):.3g} over {len(rows)} stand-ins"
    return judge(
        ours=float(np.median(values)),
        cannot_tell=f"{100 * share:.0f} % of the stand-ins agree" if mixed else "",
        note="; ".join(part for part in (words, note) if part),
        **entry,
    )


def sample() -> list[Fits]:
    """The fits of all stand-ins, each made once."""
    return [fits(number) for number in range(COUNT)]


def _free() -> list[Comparison]:
    every = sample()
    shapes = ("constant", "cylinder", "elliptic")
    longer = {s: np.array([f.part(f.free[s], extended=True) for f in every]) for s in shapes}
    shorter = {s: np.array([f.part(f.free[s], extended=False) for f in every]) for s in shapes}
    above = [_departure(f) for f in every]
    return [
        over(
            "constant_thickness_least", [float(f.blocked(f.free["constant"]).min()) for f in every]
        ),
        over("constant_thickness_error", (longer["constant"] / shorter["constant"]).tolist()),
        over("non_constant_thickness", (shorter["cylinder"] / shorter["constant"]).tolist()),
        over("elliptic_ends_error", (longer["elliptic"] / longer["cylinder"]).tolist()),
        over(
            "elliptic_ends_error_contraction", (shorter["elliptic"] / shorter["cylinder"]).tolist()
        ),
        over("departure_E1_line", above),
    ]


def _departure(found: Fits) -> float:
    pressure = np.asarray(found.table.levels)
    first = np.array(
        [
            found.free["elliptic"].muscle_at(float(p)).parameters["modulus_offset"][0]
            for p in pressure
        ]
    )

    def off(rows: NDArray[np.bool_]) -> float:
        line = np.polyfit(pressure[rows], first[rows], 1)
        return float(np.sqrt(np.mean((first[rows] - np.polyval(line, pressure[rows])) ** 2)))

    return off(pressure > 0.0) / off(pressure > 31.0 * PSI)


def _linear() -> list[Comparison]:
    every = sample()
    errors = [np.array([f.error(f.linear[m]) for m in ORDERS]) for f in every]  # orders, levels
    best = [int(np.sum(error.argmin(axis=0) == len(ORDERS) - 1)) for error in errors]
    drops = [float(np.mean(np.diff(error, axis=0) < 0.0)) for error in errors]
    whole = [np.sqrt(np.mean(f.linear[4].all_residuals ** 2)) for f in every]
    free = [np.sqrt(np.mean(f.free["elliptic"].all_residuals ** 2)) for f in every]
    return [
        over("share_pressures_steps", drops),
        over("pressures_which_order", best),
        *_by_pressure(errors),
        over("linear_free_moduli", [float(a / b) for a, b in zip(whole, free, strict=True)]),
        *_stresses(),
    ]


def _by_pressure(errors: list[Array]) -> list[Comparison]:
    """Errors of the orders at high and at low pressures; (orders, levels) for each stand-in."""
    high = [error[:, list(_HIGH)].mean(axis=1) for error in errors]
    low = [error[:, list(_LOW)].mean(axis=1) for error in errors]
    return [
        over("order_1_error", [float(h[0] / x[0]) for h, x in zip(high, low, strict=True)]),
        over("order_2_error", [float(h[1] / x[1]) for h, x in zip(high, low, strict=True)]),
        over("order_4_error", [float(h[3] / x[3]) for h, x in zip(high, low, strict=True)]),
        over("order_4_over_1", [float(h[3] / h[0]) for h in high]),
    ]


def _stresses() -> list[Comparison]:
    every = sample()
    first = [_first_order(f) for f in every]
    slopes = [float(f.linear[4].x[0]) for f in every]
    bend = [_softening(f, 120.0 * PSI) for f in every]
    return [
        over(
            "slope_offset_E1",
            [spread for spread, _ in first],
            float(np.median([rest for _, rest in first])),
        ),
        over("rise_E1_pressure", slopes),
        over("least_slope_stress", bend),
    ]


def _first_order(found: Fits) -> tuple[float, float]:
    """Spread of m_1 and b_1 over orders 1 to 4, and 2 to 4, the larger of the two [1]."""
    pairs = np.array([(found.linear[m].x[0], found.linear[m].x[m]) for m in ORDERS])

    def spread(part: Array) -> float:
        return float((part.std(axis=0) / np.abs(part.mean(axis=0))).max())

    return spread(pairs), spread(pairs[1:])


def _softening(found: Fits, pressure: float) -> float:
    moduli = np.array(
        found.linear[4].muscle_at(pressure).parameters["modulus_offset"], dtype=np.float64
    )
    strain = np.linspace(2.0, 2.6, 61)
    order = np.arange(1, moduli.size + 1)
    slope = (strain[:, None] ** (order - 1)) @ (order * moduli)
    return float(slope.min() / moduli[0])


def _three() -> list[Comparison]:
    every = sample()
    ratio = np.array([f.error(f.three) / f.error(f.linear[4]) for f in every])
    error = np.array([f.error(f.three) for f in every])
    predicted = [k for k, psi in enumerate(LEVELS) if psi not in THREE]
    others = [k for k in predicted if k > 0]
    names = ", ".join(f"{psi:g}" for psi in THREE)
    return [
        over("error_10_psi", ratio[:, 0].tolist(), names),
        over("largest_other_seven", ratio[:, 1:].max(axis=1).tolist()),
        over("largest_error_pressures", (100.0 * error[:, others].max(axis=1)).tolist()),
        over("largest_error_all", (100.0 * error[:, predicted].max(axis=1)).tolist()),
    ]


def _loops() -> list[Comparison]:
    found = np.array([hysteresis(number) for number in range(COUNT)])
    return [
        over("error_loop_without", found[:, 2].tolist()),
        over("friction_coefficient", (found[:, 0] + 0.4 * found[:, 1]).tolist()),
    ]


# --------------------------------------------------------------------------- in short


def in_short(rows: list[Comparison]) -> list[str]:
    """A few sentences about the statements."""
    told = Told(rows, say.groups, 2)
    fitted = [row for row in rows if "stand-ins" in row.note and not row.apart]
    return say.short(
        (COUNT, len(fitted), verdicts(fitted)),
        (told.row("blocked", _AT_74).note.split(" and ")[0],),
        (),
        (
            told.ours("three", "largest error of the pressures between the three", 1),
            told.ours("three", "error at 10 psi: three pressures over all eight", 1),
        ),
        (
            told.ours("linear", "order 2: the same"),
            {
                "agree": ".",
                "cannot tell": "; the stand-ins are not of one mind there.",
                "differs": ", where the text has more.",
            }[told.row("linear", "order 2: the same").verdict],
        ),
        (),
    )


_AT_74: Final = "off by at 74 deg: constant over non-constant thickness"
