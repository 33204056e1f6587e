//! `_core.Rig.side_by_side`: many plants of one rig in vector lanes.

use std::collections::BTreeMap;

use crate::convert::{array, error, values};
use crate::rig::Rig;
use crate::simulator::watched;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pam_core::lanes::{simulate, Outcome, Reduce, Reduction, Request, Signal};
use pam_core::simulate::Timing;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Arrays by name.
type Arrays<'py> = BTreeMap<String, PyReadonlyArrayDyn<'py, f64>>;
/// Channel, reduction and reference.
type Reduced<'py> = Vec<(String, String, Vec<f64>)>;
/// Time [s] and reason of a row's end.
type Ended = Option<(f64, String)>;

/// What came of the plants: kept channels, reduced numbers, why some ended.
type Results<'py> = (Vec<Bound<'py, PyArray2<f64>>>, Vec<Bound<'py, PyArray1<f64>>>, Vec<Ended>);

/// One run of many plants.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn side_by_side<'py>(
    py: Python<'py>,
    rig: &Rig,
    plants: usize,
    rows: usize,
    signals: Arrays<'py>,
    sample_time: f64,
    step: f64,
    parameters: Arrays<'py>,
    initial: Arrays<'py>,
    record: Vec<String>,
    every: usize,
    reduce: Reduced<'py>,
    threads: usize,
) -> PyResult<Results<'py>> {
    let core = rig.shared();
    let (signals, parameters, initial) = (owned(&signals)?, owned(&parameters)?, owned(&initial)?);
    let request = request(
        &core,
        (plants, rows, every.max(1), threads),
        Timing::new(sample_time, step).map_err(|e| error(py, &e))?,
        [&signals, &parameters, &initial],
        &record,
        &reduce,
    );
    let request = request.map_err(|e| error(py, &e))?;
    let mut done = None;
    watched(py, |look| {
        done = Some(simulate(&core, &request, look)?);
        Ok(())
    })?;
    let Some(Outcome { recorded, reduced, failures, .. }) = done else {
        return Err(PyValueError::new_err("nothing was simulated"));
    };
    let kept = rows.div_ceil(every.max(1));
    let recorded = recorded.into_iter().map(|channel| array(py, channel).reshape([plants, kept]));
    Ok((
        recorded.collect::<PyResult<_>>()?,
        reduced.into_iter().map(|numbers| array(py, numbers)).collect(),
        failures.into_iter().map(|f| f.map(|f| (f.time, f.message))).collect(),
    ))
}

/// Name, values, and whether there is a line for each plant.
type Owned = Vec<(String, Vec<f64>, bool)>;

fn owned(arrays: &Arrays<'_>) -> PyResult<Owned> {
    arrays.iter().map(|(name, a)| Ok((name.clone(), values(a)?, a.ndim() == 2))).collect()
}

fn request<'a>(
    rig: &pam_core::Rig,
    (plants, rows, every, threads): (usize, usize, usize, usize),
    timing: Timing,
    [signals, parameters, initial]: [&'a Owned; 3],
    record: &[String],
    reduce: &Reduced<'_>,
) -> pam_core::Result<Request<'a>> {
    let channel = |name: &String| rig.names().channel(name);
    let plain =
        |owned: &'a Owned| owned.iter().map(|(n, v, _)| (n.as_str(), v.as_slice())).collect();
    let signal = |(name, values, each): &'a (String, Vec<f64>, bool)| {
        (name.as_str(), if *each { Signal::Each(values) } else { Signal::Common(values) })
    };
    let reduced = |(name, kind, reference): &(String, String, Vec<f64>)| {
        let reduction = Reduction::named("reduce", kind)?;
        Ok(Reduce { channel: channel(name)?, reduction, reference: reference.clone() })
    };
    Ok(Request {
        plants,
        timing,
        rows,
        signals: signals.iter().map(signal).collect(),
        parameters: plain(parameters),
        initial: plain(initial),
        record: record.iter().map(channel).collect::<pam_core::Result<_>>()?,
        every,
        reduce: reduce.iter().map(reduced).collect::<pam_core::Result<_>>()?,
        threads,
    })
}
