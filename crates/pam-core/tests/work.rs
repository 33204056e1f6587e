//! The work done for fixed problems, against the files beside this one: it does not depend on the
//! machine's load, as times do, and must not grow unnoticed. `make snapshots` writes them anew
//! where it has changed on purpose.

use std::fmt::Write as _;
use std::path::PathBuf;

use pam_core::muscle::{CompiledMuscle, ForceModel, Muscle, MuscleSpec};
use pam_core::simulate::Timing;
use pam_core::{Rig, RigSpec};
use rigs::{antagonists, effect, lone_tank, regulated, shoulder, two_joints, TYPICAL};

mod rigs;

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
    for (model, _) in ForceModel::NAMES {
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
    let steps = |spec: RigSpec| SAMPLE.stable(&Rig::new(spec).unwrap()).substeps;
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
        let regulated_one = typical.id == "supply_regulator_deadband";
        let mut spec = if regulated_one { regulated() } else { shoulder() };
        spec.effects = vec![effect(typical.id, typical.parameters)];
        writeln!(table, "{}: {}", typical.id, steps(spec)).unwrap();
    }
    compare("steps.txt", &table);
}
