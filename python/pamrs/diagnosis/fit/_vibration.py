"""Start of the fit of a vibration: lines of the residual's spectrum, and sizes by recording."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from pamrs._arrays import Array
from pamrs.diagnosis.fit._effect_places import acts_in
from pamrs.diagnosis.fit._fitting import Events, Key, Problem, changes, stacked
from pamrs.diagnosis.prepare import Residual
from pamrs.effects import EffectParameter, Term
from pamrs.errors import SimulationError
from pamrs.rig import Rig

# lines of the spectrum tried for a vibration: two that shake, and what the drive leaves
_MOST_LINES = 5


@dataclass(frozen=True, eq=False)
class VibrationResponse:
    """Change of each recording's residuals by a vibration of each of some frequencies.

    Attributes
    ----------
    effect : Term
        Which effect repeats.
    rows : dict of str to (n,) array
        Stacked residuals by recording.
    columns : dict of float to dict of str to (n, k) array
        By frequency [Hz] and recording: their change per unit of each size [1/SI].
    """

    effect: Term
    rows: dict[str, Array]
    columns: dict[float, dict[str, Array]]

    @staticmethod
    def of(
        effect: Term,
        problem: Problem,
        rig: Rig,
        base: dict[Key, Residual],
        inflation: dict[str, float],
        known: Mapping[str, float] | None = None,
    ) -> VibrationResponse:
        """Signatures of vibrations about a model that stays as it is.

        Parameters
        ----------
        effect : str
            An effect with a form that repeats.
        problem : Problem
            Blocks and recordings.
        rig : Rig
            The model.
        base : dict
            Its residuals.
        inflation : dict of str to float
            As in :func:`pamrs.diagnosis.fit.fit`.
        known : mapping of str to float, optional
            Frequencies that are known; otherwise the lines of the residual's spectrum are taken.
        """
        form = next(f for f in effect.info.forms if f.periodic)
        (scanned,) = (p for p in form.parameters if p.scan is not None)
        frequencies = [v for n, v in (known or {}).items() if n.startswith(scanned.name)]
        if not frequencies:
            frequencies = _lines(effect, scanned, problem, base)
        sizes = [p for p in form.parameters if p.role_in(sealed=False) == "size"]
        rows = _by_recording(problem, base, inflation)
        columns: dict[float, dict[str, Array]] = {}
        for frequency in frequencies:
            changes_found = []
            for size in sizes:
                unit = size.default or max(size.starts)
                alone = {p.name: unit if p is size else 0.0 for p in sizes}
                try:
                    model = rig.with_effect(
                        effect.id, alone | {scanned.name: frequency}, form=form.name
                    )
                    moved = _by_recording(problem, changes(problem, model, base, effect), inflation)
                except SimulationError:
                    break  # so large a torque leaves the range in which the model holds
                changes_found.append({name: (moved[name] - rows[name]) / unit for name in rows})
            if len(changes_found) == len(sizes):
                columns[frequency] = {
                    name: np.stack([one[name] for one in changes_found], axis=1) for name in rows
                }
        return VibrationResponse(effect, rows, columns)

    def best(self, form: str) -> Events | None:
        """The frequencies that take most of the residuals, with the sizes of each recording; None
        where there are not as many as the form has.
        """
        shape = self.effect.info.form(form)
        places = [p.name for p in shape.parameters if p.scan is not None]
        sizes = [p.name for p in shape.parameters if p.scan is None]
        chosen = itertools.combinations(self.columns, len(places))
        best = max(chosen, key=self._gain, default=None)
        if best is None:
            return None
        at_lines = dict(zip(places, best, strict=True))
        values = {
            name: dict(zip(sizes, map(float, self._solved(best, name)), strict=True)) | at_lines
            for name in self.rows
        }
        order = [p.name for p in shape.parameters]
        return Events(self.effect, {n: {p: v[p] for p in order} for n, v in values.items()}, form)

    def _columns(self, lines: tuple[float, ...], name: str) -> Array:
        """Change of a recording's residuals per unit of each size, in the order of the lines."""
        return np.concatenate([self.columns[line][name] for line in lines], axis=1)

    def _solved(self, lines: tuple[float, ...], name: str) -> Array:
        """The sizes that one recording asks for, in the order of the lines."""
        columns = self._columns(lines, name)
        return np.asarray(np.linalg.lstsq(columns, -self.rows[name], rcond=1e-9)[0])

    def _gain(self, lines: tuple[float, ...]) -> float:
        """Reduction of the sum of squares of all recordings by some lines."""
        gain = 0.0
        for name, rows in self.rows.items():
            rest = rows + self._columns(lines, name) @ self._solved(lines, name)
            gain += float(rows @ rows - rest @ rest)
        return gain


def _by_recording(
    problem: Problem, block_residuals: dict[Key, Residual], inflation: dict[str, float]
) -> dict[str, Array]:
    """Stacked residuals of each recording."""
    return {
        p.recording.name: stacked(replace(problem, recordings=[p]), block_residuals, inflation)[0]
        for p in problem.recordings
    }


def _lines(
    effect: Term, scanned: EffectParameter, problem: Problem, base: dict[Key, Residual]
) -> list[float]:
    """Lines of the spectrum of what is left in the blocks in which an effect acts [Hz]."""
    series = [
        (base[b.name, p.recording.name], p.dt)
        for b in problem.blocks
        for p in problem.recordings
        if acts_in(effect, b)
    ]
    assert scanned.scan is not None
    low, high, _ = scanned.scan
    return lines_of(series, low, high, _MOST_LINES)


def lines_of(
    series_given: Iterable[tuple[Residual, float]], low: float, high: float, most: int
) -> list[float]:
    """Frequencies at which the spectrum of residuals exceeds its surroundings most.

    Parameters
    ----------
    series_given : iterable of (Residual, float)
        Residuals, each with its sampling interval [s].
    low, high : float
        Least and greatest frequency [Hz].
    most : int
        Number of frequencies at the most.

    Returns
    -------
    list of float
        The clearest first [Hz]; two are at least as far apart as the longest residual can tell.
    """
    series = [(np.where(r.rows, r.value, 0.0) / r.noise, dt) for r, dt in series_given]
    if not series:
        return []
    longest = max(values.size * dt for values, dt in series)
    fastest = min(0.4 / dt for _, dt in series)
    step = 0.25 / longest
    grid = np.arange(max(low, 2.0 / longest), min(high, fastest), step)
    if grid.size == 0:
        return []
    power = sum((_power(values, dt, grid) for values, dt in series), np.zeros(grid.size))
    clear = power / np.maximum(_around(power), 1e-300)
    places: list[int] = []
    for k in np.argsort(-clear, kind="stable"):
        top = power[max(0, k - 1) : k + 2].max() == power[k]
        if top and all(abs(int(k) - other) * step > 1.5 / longest for other in places):
            places.append(int(k))
        if len(places) == most:
            break
    return [float(grid[k]) for k in places]


def _power(values: Array, dt: float, grid: Array) -> Array:
    """Power of a series, its ends faded out, at some frequencies [Hz]."""
    faded = (values - values.mean()) * np.hanning(values.size)
    size = 1 << math.ceil(math.log2(8 * values.size))
    spectrum = np.abs(np.fft.rfft(faded, size)) ** 2 / values.size
    return np.asarray(np.interp(grid, np.fft.rfftfreq(size, dt), spectrum), dtype=np.float64)


def _around(power: Array) -> Array:
    """Median of a spectrum over the surroundings of each frequency."""
    half = max(8, power.size // 20)
    padded = np.pad(power, half, mode="reflect" if power.size > half else "edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1)
    return np.asarray(np.median(windows, axis=1), dtype=np.float64)
