//! `payload_swing`: a part of the payload that hangs on a cord instead of being fixed to the link.
//!
//! A mass `mu = s m_p` at the end of a cord of length `l` from the end of the link, at the angle
//! `phi` from the gravity vector. With the acceleration `a` of the cord's upper end, along the cord
//! `r = (sin phi, -cos phi)` and across it `t = (cos phi, sin phi)`:
//! `l phi'' = -(a + g) t - 2 zeta sqrt(g/l) l phi'`, pull on the link
//! `-mu [((a + g) r - l phi'^2) r - 2 zeta sqrt(g/l) l phi' t]`. At `s = 0` nothing pulls. Double
//! pendulum, L. D. Landau & E. M. Lifshitz, *Mechanics*, section 5. Two states; at the start the
//! cord hangs at rest.

use super::{Cord, Effect, EffectInfo, EffectParameter, EffectState, Form, Port, Role};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::Scalar;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "payload_swing",
    block: "arm",
    at: "joint",
    last_only: true,
    source: "Landau & Lifshitz, Mechanics, section 5 (double pendulum)",
    forms: &[Form {
        name: "pendulum",
        parameters: &[
            EffectParameter::new("swinging_share", "1", 0.0, 1.0, 0.5).starts(&[0.2, 0.8]).off(0.0),
            EffectParameter::new("length", "m", 0.001, 100.0, 0.3)
                .starts(&[0.15, 0.5])
                .usually(0.1, 0.5)
                .scan(0.06, 1.5, 14),
            EffectParameter::new("damping_ratio", "1", 0.0, 10.0, 0.02)
                .starts(&[0.02])
                .usually(0.0, 0.03)
                .tried(0.08),
        ],
        states: &[
            EffectState { name: "angle", role: Role::Moves },
            EffectState { name: "rate", role: Role::Moves },
        ],
        integrates: false,
        ports: &[Port::Hanging],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// Bound of the pendulum's frequency [rad/s], the link's inertia without the swinging mass being
/// smaller by `ratio`.
pub fn fastest(length: f64, gravity: f64, ratio: f64) -> f64 {
    (gravity.abs() / length * (1.0 + ratio)).sqrt()
}

/// A part of the payload on a cord; its states are the angle of the cord and its rate.
#[derive(Debug, Clone, Copy)]
struct Swing<S> {
    share: S,
    length: S,
    damping: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Swing { share: values[0], length: values[1], damping: values[2] })
}

impl<S: Scalar> Effect<S> for Swing<S> {
    fn hanging(&self) -> S {
        self.share
    }

    fn cord(&self, gravity: f64, own: &[S]) -> Option<Cord<S>> {
        Some(Cord::new(self.length, self.damping, gravity, own[0], own[1]))
    }

    fn swing_rate(&self, gravity: f64, ratio: f64) -> f64 {
        fastest(self.length.re(), gravity, ratio)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_swings_with_the_frequency_of_a_pendulum() {
        let (length, g) = (0.4, 9.80665);
        let still = Cord::new(length, 0.0, g, 0.0_f64, 0.0);
        assert_eq!(still.acceleration([0.0, g]), 0.0);
        let slope = Cord::new(length, 0.0, g, 1e-6_f64, 0.0).acceleration([0.0, g]) / 1e-6;
        assert!((slope + g / length).abs() < 1e-6);
        let damped = Cord::new(length, 0.1, g, 0.0_f64, 1.0).acceleration([0.0, g]);
        assert!((damped + 2.0 * 0.1 * (g / length).sqrt()).abs() < 1e-9);
    }
}
