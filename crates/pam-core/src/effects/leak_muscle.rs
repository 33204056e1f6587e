//! `leak_muscle`: leakage of the chamber (muscle, fitting or hose) to ambient.
//!
//! Orifice flow from the chamber to ambient through the discharge area that corresponds to a sonic
//! conductance `C` (ISO 6358). Sealed and choked, the absolute pressure decays with the time constant
//! `V/(alpha_out C rho0 R T)`. Beater, *Pneumatic Drives* (2007).

use super::EffectInfo;
use crate::gas::orifice::Gas;
use crate::scalar::{constant, Scalar};

/// Table entry.
pub const INFO: EffectInfo =
    EffectInfo { id: "leak_muscle", block: "chamber", parameters: &[("conductance", "m3/(s Pa)")] };

/// Leaking mass flow [kg/s] out of a chamber at an absolute pressure [Pa].
#[inline]
pub fn mass_flow<S: Scalar>(gas: &Gas, conductance: S, pressure: S) -> S {
    gas.mass_flow(gas.area_of_conductance(conductance), pressure, constant(gas.ambient_pressure))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sealed_time_constant_is_the_iso_one() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let (conductance, volume, pressure) = (5e-12, 1e-4, 6e5);
        let rate = mass_flow(&gas, conductance, pressure) * 287.05 * 293.15 / volume;
        let tau = volume / (conductance * 1.185 * 287.05 * 293.15);
        assert!((pressure / rate / tau - 1.0).abs() < 1e-12);
        assert_eq!(mass_flow(&gas, conductance, 101_325.0), 0.0);
    }
}
