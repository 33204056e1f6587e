//! A whole rig with its ports resolved.

use super::parameters::ParameterId;
use super::ports::Ports;
use super::units::{
    BodyUnit, Coordinate, GasUnit, Group, LineUnit, Node, SupplyUnit, ValveUnit, WaveUnit,
};

/// A whole rig, resolved.
#[derive(Debug, Clone)]
pub(crate) struct Wiring {
    pub supplies: Vec<SupplyUnit>,
    /// What the gauge of each reads too much.
    pub supply_zeros: Vec<ParameterId>,
    pub gases: Vec<GasUnit>,
    /// The first `chambers` of `gases` are chambers, the next ones inlets of lines, the rest lies
    /// inside tubes.
    pub chambers: usize,
    /// Line and end of line of each inlet.
    pub inlets: Vec<(usize, Node)>,
    /// Tubes that carry waves.
    pub waves: Vec<WaveUnit>,
    pub valves: Vec<ValveUnit>,
    pub lines: Vec<LineUnit>,
    pub groups: Vec<Group>,
    pub coordinates: Vec<Coordinate>,
    /// What a load cell reads for a newton, on a linear load.
    pub force_gain: Option<ParameterId>,
    pub body: BodyUnit,
    /// Effects at the ports of the blocks.
    pub ports: Ports,
}

impl Wiring {
    /// Regulators with a supply in front of them, each with that supply.
    pub fn inlets_of_regulators(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let with = |(k, unit): (usize, &SupplyUnit)| unit.inlet().map(|inlet| (k, inlet));
        self.supplies.iter().enumerate().filter_map(with)
    }

    /// Whether some gas has an energy balance.
    pub fn heated(&self) -> bool {
        self.gases.iter().any(GasUnit::has_energy)
    }

    /// Line of every gas behind the chambers.
    pub fn lines_of_gases(&self) -> impl Iterator<Item = usize> + '_ {
        let inside = self.waves.iter().flat_map(|w| std::iter::repeat_n(w.line, w.segments - 1));
        self.inlets.iter().map(|(line, _)| *line).chain(inside)
    }

    /// Every gas behind the chambers, with the end of its line, at whose pressure it begins.
    pub fn beginnings(&self) -> impl Iterator<Item = (usize, Node)> + '_ {
        let of = |(k, line): (usize, usize)| (self.chambers + k, self.lines[line].to);
        self.lines_of_gases().enumerate().map(of)
    }
}
