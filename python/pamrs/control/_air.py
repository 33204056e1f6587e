"""The way of the air, backwards: from a wanted change of pressure to the valve command that makes
it (4.13), (4.14).
"""

from __future__ import annotations

import bisect
import functools
import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Final, TypeAlias

import numpy as np

from pamrs import _core
from pamrs._arrays import Array
from pamrs.channels import dotted
from pamrs.control._groups import Group, check_single, groups_of
from pamrs.control._parts import FilteredDerivative, LowPass
from pamrs.control._protocol import Measurement, Value
from pamrs.control._sampled import Stateful
from pamrs.control._torque import _parts
from pamrs.control._values import Spline, as_value, clip, positive_gain
from pamrs.errors import ParameterError
from pamrs.rig import Rig

# pressure ratio above which the orifice law is a line (physics reference, section 3)
_LAMINAR: Final = 0.999
_WAYS: Final = ("fill", "vent")
_LEAST_FLOW: Final = 1e-12  # of the choked one: nothing flows, and any area is as good


class _PassageInverse:
    """Size of a passage that lets a mass flow through, from what a passage of one unit passes.

    Parameters
    ----------
    flows : callable
        Upstream pressure [Pa, absolute] and ratios of the downstream one to it -> mass flow per
        unit of the passage [kg/s].
    critical : float
        Ratio below which the flow is choked [1].
    """

    def __init__(self, flows: Callable[[float, Array], Array], critical: float) -> None:
        upstream = 1e5  # the law is in proportion to it

        def per_pressure(ratio: Array) -> Array:
            return flows(upstream, upstream * ratio) / upstream

        self.critical = critical
        self._choked = float(per_pressure(np.array([0.5 * self.critical]))[0])
        # in sqrt(1 - r) the law is smooth up to r = 1
        root = np.linspace(math.sqrt(1.0 - _LAMINAR), math.sqrt(1.0 - self.critical), 2049)
        ratio = 1.0 - root**2
        ratio[0], ratio[-1] = _LAMINAR, self.critical
        self._between = Spline(root[0], root[-1], per_pressure(ratio))
        self._slope = float(per_pressure(np.array([_LAMINAR]))[0]) / (1.0 - _LAMINAR)

    def flow(self, upstream: Value, downstream: Value) -> Value:
        """Mass flow of a passage of one unit [kg/s] between absolute pressures [Pa], zero for none
        or a reversed difference.
        """
        ratio = downstream / upstream
        if ratio.__class__ is float:
            if ratio <= self.critical:
                return upstream * self._choked
            if ratio <= _LAMINAR:
                return upstream * self._between(math.sqrt(1.0 - ratio))
            return upstream * (self._slope * (1.0 - ratio)) if ratio < 1.0 else 0.0
        ratio = np.asarray(ratio)
        gap = np.maximum(1.0 - ratio, 0.0)
        return upstream * np.where(
            ratio <= self.critical,
            self._choked,
            np.where(ratio <= _LAMINAR, self._between(np.sqrt(gap)), self._slope * gap),
        )

    def size(self, mass_flow: Value, upstream: Value, downstream: Value) -> Value:
        """Size of the passage for a mass flow [kg/s] >= 0; zero for no flow, very large where
        nothing can flow.
        """
        unit, least = self.flow(upstream, downstream), _LEAST_FLOW * self._choked * upstream
        if unit.__class__ is float and least.__class__ is float:
            return mass_flow / (unit if unit > least else least)
        return mass_flow / np.maximum(unit, least)


class OrificeInverse(_PassageInverse):
    """Area that lets a mass flow through, ``A_d = mdot_d/(pu f(pd/pu))``, with ``f`` tabulated from
    the core's orifice law; :meth:`flow` is per area [kg/(s m2)].

    Parameters
    ----------
    ambient_pressure, temperature, gas_constant, heat_capacity_ratio : float
        Of the gas: [Pa, absolute], [K], [J/(kg K)], [1].
    """

    def __init__(
        self,
        ambient_pressure: float,
        temperature: float,
        gas_constant: float,
        heat_capacity_ratio: float,
    ) -> None:
        core = _core.Gas(ambient_pressure, temperature, gas_constant, heat_capacity_ratio)
        gamma = heat_capacity_ratio
        super().__init__(
            lambda upstream, downstream: core.mass_flow(1.0, upstream, downstream),
            (2.0 / (gamma + 1.0)) ** (gamma / (gamma - 1.0)),
        )


class ConductanceInverse(_PassageInverse):
    """Sonic conductance ``C`` that lets a mass flow through at a critical ratio ``b`` (ISO
    6358-1:2013), tabulated from the core's law; :meth:`flow` is per conductance [kg Pa/m3].

    Parameters
    ----------
    critical_ratio : float
        ``b`` [1].
    ambient_pressure, temperature, gas_constant, heat_capacity_ratio : float
        As for :class:`OrificeInverse`.
    """

    def __init__(
        self,
        critical_ratio: float,
        ambient_pressure: float,
        temperature: float,
        gas_constant: float,
        heat_capacity_ratio: float,
    ) -> None:
        core = _core.Gas(ambient_pressure, temperature, gas_constant, heat_capacity_ratio)
        super().__init__(
            lambda upstream, downstream: core.conductance_flow(
                1.0, critical_ratio, upstream, downstream
            ),
            critical_ratio,
        )


#: The same for every chamber of a gas: a bundle has hundreds.
_orifice = functools.lru_cache(maxsize=16)(OrificeInverse)
_conductance = functools.lru_cache(maxsize=16)(ConductanceInverse)


class AirModel:
    """A chamber, its muscles and its valve as a controller knows them.

    Parameters
    ----------
    rig : Rig
    chamber : str, optional
        Name of a chamber that a valve feeds; the only one by default.

    Raises
    ------
    ParameterError
        If there is no such chamber, no valve feeds it or no supply the valve, the valve switches or
        fills nothing, or its area table is level somewhere but at its ends, so that it has no
        inverse.
    """

    def __init__(self, rig: Rig, chamber: str | None = None) -> None:
        group = _group(rig, chamber)
        valve = rig.tables("valve")[group.feed.name]
        table = rig.tables("chamber")[group.chamber]
        if valve["spool"] == "switching":
            raise ParameterError(
                "valve.spool = 'switching' is not allowed: a controller's model inverts a valve "
                "that opens by degrees"
            )
        gas: dict[str, float] = rig.model["gas"]
        self.ambient = float(gas["ambient_pressure"])
        supply = rig.tables("supply")[group.feed.supply or ""]
        self.supply_pressure = float(supply["initial_pressure"])
        # a chamber with an energy balance lies between the isothermal and the adiabatic: (3.17)
        usual = {"alpha_in": 1.4, "alpha_out": 1.0, "alpha": 1.2}
        self.alpha_in, self.alpha_out, self.alpha = (
            float(table.get(name, value)) for name, value in usual.items()
        )
        self._rt = float(gas["gas_constant"]) * float(gas["temperature"])
        volume = np.full(1025, float(table["dead_volume"]))
        for name in group.muscles:
            muscle, joint, turned = _parts(rig, name)
            low, high = float(turned["min_angle"]), float(turned["max_angle"])
            contraction = joint.shortening(np.linspace(low, high, 1025)) / float(
                muscle.parameters["rest_length"]
            )
            volume = volume + int(muscle.parameters["count"]) * muscle.air_volume(contraction)
        self.volume = Spline(low, high, volume)
        self._fill, self._vent = _paths(rig.name, dotted("valve", group.feed.name), valve, gas)
        self.null, self.half_range = float(valve["null_voltage"]), float(valve["half_range"])
        self._fraction, self._opening = _inverse(valve)

    def rate_per_volt(self) -> float:
        """Pressure rate per volt near the null [Pa/(s V)]: filling from the supply at half its
        pressure, in the middle of the joint's range.
        """
        slow, middle = 1e4, 0.5 * (self.volume.low + self.volume.high)
        volts = self.command(slow, 0.5 * self.supply_pressure, self.supply_pressure, middle, 0.0)
        return slow / float(volts)

    def opening(self, fraction: Value) -> Value:
        """Opening ``|x|`` [1] of a share of the widest area or conductance [1] >= 0: the area table
        backwards, 1 where it cannot be so large.
        """
        places, values = self._fraction, self._opening
        if fraction.__class__ is float:
            if fraction <= places[0]:
                return values[0] if fraction > 0.0 else 0.0
            if fraction >= places[-1]:
                return values[-1]
            cell = bisect.bisect_right(places, fraction) - 1
            slope = (values[cell + 1] - values[cell]) / (places[cell + 1] - places[cell])
            return slope * (fraction - places[cell]) + values[cell]
        p, v = np.array(places), np.array(values)
        k = np.clip(np.searchsorted(p, fraction, side="right") - 1, 0, p.size - 2)
        inside = (v[k + 1] - v[k]) / (p[k + 1] - p[k]) * (np.asarray(fraction) - p[k]) + v[k]
        return np.where(
            np.asarray(fraction) <= p[0],
            np.where(np.asarray(fraction) > 0.0, v[0], 0.0),
            np.where(fraction >= p[-1], v[-1], inside),
        )

    def command(
        self, pressure_rate: Value, pressure: Value, supply: Value, angle: Value, rate: Value
    ) -> Value:
        """Valve command less its null [V] that changes the pressure at a rate.

        ``mdot_d = (P_d' V + alpha P V')/(R T alpha_in)`` or ``alpha_out`` by its sign (4.13), the
        area (4.14), and the valve's table.

        Parameters
        ----------
        pressure_rate : float or ndarray
            ``P_d'`` [Pa/s].
        pressure, supply : float or ndarray
            Gauge pressures of muscle and supply [Pa].
        angle, rate : float or ndarray
            Of the joint [rad, rad/s].

        Returns
        -------
        float or ndarray
            From minus to plus the half range; 0 where the supply is below the muscle and air would
            be needed, and where a valve without a vent would have to let air out.
        """
        inside, feed = pressure + self.ambient, supply + self.ambient
        demand = pressure_rate * self.volume(angle) + self.alpha * inside * (
            self.volume.slope(angle) * rate
        )
        if demand.__class__ is float and feed.__class__ is float:
            if demand > 0.0:
                if feed <= inside:
                    return 0.0
                return self.half_range * self._opened(
                    self._fill, demand / (self._rt * self.alpha_in), feed, inside
                )
            if demand == 0.0:
                return 0.0
            return -self.half_range * self._opened(
                self._vent, -demand / (self._rt * self.alpha_out), inside, self.ambient
            )
        demand, feed, inside = np.broadcast_arrays(demand, feed, inside)
        filling = self._opened(
            self._fill, np.maximum(demand, 0.0) / (self._rt * self.alpha_in), feed, inside
        )
        venting = self._opened(
            self._vent, np.maximum(-demand, 0.0) / (self._rt * self.alpha_out), inside, self.ambient
        )
        return self.half_range * np.where(
            demand > 0.0, np.where(feed <= inside, 0.0, filling), -venting
        )

    def _opened(self, path: _Path, mass_flow: Value, upstream: Value, downstream: Value) -> Value:
        """Opening ``|x|`` [1] at which a path passes a mass flow; 0 of a path that is none."""
        inverse, widest = path
        if widest == 0.0:
            return 0.0 * mass_flow
        return self.opening(inverse.size(mass_flow, upstream, downstream) / widest)


#: What inverts a path of a valve, and its widest area [m2] or conductance [m3/(s Pa)].
_Path: TypeAlias = "tuple[_PassageInverse, float]"


def _paths(
    rig: str, block: str, valve: Mapping[str, Any], gas: Mapping[str, float]
) -> tuple[_Path, _Path]:
    """The paths by which a valve fills and vents."""
    air = tuple(
        float(gas[key])
        for key in ("ambient_pressure", "temperature", "gas_constant", "heat_capacity_ratio")
    )
    if valve["flow"] == "orifice":
        path = _orifice(*air), float(valve["discharge_area_max"])
        return path, path
    if not valve["fill_conductance"] > 0.0:
        raise ParameterError(
            f"rig {rig!r}: {block}.fill_conductance = {valve['fill_conductance']:g} m3/(s Pa), so "
            "that the valve fills nothing: a controller's model needs one that does"
        )
    inverses = [_conductance(float(valve[f"{way}_critical_ratio"]), *air) for way in _WAYS]
    fill, vent = (float(valve[f"{way}_conductance"]) for way in _WAYS)
    return (inverses[0], fill), (inverses[1], vent)


def _group(rig: Rig, chamber: str | None) -> Group:
    """The muscles of a chamber that a valve feeds from a supply."""
    groups = groups_of(rig)
    if chamber is None:
        needed = "needs exactly one, or the name of a chamber"
        check_single(rig, ("valve", "chamber", "supply"), needed)
    found = [group for group in groups if chamber in (None, group.chamber)]
    if not found:
        there = ", ".join(repr(group.chamber) for group in groups) or "none"
        raise ParameterError(
            f"chamber = {chamber!r}: rig {rig.name!r} has no such chamber with muscles; it has: "
            f"{there}"
        )
    if found[0].feed.input != "valve_command" or found[0].feed.supply is None:
        raise ParameterError(
            f"rig {rig.name!r}: no valve with a supply feeds chamber {found[0].chamber!r}, so that "
            "there is no flow to ask for"
        )
    return found[0]


def _inverse(valve: dict[str, Any]) -> tuple[list[float], list[float]]:
    """Area fractions that rise strictly, with their openings; level ends are left out."""
    opening, fraction = [float(x) for x in valve["opening"]], [float(x) for x in valve["fraction"]]
    first, last = 0, len(fraction) - 1
    while first < last and fraction[first + 1] == fraction[0]:
        first += 1
    while last > first and fraction[last - 1] == fraction[-1]:
        last -= 1
    opening, fraction = opening[first : last + 1], fraction[first : last + 1]
    if len(fraction) < 2 or any(b <= a for a, b in zip(fraction[:-1], fraction[1:], strict=True)):
        raise ParameterError(
            f"valve.area_fraction.fraction = {valve['fraction']} has no inverse: it must rise "
            "between its ends"
        )
    return fraction, opening


class FlowInverse(Stateful):
    """The feedforward's way of the air: ``P_d' = kM (P_d - P)``, and the valve command that makes
    it by the volume and its rate (4.13), (4.14).

    Parameters
    ----------
    air : AirModel
        Of the chamber.
    km : float or ndarray, shape (n,)
        ``kM`` [1/s].
    period : float
        Time between two updates [s].
    pressure_filter : float or ndarray, shape (n,)
        Time constant of the low-pass on the pressure [s].
    """

    _PARTS: ClassVar[tuple[str, ...]] = ("low_pass",)

    def __init__(
        self, air: AirModel, km: Value, *, period: float, pressure_filter: Value = 0.0
    ) -> None:
        self.air, self.km = air, as_value("km", km, lower=0.0)
        self.low_pass = LowPass(pressure_filter, period)

    def track(self, time: float, measurement: Measurement, desired: Value) -> Value:
        """Valve command [V] for a desired gauge pressure [Pa]."""
        pressure = self.low_pass.update(measurement["muscle_pressure"])
        offset = self.air.command(
            self.km * (desired - pressure),
            pressure,
            measurement["supply_pressure"],
            measurement["joint_angle"],
            measurement["joint_rate"],
        )
        return self.air.null + offset


class SetPoint(Stateful):
    """Set pressure of a regulator: the desired pressure plus its rate times a lead time.

    Parameters
    ----------
    pressure_limit : float
        Largest set pressure [Pa].
    period : float
        Time between two updates [s].
    lead : float or ndarray, shape (n,)
        How far ahead [s]; the regulator's time constant makes up for its lag, 0 for nothing.
    rate_filter : float or ndarray, shape (n,)
        Time constant of the low-pass on the rate [s].
    """

    _PARTS: ClassVar[tuple[str, ...]] = ("slope",)

    def __init__(
        self, pressure_limit: float, *, period: float, lead: Value = 0.0, rate_filter: Value = 0.02
    ) -> None:
        self.pressure_limit = float(positive_gain("pressure_limit", pressure_limit))
        self.lead = as_value("lead", lead, lower=0.0)
        self.slope = FilteredDerivative(rate_filter, period)

    def track(self, time: float, measurement: Measurement, desired: Value) -> Value:
        """Set pressure [Pa, gauge] for a desired one."""
        return clip(desired + self.lead * self.slope.update(desired), 0.0, self.pressure_limit)
