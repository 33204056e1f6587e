//! `closure_supply`: mass flow into a supply that no named effect explains, as a sum of
//! coefficients times terms of a fixed dictionary.
//!
//! `m = sum_k c_k t_k`, every coefficient in kg/s: `p` is the absolute pressure in bar, `x` the sum
//! of the openings through which its valves fill. One memory, `z' = (p - z)/T`: of a tank whose gas
//! has been cooled or warmed by its change. See `closure_torque`.

use super::{
    At, Effect, EffectInfo, EffectParameter, EffectState, Extremes, Form, Port, Role, BAR,
};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

/// Number of terms.
pub const TERMS: usize = 5;
/// Parameters: the coefficients of the terms, then the memory time.
pub const PARAMETERS: usize = TERMS + 1;

const fn term(name: &'static str) -> EffectParameter {
    EffectParameter::new(name, "kg/s", -1e6, 1e6, 0.0).starts(&[-1e-4, 1e-4]).off(0.0)
}

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "closure_supply",
    block: "supply",
    at: "supply",
    named: false,
    order: 4,
    source: "Brunton, Proctor & Kutz (2016), sparse dictionaries",
    forms: &[Form {
        name: "sum_of_terms",
        parameters: &[
            term("constant"),
            term("pressure"),
            term("opening"),
            term("filling"),
            term("pressure_memory"),
            EffectParameter::new("memory_time", "s", 0.01, 1e6, 1.0).starts(&[0.1, 0.5, 2.0, 8.0]),
        ],
        states: &[EffectState { name: "pressure", role: Role::Moves }],
        integrates: true,
        ports: &[Port::Inflow],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
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

/// Largest change of the flow per pressure of the supply [kg/(s bar)], with all of so many valves
/// open.
pub fn steepest(values: &[f64; PARAMETERS], valves: f64) -> f64 {
    values[1].abs() + values[3].abs() * valves + values[4].abs()
}

/// A sum of flows into a supply; its state is the remembered pressure.
#[derive(Debug, Clone, Copy)]
struct ClosureSupply<S>([S; PARAMETERS]);

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(ClosureSupply(std::array::from_fn(|k| values[k])))
}

/// What it sees of a supply, None elsewhere.
fn here<S: Scalar>(at: &At<S>, own: &[S]) -> Option<Here<S>> {
    match at {
        At::Supply { pressure, opening } => {
            Some(Here { pressure: *pressure / BAR, opening: *opening, memory: own[0] })
        }
        _ => None,
    }
}

impl<S: Scalar> Effect<S> for ClosureSupply<S> {
    fn start(&self, _gas: &Gas, at: &At<S>, own: &mut [S]) {
        if let At::Supply { pressure, .. } = at {
            own[0] = *pressure / BAR;
        }
    }

    fn rates(&self, at: &At<S>, own: &[S], rates: &mut [S]) {
        if let Some(here) = here(at, own) {
            rates[0] = here.rate(self.0[TERMS]);
        }
    }

    fn inflow(&self, at: &At<S>, own: &[S]) -> S {
        here(at, own).map_or(constant(0.0), |here| here.mass_flow(&self.0))
    }

    fn fastest(&self) -> f64 {
        1.0 / self.0[TERMS].re()
    }

    fn steepest(&self, _gas: &Gas, most: &Extremes) -> f64 {
        steepest(&self.0.map(|v| v.re()), most.valves as f64) / BAR
    }

    fn terms(&self, at: &At<S>, own: &[S]) -> Vec<S> {
        here(at, own).map_or(Vec::new(), |here| here.terms().to_vec())
    }
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
