//! Pressure of a chamber whose volume may change.
//!
//! `dP/dt = R T/V (alpha_in mdot_in - alpha_out mdot_out) - alpha P (dV/dt)/V`, dissertation
//! (3.17), (4.3), and (6.4) with its sign corrected; polytropic coefficients after Richer &
//! Hurmuzlu (2000). Such coefficients are no energy balance: what they make of a flow is more or
//! less than the mass that flowed.
//!
//! With an energy balance pressure and mass are the states: `dm/dt = mdot_in - mdot_out`,
//! `dp/dt = (kappa R/V)(sum mdot_in T_in - mdot_out T) - kappa p V'/V + ((kappa - 1)/V) Q` with
//! `T = p V/(m R)` and the heat from a wall that stays at the rest temperature,
//! `Q = h0 sqrt(p T/(p0 T0)) A (T0 - T)`. Carneiro & de Almeida (2006); Al-Ibrahim & Otis (1992).

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

/// Pressure at which the heat transfer coefficient is that of its parameter [Pa].
const REFERENCE_PRESSURE: f64 = 1e5;

/// Heat from the wall to a gas at a pressure and a temperature [W], through an area [m2] with a
/// coefficient [W/(m2 K)] that holds at 1 bar and rest temperature.
#[inline]
pub fn wall_heat<S: Scalar>(gas: &Gas, pressure: S, temperature: S, area: S, coefficient: S) -> S {
    let relative = pressure * temperature / (REFERENCE_PRESSURE * gas.temperature);
    coefficient * relative.sqrt() * area * (-temperature + gas.temperature)
}

/// Rate of the absolute pressure by the energy balance [Pa/s]: what flows in carries
/// `sum mdot T` [kg K/s], what flows out has the temperature of the chamber [K], the wall gives
/// heat [W].
#[inline]
pub fn energy_rate<S: Scalar>(
    gas: &Gas,
    c: &ChamberState<S>,
    carried: S,
    temperature: S,
    heat: S,
) -> S {
    let (kappa, r) = (gas.gamma, gas.gas_constant);
    let flow = (carried - c.outflow * temperature) * (kappa * r);
    (flow - c.pressure * c.volume_rate * kappa + heat * (kappa - 1.0)) / c.volume
}

/// Rate at which a gas takes the temperature of its wall [1/s] with the least of it: at ambient
/// pressure.
pub fn wall_rate(gas: &Gas, coefficient: f64, volume: f64, wall: f64) -> f64 {
    (gas.gamma - 1.0) * coefficient * wall * gas.temperature / (gas.ambient_pressure * volume)
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
