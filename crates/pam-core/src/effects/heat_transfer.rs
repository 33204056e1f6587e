//! `heat_transfer`: gas temperature from an energy balance with heat exchange at the wall.
//!
//! `dp/dt = (kappa R/V)(m_in Ts - m_out T) - kappa p V'/V + ((kappa-1)/V) h A (Tw - T)` with `T = p V/(m R)`,
//! `dm/dt = m_in - m_out` and `h = h0 sqrt(p T/(p0 T0))`, in place of the constant polytropic coefficients. The wall stays
//! at the rest temperature. The gas mass is the state, so that the temperature cannot drift. Wall area: the cylinder
//! of each muscle's volume and length; the cube of the chamber's volume when it is rigid.
//! Only a `share` of the gas may follow the balance, while the rest keeps the coefficients: a nominal model whose coefficients are
//! nearly right is left by a little, not by all. The mass then is the one that the gas temperature stands for, and not what flowed.
//! A recording may begin just after a fill: the gas is then warmer than the wall by an initial rise.
//! Carneiro & de Almeida (2006); Al-Ibrahim & Otis (1992).

use super::{EffectInfo, EffectParameter};
use crate::blocks::chamber::ChamberState;
use crate::blocks::gas::Gas;
use crate::scalar::Scalar;

/// Table entry.
pub const INFO: EffectInfo = EffectInfo {
    id: "heat_transfer",
    block: "chamber",
    at: "chamber",
    parameters: &[
        EffectParameter::new("heat_transfer_coefficient", "W/(m2 K)"),
        EffectParameter::new("initial_temperature_rise", "K"),
        EffectParameter::new("share", "1").within(0.0, 1.0),
    ],
};

const REFERENCE_PRESSURE: f64 = 1e5;

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
pub fn temperature<S: Scalar>(gas: &Gas, pressure: S, volume: S, mass: S) -> S {
    pressure * volume / (mass * gas.gas_constant)
}

/// Rate of the absolute pressure [Pa/s].
#[inline]
pub fn pressure_rate<S: Scalar>(
    gas: &Gas,
    c: &ChamberState<S>,
    temperature: S,
    area: S,
    coefficient: S,
) -> S {
    let (kappa, r) = (gas.gamma, gas.gas_constant);
    let relative = c.pressure * temperature / (REFERENCE_PRESSURE * gas.temperature);
    let wall = coefficient * relative.sqrt() * area * (-temperature + gas.temperature);
    let flow = (c.inflow * gas.temperature - c.outflow * temperature) * (kappa * r);
    (flow - c.pressure * c.volume_rate * kappa + wall * (kappa - 1.0)) / c.volume
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_adiabatic_and_isothermal() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let state =
            ChamberState { pressure: 4e5, volume: 1e-3, volume_rate: 1e-4, inflow: 0.0, outflow: 0.0 };
        let adiabatic = pressure_rate(&gas, &state, 293.15, 0.05, 0.0);
        assert!((adiabatic + 1.4 * 4e5 * 0.1_f64).abs() < 1e-9);
        let mass = 4e5 * 1e-3 / (287.05 * 293.15);
        assert!((temperature(&gas, 4e5, 1e-3, mass) - 293.15_f64).abs() < 1e-10);
        assert!(pressure_rate(&gas, &state, 330.0, 0.05, 50.0) < adiabatic, "hot gas cools at the wall");
    }
}
