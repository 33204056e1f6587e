//! A gas with a thermometer: its temperature is predicted from the run of its pressure, and both
//! begin at what the thermometer reads.

use super::rigs::{compiled, effect, shoulder, warm};
use pam_core::cut_chain::{predict, Block, Measured, Prediction, Signal};
use pam_core::description::EffectSpec;
use pam_core::simulate::{simulate, Initial, Timing, Trajectory};
use pam_core::{Rig, RigSpec};

const DT: f64 = 0.01;
const ROWS: usize = 160;
const CHANNELS: [&str; 4] = ["supply_pressure", "muscle_pressure", "joint_angle", "temperature"];

/// The shoulder with an energy balance, its stop far away, and some effects.
fn rig(effects: Vec<EffectSpec>) -> Rig {
    compiled(RigSpec { effects, ..warm(shoulder()) })
}

fn lagging(time_constant: f64) -> Vec<EffectSpec> {
    vec![effect("thermometer_lag", &[("time_constant", time_constant)])]
}

fn command(rows: usize) -> Vec<f64> {
    (0..rows).map(|k| [5.3, 5.0, 4.7, 5.0][(k / 20) % 4]).collect()
}

/// What happened, from a row on.
struct Log {
    command: Vec<f64>,
    values: Vec<Vec<f64>>,
    slopes: Vec<Vec<f64>>,
}

impl Log {
    fn of(rig: &Rig, from: usize) -> Self {
        let rows = ROWS + from;
        let command = command(rows);
        let timing = Timing { sample_time: DT, substeps: 10 }.stable(rig).unwrap();
        let start = Initial::rest(rig).with(rig, "muscle_pressure", 2e5).unwrap();
        let start = start.with(rig, "joint_angle", 0.9).unwrap();
        let signals = [("valve_command", command.as_slice())];
        let run: Trajectory = simulate(rig, rows, &signals, timing, &start).unwrap();
        let values: Vec<Vec<f64>> =
            CHANNELS.iter().map(|name| run.get(rig, name).unwrap()[from..].to_vec()).collect();
        let slopes = values.iter().map(|v| slopes(v)).collect();
        Self { command: command[from..].to_vec(), values, slopes }
    }

    fn signals(&self, known: &[usize]) -> Vec<(&'static str, Signal<'_>)> {
        let one =
            |k: &usize| (CHANNELS[*k], Signal { value: &self.values[*k], slope: &self.slopes[*k] });
        known.iter().map(one).collect()
    }

    /// What a block of a rig predicts of it.
    fn predicted(&self, rig: &Rig, block: &str, known: &[usize], names: &[&str]) -> Prediction {
        let commands = [("valve_command", self.command.as_slice())];
        let signals = self.signals(known);
        let anchors: &[usize] = if block == "temperature" { &[40, 80, 120] } else { &[] };
        let measured = Measured::new(rig, ROWS, &commands, &signals).unwrap();
        let measured = measured.anchored(anchors).unwrap();
        let ids: Vec<_> = names.iter().map(|n| rig.parameters().find(n).unwrap()).collect();
        let timing = Timing { sample_time: DT, substeps: 10 }.stable(rig).unwrap();
        predict(rig, Block::from_name(rig, block).unwrap(), &measured, timing, &[0], &ids).unwrap()
    }
}

/// Slopes by central differences.
fn slopes(values: &[f64]) -> Vec<f64> {
    let last = values.len() - 1;
    let ends = |k: usize| (k.saturating_sub(1), (k + 1).min(last));
    let slope = |(a, b): (usize, usize)| (values[b] - values[a]) / ((b - a) as f64 * DT);
    (0..=last).map(|k| slope(ends(k))).collect()
}

fn largest_gap(found: &[f64], was: &[f64]) -> f64 {
    found.iter().zip(was).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn the_temperature_of_a_run_is_predicted_from_the_pressures() {
    for effects in [vec![], lagging(0.3)] {
        let rig = rig(effects);
        let log = Log::of(&rig, 0);
        let span = log.values[3].iter().copied().fold(f64::MIN, f64::max)
            - log.values[3].iter().copied().fold(f64::MAX, f64::min);
        assert!(span > 3.0, "the gas moves by {span} K");
        let found = log.predicted(&rig, "temperature", &[0, 1, 2, 3], &[]).value;
        let gap = largest_gap(&found, &log.values[3]);
        assert!(gap < 0.02 * span, "{gap} of {span} K");
    }
}

#[test]
fn a_log_that_begins_while_the_gas_is_warm_begins_there() {
    for effects in [vec![], lagging(0.05)] {
        let rig = rig(effects);
        let log = Log::of(&rig, 24); // just after a fill
        for (block, channel, unit) in [("chamber", 1, 1e5), ("temperature", 3, 10.0)] {
            let gap = |known: &[usize]| {
                let found = log.predicted(&rig, block, known, &[]).value;
                largest_gap(&found, &log.values[channel]) / unit
            };
            let (told, at_rest) = (gap(&[0, 1, 2, 3]), gap(&[0, 1, 2]));
            assert!(told < 0.2 * at_rest, "{block}: {told} with a thermometer, {at_rest} without");
        }
    }
}

#[test]
fn sensitivities_are_those_of_differences() {
    let of = |time_constant: f64, wall: f64| {
        let mut spec = RigSpec { effects: lagging(time_constant), ..warm(shoulder()) };
        spec.chambers[0].heat_transfer_coefficient = wall;
        compiled(spec)
    };
    let names = ["chamber.heat_transfer_coefficient", "thermometer_lag.time_constant"];
    let log = Log::of(&of(0.3, 50.0), 24);
    let known = [0, 1, 2, 3];
    let exact = log.predicted(&of(0.3, 50.0), "temperature", &known, &names);
    assert_eq!(exact.columns, 5); // gas, what the thermometer is off by, where it stands
    for (column, (by, step)) in [((0.0, 1.0), 0.01), ((1.0, 0.0), 1e-4)].into_iter().enumerate() {
        let moved = |sign: f64| {
            let (tau, wall) = (0.3 + sign * step * by.0, 50.0 + sign * step * by.1);
            log.predicted(&of(tau, wall), "temperature", &known, &[]).value
        };
        let (up, down) = (moved(1.0), moved(-1.0));
        let slope = |k: usize| exact.jacobian[k * exact.columns + column];
        let scale = (0..ROWS).map(|k| slope(k).abs()).fold(0.0, f64::max);
        assert!(scale > 0.0, "{}", names[column]);
        for k in 0..ROWS {
            let gap = (slope(k) - (up[k] - down[k]) / (2.0 * step)).abs();
            assert!(gap < 1e-3 * scale, "{} at row {k}: {gap} of {scale}", names[column]);
        }
    }
    // a thermometer that is off by a kelvin: the gas began a kelvin colder, and all reads one more
    let off = exact.jacobian[(ROWS - 1) * 5 + 3];
    assert!((off - 1.0).abs() < 0.05);
    // where a late one stands is forgotten in its time constant
    let stands = |k: usize| exact.jacobian[k * 5 + 4];
    assert!((stands(0) - 1.0).abs() < 1e-12);
    assert!((stands(30) - (-1.0_f64).exp()).abs() < 1e-3);
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let rig = rig(vec![]);
    let log = Log::of(&rig, 0);
    let commands = [("valve_command", log.command.as_slice())];
    let cold = vec![0.0; ROWS];
    let signal = [("temperature", Signal { value: &cold, slope: &cold })];
    let text = Measured::new(&rig, ROWS, &commands, &signal).unwrap_err().to_string();
    assert!(text.contains("temperature.value[0]") && text.contains("absolute zero"), "{text}");
    let whole = || Measured::new(&rig, ROWS, &commands, &log.signals(&[0, 1, 2, 3])).unwrap();
    for anchors in [vec![40, 40], vec![ROWS]] {
        let text = whole().anchored(&anchors).unwrap_err().to_string();
        assert!(text.contains("anchors"), "{text}");
    }
}

/// A gas begins at the temperature that was given last, and a name that is not known says which are.
#[test]
fn the_last_temperature_of_a_gas_counts() {
    let rig = rig(vec![]);
    let begun = |kelvins: &[f64]| {
        let start = kelvins.iter().fold(Initial::rest(&rig), |start, kelvin| {
            start.with(&rig, "temperature", *kelvin).unwrap()
        });
        let timing = Timing { sample_time: DT, substeps: 10 }.stable(&rig).unwrap();
        let command = command(3);
        simulate(&rig, 3, &[("valve_command", &command)], timing, &start).unwrap().channels
    };
    assert_eq!(begun(&[350.0, 310.0]), begun(&[310.0]));
    let text = Initial::rest(&rig).with(&rig, "pressure", 1e5).unwrap_err().to_string();
    assert!(text.contains("temperature"), "{text}");
}
