"""Which experiment shows the fingerprint of each effect, and what to look at."""

from __future__ import annotations

from typing import Final

from fingerprints import air, motion, muscle, sensors
from fingerprints.sheet import Experiment

__all__ = ["EXPERIMENTS"]

EXPERIMENTS: Final[dict[str, Experiment]] = {
    experiment.effect: experiment
    for experiment in (
        Experiment(
            "supply_leak",
            "shoulder",
            (
                "the valve shut for two minutes but for one short fill, from a full and from a "
                "half empty tank (the arm held)"
            ),
            "the supply falls all the time, in proportion to its pressure",
            air.supply_leak,
            {"conductance": 6e-11},
        ),
        Experiment(
            "compressor_cut_in",
            "shoulder",
            "many fills and vents in a row, then none (the arm held)",
            "the tank rises between two pressures, whatever the valve does",
            air.compressor,
            {"cut_out_pressure": 1.35e6},
        ),
        Experiment(
            "supply_regulator_deadband",
            "regulated_joint",
            "a staircase of the set pressure, steps of 0.1 to 0.8 bar up and down",
            "small steps are not answered, large ones end short by the band",
            air.dead_band,
        ),
        Experiment(
            "supply_regulator_delay",
            "regulated_joint",
            "steps of the set pressure of 0.3 and 2.7 bar, up and down",
            "every step is answered later by the same time, whatever its size",
            air.regulator_delay,
            {"delay": 0.1},
        ),
        Experiment(
            "supply_regulator_slew",
            "regulated_joint",
            "steps of the set pressure of 0.3 and 2.7 bar, up and down",
            "large steps are ramps, slower down than up; small ones are as they were",
            air.regulator_slew,
            {"rise_limit": 1e6, "fall_limit": 6e5},
        ),
        Experiment(
            "valve_dead_zone",
            "shoulder",
            "slow ramps of the command through the null, both ways (the arm held)",
            "no flow around the null, and the pressure rests at each change of direction",
            air.dead_zone,
        ),
        Experiment(
            "valve_hysteresis",
            "shoulder",
            (
                "triangles of the command at two speeds, through the null and on one side of it "
                "(the arm held)"
            ),
            "rising and falling commands give two lines, at any speed, also away from the null",
            air.play,
            {"half_width": 0.01},
        ),
        Experiment(
            "valve_centre_leakage",
            "shoulder",
            (
                "the valve at its null for 200 s, from a low and from a high pressure, the tank at "
                "6 bar (the arm held)"
            ),
            "from below and from above to one pressure, and the tank loses air",
            air.centre_leakage,
            {"conductance": 1e-10},
        ),
        Experiment(
            "valve_area",
            "shoulder",
            "fills and vents at three openings, and the flow at every opening (the arm held)",
            "every fill is faster than modelled, every vent slower, by the same share",
            air.two_areas,
            {"excess": 0.2},
        ),
        Experiment(
            "exhaust_back_pressure",
            "shoulder",
            "fills and vents at three openings, and the flow at every opening (the arm held)",
            "fills and small vents as modelled, wide open vents short of flow",
            air.back_pressure,
        ),
        Experiment(
            "input_path_lag",
            "shoulder",
            "a large fill, a small fill and a vent, at 0.5 ms (the arm held)",
            "each edge of the flow is late by the same time",
            air.input_lag,
            {"delay": 0.01},
        ),
        Experiment(
            "tube_flow_restriction",
            "shoulder",
            "fills and vents at three openings, and the flow at every opening (the arm held)",
            "small openings as modelled, large ones short of flow, both ways",
            air.restriction,
        ),
        Experiment(
            "line_flow_law",
            "blow_down_tank",
            "a full tank is opened to the ambient",
            "the flow falls off in proportion to the pressure, and the end is an exponential",
            air.flow_law,
            {"laminar_flow": 0.5},
        ),
        Experiment(
            "leak_muscle",
            "shoulder",
            "sealed holds of half a minute at three levels",
            "pressure falls with the valve shut, in proportion to its absolute value",
            air.muscle_leak,
            {"conductance": 5e-11},
        ),
        Experiment(
            "heat_transfer",
            "shoulder",
            (
                "fast fills and vents, large and small, the valve shut for five seconds after each "
                "(the arm held)"
            ),
            "after a fast fill the pressure falls and stays, after a fast vent it rises and stays",
            air.heat,
        ),
        Experiment(
            "muscle_hysteresis",
            "regulated_joint",
            (
                "slow triangles of the pressure, a small one inside; on the rig `bench` a sine of "
                "length at two pressures and two speeds"
            ),
            "a loop that grows with pressure, not with speed, and turns over a distance",
            muscle.hysteresis,
            {"friction_constant": 10.0, "friction_pressure": 1e-4, "presliding": 2e-3},
        ),
        Experiment(
            "muscle_creep",
            "regulated_joint",
            "steps of pressure with holds of 25 s, the last one after a short overshoot",
            "the joint goes on at constant pressure, and back after a partial return",
            muscle.creep,
            {"stiffness": 2000.0, "time_constant": 5.0},
        ),
        Experiment(
            "muscle_rate_damping",
            "regulated_joint",
            (
                "the arm let go at two pressures; on the rig `bench` a sine of length at two "
                "pressures and two speeds"
            ),
            "a loop that grows with speed, decay that is faster at higher pressure",
            muscle.damping,
            {"damping_constant": 300.0, "damping_pressure": 2e-3, "lengthening_share": 0.4},
        ),
        Experiment(
            "activation_pressure",
            "regulated_joint",
            "a slow rise of the pressure from 0 bar, with the payload and without",
            "the whole curve is shifted by one pressure, whatever the payload",
            muscle.activation,
            {"threshold": 4e4},
        ),
        Experiment(
            "mullins_softening",
            "regulated_joint",
            "slow triangles of the pressure, the first cycle kept: two to 2 bar, two to 3 bar",
            "a first stroke is as modelled, later ones go further up to its end",
            muscle.softening,
            {"softening": 0.3},
        ),
        Experiment(
            "parameter_drift",
            "regulated_joint",
            "the same slow triangle of the pressure again and again (no Coulomb friction)",
            "the same pressure holds another angle later, whatever was done before",
            muscle.drift,
            {"change": -0.3, "time_constant": 40.0},
        ),
        Experiment(
            "pam_crowding_contact",
            "regulated_joint",
            (
                "a slow triangle of the pressure; on the rig `bench` the whole stroke at three "
                "pressures"
            ),
            "beyond one contraction the pull falls short, more at higher pressure",
            muscle.crowding,
            {"contact_area": 3e-3, "onset_contraction": 0.1},
        ),
        Experiment(
            "tendon_give",
            "regulated_joint",
            (
                "a slow triangle of the pressure; on the rig `bench` three pressures at held "
                "lengths of muscle and tendon"
            ),
            "the joint falls short in proportion to the pull, the muscle alone does not",
            muscle.give,
            {"compliance": 1e-5},
        ),
        Experiment(
            "joint_coulomb_stribeck",
            "regulated_joint",
            "very slow triangles of the pressure",
            "the joint rests while the pressure moves, then jumps; longest at each return",
            motion.stiction,
            {"stiction": 3.0, "stribeck_speed": 0.01},
        ),
        Experiment(
            "joint_end_stop",
            "regulated_joint",
            "a slow triangle of the pressure, and steps to two pressures",
            "motion ends and rebounds at one angle, at any pressure",
            motion.end_stop,
            {"stiffness": 3000.0},
        ),
        Experiment(
            "payload_swing",
            "regulated_joint",
            "steps to two pressures, each held",
            "oscillation after each manoeuvre, with the cord's period at both pressures",
            motion.swing,
        ),
        Experiment(
            "payload_change",
            "regulated_joint",
            "the same slow triangle of pressure again and again; 2 kg are taken away at 40 s",
            "from one moment on another torque, in proportion to the weight's lever",
            motion.change,
            {"mass_change": -2.0, "time": 40.0},
        ),
        Experiment(
            "com_offset",
            "regulated_joint",
            "a slow triangle of the pressure (no Coulomb friction)",
            "a torque that is largest where the link hangs, at any pressure",
            motion.offset,
            {"angle": 0.06},
        ),
        Experiment(
            "external_torque",
            "regulated_joint",
            (
                "the same steps of pressure twice; a push of 1.5 s in the second hold (no Coulomb "
                "friction)"
            ),
            "a torque that comes and goes by itself, and not again with the command",
            motion.push,
            {"torque": -8.0, "time": 21.0, "duration": 1.5},
        ),
        Experiment(
            "base_flexibility",
            "regulated_joint",
            "random steps of the set pressure, 25 in a second (no Coulomb friction)",
            "ringing in a narrow band, and an inertia that depends on frequency",
            motion.mounting,
        ),
        Experiment(
            "pressure_lag",
            "shoulder",
            "a short fill, then the arm swings on the air that is shut in",
            "the recorded pressure is late, also where motion makes it with the valve shut",
            sensors.late_pressure,
            {"time_constant": 0.02},
        ),
        Experiment(
            "gauge_drift",
            "regulated_joint",
            "the same slow triangle of the pressure again and again, vented between",
            "the recorded pressure creeps off its zero, and the joint comes to another angle at it",
            sensors.drifting_gauge,
            {"change": 1.5e4},
        ),
        Experiment(
            "load_cell_drift",
            "bench",
            "slow strokes of a load frame at 1 bar, at 2 bar and vented",
            "the recorded force goes up by the same at every length and pressure",
            sensors.drifting_cell,
            {"change": 60.0},
        ),
        Experiment(
            "thermometer_lag",
            "shoulder",
            (
                "fast fills and vents, the valve shut after each (the arm held; the gas with "
                "`heat_transfer`)"
            ),
            "the recorded temperature comes late and less deep, and no pressure knows of it",
            sensors.slow_thermometer,
            {"time_constant": 0.5},
        ),
        Experiment(
            "sensor_lag",
            "shoulder",
            "a short fill, then the arm swings on the air that is shut in",
            "the angle is recorded later than the pressure that moves it",
            sensors.late_angle,
            {"delay": 0.03},
        ),
        Experiment(
            "encoder_error",
            "regulated_joint",
            "slow triangles of the pressure, with the payload and with half of it",
            "the error is one curve over the angle, whatever the load and the way",
            sensors.erring_encoder,
            {"sine": 0.02, "cosine": 0.01},
        ),
        Experiment(
            "clock_skew",
            "shoulder",
            "the same pulse of the command every 8 s for a minute",
            "pressure and angle are late alike, and later at the end than at the start",
            sensors.late_clock,
            {"rate": 5e-4},
        ),
    )
}
"""By the effect's id, in the order of the catalogue."""
