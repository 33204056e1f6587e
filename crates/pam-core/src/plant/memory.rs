//! What a muscle remembers of its motion.

use crate::muscle::slip::{Slip, ELEMENTS};
use crate::scalar::{constant, Scalar};

/// What a muscle remembers of its motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Memory<S> {
    /// Elements of the effect `muscle_hysteresis`.
    pub(super) hysteresis: Slip<S>,
    /// Elements of the direction of motion that the muscle's own force depends on.
    pub(super) direction: Slip<S>,
    /// Largest contraction ratio since the start, for the effect `mullins_softening`.
    pub(super) largest: S,
}

impl<S: Scalar> Default for Memory<S> {
    fn default() -> Self {
        Self { hysteresis: Slip::default(), direction: Slip::default(), largest: constant(0.0) }
    }
}

impl Memory<f64> {
    /// Length of [`Self::to_array`].
    pub const NUMBERS: usize = 2 * ELEMENTS + 1;

    /// All elements.
    #[must_use]
    pub fn to_array(&self) -> [f64; Self::NUMBERS] {
        let mut numbers = [self.largest; Self::NUMBERS];
        numbers[..ELEMENTS].copy_from_slice(&self.hysteresis.elements());
        numbers[ELEMENTS..2 * ELEMENTS].copy_from_slice(&self.direction.elements());
        numbers
    }

    /// The memory of the numbers of [`Self::to_array`]; what is missing is zero.
    #[must_use]
    pub fn from_slice(numbers: &[f64]) -> Self {
        let at = |k: usize| numbers.get(k).copied().unwrap_or(0.0);
        Self {
            hysteresis: Slip::from_elements(std::array::from_fn(at)),
            direction: Slip::from_elements(std::array::from_fn(|k| at(k + ELEMENTS))),
            largest: at(2 * ELEMENTS),
        }
    }
}
