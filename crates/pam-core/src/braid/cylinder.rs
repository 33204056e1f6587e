//! The cylindrical muscle: one radius over the whole length.
//!
//! Equations (physics reference, section 1; Robinson 2014, ch. 2):
//!
//! ```text
//! R = sqrt(B^2 - L^2) / (2 pi N)          B fibre length, N turns of one fibre
//! t = R - sqrt(R^2 - VB / (pi L))         incompressible bladder of volume VB
//! V = pi L (R - t)^2
//! ```
//!
//! The radius keeps the same floor in extension as the elliptic geometry (see the parent module).

use std::f64::consts::PI;

use super::dimensions::Braid;
use crate::scalar::Scalar;

/// Outer radius [m] that the braid allows at length `length` [m], shorter than the fibre.
pub fn radius<S: Scalar>(braid: &Braid, length: S) -> S {
    let fibre = braid.fibre_length;
    ((-length + fibre) * (length + fibre)).sqrt() / (2.0 * PI * braid.turns)
}

/// Integral of the outer profile over the length and of its square [m2, m3].
pub fn integrals<S: Scalar>(length: S, radius: S) -> (S, S) {
    (length * radius, length * radius * radius)
}
