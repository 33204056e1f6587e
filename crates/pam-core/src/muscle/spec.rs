//! The parameters of one kind of muscle, and whether they are possible.

use serde::Deserialize;

use super::elbow_linear::Factors;
use super::friction::Friction;
use super::map::MapSurface;
use super::model::ForceModel;
use crate::braid::{Dimensions, EndRatio, MuscleGeometry, Profile};
use crate::error::{check_range, Error, Result};
use crate::key;
pub use crate::keys::STRUT;
use crate::scalar::Scalar;

/// Largest order of the stress polynomial.
pub const HIGHEST_ORDER: usize = 12;

/// Share of its moduli at the reference temperature that a muscle has at a temperature [1].
#[inline]
pub fn softened<S: Scalar>(softening: S, temperature: S, reference: f64) -> S {
    -(softening * (temperature - reference)) + 1.0
}

/// Refuse moduli below zero of a muscle that is called so.
///
/// # Errors
/// [`Error::Parameter`] that names the softening.
pub(crate) fn check_softened(
    muscle: &str,
    softening: f64,
    temperature: f64,
    reference: f64,
) -> Result<()> {
    if softened(softening, temperature, reference) >= 0.0 {
        return Ok(());
    }
    let warmer = temperature - reference;
    let (most, apart) =
        ((1e6 / warmer.abs()).floor() / 1e6, (warmer.abs() * 100.0).round() / 100.0);
    let side = if warmer > 0.0 { "above" } else { "below" };
    let allowed =
        format!("a size of at most {most} 1/K, {apart} K {side} {muscle}.reference_temperature");
    Err(Error::parameter(format!("{muscle}.softening"), softening, allowed))
}

/// Parameters of one kind of muscle, SI units and radians.
///
/// Elastic parameters that the force model does not have are empty or zero.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MuscleSpec {
    /// Force model, see [`ForceModel::NAMES`].
    pub model: String,
    /// Outer profile, see [`Profile::NAMES`]; the model's own where it is left out.
    #[serde(default)]
    pub geometry: Option<String>,
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
    /// `m_k`, change of the k-th modulus with pressure [1], from k = 1 (`ferraresi`, `kothera`,
    /// `robinson`).
    #[serde(default)]
    pub modulus_slope: Vec<f64>,
    /// `b_k`, the k-th modulus at zero pressure [Pa], from k = 1 (the same models).
    #[serde(default)]
    pub modulus_offset: Vec<f64>,
    /// First Mooney-Rivlin constant [Pa] (`mooney_rivlin`).
    #[serde(default)]
    pub c10: f64,
    /// Second Mooney-Rivlin constant [Pa] (`mooney_rivlin`).
    #[serde(default)]
    pub c01: f64,
    /// `E_R` [Pa] (`elbow_linear`).
    #[serde(default)]
    pub bladder_modulus: f64,
    /// Factors of the lengthening branch [1] (`elbow_linear`).
    #[serde(default = "default_factors")]
    pub extension_factors: Factors,
    /// Gauge pressures of the map, rising [Pa] (`map`).
    #[serde(default)]
    pub map_pressure: Vec<f64>,
    /// Contraction ratios of the map, rising [1] (`map`).
    #[serde(default)]
    pub map_contraction: Vec<f64>,
    /// Forces of the map [N], a row over the contractions for each pressure (`map`).
    #[serde(default)]
    pub map_force: Vec<f64>,
    /// Factor on every modulus, of a map on its force [1].
    #[serde(default = "default_scale")]
    pub modulus_scale: f64,
    /// Relative loss of every modulus per kelvin above the reference temperature [1/K].
    #[serde(default)]
    pub softening: f64,
    /// Temperature of the muscle [K].
    #[serde(default = "default_temperature")]
    pub temperature: f64,
    /// Temperature at which the moduli hold [K].
    #[serde(default = "default_temperature")]
    pub reference_temperature: f64,
    /// `c0` of the friction hysteresis [1].
    #[serde(default)]
    pub friction_coefficient: f64,
    /// `c1` of the friction hysteresis [1/Pa].
    #[serde(default)]
    pub friction_pressure_slope: f64,
    /// Least coefficient of the friction hysteresis [1].
    #[serde(default)]
    pub friction_floor: f64,
    /// Motion over which the force goes from one branch of the hysteresis to the other [m].
    #[serde(default = "default_presliding")]
    pub friction_presliding: f64,
    /// Compression at which one muscle in a rig buckles [N]: with 0 it goes slack, from [`STRUT`] on
    /// it never does.
    #[serde(default)]
    pub buckling_load: f64,
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

fn default_temperature() -> f64 {
    293.15
}

fn default_factors() -> Factors {
    [0.3, 0.8, 0.8]
}
fn default_scale() -> f64 {
    1.0
}
fn default_presliding() -> f64 {
    1e-3
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
    /// One muscle of a model and dimensions [m, m, rad, m], without elasticity and friction.
    #[must_use]
    pub fn plain(model: &str, length: f64, diameter: f64, braid_angle: f64, wall: f64) -> Self {
        Self {
            model: model.into(),
            geometry: None,
            count: 1,
            rest_length: length,
            rest_diameter: diameter,
            braid_angle,
            wall_thickness: wall,
            modulus_slope: Vec::new(),
            modulus_offset: Vec::new(),
            c10: 0.0,
            c01: 0.0,
            bladder_modulus: 0.0,
            extension_factors: default_factors(),
            map_pressure: Vec::new(),
            map_contraction: Vec::new(),
            map_force: Vec::new(),
            modulus_scale: default_scale(),
            softening: 0.0,
            temperature: default_temperature(),
            reference_temperature: default_temperature(),
            friction_coefficient: 0.0,
            friction_pressure_slope: 0.0,
            friction_floor: 0.0,
            friction_presliding: default_presliding(),
            buckling_load: 0.0,
            k0: default_k0(),
            contraction_slope: default_contraction_slope(),
            extension_slope: default_extension_slope(),
            neck_floor: default_neck_floor(),
        }
    }

    /// The force model.
    ///
    /// # Errors
    /// [`Error::Choice`] for an unknown name.
    pub fn force_model(&self) -> Result<ForceModel> {
        ForceModel::from_name(&self.model)
    }

    /// The surface of its map; none without one.
    ///
    /// # Errors
    /// As [`super::map::check`].
    pub fn surface(&self) -> Result<Option<MapSurface>> {
        if self.map_force.is_empty() {
            return Ok(None);
        }
        MapSurface::of(&self.map_pressure, &self.map_contraction, &self.map_force).map(Some)
    }

    /// The outer profile.
    ///
    /// # Errors
    /// [`Error::Choice`] for an unknown name.
    pub fn profile(&self) -> Result<Profile> {
        match &self.geometry {
            Some(name) => Profile::from_name(name),
            None => Ok(self.force_model()?.profile()),
        }
    }

    /// The geometry of one muscle of this kind.
    ///
    /// # Errors
    /// As [`Self::validate`].
    pub fn shape(&self) -> Result<MuscleGeometry> {
        self.validate()?;
        Ok(MuscleGeometry::new(&Dimensions {
            rest_length: self.rest_length,
            rest_diameter: self.rest_diameter,
            braid_angle: self.braid_angle,
            wall_thickness: self.wall_thickness,
            ends: EndRatio {
                k0: self.k0,
                contraction_slope: self.contraction_slope,
                extension_slope: self.extension_slope,
            },
            neck_floor: self.neck_floor,
            profile: self.profile()?,
        }))
    }

    /// The friction of the muscle, none if it has none.
    #[must_use]
    pub fn friction(&self) -> Option<Friction> {
        let friction = Friction {
            coefficient: self.friction_coefficient,
            pressure_slope: self.friction_pressure_slope,
            floor: self.friction_floor,
            presliding: self.friction_presliding,
        };
        friction.acts().then_some(friction)
    }

    /// Factor on every modulus at the muscle's temperature [1].
    #[must_use]
    pub fn elastic_scale(&self) -> f64 {
        let Self { softening, temperature, reference_temperature, .. } = self;
        self.modulus_scale * softened(*softening, *temperature, *reference_temperature)
    }

    /// The same muscle without what the compiled table does not depend on.
    #[must_use]
    pub fn tabulated(&self) -> Self {
        Self {
            count: 1,
            modulus_scale: 1.0,
            softening: 0.0,
            temperature: default_temperature(),
            reference_temperature: default_temperature(),
            friction_coefficient: 0.0,
            friction_pressure_slope: 0.0,
            friction_floor: 0.0,
            friction_presliding: default_presliding(),
            buckling_load: 0.0,
            ..self.clone()
        }
    }

    /// Whether every parameter is finite and possible.
    ///
    /// # Errors
    /// [`Error::Parameter`] that names the first parameter that is not (`muscle.braid_angle`),
    /// [`Error::Choice`] for an unknown model or geometry or an elastic parameter that the model
    /// does not have, [`Error::Length`] if the two lists of moduli differ in length.
    pub fn validate(&self) -> Result<()> {
        let model = self.force_model()?;
        self.profile()?;
        let numbers = [
            (key!("muscle", "count"), f64::from(self.count)),
            (key!("muscle", "rest_length"), self.rest_length),
            (key!("muscle", "rest_diameter"), self.rest_diameter),
            (key!("muscle", "braid_angle"), self.braid_angle),
            (key!("muscle", "modulus_scale"), self.modulus_scale),
            (key!("muscle", "softening"), self.softening),
            (key!("muscle", "temperature"), self.temperature),
            (key!("muscle", "reference_temperature"), self.reference_temperature),
            (key!("muscle", "friction_coefficient"), self.friction_coefficient),
            (key!("muscle", "friction_pressure_slope"), self.friction_pressure_slope),
            (key!("muscle", "friction_floor"), self.friction_floor),
            (key!("muscle", "friction_presliding"), self.friction_presliding),
            (key!("muscle", "buckling_load"), self.buckling_load),
            (key!("muscle", "k0"), self.k0),
            (key!("muscle", "contraction_slope"), self.contraction_slope),
            (key!("muscle", "extension_slope"), self.extension_slope),
            (key!("muscle", "neck_floor"), self.neck_floor),
        ];
        numbers.iter().try_for_each(|(key, value)| key.check_all("muscle", &[*value]))?;
        let thickest = 0.45 * self.rest_diameter;
        let (least, ..) = key!("muscle", "wall_thickness").bounds();
        check_range(
            "muscle.wall_thickness",
            self.wall_thickness,
            least,
            thickest,
            "m (0.45 rest diameters)",
        )?;
        self.check_elastic(model)?;
        check_softened("muscle", self.softening, self.temperature, self.reference_temperature)?;
        key!("muscle", "extension_factors").check_all("muscle", &self.extension_factors)?;
        Ok(())
    }

    fn check_elastic(&self, model: ForceModel) -> Result<()> {
        let orders = self.modulus_slope.len();
        let polynomial = model.is_polynomial();
        let (mooney_rivlin, elbow) =
            (model == ForceModel::MooneyRivlin, model == ForceModel::ElbowLinear);
        let map = model == ForceModel::Map;
        let numbers = |list: &[f64]| format!("{} numbers", list.len());
        let default = self.extension_factors == default_factors();
        let given = [
            ("modulus_slope", format!("{:?}", self.modulus_slope), polynomial || orders == 0),
            (
                "modulus_offset",
                format!("{:?}", self.modulus_offset),
                polynomial || self.modulus_offset.is_empty(),
            ),
            ("c10", self.c10.to_string(), mooney_rivlin || self.c10 == 0.0),
            ("c01", self.c01.to_string(), mooney_rivlin || self.c01 == 0.0),
            (
                "bladder_modulus",
                self.bladder_modulus.to_string(),
                elbow || self.bladder_modulus == 0.0,
            ),
            ("extension_factors", format!("{:?}", self.extension_factors), elbow || default),
            // a map has no elastic terms of its own
            ("softening", self.softening.to_string(), !map || self.softening == 0.0),
            ("map_pressure", numbers(&self.map_pressure), map || self.map_pressure.is_empty()),
            (
                "map_contraction",
                numbers(&self.map_contraction),
                map || self.map_contraction.is_empty(),
            ),
            ("map_force", numbers(&self.map_force), map || self.map_force.is_empty()),
        ];
        for (name, value, fits) in given {
            if !fits {
                let allowed = format!("the model \"{}\" has no such parameter", self.model);
                return Err(Error::Choice { name: format!("muscle.{name}"), value, allowed });
            }
        }
        key!("muscle", "c10").check_all("muscle", &[self.c10])?;
        key!("muscle", "c01").check_all("muscle", &[self.c01])?;
        key!("muscle", "bladder_modulus").check_all("muscle", &[self.bladder_modulus])?;
        if map {
            return super::map::check(&self.map_pressure, &self.map_contraction, &self.map_force);
        }
        if !polynomial {
            return Ok(());
        }
        check_range(
            "muscle.modulus_slope length",
            orders as f64,
            0.0,
            HIGHEST_ORDER as f64,
            "moduli",
        )?;
        if self.modulus_offset.len() != orders {
            return Err(Error::Length {
                name: "muscle.modulus_offset".into(),
                found: self.modulus_offset.len(),
                expected: orders,
                why: "one for each muscle.modulus_slope".into(),
            });
        }
        key!("muscle", "modulus_slope").check_all("muscle", &self.modulus_slope)?;
        key!("muscle", "modulus_offset").check_all("muscle", &self.modulus_offset)
    }
}
