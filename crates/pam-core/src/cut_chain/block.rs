//! The blocks between which a chain is cut, and what each needs measured.

use super::measured::Measured;
use crate::description::dotted;
use crate::plant::{Acting, InputPort, Layout, Node, Place, Rig, Simulated};
use crate::{Error, Result};
use std::ops::Range;

/// A block whose output channel is predicted from its measured neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Block {
    /// Commands and the pressures it feeds to a supply's pressure.
    Supply(usize),
    /// Commands, neighbouring pressures and the angles of its muscles to the pressure of a gas: a
    /// chamber or, behind those, the inlet of a line.
    Chamber(usize),
    /// The same, and the pressure of the chamber itself, to what its thermometer reads.
    Temperature(usize),
    /// The pressures at both ends of what feeds a chamber, and the commands, to what flows into it.
    Flow(usize),
    /// Chamber pressures to the angle of a joint (muscles, joints and arm), or to the length of the
    /// muscle on a linear load.
    Arm(usize),
    /// Chamber pressures and the measured motion to what the muscles put on a joint (a torque), or
    /// on a linear load (a force).
    Pull(usize),
}

impl Block {
    /// The block of a name: `supply`, `chamber`, `line` (its inlet) or `arm` (`load` of a linear
    /// load), with the name of the supply, chamber, line or joint behind it where it has one
    /// (`chamber.flexor`); `temperature` and `flow` of a chamber and `torque` of a joint in the same way, `force`
    /// of a linear load.
    ///
    /// # Errors
    /// [`Error::Model`] for another name.
    pub fn from_name(rig: &Rig, name: &str) -> Result<Self> {
        let spec = rig.spec();
        let coordinates = &rig.names().coordinates;
        let joints = coordinates.iter().map(|n| n.replacen("joint", "arm", 1));
        let pulls = coordinates
            .iter()
            .map(|n| n.replacen("joint", "torque", 1).replacen("load", "force", 1));
        let blocks = (spec
            .supplies
            .iter()
            .enumerate()
            .map(|(k, s)| (dotted("supply", &s.name), Self::Supply(k))))
        .chain(
            spec.chambers
                .iter()
                .enumerate()
                .map(|(k, c)| (dotted("chamber", &c.name), Self::Chamber(k))),
        )
        .chain(
            spec.chambers
                .iter()
                .enumerate()
                .map(|(k, c)| (dotted("temperature", &c.name), Self::Temperature(k))),
        )
        .chain(
            spec.chambers.iter().enumerate().map(|(k, c)| (dotted("flow", &c.name), Self::Flow(k))),
        )
        .chain(rig.wiring.inlets.iter().enumerate().map(|(k, (line, _))| {
            (dotted("line", &spec.lines[*line].name), Self::Chamber(spec.chambers.len() + k))
        }))
        .chain(joints.enumerate().map(|(k, name)| (name, Self::Arm(k))))
        .chain(pulls.enumerate().map(|(k, name)| (name, Self::Pull(k))));
        let blocks: Vec<_> = blocks.collect();
        blocks.iter().find(|(n, _)| n == name).map(|(_, block)| *block).ok_or_else(|| {
            let names: Vec<_> = blocks.iter().map(|(n, _)| n.as_str()).collect();
            Error::Model(format!("no block '{name}' in this rig; there are: {}", names.join(", ")))
        })
    }

    /// Longest stable step [s] while its neighbours are driven.
    ///
    /// # Errors
    /// [`Error::Parameter`] for an arm whose links are not possible.
    pub fn longest_step(self, rig: &Rig, measured: &Measured<'_>) -> Result<f64> {
        let body = if self.mechanical() { rig.body_step() } else { f64::INFINITY };
        if self.mechanical() && behind_gauges(rig, measured).next().is_none() {
            return Ok(body);
        }
        let simulated = self.simulated(rig, measured);
        let moves = |node: Node| node.place(rig.layout()).is_some_and(|p| simulated.moves(p));
        Ok(rig.air_step(moves)?.min(body))
    }

    /// Where an input that nobody measured enters; None where it would only add to what is read.
    pub(super) fn input(self, layout: &Layout) -> Option<InputPort> {
        match self {
            Self::Supply(k) => Some(InputPort::Flow(Node::Supply(k))),
            Self::Chamber(k) | Self::Temperature(k) if k < layout.gases => {
                Some(InputPort::Flow(Node::Gas(k)))
            }
            Self::Arm(k) => Some(InputPort::Torque(k)),
            _ => None,
        }
    }

    /// Whether muscles and what they move make its output, and not air alone.
    pub(super) fn mechanical(self) -> bool {
        matches!(self, Self::Arm(_) | Self::Pull(_))
    }

    /// The gas whose pressure or temperature it predicts.
    pub(super) fn gas(self) -> Option<usize> {
        match self {
            Self::Chamber(k) | Self::Temperature(k) => Some(k),
            _ => None,
        }
    }

    /// Place of the predicted state, of a temperature and of a flow that of the gas's pressure; none
    /// for what muscles pull, which is no state.
    pub(super) fn output(self, layout: &Layout) -> Option<usize> {
        match self {
            Self::Supply(k) => Some(layout.supply(k)),
            Self::Chamber(k) | Self::Temperature(k) | Self::Flow(k) => Some(layout.pressure(k)),
            Self::Arm(k) => Some(layout.angle(k)),
            Self::Pull(_) => None,
        }
    }

    /// States of the block that a window starts from, in the order of their sensitivities.
    pub(super) fn initial_states(self, layout: &Layout) -> Vec<usize> {
        match self {
            Self::Supply(_) | Self::Chamber(_) | Self::Temperature(_) => {
                self.output(layout).into_iter().collect()
            }
            Self::Arm(_) => (layout.angle(0)..layout.effect(0)).collect(),
            Self::Pull(_) | Self::Flow(_) => Vec::new(),
        }
    }

    /// Number of initial states per window; what a load cell, a torque sensor or a flow meter reads
    /// at rest is one. Of a gas with a thermometer the temperature comes last in the block of its pressure;
    /// in that of its temperature it is the first, what the thermometer is off by the second, and
    /// where a late one stands the third.
    pub fn initial_count(self, rig: &Rig, measured: &Measured<'_>) -> usize {
        match self {
            Self::Pull(_) | Self::Flow(_) => 1,
            Self::Temperature(_) => 3,
            Self::Chamber(k) if measured.thermometer(k).is_some() => 2,
            _ => self.initial_states(rig.layout()).len(),
        }
    }

    /// States that are integrated: the block's, and those inside lines, which nobody measures.
    pub(super) fn simulated(self, rig: &Rig, measured: &Measured<'_>) -> Simulated {
        let layout = rig.layout();
        let mut places = self.initial_states(layout);
        match self {
            Self::Arm(_) => {
                // also what the motion itself moves, a base or a payload on a cord
                let acting = rig.wiring.ports.all.iter().filter(|(at, _)| {
                    matches!(at, Place::Group(_) | Place::Joint(_) | Place::Whole)
                });
                places.extend(acting.flat_map(|(_, acting)| own_states(layout, acting)));
            }
            Self::Chamber(k) | Self::Temperature(k) => {
                places.push(layout.mass(k));
                places.extend(effect_states(rig, Place::Gas(k)));
                places.extend(giving_states(rig));
            }
            Self::Supply(k) => places.extend(effect_states(rig, Place::Supply(k))),
            Self::Flow(_) => {}
            Self::Pull(_) => {
                let groups = 0..rig.wiring.groups.len();
                places.extend(groups.flat_map(|k| effect_states(rig, Place::Group(k))));
            }
        }
        for (gas, _) in behind_gauges(rig, measured) {
            places.extend([layout.pressure(gas), layout.mass(gas)]);
            places.extend(effect_states(rig, Place::Gas(gas)));
            places.extend(giving_states(rig));
        }
        for supply in unread(rig, self, measured) {
            places.push(layout.supply(supply));
            places.extend(effect_states(rig, Place::Supply(supply)));
        }
        if !self.mechanical() {
            places.extend(inlets(layout, measured));
            places.extend(layout.flow(0)..layout.angle(0));
        }
        let simulated = Simulated::only(rig, &places);
        if matches!(self, Self::Pull(_)) {
            simulated.pulling()
        } else {
            simulated
        }
    }
}

/// Integrated states of the effects on a block.
fn effect_states(rig: &Rig, place: Place) -> impl Iterator<Item = usize> + '_ {
    let here = rig.wiring.ports.integrated().filter(move |(at, _)| *at == place);
    here.flat_map(|(_, acting)| own_states(&rig.layout, &acting))
}

/// Integrated states of the effects on muscles with something that gives, by which a gas has the
/// volume that it has.
fn giving_states(rig: &Rig) -> impl Iterator<Item = usize> + '_ {
    let muscles = rig.wiring.ports.muscles.iter().enumerate();
    let giving = muscles.filter(|(_, muscle)| muscle.give.is_some());
    giving.flat_map(|(k, _)| effect_states(rig, Place::Group(k)))
}

/// Places of the states of what acts.
fn own_states(layout: &Layout, acting: &Acting) -> Range<usize> {
    let first = layout.effect(acting.first);
    first..first + acting.count
}

/// Pressures inside lines that were not measured.
fn inlets(layout: &Layout, measured: &Measured<'_>) -> Vec<usize> {
    let inlets = (layout.chambers..layout.gases).map(|k| layout.pressure(k));
    inlets.filter(|place| measured.signal(*place).is_none()).collect()
}

/// Chambers that nobody measured behind gauges: lines without segments alone join them, to what was
/// measured or to the ambient. Each with the place of a pressure there.
pub(super) fn behind_gauges<'a>(
    rig: &'a Rig,
    measured: &'a Measured<'_>,
) -> impl Iterator<Item = (usize, usize)> + 'a {
    let (layout, wiring) = (rig.layout(), &rig.wiring);
    (0..layout.chambers).filter_map(move |gas| {
        let own = Node::Gas(gas);
        let valved = wiring.valves.iter().any(|v| v.to == gas || v.from == own);
        if valved || measured.signal(layout.pressure(gas)).is_some() {
            return None;
        }
        let mut gauge = None;
        for line in wiring.lines.iter().filter(|line| line.from == own || line.to == own) {
            let other = if line.from == own { line.to } else { line.from };
            match other.place(layout) {
                _ if line.segments > 0 => return None,
                Some(place) if measured.signal(place).is_none() => return None,
                place => gauge = gauge.or(place),
            }
        }
        gauge.map(|place| (gas, place))
    })
}

/// Regulators next to a chamber, or behind a supply, whose outlet nobody measured: their command
/// says what it is.
pub(super) fn unread(rig: &Rig, block: Block, measured: &Measured<'_>) -> Vec<usize> {
    if block.mechanical() {
        return Vec::new();
    }
    let spec = &rig.spec().supplies;
    let output = block.output(rig.layout());
    let near = neighbours(rig, block).into_iter().filter(|place| *place < spec.len());
    let unread = near.filter(|place| Some(*place) != output && measured.signal(*place).is_none());
    unread.filter(|place| spec[*place].kind == "regulator").collect()
}

/// Gases that a supply feeds through a valve or a line, by their places.
pub(super) fn fed_by(rig: &Rig, supply: usize) -> Vec<usize> {
    let (layout, wiring) = (rig.layout(), &rig.wiring);
    let valves = wiring.valves.iter().map(|valve| (valve.from, Node::Gas(valve.to)));
    let ways = valves.chain(wiring.lines.iter().map(|line| (line.from, line.to)));
    let own = Node::Supply(supply);
    let other = |(from, to): (Node, Node)| match (from == own, to == own) {
        (true, _) => to.place(layout),
        (_, true) => from.place(layout),
        _ => None,
    };
    ways.filter_map(other).collect()
}

pub(super) fn check(
    rig: &Rig,
    block: Block,
    measured: &Measured<'_>,
    starts: &[usize],
) -> Result<()> {
    let n = measured.samples;
    if starts.first() != Some(&0)
        || starts.windows(2).any(|w| w[1] <= w[0])
        || starts.last().is_some_and(|s| *s >= n)
    {
        let worst = starts.last().copied().unwrap_or(0) as f64;
        return Err(Error::parameter(
            "starts",
            worst,
            format!("sample indices rising from 0, below {n}"),
        ));
    }
    let wanted: usize = measured.knots(starts).iter().sum();
    if let Some(input) = &measured.input {
        if block.input(rig.layout()).is_none() {
            let why = "nothing integrates what acts there";
            return Err(Error::Model(format!("block '{block:?}' has no input: {why}")));
        }
        if !input.heights.is_empty() && input.heights.len() != wanted {
            let (name, found) = ("heights".into(), input.heights.len());
            let why = "one per knot of every window".into();
            return Err(Error::Length { name, found, expected: wanted, why });
        }
    }
    if matches!(block, Block::Arm(_))
        && rig.spec().load.as_ref().is_some_and(|load| load.is_frame())
    {
        return Err(Error::Model(
            "the block load cannot be predicted: a frame holds the length".into(),
        ));
    }
    let mut hidden = inlets(rig.layout(), measured);
    hidden.extend(behind_gauges(rig, measured).map(|(gas, _)| rig.layout().pressure(gas)));
    hidden.extend(unread(rig, block, measured).into_iter().map(|k| rig.layout().supply(k)));
    for place in neighbours(rig, block) {
        if measured.signal(place).is_none() && !hidden.contains(&place) {
            let name = rig
                .names()
                .initial
                .iter()
                .find(|(_, p)| *p == place)
                .map_or("?", |(n, _)| n.as_str());
            return Err(Error::Model(format!(
                "block '{block:?}' cannot be predicted: {name} was not measured"
            )));
        }
    }
    Ok(())
}

/// Places of the states that a block needs measured: its own, every angle, and the pressures next
/// to it.
fn neighbours(rig: &Rig, block: Block) -> Vec<usize> {
    let (layout, wiring) = (rig.layout(), &rig.wiring);
    let mut places: Vec<usize> = (layout.angle(0)..layout.rate(0)).collect();
    let output = block.output(layout);
    places.extend(output);
    if block.mechanical() {
        places.extend(wiring.groups.iter().map(|g| layout.pressure(g.chamber)));
        return places;
    }
    // What regulators behind a supply let through is drawn from it.
    let behind = wiring.inlets_of_regulators().filter(|(_, inlet)| block == Block::Supply(*inlet));
    for (regulator, _) in behind {
        places.push(layout.supply(regulator));
        places.extend(fed_by(rig, regulator));
    }
    let valves = wiring.valves.iter().map(|v| (v.from.place(layout), Some(layout.pressure(v.to))));
    let lines = wiring.lines.iter().map(|l| (l.from.place(layout), l.to.place(layout)));
    for (a, b) in valves.chain(lines) {
        if a == output {
            places.extend(b);
        } else if b == output {
            places.extend(a);
        }
    }
    // The pressure of a constant supply is known without measuring it.
    let constant =
        |place: &usize| rig.spec().supplies.get(*place).is_some_and(|s| s.kind == "constant");
    places.retain(|place| !constant(place));
    places
}
