//! What is asked of many plants, and what comes of it.

use super::group::Spent;
use super::reduce::Reduce;
use crate::plant::{ParameterId, Rig};
use crate::room::counted;
use crate::simulate::drive::{check_value, command_missing, input_range};
use crate::simulate::{of_row, Failure, Initial, Timing};
use crate::{Error, Result};

/// A signal over time, the same for every row or one for each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Signal<'a> {
    /// One value for each row of time.
    Common(&'a [f64]),
    /// The same for each plant, one plant after the other.
    Each(&'a [f64]),
}

impl<'a> Signal<'a> {
    /// The signal of one plant.
    #[inline]
    pub(super) fn of(&self, plant: usize, rows: usize) -> &'a [f64] {
        match self {
            Self::Common(values) => values,
            Self::Each(values) => values.get(plant * rows..(plant + 1) * rows).unwrap_or(&[]),
        }
    }
}

/// Plants of one rig with other values of some parameters, starts and signals.
#[derive(Debug, Clone)]
pub struct Request<'a> {
    /// Number of plants.
    pub plants: usize,
    /// Sample time and step.
    pub timing: Timing,
    /// Rows of time: the start, and one for each held sample but the last.
    pub rows: usize,
    /// Signals by name, as [`crate::simulate::drive::Drive::new`] takes them.
    pub signals: Vec<(&'a str, Signal<'a>)>,
    /// Parameters that differ, with a value for each plant.
    pub parameters: Vec<(&'a str, &'a [f64])>,
    /// Initial values that differ from those at rest, with one for each plant.
    pub initial: Vec<(&'a str, &'a [f64])>,
    /// Channels to be kept, by number.
    pub record: Vec<usize>,
    /// Of which samples: each `every`-th.
    pub every: usize,
    /// Numbers that are wanted of each plant.
    pub reduce: Vec<Reduce>,
    /// Threads at most.
    pub threads: usize,
}

/// What came of a [`Request`].
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// For each channel that is kept the samples of each plant, one plant after the other. Those of
    /// a plant that ended stay at its last good sample.
    pub recorded: Vec<Vec<f64>>,
    /// For each number that is wanted its value for each plant, NaN for one that ended.
    pub reduced: Vec<Vec<f64>>,
    /// Why plants ended, of those that did.
    pub failures: Vec<Option<Failure>>,
    /// What it cost.
    pub spent: Spent,
}

/// A request that was checked, with its parameters found.
pub(super) struct Checked<'a, 'r> {
    pub rig: &'a Rig,
    pub request: &'a Request<'r>,
    pub places: Vec<ParameterId>,
}

impl<'a, 'r> Checked<'a, 'r> {
    /// # Errors
    /// [`Error::Length`] for signals, parameters or initial values of another number,
    /// [`Error::Model`] for an unknown or a missing one, [`Error::Parameter`] for a command that
    /// is not possible; they name the row.
    pub fn new(rig: &'a Rig, request: &'a Request<'r>) -> Result<Self> {
        let Request { plants, rows, .. } = *request;
        let numbers = counted::<f64>("signals", &[plants, rows]);
        let given = request.parameters.iter().chain(&request.initial);
        for (name, values) in given {
            check_length(name, values.len(), plants, "one for each row")?;
        }
        for (name, signal) in &request.signals {
            match signal {
                Signal::Common(values) => check_length(name, values.len(), rows, "one per sample")?,
                Signal::Each(values) => {
                    check_length(name, values.len(), numbers.clone()?, "one per row and sample")?;
                }
            }
        }
        let find = |(name, _): &(&str, &[f64])| rig.parameters().find(name);
        let places = request.parameters.iter().map(find).collect::<Result<_>>()?;
        for (input, name) in rig.names().inputs.iter().enumerate() {
            match request.signals.iter().find(|(given, _)| given == name) {
                Some((_, signal)) => check_commands(rig, request, input, signal)?,
                None if input < rig.spec().valves.len() => return Err(command_missing(name)),
                None => {}
            }
        }
        Ok(Self { rig, request, places })
    }

    /// All parameter values of a plant.
    pub fn values(&self, plant: usize) -> Vec<f64> {
        let mut values = self.rig.parameters().values().to_vec();
        for (place, (_, given)) in self.places.iter().zip(&self.request.parameters) {
            values[place.index()] = given[plant];
        }
        values
    }

    /// Where a plant begins.
    pub fn initial(&self, plant: usize) -> Result<Initial> {
        let mut initial = Initial::rest(self.rig);
        for (name, values) in &self.request.initial {
            initial = initial.with(self.rig, name, values[plant]).map_err(|e| of_row(plant, e))?;
        }
        Ok(initial)
    }
}

fn check_length(name: &str, found: usize, expected: usize, why: &str) -> Result<()> {
    if found == expected {
        return Ok(());
    }
    Err(Error::Length { name: name.into(), found, expected, why: why.into() })
}

fn check_commands(
    rig: &Rig,
    request: &Request<'_>,
    input: usize,
    signal: &Signal<'_>,
) -> Result<()> {
    let name = &rig.names().inputs[input];
    let (low, high, unit) = input_range(rig, input);
    let (values, many) = match signal {
        Signal::Common(values) => (*values, false),
        Signal::Each(values) => (*values, true),
    };
    for (k, value) in values.iter().enumerate() {
        let at = || match many {
            true => format!("{name}[{}][{}]", k / request.rows, k % request.rows),
            false => format!("{name}[{k}]"),
        };
        check_value(at, *value, (low, high), unit)?;
    }
    Ok(())
}
