"""Equations of the pair: two sides of the independent plant on one tank and one arm."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from scipy.optimize import brentq

from ..effects import Effects
from ..plant import Parameters, Plant
from ..rates import half_of, motion_of
from ..rigfile import to_parameters
from ..solver import Solver, State
from .places import SIDES, Placed

#: states that every pair has: pressures of flexor, extensor and tank, angle, rate, time
OWN = 6


@dataclass(frozen=True)
class PairParameters:
    """Numbers of a pair without effects; each side as a plant whose angle [rad] counts the way in
    which its muscles pull: that of the arm, or its negative. What the sides share stands in both.

    `initial` are the gauge pressures [Pa] with which recordings begin.
    """

    flexor: Parameters
    extensor: Parameters
    signs: tuple[float, float]
    initial: tuple[float, float]

    def of(self, side: str) -> Parameters:
        """The numbers of a side; the shared ones with an empty name."""
        return self.extensor if side == SIDES[1] else self.flexor

    @property
    def ambient(self) -> float:
        """Ambient pressure [Pa]."""
        return self.flexor.ambient

    @property
    def supply_pressure(self) -> float:
        """Pressure with which the tank begins [gauge Pa]."""
        return self.flexor.supply_pressure

    @property
    def payload(self) -> float:
        """Payload [kg]."""
        return self.flexor.payload

    @property
    def coulomb(self) -> float:
        """Dry friction of the joint [N m]."""
        return self.flexor.coulomb

    @property
    def weight(self) -> float:
        """Largest torque of the weight [N m]."""
        return self.flexor.weight


def pair_parameters(model: dict[str, Any]) -> PairParameters:
    """Numbers of a pair from a nested SI model as :func:`trial.rigfile.read_rig` gives it."""
    signs = [math.copysign(1.0, model[f"transmission.{side}"]["radius"]) for side in SIDES]
    flexor, extensor = (
        to_parameters(_alone(model, side, sign)) for side, sign in zip(SIDES, signs, strict=True)
    )
    first, second = (float(model[f"chamber.{side}"]["initial_pressure"]) for side in SIDES)
    return PairParameters(flexor, extensor, (signs[0], signs[1]), (first, second))


def _alone(model: dict[str, Any], side: str, sign: float) -> dict[str, Any]:
    """The model of one side."""
    pull, (joint,) = (
        model[f"transmission.{side}"],
        [table for name, table in model.items() if name.startswith("joint.")],
    )
    (angle,) = (t["angle_zero"] for t in model.values() if "angle_zero" in t)
    return {
        "gas": model["gas"],
        "supply": model["supply"],
        "valve": model[f"valve.{side}"],
        "chamber": model[f"chamber.{side}"],
        "muscle": model[f"muscle.{side}"],
        "joint": {
            **joint,
            "kind": "pulley",
            "radius": sign * pull["radius"],
            "rest_angle": sign * pull["rest_angle"],
        },
        "arm": model["arm"],
        "sensors": {
            "pressure_zero": model[f"sensors.{side}"]["pressure_zero"],
            "angle_zero": angle,
        },
    }


class PairPlant(Solver):
    """Pair with a set of effects.

    The state is ``[p_flexor, p_extensor, p_supply, angle, rate, time, ...]`` in absolute Pa, rad,
    rad/s and s, followed by the states of the effects on what the sides share, at the flexor and at
    the extensor.

    Parameters
    ----------
    parameters : PairParameters
        Baseline numbers.
    effects : sequence of Placed
        What the pair has besides, and where.

    Raises
    ------
    ValueError
        Two effects that cannot be in one plant.
    """

    def __init__(self, parameters: PairParameters, effects: Sequence[Placed] = ()) -> None:
        self.par = parameters
        self.effects = tuple(effects)
        shared = Plant(parameters.flexor, Effects(*(e.effect for e in effects if not e.at)))
        sides = [
            Plant(parameters.of(side), Effects(*(e.effect for e in effects if side in e.sides)))
            for side in SIDES
        ]
        self.shared, self.flexor, self.extensor = shared, sides[0], sides[1]
        self.plants = (shared, *sides)
        self.scale = [1.0e5, 1.0e5, 1.0e6, 1.0, 1.0, 1.0e9]
        self.parts: list[tuple[int, int]] = []
        for plant in self.plants:
            own = plant.scale[5 if plant.i_clock >= 0 else 4 :]
            self.parts.append((len(self.scale), len(self.scale) + len(own)))
            self.scale += own
        clocks = [OWN - 1 if plant.i_clock >= 0 else OWN for plant in self.plants]
        cuts = [(clock, *part) for clock, part in zip(clocks, self.parts, strict=True)]
        self._cuts = (cuts[0], cuts[1], cuts[2])
        self.size = len(self.scale)
        self._rhs = self._rates()

    def own(self, y: State) -> tuple[State, State, State]:
        """The state as what the sides share sees it (with the flexor's pressure), the flexor and
        the extensor: ``[p, p_supply, angle, rate, ...]`` of a :class:`trial.plant.Plant`.
        """
        pf, pe, ps, angle, rate, _ = y[:OWN]
        first, second = self.par.signs
        (a, b, c), (d, e, f), (g, h, i) = self._cuts
        # the time is taken along where an effect asks for it: an empty slice elsewhere
        return (
            [pf, ps, angle, rate, *y[a:OWN], *y[b:c]],
            [pf, ps, first * angle, first * rate, *y[d:OWN], *y[e:f]],
            [pe, ps, second * angle, second * rate, *y[g:OWN], *y[h:i]],
        )

    def _rates(self) -> Callable[[State, tuple[float, float]], State]:
        """Time derivative of the state at the signed openings of both valves."""
        shared, flexor, extensor = self.plants
        pull, back, motion = half_of(flexor), half_of(extensor), motion_of(shared)
        tanks, follows = shared.ports("tank"), shared.ports("follow")
        first, second = self.par.signs
        common = self.par.flexor
        ambient = common.ambient
        fill = common.supply_volume / (common.gas_constant * common.temperature)
        sizes = [plant.size for plant in self.plants]
        heads = [5 if plant.i_clock >= 0 else 4 for plant in self.plants]

        def rates(y: State, x: tuple[float, float]) -> State:
            ys, yf, ye = self.own(y)
            ds, df, de = [0.0] * sizes[0], [0.0] * sizes[1], [0.0] * sizes[2]
            torque = first * pull(yf, x[0], df) + second * back(ye, x[1], de)
            supply = df[1] + de[1]
            taken = -supply * fill
            for tank in tanks:
                supply += tank(y[2], taken, ys, ds)
            for follow in follows:
                follow(y[0], ys, ds)
            motion(ys, 0.5 * (y[0] + y[1]) - ambient, torque, ds)
            return [
                df[0],
                de[0],
                supply,
                ds[2],
                ds[3],
                1.0,
                *ds[heads[0] :],
                *df[heads[1] :],
                *de[heads[2] :],
            ]

        return rates

    def initial(
        self, pressures: tuple[float, float], supply: float, angle: float, rate: float, clock: float
    ) -> State:
        """State at absolute pressures [Pa], an angle [rad], its rate and a time [s] with every
        memory at rest.
        """
        y = [*pressures, supply, angle, rate, clock]
        first, second = self.par.signs
        for plant, p, sign in zip(
            self.plants, (pressures[0], *pressures), (1.0, first, second), strict=True
        ):
            local = plant.initial(p, supply, sign * angle, sign * rate, clock)
            y.extend(local[5 if plant.i_clock >= 0 else 4 :])
        return y

    def torques(self, angle: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """Torque of flexor and extensor on the arm at an angle [rad], each as a slope over its
        gauge pressure [m3] and what is there without pressure [N m].
        """
        found = []
        for plant, sign in zip(self.plants[1:], self.par.signs, strict=True):
            values = plant.tables.at(sign * angle)
            found.append((sign * float(values[0]), sign * float(values[1])))
        return found[0], found[1]

    def rest(self, supply: float, clock: float = 0.0) -> State:
        """Arm at rest between the initial pressures of the chambers."""
        par, joint = self.par, self.par.flexor.joint
        low, high, stiff = joint["min_angle"], joint["max_angle"], joint["stop_stiffness"]

        def torque(angle: float) -> float:
            stop = stiff * (max(low - angle, 0.0) - max(angle - high, 0.0))
            sides = zip(self.torques(angle), par.initial, strict=True)
            pulls = sum(slope * p + springy for (slope, springy), p in sides)
            return pulls - par.weight * math.sin(angle) + stop

        edge = math.radians(4.0)
        angle = float(brentq(torque, low - edge, high + edge, xtol=1e-12))
        first, second = (p + par.ambient for p in par.initial)
        return self.initial((first, second), supply, angle, 0.0, clock)

    def holding(self, angle: float, level: float) -> tuple[float, float]:
        """Gauge pressures [Pa] of flexor and extensor with a mean `level` that hold the arm."""
        (gf, ef), (ge, ee) = self.torques(angle)
        load = self.par.weight * math.sin(angle) - ef - ee - level * (gf + ge)
        half = load / (gf - ge)
        return level + half, level - half

    def normalised(self, commands: tuple[float, float]) -> tuple[float, float]:
        """Commands [V] of both valves as parts of half their strokes, -1..1."""
        return self.flexor.normalised(commands[0]), self.extensor.normalised(commands[1])

    def derivative(self, state: Sequence[float], opening: tuple[float, float]) -> State:
        """Time derivative of the state at signed openings of both valves (before their lags)."""
        return self._rhs(list(state), opening)

    def tick(self, y: State) -> State:
        """State after what effects do once per sample (relays, largest values, play)."""
        if not any(plant.ticks for plant in self.plants):
            return y
        y = list(y)
        for plant, (low, high), local in zip(self.plants, self.parts, self.own(y), strict=True):
            y[low:high] = plant.tick(local)[5 if plant.i_clock >= 0 else 4 :]
        return y

    def reading(
        self, y: State, opening: tuple[float, float] = (0.0, 0.0)
    ) -> tuple[float, float, float, float]:
        """Noise-free transducer values: pressures of flexor, extensor and tank [gauge Pa], joint
        angle [rad]; openings as those of :meth:`trial.plant.Plant.reading`.
        """
        ys, yf, ye = self.own(y)
        _, supply, angle = self.shared.reading(ys)
        flexor = self.flexor.reading(yf, opening[0])[0]
        return flexor, self.extensor.reading(ye, opening[1])[0], supply, angle
