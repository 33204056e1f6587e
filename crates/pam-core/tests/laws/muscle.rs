//! Property and golden-vector tests of the muscle: geometry, force and compiled table against
//! physics reference sections 1, 2 and 8, and against `muscle_static.csv` of the golden vectors.

use std::path::PathBuf;

use pam_core::dual::Slope;
use pam_core::muscle::{CompiledMuscle, Muscle, MuscleSpec, TablePoint};
use proptest::prelude::*;

const INCH: f64 = 0.0254;

fn spec(length: f64, diameter: f64, angle_deg: f64, wall: f64) -> MuscleSpec {
    MuscleSpec {
        modulus_slope: vec![3.0, -0.35, 0.0, 0.0],
        modulus_offset: vec![1.15e6, -0.15e6, 0.0, 0.0],
        ..MuscleSpec::plain("robinson", length, diameter, angle_deg.to_radians(), wall)
    }
}

fn named(name: &str) -> Option<MuscleSpec> {
    match name {
        "shoulder_1in" => Some(spec(0.276, INCH, 73.5, 0.003_175)),
        "elbow_0625in" => Some(spec(7.785 * INCH, 0.625 * INCH, 72.5, INCH / 16.0)),
        "ch2_075in" => Some(spec(7.3 * INCH, 0.75 * INCH, 76.5, INCH / 8.0)),
        _ => None,
    }
}

#[test]
fn golden_vectors() {
    let path =
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/golden/muscle_static.csv");
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("skipped: {} is absent", path.display());
        return;
    };
    let mut worst = [0.0_f64; 4];
    let mut rows = 0;
    for line in text.lines().skip(1).filter(|l| !l.trim().is_empty()) {
        let cells: Vec<&str> = line.split(',').collect();
        let muscle = Muscle::new(&named(cells[0]).expect("a known muscle")).unwrap();
        let v: Vec<f64> = cells[1..].iter().map(|c| c.trim().parse().unwrap()).collect();
        let shape = muscle.shape(v[0]).unwrap();
        let relative = |found: f64, golden: f64| (found / golden - 1.0).abs();
        worst[0] = worst[0].max(relative(shape.radius, v[1])).max(relative(shape.thickness, v[2]));
        worst[1] = worst[1].max(relative(shape.air_volume, v[3]));
        worst[2] = worst[2].max((shape.eps_c - v[4]).abs());
        for (pressure, golden) in [1e5, 4e5, 8e5].into_iter().zip(&v[5..]) {
            worst[3] = worst[3].max(relative(muscle.force(pressure, v[0]).unwrap(), *golden));
        }
        rows += 1;
    }
    println!(
        "{rows} rows: radius/thickness {:.1e} volume {:.1e} eps_c {:.1e} force {:.1e}",
        worst[0], worst[1], worst[2], worst[3]
    );
    assert!(rows >= 39);
    assert!(worst.iter().all(|w| *w < 1e-9), "{worst:?}");
}

fn compiled(spec: &MuscleSpec) -> CompiledMuscle {
    CompiledMuscle::new(Muscle::new(spec).unwrap()).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None,
        ..ProptestConfig::default() })]

    #[test]
    fn shapes_are_possible(
        length in 0.1..0.6_f64,
        slenderness in 0.06..0.12_f64,
        angle in 69.0..78.0_f64,
        wall in 0.05..0.15_f64,
        at in 0.0..1.0_f64,
    ) {
        let diameter = slenderness * length;
        let spec = spec(length, diameter, angle, wall * diameter);
        let muscle = compiled(&spec);
        let (low, high) = (muscle.table.e_min, muscle.table.e_max);
        let e = low + at * (high - low);
        let shape = muscle.exact.shape(e).unwrap();
        prop_assert!(shape.thickness > 0.0 && shape.thickness < shape.radius);
        prop_assert!(shape.air_volume > 0.0);
        prop_assert_eq!(shape.radius > 0.5 * diameter, e > 0.0);
        let (i1, i2) = muscle.exact.geometry.integrals(e).unwrap();
        let (q1, q2) = muscle.exact.geometry.integrals_by_quadrature(e).unwrap();
        prop_assert!((i1 / q1 - 1.0).abs() < 1e-12);
        prop_assert!((i2 / q2 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn table_agrees_with_the_exact_solve(
        length in 0.1..0.6_f64,
        slenderness in 0.06..0.12_f64,
        angle in 69.0..78.0_f64,
        wall in 0.05..0.15_f64,
        scale in 0.5..2.0_f64,
        pressure in 0.0..1.5e6_f64,
        at in 0.0..1.0_f64,
    ) {
        let diameter = slenderness * length;
        let mut spec = spec(length, diameter, angle, wall * diameter);
        spec.modulus_scale = scale;
        let muscle = compiled(&spec);
        let (low, high) = (muscle.table.e_min, muscle.table.e_max);
        prop_assert!(muscle.table.error_bound() <= 1e-9);
        let e = low + at * (high - low);
        let point: TablePoint = muscle.table.eval(e);
        let blocked = muscle.exact.force(pressure.max(1e5), low).unwrap().abs();
        let exact = muscle.exact.force(pressure, e).unwrap();
        prop_assert!((point.force(pressure, scale) - exact).abs() < 1e-8 * blocked);
        let slope = muscle.exact.geometry.solve_dual(e).unwrap().air_volume;
        prop_assert!((point.volume - slope.re).abs() < 2e-9 * slope.re);
        let dual = muscle.table.eval(Slope::new(e, 1.0));
        prop_assert!((dual.volume.slope() - point.volume_slope).abs() <= 1e-11
            * point.volume_slope.abs());
    }

    #[test]
    fn any_input_gives_a_value_or_a_named_error(e in any::<f64>(), pressure in any::<f64>()) {
        let muscle = named("shoulder_1in").map(|s| Muscle::new(&s).unwrap()).unwrap();
        match muscle.force(pressure, e) {
            Ok(force) => prop_assert!(force.is_finite()),
            Err(error) => prop_assert!(error.to_string().contains("muscle.")),
        }
    }
}
