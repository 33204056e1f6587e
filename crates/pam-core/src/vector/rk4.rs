//! Fixed-step integration of several plants side by side, as [`crate::simulate::integrate`].

use super::num::{Num, Registers};
use super::rates::{Lanes, Shape, SMALL};
use super::slopes::Slopes;
use pulp::Simd;

/// The classical Runge-Kutta method over lanes.
pub(crate) struct Rk4<S: Simd, R: Registers> {
    before: Vec<Num<S, R>>,
    stage: Vec<Num<S, R>>,
    next: Vec<Num<S, R>>,
    sum: Vec<Num<S, R>>,
    /// Rates that were asked for since the start.
    pub evaluations: u64,
}

impl<S: Simd, R: Registers> Rk4<S, R> {
    pub fn new(state: &[Num<S, R>]) -> Self {
        let zeros = || state.iter().map(|value| value.constant(0.0)).collect::<Vec<_>>();
        Self { before: zeros(), stage: zeros(), next: zeros(), sum: zeros(), evaluations: 0 }
    }

    /// The state before the last step.
    #[inline(always)]
    pub fn before(&self) -> &[Num<S, R>] {
        &self.before
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
        std::mem::swap(state, &mut self.before);
        self.evaluations += 4;
        let states = shape.states();
        let Self { before, stage, next, sum, .. } = self;
        if shape.is_known() {
            // Numbers whose places are known stay in registers.
            let zero = before[0].constant(0.0);
            let mut known = [[zero; SMALL]; 4];
            let [start, stage, next, sum] = &mut known;
            start[..states].copy_from_slice(&before[..states]);
            let room = Stages { start, stage, next, sum };
            room.step(wide, shape, lanes, &mut state[..states], step);
        } else {
            let room = Stages {
                start: &before[..states],
                stage: &mut stage[..states],
                next: &mut next[..states],
                sum: &mut sum[..states],
            };
            room.step(wide, shape, lanes, &mut state[..states], step);
        }
    }
}

/// Weight of each stage's slopes, and how far ahead the next stage is, in steps.
const STAGES: [(f64, f64); 4] = [(1.0, 0.5), (2.0, 0.5), (2.0, 1.0), (1.0, 0.0)];

/// A step on its way, place by place of the state.
struct Stages<'s, S: Simd, R: Registers> {
    start: &'s [Num<S, R>],
    stage: &'s mut [Num<S, R>],
    next: &'s mut [Num<S, R>],
    sum: &'s mut [Num<S, R>],
}

impl<S: Simd, R: Registers> Stages<'_, S, R> {
    #[inline(always)]
    fn step<W: Simd>(
        self,
        wide: W,
        shape: Shape,
        lanes: &mut Lanes<'_, S, R>,
        out: &mut [Num<S, R>],
        step: f64,
    ) {
        let Self { start, stage, next, sum } = self;
        let zero = start[0].constant(0.0);
        for place in 0..shape.states() {
            // Nothing is left of the last step: it may have been no number.
            (stage[place], next[place], sum[place]) = (start[place], start[place], zero);
        }
        // The rates stand here once: they are much code, compiled for each kind of register.
        for (k, (weight, ahead)) in STAGES.into_iter().enumerate() {
            let slopes = Slopes { start, sum, next, weight, ahead: ahead * step, first: k == 0 };
            lanes.rates(wide, shape, stage, slopes);
            stage[..shape.states()].copy_from_slice(&next[..shape.states()]);
        }
        for place in 0..shape.states() {
            out[place] = sum[place].times_plus(step / 6.0, start[place]);
        }
    }
}
