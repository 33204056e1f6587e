//! `muscle_creep`: standard linear solid, a spring and a damper in series beside the muscle.
//!
//! `F_c = k (L - L_d)`, `L_d' = (L - L_d)/tau`: at constant length the force relaxes, at constant pressure the length creeps on in the
//! direction of its last change. One state for each group of muscles, the length `L_d` of the damper; at the start it is that of the
//! muscle, at rest. W. N. Findley, J. S. Lai & K. Onaran, *Creep and Relaxation of Nonlinear Viscoelastic Materials* (1976);
//! H. F. Schulte Jr, "The characteristics of the McKibben artificial muscle" (1961).

use super::{EffectInfo, EffectParameter};
use crate::scalar::Scalar;

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "muscle_creep",
    block: "muscle",
    at: "muscle",
    parameters: &[
        EffectParameter::new("stiffness", "N/m"),
        EffectParameter::new("time_constant", "s").within(1e-3, 1e6),
    ],
};

/// Force of one muscle [N] at a length and with a damper's length [m].
#[inline]
pub fn force<S: Scalar>(stiffness: S, length: S, damper: S) -> S {
    stiffness * (length - damper)
}

/// Rate of the damper's length [m/s].
#[inline]
pub fn rate<S: Scalar>(time_constant: S, length: S, damper: S) -> S {
    (length - damper) / time_constant
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::integrate::Rk4;

    #[test]
    fn a_step_of_length_relaxes_exponentially() {
        let (k, tau, length) = (2e3, 3.0, 0.25);
        let (mut y, mut method) = ([0.24], Rk4::new(1));
        assert!((force(k, length, y[0]) - 20.0_f64).abs() < 1e-10);
        for _ in 0..300 {
            method.step(&mut y, 0.01, |_, y, out| out[0] = rate(tau, length, y[0]));
        }
        assert!((force(k, length, y[0]) - 20.0 * (-1.0_f64).exp()).abs() < 1e-7);
    }
}
