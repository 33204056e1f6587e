//! Plants that advance together sample by sample: side by side in lanes where their rig allows it,
//! else one after the other. Whatever runs many plants runs them in such groups.

use crate::plant::Rig;
use crate::simulate::drive::Drive;
use crate::simulate::run::Run;
use crate::simulate::{Failure, Progress, Timing, Trajectory};
use crate::{Error, Result};

/// One plant of many.
pub(crate) struct Row {
    /// Where its commands stand in a drive.
    pub place: usize,
    /// Number of its rig, as its [`Rigs`] have them.
    pub rig: usize,
    pub timing: Timing,
    pub progress: Progress,
    pub failure: Option<Failure>,
}

impl Row {
    /// Hold the commands of a drive for some samples, which are appended to a trajectory. Where the
    /// model's range is left, the row ends at the last good one.
    pub fn advance(
        &mut self,
        run: &mut Run<'_>,
        samples: usize,
        drive: &Drive<'_>,
        out: &mut Trajectory,
    ) {
        let own = self.place..self.place + 1;
        for _ in 0..samples {
            out.events.clear();
            let done =
                self.progress.advance_in(run, self.timing, drive, own.clone(), out, &mut || Ok(()));
            if let Err(error) = done {
                self.failure = Some(self.ended(&error));
                break;
            }
        }
    }

    /// An error at the present sample as the end of this row.
    pub fn ended(&self, error: &Error) -> Failure {
        let time = match error {
            Error::Integration { time, .. } => *time,
            _ => self.progress.samples() as f64 * self.timing.sample_time,
        };
        Failure { time, message: error.to_string() }
    }
}

/// The rigs of some rows by number.
pub(crate) trait Rigs<'a> {
    /// A rig.
    fn rig(&self, number: usize) -> &'a Rig;

    /// Room for its plants to run.
    ///
    /// # Errors
    /// As [`Run::new`].
    fn run(&self, number: usize) -> Result<Run<'a>>;
}

/// Runs of the rigs of some rows, and which of them is that of each row.
pub(super) struct Runs<'a> {
    pub runs: Vec<Run<'a>>,
    pub run_of: Vec<usize>,
}

impl<'a> Runs<'a> {
    pub fn new(rows: &[Row], rigs: &dyn Rigs<'a>) -> Result<Self> {
        let (mut known, mut runs, mut run_of) = (Vec::new(), Vec::new(), Vec::new());
        for row in rows {
            // Equal rigs mostly stand next to each other.
            let run = match known.iter().rposition(|rig| *rig == row.rig) {
                Some(run) => run,
                None => {
                    known.push(row.rig);
                    runs.push(rigs.run(row.rig)?);
                    runs.len() - 1
                }
            };
            run_of.push(run);
        }
        Ok(Self { runs, run_of })
    }

    /// The run of a row.
    pub fn of(&mut self, row: usize) -> &mut Run<'a> {
        &mut self.runs[self.run_of[row]]
    }
}

/// What plants cost, whatever the machine.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub struct Spent {
    /// Blocks of rows that were shared out to threads.
    pub blocks: u64,
    /// RK4 steps in lanes, of each plant.
    pub steps: u64,
    /// Rates that lanes worked out, of each plant.
    pub evaluations: u64,
    /// Samples that plants of lanes ran alone, beyond the range of the curves.
    pub alone: u64,
}

impl std::ops::AddAssign for Spent {
    fn add_assign(&mut self, other: Self) {
        self.blocks += other.blocks;
        self.steps += other.steps;
        self.evaluations += other.evaluations;
        self.alone += other.alone;
    }
}

/// Plants that advance together.
pub(crate) trait Group: Send {
    /// The plants; the state of their progress is that of now after [`Self::settle`].
    fn rows(&self) -> &[Row];

    /// Hold the commands of each row for some samples.
    fn advance(&mut self, samples: usize, drive: &Drive<'_>);

    /// Write down the present sample: a wanted channel of all rows, then the next channel.
    fn read(&mut self, out: &mut [f64]);

    /// Bring the progress of all rows up to date.
    fn settle(&mut self);

    /// Another progress and end of a row.
    fn change(&mut self, row: usize, progress: Progress, failure: Option<Failure>);

    /// End a row where it stands, unless it has ended.
    fn end(&mut self, row: usize, failure: Failure);

    /// What was done since the start.
    fn spent(&self) -> Spent {
        Spent::default()
    }

    /// Whether the plants stand side by side in lanes.
    fn side_by_side(&self) -> bool {
        false
    }
}
