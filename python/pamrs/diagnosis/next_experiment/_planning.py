"""Plans before any data: blocks that some channels tell apart, effects that they show, and effects
that they cannot tell from each other, by a few standard experiments that are simulated.
"""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from pamrs._arrays import Array
from pamrs._progress import Steps
from pamrs.diagnosis.fit import Problem, Start, free_baseline
from pamrs.diagnosis.limits import Limits, Products, possible_starts, products_of
from pamrs.diagnosis.next_experiment._differences import (
    REPLICATES,
    checked_channels,
    measurable,
    noise_of,
    taken,
    usual_noise,
)
from pamrs.diagnosis.next_experiment._plan import Addition, Plan
from pamrs.diagnosis.next_experiment._words import words
from pamrs.diagnosis.noise import curve_errors_of, noise_levels
from pamrs.diagnosis.prepare import Block, Prepared, available_blocks, with_unjudged_starts
from pamrs.diagnosis.settings import DiagnosisSettings
from pamrs.effects import EFFECTS
from pamrs.errors import DiagnosisError, ParameterError, SimulationError
from pamrs.experiments import Experiment, library
from pamrs.findings import DETECTED
from pamrs.report.words import spoken_name
from pamrs.rig import Rig
from pamrs.rig.schema import qualified
from pamrs.simulation import core_rig

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


def plan_diagnosis(
    rig: Rig,
    channels: Iterable[str],
    *,
    noise: Mapping[str, float] | None = None,
    experiments: Sequence[str] | None = None,
    settings: DiagnosisSettings | None = None,
    progress: Callable[[str], object] | None = None,
) -> Plan:
    """Plan a diagnosis: what it could tell of a rig from some channels, before any recording.

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
    >>> plan.limit("leak_muscle").verdict
    'named'
    """
    _check_rig(rig)
    settings = DiagnosisSettings() if settings is None else settings
    own = checked_channels(rig, tuple(channels))
    sound = _noise(rig, noise)
    every = measurable(rig)
    whole = available_blocks(rig, every)
    pool = {e.name: e for e in library(rig, settings)}
    chosen = _chosen(rig, pool, experiments)
    starts = possible_starts(rig, whole)
    layers = _layers(rig, own, every)
    together = [block for _, blocks in layers for block in blocks]
    free = list(free_baseline(Problem(together, [], core_rig(rig), settings), rig))
    recorded = _recorded(rig, pool, layers, sound, settings)
    products: dict[tuple[Block, str], Array] = {}
    usable, tell = {}, Steps(progress)
    for done, (name, each) in enumerate(recorded.items()):
        tell(name, done / len(recorded))
        changed = pool[name].changed(rig)
        try:
            for k, (_, cut) in enumerate(layers):
                visited = [own[k] for own in recorded.values()]
                products |= _products(cut, changed, each[k], visited, starts, free, settings)
        except SimulationError:
            continue  # the cut chain leaves the range of the model there
        usable[name] = pool[name]
    chosen = [name for name in chosen if name in usable]
    blocks = available_blocks(rig, own)
    assumed = _Assumed(rig, products, starts, free, settings)
    now = assumed.limits(blocks, chosen)
    order = list(now.each)
    pairs = [(a, b, cosine) for (a, b), cosine in now.unseparated.items()]
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
        limits=list(now.each.values()),
        pairs=pairs,
        groups=_joined([(a, b) for a, b, _ in pairs], order),
        additions=assumed.additions(own, every, chosen, usable),
        units=rig.units,
    )


@dataclass(frozen=True, eq=False)
class _Assumed:
    """Products of every block over every experiment, for limits by fewer of them."""

    rig: Rig
    products: Products
    starts: list[Start]
    baseline: list[str]
    settings: DiagnosisSettings

    def blocks(self, channels: tuple[str, ...]) -> list[Block]:
        """Blocks that some channels tell apart."""
        return available_blocks(self.rig, checked_channels(self.rig, channels))

    def limits(self, blocks: list[Block], experiments: Sequence[str]) -> Limits:
        """Limits by some blocks over some experiments."""
        used = {
            (block, name): values
            for (block, name), values in self.products.items()
            if block in blocks and name in experiments
        }
        return Limits(used, self.starts, self.baseline, self.settings)

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
        """Gains of each further channel (of two where one surrounds no block) and experiment."""
        blocks = self.blocks(own)
        now = self.limits(blocks, chosen)
        lacking = [c for c in every if c not in own]
        found = []
        for channel in lacking:
            then = self.limits(self.blocks((*own, channel)), chosen)
            found.append(_addition("channel", channel, spoken_name(channel), now, then))
        for several in itertools.combinations(lacking, 2) if not blocks else ():
            text = " and ".join(map(spoken_name, several))
            then = self.limits(self.blocks((*own, *several)), chosen)
            found.append(_addition("channels", "+".join(several), text, now, then))
        for name in [n for n in usable if n not in chosen] if blocks else ():
            then = self.limits(blocks, [*chosen, name])
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
    levels = {name: float(value) for name, value in (given or {}).items()}
    return noise_of(rig, levels)


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


def _recorded(
    rig: Rig,
    pool: Mapping[str, Experiment],
    layers: Sequence[tuple[tuple[str, ...], list[Block]]],
    noise: Mapping[str, float],
    settings: DiagnosisSettings,
) -> dict[str, list[Prepared]]:
    """Experiments as recordings of the channels of each layer, ready for the cut chain; without
    those in which the model leaves its range.
    """
    found = {}
    for name, experiment in pool.items():
        changed = experiment.changed(rig)
        with contextlib.suppress(SimulationError):
            run = experiment.simulate(rig)
            found[name] = [
                with_unjudged_starts(
                    blocks, core_rig(changed), taken(run, changed, name, heard, settings)
                )
                for channels, blocks in layers
                for heard in [{c: v for c, v in noise.items() if c in channels}]
            ]
    return found


def _products(
    blocks: list[Block],
    rig: Rig,
    prepared: Prepared,
    visited: list[Prepared],
    starts: Sequence[Start],
    baseline: Sequence[str],
    settings: DiagnosisSettings,
) -> Products:
    """Products of all that one experiment shows; the model's error runs over what all visit."""
    few = replace(settings, noise_replicates=REPLICATES)
    problem = Problem(blocks, [prepared], core_rig(rig), few)
    curve_errors = curve_errors_of(rig, settings.usual_error)
    level = noise_levels(problem, problem.core, curve_errors, visited)
    return products_of(problem, rig, starts, baseline, level)


def _addition(kind: str, name: str, text: str, now: Limits, then: Limits) -> Addition:
    seen = tuple(e for e, limit in then.each.items() if limit.seen >= DETECTED > now.each[e].seen)
    separated = tuple(sorted(now.unseparated.keys() - then.unseparated.keys()))
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
