//! `supply_regulator_deadband`: a pressure regulator that does nothing about a small error.
//!
//! `P' = (e_a - k m)/tau` with `e_a = sgn(e) max(|e| - b, 0)` of the error `e = P_set - P`: within the dead band `b` only the flow
//! that is drawn moves the pressure. A step below the band is not answered, a larger one ends short of its aim by the band.
//! C. Robinson, *Modeling and control of pneumatic artificial muscles* (2014), ch. 3; P. Beater, *Pneumatic Drives* (2007), ch. 8.
//! Acts on regulators.

use super::{EffectInfo, EffectParameter};
use crate::scalar::{constant, Scalar};

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "supply_regulator_deadband",
    block: "supply",
    at: "supply",
    parameters: &[EffectParameter::new("dead_band", "Pa")],
};

/// The error that the regulator answers [Pa].
#[inline]
pub fn answered<S: Scalar>(error: S, dead_band: S) -> S {
    if error.re() > dead_band.re() {
        error - dead_band
    } else if error.re() < -dead_band.re() {
        error + dead_band
    } else {
        constant(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_error_is_not_answered() {
        assert_eq!(answered(5e3, 7e3), 0.0);
        assert_eq!((answered(1e4, 7e3), answered(-1e4, 7e3)), (3e3, -3e3));
        assert_eq!((answered(1e4, 0.0), answered(-1e4, 0.0), answered(0.0, 0.0)), (1e4, -1e4, 0.0));
    }
}
