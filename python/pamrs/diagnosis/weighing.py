"""Probabilities of sets of effects, and of ``unlisted``, from what each leaves of the mismatch."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pamrs.channels import channel_of
from pamrs.diagnosis.blocks import Block
from pamrs.diagnosis.candidates import Candidate, significant
from pamrs.diagnosis.evidence import Excess
from pamrs.diagnosis.fitting import Problem
from pamrs.effects import EFFECTS
from pamrs.effects import SameData

__all__ = [
    "FORM",
    "STANDING",
    "believed",
    "doubt",
    "explains",
    "most_believed",
    "price",
    "same_recordings",
    "share_left",
    "stands",
    "unlikely",
    "visited",
    "weigh",
]

EVEN, EVEN_PLIABLE, SOFTNESS = 0.5, 2.6, 0.4
"""Logarithm of the odds of explained to unexplained variance at which a set is named at even odds with ``unlisted`` (pushes, and
parameters of the baseline, which take up a good part of anything, need more), and its width."""
LOOKS, PRICE, SECOND, FILE = 12.0, 0.5, 3.0, 1.5
"""Independent looks that a block's residual counts for, price of a parameter, of a further effect or wrong parameter, and of a rig file
that is wrong about a parameter (more, but less and less so, the further outside its tolerances it is)."""
TELLING = 0.5
"""Excess variance, in units of the floor's, from which recordings are asked how much an effect leaves; those with most always are."""
CLEARLY = 0.7
"""Share left of a mismatch that is hardly one below which a set still explains it."""
FORM, FINE = 0.04, 0.01
"""Share of a mismatch's variance that the difference between a catalogue's equation and the truth may leave; share that is granted
where sets of as many effects are compared, since what a further effect would mend is then no question."""
DRIFT_SHARE, DRIFT_BELIEVED = 0.02, 0.45
"""Share of the pressure below which a drift that no other recording confirms may as well be the bench's own, and how far a name of it
is believed at most."""
BELIEVED = 0.985
"""How far a name is believed at most."""
STANDING, UNSEEN = 2.0, 3.0
"""Price of a clock that is late but does not drift; recordings' lengths beyond which a time constant was not seen."""
ALIKE, UNTOLD = 0.1, 2.0
"""Part of an effect's size over a recording, and standard deviations, below which what would tell it from another effect is zero."""
HERTZ, ROUND = 1.5, 0.25
"""Exponent of the contact of round bodies, and how far that of muscles is believed to be from it."""
WRONG, FLOORS, DECIDED = 0.15, 0.06, 8.0
"""Standard deviations of what a right effect of another form leaves of a mismatch's variance, and of a floor; the most that what is
left in one block and stage counts."""
OUTSIDE, IMPLAUSIBLE = 3.0, 4.0
"""Factor by which a value is one standard deviation outside the usual range, and the most that it costs."""
NEAR_END, WIDE = 0.5, 0.15
"""Share of the angles visited over which a stop may act, and how far beyond it costs a standard deviation."""
CONSTANCY = 0.35
"""Relative scatter of an effect's size between recordings beyond which it is not that effect."""


def visited(problem: Problem) -> tuple[float, float] | None:
    """Range of the angle of a rig's only joint [rad]; None where no block is a joint's, or several are."""
    arms = [b for b in problem.blocks if channel_of(b.channel) == "joint_angle"]
    if len(arms) != 1:
        return None
    angles = [p.signals[arms[0].channel][0] for p in problem.recordings]
    return min(float(a.min()) for a in angles), max(float(a.max()) for a in angles)


def most_believed(fitted: Problem, held: Problem, mismatch: Block, left: float) -> float:
    """How far any name is believed at most, which is less where the proof is weak.

    A slow drift of less than two percent of the pressure, with no held-out recording, may as well be the bench's own loss,
    creep of a wall or the transducer's drift.
    """
    if held is not fitted or mismatch.channel != "muscle_pressure":
        return BELIEVED
    typical = np.mean([np.mean(np.abs(p.signals["muscle_pressure"][0])) for p in fitted.recordings])
    return DRIFT_BELIEVED if left < DRIFT_SHARE * float(typical) else BELIEVED


def share_left(candidate: Candidate, baseline: Candidate, suspects: list[Block]) -> float:
    """Share of the baseline's excess variance that a set of effects leaves, the larger of fitted and held-out recordings.

    Recordings that hardly show the mismatch cannot say how much of it is left; what an effect brings into them, beyond what noise
    may, counts beside the mismatch of the others.
    """
    found = _excesses(candidate, baseline, suspects)
    most = max(before for before, _ in found)
    asked = min(TELLING, 0.9 * most)
    shares = [after / before for before, after in found if before > asked]
    shares += [(after - TELLING) / max(most, TELLING) for before, after in found if before <= asked and after > TELLING]
    return max(shares, default=1.0)


def _excesses(candidate: Candidate, baseline: Candidate, suspects: list[Block]) -> list[tuple[float, float]]:
    """Excess variance that the baseline and a set leave, on fitted and on held-out recordings."""

    def over(found: dict[str, Excess]) -> float:
        return sum(max(0.0, found[b.name].ratio - 1.0) for b in suspects)

    return [(over(baseline.fitted), over(candidate.fitted)), (over(baseline.held_out), over(candidate.held_out))]


def explains(candidate: Candidate, baseline: Candidate, suspects: list[Block]) -> bool:
    """Whether only noise is left, fitted and held out, where there was clearly more."""
    quiet = not any(significant(e[b.name]) for b in suspects for e in (candidate.fitted, candidate.held_out))
    before, after = max(_excesses(candidate, baseline, suspects))
    return quiet and after < CLEARLY * before


def weigh(
    candidates: list[Candidate],
    suspects: list[Block],
    most: float,
    seconds: float,
    ranging: tuple[float, float] | None = None,
    own: Mapping[Candidate, list[Block]] | None = None,
) -> dict[str, float]:
    """Probabilities over sets of effects and ``unlisted``.

    Between sets: the logarithm of what each leaves of the mismatch, fitted and held out, on a nominal number of independent looks;
    what the form of an equation may leave (``FORM``) is granted to all of them, so that no second effect is asked for to mend the
    form of the first; among sets of as many effects less is granted (``FINE``). What is left of a faint mismatch counts by what noise
    could leave of it. Each parameter and each further effect has its price, and so have a clock that does not drift and values that an
    effect hardly has (:func:`unlikely`). Against ``unlisted``: the share of the mismatch that the set explains where it explains least,
    and whether its size is the same in all recordings; sets that are not believed themselves say nothing against one that is. The
    constants are those under which the stated probabilities came true in a trial with other seeds than the published one
    (docs/decisions/0014).

    ``seconds`` is the length of the longest recording that was fitted, ``ranging`` the range of a joint's angle in them [rad], ``own``
    the blocks in which each set is judged against ``unlisted``, where these are not all the suspects.
    """
    named = [c for c in candidates if c.names]
    if not named:
        return {"unlisted": 1.0}
    start = candidates[0]
    trusted = {c: _trusted(c, start, suspects if own is None else own[c], most, seconds) for c in named}

    def weights_of(granted: float) -> dict[Candidate, float]:
        scores = {c: _score(c, start, suspects, granted) - STANDING * stands(c, seconds) - unlikely(c, ranging) for c in named}
        scores = _beside_values(scores)
        top = max(scores.values())
        return {c: trusted[c] * math.exp(max(-60.0, s - top)) for c, s in scores.items()}

    coarse, fine = weights_of(FORM), weights_of(FINE)
    weights: dict[Candidate, float] = {}
    for count in {len(c.names) for c in named}:
        alike = [c for c in named if len(c.names) == count]
        share = sum(coarse[c] for c in alike) / sum(fine[c] for c in alike)
        weights |= {c: share * fine[c] for c in alike}
    total = sum(weights.values())
    out: dict[str, float] = {}
    for c, weight in weights.items():
        out[c.key] = out.get(c.key, 0.0) + weight / total * trusted[c]
    _shared_out(out, named, start, suspects, seconds)
    out["unlisted"] = max(0.0, 1.0 - sum(out.values()))
    return out


def _shared_out(out: dict[str, float], named: list[Candidate], start: Candidate, suspects: list[Block], seconds: float) -> None:
    """Share probabilities out between sets that are the same data, by the odds before any data."""
    for one in named:
        for effect in one.effects:
            same = EFFECTS[effect].same_data
            if same is None or not same_recordings(one, effect, seconds):
                continue
            names = {same.effect if e == effect else e for e in one.effects}
            other = next((c for c in named if set(c.effects) == names and not c.wrong), None)
            # what explains more than the other could is something else as well
            if other is None or share_left(one, start, suspects) > share_left(other, start, suspects) + FINE:
                continue
            both, odds = out.get(one.key, 0.0) + out.get(other.key, 0.0), math.exp(STANDING)
            out[one.key], out[other.key] = both / (1.0 + odds), both * odds / (1.0 + odds)


def same_recordings(candidate: Candidate, effect: str, seconds: float) -> bool:
    """Whether an effect of a set leaves the very recordings that another effect of the catalogue would leave."""
    same = EFFECTS[effect].same_data
    if same is None:
        return False
    own: dict[str, float] = next((e["parameters"] for e in candidate.fit.rig.effects if e["id"] == effect), {})
    if not own:
        return False
    telling, spread = own[same.without] * seconds, candidate.fit.std.get(f"{effect}.{same.without}", 0.0) * seconds
    at_rest = abs(telling) < max(ALIKE * abs(own[same.size]), UNTOLD * spread)
    return bool(own[same.size] > 0.0 and at_rest and all(own[name] == value for name, value in same.held))


def _beside_values(scores: dict[Candidate, float]) -> dict[Candidate, float]:
    """Scores of effects and of wrong values made comparable: what the priors of the other parameters lose counts between the two.

    A value that is wrong lets the others go back to where they were expected; sets of effects keep their order among each other,
    since what moves beside them is the form of their equations as well.
    """
    if not any(c.wrong for c in scores):
        return scores
    effects = [c for c in scores if not c.wrong]
    shared = strained(max(effects, key=lambda c: scores[c])) if effects else 0.0
    return {c: score - (strained(c) if c.wrong else shared) for c, score in scores.items()}


def strained(candidate: Candidate) -> float:
    """Half of the sum of squares of the priors of a hypothesis, as far as it counts."""
    return min(0.5 * candidate.fit.strain, DECIDED)


def _trusted(candidate: Candidate, baseline: Candidate, suspects: list[Block], most: float, seconds: float) -> float:
    """Probability of a set against ``unlisted``."""
    left = min(max(share_left(candidate, baseline, suspects), 1e-6), 1.0 - 1e-6)
    pliable = candidate.wrong or "external_torque" in candidate.effects
    odds = (math.log((1.0 - left) / left) - (EVEN_PLIABLE if pliable else EVEN)) / SOFTNESS
    if explains(candidate, baseline, suspects):
        odds = max(odds, 3.0)
    return believed(odds - doubt(candidate, seconds), most)


def believed(odds: float, most: float) -> float:
    """Probability of logarithmic odds, at most so much."""
    return most / (1.0 + math.exp(-min(60.0, max(-60.0, odds))))


def doubt(candidate: Candidate, seconds: float) -> float:
    """What a set's values take from the logarithm of its odds: a size that scatters between recordings, creep that was not seen."""
    unseen = candidate.fit.values.get("muscle_creep.time_constant", 0.0) > UNSEEN * seconds
    return max(0.0, candidate.scatter - CONSTANCY) / 0.1 + (5.0 if unseen else 0.0)


def stands(candidate: Candidate, seconds: float) -> bool:
    """Whether a clock of a set does not drift: two free clocks do, and what is late by the same time always is a lag or a delay."""

    def at_rest(effect: str, same: SameData) -> bool:
        size, telling = (candidate.fit.values.get(f"{effect}.{name}", 0.0) for name in (same.size, same.without))
        return abs(telling) * seconds < abs(size)

    known = ((effect, EFFECTS[effect].same_data) for effect in candidate.effects)
    return any(at_rest(effect, same) for effect, same in known if same is not None)


def unlikely(candidate: Candidate, ranging: tuple[float, float] | None) -> float:
    """What a set loses by values that its physics hardly has.

    Swollen muscles are round, and press like round bodies (Hertz); an end stop is met near an end of the motion, and what acts over
    most of the range is none; other parameters lose by how many times they are outside the range of usual values, for certain.
    """
    lost = 0.5 * ((candidate.fit.values.get("pam_crowding_contact.exponent", HERTZ) - HERTZ) / ROUND) ** 2
    stop = next((e["parameters"] for e in candidate.fit.rig.effects if e["id"] == "joint_end_stop"), None)
    if stop is not None and ranging is not None and ranging[1] > ranging[0]:
        inside = (stop["angle"] - ranging[0]) / (ranging[1] - ranging[0])
        touched = 1.0 - inside if stop["side"] >= 0.0 else inside
        lost += min(0.5 * (max(0.0, touched - NEAR_END) / WIDE) ** 2, IMPLAUSIBLE)
    for name, value in candidate.fit.values.items():
        effect, _, own = name.partition(".")
        known = next((p for p in EFFECTS[effect].parameters if p.name == own), None) if effect in EFFECTS else None
        if known is not None and known.expected is not None:
            (low, high), wide = known.expected, 2.0 * candidate.fit.std.get(name, 0.0)
            outside = math.log(max(low / max(value + wide, 1e-300), (value - wide) / high, 1.0)) / math.log(OUTSIDE)
            lost += min(0.5 * outside**2, IMPLAUSIBLE)
    return lost


def _score(candidate: Candidate, baseline: Candidate, suspects: list[Block], share: float) -> float:
    """Logarithm of the weight of a set of effects, up to a constant; ``share`` of the mismatch is granted to the forms of equations."""
    total = 0.0
    once = candidate.fitted == candidate.held_out  # the same recordings twice
    for was, now in ((baseline.fitted, candidate.fitted), (baseline.held_out, candidate.held_out)):
        for block in suspects:
            excess, left = (max(0.0, e[block.name].ratio - 1.0) for e in (was, now))
            total -= 0.25 * LOOKS * math.log(1.0 + left + share * excess)
            # of a faint mismatch the noise says how much may be left, of a strong one the forms
            spread = math.hypot(now[block.name].scatter, WRONG * excess, FLOORS)
            total -= min(0.5 * (left / spread) ** 2, DECIDED) * (0.5 if once else 1.0)
    return total - price(candidate) - SECOND * (len(candidate.names) - 1)


def price(candidate: Candidate) -> float:
    """What a set pays for the parameters of its effects (of events of one kind only the first counts) and for a file that is wrong."""
    own = FILE * len(candidate.wrong) + candidate.outside
    return own + PRICE * sum(1 for n in candidate.fit.values if n.partition(".")[0] in EFFECTS and not n.endswith(("_2", "_3")))
