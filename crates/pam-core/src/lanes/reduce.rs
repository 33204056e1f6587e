//! A number for a whole run, gathered sample by sample, so that nobody keeps the trajectory.

use crate::error::named;
use crate::Result;

/// How the samples of a channel become one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reduction {
    /// The last sample.
    Final,
    /// The least one.
    Min,
    /// The greatest one.
    Max,
    /// The largest magnitude.
    Peak,
    /// The mean of all samples.
    Mean,
    /// Time integral of the squared difference from a reference, by the trapezoidal rule.
    SquaredError,
}

impl Reduction {
    /// Names, public API.
    pub const NAMES: [(&'static str, Self); 6] = [
        ("final", Self::Final),
        ("min", Self::Min),
        ("max", Self::Max),
        ("peak", Self::Peak),
        ("mean", Self::Mean),
        ("squared_error", Self::SquaredError),
    ];

    /// The reduction of a name.
    ///
    /// # Errors
    /// [`crate::Error::Choice`] that names the parameter and lists what it may be.
    pub fn named(name: &str, reduction: &str) -> Result<Self> {
        named(name, reduction, &Self::NAMES)
    }
}

/// One number that is wanted of each row.
#[derive(Debug, Clone, PartialEq)]
pub struct Reduce {
    /// Number of the channel.
    pub channel: usize,
    /// What is made of it.
    pub reduction: Reduction,
    /// What the squared error is reckoned from, one value for each row of time, in the channel's
    /// unit; empty for zero.
    pub reference: Vec<f64>,
}

impl Reduce {
    /// The number before the first sample.
    pub(super) fn start(&self) -> f64 {
        match self.reduction {
            Reduction::Min => f64::INFINITY,
            Reduction::Max => f64::NEG_INFINITY,
            _ => 0.0,
        }
    }

    /// The number with one sample more, of `rows` that are `sample_time` [s] apart.
    #[inline]
    pub(super) fn with(
        &self,
        sum: f64,
        value: f64,
        row: usize,
        rows: usize,
        sample_time: f64,
    ) -> f64 {
        match self.reduction {
            Reduction::Final => value,
            Reduction::Min => sum.min(value),
            Reduction::Max => sum.max(value),
            Reduction::Peak => sum.max(value.abs()),
            Reduction::Mean => sum + (value - sum) / (row + 1) as f64,
            Reduction::SquaredError => {
                let off = value - self.reference.get(row).copied().unwrap_or(0.0);
                let end = row == 0 || row + 1 == rows;
                sum + off * off * if end { 0.5 * sample_time } else { sample_time }
            }
        }
    }
}
