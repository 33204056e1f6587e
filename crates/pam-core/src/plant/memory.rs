//! What a muscle remembers of its motion.

use crate::muscle::slip::{Slip, ELEMENTS};
use crate::scalar::{constant, Scalar};

/// What a muscle by itself remembers of its motion; what effects on it remember is among their
/// states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Memory<S> {
    /// Elements of the direction of motion that the muscle's own force depends on.
    pub(super) direction: Slip<S>,
}

impl<S: Scalar> Default for Memory<S> {
    fn default() -> Self {
        Self { direction: Slip::default() }
    }
}

impl Memory<f64> {
    /// The same in another number type, without derivatives.
    pub(super) fn lift<S: Scalar>(&self) -> Memory<S> {
        Memory { direction: Slip::from_elements(self.direction.elements().map(constant)) }
    }

    /// Length of [`Self::to_array`].
    pub const NUMBERS: usize = ELEMENTS;

    /// All elements.
    #[must_use]
    pub fn to_array(&self) -> [f64; Self::NUMBERS] {
        self.direction.elements()
    }

    /// The memory of the numbers of [`Self::to_array`]; what is missing is zero.
    #[must_use]
    pub fn from_slice(numbers: &[f64]) -> Self {
        let at = |k: usize| numbers.get(k).copied().unwrap_or(0.0);
        Self { direction: Slip::from_elements(std::array::from_fn(at)) }
    }
}
