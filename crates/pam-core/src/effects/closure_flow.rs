//! `closure_flow`: mass flow into a chamber that no named effect explains, as a sum of coefficients
//! times terms of a fixed dictionary.
//!
//! `m = sum_k c_k t_k`, every coefficient in kg/s: `p` is the absolute pressure and `ps` that of
//! the supply in bar, `x` the opening of the valve (-1 vents fully, 1 fills fully), `dV` the rate
//! of the volume in l/s. Air that comes in is counted as inflow, air that goes out as outflow. Two
//! memories, `z' = (p - z)/T` and `zx' = (x - zx)/T`; around the null `n = exp(-(x/0.05)^2/2)`, on
//! one side of it `tanh(x/0.01)`. See `closure_torque`.

use super::{
    At, Effect, EffectInfo, EffectParameter, EffectState, Extremes, Form, Port, Role, BAR, LITRE,
};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

/// Number of terms.
pub const TERMS: usize = 16;
/// Parameters: the coefficients of the terms, then the memory time.
pub const PARAMETERS: usize = TERMS + 1;
/// States of a chamber with it: `z`, `zx`.
pub const STATES: usize = 2;
/// Opening around the null in which its term counts.
const NULL: f64 = 0.05;
/// Opening over which the terms of a side turn on: what a dead zone or a lap takes is the same
/// beyond it.
const SIDE: f64 = 0.01;

const fn term(name: &'static str) -> EffectParameter {
    EffectParameter::new(name, "kg/s", -1e6, 1e6, 0.0).starts(&[-1e-5, 1e-5]).off(0.0)
}

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "closure_flow",
    block: "chamber",
    at: "chamber",
    named: false,
    order: 3,
    source: "Brunton, Proctor & Kutz (2016), sparse dictionaries",
    forms: &[Form {
        name: "sum_of_terms",
        parameters: &[
            term("constant"),
            term("pressure"),
            term("pressure_squared"),
            term("opening"),
            term("abs_opening"),
            term("opening_pressure"),
            term("abs_opening_pressure"),
            term("filling"),
            term("sign_filling"),
            term("sign_venting"),
            term("at_null"),
            term("supply_difference"),
            term("volume_rate"),
            term("pressure_memory"),
            term("opening_memory"),
            term("opening_memory_pressure"),
            EffectParameter::new("memory_time", "s", 0.01, 1e6, 1.0).starts(&[0.1, 0.5, 2.0, 8.0]),
        ],
        states: &[
            EffectState { name: "pressure", role: Role::Moves },
            EffectState { name: "opening", role: Role::Moves },
        ],
        integrates: true,
        ports: &[Port::Inflow],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// A chamber at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Here<S> {
    /// Absolute pressure [bar].
    pub pressure: S,
    /// Absolute pressure before its valve [bar]; its own without one.
    pub supply: S,
    /// Opening of its valve, -1 to 1.
    pub opening: S,
    /// Rate of its volume [l/s].
    pub volume_rate: S,
    /// `z` [bar], `zx`.
    pub memory: [S; STATES],
}

impl<S: Scalar> Here<S> {
    /// Every term, in the order of the parameters.
    #[inline]
    pub fn terms(&self) -> [S; TERMS] {
        let Self { pressure: p, supply, opening: x, volume_rate, memory: [z, zx] } = *self;
        let zero = constant::<S>(0.0);
        let (fills, vents) = if x.re() < 0.0 { (zero, -x) } else { (x, zero) };
        let size = fills + vents;
        let null = (x * x * (-0.5 / (NULL * NULL))).exp();
        [
            constant(1.0),
            p,
            p * p,
            x,
            size,
            x * p,
            size * p,
            fills * (supply - p),
            (fills / SIDE).tanh() * supply,
            (vents / SIDE).tanh() * p,
            null,
            supply - p,
            p * volume_rate,
            p - z,
            x - zx,
            (x - zx) * p,
        ]
    }

    /// Mass flow into the chamber [kg/s].
    #[inline]
    pub fn mass_flow(&self, coefficients: &[S]) -> S {
        self.terms().iter().zip(coefficients).fold(constant(0.0), |sum, (term, c)| sum + *term * *c)
    }

    /// Rates of what is remembered, for a memory time [s].
    #[inline]
    pub fn rates(&self, time: S) -> [S; STATES] {
        [(self.pressure - self.memory[0]) / time, (self.opening - self.memory[1]) / time]
    }
}

/// Largest change of the flow per pressure of the chamber [kg/(s bar)], up to an absolute pressure
/// [bar].
pub fn steepest(values: &[f64; PARAMETERS], pressure: f64) -> f64 {
    let c = |name: &str| {
        let k = INFO.parameters().iter().position(|p| p.name == name);
        k.map_or(0.0, |k| values[k].abs())
    };
    c("pressure")
        + 2.0 * c("pressure_squared") * pressure
        + c("opening_pressure")
        + c("abs_opening_pressure")
        + c("filling")
        + c("sign_filling")
        + c("sign_venting")
        + c("supply_difference")
        + c("volume_rate")
        + c("pressure_memory")
        + 2.0 * c("opening_memory_pressure")
}

/// A sum of flows into a chamber; its states are the remembered pressure and opening.
#[derive(Debug, Clone, Copy)]
struct ClosureFlow<S>([S; PARAMETERS]);

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(ClosureFlow(std::array::from_fn(|k| values[k])))
}

/// What it sees of a chamber, None elsewhere.
fn here<S: Scalar>(at: &At<S>, own: &[S]) -> Option<Here<S>> {
    match at {
        At::Chamber { pressure, supply, opening, volume_rate } => Some(Here {
            pressure: *pressure / BAR,
            supply: *supply / BAR,
            opening: *opening,
            volume_rate: *volume_rate / LITRE,
            memory: [own[0], own[1]],
        }),
        _ => None,
    }
}

impl<S: Scalar> Effect<S> for ClosureFlow<S> {
    fn start(&self, _gas: &Gas, at: &At<S>, own: &mut [S]) {
        if let At::Chamber { pressure, .. } = at {
            own.copy_from_slice(&[*pressure / BAR, constant(0.0)]);
        }
    }

    fn rates(&self, at: &At<S>, own: &[S], rates: &mut [S]) {
        if let Some(here) = here(at, own) {
            rates.copy_from_slice(&here.rates(self.0[TERMS]));
        }
    }

    fn inflow(&self, at: &At<S>, own: &[S]) -> S {
        here(at, own).map_or(constant(0.0), |here| here.mass_flow(&self.0))
    }

    fn fastest(&self) -> f64 {
        1.0 / self.0[TERMS].re()
    }

    fn steepest(&self, _gas: &Gas, most: &Extremes) -> f64 {
        // Openings of several valves add up.
        steepest(&self.0.map(|v| v.re()), most.pressure / BAR) * most.valves.max(1) as f64 / BAR
    }

    fn terms(&self, at: &At<S>, own: &[S]) -> Vec<S> {
        here(at, own).map_or(Vec::new(), |here| here.terms().to_vec())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(name: &str) -> usize {
        INFO.parameters().iter().position(|p| p.name == name).unwrap()
    }

    #[test]
    fn each_term_is_what_its_name_says() {
        let filling =
            Here { pressure: 3.0, supply: 8.0, opening: 0.5, volume_rate: 0.1, memory: [2.5, 0.1] };
        let venting = Here { opening: -0.05, ..filling };
        let of = |point: &Here<f64>, name: &str| point.terms()[place(name)];
        assert_eq!((of(&filling, "filling"), of(&venting, "filling")), (2.5, 0.0));
        assert_eq!((of(&filling, "opening_pressure"), of(&venting, "abs_opening")), (1.5, 0.05));
        assert!((of(&filling, "volume_rate") - 0.3).abs() < 1e-12);
        assert!((of(&filling, "opening_memory_pressure") - 1.2).abs() < 1e-12);
        assert_eq!(
            (of(&filling, "pressure_memory"), of(&filling, "supply_difference")),
            (0.5, 5.0)
        );
        assert!((of(&venting, "sign_venting") - 3.0 * 5.0_f64.tanh()).abs() < 1e-12);
        assert_eq!((of(&venting, "sign_filling"), of(&filling, "sign_filling")), (0.0, 8.0));
        assert!(of(&filling, "at_null") < 1e-20);
        let mut coefficients = [0.0; TERMS];
        assert_eq!(filling.mass_flow(&coefficients), 0.0);
        coefficients[place("pressure_memory")] = -2e-6;
        assert!((filling.mass_flow(&coefficients) + 1e-6).abs() < 1e-18);
        assert_eq!(filling.rates(0.5), [1.0, 0.8]);
    }

    #[test]
    fn the_steepest_bounds_the_slope() {
        let values: [f64; PARAMETERS] =
            std::array::from_fn(|k| if k < 12 { 0.3 + 0.1 * k as f64 } else { 1.0 });
        let bound = steepest(&values, 9.0);
        for opening in [-1.0, -0.05, 0.0, 0.04, 1.0] {
            let flow = |pressure: f64| {
                Here { pressure, supply: 9.0, opening, volume_rate: 0.0, memory: [1.0, 0.0] }
                    .mass_flow(&values)
            };
            assert!((flow(8.0 + 1e-6) - flow(8.0 - 1e-6)).abs() / 2e-6 < bound);
        }
    }
}
