//! `gaylord`: the gas alone, in a braid around a wall of no thickness.
//!
//! Equation (physics reference, section 2, model 1; R. H. Gaylord, US patent 2 844 126, 1958;
//! Robinson 2014, (3.19)):
//!
//! ```text
//! F = P (3 L^2 - B^2)/(4 pi N^2)  =  -P dV/dL  of  V = pi R^2 L,  R = sqrt(B^2 - L^2)/(2 pi N)
//! ```

use std::f64::consts::PI;

use crate::braid::{Braid, Shape};
use crate::scalar::Scalar;

/// Force per gauge pressure [m2].
pub fn gas<S: Scalar>(braid: &Braid, shape: &Shape<S>) -> S {
    let fibre = braid.fibre_length;
    (shape.length * shape.length * 3.0 - fibre * fibre) / (4.0 * PI * braid.turns * braid.turns)
}
