//! `pulley`: a tendon over a wheel.
//!
//! `d = r (theta - theta_0)`, moment arm `r`; a negative radius is a muscle on the other side (the
//! antagonist).

use super::point::JointPoint;
use crate::error::Result;
use crate::key;
use crate::scalar::{constant, Scalar};

/// A joint of constant moment arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulley {
    radius: f64,
    rest_angle: f64,
}

impl Pulley {
    /// A pulley of a radius [m] whose muscle is at rest length at an angle [rad].
    ///
    /// # Errors
    /// [`crate::Error::Parameter`] if the radius is not finite or above 10 m.
    pub fn new(radius: f64, rest_angle: f64) -> Result<Self> {
        Ok(Self { radius: key!("joint", "radius").check("joint.radius", radius)?, rest_angle })
    }

    /// Shortening and moment arm at a joint angle [rad].
    #[inline]
    pub fn eval<S: Scalar>(&self, angle: S) -> JointPoint<S> {
        let moment_arm = constant(self.radius);
        JointPoint {
            shortening: (angle - self.rest_angle) * self.radius,
            moment_arm,
            torque_arm: moment_arm,
        }
    }
}
