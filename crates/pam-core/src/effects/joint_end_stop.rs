//! `joint_end_stop`: a stop of the joint before the nominal one.
//!
//! `tau = -k d (d/d_0)^(n-1) (1 + c d')` for a depth `d` beyond the stop's angle, never a pull, the
//! corner rounded over 0.2 deg; `k` is the stop's secant stiffness at a depth of `d_0` = 10 deg, so
//! that the exponent `n` (1 metal, 2 to 3 rubber) leaves its unit alone. It is an upper stop where
//! `side` is positive, a lower one where it is negative. K. H. Hunt & F. R. E. Crossley,
//! "Coefficient of restitution interpreted as damping in vibroimpact", ASME J. Applied Mechanics
//! 42, 1975.

use super::{
    beyond, progressive, At, Effect, EffectInfo, EffectParameter, Extremes, Form, Port, Use,
};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "joint_end_stop",
    block: "joint",
    at: "joint",
    order: 1,
    source: "Hunt & Crossley (1975)",
    forms: &[Form {
        name: "progressive",
        parameters: &[
            EffectParameter::new("stiffness", "N m/rad", 0.0, 1e9, 500.0)
                .starts(&[200.0, 2000.0])
                .off(0.0),
            EffectParameter::new("angle", "rad", -7.0, 7.0, 1.2)
                .starts(&[1.2])
                .role(Use::Place)
                .on("joint_angle"),
            EffectParameter::new("dissipation", "s/rad", 0.0, 10000.0, 0.5).starts(&[0.5]),
            EffectParameter::new("exponent", "1", 1.0, 4.0, 1.0).starts(&[1.5]),
            EffectParameter::new("side", "1", -1.0, 1.0, 1.0).starts(&[-1.0, 1.0]).role(Use::Side),
        ],
        states: &[],
        integrates: false,
        ports: &[Port::Torque],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// Width of the round corner [rad].
const CORNER: f64 = 0.2 * std::f64::consts::PI / 180.0;

/// Depth at which the stiffness is a secant [rad].
const SECANT: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// Torque [N m] at a joint angle and rate.
#[inline]
pub fn torque<S: Scalar>(stop: [S; 5], angle: S, rate: S) -> S {
    let [stiffness, limit, dissipation, exponent, side] = stop;
    let sign = if side.re() >= 0.0 { 1.0 } else { -1.0 };
    let depth = beyond((angle - limit) * sign, CORNER);
    let share = dissipation * rate * sign + 1.0;
    let held = if share.re() > 0.0 { share } else { constant(0.0) };
    -(stiffness * progressive(depth, SECANT, exponent) * held) * sign
}

/// Stiffness at a depth [N m/rad]: the tangent.
pub fn tangent(stiffness: f64, exponent: f64, depth: f64) -> f64 {
    stiffness * exponent * (depth / SECANT).powf(exponent - 1.0)
}

/// A stop of a joint.
#[derive(Debug, Clone, Copy)]
struct EndStop<S>([S; 5]);

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(EndStop(std::array::from_fn(|k| values[k])))
}

impl<S: Scalar> Effect<S> for EndStop<S> {
    fn torque(&self, at: &At<S>, _own: &[S]) -> S {
        match at {
            At::Joint { angle, rate, .. } => torque(self.0, *angle, *rate),
            _ => constant(0.0),
        }
    }

    fn resistance(&self, most: &Extremes) -> (f64, f64) {
        let [stiffness, angle, dissipation, exponent, side] = self.0.map(|v| v.re());
        let (low, high) = most.angles;
        let depth = if side >= 0.0 { high - angle } else { angle - low }.max(0.0);
        let blow = (high - low).min(0.1);
        (
            tangent(stiffness, exponent, blow) / exponent * blow * dissipation,
            tangent(stiffness, exponent, depth),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Slope;

    #[test]
    fn it_pushes_back_inside_and_never_pulls() {
        let stop = [500.0, 1.2, 0.5, 1.0, 1.0];
        let lower = [500.0, 1.2, 0.5, 1.0, -1.0];
        assert_eq!(torque(stop, 1.1, 1.0), 0.0);
        assert!((torque(stop, 1.3, 0.0) + 500.0 * (0.1 - 0.5 * CORNER)).abs() < 1e-10);
        assert!(torque(stop, 1.3, 1.0) < torque(stop, 1.3, 0.0));
        assert_eq!(torque(stop, 1.3, -5.0), 0.0);
        assert!(torque(lower, 1.1, 0.0) > 0.0 && torque(lower, 1.3, 0.0) == 0.0);
        assert_eq!(torque([0.0, 1.2, 0.5, 1.0, 1.0], 1.5, 0.3), 0.0);
    }

    #[test]
    fn rubber_grows_stiffer() {
        let at =
            |degrees: f64| -torque([500.0, 1.2, 0.0, 3.0, 1.0], 1.2 + degrees.to_radians(), 0.0);
        let depth = |degrees: f64| degrees.to_radians() - 0.5 * CORNER;
        let power = |degrees: f64| 500.0 * depth(degrees).powi(3) / SECANT.powi(2);
        assert!(
            (at(15.0) / power(15.0) - 1.0).abs() < 1e-12
                && (at(2.0) / power(2.0) - 1.0).abs() < 1e-12
        );
        let slope = (at(10.0001) - at(9.9999)) / 0.0002_f64.to_radians();
        assert!((slope / tangent(500.0, 3.0, depth(10.0)) - 1.0).abs() < 1e-6);
        // neither a logarithm of nothing nor its slope
        let touch = torque(
            [
                Slope::from(500.0),
                Slope::from(1.2),
                Slope::from(0.0),
                Slope::new(1.0, 1.0),
                Slope::from(1.0),
            ],
            Slope::from(1.2),
            Slope::from(0.0),
        );
        assert_eq!((touch.re, touch.slope()), (0.0, 0.0));
    }
}
