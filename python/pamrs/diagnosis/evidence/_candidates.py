"""Candidates: hypotheses fitted to recordings, and what they leave of those that were held out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from pamrs.diagnosis.evidence._likelihood import BlockLikelihood
from pamrs.diagnosis.fit import Fit, Key
from pamrs.diagnosis.noise import Excess, NoiseLevel
from pamrs.diagnosis.prepare import Block
from pamrs.effects import Hypothesis, Term

# excess over noise from which a recording tests what an effect leaves (decision 14)
_TELLING_EXCESS = 0.5
_TELLING_SHARE = 0.9  # share of the largest excess from which recordings always are
# share left of hardly a mismatch by what explains it: it has to take 30 % (decision 20)
_EXPLAINED_SHARE = 0.7
# share of a mismatch by which forms that leave as much differ (decision 20)
FORM_SHARE_ALIKE = 0.01


@dataclass(frozen=True, eq=False)
class FittedHypothesis:
    """A fitted hypothesis: effects, and values of the rig file that are wrong.

    Attributes
    ----------
    effects : tuple of Term
        Its effects; empty for the baseline.
    fit : Fit
        On the recordings to fit.
    held_out_excess : dict of str to Excess
        By block, on held-out recordings; without any, on each recording as predicted by the others.
    fit_excess : dict of str to Excess
        By block, on the recordings to fit.
    gap_closed : float
        Share of the baseline's excess that it removes on held-out recordings.
    gain : float
        Gain in chi-square that the screen predicted for a single effect.
    wrong : tuple of str
        Dotted names of the parameters that were freed from their tolerance.
    log_places : float
        Logarithm of how many places its effects could have been said to act at: by so much each is
        less probable before any data.
    likelihood : callable
        How probable what it leaves of all recordings is, by block.
    """

    effects: tuple[Term, ...]
    fit: Fit
    held_out_excess: dict[str, Excess]
    fit_excess: dict[str, Excess]
    gap_closed: float
    gain: float = 0.0
    wrong: tuple[str, ...] = ()
    log_places: float = 0.0
    likelihood: Callable[[], Mapping[str, BlockLikelihood]] = field(default=dict, repr=False)

    @property
    def terms(self) -> tuple[Term, ...]:
        """Effects, and parameters that are wrong; nothing for the baseline."""
        return (*self.effects, *map(Term, self.wrong))

    @cached_property
    def hypothesis(self) -> Hypothesis:
        """Hypothesis that its effects and wrong parameters are."""
        return Hypothesis(self.terms)

    def beyond_walls_by(self, name: str, walls: float) -> float:
        """Distance of a wrong parameter beyond the walls: ``log(|moved| / walls)``, at least 0."""
        return math.log(max(1.0, abs(self.fit.moved[name]) / walls))

    def is_wrong(self, walls: float) -> bool:
        """True where every parameter that it calls wrong moved by more than `walls` tolerances."""
        return all(abs(self.fit.moved[name]) > walls for name in self.wrong)

    @property
    def misfit(self) -> float:
        """Sum over the blocks of the residual in units of its noise, squared, on the recordings to
        fit.
        """
        return sum(
            float(((r.value[r.rows] / r.noise) ** 2).sum()) for r in self.fit.residuals.values()
        )


@dataclass(frozen=True, eq=False)
class BlockGroup:
    """Blocks that are judged together, with everything found out about them.

    Attributes
    ----------
    blocks : list of Block
        Gas blocks (supply, chamber), the arm, or a part of these where names explain parts.
    nominal, baseline : dict of str to Excess
        Excess by block before and after the refit, on fitted recordings.
    candidates : list of FittedHypothesis
        The baseline first, then every set of effects tried.
    probabilities : dict of Hypothesis to float
        Over those that were fitted, `UNLISTED` and `UNDECIDED` (nothing missing here, or parameters
        that are off inside their tolerances).
    mismatch : Block or None
        The block with the largest significant excess after the refit.
    noise_level : dict
        Noise levels.
    suspects : list of Block
        Blocks that keep an excess.
    closure : FittedHypothesis or None
        Form of what has no name, that predicts held-out recordings better than without it: next to
        the baseline where no name is likely, else next to the names that lead.
    sought : bool
        Whether one was looked for.
    predicted_gain : dict of Term to float
        Share of the mismatch that each tested effect could take by its signature alone.
    unseen : float
        Odds, against none, that an effect acts here which the recordings would hardly show; even
        where no limits are known.
    """

    blocks: list[Block]
    nominal: dict[str, Excess]
    baseline: dict[str, Excess]
    candidates: list[FittedHypothesis]
    probabilities: dict[Hypothesis, float]
    mismatch: Block | None
    noise_level: dict[Key, NoiseLevel]
    suspects: list[Block]
    closure: FittedHypothesis | None = None
    sought: bool = False
    predicted_gain: dict[Term, float] = field(default_factory=dict)
    unseen: float = 1.0

    @property
    def best(self) -> FittedHypothesis:
        """The most probable hypothesis (the baseline when none is)."""
        named = [c for c in self.candidates if c.terms]
        if self.mismatch is None or not named:
            return self.candidates[0]
        return max(named, key=lambda c: self.probabilities.get(c.hypothesis, 0.0))


def significant(excess_of_block: Excess, ratio: float = 1.0) -> bool:
    """True where a residual's variance is above its limit and so many times that of the noise."""
    return excess_of_block.ratio > max(ratio, excess_of_block.limit)


def misses_only_held_out(
    fit_excess: dict[str, Excess], held_out_excess: dict[str, Excess], *, nothing_held_out: bool
) -> bool:
    """True where a fit leaves noise in its own recordings and more in held-out ones: parameters
    that its own recordings do not determine may bring that (docs/decisions/0111).
    """
    noise_only = not any(significant(e) for e in fit_excess.values())
    return (
        not nothing_held_out
        and noise_only
        and any(significant(e) for e in held_out_excess.values())
    )


def share_left(
    candidate: FittedHypothesis, baseline: FittedHypothesis, suspects: list[Block]
) -> float:
    """Share of the baseline's excess variance that a set of effects leaves in held-out recordings.

    Held-out recordings that hardly show the mismatch cannot say how much of it is left: the fitted
    ones then do, and what an effect adds to the held-out ones, beyond what noise may, counts as
    well. Events were found in held-out recordings as in the others: the larger share of the two
    counts.
    """
    (was, now), (before, after) = _excesses(candidate, baseline, suspects)
    if candidate.fit.events is not None and min(was, before) > _TELLING_EXCESS:
        return max(now / was, after / before)
    if before > min(_TELLING_EXCESS, _TELLING_SHARE * max(was, before)):
        return after / before
    shares = [now / was] if was > 0.0 else []
    if after > _TELLING_EXCESS:
        shares.append((after - _TELLING_EXCESS) / max(was, _TELLING_EXCESS))
    return max(shares, default=1.0)


def _excesses(
    candidate: FittedHypothesis, baseline: FittedHypothesis, suspects: list[Block]
) -> list[tuple[float, float]]:
    """Excess variance that the baseline and a set leave, on fitted and on held-out recordings."""

    def over(excess_by_block: dict[str, Excess]) -> float:
        return sum(max(0.0, excess_by_block[b.name].ratio - 1.0) for b in suspects)

    return [
        (over(baseline.fit_excess), over(candidate.fit_excess)),
        (over(baseline.held_out_excess), over(candidate.held_out_excess)),
    ]


def explains(
    candidate: FittedHypothesis, baseline: FittedHypothesis, suspects: list[Block]
) -> bool:
    """True where a candidate leaves only noise, fitted and held out, of what was clearly more."""
    noise_only = not any(
        significant(e[b.name])
        for b in suspects
        for e in (candidate.fit_excess, candidate.held_out_excess)
    )
    before, after = max(_excesses(candidate, baseline, suspects))
    return noise_only and after < _EXPLAINED_SHARE * before
