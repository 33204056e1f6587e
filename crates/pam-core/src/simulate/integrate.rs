//! Fixed-step integration.

use crate::scalar::{constant, Scalar};
use std::ops::Range;

/// The classical fourth-order Runge-Kutta method, with the memory that its stages need.
#[derive(Debug, Clone)]
pub struct Rk4<S> {
    stage: Vec<S>,
    rate: Vec<S>,
    sum: Vec<S>,
}

impl<S: Scalar> Rk4<S> {
    /// For a number of states.
    pub fn new(states: usize) -> Self {
        let zeros = || vec![constant(0.0); states];
        Self { stage: zeros(), rate: zeros(), sum: zeros() }
    }

    /// One step in place of all states.
    ///
    /// `rate` as in [`Self::step_in`].
    #[inline]
    pub fn step(&mut self, state: &mut [S], step: f64, rate: impl FnMut(f64, &mut [S], &mut [S])) {
        let all = 0..state.len();
        self.step_in(state, std::iter::once(all), step, rate);
    }

    /// One step in place of the states in `runs`; the others stay as they are.
    ///
    /// `rate(fraction, state, out)` writes the time derivative at `fraction` (0, 1/2 or 1) of the
    /// step; it may overwrite driven entries of the state that it is given.
    #[inline]
    pub fn step_in(
        &mut self,
        state: &mut [S],
        runs: impl Iterator<Item = Range<usize>> + Clone,
        step: f64,
        mut rate: impl FnMut(f64, &mut [S], &mut [S]),
    ) {
        self.stage.copy_from_slice(state);
        rate(0.0, &mut self.stage, &mut self.rate);
        for run in runs.clone() {
            self.sum[run.clone()].copy_from_slice(&self.rate[run]);
        }
        for (fraction, weight) in [(0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            for run in runs.clone() {
                let stages = self.stage[run.clone()].iter_mut();
                let from = state[run.clone()].iter().zip(&self.rate[run]);
                for (stage, (start, slope)) in stages.zip(from) {
                    *stage = *start + *slope * (fraction * step);
                }
            }
            rate(fraction, &mut self.stage, &mut self.rate);
            for run in runs.clone() {
                for (sum, slope) in self.sum[run.clone()].iter_mut().zip(&self.rate[run]) {
                    *sum += *slope * weight;
                }
            }
        }
        for run in runs {
            for (value, sum) in state[run.clone()].iter_mut().zip(&self.sum[run]) {
                *value += *sum * (step / 6.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_is_four() {
        let error = |n: u32| {
            let h = 1.0 / f64::from(n);
            let (mut y, mut method) = ([1.0_f64, 0.0], Rk4::new(2));
            for _ in 0..n {
                method.step(&mut y, h, |_, y, out| out.copy_from_slice(&[y[1], -y[0]]));
            }
            (y[0] - 1f64.cos()).abs()
        };
        let order = (error(20) / error(40)).log2();
        assert!((order - 4.0).abs() < 0.1, "order {order}");
    }
}
