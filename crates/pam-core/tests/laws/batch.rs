//! Laws of a batch: each row is the plant alone (to the last bit where its rig does not run in
//! lanes), whoever advances it and in however many calls; a row that ends takes none along.

use super::rigs::compiled;
use pam_core::batch::Batch;
use pam_core::description::EffectSpec;
use pam_core::simulate::drive::Drive;
use pam_core::simulate::{Failure, Initial, Progress, Timing, Trajectory};
use pam_core::{Error, Result, Rig, RigSpec};
use std::sync::Arc;

const TIMING: Timing = Timing { sample_time: 0.002, substeps: 2 };

fn rig() -> Arc<Rig> {
    Arc::new(compiled(RigSpec::from_json(include_str!("../data/shoulder.json")).unwrap()))
}

/// The same with an effect, which lanes do not know.
fn leaky() -> Arc<Rig> {
    let mut spec = rig().spec().clone();
    let parameters = [("conductance", 2e-9), ("laminar_share", 0.0)];
    let parameters = parameters.map(|(name, value)| (name.to_string(), value)).into();
    let (id, form, at) = ("leak_muscle".into(), String::new(), String::new());
    spec.effects = vec![EffectSpec { id, form, at, parameters }];
    Arc::new(compiled(spec))
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

fn bits(states: Vec<Vec<f64>>) -> Vec<Vec<u64>> {
    states.into_iter().map(|state| state.iter().map(|x| x.to_bits()).collect()).collect()
}

/// Seventy arms, more than one chunk for any number of threads, some of them with another payload.
fn arms(base: &Arc<Rig>) -> (Vec<Arc<Rig>>, Vec<Initial>) {
    let rig = |k: usize| match k % 7 {
        3 => with_payload(base, 1.0 + k as f64 * 0.1),
        _ => Arc::clone(base),
    };
    let rigs: Vec<_> = (0..70).map(rig).collect();
    let start = |(k, rig): (usize, &Arc<Rig>)| {
        Initial::rest(rig).with(rig, "muscle_pressure", 1e5 + 1e3 * k as f64).unwrap()
    };
    let initial = rigs.iter().enumerate().map(start).collect();
    (rigs, initial)
}

/// State and channels of one arm that runs alone for some samples.
fn alone(rig: &Rig, initial: &Initial, row: usize, samples: usize) -> (Vec<f64>, Trajectory) {
    let signal: Vec<f64> = (0..samples).map(|k| command(row, k)).collect();
    let mut progress = Progress::start(rig, initial).unwrap();
    let mut out = Trajectory::new(rig, samples);
    let drive = Drive::new(rig, samples, &[("valve_command", &signal)]).unwrap();
    progress.advance(rig, TIMING.stable(rig).unwrap(), &drive, &mut out).unwrap();
    (progress.to_vec(), out)
}

#[test]
fn threads_and_neighbours_change_no_bit() {
    for (base, lanes) in [(rig(), true), (leaky(), false)] {
        let (rigs, initial) = arms(&base);
        let mut found = Vec::new();
        for threads in [1, 2, 5] {
            let mut batch = Batch::new(&rigs, TIMING, &initial, threads).unwrap();
            assert_eq!(batch.side_by_side(), [lanes; 70]);
            run(&mut batch, 0..60);
            found.push((bits(batch.states()), batch.observe()));
        }
        assert_eq!(found[0], found[1]);
        assert_eq!(found[0], found[2]);
        for row in [0, 3, 17, 69] {
            let (own, start) = (Arc::clone(&rigs[row]), initial[row].clone());
            let mut batch = Batch::new(&[own], TIMING, &[start], 1).unwrap();
            for k in 0..60 {
                let held = [command(row, k)];
                batch.advance(1, &[("valve_command", &held)], true, &mut quiet).unwrap();
            }
            assert_eq!(bits(batch.states())[0], found[0].0[row], "row {row}");
        }
    }
}

#[test]
fn every_row_is_the_plant_alone() {
    for base in [rig(), leaky()] {
        let (rigs, initial) = arms(&base);
        let mut batch = Batch::new(&rigs, TIMING, &initial, 2).unwrap();
        let lanes = batch.side_by_side()[0];
        run(&mut batch, 0..60);
        let (states, seen) = (batch.states(), batch.observe());
        for row in [0, 3, 17, 69] {
            let (state, out) = alone(&rigs[row], &initial[row], row, 60);
            let pairs = out.channels.iter().enumerate().map(|(channel, values)| {
                let size = values.iter().fold(1e-6_f64, |size, value| size.max(value.abs()));
                (seen[channel * 70 + row], values[59], size)
            });
            for (found, wanted, size) in pairs {
                let most = if lanes { 1e-9 * size } else { 0.0 };
                assert!((found - wanted).abs() <= most, "row {row}: {found} {wanted}");
            }
            for (found, wanted) in states[row].iter().zip(&state) {
                let most = if lanes { 1e-9 * wanted.abs().max(1e-6) } else { 0.0 };
                assert!((found - wanted).abs() <= most, "row {row}: {found} {wanted}");
            }
        }
    }
}

#[test]
fn several_samples_at_once_are_so_many_single_ones() {
    [rig(), leaky()].into_iter().for_each(one_or_many);
}

fn one_or_many(base: Arc<Rig>) {
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

/// Arms thrown at stops so soft that they go beyond the curves of the lanes, and come back.
#[test]
fn beyond_the_curves_a_plant_runs_alone_and_a_restart_is_still_exact() {
    let mut spec = rig().spec().clone();
    spec.joints[0].stop_stiffness = 5.0;
    spec.joints[0].stop_damping = 0.0;
    let base = Arc::new(compiled(spec));
    let (rigs, samples) = (vec![Arc::clone(&base); 6], 400);
    let throw = |k: usize| Initial::rest(&base).with(&base, "joint_rate", 4.0 * k as f64).unwrap();
    let initial: Vec<_> = (0..6).map(throw).collect();
    let held = [10.0; 6];
    let advance = |batch: &mut Batch, samples: usize| {
        batch.advance(samples, &[("valve_command", &held)], true, &mut quiet).unwrap();
    };
    let mut whole = Batch::new(&rigs, TIMING, &initial, 1).unwrap();
    advance(&mut whole, samples);
    let spent = whole.spent();
    assert!(spent.alone > 0 && spent.steps > 0, "{spent:?}");
    let mut cut = Batch::new(&rigs, TIMING, &initial, 1).unwrap();
    for part in 1..=samples / 10 {
        advance(&mut cut, 7);
        let (states, none) = (cut.states(), vec![None; 6]);
        cut = Batch::new(&rigs, TIMING, &initial, 1).unwrap();
        cut.restore(part as u64 * 10 - 3, &states, &none).unwrap();
        advance(&mut cut, 3);
    }
    assert_eq!(bits(cut.states()), bits(whole.states()));
    assert_eq!(cut.observe(), whole.observe());
    for row in [0, 5] {
        let mut progress = Progress::start(&base, &initial[row]).unwrap();
        let mut out = Trajectory::new(&base, samples);
        let signal = vec![10.0; samples];
        let drive = Drive::new(&base, samples, &[("valve_command", &signal)]).unwrap();
        progress.advance(&base, TIMING.stable(&base).unwrap(), &drive, &mut out).unwrap();
        for (channel, values) in out.channels.iter().enumerate() {
            let size = values.iter().fold(1e-6_f64, |size, value| size.max(value.abs()));
            let found = whole.observe()[channel * 6 + row];
            assert!((found - values[samples - 1]).abs() <= 1e-8 * size, "row {row}");
        }
    }
}

#[test]
fn a_row_that_fails_stays_at_its_last_good_sample_and_the_others_go_on() {
    [rig(), leaky()].into_iter().for_each(one_fails);
}

fn one_fails(base: Arc<Rig>) {
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
    let states = batch.states();
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
    let other =
        Arc::new(compiled(RigSpec::from_json(include_str!("../data/shoulder.json")).unwrap()));
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
    let states = batch.states();
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
    assert_eq!(bits(batch.states()), bits(states));
}

#[test]
fn a_look_outside_ends_a_run_at_a_sample() {
    [rig(), leaky()].into_iter().for_each(look_ends_run);
}

fn look_ends_run(base: Arc<Rig>) {
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
