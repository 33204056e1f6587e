//! `pam_crowding_contact`: muscles that swell until they press on their neighbours or on the frame.
//!
//! `F = -A p_g d (d/d_0)^(n-1) (1 - m L'/sqrt(L'^2 + v^2))` for each muscle, `d = max(e - e_c, 0)`
//! its contraction beyond that at which they touch, the corner rounded over 0.005, `d_0` = 0.1:
//! what presses sideways is the gas, so that the loss grows with pressure, and the patch that
//! touches grows with the depth, so that `n` is 1 where sides meet flat, 1.5 where round ones do
//! (Hertz) and 2 where pointed ones do. What touches rubs, against the motion, by a share `m` of
//! the loss, in full from a few times `v` = 3 mm/s. R. M. Robinson, C. S. Kothera & N. M. Wereley,
//! "Variable recruitment testing of pneumatic artificial muscles for robotic manipulators",
//! IEEE/ASME Trans. Mechatronics 20, 2015.

use super::{
    beyond, progressive, AtMuscle, Effect, EffectInfo, EffectParameter, Extremes, Form, Port,
};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "pam_crowding_contact",
    block: "muscle",
    at: "muscle",
    order: 4,
    source: "Robinson, Kothera & Wereley (2015)",
    forms: &[Form {
        name: "progressive",
        parameters: &[
            EffectParameter::new("contact_area", "m2", 0.0, 1.0, 0.001)
                .starts(&[0.0005, 0.003])
                .off(0.0),
            EffectParameter::new("onset_contraction", "1", -1.0, 1.0, 0.12)
                .starts(&[0.04, 0.08, 0.15]),
            EffectParameter::new("exponent", "1", 1.0, 2.0, 1.0).starts(&[1.5]).prior(1.5, 0.25),
            EffectParameter::new("rubbing", "1", 0.0, 1.0, 0.0).starts(&[0.1]),
        ],
        states: &[],
        integrates: false,
        ports: &[Port::Force],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

const CORNER: f64 = 0.005;

/// Contraction beyond the onset at which the area is that of a spring.
const SECANT: f64 = 0.1;

/// Speed of a muscle's length by which most of the rubbing is there [m/s].
const SLOW: f64 = 3e-3;

/// Force of one muscle [N] at a gauge pressure [Pa], a contraction ratio and a rate of its length
/// [m/s].
#[inline]
pub fn force<S: Scalar>(contact: [S; 4], pressure: S, contraction: S, length_rate: S) -> S {
    let [area, onset, exponent, rubbing] = contact;
    let positive = if pressure.re() > 0.0 { pressure } else { constant(0.0) };
    let against = rubbing * length_rate / (length_rate * length_rate + SLOW * SLOW).sqrt();
    -(area
        * positive
        * progressive(beyond(contraction - onset, CORNER), SECANT, exponent)
        * (-against + 1.0))
}

/// Largest damping [N s/m] up to a gauge pressure [Pa] and a contraction ratio.
pub fn largest(contact: [f64; 4], pressure: f64, contraction: f64) -> f64 {
    let [area, onset, exponent, rubbing] = contact;
    rubbing * force([area, onset, exponent, 0.0], pressure, contraction, 0.0).abs() / SLOW
}

/// Largest slope of the force with the contraction ratio [N], rubbing included.
pub fn stiffest(contact: [f64; 4], pressure: f64, contraction: f64) -> f64 {
    let [area, onset, exponent, rubbing] = contact;
    let depth = (contraction - onset).max(0.0);
    area * pressure.max(0.0) * exponent * (depth / SECANT).powf(exponent - 1.0) * (1.0 + rubbing)
}

/// Contact of a muscle that swells.
#[derive(Debug, Clone, Copy)]
struct Contact<S>([S; 4]);

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Contact(std::array::from_fn(|k| values[k])))
}

impl<S: Scalar> Effect<S> for Contact<S> {
    fn force(&self, at: &AtMuscle<S>, _own: &[S]) -> S {
        force(self.0, at.gauge, at.contraction, at.rate)
    }

    fn resistance(&self, most: &Extremes) -> (f64, f64) {
        let contact = self.0.map(|v| v.re());
        let gauge = most.pressure - most.ambient;
        (largest(contact, gauge, most.contraction), stiffest(contact, gauge, most.contraction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_begins_at_the_onset_and_grows_with_pressure() {
        let flat = [1e-3, 0.12, 1.0, 0.0];
        assert_eq!(force(flat, 4e5, 0.1, 0.0), 0.0);
        assert!((force(flat, 4e5, 0.22, -0.1) + 1e-3 * 4e5 * 0.0975_f64).abs() < 1e-9);
        assert_eq!(force(flat, -1e4, 0.2, 0.0), 0.0);
        assert_eq!(force([0.0, 0.12, 1.0, 0.3], 4e5, 0.2, -0.1), 0.0);
    }

    #[test]
    fn what_touches_rubs_against_the_motion() {
        let rough = [1e-3, 0.12, 1.0, 0.2];
        let still = force(rough, 4e5, 0.2, 0.0);
        assert!((force(rough, 4e5, 0.2, -1.0) / still - 1.2_f64).abs() < 1e-5);
        assert!((force(rough, 4e5, 0.2, 1.0) / still - 0.8_f64).abs() < 1e-5);
        assert_eq!(force(rough, 4e5, 0.1, -1.0), 0.0);
        let slope = (force(rough, 4e5, 0.2, 1e-6) - force(rough, 4e5, 0.2, -1e-6)) / 2e-6;
        assert!((slope / largest(rough, 4e5, 0.2) - 1.0).abs() < 1e-6);
        let pointed = [1e-3, 0.12, 1.6, 0.2];
        let slope =
            (force(pointed, 4e5, 0.200_001, -1.0) - force(pointed, 4e5, 0.199_999, -1.0)) / 2e-6;
        assert!((-slope / stiffest(pointed, 4e5, 0.2) - 1.0).abs() < 0.03);
    }

    #[test]
    fn round_sides_touch_softly_at_first() {
        let round = [1e-3, 0.12, 1.5, 0.0];
        let depth = |e: f64| e - 0.12 - 0.5 * CORNER;
        let hertz = |e: f64| -1e-3 * 4e5 * depth(e).powf(1.5) / SECANT.sqrt();
        assert!((force(round, 4e5, 0.15, 0.0) - hertz(0.15)).abs() < 1e-9);
        assert!((force(round, 4e5, 0.25, 0.0) / hertz(0.25) - 1.0).abs() < 1e-12);
        assert_eq!(force(round, 4e5, 0.12, 0.0), 0.0);
    }
}
