//! Where each state and channel of a rig is, and what it is called.

use super::units::{Node, WaveUnit};
use super::wired::Wiring;
use crate::description::{coordinate_names, dotted, RigSpec};
use crate::effects::Role;
use crate::{Error, Result};

/// Number of sums that are kept beside the states: see [`BALANCE`].
pub const BALANCE_COUNT: usize = 6;

/// Channels of the sums over a simulation, in their order: mass out of the supplies and into the
/// ambient, what regulators relieve included [kg]; energy `R T m` and exergy `R T ln(p/p_a) m` of
/// what the supplies gave, work of the muscles, positive work at the joints [J].
pub const BALANCE: [&str; BALANCE_COUNT] = [
    "mass_supplied",
    "mass_vented",
    "energy_supplied",
    "exergy_supplied",
    "muscle_work",
    "joint_work",
];

/// Channels of further sums where chambers have an energy balance, over all of these: enthalpy that
/// flows brought (less what they took), heat from the walls, work of the gas [J]. Their internal
/// energy `p V/(kappa - 1)` grows by the first two less the third.
pub const HEAT_BALANCE: [&str; 3] = ["enthalpy_gained", "heat_gained", "gas_work"];

/// Places of the states: supplies' pressures, gases' pressures, gases' masses, flows in tubes,
/// coordinates, their rates, what effects need.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Supplies.
    pub supplies: usize,
    /// Chambers and, behind them, inlets of lines and what lies inside tubes.
    pub gases: usize,
    /// Flows with inertia, in tubes that carry waves.
    pub flows: usize,
    /// Joints, or one for a linear load.
    pub coordinates: usize,
    /// Chambers among the gases.
    pub chambers: usize,
    /// States of effects, behind the motion.
    pub effects: usize,
    /// Sums of the balance: those of [`BALANCE`], and of [`HEAT_BALANCE`] where they are kept.
    pub sums: usize,
}

impl Layout {
    /// States without the sums of the balance.
    #[inline]
    #[must_use]
    pub fn states(&self) -> usize {
        self.effect(0) + self.effects
    }

    /// A state of an effect; the first one is where the motion ends.
    #[inline]
    #[must_use]
    pub fn effect(&self, k: usize) -> usize {
        self.rate(self.coordinates) + k
    }

    /// Absolute pressure of a supply [Pa].
    #[inline]
    #[must_use]
    pub fn supply(&self, k: usize) -> usize {
        k
    }

    /// Absolute pressure of a gas [Pa].
    #[inline]
    #[must_use]
    pub fn pressure(&self, k: usize) -> usize {
        self.supplies + k
    }

    /// Mass of a gas [kg].
    #[inline]
    #[must_use]
    pub fn mass(&self, k: usize) -> usize {
        self.supplies + self.gases + k
    }

    /// Mass flow in a tube [kg/s].
    #[inline]
    #[must_use]
    pub fn flow(&self, k: usize) -> usize {
        self.supplies + 2 * self.gases + k
    }

    /// Joint angle [rad], or shortening of a linear load [m].
    #[inline]
    #[must_use]
    pub fn angle(&self, k: usize) -> usize {
        self.flow(self.flows) + k
    }

    /// Its rate.
    #[inline]
    #[must_use]
    pub fn rate(&self, k: usize) -> usize {
        self.angle(self.coordinates) + k
    }

    /// A sum of [`BALANCE`].
    #[inline]
    #[must_use]
    pub fn balance(&self, k: usize) -> usize {
        self.states() + k
    }
}

impl Node {
    /// Place of its pressure among the states.
    pub fn place(self, layout: &Layout) -> Option<usize> {
        match self {
            Self::Ambient => None,
            Self::Supply(k) => Some(layout.supply(k)),
            Self::Gas(k) => Some(layout.pressure(k)),
        }
    }
}

/// What a number of a simulation's state is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StateRole {
    /// Absolute pressure of a supply or a gas [Pa].
    Pressure,
    /// Mass of a gas [kg].
    Mass,
    /// The same, of a gas whose temperature is free: a state of its own.
    FreeMass,
    /// Mass flow in a tube [kg/s].
    Flow,
    /// Joint angle [rad], or shortening of a linear load [m].
    Position,
    /// Its rate.
    Rate,
    /// State of an effect.
    Effect(Role),
    /// Sum of the mass and energy balance.
    Balance,
    /// What a muscle's own friction remembers of its motion.
    Memory,
    /// A condition that an event ends.
    Flag,
    /// Samples since the start.
    Samples,
}

impl StateRole {
    /// Name, public API.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pressure => "pressure",
            Self::Mass => "mass",
            Self::FreeMass => "free_mass",
            Self::Flow => "flow",
            Self::Position => "position",
            Self::Rate => "rate",
            Self::Effect(Role::Moves) => "effect_moves",
            Self::Effect(Role::Opens) => "effect_opens",
            Self::Effect(Role::Follows) => "effect_follows",
            Self::Effect(Role::Begun) => "effect_begun",
            Self::Effect(Role::Keeps) => "effect_keeps",
            Self::Balance => "balance",
            Self::Memory => "memory",
            Self::Flag => "flag",
            Self::Samples => "samples",
        }
    }
}

/// One number of a simulation's state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StatePlace {
    /// A channel, an effect's state (`input_path_lag.lag.flexor`), or what it belongs to.
    pub name: String,
    /// What it is.
    pub role: StateRole,
}

/// What a simulated channel shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Gauge pressure of a supply [Pa].
    Supply(usize),
    /// Gauge pressure of a gas as its sensor reads it [Pa].
    Pressure(usize),
    /// Joint angle as its sensor reads it [rad].
    Angle(usize),
    /// Joint rate [rad/s].
    Rate(usize),
    /// Length of the muscle on a linear load [m].
    Length,
    /// Its rate [m/s].
    LengthRate,
    /// Contraction ratio of a group [1].
    Contraction(usize),
    /// Force of all muscles of a group [N].
    Force(usize),
    /// Torque of all muscles on a joint [N m].
    Torque(usize),
    /// Volume of a chamber [m3].
    Volume(usize),
    /// Temperature of a chamber's gas [K].
    Temperature(usize),
    /// Mass of a gas [kg].
    Mass(usize),
    /// Mass flow in a tube [kg/s].
    Flow(usize),
    /// One of [`BALANCE`].
    Balance(usize),
}

/// Names of everything that can be set, read or driven.
#[derive(Debug, Clone)]
pub struct Names {
    /// Simulated channels.
    pub channels: Vec<(String, Channel)>,
    /// States that an initial value can be given for, pressures gauge; with the place of each.
    pub initial: Vec<(String, usize)>,
    /// Commands that a simulation takes: of the valves, then of the regulators.
    pub inputs: Vec<String>,
    /// Names of the gases: `chamber.flexor`, `line.flexor` for all that is in this line.
    pub gases: Vec<String>,
    /// Names of the coordinates: `joint.elbow`, or `load`.
    pub coordinates: Vec<String>,
}

impl Names {
    /// Number of a channel.
    ///
    /// # Errors
    /// [`Error::Model`] for an unknown name; it lists those that there are.
    pub fn channel(&self, name: &str) -> Result<usize> {
        self.channels.iter().position(|(known, _)| known == name).ok_or_else(|| {
            let known: Vec<_> = self.channels.iter().map(|(known, _)| known.as_str()).collect();
            Error::Model(format!("'{name}' is not a channel; there are: {}", known.join(", ")))
        })
    }

    /// The names of a rig.
    pub(crate) fn new(spec: &RigSpec, wiring: &Wiring, layout: &Layout) -> Self {
        let joints = coordinate_names(spec);
        let regulators = spec.supplies.iter().filter(|s| s.kind == "regulator");
        let chambers = spec.chambers.iter().map(|c| dotted("chamber", &c.name));
        let inside = wiring.lines_of_gases().map(|line| dotted("line", &spec.lines[line].name));
        Self {
            channels: channels(spec, wiring, &joints, layout.sums),
            initial: initial(spec, wiring, layout, &joints),
            inputs: (spec.valves.iter().map(|v| dotted("valve_command", &v.name)))
                .chain(regulators.map(|s| dotted("supply_command", &s.name)))
                .collect(),
            gases: chambers.chain(inside).collect(),
            coordinates: if spec.load.is_some() {
                vec!["load".into()]
            } else {
                joints.iter().map(|n| dotted("joint", n)).collect()
            },
        }
    }
}

/// Every simulated channel of a rig, in the order of its columns.
fn channels(
    spec: &RigSpec,
    wiring: &Wiring,
    joints: &[String],
    sums: usize,
) -> Vec<(String, Channel)> {
    let mut found = Vec::new();
    let mut add = |kind: &str, name: &str, channel| found.push((dotted(kind, name), channel));
    let inlets = wiring.inlets.iter().map(|(line, _)| spec.lines[*line].name.as_str());
    for (k, supply) in spec.supplies.iter().enumerate() {
        add("supply_pressure", &supply.name, Channel::Supply(k));
    }
    for (k, chamber) in spec.chambers.iter().enumerate() {
        add("muscle_pressure", &chamber.name, Channel::Pressure(k));
    }
    for (k, name) in inlets.clone().enumerate() {
        add("line_pressure", name, Channel::Pressure(wiring.chambers + k));
    }
    for (k, name) in segments(spec, wiring, 1) {
        add("segment_pressure", &name, Channel::Pressure(k));
    }
    for (k, name) in segments(spec, wiring, 0) {
        add("segment_flow", &name, Channel::Flow(k));
    }
    for (k, name) in joints.iter().enumerate() {
        add("joint_angle", name, Channel::Angle(k));
    }
    for (k, name) in joints.iter().enumerate() {
        add("joint_rate", name, Channel::Rate(k));
    }
    if spec.load.is_some() {
        add("length", "", Channel::Length);
        add("length_rate", "", Channel::LengthRate);
    }
    for (k, group) in spec.muscles.iter().enumerate() {
        add("contraction_ratio", &group.name, Channel::Contraction(k));
    }
    for (k, group) in spec.muscles.iter().enumerate() {
        add("muscle_force", &group.name, Channel::Force(k));
    }
    for (k, name) in joints.iter().enumerate() {
        add("joint_torque", name, Channel::Torque(k));
    }
    for (k, chamber) in spec.chambers.iter().enumerate() {
        add("air_volume", &chamber.name, Channel::Volume(k));
    }
    for (k, chamber) in spec.chambers.iter().enumerate() {
        add("temperature", &chamber.name, Channel::Temperature(k));
    }
    for (k, chamber) in spec.chambers.iter().enumerate() {
        add("air_mass", &chamber.name, Channel::Mass(k));
    }
    for (k, name) in inlets.enumerate() {
        add("line_mass", name, Channel::Mass(wiring.chambers + k));
    }
    for (k, name) in segments(spec, wiring, 1) {
        add("segment_mass", &name, Channel::Mass(k));
    }
    for (k, name) in BALANCE.iter().chain(&HEAT_BALANCE).take(sums).enumerate() {
        add(name, "", Channel::Balance(k));
    }
    found
}

/// What lies between the segments of the tubes (`less` 1: the gases), or flows through them (`less` 0),
/// with its name: of the line, and the number of the segment in front of it.
fn segments(spec: &RigSpec, wiring: &Wiring, less: usize) -> Vec<(usize, String)> {
    let of = |wave: &WaveUnit| {
        let first = if less == 0 { wave.flow } else { wave.gas };
        let name = &spec.lines[wave.line].name;
        let full = |k: usize| if name.is_empty() { k.to_string() } else { format!("{name}.{k}") };
        (0..wave.segments - less).map(|k| (first + k, full(k + 1))).collect::<Vec<_>>()
    };
    wiring.waves.iter().flat_map(of).collect()
}

/// States that an initial value can be given for, with the place of each.
fn initial(
    spec: &RigSpec,
    wiring: &Wiring,
    layout: &Layout,
    joints: &[String],
) -> Vec<(String, usize)> {
    let mut found = Vec::new();
    let mut add = |kind: &str, name: &str, place| found.push((dotted(kind, name), place));
    for (k, supply) in spec.supplies.iter().enumerate() {
        add("supply_pressure", &supply.name, layout.supply(k));
    }
    for (k, chamber) in spec.chambers.iter().enumerate() {
        add("muscle_pressure", &chamber.name, layout.pressure(k));
    }
    for (k, (line, _)) in wiring.inlets.iter().enumerate() {
        add("line_pressure", &spec.lines[*line].name, layout.pressure(wiring.chambers + k));
    }
    for (k, name) in segments(spec, wiring, 1) {
        add("segment_pressure", &name, layout.pressure(k));
    }
    for (k, name) in segments(spec, wiring, 0) {
        add("segment_flow", &name, layout.flow(k));
    }
    for (k, name) in joints.iter().enumerate() {
        add("joint_angle", name, layout.angle(k));
        add("joint_rate", name, layout.rate(k));
    }
    if spec.load.is_some() {
        add("length", "", layout.angle(0));
        add("length_rate", "", layout.rate(0));
    }
    found
}
