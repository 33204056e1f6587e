//! Four-parameter tendon joint (dissertation ch. 3, Table 3.5), power conserving.
//!
//! With `phi = pi - theta - atan2(rl, ll)`, `BO = hypot(ll, rl)`,
//! `(Bx, By) = BO (cos phi, sin phi)` and `s = sqrt(lT^2 - (ru - By)^2)`: shortening
//! `d = Bx + s - lu`, moment arm `dd/dtheta = By - (ru - By) Bx/s`. The tendon length `lT` follows
//! from `d = 0` at the rest angle. The torque of a pull `F` is `F dd/dtheta`; (3.6)-(3.8) as
//! printed multiply by `cos^2` of the tendon's angle, `(s/lT)^2`, too much: [`Torque::Published`]
//! keeps them for comparison.

use super::point::JointPoint;
use crate::error::{Error, Result};
use crate::scalar::Scalar;

/// Geometry of a tendon joint [m, rad].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TendonJoint {
    upper_axial: f64,
    upper_offset: f64,
    lower_angle: f64,
    lower_radius: f64,
    tendon_squared: f64,
    torque: Torque,
}

/// Which torque a pull gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Torque {
    /// `F dd/dtheta`: power is conserved.
    Power,
    /// As printed in (3.6)-(3.8).
    Published,
}

impl TendonJoint {
    /// A joint from its four lengths [m] and the angle [rad] at which the muscles are at rest
    /// length.
    ///
    /// # Errors
    /// [`Error::Parameter`] when a length is not positive.
    pub fn new(
        upper_axial: f64,
        upper_offset: f64,
        lower_axial: f64,
        lower_offset: f64,
        rest_angle: f64,
    ) -> Result<Self> {
        for (name, value) in
            [("joint.upper_axial", upper_axial), ("joint.lower_axial", lower_axial)]
        {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::parameter(name, value, "a length > 0 m"));
            }
        }
        let (lower_angle, lower_radius) =
            (lower_offset.atan2(lower_axial), lower_axial.hypot(lower_offset));
        let phi = std::f64::consts::PI - rest_angle - lower_angle;
        let (bx, by) = (lower_radius * phi.cos(), lower_radius * phi.sin());
        let tendon_squared = (upper_axial - bx).powi(2) + (upper_offset - by).powi(2);
        if bx > upper_axial {
            let allowed =
                format!("at least {bx:.5} m at this rest angle: the tendon would be folded over");
            return Err(Error::parameter("joint.upper_axial", upper_axial, allowed));
        }
        let torque = Torque::Power;
        Ok(Self { upper_axial, upper_offset, lower_angle, lower_radius, tendon_squared, torque })
    }

    /// The same joint with the torque of a pull taken in one way or the other.
    #[must_use]
    pub fn with_torque(self, torque: Torque) -> Self {
        Self { torque, ..self }
    }

    /// Tendon length [m].
    pub fn tendon_length(&self) -> f64 {
        self.tendon_squared.sqrt()
    }

    /// True where the tendon reaches at this angle.
    pub fn reaches(&self, angle: f64) -> bool {
        let by = self.lower_radius * (std::f64::consts::PI - angle - self.lower_angle).sin();
        self.tendon_squared > (self.upper_offset - by).powi(2)
    }

    /// Shortening and moment arm at a joint angle [rad].
    #[inline]
    pub fn eval<S: Scalar>(&self, angle: S) -> JointPoint<S> {
        let (sin, cos) = (-angle + (std::f64::consts::PI - self.lower_angle)).sin_cos();
        let (bx, by) = (cos * self.lower_radius, sin * self.lower_radius);
        let gap = -by + self.upper_offset;
        let s = (-(gap * gap) + self.tendon_squared).sqrt();
        let moment_arm = by - gap * bx / s;
        let torque_arm = match self.torque {
            Torque::Power => moment_arm,
            Torque::Published => moment_arm * (s * s / self.tendon_squared),
        };
        JointPoint { shortening: bx + s - self.upper_axial, moment_arm, torque_arm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Slope;

    #[test]
    fn moment_arm_is_the_derivative_of_the_shortening() {
        let joint =
            TendonJoint::new(0.0254, 0.027432, 0.027432, 0.004826, 15f64.to_radians()).unwrap();
        assert!(joint.eval(15f64.to_radians()).shortening.abs() < 1e-15);
        for degrees in [15.0, 40.0, 90.0, 119.0f64] {
            let point = joint.eval(Slope::new(degrees.to_radians(), 1.0));
            assert!((point.shortening.slope() - point.moment_arm.re).abs() < 1e-14);
        }
        assert!(TendonJoint::new(f64::NAN, 0.02, 0.02, 0.0, 0.2).is_err());
    }
}
