//! One error type: every message names the quantity, its value and what is allowed.

use thiserror::Error;

/// What can be wrong with an input of the core.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter or argument outside its allowed range (NaN included).
    #[error("{name} = {} is not allowed: {allowed}", told(*value))]
    Parameter {
        /// The parameter's dotted name, for example `muscle.braid_angle`.
        name: String,
        /// The value that was given.
        value: f64,
        /// What is allowed, in words with the unit.
        allowed: String,
    },
    /// Two arrays that must have matching lengths do not.
    #[error("{name} has {found} values, {expected} expected ({why})")]
    Length {
        /// The argument's name.
        name: String,
        /// Values found.
        found: usize,
        /// Values expected.
        expected: usize,
        /// Where the expectation comes from.
        why: String,
    },
    /// More room is asked for than is allowed, or than there is.
    #[error("room for {} {name} is not allowed: {allowed}", told(*count))]
    Room {
        /// What it is for.
        name: String,
        /// Entries that were asked for.
        count: f64,
        /// What is allowed.
        allowed: String,
    },
    /// A parameter has a name for its value that is not known, or does not belong to the model
    /// chosen.
    #[error("{name} = {value} is not allowed: {allowed}")]
    Choice {
        /// Dotted name of the parameter.
        name: String,
        /// The value as it was written.
        value: String,
        /// What is allowed.
        allowed: String,
    },
    /// The model description cannot be read, or its blocks do not fit together.
    #[error("{0}")]
    Model(String),
    /// The integration left the range in which the model holds.
    #[error("integration stopped at time = {time} s: {name} = {}, {allowed}", told(*value))]
    Integration {
        /// Simulated time [s].
        time: f64,
        /// The state that left its range.
        name: String,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: String,
    },
}

impl Error {
    /// A [`Error::Parameter`] from its parts.
    pub fn parameter(name: impl Into<String>, value: f64, allowed: impl Into<String>) -> Self {
        Self::Parameter { name: name.into(), value, allowed: allowed.into() }
    }
}

/// A number as a message has it: not in three hundred digits.
fn told(value: f64) -> String {
    match value.abs() {
        size if size.is_finite() && size != 0.0 && !(1e-12..1e16).contains(&size) => {
            format!("{value:e}")
        }
        _ => value.to_string(),
    }
}

/// Result of a core operation.
pub type Result<T> = std::result::Result<T, Error>;

/// `value` if it is finite and inside `[low, high]`, otherwise an error that names it.
pub fn check_range(name: &str, value: f64, low: f64, high: f64, unit: &str) -> Result<f64> {
    if value.is_finite() && value >= low && value <= high {
        Ok(value)
    } else {
        Err(Error::parameter(name, value, format!("a finite number from {low} to {high} {unit}")))
    }
}

/// The value of a name in a list of them.
///
/// # Errors
/// [`Error::Choice`] that names the parameter and lists what it may be.
pub(crate) fn named<T: Copy>(
    parameter: &str,
    name: &str,
    names: &[(&'static str, T)],
) -> Result<T> {
    names.iter().find(|(known, _)| *known == name).map(|(_, value)| *value).ok_or_else(|| {
        let known: Vec<_> = names.iter().map(|(known, _)| format!("\"{known}\"")).collect();
        Error::Choice {
            name: parameter.into(),
            value: format!("\"{name}\""),
            allowed: format!("one of {}", known.join(", ")),
        }
    })
}

/// The error of a model that cannot be, in words.
pub(crate) fn model<T>(text: impl Into<String>) -> Result<T> {
    Err(Error::Model(text.into()))
}
