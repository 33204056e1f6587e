//! Laws of the joints: the moment arm is the slope of the shortening, so that a joint conserves
//! power.

use pam_core::blocks::joint::tendon::{TendonJoint, Torque};
use pam_core::blocks::joint::{Joint, Polynomial, Pulley};
use pam_core::dual::Slope;
use proptest::prelude::*;

fn each(lengths: [f64; 4], radius: f64, coefficients: &[f64]) -> Vec<Joint> {
    let tendon = TendonJoint::new(lengths[0], lengths[1], lengths[2], lengths[3], 0.26).unwrap();
    vec![
        Joint::Tendon(tendon),
        Joint::Tendon(tendon.with_torque(Torque::Published)),
        Joint::Pulley(Pulley::new(radius, 0.26).unwrap()),
        Joint::Polynomial(Polynomial::new(coefficients, 0.26).unwrap()),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None,
        ..ProptestConfig::default() })]

    #[test]
    fn what_the_muscle_gives_the_link_gets(
        lengths in prop::array::uniform4(0.01..0.06_f64),
        radius in -0.05..0.05_f64,
        coefficients in prop::collection::vec(-0.05..0.05_f64, 1..6),
        angle in 0.3..2.0_f64,
    ) {
        for (index, joint) in each(lengths, radius, &coefficients).into_iter().enumerate() {
            if !joint.reaches(angle) {
                continue;
            }
            let point = joint.eval(Slope::new(angle, 1.0));
            let scale = point.moment_arm.re.abs().max(1e-3);
            prop_assert!((point.shortening.slope() - point.moment_arm.re).abs() < 1e-12 * scale);
            if index == 1 {
                prop_assert!(point.torque_arm.re.abs() <= point.moment_arm.re.abs());
            } else {
                prop_assert_eq!(point.torque_arm.re, point.moment_arm.re);
            }
        }
    }

    #[test]
    fn the_muscle_is_at_rest_length_at_the_rest_angle(
        lengths in prop::array::uniform4(0.01..0.06_f64),
        radius in -0.05..0.05_f64,
    ) {
        for joint in each(lengths, radius, &[0.03, 0.01]) {
            prop_assert!(joint.eval(0.26_f64).shortening.abs() < 1e-15);
        }
    }
}

#[test]
fn the_published_torque_loses_the_square_of_the_tendon_angles_cosine() {
    let (upper_axial, upper_offset, lower_axial, lower_offset) =
        (0.0254, 0.027_432, 0.027_432, 0.004_826);
    let joint =
        TendonJoint::new(upper_axial, upper_offset, lower_axial, lower_offset, 0.2618).unwrap();
    let angle = 1.2_f64;
    let phi = std::f64::consts::PI - angle - lower_offset.atan2(lower_axial);
    let rise = upper_offset - lower_axial.hypot(lower_offset) * phi.sin();
    let cos_squared = 1.0 - (rise / joint.tendon_length()).powi(2);
    let point = joint.with_torque(Torque::Published).eval(angle);
    assert!((point.torque_arm / point.moment_arm - cos_squared).abs() < 1e-12);
}
