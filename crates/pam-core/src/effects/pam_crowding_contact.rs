//! `pam_crowding_contact`: muscles that swell until they press on their neighbours or on the frame.
//!
//! `F = -A p_g max(e - e_c, 0)` for each muscle, `e` the contraction and `e_c` that at which they touch, the corner rounded over 0.005:
//! what presses sideways is the gas, so that the loss grows with pressure. R. M. Robinson, C. S. Kothera & N. M. Wereley, "Variable
//! recruitment testing of pneumatic artificial muscles for robotic manipulators", IEEE/ASME Trans. Mechatronics 20, 2015.

use super::{beyond, EffectInfo, EffectParameter};
use crate::scalar::{constant, Scalar};

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "pam_crowding_contact",
    block: "muscle",
    at: "muscle",
    parameters: &[
        EffectParameter::new("contact_area", "m2"),
        EffectParameter::new("onset_contraction", "1").within(-1.0, 1.0),
    ],
};

const CORNER: f64 = 0.005;

/// Force of one muscle [N] at a gauge pressure [Pa] and a contraction ratio.
#[inline]
pub fn force<S: Scalar>(area: S, onset: S, pressure: S, contraction: S) -> S {
    let positive = if pressure.re() > 0.0 { pressure } else { constant(0.0) };
    -(area * positive * beyond(contraction - onset, CORNER))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_begins_at_the_onset_and_grows_with_pressure() {
        assert_eq!(force(1e-3, 0.12, 4e5, 0.1), 0.0);
        assert!((force(1e-3, 0.12, 4e5, 0.22) + 1e-3 * 4e5 * 0.0975_f64).abs() < 1e-9);
        assert_eq!(force(1e-3, 0.12, -1e4, 0.2), 0.0);
        assert_eq!(force(0.0, 0.12, 4e5, 0.2), 0.0);
    }
}
