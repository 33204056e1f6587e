//! Laws of tubes that hold gas and carry waves: how fast, what is conserved, what they pass, at
//! which frequency they ring; sensitivities, restart, stability, and what is refused.

use pam_core::blocks::tube::Tube;
use pam_core::cut_chain::{predict, Block, Measured, Signal};
use pam_core::description::{ChamberSpec, LineSpec};
use pam_core::plant::Side;
use pam_core::simulate::{drive::Drive, simulate, Initial, Progress, Timing, Trajectory};
use pam_core::{Rig, RigSpec};
use std::f64::consts::PI;

use super::rigs::{compiled, shoulder};

const RT: f64 = 287.05 * 293.15;
const AMBIENT: f64 = 101_325.0;

fn chamber(name: &str, volume: f64, pressure: f64) -> ChamberSpec {
    ChamberSpec {
        name: name.into(),
        dead_volume: volume,
        initial_pressure: pressure,
        gas: "coefficients".into(),
        heat_transfer_coefficient: 0.0,
        alpha_in: 1.0,
        alpha_out: 1.0,
        alpha: 1.0,
    }
}

fn tube(from: &str, to: &str, length: f64, segments: usize) -> LineSpec {
    LineSpec {
        name: String::new(),
        kind: "tube".into(),
        from: from.into(),
        to: to.into(),
        length,
        diameter: 0.004,
        discharge_area: 0.0,
        inlet_volume: 0.0,
        pressure_zero: 0.0,
        segments,
        alpha: 1.4,
    }
}

/// Nothing but chambers and lines.
fn gas(chambers: Vec<ChamberSpec>, lines: Vec<LineSpec>) -> RigSpec {
    let mut spec = shoulder();
    spec.arm = None;
    (spec.supplies, spec.valves, spec.muscles, spec.joints) = (vec![], vec![], vec![], vec![]);
    (spec.chambers, spec.lines) = (chambers, lines);
    spec
}

/// The shoulder, its valve at the beginning of a tube.
fn fed(length: f64, segments: usize) -> RigSpec {
    let mut spec = shoulder();
    spec.lines = vec![tube("", "chamber", length, segments)];
    spec.valves[0].to = "line".into();
    spec
}

fn wave(rows: usize) -> Vec<f64> {
    (0..rows).map(|k| 5.0 + 4.0 * (k as f64 * 0.11).sin()).collect()
}

fn run(
    rig: &Rig,
    rows: usize,
    signals: &[(&str, &[f64])],
    sample_time: f64,
    initial: &Initial,
) -> Trajectory {
    let timing = Timing::new(sample_time, sample_time).unwrap().stable(rig).unwrap();
    simulate(rig, rows, signals, timing, initial).unwrap()
}

fn last(rig: &Rig, run: &Trajectory, name: &str) -> f64 {
    *run.get(rig, name).unwrap().last().unwrap()
}

/// All gas that is in no supply.
fn stored(rig: &Rig, run: &Trajectory, row: usize) -> f64 {
    let masses = ["air_mass", "line_mass", "segment_mass"];
    let names = rig.names().channels.iter().map(|(name, _)| name);
    names
        .filter(|name| masses.iter().any(|mass| name.starts_with(mass)))
        .map(|name| run.get(rig, name).unwrap()[row])
        .sum()
}

/// Supplied less vented less stored, relative to what is there.
fn imbalance(rig: &Rig, run: &Trajectory) -> f64 {
    let rows = run.channels[0].len();
    let (supplied, vented) = (last(rig, run, "mass_supplied"), last(rig, run, "mass_vented"));
    let more = stored(rig, run, rows - 1) - stored(rig, run, 0);
    (supplied - vented - more).abs() / (supplied.abs() + vented.abs() + stored(rig, run, 0))
}

/// When the closed end of a tube has risen half as far as it will, after a small step at the other
/// end [s].
fn arrival(length: f64, segments: usize, alpha: f64) -> f64 {
    let mut line = tube("chamber.a", "chamber.b", length, segments);
    line.alpha = alpha;
    let rig = Rig::new(gas(vec![chamber("a", 10.0, 3e5), chamber("b", 1e-9, 3e5)], vec![line]));
    let rig = rig.unwrap();
    let initial = Initial::rest(&rig).with(&rig, "muscle_pressure.a", 3.01e5).unwrap();
    let dt = 1e-4;
    let out = run(&rig, (2.0 * length / 290.0 / dt) as usize, &[], dt, &initial);
    let far = out.get(&rig, "muscle_pressure.b").unwrap();
    // it is reflected there, and rises twice as far as the step
    let k = far.iter().position(|p| *p > 3.01e5).unwrap();
    (k as f64 - (far[k] - 3.01e5) / (far[k] - far[k - 1])) * dt
}

#[test]
fn a_step_arrives_after_the_length_over_the_speed_of_sound() {
    for (length, alpha) in [(8.0, 1.4), (8.0, 1.0), (2.0, 1.4)] {
        let exact = length / (alpha * RT).sqrt();
        let missed = |segments| arrival(length, segments, alpha) / exact - 1.0;
        let errors = [4, 8, 16, 32, 64].map(missed);
        assert!(errors.windows(2).all(|e| e[1].abs() < e[0].abs()), "{errors:?}");
        assert!(errors[2].abs() < 0.06 && errors[4].abs() < 0.025, "{errors:?}");
    }
}

#[test]
fn a_closed_tube_rings_at_a_quarter_wave() {
    let (length, segments) = (2.0, 24);
    let line = tube("chamber.a", "chamber.b", length, segments);
    // the half segment at an end is gas of the chamber there
    let mut end = chamber("b", 1e-9, 5e5);
    (end.alpha_in, end.alpha_out) = (1.4, 1.4);
    let rig = compiled(gas(vec![chamber("a", 10.0, 5e5), end], vec![line]));
    let quarter = (1.4 * RT).sqrt() / (4.0 * length);
    // its shape, as a standing wave
    let mut initial = Initial::rest(&rig);
    for k in 1..=segments {
        let name = if k == segments {
            "muscle_pressure.b".into()
        } else {
            format!("segment_pressure.{k}")
        };
        let high = 200.0 * (PI * k as f64 / (2.0 * segments as f64)).sin();
        initial = initial.with(&rig, &name, 5e5 + high).unwrap();
    }
    let dt = 1e-4;
    let out = run(&rig, 1000, &[], dt, &initial);
    let far = out.get(&rig, "muscle_pressure.b").unwrap();
    let crossings: Vec<f64> = (1..far.len())
        .filter(|k| (far[k - 1] - 5e5) * (far[*k] - 5e5) < 0.0)
        .map(|k| (k as f64 - (far[k] - 5e5) / (far[k] - far[k - 1])) * dt)
        .collect();
    let (first, count) = (crossings[0], crossings.len() - 1);
    let found = count as f64 / (2.0 * (crossings[count] - first));
    assert!(count > 5 && (found / quarter - 1.0).abs() < 2e-3, "{found} Hz, {quarter} Hz");

    // and what makes it in the linear model
    let model = Progress::start(&rig, &Initial::rest(&rig)).unwrap();
    let model = model.linearised(&rig, Side::Mean).unwrap();
    let n = model.states.len();
    let place = |name: &str| model.states.iter().position(|state| state == name).unwrap();
    let (p, m) = (place("segment_pressure.5"), place("segment_flow.5"));
    let product = -model.a[p * n + m] * model.a[m * n + p];
    let speed = (1.4 * RT).sqrt() * segments as f64 / length;
    assert!((product / speed.powi(2) - 1.0).abs() < 1e-6, "inertia and capacity make the speed");
    assert!(model.a[m * n + m] < 0.0, "friction");
}

#[test]
fn a_steady_flow_is_that_of_a_tube_without_waves_whatever_the_segments() {
    for (length, from, diameter) in
        [(1.0, 6e5, 0.004), (8.0, 6e5, 0.004), (8.0, 3e4, 0.004), (3.0, 2e5, 0.008)]
    {
        let flow = |segments: usize| {
            let line = LineSpec { diameter, ..tube("chamber.a", "ambient", length, segments) };
            let rig = compiled(gas(vec![chamber("a", 1e3, from)], vec![line]));
            let out = run(&rig, 2000, &[], 1e-3, &Initial::rest(&rig));
            assert!(imbalance(&rig, &out) < 1e-12);
            (last(&rig, &out, "mass_vented") - out.get(&rig, "mass_vented").unwrap()[1000]) / 0.999
        };
        let usual = Tube::new(length, diameter, 293.15).mass_flow(from + AMBIENT, AMBIENT);
        assert!((flow(0) / usual - 1.0).abs() < 1e-3);
        let found = [1, 3, 12].map(flow);
        assert!(found.iter().all(|m| (m / usual - 1.0).abs() < 0.01), "{found:?} {usual}");
        assert!(found.iter().all(|m| (m / found[0] - 1.0).abs() < 1e-3), "{found:?}");
    }
}

#[test]
fn mass_stays_and_two_chambers_come_to_one_pressure() {
    let line = LineSpec { alpha: 1.0, ..tube("chamber.a", "chamber.b", 2.0, 8) };
    let rig = Rig::new(gas(vec![chamber("a", 1e-4, 5e5), chamber("b", 3e-4, 0.0)], vec![line]));
    let rig = rig.unwrap();
    let out = run(&rig, 400, &[], 0.01, &Initial::rest(&rig));
    assert!(imbalance(&rig, &out) < 1e-13, "{}", imbalance(&rig, &out));
    let end = stored(&rig, &out, 0) * RT / (4e-4 + PI * 0.002 * 0.002 * 2.0) - AMBIENT;
    for name in ["muscle_pressure.a", "segment_pressure.4", "muscle_pressure.b"] {
        assert!((last(&rig, &out, name) / end - 1.0).abs() < 1e-9, "{name}");
    }
    assert!(last(&rig, &out, "segment_flow.3").abs() < 1e-9);

    let rig = compiled(fed(3.0, 6));
    let u = wave(300);
    let out = run(&rig, 300, &[("valve_command", &u)], 0.005, &Initial::rest(&rig));
    assert!(last(&rig, &out, "mass_vented") > 1e-4, "it breathes");
    assert!(imbalance(&rig, &out) < 1e-12, "{}", imbalance(&rig, &out));

    // also beside chambers with an energy balance, whose flows have temperatures
    let mut warm = fed(3.0, 6);
    warm.chambers[0].gas = "energy_balance".into();
    warm.chambers[0].heat_transfer_coefficient = 50.0;
    let rig = compiled(warm);
    let out = run(&rig, 300, &[("valve_command", &u)], 0.005, &Initial::rest(&rig));
    assert!(imbalance(&rig, &out) < 1e-12, "{}", imbalance(&rig, &out));
    let energy = |row: usize| {
        let at = |name: &str| out.get(&rig, name).unwrap()[row];
        (at("muscle_pressure") + AMBIENT) * at("air_volume") / 0.4 + at("gas_work")
            - at("enthalpy_gained")
            - at("heat_gained")
    };
    assert!((energy(299) / energy(0) - 1.0).abs() < 1e-4, "{} {}", energy(0), energy(299));
}

#[test]
fn any_tube_is_stable_at_its_own_step_and_accurate() {
    for (length, segments, diameter, inlet_volume) in
        [(0.5, 3, 0.006, 0.0), (1.0, 8, 0.008, 0.0), (8.0, 1, 0.004, 5e-6), (30.0, 24, 0.004, 0.0)]
    {
        let mut spec = fed(length, segments);
        (spec.lines[0].diameter, spec.lines[0].inlet_volume) = (diameter, inlet_volume);
        let rig = compiled(spec);
        // thrown open and shut: fills at full opening, vents at full opening
        let u: Vec<f64> = (0..40).map(|k| if k / 10 % 2 == 0 { 10.0 } else { 0.0 }).collect();
        let at = |timing: Timing| {
            let rest = Initial::rest(&rig);
            simulate(&rig, 40, &[("valve_command", &u)], timing, &rest).unwrap()
        };
        let own = Timing::new(0.01, 0.01).unwrap().stable(&rig).unwrap();
        let finer = Timing { substeps: 4 * own.substeps, ..own };
        let (coarse, fine) = (at(own), at(finer));
        for name in ["line_pressure", "muscle_pressure", "joint_angle"] {
            let (a, b) = (coarse.get(&rig, name).unwrap(), fine.get(&rig, name).unwrap());
            let range = b.iter().copied().fold(f64::MIN, f64::max)
                - b.iter().copied().fold(f64::MAX, f64::min);
            let worst = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 2e-2 * range, "{length} {segments} {name}: {worst} of {range}");
        }
    }
}

#[test]
fn a_run_goes_on_from_its_numbers_bit_for_bit() {
    let rig = compiled(fed(4.0, 5));
    let timing = Timing::new(0.005, 1e-3).unwrap().stable(&rig).unwrap();
    let u = wave(120);
    let signals: [(&str, &[f64]); 1] = [("valve_command", &u)];
    let drive = Drive::new(&rig, 120, &signals).unwrap();
    let fresh = || Progress::start(&rig, &Initial::rest(&rig)).unwrap();
    let (mut whole, mut first) = (fresh(), fresh());
    let (mut out, mut parts) = (Trajectory::new(&rig, 120), Trajectory::new(&rig, 120));
    whole.advance(&rig, timing, &drive.part(0..120), &mut out).unwrap();
    first.advance(&rig, timing, &drive.part(0..47), &mut parts).unwrap();
    let mut again = fresh().restored(&rig, &first.to_vec()).unwrap();
    again.advance(&rig, timing, &drive.part(47..120), &mut parts).unwrap();
    assert_eq!((parts, again.to_vec()), (out, whole.to_vec()));
    let map = rig.state_map();
    assert_eq!(map.len(), whole.to_vec().len());
    let flows = map.iter().filter(|place| place.role.name() == "flow");
    let flows: Vec<&str> = flows.map(|place| place.name.as_str()).collect();
    let names: Vec<String> = (1..=5).map(|k| format!("segment_flow.{k}")).collect();
    assert_eq!(flows, names);
}

#[test]
fn sensitivities_are_those_of_differences() {
    let make = |length: f64, diameter: f64, alpha: f64| {
        let mut line = LineSpec { diameter, alpha, ..tube("chamber.a", "chamber.b", length, 4) };
        line.name = "hose".into();
        compiled(gas(vec![chamber("a", 1e-4, 4e5), chamber("b", 1e-4, 4e5)], vec![line]))
    };
    let at = [3.0, 0.004, 1.4];
    let rig = make(at[0], at[1], at[2]);
    let (rows, dt) = (120, 0.002);
    let phase = |k: usize| k as f64 * dt * 40.0;
    let left: Vec<f64> = (0..rows).map(|k| 4e5 + 1e5 * (1.0 - phase(k).cos())).collect();
    let slope: Vec<f64> = (0..rows).map(|k| 4e6 * phase(k).sin()).collect();
    let (right, still) = (vec![4e5; rows], vec![0.0; rows]);
    let predicted = |rig: &Rig, starts: &[usize], names: &[&str]| {
        let signals = [
            ("muscle_pressure.a", Signal { value: &left, slope: &slope }),
            ("muscle_pressure.b", Signal { value: &right, slope: &still }),
        ];
        let measured = Measured::new(rig, rows, &[], &signals).unwrap();
        let ids: Vec<_> = names.iter().map(|n| rig.parameters().find(n).unwrap()).collect();
        let block = Block::from_name(rig, "chamber.b").unwrap();
        let step = block.longest_step(rig, &measured).unwrap();
        let timing = Timing { sample_time: dt, substeps: 6 };
        assert!(timing.step() < step, "{step}");
        predict(rig, block, &measured, timing, starts, &ids).unwrap()
    };
    let names = ["line.hose.length", "line.hose.diameter", "line.hose.alpha"];
    let exact = predicted(&rig, &[0, 70], &names);
    for (k, name) in names.iter().enumerate() {
        let moved = |sign: f64| {
            let mut x = at;
            x[k] *= 1.0 + sign * 1e-5;
            predicted(&make(x[0], x[1], x[2]), &[0, 70], &[]).value
        };
        let (up, down) = (moved(1.0), moved(-1.0));
        let largest = (0..rows).map(|i| exact.jacobian[i * exact.columns + k].abs());
        let largest = largest.fold(0.0, f64::max);
        assert!(largest * at[k] > 1e3, "{name} tells: {largest}");
        for i in 0..rows {
            let difference = (up[i] - down[i]) / (2e-5 * at[k]);
            let slope = exact.jacobian[i * exact.columns + k];
            assert!(
                (slope - difference).abs() < 1e-4 * largest,
                "{name} {i}: {slope} {difference} of {largest}"
            );
        }
    }
}

#[test]
fn a_block_is_predicted_through_the_tube_before_it() {
    // a gauge at either end: the pressure at the one end gives that at the other
    let line = tube("chamber.a", "chamber.b", 8.0, 16);
    let rig = Rig::new(gas(vec![chamber("a", 2e-4, 5e5), chamber("b", 1e-4, 0.0)], vec![line]));
    let rig = rig.unwrap();
    let (rows, dt) = (400, 5e-4);
    let timing = Timing::new(dt, dt).unwrap().stable(&rig).unwrap();
    let truth = simulate(&rig, rows, &[], timing, &Initial::rest(&rig)).unwrap();
    let read = ["muscle_pressure.a", "muscle_pressure.b"].map(|n| truth.get(&rig, n).unwrap());
    let slopes = read.map(|p| {
        let at = |k: usize| p[k.min(rows - 1)];
        let slope = |k: usize| (at(k + 1) - p[k.saturating_sub(1)]) / (2.0 * dt);
        (0..rows).map(slope).collect::<Vec<f64>>()
    });
    let missed = |rig: &Rig| {
        let signals = [
            ("muscle_pressure.a", Signal { value: read[0], slope: &slopes[0] }),
            ("muscle_pressure.b", Signal { value: read[1], slope: &slopes[1] }),
        ];
        let measured = Measured::new(rig, rows, &[], &signals).unwrap();
        let block = Block::from_name(rig, "chamber.b").unwrap();
        let timing = timing.at_most(block.longest_step(rig, &measured).unwrap()).unwrap();
        let found = predict(rig, block, &measured, timing, &[0, 200], &[]).unwrap().value;
        found.iter().zip(read[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let mut at_once = rig.spec().clone();
    at_once.lines[0].segments = 0;
    let (own, other) = (missed(&rig), missed(&compiled(at_once)));
    assert!(own < 1e3 && other > 10.0 * own, "{own} Pa, {other} Pa");
}

#[test]
fn what_cannot_be_is_named() {
    type Change = fn(&mut LineSpec);
    let cases: [(&str, Change); 4] = [
        ("line.segments", |line| line.segments = 1000),
        ("line.segments", |line| line.kind = "orifice".into()),
        ("line.alpha", |line| line.alpha = 3.0),
        ("line is too short for 200 segments", |line| {
            (line.segments, line.length) = (200, 1e-3);
        }),
    ];
    for (part, change) in cases {
        let mut spec = fed(4.0, 5);
        change(&mut spec.lines[0]);
        let error = Rig::new(spec).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    let rig = compiled(fed(4.0, 5));
    let initial = Initial::rest(&rig);
    assert!(initial.clone().with(&rig, "segment_flow.5", 1e-3).is_ok());
    assert!(initial.clone().with(&rig, "segment_flow.6", 1e-3).is_err());
    assert!(initial.clone().with(&rig, "segment_flow.5", f64::NAN).is_err());
    assert!(initial.clone().with(&rig, "segment_pressure.5", 1e5).is_err(), "four lie between");
    assert!(initial.with(&rig, "segment_pressure.4", -2e5).is_err());
}
