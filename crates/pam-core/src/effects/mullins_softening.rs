//! `mullins_softening`: a bladder that is softer wherever it has been stretched before.
//!
//! `F_b -> F_b (1 - D tanh((e_m - e)/w))` of the bladder's part of the force, `e_m` the largest contraction since the start: a first
//! stretch is as stiff as the model says, the way back and all later cycles up to `e_m` are softer. R. W. Ogden & D. G. Roxburgh, "A
//! pseudo-elastic model for the Mullins effect in filled rubber", Proc. R. Soc. A 455, 1999, with contraction in the place of energy;
//! J. Diani, B. Fayolle & P. Gilormini, "A review on the Mullins effect", European Polymer Journal 45, 2009.

use super::{EffectInfo, EffectParameter};
use crate::scalar::{tanh, Scalar};

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "mullins_softening",
    block: "muscle",
    at: "muscle",
    parameters: &[
        EffectParameter::new("softening", "1").within(0.0, 1.0),
        EffectParameter::new("contraction_width", "1").within(1e-4, 10.0),
    ],
};

/// What the softening adds to the force [N] of a bladder's force [N] at a contraction ratio, after a largest one.
#[inline]
pub fn change<S: Scalar>(softening: S, width: S, bladder: S, contraction: S, largest: S) -> S {
    if contraction.re() >= largest.re() {
        return bladder * 0.0;
    }
    -(softening * tanh((largest - contraction) / width) * bladder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_was_stretched_is_softer() {
        assert_eq!(change(0.3, 0.03, -80.0, 0.2, 0.2), 0.0);
        assert!((change(0.3, 0.03, -80.0, 0.0, 0.2) - 24.0_f64).abs() < 1e-3);
        assert_eq!(change(0.0, 0.03, -80.0, 0.0, 0.2), 0.0);
    }
}
