//! Physics that a nominal model leaves out: one file each, plugged into the ports of the blocks.
//!
//! A file says what the effect is ([`EffectInfo`]) and what it does at its ports ([`Effect`]);
//! nothing else in this crate knows it by name. An effect that is absent costs the step loop at
//! most one branch on a flag. What it remembers (a spool's position, a creeping strain, a relay)
//! stands behind the states of the rig, see [`crate::plant::Layout`].

mod info;
mod port;
pub mod spool;

pub(crate) use self::info::BEGINNING;
pub use self::info::{
    AtRest, EffectInfo, EffectParameter, EffectState, Form, Kink, Make, Number, Role, SameData, Use,
};
pub(crate) use self::port::{begun, BAR, BEGUN, LITRE};
pub use self::port::{At, AtMuscle, Cord, Effect, Extremes, Port};
use crate::scalar::{constant, Scalar};

/// The modules of the effects, and the list of what they are; a file that stands elsewhere is named
/// behind its module.
macro_rules! catalogue {
    ($($(#[$when:meta])? $effect:ident $(= $file:literal)?,)*) => {
        $($(#[$when])? $(#[path = $file])? pub mod $effect;)*

        /// Every effect of the core, in the order of the chain; behind them the closures, which
        /// model a mismatch without naming it.
        pub const EFFECTS: &[&EffectInfo] = &[$($(#[$when])? &$effect::INFO,)*];
    };
}

catalogue! {
    supply_leak,
    compressor_cut_in,
    supply_regulator_deadband,
    supply_regulator_delay,
    supply_regulator_slew,
    valve_dead_zone,
    valve_hysteresis,
    valve_centre_leakage,
    valve_area,
    exhaust_back_pressure,
    input_path_lag,
    tube_flow_restriction,
    line_flow_law,
    leak_muscle,
    heat_transfer,
    muscle_hysteresis,
    muscle_creep,
    muscle_rate_damping,
    activation_pressure,
    mullins_softening,
    parameter_drift,
    pam_crowding_contact,
    tendon_give,
    joint_coulomb_stribeck,
    joint_end_stop,
    payload_swing,
    payload_change,
    com_offset,
    external_torque,
    base_flexibility,
    pressure_lag,
    gauge_drift,
    load_cell_drift,
    thermometer_lag,
    sensor_lag,
    encoder_error,
    clock_skew,
    #[cfg(feature = "toy")]
    toy_joint_spring = "../../tests/toy/toy_spring.rs",
    closure_supply,
    closure_flow,
    closure_torque,
}

/// Time that a sudden change takes [s]: short for an arm, long enough for a step, so that its
/// moment can be fitted.
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

/// `d (d/d_0)^(n-1)`: what a contact that grows stiffer with its depth `d` is multiplied with, `d`
/// itself at the depth `d_0`.
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
        assert!(named.clone().all(|e| (1..=10).contains(&e.parameters().len())));
        assert_eq!(named.count() + 3, EFFECTS.len());
        assert!(EFFECTS.iter().flat_map(|e| e.parameters()).all(|p| p.lower < p.upper));
    }
}
