//! The windows of a prediction: each starts from the measurement, and measured neighbours drive the
//! block through it.

use super::block::{behind_gauges, fed_by, unread, Block};
use super::boundary::{driven, rest_length, taps, zero, Driven};
use super::clock::Clocks;
use super::measured::Measured;
use crate::effects::Number;
use crate::plant::{Controls, InputPort, Memory, Plant, Simulated};
use crate::scalar::{constant, Scalar};
use crate::simulate::{check_state, Stepper, Timing};
use crate::Result;

/// One block, cut out of its chain.
pub(super) struct Cut<'a, S> {
    stepper: Stepper<'a, S>,
    block: Block,
    measured: &'a Measured<'a>,
    timing: Timing,
    simulated: Simulated,
    /// Changes of the initial states of each window.
    bumps: Vec<S>,
    /// States that a window starts from.
    own: Vec<usize>,
    /// Every measured state, and which of them are not the block's own: those drive it.
    drivers: Vec<Driven<'a, S>>,
    driving: Vec<Driven<'a, S>>,
    /// Gases and valves between which a transducer sits, and those that drive the block.
    taps: Vec<(usize, usize)>,
    driving_taps: Vec<(usize, usize)>,
    output: Output<S>,
    /// Where an input enters, where there is one.
    entry: Option<InputPort>,
    /// Changes of the input at the knots of every window.
    hats: Vec<S>,
    /// First sample of the present window, and its first knot among those of all windows.
    window: (usize, usize),
}

/// How much faster than at the beginning of a step a joint may become within it.
const FASTER: f64 = 1.5;
/// Share of a step before a stop over which a joint moves as fast as it does.
const NEAR_STOP: f64 = 0.1;
/// Share of a step that leads over a stop.
const AT_STOP: f64 = 1e-3;

/// How the predicted channel is read off the plant.
enum Output<S> {
    /// Off the state.
    State(Reading<S>),
    /// What the muscles at a joint or load pull, beside what the sensor reads at rest.
    Pull(usize, S),
    /// What a meter in front of a gas reads, beside what it reads at rest.
    Flow(usize, S),
    /// What the thermometer of a gas reads, and what it is off by [K].
    Temperature(usize, S),
}

/// How it is read off the state.
struct Reading<S> {
    /// Place of what is read.
    reading: usize,
    /// The same of a sensor that lags, whose reading a window starts from too.
    lagging: Option<usize>,
    /// What the sensor adds.
    offset: S,
    /// Gas whose pressure is read.
    gas: Option<usize>,
    /// Coordinate whose angle is read.
    coordinate: Option<usize>,
    /// Length of the muscles at rest [m], where a length is read in the place of a shortening.
    mirrored: Option<f64>,
}

/// What is carried from sample to sample.
struct Course<S> {
    state: Vec<S>,
    memory: Vec<Memory<S>>,
    /// Openings under which the present sample was read: those before it.
    last: Controls<S>,
}

impl<'a, S: Number> Cut<'a, S> {
    /// A block of a plant with what was measured around it.
    pub fn new(
        plant: Plant<'a, S>,
        block: Block,
        measured: &'a Measured<'a>,
        timing: Timing,
        bumps: Vec<S>,
        hats: Vec<S>,
    ) -> Self {
        let rig = plant.rig();
        let own = block.initial_states(rig.layout());
        let (drivers, taps) = (driven(&plant, block, measured), taps(&plant, block, measured));
        let (output, simulated) =
            (Output::new(&plant, block, &bumps), block.simulated(rig, measured));
        let mut stepper = Stepper::new(plant);
        // a block that neither moves nor has muscles around it does not see the angles
        let unseen = if simulated.sees_angles() { usize::MAX } else { rig.layout().angle(0) };
        stepper.reads = block.gas().is_some();
        Self {
            stepper,
            block,
            measured,
            timing,
            simulated,
            bumps,
            driving: drivers
                .iter()
                .filter(|driver| !own.contains(&driver.place))
                .filter(|driver| driver.place < unseen)
                .copied()
                .collect(),
            driving_taps: taps
                .iter()
                .copied()
                .filter(|(gas, _)| !own.contains(&rig.layout().pressure(*gas)))
                .collect(),
            own,
            drivers,
            taps,
            output,
            entry: measured.input.as_ref().and_then(|_| block.input(rig.layout())),
            hats,
            window: (0, 0),
        }
    }

    /// Predict every sample; `sink` gets its number, the output and what it was read from.
    pub fn run(
        mut self,
        starts: &[usize],
        mut sink: impl FnMut(usize, S, &Stepper<'_, S>, &[S], &Controls<S>),
    ) -> Result<()> {
        let (n, dt) = (self.measured.samples, self.timing.sample_time);
        let mut course = self.at_rest();
        let mut starts = starts.iter().peekable();
        let mut anchors = self.measured.anchors.iter().peekable();
        let mut controls = self.stepper.plant.controls(|_| 0.0);
        for k in 0..n {
            let anchored = anchors.next_if(|s| **s == k).is_some();
            if starts.next_if(|s| **s == k).is_some() {
                self.enter(k, &mut course);
                self.start_window(k, &mut course);
                self.start_temperature(k, &mut course);
            } else if anchored {
                self.start_window(k, &mut course);
            }
            check_state(&self.stepper.plant, &course.state, k as f64 * dt)?;
            let time = k as f64 * dt;
            let clocks = Clocks::of(&self.stepper.plant, self.block, time);
            self.command(k * self.measured.held, time, &clocks, &mut controls);
            if k == 0 && matches!(self.output, Output::Flow(..)) {
                course.last.spool.clone_from(&controls.spool); // nobody knows the one before
            }
            let value = self.read(&course, time);
            sink(k, value, &self.stepper, &course.state, &controls);
            if k + 1 < n {
                self.sample(k, &mut course, clocks, &mut controls);
            }
        }
        Ok(())
    }

    /// A window begins: it has knots of its own, and nothing of what those of the one before did.
    fn enter(&mut self, k: usize, course: &mut Course<S>) {
        let Some(input) = &self.measured.input else { return };
        let (start, first) = self.window;
        self.window = (k, first + if k > 0 { input.knots(k - start) } else { 0 });
        if !self.hats.iter().all(|hat| hat.same(&constant(0.0))) {
            course.state.iter_mut().for_each(|value| *value = constant(value.re()));
        }
    }

    /// The input at a share of the way from sample `k` to the next.
    fn input(&self, k: usize, share: f64) -> S {
        let Some(input) = &self.measured.input else { return constant(0.0) };
        let (start, first) = self.window;
        let place = ((k - start) as f64 + share) / input.spacing as f64;
        let (cell, part) = (place.floor() as usize, place - place.floor());
        let height = |knot: usize| {
            let hat = self.hats.get(knot).copied().unwrap_or_else(|| constant(0.0));
            input.heights.get(first + knot).map_or(hat, |height| hat + *height)
        };
        height(cell) * (1.0 - part) + height(cell + 1) * part
    }

    /// The channel that is predicted.
    fn read(&mut self, course: &Course<S>, time: f64) -> S {
        let Stepper { plant, scratch, .. } = &mut self.stepper;
        match &self.output {
            Output::State(reading) => reading.read(plant, &course.state, time),
            Output::Pull(k, rest) => {
                let pull = plant.pull(*k, &course.state, &course.memory, scratch);
                plant.at_cell(pull, time) + *rest
            }
            Output::Flow(k, rest) => plant.metered(*k, &course.state, &course.last.spool) + *rest,
            Output::Temperature(k, off) => match plant.thermometer(*k) {
                Some((reading, _)) => course.state[reading] + *off,
                None => plant.temperature(*k, &course.state) + *off,
            },
        }
    }

    /// What nobody measures begins at rest, and stays there unless it is inside a line.
    fn at_rest(&self) -> Course<S> {
        let plant = &self.stepper.plant;
        let (rig, layout) = (plant.rig(), plant.rig().layout());
        let ambient = rig.gas.ambient_pressure;
        let mut last = plant.controls(|_| 0.0);
        last.spool.fill(constant(0.0));
        let mut state = vec![constant::<S>(0.0); plant.states()];
        for (k, supply) in rig.spec().supplies.iter().enumerate() {
            state[layout.supply(k)] = constant(supply.initial_pressure + ambient);
        }
        for (k, gas) in rig.wiring.gases.iter().enumerate() {
            state[layout.pressure(k)] = constant(gas.initial_pressure + ambient);
        }
        for (k, coordinate) in rig.wiring.coordinates.iter().enumerate() {
            state[layout.angle(k)] = constant(coordinate.rest);
        }
        Course { state, memory: plant.fresh_memory(), last }
    }

    /// Start a window from the measurement.
    fn start_window(&self, k: usize, course: &mut Course<S>) {
        let plant = &self.stepper.plant;
        let layout = plant.rig().layout();
        let before = course.state.clone();
        let state = &mut course.state;
        let dt = self.timing.sample_time;
        let time = k as f64 * dt;
        let shift = Clocks::of(plant, self.block, time).neighbour;
        self.drivers.iter().for_each(|driver| driver.write(plant, k, 0.0, dt, shift, state));
        for (gas, valve) in &self.taps {
            let place = layout.pressure(*gas);
            state[place] = plant.behind_tube(*gas, state[place], state, course.last.spool[*valve]);
        }
        if !matches!(self.block, Block::Temperature(_)) {
            for (place, bump) in self.own.iter().zip(&self.bumps) {
                state[*place] += *bump;
            }
        }
        if k == 0 {
            self.start_recording(state);
        } else {
            self.go_on(&before, course);
        }
        let state = &mut course.state;
        plant.read_taps(state, &course.last);
        let signal = self.block.output(layout).and_then(|place| self.measured.signal(place));
        if let (Output::State(Reading { lagging: Some(reading), offset, .. }), Some(signal)) =
            (&self.output, signal)
        {
            state[*reading] = self.bumps[0] - *offset + signal.value[k];
            if let Some(drift) = self.block.gas().and_then(|gas| plant.gauge_drift(gas, time)) {
                state[*reading] -= drift;
            }
        }
    }

    /// Begin the gas at the temperature that its thermometer tells: at the first window of its
    /// pressure, which no other beginning changes, and at each window of its temperature.
    fn start_temperature(&self, k: usize, course: &mut Course<S>) {
        let (plant, state) = (&self.stepper.plant, &mut course.state);
        let (of_temperature, rest) =
            (matches!(self.block, Block::Temperature(_)), plant.rig().gas.temperature);
        let Some(gas) = self.block.gas().filter(|gas| plant.warms(*gas)) else { return };
        let Some(signal) = self.measured.thermometer(gas) else { return };
        if k > 0 && !of_temperature {
            return;
        }
        let off = if of_temperature { self.bumps[1] } else { constant(0.0) };
        let read = -off + signal.value[k];
        let thermometer = plant.thermometer(gas);
        // what the slope of a slow thermometer says may be no temperature of any gas
        let ahead = thermometer.map_or(constant(0.0), |(_, lag)| lag * signal.slope[k]);
        let possible = (0.5..2.0).contains(&((read + ahead).re() / rest));
        let ahead = if possible { ahead } else { constant(0.0) };
        let bump = if of_temperature { self.bumps[0] } else { self.bumps[1] };
        let mass = plant.rig().layout().mass(gas);
        state[mass] = plant.rest_mass(gas, state) * rest / (read + ahead + bump);
        if let Some((reading, _)) = thermometer {
            let late = if of_temperature { self.bumps[2] } else { constant(0.0) };
            state[reading] = read + late;
        }
    }

    /// The first window: gas at rest temperature, effects that have not moved.
    fn start_recording(&self, state: &mut [S]) {
        let plant = &self.stepper.plant;
        let (rig, layout) = (plant.rig(), plant.rig().layout());
        for (gas, end) in rig.wiring.beginnings() {
            let place = layout.pressure(gas);
            if let (None, Some(end)) = (self.measured.signal(place), end.place(layout)) {
                state[place] = state[end];
            }
        }
        for (gas, gauge) in behind_gauges(rig, self.measured) {
            state[layout.pressure(gas)] = state[gauge];
        }
        // at rest what nobody measures of a regulator's outlet is what it feeds
        if let Some(output) = self.block.output(layout) {
            for supply in unread(rig, self.block, self.measured) {
                let place = layout.supply(supply);
                let told = self.measured.outlets.iter().find(|(outlet, _)| *outlet == place);
                let near = fed_by(rig, supply);
                let fed = if near.contains(&output) { Some(&output) } else { near.first() };
                state[place] = match (told, fed) {
                    (Some((_, pressure)), _) => constant(*pressure),
                    (None, Some(fed)) => state[*fed],
                    (None, None) => state[place],
                };
            }
        }
        plant.start(state);
    }

    /// A new window keeps the gas temperature and the memory of the motion.
    fn go_on(&self, before: &[S], course: &mut Course<S>) {
        let plant = &self.stepper.plant;
        let layout = plant.rig().layout();
        let Course { state, memory, .. } = course;
        for gas in 0..layout.gases {
            let (rest, was) = (plant.rest_mass(gas, state), plant.rest_mass(gas, before));
            state[layout.mass(gas)] = rest * before[layout.mass(gas)] / was;
        }
        let contractions = |state: &[S]| {
            let mut now = vec![constant::<S>(0.0); memory.len()];
            plant.contractions(state, &mut now);
            now
        };
        let (from, to) = (contractions(before), contractions(state));
        plant.follow_muscles(state, memory, &from, &to);
    }

    /// Controls of the `j`th command of the recording from a time [s] on.
    fn command(&self, j: usize, time: f64, clocks: &Clocks<S>, out: &mut Controls<S>) {
        let (plant, commands) = (&self.stepper.plant, &self.measured.commands);
        if !plant.delayed() {
            // most commands are held over many samples
            if j == 0 || commands.iter().any(|command| command[j] != command[j - 1]) {
                plant.command(|input| commands[input][j], out);
            }
            return;
        }
        let held = self.measured.held;
        let last = (self.measured.samples * held) as i64 - 1;
        let command = |input: usize, sample: i64| match self.measured.set_before(plant.rig(), input)
        {
            Some(pressure) if sample < 0 => pressure,
            _ => commands[input][sample.clamp(0, last) as usize],
        };
        let each = self.timing.sample_time / held as f64;
        let step = self.timing.sample_time / self.substeps(j / held) as f64;
        plant.delayed_controls(clocks.command, time, step, each, command, out);
    }

    /// Steps from sample `k` to the next: no step sees two commands.
    fn substeps(&self, k: usize) -> usize {
        let (held, least) = (self.measured.held, self.timing.substeps);
        let own = k * held..(k + 1) * held;
        let one = |command: &&[f64]| command[own.clone()].iter().all(|u| *u == command[own.start]);
        if held == 1 || (!self.stepper.plant.delayed() && self.measured.commands.iter().all(one)) {
            return least;
        }
        least.div_ceil(held) * held
    }

    /// How much of a step [s] is taken next, some of it being done. The push of a stop jumps where a
    /// joint meets it, and a step over the jump turns the joint back too late: one ends just before
    /// it, and one that is next to nothing leads over it.
    fn part(&self, state: &[S], step: f64, done: f64) -> f64 {
        let left = 1.0 - done;
        if !matches!(self.block, Block::Arm(_)) {
            return left;
        }
        let until = self.stepper.plant.time_to_stop(state) / step;
        if until > FASTER * left {
            return left;
        }
        let part = match until {
            _ if until > NEAR_STOP => 0.5 * until,
            _ if until > AT_STOP => until - 0.5 * AT_STOP,
            _ => AT_STOP,
        };
        part.min(left)
    }

    /// The steps from sample `k` to the next.
    fn sample(
        &mut self,
        k: usize,
        course: &mut Course<S>,
        mut clocks: Clocks<S>,
        controls: &mut Controls<S>,
    ) {
        let (dt, held, substeps) = (self.timing.sample_time, self.measured.held, self.substeps(k));
        let h = 1.0 / substeps as f64;
        let step = dt / substeps as f64;
        let Course { state, memory, last } = course;
        for i in 0..substeps {
            let time = (k as f64 + i as f64 * h) * dt;
            if i > 0 && (held > 1 || self.stepper.plant.delayed()) {
                clocks = Clocks::of(&self.stepper.plant, self.block, time);
                self.command(k * held + i * held / substeps, time, &clocks, controls);
            }
            let mut from = 0.0;
            while from < 1.0 {
                let length = self.part(state, step, from);
                if let Some(port) = self.entry {
                    let at =
                        |fraction: f64| self.input(k, (i as f64 + from + fraction * length) * h);
                    self.stepper.input = Some((port, [at(0.0), at(0.5), at(1.0)]));
                }
                let (driving, taps) = (&self.driving, &self.driving_taps);
                let drive =
                    |plant: &Plant<'a, S>, controls: &Controls<S>, fraction: f64, y: &mut [S]| {
                        let (rig, share) = (plant.rig(), (i as f64 + from + fraction * length) * h);
                        for driver in driving {
                            driver.write(plant, k, share, dt, clocks.neighbour, y);
                        }
                        for (gas, valve) in taps {
                            let place = rig.layout().pressure(*gas);
                            // a smooth signal goes from one reading to the next, and so do the commands
                            // that they were read under
                            let (was, now) = (last.spool[*valve], controls.spool[*valve]);
                            // a spool with a motion of its own is already where it is at that instant
                            let moving = rig.wiring.ports.moves_valve(*valve);
                            let spool = if moving { now } else { was + (now - was) * share };
                            y[place] = plant.behind_tube(*gas, y[place], y, spool);
                        }
                    };
                let (time, step) = (time + from * step, step * length);
                self.stepper.step(state, memory, controls, time, step, &self.simulated, drive);
                from += length;
            }
        }
        if !self.taps.is_empty() || matches!(self.output, Output::Flow(..)) {
            last.spool.clone_from(&self.stepper.controls(controls, 2).spool);
        }
    }
}

impl<S: Scalar> Output<S> {
    fn new(plant: &Plant<'_, S>, block: Block, bumps: &[S]) -> Self {
        let rig = plant.rig();
        let (Block::Supply(k)
        | Block::Chamber(k)
        | Block::Temperature(k)
        | Block::Flow(k)
        | Block::Arm(k)
        | Block::Pull(k)) = block;
        match block {
            Block::Temperature(_) => return Self::Temperature(k, bumps[1]),
            Block::Flow(_) => return Self::Flow(k, bumps[0]),
            _ => {}
        }
        let Some(place) = block.output(rig.layout()) else {
            return Self::Pull(k, bumps[0]);
        };
        let zero = zero(plant, place);
        let gas = match block {
            Block::Chamber(k) => Some(k),
            _ => None,
        };
        let coordinate = match block {
            Block::Arm(k) => Some(k),
            _ => None,
        };
        let arm = coordinate.is_some();
        Self::State(Reading {
            coordinate,
            gas,
            reading: gas.map_or(place, |k| plant.reading(k)),
            lagging: gas.and_then(|k| plant.lagging(k)).map(|(reading, _)| reading),
            offset: if arm { zero } else { zero - rig.gas.ambient_pressure },
            mirrored: rest_length(rig).filter(|_| arm),
        })
    }
}

impl<S: Scalar> Reading<S> {
    /// The channel at a state.
    fn read(&self, plant: &Plant<'_, S>, state: &[S], time: f64) -> S {
        let value = state[self.reading];
        let value = match (self.coordinate, self.mirrored) {
            (_, Some(rest)) => -value + rest,
            (Some(k), None) => plant.read_angle(k, value),
            _ => value,
        };
        let drift = self.gas.and_then(|gas| plant.gauge_drift(gas, time));
        drift.map_or(value + self.offset, |drift| value + self.offset + drift)
    }
}
