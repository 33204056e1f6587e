//! One of many plants: why it ended, and errors that say which one it was.

use crate::Error;

/// Why and when a row has ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// Simulated time [s].
    pub time: f64,
    /// What happened.
    pub message: String,
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
        Error::Room { name, count, allowed } => Error::Room { name: named(name), count, allowed },
        Error::Model(message) => Error::Model(named(message)),
    }
}
