//! What a muscle remembers of its motion.

use crate::muscle::slip::{Slip, ELEMENTS};
use crate::scalar::Scalar;

/// What a muscle remembers of its motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Memory<S> {
    /// Elements of the effect `muscle_hysteresis`.
    pub(super) hysteresis: Slip<S>,
    /// Elements of the direction of motion that the muscle's own force depends on.
    pub(super) direction: Slip<S>,
}

impl<S: Scalar> Default for Memory<S> {
    fn default() -> Self {
        Self { hysteresis: Slip::default(), direction: Slip::default() }
    }
}

impl Memory<f64> {
    /// Length of [`Self::to_array`].
    pub const NUMBERS: usize = 2 * ELEMENTS;

    /// All elements.
    #[must_use]
    pub fn to_array(&self) -> [f64; 2 * ELEMENTS] {
        let (hysteresis, direction) = (self.hysteresis.elements(), self.direction.elements());
        std::array::from_fn(|k| if k < ELEMENTS { hysteresis[k] } else { direction[k - ELEMENTS] })
    }

    /// The memory of the numbers of [`Self::to_array`]; what is missing is zero.
    #[must_use]
    pub fn from_slice(numbers: &[f64]) -> Self {
        let at = |k: usize| numbers.get(k).copied().unwrap_or(0.0);
        Self {
            hysteresis: Slip::from_elements(std::array::from_fn(at)),
            direction: Slip::from_elements(std::array::from_fn(|k| at(k + ELEMENTS))),
        }
    }
}
