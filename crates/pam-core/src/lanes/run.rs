//! Runs: blocks of rows over threads, rows of a block in lanes, each sample read as it comes.

use super::num::{side_by_side, Num, MOST_LANES};
use super::rates::Lanes;
use super::request::{resting, Checked, Outcome, Request};
use super::steps::Steps;
use super::Plan;
use crate::blocks::valve::spool_position;
use crate::plant::{Channel, Plant, Rig, Scratch};
use crate::simulate::batch::Failure;
use crate::simulate::drive::Drive;
use crate::simulate::run::Run;
use crate::simulate::team::Team;
use crate::simulate::{Progress, Timing, Trajectory};
use crate::{Error, Result};
use pulp::{Arch, Scalar, Simd, WithSimd};

/// Rows of a block: some milliseconds of work.
const BLOCK: usize = 64;
/// Rows that run faster two by two than in wide registers.
const FEW: usize = 4;
/// RK4 steps of all rows between two looks outside.
const STEPS_UNSEEN: usize = 4_000_000;
/// RK4 steps that are worth a second thread.
const WORTH_A_THREAD: usize = 2_000;

/// Simulate many plants.
///
/// # Errors
/// As [`Checked::new`], [`Rig::with_values`] and [`crate::simulate::Initial::with`], with the
/// number of the row; that of `look`, which is called now and then.
pub fn simulate(
    rig: &Rig,
    request: &Request<'_>,
    look: &mut dyn FnMut() -> Result<()>,
) -> Result<Outcome> {
    let resting = resting(rig, request.rows);
    let checked = Checked::new(rig, request, &resting)?;
    let steps = Steps::new(&checked)?;
    let (plants, kept) = (request.plants, request.rows.div_ceil(request.every.max(1)));
    let mut recorded = vec![vec![0.0; plants * kept]; request.record.len()];
    let mut reduced = vec![vec![0.0; plants]; request.reduce.len()];
    let mut failures = vec![None; plants];
    let mut blocks = Block::all(&mut recorded, &mut reduced, &mut failures, kept);
    let work = Work { checked: &checked, steps: &steps, arch: Arch::new() };
    let mut team = Team::new(request.threads);
    let each = request.rows.max(1) * (0..plants).map(|k| steps.of(k)).max().unwrap_or(1);
    let together = (STEPS_UNSEEN / (each * BLOCK)).max(request.threads);
    let mut wrong = Ok(());
    for some in blocks.chunks_mut(together) {
        let worth = each * some.len() * BLOCK.min(plants) > WORTH_A_THREAD;
        team.share(some, worth, |block| block.error = work.block(block).err());
        if let Some(error) = some.iter_mut().find_map(|block| block.error.take()) {
            wrong = Err(error);
            break;
        }
        look()?;
    }
    wrong?;
    Ok(Outcome { recorded, reduced, failures })
}

/// Neighbouring rows and where their results go.
struct Block<'o> {
    first: usize,
    recorded: Vec<&'o mut [f64]>,
    reduced: Vec<&'o mut [f64]>,
    failures: &'o mut [Option<Failure>],
    error: Option<Error>,
}

impl<'o> Block<'o> {
    fn all(
        recorded: &'o mut [Vec<f64>],
        reduced: &'o mut [Vec<f64>],
        failures: &'o mut [Option<Failure>],
        kept: usize,
    ) -> Vec<Self> {
        let mut blocks: Vec<Self> = failures
            .chunks_mut(BLOCK)
            .enumerate()
            .map(|(k, failures)| Self {
                first: k * BLOCK,
                recorded: Vec::new(),
                reduced: Vec::new(),
                failures,
                error: None,
            })
            .collect();
        for channel in recorded {
            for (block, part) in blocks.iter_mut().zip(channel.chunks_mut(BLOCK * kept.max(1))) {
                block.recorded.push(part);
            }
        }
        for number in reduced {
            for (block, part) in blocks.iter_mut().zip(number.chunks_mut(BLOCK)) {
                block.reduced.push(part);
            }
        }
        blocks
    }
}

/// What all blocks share.
struct Work<'w, 'r> {
    checked: &'w Checked<'w, 'r>,
    steps: &'w Steps,
    arch: Arch,
}

impl Work<'_, '_> {
    /// Every row of a block: in lanes where the rig and the row allow it, else one by one.
    fn block(&self, block: &mut Block<'_>) -> Result<()> {
        let count = block.failures.len();
        let mut left: Vec<usize> = (0..count).collect();
        if let Some(plan) = self.checked.rig.lanes().filter(|_| self.in_lanes()) {
            let mut alone = Vec::new();
            while let Some(first) = left.first().copied() {
                let steps = self.steps.of(block.first + first);
                let (same, others) =
                    left.iter().partition(|row| self.steps.of(block.first + **row) == steps);
                left = others;
                let same: Vec<usize> = same;
                let group = Group { work: self, plan, steps, rows: &same, block };
                // A few rows have no use for wide registers.
                alone.extend(if group.rows.len() <= FEW {
                    group.with_simd(Scalar)?
                } else {
                    self.arch.dispatch(group)?
                });
            }
            left = alone;
        }
        left.into_iter().try_for_each(|row| self.alone(block, row))
    }

    /// Whether nothing is prescribed.
    fn in_lanes(&self) -> bool {
        let request = self.checked.request;
        let inputs = &self.checked.rig.names().inputs;
        request.signals.iter().all(|(name, _)| inputs.iter().any(|input| input == name))
    }

    /// One row as [`crate::simulate::simulate`] runs it.
    fn alone(&self, block: &mut Block<'_>, row: usize) -> Result<()> {
        let request = self.checked.request;
        let plant = block.first + row;
        let rig = self.checked.rig.with_values(&self.checked.values(plant))?;
        let timing = Timing { substeps: self.steps.of(plant), ..request.timing };
        let mut trajectory = Trajectory::new(&rig, request.rows);
        let mut progress = Progress::start(&rig, &self.checked.initial(plant)?)?;
        let signals: Vec<(&str, &[f64])> = (request.signals.iter())
            .map(|(name, signal)| (*name, signal.of(plant, request.rows)))
            .collect();
        let drive = Drive::new(&rig, request.rows, &signals)?;
        let mut done = progress.observe(&rig, timing, &mut trajectory);
        if done.is_ok() {
            let samples = 0..request.rows.saturating_sub(1);
            let mut run = Run::new(&rig)?;
            done = progress.advance_in(
                &mut run,
                timing,
                &drive,
                samples,
                &mut trajectory,
                &mut || Ok(()),
            );
        }
        let failure = match done {
            Ok(()) => None,
            Err(error @ Error::Integration { time, .. }) => {
                Some(Failure { time, message: error.to_string() })
            }
            Err(other) => return Err(other),
        };
        self.written(block, row, &trajectory, failure);
        Ok(())
    }

    /// Write the results of a row that ran alone.
    fn written(
        &self,
        block: &mut Block<'_>,
        row: usize,
        trajectory: &Trajectory,
        failure: Option<Failure>,
    ) {
        let request = self.checked.request;
        let kept = request.rows.div_ceil(request.every);
        for (out, channel) in block.recorded.iter_mut().zip(&request.record) {
            let samples = &trajectory.channels[*channel];
            let last = samples.last().copied().unwrap_or(f64::NAN);
            for (k, value) in out[row * kept..(row + 1) * kept].iter_mut().enumerate() {
                *value = samples.get(k * request.every).copied().unwrap_or(last);
            }
        }
        for (out, reduce) in block.reduced.iter_mut().zip(&request.reduce) {
            let samples = trajectory.channels[reduce.channel].iter().enumerate();
            let (rows, time) = (request.rows, request.timing.sample_time);
            let sum = samples
                .fold(reduce.start(), |sum, (k, value)| reduce.with(sum, *value, k, rows, time));
            out[row] = if failure.is_some() { f64::NAN } else { sum };
        }
        block.failures[row] = failure;
    }
}

/// Rows of a block with the same step.
struct Group<'g, 'o, 'w, 'r> {
    work: &'g Work<'w, 'r>,
    plan: &'g Plan,
    steps: usize,
    rows: &'g [usize],
    block: &'g mut Block<'o>,
}

impl WithSimd for Group<'_, '_, '_, '_> {
    /// Rows that have to run alone.
    type Output = Result<Vec<usize>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut alone = Vec::new();
        for rows in self.rows.chunks(side_by_side::<S>()) {
            match Flight::new(simd, self.work, self.plan, self.steps, rows, self.block)? {
                Some(mut flight) => alone.extend(flight.fly(self.block)),
                None => alone.extend(rows),
            }
        }
        Ok(alone)
    }
}

/// How a channel is read of the state.
enum Read {
    /// A state times a sign, and for each lane what is added.
    State { place: usize, sign: f64, more: Vec<f64> },
    /// Not a state: what the plant observes.
    Observed(usize),
}

/// Room for what is no state: that of each lane's equations, and one sample of every channel.
type Observed = (Vec<Scratch<f64>>, Vec<Vec<f64>>);

/// Rows side by side from their start to their end.
struct Flight<'a, 'w, 'r, S: Simd> {
    simd: S,
    work: &'a Work<'w, 'r>,
    plan: &'a Plan,
    rows: &'a [usize],
    first: usize,
    plants: Vec<Plant<'a, f64>>,
    lanes: Lanes<'a, S>,
    state: Vec<Num<S>>,
    step: f64,
    steps: usize,
    reads: Vec<Read>,
    observed: Option<Observed>,
    /// Lanes that have left the range.
    gone: Vec<bool>,
}

impl<'a, 'w, 'r, S: Simd> Flight<'a, 'w, 'r, S> {
    /// Rows at their start; none where this rig does not fly.
    #[inline(always)]
    fn new(
        simd: S,
        work: &'a Work<'w, 'r>,
        plan: &'a Plan,
        steps: usize,
        rows: &'a [usize],
        block: &Block<'_>,
    ) -> Result<Option<Self>> {
        let (checked, first) = (work.checked, block.first);
        let request = checked.request;
        let wanted = wanted(request);
        let sums = wanted.iter().any(|k| needs_sums(checked.rig, *k));
        // The lanes that are left over run as the last row does.
        let row_of = |lane: usize| first + rows[lane.min(rows.len() - 1)];
        let (mut plants, mut starts) = (Vec::new(), Vec::new());
        for lane in 0..side_by_side::<S>() {
            let values = checked.rig.parameters().with_values(&checked.values(row_of(lane)))?;
            let plant = Plant::new(checked.rig, values.lift(), sums)?;
            let mut start = checked.initial(row_of(lane))?.state(checked.rig, plant.states());
            for gas in 0..checked.rig.layout.gases {
                start[checked.rig.layout.mass(gas)] = plant.initial_mass(gas, &start);
            }
            plants.push(plant);
            starts.push(start);
        }
        let Some(lanes) = Lanes::new(simd, plan, &plants, sums) else { return Ok(None) };
        let column = |k: usize| {
            let values: Vec<f64> = starts.iter().map(|start| start[k]).collect();
            Num::load(simd, &values)
        };
        let state = (0..lanes.states()).map(column).collect();
        let reads: Vec<Read> = wanted.iter().map(|k| read(checked.rig, &plants, *k)).collect();
        let observes = reads.iter().any(|read| matches!(read, Read::Observed(_)));
        let observed = observes.then(|| {
            let scratches = plants.iter().map(Plant::scratch).collect();
            (scratches, vec![Vec::new(); checked.rig.names().channels.len()])
        });
        let step = request.timing.sample_time / steps as f64;
        let gone = vec![false; side_by_side::<S>()];
        Ok(Some(Self {
            simd,
            work,
            plan,
            rows,
            first,
            plants,
            lanes,
            state,
            step,
            steps,
            reads,
            observed,
            gone,
        }))
    }

    /// Run to the end; the rows that have to run alone.
    #[inline(always)]
    fn fly(&mut self, block: &mut Block<'_>) -> Vec<usize> {
        let request = self.work.checked.request;
        let mut sums: Vec<Vec<f64>> =
            request.reduce.iter().map(|r| vec![r.start(); side_by_side::<S>()]).collect();
        let mut room = Rk4::new(&self.state);
        for row in 0..request.rows {
            if row > 0 {
                self.command(row - 1);
                for _ in 0..self.steps {
                    room.step(&mut self.lanes, &mut self.state, self.step);
                }
            }
            self.check();
            self.look(row, block, &mut sums);
            if self.gone.iter().all(|gone| *gone) {
                break;
            }
        }
        for (out, sums) in block.reduced.iter_mut().zip(&sums) {
            for (lane, row) in self.rows.iter().enumerate() {
                out[*row] = sums[lane];
            }
        }
        let gone = |(lane, row): (usize, &usize)| self.gone[lane].then_some(*row);
        self.rows.iter().enumerate().filter_map(gone).collect()
    }

    /// Set the commands of a sample.
    #[inline(always)]
    fn command(&mut self, sample: usize) {
        let (checked, rows) = (self.work.checked, self.work.checked.request.rows);
        let rig = checked.rig;
        let row_of = |lane: usize| self.first + self.rows[lane.min(self.rows.len() - 1)];
        let mut values = [0.0; MOST_LANES];
        let values = &mut values[..side_by_side::<S>()];
        for (k, unit) in rig.wiring.valves.iter().enumerate() {
            for (lane, value) in values.iter_mut().enumerate() {
                let command = checked.commands[k].of(row_of(lane), rows)[sample];
                let valve = &self.plants[lane].valves[k];
                let spool: f64 = spool_position(command, valve.null, unit.half_range);
                *value = valve.area * unit.table.eval(spool.abs()) * spool.signum();
            }
            self.lanes.open(k, values);
        }
        let mut regulator = rig.wiring.valves.len();
        for (k, spec) in rig.spec().supplies.iter().enumerate() {
            let regulated = spec.kind == "regulator";
            for (lane, value) in values.iter_mut().enumerate() {
                let gauge = if regulated {
                    checked.commands[regulator].of(row_of(lane), rows)[sample]
                } else {
                    spec.initial_pressure
                };
                *value = gauge + rig.gas.ambient_pressure;
            }
            regulator += usize::from(regulated);
            self.lanes.set_pressure[k] = Num::load(self.simd, values);
        }
    }

    /// Note which lanes have left the range in which the model, or the curves, hold.
    #[inline(always)]
    fn check(&mut self) {
        let layout = self.work.checked.rig.layout;
        for (place, value) in self.state.iter().enumerate().take(layout.states()) {
            let pressure = place < layout.mass(0);
            let angle = place >= layout.angle(0) && place < layout.rate(0);
            for (gone, value) in self.gone.iter_mut().zip(value.numbers()) {
                let bad = !value.is_finite()
                    || (pressure && *value < 0.0)
                    || (angle && !self.plan.contains(*value));
                *gone |= bad;
            }
        }
    }

    /// Write a sample down.
    #[inline(always)]
    fn look(&mut self, row: usize, block: &mut Block<'_>, sums: &mut [Vec<f64>]) {
        let request = self.work.checked.request;
        let keeps = row.is_multiple_of(request.every);
        if !keeps && request.reduce.is_empty() {
            return;
        }
        let values = self.values();
        let kept = request.rows.div_ceil(request.every);
        if keeps {
            for (out, values) in block.recorded.iter_mut().zip(&values) {
                for (lane, at) in self.rows.iter().enumerate() {
                    out[at * kept + row / request.every] = values[lane];
                }
            }
        }
        let recorded = request.record.len();
        for ((reduce, sums), values) in request.reduce.iter().zip(sums).zip(&values[recorded..]) {
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum = reduce.with(*sum, *value, row, request.rows, request.timing.sample_time);
            }
        }
    }

    /// Every wanted channel of each lane: those that are kept, then those that are reduced.
    #[inline(always)]
    fn values(&mut self) -> Vec<[f64; MOST_LANES]> {
        let mut out = vec![[0.0; MOST_LANES]; self.reads.len()];
        for (out, read) in out.iter_mut().zip(&self.reads) {
            if let Read::State { place, sign, more } = read {
                let state = self.state[*place].numbers();
                for (lane, value) in out.iter_mut().enumerate().take(side_by_side::<S>()) {
                    *value = sign * state[lane] + more[lane];
                }
            }
        }
        let Some((scratches, channels)) = &mut self.observed else { return out };
        for (lane, (plant, scratch)) in self.plants.iter().zip(scratches).enumerate() {
            let state: Vec<f64> = self.state.iter().map(|value| value.numbers()[lane]).collect();
            channels.iter_mut().for_each(Vec::clear);
            plant.observe(&state, &plant.fresh_memory(), scratch, channels);
            for (out, read) in out.iter_mut().zip(&self.reads) {
                if let Read::Observed(channel) = read {
                    out[lane] = channels[*channel][0];
                }
            }
        }
        out
    }
}

/// The classical Runge-Kutta method over lanes.
struct Rk4<S: Simd> {
    stage: Vec<Num<S>>,
    rate: Vec<Num<S>>,
    sum: Vec<Num<S>>,
}

impl<S: Simd> Rk4<S> {
    fn new(state: &[Num<S>]) -> Self {
        let zeros = || state.iter().map(|value| value.constant(0.0)).collect::<Vec<_>>();
        Self { stage: zeros(), rate: zeros(), sum: zeros() }
    }

    #[inline(always)]
    fn step(&mut self, lanes: &mut Lanes<'_, S>, state: &mut [Num<S>], step: f64) {
        // The rates stand here once: they are much code, and compiled for each kind of register.
        for sum in &mut self.sum {
            *sum = sum.constant(0.0);
        }
        for (fraction, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            for ((stage, start), slope) in self.stage.iter_mut().zip(&*state).zip(&self.rate) {
                *stage = *start + *slope * (fraction * step);
            }
            lanes.rates(&self.stage, &mut self.rate);
            for (sum, slope) in self.sum.iter_mut().zip(&self.rate) {
                *sum += *slope * weight;
            }
        }
        for (value, sum) in state.iter_mut().zip(&self.sum) {
            *value += *sum * (step / 6.0);
        }
    }
}

/// Channels that are kept, then those that are reduced.
fn wanted(request: &Request<'_>) -> Vec<usize> {
    request.record.iter().copied().chain(request.reduce.iter().map(|r| r.channel)).collect()
}

/// Whether a channel is of the masses or of the sums of the balance.
fn needs_sums(rig: &Rig, channel: usize) -> bool {
    let (_, channel) = &rig.names().channels[channel];
    matches!(channel, Channel::Mass(_) | Channel::Balance(_) | Channel::Temperature(_))
}

/// How a channel of these plants is read.
fn read(rig: &Rig, plants: &[Plant<'_, f64>], channel: usize) -> Read {
    let (layout, wiring) = (&rig.layout, &rig.wiring);
    let ambient = rig.gas.ambient_pressure;
    let state = |place: usize, sign: f64, more: &dyn Fn(&Plant<'_, f64>) -> f64| Read::State {
        place,
        sign,
        more: plants.iter().map(more).collect(),
    };
    let angle_zero =
        |k: usize, p: &Plant<'_, f64>| wiring.coordinates[k].zero.map_or(0.0, |id| p.values[id]);
    match rig.names().channels[channel].1 {
        Channel::Supply(k) => state(layout.supply(k), 1.0, &|_| -ambient),
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
