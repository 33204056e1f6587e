//! Where each state and channel of a rig is, and what it is called.

use super::units::Wiring;
use super::wiring_motion::coordinate_names;
use crate::description::{dotted, RigSpec};
use crate::effects::Role;

/// Number of sums that are kept beside the states: see [`BALANCE`].
pub const BALANCE_COUNT: usize = 6;

/// Channels of the sums over a simulation, in their order: mass out of the supplies and into the ambient, what
/// regulators relieve included [kg]; energy `R T m` and exergy `R T ln(p/p_a) m` of what the supplies gave, work of
/// the muscles, positive work at the joints [J].
pub const BALANCE: [&str; BALANCE_COUNT] =
    ["mass_supplied", "mass_vented", "energy_supplied", "exergy_supplied", "muscle_work", "joint_work"];

/// Places of the states: supplies' pressures, gases' pressures, gases' masses, coordinates, their rates, what effects need.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Supplies.
    pub supplies: usize,
    /// Chambers and, behind them, inlets of lines.
    pub gases: usize,
    /// Joints, or one for a linear load.
    pub coordinates: usize,
    /// Chambers among the gases.
    pub chambers: usize,
    /// States of effects, behind the motion.
    pub effects: usize,
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
        self.supplies + 2 * (self.gases + self.coordinates) + k
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

    /// Joint angle [rad], or shortening of a linear load [m].
    #[inline]
    #[must_use]
    pub fn angle(&self, k: usize) -> usize {
        self.supplies + 2 * self.gases + k
    }

    /// Its rate.
    #[inline]
    #[must_use]
    pub fn rate(&self, k: usize) -> usize {
        self.supplies + 2 * self.gases + self.coordinates + k
    }

    /// A sum of [`BALANCE`].
    #[inline]
    #[must_use]
    pub fn balance(&self, k: usize) -> usize {
        self.states() + k
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
    /// Names of the gases: `chamber.flexor`, `line.flexor`.
    pub gases: Vec<String>,
    /// Names of the coordinates: `joint.elbow`, or `load`.
    pub coordinates: Vec<String>,
}

impl Names {
    /// The names of a rig.
    pub(crate) fn new(spec: &RigSpec, wiring: &Wiring, layout: &Layout) -> Self {
        let joints = coordinate_names(spec);
        let load = spec.load.is_some();
        let (mut channels, mut initial) = (Vec::new(), Vec::new());
        let of = |kind: &str, name: &str| dotted(kind, name);
        for (k, supply) in spec.supplies.iter().enumerate() {
            channels.push((of("supply_pressure", &supply.name), Channel::Supply(k)));
            initial.push((of("supply_pressure", &supply.name), layout.supply(k)));
        }
        let chambers = spec.chambers.iter().map(|c| c.name.as_str());
        let inlets = wiring.inlets.iter().map(|(line, _)| spec.lines[*line].name.as_str());
        for (k, name) in chambers.clone().enumerate() {
            channels.push((of("muscle_pressure", name), Channel::Pressure(k)));
            initial.push((of("muscle_pressure", name), layout.pressure(k)));
        }
        for (k, name) in inlets.clone().enumerate() {
            let gas = wiring.chambers + k;
            channels.push((of("line_pressure", name), Channel::Pressure(gas)));
            initial.push((of("line_pressure", name), layout.pressure(gas)));
        }
        for (k, name) in joints.iter().enumerate() {
            channels.push((of("joint_angle", name), Channel::Angle(k)));
            initial.push((of("joint_angle", name), layout.angle(k)));
            initial.push((of("joint_rate", name), layout.rate(k)));
        }
        for (k, name) in joints.iter().enumerate() {
            channels.push((of("joint_rate", name), Channel::Rate(k)));
        }
        if load {
            channels.push(("length".into(), Channel::Length));
            channels.push(("length_rate".into(), Channel::LengthRate));
            initial.push(("length".into(), layout.angle(0)));
            initial.push(("length_rate".into(), layout.rate(0)));
        }
        for (k, group) in spec.muscles.iter().enumerate() {
            channels.push((of("contraction_ratio", &group.name), Channel::Contraction(k)));
        }
        for (k, group) in spec.muscles.iter().enumerate() {
            channels.push((of("muscle_force", &group.name), Channel::Force(k)));
        }
        for (k, name) in joints.iter().enumerate() {
            channels.push((of("joint_torque", name), Channel::Torque(k)));
        }
        for (k, name) in chambers.clone().enumerate() {
            channels.push((of("air_volume", name), Channel::Volume(k)));
        }
        for (k, name) in chambers.clone().enumerate() {
            channels.push((of("temperature", name), Channel::Temperature(k)));
        }
        for (k, name) in chambers.clone().enumerate() {
            channels.push((of("air_mass", name), Channel::Mass(k)));
        }
        for (k, name) in inlets.clone().enumerate() {
            channels.push((of("line_mass", name), Channel::Mass(wiring.chambers + k)));
        }
        channels
            .extend(BALANCE.iter().enumerate().map(|(k, name)| ((*name).to_string(), Channel::Balance(k))));
        let regulators = spec.supplies.iter().filter(|s| s.kind == "regulator");
        Self {
            channels,
            initial,
            inputs: (spec.valves.iter().map(|v| of("valve_command", &v.name)))
                .chain(regulators.map(|s| of("supply_command", &s.name)))
                .collect(),
            gases: chambers.map(|n| of("chamber", n)).chain(inlets.map(|n| of("line", n))).collect(),
            coordinates: if load {
                vec!["load".into()]
            } else {
                joints.iter().map(|n| of("joint", n)).collect()
            },
        }
    }
}
