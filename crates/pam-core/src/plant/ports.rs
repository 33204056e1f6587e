//! Effects by the ports at which they act, with their states there.

use super::parameters::ParameterId;
use super::units::Node;
use crate::effects::{EffectInfo, Form};

/// An effect that is switched on.
#[derive(Debug, Clone)]
pub(crate) struct Instance {
    pub info: &'static EffectInfo,
    pub form: &'static Form,
    /// Name in front of its parameters: its id, and the block behind a dot where another of its
    /// kind is there.
    pub name: String,
    pub parameters: Vec<ParameterId>,
}

/// An effect at one block: which one, and its states there among those of all effects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Acting {
    pub effect: usize,
    pub first: usize,
    pub count: usize,
}

/// The block that an effect acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Place {
    Supply(usize),
    Valve(usize),
    Line(usize),
    Gas(usize),
    Group(usize),
    Joint(usize),
    /// The arm as a whole, or the clock.
    Whole,
}

/// How gas passes by the valves and lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Flow {
    Leak(Node),
    Clearance(usize),
    Inflow(Node),
}

/// Effects at a group of muscles.
#[derive(Debug, Clone, Default)]
pub(crate) struct MusclePorts {
    /// Any of them.
    pub some: bool,
    pub gauge: Vec<Acting>,
    pub bladder: Vec<Acting>,
    pub force: Vec<Acting>,
    pub give: Option<Acting>,
}

/// Effects by the ports at which they act, in the order in which they act there.
#[derive(Debug, Clone, Default)]
pub(crate) struct Ports {
    pub effects: Vec<Instance>,
    /// Everything that acts somewhere.
    pub all: Vec<(Place, Acting)>,
    /// Of each valve.
    pub command: Vec<Vec<Acting>>,
    pub late: Vec<Vec<Acting>>,
    pub switching: Vec<Option<Acting>>,
    pub area: Vec<Option<Acting>>,
    pub passage: Vec<Option<Acting>>,
    pub flows: Vec<(Flow, Acting)>,
    /// Of each line.
    pub law: Vec<Option<Acting>>,
    /// Of each supply.
    pub feed: Vec<Vec<Acting>>,
    /// Of each gas.
    pub balance: Vec<Option<Acting>>,
    pub reading: Vec<Option<Acting>>,
    pub thermometer: Vec<Option<Acting>>,
    /// Of each gas the first valve with something between it and the gas.
    pub tap: Vec<Option<(usize, Acting)>>,
    /// Of each group of muscles.
    pub muscles: Vec<MusclePorts>,
    /// Of each coordinate.
    pub torque: Vec<Vec<Acting>>,
    pub push: Vec<Vec<Acting>>,
    pub weight: Vec<Vec<Acting>>,
    /// With the link at whose end they act.
    pub payload: Vec<(usize, Acting)>,
    pub hanging: Option<(usize, Acting)>,
    pub mounting: Option<Acting>,
    /// Of each coordinate.
    pub encoder: Vec<Option<Acting>>,
    /// Of each gas.
    pub gauge_zero: Vec<Option<Acting>>,
    pub cell_zero: Option<Acting>,
    pub clock: Vec<Acting>,
    /// States of all effects.
    pub states: usize,
}

impl Ports {
    /// Some effect acts on what supplies are asked for.
    pub fn on_supplies(&self) -> bool {
        self.feed.iter().any(|acting| !acting.is_empty())
    }

    /// Some effect acts on joints, arm or load.
    pub fn on_motion(&self) -> bool {
        let mut on_joints = self.torque.iter().chain(&self.push).chain(&self.weight);
        let joints = on_joints.any(|acting| !acting.is_empty());
        joints || !self.payload.is_empty() || self.hanging.is_some() || self.mounting.is_some()
    }

    /// Some chamber has a balance of its own.
    pub fn on_balance(&self) -> bool {
        self.balance.iter().any(Option::is_some)
    }

    /// Positions of valves move within a sample.
    pub fn moves_valves(&self) -> bool {
        (0..self.command.len()).any(|valve| self.moves_valve(valve))
    }

    /// The position of a valve does.
    pub fn moves_valve(&self, valve: usize) -> bool {
        moves(&self.command[valve]) || self.switching[valve].is_some()
    }

    /// Some valve switches at instants of its own.
    pub fn switches(&self) -> bool {
        self.switching.iter().any(Option::is_some)
    }

    /// Controls are not the same at every stage of a step: moving valves, or a time that an effect
    /// asks for.
    pub fn staged(&self) -> bool {
        let pushed = self.push.iter().any(|acting| !acting.is_empty());
        self.moves_valves() || pushed || !self.payload.is_empty()
    }

    /// Something happens between steps.
    pub fn updates(&self) -> bool {
        let switches = self.feed.iter().any(|acting| moves(acting));
        let mut lagging = self.reading.iter().chain(&self.thermometer);
        let reads = lagging.any(Option::is_some) || self.tap.iter().any(Option::is_some);
        self.moves_valves() || switches || reads
    }

    /// With what balances a gas its mass is a state of its own.
    pub fn frees_mass(&self, gas: usize) -> bool {
        self.balance[gas].is_some_and(|acting| self.effects[acting.effect].info.frees_mass)
    }

    /// What acts on a block and is integrated.
    pub fn integrated(&self) -> impl Iterator<Item = (Place, Acting)> + '_ {
        self.all.iter().copied().filter(|(_, acting)| self.effects[acting.effect].form.integrates)
    }

    /// What remembers the way of a group of muscles.
    pub fn follow_muscles(&self) -> impl Iterator<Item = (usize, Acting)> + '_ {
        self.all.iter().filter_map(|(place, acting)| match place {
            Place::Group(k) if acting.count > 0 && !self.effects[acting.effect].form.integrates => {
                Some((*k, *acting))
            }
            _ => None,
        })
    }
}

/// Whether any of these has states.
pub(crate) fn moves(acting: &[Acting]) -> bool {
    acting.iter().any(|a| a.count > 0)
}
