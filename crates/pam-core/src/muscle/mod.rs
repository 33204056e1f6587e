//! One muscle: its parameters, exact force and geometry, and the compiled table of both.
//!
//! Equations: geometry after the physics reference, section 1 (see [`crate::geometry`]), force
//! after section 2, model 6 (see [`robinson`]); Robinson 2014, ch. 2. Radius, thickness, volume and
//! the coefficients of the force depend on the contraction ratio `e = 1 - L/L0` alone, so they are
//! compiled once to a [`Table`] with a checked error bound.

pub mod robinson;
pub mod table;

use serde::Deserialize;

pub use self::robinson::Coefficients;
pub use self::table::{Table, TablePoint};
use crate::error::{check_range, Error, Result};
use crate::geometry::{MuscleGeometry, Shape};

/// Lowest gauge pressure [Pa]: vacuum at standard ambient pressure.
pub const LOWEST_PRESSURE: f64 = -101_325.0;
/// Highest gauge pressure [Pa] that is taken for an input and not for a mistake of unit.
pub const HIGHEST_PRESSURE: f64 = 1.0e8;
/// Largest order of the stress polynomial.
pub const HIGHEST_ORDER: usize = 12;

/// Parameters of one kind of muscle, SI units and radians.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MuscleSpec {
    /// Force model: `"robinson"`.
    pub model: String,
    /// Outer profile: `"elliptic"` or `"cylinder"`.
    #[serde(default = "default_geometry")]
    pub geometry: String,
    /// Muscles in parallel.
    pub count: u32,
    /// Rest length between the fittings [m].
    pub rest_length: f64,
    /// Rest outer diameter [m].
    pub rest_diameter: f64,
    /// Braid angle at rest from the circumferential plane [rad].
    pub braid_angle: f64,
    /// Rest wall thickness of the bladder [m].
    pub wall_thickness: f64,
    /// `m_k`, change of the k-th modulus with pressure [1], from k = 1.
    pub modulus_slope: Vec<f64>,
    /// `b_k`, the k-th modulus at zero pressure [Pa], from k = 1.
    pub modulus_offset: Vec<f64>,
    /// Factor on every modulus [1].
    #[serde(default = "default_scale")]
    pub modulus_scale: f64,
    /// Axis ratio of the elliptic ends at rest [1].
    #[serde(default = "default_k0")]
    pub k0: f64,
    /// Its decrease per contraction ratio in contraction [1].
    #[serde(default = "default_contraction_slope")]
    pub contraction_slope: f64,
    /// Its decrease per contraction ratio in extension [1].
    #[serde(default = "default_extension_slope")]
    pub extension_slope: f64,
    /// Smallest outer radius in extension as a fraction of the rest radius [1].
    #[serde(default = "default_neck_floor")]
    pub neck_floor: f64,
}

fn default_geometry() -> String {
    "elliptic".into()
}
fn default_scale() -> f64 {
    1.0
}
fn default_k0() -> f64 {
    1.64
}
fn default_contraction_slope() -> f64 {
    2.405
}
fn default_extension_slope() -> f64 {
    6.105
}
fn default_neck_floor() -> f64 {
    0.80
}

impl MuscleSpec {
    /// Whether every parameter is finite and possible.
    ///
    /// # Errors
    /// [`Error::Parameter`] that names the first parameter that is not (`muscle.braid_angle`),
    /// [`Error::Model`] for an unknown model or geometry, [`Error::Length`] if the two lists of
    /// moduli differ in length.
    pub fn validate(&self) -> Result<()> {
        if self.model != "robinson" {
            return Err(Error::Model(format!(
                "muscle.model = \"{}\" is not known: \"robinson\"",
                self.model
            )));
        }
        if !matches!(self.geometry.as_str(), "elliptic" | "cylinder") {
            let text =
                format!("muscle.geometry = \"{}\" is not known: \"elliptic\", \"cylinder\"", self.geometry);
            return Err(Error::Model(text));
        }
        let degree = std::f64::consts::PI / 180.0;
        check_range("muscle.count", f64::from(self.count), 1.0, 1000.0, "muscles")?;
        check_range("muscle.rest_length", self.rest_length, 1e-3, 20.0, "m")?;
        check_range("muscle.rest_diameter", self.rest_diameter, 1e-4, 2.0, "m")?;
        check_range(
            "muscle.braid_angle",
            self.braid_angle,
            45.0 * degree,
            89.0 * degree,
            "rad (45 to 89 deg)",
        )?;
        let thickest = 0.45 * self.rest_diameter;
        check_range("muscle.wall_thickness", self.wall_thickness, 0.0, thickest, "m (0.45 rest diameters)")?;
        let orders = self.modulus_slope.len();
        check_range("muscle.modulus_slope length", orders as f64, 1.0, HIGHEST_ORDER as f64, "moduli")?;
        if self.modulus_offset.len() != orders {
            return Err(Error::Length {
                name: "muscle.modulus_offset".into(),
                found: self.modulus_offset.len(),
                expected: orders,
                why: "one for each muscle.modulus_slope".into(),
            });
        }
        for (k, (slope, offset)) in self.modulus_slope.iter().zip(&self.modulus_offset).enumerate() {
            check_range(&format!("muscle.modulus_slope[{k}]"), *slope, -1e6, 1e6, "(1)")?;
            check_range(&format!("muscle.modulus_offset[{k}]"), *offset, -1e13, 1e13, "Pa")?;
        }
        check_range("muscle.modulus_scale", self.modulus_scale, 0.0, 1e3, "(1)")?;
        check_range("muscle.k0", self.k0, 0.3, 10.0, "(1)")?;
        check_range("muscle.contraction_slope", self.contraction_slope, -20.0, 20.0, "(1)")?;
        check_range("muscle.extension_slope", self.extension_slope, -20.0, 20.0, "(1)")?;
        check_range("muscle.neck_floor", self.neck_floor, 0.3, 1.0, "(1)")?;
        Ok(())
    }
}

/// One muscle, exact and compiled.
#[derive(Debug, Clone)]
pub struct Muscle {
    /// Its parameters.
    pub spec: MuscleSpec,
    /// The exact geometry.
    pub geometry: MuscleGeometry,
    /// Force coefficients and volume over contraction, compiled.
    pub table: Table,
}

impl Muscle {
    /// Checks the parameters and compiles the table.
    ///
    /// # Errors
    /// As [`MuscleSpec::validate`]; [`Error::Model`] if the table cannot reach its error bound.
    pub fn new(spec: &MuscleSpec) -> Result<Self> {
        let geometry = MuscleGeometry::new(spec)?;
        let table = Table::compile(&geometry, &spec.modulus_slope, &spec.modulus_offset)?;
        Ok(Self { spec: spec.clone(), geometry, table })
    }

    /// The exact shape at contraction ratio `e`.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the muscle cannot have that length.
    pub fn shape(&self, e: f64) -> Result<Shape> {
        self.geometry.solve(e)
    }

    /// Exact outer radius [m] at contraction ratio `e`.
    ///
    /// # Errors
    /// As [`Muscle::shape`].
    pub fn radius(&self, e: f64) -> Result<f64> {
        Ok(self.shape(e)?.radius)
    }

    /// Exact wall thickness [m] at contraction ratio `e`.
    ///
    /// # Errors
    /// As [`Muscle::shape`].
    pub fn thickness(&self, e: f64) -> Result<f64> {
        Ok(self.shape(e)?.thickness)
    }

    /// Exact air volume of one muscle [m3] at contraction ratio `e`.
    ///
    /// # Errors
    /// As [`Muscle::shape`].
    pub fn air_volume(&self, e: f64) -> Result<f64> {
        Ok(self.shape(e)?.air_volume)
    }

    /// Exact coefficients of the force of one muscle at contraction ratio `e`.
    ///
    /// # Errors
    /// As [`Muscle::shape`].
    pub fn coefficients(&self, e: f64) -> Result<Coefficients> {
        let (slope, offset) = (&self.spec.modulus_slope, &self.spec.modulus_offset);
        Ok(Coefficients::new(self.geometry.braid(), slope, offset, &self.shape(e)?))
    }

    /// Exact force of one muscle [N] at gauge pressure `pressure` [Pa] and contraction ratio `e`.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the pressure is below vacuum or the muscle cannot have that length.
    pub fn force(&self, pressure: f64, e: f64) -> Result<f64> {
        check_range("muscle.pressure", pressure, LOWEST_PRESSURE, HIGHEST_PRESSURE, "Pa gauge")?;
        Ok(self.coefficients(e)?.force(pressure, self.spec.modulus_scale))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn shoulder() -> MuscleSpec {
        MuscleSpec {
            model: "robinson".into(),
            geometry: "elliptic".into(),
            count: 6,
            rest_length: 0.276,
            rest_diameter: 0.0254,
            braid_angle: 73.5_f64.to_radians(),
            wall_thickness: 0.003_175,
            modulus_slope: vec![3.0, -0.35, 0.0, 0.0],
            modulus_offset: vec![1.15e6, -0.15e6, 0.0, 0.0],
            modulus_scale: 1.0,
            k0: 1.64,
            contraction_slope: 2.405,
            extension_slope: 6.105,
            neck_floor: 0.80,
        }
    }

    pub(crate) fn elbow() -> MuscleSpec {
        MuscleSpec {
            rest_length: 7.785 * 0.0254,
            rest_diameter: 0.625 * 0.0254,
            braid_angle: 72.5_f64.to_radians(),
            wall_thickness: 0.0254 / 16.0,
            ..shoulder()
        }
    }

    /// The 0.75-inch muscle with the 1/8-inch wall.
    pub(crate) fn thick() -> MuscleSpec {
        MuscleSpec {
            rest_length: 7.3 * 0.0254,
            rest_diameter: 0.75 * 0.0254,
            braid_angle: 76.5_f64.to_radians(),
            wall_thickness: 0.0254 / 8.0,
            ..shoulder()
        }
    }

    #[test]
    fn published_constants_of_the_elbow_muscle() {
        let geometry = MuscleGeometry::new(&elbow()).unwrap();
        assert!((geometry.braid().turns - 1.25).abs() < 5e-3);
        assert!((geometry.braid().fibre_length / 0.0254 - 8.16).abs() < 5e-3);
    }

    #[test]
    fn impossible_parameters_are_named() {
        type Change = fn(&mut MuscleSpec);
        let changes: [(&str, Change); 11] = [
            ("muscle.model", |s| s.model = "spring".into()),
            ("muscle.geometry", |s| s.geometry = "sphere".into()),
            ("muscle.count", |s| s.count = 0),
            ("muscle.rest_length", |s| s.rest_length = f64::NAN),
            ("muscle.rest_diameter", |s| s.rest_diameter = -0.01),
            ("muscle.braid_angle", |s| s.braid_angle = 73.5),
            ("muscle.wall_thickness", |s| s.wall_thickness = 0.02),
            ("muscle.modulus_slope", |s| s.modulus_slope.clear()),
            ("muscle.modulus_offset", |s| s.modulus_offset = vec![1.0]),
            ("muscle.modulus_slope[1]", |s| s.modulus_slope[1] = f64::INFINITY),
            ("muscle.neck_floor", |s| s.neck_floor = 1.5),
        ];
        for (name, change) in changes {
            let mut spec = shoulder();
            change(&mut spec);
            let message = Muscle::new(&spec).unwrap_err().to_string();
            assert!(message.contains(name), "{name}: {message}");
        }
    }

    #[test]
    fn pressure_below_vacuum_is_named() {
        let muscle = Muscle::new(&shoulder()).unwrap();
        for pressure in [f64::NAN, -1.1e5, f64::NEG_INFINITY, 1e12] {
            let message = muscle.force(pressure, 0.1).unwrap_err().to_string();
            assert!(message.contains("muscle.pressure"), "{message}");
        }
        assert!(muscle.force(LOWEST_PRESSURE, 0.1).unwrap().is_finite());
    }

    #[test]
    fn unknown_fields_are_refused() {
        let text = r#"{"model": "robinson", "count": 1, "rest_length": 0.2, "rest_diameter": 0.02,
            "braid_angle": 1.2, "wall_thickness": 0.001, "modulus_slope": [1.0], "modulus_offset": [1e6]"#;
        let spec: MuscleSpec = serde_json::from_str(&format!("{text}}}")).unwrap();
        assert!(spec.validate().is_ok());
        assert!(serde_json::from_str::<MuscleSpec>(&format!("{text}, \"colour\": 1}}")).is_err());
    }
}
