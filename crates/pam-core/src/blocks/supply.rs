//! Where the air comes from.
//!
//! A tank empties isothermally, `dP/dt = -(R T/V) mdot` (dissertation 6.3); a constant source keeps
//! its pressure; a relieving regulator brings its outlet to the set pressure with a lag, less by
//! its droop under flow: `dP/dt = (P_set - k mdot - P)/tau` (P. Beater, *Pneumatic Drives*, 2007,
//! ch. 8), no faster up and down than its limits, and later by its dead time. With a dead band `b`
//! it answers of the error `P_set - P` what is beyond the band ([`answered`]): C. Robinson,
//! *Modeling and control of pneumatic artificial muscles* (2014), ch. 3.
//!
//! A regulator lets through what its inlet has and no more: behind a supply of the pressure `P_in`
//! it brings its outlet towards `min(P_set, P_in)`, dead band or not: wide open it reduces nothing.

use crate::clock::Edge;
use crate::scalar::{constant, Scalar};

/// Rate of a regulator's outlet pressure that is no limit [Pa/s].
pub use crate::keys::FASTEST;

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
        /// Fastest rise of the outlet pressure [Pa/s].
        rise_limit: S,
        /// Fastest fall of it [Pa/s].
        fall_limit: S,
        /// How late the command acts [s].
        dead_time: S,
        /// Error of the pressure that it does nothing about [Pa].
        dead_band: S,
    },
}

/// The error that a regulator answers [Pa], of the one that it has: `sgn(e) max(|e| - b, 0)`.
#[inline]
pub fn answered<S: Scalar>(error: S, dead_band: S) -> S {
    if error.re() > dead_band.re() {
        error - dead_band
    } else if error.re() < -dead_band.re() {
        error + dead_band
    } else {
        constant(0.0)
    }
}

impl<S: Scalar> Supply<S> {
    /// Rate of the absolute pressure [Pa/s] while a mass flow [kg/s] goes out; `rt` is `R T`
    /// [J/kg], `inlet` the pressure in front of a regulator where it has a supply there.
    #[inline]
    pub fn pressure_rate(
        &self,
        pressure: S,
        outflow: S,
        rt: f64,
        set: &Edge<S>,
        inlet: Option<S>,
    ) -> S {
        match self {
            Self::Tank(volume) => -(outflow * rt) / *volume,
            Self::Constant => constant(0.0),
            Self::Regulator { time_constant, droop, rise_limit, fall_limit, dead_band, .. } => {
                let towards = |set: S| {
                    let short = inlet.filter(|inlet| {
                        let wanted = answered(set - pressure, *dead_band).re();
                        inlet.re() - pressure.re() < wanted
                    });
                    let rate = if let Some(inlet) = short {
                        (-pressure - *droop * outflow + inlet) / *time_constant
                    } else if dead_band.re() > 0.0 {
                        (answered(set - pressure, *dead_band) - *droop * outflow) / *time_constant
                    } else {
                        (-pressure - *droop * outflow + set) / *time_constant
                    };
                    if rate.re() > rise_limit.re() {
                        *rise_limit
                    } else if rate.re() < -fall_limit.re() {
                        -*fall_limit
                    } else {
                        rate
                    }
                };
                let rate = towards(set.now);
                if set.changes() {
                    rate + set.share_before * (towards(set.before) - rate)
                } else {
                    rate
                }
            }
        }
    }

    /// Whether it follows every command, at once, and as fast as its lag lets it.
    pub fn first_order(&self) -> bool {
        match self {
            Self::Regulator { rise_limit, fall_limit, dead_time, dead_band, .. } => {
                let late = dead_time.re() > 0.0 || dead_band.re() > 0.0;
                rise_limit.re().min(fall_limit.re()) >= FASTEST && !late
            }
            _ => true,
        }
    }

    /// How late its command acts [s].
    #[inline]
    pub fn dead_time(&self) -> S {
        match self {
            Self::Regulator { dead_time, .. } => *dead_time,
            _ => constant(0.0),
        }
    }

    /// Largest eigenvalue [1/s] under openings that let `steepest` [kg/(s Pa)] more through for
    /// each Pa, where what a regulator is brought to stands still.
    pub fn fastest(&self, steepest: f64, rt: f64) -> f64 {
        match self {
            Self::Tank(volume) => rt * steepest / volume.re(),
            Self::Constant => 0.0,
            Self::Regulator { time_constant, droop, .. } => {
                (1.0 + droop.re() * steepest) / time_constant.re()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_regulator_is_brought_to_its_inlet_where_that_is_below_its_command() {
        let at = Edge::steady;
        for dead_band in [0.0, 2e4] {
            let regulator = Supply::<f64>::Regulator {
                time_constant: 0.1,
                droop: 1e7,
                rise_limit: 2e6,
                fall_limit: 3e6,
                dead_time: 0.0,
                dead_band,
            };
            let rate = |pressure, outflow, set: f64, inlet| {
                regulator.pressure_rate(pressure, outflow, 8.4e4, &at(set), inlet)
            };
            assert_eq!(rate(3e5, 0.0, 5e5, Some(3e5)), 0.0);
            assert!((rate(3e5, 1e-3, 5e5, Some(4e5)) - 9e5).abs() < 1e-6);
            // above its inlet it falls, whatever its band
            assert!((rate(3.1e5, 0.0, 3.1e5, Some(3e5)) + 1e5).abs() < 1e-6);
            assert_eq!(rate(1e5, 0.0, 9e5, Some(8e5)), 2e6);
            assert_eq!(rate(4e5, 1e-3, 5e5, Some(9e5)), rate(4e5, 1e-3, 5e5, None));
            // each part of a step by itself
            let edge = Edge { now: 5e5, before: 2.5e5, share_before: 0.5 };
            let parts = [5e5, 2.5e5].map(|set| rate(2e5, 0.0, set, Some(3e5)));
            let both = regulator.pressure_rate(2e5, 0.0, 8.4e4, &edge, Some(3e5));
            assert!((both - (parts[0] + parts[1]) / 2.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_regulator_settles_at_the_set_pressure_less_its_droop() {
        let regulator = Supply::<f64>::Regulator {
            time_constant: 0.1,
            droop: 1e7,
            rise_limit: 2e6,
            fall_limit: 3e6,
            dead_time: 0.03,
            dead_band: 0.0,
        };
        assert_eq!(regulator.dead_time(), 0.03);
        let at = Edge::steady;
        assert_eq!(regulator.pressure_rate(1e5, 0.0, 8.4e4, &at(5e5), None), 2e6);
        assert_eq!(regulator.pressure_rate(5e5, 0.0, 8.4e4, &at(1e5), None), -3e6);
        let edge = Edge { now: 5e5, before: 1e5, share_before: 0.25 };
        assert_eq!(regulator.pressure_rate(1e5, 0.0, 8.4e4, &edge, None), 1.5e6);
        assert!(regulator.pressure_rate(5e5 - 1e4, 1e-3, 8.4e4, &at(5e5), None).abs() < 1e-6);
        assert!((regulator.pressure_rate(4e5, 0.0, 8.4e4, &at(5e5), None) - 1e6).abs() < 1e-6);
        let mut banded = regulator;
        if let Supply::Regulator { dead_band, .. } = &mut banded {
            *dead_band = 2e4;
        }
        assert!(!banded.first_order());
        assert_eq!(banded.pressure_rate(5e5, 0.0, 8.4e4, &at(5.15e5), None), 0.0);
        assert!((banded.pressure_rate(5e5, 0.0, 8.4e4, &at(5.3e5), None) - 1e5).abs() < 1e-6);
        assert!((banded.pressure_rate(5e5, 0.0, 8.4e4, &at(4.7e5), None) + 1e5).abs() < 1e-6);
        assert!((banded.pressure_rate(5e5, 1e-3, 8.4e4, &at(5e5), None) + 1e5).abs() < 1e-6);
        assert_eq!(Supply::<f64>::Constant.pressure_rate(1e5, 1.0, 8.4e4, &at(0.0), None), 0.0);
        assert!(
            (Supply::Tank(0.01).pressure_rate(1e5, 1e-3, 8.4e4, &at(0.0), None) + 8.4e3_f64).abs()
                < 1e-9
        );
    }
}
