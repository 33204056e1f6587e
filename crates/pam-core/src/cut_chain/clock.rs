//! Clocks: pressures, angles and commands may be recorded by different ones.

use super::block::Block;
use crate::plant::Plant;
use crate::scalar::{constant, Scalar};

/// Shifts between the clocks at a time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clocks<S> {
    /// How much later a neighbour of another clock is read than it is recorded [s].
    pub neighbour: S,
    /// How late a command acts [s].
    pub command: S,
}

impl<S: Scalar> Clocks<S> {
    /// For a block, whose own clock is that of what it predicts, at a time [s].
    pub fn of(plant: &Plant<'_, S>, block: Block, time: f64) -> Self {
        if !plant.skewed() {
            return Self { neighbour: constant(0.0), command: constant(0.0) };
        }
        let (pressures, angles) = plant.skew(time);
        if block.mechanical() {
            Self { neighbour: pressures - angles, command: angles }
        } else {
            Self { neighbour: angles - pressures, command: pressures }
        }
    }
}
