//! The Robinson force model: pressure on the braid plus a hyperelastic bladder.
//!
//! Equations (physics reference, section 2, models 1, 5 and 6; Robinson 2014, ch. 2, corrected):
//!
//! ```text
//! F = P (3 L^2 - B^2)/(4 pi N^2) + P G + s(eps_z) VB/L - s(eps_c) t L^2/(2 pi R N^2)
//! G = VB/L - t L^2/(2 pi R N^2)         (the pressure inside the wall, Kothera's term)
//! s(eps) = sum_k E_k eps^k              E_k = scale (m_k P + b_k),  k = 1 .. M
//! eps_z = L/L0 - 1                      eps_c = (R - t/2)/(R0 - t0/2) - 1
//! ```
//!
//! `P` is the gauge pressure, `F` positive pulls. The force is linear in `P` and in the scale:
//! `F = P a_gas + scale (P a_elastic + b_elastic)`, the three coefficients functions of length.

use std::f64::consts::PI;

use crate::geometry::{Braid, Shape};
use crate::scalar::{constant, Scalar};

/// Coefficients of the force of one muscle at one length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients<S = f64> {
    /// Force per gauge pressure of the inextensible, massless braid and the wall [m2].
    pub a_gas: S,
    /// Force per gauge pressure of the pressure-dependent moduli [m2].
    pub a_elastic: S,
    /// Force of the constant moduli [N].
    pub b_elastic: S,
}

impl<S: Scalar> Coefficients<S> {
    /// The coefficients at a solved shape; `slope` is `m_k` [1], `offset` is `b_k` [Pa], from k = 1.
    pub fn new(braid: &Braid, slope: &[f64], offset: &[f64], shape: &Shape<S>) -> Self {
        let (length, squared) = (shape.length, shape.length * shape.length);
        let turns = braid.turns * braid.turns;
        let axial = constant::<S>(braid.bladder_volume) / length;
        let hoop = shape.thickness * squared / (shape.radius * (2.0 * PI * turns));
        let eps_z = (length - braid.rest_length) / braid.rest_length;
        let stress =
            |modulus: &[f64]| polynomial(modulus, eps_z) * axial - polynomial(modulus, shape.eps_c) * hoop;
        let gaylord = (squared * 3.0 - braid.fibre_length * braid.fibre_length) / (4.0 * PI * turns);
        Self { a_gas: gaylord + axial - hoop, a_elastic: stress(slope), b_elastic: stress(offset) }
    }

    /// Force [N] at gauge pressure `pressure` [Pa].
    pub fn force(&self, pressure: S, modulus_scale: S) -> S {
        pressure * self.a_gas + modulus_scale * (pressure * self.a_elastic + self.b_elastic)
    }
}

/// `sum_k coefficients[k-1] x^k`, k from 1.
fn polynomial<S: Scalar>(coefficients: &[f64], x: S) -> S {
    coefficients.iter().rev().fold(constant(0.0), |sum: S, c| (sum + *c) * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomial_starts_at_first_order() {
        assert_eq!(polynomial(&[2.0, 3.0], 2.0), 16.0);
        assert_eq!(polynomial(&[2.0, 3.0], 0.0), 0.0);
        assert_eq!(polynomial(&[], 1.0), 0.0);
    }
}
