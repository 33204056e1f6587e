"""Chapter 6 of the 2014 dissertation, variable recruitment: its statements beside what this package
gives.

The score is of the shoulder rig as it is, with as many muscles as are recruited, the tank of 15 l
and the gas of (6.4). The pressure loop has gains that the chamber allows
(:mod:`reproduction.margins`), and the efficiencies stand beside a quasi-static balance of other
code. What is read otherwise (the gas laws in gauge pressures, a heavier arm,
another dead volume) stands apart, each on its own; what the text suspects behind its experiments'
larger input is simulated one by one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pamrs.design.sizing import free_contraction
from pamrs.library import entry
from pamrs.rig import Joint, Muscle
from reproduction import chapter6_loops as loops
from reproduction import recruiting as rec
from reproduction.comparison import Comparison
from reproduction.lifting import lift
from reproduction.muscles.published import compare_entry
from reproduction.recruiting import EXTENDED, MATRIX, MUSCLES, PAYLOADS, Case, Cycles
from reproduction.rigs import with_struts
from reproduction.statement_tables import Told
from reproduction.statements import OTHER, Statements

#: The statements of the chapter.
say: Final = Statements("chapter6")

Array = NDArray[np.float64]

BAR: Final = 1e5
#: Largest pressure of a muscle for which the source still has 2 bar to spare (6.6) [Pa].
_SPARE: Final = 2.0 * BAR
_GAUGE: Final = "gauge pressures in (6.4)"

Progress = Callable[[str], None]


@dataclass(eq=False)
class Experiments:
    """What was run.

    Attributes
    ----------
    cycles : int
        Of the first three; the others have two.
    steep, flat : Cycles
        Up to 90 and to 50 deg: every payload with every number of muscles, up to 63 kg at 90 deg.
    bare : Cycles
        Without elasticity, 90 deg.
    readings : dict of str to (Cycles, Cycles)
        Up to 90 deg with and without elasticity, by reading.
    suspects : dict of str to Cycles
        Table 6.3, by suspect.
    idle : dict of str to Cycles
        9 kg by one of three pairs.
    plain : Cycles
        Table 6.3 without the rate in the angle loop, and slow.
    """

    cycles: int
    steep: Cycles
    flat: Cycles
    bare: Cycles
    readings: dict[str, tuple[Cycles, Cycles]] = field(default_factory=dict)
    suspects: dict[str, Cycles] = field(default_factory=dict)
    idle: dict[str, Cycles] = field(default_factory=dict)
    plain: Cycles | None = None


def experiments(*, search: bool = True, progress: Progress | None = None) -> Experiments:
    """Run everything, or give what was run before.

    Parameters
    ----------
    search : bool
        Eight cycles as in the text; else two.
    progress : callable, optional
        Called with what is done next.

    Returns
    -------
    Experiments
    """
    if search not in _KEPT:
        _KEPT.clear()  # the pictures are of what was run last
        _KEPT[search] = _experiments(8 if search else 2, progress or (lambda _: None))
    return _KEPT[search]


def latest() -> Experiments:
    """What was run last; without anything, the short experiments."""
    return next(iter(_KEPT.values())) if _KEPT else experiments(search=False)


_KEPT: dict[bool, Experiments] = {}


def _experiments(cycles: int, tell: Progress) -> Experiments:
    every = tuple((payload, n) for payload in (*PAYLOADS, *EXTENDED) for n in MUSCLES)
    short = tuple((payload, n) for payload in PAYLOADS for n in MUSCLES)
    tell(f"chapter 6: {cycles} cycles of {len(every)} cases up to 90 deg, 50 deg, no elasticity")
    done = Experiments(
        cycles,
        rec.lifting(every, 90.0, cycles),
        rec.lifting(short, 50.0, cycles),
        rec.lifting(short, 90.0, cycles, elastic=False),
        plain=rec.lifting(MATRIX[90.0], 90.0, 2, gains=rec.SLOW),
    )
    for name, changed in rec.READINGS.items():
        tell(f"chapter 6: reading {name}")
        with_, without = (
            rec.lifting(short, 90.0, 2, elastic=elastic, changed=changed, known=True)
            for elastic in (True, False)
        )
        done.readings[name] = (with_, without)
    for name, changed in rec.SUSPECTS.items():
        tell(f"chapter 6: suspect {name}")
        done.suspects[name] = rec.lifting(MATRIX[90.0], 90.0, 2, changed=changed)
    tell("chapter 6: muscles that are not recruited")
    done.idle["bowed out"] = rec.beside_idle(9.0, 90.0, 2)
    done.idle["struts"] = rec.beside_idle(9.0, 90.0, 2, struts=True)
    return done


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
    silicone = [row for row in compare_entry(entry("pam_b_075in")) if row.where.startswith("6.")]
    rows = _pair() + say.scored(silicone) + _silicone() + _joint()
    rows += _cycles(done) + _best(done) + _rubber(done) + _readings(done)
    return rows + _tests(done) + _suspects(done) + _idle(done)


def headings() -> dict[str, str]:
    """What is said above each group, where that is more than its name."""
    return {"pam_b_075in": f"one against two of silicone: {entry('pam_b_075in').title}"}


# ------------------------------------------------------- 6.2: one at 2P, two at P


def _loss(muscle: Muscle, pressure: float, contraction: Array | float) -> Array:
    """(One at twice the pressure less two at it) over the one's blocked force [1]."""
    single = muscle.force(2.0 * pressure, contraction)
    pair = 2.0 * muscle.force(pressure, contraction)
    return np.asarray((single - pair) / muscle.force(2.0 * pressure, 0.0))


def _pair() -> list[Comparison]:
    muscle = entry("pam_a_1in").muscle
    levels = (2.0 * BAR, 4.0 * BAR)
    free = [free_contraction(muscle, p) for p in levels]
    full = [free_contraction(muscle, 2.0 * p) for p in levels]
    least = [
        float(_loss(muscle, p, np.linspace(0.02, end, 100)).min())
        for p, end in zip(levels, free, strict=True)
    ]
    gap = min(a - b for a, b in zip(full, free, strict=True))
    low, high = (float(_loss(muscle, p, 0.10)) for p in levels)
    ambient = 101325.0
    air = [2.0 * (p + ambient) / (2.0 * p + ambient) for p in levels]
    return [
        say("one_two_blocked", 100.0 * min(least), 100 * low, 100 * high),
        say("free_contraction_one", gap, full[0], free[0], full[1], free[1]),
        say("share_lost_rubber", low / high),
        say("air_two_muscles", air[1], air[0]),
    ]


def _silicone() -> list[Comparison]:
    """B with A's rubber: the expectation of 6.2."""
    own, other = entry("pam_b_075in").muscle, entry("pam_a_1in").muscle
    same = own.replace(**{k: other.parameters[k] for k in ("modulus_slope", "modulus_offset")})
    ratio = float(_loss(same, 2.0 * BAR, 0.10)) / float(_loss(other, 2.0 * BAR, 0.10))
    return [say("loss_B_s", ratio)]


# --------------------------------------------------------------- 6.3: the shoulder


def _joint() -> list[Comparison]:
    rig = with_struts("shoulder")
    end = math.radians(90.0)
    full = lift(rig.with_parameters({"arm.payload": 95.0}), pressure=13.0 * BAR, to=end)
    weight = rig.parameter("arm.gravity").value
    length = rig.parameter("arm.length").value
    left = 850.0 / weight - 95.0 * length
    least, most = _moments()
    return [
        say("least_torque_six", float(full.torque.min())),
        say("most_lifted_90", full.payload_limit or 0.0),
        say("first_moment_arm", least, left, least, most, published=left),
        *_shape_of_joint(),
    ]


def _shape_of_joint() -> list[Comparison]:
    """6.4.1 and 6.3: the torque over the joint's range, and the room that the muscles need."""
    rig = rec.plant(0.0, 6)
    muscle, joint = rig.muscle, Joint.from_model(rig.model["joint"])
    assert muscle is not None
    angles = np.radians([15.0, 90.0, 120.0])
    torque, braid = (
        np.asarray(joint.torque(one, 13.0 * BAR, angles, count=6))
        for one in (muscle, muscle.replace(model="gaylord", geometry="elliptic"))
    )
    low, middle, high = torque
    most = float(joint.shortening(angles[-1])) / muscle.parameters["rest_length"]
    bent, free = (
        200.0 * float(muscle.radius(e)) for e in (most, free_contraction(muscle, 13.0 * BAR))
    )
    return [
        say("torque_constant", high / low, braid[2] / braid[0], low, middle, high),
        say("room", bent, 100.0 * most, free),
    ]


def _moments() -> tuple[float, float]:
    """First moments of the arm [kg m] with which two muscles at 2 bar below the source just do not
    lift 18 kg to 90 deg, and just do lift 9 kg.
    """
    rig = rec.plant(0.0, 2)
    source = rig.parameter("supply.initial_pressure").value
    length = rig.parameter("arm.length").value
    found = lift(rig, pressure=source - _SPARE, to=math.radians(90.0)).payload_limit or 0.0
    whole = found * length + rig.parameter("arm.first_moment").value
    return whole - 18.0 * length, whole - 9.0 * length


# ------------------------------------------------------------ 6.4: lifting cycles


def _grid(done: Cycles, payloads: tuple[float, ...]) -> Array:
    """Efficiency by payload and number of muscles, NaN where the test matrix has no entry."""
    allowed = MATRIX[done.high]
    return np.array(
        [[done.of(p, n) if (p, n) in allowed else math.nan for n in MUSCLES] for p in payloads]
    )


def _of(done: Cycles, cases: tuple[Case, ...]) -> Array:
    return np.array([done.of(*case) for case in cases])


def _trends(found: Cycles) -> tuple[float, float, float]:
    """What 6.4.3 says about payload and number of muscles, up to one angle: least gain of
    efficiency [%] by payload and by fewer muscles, and gain of fewer without over with payload.
    """
    grid = 100.0 * _grid(found, PAYLOADS)
    gain = grid[:, 0] / grid[:, 2]
    below = grid[:, 1] / grid[:, 2]
    return (
        float(np.nanmin(np.diff(grid, axis=0))),
        float(np.nanmin(-np.diff(grid, axis=1))),
        float(gain[0] / gain[-1] if math.isfinite(gain[-1]) else below[0] / below[-1]),
    )


def _cycles(done: Experiments) -> list[Comparison]:
    over = max(float(np.degrees(c.angle.max()) - c.high) for c in (done.flat, done.steep))
    assert done.plain is not None
    slow = done.plain.efficiency / _of(done.readings["as it is"][0], MATRIX[90.0])
    farthest = float(slow[np.argmax(np.abs(np.log(slow)))])
    short = 90.0 - done.plain.tops()
    payload, number, lightest = zip(_trends(done.flat), _trends(done.steep), strict=True)
    return [
        say("least_gain_efficiency", min(payload), payload[0], payload[1]),
        say("least_gain_efficiency_number", min(number), number[0], number[1]),
        say("gain_two_four", min(lightest), lightest[0], lightest[1]),
        say("largest_overshoot_angle", over),
        say("efficiency_slow_PI", farthest, slow.min(), slow.max(), short.min(), short.max()),
        say("length_eight_cycles", 8.0 * rec.CYCLE),
        *_beside_balance(done),
        *_loops(done),
    ]


def _beside_balance(done: Experiments) -> list[Comparison]:
    """Every efficiency of the two tables beside a quasi-static balance of other code."""
    off = [
        found.of(*case) / loops.balance(*case, found.high, found.count) - 1.0
        for found in (done.flat, done.steep)
        for case in loops.lasting(found)
    ]
    return [say("beside_balance", 100.0 * max(off, key=abs), 100.0 * min(off), 100.0 * max(off))]


def _loops(done: Experiments) -> list[Comparison]:
    """The margin of every loop behind the tables, and what their pressures do."""
    found = loops.margins(done)
    least = min(found, key=lambda one: one.inner)
    slow = next(one.whole for one in found if one.name == loops.SLOW)
    loose = min((one for one in found if one.name != loops.SLOW), key=lambda one: one.whole)
    restless = max(found, key=lambda one: one.turning)
    return [
        say("inner_margin", least.inner, least.name, len(found)),
        say("whole_margin", loose.whole, loose.name, slow),
        say("pressure_turns", 100.0 * restless.turning, restless.name),
    ]


def best_number(found: Cycles, payload: float) -> tuple[int, int]:
    """The most efficient number of muscles, of those that follow most cycles, and how many they
    follow.
    """
    rows = [found.row(payload, n) for n in MUSCLES]
    followed = found.followed()[rows]
    most = int(followed.max())
    able = [k for k in range(len(MUSCLES)) if followed[k] == most]
    return MUSCLES[max(able, key=lambda k: found.efficiency[rows[k]])], most


def _best(done: Experiments) -> list[Comparison]:
    found = done.steep
    loads = (*PAYLOADS, *EXTENDED)
    best = {load: best_number(found, load) for load in loads}
    words = ", ".join(
        f"{load:g} kg: {n}" + (f" ({k} of {done.cycles} cycles)" if k < done.cycles else "")
        for load, (n, k) in best.items()
    )
    able = {load: n for load, (n, k) in best.items() if k == done.cycles}
    last, followed = best[EXTENDED[-1]]
    return [
        say("number_muscles_0", float(best[0.0][0])),
        say("least_step_best", float(np.diff(list(able.values())).min()), words),
        say(
            "number_muscles_63",
            float(able.get(EXTENDED[-1], math.nan)),
            f"{last} muscles follow {followed} of {done.cycles} cycles",
        ),
        *_limits(done, best),
    ]


def _limits(done: Experiments, best: Mapping[float, tuple[int, int]]) -> list[Comparison]:
    """Up to which payload and which pressure the source can give, by the best number of muscles."""
    found = done.steep
    whole = [load for load, (_, k) in best.items() if k == done.cycles]
    top = found.tops() > found.high - 1.0
    need = float(found.gradient()[top].min()) / BAR
    return [
        say(
            "largest_payload_follows",
            max(whole),
            "" if done.cycles == 8 else "two cycles of eight: the tank does not run low",
        ),
        say("least_tank_muscles", need),
    ]


def _rubber(done: Experiments) -> list[Comparison]:
    cases = MATRIX[90.0]
    with_, without = (100.0 * _of(found, cases) for found in (done.steep, done.bare))
    least, highest = float(without.min()), done.bare.pressure[done.bare.row(0.0, 6)].max() / BAR
    return [
        say("elasticity_least_efficiency", float(with_.min()), 100 * done.steep.of(9.0, 6)),
        say("elasticity_largest_efficiency", float(with_.max())),
        say("without_elasticity_least", least, highest, _bound(done), 100 * done.bare.of(9.0, 6)),
        say("without_elasticity_largest", float(without.max())),
        *_turned(done),
    ]


def _turned(done: Experiments) -> list[Comparison]:
    """Which number of muscles is best and worst without elasticity."""
    bare = 100.0 * np.array([[done.bare.of(p, n) for n in MUSCLES] for p in (0.0, 27.0)])
    empty, heavy = (", ".join(f"{x:.1f}" for x in row) for row in bare)
    return [
        say("without_elasticity_0", float(bare[0, 0] - bare[0, 1:].max()), empty),
        say("without_elasticity_27", float(bare[1, 0] - bare[1, 1:].min()), heavy),
    ]


def _bound(done: Experiments) -> float:
    """Most that isothermal air can give of (6.8) for the empty arm with six muscles [%]."""
    pressure = float(done.bare.pressure[done.bare.row(0.0, 6)].max())
    return 100.0 * pressure / (pressure + 101325.0)


def _readings(done: Experiments) -> list[Comparison]:
    rows = []
    for name, pair in done.readings.items():
        for elastic, found, low, high in (
            ("with", pair[0], 10.0, 30.0),
            ("without", pair[1], 52.0, 66.0),
        ):
            values = 100.0 * _of(found, MATRIX[90.0])
            off = abs(float(values.min()) - low) + abs(float(values.max()) - high)
            rows.append(say("elasticity_both_ends", off, name, elastic, values.min(), values.max()))
    return rows


# --------------------------------------------------------------- 6.5: experiments


def _tests(done: Experiments) -> list[Comparison]:
    found = done.steep
    work = np.array([[found.work[found.row(p, n)] for n in MUSCLES] for p in PAYLOADS])
    allowed = np.array([[(p, n) in MATRIX[90.0] for n in MUSCLES] for p in PAYLOADS])
    work = np.where(allowed, work, math.nan)
    spread = np.nanmax(work, axis=1) / np.nanmin(work, axis=1) - 1.0
    own = found.row(18.0, 2)
    tops = found.tops()[own]
    drop = (found.source[own, 0] - found.source[own, -1]) / BAR
    mean = [f"{p:g} kg: {np.nanmean(line):.0f}" for p, line in zip(PAYLOADS, work, strict=True)]
    smooth, rubbing = loop_width(done.steep, own), loop_width(_hysteretic(), 0)
    return [
        say("largest_spread_work", 100.0 * float(spread.max()), "; ".join(mean)),
        say("18_kg_2", float(np.ptp(tops)), drop),
        say("18_kg_2_muscles", 100.0 * smooth, 100 * rubbing),
    ]


def _hysteretic() -> Cycles:
    changed = rec.SUSPECTS["hysteresis of the muscles (2.36)"]
    return rec.lifting([(18.0, 2)], 90.0, 2, changed=changed)


def loop_width(found: Cycles, row: int) -> float:
    """Width in torque of the loop of torque over pressure in the second cycle, at the mean of its
    pressures, over its largest torque [1].
    """
    now = found.time - rec.CYCLE
    up, down = ((now >= a) & (now <= a + 6.0) for a in (0.0, 11.0))
    pressure, torque = found.pressure[row], found.torque[row]
    middle = 0.5 * (float(pressure[up].min()) + float(pressure[up].max()))
    at = []
    for part in (up, down):
        order = np.argsort(pressure[part])
        at.append(float(np.interp(middle, pressure[part][order], torque[part][order])))
    return abs(at[1] - at[0]) / float(torque[up | down].max())


_VOLUME: Final = "volume of the tubing, 0.1 l"
_SPREAD: Final = "largest spread of the work over the numbers of muscles"
#: Which suspects the text names, and what counts for each.
_NAMED: Final[Mapping[str, tuple[str, ...]]] = {
    "leakage": ("leakage of the muscles", "leakage of the valve", "leakage of the tank"),
    "tubing, by its friction": ("friction of the tubing",),
    "tubing, by its volume": (_VOLUME,),
    "temperature": ("temperature of the muscles' air",),
}


def _suspects(done: Experiments) -> list[Comparison]:
    rows = []
    base = done.readings["as it is"][0]
    rows_ = [base.row(*case) for case in MATRIX[90.0]]
    energy, work = base.energy[rows_], base.work[rows_]
    ratio = {name: found.energy / energy for name, found in done.suspects.items()}

    def told(name: str) -> str:
        moved = done.suspects[name].work / work - 1.0
        rise = _rise(done.suspects[name]) / _rise(base)
        return (
            f"{name}: input {ratio[name].min():.3f} to {ratio[name].max():.3f} times, work "
            f"{100 * moved.min():+.1f} to {100 * moved.max():+.1f} %, rise of the efficiency with "
            f"payload {rise:.2f} times"
        )

    for suspect, members in _NAMED.items():
        best = max(members, key=lambda name: float(ratio[name].min()))
        rows.append(
            say(
                "input_without_least_ten",
                float(ratio[best].min()),
                suspect,
                "; ".join(told(name) for name in members),
                best,
                apart=OTHER if members == (_VOLUME,) else "",
            )
        )
    return rows + _unnamed(done, energy, told)


def _unnamed(done: Experiments, energy: Array, told: Callable[[str], str]) -> list[Comparison]:
    """What else could make the input larger, each a check of our own."""
    base = done.readings["as it is"][0]
    rows_ = [base.row(*case) for case in MATRIX[90.0]]
    gauge = energy / done.readings[_GAUGE][0].energy[rows_]
    tank = _tank(done)
    other = "hysteresis of the muscles (2.36)"
    return [
        say("gauge_pressures_simulation", float(gauge.min()), gauge.min(), gauge.max()),
        say("air_tank_cools", float(tank.min()), tank.min(), tank.max()),
        say(
            "input_without_least", float((done.suspects[other].energy / energy).min()), told(other)
        ),
    ]


def _rise(found: Cycles) -> float:
    """Rise of the efficiency from 9 to 27 kg, mean of four and six muscles [1]: the text has it 'at
    about the same rate' in experiment and simulation (6.5.2).
    """
    return float(np.mean([found.of(27.0, n) - found.of(9.0, n) for n in (4, 6)]))


def _tank(done: Experiments) -> Array:
    """Input by the tank's pressure if its air keeps its entropy, over the isothermal one [1]."""
    rows = [done.steep.row(*case) for case in MATRIX[90.0]]
    start, end = (done.steep.source[rows, k] + 101325.0 for k in (0, -1))
    return np.asarray(start * (1.0 - (end / start) ** 1.4) / (start - end))


def _idle(done: Experiments) -> list[Comparison]:
    alone = done.readings["as it is"][0].of(9.0, 2)
    bowed, struts = (float(done.idle[name].efficiency[0]) for name in ("bowed out", "struts"))
    push = float(entry("pam_a_1in").muscle.force(0.0, 0.10))
    return [
        say("force_vented_muscle", push),
        say("9_kg_rig", bowed / alone, 100 * bowed, 100 * alone, 100 * struts),
    ]


# ------------------------------------------------------------------------ in short


def tables() -> dict[str, str]:
    """The tables of efficiency, of work and of input energy, by group, as Markdown."""
    done = latest()
    head = ["| up to | payload | 2 PAMs | 4 PAMs | 6 PAMs |", "|---|--:|--:|--:|--:|"]

    def lines(found: Cycles, cell: Callable[[Cycles, int], str], payloads: Sequence[float]) -> str:
        return "\n".join(
            f"| {found.high:.0f} deg | {p:g} kg | "
            + " | ".join(cell(found, found.row(p, n)) for n in MUSCLES)
            + " |"
            for p in payloads
        )

    def share(found: Cycles, row: int) -> str:
        mark = "" if found.cases[row] in MATRIX[found.high] else " *"
        cycles = int(found.followed()[row])
        few = "" if cycles == found.count else f" ({cycles})"
        return f"{100.0 * found.efficiency[row]:.1f}{mark}{few}"

    def joule(found: Cycles, row: int) -> str:
        return f"{found.work[row]:.0f} / {found.energy[row]:.0f}"

    every = (*PAYLOADS, *EXTENDED)
    note = (
        "*Efficiency (6.9) [%]; \\* not in Tables 6.2 and 6.3; in brackets the cycles that reached "
        f"the angle, where these are not all {done.cycles}.*"
    )
    efficiency = [
        *head,
        lines(done.flat, share, PAYLOADS),
        lines(done.steep, share, every),
        "",
        note,
        "",
        *head,
        lines(done.flat, _balanced, PAYLOADS),
        lines(done.steep, _balanced, PAYLOADS),
        "",
        "*The same by a quasi-static balance of other code (`tests/reference/recruitment.py`): no "
        f"valve, no controller, no inertia, {done.cycles} cycles.*",
        "",
        *loops.table(done),
    ]
    bare = [
        *head,
        lines(done.bare, share, PAYLOADS),
        "",
        note.replace("(6.9)", "(6.9) without rubber"),
    ]
    energy = [
        *head,
        lines(done.flat, joule, PAYLOADS),
        lines(done.steep, joule, PAYLOADS),
        "",
        f"*W_out (6.7) / E_in (6.8) [J] of {done.cycles} cycles.*",
    ]
    return {
        say.groups["cycles"]: "\n".join(efficiency),
        say.groups["rubber"]: "\n".join(bare),
        say.groups["tests"]: "\n".join(energy),
    }


def _balanced(found: Cycles, row: int) -> str:
    """Efficiency of a case by the quasi-static balance, in words."""
    return f"{100.0 * loops.balance(*found.cases[row], found.high, found.count):.1f}"


def in_short(rows: list[Comparison]) -> list[str]:
    """A few sentences about the statements."""
    done = latest()
    told = Told(rows, say.groups, 1)

    def spread(name: str) -> tuple[str, str]:
        return tuple(  # type: ignore[return-value]
            f"{values.min():.0f} to {values.max():.0f}"
            for values in (100.0 * _of(found, MATRIX[90.0]) for found in done.readings[name])
        )

    own, gauge, heavy = (spread(name) for name in ("as it is", _GAUGE, "arm of 11 kg m"))
    loaded = tuple((p, n) for p, n in MATRIX[90.0] if p > 0.0)
    part = [100.0 * _of(found, loaded) for found in (done.steep, done.bare)]
    volume = done.suspects[_VOLUME]
    base = done.readings["as it is"][0]
    rows_ = [base.row(*case) for case in MATRIX[90.0]]
    more = 100.0 * (volume.energy / base.energy[rows_] - 1.0)
    warm = 100.0 * (
        done.suspects["temperature of the muscles' air"].energy / base.energy[rows_] - 1.0
    )
    named = {name: told.row("suspects", _shown(name)) for name in _NAMED}
    trends = [
        row for row in rows if row.group == say.groups["cycles"] and row.where.startswith("6.4.3")
    ]
    bare = {name: done.readings[name][1] for name in ("as it is", _GAUGE)}
    could = [name for name, row in named.items() if row.verdict == "agree"]
    cannot = [name for name, row in named.items() if row.verdict != "agree"]
    return say.short(
        (own[0], own[1], part[0].min(), part[0].max(), part[1].min(), part[1].max()),
        (_bound(done), gauge[0], gauge[1], heavy[0], heavy[1]),
        (
            _by_number(bare[_GAUGE], 0.0),
            _by_number(bare[_GAUGE], 27.0),
            *(loops.by_number(payload, rubber=False, gauge=True) for payload in (0.0, 27.0)),
        ),
        (sum(row.verdict == "agree" for row in trends), told.ours("tests", _SPREAD, 2)),
        (
            " and ".join(could) if could else "none",
            f"; {' and '.join(cannot)} cannot" if cannot else "",
            more.min(),
            more.max(),
            warm.min(),
            warm.max(),
        ),
    )


def _by_number(found: Cycles, payload: float) -> str:
    """Efficiency [%] of a payload with 2, 4 and 6 muscles, in words."""
    return ", ".join(f"{100.0 * found.of(payload, n):.1f}" for n in MUSCLES)


def _shown(suspect: str) -> str:
    return f"{suspect}: input with it over that without, least of the ten cases"
