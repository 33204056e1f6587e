//! Rigs that several tests use.

use pam_core::description::{
    dotted, ArmSpec, ChamberSpec, EffectSpec, JointSpec, LineSpec, LinkSpec, TransmissionSpec,
    ValveSpec,
};
use pam_core::{Rig, RigSpec};
use std::collections::BTreeMap;
use std::sync::Mutex;

/// A rig from its description. Tables take most of the time of a test: rigs with the same muscles
/// share them.
pub fn compiled(spec: RigSpec) -> Rig {
    static MADE: Mutex<BTreeMap<String, Rig>> = Mutex::new(BTreeMap::new());
    let muscles = format!("{:?}", spec.muscles);
    let known = MADE.lock().unwrap().get(&muscles).cloned();
    let rig = known.map_or_else(|| Rig::new(spec.clone()), |rig| rig.respecified(spec.clone()));
    let rig = rig.unwrap();
    MADE.lock().unwrap().entry(muscles).or_insert_with(|| rig.clone());
    rig
}

/// One link, six muscles, a valve and a tank.
pub fn shoulder() -> RigSpec {
    RigSpec::from_json(include_str!("../../data/shoulder.json")).unwrap()
}

/// The same rig, its gases with an energy balance.
pub fn warm(mut spec: RigSpec) -> RigSpec {
    for chamber in &mut spec.chambers {
        chamber.gas = "energy_balance".into();
        chamber.heat_transfer_coefficient = 50.0;
    }
    spec
}

/// The same with muscles that push like struts, so that without air they act too.
pub fn with_struts(mut spec: RigSpec) -> RigSpec {
    for group in &mut spec.muscles {
        group.muscle.buckling_load = pam_core::muscle::STRUT;
    }
    spec
}

/// Flexor and extensor on one pulley, a valve each.
pub fn antagonists() -> RigSpec {
    let mut spec = shoulder();
    let pulley = |radius: f64, rest_angle: f64| {
        Some(TransmissionSpec {
            kind: "pulley".into(),
            upper_axial: 0.0,
            upper_offset: 0.0,
            lower_axial: 0.0,
            lower_offset: 0.0,
            radius,
            coefficients: vec![],
            rest_angle,
        })
    };
    let (valve, chamber, muscle) =
        (spec.valves[0].clone(), spec.chambers[0].clone(), spec.muscles[0].clone());
    (spec.valves, spec.chambers, spec.muscles) = (vec![], vec![], vec![]);
    for (name, radius, rest) in [("flexor", 0.025, -1.0), ("extensor", -0.025, 1.0)] {
        let port = format!("chamber.{name}");
        spec.valves.push(ValveSpec { name: name.into(), to: port.clone(), ..valve.clone() });
        spec.chambers.push(ChamberSpec { name: name.into(), ..chamber.clone() });
        let mut group = muscle.clone();
        (group.name, group.chamber, group.transmission) = (name.into(), port, pulley(radius, rest));
        group.muscle.count = 2;
        spec.muscles.push(group);
    }
    let joint = &mut spec.joints[0];
    (joint.transmission, joint.rest_angle, joint.min_angle, joint.max_angle) =
        (None, 0.0, -0.9, 0.9);
    let arm = spec.arm.as_mut().unwrap();
    (arm.payload, arm.gravity, arm.coulomb) = (0.5, 0.0, 0.0);
    spec
}

/// Elbow and wrist, a valve, chamber and muscles each.
pub fn two_joints() -> RigSpec {
    let mut spec = shoulder();
    let (valve, chamber, muscle, joint) = (
        spec.valves[0].clone(),
        spec.chambers[0].clone(),
        spec.muscles[0].clone(),
        spec.joints[0].clone(),
    );
    (spec.valves, spec.chambers, spec.muscles, spec.joints) = (vec![], vec![], vec![], vec![]);
    let mut links = vec![];
    for (name, count, length, mass) in [("elbow", 6, 0.4, 2.0), ("wrist", 2, 0.2, 0.8)] {
        let (port, hinge) = (format!("chamber.{name}"), format!("joint.{name}"));
        spec.valves.push(ValveSpec { name: name.into(), to: port.clone(), ..valve.clone() });
        spec.chambers.push(ChamberSpec { name: name.into(), ..chamber.clone() });
        let mut group = muscle.clone();
        (group.name, group.chamber, group.joint) = (name.into(), port, hinge.clone());
        group.muscle.count = count;
        spec.muscles.push(group);
        spec.joints.push(JointSpec { name: name.into(), ..joint.clone() });
        links.push(LinkSpec {
            name: name.into(),
            joint: hinge,
            length,
            mass,
            centre: length / 2.0,
            inertia: mass * length * length / 12.0,
            payload: if name == "wrist" { 3.0 } else { 0.0 },
            viscous: 1.0,
            coulomb: 0.3,
            coulomb_speed: 0.02,
        });
    }
    spec.arm = Some(ArmSpec { kind: "planar".into(), links, ..spec.arm.unwrap() });
    spec
}

/// The shoulder behind a regulator in the place of the tank.
pub fn regulated() -> RigSpec {
    let mut spec = shoulder();
    let supply = &mut spec.supplies[0];
    (supply.kind, supply.time_constant, supply.droop) = ("regulator".into(), 0.1, 1e7);
    supply.initial_pressure = 6e5;
    spec
}

/// A rig with what an effect acts on: a temperature, an outlet without a valve.
pub fn fitting(id: &str, mut spec: RigSpec) -> RigSpec {
    match id {
        "thermometer_lag" => warm(spec),
        "line_flow_law" => {
            spec.lines.push(LineSpec {
                name: "outlet".into(),
                kind: "orifice".into(),
                from: dotted("chamber", &spec.chambers[0].name),
                to: "ambient".into(),
                length: 0.0,
                diameter: 0.0,
                discharge_area: 5e-7,
                inlet_volume: 0.0,
                pressure_zero: 0.0,
                segments: 0,
                alpha: 1.0,
            });
            spec
        }
        _ => spec,
    }
}

/// The shoulder with what an effect acts on.
pub fn rig_for(id: &str) -> RigSpec {
    fitting(id, if id.starts_with("supply_regulator") { regulated() } else { shoulder() })
}

/// Nothing but a tank.
pub fn lone_tank() -> RigSpec {
    let mut spec = shoulder();
    spec.arm = None;
    (spec.valves, spec.muscles, spec.joints) = (vec![], vec![], vec![]);
    spec
}

/// An effect at one block, or at all.
pub fn effect_at(id: &str, at: &str, parameters: &[(&str, f64)]) -> EffectSpec {
    let parameters = parameters.iter().map(|(n, v)| ((*n).to_string(), *v)).collect();
    EffectSpec { id: id.into(), form: String::new(), at: at.into(), parameters }
}

/// An effect everywhere.
pub fn effect(id: &str, parameters: &[(&str, f64)]) -> EffectSpec {
    effect_at(id, "", parameters)
}

/// Typical values of every effect, and the parameters that switch it off.
pub struct Typical {
    pub id: &'static str,
    /// Empty for the usual one.
    pub form: &'static str,
    pub parameters: &'static [(&'static str, f64)],
    pub neutral: &'static [(&'static str, f64)],
}

/// Every effect in its usual form and in its others.
pub fn every() -> impl Iterator<Item = &'static Typical> {
    TYPICAL.iter().chain(FORMS)
}

/// Every effect in its usual form.
pub const TYPICAL: &[Typical] = &[
    typical("supply_leak", &[("conductance", 5e-10)], &[("conductance", 0.0)]),
    typical(
        "compressor_cut_in",
        &[("free_air_delivery", 5e-3), ("cut_in_pressure", 1.379e6), ("cut_out_pressure", 1.41e6)],
        &[("free_air_delivery", 0.0)],
    ),
    typical("supply_regulator_deadband", &[("dead_band", 2e4)], &[("dead_band", 0.0)]),
    typical("supply_regulator_delay", &[("delay", 0.0123)], &[("delay", 0.0)]),
    typical(
        "supply_regulator_slew",
        &[("rise_limit", 1e5), ("fall_limit", 8e4)],
        &[("rise_limit", 1e12), ("fall_limit", 1e12)],
    ),
    typical(
        "line_flow_law",
        &[("laminar_part", 0.9), ("laminar_flow", 2.0)],
        &[("laminar_part", 0.0)],
    ),
    typical("gauge_drift", &[("change", 2e4)], &[("change", 0.0)]),
    typical("load_cell_drift", &[("change", 500.0)], &[("change", 0.0)]),
    typical("valve_dead_zone", &[("half_width", 0.03)], &[("half_width", 0.0)]),
    typical("valve_hysteresis", &[("half_width", 0.01)], &[("half_width", 0.0)]),
    typical(
        "valve_centre_leakage",
        &[("conductance", 1e-9), ("opening", 0.05)],
        &[("conductance", 0.0)],
    ),
    typical("valve_area", &[("excess", 0.15)], &[("excess", 0.0)]),
    typical("exhaust_back_pressure", &[("conductance", 3e-10)], &[("conductance", 1.0)]),
    typical(
        "input_path_lag",
        &[("time_constant", 0.012), ("delay", 0.015)],
        &[("time_constant", 0.0), ("delay", 0.0)],
    ),
    typical(
        "tube_flow_restriction",
        &[("conductance", 3e-9), ("tap", 0.25)],
        &[("conductance", 1.0)],
    ),
    typical(
        "leak_muscle",
        &[("conductance", 2e-10), ("laminar_share", 0.4)],
        &[("conductance", 0.0), ("laminar_share", 0.0)],
    ),
    typical(
        "muscle_hysteresis",
        &[("friction_constant", 8.0), ("friction_pressure", 4e-5), ("presliding", 3e-3)],
        &[("friction_constant", 0.0), ("friction_pressure", 0.0)],
    ),
    typical("muscle_creep", &[("stiffness", 3e3), ("time_constant", 0.3)], &[("stiffness", 0.0)]),
    typical(
        "muscle_rate_damping",
        &[("damping_constant", 300.0), ("damping_pressure", 1e-3), ("lengthening_share", 0.5)],
        &[("damping_constant", 0.0), ("damping_pressure", 0.0)],
    ),
    typical("activation_pressure", &[("threshold", 2e4)], &[("threshold", 0.0)]),
    typical(
        "mullins_softening",
        &[("softening", 0.3), ("contraction_width", 0.03)],
        &[("softening", 0.0)],
    ),
    typical(
        "pam_crowding_contact",
        &[("contact_area", 2e-3), ("onset_contraction", 0.05), ("exponent", 1.3), ("rubbing", 0.1)],
        &[("contact_area", 0.0)],
    ),
    typical(
        "tendon_give",
        &[("compliance", 1e-5), ("time_constant", 0.01)],
        &[("compliance", 0.0)],
    ),
    typical(
        "joint_coulomb_stribeck",
        &[("stiction", 3.0), ("stribeck_speed", 0.08)],
        &[("stiction", 0.0)],
    ),
    typical(
        "joint_end_stop",
        &[
            ("stiffness", 800.0),
            ("angle", 0.95),
            ("dissipation", 0.3),
            ("exponent", 1.7),
            ("side", 0.5),
        ],
        &[("stiffness", 0.0)],
    ),
    typical(
        "payload_swing",
        &[("swinging_share", 0.6), ("length", 0.3), ("damping_ratio", 0.02)],
        &[("swinging_share", 0.0)],
    ),
    typical("payload_change", &[("mass_change", 1.5), ("time", 0.35)], &[("mass_change", 0.0)]),
    typical(
        "external_torque",
        &[
            ("torque", 12.0),
            ("time", 0.2),
            ("duration", 0.25),
            ("torque_2", -5.0),
            ("time_2", 0.3),
            ("duration_2", 0.2),
            ("torque_3", 4.0),
            ("time_3", 0.42),
            ("duration_3", 0.1),
            ("rise", 0.06),
        ],
        &[("torque", 0.0), ("torque_2", 0.0), ("torque_3", 0.0)],
    ),
    typical(
        "base_flexibility",
        &[("compliance", 1e-4), ("natural_frequency", 8.0), ("damping_ratio", 0.03)],
        &[("compliance", 0.0)],
    ),
    typical("com_offset", &[("angle", 0.1)], &[("angle", 0.0)]),
    typical("sensor_lag", &[("delay", 0.0123)], &[("delay", 0.0)]),
    typical("parameter_drift", &[("change", -0.3), ("time_constant", 0.4)], &[("change", 0.0)]),
    typical("pressure_lag", &[("time_constant", 0.01)], &[("time_constant", 0.0)]),
    typical("thermometer_lag", &[("time_constant", 0.1)], &[("time_constant", 0.0)]),
    typical(
        "encoder_error",
        &[("sine", 0.01), ("cosine", -0.02), ("set_angle", 0.3)],
        &[("sine", 0.0), ("cosine", 0.0)],
    ),
    typical(
        "clock_skew",
        &[("offset", 0.012), ("rate", 1e-3), ("angle_share", 0.4)],
        &[("offset", 0.0), ("rate", 0.0)],
    ),
    closure("closure_supply", CLOSURE_SUPPLY),
    closure("closure_flow", CLOSURE_FLOW),
    closure("closure_torque", CLOSURE_TORQUE),
];

/// The other forms.
pub const FORMS: &[Typical] = &[
    formed("supply_leak", "laminar", &[("conductance", 5e-10)], &[("conductance", 0.0)]),
    formed(
        "valve_dead_zone",
        "two_widths",
        &[("half_width", 0.03), ("half_width_venting", 0.02)],
        &[("half_width", 0.0), ("half_width_venting", 0.0)],
    ),
    formed(
        "base_flexibility",
        "with_play",
        &[("compliance", 1e-4), ("natural_frequency", 8.0), ("damping_ratio", 0.3), ("play", 0.01)],
        &[("compliance", 0.0)],
    ),
    formed(
        "tendon_give",
        "toe",
        &[("compliance", 2e-5), ("half_force", 200.0), ("time_constant", 0.01)],
        &[("compliance", 0.0)],
    ),
    formed(
        "valve_hysteresis",
        "play_with_slope",
        &[("half_width", 0.01), ("slope", 0.3)],
        &[("half_width", 0.0)],
    ),
    formed(
        "tube_flow_restriction",
        "pipe",
        &[("conductance", 3e-9), ("tap", 0.25), ("laminar_pressure", 3e4)],
        &[("conductance", 1.0)],
    ),
    formed(
        "valve_centre_leakage",
        "hyperbolic",
        &[("conductance", 1e-9), ("opening", 0.05)],
        &[("conductance", 0.0)],
    ),
    formed("valve_area", "bend", &[("excess", 0.3)], &[("excess", 0.0)]),
    formed(
        "leak_muscle",
        "power",
        &[("conductance", 2e-10), ("exponent", 1.3)],
        &[("conductance", 0.0)],
    ),
    formed("activation_pressure", "saturating", &[("threshold", 2e4)], &[("threshold", 0.0)]),
    formed(
        "input_path_lag",
        "second_order",
        &[("time_constant", 0.02), ("damping_ratio", 0.6)],
        &[("time_constant", 0.0)],
    ),
    formed(
        "input_path_lag",
        "slew_limit",
        &[("time_constant", 0.012), ("stroke_time", 1.5)],
        &[("time_constant", 0.0), ("stroke_time", 0.0)],
    ),
    formed(
        "input_path_lag",
        "up_and_down",
        &[("time_constant", 0.012), ("time_constant_down", 0.025)],
        &[("time_constant", 0.0), ("time_constant_down", 0.0)],
    ),
    formed("input_path_lag", "dead_time", &[("delay", 7.3e-3)], &[("delay", 0.0)]),
    formed(
        "muscle_hysteresis",
        "pressure_stops",
        &[("friction_constant", 8.0), ("friction_pressure", 4e-5), ("presliding", 3e-3)],
        &[("friction_constant", 0.0), ("friction_pressure", 0.0)],
    ),
    formed(
        "muscle_hysteresis",
        "force_proportional",
        &[("friction_constant", 8.0), ("friction_force", 0.04), ("presliding", 3e-3)],
        &[("friction_constant", 0.0), ("friction_force", 0.0)],
    ),
    formed(
        "muscle_hysteresis",
        "dahl",
        &[("friction_constant", 8.0), ("friction_pressure", 4e-5), ("presliding", 3e-3)],
        &[("friction_constant", 0.0), ("friction_pressure", 0.0)],
    ),
    formed(
        "muscle_creep",
        "two_branches",
        &[("stiffness", 3e3), ("time_constant", 0.1)],
        &[("stiffness", 0.0)],
    ),
    formed(
        "muscle_creep",
        "force_relaxation",
        &[("share", 0.1), ("time_constant", 0.3), ("relaxed", 0.4)],
        &[("share", 0.0)],
    ),
    formed(
        "muscle_creep",
        "bladder_relaxation",
        &[("share", 0.3), ("time_constant", 0.3), ("relaxed", 0.4)],
        &[("share", 0.0)],
    ),
    formed(
        "joint_coulomb_stribeck",
        "rational",
        &[("stiction", 3.0), ("stribeck_speed", 0.08)],
        &[("stiction", 0.0)],
    ),
    formed(
        "joint_coulomb_stribeck",
        "with_coulomb",
        &[("stiction", 3.0), ("stribeck_speed", 0.08), ("coulomb", 1.0)],
        &[("stiction", 0.0), ("coulomb", 0.0)],
    ),
    formed(
        "joint_coulomb_stribeck",
        "load_proportional",
        &[("stiction", 3.0), ("stribeck_speed", 0.08), ("load_share", 0.02)],
        &[("stiction", 0.0), ("load_share", 0.0)],
    ),
    formed(
        "joint_coulomb_stribeck",
        "per_direction",
        &[("stiction", 3.0), ("stribeck_speed", 0.08), ("backward_ratio", 1.6)],
        &[("stiction", 0.0)],
    ),
    formed(
        "payload_change",
        "ramp",
        &[("mass_change", 1.5), ("time", 0.153), ("duration", 0.402)],
        &[("mass_change", 0.0)],
    ),
    formed(
        "encoder_error",
        "first_and_second",
        &[
            ("sine", 0.01),
            ("cosine", -0.02),
            ("sine_2", 0.003),
            ("cosine_2", 0.004),
            ("set_angle", 0.3),
        ],
        &[("sine", 0.0), ("cosine", 0.0), ("sine_2", 0.0), ("cosine_2", 0.0)],
    ),
    formed(
        "line_flow_law",
        "power",
        &[("laminar_part", 0.8), ("laminar_flow", 2.0)],
        &[("laminar_part", 0.0)],
    ),
    formed(
        "gauge_drift",
        "exponential",
        &[("change", 2e4), ("time_constant", 0.4)],
        &[("change", 0.0)],
    ),
    formed(
        "load_cell_drift",
        "exponential",
        &[("change", 50.0), ("time_constant", 0.4)],
        &[("change", 0.0)],
    ),
    formed("parameter_drift", "straight", &[("change", -0.8)], &[("change", 0.0)]),
    formed("external_torque", "constant", &[("torque", 6.0)], &[("torque", 0.0)]),
    formed(
        "external_torque",
        "vibration",
        &[("torque", 8.0), ("torque_cosine", 4.0), ("frequency", 3.0)],
        &[("torque", 0.0), ("torque_cosine", 0.0)],
    ),
    formed(
        "external_torque",
        "two_vibrations",
        &[
            ("torque", 8.0),
            ("torque_cosine", 4.0),
            ("frequency", 3.0),
            ("torque_2", -5.0),
            ("torque_cosine_2", 2.0),
            ("frequency_2", 1.3),
        ],
        &[("torque", 0.0), ("torque_cosine", 0.0), ("torque_2", 0.0), ("torque_cosine_2", 0.0)],
    ),
];

const CLOSURE_SUPPLY: &[(&str, f64)] = &[
    ("constant", 1e-4),
    ("pressure", -2e-5),
    ("opening", -3e-3),
    ("filling", 1e-4),
    ("pressure_memory", 2e-4),
    ("memory_time", 0.4),
];

const CLOSURE_FLOW: &[(&str, f64)] = &[
    ("constant", 1e-5),
    ("pressure", -4e-6),
    ("pressure_squared", -1e-6),
    ("opening", 2e-4),
    ("abs_opening", -1e-4),
    ("opening_pressure", 3e-5),
    ("abs_opening_pressure", 2e-5),
    ("filling", 2e-5),
    ("sign_filling", -2e-6),
    ("sign_venting", 1e-6),
    ("at_null", 2e-5),
    ("supply_difference", 1e-6),
    ("volume_rate", -5e-5),
    ("pressure_memory", -3e-5),
    ("opening_memory", 1e-4),
    ("opening_memory_pressure", 1e-5),
    ("memory_time", 0.3),
];

const CLOSURE_TORQUE: &[(&str, f64)] = &[
    ("constant", 2.0),
    ("angle", -1.0),
    ("angle_squared", 0.5),
    ("sine_4", 0.3),
    ("cosine_4", -0.2),
    ("sine_8", 0.2),
    ("cosine_8", 0.1),
    ("pressure", -0.5),
    ("pressure_squared", 0.05),
    ("pressure_angle", 0.2),
    ("pressure_angle_squared", -0.1),
    ("rate", -0.6),
    ("angle_rate", -0.2),
    ("rate_quadratic", -0.1),
    ("pressure_rate", -0.2),
    ("sign", -0.3),
    ("pressure_sign", -0.05),
    ("creep", -2.0),
    ("pressure_creep", -0.4),
    ("pressure_memory", 0.5),
    ("slip", -0.8),
    ("pressure_slip", -0.2),
    ("memory_time", 0.3),
    ("memory_angle", 0.05),
];

/// A closure, and how it is switched off: every coefficient zero.
const fn closure(id: &'static str, parameters: &'static [(&'static str, f64)]) -> Typical {
    Typical { id, form: "", parameters, neutral: parameters }
}

const fn typical(
    id: &'static str,
    parameters: &'static [(&'static str, f64)],
    neutral: &'static [(&'static str, f64)],
) -> Typical {
    Typical { id, form: "", parameters, neutral }
}

const fn formed(
    id: &'static str,
    form: &'static str,
    parameters: &'static [(&'static str, f64)],
    neutral: &'static [(&'static str, f64)],
) -> Typical {
    Typical { id, form, parameters, neutral }
}

impl Typical {
    /// The effect at its typical values.
    pub fn on(&self) -> EffectSpec {
        EffectSpec { form: self.form.into(), ..effect(self.id, self.parameters) }
    }

    /// The effect where it does nothing.
    pub fn off(&self) -> EffectSpec {
        let mut off = self.on();
        for (name, value) in self.neutral {
            let coefficient = self.id.starts_with("closure_") && !name.starts_with("memory_");
            off.parameters.insert((*name).into(), if coefficient { 0.0 } else { *value });
        }
        off
    }
}
