//! Time of the core's hot paths: one table look-up, one exact solve, one RK4 step of the shoulder,
//! one step with eight sensitivities.

use pam_core::cut_chain::{predict, Block};
use pam_core::cut_chain::{Measured, Signal};
use pam_core::simulate::{simulate, Initial, Timing};
use pam_core::{Rig, RigSpec};
use std::hint::black_box;
use std::time::{Duration, Instant};

const SHOULDER: &str = include_str!("../tests/data/shoulder.json");
const SAMPLES: usize = 101;
const SUBSTEPS: usize = 50;

const REPEATS: usize = 20;

/// Prints the median time of one call, and from where to where repetitions of 20 ms or more lie.
fn measure<T>(name: &str, mut work: impl FnMut() -> T) {
    let mut spent = |calls: u32| {
        let start = Instant::now();
        for _ in 0..calls {
            black_box(work());
        }
        start.elapsed()
    };
    let mut calls = 1;
    while spent(calls) < Duration::from_millis(20) {
        calls *= 2;
    }
    let mut times: Vec<_> = (0..REPEATS).map(|_| spent(calls) / calls).collect();
    times.sort();
    println!("{name}: {:?} ({:?} to {:?})", times[REPEATS / 2], times[0], times[REPEATS - 1]);
}

fn main() {
    let rig = match RigSpec::from_json(SHOULDER).and_then(Rig::new) {
        Ok(rig) => rig,
        Err(error) => {
            eprintln!("the benchmark's rig cannot be read: {error}");
            return;
        }
    };
    let command: Vec<f64> = (0..SAMPLES).map(|k| 5.0 + 0.5 * (k as f64 * 0.05).sin()).collect();
    let timing = Timing { sample_time: 0.005, substeps: SUBSTEPS };
    let start = Initial::rest(&rig).with(&rig, "muscle_pressure", 1e5);
    let Ok(initial) = start.and_then(|i| i.with(&rig, "joint_angle", 0.52)) else { return };
    if let Some(muscle) = rig.muscle(0) {
        measure("muscle table look-up", || muscle.table.eval(black_box(0.123_f64)));
        measure("muscle exact force", || muscle.exact.force(black_box(4e5), black_box(0.123)));
    }
    let steps = (SAMPLES - 1) * SUBSTEPS;
    measure(&format!("shoulder, {steps} RK4 steps"), || {
        simulate(&rig, SAMPLES, &[("valve_command", black_box(&command))], timing, &initial)
    });
    let Ok(run) = simulate(&rig, SAMPLES, &[("valve_command", &command)], timing, &initial) else {
        return;
    };
    let zero = vec![0.0; SAMPLES];
    let channels = ["supply_pressure", "muscle_pressure", "joint_angle"];
    let signals: Vec<_> = (channels.iter())
        .filter_map(|name| Some((*name, Signal { value: run.get(&rig, name)?, slope: &zero })))
        .collect();
    let Ok(measured) = Measured::new(&rig, SAMPLES, &[("valve_command", &command)], &signals)
    else {
        return;
    };
    let names = [
        "valve.discharge_area_max",
        "valve.null_voltage",
        "chamber.dead_volume",
        "chamber.alpha_in",
        "chamber.alpha_out",
        "chamber.alpha",
        "sensors.pressure_zero",
    ];
    let ids: Vec<_> = names.iter().filter_map(|name| rig.parameters().find(name).ok()).collect();
    measure(&format!("chamber cut, {steps} RK4 steps, eight sensitivities"), || {
        predict(&rig, Block::Chamber(0), black_box(&measured), timing, &[0], &ids)
    });
}
