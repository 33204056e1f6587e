//! Channels of plants side by side: most are states, the others are what each plant observes.

use super::group::Runs;
use super::num::{Num, Registers};
use crate::plant::{Channel, Memory, Plant, Rig};
use pulp::Simd;

/// How a channel is read.
#[derive(Debug, Clone, PartialEq)]
enum Read {
    /// A state times a sign, and for each plant what is added.
    State { place: usize, sign: f64, more: Vec<f64> },
    /// Not a state: what the plant observes.
    Observed(usize),
}

/// The channels that are wanted of some plants.
pub(super) struct Reads {
    reads: Vec<Read>,
    /// Room for one sample of every channel, where some are no states.
    channels: Vec<Vec<f64>>,
    /// Nothing is remembered in lanes.
    memory: Vec<Memory<f64>>,
}

impl Reads {
    /// Channels by number of plants of one structure.
    pub fn new(rig: &Rig, plants: &[&Plant<'_, f64>], wanted: &[usize]) -> Self {
        let reads: Vec<Read> = wanted.iter().map(|k| read(rig, plants, *k)).collect();
        let channels = room(&reads, rig);
        let memory = plants.first().map_or_else(Vec::new, |plant| plant.fresh_memory());
        Self { reads, channels, memory }
    }

    /// Write down every wanted channel of all plants, then the next channel.
    #[inline(always)]
    pub fn write<S: Simd, R: Registers>(
        &mut self,
        state: &[Num<S, R>],
        runs: &mut Runs<'_>,
        out: &mut [f64],
    ) {
        let plants = runs.run_of.len();
        for (out, read) in out.chunks_exact_mut(plants).zip(&self.reads) {
            if let Read::State { place, sign, more } = read {
                let numbers = state[*place].numbers();
                for ((out, number), more) in out.iter_mut().zip(numbers).zip(more) {
                    *out = sign * number + more;
                }
            }
        }
        if self.channels.is_empty() {
            return;
        }
        let mut own = vec![0.0; state.len()];
        for lane in 0..plants {
            for (own, value) in own.iter_mut().zip(state) {
                *own = value.numbers()[lane];
            }
            let stepper = &mut runs.of(lane).stepper;
            self.channels.iter_mut().for_each(Vec::clear);
            stepper.plant.observe(
                &own,
                0.0,
                &self.memory,
                &mut stepper.scratch,
                &mut self.channels,
            );
            for (k, read) in self.reads.iter().enumerate() {
                if let Read::Observed(channel) = read {
                    out[k * plants + lane] = self.channels[*channel][0];
                }
            }
        }
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
        let of = |k: &usize| match rig.lanes() {
            Some(_) => read(rig, &[plant], *k),
            None => Read::Observed(*k),
        };
        let reads: Vec<Read> = wanted.iter().map(of).collect();
        Self { all: room(&reads, rig), reads }
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

/// Room for one sample of every channel, where some that are read are no states.
fn room(reads: &[Read], rig: &Rig) -> Vec<Vec<f64>> {
    let observes = reads.iter().any(|read| matches!(read, Read::Observed(_)));
    vec![Vec::new(); if observes { rig.names().channels.len() } else { 0 }]
}

/// Whether a channel is of the masses or of the sums of the balance.
pub(crate) fn needs_sums(rig: &Rig, channel: usize) -> bool {
    let (_, channel) = &rig.names().channels[channel];
    matches!(channel, Channel::Mass(_) | Channel::Balance(_) | Channel::Temperature(_))
}

/// How a channel of these plants is read.
fn read(rig: &Rig, plants: &[&Plant<'_, f64>], channel: usize) -> Read {
    let (layout, wiring) = (&rig.layout, &rig.wiring);
    let ambient = rig.gas.ambient_pressure;
    let state = |place: usize, sign: f64, more: &dyn Fn(&Plant<'_, f64>) -> f64| Read::State {
        place,
        sign,
        more: plants.iter().map(|plant| more(plant)).collect(),
    };
    let angle_zero =
        |k: usize, p: &Plant<'_, f64>| wiring.coordinates[k].zero.map_or(0.0, |id| p.values[id]);
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
        _ => Read::Observed(channel),
    }
}
