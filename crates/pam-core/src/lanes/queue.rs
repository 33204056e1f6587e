//! Plants that advance one after the other, each as [`crate::simulate`] runs it.

use super::group::{Group, Rigs, Row, Runs};
use crate::simulate::drive::Drive;
use crate::simulate::{Failure, Progress, Trajectory};
use crate::Result;

/// Rows with a run for each rig among them.
pub(super) struct Queue<'a> {
    rows: Vec<Row>,
    runs: Runs<'a>,
    wanted: Vec<usize>,
    /// Where a sample is read, and where it is not.
    seen: Trajectory,
    blind: Trajectory,
}

impl<'a> Queue<'a> {
    /// # Errors
    /// As [`crate::simulate::run::Run::new`].
    pub fn new(rows: Vec<Row>, rigs: &dyn Rigs<'a>, wanted: &[usize]) -> Result<Self> {
        let blind = Trajectory::blind();
        let seen =
            rows.first().map_or_else(|| blind.clone(), |row| Trajectory::new(rigs.rig(row.rig), 1));
        let runs = Runs::new(&rows, rigs)?;
        Ok(Self { rows, runs, wanted: wanted.to_vec(), seen, blind })
    }
}

impl Group for Queue<'_> {
    fn rows(&self) -> &[Row] {
        &self.rows
    }

    fn advance(&mut self, samples: usize, drive: &Drive<'_>) {
        let Self { rows, runs, blind, .. } = self;
        for (k, row) in rows.iter_mut().enumerate().filter(|(_, row)| row.failure.is_none()) {
            row.advance(runs.of(k), samples, drive, blind);
        }
    }

    fn read(&mut self, out: &mut [f64]) {
        let Self { rows, runs, wanted, seen, .. } = self;
        for (k, row) in rows.iter().enumerate() {
            seen.channels.iter_mut().for_each(Vec::clear);
            // Every sample that was reached is inside the model's range.
            let _ = row.progress.observe_in(runs.of(k), row.timing, seen);
            for (out, channel) in out.chunks_exact_mut(rows.len()).zip(wanted.iter()) {
                out[k] = seen.channels[*channel].first().copied().unwrap_or(f64::NAN);
            }
        }
    }

    fn settle(&mut self) {}

    fn change(&mut self, row: usize, progress: Progress, failure: Option<Failure>) {
        (self.rows[row].progress, self.rows[row].failure) = (progress, failure);
    }

    fn end(&mut self, row: usize, failure: Failure) {
        self.rows[row].failure.get_or_insert(failure);
    }
}
