//! Channels of plants side by side: most are states, the others are what each plant observes.

use super::group::Runs;
use crate::plant::{Memory, Plant, Rig};
use crate::vector::{Num, Read, Registers};
use pulp::Simd;

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
        let reads: Vec<Read> = wanted.iter().map(|k| Read::of(rig, plants, *k)).collect();
        let channels = Read::room(&reads, rig);
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
