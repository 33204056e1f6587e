//! Which way a muscle has been moving: Maxwell-slip elements, rate-independent.
//!
//! Elements `zeta_i <- clip(zeta_i + dL/d_i, -1, 1)` with `d_i = d (1/8, 1/4, 1/2, 1)` for a
//! presliding distance `d`; their mean is the direction of motion, +1 after lengthening by `d`, -1
//! after contracting by `d`. F. Al-Bender, V. Lampaert & J. Swevers, "The generalized Maxwell-slip
//! model", IEEE Trans. Automatic Control 50, 2005.

use crate::scalar::{constant, Scalar};

/// Number of elements.
pub const ELEMENTS: usize = 4;
const SHARE: [f64; ELEMENTS] = [0.125, 0.25, 0.5, 1.0];

/// Slope of the mean of the elements where all of them stick, times the presliding distance.
pub const STUCK: f64 = 3.75;

/// Relative stretch of each element, -1 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slip<S> {
    elements: [S; ELEMENTS],
}

impl<S: Scalar> Default for Slip<S> {
    fn default() -> Self {
        Self { elements: [constant(0.0); ELEMENTS] }
    }
}

impl<S: Scalar> Slip<S> {
    /// The elements after a change of muscle length [m] with a presliding distance [m].
    #[inline]
    pub fn moved(&self, change: S, presliding: S) -> Self {
        let mut elements = self.elements;
        for (zeta, share) in elements.iter_mut().zip(SHARE) {
            let next = *zeta + change / (presliding * share);
            *zeta = if next.re() > 1.0 {
                constant(1.0)
            } else if next.re() < -1.0 {
                constant(-1.0)
            } else {
                next
            };
        }
        Self { elements }
    }

    /// The elements.
    pub fn elements(&self) -> [S; ELEMENTS] {
        self.elements
    }

    /// Elements as they were read.
    pub fn from_elements(elements: [S; ELEMENTS]) -> Self {
        Self { elements }
    }

    /// Mean of the elements, -1 to 1.
    #[inline]
    pub fn mean(&self) -> S {
        let sum = self.elements.iter().fold(constant::<S>(0.0), |sum, z| sum + *z);
        sum / ELEMENTS as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loops_close_and_do_not_depend_on_rate() {
        let d = 1e-3;
        let mut slip = Slip::<f64>::default().moved(-5e-3, d);
        assert_eq!(slip.mean(), -1.0);
        let before = slip.moved(3e-4, d);
        let after = before.moved(2e-4, d).moved(-2e-4, d);
        let closed = after.moved(2e-4, d).moved(-2e-4, d);
        assert!((closed.mean() - after.mean()).abs() < 1e-15, "minor loop closes");
        for _ in 0..100 {
            slip = slip.moved(5e-5, d);
        }
        assert_eq!(slip.mean(), Slip::<f64>::default().moved(-5e-3, d).moved(5e-3, d).mean());
    }
}
