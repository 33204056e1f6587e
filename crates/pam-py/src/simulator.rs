//! `_core.Simulator`: a simulation that goes on sample by sample, and what it shares with
//! `Rig.simulate`.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::convert::{array, error, values};
use crate::rig::{borrowed, owned, Rig, Signals};
use numpy::{PyArray1, PyReadonlyArray1, PyReadwriteArray2};
use pam_core::simulate::drive::Drive;
use pam_core::simulate::run::OwnedRun;
use pam_core::simulate::{Initial, Progress, Timing, Trajectory};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFloat, PyString};

/// Do something without the interpreter that looks at Ctrl-C now and then.
pub fn watched(
    py: Python<'_>,
    work: impl FnOnce(&mut dyn FnMut() -> pam_core::Result<()>) -> pam_core::Result<()> + Send,
) -> PyResult<()> {
    let mut stopped = None;
    let done = py.detach(|| {
        work(&mut || {
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
pub fn channels<'py, 'n>(
    py: Python<'py>,
    names: impl IntoIterator<Item = &'n str>,
    t: Trajectory,
) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    for (name, values) in names.into_iter().zip(t.channels) {
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

/// A sample as numbers by name, and what happened on the way to it, if anything.
type Stepped<'py> = (Bound<'py, PyDict>, Option<Vec<EventRow>>);

/// What a sample is worked out with, kept from one to the next.
struct Work {
    run: OwnedRun,
    out: Trajectory,
    /// Where the samples of a call stand until it is done.
    progress: Progress,
    /// One sample without commands.
    drive: Drive<'static>,
}

/// RK4 steps that are not worth giving the interpreter to other threads meanwhile.
const SHORT: usize = 16;

/// A simulation of a rig that waits for its next command.
#[pyclass(frozen, module = "pamrs._core")]
pub struct Simulator {
    rig: Arc<pam_core::Rig>,
    timing: Timing,
    progress: Mutex<Progress>,
    /// Whether a call is advancing it.
    busy: AtomicBool,
    /// Gone while a call uses it; another thread that calls meanwhile makes its own.
    work: Mutex<Option<Box<Work>>>,
    names: Vec<Py<PyString>>,
    /// A sample to be copied: its entries stand where they belong.
    sample: Py<PyDict>,
    /// One valve, and nothing else that must be given.
    lone: bool,
}

impl Simulator {
    fn progress(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn work(&self) -> MutexGuard<'_, Option<Box<Work>>> {
        self.work.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Advance what another call does not advance meanwhile.
    fn alone<T>(&self, act: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
        if self.busy.swap(true, Ordering::AcqRel) {
            return Err(PyRuntimeError::new_err(
                "this Simulator is being advanced by another thread: it belongs to one thread at a \
                    time",
            ));
        }
        let done = act();
        self.busy.store(false, Ordering::Release);
        done
    }

    /// Do something with what a sample is worked out with.
    fn with_work<T>(
        &self,
        py: Python<'_>,
        act: impl FnOnce(&mut Work) -> PyResult<T>,
    ) -> PyResult<T> {
        let kept = self.work().take();
        let mut work = match kept {
            Some(work) => work,
            None => Box::new(Work {
                run: OwnedRun::new(Arc::clone(&self.rig)).map_err(|e| error(py, &e))?,
                out: Trajectory::new(&self.rig, 1),
                progress: Progress::default(),
                drive: Drive::idle(&self.rig),
            }),
        };
        let done = act(&mut work);
        work.out.channels.iter_mut().for_each(Vec::clear);
        work.out.events.clear();
        *self.work() = Some(work);
        done
    }

    /// Hold the commands of a drive of one sample for some samples.
    fn held(
        &self,
        py: Python<'_>,
        samples: usize,
        drive: &Drive<'_>,
        run: &mut OwnedRun,
        progress: &mut Progress,
        out: &mut Trajectory,
    ) -> PyResult<()> {
        self.alone(|| {
            progress.clone_from(&self.progress());
            let mut hold = |look: &mut dyn FnMut() -> pam_core::Result<()>| {
                run.with(|run| {
                    (0..samples).try_for_each(|_| {
                        progress.advance_in(run, self.timing, drive, 0..1, out, look)
                    })
                })
            };
            let done = if samples.saturating_mul(self.timing.substeps) <= SHORT {
                hold(&mut || Ok(())).map_err(|e| error(py, &e))
            } else {
                watched(py, hold)
            };
            std::mem::swap(progress, &mut self.progress());
            done
        })
    }

    /// The last sample of a trajectory, a number for each channel.
    fn last<'py>(&self, py: Python<'py>, out: &Trajectory) -> PyResult<Bound<'py, PyDict>> {
        let sample = self.sample.bind(py).copy()?;
        for (name, values) in self.names.iter().zip(&out.channels) {
            if let Some(value) = values.last() {
                sample.set_item(name, *value)?;
            }
        }
        Ok(sample)
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
            .and_then(|t| Ok((t.stable(&rig)?, Progress::start(&rig, &initial(&rig, &start)?)?)));
        let (timing, progress) = made.map_err(|e| error(py, &e))?;
        let names: Vec<Py<PyString>> = (rig.names().channels.iter())
            .map(|(name, _)| PyString::intern(py, name).unbind())
            .collect();
        let spec = rig.spec();
        let lone = spec.valves.len() == 1 && !spec.load.as_ref().is_some_and(|l| l.is_frame());
        let sample = PyDict::new(py);
        names.iter().try_for_each(|name| sample.set_item(name, f64::NAN))?;
        Ok(Self {
            rig,
            timing,
            progress: Mutex::new(progress),
            busy: AtomicBool::new(false),
            work: Mutex::new(None),
            names,
            sample: sample.unbind(),
            lone,
        })
    }

    /// Hold each command for one sample; the samples after them as channels by name, and what
    /// happened on the way.
    fn advance<'py>(
        &self,
        py: Python<'py>,
        samples: usize,
        signals: Signals<'py>,
    ) -> PyResult<(Bound<'py, PyDict>, Vec<EventRow>)> {
        let signals = owned(&signals)?;
        let drive =
            Drive::new(&self.rig, samples, &borrowed(&signals)).map_err(|e| error(py, &e))?;
        let mut out = Trajectory::new(&self.rig, samples);
        self.with_work(py, |work| {
            let run = &mut work.run;
            self.alone(|| {
                let mut progress = self.progress().clone();
                let done = watched(py, |look| {
                    run.with(|run| {
                        progress.advance_in(run, self.timing, &drive, 0..samples, &mut out, look)
                    })
                });
                *self.progress() = progress;
                done
            })
        })?;
        let happened = events(&out);
        let names = self.rig.names().channels.iter().map(|(name, _)| name.as_str());
        Ok((channels(py, names, out)?, happened))
    }

    /// Hold one command for some samples: the last of them as numbers by name, and what happened on
    /// the way. All of them are written to `rows`, one line for each channel, from a column on,
    /// where it is given.
    #[pyo3(signature = (samples, signals, rows=None, column=0))]
    fn hold<'py>(
        &self,
        py: Python<'py>,
        samples: usize,
        signals: &Bound<'py, PyDict>,
        rows: Option<PyReadwriteArray2<'py, f64>>,
        column: usize,
    ) -> PyResult<(Bound<'py, PyDict>, Vec<EventRow>)> {
        let given = signals
            .iter()
            .map(|(name, value)| Ok((name.cast_into::<PyString>()?, value.extract::<f64>()?)));
        let given = given.collect::<PyResult<Vec<_>>>()?;
        let named =
            given.iter().map(|(name, value)| Ok((name.to_str()?, std::slice::from_ref(value))));
        let named = named.collect::<PyResult<Vec<_>>>()?;
        let drive = Drive::new(&self.rig, 1, &named).map_err(|e| error(py, &e))?;
        self.with_work(py, |Work { run, out, progress, .. }| {
            self.held(py, samples, &drive, run, progress, out)?;
            if let Some(mut rows) = rows {
                let mut rows = rows.as_array_mut();
                for (mut row, values) in rows.outer_iter_mut().zip(&out.channels) {
                    for (to, value) in row.iter_mut().skip(column).zip(values) {
                        *to = *value;
                    }
                }
            }
            Ok((self.last(py, out)?, events(out)))
        })
    }

    /// Hold a command of the only valve for one sample, the other inputs being left to themselves:
    /// the sample as numbers by name, and what happened on the way, if anything. None, and nothing
    /// is done, for a rig that takes other commands and for what is no finite float.
    fn step<'py>(
        &self,
        py: Python<'py>,
        command: &Bound<'py, PyAny>,
    ) -> PyResult<Option<Stepped<'py>>> {
        let Ok(command) = command.cast::<PyFloat>() else { return Ok(None) };
        let command = command.value();
        if !(self.lone && command.is_finite()) {
            return Ok(None);
        }
        self.with_work(py, |Work { run, out, progress, drive }| {
            drive.command(0, command);
            self.held(py, 1, drive, run, progress, out)?;
            let happened = if out.events.is_empty() { None } else { Some(events(out)) };
            Ok(Some((self.last(py, out)?, happened)))
        })
    }

    /// The present sample as numbers by name.
    fn observe<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.with_work(py, |Work { run, out, .. }| {
            let progress = self.progress().clone();
            run.with(|run| progress.observe_in(run, self.timing, out))
                .map_err(|e| error(py, &e))?;
            self.last(py, out)
        })
    }

    /// Numbers of the state that restore it bit for bit.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.progress().to_vec())
    }

    /// Go back, or on, to a state.
    fn restore(&self, py: Python<'_>, state: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        let restored = self.progress().restored(&self.rig, &values(&state)?);
        let restored = restored.map_err(|e| error(py, &e))?;
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
