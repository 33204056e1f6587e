//! One muscle: its parameters, exact force and geometry, and the compiled table of both.
//!
//! Equations: geometry after the physics reference, section 1 (see [`crate::braid`]); force after
//! section 2, one file for each model (see [`model`]). Radius, thickness, volume and the
//! coefficients of the force depend on the contraction ratio `e = 1 - L/L0` alone, so they are
//! compiled once to a [`Table`] with a checked error bound.

pub mod chou_hannaford;
mod elasticity;
pub mod elbow_linear;
pub mod ferraresi;
pub mod friction;
pub mod gaylord;
pub mod kothera;
pub mod map;
pub mod model;
pub mod mooney_rivlin;
mod pressures;
pub mod robinson;
pub mod slip;
pub mod spec;
pub mod table;

pub use self::elasticity::Elasticity;
pub use self::friction::Friction;
pub use self::map::MapSurface;
pub use self::model::{Coefficients, ForceModel};
pub use self::pressures::{HIGHEST_PRESSURE, LOWEST_PRESSURE};
pub use self::spec::{MuscleSpec, HIGHEST_ORDER, STRUT};
pub use self::table::{Table, TablePoint};
use crate::braid::{MuscleGeometry, Shape};
use crate::error::{check_range, Error, Result};
use crate::scalar::{constant, Scalar};

/// One muscle, exact.
#[derive(Debug, Clone)]
pub struct Muscle {
    /// Its parameters.
    pub spec: MuscleSpec,
    /// The exact geometry.
    pub geometry: MuscleGeometry,
    contracting: Elasticity,
    lengthening: Option<Elasticity>,
    friction: Option<Friction>,
    map: Option<MapSurface>,
}

impl Muscle {
    /// Checks the parameters.
    ///
    /// # Errors
    /// As [`MuscleSpec::validate`].
    pub fn new(spec: &MuscleSpec) -> Result<Self> {
        let geometry = spec.shape()?;
        let contracting = Elasticity::contracting(spec)?;
        let lengthening = contracting.lengthening(spec);
        Ok(Self {
            spec: spec.clone(),
            geometry,
            contracting,
            lengthening,
            friction: spec.friction(),
            map: spec.surface()?,
        })
    }

    /// The exact shape at contraction ratio `e`.
    ///
    /// # Errors
    /// [`crate::Error::Parameter`] if the muscle cannot have that length.
    pub fn shape(&self, e: f64) -> Result<Shape> {
        self.geometry.solve(e)
    }

    /// Exact coefficients of the force of one muscle at contraction ratio `e`, while contracting.
    ///
    /// # Errors
    /// As [`Muscle::shape`]; [`Error::Model`] for a map, whose force is not linear in pressure.
    pub fn coefficients(&self, e: f64) -> Result<Coefficients> {
        if self.map.is_some() {
            return Err(Error::Model(
                "muscle.model = \"map\" has no coefficients: its force is not linear in pressure"
                    .into(),
            ));
        }
        Ok(self.contracting.coefficients(self.geometry.braid(), &self.shape(e)?))
    }

    /// Number of elastic parameters, see [`Muscle::elastic_basis`].
    #[must_use]
    pub fn order(&self) -> usize {
        self.contracting.order()
    }

    /// Force per unit of each elastic parameter [m2] at contraction ratio `e`, while contracting.
    ///
    /// # Errors
    /// As [`Muscle::shape`].
    pub fn elastic_basis(&self, e: f64) -> Result<Vec<f64>> {
        Ok(self.contracting.basis(self.geometry.braid(), &self.shape(e)?))
    }

    /// Exact force of one muscle [N] at gauge pressure `pressure` [Pa] and contraction ratio `e`,
    /// while contracting, without friction.
    ///
    /// # Errors
    /// [`crate::Error::Parameter`] if the pressure is below vacuum or the muscle cannot have that
    /// length.
    pub fn force(&self, pressure: f64, e: f64) -> Result<f64> {
        check_pressure(pressure)?;
        let scale = self.spec.elastic_scale();
        if let Some(map) = &self.map {
            self.shape(e)?;
            return Ok(scale * map.force(pressure, e));
        }
        Ok(self.coefficients(e)?.force(pressure, scale))
    }

    /// What the muscle does when it is pushed.
    #[must_use]
    pub fn pushed(&self) -> Pushed {
        match self.spec.buckling_load {
            0.0 => Pushed::Slack,
            load if load < STRUT => Pushed::Bows,
            _ => Pushed::Holds,
        }
    }

    /// The force [N] of a muscle that bows out when it is pushed: a pull as it is, a push up to the
    /// buckling load, reached with a continuous slope at twice that push; without one it is slack.
    #[inline]
    pub fn buckled<S: Scalar>(&self, force: S) -> S {
        let load = self.spec.buckling_load;
        if force.re() >= 0.0 || self.pushed() == Pushed::Holds {
            return force;
        }
        if force.re() <= -2.0 * load {
            return constant(0.0 - load);
        }
        force + force * force / (4.0 * load)
    }

    /// Exact force of one muscle [N] in a direction of motion, from -1 (contracting) to +1
    /// (lengthening), with friction.
    ///
    /// # Errors
    /// As [`Muscle::force`]; [`crate::Error::Parameter`] for a direction outside that range.
    pub fn force_moving(&self, pressure: f64, e: f64, direction: f64) -> Result<f64> {
        check_pressure(pressure)?;
        check_direction(direction)?;
        let (braid, shape, scale) =
            (self.geometry.braid(), self.shape(e)?, self.spec.elastic_scale());
        let force = |branch: &Elasticity| branch.coefficients(braid, &shape).force(pressure, scale);
        let lengthening = self.lengthening.as_ref().map(force);
        let mapped = self.map.as_ref().map_or(0.0, |map| scale * map.force(pressure, e));
        Ok(moving(
            force(&self.contracting) + mapped,
            lengthening,
            self.friction,
            pressure,
            direction,
        ))
    }
}

/// What a muscle does when it is pushed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pushed {
    /// It carries nothing.
    Slack,
    /// It bows out, and carries some newtons.
    Bows,
    /// It pushes back like a strut, as its force model says.
    Holds,
}

/// One muscle compiled for the integrator.
#[derive(Debug, Clone)]
pub struct CompiledMuscle {
    /// The exact muscle.
    pub exact: Muscle,
    /// Force coefficients and volume over contraction, of the contracting branch.
    pub table: Table,
    /// The same of the lengthening branch, where the model has one.
    lengthening: Option<Table>,
}

impl CompiledMuscle {
    /// Compiles the tables of a muscle.
    ///
    /// # Errors
    /// [`crate::Error::Model`] if a table cannot reach its error bound.
    pub fn new(exact: Muscle) -> Result<Self> {
        let table = Table::compile(&exact.geometry, &exact.contracting)?;
        let branch = exact.lengthening.as_ref();
        let lengthening = branch.map(|b| Table::compile(&exact.geometry, b)).transpose()?;
        Ok(Self { exact, table, lengthening })
    }

    /// The same tables with other values of what they do not depend on, if that is all that
    /// changes.
    #[must_use]
    pub fn respecified(&self, spec: &MuscleSpec) -> Option<Self> {
        if self.exact.spec.tabulated() != spec.tabulated() {
            return None;
        }
        let exact = Muscle { spec: spec.clone(), friction: spec.friction(), ..self.exact.clone() };
        Some(Self { exact, ..self.clone() })
    }

    /// Whether the direction of motion has an influence on the force.
    #[must_use]
    pub fn has_direction(&self) -> bool {
        self.lengthening.is_some() || self.exact.friction.is_some()
    }

    /// Whether the force is a map's, and not the table's.
    #[must_use]
    pub fn mapped(&self) -> bool {
        self.exact.map.is_some()
    }

    /// Force of one muscle [N] while contracting, without friction; `table` is its point at `e`.
    #[inline]
    pub fn pull<S: Scalar>(&self, table: &TablePoint<S>, pressure: S, e: S, scale: S) -> S {
        match &self.exact.map {
            None => table.force(pressure, scale),
            Some(map) => scale * map.force(pressure, e),
        }
    }

    /// Share of the bladder in that force [N]; of a map what it has without pressure.
    #[inline]
    pub fn bladder<S: Scalar>(&self, table: &TablePoint<S>, pressure: S, e: S, scale: S) -> S {
        match &self.exact.map {
            None => scale * (pressure * table.a_elastic + table.b_elastic),
            Some(map) => scale * map.force(constant(0.0), e),
        }
    }

    /// What the muscle does when it is pushed.
    #[must_use]
    pub fn pushed(&self) -> Pushed {
        self.exact.pushed()
    }

    /// As [`Muscle::buckled`].
    #[inline]
    pub fn buckled<S: Scalar>(&self, force: S) -> S {
        self.exact.buckled(force)
    }

    /// The presliding distance [m] over which the direction changes.
    #[must_use]
    pub fn presliding(&self) -> f64 {
        self.exact.spec.friction_presliding
    }

    /// Adds what the direction of motion, -1 to +1, does to the force [N] of the contracting
    /// branch.
    #[inline]
    pub fn moving<S: Scalar>(
        &self,
        force: S,
        e: S,
        pressure: S,
        modulus_scale: S,
        direction: S,
    ) -> S {
        let lengthening =
            self.lengthening.as_ref().map(|t| t.eval(e).force(pressure, modulus_scale));
        moving(force, lengthening, self.exact.friction, pressure, direction)
    }

    /// Force of one muscle [N] from the table; `direction` as in [`Muscle::force_moving`], none for
    /// the contracting branch without friction.
    ///
    /// # Errors
    /// As [`Muscle::force_moving`], for the table's range of contraction.
    pub fn force(&self, pressure: f64, e: f64, direction: Option<f64>) -> Result<f64> {
        check_pressure(pressure)?;
        let (low, high) = (self.table.e_min, self.table.e_max);
        check_range("muscle.contraction_ratio", e, low, high, "(the table's range)")?;
        let scale = self.exact.spec.elastic_scale();
        let force = self.pull(&self.table.eval(e), pressure, e, scale);
        match direction {
            Some(d) => Ok(self.moving(force, e, pressure, scale, check_direction(d)?)),
            None => Ok(force),
        }
    }
}

/// The force of both branches for one direction of motion, with friction.
fn moving<S: Scalar>(
    contracting: S,
    lengthening: Option<S>,
    friction: Option<Friction>,
    pressure: S,
    direction: S,
) -> S {
    let mean = match lengthening {
        Some(other) => contracting + (other - contracting) * (direction + constant::<S>(1.0)) * 0.5,
        None => contracting,
    };
    friction.map_or(mean, |f| f.applied(mean, pressure, direction))
}

fn check_pressure(pressure: f64) -> Result<f64> {
    check_range("muscle.pressure", pressure, LOWEST_PRESSURE, HIGHEST_PRESSURE, "Pa gauge")
}

fn check_direction(direction: f64) -> Result<f64> {
    check_range("muscle.direction", direction, -1.0, 1.0, "(-1 contracting, +1 lengthening)")
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::dual::Slope;

    pub(crate) fn shoulder() -> MuscleSpec {
        MuscleSpec {
            count: 6,
            modulus_slope: vec![3.0, -0.35, 0.0, 0.0],
            modulus_offset: vec![1.15e6, -0.15e6, 0.0, 0.0],
            ..MuscleSpec::plain("robinson", 0.276, 0.0254, 73.5_f64.to_radians(), 0.003_175)
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
        let geometry = elbow().shape().unwrap();
        assert!((geometry.braid().turns - 1.25).abs() < 5e-3);
        assert!((geometry.braid().fibre_length / 0.0254 - 8.16).abs() < 5e-3);
    }

    #[test]
    fn impossible_parameters_are_named() {
        type Change = fn(&mut MuscleSpec);
        let changes: [(&str, Change); 14] = [
            ("muscle.model", |s| s.model = "spring".into()),
            ("muscle.geometry", |s| s.geometry = Some("sphere".into())),
            ("muscle.count", |s| s.count = 0),
            ("muscle.rest_length", |s| s.rest_length = f64::NAN),
            ("muscle.rest_diameter", |s| s.rest_diameter = -0.01),
            ("muscle.braid_angle", |s| s.braid_angle = 73.5),
            ("muscle.wall_thickness", |s| s.wall_thickness = 0.02),
            ("muscle.modulus_slope", |s| s.modulus_slope.clear()),
            ("muscle.modulus_offset", |s| s.modulus_offset = vec![1.0]),
            ("muscle.modulus_slope[1]", |s| s.modulus_slope[1] = f64::INFINITY),
            ("muscle.c10", |s| s.c10 = 1e5),
            ("muscle.friction_coefficient", |s| s.friction_coefficient = f64::NAN),
            ("muscle.neck_floor", |s| s.neck_floor = 1.5),
            ("muscle.buckling_load", |s| s.buckling_load = -1e-3),
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
            "braid_angle": 1.2, "wall_thickness": 0.001, "modulus_slope": [1.0],
            "modulus_offset": [1e6]"#;
        let spec: MuscleSpec = serde_json::from_str(&format!("{text}}}")).unwrap();
        assert!(spec.validate().is_ok());
        assert!(serde_json::from_str::<MuscleSpec>(&format!("{text}, \"colour\": 1}}")).is_err());
    }

    #[test]
    fn a_muscle_pulls_as_it_does_and_pushes_no_more_than_it_can() {
        let load = 3.5;
        let spec = MuscleSpec { buckling_load: load, ..shoulder() };
        let muscle = CompiledMuscle::new(Muscle::new(&spec).unwrap()).unwrap();
        let strut = MuscleSpec { buckling_load: STRUT, ..shoulder() };
        let strut = CompiledMuscle::new(Muscle::new(&strut).unwrap()).unwrap();
        let slack = CompiledMuscle::new(Muscle::new(&shoulder()).unwrap()).unwrap();
        let kinds = [slack.pushed(), muscle.pushed(), strut.pushed()];
        assert_eq!(kinds, [Pushed::Slack, Pushed::Bows, Pushed::Holds]);
        let mut before = f64::NEG_INFINITY;
        for k in 0..=4000 {
            let force = -10.0 + f64::from(k) * 0.005;
            let (held, straight) = (muscle.buckled(force), strut.buckled(force));
            assert_eq!(straight, force);
            assert_eq!(slack.buckled(force), force.max(0.0));
            assert!(held >= before && held >= -load && held >= force, "{force} N");
            before = held;
            if force >= 0.0 {
                assert_eq!(held, force);
            }
            let slope = muscle.buckled(Slope::new(force, 1.0)).slope();
            let step = 1e-6;
            let change =
                (muscle.buckled(force + step) - muscle.buckled(force - step)) / (2.0 * step);
            assert!((slope - change).abs() < 1e-5, "{force} N: {slope} and {change}");
        }
        assert_eq!(muscle.buckled(-500.0), -load);
    }
}
