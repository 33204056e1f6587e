//! A rig: blocks joined by ports, described by data, composed into one state equation.

mod air;
mod between;
mod body;
mod check;
pub mod layout;
pub mod memory;
mod motion;
pub mod parameters;
pub mod plant;
mod pull;
pub mod spec;
mod units;
mod units_effects;
mod wiring;
mod wiring_effects;
mod wiring_motion;

pub use layout::{Channel, Layout, Names};
pub use memory::Memory;
pub use parameters::{ParameterId, Parameters, Values};
pub use plant::Plant;
pub use spec::RigSpec;

use self::units::{Group, Wiring};
use crate::effects::input_path_lag;
use crate::gas::orifice::Gas;
use crate::joint::Joint;
use crate::muscle::CompiledMuscle;
use crate::{Error, Result};
use spec::dotted;

/// Of the 2.78 that the Runge-Kutta method bears on the negative real axis.
const STABLE: f64 = 2.0;
/// The least step that a rig may need [s].
const LEAST_STEP: f64 = 1e-7;

/// A rig ready to be simulated: muscles compiled to a table, ports resolved. Immutable.
#[derive(Debug, Clone)]
pub struct Rig {
    spec: RigSpec,
    pub(crate) gas: Gas,
    pub(crate) wiring: Wiring,
    pub(crate) layout: Layout,
    pub(crate) names: Names,
    stable_step: f64,
}

impl Rig {
    /// Compile a rig from its description.
    ///
    /// # Errors
    /// As [`RigSpec::validate`]; [`Error::Model`] for blocks that do not fit together, an unknown effect or effect parameter,
    /// or a volume too small for its openings.
    pub fn new(spec: RigSpec) -> Result<Self> {
        Self::with_groups(spec, &[])
    }

    fn with_groups(spec: RigSpec, known: &[Group]) -> Result<Self> {
        spec.validate()?;
        let g = &spec.gas;
        let gas = Gas::new(g.ambient_pressure, g.temperature, g.gas_constant, g.heat_capacity_ratio);
        let wiring = Wiring::new(&spec, known)?;
        let layout = Layout {
            supplies: wiring.supplies.len(),
            gases: wiring.gases.len(),
            coordinates: wiring.coordinates.len(),
            chambers: wiring.chambers,
            extras: wiring.extras,
        };
        let names = Names::new(&spec, &wiring, &layout);
        let mut rig = Self { gas, wiring, layout, names, stable_step: f64::INFINITY, spec };
        rig.check_reach()?;
        rig.stable_step = rig.find_step()?;
        Ok(rig)
    }

    /// Every joint's and load's whole range must be within the reach of the tendons and of the muscles' tables.
    fn check_reach(&self) -> Result<()> {
        for (group, spec) in self.wiring.groups.iter().zip(&self.spec.muscles) {
            let table = &group.muscle.table;
            let joint = &self.names.coordinates[group.coordinate];
            if let Some(load) = &self.spec.load {
                for (name, length) in
                    [("load.min_length", load.min_length), ("load.max_length", load.max_length)]
                {
                    if !table.contains(1.0 - length / group.rest_length) {
                        let (short, long) = (
                            group.rest_length * (1.0 - table.e_max),
                            group.rest_length * (1.0 - table.e_min),
                        );
                        let allowed =
                            format!("a length that the muscle can have, from {short:.5} to {long:.5} m");
                        return Err(Error::parameter(name, length, allowed));
                    }
                }
                continue;
            }
            let Some(stops) = self.wiring.coordinates[group.coordinate].stops else { continue };
            let of = if spec.name.is_empty() {
                String::new()
            } else {
                format!(" of {}", dotted("muscle", &spec.name))
            };
            for (key, angle) in [("min_angle", stops.min_angle), ("max_angle", stops.max_angle)] {
                let name = format!("{joint}.{key}");
                if !group.joint.reaches(angle) {
                    let allowed = format!("an angle that the tendon{of} reaches (it is too short)");
                    return Err(Error::parameter(name, angle, allowed));
                }
                let contraction = group.joint.eval(angle).shortening / group.rest_length;
                if !table.contains(contraction) {
                    let (low, high) = (table.e_min, table.e_max);
                    let allowed = format!("an angle that keeps the contraction ratio{of} ({contraction:.4} here) from {low:.4} to {high:.4}");
                    return Err(Error::parameter(name, angle, allowed));
                }
            }
        }
        Ok(())
    }

    /// Contraction ratios of a group over the range of its joint or load.
    pub(crate) fn range(&self, group: &Group) -> (f64, f64) {
        let table = &group.muscle.table;
        let coordinate = &self.wiring.coordinates[group.coordinate];
        let (low, high) = match (coordinate.stops, &self.spec.load) {
            (Some(stops), _) => (stops.min_angle, stops.max_angle),
            (None, Some(load)) => (group.rest_length - load.max_length, group.rest_length - load.min_length),
            (None, None) => (coordinate.rest, coordinate.rest),
        };
        let at =
            |x: f64| (group.joint.eval(x).shortening / group.rest_length).clamp(table.e_min, table.e_max);
        let (a, b) = (at(low), at(high));
        (a.min(b), a.max(b))
    }

    fn find_step(&self) -> Result<f64> {
        let plant = Plant::new(self, self.wiring.parameters.lift::<f64>(), false)?;
        let body = plant.fastest_body();
        if !body.is_finite() {
            return Err(Error::Model(
                "the arm's mass matrix is not positive definite: a link without inertia".into(),
            ));
        }
        let (air, place) = plant.fastest_gas();
        let step = STABLE / air;
        if step < LEAST_STEP {
            let name = place.map_or("a supply", |k| self.names.gases[k].as_str());
            return Err(Error::Model(format!(
                "{name} is too small for what flows through it: a step of {step:.1e} s would be needed, at least {LEAST_STEP:.0e} s \
                 is allowed; it needs {:.1} times its volume",
                LEAST_STEP / step
            )));
        }
        let path = |[lag, delay]: [ParameterId; 2]| {
            input_path_lag::fastest(plant.values()[lag], plant.values()[delay])
        };
        let fastest = air.max(body).max(self.wiring.effects.path.map_or(0.0, path));
        Ok(if fastest > 0.0 { STABLE / fastest } else { f64::INFINITY })
    }

    /// The same rig with other parameter values and effects; a muscle's table is kept when its geometry and moduli are the
    /// same.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn respecified(&self, spec: RigSpec) -> Result<Self> {
        Self::with_groups(spec, &self.wiring.groups)
    }

    /// The description it was made from.
    pub fn spec(&self) -> &RigSpec {
        &self.spec
    }

    /// Longest Runge-Kutta step [s] that openings next to volumes, stops and friction allow; infinite where nothing limits
    /// it.
    pub fn stable_step(&self) -> f64 {
        self.stable_step
    }

    /// Places of its states.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Names of its channels, states and inputs.
    pub fn names(&self) -> &Names {
        &self.names
    }

    /// Names and values of all scalar parameters.
    pub fn parameters(&self) -> &Parameters {
        &self.wiring.parameters
    }

    /// The muscles of a group with their compiled table.
    pub fn muscle(&self, group: usize) -> Option<&CompiledMuscle> {
        self.wiring.groups.get(group).map(|g| &g.muscle)
    }

    /// The transmission of a group.
    pub fn joint(&self, group: usize) -> Option<&Joint> {
        self.wiring.groups.get(group).map(|g| &g.joint)
    }
}
