//! `supply_leak`: leakage of a tank, its fittings or the supply line to the ambient.
//!
//! `orifice`: `m_l = C rho0 sqrt(T0/T) p psi(pa/p)/psi(0)`, out of the supply at all times, with the sonic
//! conductance `C` of ISO 6358. A tank with every valve shut loses its absolute pressure with the
//! time constant `V/(C rho0 R T)`; behind a regulator the leak shows as droop. P. Beater,
//! *Pneumatic Drives* (2007).
//!
//! `laminar`: `m_l = C rho0 sqrt(T0/T) (p^2 - pa^2)/p_ref` with `p_ref` = 500 kPa absolute, as of
//! [`super::leak_muscle`]: a long thin crack or a seal. Beater (2007).

use super::leak_muscle::mass_flow as leaking;
use super::leak_muscle::REFERENCE_PRESSURE;
use super::{Effect, EffectInfo, EffectParameter, Extremes, Form, Port};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

const ORIFICE: Form = Form {
    name: "orifice",
    parameters: &[EffectParameter::new("conductance", "m3/(s Pa)", 0.0, 1e-6, 1e-11)
        .starts(&[1e-11, 1e-9])
        .off(0.0)],
    states: &[],
    integrates: false,
    ports: &[Port::Leak],
    make: made_by!(make),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "supply_leak",
    block: "supply",
    at: "supply",
    order: 2,
    source: "Beater, Pneumatic Drives (2007); ISO 6358",
    forms: &[ORIFICE, Form { name: "laminar", make: made_by!(laminar), ..ORIFICE }],
    ..EffectInfo::USUAL
};

/// Leaking mass flow [kg/s] out of a supply at an absolute pressure [Pa].
#[inline]
pub fn mass_flow<S: Scalar>(gas: &Gas, conductance: S, pressure: S) -> S {
    gas.mass_flow(gas.area_of_conductance(conductance), pressure, constant(gas.ambient_pressure))
}

/// A leak of a supply.
#[derive(Debug, Clone, Copy)]
struct SupplyLeak<S> {
    conductance: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(SupplyLeak { conductance: values[0] })
}

impl<S: Scalar> Effect<S> for SupplyLeak<S> {
    fn leak(&self, gas: &Gas, pressure: S) -> S {
        mass_flow(gas, self.conductance, pressure)
    }
}

/// A laminar leak of a supply.
#[derive(Debug, Clone, Copy)]
struct LaminarLeak<S> {
    conductance: S,
}

fn laminar<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(LaminarLeak { conductance: values[0] })
}

impl<S: Scalar> Effect<S> for LaminarLeak<S> {
    fn leak(&self, gas: &Gas, pressure: S) -> S {
        leaking(gas, self.conductance, constant(1.0), pressure)
    }

    fn steepest(&self, gas: &Gas, most: &Extremes) -> f64 {
        let area = gas.area_of_conductance(self.conductance.re());
        2.0 * gas.choked_flow(area, most.pressure) / REFERENCE_PRESSURE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_standard_litre_a_minute_empties_a_tank_as_known() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        // 1 l/min of free air at 14 bar absolute: 111 Pa/s out of 15 l
        let rate = mass_flow(&gas, 1e-3 / 60.0 / 14e5, 14e5) * 287.05 * 293.15 / 0.015;
        assert!((rate - 111.0_f64).abs() < 1.5, "{rate}");
        assert_eq!(mass_flow(&gas, 0.0, 14e5), 0.0);
    }

    #[test]
    fn a_laminar_one_grows_with_the_square_of_the_pressure() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let leak = (INFO.form("laminar").unwrap().make.plain)(&[1e-11], &gas);
        let expected = 1e-11 * 1.185 * (14e5 * 14e5 - 101_325.0 * 101_325.0) / 5e5;
        assert!((leak.leak(&gas, 14e5) / expected - 1.0).abs() < 1e-12);
        assert!(leak.leak(&gas, 101_325.0).abs() < 1e-20);
    }
}
