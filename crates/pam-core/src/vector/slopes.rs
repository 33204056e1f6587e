//! Slopes of a stage, used as they come.

use super::num::{Num, Registers};
use pulp::Simd;

/// Where the slopes of a stage go. Each is used as it comes: a plant alone would wait for it to be
/// written and read.
pub(crate) struct Slopes<'s, S: Simd, R: Registers> {
    pub start: &'s [Num<S, R>],
    pub sum: &'s mut [Num<S, R>],
    pub next: &'s mut [Num<S, R>],
    pub weight: f64,
    /// From the start of the step to the next stage [s].
    pub ahead: f64,
    /// Of the first stage.
    pub first: bool,
}

impl<S: Simd, R: Registers> Slopes<'_, S, R> {
    /// The slope of the state at a place.
    #[inline(always)]
    pub fn set(&mut self, place: usize, slope: Num<S, R>) {
        self.gather(place, slope);
        self.next[place] = slope.times_plus(self.ahead, self.start[place]);
    }

    /// The same where no slope depends on that state.
    #[inline(always)]
    pub fn gather(&mut self, place: usize, slope: Num<S, R>) {
        self.sum[place] = slope.times_plus(self.weight, self.sum[place]);
    }
}
