//! `leak_muscle`: leakage of the chamber (muscle, fitting or hose) to ambient.
//!
//! `orifice_and_laminar`: a hole leaks like an orifice, a porous wall or a long thin crack like a
//! laminar path; `s` is the share of the latter: `m_l = C rho0 sqrt(T0/T) [ (1-s) p
//! psi(pa/p)/psi(0) + s (p^2 - pa^2)/p_ref ]` with the sonic conductance `C` of ISO 6358 and
//! `p_ref` = 500 kPa absolute. Sealed, choked and with `s = 0` the absolute pressure decays with
//! the time constant `V/(alpha_out C rho0 R T)`. Beater, *Pneumatic Drives* (2007).
//!
//! `power`: `m_l = C rho0 sqrt(T0/T) p_ref (pg/pg_ref)^n` with the gauge pressures `pg` and
//! `pg_ref` of `p_ref`, at which it is what a choked orifice of that conductance leaks: a crack
//! that opens with pressure, `n` = 0.5 as turbulent and 1 as laminar flow through a stiff one, up
//! to 2. Below 1 kPa it is rounded to a slope. The power law of cracks: ASHRAE Handbook,
//! *Fundamentals*, "Ventilation and infiltration", where the power is 0.5 to 1; that it may be
//! larger where the crack opens is our own.

use super::{Effect, EffectInfo, EffectParameter, Extremes, Form, Port, Use};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::{constant, Scalar};

/// Conductance of a fitting, a hose or a bladder that still holds pressure [m3/(s Pa)]: up to 24
/// l/min at 3 bar; what lets out more is a way for air, and seen.
const USUAL: (f64, f64) = (1e-16, 1e-9);

const CONDUCTANCE: EffectParameter =
    EffectParameter::new("conductance", "m3/(s Pa)", 0.0, 1e-7, 5e-12)
        .starts(&[1e-11])
        .usually(USUAL.0, USUAL.1)
        .off(0.0);

const ORIFICE_AND_LAMINAR: Form = Form {
    name: "orifice_and_laminar",
    parameters: &[
        CONDUCTANCE,
        EffectParameter::new("laminar_share", "1", 0.0, 1.0, 0.0).starts(&[0.3]).role(Use::Choice),
    ],
    states: &[],
    integrates: false,
    ports: &[Port::Leak],
    make: made_by!(make),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "leak_muscle",
    block: "chamber",
    at: "chamber",
    source:
        "Beater, Pneumatic Drives (2007); ISO 6358; ASHRAE Handbook, Fundamentals, Ventilation and \
        infiltration, for the power law of cracks",
    forms: &[
        ORIFICE_AND_LAMINAR,
        Form {
            name: "power",
            parameters: &[
                CONDUCTANCE,
                EffectParameter::new("exponent", "1", 0.3, 3.0, 1.2)
                    .starts(&[1.0, 1.5])
                    .usually(0.5, 2.0),
            ],
            make: made_by!(power),
            ..ORIFICE_AND_LAMINAR
        },
    ],
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

/// Gauge pressure below which the flow of a crack is rounded to a slope [Pa].
const ROUNDED: f64 = 1e3;

/// A leak that grows with a power of the gauge pressure.
#[derive(Debug, Clone, Copy)]
struct Crack<S> {
    conductance: S,
    exponent: S,
}

fn power<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Crack { conductance: values[0], exponent: values[1] })
}

/// `x^n` for a pressure over that of the reference, odd, with a slope at zero.
fn powered<S: Scalar>(relative: S, rounded: f64, exponent: S) -> S {
    let square = relative * relative + rounded * rounded;
    relative * (square.ln() * (exponent - 1.0) * 0.5).exp()
}

impl<S: Scalar> Effect<S> for Crack<S> {
    fn leak(&self, gas: &Gas, pressure: S) -> S {
        let unit = REFERENCE_PRESSURE - gas.ambient_pressure;
        let relative = (pressure - gas.ambient_pressure) / unit;
        let area = gas.area_of_conductance(self.conductance);
        gas.choked_flow(area, constant(REFERENCE_PRESSURE))
            * powered(relative, ROUNDED / unit, self.exponent)
    }

    fn steepest(&self, gas: &Gas, most: &Extremes) -> f64 {
        let unit = REFERENCE_PRESSURE - gas.ambient_pressure;
        let area = gas.area_of_conductance(self.conductance.re());
        let exponent = self.exponent.re();
        let highest = ((most.pressure - most.ambient) / unit).max(1.0);
        let slope = (ROUNDED / unit).powf(exponent - 1.0).max(highest.powf(exponent - 1.0));
        gas.choked_flow(area, REFERENCE_PRESSURE) / unit * slope * exponent.max(1.0)
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

    #[test]
    fn a_crack_leaks_by_a_power_of_the_gauge_pressure() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        for exponent in [0.5, 1.0, 1.25, 2.0] {
            let crack = (INFO.form("power").unwrap().make.plain)(&[5e-12, exponent], &gas);
            let flow = |gauge: f64| crack.leak(&gas, 101_325.0 + gauge);
            let choked = 5e-12 * 1.185 * 5e5;
            assert!((flow(5e5 - 101_325.0) / choked - 1.0).abs() < 1e-4, "{exponent}");
            assert!((flow(4e5) / flow(1e5) / 4.0_f64.powf(exponent) - 1.0).abs() < 1e-4);
            assert_eq!(flow(0.0), 0.0);
            let most = Extremes {
                pressure: 9e5,
                ambient: 101_325.0,
                angles: (0.0, 0.0),
                contraction: 0.0,
                valves: 0,
                load: 0.0,
            };
            let slope = |gauge: f64| (flow(gauge + 1.0) - flow(gauge - 1.0)) / 2.0;
            let steepest = crack.steepest(&gas, &most);
            for gauge in [0.0, 500.0, 1e4, 7.9e5] {
                assert!(slope(gauge) <= 1.001 * steepest, "{exponent} {gauge}");
            }
        }
    }
}
