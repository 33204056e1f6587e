//! `kothera`: force balance of a cylinder whose wall becomes thinner as it expands.
//!
//! Equation (physics reference, section 2, model 5; C. S. Kothera, M. Jangid, J. Sirohi & N. M.
//! Wereley, "Experimental characterization and static modeling of McKibben actuators", J. Mech.
//! Des. 131, 2009; Robinson 2014, (2.13)-(2.16)):
//!
//! ```text
//! F = P (3 L^2 - B^2)/(4 pi N^2) + P (VB/L - t L^2/(2 pi R N^2)) + s(eps_z) VB/L
//!     - s(eps_c) t L^2/(2 pi R N^2)
//! eps_z = L/L0 - 1     eps_c = (R - t/2)/(R0 - t0/2) - 1     s(eps) = sum_k (m_k P + b_k) eps^k
//! ```

use std::f64::consts::PI;

use super::gaylord;
use crate::braid::{Braid, Shape};
use crate::scalar::{constant, Scalar};

/// What stresses in the wall act on.
#[derive(Debug, Clone, Copy)]
pub struct Wall<S> {
    /// Section of the wall that an axial stress pulls on, `VB/L` [m2].
    pub axial: S,
    /// Section on which a hoop stress pushes through the braid, `t L^2/(2 pi R N^2)` [m2].
    pub hoop: S,
    eps_z: S,
}

impl<S: Scalar> Wall<S> {
    /// The wall of a solved shape, with the given thickness [m].
    pub fn new(braid: &Braid, shape: &Shape<S>, thickness: S) -> Self {
        let squared = shape.length * shape.length;
        Self {
            axial: constant::<S>(braid.bladder_volume) / shape.length,
            hoop: thickness * squared / (shape.radius * (2.0 * PI * braid.turns * braid.turns)),
            eps_z: (shape.length - braid.rest_length) / braid.rest_length,
        }
    }

    /// Force of the polynomial stress of some moduli, with the hoop strain `eps_c`.
    pub fn stress(&self, moduli: &[f64], eps_c: S) -> S {
        polynomial(moduli, self.eps_z) * self.axial - polynomial(moduli, eps_c) * self.hoop
    }
}

/// Force per gauge pressure [m2].
pub fn gas<S: Scalar>(braid: &Braid, shape: &Shape<S>) -> S {
    let wall = Wall::new(braid, shape, shape.thickness);
    gaylord::gas(braid, shape) + wall.axial - wall.hoop
}

/// Force [N] of the moduli [Pa] (or per pressure [m2] of their slopes), from k = 1.
pub fn elastic<S: Scalar>(moduli: &[f64], braid: &Braid, shape: &Shape<S>) -> S {
    Wall::new(braid, shape, shape.thickness).stress(moduli, shape.eps_c)
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
