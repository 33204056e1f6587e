//! An input that nobody measured: what a prediction does with it, and what its slopes are.

use super::rigs::{compiled, effect, shoulder, warm};
use pam_core::cut_chain::{predict, Block, Measured, Prediction, Signal};
use pam_core::description::EffectSpec;
use pam_core::simulate::{simulate, Initial, Timing, Trajectory};
use pam_core::{Rig, RigSpec};

const DT: f64 = 0.01;
const ROWS: usize = 160;
const STARTS: [usize; 3] = [0, 60, 110];
const SPACING: usize = 8;
const CHANNELS: [&str; 3] = ["supply_pressure", "muscle_pressure", "joint_angle"];

struct Log {
    command: Vec<f64>,
    values: Vec<Vec<f64>>,
    slopes: Vec<Vec<f64>>,
}

impl Log {
    fn of(rig: &Rig) -> Self {
        let command: Vec<f64> = (0..ROWS).map(|k| [5.3, 5.0, 4.7, 5.0][(k / 20) % 4]).collect();
        let timing = Timing { sample_time: DT, substeps: 10 }.stable(rig).unwrap();
        let start = Initial::rest(rig).with(rig, "muscle_pressure", 2e5).unwrap();
        let start = start.with(rig, "joint_angle", 0.9).unwrap();
        let signals = [("valve_command", command.as_slice())];
        let run: Trajectory = simulate(rig, ROWS, &signals, timing, &start).unwrap();
        let values: Vec<Vec<f64>> =
            CHANNELS.iter().map(|name| run.get(rig, name).unwrap().to_vec()).collect();
        let slopes = values.iter().map(|v| slopes(v)).collect();
        Self { command, values, slopes }
    }

    /// What a block predicts under an input; without one where there is no spacing.
    fn predicted(&self, rig: &Rig, block: &str, input: Option<&[f64]>) -> Prediction {
        let commands = [("valve_command", self.command.as_slice())];
        let each = self.values.iter().zip(&self.slopes).zip(CHANNELS);
        let signals: Vec<_> =
            each.map(|((value, slope), name)| (name, Signal { value, slope })).collect();
        let mut measured = Measured::new(rig, ROWS, &commands, &signals).unwrap();
        if let Some(heights) = input {
            measured = measured.with_input(SPACING, heights).unwrap();
        }
        let block = Block::from_name(rig, block).unwrap();
        let timing = Timing { sample_time: DT, substeps: 4 };
        predict(rig, block, &measured, timing, &STARTS, &[]).unwrap()
    }
}

fn slopes(values: &[f64]) -> Vec<f64> {
    let at = |k: usize| values[k.min(values.len() - 1)];
    (0..values.len()).map(|k| (at(k + 1) - at(k.saturating_sub(1))) / (2.0 * DT)).collect()
}

fn knots() -> Vec<usize> {
    [60_usize, 50, 50].iter().map(|n| n.div_ceil(SPACING) + 1).collect()
}

fn blocks() -> [(&'static str, f64); 3] {
    [("arm", 0.5), ("chamber", 1e-5), ("supply", 1e-5)]
}

#[test]
fn no_input_changes_nothing_and_each_slope_is_that_of_two_predictions() {
    let every: usize = knots().iter().sum();
    for rig in [compiled(shoulder()), compiled(warm(shoulder()))] {
        let log = Log::of(&rig);
        for (block, size) in blocks() {
            let plain = log.predicted(&rig, block, None);
            let zero = log.predicted(&rig, block, Some(&vec![0.0; every]));
            assert_eq!(plain.value, zero.value);
            let hats = zero.columns - knots()[0];
            let base: Vec<f64> = (0..every).map(|k| size * (k as f64).sin()).collect();
            let found = log.predicted(&rig, block, Some(&base));
            // a knot of the second window
            let knot = 3;
            let mut changed = [base.clone(), base.clone()];
            changed[0][knots()[0] + knot] -= 1e-4 * size;
            changed[1][knots()[0] + knot] += 1e-4 * size;
            let [low, high] = changed.map(|heights| log.predicted(&rig, block, Some(&heights)));
            let mut most = 0.0_f64;
            for k in 0..ROWS {
                let slope = (high.value[k] - low.value[k]) / (2e-4 * size);
                let told = found.jacobian[k * found.columns + hats + knot];
                if (60..110).contains(&k) {
                    most = most.max(slope.abs());
                    assert!(
                        (slope - told).abs() < 2e-4 * most.max(1e-9),
                        "{block} {k}: {slope} {told}"
                    );
                } else if block == "arm" {
                    assert!(slope == 0.0, "{block} {k}: {slope}");
                }
            }
            assert!(most > 0.0);
        }
    }
}

/// A torque that is steady is that of something outside that pulls all the time.
#[test]
fn a_steady_torque_is_that_of_an_effect() {
    let rig = compiled(shoulder());
    let log = Log::of(&rig);
    let pull = effect("external_torque", &[("torque", 2.0)]);
    let pulled = EffectSpec { form: "constant".into(), ..pull };
    let same = compiled(RigSpec { effects: vec![pulled], ..shoulder() });
    let every: usize = knots().iter().sum();
    let with = log.predicted(&rig, "arm", Some(&vec![2.0; every]));
    let plain = log.predicted(&same, "arm", None);
    let apart = with.value.iter().zip(&plain.value).map(|(a, b)| (a - b).abs());
    assert!(apart.fold(0.0, f64::max) < 1e-12);
}

#[test]
fn an_input_of_another_length_is_refused() {
    let rig = compiled(shoulder());
    let log = Log::of(&rig);
    let commands = [("valve_command", log.command.as_slice())];
    let each = log.values.iter().zip(&log.slopes).zip(CHANNELS);
    let signals: Vec<_> =
        each.map(|((value, slope), name)| (name, Signal { value, slope })).collect();
    let measured = Measured::new(&rig, ROWS, &commands, &signals).unwrap();
    assert!(measured.clone().with_input(0, &[]).unwrap_err().to_string().contains("spacing"));
    let none = measured.clone().with_input(SPACING, &[f64::NAN]).unwrap_err();
    assert!(none.to_string().contains("heights[0]"));
    let short = measured.with_input(SPACING, &[1.0]).unwrap();
    let block = Block::from_name(&rig, "arm").unwrap();
    let timing = Timing { sample_time: DT, substeps: 4 };
    let text = predict(&rig, block, &short, timing, &STARTS, &[]).unwrap_err().to_string();
    assert!(text.contains("heights"), "{text}");
}
