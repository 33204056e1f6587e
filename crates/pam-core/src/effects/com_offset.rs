//! `com_offset`: a centre of mass that is off the line of its link, or a base that is not level.
//!
//! `tau = -M cos(phi)`, `phi` the angle of the link from the direction of gravity: the moment `M`
//! [N m] is what the link weighs across its line. An offset `d` of the mass `m` has `M = m g d`; a
//! base that is tilted by a small angle has that angle times all that the link weighs. What an
//! offset along the line does is `arm.first_moment`. A link of a chain loads the joints before its
//! own as well. M. W. Spong, S. Hutchinson & M. Vidyasagar, *Robot Modeling and Control* (2006),
//! ch. 7; J. Swevers et al., "Optimal robot excitation and identification", IEEE Trans. Robotics
//! Autom. 13, 1997 (both first moments of a link).

use super::{Effect, EffectInfo, EffectParameter, Form, Port};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::Scalar;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "com_offset",
    block: "arm",
    at: "joint",
    source: "Spong, Hutchinson & Vidyasagar (2006), ch. 7; Swevers et al. (1997)",
    forms: &[Form {
        name: "across",
        parameters: &[EffectParameter::new("moment", "N m", -1e6, 1e6, 2.0)
            .starts(&[-2.0, 2.0])
            .off(0.0)
            .same_everywhere()],
        states: &[],
        integrates: false,
        ports: &[Port::Weight],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// What a link weighs across its line [N m].
#[derive(Debug, Clone, Copy)]
struct Across<S>(S);

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Across(values[0]))
}

impl<S: Scalar> Effect<S> for Across<S> {
    fn weight(&self, direction: S) -> S {
        -(self.0 * direction.cos())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_weight_of_an_offset_mass() {
        let (mass, along, across, gravity) = (2.0, 0.3, 0.05_f64, 9.81);
        let effect = Across(mass * gravity * across);
        for degrees in [-30.0_f64, 0.0, 45.0, 120.0] {
            let phi: f64 = degrees.to_radians();
            let height = |phi: f64| -along * phi.cos() + across * phi.sin();
            let slope = (height(phi + 1e-6) - height(phi - 1e-6)) / 2e-6;
            let expected = -mass * gravity * slope;
            let on_line = -mass * gravity * along * phi.sin();
            assert!((effect.weight(phi) + on_line - expected).abs() < 1e-8);
        }
    }
}
