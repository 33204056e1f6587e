//! `closure_supply`: mass flow into a supply that no named effect explains, as a sum of coefficients times terms of a fixed dictionary.
//!
//! `m = sum_k c_k t_k`, every coefficient in kg/s: `p` is the absolute pressure in bar, `x` the sum of the openings through which its valves fill.
//! One memory, `z' = (p - z)/T`: of a tank whose gas has been cooled or warmed by its change. See `closure_torque`.

use super::{EffectInfo, EffectParameter};
use crate::scalar::{constant, Scalar};

/// Number of terms.
pub const TERMS: usize = 5;
/// Parameters: the coefficients of the terms, then the memory time.
pub const PARAMETERS: usize = TERMS + 1;

const fn term(name: &'static str) -> EffectParameter {
    EffectParameter::new(name, "kg/s").within(-1e6, 1e6)
}

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "closure_supply",
    block: "supply",
    at: "supply",
    parameters: &[
        term("constant"),
        term("pressure"),
        term("opening"),
        term("filling"),
        term("pressure_memory"),
        EffectParameter::new("memory_time", "s").within(0.01, 1e6),
    ],
};

/// A supply at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Here<S> {
    /// Absolute pressure [bar].
    pub pressure: S,
    /// Sum of the openings of the valves that fill from it, 0 for each that vents.
    pub opening: S,
    /// `z` [bar].
    pub memory: S,
}

impl<S: Scalar> Here<S> {
    /// Every term, in the order of the parameters.
    #[inline]
    pub fn terms(&self) -> [S; TERMS] {
        let Self { pressure: p, opening: x, memory: z } = *self;
        [constant(1.0), p, x, x * p, p - z]
    }

    /// Mass flow into the supply [kg/s].
    #[inline]
    pub fn mass_flow(&self, coefficients: &[S]) -> S {
        self.terms().iter().zip(coefficients).fold(constant(0.0), |sum, (term, c)| sum + *term * *c)
    }

    /// Rate of what is remembered, for a memory time [s].
    #[inline]
    pub fn rate(&self, time: S) -> S {
        (self.pressure - self.memory) / time
    }
}

/// Largest change of the flow per pressure of the supply [kg/(s bar)], with all of so many valves open.
pub fn steepest(values: &[f64; PARAMETERS], valves: f64) -> f64 {
    values[1].abs() + values[3].abs() * valves + values[4].abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_term_is_what_its_name_says() {
        let point = Here { pressure: 14.0, opening: 0.5, memory: 13.0 };
        assert_eq!(point.terms(), [1.0, 14.0, 0.5, 7.0, 1.0]);
        assert_eq!(point.mass_flow(&[0.0; TERMS]), 0.0);
        assert_eq!((point.mass_flow(&[0.0, 0.0, 0.0, 2.0, -1.0]), point.rate(0.5)), (13.0, 2.0));
        assert_eq!(steepest(&[9.0, 1.0, 9.0, -2.0, -1.0, 1.0], 2.0), 6.0);
    }
}
