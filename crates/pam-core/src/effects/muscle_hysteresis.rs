//! `muscle_hysteresis`: rate-independent friction of the braid as a pressure-scaled Maxwell-slip model.
//!
//! Elements `zeta_i <- clip(zeta_i + dL/d_i, -1, 1)` with `d_i = d (1/8, 1/4, 1/2, 1)`; force per muscle
//! `F_h = (W0 + c pg) mean(zeta)`: more pull while the muscle is extended, less while it contracts. `c = 0` and a
//! vanishing `d` is constant Coulomb friction, `W0 = 0` pressure-proportional friction. Vo-Minh et al. (2011);
//! Al-Bender, Lampaert & Swevers (2005). Between steps the elements are updated by exact return mapping; inside a
//! step the force follows the stage's length, so that smooth stretches keep the integrator's order.

use super::{EffectInfo, EffectParameter};
use crate::muscle::slip::Slip;
use crate::scalar::{constant, Scalar};

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "muscle_hysteresis",
    block: "muscle",
    at: "muscle",
    parameters: &[
        EffectParameter::new("friction_constant", "N"),
        EffectParameter::new("friction_pressure", "m2"),
        EffectParameter::new("presliding", "m").within(1e-9, 1.0),
    ],
};

/// Friction force of one muscle [N] at a gauge pressure [Pa] (the part below zero does not count).
#[inline]
pub fn force<S: Scalar>(slip: &Slip<S>, constant_part: S, pressure_part: S, pressure: S) -> S {
    let positive = if pressure.re() > 0.0 { pressure } else { constant(0.0) };
    (constant_part + pressure_part * positive) * slip.mean()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cycle_dissipates() {
        let (mut slip, mut work) = (Slip::<f64>::default(), 0.0);
        for k in 0..4000 {
            let dl = 5e-3 * ((f64::from(k + 1) * 0.01).sin() - (f64::from(k) * 0.01).sin());
            slip = slip.moved(dl, 1e-3);
            work += force(&slip, 2.0, 1e-5, 3e5) * dl;
        }
        assert!(work > 0.0);
    }
}
