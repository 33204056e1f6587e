//! Laws of a batch: each row is the plant alone to the last bit, whoever advances it; a row that
//! ends takes none along.

use pam_core::simulate::batch::{Batch, Failure};
use pam_core::simulate::drive::Drive;
use pam_core::simulate::{Initial, Progress, Timing, Trajectory};
use pam_core::{Error, Result, Rig, RigSpec};
use std::sync::Arc;

const TIMING: Timing = Timing { sample_time: 0.002, substeps: 2 };

fn rig() -> Arc<Rig> {
    Arc::new(Rig::new(RigSpec::from_json(include_str!("data/shoulder.json")).unwrap()).unwrap())
}

/// The same arm with another payload.
fn with_payload(rig: &Rig, payload: f64) -> Arc<Rig> {
    let mut spec = rig.spec().clone();
    spec.arm.as_mut().unwrap().payload = payload;
    Arc::new(rig.respecified(spec).unwrap())
}

fn command(row: usize, sample: usize) -> f64 {
    5.2 + 0.5 * (row as f64 * 0.37 + sample as f64 * 0.05).sin()
}

fn commands(rows: usize, sample: usize) -> Vec<f64> {
    (0..rows).map(|row| command(row, sample)).collect()
}

fn quiet() -> Result<()> {
    Ok(())
}

fn run(batch: &mut Batch, samples: std::ops::Range<usize>) {
    for k in samples {
        let held = commands(batch.rows(), k);
        batch.advance(1, &[("valve_command", &held)], true, &mut quiet).unwrap();
    }
}

fn bits(states: impl Iterator<Item = Vec<f64>>) -> Vec<Vec<u64>> {
    states.map(|state| state.iter().map(|x| x.to_bits()).collect()).collect()
}

#[test]
fn every_row_is_the_plant_alone_whatever_the_threads() {
    let base = rig();
    let rows = 70; // more than one chunk for any number of threads
    let rigs: Vec<_> =
        (0..rows)
            .map(|k| {
                if k % 7 == 3 {
                    with_payload(&base, 1.0 + k as f64 * 0.1)
                } else {
                    Arc::clone(&base)
                }
            })
            .collect();
    let initial: Vec<_> = rigs
        .iter()
        .enumerate()
        .map(|(k, r)| Initial::rest(r).with(r, "muscle_pressure", 1e5 + 1e3 * k as f64).unwrap())
        .collect();
    let mut found = Vec::new();
    for threads in [1, 2, 5] {
        let mut batch = Batch::new(&rigs, TIMING, &initial, threads).unwrap();
        run(&mut batch, 0..60);
        found.push((bits(batch.states()), batch.observe()));
    }
    assert_eq!(found[0], found[1]);
    assert_eq!(found[0], found[2]);
    for row in [0, 3, 17, 69] {
        let signal: Vec<f64> = (0..60).map(|k| command(row, k)).collect();
        let mut alone = Progress::start(&rigs[row], &initial[row]).unwrap();
        let mut out = Trajectory::new(&rigs[row], 60);
        let drive = Drive::new(&rigs[row], 60, &[("valve_command", &signal)]).unwrap();
        alone.advance(&rigs[row], TIMING.stable(&rigs[row]), &drive, &mut out).unwrap();
        assert_eq!(
            bits(std::iter::once(alone.to_vec())).swap_remove(0),
            found[0].0[row],
            "row {row}"
        );
        for (channel, values) in out.channels.iter().enumerate() {
            let here = found[0].1[channel * rows + row];
            assert_eq!(here.to_bits(), values[59].to_bits(), "row {row}, channel {channel}");
        }
    }
}

#[test]
fn several_samples_at_once_are_so_many_single_ones() {
    let base = rig();
    let (rigs, initial) = (vec![Arc::clone(&base); 9], vec![Initial::rest(&base); 9]);
    let held = commands(9, 4);
    let [mut once, mut often] = [(); 2].map(|()| Batch::new(&rigs, TIMING, &initial, 2).unwrap());
    once.advance(40, &[("valve_command", &held)], true, &mut quiet).unwrap();
    for _ in 0..40 {
        often.advance(1, &[("valve_command", &held)], true, &mut quiet).unwrap();
    }
    assert_eq!(bits(once.states()), bits(often.states()));
    assert_eq!((once.observe(), once.samples()), (often.observe(), 40));
}

#[test]
fn a_row_that_fails_stays_at_its_last_good_sample_and_the_others_go_on() {
    let base = rig();
    let rigs = vec![Arc::clone(&base); 5];
    let mut initial = vec![Initial::rest(&base); 5];
    initial[2] = Initial::rest(&base).with(&base, "joint_rate", -500.0).unwrap();
    let mut batch = Batch::new(&rigs, TIMING, &initial, 2).unwrap();
    let mut healthy = Batch::new(&rigs[1..], TIMING, &vec![Initial::rest(&base); 4], 1).unwrap();
    run(&mut batch, 0..50);
    let failures: Vec<_> = batch.failures().map(Option::<&Failure>::cloned).collect();
    let failure = failures[2].clone().unwrap();
    assert!(failure.message.contains("contraction_ratio"), "{}", failure.message);
    assert!(failure.time > 0.0 && failure.time < 0.1);
    assert_eq!(failures.iter().filter(|f| f.is_some()).count(), 1);
    let seen = batch.observe();
    assert!(seen.iter().all(|x| x.is_finite()));
    run(&mut batch, 50..60);
    let later = batch.observe();
    for channel in 0..base.names().channels.len() {
        assert_eq!(seen[channel * 5 + 2].to_bits(), later[channel * 5 + 2].to_bits());
    }
    // Rows 0 and 1 take the same commands in both.
    run(&mut healthy, 0..60);
    let (with, without) = (bits(batch.states()), bits(healthy.states()));
    assert_eq!(with[..2], without[..2]);
    // A state goes on with its failure.
    let states: Vec<_> = batch.states().collect();
    let mut again = Batch::new(&rigs, TIMING, &vec![Initial::rest(&base); 5], 1).unwrap();
    again.restore(60, &states, &failures).unwrap();
    run(&mut again, 60..70);
    run(&mut batch, 60..70);
    assert_eq!(bits(again.states()), bits(batch.states()));
    assert_eq!(again.observe(), batch.observe());
}

#[test]
fn a_bad_command_is_an_error_or_the_end_of_its_row() {
    let base = rig();
    let (rigs, initial) = (vec![Arc::clone(&base); 3], vec![Initial::rest(&base); 3]);
    let mut batch = Batch::new(&rigs, TIMING, &initial, 1).unwrap();
    run(&mut batch, 0..5);
    let before = bits(batch.states());
    let held = [5.0, f64::NAN, 5.0];
    let refused = batch.advance(1, &[("valve_command", &held)], true, &mut quiet).unwrap_err();
    assert!(refused.to_string().contains("valve_command[1] = NaN"), "{refused}");
    let short = batch.advance(1, &[("valve_command", &held[..2])], true, &mut quiet).unwrap_err();
    assert!(matches!(short, Error::Length { found: 2, expected: 3, .. }));
    assert!(batch
        .advance(1, &[], true, &mut quiet)
        .unwrap_err()
        .to_string()
        .contains("valve_command is missing"));
    assert!(batch
        .advance(1, &[("valve_command", &[5.0; 3]), ("length", &[0.2; 3])], true, &mut quiet)
        .is_err());
    assert_eq!((bits(batch.states()), batch.samples()), (before.clone(), 5));
    batch.advance(1, &[("valve_command", &held)], false, &mut quiet).unwrap();
    let failures: Vec<_> = batch
        .failures()
        .map(|f| f.map(|f| (f.time, f.message.contains("valve_command[1]"))))
        .collect();
    assert_eq!(failures, [None, Some((0.01, true)), None]);
    let after = bits(batch.states());
    assert_eq!(after[1], before[1]);
    assert_ne!(after[0], before[0]);
}

#[test]
fn what_does_not_fit_is_named_with_its_row() {
    let base = rig();
    let other = Arc::new(
        Rig::new(RigSpec::from_json(include_str!("data/shoulder.json")).unwrap()).unwrap(),
    );
    let mut spec = base.spec().clone();
    spec.muscles[0].name = "flexor".into();
    spec.chambers[0].name = "flexor".into();
    let start = |n: usize| vec![Initial::rest(&base); n];
    assert!(Batch::new(&[], TIMING, &[], 1).is_err());
    assert!(Batch::new(&[Arc::clone(&base)], TIMING, &start(2), 1).is_err());
    if let Ok(renamed) = Rig::new(spec) {
        let error = Batch::new(&[Arc::clone(&base), Arc::new(renamed)], TIMING, &start(2), 1)
            .err()
            .unwrap();
        assert!(error.to_string().contains("row 1: its channels"), "{error}");
    }
    let mut batch = Batch::new(&[base.clone(), other], TIMING, &start(2), 1).unwrap();
    run(&mut batch, 0..3);
    let states: Vec<_> = batch.states().collect();
    let none = vec![None, None];
    let mut bad = states.clone();
    bad[1].pop();
    assert!(batch.restore(3, &bad, &none).unwrap_err().to_string().contains("row 1: state"));
    assert!(batch
        .restore(4, &states, &none)
        .unwrap_err()
        .to_string()
        .contains("row 0: state.samples = 3"));
    assert!(batch.restore(3, &states[..1], &none).is_err());
    assert_eq!(bits(batch.states()), bits(states.into_iter()));
}

#[test]
fn a_look_outside_ends_a_run_at_a_sample() {
    let base = rig();
    let (rigs, initial) = (vec![Arc::clone(&base); 20], vec![Initial::rest(&base); 20]);
    let mut batch = Batch::new(&rigs, TIMING, &initial, 2).unwrap();
    let held = commands(20, 0);
    let mut looks = 0;
    let stop = batch.advance(1_000_000, &[("valve_command", &held)], true, &mut || {
        looks += 1;
        if looks == 2 {
            Err(Error::Model("enough".into()))
        } else {
            Ok(())
        }
    });
    assert_eq!(stop.unwrap_err().to_string(), "enough");
    let stands = batch.samples();
    assert!(stands > 0 && stands < 1_000_000);
    let mut again = Batch::new(&rigs, TIMING, &initial, 1).unwrap();
    again.advance(stands as usize, &[("valve_command", &held)], true, &mut quiet).unwrap();
    assert_eq!(bits(again.states()), bits(batch.states()));
    assert_eq!(again.observe(), batch.observe());
}
