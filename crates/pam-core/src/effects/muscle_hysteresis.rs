//! `muscle_hysteresis`: rate-independent friction of the braid as a pressure-scaled Maxwell-slip model.
//!
//! Elements `zeta_i <- clip(zeta_i + dL/d_i, -1, 1)` with `d_i = d (1/8, 1/4, 1/2, 1)`; force per muscle
//! `F_h = (W0 + c pg) mean(zeta)`: more pull while the muscle is extended, less while it contracts. `c = 0` and a
//! vanishing `d` is constant Coulomb friction, `W0 = 0` pressure-proportional friction. Vo-Minh et al. (2011);
//! Al-Bender, Lampaert & Swevers (2005). Between steps the elements are updated by exact return mapping; inside a
//! step the force follows the stage's length, so that smooth stretches keep the integrator's order.

use super::EffectInfo;
use crate::scalar::{constant, Scalar};

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "muscle_hysteresis",
    block: "muscle",
    parameters: &[("friction_constant", "N"), ("friction_pressure", "m2"), ("presliding", "m")],
};

/// Number of elements.
pub const ELEMENTS: usize = 4;
const SHARE: [f64; ELEMENTS] = [0.125, 0.25, 0.5, 1.0];

/// Relative stretch of each element, -1 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Memory<S> {
    elements: [S; ELEMENTS],
}

impl<S: Scalar> Default for Memory<S> {
    fn default() -> Self {
        Self { elements: [constant(0.0); ELEMENTS] }
    }
}

impl<S: Scalar> Memory<S> {
    /// The memory after a change of muscle length [m] with a presliding distance [m].
    #[inline]
    pub fn moved(&self, change: S, presliding: S) -> Self {
        let mut elements = self.elements;
        for (zeta, share) in elements.iter_mut().zip(SHARE) {
            let next = *zeta + change / (presliding * share);
            *zeta = if next.re() > 1.0 {
                constant(1.0)
            } else if next.re() < -1.0 {
                constant(-1.0)
            } else {
                next
            };
        }
        Self { elements }
    }

    /// Mean of the elements, -1 to 1.
    #[inline]
    pub fn mean(&self) -> S {
        let sum = self.elements.iter().fold(constant::<S>(0.0), |sum, z| sum + *z);
        sum / ELEMENTS as f64
    }
}

/// Friction force of one muscle [N] at a gauge pressure [Pa] (the part below zero does not count).
#[inline]
pub fn force<S: Scalar>(memory: &Memory<S>, constant_part: S, pressure_part: S, pressure: S) -> S {
    let positive = if pressure.re() > 0.0 { pressure } else { constant(0.0) };
    (constant_part + pressure_part * positive) * memory.mean()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loops_close_and_do_not_depend_on_rate() {
        let d = 1e-3;
        let mut memory = Memory::<f64>::default().moved(-5e-3, d);
        assert_eq!(memory.mean(), -1.0);
        let before = memory.moved(3e-4, d);
        let after = before.moved(2e-4, d).moved(-2e-4, d);
        let closed = after.moved(2e-4, d).moved(-2e-4, d);
        assert!((closed.mean() - after.mean()).abs() < 1e-15, "minor loop closes");
        for _ in 0..100 {
            memory = memory.moved(5e-5, d);
        }
        assert_eq!(memory.mean(), Memory::<f64>::default().moved(-5e-3, d).moved(5e-3, d).mean());
    }

    #[test]
    fn a_cycle_dissipates() {
        let (mut memory, mut work) = (Memory::<f64>::default(), 0.0);
        for k in 0..4000 {
            let dl = 5e-3 * ((f64::from(k + 1) * 0.01).sin() - (f64::from(k) * 0.01).sin());
            memory = memory.moved(dl, 1e-3);
            work += force(&memory, 2.0, 1e-5, 3e5) * dl;
        }
        assert!(work > 0.0);
    }
}
