//! Pressure of a chamber whose volume may change.
//!
//! `dP/dt = R T/V (alpha_in mdot_in - alpha_out mdot_out) - alpha P (dV/dt)/V`, dissertation
//! (3.17), (4.3), and (6.4) with its sign corrected; polytropic coefficients after Richer &
//! Hurmuzlu (2000).

use super::gas::Gas;
use crate::scalar::Scalar;

/// Polytropic coefficients of filling, emptying and volume change [1].
#[derive(Debug, Clone, Copy)]
pub struct Polytropic<S> {
    /// Inflow, 1 (isothermal) to 1.4 (adiabatic).
    pub inflow: S,
    /// Outflow.
    pub outflow: S,
    /// Expansion and compression.
    pub volume: S,
}

/// Mass flows and volume of a chamber at one instant.
#[derive(Debug, Clone, Copy)]
pub struct ChamberState<S> {
    /// Absolute pressure [Pa].
    pub pressure: S,
    /// Volume [m3].
    pub volume: S,
    /// Rate of the volume [m3/s].
    pub volume_rate: S,
    /// Mass flow in [kg/s].
    pub inflow: S,
    /// Mass flow out [kg/s].
    pub outflow: S,
}

/// Rate of the absolute pressure [Pa/s]; `rt` is `R T` [J/kg].
#[inline]
pub fn pressure_rate<S: Scalar>(c: &ChamberState<S>, alpha: &Polytropic<S>, rt: f64) -> S {
    ((alpha.inflow * c.inflow - alpha.outflow * c.outflow) * rt
        - alpha.volume * c.pressure * c.volume_rate)
        / c.volume
}

/// Wall area [m2] of `count` cylinders of one muscle's air volume [m3] and length [m].
#[inline]
pub fn cylinder_area<S: Scalar>(count: f64, volume: S, length: S) -> S {
    (volume * length * std::f64::consts::PI).sqrt() * (2.0 * count)
}

/// Wall area [m2] of a cube of a volume [m3].
#[inline]
pub fn cube_area<S: Scalar>(volume: S) -> S {
    volume.powf(2.0 / 3.0) * 6.0
}

/// Gas temperature [K] of a mass [kg] at a pressure [Pa] in a volume [m3].
#[inline]
pub fn gas_temperature<S: Scalar>(gas: &Gas, pressure: S, volume: S, mass: S) -> S {
    pressure * volume / (mass * gas.gas_constant)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expansion_of_a_shut_chamber_is_polytropic() {
        let alpha = Polytropic { inflow: 1.4, outflow: 1.0, volume: 1.2 };
        let state = ChamberState {
            pressure: 3e5,
            volume: 1e-3,
            volume_rate: 1e-4,
            inflow: 0.0,
            outflow: 0.0,
        };
        assert!((pressure_rate(&state, &alpha, 8.4e4) + 1.2 * 3e5 * 0.1_f64).abs() < 1e-9);
    }
}
