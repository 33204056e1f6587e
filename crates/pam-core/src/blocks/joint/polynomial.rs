//! `polynomial`: the shortening as a polynomial of the angle, from a drawing or a measurement.
//!
//! `d = sum_k c_k (theta - theta_0)^k`, k from 1; moment arm `sum_k k c_k (theta - theta_0)^(k-1)`.

use super::point::JointPoint;
use crate::error::{Error, Result};
use crate::key;
use crate::scalar::{constant, Scalar};

/// Highest degree.
pub const HIGHEST_DEGREE: usize = 12;

/// A joint described by a polynomial.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial {
    coefficients: Vec<f64>,
    rest_angle: f64,
}

impl Polynomial {
    /// A joint with `c_k` [m/rad^k] from k = 1, its muscle at rest length at an angle [rad].
    ///
    /// # Errors
    /// [`Error::Parameter`] for a coefficient that is not finite, [`Error::Length`] for none or too
    /// many.
    pub fn new(coefficients: &[f64], rest_angle: f64) -> Result<Self> {
        if coefficients.is_empty() || coefficients.len() > HIGHEST_DEGREE {
            return Err(Error::Length {
                name: "joint.coefficients".into(),
                found: coefficients.len(),
                expected: coefficients.len().clamp(1, HIGHEST_DEGREE),
                why: format!("from 1 to {HIGHEST_DEGREE}"),
            });
        }
        key!("joint", "coefficients").check_all("joint", coefficients)?;
        Ok(Self { coefficients: coefficients.to_vec(), rest_angle })
    }

    /// Shortening and moment arm at a joint angle [rad].
    #[inline]
    pub fn eval<S: Scalar>(&self, angle: S) -> JointPoint<S> {
        let x = angle - self.rest_angle;
        let (mut sum, mut slope) = (constant::<S>(0.0), constant::<S>(0.0));
        for c in self.coefficients.iter().rev() {
            slope = slope * x + sum;
            sum = sum * x + *c;
        }
        // The Horner sum lacks one factor x: d = x p(x), d' = p + x p'.
        let moment_arm = sum + slope * x;
        JointPoint { shortening: sum * x, moment_arm, torque_arm: moment_arm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn value_and_slope_of_a_cubic() {
        let joint = Polynomial::new(&[0.03, -0.01, 0.002], 0.5).unwrap();
        let x = 0.8_f64;
        let point = joint.eval(0.5 + x);
        assert!((point.shortening - (0.03 * x - 0.01 * x * x + 0.002 * x.powi(3))).abs() < 1e-16);
        assert!((point.moment_arm - (0.03 - 0.02 * x + 0.006 * x * x)).abs() < 1e-16);
        assert!(Polynomial::new(&[], 0.0).is_err() && Polynomial::new(&[f64::NAN], 0.0).is_err());
    }
}
