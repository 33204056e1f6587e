//! `com_offset`: a centre of mass that is off the line of its link, or a base that is not level.
//!
//! `tau = -a W cos(phi)`, `phi` the angle of the link from the direction of gravity, `W` what the
//! link weighs on its joint where it is level, its payload and the links behind it included [N m];
//! a payload that changes counts as it is at the time, what hangs on a cord does not.
//! `a` is the angle, seen from the joint, by which the centre of mass lies off the line: of an offset
//! across it, that offset over the distance of the centre; of a base that is not level, its tilt.
//! What an offset along the line does is `arm.first_moment`. A link of a chain loads the joints
//! before its own as well. M. W. Spong, S. Hutchinson & M. Vidyasagar, *Robot Modeling and Control*
//! (2006), ch. 7; J. Swevers et al., "Optimal robot excitation and identification", IEEE Trans.
//! Robotics Autom. 13, 1997 (both first moments of a link).

use super::{Effect, EffectInfo, EffectParameter, Form, Port};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::Scalar;

/// How far off its line a centre of mass is taken to be, one standard deviation [rad]: two degrees.
const USUAL: f64 = 0.035;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "com_offset",
    block: "arm",
    at: "joint",
    source: "Spong, Hutchinson & Vidyasagar (2006), ch. 7; Swevers et al. (1997)",
    forms: &[Form {
        name: "across",
        parameters: &[EffectParameter::new("angle", "rad", -1.0, 1.0, 0.05)
            .starts(&[-0.05, 0.05])
            .prior(0.0, USUAL)
            .off(0.0)],
        states: &[],
        integrates: false,
        ports: &[Port::Weight],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// Angle of the centre of mass off the line [rad].
#[derive(Debug, Clone, Copy)]
struct Across<S>(S);

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Across(values[0]))
}

impl<S: Scalar> Effect<S> for Across<S> {
    fn weight(&self, direction: S, level: S) -> S {
        -(self.0 * level * direction.cos())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_weight_of_an_offset_mass() {
        let (mass, along, across, gravity) = (2.0, 0.3, 0.05_f64, 9.81);
        let (effect, level) = (Across(across / along), mass * gravity * along);
        for degrees in [-30.0_f64, 0.0, 45.0, 120.0] {
            let phi: f64 = degrees.to_radians();
            let height = |phi: f64| -along * phi.cos() + across * phi.sin();
            let slope = (height(phi + 1e-6) - height(phi - 1e-6)) / 2e-6;
            let expected = -mass * gravity * slope;
            let on_line = -level * phi.sin();
            assert!((effect.weight(phi, level) + on_line - expected).abs() < 1e-8);
        }
    }
}
