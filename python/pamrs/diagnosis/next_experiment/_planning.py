"""Before any data: which blocks some channels tell apart, which effects they show, and which they
cannot tell from each other.

The rig is simulated under a few standard experiments. Each effect of the catalogue, at a typical
size, changes the residuals of the cut chain by a signature; what the baseline can do inside its
tolerances, and the starts of the windows, are taken off it. What is left, in units of the noise,
says whether the effect would be seen, and the angle between what is left of two effects whether one
would be taken for the other (Ding, Model-Based Fault Diagnosis Techniques, 2013, isolability by
projected signatures).
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pamrs._arrays import Array, solve_normal
from pamrs._progress import Steps
from pamrs.diagnosis.fit import (
    FIT_BIN_TIME,
    Key,
    Problem,
    Start,
    acts_in,
    bin_width,
    changes,
    fits,
    free_baseline,
    known_parameters,
    places_of,
    residuals,
    starts_of,
)
from pamrs.diagnosis.next_experiment._differences import (
    bins_of_fit,
    checked_channels,
    measurable,
    noise_of,
    taken,
    usual_noise,
    weights_of,
)
from pamrs.diagnosis.next_experiment._plan import Addition, Plan, Sight
from pamrs.diagnosis.next_experiment._words import words
from pamrs.diagnosis.prepare import Block, available_blocks, begun_alike, binned
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import CATALOGUE, EFFECTS, Term
from pamrs.errors import DiagnosisError, ParameterError, RigError, SimulationError
from pamrs.experiments import Experiment, library
from pamrs.report.text import spoken_name
from pamrs.rig import Rig
from pamrs.rig.schema import qualified
from pamrs.simulation import core_rig

# [noise levels] from which an arm, which scatters most, is suspect (decision 14)
_SUSPECT_FROM = math.sqrt(0.45)
# cosine of two signatures from which their effects are one (isolability as in Ding (2013))
_SAME_COSINE = 0.95
# [noise levels] what must be left of an effect when another one explains all that it can
_TOLD_APART = 1.0
_MOST_MULTIPLE = 1e4  # [typical sizes] largest size of an effect that is worth telling
# halvings of a size until a rig can have it: below a hundredth it is another effect
_MOST_HALVINGS = 8


BASIC = (
    "multisine",
    "sealed_hold",
    "slow_triangle",
    "step_and_shut",
    "set_steps",
    "hold_low",
    "hold_high",
    "blow_over",
    "slow_strokes",
)
"""Kinds of experiments that a plan assumes by default, those of them that the rig can do."""
_Place = tuple[Block, str]
"""A block, and the name of an experiment."""


@dataclass(frozen=True, eq=False)
class _Part:
    """What one block over one experiment says: products of baseline sensitivities and signatures,
    which add up.

    Attributes
    ----------
    baseline : (k, k) array
        Of the baseline's sensitivities.
    mixed : (k, m) array
        Of these with the signatures.
    signatures : (m, m) array
        Of the signatures.
    """

    baseline: Array
    mixed: Array
    signatures: Array


@dataclass(frozen=True, eq=False)
class _Picture:
    """What a choice of blocks and experiments shows: of each effect, and between every two."""

    sights: dict[str, Sight]
    cosine: dict[tuple[str, str], float]
    unseparated: frozenset[tuple[str, str]]
    bits: float


def plan_diagnosis(
    rig: Rig,
    channels: Iterable[str],
    *,
    noise: Mapping[str, float] | None = None,
    experiments: Sequence[str] | None = None,
    settings: DiagnosisSettings | None = None,
    progress: Callable[[str], object] | None = None,
) -> Plan:
    """What a diagnosis could tell of a rig from some channels, before anything is recorded.

    Parameters
    ----------
    rig : Rig
        Nominal model, one that can be diagnosed: with valves or regulators, one chain or several,
        whole or a part.
    channels : iterable of str
        Channels at hand, of ``valve_command``, ``supply_command``, ``supply_pressure``,
        ``line_pressure`` (of a line with an inlet), ``muscle_pressure`` and ``joint_angle`` or
        ``length``, on a load frame ``force``; of a rig with several blocks by their names
        (``muscle_pressure.flexor``), or without a name for all of a kind.
    noise : mapping of str to float, optional
        Sample noise by channel, or by kind of channel [SI]; that of typical transducers by default
        (``next_experiment`` of the settings).
    experiments : sequence of str, optional
        Names or kinds of the experiments that will be made; multisine, sealed holds, slow triangle
        and steps by default, and slow strokes of a frame.
    settings : DiagnosisSettings, optional
        From where on an effect counts as seen, and two as apart; the published ones by default.
    progress : callable, optional
        Gets a line for each experiment; without one a notebook shows them.

    Returns
    -------
    Plan
        Blocks, effects seen, groups that are not told apart, what would add most. Where an effect
        may act at one of several blocks, each of them is a row (``leak_muscle@flexor``).

    Raises
    ------
    ParameterError
        For an unknown channel or experiment, or a noise that is not above zero.
    DiagnosisError
        If rigs of this kind cannot be diagnosed.

    Examples
    --------
    >>> import pamrs
    >>> plan = pamrs.plan_diagnosis(pamrs.rigs.sealed_chamber(), ["muscle_pressure"])
    >>> plan.sight("leak_muscle").verdict
    'seen'
    """
    _check_rig(rig)
    settings = DiagnosisSettings() if settings is None else settings
    own = checked_channels(rig, tuple(channels))
    sound = _noise(rig, noise)
    every = measurable(rig)
    whole = available_blocks(rig, every)
    pool = {e.name: e for e in library(rig, settings)}
    chosen = _chosen(rig, pool, experiments)
    starts = _starts(rig, whole, _MOST_HALVINGS)
    parts: dict[_Place, _Part] = {}
    layers = _layers(rig, own, every)
    together = [block for _, blocks in layers for block in blocks]
    free = free_baseline(Problem(together, [], core_rig(rig), settings), rig)
    usable, tell = {}, Steps(progress)
    for done, (name, experiment) in enumerate(pool.items()):
        tell(name, done / len(pool))
        try:
            for measured, cut in layers:
                heard = {c: v for c, v in sound.items() if c in measured}
                parts |= _parts(rig, cut, experiment, starts, heard, settings, free)
        except SimulationError:
            continue  # the cut chain leaves the range of the model there
        usable[name] = experiment
    chosen = [name for name in chosen if name in usable]
    blocks = available_blocks(rig, own)
    assumed = _Assumed(rig, parts, starts, settings)
    now = assumed.picture(blocks, chosen)
    order = list(now.sights)
    unseparated = sorted(now.unseparated, key=lambda p: (order.index(p[0]), order.index(p[1])))
    pairs = [(a, b, now.cosine[a, b]) for a, b in unseparated]
    return Plan(
        rig=rig.name,
        channels=own,
        noise={c: sound[c] for c in own if c in sound},
        blocks=[_described(rig, block, blocks) for block in blocks],
        missing=[
            {"name": b.name, "covers": b.covers, "needs": assumed.needed(b.name, own, every)}
            for b in whole
            if b.name not in {own_block.name for own_block in blocks}
        ],
        experiments=[
            {"name": n, "text": usable[n].text, "duration": usable[n].duration} for n in chosen
        ],
        sights=[now.sights[e] for e in order],
        pairs=pairs,
        groups=_joined([(a, b) for a, b, _ in pairs], order),
        additions=assumed.additions(own, every, chosen, usable),
        units=rig.units,
    )


@dataclass(frozen=True, eq=False)
class _Assumed:
    """What every block shows over every experiment, to be looked at with some channels and some
    experiments.
    """

    rig: Rig
    parts: dict[_Place, _Part]
    starts: list[Start]
    settings: DiagnosisSettings

    def blocks(self, channels: tuple[str, ...]) -> list[Block]:
        """Blocks that some channels tell apart."""
        return available_blocks(self.rig, checked_channels(self.rig, channels))

    def picture(self, blocks: list[Block], experiments: Sequence[str]) -> _Picture:
        """What some blocks over some experiments show."""
        used: dict[Key, _Part] = {
            (block.name, name): part
            for (block, name), part in self.parts.items()
            if block in blocks and name in experiments
        }
        effects = list(dict.fromkeys(str(s.effect) for s in self.starts))
        if not used:
            return _Picture({e: Sight(e, 0.0) for e in effects}, {}, frozenset(), 0.0)
        shares = [(p.baseline, p.mixed, p.signatures) for p in used.values()]
        total = _Part(*(np.asarray(sum(share)) for share in zip(*shares, strict=True)))
        freed = solve_normal(total.baseline + np.eye(len(total.baseline)), total.mixed)
        gram = total.signatures - total.mixed.T @ freed
        sizes = {
            key: np.sqrt(
                np.clip(
                    np.diag(p.signatures)
                    - 2.0 * np.einsum("km,km->m", p.mixed, freed)
                    + np.einsum("km,kl,lm->m", freed, p.baseline, freed),
                    0.0,
                    None,
                )
                / self.settings.effective_samples
            )
            for key, p in used.items()
        }
        power = np.sqrt(np.clip(np.diag(gram), 1e-12, None))
        cosines = np.abs(gram) / np.outer(power, power)
        shapes = {e: [k for k, s in enumerate(self.starts) if str(s.effect) == e] for e in effects}
        sights: dict[str, Sight] = {}
        best: dict[str, int] = {}
        for effect in effects:
            index, key = max(
                ((k, key) for k in shapes[effect] for key in sizes),
                key=lambda pair: float(sizes[pair[1]][pair[0]]),
            )
            best[effect] = index
            sights[effect] = _sight(
                self.starts[index], float(sizes[key][index]), key, self.settings
            )
        cosine, unseparated = {}, set()
        for first, second in itertools.combinations(effects, 2):
            mine, theirs = best[first], best[second]
            forward = float(max(cosines[mine, k] for k in shapes[second]))
            backward = float(max(cosines[theirs, k] for k in shapes[first]))
            cosine[first, second] = min(1.0, max(forward, backward))
            left = min(
                sights[first].left * math.sqrt(max(0.0, 1.0 - forward**2)),
                sights[second].left * math.sqrt(max(0.0, 1.0 - backward**2)),
            )
            seen = min(sights[first].left, sights[second].left) >= self.settings.seen
            alike = cosine[first, second] > _SAME_COSINE or left < _TOLD_APART
            if seen and alike:
                unseparated.add((first, second))
        chosen = [best[e] for e in effects]
        _, logarithm = np.linalg.slogdet(np.eye(len(chosen)) + gram[np.ix_(chosen, chosen)])
        return _Picture(
            sights, cosine, frozenset(unseparated), 0.5 * float(logarithm) / math.log(2.0)
        )

    def needed(self, block: str, own: tuple[str, ...], every: tuple[str, ...]) -> list[str]:
        """The fewest channels that, added to those at hand, surround a block."""
        lacking = [c for c in every if c not in own]
        for count in range(1, len(lacking) + 1):
            for several in itertools.combinations(lacking, count):
                if any(b.name == block for b in self.blocks((*own, *several))):
                    return list(several)
        return lacking

    def additions(
        self,
        own: tuple[str, ...],
        every: tuple[str, ...],
        chosen: list[str],
        usable: Mapping[str, Experiment],
    ) -> list[Addition]:
        """What each further channel (two of them where one surrounds no block) and each further
        experiment would add.
        """
        blocks = self.blocks(own)
        now = self.picture(blocks, chosen)
        lacking = [c for c in every if c not in own]
        found = []
        for channel in lacking:
            then = self.picture(self.blocks((*own, channel)), chosen)
            found.append(_addition("channel", channel, spoken_name(channel), now, then))
        for several in itertools.combinations(lacking, 2) if not blocks else ():
            text = " and ".join(map(spoken_name, several))
            then = self.picture(self.blocks((*own, *several)), chosen)
            found.append(_addition("channels", "+".join(several), text, now, then))
        for name in [n for n in usable if n not in chosen] if blocks else ():
            then = self.picture(blocks, [*chosen, name])
            found.append(_addition("experiment", name, usable[name].text, now, then))
        return sorted(found, key=lambda a: (-(len(a.seen) + len(a.separated)), -a.bits))


def _check_rig(rig: Rig) -> None:
    """Refuse rigs that no experiment is made for."""
    if not isinstance(rig, Rig):
        raise ParameterError(
            f"rig is a {type(rig).__name__}; a Rig is needed: pamrs.rigs.shoulder(), "
            "pamrs.load_rig(path)"
        )
    # how a sensor lags is known of a rig, what it leaves out is not
    known = [e["id"] for e in rig.effects if EFFECTS[e["id"]].block != "sensors"]
    if known:
        raise DiagnosisError(
            f"rig {rig.name!r}: it already has the effect {known[0]!r}; plan with a rig without "
            "effects: copy the file and leave its [[effects]] out"
        )


def _noise(rig: Rig, given: Mapping[str, float] | None) -> dict[str, float]:
    """Sample noise of every channel [SI]."""
    usual, own = usual_noise(), noise_of(rig)
    for name, value in (given or {}).items():
        if name not in usual and name not in own:
            raise ParameterError(
                f"noise has {name!r}, which is not allowed: one of "
                f"{', '.join(dict.fromkeys((*usual, *own)))}"
            )
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(
                f"noise of {name} = {value} is not allowed: a finite number > 0 is needed"
            )
    told = {name: float(value) for name, value in (given or {}).items()}
    return noise_of(rig, told)


def _chosen(
    rig: Rig, pool: Mapping[str, Experiment], experiments: Sequence[str] | None
) -> list[str]:
    """Names of the experiments that are assumed, given by their names or kinds."""
    found: list[str] = []
    for name in BASIC if experiments is None else experiments:
        meant = [e.name for e in pool.values() if name in (e.name, e.kind)]
        if not meant and experiments is not None:
            raise ParameterError(
                f"experiments has {name!r}, which is not allowed: of rig {rig.name!r} one of "
                f"{', '.join(pool)}"
            )
        found += meant
    return list(dict.fromkeys(found))


def _starts(rig: Rig, blocks: list[Block], most_halvings: int) -> list[Start]:
    """Every start of every effect that a rig can have; where some blocks tell apart at which place
    it acts, of the effect at each of them.
    """
    found: list[Start] = []
    for effect in CATALOGUE:
        if not _applies(rig, effect, blocks):
            continue
        places = places_of(rig, effect, blocks)
        for term in [Term(effect, at) for at in places] or [Term(effect)]:
            usual = starts_of(term, sealed=rig.model["valve"] is None)
            found += [
                s
                for s in (_possible(rig, start, most_halvings) for start in usual)
                if s is not None
            ]
    return found


def _possible(rig: Rig, start: Start, most_halvings: int) -> Start | None:
    """A start of an effect, halved until a rig can have it (a small arm does not carry as much
    payload as an effect takes away); None where it never can.
    """
    for halvings in range(most_halvings):
        smaller = start.scaled(0.5**halvings) if halvings else start
        with contextlib.suppress(ParameterError, RigError, SimulationError):
            core_rig(smaller.applied(rig))
            return smaller
    return None


def _applies(rig: Rig, effect: str, blocks: list[Block]) -> bool:
    """Whether a rig has what an effect acts on but not the effect, and a block of the cut chain in
    which it could show.
    """
    if effect in {held["id"] for held in rig.effects}:
        return False
    return fits(rig, effect) and any(acts_in(Term(effect), block) for block in blocks)


def _layers(
    rig: Rig, own: tuple[str, ...], every: tuple[str, ...]
) -> list[tuple[tuple[str, ...], list[Block]]]:
    """Every block that some channels surround, with these channels: all of them, those at hand, and
    these with one more (two where they surround none). With a gauge less, a block may be driven by
    other channels.
    """
    lacking = [c for c in every if c not in own]
    few = [every, own, *((*own, channel) for channel in lacking)]
    if not available_blocks(rig, own):
        few += [(*own, *several) for several in itertools.combinations(lacking, 2)]
    layers: list[tuple[tuple[str, ...], list[Block]]] = []
    for channels in few:
        blocks = available_blocks(rig, channels)
        new = [b for b in blocks if all(b not in there for _, there in layers)]
        if new:
            layers.append((channels, new))
    return layers


def _described(rig: Rig, block: Block, blocks: list[Block]) -> dict[str, Any]:
    lines = {qualified("line", n): ends["to"] for n, ends in rig.ports("line").items()}
    behind = any(lines.get(b.name) == block.name for b in blocks if b.name in lines)
    why = words("lumped").get(block.covers.partition(" of ")[0], "")
    if block.thermometer:
        why = why.removesuffix(", nor the temperature of the gas")
    return {
        "name": block.name,
        "channel": block.channel,
        "drives": list(block.drives),
        "covers": block.covers,
        "why": words("lumped")["behind_line"]
        if behind and "valve" in block.covers and block.kind == "chamber"
        else why,
    }


def _parts(
    rig: Rig,
    blocks: list[Block],
    experiment: Experiment,
    starts: list[Start],
    noise: Mapping[str, float],
    settings: DiagnosisSettings,
    baseline: list[str],
) -> dict[_Place, _Part]:
    """Products of everything that one experiment shows, by block."""
    stands = experiment.changed(rig)
    prepared = taken(experiment.simulate(rig), stands, experiment.name, noise, settings)
    prepared = begun_alike(blocks, core_rig(stands), prepared)
    problem = Problem(blocks, [prepared], core_rig(stands), settings)
    base = residuals(problem, stands, baseline)
    weights = weights_of(problem, stands)
    known = known_parameters(stands)
    spread = np.array([known[name].tol for name in baseline])
    width = bin_width(prepared, FIT_BIN_TIME)
    scale, slopes, moved = {}, {}, {}
    for block in blocks:
        key = (block.name, experiment.name)
        slope, scale[key] = bins_of_fit(problem, prepared, block, base[key], weights)
        slopes[key] = slope * spread * scale[key]
        moved[key] = np.zeros((slope.shape[0], len(starts)))
    for index, start in enumerate(starts):
        acting = [b for b in blocks if acts_in(start.effect, b)]
        try:
            found = changes(
                replace(problem, blocks=acting), start.applied(stands), base, start.effect
            )
        except SimulationError:
            continue  # this size leaves the range in which the model holds
        for block in acting:
            key = (block.name, experiment.name)
            mean, _ = binned(found[key].value - base[key].value, base[key].rows, width)
            moved[key][:, index] = mean * scale[key]
    products: dict[_Place, _Part] = {}
    for block in blocks:
        slope, change = (part[block.name, experiment.name] for part in (slopes, moved))
        products[block, experiment.name] = _Part(
            slope.T @ slope, slope.T @ change, change.T @ change
        )
    return products


def _sight(start: Start, left: float, key: Key, settings: DiagnosisSettings) -> Sight:
    """How an effect shows from the start that shows most."""
    if left < 1e-6:
        return Sight(str(start.effect), 0.0)
    marginal = left >= _SUSPECT_FROM
    verdict = "seen" if left >= settings.seen else "marginal" if marginal else "not seen"
    if not start.scalable:
        return Sight(str(start.effect), left, *key, verdict=verdict)
    leading = start.sizes[0]
    typical, size = abs(start.free[leading]), settings.seen / left
    found = start.scaled(size).free[leading]
    # one that its bounds hold shows less than that
    whole = math.isclose(start.scaled(0.999 * size).free[leading], found, rel_tol=1e-9)
    smallest = abs(found) if size < _MOST_MULTIPLE and not whole else math.nan
    return Sight(str(start.effect), left, *key, leading, typical, smallest, verdict)


def _addition(kind: str, name: str, text: str, now: _Picture, then: _Picture) -> Addition:
    seen = tuple(
        e for e, s in then.sights.items() if s.verdict == "seen" and now.sights[e].verdict != "seen"
    )
    separated = tuple(sorted(now.unseparated - then.unseparated))
    return Addition(kind, name, text, seen, separated, then.bits - now.bits)


def _joined(pairs: list[tuple[str, str]], order: list[str]) -> list[tuple[str, ...]]:
    """Groups out of pairs that share a member."""
    groups: list[set[str]] = []
    for pair in pairs:
        touching = [g for g in groups if g & set(pair)]
        groups = [g for g in groups if g not in touching] + [set(pair).union(*touching)]
    return sorted(
        (tuple(sorted(g, key=order.index)) for g in groups), key=lambda g: order.index(g[0])
    )
