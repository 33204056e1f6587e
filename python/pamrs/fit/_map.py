"""A muscle known by its measured forces alone: a table of forces over pressure and contraction, and
how far the measurements scatter about it.

The table is the least squares one of the rows: bilinear between its nodes, with a small penalty on
second differences that carries it into corners nobody measured. It is then made monotone, falling
with contraction and rising with pressure, by isotonic regression along both axes (R. E. Barlow et
al., *Statistical Inference under Order Restrictions*, 1972: pooled adjacent violators), which keeps
the order along the first axis while it makes that along the second.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pamrs._arrays import Array, Index, Mask
from pamrs._checks import contraction_of, matched, refused
from pamrs._views import Panels, View
from pamrs.errors import RecordingError
from pamrs.findings import to_plain
from pamrs.fit._checks import check_rest_length
from pamrs.fit._data import ForceMap
from pamrs.rig import Muscle, Rig, force_table
from pamrs.rig.schema import keys_of
from pamrs.rigs import bench

_MOST_LEVELS: Final = 24
"""Pressure levels that are nodes themselves; of more, as in a ramp, this many are taken."""
_NODES: Final = 20
_MOST_NODES: Final = 200
_SHARE: Final = 0.3
"""Of all rows in each direction: then the branches are told apart."""
_STIFF: Final = 1e-4
"""Penalty on second differences, of a node's mean weight: it decides nothing where rows are."""


@dataclass(frozen=True, eq=False, repr=False)
class MapFit(View):
    """A table of forces, and what the measurements say of it.

    Attributes
    ----------
    pressure, contraction : (p,), (e,) array
        Nodes: gauge pressure [Pa] and contraction ratio [1].
    force : (p, e) array
        Force at each [N], falling with contraction and rising with pressure.
    scatter : float
        Root mean square of what the rows differ from the table [N]; of branches whose direction is
        known, from a table of their own.
    between : float
        The same for each inner pressure level, predicted by the others [N]; NaN with fewer than
        three levels.
    half_width : float
        Root mean square of half the distance of both branches [N]: hysteresis, which is no error of
        the table but for a diagnosis to find; NaN where the directions are not known.
    share : float
        The larger of both over the root mean square of the forces [1]: the model error.
    rows : int
        Rows that were used.
    rest_length : float
        Length at zero contraction [m].
    issues : list of str
        What was found.
    """

    pressure: Array
    contraction: Array
    force: Array
    scatter: float
    between: float
    half_width: float
    share: float
    rows: int
    rest_length: float
    issues: list[str] = field(default_factory=list)

    def __repr__(self) -> str:
        return (
            f"MapFit({len(self.pressure)} x {len(self.contraction)} nodes, {self.rows} rows, error "
            f"{100 * self.share:.2g} %)"
        )

    def _panels(self) -> Panels:
        return {"force": self._draw}

    def _draw(self, axes: Any) -> None:
        """Force over contraction, a line for each pressure of the table."""
        for pressure, force in zip(self.pressure, self.force, strict=True):
            axes.plot(100.0 * self.contraction, force, lw=1.2, label=f"{pressure / 1e5:.3g} bar")
        axes.set_xlabel("contraction [%]")
        axes.set_ylabel("pulling force [N]")
        axes.legend(fontsize="small", frameon=False)

    def _numbers(self) -> dict[str, str]:
        return {
            "nodes": f"{len(self.pressure)} pressures x {len(self.contraction)} contractions",
            "rows": str(self.rows),
            "error": f"{100 * self.share:.3g} % of the force",
            "scatter": f"{self.scatter:.4g} N",
        }

    def predict(self, pressure: Any, contraction: Any = None, *, length: Any = None) -> Array:
        """Force [N], as a muscle with this table has it.

        Parameters
        ----------
        pressure : array_like
            Gauge pressure [Pa].
        contraction, length : array_like, optional
            Contraction ratio [1] or length [m], one of the two; broadcast against ``pressure``.

        Returns
        -------
        ndarray

        Raises
        ------
        ParameterError
            If not one of contraction and length is given, or a number is not finite.
        """
        asked = contraction_of(contraction, length, self.rest_length)
        gas, e = matched(pressure=pressure, contraction=asked)
        return _predict(self.pressure, self.contraction, self.force, gas, e)

    def to_muscle(self, muscle: Muscle) -> Muscle:
        """A muscle with this table.

        Parameters
        ----------
        muscle : Muscle
            Gives the geometry, which the volume follows from, the friction and the count.

        Returns
        -------
        Muscle
            With the model ``map``.

        Raises
        ------
        ParameterError
            If its rest length is another.
        """
        check_rest_length(muscle, self.rest_length)
        return muscle.replace(
            model="map",
            geometry=muscle.geometry,
            modulus_scale=1.0,
            map_pressure=self.pressure,
            map_contraction=self.contraction,
            map_force=self.force.ravel(),
        )

    def to_rig(self, muscle: Muscle, rig: Rig | None = None) -> Rig:
        """A rig with this table as its muscle's force, and the error of it as ``[model_error]``.

        Parameters
        ----------
        muscle : Muscle
            As for :meth:`to_muscle`.
        rig : Rig, optional
            The rig that it is a part of; by default a load frame.

        Returns
        -------
        Rig
        """
        own = self.to_muscle(muscle)
        if rig is None:
            rig = bench(own)
        base = rig.model
        count = own.parameters["count"] if base["muscle"] is None else base["muscle"]["count"]
        given = {**own.parameters, "count": count}
        table = {key.name: given[key.name] for key in keys_of("muscle", given)}
        error = {**(base.get("model_error") or {}), "muscle": {"share": min(self.share, 1.0)}}
        kept = {
            name: tol
            for name, tol in rig._tolerances.items()
            if not name.startswith("muscle.") or name.removeprefix("muscle.") in table
        }
        model = {**base, "muscle": table, "model_error": error}
        return replace(rig, _model=model, _tolerances=kept)

    def fit_report(self) -> str:
        """The result as text."""
        p, e = self.pressure / 1e3, 100.0 * self.contraction
        between = "not determinable, fewer than three levels"
        if not math.isnan(self.between):
            between = f"{self.between:.3g} N rms"
        branches = []
        if not math.isnan(self.half_width):
            width = f"{self.half_width:.3g} N rms"
            branches = [f"  each branch differs from it by {width}: hysteresis"]
        lines = [
            "force table of the muscle: monotone in pressure and contraction",
            f"  {len(p)} pressures from {p[0]:.4g} to {p[-1]:.4g} kPa, {len(e)} contractions from "
            f"{e[0]:.3g} to {e[-1]:.3g} %",
            f"  {self.rows} rows scatter by {self.scatter:.3g} N rms about it",
            f"  a pressure predicted by the others: {between}",
            *branches,
            f"  model error: {100.0 * self.share:.2g} % of the force",
        ]
        return "\n".join([*lines, *(f"  note: {issue}" for issue in self.issues)]) + "\n"

    def to_dict(self) -> dict[str, Any]:
        """The result as plain data, SI units; None where a number is not determinable."""
        found: dict[str, Any] = to_plain(vars(self))
        return found


def fit_map(data: ForceMap, *, nodes: int = _NODES) -> MapFit:
    """The table of forces of a muscle, from measurements alone.

    Parameters
    ----------
    data : ForceMap
        Forces at two pressures at least; both branches of a hysteresis are averaged. Where no
        column has the directions, the order of the rows may tell them
        (:meth:`ForceMap.with_directions`).
    nodes : int
        Contractions of the table, from 3 to 200.

    Returns
    -------
    MapFit

    Raises
    ------
    ParameterError
        If `nodes` is not possible.
    RecordingError
        If there are fewer than two pressures or fewer than three contractions.
    """
    if not 3 <= int(nodes) <= _MOST_NODES:
        raise refused("nodes", nodes, f"from 3 to {_MOST_NODES}")
    data = data.with_directions()
    gas, e, pull, _, way = data.used_rows()
    pressure = _levels(data)
    contraction = np.linspace(float(e.min()), float(e.max()), int(nodes))
    if len(pressure) < 2 or not contraction[-1] > contraction[0]:
        raise RecordingError(
            f"{data.label}: {len(pressure)} pressures from {100 * e.min():.3g} to "
            f"{100 * e.max():.3g} % contraction; a table needs two pressures at least, over a "
            "range of contraction"
        )
    groups = _branches(way)
    tables = [_table(pressure, contraction, gas[r], e[r], pull[r]) for r in groups]
    force = np.mean(tables, axis=0)  # a mean of monotone ones is one
    squares = [
        (pull[r] - _predict(pressure, contraction, own, gas[r], e[r])) ** 2
        for r, own in zip(groups, tables, strict=True)
    ]
    count = len(pull)  # what the nodes took is given back, as far as rows are more than nodes
    spare = count - min(len(groups) * force.size, count // 2)
    scatter = float(np.sqrt(np.sum(np.concatenate(squares)) / spare))
    left = [_left_out(pressure, contraction, gas[r], e[r], pull[r]) for r in groups]
    between = float(np.sqrt(np.mean(np.concatenate(left)))) if len(left[0]) else math.nan
    half_width = math.nan
    if len(groups) == 2:
        half_width = float(np.sqrt(np.mean((0.5 * (tables[1] - tables[0])) ** 2)))
    size = float(np.sqrt(np.mean(pull**2)))
    largest = max(scatter, 0.0 if math.isnan(between) else between)
    return MapFit(
        pressure=pressure,
        contraction=contraction,
        force=force,
        scatter=scatter,
        between=between,
        half_width=half_width,
        share=largest / size if size > 0.0 else 0.0,
        rows=len(pull),
        rest_length=data.rest_length,
        issues=[*data.issues, *_unmeasured(pressure, contraction, gas, e)],
    )


def _levels(data: ForceMap) -> Array:
    """Pressures of the table: the levels of the map, fewer where these are a ramp."""
    levels = np.asarray(data.levels, dtype=np.float64)
    if len(levels) <= _MOST_LEVELS:
        return levels
    return np.linspace(levels[0], levels[-1], _MOST_LEVELS)


def _predict(pressure: Array, contraction: Array, force: Array, gas: Array, e: Array) -> Array:
    found = force_table(pressure, contraction, force)
    flat = (np.ascontiguousarray(values.ravel()) for values in (gas, e))
    return found(*flat).reshape(gas.shape)


def _table(pressure: Array, contraction: Array, gas: Array, e: Array, pull: Array) -> Array:
    """Forces at the nodes, monotone along both axes."""
    from scipy.optimize import isotonic_regression
    from scipy.sparse import csr_array, eye_array, kron
    from scipy.sparse.linalg import spsolve

    rows = len(pull)
    i, x = _place(pressure, gas)
    j, y = _place(contraction, e)
    count = len(contraction)
    index = np.concatenate([(i + a) * count + j + b for a in (0, 1) for b in (0, 1)])
    weight = np.concatenate([wx * wy for wx in (1.0 - x, x) for wy in (1.0 - y, y)])
    size = len(pressure) * count
    design = csr_array((weight, (np.tile(np.arange(rows), 4), index)), shape=(rows, size))
    along_e = kron(eye_array(len(pressure)), _second(contraction))
    along_p = kron(_second(pressure), eye_array(count))
    stiff = _STIFF * rows / size
    normal = design.T @ design + stiff * (along_e.T @ along_e + along_p.T @ along_p)
    normal = normal + 1e-12 * stiff * eye_array(size)
    found = np.asarray(spsolve(normal.tocsc(), design.T @ pull)).reshape(len(pressure), count)
    seen = np.asarray(design.sum(axis=0)).reshape(found.shape)
    trust = np.maximum(seen.mean(axis=0), 1e-3 * seen.mean())
    falling = np.array([-isotonic_regression(-row, weights=trust).x for row in found])
    trust = np.maximum(seen.mean(axis=1), 1e-3 * seen.mean())
    return np.column_stack([isotonic_regression(row, weights=trust).x for row in falling.T])


def _place(axis: Array, values: Array) -> tuple[Index, Array]:
    """Interval of each value, and where in it."""
    cell = np.clip(np.searchsorted(axis, values, side="right") - 1, 0, len(axis) - 2)
    return cell, (values - axis[cell]) / (axis[cell + 1] - axis[cell])


def _second(axis: Array) -> Any:
    """Second differences on an axis that need not be even, in units of its mean interval."""
    from scipy.sparse import csr_array

    unit = axis / np.mean(np.diff(axis))
    lines = []
    for k in range(1, len(axis) - 1):
        before, after = unit[k] - unit[k - 1], unit[k + 1] - unit[k]
        line = np.zeros(len(axis))
        line[k - 1], line[k + 1] = 1.0 / before, 1.0 / after
        line[k] = -line[k - 1] - line[k + 1]
        lines.append(line)
    return csr_array(np.array(lines).reshape(len(lines), len(axis)))


def _branches(way: NDArray[np.int8]) -> list[Mask]:
    """Rows of either direction, where most have one; else all rows."""
    both = [way < 0, way > 0]
    if min(rows.sum() for rows in both) >= _SHARE * len(way):
        return both
    return [np.ones(len(way), dtype=bool)]


def _left_out(pressure: Array, contraction: Array, gas: Array, e: Array, pull: Array) -> Array:
    """Squares of what each inner pressure differs from the table of the others [N2]."""
    nearest = np.argmin(np.abs(gas[:, None] - pressure[None, :]), axis=1)
    squares: list[Array] = []
    for k in range(1, len(pressure) - 1):
        mine = nearest == k
        if not mine.any() or mine.all():
            continue
        left = np.delete(pressure, k)
        table = _table(left, contraction, gas[~mine], e[~mine], pull[~mine])
        squares.append((pull[mine] - _predict(left, contraction, table, gas[mine], e[mine])) ** 2)
    return np.concatenate(squares) if squares else np.empty(0)


def _unmeasured(pressure: Array, contraction: Array, gas: Array, e: Array) -> list[str]:
    """Remarks on parts of the table that only continue its neighbours."""
    found = []
    step = float(contraction[1] - contraction[0])
    nearest = np.argmin(np.abs(gas[:, None] - pressure[None, :]), axis=1)
    for k, level in enumerate(pressure.tolist()):
        mine = e[nearest == k]
        title = f"{level / 1e3:.4g} kPa"
        if not len(mine):
            found.append(f"{title}: no row, the table goes on from its neighbours")
            continue
        low, high = float(mine.min()), float(mine.max())
        if low > contraction[0] + step or high < contraction[-1] - step:
            found.append(
                f"{title}: rows from {100 * low:.3g} to {100 * high:.3g} % contraction; beyond, "
                "the table goes on from its neighbours"
            )
    if pressure[0] > 0.02 * pressure[-1]:
        found.append(
            f"no row below {pressure[0] / 1e3:.4g} kPa: there the force goes on along a straight "
            "line"
        )
    return found
