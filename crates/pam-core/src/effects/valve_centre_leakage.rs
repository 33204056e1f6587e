//! `valve_centre_leakage`: flow through the clearance between spool and sleeve around the null.
//!
//! `exponential`: `C_l(x) = C_0 exp(-|x|/x_l)` from the supply to the chamber and from the chamber
//! to the ambient at once: with the valve shut the pressure goes to where both are the same, from
//! either side. M. Belgharbi, S. Sesmat, S. Scavarda & D. Thomasset, "Analytical model of the flow
//! stage of a pneumatic servo-distributor for simulation and nonlinear control", 6th Scandinavian
//! Int. Conf. Fluid Power, 1999 (that it leaks around the null); that it fades as an exponential is
//! our own.
//!
//! `hyperbolic`: `C_l(x) = C_0/(1 + |x|/x_l)`, a gap that grows as long as the spool has moved, in
//! laminar flow. B. Eryilmaz & B. H. Wilson, "Combining leakage and orifice flows in a hydraulic
//! servovalve model", ASME J. Dyn. Syst. Meas. Control 122, 2000, and "Unified modeling and
//! analysis of a proportional valve", J. Franklin Institute 343, 2006 (of oil, in turbulent flow).

use super::{Effect, EffectInfo, EffectParameter, Extremes, Form, Port};
use crate::blocks::gas::Gas;
use crate::made_by;
use crate::scalar::Scalar;

const EXPONENTIAL: Form = Form {
    name: "exponential",
    parameters: &[
        EffectParameter::new("conductance", "m3/(s Pa)", 0.0, 1e-6, 3e-11)
            .starts(&[3e-11, 5e-10])
            .off(0.0),
        EffectParameter::new("opening", "1", 0.0001, 1000.0, 0.02).starts(&[0.02]),
    ],
    states: &[],
    integrates: false,
    ports: &[Port::Clearance],
    make: made_by!(make),
};

/// What it is.
pub const INFO: EffectInfo = EffectInfo {
    id: "valve_centre_leakage",
    block: "valve",
    at: "valve",
    order: 1,
    source:
        "Belgharbi, Sesmat, Scavarda & Thomasset (1999); Eryilmaz & Wilson (2000, 2006) for the \
        form hyperbolic",
    forms: &[EXPONENTIAL, Form { name: "hyperbolic", make: made_by!(hyperbolic), ..EXPONENTIAL }],
    ..EffectInfo::USUAL
};

/// Discharge area [m2] of either path at a normalised spool position; `opening` is that over which
/// it fades.
#[inline]
pub fn area<S: Scalar>(gas: &Gas, conductance: S, opening: S, x: S) -> S {
    gas.area_of_conductance(conductance) * (-x.abs() / opening).exp()
}

/// Clearance around the null of a spool.
#[derive(Debug, Clone, Copy)]
struct Clearance<S> {
    conductance: S,
    opening: S,
}

fn make<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Clearance { conductance: values[0], opening: values[1] })
}

impl<S: Scalar> Effect<S> for Clearance<S> {
    fn clearance(&self, gas: &Gas, position: S) -> S {
        area(gas, self.conductance, self.opening, position)
    }

    fn steepest(&self, gas: &Gas, _most: &Extremes) -> f64 {
        gas.steepest(gas.area_of_conductance(self.conductance.re()))
    }
}

/// Clearance that becomes longer with the opening.
#[derive(Debug, Clone, Copy)]
struct Lengthening<S>(Clearance<S>);

fn hyperbolic<S: Scalar>(values: &[S], _gas: &Gas) -> Box<dyn Effect<S>> {
    Box::new(Lengthening(Clearance { conductance: values[0], opening: values[1] }))
}

impl<S: Scalar> Effect<S> for Lengthening<S> {
    fn clearance(&self, gas: &Gas, position: S) -> S {
        let Clearance { conductance, opening } = self.0;
        gas.area_of_conductance(conductance) / (position.abs() / opening + 1.0)
    }

    fn steepest(&self, gas: &Gas, most: &Extremes) -> f64 {
        self.0.steepest(gas, most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_fades_with_the_opening() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let shut = area(&gas, 5e-11, 0.02, 0.0);
        assert_eq!(shut, gas.area_of_conductance(5e-11));
        assert!((area(&gas, 5e-11, 0.02, -0.02) / shut - (-1.0_f64).exp()).abs() < 1e-12);
        assert!(area(&gas, 5e-11, 0.02, 1.0) < 1e-15 * shut);
        assert_eq!(area(&gas, 0.0, 0.02, 0.0), 0.0);
    }

    #[test]
    fn a_gap_that_lengthens_fades_slowly() {
        let gas = Gas::new(101_325.0, 293.15, 287.05, 1.4);
        let gap = (INFO.form("hyperbolic").unwrap().make.plain)(&[5e-11, 0.02], &gas);
        let shut = gap.clearance(&gas, 0.0);
        assert_eq!(shut, gas.area_of_conductance(5e-11));
        assert!((gap.clearance(&gas, -0.02) / shut - 0.5).abs() < 1e-12);
        assert!((gap.clearance(&gas, 0.18) / shut - 0.1).abs() < 1e-12);
    }
}
