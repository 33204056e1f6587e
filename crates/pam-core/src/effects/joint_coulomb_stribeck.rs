//! `joint_coulomb_stribeck`: friction of the joint that is larger at rest than in motion.
//!
//! `tau = -(f_s - f) exp(-(w/w_s)^2) tanh(10 w/w_s)` beside the arm's own Coulomb friction `f`: the
//! stiction above it, that fades over the Stribeck speed `w_s`. Its sign changes over a tenth of
//! that speed. B. Armstrong-Helouvry, P. Dupont & C. Canudas de Wit, "A survey of models, analysis
//! tools and compensation methods for the control of machines with friction", Automatica 30, 1994.

use super::{At, Effect, EffectInfo, EffectParameter, Extremes, Form, Port};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, tanh, Scalar};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "joint_coulomb_stribeck",
    block: "joint",
    at: "joint",
    dry_friction: true,
    source: "Armstrong-Helouvry, Dupont & Canudas de Wit (1994)",
    forms: &[Form {
        name: "exponential",
        parameters: &[
            EffectParameter::new("stiction", "N m", 0.0, 1e6, 1.0).starts(&[0.5, 3.0]).off(0.0),
            EffectParameter::new("stribeck_speed", "rad/s", 0.001, 1000.0, 0.05)
                .starts(&[0.02, 0.1]),
        ],
        states: &[],
        integrates: false,
        ports: &[Port::Torque],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
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

/// Stiction of a joint.
#[derive(Debug, Clone, Copy)]
struct Stiction<S> {
    stiction: S,
    speed: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Stiction { stiction: values[0], speed: values[1] })
}

impl<S: Scalar> Effect<S> for Stiction<S> {
    fn torque(&self, at: &At<S>, _own: &[S]) -> S {
        match at {
            At::Joint { rate, .. } => -torque(self.stiction, self.speed, *rate),
            _ => constant(0.0),
        }
    }

    fn resistance(&self, _most: &Extremes) -> (f64, f64) {
        (steepest(self.stiction.re(), self.speed.re()), 0.0)
    }
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
