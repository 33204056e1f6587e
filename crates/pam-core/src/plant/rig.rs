//! A rig that was compiled: what every part of the plant asks it for.

use super::layout::{Layout, Names, StatePlace, StateRole, BALANCE, HEAT_BALANCE};
use super::memory::Memory;
use super::parameters::Parameters;
use super::units::Group;
use super::wired::Wiring;
use crate::blocks::gas::Gas;
use crate::blocks::joint::Joint;
use crate::description::{dotted, RigSpec};
use crate::effects::EffectInfo;
use crate::muscle::CompiledMuscle;
use std::any::Any;
use std::sync::{Arc, OnceLock};

/// Pressure that a rig is reckoned with where it says of none higher [Pa, gauge].
const USUAL_PRESSURE: f64 = 1e6;

/// A rig ready to be simulated: muscles compiled to a table, ports resolved. Immutable.
#[derive(Debug, Clone)]
pub struct Rig {
    pub(super) spec: Arc<RigSpec>,
    pub(crate) gas: Gas,
    pub(crate) wiring: Arc<Wiring>,
    pub(crate) layout: Layout,
    pub(crate) names: Arc<Names>,
    pub(super) parameters: Parameters,
    /// Effects to choose from.
    pub(super) effects: &'static [&'static EffectInfo],
    pub(super) gas_step: f64,
    /// Whether regulators follow their commands at once, and as fast as their lag lets them.
    pub(super) first_order: bool,
    pub(super) body_step: f64,
    /// What is found of it once, see [`Self::derived`].
    pub(super) derived: Arc<OnceLock<Box<dyn Any + Send + Sync>>>,
}

impl Rig {
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

    /// The description it was made from.
    pub fn spec(&self) -> &RigSpec {
        &self.spec
    }

    /// What a module above finds of the rig whatever the values of its parameters, made when it is
    /// first asked for and kept for all rigs that differ by values only. None where another thing
    /// was asked for before: there is room for one.
    pub(crate) fn derived<T: Any + Send + Sync>(
        &self,
        make: impl FnOnce(&Self) -> T,
    ) -> Option<&T> {
        self.derived.get_or_init(|| Box::new(make(self))).downcast_ref()
    }

    /// Whether regulators follow their commands at once, and as fast as their lag lets them.
    pub(crate) fn first_order(&self) -> bool {
        self.first_order
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
