//! Time of the core's hot paths: one table look-up, one exact solve, one RK4 step of the shoulder, one step with
//! eight sensitivities.

use criterion::{criterion_main, Criterion};
use pam_core::residual::{predict, Block, Measured, Signal};
use pam_core::rig::ParameterId;
use pam_core::simulate::{simulate, Initial, Timing};
use pam_core::{Rig, RigSpec};
use std::hint::black_box;

const SHOULDER: &str = include_str!("../tests/data/shoulder.json");
const SAMPLES: usize = 101;
const SUBSTEPS: usize = 50;

fn core(c: &mut Criterion) {
    let rig = match RigSpec::from_json(SHOULDER).and_then(Rig::new) {
        Ok(rig) => rig,
        Err(error) => {
            eprintln!("the benchmark's rig cannot be read: {error}");
            return;
        }
    };
    let command: Vec<f64> = (0..SAMPLES).map(|k| 5.0 + 0.5 * (k as f64 * 0.05).sin()).collect();
    let timing = Timing { sample_time: 0.005, substeps: SUBSTEPS };
    let initial = Initial { muscle_pressure: 1e5, joint_angle: 0.52, ..Initial::rest(&rig) };
    if let Some(muscle) = rig.muscle() {
        c.bench_function("muscle table look-up", |b| b.iter(|| muscle.table.eval(black_box(0.123_f64))));
        c.bench_function("muscle exact force", |b| {
            b.iter(|| muscle.exact.force(black_box(4e5), black_box(0.123)))
        });
    }
    let steps = (SAMPLES - 1) * SUBSTEPS;
    c.bench_function(&format!("shoulder, {steps} RK4 steps"), |b| {
        b.iter(|| simulate(&rig, black_box(&command), timing, initial));
    });
    let Ok(run) = simulate(&rig, &command, timing, initial) else { return };
    let zero = vec![0.0; SAMPLES];
    let signal = |value| Some(Signal { value, slope: &zero });
    let measured = Measured {
        valve_command: &command,
        supply_pressure: signal(&run.supply_pressure),
        muscle_pressure: signal(&run.muscle_pressure),
        joint_angle: signal(&run.joint_angle),
    };
    let names = [
        ParameterId::DischargeArea,
        ParameterId::NullVoltage,
        ParameterId::DeadVolume,
        ParameterId::AlphaIn,
        ParameterId::AlphaOut,
        ParameterId::Alpha,
        ParameterId::PressureZero,
    ];
    c.bench_function(&format!("chamber cut, {steps} RK4 steps, eight sensitivities"), |b| {
        b.iter(|| predict(&rig, Block::Chamber, black_box(&measured), timing, &[0], &names));
    });
}

/// What the macro generates has no place for documentation.
#[allow(missing_docs)]
mod group {
    use super::{core, Criterion};
    use criterion::criterion_group;

    criterion_group! {
        name = benches;
        config = Criterion::default().sample_size(20);
        targets = core
    }
}

criterion_main!(group::benches);
