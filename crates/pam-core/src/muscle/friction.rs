//! Friction hysteresis: a share of the force against the motion.
//!
//! Equation (physics reference, section 2, model 8; Robinson 2014, (2.36)):
//!
//! ```text
//! F_total = F + d c_F |F|
//! c_F = max(c0 + c1 P, floor)
//! d = -1 while contracting, +1 while lengthening
//! ```
//!
//! Between the directions `d` goes over a presliding distance, rate-independently: it is the mean
//! of the slip elements of [`super::slip`], so that small reversals make small loops and the
//! integrator sees no jump.

use crate::scalar::{constant, Scalar};

/// The friction coefficient's law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction {
    /// `c0`, the coefficient at zero pressure [1].
    pub coefficient: f64,
    /// `c1`, its change with pressure [1/Pa].
    pub pressure_slope: f64,
    /// The least it becomes [1].
    pub floor: f64,
    /// Distance of motion over which the force goes from one branch to the other [m].
    pub presliding: f64,
}

impl Friction {
    /// `c_F` at a gauge pressure [Pa].
    pub fn at<S: Scalar>(&self, pressure: S) -> S {
        let law = pressure * self.pressure_slope + self.coefficient;
        if law.re() > self.floor {
            law
        } else {
            constant(self.floor)
        }
    }

    /// A force [N] with its friction in direction `direction` (-1 contracting, +1 lengthening).
    pub fn applied<S: Scalar>(&self, force: S, pressure: S, direction: S) -> S {
        let magnitude = if force.re() < 0.0 { -force } else { force };
        force + direction * self.at(pressure) * magnitude
    }

    /// Whether there is any.
    #[must_use]
    pub fn acts(&self) -> bool {
        self.coefficient != 0.0 || self.pressure_slope != 0.0 || self.floor != 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_opposes_the_motion_and_has_a_floor() {
        let friction = Friction {
            coefficient: 0.16,
            pressure_slope: -0.145e-6,
            floor: 0.01,
            presliding: 1e-3,
        };
        assert_eq!(friction.at(0.0), 0.16);
        assert!((friction.at(5e5_f64) - 0.0875).abs() < 1e-12);
        assert_eq!(friction.at(2e6), 0.01);
        assert!(
            friction.applied(100.0, 0.0, 1.0) > 100.0 && friction.applied(100.0, 0.0, -1.0) < 100.0
        );
        assert!(
            friction.applied(-100.0, 0.0, 1.0) > -100.0,
            "a muscle that is pushed out resists too"
        );
    }
}
