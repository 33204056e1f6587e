//! `leak_muscle`: leakage of the chamber (muscle, fitting or hose) to ambient.
//!
//! A hole leaks like an orifice, a porous wall or a long thin crack like a laminar path; `s` is the
//! share of the latter: `m_l = C rho0 sqrt(T0/T) [ (1-s) p psi(pa/p)/psi(0) + s (p^2 - pa^2)/p_ref
//! ]` with the sonic conductance `C` of ISO 6358 and `p_ref` = 500 kPa absolute. Sealed, choked and
//! with `s = 0` the absolute pressure decays with the time constant `V/(alpha_out C rho0 R T)`.
//! Beater, *Pneumatic Drives* (2007).

use super::{Effect, EffectInfo, EffectParameter, Extremes, Form, Port, Use};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "leak_muscle",
    block: "chamber",
    at: "chamber",
    source: "Beater, Pneumatic Drives (2007); ISO 6358",
    forms: &[Form {
        name: "orifice_and_laminar",
        parameters: &[
            EffectParameter::new("conductance", "m3/(s Pa)", 0.0, 1e-7, 5e-12)
                .starts(&[1e-11])
                .off(0.0)
                .same_everywhere(),
            EffectParameter::new("laminar_share", "1", 0.0, 1.0, 0.0)
                .starts(&[0.3])
                .role(Use::Choice),
        ],
        states: &[],
        integrates: false,
        ports: &[Port::Leak],
        make: made_by!(make),
    }],
    ..EffectInfo::USUAL
};

/// Absolute pressure at which a laminar path of the same conductance leaks as much as a choked
/// orifice, up to the counter pressure [Pa].
pub const REFERENCE_PRESSURE: f64 = 5e5;

/// Leaking mass flow [kg/s] out of a chamber at an absolute pressure [Pa].
#[inline]
pub fn mass_flow<S: Scalar>(gas: &Gas, conductance: S, laminar_share: S, pressure: S) -> S {
    let ambient = gas.ambient_pressure;
    let area = gas.area_of_conductance(conductance);
    let orifice = gas.mass_flow(area, pressure, constant(ambient));
    let choked = gas.choked_flow(area, pressure);
    let laminar =
        choked * (pressure - constant::<S>(ambient * ambient) / pressure) / REFERENCE_PRESSURE;
    orifice + laminar_share * (laminar - orifice)
}

/// A leak of a chamber.
#[derive(Debug, Clone, Copy)]
struct Leak<S> {
    conductance: S,
    laminar_share: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Leak { conductance: values[0], laminar_share: values[1] })
}

impl<S: Scalar> Effect<S> for Leak<S> {
    fn leak(&self, gas: &Gas, pressure: S) -> S {
        mass_flow(gas, self.conductance, self.laminar_share, pressure)
    }

    fn steepest(&self, gas: &Gas, most: &Extremes) -> f64 {
        let (conductance, share) = (self.conductance.re(), self.laminar_share.re());
        let area = gas.area_of_conductance(conductance);
        let laminar = 2.0 * gas.choked_flow(area, most.pressure) / REFERENCE_PRESSURE;
        (1.0 - share) * gas.steepest(area) + share * laminar
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sealed_time_constant_is_the_iso_one() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let (conductance, volume, pressure) = (5e-12, 1e-4, 6e5);
        let rate = mass_flow(&gas, conductance, 0.0, pressure) * 287.05 * 293.15 / volume;
        let tau = volume / (conductance * 1.185 * 287.05 * 293.15);
        assert!((pressure / rate / tau - 1.0_f64).abs() < 1e-12);
        assert_eq!(mass_flow(&gas, conductance, 0.0, 101_325.0), 0.0);
        assert!(mass_flow(&gas, conductance, 1.0, 101_325.0).abs() < 1e-20);
        let laminar = mass_flow(&gas, conductance, 1.0, 5e5);
        let expected = conductance * 1.185 * (5e5 * 5e5 - 101_325.0 * 101_325.0) / 5e5;
        assert!((laminar / expected - 1.0_f64).abs() < 1e-12);
    }
}
