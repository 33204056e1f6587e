"""Effects on the way of the air: supply, valve, line and chamber."""

from __future__ import annotations

from typing import Final

from pamrs.effects_table.entry import EffectInfo
from pamrs.effects_table.entry import EffectParameter as Parameter

__all__ = ["AIR"]

_CONDUCTANCE: Final = "m3/(s Pa)"

AIR: Final[tuple[EffectInfo, ...]] = (
    EffectInfo(
        id="supply_leak",
        name="leak of the tank or the supply line",
        block="supply",
        at="supply",
        equation="m_leak = C rho0 p psi(pa/p)/psi(0), out of the supply at all times",
        fingerprint="the supply falls in proportion to its absolute pressure, also with every valve shut; all else is as modelled",
        separates="gas that cools after charging stops falling within minutes; centre leakage stops when the valve is shut off; "
        "a sensor's drift does not follow the pressure",
        parameters=(
            Parameter("conductance", _CONDUCTANCE, 1e-11, 0.0, 1e-6, (1e-11, 1e-9), "sonic conductance of the leak (ISO 6358)", 0.0),
        ),
        reference="Beater, Pneumatic Drives (2007); ISO 6358",
        rivals=("valve_centre_leakage", "gas of the tank that cools after charging", "drift of the supply's pressure sensor"),
    ),
    EffectInfo(
        id="compressor_cut_in",
        label="compressor cut-in",
        needs=(("supply", "tank"),),
        name="compressor that starts and stops by the tank's pressure",
        block="supply",
        at="supply",
        equation="m_c = s Q rho0, s to 1 when p < p_in, to 0 when p > p_out (tanks only)",
        fingerprint="the tank's pressure rises evenly between two fixed pressures, whatever the valves do, and falls again",
        separates="a regulator that feeds the tank approaches its pressure and never cuts out; a refill by hand does not repeat",
        parameters=(
            Parameter("free_air_delivery", "m3/s", 2e-3, 0.0, 1.0, (2e-3,), "volume that it gives, at 100 kPa and 293 K", 0.0),
            Parameter(
                "cut_in_pressure",
                "Pa",
                1.2e6,
                0.0,
                1e8,
                (1.0e6, 1.3e6),
                "gauge pressure at which it starts",
                role="threshold",
                channel="supply_pressure",
            ),
            Parameter(
                "cut_out_pressure",
                "Pa",
                1.4e6,
                0.0,
                1e8,
                (1.2e6, 1.5e6),
                "gauge pressure at which it stops",
                role="threshold",
                channel="supply_pressure",
            ),
        ),
        reference="Beater, Pneumatic Drives (2007); ISO 1217",
        rivals=("a regulator that feeds the tank", "a refill by hand"),
    ),
    EffectInfo(
        id="supply_regulator_deadband",
        needs=(("supply", "regulator"),),
        name="dead band of the pressure regulator",
        block="supply",
        at="supply",
        equation="p' = (sgn(e) max(|e| - b, 0) - k m)/tau, e = p_set - p (regulators only)",
        fingerprint="small changes of the set pressure are not answered, large ones end short of their aim by the band",
        separates="a valve's dead zone is in the command near its null, not in the error of the pressure; "
        "a delay is the same for every step; stiction holds the joint while the pressure moves",
        parameters=(Parameter("dead_band", "Pa", 2e4, 0.0, 1e7, (5e3, 5e4), "error that the regulator does not answer", 0.0),),
        reference="Robinson (2014), ch. 3; Beater, Pneumatic Drives (2007)",
        rivals=("valve_dead_zone", "input_path_lag", "joint_coulomb_stribeck"),
    ),
    EffectInfo(
        id="valve_dead_zone",
        name="dead zone of the spool (positive overlap)",
        block="valve",
        at="valve",
        equation="x -> sgn(x) max(|x| - d, 0)/(1 - d)",
        fingerprint="pressure stands still while the command is near its null; at each change of direction the answer waits",
        separates="a null offset has one sign; the spool's play is there on one side of the null too; "
        "a regulator's dead band is in the pressure",
        parameters=(Parameter("half_width", "1", 0.03, 0.0, 0.9, (0.01, 0.05), "half width in parts of the half range", 0.0),),
        reference="Valdiero, Ritter, Rios & Rafikov (2011); Richer & Hurmuzlu (2000)",
        rivals=("valve_hysteresis", "supply_regulator_deadband", "a null voltage that is off"),
    ),
    EffectInfo(
        id="valve_hysteresis",
        name="play of the spool",
        block="valve",
        at="valve",
        equation="y <- min(max(y, x - h), x + h)",
        fingerprint="rising and falling commands give different flows at the same value, by a distance that no speed changes",
        separates="a dead zone is at the null only; the distance that a lag or delay makes grows with the rate of the command",
        parameters=(Parameter("half_width", "1", 0.004, 0.0, 0.9, (0.003, 0.02), "half of the play in parts of the half range", 0.0),),
        reference="Al Janaideh, Rakheja & Su (2011), play operator",
        rivals=("valve_dead_zone", "input_path_lag"),
    ),
    EffectInfo(
        id="valve_centre_leakage",
        name="leakage of the spool around its null",
        block="valve",
        at="valve",
        equation="C(x) = C0 exp(-|x|/x_l), from the supply to the chamber and from the chamber to the ambient",
        fingerprint="with the valve at its null the pressure goes to one and the same value from below and from above; air is used up",
        separates="a leak of the muscle never fills it; a leak of the supply goes on when the valve is shut off; "
        "a null offset keeps its sign at all pressures",
        parameters=(
            Parameter("conductance", _CONDUCTANCE, 3e-11, 0.0, 1e-6, (3e-11, 5e-10), "sonic conductance of each path at the null", 0.0),
            Parameter("opening", "1", 0.02, 1e-4, 1e3, (0.02,), "opening over which it fades, in parts of the half range"),
        ),
        reference="Belgharbi, Sesmat, Scavarda & Thomasset (1999); Energies 12, 1096 (2019)",
        rivals=("leak_muscle", "supply_leak", "a null voltage that is off"),
    ),
    EffectInfo(
        id="input_path_lag",
        name="lag and delay from command to opening (controller, spool and line together)",
        block="valve",
        at="valve",
        equation="T w' = x - w, then (D/3) z_i' = z_(i-1) - z_i, i = 1 to 3; z_3 opens the valve",
        fingerprint="every edge of the flow comes late by the same time, whatever its size, the pressure and the direction",
        separates="a sensor's lag is there too when motion changes the pressure; "
        "a clock's shift grows with time and leaves edges sharp; "
        "play does not depend on the command's rate; a regulator's dead band depends on the size of the step",
        parameters=(
            Parameter("time_constant", "s", 0.005, 0.0, 100.0, (0.003, 0.015), "first-order lag; below 20 us none", 0.0),
            Parameter("delay", "s", 0.0, 0.0, 100.0, (0.005,), "delay, as three equal lags; below 60 us none", 0.0),
        ),
        reference="Richer & Hurmuzlu (2000); Carneiro & de Almeida (2006); Hochbruck & Ostermann (2010) for its closed form",
        rivals=("pressure_lag", "clock_skew", "valve_hysteresis", "supply_regulator_deadband"),
    ),
    EffectInfo(
        id="tube_flow_restriction",
        name="hose that restricts the flow between valve and muscle",
        block="line",
        at="valve",
        acts_in=("supply", "chamber", "arm"),
        equation="m_v(p1, pn) = m_t(pn, p2), tube by ISO 6358 with C and b = 0.3; no volume at the node; read is p2, at tap 1 pn",
        fingerprint="large openings give less flow than they should, filling and venting alike; small ones are as modelled; "
        "read at the valve, the pressure jumps with the opening and leads the joint",
        separates="a smaller valve gives less at every opening, a larger volume slows every opening alike; "
        "a restricted supply line slows the filling only; a clock that is ahead does so with the valve shut too",
        parameters=(
            Parameter(
                "conductance",
                _CONDUCTANCE,
                1.2e-8,
                1e-15,
                1.0,
                (1.2e-8,),
                "sonic conductance; at 1 no restriction",
                1.0,
                role="size",
                restricts=True,
                like="valve.discharge_area_max",
            ),
            Parameter(
                "tap",
                "1",
                0.0,
                0.0,
                1.0,
                (0.0, 1.0),
                "0: the pressure is read behind the tube, 1 (from 0.5): at the valve",
                role="choice",
                needed_in=("arm",),
            ),
        ),
        reference="ISO 6358-3; Eckersten (1975)",
        rivals=("a smaller valve", "a larger dead volume", "a restricted supply line", "clock_skew"),
    ),
    EffectInfo(
        id="leak_muscle",
        label="muscle leak",
        name="leak of the muscle, a fitting or a hose",
        block="chamber",
        at="chamber",
        equation="m_leak = C rho0 [(1-s) p psi(pa/p)/psi(0) + s (p^2 - pa^2)/p_ref], lost at all times",
        fingerprint="pressure falls with the valve shut, in proportion to the absolute pressure, without end",
        separates="heat_transfer saturates within seconds after a fill; leakage at the valve's null fills at low pressure; "
        "a null offset keeps its own sign at all pressures; creep moves the joint, not the pressure",
        parameters=(
            Parameter(
                "conductance",
                _CONDUCTANCE,
                5e-12,
                0.0,
                1e-7,
                (1e-11,),
                "sonic conductance of the leak (ISO 6358)",
                0.0,
                same_everywhere=True,
            ),
            Parameter(
                "laminar_share",
                "1",
                0.0,
                0.0,
                1.0,
                (0.3,),
                "0 for a hole (orifice), 1 for a porous wall or thin crack (laminar, referred to 500 kPa absolute)",
                role="choice",
            ),
        ),
        reference="Beater, Pneumatic Drives (2007); ISO 6358",
        rivals=("heat_transfer", "valve_centre_leakage", "muscle_creep", "a null voltage that is off"),
        experiment="Fill to three pressures, shut the valve and hold each for at least 60 s: a leak keeps falling in proportion to the "
        "absolute pressure, heat exchange stops within seconds, and a valve null error follows the spool.",
        excitation=(("kind", "sealed_hold"), ("levels_bar", (2.0, 4.0, 6.0)), ("hold_s", 60.0)),
    ),
    EffectInfo(
        id="heat_transfer",
        name="gas temperature with heat exchange at the wall",
        block="chamber",
        at="chamber",
        equation="p' = (k R/V)(m_in Ts - m_out T) - k p V'/V + ((k-1)/V) h A (Tw - T), h = h0 sqrt(p T/(p0 T0))",
        fingerprint="after a fast fill and a shut valve the pressure falls for 0.1 to 2 s, then stays; after venting it rises",
        separates="leak_muscle never saturates and never rises; wrong gas coefficients show no relaxation with the valve shut",
        parameters=(
            Parameter(
                "heat_transfer_coefficient",
                "W/(m2 K)",
                50.0,
                1.0,
                1e4,
                (20.0, 80.0),
                "coefficient at 1 bar and rest temperature",
            ),
            Parameter(
                "initial_temperature_rise",
                "K",
                0.0,
                0.0,
                200.0,
                (5.0,),
                "gas above wall temperature where a recording begins (just after a fill)",
                role="held",
                role_sealed="size",
            ),
            Parameter(
                "share",
                "1",
                1.0,
                0.0,
                1.0,
                (0.2,),
                "of the gas that follows the balance; the rest keeps the fixed coefficients",
                role="size",
                role_sealed="held",
            ),
        ),
        reference="Carneiro & de Almeida (2006); Al-Ibrahim & Otis (1992)",
        rivals=("leak_muscle", "gas coefficients that are off"),
        experiment="Fill fast by steps of 1:3 in size, shut the valve after each and watch the pressure for 5 s; add a fast thermocouple "
        "in the chamber if there is one.",
        excitation=(("kind", "step_and_shut"), ("steps_bar", (1.0, 3.0)), ("watch_s", 5.0)),
    ),
)
"""In the order of the chain."""
