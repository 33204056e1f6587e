//! Laws of the composed plant: order, sensitivities against differences, typed errors, determinism.

use super::rigs::compiled;
use pam_core::cut_chain::{predict, Block};
use pam_core::cut_chain::{Measured, Signal};
use pam_core::description::EffectSpec;
use pam_core::effects::EFFECTS;
use pam_core::simulate::{simulate, Initial, Timing, Trajectory};
use pam_core::{Error, Rig, RigSpec};
use std::collections::BTreeMap;

fn spec() -> RigSpec {
    RigSpec::from_json(include_str!("../data/shoulder.json")).unwrap()
}

fn effect(id: &str, parameters: &[(&str, f64)]) -> EffectSpec {
    let parameters: BTreeMap<_, _> =
        parameters.iter().map(|(n, v)| ((*n).to_string(), *v)).collect();
    EffectSpec { id: id.into(), form: String::new(), at: String::new(), parameters }
}

fn command(n: usize) -> Vec<f64> {
    (0..n).map(|k| 5.3 + 0.25 * (k as f64 * 0.03).sin()).collect()
}

fn start(rig: &Rig) -> Initial {
    let rest = Initial::rest(rig);
    rest.with(rig, "muscle_pressure", 2e5).unwrap().with(rig, "joint_angle", 0.9).unwrap()
}

fn run(rig: &Rig, n: usize, substeps: usize) -> Trajectory {
    let timing = Timing { sample_time: 0.01, substeps };
    simulate(rig, n, &[("valve_command", &command(n))], timing, &start(rig)).unwrap()
}

#[test]
fn converges_with_order_four() {
    let rig = compiled(spec());
    let reference = run(&rig, 60, 320);
    let error = |substeps| {
        let t = run(&rig, 60, substeps);
        let angle = |t: &Trajectory| t.get(&rig, "joint_angle").unwrap().to_vec();
        angle(&t).iter().zip(&angle(&reference)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let order = (error(10) / error(20)).log2();
    assert!((3.6..4.4).contains(&order), "order {order}");
}

#[test]
fn a_run_repeats_bit_for_bit() {
    let rig = compiled(spec());
    assert_eq!(run(&rig, 100, 10), run(&rig.clone(), 100, 10));
}

/// Values and slopes of a channel by central differences.
fn slopes(values: &[f64], dt: f64) -> Vec<f64> {
    let n = values.len();
    (0..n)
        .map(|k| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
            (values[b] - values[a]) / ((b - a) as f64 * dt)
        })
        .collect()
}

#[test]
#[allow(clippy::too_many_lines, reason = "a table of the parameters and one check of each")]
fn sensitivities_agree_with_differences() {
    let mut with_effects = spec();
    with_effects.effects = vec![
        effect("leak_muscle", &[("conductance", 2e-10), ("laminar_share", 0.4)]),
        effect(
            "muscle_hysteresis",
            &[("friction_constant", 8.0), ("friction_pressure", 4e-5), ("presliding", 3e-3)],
        ),
    ];
    let mut heated = with_effects.clone();
    heated.effects = vec![effect(
        "heat_transfer",
        &[("heat_transfer_coefficient", 60.0), ("initial_temperature_rise", 3.0), ("share", 0.4)],
    )];
    let mut conducting = with_effects.clone();
    let valve = &mut conducting.valves[0];
    valve.flow = "iso_6358".into();
    valve.null_voltage = 5.4; // it vents and fills, both below choking
    (valve.fill_conductance, valve.fill_critical_ratio) = (1.5e-8, 0.1);
    (valve.vent_conductance, valve.vent_critical_ratio) = (1.8e-8, 0.2);
    let mut sprung = spec();
    let joint = &mut sprung.joints[0];
    (joint.stiffness, joint.spring_angle) = (30.0, 1.1);
    let mut tilted = spec();
    tilted.arm.as_mut().unwrap().base_angle = -0.3; // a centre that is on the line has a slope too
    let mut warm = spec();
    let muscle = &mut warm.muscles[0].muscle;
    (muscle.softening, muscle.temperature) = (3e-3, 313.15);
    let cases: [(&RigSpec, Block, &[&str]); 9] = [
        (&sprung, Block::Arm(0), &["joint.stiffness", "joint.spring_angle", "arm.payload"]),
        (&warm, Block::Arm(0), &["muscle.softening", "muscle.temperature"]),
        (&tilted, Block::Arm(0), &["arm.base_angle", "arm.centre_angle", "arm.payload"]),
        (
            &conducting,
            Block::Chamber(0),
            &[
                "valve.fill_conductance",
                "valve.fill_critical_ratio",
                "valve.vent_conductance",
                "valve.vent_critical_ratio",
                "valve.null_voltage",
            ],
        ),
        (
            &with_effects,
            Block::Supply(0),
            &[
                "supply.volume",
                "supply.pressure_zero",
                "valve.discharge_area_max",
                "valve.null_voltage",
            ],
        ),
        (
            &with_effects,
            Block::Chamber(0),
            &[
                "chamber.dead_volume",
                "chamber.alpha",
                "supply.pressure_zero",
                "leak_muscle.conductance",
                "leak_muscle.laminar_share",
                "sensors.angle_zero",
            ],
        ),
        (
            &with_effects,
            Block::Arm(0),
            &[
                "arm.payload",
                "arm.coulomb",
                "muscle.modulus_scale",
                "muscle_hysteresis.friction_pressure",
                "muscle_hysteresis.presliding",
                "sensors.pressure_zero",
            ],
        ),
        (
            &with_effects,
            Block::Pull(0),
            &[
                "muscle.modulus_scale",
                "muscle_hysteresis.friction_pressure",
                "muscle_hysteresis.presliding",
                "sensors.pressure_zero",
                "sensors.angle_zero",
            ],
        ),
        (
            &heated,
            Block::Chamber(0),
            &[
                "heat_transfer.heat_transfer_coefficient",
                "heat_transfer.initial_temperature_rise",
                "heat_transfer.share",
            ],
        ),
    ];
    let base = compiled(with_effects.clone());
    let n = 80;
    let truth = run(&base, n, 10);
    let dt = 0.01;
    let channel = |name: &str| truth.get(&base, name).unwrap();
    let names = ["supply_pressure", "muscle_pressure", "joint_angle"];
    let rates = names.map(|name| slopes(channel(name), dt));
    let u = command(n);
    let signal = |k: usize| (names[k], Signal { value: channel(names[k]), slope: &rates[k] });
    let measured =
        Measured::new(&base, n, &[("valve_command", &u)], &[signal(0), signal(1), signal(2)])
            .unwrap();
    let timing = Timing { sample_time: dt, substeps: 10 };
    for (spec, block, names) in cases {
        let rig = compiled(spec.clone());
        let ids: Vec<_> = names.iter().map(|n| rig.parameters().find(n).unwrap()).collect();
        let exact = predict(&rig, block, &measured, timing, &[0, 40], &ids).unwrap();
        for (column, name) in names.iter().enumerate() {
            let size = if name.ends_with("zero") { 1e-3 } else { 1e-4 };
            let shifted = |sign: f64| {
                let rig = compiled(nudged(spec, name, sign * size));
                predict(&rig, block, &measured, timing, &[0, 40], &[]).unwrap().value
            };
            let (up, down) = (shifted(1.0), shifted(-1.0));
            let span = nudge_size(spec, name, size);
            let scale = (0..n)
                .map(|k| exact.jacobian[k * exact.columns + column].abs())
                .fold(0.0, f64::max);
            assert!(scale > 0.0, "{name} has no influence");
            for k in 0..n {
                let difference = (up[k] - down[k]) / (2.0 * span);
                let gap = (exact.jacobian[k * exact.columns + column] - difference).abs();
                assert!(gap < 2e-3 * scale, "{name} at row {k}: {gap} of {scale}");
            }
        }
    }
}

/// Sensitivities of a chamber that are those of differences, whatever its muscle does.
fn kinked(spec: &RigSpec, angle: impl Fn(f64) -> f64) {
    let (n, dt) = (80, 0.01);
    let at = |k: usize| angle(k as f64 * dt);
    let [angle, pressure]: [Vec<f64>; 2] = [(0..n).map(at).collect(), vec![2e5; n]];
    let rates = [slopes(&angle, dt), vec![0.0; n]];
    let supply = vec![6e5; n];
    let u = vec![5.02; n];
    let predicted = |spec: &RigSpec, names: &[&str]| {
        let rig = compiled(spec.clone());
        let ids: Vec<_> = names.iter().map(|n| rig.parameters().find(n).unwrap()).collect();
        let signals = [
            ("joint_angle", Signal { value: &angle, slope: &rates[0] }),
            ("muscle_pressure", Signal { value: &pressure, slope: &rates[1] }),
            ("supply_pressure", Signal { value: &supply, slope: &rates[1] }),
        ];
        let measured = Measured::new(&rig, n, &[("valve_command", &u)], &signals).unwrap();
        // so short a step that a kink inside one does not show in the differences
        let timing = Timing { sample_time: dt, substeps: 4000 };
        predict(&rig, Block::Chamber(0), &measured, timing, &[0, 50], &ids).unwrap()
    };
    let name = "sensors.angle_zero";
    let exact = predicted(spec, &[name]);
    let size = 1e-4;
    let shifted = |sign: f64| predicted(&nudged(spec, name, sign * size), &[]).value;
    let (up, down, span) = (shifted(1.0), shifted(-1.0), nudge_size(spec, name, size));
    let slope = |k: usize| exact.jacobian[k * exact.columns];
    let scale = (0..n).map(|k| slope(k).abs()).fold(0.0, f64::max);
    for k in 0..n {
        let gap = (slope(k) - (up[k] - down[k]) / (2.0 * span)).abs();
        assert!(gap < 0.02 * scale, "row {k}: {gap} of {scale}");
    }
}

#[test]
fn sensitivities_hold_over_the_kinks_of_a_volume() {
    let rest = spec().joints[0].rest_angle;
    // through the rest length there and back, and down to where the braid is taut
    let swings = |low: f64| move |t: f64| rest + low + 0.06 * (1.0 - (9.0 * t).cos());
    let mut heated = spec();
    let share = [("heat_transfer_coefficient", 60.0), ("initial_temperature_rise", 0.0)];
    heated.effects = vec![effect("heat_transfer", &[share[0], share[1], ("share", 0.4)])];
    let mut warm = spec();
    let gas = &mut warm.chambers[0];
    (gas.gas, gas.heat_transfer_coefficient) = ("energy_balance".into(), 60.0);
    // a flow that follows the rate of the volume
    let mut drawing = spec();
    let terms = EFFECTS.iter().find(|info| info.id == "closure_flow").unwrap().forms[0].parameters;
    let terms: Vec<_> = (terms.iter())
        .map(|term| match term.name {
            "volume_rate" => (term.name, 2e-3),
            "memory_time" => (term.name, 1.0),
            name => (name, 0.0),
        })
        .collect();
    drawing.effects = vec![effect("closure_flow", &terms)];
    for spec in [spec(), heated, warm, drawing] {
        kinked(&spec, swings(-0.04));
        kinked(&spec, swings(-0.1));
    }
}

#[test]
fn commands_within_a_sample_are_held_one_after_the_other() {
    let rig = compiled(spec());
    let (n, dt, each) = (60, 0.01, 5);
    // five commands a sample in the first half, one in the second, where steps may be long again
    let fine: Vec<f64> = (0..n * each)
        .map(|k| if k < 150 { 5.0 + 0.08 * (((k * 7) % 11) as f64 - 5.0) } else { 5.2 })
        .collect();
    let timing = Timing { sample_time: dt / each as f64, substeps: 2 };
    let truth =
        simulate(&rig, n * each, &[("valve_command", &fine)], timing, &start(&rig)).unwrap();
    let names = ["supply_pressure", "muscle_pressure", "joint_angle"];
    let columns = names.map(|name| -> Vec<f64> {
        truth.get(&rig, name).unwrap().iter().step_by(each).copied().collect()
    });
    let rates = columns.each_ref().map(|column| slopes(column, dt));
    let signal = |k: usize| (names[k], Signal { value: &columns[k], slope: &rates[k] });
    let gap = |commands: &[f64], substeps: usize| {
        let commands = [("valve_command", commands)];
        let measured =
            Measured::new(&rig, n, &commands, &[signal(0), signal(1), signal(2)]).unwrap();
        let timing = Timing { sample_time: dt, substeps };
        let found = predict(&rig, Block::Chamber(0), &measured, timing, &[0], &[]).unwrap();
        columns[1].iter().zip(&found.value).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let means: Vec<f64> = fine.chunks(each).map(|c| c.iter().sum::<f64>() / each as f64).collect();
    let (logged, averaged) = (gap(&fine, 1), gap(&means, each));
    assert!(logged < 0.05 * averaged, "{logged} {averaged}");
    let ragged = Measured::new(&rig, n, &[("valve_command", &fine[1..])], &[signal(0)]);
    assert!(matches!(ragged, Err(Error::Length { .. })));
}

#[test]
fn sensitivities_do_not_depend_on_how_many_are_asked_for() {
    let rig = compiled(spec());
    let n = 40;
    let truth = run(&rig, n, 10);
    let channel = |name: &str| truth.get(&rig, name).unwrap();
    let channels = ["supply_pressure", "muscle_pressure", "joint_angle"];
    let rates = channels.map(|name| slopes(channel(name), 0.01));
    let u = command(n);
    let signal = |k: usize| (channels[k], Signal { value: channel(channels[k]), slope: &rates[k] });
    let measured =
        Measured::new(&rig, n, &[("valve_command", &u)], &[signal(0), signal(1), signal(2)])
            .unwrap();
    let timing = Timing { sample_time: 0.01, substeps: 10 };
    let names = rig.parameters().names();
    let all: Vec<_> = names.iter().map(|name| rig.parameters().find(name).unwrap()).collect();
    assert!(all.len() > 8, "as many as a narrow pass takes are no test");
    for block in [Block::Chamber(0), Block::Arm(0)] {
        let several = |ids: &[_]| predict(&rig, block, &measured, timing, &[0, 20], ids).unwrap();
        let together = several(&all);
        for (column, id) in all.iter().enumerate() {
            let alone = several(&[*id]);
            assert_eq!(alone.value, together.value);
            for k in 0..n {
                let (one, other) = (
                    alone.jacobian[k * alone.columns],
                    together.jacobian[k * together.columns + column],
                );
                assert_eq!(one, other, "{} at row {k}", names[column]);
            }
        }
    }
}

fn slot<'a>(spec: &'a mut RigSpec, name: &str) -> &'a mut f64 {
    let (block, key) = name.split_once('.').unwrap();
    if let Some(index) = spec.effects.iter().position(|e| e.id == block) {
        return spec.effects[index].parameters.get_mut(key).unwrap();
    }
    match name {
        "supply.volume" => &mut spec.supplies[0].volume,
        "supply.pressure_zero" => &mut spec.supplies[0].pressure_zero,
        "valve.discharge_area_max" => &mut spec.valves[0].discharge_area_max,
        "valve.fill_conductance" => &mut spec.valves[0].fill_conductance,
        "valve.fill_critical_ratio" => &mut spec.valves[0].fill_critical_ratio,
        "valve.vent_conductance" => &mut spec.valves[0].vent_conductance,
        "valve.vent_critical_ratio" => &mut spec.valves[0].vent_critical_ratio,
        "valve.null_voltage" => &mut spec.valves[0].null_voltage,
        "chamber.dead_volume" => &mut spec.chambers[0].dead_volume,
        "chamber.alpha" => &mut spec.chambers[0].alpha,
        "arm.payload" => &mut spec.arm.as_mut().unwrap().payload,
        "arm.coulomb" => &mut spec.arm.as_mut().unwrap().coulomb,
        "muscle.modulus_scale" => &mut spec.muscles[0].muscle.modulus_scale,
        "muscle.softening" => &mut spec.muscles[0].muscle.softening,
        "muscle.temperature" => &mut spec.muscles[0].muscle.temperature,
        "arm.base_angle" => &mut spec.arm.as_mut().unwrap().base_angle,
        "arm.centre_angle" => &mut spec.arm.as_mut().unwrap().centre_angle,
        "joint.stiffness" => &mut spec.joints[0].stiffness,
        "joint.spring_angle" => &mut spec.joints[0].spring_angle,
        "sensors.angle_zero" => &mut spec.sensors[0].angle_zero,
        _ => &mut spec.sensors[0].pressure_zero,
    }
}

fn nudge_size(spec: &RigSpec, name: &str, relative: f64) -> f64 {
    let value = *slot(&mut spec.clone(), name);
    if value == 0.0 {
        if name.ends_with("pressure_zero") {
            10.0
        } else {
            1e-5
        }
    } else {
        value * relative
    }
}

fn nudged(spec: &RigSpec, name: &str, signed: f64) -> RigSpec {
    let mut out = spec.clone();
    *slot(&mut out, name) += nudge_size(spec, name, signed.abs()) * signed.signum();
    out
}

#[test]
fn bad_input_is_a_typed_error() {
    let rig = compiled(spec());
    let timing = Timing::new(0.005, 1e-3).unwrap();
    let initial = Initial::rest(&rig);
    let named = |e: Error, name: &str| assert!(e.to_string().contains(name), "{e}");
    let run = |command: &[f64]| {
        simulate(&rig, command.len(), &[("valve_command", command)], timing, &initial).unwrap_err()
    };
    named(run(&[5.0, f64::NAN]), "valve_command[1]");
    named(simulate(&rig, 2, &[], timing, &initial).unwrap_err(), "valve_command is missing");
    named(
        initial.clone().with(&rig, "muscle_pressure", -2e5).unwrap_err(),
        "initial.muscle_pressure",
    );
    named(initial.clone().with(&rig, "muscle_colour", 1.0).unwrap_err(), "muscle_colour");
    named(Timing::new(0.005, 3e-3).unwrap_err(), "step");
    named(Timing::new(f64::NAN, 1e-3).unwrap_err(), "sample_time");
    let mut bad = spec();
    bad.arm.as_mut().unwrap().payload = f64::INFINITY;
    named(Rig::new(bad).unwrap_err(), "arm.payload");
    let mut unknown = spec();
    unknown.effects = vec![effect("phlogiston", &[])];
    named(Rig::new(unknown).unwrap_err(), "phlogiston");
    let mut short = spec();
    short.joints[0].transmission.as_mut().unwrap().lower_axial = 0.15;
    assert!(
        Rig::new(short).is_err_and(|e| e.to_string().contains("joint.")),
        "the muscle cannot shorten so far"
    );
    named(RigSpec::from_json("{}").unwrap_err(), "rig description");
}
