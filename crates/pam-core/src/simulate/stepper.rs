//! One integration step of a plant, and whether it stayed in the model's range.

use super::integrate::Rk4;
use crate::description::dotted;
use crate::plant::{Controls, InputPort, Memory, Plant, Scratch, Simulated, Switch, Switches};
use crate::scalar::{constant, Scalar};
use crate::{Error, Result};
use std::ops::Range;

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
    /// Missing input at the beginning, the middle and the end of a step.
    pub input: Option<(InputPort, [S; 3])>,
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
            input: None,
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
            plant,
            scratch,
            method,
            start,
            end,
            from,
            remembers,
            stages,
            before,
            reads,
            input,
            ..
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
            scratch.input = input.map(|(port, values)| (port, values[(2.0 * fraction) as usize]));
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
        let Self { plant, scratch, method, start, from: muscles, stages, input, .. } = self;
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
            let share = (from + fraction * length) / step.dt;
            drive(plant, controls, share, y);
            scratch.input =
                input.map(|(port, [first, _, last])| (port, first + (last - first) * share));
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
    for (k, (group, spec)) in rig.wiring.groups.iter().zip(&rig.spec().muscles).enumerate() {
        let angle = state[layout.angle(group.coordinate)].re();
        if !group.joint.reaches(angle) {
            return failure("joint_angle", angle, "an angle that the tendon reaches");
        }
        let contraction = plant.contraction_now(k, state);
        let table = &group.muscle.table;
        if !table.contains(contraction) {
            let allowed =
                format!("inside the muscle's range {:.4} to {:.4}", table.e_min, table.e_max);
            return failure(&dotted("contraction_ratio", &spec.name), contraction, &allowed);
        }
    }
    Ok(())
}
