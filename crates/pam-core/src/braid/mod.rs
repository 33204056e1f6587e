//! Geometry of one braided muscle: outer radius, wall thickness and air volume over contraction.
//!
//! Equations (physics reference, section 1; Robinson 2014, ch. 2, corrected):
//!
//! ```text
//! B  = L0 / sin(alpha)   N = L0 / (2 pi R0 tan(alpha))   VB = pi (R0^2 - (R0 - t0)^2) L0
//! L  = L0 (1 - e)        eps_c = (R - t/2)/(R0 - t0/2) - 1
//! I1 = integral f dz
//! I2 = integral f^2 dz
//! f outer profile: elliptic ends or cylinder
//! t  = (I1 - sqrt(I1^2 - L VB/pi)) / L = (VB/pi) / (I1 + sqrt(I1^2 - L VB/pi))
//! V  = pi integral (f - t)^2 dz = pi I2 - VB             the rubber is incompressible
//! ```
//!
//! In extension the radius stops at `R_floor = max(sqrt(VB/(pi L)), neck_floor R0)`; there the
//! braid is taut. Everything depends on the contraction ratio alone. Derivatives are exact: the
//! root is differentiated implicitly, `dR/de = -(dB_est/de)/(dB_est/dR)`.

pub mod cylinder;
mod dimensions;
pub mod elliptic;
pub mod numeric;

use std::f64::consts::PI;

use crate::dual::Slope;

pub use self::dimensions::{Braid, Dimensions, EndRatio, Profile};
use self::elliptic::{Arc, Ends, ARC_NODES};
use self::numeric::{brent, minimum, GaussLegendre, Root};
use crate::error::{check_range, Error, Result};
use crate::scalar::Scalar;

/// The shortest length the geometry is used for, as a fraction of the fibre length.
pub const SHORTEST: f64 = 0.58;

/// Relative tolerance of the radius in the braid-length root solve.
const ROOT_TOLERANCE: f64 = 1e-15;
/// Steps in which the root nearest to the rest radius is looked for.
const SCAN_STEPS: u32 = 16;
/// Relative distance from the floor below which the nearest radius of the published ends is the
/// floor.
const FLOOR_TOLERANCE: f64 = 1e-9;
/// How far beyond the cylinder's radius a root is looked for in contraction.
const SCAN_REACH: f64 = 1.6;

/// The state of one muscle at one contraction ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape<S = f64> {
    /// Length `L` [m].
    pub length: S,
    /// Outer radius of the middle `R` [m].
    pub radius: S,
    /// Wall thickness `t` [m].
    pub thickness: S,
    /// Air volume `V` [m3].
    pub air_volume: S,
    /// Circumferential strain of the wall's mid-line.
    pub eps_c: S,
    /// In extension: the radius has reached its floor, the braid is taut.
    pub braid_taut: bool,
    /// Function evaluations of the root solve (0 where none was needed).
    pub iterations: u32,
}

/// Solves the geometry of one muscle at any length it can have.
#[derive(Debug, Clone)]
pub struct MuscleGeometry {
    braid: Braid,
    ends: EndRatio,
    neck_floor: f64,
    profile: Profile,
    rule: GaussLegendre<ARC_NODES>,
    range: (f64, f64),
}

impl MuscleGeometry {
    /// The geometry of a muscle of some dimensions.
    #[must_use]
    pub fn new(of: &Dimensions) -> Self {
        let (rest_length, rest_radius) = (of.rest_length, 0.5 * of.rest_diameter);
        let (sin, tan) = (of.braid_angle.sin(), of.braid_angle.tan());
        let thickness = of.wall_thickness;
        let braid = Braid {
            rest_length,
            rest_radius,
            rest_thickness: thickness,
            fibre_length: rest_length / sin,
            turns: rest_length / (2.0 * PI * rest_radius * tan),
            bladder_volume: PI * thickness * (2.0 * rest_radius - thickness) * rest_length,
        };
        let range = (1.0 - 1.0 / sin, 1.0 - SHORTEST / sin);
        let Dimensions { ends, neck_floor, profile, .. } = *of;
        Self { braid, ends, neck_floor, profile, rule: GaussLegendre::new(), range }
    }

    /// Constants of the braid.
    #[must_use]
    pub fn braid(&self) -> &Braid {
        &self.braid
    }

    /// Contraction ratios from `L = B` (longest) to `L = 0.58 B` (shortest).
    #[must_use]
    pub fn range(&self) -> (f64, f64) {
        self.range
    }

    /// Radius, thickness, air volume and strain at contraction ratio `e`.
    ///
    /// # Errors
    /// [`Error::Parameter`] if `e` is not finite, the length is outside `0.58 B .. B`, or no radius
    /// of this geometry has the fibre's length.
    pub fn solve(&self, e: f64) -> Result<Shape> {
        let (root, taut) = self.outer_radius(e)?;
        self.shape_at(e, root.x, taut, root.iterations)
    }

    /// [`MuscleGeometry::solve`] with exact first derivatives with respect to `e`.
    ///
    /// At a point where the geometry has a kink (`e = 0`, where the braid becomes taut) the
    /// derivative is that of the side [`MuscleGeometry::solve`] takes: contraction at `e = 0`.
    ///
    /// # Errors
    /// As [`MuscleGeometry::solve`].
    pub fn solve_dual(&self, e: f64) -> Result<Shape<Slope>> {
        let (root, taut) = self.outer_radius(e)?;
        let at = Slope::new(e, 1.0);
        let radius = if taut {
            self.floor(at)
        } else {
            match self.profile {
                Profile::EllipticPublished if !self.meets(e, root.x) => {
                    return Err(unsolved(
                        e,
                        "the published ends have only a nearest radius, without a derivative",
                    ));
                }
                Profile::Cylinder => {
                    cylinder::radius(&self.braid, (-at + 1.0) * self.braid.rest_length)
                }
                Profile::Elliptic | Profile::EllipticPublished => {
                    let along = self.fibre_length(at, Slope::new(root.x, 0.0)).slope();
                    let across =
                        self.fibre_length(Slope::new(e, 0.0), Slope::new(root.x, 1.0)).slope();
                    Slope::new(root.x, -along / across)
                }
            }
        };
        self.shape_at(at, radius, taut, root.iterations)
    }

    /// Contraction ratios below zero at which the geometry has a kink, ascending: where the braid
    /// becomes taut, and where the floor of the radius changes from one law to the other.
    ///
    /// # Errors
    /// As [`MuscleGeometry::solve`].
    pub fn kinks(&self) -> Result<Vec<f64>> {
        let low = self.range.0;
        if !self.solve(low)?.braid_taut {
            return Ok(Vec::new());
        }
        let (mut taut, mut free) = (low, 0.0);
        for _ in 0..200 {
            let middle = 0.5 * (taut + free);
            if middle <= taut || middle >= free {
                break;
            }
            if self.outer_radius(middle)?.1 {
                taut = middle;
            } else {
                free = middle;
            }
        }
        let mut kinks = Vec::new();
        let neck = self.neck_floor * self.braid.rest_radius;
        let change = 1.0 - self.braid.bladder_volume / (PI * neck * neck * self.braid.rest_length);
        if change > low && change < taut {
            kinks.push(change);
        }
        if taut > low {
            kinks.push(taut);
        }
        Ok(kinks)
    }

    /// First and second integral of the outer profile, `I1` [m2] and `I2` [m3], by quadrature of
    /// the profile itself: the independent check of the closed forms.
    ///
    /// # Errors
    /// As [`MuscleGeometry::solve`].
    pub fn integrals_by_quadrature(&self, e: f64) -> Result<(f64, f64)> {
        let radius = self.outer_radius(e)?.0.x;
        let length = self.braid.rest_length * (1.0 - e);
        if self.profile == Profile::Cylinder {
            return Ok((length * radius, length * radius * radius));
        }
        let ends = self.ends_at(e);
        let b_end = ends.shape(&self.braid, radius).length;
        let rule = GaussLegendre::<40>::new();
        let half = |power: i32| {
            let f = |z: f64| ends.profile(&self.braid, radius, z).powi(power);
            rule.integrate(0.0, b_end, f) + rule.integrate(b_end, 0.5 * length, f)
        };
        Ok((2.0 * half(1), 2.0 * half(2)))
    }

    /// First and second integral of the outer profile, closed forms, of the solved state.
    ///
    /// # Errors
    /// As [`MuscleGeometry::solve`].
    pub fn integrals(&self, e: f64) -> Result<(f64, f64)> {
        let radius = self.outer_radius(e)?.0.x;
        Ok(self.closed_integrals(e, radius))
    }

    /// Length of one fibre [m] if the outer radius were `radius` [m].
    fn fibre_length<S: Scalar>(&self, e: S, radius: S) -> S {
        self.ends_at(e).fibre_length(&self.braid, &self.rule, radius)
    }

    fn closed_integrals<S: Scalar>(&self, e: S, radius: S) -> (S, S) {
        match self.profile {
            Profile::Cylinder => cylinder::integrals((-e + 1.0) * self.braid.rest_length, radius),
            Profile::Elliptic | Profile::EllipticPublished => {
                self.ends_at(e).integrals(&self.braid, radius)
            }
        }
    }

    /// The smallest radius [m] the filled braid can have at contraction ratio `e`.
    fn floor<S: Scalar>(&self, e: S) -> S {
        let neck = self.neck_floor * self.braid.rest_radius;
        let length = (-e + 1.0) * self.braid.rest_length;
        let full = (S::from(self.braid.bladder_volume / PI) / length).sqrt();
        if full.re() > neck {
            full
        } else {
            S::from(neck)
        }
    }

    /// Outer radius at `e` and whether the braid is taut.
    fn outer_radius(&self, e: f64) -> Result<(Root, bool)> {
        let (low, high) = self.range;
        check_range("muscle.contraction_ratio", e, low, high, "(length from B down to 0.58 B)")?;
        let rest = self.braid.rest_radius;
        if e == 0.0 {
            return Ok((Root { x: rest, iterations: 0 }, false));
        }
        let cylinder = cylinder::radius(&self.braid, self.braid.rest_length * (1.0 - e));
        let floor = Root { x: self.floor(e), iterations: 0 };
        match self.profile {
            Profile::Cylinder if cylinder < floor.x => Ok((floor, true)),
            Profile::Cylinder => Ok((Root { x: cylinder, iterations: 0 }, false)),
            Profile::Elliptic | Profile::EllipticPublished => {
                let slope =
                    if e < 0.0 { self.ends.extension_slope } else { self.ends.contraction_slope };
                let ratio = self.ends.k0 - slope * e;
                if ratio <= 0.0 {
                    return Err(unsolved(e, "the axis ratio of the ends would not be positive"));
                }
                let limit = if e < 0.0 { floor.x } else { rest + SCAN_REACH * (cylinder - rest) };
                match self.scan(e, limit) {
                    Some(root) => Ok((root, false)),
                    None if self.profile == Profile::EllipticPublished => {
                        let root = self.nearest(e, limit);
                        let at_floor = e < 0.0 && root.x <= limit * (1.0 + FLOOR_TOLERANCE);
                        Ok(if at_floor { (floor, true) } else { (root, false) })
                    }
                    None if e < 0.0 => Ok((floor, true)),
                    None => Err(unsolved(e, "no radius has the fibre's length")),
                }
            }
        }
    }

    /// The root of `B_est(R) = B` nearest to the rest radius, between it and `limit`.
    fn scan(&self, e: f64, limit: f64) -> Option<Root> {
        let ends = self.ends_at(e);
        let excess = |radius: f64| {
            ends.fibre_length(&self.braid, &self.rule, radius) - self.braid.fibre_length
        };
        let rest = self.braid.rest_radius;
        let start = excess(rest);
        // At |e| of rounding size the excess at rest may vanish or have the wrong sign.
        if start * e >= 0.0 {
            return Some(Root { x: rest, iterations: 1 });
        }
        let mut near = (rest, start);
        for i in 1..=SCAN_STEPS {
            let radius = rest + (limit - rest) * f64::from(i) / f64::from(SCAN_STEPS);
            let far = (radius, excess(radius));
            if near.1.signum() != far.1.signum() {
                let root = brent(excess, near, far, ROOT_TOLERANCE)?;
                return Some(Root { x: root.x, iterations: root.iterations + i + 1 });
            }
            near = far;
        }
        None
    }

    /// The radius between rest and `limit` whose fibre length is nearest to the fibre's.
    fn nearest(&self, e: f64, limit: f64) -> Root {
        let ends = self.ends_at(e);
        let rest = self.braid.rest_radius;
        let at = |share: f64| rest + (limit - rest) * share;
        let miss = |share: f64| {
            (ends.fibre_length(&self.braid, &self.rule, at(share)) - self.braid.fibre_length).abs()
        };
        let best = minimum(miss, SCAN_STEPS);
        Root { x: at(best.x), iterations: best.iterations }
    }

    /// Whether a radius gives the fibre its length.
    fn meets(&self, e: f64, radius: f64) -> bool {
        e == 0.0 || (self.fibre_length(e, radius) / self.braid.fibre_length - 1.0).abs() < 1e-12
    }

    fn ends_at<S: Scalar>(&self, e: S) -> Ends<S> {
        let arc = if self.profile == Profile::EllipticPublished {
            Arc::Published
        } else {
            Arc::Parametric
        };
        Ends::new(&self.braid, &self.ends, &self.rule, arc, e)
    }

    /// Thickness, volume and strain at a known outer radius.
    fn shape_at<S: Scalar>(
        &self,
        e: S,
        radius: S,
        braid_taut: bool,
        iterations: u32,
    ) -> Result<Shape<S>> {
        let braid = &self.braid;
        let length = (-e + 1.0) * braid.rest_length;
        if self.profile != Profile::Cylinder {
            let ends = self.ends_at(e.re());
            if 2.0 * ends.shape(braid, radius.re()).length > length.re() {
                return Err(unsolved(e.re(), "the elliptic ends would overlap"));
            }
        }
        let (first, second) = self.closed_integrals(e, radius);
        let rubber = braid.bladder_volume / PI;
        let mut root = first * first - length * rubber;
        let tiny = 1e-12 * first.re() * first.re();
        if root.re() < -tiny {
            return Err(unsolved(e.re(), "the bladder does not fit inside the braid"));
        }
        if root.re() < 0.0 {
            root = S::from(0.0);
        }
        let mut thickness = S::from(rubber) / (first + root.sqrt());
        let mut air_volume = second * PI - braid.bladder_volume;
        if e.re() == 0.0 {
            // Exact values at rest; the derivatives stay.
            thickness += braid.rest_thickness - thickness.re();
            let bore = braid.rest_radius - braid.rest_thickness;
            air_volume += PI * bore * bore * braid.rest_length - air_volume.re();
        }
        let rest_middle = braid.rest_radius - 0.5 * braid.rest_thickness;
        let eps_c = (radius - thickness * 0.5 - rest_middle) / rest_middle;
        Ok(Shape { length, radius, thickness, air_volume, eps_c, braid_taut, iterations })
    }
}

fn unsolved(e: f64, why: &str) -> Error {
    Error::parameter(
        "muscle.contraction_ratio",
        e,
        format!("one at which the geometry has a solution ({why})"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::muscle::tests::{elbow, shoulder, thick};

    fn each() -> Vec<MuscleGeometry> {
        let mut cylinder = shoulder();
        cylinder.geometry = Some("cylinder".into());
        [shoulder(), elbow(), thick(), cylinder].iter().map(|s| s.shape().unwrap()).collect()
    }

    fn grid(geometry: &MuscleGeometry) -> Vec<f64> {
        let (low, high) = geometry.range();
        (0..=60)
            .map(|i| low + (high - low) * f64::from(i) / 60.0)
            .map(|e| e.clamp(low, high))
            .collect()
    }

    #[test]
    fn rest_is_exact() {
        for geometry in each() {
            let shape = geometry.solve(0.0).unwrap();
            let braid = geometry.braid();
            assert_eq!(shape.radius, braid.rest_radius);
            assert_eq!(shape.thickness, braid.rest_thickness);
            assert_eq!(shape.eps_c, 0.0);
            assert!(!shape.braid_taut);
        }
    }

    #[test]
    fn fibre_keeps_its_length_unless_taut() {
        for geometry in each().iter().filter(|g| g.profile == Profile::Elliptic) {
            for e in grid(geometry) {
                let shape = geometry.solve(e).unwrap();
                if !shape.braid_taut {
                    let excess =
                        geometry.fibre_length(e, shape.radius) / geometry.braid.fibre_length - 1.0;
                    assert!(excess.abs() < 2e-14, "{e}: {excess:e}");
                    assert!(shape.iterations < 40, "{e}: {}", shape.iterations);
                }
            }
        }
    }

    #[test]
    fn closed_forms_agree_with_quadrature() {
        for geometry in each() {
            let rubber = geometry.braid.bladder_volume;
            for e in grid(&geometry) {
                let shape = geometry.solve(e).unwrap();
                let (i1, i2) = geometry.integrals(e).unwrap();
                let (q1, q2) = geometry.integrals_by_quadrature(e).unwrap();
                assert!((i1 / q1 - 1.0).abs() < 1e-12, "{e}: {i1} {q1}");
                assert!((i2 / q2 - 1.0).abs() < 1e-12, "{e}: {i2} {q2}");
                let t = shape.thickness;
                let volume = PI * (q2 - 2.0 * t * q1 + t * t * shape.length);
                assert!((volume / shape.air_volume - 1.0).abs() < 1e-12, "{e}: {volume}");
                let wall = PI * t * (2.0 * q1 - t * shape.length);
                assert!((wall / rubber - 1.0).abs() < 1e-12, "{e}: {wall}");
            }
        }
    }

    #[test]
    fn arc_quadrature_has_converged() {
        let fine = GaussLegendre::<160>::new();
        for geometry in each().iter().filter(|g| g.profile == Profile::Elliptic) {
            for e in grid(geometry) {
                let radius = geometry.solve(e).unwrap().radius;
                let ends = geometry.ends_at(e);
                let end = ends.shape(&geometry.braid, radius);
                let w = 2.0 * PI * geometry.braid.turns * end.length / (ends.length * ends.angle);
                let arc = fine.integrate(0.0, ends.angle, |v| {
                    let around = (end.minor * v.cos() + end.offset) * w;
                    let across = end.minor * v.sin();
                    (around * around + across * across + (end.major * v.cos()).powi(2)).sqrt()
                });
                let helix = ends.length.hypot(2.0 * PI * radius * geometry.braid.turns);
                let total = (ends.length - 2.0 * end.length) / ends.length * helix + 2.0 * arc;
                let found = ends.fibre_length(&geometry.braid, &geometry.rule, radius);
                assert!((found / total - 1.0).abs() < 1e-13, "{e}: {found} {total}");
            }
        }
    }

    #[test]
    fn derivatives_match_differences() {
        for geometry in each() {
            for e in [-0.004, -0.002, 0.003, 0.05, 0.2, 0.33] {
                let h = 1e-5;
                let exact = geometry.solve_dual(e).unwrap();
                let value = |x: f64| geometry.solve(x).unwrap();
                let slope = |f: fn(&Shape) -> f64| {
                    let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(|k| f(&value(e + k * h)));
                    (a - 8.0 * b + 8.0 * c - d) / (12.0 * h)
                };
                let volume = slope(|s| s.air_volume);
                assert!((exact.air_volume.slope() / volume - 1.0).abs() < 1e-6, "{e}: {volume}");
                let radius = slope(|s| s.radius);
                assert!((exact.radius.slope() / radius - 1.0).abs() < 1e-6, "{e}: {radius}");
            }
        }
    }

    #[test]
    fn impossible_lengths_are_named() {
        let geometry = shoulder().shape().unwrap();
        for e in [f64::NAN, f64::INFINITY, -0.05, 0.4] {
            let message = geometry.solve(e).unwrap_err().to_string();
            assert!(message.contains("muscle.contraction_ratio"), "{message}");
        }
    }
}
