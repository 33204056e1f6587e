//! Linear models: coefficients of the equations, sides of a valve, and a row for everything that
//! effects move. That they are the differences of simulations is tested from Python, for every
//! packaged rig.

use super::rigs::{
    antagonists, compiled, effect_at, regulated, rig_for, shoulder, two_joints, TYPICAL,
};
use pam_core::effects::{Role, EFFECTS};
use pam_core::plant::{LinearModel, Side};
use pam_core::simulate::{Initial, Progress};
use pam_core::{Rig, RigSpec};

fn linearised(rig: &Rig, side: Side) -> LinearModel {
    let start = Initial::rest(rig).with(rig, &rig.names().initial[1].0, 2e5).unwrap();
    Progress::start(rig, &start).unwrap().linearised(rig, side).unwrap()
}

fn place(model: &LinearModel, name: &str) -> usize {
    model
        .states
        .iter()
        .position(|state| state == name)
        .unwrap_or_else(|| panic!("{:?}", model.states))
}

/// A row of the state matrix, then of the input matrix.
fn row<'m>(model: &'m LinearModel, name: &str) -> (&'m [f64], &'m [f64]) {
    let (n, m, k) = (model.states.len(), model.inputs.len(), place(model, name));
    (&model.a[k * n..(k + 1) * n], &model.b[k * m..(k + 1) * m])
}

#[test]
fn coefficients_are_those_of_the_equations() {
    let spec = shoulder();
    let rig = compiled(spec.clone());
    let (fill, vent, mean) =
        (linearised(&rig, Side::Fill), linearised(&rig, Side::Vent), linearised(&rig, Side::Mean));
    assert_eq!(mean.states, ["supply_pressure", "muscle_pressure", "joint_angle", "joint_rate"]);
    assert_eq!(
        (&mean.outputs, mean.inputs.as_slice()),
        (&mean.states, &["valve_command".to_string()][..])
    );
    assert_eq!(row(&mean, "joint_angle"), (&[0.0, 0.0, 0.0, 1.0][..], &[0.0][..]));
    let identity: Vec<f64> = (0..16).map(|k| f64::from(u8::from(k % 5 == 0))).collect();
    assert_eq!(mean.c, identity);
    let arm = spec.arm.unwrap();
    let inertia = arm.inertia + arm.payload * arm.length * arm.length;
    let damping = (arm.viscous + arm.coulomb / arm.coulomb_speed) / inertia;
    assert!((row(&mean, "joint_rate").0[3] + damping).abs() < 1e-12 * damping);
    let of = |model: &LinearModel| row(model, "muscle_pressure").1[0];
    assert!(of(&fill) > of(&vent) && of(&vent) > 0.0);
    assert!((of(&mean) - 0.5 * (of(&fill) + of(&vent))).abs() < 1e-12 * of(&mean));
    // while it vents the tank gives nothing
    assert!(row(&fill, "supply_pressure").1[0] < 0.0);
    assert_eq!(row(&vent, "supply_pressure").1[0], 0.0);
    assert_eq!((&fill.a, &fill.c), (&vent.a, &vent.c));
}

#[test]
fn a_regulator_follows_what_it_is_set_to_by_its_time_constant() {
    for limit in [1e12, 1e5] {
        let mut spec = regulated();
        (spec.supplies[0].rise_limit, spec.supplies[0].fall_limit) = (limit, limit);
        let rig = compiled(spec);
        // at rest away from where it begins by itself, so that a limit is none to a small motion
        let start = Initial::rest(&rig).with(&rig, "supply_pressure", 3e5).unwrap();
        let start = start.with(&rig, "muscle_pressure", 2e5).unwrap();
        let model = Progress::start(&rig, &start).unwrap().linearised(&rig, Side::Mean).unwrap();
        assert_eq!(model.inputs, ["valve_command", "supply_command"]);
        let (own, by) = row(&model, "supply_pressure");
        assert!((own[0] + 10.0).abs() < 1e-9, "{own:?}");
        assert!((by[1] - 10.0).abs() < 1e-9, "{by:?}");
        assert!(model.b.iter().skip(3).step_by(2).all(|slope| *slope == 0.0));
    }
}

#[test]
fn a_spring_across_the_joint_is_stiffness_over_inertia() {
    let by_angle = |spec: &RigSpec| {
        let model = linearised(&compiled(spec.clone()), Side::Fill);
        row(&model, "joint_rate").0[place(&model, "joint_angle")]
    };
    let (plain, mut sprung) = (shoulder(), shoulder());
    (sprung.joints[0].stiffness, sprung.joints[0].spring_angle) = (40.0, 1.2);
    let arm = plain.arm.as_ref().unwrap();
    let inertia = arm.inertia + arm.payload * arm.length * arm.length;
    let found = by_angle(&sprung) - by_angle(&plain);
    assert!((found + 40.0 / inertia).abs() < 1e-9, "{found}");
}

#[test]
fn a_side_has_a_name() {
    for (name, side) in [("fill", Side::Fill), ("vent", Side::Vent), ("mean", Side::Mean)] {
        assert_eq!(Side::from_name(name).unwrap(), side);
    }
    let refused = Side::from_name("left").unwrap_err().to_string();
    assert!(refused.contains("side = \"left\"") && refused.contains("\"vent\""), "{refused}");
}

#[test]
fn what_effects_move_has_a_row_each() {
    for typical in TYPICAL {
        let info = EFFECTS.iter().find(|e| e.id == typical.id).unwrap();
        let states = info.forms[0].states.iter();
        let names =
            states.filter(|s| matches!(s.role, Role::Moves | Role::Opens)).map(|s| match s.name {
                "" => info.id.to_string(),
                name => format!("{}.{name}", info.id),
            });
        let spec = rig_for(typical.id);
        let rig = compiled(RigSpec { effects: vec![typical.on()], ..spec });
        let model = linearised(&rig, Side::Fill);
        let mut found: Vec<String> = model.states[4..].to_vec();
        found.retain(|name| !name.ends_with("air_mass"));
        assert_eq!(found, names.collect::<Vec<_>>());
        for name in &found {
            assert!(row(&model, name).0.iter().any(|slope| *slope != 0.0), "{name}");
        }
    }
}

#[test]
fn effects_in_closed_form_have_the_rates_of_their_equations() {
    let lag = |at| effect_at("input_path_lag", at, &[("time_constant", 0.02), ("delay", 0.03)]);
    let late = effect_at("pressure_lag", "flexor", &[("time_constant", 0.05)]);
    let rig = compiled(RigSpec { effects: vec![late, lag("extensor")], ..antagonists() });
    let half_range = rig.spec().valves[1].half_range;
    let model = linearised(&rig, Side::Mean);
    assert_eq!(model.states[5], "pressure_lag.flexor"); // as they were given
    let slope = |name: &str, by: &str| row(&model, name).0[place(&model, by)];
    assert_eq!(slope("pressure_lag.flexor", "pressure_lag.flexor"), -20.0);
    assert_eq!(slope("pressure_lag.flexor", "muscle_pressure.flexor"), 20.0);
    let chain = ["lag", "delay_1", "delay_2", "delay_3"]
        .map(|part| format!("input_path_lag.{part}.extensor"));
    assert!((row(&model, &chain[0]).1[1] - 50.0 / half_range).abs() < 1e-12);
    assert_eq!(slope(&chain[0], &chain[0]), -50.0);
    for pair in chain.windows(2) {
        assert!((slope(&pair[1], &pair[0]) - 100.0).abs() < 1e-9);
        assert!((slope(&pair[1], &pair[1]) + 100.0).abs() < 1e-9);
    }
    // the command reaches the air through the chain alone, and the sensor reads the lag
    assert_eq!(row(&model, "muscle_pressure.extensor").1[1], 0.0);
    assert!(slope("muscle_pressure.extensor", &chain[3]) > 0.0);
    let n = model.states.len();
    let reading = &model.c[place(&model, "muscle_pressure.flexor") * n..][..n];
    assert_eq!(
        reading.iter().position(|share| *share == 1.0),
        Some(place(&model, "pressure_lag.flexor"))
    );
}

#[test]
fn friction_before_it_slips_is_a_spring_about_the_point() {
    let typical = TYPICAL.iter().find(|t| t.id == "muscle_hysteresis").unwrap();
    let plain = compiled(two_joints());
    let rough = compiled(RigSpec { effects: vec![typical.on()], ..two_joints() });
    let [plain, rough] = [plain, rough].map(|rig| linearised(&rig, Side::Mean));
    assert_eq!(plain.states, rough.states);
    let spring =
        |model: &LinearModel| row(model, "joint_rate.elbow").0[place(model, "joint_angle.elbow")];
    assert!(spring(&rough) < spring(&plain));
}
