//! `base_flexibility`: a mounting that gives way under the torque of the first joint.
//!
//! `q'' + 2 zeta w q' + w^2 q = -c w^2 tau` with the compliance `c` and the base's own frequency
//! `w`, so that its inertia is `1/(c w^2)`; `tau` is all that joint and base exchange. The link
//! stands at `theta + q` against gravity, the sensor and the muscles see `theta`. At `c = 0`
//! nothing moves. Two states; at the start the base carries the arm's weight at rest. M. W. Spong,
//! "Modeling and control of elastic joint robots", ASME J. Dyn. Syst. Meas. Control 109, 1987.

use super::{At, Effect, EffectInfo, EffectParameter, EffectState, Form, Port, Role};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::Scalar;

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "base_flexibility",
    block: "arm",
    at: "",
    source: "Spong (1987), elastic joint with the spring in the base",
    forms: &[Form {
        name: "one_mode",
        parameters: &[
            EffectParameter::new("compliance", "rad/(N m)", 0.0, 1.0, 5e-5)
                .starts(&[2e-5, 0.0002])
                .off(0.0),
            EffectParameter::new("natural_frequency", "Hz", 0.01, 1000.0, 8.0)
                .starts(&[5.0, 12.0])
                .usually(3.0, 15.0),
            EffectParameter::new("damping_ratio", "1", 0.0, 10.0, 0.03)
                .starts(&[0.03])
                .usually(0.0, 0.05),
        ],
        states: &[
            EffectState { name: "angle", role: Role::Moves },
            EffectState { name: "rate", role: Role::Moves },
        ],
        integrates: false,
        ports: &[Port::Mounting],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// Angular acceleration of the base [rad/s2] at its angle and rate, under the torque of the joint
/// on the link [N m].
#[inline]
pub fn acceleration<S: Scalar>(base: [S; 3], angle: S, rate: S, torque: S) -> S {
    let [compliance, frequency, damping] = base;
    let w = frequency * std::f64::consts::TAU;
    -(w * (w * (angle + compliance * torque) + damping * rate * 2.0))
}

/// How much a torque accelerates the base [1/(kg m2)], and its fastest rate [1/s].
pub fn mobility(base: [f64; 3]) -> (f64, f64) {
    let w = base[1] * std::f64::consts::TAU;
    (base[0] * w * w, w * (1.0 + 2.0 * base[2]))
}

/// A mounting that gives way; its states are its angle and rate.
#[derive(Debug, Clone, Copy)]
struct Base<S>([S; 3]);

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Base(std::array::from_fn(|k| values[k])))
}

impl<S: Scalar> Effect<S> for Base<S> {
    fn start(&self, _gas: &Gas, at: &At<S>, own: &mut [S]) {
        if let At::Arm { weight } = at {
            own[0] = -(self.0[0] * *weight);
        }
    }

    fn mounting(&self, own: &[S], torque: S) -> S {
        acceleration(self.0, own[0], own[1], torque)
    }

    fn mobility(&self) -> f64 {
        mobility(self.0.map(|v| v.re())).0
    }

    fn fastest(&self) -> f64 {
        mobility(self.0.map(|v| v.re())).1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_gives_way_by_its_compliance() {
        let base = [1e-4, 8.0, 0.02];
        assert!(acceleration(base, -1e-4 * 150.0, 0.0, 150.0_f64).abs() < 1e-9);
        assert!(acceleration(base, 0.0, 0.0, 150.0_f64) < 0.0);
        assert_eq!(acceleration([0.0, 8.0, 0.02], 0.0, 0.0, 150.0_f64), 0.0);
    }
}
