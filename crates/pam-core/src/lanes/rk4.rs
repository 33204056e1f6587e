//! Fixed-step integration of several plants side by side, as [`crate::simulate::integrate`].

use super::num::Num;
use super::rates::{Lanes, Shape};
use pulp::Simd;

/// The classical Runge-Kutta method over lanes.
pub(super) struct Rk4<S: Simd, const R: usize> {
    stage: Vec<Num<S, R>>,
    next: Vec<Num<S, R>>,
    sum: Vec<Num<S, R>>,
    /// Rates that were asked for since the start.
    pub evaluations: u64,
}

impl<S: Simd, const R: usize> Rk4<S, R> {
    pub fn new(state: &[Num<S, R>]) -> Self {
        let zeros = || state.iter().map(|value| value.constant(0.0)).collect::<Vec<_>>();
        Self { stage: zeros(), next: zeros(), sum: zeros(), evaluations: 0 }
    }

    /// The state before the last step.
    #[inline(always)]
    pub fn before(&self) -> &[Num<S, R>] {
        &self.stage
    }

    #[inline(always)]
    pub fn step<W: Simd>(
        &mut self,
        wide: W,
        shape: Shape,
        lanes: &mut Lanes<'_, S, R>,
        state: &mut Vec<Num<S, R>>,
        step: f64,
    ) {
        // The rates stand here once: they are much code, compiled for each kind of register.
        for k in 0..4 {
            self.stage(wide, shape, lanes, state, step, k);
        }
        std::mem::swap(state, &mut self.stage);
    }

    /// One stage of four; the last one leaves the next state in [`Self::stage`].
    #[inline(always)]
    fn stage<W: Simd>(
        &mut self,
        wide: W,
        shape: Shape,
        lanes: &mut Lanes<'_, S, R>,
        state: &[Num<S, R>],
        step: f64,
        k: usize,
    ) {
        let Self { stage, next, sum, evaluations } = self;
        let states = shape.states();
        let slopes = Slopes {
            start: &state[..states],
            sum: &mut sum[..states],
            next: &mut next[..states],
            weight: if k == 0 || k == 3 { 1.0 } else { 2.0 },
            ahead: if k == 2 { step } else { 0.5 * step },
            whole: step / 6.0,
            first: k == 0,
            last: k == 3,
        };
        let here = if k == 0 { &state[..states] } else { &stage[..states] };
        lanes.rates(wide, shape, here, slopes);
        *evaluations += 1;
        std::mem::swap(stage, next);
    }
}

/// Where the slopes of a stage go. Each is used as it comes: a plant alone would wait for it to be
/// written and read.
pub(super) struct Slopes<'s, S: Simd, const R: usize> {
    start: &'s [Num<S, R>],
    sum: &'s mut [Num<S, R>],
    next: &'s mut [Num<S, R>],
    weight: f64,
    /// From the start of the step to the next stage [s].
    ahead: f64,
    /// Step by the sum of all weights [s].
    whole: f64,
    /// Of the first stage.
    pub first: bool,
    /// Of the last one.
    last: bool,
}

impl<S: Simd, const R: usize> Slopes<'_, S, R> {
    /// The slope of the state at a place.
    #[inline(always)]
    pub fn set(&mut self, place: usize, slope: Num<S, R>) {
        let sum = self.summed(place, slope);
        let start = self.start[place];
        self.next[place] = match self.last {
            true => sum.times_plus(self.whole, start),
            false => slope.times_plus(self.ahead, start),
        };
    }

    /// The same where no slope depends on that state.
    #[inline(always)]
    pub fn gather(&mut self, place: usize, slope: Num<S, R>) {
        let sum = self.summed(place, slope);
        if self.last {
            self.next[place] = sum.times_plus(self.whole, self.start[place]);
        }
    }

    #[inline(always)]
    fn summed(&mut self, place: usize, slope: Num<S, R>) -> Num<S, R> {
        // Nothing is left of the last step: it may have been no number.
        let before = if self.first { slope.constant(0.0) } else { self.sum[place] };
        let sum = slope.times_plus(self.weight, before);
        self.sum[place] = sum;
        sum
    }
}
