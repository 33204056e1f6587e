//! Cut-chain simulation: measured signals drive a block, whose own output is predicted.
//!
//! Wherever a channel between two blocks was measured the chain is cut there (analytical redundancy), so that each block
//! has a residual of its own. Integrating blocks run over windows that start from the (smoothed) measurement;
//! the derivative with respect to the window's initial state comes along, so that its error can be projected out.

mod boundary;

pub use self::boundary::{Measured, Signal};
use crate::description::dotted;
use crate::effects::closure_flow;
use crate::plant::parameters::unit;
use crate::plant::{ClosureAt, Layout, Memory, ParameterId, Rig};
use crate::plant::{Controls, Plant, Simulated};
use crate::scalar::{constant, Scalar};
use crate::simulate::{check_state, Stepper, Timing};
use crate::{Error, Result};
use nalgebra::Const;
use num_dual::DualSVec64;

/// A block whose output channel is predicted from its measured neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Block {
    /// Commands and the pressures it feeds to a supply's pressure.
    Supply(usize),
    /// Commands, neighbouring pressures and the angles of its muscles to a chamber's pressure.
    Chamber(usize),
    /// Chamber pressures to the angle of a joint (muscles, joints and arm), or to the length of the muscle on a linear load.
    Arm(usize),
}

impl Block {
    /// The block of a name: `supply`, `chamber` or `arm` (`load` of a linear load), with the name of the supply, chamber or
    /// joint behind it where it has one (`chamber.flexor`).
    ///
    /// # Errors
    /// [`Error::Model`] for another name.
    pub fn from_name(rig: &Rig, name: &str) -> Result<Self> {
        let spec = rig.spec();
        let joints = rig.names().coordinates.iter().map(|n| n.replacen("joint", "arm", 1));
        let blocks = (spec
            .supplies
            .iter()
            .enumerate()
            .map(|(k, s)| (dotted("supply", &s.name), Self::Supply(k))))
        .chain(spec.chambers.iter().enumerate().map(|(k, c)| (dotted("chamber", &c.name), Self::Chamber(k))))
        .chain(joints.enumerate().map(|(k, name)| (name, Self::Arm(k))));
        let blocks: Vec<_> = blocks.collect();
        blocks.iter().find(|(n, _)| n == name).map(|(_, block)| *block).ok_or_else(|| {
            let names: Vec<_> = blocks.iter().map(|(n, _)| n.as_str()).collect();
            Error::Model(format!("no block '{name}' in this rig; there are: {}", names.join(", ")))
        })
    }

    /// Longest stable step [s] while its neighbours are driven.
    pub fn longest_step(self, rig: &Rig) -> f64 {
        match self {
            Self::Arm(_) => rig.body_step(),
            Self::Supply(_) | Self::Chamber(_) => rig.gas_step(),
        }
    }

    /// Place of the predicted state.
    fn output(self, layout: &Layout) -> usize {
        match self {
            Self::Supply(k) => layout.supply(k),
            Self::Chamber(k) => layout.pressure(k),
            Self::Arm(k) => layout.angle(k),
        }
    }

    /// States of the block that a window starts from, in the order of their sensitivities.
    fn initial_states(self, layout: &Layout) -> Vec<usize> {
        match self {
            Self::Supply(_) | Self::Chamber(_) => vec![self.output(layout)],
            Self::Arm(_) => (layout.angle(0)..layout.extra(0)).collect(),
        }
    }

    /// Number of initial states per window.
    pub fn initial_count(self, rig: &Rig) -> usize {
        self.initial_states(rig.layout()).len()
    }

    /// States that are integrated: the block's, and those of line inlets, which nobody measures.
    fn simulated(self, rig: &Rig, measured: &Measured<'_>) -> Simulated {
        let layout = rig.layout();
        let mut places = self.initial_states(layout);
        match self {
            Self::Chamber(k) => {
                places.push(layout.mass(k));
                let closure = rig.wiring.gases[k].closure.map(|place| layout.extra(place));
                places.extend(closure.into_iter().flat_map(|first| first..first + closure_flow::STATES));
            }
            Self::Arm(_) => places.extend(layout.extra(0)..layout.states()),
            Self::Supply(k) => {
                places.extend(rig.wiring.supply_effects[k].closure.map(|place| layout.extra(place)));
            }
        }
        if !matches!(self, Self::Arm(_)) {
            places.extend(hidden(layout, measured));
        }
        Simulated::only(layout, &places)
    }
}

/// Pressures of line inlets that were not measured.
fn hidden(layout: &Layout, measured: &Measured<'_>) -> Vec<usize> {
    let inlets = (layout.chambers..layout.gases).map(|k| layout.pressure(k));
    inlets.filter(|place| measured.signal(*place).is_none()).collect()
}

/// Prediction of a block's output with its sensitivities.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Predicted output at each sample, as the sensor reads it.
    pub value: Vec<f64>,
    /// Row-major `samples x (parameters + initial states)`: derivatives with respect to each parameter and to the
    /// initial states of the window that the row belongs to.
    pub jacobian: Vec<f64>,
    /// Columns of the jacobian.
    pub columns: usize,
}

const LANES: usize = 8;

/// Predict a block's output over windows.
///
/// `starts` are the sample indices at which windows begin (rising, the first one 0). `parameters` are those to
/// differentiate with respect to; pass none for values alone (`columns` is then 0).
///
/// # Errors
/// [`Error::Parameter`] for bad arguments; [`Error::Model`] when the block lacks a measured neighbour;
/// [`Error::Integration`] when the state leaves the model's range.
pub fn predict(
    rig: &Rig,
    block: Block,
    measured: &Measured<'_>,
    timing: Timing,
    starts: &[usize],
    parameters: &[ParameterId],
) -> Result<Prediction> {
    let n = measured.samples;
    check(rig, block, measured, starts)?;
    let initial = block.initial_count(rig);
    let mut out = Prediction { value: vec![0.0; n], jacobian: Vec::new(), columns: 0 };
    if parameters.is_empty() {
        let plant = Plant::new(rig, rig.parameters().lift(), false)?;
        run(plant, block, measured, timing, starts, &vec![0.0; initial], |k, y, _, _, _| out.value[k] = y)?;
        return Ok(out);
    }
    out.columns = parameters.len() + initial;
    out.jacobian = vec![0.0; n * out.columns];
    let columns: Vec<usize> = (0..out.columns).collect();
    for chunk in columns.chunks(LANES) {
        let mut values = rig.parameters().lift::<DualSVec64<LANES>>();
        let mut bumps = vec![constant::<DualSVec64<LANES>>(0.0); initial];
        for (lane, column) in chunk.iter().enumerate() {
            match parameters.get(*column) {
                Some(id) => values.seed(*id, lane),
                None => bumps[column - parameters.len()].eps = unit(lane),
            }
        }
        let plant = Plant::new(rig, values, false)?;
        let (value, jacobian, width) = (&mut out.value, &mut out.jacobian, out.columns);
        run(plant, block, measured, timing, starts, &bumps, |k, y, _, _, _| {
            value[k] = y.re;
            let gradient = y.eps.unwrap_generic(Const::<LANES>, Const::<1>);
            for (column, slope) in chunk.iter().zip(gradient.iter()) {
                jacobian[k * width + column] = *slope;
            }
        })?;
    }
    Ok(out)
}

/// Terms of the closure in a block at each sample of a prediction, row-major `samples x terms`, and their number: what its
/// coefficients multiply.
///
/// # Errors
/// As [`predict`]; [`Error::Model`] for a block without a closure.
pub fn closure_terms(
    rig: &Rig,
    block: Block,
    measured: &Measured<'_>,
    timing: Timing,
    starts: &[usize],
) -> Result<(Vec<f64>, usize)> {
    check(rig, block, measured, starts)?;
    let (at, id) = match block {
        Block::Supply(k) => (ClosureAt::Supply(k), "closure_supply"),
        Block::Chamber(k) => (ClosureAt::Chamber(k), "closure_flow"),
        Block::Arm(k) => (ClosureAt::Joint(k), "closure_torque"),
    };
    let plant = Plant::new(rig, rig.parameters().lift(), false)?;
    let (mut found, mut count) = (Vec::new(), 0);
    let bumps = vec![0.0; block.initial_count(rig)];
    run(plant, block, measured, timing, starts, &bumps, |_, _, stepper, state, controls| {
        let terms = stepper.plant.closure_terms(at, state, controls, &stepper.scratch);
        count = terms.len();
        found.extend(terms);
    })?;
    if count == 0 {
        return Err(Error::Model(format!("block '{block:?}' has no closure: the effect {id} is not there")));
    }
    Ok((found, count))
}

fn check(rig: &Rig, block: Block, measured: &Measured<'_>, starts: &[usize]) -> Result<()> {
    let n = measured.samples;
    if starts.first() != Some(&0)
        || starts.windows(2).any(|w| w[1] <= w[0])
        || starts.last().is_some_and(|s| *s >= n)
    {
        let worst = starts.last().copied().unwrap_or(0) as f64;
        return Err(Error::parameter("starts", worst, format!("sample indices rising from 0, below {n}")));
    }
    if matches!(block, Block::Arm(_)) && rig.spec().load.as_ref().is_some_and(|load| load.is_frame()) {
        return Err(Error::Model("the block load cannot be predicted: a frame holds the length".into()));
    }
    let hidden = hidden(rig.layout(), measured);
    for place in neighbours(rig, block) {
        if measured.signal(place).is_none() && !hidden.contains(&place) {
            let name = rig.names().initial.iter().find(|(_, p)| *p == place).map_or("?", |(n, _)| n.as_str());
            return Err(Error::Model(format!(
                "block '{block:?}' cannot be predicted: {name} was not measured"
            )));
        }
    }
    Ok(())
}

/// Places of the states that a block needs measured: its own, every angle, and the pressures next to it.
fn neighbours(rig: &Rig, block: Block) -> Vec<usize> {
    let (layout, wiring) = (rig.layout(), &rig.wiring);
    let mut places: Vec<usize> = (layout.angle(0)..layout.rate(0)).collect();
    places.push(block.output(layout));
    if matches!(block, Block::Arm(_)) {
        places.extend(wiring.groups.iter().map(|g| layout.pressure(g.chamber)));
        return places;
    }
    let valves = wiring.valves.iter().map(|v| (v.from.place(layout), Some(layout.pressure(v.to))));
    let lines = wiring.lines.iter().map(|l| (l.from.place(layout), l.to.place(layout)));
    for (a, b) in valves.chain(lines) {
        if a == Some(block.output(layout)) {
            places.extend(b);
        } else if b == Some(block.output(layout)) {
            places.extend(a);
        }
    }
    // The pressure of a constant supply is known without measuring it.
    let constant = |place: &usize| rig.spec().supplies.get(*place).is_some_and(|s| s.kind == "constant");
    places.retain(|place| !constant(place));
    places
}

/// A measured state with what to subtract from its sensor's reading.
struct Driven<'a, S> {
    place: usize,
    signal: Signal<'a>,
    zero: S,
    /// Time constant of its sensor [s].
    lag: S,
    /// Whether another clock than the block's records it.
    shifted: bool,
    /// Length of the muscles at rest [m], where a length stands for the shortening of a linear load; `zero` is then that of the
    /// shortening, the length's with the other sign.
    rest: Option<f64>,
}

impl<S: Scalar> Driven<'_, S> {
    /// True state at a fraction of sample `k`, read so much later [s] where another clock records it; an angle brings its rate along.
    #[inline]
    fn write(&self, rig: &Rig, k: usize, fraction: f64, dt: f64, shift: S, state: &mut [S]) {
        let layout = rig.layout();
        let (cell, t, inside) =
            if self.shifted { self.signal.later(k, fraction, dt, shift.re()) } else { (k, fraction, false) };
        let (value, slope) = self.signal.at(cell, t, dt);
        let (value, slope, sign) = self.rest.map_or((value, slope, 1.0), |rest| (rest - value, -slope, -1.0));
        let pressure = self.place < layout.angle(0);
        if pressure {
            state[self.place] = -self.zero + (value + rig.gas.ambient_pressure) + self.lag * slope;
        } else {
            state[self.place] = -self.zero + value;
            state[self.place + layout.coordinates] = constant(slope);
        }
        if inside {
            // what the shift's own derivatives add
            let (more, bend) = (shift - shift.re(), self.signal.curvature(cell, t, dt) * sign);
            if pressure {
                state[self.place] += more * slope + self.lag * more * bend;
            } else {
                state[self.place] += more * slope;
                state[self.place + layout.coordinates] += more * bend;
            }
        }
    }
}

/// Gases (and their valves) whose measured pressure is that in front of a tube, where what feeds the valve is measured, constant or
/// the block's own: the pressure behind can then be told.
fn taps<S: Scalar>(plant: &Plant<'_, S>, block: Block, measured: &Measured<'_>) -> Vec<(usize, usize)> {
    let (rig, layout) = (plant.rig(), plant.rig().layout());
    let known = |place: usize| {
        let constant = rig.spec().supplies.get(place).is_some_and(|s| s.kind == "constant");
        constant || place == block.output(layout) || measured.signal(place).is_some()
    };
    let fed = plant.taps().filter(|(gas, _)| measured.signal(layout.pressure(*gas)).is_some());
    fed.filter(|(_, valve)| rig.wiring.valves[*valve].from.place(layout).is_none_or(known)).collect()
}

/// Zero of the sensor of a state.
#[inline]
fn zero<S: Scalar>(plant: &Plant<'_, S>, place: usize) -> S {
    let (rig, layout) = (plant.rig(), plant.rig().layout());
    let id = if place < layout.supplies {
        None
    } else if place < layout.mass(0) {
        rig.wiring.gases[place - layout.supplies].pressure_zero
    } else {
        rig.wiring.coordinates[place - layout.angle(0)].zero
    };
    id.map_or(constant(0.0), |id| plant.values()[id])
}

/// Time constant of the sensor of a state [s].
fn lag<S: Scalar>(plant: &Plant<'_, S>, place: usize) -> S {
    let (rig, layout) = (plant.rig(), plant.rig().layout());
    let gases = layout.pressure(0)..layout.mass(0);
    let lags = gases.contains(&place) && rig.wiring.gases[place - layout.supplies].lag.is_some();
    match rig.wiring.effects.pressure_lag {
        Some([time_constant]) if lags => plant.values()[time_constant],
        _ => constant(0.0),
    }
}

fn run<S: Scalar>(
    plant: Plant<'_, S>,
    block: Block,
    measured: &Measured<'_>,
    timing: Timing,
    starts: &[usize],
    bumps: &[S],
    mut sink: impl FnMut(usize, S, &Stepper<'_, S>, &[S], &Controls<S>),
) -> Result<()> {
    let rig = plant.rig();
    let layout = rig.layout();
    let simulated = block.simulated(rig, measured);
    let (dt, ambient) = (timing.sample_time, rig.gas.ambient_pressure);
    let (output, own) = (block.output(layout), block.initial_states(layout));
    let offset: S = match block {
        Block::Arm(_) => zero(&plant, output),
        Block::Supply(_) | Block::Chamber(_) => zero(&plant, output) - ambient,
    };
    // What is read in the place of the pressure, and by a lagging sensor.
    let (reading, lagging) = match block {
        Block::Chamber(k) => (plant.reading(k), rig.wiring.gases[k].lag.map(|lag| layout.extra(lag))),
        _ => (output, None),
    };
    let n = measured.samples;
    let rest =
        rig.spec().load.as_ref().and_then(|_| rig.wiring.groups.first()).map(|group| group.rest_length);
    let mirrored = rest.filter(|_| matches!(block, Block::Arm(_)));
    let drivers: Vec<Driven<'_, S>> = (measured.signals.iter())
        .map(|(place, signal)| {
            let (zero, rest) = (zero(&plant, *place), rest.filter(|_| *place == layout.angle(0)));
            Driven {
                place: *place,
                signal: *signal,
                zero: if rest.is_some() { -zero } else { zero },
                lag: lag(&plant, *place),
                rest,
                // a block's own clock is that of what it predicts
                shifted: plant.skewed() && (*place < layout.angle(0)) == matches!(block, Block::Arm(_)),
            }
        })
        .collect();
    let skewed = plant.skewed();
    // How much later a shifted neighbour is read than it is recorded, and how late a command acts.
    let clocks = |plant: &Plant<'_, S>, time: f64| {
        if !skewed {
            return (constant(0.0), constant(0.0));
        }
        let (pressures, angles) = plant.skew(time);
        match block {
            Block::Arm(_) => (pressures - angles, angles),
            Block::Supply(_) | Block::Chamber(_) => (angles - pressures, pressures),
        }
    };
    let driving: Vec<_> = drivers.iter().filter(|driver| !own.contains(&driver.place)).collect();
    let taps = taps(&plant, block, measured);
    let driving_taps: Vec<_> =
        taps.iter().copied().filter(|(gas, _)| !own.contains(&layout.pressure(*gas))).collect();
    let mut stepper = Stepper::new(plant);
    stepper.reads = matches!(block, Block::Chamber(_));
    // The controls under which a sample was read: those before it.
    let mut last = stepper.plant.controls(|_| 0.0);
    last.spool.fill(constant(0.0));
    let mut memory = vec![Memory::default(); rig.wiring.groups.len()];
    let mut state = vec![constant::<S>(0.0); stepper.plant.states()];
    // What nobody measures begins at rest, and stays there unless it is a line's inlet.
    for (k, supply) in rig.spec().supplies.iter().enumerate() {
        state[layout.supply(k)] = constant(supply.initial_pressure + ambient);
    }
    for (k, gas) in rig.wiring.gases.iter().enumerate() {
        state[layout.pressure(k)] = constant(gas.initial_pressure + ambient);
    }
    for (k, coordinate) in rig.wiring.coordinates.iter().enumerate() {
        state[layout.angle(k)] = constant(coordinate.rest);
    }
    let mut contractions = [vec![constant::<S>(0.0); memory.len()], vec![constant::<S>(0.0); memory.len()]];
    let mut starts = starts.iter().peekable();
    for k in 0..n {
        if starts.next_if(|s| **s == k).is_some() {
            let before = state.clone();
            let plant = &stepper.plant;
            let (shift, _) = clocks(plant, k as f64 * dt);
            drivers.iter().for_each(|driver| driver.write(rig, k, 0.0, dt, shift, &mut state));
            for (gas, valve) in &taps {
                let place = layout.pressure(*gas);
                state[place] = plant.behind_tube(*gas, state[place], &state, last.spool[*valve]);
            }
            for (place, bump) in own.iter().zip(bumps) {
                state[*place] += *bump;
            }
            if k == 0 {
                for (inlet, (_, end)) in rig.wiring.inlets.iter().enumerate() {
                    let place = layout.pressure(rig.wiring.chambers + inlet);
                    if let (None, Some(end)) = (measured.signal(place), end.place(layout)) {
                        state[place] = state[end];
                    }
                }
                for gas in 0..layout.gases {
                    state[layout.mass(gas)] = plant.initial_mass(gas, &state);
                }
                plant.start_effects(&mut state);
                memory = plant.fresh_memory(&state);
            } else {
                // a new window keeps the gas temperature and the memory of the motion
                for gas in 0..layout.gases {
                    let (rest, was) = (plant.rest_mass(gas, &state), plant.rest_mass(gas, &before));
                    state[layout.mass(gas)] = rest * before[layout.mass(gas)] / was;
                }
                let [from, to] = &mut contractions;
                plant.contractions(&before, from);
                plant.contractions(&state, to);
                plant.advance_memory(&mut memory, from, to);
            }
            plant.read_taps(&mut state, &last);
            if let (Some(reading), Some(signal)) = (lagging, measured.signal(output)) {
                state[reading] = bumps[0] - offset + signal.value[k];
            }
        }
        check_state(&stepper.plant, &state, k as f64 * dt)?;
        let command = |input: usize, sample: i64| {
            let row = sample.clamp(0, n as i64 - 1) as usize;
            measured.commands[input][row]
        };
        let mut controls = stepper.plant.controls(|input| measured.commands[input][k]);
        let (mut shift, mut late) = clocks(&stepper.plant, k as f64 * dt);
        if skewed {
            controls = stepper.plant.skewed_controls(late, k as f64 * dt, timing.step(), dt, command);
        }
        let read = mirrored.map_or(state[reading], |rest| -state[reading] + rest) + offset;
        sink(k, read, &stepper, &state, &controls);
        if k + 1 == n {
            break;
        }
        let h = 1.0 / timing.substeps as f64;
        for i in 0..timing.substeps {
            let time = (k as f64 + i as f64 * h) * dt;
            if skewed && i > 0 {
                (shift, late) = clocks(&stepper.plant, time);
                controls = stepper.plant.skewed_controls(late, time, timing.step(), dt, command);
            }
            stepper.step(
                &mut state,
                &mut memory,
                &controls,
                time,
                timing.step(),
                &simulated,
                |plant, controls, fraction, y| {
                    let share = (i as f64 + fraction) * h;
                    for driver in &driving {
                        driver.write(rig, k, share, dt, shift, y);
                    }
                    for (gas, valve) in &driving_taps {
                        // a smooth signal goes from one reading to the next, and so do the commands that they were read under
                        let (place, was) = (layout.pressure(*gas), last.spool[*valve]);
                        let now = controls.spool[*valve];
                        // a spool with a motion of its own is already where it is at that instant
                        let moves = rig.wiring.valves[*valve].effects.spool.is_some();
                        let spool = if moves { now } else { was + (now - was) * share };
                        y[place] = plant.behind_tube(*gas, y[place], y, spool);
                    }
                },
            );
        }
        if !taps.is_empty() {
            last.spool.clone_from(&stepper.controls(&controls, 2).spool);
        }
    }
    Ok(())
}
