//! Plants side by side against each of them alone.

use pam_core::lanes::{simulate as side_by_side, Outcome, Reduce, Reduction, Request, Signal};
use pam_core::simulate::drive::Drive;
use pam_core::simulate::run::Run;
use pam_core::simulate::{simulate, Initial, Progress, Timing, Trajectory};
use pam_core::Rig;

use super::rigs::{self, compiled};

const ROWS: usize = 161;
const TIMING: Timing = Timing { sample_time: 0.005, substeps: 5 };

/// Commands that fill, hold and vent.
fn commands(rig: &Rig) -> Vec<(String, Vec<f64>)> {
    let wave = |k: usize, row: usize| {
        let time = row as f64 * TIMING.sample_time;
        let wave = (7.0 * time + k as f64).sin();
        if wave.abs() < 0.2 {
            0.0
        } else {
            0.9 * wave
        }
    };
    let valves = rig.spec().valves.iter();
    let spans: Vec<(f64, f64)> = valves.map(|v| (v.null_voltage, v.half_range)).collect();
    let signal = |(k, name): (usize, &String)| {
        let value = |row| match spans.get(k) {
            Some((null, half)) => null + half * wave(k, row),
            None => 3e5 + 1e5 * wave(k, row),
        };
        (name.clone(), (0..ROWS).map(value).collect())
    };
    rig.names().inputs.iter().enumerate().map(signal).collect()
}

fn request<'a>(
    rig: &Rig,
    plants: usize,
    signals: &'a [(String, Vec<f64>)],
    parameters: Vec<(&'a str, &'a [f64])>,
) -> Request<'a> {
    Request {
        plants,
        timing: TIMING,
        rows: ROWS,
        signals: signals.iter().map(|(n, s)| (n.as_str(), Signal::Common(s))).collect(),
        parameters,
        initial: Vec::new(),
        record: (0..rig.names().channels.len()).collect(),
        every: 1,
        reduce: Vec::new(),
        threads: 2,
    }
}

fn run(rig: &Rig, request: &Request<'_>) -> Outcome {
    side_by_side(rig, request, &mut || Ok(())).unwrap()
}

/// Values of a parameter about the rig's own, one for each row.
fn spread(rig: &Rig, name: &str, plants: usize) -> Vec<f64> {
    let own = rig.parameters().value(rig.parameters().find(name).unwrap());
    (0..plants).map(|k| own * (0.7 + 0.6 * k as f64 / plants as f64)).collect()
}

/// Largest difference of each channel from each plant alone, over the channel's largest magnitude.
fn apart(rig: &Rig, request: &Request<'_>, outcome: &Outcome) -> f64 {
    let mut worst = 0.0_f64;
    for plant in 0..request.plants {
        let mut values = rig.parameters().values().to_vec();
        for (name, given) in &request.parameters {
            values[rig.parameters().find(name).unwrap().index()] = given[plant];
        }
        let alone = rig.with_values(&values).unwrap();
        let signals: Vec<(&str, &[f64])> = (request.signals.iter())
            .map(|(name, signal)| match signal {
                Signal::Common(values) => (*name, *values),
                Signal::Each(values) => (*name, &values[plant * ROWS..(plant + 1) * ROWS]),
            })
            .collect();
        let timing = TIMING.stable(&alone).unwrap();
        let wanted = simulate(&alone, ROWS, &signals, timing, &Initial::rest(&alone)).unwrap();
        for (found, wanted) in outcome.recorded.iter().zip(&wanted.channels) {
            let size = wanted.iter().fold(1e-6_f64, |size, value| size.max(value.abs()));
            for (found, wanted) in found[plant * ROWS..].iter().zip(wanted) {
                let error = (found - wanted).abs() / size;
                worst = if error <= worst { worst } else { error };
            }
        }
    }
    worst
}

fn one_link_rigs() -> Vec<(&'static str, Rig)> {
    let mut sprung = rigs::shoulder();
    (sprung.joints[0].stiffness, sprung.joints[0].spring_angle) = (40.0, 1.2);
    let mut tilted = rigs::shoulder();
    let arm = tilted.arm.as_mut().unwrap();
    (arm.base_angle, arm.centre_angle) = (-0.7, 0.2);
    let mut warm = rigs::shoulder();
    let muscle = &mut warm.muscles[0].muscle;
    (muscle.softening, muscle.temperature) = (4e-3, 333.15);
    let specs = [
        ("shoulder", rigs::shoulder()),
        ("antagonists", rigs::antagonists()),
        ("regulated", rigs::regulated()),
        ("sprung", sprung),
        ("tilted", tilted),
        ("warm", warm),
    ];
    specs.map(|(name, spec)| (name, compiled(spec))).into()
}

#[test]
fn each_lane_is_the_plant_alone() {
    for (name, rig) in one_link_rigs() {
        let signals = commands(&rig);
        let payload = spread(&rig, "arm.payload", 19);
        let opening = |name: &&String| name.ends_with("discharge_area_max");
        let opening = rig.parameters().names().iter().find(opening).unwrap().clone();
        let area = spread(&rig, &opening, 19);
        let gauge = |name: &&String| name.starts_with("supply") && name.ends_with(".pressure_zero");
        let gauge = rig.parameters().names().iter().find(gauge).unwrap().clone();
        let zero: Vec<f64> = (0..19).map(|k| 100.0 * f64::from(k)).collect();
        let parameters = vec![
            ("arm.payload", &payload[..]),
            (opening.as_str(), &area[..]),
            (gauge.as_str(), &zero[..]),
        ];
        let request = request(&rig, 19, &signals, parameters);
        let outcome = run(&rig, &request);
        assert!(outcome.failures.iter().all(Option::is_none), "{name}");
        let worst = apart(&rig, &request, &outcome);
        println!("{name}: {worst:.2e}");
        assert!(worst < 1e-7, "{name}: {worst}");
    }
}

#[test]
fn neighbours_and_threads_change_no_bit() {
    let rig = compiled(rigs::shoulder());
    let signals = commands(&rig);
    let payload = spread(&rig, "arm.payload", 150);
    let whole = run(&rig, &request(&rig, 150, &signals, vec![("arm.payload", &payload)]));
    let mut single = request(&rig, 150, &signals, vec![("arm.payload", &payload)]);
    single.threads = 1;
    assert_eq!(whole, run(&rig, &single));
    for plant in [0, 7, 31, 32, 64, 149] {
        let own = [payload[plant]];
        let alone = run(&rig, &request(&rig, 1, &signals, vec![("arm.payload", &own)]));
        for (alone, whole) in alone.recorded.iter().zip(&whole.recorded) {
            assert_eq!(alone[..], whole[plant * ROWS..(plant + 1) * ROWS]);
        }
    }
}

#[test]
fn numbers_of_a_run_are_those_of_its_samples() {
    let rig = compiled(rigs::shoulder());
    let signals = commands(&rig);
    let payload = spread(&rig, "arm.payload", 11);
    let mut request = request(&rig, 11, &signals, vec![("arm.payload", &payload)]);
    let angle = rig.names().channels.iter().position(|(n, _)| n == "joint_angle").unwrap();
    let reference: Vec<f64> = (0..ROWS).map(|k| 0.3 + 0.001 * k as f64).collect();
    request.reduce = Reduction::NAMES
        .iter()
        .map(|(_, reduction)| Reduce {
            channel: angle,
            reduction: *reduction,
            reference: reference.clone(),
        })
        .collect();
    let outcome = run(&rig, &request);
    for plant in 0..11 {
        let samples = &outcome.recorded[angle][plant * ROWS..(plant + 1) * ROWS];
        let squares: Vec<f64> =
            samples.iter().zip(&reference).map(|(a, b)| (a - b) * (a - b)).collect();
        let ends = 0.5 * (squares[0] + squares[ROWS - 1]);
        let wanted = [
            samples[ROWS - 1],
            samples.iter().copied().fold(f64::INFINITY, f64::min),
            samples.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            samples.iter().fold(0.0, |most: f64, a| most.max(a.abs())),
            samples.iter().sum::<f64>() / ROWS as f64,
            (squares.iter().sum::<f64>() - ends) * TIMING.sample_time,
        ];
        for (found, wanted) in outcome.reduced.iter().zip(wanted) {
            assert!((found[plant] - wanted).abs() < 1e-12, "{} {wanted}", found[plant]);
        }
    }
}

/// A run of a rig, by the equations of the lanes where it can be or by those of the blocks.
fn lone(
    rig: &Rig,
    run: &mut Run<'_>,
    signals: &[(String, Vec<f64>)],
    start: &Initial,
) -> Trajectory {
    let signals: Vec<(&str, &[f64])> =
        signals.iter().map(|(name, values)| (name.as_str(), &values[..])).collect();
    let drive = Drive::new(rig, ROWS, &signals).unwrap();
    let timing = TIMING.stable(rig).unwrap();
    let (mut progress, mut out) =
        (Progress::start(rig, start).unwrap(), Trajectory::new(rig, ROWS));
    progress.observe_in(run, timing, &mut out).unwrap();
    let held = 0..ROWS - 1;
    progress.advance_in(run, timing, &drive, held, &mut out, &mut || Ok(())).unwrap();
    out
}

/// States and events of a run in a lane of its own: bits of the lanes, events of the blocks' run.
#[test]
fn a_run_in_a_lane_of_its_own_is_the_run_by_the_blocks() {
    for (name, rig) in one_link_rigs() {
        let signals = commands(&rig);
        // The second leaves the range of the curves on the way.
        for rate in [0.0, 40.0] {
            let (joint, _) =
                rig.names().initial.iter().find(|(name, _)| name.contains("rate")).unwrap();
            let start = Initial::rest(&rig).with(&rig, joint, rate).unwrap();
            let [found, wanted] = [Run::alone(&rig), Run::new(&rig)]
                .map(|run| lone(&rig, &mut run.unwrap(), &signals, &start));
            let rates = [rate];
            let mut request = request(&rig, 1, &signals, Vec::new());
            request.initial = vec![(joint, &rates)];
            let lane = run(&rig, &request);
            let channels = found.channels.iter().zip(&wanted.channels).zip(&lane.recorded);
            for (k, ((found, wanted), lane)) in channels.enumerate() {
                let (channel, _) = &rig.names().channels[k];
                assert_eq!(found, lane, "{name} {rate}: {channel}");
                let size = wanted.iter().fold(1e-6_f64, |size, value| size.max(value.abs()));
                for (found, wanted) in found.iter().zip(wanted) {
                    let error = (found - wanted).abs() / size;
                    assert!(error < 1e-7, "{name} {rate}: {channel} {error:e}");
                }
            }
            assert_eq!(found.events.len(), wanted.events.len(), "{name} {rate}");
            assert!(!found.events.is_empty(), "{name} {rate}: nothing happened");
            for (found, wanted) in found.events.iter().zip(&wanted.events) {
                assert_eq!((found.kind, &found.block), (wanted.kind, &wanted.block));
                assert!((found.time - wanted.time).abs() < 1e-7, "{found:?} {wanted:?}");
            }
        }
    }
}
