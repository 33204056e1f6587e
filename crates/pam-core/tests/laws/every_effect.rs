//! Laws of every effect: off it changes nothing, its sensitivities are those of differences, a
//! restart is bit for bit, one block can be named, and every kind of rig takes it.

use super::rigs::{
    antagonists, compiled, effect, effect_at, every, fitting, lone_tank, rig_for, shoulder,
    two_joints, with_struts, Typical, FORMS, TYPICAL,
};
use pam_core::cut_chain::{predict, Block};
use pam_core::cut_chain::{Measured, Signal};
use pam_core::description::EffectSpec;
use pam_core::effects::EFFECTS;
use pam_core::simulate::drive::Drive;
use pam_core::simulate::{Initial, Progress, Timing, Trajectory};
use pam_core::{Rig, RigSpec};

const DT: f64 = 0.01;
const TIMING: Timing = Timing { sample_time: DT, substeps: 10 };
const ROWS: usize = 80;

/// A command with edges, and one that goes up and down, for each valve; a set pressure for each
/// regulator.
fn signals(rig: &Rig, rows: usize) -> Vec<(String, Vec<f64>)> {
    let valve = |k: usize| {
        let t = k as f64 * DT;
        let edge = if (k / 16).is_multiple_of(2) { 0.12 } else { -0.2 };
        5.15 + edge + 0.35 * (9.0 * t).sin()
    };
    let pressure = |k: usize| if (k / 25).is_multiple_of(2) { 6.0e5 } else { 6.6e5 };
    let values = |name: &str| -> Vec<f64> {
        (0..rows).map(|k| if name.starts_with("valve") { valve(k) } else { pressure(k) }).collect()
    };
    rig.names().inputs.iter().map(|name| (name.clone(), values(name))).collect()
}

fn initial(rig: &Rig) -> Initial {
    let mut start = Initial::rest(rig);
    for (name, _) in &rig.names().initial {
        let value = match name.split('.').next() {
            Some("muscle_pressure") if name.ends_with("extensor") => 1.4e5,
            Some("muscle_pressure") => 2e5,
            Some("joint_angle") if rig.spec().chambers.len() == 1 => 0.9,
            Some("joint_angle") if rig.names().coordinates.len() == 2 => 0.5,
            _ => continue,
        };
        start = start.with(rig, name, value).unwrap();
    }
    start
}

fn borrowed(signals: &[(String, Vec<f64>)]) -> Vec<(&str, &[f64])> {
    signals.iter().map(|(name, values)| (name.as_str(), values.as_slice())).collect()
}

fn run(rig: &Rig, rows: usize) -> Trajectory {
    let signals = signals(rig, rows);
    pam_core::simulate::simulate(
        rig,
        rows,
        &borrowed(&signals),
        TIMING.stable(rig).unwrap(),
        &initial(rig),
    )
    .unwrap()
}

/// Whether a rig has no supply of the kind that an effect acts on.
fn lacks_supply(id: &str, spec: &RigSpec) -> bool {
    let kinds = EFFECTS.iter().find(|e| e.id == id).unwrap().supplies;
    !kinds.is_empty() && spec.supplies.iter().all(|s| !kinds.contains(&s.kind.as_str()))
}

fn with(spec: RigSpec, effects: Vec<EffectSpec>) -> Rig {
    compiled(RigSpec { effects, ..spec })
}

#[test]
fn every_effect_is_tested() {
    let others = ["heat_transfer"]; // it replaces an equation and has no neutral value
    for info in EFFECTS.iter().filter(|e| !others.contains(&e.id)) {
        for (k, form) in info.forms.iter().enumerate() {
            let name = if k == 0 { "" } else { form.name };
            let typical = (every().find(|t| (t.id, t.form) == (info.id, name)))
                .unwrap_or_else(|| panic!("{} {name}", info.id));
            let names = form.parameters.iter().map(|p| p.name);
            assert!(names.eq(typical.parameters.iter().map(|(n, _)| *n)), "{} {name}", info.id);
        }
    }
}

#[test]
fn switched_off_it_changes_nothing_bit_for_bit() {
    for typical in every() {
        let fitted = [antagonists(), two_joints()].map(|spec| fitting(typical.id, spec));
        for spec in [rig_for(typical.id)].into_iter().chain(fitted) {
            if lacks_supply(typical.id, &spec) {
                continue;
            }
            let (plain, off) =
                (with(spec.clone(), vec![]), with(spec.clone(), vec![typical.off()]));
            let (a, b) = (run(&plain, ROWS), run(&off, ROWS));
            for (k, (name, _)) in plain.names().channels.iter().enumerate() {
                assert!(a.channels[k] == b.channels[k], "{}: {name} of {}", typical.id, spec.name);
            }
        }
    }
}

#[test]
fn switched_on_it_moves_its_channel() {
    for typical in every() {
        let spec = rig_for(typical.id);
        let (plain, on) = (with(spec.clone(), vec![]), with(spec, vec![typical.on()]));
        let (a, b) = (run(&plain, ROWS), run(&on, ROWS));
        let name = match EFFECTS.iter().find(|e| e.id == typical.id).map(|e| e.block) {
            _ if ["encoder_error", "sensor_lag"].contains(&typical.id) => "joint_angle",
            _ if typical.id == "thermometer_lag" => "temperature",
            _ if typical.id == "load_cell_drift" => "joint_torque",
            Some("supply") => "supply_pressure",
            Some("valve" | "line" | "chamber" | "sensors") => "muscle_pressure",
            _ => "joint_angle",
        };
        let pairs = || a.get(&plain, name).unwrap().iter().zip(b.get(&on, name).unwrap());
        let moved = pairs().map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
        let size = pairs().map(|(x, _)| x.abs()).fold(0.0, f64::max);
        assert!(moved > 1e-4 * size, "{}: {name} by {moved} of {size}", typical.id);
    }
}

#[test]
fn rigs_of_several_blocks_take_it_everywhere_or_at_one_of_them() {
    for typical in every().filter(|t| !t.id.starts_with("supply_regulator")) {
        let info = EFFECTS.iter().find(|e| e.id == typical.id).unwrap();
        for (spec, names) in
            [(antagonists(), ["flexor", "extensor"]), (two_joints(), ["elbow", "wrist"])]
        {
            let spec = fitting(typical.id, with_struts(spec));
            let two = match info.at {
                "joint" => spec.joints.len() == 2,
                at => ["valve", "chamber", "muscle"].contains(&at),
            };
            let all = run(&with(spec.clone(), vec![typical.on()]), ROWS);
            if !two {
                continue;
            }
            let at = |name: &str| {
                run(&with(spec.clone(), vec![EffectSpec { at: name.into(), ..typical.on() }]), ROWS)
            };
            let (first, second) = (at(names[0]), at(names[1]));
            assert!(first.channels != second.channels, "{}: the same at either", typical.id);
            // alone it acts at the tip
            let tip = ["payload_swing", "payload_change"].contains(&typical.id);
            assert_eq!(all.channels == second.channels, tip, "{}", typical.id);
            let wrong = EffectSpec { at: "nose".into(), ..typical.on() };
            let wrong = RigSpec { effects: vec![wrong], ..spec };
            assert!(Rig::new(wrong).unwrap_err().to_string().contains("nose"));
        }
    }
}

#[test]
fn one_block_alone_changes() {
    let spec = antagonists();
    let on = with(
        spec.clone(),
        vec![effect_at("leak_muscle", "flexor", &[("conductance", 1e-9), ("laminar_share", 0.0)])],
    );
    let lag =
        with(spec.clone(), vec![effect_at("pressure_lag", "flexor", &[("time_constant", 0.02)])]);
    let plain = with(spec, vec![]);
    let (a, b, c) = (run(&plain, 5), run(&on, 5), run(&lag, 60));
    let get = |rig: &Rig, t: &Trajectory, name: &str| t.get(rig, name).unwrap().to_vec();
    assert!(get(&plain, &a, "muscle_pressure.flexor") != get(&on, &b, "muscle_pressure.flexor"));
    let long = run(&plain, 60);
    assert_eq!(
        get(&plain, &long, "muscle_pressure.extensor"),
        get(&lag, &c, "muscle_pressure.extensor")
    );
    assert_eq!(get(&plain, &long, "joint_angle"), get(&lag, &c, "joint_angle"));
    assert!(
        get(&plain, &long, "muscle_pressure.flexor") != get(&lag, &c, "muscle_pressure.flexor")
    );
}

#[test]
fn a_restart_is_bit_for_bit_with_every_effect_on() {
    // a valve has a hose or a silencer
    let (alone, others): (Vec<_>, Vec<_>) =
        TYPICAL.iter().partition(|typical| typical.id == "exhaust_back_pressure");
    let all = others.into_iter().filter(|typical| !lacks_supply(typical.id, &shoulder()));
    restarts(&with(fitting("line_flow_law", shoulder()), all.map(Typical::on).collect()));
    for typical in alone.into_iter().chain(FORMS) {
        restarts(&with(rig_for(typical.id), vec![typical.on()]));
    }
}

fn restarts(rig: &Rig) {
    let signals = signals(rig, ROWS);
    let drive = Drive::new(rig, ROWS, &borrowed(&signals)).unwrap();
    let mut whole = Progress::start(rig, &initial(rig)).unwrap();
    let mut first = whole.clone();
    let mut out = Trajectory::new(rig, ROWS);
    whole.advance(rig, TIMING, &drive, &mut out).unwrap();
    let mut parts = Trajectory::new(rig, ROWS);
    for range in [0..33, 33..34, 34..ROWS] {
        let fresh = Progress::start(rig, &initial(rig)).unwrap();
        first = fresh.restored(rig, &first.to_vec()).unwrap();
        first.advance(rig, TIMING, &drive.part(range), &mut parts).unwrap();
    }
    assert_eq!(whole, first);
    assert_eq!(out, parts);
    let mut short = whole.to_vec();
    short.pop();
    short.pop();
    short.truncate(10);
    assert!(whole.restored(rig, &short).is_err());
}

/// Values and slopes of a channel by central differences.
fn slopes(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    (0..n)
        .map(|k| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
            (values[b] - values[a]) / ((b - a) as f64 * DT)
        })
        .collect()
}

fn sensitivities(
    typical: &Typical,
    spec: &RigSpec,
    truth: &Trajectory,
    block: &str,
    blind: &[&str],
) {
    let rig = with(spec.clone(), vec![typical.on()]);
    let inputs = signals(&rig, ROWS);
    let channels: Vec<_> = (rig.names().channels.iter())
        .map(|(name, _)| name.as_str())
        .filter(|n| {
            ["supply_pressure", "muscle_pressure", "joint_angle"]
                .contains(&n.split('.').next().unwrap())
        })
        .collect();
    let rates: Vec<_> = channels.iter().map(|n| slopes(truth.get(&rig, n).unwrap())).collect();
    let measured: Vec<_> = (channels.iter().zip(&rates))
        .map(|(n, slope)| (*n, Signal { value: truth.get(&rig, n).unwrap(), slope }))
        .collect();
    let measured = Measured::new(&rig, ROWS, &borrowed(&inputs), &measured).unwrap();
    let names: Vec<_> =
        typical.parameters.iter().map(|(n, _)| format!("{}.{n}", typical.id)).collect();
    let ids: Vec<_> = names.iter().map(|n| rig.parameters().find(n).unwrap()).collect();
    let predicted = |rig: &Rig, ids: &[_]| {
        predict(
            rig,
            Block::from_name(rig, block).unwrap(),
            &measured,
            TIMING.stable(rig).unwrap(),
            &[0, 40],
            ids,
        )
        .unwrap_or_else(|e| panic!("{}: {e}", typical.id))
    };
    let exact = predicted(&rig, &ids);
    for (column, (name, value)) in typical.parameters.iter().enumerate() {
        // Small enough for no edge of the relay to jump over a step, large enough for rounding.
        let h = if *value == 0.0 { 1e-6 } else { 1e-5 * value.abs() };
        let shifted = |by: f64| {
            let mut effect = typical.on();
            *effect.parameters.get_mut(*name).unwrap() += by;
            predicted(&with(spec.clone(), vec![effect]), &[]).value
        };
        let (up, down) = (shifted(h), shifted(-h));
        let slope = |k: usize| exact.jacobian[k * exact.columns + column];
        let scale = (0..ROWS).map(|k| slope(k).abs()).fold(0.0, f64::max);
        assert_eq!(
            scale > 0.0,
            !blind.contains(name),
            "{} {}.{name} has influence {scale}",
            typical.id,
            typical.form
        );
        for k in 0..ROWS {
            let gap = (slope(k) - (up[k] - down[k]) / (2.0 * h)).abs();
            assert!(
                gap <= 2e-3 * scale,
                "{} {}.{name} in {block} at row {k}: {gap} of {scale}",
                typical.id,
                typical.form
            );
        }
    }
}

/// Parameters without an influence: the compressor's cut-out is not reached, a stop's side and a
/// tap are one or the other.
fn blind(id: &str) -> &'static [&'static str] {
    match id {
        "compressor_cut_in" => &["cut_out_pressure"],
        "joint_end_stop" => &["side"],
        "tube_flow_restriction" => &["tap"],
        _ => &[],
    }
}

#[test]
fn sensitivities_are_those_of_differences() {
    for typical in every() {
        let info = EFFECTS.iter().find(|e| e.id == typical.id).unwrap();
        let spec = rig_for(typical.id);
        let truth = run(&with(spec.clone(), vec![typical.on()]), ROWS);
        let block = match info.block {
            "supply" => "supply",
            _ if typical.id == "thermometer_lag" => "temperature",
            _ if typical.id == "gauge_drift" => "arm",
            _ if typical.id == "load_cell_drift" => "torque",
            "valve" | "line" | "chamber" | "sensors" => "chamber",
            _ => "arm",
        };
        let blind = blind(typical.id);
        sensitivities(typical, &spec, &truth, block, blind);
        if ["pressure_lag", "encoder_error", "sensor_lag"].contains(&typical.id) {
            sensitivities(typical, &spec, &truth, "arm", &[]);
        }
        if info.block == "valve" {
            // what only a venting valve has is nothing to its supply
            let venting = match typical.id {
                "exhaust_back_pressure" => "conductance",
                _ => "half_width_venting",
            };
            sensitivities(typical, &spec, &truth, "supply", &[venting]);
        }
    }
}

/// A tube behind the transducer, close to the valve's own conductance.
const TAPPED: Typical = Typical {
    id: "tube_flow_restriction",
    form: "",
    parameters: &[("conductance", 1.5e-9), ("tap", 0.75)],
    neutral: &[("conductance", 1.0)],
};

#[test]
fn sensitivities_to_a_tube_behind_the_transducer() {
    // Of the supply, the flow is told by the valve alone: no tube changes what it predicts.
    for (spec, blocks) in
        [(shoulder(), ["chamber", "arm"]), (two_joints(), ["chamber.elbow", "arm.wrist"])]
    {
        let truth = run(&with(spec.clone(), vec![TAPPED.on()]), ROWS);
        for block in blocks {
            sensitivities(&TAPPED, &spec, &truth, block, &["tap"]);
        }
    }
}

#[test]
fn predictions_repeat_what_a_transducer_at_the_valve_reads() {
    // wide enough for no flow to be choked in it: such a flow tells nothing of the muscle
    let wide = effect("tube_flow_restriction", &[("conductance", 6e-9), ("tap", 1.0)]);
    let rig = with(shoulder(), vec![wide]);
    let wrong = with(shoulder(), vec![]);
    let truth = run(&rig, ROWS);
    let inputs = signals(&rig, ROWS);
    let names = ["supply_pressure", "muscle_pressure", "joint_angle"];
    let rates = names.map(|n| slopes(truth.get(&rig, n).unwrap()));
    let gap = |rig: &Rig, block: &str, name: &str, known: &[usize]| {
        let signal = |k: &usize| {
            (names[*k], Signal { value: truth.get(rig, names[*k]).unwrap(), slope: &rates[*k] })
        };
        let signals: Vec<_> = known.iter().map(signal).collect();
        let measured = Measured::new(rig, ROWS, &borrowed(&inputs), &signals).unwrap();
        let block = Block::from_name(rig, block).unwrap();
        let found =
            predict(rig, block, &measured, TIMING.stable(rig).unwrap(), &[0], &[]).unwrap().value;
        let was = truth.get(rig, name).unwrap();
        let span = was.iter().copied().fold(f64::MIN, f64::max)
            - was.iter().copied().fold(f64::MAX, f64::min);
        found.iter().zip(was).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / span
    };
    for (block, name) in [("supply", names[0]), ("chamber", names[1]), ("arm", names[2])] {
        let (with, without) =
            (gap(&rig, block, name, &[0, 1, 2]), gap(&wrong, block, name, &[0, 1, 2]));
        assert!(
            with < 0.05 && (with < 0.02 * without || block != "arm"),
            "{block}: {with} {without}"
        );
    }
    // what is not known of the valve's other side, is not told of the muscle's
    assert_eq!(gap(&rig, "arm", names[2], &[1, 2]), gap(&wrong, "arm", names[2], &[1, 2]));
}

#[test]
fn sensitivities_hold_on_two_joints() {
    for typical in every() {
        let info = EFFECTS.iter().find(|e| e.id == typical.id).unwrap();
        let spec = fitting(typical.id, two_joints());
        if ["supply", "sensors"].contains(&info.block) {
            continue;
        }
        let truth = run(&with(spec.clone(), vec![typical.on()]), ROWS);
        let arm = !["valve", "line", "chamber"].contains(&info.block);
        sensitivities(
            typical,
            &spec,
            &truth,
            if arm { "arm.wrist" } else { "chamber.elbow" },
            blind(typical.id),
        );
    }
}

#[test]
fn predictions_repeat_what_was_simulated() {
    // Measured without noise, cut anywhere, a block predicts what the whole rig did: to the error
    // of the signals' slopes.
    for typical in every() {
        let rig = with(rig_for(typical.id), vec![typical.on()]);
        let truth = run(&rig, ROWS);
        let inputs = signals(&rig, ROWS);
        let names = ["supply_pressure", "muscle_pressure", "joint_angle"];
        let rates = names.map(|n| slopes(truth.get(&rig, n).unwrap()));
        let signal = |k: usize| {
            (names[k], Signal { value: truth.get(&rig, names[k]).unwrap(), slope: &rates[k] })
        };
        let measured = [signal(0), signal(1), signal(2)];
        let measured = Measured::new(&rig, ROWS, &borrowed(&inputs), &measured).unwrap();
        for (block, name) in [("supply", names[0]), ("chamber", names[1]), ("arm", names[2])] {
            let block = Block::from_name(&rig, block).unwrap();
            let found = predict(&rig, block, &measured, TIMING, &[0], &[]).unwrap().value;
            let was = truth.get(&rig, name).unwrap();
            let span = was.iter().copied().fold(f64::MIN, f64::max)
                - was.iter().copied().fold(f64::MAX, f64::min);
            let gap = found.iter().zip(was).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(
                gap < 0.05 * span,
                "{} {}: {name} differs by {gap} of {span}",
                typical.id,
                typical.form
            );
        }
    }
}

#[test]
fn a_clock_ahead_is_read_from_a_recording() {
    // Both pressures were logged three samples early, or late; angle and command were not.
    let free = compiled(shoulder());
    let truth = run(&free, ROWS);
    let inputs = signals(&free, ROWS);
    let names = ["supply_pressure", "muscle_pressure", "joint_angle"];
    for late in [-3_i64, 3] {
        let moved = |name: &str| -> Vec<f64> {
            let by = if name == "joint_angle" { 0 } else { late };
            let was = truth.get(&free, name).unwrap();
            (0..ROWS as i64).map(|k| was[(k - by).clamp(0, ROWS as i64 - 1) as usize]).collect()
        };
        let values = names.map(moved);
        let rates = values.each_ref().map(|v| slopes(v));
        let signal = |k: usize| (names[k], Signal { value: &values[k], slope: &rates[k] });
        let all = [signal(0), signal(1), signal(2)];
        let offset = late as f64 * TIMING.sample_time;
        let clock =
            effect_at("clock_skew", "", &[("offset", offset), ("rate", 0.0), ("angle_share", 0.0)]);
        let gaps = |rig: &Rig, name: &str, k: usize| {
            let measured = Measured::new(rig, ROWS, &borrowed(&inputs), &all).unwrap();
            let block = Block::from_name(rig, name).unwrap();
            let found = predict(rig, block, &measured, TIMING, &[0, 4], &[]).unwrap().value;
            // the ends, which were not recorded, apart
            (4..ROWS - 4).map(|i| (found[i] - values[k][i]).powi(2)).sum::<f64>().sqrt()
        };
        let skewed = with(shoulder(), vec![clock]);
        for (name, k) in [("chamber", 1), ("arm", 2)] {
            let (with_clock, without) = (gaps(&skewed, name, k), gaps(&free, name, k));
            assert!(with_clock < 0.2 * without, "{name} {late}: {with_clock} {without}");
        }
    }
}

#[test]
fn late_pressures_do_not_move_the_arm() {
    let free = run(&compiled(shoulder()), ROWS);
    let dt = TIMING.sample_time;
    let clock = [("offset", 2.25 * dt), ("rate", 0.0), ("angle_share", 0.0)];
    let rig = with(shoulder(), vec![effect_at("clock_skew", "", &clock)]);
    let late = run(&rig, ROWS);
    assert_eq!(free.get(&rig, "joint_angle"), late.get(&rig, "joint_angle"));
    for name in ["muscle_pressure", "supply_pressure"] {
        let (was, seen) = (free.get(&rig, name).unwrap(), late.get(&rig, name).unwrap());
        assert_eq!(seen[0], was[0]);
        for k in 3..ROWS {
            let expected = was[k - 2] + 0.25 * (was[k - 3] - was[k - 2]);
            assert!((seen[k] - expected).abs() <= 1e-9 * was[0].abs().max(1e5), "{name} {k}");
        }
    }
}

#[test]
fn impossible_effects_are_refused_by_name() {
    let refused = |spec: RigSpec, id: &str, parameters: &[(&str, f64)], word: &str| {
        let effects = vec![effect_at(id, "", parameters)];
        let text = Rig::new(RigSpec { effects, ..spec }).unwrap_err().to_string();
        assert!(text.contains(id) && text.contains(word), "{text}");
    };
    refused(shoulder(), "valve_dead_zone", &[("half_width", 0.95)], "half_width");
    refused(shoulder(), "valve_dead_zone", &[("width", 0.01)], "half_width");
    refused(shoulder(), "valve_dead_zone", &[("half_width", 0.01), ("width", 0.01)], "width");
    refused(shoulder(), "payload_change", &[("mass_change", -90.0), ("time", 0.0)], "mass_change");
    for (id, block) in [
        ("valve_dead_zone", "valve"),
        ("muscle_creep", "muscle"),
        ("joint_end_stop", "joint"),
        ("payload_swing", "arm"),
        ("payload_change", "joint"),
        ("base_flexibility", "arm"),
    ] {
        let typical = TYPICAL.iter().find(|t| t.id == id).unwrap();
        refused(lone_tank(), id, typical.parameters, block);
    }
    refused(shoulder(), "supply_regulator_deadband", &[("dead_band", 1e4)], "regulator");
    let rate = effect_at(
        "base_flexibility",
        "joint",
        &[("compliance", 0.0), ("natural_frequency", 8.0), ("damping_ratio", 0.0)],
    );
    let text = Rig::new(RigSpec { effects: vec![rate], ..shoulder() }).unwrap_err().to_string();
    assert!(text.contains("whole rig"), "{text}");
}
