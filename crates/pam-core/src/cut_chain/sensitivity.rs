//! Prediction of a block with its derivatives, some parameters at a time in the lanes of a dual
//! number.

use super::block::{check, Block};
use super::measured::Measured;
use super::window::Cut;
use crate::dual::{Dual, LANES, WIDE_LANES};
use crate::effects::Number;
use crate::plant::{ParameterId, Place, Plant, Rig};
use crate::room::room;
use crate::scalar::constant;
use crate::simulate::Timing;
use crate::{Error, Result};

/// Prediction of a block's output with its sensitivities.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Predicted output at each sample, as the sensor reads it.
    pub value: Vec<f64>,
    /// Row-major `samples x (parameters + initial states + knots)`: derivatives with respect to each
    /// parameter, to the initial states of the window that the row belongs to, and to the heights of
    /// an input at the knots of that window.
    pub jacobian: Vec<f64>,
    /// Columns of the jacobian.
    pub columns: usize,
}

/// Predict a block's output over windows.
///
/// `starts` are the sample indices at which windows begin (rising, the first one 0). `parameters`
/// are those to differentiate with respect to; pass none for values alone (`columns` is then 0).
///
/// # Errors
/// [`Error::Parameter`] for bad arguments; [`Error::Model`] when the block lacks a measured
/// neighbour; [`Error::Integration`] when the state leaves the model's range.
pub fn predict(
    rig: &Rig,
    block: Block,
    measured: &Measured<'_>,
    timing: Timing,
    starts: &[usize],
    parameters: &[ParameterId],
) -> Result<Prediction> {
    let n = measured.samples;
    check(rig, block, measured, starts)?;
    let initial = block.initial_count(rig, measured);
    let knots = measured.knots(starts).into_iter().max().unwrap_or(0);
    let value = room("samples", &[n], 0.0)?;
    let mut out = Prediction { value, jacobian: Vec::new(), columns: 0 };
    if parameters.is_empty() && knots == 0 {
        let plant = Plant::new(rig, rig.parameters().lift(), false)?;
        let bumps = vec![0.0; initial];
        Cut::new(plant, block, measured, timing, bumps, Vec::new())
            .run(starts, |k, y, _, _, _| out.value[k] = y)?;
        return Ok(out);
    }
    out.columns = parameters.len() + initial + knots;
    out.jacobian = room("sensitivities", &[n, out.columns], 0.0)?;
    let columns: Vec<usize> = (0..out.columns).collect();
    // knots of one window do nothing in another, parameters do: they are not differentiated together
    let (lasting, passing) = columns.split_at(parameters.len() + initial);
    for mut left in [lasting, passing] {
        while !left.is_empty() {
            let wide = left.len() > LANES;
            let (chunk, rest) =
                left.split_at(left.len().min(if wide { WIDE_LANES } else { LANES }));
            let task = Task { rig, block, measured, timing, starts, parameters, knots };
            if wide {
                task.differentiate::<WIDE_LANES>(chunk, &mut out)?;
            } else {
                task.differentiate::<LANES>(chunk, &mut out)?;
            }
            left = rest;
        }
    }
    Ok(out)
}

/// A prediction of which some columns are wanted at a time.
struct Task<'a> {
    rig: &'a Rig,
    block: Block,
    measured: &'a Measured<'a>,
    timing: Timing,
    starts: &'a [usize],
    parameters: &'a [ParameterId],
    knots: usize,
}

impl Task<'_> {
    /// The values, and the derivatives of up to `N` columns.
    fn differentiate<const N: usize>(&self, columns: &[usize], out: &mut Prediction) -> Result<()>
    where
        Dual<N>: Number,
    {
        let Self { rig, block, measured, timing, starts, parameters, knots } = *self;
        let mut values = rig.parameters().lift::<Dual<N>>();
        let mut bumps = vec![constant::<Dual<N>>(0.0); block.initial_count(rig, measured)];
        let mut hats = vec![constant::<Dual<N>>(0.0); knots];
        let first = parameters.len();
        for (lane, column) in columns.iter().enumerate() {
            let along = Dual::from(0.0).along(lane);
            match parameters.get(*column) {
                Some(id) => values.seed(*id, lane),
                None if column - first < bumps.len() => bumps[column - first] = along,
                None => hats[column - first - bumps.len()] = along,
            }
        }
        let plant = Plant::new(rig, values, false)?;
        let Prediction { value, jacobian, columns: width } = out;
        Cut::new(plant, block, measured, timing, bumps, hats).run(starts, |k, y, _, _, _| {
            value[k] = y.re;
            for (column, slope) in columns.iter().zip(y.eps) {
                jacobian[k * *width + column] = slope;
            }
        })
    }
}

/// Terms of the closure in a block at each sample of a prediction, row-major `samples x terms`, and
/// their number: what its coefficients multiply.
///
/// # Errors
/// As [`predict`]; [`Error::Model`] for a block without a closure.
pub fn closure_terms(
    rig: &Rig,
    block: Block,
    measured: &Measured<'_>,
    timing: Timing,
    starts: &[usize],
) -> Result<(Vec<f64>, usize)> {
    check(rig, block, measured, starts)?;
    let at = match block {
        Block::Supply(k) => Place::Supply(k),
        Block::Chamber(k) | Block::Temperature(k) | Block::Flow(k) => Place::Gas(k),
        Block::Arm(k) | Block::Pull(k) => Place::Joint(k),
    };
    let plant = Plant::new(rig, rig.parameters().lift(), false)?;
    let (mut found, mut count) = (Vec::new(), 0);
    let bumps = vec![0.0; block.initial_count(rig, measured)];
    Cut::new(plant, block, measured, timing, bumps, Vec::new()).run(
        starts,
        |_, _, stepper, state, controls| {
            let terms = stepper.plant.terms(at, state, controls, &stepper.scratch);
            count = terms.len();
            found.extend(terms);
        },
    )?;
    if count == 0 {
        return Err(Error::Model(format!(
            "block '{block:?}' has no closure: no sum of terms acts there"
        )));
    }
    Ok((found, count))
}
