//! Which channels of plants in lanes are states, and what is added to each.

use super::plan::Plan;
use crate::plant::{Channel, Plant, Rig};

/// How a channel is read.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Read {
    /// A state times a sign, and for each plant what is added.
    State { place: usize, sign: f64, more: Vec<f64> },
    /// Not a state: what the plant observes.
    Observed(usize),
}

impl Read {
    /// How a channel of these plants is read.
    pub fn of(rig: &Rig, plants: &[&Plant<'_, f64>], channel: usize) -> Self {
        let (layout, wiring) = (&rig.layout, &rig.wiring);
        let ambient = rig.gas.ambient_pressure;
        let state = |place: usize, sign: f64, more: &dyn Fn(&Plant<'_, f64>) -> f64| Self::State {
            place,
            sign,
            more: plants.iter().map(|plant| more(plant)).collect(),
        };
        let angle_zero = |k: usize, p: &Plant<'_, f64>| {
            wiring.coordinates[k].zero.map_or(0.0, |id| p.values[id])
        };
        match rig.names().channels[channel].1 {
            Channel::Supply(k) => {
                state(layout.supply(k), 1.0, &|p| p.values[wiring.supply_zeros[k]] - ambient)
            }
            Channel::Pressure(k) => state(layout.pressure(k), 1.0, &|p| {
                wiring.gases[k].pressure_zero.map_or(0.0, |id| p.values[id]) - ambient
            }),
            Channel::Angle(k) => state(layout.angle(k), 1.0, &|p| angle_zero(k, p)),
            Channel::Rate(k) => state(layout.rate(k), 1.0, &|_| 0.0),
            Channel::Length => {
                state(layout.angle(0), -1.0, &|p| wiring.groups[0].rest_length + angle_zero(0, p))
            }
            Channel::LengthRate => state(layout.rate(0), -1.0, &|_| 0.0),
            Channel::Mass(k) => state(layout.mass(k), 1.0, &|_| 0.0),
            Channel::Balance(k) => state(layout.balance(k), 1.0, &|_| 0.0),
            _ => Self::Observed(channel),
        }
    }

    /// Room for one sample of every channel, where some that are read are no states.
    pub fn room(reads: &[Self], rig: &Rig) -> Vec<Vec<f64>> {
        let observes = reads.iter().any(|read| matches!(read, Self::Observed(_)));
        vec![Vec::new(); if observes { rig.names().channels.len() } else { 0 }]
    }
}

/// The channels that are wanted of one plant.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Wanted {
    reads: Vec<Read>,
    /// Room for one sample of every channel, where some are no states.
    all: Vec<Vec<f64>>,
}

impl Wanted {
    /// Channels by number.
    pub fn new(plant: &Plant<'_, f64>, wanted: &[usize]) -> Self {
        let rig = plant.rig();
        // what effects do to a reading is known to those who observe it
        let of = |k: &usize| match Plan::of(rig) {
            Some(_) => Read::of(rig, &[plant], *k),
            None => Read::Observed(*k),
        };
        let reads: Vec<Read> = wanted.iter().map(of).collect();
        Self { all: Read::room(&reads, rig), reads }
    }

    /// Room for a sample of every channel, which has to be observed first; empty where states are
    /// enough.
    pub fn room(&mut self) -> &mut [Vec<f64>] {
        self.all.iter_mut().for_each(Vec::clear);
        &mut self.all
    }

    /// Append a sample to each channel.
    #[inline]
    pub fn append(&self, state: &[f64], out: &mut [Vec<f64>]) {
        for (read, out) in self.reads.iter().zip(out) {
            out.push(match read {
                Read::State { place, sign, more } => sign * state[*place] + more[0],
                Read::Observed(channel) => self.all[*channel][0],
            });
        }
    }
}

/// Whether a channel is of the masses or of the sums of the balance.
pub(crate) fn needs_sums(rig: &Rig, channel: usize) -> bool {
    let (_, channel) = &rig.names().channels[channel];
    matches!(channel, Channel::Mass(_) | Channel::Balance(_) | Channel::Temperature(_))
}
