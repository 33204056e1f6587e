//! `_core.Simulator`: a simulation that goes on sample by sample, and the one way both it and `Rig.simulate` run.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::convert::{array, error, values};
use crate::rig::{borrowed, owned, Rig, Signals};
use numpy::{PyArray1, PyReadonlyArray1};
use pam_core::drive::Drive;
use pam_core::simulate::{Initial, Progress, Timing, Trajectory};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Advance a progress without the interpreter, looking at Ctrl-C now and then.
pub fn run(
    py: Python<'_>,
    rig: &pam_core::Rig,
    timing: Timing,
    progress: &mut Progress,
    drive: &Drive<'_>,
    out: &mut Trajectory,
) -> PyResult<()> {
    let mut stopped = None;
    let done = py.detach(|| {
        progress.advance_watched(rig, timing, drive, out, &mut || {
            Python::attach(|py| py.check_signals()).map_err(|signal| {
                stopped = Some(signal);
                pam_core::Error::Model("interrupted".into())
            })
        })
    });
    match (stopped, done) {
        (Some(signal), _) => Err(signal),
        (None, done) => done.map_err(|e| error(py, &e)),
    }
}

/// Channels of a trajectory by name.
pub fn channels<'py>(py: Python<'py>, rig: &pam_core::Rig, t: Trajectory) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    for ((name, _), values) in rig.names().channels.iter().zip(t.channels) {
        out.set_item(name, array(py, values))?;
    }
    Ok(out)
}

/// Time [s], kind and block of an event.
pub type EventRow = (f64, &'static str, String);

/// Events of a trajectory.
pub fn events(t: &Trajectory) -> Vec<EventRow> {
    t.events.iter().map(|e| (e.time, e.kind.name(), e.block.clone())).collect()
}

/// Initial values by name; what is left out is at rest.
pub fn initial(rig: &pam_core::Rig, given: &BTreeMap<String, f64>) -> pam_core::Result<Initial> {
    given.iter().try_fold(Initial::rest(rig), |start, (name, value)| start.with(rig, name, *value))
}

/// A simulation of a rig that waits for its next command.
#[pyclass(frozen, module = "pamrs._core")]
pub struct Simulator {
    rig: Arc<pam_core::Rig>,
    timing: Timing,
    progress: Mutex<Progress>,
}

impl Simulator {
    fn progress(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Simulator {
    #[new]
    fn new(
        py: Python<'_>,
        rig: &Rig,
        sample_time: f64,
        step: f64,
        start: BTreeMap<String, f64>,
    ) -> PyResult<Self> {
        let rig = rig.shared();
        let made = Timing::new(sample_time, step)
            .and_then(|t| Ok((t.stable(&rig), Progress::start(&rig, &initial(&rig, &start)?)?)));
        let (timing, progress) = made.map_err(|e| error(py, &e))?;
        Ok(Self { rig, timing, progress: Mutex::new(progress) })
    }

    /// Hold each command for one sample; the samples after them as channels by name, and what happened on the way.
    fn advance<'py>(
        &self,
        py: Python<'py>,
        samples: usize,
        signals: Signals<'py>,
    ) -> PyResult<(Bound<'py, PyDict>, Vec<EventRow>)> {
        let signals = owned(&signals);
        let drive = Drive::new(&self.rig, samples, &borrowed(&signals)).map_err(|e| error(py, &e))?;
        let mut out = Trajectory::new(&self.rig, samples);
        let mut progress = self.progress().clone();
        let done = run(py, &self.rig, self.timing, &mut progress, &drive, &mut out);
        *self.progress() = progress;
        done?;
        let happened = events(&out);
        Ok((channels(py, &self.rig, out)?, happened))
    }

    /// The present sample as channels by name, one value each.
    fn observe<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let mut out = Trajectory::new(&self.rig, 1);
        let progress = self.progress().clone();
        progress.observe(&self.rig, self.timing, &mut out).map_err(|e| error(py, &e))?;
        channels(py, &self.rig, out)
    }

    /// Numbers of the state that restore it bit for bit.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.progress().to_vec())
    }

    /// Go back, or on, to a state.
    fn restore(&self, py: Python<'_>, state: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        let restored = self.progress().restored(&values(&state)).map_err(|e| error(py, &e))?;
        *self.progress() = restored;
        Ok(())
    }

    /// RK4 steps per sample.
    #[getter]
    fn substeps(&self) -> usize {
        self.timing.substeps
    }

    /// Samples since the start.
    #[getter]
    fn samples(&self) -> u64 {
        self.progress().samples()
    }
}
