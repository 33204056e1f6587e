//! `ferraresi`: force balance of a cylinder whose wall keeps its thickness.
//!
//! Equation (physics reference, section 2, model 4; C. Ferraresi, W. Franco & A. Manuello Bertetto,
//! "Flexible pneumatic actuators: a comparison between the McKibben and the straight fibres
//! muscles", J. Robotics Mechatronics 13, 2001; Robinson 2014, (2.8)-(2.11)):
//!
//! ```text
//! F = P (3 L^2 - B^2)/(4 pi N^2) + s(eps_z) VB/L - s(eps_c) t0 L^2/(2 pi R N^2)
//! eps_z = L/L0 - 1     eps_c = R/R0 - 1     s(eps) = sum_k (m_k P + b_k) eps^k
//! ```

use super::kothera::Wall;
use crate::braid::{Braid, Shape};
use crate::scalar::{constant, Scalar};

/// Force [N] of the moduli [Pa] (or per pressure [m2] of their slopes), from k = 1.
pub fn elastic<S: Scalar>(moduli: &[f64], braid: &Braid, shape: &Shape<S>) -> S {
    let thickness = constant(braid.rest_thickness);
    let strain = (shape.radius - braid.rest_radius) / braid.rest_radius;
    Wall::new(braid, shape, thickness).stress(moduli, strain)
}
