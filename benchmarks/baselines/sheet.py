"""A case as the baselines see it: residuals of the refitted cut chain, measured signals, the gap to
the noise.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from pamrs.diagnosis import DiagnosisSettings
from pamrs.diagnosis.fit import FINAL_STEP_SHARE, Fit, Key, Problem, fit, free_baseline, residuals
from pamrs.diagnosis.noise import NoiseLevel, bins_of, noise_levels
from pamrs.diagnosis.prepare import Block, Prepared, Residual, available_blocks, binned, prepare
from pamrs.diagnosis.search import refitted, with_inflation
from pamrs.errors import SimulationError
from pamrs.recordings import load_case
from pamrs.rig import Rig
from pamrs.simulation import core_rig

Array = NDArray[np.float64]

STEP = 0.02
"""Sample time of what the baselines learn from: means over this long [s]."""
LEAST_ROOM = 0.05
"""Sum over the channels of what is above the noise, in units of it, below which there is no gap to
close (as in the diagnosis)."""
ALPHA = 0.01
"""False alarms that a test of chi-square allows."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """One block over one recording, thinned for learning.

    Attributes
    ----------
    residual : Residual
        Measured minus predicted by the refitted baseline, at every sample.
    prepared : Prepared
        The recording.
    noise : float
        Noise level of a sample, in the channel's unit: its own noise and that of the drives.
    y : (m,) array
        Residual over `noise`, means over :data:`STEP`.
    u : (m, k) array
        Measured signals, in units of their scatter over the recordings to fit.
    pieces : list of (a, b)
        Windows, in means.
    dt : float
        Time between two means [s].
    """

    residual: Residual
    prepared: Prepared
    noise: float
    y: Array
    u: Array
    pieces: list[tuple[int, int]]
    dt: float

    def corrected(self, correction: Array) -> Array:
        """Residual at every sample with a correction (m,) taken off, freed of the windows' starts
        like the diagnosis' own.
        """
        r = self.residual
        width = round(self.dt / self.prepared.dt)
        centres = (np.arange(correction.size) + 0.5) * width - 0.5
        value = np.where(
            r.rows,
            r.value - self.noise * np.interp(np.arange(r.value.size), centres, correction),
            0.0,
        )
        for a, b, q in r.starts:
            value[a:b] -= q @ (q.T @ value[a:b])
        return np.where(r.rows, value, 0.0)

    def error(self, correction: Array | None = None) -> float:
        """Root mean square of the residual, a correction taken off, in units of the noise."""
        rows = self.residual.rows
        value = self.residual.value if correction is None else self.corrected(correction)
        return float(np.sqrt(np.mean(value[rows] ** 2))) / self.noise if rows.any() else 0.0


@dataclass(frozen=True, eq=False)
class Column:
    """One block: its stretches to learn from and those held out (the same when nothing is held
    out); `free` are the held-out ones by the model whose parameters no tolerance holds.
    """

    block: Block
    names: tuple[str, ...]
    inner: list[Stretch]
    outer: list[Stretch]
    free: list[Stretch] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Sheet:
    """A case with its baseline refitted.

    Attributes
    ----------
    name : str
        The case's.
    columns : list of Column
        Its blocks.
    p_value : float
        Chance of the refitted misfit from noise alone, the least over the blocks times their
        number.
    moved : dict of str to float
        Distance of each parameter from its nominal value, in tolerances.
    """

    name: str
    columns: list[Column]
    p_value: float
    moved: dict[str, float]

    @property
    def detected(self) -> bool:
        """Whether the refit alone raises an alarm."""
        return self.p_value < ALPHA


def _refitted(inner: Problem, nominal: Rig) -> tuple[Fit, Fit | None]:
    """Baseline inside its tolerances, as the diagnosis refits it; and fitted on without them, as
    far as a diagnosis lets a freed parameter go (None where that model cannot be run).
    """
    first = refitted(inner, nominal, dict.fromkeys((b.name for b in inner.blocks), 1.0))
    best, inflation = with_inflation(inner, nominal, first, {})
    own = inner.settings
    try:
        free = fit(
            inner,
            nominal,
            (),
            {},
            inflation,
            warm=best,
            freed=tuple(free_baseline(inner, nominal)),
            evaluations=own.baseline_evaluations,
            share=FINAL_STEP_SHARE,
        )
    except SimulationError:
        return best, None
    return best, free


def _signals(prepared: Prepared, rig: Rig) -> dict[str, Array]:
    """Measured signals and their rates at every sample, SI; the opening of the valve by its
    command.
    """
    out: dict[str, Array] = {}
    for channel, short in (
        ("muscle_pressure", "p"),
        ("joint_angle", "q"),
        ("supply_pressure", "ps"),
    ):
        if channel in prepared.signals:
            value, slope = prepared.signals[channel]
            out[short] = value
            if short != "ps":
                out[f"d{short}"] = slope
    if rig.model["valve"] is not None:
        null, half = rig.parameter("valve.null_voltage").value, rig.model["valve"]["half_range"]
        out["x"] = (prepared.commands["valve_command"] - null) / half
    return out


def _stretch(
    r: Residual,
    noise_level: NoiseLevel,
    prepared: Prepared,
    signals: dict[str, Array],
    scales: dict[str, tuple[float, float]],
) -> Stretch:
    width = max(1, round(STEP / prepared.dt))
    y, _ = binned(r.value / noise_level.sample, r.rows, width)
    every = np.ones(prepared.n, dtype=bool)
    u = np.column_stack(
        [(binned(v, every, width)[0] - scales[n][0]) / scales[n][1] for n, v in signals.items()]
    )
    pieces = [(-(-a // width), min(b // width, y.size)) for a, b, _ in r.starts]
    return Stretch(
        r,
        prepared,
        noise_level.sample,
        y,
        u,
        [(a, b) for a, b in pieces if b - a >= 16],
        width * prepared.dt,
    )


def sheet(folder: str | os.PathLike[str]) -> Sheet:
    """Load a case, refit its baseline, and lay out what is left.

    Parameters
    ----------
    folder : path-like
        The case.
    """
    case = load_case(folder)
    rig = case.rig
    settings = DiagnosisSettings()
    fitted = [prepare(r, rig, settings) for r in case.fit or case.recordings]
    held = [prepare(r, rig, settings) for r in case.held_out if case.fit]
    blocks = available_blocks(rig, case.channels)
    core = core_rig(rig)
    columns: list[Column] = []
    moved: dict[str, float] = {}
    chances: list[float] = []
    tables = {p.recording.name: _signals(p, rig) for p in [*fitted, *held]}
    names = tuple(tables[fitted[0].recording.name])
    every = {n: np.concatenate([tables[p.recording.name][n] for p in fitted]) for n in names}
    # the opening has a zero that means something, and so have rates
    scales = {
        n: (0.0 if n[0] in "dx" else float(v.mean()), float(v.std()) or 1.0)
        for n, v in every.items()
    }
    for members in ([b for b in blocks if b.name != "arm"], [b for b in blocks if b.name == "arm"]):
        if not members:
            continue
        inner = Problem(members, fitted, core, settings)
        outer = Problem(members, held, core, settings) if held else inner
        best, free = _refitted(inner, rig)
        model = best.rig
        for name, value in best.moved.items():
            moved[name] = max(value, moved.get(name, 0.0), key=abs)
        noise_level = noise_levels(inner, core.respecified(model.to_json()))
        if held:
            noise_level |= noise_levels(outer, core.respecified(model.to_json()))
        found = residuals(inner, model)
        outside = residuals(outer, model) if held else found
        freely = _outside(outer, free, outside)

        def lay(
            block: Block,
            prepared: Prepared,
            left: dict[Key, Residual],
            noise_level: dict[Key, NoiseLevel] = noise_level,
        ) -> Stretch:
            key = (block.name, prepared.recording.name)
            return _stretch(
                left[key], noise_level[key], prepared, tables[prepared.recording.name], scales
            )

        for block in members:
            stretches = [lay(block, p, found) for p in fitted]
            columns.append(
                Column(
                    block,
                    names,
                    stretches,
                    [lay(block, p, outside) for p in held] if held else stretches,
                    [lay(block, p, freely) for p in held or fitted],
                )
            )
            chances.append(_chance(block, fitted, found, noise_level))
    return Sheet(case.name, columns, min(1.0, min(chances) * len(chances)), moved)


def _outside(outer: Problem, free: Fit | None, kept: dict[Key, Residual]) -> dict[Key, Residual]:
    """Held-out residuals of the free refit; those of the other one where it cannot be run there."""
    if free is None:
        return kept
    try:
        return residuals(outer, free.rig)
    except SimulationError:
        return kept


def _chance(
    block: Block,
    recordings: list[Prepared],
    found: dict[Key, Residual],
    noise_level: dict[Key, NoiseLevel],
) -> float:
    """Chi-square of the means over 0.1 s against their noise level, each counted as independent:
    the textbook's test of a fit.
    """
    total, count = 0.0, 0
    for prepared in recordings:
        key = (block.name, prepared.recording.name)
        means, counts = binned(found[key].value, found[key].rows, bins_of(prepared))
        total += float(((means[counts > 0] / noise_level[key].binned) ** 2).sum())
        count += int((counts > 0).sum())
    return float(chi2.sf(total, max(1, count)))


def errors(
    column: Column, corrections: list[Array] | None = None, *, free: bool = False
) -> tuple[float, float]:
    """Root mean square of a block's held-out residual, and its noise level, in the channel's
    unit; of the refit without tolerances where `free`.
    """
    squares, floors_, weights = [], [], []
    for i, stretch in enumerate(column.free if free else column.outer):
        r = stretch.residual
        value = r.value if corrections is None else stretch.corrected(corrections[i])
        squares.append(float(np.mean(value[r.rows] ** 2)) if r.rows.any() else 0.0)
        floors_.append(stretch.noise**2)
        weights.append(max(1, int(r.rows.sum())))
    return math.sqrt(float(np.average(squares, weights=weights))), math.sqrt(
        float(np.average(floors_, weights=weights))
    )


def gap_closed(table: dict[str, dict[str, float]], method: str) -> float | None:
    """(refit - after)/(refit - noise), pooled over channels in units of their noise; None without a
    gap.

    Parameters
    ----------
    table : dict of str to dict
        By channel: ``noise``, ``refit`` and the root mean square error of every method, SI.
    method : str
        Which of them is "after".
    """
    refit = sum(e["refit"] / e["noise"] for e in table.values())
    after = sum(e[method] / e["noise"] for e in table.values())
    room = refit - len(table)
    return None if room < LEAST_ROOM else max(0.0, min(1.0, (refit - after) / room))
