//! Physics that a nominal model leaves out: one file each, plugged into a block.
//!
//! An effect that is absent costs the step loop at most one branch on a flag. What it remembers (a spool's position, a creeping
//! strain, a relay) stands behind the states of the rig, see [`crate::plant::Layout`].

pub mod activation_pressure;
pub mod base_flexibility;
pub mod clock_skew;
pub mod closure_flow;
pub mod closure_supply;
pub mod closure_torque;
pub mod compressor_cut_in;
pub mod external_torque;
pub mod heat_transfer;
pub mod input_path_lag;
pub mod joint_coulomb_stribeck;
pub mod joint_end_stop;
pub mod leak_muscle;
pub mod mullins_softening;
pub mod muscle_creep;
pub mod muscle_hysteresis;
pub mod muscle_rate_damping;
pub mod pam_crowding_contact;
pub mod payload_change;
pub mod payload_swing;
pub mod pressure_lag;
pub mod supply_leak;
pub mod supply_regulator_deadband;
pub mod tube_flow_restriction;
pub mod valve_centre_leakage;
pub mod valve_dead_zone;
pub mod valve_hysteresis;

use crate::scalar::{constant, Scalar};

/// One parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectParameter {
    /// Name, public API.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Least possible value.
    pub lower: f64,
    /// Greatest possible value.
    pub upper: f64,
}

impl EffectParameter {
    /// A parameter that is not negative.
    #[must_use]
    pub const fn new(name: &'static str, unit: &'static str) -> Self {
        Self { name, unit, lower: 0.0, upper: f64::MAX }
    }

    /// The same with bounds of the possible.
    #[must_use]
    pub const fn within(self, lower: f64, upper: f64) -> Self {
        Self { lower, upper, ..self }
    }
}

/// Identifier, block and parameters of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectInfo {
    /// Identifier, public API.
    pub id: &'static str,
    /// Block in which it acts.
    pub block: &'static str,
    /// Kind of the blocks of which an effect can take one, by its name; empty for an effect on the whole rig.
    pub at: &'static str,
    /// Its parameters.
    pub parameters: &'static [EffectParameter],
}

/// Every effect of the core, in the order of the chain; behind them the closures, which model a mismatch without naming it.
pub const EFFECTS: &[EffectInfo] = &[
    supply_leak::INFO,
    compressor_cut_in::INFO,
    supply_regulator_deadband::INFO,
    valve_dead_zone::INFO,
    valve_hysteresis::INFO,
    valve_centre_leakage::INFO,
    input_path_lag::INFO,
    tube_flow_restriction::INFO,
    leak_muscle::INFO,
    heat_transfer::INFO,
    muscle_hysteresis::INFO,
    muscle_creep::INFO,
    muscle_rate_damping::INFO,
    activation_pressure::INFO,
    mullins_softening::INFO,
    pam_crowding_contact::INFO,
    joint_coulomb_stribeck::INFO,
    joint_end_stop::INFO,
    payload_swing::INFO,
    payload_change::INFO,
    external_torque::INFO,
    base_flexibility::INFO,
    pressure_lag::INFO,
    clock_skew::INFO,
    closure_supply::INFO,
    closure_flow::INFO,
    closure_torque::INFO,
];

/// Time that a sudden change takes [s]: short for an arm, long enough for a step, so that its moment can be fitted.
pub const RISE: f64 = 0.02;

/// From 0 before a time to 1 after it [s], along `3 s^2 - 2 s^3` over [`RISE`].
#[inline]
pub fn risen<S: Scalar>(now: f64, time: S) -> S {
    risen_over(now, time, constant(RISE))
}

/// From 0 before a time to 1 a rise after it [s], along `3 s^2 - 2 s^3`.
#[inline]
pub fn risen_over<S: Scalar>(now: f64, time: S, rise: S) -> S {
    let share = (-time + now) / rise;
    if share.re() <= 0.0 {
        constant(0.0)
    } else if share.re() >= 1.0 {
        constant(1.0)
    } else {
        share * share * (share * -2.0 + 3.0)
    }
}

/// How far a value is beyond zero, with a round corner of a width: `x^2/(2 w)`, then `x - w/2`.
#[inline]
pub fn beyond<S: Scalar>(x: S, width: f64) -> S {
    if x.re() <= 0.0 {
        constant(0.0)
    } else if x.re() < width {
        x * x / (2.0 * width)
    } else {
        x - 0.5 * width
    }
}

/// `d (d/d_0)^(n-1)`: what a contact that grows stiffer with its depth `d` is multiplied with, `d` itself at the depth `d_0`.
#[inline]
pub fn progressive<S: Scalar>(depth: S, unit: f64, exponent: S) -> S {
    if depth.re() < SHALLOW {
        // a logarithm needs a depth: the softest contact is none, but where it is a spring
        return if exponent.re() > 1.0 { constant(0.0) } else { depth };
    }
    depth * ((depth / unit).ln() * (exponent - 1.0)).exp()
}

/// Depth below which a contact that grows stiffer is none.
const SHALLOW: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_rises_once_and_a_corner_is_smooth() {
        assert_eq!((risen(0.9, 1.0), risen(1.0 + 2.0 * RISE, 1.0)), (0.0, 1.0));
        assert!((risen(1.0 + 0.5 * RISE, 1.0) - 0.5_f64).abs() < 1e-12);
        for x in [0.0, 0.1] {
            let jump: f64 = beyond(x + 1e-9, 0.1) - beyond(x - 1e-9, 0.1);
            assert!(jump.abs() < 1e-8);
        }
        assert!((beyond(1.0, 0.1) - 0.95_f64).abs() < 1e-15);
    }

    #[test]
    fn ids_and_parameters_are_there_once() {
        let mut ids: Vec<_> = EFFECTS.iter().map(|e| e.id).collect();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), EFFECTS.len());
        let named = EFFECTS.iter().filter(|e| !e.id.starts_with("closure_"));
        assert!(named.clone().all(|e| (1..=10).contains(&e.parameters.len())));
        assert_eq!(named.count() + 3, EFFECTS.len());
        assert!(EFFECTS.iter().flat_map(|e| e.parameters).all(|p| p.lower < p.upper));
    }
}
