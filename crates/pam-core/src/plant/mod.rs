//! A rig: blocks joined by ports, described by data, composed into one state equation.

mod air;
mod body;
mod discrete;
mod encoder;
mod kinks;
pub mod layout;
pub mod linear;
pub mod memory;
mod motion;
mod muscle_force;
pub mod parameters;
mod ports;
pub mod rates;
mod stops;
mod switching;
mod tap;
mod units;
mod views;
mod wiring;
mod wiring_motion;

pub(crate) use air::Pressure;
pub(crate) use body::Body as OneBody;
pub use layout::{Channel, Layout, Names, StatePlace, StateRole, BALANCE, HEAT_BALANCE};
pub use linear::{LinearModel, Side};
pub use memory::Memory;
pub use parameters::{ParameterId, Parameters, Values};
pub(crate) use ports::{Acting, Place};
pub(crate) use rates::{Controls, Line, Plant, Scratch, Simulated};
pub(crate) use switching::{Switch, Switches};
pub(crate) use units::{BodyUnit, Group, Node, Passes, Path};

use self::units::Wiring;
use crate::blocks::gas::Gas;
use crate::blocks::joint::Joint;
use crate::description::{dotted, RigSpec};
use crate::effects::{EffectInfo, EFFECTS};
use crate::lanes::Plan;
use crate::muscle::CompiledMuscle;
use crate::{Error, Result};
use std::sync::{Arc, OnceLock};

/// Of the 2.78 that the Runge-Kutta method bears on the negative real axis.
const STABLE: f64 = 2.0;
/// Pressure that a rig is reckoned with where it says of none higher [Pa, gauge].
const USUAL_PRESSURE: f64 = 1e6;
/// Points of a joint's range at which its reach is checked, its ends left out.
const REACH_POINTS: u32 = 64;
/// The least step that a rig may need [s].
const LEAST_STEP: f64 = 1e-7;

/// A rig ready to be simulated: muscles compiled to a table, ports resolved. Immutable.
#[derive(Debug, Clone)]
pub struct Rig {
    spec: Arc<RigSpec>,
    pub(crate) gas: Gas,
    pub(crate) wiring: Arc<Wiring>,
    pub(crate) layout: Layout,
    pub(crate) names: Arc<Names>,
    parameters: Parameters,
    /// Effects to choose from.
    effects: &'static [&'static EffectInfo],
    gas_step: f64,
    /// Whether regulators follow their commands at once, and as fast as their lag lets them.
    first_order: bool,
    body_step: f64,
    /// How it runs in lanes, found when it is first asked for.
    lanes: Arc<OnceLock<Option<Plan>>>,
}

impl Rig {
    /// Compile a rig from its description.
    ///
    /// # Errors
    /// As [`RigSpec::validate`]; [`Error::Model`] for blocks that do not fit together, an unknown
    /// effect or effect parameter, or a volume too small for its openings; [`Error::Parameter`] for
    /// a parameter outside its bounds.
    pub fn new(spec: RigSpec) -> Result<Self> {
        Self::wired(spec, &[], EFFECTS)
    }

    /// As [`Self::new`], with other effects than those of the catalogue to choose from.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_effects(spec: RigSpec, effects: &'static [&'static EffectInfo]) -> Result<Self> {
        Self::wired(spec, &[], effects)
    }

    fn wired(
        spec: RigSpec,
        known: &[Group],
        effects: &'static [&'static EffectInfo],
    ) -> Result<Self> {
        spec.validate()?;
        let g = &spec.gas;
        let gas =
            Gas::new(g.ambient_pressure, g.temperature, g.gas_constant, g.heat_capacity_ratio);
        let (wiring, parameters) = Wiring::new(&spec, known, effects)?;
        let layout = Layout {
            supplies: wiring.supplies.len(),
            gases: wiring.gases.len(),
            flows: wiring.waves.iter().map(|wave| wave.segments).sum(),
            coordinates: wiring.coordinates.len(),
            chambers: wiring.chambers,
            effects: wiring.ports.states,
            sums: BALANCE.len() + if wiring.heated() { HEAT_BALANCE.len() } else { 0 },
        };
        let names = Arc::new(Names::new(&spec, &wiring, &layout));
        let endless = f64::INFINITY;
        let (spec, wiring) = (Arc::new(spec), Arc::new(wiring));
        let mut rig = Self {
            gas,
            wiring,
            layout,
            names,
            parameters,
            effects,
            gas_step: endless,
            first_order: true,
            body_step: endless,
            lanes: Arc::default(),
            spec,
        };
        rig.check_reach()?;
        rig.find_steps()?;
        Ok(rig)
    }

    /// The same rig with other values of its parameters, in the order of [`Parameters::names`]:
    /// nothing is wired again. [`Self::spec`] stays what it was.
    ///
    /// # Errors
    /// As [`Parameters::with_values`], and [`Error::Model`] for values that would need too short a
    /// step.
    pub fn with_values(&self, values: &[f64]) -> Result<Self> {
        let mut rig = self.clone();
        rig.parameters = self.parameters.with_values(values)?;
        rig.find_steps()?;
        Ok(rig)
    }

    /// Every joint's and load's whole range must be within the reach of the tendons and of the
    /// muscles' tables; all that are not are named.
    fn check_reach(&self) -> Result<()> {
        let mut found = Vec::new();
        for (group, spec) in self.wiring.groups.iter().zip(&self.spec.muscles) {
            found.extend(self.beyond_reach(group, &spec.name));
        }
        match found.len() {
            0 => Ok(()),
            1 => Err(found.swap_remove(0)),
            _ => Err(Error::Model(
                found.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "),
            )),
        }
    }

    fn beyond_reach(&self, group: &Group, name: &str) -> Option<Error> {
        let table = &group.muscle.table;
        if let Some(load) = &self.spec.load {
            let ends = [("load.min_length", load.min_length), ("load.max_length", load.max_length)];
            let (short, long) =
                (group.rest_length * (1.0 - table.e_max), group.rest_length * (1.0 - table.e_min));
            let outside = ends
                .iter()
                .find(|(_, length)| !table.contains(1.0 - length / group.rest_length))?;
            let allowed =
                format!("a length that the muscle can have, from {short:.5} to {long:.5} m");
            return Some(Error::parameter(outside.0, outside.1, allowed));
        }
        let joint = &self.names.coordinates[group.coordinate];
        let stops = self.wiring.coordinates[group.coordinate].stops?;
        let of =
            if name.is_empty() { String::new() } else { format!(" of {}", dotted("muscle", name)) };
        // The ends first: they are numbers of the file. A joint may leave the muscle's range
        // between them, too.
        let ends = [("min_angle", stops.min_angle), ("max_angle", stops.max_angle)];
        let inside = (1..REACH_POINTS).map(|i| {
            (
                "an angle inside the range of",
                stops.min_angle
                    + (stops.max_angle - stops.min_angle) * f64::from(i) / f64::from(REACH_POINTS),
            )
        });
        for (key, angle) in ends.into_iter().chain(inside) {
            let full =
                if key.contains(' ') { format!("{key} {joint}") } else { format!("{joint}.{key}") };
            if !group.joint.reaches(angle) {
                let allowed = format!("an angle that the tendon{of} reaches (it is too short)");
                return Some(Error::parameter(full, angle, allowed));
            }
            let contraction = group.joint.eval(angle).shortening / group.rest_length;
            if !table.contains(contraction) {
                let (low, high) = (table.e_min, table.e_max);
                let allowed = format!(
                    "an angle that keeps the contraction ratio{of} \
                    ({contraction:.4} here) from {low:.4} to {high:.4}"
                );
                return Some(Error::parameter(full, angle, allowed));
            }
        }
        None
    }

    /// Contraction ratios of a group over the range of its joint or load.
    pub(crate) fn range(&self, group: &Group) -> (f64, f64) {
        let table = &group.muscle.table;
        let (low, high) = self.angles(group);
        let at = |x: f64| {
            (group.joint.eval(x).shortening / group.rest_length).clamp(table.e_min, table.e_max)
        };
        let (a, b) = (at(low), at(high));
        (a.min(b), a.max(b))
    }

    /// Range of a group's joint [rad], or of the shortening of its load [m].
    pub(crate) fn angles(&self, group: &Group) -> (f64, f64) {
        let coordinate = &self.wiring.coordinates[group.coordinate];
        match (coordinate.stops, &self.spec.load) {
            (Some(stops), _) => (stops.min_angle, stops.max_angle),
            (None, Some(load)) => {
                (group.rest_length - load.max_length, group.rest_length - load.min_length)
            }
            (None, None) => (coordinate.rest, coordinate.rest),
        }
    }

    /// Highest absolute pressure that is to be reckoned with [Pa]: of the supplies and chambers as
    /// they begin, 10 bar at least.
    pub(crate) fn highest_pressure(&self) -> f64 {
        let supplies = self.spec.supplies.iter().map(|s| s.initial_pressure);
        let chambers = self.spec.chambers.iter().map(|c| c.initial_pressure);
        supplies.chain(chambers).fold(USUAL_PRESSURE, f64::max) + self.gas.ambient_pressure
    }

    /// Find the longest stable steps; refuses values that together are not possible.
    fn find_steps(&mut self) -> Result<()> {
        let plant = Plant::new(self, self.parameters.lift::<f64>(), false)?;
        plant.check_masses()?;
        plant.check_moduli()?;
        let steps = self.stable_steps(&plant)?;
        let first_order = plant.first_order();
        (self.gas_step, self.body_step) = steps;
        self.first_order = first_order;
        Ok(())
    }

    fn stable_steps(&self, plant: &Plant<'_, f64>) -> Result<(f64, f64)> {
        let body = plant.fastest_body();
        if !body.is_finite() {
            return Err(Error::Model(
                "the arm's mass matrix is not positive definite: a link without inertia".into(),
            ));
        }
        let needed = |step: f64| {
            format!(
                "a step of {step:.1e} s would be needed, at least {LEAST_STEP:.0e} s is allowed"
            )
        };
        if let Some((wave, line)) = plant.fastest_wave() {
            if STABLE / wave < LEAST_STEP {
                let line = &self.spec.lines[line];
                let (name, segments) = (dotted("line", &line.name), line.segments);
                return Err(Error::Model(format!(
                    "{name} is too short for {segments} segments: {}",
                    needed(STABLE / wave)
                )));
            }
        }
        let (air, place) = plant.fastest_air(|_| true);
        if STABLE / body < LEAST_STEP {
            return Err(Error::Model(format!(
                "what moves is too light, or too strongly damped or held, for its inertia: {}",
                needed(STABLE / body)
            )));
        }
        let step = STABLE / air;
        if step < LEAST_STEP {
            return Err(Error::Model(match place {
                Some(k) => format!(
                    "{} is too small for what flows through it: {}; it needs {:.1} times its \
                        volume",
                    self.names.gases[k],
                    needed(step),
                    LEAST_STEP / step
                ),
                None => {
                    format!("a supply answers too fast to what flows out of it: {}", needed(step))
                }
            }));
        }
        Ok((step.min(STABLE / plant.fastest_command()), STABLE / body))
    }

    /// The same rig with other parameter values and effects; a muscle's table is kept when its
    /// geometry and moduli are the same.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn respecified(&self, spec: RigSpec) -> Result<Self> {
        Self::wired(spec, &self.wiring.groups, self.effects)
    }

    /// The description it was made from.
    pub fn spec(&self) -> &RigSpec {
        &self.spec
    }

    /// How the rig runs in lanes, None where it cannot: whatever the values of its parameters,
    /// dead times and limits of regulators apart.
    pub(crate) fn lanes(&self) -> Option<&Plan> {
        self.lanes.get_or_init(|| Plan::new(self)).as_ref().filter(|_| self.first_order)
    }

    /// Longest Runge-Kutta step [s] that openings next to volumes, stops, springs and friction
    /// allow; infinite where nothing limits it.
    pub fn stable_step(&self) -> f64 {
        self.gas_step.min(self.body_step)
    }

    /// The same for the gas alone, while the motion is driven.
    pub fn gas_step(&self) -> f64 {
        self.gas_step
    }

    /// The same for some pressures alone, while the others are driven.
    pub(crate) fn air_step(&self, moves: impl Fn(Node) -> bool) -> Result<f64> {
        let plant = Plant::new(self, self.parameters.lift::<f64>(), false)?;
        let (rate, _) = plant.fastest_air(moves);
        Ok(STABLE / rate.max(plant.fastest_command()))
    }

    /// The same for the motion alone, while the pressures are driven.
    pub fn body_step(&self) -> f64 {
        self.body_step
    }

    /// Places of its states.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Names of its channels, states and inputs.
    pub fn names(&self) -> &Names {
        &self.names
    }

    /// What each number of a simulation's state is, in the order of
    /// [`crate::simulate::Progress::to_vec`] at the start.
    pub fn state_map(&self) -> Vec<StatePlace> {
        let (layout, wiring) = (&self.layout, &self.wiring);
        let mut places: Vec<StatePlace> = Vec::new();
        let mut add = |name: &str, role| places.push(StatePlace { name: name.into(), role });
        let named = |place: usize| {
            self.names
                .initial
                .iter()
                .find(|(_, p)| *p == place)
                .map_or("", |(name, _)| name.as_str())
        };
        for place in layout.supply(0)..layout.mass(0) {
            add(named(place), StateRole::Pressure);
        }
        for (k, gas) in self.names.gases.iter().enumerate() {
            let free = wiring.ports.frees_mass(k) || wiring.gases[k].has_energy();
            add(gas, if free { StateRole::FreeMass } else { StateRole::Mass });
        }
        for place in layout.flow(0)..layout.angle(0) {
            add(named(place), StateRole::Flow);
        }
        for place in layout.angle(0)..layout.effect(0) {
            let role = if place < layout.rate(0) { StateRole::Position } else { StateRole::Rate };
            add(named(place), role);
        }
        for (name, role) in wiring.ports.state_names(&self.spec, wiring) {
            add(&name, StateRole::Effect(role));
        }
        for name in BALANCE.iter().chain(&HEAT_BALANCE).take(layout.sums) {
            add(name, StateRole::Balance);
        }
        for muscle in &self.spec.muscles {
            for _ in 0..Memory::<f64>::NUMBERS {
                add(&dotted("muscle", &muscle.name), StateRole::Memory);
            }
        }
        for name in &self.names.coordinates {
            add(name, StateRole::Flag);
            add(name, StateRole::Flag);
        }
        for chamber in self.spec.chambers.iter().map(|c| dotted("chamber", &c.name)) {
            add(&chamber, StateRole::Flag);
            add(&chamber, StateRole::Flag);
        }
        let valves = self.spec.valves.iter().map(|v| dotted("valve", &v.name));
        for name in valves.chain(self.spec.lines.iter().map(|l| dotted("line", &l.name))) {
            add(&name, StateRole::Flag);
        }
        add("samples", StateRole::Samples);
        places
    }

    /// Names and values of all scalar parameters.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
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
