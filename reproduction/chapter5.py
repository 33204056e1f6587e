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

from pamrs.comparison import Comparison, Told
from pamrs.rigs import shoulder
from reproduction import chapter5_comparison, tracking
from reproduction.chapter5_statements import GROUPS, Group, listed
from reproduction.score import OTHER, OWN, SAME, TRIAL, Apart, scored
from reproduction.tracking import KINDS, PAYLOADS, SETTLED, Track
from reproduction.tracking_runs import FULL, MIDDLE, STARTS, TRIALS, WRONG, Plan

__all__ = ["GROUPS", "TITLE", "chosen", "facts", "headings", "in_short", "share_by_angle"]

#: Lines that are no part of the score: of one statement with several payloads that of 25 lb counts,
#: the payload taken where the chapter names none, else the first.
APART: Final[tuple[Apart, ...]] = (
    (".*", ".*: the gains used are the best of the grid", OWN),
    ("sliding.*", "error with estimates times .*, (0|50) lb", SAME),
    ("sliding.*", "the same with 25 lb and a switching gain .*", OWN),
    ("adaptive.*", "late error over early error, (ten times ours .*|ours)", OTHER),
    ("adaptive.*", "move of b in the last fifth .*", SAME),
    ("adaptive.*", "the same with our gain of m g r", OTHER),
    ("neural.*", "error of the last fifth over the first, from zero, (0|50) lb", SAME),
    ("neural.*", "error over the record, 50 lb over 25 lb", SAME),
    ("neural.*", "mean G after learning over Gaylord's estimate, 0 lb", SAME),
    ("comparison.*", "neural over sliding in the last half of the record, 25 lb", OTHER),
    ("comparison.*", "neural at the end of its training over sliding, 25 lb", OTHER),
    ("comparison.*", "error above 1.5 Hz, adaptive sliding over neural", SAME),
    ("comparison.*", ".*: rms", OWN),
    ("what the model leaves out.*", ".*", TRIAL),
    ("hysteresis.*", "probability .*", OWN),
)
TITLE: Final = "Chapter 5: advanced control of manipulators"
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
    return scored(rows, APART)


def headings() -> dict[str, str]:
    """What is said above each group, where that is more than its name."""
    return {}


def chosen() -> list[tuple[str, str, str]]:
    """Name, value with its unit, and reason of each number that the chapter does not give."""
    gains, loop = tracking.GAINS, tracking.LOOP
    surface = gains["sliding"]
    pid, own = gains["cascaded PID"], gains["neural"]["gains"]
    return [
        (
            "supply.volume",
            f"{tracking.SOURCE_VOLUME:g} m3",
            "a constant source: 4.2.1 has a 'high pressure air source' and no volume; the "
            "library's 15 l run empty after some 220 s of this motion, and networks then learn the "
            "shortage",
        ),
        (
            "payload",
            f"{MIDDLE:g} lb",
            "where the chapter names none (Figs. 5.8 to 5.11, 5.19, 5.20); the middle one of 5.4.3",
        ),
        (
            "sampling",
            f"{1e3 * tracking.PERIOD:g} ms",
            "not printed; sensors without noise, so that the filters may be short",
        ),
        (
            "pressure loop",
            (
                f"{loop['kp']:.0e} V/Pa, {loop['ki']:.0e} V/(Pa s), filters of "
                f"{1e3 * loop['pressure_filter']:g} ms"
            ),
            (
                "not printed; with half of it the arm without payload oscillates under the "
                "switching gain that 50 lb need"
            ),
        ),
        (
            "lambda, KD, boundary layer",
            (
                f"{surface['slope']:g} 1/s, {1e-6 * surface['switching']:g} MPa over "
                f"{surface['boundary_layer']:g} rad/s"
            ),
            "not printed; one for the three laws, best J (4.18) at 25 lb of those that do not "
            "oscillate with another payload; KD of twice that oscillates without payload",
        ),
        (
            "cascaded PID",
            (
                f"{1e-6 * pid['kp']:g} MPa/rad, {1e-6 * pid['ki']:g} MPa/(rad s), "
                f"{1e-6 * pid['kd']:g} MPa s/rad"
            ),
            "not printed; chosen in the same way",
        ),
        (
            "Gamma of I, b, m g r",
            ", ".join(f"{g:g}" for g in gains["adaptive sliding"]["gains"]),
            "for the comparison; see Table 5.2",
        ),
        (
            "gamma_H, gamma_C, gamma_G",
            ", ".join(f"{g:g}" for g in own),
            "not printed; larger ones learn faster and fall back",
        ),
        (
            "hysteresis",
            "15 N + 0.8 cm2 P for each muscle",
            (
                "a plant's effect: 7 % of the torque at 60 deg and 50 psi; 5.2 names the loop of "
                "Fig. 5.2, not its size"
            ),
        ),
    ]


# --------------------------------------------------------------------------- 5.2, 5.4


def _rig(plan: Plan, search: bool) -> list[Comparison]:
    group, arm = Group("rig"), tracking.arm_model(PAYLOADS)
    inertia = np.asarray(arm.inertia)
    group.say(
        "inertia with 50 lb over that without",
        "5.4.3",
        30.0,
        inertia[-1] / inertia[0],
        tolerance=1.5,
    )
    wanted = np.degrees(tracking.waves(plan.record).sampled(tracking.PERIOD)[1].angle)
    low, high = (float(limit) for limit in (wanted.min(), wanted.max()))
    group.say(
        ("smallest angle of (5.24), above the arm's rest"),
        ("5.2: 15 to 110 deg"),
        15.0,
        low,
        ("deg"),
        relation=("above"),
        note=(
            "the phase of its triangle is not printed; ours begins low; the arm then lies on "
            "its stop"
        ),
    )
    group.say("largest angle of (5.24)", "5.2: 15 to 110 deg", 110.0, high, "deg", relation="below")
    fastest = max(w for _, w in _table())
    group.say(
        "largest frequency",
        "5.5",
        0.25,
        fastest / (2.0 * math.pi),
        "Hz",
        tolerance=0.005,
        note="the fastest sinusoid",
    )
    torque: Any = arm.torque
    group.say(
        "simplified torque (5.1) against the full model",
        "5.2, Fig. 5.2: 'fairly accurate'",
        math.nan,
        100.0 * torque.relative,
        "%",
        cannot_tell="no number is printed",
        note=(
            f"rms {torque.rms:.1f} N m, largest {torque.largest:.1f} N m from 15 to 110 deg and to "
            "the source's pressure"
        ),
    )
    if search:
        for kind in tracking.GRIDS:
            found = tracking.tuned(kind, duration=min(plan.record, 30.0))
            best = found.gains[found.chosen]
            used = all(tracking.GAINS[kind][name] == value for name, value in best.items())
            group.say(
                f"{kind}: the gains used are the best of the grid",
                "4.4.1: by J (4.18)",
                math.nan,
                float(used),
                cannot_tell="the chapter prints none",
                note=(
                    f"{len(found.gains)} sets, all payloads: J {listed(found.j[:, found.chosen])}, "
                    f"error {listed(found.rms[:, found.chosen])} deg with 0, 25, 50 lb; best J at "
                    f"25 lb of those with at most {tracking.MOST_J:g}"
                ),
            )
    return group.rows


def _table() -> Any:
    from pamrs.control.trajectories import TABLE_5_1

    return TABLE_5_1


# ------------------------------------------------------------------------------- 5.4.1


def _sliding(plan: Plan) -> list[Comparison]:
    group, run = Group("sliding"), plan.estimates()
    end = float(run.time[-1])
    rms = run.rms().reshape(len(PAYLOADS), len(WRONG))
    later, ripple = run.rms(0.5 * end) / run.rms(min(SETTLED, 0.1 * end), 0.5 * end), run.ripple()
    for k, factor in ((1, "0.1"), (2, "10")):
        for p, payload in enumerate(PAYLOADS):
            row = p * len(WRONG) + k
            group.say(
                f"error with estimates times {factor}, {payload:g} lb",
                "5.4.1: 'remains stable'; top of the axis of Fig. 5.8(c)",
                _AXIS,
                rms[p, k],
                "deg",
                relation="below",
                note=(
                    f"rms from {SETTLED:g} s; second half over first half {later[row]:.2f}, above "
                    f"1.5 Hz {ripple[row]:.2f} deg: bounded, no oscillation"
                )
                + _why_far(factor, payload, rms[p, k]),
            )
    group.smaller(
        "exact over the better of the wrong estimates, largest of the payloads",
        "5.4.1: 'lowest error'",
        float((rms[:, 0] / rms[:, 1:].min(axis=1)).max()),
        f"{listed(rms[:, 0])} deg with 0, 25, 50 lb",
    )
    group.say(
        "error above 1.5 Hz with exact estimates",
        "5.4.1: 'smooth, chatter-free'",
        math.nan,
        float(ripple[:: len(WRONG)].max()),
        "deg",
        cannot_tell="no number is printed",
        note="with a boundary layer; the corners of the triangle wave are part of it",
    )
    free, loaded = (plan.switching(_SWITCHING, payload) for payload in (0.0, MIDDLE))
    text = [
        f"{payload:g} lb, times {factor}: {listed(values, 0)} deg"
        for payload, tried in ((0.0, free), (MIDDLE, loaded))
        for factor, values in zip(("10", "0.1"), tried.rms().reshape(2, -1), strict=True)
    ]
    least = max(values.min() for values in loaded.rms().reshape(2, -1))
    group.say(
        "the same with 25 lb and a switching gain of its own for each factor",
        "5.4.1",
        _AXIS,
        least,
        "deg",
        relation="below",
        note=(f"KD {listed([1e-6 * v for v in _SWITCHING], 1)} MPa over the same layer: ")
        + ("; ").join(text)
        + (
            "; no single KD serves both factors: what 10 times the weight needs chatters with a "
            "tenth of it"
        ),
    )
    return group.rows


def _why_far(factor: str, payload: float, error: float) -> str:
    """Why ten times the estimates of a loaded arm are too much."""
    if factor != "10" or error <= _AXIS:
        return ""
    weight = float(np.asarray(tracking.arm_model([payload]).weight)[0])
    return (
        f"; nine weights too many, {9.0 * weight:.0f} N m, are more than the muscles have (890 N m "
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
    group, run = Group("adaptive"), plan.adaptation()
    notes = {name: np.array(run.noted[name]) for name in ("inertia", "viscous", "weight")}
    _learning(group, run)
    _estimates(group, run, notes)
    _weight_by_angle(group, run, notes["weight"])
    _long_run(group, plan)
    return group.rows


def _learning(group: Group, run: Track) -> None:
    """Fig. 5.9: the error of each trial, early and late."""
    end = float(run.time[-1])
    early, late = run.rms(min(SETTLED, 0.1 * end), 0.3 * end), run.rms(0.8 * end)
    ripple = run.ripple(0.8 * end)
    for k, name in enumerate(TRIALS):
        text = (
            f"{early[k]:.2f} deg to {0.3 * end:.0f} s, {late[k]:.2f} deg in the last fifth; above "
            f"1.5 Hz {ripple[k]:.2f} deg"
        )
        if name.startswith("Trial"):
            group.smaller(
                f"late error over early error, {name}", "5.4.2, Fig. 5.9", late[k] / early[k], text,
                cannot_tell="the unit of the printed gains is not stated; SI with radians here",
            )  # fmt: skip
        else:
            group.smaller(
                (f"late error over early error, {name}"),
                ("5.4.2: 'somewhat useful for improving trajectory-following'"),
                late[k] / early[k],
                text,
            )


def _estimates(group: Group, run: Track, notes: dict[str, Array]) -> None:
    """Fig. 5.10: the estimates of I and b, where they end and whether they come to rest."""
    final = notes["inertia"][-1]
    group.say(
        "largest over smallest final estimate of I, Trials 1 to 3",
        "5.4.2: 'dependent upon choice of adaptive gains'",
        1.0,
        float(final[:3].max() / max(final[:3].min(), 1e-9)),
        relation="above",
        note=(
            f"I {listed(final[:3], 0)} kg m2 (arm "
            f"{float(np.asarray(tracking.arm_model([MIDDLE]).inertia)[0]):.1f}), b "
            f"{listed(notes['viscous'][-1][:3], 0)} N m s/rad; Fig. 5.10 has axes to 1500 and 200"
        ),
    )
    fifth = max(1, len(run.noted_at) // 5)
    for name, label in (("inertia", "I"), ("viscous", "b")):
        values = notes[name][:, :3]
        moved = np.abs(values[-1] - values[-1 - fifth]) / np.maximum(np.ptp(values, axis=0), 1e-9)
        group.say(
            f"move of {label} in the last fifth over all it moved, largest of the trials",
            "5.4.2: 'do not converge'",
            0.05,
            float(moved.max()),
            relation="above",
            note=f"Trials 1 to 3: {listed(moved)}",
        )


def _weight_by_angle(group: Group, run: Track, weight: Array) -> None:
    """Fig. 5.10: how far the estimate of m g r goes with the angle."""
    own = list(TRIALS).index("ours")
    half = len(run.noted_at) // 2
    shares = []
    for k in range(len(TRIALS)):
        bent = np.interp(run.noted_at, run.time, run.angle[k])
        shares.append(share_by_angle(bent[half:], weight[half:, k]))
    group.say(
        "share of the estimate of m g r that goes with the angle, Trial 1",
        "5.4.2, Fig. 5.10: 'angle dependence, most notably in Trial 1'",
        0.25,
        shares[0],
        relation="above",
        cannot_tell=(
            "the unit of m g r in Table 5.2 cannot be recovered (Fig. 5.10 has 0.2 to 0.8 where 25 "
            "lb weigh 118 N m)"
        ),
        note=f"as printed it moves by {np.ptp(weight[:, 0]):.2f} N m only",
    )
    group.say(
        "the same with our gain of m g r",
        "5.4.2, Fig. 5.10",
        0.25,
        shares[own],
        relation="above",
        note=(
            f"second half, its trend taken off; {np.ptp(weight[half:, own]):.1f} N m of ripple: "
            "what the cubic C1 and C2 miss is taken for weight, as the chapter supposes"
        ),
    )


def _long_run(group: Group, plan: Plan) -> None:
    """5.5: the error after a long time of learning."""
    trained = plan.trained("adaptive sliding")
    if trained is None:
        return
    rows = [k for k, case in enumerate(plan.cases) if case[1] == ""]
    last = float(trained.time[-1])
    first, end_ = trained.rms(SETTLED, 0.1 * last + SETTLED), trained.rms(0.9 * last)
    worst = max(rows, key=lambda k: end_[k] / first[k])
    group.say(
        f"error at the end of {plan.training:g} s over that at its begin, worst payload",
        (
            "5.5: 'appeared to diverge; if the system runs for an extended duration, instability "
            "may occur'"
        ),
        1.0,
        float(end_[worst] / first[worst]),
        relation="above",
        note=(
            f"{listed(first[rows])} deg, then {listed(end_[rows])} deg with "
            f"{listed([plan.cases[k][0] for k in rows], 0)} lb; estimates of I "
            f"{listed(np.asarray(trained.learnt['inertia'])[rows], 1)} kg m2"
        ),
    )


# ------------------------------------------------------------------------------- 5.4.3


def _neural(plan: Plan) -> list[Comparison]:
    group, zero, later = Group("neural"), plan.learning(), plan.prepared()
    _from_zero(group, zero)
    _from_model(group, zero, later)
    _from_training(group, zero, later)
    _from_gaylord(group, zero, later)
    return group.rows


#: Runs from zero by their payload, and the runs that begin otherwise, as :data:`STARTS` and
#: ``Plan.prepared`` have them.
_ZERO: Final = {payload: k for k, (_, payload) in enumerate(STARTS)}
_MODEL, _TAUGHT, _GUESS = 0, 1, 2


def _from_zero(group: Group, zero: Track) -> None:
    """Fig. 5.14: networks that know nothing, by payload."""
    end = float(zero.time[-1])
    early, late, whole = zero.rms(0.0, 0.2 * end), zero.rms(0.8 * end), zero.rms(0.0)
    for payload in PAYLOADS:
        k = _ZERO[payload]
        group.smaller(
            (f"error of the last fifth over the first, from zero, {payload:g} lb"),
            ("5.4.3, Fig. 5.14"),
            late[k] / early[k],
            ("rms by fifths of the record ")
            + listed([float(zero.rms(a * end / 5, (a + 1) * end / 5)[k]) for a in range(5)])
            + (" deg"),
        )
    for low, high in ((0.0, 25.0), (25.0, 50.0)):
        group.say(
            (f"error over the record, {high:g} lb over {low:g} lb"),
            ("5.4.3: 'Generally, error increases with increasing payload'"),
            1.0,
            whole[_ZERO[high]] / whole[_ZERO[low]],
            relation="above",
            note=f"last fifth {late[_ZERO[high]]:.2f} against {late[_ZERO[low]]:.2f} deg",
        )
    group.say(
        "error of the last fifth, from zero, 50 lb",
        "5.4.3: 'nearly converged', 'with very low error'",
        math.nan,
        late[_ZERO[50.0]],
        "deg",
        cannot_tell="no number is printed",
    )


def _gravity(zero: Track) -> tuple[Array, NDArray[np.bool_]]:
    """The network of G that 50 lb teach from zero, and where the arm was with them."""
    weights = np.array(zero.noted["G"][-1])[_ZERO[50.0]]
    return weights, (weights > 0.0) & _visited(zero, _ZERO[50.0], weights.size)


def _from_model(group: Group, zero: Track, later: Track) -> None:
    """Figs. 5.11 to 5.13: a start from the simplified model, and what both networks come to."""
    group.smaller(
        "squared error with a start from the model, over from zero, 50 lb",
        "5.4.3, Fig. 5.11",
        later.nu()[_MODEL] / zero.nu()[_ZERO[50.0]],
        "the simplified model with the right numbers; the chapter's was an overestimate",
    )
    (weights, seen), other = _gravity(zero), np.array(later.noted["G"][-1])[_MODEL]
    group.say(
        "deviation of G from zero from G from the model, over its mean, where the arm was",
        "5.4.3, Figs. 5.12 and 5.13: 'very similar'",
        0.1,
        float(np.sqrt(np.mean((weights[seen] - other[seen]) ** 2)) / np.mean(other[seen])),
        relation="below",
        note=(
            "10 % counts as similar; H from zero stays far below the arm's and C goes to its "
            "bound: the motion is slow"
        ),
    )
    degrees = np.degrees(np.linspace(*tracking.arm_model([0.0]).angle_range, weights.size))
    above = (degrees > 94.0) & (degrees < 111.0)
    group.say(
        "G from zero over G from the model, 95 to 110 deg, 50 lb",
        "5.4.3: 'at angles above 90 deg is limited'",
        0.5,
        float(weights[above].mean() / other[above].mean()),
        relation="below",
        note="the arm falls back where it has not been; half counts as limited",
    )


def _from_training(group: Group, zero: Track, later: Track) -> None:
    """Figs. 5.16 and 5.17: a start from what 15 lb taught."""
    group.smaller(
        "squared error after 15 lb of training, over from zero, 50 lb",
        "5.4.3, Fig. 5.17",
        later.nu()[_TAUGHT] / zero.nu()[_ZERO[50.0]],
        "the figure's legend has 10 lb, the text 15",
    )
    _, seen = _gravity(zero)
    old, new = (float(np.array(later.noted["G"][k])[_TAUGHT][seen].mean()) for k in (0, -1))
    group.say(
        "mean G after 50 lb over that after 15 lb",
        "5.4.3, Fig. 5.16",
        1.0,
        new / old,
        relation="above",
    )


def _from_gaylord(group: Group, zero: Track, later: Track) -> None:
    """Figs. 5.21 and 5.22: a start from Gaylord's estimate."""
    group.smaller(
        "squared error with Gaylord's estimate, over from zero, 0 lb",
        "5.5, Fig. 5.21: 'slightly reduces'",
        later.nu()[_GUESS] / zero.nu()[_ZERO[0.0]],
        "the approach from rest included, of either",
    )
    for name in ("C", "G"):
        first, last = (np.array(later.noted[name][k])[_GUESS] for k in (0, -1))
        there = _visited(later, _GUESS, first.size)
        group.say(
            (f"mean {name} after learning over Gaylord's estimate, 0 lb"),
            ("5.5, Fig. 5.22: 'initial estimate provided by this model is low'"),
            1.0,
            float(last[there].mean() / first[there].mean()),
            relation="above",
            note=(
                "as printed (5.25) is negative (3 L^2 < B^2): the shoulder's own length, braid and "
                "turns, r_eff of 0.7 in"
            ),
        )

    muscle, e = shoulder().muscle, np.array([0.0, 0.25])
    assert muscle is not None
    force = muscle.replace(model="gaylord").force(_BLOWN, e) / muscle.force(_BLOWN, e)
    fine = np.linspace(0.0, 0.25, 101)
    least = (muscle.replace(model="gaylord").force(_BLOWN, fine) / muscle.force(_BLOWN, fine)).min()
    group.say(
        "Gaylord's force over the muscle's, least up to 25 % contraction, 8 bar",
        (
            "5.5: 'the Gaylord model typically overestimates force (especially at large "
            "contractions)'"
        ),
        1.0,
        float(least),
        relation="above",
        note=f"{force[0]:.2f} at rest, {force[1]:.2f} at 25 %",
    )


def _visited(run: Track, row: int, nodes: int) -> NDArray[np.bool_]:
    """Nodes next to angles in which the arm was for a second at least."""
    low, high = tracking.arm_model([0.0]).angle_range
    place = np.clip((run.angle[row] - low) / (high - low) * (nodes - 1), 0.0, nodes - 1.0)
    samples = np.bincount(np.rint(place).astype(int), minlength=nodes)
    return np.asarray(samples >= 1.0 / tracking.PERIOD)


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
    ours = Told(rows, GROUPS, 2).ours
    held = [row for row in rows if row.group == GROUPS["effects"]]
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
    return [
        (
            f"After training the rms errors with 25 lb are {rms} deg on the compound trajectory "
            f"and {lift} deg on lift, hold and return."
        ),
        f"Of the {held[0].published:.0f} orders of 5.5 hold: {', '.join(tells)}; each effect is in "
        "the plant alone and unknown to the controllers, which were trained with "
        "it." + "".join(f" {text}." for text in restored),
        "Wrong estimates leave sliding bounded and without oscillation; with ten times the "
        "estimates of a loaded arm it is "
        f"{ours('sliding', 'error with estimates times 10, 25 lb', 0)} deg off, and "
        f"{ours('sliding', 'error with estimates times 10, 0 lb', 0)} deg without payload.",
        "Networks that know nothing come within "
        f"{ours('neural', 'error of the last fifth, from zero, 50 lb', 1)} deg with 50 lb in 100 "
        "s, and what 15 lb taught leaves "
        f"{ours('neural', 'squared error after 15 lb of training, over from zero, 50 lb')} of the "
        "squared error.",
        f"Compensation of the diagnosed hysteresis leaves {left} of sliding's error.",
    ]
