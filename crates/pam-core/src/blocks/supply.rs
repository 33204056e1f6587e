//! Where the air comes from.
//!
//! A tank empties isothermally, `dP/dt = -(R T/V) mdot` (dissertation 6.3); a constant source keeps
//! its pressure; a relieving regulator brings its outlet to the set pressure with a lag, less by
//! its droop under flow: `dP/dt = (P_set - k mdot - P)/tau` (P. Beater, *Pneumatic Drives*, 2007,
//! ch. 8).

use crate::scalar::{constant, Scalar};

/// A supply of air.
#[derive(Debug, Clone, Copy)]
pub enum Supply<S> {
    /// Finite volume [m3].
    Tank(S),
    /// As much as is wanted at one pressure.
    Constant,
    /// Outlet of a regulator.
    Regulator {
        /// Time constant [s].
        time_constant: S,
        /// Fall of the outlet pressure under flow [Pa s/kg].
        droop: S,
    },
}

impl<S: Scalar> Supply<S> {
    /// Rate of the absolute pressure [Pa/s] while a mass flow [kg/s] goes out; `rt` is `R T`
    /// [J/kg], `set` the set pressure [Pa, absolute].
    #[inline]
    pub fn pressure_rate(&self, pressure: S, outflow: S, rt: f64, set: S) -> S {
        match self {
            Self::Tank(volume) => -(outflow * rt) / *volume,
            Self::Constant => constant(0.0),
            Self::Regulator { time_constant, droop } => {
                (-pressure - *droop * outflow + set) / *time_constant
            }
        }
    }

    /// Largest eigenvalue [1/s] under openings that let `steepest` [kg/(s Pa)] more through for
    /// each Pa.
    pub fn fastest(&self, steepest: f64, rt: f64) -> f64 {
        match self {
            Self::Tank(volume) => rt * steepest / volume.re(),
            Self::Constant => 0.0,
            Self::Regulator { time_constant, droop } => {
                (1.0 + droop.re() * steepest) / time_constant.re()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_regulator_settles_at_the_set_pressure_less_its_droop() {
        let regulator = Supply::<f64>::Regulator { time_constant: 0.1, droop: 1e7 };
        assert!(regulator.pressure_rate(5e5 - 1e4, 1e-3, 8.4e4, 5e5).abs() < 1e-6);
        assert!((regulator.pressure_rate(4e5, 0.0, 8.4e4, 5e5) - 1e6).abs() < 1e-6);
        assert_eq!(Supply::<f64>::Constant.pressure_rate(1e5, 1.0, 8.4e4, 0.0), 0.0);
        assert!((Supply::Tank(0.01).pressure_rate(1e5, 1e-3, 8.4e4, 0.0) + 8.4e3_f64).abs() < 1e-9);
    }
}
