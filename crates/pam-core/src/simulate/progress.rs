//! A simulation at a sample: all that its future depends on.

use super::drive::{set_pressure, Drive};
use super::initial::Initial;
use super::stepper::check_state;
use super::timing::Timing;
use super::trajectory::Trajectory;
use crate::clock::late;
use crate::error::check_range;
use crate::plant::{Channel, Controls, LinearModel, Memory, Plant, Rig, Scratch, Side};
use crate::{Error, Result};

/// A running simulation at a sample: all that its future depends on.
#[derive(Debug, Default, PartialEq)]
pub struct Progress {
    pub(super) state: Vec<f64>,
    pub(super) memory: Vec<Memory<f64>>,
    /// Conditions that an event ends, see [`super::events::Watch`].
    pub(super) flags: Vec<bool>,
    pub(super) samples: u64,
    /// Commands and readings of the samples before, newest last, as far back as clocks that are apart
    /// reach.
    pub(super) past: Vec<f64>,
    /// How many of them a sample has: all commands and readings, or none.
    pub(super) kept: usize,
}

impl Clone for Progress {
    fn clone(&self) -> Self {
        let (state, memory) = (self.state.clone(), self.memory.clone());
        let (flags, past) = (self.flags.clone(), self.past.clone());
        Self { state, memory, flags, past, ..*self }
    }

    /// Without new memory: what every sample begins with.
    fn clone_from(&mut self, other: &Self) {
        let Self { state, memory, flags, samples, past, kept } = self;
        state.clone_from(&other.state);
        memory.clone_from(&other.memory);
        flags.clone_from(&other.flags);
        past.clone_from(&other.past);
        (*samples, *kept) = (other.samples, other.kept);
    }
}

impl Progress {
    /// The start of a simulation.
    ///
    /// # Errors
    /// As [`Plant::new`].
    pub fn start(rig: &Rig, initial: &Initial) -> Result<Self> {
        Ok(Self::of(&Plant::new(rig, rig.parameters().lift(), true)?, initial))
    }

    /// The start of a plant.
    pub(crate) fn of(plant: &Plant<'_, f64>, initial: &Initial) -> Self {
        let rig = plant.rig();
        let mut state = initial.state(rig, plant.states());
        plant.start(&mut state);
        for (gas, kelvin) in &initial.temperatures {
            state[rig.layout.mass(*gas)] *= rig.spec().gas.temperature / kelvin;
        }
        let memory = plant.fresh_memory();
        let mut flags = Vec::new();
        for (k, coordinate) in rig.wiring.coordinates.iter().enumerate() {
            let x = state[rig.layout.angle(k)];
            flags.push(coordinate.stops.is_some_and(|s| x < s.min_angle));
            flags.push(coordinate.stops.is_some_and(|s| x > s.max_angle));
        }
        // what a run begins with does not happen in it; a pressure that is out of bounds does
        let others = 2 * rig.wiring.chambers + rig.wiring.valves.len() + rig.wiring.lines.len();
        flags.extend(std::iter::repeat_n(false, others));
        let readings = if plant.skewed() { readings(rig).count() } else { 0 };
        let kept = if plant.delayed() { rig.names.inputs.len() + readings } else { 0 };
        Self { state, memory, flags, samples: 0, past: Vec::new(), kept }
    }

    /// The state, to be moved by who advances it in another way.
    pub(crate) fn state_mut(&mut self) -> &mut [f64] {
        &mut self.state
    }

    /// One sample more, of a state that was moved.
    pub(crate) fn count(&mut self) {
        self.samples += 1;
    }

    /// Whether the state is in the model's range.
    ///
    /// # Errors
    /// [`Error::Integration`] where it is not.
    pub(crate) fn check(&self, plant: &Plant<'_, f64>, timing: Timing) -> Result<()> {
        check_state(plant, &self.state, self.samples as f64 * timing.sample_time)
    }

    /// Samples since the start.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// The numbers that [`Self::restored`] makes the same progress of, bit for bit.
    #[must_use]
    pub fn to_vec(&self) -> Vec<f64> {
        let memory = self.memory.iter().flat_map(Memory::to_array);
        let flags = self.flags.iter().map(|f| f64::from(u8::from(*f)));
        let numbers =
            self.state.iter().copied().chain(memory).chain(flags).chain([self.samples as f64]);
        numbers.chain(self.past.iter().copied()).collect()
    }

    /// This progress with the numbers of another [`Self::to_vec`] of the same rig.
    ///
    /// # Errors
    /// [`Error::Length`] for another number of them, [`Error::Parameter`] for one that is not
    /// finite, [`Error::Integration`] for a state outside the model's range.
    pub fn restored(&self, rig: &Rig, numbers: &[f64]) -> Result<Self> {
        let parts =
            [self.state.len(), self.memory.len() * Memory::<f64>::NUMBERS, self.flags.len(), 1];
        let expected: usize = parts.iter().sum();
        let past = numbers.len().wrapping_sub(expected);
        let whole =
            past == 0 || (past < numbers.len() && self.kept > 0 && past.is_multiple_of(self.kept));
        if !whole {
            let why = "as it was read".into();
            return Err(Error::Length {
                name: "state".into(),
                found: numbers.len(),
                expected,
                why,
            });
        }
        for (k, value) in numbers.iter().enumerate() {
            check_range(&format!("state[{k}]"), *value, -1e15, 1e15, "(as it was read)")?;
        }
        let (state, rest) = numbers.split_at(parts[0]);
        let (memory, rest) = rest.split_at(parts[1]);
        let (flags, rest) = rest.split_at(parts[2]);
        let (samples, past) = rest.split_at(1);
        let restored = Self {
            past: past.to_vec(),
            kept: self.kept,
            state: state.to_vec(),
            memory: memory.chunks(Memory::<f64>::NUMBERS).map(Memory::from_slice).collect(),
            flags: flags.iter().map(|f| *f > 0.5).collect(),
            samples: samples.first().map_or(0, |n| n.max(0.0) as u64),
        };
        check_state(&Plant::new(rig, rig.parameters().lift::<f64>(), true)?, &restored.state, 0.0)?;
        Ok(restored)
    }

    /// The linear model of a rig about this sample, with its valves at their null.
    ///
    /// # Errors
    /// [`Error::Integration`] when the state has left the model's range, [`Error::Model`] where a
    /// derivative is not finite.
    pub fn linearised(&self, rig: &Rig, side: Side) -> Result<LinearModel> {
        check_state(&Plant::new(rig, rig.parameters().lift::<f64>(), true)?, &self.state, 0.0)?;
        rig.linearised(&self.state, &self.memory, side)
    }

    /// Append this sample to a trajectory.
    ///
    /// # Errors
    /// [`Error::Integration`] when the state has left the model's range.
    pub fn observe(&self, rig: &Rig, timing: Timing, out: &mut Trajectory) -> Result<()> {
        let plant = Plant::new(rig, rig.parameters().lift(), true)?;
        let mut scratch = plant.scratch();
        self.observed(&plant, &mut scratch, timing, out)
    }

    pub(super) fn observed(
        &self,
        plant: &Plant<'_, f64>,
        scratch: &mut Scratch<f64>,
        timing: Timing,
        out: &mut Trajectory,
    ) -> Result<()> {
        self.check(plant, timing)?;
        self.seen(plant, scratch, timing, out);
        Ok(())
    }

    /// Append this sample, which is in the model's range, to a trajectory.
    #[inline]
    pub(super) fn seen(
        &self,
        plant: &Plant<'_, f64>,
        scratch: &mut Scratch<f64>,
        timing: Timing,
        out: &mut Trajectory,
    ) {
        match &mut out.wanted {
            None => self.observe_all(plant, scratch, timing, &mut out.channels),
            Some(wanted) => {
                self.observe_all(plant, scratch, timing, wanted.room());
                wanted.append(&self.state, &mut out.channels);
            }
        }
    }

    /// Append this sample to every channel.
    #[inline]
    fn observe_all(
        &self,
        plant: &Plant<'_, f64>,
        scratch: &mut Scratch<f64>,
        timing: Timing,
        out: &mut [Vec<f64>],
    ) {
        let time = self.samples as f64 * timing.sample_time;
        plant.observe(&self.state, time, &self.memory, scratch, out);
        if self.keeps_readings(plant) {
            let late_by = Late::at(plant, time);
            let first = plant.rig().names.inputs.len();
            for (column, (channel, pressure)) in readings(plant.rig()).enumerate() {
                let shift = if pressure { late_by.pressures } else { late_by.motion };
                let later = shift / timing.sample_time;
                let rows = || self.past.chunks(self.kept).rev();
                let seen = out.get_mut(channel).and_then(|samples| samples.last_mut());
                if let Some(reading) = seen {
                    *reading =
                        late(|ago| rows().nth(ago).map(|r| r[first + column]), *reading, later);
                }
            }
        }
    }

    /// Whether readings of past samples are kept beside the commands.
    pub(super) fn keeps_readings(&self, plant: &Plant<'_, f64>) -> bool {
        self.kept > plant.rig().names.inputs.len()
    }

    /// Note the commands of a sample, and its readings where another clock records them; forget
    /// what nobody asks for any more.
    pub(super) fn remember(
        &mut self,
        plant: &Plant<'_, f64>,
        scratch: &mut Scratch<f64>,
        drive: &Drive<'_>,
        sample: usize,
        timing: Timing,
    ) {
        let time = self.samples as f64 * timing.sample_time;
        self.past.extend(drive.commands.iter().map(|commands| commands[sample]));
        if self.keeps_readings(plant) {
            let mut seen = vec![Vec::new(); plant.rig().names.channels.len()];
            plant.observe(&self.state, time, &self.memory, scratch, &mut seen);
            let kept = readings(plant.rig());
            self.past.extend(kept.flat_map(|(channel, _)| seen[channel].last().copied()));
        }
        let (pressures, angles) = plant.skew(time);
        let latest = pressures.max(angles).max(0.0) + plant.dead_time();
        let most = self.kept * (2 + (latest / timing.sample_time).ceil() as usize);
        self.past.drain(..self.past.len().saturating_sub(most));
    }

    /// Commands over the step that begins at a time, the newest being those of the present sample:
    /// as late as what is recorded first.
    pub(super) fn delayed(
        &self,
        plant: &Plant<'_, f64>,
        time: f64,
        timing: Timing,
    ) -> Controls<f64> {
        let rows = self.past.len() / self.kept;
        let command = |input: usize, sample: i64| {
            if sample < 0 && input >= plant.rig().wiring.valves.len() {
                return set_pressure(plant.rig(), input); // nobody has set the regulator yet
            }
            let back = (self.samples as i64 - sample).clamp(0, rows as i64 - 1) as usize;
            self.past[(rows - 1 - back) * self.kept + input]
        };
        let shift = Late::at(plant, time).commands;
        let (step, sample_time) = (timing.step(), timing.sample_time);
        let mut controls = plant.controls(|_| 0.0);
        plant.delayed_controls(shift, time, step, sample_time, command, &mut controls);
        controls
    }
}

/// Channels that are readings of pressures (true) and of what moves.
fn readings(rig: &Rig) -> impl Iterator<Item = (usize, bool)> + '_ {
    rig.names.channels.iter().enumerate().filter_map(|(k, (_, channel))| match channel {
        Channel::Supply(_) | Channel::Pressure(_) => Some((k, true)),
        Channel::Angle(_) | Channel::Rate(_) | Channel::Length | Channel::LengthRate => {
            Some((k, false))
        }
        _ => None,
    })
}

/// How late a run sees its commands and records what it reads [s]: it runs on the clock of what is
/// recorded first.
struct Late {
    commands: f64,
    pressures: f64,
    motion: f64,
}

impl Late {
    fn at(plant: &Plant<'_, f64>, time: f64) -> Self {
        let (pressures, angles) = plant.skew(time);
        let (pressures, angles) = (pressures.max(0.0), angles.max(0.0));
        let commands = pressures.min(angles);
        Self { commands, pressures: pressures - commands, motion: angles - commands }
    }
}
