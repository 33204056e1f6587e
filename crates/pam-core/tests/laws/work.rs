//! The work done for fixed problems, against the files beside this one: it does not depend on the
//! machine's load, as times do, and must not grow unnoticed. `make snapshots` writes them anew
//! where it has changed on purpose.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::Arc;

use super::rigs::{
    antagonists, effect, lone_tank, regulated, rig_for, shoulder, two_joints, TYPICAL,
};
use pam_core::batch::Batch;
use pam_core::lanes::{simulate as side_by_side, Request, Signal, Spent};
use pam_core::muscle::{CompiledMuscle, ForceModel, Muscle, MuscleSpec};
use pam_core::simulate::{Initial, Timing};
use pam_core::{Rig, RigSpec};

const GEOMETRIES: [&str; 3] = ["cylinder", "elliptic", "elliptic_published"];
const SAMPLE: Timing = Timing { sample_time: 0.1, substeps: 1 };

/// Compares a table with its file, or writes it.
fn compare(name: &str, table: &str) {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/work").join(name);
    if std::env::var("PAMRS_SNAPSHOTS").as_deref() == Ok("write") {
        std::fs::write(&file, table).unwrap();
        return;
    }
    let stored = std::fs::read_to_string(&file).unwrap();
    let lines = stored.lines().zip(table.lines()).filter(|(was, is)| was != is);
    let other: Vec<String> = lines.map(|(was, is)| format!("{was}  ->  {is}")).collect();
    assert_eq!(other, [""; 0], "{name}: other work than stored; `make snapshots` if that is meant");
    assert_eq!(stored.lines().count(), table.lines().count(), "{name}: other lines than stored");
}

fn spec(model: &str, geometry: &str) -> MuscleSpec {
    let mut spec = MuscleSpec::plain(model, 0.276, 0.0254, 73.5_f64.to_radians(), 0.003_175);
    spec.geometry = Some(geometry.into());
    if ForceModel::from_name(model).unwrap().is_polynomial() {
        (spec.modulus_slope, spec.modulus_offset) = (vec![3.0, -0.35], vec![1.15e6, -0.15e6]);
    }
    match model {
        "mooney_rivlin" => (spec.c10, spec.c01) = (2e5, 5e4),
        "elbow_linear" => spec.bladder_modulus = 1e6,
        _ => {}
    }
    spec
}

/// Function evaluations of the root solves over the range of contractions, and the most that one
/// takes.
#[test]
fn root_solves_of_the_geometry() {
    let mut table =
        String::from("# geometry: evaluations of 101 root solves, of the longest one\n");
    for geometry in GEOMETRIES {
        let muscle = Muscle::new(&spec("robinson", geometry)).unwrap();
        let (low, high) =
            CompiledMuscle::new(muscle.clone()).map(|m| (m.table.e_min, m.table.e_max)).unwrap();
        let solves =
            (0..=100).map(|k| (low + (high - low) * f64::from(k) / 100.0).clamp(low, high));
        let spent: Vec<u32> = solves.map(|e| muscle.shape(e).unwrap().iterations).collect();
        writeln!(
            table,
            "{geometry}: {} {}",
            spent.iter().sum::<u32>(),
            spent.iter().max().unwrap()
        )
        .unwrap();
    }
    compare("root_solves.txt", &table);
}

/// Cells of the table of every force model: as many exact solves as its construction takes, but for
/// a factor.
#[test]
fn cells_of_the_tables() {
    let mut table = String::from("# force model, geometry: cells of the table\n");
    // a map is a table of forces, not of solves
    for model in ForceModel::NAMES.iter().map(|(name, _)| *name).filter(|name| *name != "map") {
        for geometry in GEOMETRIES {
            let compiled =
                CompiledMuscle::new(Muscle::new(&spec(model, geometry)).unwrap()).unwrap();
            writeln!(table, "{model} {geometry}: {}", compiled.table.cells()).unwrap();
        }
    }
    compare("table_cells.txt", &table);
}

/// Steps into which a sample of 100 ms is divided at least, since the rig's fastest rate allows no
/// longer ones.
#[test]
fn steps_of_a_sample() {
    let steps = |spec: RigSpec| SAMPLE.stable(&Rig::new(spec).unwrap()).unwrap().substeps;
    let mut table = String::from("# rig or effect: least steps of a sample of 100 ms\n");
    let plain = [
        ("shoulder", shoulder()),
        ("antagonists", antagonists()),
        ("two joints", two_joints()),
        ("regulated", regulated()),
        ("tank", lone_tank()),
    ];
    for (name, spec) in plain {
        writeln!(table, "{name}: {}", steps(spec)).unwrap();
    }
    for typical in TYPICAL {
        let mut spec = rig_for(typical.id);
        spec.effects = vec![effect(typical.id, typical.parameters)];
        writeln!(table, "{}: {}", typical.id, steps(spec)).unwrap();
    }
    compare("steps.txt", &table);
}

/// Plants of a run, more than one block of them.
const PLANTS: usize = 70;
/// Rows of time.
const ROWS: usize = 81;

/// The rate at which each of some plants begins [rad/s].
type Rates = fn(usize) -> f64;

/// What 70 plants cost that differ in where they begin, as whole runs and sample by sample.
fn spent(spec: RigSpec, rate: Rates) -> [Spent; 2] {
    let rig = Arc::new(Rig::new(spec).unwrap());
    let timing = Timing { sample_time: 0.005, substeps: 1 };
    let valves: Vec<f64> =
        rig.spec().valves.iter().map(|v| v.null_voltage + 0.4 * v.half_range).collect();
    let signals: Vec<(String, Vec<f64>)> =
        rig.names().inputs.iter().cloned().zip(valves.iter().map(|v| vec![*v; ROWS])).collect();
    let is_rate = |(name, _): &&(String, usize)| name.contains("rate");
    let (name, _) = rig.names().initial.iter().find(is_rate).unwrap().clone();
    let rates: Vec<f64> = (0..PLANTS).map(rate).collect();
    let request = Request {
        plants: PLANTS,
        timing,
        rows: ROWS,
        signals: signals.iter().map(|(n, s)| (n.as_str(), Signal::Common(s))).collect(),
        parameters: Vec::new(),
        initial: vec![(&name, &rates)],
        record: vec![0],
        every: 1,
        reduce: Vec::new(),
        threads: 1,
    };
    let whole = side_by_side(&rig, &request, &mut || Ok(())).unwrap().spent;
    let start = |rate: &f64| Initial::rest(&rig).with(&rig, &name, *rate).unwrap();
    let initial: Vec<Initial> = rates.iter().map(start).collect();
    let mut batch = Batch::new(&vec![Arc::clone(&rig); PLANTS], timing, &initial, 1).unwrap();
    let held: Vec<Vec<f64>> = valves.iter().map(|v| vec![*v; PLANTS]).collect();
    let signals: Vec<(&str, &[f64])> =
        rig.names().inputs.iter().zip(&held).map(|(n, v)| (n.as_str(), &v[..])).collect();
    for _ in 1..ROWS {
        batch.advance(1, &signals, true, &mut || Ok(())).unwrap();
    }
    [whole, batch.spent()]
}

/// What lanes do for whole runs and for a batch, and what they leave to plants alone.
#[test]
fn work_of_the_lanes() {
    let mut table = String::from(
        "# rig, way: blocks; in lanes steps of all plants, rates of them; samples alone\n",
    );
    let still: Rates = |_| 0.0;
    let thrown: Rates = |k| if k % 10 == 3 { 20.0 } else { 0.0 };
    let mut soft = shoulder();
    (soft.joints[0].stop_stiffness, soft.joints[0].stop_damping) = (5.0, 0.0);
    let mut leaky = shoulder();
    leaky.effects = vec![effect("leak_muscle", &[("conductance", 2e-10), ("laminar_share", 0.4)])];
    let rigs: [(&str, RigSpec, Rates); 5] = [
        ("shoulder", shoulder(), still),
        ("antagonists", antagonists(), still),
        ("regulated", regulated(), still),
        ("shoulder, some thrown at soft stops", soft, thrown),
        ("shoulder with a leak", leaky, still),
    ];
    for (name, spec, rate) in rigs {
        for (way, spent) in ["whole runs", "batch"].iter().zip(spent(spec, rate)) {
            let Spent { blocks, steps, evaluations, alone } = spent;
            writeln!(table, "{name}, {way}: {blocks}; {steps} {evaluations}; {alone}").unwrap();
        }
    }
    compare("lanes.txt", &table);
}
