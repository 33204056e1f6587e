"""What the cases of a plan are: a design of strata, 24 cases to a round.

A round has every kind of truth and spreads strengths, rigs and ways to record over them at random,
each as often as in any other round. Rounds follow one another, so that case k of a seed is the same
however many are made; effects and parameters that came up least come next.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, TypeVar

import numpy as np

from .drive import FREE
from .effects.base import log_uniform
from .families import APART, BY_LABEL, FORMS, KNOWN, LATER, OTHER, UNLISTED, Form
from .labs import BITS, MISSING, RATES, Lab
from .pair import course as pair_course
from .pair.places import PLACES, has_place
from .rig_kinds import PAIR, RIGS, RigKind, stated
from .rigfile import split

T = TypeVar("T")
STRENGTHS = (1.5, 3.0, 10.0, 30.0, 100.0, 300.0)
PERCENTS = (0, 1, 3)
SIZES = (4.0, 15.0)
LEAST_SHARE = 0.3
ROUND = 24


@dataclass(frozen=True)
class Truth:
    """What a case of a round conceals: number of effects by mark, model error in percent, and
    whether a parameter is far off.
    """

    marks: tuple[str, ...] = ()
    percent: int = 0
    wrong: bool = False


TRUTHS: tuple[Truth, ...] = (
    Truth(), Truth(), Truth(percent=1), Truth(percent=3),
    Truth(wrong=True), Truth(wrong=True), Truth(wrong=True, percent=1),
    Truth((KNOWN,), wrong=True), Truth((KNOWN,), percent=1, wrong=True),
    *(Truth((KNOWN,), percent) for percent in (0, 0, 1, 1, 3)),
    *(Truth((OTHER,), percent) for percent in (0, 0, 1, 1, 3)),
    *(Truth((UNLISTED,), percent) for percent in (0, 1)),
    Truth((KNOWN,) * 2), Truth((KNOWN,) * 3, 1), Truth((KNOWN,) * 4),
)  # fmt: skip
_RIGS = (
    *["shoulder"] * 9, *["elbow"] * 6, *["hanging_mass"] * 3, *["regulated_joint"] * 2,
    *["chamber"] * 3, "blow_down",
)  # fmt: skip


@dataclass(frozen=True)
class Plan:
    """A plan of strata: the number that its seeds have apart from those of other plans, the rigs of
    a round, and the forms that it conceals.
    """

    number: int
    rigs: tuple[str, ...]
    forms: tuple[Form, ...]


SECOND, THIRD, PAIRS = "second", "third", "pair"
#: the second plan stays as it was, case by case; the third has every rig and every family
PLANS: dict[str, Plan] = {
    SECOND: Plan(2, _RIGS, FORMS),
    THIRD: Plan(
        3,
        (
            *["shoulder"] * 6, *["elbow"] * 5, *[PAIR] * 5, *["hanging_mass"] * 3,
            *["regulated_joint"] * 2, *["chamber"] * 2, "blow_down",
        ),
        (*FORMS, *LATER),
    ),
    PAIRS: Plan(4, (PAIR,) * ROUND, (*FORMS, *LATER)),
}  # fmt: skip
_RATES = (*[50] * 4, *[100] * 5, *[200] * 9, *[500] * 4, *[1000] * 2)
_FIT = ("multisine", "sealed_holds", "lift_hold")
_HELD = ("angle_steps", "slow_triangle")


@dataclass(frozen=True)
class Spec:
    """What a case is made from; `forms` are labels of :mod:`.families`,
    `strength` the noises that each of them leaves alone; of the parameters in `wrong`, with by how
    many tolerances they are off, the first is taken that leaves enough to be seen. `stated`: the
    rig file states the model error. `places`, of a pair: where each form acts, empty for what the
    sides share. `plan`: its name, empty for the second.
    """

    name: str
    seed: int
    rig: str
    lab: Lab
    recordings: tuple[tuple[str, str], ...]
    duration: float
    percent: int = 0
    forms: tuple[str, ...] = ()
    strength: float = 0.0
    wrong: tuple[tuple[str, float], ...] = ()
    stated: bool = False
    places: tuple[str, ...] = ()
    plan: str = ""

    def to_dict(self) -> dict[str, Any]:
        """As the key holds it: without places and plan where there are none."""
        told = {
            **asdict(self),
            "forms": list(self.forms),
            "wrong": [list(w) for w in self.wrong],
            "recordings": [list(r) for r in self.recordings],
            "places": list(self.places),
        }
        return {k: v for k, v in told.items() if k not in ("places", "plan") or v}


@dataclass
class _Deck:
    """Takes what came up least, by chance among equals."""

    rng: np.random.Generator
    drawn: Counter[str] = field(default_factory=Counter)

    def take(self, names: Iterable[str]) -> str:
        pool = sorted(names)
        least = min(self.drawn[n] for n in pool)
        name = str(self.rng.choice([n for n in pool if self.drawn[n] == least]))
        self.drawn[name] += 1
        return name


def _spread(rng: np.random.Generator, values: Sequence[T]) -> list[T]:
    return [values[i] for i in rng.permutation(len(values)).tolist()]


def possible(form: Form, rig: RigKind, lab: Lab) -> bool:
    """Whether a rig can have an effect, and these channels can show it."""
    if form.block not in rig.blocks or form.family in rig.without:
        return False
    if form.label == "leak_muscle/seal" and "muscle" not in rig.blocks:
        return False
    if form.family == "input_path_lag" and rig.name in ("regulated_joint", "blow_down"):
        return False
    if lab.missing:
        return form.block in ("muscle", "joint", "arm")
    return form.family not in ("pressure_lag", "clock_skew", "sensor_lag") or lab.rate >= 100


def _fits(truth: Truth, rig: str, lab: Lab) -> bool:
    """Whether a truth can be concealed on a rig that is recorded so."""
    if lab.one and lab.rate > 200:
        return False
    if lab.missing and "muscle" not in RIGS[rig].blocks:
        return False
    if len(truth.marks) > 1:
        return rig in ("shoulder", "elbow", PAIR) and not lab.missing
    if UNLISTED in truth.marks:
        return rig in ("shoulder", "elbow", "chamber", PAIR)
    return not (rig == "blow_down" and OTHER in truth.marks)


def _round(rng: np.random.Generator, rigs_: Sequence[str]) -> list[tuple[Truth, str, Lab]]:
    """Truths, rigs and ways to record of one round."""
    while True:
        labs = [
            Lab(rate, bits, drop, missing, one)
            for rate, bits, drop, missing, one in zip(
                _spread(rng, _RATES),
                _spread(rng, BITS * 6),
                _spread(rng, (*[True] * 6, *[False] * 18)),
                _spread(rng, (*MISSING * 2, *[""] * 20)),
                _spread(rng, (*[True] * 6, *[False] * 18)),
                strict=True,
            )
        ]
        if all(lab.rate <= 200 or not lab.one for lab in labs):
            break
    for _ in range(10_000):
        rigs, truths = _spread(rng, rigs_), _spread(rng, TRUTHS)
        found = list(zip(truths, rigs, labs, strict=True))
        if all(_fits(*one) for one in found):
            return found
    raise RuntimeError("no round fits")


def _forms(
    truth: Truth,
    rig: RigKind,
    lab: Lab,
    deck: _Deck,
    rng: np.random.Generator,
    every: Sequence[Form],
) -> tuple[str, ...]:
    """Forms of a case out of all those of a plan: half of the cases with several have them in one
    block of the rig.
    """
    found: list[Form] = []
    near = len(truth.marks) > 1 and rng.random() < 0.5
    for mark in truth.marks:
        pool = [
            f
            for f in every
            if f.mark == mark
            and possible(f, rig, lab)
            and all(f.family != g.family for g in found)
            and not any(
                f.family in group and any(g.family in group for g in found) for group in APART
            )
        ]
        if near and found:
            arm = found[0].block in ("muscle", "joint", "arm")
            pool = [f for f in pool if (f.block in ("muscle", "joint", "arm")) == arm] or pool
        families = {f.family for f in pool}
        family = deck.take(families)
        found.append(BY_LABEL[deck.take(f.label for f in pool if f.family == family)])
    return tuple(f.label for f in found)


def _far(
    rig: RigKind, lab: Lab, deck: _Deck, rng: np.random.Generator
) -> tuple[tuple[str, float], ...]:
    """Parameters of which one is to be far off, in the order of trying, and by how much."""
    model, tolerance = stated(rig.name)
    names = [
        n for n in rig.parameters if not lab.missing or n.split(".")[0] in ("muscle", "arm", "load")
    ]
    first = deck.take(names)
    others = [names[i] for i in rng.permutation(len(names)).tolist() if names[i] != first]
    found = []
    for name in (first, *others[:2]):
        section, key = split(name)
        way = float(rng.choice([-1.0, 1.0]))
        room = (1.0 - LEAST_SHARE) * model[section][key] / tolerance[name]
        most = SIZES[1] if way > 0.0 else min(SIZES[1], room)
        if most < SIZES[0]:
            way, most = 1.0, SIZES[1]
        found.append((name, way * log_uniform(rng, SIZES[0], most)))
    return tuple(found)


def _recordings(lab: Lab, rig: str, rng: np.random.Generator) -> tuple[tuple[str, str], ...]:
    """Names and roles: one free log, or two or three to fit and another one held out."""
    if lab.one:
        return ((FREE, "fit"),)
    if rig == "blow_down":
        return tuple((f"blow_down_{i}", "fit" if i < 4 else "held_out") for i in range(1, 5))
    fits, holds = (pair_course.FIT, pair_course.HELD) if rig == PAIR else (_FIT, _HELD)
    fit = [fits[i] for i in sorted(rng.permutation(3)[: int(rng.integers(2, 4))].tolist())]
    if "multisine" not in fit:
        fit[0] = "multisine"
    held = FREE if rng.random() < 0.3 else str(rng.choice(holds))
    return (*((name, "fit") for name in fit), (held, "held_out"))


def _places(forms: Sequence[str], deck: _Deck) -> tuple[str, ...]:
    """Where the forms of a case of a pair act: at either side and at both, as often as each."""
    found = []
    for label in forms:
        form = BY_LABEL[label]
        found.append(deck.take(PLACES) if has_place(form.family, form.block) else "")
    return tuple(found)


def specs(seed: int, cases: int, duration: float | None = None, plan: str = SECOND) -> list[Spec]:
    """The first `cases` of a plan of strata; case k is the same however many are made.

    Parameters
    ----------
    seed : int
        Settles everything.
    cases : int
        How many.
    duration : float, optional
        Length of the recordings [s]; a minute of one free log, else 24 to 36, 12 at 500 Hz, 8 at
        1000 Hz.
    plan : str
        One of :data:`PLANS`.
    """
    found: list[Spec] = []
    own_plan = PLANS[plan]
    part = own_plan.number
    decks = {
        what: _Deck(np.random.default_rng([seed, part, i]))
        for i, what in enumerate((KNOWN, OTHER, UNLISTED, "several", "wrong", "strength", "place"))
    }
    turn = 0
    while len(found) < cases:
        rng = np.random.default_rng([seed, part, 100 + turn])
        for truth, rig, lab in _round(rng, own_plan.rigs):
            number = len(found) + 1
            own = np.random.default_rng([seed, part, 1_000_000 + number])
            kind = RIGS[rig]
            mark = "several" if len(truth.marks) > 1 else truth.marks[0] if truth.marks else KNOWN
            forms = _forms(truth, kind, lab, decks[mark], own, own_plan.forms)
            strength = 0.0
            if forms:
                levels = {f"{mark}:{s:g}": s for s in STRENGTHS}
                strength = levels[decks["strength"].take(levels)]
            found.append(
                Spec(
                    f"case_{number:04d}",
                    int(own.integers(2**31)),
                    rig,
                    lab,
                    _recordings(lab, rig, own),
                    duration if duration is not None else lab.duration(own),
                    truth.percent,
                    forms,
                    strength,
                    _far(kind, lab, decks["wrong"], own) if truth.wrong else (),
                    truth.percent > 0 and bool(own.random() < 0.5),
                    _places(forms, decks["place"]) if rig == PAIR else (),
                    "" if plan == SECOND else plan,
                )
            )
        turn += 1
    return found[:cases]


assert len(TRUTHS) == ROUND
assert all(len(plan.rigs) == len(_RATES) == ROUND for plan in PLANS.values())
assert set(_RATES) == set(RATES)
