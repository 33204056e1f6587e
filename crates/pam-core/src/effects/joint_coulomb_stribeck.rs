//! `joint_coulomb_stribeck`: friction of the joint that is larger at rest than in motion.
//!
//! `tau = -(f_s - f) exp(-(w/w_s)^2) tanh(10 w/w_s)` beside the arm's own Coulomb friction `f`: the stiction above it, that fades over the
//! Stribeck speed `w_s`. Its sign changes over a tenth of that speed. B. Armstrong-Helouvry, P. Dupont & C. Canudas de Wit, "A survey of
//! models, analysis tools and compensation methods for the control of machines with friction", Automatica 30, 1994.

use super::{EffectInfo, EffectParameter};
use crate::scalar::{tanh, Scalar};

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "joint_coulomb_stribeck",
    block: "joint",
    at: "joint",
    parameters: &[
        EffectParameter::new("stiction", "N m"),
        EffectParameter::new("stribeck_speed", "rad/s").within(1e-3, 1e3),
    ],
};

const SHARE: f64 = 0.1;

/// Friction torque [N m] at a joint rate [rad/s], positive against a positive rate.
#[inline]
pub fn torque<S: Scalar>(stiction: S, speed: S, rate: S) -> S {
    let relative = rate / speed;
    stiction * (-(relative * relative)).exp() * tanh(relative / SHARE)
}

/// Largest slope of the friction over the rate [N m s/rad].
pub fn steepest(stiction: f64, speed: f64) -> f64 {
    stiction / (SHARE * speed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_opposes_slow_motion_only() {
        let peak = (1..200).map(|k| torque(2.0, 0.05, 5e-4 * f64::from(k))).fold(0.0, f64::max);
        assert!(peak > 1.8 && peak < 2.0, "{peak}");
        assert!(torque(2.0, 0.05, 0.5_f64).abs() < 1e-12);
        assert_eq!(torque(2.0, 0.05, -0.02), -torque(2.0, 0.05, 0.02));
        assert!((torque(2.0, 0.05, 1e-7) / 1e-7 - steepest(2.0, 0.05)).abs() < 1e-3);
    }
}
