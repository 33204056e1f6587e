//! Fixed-step integration of several plants side by side, as [`crate::simulate::integrate`].

use super::num::Num;
use super::rates::Lanes;
use pulp::Simd;

/// The classical Runge-Kutta method over lanes.
pub(super) struct Rk4<S: Simd, const R: usize> {
    stage: Vec<Num<S, R>>,
    rate: Vec<Num<S, R>>,
    sum: Vec<Num<S, R>>,
    /// Rates that were asked for since the start.
    pub evaluations: u64,
}

impl<S: Simd, const R: usize> Rk4<S, R> {
    pub fn new(state: &[Num<S, R>]) -> Self {
        let zeros = || state.iter().map(|value| value.constant(0.0)).collect::<Vec<_>>();
        Self { stage: zeros(), rate: zeros(), sum: zeros(), evaluations: 0 }
    }

    #[inline(always)]
    pub fn step<W: Simd>(
        &mut self,
        wide: W,
        lanes: &mut Lanes<'_, S, R>,
        state: &mut [Num<S, R>],
        step: f64,
    ) {
        // The rates stand here once: they are much code, and compiled for each kind of register.
        // No slope of the last step is left: a lane that was put back would keep what is no number.
        for (sum, slope) in self.sum.iter_mut().zip(&mut self.rate) {
            (*sum, *slope) = (sum.constant(0.0), sum.constant(0.0));
        }
        for (fraction, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            for ((stage, start), slope) in self.stage.iter_mut().zip(&*state).zip(&self.rate) {
                *stage = *start + *slope * (fraction * step);
            }
            lanes.rates(wide, &self.stage, &mut self.rate);
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
