//! Many plants advanced together, each as if it were alone.
//!
//! What happens to a row depends on its own rig, start and commands only: which thread advances it,
//! and beside which others, changes no bit. A row whose state leaves the model's range stays at its
//! last good sample and says why; the others go on.

use std::borrow::Cow;
use std::sync::Arc;

use crate::plant::Rig;
use crate::simulate::drive::{
    check_frame, check_value, command_missing, input_range, prescribable, set_pressure, Drive,
};
use crate::simulate::run::OwnedRun;
use crate::simulate::team::Team;
use crate::simulate::{Initial, Progress, Timing, Trajectory};
use crate::{Error, Result};

/// Rows that one thread advances at a time, at most: small enough that no thread is left with much
/// to do alone.
const MOST_ROWS: usize = 64;
/// RK4 steps that are worth a second thread (some 50 us).
const WORTH_A_THREAD: usize = 50;
/// RK4 steps of all rows between two looks outside: some hundredths of a second.
const STEPS_UNSEEN: usize = 50_000;

/// Why and when a row has ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// Simulated time [s].
    pub time: f64,
    /// What happened.
    pub message: String,
}

/// One plant.
struct Row {
    /// Which run of its chunk is its rig's.
    run: usize,
    timing: Timing,
    progress: Progress,
    /// Channels at the last good sample.
    sample: Vec<f64>,
    failure: Option<Failure>,
}

/// Rows that one thread advances, with a run for each rig among them.
struct Chunk {
    /// Number of its first row.
    first: usize,
    rows: Vec<Row>,
    runs: Vec<OwnedRun>,
    /// Where a sample is read, and where it is not.
    seen: Trajectory,
    blind: Trajectory,
}

/// Plants with the same inputs and channels that are advanced sample by sample.
pub struct Batch {
    rigs: Vec<Arc<Rig>>,
    /// Which of the rigs each row is.
    rig_of: Vec<usize>,
    /// For each input that need not be commanded, its value in each row.
    defaults: Vec<Option<Vec<f64>>>,
    chunks: Vec<Chunk>,
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
        let mut distinct: Vec<Arc<Rig>> = Vec::new();
        let mut rig_of = Vec::with_capacity(rigs.len());
        for (row, rig) in rigs.iter().enumerate() {
            // Equal rigs mostly stand next to each other, and then often one is all there is.
            let known = distinct.iter().rposition(|other| Arc::ptr_eq(other, rig));
            if known.is_none() {
                same_ports(first, rig).map_err(|e| of_row(row, e))?;
                distinct.push(Arc::clone(rig));
            }
            rig_of.push(known.unwrap_or(distinct.len() - 1));
        }
        let valves = first.spec().valves.len();
        let default = |input: usize| {
            (input >= valves).then(|| rigs.iter().map(|rig| set_pressure(rig, input)).collect())
        };
        let defaults = (0..first.names().inputs.len()).map(default).collect();
        let size = rigs.len().div_ceil(4 * threads.max(1)).clamp(1, MOST_ROWS);
        let mut chunks = Vec::new();
        for begin in (0..rigs.len()).step_by(size) {
            let end = (begin + size).min(rigs.len());
            chunks.push(Chunk::new(begin, &rigs[begin..end], timing, &initial[begin..end])?);
        }
        let substeps = distinct.iter().map(|rig| timing.stable(rig).substeps).max().unwrap_or(1);
        Ok(Self {
            rigs: distinct,
            rig_of,
            defaults,
            chunks,
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

    /// Why each row has ended, of those that have.
    pub fn failures(&self) -> impl Iterator<Item = Option<&Failure>> + '_ {
        self.each().map(|row| row.failure.as_ref())
    }

    /// The numbers of each row that [`Self::restore`] goes on from, bit for bit.
    pub fn states(&self) -> impl Iterator<Item = Vec<f64>> + '_ {
        self.each().map(|row| row.progress.to_vec())
    }

    /// The present sample: every channel of all rows, then the next channel. Of a row that has
    /// ended its last good one.
    #[must_use]
    pub fn observe(&self) -> Vec<f64> {
        let (n, channels) = (self.rows(), self.rigs[0].names().channels.len());
        let mut out = vec![0.0; n * channels];
        for (k, row) in self.each().enumerate() {
            for (channel, value) in row.sample.iter().enumerate() {
                out[channel * n + k] = *value;
            }
        }
        out
    }

    fn each(&self) -> impl Iterator<Item = &Row> + '_ {
        self.chunks.iter().flat_map(|chunk| &chunk.rows)
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
        for (k, row) in self.each().enumerate() {
            let at = |e| of_row(k, e);
            let progress = row.progress.restored(&states[k]).map_err(at)?;
            let stands = progress.samples();
            if stands > samples || (failures[k].is_none() && stands != samples) {
                let allowed = format!("{samples}, as of the batch (less where the row has ended)");
                return Err(at(Error::parameter("state.samples", stands as f64, allowed)));
            }
            let mut out = Trajectory::new(&self.rigs[self.rig_of[k]], 1);
            progress.observe(&self.rigs[self.rig_of[k]], row.timing, &mut out).map_err(at)?;
            restored.push((progress, out.channels.into_iter().flatten().collect()));
        }
        self.samples = samples;
        let rows = self.chunks.iter_mut().flat_map(|chunk| &mut chunk.rows);
        for ((row, (progress, sample)), failure) in rows.zip(restored).zip(failures) {
            (row.progress, row.sample, row.failure) = (progress, sample, failure.clone());
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
        let now = self.samples as f64 * self.chunks[0].rows[0].timing.sample_time;
        for (row, error) in bad {
            let size = self.chunks[0].rows.len();
            let row = &mut self.chunks[row / size].rows[row % size];
            row.failure.get_or_insert(Failure { time: now, message: error.to_string() });
        }
        let mut left = samples;
        while left > 0 {
            let alive = self.failures().filter(Option::is_none).count();
            let each = (alive * self.substeps).max(1);
            let count = (STEPS_UNSEEN / each).clamp(1, left);
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
        let mut known: Vec<&Arc<Rig>> = Vec::new();
        let (mut rows, mut runs) = (Vec::new(), Vec::new());
        for (k, (rig, initial)) in rigs.iter().zip(initial).enumerate() {
            let at = |e| of_row(first + k, e);
            let run = known.iter().position(|other| Arc::ptr_eq(other, rig)).unwrap_or(known.len());
            if run == known.len() {
                known.push(rig);
                runs.push(OwnedRun::new(Arc::clone(rig)).map_err(at)?);
            }
            let progress = Progress::start(rig, initial).map_err(at)?;
            let mut out = Trajectory::new(rig, 1);
            let timing = timing.stable(rig);
            progress.observe(rig, timing, &mut out).map_err(at)?;
            let sample = out.channels.into_iter().flatten().collect();
            rows.push(Row { run, timing, progress, sample, failure: None });
        }
        let blind = Trajectory { channels: Vec::new(), events: Vec::new() };
        let seen = rigs.first().map_or_else(|| blind.clone(), |rig| Trajectory::new(rig, 1));
        Ok(Self { first, rows, runs, seen, blind })
    }

    /// Hold the commands of each row for some samples and read the last of them.
    fn advance(&mut self, samples: usize, drive: &Drive<'_>) {
        let Self { first, rows, runs, seen, blind } = self;
        for (k, row) in rows.iter_mut().enumerate().filter(|(_, row)| row.failure.is_none()) {
            let Row { run, timing, progress, sample, failure } = row;
            let own = *first + k..*first + k + 1;
            runs[*run].with(|run| {
                for left in (0..samples).rev() {
                    let out = if left == 0 { &mut *seen } else { &mut *blind };
                    out.events.clear();
                    let done =
                        progress.advance_in(run, *timing, drive, own.clone(), out, &mut || Ok(()));
                    if let Err(error) = done {
                        let time = match error {
                            Error::Integration { time, .. } => time,
                            _ => progress.samples() as f64 * timing.sample_time,
                        };
                        *failure = Some(Failure { time, message: error.to_string() });
                        // The last good sample is inside the model's range: it was when it was
                        // reached.
                        let _ = progress.observe_in(run, *timing, seen);
                        break;
                    }
                }
            });
            for (value, channel) in sample.iter_mut().zip(&mut seen.channels) {
                *value = channel.first().copied().unwrap_or(*value);
                channel.clear();
            }
        }
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

/// An error of one row, which it then names.
#[must_use]
pub fn of_row(row: usize, error: Error) -> Error {
    let named = |name: String| format!("row {row}: {name}");
    match error {
        Error::Parameter { name, value, allowed } => {
            Error::Parameter { name: named(name), value, allowed }
        }
        Error::Length { name, found, expected, why } => {
            Error::Length { name: named(name), found, expected, why }
        }
        Error::Choice { name, value, allowed } => {
            Error::Choice { name: named(name), value, allowed }
        }
        Error::Integration { time, name, value, allowed } => {
            Error::Integration { time, name: named(name), value, allowed }
        }
        Error::Model(message) => Error::Model(named(message)),
    }
}
