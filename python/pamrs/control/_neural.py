"""Adaptive neural-network control (dissertation 5.3.3, (5.16)-(5.25) corrected; Sanner & Slotine,
IEEE Trans. Neural Networks 3, 1992).

::

    P_d = H(theta) theta_r'' + C(theta) theta_r' + G(theta) - KD sgn(s)
    H, C, G = sum_k c_k phi(h theta - k), phi triangular
    c_k,H' = -gamma_H phi theta_r'' s_D
    c_k,C' = -gamma_C phi theta_r' s_D
    c_k,G' = -gamma_G phi s_D

Of several joints each has networks of its own angle: what the others do to it is left to the
switching term, and learnt as far as it goes with its own angle.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Final

import numpy as np

from pamrs._arrays import Array
from pamrs._checks import one_of, refused, whole
from pamrs._writing import write_atomically
from pamrs.control._adaptive import dead, held
from pamrs.control._model import JointModel
from pamrs.control._protocol import Measurement, Reference, Value
from pamrs.control._sampled import Fixed
from pamrs.control._sliding import SlidingController
from pamrs.control._values import as_value, clip, gains_of
from pamrs.errors import ParameterError

NETWORKS: Final = ("H", "C", "G")
"""The networks: of the reference acceleration [Pa s2/rad], of the reference rate [Pa s/rad], and of
gravity and elasticity [Pa]."""
_SCHEMA: Final = "pamrs.networks/1"


class Neural(SlidingController):
    """Adaptive neural-network control; answers a desired gauge pressure [Pa] for a
    :class:`pamrs.control.Cascade`.

    The nodes' triangles overlap so that at every angle of the range two are active and sum to one;
    beyond the range the last node holds.

    Parameters
    ----------
    arm : JointModel
        Gives range and pressure limit and, with ``start="model"``, the start: ``H = I/C1``,
        ``C = b/C1``, ``G = (m g r sin - C2)/C1`` (5.17)-(5.19).
    start : {"zero", "model"}
        What the networks know at first.
    nodes : int
        Of each network, evenly over the range.
    gains : sequence of three float or ndarray, shape (n,)
        ``gamma_H, gamma_C, gamma_G``, SI with radians [Pa ... per second].
    deadband : float or ndarray, shape (n,)
        Of s [rad/s]; 0.02 as printed for 5.3.2.
    bounds : sequence of three float, or None
        Largest absolute weight of each network; by default the pressure limit over 20 rad/s2, over
        50 rad/s, and itself. None: free.
    hold_at_limit : bool
        As for :class:`pamrs.control.AdaptiveSliding`.
    **others
        As for :class:`pamrs.control.SlidingController`, with defaults of its own: while the
        networks know nothing the switching term alone carries the arm, so that ``switching`` is 0.4
        MPa over a ``boundary_layer`` of 2 rad/s, ``slope`` 3 /s. With the 20 kPa over 0.2 rad/s
        that serve the other laws the start from zero oscillates on the simulated shoulder and
        learns nothing.

    Notes
    -----
    The gains are not printed. With the defaults and a large supply the start from zero learns the
    simulated shoulder (9 kg, waves between 28 and 82 deg) from 9 deg rms in the first 20 s to 0.3
    deg after 300 s, with or without bounds. A tank that runs empty is learnt as well: on the
    shoulder's own 15 l the error grows after some 220 s, and with wider bounds than the default
    bursts came after 80 s; long training needs a larger supply. The switching term suits an arm
    with its payload (I of 8 to 20 kg m2): with none, 0.6, it is too stiff for the pressure loop and
    the arm oscillates; it must fall with I.

    Raises
    ------
    ParameterError
        If a number is not finite or not allowed; the message names it.
    """

    _STATE: ClassVar[Mapping[str, Any]] = {"H": None, "C": None, "G": None}

    gains, deadband, bounds, nodes = Fixed(), Fixed(), Fixed(), Fixed()

    def __init__(
        self,
        arm: JointModel,
        *,
        start: str = "zero",
        nodes: int = 22,
        gains: tuple[Value, Value, Value] = (300.0, 2e4, 3e5),
        deadband: Value = 0.02,
        bounds: tuple[float, float, float] | str | None = "default",
        hold_at_limit: bool = True,
        **others: Any,
    ) -> None:
        one_of("start", start, ("zero", "model"))
        whole("nodes", nodes, 2, 10_000)
        self._gains = gains_of(NETWORKS, gains)
        self._deadband, self._nodes = as_value("deadband", deadband, lower=0.0), nodes
        self.hold_at_limit = bool(hold_at_limit)
        limit = arm.pressure_limit
        chosen = (limit / 20.0, limit / 50.0, limit) if bounds == "default" else bounds
        if chosen is not None and not (
            len(chosen) == 3 and all(isinstance(b, (int, float)) and b > 0.0 for b in chosen)
        ):
            raise refused("bounds", bounds, "'default', three numbers above zero or None")
        self._bounds: tuple[float, ...] | None = (
            None if chosen is None else tuple(float(b) for b in chosen)
        )
        self._single = arm.joints == 1
        self._first, last = arm.angle_range
        self._density = (nodes - 1) / (last - self._first)
        self._initial = (
            {name: [0.0] * nodes for name in NETWORKS}
            if start == "zero"
            else self._of_model(arm, last)
            if self._single
            else self._of_joints(arm, last)
        )
        defaults: dict[str, Any] = {"slope": 3.0, "switching": 4e5, "boundary_layer": 2.0}
        super().__init__(arm, gains=(*self._gains, self._deadband), **{**defaults, **others})
        self._given_batch = self._gain_batch
        self._rates = tuple(gain * self.period for gain in self._gains)
        self.reset()

    def _of_model(self, arm: JointModel, last: float) -> dict[str, list[float]]:
        if not all(isinstance(value, float) for value in arm.gains):
            raise ParameterError(
                "arm has arrays for estimates: networks start from one arm, whose numbers are "
                "floats"
            )
        angle, still = np.linspace(self._first, last, self._nodes), np.zeros(self._nodes)
        parameters = {parameter.name: parameter.value for parameter in arm.parameters}
        c1, c2 = (np.broadcast_to(value, angle.shape) for value in arm.torque.at(angle))
        started = {
            "H": parameters["inertia"] / c1,
            "C": parameters["viscous"] / c1,
            "G": (np.asarray(arm.inverse_dynamics(angle, still, still, still)) - c2) / c1,
        }
        return self._bounded(started)

    def _bounded(self, started: dict[str, Array]) -> dict[str, list[Any]]:
        if self._bounds is not None:
            started = {
                name: np.clip(w, -b, b)
                for (name, w), b in zip(started.items(), self._bounds, strict=True)
            }
        return {name: weights.tolist() for name, weights in started.items()}

    def _of_joints(self, arm: JointModel, last: Array) -> dict[str, list[Any]]:
        """Each joint over its nodes, the others in the middle of their range: (J, nodes)."""
        joints, nodes = arm.joints, self._nodes
        found = {name: np.empty((joints, nodes)) for name in NETWORKS}
        middle = np.repeat((0.5 * (self._first + last))[:, None], nodes, axis=1)
        for k in range(joints):
            angle, unit = middle.copy(), np.zeros((joints, nodes))
            angle[k], unit[k] = np.linspace(self._first[k], last[k], nodes), 1.0
            rows, still = angle.ravel(), np.zeros(angle.size)

            def own(torque: Value, k: int = k) -> Array:
                return np.asarray(np.reshape(torque, (joints, nodes))[k])

            c1, c2 = (own(value) for value in arm.torque.at(rows))
            held = own(arm.inverse_dynamics(rows, still, still, still))
            pushed = own(arm.inverse_dynamics(rows, still, still, unit.ravel()))
            turned = own(arm.inverse_dynamics(rows, still, unit.ravel(), still))
            found["H"][k], found["C"][k] = (pushed - held) / c1, (turned - held) / c1
            found["G"][k] = (held - c2) / c1
        return self._bounded(found)

    def _start(self) -> dict[str, Any]:
        # of several joints they become arrays with the first sample, which says of how many plants
        if self._single:
            return {name: list(weights) for name, weights in self._initial.items()}
        return dict.fromkeys(NETWORKS)

    def _row_shape(self, name: str, start: Any) -> tuple[int, ...]:
        return (self._nodes,)

    @property
    def angles(self) -> Array:
        """Angles of the nodes [rad], shape (nodes,); of several joints (J, nodes)."""
        return np.asarray(
            np.linspace(self._first, np.asarray(self.arm.angle_range[1]), self._nodes).T
        )

    @property
    def weights(self) -> dict[str, Array]:
        """Weights of the networks: name -> shape (nodes,), of a batch (n, nodes); of several joints
        (J, nodes) before the first sample, (J n, nodes) from then on.
        """
        now = {name: getattr(self, f"_{name}") for name in NETWORKS}
        return {n: np.array(self._initial[n] if w is None else w) for n, w in now.items()}

    def basis(self, angle: Value) -> Array:
        """``phi`` of every node [1] at angles [rad], shape (nodes,) or (n, nodes)."""
        first, density = self._nodes_of(np.size(angle))
        place = np.clip((np.asarray(angle) - first) * density, 0.0, self._nodes - 1.0)
        return np.asarray(np.maximum(1.0 - np.abs(place[..., None] - np.arange(self._nodes)), 0.0))

    def _nodes_of(self, rows: int) -> tuple[Any, Any]:
        """First node [rad] and nodes per radian of every row."""
        if self._single:
            return self._first, self._density
        plants = rows // self.arm.joints
        return np.repeat(self._first, plants), np.repeat(self._density, plants)

    def update(self, time: float, measurement: Measurement, reference: Reference) -> Value:
        """Desired gauge pressure [Pa] for a sample, within the arm's limits; see
        :meth:`pamrs.control.Controller.update`.
        """
        surface: tuple[Any, ...] = self._surface(time, measurement, reference)
        if self._batch is not None:
            return self._of_batch(*(np.broadcast_to(value, self._batch) for value in surface))
        angle, _, rate, acceleration, s, switching = surface
        lowest, highest = self.arm.limits(angle)
        h, c, g = self._H, self._C, self._G
        place, top = (angle - self._first) * self._density, self._nodes - 1.0
        place = 0.0 if place < 0.0 else top if place > top else place
        k = int(place)
        if k > self._nodes - 2:
            k = self._nodes - 2
        after = place - k
        before = 1.0 - after
        j = k + 1
        wanted = (
            (before * h[k] + after * h[j]) * acceleration
            + (before * c[k] + after * c[j]) * rate
            + (before * g[k] + after * g[j])
            - switching
        )
        pressure = clip(wanted, lowest, highest)
        error: Any = dead(s, self._deadband)
        if self.hold_at_limit:
            error = held(error, wanted - pressure)
        if error != 0.0:
            for network, gain, factor, bound in zip(
                (h, c, g), self._rates, (acceleration, rate, 1.0), self._tops, strict=True
            ):
                step = gain * factor * error
                low, high = network[k] - step * before, network[j] - step * after
                network[k] = -bound if low < -bound else bound if low > bound else low
                network[j] = -bound if high < -bound else bound if high > bound else high
        return pressure

    _H: Any  # lists of one plant, an array (n, nodes) of a batch
    _C: Any
    _G: Any

    @property
    def _span(self) -> list[Any]:
        """Range of the nodes as a file has it."""
        return [np.asarray(end).tolist() for end in self.arm.angle_range]

    @property
    def _tops(self) -> tuple[float, ...]:
        return (math.inf, math.inf, math.inf) if self._bounds is None else self._bounds

    def _rows_of(self, name: str, n: int) -> Array:
        """Weights of a network, a row for each plant and joint, to be changed."""
        kept = getattr(self, f"_{name}")
        weights = np.asarray(self._initial[name] if kept is None else kept, dtype=np.float64)
        if weights.ndim == 1:
            return np.tile(weights, (n, 1))
        if len(weights) < n:  # one for each joint
            return np.repeat(weights, n // len(weights), axis=0)
        # a refused sample leaves what was there, which a start of None does not copy
        return weights if self._single else weights.copy()

    def _of_batch(
        self,
        angle: Array,
        motion: Array,
        rate: Array,
        acceleration: Array,
        s: Array,
        switching: Array,
    ) -> Array:
        """Desired pressure [Pa] of a batch, each plant with its own weights, which are adapted."""
        n = s.size
        networks = [self._rows_of(name, n) for name in NETWORKS]
        for name, weights in zip(NETWORKS, networks, strict=True):
            setattr(self, f"_{name}", weights)
        first, density = self._nodes_of(n)
        place = np.minimum(np.maximum((angle - first) * density, 0.0), self._nodes - 1.0)
        k = np.minimum(place.astype(np.intp), self._nodes - 2)
        after = place - k
        before = 1.0 - after
        j, row = k + 1, np.arange(n)
        h, c, g = (before * w[row, k] + after * w[row, j] for w in networks)
        wanted = h * acceleration + c * rate + g - switching
        pressure = np.asarray(clip(wanted, *self.arm.limits(angle)))
        error = dead(s, self._rows(self._deadband, s))
        if self.hold_at_limit:
            error = held(error, wanted - pressure)
        factors: tuple[Any, ...] = (acceleration, rate, 1.0)
        for weights, gain, factor, bound in zip(
            networks, self._rates, factors, self._tops, strict=True
        ):
            step = self._rows(gain, s) * factor * error
            weights[row, k] = np.minimum(np.maximum(weights[row, k] - step * before, -bound), bound)
            weights[row, j] = np.minimum(np.maximum(weights[row, j] - step * after, -bound), bound)
        return pressure

    # ------------------------------------------------------------------ kept

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the weights to a JSON file, whole or not at all; :meth:`load` gives the same
        numbers to the last bit.

        Parameters
        ----------
        path : path-like
            The file.

        Returns
        -------
        Path
            The file written.
        """
        content = {
            "schema": _SCHEMA,
            "angle_range": self._span,
            "nodes": self._nodes,
        }
        weights = {name: array.tolist() for name, array in self.weights.items()}
        return write_atomically(path, json.dumps({**content, "weights": weights}) + "\n")

    def load(self, path: str | os.PathLike[str]) -> None:
        """Start from weights of a file, now and after every :meth:`reset`.

        Parameters
        ----------
        path : path-like
            Written by :meth:`save` of a controller with the same nodes over the same range. Weights
            of a batch make this a controller of such a batch, as gains in arrays do.

        Raises
        ------
        ParameterError
            If the file is not of that kind, or of other nodes; the message says which. Nothing is
            changed then.
        """
        try:
            content = json.loads(Path(path).read_text(encoding="utf-8"))
            if content["schema"] != _SCHEMA:
                raise ParameterError(
                    f"{path}: schema is {content['schema']!r}; {_SCHEMA!r} is needed"
                )
            nodes, span = content["nodes"], content["angle_range"]
            weights = {
                name: np.asarray(content["weights"][name], dtype=np.float64) for name in NETWORKS
            }
        except ParameterError:
            raise
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise ParameterError(f"{path}: no networks of pamrs ({error})") from error
        if nodes != self._nodes or span != self._span:
            own = f"{self._nodes} nodes over {self._span} rad"
            raise ParameterError(
                f"{path}: {nodes} nodes over {span} rad; this controller has {own}"
            )
        shapes = {array.shape for array in weights.values()}
        if len(shapes) != 1 or (shape := shapes.pop())[-1:] != (nodes,) or len(shape) > 2:
            raise ParameterError(
                f"{path}: weights of the shapes {sorted(shapes)} for {nodes} nodes"
            )
        plants = shape[0] if len(shape) == 2 else None
        for size in (self._given_batch, self._batch):
            if plants is not None and size not in (None, plants):
                raise ParameterError(
                    f"{path}: weights of {plants} plants; this controller is one of a batch of "
                    f"{size}"
                )
        self._gain_batch = self._given_batch if plants is None else plants
        self._batch = self._size = self._batch if plants is None else plants
        if not all(np.all(np.isfinite(array)) for array in weights.values()):
            raise ParameterError(f"{path}: a weight is not finite")
        self._initial = {name: array.tolist() for name, array in weights.items()}
        for name, value in self._start().items():
            setattr(self, f"_{name}", value)
