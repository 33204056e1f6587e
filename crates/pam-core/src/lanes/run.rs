//! Runs: blocks of rows over threads, rows of a block in groups, each sample read as it comes.

use super::group::{Group, Rigs, Row, Spent};
use super::grouped::grouped;
use super::reduce::{Reduce, Reduction};
use super::request::{Checked, Outcome, Request, Signal};
use super::steps::Steps;
use crate::plant::{Plant, Rig};
use crate::room::{counted, room};
use crate::simulate::drive::Drive;
use crate::simulate::run::Run;
use crate::simulate::team::Team;
use crate::simulate::{Failure, Progress, Timing};
use crate::vector::needs_sums;
use crate::{Error, Result};

/// Rows of a block: a millisecond or more of work, so that no thread waits long for the last one.
const BLOCK: usize = 32;
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
    let checked = Checked::new(rig, request)?;
    let (plants, kept) = (request.plants, request.rows.div_ceil(request.every.max(1)));
    counted::<Option<Failure>>("plants", &[plants])?;
    counted::<f64>("recorded numbers", &[plants, kept, request.record.len()])?;
    counted::<f64>("reduced numbers", &[plants, request.reduce.len()])?;
    let steps = Steps::new(&checked)?;
    let channel = |_: &usize| room("recorded numbers", &[plants, kept], 0.0);
    let mut recorded = request.record.iter().map(channel).collect::<Result<Vec<_>>>()?;
    let number = |_: &Reduce| room("reduced numbers", &[plants], 0.0);
    let mut reduced = request.reduce.iter().map(number).collect::<Result<Vec<_>>>()?;
    let mut failures = room("plants", &[plants], None)?;
    let mut blocks = Block::all(&mut recorded, &mut reduced, &mut failures, kept);
    let work = Work::new(&checked, &steps);
    let mut team = Team::new(request.threads);
    let each = request.rows.max(1) * (0..plants).map(|k| steps.of(k)).max().unwrap_or(1);
    let together = (STEPS_UNSEEN / (each * BLOCK)).max(request.threads);
    let (mut wrong, mut spent) = (Ok(()), Spent::default());
    for some in blocks.chunks_mut(together) {
        let worth = each * some.len() * BLOCK.min(plants) > WORTH_A_THREAD;
        team.share(some, worth, |block| match work.block(block) {
            Ok(spent) => block.spent = spent,
            Err(error) => block.error = Some(error),
        });
        if let Some(error) = some.iter_mut().find_map(|block| block.error.take()) {
            wrong = Err(error);
            break;
        }
        some.iter().for_each(|block| spent += block.spent);
        look()?;
    }
    wrong?;
    Ok(Outcome { recorded, reduced, failures, spent })
}

/// Neighbouring rows and where their results go.
struct Block<'o> {
    first: usize,
    recorded: Vec<&'o mut [f64]>,
    reduced: Vec<&'o mut [f64]>,
    failures: &'o mut [Option<Failure>],
    error: Option<Error>,
    spent: Spent,
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
                spent: Spent::default(),
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

    /// A row that cannot begin.
    fn without(&mut self, place: usize, failure: Failure) {
        let rows = self.failures.len();
        for channel in &mut self.recorded {
            let kept = channel.len() / rows;
            channel[place * kept..(place + 1) * kept].fill(f64::NAN);
        }
        self.reduced.iter_mut().for_each(|numbers| numbers[place] = f64::NAN);
        self.failures[place] = Some(failure);
    }
}

/// What all blocks share.
struct Work<'w, 'r> {
    checked: &'w Checked<'w, 'r>,
    steps: &'w Steps,
    /// Channels that are kept, then those that are reduced.
    wanted: Vec<usize>,
    /// Whether masses and sums of the balance are among them.
    sums: bool,
    /// Whether nothing is prescribed, which only plants alone take.
    lanes: bool,
}

impl<'w, 'r> Work<'w, 'r> {
    fn new(checked: &'w Checked<'w, 'r>, steps: &'w Steps) -> Self {
        let (rig, request) = (checked.rig, checked.request);
        let reduced = request.reduce.iter().map(|reduce| reduce.channel);
        let wanted: Vec<usize> = request.record.iter().copied().chain(reduced).collect();
        let sums = wanted.iter().any(|channel| needs_sums(rig, *channel));
        let inputs = &rig.names().inputs;
        let lanes = request.signals.iter().all(|(name, _)| inputs.iter().any(|i| i == name));
        Self { checked, steps, wanted, sums, lanes }
    }

    /// Every row of a block.
    fn block(&self, block: &mut Block<'_>) -> Result<Spent> {
        let request = self.checked.request;
        // one drive for all of them where no signal is a plant's own
        let common = request.signals.iter().all(|(_, signal)| matches!(signal, Signal::Common(_)));
        let own = if common { 1 } else { block.failures.len() };
        let drives: Vec<_> = (block.first..block.first + own)
            .map(|plant| self.drive(plant))
            .collect::<Result<_>>()?;
        let mut rows = Vec::new();
        for place in 0..block.failures.len() {
            match self.row(place, block.first + place)? {
                Row { failure: Some(failure), .. } => block.without(place, failure),
                row => rows.push(row),
            }
        }
        let numbers = Numbers { work: self, first: block.first };
        let mut spent = Spent { blocks: 1, ..Spent::default() };
        for mut group in grouped(rows, &numbers, self.lanes, &self.wanted)? {
            self.run(&mut *group, &drives, block);
            spent += group.spent();
        }
        Ok(spent)
    }

    /// What drives a plant.
    fn drive(&self, plant: usize) -> Result<Drive<'r>> {
        let request = self.checked.request;
        let signals: Vec<(&str, &[f64])> = (request.signals.iter())
            .map(|(name, signal)| (*name, signal.of(plant, request.rows)))
            .collect();
        Drive::new(self.checked.rig, request.rows, &signals)
    }

    /// A row at its start, which has ended where that is out of the model's range.
    fn row(&self, place: usize, number: usize) -> Result<Row> {
        let plant = self.plant(number)?;
        let progress = Progress::of(&plant, &self.checked.initial(number)?);
        let timing = Timing { substeps: self.steps.of(number), ..self.checked.request.timing };
        let wrong = progress.check(&plant, timing).err();
        let mut row = Row { place, rig: place, timing, progress, failure: None };
        row.failure = wrong.map(|error| row.ended(&error));
        Ok(row)
    }

    fn plant(&self, number: usize) -> Result<Plant<'w, f64>> {
        let rig = self.checked.rig;
        let values = rig.parameters().with_values(&self.checked.values(number))?;
        Plant::new(rig, values.lift(), self.sums)
    }

    /// Run a group to its end.
    fn run(&self, group: &mut dyn Group, drives: &[Drive<'_>], block: &mut Block<'_>) {
        let request = self.checked.request;
        let mut drive = drives[0].of_rows(block.failures.len());
        // a last sample is all that some reductions look at
        let all = request.reduce.iter().any(|reduce| reduce.reduction != Reduction::Final);
        let mut sample = vec![0.0; self.wanted.len() * group.rows().len()];
        let mut sums: Vec<Vec<f64>> =
            request.reduce.iter().map(|r| vec![r.start(); group.rows().len()]).collect();
        for k in 0..request.rows {
            if k > 0 {
                match drives {
                    [common] => drive.set_all(common, k - 1),
                    _ => group.rows().iter().for_each(|row| {
                        drive.set(row.place, &drives[row.place], k - 1);
                    }),
                }
                group.advance(1, &drive);
            }
            let reduces = all || (k + 1 == request.rows && !request.reduce.is_empty());
            let keeps = k.is_multiple_of(request.every) && !request.record.is_empty();
            if keeps || reduces {
                group.read(&mut sample);
                self.note(k, group.rows(), &sample, &mut sums, block);
            }
        }
        for (k, row) in group.rows().iter().enumerate() {
            for (out, sums) in block.reduced.iter_mut().zip(&sums) {
                out[row.place] = if row.failure.is_some() { f64::NAN } else { sums[k] };
            }
            block.failures[row.place].clone_from(&row.failure);
        }
    }

    /// Write a sample of some rows down.
    fn note(
        &self,
        sample: usize,
        rows: &[Row],
        values: &[f64],
        sums: &mut [Vec<f64>],
        block: &mut Block<'_>,
    ) {
        let request = self.checked.request;
        let mut channels = values.chunks_exact(rows.len());
        let kept = request.rows.div_ceil(request.every);
        for (out, values) in block.recorded.iter_mut().zip(&mut channels) {
            if sample.is_multiple_of(request.every) {
                for (row, value) in rows.iter().zip(values) {
                    out[row.place * kept + sample / request.every] = *value;
                }
            }
        }
        let (rows, time) = (request.rows, request.timing.sample_time);
        for ((reduce, sums), values) in request.reduce.iter().zip(sums).zip(channels) {
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum = reduce.with(*sum, *value, sample, rows, time);
            }
        }
    }
}

/// The rigs of a block: one, with other numbers for each row.
struct Numbers<'n, 'w, 'r> {
    work: &'n Work<'w, 'r>,
    first: usize,
}

impl<'w> Rigs<'w> for Numbers<'_, 'w, '_> {
    fn rig(&self, _: usize) -> &'w Rig {
        self.work.checked.rig
    }

    fn run(&self, place: usize) -> Result<Run<'w>> {
        Ok(Run::of(self.work.plant(self.first + place)?))
    }
}
