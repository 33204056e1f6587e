//! Many plants advanced together, each as if it were alone.
//!
//! What happens to a row depends on its own rig, start and commands only: which thread advances it,
//! and beside which others, changes no bit. Rows whose rig allows it run in lanes
//! ([`crate::lanes`]). A row whose state leaves the model's range stays at its last good sample and
//! says why; the others go on.

use std::borrow::Cow;
use std::sync::Arc;

use crate::lanes::group::{Group, Rigs, Row};
use crate::lanes::{grouped, Spent};
use crate::plant::Rig;
use crate::room::{counted, room};
use crate::simulate::drive::{
    check_frame, check_value, command_missing, input_range, prescribable, set_pressure, Drive,
};
use crate::simulate::run::Run;
use crate::simulate::team::Team;
use crate::simulate::{of_row, Failure, Initial, Progress, Timing, Trajectory};
use crate::vector::Plan;
use crate::{Error, Result};
use self_cell::self_cell;

/// Rows that one thread advances at a time, at most: small enough that no thread is left with much
/// to do alone.
const MOST_ROWS: usize = 64;
/// Rows that fill the widest registers: chunks of those that run in lanes are multiples of it.
const FLIGHT: usize = 16;
/// What an RK4 step of a plant alone costs, in steps of a plant in lanes.
const ALONE: usize = 20;
/// Work that is worth a second thread, in steps in lanes (some 50 us).
const WORTH_A_THREAD: usize = 1_000;
/// The same between two looks outside: some hundredths of a second.
const UNSEEN: usize = 200_000;

/// Groups of rows, which stand on the rigs of their chunk.
type Groups<'a> = Vec<Box<dyn Group + 'a>>;

self_cell!(
    struct Held {
        owner: Vec<Arc<Rig>>,
        #[covariant]
        dependent: Groups,
    }
);

/// Rows that one thread advances.
struct Chunk {
    /// Number of its first row.
    first: usize,
    groups: Held,
    /// Group of each row, and its place there.
    seats: Vec<(usize, usize)>,
    /// The present sample: a channel of all rows, then the next channel.
    sample: Vec<f64>,
}

/// Plants with the same inputs and channels that are advanced sample by sample.
pub struct Batch {
    rigs: Vec<Arc<Rig>>,
    /// Which of the rigs each row is.
    rig_of: Vec<usize>,
    /// For each input that need not be commanded, its value in each row.
    defaults: Vec<Option<Vec<f64>>>,
    chunks: Vec<Chunk>,
    sample_time: f64,
    samples: u64,
    substeps: usize,
    team: Team,
}

impl Batch {
    /// Plants at their start; `rigs` has one entry for each row, `initial` too. At most `threads`
    /// advance them.
    ///
    /// # Errors
    /// [`Error::Model`] for no row at all, or rigs with other inputs or channels than the first;
    /// those of [`Timing::new`] and [`Progress::observe`], with the number of the row.
    pub fn new(
        rigs: &[Arc<Rig>],
        timing: Timing,
        initial: &[Initial],
        threads: usize,
    ) -> Result<Self> {
        let Some(first) = rigs.first() else {
            return Err(Error::Model("a batch needs one rig at least".into()));
        };
        if initial.len() != rigs.len() {
            let (name, why) = ("initial".into(), "one for each row".into());
            return Err(Error::Length { name, found: initial.len(), expected: rigs.len(), why });
        }
        counted::<f64>("channels of all plants", &[rigs.len(), first.names().channels.len()])?;
        let mut distinct: Vec<Arc<Rig>> = Vec::new();
        let mut rig_of = room("plants", &[rigs.len()], 0)?;
        for (row, rig) in rigs.iter().enumerate() {
            // Equal rigs mostly stand next to each other, and then often one is all there is.
            let known = distinct.iter().rposition(|other| Arc::ptr_eq(other, rig));
            if known.is_none() {
                same_ports(first, rig).map_err(|e| of_row(row, e))?;
                distinct.push(Arc::clone(rig));
            }
            rig_of[row] = known.unwrap_or(distinct.len() - 1);
        }
        let valves = first.spec().valves.len();
        let default = |input: usize| {
            (input >= valves).then(|| rigs.iter().map(|rig| set_pressure(rig, input)).collect())
        };
        let defaults = (0..first.names().inputs.len()).map(default).collect();
        let whole = if Plan::of(first).is_some() { FLIGHT } else { 1 };
        let size = rigs.len().div_ceil(4 * threads.max(1)).clamp(1, MOST_ROWS);
        let size = size.next_multiple_of(whole);
        let mut chunks = Vec::new();
        for begin in (0..rigs.len()).step_by(size) {
            let end = (begin + size).min(rigs.len());
            chunks.push(Chunk::new(begin, &rigs[begin..end], timing, &initial[begin..end])?);
        }
        let steps = distinct.iter().map(|rig| Ok(timing.stable(rig)?.substeps));
        let substeps = steps.collect::<Result<Vec<_>>>()?.into_iter().max().unwrap_or(1);
        Ok(Self {
            rigs: distinct,
            rig_of,
            defaults,
            chunks,
            sample_time: timing.sample_time,
            samples: 0,
            substeps,
            team: Team::new(threads),
        })
    }

    /// Number of plants.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rig_of.len()
    }

    /// Samples since the start.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Most RK4 steps per sample of any row.
    #[must_use]
    pub fn substeps(&self) -> usize {
        self.substeps
    }

    /// Which rows run side by side in lanes, wherever their state allows it.
    #[must_use]
    pub fn side_by_side(&self) -> Vec<bool> {
        self.each().map(|(group, _)| group.side_by_side()).collect()
    }

    /// What the plants cost since the start of the batch.
    #[must_use]
    pub fn spent(&self) -> Spent {
        let mut spent = Spent { blocks: self.chunks.len() as u64, ..Spent::default() };
        for chunk in &self.chunks {
            chunk.groups.borrow_dependent().iter().for_each(|group| spent += group.spent());
        }
        spent
    }

    /// Why each row has ended, of those that have.
    pub fn failures(&self) -> impl Iterator<Item = Option<&Failure>> + '_ {
        self.each().map(|(group, k)| group.rows()[k].failure.as_ref())
    }

    /// The numbers of each row that [`Self::restore`] goes on from, bit for bit.
    pub fn states(&mut self) -> Vec<Vec<f64>> {
        for chunk in &mut self.chunks {
            chunk.change(|groups| groups.iter_mut().for_each(|group| group.settle()));
        }
        self.each().map(|(group, k)| group.rows()[k].progress.to_vec()).collect()
    }

    /// The present sample: every channel of all rows, then the next channel. Of a row that has
    /// ended its last good one.
    #[must_use]
    pub fn observe(&self) -> Vec<f64> {
        let (n, channels) = (self.rows(), self.rigs[0].names().channels.len());
        let mut out = vec![0.0; n * channels];
        for chunk in &self.chunks {
            let rows = chunk.seats.len();
            for (out, own) in out.chunks_exact_mut(n).zip(chunk.sample.chunks_exact(rows)) {
                out[chunk.first..chunk.first + rows].copy_from_slice(own);
            }
        }
        out
    }

    /// Group and place of each row.
    fn each(&self) -> impl Iterator<Item = (&dyn Group, usize)> + '_ {
        self.chunks.iter().flat_map(|chunk| {
            let groups = chunk.groups.borrow_dependent();
            chunk.seats.iter().map(move |(group, k)| (&*groups[*group], *k))
        })
    }

    /// Go on from other numbers of each row.
    ///
    /// # Errors
    /// As [`Progress::restored`] and [`Progress::observe`], with the number of the row;
    /// [`Error::Length`] for another number of rows, [`Error::Parameter`] for a row that stands at
    /// another sample. Nothing is changed then.
    pub fn restore(
        &mut self,
        samples: u64,
        states: &[Vec<f64>],
        failures: &[Option<Failure>],
    ) -> Result<()> {
        let n = self.rows();
        for (name, found) in [("state", states.len()), ("status", failures.len())] {
            if found != n {
                let (name, why) = (name.to_string(), "one for each row".to_string());
                return Err(Error::Length { name, found, expected: n, why });
            }
        }
        let mut restored = Vec::with_capacity(n);
        for (k, (group, seat)) in self.each().enumerate() {
            let (at, row) = (|e| of_row(k, e), &group.rows()[seat]);
            let rig = &self.rigs[self.rig_of[k]];
            let progress = row.progress.restored(rig, &states[k]).map_err(at)?;
            let stands = progress.samples();
            if stands > samples || (failures[k].is_none() && stands != samples) {
                let allowed = format!("{samples}, as of the batch (less where the row has ended)");
                return Err(at(Error::parameter("state.samples", stands as f64, allowed)));
            }
            progress.observe(rig, row.timing, &mut Trajectory::new(rig, 1)).map_err(at)?;
            restored.push(progress);
        }
        self.samples = samples;
        let mut restored = restored.into_iter().zip(failures.iter().cloned());
        for chunk in &mut self.chunks {
            let some: Vec<_> = restored.by_ref().take(chunk.seats.len()).collect();
            chunk.restore(some);
        }
        Ok(())
    }

    /// Hold commands for some samples: signals by name with one value for each row, as in
    /// [`Drive::new`]. A row whose command is not possible ends there unless `strict`. `look` is
    /// called now and then; its error ends the run at a sample.
    ///
    /// # Errors
    /// As [`Drive::new`], the index being that of the row, for impossible values only where
    /// `strict`; nothing is changed then. That of `look`.
    pub fn advance(
        &mut self,
        samples: usize,
        signals: &[(&str, &[f64])],
        strict: bool,
        look: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()> {
        // The defaults are lent to the drive while the rows are changed.
        let defaults = std::mem::take(&mut self.defaults);
        let done = self.advance_with(&defaults, samples, signals, strict, look);
        self.defaults = defaults;
        done
    }

    fn advance_with(
        &mut self,
        defaults: &[Option<Vec<f64>>],
        samples: usize,
        signals: &[(&str, &[f64])],
        strict: bool,
        look: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()> {
        let (drive, bad) = self.driven(defaults, signals, strict)?;
        let size = self.chunks[0].seats.len();
        for (row, error) in bad {
            self.chunks[row / size].end(row % size, self.samples as f64 * self.sample_time, &error);
        }
        let mut left = samples;
        while left > 0 {
            let each = self.chunks.iter().map(Chunk::cost).sum::<usize>() * self.substeps;
            let count = (UNSEEN / each.max(1)).clamp(1, left);
            self.team.share(&mut self.chunks, each * count >= WORTH_A_THREAD, |chunk| {
                chunk.advance(count, &drive)
            });
            self.samples += count as u64;
            left -= count;
            look()?;
        }
        Ok(())
    }

    /// Signals of all rows, checked, and the first thing that is wrong with each row that is to end
    /// for it.
    fn driven<'b>(
        &self,
        defaults: &'b [Option<Vec<f64>>],
        signals: &[(&str, &'b [f64])],
        strict: bool,
    ) -> Result<(Drive<'b>, Vec<(usize, Error)>)> {
        let (n, names) = (self.rows(), self.rigs[0].names());
        let (mut commands, mut prescribed, mut bad) = (Vec::new(), Vec::new(), Vec::new());
        let mut check =
            |name: &str, values: &[f64], ranges: &dyn Fn(usize) -> (f64, f64, &'static str)| {
                if values.len() != n {
                    let why = "one for each row".into();
                    return Err(Error::Length {
                        name: name.into(),
                        found: values.len(),
                        expected: n,
                        why,
                    });
                }
                for (row, value) in values.iter().enumerate() {
                    let (low, high, unit) = ranges(self.rig_of[row]);
                    match check_value(|| format!("{name}[{row}]"), *value, (low, high), unit) {
                        Err(error) if strict => return Err(error),
                        Err(error) => bad.push((row, error)),
                        Ok(()) => {}
                    }
                }
                Ok(())
            };
        for (input, name) in names.inputs.iter().enumerate() {
            match (signals.iter().find(|(given, _)| given == name), &defaults[input]) {
                (Some((_, values)), _) => {
                    check(name, values, &|rig| input_range(&self.rigs[rig], input))?;
                    commands.push(Cow::Borrowed(*values));
                }
                (None, Some(values)) => commands.push(Cow::Borrowed(values.as_slice())),
                (None, None) => return Err(command_missing(name)),
            }
        }
        for (name, values) in
            signals.iter().filter(|(name, _)| !names.inputs.iter().any(|i| i == name))
        {
            let ports =
                self.rigs.iter().map(|rig| prescribable(rig, name)).collect::<Result<Vec<_>>>()?;
            check(name, values, &|rig| (ports[rig].1, ports[rig].2, ports[rig].3))?;
            prescribed.push((ports[0].0, Cow::Borrowed(*values)));
        }
        let length = signals.iter().any(|(name, _)| *name == "length");
        self.rigs.iter().try_for_each(|rig| check_frame(rig, length))?;
        Ok((Drive::checked(n, commands, prescribed), bad))
    }
}

impl Chunk {
    fn new(first: usize, rigs: &[Arc<Rig>], timing: Timing, initial: &[Initial]) -> Result<Self> {
        let mut known: Vec<Arc<Rig>> = Vec::new();
        let mut rows = Vec::new();
        for (k, (rig, initial)) in rigs.iter().zip(initial).enumerate() {
            let at = |e| of_row(first + k, e);
            let place = known.iter().position(|other| Arc::ptr_eq(other, rig));
            if place.is_none() {
                known.push(Arc::clone(rig));
            }
            let progress = Progress::start(rig, initial).map_err(at)?;
            let timing = timing.stable(rig).map_err(at)?;
            progress.observe(rig, timing, &mut Trajectory::new(rig, 1)).map_err(at)?;
            let rig = place.unwrap_or(known.len() - 1);
            rows.push(Row { place: first + k, rig, timing, progress, failure: None });
        }
        let channels = rigs[0].names().channels.len();
        let wanted: Vec<usize> = (0..channels).collect();
        let groups = Held::try_new(known, |rigs| grouped(rows, &&rigs[..], true, &wanted))
            .map_err(|e| of_row(first, e))?;
        let mut seats = vec![(0, 0); rigs.len()];
        for (group, rows) in groups.borrow_dependent().iter().enumerate() {
            for (k, row) in rows.rows().iter().enumerate() {
                seats[row.place - first] = (group, k);
            }
        }
        let sample = vec![0.0; channels * rigs.len()];
        let mut chunk = Self { first, groups, seats, sample };
        chunk.read();
        Ok(chunk)
    }

    /// What a step of all its rows costs, in steps in lanes.
    fn cost(&self) -> usize {
        let of = |group: &dyn Group| {
            let alive = group.rows().iter().filter(|row| row.failure.is_none()).count();
            alive * if group.side_by_side() { 1 } else { ALONE }
        };
        self.groups.borrow_dependent().iter().map(|group| of(&**group)).sum()
    }

    fn change(&mut self, act: impl FnOnce(&mut Groups<'_>)) {
        self.groups.with_dependent_mut(|_, groups| act(groups));
    }

    /// Hold the commands of each row for some samples and read the last of them.
    fn advance(&mut self, samples: usize, drive: &Drive<'_>) {
        self.change(|groups| groups.iter_mut().for_each(|group| group.advance(samples, drive)));
        self.read();
    }

    /// Read the present sample.
    fn read(&mut self) {
        let Self { first, groups, seats, sample } = self;
        let rows = seats.len();
        groups.with_dependent_mut(|_, groups| {
            for group in groups {
                let mut own = vec![0.0; sample.len() / rows * group.rows().len()];
                group.read(&mut own);
                let channels = own.chunks_exact(group.rows().len());
                for (out, own) in sample.chunks_exact_mut(rows).zip(channels) {
                    for (row, value) in group.rows().iter().zip(own) {
                        out[row.place - *first] = *value;
                    }
                }
            }
        });
    }

    /// End a row at a time [s] for an error.
    fn end(&mut self, row: usize, time: f64, error: &Error) {
        let (group, k) = self.seats[row];
        let failure = Failure { time, message: error.to_string() };
        self.change(|groups| groups[group].end(k, failure));
    }

    /// Other progress and ends of all rows.
    fn restore(&mut self, rows: Vec<(Progress, Option<Failure>)>) {
        let seats = self.seats.clone();
        self.change(|groups| {
            for ((group, k), (progress, failure)) in seats.into_iter().zip(rows) {
                groups[group].change(k, progress, failure);
            }
        });
        self.read();
    }
}

impl<'a> Rigs<'a> for &'a [Arc<Rig>] {
    fn rig(&self, number: usize) -> &'a Rig {
        let rigs: &'a [Arc<Rig>] = self;
        &rigs[number]
    }

    fn run(&self, number: usize) -> Result<Run<'a>> {
        Run::new(self.rig(number))
    }
}

/// Every rig of a batch takes the same commands and shows the same channels.
fn same_ports(first: &Rig, rig: &Rig) -> Result<()> {
    let channels =
        |rig: &Rig| rig.names().channels.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    let pairs = [
        ("inputs", first.names().inputs.clone(), rig.names().inputs.clone()),
        ("channels", channels(first), channels(rig)),
    ];
    for (what, expected, found) in pairs {
        if expected != found {
            let (found, expected) = (found.join(", "), expected.join(", "));
            return Err(Error::Model(format!(
                "its {what} are {found}; those of row 0 are needed: {expected}"
            )));
        }
    }
    Ok(())
}
