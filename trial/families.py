"""Which forms of which families the plans conceal, and how each is marked.

`known`: a form that the catalogue is to have; `other`: one of the same family that it is never to
have, so that leaving forms out is measured; `unlisted`: a family of no catalogue.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from . import forms as more
from . import later
from .effects import TYPES, Effect, Setting
from .effects.base import REFERENCE_DENSITY, uniform
from .pair.places import Placed
from .plant import Parameters

KNOWN, OTHER, UNLISTED = "known", "other", "unlisted"
MARKS = (KNOWN, OTHER, UNLISTED)
Draw = Callable[[np.random.Generator, Setting], Effect]
Truths = Callable[[Any, Parameters], dict[str, float]]


@dataclass(frozen=True)
class Form:
    """One equation of a family. `first`: the catalogue of the first design has it (or one as near
    as a smooth corner). `truths` gives the parameters that the catalogue names the same way, SI.
    """

    family: str
    name: str
    mark: str
    draw: Draw
    first: bool = False
    truths: Truths | None = None

    @property
    def block(self) -> str:
        """Block of the plant in which it acts."""
        return (TYPES.get(self.family) or later.TYPES[self.family]).block

    @property
    def label(self) -> str:
        """Family and form."""
        return f"{self.family}/{self.name}"


def _plain(family: str, **fixed: Any) -> Draw:
    """A form of the first plans, with some of its fields fixed."""

    def draw(rng: np.random.Generator, setting: Setting) -> Effect:
        return replace(TYPES[family].draw(rng, setting), **fixed)

    return draw


def _own(kind: type[Effect]) -> Draw:
    return lambda rng, setting: kind.draw(rng, setting)


def _of_form(effect: str, form: str) -> Draw:
    """An effect of the first plans in one of its forms, about as large as there."""

    def draw(rng: np.random.Generator, setting: Setting) -> Effect:
        while True:
            drawn: Any = TYPES[effect].draw(rng, setting)
            if drawn.form == form:
                return drawn  # type: ignore[no-any-return]

    return draw


def _creep(count: int) -> Draw:
    """One branch, or two a decade apart."""

    def draw(rng: np.random.Generator, setting: Setting) -> Effect:
        quick = uniform(rng, 1.5, 6.0)
        steps = tuple(quick * 10.0**i for i in range(count))
        return _plain("muscle_creep", power=0.0, time_constant=steps)(rng, setting)

    return draw


def _logarithmic(rng: np.random.Generator, setting: Setting) -> Effect:
    """Creep that goes with the logarithm of time: equal branches over four decades."""
    steps = tuple((np.geomspace(0.02, 200.0, 7) * uniform(rng, 0.7, 1.4)).tolist())
    return _plain("muscle_creep", power=0.0, time_constant=steps)(rng, setting)


def _equal_overlap(rng: np.random.Generator, setting: Setting) -> Effect:
    width = uniform(rng, 0.02, 0.04)
    return _plain("valve_dead_zone", supply_width=width, exhaust_width=width, rounding=0.0)(
        rng, setting
    )


def _rubbing(rng: np.random.Generator, setting: Setting) -> Effect:
    return _plain("pam_crowding_contact", rubbing=uniform(rng, 0.2, 0.4))(rng, setting)


def _jet(rng: np.random.Generator, setting: Setting) -> Effect:
    return _plain("heat_transfer", jet=uniform(rng, 0.6, 1.5))(rng, setting)


def _wind(rng: np.random.Generator, setting: Setting) -> Effect:
    return more.Waves.of(rng, 14)


def _post(rng: np.random.Generator, setting: Setting) -> Effect:
    return _plain("base_flexibility", hardening=uniform(rng, 150.0, 400.0))(rng, setting)


_KNOWN: tuple[Form, ...] = (
    Form("supply_leak", "orifice", KNOWN, _own(more.OrificeTankLeak), True,
         lambda e, p: {"conductance": e.conductance}),
    Form("supply_leak", "laminar", KNOWN, _plain("supply_leak", form="laminar")),
    Form("compressor_cut_in", "relay", KNOWN,
         _plain("compressor_cut_in", clearance=0.0, rise=0.02, pulsation=0.0), True,
         lambda e, p: {"free_air_delivery": e.delivery / REFERENCE_DENSITY,
                       "cut_in_pressure": e.on - p.ambient, "cut_out_pressure": e.off - p.ambient}),
    Form("valve_dead_zone", "equal_sharp", KNOWN, _equal_overlap, True,
         lambda e, p: {"half_width": e.supply_width}),
    Form("valve_dead_zone", "two_widths", KNOWN, _plain("valve_dead_zone", rounding=0.0)),
    Form("valve_hysteresis", "play", KNOWN, _own(more.Play), True,
         lambda e, p: {"half_width": e.half_width}),
    Form("valve_centre_leakage", "exponential", KNOWN, _own(more.FadingLeakage), True,
         lambda e, p: {"conductance": e.conductance, "opening": e.reach}),
    Form("valve_area", "two_areas", KNOWN, _own(more.TwoOpenings)),
    Form("valve_area", "bend", KNOWN, _own(more.BentOpening)),
    Form("input_path_lag", "dead_time", KNOWN, _plain("input_path_lag", lag=0.0), True,
         lambda e, p: {"delay": e.pure}),
    Form("input_path_lag", "delay_slew", KNOWN, _plain("input_path_lag")),
    Form("tube_flow_restriction", "pipe", KNOWN, _plain("tube_flow_restriction")),
    Form("leak_muscle", "orifice", KNOWN, _of_form("leak_muscle", "orifice"), True,
         lambda e, p: {"conductance": e.coefficient}),
    Form("leak_muscle", "laminar", KNOWN, _of_form("leak_muscle", "laminar"), True),
    Form("leak_muscle", "growing_area", KNOWN, _of_form("leak_muscle", "crack")),
    Form("leak_muscle", "free_exponent", KNOWN, _own(more.CrackLeak)),
    Form("heat_transfer", "by_pressure", KNOWN, _plain("heat_transfer", jet=0.0), True,
         lambda e, p: {"heat_transfer_coefficient": e.coefficient, "share": e.share}),
    Form("muscle_hysteresis", "spread_slip", KNOWN,
         _of_form("muscle_hysteresis", "dahl_bank"), True),
    Form("muscle_creep", "one_branch", KNOWN, _creep(1), True,
         lambda e, p: {"stiffness": e.stiffness / p.count, "time_constant": e.time_constant[0]}),
    Form("muscle_creep", "two_branches", KNOWN, _creep(2)),
    Form("muscle_creep", "force", KNOWN, _own(more.ForceRelaxation)),
    Form("muscle_rate_damping", "viscous", KNOWN, _own(more.Viscous), True,
         lambda e, p: {"damping_constant": e.constant / p.count,
                       "damping_pressure": e.slope / p.count,
                       "lengthening_share": e.lengthening}),
    Form("activation_pressure", "dead_band", KNOWN, _own(more.DeadBand), True,
         lambda e, p: {"threshold": e.threshold}),
    Form("activation_pressure", "saturating", KNOWN, _plain("activation_pressure")),
    Form("mullins_softening", "by_contraction", KNOWN, _plain("mullins_softening"), True),
    Form("pam_crowding_contact", "hertz", KNOWN, _plain("pam_crowding_contact", rubbing=0.0), True,
         lambda e, p: {"onset_contraction": e.onset / p.muscle["rest_length"]}),
    Form("joint_coulomb_stribeck", "rational", KNOWN, _plain("joint_coulomb_stribeck")),
    Form("joint_end_stop", "progressive", KNOWN, _plain("joint_end_stop", loss=0.0), True,
         lambda e, p: {"angle": e.angle}),
    Form("payload_swing", "pendulum", KNOWN, _plain("payload_swing", drag=0.0), True,
         lambda e, p: {"swinging_share": e.share, "length": e.length}),
    Form("payload_change", "ramp", KNOWN, _plain("payload_change"), True,
         lambda e, p: {"mass_change": e.mass[0]}),
    Form("external_torque", "pushes", KNOWN, _plain("external_torque"), True),
    Form("external_torque", "vibration", KNOWN, _own(more.Waves)),
    Form("base_flexibility", "linear", KNOWN, _plain("base_flexibility", hardening=0.0), True,
         lambda e, p: {"compliance": e.compliance, "damping_ratio": e.damping}),
    Form("pressure_lag", "first_order", KNOWN, _own(more.FirstOrderReading), True,
         lambda e, p: {"time_constant": e.lag}),
    Form("encoder_error", "first_and_second", KNOWN, _plain("encoder_error", fourth=0.0)),
    Form("clock_skew", "offset_rate", KNOWN, _plain("clock_skew"), True,
         lambda e, p: {"offset": e.offset, "rate": e.skew}),
)  # fmt: skip
_OTHER: tuple[Form, ...] = (
    Form("supply_leak", "slit", OTHER, _plain("supply_leak", form="slit")),
    Form("compressor_cut_in", "pulsating", OTHER, _plain("compressor_cut_in")),
    Form("valve_dead_zone", "rounded", OTHER, _plain("valve_dead_zone")),
    Form("valve_hysteresis", "dahl", OTHER, _plain("valve_hysteresis")),
    Form("valve_area", "knee", OTHER, _plain("valve_area")),
    Form("valve_centre_leakage", "lengthening", OTHER, _plain("valve_centre_leakage")),
    Form("input_path_lag", "jitter", OTHER, _own(more.JitterDelay)),
    Form("tube_flow_restriction", "elastic_hose", OTHER, _own(more.ElasticHose)),
    Form("leak_muscle", "seal", OTHER, _own(more.SealLeak)),
    Form("heat_transfer", "jet", OTHER, _jet),
    Form("muscle_hysteresis", "bouc_wen", OTHER, _of_form("muscle_hysteresis", "bouc_wen")),
    Form("muscle_hysteresis", "lugre", OTHER, _own(more.LuGre)),
    Form("muscle_hysteresis", "one_way", OTHER, _own(more.OneWay)),
    Form("muscle_creep", "power_law", OTHER, _plain("muscle_creep")),
    Form("muscle_creep", "logarithmic", OTHER, _logarithmic),
    Form("muscle_rate_damping", "shear_thinning", OTHER, _plain("muscle_rate_damping")),
    Form("activation_pressure", "exponential", OTHER, _own(more.ExponentialOnset)),
    Form("mullins_softening", "by_pressure", OTHER, _own(more.PressureSoftening)),
    Form("pam_crowding_contact", "rubbing", OTHER, _rubbing),
    Form("joint_coulomb_stribeck", "by_angle", OTHER, _own(more.AngleFriction)),
    Form("joint_end_stop", "rubber", OTHER, _plain("joint_end_stop", loss=0.4)),
    Form("payload_swing", "air_drag", OTHER, _plain("payload_swing", drag=0.3)),
    Form("payload_change", "sliding", OTHER, _own(more.SlidingMass)),
    Form("external_torque", "wind", OTHER, _wind),
    Form("base_flexibility", "hardening", OTHER, _post),
    Form("pressure_lag", "snubber", OTHER, _plain("pressure_lag")),
    Form("encoder_error", "fourth", OTHER, _plain("encoder_error")),
    Form("clock_skew", "jitter", OTHER, _own(more.ClockJitter)),
)  # fmt: skip
#: families of no catalogue; gear lash and drifts of the first plans are left out,
#: since a catalogue is to have them
_NO_CATALOGUE = (
    "tendon_compliance",
    "muscle_buckling",
    "hose_torque",
    "supply_gas_cooling",
    "exhaust_back_pressure",
    "moment_arm_error",
)
#: families and forms of the plans after the second, whose cases stay the same
LATER: tuple[Form, ...] = (
    Form("com_offset", "moment", KNOWN, _own(later.OffsetMass), False,
         lambda e, p: {"angle": e.angle}),
    Form("com_offset", "sagging", OTHER, _own(later.SaggingMass)),
    Form("com_offset", "liquid", OTHER, _own(later.LiquidMass)),
    Form("sensor_lag", "delay", KNOWN, _own(later.LateAngle), False,
         lambda e, p: {"delay": e.late}),
    Form("sensor_lag", "first_order", OTHER, _own(later.FilteredAngle)),
    Form("sensor_lag", "jitter", OTHER, _own(later.JitteringAngle)),
    Form("parameter_drift", "exponential", KNOWN, _own(later.WarmingUp), False,
         lambda e, p: {"change": e.change, "time_constant": e.time_constant}),
    Form("parameter_drift", "straight", KNOWN, _own(later.Ageing), False,
         lambda e, p: {"change": e.change}),
    Form("parameter_drift", "by_work", OTHER, _own(later.WarmedByWork)),
    Form("parameter_drift", "room", OTHER, _own(later.WarmingRoom)),
)  # fmt: skip
FORMS = (*_KNOWN, *_OTHER, *(Form(n, "plain", UNLISTED, _plain(n)) for n in _NO_CATALOGUE))
BY_LABEL = {f.label: f for f in (*FORMS, *LATER)}
#: those that nobody can tell apart, or that share a port: no two of a set stand in one case
APART = (
    {"input_path_lag", "pressure_lag", "clock_skew", "sensor_lag"},
    {"tendon_compliance", "moment_arm_error"},
    {"payload_swing", "base_flexibility"},
)
#: largest factor on the drawn size that is still a rig somebody would use
LIMITS = {
    "supply_leak": 300.0, "compressor_cut_in": 12.0, "valve_centre_leakage": 60.0,
    "tube_flow_restriction": 100.0, "leak_muscle": 60.0, "muscle_hysteresis": 6.0,
    "muscle_creep": 12.0, "muscle_rate_damping": 25.0, "activation_pressure": 8.0,
    "pam_crowding_contact": 40.0, "joint_coulomb_stribeck": 12.0, "joint_end_stop": 60.0,
    "external_torque": 25.0, "base_flexibility": 60.0, "pressure_lag": 15.0,
    "tendon_compliance": 12.0, "muscle_buckling": 15.0, "hose_torque": 60.0,
    "exhaust_back_pressure": 60.0, "moment_arm_error": 60.0,
}  # fmt: skip


def most(effect: Effect | Placed) -> float:
    """Largest factor on an effect that is still physical."""
    return min(effect.most(), LIMITS.get(effect.id, 1.0e6))
