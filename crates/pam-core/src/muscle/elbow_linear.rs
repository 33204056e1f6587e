//! `elbow_linear`: one modulus of the bladder, and a branch of its own for each direction of
//! motion.
//!
//! Equations (physics reference, section 2, model 7; Robinson 2014, (4.4)-(4.7)), while
//! contracting:
//!
//! ```text
//! F  = P (3 L^2 - B^2)/(4 pi N^2) + P (VB/L - t L^2/(2 pi R N^2)) + FL + FT
//! FL = E_R VB (1/L0 - 1/L)                FT = E_R L (t L - t0 L0)/(2 pi R N^2)
//! ```
//!
//! and while lengthening, with empirical factors (0.3, 0.8, 0.8):
//!
//! ```text
//! F  = P (3 L^2 - B^2)/(4 pi N^2) + f0 P (VB/L - t L^2/(2 pi R N^2)) + f1 FL + f2 FT
//! ```

use std::f64::consts::PI;

use super::gaylord;
use super::kothera::Wall;
use crate::braid::{Braid, Shape};
use crate::scalar::{constant, Scalar};

/// Factors on the wall's pressure, on `FL` and on `FT`.
pub type Factors = [f64; 3];

/// The branch of contraction.
pub const CONTRACTION: Factors = [1.0; 3];

/// Force per gauge pressure [m2].
pub fn gas<S: Scalar>(braid: &Braid, shape: &Shape<S>, factors: Factors) -> S {
    let wall = Wall::new(braid, shape, shape.thickness);
    gaylord::gas(braid, shape) + (wall.axial - wall.hoop) * factors[0]
}

/// Force [N] of the modulus `[E_R]` [Pa].
pub fn elastic<S: Scalar>(modulus: &[f64], braid: &Braid, shape: &Shape<S>, factors: Factors) -> S {
    let modulus = modulus.first().copied().unwrap_or(0.0);
    let one = constant::<S>(1.0);
    let axial = (-one / shape.length + 1.0 / braid.rest_length) * braid.bladder_volume;
    let grown = shape.thickness * shape.length - braid.rest_thickness * braid.rest_length;
    let hoop = shape.length * grown / (shape.radius * (2.0 * PI * braid.turns * braid.turns));
    (axial * factors[1] + hoop * factors[2]) * modulus
}
