//! Plants side by side in lanes, sample by sample. A plant that a sample takes beyond the range of
//! the curves, or of the model, runs that sample alone from where it began; what happens to it
//! depends on its own state and commands only.

use super::group::{Group, Rigs, Row, Runs, Spent};
use super::reads::Reads;
use crate::blocks::valve::spool_position;
use crate::plant::Plant;
use crate::simulate::drive::Drive;
use crate::simulate::{Failure, Progress, Timing, Trajectory};
use crate::vector::{
    in_fours, opening, side_by_side, Lanes, Num, Pair, Plan, Registers, Rk4, Shape, Single,
    MOST_LANES, PAIR,
};
use crate::Result;
use pulp::{Arch, Scalar, Simd, WithSimd};
use std::marker::PhantomData;

/// Rows for which registers of four are enough.
const FEW: usize = 4 * PAIR;

/// Rows of one structure and step in as many flights as they fill.
///
/// # Errors
/// As [`crate::simulate::run::Run::new`].
pub(super) fn flights<'a>(
    plan: &'a Plan,
    rows: Vec<Row>,
    rigs: &dyn Rigs<'a>,
    wanted: &[usize],
) -> Result<Vec<Box<dyn Group + 'a>>> {
    // A few rows have no use for wide registers.
    match rows.len() {
        1 => Fill { plan, rows, rigs, wanted, registers: PhantomData::<Single> }.with_simd(Scalar),
        ..=FEW => in_fours(Fill { plan, rows, rigs, wanted, registers: PhantomData::<Pair> }),
        _ => {
            Arch::new().dispatch(Fill { plan, rows, rigs, wanted, registers: PhantomData::<Pair> })
        }
    }
}

struct Fill<'a, 'f, R: Registers> {
    plan: &'a Plan,
    rows: Vec<Row>,
    rigs: &'f dyn Rigs<'a>,
    wanted: &'f [usize],
    registers: PhantomData<R>,
}

impl<'a, R: Registers> WithSimd for Fill<'a, '_, R> {
    type Output = Result<Vec<Box<dyn Group + 'a>>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { plan, rows, rigs, wanted, .. } = self;
        let (mut flights, mut rows): (Vec<Box<dyn Group + 'a>>, _) =
            (Vec::new(), rows.into_iter().peekable());
        while rows.peek().is_some() {
            let some = rows.by_ref().take(side_by_side::<S, R>()).collect();
            flights.push(Box::new(Flight::<S, R>::new(simd, plan, some, rigs, wanted)?));
        }
        Ok(flights)
    }
}

/// Rows side by side, one at least, at most one for each lane.
struct Flight<'a, S: Simd, R: Registers> {
    simd: S,
    plan: &'a Plan,
    timing: Timing,
    rows: Vec<Row>,
    runs: Runs<'a>,
    lanes: Lanes<'a, S, R>,
    state: Vec<Num<S, R>>,
    /// The state at the beginning of a sample.
    before: Vec<Num<S, R>>,
    method: Rk4<S, R>,
    reads: Reads,
    /// Commands that are held: an input of all rows, then the next input.
    held: Vec<f64>,
    /// The valves of all rows have the same null and areas.
    alike: bool,
    /// Lanes that are beyond the curves.
    away: [bool; MOST_LANES],
    /// Rows whose progress is not that of their lane.
    stale: [bool; MOST_LANES],
    /// Room for a sample that nobody reads.
    blind: Trajectory,
    spent: Spent,
}

impl<'a, S: Simd, R: Registers> Flight<'a, S, R> {
    #[inline(always)]
    fn new(
        simd: S,
        plan: &'a Plan,
        rows: Vec<Row>,
        rigs: &dyn Rigs<'a>,
        wanted: &[usize],
    ) -> Result<Self> {
        let runs = Runs::new(&rows, rigs)?;
        let rig = rigs.rig(rows[0].rig);
        let plants: Vec<&Plant<'a, f64>> =
            runs.run_of.iter().map(|run| &runs.runs[*run].stepper.plant).collect();
        let states = plants[0].states();
        let lanes = Lanes::new(simd, plan, &plants, states > rig.layout.states());
        let reads = Reads::new(rig, &plants, wanted);
        let alike = plants.iter().all(|plant| plant.valves == plants[0].valves);
        let state = vec![Num::splat(simd, 0.0); states];
        let mut flight = Self {
            held: vec![0.0; rig.names().inputs.len() * rows.len()],
            before: state.clone(),
            method: Rk4::new(&state),
            timing: rows[0].timing,
            alike,
            away: [false; MOST_LANES],
            stale: [false; MOST_LANES],
            blind: Trajectory::blind(),
            spent: Spent::default(),
            simd,
            plan,
            rows,
            runs,
            lanes,
            state,
            reads,
        };
        (0..side_by_side::<S, R>()).for_each(|lane| flight.load(lane));
        flight.away = flight.beyond();
        Ok(flight)
    }

    /// Put a row's progress into its lane; the lanes that are left over run as the last row does.
    #[inline(always)]
    fn load(&mut self, lane: usize) {
        let row = lane.min(self.rows.len() - 1);
        for (value, own) in self.state.iter_mut().zip(self.rows[row].progress.state_mut()) {
            value.numbers_mut()[lane] = *own;
        }
    }

    /// Which lanes are beyond the range in which the model, or the curves, hold.
    #[inline(always)]
    fn beyond(&self) -> [bool; MOST_LANES] {
        let angle = self.runs.runs[0].stepper.plant.rig().layout.angle(0);
        self.beyond_with(self.state[angle], self.state[angle])
    }

    /// The same where the angle was as far as two others on the way.
    #[inline(always)]
    fn beyond_with(&self, lowest: Num<S, R>, highest: Num<S, R>) -> [bool; MOST_LANES] {
        let layout = self.runs.runs[0].stepper.plant.rig().layout;
        let number = |value: f64| Num::splat(self.simd, value);
        let (zero, one) = (number(0.0), number(1.0));
        let mut inside = one;
        for (place, value) in self.state.iter().enumerate().take(layout.states()) {
            let least = if place < layout.mass(0) { 0.0 } else { f64::MIN };
            inside = value.inside(number(least), number(f64::MAX), inside, zero);
        }
        let (low, high) = self.plan.range();
        for angle in [lowest, highest] {
            inside = angle.inside(number(low), number(high), inside, zero);
        }
        let mut beyond = [false; MOST_LANES];
        for (beyond, inside) in beyond.iter_mut().zip(inside.numbers()) {
            *beyond = *inside == 0.0;
        }
        beyond
    }

    /// Set the commands of a drive.
    #[inline(always)]
    fn hold(&mut self, drive: &Drive<'_>) {
        let rows = self.rows.len();
        for (held, commands) in self.held.chunks_exact_mut(rows).zip(&drive.commands) {
            for (held, row) in held.iter_mut().zip(&self.rows) {
                // What would end a row is no number.
                *held = if row.failure.is_none() { commands[row.place] } else { 0.0 };
            }
        }
        let rig = self.runs.runs[0].stepper.plant.rig();
        let mut values = [0.0; MOST_LANES];
        let values = &mut values[..side_by_side::<S, R>()];
        for (k, unit) in rig.wiring.valves.iter().enumerate() {
            let commands = &self.held[k * rows..(k + 1) * rows];
            let runs = &mut self.runs;
            let mut open = |row: usize| {
                let plant = &runs.of(row).stepper.plant;
                let spool = spool_position(commands[row], plant.valves[k].null, unit.half_range);
                opening(plant, k, spool)
            };
            if self.alike && commands.iter().all(|command| *command == commands[0]) {
                values.fill(open(0));
            } else {
                for (lane, value) in values.iter_mut().enumerate() {
                    *value = open(lane.min(rows - 1));
                }
            }
            self.lanes.open(k, values);
        }
        let mut regulator = rig.wiring.valves.len();
        for (k, spec) in rig.spec().supplies.iter().enumerate() {
            let regulated = spec.kind == "regulator";
            for (lane, value) in values.iter_mut().enumerate() {
                let gauge = if regulated {
                    self.held[regulator * rows + lane.min(rows - 1)]
                } else {
                    spec.initial_pressure
                };
                *value = gauge + rig.gas.ambient_pressure;
            }
            regulator += usize::from(regulated);
            self.lanes.set(k, values);
        }
    }

    /// Hold the commands of each row for some samples.
    #[inline(always)]
    fn fly<W: Simd>(&mut self, wide: W, samples: usize, drive: &Drive<'_>) {
        self.hold(drive);
        // What is prescribed is so to plants alone.
        let driven = drive.places().next().is_some();
        for _ in 0..samples {
            let here = |lane: usize| !driven && !self.away[lane];
            let goes = |lane: usize| self.rows[lane].failure.is_none();
            let was: [bool; MOST_LANES] =
                std::array::from_fn(|lane| lane < self.rows.len() && goes(lane) && here(lane));
            if !(0..self.rows.len()).any(goes) {
                break;
            }
            self.before.copy_from_slice(&self.state);
            let fly = was.iter().filter(|flies| **flies).count() as u64;
            if fly > 0 {
                let before = self.method.evaluations;
                self.sample(wide);
                self.spent.evaluations += fly * (self.method.evaluations - before);
            }
            self.landed(&was, drive);
        }
    }

    /// The steps of one sample, and which lanes they led beyond the curves.
    #[inline(always)]
    fn sample<W: Simd>(&mut self, wide: W) {
        match self.lanes.shape {
            shape if !shape.is_small() => self.steps(wide, shape.of_any_size()),
            shape if shape.sums() => self.steps(wide, Shape::small(true)),
            _ => self.steps(wide, Shape::small(false)),
        }
    }

    #[inline(always)]
    fn steps<W: Simd>(&mut self, wide: W, shape: Shape) {
        let angle = self.runs.runs[0].stepper.plant.rig().layout.angle(0);
        let (mut low, mut high) = (self.state[angle], self.state[angle]);
        let step = self.timing.step();
        for _ in 0..self.timing.substeps {
            self.method.step(wide, shape, &mut self.lanes, &mut self.state, step);
            low = self.state[angle].or_below(low);
            high = self.state[angle].or_above(high);
        }
        self.away = self.beyond_with(low, high);
    }

    /// The rows after a sample: those that did not fly it, `was`, or not well, run it alone; those
    /// that have ended stay where they are.
    #[inline(always)]
    fn landed(&mut self, was: &[bool; MOST_LANES], drive: &Drive<'_>) {
        let mut others = false;
        for (lane, flew) in was.iter().enumerate().take(self.rows.len()) {
            if *flew && !self.away[lane] {
                self.rows[lane].progress.count();
                self.stale[lane] = true;
                self.spent.steps += self.timing.substeps as u64;
                continue;
            }
            for (value, before) in self.state.iter_mut().zip(&self.before) {
                value.numbers_mut()[lane] = before.numbers()[lane];
            }
            if self.rows[lane].failure.is_none() {
                self.alone(lane, drive);
                self.load(lane);
            }
            others = true;
        }
        if others {
            self.away = self.beyond();
        }
    }

    /// One sample of a row alone, from where its lane stands.
    #[inline(never)]
    fn alone(&mut self, lane: usize, drive: &Drive<'_>) {
        self.store(lane);
        let (row, run) = (&mut self.rows[lane], self.runs.of(lane));
        self.spent.alone += 1;
        row.advance(run, 1, drive, &mut self.blind);
        if row.failure.is_some() {
            self.look(lane);
        }
    }

    /// Bring the progress of a row up to date with its lane.
    fn store(&mut self, lane: usize) {
        if !std::mem::take(&mut self.stale[lane]) {
            return;
        }
        for (own, value) in self.rows[lane].progress.state_mut().iter_mut().zip(&self.state) {
            *own = value.numbers()[lane];
        }
    }

    /// The conditions of events of a row under the commands that it is held at.
    fn look(&mut self, lane: usize) {
        let rows = self.rows.len();
        let (run, held) = (self.runs.of(lane), &self.held);
        let controls = run.stepper.plant.controls(|input| held[input * rows + lane]);
        self.rows[lane].progress.look(run, &controls);
    }
}

impl<S: Simd, R: Registers> Group for Flight<'_, S, R> {
    fn rows(&self) -> &[Row] {
        &self.rows
    }

    fn advance(&mut self, samples: usize, drive: &Drive<'_>) {
        let simd = self.simd;
        let advance = Advance { flight: self, samples, drive };
        if side_by_side::<S, R>() == 1 {
            in_fours(advance); // the columns of a plant stand side by side
        } else {
            simd.vectorize(advance);
        }
    }

    fn read(&mut self, out: &mut [f64]) {
        self.reads.write(&self.state, &mut self.runs, out);
    }

    fn settle(&mut self) {
        for lane in 0..self.rows.len() {
            if self.stale[lane] {
                self.store(lane);
                self.look(lane);
            }
        }
    }

    fn change(&mut self, row: usize, progress: Progress, failure: Option<Failure>) {
        (self.rows[row].progress, self.rows[row].failure) = (progress, failure);
        self.stale[row] = false;
        self.load(row);
        self.away = self.beyond();
    }

    fn end(&mut self, row: usize, failure: Failure) {
        self.settle();
        self.rows[row].failure.get_or_insert(failure);
    }

    fn spent(&self) -> Spent {
        self.spent
    }

    fn side_by_side(&self) -> bool {
        true
    }
}

/// A call that is compiled for the registers of the flight.
struct Advance<'f, 'a, 'd, S: Simd, R: Registers> {
    flight: &'f mut Flight<'a, S, R>,
    samples: usize,
    drive: &'f Drive<'d>,
}

impl<S: Simd, R: Registers> WithSimd for Advance<'_, '_, '_, S, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<W: Simd>(self, wide: W) {
        self.flight.fly(wide, self.samples, self.drive);
    }
}
