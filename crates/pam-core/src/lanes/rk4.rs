//! Fixed-step integration of several plants side by side, as [`crate::simulate::integrate`].

use super::num::Num;
use super::rates::Lanes;
use pulp::Simd;

/// The classical Runge-Kutta method over lanes.
pub(super) struct Rk4<S: Simd> {
    stage: Vec<Num<S>>,
    rate: Vec<Num<S>>,
    sum: Vec<Num<S>>,
    /// Rates that were asked for since the start.
    pub evaluations: u64,
}

impl<S: Simd> Rk4<S> {
    pub fn new(state: &[Num<S>]) -> Self {
        let zeros = || state.iter().map(|value| value.constant(0.0)).collect::<Vec<_>>();
        Self { stage: zeros(), rate: zeros(), sum: zeros(), evaluations: 0 }
    }

    #[inline(always)]
    pub fn step(&mut self, lanes: &mut Lanes<'_, S>, state: &mut [Num<S>], step: f64) {
        // The rates stand here once: they are much code, and compiled for each kind of register.
        // No slope of the last step is left: a lane that was put back would keep what is no number.
        for (sum, slope) in self.sum.iter_mut().zip(&mut self.rate) {
            (*sum, *slope) = (sum.constant(0.0), sum.constant(0.0));
        }
        for (fraction, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            for ((stage, start), slope) in self.stage.iter_mut().zip(&*state).zip(&self.rate) {
                *stage = *start + *slope * (fraction * step);
            }
            lanes.rates(&self.stage, &mut self.rate);
            self.evaluations += 1;
            for (sum, slope) in self.sum.iter_mut().zip(&self.rate) {
                *sum += *slope * weight;
            }
        }
        for (value, sum) in state.iter_mut().zip(&self.sum) {
            *value += *sum * (step / 6.0);
        }
    }
}
