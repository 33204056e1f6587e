//! `mooney_rivlin`: the gas of [`super::gaylord`] against a hyperelastic bladder of two constants.
//!
//! Equations (physics reference, section 2, model 3; G. K. Klute & B. Hannaford, "Accounting for
//! elastic energy storage in McKibben artificial muscle actuators", J. Dyn. Sys. Meas. Control 122,
//! 2000; Robinson 2014, (3.20), (3.21)):
//!
//! ```text
//! F = P (3 L^2 - B^2)/(4 pi N^2) + VB dW/dL            W = C10 (I1 - 3) + C01 (I2 - 3)
//! I1 = l1^2 + l2^2 + l3^2
//! I2 = 1/l1^2 + 1/l2^2 + 1/l3^2
//! l1 = L/L0
//! l2 = R/R0
//! l3 = 1/(l1 l2)
//! dW/dL = W_1/L0 + W_2/R0 dR/dL                         dR/dL = -L/(4 pi^2 N^2 R)
//! ```
//!
//! The printed sign of the last term is minus: the bladder would then help the gas to shorten the
//! muscle. Virtual work, `-F dL = P dV - VB dW`, asks for plus with F positive pulling, as in the
//! models of the force balance.
//!
//! The braid's kinematics give `dR/dL` on every geometry, as in the hoop term of the force balance:
//! on the cylinder the force is exactly the slope of the stored energy, and nowhere does it jump
//! where the elliptic ends have a kink.

use std::f64::consts::PI;

use crate::braid::{Braid, Shape};
use crate::scalar::{constant, Scalar};

/// Force [N] of the constants `[C10, C01]` [Pa].
pub fn elastic<S: Scalar>(constants: &[f64], braid: &Braid, shape: &Shape<S>) -> S {
    let [c10, c01] = [0, 1].map(|k| constants.get(k).copied().unwrap_or(0.0));
    let axial = shape.length / braid.rest_length;
    let hoop = shape.radius / braid.rest_radius;
    let (axial_squared, hoop_squared) = (axial * axial, hoop * hoop);
    let radial_squared = (axial_squared * hoop_squared).recip();
    // Half of dI1/dl and dI2/dl, times l.
    let first = |squared: S| squared - radial_squared;
    let second = |squared: S| constant::<S>(1.0) / radial_squared - constant::<S>(1.0) / squared;
    let slope =
        |stretch: S, squared: S| (first(squared) * c10 + second(squared) * c01) * 2.0 / stretch;
    let narrowing = -shape.length / (shape.radius * (4.0 * PI * PI * braid.turns * braid.turns));
    let energy_slope = slope(axial, axial_squared) / braid.rest_length
        + slope(hoop, hoop_squared) * narrowing / braid.rest_radius;
    energy_slope * braid.bladder_volume
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::muscle::tests::shoulder;

    #[test]
    fn the_bladder_takes_up_the_energy_that_the_muscle_does_not_give() {
        let mut spec = shoulder();
        spec.geometry = Some("cylinder".into());
        let geometry = spec.shape().unwrap();
        let braid = geometry.braid();
        let (c10, c01) = (2.0e5, 0.7e5);
        let energy = |e: f64| {
            let shape = geometry.solve(e).unwrap();
            let (a, b) = (shape.length / braid.rest_length, shape.radius / braid.rest_radius);
            let [a, b, c] = [a * a, b * b, 1.0 / (a * a * b * b)];
            braid.bladder_volume
                * (c10 * (a + b + c - 3.0) + c01 * (1.0 / a + 1.0 / b + 1.0 / c - 3.0))
        };
        for e in [0.01, 0.1, 0.2, 0.3] {
            let h = 1e-5;
            let slope = (energy(e - h) - energy(e + h)) / (2.0 * h * braid.rest_length);
            let force = elastic(&[c10, c01], braid, &geometry.solve(e).unwrap());
            assert!(force < 0.0, "a contracted bladder pushes back");
            assert!((force - slope).abs() < 1e-7 * slope.abs(), "{e}: {force} {slope}");
        }
        assert!(elastic(&[c10, c01], braid, &geometry.solve(0.0).unwrap()).abs() < 1e-9);
    }
}
