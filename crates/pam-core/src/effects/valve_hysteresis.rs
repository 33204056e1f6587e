//! `valve_hysteresis`: play of the spool by the friction of spool and solenoid.
//!
//! `y <- min(max(y, x - h), x + h)`: the spool `y` follows the commanded position `x` at a distance `h`. Between steps the recursion is
//! exact; a data sheet's hysteresis is `2 h` of the stroke. M. Al Janaideh, S. Rakheja & C.-Y. Su, "An analytical generalized
//! Prandtl-Ishlinskii model inversion for hysteresis compensation", IEEE/ASME Trans. Mechatronics 16, 2011 (play operator).

use super::{EffectInfo, EffectParameter};
use crate::scalar::Scalar;

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "valve_hysteresis",
    block: "valve",
    at: "valve",
    parameters: &[EffectParameter::new("half_width", "1").within(0.0, 0.9)],
};

/// Where the spool is once the commanded position has moved.
#[inline]
pub fn followed<S: Scalar>(spool: S, commanded: S, half_width: S) -> S {
    let (low, high) = (commanded - half_width, commanded + half_width);
    if spool.re() <= low.re() {
        low
    } else if spool.re() >= high.re() {
        high
    } else {
        spool
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_follows_at_a_distance() {
        let h = 0.01;
        let up = followed(0.0, 0.5, h);
        assert_eq!(up, 0.49);
        assert_eq!(followed(up, 0.485, h), up, "a small return does not move it");
        assert!((followed(up, 0.3, h) - 0.31_f64).abs() < 1e-15);
        assert_eq!(followed(0.2, 0.7, 0.0), 0.7);
    }
}
