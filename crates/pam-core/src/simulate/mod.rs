//! Fixed-step simulation: commands are held over each sample, RK4 steps fill it.

pub mod drive;
pub mod events;
mod initial;
pub mod integrate;
mod row;
pub mod run;
pub(crate) mod team;

use self::drive::{set_pressure, Drive};
use self::events::Event;
pub use self::initial::Initial;
use self::integrate::Rk4;
pub use self::row::{of_row, Failure};
use self::run::Run;
use crate::clock::late;
use crate::description::dotted;
use crate::error::check_range;
use crate::lanes::Wanted;
use crate::plant::{Channel, LinearModel, Memory, Rig, Side};
use crate::plant::{Controls, Plant, Scratch, Simulated, Switch, Switches};
use crate::scalar::{constant, Scalar};
use crate::{Error, Result};
use std::ops::Range;

/// Sample time and step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// Sample time [s]: one output row and one held command each.
    pub sample_time: f64,
    /// RK4 steps per sample.
    pub substeps: usize,
}

impl Timing {
    /// Timing from a sample time and a step [s] that divides it.
    ///
    /// # Errors
    /// [`Error::Parameter`] when either is not positive or the step does not divide the sample
    /// time.
    pub fn new(sample_time: f64, step: f64) -> Result<Self> {
        if !(sample_time.is_finite() && sample_time > 0.0) {
            return Err(Error::parameter("sample_time", sample_time, "a finite time > 0 s"));
        }
        let ratio = sample_time / step;
        let rounded = ratio.round();
        let divides = (1.0..=1e7).contains(&rounded) && (ratio - rounded).abs() <= 1e-6 * rounded;
        if !(step.is_finite() && step > 0.0 && divides) {
            let allowed = format!(
                "a time > 0 s that divides sample_time = {sample_time:?} s into 1 to 1e7 steps"
            );
            return Err(Error::parameter("step", step, allowed));
        }
        Ok(Self { sample_time, substeps: rounded as usize })
    }

    /// The same with each step divided until it is at most as long as a rig allows.
    ///
    /// # Errors
    /// As [`Self::at_most`].
    pub fn stable(self, rig: &Rig) -> Result<Self> {
        self.at_most(rig.stable_step())
    }

    /// The same with each step divided until it is at most so long [s].
    ///
    /// # Errors
    /// [`Error::Parameter`] for a sample time that would take more steps than anybody waits for.
    pub fn at_most(self, longest: f64) -> Result<Self> {
        let parts = (self.step() / longest - 1e-9).ceil().max(1.0);
        if parts * self.substeps as f64 <= MOST_STEPS {
            return Ok(Self { substeps: self.substeps * parts as usize, ..self });
        }
        let allowed = format!("at most {MOST_STEPS:e} steps of {longest:.3e} s, as the rig needs");
        Err(Error::parameter("sample_time", self.sample_time, allowed))
    }

    /// Step [s].
    pub fn step(&self) -> f64 {
        self.sample_time / self.substeps as f64
    }
}

/// Steps of one sample: some ten seconds of a small rig.
const MOST_STEPS: f64 = 1e8;
/// Steps between two looks outside: some ten milliseconds of a large rig.
pub(crate) const STEPS_UNSEEN: usize = 8_000;
/// Rows that room is made for at once.
const MOST_ROOM: usize = 65_536;

/// A plant with the memory that a step needs.
pub(crate) struct Stepper<'a, S> {
    pub plant: Plant<'a, S>,
    pub scratch: Scratch<S>,
    method: Rk4<S>,
    start: Vec<S>,
    end: Vec<S>,
    remembers: bool,
    /// Controls at the beginning, the middle and the end of a step, where they differ.
    stages: Option<[Controls<S>; 3]>,
    /// State before a step, where something happens between steps.
    before: Option<Vec<S>>,
    /// Instants within a step at which valves switch, where they do.
    switches: Option<Switches<S>>,
    /// Contraction ratios of the muscles before a step, where kinks of their volume are asked for.
    from: Vec<f64>,
    /// Where the coordinates were before it, where their stops are asked for.
    were: Vec<f64>,
    /// Whether anybody asks what the sensors read.
    pub reads: bool,
}

impl<'a, S: Scalar> Stepper<'a, S> {
    pub fn new(plant: Plant<'a, S>) -> Self {
        let groups = plant.rig().wiring.groups.len();
        let zeros = || vec![constant(0.0); groups];
        let ports = &plant.rig().wiring.ports;
        let stages = ports.staged().then(|| std::array::from_fn(|_| plant.controls(|_| 0.0)));
        let before = ports.updates().then(|| vec![constant(0.0); plant.states()]);
        Self {
            stages,
            before,
            switches: ports.switches().then(Switches::none),
            reads: true,
            scratch: plant.scratch(),
            method: Rk4::new(plant.states()),
            start: zeros(),
            end: zeros(),
            from: Vec::with_capacity(groups),
            were: Vec::new(),
            remembers: plant.remembers(),
            plant,
        }
    }

    /// Controls as they are at the beginning (0), the middle or the end (2) of the step that began
    /// last.
    pub fn controls<'b>(&'b self, held: &'b Controls<S>, stage: usize) -> &'b Controls<S> {
        self.stages.as_ref().map_or(held, |stages| &stages[stage])
    }

    /// Controls at the beginning of a step that is still to come.
    pub fn begin(&mut self, state: &[S], held: &Controls<S>, time: f64) {
        if let Some([first, ..]) = &mut self.stages {
            self.plant.stage(state, held, time, 0.0, first);
        }
    }

    /// One RK4 step from a time [s] on; driven states are written by
    /// `drive(plant, controls, fraction, state)`, the controls being those of that instant.
    #[inline]
    #[allow(clippy::too_many_arguments)]
    pub fn step(
        &mut self,
        state: &mut [S],
        memory: &mut [Memory<S>],
        controls: &Controls<S>,
        time: f64,
        dt: f64,
        simulated: &Simulated,
        mut drive: impl FnMut(&Plant<'a, S>, &Controls<S>, f64, &mut [S]),
    ) {
        let stops = self.plant.asks_for_stops(simulated);
        if stops {
            self.plant.where_coordinates_are(state, &mut self.were);
        }
        if self.switches.is_some() {
            self.step_in_pieces(state, memory, controls, (time, dt), simulated, &mut drive);
        } else {
            self.plain_step(state, memory, controls, (time, dt), simulated, &mut drive);
        }
        if stops {
            let Self { plant, scratch, start, were, stages, .. } = self;
            let controls = stages.as_ref().map_or(controls, |stages| &stages[2]);
            plant.meet_stops(were, state, controls, memory, start, simulated, scratch);
        }
    }

    /// A step in which no valve switches.
    #[inline]
    fn plain_step(
        &mut self,
        state: &mut [S],
        memory: &mut [Memory<S>],
        controls: &Controls<S>,
        (time, dt): (f64, f64),
        simulated: &Simulated,
        drive: Drives<'_, 'a, S>,
    ) {
        let Self {
            plant, scratch, method, start, end, from, remembers, stages, before, reads, ..
        } = self;
        let layout = plant.rig().layout();
        if let Some(stages) = stages {
            for (k, stage) in stages.iter_mut().enumerate() {
                plant.stage(state, controls, time, 0.5 * k as f64 * dt, stage);
            }
        }
        let held = controls;
        let remembers = *remembers && plant.pulls(simulated);
        let at = |stage: usize| stages.as_ref().map_or(held, |stages| &stages[stage]);
        let kinks = plant.asks_for_kinks(simulated);
        if remembers || before.is_some() || kinks {
            drive(plant, at(0), 0.0, state);
        }
        if remembers {
            plant.contractions(state, start);
        }
        if let Some(before) = before {
            before.copy_from_slice(state);
        }
        if kinks {
            plant.where_muscles_are(state, from);
        }
        let kept = layout.states()..state.len();
        let runs = simulated.runs().iter().cloned().chain([kept]);
        method.step_in(state, runs, dt, |fraction, y, out| {
            let controls = at((2.0 * fraction) as usize);
            drive(plant, controls, fraction, y);
            plant.rates(y, controls, memory, start, simulated, scratch, out);
        });
        drive(plant, at(2), 1.0, state);
        if kinks {
            plant.pass_kinks(from, simulated, at(2), scratch, state);
        }
        if let Some(before) = before {
            plant.discrete_update(before, state, held, dt);
            if *reads {
                plant.read(before, state, [at(0), at(2)], dt);
            }
        }
        if remembers {
            plant.contractions(state, end);
            plant.follow_muscles(state, memory, start, end);
        }
    }
}

impl<'a, S: Scalar> Stepper<'a, S> {
    /// As [`Self::step`] where valves switch: an RK4 step from each instant at which one does to
    /// the next.
    fn step_in_pieces(
        &mut self,
        state: &mut [S],
        memory: &mut [Memory<S>],
        held: &Controls<S>,
        (time, dt): (f64, f64),
        simulated: &Simulated,
        drive: Drives<'_, 'a, S>,
    ) {
        self.begin(state, held, time);
        drive(&self.plant, self.controls(held, 0), 0.0, state);
        let remembers = self.remembers && self.plant.pulls(simulated);
        if remembers {
            self.plant.contractions(state, &mut self.start);
        }
        let began = state.to_vec();
        let mut switches = self.switches.take().unwrap_or_else(Switches::none);
        self.plant.switches(&began, held, time, dt, &mut switches);
        let step = Pieces { began: &began, held, time, dt, simulated };
        let mut from = 0.0;
        for switch in std::mem::take(&mut switches.each) {
            let until = switch.after.re();
            if until - from > SHORTEST_PIECE * dt {
                self.piece(state, memory, &step, (from, until), &switches, drive);
                from = until;
            }
            self.switch(state, memory, &step, &switch, &mut switches, drive);
        }
        self.piece(state, memory, &step, (from, dt), &switches, drive);
        self.finish(state, &step, &switches, drive);
        self.switches = Some(switches);
        if remembers {
            self.plant.contractions(state, &mut self.end);
            self.plant.follow_muscles(state, memory, &self.start, &self.end);
        }
    }

    /// Controls of a part of a step, valves where they stand in it.
    fn set_stages(&mut self, step: &Pieces<'_, S>, (from, until): (f64, f64), now: &Switches<S>) {
        let Self { plant, stages, .. } = self;
        for (k, stage) in stages.iter_mut().flatten().enumerate() {
            let age = from + 0.5 * k as f64 * (until - from);
            plant.stage(step.began, step.held, step.time, age, stage);
            now.write(stage);
        }
    }

    /// An RK4 step over a part of a step.
    fn piece(
        &mut self,
        state: &mut [S],
        memory: &[Memory<S>],
        step: &Pieces<'_, S>,
        (from, until): (f64, f64),
        now: &Switches<S>,
        drive: Drives<'_, 'a, S>,
    ) {
        self.set_stages(step, (from, until), now);
        let Self { plant, scratch, method, start, from: muscles, stages, .. } = self;
        let runs = step.runs(plant, state.len());
        let at = |stage: usize| stages.as_ref().map_or(step.held, |stages| &stages[stage]);
        let length = until - from;
        let kinks = plant.asks_for_kinks(step.simulated);
        if kinks {
            drive(plant, at(0), from / step.dt, state);
            plant.where_muscles_are(state, muscles);
        }
        method.step_in(state, runs, length, |fraction, y, out| {
            let controls = at((2.0 * fraction) as usize);
            drive(plant, controls, (from + fraction * length) / step.dt, y);
            plant.rates(y, controls, memory, start, step.simulated, scratch, out);
        });
        drive(plant, at(2), until / step.dt, state);
        if kinks {
            plant.pass_kinks(muscles, step.simulated, at(2), scratch, state);
        }
    }

    /// A valve takes another position. Where its instant has slopes, so has the state: until then
    /// it moved as before, from then on as after it (the saltation of a system that switches).
    fn switch(
        &mut self,
        state: &mut [S],
        memory: &[Memory<S>],
        step: &Pieces<'_, S>,
        switch: &Switch<S>,
        now: &mut Switches<S>,
        drive: Drives<'_, 'a, S>,
    ) {
        let at = switch.after.re();
        let later = switch.after - at;
        if later.same(&constant(0.0)) {
            now.take(switch);
            return;
        }
        let mut rates = [vec![constant(0.0); state.len()], vec![constant(0.0); state.len()]];
        for (k, rates) in rates.iter_mut().enumerate() {
            if k == 1 {
                now.take(switch);
            }
            self.set_stages(step, (at, at), now);
            let Self { plant, scratch, start, stages, .. } = self;
            let controls = stages.as_ref().map_or(step.held, |stages| &stages[0]);
            drive(plant, controls, at / step.dt, state);
            plant.rates(state, controls, memory, start, step.simulated, scratch, rates);
        }
        let [before, after] = rates;
        for run in step.runs(&self.plant, state.len()) {
            for place in run {
                state[place] += (before[place] - after[place]) * later;
            }
        }
    }

    /// What happens between steps, and what sensors read.
    fn finish(
        &mut self,
        state: &mut [S],
        step: &Pieces<'_, S>,
        now: &Switches<S>,
        drive: Drives<'_, 'a, S>,
    ) {
        let Self { plant, stages, reads, .. } = self;
        let Some([first, _, last]) = stages else { return };
        plant.stage(step.began, step.held, step.time, 0.0, first);
        drive(plant, last, 1.0, state);
        plant.discrete_update(step.began, state, step.held, step.dt);
        if *reads {
            plant.read(step.began, state, [first, last], step.dt);
        }
        now.end(state);
    }
}

/// Least part of a step that is one of its own.
const SHORTEST_PIECE: f64 = 1e-12;

/// Writes driven states, see [`Stepper::step`].
type Drives<'d, 'a, S> = &'d mut dyn FnMut(&Plant<'a, S>, &Controls<S>, f64, &mut [S]);

/// A step that valves cut into pieces.
struct Pieces<'s, S> {
    /// State at its beginning.
    began: &'s [S],
    held: &'s Controls<S>,
    /// When it begins, and how long it takes [s].
    time: f64,
    dt: f64,
    simulated: &'s Simulated,
}

impl<S: Scalar> Pieces<'_, S> {
    /// Places that are integrated, the sums of the balance among them.
    fn runs<'b>(
        &'b self,
        plant: &Plant<'_, S>,
        states: usize,
    ) -> impl Iterator<Item = Range<usize>> + Clone + 'b {
        let kept = plant.rig().layout().states()..states;
        self.simulated.runs().iter().cloned().chain([kept])
    }
}

/// Error for a state that has left the model's range, if it has.
pub(crate) fn check_state<S: Scalar>(plant: &Plant<'_, S>, state: &[S], time: f64) -> Result<()> {
    let rig = plant.rig();
    let layout = &rig.layout;
    let failure = |name: &str, value: f64, allowed: &str| {
        Err(Error::Integration { time, name: name.into(), value, allowed: allowed.into() })
    };
    for (name, place) in &rig.names.initial {
        let value = state[*place].re();
        if !value.is_finite() {
            return failure(name, value, "a finite value (a smaller step may help)");
        }
        if *place < layout.mass(0) && value <= 0.0 {
            return failure(name, value, "an absolute pressure > 0 Pa (a smaller step may help)");
        }
    }
    for k in 0..layout.gases {
        if !state[layout.mass(k)].re().is_finite() {
            return failure(
                "gas_mass",
                state[layout.mass(k)].re(),
                "a finite value (a smaller step may help)",
            );
        }
    }
    for (group, spec) in rig.wiring.groups.iter().zip(&rig.spec().muscles) {
        let angle = state[layout.angle(group.coordinate)].re();
        if !group.joint.reaches(angle) {
            return failure("joint_angle", angle, "an angle that the tendon reaches");
        }
        let contraction = group.joint.eval(angle).shortening / group.rest_length;
        let table = &group.muscle.table;
        if !table.contains(contraction) {
            let allowed =
                format!("inside the muscle's range {:.4} to {:.4}", table.e_min, table.e_max);
            return failure(&dotted("contraction_ratio", &spec.name), contraction, &allowed);
        }
    }
    Ok(())
}

/// Simulated channels, all in the order of [`crate::plant::Names::channels`] or those that are
/// wanted in theirs, one row per sample; row 0 is the initial state. SI, pressures gauge and as the
/// sensors read them (zeros included). And what happened on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// One vector for each channel.
    pub channels: Vec<Vec<f64>>,
    /// In the order of time.
    pub events: Vec<Event>,
    /// The channels that are kept; all where it is not said.
    wanted: Option<Wanted>,
}

impl Trajectory {
    /// Without rows.
    #[must_use]
    pub fn new(rig: &Rig, rows: usize) -> Self {
        let channels = rig.names.channels.iter().map(|_| room(rows)).collect();
        Self { channels, ..Self::blind() }
    }

    /// Without rows, for some channels by number, in their order.
    #[must_use]
    pub fn of_some(run: &Run<'_>, rows: usize, wanted: &[usize]) -> Self {
        let channels = wanted.iter().map(|_| room(rows)).collect();
        Self { channels, wanted: Some(Wanted::new(&run.stepper.plant, wanted)), ..Self::blind() }
    }

    /// Without channels: events alone.
    #[must_use]
    pub fn blind() -> Self {
        Self { channels: Vec::new(), events: Vec::new(), wanted: None }
    }

    /// The channel of a name, where all are kept.
    #[must_use]
    pub fn get(&self, rig: &Rig, name: &str) -> Option<&[f64]> {
        if self.wanted.is_some() {
            return None;
        }
        let k = rig.names.channels.iter().position(|(n, _)| n == name)?;
        self.channels.get(k).map(Vec::as_slice)
    }
}

/// Room for the rows of a channel.
fn room(rows: usize) -> Vec<f64> {
    Vec::with_capacity(rows.min(MOST_ROOM))
}

/// A running simulation at a sample: all that its future depends on.
#[derive(Debug, Default, PartialEq)]
pub struct Progress {
    state: Vec<f64>,
    memory: Vec<Memory<f64>>,
    /// Conditions that an event ends, see [`Watch`].
    flags: Vec<bool>,
    samples: u64,
    /// Commands and readings of the samples before, newest last, as far back as clocks that are apart
    /// reach.
    past: Vec<f64>,
    /// How many of them a sample has: all commands and readings, or none.
    kept: usize,
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
        for gas in 0..rig.layout.gases {
            state[rig.layout.mass(gas)] = plant.initial_mass(gas, &state);
        }
        plant.start_effects(&mut state);
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

    /// Bring the conditions of events up to date, of a state that was moved under these controls.
    pub(crate) fn look(&mut self, run: &mut Run<'_>, controls: &Controls<f64>) {
        let plant = &run.stepper.plant;
        run.conditions.set(plant, controls);
        run.after.look(&run.conditions, |place| self.state[place]);
        run.after.report(plant.rig(), None, 0.0, &mut self.flags, &mut Vec::new());
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

    /// As [`Self::observe`], with a run of the same rig.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn observe_in(
        &self,
        run: &mut Run<'_>,
        timing: Timing,
        out: &mut Trajectory,
    ) -> Result<()> {
        self.observed(&run.stepper.plant, &mut run.stepper.scratch, timing, out)
    }

    fn observed(
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
    fn seen(
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
    fn keeps_readings(&self, plant: &Plant<'_, f64>) -> bool {
        self.kept > plant.rig().names.inputs.len()
    }

    /// Note the commands of a sample, and its readings where another clock records them; forget
    /// what nobody asks for any more.
    fn remember(
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
    fn delayed(&self, plant: &Plant<'_, f64>, time: f64, timing: Timing) -> Controls<f64> {
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

    /// Hold the commands of each sample and append the sample after it. What is prescribed moves
    /// evenly to its value for the end of each sample.
    ///
    /// # Errors
    /// [`Error::Integration`] when the state leaves the model's range; what was appended before
    /// stays, and the progress is that of the last good sample.
    pub fn advance(
        &mut self,
        rig: &Rig,
        timing: Timing,
        drive: &Drive<'_>,
        out: &mut Trajectory,
    ) -> Result<()> {
        self.advance_watched(rig, timing, drive, out, &mut || Ok(()))
    }

    /// As [`Self::advance`], with a look outside every few milliseconds: an error of `look` ends
    /// the run at the last sample.
    ///
    /// # Errors
    /// As [`Self::advance`], and that of `look`.
    pub fn advance_watched(
        &mut self,
        rig: &Rig,
        timing: Timing,
        drive: &Drive<'_>,
        out: &mut Trajectory,
        look: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()> {
        self.advance_in(&mut Run::new(rig)?, timing, drive, 0..drive.samples, out, look)
    }

    /// As [`Self::advance_watched`] over some samples of a drive, with a run of the same rig.
    ///
    /// # Errors
    /// As [`Self::advance_watched`].
    pub fn advance_in(
        &mut self,
        run: &mut Run<'_>,
        timing: Timing,
        drive: &Drive<'_>,
        samples: Range<usize>,
        out: &mut Trajectory,
        look: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()> {
        debug_assert_eq!(self.state.len(), run.stepper.plant.states(), "sums as the run has them");
        run.prescribe(drive);
        for k in samples {
            let happened = out.events.len();
            if let Err(error) = self.sample(run, timing, drive, k, out, look) {
                out.events.truncate(happened);
                return Err(error);
            }
        }
        Ok(())
    }

    /// One sample of a drive. Where it fails, this is still where the sample began.
    #[inline]
    fn sample(
        &mut self,
        run: &mut Run<'_>,
        timing: Timing,
        drive: &Drive<'_>,
        k: usize,
        out: &mut Trajectory,
        look: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()> {
        let happened = out.events.len();
        run.stepper.plant.command(|input| drive.commands[input][k], &mut run.controls);
        let flown = !drive.prescribes() && self.flown(run, timing, out, look)?;
        if !flown {
            out.events.truncate(happened);
            self.stepped(run, timing, drive, k, out, look)?;
        }
        let Run { stepper, next, .. } = run;
        // Within a step they were found block by block.
        if let Some(new) = out.events.get_mut(happened..) {
            new.sort_by(|a, b| a.time.total_cmp(&b.time));
        }
        next.samples += 1;
        if !flown {
            next.check(&stepper.plant, timing)?; // what flew was looked at
        }
        next.seen(&stepper.plant, &mut stepper.scratch, timing, out);
        std::mem::swap(self, next);
        Ok(())
    }
}

impl Progress {
    /// The steps of a sample under the commands of a run, in its faster way; whether they are done.
    #[inline]
    fn flown(
        &self,
        run: &mut Run<'_>,
        timing: Timing,
        out: &mut Trajectory,
        look: &mut dyn FnMut() -> Result<()>,
    ) -> Result<bool> {
        if !run.flies() {
            return Ok(false);
        }
        run.next.clone_from(self);
        let began = self.samples as f64 * timing.sample_time;
        run.begin(began, true, &mut out.events);
        for from in (0..timing.substeps).step_by(STEPS_UNSEEN) {
            let steps = from..timing.substeps.min(from + STEPS_UNSEEN);
            let taken = steps.len();
            if !run.fly(timing, began, steps, &mut out.events) {
                return Ok(false);
            }
            run.seen(taken, look)?;
        }
        Ok(true)
    }

    /// The steps of a sample of a drive under the commands of a run, one by one.
    fn stepped(
        &self,
        run: &mut Run<'_>,
        timing: Timing,
        drive: &Drive<'_>,
        k: usize,
        out: &mut Trajectory,
        look: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()> {
        run.next.clone_from(self);
        let ends = drive.ends(run.stepper.plant.rig(), &self.state, k);
        let began = self.samples as f64 * timing.sample_time;
        if self.kept > 0 {
            run.next.remember(&run.stepper.plant, &mut run.stepper.scratch, drive, k, timing);
            run.controls = run.next.delayed(&run.stepper.plant, began, timing);
        }
        run.begin(began, false, &mut out.events);
        for sub in 0..timing.substeps {
            if self.kept > 0 {
                let from = began + sub as f64 * timing.step();
                run.controls = run.next.delayed(&run.stepper.plant, from, timing);
            }
            run.step(&ends, timing, began, sub, &mut out.events);
            run.seen(1, look)?;
        }
        let Run { stepper, next, .. } = run;
        for (place, ..) in &ends {
            held_mass(&stepper.plant, *place, &mut next.state);
        }
        Ok(())
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

/// The gas of a prescribed pressure is at the temperature of the room, and what that takes was
/// supplied from outside (or, where it is less, vented).
fn held_mass(plant: &Plant<'_, f64>, place: usize, state: &mut [f64]) {
    let layout = plant.rig().layout;
    if place >= layout.mass(0) {
        return;
    }
    let gas = place - layout.supplies;
    let (mass, pressure) = (plant.rest_mass(gas, state), state[place]);
    let more = mass - state[layout.mass(gas)];
    let air = &plant.rig().gas;
    let rt = air.gas_constant * air.temperature;
    state[layout.mass(gas)] = mass;
    if state.len() == layout.states() {
        return; // without sums
    }
    if more > 0.0 {
        state[layout.balance(0)] += more;
        state[layout.balance(2)] += more * rt;
        state[layout.balance(3)] += more * rt * (pressure / air.ambient_pressure).ln();
    } else {
        state[layout.balance(1)] -= more;
    }
}

/// Simulate `rows` rows: the initial state, and one for each held sample but the last.
///
/// # Errors
/// As [`Drive::new`] and [`Progress::advance`].
pub fn simulate(
    rig: &Rig,
    rows: usize,
    signals: &[(&str, &[f64])],
    timing: Timing,
    initial: &Initial,
) -> Result<Trajectory> {
    let mut out = Trajectory::new(rig, rows);
    let mut progress = Progress::start(rig, initial)?;
    progress.observe(rig, timing, &mut out)?;
    let drive = Drive::new(rig, rows, signals)?;
    progress.advance(rig, timing, &drive.part(0..rows.saturating_sub(1)), &mut out)?;
    Ok(out)
}
