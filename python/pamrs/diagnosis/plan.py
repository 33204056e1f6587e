"""Before any data: which blocks some channels tell apart, which effects they show, and which they cannot tell from each other.

The rig is simulated under a few standard experiments. Each effect of the catalogue, at a typical size, changes the residuals of the
cut chain by a signature; what the baseline can do inside its tolerances, and the starts of the windows, are taken off it. What is
left, in units of the noise, says whether the effect would be seen, and the angle between what is left of two effects whether one
would be taken for the other (Ding, Model-Based Fault Diagnosis Techniques, 2013, isolability by projected signatures).
"""

from __future__ import annotations

import itertools
import math
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pamrs.diagnosis.blocks import Block, available_blocks
from pamrs.diagnosis.differences import MEASURABLE, checked_channels, taken, usual_noise, weights_of
from pamrs.diagnosis.evidence import bins_of
from pamrs.diagnosis.fitting import Key, Problem, acts_in, bin_width, changes, free_baseline, residuals
from pamrs.diagnosis.hypotheses import fits
from pamrs.diagnosis.protocols import Experiment, library
from pamrs.diagnosis.settings import DiagnosisSettings, PlanSettings
from pamrs.diagnosis.signals import binned
from pamrs.diagnosis.starts import Start, starts_of
from pamrs.effects import CATALOGUE, find_parameter
from pamrs.errors import DiagnosisError, ParameterError, SimulationError
from pamrs.rig import Rig
from pamrs.simulation import core_rig, has_frame, regulators_of

__all__ = ["Addition", "Plan", "Sight", "plan_diagnosis"]

Array = NDArray[np.float64]

BASIC = ("multisine", "sealed_hold", "slow_triangle", "step_and_shut", "hold_low", "hold_high")
"""Experiments that a plan assumes by default, those of them that the rig can do."""
_LUMPED = {
    "supply": "what leaves the tank by itself and what the valve takes are one sum in its pressure; only that follows the command",
    "chamber": "no pressure is measured between the valve's outlet and the muscle, nor the temperature of the gas",
    "arm": "neither force nor torque is measured between the muscle and the arm",
}


@dataclass(frozen=True)
class Sight:
    """How an effect would show.

    Attributes
    ----------
    effect : str
        Its id.
    left : float
        What is left of its signature, root mean square over the recording where that is largest [noise units].
    block, recording : str
        Where; empty when it acts in no block that the channels surround.
    size : str
        Dotted name of the parameter that scales it; empty where no number does.
    typical, smallest : float
        Typical value of that parameter and the smallest one (of a restriction's conductance, the largest) that leaves three noise
        units [SI]; NaN without one.
    verdict : str
        ``seen``, ``faint`` or ``hidden`` at the typical size.
    """

    effect: str
    left: float
    block: str = ""
    recording: str = ""
    size: str = ""
    typical: float = math.nan
    smallest: float = math.nan
    verdict: str = "hidden"


@dataclass(frozen=True)
class Addition:
    """What one more channel or experiment would add.

    Attributes
    ----------
    kind, name, text : str
        ``channel`` or ``experiment``, which one, and in words.
    seen : tuple of str
        Effects that are seen only with it.
    separated : tuple of (str, str)
        Pairs that are told apart only with it.
    bits : float
        Gain of half the logarithm of the determinant of the effects' information at their typical sizes [bit].
    """

    kind: str
    name: str
    text: str
    seen: tuple[str, ...]
    separated: tuple[tuple[str, str], ...]
    bits: float


@dataclass(frozen=True, repr=False)
class Plan:
    """What some channels and experiments can tell of a rig.

    Attributes
    ----------
    rig : str
        Its name.
    channels : tuple of str
        Measured ones.
    noise : dict of str to float
        Sample noise of each [SI].
    blocks : list of dict
        ``name``, ``channel``, ``drives``, ``covers``, ``why`` its parts are lumped.
    missing : list of dict
        Blocks that would be there with more channels: ``name``, ``covers``, ``needs``.
    experiments : list of dict
        ``name``, ``text``, ``duration`` [s] of those assumed.
    sights : list of Sight
        One for each effect that the rig can have, in the order of the catalogue.
    pairs : list of (str, str, float)
        Effects seen that are not told apart, with the cosine of their signatures.
    groups : list of tuple of str
        The same, joined.
    additions : list of Addition
        What would add most, first.
    """

    rig: str
    channels: tuple[str, ...]
    noise: dict[str, float]
    blocks: list[dict[str, Any]]
    missing: list[dict[str, Any]]
    experiments: list[dict[str, Any]]
    sights: list[Sight]
    pairs: list[tuple[str, str, float]]
    groups: list[tuple[str, ...]]
    additions: list[Addition] = field(default_factory=list)

    @property
    def seen(self) -> tuple[str, ...]:
        """Effects that would be seen at their typical size."""
        return tuple(s.effect for s in self.sights if s.verdict == "seen")

    def sight(self, effect: str) -> Sight:
        """How one effect would show.

        Parameters
        ----------
        effect : str
            Its id.

        Returns
        -------
        Sight
            What is left of it beside the baseline's freedom.

        Raises
        ------
        ParameterError
            If the plan does not have it.
        """
        found = next((s for s in self.sights if s.effect == effect), None)
        if found is None:
            raise ParameterError(f"effect = {effect!r} is not allowed: one of {', '.join(s.effect for s in self.sights)}")
        return found

    def separable(self, first: str, second: str) -> bool:
        """Whether two effects that are seen would be told apart; False when one of them is not seen.

        Parameters
        ----------
        first, second : str
            Their ids.

        Returns
        -------
        bool
        """
        both = {self.sight(first).effect, self.sight(second).effect}
        return both <= set(self.seen) and not any({a, b} == both for a, b, _ in self.pairs)

    @property
    def not_asked(self) -> tuple[str, ...]:
        """Effects of the catalogue that have no place in this rig, or none that these channels surround."""
        return tuple(e for e in CATALOGUE if e not in {sight.effect for sight in self.sights})

    def to_dict(self) -> dict[str, Any]:
        """The plan as plain values, null for no number."""

        def number(value: float) -> float | None:
            return value if math.isfinite(value) else None

        return {
            "schema": "pamrs.plan/1",
            "rig": self.rig,
            "channels": list(self.channels),
            "noise": dict(self.noise),
            "blocks": self.blocks,
            "missing": self.missing,
            "experiments": self.experiments,
            "effects": [
                {
                    "id": s.effect,
                    "verdict": s.verdict,
                    "left": number(s.left),
                    "block": s.block or None,
                    "recording": s.recording or None,
                    "size": s.size or None,
                    "typical": number(s.typical),
                    "smallest": number(s.smallest),
                }
                for s in self.sights
            ],
            "not_asked": list(self.not_asked),
            "pairs": [{"effects": [a, b], "cosine": round(c, 4)} for a, b, c in self.pairs],
            "groups": [list(group) for group in self.groups],
            "additions": [
                {
                    "kind": a.kind,
                    "name": a.name,
                    "text": a.text,
                    "seen": list(a.seen),
                    "separated": [list(pair) for pair in a.separated],
                    "bits": round(a.bits, 3),
                }
                for a in self.additions
            ],
        }

    def text(self) -> str:
        """The plan as a page for a terminal."""
        lines = [f"Plan of a diagnosis of {self.rig}, with {', '.join(self.channels) or 'no channel'}", ""]
        lines += ["Blocks that these channels tell apart"]
        for block in self.blocks:
            lines.append(f"  {block['name']:<8} {', '.join(block['drives']) or '(its start)'} -> {block['channel']}")
            lines += _wrapped(f"lumps {block['covers']}: {block['why']}" if block["why"] else block["covers"], 11)
        lines += [] if self.blocks else ["  none"]
        for block in self.missing:
            needs = ", ".join(block["needs"])
            lines += _wrapped(f"not {block['name']} ({block['covers']}): without {needs} nothing drives or shows it", 2)
        if self.experiments:
            lines += ["", "Experiments assumed"]
            for experiment in self.experiments:
                lines += _wrapped(f"{experiment['name']}: {experiment['text']} ({experiment['duration']:.0f} s)", 2)
        return "\n".join([*lines, *(self._effects() if self.blocks else ["", "No effect can be seen"]), *self._gains()])

    def _effects(self) -> list[str]:
        """The table of the effects, and what is not told apart."""
        lines = ["", "Effects of a small but usual size, after the baseline has moved inside its tolerances (noise units of 0.1 s)"]
        lines += [
            f"  {'effect':<25}{'':<8}{'left':>7}  {'in':<9}{'recording':<17}{'at size':>10}{'seen from':>11}  {'unit':<13}taken for"
        ]
        for sight in self.sights:
            rivals = [b if a == sight.effect else a for a, b, _ in self.pairs if sight.effect in (a, b)]
            unit = find_parameter(sight.size).unit if sight.size else ""
            typical = f"{sight.typical:.3g}" if math.isfinite(sight.typical) else ""
            smallest = f"{sight.smallest:.2g}" if math.isfinite(sight.smallest) else ""
            where = f"{sight.block or '-':<9}{sight.recording or '-':<17}"
            if sight.verdict == "hidden":
                rivals += ["the parameters inside their tolerances, or noise" if sight.block else "(nothing here shows it)"]
            lines.append(
                f"  {sight.effect:<25}{sight.verdict:<8}{sight.left:>7.2g}  {where}{typical:>10}"
                f"{smallest:>11}  {'' if unit == '1' else unit:<13}{', '.join(rivals)}".rstrip()
            )
        return [
            *lines,
            *(["", f"Not asked of this rig and these channels: {', '.join(self.not_asked)}"] if self.not_asked else []),
            "",
            "Not told apart: " + ("; ".join(", ".join(g) for g in self.groups) if self.groups else "none of those seen"),
        ]

    def _gains(self) -> list[str]:
        """What would add most."""
        lines = []
        if self.additions:
            lines += ["", "What would add most"]
            for addition in self.additions:
                gains = [f"shows {', '.join(addition.seen)}"] if addition.seen else []
                gains += [f"tells {', '.join(f'{a} from {b}' for a, b in addition.separated)}"] if addition.separated else []
                gains += [] if gains else ["sharper, nothing new"]
                lines += _wrapped(f"{addition.kind} {addition.name}: {'; '.join(gains)} (+{addition.bits:.0f} bit)", 2)
        return lines

    def __repr__(self) -> str:
        return (
            f"Plan({self.rig}: {len(self.blocks)} blocks, {len(self.seen)} of {len(self.sights)} effects seen, "
            f"{len(self.groups)} groups not told apart)"
        )


def _wrapped(text: str, indent: int) -> list[str]:
    return textwrap.wrap(text, 130, initial_indent=" " * indent, subsequent_indent=" " * (indent + 2))


@dataclass(frozen=True, eq=False)
class _Part:
    """What one block over one experiment says: products of baseline sensitivities and signatures, which add up.

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
    progress: Callable[[str], None] | None = None,
) -> Plan:
    """What a diagnosis could tell of a rig from some channels, before anything is recorded.

    Parameters
    ----------
    rig : Rig
        Nominal model, one that can be diagnosed: a tank or a constant supply, valve, chamber and arm without names, or a part.
    channels : iterable of str
        Channels at hand, of ``valve_command``, ``supply_pressure``, ``muscle_pressure`` and ``joint_angle``.
    noise : mapping of str to float, optional
        Sample noise by channel [SI]; that of typical transducers by default (``next_experiment`` of the settings).
    experiments : sequence of str, optional
        Names of the experiments that will be made; multisine, sealed holds, slow triangle and steps by default.
    settings : DiagnosisSettings, optional
        From where on an effect counts as seen, and two as apart; the published ones by default.
    progress : callable, optional
        Called with a line of text now and then.

    Returns
    -------
    Plan
        Blocks, effects seen, groups that are not told apart, what would add most.

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
    sound = _noise(noise, settings)
    say = progress or (lambda _: None)
    every = tuple(c for c in MEASURABLE if c in {*core_rig(rig).inputs, *core_rig(rig).channels})
    whole = available_blocks(rig, every, settings.prepare)
    pool = {e.name: e for e in library(rig, settings.next_experiment)}
    chosen = [name for name in BASIC if name in pool] if experiments is None else list(experiments)
    for name in chosen:
        if name not in pool:
            raise ParameterError(f"experiments has {name!r}, which is not allowed: of rig {rig.name!r} one of {', '.join(pool)}")
    starts = [s for e in CATALOGUE if _applies(rig, e, whole) for s in starts_of(e, sealed=rig.model["valve"] is None)]
    parts: dict[Key, _Part] = {}
    usable = {}
    for name, experiment in pool.items():
        say(f"{name}: {experiment.duration:.0f} s with {len(starts)} starts of {len({s.effect for s in starts})} effects")
        try:
            parts |= _parts(rig, whole, experiment, starts, sound, settings)
            usable[name] = experiment
        except SimulationError:
            continue  # the cut chain leaves the range of the model there
    chosen = [name for name in chosen if name in usable]
    blocks = available_blocks(rig, own, settings.prepare)
    assumed = _Assumed(rig, parts, starts, settings)
    now = assumed.picture(blocks, chosen)
    order = [e for e in CATALOGUE if e in now.sights]
    unseparated = sorted(now.unseparated, key=lambda p: (order.index(p[0]), order.index(p[1])))
    pairs = [(a, b, now.cosine[a, b]) for a, b in unseparated]
    return Plan(
        rig=rig.name,
        channels=own,
        noise={c: sound[c] for c in own if c in sound},
        blocks=[_described(block) for block in blocks],
        missing=[
            {"name": b.name, "covers": b.covers, "needs": assumed.needed(b.name, own, every)}
            for b in whole
            if b.name not in {own_block.name for own_block in blocks}
        ],
        experiments=[{"name": n, "text": usable[n].text, "duration": usable[n].duration} for n in chosen],
        sights=[now.sights[e] for e in order],
        pairs=pairs,
        groups=_joined([(a, b) for a, b, _ in pairs], order),
        additions=assumed.additions(own, every, chosen, usable),
    )


@dataclass(frozen=True, eq=False)
class _Assumed:
    """What every block shows over every experiment, to be looked at with some channels and some experiments."""

    rig: Rig
    parts: dict[Key, _Part]
    starts: list[Start]
    settings: DiagnosisSettings

    def blocks(self, channels: tuple[str, ...]) -> list[Block]:
        """Blocks that some channels tell apart."""
        return available_blocks(self.rig, checked_channels(self.rig, channels), self.settings.prepare)

    def picture(self, blocks: list[Block], experiments: Sequence[str]) -> _Picture:
        """What some blocks over some experiments show."""
        return _picture(self.parts, blocks, experiments, self.starts, self.settings)

    def needed(self, block: str, own: tuple[str, ...], every: tuple[str, ...]) -> list[str]:
        """The fewest channels that, added to those at hand, surround a block."""
        lacking = [c for c in every if c not in own]
        for count in range(1, len(lacking) + 1):
            for several in itertools.combinations(lacking, count):
                if any(b.name == block for b in self.blocks((*own, *several))):
                    return list(several)
        return lacking

    def additions(
        self, own: tuple[str, ...], every: tuple[str, ...], chosen: list[str], usable: Mapping[str, Experiment]
    ) -> list[Addition]:
        """What each further channel (two of them where one surrounds no block) and each further experiment would add."""
        blocks = self.blocks(own)
        now = self.picture(blocks, chosen)
        lacking = [c for c in every if c not in own]
        found = []
        for channel in lacking:
            then = self.picture(self.blocks((*own, channel)), chosen)
            found.append(_addition("channel", channel, channel.replace("_", " "), now, then))
        for several in itertools.combinations(lacking, 2) if not blocks else ():
            text = " and ".join(c.replace("_", " ") for c in several)
            then = self.picture(self.blocks((*own, *several)), chosen)
            found.append(_addition("channels", "+".join(several), text, now, then))
        for name in [n for n in usable if n not in chosen] if blocks else ():
            then = self.picture(blocks, [*chosen, name])
            found.append(_addition("experiment", name, usable[name].text, now, then))
        return sorted(found, key=lambda a: (-(len(a.seen) + len(a.separated)), -a.bits))


def _check_rig(rig: Rig) -> None:
    """Refuse rigs that no experiment is made for."""
    if not isinstance(rig, Rig):
        raise ParameterError(f"rig is a {type(rig).__name__}; a Rig is needed: pamrs.rigs.shoulder(), pamrs.load_rig(path)")
    several = [block for block in rig.blocks if "" not in rig.tables(block)]
    reasons = {
        f"it already has the effect {rig.effects[0]['id']!r}; plan with a rig without effects" if rig.effects else "",
        f"it has named blocks ({', '.join(several)}); rigs of one chain can be planned, without names" if several else "",
        "it is fed by a regulator; rigs fed by a tank or a constant supply can be planned" if regulators_of(rig) else "",
        "its load is a frame; a mass, [joint] and [arm], or no muscle can be planned" if has_frame(rig) else "",
    } - {""}
    if reasons:
        raise DiagnosisError(f"rig {rig.name!r}: {'; '.join(sorted(reasons))}")


def _noise(given: Mapping[str, float] | None, settings: DiagnosisSettings) -> dict[str, float]:
    """Sample noise of every channel [SI]."""
    usual = usual_noise(settings.next_experiment)
    for name, value in (given or {}).items():
        if name not in usual:
            raise ParameterError(f"noise has {name!r}, which is not allowed: one of {', '.join(usual)}")
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(f"noise of {name} = {value} is not allowed: a finite number > 0 is needed")
    return {**usual, **{name: float(value) for name, value in (given or {}).items()}}


def _applies(rig: Rig, effect: str, blocks: list[Block]) -> bool:
    """Whether a rig has what an effect acts on, and a block of the cut chain in which it could show."""
    return fits(rig, effect) and any(acts_in(effect, block) for block in blocks)


def _described(block: Block) -> dict[str, Any]:
    lumped = block.covers != block.name
    return {
        "name": block.name,
        "channel": block.channel,
        "drives": list(block.drives),
        "covers": block.covers,
        "why": _LUMPED.get(block.name, "") if lumped else "",
    }


def _parts(
    rig: Rig,
    blocks: list[Block],
    experiment: Experiment,
    starts: list[Start],
    noise: Mapping[str, float],
    settings: DiagnosisSettings,
) -> dict[Key, _Part]:
    """Products of everything that one experiment shows, by block."""
    stands = experiment.changed(rig)
    prepared = taken(experiment.simulate(rig), stands, experiment.name, noise, settings)
    problem = Problem(blocks, [prepared], core_rig(stands), settings)
    baseline = free_baseline(problem, stands)
    base = residuals(problem, stands, baseline)
    weights = weights_of(problem, stands)
    spread = np.array([stands.parameter(name).tol for name in baseline])
    width, effective = bin_width(prepared, settings.noise.fit_bin_time), settings.next_experiment.effective_samples
    scale, slopes, moved = {}, {}, {}
    for block in blocks:
        key = (block.name, experiment.name)
        r = base[key]
        slope, counts = binned(np.zeros((r.value.size, 0)) if r.jacobian is None else r.jacobian, r.rows, width)
        floor = weights[key] * noise[block.channel] / math.sqrt(bins_of(prepared))
        scale[key] = math.sqrt(effective / max(1, int((counts > 0).sum()))) / floor
        slopes[key] = slope * spread * scale[key]
        moved[key] = np.zeros((slope.shape[0], len(starts)))
    for index, start in enumerate(starts):
        acting = [b for b in blocks if acts_in(start.effect, b)]
        try:
            found = changes(replace(problem, blocks=acting), start.applied(stands), base, start.effect)
        except SimulationError:
            continue  # this size leaves the range in which the model holds
        for block in acting:
            key = (block.name, experiment.name)
            mean, _ = binned(found[key].value - base[key].value, base[key].rows, width)
            moved[key][:, index] = mean * scale[key]
    return {k: _Part(slopes[k].T @ slopes[k], slopes[k].T @ moved[k], moved[k].T @ moved[k]) for k in slopes}


def _picture(
    parts: Mapping[Key, _Part],
    blocks: list[Block],
    experiments: Sequence[str],
    starts: list[Start],
    settings: DiagnosisSettings,
) -> _Picture:
    """What some blocks over some experiments show."""
    used = {key: part for key, part in parts.items() if key[0] in {b.name for b in blocks} and key[1] in experiments}
    effects = list(dict.fromkeys(s.effect for s in starts))
    own_settings = settings.plan
    if not used:
        return _Picture({e: Sight(e, 0.0) for e in effects}, {}, frozenset(), 0.0)
    total = _Part(sum(p.baseline for p in used.values()), sum(p.mixed for p in used.values()), sum(p.signatures for p in used.values()))  # type: ignore[arg-type]
    freed = np.linalg.solve(total.baseline + np.eye(len(total.baseline)), total.mixed)
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
            / settings.next_experiment.effective_samples
        )
        for key, p in used.items()
    }
    power = np.sqrt(np.clip(np.diag(gram), 1e-12, None))
    cosines = np.abs(gram) / np.outer(power, power)
    sights: dict[str, Sight] = {}
    best: dict[str, int] = {}
    for effect in effects:
        own = [k for k, s in enumerate(starts) if s.effect == effect]
        index, key = max(((k, key) for k in own for key in sizes), key=lambda pair: float(sizes[pair[1]][pair[0]]))
        best[effect] = index
        sights[effect] = _sight(starts[index], float(sizes[key][index]), key, own_settings)
    cosine, unseparated = {}, set()
    for first, second in itertools.combinations(effects, 2):
        mine, theirs = best[first], best[second]
        shapes = {e: [k for k, s in enumerate(starts) if s.effect == e] for e in (first, second)}
        forward = float(max(cosines[mine, k] for k in shapes[second]))
        backward = float(max(cosines[theirs, k] for k in shapes[first]))
        cosine[first, second] = min(1.0, max(forward, backward))
        left = min(
            sights[first].left * math.sqrt(max(0.0, 1.0 - forward**2)), sights[second].left * math.sqrt(max(0.0, 1.0 - backward**2))
        )
        seen = min(sights[first].left, sights[second].left) >= own_settings.seen
        alike = cosine[first, second] > own_settings.same_cosine or left < own_settings.apart
        if seen and alike:
            unseparated.add((first, second))
    chosen = [best[e] for e in effects]
    _, logarithm = np.linalg.slogdet(np.eye(len(chosen)) + gram[np.ix_(chosen, chosen)])
    return _Picture(sights, cosine, frozenset(unseparated), 0.5 * float(logarithm) / math.log(2.0))


def _sight(start: Start, left: float, key: Key, settings: PlanSettings) -> Sight:
    """How an effect shows from the start that shows most."""
    if left < 1e-6:
        return Sight(start.effect, 0.0)
    verdict = "seen" if left >= settings.seen else "faint" if left >= settings.faint else "hidden"
    if not start.scalable:
        return Sight(start.effect, left, *key, verdict=verdict)
    leading = start.sizes[0]
    typical, size = abs(start.free[leading]), settings.seen / left
    found = start.scaled(size).free[leading]
    # one that its bounds hold shows less than that
    whole = math.isclose(start.scaled(0.999 * size).free[leading], found, rel_tol=1e-9)
    smallest = abs(found) if size < settings.most_multiple and not whole else math.nan
    return Sight(start.effect, left, *key, leading, typical, smallest, verdict)


def _addition(kind: str, name: str, text: str, now: _Picture, then: _Picture) -> Addition:
    seen = tuple(e for e, s in then.sights.items() if s.verdict == "seen" and now.sights[e].verdict != "seen")
    separated = tuple(sorted(now.unseparated - then.unseparated))
    return Addition(kind, name, text, seen, separated, then.bits - now.bits)


def _joined(pairs: list[tuple[str, str]], order: list[str]) -> list[tuple[str, ...]]:
    """Groups out of pairs that share a member."""
    groups: list[set[str]] = []
    for pair in pairs:
        touching = [g for g in groups if g & set(pair)]
        groups = [g for g in groups if g not in touching] + [set(pair).union(*touching)]
    return sorted((tuple(sorted(g, key=order.index)) for g in groups), key=lambda g: order.index(g[0]))
