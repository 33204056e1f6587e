"""Chapter 5 of the 2014 dissertation, advanced control: its statements beside what the simulated
shoulder gives.

Its results are pictures without numbers, so that most statements are orders: this error is below
that one. One set of gains serves every statement; what is neither printed nor known of its rig is
in :func:`chosen`. Nothing is tuned to agree.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pamrs.rigs import shoulder
from reproduction import chapter5_comparison, tracking
from reproduction.chapter5_statements import listed, say
from reproduction.comparison import Comparison
from reproduction.margins import inner_margin, loop_margin
from reproduction.statement_tables import Told
from reproduction.statements import Lines
from reproduction.tracking import KINDS, PAYLOADS, SETTLED, Track
from reproduction.tracking_runs import FULL, MIDDLE, STARTS, TRIALS, WRONG, Plan
from reproduction.waves import TABLE_5_1, waves

#: Mean squared error at the top of the axis of Fig. 5.8(c), as an rms [deg].
_AXIS: Final = math.sqrt(400.0)
#: Pressure at which Gaylord's force is compared [Pa].
_BLOWN: Final = 8e5
_SWITCHING: Final = (2e5, 4e5, 8e5, 1.6e6, 3.2e6)

Progress = Callable[[str], None]
Array = NDArray[np.float64]


def facts(
    *, search: bool = True, progress: Progress | None = None, plan: Plan = FULL
) -> list[Comparison]:
    """Every statement of the chapter beside ours.

    Parameters
    ----------
    search : bool
        Whether the grids of gains and the diagnosis run too.
    progress : callable, optional
        Called with what is done next.
    plan : Plan
        How long the experiments are; only the full one says anything.

    Returns
    -------
    list of Comparison
    """
    tell = progress or (lambda _: None)
    parts: dict[str, Callable[[], list[Comparison]]] = {
        "rig, trajectory, gains": lambda: _rig(plan, search),
        "sliding": lambda: _sliding(plan),
        "adaptive sliding": lambda: _adaptive(plan),
        "networks": lambda: _neural(plan),
        f"adaptive sliding, {plan.training:g} s of training": lambda: (
            [] if plan.trained("adaptive sliding") else []
        ),
        f"networks, {plan.training:g} s of training": lambda: [] if plan.trained("neural") else [],
        "compound trajectory": lambda: chapter5_comparison.compound(plan),
        "lift, hold, return": lambda: chapter5_comparison.lift(plan),
        "effects": lambda: chapter5_comparison.effects(plan),
        "hysteresis": lambda: chapter5_comparison.hysteresis(plan, search),
    }
    rows: list[Comparison] = []
    for text, part in parts.items():
        tell(f"chapter 5: {text}")
        rows += part()
    return say.scored(rows)


def chosen() -> list[tuple[str, str, str]]:
    """Name, value with its unit, and reason of each number that the chapter does not give."""
    gains, loop = tracking.GAINS, tracking.LOOP
    surface = gains["sliding"]
    pid, own = gains["cascaded PID"], gains["neural"]["gains"]
    return say.chosen(
        tracking.SOURCE_VOLUME,
        MIDDLE,
        1000.0 * tracking.PERIOD,
        loop["kp"],
        loop["ki"],
        1000.0 * loop["pressure_filter"],
        surface["slope"],
        1e-06 * surface["switching"],
        surface["boundary_layer"],
        1e-06 * pid["kp"],
        1e-06 * pid["ki"],
        1e-06 * pid["kd"],
        ", ".join(f"{g:g}" for g in gains["adaptive sliding"]["gains"]),
        ", ".join(f"{g:g}" for g in own),
    )


# --------------------------------------------------------------------------- 5.2, 5.4


def _rig(plan: Plan, search: bool) -> list[Comparison]:
    rows, arm = say.lines(), tracking.arm_model(PAYLOADS)
    inertia = np.asarray(arm.inertia)
    rows.say("inertia_50_lb", inertia[-1] / inertia[0])
    wanted = np.degrees(waves(plan.record).sampled(tracking.PERIOD)[1].angle)
    printed = _phase_zero(plan)
    rows.say("smallest_angle_5", printed.min(), wanted.min())
    rows.say("largest_angle_5", printed.max(), wanted.max())
    fastest = max(w for _, w in _table())
    rows.say("largest_frequency", fastest / (2.0 * math.pi))
    torque: Any = arm.torque
    rows.say("simplified_torque_5", 100.0 * torque.relative, torque.rms, torque.largest)
    if search:
        for kind in tracking.GRIDS:
            found = tracking.tuned(kind, duration=min(plan.record, 30.0))
            best = found.gains[found.chosen]
            used = all(tracking.GAINS[kind][name] == value for name, value in best.items())
            rows.say(
                "gains_used_are",
                float(used),
                kind,
                len(found.gains),
                listed(found.j[:, found.chosen]),
                listed(found.rms[:, found.chosen]),
                tracking.MOST_J,
            )
    return rows


def _phase_zero(plan: Plan) -> Array:
    """(5.24) with a triangle of phase 0, which begins at its mean and rises [deg]."""
    time = np.arange(0.0, plan.record + 0.5 * tracking.PERIOD, tracking.PERIOD)
    cosines = sum(a * np.cos(w * time) for a, w in _table())
    triangle = 20.0 / math.pi * np.arcsin(np.sin(2.0 * math.pi * 0.16 * time))
    return np.asarray(60.0 + cosines + triangle)


def _table() -> tuple[tuple[float, float], ...]:
    return TABLE_5_1


# ------------------------------------------------------------------------------- 5.4.1


def _sliding(plan: Plan) -> list[Comparison]:
    rows, run = say.lines(), plan.estimates()
    end = float(run.time[-1])
    rms = run.rms().reshape(len(PAYLOADS), len(WRONG))
    later, ripple = run.rms(0.5 * end) / run.rms(min(SETTLED, 0.1 * end), 0.5 * end), run.ripple()
    for k, factor in ((1, "0.1"), (2, "10")):
        for p, payload in enumerate(PAYLOADS):
            row = p * len(WRONG) + k
            rows.say(
                "error_estimates_times",
                rms[p, k],
                factor,
                payload,
                later[row],
                ripple[row],
                _why_far(factor, payload, rms[p, k]),
            )
    rows.say(
        "exact_better_wrong",
        float((rms[:, 0] / rms[:, 1:].min(axis=1)).max()),
        listed(rms[:, 0]),
    )
    rows.say("error_above_1", float(ripple[:: len(WRONG)].max()))
    free, loaded = (plan.switching(_SWITCHING, payload) for payload in (0.0, MIDDLE))
    text = [
        f"{payload:g} lb, times {factor}: {listed(values, 0)} deg"
        for payload, tried in ((0.0, free), (MIDDLE, loaded))
        for factor, values in zip(("10", "0.1"), tried.rms().reshape(2, -1), strict=True)
    ]
    least = max(values.min() for values in loaded.rms().reshape(2, -1))
    rows.say("25_lb_switching", least, listed([1e-06 * v for v in _SWITCHING], 1), "; ".join(text))
    return rows


def _why_far(factor: str, payload: float, error: float) -> str:
    """Why ten times the estimates of a loaded arm are too much."""
    if factor != "10" or error <= _AXIS:
        return ""
    weight = float(np.asarray(tracking.arm_model([payload]).weight)[0])
    return (
        f"nine weights too many, {9.0 * weight:.0f} N m, are more than the muscles have (890 N m "
        "at 13 bar and 90 deg, chapter 3), so that full pressure is asked for and the arm lies "
        "near its upper stop: the published curve is that of a light arm, as ours is with 0 lb"
    )


# ------------------------------------------------------------------------------- 5.4.2


def share_by_angle(angle: Array, values: Array, bins: int = 12) -> float:
    """How much of a signal's variance, its straight line in time taken off, goes with the angle
    alone [1].

    Parameters
    ----------
    angle, values : ndarray, shape (samples,)
        At even times.
    bins : int
        Of the angle, each with as many samples.

    Returns
    -------
    float
        0 where it does not vary.
    """
    time = np.linspace(-1.0, 1.0, values.size)
    rest = values - np.polyval(np.polyfit(time, values, 1), time)
    total = float(np.var(rest))
    if total <= 1e-18 * max(1.0, float(np.mean(values**2))):
        return 0.0
    order = np.array_split(np.argsort(angle), bins)
    return float(
        sum(part.size * rest[part].mean() ** 2 for part in order if part.size) / (rest.size * total)
    )


def _adaptive(plan: Plan) -> list[Comparison]:
    rows, run = say.lines(), plan.adaptation()
    notes = {name: np.array(run.noted[name]) for name in ("inertia", "viscous", "weight")}
    _learning(rows, run)
    _estimates(rows, run, notes)
    _weight_by_angle(rows, run, notes["weight"])
    _long_run(rows, plan)
    return rows


def _learning(rows: Lines, run: Track) -> None:
    """Fig. 5.9: the error of each trial, early and late."""
    end = float(run.time[-1])
    early, late = run.rms(min(SETTLED, 0.1 * end), 0.3 * end), run.rms(0.8 * end)
    ripple = run.ripple(0.8 * end)
    text = {
        name: f"{early[k]:.2f} deg to {0.3 * end:.0f} s, {late[k]:.2f} deg in the last fifth; "
        f"above 1.5 Hz {ripple[k]:.2f} deg"
        for k, name in enumerate(TRIALS)
    }
    grown = dict(zip(TRIALS, late / early, strict=True))
    printed = [name for name in TRIALS if name.startswith("Trial")]
    rows.say(
        "late_error_early",
        max(grown[name] for name in printed),
        "; ".join(f"{name} {grown[name]:.2f}, {text[name]}" for name in printed),
    )
    rows.say("higher_gains", late[1] / late[0])
    for name in TRIALS:
        if name not in printed:
            rows.say("late_error_early_error", grown[name], name, text[name])


def _estimates(rows: Lines, run: Track, notes: dict[str, Array]) -> None:
    """Fig. 5.10: the estimates of I and b, where they end and whether they come to rest."""
    final = notes["inertia"][-1]
    rows.say(
        "largest_smallest_final",
        float(final[:3].max() / max(final[:3].min(), 1e-09)),
        listed(final[:3], 0),
        float(np.asarray(tracking.arm_model([MIDDLE]).inertia)[0]),
        listed(notes["viscous"][-1][:3], 0),
    )
    fifth = max(1, len(run.noted_at) // 5)
    for name, label in (("inertia", "I"), ("viscous", "b")):
        values = notes[name][:, :3]
        moved = np.abs(values[-1] - values[-1 - fifth]) / np.maximum(np.ptp(values, axis=0), 1e-9)
        rows.say("move_last_fifth", float(moved.max()), label, listed(moved))


def _weight_by_angle(rows: Lines, run: Track, weight: Array) -> None:
    """Fig. 5.10: how far the estimate of m g r goes with the angle."""
    own = list(TRIALS).index("ours")
    half = len(run.noted_at) // 2
    shares = []
    for k in range(len(TRIALS)):
        bent = np.interp(run.noted_at, run.time, run.angle[k])
        shares.append(share_by_angle(bent[half:], weight[half:, k]))
    rows.say("share_estimate_m", shares[0], np.ptp(weight[:, 0]))
    rows.say("our_gain_m", shares[own], np.ptp(weight[half:, own]))


def _long_run(rows: Lines, plan: Plan) -> None:
    """5.5: the error after a long time of learning."""
    trained = plan.trained("adaptive sliding")
    if trained is None:
        return
    bare = [k for k, case in enumerate(plan.cases) if case[1] == ""]
    last = float(trained.time[-1])
    first, end_ = trained.rms(SETTLED, 0.1 * last + SETTLED), trained.rms(0.9 * last)
    worst = max(bare, key=lambda k: end_[k] / first[k])
    rows.say(
        "error_end_s",
        float(end_[worst] / first[worst]),
        plan.training,
        listed(first[bare]),
        listed(end_[bare]),
        listed([plan.cases[k][0] for k in bare], 0),
        listed(np.asarray(trained.learnt["inertia"])[bare], 1),
    )


# ------------------------------------------------------------------------------- 5.4.3


def _neural(plan: Plan) -> list[Comparison]:
    rows, zero, later = say.lines(), plan.learning(), plan.prepared()
    _from_zero(rows, zero)
    _from_model(rows, zero, later)
    _from_training(rows, zero, later)
    _from_gaylord(rows, zero, later)
    return rows


#: Runs from zero by their payload, and the runs that begin otherwise, as :data:`STARTS` and
#: ``Plan.prepared`` have them.
_ZERO: Final = {payload: k for k, (_, payload) in enumerate(STARTS)}
_MODEL, _TAUGHT, _GUESS = 0, 1, 2


def _from_zero(rows: Lines, zero: Track) -> None:
    """Fig. 5.14: networks that know nothing, by payload."""
    end = float(zero.time[-1])
    early, late, whole = zero.rms(0.0, 0.2 * end), zero.rms(0.8 * end), zero.rms(0.0)
    for payload in PAYLOADS:
        k = _ZERO[payload]
        rows.say(
            "error_last_fifth_first",
            late[k] / early[k],
            payload,
            listed([float(zero.rms(a * end / 5, (a + 1) * end / 5)[k]) for a in range(5)]),
        )
    for low, high in ((0.0, 25.0), (25.0, 50.0)):
        rows.say(
            "error_record_lb",
            whole[_ZERO[high]] / whole[_ZERO[low]],
            high,
            low,
            late[_ZERO[high]],
            late[_ZERO[low]],
        )
    rows.say("error_last_fifth", late[_ZERO[50.0]])


def _gravity(zero: Track) -> tuple[Array, NDArray[np.bool_]]:
    """The network of G that 50 lb teach from zero, and where the arm was with them."""
    weights = np.array(zero.noted["G"][-1])[_ZERO[50.0]]
    return weights, (weights > 0.0) & _visited(zero, _ZERO[50.0], weights.size)


def _from_model(rows: Lines, zero: Track, later: Track) -> None:
    """Figs. 5.11 to 5.13: a start from the simplified model, and what both networks come to."""
    rows.say("squared_error_start", later.nu()[_MODEL] / zero.nu()[_ZERO[50.0]])
    (weights, seen), other = _gravity(zero), np.array(later.noted["G"][-1])[_MODEL]
    rows.say(
        "deviation_G_zero",
        float(np.sqrt(np.mean((weights[seen] - other[seen]) ** 2)) / np.mean(other[seen])),
    )
    degrees = np.degrees(np.linspace(*tracking.arm_model([0.0]).angle_range, weights.size))
    above = (degrees > 94.0) & (degrees < 111.0)
    rows.say("G_zero_G", float(weights[above].mean() / other[above].mean()))


def _from_training(rows: Lines, zero: Track, later: Track) -> None:
    """Figs. 5.16 and 5.17: a start from what 15 lb taught."""
    rows.say("squared_error_after", later.nu()[_TAUGHT] / zero.nu()[_ZERO[50.0]])
    _, seen = _gravity(zero)
    old, new = (float(np.array(later.noted["G"][k])[_TAUGHT][seen].mean()) for k in (0, -1))
    rows.say("mean_G_after", new / old)


def _from_gaylord(rows: Lines, zero: Track, later: Track) -> None:
    """Figs. 5.21 and 5.22: a start from Gaylord's estimate."""
    rows.say("squared_error_gaylord", later.nu()[_GUESS] / zero.nu()[_ZERO[0.0]])
    for name in ("C", "G"):
        first, last = (np.array(later.noted[name][k])[_GUESS] for k in (0, -1))
        there = _visited(later, _GUESS, first.size)
        rows.say("mean_after_learning", float(last[there].mean() / first[there].mean()), name)

    muscle, e = shoulder().muscle, np.array([0.0, 0.25])
    assert muscle is not None
    force = muscle.replace(model="gaylord").force(_BLOWN, e) / muscle.force(_BLOWN, e)
    fine = np.linspace(0.0, 0.25, 101)
    least = (muscle.replace(model="gaylord").force(_BLOWN, fine) / muscle.force(_BLOWN, fine)).min()
    rows.say("gaylord_s_force", float(least), force[0], force[1])


def _visited(run: Track, row: int, nodes: int) -> NDArray[np.bool_]:
    """Nodes next to angles in which the arm was for a second at least."""
    low, high = tracking.arm_model([0.0]).angle_range
    place = np.clip((run.angle[row] - low) / (high - low) * (nodes - 1), 0.0, nodes - 1.0)
    samples = np.bincount(np.rint(place).astype(int), minlength=nodes)
    return np.asarray(samples >= 1.0 / tracking.PERIOD)


def tables() -> dict[str, str]:
    """How far the loops are from a limit cycle, as Markdown, by group."""
    loop = {name: tracking.LOOP[name] for name in ("kp", "ki", "pressure_filter")}
    null, steep = (
        f"{inner_margin(tracking.plant(0.0), loop, tracking.PERIOD, slope):.2f}"
        for slope in ("null", "steepest")
    )
    lines = [
        "| payload | pressure loop next to the valve's null: gains may grow by "
        "| where the valve is steepest | cascaded PID: gain may grow by "
        "| sliding: gain may grow by |",
        "|--:|--:|--:|--:|--:|",
    ]
    for payload in PAYLOADS:
        whole = [_whole(kind, payload) for kind in ("cascaded PID", "sliding")]
        lines.append(f"| {payload:g} lb | {null} | {steep} | {' | '.join(whole)} |")
    lines += [
        "",
        "*The pressure loop at its fastest point: the source at its pressure, the muscles at rest "
        "length. Above 1 next to the null there is no limit cycle; where the valve is steepest, "
        "from a quarter to three quarters open, it passes in large moves only. Whole loops about "
        "30, 60 and 90 deg, in small motions inside the boundary layer, where the valve is "
        "steepest. Below 1, as without a payload, small motions grow that dry friction does not "
        "hold: lines about 0 lb say what they do above 1.5 Hz. Adaptive sliding and the networks "
        "are sliding with what they have learnt.*",
    ]
    return {say.groups["rig"]: "\n".join(lines)}


def _whole(kind: str, payload: float) -> str:
    """Least margin of a whole loop, in words."""
    arm = tracking.arm_model([payload])
    one = arm.replace(
        **{
            name: float(np.asarray(getattr(arm, name))[0])
            for name in ("inertia", "viscous", "weight")
        }
    )
    found = [
        loop_margin(
            tracking.plant(payload), lambda: tracking.controller(kind, one), math.radians(angle)
        )
        for angle in (30.0, 60.0, 90.0)
    ]
    return f"{min(found):.2f}"


def in_short(rows: Lines) -> list[str]:
    """What the table comes to, in a few sentences with its numbers.

    Parameters
    ----------
    rows : list of Comparison
        What :func:`facts` returns.

    Returns
    -------
    list of str
    """
    ours = Told(rows, say.groups, 2).ours
    held = [row for row in rows if row.group == say.groups["effects"]]
    tells = [f"{row.fact.removeprefix('orders of 5.5 that hold, ')} {row.ours:.0f}" for row in held]
    restored = [
        (
            f"{row.fact.removeprefix('orders of 5.5 that hold, ')} restores: "
            f"{row.note.split('restored: ')[1].split('; lost')[0]}"
        )
        for row in held
        if "restored: " in row.note
    ]
    left = ours("hysteresis", "sliding error with compensation over without, plant with hysteresis")
    rms = ", ".join(f"{kind} {ours('compound', f'{kind}, {MIDDLE:g} lb: rms')}" for kind in KINDS)
    lift = ", ".join(f"{kind} {ours('lift', f'{kind}, {MIDDLE:g} lb: rms')}" for kind in KINDS)
    return say.short(
        (rms, lift),
        (held[0].published, ", ".join(tells), "".join(f" {text}." for text in restored)),
        (
            ours("sliding", "error with estimates times 10, 25 lb", 0),
            ours("sliding", "error with estimates times 10, 0 lb", 0),
        ),
        (
            ours("neural", "error of the last fifth, from zero, 50 lb", 1),
            ours("neural", "squared error after 15 lb of training, over from zero, 50 lb"),
        ),
        (left,),
    )
