//! The muscle with elliptic ends: a cylindrical middle that meets the fittings by toroidal ends.
//!
//! Equations (physics reference, section 1; Robinson 2014, ch. 2, corrected): signed minor
//! half-axis `a` (positive in contraction), axis ratio `k = b/|a|`, centre offset `c`; the ellipse
//! meets the fitting at the polar angle 60 deg, that is at the parametric angle
//! `v1 = atan(sqrt(3)/k)`:
//!
//! ```text
//! k = k0 - k_con e (e >= 0),  k0 - k_ext e (e < 0)       q = k / sqrt(k^2 + 3) = cos v1
//! a = (R - R0)/(1 - q)    b = k |a|    c = R - a         b' = sqrt(3) q |a| = b sin v1
//! f(z) = c + a sqrt(1 - ((z - b')/b)^2)  (z < b')        f(z) = R  (b' <= z <= L - b')
//! w = 2 pi N b' / (L v1)                                 (v1 = pi/3 for `elliptic_published`)
//! s = integral_0^v1 sqrt((a cos v + c)^2 w^2 + a^2 sin^2 v + b^2 cos^2 v) dv
//! B_est(R) = (L - 2 b')/L sqrt(L^2 + (2 pi R N)^2) + 2 s
//! ```
//!
//! With `z = b' - b sin v` every integral of the profile is one of powers of `cos v`:
//!
//! ```text
//! integral f   dz = (L - 2b') R   + 2 b (c sin v1 + a (v1 + sin v1 cos v1)/2)
//! integral f^2 dz = (L - 2b') R^2
//!     + 2 b (c^2 sin v1 + a c (v1 + sin v1 cos v1) + a^2 (sin v1 - sin^3 v1/3))
//! ```

use std::f64::consts::PI;

use super::dimensions::{Braid, EndRatio};
use super::numeric::GaussLegendre;
use crate::scalar::{constant, Scalar};

/// Quadrature order of the fibre arc: below 1e-14 relative for every axis ratio above 0.3.
pub const ARC_NODES: usize = 24;

const SQRT_3: f64 = 1.732_050_807_568_877_2;

/// Over which angle the fibre's arc on an end is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arc {
    /// The parametric angle of the fitting, `v1 = atan(sqrt(3)/k)`.
    Parametric,
    /// As printed in (2.27) and (2.28), `pi/3`: the polar angle in the place of the parametric one.
    Published,
}

/// What the contraction ratio alone fixes about the ends.
#[derive(Debug, Clone, Copy)]
pub struct Ends<S> {
    /// Length of the muscle [m].
    pub length: S,
    /// Axis ratio `k = b/|a|`.
    pub ratio: S,
    /// `cos v1`, the `q` of the equations.
    pub cos_end: S,
    /// `sin v1`.
    pub sin_end: S,
    /// Parametric angle `v1` of the fitting [rad].
    pub angle: S,
    /// Parametric angle over which the fibre's arc is taken: `v1`, or as printed `pi/3` [rad].
    pub arc_angle: S,
    /// +1 in contraction, -1 in extension: the sign of `a`.
    pub sign: f64,
    cos: [S; ARC_NODES],
    sin: [S; ARC_NODES],
}

/// The ends at one outer radius.
#[derive(Debug, Clone, Copy)]
pub struct EndShape<S> {
    /// Signed minor half-axis `a` [m].
    pub minor: S,
    /// Major (axial) half-axis `b` [m].
    pub major: S,
    /// Centre offset `c` [m].
    pub offset: S,
    /// Axial length `b'` of one end [m].
    pub length: S,
}

impl<S: Scalar> Ends<S> {
    /// The ends at contraction ratio `e`; `ratio` must be positive for the result to have a
    /// meaning.
    pub fn new(
        braid: &Braid,
        law: &EndRatio,
        rule: &GaussLegendre<ARC_NODES>,
        arc: Arc,
        e: S,
    ) -> Self {
        let extension = e.re() < 0.0;
        let slope = if extension { law.extension_slope } else { law.contraction_slope };
        let ratio = -e * slope + law.k0;
        let root = (ratio * ratio + 3.0).sqrt();
        let angle = (constant::<S>(SQRT_3) / ratio).atan();
        let arc_angle = match arc {
            Arc::Parametric => angle,
            Arc::Published => constant(PI / 3.0),
        };
        let (mut cos, mut sin) = ([constant(0.0); ARC_NODES], [constant(0.0); ARC_NODES]);
        for (i, x) in rule.nodes.iter().enumerate() {
            let v = arc_angle * (0.5 * (1.0 + x));
            (sin[i], cos[i]) = v.sin_cos();
        }
        Self {
            length: (-e + 1.0) * braid.rest_length,
            ratio,
            cos_end: ratio / root,
            sin_end: constant::<S>(SQRT_3) / root,
            angle,
            arc_angle,
            sign: if extension { -1.0 } else { 1.0 },
            cos,
            sin,
        }
    }

    /// Half-axes, offset and length of one end when the middle has the given outer radius [m].
    pub fn shape(&self, braid: &Braid, radius: S) -> EndShape<S> {
        let minor = (radius - braid.rest_radius) / (-self.cos_end + 1.0);
        let major = self.ratio * minor * self.sign;
        EndShape { minor, major, offset: radius - minor, length: major * self.sin_end }
    }

    /// Length [m] of one fibre on the surface with the given outer radius, `B_est(R)`.
    pub fn fibre_length(&self, braid: &Braid, rule: &GaussLegendre<ARC_NODES>, radius: S) -> S {
        let end = self.shape(braid, radius);
        // The arc divided by |a|: smooth through R = R0, where the ends vanish.
        let twist =
            self.ratio * self.sin_end * (2.0 * PI * braid.turns) / (self.length * self.arc_angle);
        let mut sum = constant::<S>(0.0);
        for i in 0..ARC_NODES {
            let (cos, sin) = (self.cos[i], self.sin[i]);
            let around = (end.minor * cos + end.offset) * twist;
            let axial = self.ratio * cos;
            sum += (around * around + sin * sin + axial * axial).sqrt() * rule.weights[i];
        }
        let arc = end.minor * self.sign * self.arc_angle * 0.5 * sum;
        let turn = radius * (2.0 * PI * braid.turns);
        let straight = (self.length * self.length + turn * turn).sqrt();
        (self.length - end.length * 2.0) / self.length * straight + arc * 2.0
    }

    /// Integral of the outer profile over the length and of its square [m2, m3], closed forms.
    pub fn integrals(&self, braid: &Braid, radius: S) -> (S, S) {
        let EndShape { minor, major, offset, length } = self.shape(braid, radius);
        let middle = self.length - length * 2.0;
        let first = self.sin_end;
        let second = (self.angle + self.sin_end * self.cos_end) * 0.5;
        let third = first - first * first * first * (1.0 / 3.0);
        let one = offset * first + minor * second;
        let two = offset * offset * first + offset * minor * second * 2.0 + minor * minor * third;
        (middle * radius + major * one * 2.0, middle * radius * radius + major * two * 2.0)
    }
}

impl Ends<f64> {
    /// Outer profile `f(z)` [m] at distance `z` [m] from a fitting, `0 <= z <= L/2`.
    #[must_use]
    pub fn profile(&self, braid: &Braid, radius: f64, z: f64) -> f64 {
        let end = self.shape(braid, radius);
        if z < end.length {
            let u = (z - end.length) / end.major;
            end.offset + end.minor * ((1.0 - u) * (1.0 + u)).max(0.0).sqrt()
        } else {
            radius
        }
    }
}
