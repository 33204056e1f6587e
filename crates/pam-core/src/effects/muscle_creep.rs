//! `muscle_creep`: standard linear solid, a spring and a damper in series beside the muscle.
//!
//! `F_c = k (L - L_d)`, `L_d' = (L - L_d)/tau`: at constant length the force relaxes, at constant
//! pressure the length creeps on in the direction of its last change. One state for each group of
//! muscles, the length `L_d` of the damper; at the start it is that of the muscle, at rest. W. N.
//! Findley, J. S. Lai & K. Onaran, *Creep and Relaxation of Nonlinear Viscoelastic Materials*
//! (1976); H. F. Schulte Jr, "The characteristics of the McKibben artificial muscle" (1961).

use super::{At, AtMuscle, Effect, EffectInfo, EffectParameter, EffectState, Form, Port, Role};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::Scalar;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "muscle_creep",
    block: "muscle",
    at: "muscle",
    order: 2,
    source: "Findley, Lai & Onaran (1976); Schulte (1961)",
    forms: &[Form {
        name: "standard_linear_solid",
        parameters: &[
            EffectParameter::new("stiffness", "N/m", 0.0, 1e7, 500.0)
                .starts(&[200.0, 2000.0])
                .off(0.0),
            EffectParameter::new("time_constant", "s", 0.001, 1e6, 3.0)
                .starts(&[1.0, 10.0])
                .time_constant(),
        ],
        states: &[EffectState { name: "", role: Role::Moves }],
        integrates: true,
        ports: &[Port::Force],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
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

/// Spring and damper beside a muscle; its state is the length of the damper.
#[derive(Debug, Clone, Copy)]
struct Creep<S> {
    stiffness: S,
    time_constant: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Creep { stiffness: values[0], time_constant: values[1] })
}

impl<S: Scalar> Effect<S> for Creep<S> {
    fn start(&self, _gas: &Gas, at: &At<S>, own: &mut [S]) {
        if let At::Muscle(muscle) = at {
            own[0] = muscle.length;
        }
    }

    fn rates(&self, at: &At<S>, own: &[S], rates: &mut [S]) {
        if let At::Muscle(muscle) = at {
            rates[0] = rate(self.time_constant, muscle.length, own[0]);
        }
    }

    fn force(&self, at: &AtMuscle<S>, own: &[S]) -> S {
        force(self.stiffness, at.length, own[0])
    }

    fn fastest(&self) -> f64 {
        1.0 / self.time_constant.re()
    }
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
