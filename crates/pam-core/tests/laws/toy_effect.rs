//! A new effect is one file: `../toy/toy_spring.rs`, which the core does not know, acts in a rig as
//! those of the catalogue do. The same file is an entry of the catalogue where the feature `toy` is
//! on (tests/effects/test_toy.py).

use super::rigs::{effect_at, shoulder, two_joints};
use super::toy_spring::{INFO, RELAXING, SECANT};
use pam_core::cut_chain::{predict, Block, Measured, Prediction, Signal};
use pam_core::description::EffectSpec;
use pam_core::effects::{EffectInfo, Role};
use pam_core::plant::{ParameterId, StateRole};
use pam_core::simulate::drive::Drive;
use pam_core::simulate::{simulate, Initial, Progress, Timing, Trajectory};
use pam_core::{Rig, RigSpec};

static TOY: &[&EffectInfo] = &[&INFO];
const DT: f64 = 0.01;
const TIMING: Timing = Timing { sample_time: DT, substeps: 10 };
const ROWS: usize = 80;
const FORMS: [&str; 2] = ["linear", "cubic"];

fn spring(form: &str, at: &str, [stiffness, angle, time_constant]: [f64; 3]) -> EffectSpec {
    let values = [("stiffness", stiffness), ("angle", angle), ("time_constant", time_constant)];
    EffectSpec { form: form.into(), ..effect_at("toy_joint_spring", at, &values) }
}

fn with(spec: RigSpec, effects: Vec<EffectSpec>) -> Rig {
    Rig::with_effects(RigSpec { effects, ..spec }, TOY).unwrap()
}

/// Commands that fill and vent.
fn commands(rig: &Rig) -> Vec<(String, Vec<f64>)> {
    let volts = |k: usize| {
        let edge = if (k / 16).is_multiple_of(2) { 0.12 } else { -0.2 };
        5.15 + edge + 0.35 * (9.0 * k as f64 * DT).sin()
    };
    let values: Vec<f64> = (0..ROWS).map(volts).collect();
    rig.names().inputs.iter().map(|name| (name.clone(), values.clone())).collect()
}

fn borrowed(signals: &[(String, Vec<f64>)]) -> Vec<(&str, &[f64])> {
    signals.iter().map(|(name, values)| (name.as_str(), values.as_slice())).collect()
}

fn initial(rig: &Rig) -> Initial {
    let names: Vec<_> = rig.names().initial.iter().map(|(name, _)| name.clone()).collect();
    names.iter().fold(Initial::rest(rig), |start, name| match name.split('.').next() {
        Some("muscle_pressure") => start.with(rig, name, 2e5).unwrap(),
        Some("joint_angle") => start.with(rig, name, 0.6).unwrap(),
        _ => start,
    })
}

fn run_at(rig: &Rig, timing: Timing) -> Trajectory {
    simulate(rig, ROWS, &borrowed(&commands(rig)), timing, &initial(rig)).unwrap()
}

fn run(rig: &Rig) -> Trajectory {
    run_at(rig, TIMING)
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn it_moves_the_joint_and_its_neutral_value_changes_nothing() {
    for form in FORMS {
        for spec in [shoulder(), two_joints()] {
            let plain = with(spec.clone(), vec![]);
            let off = with(spec.clone(), vec![spring(form, "", [0.0, 0.4, 0.1])]);
            let on = with(spec.clone(), vec![spring(form, "", [40.0, 0.3, 0.1])]);
            let (a, b, c) = (run(&plain), run(&off), run(&on));
            assert_eq!(a.channels, b.channels, "bit for bit");
            let angles =
                plain.names().channels.iter().position(|(n, _)| n.starts_with("joint_angle"));
            let moved = apart(&a.channels[angles.unwrap()], &c.channels[angles.unwrap()]);
            assert!(moved > 1e-3, "{form} in {}: {moved}", spec.name);
        }
    }
}

#[test]
fn its_forms_are_their_laws() {
    // An arm that hangs still in no gravity, held by its inertia: the spring alone accelerates it.
    let mut spec = shoulder();
    spec.valves.clear();
    let arm = spec.arm.as_mut().unwrap();
    (arm.inertia, arm.payload, arm.gravity, arm.coulomb, arm.viscous) = (1e3, 0.0, 0.0, 0.0, 0.0);
    let gained = |form: &str, stiffness: f64| {
        let rig = with(spec.clone(), vec![spring(form, "", [stiffness, 0.3, 1e6])]);
        let start = Initial::rest(&rig).with(&rig, "joint_angle", 1.0).unwrap();
        let out =
            simulate(&rig, 2, &[], Timing { sample_time: 1e-3, substeps: 1 }, &start).unwrap();
        out.get(&rig, "joint_rate").unwrap()[1] * 1e3 / 1e-3
    };
    let depth = 0.7 - 0.5 * 1.0_f64.to_radians();
    for (form, deflection) in
        [("linear", depth), ("", depth), ("cubic", depth.powi(3) / SECANT.powi(2))]
    {
        let torque = gained(form, 500.0) - gained(form, 0.0);
        // It begins where it has rested for long.
        let expected = -500.0 * (1.0 - RELAXING) * deflection;
        assert!((torque / expected - 1.0).abs() < 1e-4, "{form}: {torque} {expected}");
    }
}

/// Values and slopes of a channel by central differences.
fn slopes(values: &[f64]) -> Vec<f64> {
    let last = values.len() - 1;
    let slope = |k: usize| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
        (values[b] - values[a]) / ((b - a) as f64 * DT)
    };
    (0..=last).map(slope).collect()
}

/// What a block of a rig predicts from a simulation of the truth.
fn predicted(rig: &Rig, truth: &Trajectory, block: &str, ids: &[ParameterId]) -> Prediction {
    let inputs = commands(rig);
    let known = ["supply_pressure", "muscle_pressure", "joint_angle"];
    let names: Vec<_> = (rig.names().channels.iter().map(|(name, _)| name.as_str()))
        .filter(|name| known.contains(&name.split('.').next().unwrap()))
        .collect();
    let rates: Vec<_> = names.iter().map(|n| slopes(truth.get(rig, n).unwrap())).collect();
    let measured: Vec<_> = (names.iter().zip(&rates))
        .map(|(n, slope)| (*n, Signal { value: truth.get(rig, n).unwrap(), slope }))
        .collect();
    let measured = Measured::new(rig, ROWS, &borrowed(&inputs), &measured).unwrap();
    predict(rig, Block::from_name(rig, block).unwrap(), &measured, TIMING, &[0, 40], ids).unwrap()
}

#[test]
fn its_sensitivities_are_those_of_differences() {
    let one = |form: &str| vec![spring(form, "", [40.0, 0.3, 0.1])];
    let two = vec![
        spring("linear", "elbow", [40.0, 0.3, 0.1]),
        spring("cubic", "wrist", [9.0, 0.2, 0.2]),
    ];
    let rigs = [
        (shoulder(), one("linear"), "arm", "toy_joint_spring"),
        (shoulder(), one("cubic"), "arm", "toy_joint_spring"),
        (two_joints(), two.clone(), "arm.elbow", "toy_joint_spring.elbow"),
        (two_joints(), two, "arm.wrist", "toy_joint_spring.wrist"),
    ];
    for (spec, effects, block, prefix) in rigs {
        let rig = with(spec, effects);
        let truth = run(&rig);
        let ids = INFO
            .parameters()
            .iter()
            .map(|p| rig.parameters().find(&format!("{prefix}.{}", p.name)));
        let ids: Vec<_> = ids.map(Result::unwrap).collect();
        let exact = predicted(&rig, &truth, block, &ids);
        for (column, id) in ids.iter().enumerate() {
            let mut names = rig.parameters().names().iter();
            let place = names.position(|name| rig.parameters().find(name).unwrap() == *id).unwrap();
            let step = 1e-5 * rig.parameters().value(*id);
            let shifted = |by: f64| {
                let mut values = rig.parameters().values().to_vec();
                values[place] += by;
                predicted(&rig.with_values(&values).unwrap(), &truth, block, &[]).value
            };
            let (up, down) = (shifted(step), shifted(-step));
            let slope = |k: usize| exact.jacobian[k * exact.columns + column];
            let scale = (0..ROWS).map(|k| slope(k).abs()).fold(0.0, f64::max);
            assert!(scale > 0.0, "{prefix}: parameter {column} of {block} has no influence");
            for k in 0..ROWS {
                let gap = (slope(k) - (up[k] - down[k]) / (2.0 * step)).abs();
                assert!(
                    gap <= 2e-3 * scale,
                    "{prefix}: parameter {column}, row {k}: {gap} of {scale}"
                );
            }
        }
    }
}

#[test]
fn a_restart_is_bit_for_bit() {
    for form in FORMS {
        let rig = with(shoulder(), vec![spring(form, "", [40.0, 0.3, 0.1])]);
        let signals = commands(&rig);
        let drive = Drive::new(&rig, ROWS, &borrowed(&signals)).unwrap();
        let mut whole = Progress::start(&rig, &initial(&rig)).unwrap();
        let mut part = whole.clone();
        let (mut out, mut parts) = (Trajectory::new(&rig, ROWS), Trajectory::new(&rig, ROWS));
        whole.advance(&rig, TIMING, &drive, &mut out).unwrap();
        for range in [0..33, 33..34, 34..ROWS] {
            let fresh = Progress::start(&rig, &initial(&rig)).unwrap();
            part = fresh.restored(&rig, &part.to_vec()).unwrap();
            part.advance(&rig, TIMING, &drive.part(range), &mut parts).unwrap();
        }
        assert_eq!((whole, out), (part, parts), "{form}");
    }
}

#[test]
fn two_of_it_at_two_joints_have_parameters_and_states_of_their_own() {
    let (elbow, wrist) = ([40.0, 0.3, 0.1], [9.0, 0.2, 0.2]);
    let rig = |effects: &[(&str, &str, [f64; 3])]| {
        with(
            two_joints(),
            effects.iter().map(|(form, at, values)| spring(form, at, *values)).collect(),
        )
    };
    let both = rig(&[("linear", "elbow", elbow), ("cubic", "wrist", wrist)]);
    for (name, value) in
        [("elbow.stiffness", 40.0), ("wrist.stiffness", 9.0), ("wrist.time_constant", 0.2)]
    {
        let id = both.parameters().find(&format!("toy_joint_spring.{name}")).unwrap();
        assert_eq!(both.parameters().value(id), value);
    }
    assert!(both.parameters().find("toy_joint_spring.stiffness").is_err(), "of which one?");
    let map = both.state_map();
    let own: Vec<_> = map.iter().filter(|p| p.name.starts_with("toy_joint_spring")).collect();
    let names: Vec<_> = own.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["toy_joint_spring.relaxed.elbow", "toy_joint_spring.relaxed.wrist"]);
    assert!(own.iter().all(|p| p.role == StateRole::Effect(Role::Moves)));
    assert_eq!(map.len(), Progress::start(&both, &initial(&both)).unwrap().to_vec().len());
    // Each moves the arm in its own way, and their order in the description is nobody's business.
    let angle = |rig: &Rig| run(rig).get(rig, "joint_angle.wrist").unwrap().to_vec();
    let all = angle(&both);
    let others = [
        rig(&[("linear", "elbow", elbow)]),
        rig(&[("cubic", "wrist", wrist)]),
        rig(&[("linear", "elbow", wrist), ("cubic", "wrist", elbow)]),
        rig(&[("cubic", "elbow", elbow), ("linear", "wrist", wrist)]),
    ];
    assert!(others.iter().all(|other| apart(&all, &angle(other)) > 1e-4));
    assert_eq!(all, angle(&rig(&[("cubic", "wrist", wrist), ("linear", "elbow", elbow)])));
    // One without a name acts at every joint, as two alike do.
    let everywhere = rig(&[("linear", "", elbow)]);
    assert_eq!(
        angle(&everywhere),
        angle(&rig(&[("linear", "elbow", elbow), ("linear", "wrist", elbow)]))
    );
}

#[test]
fn a_stiff_spring_shortens_the_step_and_a_fast_one_too() {
    let rig = |form: &str, values: [f64; 3]| with(shoulder(), vec![spring(form, "", values)]);
    let free = with(shoulder(), vec![]);
    for form in FORMS {
        let (none, stiff, fast) =
            (rig(form, [0.0, 0.3, 10.0]), rig(form, [1e9, 0.3, 10.0]), rig(form, [0.0, 0.3, 1e-3]));
        assert_eq!((none.stable_step(), none.body_step()), (free.stable_step(), free.body_step()));
        assert!(stiff.stable_step() < 0.5 * free.stable_step(), "{form}: {}", stiff.stable_step());
        assert!(
            (fast.body_step() / 2e-3 - 1.0).abs() < 1e-12 && fast.body_step() < free.body_step()
        );
        assert_eq!(
            [&stiff, &fast].map(Rig::gas_step),
            [free.gas_step(); 2],
            "the air knows nothing of it"
        );
        // and the shortened one is stable
        let rig = with(shoulder(), vec![spring(form, "", [2e4, 0.3, 1e-3])]);
        let (fine, rough) = (Timing { substeps: 400, ..TIMING }, TIMING.stable(&rig).unwrap());
        assert!(rough.substeps < 400, "{}", rough.substeps);
        let [a, b] =
            [fine, rough].map(|t| run_at(&rig, t).get(&rig, "joint_angle").unwrap().to_vec());
        assert!(apart(&a, &b) < 1e-3, "{form}: {}", apart(&a, &b));
    }
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let refused = |effects: Vec<EffectSpec>, word: &str| {
        let spec = RigSpec { effects, ..two_joints() };
        let text = Rig::with_effects(spec, TOY).unwrap_err().to_string();
        assert!(text.contains("toy_joint_spring") && text.contains(word), "{text}");
    };
    let values = [40.0, 0.3, 0.1];
    refused(
        vec![spring("quintic", "", values)],
        "no form \"quintic\"; one of \"linear\", \"cubic\"",
    );
    refused(
        vec![spring("", "elbow", values), spring("cubic", "elbow", values)],
        "joint.elbow twice",
    );
    refused(vec![spring("", "", values), spring("", "wrist", values)], "joint.wrist twice");
    refused(vec![spring("", "shoulder", values)], "no joint of that name");
    refused(vec![spring("", "", [-1.0, 0.3, 0.1])], "stiffness = -1");
    let catalogue = Rig::new(RigSpec { effects: vec![spring("", "", values)], ..shoulder() });
    assert_eq!(catalogue.is_err(), cfg!(not(feature = "toy")));
    let leak = effect_at("leak_muscle", "", &[("conductance", 1e-10), ("laminar_share", 0.0)]);
    let text = Rig::with_effects(RigSpec { effects: vec![leak], ..shoulder() }, TOY)
        .unwrap_err()
        .to_string();
    assert!(text.contains("there are: toy_joint_spring"), "{text}");
}
