//! `muscle_hysteresis`: rate-independent friction of the braid as a pressure-scaled Maxwell-slip
//! model.
//!
//! Elements `zeta_i <- clip(zeta_i + dL/d_i, -1, 1)` with `d_i = d (1/8, 1/4, 1/2, 1)`; force per
//! muscle `F_h = (W0 + c pg) mean(zeta)`: more pull while the muscle is extended, less while it
//! contracts. `c = 0` and a vanishing `d` is constant Coulomb friction, `W0 = 0`
//! pressure-proportional friction. Vo-Minh et al. (2011); Al-Bender, Lampaert & Swevers (2005).
//! Between steps the elements are updated by exact return mapping; inside a step the force follows
//! the stage's length, so that smooth stretches keep the integrator's order.

use super::{AtMuscle, Effect, EffectInfo, EffectParameter, EffectState, Form, Port, Role};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::muscle::slip::{Slip, STUCK};
use crate::scalar::{constant, Scalar};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "muscle_hysteresis",
    block: "muscle",
    at: "muscle",
    order: 1,
    dry_friction: true,
    source: "Vo-Minh et al. (2011); Al-Bender, Lampaert & Swevers (2005); Robinson (2014) (2.36) \
        as a special case",
    forms: &[Form {
        name: "maxwell_slip",
        parameters: &[
            EffectParameter::new("friction_constant", "N", 0.0, 10000.0, 5.0)
                .starts(&[2.0])
                .off(0.0),
            EffectParameter::new("friction_pressure", "m2", 0.0, 1.0, 5e-5)
                .starts(&[2e-5])
                .off(0.0)
                .same_everywhere(),
            EffectParameter::new("presliding", "m", 1e-6, 0.1, 0.001).starts(&[0.0005, 0.003]),
        ],
        states: &[
            EffectState { name: "element_1", role: Role::Follows },
            EffectState { name: "element_2", role: Role::Follows },
            EffectState { name: "element_3", role: Role::Follows },
            EffectState { name: "element_4", role: Role::Follows },
        ],
        integrates: false,
        ports: &[Port::Force],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// Friction force of one muscle [N] at a gauge pressure [Pa] (the part below zero does not count).
#[inline]
pub fn force<S: Scalar>(slip: &Slip<S>, constant_part: S, pressure_part: S, pressure: S) -> S {
    let positive = if pressure.re() > 0.0 { pressure } else { constant(0.0) };
    (constant_part + pressure_part * positive) * slip.mean()
}

/// Friction of the braid; its states are the stretches of its elements.
#[derive(Debug, Clone, Copy)]
struct Hysteresis<S> {
    constant: S,
    slope: S,
    presliding: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Hysteresis { constant: values[0], slope: values[1], presliding: values[2] })
}

fn slip<S: Scalar>(own: &[S]) -> Slip<S> {
    Slip::from_elements(std::array::from_fn(|k| own[k]))
}

impl<S: Scalar> Effect<S> for Hysteresis<S> {
    fn force(&self, at: &AtMuscle<S>, own: &[S]) -> S {
        force(&slip(own).moved(at.stretched, self.presliding), self.constant, self.slope, at.gauge)
    }

    fn moved(&self, own: &mut [S], from: S, to: S, rest_length: f64) {
        let stretched = (from - to) * rest_length;
        own.copy_from_slice(&slip(own).moved(stretched, self.presliding).elements());
    }

    fn presliding(&self, gauge: f64) -> f64 {
        (self.constant.re() + self.slope.re() * gauge) * STUCK / self.presliding.re()
    }
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
