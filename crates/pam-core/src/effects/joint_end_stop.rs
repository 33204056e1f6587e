//! `joint_end_stop`: a stop of the joint before the nominal one.
//!
//! `tau = -k d (1 + c d')` for a depth `d` beyond the stop's angle, never a pull, the corner rounded over 0.2 deg; above the middle of the
//! joint's range it is an upper stop, below a lower one. K. H. Hunt & F. R. E. Crossley, "Coefficient of restitution interpreted as damping
//! in vibroimpact", ASME J. Applied Mechanics 42, 1975.

use super::{beyond, EffectInfo, EffectParameter};
use crate::scalar::{constant, Scalar};

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "joint_end_stop",
    block: "joint",
    at: "joint",
    parameters: &[
        EffectParameter::new("stiffness", "N m/rad"),
        EffectParameter::new("angle", "rad").within(-7.0, 7.0),
        EffectParameter::new("dissipation", "s/rad"),
    ],
};

/// Width of the round corner [rad].
const CORNER: f64 = 0.2 * std::f64::consts::PI / 180.0;

/// Torque [N m] at a joint angle and rate; `upper` tells from which side the stop is met.
#[inline]
pub fn torque<S: Scalar>(stop: [S; 3], upper: bool, angle: S, rate: S) -> S {
    let [stiffness, limit, dissipation] = stop;
    let sign = if upper { 1.0 } else { -1.0 };
    let depth = beyond((angle - limit) * sign, CORNER);
    let share = dissipation * rate * sign + 1.0;
    let held = if share.re() > 0.0 { share } else { constant(0.0) };
    -(stiffness * depth * held) * sign
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_pushes_back_inside_and_never_pulls() {
        let stop = [500.0, 1.2, 0.5];
        assert_eq!(torque(stop, true, 1.1, 1.0), 0.0);
        assert!((torque(stop, true, 1.3, 0.0) + 500.0 * (0.1 - 0.5 * CORNER)).abs() < 1e-10);
        assert!(torque(stop, true, 1.3, 1.0) < torque(stop, true, 1.3, 0.0));
        assert_eq!(torque(stop, true, 1.3, -5.0), 0.0);
        assert!(torque(stop, false, 1.1, 0.0) > 0.0 && torque(stop, false, 1.3, 0.0) == 0.0);
        assert_eq!(torque([0.0, 1.2, 0.5], true, 1.5, 0.3), 0.0);
    }
}
