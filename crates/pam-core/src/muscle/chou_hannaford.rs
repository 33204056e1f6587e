//! `chou_hannaford`: the gas in a braid around a wall of constant thickness.
//!
//! Equation (physics reference, section 2, model 2; C.-P. Chou & B. Hannaford, "Measurement and
//! modeling of McKibben pneumatic artificial muscles", IEEE Trans. Robotics and Automation 12,
//! 1996): virtual work on the bore of a cylinder whose wall keeps its thickness `t0`, with the
//! braid's kinematics `dR/dL = -L/(4 pi^2 N^2 R)`:
//!
//! ```text
//! F = -P d/dL (pi L (R - t0)^2)
//!     = P [(3 L^2 - B^2)/(4 pi N^2) + 2 pi R t0 - pi t0^2 - L^2 t0/(2 pi N^2 R)]
//! ```
//!
//! The paper's form, `pi D0^2 P/4 (3 cos^2 - 1) + pi P [D0 t (2 sin - 1/sin) - t^2]` in the angle
//! from the axis, is the same with `D0 = B/(pi N)`. It is [`super::gaylord`] for `t0 = 0`.

use std::f64::consts::PI;

use super::gaylord;
use crate::braid::{Braid, Shape};
use crate::scalar::Scalar;

/// Force per gauge pressure [m2].
pub fn gas<S: Scalar>(braid: &Braid, shape: &Shape<S>) -> S {
    let (wall, turns) = (braid.rest_thickness, braid.turns * braid.turns);
    let narrowing = shape.length * shape.length * wall / (shape.radius * (2.0 * PI * turns));
    gaylord::gas(braid, shape) + shape.radius * (2.0 * PI * wall) - PI * wall * wall - narrowing
}
