//! Linear loads: a mass hangs where the muscle carries it and keeps its energy, a frame gives the
//! static force.

use super::rigs::compiled;
use pam_core::muscle::{Muscle, MuscleSpec};
use pam_core::simulate::drive::Drive;
use pam_core::simulate::{Initial, Progress, Timing, Trajectory};
use pam_core::{Rig, RigSpec};

const SHOULDER: &str = include_str!("../data/shoulder.json");

fn rig(kind: &str, mass: f64, friction: f64) -> Rig {
    let mut spec = RigSpec::from_json(SHOULDER).unwrap();
    spec.arm = None;
    (spec.joints, spec.supplies, spec.valves) = (vec![], vec![], vec![]);
    spec.muscles[0].muscle.count = 1;
    spec.muscles[0].joint = "load".into();
    let text = format!(
        r#"{{"kind": "{kind}", "mass": {mass}, "viscous": {friction}, "coulomb_speed": 0.01,
            "gravity": 9.80665,
            "min_length": 0.2, "max_length": 0.28, "stop_stiffness": 1e6, "stop_damping": 1e3}}"#
    );
    spec.load = Some(serde_json::from_str(&text).unwrap());
    compiled(spec)
}

struct Run(Rig, Trajectory);

impl Run {
    fn get(&self, name: &str) -> &[f64] {
        self.1.get(&self.0, name).unwrap()
    }
}

fn run(
    rig: &Rig,
    initial: Initial,
    length: Option<&[f64]>,
    samples: usize,
) -> pam_core::Result<Run> {
    let timing = Timing { sample_time: 0.01, substeps: 20 };
    let mut progress = Progress::start(rig, &initial)?;
    let mut out = Trajectory::new(rig, samples);
    progress.observe(rig, timing, &mut out)?;
    let signals: Vec<_> = length.iter().map(|length| ("length", *length)).collect();
    progress.advance(rig, timing, &Drive::new(rig, samples, &signals)?, &mut out)?;
    Ok(Run(rig.clone(), out))
}

fn pressed(rig: &Rig, pressure: f64, shortening: f64) -> pam_core::Result<Initial> {
    Initial::rest(rig).with(rig, "muscle_pressure", pressure)?.with(
        rig,
        "length",
        0.276 - shortening,
    )
}

#[test]
fn a_mass_comes_to_rest_where_the_muscle_carries_it() {
    let rig = rig("mass", 50.0, 800.0);
    let out = run(&rig, pressed(&rig, 4e5, 0.02).unwrap(), None, 1500).unwrap();
    let (force, rate) =
        (out.get("muscle_force").last().unwrap(), out.get("length_rate").last().unwrap());
    assert!((force - 50.0 * 9.80665).abs() < 0.05, "{force}");
    assert!(rate.abs() < 1e-5, "{rate}");
}

#[test]
fn a_frame_gives_the_static_force_at_its_length() {
    let rig = rig("frame", 0.0, 0.0);
    let length: Vec<f64> = (1..=100).map(|k| 0.276 - 0.0005 * f64::from(k)).collect();
    let out = run(&rig, pressed(&rig, 3e5, 0.0).unwrap(), Some(&length), 100).unwrap();
    let muscle =
        Muscle::new(&MuscleSpec { count: 1, ..rig.spec().muscles[0].muscle.clone() }).unwrap();
    for (k, length) in length.iter().enumerate() {
        let e = 1.0 - length / 0.276;
        assert!((out.get("contraction_ratio")[k + 1] - e).abs() < 1e-14);
        let force = muscle.force(out.get("muscle_pressure")[k + 1], e).unwrap();
        let held = muscle.buckled(force); // at the shortest lengths it is slack
        assert!((out.get("muscle_force")[k + 1] - held).abs() < 1e-6 * held.abs().max(1.0));
    }
    assert!(
        out.get("muscle_pressure").last().unwrap() < &3e5,
        "the shut chamber grows: its pressure falls"
    );
}

#[test]
fn a_held_pressure_stays_and_a_moving_one_is_followed() {
    let rig = rig("frame", 0.0, 0.0);
    let length: Vec<f64> = (1..=50).map(|k| 0.276 - 0.0005 * f64::from(k)).collect();
    let pressure: Vec<f64> = (1..=50).map(|k| 2e5 + 1e3 * f64::from(k)).collect();
    let mut progress = Progress::start(&rig, &pressed(&rig, 2e5, 0.0).unwrap()).unwrap();
    let mut out = Run(rig.clone(), Trajectory::new(&rig, 50));
    let timing = Timing { sample_time: 0.01, substeps: 7 };
    let drive = Drive::new(&rig, 50, &[("length", &length), ("pressure", &pressure)]).unwrap();
    progress.advance(&rig, timing, &drive, &mut out.1).unwrap();
    for k in 0..50 {
        assert!((out.get("muscle_pressure")[k] - pressure[k]).abs() < 1e-9);
        assert!((out.get("contraction_ratio")[k] - (1.0 - length[k] / 0.276)).abs() < 1e-14);
    }
    let mut measured = RigSpec::from_json(SHOULDER).unwrap();
    let valve = compiled(measured.clone());
    let given: [(&str, &[f64]); 2] = [("valve_command", &[5.0]), ("supply_pressure", &[1e5])];
    let message = Drive::new(&valve, 1, &given).unwrap_err().to_string();
    assert!(message.contains("this one is \"tank\""), "{message}");
    measured.supplies[0].kind = "measured".into();
    let measured = compiled(measured);
    let commands = [5.0; 50];
    let given: [(&str, &[f64]); 2] = [("valve_command", &commands), ("supply_pressure", &pressure)];
    let drive = Drive::new(&measured, 50, &given).unwrap();
    let start = Initial::rest(&measured).with(&measured, "supply_pressure", 2e5).unwrap();
    let mut out = Run(measured.clone(), Trajectory::new(&measured, 50));
    Progress::start(&measured, &start)
        .unwrap()
        .advance(&measured, timing, &drive, &mut out.1)
        .unwrap();
    for (read, given) in out.get("supply_pressure").iter().zip(&pressure) {
        assert!((read - given).abs() < 1e-9);
    }
    let signals: [(&str, &[f64]); 2] = [("valve_command", &[5.0]), ("pressure", &[1e5])];
    let message = Drive::new(&valve, 1, &signals).unwrap_err().to_string();
    assert!(message.contains("without [valve]"), "{message}");
}

#[test]
fn a_load_cell_reads_its_gain_times_the_force() {
    let one = rig("frame", 0.0, 0.0);
    let mut spec = one.spec().clone();
    spec.sensors[0].force_gain = 1.04;
    let other = compiled(spec);
    let length = [0.25; 5];
    let [read, more] = [&one, &other].map(|rig| {
        let out = run(rig, pressed(rig, 3e5, 0.026).unwrap(), Some(&length), 5).unwrap();
        (out.get("muscle_force").to_vec(), out.get("muscle_work").to_vec())
    });
    assert!(read.0[0] > 100.0);
    assert!(read.0.iter().zip(&more.0).all(|(f, g)| (1.04 * f - g).abs() < 1e-9 * g));
    assert_eq!(read.1, more.1); // what the muscle does is the same
}

#[test]
fn loads_that_cannot_be_are_named() {
    let frame = rig("frame", 0.0, 0.0);
    for (length, word) in
        [(None, "length is missing"), (Some(vec![0.1]), "length[0]"), (Some(vec![]), "length")]
    {
        let message =
            run(&frame, Initial::rest(&frame), length.as_deref(), 1).err().unwrap().to_string();
        assert!(message.contains(word), "{message}");
    }
    let mass = rig("mass", 5.0, 0.0);
    let message = run(&mass, Initial::rest(&mass), Some(&[0.25]), 1).err().unwrap().to_string();
    assert!(message.contains("load frame"), "{message}");
    let message = pressed(&mass, 1e5, 0.2).unwrap_err().to_string();
    assert!(message.contains("initial.length"), "{message}");
    let mut spec = mass.spec().clone();
    spec.load.as_mut().unwrap().min_length = 0.05;
    assert!(Rig::new(spec).unwrap_err().to_string().contains("load.min_length"));
}
