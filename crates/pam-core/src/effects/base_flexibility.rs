//! `base_flexibility`: a mounting that gives way under the torque of the first joint.
//!
//! `q'' + 2 zeta w q' + w^2 q = -c w^2 tau` with the compliance `c` and the base's own frequency `w`, so that its inertia is `1/(c w^2)`;
//! `tau` is all that joint and base exchange. The link stands at `theta + q` against gravity, the sensor and the muscles see `theta`. At
//! `c = 0` nothing moves. Two states; at the start the base carries the arm's weight at rest. M. W. Spong, "Modeling and control of elastic
//! joint robots", ASME J. Dyn. Syst. Meas. Control 109, 1987.

use super::{EffectInfo, EffectParameter};
use crate::scalar::Scalar;

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "base_flexibility",
    block: "arm",
    at: "",
    parameters: &[
        EffectParameter::new("compliance", "rad/(N m)"),
        EffectParameter::new("natural_frequency", "Hz").within(1e-2, 1e3),
        EffectParameter::new("damping_ratio", "1").within(0.0, 10.0),
    ],
};

/// Angular acceleration of the base [rad/s2] at its angle and rate, under the torque of the joint on the link [N m].
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
