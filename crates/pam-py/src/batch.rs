//! `_core.Batch`: many plants advanced together.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::convert::{array, error, values};
use crate::rig::{borrowed, owned, Rig, Signals};
use crate::simulator::watched;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pam_core::batch::Batch as Plants;
use pam_core::simulate::{of_row, Failure, Initial, Timing};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Time [s] and reason of a row's end.
type Ended = Option<(f64, String)>;

/// Plants that wait for their next commands.
#[pyclass(frozen, module = "pamrs._core")]
pub struct Batch {
    /// Gone while a call advances them.
    plants: Mutex<Option<Plants>>,
}

impl Batch {
    fn held(&self) -> MutexGuard<'_, Option<Plants>> {
        self.plants.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Do something with the plants, which no other thread sees meanwhile.
    fn with<T>(&self, act: impl FnOnce(&mut Plants) -> PyResult<T>) -> PyResult<T> {
        let taken = self.held().take();
        let Some(mut plants) = taken else {
            return Err(PyRuntimeError::new_err(
                "the batch is being advanced by another thread; it belongs to one at a time",
            ));
        };
        let done = act(&mut plants);
        *self.held() = Some(plants);
        done
    }
}

#[pymethods]
impl Batch {
    /// One rig for each row, and initial values by name, one for each row.
    #[new]
    fn new(
        py: Python<'_>,
        rigs: Vec<Py<Rig>>,
        sample_time: f64,
        step: f64,
        start: BTreeMap<String, PyReadonlyArray1<'_, f64>>,
        threads: usize,
    ) -> PyResult<Self> {
        let rigs: Vec<_> = rigs.iter().map(|rig| rig.get().shared()).collect();
        let start = start.iter().map(|(name, given)| Ok((name, values(given)?)));
        let start = start.collect::<PyResult<Vec<_>>>()?;
        let made = py.detach(|| {
            let initial = rigs.iter().enumerate().map(|(row, rig)| {
                let given = |initial: Initial, (name, values): &(&String, Vec<f64>)| {
                    initial.with(rig, name, values.get(row).copied().unwrap_or(f64::NAN))
                };
                start.iter().try_fold(Initial::rest(rig), given).map_err(|e| of_row(row, e))
            });
            let initial = initial.collect::<pam_core::Result<Vec<_>>>()?;
            Plants::new(&rigs, Timing::new(sample_time, step)?, &initial, threads)
        });
        Ok(Self { plants: Mutex::new(Some(made.map_err(|e| error(py, &e))?)) })
    }

    /// Hold commands, one for each row, for some samples; the sample after them.
    fn advance<'py>(
        &self,
        py: Python<'py>,
        samples: usize,
        signals: Signals<'py>,
        strict: bool,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let signals = owned(&signals)?;
        let signals = borrowed(&signals);
        self.with(|plants| {
            watched(py, |look| plants.advance(samples, &signals, strict, look))?;
            sample(py, plants)
        })
    }

    /// The present sample, a line for each channel.
    fn observe<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.with(|plants| sample(py, plants))
    }

    /// Numbers of each row that restore it bit for bit.
    #[getter]
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyArray1<f64>>>> {
        self.with(|plants| Ok(plants.states().into_iter().map(|state| array(py, state)).collect()))
    }

    /// Time and reason of the end of each row that has ended.
    #[getter]
    fn status(&self) -> PyResult<Vec<Ended>> {
        self.with(|plants| {
            Ok(plants.failures().map(|f| f.map(|f| (f.time, f.message.clone()))).collect())
        })
    }

    /// Go back, or on, to a state.
    fn restore(
        &self,
        py: Python<'_>,
        samples: u64,
        states: Vec<PyReadonlyArray1<'_, f64>>,
        status: Vec<Ended>,
    ) -> PyResult<()> {
        let states = states.iter().map(values).collect::<PyResult<Vec<_>>>()?;
        let ended = |e: Ended| e.map(|(time, message)| Failure { time, message });
        let failures: Vec<_> = status.into_iter().map(ended).collect();
        self.with(|plants| plants.restore(samples, &states, &failures).map_err(|e| error(py, &e)))
    }

    /// Samples since the start.
    #[getter]
    fn samples(&self) -> PyResult<u64> {
        self.with(|plants| Ok(plants.samples()))
    }

    /// Which rows run side by side in lanes.
    #[getter]
    fn side_by_side(&self) -> PyResult<Vec<bool>> {
        self.with(|plants| Ok(plants.side_by_side()))
    }

    /// Most RK4 steps per sample.
    #[getter]
    fn substeps(&self) -> PyResult<usize> {
        self.with(|plants| Ok(plants.substeps()))
    }
}

/// The present sample of all rows, a line for each channel.
fn sample<'py>(py: Python<'py>, plants: &Plants) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let numbers = plants.observe();
    let n = plants.rows();
    let channels = numbers.len() / n;
    array(py, numbers).reshape([channels, n])
}
