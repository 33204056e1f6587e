"""First samples of a recording that depend on a beginning that nobody measured.

A regulator whose outlet has no gauge begins a recording somewhere between what it feeds and what it
is set to: at rest all three are the same, and a log that begins as a stopcock is opened has them
bars apart; a recording that states its ``initial_pressure`` settles that. Along a tube of segments
gas is at rest or flows: at rest its pressure is that of its ends, and a log that begins while air
flows has a gradient there. What a block predicts from either tells the samples that depend on it;
these are not judged. A joint begins at rest where that suits what follows better than the slope of
its first samples.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from pamrs import _core
from pamrs._arrays import Array, Index, Mask
from pamrs.channels import block_of, channel_of, dotted
from pamrs.diagnosis.prepare._blocks import Block, Tube
from pamrs.diagnosis.prepare._residual import (
    WINDOW_SAMPLES_PER_STATE,
    Residual,
    TimeBefore,
    predicted,
    residual,
)
from pamrs.diagnosis.prepare._signals import NOISE_STDS, Prepared
from pamrs.errors import SimulationError
from pamrs.rig.schema import qualified

# [noise levels] move of a sample by an unmeasured beginning: all move the same way (decision 92)
_OUTLET_NOISES = 0.3
# [delays of the tube] flow before a recording that begins not at rest, until it is steady
_FLOW_DELAYS = 20.0
# [delays of the tube] how long its ends moved by then: a flow swings on (decision 109)
_MOVING_DELAYS = 0.5
# [delays of the tube] its ends hear nothing of each other: a front is smeared (decision 109)
_SILENT_DELAYS = 0.6
# [delays of the tube] how long its ends are looked at for whether they stand still
_STILL_DELAYS = 4.0
# [noise levels] flow before, ends seen at rest: 3 to 6 at rest, 65 in a flow (decision 109)
_STILL_NOISES = 10.0
# times likelier rest than flow as a tube is opened: e^75 there, e^5 at a turn (decision 109)
_REST_LIKELIHOOD = 1000.0


Tolerances = Mapping[str, float]


def with_unjudged_starts(
    blocks: Sequence[Block],
    core: _core.Rig,
    prepared: Prepared,
    tolerances: Tolerances | None = None,
) -> Prepared:
    """A recording whose first samples are not judged in blocks that remember where a regulator
    without a gauge stood, or what flowed along a tube.

    Parameters
    ----------
    blocks : sequence of Block
        Those of the rig.
    core : _core.Rig
        The nominal model, compiled.
    prepared : Prepared
        The recording.
    tolerances : mapping of str to float, optional
        Of the rig's parameters, by dotted name [SI]; without them no motion is said to begin at
        rest.

    Returns
    -------
    Prepared
        With `unsettled`, the samples by the channel that each such block predicts, and motions that
        begin `at_rest`.
    """
    beginnings = _Beginnings(blocks, core, prepared)
    counts = {block.channel: beginnings.remembered(block) for block in blocks}
    unsettled = {channel: count for channel, count in counts.items() if count > 0}
    prepared = replace(
        prepared, unsettled=unsettled, after_holes=_rows_after_holes(blocks, core, prepared)
    )
    moving = [block for block in blocks if block.mechanical and block.window is not None]
    rests = [
        block.channel
        for block in moving
        if _begins_at_rest(block, core, prepared, tolerances or {})
    ]
    return replace(prepared, at_rest=frozenset(rests), _start_states={}) if rests else prepared


def _rows_after_holes(
    blocks: Sequence[Block], core: _core.Rig, prepared: Prepared
) -> dict[str, Mask]:
    """Rows of each channel that show when a command changed in a hole, which nobody recorded: what
    is not measured behind it (a regulator's outlet, a spool, the flow in a tube) went on there.
    """
    early, rows_of = prepared.commanded_early(), dict[str, Mask]()
    if early is None:
        return rows_of
    for block in blocks:
        try:
            apart = predicted(block, core, early) - predicted(block, core, prepared)
        except SimulationError:
            continue  # the fit says what cannot be predicted
        shown = np.abs(apart) > _OUTLET_NOISES * prepared.noise[block.channel]
        if shown.any():
            rows_of[block.channel] = shown
    return rows_of


def _begins_at_rest(
    block: Block, core: _core.Rig, prepared: Prepared, tolerances: Tolerances
) -> bool:
    """True where the model follows a motion better from rest than from its first samples' speed.

    A joint on its stop that is given a speed, by the noise of a few samples, bounces, and what a
    window is freed of is linear in where it starts.
    """
    missed = []
    for channels in (frozenset[str](), frozenset({block.channel})):
        from_start = replace(prepared, at_rest=channels, _start_states={})
        missed.append(_first_window_misfit(block, core, from_start, tolerances))
    from_speed, from_rest = missed
    return from_speed - from_rest > NOISE_STDS**2


def _first_window_misfit(
    block: Block, core: _core.Rig, prepared: Prepared, tolerances: Tolerances
) -> float:
    """Chi-square that the first window of a block keeps, its parameters free inside their
    tolerances; NaN where nothing tells it.
    """
    names = [n for n in core.parameter_names if n in block.parameters and n in tolerances]
    if not names:
        return math.nan
    tol = np.array([tolerances[n] for n in names])
    try:
        with_slopes = residual(block, core, prepared, names)
    except SimulationError:
        return math.nan
    if with_slopes.jacobian is None or not with_slopes.starts or with_slopes.starts[0][0] > 0:
        return math.nan
    last = with_slopes.starts[0][1]
    slopes = np.vstack([with_slopes.jacobian[:last] * tol / with_slopes.noise, np.eye(tol.size)])
    rows = np.concatenate([with_slopes.value[:last] / with_slopes.noise, np.zeros(tol.size)])
    rows = rows - slopes @ np.linalg.lstsq(slopes, rows)[0]
    return float(rows @ rows)


def _trend(prepared: Prepared, channel: str, rows: Index) -> float:
    """Trend of some samples of a channel, in its standard deviations."""
    way = rows - rows.mean()
    trend = float(way @ prepared.recording.channels[channel][rows]) / float(np.sqrt(way @ way))
    return trend / prepared.noise[channel]


class _Beginnings:
    """Predictions of one recording by the blocks of a rig, from different beginnings."""

    def __init__(self, blocks: Sequence[Block], core: _core.Rig, prepared: Prepared) -> None:
        self.core, self.prepared = core, prepared
        self.at = {block.channel: block for block in blocks}
        self._predictions: dict[tuple[str, bool], Array] = {}

    def remembered(self, block: Block) -> int:
        """Samples up to the last one that shows how what nobody measured in a block began."""
        return max(
            self._last_sample(block, self._change_by_outlets(block))
            if "supply" in block.simulated
            else 0,
            self._last_sample(block, self._change_by_tubes(block)) if block.tubes else 0,
        )

    def _last_sample(self, block: Block, apart: Array) -> int:
        """Samples up to the last one at which two predictions can be told apart."""
        most = _OUTLET_NOISES * self.prepared.noise[block.channel]
        shown = np.flatnonzero(np.abs(apart) > most)
        return int(shown[-1]) + 1 if shown.size else 0

    def _change_by_outlets(self, block: Block) -> Array:
        """Change of a prediction if regulators begin at their set pressures, or a standard
        deviation above where the recording says that they begin.
        """
        prepared = self.prepared
        outlets = {}
        for name in _regulator_commands(block):
            full = qualified("supply", block_of(name))
            stated = prepared.outlets.get(full, (max(0.0, float(prepared.held[name][0])), 0.0))
            outlets[full] = sum(stated)
        try:
            return predicted(block, self.core, prepared, outlets) - self._predicted_from(
                block, moving=False
            )
        except SimulationError:
            return np.zeros(0)  # the fit says what cannot be predicted

    def _change_by_tubes(self, block: Block) -> Array:
        """Change of a prediction if air flowed through tubes before; empty where it did not."""
        try:
            apart = self._predicted_from(block, moving=True) - self._predicted_from(
                block, moving=False
            )
            little = np.abs(apart).max() <= _STILL_NOISES * self.prepared.noise[block.channel]
            at_rest = all(
                (little and self._stands_still(tube)) or self._is_opened_at_rest(tube)
                for tube in block.tubes
            )
        except SimulationError:
            return np.zeros(0)
        return np.zeros(0) if at_rest else apart

    def _stands_still(self, tube: Tube) -> bool:
        """True where no measured end of a tube is seen to move as the recording begins."""
        recording = self.prepared.recording
        early = max(
            2 * WINDOW_SAMPLES_PER_STATE, int(_STILL_DELAYS * tube.delay / self.prepared.dt)
        )
        names = [name for name in (tube.beginning, tube.end) if name in recording.channels]
        for name in names:
            rows = np.flatnonzero(recording.mask[name][:early])
            if rows.size < WINDOW_SAMPLES_PER_STATE:
                return False
            if abs(_trend(self.prepared, name, rows)) > NOISE_STDS:
                return False
        return bool(names)

    def _is_opened_at_rest(self, tube: Tube) -> bool:
        """True where a tube at rest is opened as the recording begins: until its ends hear of each
        other, `to` stands still, and neither moves as it would in a flow.
        """
        early = int(_SILENT_DELAYS * tube.delay / self.prepared.dt)
        ends = [name for name in (tube.end, tube.beginning) if name in self.at]
        evidences = [
            evidence
            for name in ends
            if (evidence := self._evidence_of_rest(name, early)) is not None
        ]
        if tube.end not in ends or len(evidences) < len(ends):
            return False
        fits, _ = evidences[0]
        likely = [more for _, more in evidences]
        least = math.log(_REST_LIKELIHOOD)
        return fits and min(likely) > least

    def _evidence_of_rest(self, channel: str, early: int) -> tuple[bool, float] | None:
        """True for first samples of a channel that fit a rest, and the log likelihood of rest
        against flow; None where there are too few samples.
        """
        rows = self.prepared.recording.mask[channel][:early]
        if rows.sum() < WINDOW_SAMPLES_PER_STATE:
            return None
        read = self.prepared.recording.channels[channel][:early][rows]

        def missed(moving: bool) -> float:
            rest = read - self._predicted_from(self.at[channel], moving=moving)[:early][rows]
            return float(np.var(rest)) * rest.size / self.prepared.noise[channel] ** 2

        rest, freedom = missed(False), read.size - 1
        return rest < freedom + 3.0 * math.sqrt(2.0 * freedom), 0.5 * (missed(True) - rest)

    def _predicted_from(self, block: Block, *, moving: bool) -> Array:
        """Prediction of a block whose tubes began at rest, or as a flow leaves them."""
        key = (block.name, moving)
        if key not in self._predictions:
            longest = max((tube.delay for tube in block.tubes), default=0.0) / self.prepared.dt
            before = TimeBefore(
                math.ceil(_FLOW_DELAYS * longest),
                math.ceil(_MOVING_DELAYS * longest),
            )
            self._predictions[key] = predicted(
                block, self.core, self.prepared, before=before if moving else None
            )
        return self._predictions[key]


def _regulator_commands(block: Block) -> list[str]:
    """Commands of the regulators that a block is driven by."""
    return [name for name in block.drives if channel_of(name) == "supply_command"]


def _unmeasured(block: Block) -> str:
    """Words on what nobody measured in a block, and on what would measure it."""
    reasons = []
    if "supply" in block.simulated:
        gauges = [dotted("supply_pressure", block_of(name)) for name in _regulator_commands(block)]
        reasons.append(
            "they show where the regulator began, and nobody measured that (a gauge for "
            f"{' or '.join(gauges)} would, or its initial_pressure in the recording's parameters)"
        )
    if block.tubes:
        tubes = " and ".join(tube.name for tube in block.tubes)
        reasons.append(
            f"they show what flowed through {tubes} before, and nobody measured that (a recording "
            "that begins at rest needs not know)"
        )
    return ", or ".join(reasons)


def notes_on_beginnings(blocks: Sequence[Block], recordings: Sequence[Prepared]) -> list[str]:
    """Sentences on beginnings that are not judged.

    Parameters
    ----------
    blocks : sequence of Block
        Those that are judged.
    recordings : sequence of Prepared
        Those of a case; one that is there twice counts once.

    Returns
    -------
    list of str
        A sentence for each block.
    """
    notes = []
    each = {p.recording.name: p for p in recordings}.values()
    for block in blocks:
        having = [p for p in each if p.unsettled.get(block.channel)]
        if having:
            times = ", ".join(
                f"{p.unsettled[block.channel] * p.dt:.3g} s of {p.recording.name}" for p in having
            )
            notes.append(
                f"block {block.name}: the first {times} were not judged: {_unmeasured(block)}"
            )
        heard = [
            (p, p.after_holes[block.channel].sum()) for p in each if block.channel in p.after_holes
        ]
        if heard:
            times = ", ".join(f"{count * p.dt:.3g} s of {p.recording.name}" for p, count in heard)
            notes.append(
                f"block {block.name}: {times} were not judged: a command changed in a hole of the "
                "log, and nobody recorded when"
            )
    return notes


def notes_on_warm_starts(
    blocks: Sequence[Block],
    recordings: Sequence[Prepared],
    residuals: Mapping[tuple[str, str], Residual],
) -> list[str]:
    """Gases that began clearly warmer or colder than the room, in words: a sentence for each block.

    Parameters
    ----------
    blocks : sequence of Block
        Those that are judged.
    recordings : sequence of Prepared
        Those of a case; one that is there twice counts once.
    residuals : mapping
        Residuals of the final model, by block and recording.
    """
    notes = []
    for block in blocks:
        away = {
            p.recording.name: (kelvin - block.warm.room, p.settings.begun_temperature_error)
            for p in recordings
            if (kelvin := residuals[block.name, p.recording.name].temperature) is not None
            and block.warm is not None
        }
        clear = [f"{k:+.0f} K in {name}" for name, (k, least) in away.items() if abs(k) > least]
        if clear:
            notes.append(
                f"block {block.name}: recordings begin in a transient; the temperature of the gas "
                f"there is fitted, and differs from the room's by about {', '.join(clear)}"
            )
    return notes
